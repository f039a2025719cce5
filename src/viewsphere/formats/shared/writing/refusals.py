"""The limits that several formats share, for their `refuses`."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence

from viewsphere.formats import Scope
from viewsphere.model.channel import MOSAIC, missing, picture_of
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.camera import Intrinsics


def lenses(scope: Scope) -> Iterator[tuple[str, Intrinsics]]:
    """The lens of each camera by its sensor's name: from the rig or, if that is unknown, from pictures."""
    if scope.rig is not None:
        yield from ((sensor.name, sensor.intrinsics) for sensor in scope.rig.sensors if sensor.lidar is None)
    for sample in scope.pictures:
        if sample.known_camera is not None and not sample.known_camera.lens.is_scan:
            yield sample.sensor, sample.known_camera.intrinsics


def one_sensor(scope: Scope) -> Iterator[str]:
    """Reasons to refuse, for a format without sensor names in its pictures."""
    if scope.rig is not None and len(scope.rig.sensors) > 1:
        yield f"expected one sensor; found {', '.join(sensor.name for sensor in scope.rig.sensors)}"


def lacking_labels(scope: Scope, names: Sequence[str]) -> Iterator[str]:
    """Reasons to refuse, for a format made of these labels: pictures whose shots are not stored, so that no label can be
    computed.
    """
    lacking = missing(names, {*scope.channels, *scope.annotations}) if scope.pictures else ()
    if lacking:
        kept = ", ".join((*scope.channels, *scope.annotations)) or "none"
        yield f"expected {', '.join(lacking)} of all pictures; found {kept} of imported ones"


def known_cameras(scope: Scope) -> Iterator[str]:
    """Reasons to refuse, for a format that stores each picture's lens and pose."""
    if any(sample.known_camera is None for sample in scope.pictures):
        yield "expected pictures of known cameras; found imported ones"


def known_views(scope: Scope) -> Iterator[str]:
    """Reasons to refuse, for a format that stores the viewpoint of a model."""
    seen = (o.view for sample in scope.pictures for o in sample.objects)
    if any(not _has_view(sample) for sample in scope.pictures) or any(math.isnan(view.distance) for view in seen):
        yield "expected pictures of known cameras and viewpoints; found imported ones"


def any_camera(scope: Scope) -> Iterator[str]:
    """Reasons to refuse, for a format that leaves out pictures of unknown cameras: the data set has no other pictures."""
    if scope.pictures and all(sample.known_camera is None for sample in scope.pictures):
        yield from known_cameras(scope)


def any_view(scope: Scope) -> Iterator[str]:
    """Reasons to refuse, for a format that leaves out pictures of unknown viewpoints: the data set has no other pictures."""
    if scope.pictures and not any(map(_has_view, scope.pictures)):
        yield from known_views(scope)


def _has_view(sample: Sample) -> bool:
    return sample.known_camera is not None and sample.known_pose is not None


def sequences(scope: Scope) -> Iterator[str]:
    """Reasons to refuse, for a format of videos."""
    if not scope.is_moving:
        found = "imported pictures, of which nobody knows when they were taken" if scope.pictures else "still pictures"
        yield f"expected sequences (a recipe's time); found {found}"


def no_lone_mosaic(scope: Scope) -> Iterator[str]:
    """Reasons to refuse, for a format that takes the pictures that are there, but no digital numbers of an imager: a camera has
    nothing else.
    """
    sensors = scope.rig.sensors if scope.rig is not None else ()
    for kept in [sensor.kept_channels(scope.channels) for sensor in sensors] or [scope.channels]:
        if MOSAIC in kept and picture_of(kept) is None:
            yield f"expected colours; found {MOSAIC} alone: add rgb to channels, beside {MOSAIC}"
            return


def stereo(scope: Scope) -> Iterator[str]:
    """Reasons to refuse, for a format of rectified pairs."""
    if scope.rig is None or not scope.rig.rectified:
        found = "none" if scope.rig is None else ", ".join(sensor.name for sensor in scope.rig.sensors)
        yield f"expected two rectified cameras (rig: {{kind: stereo, baseline: 0.1}}); found {found}"


def central(scope: Scope) -> Iterator[str]:
    """Reasons to refuse, for a format whose cameras have a centre through which all rays pass."""
    for name, lens in lenses(scope):
        if lens.lens.is_parallel:
            yield f"expected cameras whose rays pass through one centre; found {lens.lens.name} of {name}"


def global_shutter(scope: Scope) -> Iterator[str]:
    """Reasons to refuse, for a format with one pose for all rows of a picture."""
    for name, lens in lenses(scope):
        if lens.rolling is not None:
            yield f"expected cameras with one pose for all rows of a picture; found the rolling shutter of {name}"


def pinhole(scope: Scope) -> Iterator[str]:
    """Reasons to refuse, for a format without lens distortion."""
    for name, lens in lenses(scope):
        if not lens.lens.is_linear:
            yield f"expected pinhole cameras; found the lens of {name}"


def depth_lenses(scope: Scope) -> Iterator[str]:
    """Reasons to refuse, for a format without panoramas."""
    for name, lens in lenses(scope):
        if not lens.lens.has_depth:
            yield f"expected lenses with z-depth; found the panorama ({lens.lens.name}) of {name}"


def opencv_lenses(scope: Scope) -> Iterator[str]:
    """Reasons to refuse, for a format with only OpenCV's lens models."""
    for name, lens in lenses(scope):
        if lens.lens.opencv is None:
            yield f"expected lenses of OpenCV's models; found {lens.lens.name} of {name}"


def most_objects(scope: Scope, most: int) -> Iterator[str]:
    """Reasons to refuse, for a format with a limited number of objects."""
    if scope.most_objects > most:
        yield f"expected at most {most:,} objects in a picture; found {scope.most_objects:,}"


def most_categories(scope: Scope, most: int) -> Iterator[str]:
    """Reasons to refuse, for a format with a limited number of categories."""
    if len(scope.categories) > most:
        yield f"expected at most {most:,} categories; found {len(scope.categories):,}"


def plain_names(scope: Scope, allowed: str = r"\S+", told: str = "without spaces") -> Iterator[str]:
    """Reasons to refuse, for a format that ends names at spaces or allows fewer characters: each category's whole name must
    match `allowed`, which `told` describes in words.
    """
    for category in scope.categories:
        if not re.fullmatch(allowed, category.name):
            yield f"expected names of categories {told}; found {category.name!r}"


def no_skew(scope: Scope) -> Iterator[str]:
    """Reasons to refuse, for a format whose camera matrices have two focal lengths and a principal point."""
    for name, lens in lenses(scope):
        if lens.skew:
            yield f"expected cameras without skew; found {lens.skew:g} of {name}"


def centred(scope: Scope) -> Iterator[str]:
    """Reasons to refuse, for a format that describes cameras by an angle of view: pixels must be square, and the axis must
    meet the middle of the picture.
    """
    for name, k in lenses(scope):
        if (k.cx, k.cy) != (k.width / 2, k.height / 2) or k.fx != k.fy or k.skew:
            yield f"expected square pixels and a principal point in the picture's middle; found others of {name}"
