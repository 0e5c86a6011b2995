"""A fleet under held forces, looked at after every integration step: what dm_control steps."""

from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import Any

import mujoco
import numpy as np
from dm_control.rl import control
from numpy.typing import ArrayLike, NDArray

from gne_mj import game_functions as games
from gne_mj.game_model import Game
from gne_mj.native import compiled, source_key
from gne_mj.parameter_block import ParameterBlock
from gne_mj.plain import raise_pending
from gne_mj.plants import mjcf_file
from gne_mj.plants.callbacks import callbacks
from gne_mj.plants.fleet_plant import FleetPlant
from gne_mj.plants.mjcf_fleet import MjcfPlant
from gne_mj.plants.mujoco import sizes_in
from gne_mj.plants.native_mujoco import (
    PLANT_MARK,
    STATE,
    USERDATA_HEADER,
    Offsets,
    call_state,
    check_warnings,
    field,
    offsets,
    parameter_block_of,
    state_functions,
    step_address,
    timed_step,
)

# What a look found in place of the first constraint that is violated
INSIDE, DIVERGED = -1, -2


@dataclass(frozen=True)
class Exit:
    """How an episode left the shared constraint set.

    Attributes:
        time: in s, at the end of the integration step that left it.
        constraint: name of the first constraint found violated; empty if the state is no longer
            a number.
        value: g_l there, not negative (or not a number).
        restored: whether what is observed is the state before that step, since at its end not all
            was a number.
    """

    time: float
    constraint: str
    value: float
    restored: bool

    def __str__(self) -> str:
        if not self.constraint:
            return f"at {self.time:.6g} s the state was no longer a number"
        return f"at {self.time:.6g} s '{self.constraint}' was violated, g = {self.value + 0.0:.6g}"


@cache
def build(at: Offsets, fleet: ModuleType) -> Any:
    """The native loop of mj_step that ends where the set is left.

    Args:
        at: where MuJoCo keeps what.
        fleet: the module that reads the robots, as :mod:`gne_mj.plants.mujoco` does.
    """
    states, output = len(fleet.AGENT.STATES), fleet.AGENT.OUTPUT
    source = source_key(fleet, fleet.AGENT)

    @compiled
    def advance(mj_step, functions, model, data, data_of_game, steps, before, state, y, g):
        """Take up to ``steps`` steps; return INSIDE, DIVERGED or the constraint that ended them.

        ``before`` becomes MuJoCo's state at the last step's start (``functions`` are as
        ``state_functions()`` has them); state, y and g become those at its end. With no steps the
        present is looked at.
        """
        _ = source
        parameter_block = abs(parameter_block_of(at, model, data))
        sizes = sizes_in(parameter_block)
        nq, nv, na = sizes.nq, sizes.nv, sizes.na
        qpos, qvel = field(data, at.qpos, nq), field(data, at.qvel, nv)
        act = field(data, at.act, na)
        for taken in range(steps + 1):
            if taken > 0 or steps == 0:
                call_state(functions[0], model, data, before.ctypes.data, functions[2])
            if taken > 0:
                timed_step(at, mj_step, model, data)
            fleet.refresh(model, data, parameter_block)
            fleet.gather(at, data, parameter_block, state)
            for r in range(len(y)):
                y[r] = state[r * states + output]
            found = INSIDE
            games.values(data_of_game, data_of_game.all_constraints, y, g)
            for k in range(len(g)):
                if found == INSIDE and not g[k] < 0.0:
                    found = k
            for array in (qpos, qvel, act):
                for r in range(len(array)):
                    if not np.isfinite(array[r]):
                        found = DIVERGED
            if found != INSIDE:
                return found
        return INSIDE

    return advance


