"""Environment pictures of the whole sphere: Radiance HDR (RGBE), OpenEXR, and ordinary pictures as a fallback."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.paths.folder import UnreadableError
from viewsphere.errors import RecipeError
from viewsphere.files import check_file, open_file, read_bytes
from viewsphere.limits import limits
from viewsphere.rendering.kept_light import kept_light
from viewsphere.rendering.sky.environment_head import EXPECTED, ExrHead, HdrHead, check_shape, openexr, read_head, silenced

Float32 = NDArray[np.float32]

FIELD = "scene.sky.hdri"
"""The recipe's field that names environment pictures, for messages."""

LIBRARIES = ("openexr", "pillow")
"""Packages that decode environment pictures."""

SHARPEST = 4096
"""Greatest width, in texels, at which an environment is kept."""

_MOST_MENDED = 0.01  # greatest share of texels that may be NaN
_BRIGHTEST = 1e6  # radiance above which a texel counts as infinite
_ROUNDING = -1e-3  # negative radiance down to this counts as a compression error


@dataclass(frozen=True, eq=False)
class _EnvironmentPicture:
    """pixels (H, W, 3) float32: linear radiance, none negative, rows from the zenith down; notes: the repairs that were
    needed, without the file's name.
    """

    pixels: Float32
    notes: tuple[str, ...]


def read_environment(path: Path) -> _EnvironmentPicture:
    """Read an equirectangular picture, reduced to at most `SHARPEST` wide. Its content, not its name, determines the format.

    A few NaN texels become 0, infinite ones the greatest finite radiance, negative ones 0. PNG, JPEG and similar pictures are
    read as sRGB. Raises RecipeError, beginning with the recipe's field, for a file that does not exist, cannot be read, is
    damaged, has more pixels than `limits` allows, is not twice as wide as high, or is NaN in more than a hundredth of its
    texels.
    """
    try:
        return _read(path)
    except UnreadableError as error:
        raise RecipeError(f"{FIELD}: {error}") from None


def environment_digest(path: Path) -> str:
    """The digest of everything from which `read_environment` computes its result. Raises RecipeError if the file cannot be
    read.
    """
    try:
        with open_file(path, "MAX_PICTURE_BYTES") as file:
            content = hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise RecipeError(f"{FIELD}: {_error(path, f'found {error.strerror or error}')}") from None
    return " ".join([content, *map(_version, LIBRARIES), str(limits.MAX_PICTURE_PIXELS)])


def environment_notes(path: Path) -> tuple[str, ...]:
    """The repairs that a picture needs. Unlike `read_environment`, does not decode a picture whose result the cache holds;
    raises as it does.
    """
    notes = kept_light(("repairs", environment_digest(path)), lambda: read_environment(path).notes, ())
    return tuple(f"{path}: {note}" for note in notes)


def _version(library: str) -> str:
    try:
        return version(library)
    except PackageNotFoundError:
        return "none"


def _read(path: Path) -> _EnvironmentPicture:
    notes: list[str] = []
    head = read_head(path)
    if isinstance(head, ExrHead):
        pixels = _read_exr(path, head)
    elif isinstance(head, HdrHead):
        pixels = _read_hdr(path, head)
    else:
        pixels = _read_ordinary(path)
        notes.append("expected an EXR or HDR picture; 8 bits cannot hold a bright light, taken as sRGB")
    return _EnvironmentPicture(_reduced(_mended(path, pixels, notes)), tuple(notes))


def _error(path: Path, found: str) -> UnreadableError:
    return UnreadableError(f"environment {path}: {EXPECTED}, {found}")


def _read_exr(path: Path, head: ExrHead) -> Float32:
    library = openexr(path)
    try:
        check_file(path, "MAX_PICTURE_BYTES")
        with silenced(), library.File(str(path), separate_channels=True) as file:
            if not file.parts:  # OpenEXR returns no parts for pixels that it cannot read
                raise _error(path, "found one whose pixels cannot be read: damaged or cut off; get or export it again")
            channels: Any = file.parts[head.part].channels
            planes = [np.asarray(channels[name].pixels, np.float32) for name in head.channels]
    except (UnreadableError, MemoryError):
        raise
    except Exception as error:  # OpenEXR's parser may raise anything
        raise _error(path, f"found one that cannot be decoded ({str(error)[:120]})") from None
    if any(plane.shape != (head.height, head.width) for plane in planes):
        raise _error(path, "found channels of different sizes")
    return np.stack(planes, axis=-1)


