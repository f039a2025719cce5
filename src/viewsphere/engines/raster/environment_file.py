"""Pictures of the whole sphere: Radiance HDR (RGBE) and OpenEXR, and ordinary pictures as a makeshift."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster.kernels_rgbe import decode_rows
from viewsphere.errors import UserError

Float32 = NDArray[np.float32]

MAX_PIXELS = 100_000_000
SHARPEST = 4096
"""Greatest width of what is kept, in texels."""

_MOST_MENDED = 0.01  # share of texels that are no numbers
_BRIGHTEST = 1e6  # anything more is as good as infinite
_ROUNDING = -1e-3  # compression makes light as negative as this
_LAYOUTS = (("R", "G", "B"), ("r", "g", "b"), ("Y", "Y", "Y"))


@dataclass(frozen=True, eq=False)
class EnvironmentPicture:
    """pixels (H, W, 3) float32: linear radiance, none negative, rows from the zenith down; notes: what had to be mended."""

    pixels: Float32
    notes: tuple[str, ...]


def read_environment(path: Path) -> EnvironmentPicture:
    """Read an equirectangular picture; what it is says its content, not its name. No wider than `SHARPEST`.

    A few texels that are no numbers become 0, infinite ones the greatest there is, negative ones 0. PNG, JPEG and the
    like are taken as sRGB. Raises UserError: no such file, nothing that can be read, damaged, more than `MAX_PIXELS`, not
    twice as wide as high, more than a hundredth of it no numbers.
    """
    try:
        with path.open("rb") as file:
            start = file.read(4)
    except OSError as error:
        raise _error(path, f"found {error.strerror or error}") from None
    notes: list[str] = []
    if start == b"\x76\x2f\x31\x01":
        pixels = _read_exr(path)
    elif start[:2] == b"#?":
        pixels = _read_hdr(path)
    else:
        pixels = _read_ordinary(path)
        notes.append(f"{path}: expected an EXR or HDR picture; 8 bits cannot hold a bright light, taken as sRGB")
    return EnvironmentPicture(_reduced(_mended(path, pixels, notes)), tuple(notes))


def _error(path: Path, found: str) -> UserError:
    return UserError(f"environment {path}: expected an equirectangular EXR or HDR picture, {found}")


def _check_size(path: Path, width: int, height: int) -> None:
    if width * height > MAX_PIXELS:
        found = f"{width} x {height}; save it with {SHARPEST} x {SHARPEST // 2}"
        raise UserError(f"environment {path}: expected at most {MAX_PIXELS // 1_000_000} megapixels, found {found}")
    if height < 2 or abs(width - 2 * height) > 0.01 * width:
        raise UserError(f"environment {path}: expected a picture twice as wide as high, found {width} x {height}")


def _read_exr(path: Path) -> Float32:
    import OpenEXR

    try:
        with OpenEXR.File(str(path), separate_channels=True, header_only=True) as file:
            part = _part(file)
            if part is None:
                channels = ", ".join(sorted({name for p in file.parts for name in _names(p)}))
                raise _error(path, f"found channels {channels}; it needs R, G and B")
            low, high = file.parts[part[0]].header["dataWindow"]
            width, height = (int(high[k]) - int(low[k]) + 1 for k in (0, 1))
        _check_size(path, width, height)
        with OpenEXR.File(str(path), separate_channels=True) as file:
            channels: Any = file.parts[part[0]].channels
            planes = [np.asarray(channels[name].pixels, np.float32) for name in part[1]]
    except UserError:
        raise
    except MemoryError:
        raise
    except Exception as error:  # OpenEXR raises whatever its parser does
        raise _error(path, f"found one that cannot be decoded ({str(error)[:120]})") from None
    if any(plane.shape != (height, width) for plane in planes):
        raise _error(path, "found channels of different sizes")
    return np.stack(planes, axis=-1)


def _part(file: Any) -> tuple[int, tuple[str, ...]] | None:
    """The first part that has colours and the names of its three channels; a layer's are called `layer.R`."""
    for index, part in enumerate(file.parts):
        names = _names(part)
        layers = ["", *sorted({name.rpartition(".")[0] + "." for name in names if "." in name})]
        for layer in layers:
            for layout in _LAYOUTS:
                wanted = tuple(layer + letter for letter in layout)
                if names.issuperset(wanted):
                    return index, wanted
    return None


def _names(part: Any) -> set[str]:
    return {channel.name for channel in part.header["channels"]}


