"""Laws as C functions, compiled by themselves; :mod:`gne_mj.loops.functions` calls them."""

import sys
from collections.abc import Callable, Mapping
from functools import cache
from types import MappingProxyType, ModuleType
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from gne_mj.barrier import scheduled
from gne_mj.controllers.settings import LENGTH_OF_NOW, Now
from gne_mj.loops import functions, implicit
from gne_mj.loops.layout import (
    Instant,
    loop_room_in,
    loop_room_length,
    parts_in,
    problem_in,
    steps_in,
)
from gne_mj.loops.newton import solver_in
from gne_mj.native import callback, kernel, source_key
from gne_mj.numbers import numbers_in
from gne_mj.table import floats_at

_whole, _real = types.int64, types.float64
NO_OTHERS: Mapping[int, Any] = MappingProxyType({})


class LawWork(NamedTuple):
    """What a law works on."""

    profile: np.ndarray  # (m,) overwritten
    now: Now


_now_in = numbers_in(Now)


@kernel
def law_work_at(profile, now, m):
    """From the addresses of both."""
    return LawWork(floats_at(profile, m), _now_in(floats_at(now, LENGTH_OF_NOW), 0))


def link(
    law: ModuleType,
    game: ModuleType,
    *,
    memory: bool,
    others: Mapping[int, Any] = NO_OTHERS,
) -> NDArray[np.int64]:
    """The addresses for ``problem.functions``: those that a run calls, the others 0.

    Args:
        law, game: modules of kernels.
        memory: whether the law has one.
        others: C functions besides the law's own, by their entry: of the mode, of the schedule.
    """
    addresses = np.zeros(functions.COUNT, dtype=np.int64)
    addresses[functions.ACTION] = action(law, game).address
    owners: dict[int, Any] = {}
    if memory:
        owners |= of_memory(law)
    for entry, owner in {**owners, **others}.items():
        addresses[entry] = owner.address
    return addresses


@cache
def action(law: ModuleType, game: ModuleType) -> Any:
    """The law's action in a game."""
    source = source_key(law, game)

    def action(table, y, weights, memory, profile, now, u):
        _ = source
        steps = steps_in(table)
        m = steps.actions
        return law.action(
            game, problem_in(table), floats_at(y, m), floats_at(weights, steps.constraints),
            floats_at(memory, steps.memory), law_work_at(profile, now, m), floats_at(u, m),
        )  # fmt: skip

    return callback(_whole(*[_whole] * 7), action)


@cache
def of_memory(law: ModuleType) -> dict[int, Any]:
    """What moves a law's memory, and its storage."""
    source = source_key(law)

    def rate(table, y, memory, out):
        _ = source
        steps = steps_in(table)
        size = steps.memory
        law.rate(
            problem_in(table), floats_at(y, steps.actions), floats_at(memory, size),
            floats_at(out, size),
        )  # fmt: skip
        return 0

    def propagate(table, y, memory, scratch, length):
        _ = source
        steps = steps_in(table)
        law.propagate(
            problem_in(table), floats_at(y, steps.actions), floats_at(memory, steps.memory),
            floats_at(scratch, length),
        )  # fmt: skip
        return 0

    def storage(table, memory):
        _ = source
        return law.storage(problem_in(table), floats_at(memory, steps_in(table).memory))

    return {
        functions.RATE: callback(_whole(*[_whole] * 4), rate),
        functions.PROPAGATE: callback(_whole(*[_whole] * 5), propagate),
        functions.STORAGE: callback(_real(_whole, _whole), storage),
    }


@cache
@cache
def penalty(fall: Callable[[float, float], float]) -> Any:
    """The penalty at a time, by a schedule's kernel (:class:`gne_mj.barrier.Fall`)."""
    source = source_key(sys.modules[fall.__module__])

    def penalty(table, time):
        _ = source
        return scheduled(fall, problem_in(table).schedule, time)

    return callback(_real(_whole, _real), penalty)


