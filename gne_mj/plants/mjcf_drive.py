"""How inputs reach a fleet of users' robots: which controls each is a part of, and by how much.

Those that a low-level controller takes are in :mod:`gne_mj.plants.mjcf_low_level`.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput, nearest
from gne_mj.plants.low_level.table import Controlled
from gne_mj.plants.mjcf_actuator import make_force
from gne_mj.plants.mjcf_input import Input
from gne_mj.plants.mjcf_reading import names_in, terms_of
from gne_mj.plants.mjcf_robot import MjcfRobots

_WORLD = "gne_mj world"  # the site that the axes of forces at bodies are of


@dataclass(frozen=True)
class Driving:
    """A fleet's allocation: control a is the sum of factor u_r over the drives (r, a).

    Args:
        channels, actuators: (drives,) r and the entry of ctrl.
        factors: (drives,) of each.
        most: (drives,) the greatest |control| that passes unchanged, infinite for any.
    """

    channels: NDArray[np.int64]
    actuators: NDArray[np.int64]
    factors: NDArray[np.float64]
    most: NDArray[np.float64]

    def lets_through(self, channels: int) -> NDArray[np.float64]:
        """(m,) the greatest |u| of each channel that passes if those it shares with ask as much."""
        found, size = np.full(channels, np.inf), np.abs(self.factors)
        for channel, ctrl, most in zip(self.channels, self.actuators, self.most, strict=True):
            together = size[self.actuators == ctrl].sum()
            found[channel] = min(found[channel], most / together)
        return found

    @property
    def numbers(self) -> list[int]:
        """As compiled code has it, flat: channel, entry, whether it is that entry's first."""
        first = np.zeros(len(self.factors), dtype=np.int64)
        first[np.unique(self.actuators, return_index=True)[1]] = 1
        rows: list[int] = np.column_stack([self.channels, self.actuators, first]).ravel().tolist()
        return rows

    def set(self, ctrl: NDArray[np.float64], u: NDArray[np.float64]) -> None:
        """Make inputs u (m,) controls."""
        ctrl[self.actuators] = 0.0
        np.add.at(ctrl, self.actuators, self.factors * u[self.channels])


def add_effort(spec: Any, given: str | Input | Controlled, channel: int, path: Path) -> None:
    """Give a robot's file the actuator that is a force at a body or site, if an input is one.

    Of an actuator at a site MuJoCo takes the axes from a second one, which stands in the world.

    Args:
        spec: the robot's ``mujoco.MjSpec``.
        given: the input.
        channel: its number, from 0, which the actuator is named by.
        path: of the file.

    Raises:
        InvalidInput: the file has no such body or site; names ``agents.input``.
    """
    if not isinstance(given, Input) or not given.kind:
        return
    found = getattr(spec, given.kind)(given.name)
    if found is None:
        elements = spec.bodies if given.kind == "body" else spec.sites
        names = [element.name for element in elements if element.name not in ("", "world")]
        raise InvalidInput(
            "agents.input", given.name,
            f"{path.name} has no such {given.kind}; {nearest(given.name, names)}",
        )  # fmt: skip
    name = _effort(channel)
    if given.kind == "body":
        found.add_site(name=name)
    actuator = spec.add_actuator(name=name, trntype=mujoco.mjtTrn.mjTRN_SITE)
    actuator.target = name if given.kind == "body" else given.name
    if not given.own:
        if spec.site(_WORLD) is None:
            spec.worldbody.add_site(name=_WORLD)
        actuator.refsite = _WORLD
    actuator.gear = np.eye(6)[given.axis + 3 * given.torque]
    # whatever the file's defaults are
    actuator.set_to_motor()
    actuator.ctrllimited = actuator.forcelimited = actuator.actlimited = (
        mujoco.mjtLimited.mjLIMITED_FALSE
    )


def _effort(channel: int) -> str:
    return f"gne_mj input {channel + 1}"


def driving(model: mujoco.MjModel, data: mujoco.MjData, agents: MjcfRobots) -> Driving:
    """The allocation of a fleet; its actuators are made forces.

    Args:
        model: of the fleet; gains, biases and ranges of what is driven are changed.
        data: in the reference pose, positions evaluated.
        agents: which robots.

    Raises:
        InvalidInput: an actuator that is not there, or is no force, or that would clamp what the
            inputs' limits allow; names ``input`` or ``agents.input_limit``.
    """
    rows: list[tuple[int, int, float]] = []
    clamps: dict[int, tuple[str, float]] = {}
    for channel, robot in enumerate(agents.robots):
        prefix = f"robot_{channel // agents.dimension + 1}/"
        given = robot.input
        if isinstance(given, Controlled):
            continue
        if isinstance(given, str):
            given = Input((given,), (1.0,))
        elif given.kind:
            given = Input((_effort(channel),), (1.0,))
        for name, factor in zip(given.actuators, given.factors, strict=True):
            index = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, prefix + name))
            if index < 0:
                names = names_in(model, "actuator", prefix)
                hint = nearest(name, names) if names else "its file has no actuator: name a body"
                raise InvalidInput("input", name, hint)
            if name == _effort(channel):
                _check_moves(model, index, robot.input, robot.path)
            own = given.factors == (1.0,) and _measures(model, prefix, robot.output, index)
            ctrl = int(model.actuator_ctrladr[index])
            if ctrl not in clamps:
                low, high = make_force(model, data, index, name, robot.path, own_velocity=own)
                clamps[ctrl] = name, min(-low, high)
            if factor:
                rows.append((channel, ctrl, factor))
    found = Driving(
        np.array([row[0] for row in rows], dtype=np.int64),
        np.array([row[1] for row in rows], dtype=np.int64),
        np.array([row[2] for row in rows], dtype=np.float64),
        np.array([clamps[row[1]][1] for row in rows], dtype=np.float64),
    )
    _check_limits(found, clamps, agents)
    return found


def _check_moves(model: mujoco.MjModel, index: int, given: Any, path: Path) -> None:
    """Refuse a force at what stands in the world."""
    if model.body_weldid[model.site_bodyid[model.actuator_trnid[index, 0]]] == 0:
        raise InvalidInput(
            "input", given.name, f"in {path.name} the {given.kind} stands still: name one that a"
            " joint moves",
        )  # fmt: skip


def _measures(model: mujoco.MjModel, prefix: str, output: Any, actuator: int) -> bool:
    """Whether an output is this actuator's own velocity, so that its force is before the gear."""
    terms = terms_of(model, prefix, output)
    place = "actuator_velocity", int(model.actuator_outadr[actuator])
    return len(terms) == 1 and (terms[0].source, terms[0].entry) == place


def _check_limits(found: Driving, clamps: dict[int, tuple[str, float]], agents: MjcfRobots) -> None:
    """MuJoCo clamps silently; what the law asks for must not be changed unseen."""
    for ctrl, (name, most) in clamps.items():
        if most <= 0:
            raise InvalidInput("input", name, "its ranges must leave forces of both signs")
        of = found.actuators == ctrl
        sharing, factors = found.channels[of], np.abs(found.factors[of])
        limits = agents.input_limit[sharing]
        if not np.isfinite(most) or limits @ factors <= most:
            continue
        allowed = most / factors.sum()
        raise InvalidInput(
            "agents.input_limit",
            float(np.max(limits)),
            f"actuator '{name}' of agent {sharing[0] // agents.dimension + 1} clamps its force:"
            f" give a limit of at most {allowed:g}",
        )
