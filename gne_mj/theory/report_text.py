"""Guarantees in words."""

import math
from collections.abc import Iterator
from typing import Any

from gne_mj.summary import bounds_text, triggers_text
from gne_mj.theory.guarantees import Guarantees

_WIDTH = 20


def report_text(guarantees: Guarantees) -> list[str]:
    """The report on one system, line by line."""
    g = guarantees.to_dict()
    lines = [f"\n{g['system']['name']}: {_what(g['system'])}"]
    for key, text in _rows(g):
        lines.append(f"  {key:{_WIDTH}} {text}")
    return lines


def _what(system: dict[str, Any]) -> str:
    return (
        f"{system['game']}, {system['agents']} agents ({system['agent_type']}),"
        f" {system['information']} information, mode {system['mode']} ({system['engine']},"
        f" {system['integrator']})"
    )


def _rows(g: dict[str, Any]) -> Iterator[tuple[str, str]]:
    yield "verdict", g["status"]
    yield "theorem", g["theorem"]["name"] or "none: the law is none of the paper's"
    for assumption in g["theorem"]["assumptions"]:
        yield f"[{assumption['label']}]", f"{assumption['status']}: {assumption['why']}"
    yield from _constants(g)
    if g["graph"] is not None:
        graph = g["graph"]
        yield (
            "graph",
            f"lambda_2 = {graph['lambda_2']:.6g}, lambda_max = {graph['lambda_max']:.6g},"
            f" {graph['edges']} edges" + ", of the worst that it becomes" * graph["changes"],
        )
        if graph["kept"] is not None:
            yield "estimates", _kept(graph["kept"])
    if g["coupling"] is not None:
        yield from _coupling(g["coupling"])
    if g["triggers"] is not None:
        yield (
            "triggers",
            (
                f"{triggers_text(g['triggers'])}; messages of an agent at least"
                f" {g['triggers']['least_time']:g} s apart"
            ),
        )
    if g["gain"] is not None:
        yield "gain k", _gain(g["gain"])
    if g["epsilon"] is not None:
        yield "epsilon", _epsilon(g["epsilon"])
    start = g["start"]
    yield "start", f"strictly inside, least margin {start['margin']:.6g} ({start['constraint']})"
    if start["estimates"] is not None:
        yield "estimates' start", _estimates(start["estimates"])
    yield "epsilon of y*", bounds_text(g["equilibrium"])
    yield "inputs", _inputs(g["inputs"])
    yield "sampling", _periods(g)
    if g["division"] is not None:
        yield "steps", _division(g["division"])
    if g["held"] is not None:
        yield from _held(g["held"])
    if g["positions"] is not None:
        yield "positions", _positions(g["positions"])
    if g["separation"] is not None:
        yield "separation", _separation(g["separation"])
    if g["moving"] is not None:
        yield "moving", _moving(g["moving"])
    for part in g["membership"] or []:
        agents = ", ".join(map(str, part["agents"]))
        graph = "" if part["lambda_2"] is None else f", lambda_2 = {part['lambda_2']:.4g}"
        yield f"from {part['from']:g} s", f"agents {agents}: {part['status']}{graph}"
    for n, sentence in enumerate(g["guaranteed"]):
        yield "guaranteed" if n == 0 else "", sentence
    for n, sentence in enumerate(g["measured"]):
        yield "only measured" if n == 0 else "", sentence
    for n, sentence in enumerate(g["not_certified"]):
        yield "not certified" if n == 0 else "", sentence


def _moving(game: dict[str, Any]) -> str:
    moves = (f"{key} at up to {rate:.4g} per s"
             for key, rate in zip(game["keys"], game["rates"], strict=True))  # fmt: skip
    text = f"{', '.join(moves)}; all else here is of time 0"
    if game["equilibrium_rate"] is not None:
        rate = f"{game['equilibrium_rate']:.4g} {game['unit'] or 1}/s"
        text += f"; y* moves at up to {rate}"
    if game["equilibrium_rate_bound"] is not None:
        text += f", which is at most {game['equilibrium_rate_bound']:.4g} by mu"
    return text


def _separation(apart: dict[str, Any]) -> str:
    promised = "promised" if apart["promised"] else "not promised"
    return (
        f"at least {apart['distance']:g} m, {promised}; pairs within {apart['reach']:g} m look at"
        f" each other, {apart['by']} turn by up to {apart['turn']:g} rad"
    )


def _positions(positions: dict[str, Any]) -> str:
    conditions = [f"[{c['label']}] {c['status']}: {c['why']}" for c in positions["conditions"]]
    damping, least = positions["local_damping"], positions["least_damping"]
    if least is None:
        known = "the least local damping is not known"
    else:
        over = [math.inf if b is None else a / b for a, b in zip(damping, least, strict=True)]
        known = f"local damping from {min(over):.4g} times the least that is proven on"
    return "; ".join([*conditions, known])


