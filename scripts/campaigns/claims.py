"""What ``certify`` claims of random systems, right and wrong ones, against what their runs do."""

import argparse
import json
import sys
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import stiff
from draws import progress
from gains import gains_alone
from wrong import Case, build, draw

from gne_mj.controllers import FullyDistributed
from gne_mj.errors import GneError, InfeasibleStart, InvalidInput, SolverError
from gne_mj.faults import Bias, Noise, Push, SensorDelay, steady_push
from gne_mj.simulation import Simulation
from gne_mj.system import Clock, System
from gne_mj.theory import certify

RUNS_A_JOB = 10
LEFT = ("left_feasible_set", "estimate_left_feasible_set", "diverged")
CERTIFIED, CONDITIONAL = "certified", "certified for small epsilon"
HELD = "certified at control instants"
ROUNDING = 1e-9
# A run tends to y* if it comes to half of its greatest distance, or to this
NEAR = 1e-6
LONGER = (4, 16, 64)  # times its duration, until it does
SMALLEST_EPSILON = 1e-8  # s


def main() -> int:
    """Ask, run and check all; print the tables; 1 if a claim was contradicted."""
    parser = argparse.ArgumentParser(prog="scripts/check-claims", description=__doc__)
    parser.add_argument("--runs", type=int, default=2_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--index", type=int, help="repeat this system alone")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--out", type=Path, help="JSON file for the counts and contradictions")
    options = parser.parse_args()
    if options.out and options.out.exists():
        parser.error(f"--out: {options.out} exists already; name another file")
    started = time.perf_counter()
    if options.index is not None:
        print(json.dumps(one(options.seed, options.index), indent=2))
        return 0
    jobs = [
        (options.seed, first, min(first + RUNS_A_JOB, options.runs))
        for first in range(0, options.runs, RUNS_A_JOB)
    ]
    rows: list[dict[str, Any]] = []
    with ProcessPoolExecutor(options.processes) as pool:
        for part in progress(pool.map(_job, jobs), len(jobs), "systems"):
            rows += part
    lines, contradicted = report(rows)
    print("\n".join([*lines, "", f"{time.perf_counter() - started:.0f} s"]))
    if options.out:
        text = json.dumps({"seed": options.seed, "runs": len(rows), "rows": rows}, indent=1)
        options.out.write_text(text + "\n", encoding="utf-8")
    return 1 if contradicted else 0


def _job(job: tuple[int, int, int]) -> list[dict[str, Any]]:
    seed, first, last = job
    return [_guarded(seed, index) for index in range(first, last)]


def _guarded(seed: int, index: int) -> dict[str, Any]:
    """As :func:`one`; what it does not expect is told as a contradiction, and ends no campaign."""
    try:
        return one(seed, index)
    except Exception as error:
        crash = Check("nothing crashes", False, f"{type(error).__name__}: {error}")
        row = {"index": index, "kind": "any", "mode": "any", "verdict": "crashed"}
        return row | _tally([crash])


def one(seed: int, index: int) -> dict[str, Any]:
    """One system: its verdict, the claims that were checked by kind, and the contradictions."""
    rng = np.random.default_rng([seed, index])
    parts = draw(rng)
    row: dict[str, Any] = {
        "index": index, "kind": parts.kind, "mode": parts.mode, "checked": {}, "against": [],
    }  # fmt: skip
    try:
        case = build(rng, parts)
        case.system.setup(case.clock)  # so that what a run refuses is not asked about
    except InfeasibleStart:
        return (
            row
            | {"verdict": "refused: start"}
            | _tally([Check("a start is refused that is outside", not parts.inside, None)])
        )
    except InvalidInput as error:
        return row | {"verdict": f"refused: {error.key.split('.')[-1]}"}
    except SolverError as error:
        return (
            row
            | {"verdict": "no equilibrium"}
            | _tally([Check("a system that fits together can be set up", False, str(error))])
        )
    system, clock = case.system, case.clock
    row |= {
        "agents": system.game.agents, "rho": system.rho, "integrator": system.integrator,
        "timestep": clock.timestep, "period": clock.control_period, "duration": clock.duration,
        "limited": bool(np.any(np.isfinite(system.agents.input_limit))),
        "faults": [type(fault).__name__ for fault in system.faults],
        "margin_declared": system.disturbance is not None,
    }  # fmt: skip
    checks = [Check("a start is taken that is inside", parts.inside, None)]
    try:
        told = certify(system, clock).to_dict()
    except GneError as error:
        checks.append(Check("certify answers", False, str(error)))
        return row | {"verdict": "no answer"} | _tally(checks)
    row["verdict"] = told["status"]
    try:
        seen = _run(system, clock)
    except GneError as error:
        checks.append(Check("what certify answers about can be run", False, str(error)))
        return row | _tally(checks)
    row |= {"status": seen.report["status"], "message": seen.report["message"]}
    for check in CHECKS:
        checks += check(case, told, seen)
    return row | _tally(checks)


