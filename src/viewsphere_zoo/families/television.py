"""Televisions: flat ones on feet, on a foot, on a pole or on a low cabinet, and old ones with a tube."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh, Texture
from viewsphere.model.annotations.keypoints import sided
from viewsphere.model.place import LevelFace
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.furnishing.broadcasts import Show, broadcast
from viewsphere_zoo.furnishing.carcass import Carcass, Column, carcass, fronts
from viewsphere_zoo.furnishing.casework import block, footed, four
from viewsphere_zoo.furnishing.coats import BLACK_STEEL, Wood, drawn_wood, furnished, grain
from viewsphere_zoo.joinery.coats import STEEL
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color, linear
from viewsphere_zoo.shapes.rods import circle, rod
from viewsphere_zoo.shapes.sheets import sheet
from viewsphere_zoo.shapes.solids import join, lathe, loft, moved, rounded_box, tube, turned

KEYPOINTS = {
    **sided("screen_top", "screen", (1, 0, 1)),
    **sided("screen_bottom", "screen", (1, 0, -1)),
}
SKELETON = (
    ("screen_top_left", "screen_top_right"),
    ("screen_bottom_left", "screen_bottom_right"),
    ("screen_top_left", "screen_bottom_left"),
    ("screen_top_right", "screen_bottom_right"),
)

Style = Literal["feet", "foot", "easel", "console", "tube"]


@dataclass(frozen=True)
class Television:
    """Parameters of a television; lengths in metres.

    width: of the set, its screen is 16:9 (4:3 with a tube); bezel: the frame around the screen; lift: height of the set's
    underside above its base; console_height: of a low cabinet; show: the programme on the screen, or nothing; bright: how
    strongly the screen shines; seed: of the picture and of the grain.
    """

    style: Style = "console"
    width: float = 1.23
    bezel: float = 0.012
    lift: float = 0.06
    console_height: float = 0.48
    show: Show | None = "hills"
    bright: float = 0.8
    casing: Color = (0.05, 0.05, 0.055)
    wood: Wood = field(default_factory=Wood)
    seed: int = 0

    @property
    def stand(self) -> float:
        """Height of the surface that the set stands on."""
        return self.console_height if self.style == "console" else 0.42 if self.style == "tube" else 0.0

    @property
    def console(self) -> tuple[float, float]:
        """Width and depth of the low cabinet."""
        return self.width * 1.18 + 0.1, 0.42

    @property
    def screen(self) -> tuple[float, float, float, float]:
        """Lowest x and z, highest x and z of the lit screen."""
        half = self.width / 2 - self.bezel
        if self.style == "tube":
            low, high = self.stand + 0.09, self.stand + 0.09 + 2 * half * 0.75
            return -half, low, half, high
        low = self.stand + self.lift + 1.4 * self.bezel
        return -half, low, half, low + 2 * half * 9 / 16

    @property
    def extent(self) -> tuple[float, float, float]:
        """Greatest width, depth and height of the whole model, metres."""
        wide, deep = self.console if self.style == "console" else (self.width, 0.54 if self.style == "tube" else 0.3)
        return wide + 0.04, deep + 0.04, self.stand + 0.6 * self.width + self.lift + 0.2


def television(parameters: Television | None = None) -> Mesh:
    """The television in metres: its screen faces -Y, standing on z = 0, centred in x.

    Parts: screen, casing, stand; console, door, drawer, handle, leg under it, vent, port, mount, cable behind, button, aerial.
    """
    p = parameters or Television()
    rng = np.random.default_rng(p.seed)
    images = [grain(rng, p.wood)]
    if p.show:
        images.append(broadcast(rng, p.show))
    plastic = Material("casing", linear(p.casing), roughness=0.45, clearcoat=0.2, clearcoat_roughness=0.3)
    found = _tube(p, plastic) if p.style == "tube" else [*_flat(p, plastic), *_STANDS[p.style](p, plastic)]
    return furnished(found, images, 38)


def _lit(p: Television) -> Material:
    """The screen's material: the picture shines; its uv are metres, so scale and offset fit it into the screen."""
    if p.show is None:
        return Material("screen", linear((0.012, 0.012, 0.014)), roughness=0.08, clearcoat=1.0)
    x0, z0, x1, z1 = p.screen
    wide, high = 1 / (x1 - x0), 1 / (z1 - z0)
    picture = Texture(1, wrap_s="clamp", wrap_t="clamp", scale=(wide, high), offset=(-x0 * wide, z1 * high))
    shine = (p.bright, p.bright, p.bright)
    return Material("screen", (0.02, 0.02, 0.02, 1.0), roughness=0.1, clearcoat=1.0, emissive=shine, emissive_texture=picture)


