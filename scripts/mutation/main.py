"""Puts small faults into a copy of the code, one at a time, and sees whether the tests notice."""

import argparse
import json
import os
import random
import signal
import sys
import time
import tomllib
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path

import judge
from copies import Tree
from operators import Mutant, differs, mutants

ROOT = Path(__file__).resolve().parent.parent.parent
MODULES = (
    "controllers", "gne_mj/games", "gne_mj/barrier.py", "gne_mj/loops", "gne_mj/margins.py",
    "gne_mj/theory", "gne_mj/run_metrics.py", "gne_mj/certificate.py", "gne_mj/interior_point.py",
    "gne_mj/primal_dual.py",
    "gne_mj/equilibrium.py", "gne_mj/solutions.py", "gne_mj/batches",
)  # fmt: skip
OUTCOMES = ("killed", "timed out", "survived", "equivalent", "undecided")


def main() -> int:
    """Draw or go on with a campaign; 1 if a mutant that is not known as equivalent survived."""
    options = _options()
    if options.resume or options.again:
        plan = json.loads((options.out / "plan.json").read_text())
    else:
        if options.out.exists():
            raise SystemExit(f"{options.out} exists: give --resume, or another --out")
        drawn = [asdict(mutant) for mutant in draw(options.modules, options.seed, options.count)]
        plan = {"seed": options.seed, "modules": options.modules, "mutants": drawn}
        options.out.mkdir(parents=True)
        (options.out / "plan.json").write_text(json.dumps(plan, indent=1))
    campaign = Campaign(options.out, plan)
    if options.list:
        print("\n".join(map(str, campaign.mutants)))
        return 0
    if options.again:
        campaign.forget("survived", "undecided")
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: judge.give_up())
    campaign.run(options.processes, 60.0 * options.budget, options.limit)
    print("\n".join(campaign.lines()))
    return 1 if campaign.counts()["survived"] else 0


def draw(modules: list[str], seed: int, count: int) -> list[Mutant]:
    """So many mutants of these files and folders: a kind first, then a place, all alike."""
    pools: dict[str, list[Mutant]] = {}
    for module in modules:
        path = ROOT / module
        files = sorted(path.glob("*.py")) if path.is_dir() else [path]
        for file in files:
            for mutant in mutants(str(file.relative_to(ROOT)), file.read_bytes()):
                pools.setdefault(mutant.kind, []).append(mutant)
    rng = random.Random(seed)
    drawn: list[Mutant] = []
    while pools and len(drawn) < count:
        kind = rng.choice(sorted(pools))
        mutant = pools[kind].pop(rng.randrange(len(pools[kind])))
        if differs(mutant, (ROOT / mutant.file).read_bytes()):
            drawn.append(mutant)
        pools = {kind: left for kind, left in pools.items() if left}
    return drawn


