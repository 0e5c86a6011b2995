"""What expressions are made with: operators and elementary functions, by the names of nodes."""

import operator
from collections.abc import Callable
from typing import Any

import numpy as np

# Elementary functions by NumPy's names; "abs" is Python's.
FUNCTIONS: dict[str, Callable[[float], float]] = {
    "sqrt": np.sqrt, "exp": np.exp, "log": np.log, "log1p": np.log1p, "expm1": np.expm1,
    "sin": np.sin, "cos": np.cos, "tan": np.tan, "arcsin": np.arcsin, "arccos": np.arccos,
    "arctan": np.arctan, "sinh": np.sinh, "cosh": np.cosh, "tanh": np.tanh,
    "arcsinh": np.arcsinh, "arccosh": np.arccosh, "arctanh": np.arctanh, "abs": abs,
}  # fmt: skip
OPERATORS: dict[str, Callable[[Any, Any], Any]] = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv,
    "**": operator.pow,
}  # fmt: skip
# What NumPy calls for a NumPy number or array with a node
UFUNCS = {
    "add": "+", "subtract": "-", "multiply": "*", "divide": "/", "power": "**", "matmul": "@",
    "float_power": "**", "less_equal": "<=", "less": "<=", "greater_equal": ">=", "greater": ">=",
}  # fmt: skip


class Untraceable(TypeError):
    """What a traced function must not do; whoever traces names its file and line."""


def evaluate(op: str, values: list[Any]) -> Any:
    """What an operator or function makes of numbers, or of arrays of them."""
    if op == "sum":
        return sum(values)
    if op == "neg":
        return -values[0]
    if op in OPERATORS:
        return OPERATORS[op](*map(np.float64, values))
    return FUNCTIONS[op](values[0])
