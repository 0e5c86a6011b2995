"""Which input holds a robot at an output: found by holding it there.

A proportional and integral law for each channel, its gains from how far inputs move outputs in a
period, holds the robot for some seconds. What it asks for at the end is what gravity, friction and
drag ask of a law that wants to be there; if the output is not there, the reason is told.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.examination.bench import Bench
from gne_mj.plants import acting_forces

Array = NDArray[np.float64]
PERIOD = 0.01  # s between two corrections, unless inputs show later
PROPORTIONAL, INTEGRAL = 0.3, 0.05  # of what would correct the whole in a period
LAST = 0.2  # of the time, over which input and output are looked at
THERE = 0.02  # of the wished output (or of 1): as near it counts as held
SHOTS = 5  # states kept on the way
TURN, TURNS = 3.0, 3  # s, and how often so long until it is there
STEADY = 0.02  # of the input: as much it may still move
ESCAPED = 1e3  # times the wished output: nothing that is held gets there


@dataclass(frozen=True)
class Held:
    """One output that was held, or not.

    Args:
        wanted: (d,) the outputs.
        output: (d,) the mean of the last part.
        input: (d,) likewise.
        off: greatest distance from the wished ones then.
        ripple: (d,) half of the input's range then.
        held: whether it was there.
        why: what was in the way; empty where it was.
        parts: what of the input is for gravity, springs and so on, (d,) each.
        shots: states and inputs on the way, the last one at the end.
    """

    wanted: list[float]
    output: list[float]
    input: list[float]
    off: float
    ripple: list[float]
    held: bool
    why: str
    parts: dict[str, list[float]]
    shots: list[tuple[Array, Array]] = field(repr=False)

    def to_dict(self) -> dict[str, Any]:
        """But for the states."""
        return {key: value for key, value in vars(self).items() if key != "shots"}


def hold(bench: Bench, start: Array, wanted: Array, rise: Array, steps: int) -> Held:
    """Hold the outputs ``wanted`` (d,), for longer where they have not settled.

    Args:
        start: the state to begin in.
        rise: (d, d) how outputs rise with inputs in a period.
        steps: of a period.
    """
    gain, plant = np.linalg.pinv(rise), bench.plant
    periods = max(3 * SHOTS, round(TURN / (steps * plant.timestep)))
    bench.go(start)
    total = np.zeros(bench.channels)
    for _ in range(TURNS):
        outputs, inputs = np.empty((2, periods, bench.channels))
        shots = []
        for k in range(periods):
            outputs[k] = plant.output
            missing = wanted - outputs[k]
            asked = gain @ (PROPORTIONAL * missing) + total
            u = inputs[k] = np.clip(asked, -bench.limits, bench.limits)
            if np.array_equal(u, asked):  # what a limit takes is not added up
                total = total + gain @ (INTEGRAL * missing)
            if (k + 1) % (periods // SHOTS) == 0:
                shots.append((bench.save(), u))
            escaped = not np.all(np.abs(outputs[k]) < ESCAPED * (1.0 + np.abs(wanted)))
            if escaped or not bench.move(u, steps):
                return _lost(wanted, outputs[k], [(start, 0.0 * u)])
        found = _judged(bench, wanted, outputs, inputs, shots)
        if found.held and max(found.ripple) <= STEADY * (1e-3 + max(map(abs, found.input))):
            break
        bench.go(shots[-1][0])
        bench.move(shots[-1][1], steps)
    return found


def _lost(wanted: Array, output: Array, shots: list[tuple[Array, Array]]) -> Held:
    none = [0.0] * len(wanted)
    return Held(wanted.tolist(), np.nan_to_num(output).tolist(), none, np.inf, none, False,
                "it ran away under the law that was to hold it", {}, shots)  # fmt: skip


def _judged(
    bench: Bench, wanted: Array, outputs: Array, inputs: Array, shots: list[tuple[Array, Array]]
) -> Held:
    last = slice(-max(3, round(LAST * len(outputs))), None)
    off = float(np.max(np.abs(outputs[last] - wanted)))
    held = off <= THERE * max(1.0 if not np.any(wanted) else 0.0, float(np.max(np.abs(wanted))))
    mean, ripple = inputs[last].mean(axis=0), 0.5 * np.ptp(inputs[last], axis=0)
    stops, full = bench.stops(), np.abs(inputs[last]) >= (1.0 - 1e-9) * bench.limits
    why = []
    if stops:
        why.append(f"joint '{stops[0]}' is at its stop")
    if full.any():
        worst = int(np.argmax(full.mean(axis=0)))
        why.append(
            f"inputs are at the limit {bench.limits[worst]:.4g} for"
            f" {full[:, worst].mean():.0%} of the time"
        )
    if not held and not why:
        swing = float(np.max(np.ptp(outputs[last], axis=0)))
        why.append(f"it moves on by {swing:.3g}")
    bench.go(shots[-1][0])
    balance = acting_forces.balance(bench.plant, shots[-1][1], 1)
    parts = {name: value.tolist() for name, value in balance.items()}
    return Held(
        wanted.tolist(), outputs[last].mean(axis=0).tolist(), mean.tolist(), off, ripple.tolist(),
        held, "" if held else "; ".join(why), parts, shots,
    )  # fmt: skip
