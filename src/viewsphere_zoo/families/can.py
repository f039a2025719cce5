"""Cans: for drinks, with a tab, tins of food with a paper label, and flat tins of fish."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import At
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.household import charts
from viewsphere_zoo.household.canvas import blank
from viewsphere_zoo.household.draws import chance, pick, seed, uniform
from viewsphere_zoo.household.prints import Label, wrapper
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, metal
from viewsphere_zoo.shapes.rods import washer
from viewsphere_zoo.shapes.solids import Float, Solid, join, lathe, moved, superellipse

KEYPOINTS = {
    "top": At("lid", (0, 0, 1)),
    "base": At("base", (0, 0, -1)),
    "tab": At("tab"),
}
SKELETON = (("base", "top"),)

Kind = Literal["drink", "food", "flat"]
ROUND = 44
"""Sides of a turned body."""


COLA = Label("COLA", "CLASSIC", "", "wave", ((0.75, 0.08, 0.08), (0.95, 0.93, 0.9), (0.97, 0.96, 0.94)))


@dataclass(frozen=True)
class Can:
    """Parameters of a can; metres. ring: whether a tin has a pull ring; beads: grooves around its wall."""

    kind: Kind = "drink"
    height: float = 0.122
    radius: float = 0.033
    label: Label = COLA
    ring: bool = True
    beads: int = 5
    steel: Color = (0.74, 0.74, 0.75)
    seed: int = 0


def can(parameters: Can | None = None) -> Mesh:
    """The can in metres, its axis on z, its label's face towards -Y.

    Parts: base, label, lid, tab, and body of tins.
    """
    p = parameters or Can()
    steel = metal("steel", p.steel, 0.3)
    pieces, low, high = _drink(p, steel) if p.kind == "drink" else _tin(p, steel)
    canvas = blank(2 * np.pi * p.radius, high - low, p.label.colors[0])
    wrapper(canvas, p.label, np.random.default_rng(p.seed))
    return charts.charted(assemble(pieces, crease_deg=35), {"label": charts.wound(low, high)}, [canvas.image("label")])


def _drink(p: Can, steel: Material) -> tuple[list[Piece], float, float]:
    """A thin wall, drawn in at both ends, printed all over; with the heights where the print begins and ends."""
    r, h = p.radius, p.height
    neck = r - 0.0055
    low, high = 0.008, h - 0.011
    t = np.linspace(0, 1, 5)
    foot = [
        (0, 0.009),
        (0.35 * r, 0.0075),
        (0.62 * r, 0.003),
        (neck - 0.0035, 0.0004),
        (neck - 0.002, 0),
        (neck - 0.0005, 0.0008),
    ]
    foot += [(neck + (r - neck) * np.sin(np.pi / 2 * s), 0.002 + (low - 0.002) * (1 - np.cos(np.pi / 2 * s))) for s in t[1:]]
    wall = [(r, low + s * (high - low)) for s in t]
    shoulder = [(neck + (r - neck) * (0.5 + 0.5 * np.cos(np.pi * s)), high + 0.008 * s) for s in t]
    seam = [(neck, h - 0.003), (neck + 0.0012, h - 0.0022), (neck + 0.0013, h - 0.0006), (neck + 0.0006, h), (neck - 0.0006, h)]
    lid = [(neck - 0.0006, h), (neck - 0.0012, h - 0.0012), (neck - 0.0028, h - 0.0062), (neck - 0.004, h - 0.0065)]
    lid += [(neck - 0.0048, h - 0.0048), (0.6 * neck, h - 0.0048), (0.3 * neck, h - 0.0048), (0, h - 0.0048)]
    deck = h - 0.0048
    mouth = superellipse(0.42 * neck, 0.3 * neck, 2.2, 24)
    line = moved(washer(0.93 * mouth, mouth, 0.0007), (0, -0.42 * neck, deck))
    coat = charts.printed("label", 0, 0.32, 0.5)
    return [
        Piece("base", steel, lathe(foot, ROUND)),
        Piece("label", coat, lathe([*wall, *shoulder[1:]], ROUND)),
        Piece("lid", steel, join(lathe(seam, ROUND), lathe(lid, ROUND), line)),
        Piece("tab", steel, _tab(0.4 * neck, deck)),
    ], low, high  # fmt: skip


def _tab(length: float, deck: float) -> Solid:
    """The tab on its rivet: a plate with a hole for a finger's tip, its nose towards -Y."""
    outline = np.add(superellipse(0.46 * length, 0.85 * length, 2.6, 28), (0, 0.3 * length))
    hole = np.add(superellipse(0.27 * length, 0.34 * length, 2.4, 28), (0, 0.62 * length))
    rivet = lathe([(0.2 * length, 0), (0.2 * length, 0.0018), (0.14 * length, 0.0023), (0, 0.0023)], 12)
    return join(moved(washer(hole, outline, 0.0009), (0, 0, deck + 0.0011)), moved(rivet, (0, 0, deck)))


