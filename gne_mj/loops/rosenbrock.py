"""The stiff closed loop of ODE agents under the fully distributed law, by a Rosenbrock method.

Small epsilon makes the estimates and z of [eq:CentreDynamics2] fast, so that explicit methods
crawl. RODAS is L-stable, stiffly accurate and of order 4, its steps hardly depend on epsilon, and
the structure of the loop keeps them cheap. With s = 1 / (gamma h), each stage solves
(s I - J) k = r, with J the loop's Jacobian at the start of the step, as follows.

- Column r of the estimates (one action y_r of agent j) obeys epsilon e' = -L_j e for its errors,
  L_j being the Laplacian without row and column j. In L_j's eigenbasis (eigenvalues lambda, modes
  w, w = Q'1 y_r at rest) the equation is diagonal: k_w = (epsilon r_w + lambda Q'1 k_y) /
  (epsilon s + lambda). Back in the agents' own coordinates that is k_e = p + T k_y, p known.
- z likewise: k_z = (epsilon r_z + k_y) / (epsilon s + 1).
- A channel x' = f(x) + G u answers by itself: k_x = (s I - A)^-1 (r_x + G k_u), A = df/dx.
- The law ties them: k_u = U_y k_y + U_z k_z + U_e k_e. Put together, one system of m equations
  remains for k_u, and it alone is factorised. It is solved for what the answers without inputs
  (k_u = 0) leave over.

The modes are integrated beside the estimates that the law reads; since the method commutes with
linear maps, both are the same solution.
"""

from functools import cache
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.controllers.settings import EPSILON, GAIN, RHO
from gne_mj.graph import Graph
from gne_mj.loops import monitor as watch
from gne_mj.loops.base import ClosedLoop, Samples
from gne_mj.loops.feedback import Problem, feedback, work
from gne_mj.loops.ode import measure, stored
from gne_mj.native import compiled, copy, kernel, source_key
from gne_mj.plants.ode import Channels

STAGES = 6
# RODAS, the first set of coefficients of E. Hairer's RODAS code (rodas.f, METH = 1), described in
# E. Hairer and G. Wanner, Solving Ordinary Differential Equations II, 2nd edition, section VI.4.
# Stage i solves (I / (gamma h) - J) k_i = f(x + sum_j STAGE_ij k_j) + sum_j RATE_ij k_j / h; the
# last row of STAGE gives the new state, and k_6 its difference from the embedded solution of
# order 3.
GAMMA = 0.25
_FIFTH = (1.221224509226641, 6.019134481288629, 12.53708332932087, -0.687886036105895)
_STAGE: tuple[tuple[float, ...], ...] = (
    (),
    (1.544,),
    (0.9466785280815826, 0.2557011698983284),
    (3.314825187068521, 2.896124015972201, 0.9986419139977817),
    _FIFTH,
    (*_FIFTH, 1.0),
    (*_FIFTH, 1.0, 1.0),
)
_RATE: tuple[tuple[float, ...], ...] = (
    (),
    (-5.6688,),
    (-2.430093356833875, -0.2063599157091915),
    (-0.1073529058151375, -9.594562251023355, -20.47028614809616),
    (7.496443313967647, -10.24680431464352, -33.99990352819905, 11.7089089320616),
    (
        8.083246795921522,
        -7.981132988064893,
        -31.52159432874371,
        16.31930543123136,
        -6.058818238834054,
    ),
)
# Dense output of order 3 at x0 + theta h, with theta' = 1 - theta:
# theta' x0 + theta (x1 + theta' (sum_j DENSE_0j k_j + theta sum_j DENSE_1j k_j)).
_DENSE = (
    (10.12623508344586, -7.487995877610167, -34.80091861555747, -7.992771707568823,
     1.025137723295662),
    (-0.6762803392801253, 6.087714651680015, 16.43084320892478, 24.76722511418386,
     -6.594389125716872),
)  # fmt: skip

