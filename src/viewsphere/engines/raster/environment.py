"""The light of all around: any sky baked into maps of what matt and shiny surfaces see of it, and into distant lights."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster import kernels_block as rows
from viewsphere.engines.raster import kernels_environment as kernels
from viewsphere.engines.raster.daylight import air, daylight_picture, opening
from viewsphere.engines.raster.environment_file import read_environment
from viewsphere.engines.raster.kernels_arrive import DISTANT, arrive
from viewsphere.engines.raster.lights import Distant, Extent, Lights, distant_sun
from viewsphere.engines.raster.records import Float32, Int32
from viewsphere.model.scene import AnySky, Daylight, Environment, Sky, Sun

Float = NDArray[np.float64]

SURROUNDINGS = 0.3
"""Reflectance of what lies below a made sky's horizon where there is no ground."""

_LEVELS = 8  # roughness 0 to 1
_WIDE = 3  # level from which on a lobe is so wide that it gathers all texels of a map no wider than _COARSE
_COARSE = 64
_SMALLEST = 32  # width of a map
_SKY_WIDTH = 256  # of the sharpest map of a sky that has no detail
_PICTURE_WIDTH = 512  # and of a photographed one
_SKY_HEIGHT = 256  # of the picture of a made sky
_DISC = 60.0  # greatest radiance of the sun as seen: all of it is white
_HALO = 0.32  # radiance around the sun before a gradient, in the sun's irradiance

# A photographed sun: a bright spot this far from its middle at most, so much above the mean and of so much of all light.
_SPOT = math.radians(5.0)
_AROUND = math.radians(9.0)
_ABOVE_MEAN = 20.0
_OF_ALL = 0.08
_LOWEST = 0.05  # its height, as a sine
_NO_LIGHT: Float = np.zeros((2, 3))


class Surrounding(NamedTuple):
    """Light from all around, as the shading kernels read it. float32 unless said.

    texels (N, 4): octahedral maps with a border, one after the other; colour, and the share that lies below the horizon;
    levels (L, 2) int32: first texel and width of each, the first one for matt surfaces (radiance of a white one), then
    equal steps of roughness from 0 to 1. Radiance is the map's times scale (3,) plus above (3,) and below (3,) times their
    shares. turn (2,): cosine and sine of the maps' turn about z. up (3,): radiance of a white level floor without what is
    below. albedo (A, A, 2): see `lobe_albedo`.

    What is seen: picture (P,) uint32, equirectangular, shared exponents; picture_levels (K, 3) int32: first texel, width and
    height; times seen (3,) plus behind (3,); with glow (3,) around the direction sun (3,) and a disc (3,) of half_angle
    radians. lamps (3,): radiance of the ground close by where lamps light it, which is not in below.
    """

    texels: Float32
    levels: Int32
    scale: Float32
    above: Float32
    below: Float32
    turn: Float32
    up: Float32
    albedo: Float32
    picture: NDArray[np.uint32]
    picture_levels: Int32
    seen: Float32
    behind: Float32
    sun: Float32
    glow: Float32
    disc: Float32
    half_angle: np.float32
    lamps: Float32


class _Maps(NamedTuple):
    """What of a sky does not depend on its strength, its turn and what is below."""

    texels: Float32
    levels: Int32
    up: Float32  # radiance of a white level floor, (4,)
    picture: NDArray[np.uint32]
    picture_levels: Int32


class _Photographed(NamedTuple):
    maps: _Maps
    sun: Distant | None
    notes: tuple[str, ...]


def sun_light(sky: AnySky, sun: Sun | None) -> Distant | None:
    """The sun as it arrives: daylight's air dims and reddens it; None if it does not shine."""
    if sun is None or sun.strength <= 0:
        return None
    light = distant_sun(sun)
    if isinstance(sky, Daylight):
        left = opening(sun.elevation_deg, sky) * air(sun.elevation_deg, sky) * light.irradiance
        light = Distant(light.direction, (float(left[0]), float(left[1]), float(left[2])), light.angle_deg)
    return light if max(light.irradiance) > 1e-6 else None


