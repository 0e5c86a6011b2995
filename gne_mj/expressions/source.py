"""The text of a module of kernels for a game's expressions (:mod:`gne_mj.game_model` lists them).

Rolls are loops. A derivative in the direction of action ``a`` is formed from the top down: of a
program in its own variables by :mod:`gne_mj.expressions.derivatives`, of its rolls by the chain
rule, in loops again. That a term's own action is ``a`` is known only when the kernel runs.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from gne_mj.expressions.derivatives import calculus, text
from gne_mj.expressions.structure import Access, Layout, Program

# A part of a sum: a condition in Python under which it is there, or "", and its text
Parts = list[tuple[str, str]]


class Writer:
    """Lines of Python."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.depth = 0
        self._names = 0

    def add(self, line: str) -> None:
        """Write a line."""
        self.lines.append("    " * self.depth + line)

    @contextmanager
    def block(self, head: str) -> Iterator[None]:
        """Write a line, and what follows within it; what is always true needs none."""
        if head == "if True:":
            yield
            return
        self.add(head)
        self.depth += 1
        length = len(self.lines)
        yield
        if len(self.lines) == length:
            self.add("pass")
        self.depth -= 1

    def name(self, kind: str) -> str:
        """A name that nothing else has."""
        self._names += 1
        return f"{kind}{self._names}"


