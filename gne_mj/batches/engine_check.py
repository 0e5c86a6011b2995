"""A batch of ODE twins that is checked, not trusted: some of its runs are made in MuJoCo too.

Which ones follows from the batch's seed. Of each the greatest difference from its twin is kept.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gne_mj.batches.plan import Combination, Plan
from gne_mj.batches.summary import columns_of, span_of
from gne_mj.errors import InvalidInput
from gne_mj.loops.batch import Outcome
from gne_mj.variables import Labelled

STATES, SUMMARIES = "mujoco_state_difference", "mujoco_summary_difference"
_NAMES = {
    STATES: "greatest difference of a state in MuJoCo, at sample times",
    SUMMARIES: "greatest difference of a figure in MuJoCo, by its size where that is above 1",
}
# Figures that depend on the states continuously: no counts, and not when or where something was
COMPARED = (
    "margin", "final_error", "final_action", "peak_input", "rms_input", "energy", "lyapunov_rise",
)  # fmt: skip


def unchecked(runs: int) -> Labelled:
    """What is kept of runs that are not made in MuJoCo."""
    return {
        name: (("run",), np.full(runs, np.nan), {"long_name": words})
        for name, words in _NAMES.items()
    }


def the_same_in_mujoco(combination: Combination) -> Combination:
    """The same runs in MuJoCo.

    Raises:
        InvalidInput: MuJoCo does not know such agents, or has not their integrator.
    """
    assert combination.system is not None
    return replace(combination, system=replace(combination.system, engine="mujoco"))


def check_plan(plan: Plan) -> None:
    """Refuse a check of runs that are none of an ODE twin that MuJoCo knows.

    Raises:
        InvalidInput: names ``check_in_mujoco``.
    """
    for number in range(plan.combinations if plan.check_in_mujoco else 0):
        combination = plan.combination(number)
        if combination.system is None:
            continue
        engine = combination.system.engine
        if engine != "ode":
            raise InvalidInput(
                "check_in_mujoco", plan.check_in_mujoco,
                f"it is for plant.engine = 'ode', and these runs have '{engine}'",
            )  # fmt: skip
        try:
            the_same_in_mujoco(combination)
        except InvalidInput as error:
            raise InvalidInput(
                "check_in_mujoco", plan.check_in_mujoco,
                f"these runs are not for MuJoCo: {error.expected}",
            ) from None  # fmt: skip


def differences(
    combination: Combination, twins: Outcome, checks: Outcome
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The greatest differences of states and of figures, (runs,) each.

    Infinite where a run has ended early in one engine and not in the other.

    Args:
        combination: of the runs.
        twins, checks: what they showed, as ODEs and in MuJoCo.
    """
    span = span_of(combination)
    one = columns_of(combination, span, twins, 0)
    other = columns_of(the_same_in_mujoco(combination), span, checks, 0)
    states = _greatest(twins.samples.state, checks.samples.state)
    figures = np.where(one["status"][1] == other["status"][1], 0.0, np.inf)
    for name in COMPARED:
        if name in one:
            here, there = one[name][1], other[name][1]
            size = np.maximum(np.nan_to_num(np.abs(there)), 1.0)
            figures = np.maximum(figures, _greatest(here / size, there / size))
    return states, figures


def _greatest(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    """(runs,) max |one - other|; infinite where only one of them is a number."""
    none = np.isnan(one) & np.isnan(other)
    apart = np.where(none, 0.0, np.abs(one - other))
    apart = np.where(np.isnan(apart), np.inf, apart)
    found: NDArray[np.float64] = apart.reshape(len(apart), -1).max(axis=1, initial=0.0)
    return found
