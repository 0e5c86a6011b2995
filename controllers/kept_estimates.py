"""Estimates of those actions only that a law keeps: the kernels of :mod:`gne_mj.controllers.kept`.

They do what :mod:`gne_mj.controllers.estimates` does where everyone keeps all.
"""

import numpy as np

from gne_mj.controllers.kept_propagation import propagate_kept
from gne_mj.controllers.settings import LINKS, RATE
from gne_mj.native import kernel


@kernel
def prepare(problem, first, last, y, memory):
    """Put the actions of agents ``first`` to ``last`` - 1 where estimates of them follow."""
    kept, at = problem.kept, problem.data.offsets
    for j in range(first, last):
        begin = kept.place[kept.pointer[j]] - at[j]
        for a in range(at[j], at[j + 1]):
            memory[begin + a] = y[a]


@kernel
def room(kept):
    """Where in the memory there is room for a profile."""
    return kept.place[len(kept.place) - 1]


@kernel
def fill_profile(problem, i, y, memory, profile):
    """Put agent i's own action, and what it takes others' to be, into a profile (m,).

    Of those that it does not keep nothing is put there: costs and own constraints do not read them.
    """
    kept, at = problem.kept, problem.data.offsets
    for a in range(at[i], at[i + 1]):
        profile[a] = y[a]
    for q in range(kept.row_pointer[i], kept.row_pointer[i + 1]):
        profile[kept.action[q]] = memory[kept.entry[q]]


@kernel
def heard(problem, y, memory, i, a):
    """An own action less what those neighbours that keep it take it to be."""
    kept, lost = problem.kept, problem.settings[LINKS] > 0.0
    own, k = kept.pointer[i], a - problem.data.offsets[i]
    total = 0.0
    for q in range(kept.near_pointer[own], kept.near_pointer[own + 1]):
        at = kept.near[q]
        if lost:
            at = int(problem.settings[LINKS]) + kept.came[q]
        total += y[a] - memory[at + k]
    return total


@kernel
def couplings(problem, i):
    """How many neighbours keep agent i's action."""
    kept = problem.kept
    own = kept.pointer[i]
    return kept.near_pointer[own + 1] - kept.near_pointer[own]


@kernel
def kept_rates(problem, y, memory, out):
    """Fill out with -RATE sum_l (e - e_l) for each estimate e, over neighbours' of the same action.

    Own actions must be in place; their entries of out, and those of the room, become zero.
    """
    kept, scale = problem.kept, -problem.settings[RATE]
    for j in range(len(kept.pointer) - 1):
        own = kept.pointer[j]
        for a in range(kept.place[own], kept.place[own + 1]):
            out[a] = 0.0
        for pair in range(own + 1, kept.pointer[j + 1]):
            first, last = kept.near_pointer[pair], kept.near_pointer[pair + 1]
            begin, weight = kept.place[pair], scale * (last - first)
            for k in range(kept.place[pair + 1] - begin):
                total = weight * memory[begin + k]
                for q in range(first, last):
                    total -= scale * memory[kept.near[q] + k]
                out[begin + k] = total
    behind = room(kept)
    for r in range(len(y)):
        out[behind + r] = 0.0


@kernel
def receive(kept, link, sent, came):
    """Fill what came last over a link from all that was kept when it was sent."""
    for q in range(kept.link_pointer[link], kept.link_pointer[link + 1]):
        item = kept.item[q]
        begin, place = kept.came[item], kept.near[item]
        for k in range(kept.came[item + 1] - begin):
            came[begin + k] = sent[place + k]


@kernel
def move_kept(problem, y, memory, scratch):
    """Move the estimates over one control period with the outputs held at y (m,).

    By the exact solution, or, where messages are sent once a period and can be lost, by the exact
    solution of each estimate with what its keeper heard last.
    """
    prepare(problem, 0, len(problem.data.offsets) - 1, y, memory)
    if problem.settings[LINKS] > 0.0:
        _relax(problem, memory)
    else:
        propagate_kept(problem.kept, problem.propagator, memory, scratch)


@kernel
def _relax(problem, memory):
    """Each estimate towards the mean of what its keeper heard last."""
    kept, links = problem.kept, int(problem.settings[LINKS])
    for j in range(len(kept.pointer) - 1):
        for pair in range(kept.pointer[j] + 1, kept.pointer[j + 1]):
            first, last = kept.near_pointer[pair], kept.near_pointer[pair + 1]
            stays = np.exp(-problem.propagator.numbers[1] * (last - first))
            begin = kept.place[pair]
            for k in range(kept.place[pair + 1] - begin):
                mean = 0.0
                for q in range(first, last):
                    mean += memory[links + kept.came[q] + k]
                mean /= last - first
                memory[begin + k] = mean + stays * (memory[begin + k] - mean)


@kernel
def squared_distance(problem, memory):
    """Of all estimates from the equilibrium."""
    kept, at, y = problem.kept, problem.data.offsets, problem.equilibrium
    total = 0.0
    for j in range(len(kept.pointer) - 1):
        for pair in range(kept.pointer[j] + 1, kept.pointer[j + 1]):
            begin = kept.place[pair]
            for k in range(kept.place[pair + 1] - begin):
                total += (memory[begin + k] - y[at[j] + k]) ** 2
    return total
