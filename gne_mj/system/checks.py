"""Whether the parts of a system fit together, and its start lies inside.

Each function raises InvalidInput or InfeasibleStart, naming the system's parameter, its value and
what would be right.
"""

import numpy as np

from gne_mj.bounds import check_room
from gne_mj.changing_graph import ChangingGraph, DiscGraph
from gne_mj.controllers import Law, PlainLaw
from gne_mj.errors import InfeasibleStart, InvalidInput, part_of
from gne_mj.faults import (
    MESSAGES,
    for_native,
    message_delay,
    sensor_delay,
    strikes_messages,
    triggered,
)
from gne_mj.feed_forward import FED
from gne_mj.game_model import Game
from gne_mj.loops.feedback import Problem
from gne_mj.motion import motion_of
from gne_mj.native import INTERPRETED
from gne_mj.plants import integrator
from gne_mj.plants.agent_type import has_ode, in_mujoco
from gne_mj.system.data import ADAPTIVE, CONTINUE, STOP, SystemData
from gne_mj.system.modes import mode_of

# The Rosenbrock loop keeps the estimates' dense eigenbases, N x N x N numbers
ROSENBROCK_AGENTS = 200
RTOL = 1e-12, 1e-2  # errors in a step that adaptive integrators can be asked for
# How many copies of all estimates a loop makes: stages of the integrator, and some for itself
ESTIMATES = 8


def check_law_room(game: Game, law: Law) -> None:
    """Refuse laws that fill the memory: with estimates, loops' copies included, or programs."""
    check_room(
        "agents.count", game.agents, law.room(game), f"what the {law.information} law solves"
    )
    if law.graph is not None:
        kept = game.agents * game.actions if law.kept is None else law.kept.size
        size = ESTIMATES * kept
        what = f"what {game.agents} agents estimate of each other"
        check_room("agents.count", game.agents, size, what)


def check_parts(system: SystemData) -> None:
    """Refuse parts whose shapes or kinds do not go together."""
    m = system.game.actions
    if system.on_exit not in (STOP, CONTINUE):
        raise InvalidInput("on_exit", system.on_exit, f"it must be '{STOP}' or '{CONTINUE}'")
    if system.agents.channels != m:
        raise InvalidInput(
            "agents.count",
            system.agents.channels,
            f"the {system.game.called} has {m} actions",
        )
    if system.state.shape != (m, system.agents.states):
        raise InvalidInput(
            "state",
            system.state.shape,
            f"the state's shape must be ({m}, {system.agents.states})",
        )
    if system.law.graph is not None and system.law.graph.agents != system.game.agents:
        raise InvalidInput(
            "law.graph",
            system.law.graph.agents,
            f"the game has {system.game.agents} agents",
        )
    if motion_of(system.game) is not None and isinstance(system.law, PlainLaw):
        raise InvalidInput(
            "law", "plain functions", "they are given a game that stands still: let its numbers"
            " stand, or write the law as kernels",
        )  # fmt: skip
    if system.law.knows_plant and not has_ode(system.agents.kind):
        raise InvalidInput(
            "law", type(system.law).__name__, "it asks for the agents' equations, which"
            f" {system.agents.kind.NAME}s have in MuJoCo only",
        )  # fmt: skip
    check_feed_forward(system)
    check_compensation(system)
    mode = mode_of(system)
    mode.check_law(system)
    if system.decentralised and not mode.shares_slack(system):
        raise InvalidInput(
            "decentralised",
            True,
            "it is for mode 'implicit' under full or partial information",
        )
    if not np.all(np.isfinite(system.state)):
        raise InvalidInput("state", "nan or inf", "every entry must be finite")
    for quantity in system.game.quantities:  # wrong shapes are better found before a run
        with part_of(f"game.quantities.{quantity.name}"):
            quantity.at(system.start[None], system.game.entries(quantity))
            quantity.bounds(system.game.entries(quantity))


def check_feed_forward(system: SystemData) -> None:
    """Refuse an input fed forward where nothing moves, or that is not known."""
    if not system.feed_forward:
        return
    kind, key = system.agents.kind, "feed_forward"
    if not system.moves:
        raise InvalidInput(key, True, "it is for games or penalties that move")
    if not system.law.guarded:
        raise InvalidInput(key, True, "it is for full and partial information")
    known = (integrator,) if mode_of(system).held else FED
    if kind not in known:
        names = " and ".join(f"{each.NAME}s" for each in known)
        raise InvalidInput(key, True, f"in mode '{system.mode}' it is known of {names}")


