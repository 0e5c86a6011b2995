"""Which numbers of a scenario a live page can change, and which agents it can push."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import mujoco

from gne_mj.game_model import Game
from gne_mj.scenario import Scenario
from gne_mj.viewer.fleet import Fleet
from gne_mj.viewer.shown_system import ShownSystem

DECADES = 100.0  # a positive number's slider goes so many times up and down
REACH = 5.0  # m/s, how far a velocity's slider goes up and down
# N, of robots lighter than 1 kg for each kg; s
PUSH_FORCE, PUSH_DURATION = 5.0, 0.2


@dataclass(frozen=True)
class Control:
    """A number that a slider changes.

    Attributes:
        key: in the scenario, dotted; with an index in brackets for an entry of a list.
        label: what a person reads.
        system: that it is of.
        unit: of the value.
        value: at the start.
        low, high: ends of the slider; any value that the scenario allows can be typed in.
        logarithmic: whether the slider goes by ratios.
    """

    key: str
    label: str
    system: str
    unit: str
    value: float
    low: float
    high: float
    logarithmic: bool

    @property
    def table(self) -> str:
        """Which of the system's tables the number is in."""
        return self.key.split(".")[2]

    def meta(self) -> dict[str, Any]:
        """What JSON tells the page."""
        return {
            "key": self.key, "label": self.label, "system": self.system, "unit": self.unit,
            "value": self.value, "min": self.low, "max": self.high,
            "scale": "log" if self.logarithmic else "linear",
        }  # fmt: skip

    def change(self, tables: Mapping[str, Any], value: float) -> tuple[str, Any]:
        """The scenario's key and its new value, a whole list where this is an entry of one."""
        if not self.key.endswith("]"):
            return self.key, value
        key, _, index = self.key[:-1].rpartition("[")
        found: Any = tables
        for part in key.split("."):
            found = found[part]
        values = list(found)
        values[int(index)] = value
        return key, values


def controls_of(scenario: Scenario) -> list[Control]:
    """What can be changed while a scenario runs: penalties, reference velocities, gains."""
    found = []
    for name, table in scenario.systems.items():
        if table.game.moving:  # which stays as it is while it runs
            continue
        start = f"systems.{name}"
        if table.barrier.schedule is None:
            found.append(
                _positive(f"{start}.barrier.rho", "penalty ρ", name, "", table.barrier.rho)
            )
        reference = getattr(table.game, "reference_velocity", None)
        if isinstance(reference, float):
            key = f"{start}.game.reference_velocity"
            found.append(_velocity(key, "reference v₀", name, reference))
        elif isinstance(reference, list):
            for index, (axis, value) in enumerate(zip("xyz", reference, strict=False)):
                key = f"{start}.game.reference_velocity[{index}]"
                found.append(_velocity(key, f"reference v₀, {axis}", name, value))
        for key, label in (("coupling", "coupling c"), ("gain", "gain k")):
            value = getattr(table.controller, key, None)
            if value is not None:
                found.append(_positive(f"{start}.controller.{key}", label, name, "", value))
    return found


def pushes_of(shown_systems: list[ShownSystem]) -> list[dict[str, Any]]:
    """Whose agents can be pushed, robots that MuJoCo moves; and how, see the page's ``Push``."""
    found, items = [], 0
    for shown_system in shown_systems:
        system, fleet = shown_system.system, shown_system.fleet
        if fleet is None:
            continue
        axes = max(system.game.sizes)
        if system.engine == "mujoco":
            found.append(
                {
                    "system": system.name,
                    "axes": list(dict.fromkeys(system.game.axis_of_action)) if axes > 1 else [""],
                    "force": float(f"{PUSH_FORCE * min(_lightest(fleet), 1.0):.1g}"),
                    "duration": PUSH_DURATION,
                    "ways": _ways(fleet, system.game, items),
                }
            )
        items += len(fleet.mirror.items)
    return found


def _lightest(fleet: Fleet) -> float:
    """The mass in kg of the lightest robot."""
    model = fleet.plant.model
    found = dict.fromkeys((f"robot_{i + 1}" for i in range(fleet.agents)), 0.0)
    for body in range(model.nbody):
        robot = model.body(body).name.partition("/")[0]
        if robot in found:
            found[robot] += float(model.body_mass[body])
    return min(found.values())


def _ways(fleet: Fleet, game: Game, first: int) -> list[list[dict[str, Any] | None]]:
    """Of each agent and axis the unit, the force's direction (None where it has none), and the
    item in whose frame that is (None: the world's); None of what cannot be pushed.

    Args:
        fleet, game: of the system.
        first: the number of the fleet's first item.
    """
    data = mujoco.MjData(fleet.plant.model)
    mujoco.mj_kinematics(fleet.plant.model, data)
    found: list[list[dict[str, Any] | None]] = [[] for _ in range(game.agents)]
    for channel, agent in enumerate(game.agent_of_action):
        way = fleet.plant.way(channel)
        if way is None:
            found[agent].append(None)
            continue
        along, item = way.along, None
        if along is not None:
            try:
                item = first + fleet.mirror.item_of(way.body)
            except KeyError:  # it never moves
                along = data.xmat[way.body].reshape(3, 3) @ along
        told = None if along is None else along.tolist()
        found[agent].append({"unit": way.unit, "along": told, "item": item})
    return found


def _positive(key: str, label: str, system: str, unit: str, value: float) -> Control:
    return Control(
        key, label, system, unit, value, value / DECADES, value * DECADES, logarithmic=True
    )


def _velocity(key: str, label: str, system: str, value: float) -> Control:
    return Control(
        key, label, system, "m/s", value, value - REACH, value + REACH, logarithmic=False
    )
