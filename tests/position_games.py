"""Random platoons and formations, with profiles inside and what they are in plain NumPy."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from gne_mj.games import formation_game, platoon_game, region_of


@dataclass
class Draw:
    """A game, the numbers that it was made of, and a source of interior profiles."""

    game: Any
    numbers: dict[str, Any]
    rng: Any
    shape: Any  # profile from random numbers, which need not be inside

    def interior(self, used=0.999):
        """A profile some way from the middle, up to this part of the way to the boundary."""
        inside = self.shape(None)
        ray = self.shape(self.rng) - inside
        low, high = 0.0, 1.0
        while np.all(self.game.constraints(inside + high * ray) < 0):
            high *= 2.0
        for _ in range(40):
            half = 0.5 * (low + high)
            kept = np.all(self.game.constraints(inside + half * ray) < 0)
            low, high = (half, high) if kept else (low, half)
        return inside + self.rng.uniform(0.05, used) * low * ray


def random_platoon(seed, count=None):
    """Up to seven agents; each spacing's weight at most that of the one ahead and twice its
    place's, as suffices."""
    rng = np.random.default_rng(seed)
    n = count or int(rng.integers(1, 8))
    lower = rng.uniform(0.3, 2.0, n - 1)
    upper = lower + rng.uniform(0.2, 3.0, n - 1)
    v = rng.uniform(0.1, 2.0, n) * (rng.random(n) < 0.5)
    v[0] = rng.uniform(0.1, 2.0)
    w = np.zeros(n)
    for i in range(1, n):
        w[i] = rng.uniform(0.1, 1.0) * (w[i - 1] + 2 * v[i - 1])
    numbers = {
        "least_spacing": lower, "greatest_spacing": upper,
        "desired_spacing": rng.uniform(0.0, 5.0, n - 1), "spacing_weight": w[1:],
        "desired_place": rng.uniform(-9, 3, n), "place_weight": v,
        "leader_range": (rng.uniform(-6, -1), rng.uniform(0.5, 6)),
    }  # fmt: skip

    def shape(rng):
        low, high = numbers["leader_range"]
        lead, spacing = 0.5 * (low + high), 0.5 * (lower + upper)
        if rng is not None:
            lead, spacing = rng.uniform(low, high), rng.uniform(lower, upper)
        return lead - np.cumsum([0.0, *spacing])

    return Draw(platoon_game(n, **numbers), numbers, rng, shape)


def random_region(rng):
    """A disc, a polygon, a box, or two of them; the point 0 is inside all."""
    given = {}
    while not given:
        if rng.random() < 0.5:
            given |= {"center": rng.uniform(-1, 1, 2), "radius": rng.uniform(2.0, 5.0)}
        if rng.random() < 0.4:
            angle = 0.5 * np.pi * (np.arange(4) + rng.uniform(0.1, 0.9, 4))
            corners = rng.uniform(2.0, 4.0) * np.column_stack([np.cos(angle), np.sin(angle)])
            given |= {"vertices": corners[:: rng.choice([1, -1])] + rng.uniform(-0.3, 0.3, 2)}
        if rng.random() < 0.4:
            given |= {"box": [rng.uniform(-5, -1, 2), rng.uniform(1, 5, 2)]}
    return given


def random_formation(seed, count=None):
    """Any graph of up to seven agents whose parts all have a leader, in a random region."""
    rng = np.random.default_rng(seed)
    n = count or int(rng.integers(1, 8))
    pairs = [(i, j) for i in range(n) for j in range(i + 1, n)]
    edges = [pair[:: rng.choice([1, -1])] for pair in pairs if rng.random() < 0.5]
    links = [pair[:: rng.choice([1, -1])] for pair in pairs if rng.random() < 0.3]
    v = rng.uniform(0.2, 2.0, n) * (rng.random(n) < 0.3)
    part = list(range(n))
    for i, j in edges:
        part = [part[i] if each == part[j] else each for each in part]
    for one in set(part):
        v[part.index(one)] = rng.uniform(0.2, 2.0)
    numbers = {
        "desired_place": rng.uniform(-4, 4, (n, 2)), "edges": edges, "place_weight": v,
        "edge_weight": rng.uniform(0.2, 3.0, len(edges)),
        "desired_offset": rng.uniform(-3, 3, (len(edges), 2)), "links": links,
        "link_length": rng.uniform(0.5, 3.0, len(links)),
    }  # fmt: skip
    region = region_of(**random_region(rng))

    def shape(rng):
        near = np.zeros((n, 2)) if rng is None else rng.normal(size=(n, 2))
        return (region.middle + near).ravel()

    return Draw(formation_game(region=region, **numbers), {**numbers, "region": region}, rng, shape)
