"""The background behind all objects, scenery and ground: a plain colour or a picture, display-linear."""

from __future__ import annotations

import math
import warnings
from collections.abc import Generator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.orientation import SWAPPED, orientation
from viewsphere.codecs.srgb import linear
from viewsphere.errors import RecipeError
from viewsphere.files import open_file
from viewsphere.limits import limits
from viewsphere.model.scene import Background

if TYPE_CHECKING:
    from PIL.Image import Image

Float32 = NDArray[np.float32]
Box = tuple[float, float, float, float]
Size = tuple[int, int]
Rgb = tuple[int, int, int]

FORMATS = ("PNG", "JPEG", "WEBP", "BMP", "GIF", "TIFF", "TGA", "PPM")

KEPT_BYTES = 128 << 20
"""Limit in bytes of the cache of decoded pictures, which keeps the last ones used."""

COARSE = 4.0
"""Sigma, in pixels, above which a picture is blurred at a lower resolution."""

SMALLEST = 48
"""Smallest side, in pixels, to which a picture is reduced for blurring."""


def shows_sky(background: Background) -> bool:
    """Return whether the sky is seen where nothing else is."""
    return not background.transparent and background.color is None and background.image is None


def display_background(background: Background, width: int, height: int) -> Float32 | None:
    """The background as (height * width, 3) display-linear, exact in sRGB bytes; None for the sky, and for no background.

    Transparent parts of a picture show the background's colour, or white without one. The array is cached for the next frame
    and must not be modified. Raises RecipeError for a picture that cannot be read or has more pixels than `limits` allows.
    """
    if background.transparent or shows_sky(background):
        return None
    stamp = 0 if background.image is None else _stamp(background.image)
    return _painted(background.model_dump_json(), stamp, width, height)


@lru_cache(maxsize=1)
def _painted(described: str, stamp: int, width: int, height: int) -> Float32:
    from PIL.Image import Resampling

    background = Background.model_validate_json(described)
    r, g, b = (round(255 * min(c, 1.0)) for c in background.color or (1.0, 1.0, 1.0))
    if background.image is None:
        return np.tile(_display_linear()[[r, g, b]], (height * width, 1))
    size, orientation = _head(background.image, stamp)
    part = _part(background, size, width / height)
    spare = min((part[2] - part[0]) / width, (part[3] - part[1]) / height)
    step = 2 ** max(0, math.floor(math.log2(spare)))
    picture = _shelf().picture(_Wanted(background.image, stamp, step, (r, g, b)))
    reduced = _reduced(part, size, step, orientation, picture.size)
    shown = np.asarray(picture.resize((width, height), Resampling.BICUBIC, reduced))
    if background.flip:
        shown = shown[:, ::-1]
    return _blurred(_display_linear()[shown], background.blur * width).reshape(-1, 3)


@cache
def _display_linear() -> Float32:
    """Linear values of the 256 sRGB bytes."""
    return linear(np.arange(256) / 255).astype(np.float32)


def _part(background: Background, size: Size, proportions: float) -> Box:
    """The visible part of a picture: left, top, right, bottom in its pixels. `proportions`: the frame's width / height."""
    width, height = float(size[0]), float(size[1])
    if background.fit == "stretch":
        return 0.0, 0.0, width, height
    zoom, (x, y) = (background.zoom, background.place) if background.fit == "crop" else (1.0, (0.5, 0.5))
    across, down = min(width, height * proportions) / zoom, min(height, width / proportions) / zoom
    left, top = x * (width - across), y * (height - down)
    return left, top, min(left + across, width), min(top + down, height)


def _reduced(part: Box, size: Size, step: int, orientation: int, found: Size) -> Box:
    """A part of a picture of this size in the pixels of the decoded picture of size `found`, which is `step` times smaller.

    If the size is not a multiple of `step`, the last pixels of the file's rows and columns cover fewer than `step` original
    pixels. In a rotated picture these pixels may come first.
    """
    before = [
        found[axis] - size[axis] / step if orientation in turned else 0.0
        for axis, turned in enumerate(((2, 3, 6, 7), (3, 4, 7, 8)))
    ]
    left, top, right, bottom = (min(max(edge / step + before[i % 2], 0.0), found[i % 2]) for i, edge in enumerate(part))
    return left, top, right, bottom


@dataclass(frozen=True)
class _Wanted:
    """A picture to decode: reduced by the whole factor `step`, its transparent parts laid over a colour."""

    path: str
    stamp: int
    step: int
    under: Rgb


@dataclass(eq=False)
class _Shelf:
    """A cache of decoded pictures, as many as `KEPT_BYTES` allow, since a run reuses the same pictures many times."""

    _pictures: dict[_Wanted, Image] = field(default_factory=dict["_Wanted", "Image"])

    def picture(self, wanted: _Wanted) -> Image:
        """The picture, upright, RGB; raises RecipeError when it cannot be read."""
        decoded = self._pictures.pop(wanted, None) or _decoded(wanted)
        self._pictures[wanted] = decoded  # the most recently used is dropped last
        held = sum(4 * p.width * p.height for p in self._pictures.values())
        while held > KEPT_BYTES and len(self._pictures) > 1:
            first = self._pictures.pop(next(iter(self._pictures)))
            held -= 4 * first.width * first.height
        return decoded


@cache
def _shelf() -> _Shelf:
    return _Shelf()


def _stamp(path: str) -> int:
    """The file's modification time, so that a changed file is read again."""
    try:
        return Path(path).stat().st_mtime_ns
    except OSError as error:
        _refuse(path, error.strerror or str(error))


