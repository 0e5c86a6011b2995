"""Houses that share a district's heat: importing this package registers all it has."""

from gne_mj_heating import eager, heating, house

__all__ = ["eager", "heating", "house"]
