"""FBX, USD, Alembic and .blend files: Blender opens and evaluates them, in its own process.

Blender reads only the model's folder unless the model has `confined: false`, writes nowhere, runs no scripts and reaches no
network. Textures are read here, like any other model's.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from viewsphere.assets.animation.skin import strongest
from viewsphere.assets.appearance.alpha import SOLID, with_alpha_modes
from viewsphere.assets.mesh import Image, Material, Mesh
from viewsphere.assets.paths import endings
from viewsphere.assets.paths.folder import SHARPEST, ModelFolder, reduced
from viewsphere.assets.primitive import FileFacts, Float, Primitive, assemble
from viewsphere.assets.readers.blender.nodes import Painter, Picture, images_of
from viewsphere.assets.readers.shared.named_points import NamedPoint, named_points
from viewsphere.assets.readers.shared.transform import moved
from viewsphere.assets.scene_annotations import Annotation, Marker, Point, annotation_of
from viewsphere.blender.interpreter import find_blender
from viewsphere.blender.process import BlenderProcess
from viewsphere.codecs.npz import load_array
from viewsphere.errors import BlenderDied, BlenderError, MissingExtraError, UserError
from viewsphere.files import open_file, read_bytes
from viewsphere.limits import limits
from viewsphere.model.annotations.keypoints import Keypoints

NAMES = {
    "abc": "Alembic",
    "blend": "Blender",
    "fbx": "FBX",
    **dict.fromkeys(("usd", "usda", "usdc", "usdz"), "USD"),
    **dict.fromkeys(("glb", "gltf"), "glTF"),
}
SETUP = "set it up by viewsphere doctor --setup-blender"

OPENED = re.compile(r"SdfLayer::FindOrOpen\('([^']+)'")
UNOPENED = re.compile(r"Could not open asset @([^@]+)@")


def read_via_blender(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """The file as rendered at its first frame, in Blender's axes (up +Z, front -Y) and metres.

    For a .blend file, the part that `folder.inside` names: an object with its children, a collection, or the whole file. Each
    object is one part; a part instanced by another object is named by both objects. Raises ModelError in one line.
    """
    return next(_read(folder, [None]))


def read_frames(folder: ModelFolder, frames: Sequence[int]) -> Iterator[tuple[Mesh, FileFacts]]:
    """The file as `read_via_blender` reads it, then as rendered at each of the ascending `frames`; opened once."""
    return _read(folder, [None, *frames])


def _read(folder: ModelFolder, frames: Sequence[int | None]) -> Iterator[tuple[Mesh, FileFacts]]:
    """The file's mesh at each of the frames."""
    kind = folder.model.suffix[1:].lower()
    _check_beginning(folder, kind, read_named(folder))
    with started(folder) as process:
        unit, after = 1.0, None
        for frame in frames:
            told = asked(
                folder, process, "read", inside=folder.inside, most=limits.MAX_BLENDER_TRIANGLES, folder=str(process.folder),
                frame=frame, after=after, shown=folder.shown, clip=folder.clip, fps=folder.fps,
            )  # fmt: skip
            if after is None:
                unit = float(told["unit"])
                _check_layers(folder, process.log)
                for warning in told["opened"]:
                    folder.warn(warning)
            after = int(told["frame"])
            at_frame = folder.copy()
            for warning in told["warnings"]:
                at_frame.warn(warning)
            yield _built(at_frame, told, FileFacts(folder.model, kind, "+z", "-y", unit))
            for file in process.folder.glob("piece*.npy"):
                file.unlink()


def read_named(folder: ModelFolder) -> bytes:
    """The model file's bytes, as `read_model` gives them; buffers that a glTF file names are recorded here, because
    Blender does not report them.
    """
    data = folder.read_model()
    if folder.model.suffix.lower() == ".gltf":
        with suppress(ValueError, TypeError, AttributeError):  # Blender reports a file that is not glTF
            for buffer in json.loads(data)["buffers"]:
                uri = str(buffer.get("uri", "data:"))
                if not uri.startswith("data:"):
                    _remember(folder, folder.model.parent.resolve() / unquote(uri))
    return data


def _check_beginning(folder: ModelFolder, kind: str, data: bytes) -> None:
    """Refuse truncated files and other files named .abc, on which Blender crashes or reports nothing. Ogawa's header holds the
    position of the root group, which is written last.
    """
    if kind == "abc" and not (data.startswith(b"Ogawa") and int.from_bytes(data[8:16], "little") < len(data)):
        raise folder.error("expected an Alembic file (Ogawa), found another kind or a part of one: truncated or damaged")


