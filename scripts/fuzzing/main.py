"""Mutated scenario files and bad command lines: none may end in a traceback, hang or fill memory.

Inputs follow from the seed and their number alone; --file and --line repeat one.
"""

import argparse
import json
import re
import sys
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import command_lines
import scenarios
import worker

LONGEST_REFUSAL = 400
SHOWN = 40


def main() -> int:
    """Run, print what was found; 1 if that is anything."""
    options = _options()
    if options.file is not None:
        what, contents = scenarios.mutated(options.seed, options.file)
        Path("fuzzed.toml").write_bytes(contents)
        print(f"{what}: fuzzed.toml, for", *command_lines.on_file(options.seed, options.file))
        return 0
    if options.line is not None:
        print(*map(repr, command_lines.bad(options.seed, options.line)))
        return 0
    jobs = [("file", index) for index in range(options.first, options.first + options.files)]
    jobs += [("line", index) for index in range(options.first, options.first + options.lines)]
    started = time.perf_counter()
    rows = campaign(jobs, options.seed, options.processes)
    found = [row for row in rows if row["wrong"]]
    print("\n".join([*report(rows), "", f"{time.perf_counter() - started:.0f} s"]))
    if options.out:
        kept = {"seed": options.seed, "inputs": len(rows), "found": found}
        options.out.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    return 1 if found else 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="scripts/fuzz", description=__doc__)
    parser.add_argument("--files", type=int, default=5000, help="mutated scenario files")
    parser.add_argument("--lines", type=int, default=500, help="bad command lines")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0, help="number of the first of each")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--out", type=Path, help="JSON file for what was found")
    parser.add_argument("--file", type=int, help="write this mutated file, and nothing else")
    parser.add_argument("--line", type=int, help="print this command line, and nothing else")
    return parser.parse_args()


def campaign(jobs: list[tuple[str, int]], seed: int, processes: int) -> list[dict[str, Any]]:
    """What each input did, and what is wrong with that."""
    waiting: SimpleQueue[tuple[str, int]] = SimpleQueue()
    for job in jobs:
        waiting.put(job)
    rows: list[dict[str, Any]] = []

    def work() -> None:
        with worker.Worker(scenarios.companions()) as process:
            while not waiting.empty():
                rows.append(one(process, *waiting.get(), seed))
                if rows[-1]["wrong"]:
                    print(f"{told(rows[-1])}: {_cause(rows[-1]['err'])}", file=sys.stderr)
                if len(rows) % 100 == 0:
                    print(f"{len(rows)} of {len(jobs)}", file=sys.stderr)

    with ThreadPoolExecutor(processes) as pool:
        for running in [pool.submit(work) for _ in range(processes)]:
            running.result()
    return sorted(rows, key=lambda row: (row["kind"], row["index"]))


def one(process: worker.Worker, kind: str, index: int, seed: int) -> dict[str, Any]:
    """One input; if it takes too long once more, since a first run compiles."""
    if kind == "file":
        what, contents = scenarios.mutated(seed, index)
        words = command_lines.on_file(seed, index)
    else:
        what, contents = "line", scenarios.bases()["velocity-sync"].encode()
        words = command_lines.bad(seed, index)
    done = process.run(words, contents, limit=worker.LIMIT)
    if done["interrupted"] and not asked_to_be_long(done):
        process.run(words, contents, limit=worker.WARM)
        done = process.run(words, contents, limit=worker.LIMIT)
    shown = " ".join(word if len(word) < 60 else word[:57] + "..." for word in words)
    row = {"kind": kind, "index": index, "what": what, "words": shown, **done}
    return row | {
        "wrong": judged(done, words),
        "out": done["out"][:500],
        "err": done["err"][-1500:],
    }


def asked_to_be_long(done: dict[str, Any]) -> bool:
    """Whether it ended after Ctrl-C as a run does that was going well."""
    if not done["interrupted"] or done["ended"]:
        return False
    told = done["out"] + done["err"]  # `map` tells on stderr how many cells were done
    stopped = "interrupted" in done["out"] or "stopped" in told
    return done["code"] == 0 or (done["code"] == 1 and stopped)


def judged(done: dict[str, Any], words: list[str]) -> str:
    """What is wrong, in a word or two; nothing if all is well."""
    said = done["out"] + done["err"]
    if done["ended"] == "died":
        return f"died with {done['code']}"
    if "Traceback (most recent call last)" in said:
        return "traceback"
    if "not enough memory" in said or done["memory"] > worker.MOST_MEMORY:
        return "memory"
    if done["interrupted"] and not asked_to_be_long(done):
        return "time"
    if done["code"] not in (0, 1, 2):
        return f"exit status {done['code']}"
    lines = [line for line in done["err"].splitlines() if line.strip()]
    if any(not line.startswith("gne-mj: ") for line in lines):
        return "other words"
    if any(len(line) > LONGEST_REFUSAL for line in lines):
        return "long refusal"
    if done["code"] == 2 and len(lines) != 1:
        return "not one sentence"
    failed = done["code"] == 1 and done["err"].startswith("gne-mj: user_code_failed: ")
    if done["code"] != 2 and not done["said"] and not failed:
        return f"exit status {done['code']} without a result"
    if "--json" in words and done["code"] == 0 and len(done["out"]) < worker.KEPT:
        return "" if _is_json(done["out"]) else "no JSON"
    return ""


def _is_json(text: str) -> bool:
    try:
        json.loads(text)
    except ValueError:
        return False
    return True


def report(rows: list[dict[str, Any]]) -> list[str]:
    """A table of how inputs ended, and what is wrong."""
    lines = [
        "| inputs | all | exit 0 | exit 1 | exit 2 | long | wrong |",
        "|---|---|---|---|---|---|---|",
    ]
    for kind in ("file", "line"):
        own = [row for row in rows if row["kind"] == kind]
        codes = [sum(row["code"] == code for row in own) for code in (0, 1, 2)]
        long = sum(asked_to_be_long(row) for row in own)
        wrong = sum(bool(row["wrong"]) for row in own)
        cells = (f"{kind}s", len(own), *codes, long, wrong)
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    found = [row for row in rows if row["wrong"]]
    groups = Counter((row["wrong"], _cause(row["err"])) for row in found)
    lines += [
        "",
        *(f"{count} x {wrong}: {cause}" for (wrong, cause), count in groups.most_common()),
    ]
    lines += map(told, found[:SHOWN])
    most = max((row["memory"] for row in rows), default=0) / worker.GIB
    slowest = max((row["seconds"] for row in rows), default=0.0)
    return [*lines, f"most memory {most:.2f} GiB, longest {slowest:.1f} s"]


def told(row: dict[str, Any]) -> str:
    """One input that did what it should not, and how to repeat it."""
    head = f"--{row['kind']} {row['index']}: {row['wrong']}, {row['seconds']:.1f} s"
    return f"{head}; {row['what']}; {row['words']}"


def _cause(err: str) -> str:
    """The last line, and of a traceback where in the package it was."""
    lines = err.strip().splitlines() or [""]
    places = re.findall(r'File ".*?(?:gne_mj|controllers)/(\S+?)", line (\d+)', err)
    return f"{lines[-1][:150]} {':'.join(places[-1]) if places else ''}"


if __name__ == "__main__":
    sys.exit(main())
