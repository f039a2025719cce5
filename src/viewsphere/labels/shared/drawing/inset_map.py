"""A small map in a corner of a picture: cameras from above, with the viewing direction of the picture's camera at the top."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared.drawing.colors import Color
from viewsphere.labels.shared.drawing.scan_map import SKY, round_length
from viewsphere.model.sample import Sample

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

OWN, PREVIOUS, NEXT = (255, 255, 255), (240, 170, 40), (20, 170, 180)
FAINT, WORDS = (92, 98, 112), (170, 176, 188)
SHARE, LEAST = 0.4, 56
"""The map's side as a share of the picture's shorter side, and its minimum in pixels."""

STILL = 1e-6
"""Distance in metres below which two cameras count as being at the same place."""

Placed = tuple[NDArray[np.float64], Color]
"""A camera's pose (4, 4), from its axes to the axes of the picture's own camera, and its colour."""


def inset(
    pen: ImageDraw,
    sample: Sample,
    scale: float,
    poses: Sequence[Placed],
    words: str = "",
    *,
    at_right: bool = False,
    path: bool = False,
) -> None:
    """The map, with a circle at a round distance and words above; `path`: a line from each camera to the next."""
    width, height = sample.width * scale, sample.height * scale
    side = min(max(LEAST, SHARE * min(width, height)), width, height)
    left, top = (width - side if at_right else 0.0), height - side
    pen.rectangle((left, top, left + side, height), fill=(*SKY, 200))
    center = np.array([left + side / 2, top + side / 2])
    places = [pose[[0, 2], 3] for pose, _ in poses]
    reach = max(float(np.linalg.norm(place)) for place in places)
    zoom = 0.0 if reach < STILL else 0.3 * side / reach
    if zoom:
        _circle(pen, center, round_length(reach), zoom)
    at = [center + zoom * place * (1, -1) for place in places]
    if path:
        pen.line([tuple(place.tolist()) for place in at], fill=FAINT, width=1)
    for place, (pose, color) in zip(at, poses, strict=True):
        _camera(pen, place, pose, side / 7, color)
    pen.text((left + 3, top + 1), words, fill=OWN)


def _circle(pen: ImageDraw, center: NDArray[np.float64], radius: float, zoom: float) -> None:
    (x, y), r = center.tolist(), radius * zoom
    pen.ellipse((x - r, y - r, x + r, y + r), outline=FAINT)
    pen.text((x, y + r), f"{radius:g} m", fill=WORDS, anchor="mt")


def _camera(pen: ImageDraw, place: NDArray[np.float64], pose: NDArray[np.float64], length: float, color: Color) -> None:
    """A wedge that opens in the camera's viewing direction."""
    ahead, aside = (pose[[0, 2], axis] * (1, -1) for axis in (2, 0))
    ends = [tuple((place + length * (ahead + 0.5 * turn * aside)).tolist()) for turn in (-1, 1)]
    x, y = place.tolist()
    pen.polygon([(x, y), *ends], outline=color)
    pen.ellipse((x - 2, y - 2, x + 2, y + 2), fill=color)
