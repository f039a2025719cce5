"""README's first picture: one frame of a data set six times, each with another of its labels.

    .venv/bin/python scripts/poster.py DATASET OUT.jpg [--frame N]

The data set keeps rgb, depth, normals, instances and parts.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

import viewsphere as vs
from viewsphere.model.sample import Sample
from viewsphere.preview import draw_sample

PANELS = {
    "picture": (),
    "masks, 2D boxes": ("masks", "boxes"),
    "3D boxes": ("boxes3d",),
    "depth": ("depth",),
    "normals": ("normals",),
    "parts": ("parts",),
}
COLUMNS, WIDTH, GAP = 3, 462, 7
"""Panels in a row, and pixels: of a panel, and between two."""
WORDS = 38
"""Height of the letters, which are read on a phone, too, at a third of the size."""


def panel(sample: Sample, name: str) -> Image.Image:
    """The sample with the labels of a panel, and the panel's name in its corner."""
    drawn = draw_sample(sample, PANELS[name], WIDTH)
    picture = Image.fromarray(np.ascontiguousarray(drawn[:, -WIDTH:]))  # what is drawn beside a picture is at its right
    font = ImageFont.load_default(size=WORDS)
    pen = ImageDraw.Draw(picture, "RGBA")
    at = (12, 3)
    left, top, right, bottom = pen.textbbox(at, name, font=font)
    pen.rounded_rectangle((left - 9, top - 7, right + 9, bottom + 8), radius=8, fill=(20, 22, 26, 190))
    pen.text(at, name, font=font, fill="white")
    return picture


def poster(sample: Sample) -> Image.Image:
    """All panels in rows, without a margin, since a page has its own."""
    panels = [panel(sample, name) for name in PANELS]
    width, height = panels[0].width + GAP, panels[0].height + GAP
    sheet = Image.new("RGB", (COLUMNS * width - GAP, len(panels) // COLUMNS * height - GAP), "white")
    for i, one in enumerate(panels):
        sheet.paste(one, (i % COLUMNS * width, i // COLUMNS * height))
    return sheet


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("dataset", type=Path)
    options.add_argument("output", type=Path)
    options.add_argument("--frame", type=int, default=0, help="which, from 0")
    args = options.parse_args()
    poster(vs.open(args.dataset)[args.frame]).save(args.output, quality=85)


if __name__ == "__main__":
    main()
