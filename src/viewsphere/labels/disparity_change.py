"""disparity_change: the change of the seen point's disparity until the next instant."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared.needs import Next, Partner, no_disparity
from viewsphere.labels.shared.spec import ChannelLabel, Drawing, Extent, Models, Picture, channel_of
from viewsphere.model.sample import Sample
from viewsphere.truth.surface_points.raster import in_lens

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import LabelContext
    from viewsphere.model.sensors.camera import Intrinsics


def _compute(context: LabelContext) -> NDArray[np.float32]:
    """The same point's disparity an instant later minus its disparity now, (H, W) pixels; 0 for the sky.

    NaN where the point is then behind the camera or gone, and without a rectified sensor or a later instant.
    """
    out, baseline, match = context.empty(np.float32), context.baseline, context.match(Next())
    if baseline is None or match is None:
        out.fill(np.nan)
        return out
    now, then = context.camera.intrinsics.fx, match.other.camera.intrinsics.fx
    out[...] = baseline * (then * match.inverse_depth - now * context.inverse_depth)
    out[~in_lens(match.xy) & (context.visibility.triangle >= 0)] = np.nan
    return out


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Disparity is not negative after the change, either."""
    change, now = channel_of(sample, "disparity_change"), channel_of(sample, "disparity")
    if change is not None and now is not None and (now + change < -1e-3 * np.maximum(np.abs(change), 1)).any():
        yield "expected disparity of at least 0 afterwards; found less"


def _extent(change: NDArray[np.float32]) -> Extent:
    """The magnitude of change that 99 % of the pixels do not exceed, with both signs."""
    known = np.abs(change[np.isfinite(change)])
    most = float(np.percentile(known, 99)) if known.size else 0.0
    return -most, most


def _picture(change: NDArray[np.float32], within: Extent | None = None) -> Picture:
    """A change as a picture (H, W, 3): nearer is red, farther is blue, no change is white, NaN is black."""
    known = np.isfinite(change)
    most = (within or _extent(change))[1]
    share = np.clip(np.where(known, change, 0) / max(most, 1e-9), -1, 1)
    other = 255 * (1 - np.abs(share))
    red, blue = np.where(share >= 0, 255, other), np.where(share <= 0, 255, other)
    return np.where(known[..., None], np.stack((red, other, blue), axis=-1), 0).astype(np.uint8)


def _refuses(intrinsics: Intrinsics) -> str | None:
    """The reason why pictures of this lens have no change of disparity; None if they have."""
    if not intrinsics.lens.has_depth:
        return f"expected a lens with z-depth, from which it follows; found {intrinsics.lens.name}: leave it out"
    return no_disparity(intrinsics)


LABEL = ChannelLabel(
    name="disparity_change",
    meaning="the seen point's disparity one instant later, less its disparity",
    axes="image",
    needs=(Next(), Partner()),
    refuses=_refuses,
    dtype=np.float32,
    unit="px",
    empty=np.nan,
    compute=_compute,
    prove=_prove,
    drawing=Drawing(
        "disparity_change",
        within=lambda sample, within: _picture(sample.channels["disparity_change"], within),
        extent=lambda sample: _extent(sample.channels["disparity_change"]),
        key=(("comes nearer", (255, 0, 0)), ("goes farther", (0, 0, 255))),
    ),
)