def _flat(p: Television, plastic: Material) -> list[Piece]:
    """Panel, bezel, the box of electronics behind, with vents, ports and the plate of a wall mount."""
    x0, z0, x1, z1 = p.screen
    b, low, high = p.bezel, z0 - 1.4 * p.bezel, z1 + p.bezel
    dark = Material("recess", linear((0.015, 0.015, 0.015)), roughness=0.9)
    frame = [
        block((x0 - b, -0.018, low), (x1 + b, 0.012, z0), 0.002),
        block((x0 - b, -0.018, z1), (x1 + b, 0.012, high), 0.002),
    ]
    frame += [block((a, -0.018, low), (a + b, 0.012, high), 0.002) for a in (x0 - b, x1)]
    frame.append(block((x0, -0.008, z0), (x1, 0.012, z1), 0.001))
    glass = block((x0, -0.0145, z0), (x1, -0.006, z1), 0.0005)
    tall, half = high - low, (x1 - x0) / 2
    shell = moved(rounded_box((1.3 * half, 0.045, 0.55 * tall), 0.02, 2), (0, 0.022, low + 0.34 * tall))
    slots = [
        block(
            (s * 0.32 * half - 0.24 * half, 0.043, low + f * tall),
            (s * 0.32 * half + 0.24 * half, 0.0452, low + (f + 0.008) * tall),
            0.0005,
        )
        for s in (-1, 1)
        for f in np.linspace(0.45, 0.57, 7)
    ]
    bolt = turned(lathe([(0, 0), (0.01, 0), (0.01, 0.003), (0, 0.003)], 10), 0, -np.pi / 2)
    mounts = [moved(bolt, (sx * 0.15, 0.044, low + 0.33 * tall + sz * 0.1)) for sx in (-1, 1) for sz in (-1, 1)]
    ports = [
        block(
            (0.42 * half, 0.04, low + (0.14 + 0.05 * k) * tall),
            (0.42 * half + 0.02, 0.0455, low + (0.17 + 0.05 * k) * tall),
            0.0005,
        )
        for k in range(4)
    ]
    label = block((-0.09, 0.044, low + 0.12 * tall), (0.05, 0.0453, low + 0.19 * tall), 0.0002)
    paper = Material("label", linear((0.8, 0.8, 0.8)), roughness=0.7)
    cable = tube(
        [
            (-0.4 * half, 0.04, low + 0.12 * tall),
            (-0.42 * half, 0.075, low + 0.04 * tall),
            (-0.4 * half, 0.07, p.stand + 0.006),
            (-0.25 * half, 0.09, p.stand + 0.006),
        ],
        0.0045,
        7,
    )
    return [
        Piece("screen", _lit(p), glass),
        Piece("casing", plastic, join(*frame, shell)),
        Piece("vent", dark, join(*slots)),
        Piece("mount", STEEL, join(*mounts)),
        Piece("port", STEEL, join(*ports)),
        Piece("label", paper, label),
        Piece("cable", dark, cable),
    ]


def _feet(p: Television, plastic: Material) -> list[Piece]:
    """Two slanting feet near the ends."""
    top, z = p.stand + p.lift + 0.02, p.stand
    x = 0.36 * p.width
    solids = []
    for s in (-1, 1):
        for y in (-0.12, 0.13):
            path = np.linspace((s * x, 0.0, top), (s * (x + 0.02), y, z + 0.006), 4)
            solids.append(tube(path, 0.0085, 8))
            solids.append(block((s * (x + 0.02) - 0.012, y - 0.012, z), (s * (x + 0.02) + 0.012, y + 0.012, z + 0.01), 0.003))
    return [Piece("stand", plastic, join(*solids))]