@dataclass
class Check:
    """One claim, whether what was seen agrees with it, and the numbers that do not."""

    claim: str
    holds: bool
    numbers: Any


@dataclass
class Seen:
    """A run: its report, sample times (samples,) and outputs (samples, m)."""

    report: dict[str, Any]
    time: np.ndarray
    y: np.ndarray

    @property
    def left(self) -> bool:
        """Whether it left the set, or ended without an action."""
        return self.report["status"] in LEFT

    @property
    def given_up(self) -> bool:
        """Whether no step was fine enough to go on."""
        return bool(self.report["status"] == "step_too_small")

    @property
    def limited(self) -> bool:
        """Whether an input limit was met."""
        return self.report["actuators"]["saturated"] is not None


def _run(system: System, clock: Clock) -> Seen:
    trajectory = Simulation([system], clock).run()
    data = trajectory["run"]
    time_ = data["time"].to_numpy()
    return Seen(trajectory.reports["run"], time_, data["action"].to_numpy().reshape(len(time_), -1))


def _tally(checks: list[Check]) -> dict[str, Any]:
    against = [{"claim": c.claim, "numbers": c.numbers} for c in checks if not c.holds]
    return {"checked": dict(Counter(c.claim for c in checks)), "against": against}


# ------------------------------------------------------------------------ what runs can contradict


def for_all_time(case: Case, told: dict[str, Any], seen: Seen) -> Iterator[Check]:
    """Constraints of a certified system, as long as no input limit is met."""
    if told["status"] == CERTIFIED and not seen.limited:
        numbers = None if not seen.left else seen.report["message"]
        yield Check("constraints hold for all time", not seen.left, numbers)


def small_epsilon(case: Case, told: dict[str, Any], seen: Seen) -> Iterator[Check]:
    """Constraints under the fully distributed law for some epsilon, looked for by running."""
    system, law = case.system, case.system.law
    if told["status"] != CONDITIONAL or not isinstance(law, FullyDistributed) or seen.limited:
        return
    epsilon, message = law.epsilon, seen.report["message"]
    while seen.left and epsilon > SMALLEST_EPSILON:
        epsilon *= 0.1
        slow = replace(system, law=replace(law, epsilon=epsilon), integrator="rosenbrock")
        seen = _run(slow, case.clock)
    yield Check(
        "constraints hold for some epsilon", not seen.left, {"epsilon": epsilon, "exit": message}
    )


def at_instants(case: Case, told: dict[str, Any], seen: Seen) -> Iterator[Check]:
    """Constraints at every control instant, and what that rests on."""
    if told["status"] != HELD:
        return
    out, implicit = seen.report["exit"], seen.report["implicit"]
    assumed = {c["label"]: c["status"] for c in told["held"]["conditions"]}
    if not (seen.limited and assumed["inputs"] == "assumed"):
        wrong = seen.left and (
            out["at_control_instant"]
            or out["estimates_of_agent"] is not None
            or seen.report["status"] != "left_feasible_set"
        )
        first = implicit["first_not_accurate"]
        excepted = first is not None and out is not None and first < out["time"]
        if not excepted:
            yield Check("constraints hold at control instants", not wrong, seen.report["message"])
        least = told["held"]["least_slope"]
        if least is not None:
            yield Check(
                "dy+/du > 0",
                implicit["periods_not_monotone"] == 0,
                {"least": min(least), "periods": implicit["periods_not_monotone"]},
            )
    if assumed["inputs"] == "met":
        yield Check(
            "inputs are delivered as asked for",
            not seen.limited,
            seen.report["actuators"]["saturated"],
        )
    error = told["held"]["prediction_error"]
    if implicit["not_accurate"] == 0 and not seen.limited:
        most = ROUNDING * (1.0 + float(np.max(np.abs(seen.y)))) + 1e-7
        most += 0.0 if error is None else max(error)
        if error is not None or not system_moved(case.system):
            yield Check(
                "outputs are as predicted, but for what a margin covers",
                implicit["largest_prediction_error"] <= most,
                {"error": implicit["largest_prediction_error"], "told": most},
            )


