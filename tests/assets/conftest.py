"""Hand-made model files."""

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

CODES = {"f4": 5126, "u1": 5121, "u2": 5123, "u4": 5125, "i1": 5120, "i2": 5122}
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}

CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float32)
CUBE_TRIANGLES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
     [1, 5, 7], [1, 7, 3]], np.uint16
)  # fmt: skip


class Gltf:
    """A glTF file in the making: `root` is its JSON; arrays become accessors."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.data = b""
        self.root: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "accessors": [],
            "bufferViews": [],
            "materials": [],
            "meshes": [],
            "nodes": [],
        }

    def view(self, data: bytes, stride: int | None = None) -> int:
        self.data += b"\0" * (-len(self.data) % 4)
        entry = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)}
        self.root["bufferViews"].append(entry | ({"byteStride": stride} if stride else {}))
        self.data += data
        return len(self.root["bufferViews"]) - 1

    def accessor(self, array: np.ndarray, **more: Any) -> int:
        rows = np.ascontiguousarray(array).reshape(len(array), -1)
        entry = {
            "bufferView": self.view(rows.tobytes()),
            "componentType": CODES[rows.dtype.str[1:]],
            "count": len(rows),
            "type": KINDS[rows.shape[1]],
        }
        self.root["accessors"].append(entry | more)
        return len(self.root["accessors"]) - 1

    def mesh(self, positions: np.ndarray, indices: np.ndarray | None, name: str = "", **more: Any) -> int:
        """A mesh of one primitive; arrays among `more` are attributes, the rest the primitive's fields."""
        attributes = {"POSITION": self.accessor(positions)}
        attributes |= {k: self.accessor(v) for k, v in more.items() if isinstance(v, np.ndarray)}
        primitive = {k: v for k, v in more.items() if not isinstance(v, np.ndarray)} | {"attributes": attributes}
        if indices is not None:
            primitive["indices"] = self.accessor(indices.reshape(-1))
        self.root["meshes"].append({"name": name, "primitives": [primitive]})
        return len(self.root["meshes"]) - 1

    def node(self, **fields: Any) -> int:
        self.root["nodes"].append(fields)
        return len(self.root["nodes"]) - 1

    def write(self) -> Path:
        root = {key: value for key, value in self.root.items() if value}
        if self.data:
            root["buffers"] = [{"byteLength": len(self.data)}]
        text = json.dumps(root).encode()
        text += b" " * (-len(text) % 4)
        data = self.data + b"\0" * (-len(self.data) % 4)
        head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(data))
        body = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
        self.path.write_bytes(head + body)
        return self.path


@pytest.fixture
def gltf(tmp_path: Path) -> Gltf:
    return Gltf(tmp_path / "hand.glb")


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str, str | bytes], Path]:
    """Write a file into the test's folder."""

    def write(name: str, content: str | bytes) -> Path:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


@pytest.fixture
def cube() -> tuple[np.ndarray, np.ndarray]:
    """Vertices and outward triangles of the unit cube."""
    return CUBE, CUBE_TRIANGLES


@pytest.fixture
def volume() -> Callable[[Any], float]:
    """Signed volume of a mesh: positive when its triangles are counter-clockwise from outside."""

    def signed(mesh: Any) -> float:
        a, b, c = (mesh.vertices[mesh.triangles[:, i]].astype(np.float64) for i in range(3))
        return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)

    return signed
