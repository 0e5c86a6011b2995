"""A fleet of robots as it is drawn: which bodies stand for agents, and what shows their use."""

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput
from gne_mj.native import compiled
from gne_mj.plants.agent_type import has_ode, in_mujoco
from gne_mj.plants.fleet_plant import FleetPlant, build_fleet
from gne_mj.plants.mjcf_fleet import MjcfPlant
from gne_mj.plants.mujoco import MujocoPlant
from gne_mj.system import Clock
from gne_mj.system.data import SystemData
from gne_mj.viewer.floors import of_the_lane
from gne_mj.viewer.mirror import Mirror
from gne_mj.viewer.surroundings import light_of, sky_of


class Fleet:
    """A system's robots in their MJCF, whichever engine moves them.

    Args:
        plant: the robots; only looked at.
        name: of their system.
        agents: N.

    Attributes:
        mirror: draws them below the name.
    """

    def __init__(self, plant: FleetPlant, name: str, agents: int) -> None:
        self.plant, self.agents = plant, agents
        own = isinstance(plant, MjcfPlant)
        self.mirror = Mirror(
            plant.model,
            prefix=tuple(part for part in name.split("/") if part),
            tinted=[geom for geoms in self._tinted for geom in geoms],
            coils=self._coils,
            hidden=of_the_lane(plant.model) if own else (),
            endless=own or self.lane is None,  # a lane is as wide as it is
        )

    def qpos(self, values: Mapping[str, NDArray[np.float64]]) -> NDArray[np.float64]:
        """(T, nq) joint positions in m or rad at the samples of a trajectory's variables.

        Raises:
            InvalidInput: they are not known, or are of other joints than the robots have.
        """
        if isinstance(self.plant, MjcfPlant):
            if "configuration" not in values:
                raise InvalidInput(
                    "trajectory", "without 'configuration'", "an older version has recorded it,"
                    " without all of its robots' joints; run it again",
                )  # fmt: skip
            recorded, now = values["configuration"], self.plant.model.nq
            if recorded.shape[1] != now:
                raise InvalidInput(
                    "trajectory",
                    f"{now} joint positions",
                    f"the run has recorded {recorded.shape[1]}: the robots' files have changed",
                )
            return recorded
        assert isinstance(self.plant, MujocoPlant)
        state, place = values["state"], values.get("place")
        found = np.zeros((len(state), self.plant.model.nq))
        _put_joints(state, state[:, :, 3] if place is None else place, self.plant.joints[0], found)
        return found

    @cached_property
    def lane(self) -> tuple[float, float] | None:
        """The least and greatest y in m of agents that move along x alone; None of others."""
        if self.plant.agents.dimension > 1:
            return None
        data = mujoco.MjData(self.plant.model)
        mujoco.mj_kinematics(self.plant.model, data)
        y = data.xpos[self._bodies, 1]
        return float(np.min(y)), float(np.max(y))

    def start(self, state: NDArray[np.float64]) -> NDArray[np.float64]:
        """(nq,) joint positions in m or rad at the start.

        Args:
            state: (m, states) of the agents there; MJCF robots start as their files say.
        """
        if isinstance(self.plant, MujocoPlant):
            return self.qpos({"state": state[None]})[0]
        return self.plant.model.qpos0

    @property
    def places(self) -> dict[str, Any]:
        """Where the page finds each agent's body, see ``ShownSystem.meta``."""
        mirror = self.mirror
        anchors = [mirror.item_of(body) for body in self._bodies]
        drawn = {path for path, _ in mirror.objects}
        tints = [f"{mirror.items[item]}/tint" for item in anchors]
        return {
            "anchors": anchors,
            "rooms": self._rooms,
            "floor": mirror.floor,
            "sky": sky_of(mirror.model),
            "light": light_of(mirror.model),
            "tints": [[path] if path in drawn else [] for path in tints],
        }

    @property
    def _rooms(self) -> list[list[float]]:
        """Of each agent the upright cylinder around its body's place that its robot is in, as its
        file says: radius, lower and upper end, in m relative to that place."""
        model = self.plant.model
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        turn = data.geom_xmat.reshape(-1, 3, 3)
        middle = data.geom_xpos + np.einsum("gij,gj->gi", turn, model.geom_aabb[:, :3])
        half = np.einsum("gij,gj->gi", np.abs(turn), model.geom_aabb[:, 3:])
        solid = ~np.isin(
            model.geom_type, [mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD]
        )
        found = []
        for agent, body in enumerate(self._bodies, 1):
            own = [
                geom
                for geom in np.flatnonzero(solid)
                if model.body(model.geom_bodyid[geom]).name.startswith(f"robot_{agent}/")
            ]
            away = middle[own] - data.xpos[body]
            reach = np.hypot(*(np.abs(away) + half[own])[:, :2].T)
            low, high = (away - half[own])[:, 2], (away + half[own])[:, 2]
            room = np.max(reach, initial=0.0), np.min(low, initial=0.0), np.max(high, initial=0.0)
            found.append([float(each) for each in room])
        return found

    @cached_property
    def _bodies(self) -> list[int]:
        """The body that stands for each agent: a main mass, or the one that an output moves."""
        plant, model, count = self.plant, self.plant.model, self.agents
        if isinstance(plant, MujocoPlant):
            return [int(model.body(f"robot_{i + 1}/main").id) for i in range(count)]
        joints = plant.output_joints[:: plant.agents.dimension]
        return [
            int(model.dof_bodyid[joint]) if joint >= 0 else _first_body(model, f"robot_{i + 1}/")
            for i, joint in enumerate(joints)
        ]

    @cached_property
    def _tinted(self) -> list[list[int]]:
        """The geoms of each agent that show by their colour how much of a bound is used."""
        plant, model = self.plant, self.plant.model
        if isinstance(plant, MujocoPlant):
            names = [f"robot_{i + 1}/chassis" for i in range(self.agents)]
            return [[int(model.geom(name).id)] for name in names]
        return [np.flatnonzero(model.geom_bodyid == body).tolist() for body in self._bodies]

    @property
    def _coils(self) -> list[str] | None:
        """Tendons drawn as springs: of flexible robots the ones for the eye."""
        if isinstance(self.plant, MujocoPlant):
            return [f"robot_{i + 1}/coil" for i in range(self.agents)]
        return None


