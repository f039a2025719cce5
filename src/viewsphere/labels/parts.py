"""parts: which named part of its model is seen."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from viewsphere.labels._label import ChannelLabel, Drawing, Models, Picture, channel_of
from viewsphere.model.sample import Sample

GOLDEN = 0.618034
"""The golden section: its multiples, less whole numbers, lie far apart."""


def prove(sample: Sample, models: Models) -> Iterator[str]:
    """Objects have parts, the background has no part."""
    parts, instances = channel_of(sample, "parts"), channel_of(sample, "instances")
    if parts is not None and instances is not None and ((parts > 0) != (instances > 0)).any():
        yield f"expected a part where an object is seen, none elsewhere; found {((parts > 0) != (instances > 0)).sum()} others"


def tinted(picture: Picture, sample: Sample) -> Picture:
    """The picture, grey, with every part in a colour of its own: neighbouring ids are far apart on the wheel of hues."""
    parts = sample.channels["parts"]
    grey = picture.mean(axis=2, keepdims=True).repeat(3, axis=2)
    hue = (parts * GOLDEN)[..., None] % 1 + np.array([0, 2 / 3, 1 / 3])
    light = 0.35 + 0.65 * grey / 255
    colors = 255 * light * (0.5 + 0.5 * np.cos(2 * np.pi * hue))
    return np.where(parts[..., None] > 0, colors, 0.6 * grey + 70).round().astype(np.uint8)


LABEL = ChannelLabel(
    name="parts",
    meaning="named part of the object's model, from 1; 0 is none",
    dtype=np.int32,
    unit="part id",
    encoding="png16",
    compute=lambda sight: sight.per_triangle(sight.geometry.triangle_part, 0),
    prove=prove,
    drawing=Drawing("parts", pixels=tinted),
)
