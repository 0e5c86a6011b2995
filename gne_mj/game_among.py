"""A game among some of its agents: those that are away act by numbers that are given for them.

The costs of those present stay, with the action of every agent that is away in its place. So F is
that of the game with entries held, dF/dy a principal block of the game's, and whatever is known of
the whole dF/dy, such as mu and the thetas, holds of the block too. Constraints that only those
present are in stay; others are gone, but those that are named to go on with the actions of those
that are away.

The kernels here put a profile (m',) of those present into one of all (m,) and call the game's own
functions. Parameters q = [addresses of these (6), m, length of the game's own, N', m', p', address
of a profile and a row (m each), agents (N'), actions (m'), constraints (p'), the game's own].
Profile and row are written, so that such a game is for one thread at a time.
"""

import ctypes
import sys
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.equality import Equality
from gne_mj.errors import InvalidInput
from gne_mj.game_model import Box, Game
from gne_mj.native import address_in, call_integer, call_number, kernel, kernel_as
from gne_mj.parameter_block import exact, floats_at

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

MOST_ACTIONS = 255  # of the whole game: every evaluation copies a profile
COST, GRADIENT, ROW, CONSTRAINT, SLOPE, CURVATURE, LENGTH, OWN, AGENTS, ACTIONS, COUNT = range(11)
SCRATCH, HEADER = 11, 12


@dataclass(frozen=True, eq=False)
class Among:
    """A game among some of its agents, and who and what of the whole game is there.

    Attributes:
        game: among them; names of agents' constraints are the whole game's.
        agents: (N',) of the whole game, from 0.
        actions: (m',)
        constraints: (p',)
    """

    game: Game
    agents: Indices
    actions: Indices
    constraints: Indices


def game_among(game: Game, there: NDArray[np.bool_], away: Array, keeps: Collection[str]) -> Among:
    """The game among those that are there.

    Args:
        game: of all, which stands still.
        there: (N,) who is.
        away: (m,) actions of the others in costs, and in the constraints that go on.
        keeps: names of constraints that go on without some of their agents.

    Raises:
        InvalidInput: nobody is there, or no constraint is left.
    """
    agents = np.flatnonzero(there)
    actions = np.flatnonzero(there[game.agent_of_action])
    kept = np.array([_goes_on(game, k, there, keeps) for k in range(game.constraints_count)])
    constraints = np.flatnonzero(kept)
    if not len(agents) or not len(constraints):
        what = "an agent" if not len(agents) else "a constraint of theirs alone"
        raise InvalidInput(
            "membership", f"agents {(agents + 1).tolist()} are left", f"{what} must be left"
        )
    written = np.concatenate([away, np.zeros(game.actions)])
    found = Game(
        name=game.name,
        kernels=sys.modules[__name__],
        parameters=_parameters(game, (agents, actions, constraints), written),
        sizes=tuple(game.sizes[i] for i in agents),
        in_cost=_lists([game.in_cost[i] for i in agents.tolist()], agents),
        in_constraint=_lists([game.in_constraint[k] for k in constraints.tolist()], agents),
        owners=None
        if game.owners is None
        else _lists([game.owned_by[k] for k in constraints.tolist()], agents),
        constraint_names=tuple(game.constraint_names[k] for k in constraints),
        tightening=None if game.tightening is None else game.margins[constraints],
        equalities=_equalities(game, (actions, constraints), away),
        **_declared(game, (agents, actions, constraints), away, kept),
    )
    object.__setattr__(found, "known_by_address", (game, written))
    return Among(found, agents, actions, constraints)


def _goes_on(game: Game, k: int, there: NDArray[np.bool_], keeps: Collection[str]) -> bool:
    owned = any(there[i] for i in game.owned_by[k])
    whole = all(there[i] for i in game.in_constraint[k])
    return owned and (whole or game.constraint_names[k] in keeps)


def _lists(rows: Sequence[Sequence[int]], agents: Indices) -> list[list[int]]:
    """Lists of agents with the numbers that they have among those present."""
    number = {int(agent): k for k, agent in enumerate(agents)}
    return [[number[int(i)] for i in row if int(i) in number] for row in rows]


def _placed(away: Array, actions: Indices, y: Array) -> Array:
    """Whole profiles (..., m) of those (..., m') of the agents present."""
    whole = np.broadcast_to(away, (*y.shape[:-1], len(away))).copy()
    whole[..., actions] = y
    return whole


def _equalities(game: Game, which: tuple[Indices, Indices], away: Array) -> tuple[Equality, ...]:
    """Those whose bands go on."""
    actions, constraints = which
    number = {int(k): at for at, k in enumerate(constraints)}

    def error_of(each: Equality) -> Callable[[Array], Array]:
        return lambda y: each.error(_placed(away, actions, y))

    return tuple(
        replace(each, constraint=number[each.constraint], error=error_of(each))
        for each in game.equalities
        if each.constraint in number
    )


def _parameters(game: Game, which: tuple[Indices, Indices, Indices], written: Array) -> Array:
    own, m = game.data.parameters, game.actions
    address = exact(written.ctypes.data)
    parts = [[*game.data.functions[:LENGTH], m, len(own), *map(len, which), address], *which, own]
    return np.concatenate([np.asarray(part, dtype=np.float64) for part in parts])


