"""The game as a dm_control task: what is seen, what an action is, what it costs, when it ends."""

from collections import OrderedDict
from typing import Any, Literal

import numpy as np
from dm_control.rl import control
from dm_env import specs
from numpy.typing import ArrayLike, NDArray

from gne_mj.environment.observation import View, finite_costs
from gne_mj.environment.physics import FleetPhysics
from gne_mj.environment.setting import Setting, action_of, check_begun
from gne_mj.errors import InvalidInput

Observation = OrderedDict[str, NDArray[np.float64]]
REWARDS = ("sum", "each")


class FleetTask(control.Task):
    """One game, played by whoever gives the forces.

    Args:
        setting: what an episode is.
        reward: "sum", one number; "each", one for each agent.
        rng: what is random comes from it alone.

    Attributes:
        setting: as given, with its system, information and exit_cost.
    """

    def __init__(
        self,
        setting: Setting,
        *,
        reward: Literal["sum", "each"] = "sum",
        rng: np.random.Generator,
    ) -> None:
        if reward not in REWARDS:
            raise InvalidInput("reward", reward, "choose from sum, each")
        self.setting, self.system, self.information = setting, setting.system, setting.information
        self.exit_cost = setting.exit_cost
        self._each, self._rng, self._done = reward == "each", rng, 0
        self._view: View | None = None
        limit = setting.limit
        self._actions = specs.BoundedArray(limit.shape, np.float64, -limit, limit, name="force")

    def costs(self, physics: FleetPhysics) -> NDArray[np.float64]:
        """J_i of each agent at the present outputs, shape (N,)."""
        return self.system.game.costs(physics.output)

    def initialize_episode(self, physics: FleetPhysics) -> None:
        """To the start of an episode."""
        self._done = 0
        if self.setting.start is None:
            return  # where the reset has just put it
        physics.place(self.setting.first_state(self._rng))
        check_begun(physics.fleets, 0)

    def before_step(self, action: ArrayLike, physics: FleetPhysics) -> None:
        """Hold these forces (m,), within the actuators' limits, for a control period.

        Raises:
            InvalidInput: another shape, or an entry that is not a number.
        """
        limit = self._actions.maximum
        physics.set_control(action_of(action, limit, limit.shape))

    def after_step(self, physics: FleetPhysics) -> None:
        """Count the period, and see to it that what is observed of an exit is finite."""
        self._done += 1
        self.view(physics).settle(physics.fleets, 0)

    def view(self, physics: FleetPhysics) -> View:
        """Who sees what."""
        if self._view is None:
            self._view = View(self.system.game, physics.plant, self.information)
        return self._view

    def action_spec(self, physics: FleetPhysics) -> specs.BoundedArray:
        """One force for each channel, shape (m,), in the inputs' unit, within their limits.

        Where there is no limit the bound is the 1e10 beyond which MuJoCo takes none. Under a
        barrier it is what a policy may pull with.
        """
        return self._actions

    def get_observation(self, physics: FleetPhysics) -> Observation:
        """What all agents see, each entry for one agent but those under ``all/``.

        :class:`gne_mj.environment.observation.View` has the entries.

        Raises:
            NotFinite: an entry that is not a number.
        """
        view = self.view(physics)
        (row,) = view.check(view.table(physics.fleets))
        return OrderedDict(
            (each.name, row[each.columns].reshape(each.shape)) for each in view.entries
        )

    def get_reward(self, physics: FleetPhysics) -> Any:
        """-sum of all J_i at the control period's end, or -J_i (N,); less what an exit costs.

        Raises:
            UserCodeError, NotFinite: as :func:`gne_mj.environment.observation.finite_costs`.
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
        return 1.0 if self._done >= self.setting.periods else None


class FleetEnvironment(control.Environment):
    """dm_control's environment of a setting.

    Args:
        setting: what an episode is.
        reward: as :class:`FleetTask` has it.
        random: seed or generator of the random starts.

    Attributes:
        setting: as given.
    """

    def __init__(
        self,
        setting: Setting,
        reward: Literal["sum", "each"] = "sum",
        random: int | np.random.Generator | None = None,
    ) -> None:
        self.setting, self._given = setting, (reward, random)
        plant = setting.plant(decorated=True)
        physics = FleetPhysics(
            plant, setting.system.game, setting.system.state, setting.barrier(plant)
        )
        task = FleetTask(setting, reward=reward, rng=np.random.default_rng(random))
        super().__init__(physics, task, n_sub_steps=setting.steps)

    def of(self, setting: Setting) -> "FleetEnvironment":
        """The same of another setting."""
        return FleetEnvironment(setting, *self._given)

    def reward_spec(self) -> specs.Array:
        """See :meth:`FleetTask.reward_spec`."""
        return self.task.reward_spec()
