"""What is around robots: a model's sky and its lights, as the few numbers that the page needs."""

from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from gne_mj.viewer.shapes import pixels

FACES = 6  # of a cube: right, left, up, down, front, back
UP, DOWN, AROUND = 2, 3, [0, 1, 4, 5]
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of red, green and blue
LIGHTS = 3  # that a page draws; the strongest
NEAR = 1  # digits in which directions of what is taken for the same light are the same


def sky_of(model: mujoco.MjModel) -> list[list[float]] | None:
    """Colours of the first sky box at the zenith, at the horizon and below, rgb from 0 to 1.

    They are the means over its upper face, the middle rows around and its lower face.
    """
    found = np.flatnonzero(model.tex_type == mujoco.mjtTexture.mjTEXTURE_SKYBOX)
    if not len(found):
        return None
    image = pixels(model, int(found[0]))[..., :3].astype(np.float64) / 255
    side = image.shape[1]
    faces = image.reshape(-1, side, side, image.shape[2])  # one alone is all six
    faces = np.broadcast_to(faces, (FACES, side, side, 3))
    middle = faces[AROUND, (side - 1) // 2 : side // 2 + 1]
    parts = faces[UP], middle, faces[DOWN]
    return [np.mean(part.reshape(-1, 3), axis=0).round(3).tolist() for part in parts]


def light_of(model: mujoco.MjModel) -> dict[str, Any] | None:
    """From where light comes, and how much, in parts of all of it; None without a light.

    A lamp shines along its direction, a point toward the middle of the model: robots drive on, and
    what is near a lamp now is not later. Lights from one direction are one, as copies of a file
    bring them. How bright each is follows from its diffuse colour.

    Returns:
        ``from``: [x, y, z, part] each, of the strongest: unit vectors toward the lights; ``head``:
        the part of the light that is at the camera.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_camlight(model, data)
    kind = model.light_type
    strengths: dict[tuple[float, ...], float] = {}
    for light in np.flatnonzero(model.light_active & (kind != mujoco.mjtLightType.mjLIGHT_IMAGE)):
        toward = -data.light_xdir[light]
        if kind[light] == mujoco.mjtLightType.mjLIGHT_POINT:
            toward = data.light_xpos[light] - model.stat.center
        length = float(np.linalg.norm(toward))
        key = tuple((np.round(toward / (length or 1.0), NEAR) + 0.0).tolist())
        strength = _luminance(model.light_diffuse[light])
        strengths[key] = max(strengths.get(key, 0.0), strength if length > 0.0 else 0.0)
    chosen = sorted(strengths.items(), key=lambda each: -each[1])[:LIGHTS]
    head = _luminance(model.vis.headlight.diffuse) if model.vis.headlight.active else 0.0
    total = head + sum(strength for _, strength in chosen)
    if not any(strength > 0.0 for _, strength in chosen):
        return None
    return {
        "from": [[*_unit(key), round(strength / total, 3)] for key, strength in chosen],
        "head": round(head / total, 3),
    }


def _unit(vector: ArrayLike) -> list[float]:
    along = np.asarray(vector, dtype=np.float64)
    return (along / np.linalg.norm(along)).round(3).tolist()


def _luminance(rgb: ArrayLike) -> float:
    return float(LUMINANCE @ np.clip(rgb, 0.0, 1.0))
