"""Batches in MuJoCo: ``mujoco.batch.Batch`` with the laws as C callbacks."""

from collections.abc import Callable, Sequence
from types import ModuleType
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from gne_mj.loops import monitor as watch
from gne_mj.loops.batch import BatchLoop, Case, Outcome, Span, begin
from gne_mj.loops.layout import MEMORY, MODE, MONITOR, RECORDER, STEP
from gne_mj.loops.mujoco import build, put_start
from gne_mj.loops.ode import CONTINUOUS
from gne_mj.loops.recorder import FIRST
from gne_mj.plants.mujoco import ROOM, SIZES
from gne_mj.plants.native_mujoco import callbacks, offsets
from gne_mj.table import Table

if TYPE_CHECKING:
    from gne_mj.plants.mjcf_fleet import MjcfPlant
    from gne_mj.plants.mujoco import MujocoPlant

WHOLE = mujoco.mjtState.mjSTATE_INTEGRATION
# Steps of all runs between looks at the user's wishes; long, since a run's state moves in and out
STRIDE = 200


class MujocoBatch(BatchLoop):
    """Runs of fleets with one layout.

    Args:
        plant: such a fleet, with room for the runs' loop.
        law, game, acting, faults: modules of kernels, see :func:`gne_mj.loops.mujoco.build`.
        faulty: whether runs record what was seen and what acted.
        threads: how many.
        room: the most cases of one call.
    """

    def __init__(
        self,
        plant: "MujocoPlant | MjcfPlant",
        law: ModuleType,
        game: ModuleType,
        acting: ModuleType,
        faults: ModuleType,
        faulty: bool,
        threads: int,
        room: int,
    ) -> None:
        self._plant, self._faulty = plant, faulty
        self._control, self._remember, _, self._finish = build(
            offsets(), plant.kernels, law, game, acting, faults
        )
        self._batch = Batch(plant.model, room, threads)
        self._userdata = self._batch.bind("userdata")
        self._start = int(plant.table_arrays[SIZES][ROOM])
        self._expanded = False

    def run(self, cases: Sequence[Case], span: Span, stopped: Callable[[], bool]) -> Outcome | None:
        """See the base class."""
        tables, sizes, recorder, monitors = begin(cases, span, self._faulty)
        self._begin(cases, tables, recorder.addresses)
        first = self._start + MONITOR
        now = self._userdata[: len(cases), first : first + monitors.shape[1]]
        remember = self._remember if sizes[MODE] == CONTINUOUS and sizes[MEMORY] else None
        done = 0
        while done < span.steps:
            inside = np.flatnonzero(now[:, watch.EXIT] == watch.INSIDE)
            if len(inside) == 0:
                break
            if stopped():
                return None
            stride = min(STRIDE, span.steps - done)
            with callbacks(control=self._control, passive=self._plant.passive, activation=remember):
                self._batch.step(ids=inside, nstep=stride)
            done += stride
        recorder.blocks[:, FIRST] = span.last
        for run in np.flatnonzero(now[:, watch.EXIT] == watch.INSIDE):
            self._observe(int(run))
        return Outcome(recorder.all(), now.copy())

    def _begin(
        self, cases: Sequence[Case], tables: Sequence[Table], blocks: NDArray[np.int64]
    ) -> None:
        """Put every case's start into its row."""
        plant = self._plant
        self._set_models(cases)
        for run, (case, table) in enumerate(zip(cases, tables, strict=True)):
            plant.reset(case.state)
            put_start(plant.data, self._start, table, int(table.arrays[STEP][MODE]), case.memory)
            plant.data.userdata[self._start + RECORDER] = blocks[run]
            mujoco.mj_getState(plant.model, plant.data, self._batch.state[run], WHOLE)

    def _set_models(self, cases: Sequence[Case]) -> None:
        """Give every row the masses, springs and dampers of its own robots."""
        own = self._plant.agents.parameters
        if not self._expanded and all(np.array_equal(case.parameters, own) for case in cases):
            return
        self._expanded = True
        ids = np.arange(len(cases))
        for name, at, values in self._plant.model_fields(
            np.stack([case.parameters for case in cases])
        ):
            self._batch.expand(name)[ids[:, None], at] = values
        self._batch.set_const(ids)

    def _observe(self, run: int) -> None:
        """The last observation of a row, at its end."""
        plant = self._plant
        data = self._batch.get_data(run, plant.data)
        if not plant.measures_every_stage:
            mujoco.mj_forward(plant.model, data)  # sensors are of the last step's start
        self._finish(plant.model._address, data._address)
        self._userdata[run] = data.userdata
