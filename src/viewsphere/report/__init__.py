"""The report on a data set, one HTML page: pictures with their labels, viewpoints, distributions, models and proofs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import StoreError, ViewsphereError
from viewsphere.geometry.box3d import Box3d
from viewsphere.labels import drawings, is_shown
from viewsphere.report.facts import facts, finished
from viewsphere.report.frames import frame_data
from viewsphere.report.meshes import mesh_data, read_small, spread
from viewsphere.report.page import page, script_json
from viewsphere.report.paths import without_folders
from viewsphere.report.pictures import layers_within
from viewsphere.report.sequences import extents_of, played, sequence_data
from viewsphere.report.summary import summary
from viewsphere.report.table import FrameTable, read_table
from viewsphere.report.unknown import numbers
from viewsphere.scratch import write_whole
from viewsphere.store import Dataset, ModelInfo
from viewsphere.store.samples.films import Film, films_of
from viewsphere.urls import here

GOLDEN = (5**0.5 - 1) / 2
"""The golden ratio less 1: multiples of it, modulo 1, are evenly spread, for any number of frames."""


LIMIT = 20_000_000
"""Maximum size of the page, bytes."""

MODELS = 48
"""Maximum number of models shown with a mesh."""

TRIANGLES = 240_000
"""Maximum number of triangles, of all meshes together and of one mesh."""

MOST_TRIANGLES = 14_000
"""Most triangles of a model in a page, which holds `TRIANGLES` in total."""

CAMERAS = 600
"""Maximum number of cameras shown around a model."""

Listener = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Proof:
    """The outcome of `viewsphere check`, for the page: frames behind each proof, findings and notes, the verdict in a line, and
    the reason for each proof that did not run.
    """

    ok: bool
    checked: dict[str, int]
    findings: tuple[str, ...]
    notes: tuple[str, ...]
    verdict: str
    not_run: dict[str, str] = field(default_factory=dict[str, str])


def write_report(
    dataset: Dataset,
    file: Path,
    *,
    frames: int = 240,
    proof: Proof | None = None,
    workers: int = 0,
    listener: Listener | None = None,
) -> int:
    """Write the page of a data set, finished or half finished; returns its size in bytes, at most `LIMIT`.

    All frames are counted (by `workers` processes; 0: in this process; more need a `__main__` guard in the calling script),
    and `frames` of them are shown, the same frames every time. `listener` is called with phase, done and total. Raises
    StoreError if no frame is finished or a record or picture cannot be read, UserError if the page would be too large or
    cannot be written.
    """
    tell = listener or _unheard
    if not len(dataset):
        raise StoreError(f"{dataset.root}: expected finished frames, found none: render first")
    table = read_table(dataset, workers=workers, listener=lambda done, total: tell("records", done, total))
    whole = {film.sequence: film for film in films_of(dataset, is_shown)}
    films = played(list(whole.values()), frames)
    positions = _positions(films, table, frames)
    data = report_data(dataset, table, positions, proof, tell)
    data["summary"]["sequences"] = len(whole)
    data["sequences"] = [sequence_data(film, positions, len(whole[film.sequence].instants)) for film in films]
    room = LIMIT - len(page(dataset.name, data).encode())
    within = {film.sequence: extents_of(dataset, film) for film in films}
    pictures = layers_within(dataset, positions, room, lambda done: tell("pictures", done, len(positions)), within)
    data["shown"] = [{**frame, "layers": found} for frame, found in zip(data["shown"], pictures, strict=True)]
    text = page(dataset.name, data).encode()
    write_whole(file, text)
    return len(text)


def _positions(films: Sequence[Film], table: FrameTable, frames: int) -> list[int]:
    """Positions of the shown frames, ascending: the frames of played films, and other frames if there is room."""
    places_of_films = {place for film in films for places in film.places for place in places}
    if not places_of_films:
        return chosen_frames(table, frames)
    stills = [i for i in chosen_frames(table, frames) if i not in places_of_films] if len(places_of_films) < frames else []
    return sorted(places_of_films | set(stills[: frames - len(places_of_films)]))


def report_data(
    dataset: Dataset, table: FrameTable, positions: Sequence[int], proof: Proof | None, tell: Listener
) -> dict[str, Any]:
    """Return the page's content except pictures, as plain data."""
    return {
        "facts": without_folders(facts(dataset, finished(dataset))),
        "summary": summary(dataset, table),
        "shown": [{**frame_data(sample), "layers": {}} for sample in map(dataset.__getitem__, positions)],
        "sequences": [],
        "models": _models(dataset, table, tell),
        **conventions(),
        "proof": None if proof is None else without_folders(asdict(proof)),
    }


