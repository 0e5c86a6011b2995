"""What a run with adaptive steps keeps, and how the error of a step is weighed.

The kernels are for numbers and for lanes (:mod:`gne_mj.lanes`), to the same bits.
"""

from typing import Annotated, NamedTuple

import numpy as np

from gne_mj.lanes import where
from gne_mj.loops.layout import Workspace
from gne_mj.loops.one_loop import laid_out
from gne_mj.loops.tsitouras import interpolate
from gne_mj.native import kernel
from gne_mj.numbers import Numbers

# Error allowed of a state: rtol times its greatest magnitude so far, in any channel, and this much
# of its unit more; and of a slack: rtol times that many slacks, but at most this part of one
UNIT, SLACKS, MOST_OF_SLACK = 1e-3, 1e3, 0.1

NO_RATE, LAST_RATE, FIRST_RATE = 0.0, 1.0, 2.0


class Pace(Numbers):
    """How far steps are: the last one that stands runs from start to end; times in s."""

    start: float
    end: float
    length: float  # of the step that is tried next; 0: the run's start
    known: float  # which rates hold at the end: none, the last ones of the step, or the first ones
    last: float  # of the controller, see tsitouras.next_length
    failed: float  # 1: the step before was taken back
    accepted: float
    rejected: float
    deep: float  # steps shorter than any may be, since one that was not


class Vectors(NamedTuple):
    """Flat states, with the memory, and what else a step works on."""

    state: Annotated[np.ndarray, "m * states + memory"]  # at the last step's end
    begun: Annotated[np.ndarray, "m * states + memory"]  # at its start
    trial: Annotated[np.ndarray, "m * states + memory"]  # at a stage
    row: Annotated[np.ndarray, "m * states + memory"]  # between start and end
    rates: Annotated[np.ndarray, "7, m * states + memory"]  # at the stages
    error: Annotated[np.ndarray, "m * states + memory"]  # estimate of the step's
    greatest: Annotated[np.ndarray, "states + 1"]  # magnitude so far, of each state; of the memory
    less: Annotated[np.ndarray, "p"]  # constraints at the solution of lesser order
    spare: Annotated[np.ndarray, "max(m, 5 * states)"]  # for the agents' kernels


class AdaptiveWorkspace(NamedTuple):
    """What changes in a run with adaptive steps."""

    loop: Workspace
    vectors: Vectors
    pace: Pace


workspace_length, workspace_in, workspaces_of = laid_out(AdaptiveWorkspace)


@kernel
def largest(flat, group, channels, states):
    """The greatest magnitude of a flat vector's entries of one state, or of the memory behind the
    states; not a number if one of them is not finite."""
    first, last, step = group, channels * states, states
    if group == states:
        first, last, step = channels * states, len(flat), 1
    found, total = 0.0, 0.0
    for r in range(first, last, step):
        found = max(found, abs(flat[r]))
        total += flat[r]
    return found + 0.0 * total


@kernel
def grow(greatest, state, channels, states, mask):
    """Let the greatest magnitudes be those of a state as well, where the mask holds."""
    for group in range(len(greatest)):
        found = max(greatest[group], largest(state, group, channels, states))
        greatest[group] = where(mask, found, greatest[group])


@kernel
def lesser_outputs(channels, vectors, y, out):
    """Fill out (m,) with the outputs of the step's solution of lesser order, those of the greater
    being y."""
    states = channels.equilibrium_state.shape[1]
    for r in range(len(y)):
        out[r] = y[r] - vectors.error[r * states + channels.output]


@kernel
def weighted_error(rtol, parts, vectors, slacks):
    """A step's error, 1 being allowed: the worst of all states and slacks; perhaps not a number.

    A state is measured by its greatest magnitude so far in any channel. Near the boundary slacks
    are what the barrier depends on, so that each of so many ``slacks`` is measured by itself. Given
    the trial state, its error, constraints in work.g and, at the solution of lesser order, in
    vectors.less.
    """
    work, channels = parts.work, parts.channels
    m, states = channels.equilibrium_state.shape
    worst, total = 0.0, 0.0
    for group in range(len(vectors.greatest)):
        size = max(vectors.greatest[group], largest(vectors.trial, group, m, states))
        error = largest(vectors.error, group, m, states) / (rtol * (size + UNIT))
        worst = max(worst, error)
        total += error
    part = min(SLACKS * rtol, MOST_OF_SLACK)
    for k in range(slacks):
        slack = -work.g[k] - parts.problem.data.tightening[k]
        error = abs(vectors.less[k] - work.g[k]) / (part * slack)
        worst = max(worst, error)
        total += error
    return worst + 0.0 * total


@kernel
def between(pace, time, vectors):
    """Fill the row with the flat state at a time within the last step."""
    length = pace.end - pace.start
    before = time < pace.end
    share = where(before, (time - pace.start) / where(before, length, 1.0), 1.0)
    interpolate(share, length, vectors.begun, vectors.rates, vectors.row)
    for r in range(len(vectors.row)):
        vectors.row[r] = where(before, vectors.row[r], vectors.state[r])
