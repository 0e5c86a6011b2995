"""Pushes at outputs of users' robots: against MuJoCo's own mj_applyFT, and against momentum."""

import tomllib

import mujoco
import numpy as np
import pytest
from test_mjcf_outputs import OBJECTS, VESSEL

import gne_mj
from gne_mj.controllers import FullInformation
from gne_mj.errors import EngineError
from gne_mj.games import velocity_game
from gne_mj.plants.mjcf_output import Output
from gne_mj.plants.mjcf_robot import RobotFile, mjcf_robots
from gne_mj.scenario import load_scenario, scenario_of
from gne_mj.simulation import Simulation
from gne_mj.system import Clock, System
from gne_mj.viewer.controls import pushes_of
from gne_mj.viewer.shown_system import ShownSystem

H = 0.004  # s


def vessels(folder, outputs, mode="sampled", integrator="euler", text=VESSEL):
    """A simulation of vessels at rest, whose inputs turn their wheels alone, by at most 1 mN m."""
    path = folder / "vessel.xml"
    path.write_text(text)
    agents = mjcf_robots(
        tuple(RobotFile(path, output, "turn") for output in outputs), np.full(len(outputs), 1e-3)
    )
    system = System(
        "vessels", velocity_game(len(outputs), 0.0, 1e4), agents, FullInformation(), 0.1,
        agents.equilibrium(np.zeros(len(outputs))), engine="mujoco", mode=mode,
        integrator=integrator,
    )  # fmt: skip
    simulation = Simulation([system], Clock(1.0, H, H, H))
    return simulation, simulation.runs["vessels"].loop.plant


def by_mujoco(model, data, name, output, force):
    """(nv,) joint forces of a force at an output, as MuJoCo's own functions have them."""
    found, row = np.zeros(model.nv), np.zeros(model.nv)
    if output.terms:
        for term in output.terms:
            found += by_mujoco(model, data, name, term, force * term.factor)
        return found
    element = getattr(model, output.kind)(name + output.name)
    if output.kind in OBJECTS:
        body = element.id if output.kind == "body" else element.bodyid[0]
        points = {"body": data.xpos, "site": data.site_xpos, "geom": data.geom_xpos}
        frames = {"body": data.xmat, "site": data.site_xmat, "geom": data.geom_xmat}
        along = np.eye(3)[output.axis]
        if output.frame == "own":
            along = frames[output.kind][element.id].reshape(3, 3) @ along
        pull, turn = (np.zeros(3), along) if output.angular else (along, np.zeros(3))
        point = points[output.kind][element.id]
        mujoco.mj_applyFT(model, data, force * pull, force * turn, point, body, found)
    elif output.kind == "joint":
        found[element.dofadr[0] + max(output.axis, 0) + 3 * output.angular] = force
    else:
        rows = {
            "tendon": (data.ten_J, model.ten_J_rownnz, model.ten_J_rowadr, model.ten_J_colind),
            "actuator": (
                data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind,
            ),
        }  # fmt: skip
        values, count, first, columns = rows[output.kind]
        part = slice(first[element.id], first[element.id] + count[element.id])
        row[columns[part]] = values[part]
        found += force * row
    return found


def test_a_push_is_the_joint_forces_that_mujoco_makes_of_it(tmp_path):
    """At outputs of all kinds, as the robots turn; no force of it is left when it is over."""
    frames = [
        Output(kind, name, angular, frame, axis)
        for (kind, name), angular, frame, axis in (
            (("body", "mast"), False, "world", 0), (("body", "mast"), True, "own", 1),
            (("body", "hull"), False, "world", 2), (("body", "hull"), True, "own", 0),
            (("body", "hull"), False, "own", 1), (("site", "tip"), False, "own", 0),
            (("site", "bow"), False, "world", 1), (("site", "bow"), True, "world", 2),
            (("geom", "rim"), False, "own", 2), (("geom", "top"), False, "world", 2),
        )
    ]  # fmt: skip
    parts = (Output("site", "bow", axis=0, frame="own"), Output("tendon", "belt", factor=-3.0))
    outputs = [
        *frames, Output("tendon", "belt"), Output("actuator", "turn"), Output("joint", "roll"),
        Output("joint", "free", axis=1), Output("sum", terms=parts),
    ]  # fmt: skip
    simulation, plant = vessels(tmp_path, outputs)
    model, forces = plant.model, np.linspace(-3.0, 4.0, len(outputs))
    units = ["N", "N m", "N", "N m", "N", "N", "N", "N m", "N", "N", "N", "N m", "N m", "N", "N"]
    assert [plant.push_unit(r) for r in range(len(outputs))] == units
    for channel, force in enumerate(forces):
        simulation.push("vessels", channel, force, 0.2)
    for _ in range(3):
        simulation.advance(15)
        other = mujoco.MjData(model)
        other.qpos[:], other.qvel[:] = plant.data.qpos, plant.data.qvel
        mujoco.mj_forward(model, other)
        expected = sum(
            by_mujoco(model, other, f"robot_{r + 1}/", output, force)
            for r, (output, force) in enumerate(zip(outputs, forces, strict=True))
        )
        simulation.advance(1)
        assert np.allclose(plant.data.qfrc_applied, expected, rtol=0, atol=1e-12)
    assert np.max(np.abs(plant.data.qvel)) > 0.3
    simulation.advance(10)
    assert not np.any(plant.data.qfrc_applied)


