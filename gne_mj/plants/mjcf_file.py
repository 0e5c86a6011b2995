"""A robot's MJCF file: read, checked, and its world-wide settings brought into a fleet's world.

MuJoCo attaches a file's elements with its angle units, defaults and so on. What it leaves behind is
what the whole world has once: ``<option>``, the flags, sizes, visual settings. The options are
carried over here, and all files of a fleet must agree in them.
"""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from gne_mj.errors import InvalidInput, nearest
from gne_mj.plants.c_layout import arrays
from gne_mj.plants.callbacks import quiet
from gne_mj.plants.mjcf_pose import Pose

# Options that a scenario gives, and MJCF's words for others
CLOCK = ("timestep", "integrator")
WORDS = {
    "disableflags": "flags", "enableflags": "flags", "disableactuator": "actuatorgroupdisable"
}  # fmt: skip


def read(path: Path, *, keyframes: bool = False) -> Any:
    """The file's ``mujoco.MjSpec``, with MuJoCo's automatic reset off; without keyframes, or with.

    Raises:
        InvalidInput: it cannot be read or compiled, has a number that is not finite, or a setting
            that no fleet can have.
    """
    heard: list[str] = []
    with _refusing(path, "read"):
        mujoco.set_mju_user_warning(heard.append)
        spec = mujoco.MjSpec.from_file(str(path))
    if any("NaN" in message for message in heard):  # which it takes for a number not given
        raise _refusal(path, "every number must be finite, and one of its is nan")
    for name in options_of(spec):
        _check_finite(path, name, getattr(spec.option, name))
    if spec.compiler.settotalmass > 0:
        _scale_masses(spec, path)
    if spec.option.enableflags & mujoco.mjtEnableBit.mjENBL_SLEEP:
        raise _refusal(path, "MuJoCo's state does not say who sleeps: leave the flag 'sleep' out")
    # a state that is not a number must be seen, not be reset
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    for key in () if keyframes else list(spec.keys):
        spec.delete(key)
    _name_actuators(spec)
    return spec


def remarks(path: Path, timestep: float) -> list[str]:
    """What a file's user may want to know before a run, a sentence each.

    Args:
        path: of the file.
        timestep: in s, of the run; the file's own, and its integrator, are not used.
    """
    heard: list[str] = []
    with _refusing(path, "read"):
        mujoco.set_mju_user_warning(heard.append)
        spec = mujoco.MjSpec.from_file(str(path))
    said = [
        f"of {path.name} MuJoCo says: {' '.join(words.split())}"
        for words in dict.fromkeys(heard)
        if "settotalmass" not in words  # which is done
    ]
    own = spec.option.timestep
    if timestep > own != mujoco.MjSpec().option.timestep:
        said.append(
            f"{path.name} was made for steps of {1e3 * own:g} ms, and these are"
            f" {1e3 * timestep:g} ms"
        )
    return said


def _scale_masses(spec: Any, path: Path) -> None:
    """Let a robot have the mass that it asks for (settotalmass), which MuJoCo takes for that of
    all that it compiles, of a whole fleet."""
    total, spec.compiler.settotalmass = spec.compiler.settotalmass, -1.0
    factor = total / np.sum(compiled(spec, path).body_mass)
    for geom in spec.geoms:
        geom.mass *= factor  # nan, where its density says it
        geom.density *= factor
    for body in spec.bodies:
        if body.explicitinertial:
            body.mass *= factor
            body.inertia = body.inertia * factor
            body.fullinertia = body.fullinertia * factor


def _name_actuators(spec: Any) -> None:
    """Call actuators without a name as what they drive, where one alone drives it."""
    names = [actuator.name or actuator.target for actuator in spec.actuators]
    for actuator, name in zip(spec.actuators, names, strict=True):
        if names.count(name) == 1:
            actuator.name = name


