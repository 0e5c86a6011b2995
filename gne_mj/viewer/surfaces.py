"""What elements look like: MuJoCo's colours, materials and textures in three.js's words."""

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from gne_mj.viewer.shapes import Json, material, pixels, plane_texture, texture

DEFAULT_RGBA = (0.5, 0.5, 0.5, 1.0)  # an element of this colour has its material's
# A floor does not shine, and is behind what lies in it, as meshcat's own grid does
FLOOR = {
    "specular": 0, "polygonOffset": True, "polygonOffsetFactor": 1, "polygonOffsetUnits": 1
}  # fmt: skip
# What MuJoCo's greatest specular and shininess are here; its default of 0.5 is half of both
SPECULAR, SHININESS = 0x44, 80


def colours(model: mujoco.MjModel, rgba: Any, matid: Any) -> NDArray[np.float64]:
    """(n, 4) what MuJoCo takes of elements' own colours (n, 4) and of their materials (n,)."""
    of_material = (matid >= 0) & np.all(rgba == DEFAULT_RGBA, axis=1)
    return np.where(of_material[:, None], model.mat_rgba[matid] if model.nmat else rgba, rgba)


def surface(
    model: mujoco.MjModel, element: Any, lay: Any = None, *, plain: bool = False, **more: Any
) -> Json:
    """The material of a geom or site.

    Args:
        model: whose.
        element: of the model.
        lay: from the number of a 2-D texture to three.js's, laid on the element's shape; None: that
            cannot have any. A texture that is not laid leaves its mean colour.
        plain: its colour alone, neither a texture nor glowing: what the page colours itself.
        **more: what three.js is told besides.
    """
    matid = int(element.matid[0])
    rgba = colours(model, element.rgba[None], element.matid)[0]
    image = _image(model, matid)
    if matid < 0:
        return material(rgba, **more)
    shine = {
        "specular": 0x010101 * round(SPECULAR * min(float(model.mat_specular[matid]), 1.0)),
        "shininess": SHININESS * float(model.mat_shininess[matid]),
    }
    glow = 0.0 if plain else min(float(model.mat_emission[matid]), 1.0)
    if image >= 0 and not plain:
        if lay is not None and model.tex_type[image] == mujoco.mjtTexture.mjTEXTURE_2D:
            shine["map"] = lay(image)
        else:
            mean = np.mean(pixels(model, image)[..., :3], axis=(0, 1)) / 255
            rgba = rgba * [*np.broadcast_to(mean, 3), 1.0]
    if glow > 0.0:
        shine["emissive"] = material(glow * rgba)["color"]
    return material(rgba, **(shine | more))


def plane_surface(model: mujoco.MjModel, element: Any, size: Any, *, plain: bool = False) -> Json:
    """Of a plane that may be larger than its element; its texture's squares stay the same.

    Args:
        model: whose.
        element: the geom.
        size: half the sides of what is drawn, in m; 0 has no end.
        plain: see :func:`surface`.
    """

    def lay(image: int) -> Json:
        repeat, uniform = _repeated(model, element)
        if not uniform:  # repetitions over the plane, or over 2 m of what has no end
            half, own = (np.where(each > 0, each, 1.0) for each in (size[:2], element.size[:2]))
            repeat = repeat * half / own
        return plane_texture(model, image, size, repeat=repeat, uniform=uniform)

    return surface(model, element, lay, plain=plain, **FLOOR)


def laid_surface(model: mujoco.MjModel, element: Any, half: Any, *, plain: bool = False) -> Json:
    """Of what has texture coordinates: a mesh that brings them, a height field, a primitive, which
    has its texture on each side of a box and around what is round.

    Args:
        model: whose.
        element: of the model.
        half: (2,) half its sides, in m, for a texture whose repetitions are over 2 m.
        plain: see :func:`surface`.
    """

    def lay(image: int) -> Json:
        repeat, uniform = _repeated(model, element)
        return texture(model, image, repeat * half if uniform else repeat)

    return surface(model, element, lay, plain=plain)


def _repeated(model: mujoco.MjModel, element: Any) -> tuple[NDArray[np.float64], bool]:
    """The material's ``texrepeat`` and ``texuniform``."""
    matid = int(element.matid[0])
    return model.mat_texrepeat[matid], bool(model.mat_texuniform[matid])


def _image(model: mujoco.MjModel, matid: int) -> int:
    """The texture of a material's colour; -1: none."""
    roles = mujoco.mjtTextureRole.mjTEXROLE_RGB, mujoco.mjtTextureRole.mjTEXROLE_RGBA
    return -1 if matid < 0 else max(int(model.mat_texid[matid, int(role)]) for role in roles)
