"""The choice of a preview's samples."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from itertools import accumulate, groupby
from typing import Any

import numpy as np

from viewsphere.errors import each
from viewsphere.labels import channels as known
from viewsphere.labels import drawable, is_shown, on_request
from viewsphere.model.annotations.tracks import Tracks
from viewsphere.model.channel import picture_of
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.rig import Rig
from viewsphere.model.shot import Shot
from viewsphere.planning.plan import Plan
from viewsphere.recipe.cameras.rig import SensorList
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.opening import prepare
from viewsphere.run.shots.camera_collisions import CameraChecks
from viewsphere.run.shots.framing import Framing
from viewsphere.run.shots.stages import Stages
from viewsphere.store import Dataset, Row
from viewsphere.store.index import Ranges, length, nth, numbers
from viewsphere.store.samples.films import Film

ROW = 4
"""Number of instants of a sequence that a preview shows if there are several sequences."""


def preview_samples(
    recipe: Recipe, count: int = 12, width: int = 320, draw: Sequence[str] = (), row: int = ROW
) -> Iterator[Sample]:
    """Render `count` frames spread over all models (or scenes) and poses, `width` pixels wide, in memory.

    With a time: `row` evenly spaced instants of each of some sequences, by all sensors; of one sequence alone `count` instants.
    What is named in `draw` they have, too. Raises UserError for all models that cannot be shown together.
    """
    if recipe.time is not None:
        yield from _instants(recipe, count, width, draw, row)
        return
    planned = prepare(_drawable(recipe, recipe.channels, draw))
    stages, chosen = Stages(), _spread(planned, count)
    _check(stages, planned, [subject for subject, _ in chosen])
    for subject, groups in chosen:
        for poses in [[pose] for group in groups for pose in group] if recipe.is_new_each_frame else groups:
            yield from _rendered(stages, planned, subject, poses, width)


def _instants(recipe: Recipe, count: int, width: int, draw: Sequence[str], row: int) -> Iterator[Sample]:
    """Samples of sequences. Labels that are not drawn are not computed, because they compare instants that a preview lacks."""
    pictures = [name for name in recipe.channels if name == picture_of(recipe.channels)]
    planned = prepare(_drawable(recipe, pictures or ["rgb"], draw))
    stages, instants = Stages(), recipe.time.count if recipe.time else 1
    starts = [(subject, first) for block in planned.blocks for subject in block.subjects for first, _ in block.positions]
    films = min(len(starts), max(1, count // row))
    taken = np.linspace(0, instants - 1, min(instants, _each(count, films, row))).round().astype(int)
    chosen = [starts[i] for i in np.linspace(0, len(starts) - 1, films).round().astype(int)]
    _check(stages, planned, [subject for subject, _ in chosen])
    for subject, first in chosen:
        yield from _rendered(stages, planned, subject, (first + taken).tolist(), width)


def _check(stages: Stages, planned: Plan, subjects: Sequence[str]) -> None:
    """Read the shown models and check that no camera is inside them; raises all their errors together."""
    specs = {spec.key: spec for subject in subjects for spec in planned.cast(subject)}

    def read(spec: ModelSpec) -> None:
        stages.read_ahead(planned, [spec])
        stages.box(spec)

    each(read, specs.values())
    each(lambda subject: CameraChecks(stages).check_distances(planned, subject), dict.fromkeys(subjects))


def _each(count: int, films: int, row: int) -> int:
    """Return the number of instants that each of some sequences shows, so that rows are full."""
    each = max(1, count // films)
    return each - each % row if each > row else each


def _rendered(stages: Stages, planned: Plan, subject: str, poses: Sequence[int], width: int) -> Iterator[Sample]:
    row = Row(subject, subject, 0, len(poses) * len(planned.rig.sensors), 0, tuple((pose, pose + 1) for pose in poses))
    shot = Framing(planned, planned, stages, stages.box).shot(row)
    channels = tuple(dict.fromkeys((*shot.channels, picture_of(shot.channels) or "rgb", "depth", "instances")))
    return stages.render(shot.model_copy(update=_scaled(shot, width) | {"channels": channels}))


def _drawable(recipe: Recipe, channels: Sequence[str], draw: Sequence[str]) -> Recipe:
    """The recipe with these channels and the drawn labels, without annotations that are not drawn."""
    wanted = [source for source, drawing in drawable().items() if drawing.name in draw]
    seen = tuple(dict.fromkeys((*channels, *(source for source in wanted if source in known()))))
    asked = tuple(source for source in wanted if source in on_request())
    options = {name: given for name, given in recipe.labels.items() if name in (*seen, *asked)}
    changed = recipe.model_copy(update={"channels": seen, "annotations": asked, "labels": options})
    return changed.model_copy(update={"rig": _keeping(recipe.rig, seen)}) if isinstance(recipe.rig, SensorList) else changed


def _keeping(rig: SensorList, channels: Sequence[str]) -> SensorList:
    """The rig, with each sensor's channels reduced to these."""
    sensors = {
        name: entry.model_copy(update={"channels": tuple(c for c in entry.channels or () if c in channels) or None})
        for name, entry in rig.sensors.items()
    }
    return rig.model_copy(update={"sensors": sensors})