def check_compensation(system: SystemData) -> None:
    """Refuse to take off what a robot has of drag and friction where it is not predicted.

    Raises:
        InvalidInput: names ``compensation``.
    """
    if not system.compensation:
        return
    key = "compensation"
    if system.mode != "implicit":
        raise InvalidInput(key, True, "it is what a prediction needs to stay: use mode 'implicit'")
    if has_ode(system.agents.kind):
        raise InvalidInput(
            key, True,
            "it is for MJCF robots, which files give drag and friction, and not"
            f" {system.agents.kind.NAME}s",
        )  # fmt: skip
    if system.guarded:
        raise InvalidInput(
            key, True, "it is not known of periods that are cut: between = 'watched'"
        )


def check_lists(system: SystemData, problem: Problem) -> None:
    """Refuse a law whose graph or propagator native code would read beyond its end.

    A law of one's own gives both itself, and native code believes what it is given.
    """
    key = "law.graph"
    agents, (pointer, neighbour) = system.game.agents, problem.graph
    if system.law.graph is None:
        return
    if len(pointer) != agents + 1 or pointer[0] != 0 or np.any(np.diff(pointer) < 0):
        raise InvalidInput(
            key,
            f"neighbour lists that begin at {pointer[:6].tolist()}",
            f"they must begin at {agents + 1} places that rise from 0, one for each agent",
        )
    if len(neighbour) != pointer[-1] or np.any((neighbour < 0) | (neighbour >= agents)):
        raise InvalidInput(
            key,
            f"neighbours {(neighbour[:6] + 1).tolist()}",
            f"there must be {pointer[-1]} of them, agents 1 to {agents}",
        )
    maps, coefficients = problem.propagator.maps, problem.propagator.coefficients
    if (
        system.law.kept is None
        and mode_of(system).held
        and not len(coefficients)
        and maps.shape != (agents,) * 3
    ):
        raise InvalidInput(
            key,
            f"a propagator of shape {maps.shape}",
            f"it must have coefficients, or maps of shape ({agents}, {agents}, {agents})",
        )


def check_start(system: SystemData) -> None:
    """Refuse a start that is not strictly inside, or within the barrier's tightening."""
    key = "state"
    with np.errstate(over="ignore"):  # a constraint that overflows is not kept either
        what = f"initial {system.game.action_name} {np.round(system.start[:6], 4).tolist()}"
        worst, value = system.game.tightest(system.start)
        tight = system.game.constraints(system.start) + system.game.margins
    if not value < 0.0:
        raise InfeasibleStart(key, what, system.game.constraint_names[worst], value)
    positions = system.start_positions
    if positions is not None:  # which stay inside with the outputs if they begin there
        what_of = f"initial positions {np.round(positions[:6], 4).tolist()}"
        at, far = system.game.tightest(positions)
        if not far < 0.0:
            raise InfeasibleStart(key, what_of, system.game.constraint_names[at], far)
    worst = int(np.argmax(tight))
    if not tight[worst] < 0.0:
        name = (
            f"{system.game.constraint_names[worst]}, tightened by {system.game.margins[worst]:g},"
        )
        raise InfeasibleStart(key, what, name, float(tight[worst]))


def check_memory(system: SystemData) -> None:
    """Refuse estimates at which an agent would evaluate the barrier outside."""
    if not np.all(np.isfinite(system.memory)):
        raise InvalidInput("memory", "nan or inf", "every entry must be finite")
    data = system.game.data
    profiles = system.law.barrier_profiles(system.game.agent_of_action, system.memory)
    for i, g in enumerate(system.game.constraints(profiles) + system.game.margins):
        own = data.own_index[data.own_pointer[i] : data.own_pointer[i + 1]]
        outside = own[~(g[own] < 0.0)]
        if len(outside):
            raise InfeasibleStart(
                "memory",
                f"initial estimates of agent {i + 1}",
                system.game.constraint_names[outside[0]],
                float(g[outside[0]]),
            )


