"""Proofs of one frame: each yields a message for whatever is wrong."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import ViewsphereError
from viewsphere.geometry.box import box_size, clip_to_image
from viewsphere.geometry.camera import orbit_center, orbit_rotation, project
from viewsphere.geometry.mask import mask_box, mask_polygons
from viewsphere.geometry.rotation import matrix_from_quaternion, rigid, transform
from viewsphere.model.channel import CHANNELS
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.store import ModelInfo

Proof = Callable[[Sample, Mapping[str, ModelInfo]], Iterator[str]]

PIXEL_TOLERANCE = 1e-6
METRE_TOLERANCE = 1e-9
ANGLE_TOLERANCE = 1e-6


def files(sample: Sample, models: Mapping[str, ModelInfo]) -> Iterator[str]:
    """Every channel's file is there and holds an array of the image's size, with ids and directions that can be."""
    height, width = sample.height, sample.width
    for name, file in sample.files.items():
        try:
            array = sample.channels[name]
        except ViewsphereError as error:
            yield str(error)
            continue
        channel = CHANNELS[name]
        if array.shape != channel.shape(height, width) or array.dtype != channel.dtype:
            wanted = f"{channel.shape(height, width)} {np.dtype(channel.dtype)}"
            yield f"{file}: expected {wanted}, found {array.shape} {array.dtype}"
        elif name == "depth" and np.isnan(array).any():
            yield f"{file}: expected metres, or infinity where nothing is seen; found NaN"


def ids(sample: Sample, models: Mapping[str, ModelInfo]) -> Iterator[str]:
    """Objects are numbered from 1, each of a known model; the id channels hold these objects, and their categories."""
    found = [o.id for o in sample.objects]
    if found != list(range(1, len(found) + 1)):
        yield f"expected objects 1..{len(found)}, found {found}"
    for o in _rendered(sample):
        info = models.get(o.key)
        if info is None or (info.category, info.category_id) != (o.category, o.category_id):
            yield f"object {o.id}: expected a model of the data set, found {o.key!r} ({o.category})"
    instances, categories = _channel(sample, "instances"), _channel(sample, "categories")
    if instances is not None and not 0 <= instances.min() <= instances.max() <= len(found):
        yield f"instances: expected ids 0..{len(found)}, found {instances.min()}..{instances.max()}"
    elif instances is not None and categories is not None:
        by_id = np.array([0, *(o.category_id for o in sample.objects)])
        wrong = categories != by_id[instances]
        if wrong.any():
            yield f"categories: expected those of the objects seen, found others at {wrong.sum()} pixels"


def masks(sample: Sample, models: Mapping[str, ModelInfo]) -> Iterator[str]:
    """Run lengths and polygons are the stored instance map's pixels, and area and visibility agree with them."""
    from pycocotools import mask as coco

    instances = _channel(sample, "instances")
    for o in sample.objects:
        mask = o.mask
        if mask.shape != (sample.height, sample.width):
            yield f"object {o.id}: expected a mask of the image's size, found {mask.shape}"
            continue
        if instances is not None and not np.array_equal(mask, instances == o.id):
            yield f"object {o.id}: run lengths differ from the instance map at {(mask != (instances == o.id)).sum()} pixels"
        if o.source is not None and not mask.any():
            continue  # it came with a box alone
        if o.area != mask.sum():
            yield f"object {o.id}: expected area {mask.sum()}, found {o.area}"
        polygons: Any = mask_polygons(mask)
        if polygons:
            code: Any = coco.merge(coco.frPyObjects(polygons, *mask.shape))
            if not np.array_equal(coco.decode(code), mask):
                yield f"object {o.id}: polygons differ from the mask"
        shares = (o.visibility, o.truncation) if o.source is None else (1.0, 0.0)
        if not all(0 <= share <= 1 for share in shares) or (shares[0] > 0) != bool(mask.any()):
            yield f"object {o.id}: visibility {o.visibility}, truncation {o.truncation} and {mask.sum()} visible pixels"


def boxes(sample: Sample, models: Mapping[str, ModelInfo]) -> Iterator[str]:
    """`box2d` is the mask's tight box; the projected model's box holds it and lies in the 3D box's."""
    for o in _rendered(sample):
        tight = mask_box(o.mask)
        if o.box2d != tight:
            yield f"object {o.id}: expected box2d {tight}, found {o.box2d}"
        around = o.box2d_projected
        if tight and (around is None or not _within(tight, around, 1.0)):
            yield f"object {o.id}: expected the visible box in the projected one, found {tight} and {around}"
        unclipped = o.box2d_unclipped
        if unclipped and around != clip_to_image(unclipped, sample.camera.width, sample.camera.height):
            yield f"object {o.id}: expected box2d_projected to be the clipped {unclipped}, found {around}"
        if unclipped and sample.camera.distortion is None and o.box3d_in_front.all():
            x, y = o.box3d_pixels.T
            if not _within(unclipped, (x.min(), y.min(), x.max(), y.max()), 1e-3):
                yield f"object {o.id}: expected box2d_unclipped within the projected 3D box, found {unclipped}"


