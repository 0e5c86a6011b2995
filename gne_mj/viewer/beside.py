"""Where systems are drawn, so that none lies upon another: lanes along y, others along x."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gne_mj.viewer.placing import LENGTH, POSITION
from gne_mj.viewer.shares import Values
from gne_mj.viewer.shown_system import ShownSystem, plan_of

APART = 1.2  # m between systems that are drawn beside each other
SPREAD = 0.25  # of a fleet's width, that it may spread on both sides where only its start is known
SAMPLES = 60  # of a run that are looked at, at most

Floats = NDArray[np.float64]


def shifts_of(
    shown_systems: Sequence[ShownSystem],
    runs: Sequence[int],
    values: Mapping[str, Values] | None = None,
) -> tuple[Floats, Floats]:
    """How far in m along x and y each system is moved, (systems, 2), and how much further.

    The first keep the systems of each run apart, with the second all runs are beside each other.

    Args:
        shown_systems: one a system.
        runs: which run each is of.
        values: what is known of each over the run; if left out by how they start.
    """
    fleets = [each.fleet for each in shown_systems if each.fleet is not None]
    axis = 1 if any(fleet.lane is not None for fleet in fleets) else 0
    rooms = [
        _room(each, axis, None if values is None else values[each.system.name])
        for each in shown_systems
    ]
    within = np.zeros(len(rooms))
    for run in set(runs):
        own = [k for k, each in enumerate(runs) if each == run]
        within[own] = _beside([rooms[k] for k in own], axis)
    shifts, further = np.zeros((2, len(rooms), 2))
    shifts[:, axis], further[:, axis] = within, _beside(rooms, axis) - within
    return shifts, further


def _room(shown_system: ShownSystem, axis: int, values: Values | None) -> Floats | None:
    """(T, 2): from where to where in m along an axis robots are; None without bodies."""
    fleet, system = shown_system.fleet, shown_system.system
    if fleet is None:
        return None
    if axis == 1 and fleet.lane is not None:
        return np.array([fleet.lane])
    if values is not None:
        rows = fleet.qpos(values)
        rows = rows[np.linspace(0, len(rows) - 1, min(SAMPLES, len(rows))).astype(int)]
    else:
        rows = fleet.start(system.state)[None]
    poses = fleet.mirror.samples(rows)
    place = np.where(poses[..., LENGTH] != 0.0, poses[..., POSITION][..., axis], np.nan)
    low, high = np.nanmin(place, axis=1), np.nanmax(place, axis=1)
    region = (plan_of(system) or {"region": []})["region"]
    if region:  # which goes along with those in it
        corners, moved = np.array(region)[:, axis], 0.5 * (low + high - low[0] - high[0])
        low = np.minimum(low, np.min(corners) + moved)
        high = np.maximum(high, np.max(corners) + moved)
    spread = SPREAD * (high - low) if values is None else 0.0
    room = np.column_stack([low - spread, high + spread])
    # a run that has ended stands still, and others may pass
    ended = np.all(np.isclose(place, place[-1], equal_nan=True), axis=1)
    moving = int(np.max(np.flatnonzero(~ended), initial=-1)) + 1
    room[moving + 1 :] = np.nan
    return room


def _beside(rooms: Sequence[Floats | None], axis: int) -> Floats:
    """How far each is moved, so that none ever lies upon another: to the right, or in front."""
    shifts = np.zeros(len(rooms))
    taken: list[Floats] = []
    for k, room in enumerate(rooms):
        if room is None:
            continue
        if taken:
            last = taken[-1]
            if axis == 0:
                shifts[k] = np.nanmax(last[:, 1] - room[:, 0]) + APART
            else:
                shifts[k] = np.nanmin(last[:, 0] - room[:, 1]) - APART
        taken.append(room + shifts[k])
    return shifts
