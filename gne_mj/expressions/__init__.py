"""Games from plain Python expressions: traced once, with exact derivatives and found structure."""

from gne_mj.expressions.build import fixed, game
from gne_mj.expressions.declared import band, private

__all__ = ["band", "fixed", "game", "private"]
