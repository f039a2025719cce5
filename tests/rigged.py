"""Rigged models as glTF files: a mesh, bones, and which of them bend each vertex."""

from __future__ import annotations

import base64
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

SIDES = 8

BODY = {
    "hips": (None, (0, 0.95, 0), (0, 1.1, 0), 0.15),
    "chest": ("hips", (0, 1.1, 0), (0, 1.42, 0), 0.17),
    "neck": ("chest", (0, 1.42, 0), (0, 1.52, 0), 0.06),
    "head": ("neck", (0, 1.52, 0), (0, 1.76, 0), 0.11),
    **{
        f"{name}_{side}": (
            above and f"{above}_{side}" if above not in ("chest", "hips") else above,
            (s * x, y, z),
            (s * u, v, w),
            r,
        )
        for side, s in (("left", 1), ("right", -1))
        for name, above, (x, y, z), (u, v, w), r in (
            ("upper_arm", "chest", (0.2, 1.38, 0), (0.34, 1.12, 0), 0.055),
            ("forearm", "upper_arm", (0.34, 1.12, 0), (0.42, 0.88, 0.08), 0.045),
            ("hand", "forearm", (0.42, 0.88, 0.08), (0.44, 0.76, 0.12), 0.04),
            ("thigh", "hips", (0.1, 0.93, 0), (0.13, 0.5, 0.02), 0.085),
            ("shin", "thigh", (0.13, 0.5, 0.02), (0.14, 0.08, 0), 0.06),
            ("foot", "shin", (0.14, 0.05, -0.04), (0.15, 0.04, 0.18), 0.05),
        )
    },
}
"""A person's bones in glTF's axes (up +y, front +z, metres): the one above, where it begins and ends, and how thick it is."""


@dataclass
class Rigged:
    """Vertices (V, 3), triangles (T, 3), bones (V, K) that bend them, and weights; the bones' names, places and parents."""

    vertices: np.ndarray
    triangles: np.ndarray
    bones: np.ndarray
    weights: np.ndarray
    names: list[str]
    places: np.ndarray
    above: list[int | None]


def tube(start, end, radii):
    """A closed tube of rings with these radii, evenly spaced from start to end: vertices, triangles."""
    along = np.subtract(end, start, dtype=float)
    side = np.cross(along, (0, 0, 1) if abs(along[2]) < 0.7 * np.linalg.norm(along) else (0, 1, 0))
    side /= np.linalg.norm(side)
    other = np.cross(along / np.linalg.norm(along), side)
    turn = 2 * np.pi * np.arange(SIDES) / SIDES
    round_ = np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * other
    rings = [np.add(start, t * along) + r * round_ for t, r in zip(np.linspace(0, 1, len(radii)), radii, strict=True)]
    vertices = np.round(np.vstack([*rings, [start], [end]]), 4)
    low = (np.arange(len(radii) - 1)[:, None] * SIDES + np.arange(SIDES)).reshape(-1)
    low_next = low - low % SIDES + (low + 1) % SIDES
    first, last = np.arange(SIDES), (len(radii) - 1) * SIDES + np.arange(SIDES)
    caps = len(vertices) - 2, len(vertices) - 1
    triangles = np.vstack(
        [
            np.column_stack([low, low_next, low + SIDES]),
            np.column_stack([low_next, low_next + SIDES, low + SIDES]),
            np.column_stack([np.roll(first, -1), first, np.full(SIDES, caps[0])]),
            np.column_stack([last, np.roll(last, -1), np.full(SIDES, caps[1])]),
        ]
    )
    return vertices, triangles


def arm() -> Rigged:
    """A tube of 2 m with a ring each 0.1 m, which two bones of 1 m bend: between 0.8 and 1.2 m their weights go over."""
    vertices, triangles = tube((0, 0, 0), (0, 2, 0), np.full(21, 0.2))
    second = np.clip((vertices[:, 1] - 0.8) / 0.4, 0, 1)
    bones = np.tile([0, 1], (len(vertices), 1))
    return Rigged(
        vertices, triangles, bones, np.column_stack([1 - second, second]), ["lower", "upper"],
        np.float64([[0, 0, 0], [0, 1, 0]]), [None, 0],
    )  # fmt: skip


