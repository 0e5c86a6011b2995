"""The fleet and its game as environments of dm_env, Gymnasium and PettingZoo, to put learned
policies beside the laws."""

from gne_mj.extras import need

need("learning", "an environment")

import gymnasium

from gne_mj.environment.fleets import Exit
from gne_mj.environment.guarding import guarded
from gne_mj.environment.load import (
    environment_of,
    load_environment,
    load_gymnasium,
    load_pettingzoo,
    load_vector,
    setting_of,
)
from gne_mj.environment.parallel import FleetParallelEnv
from gne_mj.environment.physics import FleetPhysics
from gne_mj.environment.policy import law_policy
from gne_mj.environment.setting import Setting
from gne_mj.environment.single import FleetEnv
from gne_mj.environment.task import FleetEnvironment, FleetTask
from gne_mj.environment.vector import FleetVectorEnv

__all__ = [
    "Exit",
    "FleetEnv",
    "FleetEnvironment",
    "FleetParallelEnv",
    "FleetPhysics",
    "FleetTask",
    "FleetVectorEnv",
    "Setting",
    "environment_of",
    "guarded",
    "law_policy",
    "load_environment",
    "load_gymnasium",
    "load_pettingzoo",
    "load_vector",
    "setting_of",
]

# gymnasium.make("gne_mj/Fleet-v0", scenario=...) and make_vec
gymnasium.register(
    "gne_mj/Fleet-v0",
    entry_point="gne_mj.environment:load_gymnasium",
    vector_entry_point="gne_mj.environment:load_vector",
)
