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
from gne_mj.linked_game import compiled_for
from gne_mj.loops import cells, functions, implicit
from gne_mj.loops import positions as followed
from gne_mj.loops import separation as apart
from gne_mj.loops.layout import (
    Instant,
    channels_in,
    loop_workspace_in,
    loop_workspace_length,
    parts_in,
    problem_in,
    steps_in,
)
from gne_mj.loops.monitor import MonitorNumbers
from gne_mj.loops.newton import solver_in
from gne_mj.motion import move
from gne_mj.native import callback, kernel, source_key
from gne_mj.numbers import names_of, numbers_in
from gne_mj.parameter_block import floats_at

_whole, _real = types.int64, types.float64
NO_OTHERS: Mapping[int, Any] = MappingProxyType({})


class LawWork(NamedTuple):
    """What a law works on."""

    profile: np.ndarray  # (m,) overwritten
    now: Now


class SolverWork(NamedTuple):
    """What an equation of mode implicit works on."""

    profile: np.ndarray  # (m,) overwritten
    now: Now
    separation: np.ndarray  # of agents that keep apart
    origin: tuple[float, ...]  # cells.PLANE or cells.SPACE, of these


_now_in = numbers_in(Now)
_monitor_in = numbers_in(MonitorNumbers)
_LENGTH_OF_MONITOR = len(names_of(MonitorNumbers))


@kernel
def law_work_at(profile, now, m):
    """From the addresses of both."""
    return LawWork(floats_at(profile, m), _now_in(floats_at(now, LENGTH_OF_NOW), 0))


@kernel
def parts_at(block, workspace, steps):
    """The parts of a run, from the addresses of its parameter block and workspace."""
    length = loop_workspace_length(steps)
    return parts_in(block, loop_workspace_in(floats_at(workspace, length), steps))


def link(
    law: ModuleType,
    game: ModuleType,
    *,
    memory: bool,
    held: bool,
    driven: bool = False,
    others: Mapping[int, Any] = NO_OTHERS,
) -> NDArray[np.int64]:
    """The addresses for ``problem.functions``: those that a run calls, the others 0.

    Args:
        law, game: modules of kernels.
        memory: whether the law has one.
        held: whether its inputs are, so that the memory moves once a control period.
        driven: whether an input is fed forward besides.
        others: C functions besides the law's own, by their entry: of the mode, the schedule, the
            positions.
    """
    addresses = np.zeros(functions.COUNT, dtype=np.int64)
    addresses[functions.ACTION] = action(law, game, driven).address
    owners: dict[int, Any] = {}
    if memory:
        owners |= of_memory(law, held)
    for entry, owner in {**owners, **others}.items():
        addresses[entry] = owner.address
    return addresses


@cache
def action(law: ModuleType, game: ModuleType, driven: bool = False) -> Any:
    """The law's action in a game, with what is fed forward if it is ``driven``."""
    (found,) = compiled_for(game, _action, law, driven)
    return found


def _action(game: ModuleType, law: ModuleType, driven: bool) -> list[Any]:
    source = source_key(law, game)
    of_all = hasattr(game, "pseudo_gradient") and hasattr(law, "action_of_all")
    act = law.action_of_all if of_all else law.action

    def action(block, y, weights, memory, profile, now, u):
        _ = source
        steps = steps_in(block)
        m, problem = steps.actions, problem_in(block)
        left = act(
            game, problem, floats_at(y, m), floats_at(weights, steps.constraints),
            floats_at(memory, steps.memory), law_work_at(profile, now, m), floats_at(u, m),
        )  # fmt: skip
        if driven:
            asked = floats_at(u, m)
            for r in range(len(problem.motion.now)):
                asked[r] += problem.motion.now[r]
        return left

    return [callback(_whole(*[_whole] * 7), action)]


