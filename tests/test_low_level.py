"""Low-level controllers, each against bare MuJoCo with the same law in plain Python."""

import mujoco
import numpy as np
import pytest
from builders import run_loop
from low_level_robots import (
    ARM,
    BOAT,
    CAR,
    CART,
    FRICTIONLESS,
    FRICTIONLESS_KERNELS,
    QUADROTOR,
    fleet,
    quadrotor_law,
)  # fmt: skip
from scipy.integrate import solve_ivp

import gne_mj.user_files  # noqa: F401  registers controllers of the user's own
import reference
import reference_games
from gne_mj.controllers import FullInformation
from gne_mj.errors import InvalidInput, UserCodeError
from gne_mj.games import velocity_game
from gne_mj.plants import acting_forces
from gne_mj.plants.mjcf_robot import MjcfAgents
from gne_mj.system import System

ROTORS = {"controller": "quadrotor", "rotors": ["m1", "m2", "m3", "m4"]}
WHEELS = {"controller": "differential-drive", "wheels": ["left", "right"]}


def bare(path, timestep, integrator="EULER"):
    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.timestep = timestep
    model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


@pytest.mark.parametrize("axes", ["xyz", "x"])
def test_a_quadrotor_is_that_of_plain_python(tmp_path, axes):
    """600 steps with a wish that changes, from a heading of 40 degrees."""
    path, given = tmp_path / "q.xml", {**ROTORS, "axes": list(axes)}
    output = {"body": "frame", "axes": list(axes)}
    plant = fleet(path, QUADROTOR, given, output, len(axes))
    plant.reset(np.zeros((len(axes), 2)))
    model, data = bare(path, 0.002)
    place, heading = data.qpos[:3].copy(), data.xmat[1].reshape(3, 3)[:, 0].copy()
    for wish in ([0.9, -0.8, 0.5], [-2.0, 3.0, 40.0], [-7.0, 2.0, 0.0]):
        u = np.where([axis in axes for axis in "xyz"], wish, np.nan)
        plant.step(u[: len(axes)], 200)
        for _ in range(200):
            mujoco.mj_forward(model, data)
            data.ctrl[:] = quadrotor_law(model, data, u, place, heading)
            mujoco.mj_step(model, data)
        assert np.allclose(plant.data.qpos, data.qpos, rtol=0, atol=1e-12)
        assert np.allclose(plant.data.qvel, data.qvel, rtol=0, atol=1e-11)
    # upwards and tilted as asked for, it wants more than the rotors give
    met = plant.limits_met[0]
    assert ("m3" in met) == (axes == "xyz")
    assert met["controller"] == pytest.approx(1 / 3)  # the last wish is beyond the tilt


def test_a_quadrotor_hovers_and_comes_back_to_its_attitude(tmp_path):
    """At rest to rounding; pushed out of it by 0.2 rad the tilt follows (1 + w t) exp(-w t)."""
    plant = fleet(tmp_path / "q.xml", QUADROTOR, ROTORS, {"body": "frame"}, 3)
    plant.reset(np.zeros((3, 2)))
    plant.step(np.zeros(3), 500)
    assert np.allclose(plant.data.qvel, 0, rtol=0, atol=1e-10)
    plant.reset(np.zeros((3, 2)))
    mujoco.mju_mulQuat(
        plant.data.qpos[3:7], plant.data.qpos[3:7].copy(), [np.cos(0.1), np.sin(0.1), 0, 0]
    )
    for step in range(100):
        up = plant.data.xmat[plant.model.body("robot_1/frame").id].reshape(3, 3)[2, 2]
        t = 0.002 * step
        if step:
            assert abs(np.arccos(up) - 0.2 * (1 + 20 * t) * np.exp(-20 * t)) < 0.004
        plant.step(np.zeros(3))


def asked(y):
    """What the law asks three or two agents for at y, by the paper's equations."""
    game = reference_games.VelocityGame(1.0, np.full(len(y), 2.0))
    return reference.full_information(game, 0.1, y)


