"""Lines and words that drawings of labels put over a picture."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.camera import project
from viewsphere.geometry.rotation import transform
from viewsphere.labels.shared.drawing.colors import Color, color_of
from viewsphere.labels.shared.spec import Picture
from viewsphere.model.sample import ObjectAnnotation, Sample

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

FAR = 1e5
"""Pixels; a line that leads farther away, such as to a point beside the lens, is left out."""
INK, PAPER = (30, 32, 36), (250, 250, 248)
MARGIN = 6
"""Pixels between the edge of the paper and the text."""

ALPHABET = "abcdefghijklmnopqrstuvwxyz"
"""Letters whose mean width estimates a text's mean letter width."""

HEAD = 0.25
"""Length of an arrow's head, as a share of the arrow."""


def in_space(pen: ImageDraw, sample: Sample, scale: float, points: NDArray[np.float64], color: Color, width: int = 2) -> None:
    """A line through points (N, 3) of the world, without the parts that the lens does not show."""
    camera = sample.camera
    pixels = project(camera.intrinsics, transform(camera.R, points) + camera.t)[0] * scale
    for a, b in zip(pixels[:-1].tolist(), pixels[1:].tolist(), strict=True):
        if np.abs((*a, *b)).max() < FAR:  # not NaN either
            pen.line((*a, *b), fill=color, width=width)


AXES = ((220, 50, 40), (40, 160, 60), (50, 90, 230))
"""Colours of x, y and z."""


def axes(pen: ImageDraw, sample: Sample, scale: float, camera_from_axes: NDArray[np.float64], size: float) -> None:
    """Three axes of the given length in metres: x red, y green, z blue."""
    camera = sample.camera
    ends = transform(camera_from_axes, np.vstack([np.zeros(3), size * np.eye(3)]))
    in_world = transform(camera.R.T, ends - camera.t)
    for axis, color in zip(in_world[1:], AXES, strict=True):
        in_space(pen, sample, scale, np.array([in_world[0], axis]), color, 3)


def arrow(pen: ImageDraw, start: tuple[float, float], end: tuple[float, float], color: Color, width: int = 2) -> None:
    """An arrow from one place in the picture to another."""
    a, b = np.array(start), np.array(end)
    along = (b - a) * HEAD
    across = np.array([-along[1], along[0]]) / 2
    pen.line((*start, *end), fill=color, width=width)
    for side in (-1, 1):
        pen.line((*end, *(b - along + side * across).tolist()), fill=color, width=width)


def middle(o: ObjectAnnotation) -> tuple[float, float] | None:
    """The middle of an object's box in the picture: of its visible part, or else of the whole object; None without a box."""
    box = o.box2d or o.box2d_projected
    return None if box is None else ((box[0] + box[2]) / 2, (box[1] + box[3]) / 2)


def written(sentences: Sequence[str], width: int, height: int) -> Picture:
    """Sentences on paper of this size, (H, W, 3) uint8: each begins a new line; sentences without room are left out."""
    from PIL import Image, ImageDraw

    paper = Image.new("RGB", (width, height), PAPER)
    pen = ImageDraw.Draw(paper)
    letters = max(8, int((width - 2 * MARGIN) / (pen.textlength(ALPHABET) / len(ALPHABET))))
    step = math.ceil(pen.textbbox((0, 0), ALPHABET)[3]) + 2
    lines = [line for sentence in sentences for line in wrap(sentence, letters, subsequent_indent="  ")]
    for i, line in enumerate(lines[: (height - MARGIN) // step]):
        pen.text((MARGIN, MARGIN + i * step), line, fill=INK)
    return np.asarray(paper)


def note(pen: ImageDraw, o: ObjectAnnotation, scale: float, words: str, color: Color) -> None:
    """Words at the upper left corner of an object's box, on a background of its colour."""
    box = o.box2d or o.box2d_projected
    if box is not None:
        x, y = box[0] * scale, box[1] * scale
        pen.rectangle(pen.textbbox((x + 2, y), words), fill=color)
        pen.text((x + 2, y), words, fill=(255, 255, 255))


def notes(words: Callable[[ObjectAnnotation], str]) -> Callable[[ImageDraw, Sample, float], None]:
    """A drawing of words on each object in the picture, in the object's colour."""

    def draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
        for o in sample.objects:
            note(pen, o, scale, words(o), color_of(o.id))

    return draw
