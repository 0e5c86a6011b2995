"""What a traced function computes with: numbers that are not known yet, and arrays of them.

A :class:`Node` is an action, a parameter, a constant, or what follows from others by an operator.
A :class:`Tape` makes each of them once, so that equal expressions are the same object, however
often they are written: sums over all are formed once.
"""

from collections.abc import Callable, Iterable, Iterator
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from gne_mj.expressions.operators import FUNCTIONS, OPERATORS, UFUNCS, Untraceable, evaluate

Numbers = NDArray[np.float64]


class NoEntry(IndexError):
    """An index beyond the end of an array.

    Attributes:
        parameter: the list that it is of, or "".
        given: its numbers, or what a part of it has.
        shape, key: of the array, and what was asked of it.
    """

    def __init__(self, array: "Array", key: Any) -> None:
        self.parameter, self.given = array.tape.parameter_of(array.nodes)
        self.shape, self.key = array.shape, str(key).strip("()")
        super().__init__(f"an array of {by_shape(self.shape)} has no entry [{self.key}]")


class Tape:
    """All expressions of one game.

    Args:
        actions: m, how many actions there are.
    """

    def __init__(self, actions: int) -> None:
        self.nodes: dict[tuple[Any, ...], Node] = {}
        self.arrays: dict[tuple[Any, ...], tuple[Any, ...]] = {}
        self.q: list[float] = []  # the parameters' numbers
        self.places: dict[str, int] = {}  # where in q each parameter begins
        self.decided: set[int] = set()  # places in q of numbers that functions asked for
        self.actions = [self.node("y", a) for a in range(actions)]

    def node(self, op: str, *args: Any) -> "Node":
        """The one node of an operator and its arguments: nodes or, of leaves, a number."""
        key = (op, *(id(arg) if isinstance(arg, Node) else repr(arg) for arg in args))
        found = self.nodes.get(key)
        if found is None:
            found = self.nodes[key] = Node(self, op, args)
        return found

    def constant(self, value: Any) -> "Node":
        """A number as a node."""
        if isinstance(value, Node):
            return value
        if isinstance(value, str | bytes | complex | np.complexfloating):
            raise Untraceable(f"{value!r:.40} is not a real number")
        try:
            return self.node("c", float(value))
        except (TypeError, ValueError):
            raise Untraceable(f"{type(value).__name__} {value!r:.40} is not a number") from None

    def parameter(self, values: Numbers, name: str = "") -> Any:
        """A parameter's numbers: a node, or an array of them."""
        first = self.places[name] = len(self.q)
        self.q += values.ravel().tolist()
        nodes = [self.node("q", first + k) for k in range(values.size)]
        return nodes[0] if values.shape == () else Array(self, objects(nodes, values.shape))

    def binary(self, op: str, left: Any, right: Any) -> "Node":
        """left op right, of numbers or nodes; what is plainly 0, 1 or constant is folded."""
        a, b = self.constant(left), self.constant(right)
        if a.op == b.op == "c" and not (op == "/" and b.args[0] == 0.0):
            value = OPERATORS[op](a.args[0], b.args[0])
            return self.constant(value)
        is_a, is_b = _value(a), _value(b)
        if (op in "+-" and is_b == 0.0) or (op in ("*", "/", "**") and is_b == 1.0):
            return a
        if (op == "+" and is_a == 0.0) or (op == "*" and is_a == 1.0):
            return b
        if op == "-" and (is_a == 0.0 or a is b):
            return self.constant(0.0) if a is b else self.unary("neg", b)
        if op == "*" and 0.0 in (is_a, is_b):
            return self.constant(0.0)
        if op == "**" and is_b == 0.0:
            return self.constant(1.0)
        return self.node(op, a, b)

    def unary(self, op: str, of: Any) -> "Node":
        """An elementary function, or "neg"."""
        a = self.constant(of)
        if a.op == "c":
            with np.errstate(all="ignore"):
                return self.constant(-a.args[0] if op == "neg" else FUNCTIONS[op](a.args[0]))
        return a.args[0] if op == a.op == "neg" else self.node(op, a)

    def total(self, terms: Iterable[Any]) -> "Node":
        """The sum of many."""
        nodes = [node for node in map(self.constant, terms) if _value(node) != 0.0]
        if len(nodes) < 2:
            return nodes[0] if nodes else self.constant(0.0)
        return self.node("sum", *nodes)

    def parameter_of(self, nodes: NDArray[Any]) -> tuple[str, Any]:
        """The name of the parameter that an array is a part of, "" if of none, and its numbers."""
        flat = nodes.ravel().tolist()
        if not flat or not all(isinstance(node, Node) and node.op == "q" for node in flat):
            return "", None
        places = [node.args[0] for node in flat]
        before = [name for name, at in self.places.items() if at <= places[0]]
        name = max(before, key=self.places.__getitem__)
        return name, np.reshape([self.q[place] for place in places], nodes.shape).tolist()

    def value(self, node: "Node") -> float:
        """The number that a node without actions is now."""
        if node.op == "c":
            return float(node.args[0])
        if node.op == "q":
            self.decided.add(node.args[0])
            return self.q[node.args[0]]
        values = [self.value(arg) for arg in node.args]
        with np.errstate(all="ignore"):
            return float(evaluate(node.op, values))


