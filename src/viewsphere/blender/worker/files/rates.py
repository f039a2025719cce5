"""The frames per second of a file: its own rate, or the rate that its times match."""

from __future__ import annotations

import struct
import sys
from contextlib import suppress
from itertools import pairwise
from pathlib import Path

import bpy

from .playing import curves

DEFAULT = 24.0
"""The rate that Blender assumes for a file that gives none."""

USUAL = (24.0, 25.0, 30.0, 50.0, 60.0, 24000 / 1001, 30000 / 1001, 60000 / 1001, 48.0, 90.0, 100.0, 120.0)
"""Usual rates of animations, the likeliest first."""

NEAR = 2e-3
"""Largest distance of a time from a frame, in frames: files store times in single precision."""

LEAST, MOST = 1.0, 1000.0
"""Frames per second that an animation may have."""


def own_rate(file, kind):
    """Frames per second of a USD or Alembic file; None for other kinds, and for files without a rate. Blender's reader sets
    the rate of an FBX file.
    """
    if kind in ("usd", "usda", "usdc", "usdz"):
        return _usd_rate(file)
    return _alembic_rate(Path(file).read_bytes()) if kind == "abc" else None


def set_rate(scene, rate):
    """Set the scene's number of frames a second."""
    scene.render.fps = max(round(rate), 1)
    scene.render.fps_base = scene.render.fps / rate


def _usd_rate(file):
    """The time codes per second of a USD file, which Blender treats as frames. The USD bindings that Blender ships read
    them.

    https://openusd.org/release/api/class_usd_stage.html, timeCodesPerSecond.
    """
    for place in Path(bpy.utils.resource_path("LOCAL")).glob("python/lib/python*/site-packages"):
        if str(place) not in sys.path:
            sys.path.append(str(place))
    with suppress(ImportError):
        from pxr import Sdf

        layer = Sdf.Layer.FindOrOpen(file)
        return None if layer is None else float(layer.timeCodesPerSecond)
    return None


def _alembic_rate(data):
    """The rate of an Alembic file (Ogawa): that of its first even time sampling with more than one sample.

    https://github.com/alembic/alembic, lib/Alembic/AbcCoreOgawa/ReadUtil.cpp, ReadTimeSamplesAndMax. A group is a count and
    the positions of its children. The fifth child of the root has the time samplings: for each the number of samples, the
    seconds of a cycle, and the times in the first cycle.
    """
    with suppress(struct.error, IndexError):
        (root,) = struct.unpack_from("<Q", data, 8)
        (count,) = struct.unpack_from("<Q", data, root)
        place = struct.unpack_from(f"<{min(count, 5)}Q", data, root + 8)[4] & ~(1 << 63)
        (size,) = struct.unpack_from("<Q", data, place)
        place, end = place + 8, place + 8 + size
        while place < end:
            samples, seconds, times = struct.unpack_from("<IdI", data, place)
            place += 16 + 8 * times
            if samples > 1 and times and seconds > 0 and LEAST <= times / seconds <= MOST:
                return times / seconds
    return None


def key_rate():
    """The rate of an imported file that stores times but no rate. It is the likeliest rate whose frames include all keys'
    times, else the rate of the two closest keys if it fits all. None if no rate fits.
    """
    scene = bpy.context.scene
    rate = scene.render.fps / scene.render.fps_base
    times = sorted(
        {key.co.x / rate for action in bpy.data.actions for curve in curves(action) for key in curve.keyframe_points}
    )
    steps = [after - before for before, after in pairwise(times) if after - before > 1 / MOST]
    if not steps:
        return None
    return next((one for one in (*USUAL, 1 / min(steps)) if LEAST <= one <= MOST and _fits(times, one)), None)


def _fits(times, rate):
    return all(abs(time * rate - round(time * rate)) < NEAR for time in times)
