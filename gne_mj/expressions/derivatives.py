"""Exact derivatives of programs, by SymPy, and expressions as the text of kernels."""

from collections.abc import Mapping
from functools import cache, cached_property
from typing import Any

import sympy as sp
from sympy.codegen.cfunctions import expm1, log1p
from sympy.printing.str import StrPrinter

from gne_mj.expressions.structure import Program

_FUNCTIONS: dict[str, Any] = {
    "sqrt": sp.sqrt, "exp": sp.exp, "log": sp.log, "log1p": log1p, "expm1": expm1, "sin": sp.sin,
    "cos": sp.cos, "tan": sp.tan, "arcsin": sp.asin, "arccos": sp.acos, "arctan": sp.atan,
    "sinh": sp.sinh, "cosh": sp.cosh, "tanh": sp.tanh, "arcsinh": sp.asinh, "arccosh": sp.acosh,
    "arctanh": sp.atanh, "abs": sp.Abs,
}  # fmt: skip
_NAMES = {"asin": "arcsin", "acos": "arccos", "atan": "arctan", "asinh": "arcsinh",
          "acosh": "arccosh", "atanh": "arctanh"}  # fmt: skip


class Calculus:
    """A program as a formula, with its derivatives.

    Attributes:
        x, p, c, r: symbols of its actions, parameters, constants and rolls.
        f: the formula.
    """

    def __init__(self, program: Program) -> None:
        x, p, c = program.slots
        self.x, self.p, self.c, self.r = (
            [sp.Symbol(f"{kind}{k}", real=True) for k in range(count)]
            for kind, count in (("x", x), ("p", p), ("c", c), ("r", len(program.rolls)))
        )
        self.program = program
        self.f = self._formula()

    def _formula(self) -> Any:
        leaves = {"x": self.x, "p": self.p, "c": self.c, "roll": self.r}
        done: list[Any] = []
        for op, *args in self.program.code:
            if op in leaves:
                done.append(leaves[op][args[0]])
            elif op == "**" and isinstance(args[1], float):
                whole = args[1] == int(args[1]) if abs(args[1]) < 1e9 else False
                done.append(done[args[0]] ** (int(args[1]) if whole else sp.Float(args[1])))
                if args[1] == 0.5:
                    done[-1] = sp.sqrt(done[args[0]])
            else:
                done.append(_OPERATIONS[op](*(done[k] for k in args)))
        return done[-1]

    @cached_property
    def variables(self) -> list[Any]:
        """x, then r."""
        return [*self.x, *self.r]

    @cache  # noqa: B019 - as many as there are programs
    def first(self, k: int) -> Any:
        """df by the k-th variable."""
        return _derivative(self.f, self.variables[k])

    @cache  # noqa: B019
    def second(self, k: int, n: int) -> Any:
        """d2f by two variables."""
        return _derivative(self.first(min(k, n)), self.variables[max(k, n)])

    @cached_property
    def bends(self) -> bool:
        """Whether it is no affine function of the actions."""
        size = len(self.variables)
        if any(self.second(k, n) != 0 for k in range(size) for n in range(k, size)):
            return True
        return any(calculus(roll.term).bends for roll in self.program.rolls)


@cache
def calculus(program: Program) -> Calculus:
    """Of a program."""
    return Calculus(program)


def _derivative(expression: Any, by: Any) -> Any:
    found = expression.diff(by)
    found = found.replace(sp.DiracDelta, lambda *_: sp.S.Zero)  # of sign, almost everywhere
    if any(not power.exp.is_number for power in found.atoms(sp.Pow)):
        found = sp.powsimp(found)  # x**p / x
    if any(power.exp.is_negative and power.base.is_Add for power in found.atoms(sp.Pow)):
        found = sp.together(found)  # fewer divisions, and closer bounds over intervals
    return found


_OPERATIONS: dict[str, Any] = {
    "+": lambda a, b: a + b, "-": lambda a, b: a - b, "*": lambda a, b: a * b,
    "/": lambda a, b: a / b, "**": lambda a, b: a**b, "neg": lambda a: -a,
    "sum": lambda *terms: sp.Add(*terms), **_FUNCTIONS,
}  # fmt: skip


class _Printer(StrPrinter):
    """Formulas as Python, symbols by the texts that they stand for."""

    def __init__(self, texts: Mapping[str, str]) -> None:
        super().__init__()
        self.texts = texts

    def _print_Symbol(self, symbol: Any) -> str:
        return self.texts[symbol.name]

    def _print_Add(self, total: Any, order: Any = None) -> str:
        """Actions before numbers: a gap of two that are close is exact, and little is lost of its
        distance to a bound."""
        terms = self._as_ordered_terms(total, order=order)
        terms.sort(key=lambda term: not any(s.name[0] in "xr" for s in term.free_symbols))
        first, *others = (self._print(term) for term in terms)
        signed = (f" - {t[1:]}" if t.startswith("-") else f" + {t}" for t in others)
        return str(first) + "".join(signed)

    def _print_Float(self, number: Any) -> str:
        return repr(float(number))

    def _print_Rational(self, number: Any) -> str:
        return repr(float(number)) if number.q != 1 else str(number.p)

    def _print_Function(self, call: Any) -> str:
        name = call.func.__name__
        inner = ", ".join(self._print(arg) for arg in call.args)
        return f"np.{_NAMES.get(name, name)}({inner})"

    _print_log1p = _print_expm1 = _print_sign = _print_Function

    def _print_Abs(self, call: Any) -> str:
        return f"abs({self._print(call.args[0])})"

    def _print_Pow(self, power: Any, rational: bool = False) -> str:
        if power.exp == sp.S.Half:
            return f"np.sqrt({self._print(power.base)})"
        if power.exp == -sp.S.Half:
            return f"(1.0/np.sqrt({self._print(power.base)}))"
        if power.exp == -1:
            return f"(1.0/({self._print(power.base)}))"
        if power.exp.is_Integer and power.exp < 0:
            return f"(1.0/({self._print(power.base)})**{-power.exp})"
        return f"({self._print(power.base)})**({self._print(power.exp)})"

    def _print_Exp1(self, _: Any) -> str:
        return "np.e"

    def _print_ImaginaryUnit(self, _: Any) -> str:
        return "np.nan"

    def _print_zoo(self, _: Any) -> str:
        return "np.nan"

    _print_ComplexInfinity = _print_NaN = _print_zoo


def text(expression: Any, texts: Mapping[str, str]) -> str:
    """A formula as Python; ``texts`` says what stands for its symbols."""
    if expression.is_number and expression.is_real and expression.is_finite:
        return repr(float(expression))
    return str(_Printer(texts).doprint(expression))
