"""Samples with other channels than they have, and what a format's tree makes of them, without writing it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from viewsphere.codecs.png_tiff import encode_png
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.formats.shared.writing.tree import File


def with_channels(sample, **channels):
    """The sample with these channels in place of its own, or besides them."""
    return replace(sample, channels={**{name: sample.channels[name] for name in sample.channels}, **channels})


def empty(sample):
    """The sample as a picture of nothing but a flat background: no objects, no depth, no motion."""
    nothing = {name: np.full_like(sample.channels[name], value) for name, value in EMPTY.items() if name in sample.channels}
    return replace(with_channels(sample, **nothing), objects=())


EMPTY = {"depth": np.inf, "depth_ray": np.inf, "instances": 0, "categories": 0, "flow": np.nan, "flow_backward": np.nan,
         "flow_state": 4, "flow_backward_state": 4, "disparity": np.nan, "disparity_state": 4, "disparity_change": np.nan,
         "scene_flow": np.nan, "motion_boundaries": 0}  # fmt: skip


def files(tree, sample):
    """The whole files that a tree makes of a sample: bytes by their paths, and the stored files' own paths."""
    return {one.path: content(one.content) for one in tree.sample_files(sample) if isinstance(one, File)}


def content(made):
    if isinstance(made, Coded):
        return made.make()
    return encode_png(made) if isinstance(made, np.ndarray) else made