def largest_push(case: Case, told: dict[str, Any], seen: Seen) -> Iterator[Check]:
    """The greatest push on all agents at once that the margin covers, in random directions."""
    system = case.system
    push = (told["held"] or {}).get("largest_push")
    if told["status"] != HELD or system.disturbance is None or not push:
        return
    rng = np.random.default_rng(system.seed)
    pushes = steady_push(system.game, push * rng.choice([-1.0, 1.0], system.game.actions))
    delay = system.disturbance.delay
    late = (SensorDelay(periods=delay),) if delay else ()
    pushed = _run(replace(system, faults=(*pushes, *late)), case.clock)
    out = pushed.report["exit"]
    if not pushed.limited:
        holds = not pushed.left or not out["at_control_instant"]
        yield Check("the largest push is covered", holds, {"push": push, "exit": out})


def system_moved(system: System) -> bool:
    """Whether a fault moves agents or their sensors."""
    return any(isinstance(fault, Push | Noise | Bias | SensorDelay) for fault in system.faults)


def no_fault(case: Case, told: dict[str, Any], seen: Seen) -> Iterator[Check]:
    """The sentence that nothing moves the agents or their sensors."""
    if told["held"] is None:
        return
    for condition in told["held"]["conditions"]:
        if condition["label"] == "disturbances" and "no fault moves" in condition["why"]:
            yield Check(
                "no fault moves the agents or their sensors",
                not system_moved(case.system),
                condition,
            )


def limits(case: Case, told: dict[str, Any], seen: Seen) -> Iterator[Check]:
    """A verdict "as long as no input limit is met" is of use if none is met at the start."""
    if not told["system"]["limited_inputs"] or not told["status"].startswith("certified"):
        return
    met = seen.report["actuators"]["saturated"]
    at_start = met is not None and met["time"] == 0.0
    said = _says(told["not_certified"], "input limit") or _says(told["guaranteed"], "at the start")
    yield Check(
        "certified: the start meets no input limit, or it is said", said or not at_start, met
    )


def lyapunov(case: Case, told: dict[str, Any], seen: Seen) -> Iterator[Check]:
    """V never rises where that is claimed; of V at the steps that the run observes."""
    found = seen.report["lyapunov"]
    if told["lyapunov_claimed"] and not seen.limited and found["known"]:
        yield Check(
            "the Lyapunov function never rises",
            found["monotone"],
            {k: found[k] for k in ("start", "largest_rise", "largest_rise_time")},
        )
        yield Check("run and certify claim the same of V", found["claimed"], found)


def tends(case: Case, told: dict[str, Any], seen: Seen) -> Iterator[Check]:
    """y tends to y*: a certified run, longer if need be, halves its greatest distance."""
    if told["status"] != CERTIFIED or seen.limited or seen.left or seen.given_up:
        return
    target = np.array(told["equilibrium"]["penalised"])
    clock = case.clock
    for times in (1, *LONGER):
        if times > 1:
            longer = replace(clock, duration=clock.duration * times,
                             sample_period=clock.sample_period * times)  # fmt: skip
            seen = _run(case.system, longer)
            if seen.left:
                yield Check("constraints hold for all time", False, seen.report["message"])
            if seen.left or seen.given_up:
                return
        distance = np.max(np.abs(seen.y - target), axis=1)
        near = max(NEAR * max(1.0, float(np.max(np.abs(target)))), 0.5 * float(np.max(distance)))
        if distance[-1] <= near or seen.report["status"] not in ("converged", "completed"):
            break
    yield Check(
        "y tends to y*",
        distance[-1] <= near,
        {"end": distance[-1], "most": float(np.max(distance)), "s": seen.time[-1]},
    )


