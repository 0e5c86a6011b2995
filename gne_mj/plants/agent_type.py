"""What a module needs to be an agent type, looked at once, and what is made where it has none.

See :mod:`gne_mj.plants.integrator` for what each name means.
"""

from collections.abc import Mapping
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput
from gne_mj.native import is_kernel, kernel
from gne_mj.plain import check_arguments

CONSTANTS = ("NAME", "PARAMETERS", "STATES", "OUTPUT", "INPUT_UNIT")
KERNELS = {
    "rate": ("q", "x", "u", "out"),
    "jacobian": ("q", "x", "out"),
    "equilibrium": ("q", "y", "out"),
    "storage": ("q", "x", "equilibrium_state"),
}


def complete(module: ModuleType, key: str = "module", name: str = "") -> ModuleType:
    """The same module, with the kernels that follow from its others.

    Args:
        module: with what CONSTANTS and KERNELS list.
        key, name: what a message calls the module, and its name there.

    Raises:
        InvalidInput: something is missing, or takes other arguments.
    """
    name = name or module.__name__
    for constant in CONSTANTS:
        if not hasattr(module, constant):
            raise InvalidInput(key, name, f"it must define {constant}")
    states, output = module.STATES, module.OUTPUT
    if not all(isinstance(each, tuple) and len(each) == 2 for each in states):
        raise InvalidInput(key, name, "its STATES must be pairs of a name and a unit")
    if not (isinstance(output, int) and 0 <= output < len(states)):
        raise InvalidInput(
            key, name, f"its OUTPUT must be the number of one of {len(states)} states"
        )
    for kind, arguments in KERNELS.items():
        function = getattr(module, kind, None)
        if not is_kernel(function):
            raise InvalidInput(key, name, f"it must define a kernel {kind}({', '.join(arguments)})")
        check_arguments(key, name, function, kind, arguments)
    for made, function in _made(module.rate, module.storage, len(states)).items():
        if not hasattr(module, made):
            setattr(module, made, function)
    return module


def has_ode(kind: ModuleType) -> bool:
    """Whether a type is given by a differential equation; of MJCF robots only MuJoCo knows it."""
    return hasattr(kind, "rate")


def in_mujoco(kind: ModuleType) -> bool:
    """Whether MuJoCo has bodies of it."""
    return hasattr(kind, "FLEET")


def fleet_module(kind: ModuleType) -> ModuleType | None:
    """The module of its fleets in MuJoCo, imported only now; None of a type without bodies."""
    return import_module(kind.FLEET) if in_mujoco(kind) else None


def placed_state(kind: ModuleType) -> str | None:
    """Its state that is a place, at which agents start apart from each other; None without."""
    return getattr(kind, "PLACED", None)


def followed_position(kind: ModuleType) -> int:
    """Which state is a position that follows the output, q' = (y - q)/tau; -1 without."""
    return int(getattr(kind, "POSITION", -1))


def start_keys(kind: ModuleType) -> set[str]:
    """What may be given of a start: the output as ``action``, other states, what follows."""
    names = [name for index, (name, _) in enumerate(kind.STATES) if index != kind.OUTPUT]
    return {"action", *names, *(name for name, *_ in getattr(kind, "DERIVED", ()))}


def start_of(
    kind: ModuleType,
    parameters: NDArray[np.float64],
    rest: NDArray[np.float64],
    given: Mapping[str, NDArray[np.float64]],
) -> NDArray[np.float64]:
    """(m, states) at the start.

    Args:
        kind, parameters: of the channels.
        rest: (m, states) at rest at the outputs that are given, or else the default ones.
        given: what is given of :func:`start_keys`, each (m,).

    Raises:
        InvalidInput: what is given does not go together.
    """
    if hasattr(kind, "start"):
        found: NDArray[np.float64] = kind.start(parameters, rest, given)
        return found
    names, state = [name for name, _ in kind.STATES], rest.copy()
    for key, values in given.items():
        if key != "action":
            state[:, names.index(key)] = values
    return state


def by_type(
    kind: ModuleType, parameters: NDArray[np.float64]
) -> list[tuple[ModuleType, NDArray[np.float64]]]:
    """The types that channels with these numbers are of, each with those of its own channels."""
    parts = getattr(kind, "by_type", None)
    return [(kind, parameters)] if parts is None else parts(parameters)


def knows_storage(kind: ModuleType) -> bool:
    """Whether it has a storage function; without one, ``storage`` is zero."""
    return bool(getattr(kind, "KNOWS_STORAGE", True))


def is_passive(kind: ModuleType, parameters: NDArray[np.float64]) -> bool:
    """Whether it says that channels with these numbers meet [asmp:nonlinearPlant]."""
    return bool(getattr(kind, "is_passive", lambda _: False)(parameters))


def why_not_passive(kind: ModuleType, parameters: NDArray[np.float64], dimension: int) -> str:
    """What is missing for that, in words; empty where the type tells no more.

    Args:
        kind, parameters: of the channels.
        dimension: channels of each agent.
    """
    return str(getattr(kind, "why_not_passive", lambda *_: "")(parameters, dimension))


def energy_balance(
    kind: ModuleType, parameters: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """P and D of channels with these numbers, each (m, s, s); None where it tells none."""
    tells = getattr(kind, "energy_balance", None)
    return None if tells is None else tells(parameters)


def _made(rate: Any, storage: Any, states: int) -> dict[str, Any]:
    @kernel
    def euler_step(q, x, u, h, out):
        rate(q, x, u, out)
        for s in range(states):
            out[s] = x[s] + h * out[s]

    @kernel
    def shared(q, x):
        return 0.0

    @kernel
    def rate_given(q, x, u, known, out):
        rate(q, x, u, out)

    @kernel
    def storage_given(q, x, equilibrium_state, known):
        return storage(q, x, equilibrium_state)

    made = (euler_step, shared, rate_given, storage_given)
    return {function.__name__: function for function in made}