def conventions() -> dict[str, Any]:
    """Return the page's constants, equal for all data sets: colours of layers; vertices, edges and faces of boxes."""
    return {
        "keys": {drawing.name: drawing.key for drawing in drawings() if drawing.key},
        "box": Box3d.layout(),
    }


def _models(dataset: Dataset, table: FrameTable, tell: Listener) -> list[dict[str, Any]]:
    """Meshes of models spread over the data set, with the cameras that saw them, or the reason why there is no mesh."""
    chosen = [dataset.models[i] for i in spread(len(dataset.models), MODELS)]
    most = min(MOST_TRIANGLES, TRIANGLES // max(1, len(chosen)))
    models: list[dict[str, Any]] = []
    for done, info in enumerate(chosen, 1):
        models.append(model_data(dataset, info, table, most))
        tell("models", done, len(chosen))
    return models


def model_data(dataset: Dataset, info: ModelInfo, table: FrameTable, most: int = MOST_TRIANGLES) -> dict[str, Any]:
    """A model's mesh of at most `most` triangles, or the reason why there is none, and the cameras that saw it, as plain
    data.
    """
    try:
        with here(dataset.path(info.glb)) as file:
            shape = {"mesh": mesh_data(read_small(file, most, info.node)), "problem": None}
    except ViewsphereError as error:
        shape = {"mesh": None, "problem": without_folders(str(error))}
    return {"key": info.key, **shape, **_cameras(info, table)}


def _cameras(info: ModelInfo, table: FrameTable) -> dict[str, Any]:
    """Number of views of a model, and azimuth, elevation (degrees) and distance (metres) of up to `CAMERAS` of them, around the
    centre of the model's box.
    """
    objects = table.objects
    if info.key not in table.models:
        return {"views": 0, "cameras": [], "center": numbers(info.box3d_object.mean(axis=0))}
    objects_of_model = objects[objects["model"] == table.models.index(info.key)]
    picks = objects_of_model[list(spread(len(objects_of_model), CAMERAS))]
    cameras = [numbers(row) for row in zip(picks["azimuth"], picks["elevation"], picks["distance"], strict=True)]
    return {"views": len(objects_of_model), "cameras": cameras, "center": numbers(info.box3d_object.mean(axis=0))}


def _unheard(phase: str, done: int, total: int) -> None:
    """The default listener, which does nothing."""


__all__ = ["Proof", "conventions", "model_data", "report_data", "script_json", "write_report"]


def chosen_frames(table: FrameTable, count: int) -> list[int]:
    """Positions of at most `count` frames, ascending.

    Frames of one subject (model, or category where there is none) and split make a group. If there are at most `count` groups,
    each gives at least one frame, and more in proportion to its size; of more groups, `count` spread evenly give one each.
    Within a group the picks are stratified, at a place in the stratum that the golden ratio moves on, so that the picks do not
    fall into step with the poses.
    """
    total = len(table.frames)
    if count >= total:
        return list(range(total))
    groups = _groups(table)
    if len(groups) > count:
        groups = [groups[i] for i in np.linspace(0, len(groups) - 1, count).round().astype(int)]
        shares = [1] * count
    else:
        shares = _shares([len(g) for g in groups], count)
    picks: list[int] = []
    for number, (group, share) in enumerate(zip(groups, shares, strict=True)):
        turns = (np.arange(share) + number + 1) * GOLDEN % 1
        places = ((np.arange(share) + turns) * len(group) / share).astype(int)
        picks += group[places].tolist()
    return sorted(picks)


def _groups(table: FrameTable) -> list[NDArray[np.intp]]:
    """Positions of the frames of each subject and split, in order of appearance."""
    code = table.frames["subject"].astype(np.int64) * max(1, len(table.splits)) + table.frames["split"]
    order = np.argsort(code, kind="stable")
    starts = np.flatnonzero(np.diff(code[order], prepend=-1))
    return sorted(np.split(order, starts[1:]), key=lambda group: int(group[0]))


def _shares(sizes: list[int], count: int) -> list[int]:
    """Whole shares of `count` in proportion to the sizes: at least 1, at most the size, by largest remainder."""
    shares = np.ones(len(sizes), int)
    room = np.array(sizes) - 1
    left = count - len(sizes)
    exact = room * left / max(1, room.sum())
    shares += exact.astype(int)
    remainders = np.argsort(-(exact - exact.astype(int)), kind="stable")
    shares[remainders[: count - int(shares.sum())]] += 1
    return shares.tolist()
