"""What is guaranteed where several things come together, by certify's own words, against runs.

Lines of integrators, PI cascades or flexible robots near their bounds, under full and partial
information (all estimates or those needed, graphs that change, triggers, lost and late messages),
with guards, observers of loads, margins with disturbances as large as declared, falling penalties,
and bounds that close. Every integration step is recorded, and constraints are looked at by a
formula of this file.
"""

import sys
from typing import Any

import numpy as np
from campaign import campaign, crash, parser

from gne_mj.errors import InfeasibleStart, InvalidInput
from gne_mj.scenario import load_scenario
from gne_mj.theory import certify

Row = dict[str, Any]
AGENTS = ("integrator", "pi-cascade", "flexible-robot")
NEVER = ("left_feasible_set", "exit_foreseen", "diverged", "estimate_left_feasible_set")
PAST = "bound_moved_past"  # beyond the rate that is promised, if it is so by the formula too
CLOSING = "bounds that close"
REFERENCE, BOUND = 3.0, 3.0  # m/s


def main() -> int:
    """Run, print the table; 1 if a run did what certify said it does not."""
    given = parser("scripts/check-together", __doc__, 2_000).parse_args()
    return campaign(given, one, crashed, report, lambda row: bool(row["against"]))


def crashed(index: int, error: Exception) -> Row:
    """What is not expected counts as broken."""
    row = crash(index, error)
    return row | {"promised": "", "with": [], "against": [row["message"]]}


def one(seed: int, index: int) -> Row:
    """The row of a run."""
    rng = np.random.default_rng([seed, index])
    tables, kind = drawn(rng)
    row: Row = {"index": index, "kind": kind, "promised": "", "against": [],
                "with": parts_of(tables)}  # fmt: skip
    try:
        simulation = load_scenario(tables).simulation_object()
        told = certify(simulation.systems[0], simulation.clock).to_dict()
    except (InfeasibleStart, InvalidInput) as error:
        return row | {"status": "refused", "why": str(error)}
    run = simulation.run()
    seen, data = run.reports["a"], run["a"]
    time, y = data["time"].to_numpy(), data["action"].to_numpy()
    gaps = np.diff(y, axis=1, prepend=REFERENCE)
    slack = bound_at(tables, time) - np.max(np.abs(gaps), axis=1)
    inside = slack > 0.0
    end = time[-1:] + tables["simulation"]["control_period"]
    passed = bool(np.all(np.max(np.abs(gaps[-1])) >= bound_at(tables, end)))
    row |= {"status": seen["status"], "passed": passed,
            "cut": (seen["between"] or {}).get("periods_cut", 0), "promised": promise(told, tables),
            "margin": float(np.min(slack))}  # fmt: skip
    return row | {"against": list(contradictions(row, seen, time, inside, tables))}


def promise(told: Row, tables: Row) -> str:
    """Where constraints are promised: "always", at "steps", "instants", "foreseen", or nowhere."""
    guarded = tables["systems"]["a"]["controller"].get("between") == "guarded"
    moving = told["moving"]
    continuous = tables["systems"]["a"]["controller"]["mode"] == "continuous"
    if told["status"] == "certified" or (continuous and moving is not None and moving["kept"]):
        return "always"
    if told["held"] is not None and told["held"]["promised"]:
        return "steps" if guarded else "instants"
    still = not any(f["type"] in ("push", "noise", "bias") for f in
                    tables["systems"]["a"].get("faults", []))  # fmt: skip
    return "foreseen" if told["held"] is None and guarded and still else ""


def contradictions(row: Row, seen: Row, time: np.ndarray, inside: np.ndarray, tables: Row) -> Any:
    """What was promised and is not so."""
    promised, status = row["promised"], seen["status"]
    implicit = seen["implicit"]
    if promised in ("always", "steps"):
        if status in NEVER or not np.all(inside):
            yield f"{promised}: {seen['message']}"
    elif promised == "instants" and implicit["not_accurate"] == 0:
        period = tables["simulation"]["control_period"]
        instants = np.abs(time / period - np.round(time / period)) < 1e-9
        out = seen["exit"]
        past = status == PAST and row["passed"]
        wrong = out is not None and out["at_control_instant"] and not past
        if not np.all(inside[instants]) or wrong:
            yield f"instants: {seen['message']}"
        straight = row["kind"] == "integrator" and not {"margin", CLOSING} & set(row["with"])
        if straight and not np.all(inside):
            yield f"integrators between instants: {seen['message']}"
    elif promised == "foreseen" and (status == "left_feasible_set" or not np.all(inside)):
        yield f"foreseen: {seen['message']}"
    lyapunov = seen["lyapunov"]
    if lyapunov["claimed"] and not lyapunov["monotone"]:
        yield f"V rose by {lyapunov['largest_rise']:.3g} of {lyapunov['start']:.3g}"


