"""A tiny place and a picture as files: a floor with two posts and a hollow house."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from viewsphere.assets.glb import glb_bytes
from viewsphere.assets.mesh import Material, Mesh
from viewsphere.geometry.box import FACES, box_vertices

TRIANGLES = np.array([[f[i] for i in half] for f in FACES.values() for half in ((0, 1, 2), (0, 2, 3))], np.int32)
HOUSE = ((3.0, 2.0, -0.1), (6.0, 5.0, 3.0))


def blocks(*corners) -> Mesh:
    """One part a block, given by its lowest and highest corner; faces outwards."""
    vertices, triangles, normals, parts = [], [], [], []
    for part, (low, high) in enumerate(corners):
        box = box_vertices(low, high)
        for face in FACES.values():
            a, b, c, d = (box[i] for i in face)
            normal = np.cross(b - a, d - a)
            outward = np.sign(np.dot(normal, (a + c) / 2 - box.mean(axis=0)))
            start = len(vertices)
            vertices += [a, b, c, d]
            order = ((0, 1, 2), (0, 2, 3)) if outward > 0 else ((0, 2, 1), (0, 3, 2))
            triangles += [[start + i for i in t] for t in order]
            normals += [outward * normal / np.linalg.norm(normal)] * 4
            parts += [part] * 2
    return Mesh(
        np.array(vertices, np.float32),
        np.array(triangles, np.int32),
        np.array(normals, np.float32),
        np.zeros(len(triangles), np.int32),
        np.array(parts, np.int32),
        materials=(Material("stone", (0.3, 0.3, 0.3, 1.0)),),
        parts=tuple(f"part{i}" for i in range(len(corners))),
    )


def write_place(path: Path) -> Path:
    """A 20 m floor with its top at z = 0, two posts and a house."""
    floor = ((-10.0, -10.0, -0.05), (10.0, 10.0, 0.0))
    posts = [((x, y, 0.0), (x + 0.1, y + 0.1, 1.5)) for x, y in ((-0.5, -0.6), (0.7, -0.4))]
    path.write_bytes(glb_bytes(blocks(floor, *posts, HOUSE)))
    return path


def write_picture(path: Path, color=(200, 60, 40), size=(40, 20)) -> Path:
    """A plain picture."""
    from PIL import Image

    path.parent.mkdir(exist_ok=True, parents=True)
    Image.new("RGB", size, color).save(path)
    return path
