"""Games that come with the package: each file of this folder is one, and is found by being here."""

from importlib import import_module
from pkgutil import iter_modules

from gne_mj.games.cournot import cournot_game
from gne_mj.games.formation import formation_game
from gne_mj.games.osnr import osnr_game, ten_channels
from gne_mj.games.platoon import platoon_game
from gne_mj.games.region import Region, region_of
from gne_mj.games.velocity_consensus import velocity_consensus_game
from gne_mj.games.velocity_synchronization import velocity_game

__all__ = [
    "Region",
    "cournot_game",
    "formation_game",
    "osnr_game",
    "platoon_game",
    "region_of",
    "ten_channels",
    "velocity_consensus_game",
    "velocity_game",
]

for _file in iter_modules(__path__):  # so that its table is registered
    import_module(f"{__name__}.{_file.name}")