def _tin(p: Can, steel: Material) -> tuple[list[Piece], float, float]:
    """A wall with seams at both ends and grooves, mostly under a paper label; with the heights where the label begins and
    ends.
    """
    r, h = p.radius, p.height
    edge = r + 0.0013
    low, high = 0.0055, h - 0.0055
    ring = [(edge - 0.0006, 0), (edge, 0.0008), (edge, 0.0028), (r, 0.0036)]
    base = [(0, 0.0022), (0.6 * r, 0.0022), (0.7 * r, 0.003), (r - 0.002, 0.003), (r - 0.001, 0), *ring]
    z = np.linspace(0.0036, h - 0.0036, 3 * p.beads + 2) if p.beads else np.array([0.0036, h - 0.0036])
    groove = (np.arange(len(z)) % 3 == 2) & (np.abs(z - h / 2) < 0.4 * h)
    wall = np.stack([r - 0.0009 * groove, z], axis=1)
    top = [(x, h - y) for x, y in ring[::-1]]
    steps = [
        (r - 0.001, h),
        (r - 0.0016, h - 0.003),
        (0.86 * r, h - 0.003),
        (0.83 * r, h - 0.0022),
        (0.7 * r, h - 0.0022),
        (0.67 * r, h - 0.003),
        (0, h - 0.003),
    ]
    paper = charts.printed("label", 0, 0.32, 0.4) if p.kind == "flat" else charts.printed("label", 0, 0.6)
    pieces = [
        Piece("base", steel, lathe(base, ROUND)),
        Piece("body", steel, lathe(wall, ROUND)),
        Piece("label", paper, _paper(wall, low, high)),
        Piece("lid", steel, join(lathe(top, ROUND), lathe(steps, ROUND))),
    ]  # fmt: skip
    if p.ring:
        pieces.append(Piece("tab", steel, _pull(0.3 * r if p.kind == "flat" else 0.34 * r, r, h - 0.003)))
    return pieces, low, high


def _paper(wall: Float, low: float, high: float) -> Solid:
    """A label around the wall; grooves show through."""
    z = np.unique(np.concatenate([[low, high], wall[(wall[:, 1] > low) & (wall[:, 1] < high), 1]]))
    skin = np.stack([np.interp(z, wall[:, 1], wall[:, 0]) + 3e-4, z], axis=1)
    return lathe(np.concatenate([skin[:1] - (3e-4, 0), skin, skin[-1:] - (3e-4, 0)]), ROUND)


def _pull(size: float, radius: float, deck: float) -> Solid:
    """A pull ring, flat on the lid, riveted near its edge."""
    middle = (0, -0.62 * radius + 1.15 * size, deck + 0.0014)
    outer, inner = superellipse(0.8 * size, size, 2.2, 28), superellipse(0.55 * size, 0.72 * size, 2.2, 28)
    nose = superellipse(0.34 * size, 0.36 * size, 3.0, 28)
    hole = superellipse(0.07 * size, 0.07 * size, 2.0, 28)
    return join(
        moved(washer(inner, outer, 0.0014), middle),
        moved(washer(hole, nose, 0.0012), (0, -0.62 * radius + 0.1 * size, deck + 0.0013)),
    )


def can_random(rng: np.random.Generator) -> Mesh:
    """A can with all parameters drawn."""
    return can(draw(rng))


def draw(rng: np.random.Generator) -> Can:
    """The parameters of a random can."""
    kind: Kind = ("drink", "food", "flat")[int(rng.choice(3, p=(0.5, 0.38, 0.12)))]
    if kind == "drink":
        slim = chance(rng, 0.35)
        title, line, picture, colors = pick(rng, _DRINKS)
        return Can(
            kind=kind,
            height=uniform(rng, 0.132, 0.157) if slim else uniform(rng, 0.112, 0.168),
            radius=uniform(rng, 0.0265, 0.029) if slim else 0.033,
            label=Label(title, line, picture, pick(rng, ("wave", "slant", "fade", "plain", "split", "halo")), colors),
            steel=pick(rng, ((0.76, 0.76, 0.77), (0.76, 0.76, 0.77), (0.3, 0.3, 0.31), (0.78, 0.66, 0.36))),
            seed=seed(rng),
        )
    title, line, picture, colors = pick(rng, _FISH if kind == "flat" else _FOODS)
    ground = pick(rng, ("edged", "split", "halo", "wave", "plain"))
    return Can(
        kind=kind,
        height=uniform(rng, 0.032, 0.042) if kind == "flat" else uniform(rng, 0.075, 0.125),
        radius=uniform(rng, 0.038, 0.045) if kind == "flat" else uniform(rng, 0.0325, 0.05),
        label=Label(title, line, picture, ground, colors),
        ring=kind == "flat" or chance(rng, 0.7),
        beads=0 if kind == "flat" else int(rng.integers(4, 8)),
        steel=pick(rng, ((0.74, 0.74, 0.75), (0.72, 0.73, 0.75), (0.78, 0.66, 0.4))),
        seed=seed(rng),
    )


