"""Bottles: of wine, beer, water, soft drinks, milk and sauce, and flasks of steel."""

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
from viewsphere_zoo.household.vessels import vessel
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.cut import cut
from viewsphere_zoo.shapes.paint import Color, coated, linear, metal
from viewsphere_zoo.shapes.rods import ring_of
from viewsphere_zoo.shapes.solids import Float, Solid, curve, join, lathe, moved, tube
from viewsphere_zoo.townscape.surfaces import cuboid

KEYPOINTS = {
    "top": At("cap|body", (0, 0, 1)),
    "shoulder": At("label", (0, 0, 1)),
    "base": At("body", (0, 0, -1)),
}
SKELETON = (("base", "shoulder"), ("shoulder", "top"))

Kind = Literal["wine", "beer", "water", "soda", "milk", "sauce", "flask"]
Closure = Literal["foil", "cork", "crown", "screw", "flip", "lid", "none"]


RIB = 0.002
"""Depth of the grooves of a thin bottle, metres."""

ROUND = 30
"""Sides of a turned body."""


@dataclass(frozen=True)
class Form:
    """A kind's outline, (share of the height, share of the radius); where its label is, and how thick its wall, metres."""

    outline: tuple[tuple[float, float], ...]
    label: tuple[float, float]
    wall: float


FORMS: dict[str, Form] = {
    "claret": Form(
        ((0, 0.92), (0.02, 1), (0.6, 1), (0.66, 0.93), (0.74, 0.5),
         (0.8, 0.4), (0.955, 0.36), (0.96, 0.42), (0.985, 0.42), (1, 0.39)),
        (0.13, 0.5), 0.003,
    ),
    "burgundy": Form(
        ((0, 0.92), (0.02, 1), (0.42, 1), (0.6, 0.74), (0.72, 0.46),
         (0.82, 0.38), (0.955, 0.35), (0.96, 0.41), (0.985, 0.41), (1, 0.38)),
        (0.1, 0.38), 0.003,
    ),
    "beer": Form(
        ((0, 0.9), (0.03, 1), (0.52, 1), (0.64, 0.75), (0.74, 0.5),
         (0.93, 0.42), (0.94, 0.47), (0.97, 0.47), (1, 0.43)),
        (0.12, 0.45), 0.0028,
    ),
    "stubby": Form(
        ((0, 0.9), (0.03, 1), (0.6, 1), (0.74, 0.7), (0.82, 0.46),
         (0.93, 0.42), (0.94, 0.47), (0.97, 0.47), (1, 0.43)),
        (0.14, 0.52), 0.0028,
    ),
    "water": Form(
        ((0, 0.84), (0.04, 1), (0.74, 1), (0.84, 0.72), (0.91, 0.4),
         (0.925, 0.38), (0.93, 0.5), (0.94, 0.5), (0.945, 0.38), (1, 0.38)),
        (0.38, 0.62), 0.0008,
    ),
    "soda": Form(
        ((0, 0.74), (0.05, 0.96), (0.2, 1), (0.36, 0.88), (0.5, 0.99), (0.7, 0.99), (0.83, 0.7),
         (0.91, 0.4), (0.925, 0.37), (0.93, 0.48), (0.94, 0.48), (0.945, 0.37), (1, 0.37)),
        (0.5, 0.7), 0.0008,
    ),
    "milk": Form(
        ((0, 0.92), (0.03, 1), (0.5, 1), (0.7, 0.66), (0.82, 0.5),
         (0.93, 0.5), (0.95, 0.58), (0.98, 0.58), (1, 0.54)),
        (0.14, 0.46), 0.003,
    ),
    "sauce": Form(
        ((0, 0.88), (0.04, 1), (0.54, 1), (0.7, 0.76),
         (0.82, 0.5), (0.86, 0.46), (1, 0.42)),
        (0.12, 0.5), 0.0018,
    ),
    "flask": Form(
        ((0, 0.94), (0.02, 1), (0.72, 1), (0.82, 0.8),
         (0.87, 0.64), (0.9, 0.6), (1, 0.6)),
        (0.2, 0.6), 0.002,
    ),
}  # fmt: skip


