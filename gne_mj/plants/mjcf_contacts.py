"""Who touches whom in a fleet of users' robots: each its own parts and what its file brings along.

All files lie in one world. Planes that several of them bring are one floor
(:mod:`gne_mj.plants.mjcf_floors`); whatever else robots would touch each other by, they must not
overlap at the start.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput
from gne_mj.plants.mjcf_robot import RobotFile


class Part(NamedTuple):
    """What of a fleet's model is one robot's, one behind the other."""

    bodies: int
    geoms: int  # of the world itself
    actuators: int


def part_of(spec: Any) -> Part:
    """What a file adds."""
    of_world = sum(geom.parent == spec.worldbody for geom in spec.geoms)
    return Part(len(spec.bodies) - 1, of_world, len(spec.actuators))


def owners_of(
    model: mujoco.MjModel, robots: Sequence[Part], floors: Mapping[str, set[int]]
) -> list[set[int]]:
    """The robots, from 0, that each geom belongs to; none for the lane's or the terrain's own.

    Args:
        model: of the fleet, its robots one behind the other, and behind the terrain.
        robots: what is theirs.
        floors: names of planes that several of them bring, and whose they are.
    """
    bodies, geoms, _ = np.array(robots).T
    of_body = np.full(model.nbody, -1)
    of_body[model.nbody - bodies.sum() :] = np.repeat(np.arange(len(robots)), bodies)
    of_geom = of_body[model.geom_bodyid]
    (world,) = np.nonzero(model.geom_bodyid == 0)
    of_geom[world[len(world) - geoms.sum() :]] = np.repeat(np.arange(len(robots)), geoms)
    owners = [{owner} if owner >= 0 else set() for owner in of_geom.tolist()]
    for name, robots_of in floors.items():
        owners[model.geom(name).id] = robots_of
    return owners


def counted_owners(model: mujoco.MjModel, owners: Sequence[set[int]]) -> NDArray[np.int64]:
    """(geoms,) the agent, from 0, whose contacts with other agents a geom's are; -1 of none's.

    What stands in the world is no agent's, whosever file brought it.
    """
    moves = model.body_weldid[model.geom_bodyid] != 0
    found = [min(of) if of and moving else -1 for of, moving in zip(owners, moves, strict=True)]
    return np.array(found, dtype=np.int64)


def let_touch(model: mujoco.MjModel, owners: list[set[int]], which: str) -> None:
    """Leave but some contacts of a fleet.

    Args:
        model: of the fleet; collision bits are changed, or contacts switched off.
        owners: of each geom; what is nobody's stands in the world, wherever it is in a terrain.
        which: "all" as files say; "floor": of robots with what stands in the world, neither with
            each other nor within one; "agents": all but those with what stands in the world;
            "none". Pairs that a file names stay, but for "none".
    """
    if which == "none":
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    stands, contype, conaffinity = (
        (model.geom_bodyid == 0) | [not of for of in owners],
        model.geom_contype,
        model.geom_conaffinity,
    )
    if which == "agents":
        contype[stands] = conaffinity[stands] = 0
    if which == "floor":
        of, by = np.bitwise_or.reduce(contype[stands]), np.bitwise_or.reduce(conaffinity[stands])
        lands = ~stands & ((contype & by | conaffinity & of) != 0)
        there = stands & ((contype | conaffinity) != 0)
        contype[:], conaffinity[:] = lands, there
    for name in ("contype", "conaffinity"):
        bits = getattr(model, f"body_{name}")
        if which != "all":
            bits[:] = 0
            np.bitwise_or.at(bits, model.geom_bodyid, getattr(model, f"geom_{name}"))


def check_apart(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    owners: list[set[int]],
    robots: Sequence[RobotFile],
    advice: str,
) -> None:
    """Refuse robots that overlap each other, or what only another one's file brings along.

    Args:
        data: with contacts.
        model, owners, robots: of the fleet, one an agent.
        advice: how the refusal ends: what to do.

    Raises:
        InvalidInput: names the geoms and the agents.
    """
    overlaps = data.contact.dist < 0.0
    for one, other in data.contact.geom[overlaps].tolist():
        own, others = owners[one], owners[other]
        if min(one, other) < 0 or own & others or not (own and others):
            continue
        i, j = min(own), min(others)
        names = [model.geom(geom).name or "a nameless geom" for geom in (one, other)]
        raise InvalidInput(
            "robots",
            str(robots[i].path),
            f"at the start '{names[0]}' of agent {i + 1} overlaps '{names[1]}' of agent {j + 1}"
            f"{advice}",
        )