@cache
def of_implicit(law: ModuleType, game: ModuleType, alone: bool) -> dict[int, Any]:
    """What mode implicit solves a law for, each agent by itself if ``alone``."""
    source = source_key(law, game)

    def prepare(table, first, last, y, memory):
        _ = source
        steps = steps_in(table)
        law.prepare(
            problem_in(table), first, last, floats_at(y, steps.actions),
            floats_at(memory, steps.memory),
        )  # fmt: skip
        return 0

    def pulls(table, first, last, at_y, at_memory, at_out):
        _ = source
        problem, steps = problem_in(table), steps_in(table)
        y, memory = floats_at(at_y, steps.actions), floats_at(at_memory, steps.memory)
        out, data = floats_at(at_out, steps.actions), problem.data
        law.prepare(problem, first, last, y, memory)
        for i in range(first, last):
            for a in range(data.offsets[i], data.offsets[i + 1]):
                out[a] = law.pull(game, problem, i, a, y, memory)
        return 0

    def add_pull_slope(table, i, a, y, memory, out):
        _ = source
        steps = steps_in(table)
        m = steps.actions
        law.add_pull_slope(
            game, problem_in(table), i, a, floats_at(y, m), floats_at(memory, steps.memory),
            floats_at(out, m),
        )  # fmt: skip
        return 0

    def own_profile(table, i, y, memory, profile):
        _ = source
        steps = steps_in(table)
        m = steps.actions
        return law.own_profile(
            problem_in(table), i, floats_at(y, m), floats_at(memory, steps.memory),
            floats_at(profile, m),
        )  # fmt: skip

    def settle(table, ahead, held):
        _ = source
        m = steps_in(table).actions
        law.settle(floats_at(ahead, m), floats_at(held, m))
        return 0

    found = {
        functions.PREPARE: callback(_whole(*[_whole] * 5), prepare),
        functions.PULLS: callback(_whole(*[_whole] * 6), pulls),
        functions.ADD_PULL_SLOPE: callback(_whole(*[_whole] * 6), add_pull_slope),
        functions.SETTLE: callback(_whole(*[_whole] * 3), settle),
    }
    if alone:
        found[functions.OWN_PROFILE] = callback(_real(*[_whole] * 5), own_profile)
    return found


@cache
def solve(equation: ModuleType) -> Any:
    """The solver of mode implicit, for all laws and games.

    Args:
        equation: :mod:`gne_mj.loops.joint` or :mod:`gne_mj.loops.local`.
    """
    source = source_key()

    def solve(table, memory, profile, now, solver, length):
        _ = source
        steps, problem = steps_in(table), problem_in(table)
        views = solver_in(floats_at(solver, length), problem.order, steps.constraints, steps.states)
        return equation.solve(
            problem, floats_at(memory, steps.memory), law_work_at(profile, now, steps.actions),
            views,
        )  # fmt: skip

    return callback(_whole(*[_whole] * 6), solve)


@cache
def act(plant: ModuleType, faults: ModuleType, at: Any) -> Any:
    """What mode implicit does at a control instant, for all laws and games.

    Args:
        plant: module that predicts, :mod:`gne_mj.plants.held_map` and its like.
        faults: :mod:`gne_mj.loops.faultless` or :mod:`gne_mj.loops.faults`.
        at: where MuJoCo keeps what, for a plant that asks it.
    """
    source = source_key(plant, faults)

    def act(table, room, time, step, state, memory, model, data):
        _ = source
        steps = steps_in(table)
        parts = parts_in(table, loop_room_in(floats_at(room, loop_room_length(steps)), steps))
        good = implicit.act(
            faults, plant, (at, model, data, table), parts, Instant(time, step, 0),
            floats_at(state, steps.actions * steps.states), floats_at(memory, steps.memory),
        )  # fmt: skip
        return 1 if good else 0

    return callback(_whole(_whole, _whole, _real, *[_whole] * 5), act)