# How the step is chosen: Gustafsson's predictive controller with the figures of RODAS.
SAFETY, GROW, SHRINK = 0.9, 6.0, 0.2
SMALLEST = 1e-12  # step in s per max(1, time) below which a run ends

# Entries of a loop's `progress`: the last accepted step runs from START to END.
START, END, NEXT, LAST_STEP, LAST_ERROR, ACCEPTED, REJECTED, COUNT = range(8)


class Method(NamedTuple):
    """The coefficients as arrays, and what accuracy is asked for."""

    stage: np.ndarray  # (7, 6)
    rate: np.ndarray  # (6, 6)
    dense: np.ndarray  # (2, 6)
    rtol: float
    atol: float


class Modes(NamedTuple):
    """The estimates' dynamics in their eigenbases; a column is one entry of a profile."""

    owner: np.ndarray  # (m,) the agent that each column belongs to
    rates: np.ndarray  # (N - 1, m) eigenvalues lambda of the owner's L_j
    rest: np.ndarray  # (N - 1, m) Q'1, the modes at rest for an action of 1
    vectors: np.ndarray  # (N - 1, N, m) Q, by mode, agent and column; zero for the owner itself


class Solver(NamedTuple):
    """Arrays that a step works on. n is the flat state's length, w that of the modes."""

    inputs: np.ndarray  # (m, states) G, read-only
    modes: np.ndarray  # (w,) modes at END
    trial: np.ndarray  # (n,) state at a stage
    trial_modes: np.ndarray  # (w,)
    k: np.ndarray  # (6, n)
    k_modes: np.ndarray  # (6, w)
    dense: np.ndarray  # (4, n) what the dense output of the last accepted step needs
    greatest: np.ndarray  # (states,) each state's greatest magnitude so far
    exit: np.ndarray  # why the last stage failed, as the monitor's header
    u: np.ndarray  # (m,) input at a stage
    known: np.ndarray  # (w,) a stage's k_modes but for what k_y adds
    pull: np.ndarray  # (w,) what k_y adds, for a k_y of 1
    decay: np.ndarray  # (w,) 1 / (epsilon s + lambda)
    spread: np.ndarray  # (N m,) T
    local: np.ndarray  # (m, states, states) A
    resolvent: np.ndarray  # (m, states, states) (s I - A)^-1 by columns, that is transposed
    small: np.ndarray  # (states, states) s I - A of one channel, factorised
    small_pivot: np.ndarray  # (states,)
    response: np.ndarray  # (m, states) (s I - A)^-1 G
    own: np.ndarray  # (m, m) du / dy and, off the agents' own blocks, du / d estimate
    filtered: np.ndarray  # (m, m) du / dz
    matrix: np.ndarray  # (m, m) of the reduced system, factorised
    pivot: np.ndarray  # (m,)
    k_x: np.ndarray  # (states,) one channel's
    k_y: np.ndarray  # (m,)
    k_u: np.ndarray  # (m,)


@kernel
def factorise(matrix, pivot):
    """LU with partial pivoting, in place, the diagonal as its reciprocals; False if singular."""
    n = len(pivot)
    for c in range(n):
        best = c
        for r in range(c + 1, n):
            if abs(matrix[r, c]) > abs(matrix[best, c]):
                best = r
        pivot[c] = best
        if not 0.0 < abs(matrix[best, c]) < np.inf:
            return False
        if best != c:
            for k in range(n):
                matrix[c, k], matrix[best, k] = matrix[best, k], matrix[c, k]
        inverse = 1.0 / matrix[c, c]
        for r in range(c + 1, n):
            factor = matrix[r, c] * inverse
            matrix[r, c] = factor
            for k in range(c + 1, n):
                matrix[r, k] -= factor * matrix[c, k]
        matrix[c, c] = inverse
    return True


