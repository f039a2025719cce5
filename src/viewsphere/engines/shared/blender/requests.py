"""A shot as plain data and arrays, from which Blender's worker builds a scene (`viewsphere.blender.worker.scene.staging`)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.appearance.repaint import repainted
from viewsphere.assets.mesh import Image, Material, Mesh, Texture
from viewsphere.codecs.srgb import encoded
from viewsphere.engines.shared.blender.file_frame import FileFrame
from viewsphere.engines.shared.blender.options import AnyOptions
from viewsphere.engines.shared.blender.texels import Kind, Levels
from viewsphere.engines.shared.lamps import lamplight
from viewsphere.model.scene import AnyLight, BlendScene, Ground, HemisphereLight, Scene
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Repaint, Thing
from viewsphere.rendering.ground.horizon import BEGIN, FLAT, OVER
from viewsphere.rendering.ground.kernels_slabs import shades
from viewsphere.rendering.ground.material import PERIOD, SLABS, ground_frame, ground_material, only_scatters
from viewsphere.rendering.sky.sky import SURROUNDINGS, SkyPictures, sky_pictures
from viewsphere.rendering.sky.sun import sun_light
from viewsphere.truth.raster.geometry import Geometry

TEXELS = 1024
"""Side of the slabs' texture in texels; it shows `PERIOD` slabs a side."""

_BRIGHTEST = 1.44
"""Upper limit of all shades of the slabs."""


Put = Callable[[NDArray[Any]], str]
"""Writes an array to a file that the worker can read, and returns the file's path."""

Request = dict[str, Any]

ARRAYS = ("vertices", "triangles", "normals", "triangle_material", "uv0", "uv1", "colors")


def scene_request(
    things: Sequence[Thing],
    meshes: Sequence[Mesh],
    geometry: Geometry,
    scene: Scene,
    options: AnyOptions,
    put: Put,
    levels: Sequence[Levels] | None = None,
) -> Request:
    """The worker's `stage` request; `levels`: halvings of each kind's pictures, None for unchanged pictures.

    Raises UserError for a picture of sky or ground that cannot be read.
    """
    frame, blend = FileFrame.from_blend(scene.blend), scene.blend
    kinds = kinds_of(things, meshes, scene)
    shared: dict[int, Request] = {}
    meshes_told: list[Request] = []
    for kind, look in zip(kinds, materials_request(kinds, put, levels), strict=True):
        if id(kind.mesh) not in shared:
            shared[id(kind.mesh)] = _mesh_request(kind.mesh, put)
        meshes_told.append({**shared[id(kind.mesh)], **look, "name": kind.things[0].model.key})
    numbers = {id(thing): number for number, kind in enumerate(kinds) for thing in kind.things}
    objects = [
        {"mesh": numbers[id(p)], "matrix": frame.placed(p.world_from_object), "index": p.id}
        for p in (things[i] for i in staged(things, scene))
    ]
    pictures = None
    if blend is None or not blend.is_lit:
        pictures = sky_pictures(scene.sky, scene.sun, scene.lights, scene.ground is not None)
    middle = _middle_of(geometry, sum(not p.scenery for p in things))
    lit = lamplight(scene, things, meshes, middle)
    has_scenery = any(p.scenery for p in things)
    return {
        "meshes": meshes_told,
        "objects": objects,
        "ground": None if scene.ground is None else _ground_request(scene.ground, geometry, has_scenery, put),
        "lights": [frame.light(light) for light in _lights_request(lit, middle)],
        "world": pictures and _world_request(pictures, put),
        "hemispheres": pictures and _hemispheres(scene, pictures),
        "file": None if blend is None else _file_request(blend),
        "settings": settings_request(options),
    }


def staged(things: Sequence[Thing], scene: Scene) -> list[int]:
    """Indices of the things that are put into the scene, in the worker's order: those that are present, and that a .blend scene
    does not already contain.
    """
    return [i for i, thing in enumerate(things) if thing.is_there and (scene.blend is None or thing.model.parts is None)]


def members_of(shot: Shot) -> dict[str, int]:
    """Ids of a shot's objects by the names of their objects in a user's .blend scene."""
    return {name: thing.id for thing in shot.objects for name in (thing.model.parts and thing.model.parts.only) or ()}


