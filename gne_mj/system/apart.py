"""Whether a system's agents can keep apart, and begin so."""

import numpy as np

from gne_mj.bounds import check_room
from gne_mj.errors import InfeasibleStart, InvalidInput
from gne_mj.faults import Bias, Noise, SensorDelay
from gne_mj.registry import MODES
from gne_mj.system.data import SystemData
from gne_mj.system.modes import mode_of


def check_separation(system: SystemData) -> None:
    """Refuse what separation is not for, and starts of which two agents are too near.

    Raises:
        InvalidInput, InfeasibleStart: naming ``separation`` or ``state``.
    """
    if system.separation is None:
        return
    key, rule = "separation", system.separation
    positions, parameters = system.start_positions, system.agents.kind.PARAMETERS
    sizes = set(system.game.sizes)
    if positions is None or sizes not in ({2}, {3}):
        raise InvalidInput(
            key,
            "given",
            "it is for agents in the plane or in space (actions of 2 or of 3 entries) whose output"
            " is a position (agents.output, or agents.lookahead)",
        )
    tau = system.agents.parameters[:, parameters.index("lookahead")]
    if np.any(tau != tau[0]):
        raise InvalidInput(key, "given", "it needs one look-ahead for all agents")
    if not mode_of(system).keeps_apart:
        names = " or ".join(f"'{mode.name}'" for mode in MODES if mode.keeps_apart)
        raise InvalidInput(key, "given", f"nothing keeps agents apart in mode '{system.mode}'; use"
                           f" {names}")  # fmt: skip
    if system.decentralised or not system.law.guarded:
        raise InvalidInput(
            key,
            "given",
            "agents find their inputs with where the others really are: it is for full and partial"
            " information, and not decentralised",
        )
    if any(isinstance(fault, Noise | Bias | SensorDelay) for fault in system.faults):
        raise InvalidInput(key, "given", "it needs sensors that read true, and in time")
    if system.disturbance is not None:
        raise InvalidInput(key, "given", "no margin is known for it: leave one of both out")
    m = system.game.actions
    check_room("agents.count", system.game.agents, 3 * m * m, "pairs of agents")
    if system.game.agents < 2:
        return
    each = (system.game.agents, -1)
    i, j, near = rule.nearest(positions.reshape(each), system.start.reshape(each))
    if not near > rule.distance:
        raise InfeasibleStart(
            "state",
            f"positions and outputs of agents {i + 1} and {j + 1}",
            f"separation of agents {i + 1} and {j + 1}",
            rule.distance - near,
        )
