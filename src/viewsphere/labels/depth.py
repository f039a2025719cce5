"""depth and depth_ray: distance along the camera's z axis, and along a pixel's ray, as range finders measure it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.camera import pixel_rays
from viewsphere.labels.shared.drawing.depth_colors import extent, picture
from viewsphere.labels.shared.spec import Array, ChannelLabel, Drawing, Models, Proof, channel_of
from viewsphere.model.sample import Sample

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import LabelContext
    from viewsphere.model.sensors.camera import Intrinsics


def _along_axis(context: LabelContext) -> NDArray[np.float32]:
    """z of the seen point, (H, W) metres, infinite where nothing is seen; negative behind the image plane of a fisheye."""
    from viewsphere.truth.raster import kernels_channels as kernels

    out = context.empty(np.float32)
    kernels.depths(context.visibility.inverse_depth, context.rays, out)
    return out


def _prove_depth(sample: Sample, models: Models) -> Iterator[str]:
    """Depth is in metres, and finite wherever an object is seen."""
    depth, instances = channel_of(sample, "depth"), channel_of(sample, "instances")
    if depth is None:
        return
    if np.isnan(depth).any():
        yield "expected metres, or infinity where nothing is seen; found NaN"
    elif instances is not None and np.isinf(depth[instances > 0]).any():
        yield f"expected metres where an object is seen; found infinity at {np.isinf(depth[instances > 0]).sum()} pixels"


def _along_ray(context: LabelContext) -> NDArray[np.float32]:
    """Distance from the camera's centre to the seen point, (H, W) metres, infinite where nothing is seen.

    It is the length of the pixel's ray times 1/s of `truth.raster.visibility`. It is never negative, even behind a fisheye.
    """
    length = np.linalg.norm(pixel_rays(context.camera.intrinsics), axis=-1)
    out = np.full(length.shape, np.inf, np.float32)
    seen = context.visibility.inverse_depth > 0
    out[seen] = length[seen] / context.visibility.inverse_depth[seen]
    return out


def _prove_depth_ray(sample: Sample, models: Models) -> Iterator[str]:
    """Distances are above 0, and finite where depth is. The values are not compared, because depth may be stored in steps."""
    distance, depth = channel_of(sample, "depth_ray"), channel_of(sample, "depth")
    if distance is None:
        return
    if not (distance > 0).all():
        yield "expected metres above 0, or infinity where nothing is seen; found others"
    if depth is not None and not np.array_equal(np.isfinite(distance), np.isfinite(depth)):
        yield "expected finite distances where depth is finite, and nowhere else; found others"


def _no_depth(intrinsics: Intrinsics) -> str | None:
    """The reason why pictures of this lens have no z-depth; None if they have."""
    if intrinsics.lens.has_depth:
        return None
    return f"expected a lens with z-depth; found {intrinsics.lens.name}: use depth_ray, or leave it out"


def _label(name: str, compute: Callable[[LabelContext], Array], meaning: str, prove: Proof) -> ChannelLabel:
    """A channel of distances."""
    return ChannelLabel(
        name=name,
        meaning=meaning,
        axes="camera",
        dtype=np.float32,
        unit="m",
        empty=np.inf,
        in_steps=name == "depth",
        refuses=_no_depth if name == "depth" else None,
        compute=compute,
        prove=prove,
        drawing=Drawing(
            name,
            within=lambda sample, within: picture(sample.channels[name], within),
            extent=lambda sample: extent(sample.channels[name]),
            key=((f"{name}: light is near", None),),
        ),
    )


LABELS = (
    _label("depth", _along_axis, "distance along the camera's z axis", _prove_depth),
    _label("depth_ray", _along_ray, "distance from the camera's centre, along the pixel's ray", _prove_depth_ray),
)
