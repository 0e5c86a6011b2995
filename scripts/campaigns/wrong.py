"""Random systems for the claims of ``certify``: certified ones, and many that are wrong somewhere.

Wrong are games (F not monotone, constraints not convex, no bounds stated), coupling gains (weak),
inputs (limited), disturbances (declared, with faults within or beyond), faults, starts (on or
outside a bound), and robots' springs (not passive).
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import stiff
from draws import towards_bound
from kinds import (
    Both,
    Kind,
    as_stiff,
    cascades,
    channels,
    integrators,
    kicked,
    lane,
    log_uniform,
    quadratic_numbers,
    random_law,
    robots,
)
from quadratic import Numbers, quadratic_game

from gne_mj.barrier import Schedule
from gne_mj.controllers import FullyDistributed, PartialInformation
from gne_mj.faults import Bias, Fault, MessageLoss, Noise, Push, Saturation, SensorDelay
from gne_mj.margins import Disturbance, influence, tightening
from gne_mj.plants.agents import Agents
from gne_mj.system import Clock, System
from gne_mj.system.steps import largest_step
from gne_mj.theory import Theorem

STEPS_A_RUN = 12_000


@dataclass
class Case:
    """One system with its clock, and the oracle's game and loop.

    Attributes:
        oracle, loop: the game and the closed loop without faults as the oracle has them.
        kind, mode: what it is counted by.
    """

    system: System
    clock: Clock
    oracle: stiff.Game
    loop: stiff.Loop
    kind: str
    mode: str


@dataclass
class Parts:
    """What a system is made of, before the program has looked at it."""

    both: Both
    agents: Agents
    kind: str
    mode: str
    engine: str
    inside: bool
    keywords: dict[str, Any]


def own(rng: np.random.Generator, count: int) -> Both:
    """A game of one's own: right ones, and wrong ones of four kinds."""
    n, half = quadratic_numbers(rng, count)
    m = len(n.offset)
    which = rng.choice(
        ["right", "not monotone", "concave", "hole", "merely"], p=[0.3, 0.2, 0.15, 0.25, 0.1]
    )
    if which == "not monotone":
        least = float(np.linalg.eigvalsh(0.5 * (n.slope + n.slope.T))[0])
        n.slope -= (least + log_uniform(rng, 0.01, 3.0)) * np.eye(m)
    elif which == "concave":
        n.slope[0, 0] = -log_uniform(rng, 0.05, 3.0)
    elif which == "merely":
        twist = rng.normal(size=(m, m)) * (np.repeat(np.arange(count), n.sizes)[:, None]
                                           != np.repeat(np.arange(count), n.sizes))  # fmt: skip
        n.slope = twist - twist.T
    elif which == "hole":
        _hole(rng, n, m)
    stated = {"box": (-half, half)} if rng.random() < 0.8 else {}
    oracle = stiff.Game(
        np.repeat(np.arange(count), n.sizes), stiff.Affine(n.slope, n.offset),
        n.line, n.bound, n.disc, n.center, n.radius, n.sign,
    )  # fmt: skip
    return Both(quadratic_game(n, **stated), oracle, np.zeros(m))


def _hole(rng: np.random.Generator, n: Numbers, m: int) -> None:
    """Keep profiles out of a disc that does not hold 0."""
    center = rng.normal(size=m)
    away = log_uniform(rng, 0.2, 2.0)
    center *= away / np.linalg.norm(center)
    n.disc = np.concatenate([n.disc, np.eye(m)[None]])
    n.center = np.concatenate([n.center, center[None]])
    n.radius = np.append(n.radius, away * rng.uniform(0.2, 0.95))
    n.sign = np.append(n.sign, -1.0)


