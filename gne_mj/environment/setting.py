"""What an episode is, whichever interface it is played through."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.environment.barrier import Barrier, barrier_of
from gne_mj.environment.fleets import Fleets
from gne_mj.environment.information import Information
from gne_mj.errors import InvalidInput, part_of
from gne_mj.loops.feedback import LARGEST_INPUT
from gne_mj.plants.agent_type import followed_position
from gne_mj.plants.fleet_plant import FleetPlant, build_fleet
from gne_mj.system import Clock, System

Array = NDArray[np.float64]
# Draws y(0), shape (m,), strictly inside
Start = Callable[[np.random.Generator], ArrayLike]


@dataclass(frozen=True)
class Guard:
    """How the barrier keeps a fleet inside, see :func:`gne_mj.environment.guarded`."""

    pull: float | None = None
    between: Literal["watched", "guarded"] = "watched"
    decentralised: bool = False

    def __post_init__(self) -> None:
        if self.pull is not None and not 0.0 < self.pull <= LARGEST_INPUT:
            raise InvalidInput("pull", self.pull, f"it must be positive, up to {LARGEST_INPUT:g}")


@dataclass(frozen=True, eq=False)
class Setting:
    """One game, played by whoever gives the forces.

    Attributes:
        system: the game and its agents; its law and mode do not matter.
        clock: integration step, and control period (one step of an environment).
        information: what each agent sees.
        periods: control periods after which an episode is cut off.
        exit_cost: what leaving the set costs all agents together, in equal parts.
        start: draws y(0) anew for each episode, at rest; None for the system's own start.
        guard: how the barrier keeps the fleet inside; None: it does not.
    """

    system: System
    clock: Clock
    information: Information
    periods: int
    exit_cost: float = 0.0
    start: Start | None = None
    guard: Guard | None = None

    def __post_init__(self) -> None:
        if not np.isfinite(self.exit_cost):
            raise InvalidInput("exit_cost", self.exit_cost, "it must be finite")

    def guarded(self, guard: Guard) -> "Setting":
        """The same under the barrier."""
        return replace(self, guard=guard)

    @property
    def limit(self) -> Array:
        """(m,) the greatest actions: of the actuators, or the greatest pull."""
        if self.guard is not None and self.guard.pull is not None:
            return np.full(self.system.game.actions, self.guard.pull)
        return np.minimum(self.system.agents.input_limit, LARGEST_INPUT)

    @property
    def steps(self) -> int:
        """Integration steps of a control period."""
        return self.clock.steps(self.clock.control_period)

    def plant(self, *, decorated: bool) -> FleetPlant:
        """Such a fleet."""
        with part_of("system"):
            return build_fleet(
                self.system.agents, self.clock.timestep, self.system.integrator, decorated=decorated
            )

    def barrier(self, plant: FleetPlant) -> Barrier | None:
        """What keeps such fleets inside."""
        if self.guard is None:
            return None
        how: dict[str, Any] = {
            "between": self.guard.between, "decentralised": self.guard.decentralised
        }  # fmt: skip
        return barrier_of(self.system, self.clock, plant, **how)

    def fleets(self, count: int, threads: int) -> Fleets:
        """Many such fleets, without decoration."""
        plants = [self.plant(decorated=False) for _ in range(max(1, min(threads, count)))]
        return Fleets(plants, self.system.game, count, self.barrier(plants[0]))

    def first_state(self, rng: np.random.Generator) -> Array:
        """(m, states) that an episode begins with."""
        if self.start is None:
            return self.system.state
        return self._rest(np.asarray(self.start(rng), dtype=np.float64))

    def _rest(self, y: Array) -> Array:
        """The states (m, states) that rest at y (m,), at the places of the system's own start."""
        agents = self.system.agents
        if y.shape != (agents.channels,) or not np.all(np.isfinite(y)):
            raise InvalidInput("start", y.tolist(), f"it must be {agents.channels} finite numbers")
        state = agents.equilibrium(y)
        if followed_position(agents.kind) < 0:  # else positions are where outputs rest
            names = [name for name, _ in agents.kind.STATES]
            place = names.index("position")
            state[:, place] = self.system.state[:, place]
        return state


def check_begun(fleets: Fleets, row: int) -> None:
    """Refuse a start that is not inside.

    Raises:
        InvalidInput: names ``start``.
    """
    if fleets.exits[row] is not None:
        said = f"it must lie inside, but {fleets.exits[row]}"
        raise InvalidInput("start", fleets.rows.y[row].tolist(), said)


def action_of(action: ArrayLike, limit: Array, shape: tuple[int, ...]) -> Array:
    """An action within its limits (m,), or several.

    Raises:
        InvalidInput: another shape, or an entry that is not a number.
    """
    force = np.asarray(action, dtype=np.float64)
    if force.shape != shape:
        raise InvalidInput("action", f"shape {force.shape}", f"its shape must be {shape}")
    if np.any(np.isnan(force)):
        raise InvalidInput("action", force.tolist(), "every entry must be a number")
    return np.clip(force, -limit, limit)
