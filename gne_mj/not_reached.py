"""Why a run has ended without reaching y*, though it stayed inside: what was seen, each a sentence.

Outputs that rest elsewhere are held there by something: a limit that is met, a load that the input
holds (a push, or the file's own gravity, springs, drag and friction), a joint at its stop, wheels
that slip. Outputs that move still need time, or are kept moving.
"""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from gne_mj import run_metrics
from gne_mj.faults import Push
from gne_mj.plants import acting_forces
from gne_mj.plants.base import Plant
from gne_mj.plants.callbacks import quiet
from gne_mj.plants.fleet_plant import FleetPlant
from gne_mj.run_metrics import SETTLED, TAIL
from gne_mj.system import System
from gne_mj.system.first_input import limits_at

Array = NDArray[np.float64]
STILL = 0.02  # outputs rest if over the last part they move by less than this share of what is left
CLOSER = 0.02  # and come closer if that part takes away more
FULL = 1.0 - 1e-9  # of a limit: it is met
MANY = 0.2  # of the run: limits met so long are told even if none is at the end
LOOKS = 20  # steps beyond the end at which contacts are looked at
SLIPS = 0.01  # m/s at which a contact slides, where friction has nothing left


@dataclass(frozen=True)
class Ended:
    """A run that came to its end.

    Args:
        system: what was run, the game and penalty being those of its end.
        time: (samples,) in s.
        action, inputs: (samples, m); inputs are not numbers where there are none.
        distance: (samples,) max |y - y*|.
        duration: in s.
        plant: as it is at the end.
    """

    system: System
    time: Array
    action: Array
    inputs: Array
    distance: Array
    duration: float
    plant: Plant | None

    @cached_property
    def _twin(self) -> FleetPlant | None:
        return self.plant.twin() if isinstance(self.plant, FleetPlant) else None

    @property
    def fleet(self) -> FleetPlant | None:
        """A copy of a fleet in MuJoCo as it is at the end, forces evaluated; None of others."""
        twin = self._twin
        if twin is None or not isinstance(self.plant, FleetPlant):
            return None
        acting_forces.restore(twin, acting_forces.saved(self.plant))
        with quiet():
            mujoco.mj_forward(twin.model, twin.data)
        return twin

    @property
    def tail(self) -> NDArray[np.bool_]:
        """(samples,) which are of the last part of the run, the last two at least."""
        begin = min(self.time[-1] - TAIL * self.duration - 1e-9, self.time[-2:][0])
        late: NDArray[np.bool_] = self.time >= begin
        return late

    @property
    def away(self) -> Array:
        """(m,) y - y* at the end."""
        found: Array = self.action[-1] - self.system.centre
        return found

    @property
    def far(self) -> NDArray[np.bool_]:
        """(m,) which outputs have not settled."""
        least = SETTLED * max(self.distance[0], self.distance[-1])
        far: NDArray[np.bool_] = np.abs(self.away) > least
        return far

    @property
    def rests(self) -> NDArray[np.bool_]:
        """(m,) which outputs do not move any more, for what is left to go."""
        late = self.action[self.tail]
        still: NDArray[np.bool_] = np.ptp(late, axis=0) <= STILL * self.distance[-1]
        return still

    def agents(self, channels: NDArray[np.bool_]) -> list[int]:
        """The agents of these channels, from 1."""
        return sorted({int(i) + 1 for i in self.system.game.agent_of_action[channels]})


@dataclass(frozen=True)
class Reason:
    """One of them.

    Args:
        reason: "limit", "load", "stop", "slip", "short" or "moving".
        agents: whose, from 1.
        text: in words.
        figures: in numbers.
    """

    reason: str
    agents: list[int]
    text: str
    figures: dict[str, Any] = field(default_factory=dict)


def report(
    system: System,
    time: Array,
    action: Array,
    inputs: Array,
    *,
    duration: float,
    tolerance: float,
    plant: Plant | None,
) -> list[dict[str, Any]] | None:
    """Why y* was not reached; None where it was, or is not asked for: it moves, or is not known.

    Args:
        system: what ran to its end, inside.
        time: (samples,) in s.
        action, inputs: (samples, m); inputs are not numbers where there are none.
        duration: how long it was meant to last, in s.
        tolerance: within which y* counts as reached.
        plant: as it is at the end.
    """
    known = system.known_equilibrium
    if known is None or system.moves or system.membership is not None or len(time) < 3:
        return None
    distance = np.max(np.abs(action - known.action), axis=1)
    (settled,) = run_metrics.settling_time(time, distance[None])
    if np.isfinite(settled) or not distance[-1] > tolerance:
        return None
    run = Ended(system, time, action, inputs, distance, duration, plant)
    return [asdict(each) for each in reasons(run)]