class Scope:
    """A program at one place: the texts of its numbers, written when they are first asked for.

    Args:
        writer: where to.
        program: which.
        layout: of its slots.
        places: what the places are called, of what is around it and its own last.
        fixed: for each action slot the text of its number where it is known (a slot around it).
        seeds: for each direction ("a", "b") the text of the action, and the slot that is known
            to be it, or None where none is and -1 where only running tells.
        shared: texts of rolls that are written before, such as sums over all.
    """

    def __init__(
        self, writer: Writer, program: Program, layout: Layout, places: list[str],
        fixed: dict[int, str], seeds: dict[str, tuple[str, dict[int, bool]]],
        shared: dict[str, str],
    ) -> None:  # fmt: skip
        self.writer, self.program, self.layout = writer, program, layout
        self.places, self.fixed, self.seeds = places, fixed, seeds
        self.calculus = calculus(program)
        self.shared = shared
        self._known: dict[str, str] = dict(shared)

    def branch(self, **seeds: tuple[str, dict[int, bool]]) -> "Scope":
        """The same in a branch, with other seeds: what is written there is unknown outside."""
        scope = Scope(self.writer, self.program, self.layout, self.places, self.fixed,
                      {**self.seeds, **seeds}, self.shared)  # fmt: skip
        scope._known |= {k: v for k, v in self._known.items() if k[0] in "xpcj"}
        return scope

    def index(self, slot: int) -> str:
        """The text of an action's number."""
        if slot in self.fixed:
            return self.fixed[slot]
        return self._once(f"j{slot}", lambda: located(self.layout.x[slot], self.places))

    def __getitem__(self, name: str) -> str:
        kind, _, number = name[0], name[0], name[1:]
        if kind == "x":
            return self._once(name, lambda: f"y[{self.index(int(number))}]")
        if kind == "p":
            return self._once(
                name, lambda: f"q[{located(self.layout.p[int(number)], self.places)}]"
            )
        if kind == "c":
            return self._once(name, lambda: located(self.layout.c[int(number)], self.places))
        if name not in self._known:
            self._known[name] = self._roll(name)
        return self._known[name]

    def _once(self, name: str, make: Callable[[], str]) -> str:
        if name not in self._known:
            made = make()
            plain = made.lstrip("-").replace(".", "").replace("_", "")
            if not (plain.isalnum() or (name[0] == "j" and "q[" not in made)):
                local = self.writer.name(name[0])
                self.writer.add(f"{local} = {made}")
                made = local
            self._known[name] = made
        return self._known[name]

    # Derivatives: parts of sums

    def seeded(self, direction: str) -> list[tuple[str, int]]:
        """The slots that can be the direction's action, and under which condition."""
        action, known = self.seeds[direction]
        found = [(s, known.get(s)) for s in range(self.program.slots[0])]
        return [("" if yes else f"{self.index(s)} == {action}", s) for s, yes in found
                if yes is not False]  # fmt: skip

    def tangent(self, direction: str) -> Parts:
        """Df in a direction."""
        return self._gradient_parts(direction, lambda k: self.calculus.first(k))

    def _gradient_parts(self, direction: str, of: Callable[[int], Any]) -> Parts:
        x = self.program.slots[0]
        found = [(when, self.text(of(s))) for when, s in self.seeded(direction) if of(s) != 0]
        for r in range(len(self.program.rolls)):
            if of(x + r) != 0 and self.reaches(r, direction):
                found.append(("", _product(self.text(of(x + r)), self[f"t{r}{direction}"])))
        return found

    def bend(self, k: int, direction: str) -> Parts:
        """The derivative of Df in a direction by the k-th variable, but what rolls bend."""
        return self._gradient_parts(direction, lambda n: self.calculus.second(k, n))

    def twice(self) -> Parts:
        """DDf in the directions a and b."""
        x, found = self.program.slots[0], []
        for when, s in self.seeded("a"):
            found += [(_both(when, also), part) for also, part in self.bend(s, "b")]
        for r in range(len(self.program.rolls)):
            if self.reaches(r, "a"):
                found += [(when, _product(self[f"t{r}a"], part))
                          for when, part in self.bend(x + r, "b")]  # fmt: skip
            slope = self.calculus.first(x + r)
            if slope != 0 and calculus(self.program.rolls[r].term).bends:
                found.append(("", _product(self.text(slope), self[f"u{r}"])))
        return found

    def text(self, expression: Any) -> str:
        """A formula of this program's numbers."""
        for symbol in sorted(expression.free_symbols, key=lambda each: each.name):
            _ = self[symbol.name]  # written before the line that uses it
        return text(expression, self)  # type: ignore[arg-type]

    def reaches(self, r: int, direction: str) -> bool:
        """Whether a roll can depend on the direction's action."""
        _, known = self.seeds[direction]
        roll = self.program.rolls[r]
        return any(o < 0 or known.get(o) is not False for o in roll.outer) or bool(roll.term.rolls)

    # Rolls

    def enter(self, r: int, place: str) -> "Scope":
        """The scope of a roll's term."""
        roll = self.program.rolls[r]
        outer = {s: o for s, o in enumerate(roll.outer) if o >= 0}
        seeds = {
            d: (action, {s: known[o] for s, o in outer.items() if o in known})
            for d, (action, known) in self.seeds.items()
        }
        fixed = {s: self.index(o) for s, o in outer.items()}
        scope = Scope(self.writer, roll.term, self.layout.rolls[r][1], [*self.places, place],
                      fixed, seeds, {})  # fmt: skip
        scope._known = {f"x{s}": self[f"x{o}"] for s, o in outer.items()}
        return scope

    def count(self, r: int) -> str:
        """How many terms a roll has."""
        return located(self.layout.rolls[r][0], self.places)

    def _roll(self, name: str) -> str:
        r = int(name[1:].rstrip("ab"))
        total = self.writer.name("s")
        if name[0] != "r" and self._sparse(r, total, name):
            return total
        for s in {o for o in self.program.rolls[r].outer if o >= 0}:
            _ = self[f"x{s}"]
        self.writer.add(f"{total} = 0.0")
        place = self.writer.name("k")
        with self.writer.block(f"for {place} in range({self.count(r)}):"):
            term = self.enter(r, place)
            if name[0] == "r":
                parts = [("", term.text(term.calculus.f))]
            else:
                parts = term.tangent(name[-1]) if name[0] == "t" else term.twice()
            self.writer.add(f"{total} += {_only(parts)}")
        return total

    def _sparse(self, r: int, total: str, name: str) -> bool:
        """Write a roll's derivative from the one term that has the action, if there is but one."""
        directions = "ab" if name[0] == "u" else name[-1]
        found = [self.only(r, direction) for direction in directions]
        if found[0] is None or found[-1] is None:
            return False
        self.writer.add(f"{total} = 0.0")
        place = self.writer.name("k")
        self.writer.add(f"{place} = {_minus(*found[0])}")
        same = f" and {found[0][0]} == {found[-1][0]}" if len(directions) > 1 else ""
        with self.writer.block(f"if 0 <= {place} < {self.count(r)}{same}:"):
            term = self.enter(r, place)
            seeds = {s: o < 0 for s, o in enumerate(self.program.rolls[r].outer)}
            term.seeds = {d: (self.seeds[d][0], seeds) for d in directions}
            parts = term.twice() if name[0] == "u" else term.tangent(name[-1])
            self.writer.add(f"{total} = {_only(parts)}")
        return True

    def only(self, r: int, direction: str) -> tuple[str, str, str] | None:
        """For a roll whose terms have one changing action each, evenly numbered: the action, and
        base and slope of the numbers; None for others."""
        roll, (action, known) = self.program.rolls[r], self.seeds[direction]
        inner = [s for s, o in enumerate(roll.outer) if o < 0]
        if roll.term.rolls or len(inner) != 1:
            return None
        if any(o >= 0 and known.get(o) is not False for o in roll.outer):
            return None
        access = self.layout.rolls[r][1].x[inner[0]]
        if access.mode != "affine":
            return None
        base, slope = (_number(each, self.places) for each in access.numbers)
        return (action, base, slope) if slope in ("1", "-1") else None