@lru_cache(maxsize=4096)
def _head(path: str, stamp: int) -> tuple[Size, int]:
    """Width and height of the upright picture, and EXIF's orientation."""
    with _opened(path) as picture:
        width, height = picture.size
        turn = orientation(picture)
    if width * height > limits.MAX_PICTURE_PIXELS:
        _too_large(path, f"{width} x {height}")
    return ((height, width) if turn in SWAPPED else (width, height)), turn


@contextmanager
def _opened(path: str) -> Generator[Image]:
    from PIL import Image, UnidentifiedImageError

    with ExitStack() as then:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # warnings of large pictures: `limits` decides on these
                stream = then.enter_context(open_file(Path(path), "MAX_PICTURE_BYTES"))
                picture = then.enter_context(Image.open(stream, formats=FORMATS))
        except UnidentifiedImageError:
            _refuse(path, f"none of {', '.join(FORMATS)}")
        except Image.DecompressionBombError:
            _too_large(path, "many more")
        except (OSError, ValueError, SyntaxError) as error:
            _refuse(path, (error.strerror if isinstance(error, OSError) else None) or str(error))
        yield picture


def _decoded(wanted: _Wanted) -> Image:
    """The picture, upright, RGB; each side `step` times smaller, rounded up."""
    from PIL.Image import Transpose

    turns = {
        2: [Transpose.FLIP_LEFT_RIGHT],
        3: [Transpose.ROTATE_180],
        4: [Transpose.FLIP_TOP_BOTTOM],
        5: [Transpose.TRANSPOSE],
        6: [Transpose.ROTATE_270],
        7: [Transpose.TRANSVERSE],
        8: [Transpose.ROTATE_90],
    }
    with _opened(wanted.path) as picture:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                turned, width = orientation(picture), picture.width
                picture.draft(None, (picture.width // wanted.step, picture.height // wanted.step))
                plain = _opaque(picture, wanted.under)
        except MemoryError:
            raise
        except Exception as error:  # decoders raise the errors of their formats' parsers
            _refuse(wanted.path, str(error))
    left = wanted.step * plain.width // width
    upright = plain.reduce(left) if left > 1 else plain
    for turn in turns.get(turned, ()):
        upright = upright.transpose(turn)
    return upright


def _opaque(picture: Image, under: Rgb) -> Image:
    """The picture as RGB, laid over a colour where it is transparent; 16-bit greys keep their upper byte, floats are 0 to 1."""
    from PIL import Image

    if picture.mode.startswith("I"):
        grey = np.clip(np.asarray(picture).astype(np.int64) >> 8, 0, 255)
        return Image.fromarray(grey.astype(np.uint8)).convert("RGB")
    if picture.mode == "F":
        grey = np.clip(np.nan_to_num(np.asarray(picture)), 0, 1) * 255
        return Image.fromarray(np.round(grey).astype(np.uint8)).convert("RGB")
    if not picture.has_transparency_data:
        return picture.convert("RGB")
    clear = picture.convert("RGBA")
    plain = Image.new("RGB", clear.size, under)
    plain.paste(clear, mask=clear)
    return plain


def _blurred(pixels: Float32, sigma: float) -> Float32:
    """A picture (H, W, 3) under a Gaussian of `sigma` pixels, mirrored at its borders so that no light is lost."""
    from PIL import Image

    height, width = pixels.shape[:2]
    factor = max(1.0, min(sigma / COARSE, min(height, width) / SMALLEST))
    if factor == 1:
        return _convolved(_convolved(pixels, sigma**2, 0), sigma**2, 1)
    small = max(1, round(width / factor)), max(1, round(height / factor))
    coarse = np.stack([_scaled(pixels[..., c], small, Image.Resampling.BILINEAR) for c in range(3)], axis=-1)
    for axis in (0, 1):
        cell = pixels.shape[axis] / coarse.shape[axis]
        coarse = _convolved(coarse, (sigma / cell) ** 2 - 1 / 6, axis)  # less the variance that the reduction has added
    fine = [_scaled(coarse[..., c], (width, height), Image.Resampling.BICUBIC) for c in range(3)]
    return np.clip(np.stack(fine, axis=-1), 0, 1)


def _scaled(plane: Float32, size: tuple[int, int], filter: int) -> Float32:
    from PIL import Image

    return np.asarray(Image.fromarray(np.ascontiguousarray(plane)).resize(size, Image.Resampling(filter)))


def _convolved(pixels: Float32, variance: float, axis: int) -> Float32:
    """The picture blurred along one axis by a Gaussian of this variance, in pixels squared."""
    from viewsphere.rendering.spread import gaussian, spread

    if variance < 1 / 12:
        return pixels
    profile = gaussian(math.sqrt(variance - 1 / 12))  # the box of a pixel itself has the variance 1/12
    reach = len(profile) // 2
    padded = np.pad(pixels, [(reach, reach) if a == axis else (0, 0) for a in range(3)], mode="symmetric")
    inside = slice(reach, -reach)
    if axis == 0:
        return spread(padded, profile[:, None])[inside]
    return spread(padded, profile[None, :])[:, inside]


def _refuse(path: str, problem: str) -> NoReturn:
    problem = " ".join(problem.split())[:200]
    raise RecipeError(
        f"scene.background: background image {path}: expected a readable image, found {problem}: mend or remove it"
    ) from None


def _too_large(path: str, found: str) -> NoReturn:
    most = f"{limits.MAX_PICTURE_PIXELS:,} pixels"
    raise RecipeError(f"scene.background: background image {path}: expected at most {most}, found {found}: make it smaller")