def person(body=BODY) -> Rigged:
    """A standing figure; around each joint the weights go over from one bone to the next."""
    names = list(body)
    vertices, triangles, bones, weights = [], [], [], []
    for number, (above, start, end, radius) in enumerate(body.values()):
        own, faces = tube(start, end, radius * np.array([0.6, 0.95, 1, 1, 0.9, 0.55]))
        triangles.append(faces + sum(map(len, vertices)))
        along = np.subtract(end, start)
        share = np.clip((own - start) @ along / (along @ along), 0, 1)
        first = np.round(np.clip(0.6 + 2 * share, 0, 1), 3) if above else np.ones(len(own))
        vertices.append(own)
        bones.append(np.tile([number, names.index(above) if above else number], (len(own), 1)))
        weights.append(np.column_stack([first, 1 - first]))
    return Rigged(
        *map(np.vstack, (vertices, triangles, bones, weights)), names,
        np.float64([start for _, start, _, _ in body.values()]),
        [above and names.index(above) for above, *_ in body.values()],
    )  # fmt: skip


def write_gltf(rigged: Rigged, file: Path, turned: dict[str, list[float]] | None = None, color=(0.75, 0.55, 0.45, 1.0)) -> Path:
    """Write the model as one glTF file; `turned` are rotations of bones (quaternions x, y, z, w) by their names."""
    four = np.zeros((2, len(rigged.vertices), 4))
    four[0, :, : rigged.bones.shape[1]], four[1, :, : rigged.bones.shape[1]] = rigged.bones, rigged.weights
    binds = np.tile(np.eye(4), (len(rigged.names), 1, 1))
    binds[:, :3, 3] = -rigged.places
    arrays = [
        (rigged.vertices.astype("<f4"), 5126, "VEC3"),
        (rigged.triangles.reshape(-1, 1).astype("<u4"), 5125, "SCALAR"),
        (four[0].astype("u1"), 5121, "VEC4"),
        (four[1].astype("<f4"), 5126, "VEC4"),
        (binds.transpose(0, 2, 1).reshape(-1, 16).astype("<f4"), 5126, "MAT4"),
    ]
    starts = np.cumsum([0, *(array.nbytes for array, _, _ in arrays)]).tolist()
    data = base64.b64encode(b"".join(array.tobytes() for array, _, _ in arrays)).decode()
    nodes = [
        {
            "name": name,
            "translation": np.round(place - (0 if above is None else rigged.places[above]), 4).tolist(),
            **({"children": own} if (own := [k for k, other in enumerate(rigged.above) if other == i]) else {}),
            **({"rotation": turned[name]} if turned and name in turned else {}),
        }
        for i, (name, place, above) in enumerate(zip(rigged.names, rigged.places, rigged.above, strict=True))
    ]
    bounds = {"min": arrays[0][0].min(axis=0).tolist(), "max": arrays[0][0].max(axis=0).tolist()}
    primitive = {"attributes": {"POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3}, "indices": 1, "material": 0}
    gltf = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [len(nodes), *(i for i, above in enumerate(rigged.above) if above is None)]}],
        "nodes": [*nodes, {"name": "body", "mesh": 0, "skin": 0}],
        "skins": [{"joints": list(range(len(nodes))), "inverseBindMatrices": 4}],
        "meshes": [{"primitives": [primitive]}],
        "materials": [{"name": "clay", "pbrMetallicRoughness": {"baseColorFactor": list(color), "metallicFactor": 0}}],
        "buffers": [{"byteLength": starts[-1], "uri": f"data:application/octet-stream;base64,{data}"}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": array.nbytes}
            for start, (array, _, _) in zip(starts, arrays, strict=False)
        ],
        "accessors": [
            {"bufferView": i, "componentType": kind, "count": len(array), "type": shape, **(bounds if i == 0 else {})}
            for i, (array, kind, shape) in enumerate(arrays)
        ],
    }
    file.write_text(json.dumps(gltf) + "\n", encoding="utf-8", newline="\n")
    return file
