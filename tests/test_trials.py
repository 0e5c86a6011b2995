"""Searches by trial: what is tried, in which order, and what is concluded.

The searches are given runs that end as a rule says, so that what they should find is known; that
runs end as they should is shown elsewhere.
"""

from dataclasses import replace

import numpy as np
import pytest
from builders import (
    FIVE,
    V0,
    clock,
    distributed,
    integrators,
    osnr_system,
    robot_state,
    robot_system,
)

from gne_mj import exit_map as maps
from gne_mj.controllers import FullInformation
from gne_mj.errors import InfeasibleStart, InvalidInput
from gne_mj.faults import Push, Saturation
from gne_mj.games import cournot_game, velocity_game
from gne_mj.loops import monitor as watch
from gne_mj.margins import Disturbance
from gne_mj.system import Clock, System
from gne_mj.theory import epsilon, search_epsilon, search_period, search_push, trials

ROBOTS = robot_system(robot_state(FIVE), mode="sampled", integrator="euler")


@pytest.fixture
def rule(monkeypatch):
    """Let runs stay inside as a function of system and clock says; returns what was run."""

    def use(stays):
        asked = []

        def run(system, clock):
            asked.append((system, clock))
            return stays(system, clock)

        monkeypatch.setattr(trials, "stays_inside", run)
        monkeypatch.setattr(epsilon, "stays_inside", run)
        return asked

    return use


# ------------------------------------------------------------------------------------- periods


def test_periods_grow_by_a_fifth_and_are_bisected(rule):
    asked = rule(lambda system, clock: clock.control_period < 0.205)
    said = []
    timing = Clock(4.0, 0.01, 0.01, 0.01)
    found = search_period(ROBOTS, timing, lambda *told: said.append(told))
    steps = [round(period / 0.01) for period, _ in found.trials]
    assert steps == [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 14, 16, 19, 22, 20, 21]
    assert [stayed for _, stayed in found.trials] == [n <= 20 for n in steps]
    assert (found.inside, found.outside) == pytest.approx((0.2, 0.21))
    assert found.note == "each a fifth longer than the last, then bisected"
    assert len(said) == len(steps)
    assert said[0] == (0, 31, "at most 31 runs of 4 s with longer and longer periods")
    assert said[-1] == (16, 17, "robots: trying a period of 0.21 s")
    assert all(len(steps) <= total for _, total, _ in said), "the most there can be"
    for (_, timing), n in zip(asked, steps, strict=True):
        assert timing.timestep == 0.01
        assert timing.control_period == pytest.approx(n * 0.01)
        # whole periods, the last of which ends at the duration or behind it
        assert timing.duration == pytest.approx(np.ceil(400 / n) * n * 0.01)


def test_long_periods_are_told_to_two_percent(rule):
    rule(lambda system, clock: clock.control_period <= 5.4321)
    found = search_period(ROBOTS, Clock(40.0, 0.001, 0.001, 0.001))
    assert found.inside <= 5.4321 < found.outside <= 1.02 * found.inside
    tried = dict(found.trials)
    assert tried[found.inside]
    assert not tried[found.outside]
    assert len(tried) < 70


def test_the_search_for_a_period_ends_at_half_the_duration(rule):
    rule(lambda system, clock: True)
    found = search_period(ROBOTS, Clock(1.0, 0.01, 0.01, 0.01))
    assert found.inside == pytest.approx(0.44)  # a fifth more is 0.52
    assert found.outside is None
    assert found.note == "half the duration is 0.5 s"
    shortest = search_period(ROBOTS, Clock(0.01, 0.01, 0.01, 0.01))
    assert [period for period, _ in shortest.trials] == [0.01]


def test_no_period_may_be_short_enough(rule):
    rule(lambda system, clock: False)
    found = search_period(ROBOTS, Clock(1.0, 0.01, 0.01, 0.01))
    assert (found.inside, found.outside) == (None, 0.01)
    assert found.trials == ((0.01, False),)


@pytest.mark.parametrize(
    "error", [InvalidInput("k", 1, "less"), InfeasibleStart("k", "y", "g", 1.0)]
)
def test_a_period_that_a_system_refuses_is_none_that_stays(rule, error):
    def stays(system, clock):
        if clock.control_period > 0.035:
            raise error
        return True

    rule(stays)
    found = search_period(ROBOTS, Clock(1.0, 0.01, 0.01, 0.01))
    assert (found.inside, found.outside) == pytest.approx((0.03, 0.04))