class Arithmetic:
    """Python's operators, of a node or an array of them."""

    __slots__ = ()
    tape: Tape

    def __add__(self, other: Any) -> Any:
        return apply(self.tape, "+", self, other)

    def __radd__(self, other: Any) -> Any:
        return apply(self.tape, "+", other, self)

    def __sub__(self, other: Any) -> Any:
        return apply(self.tape, "-", self, other)

    def __rsub__(self, other: Any) -> Any:
        return apply(self.tape, "-", other, self)

    def __mul__(self, other: Any) -> Any:
        return apply(self.tape, "*", self, other)

    def __rmul__(self, other: Any) -> Any:
        return apply(self.tape, "*", other, self)

    def __truediv__(self, other: Any) -> Any:
        return apply(self.tape, "/", self, other)

    def __rtruediv__(self, other: Any) -> Any:
        return apply(self.tape, "/", other, self)

    def __pow__(self, other: Any) -> Any:
        return apply(self.tape, "**", self, other)

    def __rpow__(self, other: Any) -> Any:
        return apply(self.tape, "**", other, self)

    def __matmul__(self, other: Any) -> Any:
        return apply(self.tape, "@", self, other)

    def __rmatmul__(self, other: Any) -> Any:
        return apply(self.tape, "@", other, self)

    def __le__(self, other: Any) -> Any:
        return apply(self.tape, "<=", self, other)

    def __lt__(self, other: Any) -> Any:
        return apply(self.tape, "<=", self, other)

    def __ge__(self, other: Any) -> Any:
        return apply(self.tape, ">=", self, other)

    def __gt__(self, other: Any) -> Any:
        return apply(self.tape, ">=", self, other)

    def __eq__(self, other: Any) -> Any:
        return _equal(self, other)

    def __ne__(self, other: Any) -> Any:
        return not _equal(self, other)

    __hash__ = object.__hash__

    def __neg__(self) -> Any:
        return apply(self.tape, "neg", self)

    def __pos__(self) -> Any:
        return self

    def __abs__(self) -> Any:
        return apply(self.tape, "abs", self)

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        return _of_numpy(self.tape, ufunc, method, inputs, options)


class Node(Arithmetic):
    """One number of a traced function.

    Attributes:
        op: "y", "q" or "c" (an action, a parameter, a constant), an operator, "neg", "sum" or the
            name of an elementary function.
        args: nodes; of a leaf its place in the profile or in q, or its value.
        varies: whether it depends on actions.
    """

    __slots__ = ("args", "op", "tape", "varies")

    def __init__(self, tape: Tape, op: str, args: tuple[Any, ...]) -> None:
        self.tape, self.op, self.args = tape, op, args
        self.varies = op == "y" or (op not in "qc" and any(arg.varies for arg in args))

    def __getitem__(self, key: Any) -> "Node":
        """A parameter that is one number has it for every agent."""
        if self.op == "q":
            return self
        raise Untraceable("one number has no entries")

    def sum(self, axis: None = None, dtype: None = None, out: None = None) -> "Node":
        """Itself, as of NumPy's numbers."""
        return self

    mean = sum

    def _known(self, what: str) -> float:
        if self.varies:
            raise Untraceable(f"{what} depends on the actions, whose values are not known here")
        return self.tape.value(self)

    def __bool__(self) -> bool:
        return self._known("a condition") != 0.0

    def __float__(self) -> float:
        return self._known("a number (write np.sin for math.sin, and so on)")

    def __index__(self) -> int:
        value = self._known("an index")
        if value != int(value):
            raise Untraceable(f"{value:g} is not a whole number")
        return int(value)

    def __int__(self) -> int:
        return int(self._known("a whole number"))

    def __repr__(self) -> str:
        return f"<expression {words(self)}>"


