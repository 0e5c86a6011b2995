"""Which output and input of a file to begin with, where the user names none."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from gne_mj.errors import InvalidInput
from gne_mj.examination.bench import bench
from gne_mj.examination.offers import Offer
from gne_mj.examination.responses import relative_degrees
from gne_mj.plants.mjcf_robot import MjcfAgents, MjcfRobots

MOST = 8  # pairs that are tried
ROTORS, WHEELS = 4, 2


def agents_of(
    path: Path, output: Any, input_: Any, dimension: int, keyframe: str | None = None
) -> MjcfRobots:
    """One robot as a scenario's table would have it.

    Raises:
        InvalidInput: the table is refused; names ``output``, ``input`` or ``keyframe``.
    """
    table = MjcfAgents.model_validate(
        {
            "type": "mjcf-robot", "count": 1, "file": str(path), "output": output, "input": input_,
            "keyframe": keyframe,
        }
    )  # fmt: skip
    made = table.build((dimension,))
    assert isinstance(made, MjcfRobots)
    return made


def entries(output: Any) -> int:
    """How many entries an action has whose output that is."""
    if isinstance(output, list):
        return sum(map(entries, output))
    return len(output["axes"]) if isinstance(output, dict) and "axes" in output else 1


def propose(
    path: Path, model: mujoco.MjModel, offers: list[Offer], keyframe: str | None = None
) -> tuple[tuple[Any, Any] | None, list[str]]:
    """An output and an input, as a scenario has them; None if nothing of the file can be used.

    Beside them a sentence for each pair that was tried in vain.

    Of a body that floats by a low-level controller, if its actuators are rotors or two wheels. Of
    actuators that give a force at a joint or tendon the first that moves it at once and without
    end. Else a force at a body that floats, which is for first studies.
    """
    best, rank, vain = None, 3, []
    for output, input_, free in [*_driven(model, offers), *_pairs(model, offers)]:
        found, why = _rank(path, output, input_, free, keyframe)
        if why:
            vain.append(f"Output {output!r} with input {input_!r}: {why}.")
        if found < rank:
            best, rank = (output, input_), found
        if rank == 0:
            break
    floating = [each.name for each in offers if each.kind == "body" and each.usable]
    if best is not None or not floating:
        return best, vain
    about = {"body": floating[0], "axes": ["x"]}
    return (about, dict(about)), vain


def _driven(model: mujoco.MjModel, offers: list[Offer]) -> Iterator[tuple[Any, Any, bool]]:
    """What a low-level controller could do with a body that floats."""
    floating = [each.name for each in offers if each.kind == "body" and each.usable]
    named = [each for each in offers if each.kind == "actuator" and each.usable]
    rotors = [each.name for each in named if each.on[0] == "site"]
    wheels = [each for each in named if each.on[0] == "joint"]
    if not floating:
        return
    body = floating[0]
    if len(rotors) >= ROTORS:
        about = {"body": body, "axes": ["x", "y", "z"]}
        yield about, {"controller": "quadrotor", "rotors": rotors}, True
    if len(wheels) == len(named) == WHEELS:
        # left is where y is greater
        wheels.sort(key=lambda each: -model.body_pos[model.joint(each.on[1]).bodyid[0], 1])
        about = {"body": body, "frame": "own", "axes": ["x"]}
        names = [each.name for each in wheels]
        yield about, {"controller": "differential-drive", "wheels": names}, True


def _pairs(model: mujoco.MjModel, offers: list[Offer]) -> Iterator[tuple[Any, Any, bool]]:
    count = 0
    for offer in offers:
        kind, name = offer.on
        if offer.kind != "actuator" or not offer.usable or not name or count == MOST:
            continue
        if kind == "joint":
            limited = bool(model.jnt_limited[model.joint(name).id])
            yield name, offer.name, not limited
            count += 1
        elif kind == "tendon":
            yield {"tendon": name}, offer.name, True
            count += 1


def _rank(
    path: Path, output: Any, input_: Any, free: bool, keyframe: str | None
) -> tuple[int, str]:
    """0: it moves its output at once and without end; 1: at once; 2: later; 3: it is refused.

    Of a pair that is refused also why.
    """
    try:
        d = entries(output)
        tried = bench(agents_of(path, output, input_, d, keyframe), 0.001, "rk4")
        degrees = relative_degrees(tried, tried.start, np.zeros(d), np.ones(d))
    except InvalidInput as refused:
        return 3, refused.about
    if isinstance(input_, dict) and "controller" in input_:
        return 0, ""  # a tilt, or a rolling wheel, lies between: later than at once, but meant so
    if None in degrees:
        return 3, "the input does not move the output"
    return (2 if degrees != [1] * d else 0 if free else 1), ""
