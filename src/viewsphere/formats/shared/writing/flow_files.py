"""Files of flow, disparity and depth that several formats share: Middlebury's .flo, PFM, KITTI's 16-bit pictures, masks."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.png_tiff import encode_png
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.model.sample import Sample

FLO_TAG = b"PIEH"
"""The beginning of .flo files, and of Sintel's .dpt and .cam: the little-endian float 202021.25."""

UNKNOWN = np.float32(1e10)
"""Unknown flow in .flo files, where all values beyond 1e9 are unknown."""

STEPS, ZERO = 64, 2**15
"""Steps of KITTI's flow in a pixel, and the number for no motion."""


def _pfm(array: NDArray[Any]) -> bytes:
    """A PFM file of numbers (H, W) or (H, W, 3): little-endian float32, the lowest row first."""
    head = f"{'PF' if array.ndim == 3 else 'Pf'}\n{array.shape[1]} {array.shape[0]}\n-1.0\n"
    return head.encode() + np.ascontiguousarray(array[::-1], "<f4").tobytes()


def flow_pfm(sample: Sample, channel: str, nothing: float = 0.0) -> Coded:
    """A channel of flow as PFM of three numbers, the third 0; `nothing` for unknown flow."""

    def make() -> bytes:
        flow = sample.channels[channel]
        return _pfm(np.dstack((np.where(np.isnan(flow), np.float32(nothing), flow), np.zeros(flow.shape[:2], np.float32))))

    return Coded(sample.index, f"{channel} {nothing}.pfm", make)


def map_pfm(sample: Sample, channel: str, nothing: float = 0.0) -> Coded:
    """A single-valued channel as PFM, with `nothing` in place of NaN."""

    def make() -> bytes:
        array = sample.channels[channel].astype(np.float32)
        return _pfm(np.where(np.isnan(array), np.float32(nothing), array))

    return Coded(sample.index, f"{channel} {nothing}.pfm", make)


def steps_png(numbers: NDArray[Any], valid: NDArray[np.bool_]) -> bytes:
    """KITTI's disparity (pixels) or depth (metres), (H, W), as 16 bits in steps of 1/256; 0 if it is invalid or too large for
    16 bits. Valid values below half a step count as one step.
    """
    steps = np.maximum(np.rint(np.where(valid, numbers.astype(np.float64), 0) * 256), 1)
    return encode_png(np.where(valid & (steps <= 65535), steps, 0).astype(np.uint16))


def states_png(sample: Sample, channel: str, *states: int) -> Coded:
    """An 8-bit grey PNG of a channel of states: 255 for pixels with one of these states, else 0."""

    def make() -> bytes:
        return encode_png(np.where(np.isin(sample.channels[channel], states), 255, 0).astype(np.uint8))

    return Coded(sample.index, f"{channel} {states}.png", make)
