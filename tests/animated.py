"""Files that move: one without Blender, as what `load_frames` would read of it is computed, and glTF."""

from __future__ import annotations

import base64
import json

import numpy as np

from scratch import scratch_cache
from viewsphere.assets.animation.timeline import Blenders, Timeline
from viewsphere.assets.mesh import Image, Material, Mesh, Texture
from viewsphere.assets.primitive import FileFacts
from viewsphere.assets.sandbox.client import READ_HERE

LAST = 49
TORN = 37
"""From this frame on the walker has other triangles, and another material."""

CORNERS = np.array([(x, y, z) for x in (-0.3, 0.3) for y in (-0.2, 0.2) for z in (0, 1)], np.float32)
SIDES = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4)]
TOP = [(1, 5, 7), (1, 7, 3)]
PIXELS = np.random.default_rng(3).integers(0, 256, (4, 4, 4)).astype(np.uint8)


def walker(frame: int) -> Mesh:
    """A textured box that leans and rises, in the axes of its file; it loses its lid at the frame `TORN`."""
    lean = (frame - 1) / 48
    vertices = CORNERS + np.array([0.5, 0.25, 0], np.float32) * CORNERS[:, 2:] * np.float32(lean) + np.float32([0, 0, lean / 3])
    triangles = np.array(SIDES if frame >= TORN else SIDES + TOP, np.int32)
    normals = CORNERS / np.linalg.norm(CORNERS, axis=1, keepdims=True)
    paint = Material(name="paint", base_color_texture=Texture(0))
    return Mesh(
        vertices=vertices.astype(np.float32),
        triangles=triangles,
        normals=normals.astype(np.float32),
        triangle_material=(np.arange(len(triangles)) % 6 // 3).astype(np.int32),
        triangle_part=(np.arange(len(triangles)) // 6).astype(np.int32),
        materials=(paint, Material(name="torn" if frame >= TORN else "whole", base_color=(0.9, 0.2, 0.1, 1))),
        parts=("legs", "body"),
        uv0=CORNERS[:, :2].copy(),
        images=(Image("pixels", PIXELS),),
    )


def let_walk(monkeypatch, folder) -> None:
    """Let `walker.fbx`, in this folder, be a file of `LAST` frames, 24 a second, that holds a walker."""
    (folder / "walker.fbx").write_bytes(b"walks")

    def timeline(_, path, confined, clip=None, fps=None):
        return Timeline(1, LAST, 24.0, True)

    def load_frames(path, frames, **_):
        for frame in (1, *frames):
            yield walker(frame), FileFacts(path, "fbx", "+z", "-y", 1.0, files=(path,))

    monkeypatch.setattr(Blenders, "timeline", timeline)
    monkeypatch.setattr("viewsphere.assets.load.load_frames", load_frames)
    monkeypatch.setenv(READ_HERE, "1")
    scratch_cache(monkeypatch, folder / "cache")


def leaf(path, clips: dict[str, float]) -> None:
    """Write a glTF file of a triangle that moves by 1 m, in animations of these names that take so many seconds each."""
    corners, way = np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 1]]), np.float32([[0, 0, 0], [1, 0, 0]])
    arrays = [corners, way, *(np.float32([[0], [seconds]]) for seconds in clips.values())]
    starts = np.cumsum([0, *(array.nbytes for array in arrays)]).tolist()
    data = base64.b64encode(b"".join(array.tobytes() for array in arrays)).decode()
    target = {"node": 0, "path": "translation"}
    gltf = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "buffers": [{"byteLength": starts[-1], "uri": f"data:application/octet-stream;base64,{data}"}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": array.nbytes} for start, array in zip(starts, arrays, strict=False)
        ],
        "accessors": [
            {
                "bufferView": i,
                "componentType": 5126,
                "count": len(array),
                "type": "VEC3" if array.shape[1] == 3 else "SCALAR",
                "min": array.min(0).tolist(),
                "max": array.max(0).tolist(),
            }
            for i, array in enumerate(arrays)
        ],
        "animations": [
            {"name": name, "samplers": [{"input": i, "output": 1}], "channels": [{"sampler": 0, "target": target}]}
            for i, name in enumerate(clips, 2)
        ],
    }
    if not clips:
        del gltf["animations"]  # an empty list is not valid
    path.write_text(json.dumps(gltf))
