"""Light from all directions: a sky baked into maps for matt and shiny surfaces, and into distant lights."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster.indirect.kernels_probes import sky_from
from viewsphere.engines.raster.records import Float32, Int32, PictureRays
from viewsphere.engines.raster.shadows.arriving import arriving
from viewsphere.engines.raster.shadows.kernels_direct_light import DISTANT
from viewsphere.engines.raster.shadows.shadow_maps import Extent, Lights
from viewsphere.engines.raster.sky import kernels_environment as kernels
from viewsphere.model.scene import AnySky, Daylight, Environment, Sky, Sun
from viewsphere.rendering.kept_light import kept_light
from viewsphere.rendering.sky.daylight import daylight_picture, opening
from viewsphere.rendering.sky.environment_file import environment_digest, read_environment
from viewsphere.rendering.sky.sky import HALO, SURROUNDINGS, gradient_share
from viewsphere.rendering.sky.sun import Distant, sun_light

Float = NDArray[np.float64]

_LEVELS = 8  # roughness 0 to 1
_WIDE = 3  # level above which a lobe is so wide that all texels of a map no wider than _COARSE are summed for it
_COARSE = 64  # texels: wider maps are sampled for wide lobes, narrower ones are summed. Chosen by cost, not measured alone
_SMALLEST = 32  # width of a map
_SKY_WIDTH = 256  # width of the sharpest map of a sky without detail
_PICTURE_WIDTH = 512  # width of the sharpest map of a photographed sky
_SKY_HEIGHT = 256  # height of the picture generated for a gradient or daylight
_STEPS = np.array([2.0 ** (k - 24) for k in range(32)], np.float32)  # factors of a packed colour (RGB9_E5), by its exponent
_DISC = 60.0  # maximum radiance of the visible sun's disc: every such pixel is white anyway

# A photographed sun: a bright spot this far from its middle at most, so much above the mean and of so much of all light. Chosen
# so that clear skies have a sun and overcast skies and windows of rooms have none; not measured on a collection.
_SPOT = math.radians(5.0)
_AROUND = math.radians(9.0)
_ABOVE_MEAN = 20.0
_OF_ALL = 0.08
_LOWEST = 0.05  # lowest elevation of a photographed sun, as a sine
_NO_LIGHT: Float = np.zeros((2, 3))


SKY_ROUGHNESS = 0.12
"""Roughness of a mirror whose blur reaches about to the next baked ray."""


class Surrounding(NamedTuple):
    """Light from all directions, as the shading kernels read it. float32 unless stated.

    texels (N, 4): octahedral maps with a border, one after the other; colour, and the share below the horizon; levels (L, 4):
    first texel and width of a map and of the next map. The first map is for matt surfaces (radiance of a white one), the others
    for equal steps of roughness from 0 to 1. light (6, 3): rows of `kernels_environment`, SCALE to BEHIND. Radiance is the
    map's times SCALE plus ABOVE and BELOW times their shares; LAMPS: radiance of the nearby ground from lamps, not included in
    BELOW; TURN: cosine and sine of the maps' turn about z. up (3,): radiance of a white level floor lit from above the horizon
    alone. albedo (A, A, 2): see `lobe_albedo`.

    The sky visible to the camera: picture (P,) uint32, equirectangular, shared exponents; picture_levels (K, 3) int32: first
    texel, width and height; radiance is the picture's times SCALE plus BEHIND. sun (3, 3): the sun's direction, a glow around
    the sun, its disc of half_angle radians.
    """

    texels: Float32
    levels: Float32
    light: Float32
    up: Float32
    albedo: Float32
    picture: NDArray[np.uint32]
    picture_levels: Int32
    sun: Float32
    half_angle: np.float32

    @property
    def scale(self) -> Float32:
        """Factor of the maps' colours, (3,)."""
        return self.light[kernels.SCALE]

    @property
    def below(self) -> Float32:
        """Radiance below the horizon, (3,), without the maps' own."""
        return self.light[kernels.BELOW]

    @property
    def lamps(self) -> Float32:
        """Radiance of the nearby ground from lamps, (3,)."""
        return self.light[kernels.LAMPS]