WINE_LABEL = Label("RESERVA", "RED WINE", "house", "plain", ((0.93, 0.91, 0.85), (0.5, 0.4, 0.3), (0.15, 0.13, 0.12)))


@dataclass(frozen=True)
class Bottle:
    """Parameters of a bottle; metres, colours sRGB 0..1. form: one of `FORMS`; clear: share of the light that passes; fill: how
    high it is filled, a share of its height.
    """

    form: str = "claret"
    closure: Closure = "foil"
    height: float = 0.3
    radius: float = 0.0375
    color: Color = (0.08, 0.16, 0.09)
    clear: float = 0.0
    content: Color = (0.13, 0.05, 0.03)
    fill: float = 0.0
    cap: Color = (0.45, 0.08, 0.12)
    label: Label | None = WINE_LABEL
    ribs: int = 0
    neck_label: bool = False
    seed: int = 0


def bottle(parameters: Bottle | None = None) -> Mesh:
    """The bottle in metres, its axis on z, its label's face towards -Y.

    Parts: body, inside, and if present label, neck_label, cap.
    """
    p = parameters or Bottle()
    form = FORMS[p.form]
    knots = [k for k, _ in form.outline]
    h = np.unique(np.concatenate([np.linspace(0, 1, 14), np.linspace(*form.label, 3), knots, _ribs(p)]).round(4))
    outer = np.stack([_radius(p, h), p.height * h], axis=1)
    coarse = np.unique(np.concatenate([np.linspace(0, 1, 10), knots]).round(4))
    shell = vessel(outer, form.wall, 0.004, 0.0025)
    inner = vessel(np.stack([_radius(p, coarse), p.height * coarse], axis=1), form.wall + RIB * (p.ribs > 0), 0.004)
    glass = _glass(p, p.color)
    body = join(lathe(shell.foot, ROUND), lathe(shell.wall, ROUND))
    pieces = [
        Piece("body", glass, lathe(shell.lip, ROUND)),
        Piece("inside", glass, lathe(inner.inside, ROUND)),
    ]
    if p.fill:
        full, body = cut(body, body.vertices[:, 2] - p.fill * p.height)
        pieces.append(Piece("body", _glass(p, p.content, "full_glass"), full))
    pieces.append(Piece("body", glass, body))
    rng = np.random.default_rng(p.seed)
    pictures, images = dict[str, charts.Chart](), []
    if p.label:
        paper = charts.printed("label", 0, 0.55)
        low, high = (share * p.height for share in form.label)
        pieces.append(Piece("label", paper, _sleeve(p, form.label)))
        canvas = blank(2 * np.pi * p.radius, high - low, p.label.colors[0])
        wrapper(canvas, p.label, rng)
        images.append(canvas.image("label"))
        pictures["label"] = charts.wound(low, high)
    if p.neck_label and p.label:
        pieces.append(Piece("neck_label", coated("neck_label", p.label.colors[1], "matte"), _sleeve(p, (0.77, 0.87))))
    pieces += [Piece("cap", material, solid) for material, solid in _cap(p)]
    return charts.charted(assemble(pieces, crease_deg=42), pictures, images)


def _radius(p: Bottle, share: Float) -> Float:
    """The outer radius over the height."""
    r = p.radius * curve(share, FORMS[p.form].outline)
    if not p.ribs:
        return r
    low, high = 0.1, 0.72
    wave = np.sin(np.pi * p.ribs * (share - low) / (high - low)) ** 2
    label = FORMS[p.form].label
    bare = (share > low) & (share < high) & ~((share > label[0] - 0.01) & (share < label[1] + 0.01))
    return r - RIB * wave * bare


