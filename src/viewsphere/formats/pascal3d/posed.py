"""Objects of PASCAL3D+'s records as cameras see them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from viewsphere.formats.pascal3d.records import Float, Record, Seen
from viewsphere.geometry.camera import orbit_center, orbit_rotation
from viewsphere.geometry.rotation import rigid, transform
from viewsphere.model.camera import Intrinsics


@dataclass(frozen=True)
class Posed:
    """An object of a picture: its category, the number of its CAD model from 1, the lens that shows it, pixels from the corner,
    and its pose in the camera (4, 4), in the CAD model's unit.
    """

    category: str
    cad: int
    lens: Intrinsics
    camera_from_object: Float


def posed(record: Record) -> Iterator[Posed]:
    """The objects of which the exact viewpoint and the model are known. Raises ValueError for a record without a size."""
    if record.size is None:
        raise ValueError("expected imgsize width height; found none")
    width, height = record.size
    own = None
    if record.lens is not None:
        k = record.lens
        own = Intrinsics(width=width, height=height, fx=k[0, 0], fy=k[1, 1], cx=k[0, 2], cy=k[1, 2], skew=k[0, 1])
    for seen in record.objects:
        if seen.cad and own is not None and seen.motion is not None:
            yield Posed(seen.kind, seen.cad, own, rigid(seen.motion[:, :3], seen.motion[:, 3]))
        elif seen.cad and seen.is_fine:
            yield _by_viewpoint(seen, width, height)


def _by_viewpoint(seen: Seen, width: int, height: int) -> Posed:
    """An object by the format's own projection, whose principal point is where the object's origin is seen."""
    view = seen.view
    focal = view["viewport"] * view["focal"]
    lens = Intrinsics(width=width, height=height, fx=focal, fy=focal, cx=view["px"] - 0.5, cy=view["py"] - 0.5)
    a, e, t = (math.radians(view[name]) for name in ("azimuth", "elevation", "theta"))
    rotation = orbit_rotation(a, e, t)
    return Posed(seen.kind, seen.cad, lens, rigid(rotation, -transform(rotation, orbit_center(a, e, view["distance"]))))