def sky_lights(sky: AnySky, sun: Sun | None, has_ground: bool) -> tuple[Distant, ...]:
    """The scene's sun and, of a photographed sky, the one taken out of it: `bake_surrounding` has what is left.

    Raises UserError when the picture cannot be read.
    """
    lights = [sun_light(sky, sun)]
    if isinstance(sky, Environment):
        found = _photographed(_key(sky.file), has_ground).sun
        if found is not None:
            x, y, z = found.direction
            c, s = _turn(sky.rotation_deg)
            r, g, b = (sky.strength * v for v in found.irradiance)
            lights.append(Distant((c * x - s * y, s * x + c * y, z), (r, g, b), found.angle_deg))
    return tuple(light for light in lights if light is not None)


def environment_notes(sky: AnySky) -> tuple[str, ...]:
    """What had to be mended in a sky's picture."""
    return _photographed(_key(sky.file), True).notes if isinstance(sky, Environment) else ()


def lamps_on_ground(lights: Lights, extent: Extent) -> Float:
    """Irradiance / pi, (3,), that lamps give the ground around the targets on the mean, (3,), their shadows taken off.

    As far around as half the targets' box is long.
    """
    n, size = 11, extent.high - extent.low
    reach = 0.5 * float(np.linalg.norm(size))
    steps = (np.arange(n) + 0.5) / n * 2 - 1
    x, y = np.repeat(steps, n), np.tile(steps, n)
    inside = x**2 + y**2 <= 1
    b = np.zeros((rows.ROWS, rows.BLOCK), np.float32)
    count = int(inside.sum())
    middle = (extent.low + extent.high) / 2
    # A little below the ground, so that what lies on it hides the light from within.
    place = middle[0] + reach * x[inside], middle[1] + reach * y[inside], extent.low[2] - 0.01 * reach
    for row, values in zip((rows.PX, rows.PY, rows.PZ, rows.NZ, rows.GZ, rows.PIXEL), (*place, 1, 1, reach / n), strict=True):
        b[row // rows.BLOCK, :count] = values
    total, flat = np.zeros(3), b.reshape(-1)
    for k in np.flatnonzero(lights.kind != DISTANT).tolist():
        arrive(count, lights, k, flat)
        lz, share, *light = (b[r // rows.BLOCK, :count] for r in (rows.LZ, rows.SHARE, rows.IR, rows.IG, rows.IB))
        total += np.stack(light) @ (np.maximum(lz, 0) * share) / (count * math.pi)
    return total


def bake_surrounding(
    sky: AnySky,
    sun: Sun | None,
    ground: Float | None,
    lights: Sequence[Distant] = (),
    even: Float = _NO_LIGHT,
    lamps: Float | None = None,
) -> Surrounding:
    """All of the sky but `sky_lights`. What costs time is kept, by the sky alone.

    ground (3,): linear colour of a ground that hides the lower half and shines with what it receives of the sky and of
    `lights`; None for none: below a made sky there is grey all the same, below a photographed one what it shows.
    even: radiance from above and below of hemisphere lights, (2, 3); lamps (3,): `lamps_on_ground`, none if it is None.
    Raises UserError when a picture cannot be read.
    """
    has_ground = ground is not None
    maps, scale, above, turn = _sky_parts(sky, sun, has_ground)
    behind = above.copy()
    above = above + even[0]
    up = maps.up[:3] * scale + (1 - maps.up[3]) * above
    received = up + sum((np.array(d.irradiance) * max(d.direction[2], 0) / math.pi for d in lights), np.zeros(3))
    if ground is not None:
        below = np.asarray(ground) * received
    else:
        below = even[1] + (0 if isinstance(sky, Environment) else SURROUNDINGS * received)
        if isinstance(sky, Environment):
            up = up + maps.up[3] * below
    direction, glow, disc, half_angle = _visible_sun(sky, sun)
    return Surrounding(
        texels=maps.texels,
        levels=maps.levels,
        scale=scale.astype(np.float32),
        above=above.astype(np.float32),
        below=below.astype(np.float32),
        turn=np.array(turn, np.float32),
        up=up.astype(np.float32),
        albedo=lobe_albedo(),
        picture=maps.picture,
        picture_levels=maps.picture_levels,
        seen=scale.astype(np.float32),
        behind=behind.astype(np.float32),
        sun=direction.astype(np.float32),
        glow=glow.astype(np.float32),
        disc=disc.astype(np.float32),
        half_angle=np.float32(half_angle),
        lamps=(np.zeros(3) if ground is None or lamps is None else np.asarray(ground) * lamps).astype(np.float32),
    )


def _turn(degrees: float) -> tuple[float, float]:
    return math.cos(math.radians(degrees)), math.sin(math.radians(degrees))


def _sky_parts(sky: AnySky, sun: Sun | None, has_ground: bool) -> tuple[_Maps, Float, Float, tuple[float, float]]:
    """Maps, the factor of their colours, what is added above the horizon, and their turn."""
    if isinstance(sky, Environment):
        maps = _photographed(_key(sky.file), has_ground).maps
        return maps, np.full(3, sky.strength), np.zeros(3), _turn(sky.rotation_deg)
    if isinstance(sky, Daylight):
        sun = sun or Sun()
        maps = _daylight_maps(sky.turbidity, sky.clouds, sun.elevation_deg)
        strength = sky.strength * opening(sun.elevation_deg, sky)
        return maps, np.full(3, strength), np.zeros(3), _turn(sun.azimuth_deg - 90)
    zenith, horizon = (sky.strength * np.array(c) for c in (sky.zenith, sky.horizon))
    return _gradient_maps(), zenith - horizon, horizon, (1.0, 0.0)


def _visible_sun(sky: AnySky, sun: Sun | None) -> tuple[Float, Float, Float, float]:
    """The sun's direction, its glow before a gradient, its disc in daylight, half its angle in radians."""
    light = None if isinstance(sky, Environment) else sun_light(sky, sun)
    if light is None:
        return np.array([0.0, 0.0, 1.0]), np.zeros(3), np.zeros(3), 0.0
    direction, irradiance = np.array(light.direction), np.array(light.irradiance)
    if isinstance(sky, Sky):
        return direction, _HALO * irradiance, np.zeros(3), 0.0
    half = math.radians(max(light.angle_deg, 0.3)) / 2
    radiance = irradiance / (math.pi * half * half)
    return direction, np.zeros(3), radiance * min(1.0, _DISC / float(radiance.max())), half


@lru_cache(maxsize=1)
def _gradient_maps() -> _Maps:
    """Of every gradient at once: how far each direction is from the horizon's colour towards the zenith's."""
    height = _SKY_HEIGHT
    sine = np.maximum(np.sin((0.5 - (np.arange(height) + 0.5) / height) * np.pi), 0)
    share = (1 - (1 - sine) ** 3).astype(np.float32)
    return _maps(np.ascontiguousarray(np.broadcast_to(share[:, None, None], (height, 2 * height, 3))), _SKY_WIDTH, True)


@lru_cache(maxsize=4)
def _daylight_maps(turbidity: float, clouds: float, elevation_deg: float) -> _Maps:
    sky = Daylight(turbidity=turbidity, clouds=clouds)
    return _maps(daylight_picture(elevation_deg, sky, _SKY_HEIGHT), _SKY_WIDTH, True)


def _key(file: str) -> tuple[str, int, int]:
    """A file and what changes with its content."""
    try:
        facts = Path(file).stat()
    except OSError:
        return file, 0, 0
    return file, facts.st_size, facts.st_mtime_ns


@lru_cache(maxsize=3)
def _photographed(key: tuple[str, int, int], has_ground: bool) -> _Photographed:
    file = read_environment(Path(key[0]))
    left, sun = without_sun(file.pixels)
    return _Photographed(_maps(left, _PICTURE_WIDTH, has_ground, file.pixels), sun, file.notes)


def without_sun(pixels: Float32) -> tuple[Float32, Distant | None]:
    """An equirectangular picture without its sun, and the sun; both as they were if no small bright spot stands out.

    All light of the spot above that around it becomes the sun's, so that together they light as before.
    """
    height, width = pixels.shape[:2]
    bright = pixels @ np.array([0.2126, 0.7152, 0.0722], np.float32)
    row = (0.5 - (np.arange(height) + 0.5) / height) * math.pi
    area = np.cos(row) * (math.pi / height) * (2 * math.pi / width)
    mean = float(bright.sum(axis=1, dtype=np.float64) @ area) / (4 * math.pi)
    peak_row, peak_column = divmod(int(bright.argmax()), width)
    if bright[peak_row, peak_column] < _ABOVE_MEAN * mean or math.sin(row[peak_row]) < _LOWEST:
        return pixels, None
    rows = np.flatnonzero(abs(row - row[peak_row]) <= _AROUND)
    column = math.pi - (np.arange(width) + 0.5) / width * 2 * math.pi
    x, y = np.cos(row[rows])[:, None] * np.cos(column), np.cos(row[rows])[:, None] * np.sin(column)
    z = np.broadcast_to(np.sin(row[rows])[:, None], x.shape)
    at = peak_row - rows[0], peak_column
    apart = np.arccos(np.clip(x * x[at] + y * y[at] + z * z[at], -1, 1))
    part = bright[rows]
    floor = 2 * float(np.median(part[(apart > _SPOT) & (apart <= _AROUND)]))
    taken = np.where(apart <= _SPOT, np.clip(1 - floor / np.maximum(part, 1e-9), 0, 1), 0)
    weight = taken * part * area[rows][:, None]
    if weight.sum() <= _OF_ALL * math.pi * mean:
        return pixels, None
    direction = np.array([(weight * v).sum() for v in (x, y, z)]) / weight.sum()
    direction /= np.linalg.norm(direction)
    if direction[2] < _LOWEST:
        return pixels, None
    squares = np.maximum(2 - 2 * (x * direction[0] + y * direction[1] + z * direction[2]), 0)
    # A disc's mean square distance from its middle is half its radius squared.
    angle = 2 * math.degrees(math.sqrt(2 * float((weight * squares).sum() / weight.sum())))
    r, g, b = ((taken * area[rows][:, None])[..., None] * pixels[rows]).sum(axis=(0, 1)).tolist()
    left = pixels.copy()
    left[rows] *= (1 - taken)[..., None].astype(np.float32)
    dx, dy, dz = direction.tolist()
    return left, Distant((dx, dy, dz), (r, g, b), min(max(angle, 0.3), 12.0))


def _maps(lighting: Float32, width: int, has_ground: bool, seen: Float32 | None = None) -> _Maps:
    """Bake equirectangular pictures of what lights and, if that differs, of what is seen."""
    pictures = [lighting if seen is None else seen]
    while min(pictures[-1].shape[:2]) >= 8:
        pictures.append(_half(pictures[-1]))
    source = lighting
    while source.shape[1] > 4 * width:
        source = _half(source)
    mirror: Float32 = kernels.octahedral(source, width, has_ground)
    chain = [mirror]
    while len(chain[-1]) > 8:
        chain.append(_halved(chain[-1]))
    texels, levels = _joined(chain)
    coarse = next(m for m in chain if len(m) <= _COARSE)
    matt = kernels.gathered(coarse, _SMALLEST, 1.0)
    maps = [matt, mirror]
    for k in range(1, _LEVELS - 1):
        rough, size = k / (_LEVELS - 1), max(width >> (2 * k - 1), _SMALLEST)
        if k < _WIDE:
            maps.append(kernels.blurred(texels, levels, _lobe_samples(rough, 8 * k * k, width, len(chain)), size))
        else:
            maps.append(kernels.gathered(coarse, size, rough**4))
    maps.append(matt)
    sizes = np.array([p.shape[1::-1] for p in pictures])
    starts = np.concatenate([[0], np.cumsum(sizes.prod(axis=1))[:-1]])
    middle = _SMALLEST // 2
    return _Maps(
        *_joined(maps),
        matt[middle - 1 : middle + 1, middle - 1 : middle + 1].mean(axis=(0, 1)),
        np.concatenate([kernels.packed(p) for p in pictures]),
        np.column_stack([starts, sizes]).astype(np.int32),
    )


def _joined(maps: Sequence[Float32]) -> tuple[Float32, Int32]:
    """Maps with borders in one array, and where each begins and how wide it is."""
    parts = [_bordered(m).reshape(-1, 4) for m in maps]
    starts = np.concatenate([[0], np.cumsum([len(p) for p in parts])[:-1]])
    return np.concatenate(parts), np.column_stack([starts, [len(m) for m in maps]]).astype(np.int32)


def _quarters(values: Float32) -> Float32:
    """The sum of every four neighbours; an odd last row or column is left out."""
    height, width = values.shape[0] // 2 * 2, values.shape[1] // 2 * 2
    left, right = values[:height, 0:width:2], values[:height, 1:width:2]
    return left[::2] + left[1::2] + right[::2] + right[1::2]


def _half(picture: Float32) -> Float32:
    """An equirectangular picture at half its size."""
    return _quarters(picture) * np.float32(0.25)


def _halved(values: Float32) -> Float32:
    """An octahedral map at half its size; each texel counts as large as it is."""
    area = kernels.solid_angles(len(values))[..., None]
    return _quarters(values * area) / _quarters(area)


def _bordered(values: Float32) -> Float32:
    """The map with a border of one texel, so that four neighbours can be read anywhere: (size + 2, size + 2, 4)."""
    out = np.pad(values, ((1, 1), (1, 1), (0, 0)))
    out[0, 1:-1], out[-1, 1:-1] = values[0, ::-1], values[-1, ::-1]
    out[1:-1, 0], out[1:-1, -1] = values[::-1, 0], values[::-1, -1]
    out[0, 0], out[0, -1], out[-1, 0], out[-1, -1] = values[-1, -1], values[-1, 0], values[0, -1], values[0, 0]
    return out


def _lobe_samples(rough: float, rings: int, width: int, levels: int) -> Float32:
    """Directions around +z where GGX of this perceptual roughness mirrors a ray along its normal, (S, 5).

    x, y, z; weights, as Karis 2013, which add up to 1; the level of maps of `width` whose texels are as large as what
    each sample stands for.
    """
    square, spokes = rough**4, rings + 4
    quantile, spoke = np.meshgrid((np.arange(rings) + 0.5) / rings, np.arange(spokes), indexing="ij")
    cosine2 = (1 - quantile) / (1 + (square - 1) * quantile)
    turn = (spoke + 0.618 * np.arange(rings)[:, None]) * (2 * math.pi / spokes)
    z = 2 * cosine2 - 1
    across = np.sqrt(np.maximum(1 - z * z, 0))
    density = square / (math.pi * (cosine2 * (square - 1) + 1) ** 2) / 4
    texel = 4 * math.pi / width**2
    level = 0.5 * np.log2(1 / (rings * spokes * density) / texel) + 0.5
    level = np.clip(np.round(level), 0, levels - 1)
    weight = np.maximum(z, 0)
    samples = np.stack([across * np.cos(turn), across * np.sin(turn), z, weight / weight.sum(), level], axis=-1)
    return samples[weight > 0].astype(np.float32)


@lru_cache(maxsize=1)
def lobe_albedo(size: int = 32) -> Float32:
    """What GGX with height-correlated Smith reflects in all, (size, size, 2): by perceptual roughness and by the square
    root of the cosine to the viewer, 0 to 1 each.

    First with a Fresnel factor of 1, then with Schlick's power: a surface of reflectance f mirrors f times the first plus
    (1 - f) times the second. Samples of the visible normals (Heitz 2018).
    """
    side = np.linspace(0, 1, size)
    a = np.maximum(side**2, 1e-4)[:, None, None, None]
    v_z = np.maximum(side**2, 1e-4)[None, :, None, None]
    v_x = np.sqrt(1 - v_z**2)
    scale = 1 / np.sqrt((a * v_x) ** 2 + v_z**2)
    w_x, w_z = a * v_x * scale, v_z * scale
    nodes, shares = np.polynomial.legendre.leggauss(12)
    radius = np.sqrt((nodes + 1) / 2)[:, None]
    angle = (np.arange(32) + 0.5) * (2 * math.pi / 32)
    p, q = radius * np.cos(angle), radius * np.sin(angle)
    s = (1 + w_z) / 2
    q = (1 - s) * np.sqrt(np.maximum(1 - p * p, 0)) + s * q
    r = np.sqrt(np.maximum(1 - p * p - q * q, 0))
    # Axes: p along y, q along -w's perpendicular in the plane, r along w.
    h_x, h_y, h_z = a * (r * w_x - q * w_z), a * p, np.maximum(r * w_z + q * w_x, 0)
    length = 1 / np.sqrt(h_x**2 + h_y**2 + h_z**2)
    toward = np.clip((h_x * v_x + h_z * v_z) * length, 0, 1)
    l_z = 2 * toward * h_z * length - v_z
    smith_v, smith_l = (np.sqrt(1 + a**2 * (1 - c**2) / np.maximum(c, 1e-6) ** 2) for c in (v_z, l_z))
    left = np.where(l_z > 0, (1 + smith_v) / (smith_v + smith_l), 0)
    each = (shares / 2)[:, None] / len(angle)
    lobe = (left * each).sum(axis=(2, 3))
    return np.stack([lobe, (left * (1 - toward) ** 5 * each).sum(axis=(2, 3))], axis=-1).astype(np.float32)
