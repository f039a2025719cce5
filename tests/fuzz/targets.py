"""What reads files that strangers wrote, each with small files of the project's own to damage.

A target is called with a folder; it may return or raise ViewsphereError. Anything else is a finding.
"""

from __future__ import annotations

import io
import json
import shutil
from base64 import b64encode
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import cache, partial
from pathlib import Path
from random import Random

import numpy as np
from mutation import glb, mutated

from cube_dataset import LENS, MESHES, POSES, make
from pictures import photograph, sunny, write, write_hdr
from sealing import seal_again
from viewsphere.composing.tables import table_rows
from viewsphere.errors import ViewsphereError

Pack = tuple["Sample", ...]


@dataclass(frozen=True)
class Sample:
    """A whole small file: its name, its bytes, how it is damaged (`mutation.mutated`), files beside it, and which of them all is
    opened, if not itself.
    """

    name: str
    data: bytes
    kind: str = "bytes"
    beside: Mapping[str, bytes] = field(default_factory=dict[str, bytes])
    opened: str = ""


@dataclass(frozen=True)
class Files:
    """A target that opens one file: `call` is given its path."""

    call: Callable[[Path], object]
    corpus: Callable[[], Pack]

    def damage(self, folder: Path, rng: Random) -> str:
        """Put a damaged file into an empty folder; returns the name of the file to open."""
        sample = rng.choice(self.corpus())
        return self.lay(folder, sample, mutated(sample.data, rng, sample.kind))

    def lay(self, folder: Path, sample: Sample, data: bytes) -> str:
        """Put a sample with this content, and the files beside it, into an empty folder; returns the name of the file to open."""
        for name, beside in sample.beside.items():
            (folder / name).write_bytes(beside)
        (folder / sample.name).write_bytes(data)
        return sample.opened or sample.name

    def run(self, folder: Path, opened: str) -> None:
        """Read what was damaged."""
        self.call(folder / opened)


@dataclass(frozen=True)
class Folders:
    """A target that opens a folder of which one file is damaged: `call` is given the folder `in`, and `out` to write to."""

    call: Callable[[Path, Path], object]
    wholes: tuple[Callable[[], Path], ...]
    among: tuple[str, ...]
    """Patterns of the files that are damaged, each as often as the others."""
    parts: tuple[str, ...]
    """What lies in the folder and is needed."""

    def damage(self, folder: Path, rng: Random) -> str:
        """Put the folder's copy `in` into an empty folder, with one file damaged, its digests mostly made to fit."""
        root = folder / "in"
        self.lay(root, rng.choice(self.wholes)())
        files: list[Path] = []
        while not files:  # not every folder has files of all kinds
            files = sorted(path for path in root.glob(rng.choice(self.among)) if path.is_file())
        for _ in range(1 if rng.random() < 0.9 else 2):
            file = rng.choice(files)
            data = mutated(file.read_bytes(), rng, _kind(file))
            file.unlink()  # it may be a hard link
            file.write_bytes(data)
        if rng.random() < 0.8:
            plan, manifests = root / "store/plan.json", rng.random() < 0.9
            kept = plan.read_bytes() if plan.exists() else b""
            if manifests:
                seal_again(root)
            if kept:
                plan.write_bytes(kept)
        return "in"

    def lay(self, root: Path, whole: Path) -> None:
        """Copy what is needed of a folder."""
        for part in self.parts:
            shutil.copytree(whole / part, root / part)

    def run(self, folder: Path, opened: str) -> None:
        """Read what was damaged."""
        self.call(folder / opened, folder / "out")


def _kind(file: Path) -> str:
    if file.name in {"plan.json", "manifest.json"}:
        return "sealed"
    return {
        ".json": "json",
        ".obj": "text",
        ".mtl": "text",
        ".csv": "text",
        ".md": "text",
        ".glb": "glb",
        ".npz": "zip",
        ".mat": "mat",
    }.get(file.suffix, "bytes")


# MATLAB's files


def _mat(path: Path) -> None:
    from viewsphere.codecs.mat import read_mat

    with suppress(ValueError):
        read_mat(path.read_bytes(), 1 << 20)


