"""The tables of a scenario file: what may stand where, and what is built from it.

Each table has the fields that a user may set, with their units, and a ``build`` that makes the
object they describe.
"""

from gne_mj.scenario_tables.scenario import Scenario
from gne_mj.scenario_tables.system import SystemTable
from gne_mj.toml_table import union_tags

__all__ = ["Scenario", "SystemTable", "union_tags"]
