"""A fleet of the user's own robots as compiled code sees it, and its map over a control period.

Nothing but MuJoCo knows how such robots move. The outputs at the end of a control period are
therefore found by stepping a second mjData from the same state; it bears no mark, so that no
callback of a loop acts on it.
"""

from gne_mj.native import kernel
from gne_mj.plants.native_mujoco import call, call_state, field, timed_step
from gne_mj.table import integers

# Of a fleet's table (see gne_mj.plants.mujoco): where the robots' numbers are, and sizes
PLACES, _, SIZES = range(3)
NQ, NV, NU = range(3)
SENSORDATA, TWIN, MJ_STEP, MJ_FORWARD, MJ_COPY, KNOWN = range(7, 13)  # more entries of SIZES
# Addresses of the functions that sensors of velocities need, in their order
SENSOR_FUNCTIONS = ("mj_fwdPosition", "mj_fwdVelocity", "mj_sensorVel")
FIRST_OF_SENSORS, LAST_OF_SENSORS = 13, 15

# A channel's row of PLACES: the joint's degree of freedom or (negative) the sensor's entry less
# one, the joint's entry of qpos or -1, the actuator's of ctrl
OUTPUT_AT, POSITION_AT, ACTUATOR, PLACES_COUNT = range(4)


@kernel
def gather(at, data, table, state):
    """Fill the flat state (m channels of mjcf_robot.STATES) from mjData."""
    sizes = integers(table, SIZES)
    qpos, qvel = field(data, at.qpos, sizes[NQ]), field(data, at.qvel, sizes[NV])
    sensordata = field(data, at.sensordata, sizes[SENSORDATA])
    places = integers(table, PLACES)
    for r in range(len(places) // PLACES_COUNT):
        source = places[r * PLACES_COUNT + OUTPUT_AT]
        position = places[r * PLACES_COUNT + POSITION_AT]
        state[2 * r] = qvel[source] if source >= 0 else sensordata[-source - 1]
        state[2 * r + 1] = qpos[position] if position >= 0 else 0.0


@kernel
def refresh(model, data, table):
    """Bring sensors of velocities up to date, which are of the last step's start."""
    sizes = integers(table, SIZES)
    if sizes[MJ_FORWARD] != 0:
        for function in range(FIRST_OF_SENSORS, LAST_OF_SENSORS + 1):
            call(sizes[function], model, data)


@kernel
def actuator_of(places, r):
    """Which entry of ctrl is the input of channel r."""
    return places[r * PLACES_COUNT + ACTUATOR]


@kernel
def roll(channels, clock, state, u, scratch):
    """Not known without MuJoCo: late sensors of such robots are refused in mode implicit."""


@kernel
def predict(context, channels, clock, state, u, out, trial, scratch):
    """Fill out (m,) with the outputs after a control period under u (m,), by a second mjData.

    The arguments are as :func:`gne_mj.plants.held_map.predict` has them, but that it starts from
    the simulation itself and not from ``state``.
    """
    at, model, data, table = context
    sizes, places = integers(table, SIZES), integers(table, PLACES)
    twin = sizes[TWIN]
    call_state(sizes[MJ_COPY], model, data, twin, sizes[KNOWN])
    ctrl = field(twin, at.ctrl, sizes[NU])
    for r in range(len(u)):
        ctrl[actuator_of(places, r)] = u[r]
    for _ in range(clock.period):
        timed_step(at, sizes[MJ_STEP], model, twin)
    if sizes[MJ_FORWARD] != 0:  # sensors are of the last step's start
        call(sizes[MJ_FORWARD], model, twin)
    gather(at, twin, table, trial)
    for r in range(len(u)):
        out[r] = trial[2 * r]


@kernel
def is_affine(clock):
    """Never taken for granted: actuators have dynamics, joints limits, bodies contacts."""
    return False