@cache
def mats() -> Pack:
    from viewsphere.formats.shared.viewpoint_mat import mat, structs

    inner = structs([{"text": "d'été", "numbers": np.eye(3), "cell": np.array([["a", 1.5]], object)}] * 2)
    return (Sample("record.mat", mat(record=inner), "mat"),)


# Recipes


def _plan(path: Path) -> None:
    from viewsphere import plan
    from viewsphere.recipe.recipe import Recipe

    found = plan(Recipe.load(path))
    for _ in zip(range(3), found.rows, strict=False):
        pass


PLY = (
    b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
    b"property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 1\n3 0 1 2\n"
)
CREDITS = b'file,licence,attribution,source_url\nbox.ply,CC-BY-4.0,"Ada, B",https://example.org/box\n*,CC0-1.0,,\n'
BASE = b"name: base\ncamera: {size: [64, 48], fov_deg: [30, 50]}\nviewpoints: {distance: 2}\nchannels: [rgb, depth]\n"


@cache
def recipes() -> Pack:
    from viewsphere.recipe.reading import file

    root = Path(__file__).parents[2]
    texts = [
        p.read_text("utf-8")
        for p in sorted([*root.glob("recipes/*.yaml"), *root.glob("src/viewsphere/recipe/starts/*/recipe.yaml")])
    ]
    texts = [text for text in texts if "blend" not in text]
    texts.append("extends: base.yaml\nmodels: [{source: box.ply, category: box}, {source: 'zoo:car', count: 2}]\n")
    texts += [SEQUENCE, FILED]
    beside = {
        "base.yaml": BASE, "box.ply": PLY, "credits.csv": CREDITS, "poses.csv": ORBITS, "photo.png": _encoded("PNG"),
        "sizes.csv": b"name,width,height,length\nbox,10,20,30\n", "rig.yaml": OPENCV, "points.csv": b"instant,x,y\n0,10,20\n7,3.5,4\n",
    }  # fmt: skip
    plain = [Sample("recipe.yaml", text.encode(), "text", beside) for text in texts]
    trees = [Sample("recipe.yaml", json.dumps(file.parse(text, "")[0]).encode(), "json", beside) for text in texts]
    one = b"extends: base.yaml\nmodels: [{source: box.ply, category: box}]\n"
    others = [
        Sample(
            name, beside[name], "bytes" if name.endswith("png") else "text", {**beside, "recipe.yaml": recipe}, "recipe.yaml"
        )
        for recipe, names in (
            (one, ("credits.csv", "base.yaml")),
            (FILED.encode(), ("sizes.csv", "poses.csv", "rig.yaml", "photo.png")),
            (SEQUENCE.encode(), ("points.csv",)),
        )
        for name in names
    ]
    return (*plain, *trees, *trees, *others)


SEQUENCE = """
models:
  - source: zoo:post_box
    category: box
    motion:
      - {kind: keyframes, keys: [{time: 0, position: [0, 0, 0]}, {time: 1, position: [1, 2, 0], rotation_deg: [0, 0, 40]}], leave: 1.5}
      - {kind: constant, velocity: [{uniform: [-0.02, 0.02]}, 0, 0]}
  - {source: zoo:chair, category: chair, motion: {kind: oscillate, position: [0.3, 0, 0], period: {uniform: [1, 3]}}}
time: {frames: 20, fps: 10, shutter: 0.5}
viewpoints: {kind: orbit, azimuth: [0, 60], elevation: [18, 30], distance: [3, 2.6], shake: {degrees: 0.4, mm: 6}}
rig: {kind: stereo, baseline: 0.2}
scene:
  ground: true
  company: {count: 1, draw: per_sequence, motion: {kind: random, position: [0.2, 0.2, 0], rotation_deg: [0, 0, 30], highest_hz: 1}}
splits: {by: sequence, train: 0.7, val: 0.3}
channels: [rgb, depth, flow]
camera: {size: [64, 48], fov_deg: 60}
tracks: {points: points.csv}
"""
FILED = """
models: [{source: box.ply, real_size: {csv: sizes.csv, unit: mm}, category: box, licence: CC0-1.0}]
viewpoints: {kind: file, path: poses.csv}
rig: {file: rig.yaml, rectified: true}
camera: {size: [64, 48], fov_deg: 40}
scene:
  background: {image: photo.png, fit: crop, zoom: [1, 3], place: [[0, 1], [0, 1]], blur: [0, 0.02]}
  ground: {image: photo.png, tile: [1, 3]}
  sun: {date: '2026-06-21', time: '14:30+02:00', latitude: 41.2, longitude: -8.6, strength: {log_uniform: [1, 8]}}
  lights: [{position: [[-2, 2], 0, 3], strength: {normal: {mean: 1, deviation: 0.5, min: 0.2, max: 2}}}]
"""


