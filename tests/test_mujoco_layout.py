"""Where MuJoCo keeps its numbers, by its declarations, against models that tell by themselves."""

import ctypes

import mujoco
import numpy as np
import pytest

from gne_mj.errors import EngineError
from gne_mj.native import compiled
from gne_mj.plants import c_layout, native_mujoco
from gne_mj.plants.native_mujoco import Offsets, field, number, offsets, set_number

# Late controls, activations, user data and a mocap body, all of different sizes
MODEL = """
<mujoco>
  <size nuserdata="11"/>
  <worldbody>
    <body mocap="true"><geom size="1"/></body>
    <body>
      <joint name="a" type="slide"/><geom size="1"/>
      <body><joint name="b" type="hinge"/><geom size="1"/></body>
    </body>
  </worldbody>
  <actuator>
    <intvelocity joint="a" delay="0.01" nsample="3"/>
    <intvelocity joint="b"/>
    <motor joint="b"/>
  </actuator>
  <sensor><jointvel joint="a"/><jointvel joint="b"/><jointpos joint="b"/></sensor>
</mujoco>"""
ARRAYS = Offsets._fields[: Offsets._fields.index("time")]


@pytest.fixture(scope="module")
def natively():
    @compiled
    def exchange(struct, offset, length, values, out):
        array = field(struct, offset, length)
        for k in range(length):
            out[k] = array[k]
            array[k] = values[k]

    return exchange


@pytest.mark.parametrize("name", ARRAYS)
def test_each_array_is_read_and_written_where_it_is(natively, name):
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    array = getattr(data, name)
    assert array.size
    known, new, seen = np.arange(array.size) + 0.5, -np.arange(array.size) - 7.0, array * 0.0
    array[:] = known
    natively(data._address, getattr(offsets(), name), array.size, new, seen)
    assert np.array_equal(seen, known)
    assert np.array_equal(array, new)


def test_an_empty_neighbour_is_not_taken_for_the_field():
    """A model without plug-ins has their state, empty, at the address of ctrl."""
    data = mujoco.MjData(mujoco.MjModel.from_xml_string(MODEL))
    at = offsets()
    words = (ctypes.c_int64 * 2).from_address(data._address + 8 * (at.ctrl - 1))
    assert words[0] == words[1] == data.ctrl.ctypes.data
    plain = "<mujoco><worldbody><body><joint/><geom size='1'/></body></worldbody></mujoco>"
    bare = mujoco.MjData(mujoco.MjModel.from_xml_string(plain))
    words = (ctypes.c_int64 * 2).from_address(bare._address + 8 * (at.qacc_warmstart - 1))
    assert words[0] == words[1] == bare.qacc_warmstart.ctypes.data  # no history


def test_numbers_of_the_structs_themselves():
    @compiled
    def exchange(struct, offset, value):
        before = number(struct, offset)
        set_number(struct, offset, value)
        return before

    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    data.time, model.opt.timestep = 1.25, 0.375
    assert exchange(data._address, offsets().time, 2.5) == 1.25
    assert exchange(model._address, offsets().timestep, 0.75) == 0.375
    assert (data.time, model.opt.timestep) == (2.5, 0.75)
    size = ctypes.c_int64.from_address(model._address + 8 * offsets().nuserdata).value
    assert size == model.nuserdata == 11


@pytest.mark.parametrize("name", Offsets._fields)
def test_a_field_elsewhere_than_declared_is_refused(monkeypatch, name):
    right = native_mujoco.word_of
    monkeypatch.setattr(native_mujoco, "word_of", lambda *path: right(*path) + (path[-1] == name))
    block = native_mujoco.block_of
    monkeypatch.setattr(native_mujoco, "block_of", lambda *path: block(*path) + (path[-1] == name))
    with pytest.raises(EngineError, match="elsewhere than expected"):
        native_mujoco.offsets.__wrapped__()


def test_what_is_declared_otherwise_is_refused():
    for path in (("mjData", "nothing"), ("mjNothing", "qpos"), ("mjData", "ncon")):
        with pytest.raises(EngineError, match="elsewhere than expected"):
            c_layout.word_of(*path)
