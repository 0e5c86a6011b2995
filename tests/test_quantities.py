"""What games derive from their actions: recorded and drawn without any code for that game."""

from dataclasses import replace

import coupled_game
import numpy as np
import pytest
from builders import clock, integrators

from gne_mj import plots
from gne_mj.controllers import FullInformation
from gne_mj.errors import InvalidInput
from gne_mj.game_model import Game
from gne_mj.quantity import Quantity
from gne_mj.scenario import load_scenario
from gne_mj.simulation import Simulation
from gne_mj.system import System
from gne_mj.trajectory import Trajectory

LENGTH = Quantity(
    "squared_length", "squared length", "km^2", lambda y: np.sum(y**2, axis=1), bound=4.0
)
SHARE = Quantity(
    "share", "share of the first", "", lambda y: y[:, [0, 2, 3]] / 10, each="agent",
    symbol="s_i", bound=[1.0, 2.0, 2.0], lower_bound=-1.0,
)  # fmt: skip
SLACK = Quantity("slack", "slack", "km^2", lambda y: y[:, :2] ** 2, each="constraint")


def game(*quantities, **others):
    return Game(
        name="coupled",
        kernels=coupled_game,
        parameters=np.array([0.3]),
        sizes=coupled_game.SIZES,
        in_cost=[[0, 1, 2]] * 3,
        in_constraint=coupled_game.IN_CONSTRAINT,
        constraint_names=("length", "product"),
        action_name="place",
        action_unit="km",
        quantities=quantities,
        **others,
    )


def simulate(game):
    start = np.array([[0.5], [-0.4], [0.3], [0.2]])
    system = System("points", game, integrators(4), FullInformation(), 0.05, start)
    return Simulation([system], clock(0.01, 0.5, sample=0.1)).run()


@pytest.fixture(scope="module")
def trajectory():
    return simulate(game(LENGTH, SHARE, SLACK))


@pytest.mark.parametrize(
    "name", ["input", "state", "time", "agent", "axis", "squared_length_bound"]
)
def test_a_name_that_results_have_already_is_refused_before_the_run(name):
    own = replace(SLACK, name=name)
    with pytest.raises(InvalidInput, match=f"systems.points: got '{name}', but results have"):
        simulate(game(LENGTH, own))


def test_all_are_recorded(trajectory, tmp_path):
    loaded = Trajectory.load(trajectory.save(tmp_path / "run"))["points"]
    y = loaded["action"].to_numpy()
    assert loaded["squared_length"].dims == ("time",)
    assert np.array_equal(loaded["squared_length"], np.sum(y**2, axis=1))
    assert float(loaded["squared_length_bound"]) == 4.0
    assert loaded["squared_length"].attrs["units"] == "km^2"
    assert loaded["share"].dims == ("time", "agent")
    assert loaded["share_bound"].to_numpy().tolist() == [1.0, 2.0, 2.0]
    assert loaded["share_lower_bound"].to_numpy().tolist() == [-1.0] * 3
    assert loaded["slack"].dims == ("time", "constraint")
    assert "slack_bound" not in loaded
    assert loaded["owner"].to_numpy().tolist() == [1, 1, 2, 3]
    assert loaded["axis"].to_numpy().tolist() == ["1", "2", "1", "1"]


def test_all_are_drawn(trajectory):
    figures = plots.draw(trajectory)
    assert set(figures) == {
        "points-places", "points-squared-length", "points-shares", "points-slacks",
        "points-constraints",
    }  # fmt: skip
    first, second = figures["points-places"].axes
    assert (len(first.get_lines()), len(second.get_lines())) == (3, 1)
    assert first.get_ylabel() == "place $y_{i,1}$ (km)"
    # agent 1 looks alike in both panels
    assert first.get_lines()[0].get_color() == second.get_lines()[0].get_color()
    legend = figures["points-places"].legends[0]
    assert legend.get_title().get_text() == "agent"
    assert [text.get_text() for text in legend.get_texts()] == ["1", "2", "3"]

    (length,) = figures["points-squared-length"].axes
    assert [line.get_ydata()[0] for line in length.get_lines()[1:]] == [4.0]
    assert length.get_ylabel() == "squared length (km^2)"

    (shares,) = figures["points-shares"].axes
    lines = shares.get_lines()
    bounds = {line.get_ydata()[0]: line.get_color() for line in lines[3:]}
    assert set(bounds) == {1.0, 2.0, -1.0}
    assert bounds[1.0] == lines[0].get_color()  # the first agent's alone
    assert bounds[2.0] == bounds[-1.0] == "black"
    assert shares.get_ylabel() == "share of the first $s_i$"

    names = [text.get_text() for text in figures["points-slacks"].legends[0].get_texts()]
    assert names == ["length", "product"]


