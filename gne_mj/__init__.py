"""Robots that seek a generalized Nash equilibrium and never leave their shared constraint set."""

import sys
from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gne_mj.batches import open_batch, run_batch
    from gne_mj.environment import load_environment
    from gne_mj.scenario import Scenario, load_scenario
    from gne_mj.simulation import Simulation
    from gne_mj.trajectory import Trajectory

__version__ = version("gne-mj")

# Imported at first use, so that the command line answers at once.
_LAZY = {
    "Scenario": "gne_mj.scenario",
    "Simulation": "gne_mj.simulation",
    "Trajectory": "gne_mj.trajectory",
    "load_environment": "gne_mj.environment",
    "load_scenario": "gne_mj.scenario",
    "open_batch": "gne_mj.batches",
    "run": "gne_mj.scenario",
    "run_batch": "gne_mj.batches",
}

__all__ = [
    "Scenario",
    "Simulation",
    "Trajectory",
    "__version__",
    "load_environment",
    "load_scenario",
    "open_batch",
    "run",
    "run_batch",
]


def _show_in_notebooks() -> None:
    """Where IPython runs, a trajectory is shown with its replay (see gne_mj.notebook)."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if shell is not None:
        html = shell.display_formatter.formatters["text/html"]
        html.for_type_by_name("gne_mj.trajectory", "Trajectory", _notebook_html)


def _notebook_html(trajectory: "Trajectory") -> str:
    from gne_mj.notebook import notebook_html

    return notebook_html(trajectory)


_show_in_notebooks()


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        return getattr(import_module(_LAZY[name]), name)
    raise AttributeError(f"module 'gne_mj' has no attribute {name!r}")
