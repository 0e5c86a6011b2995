"""What is compiled ahead: everything that first runs of the shipped kinds need."""

import os
import subprocess
import sys

import pytest
from commands import environment, gne_here

from gne_mj import precompile
from gne_mj.loops.lane_batch import LaneLoop
from gne_mj.scenario import load_scenario, shipped

# Runs each scenario in a process of its own, and prints what that compiles
PROGRAM = """
import sys
from numba.core import event
from numba.core.ccallback import CFunc
import gne_mj

class Listener(event.Listener):
    def on_start(self, event):
        print(event.data["dispatcher"].py_func.__qualname__)

    def on_end(self, event):
        pass

event.register("numba:compile", Listener())
compile_uncached = CFunc._compile_uncached

def noted(self):
    print(self._pyfunc.__qualname__)
    return compile_uncached(self)

CFunc._compile_uncached = noted
gne_mj.run(sys.argv[1], {"simulation.duration": 0.1}).report()
print("done")
"""


def test_all_kinds_are_among_the_runs():
    built = [
        system
        for each in precompile.runs()
        for system in load_scenario(*each).simulation_object().systems
    ]
    assert {system.mode for system in built} == {"continuous", "sampled", "implicit"}
    assert {system.engine for system in built} == {"mujoco", "ode"}
    assert {system.law.information for system in built} == {"full", "partial", "distributed"}
    assert {system.decentralised for system in built} == {True, False}


def test_the_batches_are_long_enough_for_lanes(monkeypatch):
    begun = []
    monkeypatch.setattr(LaneLoop, "__init__", lambda self, modules, *_: begun.append(modules))
    monkeypatch.setattr(LaneLoop, "fits", lambda self, blocks: False)
    for each in precompile.batches():
        precompile._run_batch(*each)
    assert len(begun) == len(precompile.batches()) > 0


def test_the_command_says_how_much(monkeypatch):
    monkeypatch.setattr(precompile, "runs", lambda: [("velocity-sync", {"plant.engine": "ode"})])
    monkeypatch.setattr(precompile, "batches", list)
    done = gne_here("precompile", "--processes", "1")
    assert (done.returncode, done.stdout) == (0, "compiled what 1 kinds of runs need\n")


@pytest.mark.slow
def test_no_first_run_of_a_shipped_scenario_compiles(tmp_path):
    kept = {**environment(), "NUMBA_CACHE_DIR": str(tmp_path / "kept")}
    if "PYTHONPATH" in os.environ:
        kept["PYTHONPATH"] = os.environ["PYTHONPATH"]
    command = [sys.executable, "-c", "from gne_mj.cli import main; main()", "precompile"]
    subprocess.run(command, env=kept, check=True, capture_output=True)
    for name in shipped():
        told = subprocess.run(
            [sys.executable, "-c", PROGRAM, name],
            env=kept, check=True, capture_output=True, text=True,
        ).stdout  # fmt: skip
        assert told == "done\n", name