# Models


def _model(path: Path) -> None:
    from viewsphere.assets.load import load_model
    from viewsphere.assets.normalise import normalise
    from viewsphere.assets.readers import suffixes
    from viewsphere.model.model_spec import ModelSpec

    spec = ModelSpec(key="model", source=str(path), category="model", category_id=1)
    raw, facts = load_model(path)
    assert path.suffix[1:] not in suffixes(by_blender=False) or len(raw.triangles)
    mesh = normalise(raw, facts, spec)
    assert np.isfinite(mesh.vertices).all()
    assert mesh.triangles.min() >= 0
    assert mesh.triangles.max() < len(mesh.vertices)


OBJ = b"""mtllib model.mtl
o box
v 0 0 0
v 1 0 0 0.5 0.5 0.5
v 1 1 0
v 0.5 0.25 0
v 0 1 0
v 0 0 1
vt 0 0
vt 1 0
vt 1 1
vn 0 0 1
g a b
usemtl red
s 1
f 1/1/1 2/2/1 3/3/1 4/1/1 5/2/1
usemtl other
s off
f -6 -5 -1
f 2//1 3//1 6//1
l 1 2
"""
MTL = b"newmtl red\nKd 0.8 0.1 0.1\nKs 0 0 0\nNs 200\nd 0.5\nillum 2\nmap_Kd -s 2 2 2 skin.png\nmap_Bump -bm 0.5 skin.png\nPr 0.4\nPm 1\n" \
    b"newmtl other\nKe 1 1 1\nTf 1 1 1\nmap_d skin.png\nnorm skin.png\n"  # fmt: skip


def _encoded(kind: str, width: int = 12, height: int = 8, **options: object) -> bytes:
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(photograph(width, height)).save(out, kind, **options)
    return out.getvalue()


