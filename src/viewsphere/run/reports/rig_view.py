"""The output of `viewsphere inspect --rig`: a rig's sensors as text, and their frusta as a model."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.composing.viewpoints.sequence_poses import poses_of
from viewsphere.geometry.frustum import frustum
from viewsphere.geometry.rotation import transform
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.rig import Rig, Sensor
from viewsphere.planning.rigs import rig_of
from viewsphere.planning.samplers import lens
from viewsphere.recipe.recipe import Recipe
from viewsphere.validation.quantity import quantity

Float = NDArray[np.float64]

COLORS = {
    "blue": (0.05, 0.18, 0.6),
    "orange": (0.9, 0.25, 0.02),
    "green": (0.04, 0.4, 0.06),
    "red": (0.65, 0.02, 0.02),
    "purple": (0.3, 0.12, 0.5),
    "brown": (0.25, 0.1, 0.06),
    "pink": (0.8, 0.18, 0.5),
    "grey": (0.2, 0.2, 0.2),
    "olive": (0.5, 0.5, 0.02),
    "cyan": (0.01, 0.5, 0.6),
}
"""Colours of the sensors in turn; linear."""

DEPTH = 0.75
"""Length of a frustum's edges, times the largest distance between two sensors."""

LEAST_DEPTH = 0.1
"""Minimum length of a frustum's edges, metres."""

BAR, BODY = 0.012, 0.1
"""Thickness of a frustum's edges and width of a camera's body, times the length of the edges."""


@dataclass(frozen=True)
class _SensorFacts:
    """A sensor in words: `fov_deg` across and down, or `span_m` if its rays are parallel; None where
    `distance: {fill: ...}` sets it. `position` (metres) and `rotation` (degrees) are as recipes write them.
    """

    name: str
    color: str
    size: tuple[int, int]
    fov_deg: tuple[float, float]
    position: tuple[float, float, float]
    rotation: tuple[float, float, float]
    distortion: str | None
    channels: tuple[str, ...] | None
    span_m: tuple[float, float] | None = None


def recipe_rig(recipe: Recipe) -> Rig:
    """The rig of a recipe, with one camera if the recipe has no rig; no model is read. Raises RecipeError as `rig_of`."""
    with recipe.located():
        asked = recipe.camera.of_viewpoints
        views = poses_of(recipe.viewpoints, recipe.time, recipe.seed, recipe.folder) if asked else None
        own = lens(recipe, views)
        return rig_of(recipe, own) or Rig.single(own)


def sensor_facts(rig: Rig, recipe: Recipe | None = None) -> tuple[_SensorFacts, ...]:
    """Return the facts about each sensor. The viewpoints of its recipe may set the width of the first one's pictures."""
    is_open = recipe is not None and recipe.camera.projection is not None and recipe.camera.projection.is_open
    colors = list(COLORS)
    facts = tuple(_facts(sensor, colors[i % len(colors)]) for i, sensor in enumerate(rig.sensors))
    same = [is_open and sensor.intrinsics == rig.sensors[0].intrinsics for sensor in rig.sensors]
    return tuple(replace(fact, span_m=None) if is_same else fact for fact, is_same in zip(facts, same, strict=True))


def _facts(sensor: Sensor, color: str) -> _SensorFacts:
    pose, own = np.array(sensor.rig_from_sensor), sensor.intrinsics
    x, y, z = (round(float(v), 9) + 0.0 for v in pose[:3, 3])
    distortion = None if own.lens.is_linear else own.lens.name
    size = own.width, own.height
    span = (own.width / own.fx, own.height / own.fy) if own.lens.is_parallel else None
    return _SensorFacts(
        sensor.name, color, size, own.lens.field_of_view(), (x, y, z), _angles(pose), distortion, sensor.channels, span
    )


def _angles(pose: Float) -> tuple[float, float, float]:
    """A sensor's rotation [x, y, z] in degrees: y to the right, then x up, then z clockwise."""
    turns = -math.asin(min(max(pose[1, 2], -1.0), 1.0)), math.atan2(pose[0, 2], pose[2, 2]), math.atan2(pose[1, 0], pose[1, 1])
    x, y, z = (round(math.degrees(a), 6) + 0.0 for a in turns)
    return x, y, z


