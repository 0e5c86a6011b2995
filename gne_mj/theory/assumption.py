"""One assumption or condition, and how certain it is."""

from collections.abc import Iterable
from dataclasses import dataclass

MET, ASSUMED, UNKNOWN, FAILS = "met", "assumed", "unknown", "not met"


@dataclass(frozen=True)
class Assumption:
    """One assumption.

    Attributes:
        label: the paper's, e.g. "asmp:cost".
        status: "met"; "assumed" (the author of the game or law answers for it; nothing that was
            looked at speaks against it); "unknown" (not certified); or "not met".
        why: one sentence.
    """

    label: str
    status: str
    why: str

    @property
    def granted(self) -> bool:
        """Whether conclusions may be drawn from it."""
        return self.status in (MET, ASSUMED)


def provided(conditions: Iterable[Assumption]) -> str:
    """How a sentence goes on that rests on what is only assumed; empty if all is met."""
    terms = [f"[{each.label}] {each.why}" for each in conditions if each.status == ASSUMED]
    return f", provided {' and '.join(terms)}" if terms else ""
