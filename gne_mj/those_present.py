"""What a run in which agents leave and join is judged by: the games that were played in it."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj import kept_apart
from gne_mj.membership import There
from gne_mj.system import System

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

MOST_NAMED = 3  # refusals that a sentence tells


@dataclass(frozen=True, eq=False)
class ThosePresent:
    """The systems of those present in a run; of others the only system.

    Attributes:
        system: those there at the end, by themselves.
        others: those of other times.
        agents, actions, constraints: of those there at the end, in the whole system.
        time: sample times (samples,) since they were.
        action: their y there, (samples, m').
        membership: what the loop tells of who was there.
    """

    system: System
    others: tuple[System, ...]
    whole: System
    agents: Indices
    actions: Indices
    constraints: Indices
    time: Array
    action: Array
    membership: dict[str, Any] | None = None

    @property
    def systems(self) -> tuple[System, ...]:
        """All of them."""
        return (*self.others, self.system)

    def holding(self, ended: tuple[str, float, float]) -> kept_apart.Pairs:
        """See :func:`gne_mj.kept_apart.holding`."""
        pairs = kept_apart.holding(self.system, self.time, self.action, ended)
        return [(int(self.agents[i]), int(self.agents[j])) for i, j in pairs]

    def told(self, holding: kept_apart.Pairs) -> str:
        """How the sentence of how the run ended goes on: of pairs that hold it, and of refusals."""
        refused = refused_text(self.whole.game.agent_name, self.membership)
        return kept_apart.held_text(holding) + refused

    def spread(self, section: dict[str, Any]) -> dict[str, Any]:
        """A section of a report with lists of those present as lists of all, None for others."""
        if len(self.agents) == self.whole.game.agents:
            return section
        places = {
            "penalised": (self.actions, self.whole.game.actions),
            "variational": (self.actions, self.whole.game.actions),
            "multipliers": (self.constraints, self.whole.game.constraints_count),
        }
        found = dict(section)
        for key, (entries, size) in places.items():
            if section[key] is not None:
                found[key] = [None] * size
                for at, value in zip(entries, section[key], strict=True):
                    found[key][at] = value
        return found


def those_present(
    system: System, time: Array, action: Array, membership: dict[str, Any] | None
) -> ThosePresent:
    """Who was there in a run.

    Args:
        system: that was run.
        time: sample times (samples,) in s.
        action: y there (samples, m), not numbers for who was away.
        membership: what the loop tells of who was there.
    """
    game = system.game
    if membership is None:
        every = [np.arange(n) for n in (game.agents, game.actions, game.constraints_count)]
        return ThosePresent(system, (), system, every[0], every[1], every[2], time, action)
    ever = [membership["at_start"]]
    for change, later in pairwise([*membership["changes"], None]):
        if later is None or later["time"] > change["time"]:
            ever.append(change["there"])
    masks = {mask.tobytes(): mask for mask in (_mask(system, agents) for agents in ever)}
    last = _mask(system, ever[-1])
    present = system.among(last, action[-1])
    others = (system.among(mask).system for key, mask in masks.items() if key != last.tobytes())
    same = np.all(np.isfinite(action) == last[game.agent_of_action], axis=1)
    since, among = 0 if np.all(same) else len(same) - int(np.argmin(same[::-1])), present.among
    return ThosePresent(
        present.system, tuple(others), system, among.agents, among.actions, among.constraints,
        time[since:], action[since:][:, among.actions], membership,
    )  # fmt: skip


def _mask(system: System, agents: list[int]) -> There:
    there = np.zeros(system.game.agents, dtype=bool)
    there[[i - 1 for i in agents]] = True
    return there


def distances(system: System, time: Array, action: Array) -> Array:
    """(samples,) max |y - y*| over those present; arguments as of :func:`those_present`."""
    away = np.isnan(action) if system.membership is not None else np.zeros((), dtype=bool)
    apart = np.where(away, 0.0, np.abs(action - system.equilibria_among(time, action)))
    greatest: Array = np.max(apart, axis=1)
    return greatest


def refused_text(agent_name: str, membership: dict[str, Any] | None) -> str:
    """How a run's sentence goes on in which somebody was not admitted."""
    refused = [] if membership is None else [c for c in membership["changes"] if not c["done"]]
    words = []
    for each in refused[:MOST_NAMED]:
        several = "s" * (len(each["agents"]) > 1)
        who = f"{agent_name}{several} {' and '.join(map(str, each['agents']))}"
        verb = "were" if several else "was"
        done = "admitted" if each["what"] == "joined" else "let go"
        reason = each["why"]
        if each["constraint"] is not None:
            reason = f"constraint '{each['constraint']}' would be g = {each['value']:.6g}"
            reason += ", not negative"
        words.append(f"; {who} {verb} not {done} at {each['time']:g} s: {reason}")
    more = len(refused) - len(words)
    return "".join(words) + (f"; and {more} more" if more else "")