def reasons(run: Ended) -> list[Reason]:
    """All that was seen, what holds outputs before what lets them move."""
    found = [*_limits(run), *_controllers(run), *_stops(run), *_slips(run), *_loads(run)]
    return [*found, *_moving(run)]


def _whose(agents: Sequence[int]) -> str:
    shown = ", ".join(map(str, agents[:6])) + ", ..." * (len(agents) > 6)
    return f"agent{'s' * (len(agents) > 1)} {shown}"


def _limits(run: Ended) -> Iterator[Reason]:
    limit, full = limits_at(run.system, float(run.time[-1])), _full(run)
    share, late = full.mean(axis=0), full[run.tail].any(axis=0)
    met = (late & run.far) | (share > MANY)
    if not met.any():
        return
    agents, worst = run.agents(met), int(np.argmax(share))
    end = "still at the end" if late.any() else "no more at the end"
    yield Reason(
        "limit", agents,
        f"the input of {_whose(agents)} was at its limit for up to {share[worst]:.0%} of the time"
        f" ({limit[worst]:g} of agent {run.agents(np.arange(len(share)) == worst)[0]}), {end}",
        {"share": share.tolist(), "at_end": bool(late.any())},
    )  # fmt: skip


def _controllers(run: Ended) -> Iterator[Reason]:
    """What low-level controllers asked of actuators, or their own limits held back."""
    met = run.plant.limits_met if isinstance(run.plant, FleetPlant) else {}
    found = {i: {n: part for n, part in parts.items() if part > MANY} for i, parts in met.items()}
    agents = [i + 1 for i, parts in found.items() if parts]
    if not agents:
        return
    share, worst, name = max(
        (part, i + 1, name) for i, parts in found.items() for name, part in parts.items()
    )
    what = "its own limits" if name == "controller" else f"the range of '{name}'"
    yield Reason(
        "limit", agents,
        f"the low-level controller of {_whose(agents)} met limits, that of agent {worst} {what} in"
        f" {share:.0%} of all evaluations",
        {"share": {i + 1: parts for i, parts in found.items() if parts}},
    )  # fmt: skip


def _full(run: Ended) -> NDArray[np.bool_]:
    """(samples, m) where an input is all that its limit lets through."""
    full: NDArray[np.bool_] = np.abs(np.nan_to_num(run.inputs)) >= FULL * limits_at(
        run.system, float(run.time[-1])
    )
    return full


def _loads(run: Ended) -> Iterator[Reason]:
    """What inputs hold where outputs rest: nothing, at an equilibrium without loads."""
    held = np.nan_to_num(run.inputs[-max(2, int(run.tail.sum())) : -1]).mean(axis=0)
    asked = np.abs(held) > 1e-6 * max(1.0, float(np.max(np.abs(np.nan_to_num(run.inputs)))))
    resting = run.far & run.rests & asked & ~_full(run)[run.tail].any(axis=0)
    if not resting.any():
        return
    channel = int(np.argmax(np.where(resting, np.abs(held), 0.0)))
    agents, whose = run.agents(resting), run.agents(np.arange(len(held)) == channel)[0]
    parts, pushed = {}, set()
    fleet = run.fleet
    if fleet is not None:
        balance = acting_forces.balance(fleet, held, 1)
        parts = {name: float(value[channel]) for name, value in balance.items()}
    for fault in run.system.faults:
        if isinstance(fault, Push):
            everyone = range(run.system.game.agents)
            pushed |= {i + 1 for i in (everyone if fault.agents is None else fault.agents)}
    told = acting_forces.told(parts)
    of = f", against {told}" if told else ""
    by = f"; {_whose(sorted(pushed))} pushed" if pushed else ""
    yield Reason(
        "load", agents,
        f"{_whose(agents)} rest{'s' * (len(agents) == 1)} where the input holds a load, agent"
        f" {whose} with {held[channel]:.4g}{of}{by}",
        {"input": held.tolist(), "parts": parts, "agent": whose, "pushed": sorted(pushed)},
    )  # fmt: skip


def _owner(name: str) -> int:
    """The agent that an element of a fleet's model is of, by its name; 0 for none."""
    head = name.partition("/")[0].removeprefix("robot_")
    return int(head) if head.isdigit() else 0