def _gltf() -> tuple[bytes, bytes]:
    """JSON and buffer of a glTF file with most of what is read: textures, colours, a sparse accessor, nodes, clips, extensions."""
    parts = [
        np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32), np.array([0, 1, 2, 0, 2, 3, 0, 3, 1], np.uint16),
        np.array([[0, 0], [1, 0], [0, 1], [1, 1]], np.float32), np.full((4, 4), 200, np.uint8), np.array([0, 0.5, 1], np.float32),
        np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0]], np.float32), np.array([1], np.uint16), np.array([[2, 0, 0]], np.float32),
        np.frombuffer(_encoded("PNG"), np.uint8),
    ]  # fmt: skip
    body, views = b"", []
    for part in parts:
        body += b"\0" * (-len(body) % 4)
        views.append({"buffer": 0, "byteOffset": len(body), "byteLength": part.nbytes})
        body += part.tobytes()
    texture = {
        "index": 0,
        "texCoord": 0,
        "extensions": {"KHR_texture_transform": {"offset": [0.1, 0], "scale": [2, 2], "rotation": 0.3}},
    }
    root = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "extensionsUsed": ["KHR_texture_transform"],
        "nodes": [{"children": [1], "translation": [0, 1, 0], "rotation": [0, 0, 0, 1]}, {"mesh": 0, "name": "a", "scale": [1, 2, 1]},
                  {"mesh": 0, "matrix": np.eye(4).ravel().tolist()}],
        "meshes": [{"name": "m", "weights": [0.5], "primitives": [
            {"attributes": {"POSITION": 0, "TEXCOORD_0": 2, "COLOR_0": 3}, "indices": 1, "material": 0, "mode": 4,
             "targets": [{"POSITION": 6}]}]}],
        "materials": [{"name": "skin", "pbrMetallicRoughness": {"baseColorTexture": texture, "baseColorFactor": [1, 0.5, 0.5, 1],
                                                                  "roughnessFactor": 0.4}, "normalTexture": {"index": 0, "scale": 0.5},
                       "emissiveFactor": [1, 0, 0], "alphaMode": "MASK", "alphaCutoff": 0.4, "doubleSided": True,
                       "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.5}}}],
        "textures": [{"source": 0, "sampler": 0}], "images": [{"bufferView": 8, "mimeType": "image/png"}],
        "samplers": [{"wrapS": 33071, "wrapT": 10497}],
        "animations": [{"name": "go", "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}}],
                        "samplers": [{"input": 4, "output": 5, "interpolation": "LINEAR"}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1],
             "sparse": {"count": 1, "indices": {"bufferView": 6, "componentType": 5123}, "values": {"bufferView": 7}}},
            {"bufferView": 1, "componentType": 5123, "count": 9, "type": "SCALAR"},
            {"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": 3, "componentType": 5121, "count": 4, "type": "VEC4", "normalized": True},
            {"bufferView": 4, "componentType": 5126, "count": 3, "type": "SCALAR"},
            {"bufferView": 5, "componentType": 5126, "count": 3, "type": "VEC3"}, {"componentType": 5126, "count": 4, "type": "VEC3"},
        ],
        "bufferViews": views, "buffers": [{"byteLength": len(body)}],
    }  # fmt: skip
    return json.dumps(root).encode(), body


@cache
def gltfs() -> Pack:
    text, body = _gltf()
    apart = json.loads(text)
    apart["buffers"][0]["uri"] = "data.bin"
    apart["images"][0] = {"uri": "skin.png"}
    beside = {"data.bin": body, "skin.png": _encoded("PNG")}
    return (
        Sample("model.glb", glb(text, body), "glb"),
        Sample("model.gltf", json.dumps(apart).encode(), "json", beside),
        Sample("data.bin", body, "bytes", {**beside, "model.gltf": json.dumps(apart).encode()}, "model.gltf"),
        Sample("own.glb", _exported("glb"), "glb"),
    )


@cache
def _exported(suffix: str) -> bytes:
    """A file of one of our boxes, as we or trimesh write it."""
    import tempfile

    import trimesh

    from viewsphere.assets.exporting.export import export_glb

    if suffix == "glb":
        with tempfile.TemporaryDirectory() as folder:
            export_glb(MESHES[0], Path(folder) / "x.glb")
            return (Path(folder) / "x.glb").read_bytes()
    box = trimesh.creation.box()
    box.visual.vertex_colors = np.arange(32, dtype=np.uint8).reshape(8, 4)
    kind, options = {"ply-text": ("ply", {"encoding": "ascii"}), "stl-text": ("stl_ascii", {})}.get(suffix, (suffix, {}))
    data = box.export(file_type=kind, **options)
    return data if isinstance(data, bytes) else data.encode()


@cache
def objs() -> Pack:
    beside = {"model.mtl": MTL, "skin.png": _encoded("PNG"), "model.obj": OBJ}
    return (
        Sample("model.obj", OBJ, "text", beside),
        Sample("model.mtl", MTL, "text", beside, "model.obj"),
        Sample("skin.png", beside["skin.png"], "bytes", beside, "model.obj"),
    )


@cache
def others() -> Pack:
    binary, text = ("ply", "stl"), ("ply-text", "stl-text", "off", "dae")
    found = [Sample(f"model.{kind.partition('-')[0]}", _exported(kind), "text") for kind in text]
    found += [Sample(f"model.{kind}", _exported(kind), "bytes") for kind in binary]
    return (*found, Sample("model.3mf", _exported("3mf"), "zip"), Sample("model.ply", PLY, "text"))


# Poses and rigs


def _poses(path: Path) -> None:
    from viewsphere.composing.viewpoints.pose_files import read_poses

    kind = {"view.txt": "view", "tum.txt": "tum", "kitti.txt": "kitti"}.get(path.name, "auto")
    read_poses(path.parent if path.name == "images.txt" else path, kind)


ORBITS = b"azimuth,elevation,distance,tilt\n0,10,2,0\n70,35,2.5,12\n200,60,3,0\n"
VIEW = b"0 10 0 2\n70 35 12 2.5\n200 60 0 3\n"
TUM = b"# time x y z qx qy qz qw\n0.0 1 2 3 0 0 0 1\n0.1 1 2 3 0.5 0.5 0.5 0.5\n"
KITTI = b"1 0 0 1 0 1 0 2 0 0 1 3\n0 -1 0 1 1 0 0 2 0 0 1 3\n"
COLMAP = b"# images\n1 1 0 0 0 0.1 0.2 3 1 a.png\n10 10 -1\n2 0.7 0.7 0 0 0.1 0.2 3 1 b c.png\n\n"
CAMERAS = b"# cameras\n1 OPENCV 640 480 420 425 315 239 -0.28 0.07 0.0002 0.00002\n2 SIMPLE_RADIAL 640 480 420 320 240 0.1\n"
NERFSTUDIO = json.dumps(
    {
        "camera_model": "OPENCV", "fl_x": 420.0, "fl_y": 421.0, "cx": 320.0, "cy": 240.0, "w": 640, "h": 480, "k1": 0.01, "k2": 0, "p1": 0,
        "p2": 0, "frames": [{"file_path": "a.png", "transform_matrix": np.eye(4).tolist()},
                            {"file_path": "b.png", "fl_x": 420.0, "transform_matrix": [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]}],
    }
).encode()  # fmt: skip


@cache
def poses() -> Pack:
    colmap = {"images.txt": COLMAP, "cameras.txt": CAMERAS}
    return (
        Sample("poses.csv", ORBITS, "text"),
        Sample("view.txt", VIEW, "text"),
        Sample("tum.txt", TUM, "text"),
        Sample("kitti.txt", KITTI, "text"),
        Sample("transforms.json", NERFSTUDIO, "json"),
        Sample("images.txt", COLMAP, "text", colmap),
        Sample("cameras.txt", CAMERAS, "text", colmap, "images.txt"),
    )


def _table(path: Path) -> None:
    from viewsphere.planning import credits, models, tracks

    if path.name == "credits.csv":
        for name in credits._read(path.parent, True):
            fnmatchcase("a model of that name.obj", name)
    elif path.name == "points.csv":
        [*tracks._read(path)]
    else:
        [*table_rows(path, models.COLUMNS)]


@cache
def tables() -> Pack:
    credits = b'file,licence,attribution,source_url\n"a, b.obj",CC0-1.0,Ann,https://example.org/a\nb.obj,MIT,"A ""b""",\n'
    sizes = b"name,width,height,length\na,0.5,1,0.25\nb,1,,\n"
    points = b"instant,x,y\n0,1.5,2\n1,3,4.25\n"
    return tuple(
        Sample(f"{name}.csv", data, "text") for name, data in (("credits", credits), ("points", points), ("sizes", sizes))
    )


def _rig(path: Path) -> None:
    from viewsphere.planning.rig_files import read_rig

    for rectified in (False, True):
        with suppress(ViewsphereError):
            read_rig([path], rectified=rectified)


OPENCV = b"%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n" + b"".join(
    f"{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {len(values) // rows}\n   dt: d\n   data: [ {', '.join(map(str, values))} ]\n".encode()
    for name, rows, values in (
        ("K1", 3, (420.0, 0, 315.5, 0, 425, 239.5, 0, 0, 1)), ("D1", 1, (-0.28, 0.07, 0.0002, 0.0, 0.01)),
        ("K2", 3, (420.0, 0, 315.5, 0, 425, 239.5, 0, 0, 1)), ("D2", 1, (-0.25, 0.06, 0.0, 0.0, 0.0)),
        ("R", 3, (1, 0, 0, 0, 1, 0, 0, 0, 1)), ("T", 3, (-0.12, 0.003, -0.01)),
        ("P1", 3, (420.0, 0, 315.5, 0, 0, 425, 239.5, 0, 0, 0, 1, 0)), ("P2", 3, (420.0, 0, 315.5, -50, 0, 425, 239.5, 0, 0, 0, 1, 0)),
    )
)  # fmt: skip
CAMERA = {"camera_model": "pinhole", "intrinsics": [420, 425, 315.5, 239.5], "distortion_model": "radtan",
          "distortion_coeffs": [-0.28, 0.07, 0.0002, 0.0], "resolution": [640, 480], "rostopic": "/cam0/image_raw"}  # fmt: skip
KALIBR = {"cam0": CAMERA, "cam1": CAMERA | {"T_cn_cnm1": np.eye(4).tolist(), "distortion_model": "equidistant"}}
ROS = {
    "image_width": 640, "image_height": 480, "camera_name": "left", "distortion_model": "plumb_bob",
    "camera_matrix": {"rows": 3, "cols": 3, "data": [420.0, 0, 315.5, 0, 425, 239.5, 0, 0, 1]},
    "distortion_coefficients": {"rows": 1, "cols": 5, "data": [0.1, 0, 0, 0, 0]},
    "rectification_matrix": {"rows": 3, "cols": 3, "data": [1, 0, 0, 0, 1, 0, 0, 0, 1]},
    "projection_matrix": {"rows": 3, "cols": 4, "data": [420.0, 0, 315.5, 0, 0, 425, 239.5, 0, 0, 0, 1, 0]},
}  # fmt: skip


@cache
def rigs() -> Pack:
    trees = [Sample("rig.yaml", json.dumps(value).encode(), "json") for value in (KALIBR, ROS)]
    return (*trees, Sample("rig.yaml", OPENCV, "text"))


# Pictures


def _channel(path: Path) -> None:
    from viewsphere.labels import channels
    from viewsphere.store import decode

    decode(channels()[path.stem.partition("-")[0]], path)


@cache
def coded() -> Pack:
    """A file of each kind in which the store keeps channels, and of others that imported pictures may have."""
    from viewsphere.labels import channels
    from viewsphere.model.fields.files import Files as Kinds
    from viewsphere.store import encode

    rgb = photograph(12, 8)
    rgba = np.dstack([rgb, rgb[..., :1]])
    depth = np.where(np.arange(96).reshape(8, 12) % 7, np.linspace(1, 9, 96).reshape(8, 12), np.inf).astype(np.float32)
    ids = (np.arange(96).reshape(8, 12) % 5).astype(np.int32)
    arrays = {"rgb": rgb, "rgba": rgba, "depth": depth, "instances": ids}
    chosen = [("rgb", {"rgb": kind}) for kind in ("png", "jpeg", "webp", "qoi", "jxl")]
    chosen += [("rgba", {"rgba": "png"}), *(("depth", {"depth": kind}) for kind in ("tiff", "exr", "npz", "png16"))]
    chosen += [("instances", {"masks": kind}) for kind in ("png8", "png16")]
    found = []
    for i, (name, kinds) in enumerate(chosen):
        data = encode(channels()[name], arrays[name], Kinds.model_validate(kinds))
        found.append(Sample(f"{name}-{i}.{kinds.get(name, 'png')}", data, "zip" if data[:2] == b"PK" else "bytes"))
    found += [Sample(f"rgb-{kind}.x", _encoded(kind)) for kind in ("GIF", "BMP", "TIFF", "PPM", "TGA", "JPEG2000")]
    return tuple(found)


def _environment(path: Path) -> None:
    from viewsphere.rendering.sky.environment_file import read_environment

    read_environment(path)


@cache
def skies() -> Pack:
    import tempfile

    import OpenEXR

    with tempfile.TemporaryDirectory() as name:
        folder, sphere = Path(name), sunny(8)
        hdr = write_hdr(folder / "sky.hdr", sphere).read_bytes()
        png = write(folder / "sky.png", photograph(16, 8)).read_bytes()
        OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION}, {"RGB": sphere}).write(str(folder / "sky.exr"))
        exr = (folder / "sky.exr").read_bytes()
    coded_row = b"\2\2\0\x10" + b"".join(bytes([128 + 16, value]) for value in (100, 90, 80, 129))
    head = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2.0\n\n-Y 8 +X 16\n"
    return (
        Sample("sky.hdr", hdr, "text"),
        Sample("row.hdr", head + coded_row * 8),
        Sample("sky.png", png),
        Sample("sky.exr", exr),
    )