@cache
def of_memory(law: ModuleType, held: bool) -> dict[int, Any]:
    """What moves a law's memory, and its storage."""
    source = source_key(law)

    def rate(block, y, memory, out):
        _ = source
        steps = steps_in(block)
        size = steps.memory
        law.rate(
            problem_in(block), floats_at(y, steps.actions), floats_at(memory, size),
            floats_at(out, size),
        )  # fmt: skip
        return 0

    def propagate(block, y, memory, scratch, length):
        _ = source
        steps = steps_in(block)
        law.propagate(
            problem_in(block), floats_at(y, steps.actions), floats_at(memory, steps.memory),
            floats_at(scratch, length),
        )  # fmt: skip
        return 0

    def storage(block, memory):
        _ = source
        return law.storage(problem_in(block), floats_at(memory, steps_in(block).memory))

    found = {functions.STORAGE: callback(_real(_whole, _whole), storage)}
    if held:
        found[functions.PROPAGATE] = callback(_whole(*[_whole] * 5), propagate)
    else:
        found[functions.RATE] = callback(_whole(*[_whole] * 4), rate)
    return found


@cache
def penalty(fall: Callable[[float, float], float]) -> Any:
    """The penalty at a time, by a schedule's kernel (:class:`gne_mj.barrier.Fall`)."""
    source = source_key(sys.modules[fall.__module__])

    def penalty(block, time):
        _ = source
        return scheduled(fall, problem_in(block).schedule, time)

    return callback(_real(_whole, _real), penalty)


@cache
def penalty_of_moving(fall: Callable[[float, float], float]) -> Any:
    """The same of a game that moves, whose numbers are brought to that time."""
    source = source_key(sys.modules[fall.__module__])

    def penalty(block, time):
        _ = source
        problem = problem_in(block)
        move(problem.motion, time)
        return scheduled(fall, problem.schedule, time)

    return callback(_real(_whole, _real), penalty)


@cache
def positions() -> Any:
    """What looks at positions that follow outputs, for all laws, games and agents."""
    source = source_key()

    def observe(block, profile, values, monitor, time, state):
        _ = source
        steps = steps_in(block)
        followed.observe(
            problem_in(block), channels_in(block), floats_at(profile, steps.actions),
            floats_at(values, steps.constraints),
            _monitor_in(floats_at(monitor, _LENGTH_OF_MONITOR), 0), time,
            floats_at(state, steps.actions * steps.states),
        )  # fmt: skip
        return 0

    return callback(_whole(*[_whole] * 4, _real, _whole), observe)


@cache
def separation(held: bool, origin: tuple[float, ...]) -> dict[int, Any]:
    """What keeps agents apart, for all laws, games and agents; in held modes the solver pushes."""
    source = source_key()

    def keep(block, workspace, time, step, stage, state):
        _ = source
        steps = steps_in(block)
        good = apart.keep(
            parts_at(block, workspace, steps), Instant(time, step, stage),
            floats_at(state, steps.actions * steps.states), origin,
        )  # fmt: skip
        return 1 if good else 0

    def push(block, workspace, time, step, stage):
        _ = source
        parts = parts_at(block, workspace, steps_in(block))
        return 1 if apart.add_to_law(parts, Instant(time, step, stage), origin) else 0

    found = {functions.KEEP_APART: callback(_whole(_whole, _whole, _real, *[_whole] * 3), keep)}
    if not held:
        found[functions.PUSH_APART] = callback(_whole(_whole, _whole, _real, _whole, _whole), push)
    return found


@cache
def of_implicit(
    law: ModuleType, game: ModuleType, alone: bool, driven: bool = False
) -> dict[int, Any]:
    """What mode implicit solves a law for, each agent by itself if ``alone``; see :func:`link`."""
    entries = (
        functions.PREPARE, functions.BARRIER_FREE_TERMS, functions.ADD_BARRIER_FREE_SLOPE,
        functions.MEMORY_OUTPUTS, functions.OWN_PROFILE,
    )  # fmt: skip
    return dict(zip(entries, compiled_for(game, _of_implicit, law, alone, driven), strict=False))


