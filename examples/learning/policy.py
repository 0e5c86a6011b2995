"""A law that was learned: five robots that each push by a small network of the gaps beside them.

All robots have the same network, of 33 numbers that train.py has found; gne-mj compare --law takes
this file. It knows nothing of the barrier, and has an action everywhere.
"""

import json
from pathlib import Path

import numpy as np

ACTS_OUTSIDE = True
HIDDEN, FORCE, LEADER, BOUND = 8, 10.0, 3.0, 3.0  # FORCE in N, LEADER's and gaps' BOUND in m/s
COUNT = 4 * HIDDEN + 1


def force(numbers, y):
    """The robots' forces in N, of the same shape as their velocities y (..., N).

    Args:
        numbers: (COUNT,) of the network, or (..., COUNT) of one for each row of y.
        y: velocities in m/s.
    """
    gaps = np.diff(y, axis=-1, prepend=LEADER) / BOUND
    behind = np.concatenate([gaps[..., 1:], np.zeros_like(gaps[..., :1])], axis=-1)
    numbers = np.asarray(numbers)[..., None, :]
    into = numbers[..., : 3 * HIDDEN].reshape(*numbers.shape[:-1], 3, HIDDEN)
    hidden = np.tanh(
        gaps[..., None] * into[..., 0, :] + behind[..., None] * into[..., 1, :] + into[..., 2, :]
    )
    out, shift = numbers[..., 3 * HIDDEN : 4 * HIDDEN], numbers[..., -1]
    return FORCE * np.tanh((hidden * out).sum(axis=-1) + shift)


def action(game, rho, y, memory):
    """What the policy does at the velocities y (N,)."""
    return force(json.loads(Path(__file__).with_name("policy.json").read_text()), y)
