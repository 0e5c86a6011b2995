"""Batches in MuJoCo: compiled loops with the laws as C callbacks, on threads.

Threads of our own rather than ``mujoco.batch.Batch``, whose rows cannot divide a step.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from types import ModuleType
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np

from gne_mj.loops import monitor as watch
from gne_mj.loops.batch import BatchLoop, Case, Outcome, Span, begin, workers
from gne_mj.loops.layout import Steps
from gne_mj.loops.mujoco import build, machine_of
from gne_mj.loops.mujoco_loop import observe
from gne_mj.loops.mujoco_workspace import put_start, workspace_of
from gne_mj.loops.ode import CONTINUOUS
from gne_mj.parameter_block import ParameterBlock
from gne_mj.plants.callbacks import callbacks
from gne_mj.plants.native_mujoco import offsets

if TYPE_CHECKING:
    from gne_mj.plants.fleet_plant import FleetPlant

# Steps of a run between looks at the user's wishes
STRIDE = 20_000


class MujocoBatch(BatchLoop):
    """Runs of fleets with one layout, each thread with a model and data of its own.

    Args:
        plant: such a fleet, with room for the runs' loop.
        faults: module of kernels, see :func:`gne_mj.loops.mujoco.build`.
        faulty: whether runs record what was seen and what acted.
        threads: how many.
    """

    def __init__(
        self,
        plant: "FleetPlant",
        faults: ModuleType,
        faulty: bool,
        threads: int,
    ) -> None:
        self._passive, self._faulty = plant.passive, faulty
        self._control, self._remember, self._advance = build(offsets(), plant.kernels, faults)
        self._fleets = [_Fleet(plant.twin() if number else plant) for number in range(threads)]

    def run(self, cases: Sequence[Case], span: Span, stopped: Callable[[], bool]) -> Outcome | None:
        """See the base class."""
        parameter_blocks, sizes, recorder, monitors = begin(cases, span, self._faulty)
        blocks, first_rows = recorder.addresses, recorder.heads.first
        runs = iter(range(len(cases)))  # each thread takes the next one: no queue, no task for each

        def work(fleet: _Fleet) -> bool:
            progress = fleet.progress(sizes)
            monitor = progress.monitor
            for run in runs:
                fleet.begin(cases[run], parameter_blocks[run], sizes.mode)
                progress.recorder = blocks[run]
                for done in range(0, span.steps, STRIDE):
                    if stopped():
                        return False
                    self._advance(fleet.machine, min(STRIDE, span.steps - done))
                    if monitor.exit != watch.INSIDE:
                        break
                first_rows[run] = span.last
                observe(fleet.plant, self._control, progress)
                monitors[run] = monitor
            return True

        for case in cases:
            self._fleets[0].plant.prepare(case.state)
        remember = self._remember if sizes.mode == CONTINUOUS and sizes.memory else None
        with (
            callbacks(control=self._control, passive=self._passive, activation=remember),
            workers(len(self._fleets)) as pool,
        ):
            try:
                done = list(pool.map(work, self._fleets))
            finally:
                for _ in runs:  # if something went wrong, nobody begins another one
                    pass
        return Outcome(recorder.all(), monitors) if all(done) else None


class _Fleet:
    """A plant of one thread, and where its state is kept at a step's start."""

    def __init__(self, plant: "FleetPlant") -> None:
        self.plant = plant
        self.machine = machine_of(plant.model, plant.data)
        self._parameters = plant.agents.parameters

    def progress(self, sizes: Steps) -> Any:
        """The progress and monitor of its runs, by name."""
        plant = self.plant
        return workspace_of(plant.data.userdata, plant.sizes.workspace, sizes).loop

    def begin(self, case: Case, parameter_block: ParameterBlock, mode: int) -> None:
        """Make this the start of a run."""
        plant, given = self.plant, case.parameters
        if given is not self._parameters and not np.array_equal(given, self._parameters):
            for name, at, values in plant.model_fields(given[None]):
                getattr(plant.model, name)[at] = values[0]
            mujoco.mj_setConst(plant.model, plant.data)
            plant.agents = replace(plant.agents, parameters=given)  # which say a start
        self._parameters = given
        plant.reset(case.state)
        put_start(plant, parameter_block, mode, case.memory)
