"""MJCF files of robots that are not the package's, for tests."""

# A flexible robot with a linear spring, as a user would write it
FLEXIBLE = """
<mujoco model="mine">
  <option gravity="0 0 0"><flag contact="disable" constraint="disable"/></option>
  <worldbody>
    <body name="front">
      <joint name="front" type="slide" axis="1 0 0"/>
      <inertial pos="0 0 0" mass="{main_mass}" diaginertia="1 1 1"/>
    </body>
    <body name="rear">
      <joint name="rear" type="slide" axis="1 0 0"/>
      <inertial pos="0 0 0" mass="{appendage_mass}" diaginertia="1 1 1"/>
    </body>
  </worldbody>
  <tendon>
    <fixed name="spring" stiffness="{stiffness}" damping="{damping}" springlength="0">
      <joint joint="front" coef="1"/>
      <joint joint="rear" coef="-1"/>
    </fixed>
    <fixed name="wheel"><joint joint="front" coef="1"/></fixed>
  </tendon>
  <actuator>{actuator}</actuator>
  <sensor>
    <jointvel name="joint_speed" joint="front"/>
    <tendonvel name="tendon_speed" tendon="wheel"/>
    <actuatorvel name="actuator_speed" actuator="push"/>
    <jointpos name="place" joint="front"/>
  </sensor>
  {extra}
</mujoco>
"""
MOTOR = '<motor name="push" joint="front"/>'


def flexible(numbers, actuator=MOTOR, extra=""):
    """Text of one robot's file, from a dict of numbers."""
    return FLEXIBLE.format(**numbers, actuator=actuator, extra=extra)
