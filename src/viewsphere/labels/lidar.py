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
from viewsphere.labels.shared.spec import ChannelLabel, Drawing, Models, channel_of
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.lidar import POINT, Lidar
from viewsphere.truth.lidar.sweeping import Hits, still_hits, swept_hits

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import LabelContext
from viewsphere.assets.appearance.repaint import repainted
from viewsphere.assets.mesh import Image, Material, Mesh, Texture, Wrap
from viewsphere.codecs.srgb import linear
from viewsphere.model.scene import Ground
from viewsphere.model.thing import Repaint
from viewsphere.rendering.ground.material import ground_frame, ground_material
from viewsphere.truth.raster.geometry import Geometry
from viewsphere.truth.shot_views import Painted

_LUMINANCE = (0.2126, 0.7152, 0.0722)
"""Luminance of linear red, green and blue (Rec. 709)."""

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
    intensity = _intensity(lidar, distance, hits.cosine * _albedo(context.geometry, scanner.painted, hits))
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


def _albedo(geometry: Geometry, painted: Painted, hits: Hits) -> Float:
    """The luminance (N,) of the base colour where rays meet surfaces, 0 to 1. The base colour is the product of the material's
    colour, the nearest texel of its picture, and the vertex colours, all linear.
    """
    out, starts = np.ones(len(hits.triangle)), geometry.triangle_start
    for i, (thing, mesh) in enumerate(zip(painted.things, painted.meshes, strict=True)):
        own = np.flatnonzero((hits.triangle >= starts[i]) & (hits.triangle < starts[i + 1]))
        if len(own):
            out[own] = _of_mesh(mesh, thing.repaints, hits.triangle[own] - starts[i], hits.weights[own])
    own = np.flatnonzero(hits.triangle >= starts[-1])
    if painted.ground is not None and len(own):
        out[own] = _of_ground(painted.ground, hits.place[own])
    return out


def _of_mesh(mesh: Mesh, repaints: Sequence[Repaint], triangle: NDArray[np.int32], weights: Float) -> Float:
    out, materials = np.ones(len(triangle)), mesh.triangle_material[triangle]
    for number in np.unique(materials).tolist():
        own = np.flatnonzero(materials == number)
        material, _ = repainted(mesh.materials[number], repaints)
        corners, share = mesh.triangles[triangle[own]], weights[own][..., None]

        def between(values: NDArray[np.float32], corners: NDArray[np.int32] = corners, share: Float = share) -> Float:
            return np.nan_to_num((values[corners].astype(np.float64) * share).sum(axis=1))

        tint = None if mesh.colors is None else between(mesh.colors)[:, :3]
        texture = material.base_color_texture
        uv = None if texture is None else (mesh.uv0, mesh.uv1)[texture.texcoord]
        out[own] = _luminance(material, mesh.images, None if uv is None else between(uv), tint)
    return out


def _of_ground(ground: Ground, place: Float) -> Float:
    material, images = ground_material(ground)
    per_length, u, v = ground_frame(ground, material, (0.0, 0.0, 0.0), 1.0)
    uv = np.stack([u + per_length * place[:, 0], v - per_length * place[:, 1]], axis=1)
    return np.broadcast_to(_luminance(material, images, uv, None), len(place))


def _luminance(material: Material, images: Sequence[Image], uv: Float | None, tint: Float | None) -> Float:
    """The luminance of a material at texture coordinates (N, 2), times colours (N, 3); one number if it has neither."""
    color = np.array([material.base_color[:3]])
    if tint is not None:
        color = color * tint
    texture = material.base_color_texture
    if texture is not None and uv is not None:
        color = color * _texels(images[texture.image].pixels, texture, uv)
    r, g, b = (color[:, i] * share for i, share in enumerate(_LUMINANCE))
    return np.clip(r + g + b, 0.0, 1.0)


def _texels(pixels: NDArray[np.uint8], texture: Texture, uv: Float) -> Float:
    """The nearest texels (N, 3), linear."""
    (a, b, x), (c, d, y) = texture.matrix.tolist()
    u, v = uv.T
    height, width = pixels.shape[:2]
    column = _wrapped(a * u + b * v + x, width, texture.wrap_s)
    row = _wrapped(c * u + d * v + y, height, texture.wrap_t)
    return linear(np.arange(256) / 255)[pixels[row, column, :3]]


def _wrapped(place: Float, size: int, wrap: Wrap) -> NDArray[np.intp]:
    """The index of the texel at a coordinate; 1 is the full extent of the picture."""
    if wrap == "repeat":
        return (np.floor((place - np.floor(place)) * size)).astype(np.intp).clip(0, size - 1)
    if wrap == "mirror":
        place = 1.0 - np.abs(place - 2.0 * np.floor(place / 2.0) - 1.0)
    return np.floor(place.clip(0.0, 1.0) * size).astype(np.intp).clip(0, size - 1)


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