class FleetPhysics(control.Physics):
    """A MuJoCo fleet that holds its forces and stops at the integration step that leaves the set.

    It moves exactly as its plant's ``step`` does; the springs' native forces are installed while
    it steps, and nothing of it stays in MuJoCo meanwhile.

    Args:
        plant: the fleet.
        game: whose constraints are looked at.
        start: (m, states) that ``reset`` goes to.

    Attributes:
        plant, game: as given.
        exit: how the set was left since the last reset; None while it was not.
    """

    def __init__(self, plant: FleetPlant, game: Game, start: NDArray[np.float64]) -> None:
        self.plant, self.game, self._start = plant, game, start
        self.exit: Exit | None = None
        at, kernels = offsets(), plant.kernels
        self._advance = build(at, kernels)
        self._parameter_block = ParameterBlock(plant.parameter_arrays)
        m, model = game.actions, plant.model
        self._actuators = np.array(plant.places.actuator)
        self._inputs = np.zeros(m)
        self._before = np.zeros(mujoco.mj_stateSize(model, STATE))
        self._state = np.zeros(m * plant.agents.states)
        self._y, self._g = np.zeros(m), np.zeros(game.constraints_count)
        self.joints = _joints(plant)
        self.reset()

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
        return self._state.reshape(self.game.actions, -1).copy()

    @property
    def output(self) -> NDArray[np.float64]:
        """y, shape (m,), a copy."""
        return self._y.copy()

    @property
    def constraint(self) -> NDArray[np.float64]:
        """g(y), shape (p,), negative inside; a copy."""
        return self._g.copy()

    def time(self) -> float:
        """Time since the reset in s."""
        return float(self.plant.data.time)

    def timestep(self) -> float:
        """Integration step in s."""
        return self.plant.timestep

    def set_control(self, control: ArrayLike) -> None:
        """Hold these inputs, shape (m,), from the next step on."""
        self._inputs[:] = control

    def step(self, n_sub_steps: int = 1) -> None:
        """Move on by so many integration steps, or up to the end of the one that leaves the set.

        From outside it does not move on.
        """
        if self.exit is None:
            self._observe(n_sub_steps)

    def reset(self) -> None:
        """To the start, at time 0, no input acting."""
        self.place(self._start)

    def after_reset(self) -> None:
        """Nothing: :meth:`place` leaves everything as it must be."""

    def place(self, state: ArrayLike) -> None:
        """Start anew at time 0 from (m, states)."""
        self.plant.reset(state)
        self._inputs[:] = 0.0
        self.exit = None
        self._observe(0)

    def restore(self) -> None:
        """Back to the start of the last integration step; the exit that it led to stays noted."""
        left = self.exit
        mujoco.mj_setState(self.model, self.data, self._before, STATE)
        self.exit = None
        self._observe(0)
        if left is not None:
            self.exit = Exit(left.time, left.constraint, left.value, restored=True)

    def _observe(self, steps: int) -> None:
        data = self.plant.data
        data.userdata[:USERDATA_HEADER] = PLANT_MARK, self._parameter_block.address
        data.ctrl[self._actuators] = self._inputs
        with callbacks(passive=self.plant.passive):
            found = self._advance(
                step_address(), state_functions(), self.model._address, data._address,
                self.game.data, steps, self._before, self._state, self._y, self._g,
            )  # fmt: skip
        raise_pending()
        if found == INSIDE:
            check_warnings(data)
        if found == DIVERGED:
            self.exit = Exit(self.time(), "", np.nan, restored=False)
        elif found != INSIDE:
            name, value = self.game.constraint_names[found], float(self._g[found])
            self.exit = Exit(self.time(), name, value, restored=False)


def _joints(plant: FleetPlant) -> list[list[slice]]:
    """Of each MJCF robot its parts of qpos, qvel and act; none of others, whose state is known.

    Robots are attached one behind the other, so that their numbers are too; names would not do,
    since joints without one are not given any.
    """
    if not isinstance(plant, MjcfPlant):
        return []
    parts, at = [], np.zeros(3, dtype=int)
    for robot in plant.agents.files:
        alone = mjcf_file.alone(robot.path)
        ends = at + np.array([alone.nq, alone.nv, alone.na])
        parts.append([slice(int(a), int(b)) for a, b in zip(at, ends, strict=True)])
        at = ends
    assert tuple(at) == (plant.model.nq, plant.model.nv, plant.model.na)
    return parts