def sky_along(surrounding: Surrounding, directions: Float32) -> Float32:
    """Radiance from far away along rays (..., 3), with a blur that reaches about to the next ray."""
    light = np.empty(directions.shape, np.float32)
    sky_from(surrounding, directions.reshape(-1, 3), np.float32(SKY_ROUGHNESS), light.reshape(-1, 3))
    return light


class _Maps(NamedTuple):
    """The part of a baked sky that depends neither on its strength, nor on its turn, nor on the ground below it, and is
    therefore cached.
    """

    texels: Float32
    levels: Float32
    up: Float32  # radiance of a white level floor, (4,)
    picture: NDArray[np.uint32]
    picture_levels: Int32


class _Photographed(NamedTuple):
    maps: _Maps
    sun: Distant | None


def sky_lights(sky: AnySky, sun: Sun | None, has_ground: bool) -> tuple[Distant, ...]:
    """The scene's sun and, for a photographed sky, the sun that is cut out of its picture; `bake_surrounding` bakes the rest.

    Raises UserError if the picture cannot be read.
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


def lamps_on_ground(lights: Lights, extent: Extent) -> Float:
    """Mean irradiance / pi, (3,), from lamps on the ground around the targets, without the light that shadows block.

    The mean is over a disc whose radius is half the diagonal of the targets' box.
    """
    n, size = 11, extent.high - extent.low
    reach = 0.5 * float(np.linalg.norm(size))
    steps = (np.arange(n) + 0.5) / n * 2 - 1
    x, y = np.repeat(steps, n), np.tile(steps, n)
    inside = x**2 + y**2 <= 1
    middle = (extent.low + extent.high) / 2
    # A little below the ground, so that things lying on the ground hide the light of lamps within them.
    height = np.full(int(inside.sum()), extent.low[2] - 0.01 * reach)
    places = np.stack([middle[0] + reach * x[inside], middle[1] + reach * y[inside], height], axis=1)
    lamps = [arriving(lights, k, places, reach / n) for k in np.flatnonzero(lights.kind != DISTANT).tolist()]
    total = sum((irradiance.T @ share for irradiance, share in lamps), np.zeros(3))
    return np.asarray(total, np.float64) / (len(places) * math.pi)


def bake_surrounding(
    sky: AnySky,
    sun: Sun | None,
    ground: Float | None,
    lights: Sequence[Distant] = (),
    even: Float = _NO_LIGHT,
    lamps: Float | None = None,
) -> Surrounding:
    """Bake all light of the sky except `sky_lights`. The slow part is cached and depends only on the sky.

    ground (3,): linear colour of a ground that hides the lower half and reflects the light it receives from the sky and from
    `shadow_maps`; None without a ground: a generated sky is then grey below the horizon, a photographed one has its own lower
    half. even: radiance from above and below of hemisphere lights, (2, 3); lamps (3,): `lamps_on_ground`, None without lamps.
    Raises UserError if a picture cannot be read.
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
    close = np.zeros(3) if ground is None or lamps is None else np.asarray(ground) * lamps
    seen_sun, half_angle = _visible_sun(sky, sun)
    return Surrounding(
        texels=maps.texels,
        levels=maps.levels,
        light=np.array([scale, above, below, close, [*turn, 0.0], behind], np.float32),
        up=up.astype(np.float32),
        albedo=lobe_albedo(),
        picture=maps.picture,
        picture_levels=maps.picture_levels,
        sun=seen_sun.astype(np.float32),
        half_angle=np.float32(half_angle),
    )


