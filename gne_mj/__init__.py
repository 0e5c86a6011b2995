"""Robots that seek a generalized Nash equilibrium and never leave their shared constraint set.

>>> import gne_mj as gm
>>> game = gm.game(6, cost, constraints, budget=30.0)  # two functions, as on paper
>>> run = gm.run(game, agents=gm.flexible_robots(6), law=gm.partial_information("ring"), rho=0.02)
>>> run.plot(); print(gm.certify(run)); print(gm.solve(game))
"""

import sys
from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gne_mj.barrier import LogBarrier
    from gne_mj.batches import open_batch
    from gne_mj.batches import run_batch as batch
    from gne_mj.changing_graph import disc, switching
    from gne_mj.comparison import compare
    from gne_mj.environment import load_environment
    from gne_mj.expressions import band, fixed, game, private
    from gne_mj.game_model import Game
    from gne_mj.graph import Graph, complete, line, ring, star
    from gne_mj.interface import (
        Figures,
        Run,
        Variations,
        bias,
        cbf_filter,
        certify,
        check,
        custom_agents,
        discrete_cbf_filter,
        estimate_corruption,
        examine,
        feedback_seeking,
        flexible_robots,
        full_information,
        fully_distributed,
        integrators,
        l1_penalty,
        message_delay,
        message_loss,
        mixed_agents,
        mjcf_robots,
        noise,
        own_law,
        partial_information,
        pi_cascades,
        planar_robots,
        plot,
        primal_dual_partial,
        primal_dual_play,
        projected_gradient,
        push,
        quadratic_penalty,
        receding_horizon,
        recursive_safe_flow,
        run,
        safe_monotone_flow,
        saturation,
        sensor_delay,
        setup,
        silence,
        solve,
        vary,
        view,
    )
    from gne_mj.scenario import Scenario, load_scenario, scenario_of
    from gne_mj.simulation import Simulation
    from gne_mj.system import Clock, System
    from gne_mj.trajectory import Trajectory

__version__ = version("gne-mj")

__all__ = [
    "Clock",
    "Figures",
    "Game",
    "Graph",
    "LogBarrier",
    "Run",
    "Scenario",
    "Simulation",
    "System",
    "Trajectory",
    "Variations",
    "__version__",
    "band",
    "batch",
    "bias",
    "cbf_filter",
    "certify",
    "check",
    "compare",
    "complete",
    "custom_agents",
    "disc",
    "discrete_cbf_filter",
    "estimate_corruption",
    "examine",
    "feedback_seeking",
    "fixed",
    "flexible_robots",
    "full_information",
    "fully_distributed",
    "game",
    "integrators",
    "l1_penalty",
    "line",
    "load_environment",
    "load_scenario",
    "message_delay",
    "message_loss",
    "mixed_agents",
    "mjcf_robots",
    "noise",
    "open_batch",
    "own_law",
    "partial_information",
    "pi_cascades",
    "planar_robots",
    "plot",
    "primal_dual_partial",
    "primal_dual_play",
    "private",
    "projected_gradient",
    "push",
    "quadratic_penalty",
    "receding_horizon",
    "recursive_safe_flow",
    "ring",
    "run",
    "safe_monotone_flow",
    "saturation",
    "scenario_of",
    "sensor_delay",
    "setup",
    "silence",
    "solve",
    "star",
    "switching",
    "vary",
    "view",
]

# Imported at first use, so that the command line answers at once; what is not here is in
# gne_mj.interface.
_PLACES = {
    "Clock": "gne_mj.system",
    "Game": "gne_mj.game_model",
    "Graph": "gne_mj.graph",
    "LogBarrier": "gne_mj.barrier",
    "Scenario": "gne_mj.scenario",
    "Simulation": "gne_mj.simulation",
    "System": "gne_mj.system",
    "Trajectory": "gne_mj.trajectory",
    "band": "gne_mj.expressions",
    "batch": "gne_mj.batches",
    "compare": "gne_mj.comparison",
    "complete": "gne_mj.graph",
    "disc": "gne_mj.changing_graph",
    "fixed": "gne_mj.expressions",
    "game": "gne_mj.expressions",
    "line": "gne_mj.graph",
    "load_environment": "gne_mj.environment",
    "load_scenario": "gne_mj.scenario",
    "open_batch": "gne_mj.batches",
    "private": "gne_mj.expressions",
    "ring": "gne_mj.graph",
    "scenario_of": "gne_mj.scenario",
    "star": "gne_mj.graph",
    "switching": "gne_mj.changing_graph",
}

_NAMES = {"batch": "run_batch"}  # what is called otherwise in its module


def _show_in_notebooks() -> None:
    """Where IPython runs, a trajectory is shown with its figures (see gne_mj.notebook)."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if shell is not None:
        html = shell.display_formatter.formatters["text/html"]
        html.for_type_by_name("gne_mj.trajectory", "Trajectory", _notebook_html)


def _notebook_html(trajectory: "Trajectory") -> str:
    from gne_mj.notebook import notebook_html

    return notebook_html(trajectory)


_show_in_notebooks()


def __dir__() -> list[str]:
    return [*__all__, *(name for name in globals() if name.startswith("__"))]


if not TYPE_CHECKING:  # to a type checker the names above are all there are

    def __getattr__(name: str) -> Any:
        if name in __all__:
            module = import_module(_PLACES.get(name, "gne_mj.interface"))
            found = getattr(module, _NAMES.get(name, name))
            globals()[name] = found  # looked for once
            return found
        near = "" if name.startswith("_") else _nearest(name)
        raise AttributeError(f"module 'gne_mj' has no attribute {name!r}{near}")


def _nearest(name: str) -> str:
    from difflib import get_close_matches

    close = get_close_matches(name, __all__, n=1)
    return f": did you mean {close[0]!r}?" if close else ""
