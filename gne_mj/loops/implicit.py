"""Mode implicit: the input that is held is the law at the outputs which that input produces.

At a control instant the plant's own discrete map over the coming period, substeps included, is
evaluated under a trial input and taken as base + slope u, channel by channel; the barrier's
equation is solved exactly for that map (:mod:`gne_mj.loops.joint`, :mod:`gne_mj.loops.local`); the
map is evaluated again under the result, its slope corrected by the secant, and so on until
prediction and solution agree. For one Euler step the map is affine in u and one evaluation is
enough. Since every solution is strictly inside, so are the outputs at the next control instant, as
long as the plant does what its map says and the input that is delivered is the one asked for.
"""

import numpy as np

from gne_mj import game_functions as games
from gne_mj.controllers.settings import COMPENSATION
from gne_mj.loops import functions
from gne_mj.loops import monitor as watch
from gne_mj.loops.feedback import usable
from gne_mj.loops.newton import OUTSIDE, UNSOLVED, solver_in
from gne_mj.native import copy, kernel

# The map may be linearised so often; predictions agree if no constraint differs by more than this
# part of the distance to its bound
MOST_MAPS = 12
AGREES = 1e-7
# Outputs are taken to stay if they move by less, relative to 1 and their size
KEEPS = 1e-9
# Where inputs move each other's outputs, a secant is taken of outputs that move at least this part
# of the way of the one that moves farthest: of others it would be mostly what those brought about
OWN = 0.1
# Where the map is affine in u, a prediction that moves farther than this is checked all the same:
# the slope has rounding
FAR = 1e-2


@kernel
def act(faults, plant, context, parts, at, state, memory):
    """Fill work.commanded; False, with the exit latched, if there is no input."""
    solver = solver_of(parts)
    if (
        solver.numbers.solved_step == at.step + 1.0
    ):  # a run that goes on after its end was looked at
        copy(solver.held, parts.work.commanded)
        return True
    faults.sense(parts.problem, parts.work, parts.work.y, parts.work.measurement)
    known = faults.sense_state(plant, parts, at.step, state, solver.state, solver.scratch)
    look(parts, at, known, solver)
    if solver.numbers.found == 0.0:
        find_slopes(plant, context, parts.channels, parts.clock, known, solver)
    # where the inputs so far lead to
    extrapolate(solver)
    solver.numbers.found += 1.0
    if parts.problem.settings[COMPENSATION] > 0.0:
        find_keeping(plant, context, parts.channels, parts.clock, known, solver)
    ended, agreed, least = solve(plant, context, parts, parts.clock, known, memory, solver)
    return settle(parts, at.time, memory, solver, ended, agreed, least)


@kernel
def solver_of(parts):
    """The arrays that inputs are solved for in."""
    work, states = parts.work, parts.channels.equilibrium_state.shape[1]
    return solver_in(work.solver, parts.problem.order, len(work.g), states)


@kernel
def look(parts, at, known, solver):
    """Begin a control instant: ``known`` is the flat state as the law has it."""
    problem, channels, work = parts.problem, parts.channels, parts.work
    m, states = channels.equilibrium_state.shape
    solver.numbers.solved_step = at.step + 1.0
    if solver.numbers.found > 0.0:
        watch.compare(parts.monitor, at.time, work.y, solver.prediction)
    else:
        # inside for certain, as y(0) that is seen is not
        copy(problem.equilibrium, solver.prediction)
    for r in range(m):
        solver.anchor[r] = known[r * states + channels.output]
    solver.numbers.steps = 0.0


@kernel
def solve(plant, context, parts, clock, known, memory, solver):
    """Fill solver.held with the input for the clock's period, and solver.y with what it leads to.

    It begins with the input solver.u and the slopes that there are. Returns how Newton's method
    ended, whether prediction and solution agree, and the least secant.
    """
    problem, channels, work, m = parts.problem, parts.channels, parts.work, len(solver.u)
    map_prediction(plant, context, channels, clock, known, solver)
    copy(solver.reached, solver.y)
    ended, agreed, least = OUTSIDE, False, np.inf
    for _ in range(MOST_MAPS):
        for r in range(m):
            excess = solver.u[r] - solver.keeping[r]
            solver.base[r] = solver.reached[r] - solver.slope[r] * excess
        ended = functions.solve(problem, memory, work)
        if ended == OUTSIDE:
            break
        farthest = 0.0
        for r in range(m):
            law = (solver.y[r] - solver.base[r]) * solver.stiff[r]
            solver.held[r] = law + solver.keeping[r]
            farthest = max(farthest, abs(solver.y[r] - solver.reached[r]))
        if farthest < FAR and plant.is_affine(clock):
            agreed = True
            break
        for r in range(m):
            solver.u[r], solver.held[r] = solver.held[r], solver.u[r]
            solver.prediction[r] = solver.reached[r]
        map_prediction(plant, context, channels, clock, known, solver)
        least = correct_slopes(plant, solver, solver.held, solver.prediction)
        copy(solver.u, solver.held)
        agreed = agrees(problem, solver)
        if agreed:
            copy(solver.reached, solver.y)
            break
    return ended, agreed, least