def bound_at(tables: Row, time: np.ndarray) -> Any:
    """Of all gaps, at each time."""
    given = tables["systems"]["a"]["game"]["gap_bound"]
    if not isinstance(given, dict):
        return given
    return np.maximum(given["to"], given["from"] - given["rate"] * time)


def report(rows: list[Row]) -> tuple[list[str], int]:
    """A line for each kind and promise, one for what came together, and each contradiction."""
    lines = ["| kind | promised | runs | broken | exit foreseen | bound moved past |"
             " least delta - gap |", "|---|---|---|---|---|---|---|"]  # fmt: skip
    for key in sorted({(row["kind"], row["promised"]) for row in rows if "margin" in row}):
        own = [row for row in rows if (row["kind"], row["promised"]) == key and "margin" in row]
        foreseen, past = (sum(row["status"] == each for row in own)
                          for each in ("exit_foreseen", PAST))  # fmt: skip
        broken = sum(bool(row["against"]) for row in own)
        least = min(row["margin"] for row in own)
        lines.append(f"| {key[0]} | {key[1] or 'nothing'} | {len(own)} | {broken} | {foreseen} |"
                     f" {past} | {least:.3g} |")  # fmt: skip
    lines += ["", "| with | promised runs | broken |", "|---|---|---|"]
    for what in sorted({each for row in rows for each in row["with"]}):
        own = [row for row in rows if what in row["with"] and row["promised"]]
        lines.append(f"| {what} | {len(own)} | {sum(bool(row['against']) for row in own)} |")
    refused = [row for row in rows if row["status"] == "refused"]
    cut = sum(row.get("cut", 0) > 0 for row in rows)
    lines.append(f"refused: {len(refused)}; runs with a control period cut: {cut}")
    for row in rows:
        if row["against"]:
            lines.append(f"{row['index']} ({row['kind']}, {', '.join(row['with'])}):"
                         f" {'; '.join(row['against'])}")  # fmt: skip
    return lines, sum(bool(row["against"]) for row in rows)


# ------------------------------------------------------------------------------------- draws


def parts_of(tables: Row) -> list[str]:
    """What comes together in a scenario."""
    system = tables["systems"]["a"]
    controller = system["controller"]
    found = [controller["mode"], controller["information"], system["plant"]["engine"]]
    found += [key for key in ("between", "observer", "decentralised", "estimates", "communication")
              if controller.get(key)]  # fmt: skip
    found += [CLOSING] * isinstance(system["game"]["gap_bound"], dict)
    found += ["changing graph"] * isinstance(controller.get("graph"), dict)
    found += ["falling penalty"] * ("schedule" in system["barrier"])
    return found + ["margin"] * ("margin" in system) + [f["type"] for f in system.get("faults", [])]


def drawn(rng: np.random.Generator) -> tuple[Row, str]:
    """A scenario's tables, and what it is counted by."""
    agents, count = str(rng.choice(AGENTS)), int(rng.integers(2, 6))
    mode = str(rng.choice(["implicit", "sampled", "continuous"], p=[0.75, 0.15, 0.1]))
    step, steps = float(rng.choice([0.001, 0.002, 0.005])), int(rng.integers(1, 50))
    controller = controlled(rng, mode, count, step * steps)
    struck = mode == "implicit" and rng.random() < 0.6
    margin, faults = disturbed(rng, controller, count, step * steps) if struck else (None, [])
    if controller["information"] == "partial" and mode != "continuous":
        faults += messages(rng, controller)
    robots = agents == "flexible-robot"
    barrier: Row = {"rho": float(10.0 ** rng.uniform(-3.0, 0.0))}
    if mode == "implicit" and rng.random() < 0.1:
        barrier |= {"schedule": "exponential", "time_constant": 1.0, "floor": 1e-4}
    bound: Any = BOUND
    if mode != "sampled" and not margin and rng.random() < 0.25:
        controller.pop("between", None)
        bound = {"type": "ramp", "from": BOUND, "to": 1.0, "rate": float(rng.uniform(0.1, 2.0))}
    near = rng.uniform(0.0, 0.9) if margin else 1.0 - 10.0 ** rng.uniform(-6.0, 0.0)
    gaps = near * BOUND * rng.uniform(-1.0, 1.0, count)
    system: Row = {
        "game": {"type": "velocity-synchronization", "reference_velocity": REFERENCE,
                 "gap_bound": bound},
        "agents": {"type": agents, "count": count}, "controller": controller, "barrier": barrier,
        "plant": {"engine": "mujoco" if robots and rng.random() < 0.3 else "ode",
                  "integrator": str(rng.choice(["euler", "rk4"]))},
        "initial": {"action": (REFERENCE + np.cumsum(gaps)).tolist()},
        **({"margin": margin} if margin else {}), **({"faults": faults} if faults else {}),
    }  # fmt: skip
    if robots:
        system["agents"] |= {
            "main_mass": np.exp(rng.uniform(-1.0, 1.0, count)).tolist(),
            "appendage_mass": np.exp(rng.uniform(-1.0, 1.0, count)).tolist(),
        }
        reach = float(rng.choice([0.0, 5.0, 30.0]))
        system["initial"]["extension"] = (reach * rng.uniform(-1.0, 1.0, count)).tolist()
    periods = max(1, round(2.0 / (step * steps)))
    return {
        "simulation": {"duration": periods * step * steps, "timestep": step,
                       "control_period": step * (1 if mode == "continuous" else steps),
                       "seed": int(rng.integers(2**31))},
        "recording": {"period": step}, "systems": {"a": system},
    }, agents  # fmt: skip