def stages(robots, place, heading, step):
    """A step of Runge and Kutta's of bare robots under the plain law, asked at every stage."""
    starts = [(data.qpos.copy(), data.qvel.copy()) for _, data in robots]
    moved = [[(np.zeros(model.nv), np.zeros(model.nv))] for model, _ in robots]
    for share in (0.0, 0.5, 0.5, 1.0):
        for (model, data), (qpos, qvel), rates in zip(robots, starts, moved, strict=True):
            data.qpos[:], data.qvel[:] = qpos, qvel + share * step * rates[-1][1]
            mujoco.mj_integratePos(model, data.qpos, rates[-1][0], share * step)
            mujoco.mj_forward(model, data)
        u = asked(np.array([data.qvel[0] for _, data in robots]))
        for (model, data), wish, rates in zip(robots, u, moved, strict=True):
            wishes = np.array([wish, np.nan, np.nan])
            data.ctrl[:] = quadrotor_law(model, data, wishes, place, heading)
            mujoco.mj_forward(model, data)
            rates.append((data.qvel.copy(), data.qacc.copy()))
    for (model, data), (qpos, qvel), (_, *rates) in zip(robots, starts, moved, strict=True):
        velocity, acceleration = np.average(rates, axis=0, weights=(1, 2, 2, 1))
        data.qpos[:], data.qvel[:] = qpos, qvel + step * acceleration
        mujoco.mj_integratePos(model, data.qpos, velocity, step)


MODES = [
    ("rk4", "continuous", 0.002),
    ("euler", "sampled", 0.02),
    pytest.param("rk4", "implicit", 0.1, marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("integrator", "mode", "period"), MODES)
def test_quadrotors_in_the_native_loops(tmp_path, integrator, mode, period):
    """The plain law, asked at all stages or under the recorded inputs; what implicit predicts."""
    path = tmp_path / "q.xml"
    path.write_text(QUADROTOR)
    agents = MjcfAgents(
        type="mjcf-robot", count=3, file=str(path), output={"body": "frame", "axes": ["x"]},
        input={**ROTORS, "axes": ["x"]},
    ).build((1,) * 3)  # fmt: skip
    y = np.array([0.3, 0.5, 0.1])
    system = System(
        "quadrotors", velocity_game(3, 1.0, 2.0), agents, FullInformation(), 0.1,
        agents.equilibrium(y), engine="mujoco", mode=mode, integrator=integrator,
    )  # fmt: skip
    states, inputs, _, loop = run_loop(system, 0.002, 100, period)
    if mode == "implicit":
        assert loop.monitor.prediction < 1e-12
    if mode == "continuous":
        robots = [bare(path, 0.002) for _ in y]
        data = robots[0][1]
        place, heading = data.qpos[:3].copy(), data.xmat[1].reshape(3, 3)[:, 0].copy()
        for (_, data), speed in zip(robots, y, strict=True):
            data.qvel[0] = speed
        for at in states[:, :, 0]:
            # 16 steps were divided, the law being quick there: to rounding until the first of them
            assert np.allclose([data.qvel[0] for _, data in robots], at, rtol=0, atol=5e-9)
            stages(robots, place, heading, 0.002)
    if mode == "sampled":
        model, data = bare(path, 0.002)
        place, heading = data.qpos[:3].copy(), data.xmat[1].reshape(3, 3)[:, 0].copy()
        data.qvel[0] = y[0]
        for u, at in zip(inputs[:-1, 0], states[:-1, 0, 0], strict=True):
            assert data.qvel[0] == pytest.approx(at, abs=1e-12)
            mujoco.mj_forward(model, data)
            wish = np.array([u, np.nan, np.nan])
            data.ctrl[:] = quadrotor_law(model, data, wish, place, heading)
            mujoco.mj_step(model, data)


@pytest.mark.parametrize("planar", [False, True])
def test_a_cars_wheels_give_the_power_that_is_asked_for(tmp_path, planar):
    """u . y is the sum of tau omega where wheels roll; y is the site's own velocity."""
    given = {**WHEELS, "site": "nose"} if planar else WHEELS
    output = (
        {"site": "nose", "axes": ["x", "y"]} if planar
        else {"body": "car", "frame": "own", "axes": ["x"]}
    )  # fmt: skip
    plant = fleet(tmp_path / "car.xml", CAR, given, output, 1 + planar, timestep=0.001)
    plant.reset(np.zeros((1 + planar, 2)))
    plant.step(np.zeros(1 + planar), 500)
    u, data, supplied, missed = np.array([2.0, 1.5])[: 1 + planar], plant.data, 0.0, 0.0
    wheels = [plant.model.joint(f"robot_1/{side}").dofadr[0] for side in ("left", "right")]
    for _ in range(500):
        y, rates = plant.output, data.qvel[wheels].copy()
        plant.step(u)
        supplied += u @ y
        missed += u @ y - data.qfrc_actuator[wheels] @ rates
    assert supplied * 0.001 > 0.1
    assert abs(missed) < 0.02 * supplied
    # where they roll without any slip, it is so to rounding
    plant.reset(np.zeros((1 + planar, 2)))
    v, turning = 0.7, -1.1
    ahead, left = np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])
    data.qvel[:2] = v * ahead + 0.05 * turning * left  # the axle is 0.05 m behind
    data.qvel[5] = turning
    data.qpos[3:7] = np.cos(0.15), 0.0, 0.0, np.sin(0.15)
    data.qvel[wheels] = (v - 0.15 * turning) / 0.1, -(v + 0.15 * turning) / 0.1
    mujoco.mj_forward(plant.model, data)
    y, rates = plant.output, data.qvel[wheels].copy()
    plant.step(u)
    assert data.qfrc_actuator[wheels] @ rates == pytest.approx(u @ y, rel=1e-12)


