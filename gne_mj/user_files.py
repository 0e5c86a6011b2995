"""A user's own game, law or agent type: one Python file, of plain functions or of kernels.

A game's file has ``game(count, **parameters)``, which returns a :class:`gne_mj.game_model.Game`;
its functions are plain ones or all kernels (named in :mod:`gne_mj.game_model`). A law's file has
``law(game, graph, **parameters)``, which returns a :class:`gne_mj.controllers.Law`, or the plain
functions of :class:`gne_mj.controllers.plain_law.PlainLaw`: ``action(game, rho, y, memory)``, and
for a law with a memory ``rate(game, rho, y, memory)`` and ``initial_memory(y)``; or those of one
agent, ``action(agent)`` and so on (:mod:`gne_mj.controllers.local_law`). All of them take the
scenario's parameters too, by name. ``ACTS_OUTSIDE = True`` in the file says that these functions
have an action outside the set as well; ``FILTERED = True`` puts them under the barrier
(:mod:`gne_mj.controllers.filtered`). An agent type's file has constants and kernels as
:mod:`gne_mj.plants.agent_type` lists them; a low-level controller's
(:mod:`gne_mj.plants.low_level.table`) ``control(readings, memory, u)`` and, with a memory of
``MEMORY`` entries, ``rate(readings, memory, u)`` and ``start(readings)``, or kernels.
"""

import hashlib
import importlib.util
import re
import sys
import warnings
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field

from gne_mj import game_model
from gne_mj.bounds import read_file
from gne_mj.controllers import Law, PlainLaw
from gne_mj.controllers.filtered import FilteredLaw
from gne_mj.controllers.local_law import is_local, joined
from gne_mj.controllers.plain_law import PlainLawOutside
from gne_mj.controllers.table import NetworkTable
from gne_mj.errors import USER_MODULES, GneError, InvalidInput, named, raised
from gne_mj.game_model import Game
from gne_mj.games.table import GameTable
from gne_mj.graph import Graph
from gne_mj.native import is_kernel
from gne_mj.plain import check_arguments
from gne_mj.plants.agent_type import complete
from gne_mj.plants.agents import Agents
from gne_mj.plants.low_level.plain import controller as plain_controller
from gne_mj.plants.low_level.reading_table import ReadingTable
from gne_mj.plants.low_level.table import Controller, ControllerTable, Seen
from gne_mj.plants.table import AgentsTable
from gne_mj.registry import AGENTS, GAMES, LAWS, LOW_LEVEL, TIMES
from gne_mj.time_functions import Signal, TimeTable, called
from gne_mj.toml_table import Fills, PerAgent, Sizes, dimension_of, per_agent

if TYPE_CHECKING:
    from gne_mj.plants.low_level.robot import Robot

# Files written for version 0.1 import Game from there. (`gne_mj.game` stays the function.)
sys.modules.setdefault("gne_mj.game", game_model)

# What the functions of a plain law are called, and take besides the scenario's parameters; and
# those of one agent
_LAW_FUNCTIONS = {
    "action": ("game", "rho", "y", "memory"),
    "rate": ("game", "rho", "y", "memory"),
    "initial_memory": ("y",),
}
_LOCAL_FUNCTIONS = dict.fromkeys(_LAW_FUNCTIONS, ("agent",))
# The kernels of a law's module
_LAW_KERNELS = {
    "action": ("game", "problem", "y", "weights", "memory", "work", "u"),
    "rate": ("problem", "y", "memory", "out"),
    "propagate": ("problem", "y", "memory", "scratch"),
    "storage": ("problem", "memory"),
}


