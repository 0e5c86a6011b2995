"""Games that come with the package."""

from gne_mj.games.cournot import cournot_game
from gne_mj.games.osnr import osnr_game, ten_channels
from gne_mj.games.velocity_consensus import velocity_consensus_game
from gne_mj.games.velocity_synchronization import velocity_game

__all__ = [
    "cournot_game",
    "osnr_game",
    "ten_channels",
    "velocity_consensus_game",
    "velocity_game",
]
