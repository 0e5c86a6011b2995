"""What the tables ``[systems.NAME.game]`` have in common; each game's is beside it."""

from abc import abstractmethod

import numpy as np
from numpy.typing import NDArray

from gne_mj.game_model import Game
from gne_mj.toml_table import Table


class GameTable(Table):
    """A game's numbers in a scenario file."""

    @abstractmethod
    def build(self, count: int) -> Game:
        """The game for ``count`` agents."""

    def default_start(self, count: int) -> NDArray[np.float64] | None:
        """(m,) actions strictly inside, from which it is started if none are given.

        None lets a profile inside be looked for.
        """
        return None