def dataset_samples(dataset: Dataset, count: int = 12, row: int = ROW, films: Sequence[Film] = ()) -> list[Sample]:
    """`count` frames spread evenly over a data set; of its sequences (`films`), where it has some, those instants that
    `preview_samples` shows of a recipe.
    """
    if films:
        rows = min(len(films), max(1, count // row))
        chosen = [films[i] for i in np.linspace(0, len(films) - 1, rows).round().astype(int)]
        return [dataset[place] for film in chosen for i in film.spread(_each(count, rows, row)) for place in film.places[i]]
    picks = np.unique(np.linspace(0, len(dataset) - 1, min(count, len(dataset))).round().astype(int))
    samples = [dataset[int(i)] for i in picks]
    return [sample for sample in samples if is_shown(sample.files)] or samples  # some sensors may keep only labels


def _spread(planned: Plan, count: int) -> list[tuple[str, list[list[int]]]]:
    """Subjects and their poses, those of one time step together, such that subjects follow in order and poses step through
    the grid; all if there are no more.
    """
    subjects, taken = planned.varied_subjects, planned.rows.positions_of
    if count >= planned.frames:
        return [(subject, [list(numbers(poses)) for poses in taken(subject)]) for subject in subjects]
    chosen: dict[str, list[int]] = {}
    for i, number in enumerate(np.linspace(0, len(subjects) - 1, count).round().astype(int).tolist()):
        size = sum(map(length, taken(subjects[number])))
        places = chosen.setdefault(subjects[number], [])
        place = int(i * size / count * (1 + 1 / max(count, 1)))
        places.append(next((p % size for p in range(place, place + size) if p % size not in places), place % size))
    return [(subject, _grouped(taken(subject), places)) for subject, places in chosen.items()]


def _grouped(steps: Sequence[Ranges], places: Sequence[int]) -> list[list[int]]:
    """The poses at some positions in the poses of all time steps, one list for each time step."""
    edges = list(accumulate(map(length, steps), initial=0))
    groups: list[tuple[int, int]] = []
    for place in places:
        step = bisect_right(edges, place) - 1
        groups.append((step, nth(steps[step], place - edges[step])))
    return [[pose for _, pose in group] for _, group in groupby(groups, lambda pair: pair[0])]


def _scaled(shot: Shot, width: int) -> dict[str, Any]:
    """The same cameras with narrower pictures, and all channels of each, as a shot's fields; LiDARs as they are. Points that
    are followed are picked at the same places.
    """
    sensors = tuple(
        sensor.model_copy(update={} if sensor.lidar else {"intrinsics": sensor.intrinsics.narrowed(width), "channels": None})
        for sensor in shot.rig.sensors
    )
    zooms = ({"intrinsics": now.intrinsics and now.intrinsics.narrowed(width)} for now in shot.instants)
    instants = tuple(now.model_copy(update=more) for now, more in zip(shot.instants, zooms, strict=True))
    share = min(1.0, width / shot.rig.sensors[0].intrinsics.width)
    return {"rig": Rig(sensors=sensors), "instants": instants, "tracks": shot.tracks and _nearer(shot.tracks, share)}


def _nearer(tracks: Tracks, share: float) -> Tracks:
    """The same points in pictures that are scaled by this share."""
    points = tuple((instant, x * share, y * share) for instant, x, y in tracks.points)
    return tracks.model_copy(update={"points": points, "grid": tracks.grid and max(1, round(tracks.grid * share))})
