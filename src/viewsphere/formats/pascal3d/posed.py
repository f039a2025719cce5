"""The poses of PASCAL3D+'s objects in their cameras."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from viewsphere.formats.pascal3d.records import Float, Seen
from viewsphere.geometry.camera import orbit_center, orbit_rotation
from viewsphere.geometry.rotation import rigid, transform
from viewsphere.model.sensors.camera import Intrinsics


@dataclass(frozen=True)
class Posed:
    """An object of a picture: its category, the number of its CAD model from 1, the lens that shows it, pixels from the corner,
    and its pose in the camera (4, 4), in the CAD model's unit.
    """

    category: str
    cad: int
    lens: Intrinsics
    camera_from_object: Float


def posed(objects: Iterable[Seen], own: Intrinsics | None, size: tuple[int, int]) -> Iterator[Posed]:
    """The objects with a known exact viewpoint and model. `own`: the lens of a picture that gives K."""
    for seen in objects:
        if seen.cad and own is not None and seen.motion is not None:
            yield Posed(seen.kind, seen.cad, own, rigid(seen.motion[:, :3], seen.motion[:, 3]))
        elif seen.cad and seen.is_fine:
            yield _by_viewpoint(seen, *size)


def pinhole(k: Float, size: tuple[int, int]) -> Intrinsics:
    """The lens of K (3, 3), for a picture of this width and height."""
    (fx, skew, cx), (_, fy, cy), _ = k.tolist()
    return Intrinsics(width=size[0], height=size[1], fx=fx, fy=fy, cx=cx, cy=cy, skew=skew)


def _by_viewpoint(seen: Seen, width: int, height: int) -> Posed:
    """An object by the format's own projection, with the principal point at the object's origin in the picture."""
    view = seen.view
    focal = view["viewport"] * view["focal"]
    lens = Intrinsics(width=width, height=height, fx=focal, fy=focal, cx=view["px"] - 0.5, cy=view["py"] - 0.5)
    a, e, t = (math.radians(view[name]) for name in ("azimuth", "elevation", "theta"))
    rotation = orbit_rotation(a, e, t)
    return Posed(seen.kind, seen.cad, lens, rigid(rotation, -transform(rotation, orbit_center(a, e, view["distance"]))))
