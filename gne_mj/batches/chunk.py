"""Runs of a plan that are computed and stored together, by native loops on threads."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gne_mj.batches.plan import Combination, Plan
from gne_mj.batches.structure import Structure, key_of
from gne_mj.batches.summary import Variables, columns_of, join, refused_columns
from gne_mj.loops.base import ClosedLoop
from gne_mj.loops.batch import Case, Span
from gne_mj.loops.faults import SEED
from gne_mj.loops.layout import Setup
from gne_mj.plain import raise_pending
from gne_mj.scenario_tables.table import per_action
from gne_mj.system import System

_STRUCTURES, _COMBINATIONS = 16, 1024  # that are kept; a structure has a model, rows and threads

# MuJoCo's callbacks are global to the process, and workers of a cluster may have several threads
_ONE_AT_A_TIME = threading.Lock()


@dataclass(frozen=True)
class _Prepared:
    """A combination with what its runs share; nothing if its start is not inside."""

    combination: Combination
    key: Hashable = None
    setup: Setup | None = None


class Runner:
    """Runs chunks of a plan.

    Args:
        plan: what is run.
        threads: how many native threads.
    """

    def __init__(self, plan: Plan, threads: int) -> None:
        self.plan, self.threads = plan, threads
        self._prepared: OrderedDict[int, _Prepared] = OrderedDict()
        self._structures: OrderedDict[Hashable, Structure] = OrderedDict()

    def run(self, chunk: int, stopped: Callable[[], bool] = lambda: False) -> Variables | None:
        """The variables of a chunk's runs, or None if ``stopped`` said so meanwhile.

        Raises:
            UserCodeError: a function of the user's own failed.
        """
        entries = list(self._entries(chunk))
        parts: dict[int, Variables] = {}
        with _ONE_AT_A_TIME:
            for key in dict.fromkeys(prepared.key for prepared, _ in entries):
                mine = [entry for entry in entries if entry[0].key == key]
                if key is None:
                    for prepared, starts in mine:
                        number = prepared.combination.number
                        parts[number] = refused_columns(len(starts))
                    continue
                cases = [case for entry in mine for case in self._cases(*entry)]
                clock = mine[0][0].combination.clock
                span = Span(clock.steps(clock.duration), clock.steps(clock.sample_period))
                outcome = self._structure(mine[0][0]).loop.run(cases, span, stopped)
                raise_pending()
                if outcome is None:
                    return None
                done = 0
                for prepared, starts in mine:
                    own = outcome.part(slice(done, done + len(starts)))
                    done += len(starts)
                    parts[prepared.combination.number] = columns_of(
                        prepared.combination, span, own, self.plan.record
                    )
        return join([parts[number] for number in sorted(parts)])

    def _entries(self, chunk: int) -> Iterator[tuple[_Prepared, list[int]]]:
        """The combinations of a chunk, each with its starts in it."""
        first = chunk * self.plan.chunk
        end, each = min(first + self.plan.chunk, self.plan.runs), self.plan.each
        for number in range(first // each, (end - 1) // each + 1):
            runs = range(max(first, number * each), min(end, (number + 1) * each))
            yield self._prepare(number), [run - number * each for run in runs]

    def _prepare(self, number: int) -> _Prepared:
        if number not in self._prepared:
            combination = self.plan.combination(number)
            prepared = _Prepared(combination)
            system = combination.system
            if system is not None:
                setup = system.setup(combination.clock)
                prepared = _Prepared(combination, key_of(system, combination.clock, setup), setup)
            self._prepared[number] = prepared
            while len(self._prepared) > _COMBINATIONS:
                self._prepared.popitem(last=False)
        return self._prepared[number]

    def _structure(self, prepared: _Prepared) -> Structure:
        key, combination = prepared.key, prepared.combination
        if key not in self._structures:
            assert combination.system is not None
            self._structures[key] = Structure(
                combination.system, combination.clock, self.threads, self.plan.chunk
            )
            while len(self._structures) > _STRUCTURES:
                self._structures.popitem(last=False)
        self._structures.move_to_end(key)
        return self._structures[key]

    def _cases(self, prepared: _Prepared, starts: list[int]) -> Iterator[Case]:
        plan, combination, setup = self.plan, prepared.combination, prepared.setup
        system = combination.system
        assert system is not None
        assert setup is not None
        structure = self._structure(prepared)
        table = structure.table(system, setup)
        for start, y in zip(starts, plan.profiles(combination, starts), strict=True):
            seed = int(plan.seeds[start]) if plan.starts else system.seed
            if system.faults and seed != system.seed:  # what is random in them
                table = structure.table(system, _seeded(setup, seed))
            state, memory = _start(combination, y)
            yield Case(
                state=state,
                memory=system.with_links(memory),
                parameters=system.agents.parameters,
                table=table,
                loop=_Alone(replace(system, state=state, memory=memory, seed=seed), combination)
                if table is None
                else _unused,
            )


@dataclass(frozen=True)
class _Alone:
    """Makes the loop of one run."""

    system: System
    combination: Combination

    def __call__(self) -> ClosedLoop:
        return self.system.closed_loop(self.combination.clock)


def _unused() -> ClosedLoop:
    raise NotImplementedError("native batches make no loops")


def _seeded(setup: Setup, seed: int) -> Setup:
    """The same run with other random numbers in its faults."""
    faults = setup.problem.faults
    numbers = faults.numbers.copy()
    numbers[SEED] = seed
    return setup._replace(problem=setup.problem._replace(faults=faults._replace(numbers=numbers)))


def _start(
    combination: Combination, y: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """States (m, states) and the law's memory at y(0) = y, as the scenario's tables have them."""
    system = combination.system
    assert system is not None
    initial = combination.scenario.systems[system.name].initial
    if np.array_equal(y, system.start):
        return system.state, system.memory
    sizes = system.game.sizes
    state = initial.model_copy(update={"action": None}).build(system.agents, sizes, lambda: y)
    filtered = initial.filtered
    memory = system.law.initial_memory(
        y,
        initial.estimate,
        None if filtered is None else per_action("initial.filtered", filtered, sizes),
    )
    return state, memory
