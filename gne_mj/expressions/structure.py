"""What expressions have in common: their programs, and where each finds its own numbers.

A :class:`Program` is an expression without its numbers: which actions, parameters and constants it
reads is said by slots. Terms of a sum that are alike become one program that is added up in a loop
(a *roll*), whose slots change from term to term. Agents, or constraints, of equal programs share
code; what differs between them is found by an :class:`Access`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from gne_mj.expressions.nodes import Node

ALIKE = 3  # so many terms of a sum are worth a loop


class Roll(NamedTuple):
    """A sum of alike terms, in a program.

    Attributes:
        term: the program of each.
        outer: for each of its action slots the slot of the program around it, or -1 if it changes
            from term to term.
    """

    term: "Program"
    outer: tuple[int, ...]


class Program(NamedTuple):
    """An expression without its numbers.

    Attributes:
        code: instructions, the last one the result: ("x" | "p" | "c" | "roll", slot), ("**", base,
            exponent) with a number as exponent, or an operator and earlier instructions' numbers.
        slots: how many of actions (x), parameters (p) and constants (c).
        rolls: sums of alike terms.
    """

    code: tuple[tuple[Any, ...], ...]
    slots: tuple[int, int, int]
    rolls: tuple[Roll, ...]


@dataclass
class Instance:
    """The numbers of one expression of a program.

    Attributes:
        x, p, c: its actions, places of parameters in q, and constants.
        rolls: for each roll the instances of its terms.
    """

    x: list[int] = field(default_factory=list)
    p: list[int] = field(default_factory=list)
    c: list[float] = field(default_factory=list)
    rolls: list[list["Instance"]] = field(default_factory=list)


class Analysis:
    """Programs of expressions; what was found of a term is kept."""

    def __init__(self) -> None:
        self._terms: dict[int, tuple[Program, Instance]] = {}
        self._sums: dict[int, tuple[list[Node], list[tuple[Program, list[Instance]]]]] = {}
        self._lists: dict[tuple[int, ...], list[Instance]] = {}

    def program(self, node: Node, own: Sequence[int] = ()) -> tuple[Program, Instance]:
        """Of an expression; ``own`` actions have its first slots."""
        builder = _Builder(self, own)
        builder.visit(node)
        return builder.finish()

    def term(self, node: Node) -> tuple[Program, Instance]:
        """Of a sum's term."""
        found = self._terms.get(id(node))
        if found is None:
            found = self._terms[id(node)] = self.program(node)
        return found

    def sum(self, node: Node) -> tuple[list[Node], list[tuple[Program, list[Instance]]]]:
        """A sum's single terms, and its alike ones."""
        found = self._sums.get(id(node))
        if found is None:
            single, alike = self._grouped(_terms(node, whole=True))
            parts = [part for term in single for part in _terms(term)]
            single, more = self._grouped(parts) if len(parts) > len(single) else (single, [])
            found = self._sums[id(node)] = (single, alike + more)
        return found

    def _grouped(
        self, terms: list[Node]
    ) -> tuple[list[Node], list[tuple[Program, list[Instance]]]]:
        """Terms that are few of a kind, and those that are many; sums within only if short."""
        groups: dict[Program, list[tuple[Node, Instance]]] = {}
        for term in terms:
            program, instance = self.term(term)
            groups.setdefault(program, []).append((term, instance))
        single, alike = [], []
        for program, members in groups.items():
            long = program.rolls and _inner(members[0][0]).op == "sum"
            if len(members) < ALIKE or program.slots[0] == 0 or long:
                single += [term for term, _ in members]
            else:
                alike.append((program, self._once([instance for _, instance in members])))
        return single, alike

    def _once(self, instances: list[Instance]) -> list[Instance]:
        """The same list of the same terms, by which sums that many write are seen to be one."""
        return self._lists.setdefault(tuple(map(id, instances)), instances)


class _Builder:
    """Writes one program."""

    def __init__(self, analysis: Analysis, own: Sequence[int]) -> None:
        self.analysis = analysis
        self.code: list[tuple[Any, ...]] = []
        self.known: dict[int, int] = {}
        self.rolls: list[Roll] = []
        self.instance = Instance(x=list(own))

    def finish(self) -> tuple[Program, Instance]:
        i = self.instance
        slots = (len(i.x), len(i.p), len(i.c))
        return Program(tuple(self.code), slots, tuple(self.rolls)), i

    def visit(self, node: Node) -> int:
        """The number of the instruction that computes a node."""
        if id(node) not in self.known:
            self.known[id(node)] = self._visit(node)
        return self.known[id(node)]

    def _add(self, *instruction: Any) -> int:
        self.code.append(instruction)
        return len(self.code) - 1

    def _visit(self, node: Node) -> int:
        if node.op == "y":
            return self._add("x", self._slot(self.instance.x, node.args[0]))
        if node.op == "q":
            return self._add("p", self._slot(self.instance.p, node.args[0]))
        if node.op == "c":
            self.instance.c.append(node.args[0])
            return self._add("c", len(self.instance.c) - 1)
        if node.op == "**" and node.args[1].op == "c":
            return self._add("**", self.visit(node.args[0]), node.args[1].args[0])
        if node.op in ("+", "-", "sum"):
            return self._sum(node)
        return self._add(node.op, *[self.visit(arg) for arg in node.args])

    def _sum(self, node: Node) -> int:
        single, alike = self.analysis.sum(node)
        parts = [self.visit(term) for term in single]
        for program, instances in alike:
            parts.append(self._add("roll", len(self.rolls)))
            self.rolls.append(Roll(program, self._outer(program, instances)))
            self.instance.rolls.append(instances)
        return parts[0] if len(parts) == 1 else self._add("sum", *parts)

    def _outer(self, program: Program, instances: list[Instance]) -> tuple[int, ...]:
        first = instances[0].x
        same = [all(each.x[s] == first[s] for each in instances) for s in range(program.slots[0])]
        return tuple(self._slot(self.instance.x, first[s]) if fixed else -1
                     for s, fixed in enumerate(same))  # fmt: skip

    @staticmethod
    def _slot(slots: list[int], number: int) -> int:
        if number not in slots:
            slots.append(number)
        return slots.index(number)