@kernel
def substitute(matrix, pivot, b):
    """Solve in place with what :func:`factorise` left."""
    n = len(b)
    for c in range(n):
        b[c], b[pivot[c]] = b[pivot[c]], b[c]
    for r in range(1, n):
        total = b[r]
        for c in range(r):
            total -= matrix[r, c] * b[c]
        b[r] = total
    for back in range(n):
        r = n - 1 - back
        total = b[r]
        for c in range(r + 1, n):
            total -= matrix[r, c] * b[c]
        b[r] = total * matrix[r, r]


@kernel
def add_multiple(scale, source, target):
    """target += scale * source."""
    for r in range(len(target)):
        target[r] += scale * source[r]


@kernel
def add_from_modes(vectors, modes, memory):
    """memory += the estimates that belong to these modes (nothing in the agents' own blocks)."""
    count, agents, m = vectors.shape
    for a in range(count):
        amount = modes[a * m : (a + 1) * m]
        for i in range(agents):
            row, vector = memory[i * m : (i + 1) * m], vectors[a, i]
            for r in range(m):
                row[r] += vector[r] * amount[r]


@kernel
def look(
    agent, law, game, problem, channels, states, time, state, monitor, latch, work, u
):  # fmt: skip
    """Measure, act and observe; fill u. False, with the exit in ``latch``, if there is no input."""
    y = work.y
    measure(agent, state, states, y)
    if not feedback(
        law, game, problem, time, 0, y, state[len(y) * states :], work, latch, u
    ):  # fmt: skip
        return False
    storage = stored(agent, channels, state)
    watch.observe(monitor, time, y, work.g, work.demand, u, u, storage)
    return True


@kernel
def linearise(agent, game, problem, channels, states, state, u, work, solver):
    """Fill the law's and the channels' derivatives at a state that :func:`look` has just seen."""
    data = problem.data
    at, q = data.offsets, data.parameters
    m, agents = len(u), len(at) - 1
    gain, rho = problem.settings[GAIN], problem.settings[RHO]
    memory = state[m * states :]
    z, profile = memory[agents * m :], work.profile
    own, filtered = solver.own, solver.filtered
    for r in range(m):
        x = state[r * states : (r + 1) * states]
        agent.jacobian(channels.parameters[r], x, solver.local[r])
        for c in range(m):
            own[r, c] = 0.0
            filtered[r, c] = 0.0
    for i in range(agents):
        first, last = at[i], at[i + 1]
        copy(memory[i * m : (i + 1) * m], profile)
        copy(work.y[first:last], profile[first:last])
        for a in range(first, last):
            game.add_cost_hessian(q, i, a, profile, -gain, own[a])
        copy(z[first:last], profile[first:last])
        for entry in range(data.own_pointer[i], data.own_pointer[i + 1]):
            k = data.own_index[entry]
            room = -game.constraint(q, k, profile)
            weight = -gain * rho / room
            for a in range(first, last):
                mine = game.constraint_gradient(q, k, a, profile) / room
                for member in range(data.member_pointer[k], data.member_pointer[k + 1]):
                    j = data.member_index[member]
                    target = filtered[a] if j == i else own[a]
                    for b in range(at[j], at[j + 1]):
                        other = game.constraint_gradient(q, k, b, profile)
                        second = game.constraint_hessian(q, k, a, b, profile)
                        target[b] += weight * (second + mine * other)
    for r in range(m):
        if u[r] != work.demand[r]:  # an input at its limit does not answer
            for c in range(m):
                own[r, c] = 0.0
                filtered[r, c] = 0.0