def division(case: Case, told: dict[str, Any], seen: Seen) -> Iterator[Check]:
    """The first step is divided about as finely as was foretold."""
    if told["division"] is None or seen.limited:
        return
    clock = case.clock
    h, pieces = clock.timestep, told["division"]["start"]
    first = _run(case.system, replace(clock, duration=h, sample_period=h)).report
    if first["division"] is None or first["status"] not in ("converged", "completed"):
        # what follows the first piece in the first step may need finer ones, beyond the finest too
        yield Check("the first step can be taken, or it is said", pieces is None or pieces > 64,
                    {"told": pieces, "seen": first["message"]})  # fmt: skip
        return
    found = h / (first["division"]["smallest_step"] or h)
    yield Check(
        "the first step is divided as foretold",
        pieces is not None and pieces / 4 <= found <= 16 * pieces,
        {"told": pieces, "seen": found},
    )


def equilibrium(case: Case, told: dict[str, Any], seen: Seen) -> Iterator[Check]:
    """The penalised equilibrium is one, by the oracle's F and barrier."""
    if told["equilibrium"]["penalised"] is None:
        return
    y = np.array(told["equilibrium"]["penalised"])
    slack = case.oracle.slacks(y[None])[0] - case.system.game.margins
    weights = case.system.rho / slack
    pull = case.oracle.pull.value(np.broadcast_to(y, (len(y), len(y))))
    push = weights[:, None] * case.oracle.slopes(y[None])[0]
    residual = np.max(np.abs(pull + push.sum(axis=0)))
    # -g is known to some 1e-16 of its terms, and what follows from it likewise
    rounding = 1e-15 * (1 + np.max(np.abs(y))) ** 2 / np.min(np.abs(slack))
    scale = max(1.0, float(np.max(np.abs(pull))), float(np.max(np.abs(push))))
    holds = bool(np.min(slack) > 0 and residual <= scale * (ROUNDING + rounding))
    yield Check(
        "y* is the penalised equilibrium",
        holds,
        {"residual": float(residual), "scale": scale, "slack": float(np.min(slack))},
    )


def epsilons(case: Case, told: dict[str, Any], seen: Seen) -> Iterator[Check]:
    """No agent can gain more than each bound that is told, as found by a grid for itself."""
    found = told["equilibrium"]
    if found["penalised"] is None:
        return
    gains = gains_alone(case.system, np.array(found["penalised"]))
    measured = max(gains.values(), default=0.0)
    own = seen.report["epsilon"]["measured"]
    some = f", {told['status']}"
    for name in ("bound", "bound_affine", "largest_own_bound"):
        bound = found[name]
        if bound is not None:
            most = bound * (1 + 1e-6) + 1e-9 * (1 + abs(measured))
            yield Check(
                f"epsilon <= {name}{some}",
                max(measured, own or 0.0) <= most,
                {"measured": measured, "by the run": own, "told": bound},
            )
    for agent, bound in enumerate(found["own_bound"]):
        if agent in gains and bound is not None:
            yield Check(
                f"epsilon_i <= its bound{some}",
                gains[agent] <= bound * (1 + 1e-6) + 1e-9,
                {"agent": agent + 1, "measured": gains[agent], "told": bound},
            )
    if own is not None and gains and len(gains) == case.system.game.agents:
        agrees = measured <= own + 1e-4 * (1 + measured)
        yield Check(
            "the measured epsilon is all that an agent can gain",
            agrees,
            {"by a grid": measured, "by the run": own},
        )


