"""Single lines that no other test would miss: scales of tolerances, ends of searches, sentences."""

import os
import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from batch_plans import ODE, all_chunks
from builders import FIVE, clock, integrators, robot_state, robot_system, run_loop
from own_games import boxed, plain_game

from gne_mj import certificate, user_files
from gne_mj.batches import make_plan
from gne_mj.controllers import FullInformation, settings
from gne_mj.cores import cores
from gne_mj.errors import InvalidInput
from gne_mj.faults import Push
from gne_mj.games import edges
from gne_mj.games.platoon import _check_monotone
from gne_mj.graph import ring
from gne_mj.loops import division, newton
from gne_mj.loops.base import Samples
from gne_mj.loops.batch import Case, EachLoop, Span
from gne_mj.margins import is_affine
from gne_mj.system import System
from gne_mj.system.steps import largest_step
from gne_mj.theory import Slopes, assumptions, convexity, search_push, theorem, trials
from gne_mj.theory.assumption import MET, UNKNOWN
from gne_mj.theory.gain import Gain, decay_rate
from gne_mj.theory.verdict import _limit

# ------------------------------------------------------------------------------------- convexity


def test_an_own_cost_that_is_flat_in_a_direction_is_convex():
    """J_1 = s (a'y_1)^2 / 2: rounding makes s aa' look indefinite, though J_1 is convex."""
    scale, a = 1e9, np.array([1.0, 0.7])

    def second(q, i, b, y, weight, out):
        if i == 0:
            out[:2] += weight * scale * a[b] * a
        else:
            out[2] += weight

    functions = {
        "cost": lambda q, i, y: y[2] ** 2 / 2 if i else 0.5 * scale * (a @ y[:2]) ** 2,
        "cost_gradient": lambda q, i, b, y: y[2] if i else scale * a[b] * (a @ y[:2]),
        "add_cost_hessian": second,
        "constraint": lambda q, k, y: y @ y - 9.0,
        "constraint_gradient": lambda q, k, b, y: 2.0 * y[b],
    }
    game = plain_game(functions, (2, 1), [[0, 1]] * 2, [[0, 1]])
    block = scale * np.outer(a, a)
    assert np.linalg.eigvalsh(block)[0] < 0.0, "or there is nothing to take for rounding"
    assert convexity._own_eigenvalue(game, 0, np.array([0.7, -1.0, 0.0])) == 0.0


def test_a_steep_convex_constraint_of_some_actions_is_none_that_is_not_convex():
    """g = s (y_1 + y_2) + (y_1 - 0.7 y_2)^2 / 2; differences of its gradient round by s."""
    scale = 1e9
    functions = {
        "cost": lambda q, i, y: y[i] ** 2 / 2,
        "cost_gradient": lambda q, i, b, y: y[i],
        "constraint": lambda q, k, y: scale * (y[0] + y[1]) + 0.5 * (y[0] - 0.7 * y[1]) ** 2,
        "constraint_gradient": lambda q, k, b, y: (
            scale + (y[0] - 0.7 * y[1]) * (1.0 - 1.7 * b) if b < 2 else 0.0
        ),
    }
    game = plain_game(functions, (1, 1, 1), [[i] for i in range(3)], [[0, 1, 2]])
    points = np.random.default_rng(1).uniform(-2.0, -1.0, (20, 3))
    found = [np.linalg.eigvalsh(game.constraint_hessian(0, y))[0] for y in points]
    assert min(found) < -1e-6, "or there is nothing to take for rounding"
    assert convexity.counterexample(game, points) is None


@pytest.mark.parametrize("feasible", [False, True])
def test_without_a_box_all_profiles_are_an_agents_own(feasible):
    game = boxed(lambda i, y: y[i] ** 2, lambda i, y: 2 * y[i], 1.0)
    assert game.box is None
    y = np.array([3.0, -2.0])
    slopes = Slopes(game, None, np.full(2, 0.5), feasible)
    for i, at in convexity._own_profiles(game, slopes, y):
        assert i in (0, 1)
        np.testing.assert_array_equal(at, y)


