"""Who depends on whom: `in_cost` and `in_constraint` against the functions.

Native loops read nobody else, and certificates rest on it.
"""

import numpy as np
from numpy.typing import NDArray

from gne_mj.game_check.derivatives import chosen
from gne_mj.game_check.functions import Functions, shown_profile
from gne_mj.game_check.report import Comparison

Array = NDArray[np.float64]
Entries = NDArray[np.int64]

# A change that is smaller than this, relative to the values, is taken for rounding
_ROUNDING = 1e-8


def costs(f: Functions, y: Array, rng: np.random.Generator, most: int,
          into: Comparison) -> None:  # fmt: skip
    """No J_i and none of its derivatives by y_i changes with an agent that in_cost[i] leaves out.

    And add_cost_hessian adds scale times the derivative, and touches no such agent's entries.
    """
    game = f.game
    for i in chosen(rng, game.agents, most):
        others = f.actions_of(set(range(game.agents)) - {i, *game.in_cost[i]})
        own = [int(a) for a in f.actions_of([i])]
        if game.has_cost_hessian:
            _adding(f, i, own, others, y, rng, into)
        ways = _moved(f, y, others, rng)
        for function, value in [
            ("cost", lambda at, i=i: f.cost(i, at)),
            *(("cost_gradient", lambda at, i=i, a=a: f.slope(i, a, at)) for a in own),
        ]:
            here = value(y)
            for there in ways:
                if not _same(into, here, value(there), _sensitivity(f, i, own, y, there)):
                    into.difference = (
                        "game.in_cost",
                        [j + 1 for j in game.in_cost[i]],
                        f"{function} of agent {i + 1} depends on {_whom(f, value, y, there)}, which"
                        f" its list of agents (numbered from 1 here) leaves out, at y ="
                        f" {shown_profile(y)}",
                    )


def constraints(f: Functions, y: Array, rng: np.random.Generator, most: int,
                into: Comparison) -> None:  # fmt: skip
    """No g_l changes with an agent that in_constraint[l] leaves out."""
    game = f.game
    for k in chosen(rng, game.constraints_count, most):
        others = f.actions_of(set(range(game.agents)) - set(game.in_constraint[k]))
        here = f.constraint(k, y)
        for there in _moved(f, y, others, rng):
            if not _same(into, here, f.constraint(k, there), 0.0):
                whom = _whom(f, lambda at, k=k: f.constraint(k, at), y, there)
                into.difference = (
                    "game.in_constraint",
                    [j + 1 for j in game.in_constraint[k]],
                    f"constraint '{game.constraint_names[k]}' depends on {whom}, which its list of"
                    f" agents (numbered from 1 here) leaves out, at y = {shown_profile(y)}",
                )


def _moved(f: Functions, y: Array, entries: Entries, rng: np.random.Generator) -> list[Array]:
    """Two profiles inside that differ from y in these entries only."""
    direction = np.zeros_like(y)
    direction[entries] = rng.uniform(0.5, 1.0, len(entries)) * rng.choice([-1.0, 1.0], len(entries))
    length = f.reach(y, direction) if len(entries) else 0.0
    return [y + length * direction, y - length * direction] if length > 0.0 else []


def _sensitivity(f: Functions, i: int, own: list[int], y: Array, there: Array) -> float:
    """How much J_i would change if agent i moved as far."""
    return float(np.max(np.abs(there - y))) * max(abs(f.slope(i, a, y)) for a in own)


def _same(into: Comparison, here: float, there: float, size: float) -> bool:
    size = max(size, abs(here), abs(there))
    return not into.add(abs(there - here), size, _ROUNDING * size)


def _whom(f: Functions, value: object, y: Array, there: Array) -> str:
    """Which agents a function's value changes with, each moved alone as far as it may be."""
    owner = f.game.agent_of_action
    found = []
    for j in range(f.game.agents):
        moved = np.where((owner == j) & (there != y), there, y)
        if np.any(moved != y) and f.inside([moved]):
            change = value(moved) - value(y)  # type: ignore[operator]
            if change != 0.0:
                found.append((-abs(change), j + 1))
    names = [str(j) for _, j in sorted(found)[:5]]
    return f"agent{'s' * (len(names) > 1)} {', '.join(names)}" if names else "agents"


def _adding(
    f: Functions, i: int, own: list[int], others: Entries, y: Array, rng: np.random.Generator,
    into: Comparison,
) -> None:  # fmt: skip
    for a in own:
        row = f.row(i, a, y)
        touched = others[row[others] != 0.0]
        into.count += 1
        if len(touched):
            j = int(f.game.agent_of_action[touched[0]]) + 1
            into.difference = (
                "game.in_cost",
                [n + 1 for n in f.game.in_cost[i]],
                f"add_cost_hessian of agent {i + 1} touches the entries of agent {j}, which the"
                " list (of agents numbered from 1 here) leaves out",
            )
        before = rng.uniform(0.5, 1.0, len(y)) * max(1.0, float(np.max(np.abs(row))))
        out = before.copy()
        f.add_row(i, a, y, 2.0, out)
        wanted = before + 2.0 * row
        if np.max(np.abs(out - wanted)) > _ROUNDING * np.max(np.abs(wanted)):
            b = int(np.argmax(np.abs(out - wanted)))
            into.difference = (
                "game.add_cost_hessian",
                float(f"{out[b]:.7g}"),
                f"for agent {i + 1} it must add scale times the derivative to what out holds, which"
                f" makes {wanted[b]:.7g}",
            )
