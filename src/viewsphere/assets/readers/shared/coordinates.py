"""Coordinates of a file's vertices: a face with a NaN or infinite coordinate is refused, by the same rule in every format."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.paths.folder import ModelFolder

GREATEST = 1e30
"""Larger coordinates count as infinite, because their squares are infinite in float32."""


def check_coordinates(
    folder: ModelFolder,
    positions: NDArray[np.float64],
    used: NDArray[np.integer],
    where: str = "",
    *,
    line_of: Callable[[int], int] | None = None,
    corners: int = 0,
) -> None:
    """Raise ModelError if a vertex in `used`, the indices in faces, has a NaN or infinite coordinate; the message names the
    first one.

    Vertices without a face may have any coordinates: organised scans mark missing points by NaN. `where` begins the message;
    `line_of` returns the line of a vertex in the file. In formats without shared vertices, `corners` is the number per face,
    and the message names the face.
    """
    if not positions.size or (positions.min() > -GREATEST and positions.max() < GREATEST):  # both are NaN if any number is
        return
    named = used.reshape(-1)
    wrong = named[np.any(~(np.abs(positions[named]) < GREATEST), axis=1)]
    if not wrong.size:
        return
    row = int(wrong.min())
    name, number, total = (
        ("triangle", row // corners, len(positions) // corners) if corners else ("vertex", row, len(positions))
    )
    values = " ".join(f"{value:g}" for value in positions[row].tolist())
    text = f"{where}{name} {number + 1:,} of {total:,} has a NaN or infinite coordinate ({values}); export the model again"
    raise folder.error(text, None if line_of is None else line_of(row))
