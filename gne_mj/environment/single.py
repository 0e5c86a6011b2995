"""A fleet as a Gymnasium environment: one learner gives all forces."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from gne_mj.environment.episodes import BOUND, Episodes
from gne_mj.environment.picture import MODES, Picture
from gne_mj.environment.setting import Setting, action_of
from gne_mj.errors import InvalidInput, nearest

Array = NDArray[np.float64]


def check_mode(render_mode: str | None) -> None:
    """Refuse what cannot be drawn.

    Raises:
        InvalidInput: names ``render_mode``.
    """
    if render_mode is not None and render_mode not in MODES:
        raise InvalidInput("render_mode", render_mode, nearest(str(render_mode), MODES))


def joint_spaces(episodes: Episodes) -> tuple[spaces.Box, spaces.Box]:
    """What one learner for all agents observes, and does."""
    columns, limit = episodes.view.joint, episodes.setting.limit
    lower, upper = (bound[columns] for bound in episodes.bounds)
    return spaces.Box(lower, upper, dtype=np.float64), spaces.Box(-limit, limit, dtype=np.float64)


class FleetEnv(gymnasium.Env[Array, Array]):
    """A fleet and its game, whose reward is minus the sum of all costs.

    What is observed is what is under ``all/`` of the dm_env environment with full information,
    else what all agents see, one after the other; cut to the bounds of ``observation_space``.

    Args:
        setting: what an episode is.
        bound: of the magnitude of what is observed, but of outputs of which the game declares
            bounds.
        render_mode: "rgb_array", "ansi" or None.

    Attributes:
        setting: as given.
    """

    def __init__(
        self, setting: Setting, *, bound: float = BOUND, render_mode: str | None = None
    ) -> None:
        check_mode(render_mode)
        self.setting, self.render_mode, self._bound = setting, render_mode, bound
        rate = 1.0 / setting.clock.control_period
        self.metadata = {"render_modes": list(MODES), "render_fps": rate}
        self.episodes = Episodes(setting, 1, 1, bound)
        self.observation_space, self.action_space = joint_spaces(self.episodes)

    def of(self, setting: Setting) -> "FleetEnv":
        """The same of another setting."""
        return FleetEnv(setting, bound=self._bound, render_mode=self.render_mode)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Start anew; what is random follows from the seed. There are no options."""
        super().reset(seed=seed)
        self.episodes.begin(0, self.np_random)
        return self._observed(), info_of(self.episodes, 0)

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Hold forces (m,) for a control period; they are cut to ``action_space``."""
        limit = self.setting.limit
        taken = self.episodes.step(action_of(action, limit, limit.shape)[None])
        reward = float(np.sum(taken.reward[0]))
        over = bool(taken.left[0]), bool(taken.over[0])
        return self._observed(), reward, *over, info_of(self.episodes, 0)

    def render(self) -> Picture | str | None:
        """A picture or a line of text, by ``render_mode``."""
        return self.episodes.drawn(self.render_mode, 0)

    def close(self) -> None:
        """Let threads go."""
        self.episodes.fleets.close()

    def _observed(self) -> Array:
        return self.episodes.observed()[0, self.episodes.view.joint]


def info_of(episodes: Episodes, row: int) -> dict[str, Any]:
    """What is told besides: the input that acts, in how many periods so far actuators did not
    deliver it, and of an exit what happened."""
    rows, left = episodes.fleets.rows, episodes.fleets.exits[row]
    found = {"given": rows.given[row].copy(), "limited": int(rows.limited[row])}
    return found if left is None else {**found, "exit": str(left)}
