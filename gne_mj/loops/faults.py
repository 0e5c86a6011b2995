"""Faults as a run meets them: pushes, limits, sensors, messages, corrupted estimates.

Everything random is a function of seed, fault, target and step alone, so that a run repeats to the
last bit however it is cut into pieces. See :mod:`gne_mj.faults` for what users write.

Where sensors are late, ``work.history`` holds the flat states at the last control instants and
behind them the inputs of those periods, as rings. Where messages can be lost or late, the law's
memory has what came last over every link, and behind it a ring of the rows that were sent. Where
agents send by triggers, that ring has one place, what each sent last, and behind it is how many
messages of each came over links.
"""

import numpy as np

from gne_mj import game_functions as games
from gne_mj.controllers import kept_estimates
from gne_mj.controllers.settings import BESIDES, LINKS
from gne_mj.loops.faultless import begins as begins
from gne_mj.loops.faultless import elapse as elapse
from gne_mj.loops.feedback import FAULT_COLUMNS, FAULT_KINDS, Fault
from gne_mj.loops.functions import keep_apart as keep_apart
from gne_mj.loops.functions import push_apart as push_apart
from gne_mj.native import compiled, copy, kernel
from gne_mj.numbers import numbers_in

# Kinds of rows, in their order in ``Faults.rows``
PUSH, LIMIT, NOISE, BIAS, LOSS, LATE, SILENCE, CORRUPTION, TRIGGER = range(FAULT_KINDS)
STEADY, SINE, SQUARE, RANDOM = range(4)  # forms of pushes
# Whether the law's action follows from the present state alone, whichever step comes next
PREDICTION_KNOWN = False
RECORDED = True  # whether rows have what was seen and what acted

_fault_at = numbers_in(Fault)

_GOLDEN, _FIRST, _SECOND = (
    np.uint64(0x9E3779B97F4A7C15),
    np.uint64(0xBF58476D1CE4E5B9),
    np.uint64(0x94D049BB133111EB),
)


@kernel
def _mix(z):
    """The finaliser of SplitMix64 (Steele, Lea and Flood, OOPSLA 2014)."""
    z = (z ^ (z >> np.uint64(30))) * _FIRST
    z = (z ^ (z >> np.uint64(27))) * _SECOND
    return z ^ (z >> np.uint64(31))


@kernel
def uniform(seed, stream, target, count):
    """A number in [0, 1) that depends on these four whole numbers alone."""
    z = _mix(np.uint64(np.int64(seed)) + _GOLDEN)
    z = _mix(z ^ (np.uint64(np.int64(stream)) * _GOLDEN + _GOLDEN))
    z = _mix(z ^ (np.uint64(np.int64(target)) * _GOLDEN + _GOLDEN))
    z = _mix(z ^ (np.uint64(np.int64(count)) * _GOLDEN + _GOLDEN))
    return np.float64(z >> np.uint64(11)) * 2.0**-53


@kernel
def fault(faults, f):
    """The f-th fault."""
    return _fault_at(faults.rows, f * FAULT_COLUMNS)


@kernel
def active(row, time):
    """Whether a fault is on; half a nanosecond of rounding does not count."""
    return row.start <= time + 5e-10 and time + 5e-10 < row.end


@kernel
def spread(faults, row, count):
    """A random number between -1 and 1 for this row and step."""
    return 2.0 * uniform(faults.numbers.seed, row.stream, row.target, count) - 1.0


@kernel
def count_of(clock, step):
    """Which control period a step belongs to (which step, in mode continuous)."""
    return step if clock.mode == 0 else step // clock.period


@kernel
def measured(problem):
    """Whether the law has the outputs as they are: no noise, no bias, no delay."""
    faults = problem.faults
    return faults.pointer[NOISE] == faults.pointer[BIAS + 1] and faults.numbers.sensor_delay == 0.0


@kernel
def begin(parts, at, state, memory):
    """What happens before the law acts: sensors read, estimates corrupted, messages exchanged."""
    work, clock, step = parts.work, parts.clock, at.step
    # at a control instant of the clock's; where periods end early there are others
    regular = clock.mode == 0 or step % clock.period == 0
    fresh = at.stage == 0 and work.now.faults_step <= step and regular
    if at.stage == 0:
        work.now.faults_step = step + 1.0
    read_sensors(parts, step, state)
    if parts.clock.mode != 0:
        copy(work.measurement, work.held)
    if len(memory) > 0:
        if fresh:
            corrupt(parts.problem, parts.clock, step, memory)
        if parts.problem.settings[LINKS] > 0.0 and regular:
            exchange(parts.problem, parts.clock, step, memory, work, parts.monitor)


@kernel
def choose(y, measurement):
    """Of the outputs as they are and as they are seen, those that the law has."""
    return measurement


