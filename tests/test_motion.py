"""Games whose numbers move, against SciPy with the same right-hand sides in time."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from gne_mj.errors import InvalidInput
from gne_mj.motion import motion_of
from gne_mj.scenario import load_scenario, run

RAMP = {"type": "ramp", "from": 3.0, "to": 5.0, "start": 1.0, "rate": 0.5}
SWING = {"type": "sine", "mean": 2.5, "amplitude": 0.4, "period": 2.0}
RHO = 0.1


def moving(mode="continuous", **game):
    """Three integrators in a line whose reference and second bound move."""
    return {
        "simulation": {"duration": 3.0, "timestep": 0.01},
        "recording": {"period": 0.1},
        "systems": {
            "a": {
                "game": {
                    "type": "velocity-synchronization",
                    "reference_velocity": RAMP,
                    "gap_bound": [3.0, SWING, 3.0],
                    **game,
                },
                "agents": {"type": "integrator", "count": 3},
                "initial": {"action": [1.0, 0.0, 2.0]},
                "controller": {"mode": mode},
            }
        },
    }


def numbers(t):
    """v_0 and the bounds, as the tables above say."""
    v_0 = 3.0 + 0.5 * np.clip(t - 1.0, 0.0, 4.0)
    return v_0, np.array([3.0, 2.5 + 0.4 * np.sin(np.pi * t), 3.0])


def pull(t, y):
    """F + grad phi."""
    v_0, bounds = numbers(t)
    gaps = np.diff(y, prepend=v_0)
    pushes = 2.0 * RHO * gaps / (bounds**2 - gaps**2)
    return 2.0 * gaps + pushes - np.append(pushes[1:], 0.0)


def exact(times):
    """The same run by SciPy, its kink at a second's end."""
    found = solve_ivp(
        lambda t, y: -pull(t, y), (0.0, 3.0), [1.0, 0.0, 2.0],
        rtol=1e-10, atol=1e-12, t_eval=times, max_step=0.02,
    )  # fmt: skip
    return found.y.T


@pytest.mark.parametrize("integrator", ["rk4", "tsit5"])
def test_a_run_in_continuous_time_is_that_of_the_moving_right_hand_side(integrator):
    data = run(moving(), {"a.plant.integrator": integrator, "simulation.rtol": 1e-9})["a"]
    np.testing.assert_allclose(data.action, exact(data.time), atol=2e-7)
    bounds = np.array([numbers(t)[1] for t in data.time.to_numpy()])
    gaps = np.diff(data.action, axis=1, prepend=[[numbers(t)[0]] for t in data.time.to_numpy()])
    np.testing.assert_allclose(data.gap, gaps, atol=1e-12)
    np.testing.assert_allclose(data.gap_bound, bounds, atol=1e-12)
    np.testing.assert_allclose(data.constraint, gaps**2 - bounds**2, atol=1e-11)
    for y, t in zip(data.equilibrium.to_numpy(), data.time.to_numpy(), strict=True):
        np.testing.assert_allclose(pull(t, y), 0.0, atol=1e-8)


def test_an_input_that_is_held_is_that_of_its_instant():
    data = run(moving("sampled"))["a"]
    y = np.array([1.0, 0.0, 2.0])
    for k in range(300):
        y = y - 0.01 * pull(0.01 * k, y)
    np.testing.assert_allclose(data.action[-1], y, atol=1e-12)


def test_mode_implicit_takes_game_and_constraints_at_the_periods_end():
    data = run({**moving("implicit"), "simulation": {
        "duration": 3.0, "timestep": 0.01, "control_period": 0.1}})["a"]  # fmt: skip
    y = data.action.to_numpy()
    for k in range(30):
        u = data.input.to_numpy()[k]
        np.testing.assert_allclose(y[k + 1], y[k] + 0.1 * u, atol=1e-12)
        np.testing.assert_allclose(u, -pull(0.1 * (k + 1), y[k + 1]), atol=1e-7)


def budget(value, **about):
    """One agent that wants 5 and may have less, a moving number, as a game of expressions."""
    return {
        "simulation": {"duration": 2.0, "timestep": 0.01, "control_period": 0.05},
        "recording": {"period": 0.05},
        "systems": {
            "a": {
                "game": {
                    "type": "expressions", "cost": "(y[i] - 5)**2",
                    "constraints": {"budget": "y[0] <= p.most", "floor": "-10 <= y[0]"},
                    "parameters": {"most": value},
                },
                "agents": {"type": "integrator", "count": 1},
                "initial": {"action": [0.0]},
                **about,
            }
        },
    }  # fmt: skip