def kinds_of(things: Sequence[Thing], meshes: Sequence[Mesh], scene: Scene) -> tuple[Kind, ...]:
    """The models that are put into the scene, each with its changes to materials."""
    kinds: dict[tuple[int, tuple[Repaint, ...], bool], tuple[Mesh, list[Thing]]] = {}
    for i in staged(things, scene):
        thing, mesh = things[i], meshes[i]
        kinds.setdefault((id(mesh), thing.repaints, thing.model.faces is None), (mesh, []))[1].append(thing)
    return tuple(Kind(mesh, repaints, both, tuple(own)) for (_, repaints, both), (mesh, own) in kinds.items())


def materials_request(kinds: Sequence[Kind], put: Put, levels: Sequence[Levels] | None) -> list[Request]:
    """Textures and materials of each kind; textures shared by several kinds are written once."""
    paths: dict[int, str] = {}

    def put_once(pixels: NDArray[Any]) -> str:
        if id(pixels) not in paths:
            paths[id(pixels)] = put(pixels)
        return paths[id(pixels)]

    request: list[Request] = []
    for number, kind in enumerate(kinds):
        materials, images = kind.mesh.materials, kind.mesh.images
        if levels is not None:
            materials, images = kind.pictured(levels[number])
        request.append(
            {
                "images": _images_request(images, put_once),
                "materials": [_material_request(material, kind.repaints, kind.has_backs) for material in materials],
            }
        )
    return request


def _file_request(blend: BlendScene) -> Request:
    path = Path(blend.file).resolve()
    request = blend.model_dump(include={"shown", "hidden", "frame"})
    return {"file": str(path), "root": str(path.parent) if blend.confined else None, **request}


def settings_request(options: AnyOptions) -> Request:
    """The worker's settings of a renderer."""
    request = asdict(options)
    del request["script"]
    request["own"] = dict(request.pop("settings"))
    return {"renderer": options.renderer, **request}


def _mesh_request(mesh: Mesh, put: Put) -> Request:
    arrays = {name: getattr(mesh, name) for name in ARRAYS}
    return {name: None if array is None else put(array) for name, array in arrays.items()}


def _images_request(images: Sequence[Image], put: Put) -> list[Request]:
    return [{"name": image.name, "pixels": put(image.pixels)} for image in images]


def _material_request(material: Material, repaints: Sequence[Repaint], has_backs: bool = True) -> Request:
    """A material with its repaints; a repaint's metallic or roughness replaces both the factor and its texture."""
    tinted, repaint = repainted(material, repaints)
    request = asdict(tinted)
    request["fronts_only"] = not (has_backs or material.double_sided)
    request["fixed_metallic"] = None if repaint is None else repaint.metallic
    request["fixed_roughness"] = None if repaint is None else repaint.roughness
    return request


def _ground_request(ground: Ground, geometry: Geometry, has_scenery: bool, put: Put) -> Request:
    """The ground with truth's own triangles, the texture coordinates of the raster engine, and the range of its fading."""
    vertices = geometry.ground
    triangles = geometry.triangles[geometry.triangle_start[-1] :] - geometry.vertex_start[-1]
    material, images = ground_material(ground)
    if ground.has_slabs:
        material, images = laid_with_slabs(material)
    per_length, u, v = ground_frame(ground, material, (0, 0, 0), 1.0)
    uv = np.stack([u + per_length * vertices[:, 0], v - per_length * vertices[:, 1]], axis=1)
    mesh = {
        "vertices": put(vertices.astype(np.float32)),
        "triangles": put(triangles.astype(np.int32)),
        "normals": put(np.tile(np.array([0, 0, 1], np.float32), (len(vertices), 1))),
        "triangle_material": put(np.zeros(len(triangles), np.int32)),
        "uv0": put(uv.astype(np.float32)),
        "uv1": None,
        "colors": None,
        "images": _images_request(images, put),
        "materials": [_material_request(replace(material, specular=0.0) if only_scatters(ground) else material, ())],
    }
    middle, unit = extent(geometry, has_scenery)
    fading = {"begin": unit * BEGIN, "end": unit * (BEGIN + OVER), "flat": FLAT}
    return {"mesh": mesh, "catcher": ground.catcher, "middle": middle.tolist(), "fading": fading}


