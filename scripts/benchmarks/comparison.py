"""Two measurements beside each other: which rows became worse by more than noise.

A row is worse if its ratio is, or, where it has none and both are of one machine, its time. Noise
is a tenth, which is what it makes of a loop's time where in memory code and numbers happen to lie,
and what the turns of both measurements differed by (half of them lie within `spread`, a share).
"""

import re
from typing import NamedTuple

from history import Measured

PLACE = 0.1  # share by which the same program differs from one process to the next


class Change(NamedTuple):
    """What became of a row.

    Attributes:
        what: the row in words.
        before, after: its ratio, or its time.
        worse: by which share it is worse now; negative if it is better.
        noise: which share is none.
    """

    what: str
    before: float
    after: float
    worse: float
    noise: float

    def __str__(self) -> str:
        return (
            f"{self.what}: {self.before:.3g}, now {self.after:.3g}: {abs(self.worse):.0%}"
            f" {'worse' if self.worse > 0.0 else 'better'} ({self.noise:.0%} is noise)"
        )


def tell(before: Measured, after: Measured) -> int:
    """Print what became worse and better beyond noise; the exit status: 1 if something is worse."""
    found = changes(before, after)
    worse = [change for change in found if change.worse > change.noise]
    better = [change for change in found if change.worse < -change.noise]
    for words, some in (("worse", worse), ("better", better)):
        print(f"{words}: {len(some)} of {len(found)} rows", *some, sep="\n  ")
    names = [set(map(_key, each.rows)) for each in (before, after)]
    for words, only in (("gone", names[0] - names[1]), ("new", names[1] - names[0])):
        if only:
            print(f"{words}: {len(only)} rows", *sorted(only), sep="\n  ")
    return 1 if worse else 0


def changes(before: Measured, after: Measured) -> list[Change]:
    """Of all rows that both have."""
    same_machine = before.machine == after.machine
    earlier = {_key(row): row for row in before.rows}
    found = []
    for row in after.rows:
        key = _key(row)
        last = earlier.get(key)
        column = "ratio" if row["ratio"] else "ours"
        if last is None or (column == "ours" and not same_machine):
            continue
        try:
            old, new = float(last[column]), float(row[column])
        except ValueError:  # no number: what laws kept, say
            continue
        worse = old / new - 1.0 if _higher_is_better(row) else new / old - 1.0
        noise = PLACE + sum(float(each.get("spread", "0")) for each in (last, row))
        found.append(Change(key, old, new, worse, noise))
    return found


def _key(row: dict[str, str]) -> str:
    """The row in words without what was measured itself: how equal results were."""
    return re.sub(r" \(equal within [^)]*\)", "", row["what"])


def _higher_is_better(row: dict[str, str]) -> bool:
    return row.get("better", "higher" if row["target"].startswith(">") else "lower") == "higher"
