"""The ground's material: its pictures repeat over the world, with u along x and v against y, so that they are oriented like a
map.

Distance needs no special rule: a far pixel covers many repeats, and the last mip level, one texel, is their mean.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewsphere.assets.appearance.opaque import Stamp, opaque_picture, stamp_of
from viewsphere.assets.appearance.pbr import made_of, pictures_of
from viewsphere.assets.mesh import Image, Material, Texture
from viewsphere.codecs.srgb import linear
from viewsphere.model.scene import Ground

SLABS = 2
"""Slabs in one `tile` of the ground, across and down."""

PERIOD = 4
"""Slabs, across and down, after which the floor repeats."""

IMAGES = ("image", "roughness_image", "normal_image")
"""Fields of `Ground` that name pictures."""


def ground_material(ground: Ground) -> tuple[Material, tuple[Image, ...]]:
    """The ground as a glTF material and the images it names; equal grounds give the same objects while files do not change.

    Texture coordinates are (x, -y) / tile in the world; a non-square picture keeps the proportions of the first picture named.
    Transparent parts of `image` show the ground's colour. `roughness_image` uses its green channel, as in glTF. A substance has
    its own pictures, including metallic. Raises RecipeError, naming the field, for a picture that cannot be read.
    """
    return _material(ground.model_dump_json(), ground_stamps(ground))


def ground_stamps(ground: Ground) -> tuple[Stamp, ...]:
    """The stamps of the files that a ground names; raises RecipeError if one is missing."""
    return tuple(stamp_of(path, f"scene.ground.{name}") for name in IMAGES if (path := getattr(ground, name)))


def only_scatters(ground: Ground) -> bool:
    """Return whether the ground has no reflections and no picture or substance defines its material."""
    pictured = ground.material is not None or any(getattr(ground, name) for name in IMAGES)
    return ground.roughness == 1 and ground.metallic == 0 and not pictured


def ground_frame(ground: Ground, material: Material, origin: ArrayLike, unit: float) -> tuple[float, float, float]:
    """(per_length, u0, v0) with which a point (x, y) in units from `origin`, world metres, has the texture coordinates
    u = u0 + per_length x, v = v0 - per_length y.

    u0 and v0 are less than one repeat, because single precision would lose the texels far from the world's origin.
    """
    x, y, _ = np.asarray(origin, np.float64)
    used = material.base_color_texture or material.normal_texture or material.metallic_roughness_texture
    across, down = used.scale if used else (SLABS / PERIOD,) * 2
    middle = 0.5 / SLABS if ground.has_slabs else 0.0  # an object at the world's origin is on a slab, not on a joint
    u, v = x / ground.tile + middle, middle - y / ground.tile
    return unit / ground.tile, math.fmod(u, 1.0 / across), math.fmod(v, 1.0 / down)


def ground_albedo(material: Material, images: tuple[Image, ...]) -> NDArray[np.float64]:
    """Mean linear colour (3,): the share of the light that the ground reflects."""
    color = np.array(material.base_color[:3])
    if material.base_color_texture is None:
        return color
    pixels = images[material.base_color_texture.image].pixels
    table = linear(np.arange(256) / 255)
    means = [table @ np.bincount(pixels[..., c].reshape(-1), minlength=256) for c in range(3)]
    return color * np.array(means) / pixels[..., 0].size


@lru_cache(maxsize=2)
def _material(described: str, stamps: tuple[Stamp, ...]) -> tuple[Material, tuple[Image, ...]]:
    ground = Ground.model_validate_json(described)
    images = [_image(name, path) for name in IMAGES if (path := getattr(ground, name))]
    uses: dict[str, Texture] = {}
    for i, image in enumerate(images):
        height, width = images[0].pixels.shape[:2]
        uses[image.name] = Texture(i, scale=(1.0, width / height))
    r, g, b = linear(ground.color).tolist()
    if ground.material is not None:
        material = made_of(Material("ground", base_color=(r, g, b, 1.0)), ground.material, 0)
        tinted = replace(material, base_color=(r, g, b, 1.0), roughness=ground.roughness)
        return tinted, pictures_of(ground.material)
    material = Material(
        name="ground",
        base_color=(r, g, b, 1.0),
        base_color_texture=uses.get("image"),
        metallic=ground.metallic,
        roughness=ground.roughness,
        metallic_roughness_texture=uses.get("roughness_image"),
        normal_texture=uses.get("normal_image"),
    )
    return material, tuple(images)


def _image(name: str, path: str) -> Image:
    """The picture that a field names, in glTF's channel layout for that field."""
    pixels = opaque_picture(path, f"scene.ground.{name}", on_white=name == "image")
    if name == "roughness_image":
        pixels[..., 2] = 255
    return Image(name, pixels)