def started(folder: ModelFolder) -> BlenderProcess:
    """A started Blender that may read the same files as the folder; ModelError when no Blender is installed."""
    try:
        python = find_blender()
    except MissingExtraError:
        kind = NAMES.get(folder.model.suffix[1:].lower(), "such")
        other = "; a USD model at rest needs only pip install 'viewsphere[usd]'" if kind == "USD" else ""
        raise folder.error(f"{kind} files are read by Blender, found none: {SETUP}{other}") from None
    except UserError as error:
        raise folder.error(str(error)) from None
    readable = [folder.model.parent.resolve()] if folder.confined else [Path("/")]
    try:
        return BlenderProcess(python, readable=readable)
    except BlenderDied as error:
        raise folder.error(str(error)) from None


def asked(folder: ModelFolder, process: BlenderProcess, do: str, /, **told: Any) -> dict[str, Any]:
    """Blender's answer to a request about the file; ModelError when the answer is an error, or Blender dies."""
    root = str(folder.model.parent.resolve()) if folder.confined else None
    seconds = limits.MAX_READ_SECONDS
    kind = folder.model.suffix[1:].lower()
    try:
        return process.ask(do, seconds, file=str(folder.model.resolve()), kind=kind, root=root, **told)
    except BlenderError as error:
        said = error.reason.removesuffix(", see console for detail")
        raise folder.error(f"Blender cannot read it: {said}") from None
    except BlenderDied as error:
        raise folder.error(why_no_answer(error, seconds)) from None


def why_no_answer(died: BlenderDied, seconds: float) -> str:
    """The message for a Blender process that ended after this many seconds without an answer about a file."""
    if died.signal == "SIGXCPU" or died.is_late:
        return endings.too_slow(seconds)
    how = died.signal if died.signal in endings.FROM_OUTSIDE else died.how
    return endings.ended("Blender, which reads it,", how, limits.MAX_READ_BYTES)


def _check_layers(folder: ModelFolder, log: Path) -> None:
    """Record the layers of a USD file from its library's log; warn about layers that could not be read."""
    opened, missing = _layers(log)
    for name in sorted({*opened, *missing}):
        path = _layers_file(name)
        if path.is_absolute() and not _may_read(folder, path):
            if name not in missing:
                raise folder.error(f"layer {name!r} is outside the model's folder; set confined: false to allow")
            folder.warn(f"layer {name!r} is outside the model's folder, not read; set confined: false to allow")
        elif name in missing:
            folder.warn(f"layer {name!r} does not exist, or cannot be read")
        _remember(folder, path)


def remember_layers(folder: ModelFolder, log: Path, begun: int) -> None:
    """Record the layers of a USD file, missing ones too, from the log behind its first `begun` bytes."""
    for name in sorted(set().union(*_layers(log, begun))):
        _remember(folder, _layers_file(name))


def _layers(log: Path, begun: int = 0) -> tuple[set[str], set[str]]:
    """The layers of USD files that were searched according to the log, and those that could not be opened."""
    with open_file(log) as file:
        file.seek(begun)
        said = file.read().decode("utf-8", "replace")
    return set(OPENED.findall(said)), set(UNOPENED.findall(said))


def _layers_file(name: str) -> Path:
    """The file of a layer; for a layer inside an archive, the archive."""
    return Path(name.partition("[")[0])


def _remember(folder: ModelFolder, path: Path) -> None:
    if path.is_absolute() and _may_read(folder, path):
        folder.remember(path)


def _may_read(folder: ModelFolder, path: Path) -> bool:
    return not folder.confined or path.resolve().is_relative_to(folder.model.parent.resolve())


