"""Normalised meshes kept by content: a model is read once, and again when any of its files, settings or
readers change.

An entry is two files: `<first>.json` lists the files that the model named when it was last read, and
`<second>.npz` holds the mesh. The first name is the digest of the model's bytes, its settings and the
readers; the second adds the bytes of the files listed. So an entry is never stale, and two folders with equal
files share it.
"""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, cast

import numpy as np
import platformdirs

from viewsphere.assets.load import load_model
from viewsphere.assets.mesh import Image, Material, Mesh, Texture
from viewsphere.assets.normalise import normalise
from viewsphere.assets.piece import TEXTURE_FIELDS, FileFacts
from viewsphere.errors import ModelError
from viewsphere.model.shot import ModelSpec

SETTINGS = ("up", "forward", "unit", "centring", "scale", "real_size", "confined")
ARRAYS = ("vertices", "triangles", "normals", "triangle_material", "triangle_part", "uv0", "uv1", "colors")
ZOO = "zoo:"


def load_normalised(spec: ModelSpec, build: Callable[[ModelSpec], Mesh] | None = None, folder: Path | None = None) -> Mesh:
    """The model in object axes and metres, from the cache when it holds it.

    `build` makes the mesh of a source that begins with `zoo:` (in object axes, metres); such meshes are
    normalised too but not cached. `folder` is the cache's, by default `cache_folder()`. A damaged entry is
    built again; a cache that cannot be written is no error. Read back, every array is equal bit for bit.
    Raises ModelError as the readers do.
    """
    if spec.source.startswith(ZOO):
        raw, facts = load_zoo(spec, build)
        return normalise(raw, facts, spec)
    path = Path(spec.source)
    folder = folder or cache_folder()
    try:
        first = _first_digest(path, spec)
    except OSError:
        first = None  # the reader says what is wrong with the file
    if first is not None:
        mesh = _stored(folder, first, path)
        if mesh is not None:
            return mesh
    raw, facts = load_model(path, confined=spec.confined)
    mesh = normalise(raw, facts, spec)
    if first is not None:
        _store(folder, first, path, facts.files, mesh)
    return mesh


def load_zoo(spec: ModelSpec, build: Callable[[ModelSpec], Mesh] | None) -> tuple[Mesh, FileFacts]:
    """A procedural model and its facts; ModelError when there is nothing to build it with."""
    if build is None:
        raise ModelError(f"{spec.source}: no builder for procedural models was given")
    return build(spec), FileFacts(Path(spec.source), "zoo", "+z", "-y", 1.0)


def cache_folder() -> Path:
    """Where models are cached: `$VIEWSPHERE_CACHE/models`, else in the user's cache folder."""
    return Path(os.environ.get("VIEWSPHERE_CACHE") or platformdirs.user_cache_dir("viewsphere")) / "models"


def _first_digest(path: Path, spec: ModelSpec) -> str:
    digest = hashlib.sha256(_readers_digest().encode())
    digest.update(spec.model_dump_json(include=set(SETTINGS)).encode())
    digest.update(path.suffix.lower().encode() + path.name.encode())
    with path.open("rb") as file:
        digest.update(hashlib.file_digest(file, "sha256").digest())
    return digest.hexdigest()


def _readers_digest() -> str:
    """Digest of this package's sources and the versions of the libraries that parse for it."""
    digest = hashlib.sha256()
    for library in ("numpy", "trimesh", "pycollada", "pillow"):
        try:
            digest.update(f"{library} {version(library)};".encode())
        except PackageNotFoundError:
            digest.update(f"{library} unknown;".encode())
    for source in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest()


def _second_digest(first: str, path: Path, names: Iterable[str]) -> str:
    digest = hashlib.sha256(first.encode())
    for name in names:
        digest.update(name.encode(errors="surrogateescape") + b"\0")
        try:
            with (path.parent / name).open("rb") as file:
                digest.update(hashlib.file_digest(file, "sha256").digest())
        except OSError:
            digest.update(b"absent")
    return digest.hexdigest()


def _stored(folder: Path, first: str, path: Path) -> Mesh | None:
    """The mesh in the cache, None when it is not there or damaged."""
    try:
        names = json.loads((folder / f"{first}.json").read_text(encoding="utf-8"))
        return read_mesh(folder / f"{_second_digest(first, path, names)}.npz")
    except Exception:  # whatever is wrong with an entry, the answer is to build it again
        return None


def _store(folder: Path, first: str, path: Path, files: Iterable[Path], mesh: Mesh) -> None:
    root = path.parent.resolve()
    names = [os.path.relpath(file.resolve(), root).replace(os.sep, "/") for file in files]
    text = json.dumps(sorted(set(names)))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        second = _second_digest(first, path, json.loads(text))
        write_mesh(folder / f"{second}.npz", mesh)
        _replace(folder / f"{first}.json", lambda file: file.write_text(text, encoding="utf-8"))
    except OSError:
        return


def write_mesh(path: Path, mesh: Mesh) -> None:
    """Write a mesh with its materials and images to one .npz file, which appears whole or not at all."""
    arrays = {name: getattr(mesh, name) for name in ARRAYS if getattr(mesh, name) is not None}
    arrays |= {f"image{i}": image.pixels for i, image in enumerate(mesh.images)}
    header = {
        "materials": [asdict(material) for material in mesh.materials],
        "parts": mesh.parts,
        "images": [image.name for image in mesh.images],
        "warnings": mesh.warnings,
    }
    arrays["header"] = np.frombuffer(json.dumps(header).encode(), np.uint8)
    _replace(path, lambda file: np.savez(file, **arrays))


def read_mesh(path: Path) -> Mesh:
    """Read what `write_mesh` wrote; raises whatever numpy or json do for a damaged file."""
    with np.load(path, allow_pickle=False) as stored:
        header: dict[str, Any] = json.loads(stored["header"].tobytes())
        arrays = {name: stored[name] for name in ARRAYS if name in stored}
        pixels = [stored[f"image{i}"] for i in range(len(header["images"]))]
    return Mesh(
        **arrays,
        materials=tuple(_material(fields) for fields in header["materials"]),
        parts=tuple(header["parts"]),
        images=tuple(Image(name, array) for name, array in zip(header["images"], pixels, strict=True)),
        warnings=tuple(header["warnings"]),
    )


def _material(fields: dict[str, Any]) -> Material:
    values = {key: _tupled(value) for key, value in fields.items()}
    for name in TEXTURE_FIELDS:
        if fields[name] is not None:
            values[name] = Texture(**{key: _tupled(value) for key, value in fields[name].items()})
    return Material(**values)


def _tupled(value: Any) -> Any:
    return tuple(cast("list[Any]", value)) if isinstance(value, list) else value


def _replace(path: Path, write: Callable[[Path], object]) -> None:
    """Write a file aside and rename it, so that no reader sees half of it."""
    handle, name = tempfile.mkstemp(dir=path.parent, suffix=path.suffix)
    os.close(handle)
    aside = Path(name)
    try:
        write(aside)
        aside.replace(path)
    finally:
        aside.unlink(missing_ok=True)