def _ribs(p: Bottle) -> Float:
    return np.linspace(0.1, 0.72, 3 * p.ribs + 1) if p.ribs else np.zeros(0)


def _glass(p: Bottle, color: Color, name: str = "glass") -> Material:
    """Return the material of the bottle.
    A clear and full bottle has the drink's colour, so that no engine has to render a view through it.
    """
    if p.form == "flask":
        return coated("steel", p.color, "matte") if p.closure == "lid" else metal("steel", p.color, 0.3)
    if p.form == "sauce" and not p.clear:
        return Material("plastic", linear(p.color), roughness=0.35, clearcoat=0.3)
    return Material(
        name,
        linear(color),
        roughness=0.05,
        transmission=p.clear if name == "glass" else 0.3 * p.clear,
        clearcoat=0.0 if p.clear else 1.0,
    )


def _sleeve(p: Bottle, span: tuple[float, float]) -> Solid:
    """Paper or foil around the bottle between two shares of its height."""
    h = np.linspace(*span, 5)
    r, z = _radius(p, h), p.height * h
    skin = np.stack([r + 4e-4, z], axis=1)
    return lathe(np.concatenate([[(r[0] - 2e-4, z[0])], skin, [(r[-1] - 2e-4, z[-1])]]), ROUND)


def _cap(p: Bottle) -> list[tuple[Material, Solid]]:
    """Return the closure of the bottle, by materials."""
    top, neck = p.height, float(_radius(p, np.array([0.99]))[0])
    paint = coated("cap", p.cap, "matte")
    if p.closure == "foil":
        h = np.linspace(0.8, 1, 11)
        skin = np.stack([_radius(p, h) + 4e-4, top * h], axis=1)
        skin = np.concatenate(
            [[(skin[0, 0] - 6e-4, skin[0, 1])], skin, [(skin[-1, 0] - 1e-3, top + 1.5e-3), (0, top + 1.5e-3)]]
        )
        return [(Material("foil", linear(p.cap), metallic=0.4, roughness=0.35), lathe(skin, ROUND))]
    if p.closure == "cork":
        r = neck - FORMS[p.form].wall + 3e-4
        cork = [(0, top - 0.03), (r, top - 0.03), (r, top), (1.1 * r, top + 0.012), (r, top + 0.014), (0, top + 0.014)]
        return [(Material("cork", linear((0.7, 0.53, 0.36)), roughness=0.9), lathe(cork, 28))]
    if p.closure == "crown":
        r = neck + 0.0012
        flute = lathe([(r + 0.0016, top - 0.005), (r, top - 0.001), (0.85 * r, top + 0.0015), (0, top + 0.002)], 42)
        wave = np.where(np.arange(len(flute.vertices)) % 2, 1.0, 0.93)[:, None] ** (flute.vertices[:, 2:] < top - 0.002)
        return [
            (
                metal("crown", p.cap, 0.3),
                Solid(flute.vertices * np.concatenate([wave, wave, 0 * wave + 1], axis=1), flute.triangles),
            )
        ]
    if p.closure == "screw":
        return [(paint, _ribbed(neck + 0.0022, top - 0.013, top + 0.0015, 30))]
    if p.closure == "flip":
        r = neck + 0.004
        nozzle = [
            (r, 0.84 * top),
            (r, top - 0.004),
            (0.95 * r, top),
            (0.4 * r, top + 0.004),
            (0.36 * r, top + 0.014),
            (0, top + 0.015),
        ]
        return [(paint, lathe([(0.8 * r, 0.84 * top), *nozzle], 32))]
    if p.closure == "lid":
        r = neck + 0.002
        loop = tube(
            [
                (x, 0, top + 0.018 + z)
                for x, z in ((-0.8 * r, -0.004), (-0.7 * r, 0.012), (0, 0.019), (0.7 * r, 0.012), (0.8 * r, -0.004))
            ],
            0.0035,
            8,
        )
        return [(paint, join(_ribbed(r, 0.9 * top, top + 0.018, 24), loop))]
    return []


