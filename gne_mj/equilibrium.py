"""Equilibria of a game: the penalised one, the variational one, and how near they are.

The penalised equilibrium solves F(y) + dphi(y) = 0 [eq:NEcondition]; as rho falls it follows a
smooth path whose end is the variational GNE [eq:vGNE]. All are found by the interior-point method
of :mod:`gne_mj.interior_point`.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from threading import Lock
from typing import NoReturn
from weakref import WeakKeyDictionary, proxy

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from gne_mj import interior_point as method
from gne_mj import lines
from gne_mj.errors import InfeasibleStart, InvalidInput, SolverError
from gne_mj.game_model import Game
from gne_mj.interior_point import Path
from gne_mj.plain import forgive_pending, raise_pending
from gne_mj.primal_dual import Free, Iterate, NewtonScratch

TOLERANCE = 1e-12
# The end of the path to rho -> 0, as a share of the costs' size (gne_mj.scales). There only the
# order of lambda_l s_l counts, so that it may be off by half.
TO_ZERO = Path(0.0, 1e-12, TOLERANCE, 0.5, True)
# Multiplications for each step of Newton's method, roughly: some seconds
MOST_WORK = 1e10
# Random lines for each entry of an action of several, on which a best response is looked for
RANDOM_LINES = 4


@dataclass(frozen=True)
class Equilibrium:
    """A profile with what shows that it is an equilibrium.

    Attributes:
        action: y, shape (m,), strictly inside: every g_l(y) is negative.
        multipliers: lambda_l >= 0, shape (p,).
        rho: the penalty parameter it was computed with.
        residual: greatest entry of |F(y) + sum_l lambda_l dg_l(y)|, relative to its row's size
            (:mod:`gne_mj.scales`): that of the terms that must cancel, and of what the cost's
            second derivatives make of the profile.
        complementarity: greatest lambda_l * s_l, with s_l = -g_l; it is rho along the path.
        iterations: Newton steps in all.
    """

    action: NDArray[np.float64]
    multipliers: NDArray[np.float64]
    rho: float
    residual: float
    complementarity: float
    iterations: int

    def __repr__(self) -> str:
        with np.printoptions(precision=5, threshold=12):
            return (
                f"<Equilibrium at rho = {self.rho:g}: y = {self.action},"
                f" residual {self.residual:.1e}>"
            )


# A profile strictly inside, shape (m,), or an equilibrium whose multipliers help as well
Start = ArrayLike | Equilibrium


def penalised_equilibrium(
    game: Game, rho: float, start: Start, *, tolerance: float = TOLERANCE
) -> Equilibrium:
    """The unique y* with F(y*) + dphi(y*) = 0 [eq:NEcondition].

    Args:
        game: with F strictly monotone.
        rho: the penalty parameter.
        start: strictly inside, shape (m,), or an equilibrium near this one.
        tolerance: on the residual as :class:`Equilibrium` defines it; where rounding ends the
            progress before, up to a hundred times as much is accepted and reported.

    Raises:
        InvalidInput: a rho that is not positive and finite.
        InfeasibleStart: ``start`` is not strictly inside.
        SolverError: the tolerance was not reached.
    """
    rho = float(rho)
    if not 0.0 < rho < np.inf:
        raise InvalidInput("rho", rho, "it must be positive and finite")
    first = max(start.rho, rho) if isinstance(start, Equilibrium) else 0.0
    return _solver(game).follow(start, Path(first, rho, tolerance, tolerance, False))


def path(game: Game, rhos: Iterable[float], start: Start) -> Iterator[Equilibrium]:
    """The penalised equilibria at each of ``rhos``, each one started from the one before.

    Primal and dual unknowns are handed on, so that neighbours cost few steps of Newton's method.
    The arguments are as :func:`penalised_equilibrium` has them, which also says what is raised.
    """
    for rho in rhos:
        start = penalised_equilibrium(game, rho, start)
        yield start


def variational_equilibrium(game: Game, start: Start) -> Equilibrium:
    """The variational GNE with its multipliers [eq:vGNE], by following the path rho -> 0.

    The result lies strictly inside, within about 1e-11 (relative to the size of the actions and of
    the forces at hand, not of their units) of the boundaries that bind, also of those that bind
    with a multiplier of zero. p times its rho bounds what any agent could still gain. From an
    equilibrium the path starts at that one's rho. Raises as :func:`penalised_equilibrium` does.
    """
    rho = start.rho if isinstance(start, Equilibrium) else 0.0
    return _solver(game).follow(start, TO_ZERO._replace(rho=rho))


def best_response(game: Game, agent: int, y: ArrayLike) -> Equilibrium:
    """An agent's own minimiser of J_i over its feasible actions, the others' held at y (m,).

    Found by the same path, for this agent alone, from y (strictly inside) and from the least costs
    on lines through it: for an action of one entry that is the whole feasible interval around y_i,
    and where the game does not declare its constraints convex those beyond it, as finely as
    :mod:`gne_mj.lines` looks; for others a few directions, so that where J_i or the set is not
    convex in y_i a better one may exist. The multipliers are those of the agent's own problem, zero
    for constraints that do not contain its action.
    """
    return _solver(game).respond(y, agent)[0]


def measured_epsilon(
    game: Game, y: ArrayLike, responded: Callable[[], None] = lambda: None
) -> NDArray[np.float64]:
    """What each agent could gain by deviating alone from y: J_i(y) - min J_i, shape (N,).

    As far as :func:`best_response` finds that; where J_i or the set is not convex in y_i it may be
    more.

    At the penalised equilibrium it is at most p_i * rho if J_i and the constraints are convex in
    y_i, with p_i the constraints that contain y_i, and so at most p * rho [lemma:epsilon].
    ``responded`` is called after every agent's.
    """
    solver, costs = _solver(game), game.costs(y)
    least = np.empty(game.agents)
    for i in range(game.agents):
        least[i] = solver.respond(y, i)[1]
        responded()
    return np.maximum(costs - least, 0.0)


def middle(game: Game, y: ArrayLike) -> NDArray[np.float64]:
    """A profile (m,) well inside, from one strictly inside: the middle along each action."""
    return _solver(game).middle(y)


_SOLVERS: WeakKeyDictionary[Game, "EquilibriumSolver"] = WeakKeyDictionary()


def _solver(game: Game) -> "EquilibriumSolver":
    found = _SOLVERS.get(game)
    if found is None:
        found = _SOLVERS.setdefault(game, EquilibriumSolver(game))
    return found


class EquilibriumSolver:
    """The interior-point method prepared for one game: its unknowns' order, and memory to work in.

    The functions of this module keep one for each game. Threads may share it: a lock lets one in
    at a time, and results are copies.
    """

    def __init__(self, game: Game) -> None:
        m, p = game.actions, game.constraints_count
        self._data = game.data
        self._game, self._name = proxy(game), game.called  # which may be forgotten before this is
        self._holes = game.constraint_class is None
        self._native = method.build()
        self._lock = Lock()
        self._report = np.zeros(method.COUNT)
        position, self._half_band = order(game)
        if not m * float(self._half_band) ** 2 <= MOST_WORK:
            raise InvalidInput(
                "game.agents",
                game.agents,
                f"the {game.called} couples up to {self._half_band} actions with each other,"
                " which is too much work for its equilibria",
            )
        agents, constraints = np.arange(game.agents), np.arange(p)
        agents.flags.writeable = constraints.flags.writeable = False
        self._everyone = Free(agents, constraints, position)
        self._nobody = Free(agents, constraints, np.full(m, -1))
        self._point = Iterate(np.zeros(m), np.zeros(p), np.zeros(p))
        self._direction, self._found = np.zeros(m), np.zeros(lines.COUNT)
        entries = len(game.actions_in_constraints[1])
        self._work = NewtonScratch(
            trial=Iterate(np.zeros(m), np.zeros(p), np.zeros(p)),
            g=np.zeros(p),
            size=np.zeros(p),
            unit=np.zeros(m),
            share=np.zeros(p),
            row=np.zeros(p + 1, dtype=np.int64),
            column=np.zeros(entries, dtype=np.int64),
            owned=np.zeros(entries, dtype=np.bool_),
            jacobian=np.zeros(entries),
            stationarity=np.zeros(m),
            terms=np.zeros(m),
            step=np.zeros(m),
            step_slack=np.zeros(p),
            step_multipliers=np.zeros(p),
            hessian_row=np.zeros(m),
            band=np.zeros((m, 3 * self._half_band + 1)),
            pivots=np.zeros(m, dtype=np.int64),
        )

    def follow(self, start: Start, path: Path) -> Equilibrium:
        """The end of a path of penalised equilibria.

        Args:
            start: where to begin, best near the path's first equilibrium.
            path: from which rho to which, and how accurately.

        Raises:
            InfeasibleStart: ``start`` is not strictly inside.
            SolverError: the tolerance was not reached.
        """
        known = isinstance(start, Equilibrium)
        y = self._profile(start.action if isinstance(start, Equilibrium) else start)
        with self._lock:
            self._point.y[:] = y
            if isinstance(start, Equilibrium):
                self._point.multipliers[:] = start.multipliers
            ended = self._native.run(
                self._data, self._everyone, self._half_band, path, known, self._point, self._work,
                self._report,
            )  # fmt: skip
            if ended != method.CONVERGED:
                self._fail(ended, y)
            forgive_pending()
            return self._result(self._point.y.copy(), self._point.multipliers.copy())

    def respond(self, y: ArrayLike, agent: int) -> tuple[Equilibrium, float]:
        """The best response of one agent, which minimises alone, from y and nothing else; its cost.

        Raises:
            InfeasibleStart: y is not strictly inside.
            SolverError: no minimiser was found.
        """
        y = self._profile(y)
        best, least, failure = None, np.inf, None
        starts, single = self._lowest(y, agent)
        own = int(self._data.own_pointer[agent + 1] - self._data.own_pointer[agent])
        for start, cost in [(y, np.inf), *starts]:
            # By the lemma a response is only so far from the least cost of its own valley.
            if single and best is not None and cost > least - 2.0 * own * best.rho:
                continue
            # A barrier that outweighs what there is to gain might lead back out of the valley.
            gain = least - cost if best is not None else 0.0
            try:
                found = self._respond(start, agent, max(gain, 0.0) / own if own else 0.0)
            except SolverError as error:
                failure = failure or error
                continue
            reached = self.cost(agent, found.action)
            if best is None or reached < least:
                best, least = found, reached
        if best is None:
            assert failure is not None
            raise failure
        return best, least

    def _lowest(
        self, y: NDArray[np.float64], agent: int
    ) -> tuple[list[tuple[NDArray[np.float64], float]], bool]:
        """Where an agent's cost is least on lines through y, and that; if there is one line only.

        The lines go along its entries, and if they are several in random directions too.
        """
        data = self._data
        first, last = int(data.offsets[agent]), int(data.offsets[agent + 1])
        own = data.own_index[data.own_pointer[agent] : data.own_pointer[agent + 1]]
        directions = np.eye(last - first)
        if last - first > 1:
            shape = (RANDOM_LINES * (last - first), last - first)
            random = np.random.default_rng(agent).normal(size=shape)
            directions = np.concatenate([directions, random])
        starts = []
        for direction in directions:
            with self._lock:
                self._direction[first:last] = direction
                self._native.lowest(
                    data, agent, own, self._holes, y, self._direction, self._work.trial.y,
                    self._found,
                )  # fmt: skip
                self._direction[first:last] = 0.0
                cost, place = self._found.tolist()
            if place != 0.0:
                start = y.copy()
                start[first:last] += place * direction
                starts.append((start, cost))
        return starts, last - first == 1

    def _respond(self, y: NDArray[np.float64], agent: int, rho: float) -> Equilibrium:
        """What an agent's own path from y leads to, from a rho at most (0 for any)."""
        data, point, position = self._data, self._point, self._nobody.position
        own = data.own_index[data.own_pointer[agent] : data.own_pointer[agent + 1]]
        alone = Free(self._nobody.agents[agent : agent + 1], own, position)
        block = slice(data.offsets[agent], data.offsets[agent + 1])
        with self._lock:
            position.fill(-1)
            position[block] = np.arange(block.stop - block.start)
            point.y[:] = y
            ended = self._native.run(
                data, alone, self._half_band, TO_ZERO._replace(rho=rho), False, point, self._work,
                self._report,
            )  # fmt: skip
            if ended != method.CONVERGED:
                self._fail(ended, y)
            forgive_pending()
            multipliers = np.zeros(len(point.multipliers))
            multipliers[own] = point.multipliers[: len(own)]
            return self._result(point.y.copy(), multipliers)

    def middle(self, y: ArrayLike) -> NDArray[np.float64]:
        """A profile well inside, from one strictly inside."""
        moved = self._profile(y).copy()
        with self._lock:
            self._native.to_middle(self._data, moved, self._direction, self._work.trial.y)
        forgive_pending()
        return moved

    def cost(self, agent: int, y: NDArray[np.float64]) -> float:
        """J_i(y); y of shape (m,)."""
        return float(self._native.cost(self._data, agent, y))

    def _profile(self, y: ArrayLike) -> NDArray[np.float64]:
        profile = np.ascontiguousarray(y, dtype=np.float64)
        if profile.shape != self._point.y.shape:
            raise ValueError(f"y must have shape {self._point.y.shape}, not {profile.shape}")
        return profile

    def _result(self, action: NDArray[np.float64], multipliers: NDArray[np.float64]) -> Equilibrium:
        iterations, _, residual, complementarity, rho = self._report.tolist()
        return Equilibrium(action, multipliers, rho, residual, complementarity, int(iterations))

    def _fail(self, ended: int, y: NDArray[np.float64]) -> NoReturn:
        raise_pending()
        if ended == method.OUTSIDE:
            own = self._game.written  # as Python can call it
            constraint, q = own.functions["constraint"], own.parameters
            g = np.array([constraint(q, k, y) for k in range(len(self._point.slack))])
            g += self._data.tightening
            worst = int(np.argmax(np.where(np.isnan(g), np.inf, g)))
            raise InfeasibleStart(
                self._game.name, "start", self._game.constraint_names[worst], float(g[worst])
            )
        self._game.check_numbers(self._point.y)
        reason = {
            method.SINGULAR: f"the derivative of F + dphi is singular in the {self._name}",
            method.NO_WAY_ON: f"Newton's method found no way on in the {self._name}",
            method.TOO_MANY: f"the equilibrium of the {self._name} was not found",
        }[ended]
        iterations, error = int(self._report[method.ITERATIONS]), float(self._report[method.ERROR])
        raise SolverError(reason, error, iterations)


def order(game: Game) -> tuple[NDArray[np.int64], int]:
    """Each action's row in Newton's matrix and the matrix's half bandwidth, kept small.

    Two agents are coupled if one is in the other's cost or both are in one constraint.
    """
    data, n = game.data, game.agents
    costs = _incidence(data.cost_pointer, data.cost_index, n)
    members = _incidence(data.member_pointer, data.member_index, n)
    coupled = csr_array(costs + costs.T + members.T @ members)
    sequence = reverse_cuthill_mckee(coupled, symmetric_mode=True)
    sizes = np.diff(data.offsets)
    first = np.empty(n, dtype=np.int64)  # row of each agent's first action
    first[sequence] = np.cumsum(sizes[sequence]) - sizes[sequence]
    position = first[game.agent_of_action] + np.arange(game.actions)
    position -= data.offsets[game.agent_of_action]
    row, column = coupled.nonzero()
    return position, int(np.max(first[row] + sizes[row] - 1 - first[column], initial=0))


def _incidence(pointer: NDArray[np.int64], index: NDArray[np.int64], columns: int) -> csr_array:
    return csr_array((np.ones(len(index)), index, pointer), shape=(len(pointer) - 1, columns))
