"""Many fleets as a Gymnasium vector environment, stepped natively on threads."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from gne_mj.environment.episodes import BOUND, Episodes
from gne_mj.environment.picture import MODES, Picture
from gne_mj.environment.setting import Setting
from gne_mj.environment.single import check_mode, info_of, joint_spaces
from gne_mj.errors import InvalidInput

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


class FleetVectorEnv(VectorEnv[Array, Array, Array]):
    """Copies of :class:`gne_mj.environment.FleetEnv`, each as it would be alone, to the bit.

    An episode that has ended starts anew in the next step, whose action for it does nothing
    (``AutoresetMode.NEXT_STEP``).

    Args:
        setting: what an episode is.
        num_envs: how many.
        threads: how many of the processor's cores step them; all if left out.
        bound: as of one environment.
        render_mode: as of one environment.

    Attributes:
        setting: as given.
    """

    def __init__(
        self,
        setting: Setting,
        num_envs: int,
        *,
        threads: int | None = None,
        bound: float = BOUND,
        render_mode: str | None = None,
    ) -> None:
        check_mode(render_mode)
        for key, value in (("num_envs", num_envs), ("threads", 1 if threads is None else threads)):
            if not isinstance(value, int | np.integer) or value < 1:
                raise InvalidInput(key, value, "it must be a whole number, at least 1")
        self.setting, self.num_envs, self.render_mode = setting, int(num_envs), render_mode
        self._threads, self._bound = threads, bound
        self.metadata = {
            "autoreset_mode": AutoresetMode.NEXT_STEP, "render_modes": list(MODES),
            "render_fps": 1.0 / setting.clock.control_period,
        }  # fmt: skip
        self.episodes = Episodes(setting, self.num_envs, threads, bound)
        self.single_observation_space, self.single_action_space = joint_spaces(self.episodes)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._rngs: list[np.random.Generator | None] = [None] * num_envs
        self._ended: Flags = np.zeros(num_envs, dtype=bool)

    def of(self, setting: Setting) -> "FleetVectorEnv":
        """The same of another setting."""
        return FleetVectorEnv(
            setting, self.num_envs, threads=self._threads, bound=self._bound,
            render_mode=self.render_mode,
        )  # fmt: skip

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Array, dict[str, Any]]:
        """Start all anew; copy number e by the seed plus e, or the e-th seed. No options.

        Raises:
            InvalidInput: not one seed for each.
        """
        seeds: Sequence[int | None]
        if isinstance(seed, Sequence):
            if len(seed) != self.num_envs:
                raise InvalidInput(
                    "seed", f"{len(seed)} seeds", f"there are {self.num_envs} fleets"
                )
            seeds = seed
        elif seed is None:
            seeds = [None] * self.num_envs
        else:
            self._np_random, self._np_random_seed = seeding.np_random(seed)
            seeds = [seed + row for row in range(self.num_envs)]
        for row, own in enumerate(seeds):
            if own is not None or self._rngs[row] is None:
                self._rngs[row], _ = seeding.np_random(own)
            self._begin(row)
        self._ended[:] = False
        return self._observed(), self._infos(np.ones(self.num_envs, dtype=bool))

    def step(self, actions: Array) -> tuple[Array, Array, Flags, Flags, dict[str, Any]]:
        """Hold forces (E, m) for a control period; they are cut to ``action_space``."""
        begun = self._ended
        taken = self.episodes.step(actions, ~begun)
        for row in np.flatnonzero(begun).tolist():
            self._begin(row)
        left, over = taken.left & ~begun, taken.over & ~begun
        self._ended = left | over
        rewards = np.where(begun, 0.0, taken.reward.sum(axis=1))
        return self._observed(), rewards, left, over, self._infos(~begun)

    def render(self) -> tuple[Picture | str | None, ...]:
        """A picture or a line of text of each, by ``render_mode``."""
        return tuple(self.episodes.drawn(self.render_mode, e) for e in range(self.num_envs))

    def close_extras(self, **kwargs: Any) -> None:
        """Let threads go."""
        self.episodes.fleets.close()

    def _begin(self, row: int) -> None:
        rng = self._rngs[row]
        assert rng is not None
        self.episodes.begin(row, rng)

    def _observed(self) -> Array:
        return self.episodes.observed()[:, self.episodes.view.joint]

    def _infos(self, stepped: Flags) -> dict[str, Any]:
        """:func:`gne_mj.environment.single.info_of` of all, as vector environments have it."""
        rows, everyone = self.episodes.fleets.rows, np.ones(self.num_envs, dtype=bool)
        found: dict[str, Any] = {
            "given": rows.given.copy(), "_given": everyone, "limited": rows.limited.copy(),
            "_limited": everyone.copy(),
        }  # fmt: skip
        for row in np.flatnonzero(self._ended & stepped).tolist():
            found = self._add_info(found, info_of(self.episodes, row), row)
        return found
