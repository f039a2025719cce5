"""Lines of Virtual KITTI's texts."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere.formats.vkitti.names import Names, object_colors
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.rotation import product
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.model.sensors.camera import Camera

Float = NDArray[np.float64]

MATRIX = "r1,1 r1,2 r1,3 t1 r2,1 r2,2 r2,3 t2 r3,1 r3,2 r3,3 t3"
TURNS = "rotation_{0}_space_y rotation_{0}_space_x rotation_{0}_space_z"
HEADS = {
    "extrinsicsgt": f"frame {MATRIX} 0 0.1 0.2 1",
    "motgt": "frame tid label truncated occluded alpha l t r b w3d h3d l3d x3d y3d z3d ry rx rz truncr occupr orig_label "
    "moving model color",
    "extrinsic": f"frame cameraID {MATRIX} 0 0 0 1",
    "intrinsic": "frame cameraID K[0,0] K[1,1] K[0,2] K[1,2]",
    "bbox": "frame cameraID trackID left right top bottom number_pixels truncation_ratio occupancy_ratio isMoving",
    "pose": "frame cameraID trackID alpha width height length world_space_X world_space_Y world_space_Z "
    f"{TURNS.format('world')} camera_space_X camera_space_Y camera_space_Z {TURNS.format('camera')}",
    "info": "trackID label model color",
}
"""The names of the columns of each text."""

OURS = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
"""The rotation from the world with y down to the world with z up."""

UPRIGHT = np.array([[-1.0, 0, 0], [0, 0, -1], [0, -1, 0]])
"""The rotation from an object's axes x right, y down, z ahead to its model's axes."""

STILL = 1e-9
"""Greatest speed of an object that counts as not moving, metres or radians per second."""

UNKNOWN = "Unknown"


class _Stand(NamedTuple):
    """The position and rotation of a box: the middle of its bottom, then rotation about y, x and z, radians."""

    place: tuple[float, float, float]
    turns: tuple[float, float, float]


def line(*values: object) -> bytes:
    """A line of words and numbers."""
    return (" ".join(str(value + 0.0) if isinstance(value, float) else str(value) for value in values) + "\n").encode()


def extrinsics(camera: Camera) -> list[float]:
    """The matrix (4, 4) from the world, y down, to the camera, row by row."""
    return [*np.column_stack((product(camera.R, OURS), camera.t)).ravel().tolist(), 0, 0, 0, 1]


def _stand(axes: Float, bottom: Float) -> _Stand:
    """Return the position and rotation of an object in axes whose y points down; `axes` transforms from its model's axes to
    these.
    """
    turned = product(axes, UPRIGHT)
    x = math.asin(max(-1.0, min(1.0, -float(turned[1, 2]))))
    y = math.remainder(math.atan2(turned[0, 2], turned[2, 2]) - math.pi / 2, 2 * math.pi)
    place = bottom.mean(axis=0).tolist()
    return _Stand((place[0], place[1], place[2]), (y, x, math.atan2(turned[1, 0], turned[1, 1])))


def _in_camera(o: ObjectAnnotation) -> _Stand:
    """Return the position and rotation of an object in the camera's axes."""
    return _stand(o.camera_from_object[:3, :3], Box3d(o.box3d_camera).faces["bottom"])


def _in_world(o: ObjectAnnotation) -> _Stand:
    """Return the position and rotation of an object in the world whose y points down."""
    return _stand(product(OURS.T, o.world_from_object[:3, :3]), product(Box3d(o.box3d).faces["bottom"], OURS))


def _alpha(where: _Stand) -> float:
    """The angle at which the camera sees an object, radians in [-pi, pi]."""
    return math.remainder(where.turns[0] - math.atan2(where.place[0], where.place[2]), 2 * math.pi)


def _seen(sample: Sample) -> Iterator[tuple[ObjectAnnotation, tuple[int, int, int, int], float]]:
    """The visible objects: first and last column, first and last row, and the visible share of this box."""
    for o in sample.objects:
        if o.box2d is not None:
            x0, y0, x1, y1 = map(round, o.box2d)
            yield o, (x0, x1 - 1, y0, y1 - 1), o.area / ((x1 - x0) * (y1 - y0))


def _moves(o: ObjectAnnotation) -> bool:
    """Return whether an object moves in the world."""
    speeds = (o.velocity, o.angular_velocity)
    return any(speed is not None and float(np.abs(speed).max()) > STILL for speed in speeds)


def texts(sample: Sample, camera: int) -> dict[str, bytes]:
    """Return the lines that a frame adds to version 2's texts, except `info` and `colors`."""
    k, at = sample.camera.intrinsics, (sample.instant, camera)
    found = {
        "intrinsic": line(*at, k.fx, k.fy, k.cx - 0.5, k.cy - 0.5),
        "extrinsic": line(*at, *extrinsics(sample.camera)),
        "bbox": b"",
        "pose": b"",
        "info": b"",
    }
    for o, box, share in _seen(sample):
        here, there = _in_camera(o), _in_world(o)
        found["bbox"] += line(*at, o.id - 1, *box, o.area, o.truncation, share, _moves(o))
        found["pose"] += line(*at, o.id - 1, _alpha(here), *o.size, *there.place, *there.turns, *here.place, *here.turns)
    return found


def tracked(sample: Sample, names: Names) -> bytes:
    """Return the lines that a frame adds to version 1.3.1's tracks."""
    rows = b""
    for o, (left, right, top, bottom), share in _seen(sample):
        here, name = _in_camera(o), names.things[o.category]
        levels = (o.truncation > 0) + (o.truncation > 0.5), o.occlusion_level
        box = (_alpha(here), left, top, right, bottom, *o.size, *here.place, *here.turns)
        told = (o.truncation, share, name, int(_moves(o)), *_looks(o))
        rows += line(sample.instant, o.id - 1, name, *levels, *box, *told)
    return rows


def _looks(o: ObjectAnnotation) -> tuple[str, str]:
    """The names of an object's model and of its colour, each a word."""
    model, color = o.track or o.key, o.extra.get("color")
    return _word(model), _word(color or UNKNOWN)


def _word(text: str) -> str:
    """A text without spaces."""
    return "_".join(text.split()) or UNKNOWN


def infos(sample: Sample, names: Names) -> Iterator[str]:
    """Yield the model and the colour of each object of a sequence, visible or not, after a mark; the export writes each text
    once.
    """
    for o in sample.objects:
        yield f"={o.id - 1} {names.things[o.category]} {' '.join(_looks(o))}"


def encodings(sample: Sample, names: Names) -> Iterator[str]:
    """The colour of each object, after a mark."""
    for o in sample.objects:
        r, g, b = object_colors()[o.id].tolist()
        yield f"={names.things[o.category]}:{o.id - 1} {r} {g} {b}"


def track(told: str) -> int:
    """The track id of an object's record, -1 for a record without an object."""
    first = told[1:].partition(" ")[0]
    return int(first.rpartition(":")[2]) if told else -1
