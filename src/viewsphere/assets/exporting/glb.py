"""A mesh as the bytes of a GLB file (glTF 2.0) with every material field of Mesh."""

from __future__ import annotations

import hashlib
import io
import json
import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.animation.deforming import DeformingMesh
from viewsphere.assets.exporting.rigged import Clip, Float, RiggedModel
from viewsphere.assets.exporting.runs import Run, runs
from viewsphere.assets.mesh import Image, Material, Mesh, Texture
from viewsphere.codecs.png_tiff import encode_png
from viewsphere.files import open_file
from viewsphere.geometry.rotation import quaternion_from_matrix

WRAP_CODES = {"clamp": 33071, "mirror": 33648, "repeat": 10497}
NEAREST, LINEAR, LINEAR_MIPMAP_LINEAR = 9728, 9729, 9987
FLOAT, UINT32, UINT8 = 5126, 5125, 5121
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963

BODY_PARTS = "body_parts"
"""The member of `extras` that names a mesh's body parts, and for a primitive the accessor with each triangle's body part."""

Object = dict[str, Any]

NEAR = 0.01
"""Near plane of cameras, in metres, which glTF requires."""


def glb_bytes(mesh: Mesh) -> bytes:
    """GLB of a mesh in object axes: one node and mesh per part, one primitive per run, in order."""
    writer = _Writer()
    writer.add_mesh(mesh)
    return writer.packed([{"name": part["name"], "mesh": i} for i, part in enumerate(writer.meshes)])


def deforming_glb_bytes(model: DeformingMesh, names: Mapping[int, str], seconds: Mapping[int, float]) -> bytes:
    """GLB of a model that deforms: a node for each time step, named by `names` (by frame), with a child for each part.

    An animation scales the nodes from 0 to 1 one after another, each at its `seconds`; at rest the first is shown. Nodes with
    scale 0 are not drawn (glTF 2.0, section 3.5.3). `extras` list the materials of each time step.
    """
    writer = _Writer({})
    steps, parts = list[Object](), list[Object]()
    for frame, mesh in model.meshes.items():
        first = len(writer.meshes)
        materials = writer.add_mesh(mesh)
        own = range(first, len(writer.meshes))
        children = [len(model.meshes) + i for i in own]
        hidden: Object = {"scale": [0.0, 0.0, 0.0]} if steps else {}
        steps.append({"name": names[frame], "children": children, **hidden, "extras": {"materials": materials}})
        parts += [{"name": writer.meshes[i]["name"], "mesh": i} for i in own]
    writer.animate([seconds[frame] for frame in model.meshes])
    return writer.packed(steps + parts, len(steps))


def rigged_glb_bytes(model: RiggedModel) -> bytes:
    """GLB of a rigged model whose first joint is the only root: a node with the skin for each part, then a node for each joint,
    and its animations in order, with a key at each of their times. At rest it has the pose `model.rest`. Equal models give
    equal bytes.
    """
    writer = _Writer({}, skinned=model)
    writer.add_mesh(model.mesh)
    first, rest = len(writer.meshes), _quaternions(model.rest.turns)
    nodes: list[Object] = [{"name": part["name"], "mesh": i, "skin": 0} for i, part in enumerate(writer.meshes)]
    for i, (name, above) in enumerate(zip(model.joints, model.above, strict=True)):
        own = [first + k for k, other in enumerate(model.above) if other == i]
        place = model.rest.root if above < 0 else model.places[i] - model.places[above]
        said: Object = {"children": own} if own else {}
        nodes.append({"name": name, **said, "translation": _y_up(place).tolist(), "rotation": rest[i].tolist()})
    for name, clip in model.clips.items():
        writer.clip(name, clip, first)
    return writer.packed(nodes, first + 1)


def _y_up(places: NDArray[np.float64]) -> NDArray[np.float32]:
    """Positions (..., 3) converted from axes with z up to glTF's axes."""
    return (places[..., [0, 2, 1]] * (1.0, 1.0, -1.0) + 0.0).astype(np.float32)