@kernel
def prepare(agent, problem, modes, states, h, solver):
    """Factorise for steps of length h from where the loop was linearised; False if singular."""
    m = len(solver.k_u)
    epsilon = problem.settings[EPSILON]
    s = 1.0 / (GAMMA * h)
    for a in range(len(modes.rates)):
        decay, pull = solver.decay[a * m : (a + 1) * m], solver.pull[a * m : (a + 1) * m]
        rates, rest = modes.rates[a], modes.rest[a]
        for r in range(m):
            decay[r] = 1.0 / (epsilon * s + rates[r])
            pull[r] = rates[r] * rest[r] * decay[r]
    for r in range(len(solver.spread)):
        solver.spread[r] = 0.0
    add_from_modes(modes.vectors, solver.pull, solver.spread)
    filter_gain = 1.0 / (epsilon * s + 1.0)
    small = solver.small
    for r in range(m):
        for a in range(states):
            for b in range(states):
                small[a, b] = -solver.local[r, a, b]
            small[a, a] += s
        if not factorise(small, solver.small_pivot):
            return False
        response = solver.response[r]
        for a in range(states):
            response[a] = 0.0
        for b in range(states):
            column = solver.resolvent[r, b]
            for a in range(states):
                column[a] = 0.0
            column[b] = 1.0
            substitute(small, solver.small_pivot, column)
            add_multiple(solver.inputs[r, b], column, response)
    for r in range(m):
        i = modes.owner[r]
        for c in range(m):
            slope = solver.own[r, c]
            if modes.owner[c] == i:
                slope += filter_gain * solver.filtered[r, c]
            else:
                slope *= solver.spread[i * m + c]
            solver.matrix[r, c] = -slope * solver.response[c, agent.OUTPUT]
        solver.matrix[r, r] += 1.0
    return factorise(solver.matrix, solver.pivot)


@kernel
def solve_stage(agent, problem, channels, modes, method, states, h, stage, solver):
    """Fill k and k_modes of one stage from the trial state and the input there."""
    at = problem.data.offsets
    m, agents = len(solver.k_u), len(at) - 1
    epsilon = problem.settings[EPSILON]
    s = 1.0 / (GAMMA * h)
    filter_gain = 1.0 / (epsilon * s + 1.0)
    size = m * states
    last = size + agents * m
    k, k_modes = solver.k[stage], solver.k_modes[stage]
    k_x, k_e, k_z = k[:size], k[size:last], k[last:]
    k_y, k_u = solver.k_y, solver.k_u
    # the right-hand sides
    for r in range(m):
        x = solver.trial[r * states : (r + 1) * states]
        agent.rate(channels.parameters[r], x, solver.u[r], k_x[r * states : (r + 1) * states])
        k_y[r] = x[agent.OUTPUT]
        k_z[r] = k_y[r] - solver.trial[last + r]
    for a in range(len(modes.rates)):
        one, amount = k_modes[a * m : (a + 1) * m], solver.trial_modes[a * m : (a + 1) * m]
        rates, rest = modes.rates[a], modes.rest[a]
        for r in range(m):
            one[r] = rates[r] * (rest[r] * k_y[r] - amount[r])
    for j in range(stage):
        scale = method.rate[stage, j] / h
        add_multiple(scale, solver.k[j, :size], k_x)
        add_multiple(epsilon * scale, solver.k[j, last:], k_z)
        add_multiple(epsilon * scale, solver.k_modes[j], k_modes)
    # answers without inputs
    for r in range(m):
        x = k_x[r * states : (r + 1) * states]
        for a in range(states):
            total = 0.0
            for b in range(states):
                total += solver.resolvent[r, b, a] * x[b]
            solver.k_x[a] = total
        for a in range(states):
            x[a] = solver.k_x[a]
        k_y[r] = x[agent.OUTPUT]
        k_z[r] = filter_gain * (k_z[r] + k_y[r])
    for r in range(len(k_modes)):
        solver.known[r] = solver.decay[r] * k_modes[r]
    for i in range(agents):
        row, spread = k_e[i * m : (i + 1) * m], solver.spread[i * m : (i + 1) * m]
        for r in range(m):
            row[r] = spread[r] * k_y[r]
        copy(k_y[at[i] : at[i + 1]], row[at[i] : at[i + 1]])  # the own action, until below
    add_from_modes(modes.vectors, solver.known, k_e)
    for r in range(m):
        i = modes.owner[r]
        total = 0.0
        for c in range(m):
            total += solver.own[r, c] * k_e[i * m + c]
        for c in range(at[i], at[i + 1]):
            total += solver.filtered[r, c] * k_z[c]
        k_u[r] = total
    substitute(solver.matrix, solver.pivot, k_u)
    # what the inputs add
    for r in range(m):
        response = solver.response[r]
        for a in range(states):
            k_x[r * states + a] += k_u[r] * response[a]
        k_u[r] *= response[agent.OUTPUT]
        k_y[r] += k_u[r]
        k_z[r] += filter_gain * k_u[r]
    for i in range(agents):
        row, spread = k_e[i * m : (i + 1) * m], solver.spread[i * m : (i + 1) * m]
        for r in range(m):
            row[r] += spread[r] * k_u[r]
        for r in range(at[i], at[i + 1]):
            row[r] = 0.0
    for a in range(len(modes.rates)):
        one, known = k_modes[a * m : (a + 1) * m], solver.known[a * m : (a + 1) * m]
        pull = solver.pull[a * m : (a + 1) * m]
        for r in range(m):
            one[r] = known[r] + pull[r] * k_y[r]