def _foot(p: Television, plastic: Material) -> list[Piece]:
    """A neck on one broad plate."""
    z = p.stand
    plate = loft(np.array([np.column_stack([circle(1, 40) * (0.24 * p.width, 0.12), np.full(40, h)]) for h in (z, z + 0.012)]))
    neck = block((-0.05, -0.006, z + 0.006), (0.05, 0.03, z + p.lift + 0.12), 0.006)
    return [Piece("stand", plastic, join(plate, neck))]


def _easel(p: Television, plastic: Material) -> list[Piece]:
    """Three long legs of wood, like an easel, and the rail that carries the set."""
    wood, low = p.wood.timber(0).upright, p.lift
    rail = block((-0.3 * p.width, -0.02, low - 0.045), (0.3 * p.width, 0.04, low + 0.002), 0.004)
    high = low + 0.42 * p.width
    legs = [rod((s * 0.34 * p.width, -0.12, 0.012), (s * 0.16 * p.width, 0.05, high), 0.015, 10) for s in (-1, 1)]
    legs.append(rod((0, 0.5, 0.012), (0, 0.06, high), 0.015, 10))
    tie = block((-0.18 * p.width, 0.035, high - 0.04), (0.18 * p.width, 0.075, high), 0.004)
    feet = [
        moved(lathe([(0, 0), (0.017, 0), (0.017, 0.02), (0, 0.02)], 10), at)
        for at in ((-0.34 * p.width, -0.12, 0), (0.34 * p.width, -0.12, 0), (0, 0.5, 0))
    ]
    return [
        Piece("stand", wood, join(*(footed(s) for s in legs), *feet, rail, tie)),
        Piece("stand", plastic, block((-0.06, 0.01, low), (0.06, 0.05, low + 0.2))),
    ]


def _console(p: Television, plastic: Material) -> list[Piece]:
    """The set's feet on a low cabinet with doors and open bays."""
    wood = p.wood.timber(0)
    width, depth = p.console
    bays: Column = ((0.5, "open"), (0.5, "open"))
    columns: tuple[Column, ...] = (((1.0, "door"),), bays, ((1.0, "door"),)) if p.seed % 2 else (bays, ((1.0, "drawer"),), bays)
    foot = 0.13
    box = Carcass(width / 2 - 0.01, depth, foot, p.console_height - 0.022, columns, pull="rail")
    top = block((-width / 2, -depth / 2 - 0.01, p.console_height - 0.022), (width / 2, depth / 2, p.console_height), 0.003)
    legs = four("splayed", (width / 2 - 0.09, depth / 2 - 0.07), foot, 0.042)
    found = [
        *carcass(box, wood),
        *fronts(box, wood, BLACK_STEEL),
        Piece("console", wood.along, top),
        Piece("leg", wood.upright, legs),
    ]
    return [*found, *_feet(p, plastic)]


