"""The linear systems of a Rosenbrock step of the fully distributed loop, solved by structure.

With s = 1 / (GAMMA h), each stage solves (s I - J) k = r, with J the loop's Jacobian at the start
of the step. The loop's flat vector holds the channels' states x, the estimates (N m), z (m), and
behind them the estimates' modes.

- In the modes (see :mod:`gne_mj.loops.estimate_modes`) the estimates' equation is diagonal:
  k_w = (epsilon r_w + lambda Q'1 k_y) / (epsilon s + lambda). In the agents' own coordinates that
  is k_e = p + T k_y, p known.
- z likewise: k_z = (epsilon r_z + k_y) / (epsilon s + 1).
- A channel x' = f(x) + G u answers by itself: k_x = (s I - A)^-1 (r_x + G k_u), A = df/dx.
- The law ties them: k_u = U_y k_y + U_z k_z + U_e k_e. Put together, one system of m equations
  remains for k_u, and it alone is factorised.
"""

from typing import Annotated, NamedTuple

import numpy as np

from gne_mj import banded
from gne_mj import game_functions as games
from gne_mj.controllers.settings import EPSILON, GAIN, RHO
from gne_mj.game_model import GameData
from gne_mj.linear import add_multiples
from gne_mj.loops.estimate_modes import Modes, from_modes
from gne_mj.loops.feedback import Problem
from gne_mj.loops.rodas import GAMMA, STAGES, Method
from gne_mj.native import copy, kernel, shaped
from gne_mj.plants import functions
from gne_mj.plants.ode import Channels
from gne_mj.records import fresh


class StageSystem(NamedTuple):
    """Arrays of the systems of one step."""

    inputs: Annotated[np.ndarray, "m, states"]  # G, read-only
    local: Annotated[np.ndarray, "m, states, states"]  # A
    # (s I - A)^-1 by columns, that is transposed
    resolvent: Annotated[np.ndarray, "m, states, states"]
    response: Annotated[np.ndarray, "m, states"]  # (s I - A)^-1 G
    # s I - A of one channel, factorised; as gne_mj.banded has a dense matrix
    small: Annotated[np.ndarray, "states, 3 * states - 2"]
    small_pivot: Annotated[np.ndarray, "states", int]
    own: Annotated[np.ndarray, "m, m"]  # du/dy and, off the agents' own blocks, du/d estimate
    filtered: Annotated[np.ndarray, "m, m"]  # du/dz
    decay: Annotated[np.ndarray, "N - 1, m"]  # 1 / (epsilon s + lambda)
    mode_response: Annotated[np.ndarray, "N - 1, m"]  # what a k_y of 1 adds to k_w
    spread: Annotated[np.ndarray, "N, m"]  # T: what a k_y of 1 adds to k_e
    # what k_y adds to k_u, directly and through z and the estimates
    slope: Annotated[np.ndarray, "m, m"]
    matrix: Annotated[np.ndarray, "m, 3 * m - 2"]  # of the system for k_u, likewise
    pivot: Annotated[np.ndarray, "m", int]
    k_x: Annotated[np.ndarray, "states"]  # one channel's
    k_y: Annotated[np.ndarray, "m"]
    k_u: Annotated[np.ndarray, "m"]
    scales: Annotated[np.ndarray, "stages"]  # of earlier stages in this one
    # the actions in one constraint after the other, and where each one's begin; read-only
    start: Annotated[np.ndarray, "n", int]
    column: Annotated[np.ndarray, "n", int]
    # whether it may have second derivatives; read-only
    curved: Annotated[np.ndarray, "n", int]
    jacobian: Annotated[np.ndarray, "n"]  # its first ones, by those actions
    known: Annotated[np.ndarray, "m"]  # what V and the rates share, see gne_mj.plants.functions


class Fixed(NamedTuple):
    """What does not change in a run."""

    problem: Problem
    channels: Channels
    modes: Modes
    method: Method


def stage_system(inputs: np.ndarray, data: GameData, affine: bool) -> StageSystem:
    """Fresh arrays; inputs (m, states) is G, and ``affine`` says that all constraints are."""
    m, states = inputs.shape
    sizes = np.diff(data.offsets)[data.member_index]
    start = np.concatenate([[0], np.cumsum(sizes)])[data.member_pointer]
    first = data.offsets[data.member_index]
    column = np.repeat(first - np.cumsum(sizes) + sizes, sizes) + np.arange(sizes.sum())
    made: StageSystem = fresh(
        StageSystem, m=m, states=states, N=len(data.everyone), n=len(column), stages=STAGES
    )
    curved = np.full(len(data.all_constraints), int(not affine))
    return made._replace(inputs=inputs, start=start, column=column, curved=curved)