class Relation:
    """A comparison of two numbers: less <= more."""

    def __init__(self, less: Node, more: Node) -> None:
        self.less, self.more = less, more

    def __bool__(self) -> NoReturn:
        raise Untraceable(
            "a branch on the actions (if, and, or, min, max, sorted or a < b < c), whose values are"
            " not known here"
        )


class Array(Arithmetic):
    """Several such numbers: what indexing, arithmetic, sum, mean and @ give, as of NumPy's arrays.

    Args:
        nodes: array of nodes (or of relations).
    """

    __slots__ = ("nodes", "tape")

    def __init__(self, tape: Tape, nodes: NDArray[Any]) -> None:
        self.tape, self.nodes = tape, nodes

    @property
    def shape(self) -> tuple[int, ...]:
        """As of NumPy's arrays."""
        return self.nodes.shape

    @property
    def size(self) -> int:
        """As of NumPy's arrays."""
        return self.nodes.size

    @property
    def ndim(self) -> int:
        """As of NumPy's arrays."""
        return self.nodes.ndim

    @property
    def T(self) -> "Array":
        """The transpose."""
        return self._once(("T",), lambda: Array(self.tape, self.nodes.T))

    def __len__(self) -> int:
        return len(self.nodes)

    def __iter__(self) -> Iterator[Any]:
        return (self[k] for k in range(len(self)))

    def __getitem__(self, key: Any) -> Any:
        if isinstance(key, Node):
            key = key.__index__()
        if isinstance(key, tuple):
            key = tuple(each.__index__() if isinstance(each, Node) else each for each in key)

        def make() -> Any:
            try:
                found = self.nodes[key]
            except IndexError as error:
                raise NoEntry(self, key) from error
            return Array(self.tape, found) if isinstance(found, np.ndarray) else found

        return self._once(("[]", repr(key)), make)

    def sum(self, axis: int | None = None, dtype: None = None, out: None = None) -> Any:
        """The sum of all, or along one axis."""
        if axis is None:
            return self._once(("sum",), lambda: self.tape.total(self.nodes.ravel()))
        rows = np.moveaxis(self.nodes, axis, -1)
        return self._once(("sum", axis), lambda: _along(self.tape, rows))

    def mean(self, axis: int | None = None, dtype: None = None, out: None = None) -> Any:
        """The mean of all, or along one axis."""
        return self.sum(axis) / (self.size if axis is None else self.shape[axis])

    def dot(self, other: Any) -> Any:
        """The product @."""
        return self @ other

    def __bool__(self) -> NoReturn:
        raise Untraceable("a condition on several numbers, whose values are not known here")

    def _once(self, what: tuple[Any, ...], make: Callable[[], Any]) -> Any:
        return _once(self.tape, (*what, id(self)), (self,), make)


def apply(tape: Tape, op: str, *inputs: Any) -> Any:
    """An operator, comparison or function of numbers, nodes and arrays of either."""
    if op == "@":
        return _matmul(tape, *inputs)
    given = [_nodes_of(value) for value in inputs]
    if op in ("<=", ">="):
        a, b = given if op == "<=" else given[::-1]
        return _each(tape, lambda less, more: _compared(tape, less, more), a, b)
    if op in OPERATORS:
        return _shared(tape, op, inputs, lambda a, b: tape.binary(op, a, b), given)
    return _shared(tape, op, inputs, lambda a: tape.unary(op, a), given)


def words(node: Node, deepest: int = 4) -> str:
    """An expression as it could be written, without what is deep."""
    if node.op in "yqc":
        return f"{node.args[0]:g}" if node.op == "c" else f"{node.op}[{node.args[0]}]"
    if deepest == 0:
        return "..."
    inner = [words(arg, deepest - 1) for arg in node.args[:4]] + ["..."] * (len(node.args) > 4)
    if node.op in OPERATORS:
        return f"({inner[0]} {node.op} {inner[1]})"
    return f"{'-' if node.op == 'neg' else node.op}({', '.join(inner)})"


def _compared(tape: Tape, less: Any, more: Any) -> Any:
    a, b = tape.constant(less), tape.constant(more)
    if a.varies or b.varies:
        return Relation(a, b)
    return tape.value(a) <= tape.value(b)


def _equal(self: Any, other: Any) -> Any:
    if isinstance(self, Node) and not self.varies and not isinstance(other, Array):
        try:
            return self.tape.value(self) == float(other)
        except (Untraceable, TypeError, ValueError):
            pass
    raise Untraceable(
        "== of what depends on the actions: an equality has no inside; write band(a, b, width)"
    )