def test_a_cars_heading_is_held(tmp_path):
    """Against a push that turns it; without holding it turns away."""
    turned = []
    for more in ({}, {"hold_heading": 15.0}):
        plant = fleet(
            tmp_path / "car.xml", CAR, {**WHEELS, **more},
            {"body": "car", "frame": "own", "axes": ["x"]}, 1,
        )  # fmt: skip
        plant.reset(np.zeros((1, 2)))
        plant.data.qfrc_applied[5] = 0.3
        plant.step([0.5], 500)
        turned.append(np.arcsin(plant.data.xmat[plant.model.body("robot_1/car").id][3]))
    assert abs(turned[1]) < 0.2 * abs(turned[0])


HAND = {"controller": "hand", "joints": list("abcd"), "site": "hand"}
SCREWS = {"controller": "two-screws", "screws": ["port", "starboard"], "body": "hull"}


def test_a_boats_screws_give_the_power_that_is_asked_for(tmp_path):
    """F v + M omega is that of thrusts at their sites; at the bow but for what sways."""
    output = [
        {"body": "hull", "frame": "own", "axes": ["x"]},
        {"body": "hull", "velocity": "angular", "axes": ["z"]},
    ]
    plant = fleet(tmp_path / "boat.xml", BOAT, SCREWS, output, 2)
    plant.reset([[0.5, 0.0], [0.2, 0.0]])
    data, u = plant.data, np.array([8.0, -1.5])
    for _ in range(300):
        y, rates = plant.output, data.actuator_velocity.copy()
        plant.step(u)
        rates = data.actuator_velocity  # of the step's start, with the gears
        assert data.actuator_force @ rates == pytest.approx(u @ y, rel=1e-9)
    assert abs(data.qvel[1]) > 1e-4  # it sways, which the water and the turn do
    plant = fleet(
        tmp_path / "boat.xml", BOAT, {**SCREWS, "site": "bow"},
        {"site": "bow", "axes": ["x", "y"]}, 2,
    )  # fmt: skip
    plant.reset(np.zeros((2, 2)))
    plant.step(u, 300)
    y, hull = plant.output, plant.model.body("robot_1/hull").id
    sway = plant.data.xmat[hull].reshape(3, 3)[:2, 1]
    plant.step(u)
    supplied = plant.data.actuator_force @ plant.data.actuator_velocity
    aside = u @ sway * (plant.data.cvel[hull, 3:5] @ sway)
    assert supplied == pytest.approx(u @ y - aside, rel=1e-3)