def _ribbed(radius: float, low: float, high: float, count: int) -> Solid:
    """A cap with grip ribs around."""
    body = lathe([(radius - 1e-3, low), (radius, low + 5e-4), (radius, high - 1e-3), (radius - 1e-3, high), (0, high)], 36)
    half = 0.4 * (high - low)
    rib = moved(cuboid((-6e-4, -5e-4, -half), (6e-4, 5e-4, half)), (radius, 0, (low + high) / 2))
    return join(body, ring_of(rib, count))


def bottle_random(rng: np.random.Generator) -> Mesh:
    """A bottle with all parameters drawn."""
    return bottle(draw(rng))


def draw(rng: np.random.Generator) -> Bottle:
    """The parameters of a random bottle."""
    kind: Kind = ("wine", "beer", "water", "soda", "milk", "sauce", "flask")[
        int(rng.choice(7, p=(0.2, 0.17, 0.17, 0.16, 0.1, 0.12, 0.08)))
    ]
    return _DRAWS[kind](rng)


def _label(rng: np.random.Generator, goods: tuple[tuple[str, str, str], ...], grounds: tuple[str, ...]) -> Label:
    title, text, picture = pick(rng, goods)
    return Label(title, text, picture, pick(rng, grounds), pick(rng, _PRINTS))


def _wine(rng: np.random.Generator) -> Bottle:
    cream: tuple[Color, Color, Color] = ((0.93, 0.91, 0.84), pick(rng, _ACCENTS), (0.17, 0.13, 0.12))
    title = pick(rng, ("RESERVA", "MERLOT", "PINOT NOIR", "ROSSO", "CUVEE", "RIESLING", "SYRAH", "BLANC"))
    label = Label(
        title,
        pick(rng, ("2016", "2019", "RED WINE", "ESTATE", "VINEYARD")),
        pick(rng, ("house", "grapes", "house", "")),
        pick(rng, ("plain", "edged", "split")),
        cream,
    )
    return Bottle(
        form=pick(rng, ("claret", "burgundy")),
        closure=pick(rng, ("foil", "foil", "foil", "cork")),
        height=uniform(rng, 0.285, 0.325),
        radius=uniform(rng, 0.036, 0.042),
        color=pick(rng, ((0.07, 0.15, 0.08), (0.1, 0.09, 0.06), (0.16, 0.2, 0.06), (0.05, 0.06, 0.06))),
        cap=pick(rng, _ACCENTS),
        label=label,
        seed=seed(rng),
    )


def _beer(rng: np.random.Generator) -> Bottle:
    goods = (
        ("LAGER", "PREMIUM", "wheat"),
        ("PALE ALE", "CRAFT BEER", "star"),
        ("STOUT", "DARK BEER", "wheat"),
        ("PILSNER", "SINCE 1872", "star"),
        ("CIDER", "APPLE", "cherry"),
    )
    return Bottle(
        form=pick(rng, ("beer", "beer", "stubby")),
        closure="crown",
        height=uniform(rng, 0.2, 0.25),
        radius=uniform(rng, 0.029, 0.033),
        color=pick(rng, ((0.28, 0.13, 0.04), (0.24, 0.1, 0.03), (0.1, 0.3, 0.13))),
        cap=pick(rng, (*_ACCENTS, (0.8, 0.72, 0.45), (0.75, 0.75, 0.76))),
        label=_label(rng, goods, ("halo", "halo", "edged", "split")),
        neck_label=chance(rng, 0.6),
        seed=seed(rng),
    )