def load_game(path: str | Path, count: int, parameters: Mapping[str, Any]) -> Game:
    """The game of a file for ``count`` agents.

    Raises:
        InvalidInput: the file cannot be read or run, or makes no game for these parameters.
    """
    module = load_module(path)
    if not callable(getattr(module, "game", None)):
        raise InvalidInput("path", str(path), "it must define a function game(count, ...)")
    game = _make(parameters, partial(module.game, count, **parameters))
    if not isinstance(game, Game):
        raise InvalidInput("path", str(path), "its function game must return a gne_mj Game")
    if game.agents != count:
        raise InvalidInput(
            "count", count, f"the game of {Path(path).name} has {game.agents} agents"
        )
    return game


def load_law(path: str | Path, game: Game, graph: Graph, parameters: Mapping[str, Any]) -> Law:
    """The law of a file for a game.

    Raises:
        InvalidInput: the file cannot be read or run, or makes no law for these parameters.
    """
    module = load_module(path)
    if callable(getattr(module, "law", None)):
        law = _make(parameters, partial(module.law, game, graph, **parameters))
        if not isinstance(law, Law):
            raise InvalidInput("path", str(path), "its function law must return a Law")
        _check_law(law, Path(path).name)
        return law
    if not callable(getattr(module, "action", None)):
        raise InvalidInput("path", str(path), "it must define law(game, graph, ...) or action(...)")
    functions = {name: getattr(module, name) for name in _LAW_FUNCTIONS if hasattr(module, name)}
    with named(rate="path"):
        return plain_law(
            game, graph, functions, parameters, ("path", Path(path).name),
            acts_outside=bool(getattr(module, "ACTS_OUTSIDE", False)),
            filtered=bool(getattr(module, "FILTERED", False)),
        )  # fmt: skip


def plain_law(
    game: Game,
    graph: Graph,
    functions: Mapping[str, Callable[..., Any]],
    parameters: Mapping[str, Any],
    named_by: tuple[str, str],
    *,
    acts_outside: bool = False,
    filtered: bool = False,
) -> PlainLaw:
    """The law of plain functions: ``action`` and, with a memory, ``rate`` and ``initial_memory``.

    Args:
        game: what is played.
        graph: what functions of one agent hear by (:mod:`gne_mj.controllers.local_law`).
        functions: by these names.
        parameters: which all of them take by name, besides their own arguments.
        named_by: what messages call where they are from, and its name there.
        acts_outside: whether they have an action outside the set.
        filtered: whether the barrier is added to what they ask for.

    Raises:
        InvalidInput: one takes other arguments, or ``rate`` is without ``initial_memory``.
    """
    local = is_local(functions)
    made: dict[str, Callable[..., Any]] = {}
    for each, function in functions.items():
        arguments = (_LOCAL_FUNCTIONS if local else _LAW_FUNCTIONS)[each]
        check_arguments(*named_by, function, each, arguments, parameters)
        made[each] = partial(function, **parameters)
    if local:
        made = joined(made, game, graph)
    if filtered and "initial_memory" in made:
        raise InvalidInput(
            named_by[0], named_by[1], "under the barrier a policy has no memory of its own"
        )
    kind = PlainLawOutside if acts_outside else PlainLaw
    kind = FilteredLaw if filtered else kind
    return kind(game, memory=made.pop("initial_memory", None), **made)


def load_agent_type(path: str | Path) -> ModuleType:
    """The agent type of a file.

    Raises:
        InvalidInput: the file cannot be read or run, or is no agent type.
    """
    return complete(load_module(path), "path", Path(path).name)


def _check_law(law: Law, file: str) -> None:
    if law.theorem is None and law.information != Law.information:
        raise InvalidInput(
            "path",
            file,
            f"its law has information = {law.information!r}, but nothing is proven of it; a law of"
            f" one's own has {Law.information!r}",
        )
    for name, arguments in _LAW_KERNELS.items():
        function = getattr(law.kernels, name, None)
        if not is_kernel(function):
            raise InvalidInput("path", file, f"its law needs a kernel named {name}")
        check_arguments("path", file, function, name, arguments)