def test_names_of_axes_are_the_games(trajectory):
    named = game(axes=("east", "north"))
    assert named.axis_of_action == ("east", "north", "east", "east")
    panels = plots.draw(simulate(named))["points-places"].axes
    assert [panel.get_ylabel() for panel in panels] == [
        "place $y_{i,east}$ (km)", "place $y_{i,north}$ (km)"
    ]  # fmt: skip


FILE = """
from test_quantities import LENGTH, game as coupled

def game(count):
    return coupled(LENGTH)
"""


def test_a_file_of_ones_own_with_actions_of_unequal_sizes(tmp_path):
    (tmp_path / "coupled.py").write_text(FILE)
    tables = {
        "simulation": {"duration": 0.5, "timestep": 0.01},
        "recording": {"period": 0.1},
        "systems": {
            "points": {
                "game": {"type": "custom", "file": str(tmp_path / "coupled.py")},
                "agents": {"type": "integrator", "count": 3, "input_limit": [[9, 8], [7], [6]]},
                "barrier": {"rho": 0.05},
                "initial": {"action": [[0.5, -0.4], [0.3], [0.2]]},
            }
        },
    }
    built = load_scenario(tables).simulation_object()
    assert built.systems[0].agents.input_limit.tolist() == [9, 8, 7, 6]
    done = built.run()
    assert np.array_equal(done["points"]["action"], simulate(game(LENGTH))["points"]["action"])
    assert set(plots.draw(done)) == {
        "points-places", "points-squared-length", "points-constraints",
    }  # fmt: skip
    for wrong in ([0.5, -0.4, 0.3, 0.2], [[0.5], [-0.4, 0.3], [0.2]], [[0.5, -0.4], [0.3]]):
        tables["systems"]["points"]["initial"]["action"] = wrong
        with pytest.raises(InvalidInput, match=r"initial\.action: .* a list of 3 lists"):
            load_scenario(tables).simulation_object()
    tables["systems"]["points"]["agents"] = {"type": "flexible-robot", "count": 3}
    with pytest.raises(InvalidInput, match=r"agents\.type: .*1 axis, and .* actions have 2"):
        load_scenario(tables).simulation_object()


@pytest.mark.parametrize(
    ("quantity", "words"),
    [
        (replace(LENGTH, each="agent"), "squared_length.*must be .1, 3."),
        (replace(SHARE, each=""), "share.*must be .1,."),
        (replace(SLACK, values=lambda y: y), "slack.*must be .1, 2."),
        (replace(SHARE, bound=[1.0, 2.0]), "^game.quantities.share.bound.*one number or .3,."),
        (replace(LENGTH, lower_bound=[0.0]), "squared_length.lower_bound.*one number"),
    ],
)
def test_wrong_shapes_are_found_before_a_run(quantity, words):
    with pytest.raises(InvalidInput, match=words):
        simulate(game(quantity))


def test_what_they_may_belong_to():
    with pytest.raises(InvalidInput, match=r"^each: got 'link'"):
        replace(SHARE, each="link")


def test_a_value_beyond_all_floats_is_infinite_without_a_warning():
    quantity = Quantity("size", "size", "m", lambda y: np.linalg.norm(y, axis=1))
    assert quantity.at(np.array([[1e300, 1e300], [3.0, 4.0]]), ()).tolist() == [np.inf, 5.0]
