"""The conversion of scene-linear light to a picture: exposure, white balance, view transform, composite, sRGB curve.

A *radiance* is scene-linear, premultiplied red, green, blue and alpha (the share of the pixel that is covered). It is
unpremultiplied, balanced (`white`), multiplied by `EXPOSURE` and by two to the stops, transformed to *display-linear* values in
[0, 1], and laid over a background, which is display-linear already and shown exactly.

The transforms, x being the exposed light:

- `standard`: x up to `KNEE`, above it k + (1 - k) y / (1 + y) with y = (x - k) / (1 - k), for each of red, green and blue:
  colours up to the knee are unchanged, and nothing is ever clipped.
- `filmic`: the film-like curve of Narkowicz, *ACES Filmic Tone Mapping Curve* (2016; CC0 or MIT), x scaled so that middle grey,
    0.18, is unchanged. The curve is applied to the largest and the smallest of the three channels; the middle one keeps
  its relative place between them, as Adobe's DNG specification has it: so the hue is kept.
- `agx`: Troy Sobotka's AgX (https://github.com/sobotka/AgX) in the shape of Wrensch, *Minimal AgX Implementation* (2023; MIT):
  colours are drawn towards grey by a fifth, 16.5 stops around middle grey go through a sigmoid of their logarithm, the
  colours are drawn out again and decoded with the exponent 2.2. Bright saturated light goes to white.
- `raw`: x, clipped at 1.

Grey stays grey, more light never looks darker, and the order of red, green and blue never changes.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewsphere.codecs.srgb import encoded
from viewsphere.model.scene import ViewTransform
from viewsphere.rendering.white import white_balance

Float32 = NDArray[np.float32]
Bytes = NDArray[np.uint8]

EXPOSURE = 0.7
"""Display value of unit radiance, chosen so that level ground under the default sun and sky shows its own colour."""

KNEE = 0.6
"""`standard` leaves display values up to this unchanged."""

TRANSFORMS = ("standard", "filmic", "agx", "raw")
"""The names of the view transforms."""

AGX_STOPS = (-10.0, 6.5)
"""The range that AgX shows, in stops from middle grey, 0.18."""


def develop(radiance: Float32, background: Float32 | None, view: ViewTransform, alpha: bool = False) -> Bytes:
    """The picture without smoother and effects, (H, W, 3) uint8 sRGB, in one pass over the pixels.

    `radiance` (H, W, 4) float32; `background` display-linear, (H * W, 3) or, one colour everywhere, (1, 3); None is black.
    With `alpha` the background is ignored and the picture is (H, W, 4): straight alpha, so that edges have no fringe.
    """
    from viewsphere.rendering import kernels_view as kernels

    out, curve = np.empty((*radiance.shape[:2], 4 if alpha else 3), np.uint8), srgb_bytes()
    if view.transform == "standard" and not alpha:
        p = np.zeros(4 * kernels.BLOCK, np.float32)
        kernels.standard_bytes(radiance.reshape(-1), _exposure_matrix(view), _rows(background), curve, p, _rows(out))
        return out
    for p, part, under in _blocks(radiance, background, view):
        if alpha:
            kernels.straight_bytes(p, curve, _rows(out)[part])
        else:
            kernels.over_bytes(p, under, curve, _rows(out)[part])
    return out


def to_display_linear(radiance: Float32, background: Float32 | None, view: ViewTransform, alpha: bool = False) -> Float32:
    """The result of `develop` before the sRGB curve: (H, W, 3) float32 in [0, 1]; with `alpha` (H, W, 4), premultiplied."""
    from viewsphere.rendering import kernels_view as kernels

    out = np.empty((*radiance.shape[:2], 4 if alpha else 3), np.float32)
    for p, part, under in _blocks(radiance, background, view):
        kernels.over(p, under, _rows(out)[part])
    return out


def to_bytes(picture: Float32) -> Bytes:
    """sRGB bytes of a display-linear picture (H, W, 3), or (H, W, 4) premultiplied, which becomes straight."""
    from viewsphere.rendering import kernels_view as kernels

    out = np.empty(picture.shape, np.uint8)
    kernels.encode(_rows(picture), srgb_bytes(), _rows(out))
    return out


def to_words(picture: Float32) -> NDArray[np.uint16]:
    """sRGB levels of a display-linear picture (H, W, 3), 0 to 65535: within half a level, and never by way of eight bits."""
    place = np.clip(picture, 0, 1) * np.float32(65535)
    low = np.minimum(place.astype(np.int32), 65534)
    curve = _srgb_curve()
    return np.rint((curve[low] + (curve[low + 1] - curve[low]) * (place - low)) * 65535).astype(np.uint16)


def bytes_of_words(picture: NDArray[np.uint16]) -> Bytes:
    """A picture of 65,536 levels in 256, rounded."""
    return ((picture.astype(np.uint32) + 128) // 257).astype(np.uint8)


def scene_linear(radiance: Float32, background: Float32 | None, view: ViewTransform) -> Float32:
    """The light of a picture before exposure, (H, W, 3) float32, 0 or more; arguments as for `develop`.

    A background, which is shown exactly, has the light that the transform `raw` would show as the background's colours.
    """
    light = radiance[..., :3]
    if background is not None:
        inverse = np.linalg.inv(_exposure_matrix(view).astype(np.float64))
        under = (_rows(background) @ inverse.T).astype(np.float32)
        under = under if len(under) == 1 else under.reshape(light.shape)
        light = light + (1 - radiance[..., 3:]) * under
    return np.maximum(np.ascontiguousarray(light), np.float32(0))


def picture_of_light(light: Float32, view: ViewTransform) -> Bytes:
    """The picture (H, W, 3) uint8 of scene-linear light (H, W, 3), without smoother and effects."""
    return develop(np.dstack([light, np.ones(light.shape[:2], np.float32)]), None, view)


def _exposure_matrix(view: ViewTransform) -> Float32:
    """White balance and exposure in one matrix, (3, 3) float32: scene-linear to exposed light."""
    return (white_balance(view.temperature_k, view.tint) * (EXPOSURE * 2.0**view.exposure)).astype(np.float32)


def agx_sigmoid(light: ArrayLike) -> NDArray[np.float64]:
    """Display code values in [0, 1] for linear light: a sigmoid of its stops through (0, 0), (pivot, 1/2) and (1, 1).

    Both halves are m d / (1 + c d^e)^(1/e), d the distance from the pivot, slope m = 2, exponents 3 below and 3.25 above.
    """
    low, high = AGX_STOPS
    darkest = 0.18 * 2.0**low
    x = np.minimum(np.log2(np.maximum(light, darkest) / darkest) / (high - low), 1)
    pivot = -low / (high - low)

    def half(d: NDArray[np.float64], span: float, e: float) -> NDArray[np.float64]:
        c = ((2 * span / 0.5) ** e - 1) / span**e
        return 2 * d / (1 + c * d**e) ** (1 / e)

    return 0.5 - half(np.maximum(pivot - x, 0), pivot, 3.0) + half(np.maximum(x - pivot, 0), 1 - pivot, 3.25)


@cache
def _agx_tables() -> tuple[Float32, Float32]:
    """The sigmoid at 256 steps of each power of two from 2^-13 to 2^5; and x^2.2 at steps of 1/1024 from 0 to 1, plus one entry
    beyond.
    """
    octaves = 2.0 ** np.arange(-13, 5)[:, None] * (1 + np.arange(256) / 256)
    sigmoid = agx_sigmoid(np.append(octaves.reshape(-1), 32.0))
    decoded = np.minimum(np.arange(1026) / 1024, 1) ** 2.2
    return sigmoid.astype(np.float32), decoded.astype(np.float32)


def _blocks(radiance: Float32, background: Float32 | None, view: ViewTransform) -> Iterator[tuple[Float32, slice, Float32]]:
    """Blocks of display-linear light, as `kernels_view` has them, the pixels that each block holds, and their background."""
    from viewsphere.rendering import kernels_view as kernels

    rows, under, matrix = _rows(radiance), _rows(background), _exposure_matrix(view)
    p = np.zeros(4 * kernels.BLOCK, np.float32)
    light = p[: 3 * kernels.BLOCK]
    for first in range(0, len(rows), kernels.BLOCK):
        part = slice(first, first + kernels.BLOCK)
        kernels.expose(rows[part].reshape(-1), matrix, p)
        if view.transform == "standard":
            kernels.standard(p)
        elif view.transform == "filmic":
            kernels.filmic(p)
        elif view.transform == "agx":
            kernels.agx(p, *_agx_tables())
        else:
            np.minimum(light, 1, out=light)
        yield p, part, under if len(under) == 1 else under[part]


def _rows(picture: NDArray[Any] | None) -> NDArray[Any]:
    return np.zeros((1, 3), np.float32) if picture is None else picture.reshape(-1, picture.shape[-1])


@cache
def srgb_bytes() -> Bytes:
    """The sRGB bytes (IEC 61966-2-1) of 65,536 linear values from 0 to 1, fine enough for every byte to have a value."""
    return np.round(encoded(np.arange(65536) / 65535) * 255).astype(np.uint8)


@cache
def _srgb_curve() -> NDArray[np.float64]:
    """The sRGB values (IEC 61966-2-1) of 65,536 linear values from 0 to 1; lines between them are within 0.005 / 65535."""
    return encoded(np.arange(65536) / 65535)
