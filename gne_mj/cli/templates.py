"""What `gne-mj new` writes: for each kind the files, NAME standing for the name that is given."""

_GAME = '''"""NAME: a game as it is on paper. Change the formulas; all else follows from them."""


def cost(i, y, p):
    """J_i, which agent i = 0, 1, ... minimises by its own y[i]; p has the parameters."""
    return 0.5 * p.weight[i] * (y[i] - p.wanted[i]) ** 2 + p.price * y[i] * y.mean()


def constraints(y, p):
    """What all must keep, each with a name; abs(...) <= bound has two sides."""
    yield "budget", (y**2).sum() <= p.budget
    for i in range(len(y)):
        yield f"gap {i + 1}", abs(y[i] - y[i - 1]) <= p.gap  # y[-1] is the last one
'''

_PARAMETERS = """
[systems.robots.game.parameters]      # numbers of the formulas: one for all, or a list
weight = 1.0
wanted = [1.0, 1.5, 2.0, 2.5]
price = 0.2
budget = 12.0
gap = 1.0
"""

_SCENARIO = """description = "NAME"

[simulation]
duration = 10.0                 # s
timestep = 0.005                # s

[systems.robots.game]
type = "expressions"
cost = "0.5 * weight[i] * (y[i] - wanted[i])**2 + price * y[i] * y.mean()"

[systems.robots.game.constraints]     # one that has i is one for each agent
budget = "(y**2).sum() <= budget"
gap = "abs(y[i] - y[i-1]) <= gap"
"""

_GAME_SCENARIO = """description = "NAME"

[simulation]
duration = 10.0                 # s
timestep = 0.005                # s

[systems.robots.game]
type = "expressions"
file = "NAME.py"
"""

_AGENTS = """
[systems.robots.agents]
type = "flexible-robot"         # or "integrator", "pi-cascade", ...
count = 4

[systems.robots.barrier]
rho = 0.05                      # penalty: smaller is nearer to the equilibrium and to the bounds
"""

_FULL = """
[systems.robots.controller]
information = "full"            # or "partial", "distributed" with epsilon, over a graph
"""

_LAW = '''"""NAME: a law of plain functions. u drives outputs up, so it descends the costs."""

from gne_mj.barrier import LogBarrier


def initial_memory(y, gain, time_constant):
    """The memory at the start, here a filtered copy of y; leave it and `rate` out for none."""
    return y


def rate(game, rho, y, memory, gain, time_constant):
    """How the memory moves, per second."""
    return (y - memory) / time_constant


def action(game, rho, y, memory, gain, time_constant):
    """u, one number for each of y. The barrier keeps all constraints, so let it be whole."""
    descent = game.pseudo_gradient(y) + LogBarrier(game, rho).gradient(y)
    return -gain * descent - (y - memory)
'''

_LAW_TABLE = """
[systems.robots.controller]
information = "custom"
file = "NAME.py"

[systems.robots.controller.parameters]
gain = 1.0
time_constant = 0.5             # s
"""

_ROBOT = """<!-- NAME: one of a fleet. y_i is a joint's velocity, u_i the force of a motor. -->
<mujoco model="NAME">
  <option gravity="0 0 -9.81"/>
  <default>
    <geom contype="0" conaffinity="0"/>
  </default>
  <worldbody>
    <body name="cart" pos="0 0 1">
      <joint name="travel" type="slide" axis="1 0 0"/>
      <geom type="box" size="0.2 0.15 0.05" mass="2" rgba="0.20 0.42 0.69 1"/>
      <body name="load" pos="0 0 -0.5">
        <joint name="swing" type="hinge" axis="0 1 0" pos="0 0 0.5" damping="1"/>
        <geom type="sphere" size="0.1" mass="0.5" rgba="0.84 0.37 0.25 1"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="drive" joint="travel"/>
  </actuator>
</mujoco>
"""

_ROBOT_SCENARIO = """description = "NAME"

[simulation]
duration = 10.0                 # s
timestep = 0.005                # s

[systems.robots.game]
type = "velocity-synchronization"
reference_velocity = 1.0        # m/s, which the first one follows, each other the one before
gap_bound = 1.5                 # m/s

[systems.robots.agents]
type = "mjcf-robot"
count = 3
file = "NAME.xml"               # one for all, or a list with one each
output = "travel"               # the joint whose velocity is y_i
input = "drive"                 # the actuator that u_i drives

[systems.robots.initial]
action = 0.5                    # m/s
"""

# Of each kind its files by their ends, the last one what `run` takes
TEMPLATES = {
    "game": {".py": _GAME, ".toml": _GAME_SCENARIO + _PARAMETERS + _AGENTS + _FULL},
    "law": {".py": _LAW, ".toml": _SCENARIO + _PARAMETERS + _AGENTS + _LAW_TABLE},
    "robot": {".xml": _ROBOT, ".toml": _ROBOT_SCENARIO},
    "scenario": {".toml": _SCENARIO + _PARAMETERS + _AGENTS + _FULL},
}