@pytest.mark.parametrize("mode", ["continuous", "sampled"])
def test_a_push_off_the_centre_gives_momentum_and_turns(tmp_path, mode):
    """A vessel's momentum grows by F T, its angular momentum by the integral of p x F; inputs,
    which turn its wheel, give none."""
    outputs = [Output("site", "bow", axis=1), Output("site", "tip", axis=0, frame="own")]
    simulation, plant = vessels(tmp_path, outputs, mode, "rk4")
    model, data = plant.model, plant.data
    hulls = [model.body(f"robot_{i}/hull").id for i in (1, 2)]
    points = [model.site("robot_1/bow").id, model.site("robot_2/tip").id]

    def momenta():
        """Of both, (2, 6): linear, and angular about the world's origin."""
        mujoco.mj_forward(model, data)
        found = np.zeros((2, 6))
        for k, hull in enumerate(hulls):
            for body in range(hull, hull + 3):
                velocity = np.empty(6)
                mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, body, velocity, 0)
                turn = data.ximat[body].reshape(3, 3)
                part = model.body_mass[body] * velocity[3:]
                found[k, :3] += part
                found[k, 3:] += np.cross(data.xipos[body], part)
                found[k, 3:] += turn @ np.diag(model.body_inertia[body]) @ turn.T @ velocity[:3]
        return found

    def pull():
        """What a unit of each force gives of that, in s."""
        along = [np.eye(3)[1], data.site_xmat[points[1]].reshape(3, 3)[:, 0]]
        return np.array([
            [*each, *np.cross(data.site_xpos[point], each)]
            for each, point in zip(along, points, strict=True)
        ])  # fmt: skip

    before, forces = momenta(), np.array([[3.0], [-0.2]])
    rates = [pull()]
    for channel, force in enumerate(forces.ravel()):
        simulation.push("vessels", channel, force, 0.4)
    for _ in range(100):
        simulation.advance(1)
        now = momenta()
        rates.append(pull())
    simpson = np.array([1.0, *[4.0, 2.0] * 49, 4.0, 1.0]) * H / 3.0
    gained = forces * np.einsum("t,tkj->kj", simpson, np.array(rates))
    assert gained[0, :3] == pytest.approx([0.0, 1.2, 0.0])  # F T
    assert np.allclose(now - before, gained, rtol=0, atol=5e-6)
    simulation.advance(10)
    assert np.allclose(momenta(), now, rtol=0, atol=5e-6)


def test_a_push_at_what_a_sensor_alone_tells_is_refused(tmp_path):
    simulation, _plant = vessels(tmp_path, [Output("sensor", "nearing", axis=0), "roll"])
    with pytest.raises(EngineError, match="sensor 'nearing', x is told by a sensor alone"):
        simulation.push("vessels", 0, 1.0, 0.1)
    assert simulation.interventions == []
    simulation.push("vessels", 1, 1.0, 0.1)
    assert simulation.interventions[0]["what"] == "robot 2 pushed by 1 N m for 0.1 s"


def test_a_page_knows_in_whose_frame_a_force_is():
    (cars,), (drones,) = (load_scenario(name).system_objects() for name in ("cars", "drones"))
    shown = [ShownSystem(each, Clock(1.0, H, H, H)) for each in (cars, drones)]
    of_cars, of_drones = pushes_of(shown)
    (way,) = of_cars["ways"][1]
    assert way["along"] == pytest.approx([1.0, 0.0, 0.0])
    assert way["item"] == shown[0].fleet.places["anchors"][1]  # its body, which turns
    ways = of_drones["ways"][5]
    assert [each["along"] for each in ways] == np.eye(3).tolist()
    assert [each["item"] for each in ways] == [None] * 3
    assert (of_cars["force"], of_drones["force"]) == (5.0, 2.0)  # 4.6 kg, 0.38 kg


def test_pushed_cars_run_again_to_the_last_bit():
    """Forward at a point of theirs, which turns; live in pieces, and by a file without a page."""
    simulation = load_scenario("cars", {"simulation.duration": 0.5}).simulation_object()
    simulation.advance(20)
    simulation.push("cars", 1, 5.0, 0.2)
    simulation.advance(7)
    simulation.push("cars", 3, -2.0, 0.1)
    by_hand = simulation.run()
    again = gne_mj.run(tomllib.loads(scenario_of(by_hand).toml()))
    for name in ("action", "configuration", "input"):
        assert np.array_equal(by_hand["cars"][name], again["cars"][name], equal_nan=True)
    assert again.interventions == by_hand.interventions
    assert again.interventions[0]["what"] == "robot 2 pushed by 5 N for 0.2 s"
    free = gne_mj.run("cars", {"simulation.duration": 0.5})["cars"]["action"]
    assert float(abs(free - by_hand["cars"]["action"]).max()) > 1e-3
