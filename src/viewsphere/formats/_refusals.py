"""What several formats cannot hold, for their `refuses`."""

from __future__ import annotations

import re
from collections.abc import Iterator

from viewsphere.formats import Scope


def one_sensor(scope: Scope) -> Iterator[str]:
    """Of a format whose pictures have no names of sensors."""
    if scope.rig is not None and len(scope.rig.sensors) > 1:
        yield f"expected one sensor; found {', '.join(sensor.name for sensor in scope.rig.sensors)}"


def sequences(scope: Scope) -> Iterator[str]:
    """Of a format of videos."""
    if not scope.is_moving:
        yield "expected sequences (a recipe's time); found still pictures"


def stereo(scope: Scope) -> Iterator[str]:
    """Of a format of rectified pairs."""
    if scope.rig is None or not scope.rig.rectified:
        found = "none" if scope.rig is None else ", ".join(sensor.name for sensor in scope.rig.sensors)
        yield f"expected two rectified cameras (rig: {{kind: stereo, baseline: 0.1}}); found {found}"


def pinhole(scope: Scope) -> Iterator[str]:
    """Of a format without lens distortion."""
    for sensor in () if scope.rig is None else scope.rig.sensors:
        if sensor.lidar is None and sensor.intrinsics.distortion is not None:
            yield f"expected pinhole cameras; found the lens of {sensor.name}"


def most_objects(scope: Scope, most: int) -> Iterator[str]:
    """Of a format whose numbers of objects end."""
    if scope.most_objects > most:
        yield f"expected at most {most:,} objects in a picture; found {scope.most_objects:,}"


def most_categories(scope: Scope, most: int) -> Iterator[str]:
    """Of a format whose numbers of categories end."""
    if len(scope.categories) > most:
        yield f"expected at most {most:,} categories; found {len(scope.categories):,}"


def plain_names(scope: Scope, allowed: str = r"[^\s]+") -> Iterator[str]:
    """Of a format that ends names at spaces, or knows fewer characters: names of categories have to match `allowed` whole."""
    for category in scope.categories:
        if not re.fullmatch(allowed, category.name):
            yield f"expected names of categories that match {allowed}; found {category.name!r}"


def no_skew(scope: Scope) -> Iterator[str]:
    """Of a format whose camera matrices are two focal lengths and a principal point."""
    for sensor in () if scope.rig is None else scope.rig.sensors:
        if sensor.lidar is None and sensor.intrinsics.skew != 0:
            yield f"expected cameras without skew; found {sensor.intrinsics.skew:g} of {sensor.name}"


def centred(scope: Scope) -> Iterator[str]:
    """Of a format whose cameras are an angle of view: pixels are square, and the axis meets the middle of the picture."""
    for sensor in () if scope.rig is None else scope.rig.sensors:
        k = sensor.intrinsics
        if sensor.lidar is None and ((k.cx, k.cy) != (k.width / 2, k.height / 2) or k.fx != k.fy or k.skew):
            yield f"expected square pixels and a principal point in the picture's middle; found others of {sensor.name}"
