"""Runs of a batch in groups of eight: the common steps in lanes, the others one run by itself."""

from collections import deque
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.controllers.settings import OUTSIDE
from gne_mj.lanes import WIDTH, empty
from gne_mj.loops import adaptive_lanes, functions, lanes, lanes_held
from gne_mj.loops import monitor as watch
from gne_mj.loops.adaptive import TSIT5
from gne_mj.loops.layout import Setup, Steps
from gne_mj.loops.ode import CONTINUOUS, SAMPLED
from gne_mj.loops.one_loop import Native
from gne_mj.loops.recorder import next_row
from gne_mj.native import INTERPRETED, call_integer, compiled, kernel
from gne_mj.parameter_block import ParameterBlock, floats, floats_at, integers_at
from gne_mj.plants.functions import RK4

PIECES = 20_000  # of each run between looks at the user's wishes
SPARE = 8  # places that are kept


class Modules(NamedTuple):
    """What a loop of lanes is compiled for: modules of kernels that lanes can go through."""

    agent: ModuleType
    law: ModuleType
    game: ModuleType


# What the loop of lanes has no part in
_ELSEWHERE = (
    functions.PENALTY, functions.POSITIONS, functions.CONTACTS, functions.KEEP_APART,
    functions.PUSH_APART,
)  # fmt: skip


def modules_for(
    agent: ModuleType, law: ModuleType, game: ModuleType, setup: Setup, memory: int
) -> Any:
    """The modules of runs whose common steps can be taken in lanes, else None.

    That is in mode continuous with Runge-Kutta 4 or adaptive steps, and in mode sampled under laws
    without memory; laws that act outside the set go alone. A module says that lanes can go through
    its kernels by ``LANES = True``.
    """
    modules = Modules(agent, law, game)
    clock, linked = setup.clock, setup.problem.functions
    able = not INTERPRETED and all(getattr(each, "LANES", False) for each in modules)
    able = able and (
        (clock.mode == CONTINUOUS and clock.method in (RK4, TSIT5))
        or (clock.mode == SAMPLED and memory == 0)
    )
    able = able and setup.problem.settings[OUTSIDE] == 0.0  # lanes look at slacks alone
    able = able and not hasattr(game, "pseudo_gradient")  # whose sums have another order
    return modules if able and not np.any(linked[list(_ELSEWHERE)]) else None