def constants(case: Case, told: dict[str, Any], seen: Seen) -> Iterator[Check]:
    """mu and theta_1 that may be relied on, against F at the run's own profiles."""
    found = told["constants"]
    profiles = seen.y[np.all(case.oracle.slacks(seen.y) > 0, axis=1)][::5]
    if len(profiles) < 2:
        return
    m = profiles.shape[1]
    values = np.array([case.oracle.pull.value(np.broadcast_to(y, (m, m))) for y in profiles])
    dy, df = np.diff(profiles, axis=0), np.diff(values, axis=0)
    moved = np.linalg.norm(dy, axis=1) > 1e-6
    if not np.any(moved):
        return
    dy, df = dy[moved], df[moved]
    square = np.sum(dy**2, axis=1)
    for name, seen_, sign in (
        ("mu", float(np.min(np.sum(dy * df, axis=1) / square)), 1.0),
        ("theta_1", float(np.max(np.linalg.norm(df, axis=1) / np.sqrt(square))), -1.0),
    ):
        value, label = found[name]["value"], found[name]["label"]
        if label == "sampled" or value is None:
            continue
        holds = sign * seen_ >= sign * value - 1e-6 * max(1.0, abs(value))
        yield Check(f"{name} ({label})", holds, {"told": value, "seen": seen_})


def premises(case: Case, told: dict[str, Any], seen: Seen) -> Iterator[Check]:
    """What is certified has convex constraints, and costs as its theorem asks for."""
    if not told["status"].startswith("certified"):
        return
    convex = bool(np.all(np.asarray(case.oracle.sign) > 0))
    yield Check("what is certified has convex constraints", convex, None)
    if isinstance(case.oracle.pull, stiff.Osnr):
        return
    slope, owner = case.oracle.pull.slope, case.oracle.owner
    system = case.system
    if told["status"] == HELD and (system.decentralised or system.law.graph is not None):
        slope = slope * (owner[:, None] == owner)
        name = "what is certified has costs convex in own actions"
    else:
        name = "what is certified has a monotone F"
    least = float(np.linalg.eigvalsh(0.5 * (slope + slope.T))[0])
    yield Check(name, least > -ROUNDING, {"least eigenvalue": least})


def starts(case: Case, told: dict[str, Any], seen: Seen) -> Iterator[Check]:
    """The start's least margin is what the oracle has."""
    slack = float(np.min(case.oracle.slacks(case.system.start[None])))
    rounding = 1e-13 * (1.0 + float(np.max(np.abs(case.system.start)))) ** 2
    yield Check(
        "the start's margin",
        abs(told["start"]["margin"] - slack) <= rounding,
        {"told": told["start"]["margin"], "is": slack},
    )


def outputs(case: Case, told: dict[str, Any], seen: Seen) -> Iterator[Check]:
    """A run that says it stayed inside did, at its samples, by the oracle's constraints."""
    if seen.left:
        return
    slack = case.oracle.slacks(seen.y)
    rounding = 1e-13 * (1.0 + float(np.max(np.abs(seen.y)))) ** 2
    yield Check(
        "a run that says so stayed inside",
        bool(np.min(slack) > -rounding),
        {"slack": float(np.min(slack))},
    )


CHECKS = (
    premises, for_all_time, small_epsilon, at_instants, no_fault, limits, lyapunov, tends,
    division, largest_push, equilibrium, epsilons, constants, starts, outputs,
)  # fmt: skip


def _says(sentences: list[str], words: str) -> bool:
    return any(words in sentence for sentence in sentences)


# ---------------------------------------------------------------------------------------- report


def report(rows: list[dict[str, Any]]) -> tuple[list[str], int]:
    """Markdown tables: verdicts, claims by kind, and each contradiction; how many there are."""
    verdicts = Counter((row["mode"], row["verdict"]) for row in rows)
    lines = ["| mode | verdict | systems |", "|---|---|---|"]
    lines += [f"| {mode} | {verdict} | {n} |" for (mode, verdict), n in sorted(verdicts.items())]
    checked, against = Counter[str](), Counter[str]()
    for row in rows:
        checked.update(row["checked"])
        against.update(found["claim"] for found in row["against"])
    lines += ["", "| claim | checked | contradicted |", "|---|---|---|"]
    lines += [f"| {claim} | {n} | {against[claim]} |" for claim, n in sorted(checked.items())]
    lines.append(f"| all | {checked.total()} | {against.total()} |")
    shown = Counter[str]()
    for row in rows:
        for found in row["against"]:
            shown[found["claim"]] += 1
            if shown[found["claim"]] <= 5:
                what = f"{row['kind']}, {row['mode']}, {row['verdict']}"
                lines.append(f"index {row['index']} ({what}): {found['claim']}: {found['numbers']}")
    return lines, against.total()


if __name__ == "__main__":
    sys.exit(main())
