"""A fleet under held forces, looked at after every integration step: what dm_control steps."""

import mujoco
import numpy as np
from dm_control.rl import control
from numpy.typing import ArrayLike, NDArray

from gne_mj.environment.barrier import Barrier
from gne_mj.environment.fleets import Exit, Fleets
from gne_mj.game_model import Game
from gne_mj.plants.fleet_plant import FleetPlant


class FleetPhysics(control.Physics):
    """A MuJoCo fleet that holds its forces and stops at the integration step that leaves the set.

    It moves exactly as its plant's ``step`` does; the springs' native forces are installed while
    it steps, and nothing of it stays in MuJoCo meanwhile.

    Args:
        plant: the fleet.
        game: whose constraints are looked at.
        start: (m, states) that ``reset`` goes to.
        barrier: what keeps the fleet inside; None: nothing does.

    Attributes:
        plant, game: as given.
        fleets: what steps it, one row.
    """

    def __init__(
        self,
        plant: FleetPlant,
        game: Game,
        start: NDArray[np.float64],
        barrier: Barrier | None = None,
    ) -> None:
        self.plant, self.game, self._start = plant, game, start
        self.fleets = Fleets([plant], game, barrier=barrier)
        self.reset()

    @property
    def exit(self) -> Exit | None:
        """How the set was left since the last reset; None while it was not."""
        return self.fleets.exits[0]

    @property
    def model(self) -> mujoco.MjModel:
        """MuJoCo's own, as for rendering."""
        return self.plant.model

    @property
    def data(self) -> mujoco.MjData:
        """MuJoCo's own; to move the fleet elsewhere use :meth:`place`."""
        return self.plant.data

    @property
    def state(self) -> NDArray[np.float64]:
        """(m, states) in the order of the agents' ``kind.STATES``, a copy."""
        return self.fleets.rows.state[0].reshape(self.game.actions, -1).copy()

    @property
    def output(self) -> NDArray[np.float64]:
        """y, shape (m,), a copy."""
        return self.fleets.rows.y[0].copy()

    @property
    def constraint(self) -> NDArray[np.float64]:
        """g(y), shape (p,), negative inside; a copy."""
        return self.fleets.rows.g[0].copy()

    @property
    def given(self) -> NDArray[np.float64]:
        """(m,) the input that acts: what was asked for, unless a barrier keeps the fleet inside."""
        return self.fleets.rows.given[0].copy()

    def time(self) -> float:
        """Time since the reset in s."""
        return float(self.plant.data.time)

    def timestep(self) -> float:
        """Integration step in s."""
        return self.plant.timestep

    def set_control(self, control: ArrayLike) -> None:
        """Hold these inputs, shape (m,), from the next step on; a barrier takes them as a pull."""
        self.fleets.rows.pull[0] = control

    def step(self, n_sub_steps: int = 1) -> None:
        """Move on by so many integration steps, or up to the end of the one that leaves the set.

        From outside it does not move on.
        """
        if self.exit is None and n_sub_steps > 0:
            self.fleets.advance(n_sub_steps)

    def reset(self) -> None:
        """To the start, at time 0, no input acting."""
        self.place(self._start)

    def after_reset(self) -> None:
        """Nothing: :meth:`place` leaves everything as it must be."""

    def place(self, state: ArrayLike) -> None:
        """Start anew at time 0 from (m, states)."""
        self.fleets.place(0, state)
        self.fleets.look()

    def restore(self) -> None:
        """Back to the start of the last integration step; the exit that it led to stays noted."""
        self.fleets.restore(0)
