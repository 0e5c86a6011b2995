"""The fully distributed law with those estimates only that matter: kernels.

:mod:`gne_mj.controllers.fully_distributed` has the law, and the same kernels for all estimates. The
memory: what is kept (:mod:`gne_mj.controllers.kept`), the room behind it, then z (m,).
"""

from gne_mj.controllers.estimates import clear_others
from gne_mj.controllers.fully_distributed import add_barrier
from gne_mj.controllers.kept_estimates import (
    fill_profile,
    kept_rates,
    move_kept,
    room,
)
from gne_mj.controllers.kept_estimates import prepare as prepare
from gne_mj.controllers.settings import EPSILON, GAIN
from gne_mj.native import copy, kernel, part


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u (m,); -1, or agent * p + constraint of the first estimate that is not inside.

    See :func:`gne_mj.controllers.fully_distributed.action`.
    """
    data, gain = problem.data, problem.settings[GAIN]
    at, profile, behind = data.offsets, work.profile, room(problem.kept)
    z = part(memory, behind + len(y), len(y))
    prepare(problem, 0, len(at) - 1, y, memory)
    found = -1
    for i in range(len(at) - 1):
        fill_profile(problem, i, y, memory, profile)
        for a in range(at[i], at[i + 1]):
            u[a] = game.cost_gradient(data.parameters, i, a, profile)
        for a in range(at[i], at[i + 1]):
            profile[a] = z[a]
        outside = add_barrier(game, data, i, work.now.penalty, profile, u[at[i] : at[i + 1]])
        if outside >= 0:
            found = i * len(weights) + outside
            break
    for r in range(len(u)):
        u[r] *= -gain
    return found


@kernel
def barrier_free(game, problem, i, a, y, memory):
    """What drives entry a of agent i's action besides the barrier, y_i being in place."""
    profile = part(memory, room(problem.kept), len(y))
    fill_profile(problem, i, y, memory, profile)
    return problem.settings[GAIN] * game.cost_gradient(problem.data.parameters, i, a, profile)


@kernel
def add_barrier_free_slope(game, problem, i, a, y, memory, out):
    """Add dpull/dy to out (m,): the estimates stay, so that only own actions count."""
    data, gain = problem.data, problem.settings[GAIN]
    profile = part(memory, room(problem.kept), len(y))
    fill_profile(problem, i, y, memory, profile)
    game.add_cost_hessian(data.parameters, i, a, profile, gain, out)
    clear_others(data, i, out)


@kernel
def own_profile(problem, i, y, memory, profile):
    """Fill profile (m,) with what agent i's barrier reads: what it keeps, and where z_i will be.

    Returns by how much that moves with the action it is held at.
    """
    at, stays = problem.data.offsets, problem.propagator.numbers[2]
    z = part(memory, room(problem.kept) + len(y), len(y))
    fill_profile(problem, i, y, memory, profile)
    for r in range(at[i], at[i + 1]):
        profile[r] = y[r] + stays * (z[r] - y[r])
    return 1.0 - stays


@kernel
def memory_outputs(prediction, held):
    """In mode implicit the memory moves with the outputs of the period's end, as solved for."""
    copy(prediction, held)


@kernel
def rate(problem, y, memory, out):
    """Fill out with the rates of estimates and z."""
    faster, m = 1.0 / problem.settings[EPSILON], len(y)
    begin = room(problem.kept) + m
    kept_rates(problem, y, memory, out)
    for r in range(m):
        out[begin + r] = faster * (y[r] - memory[begin + r])


@kernel
def propagate(problem, y, memory, scratch):
    """Move estimates and z over one control period with the outputs held at y."""
    move_kept(problem, y, memory, scratch)
    remaining = problem.propagator.numbers[2]
    z = part(memory, room(problem.kept) + len(y), len(y))
    for r in range(len(y)):
        z[r] = y[r] + remaining * (z[r] - y[r])


@kernel
def storage(problem, memory):
    """Nothing is claimed of the estimates."""
    return 0.0
