"""Lines of KITTI's labels, and its calibrations, from other sources."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from viewsphere.formats.shared.reading.image_lists import MISTAKES, one_line, text_of
from viewsphere.geometry.rotation import inverse, transform
from viewsphere.limits import limits
from viewsphere.model.sample import Box
from viewsphere.model.sensors.camera import Camera, Intrinsics

LEVEL = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
"""The rotation to the axes of KITTI's reference camera, from a world with z up in which this camera is the origin and looks
along y.
"""

FARTHEST = 1e6
"""Limit of all numbers of a label, pixels or metres."""

SHORTEST = 1e-3
"""Least focal length, pixels."""

Number = TypeVar("Number", int, float)
MOST_TRACKS = 10**6
"""Largest number of a frame or track in an imported file; larger ones are mistakes."""
COLUMNS = 15
"""Columns of an object's line, without a score."""
DONT_CARE_TYPE = "DontCare"


@dataclass(frozen=True)
class Row:
    """A line: its track (None in files of pictures); its numbers in `said`; its half-open box; its 3D box as height, width,
    length, the middle of its bottom and its turn about y (metres, radians), None if it has no 3D box.
    """

    kind: str
    track: int | None
    box: Box
    solid: tuple[float, ...] | None
    said: Mapping[str, float | int]

    @property
    def is_region(self) -> bool:
        """Return whether the line is a region that evaluations leave out."""
        return self.kind == DONT_CARE_TYPE


@dataclass(frozen=True)
class Labels:
    """A file's lines by frame (frame 0 in the file of a picture), the problems of invalid lines, and the reason why the file
    is unusable.
    """

    rows: Mapping[int, Sequence[Row]] = field(default_factory=dict[int, Sequence[Row]])
    problems: tuple[str, ...] = ()
    unusable: str = ""


def read_labels(file: Path, is_tracked: bool) -> Labels:
    """The lines of a file."""
    try:
        texts = text_of(file)
    except MISTAKES as error:
        return Labels(unusable=f"expected lines of labels in {file.name}; found: {one_line(error)}")
    rows: defaultdict[int, list[Row]] = defaultdict(list)
    problems, tracks = list[str](), set[tuple[int, int | None]]()
    for number, text in enumerate(texts, 1):
        if text.strip():
            try:
                frame, row = _parsed(text.split(), is_tracked)
                if is_tracked and not row.is_region and (frame, row.track) in tracks:
                    raise ValueError(f"expected every track once in a frame; found {row.track} again")
                tracks.add((frame, row.track))
                rows[frame].append(row)
            except ValueError as error:
                problems.append(f"{file}: line {number}: {error}")
    if (most := max(map(len, rows.values()), default=0)) > limits.MAX_IMPORTED_OBJECTS:
        told = f"{limits.MAX_IMPORTED_OBJECTS:,} objects in a picture (limit MAX_IMPORTED_OBJECTS)"
        return Labels(unusable=f"expected at most {told} in {file.name}; found {most:,}")
    return Labels(rows, tuple(problems))


def _parsed(words: Sequence[str], is_tracked: bool) -> tuple[int, Row]:
    """The frame and the row of a line's words. Raises ValueError for impossible words."""
    begins = 2 if is_tracked else 0
    if len(words) - begins not in (COLUMNS, COLUMNS + 1):
        raise ValueError(f"expected {COLUMNS + begins} values, or one more; found {len(words)}")
    frame, track = (_number(word, int) for word in words[:2]) if is_tracked else (0, None)
    if not 0 <= frame < MOST_TRACKS or (track is not None and not -1 <= track < MOST_TRACKS):
        raise ValueError(f"expected numbers of a frame and a track; found {words[0]:.20} {words[1]:.20}")
    kind, values = words[begins], [_number(word, float) for word in words[begins + 1 :]]
    if not all(abs(value) < FARTHEST for value in values):
        raise ValueError(f"expected finite numbers below {FARTHEST:,.0f}; found {' '.join(words[begins + 1 :]):.60}")
    outside, hidden, alpha, x0, y0, x1, y1 = values[:7]
    if kind != DONT_CARE_TYPE and track is not None and track < 0:
        raise ValueError(f"expected a track; found {track} of a {kind:.40}")
    if not (outside in (-1, 0, 1, 2) if is_tracked else outside == -1 or 0 <= outside <= 1):
        raise ValueError(f"expected truncated {'-1 to 2' if is_tracked else '-1, or 0 to 1'}; found {outside:g}")
    if hidden not in (-1, 0, 1, 2, 3):
        raise ValueError(f"expected occluded -1 to 3; found {hidden:g}")
    if not (x0 <= x1 and y0 <= y1):
        raise ValueError(f"expected left <= right, top <= bottom; found {x0:g} {y0:g} {x1:g} {y1:g}")
    said = {"truncated": outside, "occluded": int(hidden), "alpha": alpha}
    if len(words) - begins > COLUMNS:
        said["score"] = values[14]
    if track is not None:
        said["track_id"] = track
    return frame, Row(kind, track, (x0, y0, x1 + 1, y1 + 1), _solid(values[7:14]), said)


def _number(word: str, kind: Callable[[str], Number]) -> Number:
    try:
        return kind(word)
    except ValueError:
        raise ValueError(f"expected a number; found {word!r:.60}") from None


def _solid(values: Sequence[float]) -> tuple[float, ...] | None:
    """A 3D box; None if all its sides are -1, the value for an unknown box."""
    if all(side <= 0 for side in values[:3]):
        return None
    if not all(side > 0 for side in values[:3]):
        raise ValueError(f"expected height, width and length above 0; found {' '.join(f'{side:g}' for side in values[:3])}")
    return tuple(values)


def read_camera(file: Path, size: tuple[int, int]) -> Camera:
    """The left colour camera of a calibration; raises ValueError for a P2 that is not a pinhole's."""
    words = next((line.split() for line in text_of(file) if line.startswith(("P2:", "P2 "))), [])
    try:
        found = np.array(words[1:], np.float64)
    except ValueError:
        found = np.zeros(0)
    if found.shape != (12,) or not (np.abs(found) < FARTHEST**2).all() or not _is_pinhole(found.reshape(3, 4)):
        raise ValueError(f"expected P2 of a pinhole, 12 numbers, in {file.name}; found {' '.join(words):.60}")
    k = found.reshape(3, 4)
    (fx, skew, cx, _), (_, fy, cy, _), _ = k.tolist()
    lens = Intrinsics(width=size[0], height=size[1], fx=fx, fy=fy, cx=cx + 0.5, cy=cy + 0.5, skew=skew)
    shift = transform(inverse(np.ascontiguousarray(k[:, :3])), k[:, 3]) + 0.0
    if not (np.abs(shift) < FARTHEST).all():
        raise ValueError(f"expected P2 of a camera near the reference camera in {file.name}; found {' '.join(words):.60}")
    return Camera(lens, LEVEL, shift)


def _is_pinhole(projection: NDArray[np.float64]) -> bool:
    """Return whether the left three columns are K of a pinhole with focal lengths of at least `SHORTEST`."""
    k = projection[:, :3]
    return bool(min(k[0, 0], k[1, 1]) >= SHORTEST and k[1, 0] == 0 and (k[2] == (0, 0, 1)).all())
