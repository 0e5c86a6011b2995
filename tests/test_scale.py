"""What makes large systems quick gives what the plain ways give."""

import mujoco
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from gne_mj import banded
from gne_mj.games import velocity_game
from gne_mj.plants import fleet
from gne_mj.scenario import load_scenario
from gne_mj.theory import Theorem, certify, spectra


def band_of(matrix, b):
    """A matrix as gne_mj.banded has it."""
    n = len(matrix)
    band = np.zeros((n, 3 * b + 1))
    for r in range(n):
        for c in range(max(0, r - b), min(n, r + b + 1)):
            band[r, c - r + b] = matrix[r, c]
    return band


def matrices(n):
    rng = np.random.default_rng(n)
    dense = rng.normal(size=(n, n))
    sparse = np.where(rng.random((n, n)) < 0.5, 0.0, dense)
    return {
        "dense": dense, "sparse": sparse + 3.0 * np.eye(n), "like Cournot": 1.0 + np.eye(n),
        "rows swapped": np.eye(n)[::-1] + np.tril(dense, -n // 2),
    }  # fmt: skip


@pytest.mark.parametrize("n", [8, 9, 12, 23])
@pytest.mark.parametrize("kind", matrices(2))
def test_blocks_of_columns_give_the_same_bits(monkeypatch, n, kind):
    matrix = matrices(n)[kind]
    found = []
    for large in (1000, 8):
        monkeypatch.setattr(banded, "LARGE", large)
        monkeypatch.setattr(banded, "BLOCK", 5)
        band, pivots = band_of(matrix, n - 1), np.zeros(n + 3, dtype=np.int64)
        assert banded.factorise(band, n, n - 1, pivots)
        found.append((band, pivots))
    assert_array_equal(*(band for band, _ in found))
    assert_array_equal(*(pivots for _, pivots in found))
    x = np.arange(1.0, n + 1)
    banded.solve(*found[1][:1], n, n - 1, found[1][1], x)
    assert_allclose(matrix @ x, np.arange(1.0, n + 1), atol=1e-9)


def test_a_dense_singular_matrix(monkeypatch):
    monkeypatch.setattr(banded, "LARGE", 8)
    monkeypatch.setattr(banded, "BLOCK", 3)
    matrix = np.ones((9, 9))
    assert not banded.factorise(band_of(matrix, 8), 9, 8, np.zeros(9, dtype=np.int64))


def symmetric(kind, n=40):
    rng = np.random.default_rng(1)
    matrix = rng.normal(size=(n, n))
    if kind == "line":  # a band, but for the order of its rows
        order = rng.permutation(n)
        matrix = np.triu(np.tril(matrix, 2), -2)[np.ix_(order, order)]
    return 0.5 * (matrix + matrix.T)


@pytest.mark.parametrize("kind", ["line", "dense"])
def test_eigenvalues_of_large_matrices(monkeypatch, kind):
    monkeypatch.setattr(spectra, "DENSE", 5)
    matrix = symmetric(kind)
    values = np.linalg.eigvalsh(matrix)
    assert spectra.least_eigenvalue(matrix) == pytest.approx(values[0], rel=1e-12)
    lopsided = matrix + np.diag(np.arange(40.0))
    lopsided[0, 1] += 5.0
    assert spectra.norm(lopsided) == pytest.approx(np.linalg.norm(lopsided, 2), rel=1e-12)
    for shift, definite in ((1e-9, True), (-1e-9, False)):
        assert spectra.positive_definite(matrix + (shift - values[0]) * np.eye(40)) is definite
    # those of greatest magnitude are all that is asked for
    all_values = np.linalg.eigvals(lopsided)
    greatest = all_values[np.argmax(np.abs(all_values))]
    found = spectra.eigenvalues(lopsided)
    assert np.max(np.abs(found)) == pytest.approx(abs(greatest), rel=1e-3)


def test_small_matrices_are_numpys():
    matrix = symmetric("dense", 12)
    assert spectra.least_eigenvalue(matrix) == np.linalg.eigvalsh(matrix)[0]
    assert spectra.norm(matrix) == np.linalg.norm(matrix, 2)
    assert_array_equal(spectra.eigenvalues(matrix), np.linalg.eigvals(matrix))


def large_line(count=301, **changes):
    (system,) = load_scenario(
        {
            "simulation": {"duration": 0.02},
            "recording": {"period": 0.01},
            "systems": {
                "line": {
                    "game": {"type": "velocity-synchronization", **changes},
                    "agents": {"type": "flexible-robot", "count": count},
                }
            },
        }
    ).system_objects()
    return system


def test_a_long_line_is_certified_by_the_same_constants():
    """mu and theta_1 of 301 robots on a line, where bands take over, against dense ones."""
    slopes = Theorem(large_line()).slopes
    here = slopes.game.pseudo_gradient_jacobian(slopes.center)
    assert slopes.mu.value == pytest.approx(np.linalg.eigvalsh(0.5 * (here + here.T))[0], rel=1e-9)
    assert slopes.theta_1.value == pytest.approx(np.linalg.norm(here, 2), rel=1e-12)
    assert slopes.mu.label == "exact"


def test_a_system_too_large_to_examine_runs_and_says_so(monkeypatch):
    for module in ("theorem", "guarantees", "periods"):
        monkeypatch.setattr(f"gne_mj.theory.{module}.MOST_EXAMINED", 4)
    scenario = load_scenario("velocity-sync", {"simulation.duration": 0.1})
    simulation = scenario.simulation_object()
    report = simulation.run().reports["robots"]
    assert report["status"] == "completed"
    assert not report["lyapunov"]["claimed"]
    (system,) = simulation.systems
    assert "more than 4 actions" in Theorem(system).obstacles[0]
    with pytest.raises(ValueError, match="at most 4"):
        certify(system, scenario.clock())


# -------------------------------------------------------------------------------------- fleets


def numbers(count, dimension):
    rng = np.random.default_rng(count)
    table = rng.uniform(0.1, 3.0, (count, dimension, 5))
    table[:, :, :2] = table[:, :1, :2]
    return table.reshape(-1, 5)


def same_model(found, wanted):
    """All arrays and names of two compiled models."""
    for name in dir(wanted):
        value = None if name.startswith("_") else getattr(wanted, name)
        if isinstance(value, np.ndarray | int | float):
            assert_array_equal(getattr(found, name), value, name)
    for kind, count in (("body", wanted.nbody), ("joint", wanted.njnt), ("geom", wanted.ngeom),
                        ("tendon", wanted.ntendon), ("sensor", wanted.nsensor)):  # fmt: skip
        names = [[getattr(m, kind)(i).name for i in range(count)] for m in (found, wanted)]
        assert names[0] == names[1]


def by_dm_control(table, dimension, contacts):
    """The fleet as dm_control attaches robots."""
    from dm_control import mjcf

    place, model, ends = fleet.MODELS[dimension]
    world = mjcf.from_xml_string(fleet.read_model(place))
    for i, rows in enumerate(table.reshape(-1, dimension, 5), start=1):
        robot = mjcf.from_xml_string(fleet.read_model(model))
        robot.model = f"robot_{i}"
        robot.find("body", "main").inertial.mass = rows[0, 0]
        robot.find("body", "appendage").inertial.mass = rows[0, 1]
        for end, row in zip(ends, rows, strict=True):
            spring = robot.find("tendon", f"spring{end}")
            spring.stiffness, spring.damping = row[2], row[4]
        if not contacts:
            robot.find("geom", fleet.HULL).remove()
        world.attach(robot)
    if contacts:
        world.option.flag.contact = world.option.flag.constraint = "enable"
    world.option.timestep = 0.003
    world.option.integrator = "Euler"
    world.size.nuserdata = 7
    return mujoco.MjModel.from_xml_string(world.to_xml_string())


@pytest.mark.parametrize("contacts", [False, True])
@pytest.mark.parametrize("dimension", [1, 2])
def test_fleets_are_those_of_dm_control(monkeypatch, dimension, contacts):
    table = numbers(5, dimension)
    wanted = by_dm_control(table, dimension, contacts)
    for group in (200, 2):  # all at once, and in three parts
        monkeypatch.setattr(fleet, "GROUP", group)
        world = fleet.compose(table, dimension=dimension, contacts=contacts)
        found = fleet.compile_model(world, timestep=0.003, integrator="Euler", userdata=7)
        same_model(found, wanted)


def test_large_fleets_have_memory_by_their_number_and_take_the_same_steps(monkeypatch):
    changes = {"simulation.duration": 0.1}
    runs, memory = [], []
    for many in (500, 4):
        monkeypatch.setattr(fleet, "MANY", many)
        simulation = load_scenario("velocity-sync", changes).simulation_object()
        model = simulation.runs["robots"].loop.plant.model
        memory.append(model.narena)
        runs.append(simulation.run()["robots"])
    assert memory[0] != memory[1] == 2**24 + 5 * 2**14
    for name in ("action", "input", "state"):
        assert_array_equal(runs[0][name].to_numpy(), runs[1][name].to_numpy())


def test_large_fleets_have_room_for_their_estimates_at_all_stages(monkeypatch):
    monkeypatch.setattr(fleet, "MANY", 4)
    monkeypatch.setattr(fleet, "_LEAST_ARENA", 2**16)
    monkeypatch.setattr(fleet, "_ARENA_FOR_EACH", 2**11)
    world = fleet.compose(np.ones((60, 5)), decorated=False)
    model = fleet.compile_model(world, timestep=0.001, integrator="RK4", memory=3600)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data)
    assert data.maxuse_stack > 9 * 8 * 3600


def test_a_line_of_thousands_is_solved():
    """5,000 robots on a line: the equilibrium is v_0, by a band of three diagonals."""
    system = large_line(5000)
    assert system.game.actions == 5000
    assert_allclose(system.equilibrium.action, 3.0, atol=1e-9)
    assert isinstance(velocity_game(5000, 3.0, 3.0).parameters, np.ndarray)
