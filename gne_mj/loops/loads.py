"""Mode implicit with an observer of loads: what besides their inputs moves the agents.

At each control instant an agent compares its output with the one that was predicted. Divided by how
far a push moves it over the period (dy+/du, the slope that the equation is solved with), the
difference is what the load was beyond the estimate of it, and a part of that is added. The input
that is solved for is the load's and the agent's together, so that

    u + load = law(y+),   y+ = the plant's own discrete map under u + load held.

Estimates are behind the law's memory, one a channel.
"""

from gne_mj.controllers.settings import COMPENSATION, OBSERVER
from gne_mj.loops import implicit
from gne_mj.loops import monitor as watch
from gne_mj.native import copy, kernel


@kernel
def place_of(problem, memory):
    """Where in a loop's memory the estimated loads begin, up to its end; without an observer
    there."""
    observed = problem.settings[OBSERVER] > 0.0
    return len(memory) - (len(problem.limit) if observed else 0)


@kernel
def observe(parts, time, loads, solver):
    """Correct the loads by outputs solver.anchor, where solver.prediction was expected.

    What an actuator did not deliver of the last input is no load.
    """
    gain, monitor = parts.problem.settings[OBSERVER], parts.monitor
    for r in range(len(loads)):
        missing = parts.u[r] - (solver.held[r] - loads[r])
        pushed = (solver.anchor[r] - solver.prediction[r]) * solver.stiff[r]
        change = gain * (pushed - missing)
        loads[r] += change
        watch.note_load(monitor, time, loads[r], change)


@kernel
def take_off(loads, commanded):
    """Of what moves the agents, the input is what their loads do not bring."""
    for r in range(len(loads)):
        commanded[r] -= loads[r]


@kernel
def act(faults, plant, context, parts, at, state, memory):
    """As :func:`gne_mj.loops.implicit.act`, with loads."""
    work, solver = parts.work, implicit.solver_of(parts)
    loads = memory[place_of(parts.problem, memory) :]
    if solver.numbers.solved_step == at.step + 1.0:
        copy(solver.held, work.commanded)
        take_off(loads, work.commanded)
        return True
    faults.sense(parts.problem, work, work.y, work.measurement)
    known = faults.sense_state(plant, parts, at.step, state, solver.state, solver.scratch)
    first = solver.numbers.found == 0.0
    implicit.look(parts, at, known, solver)
    if first:
        implicit.find_slopes(plant, context, parts.channels, parts.clock, known, solver)
    else:
        observe(parts, at.time, loads, solver)
    implicit.extrapolate(solver)
    solver.numbers.found += 1.0
    if parts.problem.settings[COMPENSATION] > 0.0:
        implicit.find_keeping(plant, context, parts.channels, parts.clock, known, solver)
    ended, agreed, least = implicit.solve(plant, context, parts, parts.clock, known, memory, solver)
    good = implicit.settle(parts, at.time, memory, solver, ended, agreed, least)
    take_off(loads, work.commanded)
    return good
