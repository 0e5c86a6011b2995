"""The game as a dm_control task: what is observed, what an action is, what it costs, when it ends.

Agents are numbered from 1 in the observations' names, as everywhere that people read.
"""

from collections import OrderedDict
from collections.abc import Callable
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from dm_control.rl import control
from dm_env import specs
from numpy.typing import ArrayLike, NDArray

from gne_mj.environment.information import Information
from gne_mj.environment.physics import FleetPhysics
from gne_mj.errors import GneError, InvalidInput, UserCodeError
from gne_mj.game_model import Game
from gne_mj.loops.feedback import LARGEST_INPUT
from gne_mj.plants.agent_type import followed_position
from gne_mj.system import System

Observation = OrderedDict[str, NDArray[np.float64]]
# Draws y(0), shape (m,), strictly inside
Start = Callable[[np.random.Generator], ArrayLike]
REWARDS = ("sum", "each")


class NotFinite(GneError, FloatingPointError):
    """A cost or an observation that is not a number, inside the constraint set."""


def finite_costs(game: Game, y: NDArray[np.float64]) -> NDArray[np.float64]:
    """J_i of each agent, shape (N,), at y (m,) inside.

    Raises:
        UserCodeError: one of plain functions raises, or is not a number.
        NotFinite: another that is not a finite number.
    """
    costs = game.costs(y)
    if not np.all(np.isfinite(costs)):
        raise NotFinite(f"the agents' costs at {y.tolist()} are not finite: {costs.tolist()}")
    return costs


