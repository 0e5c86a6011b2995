"""Low-level controllers, between the game's input and a robot's actuators; one a file."""

from gne_mj.plants.low_level import differential_drive, hand, quadrotor, servo, two_screws

__all__ = ["differential_drive", "hand", "quadrotor", "servo", "two_screws"]