@kernel
def read_sensors(parts, step, state):
    """Fill work.measurement (m,) with the outputs as they are read, perhaps of some periods ago."""
    work, faults = parts.work, parts.problem.faults
    m, time, count = len(work.y), step * parts.clock.h, count_of(parts.clock, step)
    delay = int(faults.numbers.sensor_delay)
    if delay > 0:
        slots = delay + 1
        size = (len(work.history) // slots) - m
        states = size // m
        at = (count % slots) * size
        copy(state[:size], work.history[at : at + size])
        at = (max(count - delay, 0) % slots) * size
        for r in range(m):
            work.measurement[r] = work.history[at + r * states + parts.channels.output]
    else:
        copy(work.y, work.measurement)
    for f in range(faults.pointer[NOISE], faults.pointer[NOISE + 1]):
        row = fault(faults, f)
        if active(row, time):
            work.measurement[int(row.target)] += row.amount * spread(faults, row, count)
    for f in range(faults.pointer[BIAS], faults.pointer[BIAS + 1]):
        row = fault(faults, f)
        if active(row, time):
            work.measurement[int(row.target)] += row.amount


@kernel
def corrupt(problem, clock, step, memory):
    """Shift an agent's estimates, once, at the first control instant from a fault's start on."""
    faults, kept, m, time = problem.faults, problem.kept, len(problem.data.owner), step * clock.h
    for f in range(faults.pointer[CORRUPTION], faults.pointer[CORRUPTION + 1]):
        row = fault(faults, f)
        long = clock.h if clock.mode == 0 else clock.h * clock.period
        if row.start <= time + 5e-10 and time + 5e-10 < row.start + long:
            i = int(row.target)
            first, last = 0, m
            if len(kept.pointer) > 0:
                first, last = kept.row_pointer[i], kept.row_pointer[i + 1]
            for q in range(first, last):
                r, at = q, i * m + q
                if len(kept.pointer) > 0:
                    r, at = kept.action[q], kept.entry[q]
                if problem.data.owner[r] != i:
                    shift = 2.0 * uniform(faults.numbers.seed, row.stream, i * m + r, 0) - 1.0
                    memory[at] += row.amount * shift


@kernel
def comes(faults, time, count, link):
    """Whether the message over a link is not lost in a control period; it may still be late."""
    for f in range(faults.pointer[LOSS], faults.pointer[LOSS + 1]):
        row = fault(faults, f)
        chance = uniform(faults.numbers.seed, row.stream, link, count)
        if row.target == link and active(row, time) and chance < row.amount:
            return False
    for f in range(faults.pointer[SILENCE], faults.pointer[SILENCE + 1]):
        row = fault(faults, f)
        if row.target == link and active(row, time):
            return False
    return True


@compiled
def count_messages(faults, h, period, first, last, out):
    """Add what came and what was lost over every link, out (links, 2), in steps first to last.

    Args:
        faults: of the run.
        h: the step in s.
        period: steps between messages.
        first, last: from the start of which step, to before the start of which.
        out: changed.
    """
    for count in range(-(-first // period), -(-last // period)):
        for link in range(len(out)):
            out[link, 0 if comes(faults, count * period * h, count, link) else 1] += 1.0


@kernel
def send(problem, time, memory, sent, monitor):
    """Put rows into the place of those sent last, at ``sent``, of agents whose triggers fire.

    A trigger fires where |row - row sent last|^2 > sigma (sum over the agent's links of
    |row - row heard last|^2) + (threshold exp(-decay time))^2. Messages over links are
    counted, those of each agent behind the rows.
    """
    graph, faults, m = problem.graph, problem.faults, len(problem.data.owner)
    links, counts = int(problem.settings[LINKS]), sent + (len(problem.data.offsets) - 1) * m
    monitor.message_instants += 1.0
    for f in range(faults.pointer[TRIGGER], faults.pointer[TRIGGER + 1]):
        trigger = fault(faults, f)
        i = int(trigger.target)
        row, last = memory[i * m : (i + 1) * m], memory[sent + i * m : sent + (i + 1) * m]
        moved, apart = 0.0, 0.0
        for r in range(m):
            moved += (row[r] - last[r]) ** 2
        for link in range(graph.pointer[i], graph.pointer[i + 1]):
            for r in range(m):
                apart += (row[r] - memory[links + link * m + r]) ** 2
        allowed = trigger.amount * np.exp(-trigger.period * time)
        if moved > trigger.form * apart + allowed * allowed:
            copy(row, last)
            memory[counts + i] += graph.pointer[i + 1] - graph.pointer[i]
            monitor.messages += graph.pointer[i + 1] - graph.pointer[i]


@kernel
def receive(problem, j, sent, heard):
    """Copy agent j's rows of all that was sent: its estimates, and what is sent with them."""
    m, agents = len(problem.data.owner), len(problem.data.offsets) - 1
    size = int(problem.settings[BESIDES])
    copy(sent[j * m : (j + 1) * m], heard)
    for block in range(2):
        at = agents * m + (block * agents + j) * size
        for r in range(size):
            heard[m + block * size + r] = sent[at + r]


@kernel
def exchange(problem, clock, step, memory, work, monitor):
    """Send all rows; over each link comes what was sent some periods ago, or nothing."""
    data, graph, kept, faults = problem.data, problem.graph, problem.kept, problem.faults
    agents, m, time = len(data.offsets) - 1, len(work.y), step * clock.h
    count, links = count_of(clock, step), int(problem.settings[LINKS])
    slots, all_kept = int(faults.numbers.message_delay) + 1, len(kept.pointer) == 0
    message = m + 2 * int(problem.settings[BESIDES])
    size = agents * message if all_kept else kept_estimates.room(kept)
    ring = links + (len(graph.neighbour) * message if all_kept else kept.came[len(kept.came) - 1])
    if all_kept:
        for r in range(m):
            memory[data.owner[r] * m + r] = work.measurement[r]
    else:
        kept_estimates.prepare(problem, 0, agents, work.measurement, memory)
    at = ring + (count % slots) * size
    if faults.pointer[TRIGGER + 1] > faults.pointer[TRIGGER]:
        send(problem, time, memory, at, monitor)
    else:
        copy(memory[:size], memory[at : at + size])
    for link in range(len(graph.neighbour)):
        delay = 0
        for f in range(faults.pointer[LATE], faults.pointer[LATE + 1]):
            row = fault(faults, f)
            if row.target == link and active(row, time):
                delay = max(delay, int(row.amount))
        if comes(faults, time, count, link) and count >= delay:
            sent = ring + ((count - delay) % slots) * size
            if all_kept:
                heard = links + link * message
                receive(problem, graph.neighbour[link], memory[sent:], memory[heard:])
            else:
                kept_estimates.receive(kept, link, memory[sent : sent + size], memory[links:])


@kernel
def sense(problem, work, y, measurement):
    """The outputs (m,) that the law sees: ``measurement``. Fills the barrier's weights there."""
    rho, data = work.now.penalty, problem.data
    work.now.tightened = -1.0
    for k in range(len(work.weights)):
        slack = -games.constraint(data, k, measurement) - data.tightening[k]
        work.weights[k] = rho / slack
        if not slack > 0.0 and work.now.tightened < 0.0:
            work.now.tightened, work.now.tightened_value = float(k), -slack
    return measurement


@kernel
def sense_state(plant, parts, step, state, known, scratch):
    """The flat state as the law has it: ``known``, filled.

    A state of some periods ago is moved on by the plant's map under the inputs asked for since.
    """
    work, channels, faults = parts.work, parts.channels, parts.problem.faults
    count = count_of(parts.clock, step)
    m, states = channels.equilibrium_state.shape
    delay = int(faults.numbers.sensor_delay)
    late, size, slots = min(delay, count), m * states, delay + 1
    if delay > 0:
        at = ((count - late) % slots) * size
        copy(work.history[at : at + size], known)
    else:
        copy(state[: m * states], known)
    for r in range(m):
        known[r * states + channels.output] = work.measurement[r]
    for ago in range(late):
        at = slots * size + ((count - late + ago) % slots) * m
        plant.roll(channels, parts.clock, known, work.history[at : at + m], scratch)
    return known


@kernel
def deliver(problem, clock, step, work):
    """Fill work.u with the commanded input within the limits of now."""
    faults, m, time = problem.faults, len(work.u), step * clock.h
    for r in range(m):
        limit = problem.limit[r]
        for f in range(faults.pointer[LIMIT], faults.pointer[LIMIT + 1]):
            row = fault(faults, f)
            if row.target == r and active(row, time):
                limit = min(limit, row.amount)
        work.u[r] = min(max(work.commanded[r], -limit), limit)
    delay = int(faults.numbers.sensor_delay)
    if delay > 0:
        slots = delay + 1
        size = (len(work.history) // slots) - m
        at = slots * size + (count_of(clock, step) % slots) * m
        copy(work.u, work.history[at : at + m])


@kernel
def push(problem, clock, step, u, applied):
    """What acts on the plant in a step under the input u (m,): ``applied``, u with all pushes."""
    faults, time = problem.faults, step * clock.h
    copy(u, applied)
    for f in range(faults.pointer[PUSH], faults.pointer[PUSH + 1]):
        row = fault(faults, f)
        if active(row, time):
            phase = 0.0
            if row.period > 0.0:
                phase = (time + 5e-10 - row.start) / row.period
            size = row.amount
            if row.form == SINE:
                size *= np.sin(2.0 * np.pi * phase)
            elif row.form == SQUARE:
                size *= 1.0 if np.floor(2.0 * phase) % 2.0 == 0.0 else -1.0
            elif row.form == RANDOM:
                size *= spread(faults, row, step)
            applied[int(row.target)] += size
    return applied


@kernel
def record(parts, step, state, measurement, applied):
    """Fill rows (m,) with what the law has seen for the input of this step, and what acts."""
    work, channels = parts.work, parts.channels
    copy(work.measurement, measurement)
    states = channels.equilibrium_state.shape[1]
    if parts.clock.mode == 0:  # the look may have been at a later stage, with its own errors
        for r in range(len(measurement)):
            measurement[r] += state[r * states + channels.output] - work.y[r]
    push(parts.problem, parts.clock, step, parts.u, applied)
