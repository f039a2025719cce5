"""The shared parts of labels of states: whether another picture shows the seen point, too."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared.spec import Drawing, Models, Picture, Proof, channel_of
from viewsphere.model.sample import Sample
from viewsphere.truth.correspondences.correspondence import Match
from viewsphere.truth.surface_points.raster import INVALID

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import Sight

MEANING = "0 visible, 1 occluded, 2 outside the picture, 3 behind the camera, 4 invalid"
COLORS = np.array([(235, 235, 235), (200, 60, 50), (60, 110, 200), (120, 70, 160), (0, 0, 0)], np.uint8)


def state(sight: Sight, match: Match | None) -> NDArray[np.uint8]:
    """The states of the seen points in another view, (H, W); all invalid without one."""
    return np.full(sight.visibility.triangle.shape, INVALID, np.uint8) if match is None else match.state


def drawing(channel: str) -> Drawing:
    """Return the drawing of a channel of states beside a picture."""
    colors: list[list[int]] = COLORS.tolist()
    names = (f"{channel}: visible", "occluded", "outside", "behind", "invalid")
    return Drawing(
        channel,
        beside=lambda sample: picture(sample.channels[channel]),
        key=tuple((name, (r, g, b)) for name, (r, g, b) in zip(names, colors, strict=True)),
    )


def picture(states: NDArray[np.uint8]) -> Picture:
    """States as a picture (H, W, 3): visible light, occluded red, outside blue, behind violet, invalid black."""
    return COLORS[np.minimum(states, INVALID)]


def state_proof(name: str) -> Proof:
    """The proof that a channel holds nothing but states."""

    def prove(sample: Sample, models: Models) -> Iterator[str]:
        states = channel_of(sample, name)
        if states is not None and (states > INVALID).any():
            yield f"expected 0 to 4; found others at {(states > INVALID).sum()} pixels"

    return prove
