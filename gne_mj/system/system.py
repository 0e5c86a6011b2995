"""One game with its agents, law, engine and start: everything that a closed loop needs."""

from dataclasses import dataclass

from gne_mj.barrier import LogBarrier
from gne_mj.errors import InvalidInput
from gne_mj.game_check import refuse
from gne_mj.system import checks
from gne_mj.system.apart import check_separation
from gne_mj.system.assembly import Assembly
from gne_mj.system.guard import check_guard
from gne_mj.system.membership import check_membership
from gne_mj.system.observer import check_observer


@dataclass(frozen=True, eq=False, repr=False)
class System(Assembly):
    """A game that agents play under a law.

    Args:
        name: what the system is called in messages and files.
        game: the game.
        agents: one channel for each action of the game.
        law: the feedback law.
        rho: the barrier's penalty parameter; with a schedule the value that it falls to.
        state: (m, states) of the agents' channels at the start; the outputs strictly inside.
        memory: of the law at the start; if left out, estimates and z equal y(0). Under the fully
            distributed law all profiles at which agents evaluate the barrier must be inside.
        mode: "continuous", "sampled" or "implicit".
        engine: "ode", or "mujoco" for flexible robots.
        integrator: "rk4" or "euler"; for engine "ode" in mode continuous also "tsit5", which
            chooses its steps by their error, and for the fully distributed law there
            "rosenbrock", which does so too and does not mind a small epsilon.
        schedule: how the penalty falls to rho in time; None if it does not change.
        feed_forward: whether the input that y* needs to move is added to the law's
            (:mod:`gne_mj.feed_forward`).
        decentralised: mode implicit: each agent finds its input alone and keeps to its share of
            what is left of every bound (:mod:`gne_mj.loops.local`).
        between: "watched", or "guarded": held modes cut a control period before it leads outside
            (:mod:`gne_mj.loops.guard`).
        faults: what goes wrong (:mod:`gne_mj.faults`).
        seed: of what is random in the faults.
        disturbance: what the game's tightening is meant to cover; None if nothing is declared.
        separation: how far apart agents in the plane or in space keep; None if nothing keeps
            them apart.
        rtol: error allowed in a step that "tsit5" or "rosenbrock" chooses, of each state
            relative to its greatest magnitude so far.
        observer: mode implicit: gain of each agent's observer of loads (:mod:`gne_mj.loops.loads`),
            0 for none.
        compensation: mode implicit, robots of a user's: whether the input that keeps outputs
            where they are is added to the law's (:func:`gne_mj.loops.implicit.find_keeping`).
        membership: who leaves and joins during a run, if anybody does.
        load: (m,) the loads that are known at the start, in the input's unit; 0 if left out.
        on_exit: "stop", or "continue": under a law that acts outside the set (``acts_outside``)
            runs go on there, and what they do is measured; under others they end as ever.

    Raises:
        InvalidInput: parts that do not fit together.
        InfeasibleStart: an initial action on or outside the boundary.
    """

    def __repr__(self) -> str:
        """One line: game, agents, law, engine, penalty."""
        return (
            f"<System {self.name!r}: {self.game.name}, {self.game.agents} agents"
            f" ({self.agents.kind.NAME}s), {self.law.information} law, mode {self.mode},"
            f" {self.engine} by {self.integrator}, rho = {self.rho:g}>"
        )

    def __post_init__(self) -> None:
        object.__setattr__(self, "barrier", LogBarrier(self.game, self.rho))
        checks.check_parts(self)
        checks.check_start(self)
        refuse(self.game, self.start)
        checks.check_law_room(self.game, self.law)
        expected = self.law.initial_memory(self.start)
        if not len(self.memory):
            object.__setattr__(self, "memory", expected)
        elif self.memory.shape != expected.shape:
            raise InvalidInput(
                "memory",
                f"shape {self.memory.shape}",
                f"the {self.law.information} law's memory has shape {expected.shape}",
            )
        checks.check_memory(self)
        checks.check_engine(self)
        checks.check_faults(self)
        checks.check_network(self)
        check_separation(self)
        check_guard(self)
        check_observer(self)
        check_membership(self)
