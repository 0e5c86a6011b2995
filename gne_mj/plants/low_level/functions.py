"""A controller's kernels as a C function, which a fleet finds by its address."""

from functools import cache
from types import ModuleType
from typing import Any

from numba import types

from gne_mj.native import callback, kernel, source_key
from gne_mj.parameter_block import floats_at

_FUNCTION = types.int64(*[types.int64] * 9)


def address_of(module: ModuleType) -> int:
    """Of the C function of a controller's kernels."""
    return int(_compiled(module).address)


@cache
def _compiled(module: ModuleType) -> Any:
    """f(q, count, seen, readings, inputs, moving, held, out, controls).

    ``seen`` is the address of readings, input and memory, ``out`` that of controls and rates.
    """
    source = source_key(module)
    moves, counts = hasattr(module, "rate"), getattr(module, "COUNTS_LIMITS", False)
    rate = module.rate if moves else _still

    def function(q, count, seen, readings, inputs, moving, held, out, controls):
        _ = source
        numbers, read = floats_at(q, count), floats_at(seen, readings)
        u = floats_at(seen + 8 * readings, inputs)
        memory = floats_at(seen + 8 * (readings + inputs), moving + held)
        if moves:
            rate(numbers, read, memory, u, floats_at(out + 8 * controls, moving))
        if counts:
            return module.control(numbers, read, memory, u, floats_at(out, controls))
        module.control(numbers, read, memory, u, floats_at(out, controls))
        return 0

    return callback(_FUNCTION, function)


@kernel
def _still(q, readings, memory, u, out):
    """Of a memory that does not move."""
