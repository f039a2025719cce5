"""The files of a recipe that renders a data set again."""

from __future__ import annotations

import json
import math
import os
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from viewsphere import plugins
from viewsphere.composing.viewpoints.pose_files import PoseFile
from viewsphere.composing.viewpoints.poses import world_turn
from viewsphere.geometry.rotation import rigid
from viewsphere.limits import limits
from viewsphere.model.fields.file_names import is_reserved
from viewsphere.model.listed import ListedObject, ListedShot
from viewsphere.model.scene import IDENTITY, Vector
from viewsphere.planning.models import numbered_specs
from viewsphere.plugins.format import FormatSpec
from viewsphere.plugins.source import model_for
from viewsphere.recipe.cameras.viewpoints import PoseList
from viewsphere.recipe.formats import Formats, read_formats
from viewsphere.recipe.reading.file import dump
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.exports.scope import needs_of
from viewsphere.store.source_cameras import Drafted, SourceCameras, SourceModel

FILLED = 0.5
"""Share of a picture's width that the stand-in fills for half of the cameras."""

SHORTEST = 1e-3
"""Minimum length of the stand-in, and minimum distance between cameras at different places, metres."""

LONGEST = 0.9
"""Maximum length of the stand-in, as a share of the size that models may have."""

PARALLEL = 1e-6
"""Smallest of the singular values, as a share of the largest, at which optical axes meet somewhere."""


RECIPE, SHOTS, MODELS, SIDECARS = "recipe.yaml", "shots.jsonl", "models", "symmetries"
CHANNELS = ("rgb", "depth", "instances")
STAND_IN = "stand-in"
"""The key of the stand-in among the models of a `SourceCameras`, used if it has no models."""

COMMENTS = {
    "models": "the data set's own, where they lie, with their own axes, origin and unit",
    "viewpoints": "a line of shots.jsonl each: world_from_camera, metres, and the lens; `up` is the axis there that becomes +Z",
    "scenes": "each shot shows the models that its line lists, where it has them",
    "camera": "size and lens, too, are those of each line",
    "scene": "as plain as possible: only geometry is the data set's; light and background are yours to choose",
    "splits": "each line says its own; these are their shares",
}
NONE_OF_ITS_OWN = (
    "the data set has no mesh, so this is one of the zoo's, at the point nearest to all optical axes (`origin`, below), about "
    "half a picture wide: put your own here"
)


def draft(found: SourceCameras, of: str, folder: Path) -> Iterator[tuple[str, bytes]]:
    """The files, by their names relative to `folder`, beginning with those that the recipe names. Each has to be written
    before the next is requested. `of` describes the data set in words.
    """
    entries: list[dict[str, Any]] = []
    sources: dict[str, str] = {}
    for key, model in found.models.items():
        if isinstance(model.source, Drafted):
            yield f"{MODELS}/{model.source.name}", model.source.data
        sidecar = f"{SIDECARS}/{len(sources) + 1:06d}.yaml" if model.symmetries else None
        if model.symmetries:
            yield sidecar or "", dump({"symmetries": model.symmetries.model_dump(mode="json")}).encode()
        sources[key] = _source(model)
        entries.append(_entry(model, sources[key], sidecar))
    substitute = None if found.models else stand_in(found.shots)
    shots = _shots(found, substitute)
    data = _recipe(found, _joined(entries), shots, substitute)
    keys = _keys(data, sources, folder)
    lines = (json.dumps(_line(shot, keys)) for shot in shots)
    yield SHOTS, ("\n".join(lines) + "\n").encode()
    yield RECIPE, _text(data, of, found, substitute).encode()


def _source(model: SourceModel) -> str:
    if isinstance(model.source, Drafted):
        return f"{MODELS}/{model.source.name}"
    return Path(os.path.normpath(model.source.absolute())).as_posix()