def _value(node: Node) -> float | None:
    return node.args[0] if node.op == "c" else None


def objects(items: list[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    """An array of things that NumPy does not know."""
    out = np.empty(len(items), dtype=object)
    out[:] = items
    return out.reshape(shape)


def _nodes_of(value: Any) -> Any:
    if isinstance(value, Array):
        return value.nodes
    return value if isinstance(value, Node) else np.asarray(value)


def _each(tape: Tape, function: Callable[..., Any], *given: Any) -> Any:
    if all(isinstance(each, Node) or each.ndim == 0 for each in given):
        return function(*(each if isinstance(each, Node) else each[()] for each in given))
    arrays = [objects([each], ()) if isinstance(each, Node) else each for each in given]
    try:
        grids = np.broadcast_arrays(*arrays)
    except ValueError:
        raise Untraceable(f"{_shapes(tape, arrays)} do not go together") from None
    return Array(tape, objects([*map(function, *(g.ravel() for g in grids))], grids[0].shape))


def _shared(
    tape: Tape, op: str, inputs: tuple[Any, ...], function: Callable[..., Any], given: list[Any]
) -> Any:
    """The same array of the same arrays: what every agent's cost writes is computed once."""
    if not any(isinstance(each, Array) for each in inputs):
        return _each(tape, function, *given)
    known = tuple(
        id(each) if isinstance(each, Array | Node | np.ndarray) else repr(each) for each in inputs
    )
    return _once(tape, (op, *known), inputs, lambda: _each(tape, function, *given))


def _once(tape: Tape, key: tuple[Any, ...], keep: tuple[Any, ...], make: Callable[[], Any]) -> Any:
    found = tape.arrays.get(key)
    if found is None:  # what the key names by its address must stay
        found = tape.arrays[key] = (make(), keep)
    return found[0]


def by_shape(shape: tuple[int, ...]) -> str:
    """A shape in words."""
    return "x".join(map(str, shape)) or "one number"


def _shapes(tape: Tape, arrays: Iterable[NDArray[Any]]) -> str:
    """Arrays in words."""
    found = [(tape.parameter_of(each)[0], by_shape(each.shape)) for each in arrays]
    return " and ".join(f"'{n}' of {shape}" if n else f"an array of {shape}" for n, shape in found)


def _along(tape: Tape, rows: NDArray[Any]) -> Array:
    flat = rows.reshape(-1, rows.shape[-1])
    return Array(tape, objects([tape.total(row) for row in flat], rows.shape[:-1]))


def _matmul(tape: Tape, left: Any, right: Any) -> Any:
    def make() -> Any:
        a, b = _nodes_of(left), _nodes_of(right)
        if getattr(a, "ndim", 0) == 0 or getattr(b, "ndim", 0) == 0 or max(a.ndim, b.ndim) > 2:
            raise Untraceable("@ is of vectors and matrices")
        columns = b.T if b.ndim == 2 else b[None]
        rows = a if a.ndim == 2 else a[None]
        if rows.shape[1] != columns.shape[1]:
            raise Untraceable(f"@ of {_shapes(tape, (a, b))}")
        products = [
            tape.total(tape.binary("*", x, z) for x, z in zip(row, column, strict=True))
            for row in rows for column in columns
        ]  # fmt: skip
        shape = a.shape[:-1] + (b.shape[1:] if b.ndim == 2 else ())
        return products[0] if shape == () else Array(tape, objects(products, shape))

    return _once(tape, ("@", id(left), id(right)), (left, right), make)


def _of_numpy(tape: Tape, ufunc: Any, method: str, inputs: Any, options: Any) -> Any:
    name = {"absolute": "abs", "fabs": "abs", "negative": "neg"}.get(ufunc.__name__, ufunc.__name__)
    if name == "add" and method == "reduce":
        return inputs[0].sum()
    if method != "__call__" or options:
        raise Untraceable(f"np.{ufunc.__name__}.{method} is not known here")
    if name == "square":
        return apply(tape, "**", inputs[0], 2)
    if name in ("equal", "not_equal"):
        return _equal(next(each for each in inputs if isinstance(each, Node | Array)), None)
    if name in FUNCTIONS or name == "neg" or name in UFUNCS:
        return apply(tape, UFUNCS.get(name, name), *inputs)
    raise Untraceable(f"np.{ufunc.__name__} is not known here")