@kernel
def error_of(agent, agents, method, states, state, solver):
    """Weighted estimate of the step's error, 1 being what is allowed: the worst of all states.

    A state is compared with its greatest magnitude so far in any channel, z and the estimates
    with that of the output; a column of estimates counts by its root mean square, which is that
    of its modes.
    """
    m = len(solver.k_u)
    k, k_modes = solver.k[STAGES - 1], solver.k_modes[STAGES - 1]
    size = m * states
    last = size + agents * m
    worst = 0.0
    for a in range(states):
        allowed = method.atol + method.rtol * magnitude(states, state, solver, a)
        for r in range(m):
            error = abs(k[r * states + a])
            if a == agent.OUTPUT:
                total = 0.0
                for mode in range(agents - 1):
                    total += k_modes[mode * m + r] ** 2
                error = max(error, abs(k[last + r]), np.sqrt(total / max(agents - 1, 1)))
                error += 0.0 * (total + k[last + r])  # not a number if one of them is not
            error /= allowed
            if not error < np.inf:
                return np.inf
            worst = max(worst, error)
    return worst


@kernel
def magnitude(states, state, solver, a):
    """Greatest magnitude of the channels' state a so far and at ``state``."""
    greatest = solver.greatest[a]
    for r in range(len(solver.k_u)):
        greatest = max(greatest, abs(state[r * states + a]))
    return greatest


@kernel
def try_step(
    law, agent, game, problem, channels, modes, method, states, time, h, state, u, work, solver
):  # fmt: skip
    """Fill trial with the state after a step of length h; return its weighted error.

    The error is infinite, and solver.exit says why, if a stage or the new state is not inside.
    """
    size, agents = len(u) * states, len(problem.data.offsets) - 1
    solver.exit[watch.EXIT] = watch.INSIDE
    if not prepare(agent, problem, modes, states, h, solver):
        watch.leave(solver.exit, watch.DIVERGED, time, -1, -1, np.inf, 1)
        return np.inf
    copy(u, solver.u)
    for stage in range(STAGES + 1):
        copy(state, solver.trial)
        copy(solver.modes, solver.trial_modes)
        for j in range(stage):
            scale = method.stage[stage, j]
            add_multiple(scale, solver.k[j], solver.trial)
            add_multiple(scale, solver.k_modes[j], solver.trial_modes)
        if stage > 0:
            measure(agent, solver.trial, states, work.y)
            if not feedback(
                law, game, problem, time, stage, work.y, solver.trial[size:], work,
                solver.exit, solver.u,
            ):  # fmt: skip
                return np.inf
        if stage < STAGES:
            solve_stage(agent, problem, channels, modes, method, states, h, stage, solver)
    error = error_of(agent, agents, method, states, solver.trial, solver)
    if not error <= 1.0:  # latched only if the run ends here
        watch.leave(solver.exit, watch.DIVERGED, time, -1, -1, error, STAGES)
    return error


