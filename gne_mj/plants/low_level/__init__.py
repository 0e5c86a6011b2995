"""Low-level controllers, between the game's input and a robot's actuators; one a file.

``table.py`` says what one is and what its module must have; ``planar_drive.py`` is what cars and
boats share. A table is bound to a robot's file by itself (``robot.py``), and its kernels become a C
function (``functions.py``). What a user's own reads is declared in ``reading_table.py``, and
``plain.py`` calls plain Python functions. :mod:`gne_mj.plants.mjcf_low_level` puts the controllers
of a whole fleet into its model and runs them.
"""

from gne_mj.plants.low_level import differential_drive, hand, quadrotor, servo, two_screws

__all__ = ["differential_drive", "hand", "quadrotor", "servo", "two_screws"]
