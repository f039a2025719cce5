"""box3d: the tight box of an object along its own axes, in every frame of reference."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.camera import project
from viewsphere.geometry.rotation import rigid, transform
from viewsphere.labels.shared.drawing.colors import color_of
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.point_checks import pixels_of_rows
from viewsphere.labels.shared.spec import Drawing, Field, Models, ObjectLabel, rendered
from viewsphere.model.sample import ObjectAnnotation, Sample

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

PIXEL_TOLERANCE = 1e-6
"""Tolerance of projected corners, in pixels, relative to 10,000 pixels beyond these."""
METRE_TOLERANCE = 1e-9
"""Tolerance of corners as a share of their distance: rounding errors of float64 are a million times smaller."""


def _fields(placement: Placement) -> Mapping[str, Any]:
    """The model's box in world axes, in camera axes, and projected."""
    in_world = transform(placement.world_from_object, placement.box)
    in_camera = transform(placement.camera_from_world, in_world)
    return {
        "box3d_object": np.array(placement.box, np.float64),
        "box3d": in_world,
        "box3d_camera": in_camera,
        "box3d_pixels": placement.pixels(placement.box),
        "box3d_in_front": in_camera[:, 2] > 0,
    }


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """The boxes are the model's, moved by the poses and projected by P (or the lens)."""
    if sample.known_camera is None:
        return
    camera_from_world = rigid(sample.camera.R, sample.camera.t)
    for o in rendered(sample):
        if o.key in models and not np.array_equal(o.box3d_object, models[o.key].box3d_object):
            yield f"object {o.id}: expected the 3D box of model {o.key}, found another"
        slack = METRE_TOLERANCE * (1 + float(np.abs(o.box3d_camera).max()))
        in_world, in_camera = transform(o.world_from_object, o.box3d_object), transform(camera_from_world, o.box3d)
        for name, value in (("box3d", in_world), ("box3d_camera", in_camera)):
            if not np.allclose(getattr(o, name), value, rtol=0, atol=slack):
                yield f"object {o.id}: {name} does not follow from the pose"
        yield from _projected(sample, o)


def _projected(sample: Sample, o: ObjectAnnotation) -> Iterator[str]:
    """Check box3d_pixels against P, written out here; a distorted lens has no P, so `project` replaces it."""
    camera = sample.camera
    homogeneous = np.column_stack([o.box3d, np.ones(8)]) @ camera.P.T
    in_front = (o.box3d @ camera.R[2] + camera.t[2] if camera.lens.is_parallel else homogeneous[:, 2]) > 0
    if not np.array_equal(in_front, o.box3d_in_front):
        yield f"object {o.id}: expected vertices in front {in_front.tolist()}, found {o.box3d_in_front.tolist()}"
        return
    if camera.rows is not None:
        expected = pixels_of_rows(camera, camera.rows, o, o.box3d_object)
    elif camera.lens.is_straight:
        expected = np.full((8, 2), np.nan)
        expected[in_front] = homogeneous[in_front, :2] / homogeneous[in_front, 2:]
    else:
        expected = project(camera.intrinsics, o.box3d_camera)[0]
    off = np.abs(expected - o.box3d_pixels)
    limit = PIXEL_TOLERANCE * (1 + np.abs(np.nan_to_num(expected)) / 1e4)
    if not np.array_equal(np.isnan(expected), np.isnan(o.box3d_pixels)) or (off > limit).any():
        yield f"object {o.id}: box3d_pixels is up to {np.nanmax(off, initial=0):.3g} px off P x vertex"


def _draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """Every object's box, its front face filled, in a darker tone of its colour."""
    for o in sample.objects:
        red, green, blue = (int(0.55 * c) for c in color_of(o.id))
        box = Box3d(o.box3d_pixels * scale)
        if np.isfinite(box.faces["front"]).all():
            pen.polygon([(x, y) for x, y in box.faces["front"].tolist()], fill=(red, green, blue, 70))
        for (x0, y0), (x1, y1) in (edge.tolist() for edge in box.edges if np.isfinite(edge).all()):
            pen.line(((x0, y0), (x1, y1)), fill=(red, green, blue, 255), width=2)


_EIGHT = "vertices, ordered as in `viewsphere.geometry.box3d`"

LABEL = ObjectLabel.from_placement(
    _fields,
    name="box3d",
    meaning="its tight box along its own axes",
    fields=(
        Field("box3d_object", _EIGHT, float, (8, 3), "m", "object", is_array=True),
        Field("box3d", _EIGHT, float, (8, 3), "m", "world", is_array=True),
        Field("box3d_camera", _EIGHT, float, (8, 3), "m", "camera", is_array=True),
        Field("box3d_pixels", f"{_EIGHT}; NaN where the lens does not show one", float, (8, 2), "px", "image", is_array=True),
        Field("box3d_in_front", "whether a vertex is in front of the camera", bool, (8,), is_array=True),
    ),
    prove=_prove,
    drawing=Drawing("boxes3d", lines=_draw),
)