KINDS = {
    "lane robots": Kind(lane, robots, "full", share=3.0, most=8),
    "lane robots, MuJoCo": Kind(lane, robots, "full", "mujoco", share=2.0, most=8),
    "lane robots, partial": Kind(lane, robots, "partial", share=3.0, most=6),
    "channels, cascades": Kind(channels, cascades, "full", share=2.0, most=8),
    "channels, cascades, distributed": Kind(channels, cascades, "distributed", share=2.0, most=8),
    "own": Kind(own, integrators, "full", share=4.0, most=4),
    "own, partial": Kind(own, integrators, "partial", share=2.0, most=3),
}
MODES = {"continuous": 0.45, "implicit": 0.3, "decentralised": 0.15, "sampled": 0.1}
# Not all combinations are drawn
FAULTY = {
    ("lane robots", "continuous"), ("lane robots", "implicit"), ("lane robots", "decentralised"),
    ("lane robots, MuJoCo", "implicit"), ("lane robots, partial", "implicit"),
    ("channels, cascades", "implicit"), ("lane robots", "sampled"),
}  # fmt: skip
NOT_DRAWN = {
    (kind, "decentralised")
    for kind in (
        "lane robots, MuJoCo",
        "lane robots, partial",
        "channels, cascades",
        "own, partial",
    )
}


def draw(rng: np.random.Generator) -> Parts:
    """The parts of one system; :func:`build` puts them together, which may be refused."""
    shares = np.array([kind.share for kind in KINDS.values()])
    name = str(rng.choice(list(KINDS), p=shares / shares.sum()))
    mode = str(rng.choice(list(MODES), p=list(MODES.values())))
    if (name, mode) in NOT_DRAWN:
        mode = "implicit"
    kind = KINDS[name]
    count = int(rng.integers(1 if kind.law == "full" else 2, kind.most + 1))
    both = kind.game(rng, count)
    agents = kind.agents(rng, both.game)
    if rng.random() < 0.25:
        limit = log_uniform(rng, 0.1, 100.0, agents.channels)
        some = rng.random(agents.channels) < (0.5 if rng.random() < 0.5 else 1.0)
        agents = replace(agents, input_limit=np.where(some, limit, np.inf))
    if kind.agents is robots and rng.random() < 0.05:
        table = agents.parameters.copy()
        table[0, 2:4] = -log_uniform(rng, 0.01, 0.3), rng.uniform(0, 2)
        agents = replace(agents, parameters=table)
    inside = rng.random() > 0.03
    law = random_law(rng, kind.law, count)
    keywords: dict[str, Any] = {
        "law": law, "rho": float(log_uniform(rng, 1e-4, 1.0)), "engine": kind.engine,
        "mode": "implicit" if mode == "decentralised" else mode,
        "decentralised": mode == "decentralised" and kind.law != "distributed",
        "seed": int(rng.integers(2**31)),
        "integrator": "euler" if rng.random() < (0.1 if mode == "continuous" else 0.8) else "rk4",
    }  # fmt: skip
    if rng.random() < 0.04:
        keywords["schedule"] = Schedule("exponential", 1.0, keywords["rho"], 1.0)
    return Parts(both, agents, name, mode, kind.engine, inside, keywords)


