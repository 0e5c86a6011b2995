"""Runs of a plan that are computed and stored together, by native loops on threads."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.batches.engine_check import differences, the_same_in_mujoco, unchecked
from gne_mj.batches.plan import Combination, Plan
from gne_mj.batches.structure import Structure, key_of
from gne_mj.batches.summary import (
    columns_of,
    join,
    rearranged,
    refused_columns,
    span_of,
)
from gne_mj.errors import InfeasibleStart, part_of
from gne_mj.loops.base import ClosedLoop
from gne_mj.loops.batch import Case, Outcome
from gne_mj.loops.layout import Setup
from gne_mj.motion import motion_of
from gne_mj.plain import raise_pending
from gne_mj.system import Clock, System
from gne_mj.toml_table import per_action
from gne_mj.variables import Labelled

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
        self._prepared: OrderedDict[tuple[int, bool], _Prepared] = OrderedDict()
        self._structures: OrderedDict[Hashable, Structure] = OrderedDict()

    def run(self, chunk: int, stopped: Callable[[], bool] = lambda: False) -> Labelled | None:
        """The variables of a chunk's runs, or None if ``stopped`` said so meanwhile.

        Raises:
            UserCodeError: a function of the user's own failed.
        """
        with _ONE_AT_A_TIME:
            entries = list(self._entries(chunk))
            parts: dict[int, Labelled] = {}
            for key in dict.fromkeys(prepared.key for prepared, _ in entries):
                mine = [entry for entry in entries if entry[0].key == key]
                found = self._run_group(mine, stopped)
                if found is None:
                    return None
                parts.update(found)
        return join([parts[number] for number in sorted(parts)])

    def _run_group(
        self, entries: list[tuple[_Prepared, list[int]]], stopped: Callable[[], bool]
    ) -> dict[int, Labelled] | None:
        """The variables of combinations of one structure (or of none), by their numbers."""
        first = entries[0][0]
        cases = [list(self._cases(*entry)) for entry in entries]
        able = [case for each in cases for case in each if case is not None]
        outcome = None
        span = span_of(first.combination)
        if able:
            outcome = self._structure(first).loop.run(able, span, stopped)
            raise_pending()
            if outcome is None:
                return None
        done, parts = 0, {}
        for (prepared, starts), own in zip(entries, cases, strict=True):
            inside, part = np.array([case is not None for case in own]), None
            columns = [refused_columns(int(np.sum(~inside)))]
            if outcome is not None and np.any(inside):
                runs = slice(done, done + int(np.sum(inside)))
                done = runs.stop
                part = outcome.part(runs)
                combination = prepared.combination
                with combination.scenario.naming(self.plan.name), part_of("system"):
                    columns.insert(0, columns_of(combination, span, part, self.plan.record))
            order = np.argsort(np.argsort(~inside, kind="stable"), kind="stable")
            kept = rearranged(join(columns), order)
            if self.plan.check_in_mujoco:
                found = self._checked(prepared, starts, (inside, part), stopped)
                if found is None:
                    return None
                kept |= found
            parts[prepared.combination.number] = kept
        return parts

    def _checked(
        self,
        prepared: _Prepared,
        starts: list[int],
        twins: tuple[NDArray[np.bool_], Outcome | None],
        stopped: Callable[[], bool],
    ) -> Labelled | None:
        """How far runs are from the same in MuJoCo; not a number of those that are not made there.

        Args:
            prepared: their combination.
            starts: theirs.
            twins: (starts,) which began, and what these showed.
            stopped: as of :meth:`run`; then the result is None.
        """
        kept, (began, outcome) = unchecked(len(starts)), twins
        combination = prepared.combination
        runs = combination.number * self.plan.each + np.array(starts)
        chosen = np.flatnonzero(np.isin(runs, self.plan.checked) & began)
        if not len(chosen) or outcome is None:
            return kept
        other = self._prepare(combination.number, in_mujoco=True)
        cases = [case for case in self._cases(other, [starts[k] for k in chosen]) if case]
        shown = self._structure(other).loop.run(cases, span_of(combination), stopped)
        raise_pending()
        if shown is None:
            return None
        same = outcome.part(np.cumsum(began)[chosen] - 1)
        for name, values in zip(kept, differences(combination, same, shown), strict=True):
            kept[name][1][chosen] = values
        return kept

    def _entries(self, chunk: int) -> Iterator[tuple[_Prepared, list[int]]]:
        """The combinations of a chunk, each with its starts in it."""
        first = chunk * self.plan.chunk
        end, each = min(first + self.plan.chunk, self.plan.runs), self.plan.each
        for number in range(first // each, (end - 1) // each + 1):
            runs = range(max(first, number * each), min(end, (number + 1) * each))
            yield self._prepare(number), [run - number * each for run in runs]

    def _prepare(self, number: int, *, in_mujoco: bool = False) -> _Prepared:
        """A combination, or the same in MuJoCo."""
        name = number, in_mujoco
        if name not in self._prepared:
            combination = self.plan.combination(number)
            if in_mujoco:
                combination = the_same_in_mujoco(combination)
            prepared = _Prepared(combination)
            system = combination.system
            if system is not None:
                with combination.scenario.naming(system.name), part_of("system", "clock"):
                    setup = system.setup(combination.clock)
                prepared = _Prepared(combination, key_of(system, combination.clock, setup), setup)
            self._prepared[name] = prepared
            while len(self._prepared) > _COMBINATIONS:
                self._prepared.popitem(last=False)
        return self._prepared[name]

    def _structure(self, prepared: _Prepared) -> Structure:
        key, combination = prepared.key, prepared.combination
        if key not in self._structures:
            assert combination.system is not None
            self._structures[key] = Structure(combination.system, combination.clock, self.threads)
            while len(self._structures) > _STRUCTURES:
                self._structures.popitem(last=False)
        self._structures.move_to_end(key)
        return self._structures[key]

    def _cases(self, prepared: _Prepared, starts: list[int]) -> Iterator[Case | None]:
        """A case for each start; None where it, or the estimates given for it, are not inside."""
        plan, combination, setup = self.plan, prepared.combination, prepared.setup
        system = combination.system
        if system is None or setup is None:
            yield from [None] * len(starts)
            return
        structure = self._structure(prepared)
        shared = structure.parameter_block(system, setup)
        initial = combination.scenario.systems[system.name].initial
        profiles, positions = (
            plan.profiles(combination, starts),
            plan.positions(combination, starts),
        )
        for start, y, position in zip(starts, profiles, positions, strict=True):
            seed = int(plan.seeds[start])
            state, memory = system.state, system.memory
            if plan.starts:
                state, memory = _start(combination, y, position)
            if initial.estimate is not None or initial.filtered is not None:
                try:
                    replace(system, state=state, memory=memory)
                except InfeasibleStart:
                    yield None
                    continue
            parameter_block = shared
            if motion_of(system.game) is not None:  # numbers that each run moves for itself
                own = system.setup(combination.clock)
                parameter_block = structure.parameter_block(system, _seeded(own, seed))
            elif system.faults and seed != system.seed:  # what is random in them
                parameter_block = structure.parameter_block(system, _seeded(setup, seed))
            yield Case(
                state=state,
                memory=system.with_links(memory),
                parameters=system.agents.parameters,
                parameter_block=parameter_block,
                loop=_Alone(system, state, memory, seed, combination.clock),
            )


@dataclass(frozen=True)
class _Alone:
    """Makes the loop of one run."""

    system: System
    state: NDArray[np.float64]
    memory: NDArray[np.float64]
    seed: int
    clock: Clock

    def __call__(self) -> ClosedLoop:
        one = replace(self.system, state=self.state, memory=self.memory, seed=self.seed)
        return one.closed_loop(self.clock)


def _seeded(setup: Setup, seed: int) -> Setup:
    """The same run with other random numbers in its faults."""
    faults = setup.problem.faults
    kept: Any = faults.numbers
    numbers = kept.copy()
    numbers.seed = seed
    return setup._replace(problem=setup.problem._replace(faults=faults._replace(numbers=numbers)))


def _start(
    combination: Combination, y: NDArray[np.float64], position: NDArray[np.float64] | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """States (m, states) and the law's memory at y(0) = y, as the scenario's tables have them.

    Args:
        combination: with a system.
        y: (m,) outputs.
        position: (m,) positions that follow them; None where there are none.
    """
    system = combination.system
    assert system is not None
    sizes = system.game.sizes
    table = combination.scenario.systems[system.name].starting_at(y, sizes, position)
    initial = table.initial
    state = initial.build(system.agents, sizes, lambda: y)
    filtered = initial.filtered
    memory = system.law.initial_memory(
        y,
        initial.estimate,
        None if filtered is None else per_action("filtered", filtered, sizes),
    )
    return state, memory
