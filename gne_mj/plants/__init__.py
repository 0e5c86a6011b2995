"""Agents, and the engines that move them; nothing here knows a controller."""

from gne_mj.plants import (
    flexible_robot,
    integrator,
    low_level,
    mixed,
    mjcf_robot,
    pi_cascade,
    position_robot,
    robot_tables,
)

__all__ = [
    "flexible_robot",
    "integrator",
    "low_level",
    "mixed",
    "mjcf_robot",
    "pi_cascade",
    "position_robot",
    "robot_tables",
]