def test_mode_continuous_has_no_period():
    with pytest.raises(InvalidInput, match=r"^system.mode: got 'continuous'"):
        search_period(replace(ROBOTS, mode="continuous"), clock(0.01))


def test_a_declared_margin_is_made_anew_for_each_period(rule):
    """One Euler step of h for unit masses adds h * push to an output, twice that to a gap."""
    bound = Disturbance(np.full(5, 2.0), np.zeros(5))
    system = replace(ROBOTS, mode="implicit", disturbance=bound)
    asked = rule(lambda system, clock: clock.control_period < 0.025)
    search_period(system, Clock(1.0, 0.01, 0.01, 0.01))
    errors = [2 * 2.0 * (asked[k][1].control_period) for k in range(3)]
    for (tried, _), error in zip(asked, errors, strict=False):
        assert tried.game.margins[1] == pytest.approx(2 * 3.0 * error - error**2, rel=0.02)
    assert trials.held_for(ROBOTS, 0.01, 3) is ROBOTS


# -------------------------------------------------------------------------------------- pushes


def size_of(system):
    return max(
        (abs(fault.force) for fault in system.faults if isinstance(fault, Push)), default=0.0
    )


def test_the_smallest_push_is_found_over_all_patterns(rule):
    """Steady ones break it from 3.7 on, those from half the time on from 2.9 on."""

    def stays(system, clock):
        late = any(fault.start == 2.0 for fault in system.faults if isinstance(fault, Push))
        return size_of(system) < (2.9 if late else 3.7)

    own = Saturation(limit=50.0)
    asked = rule(stays)
    said = []
    timing = Clock(4.0, 0.01, 0.01, 0.01)
    pushed = replace(ROBOTS, faults=(own,))
    found = search_push(pushed, timing, lambda *told: said.append(told))
    assert 2.9 <= found.smallest_breaking_push <= 1.02 * 2.9
    assert found.pattern.endswith("from half the time on")
    assert found.runs == len(asked) - 1, "but the one without any push"
    assert found.largest_tried == max(size_of(system) for system, _ in asked)
    assert all(system.faults[0] is own for system, _ in asked)
    # two directions of each of five gaps, in five courses
    ahead, *patterns = said
    assert len({words for _, _, words in patterns}) == 50
    assert all(words.startswith("robots: pushing, ") for _, _, words in patterns)
    harmonic = sum(1 / k for k in range(1, 51))
    assert ahead[:2] == (0, pytest.approx(50 + 7 * harmonic))
    assert ahead[2] == "50 patterns of pushes, some 81 runs of 4 s"
    assert [total - done for done, total, _ in patterns] == pytest.approx(
        [50 - k + 7 * (harmonic - sum(1 / j for j in range(1, k + 1))) for k in range(50)]
    )
    assert patterns[-1][0] < found.runs + 1 <= patterns[-1][0] + 1 + 7


@pytest.mark.parametrize("threshold", [0.004, 0.9, 1.0, 1.1, 17.0, 2e5])
def test_the_smallest_push_of_any_size(rule, threshold):
    rule(lambda system, clock: size_of(system) < threshold)
    found = search_push(ROBOTS, Clock(4.0, 0.01, 0.01, 0.01))
    assert threshold <= found.smallest_breaking_push <= 1.0201 * threshold


def test_no_push_may_break_it(rule):
    asked = rule(lambda system, clock: True)
    found = search_push(ROBOTS, Clock(4.0, 0.01, 0.01, 0.01))
    assert (found.smallest_breaking_push, found.pattern) == (None, None)
    assert found.largest_tried == 4.0**9  # the last below a million
    assert found.runs == len(asked) - 1 == 50 * 10


def test_pushes_of_nothing_end_the_search(rule):
    """Where any push at all breaks it the halving ends."""
    rule(lambda system, clock: size_of(system) == 0.0)
    found = search_push(ROBOTS, Clock(4.0, 0.01, 0.01, 0.01))
    assert 0.0 < found.smallest_breaking_push < 1e-9
    assert found.largest_tried == 1.0


def test_a_run_that_leaves_by_itself_needs_no_push(rule):
    rule(lambda system, clock: False)
    found = search_push(ROBOTS, Clock(4.0, 0.01, 0.01, 0.01))
    assert (found.smallest_breaking_push, found.pattern) == (0.0, "without any push")
    assert (found.largest_tried, found.runs) == (0.0, 1)


