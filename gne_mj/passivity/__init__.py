"""Is a plant equilibrium-independent passive? An empirical test: it can refute, never prove.

For every equilibrium (x*, u*, y*) there should be a storage V >= 0, zero at x*, with
V(x(t2)) - V(x(t1)) <= integral of (y - y*)(u - u*) dt [asmp:nonlinearPlant]. Checked are, along
trajectories under the inputs of :mod:`gne_mj.passivity.excitation`:

- *energy extracted*: from rest at x*, -integral (y - y*)(u - u*) dt must never be positive. This
  needs no storage function, and what violates it has none.
- *storage risen*: V may not rise by more than was supplied between any two times, from x* or from
  a random state. What violates it refutes V; the plant could still have another one.
- *storage negative*: V >= 0. (Energy of a spring that pushes apart obeys the balance as well.)

Inputs are held over an even number of steps, so that the supply is exact but for the output's
integral, by Simpson's rule. Everything is computed with the given step and with half of it, under
the same inputs, side by side. The difference of the two bounds the error of the finer one for a
method of any order p >= 1; twice its greatest value so far is taken, of V and of the supply each,
and an excess counts only beyond that and rounding. The violation that is shown is repeated with a
sixth of the step: where that disagrees by more than the estimated error, or half of the excess, the
step does not resolve the plant's motion, and nothing is said. (What oscillates several times within
a step can look slow at every step tried: the step must suit the plant.)

Amplitudes and deviations grow, from the outputs' range to a thousand times that and where V is seen
to be negative to a million times, until something is found or no longer resolved; the report says
how far from the equilibria was tried.
"""

from gne_mj.passivity.examine import examine, plants_of
from gne_mj.passivity.report import CHECKS, Counterexample, Finding, PassivityReport, Range

__all__ = [
    "CHECKS",
    "Counterexample",
    "Finding",
    "PassivityReport",
    "Range",
    "examine",
    "plants_of",
]
