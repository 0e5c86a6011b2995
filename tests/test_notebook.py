"""What a notebook shows of a trajectory."""

import subprocess
import sys

import pytest

import gne_mj
from gne_mj.errors import InvalidInput
from gne_mj.notebook import notebook_html, replay_html
from gne_mj.simulation import Simulation
from gne_mj.summary import summary

SHORT = {"simulation.duration": 0.5, "plant.engine": "ode"}


def test_it_shows_a_table_and_figures_and_the_replay_when_asked():
    trajectory = gne_mj.run("velocity-sync", SHORT)
    html = notebook_html(trajectory)
    assert html.count("<table>") == 1
    for key, value in summary(trajectory.reports["robots"]).items():
        assert f">{key}</th>" in html
        assert value.replace("'", "&#x27;").replace("<", "&lt;") in html
    assert html.count("<img") == 3
    assert 2 * len(html) < 400_000, "shown twice"
    replay = trajectory.replay()._repr_html_()
    assert replay.count("<iframe") == replay.count("</iframe>") == 1
    inside = replay.split('srcdoc="')[1].split('"')[0]
    assert "&lt;script" in inside
    assert repr(trajectory) == f"<Trajectory of robots: {trajectory.status}>"


def test_without_a_scenario_there_is_no_replay():
    from builders import FIVE, clock, robot_state, robot_system

    trajectory = Simulation([robot_system(robot_state(FIVE))], clock(0.01, 0.1)).run()
    assert "<table>" in notebook_html(trajectory)
    with pytest.raises(InvalidInput, match="of no scenario"):
        replay_html(trajectory)


PROGRAM = """
from IPython.core.interactiveshell import InteractiveShell
shell = InteractiveShell.instance()
import gne_mj
trajectory = gne_mj.run("velocity-sync", {"simulation.duration": 0.5, "plant.engine": "ode"})
formats, _ = shell.display_formatter.format(trajectory)
assert "<img" in formats["text/html"], list(formats)
assert formats["text/plain"].startswith("<Trajectory of robots")
"""


@pytest.mark.slow
def test_ipython_is_told_when_the_package_is_imported():
    subprocess.run([sys.executable, "-W", "ignore", "-c", PROGRAM], check=True, timeout=120)
