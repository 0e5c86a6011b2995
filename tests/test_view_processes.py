"""A page's server ends with the process that simulates, however that ends; nothing is left."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from urllib.error import HTTPError
from urllib.parse import urlparse
from urllib.request import urlopen

import psutil
import pytest
from commands import hearing_hangups

from gne_mj.trajectory import Trajectory

GNE = [
    sys.executable,
    "-c",
    "import sys; from gne_mj.cli import main; sys.argv[0] = 'gne-mj'; main()",
]
LIVE = [*GNE, "run", "velocity-sync", "--view", "--now", "--set", "simulation.duration=1000"]

# A program of the user's own that serves a replay, and then ends in its own way
OWN = """
import os, signal, sys, time
import gne_mj
from gne_mj.viewer import serve
server = serve(gne_mj.run("velocity-sync", {"simulation.duration": 0.1, "plant.engine": "ode"}))
print("view", server.url, file=sys.stderr, flush=True)
sys.stdin.readline()
"""


@pytest.fixture
def start():
    """Starts a program in a session of its own and waits for the page's address."""
    started = []

    def begin(command):
        with hearing_hangups():
            process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                text=True, start_new_session=True,
            )  # fmt: skip
        started.append(process)
        for line in process.stderr:
            if line.startswith("view"):
                return process, line.split()[1]
        raise AssertionError(process.communicate())

    yield begin
    for process in started:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


def assert_gone(process, url, within=20.0):
    """No process of its session is left, and nobody listens, so many seconds later."""
    end = time.monotonic() + within
    while time.monotonic() < end:
        left = [p for p in psutil.process_iter() if session_of(p) == process.pid and alive(p)]
        if process.poll() is not None and not left and not listens(url):
            return
        time.sleep(0.05)
    raise AssertionError((process.poll(), left, listens(url)))


def session_of(process):
    try:
        return os.getsid(process.pid)
    except OSError:
        return None


def alive(process):
    try:
        return process.status() != psutil.STATUS_ZOMBIE
    except psutil.Error:
        return False


def listens(url):
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", urlparse(url).port)) == 0


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGKILL, signal.SIGINT])
def test_a_live_page_ends_with_its_command(start, number):
    process, url = start(LIVE)
    assert b"settings" in urlopen(url, timeout=5).read()
    children = psutil.Process(process.pid).children(recursive=True)
    assert children == []  # it needs no other process in the first place
    process.send_signal(number)
    assert_gone(process, url)  # what was simulated is judged and told before, but for SIGKILL
    assert process.returncode == (-number if number == signal.SIGKILL else 1)


@pytest.mark.parametrize(
    ("ending", "code"),
    [
        ("", 0),
        ("os._exit(4)", 4),
        ("os.kill(os.getpid(), signal.SIGKILL)", -9),
        pytest.param("raise RuntimeError('of its own')", 1, marks=pytest.mark.slow),
        pytest.param("sys.exit(3)", 3, marks=pytest.mark.slow),
        pytest.param("os.kill(os.getpid(), signal.SIGTERM)", -15, marks=pytest.mark.slow),
    ],
)
def test_a_replay_ends_with_its_program(start, ending, code):
    process, url = start([sys.executable, "-c", OWN + ending])
    assert b"settings" in urlopen(url, timeout=5).read()
    process.stdin.write("\n")
    process.stdin.flush()
    assert_gone(process, url)
    assert process.returncode == code


def test_ctrl_c_keeps_what_was_simulated(start, tmp_path):
    out = tmp_path / "run"
    process, url = start([*LIVE, "--out", str(out), "--json"])
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    report = json.loads(process.stdout.read())  # until it has ended
    assert report["status"] == "interrupted"
    assert_gone(process, url)
    assert process.returncode == 1
    assert 0 < Trajectory.load(out / "trajectory.zarr")["robots"]["time"][-1] < 60


def test_a_page_outlives_its_run_until_ctrl_c(start):
    short = ["velocity-sync", "--view", "--now", "--speed", "max", "--set", "simulation.duration=1"]
    process, url = start([*GNE, "run", *short, "--json"])
    report = ""
    while not report.endswith("\n}\n"):
        report += process.stdout.readline()
    assert json.loads(report)["status"] == "completed"
    end = time.monotonic() + 10
    while True:
        try:
            assert urlopen(url + "replay", timeout=5).read()
            break
        except HTTPError:  # it is made after the report
            assert time.monotonic() < end
            time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    assert_gone(process, url)
    assert process.returncode == 0