def check_engine(system: SystemData) -> None:
    """Refuse agents, laws and modes that the engine or integrator does not run."""
    if system.schedule is not None and system.integrator == "rosenbrock":
        raise InvalidInput(
            "integrator",
            system.integrator,
            "it is for a penalty that does not change in time; use 'rk4'",
        )
    if motion_of(system.game) is not None and system.integrator == "rosenbrock":
        raise InvalidInput(
            "integrator", system.integrator, "it is for games whose numbers stand still; use 'rk4'"
        )
    kind = system.agents.kind
    if system.engine == "mujoco" and INTERPRETED:
        raise InvalidInput(
            "engine",
            system.engine,
            "MuJoCo calls machine code only: unset NUMBA_DISABLE_JIT, or use engine 'ode'",
        )
    if system.engine == "mujoco" and not in_mujoco(kind):
        raise InvalidInput(
            "engine",
            system.engine,
            f"MuJoCo has models of flexible robots and of a user's MJCF files; run"
            f" {kind.NAME}s on 'ode'",
        )
    if system.engine == "ode" and not has_ode(kind):
        raise InvalidInput("engine", system.engine, f"{kind.NAME}s run on 'mujoco'")
    if system.agents.contacts and system.engine != "mujoco":
        raise InvalidInput(
            "agents.contacts", True, "only MuJoCo has bodies: it must be false on engine 'ode'"
        )
    if system.integrator == "rosenbrock" and system.game.agents > ROSENBROCK_AGENTS:
        raise InvalidInput(
            "integrator",
            system.integrator,
            f"it keeps N x N x N numbers and is for up to {ROSENBROCK_AGENTS} agents, not"
            f" {system.game.agents}; use mode 'sampled'",
        )
    if system.integrator in ADAPTIVE and not RTOL[0] <= system.rtol <= RTOL[1]:
        raise InvalidInput("rtol", system.rtol, f"it must lie from {RTOL[0]:g} to {RTOL[1]:g}")
    if system.integrator == "tsit5":
        check_adaptive(system)
    if system.integrator == "rosenbrock" and (
        not system.law.rosenbrock or mode_of(system).held or system.engine != "ode"
    ):
        raise InvalidInput(
            "integrator",
            system.integrator,
            "it is for engine 'ode', the distributed law with all estimates and mode"
            " 'continuous'; use 'rk4' or 'euler'",
        )


def check_adaptive(system: SystemData) -> None:
    """Refuse what integrator "tsit5" does not run."""
    key = "integrator"
    if system.engine != "ode":
        raise InvalidInput(
            key, system.integrator, "MuJoCo steps by itself: it is for engine 'ode'; use 'rk4'"
        )
    if mode_of(system).held:
        raise InvalidInput(
            key,
            system.integrator,
            f"it is for mode 'continuous': in mode '{system.mode}' inputs are held for whole"
            " timesteps; use 'rk4' or 'euler'",
        )
    if system.separation is not None:
        raise InvalidInput(
            key, system.integrator, "agents that keep apart need a fixed timestep; use 'rk4'"
        )


def check_network(system: SystemData) -> None:
    """Refuse a graph that changes where what it changes is not known."""
    graph, key = system.law.graph, "law.graph"
    if graph is not None and graph.rest_of is not None and strikes_messages(system.faults):
        raise InvalidInput(key, "without a link", "faults of messages are of a graph that stays")
    if not isinstance(graph, ChangingGraph):
        return
    if system.integrator in ("rosenbrock", "tsit5"):
        raise InvalidInput(
            "integrator",
            system.integrator,
            "its steps do not end where the graph changes; use 'rk4' or 'euler'",
        )
    if strikes_messages(system.faults):
        raise InvalidInput(key, "one that changes", "faults of messages are of a graph that stays")
    if isinstance(graph, DiscGraph) and system.places(system.state) is None:
        raise InvalidInput(
            key, "'disc'", f"{system.agents.kind.NAME}s have no places from which distances follow"
        )


def check_faults(system: SystemData) -> None:
    """Refuse faults that the integrator, mode or agents do not know."""
    key = "faults"
    if system.faults and system.integrator in ADAPTIVE:
        raise InvalidInput(key, "given", f"integrator '{system.integrator}' knows none; use 'rk4'")
    for number, fault in enumerate(system.faults):
        where = f"{key}.{number}"
        if fault.needs_graph and system.law.graph is None:
            raise InvalidInput(where, type(fault).__name__, fault.needs_graph)
        with part_of(where):
            for_native((fault,), system.game, system.law.graph, system.seed)
    _check_triggers(system)
    m, graph = system.game.actions, system.law.graph
    kept = (sensor_delay(system.faults) + 1) * m * (system.agents.states + 1)
    if strikes_messages(system.faults) and graph is not None:
        kept += _messages(system)
    check_room(key, "late", ESTIMATES * kept, "what was sent or measured before")
    mode_of(system).check_faults(system)


def _check_triggers(system: SystemData) -> None:
    """Refuse triggers where what was sent last is not what all neighbours have."""
    if not triggered(system.faults):
        return
    key = "communication"
    if sum(isinstance(fault, MESSAGES) for fault in system.faults) > 1:
        expected = "whoever sends must know what was heard last: no other faults of messages"
        raise InvalidInput(key, "event", expected)
    if system.law.kept is not None:
        raise InvalidInput(key, "event", "agents must keep all estimates: estimates = 'all'")
    if system.law.sent_besides:
        raise InvalidInput(key, "event", "triggers are of estimates, and this law sends more")


def _messages(system: SystemData) -> int:
    """Entries of what came last over every link, and of what was sent before."""
    law, slots = system.law, message_delay(system.faults) + 1
    assert law.graph is not None
    if law.kept is not None:
        return law.kept.heard_size + slots * law.kept.size
    message = system.game.actions + 2 * law.sent_besides
    return (2 * len(law.graph.edges) + slots * law.graph.agents) * message