def _read_hdr(path: Path, head: HdrHead) -> Float32:
    from viewsphere.rendering.sky.kernels_rgbe import decode_rows  # whose kernels take a third of a second to load

    data = read_bytes(path, "MAX_PICTURE_BYTES")
    body = np.frombuffer(data, np.uint8)[data.index(head.text.splitlines()[-1]) :]
    body = body[int(np.argmax(body == ord("\n"))) + 1 :]
    exposure = np.prod(
        [float(value) for value in re.findall(rb"\nEXPOSURE *= *(\d+\.?\d*(?:[eE][-+]?\d\d?)?)", head.text)] or [1.0]
    )
    pixels = np.zeros((head.rows, head.columns, 3), np.float32)
    done = decode_rows(body, np.zeros((head.columns, 4), np.uint8), pixels)
    if done < head.rows:
        raise _error(path, f"found one that ends or breaks off in row {done + 1} of {head.rows}; get or export it again")
    if head.first[:1] == (b"+" if head.is_upright else b"-"):
        pixels = pixels[::-1]
    if head.second[:1] == (b"-" if head.is_upright else b"+"):
        pixels = pixels[:, ::-1]
    pixels = pixels if head.is_upright else pixels.transpose(1, 0, 2)
    pixels /= np.float32(exposure if exposure > 0 else 1.0)
    return np.ascontiguousarray(pixels)


def _read_ordinary(path: Path) -> Float32:
    from PIL import Image, UnidentifiedImageError

    from viewsphere.codecs.srgb import linear

    try:
        with open_file(path, "MAX_PICTURE_BYTES") as file, Image.open(file) as image:
            check_shape(path, *image.size)
            grey_16 = image.mode.startswith("I;16")
            eight = np.asarray(image.point(lambda v: v / 256).convert("L") if grey_16 else image.convert("RGB"))
    except UnreadableError:
        raise
    except (Image.DecompressionBombError, UnidentifiedImageError):
        raise _error(path, "found something else") from None
    except MemoryError:
        raise
    except Exception as error:  # Pillow's decoders raise the errors of their formats' parsers
        raise _error(path, f"found one that cannot be decoded ({str(error)[:120]})") from None
    curve = linear(np.arange(256) / 255).astype(np.float32)
    return curve[np.broadcast_to(eight.reshape(*eight.shape[:2], -1), (*eight.shape[:2], 3))]


def _mended(path: Path, pixels: Float32, notes: list[str]) -> Float32:
    """The pixels with every texel made a finite number of at least 0; adds the repairs to `notes`."""
    low, high = float(pixels.min()), float(pixels.max())
    if low >= 0 and 0 < high <= _BRIGHTEST:
        return pixels
    finite = np.isfinite(pixels) & (pixels <= _BRIGHTEST)
    bad = int((~finite).any(axis=-1).sum())
    total = pixels.shape[0] * pixels.shape[1]
    if bad > _MOST_MENDED * total:
        raise _error(path, f"found {bad:,} of {total:,} texels that are no numbers, or above {_BRIGHTEST:g}; export it again")
    if bad:
        greatest = np.where(finite, pixels, 0).max()
        pixels = np.where(finite, pixels, np.where(pixels > 0, greatest, 0)).astype(np.float32)
        notes.append(f"mended {bad:,} texels that are no numbers, or above {_BRIGHTEST:g}")
    negative = int((pixels < _ROUNDING).any(axis=-1).sum())
    if negative:
        notes.append(f"set {negative:,} texels with negative light to 0")
    pixels = np.maximum(pixels, 0)
    if not pixels.any():
        raise _error(path, "found no light in it: all texels are black; take another")
    return pixels


def _reduced(pixels: Float32) -> Float32:
    """The picture reduced to at most `SHARPEST` wide: each texel is the mean of the texels that it covers."""
    from PIL import Image

    if pixels.shape[1] <= SHARPEST:
        return np.ascontiguousarray(pixels)
    size = SHARPEST, SHARPEST // 2
    planes = [
        np.asarray(Image.fromarray(np.ascontiguousarray(pixels[..., c])).resize(size, Image.Resampling.BOX)) for c in range(3)
    ]
    return np.stack(planes, axis=-1)