def _declared(
    game: Game,
    which: tuple[Indices, Indices, Indices],
    away: Array,
    kept: NDArray[np.bool_],
) -> dict[str, Any]:
    """What is known of the game that is known of it among these agents too."""
    agents, actions, constraints = which
    # a gap to somebody who is away adds a number to its square
    members = [game.in_constraint[k] for k in constraints.tolist()]
    held = game.gap_bounds is not None and any(set(row) - set(agents.tolist()) for row in members)
    gaps = None if game.gap_bounds is None or held else game.gap_bounds[constraints]
    block = np.ix_(actions, actions)
    bounded = _within(game, agents, away, kept)

    def jacobian_bounds(box: Box) -> Box:
        assert game.jacobian_bounds is not None
        lower, upper = game.jacobian_bounds(
            (_placed(away, actions, box[0]), _placed(away, actions, box[1]))
        )
        return lower[block], upper[block]

    box, feasible = game.box, game.feasible_jacobian_bounds
    return {
        **{
            key: getattr(game, key)
            for key in (
                "action_name", "action_unit", "affine", "row_scaled", "agent_name", "axes",
                "smooth", "tested",
            )
        },
        "box": None if box is None or not bounded else (box[0][actions], box[1][actions]),
        "jacobian_bounds": None if game.jacobian_bounds is None else jacobian_bounds,
        "feasible_jacobian_bounds": None
        if feasible is None or not bounded
        else (feasible[0][block], feasible[1][block]),
        "gap_bounds": gaps,
        "affine_constraints": None
        if game.affine_constraints is None or gaps is None
        else 2 * len(constraints),
        "constraint_class": game.constraint_class or ("quadratic" if held else None),
    }  # fmt: skip


def _within(game: Game, agents: Indices, away: Array, kept: NDArray[np.bool_]) -> bool:
    """Whether profiles among these agents that are feasible are so in the whole game, with the
    others' actions: what is gone is of the others alone, and holds of their actions."""
    gone = np.flatnonzero(~kept).tolist()
    if any(set(game.in_constraint[k]) & set(agents.tolist()) for k in gone):
        return False
    return bool(np.all(game.constraints(away)[gone] <= 0.0))


@kernel
def _write(address, k, value):
    floats_at(address, k + 1)[k] = value


@kernel
def _read(address, k):
    return floats_at(address, k + 1)[k]


def _write_in_python(address: int, k: int, value: float) -> None:
    ctypes.c_double.from_address(address + 8 * k).value = value


def _read_in_python(address: int, k: int) -> float:
    return ctypes.c_double.from_address(address + 8 * k).value


write, read = kernel_as(_write, _write_in_python), kernel_as(_read, _read_in_python)


@kernel
def put(q, y):
    """Put the present agents' actions into the profile; the address of that."""
    profile = int(q[SCRATCH])
    for r in range(len(y)):
        write(profile, action(q, r), y[r])
    return profile


@kernel
def own(q):
    """The address of the game's own parameters."""
    lists = int(q[AGENTS]) + int(q[ACTIONS]) + int(q[COUNT])
    return address_in(q) + 8 * (HEADER + lists)


@kernel
def agent(q, i):
    """An agent's number in the whole game."""
    return int(q[HEADER + i])


@kernel
def action(q, a):
    """An action's."""
    return int(q[HEADER + int(q[AGENTS]) + a])


@kernel
def shared(q, k):
    """A constraint's."""
    return int(q[HEADER + int(q[AGENTS]) + int(q[ACTIONS]) + k])


@kernel
def cost(q, i, y):
    """J_i with those that are away in their places."""
    m, profile = int(q[LENGTH]), put(q, y)
    return call_number(int(q[COST]), (own(q), int(q[OWN]), agent(q, i), 0, 0, profile, m))


@kernel
def cost_gradient(q, i, a, y):
    """dJ_i/dy_a there."""
    m, profile = int(q[LENGTH]), put(q, y)
    given = (own(q), int(q[OWN]), agent(q, i), action(q, a), 0, profile, m)
    return call_number(int(q[GRADIENT]), given)


@kernel
def add_cost_hessian(q, i, a, y, scale, out):
    """The present agents' entries of the whole game's row."""
    m, profile = int(q[LENGTH]), put(q, y)
    row = profile + 8 * m
    for r in range(m):
        write(row, r, 0.0)
    given = (own(q), int(q[OWN]), agent(q, i), action(q, a), profile, m, scale, row)
    call_integer(int(q[ROW]), given)
    for b in range(len(y)):
        out[b] += read(row, action(q, b))


@kernel
def constraint(q, k, y):
    """g_k there."""
    m, profile = int(q[LENGTH]), put(q, y)
    return call_number(int(q[CONSTRAINT]), (own(q), int(q[OWN]), shared(q, k), 0, 0, profile, m))


@kernel
def constraint_gradient(q, k, a, y):
    """dg_k/dy_a there."""
    m, profile = int(q[LENGTH]), put(q, y)
    given = (own(q), int(q[OWN]), shared(q, k), action(q, a), 0, profile, m)
    return call_number(int(q[SLOPE]), given)


@kernel
def constraint_hessian(q, k, a, b, y):
    """d2g_k/dy_a dy_b there."""
    m, profile = int(q[LENGTH]), put(q, y)
    given = (own(q), int(q[OWN]), shared(q, k), action(q, a), action(q, b), profile, m)
    return call_number(int(q[CURVATURE]), given)