def _read_hdr(path: Path) -> Float32:
    """Radiance's picture format, Ward 1991: https://radsite.lbl.gov/radiance/refer/filefmts.pdf."""
    data = path.read_bytes()
    head = re.match(
        rb"#\?.*?\n\n([-+][XY]) +(\d{1,7}) +([-+][XY]) +(\d{1,7})\n", data[: 1 << 16].replace(b"\r", b""), re.DOTALL
    )
    if head is None or head[1][1:] == head[3][1:]:
        raise _error(path, "found a Radiance file without a picture's size")
    if b"32-bit_rle_xyze" in head[0]:
        raise _error(path, "found colours in XYZ; convert it to RGB")
    first, rows, second, columns = head[1], int(head[2]), head[3], int(head[4])
    upright = first[1:] == b"Y"
    _check_size(path, columns if upright else rows, rows if upright else columns)
    body = np.frombuffer(data, np.uint8)[data.index(head[0].splitlines()[-1]) :]
    body = body[int(np.argmax(body == ord("\n"))) + 1 :]
    exposure = np.prod(
        [float(value) for value in re.findall(rb"\nEXPOSURE *= *(\d+\.?\d*(?:[eE][-+]?\d\d?)?)", head[0])] or [1.0]
    )
    pixels, done = decode_rows(body, rows, columns)
    if done < rows:
        raise _error(path, f"found one that ends or breaks off in row {done + 1} of {rows}")
    if first[:1] == (b"+" if upright else b"-"):
        pixels = pixels[::-1]
    if second[:1] == (b"-" if upright else b"+"):
        pixels = pixels[:, ::-1]
    pixels = pixels if upright else pixels.transpose(1, 0, 2)
    return np.ascontiguousarray(pixels / np.float32(exposure if exposure > 0 else 1.0))


def _read_ordinary(path: Path) -> Float32:
    from PIL import Image, UnidentifiedImageError

    from viewsphere.assets.srgb import linear

    try:
        with Image.open(path) as image:
            _check_size(path, *image.size)
            grey_16 = image.mode.startswith("I;16")
            eight = np.asarray(image.point(lambda v: v / 256).convert("L") if grey_16 else image.convert("RGB"))
    except UserError:
        raise
    except (Image.DecompressionBombError, UnidentifiedImageError):
        raise _error(path, "found something else") from None
    except MemoryError:
        raise
    except Exception as error:  # Pillow's decoders raise whatever their format's parser does
        raise _error(path, f"found one that cannot be decoded ({str(error)[:120]})") from None
    curve = linear(np.arange(256) / 255).astype(np.float32)
    return curve[np.broadcast_to(eight.reshape(*eight.shape[:2], -1), (*eight.shape[:2], 3))]


def _mended(path: Path, pixels: Float32, notes: list[str]) -> Float32:
    """Every texel a finite number of at least 0."""
    low, high = float(pixels.min()), float(pixels.max())
    if low >= 0 and 0 < high <= _BRIGHTEST:
        return pixels
    finite = np.isfinite(pixels) & (pixels <= _BRIGHTEST)
    bad = int((~finite).any(axis=-1).sum())
    total = pixels.shape[0] * pixels.shape[1]
    if bad > _MOST_MENDED * total:
        raise _error(path, f"found {bad:,} of {total:,} texels that are no numbers, or above {_BRIGHTEST:g}")
    if bad:
        greatest = np.where(finite, pixels, 0).max()
        pixels = np.where(finite, pixels, np.where(pixels > 0, greatest, 0)).astype(np.float32)
        notes.append(f"{path}: mended {bad:,} texels that are no numbers, or above {_BRIGHTEST:g}")
    negative = int((pixels < _ROUNDING).any(axis=-1).sum())
    if negative:
        notes.append(f"{path}: set {negative:,} texels with negative light to 0")
    pixels = np.maximum(pixels, 0)
    if not pixels.any():
        raise _error(path, "found no light in it: all texels are black")
    return pixels


def _reduced(pixels: Float32) -> Float32:
    """No wider than `SHARPEST`: each texel the mean of all that it covers."""
    from PIL import Image

    if pixels.shape[1] <= SHARPEST:
        return np.ascontiguousarray(pixels)
    size = SHARPEST, SHARPEST // 2
    planes = [
        np.asarray(Image.fromarray(np.ascontiguousarray(pixels[..., c])).resize(size, Image.Resampling.BOX)) for c in range(3)
    ]
    return np.stack(planes, axis=-1)