def build(rng: np.random.Generator, parts: Parts) -> Case:
    """The case, as far as the program takes it.

    Raises:
        InvalidInput: what the program refuses (InfeasibleStart for a start outside).
    """
    both, agents, keywords = parts.both, parts.agents, dict(parts.keywords)
    step = float(log_uniform(rng, 5e-4, 5e-3))
    steps = int(rng.integers(1, 30)) if parts.mode != "continuous" else 1
    game = both.game
    struck = (parts.kind, parts.mode) in FAULTY and rng.random() < 0.6
    if struck and parts.mode == "implicit" and rng.random() < 0.7:
        bound = _bound(rng, parts, game.actions)
        effect = influence(agents, step, keywords["integrator"], steps, bound.delay)
        game = game.tightened(tightening(game, effect.of(bound)))
        keywords["disturbance"] = bound
        stronger = 1.0 if rng.random() < 0.8 else 1.5
        keywords["faults"] = tuple(_within(rng, bound, stronger, step * steps, game.actions))
    elif struck:
        keywords["faults"] = _anything(rng, parts)
    margin = float(log_uniform(rng, 1e-9, 0.9)) if rng.random() < 0.5 else rng.uniform(0.1, 0.9)
    y = towards_bound(rng, game, both.middle, margin)
    if not parts.inside:
        beyond = 1.0 + float(log_uniform(rng, 1e-9, 1.0))
        y = both.middle + (y - both.middle) * beyond / (1.0 - margin)
    hard = float(rng.choice([0.0, 1.0, 5.0, 20.0]))
    state = kicked(rng, agents, y, hard)
    system = System("run", game, agents, state=state, **keywords)
    system = _with_gains(rng, system)
    largest = largest_step(system)
    if step > largest and system.integrator != "rosenbrock":
        step = 0.9 * largest
    period = steps * step
    total = min(float(log_uniform(rng, 5.0, 60.0)), STEPS_A_RUN * step)
    if parts.mode != "continuous":
        total = min(total, 2000 * period)
    periods = max(1, round(total / period))
    every = max(1, periods // 100)
    clock = Clock(periods * period, step, period, every * period)
    loop, _ = as_stiff(system, both.oracle)
    return Case(system, clock, both.oracle, loop, parts.kind, parts.mode)


def _with_gains(rng: np.random.Generator, system: System) -> System:
    """Coupling gains from weak to strong; an epsilon from too great to small."""
    law = system.law
    if isinstance(law, PartialInformation):
        coupling = Theorem(system).coupling
        assert coupling is not None
        conditions = [coupling.rigorous, *([coupling.quadratic] if coupling.quadratic else [])]
        least = min(condition.least for condition in conditions)
        if not 1e-3 < least < 1e3:
            least = 1.0
        return replace(system, law=replace(law, coupling=least * float(log_uniform(rng, 0.1, 4.0))))
    if isinstance(law, FullyDistributed):
        slow = replace(law, epsilon=float(log_uniform(rng, 1e-4, 3e-2)))
        adaptive = system.mode == "continuous" and system.schedule is None
        integrator = "rosenbrock" if adaptive and rng.random() < 0.7 else system.integrator
        return replace(system, law=slow, integrator=integrator)
    return system


def _bound(rng: np.random.Generator, parts: Parts, m: int) -> Disturbance:
    weak = "channels" in parts.kind
    push = 10.0 ** (rng.uniform(-2, 0) if weak else rng.uniform(-0.5, 1.0))
    noise = 10.0 ** rng.uniform(-5, -3 if weak else -2)
    return Disturbance(np.full(m, push), np.full(m, noise), int(rng.integers(0, 3)))


def _within(
    rng: np.random.Generator, bound: Disturbance, beyond: float, period: float, m: int
) -> list[Fault]:
    profile = str(rng.choice(["constant", "square", "sine", "random"]))
    faults: list[Fault] = [
        Push(
            agents=(i,), force=beyond * float(bound.push[i]) * float(rng.choice([-1, 1])),
            profile=profile, period=period * int(rng.integers(1, 40)),
        )
        for i in range(m)
    ]  # fmt: skip
    faults.append(Noise(amplitude=beyond * float(bound.noise[0])))
    if bound.delay:
        faults.append(SensorDelay(periods=int(rng.integers(0, bound.delay + 1))))
    return faults


def _anything(rng: np.random.Generator, parts: Parts) -> tuple[Fault, ...]:
    size = float(log_uniform(rng, 0.01, 10.0))
    small = 1e-2 * size
    choices: list[Fault] = [
        Push(force=size, profile="square"), Saturation(limit=size), Noise(amplitude=small),
        Bias(offset=small),
    ]  # fmt: skip
    if parts.mode != "continuous":
        choices.append(SensorDelay(periods=int(rng.integers(1, 5))))
        if "partial" in parts.kind:
            choices.append(MessageLoss(probability=0.3))
    return (choices[int(rng.integers(len(choices)))],)
