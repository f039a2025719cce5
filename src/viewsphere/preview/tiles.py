"""Sheets of pictures: still ones in rows, sequences as filmstrips."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from viewsphere.labels import Color, drawings, is_shown
from viewsphere.model.sample import Sample
from viewsphere.preview.frame import (
    INK,
    PAPER,
    Before,
    Picture,
    check_drawn,
    draw_instant,
    draw_sample,
    extents,
    nothing,
)
from viewsphere.store.samples.films import Film, films_of

MARGIN = 8
"""Pixels between tiles, and around them."""
CAPTION = 18
"""Height of a tile's caption, in pixels."""
SWATCH = 10
"""Side of a legend's square of colour, in pixels."""

Tile = tuple[Picture, str]
"""A picture and the words below it."""


def contact_sheet(
    samples: Sequence[Sample], draw: Sequence[str] = (), columns: int = 4, width: int = 320, before: Before = nothing
) -> Picture:
    """Draw samples side by side, with the labels named in `draw` over them, (H, W, 3) uint8 sRGB.

    Sequences are filmstrips: each begins a row, and the sensors of an instant are side by side.

    `before` gives the earlier views of a sample's sensor, for trails. Raises StoreError for labels that cannot be drawn.
    """
    check_drawn(samples, draw)
    films = films_of(samples, is_shown)
    strips = [_strip(samples, film, draw, width, before) for film in films]
    stills = [(draw_sample(s, draw, width), _caption(s)) for s in samples if not s.sequence]
    return with_key(tiled(*filter(None, (*strips, stills)), columns=columns), draw)


def _strip(samples: Sequence[Sample], film: Film, draw: Sequence[str], width: int, before: Before) -> list[Tile]:
    """One sequence; the pictures beside it share one meaning of colours."""
    film_samples = [samples[place] for places in film.places for place in places]
    within, most = extents(film_samples, draw), max(120, width + 80 - 80 * len(film.sensors))
    return [
        (draw_instant([samples[place] for place in places], draw, most, before, within), film_caption(film, i))
        for i, places in enumerate(film.places)
    ]


def film_caption(film: Film, i: int) -> str:
    """Return the caption of one of a film's instants, counted from 0."""
    sensors = "" if film.sensors == ("camera",) else f"  {' | '.join(film.sensors)}"
    return f"{film.sequence}{sensors}  #{film.instants[i]}  {film.times[i]:.3f} s"


def _caption(sample: Sample) -> str:
    pose, seen = sample.known_pose, sample.objects
    if sample.variation and pose is not None:
        return f"{sample.variation}  az {pose.azimuth_deg:.4g}  el {pose.elevation_deg:.4g}  d {pose.distance:.4g}"
    if pose is None:
        return ", ".join(dict.fromkeys(o.category for o in seen)) or "nothing labelled"
    key = f"{seen[0].key}  " if seen else ""
    key += f"{pose.time.seconds:.3g} s  " if pose.time else ""
    return f"{key}az {pose.azimuth_deg:.4g}  el {pose.elevation_deg:.4g}  d {pose.distance:.4g}"


def tiled(*strips: Sequence[Tile], columns: int) -> Picture:
    """Tiles in rows with captions below, on paper; each strip begins a row."""
    height, width = (max(tile.shape[i] for strip in strips for tile, _ in strip) for i in (0, 1))
    columns = min(columns, max(map(len, strips)))
    rows = sum(-(-len(strip) // columns) for strip in strips)
    cell = (width + MARGIN, height + CAPTION + MARGIN)
    sheet = Image.new("RGB", (columns * cell[0] + MARGIN, rows * cell[1] + MARGIN), PAPER)
    pen = ImageDraw.Draw(sheet)
    font = ImageFont.load_default(size=12)
    top = 0
    for strip in strips:
        for i, (tile, caption) in enumerate(strip):
            x, y = MARGIN + i % columns * cell[0], MARGIN + (top + i // columns) * cell[1]
            sheet.paste(Image.fromarray(tile), (x, y))
            pen.text((x + 2, y + height + 2), fitting(caption, font, width), fill=INK, font=font)
        top += -(-len(strip) // columns)
    return np.asarray(sheet)


def with_key(sheet: Picture, draw: Sequence[str]) -> Picture:
    """The sheet, with the key of the drawings' colours below it, if they have one."""
    entries = [entry for drawing in drawings() if drawing.name in draw for entry in drawing.key]
    font = ImageFont.load_default(size=12)
    lines = _lines(entries, font, sheet.shape[1] - 2 * MARGIN)
    if not lines:
        return sheet
    below = Image.new("RGB", (sheet.shape[1], len(lines) * CAPTION + MARGIN), PAPER)
    pen = ImageDraw.Draw(below)
    for row, line in enumerate(lines):
        x, y = float(MARGIN), row * CAPTION
        for words, color in line:
            if color is not None:
                pen.rectangle((x, y + 3, x + SWATCH, y + 3 + SWATCH), fill=color, outline=INK)
                x += SWATCH + 4
            pen.text((x, y), words, fill=INK, font=font)
            x += font.getlength(words) + 2 * MARGIN
    return np.vstack([sheet, np.asarray(below)])


Entry = tuple[str, Color | None]


def _lines(entries: Sequence[Entry], font: ImageFont.ImageFont | ImageFont.FreeTypeFont, width: int) -> list[list[Entry]]:
    """The entries in lines of a width."""
    lines: list[list[Entry]] = []
    room = 0.0
    for words, color in entries:
        needed = font.getlength(words) + (0 if color is None else SWATCH + 4) + 2 * MARGIN
        if not lines or needed > room:
            lines.append([])
            room = float(width)
        lines[-1].append((words, color))
        room -= needed
    return lines


def fitting(text: str, font: ImageFont.ImageFont | ImageFont.FreeTypeFont, width: int) -> str:
    """The text, shortened to fit a width."""
    while len(text) > 2 and font.getlength(text) > width:
        text = text[:-2] + "…"
    return text
