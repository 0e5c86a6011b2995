"""Laws as objects: one function an information structure.

``mode`` is "continuous", "sampled" or "implicit", and ``decentralised`` for the last one: each
agent keeps to its share of every bound's slack. A ``graph`` is a :class:`gne_mj.Graph`, the name of
one (then of as many agents as the game has), or edges as pairs of agents numbered from 1.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from numpy.typing import ArrayLike

from gne_mj.arguments import answering
from gne_mj.controllers.full_information import FullController
from gne_mj.controllers.fully_distributed import DistributedController
from gne_mj.controllers.partial_information import PartialController
from gne_mj.controllers.table import LawTable
from gne_mj.graph import Graph
from gne_mj.interface.tables import made
from gne_mj.python_objects import LawFunctions, PythonLaw, keep

Network = Graph | str | Sequence[tuple[int, int]]
Estimates = str | Sequence[Sequence[int]]


@answering
def full_information(
    *,
    mode: str = "continuous",
    decentralised: bool = False,
    between: str = "watched",
    feed_forward: bool = False,
    observer: float = 0.0,
    compensation: bool = False,
) -> LawTable:
    """Every agent measures all actions [eq:nonlinFIfeedback].

    Args:
        mode: when the law is evaluated.
        decentralised: in mode implicit, whether each agent solves alone.
        between: "guarded" cuts periods of held modes before they lead outside.
        feed_forward: of a game that moves: add the input under which agents stay at y*(t).
        observer: in mode implicit, gain of each agent's observer of loads; 0 for none.
        compensation: in mode implicit, of MJCF robots: take off what files have of gravity, drag
            and friction (docs/robots.md).
    """
    return made(FullController, information="full", **locals())


@answering
def partial_information(
    graph: Network = "ring",
    *,
    coupling: float = 1.0,
    time_constant: float = 1.0,
    estimates: Estimates = "all",
    communication: Mapping[str, Any] | None = None,
    mode: str = "continuous",
    decentralised: bool = False,
    between: str = "watched",
    feed_forward: bool = False,
    observer: float = 0.0,
    compensation: bool = False,
) -> LawTable:
    """Costs at estimates that neighbours exchange, a measured barrier [eq:nonlinearPIFeedback].

    Args:
        graph: over which agents communicate.
        coupling: c; the paper has 1.
        time_constant: tau of the estimates in s; the paper has 1.
        estimates: of whom agents keep some: "all", the "needed" ones, or for each agent a list of
            agents, numbered from 1.
        communication: when messages are sent, as ``{"type": "event", "threshold": 0.1}``; left out,
            all the time or once a control period.
        mode: when the law is evaluated.
        decentralised: in mode implicit, whether each agent solves alone.
        between: "guarded" cuts periods of held modes before they lead outside.
        feed_forward: of a game that moves: add the input under which agents stay at y*(t).
        observer: in mode implicit, gain of each agent's observer of loads; 0 for none.
        compensation: in mode implicit, of MJCF robots: take off what files have of gravity, drag
            and friction (docs/robots.md).
    """
    return made(PartialController, information="partial", **locals())


@answering
def fully_distributed(
    graph: Network = "ring",
    *,
    epsilon: float,
    gain: float = 1.0,
    fast_weight: float = 3.0,
    estimates: Estimates = "all",
    communication: Mapping[str, Any] | None = None,
    mode: str = "continuous",
    decentralised: bool = False,
    between: str = "watched",
    feed_forward: bool = False,
    observer: float = 0.0,
    compensation: bool = False,
) -> LawTable:
    """Neighbours' messages and nothing else [eq:CenterFeedback].

    Args:
        graph: over which agents communicate.
        epsilon: time constant of estimates and z in s.
        gain: k.
        fast_weight: omega of W = V + omega V_fast.
        estimates: of whom agents keep some: "all", the "needed" ones, or for each agent a list of
            agents, numbered from 1.
        communication: when messages are sent, as ``{"type": "event", "threshold": 0.1}``; left out,
            all the time or once a control period.
        mode: when the law is evaluated.
        decentralised: in mode implicit, whether each agent solves alone.
        between: only "watched": what agents take for the profile is not what a guard would look at.
        feed_forward: only False: nobody knows all of the game.
        observer: in mode implicit, gain of each agent's observer of loads; 0 for none.
        compensation: in mode implicit, of MJCF robots: take off what files have of gravity, drag
            and friction (docs/robots.md).
    """
    return made(DistributedController, information="distributed", **locals())


def own_law(
    action: Callable[..., ArrayLike],
    rate: Callable[..., ArrayLike] | None = None,
    initial_memory: Callable[..., ArrayLike] | None = None,
    *,
    graph: Network = "ring",
    mode: str = "continuous",
    acts_outside: bool = False,
    filtered: bool = False,
    **parameters: Any,
) -> LawTable:
    """A law of plain Python functions, for a first try; nothing is claimed of it.

    Functions whose first argument is called ``agent`` are one agent's: they are called for each
    with a :class:`gne_mj.controllers.local_law.Agent`, which has that agent's action, memory, cost,
    constraints and neighbours, and nothing else. Others see the whole game.

    >>> def damped(game, rho, y, memory, gain):
    ...     slope = game.constraint_jacobian(y).T @ (rho / -game.constraints(y))
    ...     return -gain * (game.pseudo_gradient(y) + slope)
    >>> law = gne_mj.own_law(damped, gain=2.0)

    Args:
        action: ``action(game, rho, y, memory, **parameters)`` returns u, shape (m,); or
            ``action(agent, **parameters)`` returns u_i, shape (m_i,).
        rate: ``rate(game, rho, y, memory, **parameters)``, or ``rate(agent, **parameters)``,
            returns the memory's rate; only with a memory.
        initial_memory: ``initial_memory(y, **parameters)``, or ``initial_memory(agent,
            **parameters)``, returns the memory at the start.
        graph: over which agents hear each other.
        mode: "continuous"; a law without a memory also "sampled", a filtered one "implicit" too.
        acts_outside: whether the functions have an action where constraints are violated, so that
            runs may go on there (``simulation.on_exit``).
        filtered: whether the barrier is added to what ``action`` asks for, as a safety filter of a
            policy; in mode "implicit" it keeps the set at control instants (docs/learning.md).
        **parameters: numbers and lists, which can be changed and swept as
            ``controller.parameters.NAME``.
    """
    given = {"action": action, "rate": rate, "initial_memory": initial_memory}
    functions = {name: function for name, function in given.items() if function is not None}
    kept = LawFunctions(functions, acts_outside, filtered)
    flags = {"acts outside": acts_outside, "filtered": filtered}
    also = tuple(word for word, said in flags.items() if said)
    name = keep(kept, getattr(action, "__name__", "law"), functions, *also)
    return made(PythonLaw, information="python", object=name, graph=graph, mode=mode,
                parameters=parameters)  # fmt: skip