@dataclass(frozen=True, eq=False)
class Placed:
    """A mesh in a scene: its name there, world_from_object (4, 4) in axes with z up, and its extras, as JSON."""

    name: str
    mesh: Mesh
    world_from_object: NDArray[np.float64]
    extras: Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class Looking:
    """A camera in a scene: its name there, world_from_camera (4, 4) in axes with z up; the camera's x is right, y up, z back.
    Also the full vertical field of view in radians, the picture's width divided by its height, and its extras, as JSON.
    """

    name: str
    world_from_camera: NDArray[np.float64]
    yfov: float
    aspect: float
    extras: Mapping[str, Any]


def scene_glb_bytes(things: Sequence[Placed], cameras: Iterable[Looking] = ()) -> bytes:
    """GLB of a scene with y up, as in glTF: a node for each object, with its pose, its extras and a child for each part, and a
    node for each camera. Objects with one mesh share its arrays, and cameras with one lens share the lens.
    """
    writer, meshes, nodes, parts = _Writer({}), dict[int, range](), list[Object](), list[Object]()
    looking = [writer.camera(camera) for camera in cameras]
    for thing in things:
        first = len(writer.meshes)
        if id(thing.mesh) not in meshes:
            writer.add_mesh(thing.mesh)
            meshes[id(thing.mesh)] = range(first, len(writer.meshes))
        own = meshes[id(thing.mesh)]
        begin = len(things) + len(looking) + len(parts)
        parts += [{"name": writer.meshes[i]["name"], "mesh": i} for i in own]
        children = {"children": list(range(begin, begin + len(own)))} if own else {}
        matrix = _turned(thing.world_from_object).T.reshape(-1).tolist()  # column by column
        nodes.append({"name": thing.name, "matrix": matrix, **children, "extras": dict(thing.extras)})
    nodes += looking
    return writer.packed(nodes + parts, len(nodes))


