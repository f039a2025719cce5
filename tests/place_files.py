"""Tiny places and a picture as files: a floor with two posts and a hollow house; places whose objects say what they are."""

from __future__ import annotations

import base64
import json
from pathlib import Path

import numpy as np

from viewsphere.assets.exporting.glb import glb_bytes
from viewsphere.assets.mesh import Material, Mesh
from viewsphere.geometry.box3d import Box3d

FACES = Box3d.numbered_faces().values()
TRIANGLES = np.array([[f[i] for i in half] for f in FACES for half in ((0, 1, 2), (0, 2, 3))], np.int32)
HOUSE = ((3.0, 2.0, -0.1), (6.0, 5.0, 3.0))


def blocks(*corners) -> Mesh:
    """One part a block, given by its lowest and highest corner; faces outwards."""
    vertices, triangles, normals, parts = [], [], [], []
    for part, (low, high) in enumerate(corners):
        box = Box3d.between(low, high).corners
        for face in FACES:
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


FILE_FROM_PLACE = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
"""To glTF's axes: up +Y, front +Z."""

RAMP = np.array([[-8, -30, 0], [-8, -10, 0], [-7, 10, 0.5], [-4, 30, 1.0]], float)
"""A lane's points."""

YARD = [
    {"name": "Floor", "block": ((-3, -3, -0.1), (3, 3, 0)), "color": (0.45, 0.42, 0.38)},
    {
        "name": "Surface.Table",
        "block": ((-0.6, -0.4, 0.7), (0.6, 0.4, 0.75)),
        "at": (1.5, 1.2),
        "turn": 20,
        "color": (0.5, 0.3, 0.15),
    },
    {"name": "road", "strip": RAMP, "color": (0.12, 0.12, 0.13)},
    {"name": "lane_north", "line": RAMP},
    {
        "name": "Lane_Loop.001",
        "children": {"p10": (9, 9, 0), "p2": (9, -9, 0), "p1": (-9, -9, 0)},
        "extras": {"closed": True, "width": 2.5},
    },
]
"""Objects of a place, metres, +Z up: blocks, a strip along points, a line, and an empty with empties below it."""


def write_marked(path: Path, objects=YARD, file_from_place=FILE_FROM_PLACE, node_pose=lambda name: np.eye(4)) -> Path:
    """A glTF file of these objects. `node_pose`: where an object's own axes are in the file's."""
    root = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [], "meshes": [], "materials": []}
    root |= {"accessors": [], "bufferViews": []}
    data = bytearray()

    def accessor(array, kind, code):
        root["bufferViews"].append({"buffer": 0, "byteOffset": len(data), "byteLength": array.nbytes})
        bounds = {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()} if kind == "VEC3" else {}
        view = len(root["bufferViews"]) - 1
        root["accessors"].append({"bufferView": view, "componentType": code, "count": len(array), "type": kind, **bounds})
        data.extend(array.tobytes())
        return len(root["accessors"]) - 1

    for one in objects:
        pose = node_pose(one["name"])
        own = np.linalg.inv(pose) @ file_from_place
        node = {"name": one["name"], "matrix": pose.T.reshape(-1).tolist(), "extras": one.get("extras", {})}
        root["nodes"].append(node)
        root["scenes"][0]["nodes"].append(len(root["nodes"]) - 1)
        points, order, mode = _drawn(one)
        if mode:
            here = np.array(points, float) @ own[:3, :3].T + own[:3, 3]
            primitive = {"attributes": {"POSITION": accessor(here.astype(np.float32), "VEC3", 5126)}, "mode": mode}
            primitive["indices"] = accessor(np.array(order, np.uint32).reshape(-1), "SCALAR", 5125)
            if mode == 4:
                color = [*one.get("color", (0.5, 0.5, 0.5)), 1.0]
                root["materials"].append(
                    {"pbrMetallicRoughness": {"baseColorFactor": color, "metallicFactor": 0}, "doubleSided": True}
                )
                primitive["material"] = len(root["materials"]) - 1
            root["meshes"].append({"primitives": [primitive]})
            node["mesh"] = len(root["meshes"]) - 1
        for name, place in one.get("children", {}).items():
            root["nodes"].append({"name": name, "translation": (own[:3, :3] @ np.array(place, float) + own[:3, 3]).tolist()})
            node.setdefault("children", []).append(len(root["nodes"]) - 1)
    root["buffers"] = [{"byteLength": len(data), "uri": "data:;base64," + base64.b64encode(data).decode()}]
    path.write_text(json.dumps({key: value for key, value in root.items() if value != []}))
    return path


def _drawn(one):
    """Points (N, 3), indices and glTF's mode of an object; mode 0 for an empty."""
    if "block" in one:
        c, s = np.cos(np.radians(one.get("turn", 0))), np.sin(np.radians(one.get("turn", 0)))
        mesh = blocks(one["block"])
        moved = mesh.vertices @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + (*one.get("at", (0, 0)), 0)
        return moved, mesh.triangles, 4
    if "strip" in one:
        rows = [row for point in one["strip"] for row in point + np.outer((-1.5, 0, 1.5), (1, 0, 0))]
        near = [[3 * i, 3 * i + 1, 3 * i + 3, 3 * i + 1, 3 * i + 4, 3 * i + 3] for i in range(len(one["strip"]) - 1)]
        return rows, [[index + k for index in quad] for quad in near for k in (0, 1)], 4
    if "faces" in one:
        return one["faces"], [[0, i, i + 1] for i in range(1, len(one["faces"]) - 1)], 4
    if "line" in one:
        return one["line"], one.get("edges", range(len(one["line"]))), 1 if "edges" in one else 3
    return (), (), 0