def sky_behind(view: PictureRays, surrounding: Surrounding, radiance: Float32) -> None:
    """Composite radiance (N, 4), scene-linear and premultiplied, over the sky, in place; there is no sky if the lens has no
    ray.
    """
    cosine, sine = surrounding.light[kernels.TURN, :2]
    turn = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]], np.float64)
    to_map = turn @ view.rotation.T
    has_rays = len(view.rays) > 0
    if not has_rays:
        lens = np.eye(3)
        lens[:2] = view.lens
        to_map = to_map @ lens
    # The mip level of the picture whose texels are about as large as a pixel.
    texels = view.spread * float(surrounding.picture_levels[0, 1]) / (2 * math.pi)
    level = min(math.floor(math.log2(max(texels, 1.0)) + 0.5), len(surrounding.picture_levels) - 1)
    sun, numbers = surrounding.sun, np.zeros((9, 3), np.float32)
    numbers[:3], numbers[3] = to_map, turn @ sun[0]
    numbers[4], numbers[5] = surrounding.light[kernels.SCALE], surrounding.light[kernels.BEHIND]
    numbers[6:8], numbers[8, :2] = sun[1:], (surrounding.half_angle, 1 / max(view.spread, 1e-6))
    kernels.lay_over_sky(
        view.rays if has_rays else view.places, np.int32(view.columns), numbers.ravel(), surrounding.picture,
        *surrounding.picture_levels[level], np.empty(kernels.ROWS * kernels.CHUNK, np.float32), radiance,
    )  # fmt: skip


def _turn(degrees: float) -> tuple[float, float]:
    return math.cos(math.radians(degrees)), math.sin(math.radians(degrees))


def _sky_parts(sky: AnySky, sun: Sun | None, has_ground: bool) -> tuple[_Maps, Float, Float, tuple[float, float]]:
    """The sky's maps, the factor of their colours, the colour added above the horizon, cosine and sine of the maps' turn."""
    if isinstance(sky, Environment):
        maps = _photographed(_key(sky.file), has_ground).maps
        return maps, np.full(3, sky.strength), np.zeros(3), _turn(sky.rotation_deg)
    if isinstance(sky, Daylight):
        sun = sun or Sun()
        maps = _daylight_maps(sky.turbidity, sky.clouds, sun.elevation)
        strength = sky.strength * opening(sun.elevation, sky)
        return maps, np.full(3, strength), np.zeros(3), _turn(sun.azimuth - 90)
    zenith, horizon = (sky.strength * np.array(c) for c in (sky.zenith, sky.horizon))
    return _gradient_maps(), zenith - horizon, horizon, (1.0, 0.0)


def _visible_sun(sky: AnySky, sun: Sun | None) -> tuple[Float, float]:
    """(3, 3): the sun's direction, its glow on a gradient, its disc's radiance in daylight; the disc's half angle, radians."""
    light = None if isinstance(sky, Environment) else sun_light(sky, sun)
    if light is None:
        return np.array([[0.0, 0.0, 1.0], np.zeros(3), np.zeros(3)]), 0.0
    irradiance = np.array(light.irradiance)
    if isinstance(sky, Sky):
        return np.array([light.direction, HALO * irradiance, np.zeros(3)]), 0.0
    half = math.radians(max(light.angle_deg, 0.3)) / 2
    radiance = irradiance / (math.pi * half * half)
    return np.array([light.direction, np.zeros(3), radiance * min(1.0, _DISC / float(radiance.max()))]), half


@lru_cache(maxsize=1)
def _gradient_maps() -> _Maps:
    """Maps that all gradients use: the position of each direction between the horizon's colour and the zenith's, 0 to 1."""
    return kept_light(("gradient",), _make_gradient_maps, (_Maps,))


def _make_gradient_maps() -> _Maps:
    height = _SKY_HEIGHT
    sine = np.maximum(np.sin((0.5 - (np.arange(height) + 0.5) / height) * np.pi), 0)
    share = gradient_share(sine).astype(np.float32)
    return _maps(np.ascontiguousarray(np.broadcast_to(share[:, None, None], (height, 2 * height, 3))), _SKY_WIDTH, True)