def _water(rng: np.random.Generator) -> Bottle:
    tint = pick(rng, ((0.82, 0.92, 0.97), (0.9, 0.95, 0.96), (0.72, 0.88, 0.96), (0.75, 0.92, 0.85)))
    colors = pick(
        rng,
        (
            ((0.16, 0.45, 0.75), (0.85, 0.93, 0.98), (0.97, 0.98, 1.0)),
            ((0.9, 0.95, 0.98), (0.2, 0.55, 0.8), (0.1, 0.25, 0.5)),
            ((0.12, 0.5, 0.45), (0.8, 0.95, 0.9), (0.97, 1.0, 0.98)),
        ),
    )
    words = pick(rng, ("WATER", "SPRING", "NATURAL", "STILL")), pick(rng, ("MINERAL WATER", "500 ML", "SPARKLING"))
    look = pick(rng, ("peak", "drops", "")), pick(rng, ("wave", "plain", "fade", "edged"))
    return Bottle(
        form="water",
        closure="screw",
        height=uniform(rng, 0.2, 0.31),
        radius=uniform(rng, 0.031, 0.041),
        color=tint,
        clear=0.75,
        fill=0.0,
        cap=pick(rng, ((0.15, 0.4, 0.75), (0.93, 0.94, 0.95), (0.1, 0.55, 0.5), (0.55, 0.75, 0.9))),
        label=Label(*words, *look, colors),
        ribs=int(rng.integers(5, 10)),
        seed=seed(rng),
    )


def _soda(rng: np.random.Generator) -> Bottle:
    goods = (
        ("COLA", "CLASSIC", "", (0.13, 0.05, 0.03), ((0.75, 0.08, 0.08), (0.95, 0.93, 0.9), (0.97, 0.96, 0.94))),
        ("ORANGE", "SODA", "orange", (0.95, 0.5, 0.08), ((0.96, 0.6, 0.12), (0.15, 0.4, 0.2), (0.98, 0.97, 0.94))),
        ("LEMON", "FIZZ", "lemon", (0.85, 0.88, 0.5), ((0.97, 0.9, 0.4), (0.2, 0.5, 0.2), (0.1, 0.35, 0.15))),
        ("LIME", "ZERO", "lime", (0.45, 0.65, 0.25), ((0.2, 0.55, 0.2), (0.93, 0.95, 0.7), (0.97, 0.98, 0.9))),
        ("CHERRY", "SODA", "cherry", (0.5, 0.05, 0.12), ((0.55, 0.05, 0.2), (0.9, 0.7, 0.75), (0.98, 0.95, 0.95))),
        ("ICED TEA", "PEACH", "peach", (0.62, 0.3, 0.1), ((0.95, 0.75, 0.45), (0.6, 0.25, 0.1), (0.35, 0.13, 0.06))),
    )  # fmt: skip
    title, text, picture, drink, colors = goods[int(rng.integers(len(goods)))]
    return Bottle(
        form="soda",
        closure="screw",
        height=uniform(rng, 0.21, 0.325),
        radius=uniform(rng, 0.032, 0.043),
        color=(0.9, 0.94, 0.93),
        clear=0.75,
        content=drink,
        fill=uniform(rng, 0.8, 0.9),
        cap=colors[0] if rng.random() < 0.6 else colors[1],
        label=Label(title, text, picture, pick(rng, ("wave", "slant", "plain", "fade")), colors),
        seed=seed(rng),
    )


def _milk(rng: np.random.Generator) -> Bottle:
    blue = pick(
        rng,
        (
            ((0.94, 0.95, 0.96), (0.15, 0.35, 0.7), (0.12, 0.25, 0.55)),
            ((0.94, 0.95, 0.93), (0.2, 0.5, 0.25), (0.12, 0.35, 0.18)),
            ((0.95, 0.94, 0.92), (0.75, 0.15, 0.15), (0.6, 0.1, 0.12)),
        ),
    )
    return Bottle(
        form="milk",
        closure="screw",
        height=uniform(rng, 0.2, 0.26),
        radius=uniform(rng, 0.038, 0.046),
        color=(0.93, 0.93, 0.91),
        clear=0.6,
        content=(0.93, 0.92, 0.88),
        fill=uniform(rng, 0.7, 0.9),
        cap=blue[1],
        label=Label("MILK", pick(rng, ("WHOLE", "FRESH", "FARM")), "cow", pick(rng, ("plain", "edged")), blue),
        seed=seed(rng),
    )


