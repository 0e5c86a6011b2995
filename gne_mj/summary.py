"""A report in words, for terminals and notebooks."""

from collections.abc import Mapping, Sequence
from typing import Any

UNKNOWN = "not known: no penalised equilibrium was found"


def summary(report: dict[str, Any]) -> dict[str, str]:
    """What a person wants to know of one system's report, in the order of interest."""
    gap, division, implicit = report["worst_gap"], report["division"], report["implicit"]
    actuators, epsilon = report["actuators"], report["epsilon"]
    rows = {
        "status": f"{report['status']}: {report['message']}",
        "least margin": _least_margin(report["worst_constraint"]),
        **_convergence(report),
        "peak input": f"{actuators['peak']:.4g} (agent {actuators['peak_agent']} at"
        f" {actuators['peak_time']:.4g} s), RMS up to {max(actuators['rms']):.4g}",
    }
    why = report.get("not_reached")  # which older results do not have
    if why is not None:
        rows["y* not reached"] = not_reached(why)
    seen = report.get("outside")  # which older results do not have
    if seen is not None and seen["goes_on"] and seen["exits"]:
        rows["outside"] = _outside(seen)
    if report["positions"] is not None:
        seen = report["positions"]
        rows["positions"] = (
            f"outside at {seen['outside']} of {seen['observed']} observations; least margin -g ="
            f" {seen['least_margin']:.6g}, constraint '{seen['constraint']}' at"
            f" {seen['time']:.4g} s"
        )
    if report["between"] is not None:
        rows["control periods"] = _between(report["between"])
    if report["contacts"] is not None:
        rows["contacts"] = _contacts(report["contacts"])
    if report["separation"] is not None:
        rows["separation"] = _separation(report["separation"])
    if report.get("membership") is not None:  # which older results do not have
        rows["agents"] = _membership(report["membership"])
    if report["network"] is not None:
        rows["network"] = _network(report["network"])
    if report["messages"] is not None:
        rows["messages"] = _messages(report["messages"])
    if gap is not None:
        size = f"{gap['gap']:.6g} of {gap['bound']:g} {gap['unit']}".rstrip()
        rows["widest gap"] = f"{size}, {gap['name']} at {gap['time']:.4g} s"
    if division is not None and division["divided_steps"]:
        rows["divided steps"] = (
            f"{division['divided_steps']}, near the boundary, down to"
            f" {division['smallest_step']:.3g} s"
        )
    if implicit is not None:
        rows["held inputs"] = _held_inputs(implicit)
    if epsilon["measured"] is not None:
        rows["epsilon"] = (
            f"{epsilon['measured']:.3g} measured at the penalised equilibrium;"
            f" {bounds_text(epsilon)}"
        )
    return rows


def not_reached(found: Sequence[Mapping[str, Any]]) -> str:
    """What :mod:`gne_mj.not_reached` saw, in words."""
    if not found:
        return "none of what is looked for was seen: limits, loads, stops, slip, time"
    return "; ".join(each["text"] for each in found)


def _outside(seen: dict[str, Any]) -> str:
    part = "" if seen["of_bound"] is None else f" ({100.0 * seen['of_bound']:.3g}% of the bound)"
    text = f"by up to g = {seen['largest']:.6g}{part}, constraint '{seen['constraint']}'"
    last = "still at the end" if seen["at_end"] else f"back inside after {seen['until']:.6g} s"
    return (
        f"{text}, for {seen['duration']:.4g} s in all from {seen['first']:.6g} s on, {last};"
        f" integral of the violation {seen['integral']:.4g}"
    )


def _between(seen: dict[str, Any]) -> str:
    if not seen["periods_cut"]:
        return "none was cut, all being inside at every step as predicted"
    return (
        f"{seen['periods_cut']} cut before they led outside (first at {seen['first_cut']:.4g} s),"
        f" the shortest to {1e3 * seen['shortest_period']:.4g} ms"
    )


def _contacts(seen: dict[str, Any]) -> str:
    if not seen["count"]:
        return "none between agents"
    return (
        f"between agents at {seen['steps']} steps, first between {seen['agents'][0]} and"
        f" {seen['agents'][1]} at {seen['first']:.4g} s, up to {seen['depth']:.2g} m deep"
    )


def _least_margin(worst: dict[str, Any] | None) -> str:
    if worst is None:
        return "nothing was observed"
    return f"-g = {worst['margin']:.6g}, constraint '{worst['name']}' at {worst['time']:.4g} s"


def _membership(seen: dict[str, Any]) -> str:
    done = [
        f"{', '.join(map(str, each['agents']))} {each['what']} at {each['time']:.4g} s"
        for each in seen["changes"]
        if each["done"]
    ]
    shown = "; ".join(done[:6]) + (f"; {len(done) - 6} changes more" if len(done) > 6 else "")
    refused = len(seen["changes"]) - len(done)
    count = f"{len(seen['at_start'])} at the start"
    text = f"{count}; {shown}" if done else count
    return f"{text}; {refused} not admitted or not let go" if refused else text