@kernel
def settle(parts, time, memory, solver, ended, agreed, least):
    """Give the input that was solved for, and count it; False, with the exit latched, if there is
    none."""
    problem, work, monitor = parts.problem, parts.work, parts.monitor
    functions.prepare(problem, 0, len(problem.data.offsets) - 1, solver.anchor, memory)
    copy(solver.y, solver.prediction)
    copy(solver.held, work.commanded)
    functions.memory_outputs(problem, solver.prediction, work.held)
    watch.count_solution(monitor, time, solver.numbers.steps, agreed and ended < UNSOLVED, least)
    if ended == OUTSIDE:
        k, value = int(work.now.tightened), work.now.tightened_value
        watch.leave(monitor, watch.ESTIMATE_LEFT, time, -1, k, value, 0)
        return False
    return usable(time, 0, work, monitor)


@kernel
def extrapolate(solver):
    """Fill solver.u with what the last inputs lead to, by a parabola once there are three."""
    smooth = solver.numbers.found >= 3.0
    for r in range(len(solver.u)):
        last, before, earlier = solver.held[r], solver.before[r], solver.earlier[r]
        solver.u[r] = 3.0 * (last - before) + earlier if smooth else last
        solver.before[r], solver.earlier[r] = last, before


@kernel
def map_prediction(plant, context, channels, clock, known, solver):
    """Fill solver.reached with the outputs that the plant's map reaches under solver.u."""
    plant.predict(
        context, channels, clock, known, solver.u, solver.reached, solver.rolled,
        solver.scratch,
    )  # fmt: skip


@kernel
def find_slopes(plant, context, channels, clock, known, solver):
    """Fill the slopes from the map under two inputs: exact where it is affine."""
    for r in range(len(solver.u)):
        solver.u[r] = 0.0
    map_prediction(plant, context, channels, clock, known, solver)
    copy(solver.reached, solver.y)
    for r in range(len(solver.u)):
        solver.u[r] = 1.0
    map_prediction(plant, context, channels, clock, known, solver)
    for r in range(len(solver.u)):
        solver.slope[r] = solver.reached[r] - solver.y[r]
        solver.stiff[r] = 1.0 / solver.slope[r]


@kernel
def find_keeping(plant, context, channels, clock, known, solver):
    """Fill solver.keeping, and solver.u, with the input under which outputs stay over the period.

    It begins with the input that was held last: where dry friction keeps outputs at rest, this one
    does, and the law's part is added to it from period to period until they move.
    """
    copy(solver.before, solver.u)
    map_prediction(plant, context, channels, clock, known, solver)
    for _ in range(MOST_MAPS):
        stays = True
        for r in range(len(solver.u)):
            solver.trial[r], solver.residual[r] = solver.u[r], solver.reached[r]
            missing = solver.anchor[r] - solver.reached[r]
            if abs(missing) > KEEPS * (1.0 + abs(solver.anchor[r])):
                solver.u[r] += missing * solver.stiff[r]
                stays = False
        if stays:
            break
        map_prediction(plant, context, channels, clock, known, solver)
        correct_slopes(plant, solver, solver.trial, solver.residual)
    copy(solver.u, solver.keeping)


@kernel
def correct_slopes(plant, solver, tried, led):
    """Slopes by the secants from inputs ``tried`` and the outputs that they ``led`` to to (u,
    reached); returns the least one seen.

    A secant that is not positive is not taken: the equation would not be monotone.
    """
    least, notable = np.inf, 0.0
    if plant.is_coupled():
        for r in range(len(solver.u)):
            notable = max(notable, OWN * abs(solver.reached[r] - led[r]))
    for r in range(len(solver.u)):
        change = solver.u[r] - tried[r]
        moved = solver.reached[r] - led[r]
        # of a short way rounding is all that is seen
        short = 1e-9 * (1.0 + abs(solver.reached[r]))
        if abs(moved) > short and abs(moved) >= notable and change != 0.0:
            secant = moved / change
            least = min(least, secant)
            if 0.0 < secant < np.inf:
                solver.slope[r] = secant
                solver.stiff[r] = 1.0 / secant
    return least


@kernel
def agrees(problem, solver):
    """Whether the outputs reached have nearly the distances to all bounds of those solved for."""
    data = problem.data
    for k in range(len(solver.inverse)):
        slack = -games.constraint(data, k, solver.reached) - data.tightening[k]
        meant = -games.constraint(data, k, solver.y) - data.tightening[k]
        if not abs(slack - meant) <= AGREES * abs(meant):
            return False
    return True