def _built(folder: ModelFolder, told: Mapping[str, Any], facts: FileFacts) -> tuple[Mesh, FileFacts]:
    for file in told["files"]:
        _remember(folder, Path(file))
    used = {one["material"] for one in told["pieces"]} - {None}
    shown = {leaf["image"] for number in used for field in told["materials"][number].values() for leaf in images_of(field)}
    pictures = [_picture(folder, one, i) if i in shown else None for i, one in enumerate(told["images"])]
    painter = Painter(folder, pictures)
    materials: list[Material] = []
    local: list[Primitive] = []
    for one in told["pieces"]:
        material = Material(name="default")
        if one["material"] is not None:
            material = painter.material(told["materials"][one["material"]], one["uvs"])
        if material not in materials:
            materials.append(material)
        local.append(_piece(one, materials.index(material)))
    pieces = [
        replace(moved(local[number], np.array(placed["matrix"])), part=placed["part"])
        for placed in told["placed"]
        for number in placed["pieces"]
    ]
    if not pieces:
        why = f" ({folder.warnings[0].partition(': ')[2]})" if folder.warnings else ""
        raise folder.error(f"no triangles found that a render would show{why}; export the model as a mesh of faces")
    facts = replace(facts, keypoints=_points(folder, told["points"]), marks=_marks(told["marks"]))
    return assemble(folder, pieces, _with_modes(folder, pieces, materials), facts)


def _points(folder: ModelFolder, told: Sequence[Mapping[str, Any]]) -> Keypoints | None:
    """The points that the file names, in the axes of its mesh."""
    named = {i: NamedPoint(one["name"], np.array(one["place"], np.float64), one["above"]) for i, one in enumerate(told)}
    return named_points(folder, named)


def _marks(told: Sequence[Mapping[str, Any]]) -> tuple[Annotation, ...]:
    """The annotations of the file's objects, in the axes of its mesh."""

    def place(point: Sequence[float]) -> Point:
        x, y, z = map(float, point)
        return x, y, z

    markers = (
        Marker(
            one["name"],
            one["said"],
            one["part"],
            tuple(map(place, one["points"])),
            tuple((a, b) for a, b in one["edges"]),
            tuple((name, place(point)) for name, point in one["children"]),
            one["is_group"],
        )
        for one in told
    )
    return tuple(mark for mark in map(annotation_of, markers) if mark is not None)


def _piece(told: Mapping[str, Any], material: int) -> Primitive:
    def array(name: str) -> Any:
        return load_array(Path(told[name]))

    def loaded(name: str) -> Float | None:
        return None if told[name] is None else array(name).astype(np.float64)

    def downwards(name: str) -> Float | None:
        uv = loaded(name)
        return None if uv is None else np.column_stack([uv[:, 0], 1 - uv[:, 1]])

    triangles, skin = array("triangles").astype(np.int64), told["skin"] or ()
    return Primitive(
        part="",
        material=material,
        positions=array("positions").astype(np.float64),
        triangles=triangles,
        normals=loaded("normals"),
        uv0=downwards("uv0"),
        uv1=downwards("uv1"),
        colors=loaded("colors"),
        bone=strongest(array("bones").astype(np.int64), array("weights").astype(np.float64), triangles) if skin else None,
        bones=tuple(skin),
    )


def _picture(folder: ModelFolder, told: Mapping[str, Any], number: int) -> Picture:
    """The picture in the folder's images: read from its file, from bytes packed in the model, or as decoded by Blender."""
    name = told["name"]
    if "pixels" in told:
        index = folder.derived(f"#{number}", lambda: Image(name, reduced(load_array(Path(told["pixels"])), SHARPEST)))
    elif "data" in told:
        index = folder.image(f"#{number}", name, read_bytes(Path(told["data"])))
    elif told.get("path"):
        path, root = Path(told["path"]), folder.model.parent.resolve()
        reference = path.relative_to(root).as_posix() if path.is_relative_to(root) else str(path)
        index = folder.image(reference, reference)
    else:
        folder.warn(f"texture {name!r} has no pixels; the material's plain factor is used")
        index = None
    return Picture(index, told["is_srgb"])


def _with_modes(folder: ModelFolder, pieces: Sequence[Primitive], materials: Sequence[Material]) -> list[Material]:
    """The materials with alpha modes that suit their textures' alpha (`alpha`); a rotated texture's alpha always blends."""
    found = with_alpha_modes(folder, pieces, materials, stated=range(len(materials)))  # its node links define alpha
    for i, material in enumerate(materials):
        texture = material.base_color_texture
        if texture is not None and (texture.rotation or min(texture.scale) < 0) and material.alpha_mode == "OPAQUE":
            clear = folder.images[texture.image].pixels[..., 3].min() < SOLID
            found[i] = replace(material, alpha_mode="BLEND" if clear else "OPAQUE")
    return found