def _constants(g: dict[str, Any]) -> Iterator[tuple[str, str]]:
    constants = g["constants"]
    for name in ("mu", "theta_1", "theta_2"):
        constant = constants[name]
        text = f"{_number(constant['value'], '.7g')} ({constant['label']}"
        if constant["told"] != "exact":
            text += f", {constant['told']}"
        if constant["label"] != "sampled" and constant["sampled"] is not None:
            other = "at most" if constant["told"] == "at least" else "at least"
            text += f"; sampled {constant['sampled']:.7g}, {other}"
        yield name, text + ")" + (f", {constants['convention']}" if name == "mu" else "")
    yield "domain", _domain(constants)
    instead = constants["under_partial_information"]
    needed = constants["c_lambda_2_needed"]
    if instead is not None and needed["rigorous"] is not None:
        text = (
            f"partial information would need c lambda_2 > {needed['printed']:.6g} (printed) or"
            f" {needed['rigorous']:.6g} (rigorous), where unweighted graphs reach"
            f" {g['system']['agents']}"
        )
        if instead["quadratic"] is not None:
            graph = "its own graph" if instead["graph"] == "own" else "the complete graph"
            text += (
                f"; on {graph} c > {_number(instead['quadratic']['least'])}"
                f" ({instead['label']} form) is enough"
            )
        yield "if partial", text


def _domain(constants: dict[str, Any]) -> str:
    if constants["domain"] == "everywhere":
        return "everywhere: F is affine"
    if constants["box"] is None:
        return f"{constants['domain']}; no bounds of the actions are known"
    lower, upper = constants["box"]
    box = f"a box within [{min(lower):.6g}, {max(upper):.6g}] that holds the feasible set"
    return box + (" and the estimates' starts" if constants["domain"] == "the box" else "")


def _coupling(coupling: dict[str, Any]) -> Iterator[tuple[str, str]]:
    yield "coupling", f"c = {coupling['gain']:g}, tau = {coupling['time_constant']:g} s"
    texts = {
        "printed": "mu (c lambda_2 - theta_2) > theta_2^2; no proof, since theta_1 is missing",
        "rigorous": "4 mu (c lambda_2 - theta_2) > (theta_1 + theta_2)^2",
        "quadratic": "sufficient for V to fall: -dV/dt's quadratic form positive definite"
        f" ({coupling['label']})",
    }
    for name, text in texts.items():
        condition = coupling[name]
        if condition is None:
            yield f"  {name}", f"not computed: {text}"
            continue
        least = _number(condition["least"])
        holds = "holds" if condition["holds"] else "does not hold"
        if name != "printed" and not condition["certified"]:
            holds += " with constants that are not certain"
        yield f"  {name}", f"{holds}, needs c > {least}: {text}"


def _gain(gain: dict[str, Any]) -> str:
    if gain["least"] is None:
        return f"k = {gain['gain']:g}; no k* can be given"
    least = "any k > 0" if gain["least"] == 0 else f"any k > {gain['least']:.6g}"
    text = f"k = {gain['gain']:g}; {least} meets k >= beta/mu"
    if gain["decay_rate"] is not None:
        rates = ", ".join(f"{k:g}: {rate:.3g}" for k, rate in gain["rates"])
        text += (
            f". As epsilon -> 0, V falls at least by exp(-r t) with r = {gain['decay_rate']:.4g} /s"
            f" (k: r is {rates}); alpha = {gain['alpha']:.4g} with beta = k mu"
        )
    return text


def _epsilon(epsilon: dict[str, Any]) -> str:
    text = f"{epsilon['given']:g} s given"
    if epsilon["star"] is not None:
        text += (
            f"; epsilon* = {epsilon['star']:.4g} s ({epsilon['label']}): for all up to it"
            f" W = V + {epsilon['fast_weight']:g} V_fast falls, and no slack falls below"
            f" {min(epsilon['kept']['floor']):.4g} ({epsilon['kept']['constraint']})"
        )
    elif epsilon["no_star"] is not None:
        text += f"; no epsilon* is computed: {epsilon['no_star']}"
    search = epsilon["search"]
    if search is None:
        return text + " (--search-epsilon tries)"
    inside, outside = search["inside"], search["outside"]
    count = len(search["trials"])
    text += f". By {count} trial run{'s' if count > 1 else ''} from this start: "
    text += "none stayed inside" if inside is None else f"{inside:.4g} s stays inside"
    if outside is not None:
        text += f", {outside:.4g} s does not"
    text += "; values between and beyond those tried are not known"
    return text + (f" ({search['note']})" if search["note"] else "")


def _kept(kept: dict[str, Any]) -> str:
    """How many of all estimates agents keep, and how well these are connected."""
    fewest = ", the fewest that will do" if kept["smallest"] else ""
    worst = (
        "" if kept["lambda_2"] is None else f"; least lambda_2 of keepers {kept['lambda_2']:.6g}"
    )
    return f"{kept['estimates']} of {kept['of']} kept{fewest}{worst}"


