"""All annotations of a frame's objects."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.annotate.fractions import visible_and_cut
from viewsphere.annotate.view import view_of
from viewsphere.geometry.box import Bounds, box_size, clip_to_image, projected_bounds
from viewsphere.geometry.camera import project
from viewsphere.geometry.mask import rle_of_id
from viewsphere.geometry.pose_category import pose_category
from viewsphere.geometry.rotation import compose, quaternion_from_matrix, rigid, transform
from viewsphere.model.camera import Camera
from viewsphere.model.model_spec import ModelSpec, Size
from viewsphere.model.sample import Box, ObjectAnnotation, Rle
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing
from viewsphere.truth.geometry import Geometry
from viewsphere.truth.visibility import Visibility

Float = NDArray[np.float64]


def annotate(
    shot: Shot,
    instant: int,
    camera: Camera,
    geometry: Geometry,
    visibility: Visibility,
    boxes: Sequence[Float],
    models: Sequence[str],
    real_sizes: Sequence[Size | None] | None = None,
) -> tuple[ObjectAnnotation, ...]:
    """Annotations of all objects (things of an id) that are there at an instant (counted from 0 in the shot), seen or not, in
    the order of their ids.

    `boxes[i]` is the 3D box (8, 3) of object i + 1's model in the object's axes, `models[i]` the path of that model in the data
    set and `real_sizes[i]` its true size (by default the one its spec gives in numbers); `geometry` is the shot's stage and
    `visibility` what this camera sees of it. An object that covers no pixel has an empty mask, no `box2d` and visibility 0.
    """
    count, things = geometry.object_count, [thing for thing in shot.things_at(instant) if thing.id]
    if not len(things) == len(boxes) == len(models) == count:
        raise ValueError(
            f"annotate: shot {shot.key}: expected {count} objects, boxes and models, "
            f"got {len(things)}, {len(boxes)}, {len(models)}"
        )
    seen = visibility.instances(geometry)
    parts = pairwise(geometry.triangle_start[: count + 1])
    points = pairwise(geometry.vertex_start[: count + 1])
    projections = [
        projected_bounds(camera, geometry.vertices, geometry.triangles, part, corners, geometry.is_used)
        for part, corners in zip(parts, points, strict=True)
    ]
    bounds, whole = [b for b, _ in projections], [w for _, w in projections]
    annotations: list[ObjectAnnotation] = []
    for i, thing in enumerate(things):
        if not thing.is_there:
            continue
        area = int(seen.area[i + 1])
        x0, y0, x1, y1 = seen.box[i + 1].tolist() if area else (0, 0, 0, 0)
        visible, truncated = visible_and_cut(geometry, camera, i + 1, area, bounds, whole)
        annotations.append(
            ObjectAnnotation(
                id=thing.id,
                category=thing.model.category,
                supercategory=thing.model.supercategory,
                category_id=thing.model.category_id,
                key=thing.model.key,
                model=models[i],
                real_size=real_sizes[i] if real_sizes else _real_size(thing.model),
                rle=Rle(camera.height, camera.width, rle_of_id(seen.ids, i + 1, (x0, y0, x1, y1))),
                area=area,
                track=thing.model.track,
                visibility=visible,
                truncation=truncated,
                **_flat_boxes(camera, (float(x0), float(y0), float(x1), float(y1)), bounds[i], whole[i]),
                **_placed(camera, thing, boxes[i], shot.category_deg),
            )
        )
    return tuple(annotations)


def _real_size(spec: ModelSpec) -> Size | None:
    return None if isinstance(spec.real_size, str) else spec.real_size


def _flat_boxes(camera: Camera, tight: Box, bounds: Bounds | None, whole: bool) -> dict[str, Any]:
    """The three 2D boxes; where the lens shows only a part of the model, its visible pixels count too."""
    box2d = tight if tight[2] > tight[0] else None
    projected = bounds and clip_to_image(bounds, camera.width, camera.height)
    if box2d and not whole:
        a, b = projected or box2d, box2d
        projected = min(a[0], b[0]), min(a[1], b[1]), max(a[2], b[2]), max(a[3], b[3])
    return {"box2d": box2d, "box2d_projected": projected, "box2d_unclipped": bounds if whole else None}


def _placed(camera: Camera, thing: Thing, box: Float, category_deg: float) -> dict[str, Any]:
    """The 3D box in every frame of reference, the pose, and the view of one object."""
    world_from_object = np.array(thing.world_from_object, np.float64)
    camera_from_world = rigid(camera.R, camera.t)
    camera_from_object = compose(camera_from_world, world_from_object)
    in_world = transform(world_from_object, box)
    in_camera = transform(camera_from_world, in_world)
    pixels, in_front = project(camera.intrinsics, in_camera)
    view = view_of(camera_from_object, (box[2] + box[4]) / 2)
    return {
        "box3d_object": np.array(box, np.float64),
        "box3d": in_world,
        "box3d_camera": in_camera,
        "box3d_pixels": pixels,
        "box3d_in_front": in_front,
        "world_from_object": world_from_object,
        "camera_from_object": camera_from_object,
        "quaternion": quaternion_from_matrix(camera_from_object[:3, :3]),
        "view": view,
        "pose_category": pose_category(view.azimuth_deg, view.elevation_deg, category_deg),
        "size": box_size(box),
    }