def test_bounds_of_own_second_derivatives_must_all_be_finite():
    """Of a block of which a single entry is unbounded nothing is known."""
    upper = np.array([[2.0, np.inf], [np.inf, 2.0]])
    game = SimpleNamespace(
        agents=1, data=SimpleNamespace(offsets=[0, 2]), box=(np.zeros(2), np.ones(2)),
        jacobian_bounds=lambda box: (np.eye(2), upper),
    )  # fmt: skip
    slopes = SimpleNamespace(box=game.box)
    assert convexity._bounded_own(game, slopes) is None
    game.jacobian_bounds = lambda box: (np.eye(2), 2.0 * np.eye(2))
    assert convexity._bounded_own(game, slopes) == pytest.approx(1.0)


# ----------------------------------------------------------------------------- gains and verdicts


def test_the_slowest_channel_decays_at_the_rate():
    """D_i + beta >= s P_i / 2: s_i = 2 (d_i + beta) / p_i."""
    storage, dissipation = np.array([[[2.0]], [[1.0]]]), np.array([[[0.5]], [[3.0]]])
    assert decay_rate(storage, dissipation, 0, 0.25) == pytest.approx(0.75)
    assert decay_rate(storage[::-1], dissipation[::-1], 0, 0.25) == pytest.approx(0.75)


def test_a_gain_that_is_too_small_is_an_obstacle(monkeypatch):
    system = robot_system(robot_state(FIVE))
    assert theorem.Theorem(system).obstacles == ()
    for gain, told in ((2.0, ["the gain k = 2 must exceed 2"]), (2.5, [])):
        monkeypatch.setattr(theorem.Theorem, "gain", Gain(gain, least=2.0))
        assert list(theorem.Theorem(system).obstacles) == told


@pytest.mark.parametrize(("lost", "told"), [(0.0, "p rho"), (0.25, "p rho + sum lambda_l t_l")])
def test_what_a_margin_costs_is_named_where_there_is_one(lost, told):
    bound = {
        "bound": 0.5 + lost, "bound_affine": None, "of_margin": lost, "largest_own_bound": 0.5,
    }  # fmt: skip
    found = _limit(SimpleNamespace(epsilon=bound))
    assert found.startswith(f"an epsilon-vGNE with epsilon = {told} = {0.5 + lost:g}, and over")


@pytest.mark.parametrize("about", [False, True])
@pytest.mark.parametrize("stored", [False, True])
def test_v_is_known_about_a_known_equilibrium_of_agents_that_have_one(about, stored, monkeypatch):
    monkeypatch.setattr(certificate, "Theorem", lambda system: SimpleNamespace(lyapunov=True))
    system = SimpleNamespace(
        known_equilibrium=object() if about else None,
        agents=SimpleNamespace(knows_storage=stored),
        game=boxed(lambda i, y: 0.0, lambda i, y: 0.0, 1.0),
        schedule=None,
    )
    monitor = SimpleNamespace(
        storage_start=2.0, storage=1.0, storage_rise=0.0, storage_rise_time=0.0, started=1.0,
        saturated=0.0, time=3.0, exit=0,
    )  # fmt: skip
    present = SimpleNamespace(system=system, systems=(system,), whole=system)
    found = certificate._lyapunov(present, monitor, False)
    assert found["known"] == found["claimed"] == (about and stored)
    assert (found["start"], found["final"]) == ((2.0, 1.0) if about else (None, None))


# -------------------------------------------------------------------------------------- searches


def test_a_first_pattern_that_leaves_at_once_is_halved(monkeypatch):
    """Only the first pattern tells: no other finds the smaller push in its place."""
    first = []

    def stays(system, timing):
        pushes = [f for f in system.faults if isinstance(f, Push)]
        if not pushes:
            return True
        kind = sorted((str(f.agents), np.sign(f.force), f.start, f.period) for f in pushes)
        first.append(kind) if not first else None
        return max(abs(f.force) for f in pushes) < (0.01 if kind == first[0] else 1e5)

    monkeypatch.setattr(trials, "stays_inside", stays)
    found = search_push(robot_system(robot_state(FIVE)), clock(0.01, 4.0, 0.01))
    assert 0.01 <= found.smallest_breaking_push <= 1.0201 * 0.01


# -------------------------------------------------------------------------------------- messages


def test_what_numba_says_in_colours_is_told_without(monkeypatch):
    """It does where colorama is installed, as with the tools of the site."""
    module = ModuleType(f"{user_files.USER_MODULES}mine")
    module.__file__ = "/somewhere/mine.py"
    monkeypatch.setitem(sys.modules, module.__name__, module)
    plain = 'Failed in nopython mode\n{}Untyped name{}\n\nFile "{}/somewhere/mine.py{}", line 7:'
    for styles in (("", "") * 2, ("\x1b[1m\x1b[31m", "\x1b[0m") * 2):
        told = user_files.compiler_complaint(ValueError(plain.format(*styles)))
        assert told == "mine.py, line 7: a kernel cannot be compiled: Untyped name"


