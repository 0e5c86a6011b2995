"""The table ``[systems.NAME.game]`` of a game of expressions: texts, or a file of functions."""

from typing import Annotated, Any, Literal

from pydantic import Field

from gne_mj.errors import InvalidInput
from gne_mj.expressions.build import ExpressionGame, Functions, fixed, game
from gne_mj.expressions.written import constraints_of, cost_of
from gne_mj.game_model import Game
from gne_mj.games.table import GameTable
from gne_mj.python_objects import OBJECT, keep, kept
from gne_mj.registry import GAMES
from gne_mj.toml_table import Fills
from gne_mj.user_files import load_module


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
    parameters: dict[str, Any] = Field({}, description="numbers of the formulas, by name")
    structure: dict[str, Any] = Field({}, description="what is no number to change: edges, lists")
    dimension: int | list[int] = Field(1, description="entries of an agent's action")
    name: str = "own game"
    action_name: str = "action"
    action_unit: str = ""
    agent_name: str = "agent"
    axes: list[str] = Field([], description="names of an action's entries")

    def build(self, count: int) -> Game:
        """The game for ``count`` agents."""
        cost, constraints, others = self._functions()
        return game(
            count,
            cost,
            constraints,
            dimension=self.dimension,
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
        if self.object is not None:
            return kept(self.object, Functions)
        if (self.file is None) == (self.cost is None or self.constraints is None):
            raise InvalidInput(
                "cost", self.cost, "there must be either a file, or cost and constraints"
            )
        if self.file is None:
            known = {**self.parameters, **self.structure}
            assert self.cost is not None
            assert self.constraints is not None
            return Functions(cost_of(self.cost, known), constraints_of(self.constraints, known), {})
        module = load_module(self.file)
        for name, arguments in (("cost", "i, y, p"), ("constraints", "y, p")):
            if not callable(getattr(module, name, None)):
                raise InvalidInput("path", self.file, f"it must define {name}({arguments})")
        return Functions(module.cost, module.constraints, {})


def table_of(game: ExpressionGame) -> ExpressionsTable:
    """The table that makes the game of this process again, with other numbers if it is changed."""
    words = {**game.words, "axes": list(game.words["axes"])}
    dimension = words.pop("dimension")
    return ExpressionsTable(
        type="expressions",
        object=keep(game.functions, "game"),
        parameters=dict(game.numbers),
        dimension=dimension if isinstance(dimension, int) else list(map(int, dimension)),
        **words,
    )