def spread_out(array: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same number in all lanes."""
    made = empty(array.size)
    made[:] = array.reshape(-1, 1)
    return made


class LaneBlock:
    """Room for the parameter blocks of eight runs as one of lanes.

    Their whole numbers, and the lengths of all arrays, are those of ``like``.
    """

    def __init__(self, like: ParameterBlock) -> None:
        real = [array.dtype == np.float64 for array in like.arrays]
        self._kept = [
            spread_out(array) if each else array
            for array, each in zip(like.arrays, real, strict=True)
        ]
        pairs = [
            (kept.ctypes.data, array.size)
            for kept, array in zip(self._kept, like.arrays, strict=True)
        ]
        self._pairs, self.real = np.array(pairs, dtype=np.int64), np.array(real)
        self._pairs.flags.writeable = False

    @property
    def address(self) -> int:
        """Where it lies."""
        return int(self._pairs.ctypes.data)


def alike(one: ParameterBlock, other: ParameterBlock) -> bool:
    """Whether two runs can be in one vector: all whole numbers and all lengths are the same."""
    return one is other or all(
        np.array_equal(a, b) if a.dtype == np.int64 else a.size == b.size
        for a, b in zip(one.arrays, other.arrays, strict=True)
    )


class Marks(NamedTuple):
    """Where a workspace has what decides who goes on with a run."""

    length: int
    step: int
    recorder: int
    exit: int


def marks_of(native: Native, sizes: Steps) -> Marks:
    """Of a loop's workspaces of these sizes."""
    length = native.length(sizes)
    loop = native.workspaces(np.arange(float(length)), sizes).loop
    return Marks(length, *map(int, (loop.step, loop.recorder, loop.monitor.exit)))


class Group(NamedTuple):
    """Eight lanes and the runs that go through them; addresses, of which the last three of runs."""

    loop: int  # of lanes
    block: int
    room: int
    real: np.ndarray  # (arrays,) which of the block's hold no whole numbers
    alone: int  # the loop of one run
    blocks: np.ndarray
    workspaces: np.ndarray
    queue: np.ndarray  # (1 + 2 * WIDTH,) the next run; each lane's, -1 for none; and its block


@kernel
def load(group, marks, lane, run, last):
    """Put a run into a lane."""
    own, room = workspace_and_room(group, marks, run)
    for r in range(marks.length):
        room[WIDTH * r + lane] = own[r]
    turn = room[WIDTH * marks.length :]
    turn[lane], turn[WIDTH + lane] = last, next_row(int(own[marks.recorder]))
    block, queue = group.blocks[run], group.queue
    queue[1 + lane] = run
    if queue[1 + WIDTH + lane] == block:
        return
    queue[1 + WIDTH + lane] = block
    for index in range(len(group.real)):
        if group.real[index]:
            values = floats(block, index)
            target = integers_at(group.block + 16 * index, 1)[0]
            in_lanes = floats_at(target, WIDTH * len(values))
            for r in range(len(values)):
                in_lanes[WIDTH * r + lane] = values[r]


@kernel
def workspace_and_room(group, marks, run):
    """A run's workspace, and that of the lanes with what is behind it."""
    own = floats_at(group.workspaces[run], marks.length)
    return own, floats_at(group.room, WIDTH * (marks.length + 2))


@kernel
def unload(group, marks, lane):
    """Take a run out of its lane, which goes on holding it."""
    run = group.queue[1 + lane]
    own, room = workspace_and_room(group, marks, run)
    for r in range(marks.length):
        own[r] = room[WIDTH * r + lane]
    return run, own


@kernel
def unfinished(own, marks, last):
    """Whether a run has not left, and not come to its end."""
    return own[marks.exit] == watch.INSIDE and own[marks.step] < last


@kernel
def fill(group, marks, last):
    """Put waiting runs into empty lanes; the bits of the lanes that are runs."""
    queue, runs = group.queue, 0
    for lane in range(WIDTH):
        while queue[1 + lane] < 0 and queue[0] < len(group.blocks):
            run = queue[0]
            queue[0] += 1
            if unfinished(floats_at(group.workspaces[run], marks.length), marks, last):
                load(group, marks, lane, run, last)
        if queue[1 + lane] >= 0:
            runs |= 1 << lane
    return runs


@compiled
def advance_group(group, marks, last, pieces):
    """Move runs on to a step, in lanes; False if there is more to do after so many pieces."""
    for _turn in range(pieces):
        runs = fill(group, marks, last)
        if runs == 0:
            return True
        found = call_integer(group.loop, (group.block, group.room, pieces, runs))
        if found == 0:
            return False
        for lane in range(WIDTH):
            if (found >> lane) & 257 == 0:
                continue
            run, own = unload(group, marks, lane)
            if (found >> (lane + 8)) & 1:
                call_integer(group.alone, (group.blocks[run], group.workspaces[run], 1))
            if unfinished(own, marks, last):
                load(group, marks, lane, run, last)
            else:
                group.queue[1 + lane] = -1
    return False


class _Place(NamedTuple):
    """Where eight runs are moved on."""

    like: ParameterBlock
    block: LaneBlock
    room: NDArray[np.float64]


class LaneLoop:
    """Moves runs on in lanes.

    Args:
        modules: of kernels.
        sizes: of the runs.
        native: the loop of one run.
        alone: its address.
    """

    def __init__(self, modules: Modules, sizes: Steps, native: Native, alone: int) -> None:
        self._modules = modules
        kind = lanes if sizes.mode == CONTINUOUS else lanes_held
        if sizes.method == TSIT5:
            kind = adaptive_lanes
        self._loop, self._alone = int(kind.build(*modules).address), alone
        self._marks = marks_of(native, sizes)
        self._room = self._marks.length + lanes.scratch_length(sizes.actions)
        self._spare: deque[_Place] = deque(maxlen=SPARE)

    def fits(self, blocks: Sequence[ParameterBlock]) -> bool:
        """Whether all these runs can go through the lanes together."""
        first = blocks[0]
        return all(each.modules == self._modules and alike(each, first) for each in set(blocks))

    def move(
        self,
        blocks: Sequence[ParameterBlock],
        addresses: NDArray[np.int64],
        workspaces: NDArray[np.int64],
        last: int,
        stopped: Callable[[], bool],
    ) -> bool:
        """Move runs of one kind on to the start of step ``last``; False if stopped meanwhile.

        Args:
            blocks: of the runs, which fit.
            addresses, workspaces: (runs,) the blocks' addresses, and the workspaces'.
            last: which step.
            stopped: asked from time to time.
        """
        place = self._place(blocks[0])
        queue = np.zeros(1 + 2 * WIDTH, dtype=np.int64)
        queue[1 : 1 + WIDTH] = -1
        group = Group(
            self._loop, place.block.address, int(place.room.ctypes.data), place.block.real,
            self._alone, addresses, workspaces, queue,
        )  # fmt: skip
        while not advance_group(group, self._marks, float(last), PIECES):
            if stopped():
                return False
        self._spare.append(place)
        return True

    def _place(self, like: ParameterBlock) -> "_Place":
        """Eight lanes, for one thread at a time: used ones again if they were for such runs."""
        try:
            place = self._spare.pop()
        except IndexError:
            place = None
        if place is None or place.like is not like:
            room = empty(self._room)
            room[:] = 0.0
            place = _Place(like, LaneBlock(like), room)
        return place
