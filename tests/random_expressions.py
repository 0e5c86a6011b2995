"""Random games of expressions, and hyper-dual numbers: another way to their derivatives."""

from types import SimpleNamespace

import numpy as np

UNARY = {
    "sin": np.sin, "cos": np.cos, "tanh": np.tanh, "arctan": np.arctan,
    "exp": lambda u: np.exp(0.3 * np.tanh(u)), "log": lambda u: np.log(1.5 + u**2),
    "sqrt": lambda u: np.sqrt(1.2 + u**2), "log1p": lambda u: np.log1p(u**2),
    "square": lambda u: u**2, "cube": lambda u: u**3, "power": lambda u: (2.0 + u**2) ** 1.5,
    "negative": lambda u: -u, "inverse": lambda u: 1.0 / (1.0 + u**2),
}  # fmt: skip
BINARY = {
    "+": lambda u, v: u + v, "-": lambda u, v: u - v, "*": lambda u, v: u * v,
    "/": lambda u, v: u / (2.0 + np.cos(v)),
}  # fmt: skip
LEAVES = {
    "own": lambda i, y, p: y[i],
    "next": lambda i, y, p: y[(i + 1) % len(y)],
    "before": lambda i, y, p: y[i - 1],
    "weight": lambda i, y, p: p.weight[i] * y[i],
    "offset": lambda i, y, p: p.offset[i],
    "price": lambda i, y, p: p.price + 0.0,
    "mean": lambda i, y, p: y.mean(),
    "row": lambda i, y, p: p.matrix[i] @ y,
    "distance": lambda i, y, p: ((y - p.offset) ** 2).sum(),
    "chain": lambda i, y, p: sum(np.sin(y[j] - y[j - 1]) for j in range(1, len(y))),
    "near": lambda i, y, p: sum((y[i] - y[j]) ** 2 for j in p.near[i]),
    "pairs": lambda i, y, p: sum(np.tanh(y[i] * y[j]) for j in range(len(y)) if j != i),
    "nested": lambda i, y, p: ((p.matrix @ y - p.offset) ** 2).sum(),
    "number": lambda i, y, p: 0.1 * i + 0.5,
}  # fmt: skip


def random_tree(rng, depth):
    """Nested tuples of names."""
    if depth == 0 or rng.random() < 0.15:
        return (str(rng.choice([*LEAVES])),)
    if rng.random() < 0.4:
        return str(rng.choice([*UNARY])), random_tree(rng, depth - 1)
    return str(rng.choice([*BINARY])), random_tree(rng, depth - 1), random_tree(rng, depth - 1)


def value(tree, i, y, p):
    """A tree's value; of anything that computes like a number."""
    name, *inner = tree
    if not inner:
        return LEAVES[name](i, y, p)
    values = [value(each, i, y, p) for each in inner]
    return (UNARY if len(inner) == 1 else BINARY)[name](*values)


class RandomGame:
    """Its functions and numbers."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        n = self.count = int(rng.integers(2, 8))
        self.trees = [random_tree(rng, int(rng.integers(1, 4))) for _ in range(2)]
        self.rows = [random_tree(rng, int(rng.integers(1, 4))) for _ in range(2)]
        near = [rng.permutation(n)[: int(rng.integers(1, n + 1))].tolist() for _ in range(n)]
        self.near = [[j for j in row if j != i] or [(i + 1) % n] for i, row in enumerate(near)]
        self.numbers = {
            "weight": rng.normal(size=n), "offset": rng.normal(size=n), "price": 0.7,
            "matrix": rng.normal(size=(n, n)),
        }  # fmt: skip
        self.y = rng.uniform(-1.0, 1.0, n)
        self.numbers = {name: self.numbers[name] for name in sorted(self._read())}

    def _read(self):
        """The names of the numbers that are read."""
        given, found = self.plain(), set()

        class Recorder:
            def __getattr__(self, name):
                found.add(name)
                return getattr(given, name)

        for i in range(self.count):
            self.cost(i, self.y, Recorder())
        list(self.constraints(self.y, Recorder()))
        return found & set(self.numbers)

    def cost(self, i, y, p):
        return 0.3 * y[i] ** 2 + value(self.trees[i % 2], i, y, p)

    def g(self, k, y, p):
        return value(self.rows[k % 2], k, y, p) + 0.1 * y[k] - 5.0

    def constraints(self, y, p):
        for k in range(self.count):
            yield self.g(k, y, p) <= 0.0

    def plain(self):
        """The parameters as plain numbers."""
        return SimpleNamespace(**self.numbers, near=self.near)


class HyperDual:
    """f + a e1 + b e2 + c e1 e2: c carries a second derivative (Fike and Alonso, 2011)."""

    def __init__(self, f, a=0.0, b=0.0, c=0.0):
        self.f, self.a, self.b, self.c = f, a, b, c

    def _with(self, value, first, second):
        return HyperDual(value, first * self.a, first * self.b,
                         first * self.c + second * self.a * self.b)  # fmt: skip

    def __add__(self, other):
        o = other if isinstance(other, HyperDual) else HyperDual(other)
        return HyperDual(self.f + o.f, self.a + o.a, self.b + o.b, self.c + o.c)

    def __neg__(self):
        return self._with(-self.f, -1.0, 0.0)

    def __sub__(self, other):
        return self + -other

    def __rsub__(self, other):
        return -self + other

    def __mul__(self, other):
        o = other if isinstance(other, HyperDual) else HyperDual(other)
        return HyperDual(
            self.f * o.f, self.a * o.f + self.f * o.a, self.b * o.f + self.f * o.b,
            self.c * o.f + self.a * o.b + self.b * o.a + self.f * o.c,
        )  # fmt: skip

    __radd__, __rmul__ = __add__, __mul__

    def __pow__(self, n):
        return self._with(self.f**n, n * self.f ** (n - 1), n * (n - 1) * self.f ** (n - 2))

    def __truediv__(self, other):
        return self * (other**-1.0 if isinstance(other, HyperDual) else 1.0 / other)

    def __rtruediv__(self, other):
        return self**-1.0 * other

    def sin(self):
        return self._with(np.sin(self.f), np.cos(self.f), -np.sin(self.f))

    def cos(self):
        return self._with(np.cos(self.f), -np.sin(self.f), -np.cos(self.f))

    def exp(self):
        return self._with(*[np.exp(self.f)] * 3)

    def log(self):
        return self._with(np.log(self.f), 1.0 / self.f, -1.0 / self.f**2)

    def log1p(self):
        return (self + 1.0).log()

    def sqrt(self):
        return self**0.5

    def tanh(self):
        t = np.tanh(self.f)
        return self._with(t, 1 - t**2, -2 * t * (1 - t**2))

    def arctan(self):
        d = 1.0 / (1.0 + self.f**2)
        return self._with(np.arctan(self.f), d, -2 * self.f * d**2)


def hyper_dual(function, y, a, b):
    """f, df/dy_a and d2f/dy_a dy_b of a function of an object array."""
    given = np.empty(len(y), dtype=object)
    given[:] = [HyperDual(f, float(k == a), float(k == b)) for k, f in enumerate(y)]
    found = function(given)
    return (found.f, found.a, found.c) if isinstance(found, HyperDual) else (found, 0.0, 0.0)