def rig_lines(rig: Rig, recipe: Recipe | None = None) -> Iterator[str]:
    """The lines of text about the rig, and the recipe that it may belong to."""
    facts = sensor_facts(rig, recipe)
    yield quantity(len(facts), "sensor")
    for one in facts:
        place, turn = (", ".join(f"{v:.6g}" for v in values) for values in (one.position, one.rotation))
        lens = f"{one.size[0]} x {one.size[1]}, {_extent(one)}"
        yield f"  {one.name} ({one.color})"
        yield f"    lens      {lens}" + (f", {one.distortion}" if one.distortion else "")
        yield f"    position  [{place}] m (right, down, ahead)"
        yield f"    rotation  [{turn}] degrees (up, right, clockwise)"
        if one.channels is not None:
            yield f"    channels  {', '.join(one.channels)}"
    for left, right, baseline in rig.rectified:
        yield f"  rectified   {facts[left].name} and {facts[right].name}, baseline {baseline:.6g} m"


def _extent(facts: _SensorFacts) -> str:
    """The extent of a sensor's picture in words: angles, or metres if its rays are parallel."""
    (across, down), unit = (facts.fov_deg, "degrees") if facts.span_m is None else (facts.span_m, "m")
    return f"{across:.4g} x {down:.4g} {unit}" if across else "width from distance: {fill: ...}"


def rig_mesh(rig: Rig) -> Mesh:
    """The sensors' bodies and frusta, a separate colour and part for each sensor; front -Y, up +Z, metres."""
    centers = np.array([np.array(sensor.rig_from_sensor)[:3, 3] for sensor in rig.sensors])
    reach = float(np.linalg.norm(centers[:, None] - centers[None], axis=-1).max())
    spans = [
        max(own.width / own.fx, own.height / own.fy) for own in (s.intrinsics for s in rig.sensors) if own.lens.is_parallel
    ]
    depth = max(DEPTH * reach, LEAST_DEPTH, *spans)
    shapes = [
        _in_model_axes(transform(sensor.rig_from_sensor, _camera_shape(sensor.intrinsics, depth))) for sensor in rig.sensors
    ]
    corners = np.concatenate(shapes)
    count = 3 * len(corners)
    owner = np.repeat(np.arange(len(shapes), dtype=np.int32), [len(shape) for shape in shapes])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    colors = list(COLORS.values())
    return Mesh(
        vertices=corners.reshape(-1, 3).astype(np.float32),
        triangles=np.arange(count, dtype=np.int32).reshape(-1, 3),
        normals=np.repeat(normals, 3, axis=0).astype(np.float32),
        triangle_material=owner,
        triangle_part=owner,
        materials=tuple(Material(name=s.name, base_color=(*colors[i % len(colors)], 1.0)) for i, s in enumerate(rig.sensors)),
        parts=tuple(sensor.name for sensor in rig.sensors),
    )


def _in_model_axes(points: Float) -> Float:
    """Points in the rig's axes, rotated into a model's axes, whose front is -Y."""
    return np.stack([-points[..., 0], -points[..., 2], -points[..., 1]], axis=-1)


def _camera_shape(own: Intrinsics, depth: float) -> Float:
    """Triangles (T, 3, 3) of a sensor in its own axes: its body, the lines of its frustum, and a mark above its upper side."""
    shape, thick, body = frustum(own.lens, depth), BAR * depth, BODY * depth
    bars = [_bar(a, b, thick) for line in (*shape.border, *shape.edges) for a, b in pairwise(line)]
    bars += [_bar(a, b, thick / 2) for line in shape.across for a, b in pairwise(line)]
    bars.append(_bar(np.array([0.0, 0.0, -1.2 * body]), np.array([0.0, 0.0, 0.2 * body]), body))
    top = shape.border[0]
    if len(top):
        middle = top[len(top) // 2]
        bars.append(_bar(middle, middle - np.array([0.0, 1.5 * body, 0.0]), 2 * thick))
    return np.concatenate(bars)


def _unit(rays: Float) -> Float:
    return rays / np.linalg.norm(rays, axis=-1, keepdims=True)


def _bar(start: Float, end: Float, thick: float) -> Float:
    """A bar with a square section between two points, as triangles (12, 3, 3)."""
    along = _unit(end - start)
    across = np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))]).astype(np.float64)
    beside = _unit(across)
    other = np.cross(along, beside)
    ring: Sequence[tuple[int, int]] = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    square = np.array([thick / 2 * (u * beside + v * other) for u, v in ring])
    near, far = start + square, end + square
    faces = [(near[i], near[(i + 1) % 4], far[(i + 1) % 4], far[i]) for i in range(4)]
    faces += [(near[3], near[2], near[1], near[0]), (far[0], far[1], far[2], far[3])]
    return np.array([triangle for a, b, c, d in faces for triangle in ((a, b, c), (a, c, d))])
