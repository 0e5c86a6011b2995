"""Figures: they read results only."""

from gne_mj.plots.analyses import save_map, save_path
from gne_mj.plots.animation import animate
from gne_mj.plots.batches import save_batch
from gne_mj.plots.style import FORMATS
from gne_mj.plots.trajectories import draw, save

__all__ = ["FORMATS", "animate", "draw", "save", "save_batch", "save_map", "save_path"]
