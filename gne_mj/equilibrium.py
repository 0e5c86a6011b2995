"""Equilibria of a game: the penalised one, the variational one, and how near they are.

The penalised equilibrium solves F(y) + dphi(y) = 0 [eq:NEcondition]; as rho falls it follows a
smooth path whose end is the variational GNE [eq:vGNE]. All are found by the interior-point method
of :mod:`gne_mj.interior_point`.
"""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from itertools import pairwise
from threading import Lock
from typing import NamedTuple, NoReturn
from weakref import WeakKeyDictionary, proxy

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj import interior_point as method
from gne_mj.cores import cores
from gne_mj.errors import InfeasibleStart, InvalidInput, SolverError
from gne_mj.game_model import Game, compressed
from gne_mj.numbers import flat
from gne_mj.ordering import reverse_cuthill_mckee
from gne_mj.parameter_block import ParameterBlock
from gne_mj.plain import forgive_pending, raise_pending
from gne_mj.records import arrays
from gne_mj.solver_memory import SolverMemory, draw_lines, solver_memory

TOLERANCE = 1e-12
# Multiplications for each step of Newton's method, roughly: some seconds
MOST_WORK = 1e10
# Best responses that one call finds, and games of so many agents are shared among processors
PIECE, MANY = 64, 256


class Equilibrium(NamedTuple):
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
    return _solver(game).follow(start, first, rho, tolerance)


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
    return _solver(game).follow(start, rho, 0.0, TOLERANCE)


def best_response(game: Game, agent: int, y: ArrayLike) -> Equilibrium:
    """An agent's own minimiser of J_i over its feasible actions, the others' held at y (m,).

    Found by the same path, for this agent alone, from y (strictly inside) and from the least costs
    on lines through it: for an action of one entry that is the whole feasible interval around y_i,
    and where the game does not declare its constraints convex those beyond it, as finely as
    :mod:`gne_mj.lines` looks; for others a few directions, so that where J_i or the set is not
    convex in y_i a better one may exist. The multipliers are those of the agent's own problem, zero
    for constraints that do not contain its action.
    """
    return _solver(game).respond(y, agent)


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
    return np.maximum(game.costs(y) - _solver(game).least_costs(y, responded), 0.0)


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
        self._game, self._name = proxy(game), game.called  # which may be forgotten before this is
        self._native = method.build()
        self._run = self._native.run
        self._lock = Lock()
        self._order = position, half_band = order(game)
        self._half_band = half_band
        if not game.actions * float(half_band) ** 2 <= MOST_WORK:
            raise InvalidInput(
                "game.agents",
                game.agents,
                f"the {game.called} couples up to {half_band} actions with each other,"
                " which is too much work for its equilibria",
            )
        position.flags.writeable = False
        self._spare: list[_Place] = []  # for threads
        self._place = self._new_place(game)
        memory, self._address = self._place.memory, self._place.block.address
        self._y, self._multipliers = memory.point.y, memory.point.multipliers
        self._shape, self._report = self._y.shape, flat(memory.report)

    def _new_place(self, game: Game) -> "_Place":
        memory = solver_memory(game, *self._order, self._native.entry.address)
        return _Place(memory, ParameterBlock(arrays(memory)))

    def follow(self, start: Start, rho: float, last_rho: float, tolerance: float) -> Equilibrium:
        """The end of a path of penalised equilibria.

        Args:
            start: where to begin, best near the path's first equilibrium.
            rho: of the first, at most, 0 for one that suits the costs.
            last_rho: of the last; 0 for the limit.
            tolerance: see :func:`penalised_equilibrium`.

        Raises:
            InfeasibleStart: ``start`` is not strictly inside.
            SolverError: the tolerance was not reached.
        """
        known = isinstance(start, Equilibrium)
        y = self._profile(start.action if isinstance(start, Equilibrium) else start)
        with self._lock:
            self._y[...] = y
            if isinstance(start, Equilibrium):
                self._multipliers[:] = start.multipliers
            ended = self._run(self._address, -1, known, rho, last_rho, tolerance)
            if ended != method.CONVERGED:
                report = self._place.memory.report
                self._fail(ended, y, self._y, int(report.iterations), float(report.error))
            forgive_pending()
            return _equilibrium(self._y.copy(), self._multipliers.copy(), self._report)

    def respond(self, y: ArrayLike, agent: int) -> Equilibrium:
        """The best response of one agent, which minimises alone, from y and nothing else.

        Raises:
            InfeasibleStart: y is not strictly inside.
            SolverError: no minimiser was found.
        """
        data, action = self._place.memory.data, self._profile(y).copy()
        with self._lock:
            self._respond(self._place, action, agent, agent + 1, np.empty(len(data.everyone)))
            best = self._place.memory.best
            own = data.own_index[data.own_pointer[agent] : data.own_pointer[agent + 1]]
            multipliers = np.zeros(len(best.multipliers))
            multipliers[own] = best.multipliers[: len(own)]
            block = slice(data.offsets[agent], data.offsets[agent + 1])
            action[block] = best.y[block]
            return _equilibrium(action, multipliers, flat(self._place.memory.best_report))

    def least_costs(self, y: ArrayLike, responded: Callable[[], None]) -> NDArray[np.float64]:
        """What each agent's cost is at its best response to y, (N,); raises as ``respond`` does."""
        y, agents = self._profile(y), self._game.agents
        # A plain Python function is asked by one thread, and its errors are its agent's.
        piece = PIECE if self._game.written.native else 1
        threads = cores() if agents >= MANY and piece > 1 else 1
        costs = np.empty(agents)
        with self._lock:
            while len(self._spare) < threads - 1:
                self._spare.append(self._new_place(self._game))
            places = [self._place, *self._spare[: threads - 1]]

            def find(first: int) -> int:
                last, place = min(first + piece, agents), places.pop()
                try:
                    self._respond(place, y, first, last, costs)
                finally:
                    places.append(place)
                return last - first

            with ThreadPoolExecutor(threads) if threads > 1 else nullcontext() as pool:
                for done in (pool.map if pool else map)(find, range(0, agents, piece)):
                    for _ in range(done):
                        responded()
        return costs

    def _respond(
        self, place: "_Place", y: NDArray[np.float64], first: int, last: int,
        costs: NDArray[np.float64],
    ) -> None:  # fmt: skip
        """Let some agents respond to y, and fill their entries of costs (N,)."""
        memory = place.memory
        memory.start[:] = y
        if not memory.lines.any():
            draw_lines(memory)
        while first < last:
            first = self._native.respond(place.block.address, first, last, costs)
            if first < last:  # an attempt of this agent has found nothing
                response = memory.response
                ended, steps = int(response.ended), int(response.iterations)
                if not response.found or not self._is_lack_of_progress(ended, memory.failed):
                    self._fail(ended, y, memory.failed, steps, float(response.error))
                first += 1
        forgive_pending()

    def _is_lack_of_progress(self, ended: int, y: NDArray[np.float64]) -> bool:
        """Whether the method alone is why an attempt ended, no function of the game's.

        Raises:
            UserCodeError, InvalidInput: a function is.
        """
        raise_pending()
        if ended != method.OUTSIDE:
            self._game.check_numbers(y)
        return ended != method.OUTSIDE

    def middle(self, y: ArrayLike) -> NDArray[np.float64]:
        """A profile well inside, from one strictly inside."""
        moved = self._profile(y)
        with self._lock:
            self._y[:] = moved
            self._native.to_middle(self._address)
            moved = self._y.copy()
        forgive_pending()
        return moved

    def _profile(self, y: ArrayLike) -> NDArray[np.float64]:
        profile = np.asarray(y, dtype=np.float64)
        if profile.shape != self._shape:
            raise ValueError(f"y must have shape {self._shape}, not {profile.shape}")
        return profile

    def _fail(
        self, ended: int, start: NDArray[np.float64], y: NDArray[np.float64], iterations: int,
        error: float,
    ) -> NoReturn:  # fmt: skip
        """Raise why a path from ``start`` has ended at y."""
        raise_pending()
        if ended == method.OUTSIDE:
            own, data = self._game.written, self._place.memory.data  # as Python can call it
            constraint, q = own.functions["constraint"], own.parameters
            g = np.array([constraint(q, k, start) for k in range(len(data.tightening))])
            g += data.tightening
            worst = int(np.argmax(np.where(np.isnan(g), np.inf, g)))
            raise InfeasibleStart(
                self._game.name, "start", self._game.constraint_names[worst], float(g[worst])
            )
        self._game.check_numbers(y)
        reason = {
            method.SINGULAR: f"the derivative of F + dphi is singular in the {self._name}",
            method.NO_WAY_ON: f"Newton's method found no way on in the {self._name}",
            method.TOO_MANY: f"the equilibrium of the {self._name} was not found",
        }[ended]
        raise SolverError(reason, error, iterations)


