"""Control periods that are looked through before they begin: ``between = "guarded"``.

At a control instant an input is found as ever, and the plant's map is evaluated at every
integration step of the period under it, as actuators deliver it. Where some predicted g is not
negative the period is cut. In mode implicit it is halved, down to one step, and solved for again:
of one step there are no inside instants, and the equation's solution is inside from every state.
In mode sampled the input stays and is held for as long as predictions are inside. The next control
instant comes after the shortened period; the clock's own control instants remain.

Where not even one step leads inside, the run ends there, with a code of its own. See
docs/held-inputs.md, *Between the instants*.
"""

import numpy as np

from gne_mj import game_functions as games
from gne_mj.loops import implicit, loads
from gne_mj.loops import monitor as watch
from gne_mj.loops.feedback import explicit_law
from gne_mj.loops.layout import LoopClock
from gne_mj.loops.newton import OUTSIDE
from gne_mj.native import copy, kernel

# Mode sampled: a period ends before a slack falls to this part of what it was at the instant, since
# the barrier's push grows as the slack shrinks
LEFT_OVER = 0.1


@kernel
def act(faults, plant, context, parts, at, state, memory):
    """Mode implicit: as :func:`gne_mj.loops.implicit.act`, over a period that may be cut."""
    clock, solver = parts.clock, implicit.solver_of(parts)
    numbers = solver.numbers
    faults.sense(parts.problem, parts.work, parts.work.y, parts.work.measurement)
    known = faults.sense_state(plant, parts, at.step, state, solver.state, solver.scratch)
    of_agents, begun = memory[loads.place_of(parts.problem, memory) :], numbers.found > 0.0
    implicit.look(parts, at, known, solver)
    if begun:
        loads.observe(parts, at.time, of_agents, solver)
    asked = clock.period - at.step % clock.period
    length, first, bad = asked, True, 0
    while True:
        period = LoopClock(clock.h, length, clock.mode, clock.method)
        if numbers.length != length:  # slopes, and how inputs went on, were those of another one
            implicit.find_slopes(plant, context, parts.channels, period, known, solver)
            numbers.length, numbers.uses, numbers.found = length, 0.0, min(numbers.found, 1.0)
        if first:
            implicit.extrapolate(solver)
            numbers.found += 1.0
        else:
            copy(solver.held, solver.u)
        ended, agreed, least = implicit.solve(plant, context, parts, period, known, memory, solver)
        bad = length
        if ended != OUTSIDE:
            bad = first_outside(plant, context, parts, length, known, solver, of_agents)
        if bad == 0 or length == 1:
            break
        length, first = length // 2, False
        if ended != OUTSIDE:
            copy(solver.y, solver.prediction)  # which the next attempt may begin from, being inside
    plan(parts, at, asked, length)
    good = implicit.settle(parts, at.time, memory, solver, ended, agreed, least)
    loads.take_off(of_agents, parts.work.commanded)
    if not good:
        return False
    return bad == 0 or leads_inside(parts, at, solver.reached)


@kernel
def act_sampled(faults, plant, context, parts, at, state, memory):
    """Mode sampled: the law at the outputs of now, held for as long as that leads inside."""
    problem, channels, clock, work = parts.problem, parts.channels, parts.clock, parts.work
    solver = implicit.solver_of(parts)
    measurement = faults.sense(problem, work, work.y, work.measurement)
    known = faults.sense_state(plant, parts, at.step, state, solver.state, solver.scratch)
    if not explicit_law(problem, at.time, 0, measurement, memory, work, parts.monitor):
        return False
    copy(work.commanded, solver.held)
    games.values(problem.data, problem.data.all_constraints, measurement, solver.inverse)
    set_out(plant, context, parts, known, solver, memory[:0])
    asked = clock.period - at.step % clock.period
    length = 0
    while length < asked:
        plant.step_on(
            context, channels, clock, solver.u, solver.reached, solver.rolled, solver.scratch
        )
        if not least_share(problem.data, solver) > (LEFT_OVER if length > 0 else 0.0):
            break
        length += 1
    plan(parts, at, asked, max(length, 1))
    return length > 0 or leads_inside(parts, at, solver.reached)


