"""lidar: the points that a LiDAR returns."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.camera import pixel_rays
from viewsphere.labels.shared.drawing.scan_map import from_above
from viewsphere.labels.shared.ids import in_column
from viewsphere.labels.shared.needs import LidarScan, Randomness, Scanner
from viewsphere.labels.shared.randomness import generator
from viewsphere.labels.shared.reflectance import albedo
from viewsphere.labels.shared.spec import ChannelLabel, Drawing, Models, channel_of
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.lidar import POINT, Lidar
from viewsphere.truth.lidar.sweeping import Hits, still_hits, swept_hits

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import LabelContext

Float = NDArray[np.float64]
Rays = tuple[NDArray[np.intp], NDArray[np.intp]]

ROUNDED = 1e-6
"""Share of a point's distance by which float32 may move it."""


def _compute(context: LabelContext) -> NDArray[np.void]:
    """One row for each returned point, (N,) of `viewsphere.model.sensors.lidar.POINT`, ring by ring. Raises ValueError if the
    sensor is not a LiDAR.
    """
    scanner, names = context.get(LidarScan()), context.get(Randomness())
    lidar = None if scanner is None else scanner.sensor.lidar
    if scanner is None or names is None or lidar is None:
        raise ValueError("lidar: expected a sample of a LiDAR, found a camera's")
    hits, width = _hits(context, scanner, lidar), context.camera.width
    ring, column, distance = hits.ring, hits.column, hits.distance
    intensity = _intensity(lidar, distance, hits.cosine * albedo(context.geometry, scanner.painted, hits))
    draw = partial(_drawn, lidar.seed, names, context.visibility.triangle.shape, (ring, column))
    returns = _returns(lidar, distance, intensity, draw)
    distance = distance + lidar.sigma * draw("range", np.random.Generator.standard_normal) if lidar.sigma else distance
    out = np.empty(len(ring), POINT)
    out["range"], out["incidence"], out["intensity"] = distance, hits.incidence, intensity
    out["xyz"] = _in_lidar_axes(context.rays[ring, column]) * distance[:, None]
    out["time"] = ((column + 0.5) / width - 0.5) * lidar.sweep
    objects = len(context.geometry.triangle_category)  # their triangles come first
    out["instance"] = context.geometry.triangle_object[hits.triangle]
    out["category"] = np.append(context.geometry.triangle_category, 0)[np.minimum(hits.triangle, objects)]
    out["ring"], out["column"] = ring, column
    low, high = lidar.range
    return out[returns & (out["range"] > 0) & (out["range"] >= low) & (out["range"] <= high)]


def _hits(context: LabelContext, scanner: Scanner, lidar: Lidar) -> Hits:
    if lidar.sweep:
        return swept_hits(context.geometry, context.camera, scanner.turning(lidar.sweep))
    return still_hits(context.geometry, context.camera, context.visibility)


def _intensity(lidar: Lidar, distance: Float, reflected: Float) -> Float:
    """Return the intensity that a surface sends back: Lambert's cosine times its albedo. The square of the distance weakens it
    where the sensor does not compensate.
    """
    near = lidar.reference_range
    return reflected if near is None else reflected * (near / distance) ** 2


Draw = Callable[[str, Callable[..., Float]], Float]
"""Draws a random number for each point, given a purpose and a method of numpy's generators."""


def _drawn(
    seed: int, names: Sequence[str], size: tuple[int, ...], rays: Rays, purpose: str, method: Callable[..., Float]
) -> Float:
    """A random number for each of the given rays (ring, column) of a scan. A ray's number does not depend on the other rays."""
    return method(generator(seed, *names, purpose), size)[rays]


def _returns(lidar: Lidar, distance: Float, intensity: Float, draw: Draw) -> NDArray[np.bool_]:
    """Return a mask of the points that return: no cause of drop-out removes them."""
    chance = np.full(len(distance), 1.0 - lidar.dropout)
    for curve, values in ((lidar.dropout_by_range, distance), (lidar.dropout_by_intensity, intensity)):
        if curve:
            at, lost = np.array(curve).T
            chance *= 1.0 - np.interp(values, at, lost)
    return np.ones(len(chance), np.bool_) if (chance == 1.0).all() else draw("dropout", np.random.Generator.random) < chance


def _in_lidar_axes(vectors: Float) -> Float:
    """Vectors (..., 3) in camera axes (right, down, ahead), converted to a LiDAR's axes (ahead, left, up)."""
    return np.stack([vectors[..., 2], -vectors[..., 0], -vectors[..., 1]], axis=-1)


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Each point is on the ray of its ring and column, at its range and on an object of the sample; a ray has one point."""
    rows = channel_of(sample, "lidar")
    if rows is None:
        return
    ring, column, distance = rows["ring"].astype(np.int64), rows["column"].astype(np.int64), rows["range"]
    if (ring >= sample.height).any() or (column >= sample.width).any():
        yield f"expected rings below {sample.height} and columns below {sample.width}; found others"
        return
    if (np.diff(ring * sample.width + column) <= 0).any():
        yield "expected at most one point of each ray, ring by ring; found others"
    if not (np.isfinite(distance) & (distance > 0)).all():
        yield "expected ranges above 0 m; found others"
        return
    expected = _in_lidar_axes(pixel_rays(sample.camera.intrinsics)[ring, column]) * distance[:, None].astype(np.float64)
    off = np.abs(rows["xyz"] - expected).max(axis=1, initial=0.0) > ROUNDED * distance
    if not np.isfinite(rows["xyz"]).all() or off.any():
        yield f"expected points on the rays of their rings and columns; found {off.sum()} elsewhere"
    yield from _of_objects(sample, rows)
    if not ((rows["incidence"] >= 0) & (rows["incidence"] <= np.float32(np.pi / 2))).all():
        yield "expected incidences of 0 to pi/2; found others"
    if not (rows["intensity"] >= 0).all():
        yield "expected intensities of 0 or more; found others"


def _of_objects(sample: Sample, rows: NDArray[np.void]) -> Iterator[str]:
    known = {0: 0} | {o.id: o.category_id for o in sample.objects}
    for instance in np.unique(rows["instance"]).tolist():
        found = rows["category"][rows["instance"] == instance]
        expected = known.get(instance)
        if expected is None:
            yield f"expected points on objects of the sample; found {len(found)} on object {instance}"
        elif (found != expected).any():
            yield f"expected category {expected} of object {instance}; found others at {(found != expected).sum()} points"


LABEL = ChannelLabel(
    name="lidar",
    meaning="points that a LiDAR returns, a row each: place, range, intensity, incidence, time, object, category, ring, column",
    axes="LiDAR: x ahead, y left, z up",
    needs=(LidarScan(), Randomness()),
    dtype=POINT,
    components=0,
    unit="m, rad, s",
    empty=np.nan,
    encoding="npz",
    compute=_compute,
    ids={"category": in_column("category"), "object": in_column("instance")},
    prove=_prove,
    drawing=Drawing(
        "lidar", stand_in=from_above, key=(("LiDAR from above: objects in their colours, else high is light", None),)
    ),
)