def extent(geometry: Geometry, has_scenery: bool) -> tuple[NDArray[np.float64], float]:
    """Centre (3,) and half the diagonal of all placed things, in world metres. With scenery, they are the origin and the next
    power of two, so that both stay the same when the targets change.
    """
    if not geometry.triangle_start[-1]:
        return np.zeros(3), 1.0
    low, high = geometry.extent()
    unit = float(np.linalg.norm(high - low)) / 2 or 1.0
    return (np.zeros(3), 2.0 ** math.ceil(math.log2(unit))) if has_scenery else ((low + high) / 2, unit)


def _middle_of(geometry: Geometry, count: int) -> NDArray[np.float64]:
    """Centre (3,) of the box around the first `count` things, in world metres."""
    low, high = geometry.extent(count)
    return (low + high) / 2


def _lights_request(scene: Scene, middle: NDArray[np.float64]) -> list[Request]:
    """The sun, attenuated by the sky, and the lamps; hemisphere lights are part of the world's picture."""
    request: list[Request] = []
    sun = sun_light(scene.sky, scene.sun) if scene.blend is None or not scene.blend.is_lit else None
    if sun is not None:
        request.append(
            {"kind": "sun", "direction": sun.direction, "irradiance": sun.irradiance, "angle_deg": sun.angle_deg},
        )
    return request + [_lamp_request(light, middle) for light in scene.lights if not isinstance(light, HemisphereLight)]


def _lamp_request(light: AnyLight, middle: NDArray[np.float64]) -> Request:
    request = light.model_dump()
    request["irradiance"] = [light.strength * c for c in light.color]
    for name in ("position", "toward"):
        if name in request:
            request[name] = (np.array(request[name]) + middle).tolist()
    return request


def _world_request(pictures: SkyPictures, put: Put) -> Request:
    lighting = put(pictures.lighting)
    seen = lighting if pictures.seen is pictures.lighting else put(pictures.seen)
    return {"picture": lighting, "seen": seen, "turn_deg": pictures.turn_deg}


def _hemispheres(scene: Scene, pictures: SkyPictures) -> list[list[float]]:
    """Radiance (2, 3) of a white matt surface that faces up, and of one that faces down, without the sun's own light."""
    height = len(pictures.lighting)
    zenith = (np.arange(height) + 0.5) / height * math.pi
    weight = np.cos(zenith) * np.sin(zenith) * (2 * math.pi / height)
    around = pictures.lighting.mean(axis=1, dtype=np.float64)
    above, below = (np.maximum(side * weight, 0) @ around for side in (1, -1))
    sun = sun_light(scene.sky, scene.sun)
    if scene.ground is not None:
        direct = 0 if sun is None else np.array(sun.irradiance) * max(sun.direction[2], 0) / math.pi
        below = SURROUNDINGS * (above + direct)
    return [above.tolist(), below.tolist()]


def laid_with_slabs(material: Material) -> tuple[Material, tuple[Image, ...]]:
    """The ground's material with a texture of its slabs."""
    r, g, b, a = material.base_color
    picture = _slab_picture()
    used = replace(
        material,
        base_color=(r * _BRIGHTEST, g * _BRIGHTEST, b * _BRIGHTEST, a),
        base_color_texture=Texture(0, scale=(SLABS / PERIOD, SLABS / PERIOD)),
    )
    return used, (picture,)


@lru_cache(maxsize=1)
def _slab_picture() -> Image:
    """One period of the slabs, as a share of `_BRIGHTEST`."""
    at = ((np.arange(TEXELS) + 0.5) * (PERIOD / TEXELS)).astype(np.float32)
    x, y = (np.ascontiguousarray(v).reshape(-1) for v in np.broadcast_arrays(at, at[:, None]))
    tone = np.empty(TEXELS * TEXELS, np.float32)
    shades(x, y, np.float32(PERIOD / TEXELS), tone)
    pixels = np.full((TEXELS, TEXELS, 4), 255, np.uint8)
    grey = np.rint(encoded(tone.reshape(TEXELS, TEXELS) / _BRIGHTEST) * 255).astype(np.uint8)
    pixels[..., :3] = grey[..., None]
    return Image("slabs", pixels)
