"""What the bound of epsilon needs to know of a loop of linear agents and affine constraints."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gne_mj.game_model import Game
from gne_mj.graph import Graph
from gne_mj.plants.agent_type import energy_balance
from gne_mj.system import System

Array = NDArray[np.float64]

# Estimates up to which matrices of so many rows are made
MOST = 400


@dataclass(frozen=True, eq=False)
class LinearLoop:
    """The fully distributed loop about y*, with e = x - x* and y_a' = f_a'e + u_a.

    Attributes:
        game, graph: the game, and over which agents communicate.
        gain, rho: k and the penalty.
        action: y* (m,).
        storage: P (m, s, s), V = e'Pe/2.
        dissipation: D (m, s, s), V' = -e'De + e_y'u.
        drift: f (m, s).
        output: which state is the action.
        slopes: A (p, m), the gradients of the constraints; of bounds on gaps of one entry those of
            2 p affine ones, delta - gap >= 0 of all, then delta + gap >= 0, with the same barrier.
        slack: of the constraints at y*, tightening subtracted, (p,), and ``start_slack`` at y(0).
        start: W of the start with weight omega on V_fast, as a pair (V, V_fast).
        offset: how far estimates (N, m) are from the actions at the start, z on own entries.
    """

    game: Game
    graph: Graph
    gain: float
    rho: float
    action: Array
    storage: Array
    dissipation: Array
    drift: Array
    output: int
    slopes: Array
    slack: Array
    start_slack: Array
    start: tuple[float, float]
    offset: Array

    @property
    def owner(self) -> NDArray[np.int64]:
        """Whose each entry is, (m,)."""
        return self.game.agent_of_action

    @property
    def room(self) -> Array:
        """q (m,): |e_y|^2 <= 2 q V of each action."""
        inverse = np.linalg.inv(self.storage)
        return np.asarray(inverse[:, self.output, self.output], dtype=np.float64)

    @property
    def drifts(self) -> tuple[Array, Array]:
        """b and p, each (m,): f'e = b e_y + r with e_y^2 / q + r^2 / p <= 2 V of each channel."""
        inverse = np.linalg.inv(self.storage)
        turned = np.einsum("mst,mt->ms", inverse, self.drift)
        along = turned[:, self.output] / self.room
        whole = np.einsum("ms,ms->m", self.drift, turned)
        return along, np.maximum(whole - along**2 * self.room, 0.0)

    def jacobian_bounds(self, lower: Array, upper: Array) -> tuple[Array, Array] | None:
        """Two matrices (m, m) between whose rows those of dF/dy lie over a box, the shorter first;
        None if the game bounds none, or an entry can change its sign."""
        if self.game.affine:
            slope = self.game.pseudo_gradient_jacobian(self.action)
            return slope, slope
        assert self.game.jacobian_bounds is not None
        least, most = self.game.jacobian_bounds((lower, upper))
        if not np.all(np.isfinite(least) & np.isfinite(most) & (least * most >= 0.0)):
            return None
        falling = np.abs(least) > np.abs(most)
        return np.where(falling, most, least), np.where(falling, least, most)


def why_not(system: System) -> str | None:
    """Why no bound of epsilon is computed; None if one can be."""
    kind, game = system.agents.kind, system.game
    if not getattr(kind, "LINEAR", False):
        return f"{kind.NAME}s are not linear with a known quadratic V that decays in all states"
    if game.constraint_class != "affine" and game.affine_constraints is None:
        return "neither are the constraints affine, nor bounds on gaps of one entry"
    if not game.affine and not (game.row_scaled and game.jacobian_bounds is not None):
        return "F is neither affine, nor are its rows known to change in length only"
    if system.law.graph is not None and system.law.graph.changes:
        return "the graph changes"
    if system.law.kept is not None:
        return "agents keep only some of the estimates"
    if system.known_equilibrium is None:
        return "y* was not found"
    if game.agents * game.actions > MOST:
        return f"there are more than {MOST} estimates"
    return None


def linear_loop(system: System) -> LinearLoop:
    """The loop of a system that :func:`why_not` does not speak against."""
    game, agents, law = system.game, system.agents, system.law
    assert law.graph is not None
    known, kind = system.equilibrium.action, agents.kind
    balance = energy_balance(kind, agents.parameters)
    assert balance is not None
    slopes = np.zeros((agents.channels, agents.states, agents.states))
    for q, out in zip(agents.parameters, slopes, strict=True):
        kind.jacobian(q, np.zeros(agents.states), out)
    rest = agents.equilibrium(known)
    offset = law.barrier_profiles(game.agent_of_action, system.memory) - system.start
    return LinearLoop(
        game, law.graph, law.gain, system.rho, known, *balance, slopes[:, kind.OUTPUT],
        kind.OUTPUT, *_affine(game, known, system.start),
        (float(np.sum(agents.storage(system.state, rest))), 0.5 * float(np.sum(offset**2))),
        offset,
    )  # fmt: skip


def _affine(game: Game, known: Array, start: Array) -> tuple[Array, Array, Array]:
    """Slopes A, and the slacks at y* and at the start, of affine constraints with the barrier."""
    if game.affine_constraints is None:
        rest, begin = (-game.constraints(y) - game.margins for y in (known, start))
        return game.constraint_jacobian(known), rest, begin
    # of gap^2 - delta^2 the gradient is 2 gap a, and a'w follows from how it changes along w
    way = 1.0 + np.random.default_rng(0).random(len(known))
    change = game.constraint_jacobian(known + way) - game.constraint_jacobian(known)
    slope = change / np.sqrt(2.0 * (change @ way))[:, None]
    assert game.gap_bounds is not None
    bound = np.sqrt(game.gap_bounds**2 - game.margins)
    size = np.sum(slope**2, axis=1)
    gaps = (np.sum(game.constraint_jacobian(y) * slope, axis=1) / (2.0 * size)
            for y in (known, start))  # fmt: skip
    rest, begin = (np.concatenate([bound - gap, bound + gap]) for gap in gaps)
    return np.concatenate([slope, -slope]), rest, begin
