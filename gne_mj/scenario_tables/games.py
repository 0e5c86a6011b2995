"""The tables ``[systems.NAME.game]``, one a game."""

from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gne_mj import graph as graphs
from gne_mj.bounds import MOST_ACTIONS, check_count
from gne_mj.errors import InvalidInput
from gne_mj.game import Game
from gne_mj.games import (
    cournot_game,
    osnr_game,
    ten_channels,
    velocity_consensus_game,
    velocity_game,
)
from gne_mj.scenario_tables.table import Fills, PerAgent, Table, per_agent
from gne_mj.user_files import load_game

# The paper gives no initial velocities, and from rest the first gap would lie on its bound.
DEFAULT_VELOCITIES = (1.0, 0.0, -1.0, 0.5, 2.0)


class GameTable(Table):
    """What all of them have in common."""

    has_default_start: ClassVar[bool] = True


class VelocityGame(GameTable):
    """[eq:sensorNetGNE]"""

    type: Literal["velocity-synchronization"]
    reference_velocity: float = Field(3.0, description="v_0 in m/s")
    gap_bound: PerAgent = Field(3.0, description="delta_i in m/s, positive")
    desired_velocity: PerAgent | None = Field(
        None, description="v_i^d in m/s; the reference velocity if left out"
    )
    desired_weight: PerAgent = Field(0.0, description="w_i, not negative")

    def build(self, count: int) -> Game:
        """The game for ``count`` agents."""
        desired = self.desired_velocity
        return velocity_game(
            count,
            self.reference_velocity,
            per_agent("gap_bound", self.gap_bound, count, positive=True),
            None if desired is None else per_agent("desired_velocity", desired, count),
            per_agent("desired_weight", self.desired_weight, count),
        )

    def default_start(self, count: int) -> NDArray[np.float64]:
        """The named start for five agents; else everyone half a bound below the reference."""
        if count == len(DEFAULT_VELOCITIES):
            return np.array(DEFAULT_VELOCITIES)
        first = self.gap_bound if isinstance(self.gap_bound, float) else self.gap_bound[0]
        return np.full(count, self.reference_velocity - 0.5 * first)


class VelocityConsensusGame(GameTable):
    """Velocity vectors synchronised over any graph, some agents knowing the reference."""

    type: Literal["velocity-consensus"]
    reference_velocity: list[float] = Field([1.0, 1.0], description="v_0 in m/s")
    edges: Literal["line", "ring", "complete", "printed", "caption"] | list[tuple[int, int]] = (
        Field("ring", description="a name, or pairs of agents numbered from 1; of the game, not"
              " of who hears whom")
    )  # fmt: skip
    leader_weight: PerAgent | None = Field(
        None, description="w_i, positive for leaders and 0 for others; if left out agent 1 leads"
    )
    gap_bound: PerAgent = Field(3.0, description="in m/s, positive; one or one for each edge")
    leader_gap_bound: PerAgent = Field(
        3.0, description="to v_0 in m/s, positive; one or one for each leader"
    )

    def build(self, count: int) -> Game:
        """The game for ``count`` agents."""
        check_count(
            "agents", count * len(self.reference_velocity), MOST_ACTIONS, "the actions of all"
        )
        given = self.leader_weight
        weight = per_agent("leader_weight", 0.0 if given is None else given, count)
        if given is None:
            weight[0] = 1.0
        return velocity_consensus_game(
            self._edges(count),
            weight.tolist(),
            self.reference_velocity,
            self.gap_bound,
            self.leader_gap_bound,
        )

    def _edges(self, count: int) -> list[tuple[int, int]]:
        if not isinstance(self.edges, str):
            return [(i - 1, j - 1) for i, j in self.edges]
        return list(graphs.NAMED[self.edges](count).edges)

    def default_start(self, count: int) -> NDArray[np.float64]:
        """Everyone half a leader's bound below the reference, along the first axis."""
        start = np.tile(np.array(self.reference_velocity), (count, 1))
        start[:, 0] -= 0.5 * np.min(self.leader_gap_bound)
        return start.ravel()


class OsnrGame(GameTable):
    """[eq:osnrGNE]; what is left out is taken from the ten-channel link."""

    type: Literal["osnr"]
    total_power_limit: float | None = Field(None, gt=0, description="P_0 in mW")
    price: list[float] | None = None
    utility_weight: list[float] | None = None
    gain: list[float] | None = None
    noise_power: list[float] | None = None
    system_matrix: list[list[float]] | None = None

    def build(self, count: int) -> Game:
        """The game for ``count`` agents."""
        parameters = ten_channels()
        if self.system_matrix is not None and len({len(row) for row in self.system_matrix}) > 1:
            raise InvalidInput("system_matrix", "...", "its rows must be of one length")
        given = self.model_dump(exclude={"type"}, exclude_none=True)
        parameters.update(given)
        for key in ("price", "utility_weight", "gain", "noise_power", "system_matrix"):
            if len(parameters[key]) != count:
                raise InvalidInput(
                    key,
                    f"{len(parameters[key])} channels",
                    f"agents.count is {count}; every list must have that many entries",
                )
        return osnr_game(**parameters)

    def default_start(self, count: int) -> NDArray[np.float64]:
        """80% of the power limit, shared equally."""
        limit = self.total_power_limit or ten_channels()["total_power_limit"]
        return np.full(count, 0.8 * limit / count)


class CournotGame(GameTable):
    """Firms of one product; what is left out has the published numbers for ``count`` firms."""

    type: Literal["cournot"]
    unit_cost: list[float] | None = Field(None, description="c_i; N (1 + (i - 1) / 2)")
    demand_intercept: float | None = Field(None, description="D, price of an empty market; 60 N")
    lower_bound: PerAgent = Field(7.0, description="least quantity of each firm")
    upper_bound: PerAgent = Field(100.0, description="greatest quantity of each firm")

    def build(self, count: int) -> Game:
        """The game for ``count`` agents."""
        return cournot_game(count, **self.model_dump(exclude={"type"}))

    def default_start(self, count: int) -> NDArray[np.float64]:
        """Every firm half way between its bounds."""
        middle = 0.5 * (np.asarray(self.lower_bound) + np.asarray(self.upper_bound))
        return np.broadcast_to(middle, (count,)).copy()


class CustomGame(GameTable):
    """A game of the user's own."""

    has_default_start: ClassVar[bool] = False
    type: Literal["custom"]
    file: Annotated[str, Fills("path")] = Field(
        description="Python file that defines game(count, ...)"
    )
    parameters: dict[str, Any] = Field({}, description="handed to it")

    def build(self, count: int) -> Game:
        """The game for ``count`` agents."""
        return load_game(self.file, count, self.parameters)

    def default_start(self, count: int) -> NDArray[np.float64]:
        """There is none."""
        raise InvalidInput("action", None, "a custom game has no default start: give one")
