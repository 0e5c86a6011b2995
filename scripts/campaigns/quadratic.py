"""A game of one's own for the campaigns: affine F, bounds that are lines and discs.

dJ_i/dy_a = A_a y + b_a, from J_i = y_i'A_ii y_i/2 + y_i'(A_i,-i y_-i + b_i) with A_ii symmetric.
Constraints: C y - d <= 0, then sign (|B_l y - r_l|^2 - delta_l^2) <= 0, sign -1 for the outside of
a disc, which is not convex.

Parameters q = [m, N, lines, discs, k, offsets (N + 1), A, b, C, d, and of each disc
sign, delta, r (k), B (k x m)].
"""

import sys
from dataclasses import dataclass
from types import ModuleType

import numpy as np

from gne_mj.game_model import Game
from gne_mj.native import kernel
from gne_mj.plain import FUNCTIONS

HEADER = 5


@dataclass
class Numbers:
    """One such game's numbers.

    Attributes:
        sizes: m_i of each agent.
        slope, offset: A (m, m) and b (m,).
        line, bound: C (lines, m) and d (lines,).
        disc: B (discs, k, m); center: r (discs, k); radius: delta (discs,); sign: (discs,).
    """

    sizes: tuple[int, ...]
    slope: np.ndarray
    offset: np.ndarray
    line: np.ndarray
    bound: np.ndarray
    disc: np.ndarray
    center: np.ndarray
    radius: np.ndarray
    sign: np.ndarray


def quadratic_game(numbers: Numbers, *, plain: bool = False, **stated: object) -> Game:
    """The game, of kernels or of the same functions as plain Python; ``stated`` as of Game."""
    n = numbers
    m, agents = len(n.offset), len(n.sizes)
    at = np.concatenate([[0], np.cumsum(n.sizes)])
    rows = np.concatenate([n.line[:, None, :], np.zeros((0, 1, m))]) if len(n.line) else []
    forms = [*rows, *n.disc]
    owner = np.repeat(np.arange(agents), n.sizes)
    parts = [
        [m, agents, len(n.line), len(n.disc), n.disc.shape[1]], at, n.slope.ravel(), n.offset,
        n.line.ravel(), n.bound,
        *(np.concatenate([[s, delta], r, form.ravel()])
          for s, delta, r, form in zip(n.sign, n.radius, n.center, n.disc, strict=True)),
    ]  # fmt: skip
    return Game(
        name="quadratic",
        kernels=_plain() if plain else sys.modules[__name__],
        parameters=np.concatenate(parts).astype(np.float64),
        sizes=n.sizes,
        in_cost=[
            sorted({i, *owner[np.any(n.slope[at[i] : at[i + 1]] != 0, axis=0)].tolist()})
            for i in range(agents)
        ],
        in_constraint=[sorted(set(owner[np.any(form != 0, axis=0)].tolist())) for form in forms],
        constraint_names=tuple(f"line {k + 1}" for k in range(len(n.line)))
        + tuple(f"disc {k + 1}" for k in range(len(n.disc))),
        affine=True,
        **stated,  # type: ignore[arg-type]
    )


def _plain() -> ModuleType:
    module = ModuleType("plain_quadratic")
    for name in FUNCTIONS:
        kernel_of = globals()[name]

        def function(*arguments, kernel_of=kernel_of):
            return kernel_of(*arguments)

        function.__wrapped__ = kernel_of  # so that its arguments are seen
        setattr(module, name, function)
    return module


@kernel
def slope_at(q):
    """Where A begins."""
    return HEADER + int(q[1]) + 1


@kernel
def lines_at(q):
    """Where C begins."""
    m = int(q[0])
    return slope_at(q) + m * m + m


@kernel
def disc_at(q, l):
    """Where disc l (from 0) begins."""
    m, lines, k = int(q[0]), int(q[2]), int(q[4])
    return lines_at(q) + lines * (m + 1) + l * (2 + k + k * m)


@kernel
def cost(q, i, y):
    """J_i."""
    m = int(q[0])
    base = slope_at(q)
    first, last = int(q[HEADER + i]), int(q[HEADER + i + 1])
    total = 0.0
    for a in range(first, last):
        pull = q[base + m * m + a]
        for b in range(m):
            share = 0.5 if first <= b < last else 1.0
            pull += share * q[base + a * m + b] * y[b]
        total += y[a] * pull
    return total


@kernel
def cost_gradient(q, i, a, y):
    """A_a y + b_a."""
    m = int(q[0])
    base = slope_at(q)
    total = q[base + m * m + a]
    for b in range(m):
        total += q[base + a * m + b] * y[b]
    return total


@kernel
def add_cost_hessian(q, i, a, y, scale, out):
    """A_a, in the entries that are not zero."""
    m = int(q[0])
    base = slope_at(q) + a * m
    for b in range(m):
        if q[base + b] != 0.0:
            out[b] += scale * q[base + b]


@kernel
def offset_of(q, at, k, row, y):
    """Entry ``row`` of B y - r of the disc that begins at ``at``."""
    m = int(q[0])
    total = -q[at + 2 + row]
    for b in range(m):
        total += q[at + 2 + k + row * m + b] * y[b]
    return total


@kernel
def constraint(q, l, y):
    """C_l y - d_l, or sign (|B y - r|^2 - delta^2)."""
    m, lines, k = int(q[0]), int(q[2]), int(q[4])
    if l < lines:
        at = lines_at(q)
        total = -q[at + lines * m + l]
        for b in range(m):
            total += q[at + l * m + b] * y[b]
        return total
    at = disc_at(q, l - lines)
    square = 0.0
    for row in range(k):
        entry = offset_of(q, at, k, row, y)
        square += entry * entry
    length = np.sqrt(square)
    return q[at] * (length - q[at + 1]) * (length + q[at + 1])


@kernel
def constraint_gradient(q, l, a, y):
    """C_la, or 2 sign B_a'(B y - r)."""
    m, lines, k = int(q[0]), int(q[2]), int(q[4])
    if l < lines:
        return q[lines_at(q) + l * m + a]
    at = disc_at(q, l - lines)
    total = 0.0
    for row in range(k):
        total += q[at + 2 + k + row * m + a] * offset_of(q, at, k, row, y)
    return 2.0 * q[at] * total


@kernel
def constraint_hessian(q, l, a, b, y):
    """0, or 2 sign B_a'B_b."""
    m, lines, k = int(q[0]), int(q[2]), int(q[4])
    if l < lines:
        return 0.0
    at = disc_at(q, l - lines)
    total = 0.0
    for row in range(k):
        total += q[at + 2 + k + row * m + a] * q[at + 2 + k + row * m + b]
    return 2.0 * q[at] * total
