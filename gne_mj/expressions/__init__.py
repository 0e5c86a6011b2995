"""Games from plain Python expressions: traced once, with exact derivatives and found structure."""

from gne_mj.expressions.build import fixed, game

__all__ = ["fixed", "game"]