def controlled(rng: np.random.Generator, mode: str, count: int, period: float) -> Row:
    """The controller's table."""
    found: Row = {"mode": mode, "information": str(rng.choice(["full", "partial"]))}
    if found["information"] == "partial":
        found |= {"coupling": float(np.exp(rng.uniform(0.0, 3.5))), "time_constant": 0.1}
        found["graph"] = str(rng.choice(["line", "ring", "complete"]))
        how = rng.choice(["all", "needed", "changing"])
        if how == "needed":
            found["estimates"] = "needed"
        elif how == "changing":
            found["graph"] = {"type": "switching", "graphs": ["line", "ring", "complete"],
                              "every": period * int(rng.integers(1, 20)),
                              "order": str(rng.choice(["given", "random"]))}  # fmt: skip
    if mode != "continuous" and rng.random() < 0.6:
        found["between"] = "guarded"
    if mode == "implicit":
        found["decentralised"] = bool(rng.random() < 0.2)
        if rng.random() < 0.35:
            found["observer"] = float(rng.choice([0.2, 0.5, 1.0]))
    return found


def disturbed(
    rng: np.random.Generator, controller: Row, count: int, period: float
) -> tuple[Row, list[Row]]:
    """A margin, and faults as strong as it declares."""
    push, noise = float(10.0 ** rng.uniform(-1.5, 0.5)), float(10.0 ** rng.uniform(-5.0, -2.5))
    margin: Row = {"push": push, "noise": noise}
    faults: list[Row] = [{"type": "noise", "amplitude": 0.5 * noise},
                         {"type": "bias", "offset": 0.5 * noise}]  # fmt: skip
    signs = rng.choice([-1.0, 1.0], count)
    if controller.get("observer"):
        size, length = 5.0 * push, float(rng.uniform(1.0, 10.0))
        margin |= {"push": 0.0, "push_change": 2.0 * np.pi * size / length * period}
        course: Row = {"profile": "sine", "period": length}
    else:
        size = push
        course = {"profile": str(rng.choice(["constant", "square", "random"])),
                  "period": period * int(rng.integers(1, 20))}  # fmt: skip
    faults += [{"type": "push", "agents": [i + 1], "force": size * signs[i], **course}
               for i in range(count)]  # fmt: skip
    if not controller.get("between") and not controller.get("observer") and rng.random() < 0.3:
        margin["delay"] = int(rng.integers(1, 3))
        faults.append({"type": "sensor-delay", "periods": margin["delay"]})
    return margin, faults


def messages(rng: np.random.Generator, controller: Row) -> list[Row]:
    """What goes wrong with messages, or triggers in the controller's table."""
    if isinstance(controller["graph"], dict):
        return []
    which = rng.choice(["none", "loss", "delay", "silence", "corruption", "triggers"])
    if which == "triggers" and "estimates" not in controller:
        controller["communication"] = {"type": "event", "threshold": float(rng.uniform(0.0, 1.0)),
                                       "sigma": float(rng.choice([0.0, 0.05])),
                                       "decay": 0.3}  # fmt: skip
    return {
        "loss": [{"type": "message-loss", "probability": 0.5}],
        "delay": [{"type": "message-delay", "periods": 3}],
        "silence": [{"type": "silence", "agents": [1], "start": 0.2, "end": 1.0}],
        "corruption": [{"type": "estimate-corruption", "amplitude": 3.0, "start": 0.5}],
    }.get(str(which), [])


if __name__ == "__main__":
    sys.exit(main())