@cache
def textures() -> Pack:
    kinds = {"png": "PNG", "jpg": "JPEG", "tif": "TIFF", "bmp": "BMP", "webp": "WEBP"}
    return tuple(Sample(f"picture.{suffix}", _encoded(kind)) for suffix, kind in kinds.items())


# Data sets

EXPORTS = ("coco", "native", "csv", "webdataset")


@cache
def _made(short: bool, shots: str = "files") -> Path:
    """A data set of one shot of four small frames, and its exports inside of it."""
    import tempfile

    from viewsphere.model.fields.files import Files as Kinds
    from viewsphere.run.exports.exporting import export
    from viewsphere.store.shots.heartbeat import Heartbeat
    from viewsphere.store.shots.records import NAME_BYTES

    lens = LENS.model_copy(update={"width": 24, "height": 18, "fx": 20.0, "fy": 20.0, "cx": 12.0, "cy": 9.0})
    root = Path(tempfile.mkdtemp(prefix="fuzz-")) / "out"
    channels = ("rgb", "depth", "instances", "normals") if short else ("rgb", "depth", "instances", "rgba")
    dataset = make(
        root,
        several=short,
        channels=channels,
        intrinsics=lens,
        ground=True,
        leave_out=() if short else (1, 2),
        short=short,
        files=Kinds(shots=shots),
    )
    named = replace(dataset.plan.parts[0], new_poses=len(POSES), pose_names=b64encode(bytes(NAME_BYTES * len(POSES))).decode())
    dataset.store.save(replace(dataset.plan, parts=(named,)))
    export(dataset.root, EXPORTS)
    dataset.store.write_file("skipped.json", json.dumps({"other": "it was left out"}))
    (root / "store/failed").mkdir()
    (root / "store/failed/1.json").write_text(
        Heartbeat("host", 1, (0, 2), "frames", 1, 4, begun=1.0, beat=9.0, error="x").to_json()
    )
    return root


