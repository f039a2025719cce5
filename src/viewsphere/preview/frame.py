"""One picture with labels as they are drawn, and one instant of a rig."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from viewsphere.errors import StoreError
from viewsphere.labels import Drawing, Extent, channels, drawable, is_in, stand_in_for
from viewsphere.labels.shared.drawing.passes import shown_picture
from viewsphere.model.channel import ALL_PICTURES, picture_of
from viewsphere.model.sample import Sample
from viewsphere.validation.errors import one_of

Picture = NDArray[np.uint8]

INK = (30, 32, 36)
PAPER = (250, 250, 248)
SIZE = 640
"""Default size of a stand-in for a picture, pixels."""

GAP = 4
"""Pixels between the sensors of an instant."""

Extents = Mapping[str, Extent]
"""Ranges shared with neighbouring pictures, by the names of drawings; other drawings use their own."""


Before = Callable[[Sample], Sequence[Sample]]
"""Returns the earlier samples of a sample's sensor."""


def nothing(sample: Sample) -> Sequence[Sample]:
    """No samples before."""
    return ()


def check_drawn(samples: Sequence[Sample], draw: Sequence[str]) -> None:
    """Raise StoreError for names that cannot be drawn: unknown drawings, and labels that none of the samples has."""
    known = {drawing.name: source for source, drawing in drawable().items()}
    for name in draw:
        if name not in known:
            raise StoreError(f"--draw: {one_of(name, sorted(known))}")
        source = known[name]
        if samples and not any(is_in(source, sample) for sample in samples):
            what = "channel" if source in channels() else "annotation"
            kept = ", ".join((*samples[0].channels, *samples[0].requested))
            raise StoreError(f"--draw: expected the {what} {source}, to draw {name}; found pictures that have {kept}")


def _drawn(sample: Sample, draw: Sequence[str]) -> list[Drawing]:
    """The chosen drawings that a sample has the labels for."""
    return [drawing for source, drawing in drawable().items() if drawing.name in draw and is_in(source, sample)]


def extents(samples: Sequence[Sample], draw: Sequence[str]) -> Extents:
    """Return the common value ranges of the drawings of some samples."""
    extents: dict[str, list[Extent]] = {}
    for sample in samples:
        for drawing in _drawn(sample, draw):
            if drawing.extent:
                extents.setdefault(drawing.name, []).append(drawing.extent(sample))
    return {name: (min(low for low, _ in pairs), max(high for _, high in pairs)) for name, pairs in extents.items()}


def draw_sample(
    sample: Sample,
    draw: Sequence[str] = (),
    width: int | None = None,
    before: Before = nothing,
    within: Extents | None = None,
) -> Picture:
    """One frame with labels as they are drawn (`labels.drawings`): masks, 3D boxes (front face filled), 2D boxes and tracks
    over the picture, depth and flow beside it; (H, W, 3) uint8 sRGB. Labels that the sample lacks are not drawn; a stand-in
    replaces a missing picture (a LiDAR's points from above).

    `before` returns its sensor's earlier samples, for trails; `within` has the value ranges of the pictures beside it.
    """
    return np.hstack(_pictures(sample, draw, width, before, within or {}))


def draw_instant(samples: Sequence[Sample], draw: Sequence[str], width: int | None, before: Before, within: Extents) -> Picture:
    """Draw all sensors of an instant side by side, as `draw_sample` does, but with its pictures below one another."""
    if len(samples) == 1:
        return draw_sample(samples[0], draw, width, before, within)
    columns = [np.vstack(_pictures(sample, draw, width, before, within)) for sample in samples]
    height = max(column.shape[0] for column in columns)
    padded = [_padded(column, height, GAP if i else 0) for i, column in enumerate(columns)]
    return np.hstack(padded)


def _padded(picture: Picture, height: int, left: int) -> Picture:
    """The picture on paper of this height, with a margin at its left."""
    out = np.full((height, left + picture.shape[1], 3), PAPER, np.uint8)
    out[: picture.shape[0], left:] = picture
    return out


def _pictures(sample: Sample, draw: Sequence[str], width: int | None, before: Before, within: Extents) -> list[Picture]:
    """The picture, and the drawings beside it, all of one size."""
    chosen = _drawn(sample, draw)
    if picture_of(sample.channels) is None:
        if (stand_in := stand_in_for(sample.channels)) is not None:
            return [stand_in(sample, width or SIZE)]
        raise StoreError(
            f"preview: expected pictures ({', '.join(ALL_PICTURES)}), found a data set that keeps none: preview its recipe "
            "instead"
        )
    rgb = _on_paper(shown_picture(sample))
    for drawing in chosen:
        rgb = drawing.pixels(rgb, sample) if drawing.pixels else rgb
    scale = 1.0 if width is None else min(1.0, width / rgb.shape[1])
    size = (round(rgb.shape[1] * scale), round(rgb.shape[0] * scale))
    picture = Image.fromarray(rgb).resize(size, Image.Resampling.LANCZOS) if scale < 1 else Image.fromarray(rgb)
    pen = ImageDraw.Draw(picture, "RGBA")
    for drawing in chosen:
        if drawing.lines:
            drawing.lines(pen, sample, scale)
        if drawing.trails:
            drawing.trails(pen, (*before(sample), sample), scale)
    beside = (drawing.picture(sample, within.get(drawing.name)) for drawing in chosen)
    others = [Image.fromarray(other).resize(size, Image.Resampling.BILINEAR) for other in beside if other is not None]
    return [np.asarray(picture), *map(np.asarray, others)]


def _on_paper(picture: Picture) -> Picture:
    """The picture, laid over paper's colour where it is transparent."""
    if picture.shape[2] == 3:
        return picture
    sheet, clear = Image.new("RGB", picture.shape[1::-1], PAPER), Image.fromarray(picture)
    sheet.paste(clear, mask=clear)
    return np.asarray(sheet)
