"""The plant's own discrete map over a control period, for agents that are known as ODEs.

It serves the ODE engine and the fleets that MuJoCo moves in the same way.
"""

from gne_mj.native import copy, kernel
from gne_mj.plants import functions


@kernel
def roll(channels, clock, state, u, scratch):
    """Move the flat state by one control period under the held input u (m,)."""
    functions.roll(channels, clock.method, clock.h, clock.period, state, u, scratch)


@kernel
def predict(context, channels, clock, state, u, out, trial, scratch):
    """Fill out (m,) with the outputs after a control period from a flat state under u (m,).

    Args:
        context: where the plant is; not needed here.
        channels, clock, state: as the loop has them.
        u: held input.
        out: filled.
        trial, scratch: as long as the state, and 5 times a channel's; overwritten.
    """
    copy(state[: len(trial)], trial)  # a law's memory may follow
    roll(channels, clock, trial, u, scratch)
    for r in range(len(u)):
        out[r] = trial[r * channels.equilibrium_state.shape[1] + channels.output]


@kernel
def set_out(context, channels, state, u, trial):
    """Begin to look at a control period step by step, from a flat state; ``trial`` is the place."""
    copy(state[: len(trial)], trial)


@kernel
def step_on(context, channels, clock, u, out, trial, scratch):
    """Fill out (m,) with the outputs one integration step after ``trial``, which moves on."""
    functions.roll(channels, clock.method, clock.h, 1, trial, u, scratch)
    for r in range(len(u)):
        out[r] = trial[r * channels.equilibrium_state.shape[1] + channels.output]


@kernel
def is_coupled():
    """Whether an input moves the outputs of other channels: each channel is by itself."""
    return False


@kernel
def is_affine(clock):
    """Whether the map is affine in u beyond doubt: one Euler step, since x' is affine in u."""
    return clock.period == 1 and clock.method == 0