def test_patterns_push_the_ways_that_raise_a_constraint():
    game = cournot_game(2)
    agents = integrators(2)
    system = System(
        "firms", game, agents, FullInformation(), 0.1, agents.equilibrium(np.array([20.0, 30.0]))
    )
    timing = Clock(4.0, 0.01, 0.02, 0.01)
    patterns = dict(trials._patterns(system, timing))
    assert len(patterns) == 4 * 5, "affine constraints are raised in one direction each"
    (push,) = patterns["'least quantity of firm 2', +, steadily"]
    assert (push.agents, push.force, push.profile, push.start) == ((1,), -1.0, "constant", 0.0)
    (push,) = patterns["'greatest quantity of firm 1', +, from half the time on"]
    assert (push.agents, push.force, push.start) == ((0,), 1.0, 2.0)
    for length in (0.04, 0.4, 0.8):
        (push,) = patterns[f"'greatest quantity of firm 1', +, in squares of {length:g} s"]
        assert (push.profile, push.period) == ("square", pytest.approx(length))
    robots = dict(trials._patterns(ROBOTS, timing))
    name = ROBOTS.game.constraint_names[1]
    first, second = robots[f"'{name}', +, steadily"]
    # y_2 - y_1 = -1 at the start: the gap grows where the second falls and the first rises
    assert (first.agents, first.force) == ((0,), 1.0)
    assert (second.agents, second.force) == ((1,), -1.0)
    again = robots[f"'{name}', -, steadily"]
    assert [push.force for push in again] == [-1.0, 1.0]


def test_a_gap_that_vanishes_at_the_start_is_pushed_as_on_the_way_to_the_equilibrium():
    """The first wants to be faster and the second slower, from rest where all gaps vanish."""
    game = velocity_game(2, V0, 3.0, [V0 + 1.0, V0 - 1.0], [1.0, 1.0])
    start = integrators(2).equilibrium(np.full(2, V0))
    system = System("line", game, integrators(2), FullInformation(), 0.1, start)
    y = system.equilibrium.action
    assert y[0] > V0 > y[1]
    patterns = dict(trials._patterns(system, clock(0.01)))
    (push,) = patterns[f"'{game.constraint_names[0]}', +, steadily"]
    assert (push.agents, push.force) == ((0,), 1.0)
    pushes = patterns[f"'{game.constraint_names[1]}', +, steadily"]
    assert [push.force for push in pushes] == [1.0, -1.0]


def test_a_run_stays_or_does_not():
    """Real ones: the explicit law keeps a start well inside, and leaves from a bound's edge."""
    timing = Clock(0.2, 0.002, 0.01, 0.01)
    assert trials.stays_inside(ROBOTS, timing)
    edge = robot_state(np.array([V0 - 3.0 * (1 - 1e-9), *FIVE[1:]]))
    assert not trials.stays_inside(replace(ROBOTS, state=edge), timing)
    assert trials.stays_inside(replace(ROBOTS, state=edge, mode="implicit"), timing)


# ------------------------------------------------------------------------------------- epsilon


CHANNELS = osnr_system(integrators(10), distributed(epsilon=0.04), 0.2)


@pytest.mark.parametrize("threshold", [0.0301, 0.04, 0.15, 0.0007])
def test_the_search_brackets_an_epsilon(rule, threshold):
    asked = rule(lambda system, clock: system.law.epsilon <= threshold)
    said = []
    found = search_epsilon(CHANNELS, clock(0.001, 1.0), lambda *told: said.append(told))
    assert found.inside <= threshold < found.outside <= 1.01 * found.inside
    assert found.note is None
    assert [system.law.epsilon for system, _ in asked] == [tried for tried, _ in found.trials]
    assert all(stayed == (tried <= threshold) for tried, stayed in found.trials)
    assert [done for done, _, _ in said] == list(range(len(found.trials)))
    assert said[0][1:] == (28, "at most 28 runs of 1 s with other epsilon")
    assert said[-1][1] == 28 >= len(found.trials)
    first, second = found.trials[0], found.trials[1]
    assert first == (0.04, threshold >= 0.04)
    assert second[0] == (0.08 if threshold >= 0.04 else 0.02), "doubled or halved"


def test_the_search_for_an_epsilon_ends_somewhere(rule):
    rule(lambda system, clock: True)
    found = search_epsilon(CHANNELS, clock(0.001, 1.0))
    assert found.outside is None
    assert found.inside == pytest.approx(0.04 * 2**7)  # twice that is more than ten durations
    assert found.note == "10.24 s was not tried"
    rule(lambda system, clock: False)
    found = search_epsilon(CHANNELS, clock(0.001, 1.0))
    assert found.inside is None
    assert found.outside == pytest.approx(0.04 * 2.0**-20)
    assert len(found.trials) == 21
    assert found.note.endswith("was not tried")