@kernel
def accept(problem, modes, method, states, h, progress, state, solver):
    """Move to the trial state, and keep what the dense output of the step needs."""
    at = problem.data.offsets
    m, agents = len(solver.k_u), len(at) - 1
    copy(state, solver.dense[0])
    copy(solver.trial, state)
    copy(solver.trial_modes, solver.modes)
    # anew from the modes, so that rounding does not add up in the estimates
    memory = state[m * states :]
    for i in range(agents):
        for r in range(at[i]):
            memory[i * m + r] = 0.0
        for r in range(at[i + 1], m):
            memory[i * m + r] = 0.0
    add_from_modes(modes.vectors, solver.modes, memory)
    copy(state, solver.dense[1])
    for line in range(2):
        out = solver.dense[2 + line]
        for r in range(len(out)):
            out[r] = 0.0
        for j in range(STAGES - 1):
            add_multiple(method.dense[line, j], solver.k[j], out)
    for a in range(states):
        solver.greatest[a] = magnitude(states, state, solver, a)
    progress[START] = progress[END]
    progress[END] += h
    progress[ACCEPTED] += 1.0


@kernel
def step_on(
    law, agent, game, problem, channels, modes, method, states, progress, state, u, monitor, work,
    solver,
):  # fmt: skip
    """Take one accepted step from END; False, with the exit latched, if there is none."""
    time = progress[END]
    if not look(
        agent, law, game, problem, channels, states, time, state, monitor, monitor, work, u
    ):  # fmt: skip
        return False
    monitor[watch.STEPS] = progress[ACCEPTED]
    linearise(agent, game, problem, channels, states, state, u, work, solver)
    h, retried = progress[NEXT], False
    while True:
        smallest = SMALLEST * max(1.0, time)
        if not h > smallest:
            h = smallest
        error = try_step(
            law, agent, game, problem, channels, modes, method, states, time, h, state, u, work,
            solver,
        )  # fmt: skip
        if error <= 1.0:
            break
        if h == smallest:
            why = solver.exit
            watch.leave(
                monitor, int(why[watch.EXIT]), time, why[watch.EXIT_AGENT],
                why[watch.EXIT_CONSTRAINT], why[watch.EXIT_VALUE], why[watch.EXIT_STAGE],
            )  # fmt: skip
            return False
        progress[REJECTED] += 1.0
        retried = True
        h *= max(SHRINK, SAFETY * error**-0.25) if error < np.inf else 0.5
    accept(problem, modes, method, states, h, progress, state, solver)
    factor = min(GROW, SAFETY * max(error, 1e-12) ** -0.25)
    if progress[LAST_STEP] > 0.0:
        trend = SAFETY * h / progress[LAST_STEP]
        factor = min(factor, trend * (progress[LAST_ERROR] / max(error, 1e-12) ** 2) ** 0.25)
    factor = max(factor, SHRINK)
    progress[NEXT] = h * (min(factor, 1.0) if retried else factor)
    progress[LAST_STEP] = h
    progress[LAST_ERROR] = max(error, 0.01)
    return True


@kernel
def interpolate(progress, time, dense, out):
    """Fill out with the state at a time in the last accepted step."""
    length = progress[END] - progress[START]
    theta = (time - progress[START]) / length if length > 0.0 else 1.0
    rest = 1.0 - theta
    before, after, second, third = dense[0], dense[1], dense[2], dense[3]
    for r in range(len(out)):
        out[r] = rest * before[r] + theta * (after[r] + rest * (second[r] + theta * third[r]))


