"""Records lie where their declarations say, as a hand would lay them out."""

from typing import Annotated, NamedTuple

import numba
import numpy as np
import pytest

from gne_mj.game_model import GameData
from gne_mj.loops.feedback import Problem
from gne_mj.loops.layout import Run, Steps
from gne_mj.loops.newton import InputSolver, SolverNumbers, solver_length
from gne_mj.native import kernel
from gne_mj.numbers import Numbers, flat, names_of, numbers, numbers_in
from gne_mj.parameter_block import ParameterBlock
from gne_mj.records import (
    arrays,
    by_name,
    columns_in,
    count,
    dtype_of,
    fields,
    fresh,
    in_array,
    in_numbers,
    in_parameter_block,
    place,
    shapes,
)

Array = np.ndarray


@kernel
def twice(n):
    return 2 * n


class Parts(NamedTuple):
    first: Annotated[Array, "twice(m)"]
    grid: Annotated[Array, "m, p + 1"]
    last: Annotated[Array, "extra"]


class Inner(NamedTuple):
    numbers: Annotated[Array, "n", int]
    cube: Annotated[Array, "n // (w * w), w, w"]


class Outer(NamedTuple):
    row: Annotated[Array, "m"]
    inner: Inner
    level: int
    end: Annotated[Array, "3"]


class Tick(Numbers):
    step: float
    time: float


class Whole(Numbers):
    first: int
    last: int


class Nested(NamedTuple):
    parts: Parts
    tick: Tick
    tail: Annotated[Array, "p"]


SIZES = {"m": 3, "p": 2}
KNOWN = {"twice": twice, "extra": 5}


def test_numbers_and_nested_records_lie_where_python_finds_them():
    length, views = in_array(Nested, "m p", **KNOWN)
    flat_array = np.arange(30.0)
    record = views(flat_array, 1, 3, 2)
    record.tick.step += 0.5
    record.tail[:] = -1.0
    assert flat_array[21:25].tolist() == [21.5, 22.0, -1.0, -1.0]
    dtype = dtype_of(Nested, **SIZES, **KNOWN)
    found = by_name(flat_array[1:], dtype)
    assert dtype.itemsize == 8 * length(3, 2)
    assert (found.step, found.time) == (21.5, 22.0), "among the record's own fields"
    assert np.array_equal(found.parts.grid, record.parts.grid)
    found.time = 7.0
    assert record.tick.time == 7.0, "the same memory"
    both = by_name(np.stack([flat_array, -flat_array])[:, 1:], dtype)
    assert both.step.tolist() == [21.5, -21.5]
    assert both.parts.grid.shape == (2, 3, 3)


def test_native_code_reads_and_sets_numbers_by_name():
    _length, views = in_array(Nested, "m p", **KNOWN)
    ticks, wholes = numbers_in(Tick), numbers_in(Whole)

    @numba.njit(_nrt=False)  # as loops are
    def change(array, indices):
        record, whole = views(array, 1, 3, 2), wholes(indices, 2)
        record.tick.step = 3  # a whole number becomes a float
        record.tick.time += record.tail[1]
        whole.last += whole.first
        return ticks(array, 0).time

    array, indices = np.arange(30.0), np.arange(4)
    assert change(array, indices) == 1.0
    assert array[21:25].tolist() == [3.0, 22.0 + 24.0, 23.0, 24.0]
    assert indices.tolist() == [0, 1, 2, 5]


def test_numbers_of_a_table_are_read_by_name():
    class Held(NamedTuple):
        row: Annotated[Array, "m"]
        tick: Tick

    held = Held(np.zeros(2), numbers(Tick, time=4.0))
    assert (count(Held), place(Held, "tick")) == (2, 1)
    assert flat(held.tick).tolist() == [0.0, 4.0]
    table, read = ParameterBlock(arrays(held)), in_parameter_block(Held)
    assert numba.njit(lambda address: read(address).tick.time)(table.address) == 4.0
    columns = columns_in(Nested.__annotations__["parts"], 0)
    pieces = ParameterBlock([np.arange(6.0), np.arange(9.0), np.zeros(5)])
    assert numba.njit(lambda address: columns(address).grid[8])(pieces.address) == 8.0


def test_names_that_arrays_have_and_mixed_kinds_are_refused():
    class Taken(Numbers):
        size: float

    class Mixed(Numbers):
        one: float
        two: int

    for record, word in ((Taken, "size"), (Mixed, "all int")):
        with pytest.raises(TypeError, match=word):
            numbers_in(record)


def test_shapes_are_those_declared():
    assert shapes(Parts, **SIZES, **KNOWN) == [(6,), (3, 3), (5,)]


def test_a_flat_array_is_cut_in_the_declarations_order():
    length, views = in_array(Parts, "m p", twice=twice, extra=5)
    m, p = 3, 2
    assert length(m, p) == 6 + 9 + 5
    flat = np.arange(2.0 + length(m, p))
    parts = views(flat, 2, m, p)
    assert parts.first.tolist() == list(range(2, 8))
    assert parts.grid.tolist() == [[8, 9, 10], [11, 12, 13], [14, 15, 16]]
    assert parts.last.tolist() == list(range(17, 22))
    parts.grid[1, 2] = -1.0
    assert flat[13] == -1.0, "views, not copies"


def test_a_table_is_read_in_the_declarations_order():
    inner = Inner(np.array([4, 5]), np.arange(8.0).reshape(2, 2, 2))
    record = Outer(np.array([1.0, 2.0]), inner, 7, np.zeros(3))
    given = arrays(record)
    assert [a.size for a in given] == [2, 2, 8, 3]
    assert (count(Outer), place(Outer, "inner"), place(Outer, "end")) == (4, 1, 3)
    with pytest.raises(KeyError):
        place(Outer, "nothing")
    table = ParameterBlock([np.zeros(1), *given])
    read = in_parameter_block(Outer, 1)

    @numba.njit
    def look(address):
        found = read(address, 9, 2)  # level and w, in alphabetical order
        return found.row[1], found.inner.numbers[1], found.inner.cube[1, 0, 1], found.level

    assert look(table.address) == (2.0, 5, 5.0, 9)


def test_numbers_are_read_by_name():
    numbers = ParameterBlock([np.arange(len(Steps._fields))])
    read = in_numbers(Steps, 0)
    found = numba.njit(lambda address: read(address).output)(numbers.address)
    assert found == Steps._fields.index("output")


def test_fresh_arrays_have_the_declared_shapes():
    made = fresh(Parts, twice=twice, m=2, p=3, extra=4)
    assert [a.shape for a in made] == [(4,), (2, 4), (4,)]
    assert fresh(GameData, N=2, m=3, p=4, n=1).offsets.dtype == np.int64


@pytest.mark.parametrize("record", [Problem, Run, GameData, InputSolver])
def test_every_array_of_a_loop_is_declared(record):
    """A field without a shape would be taken for a number that whoever reads gives."""
    numbers = {name for name, field in fields(record).items() if field is None}
    assert numbers <= {"parameter_block"}


def test_the_solvers_length_is_that_of_its_arrays():
    sizes = {"m": 4, "p": 3, "entries": 6, "states": 2, "b": 1}
    made = fresh(InputSolver, **sizes)
    names = len(names_of(SolverNumbers))
    assert solver_length(*sizes.values()) == names + sum(a.size for a in made[1:])
    assert made.band.shape == (4, 3)