def _entry(model: SourceModel, source: str, sidecar: str | None) -> dict[str, Any]:
    entry: dict[str, Any] = {"source": [source], "category": model.category or "object"}
    entry |= {"supercategory": model.supercategory} if model.supercategory else {}
    entry |= {"name": model.name} if model.name else {}
    entry |= {"unit": {1.0: "m", 0.001: "mm"}.get(model.unit, model.unit), "up": "+z", "forward": "-y"}
    return entry | {"centring": "as_is"} | ({"sidecar": sidecar} if sidecar else {})


def _joined(entries: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """The entries; entries that differ only in their files are joined."""
    found: dict[str, dict[str, Any]] = {}
    for entry in entries:
        rest = json.dumps({name: value for name, value in entry.items() if name != "source"})
        if rest in found:
            found[rest]["source"] += entry["source"]
        else:
            found[rest] = entry
    return list(found.values())


def _shots(found: SourceCameras, substitute: _StandIn | None) -> list[ListedShot]:
    """The shots with unique names and valid split names; they show the stand-in if they have to be listed."""
    splits, names = dict[str, str](), dict[str, int]()
    shots: list[ListedShot] = []
    there: tuple[ListedObject, ...] = ()
    if substitute is not None and _are_listed(found):
        turn = world_turn(PoseList(kind="file", path=SHOTS, up=found.up), PoseFile(()))
        a, b, c = ((x, y, z, w) for x, y, z, w in rigid(turn.T, np.array(substitute.origin))[:3].tolist())
        there = (ListedObject(model=STAND_IN, world_from_object=(a, b, c, IDENTITY[3])),)
    for shot in found.shots:
        split = splits.setdefault(shot.split or "train", _split(shot.split or "train"))
        name = shot.name and _free(shot.name, names)
        shots.append(shot.model_copy(update={"name": name, "split": split, "objects": shot.objects or there}))
    return shots


def _are_listed(found: SourceCameras) -> bool:
    """Return whether shots have to be listed, because the sizes of their pictures or their splits differ."""
    sizes = {(shot.camera.width, shot.camera.height) for shot in found.shots if shot.camera}
    return len(sizes) > 1 or len({shot.split for shot in found.shots}) > 1


def _split(name: str) -> str:
    """A split's name in the form that recipes accept."""
    plain = re.sub(r"[^A-Za-z0-9_-]", "_", name)[:90]
    return plain if re.match("[A-Za-z]", plain) and not is_reserved(plain) else f"split_{plain}"


def _free(name: str, names: dict[str, int]) -> str:
    """The name, with a number appended if it is taken; `names` has the taken names, each with the next number to try."""
    free, taken = name, name.casefold()
    while free.casefold() in names:
        free = f"{name[:90]}-{names[taken]}"
        names[taken] += 1
    names[free.casefold()] = 2
    return free


def _recipe(
    found: SourceCameras, entries: list[dict[str, Any]], shots: Sequence[ListedShot], substitute: _StandIn | None
) -> dict[str, Any]:
    views: dict[str, Any] = {"kind": "file", "path": SHOTS, "up": found.up}
    if substitute is not None:
        source = model_for("example")
        entries = [{"source": source, "category": source.partition(":")[2], "count": 1, "scale": {"length": substitute.length}}]
        views["origin"] = list(substitute.origin)
    listed = {"scenes": {"sampler": "listed"}} if any(shot.objects for shot in shots) or found.models else {}
    return {
        "name": f"{''.join(c for c in found.name if c.isprintable())[:150]}-again".lstrip(),
        "seed": 0,
        "models": entries,
        "viewpoints": views,
        **listed,
        "camera": {"of_viewpoints": True},
        "scene": {"background": "#777777", "ground": "off"},
        "channels": _channels(found.formats),
        **({"annotations": list(found.annotations)} if found.annotations else {}),
        "formats": list(found.formats),
        "splits": {"by": "frame", **_shares(Counter(shot.split or "" for shot in shots))},
    }


def _channels(formats: Formats) -> list[str]:
    """Return the pictures and other channels that the formats need."""
    needed = {name for entry in read_formats(formats) for name in needs_of(plugins.load(FormatSpec, entry.name), entry)}
    return [name for name in CHANNELS if name == CHANNELS[0] or name in needed]


def _shares(counts: Counter[str]) -> dict[str, float]:
    """The share of each split; they add up to 1."""
    *others, last = counts
    found = {name: round(counts[name] / counts.total(), 6) for name in others}
    return {**found, last: round(1 - sum(found.values()), 6)}


def _keys(data: dict[str, Any], sources: dict[str, str], folder: Path) -> dict[str, str]:
    """The keys, in the recipe, of the models of an `SourceCameras`."""
    specs = numbered_specs(Recipe.model_validate(data, context={"folder": folder}))
    by_source = {spec.source: spec.key for spec, _ in specs}
    if not sources:
        return {STAND_IN: next(iter(by_source.values()))}
    return {key: by_source[Path(os.path.normpath(folder / source)).as_posix()] for key, source in sources.items()}


def _line(shot: ListedShot, keys: dict[str, str]) -> dict[str, Any]:
    objects = tuple(one.model_copy(update={"model": keys[one.model]}) for one in shot.objects)
    return shot.model_copy(update={"objects": objects}).model_dump(mode="json", exclude_defaults=True)


def _text(data: dict[str, Any], of: str, found: SourceCameras, substitute: _StandIn | None) -> str:
    """The text of the recipe, with comments before its parts."""
    head = [
        f"Renders a data set again: {of}",
        "Try it:   viewsphere preview recipe.yaml     then:   viewsphere render recipe.yaml -o dataset",
        *(f"Note: {note}" for note in found.notes),
    ]
    comments = COMMENTS if substitute is None else COMMENTS | {"models": NONE_OF_ITS_OWN}
    lines = [_comment(head)]
    for line in dump(data).splitlines():
        name = line.partition(":")[0]
        lines.append(("\n" + _comment([comments[name]]) if name in comments else "") + line + "\n")
    return "".join(lines)


def _comment(lines: Sequence[str]) -> str:
    return "".join(f"# {''.join(c if c.isprintable() else '?' for c in line)}\n" for line in lines)


@dataclass(frozen=True)
class _StandIn:
    """A model at `origin`, a point of the cameras' world, `length` metres from front to back."""

    origin: Vector
    length: float


def stand_in(shots: Sequence[ListedShot]) -> _StandIn:
    """A model at the point nearest to all optical axes. If the axes are parallel, or meet behind or in a camera, it is ahead
    of the first camera. Its size suits half of the cameras, and no camera is inside it.
    """
    poses = np.array([shot.world_from_camera for shot in shots])
    centers, axes = poses[:, :3, 3], poses[:, :3, 2]
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    normal, rhs = across.sum(axis=0), (across @ centers[:, :, None]).sum(axis=0)[:, 0]
    origin, _, _, singular = np.linalg.lstsq(normal, rhs, rcond=None)
    if singular[-1] < PARALLEL * singular[0] or float(np.median(_ahead(centers, axes, origin))) <= SHORTEST:
        spread = float(np.linalg.norm(centers - centers.mean(axis=0), axis=1).max())
        origin = centers[0] + (2 * spread if spread > SHORTEST else 1.0) * axes[0]
    distances = np.linalg.norm(centers - origin, axis=1)
    widths = [shot.camera.width / shot.camera.fx for shot in shots if shot.camera] or [1.0]
    sides = FILLED * float(np.median(distances)) * float(np.median(widths)), float(distances.min()), LONGEST * limits.MAX_SIZE
    length = min(sides)
    x, y, z = (round(value, 6) for value in origin.tolist())
    return _StandIn((x, y, z), max(SHORTEST, float(f"{length:.3g}")) if math.isfinite(length) else 1.0)


def _ahead(centers: np.ndarray, axes: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Return the distance of a point ahead of each camera."""
    return ((point - centers) * axes).sum(axis=1)