class _Place(NamedTuple):
    """Memory for one thread, and how native code reaches it."""

    memory: SolverMemory
    block: ParameterBlock


def _equilibrium(
    action: NDArray[np.float64], multipliers: NDArray[np.float64], report: NDArray[np.float64]
) -> Equilibrium:
    iterations, _, residual, complementarity, rho = report.tolist()
    return Equilibrium(action, multipliers, rho, residual, complementarity, int(iterations))


def order(game: Game) -> tuple[NDArray[np.int64], int]:
    """Each action's row in Newton's matrix and the matrix's half bandwidth, kept small.

    Two agents are coupled if one is in the other's cost or both are in one constraint.
    """
    coupled = compressed(_coupled(game))
    sequence = reverse_cuthill_mckee(*coupled)
    sizes = np.diff(game.data.offsets)
    first = np.empty(game.agents, dtype=np.int64)  # row of each agent's first action
    first[sequence] = np.cumsum(sizes[sequence]) - sizes[sequence]
    position = first[game.agent_of_action] + np.arange(game.actions)
    position -= game.data.offsets[game.agent_of_action]
    row, column = np.repeat(np.arange(game.agents), np.diff(coupled[0])), coupled[1]
    half_band = int(np.max(first[row] + sizes[row] - 1 - first[column], initial=0))
    if half_band == game.actions - 1:  # no order makes it narrower
        position = np.arange(game.actions)
    return position, half_band


def _coupled(game: Game) -> list[list[int]]:
    """Of each agent those it is coupled with, itself among them where it is in any function."""
    data = game.data
    rows: list[set[int]] = [set() for _ in range(game.agents)]
    for i, cost in enumerate(_groups(data.cost_pointer, data.cost_index)):
        rows[i].update(cost)
        for j in cost:
            rows[j].add(i)
    for members in set(_groups(data.member_pointer, data.member_index)):
        for i in members:
            rows[i].update(members)
    return [sorted(row) for row in rows]


def _groups(pointer: NDArray[np.int64], index: NDArray[np.int64]) -> list[tuple[int, ...]]:
    entries = index.tolist()
    return [tuple(entries[a:b]) for a, b in pairwise(pointer.tolist())]
