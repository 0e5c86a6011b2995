"""Hostile policies on fleets in MuJoCo, under the barrier and without: who leaves, and when.

Four policies: noise, uniform anew each period; a corner of what is allowed, held; one that is
turned about every few periods; and one that pushes the constraint which is used most, as hard as it
can. Starts are at rest, up to 0.99 of the way from the equilibrium to the boundary. Whether an exit
is at a control instant is told by the step that it was in.
"""

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gne_mj.environment.episodes import Episodes
from gne_mj.environment.load import setting_in
from gne_mj.environment.setting import Guard, Setting

PULL, LIMIT, AT_ONCE = 20.0, 200.0, 250
SHARE_UNGUARDED = 5  # of so many episodes one is run without a barrier too


class Case(NamedTuple):
    """Fleets and how they are stepped; of all episodes, how many in a hundred are of it."""

    scenario: str
    period: float
    between: str
    duration: float
    weight: int
    decentralised: bool = False


CASES = (
    Case("velocity-sync", 0.02, "watched", 10.0, 40),
    Case("velocity-sync", 0.1, "watched", 10.0, 20),
    Case("velocity-sync", 0.1, "guarded", 10.0, 20),
    Case("velocity-sync", 0.02, "watched", 10.0, 10, True),
    Case("planar-sync", 0.02, "watched", 10.0, 10),
)
Policy = Callable[[Episodes, np.random.Generator, int], np.ndarray]


def noise(episodes: Episodes, rng: np.random.Generator, period: int) -> np.ndarray:
    """Anything, anew each period."""
    return rng.uniform(-PULL, PULL, size=episodes.fleets.rows.pull.shape)


def corner(episodes: Episodes, rng: np.random.Generator, period: int) -> np.ndarray:
    """A corner of what is allowed, held."""
    if period > 0:
        return episodes.fleets.rows.pull.copy()
    return rng.choice([-PULL, PULL], size=episodes.fleets.rows.pull.shape)


def turned(episodes: Episodes, rng: np.random.Generator, period: int) -> np.ndarray:
    """The same, turned about every seven periods."""
    now = corner(episodes, rng, period)
    return -now if period > 0 and period % 7 == 0 else now


def towards_the_bound(episodes: Episodes, rng: np.random.Generator, period: int) -> np.ndarray:
    """As hard as allowed on the constraint that is nearest to its bound."""
    game, rows = episodes.setting.system.game, episodes.fleets.rows
    nearest = np.argmax(rows.g, axis=1)
    slopes = [game.constraint_jacobian(y)[k] for y, k in zip(rows.y, nearest, strict=True)]
    return PULL * np.sign(np.array(slopes))


POLICIES: dict[str, Policy] = {
    "noise": noise, "corner": corner, "turned about": turned, "towards the bound": towards_the_bound
}  # fmt: skip


class Count(NamedTuple):
    """What episodes came to."""

    episodes: int
    at_instants: int
    between: int
    stuck: int
    limited: int  # with a period whose input actuators did not deliver
    nearest: float  # least share of a slack at y* that was left at a period's end


def main() -> int:
    """Run the campaign; 1 if a guarded episode left at an instant, or at all where it must not."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--episodes", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    began, bad, total = time.perf_counter(), 0, 0
    heads = "fleet, period, policy", "guarded", "left at an instant", "between", "limited"
    print("| " + " | ".join((*heads, "least slack", "unguarded, left")) + " |\n" + "|---" * 7 + "|")
    for case in CASES:
        for name, policy in POLICIES.items():
            asked = max(1, round(options.episodes * case.weight / 100 / len(POLICIES)))
            under = campaign(case, policy, asked, options.seed, guarded=True)
            free = campaign(case, policy, -(-asked // SHARE_UNGUARDED), options.seed, guarded=False)
            total += under.episodes
            bad += under.at_instants + under.stuck + under.between * (case.between == "guarded")
            how = ", cut" * (case.between == "guarded") + ", each alone" * case.decentralised
            left = (free.at_instants + free.between) / free.episodes
            print(
                f"| {case.scenario}, {case.period:g} s{how}, {name} | {under.episodes} |"
                f" {under.at_instants} | {under.between} | {under.limited} | {under.nearest:.1e} |"
                f" {left:.0%} of {free.episodes} |",
                flush=True,
            )
    print(f"\n{total} episodes under the barrier in {time.perf_counter() - began:.0f} s:",
          "none left where that is promised" if not bad else f"{bad} FAILED")  # fmt: skip
    return 1 if bad else 0


def setting(case: Case, guarded: bool) -> Setting:
    """What episodes of a case are."""
    changes = {
        "simulation.control_period": case.period, "simulation.duration": case.duration,
        "agents.input_limit": LIMIT,
    }  # fmt: skip
    options = {"start": "random", "spread": 0.99}
    guard = Guard(PULL, case.between, case.decentralised) if guarded else None  # type: ignore
    with setting_in(case.scenario, changes, None, options) as found:
        return replace(found, guard=guard)


def campaign(case: Case, policy: Policy, count: int, seed: int, *, guarded: bool) -> Count:
    """So many episodes, some at once; number e by seed + e."""
    made, found = setting(case, guarded), Count(0, 0, 0, 0, 0, np.inf)
    for first in range(0, count, AT_ONCE):
        number = min(AT_ONCE, count - first)
        episodes = Episodes(made, number)
        for row in range(number):
            episodes.begin(row, np.random.default_rng([seed, first + row]))
        fresh = play(episodes, policy, np.random.default_rng([seed, first, 1]))
        episodes.fleets.close()
        sums = (a + b for a, b in zip(found[:-1], fresh[:-1], strict=True))
        found = Count(*sums, min(found.nearest, fresh.nearest))
    return found


def play(episodes: Episodes, policy: Policy, rng: np.random.Generator) -> Count:
    """All of them to their ends."""
    rows, made = episodes.fleets.rows, episodes.setting
    rows.moves[:] = 1
    episodes.fleets.look()
    scale = -made.system.game.constraints(made.system.centre)
    going, period, nearest = np.ones(episodes.fleets.count, dtype=bool), 0, np.inf
    while np.any(going):
        taken = episodes.step(policy(episodes, rng, period), going)
        going &= ~(taken.left | taken.over)
        period += 1
        nearest = min(nearest, float(np.min(-rows.g[going] / scale, initial=np.inf)))
    exits = [(row, left) for row, left in enumerate(episodes.fleets.exits) if left is not None]
    stuck = sum(left.stuck for _, left in exits)
    instants = sum(rows.step[row] % made.steps == 0 and not left.stuck for row, left in exits)
    between = len(exits) - stuck - instants
    limited = int(np.sum(rows.limited > 0))
    return Count(episodes.fleets.count, int(instants), between, stuck, limited, nearest)


if __name__ == "__main__":
    sys.exit(main())
