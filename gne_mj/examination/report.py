"""What an examination found, as data and in words."""

from dataclasses import asdict, dataclass
from typing import Any

from gne_mj.examination.holding import Held
from gne_mj.examination.offers import Offer
from gne_mj.examination.responses import Slopes, lag
from gne_mj.examination.stable_steps import LONGEST, StableSteps
from gne_mj.plants.acting_forces import told
from gne_mj.toml_text import toml_text

MANY = 12  # offers of a kind that are listed


@dataclass(frozen=True)
class Recommendation:
    """What to use.

    Args:
        usable: whether there is anything to recommend.
        reasons: a sentence each.
        tables: a scenario's; empty if there is nothing.
        cautions: a sentence for each thing that was found wrong.
    """

    usable: bool
    reasons: list[str]
    tables: dict[str, Any]
    cautions: list[str]

    @property
    def toml(self) -> str:
        """The scenario as a file's text."""
        return toml_text(self.tables) if self.tables else ""


@dataclass(frozen=True)
class Examination:
    """One robot, by itself.

    Args:
        file: its MJCF file.
        output: which was examined; empty if none could be proposed.
        input: likewise.
        units: of output and input.
        offers: what else the file has.
        timestep: s, of the trials.
        limits: (d,) greatest |u| that is let through; infinite for no limit.
        rest: holding it at 0; None where inputs do not show.
        wished: holding it at the wished output.
        slopes: dy+/du.
        degrees: (d,) relative degrees; None for an input that does not show soon.
        dead_time: s until an input shows; None for never.
        steps: the longest stable steps.
        passivity: the status and sentence of the trials, or why there were none.
        recommendation: what to use.
    """

    file: str
    output: str
    input: str
    units: tuple[str, str]
    offers: list[Offer]
    timestep: float
    limits: list[float]
    rest: Held | None
    wished: Held | None
    slopes: Slopes | None
    degrees: list[int | None]
    dead_time: float | None
    steps: StableSteps | None
    passivity: str
    recommendation: Recommendation

    @property
    def usable(self) -> bool:
        """Whether there is an output that an input reaches."""
        return self.recommendation.usable

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, strings and lists, for JSON; no limit is None."""
        found: dict[str, Any] = dict(vars(self))
        for key in ("slopes", "steps"):
            found[key] = None if found[key] is None else asdict(found[key])
        for key in ("rest", "wished"):
            found[key] = None if found[key] is None else found[key].to_dict()
        found["offers"] = [asdict(each) for each in self.offers]
        found["limits"] = [None if each == float("inf") else each for each in self.limits]
        found["recommendation"] = {**asdict(self.recommendation), "toml": self.recommendation.toml}
        return found

    def __str__(self) -> str:
        return "\n".join([
            self.file, *self._offered(), *(f"  {key:20} {value}" for key, value in self._rows()),
            "", *(f"  {each}" for each in self.recommendation.cautions),
            *(f"  {each}" for each in self.recommendation.reasons),
            *(["", self.recommendation.toml.rstrip()] if self.recommendation.tables else []),
        ])  # fmt: skip

    def _offered(self) -> list[str]:
        lines = []
        for kind in ("joint", "body", "tendon", "sensor", "actuator", "keyframe"):
            there = [each for each in self.offers if each.kind == kind]
            for each in there[:MANY]:
                name = f"'{each.name}'" if each.name else "no name"
                lines.append(f"  {kind:20} {name}: {each.about}")
            if len(there) > MANY:
                lines.append(f"  {kind:20} {len(there) - MANY} more")
        return lines

    def _rows(self) -> list[tuple[str, str]]:
        if not self.output:
            return []
        unit, effort = self.units
        rows = [("examined", f"output {self.output} ({unit}), input {self.input} ({effort})")]
        if self.rest is not None:
            rows.append(("held at rest", _held(self.rest, unit, effort)))
        if self.wished is not None:
            rows.append((f"held at {_numbers(self.wished.wanted)}",
                         _held(self.wished, unit, effort)))  # fmt: skip
        if self.slopes is not None:
            rows.append(("dy+/du", _slopes(self.slopes, lag(self.degrees))))
        rows.append(("relative degree", _degrees(self.degrees, self.dead_time)))
        free = all(each == float("inf") for each in self.limits)
        rows.append(("limits", "none" if free else f"{_numbers(self.limits)} {effort}"))
        if self.steps is not None:
            rows.append(("steps", _steps(self.steps)))
        rows.append(("passivity", self.passivity))
        return rows


def _numbers(values: list[float]) -> str:
    return ", ".join(f"{value + 0.0:.4g}" for value in values)


def _held(seen: Held, unit: str, effort: str) -> str:
    text = f"by {_numbers(seen.input)} {effort}"
    parts = {name: max(values, key=abs) for name, values in seen.parts.items()}
    against = told(parts)
    if against:
        text += f" (it balances {against})"
    if max(seen.ripple) > 0.01 * max(map(abs, seen.input), default=0.0) + 1e-6:
        text += f", which still moves by {max(seen.ripple):.2g}"
    if not seen.held:
        where = f"not: it is at {_numbers(seen.output)} {unit}, {seen.why}"
        text = f"{where}; {text}" if seen.parts else where
    return text


def _slopes(seen: Slopes, lags: bool) -> str:
    rows = [
        f"{least:.3g} to {most:.3g} over {1e3 * period:.3g} ms"
        for period, least, most in zip(seen.periods, seen.least, seen.most, strict=True)
    ]
    text = f"at {seen.states} states: {', '.join(rows[:: max(1, len(rows) // 3)])}"
    if (rising := seen.rising(lags)) != seen.periods:
        where = [f"below {1e3 * rising[0]:.3g} ms"] if rising[:1] > seen.periods[:1] else []
        if rising and rising[-1] < seen.periods[-1]:
            where.append(f"beyond {1e3 * rising[-1]:.3g} ms")
        text += f"; not positive at all of them {' and '.join(where) or 'at the shortest'}"
    if seen.coupling > 0.1:
        text += f"; channels are coupled by up to {seen.coupling:.0%}"
    return text


def _degrees(degrees: list[int | None], dead_time: float | None) -> str:
    if dead_time is None:
        return "none: the input does not move the output"
    if all(each is None for each in degrees):
        return f"not seen: the input shows only after {1e3 * dead_time:.3g} ms"
    words = ("late" if each is None else str(each) for each in degrees)
    return ", ".join(words) + ", with two steps alike"


def _steps(seen: StableSteps) -> str:
    each = ", ".join(
        f"{'at least ' * (step >= LONGEST)}{1e3 * step:.3g} ms with {name}"
        for name, step in seen.longest.items()
    )
    text = f"fastest eigenvalue {seen.fastest:.4g} 1/s; stable up to {each}"
    if seen.growth > 0.1:
        text += f"; by itself it leaves this state at up to {seen.growth:.3g} 1/s"
    return text