@cache
def _played() -> Path:
    """A data set of a sequence: three instants of a stereo rig, with points that are followed."""
    import tempfile

    import yaml

    from viewsphere import Recipe
    from viewsphere.run.generate import generate

    said = yaml.safe_load(SEQUENCE)
    said["models"][0]["motion"] = said["models"][0]["motion"][1]
    changes = {
        "models": said["models"][:1],
        "time": {"frames": 3, "fps": 10},
        "tracks": {"count": 2},
        "splits": {"train": 1.0},
        "scene": {"ground": True},
    }
    lens = {"camera": {"size": [24, 18], "fov_deg": 60}, "channels": ["rgb", "depth", "instances", "flow", "tracks"]}
    root = Path(tempfile.mkdtemp(prefix="fuzz-")) / "out"
    generate(Recipe.model_validate(said | changes | lens), root, formats=())
    return root


def _each(*calls: Callable[[], object]) -> None:
    """All of them, whether or not those before refused."""
    for call in calls:
        with suppress(ViewsphereError):
            call()


def _read(root: Path) -> None:
    from viewsphere.store import Dataset
    from viewsphere.store.samples.films import films_of

    dataset = Dataset(root)
    for sample in dataset:
        _each(lambda sample=sample: [sample.channels[name] for name in sample.channels], lambda sample=sample: sample.objects)
    _each(lambda: dataset.models, lambda: dataset.sequences, lambda: list(dataset.select("index", "objects.box2d")))
    _each(lambda: films_of(dataset), lambda: [list(dataset.positions(split)) for split in dataset.splits])
    _each(lambda: [dataset.tracks(name, "left") for name in dataset.sequences])