@cache
def build(agent: ModuleType, law: ModuleType, game: ModuleType) -> tuple[Any, Any]:
    """The native loop and its last observation, for an agent type, a law and a game."""
    source = source_key(agent, law, game)
    states = len(agent.STATES)  # constant for the compiler, which unrolls the channels' loops

    @compiled
    def advance(
        problem, channels, modes, method, clock_step, step, every, progress, state, u, monitor,
        work, solver, samples_state, samples_u,
    ):  # fmt: skip
        _ = source
        for sample in range(len(samples_u)):
            row, time = samples_state[sample], step * clock_step
            interpolate(progress, time, solver.dense, row)
            # Outside between two states inside is the interpolation's doing and ends no run.
            latch = solver.exit if progress[END] > 0.0 else monitor
            if not look(
                agent, law, game, problem, channels, states, time, row, monitor, latch, work,
                samples_u[sample],
            ):  # fmt: skip
                if progress[END] == 0.0:
                    return sample, step
                for r in range(len(u)):
                    samples_u[sample, r] = np.nan
            monitor[watch.STEPS] = progress[ACCEPTED]
            time = (step + every) * clock_step
            while progress[END] < time:
                if not step_on(
                    law, agent, game, problem, channels, modes, method, states, progress, state,
                    u, monitor, work, solver,
                ):  # fmt: skip
                    return sample, step
            step += every
        return len(samples_u), step

    @compiled
    def finish(problem, channels, time, progress, monitor, work, solver, row, row_u):
        _ = source
        interpolate(progress, time, solver.dense, row)
        latch = solver.exit if progress[END] > 0.0 else monitor
        if not look(
            agent, law, game, problem, channels, states, time, row, monitor, latch, work, row_u
        ):
            for r in range(len(row_u)):
                row_u[r] = np.nan
        monitor[watch.STEPS] = progress[ACCEPTED]

    return advance, finish


def modes_of(graph: Graph, owner: NDArray[np.int64]) -> Modes:
    """The estimates' eigenbases, for a graph and the agent that each column belongs to."""
    agents, m = graph.agents, len(owner)
    rates, rest = np.zeros((agents - 1, m)), np.zeros((agents - 1, m))
    vectors = np.zeros((agents - 1, agents, m))
    if agents > 1:
        others = np.array([np.delete(np.arange(agents), j) for j in range(agents)])
        grounded = graph.laplacian[others[:, :, None], others[:, None, :]]
        values, bases = np.linalg.eigh(grounded)
        rates[:] = values[owner].T
        rest[:] = bases.sum(axis=1)[owner].T
        for r, j in enumerate(owner):
            vectors[:, others[j], r] = bases[j].T
    return Modes(owner, rates, rest, vectors)


def _table(rows: tuple[tuple[float, ...], ...]) -> NDArray[np.float64]:
    return np.array([[*row, *[0.0] * (STAGES - len(row))] for row in rows])