def _stops(run: Ended) -> Iterator[Reason]:
    fleet = run.fleet
    if fleet is None:
        return
    names = acting_forces.joints_at_stops(fleet)
    if not names:
        return
    agents = sorted({_owner(name) for name in names} - {0})
    shown = ", ".join(f"'{name.partition('/')[2] or name}'" for name in names[:4])
    yield Reason(
        "stop", agents,
        f"of {_whose(agents)} joint{'s' * (len(names) > 1)} {shown}{', ...' * (len(names) > 4)}"
        f" {'are' if len(names) > 1 else 'is'} at {'their' if len(names) > 1 else 'its'} stop",
        {"joints": names},
    )  # fmt: skip


def _slips(run: Ended) -> Iterator[Reason]:
    fleet = run.fleet
    if fleet is None:
        return
    found: dict[str, float] = {}
    last = np.nan_to_num(run.inputs[-2])
    for _ in range(LOOKS):  # wheels that slip hop, too
        for name, speed in slipping(fleet.model, fleet.data):
            found[name] = max(speed, found.get(name, 0.0))
        fleet.step(last)
    if not found:
        return
    agents = sorted({_owner(name) for name in found} - {0})
    worst = max(found, key=lambda name: found[name])
    yield Reason(
        "slip", agents,
        f"{_whose(agents)} slip{'s' * (len(agents) == 1)}: '{worst.partition('/')[2] or worst}'"
        f" slides at {found[worst]:.3g} m/s with all the friction that its contact has",
        {"speed": found},
    )  # fmt: skip


def slipping(model: Any, data: Any) -> Iterator[tuple[str, float]]:
    """The moving geoms of contacts that slide with all friction used, and how fast in m/s."""
    force, jacobians = np.zeros(6), np.zeros((2, 3, model.nv))
    for index, contact in enumerate(data.contact):
        if contact.efc_address < 0 or contact.dim < 3 or min(contact.geom) < 0:
            continue
        bodies = model.geom_bodyid[contact.geom]
        for jacobian, body in zip(jacobians, bodies, strict=True):
            mujoco.mj_jac(model, data, jacobian, None, contact.pos, body)
        velocity = contact.frame.reshape(3, 3)[1:] @ (jacobians[1] - jacobians[0]) @ data.qvel
        speed = float(np.linalg.norm(velocity))
        mujoco.mj_contactForce(model, data, index, force)
        # pyramids have less across their edges
        used = np.sum(np.abs(force[1:3]) / contact.friction[:2])
        if speed > SLIPS and used > 0.95 * force[0] > 0.0:
            moving = contact.geom[int(np.argmax(bodies != 0))]
            yield model.geom(moving).name or f"geom {moving}", speed


def _moving(run: Ended) -> Iterator[Reason]:
    """What still moves: towards y*, with how long it would need, or not."""
    moving = run.far & ~run.rests
    if not moving.any():
        return
    agents, late = run.agents(moving), run.time >= run.time[-1] - 0.2 * run.duration - 1e-9
    span = float(run.time[-1] - run.time[late][0])
    # the greatest of each half, so that swings are not taken for a way
    half = late & (run.time <= run.time[-1] - 0.5 * span)
    tops = [int(np.argmax(np.where(part, run.distance, -1.0))) for part in (half, late & ~half)]
    (first, last), (begun, ended) = run.distance[tops], run.time[tops]
    if last < (1.0 - CLOSER) * first:
        constant = float((ended - begun) / np.log(first / last))
        left = max(float(np.log(run.distance[-1] / (SETTLED * run.distance[0]))), 0.0)
        settles = float(run.time[-1]) + constant * left
        yield Reason(
            "short", agents,
            f"{_whose(agents)} still come{'s' * (len(agents) == 1)} closer, by"
            f" {1 - last / first:.0%} in {ended - begun:.3g} s: at that rate it settles after"
            f" {settles:.3g} s",
            {"time_constant": constant, "settles": settles},
        )  # fmt: skip
        return
    swings = float(np.max(np.ptp(run.action[late][:, moving], axis=0)))
    moved = [type(fault).__name__.lower() for fault in run.system.faults]
    by = f" under {', '.join(dict.fromkeys(moved))}" if moved else ""
    yield Reason(
        "moving", agents,
        f"{_whose(agents)} still move{'s' * (len(agents) == 1)}{by}, by {swings:.3g} in the last"
        f" {span:.3g} s, without coming closer",
        {"moved": swings},
    )  # fmt: skip
