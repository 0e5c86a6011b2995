"""Partial information with those estimates only that matter: kernels.

:mod:`gne_mj.controllers.partial_information` has the law, and the same kernels for all estimates.
"""

from gne_mj.barrier import weighted_gradient
from gne_mj.controllers.estimates import clear_others
from gne_mj.controllers.kept_estimates import (
    couplings,
    fill_profile,
    heard,
    kept_rates,
    move_kept,
    room,
    squared_distance,
)
from gne_mj.controllers.kept_estimates import prepare as prepare
from gne_mj.controllers.measured import memory_outputs as memory_outputs
from gne_mj.controllers.measured import own_profile as own_profile
from gne_mj.controllers.settings import COUPLING, TIME_CONSTANT
from gne_mj.native import kernel, part


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u (m,) from the true barrier's weights (p,) and what each agent keeps."""
    data, coupling = problem.data, problem.settings[COUPLING]
    at, profile = data.offsets, work.profile
    prepare(problem, 0, len(at) - 1, y, memory)
    for i in range(len(at) - 1):
        fill_profile(problem, i, y, memory, profile)
        for a in range(at[i], at[i + 1]):
            cost = game.cost_gradient(data.parameters, i, a, profile)
            cost += coupling * heard(problem, y, memory, i, a)
            u[a] = -cost - weighted_gradient(game, data, i, a, y, weights)
    return -1


@kernel
def barrier_free(game, problem, i, a, y, memory):
    """What drives entry a of agent i's action besides the barrier, y_i being in place."""
    profile = part(memory, room(problem.kept), len(y))
    fill_profile(problem, i, y, memory, profile)
    cost = game.cost_gradient(problem.data.parameters, i, a, profile)
    return cost + problem.settings[COUPLING] * heard(problem, y, memory, i, a)


@kernel
def add_barrier_free_slope(game, problem, i, a, y, memory, out):
    """Add dpull/dy to out (m,): the estimates stay, so that only own actions count."""
    data, profile = problem.data, part(memory, room(problem.kept), len(y))
    fill_profile(problem, i, y, memory, profile)
    game.add_cost_hessian(data.parameters, i, a, profile, 1.0, out)
    clear_others(data, i, out)
    out[a] += problem.settings[COUPLING] * couplings(problem, i)


@kernel
def rate(problem, y, memory, out):
    """Fill out with the estimates' rates."""
    kept_rates(problem, y, memory, out)


@kernel
def propagate(problem, y, memory, scratch):
    """Move the estimates over one control period with the outputs held at y."""
    move_kept(problem, y, memory, scratch)


@kernel
def storage(problem, memory):
    """tau / 2 times the squared distance of the estimates from the equilibrium."""
    return 0.5 * problem.settings[TIME_CONSTANT] * squared_distance(problem, memory)
