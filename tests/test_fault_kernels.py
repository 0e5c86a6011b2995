"""Faults' kernels as plain Python: messages, corrupted estimates, noise, limits and pushes."""

import numpy as np
import pytest
from builders import FIVE, clock, robot_state, robot_system
from plain_loops import parts_of, run_plain

from gne_mj import graph as graphs
from gne_mj.controllers import PartialInformation
from gne_mj.faults import (
    Bias,
    Corruption,
    MessageDelay,
    MessageLoss,
    Noise,
    Push,
    Saturation,
    Silence,
)
from gne_mj.loops import faults as native

H, SEED = 0.01, 5
RING = graphs.ring(5)
LAW = PartialInformation(RING, 2.0, 0.5)


@pytest.fixture(autouse=True)
def wrapping():
    """Random numbers come of products of whole numbers that wrap around."""
    with np.errstate(over="ignore"):
        yield


def struck(*faults, law=None, **options):
    return robot_system(
        robot_state(FIVE), law=law, mode="implicit", integrator="euler", faults=faults, seed=SEED,
        **options,
    )  # fmt: skip


def random(stream, target, count):
    return native.uniform(SEED, stream, target, count)


def estimates_by_hand(y, periods, lost, delay):
    """Partial information by messages: estimates at the instants, outputs y (instants, 5) given."""
    links = [(i, j) for i in range(5) for j in sorted(((i - 1) % 5, (i + 1) % 5))]
    rows = np.tile(y[0], (5, 1))
    inbox = {link: rows[link[1]].copy() for link in links}
    sent, found = [], []
    for k in range(periods):
        if k:
            for i in range(5):
                mean = np.mean([inbox[i, j] for j in range(5) if (i, j) in inbox], axis=0)
                moved = mean + np.exp(-2.0 / 0.5 * H * 2) * (rows[i] - mean)
                rows[i] = np.where(np.arange(5) == i, rows[i], moved)
        rows[np.arange(5), np.arange(5)] = y[k]
        sent.append(rows.copy())
        for number, (i, j) in enumerate(links):
            if not lost(k, number, i, j) and k >= delay(k, i, j):
                inbox[i, j] = sent[k - delay(k, i, j)][j].copy()
        found.append(rows.copy())
    return np.array(found)


def test_messages_lost_late_and_silenced():
    """Over single edges and from some time on, all at once."""
    loss = MessageLoss(probability=0.4, edges=((0, 1), (2, 3)))
    late = MessageDelay(periods=2, agents=(4,), start=0.03)
    mute = Silence(agents=(1,), start=0.05, end=0.08)

    def lost(k, number, i, j):
        unlucky = {i, j} in ({0, 1}, {2, 3}) and random(0, number, k) < 0.4
        return unlucky or (1 in (i, j) and 5 <= k < 8)

    def delay(k, i, j):
        return 2 if 4 in (i, j) and k >= 3 else 0

    found = run_plain(struck(loss, late, mute, law=LAW), clock(H), 12)
    expected = estimates_by_hand(found.y, 12, lost, delay)
    assert found.memory[:, :25].reshape(12, 5, 5) == pytest.approx(expected, abs=1e-12)
    calm = estimates_by_hand(found.y, 12, lambda *_: False, lambda *_: 0)
    assert np.max(np.abs(calm - expected)) > 1e-3, "they make a difference"


def test_estimates_are_shifted_once():
    """At the first control instant from the start on, others' actions only."""
    calm = run_plain(struck(Push(force=0.0), law=LAW), clock(H, 0.1, 0.02), 5)
    fault = Corruption(amplitude=0.3, start=0.03, agents=(1, 3))
    shifted = run_plain(struck(fault, law=LAW), clock(H, 0.1, 0.02), 5)
    assert np.array_equal(calm.memory[:2], shifted.memory[:2])
    change = (shifted.memory[2] - calm.memory[2]).reshape(5, 5)
    for i in range(5):
        for r in range(5):
            struck_here = i in (1, 3) and r != i
            expected = 0.3 * (2 * random(0, 5 * i + r, 0) - 1) if struck_here else 0.0
            assert change[i, r] == pytest.approx(expected, abs=1e-12)
    later = np.abs(shifted.memory[3] - calm.memory[3])
    assert np.max(later) < 0.31, "and not again"