def _estimates(estimates: dict[str, Any]) -> str:
    if "margin" in estimates:
        side = "all inside" if estimates["margin"] > 0 else "not all inside"
        return (
            f"{side}, least margin {estimates['margin']:.6g} (agent {estimates['agent']},"
            f" {estimates['constraint']})"
        )
    distance = estimates["largest_distance_from_actions"]
    if distance == 0.0:
        return "they equal y(0)"
    return f"at most {distance:.6g} from y(0); under partial information they need not lie inside"


def _inputs(inputs: dict[str, Any]) -> str:
    if inputs["largest"] is None:
        return f"{inputs['of']} has none"
    text = inputs["exceeded"]
    if text is None:
        text = f"{inputs['of']} asks for up to {inputs['largest']:.4g} (agent {inputs['agent']})"
        if inputs["largest_factor"] is not None:
            text += f", up to {inputs['largest_factor']:.2g} of a limit"
    return f"{text}; limits of at least {inputs['largest']:.4g} are not met there, at y* none is"


def _periods(g: dict[str, Any]) -> str:
    periods = g["periods"]
    needs = "an explicit law would need" if g["held"] is not None else "held inputs need"
    parts = []
    for key, name in (("push", "one push"), ("linear", "linearisation")):
        if periods[key]["start"] is not None:
            there = periods[key]["equilibrium"]
            part = f"{name} {periods[key]['start']:.3g} s at the start"
            parts.append(part if there is None else f"{part}, {there:.3g} s at y*")
    text = "; ".join(parts) or "no rule known for these agents"
    text = f"{needs} periods below (heuristics): {text}"
    if g["equilibrium"]["penalised"] is None:
        text += "; y* was not found"
    if periods["control_period"] is not None:
        text += f"; the period here is {periods['control_period']:g} s"
    largest = periods["largest_timestep_for_estimates"]
    if largest is not None:
        text += f". Estimates under {g['system']['integrator']}: steps up to {largest:.3g} s"
        text += f", here {periods['timestep']:g} s"
    return text


def _division(division: dict[str, Any]) -> str:
    def told(count: int | None) -> str:
        if count is None:
            return f"would have to be divided more finely than into {division['finest']}"
        return "whole" if count == 1 else f"divided into about {count}"

    start = told(division["start"])
    if division["ends"] not in (None, "step_too_small"):
        start = f"the run ends in the first, {division['ends']},"
    return f"{start} at the start, {told(division['equilibrium'])} at y*"


def _held(held: dict[str, Any]) -> Iterator[tuple[str, str]]:
    for condition in held["conditions"]:
        yield f"[{condition['label']}]", f"{condition['status']}: {condition['why']}"
    if held["disturbance"] is not None:
        bound = held["disturbance"]
        yield (
            "margin",
            f"covers a push of {max(bound['push']):g}, noise of {max(bound['noise']):g} and a delay"
            f" of {bound['delay']} periods: outputs off by at most"
            f" {max(held['prediction_error']):.4g},"
            f" constraints tightened by up to {max(held['tightening']):.4g}",
        )
    if held["observer"] is not None:
        yield "loads", _observer(held["observer"])
    if held["largest_push"] is not None:
        push = f"{held['largest_push']:.4g} on every agent at once is covered"
        yield "largest push", push if held["largest_push"] else "none is covered without a margin"
    search = held["push_search"]
    if search is not None:
        least = search["smallest_breaking_push"]
        if least == 0.0:
            text = "the run leaves the set without any push"
        elif least is None:
            text = f"none up to {search['largest_tried']:.4g} leaves the set"
        else:
            text = f"{least:.4g} leaves the set ({search['pattern']})"
            if held["largest_push"]:
                text += f"; the certified push is {held['largest_push'] / least:.0%} of it"
        yield "adversarial search", f"{text}, by {search['runs']} runs from this start"
    search = held["period_search"]
    if search is not None:
        inside, outside = search["inside"], search["outside"]
        text = "none tried stays" if inside is None else f"up to {inside:.4g} s the run stays"
        text += " inside between the instants too"
        if outside is not None:
            text += f", with {outside:.4g} s it does not"
        yield "period, by trial", f"{text} ({search['note']})"


def _observer(observer: dict[str, Any]) -> str:
    text = f"estimated by each agent with gain {observer['gain']:g}"
    if observer["shrinks"] is None:
        return f"{text}; that estimates settle is not known"
    text += (
        f"; constant ones are removed, errors shrinking at least by a factor of"
        f" {observer['shrinks']:.3g} a period"
    )
    if observer["unforeseen_push"] is not None:
        text += f"; at most {max(observer['unforeseen_push']):.4g} is not foreseen"
    return text


def _number(value: float | None, form: str = ".6g") -> str:
    return "infinite or unknown" if value is None else format(value, form)
