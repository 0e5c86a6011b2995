"""The fleet and its game as a dm_env environment, to put learned policies beside the laws."""

from gne_mj.extras import need

need("learning", "an environment")

from gne_mj.environment.load import environment_of, load_environment
from gne_mj.environment.physics import Exit, FleetPhysics
from gne_mj.environment.policy import law_policy
from gne_mj.environment.task import FleetEnvironment, FleetTask

__all__ = [
    "Exit",
    "FleetEnvironment",
    "FleetPhysics",
    "FleetTask",
    "environment_of",
    "law_policy",
    "load_environment",
]
