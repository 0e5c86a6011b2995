"""A robot by itself, put under inputs and back: what all of an examination stands on."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import EngineError
from gne_mj.plants import acting_forces
from gne_mj.plants.callbacks import quiet
from gne_mj.plants.fleet_plant import FleetPlant, build_fleet
from gne_mj.plants.mjcf_fleet import MjcfPlant
from gne_mj.plants.mjcf_output import Output
from gne_mj.plants.mjcf_robot import MjcfRobots

Array = NDArray[np.float64]
POINTS = ("body", "site", "geom")
BUILT = 1e-9  # a limit that all actuators let through


@dataclass(frozen=True, eq=False)
class Bench:
    """One robot, its model, and the state it begins in.

    Args:
        plant: with the robot's d channels.
        limits: (d,) greatest |u| that the agents' own limit and the file's clamps let through.
        start: its state at rest in the file's pose.
    """

    plant: FleetPlant
    limits: Array
    start: Array

    @property
    def channels(self) -> int:
        """d."""
        return self.plant.agents.channels

    def steps(self, duration: float) -> int:
        """Timesteps in a time in s, at least one."""
        return max(1, round(duration / self.plant.timestep))

    def move(self, u: Array, steps: int = 1) -> bool:
        """Move on under u (d,); False where what follows is no motion of the model's."""
        try:
            self.plant.step(u, steps)
        except EngineError:
            self.plant.data.warning.number[:] = 0
            return False
        return True

    def response(self, state: Array, u: Array, steps: int) -> Array:
        """Outputs (d,) so many steps later under u (d,)."""
        found: Array = self.course(state, u, (steps,))[0]
        return found

    def course(self, state: Array, u: Array, at: Sequence[int]) -> Array:
        """(len(at), d) outputs after so many steps each, under u (d,) held all the time.

        Not numbers where they cannot be followed.
        """
        acting_forces.restore(self.plant, state)
        found, now = np.full((len(at), self.channels), np.nan), 0
        for row, steps in enumerate(at):
            if not self.move(u, steps - now):
                break
            found[row], now = self.plant.output, steps
        return found

    def save(self) -> Array:
        """The present state."""
        return acting_forces.saved(self.plant)

    def go(self, state: Array) -> None:
        """To a state."""
        acting_forces.restore(self.plant, state)

    def moving(self, y: Array) -> Array:
        """The state in the file's pose with outputs y (d,); of positions with a look-ahead at rest.

        Raises:
            InvalidInput: no joint velocities give these outputs.
        """
        state = np.zeros((self.channels, 2))
        state[:, 0] = y
        if self.plant.passive is not None:
            state[:, 1] = y
        self.plant.reset(state)
        return self.save()

    def use_step(self, timestep: float, integrator: str) -> None:
        """Integrate by another step (s) and integrator from now on."""
        option = self.plant.model.opt
        option.timestep = self.plant.timestep = timestep
        option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")

    def touches(self) -> bool:
        """Whether the robot touches anything where it begins."""
        self.go(self.start)
        with quiet():
            mujoco.mj_forward(self.plant.model, self.plant.data)
        return bool(self.plant.data.ncon > 0)

    def off_centre(self) -> float:
        """How far in m the point whose velocity is y lies from the robot's centre of mass where it
        begins; 0 where y is none's."""
        output = self.plant.agents.robots[0].output  # type: ignore[attr-defined]
        if not isinstance(output, Output) or output.kind not in POINTS or output.angular:
            return 0.0
        self.go(self.start)
        model, data, name = self.plant.model, self.plant.data, f"robot_1/{output.name}"
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        point = getattr(data, output.kind)(name)
        body = point.id if output.kind == "body" else getattr(model, output.kind)(name).bodyid[0]
        return float(np.linalg.norm(point.xpos - data.subtree_com[model.body_rootid[body]]))

    def stops(self) -> list[str]:
        """The joints that are at their stops now."""
        with quiet():
            mujoco.mj_forward(self.plant.model, self.plant.data)
        names = [name.partition("/")[2] for name in acting_forces.joints_at_stops(self.plant)]
        return [name or "a nameless one" for name in names]


def bench(robot: MjcfRobots, timestep: float, integrator: str) -> Bench:
    """The bench of one robot.

    Raises:
        InvalidInput: see :class:`gne_mj.plants.mjcf_fleet.MjcfPlant`.
    """
    own = robot.input_limit
    free = replace(robot, input_limit=np.minimum(own, BUILT))
    plant = build_fleet(free, timestep, integrator, decorated=False)
    assert isinstance(plant, MjcfPlant)
    found = Bench(plant, np.minimum(own, plant.lets_through), np.zeros(0))
    return replace(found, start=found.moving(np.zeros(plant.agents.channels)))
