"""The header of an environment picture (whole sphere), OpenEXR or Radiance HDR, read without its pixels.

Radiance's picture format, Ward 1991: https://radsite.lbl.gov/radiance/refer/filefmts.pdf.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from viewsphere.assets.paths.folder import UnreadableError
from viewsphere.errors import MissingExtraError
from viewsphere.files import check_file, open_file
from viewsphere.limits import limits

EXPECTED = "expected an equirectangular EXR or HDR picture"

_LONGEST_HEAD = 1 << 16  # bytes of a Radiance file that are searched for its size
_LAYOUTS = (("R", "G", "B"), ("r", "g", "b"), ("Y", "Y", "Y"))


@dataclass(frozen=True)
class ExrHead:
    """The part of an OpenEXR file that has colours: its number, names of red, green and blue, width and height in pixels."""

    part: int
    channels: tuple[str, ...]
    width: int
    height: int


@dataclass(frozen=True)
class HdrHead:
    """The text of a Radiance file before its pixels, with plain line feeds; the directions of its rows and columns, such as -Y
    and +X, and their numbers.
    """

    text: bytes
    first: bytes
    rows: int
    second: bytes
    columns: int

    @property
    def is_upright(self) -> bool:
        """Return whether the file's scan lines are rows of the picture, not columns."""
        return self.first[1:] == b"Y"


def read_head(path: Path) -> ExrHead | HdrHead | None:
    """The header of a file; its first bytes, not its name, determine the format. None for any other format.

    Raises UnreadableError, whose message names the file, if the file cannot be opened, is damaged, lacks colours, has more
    pixels than `limits` allows, or is not twice as wide as high.
    """
    try:
        with open_file(path, "MAX_PICTURE_BYTES") as file:
            start = file.read(_LONGEST_HEAD)
    except OSError as error:
        raise _unreadable(path, f"found {error.strerror or error}") from None
    if start.startswith(b"\x76\x2f\x31\x01"):
        return _exr(path)
    return _hdr(path, start) if start.startswith(b"#?") else None


def check_shape(path: Path, width: int, height: int) -> None:
    """Raise UnreadableError for too many pixels, or if the width is not twice the height."""
    most = limits.MAX_PICTURE_PIXELS
    if width * height > most:
        found = f"{width} x {height}: save it with 4096 x 2048"
        raise UnreadableError(
            f"environment {path}: expected at most {most // 1_000_000} megapixels (limit MAX_PICTURE_PIXELS), found {found}"
        )
    if height < 2 or abs(width - 2 * height) > 0.01 * width:
        raise UnreadableError(
            f"environment {path}: expected a picture twice as wide as high, found {width} x {height}: crop or extend it"
        )


@contextlib.contextmanager
def silenced() -> Generator[None]:
    """Keep OpenEXR's own messages, which it prints in addition to raising errors, off the terminal."""
    with contextlib.ExitStack() as stack:
        with contextlib.suppress(OSError, ValueError):  # a process may have no standard error
            kept = os.dup(2)
            stack.callback(os.close, kept)
            nowhere = os.open(os.devnull, os.O_WRONLY)
            stack.callback(os.close, nowhere)
            os.dup2(nowhere, 2)
            stack.callback(os.dup2, kept, 2)
        stack.enter_context(contextlib.redirect_stdout(io.StringIO()))
        yield


def _unreadable(path: Path, found: str) -> UnreadableError:
    return UnreadableError(f"environment {path}: {EXPECTED}, {found}")


def openexr(path: Path) -> Any:
    """The package that reads this EXR file; raises MissingExtraError if it is not installed."""
    try:
        import OpenEXR
    except ImportError:
        raise MissingExtraError(
            f"environment {path}: expected the package OpenEXR, found none: pip install 'viewsphere[exr]', or take an HDR"
        ) from None
    return OpenEXR


def _exr(path: Path) -> ExrHead:
    library = openexr(path)
    try:
        check_file(path, "MAX_PICTURE_BYTES")
        with silenced(), library.File(str(path), separate_channels=True, header_only=True) as file:
            colors = _colors(file)
            if colors is None:
                channels = ", ".join(sorted({name for part in file.parts for name in _names(part)}))
                raise _unreadable(path, f"found channels {channels}; it needs R, G and B: export it with them")
            low, high = file.parts[colors[0]].header["dataWindow"]
            width, height = (int(high[k]) - int(low[k]) + 1 for k in (0, 1))
    except (UnreadableError, MemoryError):
        raise
    except Exception:  # OpenEXR's parser raises errors of many kinds
        raise _unreadable(path, "found one whose head cannot be read: damaged or cut off; get or export it again") from None
    check_shape(path, width, height)
    return ExrHead(*colors, width, height)


def _colors(file: Any) -> tuple[int, tuple[str, ...]] | None:
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


def _hdr(path: Path, start: bytes) -> HdrHead:
    head = re.match(rb"#\?.*?\n\n([-+][XY]) +(\d{1,7}) +([-+][XY]) +(\d{1,7})\n", start.replace(b"\r", b""), re.DOTALL)
    if head is None or head[1][1:] == head[3][1:]:
        raise _unreadable(path, "found a Radiance file without a picture's size: get or export it again")
    if b"32-bit_rle_xyze" in head[0]:
        raise _unreadable(path, "found colours in XYZ; convert it to RGB")
    hdr_head = HdrHead(head[0], head[1], int(head[2]), head[3], int(head[4]))
    width, height = (hdr_head.columns, hdr_head.rows) if hdr_head.is_upright else (hdr_head.rows, hdr_head.columns)
    check_shape(path, width, height)
    return hdr_head