def test_an_epsilon_that_cannot_be_tried_ends_the_search(rule):
    def stays(system, clock):
        if system.law.epsilon < 0.015:
            raise InvalidInput("clock.timestep", clock.timestep, "it must be shorter")
        return False

    rule(stays)
    found = search_epsilon(CHANNELS, clock(0.001, 1.0))
    assert (found.inside, found.outside) == (None, 0.02)
    assert found.note == "0.01 s cannot be tried: it must be shorter"


def test_what_fails_below_one_that_stayed_does_not_count(rule):
    """Nothing assures that every epsilon below one that works works too."""
    rule(lambda system, clock: system.law.epsilon > 0.05 or system.law.epsilon < 0.03)
    found = search_epsilon(CHANNELS, clock(0.001, 0.02))
    assert found.trials[0] == (0.04, False)
    assert found.inside < 0.03 <= found.outside


# ------------------------------------------------------------------------------------ the map


GRID = maps.Grid(periods=(0.1, 0.01), margins=(0.3, 1e-6), pushes=(0.0, 2.0), runs=3, duration=0.25)


def test_every_cell_of_the_grid_is_tried(monkeypatch):
    """Six runs of it stay or end in known ways; each is counted once."""
    ways = ["inside", "instant", "between", "nothing", "refused", "inside"]
    asked = []

    def run(system, clock, plants):
        assert clock.timestep == 0.01
        assert clock.duration == pytest.approx(0.3 if clock.control_period == 0.1 else 0.25)
        asked.append((system.mode, clock.control_period, system))
        outcome = ways[len(asked) % 6]
        return outcome, float(len(asked)) if outcome == "inside" else np.nan

    monkeypatch.setattr(maps, "_run", run)
    done = []
    cells = maps.exit_map(ROBOTS, 0.01, GRID, lambda *told: done.append(told))
    # 12 runs of 30 steps, 12 of 25 and the same in the other mode
    costs = np.cumsum([0, *2 * [*12 * [30], *12 * [25]]]).tolist()
    assert [steps for steps, _, _ in done] == costs
    assert {total for _, total, _ in done} == {costs[-1]}
    assert done[0][2] == "48 runs of 0.25 s"
    assert done[5][2] == "5 of 48 runs"
    assert GRID.total == 2 * 3 * 2 * 2 * 2 == len(asked)
    order = [(c.mode, c.period, c.push, c.margin) for c in cells]
    assert order == [
        (mode, period, push, margin)
        for mode in ("sampled", "implicit")
        for period in (0.1, 0.01)
        for push in (0.0, 2.0)
        for margin in (0.3, 1e-6)
    ]
    one, other = cells[0], cells[1]  # ways 1, 2, 3 and 4, 5, 0
    assert (one.runs, one.left_at_instant, one.left_between, one.no_action) == (3, 1, 1, 1)
    assert (one.refused, one.least_margin, one.share) == (0, None, 1.0)
    assert (other.refused, other.least_margin, other.share) == (1, 5.0, 0.0)
    asked.clear()
    stopped = maps.exit_map(ROBOTS, 0.01, GRID, stopped=lambda: len(asked) >= 5)
    assert stopped == cells[:1], "whole cells only"
    assert maps.exit_map(ROBOTS, 0.01, GRID, stopped=lambda: True) == []


def test_starts_lie_on_rays_that_end_at_the_boundary():
    rays = maps._rays(ROBOTS, GRID)
    again = maps._rays(ROBOTS, GRID)
    assert len(rays) == 3
    middle = ROBOTS.equilibrium.action
    for (ray, signs), (same, equal) in zip(rays, again, strict=True):
        assert np.array_equal(ray, same)
        assert np.array_equal(signs, equal)
        assert np.max(ROBOTS.game.constraints(middle + ray)) == pytest.approx(0.0, abs=1e-9)
        assert np.max(ROBOTS.game.constraints(middle + ray)) < 0
        assert set(np.abs(signs)) == {1.0}
        system = maps._at(ROBOTS, "implicit", ray, 0.3, 2.0 * signs)
        assert system.start == pytest.approx(middle + 0.7 * ray)
        assert system.mode == "implicit"
        forces = {fault.agents[0]: fault.force for fault in system.faults}
        assert [forces[i] for i in range(5)] == (2.0 * signs).tolist()
        assert maps._at(ROBOTS, "implicit", ray, 0.3, 0.0 * signs).faults == ()
        assert maps._at(ROBOTS, "implicit", 1.1 * ray, 0.0, signs) is None
    tight = replace(ROBOTS, game=ROBOTS.game.tightened(np.full(5, 1.0)))
    for ray, _ in maps._rays(tight, GRID):
        assert np.max(tight.game.constraints(middle + ray)) == pytest.approx(-1.0)
    assert maps._run(None, clock(0.01), {})[0] == "refused"


