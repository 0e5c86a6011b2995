"""Pushes of users' robots: the joint forces that a force at an output is, by what it is read of.

The velocity of a point is linear in the joints', each of which has a twist of its own (``cdof``) in
place of the body's. So J' f takes the kernel by which outputs are read, joint by joint up the tree;
it is what mj_applyFT gives. MuJoCo has the rates' rows of tendons and actuators.
"""

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from gne_mj.native import kernel
from gne_mj.parameter_block import floats, integers
from gne_mj.plants.mjcf_prediction import NUMBERS, PLACE, READINGS, place_of, prediction_in
from gne_mj.plants.mjcf_reading import READING, Term, along_twist, reading_at
from gne_mj.plants.mujoco import PLACES, SIZES
from gne_mj.plants.native_mujoco import number, word
from gne_mj.plants.way import Way, way_of_joint


@intrinsic
def _index(typingctx: Any, ints: Any, k: Any) -> Any:
    """Entry k of the C array of ``int`` at an address."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        entries = builder.inttoptr(arguments[0], cgutils.int32_t.as_pointer())
        found = builder.load(builder.gep(entries, [arguments[1]]))
        return builder.sext(found, cgutils.intp_t)

    return types.int64(types.int64, types.int64), codegen


@kernel
def _add_row(rows, columns, values, force, applied):
    """Add force times a row of a sparse matrix: entries from the first on, columns and values.

    Args:
        rows: how many entries, and which is the first.
        columns, values: addresses.
        force: by which they are multiplied.
        applied: (nv,) to which they are added.
    """
    count, first = rows
    for k in range(first, first + count):
        applied[_index(columns, k)] += force * number(values, k)


@kernel
def push_along(where, context, readings, which, force, applied):
    """Add to joint forces (nv,) what a force along reading ``which`` of a table is.

    Args:
        where: as :func:`gne_mj.plants.push.slopes` has it.
        context: addresses of mjModel and mjData, and the word of subtree_com in that.
        readings, which: as :func:`gne_mj.plants.mjcf_reading.velocity_of` has them.
        force: in N, N m of an angular velocity.
        applied: changed.
    """
    model, data, centres = context
    reading = reading_at(readings, which)
    entry = reading.entry
    if reading.body >= 0:
        twists, centre = word(data, where.cdof), word(data, centres) + 24 * reading.root
        dof = reading.last
        while dof >= 0:
            applied[dof] += force * along_twist(data, reading, twists + 48 * dof, centre)
            dof = _index(word(model, where.dof_parentid), dof)
    elif reading.source == where.ten_velocity:
        count = _index(word(model, where.ten_J_rownnz), entry)
        first = _index(word(model, where.ten_J_rowadr), entry)
        columns, values = word(model, where.ten_J_colind), word(data, where.ten_J)
        _add_row((count, first), columns, values, force, applied)
    elif reading.source == where.actuator_velocity:
        count = _index(word(data, where.moment_rownnz), entry)
        first = _index(word(data, where.moment_rowadr), entry)
        columns, values = word(data, where.moment_colind), word(data, where.actuator_moment)
        _add_row((count, first), columns, values, force, applied)
    else:
        applied[entry] += force


@kernel
def push(where, model, data, parameter_block, forces, applied):
    """Add to joint forces (nv,) what forces (m,) at the outputs are."""
    prediction, numbers = prediction_in(parameter_block), floats(parameter_block, NUMBERS)
    places, table = integers(parameter_block, PLACES), integers(parameter_block, SIZES)[READINGS:]
    context = (model, data, prediction.centres)
    for r in range(len(places) // PLACE):
        place, force = place_of(places, r), forces[r]
        if force == 0.0:
            continue
        if place.output >= 0:
            applied[place.output] += force
            continue
        first = -1 - place.output
        for k in range(first, first + place.readings):
            part = force * numbers[prediction.lookahead + k]
            push_along(where, context, table, k * READING, part, applied)


def way_of(model: mujoco.MjModel, data: mujoco.MjData, terms: Sequence[Term]) -> Way | None:
    """How what is read as a sum of terms can be pushed; None if a sensor alone tells of one.

    Of a sum in the unit of its first term, and in no direction.

    Args:
        model, data: of the fleet, its kinematics done.
        terms: of the output.
    """
    if not all(term.fresh for term in terms):
        return None
    ways = [_way_of_term(model, data, term) for term in terms]
    return ways[0] if len(ways) == 1 else Way(ways[0].unit)


def _way_of_term(model: mujoco.MjModel, data: mujoco.MjData, term: Term) -> Way:
    if term.source == "qvel":
        return way_of_joint(model, term.entry, term.factor)
    if term.source == "actuator_velocity":
        actuator = int(np.searchsorted(model.actuator_outadr, term.entry, side="right")) - 1
        if model.actuator_trntype[actuator] == mujoco.mjtTrn.mjTRN_JOINT:
            dof = int(model.jnt_dofadr[model.actuator_trnid[actuator, 0]])
            return way_of_joint(model, dof, term.factor * model.actuator_gear[actuator, 0])
    if term.body < 0:
        return Way("N")
    if term.angular:
        return Way("N m")
    along = np.sign(term.factor) * np.eye(3)[term.axis]
    if not term.matrix:
        return Way("N", along)
    turned = getattr(data, term.matrix)[term.entry // 3].reshape(3, 3) @ along
    return Way("N", data.xmat[term.body].reshape(3, 3).T @ turned, term.body)