def _store(root: Path, out: Path) -> None:
    from viewsphere.check import check
    from viewsphere.run.datasets.merging import merge
    from viewsphere.run.exports.exporting import export
    from viewsphere.run.status import status
    from viewsphere.store import Dataset

    _each(
        lambda: status(root).to_json(),
        partial(_read, root),
        lambda: check(Dataset(root), sample=1, rays=False),
        lambda: export(root, ["coco"], output=out / "coco"),
        lambda: merge([root, _made(True)], out / "merged", mixed=True, keep_going=True),
    )


@cache
def _others() -> Path:
    """Trees of formats that are imported and whose texts are no JSON."""
    from viewsphere.run.exports.exporting import export

    whole = _made(False)
    export(whole, ["kitti", {"pascal3d": {"anchors": False}}], output=whole.parent / "others")
    return whole.parent / "others"


def _exports(root: Path, out: Path) -> None:
    from viewsphere.check import check
    from viewsphere.store import Dataset

    check(Dataset(root), sample=0, rays=False)


def _import(kind: str, root: Path, out: Path) -> None:
    from viewsphere.run.datasets.importing import import_dataset

    _each(
        lambda: import_dataset(kind, root / kind, out / "strict"),
        lambda: import_dataset(kind, root / kind, out / "lenient", keep_going=True),
        lambda: _read(out / "lenient"),
    )