def _tube(p: Television, plastic: Material) -> list[Piece]:
    """An old set: a deep case that narrows to the rear, curved glass, buttons, an aerial, on four legs."""
    x0, z0, x1, z1 = p.screen
    b, depth, z = p.bezel, 0.78 * p.width, p.stand
    wood = p.wood.timber(0)
    y = -depth / 2
    low, high = z + 0.012, z1 + b
    half, mid, tall = p.width / 2, (low + high) / 2, (high - low) / 2
    face = y - 0.004
    rim = [
        block((x0 - b, face, low), (x1 + b, y + 0.05, z0), 0.008),
        block((x0 - b, face, z1), (x1 + b, y + 0.05, high), 0.008),
    ]
    rim += [block((a, face, low), (a + b, y + 0.05, high), 0.008) for a in (x0 - b, x1)]
    square = np.array([(-1, -1), (-1, 1), (1, 1), (1, -1)], np.float64)
    rings = [
        (half, tall, mid, y + 0.02),
        (half, tall, mid, y + 0.36 * depth),
        (0.62 * half, 0.68 * tall, mid, y + 0.72 * depth),
        (0.5 * half, 0.5 * tall, mid, -y),
    ]
    body = loft(np.array([np.column_stack([square[:, 0] * a, np.full(4, at), m + square[:, 1] * t]) for a, t, m, at in rings]))
    u, v = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9), indexing="ij")
    bulge = y + 0.006 - 0.022 * (1 - u**2) * (1 - v**2)
    middle = (z0 + z1) / 2
    glass = np.stack([u * (x1 + 0.003), bulge, middle + v * (z1 - z0 + 0.006) / 2], axis=-1)
    knob = turned(lathe([(0, 0), (0.012, 0), (0.011, 0.014), (0, 0.015)], 12), 0, np.pi / 2)
    knobs = [moved(knob, (half - 0.05 - 0.04 * k, face, (low + z0) / 2)) for k in range(4)]
    grille = [
        block((-half + 0.03, face - 0.002, low + 0.014 + 0.009 * k), (0.1, face + 0.004, low + 0.018 + 0.009 * k), 0.0005)
        for k in range(5)
    ]
    dark = Material("recess", linear((0.015, 0.015, 0.015)), roughness=0.9)
    slots = [
        block((-0.4 * half, -y - 0.002, mid + k * 0.018), (0.4 * half, -y + 0.001, mid + 0.007 + k * 0.018), 0.0005)
        for k in range(-3, 4)
    ]
    rods = [rod((s * 0.015, 0.0, high), (s * 0.26, 0.03, high + 0.42), 0.0028, 6) for s in (-1, 1)]
    base = lathe([(0, high - 0.01), (0.05, high - 0.01), (0.045, high + 0.02), (0, high + 0.025)], 16)
    legs = four("splayed", (half - 0.1, depth / 2 - 0.14), z - 0.002, 0.04)
    board = block((-half - 0.01, y + 0.01, z - 0.022), (half + 0.01, -y - 0.03, z + 0.013), 0.004)
    return [
        Piece("screen", _lit(p), sheet(glass, 0.006)),
        Piece("casing", plastic, join(*rim)),
        Piece("casing", plastic if p.seed % 2 else wood.along, body),
        Piece("button", STEEL, join(*knobs)),
        Piece("vent", dark, join(*grille, *slots)),
        Piece("aerial", STEEL, join(base, *rods)),
        Piece("stand", wood.along, board),
        Piece("leg", wood.upright, legs),
    ]


_STANDS = {"feet": _feet, "foot": _foot, "easel": _easel, "console": _console}


def surfaces(parameters: Television) -> tuple[LevelFace, ...]:
    """Return the free surfaces of the low cabinet's top, at both sides of the set; empty without a cabinet."""
    p = parameters
    if p.style != "console":
        return ()
    width, depth = p.console
    inner, outer, y = p.width / 2 + 0.01, width / 2 - 0.02, depth / 2 - 0.02
    left = LevelFace("console_left", (inner, -y, outer, y), p.console_height)
    return left, LevelFace("console_right", (-outer, -y, -inner, y), p.console_height)


def television_random(rng: np.random.Generator) -> Mesh:
    """A television with parameters drawn to resemble those in real living rooms."""
    return television(draw(rng))


def draw(rng: np.random.Generator) -> Television:
    """The parameters of a random television."""
    style: Style = ("feet", "foot", "easel", "console", "tube")[int(rng.choice(5, p=(0.17, 0.2, 0.05, 0.38, 0.2)))]
    shows: tuple[Show, ...] = ("hills", "football", "news", "sunset", "cartoon")
    tube_ = style == "tube"
    casings: tuple[Color, ...] = ((0.04, 0.04, 0.045), (0.09, 0.09, 0.1), (0.35, 0.36, 0.38), (0.8, 0.8, 0.8))
    return Television(
        style=style,
        width=float(rng.uniform(0.5, 0.68) if tube_ else rng.uniform(0.72, 1.45)),
        bezel=float(rng.uniform(0.03, 0.05) if tube_ else rng.uniform(0.007, 0.024)),
        lift=float(rng.uniform(0.75, 1.0) if style == "easel" else rng.uniform(0.07, 0.12)),
        console_height=float(rng.uniform(0.4, 0.58)),
        show=shows[int(rng.integers(5))] if rng.random() < 0.8 else None,
        bright=float(rng.uniform(0.6, 1.3)),
        casing=casings[int(rng.choice(4, p=(0.4, 0.25, 0.2, 0.15)))],
        wood=drawn_wood(rng, 0.3),
        seed=int(rng.integers(1 << 31)),
    )


FAMILY = ZooFamily(
    random=television_random,
    home="table",
    classes={
        "": "household item",
        "console": "furniture",
        "door": "furniture",
        "drawer": "furniture",
        "handle": "furniture",
        "leg": "furniture",
    },
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
    surfaces=surfaces,
)
