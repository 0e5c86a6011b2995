"""The numbers of a running simulation that viewers change: where sliders stand, what may not be."""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

from gne_mj.errors import GneError, InfeasibleStart, InvalidInput, Refusal, part_of
from gne_mj.scenario import Scenario, load_scenario
from gne_mj.simulation import Simulation
from gne_mj.system import System
from gne_mj.system_run import SystemRun
from gne_mj.viewer.controls import Control, controls_of
from gne_mj.viewer.trial import Trials


class Sliders:
    """What viewers have made of a scenario's numbers.

    Args:
        scenario: as it was given.

    Attributes:
        controls: the numbers that can be changed, by their keys.
        values: where each of them stands.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.controls = {control.key: control for control in controls_of(scenario)}
        self._tables = scenario.model_dump(mode="json", exclude_none=True)
        self._changes: dict[str, Any] = {}  # by viewers, of whole keys
        self._trials = Trials()
        self.begin(scenario)

    def begin(self, scenario: Scenario) -> None:
        """A run of this scenario begins."""
        self._scenario = scenario
        self.values = {control.key: control.value for control in controls_of(scenario)}

    def follow(self, planned: Sequence[Mapping[str, Any]]) -> None:
        """Stand where the scenario's own interventions, as a simulation notes them, have led."""
        scenario = self._scenario
        for done in planned:
            scenario = load_scenario(scenario, done.get("keys"))
        self.begin(scenario)

    def next_scenario(self) -> Scenario:
        """For another run: as it was given, with what viewers changed."""
        return load_scenario(self._tables, self._changes)

    def set(self, simulation: Simulation, key: Any, value: Any) -> bool:
        """Change a number of a simulation; a value that cannot be leaves all as it is.

        Args:
            simulation: the present one.
            key, value: as a viewer asks for them.

        Returns:
            Whether it acts now, and not only from the next start on, as after its run's end.

        Raises:
            GneError: there is no such number, or it cannot have this value.
        """
        control = self.controls.get(str(key))
        if control is None:
            raise InvalidInput("key", key, "this scenario has no such slider")
        number = finite(key, value)
        run = simulation.runs[control.system]
        acts = run.inside and not simulation.ended
        if number == self.values[control.key]:
            return acts
        tables = self._scenario.model_dump(mode="json", exclude_none=True)
        changed, given = control.change(tables, number)
        scenario = load_scenario(tables, {changed: given})
        if acts:
            what, own = f"{control.key} = {number!r}", ("clock", "systems", "simulation")
            with scenario.naming(control.system), part_of("system", *own):
                system = _changed(run, scenario, control, number)
                self._try(simulation, system, control, number)
                simulation.change(
                    system, what, remade=scenario.remade, key=control.key, value=number,
                    keys={changed: given},
                )  # fmt: skip
        self._scenario = scenario
        self._changes[changed] = given
        self.values[control.key] = number
        return acts

    def _try(self, simulation: Simulation, system: System, control: Control, value: float) -> None:
        """Refuse a number with which the run, as far as a trial shows, would end early."""
        clock = simulation.clock
        left = clock.steps(clock.duration) - clock.steps(simulation.time)
        found = self._trials.exit(system, clock, left)
        if found is not None:
            time, status = found
            raise InvalidInput(
                control.key, value, f"with it the run would end in {time:.3g} s as '{status}'"
            )

    # ---- in words

    def refused(self, error: GneError, key: str) -> str:
        """Why a number cannot be so, in one sentence with the page's words."""
        control = self.controls.get(key)
        if control is None:
            return str(error)
        stays = f"it stays at {self.values[key]:.4g}"
        return f"{control.system}, {control.label}: {in_words(error)}; {stays}"

    def refused_start(self, error: GneError) -> str:
        """Why a run cannot begin where sliders stand, and which of them to set back."""
        moved = [
            f"{each.system}, {each.label} to {each.value:.4g} (now {self.values[key]:.4g})"
            for key, each in self.controls.items()
            if self.values[key] != each.value
        ]
        set_back = f"set back {', or '.join(moved)}"
        return f"It cannot begin so: {in_words(error, 'at the start')}; {set_back}"


def _changed(run: SystemRun, scenario: Scenario, control: Control, value: float) -> System:
    """A run's system from its present state on, with the number that a slider changes.

    What the number is not of stays the same object: a game or law of the user's own is not read
    again.
    """
    table, present = scenario.systems[control.system], run.loop.present()
    if control.table == "game":
        return table.build(control.system, scenario.simulation, present)
    memory = present.memory[: len(run.system.memory)].copy()
    here = replace(run.system, state=present.state, memory=memory)
    if control.table == "barrier":
        return replace(here, rho=value)
    return replace(here, law=table.controller.build(here.game))


def finite(key: Any, value: Any) -> float:
    """A number that a viewer asks for.

    Raises:
        InvalidInput: it is none, or is not finite.
    """
    number = math.nan
    if isinstance(value, int | float) and not isinstance(value, bool):
        with suppress(OverflowError):
            number = float(value)
    if not math.isfinite(number):
        raise InvalidInput(str(key), str(value)[:40], "it must be a finite number")
    return number


def in_words(error: GneError, where: str = "at the present outputs") -> str:
    """What an error says, without the key of the scenario's file; where a constraint is broken."""
    if isinstance(error, InfeasibleStart):
        return (
            f"{where} constraint '{error.constraint}' would have g = {error.value:.4g},"
            " which must be negative"
        )
    if isinstance(error, InvalidInput) and error.key.startswith("simulation."):
        return error.expected  # the value is the clock's, and no slider's
    return error.about if isinstance(error, Refusal) else str(error)