def test_outputs_are_read_with_noise_and_bias_while_they_last():
    noise = Noise(amplitude=0.02, agents=(0, 2), start=0.02, end=0.06)
    bias = Bias(offset=-0.05, agents=(1,), start=0.04)
    found = run_plain(struck(noise, bias), clock(H, 0.1, 0.02), 5)
    for k in range(5):
        error = np.zeros(5)
        for r in (0, 2):
            error[r] += 0.02 * (2 * random(0, r, k) - 1) if 1 <= k < 3 else 0.0
        error[1] -= 0.05 if k >= 2 else 0.0
        assert found.measurement[k] - found.y[k] == pytest.approx(error, abs=1e-12)


def test_actuators_deliver_the_least_of_their_limits():
    weak = Saturation(limit=0.5, agents=(0, 1), start=0.01, end=0.03)
    weaker = Saturation(limit=0.25, agents=(1,), start=0.02)
    parts = parts_of(struck(weak, weaker, limit=2.0), clock(H))
    parts.work.commanded[:] = [-3.0, 3.0, 3.0, -3.0, 1.0]
    for step, expected in (
        (0, [-2.0, 2.0, 2.0, -2.0, 1.0]), (1, [-0.5, 0.5, 2.0, -2.0, 1.0]),
        (2, [-0.5, 0.25, 2.0, -2.0, 1.0]), (3, [-2.0, 0.25, 2.0, -2.0, 1.0]),
    ):  # fmt: skip
        native.deliver(parts.problem, parts.clock, step, parts.work)
        assert parts.work.u.tolist() == expected


def test_pushes_have_their_courses():
    pushes = (
        Push(agents=(0,), force=2.0, start=0.1, end=0.3),
        Push(agents=(1,), force=2.0, profile="sine", period=0.4, start=0.1),
        Push(agents=(2,), force=-2.0, profile="square", period=0.2, start=0.1),
        Push(agents=(3,), force=2.0, profile="random"),
        Push(agents=(0, 4), force=0.5),
    )
    parts = parts_of(struck(*pushes), clock(0.1))
    u, applied = np.arange(5.0), np.zeros(5)
    for step in range(5):
        got = native.push(parts.problem, parts.clock, step, u, applied)
        assert got is applied
        time, on = 0.1 * step, step >= 1
        expected = [
            0.5 + (2.0 if 1 <= step < 3 else 0.0),
            2.0 * np.sin(2 * np.pi * (time - 0.1) / 0.4) if on else 0.0,
            (-2.0 if step % 2 else 2.0) if on else 0.0,
            2.0 * (2 * random(3, 3, step) - 1),
            0.5,
        ]
        assert applied - u == pytest.approx(np.array(expected), abs=1e-6)
    assert u.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_messages_that_came_are_counted():
    """Over every link, from one step to before another, by control periods."""
    system = struck(MessageLoss(probability=0.4), Silence(agents=(0,), start=0.1), law=LAW)
    parts = parts_of(system, clock(H, 1.0, 0.02))
    out = np.zeros((10, 2))
    native.count_messages(parts.problem.faults, H, 2, 3, 21, out)
    expected = np.zeros((10, 2))
    links = [(i, j) for i in range(5) for j in sorted(((i - 1) % 5, (i + 1) % 5))]
    for k in range(2, 11):  # instants at steps 4, 6, ..., 20
        for number, link in enumerate(links):
            lost = random(0, number, k) < 0.4 or (0 in link and k >= 5)
            expected[number, int(lost)] += 1
    assert np.array_equal(out, expected)