def compiler_complaint(error: BaseException) -> str | None:
    """The one sentence in numba's pages about a user's kernel; None if no user's file is named.

    Its deepest reason stands behind the last "Failed in ..." line, and after it, innermost first,
    the lines of the files that led there.
    """
    text = re.sub(r"\x1b\[[0-9;]*m", "", str(error))  # numba colours it if colorama is installed
    places = re.findall(r'File "([^"]+)", line (\d+)', text) or [("", "")]
    own = {
        Path(module.__file__).name
        for name, module in sys.modules.items()
        if name.startswith(USER_MODULES) and module.__file__
    }
    found = [(Path(file).name, line) for file, line in places if Path(file).name in own]
    if not found:
        return None
    reasons = re.findall(r"Failed in [^\n]*\n\s*([^\n]+)", text)
    reason = reasons[-1] if reasons else type(error).__name__
    if "returning of array" in reason:  # what numba says without its run time
        reason = "it allocates an array"
    return f"{found[0][0]}, line {found[0][1]}: a kernel cannot be compiled: {reason}"


def _make(parameters: Mapping[str, Any], function: Any) -> Any:
    try:
        return function()
    except (KeyboardInterrupt, GneError):
        raise
    except BaseException as error:
        raise InvalidInput(
            "parameters", dict(parameters), f"the file must accept them: {raised(error)}"
        ) from error


def load_module(path: str | Path) -> ModuleType:
    """The module of a user's file; one text at one place is one module."""
    try:
        path = Path(path).resolve()
        text = read_file(path)
    except (OSError, ValueError) as error:  # or a name that no file can have
        why = getattr(error, "strerror", error)
        raise InvalidInput("path", str(path), f"it cannot be read: {why}") from None
    # One module for one text: loops are compiled for modules, and a changed file is another one.
    digest = hashlib.sha256(str(path).encode() + text).hexdigest()[:16]
    name = f"{USER_MODULES}{path.stem}_{digest}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise InvalidInput("path", str(path), "it must be a Python file ending in .py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    # Where it matters that a value is not a number, an error says so, with its place.
    warnings.filterwarnings("ignore", category=RuntimeWarning, module=re.escape(name))
    try:
        spec.loader.exec_module(module)
    except BaseException as error:
        del sys.modules[name]
        if isinstance(error, KeyboardInterrupt):
            raise
        raise InvalidInput("path", str(path), f"Python must run it: {raised(error)}") from error
    return module


@GAMES.register
class CustomGame(GameTable):
    """A game of the user's own."""

    type: Literal["custom"]
    file: Annotated[str, Fills("path")] = Field(
        description="Python file that defines game(count, ...)"
    )
    parameters: dict[str, Any] = Field({}, description="handed to it")

    def build(self, count: int) -> Game:
        """The game for ``count`` agents."""
        return load_game(self.file, count, self.parameters)


@TIMES.register
class FunctionTable(TimeTable):
    """A Python function of the time in s, which returns a number"""

    type: Literal["function"]
    file: Annotated[str, Fills("path")] = Field(description="Python file that defines it")
    function: str = Field(description="its name there")

    def build(self) -> Signal:
        """See the base class."""
        found = getattr(load_module(self.file), self.function, None)
        if not callable(found):
            name = Path(self.file).name
            raise InvalidInput("function", self.function, f"{name} must define it")
        check_arguments("function", Path(self.file).name, found, self.function, ("t",))
        return called(found)


@LAWS.register
class CustomController(NetworkTable):
    """A law of the user's own."""

    information: Literal["custom"]
    file: Annotated[str, Fills("path")] = Field(
        description="Python file that defines law(game, graph, ...) or action(...)"
    )
    parameters: dict[str, Any] = Field({}, description="handed to it")

    def build(self, game: Game) -> Law:
        """The law."""
        return load_law(self.file, game, self.network(game.agents), self.parameters)


