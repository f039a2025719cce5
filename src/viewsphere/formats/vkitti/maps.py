"""Maps of a frame in Virtual KITTI's encodings."""

from __future__ import annotations

from functools import partial

import numpy as np

from viewsphere.codecs.palette import palette
from viewsphere.codecs.png_tiff import encode_png
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.formats.vkitti.names import Names, object_colors
from viewsphere.model.sample import Sample

MOST = 65535
REACH = 10.0
"""Range of scene flow along an axis, metres."""


def flow_png(sample: Sample, channel: str) -> Coded:
    """Flow as 16-bit RGB: shares of the picture's size from -1 to 1 as 0 to 65535, and 65535 if valid."""
    return Coded(sample.index, f"vkitti {channel}.png", partial(_flow, sample, channel))


def _flow(sample: Sample, channel: str) -> bytes:
    flow = sample.channels[channel].astype(np.float64)
    height, width = flow.shape[:2]
    share = flow / np.maximum((width - 1, height - 1), 1)
    valid = (np.abs(np.where(np.isnan(share), 2, share)) <= 1).all(axis=-1, keepdims=True)
    steps = np.rint((np.where(valid, share, 0) + 1) / 2 * MOST)
    return encode_png(np.where(valid, np.dstack((steps, np.full((height, width), MOST))), 0).astype(np.uint16))


def scene_flow_png(sample: Sample, channel: str) -> Coded:
    """Scene flow as 16-bit RGB: metres from -10 to 10 as 0 to 65535. Unknown motion is encoded as 0 metres."""
    return Coded(sample.index, f"vkitti {channel}.png", partial(_scene_flow, sample, channel))


def _scene_flow(sample: Sample, channel: str) -> bytes:
    metres = np.nan_to_num(sample.channels[channel].astype(np.float64))
    return encode_png(np.rint((np.clip(metres / REACH, -1, 1) + 1) / 2 * MOST).astype(np.uint16))


def class_png(sample: Sample, names: Names) -> Coded:
    """Colours of classes."""
    return Coded(sample.index, "vkitti classes.png", lambda: encode_png(names.by_class[sample.channels["semantic"]]))


def instance_png(sample: Sample) -> Coded:
    """Ids of objects, as indices of colours."""

    def make() -> bytes:
        return encode_png(sample.channels["instances"].astype(np.uint8), palette=palette())

    return Coded(sample.index, "vkitti instances.png", make)


def scene_png(sample: Sample, names: Names) -> Coded:
    """Colours of objects, and of classes elsewhere."""

    def make() -> bytes:
        ids = sample.channels["instances"]
        return encode_png(
            np.where(ids[..., None] > 0, object_colors()[ids], names.by_class[sample.channels["semantic"]]).astype(np.uint8)
        )

    return Coded(sample.index, "vkitti scene.png", make)