def test_games_of_expressions_move_and_tables_bounds_are_kept():
    falls = {"type": "table", "times": [0.0, 1.0, 1.5], "values": [4.0, 4.0, 3.0]}
    data = run(budget(falls))["a"]
    most = np.interp(data.time, [0.0, 1.0, 1.5], [4.0, 4.0, 3.0])
    assert np.all(data.action[:, 0] < most)
    for y, top in zip(data.equilibrium[:, 0].to_numpy(), most, strict=True):
        slope = lambda x, top=top: 2 * (x - 5) + RHO / (top - x) - RHO / (x + 10)  # noqa: E731
        assert y == pytest.approx(brentq(slope, -9.0, top - 1e-9, xtol=1e-13), abs=1e-9)


def test_a_bound_that_moves_past_the_outputs_ends_the_run_with_the_time():
    falls = {"type": "ramp", "from": 4.0, "to": 3.0, "start": 1.0, "rate": 4.0}
    trajectory = run(budget(falls, controller={"mode": "implicit"}))
    report = trajectory.reports["a"]
    assert report["status"] == "bound_moved_past"
    assert "'budget' moves past the present outputs" in report["message"]
    assert 1.0 <= report["exit"]["time"] < 1.25


def test_a_function_of_python_moves_a_number():
    def most(t):
        return 4.0 - 0.2 * t

    data = run(budget(most))["a"]
    same = run(budget({"type": "ramp", "from": 4.0, "to": 3.6, "rate": 0.2}))["a"]
    np.testing.assert_allclose(data.action, same.action, atol=1e-12)


def test_a_functions_file_is_found_beside_the_scenario(tmp_path):
    (tmp_path / "wishes.py").write_text("def most(t):\n    return 4.0 - 0.2 * t\n")
    (tmp_path / "own.toml").write_text(
        """
        [simulation]
        duration = 0.1
        timestep = 0.01
        [systems.a.game]
        type = "expressions"
        cost = "(y[i] - 5)**2"
        constraints = {budget = "y[0] <= p.most", floor = "-10 <= y[0]"}
        parameters = {most = {type = "function", file = "wishes.py", function = "most"}}
        [systems.a.agents]
        type = "integrator"
        count = 1
        """
    )
    scenario = load_scenario(str(tmp_path / "own.toml"))
    game = scenario.system_objects()[0].game
    assert motion_of(game).at(1.0).constraints([0.0])[0] == pytest.approx(-3.8)
    again = load_scenario(scenario.model_dump(mode="json", exclude_none=True))
    assert again == scenario
    assert again.systems["a"].game.moving == ("parameters.most",)


@pytest.mark.parametrize(
    ("game", "key", "words"),
    [
        ({"gap_bound": {"type": "ramp", "from": 1.5, "to": -1.0, "rate": 1.0}},
         "systems.a.game.gap_bound", "at 2.5 s"),
        ({"gap_bound": {"type": "ramp", "from": 1.0, "to": 2.0, "rate": 0.0}},
         "systems.a.game.gap_bound.rate", "greater than 0"),
        ({"gap_bound": {"type": "table", "times": [0, 0], "values": [1, 2]}},
         "systems.a.game.gap_bound.times", "rise"),
        ({"gap_bound": {"type": "sine", "mean": 1.0, "amplitud": 0.1, "period": 1.0}},
         "systems.a.game.gap_bound.amplitud", "'amplitude'"),
    ],
)  # fmt: skip
def test_what_cannot_be_a_number_is_refused_by_its_key(game, key, words):
    with pytest.raises(InvalidInput) as error:
        load_scenario(moving(**game)).system_objects()
    assert error.value.key == key
    assert words in str(error.value)


def test_a_set_without_interior_is_refused_before_the_run_with_the_time():
    meets = {"type": "ramp", "from": 4.0, "to": -11.0, "start": 0.5, "rate": 15.0}
    with pytest.raises(InvalidInput, match=r"interior at all times of the run; at 1\.4"):
        load_scenario(budget(meets)).simulation_object()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"margin": {"push": 1.0}, "controller.mode": "implicit"}, "no margin is known"),
        ({"game.dimension": {"type": "constant", "value": 1.0}}, "without changing who"),
    ],
)
def test_what_is_not_for_games_that_move_says_so(changes, words):
    with pytest.raises(InvalidInput, match=words):
        load_scenario(budget({"type": "ramp", "from": 4.0, "to": 3.6, "rate": 0.2}),
                      changes).system_objects()  # fmt: skip


def test_a_run_that_moves_stays_as_it_is():
    simulation = load_scenario(moving()).simulation_object()
    with pytest.raises(InvalidInput, match="stays as it is"):
        simulation.change({"barrier.rho": 0.2})
