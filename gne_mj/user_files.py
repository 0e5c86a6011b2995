"""A user's own game or law: one Python file, of plain functions or of kernels.

A game's file has ``game(count, **parameters)``, which returns a :class:`gne_mj.game.Game`; its
functions are plain ones or all kernels (see :mod:`gne_mj.game` for their names). A law's file has
``law(game, graph, **parameters)``, which returns a :class:`gne_mj.controllers.Law`, or the plain
functions of :class:`gne_mj.controllers.plain_law.PlainLaw`: ``action(game, rho, y, memory)``, and
for a law with a memory ``rate(game, rho, y, memory)`` and ``initial_memory(y)``; all of them take
the scenario's parameters too, by name.
"""

import hashlib
import importlib.util
import sys
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

from gne_mj.controllers import Law, PlainLaw
from gne_mj.errors import GneError, InvalidInput
from gne_mj.game import Game
from gne_mj.graph import Graph
from gne_mj.plain import check_arguments

# What the functions of a plain law are called, and take besides the scenario's parameters
_LAW_FUNCTIONS = {
    "action": ("game", "rho", "y", "memory"),
    "rate": ("game", "rho", "y", "memory"),
    "initial_memory": ("y",),
}


def load_game(path: str | Path, count: int, parameters: Mapping[str, Any]) -> Game:
    """The game of a file for ``count`` agents.

    Raises:
        InvalidInput: the file cannot be read or run, or makes no game for these parameters.
    """
    module = _load(path, "game.file")
    if not callable(getattr(module, "game", None)):
        raise InvalidInput("game.file", str(path), "it must define a function game(count, ...)")
    game = _make("game.parameters", parameters, partial(module.game, count, **parameters))
    if not isinstance(game, Game):
        raise InvalidInput("game.file", str(path), "its function game must return a gne_mj Game")
    if game.agents != count:
        raise InvalidInput(
            "game.file",
            str(path),
            f"its game has {game.agents} agents, but agents.count is {count}",
        )
    return game


def load_law(
    path: str | Path, game: Game, graph: Graph | None, parameters: Mapping[str, Any]
) -> Law:
    """The law of a file for a game.

    Raises:
        InvalidInput: the file cannot be read or run, or makes no law for these parameters.
    """
    module = _load(path, "controller.file")
    if callable(getattr(module, "law", None)):
        law = _make(
            "controller.parameters", parameters, partial(module.law, game, graph, **parameters)
        )
        if not isinstance(law, Law):
            raise InvalidInput("controller.file", str(path), "its function law must return a Law")
        return law
    if not callable(getattr(module, "action", None)):
        raise InvalidInput(
            "controller.file", str(path), "it must define law(game, graph, ...) or action(...)"
        )
    functions = {}
    for name, arguments in _LAW_FUNCTIONS.items():
        if hasattr(module, name):
            function = partial(getattr(module, name), **parameters)
            check_arguments("controller.parameters", Path(path).name, function, name, arguments)
            functions[name] = function
    return PlainLaw(game, memory=functions.pop("initial_memory", None), **functions)


def _make(key: str, parameters: Mapping[str, Any], function: Any) -> Any:
    try:
        return function()
    except GneError:
        raise
    except Exception as error:
        raise InvalidInput(
            key, dict(parameters), f"the file must accept them: {type(error).__name__}: {error}"
        ) from error


def _load(path: str | Path, key: str) -> ModuleType:
    path = Path(path).resolve()
    try:
        text = path.read_bytes()
    except OSError as error:
        raise InvalidInput(key, str(path), f"it cannot be read: {error.strerror}") from None
    # One module for one text: loops are compiled for modules, and a changed file is another one.
    digest = hashlib.sha256(str(path).encode() + text).hexdigest()[:16]
    name = f"gne_mj_user_{path.stem}_{digest}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise InvalidInput(key, str(path), "it must be a Python file ending in .py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[name]
        raise InvalidInput(
            key, str(path), f"Python must run it: {type(error).__name__}: {error}"
        ) from error
    return module
