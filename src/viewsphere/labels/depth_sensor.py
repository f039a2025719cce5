"""depth_sensor: depth as a depth camera would measure it, with noise, steps and holes; `depth` itself stays exact."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from statistics import NormalDist
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field as Limits

from viewsphere.geometry.camera import pixel_rays
from viewsphere.labels.shared.needs import Randomness
from viewsphere.labels.shared.randomness import generator
from viewsphere.labels.shared.spec import ChannelLabel, Drawing, Models, Picture, channel_of
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Natural, Number
from viewsphere.model.sample import Sample

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import LabelContext
    from viewsphere.model.sensors.camera import Intrinsics

Float = NDArray[np.float64]
Draw = Callable[[str], Float]
"""Draws numbers (H, W) of the standard normal distribution for a purpose."""

STEPS = 35130.0
"""Depth in centimetres times disparity in steps, for a Kinect: a step is an eighth of a pixel."""


class _Options(Frozen):
    """Options of the label depth_sensor."""

    kind: Literal["kinect", "stereo"] = Limits(
        default="kinect",
        description="kinect: a projector's pattern seen by a camera (noise by Nguyen et al. 2012, steps by Barron and Malik "
        "2013); stereo: two cameras whose disparity is matched",
    )
    baseline: Annotated[Number, Limits(gt=0)] = Limits(
        default=0.075, description="metres from the camera to the projector, or to the second camera, along +x"
    )
    range: tuple[Number, Number] = Limits(default=(0.4, 8.0), description="[nearest, farthest] depth that is measured, metres")
    noise: Annotated[Number, Limits(ge=0)] = Limits(
        default=1.0, description="kinect: times the published noise; stereo: pixels of the disparity's standard deviation"
    )
    step: Annotated[Number, Limits(ge=0)] | None = Limits(
        default=None, description="stereo: pixels of a step of the disparity, default 0.125; kinect: 0 leaves the steps out"
    )
    failures: Annotated[Number, Limits(ge=0, lt=1)] = Limits(
        default=0.0, description="share of the pixels that are lost by chance: matching failures"
    )
    grazing_deg: Annotated[Number, Limits(gt=0, le=90)] = Limits(
        default=80.0, description="surfaces seen at a flatter angle than this, from their normal, are holes"
    )
    seed: Natural = Limits(default=0, description="what chance follows from; default: the recipe's seed")


def _compute(context: LabelContext) -> NDArray[np.float32]:
    """Measured z-depth, (H, W) metres, infinite where the sensor measures nothing.

    C. Nguyen, S. Izadi, D. Lovell, Modeling Kinect Sensor Noise for Improved 3D Reconstruction and Tracking, 3DIMPVT 2012:
    axial and lateral noise. J. Barron, J. Malik, Intrinsic Scene Properties from a Single RGB-D Image, CVPR 2013: steps. A
    point is a hole if something in its row hides it from the projector or the second camera.
    """
    options, names = context.options_of("depth_sensor", _Options), context.get(Randomness())
    if names is None:
        raise ValueError("depth_sensor: expected a sample of a shot, found none")
    shape = context.visibility.triangle.shape

    def draw(purpose: str) -> Float:
        return generator(options.seed, *names, "depth_sensor", purpose).standard_normal(shape)

    depth, angle = _seen(context)
    focal = float(context.camera.K[0, 0])
    hole = ~np.isfinite(depth) | (angle > math.radians(options.grazing_deg)) | _shadow(depth, focal * options.baseline)
    measure = _kinect if options.kind == "kinect" else _stereo
    out = measure(depth, angle, focal, options, draw)
    hole |= ~((out >= options.range[0]) & (out <= options.range[1]))
    if options.failures:
        hole |= draw("failures") < _quantile(options.failures)
    return np.where(hole, np.inf, out).astype(np.float32)


def _refuses(intrinsics: Intrinsics) -> str | None:
    """The reason why no range camera has this lens; None if one may."""
    if intrinsics.lens.has_depth and not intrinsics.lens.is_parallel:
        return None
    return f"expected a lens with z-depth and one centre, as range cameras have; found {intrinsics.lens.name}: leave it out"


def _seen(context: LabelContext) -> tuple[Float, Float]:
    """Depth (H, W), infinite where nothing is in front of the camera, and the angle (H, W) from the triangle's normal to the
    ray, which is 90 degrees where the lens has no ray.
    """
    from viewsphere.truth.raster import kernels_channels as kernels

    rays = pixel_rays(context.camera.intrinsics)
    normals = context.empty(np.float32, 3)
    told = (context.geometry.triangle_normals, context.rays, context.camera_from_ray, context.camera.R)
    kernels.normals_geometric(context.visibility.triangle, *told, normals)
    cosine = np.abs((normals * rays).sum(axis=-1)) / np.sqrt((rays * rays).sum(axis=-1))
    near = context.visibility.inverse_depth.astype(np.float64)  # the rounded value, which every frame has
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = np.where((near > 0) & (rays[..., 2] > 0), rays[..., 2] / near, np.inf)
    return depth, np.arccos(np.clip(np.nan_to_num(cosine), 0.0, 1.0))


def _shadow(depth: Float, reach: float) -> NDArray[np.bool_]:
    """Pixels hidden from a second eye at the baseline along +x: in its picture, something to their right covers them.

    `reach` is baseline times focal length, metres times pixels.
    """
    column = np.arange(depth.shape[1]) - reach / depth
    nearest = np.minimum.accumulate(column[:, ::-1], axis=1)[:, ::-1]
    hidden = np.zeros(depth.shape, np.bool_)
    hidden[:, :-1] = column[:, :-1] >= nearest[:, 1:]
    return hidden


def _kinect(depth: Float, angle: Float, focal: float, options: _Options, draw: Draw) -> Float:
    """Depth, read from a neighbouring place (lateral noise), with axial noise, in steps of the disparity."""
    flat = np.minimum(angle, math.radians(89.0))
    lean = flat / (math.pi / 2 - flat)
    lateral = options.noise * (0.8 + 0.035 * lean)
    height, width = depth.shape
    y, x = np.mgrid[:height, :width]
    x = np.clip(np.rint(x + lateral * draw("x")), 0, width - 1).astype(np.intp)
    y = np.clip(np.rint(y + lateral * draw("y")), 0, height - 1).astype(np.intp)
    moved = depth[y, x]
    with np.errstate(invalid="ignore"):
        axial = 0.0012 + 0.0019 * (moved - 0.4) ** 2
        steep = np.where(angle > math.radians(60.0), 0.0001 / np.sqrt(moved) * lean * lean, 0.0)
        noisy = moved + options.noise * (axial + steep) * draw("z")
        if options.step == 0:
            return np.where(np.isfinite(moved), noisy, np.inf)
        steps = np.floor(STEPS / (100.0 * np.maximum(noisy, 1e-3)) + 0.5)
        return np.where(np.isfinite(moved) & (steps >= 1), STEPS / np.maximum(steps, 1.0) / 100.0, np.inf)


def _stereo(depth: Float, angle: Float, focal: float, options: _Options, draw: Draw) -> Float:
    """Depth from a disparity with matching noise, in steps of a fraction of a pixel."""
    step = 0.125 if options.step is None else options.step
    disparity = focal * options.baseline / depth + options.noise * draw("disparity")
    matched = np.rint(disparity / step) * step if step else disparity
    with np.errstate(divide="ignore"):
        return np.where(np.isfinite(depth) & (matched > 0), focal * options.baseline / np.maximum(matched, 1e-12), np.inf)


def _quantile(share: float) -> float:
    """The standard normal quantile of this probability."""
    return NormalDist().inv_cdf(share)


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Measured depths are metres above 0, or infinite."""
    measured = channel_of(sample, "depth_sensor")
    if measured is not None and not (measured > 0).all():
        yield "expected metres above 0, or infinity where nothing is measured; found others"


def _beside(sample: Sample) -> Picture:
    """Near is bright; holes are black."""
    measured = sample.channels["depth_sensor"]
    known = measured[np.isfinite(measured)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    with np.errstate(invalid="ignore"):
        light = np.where(np.isfinite(measured), 255 - 200 * (measured - low) / max(high - low, 1e-6), 0)
    return np.repeat(light.round().astype(np.uint8)[..., None], 3, axis=2)


LABEL = ChannelLabel(
    name="depth_sensor",
    meaning="depth as a depth camera measures it, with noise, steps and holes",
    axes="camera",
    needs=(Randomness(),),
    one_pose=True,
    refuses=_refuses,
    options=_Options,
    dtype=np.float32,
    unit="m",
    empty=np.inf,
    compute=_compute,
    prove=_prove,
    drawing=Drawing("depth_sensor", beside=_beside, key=(("depth_sensor: near is bright, holes are black", None),)),
)
