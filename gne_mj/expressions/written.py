"""Costs and constraints as texts, in the words of Python that formulas need and no others."""

import ast
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from gne_mj.errors import GneError, InvalidInput, raised
from gne_mj.expressions.declared import band, private
from gne_mj.expressions.entries import no_entry
from gne_mj.expressions.nodes import NoEntry
from gne_mj.expressions.operators import FUNCTIONS

_WORDS: dict[str, Any] = {
    "abs": abs, "sum": sum, "len": len, "range": range, "pi": np.pi,
    "band": band, "private": private,
    **{name: function for name, function in FUNCTIONS.items() if name != "abs"},
}  # fmt: skip
_KNOWN = (
    ast.Expression, ast.BinOp, ast.UnaryOp, ast.Compare, ast.IfExp, ast.BoolOp, ast.Call,
    ast.Attribute, ast.Subscript, ast.Slice, ast.Name, ast.Constant, ast.Tuple, ast.List,
    ast.GeneratorExp, ast.ListComp, ast.comprehension, ast.expr_context, ast.operator,
    ast.unaryop, ast.cmpop, ast.boolop,
)  # fmt: skip
_GIVEN = ("i", "y", "p", "N")
_METHODS = ("sum", "mean", "dot", "T", "shape", "size")


def cost_of(text: str, known: Mapping[str, Any]) -> Callable[..., Any]:
    """``cost(i, y, p)`` of a text in i, y, N and the parameters, with or without ``p.``.

    Raises:
        InvalidInput: the text is no formula.
    """
    _check_names(known)
    code, used = _compiled("cost", text, known)

    def cost(i: int, y: Any, p: Any) -> Any:
        return _value("cost", text, code, i, _names(known, used, i, y, p))

    return cost


def constraints_of(texts: Mapping[str, str], known: Mapping[str, Any]) -> Callable[..., Any]:
    """``constraints(y, p)`` of texts by name; one that has i is one for each agent.

    One that is None for an agent is left out there: ``... if i > 0 else None``.

    Raises:
        InvalidInput: a text is no formula.
    """
    _check_names(known)
    codes = {name: _compiled(f"constraints.{name}", text, known) for name, text in texts.items()}

    def constraints(y: Any, p: Any) -> Iterator[tuple[str, Any]]:
        for name, (code, used) in codes.items():
            key = f"constraints.{name}"
            if "i" not in used:
                yield name, _value(key, texts[name], code, None, _names(known, used, 0, y, p))
                continue
            for i in range(len(y)):
                relation = _value(key, texts[name], code, i, _names(known, used, i, y, p))
                if relation is not None:
                    yield f"{name} {i + 1}", relation

    return constraints


def _value(
    key: str, text: str, code: Any, i: int | None, names: tuple[dict[str, Any], None]
) -> Any:
    """What a formula is, for agent i if it has such.

    Raises:
        InvalidInput: it branches on actions, or reads beyond an array.
    """
    try:
        return eval(code, *names)
    except (KeyboardInterrupt, GneError):
        raise
    except Exception as error:
        whose = "" if i is None else f" for agent {i + 1}"
        if isinstance(error, NoEntry) and error.parameter:
            raise no_entry(error, names[0]["N"], key, whose.strip()) from error
        raise InvalidInput(key, text, f"it must be a formula{whose}: {raised(error)}") from error


def _check_names(known: Mapping[str, Any]) -> None:
    for name in known:
        if name in _GIVEN or name in _WORDS:
            raise InvalidInput("parameters", name, "that name means something else in formulas")


def _names(
    known: Mapping[str, Any], used: set[str], i: int, y: Any, p: Any
) -> tuple[dict[str, Any], None]:
    numbers = {name: getattr(p, name) for name in known if name in used}
    return {"__builtins__": {}, **_WORDS, **numbers, "i": i, "y": y, "p": p, "N": len(y)}, None


def _compiled(key: str, text: str, known: Mapping[str, Any]) -> tuple[Any, set[str]]:
    """The text's code, if it has nothing but formulas in it, and the names that it reads."""
    try:
        tree = ast.parse(text.strip(), mode="eval")
        names = [node for node in ast.walk(tree) if isinstance(node, ast.Name)]
        own = {node.id for node in names if isinstance(node.ctx, ast.Store)}
        for node in ast.walk(tree):
            _check(key, text, node, {*_GIVEN, *_WORDS, *known, *own})
        code = compile(tree, f"<{key}>", "eval")
    except (SyntaxError, RecursionError, MemoryError) as error:
        why = getattr(error, "msg", None) or type(error).__name__
        raise InvalidInput(key, text, f"it must be a formula: {why}") from None
    return code, {node.id for node in names} - own


def _check(key: str, text: str, node: ast.AST, names: set[str]) -> None:
    if not isinstance(node, _KNOWN):
        raise InvalidInput(key, text, f"a formula has no {type(node).__name__}")
    if isinstance(node, ast.Name) and node.id not in names:
        raise InvalidInput(key, text, f"'{node.id}' is no parameter, function or number here")
    if isinstance(node, ast.Constant) and not isinstance(node.value, int | float | None):
        raise InvalidInput(key, text, f"{node.value!r:.40} is no real number")
    if isinstance(node, ast.Attribute) and node.attr not in _METHODS:
        parameter = isinstance(node.value, ast.Name) and node.value.id == "p"
        if not parameter or node.attr.startswith("_"):
            raise InvalidInput(key, text, f"numbers have no '{node.attr}'")
    if isinstance(node, ast.comprehension) and node.is_async:
        raise InvalidInput(key, text, "a formula has no async")