def projection(sample: Sample, models: Mapping[str, ModelInfo]) -> Iterator[str]:
    """The 3D boxes are the model's, moved to the world, to the camera and by P (and the lens) to pixels."""
    if sample.known_camera is None:
        return
    camera = sample.camera
    camera_from_world = rigid(camera.R, camera.t)
    if not np.allclose(camera.R @ camera.R.T, np.eye(3), atol=METRE_TOLERANCE) or np.linalg.det(camera.R) < 0:
        yield "expected a rotation R, found something else"
    for o in _rendered(sample):
        if o.key in models and not np.array_equal(o.box3d_object, models[o.key].box3d_object):
            yield f"object {o.id}: expected the 3D box of model {o.key}, found another"
        scale = 1 + float(np.abs(o.box3d_camera).max())
        expected = {
            "box3d": transform(o.world_from_object, o.box3d_object),
            "box3d_camera": transform(camera_from_world, o.box3d),
            "camera_from_object": camera_from_world @ o.world_from_object,
        }
        for name, value in expected.items():
            if not np.allclose(getattr(o, name), value, rtol=0, atol=METRE_TOLERANCE * scale):
                yield f"object {o.id}: {name} does not follow from the pose"
        if not np.allclose(box_size(o.box3d_object), o.size, rtol=0, atol=METRE_TOLERANCE * scale):
            yield f"object {o.id}: expected size {box_size(o.box3d_object)}, found {o.size}"
        turned = matrix_from_quaternion(o.quaternion)
        if not np.allclose(turned, o.camera_from_object[:3, :3], rtol=0, atol=METRE_TOLERANCE):
            yield f"object {o.id}: the quaternion is not camera_from_object's rotation"
        yield from _projected(sample, o)


def _projected(sample: Sample, o: ObjectAnnotation) -> Iterator[str]:
    """box3d_pixels against P, written out here; a distorted lens has no P, so `project` stands for it."""
    camera = sample.camera
    homogeneous = np.column_stack([o.box3d, np.ones(8)]) @ camera.P.T
    in_front = homogeneous[:, 2] > 0
    if not np.array_equal(in_front, o.box3d_in_front):
        yield f"object {o.id}: expected vertices in front {in_front.tolist()}, found {o.box3d_in_front.tolist()}"
        return
    if camera.distortion is None:
        expected = np.full((8, 2), np.nan)
        expected[in_front] = homogeneous[in_front, :2] / homogeneous[in_front, 2:]
    else:
        expected = project(camera.intrinsics, o.box3d_camera)[0]
    off = np.abs(expected - o.box3d_pixels)
    limit = PIXEL_TOLERANCE * (1 + np.abs(np.nan_to_num(expected)) / 1e4)
    if not np.array_equal(np.isnan(expected), np.isnan(o.box3d_pixels)) or (off > limit).any():
        yield f"object {o.id}: box3d_pixels is up to {np.nanmax(off, initial=0):.3g} px off P x vertex"


def poses(sample: Sample, models: Mapping[str, ModelInfo]) -> Iterator[str]:
    """The camera stands and looks as its azimuth, elevation, distance and tilt say."""
    if sample.known_pose is None or sample.known_camera is None or not all(o.is_placed for o in sample.objects):
        return
    pose, camera = sample.pose, sample.camera
    azimuth, elevation, tilt = (math.radians(a) for a in (pose.azimuth_deg, pose.elevation_deg, pose.tilt_deg))
    if not np.allclose(camera.R, orbit_rotation(azimuth, elevation, tilt), rtol=0, atol=ANGLE_TOLERANCE):
        yield f"R is not that of azimuth {pose.azimuth_deg}, elevation {pose.elevation_deg}, tilt {pose.tilt_deg}"
    target = np.array(pose.target) if pose.target else sample.objects[0].box3d.mean(axis=0)
    stands = target + orbit_center(azimuth, elevation, pose.distance)
    if not np.allclose(camera.center, stands, rtol=0, atol=ANGLE_TOLERANCE * (1 + pose.distance)):
        yield f"expected the camera at {stands.tolist()}, found it at {camera.center.tolist()}"
    for o in sample.objects:
        center = o.camera_from_object[:3, :3].T @ -o.camera_from_object[:3, 3] - o.box3d_object.mean(axis=0)
        view = o.view
        seen = orbit_center(math.radians(view.azimuth_deg), math.radians(view.elevation_deg), view.distance)
        if not np.allclose(center, seen, rtol=0, atol=ANGLE_TOLERANCE * (1 + view.distance)):
            yield f"object {o.id}: its view (azimuth {view.azimuth_deg}, ...) is not where the camera stands"


FRAME_PROOFS: dict[str, Proof] = {
    "files": files,
    "ids": ids,
    "masks": masks,
    "boxes": boxes,
    "projection": projection,
    "poses": poses,
}
"""Checks of every frame by name."""


def _rendered(sample: Sample) -> list[ObjectAnnotation]:
    """The objects that were not imported."""
    return [o for o in sample.objects if o.source is None]


def _channel(sample: Sample, name: str) -> NDArray[Any] | None:
    """A channel, None if it is not there or `files` has said that it cannot be read."""
    try:
        array = sample.channels[name]
    except (KeyError, ViewsphereError):
        return None
    return array if array.shape[:2] == (sample.height, sample.width) else None


def _within(inner: tuple[float, ...], outer: tuple[float, ...], slack: float) -> bool:
    return (
        inner[0] >= outer[0] - slack
        and inner[1] >= outer[1] - slack
        and inner[2] <= outer[2] + slack
        and inner[3] <= outer[3] + slack
    )
