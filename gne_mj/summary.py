"""A report in words, for terminals and notebooks."""

from typing import Any

UNKNOWN = "not known: no penalised equilibrium was found"


def summary(report: dict[str, Any]) -> dict[str, str]:
    """What a person wants to know of one system's report, in the order of interest."""
    worst, gap = report["worst_constraint"], report["worst_gap"]
    settling, actuators = report["settling_time"], report["actuators"]
    lyapunov, epsilon = report["lyapunov"], report["epsilon"]
    distances = report["equilibrium"]
    nowhere = distances["final_distance"] is None
    unknown = distances["final_distance_to_variational"] is None
    rows = {
        "status": f"{report['status']}: {report['message']}",
        "least margin": "nothing was observed"
        if worst is None
        else f"-g = {worst['margin']:.6g}, constraint '{worst['name']}' at {worst['time']:.4g} s",
        "settling time": UNKNOWN
        if nowhere
        else "not settled"
        if settling is None
        else f"{settling:.4g} s",
        "distance at the end": UNKNOWN
        if nowhere
        else f"{distances['final_distance']:.3g} to the penalised equilibrium"
        + ("" if unknown else f", {distances['final_distance_to_variational']:.3g} to the vGNE"),
        "Lyapunov function": UNKNOWN
        if nowhere
        else "not known of MJCF robots"
        if not lyapunov["known"]
        else ("never rose" if lyapunov["monotone"] else "rose")
        + (f" up to the exit, last seen at {lyapunov['observed_until']:.4g} s" * lyapunov["left"])
        + f" (largest rise {lyapunov['largest_rise']:.2g}; "
        + ("the theory claims a decrease)" if lyapunov["claimed"] else "nothing is claimed here)"),
        "peak input": f"{actuators['peak']:.4g} (agent {actuators['peak_agent']} at"
        f" {actuators['peak_time']:.4g} s), RMS up to {max(actuators['rms']):.4g}",
    }
    if gap is not None:
        rows["widest gap"] = (
            f"{gap['gap']:.6g} of {gap['bound']:g} {gap['unit']}, {gap['name']} at"
            f" {gap['time']:.4g} s"
        )
    division = report["division"]
    if division is not None and division["divided_steps"]:
        rows["divided steps"] = (
            f"{division['divided_steps']}, near the boundary, down to"
            f" {division['smallest_step']:.3g} s"
        )
    implicit = report["implicit"]
    if implicit is not None:
        rows["held inputs"] = (
            f"{implicit['solutions']} solved for in {implicit['mean_newton_steps']:.3g} Newton"
            f" steps each; predicted outputs off by up to"
            f" {implicit['largest_prediction_error']:.2g}"
        )
        for key, first, what in (
            (
                "not_accurate",
                "first_not_accurate",
                "not accurate, at whose periods' ends nothing is promised",
            ),
            ("periods_not_monotone", "first_not_monotone", "periods without dy+/du > 0"),
        ):
            if implicit[key]:
                rows["held inputs"] += (
                    f"; {implicit[key]} {what} (first at {implicit[first]:.4g} s)"
                )
    if epsilon["measured"] is not None:
        rows["epsilon"] = (
            f"{epsilon['measured']:.3g} measured at the penalised equilibrium;"
            f" {bounds_in_words(epsilon)}"
        )
    return rows


def bounds_in_words(bounds: dict[str, Any]) -> str:
    """:func:`gne_mj.epsilon.epsilon_bounds` as part of a sentence on epsilon."""
    if bounds["refuted"] is not None:
        return f"no bound, since the lemma does not hold: {bounds['refuted']}"
    if bounds["bound"] is None:
        return "no bound is known, since y* was not found"
    margin = f" + {bounds['of_margin']:.4g} for the margin" if bounds["of_margin"] else ""
    return (
        f"at most {bounds['bound']:.4g} = p rho{margin}, and"
        f" {bounds['largest_own_bound']:.4g} by each agent's own constraints"
    )
