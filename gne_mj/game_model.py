"""A generalized game: costs J_i(y), shared constraints g(y) <= 0 and their exact derivatives.

The mathematics of one game is a module of kernels (see :mod:`gne_mj.native`), plain functions of
numbers. With q the game's flat parameter vector, y the profile of all actions (shape (m,)), i the
agent, a and b entries of a profile (a belonging to agent i) and l a constraint, all numbered from
0, such a module defines

==============================================  ==============================================
``cost(q, i, y)``                               J_i(y)
``cost_gradient(q, i, a, y)``                   dJ_i/dy_a
``add_cost_hessian(q, i, a, y, scale, out)``    out[b] += scale * d2J_i/dy_a dy_b, out of (m,);
                                                touches only entries of agents that J_i depends on
``constraint(q, l, y)``                         g_l(y), negative inside
``constraint_gradient(q, l, a, y)``             dg_l/dy_a, for a in the constraint
``constraint_hessian(q, l, a, b, y)``           d2g_l/dy_a dy_b, for a and b in the constraint
==============================================  ==============================================

:class:`Game` joins such a module with its parameters and with who appears where.
"""

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import ModuleType
from typing import Annotated, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj import game_functions as functions
from gne_mj.bounds import MOST_ACTIONS, MOST_MEMBERS, check_count, check_room
from gne_mj.equality import Equality
from gne_mj.errors import InvalidInput, UserCodeError
from gne_mj.game_arrays import array_functions
from gne_mj.game_fields import check_kinds, check_owners, checked_bounds
from gne_mj.plain import Written, as_written, check_numbers, plain_kernels, raise_pending
from gne_mj.quantity import Quantity

# Lower and upper bounds of the entries of an array
Box = tuple[NDArray[np.float64], NDArray[np.float64]]
# What all constraints of a game are: each includes the one before, see Game.constraint_class
ConstraintClass = Literal["affine", "quadratic", "convex"]
CLASSES: tuple[ConstraintClass, ...] = ("affine", "quadratic", "convex")


class GameData(NamedTuple):
    """What kernels read of a game, as arrays for native code.

    Index lists are in compressed rows: those of row r are ``index[pointer[r]:pointer[r + 1]]``.
    """

    parameters: Annotated[np.ndarray, "n"]  # q, the game's own numbers
    offsets: Annotated[np.ndarray, "N + 1", int]  # where each agent's action starts in a profile
    owner: Annotated[np.ndarray, "m", int]  # the agent that each entry of a profile belongs to
    # agent i -> the agents that appear in J_i (i itself first)
    cost_pointer: Annotated[np.ndarray, "N + 1", int]
    cost_index: Annotated[np.ndarray, "n", int]
    # constraint l -> the agents that appear in g_l
    member_pointer: Annotated[np.ndarray, "p + 1", int]
    member_index: Annotated[np.ndarray, "n", int]
    # agent i -> the constraints that are its own: those whose barrier its penalised cost has
    own_pointer: Annotated[np.ndarray, "N + 1", int]
    own_index: Annotated[np.ndarray, "n", int]
    tightening: Annotated[np.ndarray, "p"]  # t >= 0: the barrier guards g + t < 0
    everyone: Annotated[np.ndarray, "N", int]  # 0, ..., N - 1
    all_constraints: Annotated[np.ndarray, "p", int]  # 0, ..., p - 1
    # addresses of the kernels' C functions, see gne_mj.game_functions
    functions: Annotated[np.ndarray, "n", int]