@compiled
def _put_joints(state, place, joints, found):
    """Put main masses at their places (T, m), and appendages where extensions say, into found
    (T, nq)."""
    for sample in range(len(found)):
        for r in range(state.shape[1]):
            found[sample, joints[0, r]] = place[sample, r]
            found[sample, joints[1, r]] = place[sample, r] - state[sample, r, 0]


def fleet_of(system: SystemData, clock: Clock) -> Fleet | None:
    """The fleet of a system, or None if its agents have no bodies.

    Its model is its own: what a loop steps is not made for the eye.

    Args:
        system: whose robots.
        clock: how it steps.
    """
    plant = _plant(system, clock)
    if plant is None:
        return None
    try:
        return Fleet(plant, system.name, system.game.agents)
    except KeyError:  # of some agent nothing moves
        return None


def _plant(system: SystemData, clock: Clock) -> FleetPlant | None:
    if not in_mujoco(system.agents.kind):
        return None
    try:
        return build_fleet(system.agents, clock.timestep)
    except InvalidInput:
        if has_ode(system.agents.kind):  # a robot whose axes have different masses is no body
            return None
        raise


def _first_body(model: mujoco.MjModel, prefix: str) -> int:
    """The first of a robot's bodies that moves; KeyError if none does."""
    for body in np.flatnonzero(model.body_weldid).tolist():
        if model.body(body).name.startswith(prefix):
            return int(body)
    raise KeyError(prefix)
