"""What a batch consists of: a scenario, what is swept, random starts. Nothing here runs anything.

Runs are numbered combination by combination, and start by start within one. The k-th start has the
same seed in every combination: the same direction and share of the way to the boundary, and the
same noise, so that combinations are compared on equal terms.
"""

import hashlib
import json
import math
import operator
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.batches.sweep import Sweep
from gne_mj.bounds import MOST_RECORDED, MOST_RUNS, check_room
from gne_mj.equilibrium import middle
from gne_mj.errors import InfeasibleStart, InvalidInput, part_of
from gne_mj.plants.mjcf_source import FILES, located
from gne_mj.scenario import Scenario, full_key, load_scenario
from gne_mj.starts import random_starts, separated_starts
from gne_mj.system import Clock, System
from gne_mj.trajectory import versions

FORMAT = 1  # of the manifest and of the store
# Sweeping these would give runs that one dataset cannot hold, or has no meaning
_NOT_SWEPT = {
    "simulation.duration": "all runs of a batch last as long",
    "simulation.seed": "every start has a seed of its own",
    "recording.period": "all runs of a batch share their sample times",
    "description": "it changes nothing",
}
EQUILIBRIUM, MIDDLE = "equilibrium", "middle"  # what random starts lie around
_CHUNK_RUNS = 256
_CHUNK_BYTES = 2**27  # of rows in memory
_CHECK = 1  # which random numbers say what is checked
_LEAST_CHUNKS = 16  # of a small batch, so that its progress is seen and little is lost
_MOST_CHUNKS = 128  # of a large one, whose chunks take as long to store as to run


@dataclass(frozen=True)
class Combination:
    """One point of the sweep's grid.

    Attributes:
        number: which.
        changes: swept keys and their values.
        scenario: with them.
        system: at the scenario's own start or, with random starts, at any inside; None if that
            start is not inside.
        clock: of its runs.
    """

    number: int
    changes: Mapping[str, Any]
    scenario: Scenario
    system: System | None
    clock: Clock