@kernel
def linearise(fixed, state, u, work, system):
    """Fill the law's and the channels' derivatives at a state.

    Args:
        fixed: of the loop.
        state: the loop's flat vector.
        u: (m,) input there; work.y and work.commanded as the law has just left them.
        work: scratch arrays.
        system: its local, own and filtered are filled.
    """
    problem, channels = fixed.problem, fixed.channels
    data, states = problem.data, channels.equilibrium_state.shape[1]
    at = data.offsets
    m, agents = len(u), len(at) - 1
    gain, rho = problem.settings[GAIN], problem.settings[RHO]
    memory = state[m * states :]
    z, profile = memory[agents * m :], work.profile
    own, filtered = system.own, system.filtered
    functions.jacobians(channels, state, system.local)
    for r in range(m):
        for c in range(m):
            own[r, c] = 0.0
            filtered[r, c] = 0.0
    for i in range(agents):
        first, last = at[i], at[i + 1]
        copy(memory[i * m : (i + 1) * m], profile)
        copy(work.y[first:last], profile[first:last])
        for a in range(first, last):
            games.add_cost_hessian(data, i, a, profile, -gain, own[a])
        swap_own(first, last, system)  # what is added to them from now on belongs to z
        copy(z[first:last], profile[first:last])
        for entry in range(data.own_pointer[i], data.own_pointer[i + 1]):
            k = data.own_index[entry]
            slack = -games.constraint(data, k, profile) - data.tightening[k]
            add_barrier_rows(data, i, k, slack, -gain * rho / slack, profile, system)
        swap_own(first, last, system)
    for r in range(m):
        if u[r] != work.commanded[r]:  # an input at its limit does not answer
            for c in range(m):
                own[r, c] = 0.0
                filtered[r, c] = 0.0


@kernel
def swap_own(first, last, system):
    """Swap an agent's own blocks of du/dy and du/dz."""
    for a in range(first, last):
        for b in range(first, last):
            held = system.own[a, b]
            system.own[a, b] = system.filtered[a, b]
            system.filtered[a, b] = held


@kernel
def add_barrier_rows(data, i, k, slack, weight, profile, system):
    """Add what constraint k's barrier answers at agent i's actions to each of its members."""
    start, column, slopes = system.start[k : k + 2], system.column, system.jacobian
    games.slopes(data, data.all_constraints[k : k + 1], start, column, profile, slopes)
    for entry in range(start[0], start[1]):
        a = column[entry]
        if data.owner[a] != i:
            continue
        mine, row = slopes[entry] / slack, system.own[a]
        for other in range(start[0], start[1]):
            b = column[other]
            slope = mine * slopes[other]
            if system.curved[k] != 0:
                slope += games.constraint_hessian(data, k, a, b, profile)
            row[b] += weight * slope


@kernel
def prepare(fixed, h, system):
    """Factorise for steps of length h from where the loop was linearised; False if singular."""
    channels, modes = fixed.channels, fixed.modes
    agents, m = system.spread.shape
    epsilon, states = fixed.problem.settings[EPSILON], channels.equilibrium_state.shape[1]
    s = 1.0 / (GAMMA * h)
    for a in range(agents - 1):
        for r in range(m):
            system.decay[a, r] = 1.0 / (epsilon * s + modes.rates[a, r])
            system.mode_response[a, r] = modes.rates[a, r] * modes.rest[a, r] * system.decay[a, r]
    from_modes(modes.vectors, system.mode_response, system.spread)
    for r in range(m):
        if not respond(system, r, states, s):
            return False
    add_up(fixed, 1.0 / (epsilon * s + 1.0), system)
    return banded.factorise(system.matrix, m, m - 1, system.pivot)


@kernel
def add_up(fixed, filter_gain, system):
    """Fill what k_y adds to k_u, and the matrix of the system for k_u."""
    at, output, m = fixed.problem.data.offsets, fixed.channels.output, len(system.k_u)
    for r in range(m):
        system.k_y[r] = system.response[r, output]
    for i in range(len(at) - 1):
        spread = system.spread[i]
        for r in range(at[i], at[i + 1]):
            own, slope = system.own[r], system.slope[r]
            row = system.matrix[r, m - 1 - r : 2 * m - 1 - r]
            for c in range(m):
                slope[c] = own[c] * spread[c]
            for c in range(at[i], at[i + 1]):
                slope[c] = own[c] + filter_gain * system.filtered[r, c]
            for c in range(m):
                row[c] = -slope[c] * system.k_y[c]
            row[r] += 1.0


@kernel
def respond(system, r, states, s):
    """Fill channel r's resolvent and response; False if s is an eigenvalue of its A."""
    small = system.small
    for a in range(states):
        system.response[r, a] = 0.0
        for b in range(states):
            small[a, b - a + states - 1] = -system.local[r, a, b]
        small[a, states - 1] += s
    if not banded.factorise(small, states, states - 1, system.small_pivot):
        return False
    for b in range(states):
        column = system.resolvent[r, b]
        for a in range(states):
            column[a] = 0.0
        column[b] = 1.0
        banded.solve(small, states, states - 1, system.small_pivot, column)
        for a in range(states):
            system.response[r, a] += system.inputs[r, b] * column[a]
    return True