class Campaign:
    """Mutants in a folder, and what became of those that were tried."""

    def __init__(self, folder: Path, plan: dict) -> None:
        self.folder, self.plan = folder, plan
        self.mutants = [Mutant(**each) for each in plan["mutants"]]
        kept = folder / "results.json"
        self.found: dict[int, dict] = {}
        if kept.exists():
            self.found = {each["number"]: each for each in json.loads(kept.read_text())["mutants"]}

    def forget(self, *outcomes: str) -> None:
        """Try those again that ended so, with the tests as they are now."""
        self.found = {n: each for n, each in self.found.items() if each["outcome"] not in outcomes}
        Tree(ROOT, self.folder).discard()

    def run(self, processes: int, budget: float, limit: float) -> None:
        """Try those that were not yet, until ``budget`` seconds are over; ``limit`` for each."""
        begun = time.monotonic()
        tree = Tree(ROOT, self.folder)
        tree.prepare()
        known = judge.baseline(tree, self.folder)
        waiting = [n for n in range(len(self.mutants)) if n not in self.found]

        def work(worker: int) -> None:
            own = self.folder / f"worker-{worker}"
            own.mkdir(exist_ok=True)
            while waiting and time.monotonic() - begun < budget:
                number = waiting.pop(0)
                mutant = self.mutants[number]
                verdict = judge.judge(mutant, tree, known, own, limit)
                self.found[number] = {"number": number, **asdict(mutant), **asdict(verdict)}
                self._judge_by_hand(self.found[number])
                self._keep()
                count = f"{len(self.found)}/{len(self.mutants)} {verdict.outcome:9}"
                print(f"{count} {verdict.seconds:6.1f} s  {mutant}  [{verdict.by}]", flush=True)

        with ThreadPoolExecutor(processes) as pool:
            for done in [pool.submit(work, worker) for worker in range(processes)]:
                done.result()
        self._keep()

    def counts(self) -> Counter:
        """How many ended how."""
        return Counter(each["outcome"] for each in self.found.values())

    def lines(self) -> list[str]:
        """The table by files, and what survived."""
        rows = [f"| {' | '.join(['file', 'tried', *OUTCOMES])} |", "|---" * 7 + "|"]
        files = sorted({each["file"] for each in self.found.values()})
        for file in [*files, "all"]:
            own = [e for e in self.found.values() if file in ("all", e["file"])]
            counts = Counter(each["outcome"] for each in own)
            numbers = [str(counts[outcome]) for outcome in OUTCOMES]
            rows.append(f"| {' | '.join([file, str(len(own)), *numbers])} |")
        counts = self.counts()
        noticed = counts["killed"] + counts["timed out"]
        decided = noticed + counts["survived"]
        share = f" ({noticed / decided:.1%})" if decided else ""
        rows += [
            "",
            f"seed {self.plan['seed']}: {len(self.mutants)} drawn, {len(self.found)} tried,"
            f" {counts['equivalent']} equivalent, {counts['undecided']} undecided; of the other"
            f" {decided} the tests noticed {noticed}{share}",
        ]
        for outcome in ("survived", "equivalent", "undecided"):
            own = [e for e in self.found.values() if e["outcome"] == outcome]
            if own:
                rows += ["", f"{outcome}:"]
                rows += [f"  {self.mutants[e['number']]}  {e['by']}".rstrip() for e in own]
        return rows

    def _judge_by_hand(self, result: dict) -> None:
        """A survivor that equivalent.toml explains is no fault."""
        list_of = (ROOT / "scripts/mutation/equivalent.toml").read_text(encoding="utf-8")
        source = (self.folder / "base" / result["file"]).read_text(encoding="utf-8")
        shown = {**result, "text": source.splitlines()[result["line"] - 1].strip()}
        for known in tomllib.loads(list_of).get("mutant", []):
            keys = ("file", "text", "before", "after")
            if result["outcome"] == "survived" and all(known[k] == shown[k] for k in keys):
                result["outcome"], result["by"] = "equivalent", known["why"]

    def _keep(self) -> None:
        found = {
            "seed": self.plan["seed"], "modules": self.plan["modules"],
            "drawn": len(self.mutants), "counts": self.counts(),
            "mutants": [self.found[n] for n in sorted(self.found)],
        }  # fmt: skip
        text, new = json.dumps(found, indent=1), self.folder / f"results.{os.getpid()}.new"
        new.write_text(text)
        new.replace(self.folder / "results.json")


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="scripts/mutate", description=__doc__)
    parser.add_argument("modules", nargs="*", default=list(MODULES), help="files and folders")
    parser.add_argument("--count", type=int, default=300, help="mutants to draw")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=ROOT / "results/mutation", help="folder")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--budget", type=float, default=1e6, help="minutes, then it stops")
    parser.add_argument("--limit", type=float, default=1800.0, help="seconds for one mutant")
    parser.add_argument("--list", action="store_true", help="draw, print and try none")
    going_on = parser.add_mutually_exclusive_group()
    going_on.add_argument("--resume", action="store_true", help="go on with the one in --out")
    going_on.add_argument(
        "--again", action="store_true", help="the same, and survivors with the tests of now"
    )
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