def test_an_arms_hand_is_pulled_by_the_jacobians_transpose(tmp_path):
    """Joint torques against mj_jacSite and mj_jacSubtreeCom; at no force the arm stays."""
    given = HAND
    plant = fleet(tmp_path / "arm.xml", ARM, given, {"site": "hand"}, 3, contacts="none")
    model, data, rng = plant.model, plant.data, np.random.default_rng(1)
    plant.reset(np.zeros((3, 2)))
    plant.step(np.zeros(3), 500)
    assert np.allclose(data.qvel, 0, rtol=0, atol=1e-11)
    jacobian, of_mass = np.zeros((3, 4)), np.zeros((3, 4))
    for _ in range(5):
        data.qpos[:], data.qvel[:] = rng.normal(size=(2, 4))
        mujoco.mj_forward(model, data)
        mujoco.mj_jacSite(model, data, jacobian, None, model.site("robot_1/hand").id)
        mujoco.mj_jacSubtreeCom(model, data, of_mass, model.body("robot_1/rail").id)
        u, y = rng.normal(size=3), plant.output
        expected = jacobian.T @ u - of_mass.T @ model.opt.gravity * 3.6
        assert u @ y == pytest.approx(u @ jacobian @ data.qvel, rel=1e-12)
        plant.step(u)
        assert np.allclose(data.qfrc_actuator, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("tau", [None, 0.7])
def test_what_acts_behind_a_controller_is_its_drag_and_not_the_weight_it_holds(tmp_path, tau):
    """In air, tilted and under way: the fluid's force on all of it, whatever the thrust does."""
    text = QUADROTOR.replace("<option/>", '<option density="1.2" wind="2 0 0"/>')
    more = {} if tau is None else {"lookahead": tau, "local_damping": 0.0}
    plant = fleet(tmp_path / "q.xml", text, ROTORS, {"body": "frame"}, 3, **more)
    plant.reset(plant.state)
    plant.step([0.8, -0.5, 0.3], 300)
    mujoco.mj_forward(plant.model, plant.data)
    mass = np.empty((6, 6))
    mujoco.mj_fullM(plant.model, plant.data, mass)
    moves = np.linalg.inv(mass)[:3]  # the centre of mass is off the frame's origin
    drag = np.linalg.solve(moves[:, :3], moves @ plant.data.qfrc_fluid)
    balance = acting_forces.balance(plant, np.array([0.8, -0.5, 0.3]), 1)
    assert not balance["gravity"].any()
    assert np.allclose(balance["fluid"], -drag, rtol=0.01, atol=1e-3 * np.abs(drag).max())


@pytest.mark.parametrize("held", [True, False])
def test_a_weight_is_a_load_where_a_hand_does_not_hold_it(tmp_path, held):
    joints = {"controller": "hand", "joints": ["a", "b", "c", "d"], "site": "hand"}
    given = {**joints, "hold_weight": held}
    plant = fleet(tmp_path / "arm.xml", ARM, given, {"site": "hand"}, 3, contacts="none")
    plant.reset(np.zeros((3, 2)))
    gravity = acting_forces.balance(plant, np.zeros(3), 1)["gravity"]
    assert gravity.any() != held
    if not held:  # a force at the hand that keeps it where it is for a step
        assert np.linalg.norm(gravity) > 1.0
        plant.reset(np.zeros((3, 2)))
        plant.step(gravity, 1)
        assert np.max(np.abs(plant.output)) < 1e-5


def test_servos_with_a_ctrlrange_give_forces_and_count_where_they_do_not(tmp_path):
    """A cart of 2 kg goes as under the force itself, until its servo clamps."""
    motor = '<motor name="push" joint="x" gear="4"/>'
    for servo, most in (
        ('<velocity name="push" joint="x" kv="3" gear="2" ctrlrange="-1 1"/>', None),
        ('<position name="push" joint="x" kp="6" kv="1" gear="-2" ctrlrange="-1 1"/>', None),
        ('<velocity name="push" joint="x" kv="3" ctrlrange="-9 9" forcerange="-1 1"/>', 1.0),
    ):
        text = CART.replace(motor, servo).replace('damping="1.5"', "")
        given = {"controller": "servo", "actuators": ["push"]}
        plant = fleet(tmp_path / "cart.xml", text, given, "x", 1)
        plant.reset([[0.1, 0.0]])
        plant.step([0.8], 200)
        assert plant.output[0] == pytest.approx(0.1 + 0.4 * 0.4, abs=1e-12)
        assert plant.limits_met == {0: {}}
        plant.step([8.0], 100)
        assert plant.output[0] < 0.26 + 4.0 * 0.2 - 0.1
        name, rate = ("controller", most) if most else ("push", None)
        assert plant.limits_met[0][name] == pytest.approx(1 / 3, abs=0.1)
        if rate:
            assert plant.data.qfrc_actuator[0] == pytest.approx(rate)


@pytest.mark.parametrize(
    ("text", "given", "axes", "key", "words"),
    [
        (QUADROTOR, {**ROTORS, "rotors": ["m1", "m2", "m3", "m3"]}, 3, "rotors", "three moments"),
        (QUADROTOR, {**ROTORS, "rotors": ["m1", "m2", "m3", "m5"]}, 3, "rotors", "did you mean"),
        (QUADROTOR, {**ROTORS, "axes": ["x"]}, 3, "axes", "name as many axes"),
        (
            CAR,
            {**WHEELS, "wheels": ["right", "left"]},
            1,
            "wheels",
            "first one must be on its left",
        ),
        (CAR, {**WHEELS, "hold_heading": 1.0}, 2, "hold_heading", "one entry"),
        (CAR, {**WHEELS, "site": "nose"}, 1, "site", "two entries"),
        (BOAT, {**SCREWS, "screws": ["port", "port"]}, 1, "screws", "left of the other"),
        (BOAT, {**SCREWS, "body": None}, 1, "body", "has 0 free joints"),
        (ARM, {"controller": "servo", "actuators": ["b"]}, 1, "actuators", "velocity servo of a"),
        (ARM, {**HAND, "joints": ["a", "b"]}, 2, "joints", "'elbow'"),
    ],
)
def test_what_does_not_fit_is_told(tmp_path, text, given, axes, key, words):
    with pytest.raises(InvalidInput, match=rf"agents.input.{key}: .*{words}"):
        fleet(tmp_path / "robot.xml", text, given, {"site": "any"}, axes)


def frictionless(folder, text=FRICTIONLESS, **more):
    path = folder / "own.py"
    path.write_text(text)
    return {
        "controller": "custom", "file": str(path), "actuators": ["push"], "readings": ["x"],
        "parameters": {"mass": 2.0, "gain": 20.0}, **more,
    }  # fmt: skip


@pytest.mark.parametrize("text", [FRICTIONLESS, FRICTIONLESS_KERNELS])
def test_a_users_own_has_a_memory(tmp_path, text):
    """Plain functions and kernels, against bare MuJoCo; the memory's rate is that of a step."""
    plant = fleet(tmp_path / "cart.xml", CART, frictionless(tmp_path, text), "x", 1, count=2)
    plant.reset([[0.3, 0.0], [-0.1, 0.0]])
    plant.step([1.2, 0.0], 100)
    expected = []
    for v, u in ((0.3, 1.2), (-0.1, 0.0)):
        model, data = bare(tmp_path / "cart.xml", 0.002)
        data.qvel[0] = memory = v
        for _ in range(100):
            data.ctrl[0] = (u + 2.0 * 20.0 * (memory - data.qvel[0])) / 4
            memory += 0.002 * u / 2.0
            mujoco.mj_step(model, data)
        expected.append(data.qvel[0])
    assert np.allclose(plant.output, expected, rtol=0, atol=1e-12)
    assert abs(plant.output[0] - (0.3 + 0.6 * 0.2)) < 0.02


@pytest.mark.parametrize(("integrator", "mode", "period"), MODES)
def test_a_memory_in_the_native_loops(tmp_path, integrator, mode, period):
    """Both forms give the same run: in continuous time SciPy's; which implicit predicts."""
    (tmp_path / "cart.xml").write_text(CART)
    found = []
    for text in (FRICTIONLESS, FRICTIONLESS_KERNELS):
        agents = MjcfAgents(
            type="mjcf-robot", count=2, file=str(tmp_path / "cart.xml"), output="x",
            input=frictionless(tmp_path, text),
        ).build((1, 1))  # fmt: skip
        system = System(
            "carts", velocity_game(2, 1.0, 2.0), agents, FullInformation(), 0.1,
            agents.equilibrium(np.array([0.3, 0.5])), engine="mujoco", mode=mode,
            integrator=integrator,
        )  # fmt: skip
        states, _, _, loop = run_loop(system, 0.002, 100, period)
        assert mode != "implicit" or loop.monitor.prediction < 1e-12
        found.append(states[:, :, 0])
    assert np.allclose(found[1], found[0], rtol=0, atol=1e-12)
    if mode == "continuous":

        def rate(_, both):
            v, memory = both.reshape(2, 2)
            u = asked(v)
            return np.ravel([(u + 2.0 * 20.0 * (memory - v) - 1.5 * v) / 2.0, u / 2.0])

        times = 0.002 * np.arange(101)
        exact = solve_ivp(rate, (0.0, 0.2), [0.3, 0.5] * 2, "DOP853", times, rtol=1e-12, atol=1e-12)
        assert np.allclose(found[0], exact.y[:2].T, rtol=0, atol=1e-8)


@pytest.mark.parametrize(
    ("text", "more", "words"),
    [
        ("x = 1", {}, "it must define control"),
        ("def control(:", {}, "input.file: got '.*own.py', but Python must run it"),
        ("def control(readings, u): return [0]", {"parameters": {}}, "must define control"),
        (FRICTIONLESS, {"readings": ["y"]}, "input.readings: got 'y'"),
        (FRICTIONLESS, {"actuators": ["pull"]}, "did you mean 'push'"),
        (FRICTIONLESS_KERNELS, {"parameters": {"mass": 1.0}}, "own.py has mass, gain"),
        (FRICTIONLESS.replace("return [readings[0]]", "return [1, 2]"), {}, "a list of 1 numbers"),
        (FRICTIONLESS.replace("u[0] / mass", "undefined"), {}, "own.py, line 10"),
        (FRICTIONLESS.replace("u[0] / mass", "float('nan')"), {}, "must return finite numbers"),
        (FRICTIONLESS.replace("MEMORY = 1", "MEMORY = -3"), {}, "from 0 to 1000, and is -3"),
        (FRICTIONLESS.replace("MEMORY = 1", "MEMORY = 1.0"), {}, "from 0 to 1000, and is 1.0"),
    ],
)
def test_what_is_wrong_with_a_users_own_is_told(tmp_path, text, more, words):
    def attempt():
        plant = fleet(tmp_path / "cart.xml", CART, frictionless(tmp_path, text, **more), "x", 1)
        plant.reset([[0.0, 0.0]])
        plant.step([1.0])

    with pytest.raises((InvalidInput, UserCodeError), match=words):
        attempt()