@dataclass(frozen=True, eq=False)
class Game:
    """A generalized game [eq:GNE].

    Args:
        name: what the game is called in messages and files.
        kernels: module of kernels, as in this module's table; or of plain Python functions of
            the same names, which is slow and may lack the two second derivatives.
        parameters: q, flat.
        sizes: m_i of each agent.
        in_cost: for each agent the agents that appear in its cost.
        in_constraint: for each constraint the agents that appear in it.
        owners: for each constraint the agents whose constraint it is; others that appear in it move
            it and need not keep it. None for all: every constraint is shared.
        constraint_names: one name for each constraint, used in messages and files.
        action_name: what an action is, e.g. "velocity".
        action_unit: its unit.
        affine: whether F is an affine map, so that its Jacobian is the same everywhere.
        box: (lower, upper), each (m,): bounds of every action that the shared constraints imply.
        jacobian_bounds: for an F that is not affine, maps such a box to (lower, upper) bounds of
            every entry of dF/dy over it, each (m, m).
        row_scaled: whether dF/dy = diag(d(y)) A with A the same everywhere, so that each of its
            rows lies between the two that the bounds' entries make up.
        gap_bounds: delta_l, shape (p,), of a game whose constraints read |gap_l|^2 <= delta_l^2.
        affine_constraints: how many affine constraints describe the same set by the same barrier,
            where the game's own are not affine: twice p where all bound gaps of one entry (with
            ``gap_bounds``); None if none do.
        agent_name: what an agent is, e.g. "robot".
        axes: names of the entries of an agent's action; "1", "2", ... if left out.
        quantities: what follows from the actions and is recorded and drawn beside them.
        tightening: t >= 0, shape (p,), by which the barrier keeps farther away, in the
            constraints' own units: it guards g + t < 0. None for 0.
        feasible_jacobian_bounds: (lower, upper) bounds of every entry of dF/dy over the feasible
            profiles, each (m, m), where they are known to be closer than those over ``box``.
        constraint_class: what the author says of all constraints: "affine", "quadratic" (convex,
            their second derivatives the same everywhere) or "convex"; None says nothing.
        smooth: whether the author says that F is twice continuously differentiable.
        equalities: which constraints are bands about an equality.
        motion: how its numbers move, a :class:`gne_mj.motion.Motion`; None if they stand still.
        tested: whether the author's own tests compare the functions with each other and with what
            is declared here. The package's games say so: comparing them again at every load would
            only cost time. Of others :mod:`gne_mj.game_check` compares at load, and what they
            declare is "assumed" in certificates, where it is "met" of tested ones.

    Attributes:
        written: the functions as they were given, before plain ones got addresses.

    Raises:
        InvalidInput: what does not fit together, before native code would read beyond an array.
    """

    name: str
    kernels: ModuleType
    parameters: NDArray[np.float64]
    sizes: tuple[int, ...]
    in_cost: Sequence[Sequence[int]]
    in_constraint: Sequence[Sequence[int]]
    constraint_names: tuple[str, ...]
    action_name: str = "action"
    action_unit: str = ""
    affine: bool = False
    box: Box | None = None
    jacobian_bounds: Callable[[Box], Box] | None = None
    row_scaled: bool = False
    gap_bounds: NDArray[np.float64] | None = None
    affine_constraints: int | None = None
    agent_name: str = "agent"
    axes: tuple[str, ...] = ()
    quantities: tuple[Quantity, ...] = ()
    tightening: NDArray[np.float64] | None = None
    feasible_jacobian_bounds: Box | None = None
    constraint_class: ConstraintClass | None = None
    smooth: bool = False
    tested: bool = False
    owners: Sequence[Sequence[int]] | None = None
    equalities: tuple[Equality, ...] = ()
    motion: object = None
    written: Written = field(init=False, repr=False)

    def __post_init__(self) -> None:
        check_kinds(self)
        self._check()
        self._check_declarations()
        if self.jacobian_bounds is not None and not self.tested:
            checked = checked_bounds(self.jacobian_bounds, sum(self.sizes))
            object.__setattr__(self, "jacobian_bounds", checked)
        object.__setattr__(self, "written", as_written(self.kernels, self.parameters))
        if not self.native:
            own = [
                [k for k, members in enumerate(self.in_constraint) if i in members]
                for i in self.agent_of_action.tolist()
            ]
            kernels, addresses, kept = plain_kernels(self.written, own)
            object.__setattr__(self, "kernels", kernels)
            object.__setattr__(self, "parameters", addresses)
            object.__setattr__(self, "_kept", kept)

    def __repr__(self) -> str:
        """One line: name, sizes, what is known of it."""
        each = f" of {self.sizes[0]} entries" if max(self.sizes) > 1 else ""
        known = [f"{self.constraint_class} constraints"] * (self.constraint_class is not None)
        known += ["affine F"] * self.affine
        return (
            f"<Game {self.name!r}: {self.agents} agents, {self.actions} actions{each},"
            f" {', '.join([f'{self.constraints_count} constraints', *known])}>"
        )

    def _check(self) -> None:
        count = len(self.sizes)
        if not count or any(size < 1 for size in self.sizes):
            raise InvalidInput("sizes", self.sizes, "it must list a positive size an agent")
        if len(self.in_cost) != count:
            raise InvalidInput(
                "in_cost", f"{len(self.in_cost)} lists", f"there must be {count}, one an agent"
            )
        constraints = len(self.in_constraint)
        if not constraints or len(self.constraint_names) != constraints:
            raise InvalidInput(
                "in_constraint",
                f"{constraints} lists and {len(self.constraint_names)} constraint_names",
                "there must be as many of both, and at least one",
            )
        check_count("sizes", sum(self.sizes), MOST_ACTIONS, "the actions of all")
        check_count("in_constraint", constraints, MOST_ACTIONS, "the constraints")
        for key in ("in_cost", "in_constraint"):
            check_count(key, sum(map(len, getattr(self, key))), MOST_MEMBERS, "all agents in it")
            for members in getattr(self, key):
                inside = min(members, default=0) >= 0 and max(members, default=0) < count
                if not inside or len(set(members)) != len(members):
                    raise InvalidInput(
                        key,
                        list(members),
                        f"agents are numbered from 0 to {count - 1}, each at most once in a list",
                    )
        if not all(len(members) for members in self.in_constraint):
            raise InvalidInput("in_constraint", [], "every constraint contains an agent")
        check_owners(self)

    def _check_declarations(self) -> None:
        m, p = sum(self.sizes), len(self.in_constraint)
        if self.constraint_class not in (None, *CLASSES):
            raise InvalidInput(
                "constraint_class",
                self.constraint_class,
                f"it must be one of {', '.join(CLASSES)}, or None",
            )
        if self.box is not None:
            shapes = [np.shape(bound) for bound in self.box]
            if shapes != [(m,), (m,)] or not np.all(np.less(*self.box)):
                raise InvalidInput(
                    "box",
                    self.box,
                    f"it must be (lower, upper), each of {m} numbers, lower below upper",
                )
        bounds = self.gap_bounds
        if bounds is not None and (np.shape(bounds) != (p,) or not np.all(np.asarray(bounds) > 0)):
            raise InvalidInput(
                "gap_bounds", bounds, f"it must list {p} positive numbers, one a constraint"
            )
        if self.affine_constraints is not None and (
            bounds is None or self.affine_constraints != 2 * p
        ):
            raise InvalidInput(
                "affine_constraints",
                self.affine_constraints,
                f"it goes with gap_bounds, where {p} bounds on gaps of one entry are {2 * p} affine"
                " constraints",
            )

    @property
    def native(self) -> bool:
        """Whether its functions are kernels, not plain Python ones."""
        return self.written.native

    @property
    def has_cost_hessian(self) -> bool:
        """Whether its author gave costs' second derivatives, or differences stand for them."""
        return "add_cost_hessian" in self.written.functions

    @property
    def has_constraint_hessian(self) -> bool:
        """Whether its author gave the constraints' second derivatives."""
        return "constraint_hessian" in self.written.functions

    @property
    def convexity(self) -> str | None:
        """Why its constraints are convex, as its author says; None says nothing."""
        return "bounds on gaps" if self.gap_bounds is not None else self.constraint_class

    def tightened(self, tightening: ArrayLike) -> Self:
        """The same game with a barrier of g + t < 0; t >= 0, one number or (p,)."""
        return self._moved("tightening", tightening, 1.0)

    def widened(self, by: ArrayLike) -> Self:
        """The same game with a barrier of g < w; w >= 0, one number or (p,)."""
        return self._moved("by", by, -1.0)

    def _moved(self, key: str, given: ArrayLike, sign: float) -> Self:
        margin = np.broadcast_to(given, (self.constraints_count,)).astype(np.float64)
        if not np.all(np.isfinite(margin)) or np.any(margin < 0):
            raise InvalidInput(key, given, "it must be finite and not negative")
        game = copy.copy(self)  # not `replace`, which would take plain functions for kernels
        game.__dict__.pop("data", None)  # holds the old one
        object.__setattr__(game, "tightening", sign * margin)
        return game

    @property
    def margins(self) -> NDArray[np.float64]:
        """t, shape (p,), zero where nothing is tightened."""
        if self.tightening is None:
            return np.zeros(self.constraints_count)
        return self.tightening

    @property
    def owned_by(self) -> Sequence[Sequence[int]]:
        """For each constraint the agents whose constraint it is."""
        return self.in_constraint if self.owners is None else self.owners

    @cached_property
    def private(self) -> tuple[int, ...]:
        """The constraints that some agent in them does not own."""
        pairs = zip(self.owned_by, self.in_constraint, strict=True)
        return tuple(k for k, (own, members) in enumerate(pairs) if len(own) < len(members))

    @property
    def agents(self) -> int:
        """N."""
        return len(self.sizes)

    @cached_property
    def actions(self) -> int:
        """m, the length of a profile."""
        return sum(self.sizes)

    @property
    def constraints_count(self) -> int:
        """p."""
        return len(self.in_constraint)

    @cached_property
    def data(self) -> GameData:
        """The same, for native code (read-only arrays)."""
        own: list[list[int]] = [[] for _ in self.sizes]
        for constraint, members in enumerate(self.owned_by):
            for agent in members:
                own[agent].append(constraint)
        ordered = [[i, *(j for j in members if j != i)] for i, members in enumerate(self.in_cost)]
        arrays = (
            np.array(self.parameters, dtype=np.float64),
            np.concatenate([[0], np.cumsum(self.sizes)]).astype(np.int64),
            self.agent_of_action.astype(np.int64),
            *compressed(ordered),
            *compressed(self.in_constraint),
            *compressed(own),
            self.margins.copy(),
            np.arange(self.agents),
            np.arange(self.constraints_count),
            functions.compiled_functions(self.kernels),
        )
        for array in arrays:
            array.flags.writeable = False
        return GameData(*arrays)

    @cached_property
    def actions_in_constraints(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Which entries of dg/dy can differ from zero, in compressed rows: (p + 1,) and actions."""
        at = self.data.offsets
        rows = [[a for i in agents for a in range(at[i], at[i + 1])]
                for agents in self.in_constraint]  # fmt: skip
        return compressed(rows)

    @property
    def called(self) -> str:
        """What sentences call it: its name and the word game, once."""
        return self.name if self.name.endswith("game") else f"{self.name} game"

    @cached_property
    def own_constraints(self) -> NDArray[np.int64]:
        """p_i, the number of constraints of each agent that contain y_i, shape (N,)."""
        return np.diff(self.data.own_pointer)

    @cached_property
    def agent_of_action(self) -> NDArray[np.int64]:
        """Which agent each entry of a profile belongs to, shape (m,)."""
        return np.repeat(np.arange(self.agents), self.sizes)

    @cached_property
    def axis_of_action(self) -> tuple[str, ...]:
        """Name of each entry of a profile among its agent's, length m."""
        numbers = tuple(str(k + 1) for k in range(max(self.sizes)))
        return tuple((self.axes or numbers)[k] for size in self.sizes for k in range(size))

    def entries(self, quantity: Quantity) -> tuple[int, ...]:
        """Shape of a quantity at one profile: (N,), (p,) or ()."""
        if not quantity.each:
            return ()
        return (self.agents if quantity.each == "agent" else self.constraints_count,)

    def costs(self, y: ArrayLike) -> NDArray[np.float64]:
        """J_i(y) of each agent; y of shape (..., m), result (..., N)."""
        return self._rows(y, self.agents, array_functions().costs)

    def pseudo_gradient(self, y: ArrayLike) -> NDArray[np.float64]:
        """F(y) = col(dJ_i/dy_i); y and the result of shape (..., m)."""
        return self._rows(y, self.actions, array_functions().pseudo_gradient)

    def constraints(self, y: ArrayLike) -> NDArray[np.float64]:
        """g(y), negative inside; y of shape (..., m), result (..., p)."""
        return self._rows(y, self.constraints_count, array_functions().constraints)

    def pseudo_gradient_jacobian(self, y: ArrayLike) -> NDArray[np.float64]:
        """dF/dy, shape (m, m), at one profile y of shape (m,)."""
        out = self._matrix(self.actions)
        array_functions().pseudo_gradient_jacobian(self.data, self._profile(y), out)
        raise_pending()
        return out

    def constraint_jacobian(self, y: ArrayLike) -> NDArray[np.float64]:
        """dg/dy, shape (p, m), at one profile y of shape (m,)."""
        out = self._matrix(self.constraints_count)
        array_functions().constraint_jacobian(self.data, self._profile(y), out)
        raise_pending()
        return out

    def weighted_constraint_hessian(self, y: ArrayLike, weights: ArrayLike) -> NDArray[np.float64]:
        """sum_l w_l d2g_l/dy2, shape (m, m), at one profile y (m,) with weights w (p,)."""
        out = self._matrix(self.actions)
        weights = np.ascontiguousarray(weights, dtype=np.float64)
        if weights.shape != (self.constraints_count,):
            raise ValueError(f"weights must be ({self.constraints_count},), not {weights.shape}")
        array_functions().weighted_hessian(self.data, self._profile(y), weights, out)
        raise_pending()
        return out

    def constraint_hessian(self, constraint: int, y: ArrayLike) -> NDArray[np.float64]:
        """d2g_l/dy2 in the actions of the constraint's own agents, in their order: (m_l, m_l)."""
        start, actions = self.actions_in_constraints
        own = actions[start[constraint] : start[constraint + 1]]
        out = np.zeros((len(own), len(own)))
        array_functions().constraint_hessian(self.data, self._profile(y), constraint, own, out)
        raise_pending()
        return out

    def check_numbers(self, y: ArrayLike) -> None:
        """Call the game's functions at a profile (m,), each as it was written.

        Raises:
            UserCodeError: one raises, or returns what is not a finite number.
            InvalidInput: one of a tested game does, for which its parameters are too large.
        """
        try:
            check_numbers(self.written, self.data, self._profile(y).copy())
        except UserCodeError as error:
            if not self.tested:
                raise
            words = f"its numbers leave those that can be computed with: {error}"
            raise InvalidInput("game", self.name, words) from error

    def tightest(self, y: ArrayLike) -> tuple[int, float]:
        """The constraint with the greatest g_l(y) and that value (negative inside)."""
        values = self.constraints(y)
        worst = int(np.argmax(np.where(np.isnan(values), np.inf, values)))
        return worst, float(values[worst])

    def _matrix(self, rows: int) -> NDArray[np.float64]:
        size = rows * self.actions
        check_room("agents", self.agents, size, f"a matrix of the {self.called}")
        return np.zeros((rows, self.actions))

    def _profile(self, y: ArrayLike) -> NDArray[np.float64]:
        profile = np.ascontiguousarray(y, dtype=np.float64)
        if profile.shape[-1:] != (self.actions,):
            raise ValueError(f"y must end in {self.actions} actions, got shape {profile.shape}")
        return profile

    def _rows(self, y: ArrayLike, width: int, native: object) -> NDArray[np.float64]:
        profile = self._profile(y)
        out = np.zeros((*profile.shape[:-1], width))
        native(self.data, profile.reshape(-1, self.actions), out.reshape(-1, width))  # type: ignore[operator]
        raise_pending()
        return out


def compressed(rows: Sequence[Sequence[int]]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Where each of some lists begins, with the last one's end, and the lists end to end."""
    pointer = np.concatenate([[0], np.cumsum([len(row) for row in rows])]).astype(np.int64)
    return pointer, np.array([entry for row in rows for entry in row], dtype=np.int64)
