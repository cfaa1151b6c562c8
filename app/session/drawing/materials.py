# pyright: reportAttributeAccessIssue=false
"""Which surface a geom gets: ours for our own parts, the model's for anyone else's."""

import io

import mujoco
import numpy as np
from PIL import Image

from app.session.drawing.glb import Material
from app.session.drawing.palette import Theme, linear

GLASS_ROUGHNESS, LIQUID_ROUGHNESS = 0.08, 0.2
LAST_VISIBLE_GROUP = 2
"""MuJoCo shows geom groups 0 to 2; group 3 holds collision shapes by convention."""


def surface(code: str, roughness: float, metallic: float = 0.0, alpha: float = 1.0) -> Material:
    """A material from an sRGB colour code."""
    red, green, blue = linear(code).tolist()
    return Material((red, green, blue), alpha, roughness, metallic)


def code_of(red: float, green: float, blue: float) -> str:
    """An sRGB colour in [0, 1] as #RRGGBB."""
    return "#" + "".join(f"{round(255 * min(1.0, max(0.0, c))):02X}" for c in (red, green, blue))


def robot_surfaces(theme: Theme) -> dict[str, Material]:
    """Materials of the default arm by the names arm.xml gives them."""
    return {
        "shell": surface(theme.shell, 0.42),
        "joint": surface(theme.joint, 0.5, metallic=0.1),
        "ring": surface(theme.ring, 0.35, metallic=0.55),
        "pad": surface(theme.pad, 0.9),
    }


def is_visible(model: mujoco.MjModel, geom: int) -> bool:
    """Whether a geom is meant to be seen: in a visible group and not fully transparent."""
    return int(model.geom_group[geom]) <= LAST_VISIBLE_GROUP and geom_rgba(model, geom)[3] > 0.0


def geom_rgba(model: mujoco.MjModel, geom: int) -> tuple[float, float, float, float]:
    """A geom's colour in sRGB and its opacity; its material's, where it has one."""
    material = int(model.geom_matid[geom])
    values = model.mat_rgba[material] if material >= 0 else model.geom_rgba[geom]
    red, green, blue, alpha = (float(v) for v in values)
    return red, green, blue, alpha


def _texture_of(model: mujoco.MjModel, material: int) -> Image.Image | None:
    """The two-dimensional colour texture of a material."""
    roles = (mujoco.mjtTextureRole.mjTEXROLE_RGB, mujoco.mjtTextureRole.mjTEXROLE_RGBA)
    texture = max(int(model.mat_texid[material, int(role)]) for role in roles)
    if texture < 0 or int(model.tex_type[texture]) != mujoco.mjtTexture.mjTEXTURE_2D:
        return None
    height, width = int(model.tex_height[texture]), int(model.tex_width[texture])
    channels, start = int(model.tex_nchannel[texture]), int(model.tex_adr[texture])
    pixels = model.tex_data[start : start + height * width * channels]
    picture = pixels.reshape(height, width, channels)[::-1]  # MuJoCo's first row is the lowest
    return Image.fromarray(np.ascontiguousarray(picture.squeeze().astype(np.uint8)))


def model_material(model: mujoco.MjModel, geom: int, with_texture: bool) -> Material:
    """The material a model itself describes, translated to metallic-roughness.

    MuJoCo leaves roughness and metallic at −1 where a file does not set them; a shininess then
    stands for the roughness it would have, and metal is off.
    """
    red, green, blue, alpha = geom_rgba(model, geom)
    code = code_of(red, green, blue)
    material = int(model.geom_matid[geom])
    if material < 0:
        return surface(code, 0.55, alpha=alpha)
    roughness = float(model.mat_roughness[material])
    metallic = float(model.mat_metallic[material])
    if roughness < 0.0:
        roughness = float(np.clip(0.8 - 0.5 * model.mat_shininess[material], 0.2, 0.9))
    look = surface(code, roughness, max(0.0, metallic), alpha)
    picture = _texture_of(model, material)
    if picture is None:
        return look
    if with_texture:
        with io.BytesIO() as file:
            picture.save(file, format="PNG")
            return Material(look.colour, alpha, roughness, look.metallic, file.getvalue())
    mean = np.asarray(picture.convert("RGB"), dtype=np.float64).mean(axis=(0, 1)).astype(int)
    tint = linear("#" + "".join(f"{c:02X}" for c in mean)) * look.colour
    return Material((float(tint[0]), float(tint[1]), float(tint[2])), alpha, roughness)


def object_material(model: mujoco.MjModel, geom: int, with_texture: bool) -> Material:
    """The material of one geom of an object: its own colour, less matt than the model says.

    What lets light through is glass or a liquid: smooth, so that it catches the lights.
    """
    red, green, blue, alpha = geom_rgba(model, geom)
    if int(model.geom_matid[geom]) >= 0:
        return model_material(model, geom, with_texture)
    roughness = 0.5 if alpha >= 1.0 else GLASS_ROUGHNESS if alpha < 0.6 else LIQUID_ROUGHNESS
    return surface(code_of(red, green, blue), roughness, alpha=alpha)