MOST_KEPT = 1000  # entries of a low-level controller's memory
# What the plain functions of a controller take besides the scenario's parameters, and its kernels
_LOW_LEVEL = {
    "control": ("readings", "memory", "u"), "rate": ("readings", "memory", "u"),
    "start": ("readings",),
}  # fmt: skip
_LOW_LEVEL_KERNELS = {
    "control": ("q", "readings", "memory", "u", "out"),
    "rate": ("q", "readings", "memory", "u", "out"), "start": ("q", "readings", "out"),
}  # fmt: skip


@LOW_LEVEL.register
class CustomLowLevel(ControllerTable):
    """A low-level controller of the user's own."""

    controller: Literal["custom"]
    file: Annotated[str, Fills("path")] = Field(
        description="Python file that defines control(readings, memory, u), or kernels"
    )
    actuators: list[str] = Field(min_length=1, description="whose forces it says, in this order")
    readings: list[str | ReadingTable] = Field(
        description="what it reads: names of joints or sensors, or tables as of outputs"
    )
    parameters: dict[str, Any] = Field({}, description="handed to its functions, by name")

    def bind(self, robot: "Robot", axes: int) -> Controller:
        """See the base class."""
        with named(path="input.file"):
            module, name = load_module(self.file), Path(self.file).name
        functions = {each: getattr(module, each) for each in _LOW_LEVEL if hasattr(module, each)}
        if "control" not in functions:
            raise InvalidInput("input.file", name, "it must define control(readings, memory, u)")
        memory = getattr(module, "MEMORY", 0)
        if type(memory) is not int or not 0 <= memory <= MOST_KEPT:
            raise InvalidInput(
                "input.file", name,
                f"its MEMORY must be a whole number from 0 to {MOST_KEPT}, and is {memory!r}",
            )  # fmt: skip
        seen = [(Seen(each),) if isinstance(each, str) else each.seen() for each in self.readings]
        parts = tuple(self.actuators), tuple(one for each in seen for one in each), axes
        native = {is_kernel(function) for function in functions.values()}
        if len(native) > 1:
            raise InvalidInput("input.file", name, "mark all its functions with @kernel, or none")
        known = _LOW_LEVEL_KERNELS if native == {True} else _LOW_LEVEL
        given = {} if native == {True} else self.parameters
        for each, function in functions.items():
            check_arguments("input.file", name, function, each, known[each], given)
        if native == {False}:
            made = {each: partial(f, **self.parameters) for each, f in functions.items()}
            return plain_controller(made, *parts, memory)
        names = getattr(module, "PARAMETERS", ())
        if set(names) != set(self.parameters):
            wanted = ", ".join(names) or "none"
            raise InvalidInput("input.parameters", sorted(self.parameters), f"{name} has {wanted}")
        moving = memory if "rate" in functions else 0
        numbers = np.array([float(self.parameters[each]) for each in names])
        actuators, readings, inputs = parts
        return Controller(module, actuators, readings, numbers, inputs, moving, memory - moving)


@AGENTS.register
class CustomAgents(AgentsTable):
    """Agents of the user's own, given by their differential equation."""

    type: Literal["custom"]
    file: Annotated[str, Fills("path")] = Field(
        description="Python file with the kernels of an agent type"
    )
    parameters: dict[str, PerAgent] = Field({}, description="its PARAMETERS, by name")

    def build(self, sizes: Sizes) -> Agents:
        """The agents, for actions of so many entries each."""
        kind = load_agent_type(self.file)
        if set(self.parameters) != set(kind.PARAMETERS):
            wanted = ", ".join(kind.PARAMETERS) or "none"
            raise InvalidInput("parameters", sorted(self.parameters), f"{kind.NAME}s have {wanted}")
        columns = [
            np.repeat(per_agent(f"parameters.{name}", self.parameters[name], self.count), sizes)
            for name in kind.PARAMETERS
        ]
        table = np.column_stack(columns) if columns else np.zeros((sum(sizes), 0))
        return Agents(kind, table, self.limits(sizes), dimension_of(sizes))
