"""Inputs that try a plant out: random signals, and feedback that tries to draw energy from it.

Every channel has a program of its own. An open-loop signal (random steps, sines or a chirp) of
some amplitude and time scale puts energy in; from some moment on the input may oppose the output's
deviation d from its equilibrium, so that energy comes out: by full force, -A sign(d), or as a
damper, -min(g |d|, A) sign(d). A fourth strategy alternates between pushing along, +A sign(d), and
opposing.
"""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

SIGNALS = ("steps", "sines", "chirp")
STRATEGIES = ("open loop", "opposing", "damping", "alternating")
# Trials after which every signal was combined with every strategy
COMBINATIONS = len(SIGNALS) * len(STRATEGIES)

# Random levels of the steps, and sines in a sum
_LEVELS, _SINES = 64, 3


@dataclass(frozen=True, eq=False)
class Excitation:
    """The programs of c channels; amplitudes in units of the input, times in s.

    Attributes:
        signal, strategy: (c,) indices into SIGNALS and STRATEGIES.
        amplitude: (c,) A, the greatest input.
        gain: (c,) g of the damper.
        period: (c,) time scale of signal and strategy.
        free: (c,) until when the signal acts alone.
        levels: (64, c) in [-1, 1], of the steps.
        frequency, phase: (3, c) of the sines, in rad/s and rad.
        sweep: (2, c) first frequency of the chirp in Hz, and the logarithm of its growth, per s.
    """

    signal: NDArray[np.int64]
    strategy: NDArray[np.int64]
    amplitude: NDArray[np.float64]
    gain: NDArray[np.float64]
    period: NDArray[np.float64]
    free: NDArray[np.float64]
    levels: NDArray[np.float64]
    frequency: NDArray[np.float64]
    phase: NDArray[np.float64]
    sweep: NDArray[np.float64]

    @classmethod
    def draw(
        cls,
        rng: np.random.Generator,
        trial: int,
        width: NDArray[np.float64],
        hold: float,
        duration: float,
    ) -> "Excitation":
        """One trial: all channels with the same kind of program, each with its own numbers.

        Args:
            rng: where the numbers come from.
            trial: counts through the combinations of signal and strategy.
            width: (c,) range of the outputs; amplitudes are 0.03 to 3 times that.
            hold: time in s that an input is held.
            duration: of the trial in s.
        """
        channels = len(width)

        def between(low: Any, high: Any, *shape: int) -> NDArray[np.float64]:
            """Log-uniform."""
            logarithm: NDArray[np.float64] = np.exp(
                rng.uniform(np.log(low), np.log(high), (*shape, channels))
            )
            return logarithm

        amplitude = width * between(0.03, 3.0)
        period = between(4.0 * hold, 0.5 * duration)
        first, last = 1.0 / duration, 1.0 / (8.0 * hold)
        return cls(
            signal=np.full(channels, trial % len(SIGNALS)),
            strategy=np.full(channels, trial // len(SIGNALS) % len(STRATEGIES)),
            amplitude=amplitude,
            gain=amplitude / (width * between(0.01, 1.0)),
            period=period,
            free=between(hold, duration),
            levels=rng.uniform(-1.0, 1.0, (_LEVELS, channels)),
            frequency=2.0 * np.pi / period * between(0.3, 3.0, _SINES),
            phase=rng.uniform(0.0, 2.0 * np.pi, (_SINES, channels)),
            sweep=np.tile([[first], [np.log(last / first) / duration]], channels),
        )

    @classmethod
    def join(cls, parts: "list[Excitation]") -> "Excitation":
        """The channels of several trials side by side."""
        return cls(
            **{
                entry.name: np.concatenate([getattr(part, entry.name) for part in parts], axis=-1)
                for entry in fields(cls)
            }
        )

    def input(self, time: float, deviation: NDArray[np.float64]) -> NDArray[np.float64]:
        """(c,) what is added to the equilibrium's input, given the outputs' deviation (c,)."""
        window = np.floor(time / self.period).astype(np.int64)
        steps = np.take_along_axis(self.levels, window[None, :] % _LEVELS, axis=0)[0]
        sines = np.mean(np.sin(self.frequency * time + self.phase), axis=0)
        first, growth = self.sweep
        chirp = np.sin(2.0 * np.pi * first / growth * np.expm1(growth * time) + self.phase[0])
        signal = self.amplitude * np.choose(self.signal, [steps, sines, chirp])
        push = self.amplitude * np.sign(deviation)
        along = np.where((window % 2 == 0) & (deviation != 0.0), push, signal)
        damper = np.clip(-self.gain * deviation, -self.amplitude, self.amplitude)
        later = time >= self.free
        return np.choose(
            self.strategy,
            [
                signal,
                np.where(later, -push, signal),
                np.where(later, damper, signal),
                np.where(window % 2 == 0, along, -push),
            ],
        )
