"""tracks: the positions of the points that a sensor follows through a sequence, and whether they are seen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from colorsys import hls_to_rgb
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.camera import project
from viewsphere.geometry.rotation import inverse_pose, transform
from viewsphere.labels.shared.ids import in_column
from viewsphere.labels.shared.needs import FollowedPoints
from viewsphere.labels.shared.spec import ChannelLabel, Color, Drawing, Models, channel_of
from viewsphere.model.annotations.tracks import TRACK
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.rolling import RowPoses
from viewsphere.truth.raster.rolling import pixels_in_rows
from viewsphere.truth.surface_points.points import SKY
from viewsphere.truth.surface_points.raster import OCCLUDED, VISIBLE
from viewsphere.truth.surface_points.rolling import when_shown

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

    from viewsphere.labels.shared.context import LabelContext

RADIUS = 3.0
"""Pixels of a point's radius in a picture that is 640 pixels wide."""

WORST = 4
"""The last of the states."""


def _compute(context: LabelContext) -> NDArray[np.void]:
    """One row per point, (N,) of `viewsphere.model.annotations.tracks.TRACK`. Raises ValueError if the shot follows no
    points.
    """
    followed = context.get(FollowedPoints())  # first, because its triangles may overwrite a view's
    own = context.own_view
    if own is None or followed is None:
        raise ValueError("tracks: expected a sample of a sequence, found none")
    now = followed.points.in_view(own)
    out, point = followed.rows.copy(), np.ones((len(followed.query), 4))
    point[:, :3] = now.world
    if own.camera.rows is not None:  # objects have poses in the sample from which their motion follows, scenery has none
        scenery = np.where(now.moving >= own.geometry.object_count, now.moving, np.int32(-1))
        point[:, :3] = when_shown(own, now.world, scenery, now.xy[:, 1])
    sky = np.flatnonzero(followed.points.body == SKY)
    point[sky, :3], point[sky, 3] = followed.points.place[sky], 0.0
    point[np.isnan(point[:, 0])] = np.nan
    out["point"], out["state"] = point, now.state
    return out


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """States are valid, points are on objects of the sample, and each point that is not invalid has a position."""
    rows = channel_of(sample, "tracks")
    if rows is None:
        return
    known = {0, *(o.id for o in sample.objects)}
    strange = (rows["state"] > WORST).sum()
    if strange:
        yield f"expected states of 0 to {WORST}; found others of {strange} points"
    lost = np.isnan(rows["point"]).any(axis=1) & (rows["state"] != WORST)
    if lost.any():
        yield f"expected a place of every point that is not invalid; found none of {lost.sum()}"
    absent = ~np.isin(rows["object"], list(known)) & (rows["state"] != WORST)
    if absent.any():
        yield f"expected points on objects of the sample; found {absent.sum()} on others that are not invalid"


def _draw(pen: ImageDraw, samples: Sequence[Sample], scale: float) -> None:
    """Each point in the colour of the position where it was picked: filled if it is seen, hollow if something hides it. A line
    leads to it from its positions at the instants before. A sample's points are the rows of its own sensor.
    """
    now = samples[-1]
    rows = now.channels["tracks"]
    colors = colors_of(rows, now.width, now.height)
    places = [positions(sample) * scale for sample in samples]
    radius = max(1.5, RADIUS * scale * now.width / 640)
    for i in np.flatnonzero(rows["state"] <= OCCLUDED):
        line = _whole_end([tuple(place[i]) for place in places])
        if len(line) > 1:
            pen.line(line, fill=(*colors[i], 150), width=max(1, round(radius / 2)))
        x, y = line[-1] if line else (np.nan, np.nan)
        if np.isfinite(x):
            box = (x - radius, y - radius, x + radius, y + radius)
            filled = rows["state"][i] == VISIBLE
            pen.ellipse(box, fill=colors[i] if filled else None, outline=colors[i], width=max(1, round(radius / 3)))


def _whole_end(places: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """The last positions, back to the first unknown one."""
    unknown = next((i for i, place in enumerate(reversed(places)) if not np.isfinite(place).all()), len(places))
    return places[len(places) - unknown :]


def positions(sample: Sample) -> NDArray[np.float64]:
    """Return the positions of a sample's points in its picture, (N, 2) pixels; NaN where its lens does not show them. Under a
    rolling shutter, they are those nearest in time to the instant.
    """
    if sample.camera.rows is not None:
        return _positions_in_rows(sample, sample.camera.rows)
    return project(sample.camera.intrinsics, in_camera(sample))[0]


def _positions_in_rows(sample: Sample, rows: RowPoses) -> NDArray[np.float64]:
    tracks, known = sample.channels["tracks"], {o.id: o for o in sample.objects if o.id - 1 in rows.moving}
    point, owner = tracks["point"], np.where(np.isin(tracks["object"], [*known]), tracks["object"], 0)
    xy, is_there = np.full((len(point), 2), np.nan), ~np.isnan(point[:, 0])
    far = point[:, 3] == 0.0
    for of_object in np.unique(owner[is_there & ~far]).tolist():
        at = is_there & ~far & (owner == of_object)
        pose = known[of_object].world_from_object if of_object else np.eye(4)
        own = transform(inverse_pose(pose), point[at, :3])
        xy[at] = pixels_in_rows(sample.camera, rows, of_object - 1, pose, own)[0]
    turned = RowPoses(rows.rotation, np.zeros_like(rows.translation), {})
    xy[far & is_there] = pixels_in_rows(sample.camera, turned, -1, np.eye(4), point[far & is_there, :3])[0]
    return xy


def in_camera(sample: Sample) -> NDArray[np.float64]:
    """A sample's points in its camera's axes, (N, 3) metres; a direction for points of the sky."""
    camera, point = sample.camera, sample.channels["tracks"]["point"]
    turned = transform(camera.R, point[:, :3])
    return np.where(point[:, 3:] == 0.0, turned, turned + camera.t)


def colors_of(rows: NDArray[np.void], width: int, height: int) -> list[Color]:
    """A colour for each point: the hue follows x and the lightness y of the position where it was picked."""
    hue, light = rows["query"][:, 0] / width, 0.68 - 0.28 * rows["query"][:, 1] / height
    tones = (hls_to_rgb(0.83 * h, v, 1.0) for h, v in zip(hue.tolist(), light.tolist(), strict=True))
    return [(round(255 * r), round(255 * g), round(255 * b)) for r, g, b in tones]


LABEL = ChannelLabel(
    name="tracks",
    meaning="points followed through the sequence, a row each: where each was picked, where it is now, whether it is seen",
    axes="world, image",
    needs=(FollowedPoints(),),
    dtype=TRACK,
    components=0,
    unit="m, px",
    empty=np.nan,
    encoding="npz",
    ids={"object": in_column("object")},
    compute=_compute,
    prove=_prove,
    drawing=Drawing("tracks", trails=_draw, key=(("tracks: filled is visible, hollow is occluded", None),)),
)
