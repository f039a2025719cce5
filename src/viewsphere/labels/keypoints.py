"""keypoints: the positions of the named points of an object's model, and whether they are seen."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field as Limits

from viewsphere.geometry.camera import project
from viewsphere.geometry.rotation import inverse_pose, transform
from viewsphere.labels.shared.drawing.colors import color_of
from viewsphere.labels.shared.field import Field
from viewsphere.labels.shared.needs import OwnView
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.point_checks import pixels_of_rows
from viewsphere.labels.shared.spec import Drawing, Models, ObjectLabel, rendered
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Number
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.model.sensors.camera import Camera
from viewsphere.truth.surface_points.points import points_in_world
from viewsphere.truth.surface_points.raster import BEHIND, OCCLUDED, OUTSIDE, VISIBLE, Placed, states
from viewsphere.truth.surface_points.rolling import placed_in_rows
from viewsphere.truth.view import View

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

    from viewsphere.labels.shared.context import LabelContext

Float = NDArray[np.float64]

TOLERANCE = 1e-9
EDGE = 1e-6
"""Pixels within which rounding decides whether a point is in the image."""

NEAREST = 0.5
"""Maximum share of a point's distance by which surface may be in front of it."""


class _Options(Frozen):
    """Options of the label keypoints."""

    depth_slack: Annotated[Number, Limits(ge=0, le=0.5)] = Limits(
        default=0.05,
        description="surface that lies before a point by no more than this share of its model's diameter does not hide it: "
        "joints and wheel centres lie inside",
    )


def _compute(context: LabelContext, i: int) -> Mapping[str, Any]:
    """Return every field of the object's points, in the order of its model's points; a model without points gives empty
    fields.
    """
    found = context.once("keypoints", lambda: _states(context))
    return _fields(context.placement(i), found[i])


def _states(context: LabelContext) -> dict[int, tuple[int, ...]]:
    """The states of all objects' points by the objects' positions. The triangles are drawn once for all of them.

    A point is tested at a place on its ray that is nearer to the camera by the slack.
    """
    view, slack = context.get(OwnView()), context.options_of("keypoints", _Options).depth_slack
    if view is None:
        raise ValueError("keypoints: expected a sample of a shot, found none")
    if view.camera.rows is not None:
        return _states_in_rows(view, context.placements, slack)
    found, places = dict[int, int](), list[Float]()
    for i, placement in enumerate(context.placements):
        if placement is not None:
            points = _in_world(placement)
            begin = _ray_origins(context.camera, points)
            away = points - begin
            distance = np.sqrt((away * away).sum(axis=1))
            least = np.minimum(slack * (placement.facts.diameter or 0.0), NEAREST * distance)
            share = np.divide(least, distance, out=np.zeros_like(distance), where=distance > 0)
            places.append(begin + away * (1 - share)[:, None])
            found[i] = len(away)
    if not places:
        return {}
    of_all: list[int] = points_in_world(np.concatenate(places)).in_view(view).state.tolist() if sum(found.values()) else []
    ends = np.cumsum([*found.values()]).tolist()
    return {i: tuple(of_all[end - count : end]) for (i, count), end in zip(found.items(), ends, strict=True)}


def _states_in_rows(view: View, placements: Sequence[Placement | None], slack: float) -> dict[int, tuple[int, ...]]:
    """`_states` under a rolling shutter: each point is tested as the camera sees it at the time of its row."""
    found, placed = list[int](), list[Placed]()
    for i, placement in enumerate(placements):
        if placement is not None:
            points = _in_world(placement)
            thing, none = np.full(len(points), i), np.full(len(points), -1, np.int32)
            seen = placed_in_rows(view, points, thing, partial(np.copy, none), np.zeros(len(points), np.bool_))
            assert seen.rays is not None
            length = np.sqrt((seen.rays * seen.rays).sum(axis=1))
            share = np.fmin(slack * (placement.facts.diameter or 0.0) * seen.near / length, NEAREST)  # NaN without a pixel
            found.append(i)
            placed.append(replace(seen, near=seen.near / (1 - share)))
    return {i: tuple(state.tolist()) for i, state in zip(found, states(placed), strict=True)} if placed else {}


def _ray_origins(camera: Camera, points: Float) -> Float:
    """Places in the world where the rays to points (N, 3) begin, (3,) or (N, 3)."""
    if not camera.lens.is_parallel:
        return camera.center
    ahead = transform(camera.R, points) + camera.t
    return points - ahead[:, 2:] * camera.R[2]


def _in_object(placement: Placement) -> Float:
    known = placement.facts.keypoints
    return np.array([*known.points.values()], np.float64) if known else np.empty((0, 3))


def _in_world(placement: Placement) -> Float:
    return transform(placement.world_from_object, _in_object(placement))