def _terms(node: Node, whole: bool = False) -> list[Node]:
    """What a sum adds up, sums in it and signs resolved; ``whole`` leaves what NumPy summed."""
    found, waiting = [], [(node, False)]
    while waiting:
        each, negative = waiting.pop()
        if each.op == "+" or (each.op == "sum" and not (whole and each is not node)):
            waiting += [(arg, negative) for arg in reversed(each.args)]
        elif each.op == "-":
            waiting += [(each.args[1], not negative), (each.args[0], negative)]
        elif each.op == "neg":
            waiting.append((each.args[0], not negative))
        else:
            found.append(each.tape.unary("neg", each) if negative else each)
    return found


def _inner(node: Node) -> Node:
    return node.args[0] if node.op == "neg" else node


class Access(NamedTuple):
    """Where a number of a slot is found, at a place: an agent's or constraint's, or a term's.

    Attributes:
        mode: "same" (numbers[0]), "affine" (numbers[0] + place * numbers[1]) or "table" (the entry
            of q at numbers[0] + place).
        numbers: values, or accesses at the place around it.
        whole: whether it is a whole number.
    """

    mode: str
    numbers: tuple[Any, ...]
    whole: bool


class Layout(NamedTuple):
    """The accesses of a program's slots; of each roll the number of terms and their layout."""

    x: list[Access]
    p: list[Access]
    c: list[Access]
    rolls: list[tuple[Access, "Layout"]]


Values = dict[tuple[int, ...], float]  # by the places that lead there


class Tables:
    """Lays out what differs, in q behind the parameters."""

    def __init__(self, q: list[float]) -> None:
        self.q = list(q)
        self._known: dict[tuple[float, ...], int] = {}

    def layout(self, program: Program, members: dict[int, Instance]) -> Layout:
        """Of the members, by their numbers, of one program."""
        return self._layout(program, {(place,): each for place, each in members.items()})

    def _layout(self, program: Program, given: dict[tuple[int, ...], Instance]) -> Layout:
        x, p, c = program.slots
        rolls = []
        for r, roll in enumerate(program.rolls):
            lists = {path: instance.rolls[r] for path, instance in given.items()}
            counts = self.access({path: len(terms) for path, terms in lists.items()}, True)
            distinct = {id(terms): terms for terms in lists.values()}
            if len(distinct) == 1:  # the same sum for all: one stands for them
                lists = dict([next(iter(lists.items()))])
            inner = {
                (*path, k): term for path, terms in lists.items() for k, term in enumerate(terms)
            }
            rolls.append((counts, self._layout(roll.term, inner)))
        return Layout(
            [self.access({path: i.x[s] for path, i in given.items()}, True) for s in range(x)],
            [self.access({path: i.p[s] for path, i in given.items()}, True) for s in range(p)],
            [self.access({path: i.c[s] for path, i in given.items()}, False) for s in range(c)],
            rolls,
        )

    def access(self, values: Values, whole: bool) -> Access:
        """How to find these."""
        groups: dict[tuple[int, ...], list[tuple[int, float]]] = {}
        for path, value in values.items():
            groups.setdefault(path[:-1], []).append((path[-1], value))
        mode, numbers = self._numbers(groups, whole)
        if () in groups:
            return Access(mode, tuple(each[()] for each in numbers), whole)
        wholes = whole or mode == "table"
        return Access(mode, tuple(self.access(each, wholes) for each in numbers), whole)

    def _numbers(
        self, groups: dict[tuple[int, ...], list[tuple[int, float]]], whole: bool
    ) -> tuple[str, list[Values]]:
        if all(value == entries[0][1] for entries in groups.values() for _, value in entries):
            return "same", [{path: entries[0][1] for path, entries in groups.items()}]
        if whole:
            lines = {path: _line(entries) for path, entries in groups.items()}
            if all(line is not None for line in lines.values()):
                return "affine", [{path: line[n] for path, line in lines.items() if line}
                                  for n in range(2)]  # fmt: skip
        return "table", [{path: self._table(entries) for path, entries in groups.items()}]

    def _table(self, entries: list[tuple[int, float]]) -> int:
        first, last = entries[0][0], entries[-1][0]
        row = [0.0] * (last - first + 1)
        for place, value in entries:
            row[place - first] = float(value)
        key = tuple(row)
        if key not in self._known:
            self._known[key] = len(self.q)
            self.q += row
        return self._known[key] - first


def _line(entries: list[tuple[int, float]]) -> tuple[float, float] | None:
    """Base and slope of values that rise evenly with the place."""
    (k, value), slope = entries[0], 0.0
    if len(entries) > 1:
        slope = (entries[1][1] - value) / (entries[1][0] - k)
    base = value - slope * k
    fits = slope == int(slope) and all(base + slope * at == each for at, each in entries)
    return (int(base), int(slope)) if fits else None