@dataclass(frozen=True)
class Plan:
    """A batch, before it runs.

    Args:
        scenario: tables with one system, complete.
        sweeps: what varies; all combinations are run.
        starts: random interior starts of each combination; 0 for the scenario's own start.
        seed: from which the starts' seeds follow.
        spread: how far towards the boundary random starts lie, between 0 and 1.
        about: what they lie around: "equilibrium", the penalised one, or "middle", that of the set
            as found from the scenario's own start, which depends neither on law nor on penalty.
        record: every which sample is kept; 0 for summaries only.
        chunk: runs that are stored together; chosen if 0.
        check_in_mujoco: the share of runs, on engine "ode", that are made in MuJoCo too; from 0
            to 1.
    """

    scenario: Mapping[str, Any]
    sweeps: tuple[Sweep, ...] = ()
    starts: int = 0
    seed: int = 0
    spread: float = 0.9
    about: str = EQUILIBRIUM
    record: int = 0
    chunk: int = 0
    check_in_mujoco: float = 0.0

    def __post_init__(self) -> None:
        for key in ("starts", "seed", "record", "chunk"):
            object.__setattr__(self, key, _whole(key, getattr(self, key)))
        if self.seed > 2**53:
            raise InvalidInput("seed", self.seed, "it must not exceed 2^53")
        if not isinstance(self.spread, int | float) or not 0.0 < self.spread < 1.0:
            raise InvalidInput("spread", self.spread, "it must lie between 0 and 1, without them")
        if self.about not in (EQUILIBRIUM, MIDDLE):
            raise InvalidInput("about", self.about, f"it must be '{EQUILIBRIUM}' or '{MIDDLE}'")
        share = self.check_in_mujoco
        if isinstance(share, bool) or not isinstance(share, int | float) or not 0 <= share <= 1:
            raise InvalidInput("check_in_mujoco", share, "it must lie between 0 and 1")
        self._check_sweeps()
        if self.runs > MOST_RUNS:
            raise InvalidInput("starts", self.runs, f"a batch has {MOST_RUNS} runs at most")
        if not self.chunk:
            object.__setattr__(self, "chunk", self._fitting_chunk())

    def _check_sweeps(self) -> None:
        known: list[list[str]] = []
        for sweep in self.sweeps:
            parts = full_key(self.scenario, sweep.key, sweep.values[0])
            reason = _NOT_SWEPT.get(".".join(parts))
            if reason is not None:
                raise InvalidInput("sweeps", sweep.key, f"it cannot be swept: {reason}")
            for other in known:
                shorter = min(len(parts), len(other))
                if parts[:shorter] == other[:shorter]:
                    raise InvalidInput(
                        "sweeps", sweep.key, f"it is swept already, by {'.'.join(other)}"
                    )
            known.append(parts)

    def _fitting_chunk(self) -> int:
        """So many that their rows, which are in memory meanwhile, fit into the budget."""
        runs = min(_CHUNK_RUNS, max(1, -(-self.runs // _LEAST_CHUNKS)))
        runs = max(runs, -(-self.runs // _MOST_CHUNKS))
        return max(1, min(runs, _CHUNK_BYTES // (8 * self._numbers_of_run)))

    @cached_property
    def _numbers_of_run(self) -> int:
        """Numbers in memory while a run is computed and stored."""
        system, clock = self._first_system, self._clock
        width = system.recorded
        if self.record:  # variables made of them
            width = 4 * width + 2 * system.game.constraints_count
        rows = clock.steps(clock.duration) // clock.steps(clock.sample_period) + 2
        return width * rows

    def check_room(self) -> None:
        """Refuse a chunk whose runs fill the memory."""
        each = self._numbers_of_run
        key = self._loaded.key_of("clock.sample_period")
        check_room(key, self._clock.sample_period, each, "a run", MOST_RECORDED)
        check_room("chunk", self.chunk, self.chunk * each, "its runs", MOST_RECORDED)

    @cached_property
    def _loaded(self) -> Scenario:
        return load_scenario(self.scenario)

    @cached_property
    def _clock(self) -> Clock:
        return self._loaded.clock()

    @property
    def duration(self) -> float:
        """Of every run, in s."""
        return self._clock.duration

    @property
    def shape(self) -> tuple[int, ...]:
        """Values of each sweep."""
        return tuple(len(sweep.values) for sweep in self.sweeps)

    @property
    def combinations(self) -> int:
        """Points of the sweep's grid."""
        return int(np.prod(self.shape, dtype=np.int64))

    @property
    def each(self) -> int:
        """Runs of each combination."""
        return max(self.starts, 1)

    @property
    def runs(self) -> int:
        """Of the whole batch."""
        return self.combinations * self.each

    @property
    def chunks(self) -> int:
        """How many parts are stored one at a time."""
        return -(-self.runs // self.chunk)

    @property
    def name(self) -> str:
        """The system's."""
        return str(next(iter(self.scenario["systems"])))

    @cached_property
    def seeds(self) -> NDArray[np.int64]:
        """Of each start; of the scenario's own start the scenario's."""
        if not self.starts:
            return np.array([self.scenario["simulation"]["seed"]])
        words = np.random.SeedSequence(self.seed).generate_state(self.each, np.uint64)
        return (words >> np.uint64(11)).astype(np.int64)

    @cached_property
    def checked(self) -> NDArray[np.int64]:
        """The runs, by number, that are made in MuJoCo too: so many, drawn by the seed."""
        count = math.ceil(self.check_in_mujoco * self.runs)
        draw = np.random.default_rng([self.seed, _CHECK])
        return np.sort(draw.choice(self.runs, count, replace=False, shuffle=False))

    def of_run(self, run: int) -> tuple[int, int]:
        """A run's combination and start."""
        return run // self.each, run % self.each

    def changes(self, combination: int) -> dict[str, Any]:
        """Swept keys and their values in a combination."""
        at = np.unravel_index(combination, self.shape) if self.sweeps else ()
        return {sweep.key: sweep.values[int(k)] for sweep, k in zip(self.sweeps, at, strict=True)}

    def labels(self) -> dict[str, NDArray[Any]]:
        """The swept values of every run, by key."""
        grid = np.arange(self.runs) // self.each
        found = {}
        for axis, sweep in enumerate(self.sweeps):
            labels = np.array(sweep.labels)
            found[sweep.key] = labels[np.unravel_index(grid, self.shape)[axis]]
        return found

    def combination(self, number: int) -> Combination:
        """Build and check one combination.

        Raises:
            InvalidInput: a swept value does not fit; the combination is named.
        """
        changes = self.changes(number)
        try:
            scenario = load_scenario(self.scenario, changes)
            clock = scenario.clock()
            return Combination(number, changes, scenario, self._system(scenario), clock)
        except InvalidInput as error:
            if not changes:
                raise
            where = ", ".join(f"{key} = {value}" for key, value in changes.items())
            raise InvalidInput(error.key, error.value, f"{error.expected} (with {where})") from None

    def _system(self, scenario: Scenario) -> System | None:
        table, simulation = scenario.systems[self.name], scenario.simulation
        try:
            return table.build(self.name, simulation)
        except InfeasibleStart:
            if not self.starts:
                return None
        return table.build_inside(self.name, simulation)[0]

    @cached_property
    def _first_system(self) -> System:
        for number in range(self.combinations):
            system = self.combination(number).system
            if system is not None:
                return system
        raise self.nowhere_inside()

    def nowhere_inside(self) -> InvalidInput:
        """What to raise where no combination has a start that can be run."""
        key = self._loaded.key_of(f"systems.{self.name}.state")
        return InvalidInput(key, "given", "in no combination of the sweep is it strictly inside")

    def profiles(self, combination: Combination, starts: Sequence[int]) -> NDArray[np.float64]:
        """y(0) of these starts, (starts, m)."""
        system = combination.system
        assert system is not None
        if not self.starts:
            return np.tile(system.start, (len(starts), 1))
        around = self._middle(system)
        seeds = self.seeds[list(starts)].tolist()
        if system.separation is not None:
            with part_of(f"systems.{self.name}"):
                return separated_starts(system.game, around, seeds, self.spread, system.separation)
        return random_starts(system.game, around, seeds, self.spread)

    def positions(
        self, combination: Combination, starts: Sequence[int]
    ) -> list[NDArray[np.float64] | None]:
        """q(0) (m,) of these random starts, where positions follow outputs; else None.

        Drawn as outputs are, in directions and at shares of their own. Agents that keep apart are
        at rest.
        """
        system = combination.system
        assert system is not None
        resting = system.start_positions is None or system.separation is not None
        if not self.starts or resting:
            return [None] * len(starts)
        seeds = [(int(seed), 1) for seed in self.seeds[list(starts)]]
        return list(random_starts(system.game, self._middle(system), seeds, self.spread))

    def _middle(self, system: System) -> NDArray[np.float64]:
        """What random starts lie around, (m,)."""
        return system.centre if self.about == EQUILIBRIUM else middle(system.game, system.start)

    def alone(self, run: int) -> Scenario:
        """The scenario of one run, with its start and seed written out.

        Raises:
            InvalidInput: there is no such run.
        """
        if not 0 <= run < self.runs:
            raise InvalidInput("run", run, f"runs are numbered from 0 to {self.runs - 1}")
        number, start = self.of_run(run)
        combination = self.combination(number)
        scenario = combination.scenario
        if not self.starts:
            return scenario
        y = self.profiles(combination, [start])[0]
        assert combination.system is not None
        position = self.positions(combination, [start])[0]
        sizes = combination.system.game.sizes
        table = scenario.systems[self.name].starting_at(y, sizes, position)
        simulation = scenario.simulation.model_copy(update={"seed": int(self.seeds[start])})
        return scenario.model_copy(update={"systems": {self.name: table}, "simulation": simulation})

    def manifest(self) -> dict[str, Any]:
        """All that decides the results, as plain data."""
        return {
            "format": FORMAT,
            "scenario": self.scenario,
            "sweeps": [[sweep.key, list(sweep.values)] for sweep in self.sweeps],
            "runs": self.starts,
            "seed": self.seed,
            "spread": self.spread,
            **({"about": self.about} if self.about != EQUILIBRIUM else {}),
            "record": self.record,
            "chunk": self.chunk,
            **({"check_in_mujoco": self.check_in_mujoco} if self.check_in_mujoco else {}),
            "files": _digests(self.scenario),
            "versions": versions(),
        }

    @classmethod
    def from_manifest(cls, manifest: Mapping[str, Any]) -> "Plan":
        """The plan that a manifest was made from."""
        return cls(
            scenario=manifest["scenario"],
            sweeps=tuple(Sweep(key, tuple(values)) for key, values in manifest["sweeps"]),
            starts=manifest["runs"],
            seed=manifest["seed"],
            spread=manifest["spread"],
            about=manifest.get("about", EQUILIBRIUM),
            record=manifest["record"],
            chunk=manifest["chunk"],
            check_in_mujoco=manifest.get("check_in_mujoco", 0.0),
        )


def make_plan(
    source: str | Path | Mapping[str, Any],
    changes: Mapping[str, Any] | None = None,
    *,
    system: str | None = None,
    sweeps: Sequence[Sweep] = (),
    **options: Any,
) -> Plan:
    """A plan from a scenario; see :class:`Plan` for the options.

    Args:
        source: see :func:`gne_mj.load_scenario`.
        changes: likewise.
        system: which; may be left out if there is only one.
        sweeps: what varies.
        **options: as of :class:`Plan`.

    Raises:
        InvalidInput: names the key, the value and what would be right.
    """
    what = "runs of a batch"
    scenario = load_scenario(source, changes).without_interventions(what).without_membership(what)
    name = scenario.name_of(system)
    one = scenario.model_copy(update={"systems": {name: scenario.systems[name]}})
    tables = json.loads(one.model_dump_json(exclude_none=True))
    plan = Plan(scenario=tables, sweeps=tuple(sweeps), **options)
    plan.check_room()
    return plan


def _whole(key: str, given: Any) -> int:
    try:
        number = operator.index(given)
    except TypeError:
        number = -1
    if number < 0 or isinstance(given, bool):
        raise InvalidInput(key, given, "it must be a whole number, and not negative")
    return number


def _digests(scenario: Mapping[str, Any]) -> dict[str, str]:
    """Of the user's own files that a scenario names."""
    found = {}
    for system, tables in scenario["systems"].items():
        named = [
            (f"scenario.systems.{system}.{part}.{key}", table.get(key, []))
            for part, table in tables.items()
            for key in (FILES if isinstance(table, dict) else ())
        ]
        for where, given in named:
            for name in [given] if isinstance(given, str) else given:
                try:
                    found[name] = hashlib.sha256(located(name).read_bytes()).hexdigest()
                except OSError as error:
                    why = f"it cannot be read: {error.strerror}"
                    raise InvalidInput(where, name, why) from None
    return found