# ----------------------------------------------------------------------------------------- games


@pytest.mark.parametrize("pair", [(0, 3), (3, 0), (-1, 0), (0, -1)])
def test_edges_join_agents_that_there_are(pair):
    with pytest.raises(InvalidInput, match="agents are numbered 1 to 3"):
        edges.checked("edges", [pair], 3)
    assert edges.checked("edges", [(0, 2), (2, 1)], 3) == [(0, 2), (2, 1)]


def test_weights_of_spacings_count_beside_those_of_places():
    with pytest.raises(InvalidInput, match="spacing_weight"):
        _check_monotone(np.array([1.0]), np.array([1e-14, 1.0]), [1e-14, 1.0])
    _check_monotone(np.array([1e-200]), np.array([1e-200, 1e-200]), 1e-200)


# --------------------------------------------------------------------------------------- batches


def test_processors_where_the_system_does_not_tell_which_are_ours(monkeypatch):
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    for told, count in ((7, 7), (None, 1)):
        monkeypatch.setattr(os, "cpu_count", lambda told=told: told)
        assert cores() == count


class _Counting:
    """A loop that only counts steps; rows tell how many were taken before them."""

    monitor = None

    def __init__(self):
        self.step, self.asked = 0, []

    def _rows(self, steps):
        column = np.array(steps, float)[:, None]
        return Samples(*[column] * len(Samples._fields))

    def advance(self, samples, every):
        rows = self._rows([self.step + k * every for k in range(samples)])
        self.step += samples * every
        return rows

    def finish(self):
        return self._rows([self.step])


@pytest.mark.parametrize("steps", [7, 8, 9, 10, 612])
def test_a_run_of_a_loop_of_its_own_ends_at_its_last_step(steps, monkeypatch):
    monkeypatch.setattr("gne_mj.loops.batch.watch.together", lambda monitors: monitors)
    span = Span(steps, 4)
    case = Case(np.zeros((1, 1)), np.zeros(0), np.zeros((1, 1)), None, _Counting)
    found = EachLoop(1).run([case], span, lambda: False).samples.state[0, :, 0]
    np.testing.assert_array_equal(found, [*range(0, steps, 4), steps])


# ----------------------------------------------------------------------------------------- loops


@pytest.mark.parametrize(("end", "good"), [(-1.0, True), (-0.985, True), (-0.97, False)])
def test_a_piece_that_changes_slacks_by_little_is_ordinary(end, good):
    work = SimpleNamespace(y=np.zeros(1), g=np.array([end]))
    stages = SimpleNamespace(y=np.zeros(4), g=np.full(4, -1.0), size=np.ones(2))
    problem = SimpleNamespace(data=SimpleNamespace(tightening=np.zeros(1)))
    for count in (1, 4):
        assert division.ordinary(count, problem, work, stages) == good


def test_a_start_of_estimates_as_far_away_as_the_boundary_is_not_known_to_be_inside():
    """The ball of the lemma is open: 3/8 and 4/8 away, with slacks of 5/8."""
    game = boxed(lambda i, y: y[i] ** 2 / 2, lambda i, y: y[i], 10 / 8)
    own = 5 / 8 + np.array([[3 / 8, 4 / 8], [0.0, 0.0]])

    def found(share):
        law = SimpleNamespace(barrier_profiles=lambda agent, memory: 5 / 8 + share * (own - 5 / 8))
        system = SimpleNamespace(game=game, law=law, memory=None, start=np.full(2, 5 / 8))
        return assumptions.estimates_start(system).status

    assert found(1.0) == UNKNOWN
    assert found(0.999) == MET


def test_a_period_whose_equation_was_not_solved_is_not_counted_as_solved():
    """J = -5 y^2 over periods of 1 s: the slope is negative, and Newton's method stops."""
    game = boxed(
        lambda i, y: -5.0 * y[i] ** 2, lambda i, y: -10.0 * y[i], 1.0, 1,
        lambda i, y, scale, out: np.add(out, -10.0 * scale, out=out),
    )  # fmt: skip
    system = System(
        "one", game, integrators(1), FullInformation(), 0.1, np.array([[0.5]]),
        mode="implicit", integrator="euler",
    )  # fmt: skip
    *_, loop = run_loop(system, 1.0, 1)
    assert loop.monitor.unsolved == loop.monitor.solutions > 0.0