def _sauce(rng: np.random.Generator) -> Bottle:
    goods = (
        ("KETCHUP", "TOMATO", "tomato", (0.7, 0.07, 0.05), ((0.94, 0.92, 0.86), (0.7, 0.1, 0.08), (0.6, 0.08, 0.06))),
        ("MUSTARD", "MILD", "", (0.88, 0.68, 0.1), ((0.96, 0.86, 0.3), (0.6, 0.35, 0.05), (0.35, 0.2, 0.05))),
        ("CHILI", "HOT SAUCE", "tomato", (0.72, 0.16, 0.05), ((0.15, 0.14, 0.13), (0.85, 0.3, 0.1), (0.95, 0.8, 0.3))),
        ("OLIVE OIL", "EXTRA VIRGIN", "olive", (0.42, 0.4, 0.1), ((0.93, 0.91, 0.82), (0.35, 0.42, 0.15), (0.25, 0.28, 0.1))),
        ("SOY", "SAUCE", "star", (0.1, 0.05, 0.04), ((0.75, 0.1, 0.08), (0.95, 0.85, 0.5), (0.97, 0.94, 0.85))),
    )
    title, text, picture, color, colors = goods[int(rng.integers(len(goods)))]
    squeezed = title in ("KETCHUP", "MUSTARD")
    return Bottle(
        form="sauce" if squeezed or rng.random() < 0.4 else "claret",
        closure="flip" if squeezed else "screw",
        height=uniform(rng, 0.17, 0.24),
        radius=uniform(rng, 0.028, 0.035),
        color=color,
        cap=pick(rng, ((0.93, 0.93, 0.91), (0.1, 0.1, 0.11), colors[1])),
        label=Label(title, text, picture, pick(rng, ("edged", "split", "halo")), colors),
        seed=seed(rng),
    )


def _flask(rng: np.random.Generator) -> Bottle:
    return Bottle(
        form="flask",
        closure="lid",
        height=uniform(rng, 0.21, 0.27),
        radius=uniform(rng, 0.033, 0.039),
        color=pick(rng, (*_ACCENTS, (0.13, 0.14, 0.15), (0.9, 0.9, 0.88), (0.4, 0.6, 0.62), (0.82, 0.6, 0.55))),
        cap=pick(rng, ((0.1, 0.1, 0.11), (0.7, 0.7, 0.71), (0.85, 0.84, 0.8))),
        label=None,
        seed=seed(rng),
    )


_DRAWS = {"wine": _wine, "beer": _beer, "water": _water, "soda": _soda, "milk": _milk, "sauce": _sauce, "flask": _flask}
_ACCENTS: tuple[Color, ...] = (
    (0.45, 0.08, 0.12),
    (0.12, 0.2, 0.42),
    (0.1, 0.3, 0.18),
    (0.65, 0.5, 0.2),
    (0.14, 0.13, 0.14),
    (0.72, 0.16, 0.1),
)
_PRINTS: tuple[tuple[Color, Color, Color], ...] = (
    ((0.93, 0.9, 0.82), (0.1, 0.3, 0.18), (0.1, 0.24, 0.14)),
    ((0.94, 0.92, 0.86), (0.72, 0.14, 0.12), (0.55, 0.1, 0.1)),
    ((0.13, 0.13, 0.14), (0.8, 0.65, 0.3), (0.9, 0.8, 0.5)),
    ((0.93, 0.91, 0.85), (0.13, 0.22, 0.45), (0.1, 0.16, 0.36)),
    ((0.95, 0.8, 0.35), (0.5, 0.2, 0.08), (0.35, 0.12, 0.06)),
)


FAMILY = ZooFamily(
    random=bottle_random,
    home="table",
    classes={"": "household item"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
