"""disparity: the distance between a point's positions in the two pictures of a stereo pair."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field as Limits

from viewsphere.labels.shared.needs import Partner, no_disparity
from viewsphere.labels.shared.spec import ChannelLabel, Drawing, Extent, Models, Picture, channel_of
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import Sample

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import LabelContext


class _Options(Frozen):
    """Options of the label disparity."""

    unit: Literal["pixels", "degrees"] = Limits(
        default="pixels",
        description="pixels of the pictures; degrees: the angle between the directions in which both cameras see the point",
    )


def _compute(context: LabelContext) -> NDArray[np.float32]:
    """fx baseline / z, (H, W) pixels, positive in both pictures of the pair; 0 for the sky. Of panoramas one above the other:
    the rows between both positions of the point.

    The other picture is from the first sensor of the rig that is rectified with the picture's own. NaN without such a sensor,
    and where a flat picture is seen.
    """
    out, baseline, own = context.empty(np.float32), context.baseline, context.own_view
    if baseline is None or own is None:
        out.fill(np.nan)
        return out
    if context.options_of("disparity", _Options).unit == "degrees":
        out[...] = _parallax(context)
    elif context.camera.lens.is_linear:
        np.multiply(context.inverse_depth, context.camera.intrinsics.fx * baseline, out=out, casting="same_kind")
    else:
        out[...] = np.abs(_there(context)[..., 1] - (np.arange(len(out)) + 0.5)[:, None])
    if not own.is_sky_endless:
        out[context.visibility.triangle < 0] = np.nan
    return out


def _there(context: LabelContext) -> NDArray[np.float64]:
    """Positions of the seen points in the other picture, (H, W, 2) pixels."""
    match = context.match(Partner())
    assert match is not None
    return match.xy


def _parallax(context: LabelContext) -> NDArray[np.float64]:
    """Angles (H, W), degrees, between the directions in which both cameras, whose axes are equal, see the points."""
    lens = context.camera.lens
    here, there = lens.directions(), lens.rays(_there(context)).directions
    away = np.linalg.norm(np.cross(here, there), axis=-1)
    return np.degrees(np.arctan2(away, (here * there).sum(axis=-1)))


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Disparity is never negative, and 0 at infinite depth."""
    disparity, depth = channel_of(sample, "disparity"), channel_of(sample, "depth")
    if disparity is None:
        return
    if (disparity < 0).any() or np.isinf(disparity).any():
        yield "expected pixels of at least 0, or NaN; found others"
    elif depth is not None and (np.isinf(depth) & (disparity > 0)).any():
        yield f"expected 0 or NaN where depth is infinite; found others at {(np.isinf(depth) & (disparity > 0)).sum()} pixels"


def extent(disparity: NDArray[np.float32]) -> Extent:
    """The disparity that 98 % of the pixels exceed, and the greatest disparity."""
    known = disparity[np.isfinite(disparity)]
    return (0.0, 0.0) if not known.size else (float(np.percentile(known, 2)), float(known.max()))


def _picture(disparity: NDArray[np.float32], within: Extent | None = None) -> Picture:
    """Disparity as a picture (H, W, 3): near is light, far is dark, NaN black."""
    known = np.isfinite(disparity)
    grey = np.zeros(disparity.shape, np.float64)
    far, near = within or extent(disparity)
    grey[known] = 0.15 + 0.85 * np.clip((disparity[known] - far) / max(near - far, 1e-9), 0, 1)
    return np.repeat((grey * 255).astype(np.uint8)[..., None], 3, axis=2)


LABEL = ChannelLabel(
    name="disparity",
    meaning="x in the left picture less x in the right one, of the rectified pair; of panoramas, y in the upper picture less y "
    "in the lower one",
    options=_Options,
    axes="image",
    needs=(Partner(),),
    refuses=no_disparity,
    dtype=np.float32,
    unit="px",
    empty=np.nan,
    compute=_compute,
    prove=_prove,
    drawing=Drawing(
        "disparity",
        within=lambda sample, within: _picture(sample.channels["disparity"], within),
        extent=lambda sample: extent(sample.channels["disparity"]),
        key=(("disparity: light is near", None),),
    ),
)
