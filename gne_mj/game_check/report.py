"""What was compared, and how far apart it was."""

from dataclasses import asdict, dataclass, field
from typing import Any

AGREES, DIFFERS, NOT_COMPARED = "agrees", "differs", "not compared"


@dataclass
class Comparison:
    """One thing that a game's author wrote beside what it must agree with.

    Attributes:
        what: the function, list or declaration.
        against: what it is compared with.
        count: comparisons made.
        worst_error: greatest absolute difference.
        worst_relative: the same against the size of what is compared.
        difference: (key, value, expected) of the worst one that cannot be rounding, as
            :class:`gne_mj.errors.InvalidInput` takes them; None if there is none.
        note: why something was not compared.
    """

    what: str
    against: str
    count: int = 0
    worst_error: float = 0.0
    worst_relative: float = 0.0
    difference: tuple[str, Any, str] | None = None
    note: str = ""
    _excess: float = field(default=0.0, repr=False)

    @property
    def verdict(self) -> str:
        """ "agrees", "differs" or "not compared"."""
        if self.difference is not None:
            return DIFFERS
        return AGREES if self.count else NOT_COMPARED

    def add(self, error: float, size: float, allowed: float) -> bool:
        """Count one comparison; whether it is the worst one beyond ``allowed`` so far."""
        self.count += 1
        self.worst_error = max(self.worst_error, error)
        if size > 0.0:
            self.worst_relative = max(self.worst_relative, error / size)
        if error <= allowed:
            return False
        excess = error / max(size, 1e-300)
        worst = excess > self._excess
        self._excess = max(self._excess, excess)
        return worst


@dataclass(frozen=True)
class Report:
    """All comparisons of one game.

    Attributes:
        game: its name.
        points: profiles looked at, all strictly inside.
        comparisons: in the order made.
        failures: sentences on profiles where a function failed.
    """

    game: str
    points: int
    comparisons: tuple[Comparison, ...]
    failures: tuple[str, ...] = ()

    @property
    def holds(self) -> bool:
        """Whether nothing differs and no function failed."""
        return not self.failures and all(c.verdict != DIFFERS for c in self.comparisons)

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        rows = []
        for comparison in self.comparisons:
            row = asdict(comparison)
            del row["_excess"]
            row["verdict"] = comparison.verdict
            row["difference"] = sentence(comparison)
            rows.append(row)
        return {
            "game": self.game,
            "points": self.points,
            "holds": self.holds,
            "comparisons": rows,
            "failures": list(self.failures),
        }

    def summary(self) -> list[str]:
        """A table, line by line, and what differs."""
        head = ("compared", "with", "count", "worst error", "relative", "")
        rows = [head]
        for c in self.comparisons:
            numbers = (f"{c.worst_error:.2g}", f"{c.worst_relative:.2g}") if c.count else ("", "")
            rows.append((c.what, c.against, str(c.count), *numbers, c.verdict))
        widths = [max(len(row[n]) for row in rows) for n in range(len(head))]
        lines = [
            "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
            for row in rows
        ]
        lines += [f"{c.what}: {c.note}" for c in self.comparisons if c.note]
        lines += [said for c in self.comparisons if (said := sentence(c)) is not None]
        return [*lines, *self.failures]


def sentence(comparison: Comparison) -> str | None:
    """What differs, in words; None if nothing does."""
    if comparison.difference is None:
        return None
    key, value, expected = comparison.difference
    return f"{key}: got {value!r}, but {expected}"
