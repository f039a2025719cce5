"""Scenes of a mesh or more in an even sky, rendered by the Blender that $VIEWSPHERE_BLENDER_PYTHON names."""

from __future__ import annotations

import json
import math
import os
import subprocess
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
import pytest

import viewsphere
from shots import still_shot
from viewsphere.assets.mesh import Image, Material, Mesh
from viewsphere.engines import raster
from viewsphere.geometry.camera import orbit_center, orbit_rotation
from viewsphere.model import scene as model
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.model.thing import Thing

VARIABLE = "VIEWSPHERE_BLENDER_PYTHON"
UPRIGHT = ((0, 1), (1, 1), (1, 0), (0, 0))
"""Texture coordinates of a rectangle whose picture stands upright."""


@dataclass(frozen=True)
class Scene:
    """Meshes in a sky of radiance `sky` all around, and a sun of irradiance 1 in the direction `sun`.

    sharp: look only through the middles of the pixels. fixed: what all materials are told besides.
    """

    meshes: tuple[Mesh, ...]
    camera: Camera
    sky: float = 1.0
    sun: tuple[float, float, float] | None = None
    samples: int = 16
    transparent: bool = False
    sharp: bool = False
    fixed: Mapping[str, float] = field(default_factory=dict)


def interpreter() -> str:
    """The Python that has bpy; skips the test where there is none."""
    found = os.environ.get(VARIABLE)
    if not found or subprocess.run([found, "-c", "import bpy"], capture_output=True).returncode:
        pytest.skip(f"needs a Python with bpy in ${VARIABLE}")
    return found


def rendered(scenes: Mapping[str, Scene], folder: Path) -> dict[str, np.ndarray]:
    """Pictures (H, W, 4) float32 of all scenes: scene-linear, premultiplied, the first row on top."""
    python = interpreter()
    told = [_told(scene, folder, f"{i}") for i, scene in enumerate(scenes.values())]
    (folder / "scenes.json").write_text(json.dumps(told))
    package = Path(viewsphere.__file__).parent / "blender"
    command = [python, "-P", str(Path(__file__).with_name("render_scenes.py")), str(package), str(folder)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-4000:]
    return {name: np.load(scene["out"]) for name, scene in zip(scenes, told, strict=True)}


def _told(scene: Scene, folder: Path, name: str) -> dict:
    view, fields = scene.camera, ("sky", "sun", "samples", "transparent", "sharp")
    return {field: getattr(scene, field) for field in fields} | {
        "meshes": [_mesh_request(mesh, scene.fixed, folder, f"{name}.{k}") for k, mesh in enumerate(scene.meshes)],
        "camera": {
            "width": view.width,
            "height": view.height,
            "focal": view.intrinsics.fx,
            "R": view.R.tolist(),
            "center": view.center.tolist(),
        },
        "out": str(folder / f"{name}.picture.npy"),
    }


def _mesh_request(mesh: Mesh, fixed: Mapping[str, float], folder: Path, name: str) -> dict:
    def saved(array, what):
        if array is None:
            return None
        np.save(folder / f"{name}.{what}.npy", array)
        return str(folder / f"{name}.{what}.npy")

    arrays = "vertices", "triangles", "normals", "triangle_material", "uv0", "uv1", "colors"
    return {what: saved(getattr(mesh, what), what) for what in arrays} | {
        "materials": [asdict(material) | fixed for material in mesh.materials],
        "images": [{"name": i.name, "pixels": saved(i.pixels, f"image{k}")} for k, i in enumerate(mesh.images)],
    }


def camera(size: tuple[int, int], focal: float, azimuth=0.0, elevation=0.0, distance=1.0, target=(0, 0, 0)) -> Camera:
    """Looks at the target from a distance, at azimuth 0 along +Y."""
    width, height = size
    a, e = math.radians(azimuth), math.radians(elevation)
    rotation = orbit_rotation(a, e)
    intrinsics = Intrinsics(width=width, height=height, fx=focal, fy=focal, cx=width / 2, cy=height / 2)
    return Camera(intrinsics, rotation, -rotation @ (np.asarray(target) + orbit_center(a, e, distance)))


def rectangle(corner, across, up, material: Material, uv=UPRIGHT, images=(), **fields) -> Mesh:
    """Two triangles with flat normals, counter-clockwise from the corner: the lower right one, the upper left one."""
    o, a, b = (np.asarray(x, float) for x in (corner, across, up))
    normal = np.cross(a, b)
    values = {
        "vertices": np.array([o, o + a, o + a + b, o + b], np.float32),
        "triangles": np.array([(0, 1, 2), (0, 2, 3)], np.int32),
        "normals": np.tile(np.float32(normal / np.linalg.norm(normal)), (4, 1)),
        "triangle_material": np.zeros(2, np.int32),
        "triangle_part": np.zeros(2, np.int32),
        "materials": (material,),
        "uv0": np.array(uv, np.float32),
        "images": tuple(images),
    }
    return Mesh(**(values | fields))


def card(material: Material, size: float = 2.0, y: float = 0.0, **fields) -> Mesh:
    """An upright square around the origin that faces -Y."""
    return rectangle((-size / 2, y, -size / 2), (size, 0, 0), (0, 0, size), material, **fields)


def ball(material: Material, rings: int = 24) -> Mesh:
    """A sphere of radius 1 with smooth normals."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, 2 * rings + 1), indexing="ij")
    normal = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1).reshape(-1, 3)
    i, j = (g.ravel() for g in np.meshgrid(np.arange(rings), np.arange(2 * rings), indexing="ij"))
    a, b = i * (2 * rings + 1) + j, (i + 1) * (2 * rings + 1) + j
    triangles = np.concatenate([np.stack([a, b, b + 1], 1)[i < rings - 1], np.stack([a, b + 1, a + 1], 1)[i > 0]])
    zeros = np.zeros(len(triangles), np.int32)
    smooth = normal.astype(np.float32)
    return Mesh(smooth, triangles.astype(np.int32), smooth, zeros, zeros, materials=(material,))


def flat_image(*rgba: int) -> Image:
    """One colour; opaque unless told."""
    return Image("flat", np.full((4, 4, 4), rgba if len(rgba) == 4 else (*rgba, 255), np.uint8))


def raster_stage(mesh: Mesh, scene: model.Scene):
    """The mesh alone in the raster engine."""
    spec = ModelSpec(key="model", source="memory", category="thing", category_id=1)
    return raster.stage(still_shot([Thing(id=1, model=spec)], scene=scene), lambda _: mesh)