class RosenbrockLoop(ClosedLoop):
    """The closed loop of ODE agents under the fully distributed law, with adaptive steps.

    Rows at sample times come from the steps' dense output, so steps do not depend on them, nor on
    how a run is divided into calls. The monitor sees every accepted step's start and every sample.

    Args:
        agent, law, game: the three modules of kernels; the law is the fully distributed one.
        problem: what the law reads.
        channels: the agents' channels.
        graph: who hears whom, the same as in ``problem``.
        h: the shared clock's step in s; a run's k-th step begins at k * h.
        state: (m, states) at the start.
        memory: the law's, at the start.
        rtol: error allowed per step, relative to each state's greatest magnitude so far.
        atol: error allowed per step besides, in the states' own units.
    """

    def __init__(
        self,
        agent: ModuleType,
        law: ModuleType,
        game: ModuleType,
        problem: Problem,
        channels: Channels,
        graph: Graph,
        h: float,
        state: NDArray[np.float64],
        memory: NDArray[np.float64],
        rtol: float = 1e-6,
        atol: float = 1e-9,
    ) -> None:
        self._advance, self._finish = build(agent, law, game)
        self._shape = state.shape
        m = len(state)
        constraints = len(problem.data.member_pointer) - 1
        self._state = np.concatenate([state.ravel(), memory])
        owner = np.repeat(np.arange(graph.agents), np.diff(problem.data.offsets))
        modes = modes_of(graph, owner)
        method = Method(_table(_STAGE), _table(_RATE), _table(_DENSE), rtol, atol)
        self._fixed = (problem, channels, modes, method)
        self._h = h
        self._step = 0
        self._progress = np.zeros(COUNT)
        self._progress[NEXT] = min(h, float(problem.settings[EPSILON]))
        self._u = np.zeros(m)
        self._work = work(m, constraints)
        self._solver = _solver(agent, channels, modes, self._state)
        self.monitor = np.zeros(watch.length(m, constraints))

    @property
    def time(self) -> float:
        """Time of the present state in s: of a run that has ended early, its last step's end."""
        ended = self.monitor[watch.EXIT] != watch.INSIDE
        return float(self._progress[END]) if ended else self._step * self._h

    @property
    def steps(self) -> tuple[int, int]:
        """How many steps have been accepted, and how many rejected."""
        return int(self._progress[ACCEPTED]), int(self._progress[REJECTED])

    def advance(self, samples: int, every: int) -> Samples:
        """See the base class."""
        states, inputs = np.empty((samples, len(self._state))), np.empty((samples, len(self._u)))
        done = 0
        if self.monitor[watch.EXIT] == watch.INSIDE:
            done, self._step = self._advance(
                *self._fixed, self._h, self._step, every, self._progress, self._state, self._u,
                self.monitor, self._work, self._solver, states, inputs,
            )  # fmt: skip
        return self._samples(states[:done], inputs[:done])

    def finish(self) -> Samples:
        """See the base class."""
        row, u = np.empty((1, len(self._state))), np.empty((1, len(self._u)))
        self._finish(
            *self._fixed[:2], self.time, self._progress, self.monitor, self._work, self._solver,
            row[0], u[0],
        )  # fmt: skip
        return self._samples(row, u)

    def _samples(self, states: NDArray[np.float64], inputs: NDArray[np.float64]) -> Samples:
        size = self._shape[0] * self._shape[1]
        return Samples(
            state=states[:, :size].reshape(-1, *self._shape),
            input=inputs,
            memory=states[:, size:],
        )


def _solver(
    agent: ModuleType, channels: Channels, modes: Modes, state: NDArray[np.float64]
) -> Solver:
    m, states = channels.rest.shape
    size, n, agents = m * states, len(state), modes.vectors.shape[1]
    inputs = np.zeros((m, states))
    for r, q in enumerate(channels.parameters):  # the agents are affine in u, with constant G
        with_u, without = np.zeros(states), np.zeros(states)
        agent.rate(q, np.zeros(states), 1.0, with_u)
        agent.rate(q, np.zeros(states), 0.0, without)
        inputs[r] = with_u - without
    estimates = state[size : size + agents * m].reshape(agents, m)
    start = np.einsum("air,ir->ar", modes.vectors, estimates).ravel()
    dense = np.zeros((4, n))
    dense[:2] = state
    return Solver(
        inputs=inputs,
        modes=start,
        trial=np.zeros(n),
        trial_modes=np.zeros_like(start),
        k=np.zeros((STAGES, n)),
        k_modes=np.zeros((STAGES, len(start))),
        dense=dense,
        greatest=np.abs(state[:size]).reshape(m, states).max(axis=0),
        exit=np.zeros(watch.HEADER),
        u=np.zeros(m),
        known=np.zeros_like(start),
        pull=np.zeros_like(start),
        decay=np.zeros_like(start),
        spread=np.zeros(agents * m),
        local=np.zeros((m, states, states)),
        resolvent=np.zeros((m, states, states)),
        small=np.zeros((states, states)),
        small_pivot=np.zeros(states, dtype=np.int64),
        response=np.zeros((m, states)),
        own=np.zeros((m, m)),
        filtered=np.zeros((m, m)),
        matrix=np.zeros((m, m)),
        pivot=np.zeros(m, dtype=np.int64),
        k_x=np.zeros(states),
        k_y=np.zeros(m),
        k_u=np.zeros(m),
    )
