"""The functions of a run's law, which loops call by their addresses.

A law is a module of kernels (:mod:`gne_mj.controllers.law`) that :mod:`gne_mj.loops.link` compiles
by itself. A loop finds the addresses in ``problem.functions`` and calls them with the kernels here.
One call does its work for all agents, so that calling costs next to nothing.
"""

from gne_mj.native import address_in, call_integer, call_number, kernel

# Entries of ``problem.functions``, those of the second line for mode implicit
ACTION, RATE, PROPAGATE, STORAGE = range(4)
PREPARE, BARRIER_FREE_TERMS, ADD_BARRIER_FREE_SLOPE, OWN_PROFILE, MEMORY_OUTPUTS, SOLVE, ACT = (
    range(4, 11)
)
# For penalties and games that change in time, agents whose positions follow their outputs, bodies
# that collide, and agents that keep apart
PENALTY, POSITIONS, CONTACTS, KEEP_APART, PUSH_APART, COUNT = range(11, 17)


@kernel
def action(problem, y, weights, memory, work, u):
    """Fill u (m,) at y (m,); -1, or agent * p + constraint of the first estimate not inside."""
    return call_integer(
        problem.functions[ACTION],
        (
            problem.parameter_block, address_in(y), address_in(weights), address_in(memory),
            address_in(work.profile), address_in(work.now), address_in(u),
        ),
    )  # fmt: skip


@kernel
def penalty(problem, time, rho):
    """The penalty at a time in s: rho, or what the schedule says; a game that moves is brought to
    that time."""
    if problem.functions[PENALTY] == 0:
        return rho
    return call_number(problem.functions[PENALTY], (problem.parameter_block, time))


@kernel
def observe_positions(problem, work, monitor, time, state):
    """Note the constraints' values at the positions of a flat state, if agents have such."""
    if problem.functions[POSITIONS] != 0:
        call_integer(
            problem.functions[POSITIONS],
            (
                problem.parameter_block, address_in(work.profile), address_in(work.at_positions),
                address_in(monitor), time, address_in(state),
            ),
        )  # fmt: skip


@kernel
def observe_contacts(problem, monitor, data, time):
    """Note contacts between agents that mjData at an address has, if their bodies collide."""
    if problem.functions[CONTACTS] != 0:
        call_integer(
            problem.functions[CONTACTS],
            (problem.parameter_block, data, address_in(monitor), time),
        )


@kernel
def keep_apart(problem, place, at, state):
    """Look at agents that keep apart; False, with the exit latched, if they do not."""
    if problem.functions[KEEP_APART] == 0:
        return True
    kept = call_integer(
        problem.functions[KEEP_APART],
        (problem.parameter_block, place[0], at.time, at.step, at.stage, address_in(state)),
    )
    return kept != 0


@kernel
def push_apart(problem, place, at):
    """Add to work.commanded what keeps agents apart; False, with the exit latched, if that is too
    much."""
    if problem.functions[PUSH_APART] == 0:
        return True
    good = call_integer(
        problem.functions[PUSH_APART],
        (problem.parameter_block, place[0], at.time, at.step, at.stage),
    )
    return good != 0


@kernel
def rate(problem, y, memory, out):
    """Fill out, as long as the law's memory, with its rate at y (m,)."""
    if len(memory) > 0:
        call_integer(
            problem.functions[RATE],
            (problem.parameter_block, address_in(y), address_in(memory), address_in(out)),
        )


@kernel
def propagate(problem, y, memory, scratch):
    """Move the law's memory over a control period with the outputs held at y (m,)."""
    if len(memory) > 0:
        call_integer(
            problem.functions[PROPAGATE],
            (
                problem.parameter_block, address_in(y), address_in(memory), address_in(scratch),
                len(scratch),
            ),
        )  # fmt: skip


@kernel
def storage(problem, memory):
    """The memory's part of the Lyapunov function."""
    if len(memory) == 0:
        return 0.0
    return call_number(problem.functions[STORAGE], (problem.parameter_block, address_in(memory)))


@kernel
def prepare(problem, first, last, y, memory):
    """Put the actions of agents ``first`` to ``last`` - 1 where its law reads them."""
    call_integer(
        problem.functions[PREPARE],
        (problem.parameter_block, first, last, address_in(y), address_in(memory)),
    )


@kernel
def barrier_free_terms(problem, first, last, y, memory, out):
    """Prepare, and fill these agents' entries of out (m,) with what drives them but the barrier."""
    call_integer(
        problem.functions[BARRIER_FREE_TERMS],
        (problem.parameter_block, first, last, address_in(y), address_in(memory), address_in(out)),
    )


@kernel
def add_barrier_free_slope(problem, i, a, y, memory, out):
    """Add the derivative of entry a of that, of agent i, to out (m,)."""
    call_integer(
        problem.functions[ADD_BARRIER_FREE_SLOPE],
        (problem.parameter_block, i, a, address_in(y), address_in(memory), address_in(out)),
    )


@kernel
def own_profile(problem, i, y, memory, profile):
    """Fill profile (m,) with what agent i's barrier reads; by how much its own block moves with its
    own action."""
    return call_number(
        problem.functions[OWN_PROFILE],
        (problem.parameter_block, i, address_in(y), address_in(memory), address_in(profile)),
    )


@kernel
def memory_outputs(problem, prediction, held):
    """The outputs (m,) that the memory moves with; those of the period's end are ``prediction``."""
    call_integer(
        problem.functions[MEMORY_OUTPUTS],
        (problem.parameter_block, address_in(prediction), address_in(held)),
    )


@kernel
def solve(problem, memory, work):
    """Solve for the outputs of the period's end; how that ended (:mod:`gne_mj.loops.newton`).

    work.solver has base and slope of the plant's map.
    """
    return call_integer(
        problem.functions[SOLVE],
        (
            problem.parameter_block,
            address_in(memory),
            address_in(work.profile),
            address_in(work.now),
            address_in(work.solver),
            len(work.solver),
            address_in(work.separation),
        ),
    )


@kernel
def act(problem, place, time, step, state, memory):
    """Fill work.commanded in mode implicit; False, with the exit latched, if there is no input.

    Args:
        problem: of the run.
        place: addresses of the loop's workspace and, in MuJoCo, of model and data.
        time: in s, at the start of ``step``.
        step: which.
        state: flat.
        memory: the law's.
    """
    workspace, model, data = place
    good = call_integer(
        problem.functions[ACT],
        (
            problem.parameter_block,
            workspace,
            time,
            step,
            address_in(state),
            address_in(memory),
            model,
            data,
        ),
    )
    return good != 0
