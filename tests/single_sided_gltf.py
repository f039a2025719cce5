"""glTF files of single-sided squares."""

import base64
import json

import numpy as np

SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
INDICES = np.array([0, 1, 2, 0, 2, 3], np.uint16)


def gltf(nodes):
    """A glTF file of squares that face +z, from the materials and other fields of nodes; the last material has both sides."""
    raw = SQUARE.tobytes() + INDICES.tobytes()
    colors = ([0.8, 0.05, 0.05, 1], [0.05, 0.6, 0.05, 1], [0.1, 0.1, 0.8, 1])
    return json.dumps({
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(raw), "uri": "data:;base64," + base64.b64encode(raw).decode()}],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
        "materials": [
            {"pbrMetallicRoughness": {"baseColorFactor": color, "metallicFactor": 0}, "doubleSided": i == 2}
            for i, color in enumerate(colors)
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": i}]} for i in range(3)],
        "nodes": [{"mesh": material, **fields} for material, fields in nodes],
        "scenes": [{"nodes": [*range(len(nodes))]}],
        "scene": 0,
    })  # fmt: skip


TURNED = {"rotation": [0, 1, 0, 0]}  # half a turn about y: it faces -z