def located(access: Access, places: list[str]) -> str:
    """The text of a number in a slot."""
    mode, numbers, whole = access
    inner = [_number(each, places[:-1]) for each in numbers]
    if mode == "same":
        return inner[0]
    if mode == "affine":
        base, slope = inner
        product = places[-1] if slope == "1" else f"{slope} * {places[-1]}"
        return product if base == "0" else _plus(product, base)
    found = f"q[{_plus(places[-1], inner[0])}]"
    return f"int({found})" if whole else found


def _number(number: Any, places: list[str]) -> str:
    if isinstance(number, Access):
        return located(number, places)
    return repr(number)


def _plus(first: str, second: str) -> str:
    return f"{first} - {second[1:]}" if second.startswith("-") else f"{first} + {second}"


def _minus(action: str, base: str, slope: str) -> str:
    first, second = (action, base) if slope == "1" else (base, action)
    return first if second == "0" else f"{first} - ({second})"


def _product(first: str, second: str) -> str:
    if first == "1.0":
        return second
    return first if second == "1.0" else f"({first}) * ({second})"


def _both(first: str, second: str) -> str:
    return f"{first} and {second}" if first and second else first or second


def summed(parts: Parts) -> str:
    """A sum of parts."""
    texts = [f"({part} if {when} else 0.0)" if when else f"({part})" for when, part in parts]
    return " + ".join(texts) if len(texts) != 1 else (texts[0] if parts[0][0] else parts[0][1])


def _only(parts: Parts) -> str:
    return summed(parts) if parts else "0.0"


# Kernels


def value(scope: Scope, size: int) -> None:
    """Of ``cost`` and ``constraint``."""
    scope.writer.add(f"return {scope.text(scope.calculus.f)}")


def own_gradient(scope: Scope, size: int) -> None:
    """Of ``cost_gradient``: by one of the agent's own ``size`` actions, its first slots."""
    for branch in _own(scope, size):
        _returned(branch)


def own_gradients(scope: Scope, size: int) -> None:
    """Of ``pseudo_gradient``: by all of the agent's own actions."""
    for own in range(size):
        known = {s: s == own for s in range(scope.program.slots[0])}
        branch = scope.branch(a=(scope.index(own), known))
        scope.writer.add(f"out[{branch.index(own)}] = {_only(branch.tangent('a'))}")


