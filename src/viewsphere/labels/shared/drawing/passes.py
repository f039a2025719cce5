"""The drawings in previews and reports for the passes that engines paint beside pictures; passes are not labels."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared.spec import Drawing, Picture
from viewsphere.model.channel import MOSAIC, PASSES, PICTURES, picture_of
from viewsphere.model.sample import Sample
from viewsphere.model.scene import ViewTransform
from viewsphere.rendering.view import bytes_of_words, picture_of_light, to_bytes


def picture(name: str, array: NDArray[Any]) -> Picture:
    """A pass as a picture (H, W, 3) uint8: light developed as in pictures, albedo as sRGB, other shares as greys, and digital
    numbers as greys up to their largest.
    """
    if name == MOSAIC:
        array = array / np.float32(max(int(array.max(initial=0)), 1))
    if array.dtype == np.uint16:
        return bytes_of_words(array)
    if PASSES[name].components == 1:
        return np.repeat((np.clip(array, 0, 1) * 255).round().astype(np.uint8)[..., None], 3, axis=2)
    if name == "albedo":
        return to_bytes(np.clip(array, 0, 1))
    return picture_of_light(array, ViewTransform())


def shown_picture(sample: Sample) -> Picture:
    """The picture of a sample as bytes: (H, W, 3) uint8 sRGB, or (H, W, 4) with straight alpha.

    A picture of 16 bits is rounded, and scene-linear light goes through the view transform of its finish. Raises
    AttributeError if there is no picture.
    """
    name, array = picture_of(sample.channels), sample.picture
    if name == "rgb_linear":
        return picture_of_light(array, sample.finish.view if sample.finish else ViewTransform())
    return bytes_of_words(array) if array.dtype == np.uint16 else array


def _drawing(name: str) -> Drawing:
    meaning = PASSES[name].meaning.partition(";")[0]
    return Drawing(name, beside=lambda sample: picture(name, sample.channels[name]), key=((f"{name}: {meaning}", None),))


DRAWINGS = {name: _drawing(name) for name in PASSES if name not in PICTURES}
"""The drawing of each pass except pictures, by its name."""
