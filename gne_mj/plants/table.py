"""What the tables ``[systems.NAME.agents]`` have in common; each type's is beside it."""

from abc import abstractmethod
from collections.abc import Iterable
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gne_mj.bounds import MOST_AGENTS
from gne_mj.errors import InvalidInput
from gne_mj.plants.agents import Agents
from gne_mj.toml_table import INPUT, Fills, PerAction, Sizes, Table, Unit, per_action, per_agent

# Of N a game and a graph are told as well
Count = Annotated[int, Fills("game.agents"), Fills("game.count"), Fills("controller.agents")]


class AgentsTable(Table):
    """N agents of one type.

    Attributes:
        engine: on which they run where the scenario does not say.
    """

    engine: ClassVar[str] = "ode"
    count: Count = Field(gt=0, le=MOST_AGENTS, description="N, how many agents")
    input_limit: Annotated[PerAction | None, Unit(INPUT, "> 0")] = Field(
        None, description="greatest |u| that the actuators deliver; no limit if left out"
    )

    @property
    def positions(self) -> bool:
        """Whether outputs are positions with a look-ahead, see gne_mj.plants.lookahead."""
        return False

    def limits(self, sizes: Sizes) -> NDArray[np.float64]:
        """(m,) limits, infinite where none is given."""
        if self.input_limit is None:
            return np.full(sum(sizes), np.inf)
        limits = per_action("input_limit", self.input_limit, sizes)
        if np.any(limits <= 0):
            raise InvalidInput("input_limit", self.input_limit, "it must be positive")
        return limits

    def rows(self, sizes: Sizes, *names: str, positive: Iterable[str]) -> NDArray[np.float64]:
        """(m, len(names)) parameters, the same for all channels of an agent."""
        columns = [
            per_agent(n, getattr(self, n), self.count, positive=n in positive) for n in names
        ]
        return np.repeat(np.column_stack(columns), sizes, axis=0)

    @abstractmethod
    def build(self, sizes: Sizes) -> Agents:
        """The agents, for actions of so many entries each."""


def check_sizes(kind: str, axes: int, sizes: Sizes) -> None:
    """Refuse actions that agents which act along so many axes do not have."""
    for size in sizes:
        if size != axes:
            raise InvalidInput(
                "type",
                kind,
                f"its agents act along {axes} {'axis' if axes == 1 else 'axes'}, and the game's"
                f" actions have {size}",
            )