class _Loop:
    """A loop that ends as it is told."""

    def __init__(self, clock, monitor):
        self.clock, self.monitor, self.plant, self.steps = clock, monitor, object(), 0

    def pass_over(self, steps):
        self.steps += steps

    def finish(self):
        self.monitor.started = 1.0


def test_what_a_run_of_the_map_showed(monkeypatch):
    p, m = ROBOTS.game.constraints_count, ROBOTS.game.actions
    monitor = watch.fresh(m, p)
    monitor.worst[:] = [-5.0, -0.5, -3.0, -4.0, -9.0]
    made = []

    def closed_loop(system, clock, plant=None):
        made.append((_Loop(clock, monitor), plant))
        return made[-1][0]

    monkeypatch.setattr(System, "closed_loop", closed_loop)
    plants = {}
    ran = maps._clock(0.25, 0.03, 0.1)
    assert maps._run(ROBOTS, ran, plants) == ("inside", 0.5)
    timing = made[0][0].clock
    assert timing.timestep == pytest.approx(0.025), "whole steps, none longer than was asked for"
    assert (timing.control_period, timing.duration) == (0.1, pytest.approx(0.3))
    assert made[0][0].steps == 12
    assert maps._run(ROBOTS, ran, plants)[0] == "inside"
    assert made[1][1] is made[0][0].plant, "one fleet serves all runs of a mode"
    monitor.exit = watch.LEFT_SET
    assert maps._run(ROBOTS, ran, plants)[0] == "instant"
    monitor.exit_between = 1.0
    assert maps._run(ROBOTS, ran, plants)[0] == "between"
    monitor.exit = watch.DIVERGED
    assert maps._run(ROBOTS, ran, plants)[0] == "nothing"

    def refused(system, clock, plant=None):
        raise InvalidInput("clock.timestep", 1.0, "less")

    monkeypatch.setattr(System, "closed_loop", refused)
    assert maps._run(ROBOTS, ran, plants)[0] == "refused"


def cell(mode, period, left=0, refused=0, push=0.0):
    return maps.Cell(mode, period, 0.3, push, 4, left, 0, 0, refused, 1.0)


def test_the_summary_tells_up_to_which_period_all_stayed():
    cells = [
        cell("sampled", 0.1, left=1), cell("sampled", 0.01), cell("sampled", 0.05),
        cell("implicit", 0.01, refused=1), cell("implicit", 0.05), cell("sampled", 0.01, push=2.0),
    ]  # fmt: skip
    assert list(maps.summary(cells)) == [
        "sampled, push 0: every start stayed inside up to 0.05 s; of 12 runs 1 left at a control"
        " instant, 0 between",
        "implicit, push 0: no period was safe; of 8 runs 0 left at a control instant, 0 between",
        "sampled, push 2: every start stayed inside up to 0.01 s; of 4 runs 0 left at a control"
        " instant, 0 between",
    ]


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"periods": ()}, "periods"),
        ({"periods": (0.1, np.inf)}, "periods"),
        ({"periods": (0.0,)}, "periods"),
        ({"margins": (0.0,)}, "margins"),
        ({"margins": (1.0,)}, "margins"),
        ({"pushes": (-1.0,)}, "pushes"),
        ({"runs": 0}, "runs"),
        ({"duration": 0.0}, "duration"),
    ],
)
def test_grids_that_cannot_be(changes, key):
    with pytest.raises(InvalidInput) as caught:
        replace(GRID, **changes)
    assert caught.value.key == key


def test_a_table_has_a_row_for_each_cell(tmp_path):
    file = tmp_path / "map.csv"
    maps.write([cell("sampled", 0.1, left=1), cell("implicit", 0.2)], file)
    head, one, two = file.read_text(encoding="utf-8").splitlines()
    assert head.startswith("mode,period,margin,push,runs,left_at_instant,left_between,no_action")
    assert one == "sampled,0.1,0.3,0.0,4,1,0,0,0,1.0"
    assert two == "implicit,0.2,0.3,0.0,4,0,0,0,0,1.0"
