"""The whole of a scenario file: the shared clock and the systems on it."""

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Annotated, Any

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from gne_mj.errors import InvalidInput, named, nearest, part_of, renaming
from gne_mj.loops.base import Present
from gne_mj.scenario_tables.clock import RecordingTable, SimulationTable
from gne_mj.scenario_tables.interventions import InterventionTable
from gne_mj.scenario_tables.system import SystemTable
from gne_mj.simulation import Planned, Remade, Simulation
from gne_mj.system import Clock, System
from gne_mj.toml_table import Fills, Table
from gne_mj.toml_text import toml_text


class Scenario(Table):
    """A whole run: systems on one clock."""

    description: str = Field("", description="in words, for lists of scenarios")
    simulation: Annotated[SimulationTable, Fills("clock")] = Field(
        SimulationTable(), description="the clock"
    )
    recording: Annotated[RecordingTable, Fills("clock")] = Field(
        RecordingTable(), description="what is kept"
    )
    systems: dict[str, SystemTable] = Field(
        min_length=1, description="by names of letters, digits, '-' and '_'"
    )
    interventions: list[InterventionTable] = Field([], description="what is done while it runs")

    @model_validator(mode="after")
    def _names(self) -> "Scenario":
        for name in self.systems:
            if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]*", name):
                raise PydanticCustomError(
                    "name",
                    "a system's name has letters, digits, '-' and '_' only, and begins with one of"
                    " the first two",
                )
        return self

    def __repr__(self) -> str:
        """One line: each system's game, agents and law; the duration."""
        systems = [
            f"{name}: {_kind(table.game)} with {table.agents.count} {_kind(table.agents)},"
            f" {_kind(table.controller)} law"
            for name, table in self.systems.items()
        ]
        return f"<Scenario of {'; '.join(systems)}; {self.simulation.duration:g} s>"

    def name_of(self, system: str | None) -> str:
        """The system of this name, or the only one if none is given.

        Raises:
            InvalidInput: there is no such system, or several and none is named.
        """
        if system is None and len(self.systems) > 1:
            raise InvalidInput("system", None, f"name one of {', '.join(self.systems)}")
        name = next(iter(self.systems)) if system is None else system
        if name not in self.systems:
            raise InvalidInput("system", name, nearest(name, self.systems))
        return name

    @contextmanager
    def naming(self, system: str | None = None) -> Iterator[None]:
        """Let what is refused within be named by the keys of this scenario.

        Args:
            system: the name of the one that what is called within has as its parameter ``system``.
        """
        with renaming(self.key_of), named(system=f"systems.{system}" if system else "system"):
            yield

    def toml(self) -> str:
        """The text of a file that has this scenario; what is as if left out is left out."""
        tables = self.model_dump(mode="json", exclude_none=True, exclude_defaults=True)
        for name, system in self.systems.items():
            # whole: a number that moves is not as if left out, whatever it is at time 0
            tables["systems"][name]["game"] = system.game.model_dump(mode="json", exclude_none=True)
        return toml_text(tables)

    def clock(self) -> Clock:
        """The shared clock."""
        simulation = self.simulation
        with self.naming(), part_of("clock"):
            return Clock(
                duration=simulation.duration,
                timestep=simulation.timestep,
                control_period=simulation.control_period or simulation.timestep,
                sample_period=self.recording.period,
            )

    def system_objects(self) -> list[System]:
        """The systems, checked.

        Raises:
            InvalidInput, InfeasibleStart: see :class:`gne_mj.system.System`.
        """
        return [table.build(name, self.simulation) for name, table in self.systems.items()]

    def inside_systems(self) -> tuple[list[System], dict[str, dict[str, Any]]]:
        """The systems, started inside where their own start is not; what was done, by name.

        See :meth:`SystemTable.build_inside`.
        """
        built = {n: t.build_inside(n, self.simulation) for n, t in self.systems.items()}
        moved = {name: done for name, (_, done) in built.items() if done is not None}
        return [system for system, _ in built.values()], moved

    def simulation_object(self) -> Simulation:
        """The scenario, ready to run.

        Raises:
            InvalidInput, InfeasibleStart: see :class:`gne_mj.system.System`.
        """
        clock, systems = self.clock(), self.system_objects()
        with self.naming():
            return Simulation(
                systems,
                clock,
                tolerance=self.simulation.tolerance,
                seed=self.simulation.seed,
                source=self.model_dump_json(exclude_none=True),
                remade=self.remade,
                planned=self._planned(systems),
            )

    def remade(
        self, changes: Mapping[str, Any], present: Mapping[str, Present]
    ) -> tuple[list[System], dict[str, Any], Remade]:
        """Systems as they go on with changed keys, see :class:`gne_mj.simulation.Remade`."""
        from gne_mj.scenario_tables.changes import changed, changed_systems, whole

        scenario = changed(self, changes)
        systems = changed_systems(self, scenario, present)
        return systems, whole(self, changes), scenario.remade

    def _planned(self, systems: list[System]) -> list[Planned]:
        """What is done while it runs, of which all is refused now that can be."""
        from gne_mj.scenario_tables.changes import changed, check_stays

        scenario, found = self, []
        for number, table in enumerate(self.interventions):
            key = f"interventions.{number}"
            done = {"push": table.push, "link": table.link}
            what, given = next(((k, v) for k, v in done.items() if v is not None), ("", None))
            if given is not None:
                with part_of(f"{key}.{what}"):
                    name = self.name_of(given.system)
                    act = given.build(next(each for each in systems if each.name == name))
            else:
                with part_of(f"{key}.changes"):
                    after = changed(scenario, table.changes)
                    check_stays(scenario, after)
                scenario, act = after, table.change(key)
            found.append(Planned(table.time, act))
        return found

    def without_interventions(self, what: str) -> "Scenario":
        """This one, where interventions would be left out and are refused.

        Raises:
            InvalidInput: there are some, and ``what`` (in words, in plural) know none.
        """
        if self.interventions:
            raise InvalidInput(
                "interventions",
                f"{len(self.interventions)} of them",
                f"{what} know none: leave them out (--set interventions=[])",
            )
        return self

    def without_membership(self, what: str) -> "Scenario":
        """This one, where agents that leave and join are refused.

        Raises:
            InvalidInput: some do, and ``what`` (in words, in plural) know none.
        """
        for name, table in self.systems.items():
            if table.membership is not None:
                raise InvalidInput(
                    f"systems.{name}.membership",
                    "given",
                    f"{what} know no agents that leave or join: leave it out",
                )
        return self


def _kind(table: Table) -> str:
    """Which of the tables that may stand there it is."""
    return str(getattr(table, "type", None) or getattr(table, "information", ""))
