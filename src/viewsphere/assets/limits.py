"""Limits for model files and pictures, so that no file makes the reader run out of memory or time.

The error message for an exceeded limit gives the limit's name and value, and the value found.
"""

from __future__ import annotations

import os

from viewsphere.errors import UserError

MAX_READ_SECONDS = 120.0
"""Time to read one file; `$VIEWSPHERE_MAX_READ_SECONDS` overrides it."""
MAX_READ_BYTES = 4 << 30
"""Address space of the process that reads one file; `$VIEWSPHERE_MAX_READ_BYTES` overrides it."""

MAX_FILE_BYTES = 4 << 30
MAX_FILES = 10_000  # named by one model: textures, buffers, material libraries
MAX_TRIANGLES = 20_000_000
MAX_BLENDER_TRIANGLES = 10_000_000  # that Blender may evaluate from one file
MAX_VERTICES = 3 * MAX_TRIANGLES
MAX_PICTURE_PIXELS = 100_000_000
"""Pixels of any one picture: a texture, the ground's, a plane's, a background's, a sky's; 400 MB once it is RGBA."""
MAX_TEXTURES = 1_024
MAX_ALL_TEXTURE_PIXELS = 1 << 29  # of all textures of a model, 2 GiB as RGBA
MAX_ZEROS = 10_000_000  # elements of a glTF accessor that has no bytes in the file
MAX_INSTANCES = 1_000_000  # of objects in a scene
MAX_NESTING = 500  # nodes or components within one another
MAX_ARCHIVE_BYTES = 1 << 30  # a 3MF archive once it is unpacked

MIN_SIZE = 1e-4
"""Smallest longest side of a normalised model, metres."""
MAX_SIZE = 1e5
"""Greatest longest side of a normalised model, metres."""


FROM_OUTSIDE = ("SIGKILL", "SIGTERM", "SIGINT", "SIGHUP", "SIGQUIT")
"""Signals that come from other processes or the system: no damaged file makes a reader end by one of them."""


def too_slow(seconds: float) -> str:
    """The message for a reader that exceeded its time limit."""
    return (
        f"expected to be read within {seconds:g} s (limit MAX_READ_SECONDS), stopped then; simplify the model, or "
        "set VIEWSPHERE_MAX_READ_SECONDS higher"
    )


def ended(reader: str, how: str, memory: int) -> str:
    """The message for a reader process that ended without an answer; `how`: the signal that ended it, or its exit status."""
    if how in FROM_OUTSIDE:
        return (
            f"{reader} ended unexpectedly: it was killed ({how}), perhaps because memory ran out; the file may be whole: "
            "try again with more memory free, or fewer --workers"
        )
    allowed = f"{memory:,} bytes of memory (limit MAX_READ_BYTES)"
    return f"reading it crashed ({how}), with {allowed}: damaged, or larger than that allows"


def from_environment(name: str) -> float:
    """The value of `$VIEWSPHERE_<name>`, else of the named limit; UserError when the variable is no positive number."""
    text = os.environ.get(f"VIEWSPHERE_{name}", "")
    try:
        value = float(text or globals()[name])
    except ValueError:
        value = 0.0
    if not 0 < value < float("inf"):
        raise UserError(f"VIEWSPHERE_{name}: expected a number above 0, found {text!r}")
    return value