@kernel
def solve_stage(fixed, h, stage, trial, u, k, system):
    """Fill k[stage], given the stages before it.

    Args:
        fixed: of the loop.
        h: the step.
        stage: which, from 0.
        trial: the flat vector at which the stage is taken.
        u: (m,) input there.
        k: (STAGES, length of the flat vector).
        system: prepared for h.
    """
    channels, modes = fixed.channels, fixed.modes
    at, m = fixed.problem.data.offsets, len(u)
    filter_gain = 1.0 / (fixed.problem.settings[EPSILON] * (1.0 / (GAMMA * h)) + 1.0)
    now, k_y, k_u = parts_of(k[stage], fixed), system.k_y, system.k_u
    right_hand_sides(fixed, h, stage, trial, u, k, system)
    without_input(channels.output, modes, filter_gain, now, system)
    # what these leave over is for k_u
    for r in range(m):
        i = modes.owner[r]
        total = 0.0
        for c in range(m):
            total += system.own[r, c] * now.e[i, c] + system.slope[r, c] * k_y[c]
        for c in range(at[i], at[i + 1]):
            total += system.filtered[r, c] * now.z[c]
        k_u[r] = total
    banded.solve(system.matrix, m, m - 1, system.pivot, k_u)
    add_input(channels.output, filter_gain, now, system)


class VectorParts(NamedTuple):
    """A flat vector of the loop by its parts."""

    x: np.ndarray  # (m, states) of the agents
    e: np.ndarray  # (N, m) estimates
    z: np.ndarray  # (m,) filtered actions
    w: np.ndarray  # (N - 1, m) the estimates' modes


@kernel
def parts_of(vector, fixed):
    """Views into a flat vector."""
    m, states = fixed.channels.equilibrium_state.shape
    agents = len(fixed.problem.data.offsets) - 1
    size = m * states
    at_z = size + agents * m
    return VectorParts(
        shaped(vector[:size], (m, states)),
        shaped(vector[size:at_z], (agents, m)),
        vector[at_z : at_z + m],
        shaped(vector[at_z + m :], (agents - 1, m)),
    )


@kernel
def right_hand_sides(fixed, h, stage, trial, u, k, system):
    """Fill k[stage] with the stage's right-hand sides, those of z and the modes times epsilon."""
    channels, modes, method, k_y = fixed.channels, fixed.modes, fixed.method, system.k_y
    epsilon, one = fixed.problem.settings[EPSILON], k[stage]
    at, now = parts_of(trial, fixed), parts_of(one, fixed)
    functions.rates(channels, 1, trial, u, system.known, one)
    for r in range(len(u)):
        k_y[r] = at.x[r, channels.output]
        now.z[r] = k_y[r] - at.z[r]
    for a in range(len(now.w)):
        for r in range(len(u)):
            now.w[a, r] = modes.rates[a, r] * (modes.rest[a, r] * k_y[r] - at.w[a, r])
    size = now.x.size
    at_z = size + now.e.size
    for j in range(stage):
        system.scales[j] = method.rate[stage, j] / h
    add_multiples(system.scales, stage, k, 0, one[:size])
    for j in range(stage):
        system.scales[j] *= epsilon
    add_multiples(system.scales, stage, k, at_z, one[at_z:])


@kernel
def without_input(output, modes, filter_gain, now, system):
    """Solve for k_u = 0 in x, and for k_y = 0 in z, the modes and the estimates."""
    m, states = now.x.shape
    for r in range(m):
        for a in range(states):
            total = 0.0
            for b in range(states):
                total += system.resolvent[r, b, a] * now.x[r, b]
            system.k_x[a] = total
        copy(system.k_x, now.x[r])
        system.k_y[r] = now.x[r, output]
        now.z[r] *= filter_gain
    size = now.w.size
    w, decay = shaped(now.w, (size,)), shaped(system.decay, (size,))
    for r in range(len(w)):
        w[r] *= decay[r]
    from_modes(modes.vectors, now.w, now.e)


@kernel
def add_input(output, filter_gain, now, system):
    """Add what k_u, and with it k_y, does."""
    m, states = now.x.shape
    k_y, k_u = system.k_y, system.k_u
    for r in range(m):
        for a in range(states):
            now.x[r, a] += k_u[r] * system.response[r, a]
        k_y[r] = now.x[r, output]
        now.z[r] += filter_gain * k_y[r]
    for i in range(len(now.e)):
        for r in range(m):
            now.e[i, r] += system.spread[i, r] * k_y[r]
    for a in range(len(now.w)):
        for r in range(m):
            now.w[a, r] += system.mode_response[a, r] * k_y[r]