OF_STORES = (
    ("plan.json",) * 2
    + ("shots/*/*/frames.json",) * 3
    + (
        "models/*/model.json",
        "**/*.json",
        "shots/*/*/manifest.json",
        "shots/*/*/channels.tar",
        "*.json",
        "failed/*.json",
        "shots/*/*/*/*.*",
        "models/*/*.*",
    )
)
OF_STORES = tuple(f"store/{pattern}" for pattern in OF_STORES)
OF_TARS = ("store/shots/*/*/manifest.json",) * 3 + ("store/shots/*/*/channels.tar",)
OF_EXPORTS = ("coco/**/*.json", "native/**/*.json", "csv/**/*.*", "webdataset/**/*.*", "coco/**/*.*")
OF_COCO = ("coco/annotations/*.json",) * 4 + ("coco/images/*/*.png",)
OF_KITTI = (
    "kitti/training/label_2/*",
    "kitti/training/label_2/*",
    "kitti/training/calib/*",
    "kitti/ImageSets/*",
    "kitti/**/*.png",
)
OF_PASCAL3D = ("pascal3d/Annotations/*/*",) * 3 + ("pascal3d/CAD/*.mat", "pascal3d/PASCAL/**/*.*", "pascal3d/Images/*/*")
OF_NATIVE = ("native/*.json", "native/*.json", "native/**/*.json", "native/Pose-*/**/*.*", "native/MODELS/**/*.*")

TARGETS: dict[str, Files | Folders] = {
    "mat": Files(_mat, mats),
    "recipe": Files(_plan, recipes),
    "obj": Files(_model, objs),
    "gltf": Files(_model, gltfs),
    "models": Files(_model, others),
    "poses": Files(_poses, poses),
    "tables": Files(_table, tables),
    "rigs": Files(_rig, rigs),
    "channels": Files(_channel, coded),
    "textures": Files(_model, textures),
    "sky": Files(_environment, skies),
    "store": Folders(_store, (partial(_made, True), partial(_made, True, "tar"), _played), (*OF_STORES, *("store/shots/*/*/shot.json",) * 3), ("store",)),
    "spans": Folders(_store, (partial(_made, False, "tar"),), OF_TARS, ("store",)),
    "records": Folders(_store, (partial(_made, False), partial(_made, False, "tar")), OF_STORES, ("store",)),
    "exports": Folders(_exports, (partial(_made, False),), OF_EXPORTS, ("store", *EXPORTS)),
    "coco": Folders(partial(_import, "coco"), (partial(_made, False),), OF_COCO, ("coco",)),
    "native": Folders(partial(_import, "native"), (partial(_made, False),), OF_NATIVE, ("native",)),
    "kitti": Folders(partial(_import, "kitti"), (_others,), OF_KITTI, ("kitti",)),
    "pascal3d": Folders(partial(_import, "pascal3d"), (_others,), OF_PASCAL3D, ("pascal3d",)),
}  # fmt: skip