def _fields(placement: Placement, known_states: Any) -> Mapping[str, Any]:
    known, in_world = placement.facts.keypoints, _in_world(placement)
    in_camera = transform(placement.camera_from_world, in_world)
    return {
        "keypoint_names": tuple(known.points) if known else (),
        "keypoints": _pixels(placement, in_camera),
        "keypoints3d": in_world,
        "keypoints3d_camera": in_camera,
        "keypoint_states": np.array(known_states, np.int64),
    }


def _pixels(placement: Placement, in_camera: Float) -> Float:
    """The pixels (n, 2) of the model's points, which are at these places in the camera's axes at the instant."""
    if placement.camera.rows is not None:
        return placement.pixels(_in_object(placement))
    return project(placement.camera.intrinsics, in_camera)[0]


def _restore(kept: Any, placement: Placement, o: ObjectAnnotation) -> Mapping[str, Any]:
    """Return every field, computed from the stored states."""
    found = _fields(placement, kept or ())
    if len(found["keypoint_states"]) != len(found["keypoints"]):
        raise ValueError(f"{len(found['keypoints'])} states, one a named point of the model")
    return found


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Points are the model's, moved by the pose and seen by the camera; those in the picture are visible or occluded."""
    for o in rendered(sample):
        known = models[o.key].keypoints if o.key in models else None
        if known is not None or o.key in models:
            expected = known.points if known else {}
            if o.keypoint_names != tuple(expected):
                yield f"object {o.id}: expected the named points {', '.join(expected)}; found {', '.join(o.keypoint_names)}"
                continue
            own = np.array([*expected.values()], np.float64).reshape(-1, 3)
            slack = TOLERANCE * (1 + float(np.abs(o.world_from_object).max()))
            if np.abs(transform(o.world_from_object, own) - o.keypoints3d).max(initial=0) > slack:
                yield f"object {o.id}: expected keypoints3d where the pose takes the model's points, found others"
        yield from _seen(sample, o)


def _seen(sample: Sample, o: ObjectAnnotation) -> Iterator[str]:
    camera, state = sample.camera, o.keypoint_states
    in_camera = transform(camera.R, o.keypoints3d) + camera.t
    if np.abs(in_camera - o.keypoints3d_camera).max(initial=0) > TOLERANCE * (1 + float(np.abs(in_camera).max(initial=0))):
        yield f"object {o.id}: expected keypoints3d_camera as the camera sees keypoints3d, found others"
    pixels, found = project(camera.intrinsics, o.keypoints3d_camera)[0], o.keypoints
    if camera.rows is not None:
        pixels = pixels_of_rows(camera, camera.rows, o, transform(inverse_pose(o.world_from_object), o.keypoints3d))
    has_pixel = ~np.isnan(found).any(axis=1)
    off = np.abs(pixels - found) > EDGE * (1 + np.abs(np.nan_to_num(pixels)) / 1e3)
    if off.any() or not np.array_equal(np.isnan(pixels), np.isnan(found)):
        yield f"object {o.id}: expected keypoints where the camera shows keypoints3d, found others"
        return
    inside = np.minimum(found, (camera.width, camera.height) - found).min(axis=1, initial=np.inf)
    known = np.isin(state, (VISIBLE, OCCLUDED, OUTSIDE, BEHIND))
    wrong = ~known | (has_pixel == (state == BEHIND))
    wrong |= has_pixel & (np.abs(inside) > EDGE) & ((inside < 0) != (state == OUTSIDE))
    if wrong.any():
        yield f"object {o.id}: expected states that fit the pixels of its points, found others of {wrong.sum()}"


def _draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """Each object's points in its colour: filled where they are seen, hollow where something hides them."""
    radius = max(2.0, 3.0 * scale * sample.width / 640)
    for o in sample.objects:
        for (x, y), state in zip((o.keypoints * scale).tolist(), o.keypoint_states.tolist(), strict=True):
            if state in (VISIBLE, OCCLUDED):
                fill = color_of(o.id) if state == VISIBLE else None
                pen.ellipse((x - radius, y - radius, x + radius, y + radius), fill=fill, outline=color_of(o.id), width=1)


_EACH = "one a named point, in the order of the model's"

LABEL = ObjectLabel(
    name="keypoints",
    meaning="its model's named points",
    on_request=True,
    needs=(OwnView(),),
    options=_Options,
    fields=(
        Field("keypoint_names", "names of the points; the data set's models have skeletons and flips, too", str, many=True),
        Field("keypoints", f"{_EACH}; NaN without a pixel", float, (-1, 2), "px", "image", is_array=True),
        Field("keypoints3d", _EACH, float, (-1, 3), "m", "world", is_array=True),
        Field("keypoints3d_camera", _EACH, float, (-1, 3), "m", "camera", is_array=True),
        Field("keypoint_states", f"{_EACH}: 0 visible, 1 occluded, 2 outside, 3 behind", int, (-1,), is_array=True, ids={}),
    ),
    compute=_compute,
    keep=lambda o: o.keypoint_states.tolist() or None,
    restore=_restore,
    prove=_prove,
    drawing=Drawing("keypoints", lines=_draw, key=(("keypoints: filled is visible, hollow is occluded", None),)),
)