def test_a_law_without_estimates_allows_any_step_whoever_hears_whom():
    law = FullInformation()
    object.__setattr__(law, "graph", ring(5))
    assert law.estimate_rate == 0.0
    assert largest_step(robot_system(robot_state(FIVE), law=law)) == np.inf


@pytest.mark.slow
def test_a_batch_draws_what_goes_wrong_by_the_seed_of_each_run():
    """Two runs that differ in their seeds alone, as each would be alone."""
    noise = {"type": "noise", "amplitude": 0.1}
    changes = {**ODE, "faults": [noise], "simulation.duration": 0.1, "recording.period": 0.05}
    plan = make_plan("velocity-sync", changes, starts=2)
    ends = all_chunks(plan, 1)["final_action"][1]
    for run in range(2):
        alone = plan.alone(run).simulation_object().run()["robots"]["action"].to_numpy()[-1]
        assert np.array_equal(ends[run], alone)


def test_what_a_step_by_old_factors_leaves_is_its_worst_entry_over_the_longest():
    step, old = np.array([1.0, -4.0, 2.0]), np.array([1.5, -4.25, 2.0])
    kernel = newton.share_left
    assert kernel(3, SimpleNamespace(step=step, old_step=old)) == 2.0 * 0.5 / 4.0
    assert kernel(3, SimpleNamespace(step=step, old_step=-step)) == 1.0
    assert kernel(3, SimpleNamespace(step=0.0 * step, old_step=old)) == 1.0


def problem_of(data):
    return SimpleNamespace(data=data, settings=np.zeros(settings.COUNT))


def euler_piece(change, count=1):
    """A slack of 1 that a piece of 0.1 s changes by so much, judged; the division and its rates."""
    stages = SimpleNamespace(
        g=np.array([-1.0, -1.0, -1.0, -1.0]), y=np.array([0.0, 0.1, 0.2, 0.4]), size=np.ones(2)
    )
    div = SimpleNamespace(calm=0.0, easy=0.0, rated=0.0, level=0.0)
    work = SimpleNamespace(division=div, stages=stages, g=np.array([-1.0 + change]), y=np.zeros(1))
    pieces = SimpleNamespace(
        member_pointer=[0, 1], member_index=[0], offsets=[0, 1], tightening=np.zeros(1)
    )
    return division.judge(count, 0.1, problem_of(pieces), work), div, stages, work


def test_a_piece_of_eulers_method_is_compared_with_the_rate_of_the_one_before():
    """The first one has none; after it the slack's second derivative tells of the error."""
    which, div, stages, work = euler_piece(0.1)
    assert (which, div.rated) == (-1, 1.0)
    assert stages.g[1] == pytest.approx(1.0), "0.1 in 0.1 s"
    stages.g[0] = work.g[0]
    work.g[0] += 0.1 + 0.017  # half of what has changed is 0.0085 of a slack of 0.9: allowed 0.009
    problem = problem_of(SimpleNamespace(tightening=np.zeros(1)))
    assert division.judge(1, 0.1, problem, work) == -1
    stages.g[:2] = -0.9, 1.0
    work.g[0] = -0.9 + 0.1 + 0.019
    assert division.judge(1, 0.1, problem, work) == 0
    assert euler_piece(0.1, count=4)[1].rated == 0.0


def test_one_curved_entry_is_enough_for_constraints_that_are_not_affine():
    """y_1^2 < 1 and y_2 < 1: of four second derivatives three are zero."""
    functions = {
        "cost": lambda q, i, y: y[i] ** 2 / 2,
        "cost_gradient": lambda q, i, a, y: y[i],
        "constraint": lambda q, k, y: y[1] - 1.0 if k else y[0] ** 2 - 1.0,
        "constraint_gradient": lambda q, k, a, y: (
            float(a == 1) if k else 2.0 * y[0] * float(a == 0)
        ),
    }
    game = plain_game(functions, (1, 1), [[0], [1]], [[0], [1]])
    assert not is_affine(game, np.array([0.5, 0.5]))
    assert is_affine(boxed(lambda i, y: y[i], lambda i, y: 1.0, 1.0), np.array([0.5, 0.5]))
