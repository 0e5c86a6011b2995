"""The same law as a module of kernels, at full speed; and exact in mode sampled too.

gne_mj.controllers.law says what each kernel is for. The law's numbers stand behind the package's
own in ``problem.settings``; ``propagator`` hands over what depends on the control period.
"""

import sys

import numpy as np

from gne_mj.barrier import weighted_gradient
from gne_mj.controllers import Law
from gne_mj.controllers.propagation import Propagator
from gne_mj.controllers.settings import COUNT
from gne_mj.native import kernel

DAMPING, TAU, GAINS = COUNT, COUNT + 1, COUNT + 2


class Damped(Law):
    """The law with its numbers."""

    def __init__(self, gains, damping, tau):
        self.gains, self.damping, self.tau = gains, damping, tau

    @property
    def kernels(self):
        """This module."""
        return sys.modules[__name__]

    def settings(self, rho):
        """The package's numbers, then this law's."""
        return np.concatenate([super().settings(rho), [self.damping, self.tau, *self.gains]])

    def initial_memory(self, y, estimate=None, filtered=None):
        """z(0) = y(0)."""
        return y.copy()

    def propagator(self, period):
        """Over a control period z - y shrinks by exp(-period / tau)."""
        decay = np.exp(-period / self.tau)
        return Propagator(np.zeros((0, 0, 0)), np.zeros(0), np.array([decay]))


def law(game, graph, gains, damping, tau):
    """The law of this file."""
    return Damped(gains, damping, tau)


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u; -1, since there is no estimate that could leave the set."""
    data, numbers = problem.data, problem.settings
    at = data.offsets
    for i in range(len(at) - 1):
        for a in range(at[i], at[i + 1]):
            gradient = game.cost_gradient(data.parameters, i, a, y)
            gradient += weighted_gradient(game, data, i, a, y, weights)
            u[a] = -numbers[GAINS + a] * gradient - numbers[DAMPING] * (y[a] - memory[a])
    return -1


@kernel
def rate(problem, y, memory, out):
    """Fill out with z'."""
    for a in range(len(out)):
        out[a] = (y[a] - memory[a]) / problem.settings[TAU]


@kernel
def propagate(problem, y, memory, scratch):
    """Move z over one control period with y held."""
    for a in range(len(memory)):
        memory[a] = y[a] + problem.propagator.numbers[0] * (memory[a] - y[a])


@kernel
def storage(problem, memory):
    """d tau / 2 |z - y*|^2."""
    total = 0.0
    for a in range(len(memory)):
        total += (memory[a] - problem.equilibrium[a]) ** 2
    return 0.5 * problem.settings[DAMPING] * problem.settings[TAU] * total