@kernel
def plan(parts, at, asked, length):
    """The next control instant comes after so many steps, of those that the clock had."""
    parts.work.now.next_instant = at.step + length
    if length < asked:
        watch.count_cut(parts.monitor, at.time, length * parts.clock.h)


@kernel
def set_out(plant, context, parts, known, solver, of_agents):
    """Begin to look through a period under solver.held, as actuators deliver the input's part."""
    limit = parts.problem.limit
    for r in range(len(limit)):
        load = of_agents[r] if len(of_agents) > 0 else 0.0
        solver.u[r] = min(max(solver.held[r] - load, -limit[r]), limit[r]) + load
    plant.set_out(context, parts.channels, known, solver.u, solver.rolled)


@kernel
def first_outside(plant, context, parts, length, known, solver, of_agents):
    """The first of so many steps at whose end predicted outputs are not inside; 0 if all are.

    ``solver.reached`` has the outputs at that step.
    """
    set_out(plant, context, parts, known, solver, of_agents)
    for step in range(length):
        plant.step_on(
            context, parts.channels, parts.clock, solver.u, solver.reached, solver.rolled,
            solver.scratch,
        )  # fmt: skip
        if parts.problem.order.band[1] > 0:
            good = shares_inside(parts.problem, step, parts.work, solver)
        else:
            good = all_inside(parts.problem, step, solver.reached)
        if not good:
            return step + 1
    return 0


@kernel
def tightening(problem, step, k):
    """How far disturbances can carry constraint k within step + 1 steps."""
    count = len(problem.data.tightening)
    return problem.ahead[step * count + k] if len(problem.ahead) > 0 else 0.0


@kernel
def all_inside(problem, step, y):
    """Whether outputs y (m,) at the end of a step leave room for disturbances."""
    for k in range(len(problem.data.tightening)):
        if not games.constraint(problem.data, k, y) + tightening(problem, step, k) < 0.0:
            return False
    return True


@kernel
def shares_inside(problem, step, work, solver):
    """Whether each agent keeps to its shares at the end of a step, as far as it can tell alone.

    It looks as :mod:`gne_mj.loops.local` does at a period's end: if all are inside, so are the
    outputs that they reach together.
    """
    data, profile = problem.data, work.profile
    at, pointer = data.offsets, data.member_pointer
    copy(solver.anchor, profile)
    for i in range(len(at) - 1):
        for entry in range(data.own_pointer[i], data.own_pointer[i + 1]):
            k = data.own_index[entry]
            share = pointer[k + 1] - pointer[k]
            for a in range(at[i], at[i + 1]):
                profile[a] = solver.anchor[a] + share * (solver.reached[a] - solver.anchor[a])
            if not games.constraint(data, k, profile) + tightening(problem, step, k) < 0.0:
                return False
        copy(solver.anchor[at[i] : at[i + 1]], profile[at[i] : at[i + 1]])
    return True


@kernel
def least_share(data, solver):
    """The least part that predicted slacks are of those now, of g in solver.inverse; not positive
    outside."""
    least = np.inf
    for k in range(len(solver.inverse)):
        part = games.constraint(data, k, solver.reached) / solver.inverse[k]
        if not part >= least:
            least = part
    return least


@kernel
def leads_inside(parts, at, y):
    """Whether outputs y (m,), predicted for the next step, are inside; else the exit is latched."""
    data = parts.problem.data
    for k in range(len(data.tightening)):
        value = games.constraint(data, k, y)
        if not value < 0.0:
            watch.leave(parts.monitor, watch.FORESEEN, at.time, -1, k, value, 0)
            return False
    return True
