"""The contents of shelves: rows of books, boxes, a vase or a plant."""

from __future__ import annotations

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.furnishing.casework import block
from viewsphere_zoo.furnishing.coats import DYES, PAPER
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color, linear
from viewsphere_zoo.shapes.solids import Solid, join, lathe, moved, turned
from viewsphere_zoo.townscape.surfaces import cuboid

BINDINGS: tuple[Color, ...] = (*DYES, (0.85, 0.8, 0.65), (0.75, 0.12, 0.1), (0.1, 0.3, 0.55), (0.9, 0.9, 0.88))


def bound(k: int) -> Material:
    """The material of a book's cover, by the number of its colour."""
    return Material(f"binding_{k}", linear(BINDINGS[k]), roughness=0.55)


def books(
    rng: np.random.Generator, low: tuple[float, float, float], width: float, depth: float, height: float, share: float
) -> list[Piece]:
    """Books side by side from `low` (x, front y, z of the board) on, over about this share of the width; the last may lean."""
    x, end = low[0], low[0] + share * width
    tallest = min(height - 0.02, 0.31)
    covers: dict[int, list[Solid]] = {}
    pages: list[Solid] = []
    tall, deep, run = tallest, min(depth, 0.22), 0
    while True:
        if run == 0:  # the books of a row come in sets of similar size
            tall, deep, run = (
                tallest * rng.uniform(0.66, 1.0),
                min(depth - 0.02, rng.uniform(0.14, 0.22)),
                int(rng.integers(2, 7)),
            )
        thick, high, run = float(rng.uniform(0.02, 0.05)), tall * float(rng.uniform(0.95, 1.0)), run - 1
        if x + thick > end:
            break
        book, leaves = _book(thick, deep, high)
        place = (x, low[1] + float(rng.uniform(0.006, 0.018)), low[2])
        covers.setdefault(int(rng.integers(len(BINDINGS))), []).append(moved(book, place))
        pages.append(moved(leaves, place))
        x += thick + 0.001
    if not pages:
        return []
    lean = 0.22
    if share < 0.9 and x + 0.03 + tall * np.sin(lean) < low[0] + width:
        book, leaves = (turned(s, 1, -lean) for s in _book(0.03, deep, tall))
        place = (x + tall * np.sin(lean) + 0.001, low[1] + 0.01, low[2])
        covers.setdefault(int(rng.integers(len(BINDINGS))), []).append(moved(book, place))
        pages.append(moved(leaves, place))
    found = [Piece("book", bound(k), join(*solids)) for k, solids in sorted(covers.items())]
    return [*found, Piece("book", PAPER, join(*pages))]


def _book(thick: float, deep: float, high: float) -> tuple[Solid, Solid]:
    """A book's cover and its pages, its spine at y = 0 towards -Y, standing at x = 0 to `thick`."""
    t = 0.003
    boards = [cuboid((0, 0, 0), (t, deep, high)), cuboid((thick - t, 0, 0), (thick, deep, high))]
    return join(*boards, cuboid((t, 0, 0), (thick - t, t, high))), cuboid(
        (t, t, 0.003), (thick - t, deep - 0.004, high - 0.004)
    )


def box(rng: np.random.Generator, low: tuple[float, float, float], width: float, depth: float, height: float) -> list[Piece]:
    """A box that fills a bay, with a slot as its grip."""
    k = int(rng.integers(len(BINDINGS)))
    x, y, z = low
    body = block((x + 0.015, y + 0.005, z), (x + width - 0.015, y + depth - 0.02, z + 0.82 * height), 0.006)
    middle, grip = x + width / 2, z + 0.62 * height
    slot = block((middle - 0.04, y + 0.003, grip - 0.012), (middle + 0.04, y + 0.02, grip + 0.012), 0.004)
    dark = Material("slot", linear((0.05, 0.05, 0.05)), roughness=0.9)
    return [Piece("box", Material(f"box_{k}", linear(BINDINGS[k]), roughness=0.9), body), Piece("box", dark, slot)]


def vase(rng: np.random.Generator, at: tuple[float, float, float], height: float) -> list[Piece]:
    """A vase of glazed clay."""
    r, h = float(rng.uniform(0.22, 0.4)) * height, height
    neck, belly = float(rng.uniform(0.3, 0.6)) * r, float(rng.uniform(0.3, 0.6)) * h
    profile = [
        (0, 0),
        (0.55 * r, 0),
        (0.8 * r, 0.45 * belly),
        (r, belly),
        (0.8 * r, 0.5 * (belly + 0.85 * h)),
        (neck, 0.85 * h),
    ]
    profile += [(1.15 * neck, h), (0.95 * neck, h), (0.8 * neck, 0.8 * h), (0, 0.78 * h)]
    k = int(rng.integers(len(BINDINGS)))
    glaze = Material(f"glaze_{k}", linear(BINDINGS[k]), roughness=0.3, clearcoat=0.6, clearcoat_roughness=0.1)
    return [Piece("vase", glaze, moved(lathe(profile, 20), at))]
