"""One run of a fleet in MuJoCo, as Python drives it."""

from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import EngineError
from gne_mj.loops import faultless
from gne_mj.loops import monitor as watch
from gne_mj.loops.base import ClosedLoop, Present, Samples
from gne_mj.loops.layout import Setup, steps_of
from gne_mj.loops.mujoco import build, machine_of
from gne_mj.loops.mujoco_workspace import mujoco_parameter_block, put_start, workspace_of
from gne_mj.loops.ode import CONTINUOUS
from gne_mj.loops.recorder import Recorder
from gne_mj.plants.callbacks import callbacks
from gne_mj.plants.native_mujoco import LOOP_MARK, USERDATA_HEADER, offsets
from gne_mj.plants.push import pushing, slopes

if TYPE_CHECKING:
    from gne_mj.plants.fleet_plant import FleetPlant


class MujocoLoop(ClosedLoop):
    """The closed loop of a fleet in MuJoCo.

    Args:
        plant: the fleet, reset to its start, with room for
            :func:`gne_mj.loops.mujoco_workspace.entries_needed`.
        setup: what the run is made of.
        memory: the law's, at the start.
        faults: module of kernels, see :func:`gne_mj.loops.ode.control_step`.
    """

    def __init__(
        self,
        plant: "FleetPlant",
        setup: Setup,
        memory: NDArray[np.float64],
        faults: ModuleType = faultless,
    ) -> None:
        self.plant = plant
        self._control, self._remember, self._advance = build(offsets(), plant.kernels, faults)
        self._acting = self._control  # or what takes its place while something is pushed
        self._parameter_block = mujoco_parameter_block(plant, setup, plant.agents, len(memory))
        self._faulty = faults.RECORDED
        data, sizes = plant.data, steps_of(self._parameter_block)
        workspace = workspace_of(data.userdata, plant.sizes.workspace, sizes)
        loop = workspace.loop
        self._progress, self.monitor, self._u = loop, loop.monitor, loop.u
        self._memory = put_start(plant, self._parameter_block, setup.clock.mode, memory)
        moved = setup.clock.mode == CONTINUOUS and len(memory) > 0
        self._remembers = moved  # by MuJoCo's integrator
        self._machine = machine_of(plant.model, data)

    @property
    def _step(self) -> int:
        """Steps taken; in userdata, so that a state that is set again brings its own time."""
        return int(self._progress["step"])  # by item, which costs a part of what attributes do

    @property
    def time(self) -> float:
        """Time of the present state in s."""
        return self._step * self.plant.timestep

    def advance(self, samples: int, every: int) -> Samples:
        """See the base class."""
        if self.monitor.exit != watch.INSIDE:
            samples = 0
        data, first = self.plant.data, self._step
        recorder = self._recorder(samples, every)
        self._progress.stage = 0.0
        remember = self._remember if self._remembers else None
        with callbacks(control=self._acting, passive=self.plant.passive, activation=remember):
            steps = self._advance(self._machine, samples * every)
        # The callback counts steps, but one that ended in an exit was not taken.
        self._progress.step = first + steps
        self._progress.recorder = 0.0
        data.time = self.time
        return recorder.samples(0)

    def finish(self) -> Samples:
        """See the base class."""
        data = self.plant.data
        state = self.plant.state
        recorder = self._recorder(1, 1)
        with callbacks(passive=self.plant.passive):
            observe(self.plant, self._control, self._progress)
        self._progress.recorder = 0.0
        if recorder.done[0]:
            return recorder.samples(0)
        none = np.full((1, len(self._u)), np.nan)
        faulty_rows = none[:, : len(self._u) * self._faulty]
        qpos = data.qpos[None, : self.plant.configuration].copy()
        return Samples(state[None], none, self._memory[None].copy(), faulty_rows, faulty_rows, qpos)

    def present(self) -> Present:
        """See the base class."""
        qpos = self.plant.data.qpos[: self.plant.configuration].copy()
        return Present(self.plant.state, self._memory.copy(), qpos)

    def start_at(self, step: int) -> None:
        """See the base class."""
        self._progress.step = self._progress.work.memory_step = step
        self.plant.go_to_time(self.time)

    def _adopt(self, setup: Setup) -> None:
        self._parameter_block = mujoco_parameter_block(
            self.plant, setup, self.plant.agents, len(self._memory)
        )

    def push(self, force: NDArray[np.float64]) -> None:
        """See the base class, and :mod:`gne_mj.plants.push`."""
        plant = self.plant
        for r in np.flatnonzero(force).tolist():
            if plant.way(r) is None:
                output = plant.outputs[r]
                raise EngineError(
                    f"the output {output} is told by a sensor alone, so that no force at it is"
                    " known: nothing to push at"
                )
        plant.pushes[:] = self._control.address, *force
        if np.any(force):
            where = slopes(plant.model, plant.data)
            self._acting = pushing(offsets(), where, plant.kernels)
        else:
            self._acting, plant.data.qfrc_applied[:] = self._control, 0.0

    def push_unit(self, channel: int) -> str:
        """See the base class."""
        return self.plant.push_unit(channel)

    def _recorder(self, rows: int, every: int) -> Recorder:
        """Room for rows from now on, made known to the callbacks."""
        agents, userdata = self.plant.agents, self.plant.data.userdata
        # Marked as this loop's again: the plant's own step may have come between.
        if userdata[0] == 0.0:
            raise EngineError(
                "the loop's MuJoCo data was reset: make a new loop to start from there"
            )
        userdata[:USERDATA_HEADER] = LOOP_MARK, self._parameter_block.address
        recorder = Recorder(
            1, rows, (agents.channels, agents.states), len(self._memory), self._faulty,
            self.plant.configuration, first=self._step, every=every,
        )  # fmt: skip
        self._progress.recorder = recorder.addresses[0]
        return recorder


def observe(plant: "FleetPlant", control: Any, progress: Any) -> None:
    """Observe the present state without moving on, by the callback of a step's start.

    Args:
        plant: with mjData of a loop.
        control: the loop's callback.
        progress: of the loop, as its workspace in userdata has it.

    The plant's callbacks must be installed.
    """
    model, data = plant.model, plant.data
    plant.refresh()
    step, progress.stage = progress.step, 0.0
    control.ctypes(model._address, data._address)
    progress.step, progress.stage = step, 0.0