def _of_implicit(game: ModuleType, law: ModuleType, alone: bool, driven: bool) -> list[Any]:
    source = source_key(law, game)

    def prepare(block, first, last, y, memory):
        _ = source
        steps = steps_in(block)
        law.prepare(
            problem_in(block), first, last, floats_at(y, steps.actions),
            floats_at(memory, steps.memory),
        )  # fmt: skip
        return 0

    def barrier_free_terms(block, first, last, at_y, at_memory, at_out):
        _ = source
        problem, steps = problem_in(block), steps_in(block)
        y, memory = floats_at(at_y, steps.actions), floats_at(at_memory, steps.memory)
        out, data = floats_at(at_out, steps.actions), problem.data
        law.prepare(problem, first, last, y, memory)
        for i in range(first, last):
            for a in range(data.offsets[i], data.offsets[i + 1]):
                out[a] = law.barrier_free(game, problem, i, a, y, memory)
                if driven:
                    out[a] -= problem.motion.now[a]
        return 0

    def add_barrier_free_slope(block, i, a, y, memory, out):
        _ = source
        steps = steps_in(block)
        m = steps.actions
        law.add_barrier_free_slope(
            game, problem_in(block), i, a, floats_at(y, m), floats_at(memory, steps.memory),
            floats_at(out, m),
        )  # fmt: skip
        return 0

    def own_profile(block, i, y, memory, profile):
        _ = source
        steps = steps_in(block)
        m = steps.actions
        return law.own_profile(
            problem_in(block), i, floats_at(y, m), floats_at(memory, steps.memory),
            floats_at(profile, m),
        )  # fmt: skip

    def memory_outputs(block, prediction, held):
        _ = source
        m = steps_in(block).actions
        law.memory_outputs(floats_at(prediction, m), floats_at(held, m))
        return 0

    found = [
        callback(_whole(*[_whole] * 5), prepare),
        callback(_whole(*[_whole] * 6), barrier_free_terms),
        callback(_whole(*[_whole] * 6), add_barrier_free_slope),
        callback(_whole(*[_whole] * 3), memory_outputs),
    ]
    if alone:
        found.append(callback(_real(*[_whole] * 5), own_profile))
    return found


@cache
def solve(equation: ModuleType, origin: tuple[float, ...] = cells.PLANE) -> Any:
    """The solver of mode implicit, for all laws and games.

    Args:
        equation: :mod:`gne_mj.loops.joint`, :mod:`gne_mj.loops.apart` or
            :mod:`gne_mj.loops.local`.
        origin: cells.PLANE or cells.SPACE, of agents that keep apart.
    """
    source = source_key()

    def solve(block, memory, profile, now, solver, length, separation):
        _ = source
        steps, problem = steps_in(block), problem_in(block)
        views = solver_in(floats_at(solver, length), problem.order, steps.constraints, steps.states)
        of_law = law_work_at(profile, now, steps.actions)
        near = floats_at(separation, steps.separation)
        work = SolverWork(of_law.profile, of_law.now, near, origin)
        return equation.solve(problem, floats_at(memory, steps.memory), work, views)

    return callback(_whole(*[_whole] * 7), solve)


@cache
def act(
    plant: ModuleType,
    faults: ModuleType,
    game: ModuleType,
    at: Any,
    find: Callable[..., Any] = implicit.act,
) -> Any:
    """What a mode with a prediction does at a control instant, for all laws and games.

    Args:
        plant: module that predicts, :mod:`gne_mj.plants.zero_order_hold` and its like.
        faults: :mod:`gne_mj.loops.faultless` or one of those in its place.
        game: :mod:`gne_mj.loops.standing` or :mod:`gne_mj.loops.moving`.
        at: where MuJoCo keeps what, for a plant that asks it.
        find: the kernel that finds the input: :func:`gne_mj.loops.implicit.act`, or one of
            :mod:`gne_mj.loops.guard`.
    """
    source = source_key(plant, faults, game)

    def act(block, workspace, time, step, state, memory, model, data):
        _ = source
        steps = steps_in(block)
        parts = parts_at(block, workspace, steps)
        if not game.to_period_end(parts, time):
            return 0
        good = find(
            faults, plant, (at, model, data, block), parts, Instant(time, step, 0),
            floats_at(state, steps.actions * steps.states), floats_at(memory, steps.memory),
        )  # fmt: skip
        game.back(parts, time)
        return 1 if good else 0

    return callback(_whole(_whole, _whole, _real, *[_whole] * 5), act)