def alone(path: Path) -> mujoco.MjModel:
    """The model that a file is by itself, compiled.

    Raises:
        InvalidInput: as :func:`read` says.
    """
    model = compiled(read(path), path)
    for name in arrays("mjModel"):
        _check_finite(path, name, getattr(model, name))
    return model


def with_keyframes(path: Path) -> mujoco.MjModel:
    """The same with its keyframes."""
    return compiled(read(path, keyframes=True), path)


def keyframe(model: mujoco.MjModel, path: Path, name: str) -> Any:
    """A keyframe of :func:`with_keyframes`, as mjModel has it.

    Raises:
        InvalidInput: the file has none of this name, or numbers that are not finite in it; names
            ``agents.keyframe``.
    """
    names = [model.key(k).name for k in range(model.nkey)]
    if not name or name not in names:
        hint = nearest(name, names) if names else "it has none at all"
        raise InvalidInput(
            "agents.keyframe", name, f"{path.name} must have a keyframe of this name; {hint}"
        )
    key = model.key(name)
    if not all(np.all(np.isfinite(part)) for part in (key.qpos, key.qvel, key.act, key.ctrl)):
        raise InvalidInput("agents.keyframe", name, f"its numbers in {path.name} must be finite")
    return key


def compiled(spec: Any, path: Path | str) -> mujoco.MjModel:
    """A model, compiled without a word but what is wrong with it.

    Raises:
        InvalidInput: it cannot be.
    """
    with _refusing(path, "compile"):
        model: mujoco.MjModel = spec.compile()
    return model


def of_text(text: str, path: Path | str) -> Any:
    """What a text says, as a number that MuJoCo reads as none (5e-324) may not be.

    Raises:
        InvalidInput: it cannot be read.
    """
    with _refusing(path, "read"):
        return mujoco.MjSpec.from_string(text)


def attach(world: Any, spec: Any, path: Path, *, prefix: str, at: Pose) -> None:
    """Attach a file to a fleet's world, at a pose, its names behind a prefix.

    Raises:
        InvalidInput: it cannot be.
    """
    with _refusing(path, "attach"):
        frame = world.worldbody.add_frame(pos=at.position, quat=at.quaternion)
        world.attach(spec, prefix=prefix, frame=frame)


def adopt_options(world: Any, spec: Any) -> None:
    """Give a fleet's world all options of a file but those that the scenario gives."""
    for name in options_of(spec):
        if name not in CLOCK:
            setattr(world.option, name, getattr(spec.option, name))


def check_options(world: Any, spec: Any, path: Path) -> None:
    """Refuse a file whose options are not those of a fleet's world, which are the first one's.

    Raises:
        InvalidInput: names the option.
    """
    for name in options_of(spec):
        if name not in CLOCK:
            check_option(world, spec, path, name)


def check_option(world: Any, spec: Any, path: Path, name: str) -> None:
    """The same, of one option."""
    own, others = getattr(spec.option, name), getattr(world.option, name)
    if np.any(own != others):
        word, shown = WORDS.get(name, name), ""
        if word == name:
            shown = f", {np.array2string(np.asarray(others))}"
        raise _refusal(path, f"its {word} must be that of the first file{shown}")


def options_of(spec: Any) -> list[str]:
    """The names of all options."""
    return [name for name in dir(spec.option) if not name.startswith("_")]


def _check_finite(path: Path, name: str, numbers: Any) -> None:
    numbers = np.asarray(numbers)
    wrong = numbers[~np.isfinite(numbers)]
    if len(wrong):
        raise _refusal(path, f"every number must be finite, and its {name} has {wrong[0]}")


def _refusal(path: Path | str, expected: str) -> InvalidInput:
    return InvalidInput("path", str(path), expected)


@contextmanager
def _refusing(path: Path | str, verb: str) -> Iterator[None]:
    """What MuJoCo raises becomes one sentence, and what it warns of is not told."""
    try:
        with quiet(), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except (ValueError, OSError, mujoco.FatalError) as error:
        raise _refusal(path, f"MuJoCo must {verb} it: {' '.join(str(error).split())}") from None
