"""The table ``[systems.NAME.game]`` of a game of expressions: texts, or a file of functions."""

import inspect
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from gne_mj.errors import InvalidInput
from gne_mj.expressions.build import ExpressionGame, Functions, fixed, game
from gne_mj.expressions.written import constraints_of, cost_of
from gne_mj.game_model import Game
from gne_mj.games.table import GameTable
from gne_mj.python_objects import OBJECT, keep, kept
from gne_mj.registry import GAMES
from gne_mj.toml_table import ACTION, Fills, Unit
from gne_mj.user_files import load_module

# Bounds of actions; tables have finite numbers only
Bounded = float | Literal["none"]
Limit = float | list[Bounded] | list[list[Bounded]]
# What parameters cannot be called: the function's other arguments
_TAKEN = {*inspect.signature(game).parameters} - {"parameters"}


@GAMES.register
class ExpressionsTable(GameTable):
    """A game of the user's own, of plain expressions."""

    type: Literal["expressions"]
    file: Annotated[str | None, Fills("path")] = Field(
        None, description="Python file with cost(i, y, p) and constraints(y, p)"
    )
    cost: str | None = Field(None, description="J_i, a formula of i, y and the parameters")
    constraints: dict[str, str] | None = Field(
        None, description="comparisons by name; one that has i is one for each agent"
    )
    object: str | None = Field(None, description=f"functions {OBJECT}")
    parameters: Annotated[dict[str, Any], Fills("")] = Field(
        {}, description="numbers of the formulas, by name"
    )
    structure: Annotated[dict[str, Any], Fills("")] = Field(
        {}, description="what is no number to change: edges, lists"
    )
    dimension: Annotated[int | list[int], Unit("", ">= 1")] = Field(
        1, description="entries of an agent's action; one for all agents or one each"
    )
    lower: Annotated[Limit | None, Unit(ACTION)] = Field(
        None, description="least action: one, or one an agent or entry; 'none' for no bound"
    )
    upper: Annotated[Limit | None, Unit(ACTION, "> lower")] = Field(
        None, description="greatest action, likewise"
    )
    name: str = Field("own game", description="what the game is called")
    action_name: str = Field("action", description="what an action is, for figures and files")
    action_unit: str = Field("", description="its unit")
    agent_name: str = Field("agent", description="what an agent is")
    axes: list[str] = Field([], description="names of an action's entries")

    def build(self, count: int) -> Game:
        """The game for ``count`` agents."""
        cost, constraints, others = self._functions()
        return game(
            count,
            cost,
            constraints,
            dimension=self.dimension,
            lower=_numbers(self.lower, -np.inf),
            upper=_numbers(self.upper, np.inf),
            name=self.name,
            action_name=self.action_name,
            action_unit=self.action_unit,
            agent_name=self.agent_name,
            axes=tuple(self.axes),
            **self.parameters,
            **{key: fixed(value) for key, value in self.structure.items()},
            **others,
        )

    def _functions(self) -> Functions:
        both = set(self.parameters) & set(self.structure)
        if both:
            raise InvalidInput("structure", min(both), "it is among the parameters too")
        for name in sorted({*self.parameters, *self.structure} & _TAKEN):
            raise InvalidInput("parameters", name, "that name means something else of a game")
        if self.object is not None:
            return kept(self.object, Functions)
        boxed = self.lower is not None or self.upper is not None
        if (self.file is None) == (self.cost is None or not (self.constraints or boxed)):
            expected = "there must be either a file, or cost and constraints (or lower and upper)"
            raise InvalidInput("cost", self.cost, expected)
        if self.file is None:
            known = {**self.parameters, **self.structure}
            assert self.cost is not None
            made = cost_of(self.cost, known), constraints_of(self.constraints or {}, known)
            return Functions(*made, {})
        module = load_module(self.file)
        for name, arguments in (("cost", "i, y, p"), ("constraints", "y, p")):
            needed = name == "cost" or not boxed or hasattr(module, name)
            if needed and not callable(getattr(module, name, None)):
                raise InvalidInput("path", self.file, f"it must define {name}({arguments})")
        return Functions(module.cost, getattr(module, "constraints", None), {})


def _numbers(limit: Any, nothing: float) -> Any:
    """A bound of a table, ``nothing`` where it is "none"."""
    if isinstance(limit, list):
        return [_numbers(each, nothing) for each in limit]
    return nothing if limit == "none" else limit


def _bounded(limit: Any) -> Any:
    """A bound as tables have it, whose numbers are finite: "none" where there is none."""
    if isinstance(limit, list):
        return [_bounded(each) for each in limit]
    return "none" if np.isinf(limit) else float(limit)


def table_of(game: ExpressionGame) -> ExpressionsTable:
    """The table that makes the game of this process again, with other numbers if it is changed."""
    words = {**game.words, "axes": list(game.words["axes"])}
    dimension = words.pop("dimension")
    for key in ("lower", "upper"):
        if words[key] is not None:
            limits = np.asarray(words[key], dtype=np.float64)
            words[key] = None if np.all(np.isinf(limits)) else _bounded(limits.tolist())
    return ExpressionsTable(
        type="expressions",
        object=keep(game.functions, "game", *(game.functions or ())),
        parameters=dict(game.numbers),
        dimension=dimension if isinstance(dimension, int) else list(map(int, dimension)),
        **words,
    )
