"""A fleet as a PettingZoo environment: each agent gives its own forces, all at once."""

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.utils import seeding
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from gne_mj.environment.episodes import BOUND, Episodes
from gne_mj.environment.picture import MODES, Picture
from gne_mj.environment.setting import Setting
from gne_mj.environment.single import check_mode, info_of, joint_spaces
from gne_mj.errors import InvalidInput

Array = NDArray[np.float64]


class FleetParallelEnv(ParallelEnv[str, Array, Array]):
    """A fleet and its game, each agent rewarded by minus its own cost.

    Agents are ``agent_1`` to ``agent_N``. Each sees what is under its name in the dm_env
    environment, one entry after the other, cut to the bounds of its space. All leave together.

    Args:
        setting: what an episode is.
        bound: of the magnitude of what is observed, but of outputs of which the game declares
            bounds.
        render_mode: "rgb_array", "ansi" or None.

    Attributes:
        setting: as given.
        action_entries: of each agent, which entries of all actions together (m,) are its own.
        possible_agents, agents: all, and those of the present episode.
    """

    def __init__(
        self, setting: Setting, *, bound: float = BOUND, render_mode: str | None = None
    ) -> None:
        check_mode(render_mode)
        self.setting, self.render_mode, self._bound = setting, render_mode, bound
        self.metadata = {
            "name": "gne_mj_fleet_v0", "render_modes": list(MODES), "is_parallelizable": True,
            "render_fps": 1.0 / setting.clock.control_period,
        }  # fmt: skip
        game = setting.system.game
        self.possible_agents = [f"agent_{i + 1}" for i in range(game.agents)]
        self.agents: list[str] = []
        self.episodes = Episodes(setting, 1, 1, bound)
        cuts = pairwise(game.data.offsets.tolist())
        self.action_entries: Mapping[str, slice] = {
            name: slice(a, b) for name, (a, b) in zip(self.possible_agents, cuts, strict=True)
        }
        view, limit, (lower, upper) = self.episodes.view, setting.limit, self.episodes.bounds
        self._columns = {name: view.own(i) for i, name in enumerate(self.possible_agents)}
        self.observation_spaces = {
            name: spaces.Box(lower[own], upper[own], dtype=np.float64)
            for name, own in self._columns.items()
        }
        self.action_spaces = {
            name: spaces.Box(-limit[own], limit[own], dtype=np.float64)
            for name, own in self.action_entries.items()
        }
        self.state_space, _ = joint_spaces(self.episodes)
        self._rng: np.random.Generator | None = None

    def of(self, setting: Setting) -> "FleetParallelEnv":
        """The same of another setting."""
        return FleetParallelEnv(setting, bound=self._bound, render_mode=self.render_mode)

    def observation_space(self, agent: str) -> spaces.Space[Array]:
        """What an agent sees."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Array]:
        """An agent's forces (m_i,)."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Array], dict[str, dict[str, Any]]]:
        """Start anew; what is random follows from the seed. There are no options."""
        if seed is not None or self._rng is None:
            self._rng, _ = seeding.np_random(seed)
        self.episodes.begin(0, self._rng)
        self.agents = list(self.possible_agents)
        return self._observed(), self._infos()

    def step(
        self, actions: Mapping[str, Array]
    ) -> tuple[
        dict[str, Array], dict[str, float], dict[str, bool], dict[str, bool], dict[str, Any]
    ]:
        """Hold each agent's forces for a control period; they are cut to ``action_space``.

        Raises:
            InvalidInput: actions of others than those who play, or of another shape.
        """
        if not self.agents or set(actions) != set(self.agents):
            what = "reset first" if not self.agents else f"those who act are {self.agents}"
            raise InvalidInput("actions", sorted(actions), what)
        whole = np.empty(self.setting.system.game.actions)
        for name, own in self.action_entries.items():
            force = np.asarray(actions[name], dtype=np.float64)
            if force.shape != (own.stop - own.start,):
                right = f"its shape must be {(own.stop - own.start,)}"
                raise InvalidInput(f"actions.{name}", f"shape {force.shape}", right)
            whole[own] = force
        taken, names = self.episodes.step(whole[None]), self.agents
        rewards = dict(zip(names, taken.reward[0].tolist(), strict=True))
        left, over = (dict.fromkeys(names, bool(which[0])) for which in (taken.left, taken.over))
        found = self._observed(), rewards, left, over, self._infos()
        if taken.left[0] or taken.over[0]:
            self.agents = []
        return found

    def state(self) -> Array:
        """What :class:`gne_mj.environment.FleetEnv` observes: all of it, for central critics."""
        return self.episodes.observed()[0, self.episodes.view.joint]

    def render(self) -> Picture | str | None:
        """A picture or a line of text, by ``render_mode``."""
        return self.episodes.drawn(self.render_mode, 0)

    def close(self) -> None:
        """Let threads go."""
        self.episodes.fleets.close()

    def _observed(self) -> dict[str, Array]:
        (row,) = self.episodes.observed()
        return {name: row[columns] for name, columns in self._columns.items()}

    def _infos(self) -> dict[str, dict[str, Any]]:
        """Of each agent, with its own part of the input that acts."""
        whole = info_of(self.episodes, 0)
        return {
            name: {**whole, "given": whole["given"][own]}
            for name, own in self.action_entries.items()
        }