class FleetTask(control.Task):
    """One game, played by whoever gives the forces.

    Args:
        system: the game and its agents; its law and mode do not matter.
        information: what each agent sees.
        periods: control periods after which an episode is cut off.
        reward: "sum", one number; "each", one for each agent.
        exit_cost: what leaving the set costs all agents together, in equal parts.
        start: draws y(0) anew for each episode, at rest; None for the system's own start.
        rng: what is random comes from it alone.

    Attributes:
        system, information, exit_cost: as given.
    """

    def __init__(
        self,
        system: System,
        information: Information,
        periods: int,
        *,
        reward: Literal["sum", "each"] = "sum",
        exit_cost: float = 0.0,
        start: Start | None = None,
        rng: np.random.Generator,
    ) -> None:
        if reward not in REWARDS:
            raise InvalidInput("reward", reward, "choose from sum, each")
        if not np.isfinite(exit_cost):
            raise InvalidInput("exit_cost", exit_cost, "it must be finite")
        self.system, self.information, self.exit_cost = system, information, float(exit_cost)
        self._periods, self._each, self._start, self._rng = periods, reward == "each", start, rng
        self._done = 0
        limit = np.minimum(system.agents.input_limit, LARGEST_INPUT)
        self._actions = specs.BoundedArray(limit.shape, np.float64, -limit, limit, name="force")
        at = system.game.data.offsets
        self._own = [slice(int(a), int(b)) for a, b in pairwise(at)]

    def costs(self, physics: FleetPhysics) -> NDArray[np.float64]:
        """J_i of each agent at the present outputs, shape (N,)."""
        return self.system.game.costs(physics.output)

    def initialize_episode(self, physics: FleetPhysics) -> None:
        """To the start of an episode."""
        self._done = 0
        if self._start is None:
            return  # where the reset has just put it
        physics.place(self._rest(np.asarray(self._start(self._rng), dtype=np.float64)))
        if physics.exit is not None:
            raise InvalidInput(
                "start", physics.output.tolist(), f"it must lie inside, but {physics.exit}"
            )

    def _rest(self, y: NDArray[np.float64]) -> NDArray[np.float64]:
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

    def before_step(self, action: ArrayLike, physics: FleetPhysics) -> None:
        """Hold these forces (m,), within the actuators' limits, for a control period.

        Raises:
            InvalidInput: another shape, or an entry that is not a number.
        """
        force, shape = np.asarray(action, dtype=np.float64), self._actions.shape
        if force.shape != shape:
            raise InvalidInput("action", f"shape {force.shape}", f"its shape must be {shape}")
        if np.any(np.isnan(force)):
            raise InvalidInput("action", force.tolist(), "every entry must be a number")
        physics.set_control(np.clip(force, self._actions.minimum, self._actions.maximum))

    def after_step(self, physics: FleetPhysics) -> None:
        """Count the period, and see to it that what is observed of an exit is finite."""
        self._done += 1
        if physics.exit is not None and not self._finite(physics):
            physics.restore()

    def _finite(self, physics: FleetPhysics) -> bool:
        data = physics.data
        parts = [data.qpos, data.qvel, data.act, physics.state, physics.constraint]
        try:
            parts += [self.costs(physics), *self._derived(physics).values()]
        except UserCodeError:  # outside they need not be defined
            return False
        return all(np.all(np.isfinite(part)) for part in parts)

    def _derived(self, physics: FleetPhysics) -> dict[str, NDArray[np.float64]]:
        """What the game derives from its actions, by name, without entries that are not there."""
        game, y, found = self.system.game, physics.output[None], {}
        for each in game.quantities:
            entries = game.entries(each)
            values = each.at(y, entries)[0]
            found[each.name] = values[each.there(entries)] if entries else values.copy()
        return found

    def action_spec(self, physics: FleetPhysics) -> specs.BoundedArray:
        """One force for each channel, shape (m,), in the inputs' unit, within their limits.

        Where there is no limit the bound is the 1e10 beyond which MuJoCo takes none.
        """
        return self._actions

    def get_observation(self, physics: FleetPhysics) -> Observation:
        """What all agents see, each entry for one agent but those under ``all/``.

        For agent i: ``agent_i/own``, (m_i * states,), its channels' states one behind the other;
        for an MJCF robot also ``agent_i/joints``, its qpos, qvel and act;
        ``agent_i/neighbours``, outputs of those it hears, in their order; and
        ``agent_i/constraints``, g_l of those it is told, in their order, negative inside.
        With full information also ``all/output`` (m,), ``all/state`` (m, states),
        ``all/constraint`` (p,), and what the game derives from the actions, as ``all/gap``.

        Raises:
            NotFinite: an entry that is not a number.
        """
        told, data = self.information, physics.data
        state, y, g = physics.state, physics.output, physics.constraint
        seen: Observation = OrderedDict()
        for i, own in enumerate(self._own):
            name = f"agent_{i + 1}"
            seen[f"{name}/own"] = state[own].flatten()
            if physics.joints:
                parts = zip((data.qpos, data.qvel, data.act), physics.joints[i], strict=True)
                seen[f"{name}/joints"] = np.concatenate([array[part] for array, part in parts])
            seen[f"{name}/neighbours"] = y[told.heard[i]]
            seen[f"{name}/constraints"] = g[told.constraints[i]]
        if told.structure == "full":
            seen["all/output"], seen["all/state"], seen["all/constraint"] = y, state, g
            for name, values in self._derived(physics).items():
                seen[f"all/{name}"] = values
        if not np.all(np.isfinite(np.concatenate([values.ravel() for values in seen.values()]))):
            names = [name for name, values in seen.items() if not np.all(np.isfinite(values))]
            raise NotFinite(f"observation '{names[0]}' is not finite: {seen[names[0]].tolist()}")
        return seen

    def get_reward(self, physics: FleetPhysics) -> Any:
        """-sum of all J_i at the control period's end, or -J_i (N,); less what an exit costs.

        Raises:
            UserCodeError, NotFinite: as :func:`finite_costs`.
        """
        reward = -finite_costs(self.system.game, physics.output)
        if physics.exit is not None:
            reward -= self.exit_cost / len(reward)
        return reward if self._each else float(np.sum(reward))

    def reward_spec(self) -> specs.Array:
        """() or (N,), in the unit of the costs."""
        return specs.Array((self.system.game.agents,) if self._each else (), float, name="reward")

    def get_termination(self, physics: FleetPhysics) -> float | None:
        """0 where the set was left, 1 where the time is up, None in between."""
        if physics.exit is not None:
            return 0.0
        return 1.0 if self._done >= self._periods else None


class FleetEnvironment(control.Environment):
    """dm_control's environment, with the reward's specification from the task."""

    def reward_spec(self) -> specs.Array:
        """See :meth:`FleetTask.reward_spec`."""
        return self.task.reward_spec()