def _turned(pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """A pose converted from axes with z up to axes with y up."""
    order, signs = [0, 2, 1, 3], np.array([1.0, 1.0, -1.0, 1.0])
    return pose[order][:, order] * signs[:, None] * signs


def material_names(file: Path) -> tuple[str, ...]:
    """Names of the materials in a GLB file that `glb_bytes` made, in its order; its arrays are not read."""
    with open_file(file) as glb:
        size, _ = struct.unpack_from("<II", glb.read(20), 12)
        root: Object = json.loads(glb.read(size))
    return tuple(material.get("name", "") for material in root.get("materials", ()))


@dataclass(eq=False)
class _Writer:
    """A GLB file in construction. `known`: accessors by their content, so that equal ones are shared."""

    known: dict[object, int] | None = None
    binary: io.BytesIO = field(default_factory=io.BytesIO)
    views: list[Object] = field(default_factory=list[Object])
    accessors: list[Object] = field(default_factory=list[Object])
    meshes: list[Object] = field(default_factory=list[Object])
    materials: list[Object] = field(default_factory=list[Object])
    samplers: list[Object] = field(default_factory=list[Object])
    textures: list[Object] = field(default_factory=list[Object])
    extensions: set[str] = field(default_factory=set[str])
    animations: list[Object] = field(default_factory=list[Object])
    images: list[Image] = field(default_factory=list[Image])
    cameras: list[Object] = field(default_factory=list[Object])
    skinned: RiggedModel | None = None
    last: Mesh | None = None
    first_image: int = 0
    first_material: int = 0

    def add_mesh(self, mesh: Mesh) -> list[int]:
        """Add one mesh per part; return the index of the first material and their number."""
        last = self.last
        if last is None or mesh.images is not last.images:
            self.first_image = len(self.images)
            self.images += mesh.images
        if last is None or mesh.materials is not last.materials or mesh.images is not last.images:
            self.first_material = len(self.materials)
            self.materials += [self.material(material) for material in mesh.materials]
        self.last, part = mesh, -1
        for run in runs(mesh):
            if run.part != part:
                part = run.part
                said: Object = {"extras": {BODY_PARTS: list(mesh.body_parts)}} if mesh.body_parts else {}
                self.meshes.append({"name": mesh.parts[part], "primitives": [], **said})
            self.add_run(mesh, run)
        return [self.first_material, len(mesh.materials)]

    def add_run(self, mesh: Mesh, run: Run) -> None:
        at = run.vertices
        turned = np.array([0, 2, 1])
        signs = np.array([1, 1, -1], np.float32)
        attributes = {
            "POSITION": self.accessor(mesh.vertices[at][:, turned] * signs, "VEC3", bounded=True),
            "NORMAL": self.accessor(mesh.normals[at][:, turned] * signs, "VEC3"),
        }
        if self.skinned is not None:
            attributes["JOINTS_0"] = self.accessor(self.skinned.vertex_joints[at].astype(np.uint8), "VEC4")
            attributes["WEIGHTS_0"] = self.accessor(self.skinned.vertex_weights[at].astype(np.float32), "VEC4")
        for name, array, kind in (
            ("TEXCOORD_0", mesh.uv0, "VEC2"),
            ("TEXCOORD_1", mesh.uv1, "VEC2"),
            ("COLOR_0", mesh.colors, "VEC4"),
        ):
            if array is not None:
                attributes[name] = self.accessor(array[at], kind)
        indices = self.accessor(run.triangles.astype(np.uint32).reshape(-1, 1), "SCALAR")
        material = self.first_material + run.material
        entry: Object = {"attributes": attributes, "indices": indices, "material": material, "mode": 4}
        if mesh.triangle_body_part is not None:
            own = mesh.triangle_body_part[run.first : run.first + len(run.triangles)]
            entry["extras"] = {BODY_PARTS: self.accessor(own.astype(np.uint32).reshape(-1, 1), "SCALAR", target=None)}
        self.meshes[-1]["primitives"].append(entry)

    def camera(self, seen: Looking) -> Object:
        """The node of a camera, whose own axes are already glTF's."""
        lens: Object = {"yfov": seen.yfov, "aspectRatio": seen.aspect, "znear": NEAR}
        number = _index(self.cameras, {"type": "perspective", "perspective": lens})
        matrix = (seen.world_from_camera[[0, 2, 1, 3]] * [[1.0], [1.0], [-1.0], [1.0]]).T.reshape(-1).tolist()
        return {"name": seen.name, "matrix": matrix, "camera": number, "extras": dict(seen.extras)}

    def animate(self, seconds: Sequence[float]) -> None:
        """Show the first nodes one after another, as many as there are seconds."""
        if len(seconds) < 2:
            return
        samplers, channels = list[Object](), list[Object]()
        for i in range(len(seconds)):
            begin = max(i - 1, 0)
            times = np.array(seconds[begin : i + 2], np.float32)
            shown = np.repeat(np.arange(begin, begin + len(times)) == i, 3).reshape(-1, 3).astype(np.float32)
            entry = {"input": self.keys(times.reshape(-1, 1), "SCALAR"), "output": self.keys(shown, "VEC3")}
            samplers.append({**entry, "interpolation": "STEP"})
            channels.append({"sampler": i, "target": {"node": i, "path": "scale"}})
        self.animations.append({"name": "time steps", "samplers": samplers, "channels": channels})

    def skin(self, model: RiggedModel, first: int) -> Object:
        """The skin of a model whose joints are the nodes from `first` on."""
        binds = np.tile(np.eye(4, dtype=np.float32), (len(model.joints), 1, 1))
        binds[:, 3, :3] = -_y_up(model.places)  # column by column
        inverse = self.accessor(binds.reshape(-1, 16), "MAT4", target=None)
        return {"joints": [first + i for i in range(len(model.joints))], "inverseBindMatrices": inverse}

    def clip(self, name: str, clip: Clip, first: int) -> None:
        """An animation that turns all joints, which are the nodes from `first` on, and moves the first of them."""
        times = self.keys(np.array(clip.seconds, np.float32).reshape(-1, 1), "SCALAR")
        turns = np.array([pose.turns for pose in clip.poses])
        outputs = [(0, "translation", self.keys(_y_up(np.array([pose.root for pose in clip.poses])), "VEC3"))]
        outputs += [(i, "rotation", self.keys(_quaternions(turns[:, i]), "VEC4")) for i in range(turns.shape[1])]
        samplers: list[Object] = [{"input": times, "output": output} for _, _, output in outputs]
        channels: list[Object] = [
            {"sampler": i, "target": {"node": first + node, "path": path}} for i, (node, path, _) in enumerate(outputs)
        ]
        self.animations.append({"name": name, "samplers": samplers, "channels": channels, "extras": dict(clip.extras)})

    def keys(self, rows: NDArray[np.float32], kind: str) -> int:
        """An accessor of an animation's key frames."""
        return self.accessor(rows, kind, bounded=kind == "SCALAR", target=None)

    def view(self, data: bytes, target: int | None = None) -> int:
        self.binary.write(b"\0" * (-self.binary.tell() % 4))
        entry: Object = {"buffer": 0, "byteOffset": self.binary.tell(), "byteLength": len(data)}
        if target is not None:
            entry["target"] = target
        self.binary.write(data)
        self.views.append(entry)
        return len(self.views) - 1

    def accessor(self, rows: NDArray[Any], kind: str, bounded: bool = False, target: int | None = ARRAY_BUFFER) -> int:
        """Add an array to the file; return its accessor. `target` is glTF's buffer target for arrays other than indices; None:
        glTF itself does not use the array.
        """
        is_float, is_byte = rows.dtype == np.float32, rows.dtype == np.uint8
        data = np.ascontiguousarray(rows, "<f4" if is_float else "u1" if is_byte else "<u4")
        content = kind, bounded, is_float, is_byte, target, hashlib.sha256(data.tobytes()).digest()
        if self.known is not None and content in self.known:
            return self.known[content]
        entry: Object = {
            "bufferView": self.view(data.tobytes(), target if is_float or is_byte or target is None else ELEMENT_ARRAY_BUFFER),
            "componentType": FLOAT if is_float else UINT8 if is_byte else UINT32,
            "count": len(rows),
            "type": kind,
        }
        if bounded:
            entry["min"], entry["max"] = data.min(axis=0).tolist(), data.max(axis=0).tolist()
        self.accessors.append(entry)
        if self.known is not None:
            self.known[content] = len(self.accessors) - 1
        return len(self.accessors) - 1

    def texture(self, texture: Texture, **more: float) -> Object:
        """A textureInfo; samplers and textures are shared."""
        sampler: Object = {
            "magFilter": NEAREST if texture.nearest else LINEAR,
            "minFilter": NEAREST if texture.nearest else LINEAR_MIPMAP_LINEAR,
            "wrapS": WRAP_CODES[texture.wrap_s],
            "wrapT": WRAP_CODES[texture.wrap_t],
        }
        entry: Object = {"sampler": _index(self.samplers, sampler), "source": self.first_image + texture.image}
        info: Object = {"index": _index(self.textures, entry), "texCoord": texture.texcoord, **more}
        transform: Object = {
            "offset": list(texture.offset),
            "rotation": texture.rotation,
            "scale": list(texture.scale),
        }
        if transform != {"offset": [0.0, 0.0], "rotation": 0.0, "scale": [1.0, 1.0]}:
            info["extensions"] = {"KHR_texture_transform": transform}
            self.extensions.add("KHR_texture_transform")
        return info

    def material(self, m: Material) -> Object:
        pbr: Object = {
            "baseColorFactor": list(m.base_color),
            "metallicFactor": m.metallic,
            "roughnessFactor": m.roughness,
        }
        # glTF limits emissiveFactor to 1; the excess goes to the extension KHR_materials_emissive_strength.
        strength = max(1.0, *m.emissive)
        entry: Object = {
            "name": m.name,
            "pbrMetallicRoughness": pbr,
            "emissiveFactor": [value / strength for value in m.emissive],
            "alphaMode": m.alpha_mode,
            "doubleSided": m.double_sided,
        }
        if m.alpha_mode == "MASK":
            entry["alphaCutoff"] = m.alpha_cutoff
        if m.base_color_texture is not None:
            pbr["baseColorTexture"] = self.texture(m.base_color_texture)
        if m.metallic_roughness_texture is not None:
            pbr["metallicRoughnessTexture"] = self.texture(m.metallic_roughness_texture)
        if m.normal_texture is not None:
            entry["normalTexture"] = self.texture(m.normal_texture, scale=m.normal_scale)
        if m.occlusion_texture is not None:
            entry["occlusionTexture"] = self.texture(m.occlusion_texture, strength=m.occlusion_strength)
        if m.emissive_texture is not None:
            entry["emissiveTexture"] = self.texture(m.emissive_texture)
        extensions = self.material_extensions(m, strength)
        if extensions:
            entry["extensions"] = extensions
            self.extensions.update(extensions)
        return entry

    def material_extensions(self, m: Material, strength: float) -> Object:
        """Extensions whose fields are not the default."""
        plain = Material()
        coat = self.group(
            m,
            {"clearcoatFactor": "clearcoat", "clearcoatRoughnessFactor": "clearcoat_roughness"},
            {
                "clearcoatTexture": "clearcoat_texture",
                "clearcoatRoughnessTexture": "clearcoat_roughness_texture",
                "clearcoatNormalTexture": "clearcoat_normal_texture",
            },
        )
        glass = self.group(m, {"transmissionFactor": "transmission"}, {"transmissionTexture": "transmission_texture"})
        specular = self.group(
            m,
            {"specularFactor": "specular", "specularColorFactor": "specular_color"},
            {"specularTexture": "specular_texture", "specularColorTexture": "specular_color_texture"},
        )
        found: Object = {
            "KHR_materials_clearcoat": coat,
            "KHR_materials_transmission": glass,
            "KHR_materials_specular": specular,
            "KHR_materials_volume": {"thicknessFactor": m.thickness} if m.thickness > 0 else {},
            "KHR_materials_ior": {"ior": m.ior} if m.ior != plain.ior else {},
            "KHR_materials_emissive_strength": {"emissiveStrength": strength} if strength > 1.0 else {},
        }
        kept: Object = {name: value for name, value in found.items() if value}
        if m.unlit:
            kept["KHR_materials_unlit"] = {}
        return kept

    def group(self, m: Material, factors: dict[str, str], textures: dict[str, str]) -> Object:
        """One extension's factors and textures; empty when all are the default."""
        plain = Material()
        if all(getattr(m, name) == getattr(plain, name) for name in (*factors.values(), *textures.values())):
            return {}
        found: Object = {key: getattr(m, name) for key, name in factors.items()}
        for key, name in textures.items():
            texture: Texture | None = getattr(m, name)
            if texture is not None:
                found[key] = self.texture(texture)
        return found

    def packed(self, nodes: Sequence[Object], roots: int | None = None) -> bytes:
        """The whole file, with these nodes: the first `roots` (None: all) are the scene's root nodes."""
        images: list[Object] = []
        for image in self.images:
            images.append(
                {
                    "name": image.name,
                    "mimeType": "image/png",
                    "bufferView": self.view(encode_png(image.pixels)),
                }
            )
        skins = [] if self.skinned is None else [self.skin(self.skinned, len(self.meshes))]
        root: Object = {
            "asset": {"version": "2.0", "generator": "viewsphere"},
            "scene": 0,
            "scenes": [{"nodes": list(range(len(nodes) if roots is None else roots))}],
            "nodes": nodes,
            "meshes": self.meshes,
            "materials": self.materials,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{"byteLength": self.binary.tell()}],
        }
        optional = {"images": images, "samplers": self.samplers, "textures": self.textures, "animations": self.animations}
        optional["cameras"] = self.cameras
        optional["skins"] = skins
        root |= {name: value for name, value in optional.items() if value}
        if self.extensions:
            root["extensionsUsed"] = sorted(self.extensions)
        text = json.dumps(root, separators=(",", ":"), ensure_ascii=False).encode()
        text += b" " * (-len(text) % 4)
        data = self.binary.getvalue()
        data += b"\0" * (-len(data) % 4)
        head = struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(data))
        return b"".join(
            [
                head,
                struct.pack("<I4s", len(text), b"JSON"),
                text,
                struct.pack("<I4s", len(data), b"BIN\0"),
                data,
            ]
        )


def _index(entries: list[Object], entry: Object) -> int:
    """Index of an equal entry, added if there is none."""
    if entry not in entries:
        entries.append(entry)
    return entries.index(entry)


def _quaternions(turns: Float) -> NDArray[np.float32]:
    """Quaternions (N, 4), x, y, z, w, of successive rotations (N, 3, 3), without sign flips between them. They are in glTF's
    axes, in which (x, y, z) is (x, z, -y).
    """
    found = np.array([quaternion_from_matrix(turn) for turn in turns])
    for i in range(1, len(found)):
        if float((found[i] * found[i - 1]).sum()) < 0:
            found[i] = -found[i]
    w, x, y, z = found.T
    return np.stack([x, z, -y, w], axis=1).astype(np.float32)
