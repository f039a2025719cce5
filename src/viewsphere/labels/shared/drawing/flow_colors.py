"""The usual colours of flow: its direction is the hue, its length the saturation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared.spec import Drawing

Picture = NDArray[np.uint8]
STEPS = ((15, 0, 1, 1), (6, 1, 0, -1), (4, 1, 2, 1), (11, 2, 1, -1), (13, 2, 0, 1), (6, 0, 2, -1))
"""Parts of the wheel: the number of colours, the constant component, the changing component, and whether it rises."""

DARKER = 0.75
"""Factor of colours beyond the longest flow."""


def wheel() -> NDArray[np.float64]:
    """The 55 colours of Baker et al. 2007, "A Database and Evaluation Methodology for Optical Flow", (55, 3), 0 to 255.

    They are from the paper's code, https://vision.middlebury.edu/flow/code/ (colorcode.cpp).
    """
    parts = list[NDArray[np.float64]]()
    for count, full, changing, way in STEPS:
        part = np.zeros((count, 3))
        rising = np.floor(255 * np.arange(count) / count)
        part[:, full], part[:, changing] = 255, rising if way > 0 else 255 - rising
        parts.append(part)
    return np.concatenate(parts)


MOST, NEAR = 99.0, 75.0
"""Percentages of the pixels that define the full colour: for flow in the picture, and for scene flow, which is unbounded
towards the horizon.
"""


def longest_of(flow: NDArray[np.floating], most: float = MOST) -> float:
    """The length of flow (H, W, 2) that this percentage of the pixels does not exceed; 1 without flow."""
    length = np.hypot(flow[..., 0], flow[..., 1], dtype=np.float64)
    known = length[np.isfinite(length)]
    return float(np.percentile(known, most)) if known.size else 1.0


def picture(flow: NDArray[np.floating], longest: float | None = None) -> Picture:
    """Flow (H, W, 2) as a picture (H, W, 3) uint8: white without flow, black where it is NaN.

    Flow of the length `longest` has the full colour; the default is the length that 99 % of the pixels do not exceed.
    """
    known: NDArray[np.bool_] = np.isfinite(flow[..., 0] + flow[..., 1])
    u, v = np.where(known[..., None], flow, 0.0).astype(np.float64).transpose(2, 0, 1)
    length = np.hypot(u, v)
    share = length / max(longest_of(flow) if longest is None else longest, 1e-9)
    colors = wheel() / 255
    at = (np.arctan2(-v, -u) / np.pi + 1) / 2 * (len(colors) - 1)
    first = np.floor(at).astype(np.intp)
    between = (at - first)[..., None]
    color = (1 - between) * colors[first] + between * colors[(first + 1) % len(colors)]
    color = np.where(share[..., None] <= 1, 1 - share[..., None] * (1 - color), DARKER * color)
    return np.where(known[..., None], np.floor(255 * color), 0).astype(np.uint8)


def drawing(channel: str, most: float = MOST) -> Drawing:
    """Return the drawing beside a picture of a channel of flow, or of the x and y of scene flow; `most`: see `longest_of`."""
    ways = np.array([[[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]])
    colors: list[list[int]] = picture(ways, 1.0)[0].tolist()
    names = (f"{channel}: right", "down", "left", "up")
    return Drawing(
        channel,
        within=lambda sample, extent: picture(sample.channels[channel][..., :2], extent[1]),
        extent=lambda sample: (0.0, longest_of(sample.channels[channel][..., :2], most)),
        key=tuple((name, (r, g, b)) for name, (r, g, b) in zip(names, colors, strict=True)),
    )