_WHITE: Color = (0.96, 0.95, 0.92)
_DRINKS: tuple[tuple[str, str, str, tuple[Color, Color, Color]], ...] = (
    ("COLA", "CLASSIC", "", ((0.75, 0.08, 0.08), _WHITE, _WHITE)),
    ("COLA", "ZERO", "", ((0.12, 0.12, 0.13), (0.75, 0.1, 0.1), _WHITE)),
    ("ORANGE", "SODA", "orange", ((0.95, 0.52, 0.08), (0.2, 0.45, 0.2), _WHITE)),
    ("LEMON", "FIZZ", "lemon", ((0.97, 0.88, 0.3), (0.2, 0.5, 0.22), (0.1, 0.33, 0.15))),
    ("LIME", "SODA", "lime", ((0.15, 0.5, 0.22), (0.9, 0.92, 0.4), _WHITE)),
    ("CHERRY", "SODA", "cherry", ((0.9, 0.72, 0.76), (0.55, 0.05, 0.2), (0.45, 0.04, 0.16))),
    ("TONIC", "WATER", "drops", ((0.12, 0.25, 0.55), (0.75, 0.85, 0.95), _WHITE)),
    ("LAGER", "BEER", "wheat", ((0.93, 0.9, 0.78), (0.1, 0.32, 0.2), (0.1, 0.28, 0.17))),
    ("PALE ALE", "CRAFT BEER", "peak", ((0.94, 0.93, 0.9), (0.2, 0.42, 0.6), (0.12, 0.2, 0.36))),
    ("STOUT", "DARK BEER", "star", ((0.13, 0.12, 0.12), (0.75, 0.6, 0.3), (0.9, 0.8, 0.55))),
    ("ENERGY", "DRINK", "star", ((0.14, 0.16, 0.2), (0.3, 0.75, 0.25), (0.7, 0.95, 0.3))),
    ("ICED TEA", "PEACH", "peach", ((0.97, 0.85, 0.62), (0.62, 0.28, 0.1), (0.4, 0.16, 0.06))),
    ("SELTZER", "SPARKLING", "drops", ((0.82, 0.86, 0.9), (0.25, 0.6, 0.75), (0.1, 0.35, 0.5))),
)
_FOODS: tuple[tuple[str, str, str, tuple[Color, Color, Color]], ...] = (
    ("TOMATOES", "PEELED", "tomato", ((0.95, 0.92, 0.82), (0.7, 0.1, 0.08), (0.6, 0.08, 0.06))),
    ("TOMATO", "SOUP", "tomato", ((0.75, 0.1, 0.08), (0.94, 0.92, 0.86), (0.98, 0.93, 0.8))),
    ("PEAS", "EXTRA FINE", "peas", ((0.92, 0.94, 0.82), (0.15, 0.4, 0.18), (0.1, 0.32, 0.13))),
    ("BEANS", "IN SAUCE", "beans", ((0.2, 0.55, 0.62), (0.93, 0.9, 0.8), (0.98, 0.97, 0.92))),
    ("CORN", "SWEET", "corn", ((0.2, 0.45, 0.22), (0.96, 0.8, 0.25), (0.98, 0.9, 0.5))),
    ("PEACHES", "IN SYRUP", "peach", ((0.16, 0.3, 0.55), (0.96, 0.75, 0.4), (0.98, 0.93, 0.82))),
    ("OLIVES", "GREEN", "olive", ((0.9, 0.88, 0.72), (0.35, 0.4, 0.14), (0.25, 0.3, 0.1))),
    ("CHERRIES", "SWEET", "cherry", ((0.95, 0.9, 0.88), (0.55, 0.05, 0.14), (0.45, 0.05, 0.12))),
    ("CHILI", "WITH BEANS", "beans", ((0.15, 0.14, 0.13), (0.8, 0.25, 0.1), (0.96, 0.75, 0.3))),
)
_FISH: tuple[tuple[str, str, str, tuple[Color, Color, Color]], ...] = (
    ("TUNA", "", "fish", ((0.92, 0.93, 0.92), (0.12, 0.3, 0.55), (0.1, 0.22, 0.42))),
    ("SARDINES", "", "fish", ((0.96, 0.84, 0.4), (0.7, 0.15, 0.1), (0.55, 0.1, 0.08))),
    ("MACKEREL", "", "", ((0.12, 0.3, 0.5), (0.9, 0.85, 0.6), (0.96, 0.93, 0.8))),
)


FAMILY = ZooFamily(
    random=can_random,
    home="table",
    classes={"": "household item"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
