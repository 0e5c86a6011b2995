"""What a program or a notebook imports as ``gne_mj``: objects for all that a scenario names.

Agents, laws and faults are made by functions of plain names. Each returns the table that a scenario
file would have in that place, so that both mean the same and are checked by the same rules.
:func:`setup` puts them together to a scenario; what acts on one takes any source of it.
"""

from gne_mj.interface.agents import (
    custom_agents,
    flexible_robots,
    integrators,
    mixed_agents,
    mjcf_robots,
    pi_cascades,
    planar_robots,
)
from gne_mj.interface.analyses import certify, check, solve
from gne_mj.interface.examining import examine
from gne_mj.interface.faults import (
    bias,
    estimate_corruption,
    message_delay,
    message_loss,
    noise,
    push,
    saturation,
    sensor_delay,
    silence,
)
from gne_mj.interface.laws import full_information, fully_distributed, own_law, partial_information
from gne_mj.interface.program_rivals import (
    cbf_filter,
    discrete_cbf_filter,
    projected_gradient,
    receding_horizon,
    safe_monotone_flow,
)
from gne_mj.interface.rivals import (
    feedback_seeking,
    l1_penalty,
    primal_dual_partial,
    primal_dual_play,
    quadratic_penalty,
    recursive_safe_flow,
)
from gne_mj.interface.running import Run, run, setup
from gne_mj.interface.show import Figures, plot, view
from gne_mj.interface.variations import Variations, vary

__all__ = [
    "Figures",
    "Run",
    "Variations",
    "bias",
    "cbf_filter",
    "certify",
    "check",
    "custom_agents",
    "discrete_cbf_filter",
    "estimate_corruption",
    "examine",
    "feedback_seeking",
    "flexible_robots",
    "full_information",
    "fully_distributed",
    "integrators",
    "l1_penalty",
    "message_delay",
    "message_loss",
    "mixed_agents",
    "mjcf_robots",
    "noise",
    "own_law",
    "partial_information",
    "pi_cascades",
    "planar_robots",
    "plot",
    "primal_dual_partial",
    "primal_dual_play",
    "projected_gradient",
    "push",
    "quadratic_penalty",
    "receding_horizon",
    "recursive_safe_flow",
    "run",
    "safe_monotone_flow",
    "saturation",
    "sensor_delay",
    "setup",
    "silence",
    "solve",
    "vary",
    "view",
]
