"""Many fleets of one system, stepped natively on threads, each as it would be alone."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.environment.barrier import Barrier
from gne_mj.environment.stepping import DIVERGED, INSIDE, NO_INPUT, Rows, Tools, build
from gne_mj.game_model import Game
from gne_mj.loops.feedback import LARGEST_INPUT
from gne_mj.loops.layout import loop_workspace_length, steps_of
from gne_mj.parameter_block import ParameterBlock
from gne_mj.plain import raise_pending
from gne_mj.plants.callbacks import callbacks
from gne_mj.plants.fleet_plant import FleetPlant
from gne_mj.plants.native_mujoco import (
    PLANT_MARK,
    USERDATA_HEADER,
    check_warnings,
    offsets,
    step_address,
)


@dataclass(frozen=True)
class Exit:
    """How an episode left the shared constraint set.

    Attributes:
        time: in s, at the end of the integration step that left it.
        constraint: name of the first constraint found violated; empty if there is none: the state
            is no longer a number, or the barrier has no input.
        value: g_l there, not negative (or not a number).
        restored: whether what is observed is the state before that step, since at its end not all
            was a number.
        stuck: whether it ended before it left, since the barrier knows no input that stays inside.
    """

    time: float
    constraint: str
    value: float
    restored: bool = False
    stuck: bool = False

    def __str__(self) -> str:
        if self.stuck:
            return f"at {self.time:.6g} s no input was found that stays inside"
        if not self.constraint:
            return f"at {self.time:.6g} s the state was no longer a number"
        return f"at {self.time:.6g} s '{self.constraint}' was violated, g = {self.value + 0.0:.6g}"


class Fleets:
    """Fleets beside each other that hold their inputs, each up to the step that leaves the set.

    Args:
        plants: such a fleet for each thread, with a model of its own each.
        game: whose constraints are looked at.
        count: how many fleets.
        barrier: what keeps them inside; None: nothing does, and a pull acts as it is.

    Attributes:
        rows: what native code works on, see :class:`gne_mj.environment.stepping.Rows`.
        plants: that of each fleet; several may share one, whose mjData is then any of theirs.
    """

    def __init__(
        self,
        plants: Sequence[FleetPlant],
        game: Game,
        count: int = 1,
        barrier: Barrier | None = None,
    ) -> None:
        first = plants[0]
        self.game, self._passive = game, first.passive
        self._advance = build(offsets(), first.kernels)
        self._limit = np.minimum(first.agents.input_limit, LARGEST_INPUT)
        cuts = np.linspace(0, count, len(plants) + 1).round().astype(int).tolist()
        self._parts = list(pairwise(cuts))
        self.plants = [
            plant
            for plant, (low, high) in zip(plants, self._parts, strict=True)
            for _ in range(high - low)
        ]
        owned = [ParameterBlock(plant.parameter_arrays) for plant in plants]
        keepers = [None if barrier is None else barrier.parameter_block(plant) for plant in plants]
        self._kept_alive = barrier, owned, keepers
        shared = np.diff(cuts) > 1
        self._tools = [_tools(*each) for each in zip(plants, keepers, shared, strict=True)]
        self._marks = np.repeat([each.address for each in owned], np.diff(cuts))
        self.rows = _rows(self.plants, game)
        keeper = keepers[0]
        room = 0 if keeper is None else int(loop_workspace_length(steps_of(keeper)))
        self._memory = np.zeros((count, room))
        self.rows.workspace[:] = [row.ctypes.data for row in self._memory]
        self.exits: list[Exit | None] = [None] * count

    @property
    def count(self) -> int:
        """How many fleets there are."""
        return len(self.plants)

    def time(self, row: int) -> float:
        """Since a fleet's start, in s."""
        return float(self.rows.now[row, 0])

    def joints(self, rows: slice) -> NDArray[np.float64]:
        """(E, nq + nv + na) of MuJoCo's state: positions, velocities, activations."""
        model = self.plants[0].model
        return self.rows.now[rows, 1 : 1 + model.nq + model.nv + model.na]

    @cached_property
    def _pool(self) -> ThreadPoolExecutor:
        return ThreadPoolExecutor(len(self._parts) - 1)  # besides the thread that asks

    def place(self, row: int, state: ArrayLike) -> None:
        """Let a fleet start anew at time 0 from (m, states), nothing acting; :meth:`look` next."""
        rows, plant = self.rows, self.plants[row]
        plant.reset(state)
        self._memory[row] = 0.0
        rows.pull[row] = rows.given[row] = 0.0
        rows.step[row] = rows.limited[row] = 0
        rows.found[row], self.exits[row] = INSIDE, None
        header = PLANT_MARK, float(self._marks[row])
        plant.data.userdata[:USERDATA_HEADER] = header
        mujoco.mj_getState(plant.model, plant.data, rows.now[row], plant.state_bits)

    def look(self) -> None:
        """Bring all rows that move up to date without stepping."""
        self.advance(0)

    def restore(self, row: int) -> None:
        """Back to the start of a fleet's last step; the exit that it led to stays noted."""
        left, plant, rows = self.exits[row], self.plants[row], self.rows
        rows.now[row] = rows.before[row]
        mujoco.mj_setState(plant.model, plant.data, rows.now[row], plant.state_bits)
        moves, found = rows.moves.copy(), rows.found[row]
        rows.moves[:] = np.arange(self.count) == row
        rows.found[row] = INSIDE
        self.look()
        rows.moves[:], rows.found[row] = moves, found
        if left is not None:
            self.exits[row] = Exit(left.time, left.constraint, left.value, restored=True)

    def advance(self, steps: int) -> None:
        """Move all rows that move by so many steps, each up to the end of one that leaves the set.

        Those that are outside do not go on. With no steps they are looked at.
        """
        rows, data = self.rows, self.game.data

        def part(number: int) -> None:
            first, last = self._parts[number]
            self._advance(self._tools[number], data, self._limit, rows, first, last, steps)

        with callbacks(passive=self._passive):
            others = [self._pool.submit(part, number) for number in range(1, len(self._parts))]
            try:
                part(0)
            finally:  # none may step on without the callbacks
                for each in others:
                    each.result()
        raise_pending()
        for row in np.flatnonzero((rows.found != INSIDE) & (rows.moves == 1)).tolist():
            if self.exits[row] is None:
                check_warnings(self.plants[row].data)
                self.exits[row] = self._exit(row)

    def _exit(self, row: int) -> Exit:
        time, found = self.time(row), int(self.rows.found[row])
        if found in (DIVERGED, NO_INPUT):
            return Exit(time, "", np.nan, stuck=found == NO_INPUT)
        return Exit(time, self.game.constraint_names[found], float(self.rows.g[row, found]))

    def close(self) -> None:
        """Let the threads go."""
        if "_pool" in vars(self):
            self._pool.shutdown()
            del self._pool  # a later step has others


def _tools(plant: FleetPlant, keeper: ParameterBlock | None, shared: bool) -> Tools:
    kind = plant.agents.kind
    return Tools(
        step_address(), step_address("mj_getState"), step_address("mj_setState"), plant.state_bits,
        plant.model._address, plant.data._address, int(shared),
        0 if keeper is None else keeper.address, len(kind.STATES), kind.OUTPUT,
    )  # fmt: skip


def _rows(plants: Sequence[FleetPlant], game: Game) -> Rows:
    count, m, first = len(plants), game.actions, plants[0]

    def whole() -> NDArray[np.int64]:
        return np.zeros(count, dtype=np.int64)

    def real(width: int) -> NDArray[np.float64]:
        return np.zeros((count, width))

    return Rows(
        workspace=whole(),
        moves=whole() + 1,
        step=whole(),
        found=whole() + INSIDE,
        limited=whole(),
        pull=real(m),
        given=real(m),
        state=real(m * first.agents.states),
        y=real(m),
        g=real(game.constraints_count),
        now=real(mujoco.mj_stateSize(first.model, first.state_bits)),
        before=real(mujoco.mj_stateSize(first.model, first.state_bits)),
    )