def _network(seen: dict[str, Any]) -> str:
    changes = seen["changes"]
    text = f"became another one {changes} time{'s' * (changes != 1)}"
    if seen["disconnected"] > 0.0:
        return f"{text}; not connected for {seen['disconnected']:.6g} s, of which nothing is proven"
    return f"{text}, connected throughout"


def _messages(seen: dict[str, Any]) -> str:
    triggers = seen.get("triggers")  # which older results do not have
    if triggers is None and seen["sent"] == seen["periodic"]:
        return f"{seen['sent']}, one over each link in every control period"
    share = 100.0 * seen["sent"] / max(seen["periodic"], 1)
    text = f"{seen['sent']}, {share:.3g}% of {seen['periodic']} with one in every control period"
    return text if triggers is None else f"{text}; triggers: {triggers_text(triggers)}"


def _separation(seen: dict[str, Any]) -> str:
    if seen["least_distance"] is None:
        return f"no two agents came within {seen['reach']:g} m"
    first, second = seen["agents"]
    return (
        f"at least {seen['least_distance']:.6g} m, agents {first} and {second} at"
        f" {seen['time']:.4g} s, where {seen['distance']:g} m are kept; up to"
        f" {seen['most_pairs']} pairs near at once"
    )


def _convergence(report: dict[str, Any]) -> dict[str, str]:
    """What is told of the way to the penalised equilibrium, where one was found."""
    distances, settling = report["equilibrium"], report["settling_time"]
    if distances["final_distance"] is None:
        return dict.fromkeys(("settling time", "distance at the end", "Lyapunov function"), UNKNOWN)
    away = f"{distances['final_distance']:.3g} to the penalised equilibrium"
    if distances["final_distance_to_variational"] is not None:
        away += f", {distances['final_distance_to_variational']:.3g} to the vGNE"
    by_variational = distances.get("settling_time_to_variational")
    about = "" if by_variational is None else f"; to the vGNE {by_variational:.4g} s"
    tracking = report.get("tracking")  # which older results do not have
    return {
        "settling time": ("not settled" if settling is None else f"{settling:.4g} s") + about,
        "distance at the end": away,
        "Lyapunov function": "not followed: y* moves"
        if tracking is not None and tracking["game"]
        else _lyapunov(report["lyapunov"]),
        **({} if tracking is None else {"tracking": _tracking(tracking)}),
    }


def _tracking(seen: dict[str, Any]) -> str:
    unit = seen.get("unit", "")  # which older results do not have
    of, rate = f" {unit}" * bool(unit), f" {unit or 1}/s"
    text = (
        f"at most {seen['largest_distance']:.3g}{of} from y*(t), at"
        f" {seen['largest_distance_time']:.4g} s, which moves at up to"
        f" {seen['largest_rate']:.3g}{rate}"
    )
    if seen["not_known"] is not None:
        return f"{text}; no bound: {seen['not_known']}"
    inside = "within its bound at all samples" if seen["within"] else "BEYOND its bound"
    return (
        f"{text}; {inside}, at the end {seen['final_distance']:.3g} <="
        f" {seen['final_bound']:.3g}{of}"
    )


def _lyapunov(seen: dict[str, Any]) -> str:
    if not seen["known"]:
        return "not known of MJCF robots"
    text = "never rose" if seen["monotone"] else "rose"
    if seen["left"]:
        text += f" up to the exit, last seen at {seen['observed_until']:.4g} s"
    claim = "the theory claims a decrease" if seen["claimed"] else "nothing is claimed here"
    return f"{text} (largest rise {seen['largest_rise']:.2g}; {claim})"


def _held_inputs(implicit: dict[str, Any]) -> str:
    text = (
        f"{implicit['solutions']} solved for in {implicit['mean_newton_steps']:.3g} Newton"
        f" steps each; predicted outputs off by up to {implicit['largest_prediction_error']:.2g}"
    )
    if implicit["largest_load"] is not None:
        text += f"; loads of up to {implicit['largest_load']:.4g} were observed"
    for key, first, what in (
        (
            "not_accurate",
            "first_not_accurate",
            "not accurate, at whose periods' ends nothing is promised",
        ),
        ("periods_not_monotone", "first_not_monotone", "periods without dy+/du > 0"),
    ):
        if implicit[key]:
            text += f"; {implicit[key]} {what} (first at {implicit[first]:.4g} s)"
    return text


def bounds_text(bounds: dict[str, Any]) -> str:
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


def triggers_text(found: dict[str, Any]) -> str:
    """What :mod:`gne_mj.theory.triggers` reports, in words."""
    if not found["proven"]:
        return f"not proven to keep V falling: {found['why_not']}"
    text = (
        f"V falls in continuous time where |e| > {found['ball']:.4g} exp(-{found['decay']:g} t)"
        f" (q = {found['form']:.4g}; proven up to sigma = {found['largest_sigma']:.4g})"
    )
    if found["rises"] is None:
        return f"{text}; the threshold does not decay, so that y* is not reached exactly"
    return f"{text}; all its rises together are at most {found['rises']:.4g}"
