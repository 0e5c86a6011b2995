"""The fuzzer: inputs follow from seeds, and what is wrong is called so."""

import importlib
import sys
import tomllib
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent.parent / "scripts/fuzzing"
NAMES = ("scenarios", "command_lines", "worker")


@pytest.fixture(scope="module")
def fuzz():
    """The modules, by their names."""
    sys.path.insert(0, str(FOLDER))
    before = {name: sys.modules.pop(name, None) for name in (*NAMES, "main")}
    found = {name: importlib.import_module(name) for name in (*NAMES, "main")}
    yield found
    sys.path.remove(str(FOLDER))
    for name, module in before.items():
        del sys.modules[name]
        if module is not None:
            sys.modules[name] = module


def test_inputs_follow_from_the_seed(fuzz):
    files, lines = fuzz["scenarios"], fuzz["command_lines"]
    for index in range(30):
        assert files.mutated(1, index) == files.mutated(1, index)
        assert lines.bad(1, index) == lines.bad(1, index)
        assert lines.on_file(1, index) == lines.on_file(1, index)
    assert len({files.mutated(seed, 0)[1] for seed in range(20)}) == 20
    done = {what.split(": ")[1].split(", ")[0] for what, _ in map(files.mutated, [0] * 400,
                                                                  range(400))}  # fmt: skip
    assert done == {each.__name__ for each in (*files.VALUES, *files.TEXT)}


def test_files_without_a_mutation_are_right(fuzz):
    files = fuzz["scenarios"]
    for text in files.bases().values():
        tables = tomllib.loads(text)
        assert tables["simulation"]["duration"] == 0.2
        assert tomllib.loads(files.written(tables)) == tables


def test_verdicts(fuzz):
    judged = fuzz["main"].judged
    well = {"code": 0, "out": "{}", "err": "", "ended": "", "interrupted": False, "memory": 0,
            "said": True, "seconds": 1.0}  # fmt: skip
    words = ["run", "PATH", "--json"]
    refused = well | {"code": 2, "err": "gne-mj: key: got 1, but it must be 2\n"}
    for change, wanted in (
        ({}, ""),
        ({"code": 1, "out": '{"status": "interrupted"}', "interrupted": True}, ""),
        ({"code": 130, "interrupted": True}, "time"),
        ({"ended": "died", "code": -11}, "died with -11"),
        ({"err": "Traceback (most recent call last):\n  ..."}, "traceback"),
        ({"err": "gne-mj: there is not enough memory for this\n", "code": 1}, "memory"),
        ({"memory": 5 * 2**30}, "memory"),
        ({"code": 3}, "exit status 3"),
        ({"err": "RuntimeWarning: overflow\n"}, "other words"),
        ({"out": "", "said": False}, "exit status 0 without a result"),
        ({"out": "words"}, "no JSON"),
    ):
        assert judged(well | change, words) == wanted
    assert judged(refused, words) == ""
    assert judged(refused | {"err": refused["err"] * 2}, words) == "not one sentence"
    assert judged(refused | {"err": "gne-mj: " + "x" * 400}, words) == "long refusal"


def test_a_process_that_answers(fuzz):
    worker = fuzz["worker"]
    with worker.Worker([]) as process:
        refused = process.run(["run", "PATH"], b"nothing", limit=60.0)
        assert refused["code"] == 2
        assert refused["err"].startswith("gne-mj: SCENARIO: got 'input.toml'")
        assert 0 < refused["memory"] < worker.MOST_MEMORY
        listed = process.run(["scenarios"], limit=60.0)
        assert listed["code"] == 0
        assert "velocity-sync" in listed["out"]
        assert process.folder.is_dir()
    assert not process.folder.exists()
