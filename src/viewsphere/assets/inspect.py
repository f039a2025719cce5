"""Reports of a model file's contents and of the model after normalisation."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from viewsphere.assets.animation.timeline import Timeline, animation_of
from viewsphere.assets.cache import load
from viewsphere.assets.mesh import Material
from viewsphere.assets.metadata.model_metadata import found_symmetries, metadata_of
from viewsphere.assets.normalise import axes
from viewsphere.assets.primitive import FileFacts
from viewsphere.assets.readers import reader_of
from viewsphere.errors import ModelError
from viewsphere.model.model_spec import Axis, ModelSpec, Size
from viewsphere.plugins import prefix_of
from viewsphere.plugins.source import file_in
from viewsphere.recipe.reading.sidecar import ENDING


@dataclass(frozen=True)
class ModelReport:
    """A model after normalisation, and facts about its file.

    `size` (width, height, length) and `bounds` (lowest and highest corner) are metres in object axes; `raw_size` is the size
    along the file's own x, y and z. `parts` are names and triangle counts; `materials` are names and non-default fields;
    `textures` are names and (width, height) in pixels. `animation` is None if nothing moves, or if Blender cannot report the
    times, which then appears in `suggestions`.

    `diameter` is the largest distance between two vertices, metres. `symmetries` (in a sidecar's format) are those that the
    model declares, if it `declares` any, else those of its surface. `keypoints` are its named points. Both are in the reported
    `axes`: the file's with its own unit, or the object's for a model of a source. `sidecar` is the name of the file beside the
    model that holds or may hold these facts, empty for a source.
    """

    source: str
    format: str
    up: Axis
    forward: Axis
    unit: float
    size: Size
    bounds: tuple[tuple[float, float, float], tuple[float, float, float]]
    raw_size: tuple[float, float, float]
    triangles: int
    vertices: int
    parts: tuple[tuple[str, int], ...]
    materials: tuple[tuple[str, dict[str, Any]], ...]
    textures: tuple[tuple[str, tuple[int, int]], ...]
    has_uv: bool
    has_colors: bool
    diameter: float
    symmetries: dict[str, Any]
    declares: bool
    keypoints: dict[str, Any] | None
    axes: str
    sidecar: str
    animation: Timeline | None
    warnings: tuple[str, ...]
    suggestions: tuple[str, ...]


def describe(source: Path | ModelSpec) -> ModelReport:
    """Read a model and report its contents; a path is read with default settings.

    Raises ModelError as reading and normalising do.
    """
    spec = source if isinstance(source, ModelSpec) else _default_spec(source)
    mesh, facts = load(spec)
    low, high = mesh.bounds
    width, length, height = (float(x) for x in high - low)
    animation, problems = _animation(spec)
    metadata = metadata_of(spec, mesh, facts)
    is_file = not prefix_of(spec.source)
    back = np.linalg.inv(facts.object_from_file) if is_file else np.eye(4)
    symmetries = found_symmetries(mesh) if metadata.symmetries is None else metadata.symmetries
    counts = np.bincount(mesh.triangle_part, minlength=len(mesh.parts))
    return ModelReport(
        source=spec.source,
        format=facts.format,
        up=axes(spec, facts)[0],
        forward=axes(spec, facts)[1],
        unit=facts.unit if spec.unit is None else spec.unit,
        size=(width, height, length),
        bounds=(
            (float(low[0]), float(low[1]), float(low[2])),
            (float(high[0]), float(high[1]), float(high[2])),
        ),
        raw_size=facts.size,
        triangles=len(mesh.triangles),
        vertices=len(mesh.vertices),
        parts=tuple((name, int(count)) for name, count in zip(mesh.parts, counts, strict=True)),
        materials=tuple((material.name, _unusual(material)) for material in mesh.materials),
        textures=tuple((image.name, (image.pixels.shape[1], image.pixels.shape[0])) for image in mesh.images),
        has_uv=mesh.uv0 is not None,
        has_colors=mesh.colors is not None,
        diameter=metadata.diameter,
        symmetries=symmetries.moved(back).model_dump(),
        declares=metadata.symmetries is not None,
        keypoints=metadata.keypoints and metadata.keypoints.moved(back).model_dump(),
        axes="file" if is_file else "object",
        sidecar=Path(spec.source).name + ENDING if is_file else "",
        animation=animation,
        warnings=mesh.warnings,
        suggestions=(*(_suggestions(spec, facts, (width, height, length)) if is_file else ()), *problems),
    )


def _default_spec(path: Path) -> ModelSpec:
    return ModelSpec(key=path.stem, source=str(path.absolute()), category="model", category_id=1)


def _animation(spec: ModelSpec) -> tuple[Timeline | None, tuple[str, ...]]:
    """Return the times of the file's animations, and the reasons why the times are unknown."""
    file = file_in(spec)
    if file is None:
        return None, ()
    try:
        return animation_of(file, spec.confined), ()
    except ModelError as error:
        return None, (f"it may move, but its frames are not known: {error}",)


def _unusual(material: Material) -> dict[str, Any]:
    """Fields of a material that are not the default, its name left out."""
    plain = replace(Material(), name=material.name)
    names = (f.name for f in fields(Material))
    return {name: getattr(material, name) for name in names if getattr(material, name) != getattr(plain, name)}


def _suggestions(spec: ModelSpec, facts: FileFacts, size: Size) -> tuple[str, ...]:
    width, height, length = size
    reader = reader_of(facts.format)
    said: list[str] = []
    if spec.scale == "as_is" and spec.unit is None:
        longest = max(size)
        if longest > 100:
            said.append(f"{longest:.4g} m across: set unit: 0.001 if the file is in millimetres, 0.01 if in centimetres")
        elif longest < 0.01:
            said.append(f"{longest:.4g} m across: set unit (metres in one unit of the file) or scale")
    if spec.forward is None and width > 1.5 * length and not (reader and reader.is_picture):
        sideways = next(f"+{axis}" for axis in "xyz" if axis not in (facts.forward[1], (spec.up or facts.up)[1]))
        said.append(f"wider than long: if the picture shows its side at the front, set forward: {sideways} or its opposite")
    if spec.up is None and reader and reader.assumes_up and height > 2 * max(width, length):
        said.append(f"the format does not say which way is up, {facts.up} was assumed: set up if it lies on its back")
    return tuple(said)