@lru_cache(maxsize=4)
def _daylight_maps(turbidity: float, clouds: float, elevation_deg: float) -> _Maps:
    sky = Daylight(turbidity=turbidity, clouds=clouds)

    def make() -> _Maps:
        return _maps(daylight_picture(elevation_deg, sky, _SKY_HEIGHT), _SKY_WIDTH, True)

    return kept_light(("daylight", turbidity, clouds, elevation_deg), make, (_Maps,))


def _key(file: str) -> tuple[str, int, int]:
    """A key of path, size and modification time, so that a changed file is read again."""
    try:
        facts = Path(file).stat()
    except OSError:
        return file, 0, 0
    return file, facts.st_size, facts.st_mtime_ns


@lru_cache(maxsize=3)
def _photographed(key: tuple[str, int, int], has_ground: bool) -> _Photographed:
    file = Path(key[0])

    def make() -> _Photographed:
        pixels = read_environment(file).pixels
        left, sun = without_sun(pixels)
        return _Photographed(_maps(left, _PICTURE_WIDTH, has_ground, pixels), sun)

    return kept_light(("photographed", environment_digest(file), has_ground), make, (_Photographed, _Maps, Distant))


def without_sun(pixels: Float32) -> tuple[Float32, Distant | None]:
    """An equirectangular picture without its sun, and that sun; the unchanged picture and None if there is no small bright
    spot.

    The spot's excess over the light of the sky around it goes to the sun, so that both together light a scene as before.
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
    """Bake an equirectangular picture of the light, and, if `seen` is given, another one that replaces it for the camera."""
    pictures = [lighting if seen is None else seen]
    while min(pictures[-1].shape[:2]) >= 8:
        pictures.append(_half(pictures[-1]))
    source = lighting
    while source.shape[1] > 4 * width:
        source = _half(source)
    mirror = np.zeros((width, width, 4), np.float32)
    kernels.octahedral(source, has_ground, mirror)
    chain = [mirror]
    while len(chain[-1]) > 8:
        chain.append(_halved(chain[-1]))
    texels, levels = _joined(chain)
    coarse = next(m for m in chain if len(m) <= _COARSE)
    matt = _gathered(coarse, _SMALLEST, 1.0)
    maps = [matt, mirror]
    for k in range(1, _LEVELS - 1):
        rough, size = k / (_LEVELS - 1), max(width >> (2 * k - 1), _SMALLEST)
        if k < _WIDE:
            blurred = np.empty((size, size, 4), np.float32)
            samples = _lobe_samples(rough, 8 * k * k, width, len(chain))
            kernels.blurred(texels, levels, samples, _frames(size), blurred.reshape(-1, 4))
            maps.append(blurred)
        else:
            maps.append(_gathered(coarse, size, rough**4))
    maps.append(matt)
    sizes = np.array([p.shape[1::-1] for p in pictures])
    starts = np.concatenate([[0], np.cumsum(sizes.prod(axis=1))[:-1]])
    middle = _SMALLEST // 2
    texels, levels = _joined(maps)
    return _Maps(
        texels,
        np.hstack([levels[:-1], levels[1:]]).astype(np.float32),
        matt[middle - 1 : middle + 1, middle - 1 : middle + 1].mean(axis=(0, 1)),
        np.concatenate([_packed(p) for p in pictures]),
        np.column_stack([starts, sizes]).astype(np.int32),
    )


def _directions(size: int) -> Float:
    """Unit directions of the texels of an octahedral map, (size * size, 3)."""
    v, u = (a.ravel() for a in np.meshgrid(*[(2 * np.arange(size) + 1) / size - 1] * 2, indexing="ij"))
    z = 1 - abs(u) - abs(v)
    x = np.where(z < 0, (1 - abs(v)) * np.sign(u), u)
    y = np.where(z < 0, (1 - abs(u)) * np.sign(v), v)
    return np.stack([x, y, z], axis=-1) / np.sqrt(x * x + y * y + z * z)[:, None]


def _solid_angles(size: int) -> Float32:
    """Solid angle of each texel of an octahedral map, (size, size)."""
    side = np.abs((2 * np.arange(size, dtype=np.float32) + 1) / size - 1)
    a, b = side[:, None], side
    # On the octahedron's face an area is its projection's times sqrt 3, at distance 1 / sqrt 3 from the middle.
    square = np.where(a + b > 1, (1 - a) ** 2 + (1 - b) ** 2, a * a + b * b) + (1 - a - b) ** 2
    return (4 / size**2 / (square * np.sqrt(square))).astype(np.float32)


def _frames(size: int) -> Float32:
    """Two axes across each texel's direction in an octahedral map, and that direction, (size * size, 9); Duff et al. 2017."""
    x, y, z = _directions(size).T
    sign = np.where(z >= 0, 1.0, -1.0)
    a = -1 / (sign + z)
    b = x * y * a
    frames = [1 + sign * x * x * a, sign * b, -sign * x, b, sign + y * y * a, -y, x, y, z]
    return np.stack(frames, axis=-1).astype(np.float32)