def own_row(scope: Scope, size: int) -> None:
    """Of ``add_cost_hessian``."""
    for branch in _own(scope, size):
        _row(branch, "0.0", "scale")
        scope.writer.add("return")


def _own(scope: Scope, size: int) -> Iterator[Scope]:
    """A scope for each of the agent's own actions that the direction a can be."""
    first = scope.index(0)
    for own in range(size):
        seeds = {s: s == own for s in range(scope.program.slots[0])}
        condition = f"a == {_plus(first, str(own))}" if own < size - 1 else "True"
        with scope.writer.block(f"if {condition}:"):
            yield scope.branch(a=("a", seeds))


def _returned(scope: Scope) -> None:
    parts = scope.tangent("a")
    scope.writer.add(f"return {_only(parts)}")


def _row(scope: Scope, beta: str, gamma: str) -> None:
    """out[v] += beta df/dv + gamma d(Df)/dv for all actions v of a program."""
    writer, calculus_ = scope.writer, scope.calculus
    x = scope.program.slots[0]

    def coefficient(k: int) -> Parts:
        found = [] if beta == "0.0" else _times(beta, [("", scope.text(calculus_.first(k)))]
                                                if calculus_.first(k) != 0 else [])  # fmt: skip
        return found + _times(gamma, scope.bend(k, "a"))

    for s in range(x):
        parts = coefficient(s)
        if parts:
            writer.add(f"out[{scope.index(s)}] += {summed(parts)}")
    for r, roll in enumerate(scope.program.rolls):
        parts = coefficient(x + r)
        slope = calculus_.first(x + r)
        inner_beta = _kept(writer, _only(parts))
        bends = calculus(roll.term).bends and slope != 0
        inner_gamma = _kept(writer, _product(gamma, scope.text(slope))) if bends else "0.0"
        if inner_beta == inner_gamma == "0.0":
            continue
        for o in {o for o in roll.outer if o >= 0}:
            _ = scope[f"x{o}"]
        found = scope.only(r, "a") if inner_beta == "0.0" else None
        place = writer.name("k")
        if found:
            writer.add(f"{place} = {_minus(*found)}")
        head = f"if 0 <= {place} < " if found else f"for {place} in range("
        with writer.block(f"{head}{scope.count(r)}{':' if found else '):'}"):
            _row(scope.enter(r, place), inner_beta, inner_gamma)


def _kept(writer: Writer, made: str) -> str:
    if made.replace(".", "").isalnum():
        return made
    name = writer.name("w")
    writer.add(f"{name} = {made}")
    return name


def _times(factor: str, parts: Parts) -> Parts:
    return [] if factor == "0.0" else [(when, _product(factor, part)) for when, part in parts]


def shared_gradient(scope: Scope, size: int) -> None:
    """Of ``constraint_gradient``: by any action of an agent in it, of at most ``size`` entries."""
    for branch in _branches(scope, "a", size):
        _returned(branch)


def shared_hessian(scope: Scope, size: int) -> None:
    """Of ``constraint_hessian``."""
    if not scope.calculus.bends:
        scope.writer.add("return 0.0")
        return
    for first in _branches(scope, "a", size):
        for second in _branches(first, "b", size):
            parts = second.twice()
            scope.writer.add(f"return {_only(parts)}")


def _branches(scope: Scope, direction: str, size: int) -> Iterator[Scope]:
    """A scope for each of the slots that the direction can be, the last one for what remains: in
    rolls, or an entry of an agent's action that is not in the constraint."""
    slots = range(scope.program.slots[0])
    rest = bool(scope.program.rolls) or size > 1
    for s in slots:
        last = s == len(slots) - 1 and not rest
        with scope.writer.block(f"if {'True' if last else f'{direction} == {scope.index(s)}'}:"):
            yield scope.branch(**{direction: (direction, {n: n == s for n in slots})})
    if rest:
        yield scope.branch(**{direction: (direction, dict.fromkeys(slots, False))})
