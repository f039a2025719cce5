"""Blocks of samples of a mesh, as the engine's kernels see them."""

from __future__ import annotations

import numpy as np
from called import called

from viewsphere.assets.mesh import Image, Material, Mesh
from viewsphere.engines.raster.materials.kernels_material import material
from viewsphere.engines.raster.materials.surface import Lengths, Rows, pack_materials
from viewsphere.engines.raster.records import PictureRays
from viewsphere.engines.raster.shading import kernels_block as block
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Ground
from viewsphere.model.thing import Thing
from viewsphere.truth.raster.geometry import build_geometry

shown = called(material)
SPEC = ModelSpec(key="model", source="memory", category="thing", category_id=1)
LEVEL = np.array([128, 128, 255, 255], np.uint8)


def flat_image(*rgba: int, size: int = 4) -> Image:
    pixels = np.empty((size, size, 4), np.uint8)
    pixels[:] = (*rgba, 255)[:4] if len(rgba) == 3 else rgba
    return Image("flat", pixels)


def card(used: Material, images=(), uv=((0, 1), (1, 1), (1, 0), (0, 0)), **fields) -> Mesh:
    """A square from (-1, 0, -1) to (1, 0, 1) that faces -Y; corners from the lower left, counter-clockwise."""
    return Mesh(
        vertices=np.array([(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)], np.float32),
        triangles=np.array([(0, 1, 2), (0, 2, 3)], np.int32),
        normals=np.tile(np.array([0, -1, 0], np.float32), (4, 1)),
        triangle_material=np.zeros(2, np.int32),
        triangle_part=np.zeros(2, np.int32),
        materials=(used,),
        uv0=None if uv is None else np.array(uv, np.float32),
        images=tuple(images),
        **fields,
    )


def packed(mesh: Mesh, ground: Ground | None = None, repaints=()):
    """Surfaces and textures of the mesh alone, in metres from the world's origin."""
    thing = Thing(id=1, model=SPEC, repaints=repaints)
    geometry = build_geometry((thing,), (mesh,), ground is not None, 0.01)
    metres = Lengths((0.0, 0.0, 0.0), 1.0)
    materials = pack_materials((mesh,), ground, metres, 1, (thing,))
    rows = Rows.from_geometry(geometry, (mesh,), materials, metres)
    rows.write([0])
    return rows.surfaces, materials.textures


def view_of(rotation, rays=None) -> PictureRays:
    """Only what materials need of a view: its axes."""
    values = {
        "eye": np.zeros(3, np.float32),
        "rotation": np.ascontiguousarray(rotation, np.float32),
        "lens": np.zeros((2, 3), np.float32),
        "rays": np.zeros((0, 3), np.float32) if rays is None else np.ascontiguousarray(rays, np.float32),
        "places": np.zeros((0, 2), np.float32),
        "columns": np.uint32(1),
        "pixel": np.float32(0),
        "scale": np.float32(1),
    }
    return PictureRays(**{name: values[name] for name in PictureRays._fields if name in values})


FRONT = view_of([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # looks along +Y, x to the right, image down is -Z


def edges_of(surfaces, seen, normals) -> dict[str, np.ndarray]:
    """The rows that tell the edges of the seen triangles, for smooth normals (N, 3) on the viewer's side."""
    first, second, third = surfaces.vertices[surfaces.triangles[seen].T]
    rows = {"SIDE": np.where((normals * first[:, :3]).sum(1) >= 0, 1, -1)}
    for letter, way in (("A", second - first), ("B", third - first)):
        rows |= {letter + axis: way[:, 11 + k] for k, axis in enumerate("XYZ")}
        rows |= {f"{axis}{letter}{k}": way[:, 3 + 2 * k + "UV".index(axis)] for k in (0, 1) for axis in "UV"}
    return rows


def made(surfaces, textures, given, seen=0, which=0, view=FRONT) -> dict[str, np.ndarray]:
    """All rows of the samples after `material`; `given` are rows by name (V, G, N as (N, 3) by their letter), by default those
    of one sample in the card's middle, seen from straight in front.
    """
    count = max(len(np.atleast_1d(value)) for value in given.values()) if given else 1
    rows = {"PIXEL": 1e-4, "U0": 0.5, "V0": 0.5, "U1": 0.5, "V1": 0.5, "RED": 1, "GREEN": 1, "BLUE": 1, "ALPHA": 1}
    rows |= {"VX": 0, "VY": -1, "VZ": 0, "GX": 0, "GY": -1, "GZ": 0, "NX": 0, "NY": -1, "NZ": 0}
    for name, value in given.items():
        if name in "VGN":
            rows |= {name + axis: np.asarray(value)[:, k] for k, axis in enumerate("XYZ")}
        else:
            rows[name] = value
    names = [name for name in vars(block) if name.isupper() and isinstance(getattr(block, name), int)]
    names = [name for name in names if name not in ("BLOCK", "ROWS")]
    rows = {name: np.broadcast_to(np.float32(value), count) for name, value in rows.items()}
    seen, which = (np.broadcast_to(np.asarray(index, np.int32), count) for index in (seen, which))
    rows |= edges_of(surfaces, seen, np.stack([rows["N" + axis] for axis in "XYZ"], 1))
    found = {name: np.zeros(count, np.float32) for name in names}
    for start in range(0, count, block.BLOCK):
        part = slice(start, min(start + block.BLOCK, count))
        size = part.stop - part.start
        b = np.zeros(block.ROWS * block.BLOCK, np.float32)
        for name, value in rows.items():
            b[getattr(block, name) :][:size] = value[part]
        own = np.zeros(block.BLOCK, np.int32)
        own[:size] = which[part]
        shown(size, view, surfaces, textures, b, own)
        for name in names:
            found[name][part] = b[getattr(block, name) :][:size]
    return found