def _gathered(values: Float32, size: int, square: float) -> Float32:
    """Return the light that a wide lobe around each direction receives from a map, (size, size, 4).

    square: GGX's alpha squared, 1 if matt.
    """
    area = _solid_angles(len(values)).reshape(-1, 1)
    source = np.hstack([_directions(len(values)), values.reshape(-1, 4) * area, area]).T.astype(np.float32, order="C")
    out = np.empty((size, size, 4), np.float32)
    half, targets = np.float32(0.5 * (square - 1)), _directions(size).astype(np.float32)
    kernels.gathered(source, half, targets, out.reshape(-1, 4))
    return out


def _packed(picture: Float32) -> NDArray[np.uint32]:
    """A picture (H, W, 3) as (H * W,) uint32: nine bits for each colour and five for their common exponent (OpenGL's RGB9_E5),
    exact to 0.4 % of a pixel's brightest colour.
    """
    colors = [np.clip(picture[..., c].ravel(), 0, np.float32(65408)) for c in range(3)]
    most = np.maximum(np.maximum(colors[0], colors[1]), colors[2])
    # float32's own exponent is 126 more than that of a mantissa below 1; from 511.5 steps on rounding needs the next exponent.
    shared = np.maximum((most.view(np.int32) >> 23) - (126 - 15), 0)
    shared += most >= np.float32(511.5) * _STEPS[shared]
    scale = 1 / _STEPS[shared]
    red, green, blue = ((c * scale + np.float32(0.5)).astype(np.int32) for c in colors)
    return (red | green << 9 | blue << 18 | shared << 27).view(np.uint32)


def _joined(maps: Sequence[Float32]) -> tuple[Float32, Int32]:
    """Maps with their borders in one array, and first texel and width of each map."""
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
    """An octahedral map at half its size; each texel is weighted by its solid angle."""
    area = _solid_angles(len(values))[..., None]
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

    Columns: x, y, z; weights that add up to 1 (Karis 2013); the mip level, in maps of `width`, whose texels have the solid
    angle that the sample represents.
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
def lobe_albedo() -> Float32:
    """The cached result of `_make_lobe_albedo`."""
    return kept_light(("lobe albedo",), _make_lobe_albedo, ())


def _make_lobe_albedo(size: int = 32) -> Float32:
    """The share of white light that GGX with height-correlated Smith reflects in total, (size, size, 2): by perceptual
    roughness and by the square root of the cosine to the viewer, both from 0 to 1.

    Column 0 is for a Fresnel factor of 1, column 1 for Schlick's power alone: a surface of reflectance f reflects f times
    column 0 plus (1 - f) times column 1. Integrated over visible normals (Heitz 2018).
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
