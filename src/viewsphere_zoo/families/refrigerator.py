"""Refrigerators: freezer below or above, two doors side by side, French doors, rounded retro ones."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import sided
from viewsphere.model.place import LevelFace
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.furnishing.casework import block
from viewsphere_zoo.furnishing.coats import DYES
from viewsphere_zoo.joinery.coats import CHROME, STEEL, drawn_color
from viewsphere_zoo.joinery.members import pipe
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, coated, linear, metal
from viewsphere_zoo.shapes.rods import rod
from viewsphere_zoo.shapes.solids import Solid, join, lathe, moved, rounded_box, tube, turned

KEYPOINTS = {
    **sided("top_front", "body", (1, -1, 1)),
    **sided("top_rear", "body", (1, 1, 1)),
    **sided("bottom_front", "body", (1, -1, -1)),
    **sided("bottom_rear", "body", (1, 1, -1)),
}
SKELETON = (
    ("top_front_left", "top_front_right"),
    ("top_rear_left", "top_rear_right"),
    ("top_front_left", "top_rear_left"),
    ("top_front_right", "top_rear_right"),
    ("top_front_left", "bottom_front_left"),
    ("top_front_right", "bottom_front_right"),
    ("top_rear_left", "bottom_rear_left"),
    ("top_rear_right", "bottom_rear_right"),
)

Style = Literal["bottom_freezer", "top_freezer", "side_by_side", "french", "retro"]
Handle = Literal["bar", "grip", "chrome"]
Door = tuple[float, float, float, float, int, bool]
"""A door: lowest x and z, highest x and z, side of its hinges (-1, 1, or 0 for a drawer), whether it is the main door."""

WALL = 0.045
"""Thickness of the insulated walls, metres."""

GAP = 0.008
"""Gap between doors, metres."""


@dataclass(frozen=True)
class Refrigerator:
    """Parameters of a refrigerator; lengths in metres.

    split: the freezer's share of the height, or of the width where doors are side by side; rounding: of body and doors; steel:
    brushed steel instead of lacquer of this colour; ajar: how far the main door stands open, degrees; dispenser: for water and
    ice in the door; display: a lit panel; notes: held by magnets on the door; seed: of the contents and the notes.
    """

    style: Style = "bottom_freezer"
    width: float = 0.6
    depth: float = 0.62
    height: float = 1.85
    split: float = 0.36
    rounding: float = 0.012
    steel: bool = False
    color: Color = (0.92, 0.92, 0.92)
    handle: Handle = "bar"
    ajar: float = 0.0
    dispenser: bool = False
    display: bool = False
    notes: int = 3
    seed: int = 0

    @property
    def foot(self) -> float:
        """Height of the body's underside."""
        return 0.04 if self.style != "retro" else 0.07

    @property
    def face(self) -> float:
        """y of the body's front, behind the doors."""
        return -self.depth / 2 + 0.055

    @property
    def doors(self) -> list[Door]:
        """The doors and drawers."""
        x, low, high = self.width / 2, self.foot, self.height
        cut = low + self.split * (high - low)
        if self.style == "bottom_freezer":
            return [(-x, low, x, cut - GAP, 1, False), (-x, cut, x, high, 1, True)]
        if self.style in ("top_freezer", "retro"):
            cut = high - self.split * (high - low)
            return [(-x, low, x, cut - GAP, 1, True), (-x, cut, x, high, 1, False)]
        if self.style == "side_by_side":
            border = -x + self.split * self.width
            return [(-x, low, border - GAP / 2, high, -1, False), (border + GAP / 2, low, x, high, 1, True)]
        upper = [(-x, cut, -GAP / 2, high, -1, False), (GAP / 2, cut, x, high, 1, True)]
        return [(-x, low, x, cut - GAP, 0, False), *upper]


@dataclass(frozen=True)
class _Coats:
    shell: Material
    liner: Material
    dark: Material
    grip: Material


def refrigerator(parameters: Refrigerator | None = None) -> Mesh:
    """The refrigerator in metres: its doors face -Y, feet on z = 0, centred in x and y when shut.

    Parts: body, liner, door, gasket, handle, foot, hinge, condenser, compressor; dispenser, display, note, magnet, glass_shelf,
    crisper, food by parameters.
    """
    p = parameters or Refrigerator()
    coats = _Coats(
        metal("steel_skin", (0.66, 0.67, 0.69), 0.32) if p.steel else coated("lacquer", p.color, "gloss"),
        Material("liner", linear((0.93, 0.94, 0.95)), roughness=0.35),
        Material("dark", linear((0.05, 0.05, 0.055)), roughness=0.6),
        CHROME if p.handle == "chrome" else metal("grip", (0.6, 0.61, 0.63), 0.25),
    )
    rng = np.random.default_rng(p.seed)
    pieces = [*_body(p, coats), *_rear(p, coats), *_inside(p, coats, rng)]
    for door in p.doors:
        pieces += _door(p, door, coats, rng)
    return assemble(pieces, 38)


def _body(p: Refrigerator, coats: _Coats) -> list[Piece]:
    """The insulated box, open to the front, and its feet."""
    x, rear, low, high, w = p.width / 2, p.depth / 2 - 0.03, p.foot, p.height - 0.004, WALL
    walls = [
        block((-x, p.face, low), (-x + w, rear, high), p.rounding),
        block((x - w, p.face, low), (x, rear, high), p.rounding),
        block((-x, p.face, high - w), (x, rear, high), p.rounding),
        block((-x, p.face, low), (x, rear, low + w), p.rounding),
        block((-x + 0.01, rear - w, low + 0.01), (x - 0.01, rear - 0.002, high - 0.01), 0.002),
    ]
    i = w - 0.012
    liners = [
        block((s * (x - i) - 0.014, p.face + 0.002, low + i), (s * (x - i) + 0.014, rear - i, high - i), 0.001) for s in (-1, 1)
    ]
    liners += [block((-x + i, p.face + 0.002, z - 0.014), (x - i, rear - i, z + 0.014), 0.001) for z in (low + i, high - i)]
    liners.append(block((-x + i, rear - i - 0.014, low + i), (x - i, rear - i, high - i), 0.001))
    if p.style == "side_by_side":
        border = -x + p.split * p.width
        liners.append(block((border - 0.02, p.face + 0.003, low + i), (border + 0.02, rear - i, high - i), 0.002))
    else:
        z = p.doors[0][3] + GAP / 2
        liners.append(block((-x + i, p.face + 0.003, z - 0.025), (x - i, rear - i, z + 0.025), 0.002))
    foot = lathe([(0, 0), (0.02, 0), (0.018, low + 0.005), (0, low + 0.005)], 12)
    feet = [moved(foot, (s * (x - 0.05), y, 0)) for s in (-1, 1) for y in (p.face + 0.06, rear - 0.06)]
    kick = block((-x + 0.02, p.face + 0.02, 0.012), (x - 0.02, p.face + 0.035, low + 0.004), 0.002)
    base = CHROME if p.style == "retro" else coats.dark
    return [
        Piece("body", coats.shell, join(*walls)),
        Piece("liner", coats.liner, join(*liners)),
        Piece("foot", base, join(*feet, kick)),
    ]


def _rear(p: Refrigerator, coats: _Coats) -> list[Piece]:
    """The condenser's coil and wires, and the compressor in its niche, as seen from behind."""
    x, rear, low, high = p.width / 2 - 0.07, p.depth / 2, p.foot + 0.3, p.height - 0.16
    rows = np.linspace(low, high, 12)
    path = [(s * x, rear - 0.012, z) for k, z in enumerate(rows) for s in ((-1, 1) if k % 2 == 0 else (1, -1))]
    wires = [rod((a, rear - 0.006, low - 0.02), (a, rear - 0.006, high + 0.02), 0.002, 4) for a in np.linspace(-x, x, 15)]
    brackets = [
        block((s * (x + 0.012) - 0.008, rear - 0.035, low - 0.03), (s * (x + 0.012) + 0.008, rear - 0.004, high + 0.03), 0.001)
        for s in (-1, 1)
    ]
    niche = block((-x - 0.03, rear - 0.033, p.foot + 0.015), (x + 0.03, rear - 0.029, p.foot + 0.25), 0.001)
    sheet = block((-x - 0.05, rear - 0.034, p.foot + 0.27), (x + 0.05, rear - 0.029, high + 0.1), 0.0005)
    pot = moved(rounded_box((0.2, 0.11, 0.17), 0.05, 3), (0.1, rear - 0.03, p.foot + 0.11))
    pipes = pipe(
        [(0.1, rear - 0.01, p.foot + 0.18), (-0.1, rear - 0.012, p.foot + 0.24), (-x, rear - 0.012, low)], 0.004, 0.03, 6
    )
    cable = tube(
        [
            (-0.15, rear - 0.03, p.foot + 0.1),
            (-0.2, rear - 0.006, 0.03),
            (-0.16, rear - 0.006, 0.005),
            (-0.05, rear - 0.006, 0.005),
        ],
        0.005,
        6,
    )
    zinc = metal("zinc", (0.72, 0.73, 0.74), 0.5)
    return [
        Piece("back", zinc, sheet),
        Piece("condenser", coats.dark, join(tube(np.array(path), 0.0035, 5), *wires, *brackets)),
        Piece("compressor", coats.dark, join(pot, niche, pipes, cable)),
    ]


def _main(p: Refrigerator) -> Door:
    return next(door for door in p.doors if door[5])


def _levels(p: Refrigerator) -> list[float]:
    """Heights of the shelves behind the main door."""
    _, low, _, high, _, _ = _main(p)
    inner = low + WALL, high - WALL
    count = max(2, round((inner[1] - inner[0]) / 0.3))
    return np.linspace(inner[0] + 0.22, inner[1], count + 1)[:-1].tolist()


def _inside(p: Refrigerator, coats: _Coats, rng: np.random.Generator) -> list[Piece]:
    """Shelves of glass, a crisper and food behind an open door."""
    if p.ajar == 0:
        return []
    x0, low, x1, _, _, _ = _main(p)
    a, b, front, rear = max(x0, -p.width / 2 + WALL) + 0.004, x1 - WALL - 0.004, p.face + 0.05, p.depth / 2 - 0.03 - WALL
    if p.style == "french":
        a = -b
    pane = Material("shelf_glass", linear((0.75, 0.86, 0.86)), roughness=0.1)
    plates = [block((a, front, z - 0.008), (b, rear, z), 0.001) for z in _levels(p)]
    crisper = block((a + 0.01, front, low + WALL + 0.005), (b - 0.01, rear, low + WALL + 0.17), 0.01)
    grip = block((a + 0.06, front - 0.008, low + WALL + 0.12), (b - 0.06, front, low + WALL + 0.14), 0.002)
    found = [Piece("glass_shelf", pane, join(*plates)), Piece("crisper", coats.liner, join(crisper, grip))]
    for z in _levels(p):
        at = a + 0.06
        while at < b - 0.06 and rng.random() < 0.85:
            k = int(rng.integers(len(DYES)))
            pack = Material(f"pack_{k}", linear(DYES[k]), roughness=0.4)
            found.append(Piece("food", pack, moved(_pack(rng), (at, float(rng.uniform(front + 0.08, rear - 0.08)), z))))
            at += float(rng.uniform(0.1, 0.17))
    return found


def _pack(rng: np.random.Generator) -> Solid:
    """A jar, a carton or a bowl."""
    kind, h = int(rng.integers(3)), float(rng.uniform(0.09, 0.15))
    if kind == 0:
        return block((-0.035, -0.035, 0), (0.035, 0.035, h), 0.004)
    r = 0.036 if kind == 1 else 0.05
    if kind == 1:
        return lathe([(0, 0), (r, 0), (r, 0.8 * h), (0.8 * r, 0.88 * h), (0.85 * r, h), (0, h)], 14)
    return lathe([(0, 0), (0.5 * r, 0), (r, 0.55 * h), (0.9 * r, 0.55 * h), (0, 0.5 * h)], 14)


def _door(p: Refrigerator, door: Door, coats: _Coats, rng: np.random.Generator) -> list[Piece]:
    """A door with gasket, handle, hinge and its contents or fittings; the main door is turned open."""
    x0, z0, x1, z1, hinge, is_main = door
    y0, y1 = -p.depth / 2, p.face - 0.008
    leaf = moved(
        rounded_box((x1 - x0, y1 - y0, z1 - z0), max(p.rounding, 0.004), 3), ((x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2)
    )
    seal = block((x0 + 0.012, y1 - 0.002, z0 + 0.012), (x1 - 0.012, p.face + 0.0005, z1 - 0.012), 0.001)
    lining = block((x0 + 0.03, y1, z0 + 0.03), (x1 - 0.03, p.face + 0.002, z1 - 0.03), 0.0005)
    pieces = [Piece("door", coats.shell, leaf), Piece("gasket", coats.dark, seal), Piece("liner", coats.liner, lining)]
    pieces += _grip(p, door, coats)
    first = p.doors[0] if p.style in ("side_by_side", "french") else None
    if p.dispenser and door == (p.doors[1] if p.style == "french" else first):
        pieces += _dispenser(door, y0, coats)
    if p.display and is_main and not p.dispenser:
        panel = block((x0 + 0.4 * (x1 - x0), y0 - 0.002, z1 - 0.24), (x0 + 0.6 * (x1 - x0), y0 + 0.01, z1 - 0.18), 0.001)
        glow = Material("display", linear((0.02, 0.03, 0.05)), roughness=0.05, emissive=(0.01, 0.05, 0.09))
        pieces.append(Piece("display", glow, panel))
    if is_main:
        pieces += _notes(p, door, y0, rng)
    if hinge == 0 or not is_main or p.ajar == 0:
        return pieces
    inner = (x0 + 0.04, x1 - 0.04)
    bins = [
        block((inner[0], p.face, z), (inner[1], p.face + 0.09, z + 0.09), 0.006) for z in np.arange(z0 + 0.12, z1 - 0.2, 0.32)
    ]
    pieces.append(Piece("door_bin", coats.liner, join(*bins)))
    at = np.array((x0 if hinge < 0 else x1, p.face, 0.0))
    turn = hinge * np.radians(p.ajar)
    return [Piece(q.part, q.material, moved(turned(moved(q.solid, -at), 2, turn), at)) for q in pieces]


def _grip(p: Refrigerator, door: Door, coats: _Coats) -> list[Piece]:
    """A long bar, a recessed grip or a lever of chrome."""
    x0, z0, x1, z1, hinge, _ = door
    y, tall = -p.depth / 2, z1 - z0
    if hinge == 0:
        bar = _bar((x0 + 0.12, y - 0.045, z1 - 0.07), (x1 - 0.12, y - 0.045, z1 - 0.07))
        return [Piece("handle", coats.grip, bar)]
    x = x0 + 0.05 if hinge > 0 else x1 - 0.05
    upper = z0 > p.foot + 0.01
    if p.handle == "grip":
        slot = block((x - 0.018, y - 0.012, z0 + 0.3 * tall), (x + 0.018, y + 0.01, z0 + 0.7 * tall), 0.006)
        return [Piece("handle", coats.dark, slot)]
    if p.handle == "chrome":
        z = z0 + 0.12 if upper else z1 - 0.14
        lever = block((min(x, x + 0.2 * hinge), y - 0.05, z - 0.014), (max(x, x + 0.2 * hinge), y - 0.03, z + 0.014), 0.008)
        plate = block((x - 0.024, y - 0.04, z - 0.035), (x + 0.024, y + 0.004, z + 0.035), 0.012)
        return [Piece("handle", coats.grip, join(lever, plate))]
    ends = (z0 + 0.06, z0 + min(0.62 * tall, 0.62)) if upper else (z1 - min(0.62 * tall, 0.62), z1 - 0.06)
    if p.style == "side_by_side":
        ends = (z0 + 0.32 * tall, z0 + 0.72 * tall)
    return [Piece("handle", coats.grip, _bar((x, y - 0.045, ends[0]), (x, y - 0.045, ends[1])))]


def _bar(a: tuple[float, float, float], b: tuple[float, float, float]) -> Solid:
    """A round bar on two posts that stand on the door behind it."""
    p, q = np.array(a), np.array(b)
    posts = [rod(p + s * (q - p), p + s * (q - p) + (0, 0.05, 0), 0.007, 8) for s in (0.08, 0.92)]
    return join(rod(p, q, 0.011, 10), *posts)


def _dispenser(door: Door, y: float, coats: _Coats) -> list[Piece]:
    """A dark niche with a spout, paddle and lit panel over it."""
    x0, z0, x1, z1, _, _ = door
    x, z, w = (x0 + x1) / 2, max(z0 + 0.3 * (z1 - z0), 1.0), min(0.11, 0.3 * (x1 - x0))
    frame = block((x - w - 0.015, y - 0.006, z - 0.015), (x + w + 0.015, y + 0.01, z + 0.36), 0.004)
    niche = block((x - w, y - 0.008, z), (x + w, y + 0.01, z + 0.23), 0.001)
    panel = block((x - w, y - 0.008, z + 0.25), (x + w, y + 0.01, z + 0.345), 0.001)
    spout = rod((x, y - 0.02, z + 0.21), (x, y - 0.02, z + 0.235), 0.022, 12)
    tray = block((x - w + 0.01, y - 0.02, z), (x + w - 0.01, y, z + 0.012), 0.002)
    lit = Material("panel", linear((0.03, 0.05, 0.08)), roughness=0.05, emissive=(0.02, 0.08, 0.13))
    return [
        Piece("dispenser", STEEL, join(frame, tray, spout)),
        Piece("dispenser", coats.dark, niche),
        Piece("display", lit, panel),
    ]


def _notes(p: Refrigerator, door: Door, y: float, rng: np.random.Generator) -> Iterator[Piece]:
    """Sheets of paper under round magnets, side by side from above."""
    x0, z0, x1, z1, _, _ = door
    for k in range(p.notes):
        x = x0 + (0.3 + 0.4 * (k % 2)) * (x1 - x0) + float(rng.uniform(-0.03, 0.03))
        z = z0 + (0.8 - 0.16 * k) * (z1 - z0) + float(rng.uniform(-0.03, 0.03))
        wide, high = float(rng.uniform(0.07, 0.12)), float(rng.uniform(0.08, 0.15))
        shade = (0.95, 0.93, 0.6) if rng.random() < 0.3 else (0.93, 0.92, 0.9)
        sheet = turned(block((-wide / 2, -0.001, -high), (wide / 2, 0.0005, 0.01), 0.0004), 1, float(rng.uniform(-0.12, 0.12)))
        knob = turned(lathe([(0, -0.002), (0.013, -0.002), (0.012, 0.006), (0, 0.007)], 12), 0, np.pi / 2)
        dye = int(rng.integers(len(DYES)))
        yield Piece(
            "note", Material(f"note_{round(100 * shade[2])}", linear(shade), roughness=0.9), moved(sheet, (x, y - 0.0005, z))
        )
        yield Piece("magnet", Material(f"magnet_{dye}", linear(DYES[dye]), roughness=0.4), moved(knob, (x, y - 0.001, z)))


def surfaces(parameters: Refrigerator) -> tuple[LevelFace, ...]:
    """The top."""
    p = parameters
    return (LevelFace("top", (-p.width / 2 + 0.06, p.face + 0.06, p.width / 2 - 0.06, p.depth / 2 - 0.1), p.height - 0.004),)


def refrigerator_random(rng: np.random.Generator) -> Mesh:
    """A refrigerator with parameters drawn to resemble those in real kitchens."""
    return refrigerator(draw(rng))


_LACQUERS: tuple[Color, ...] = (
    (0.93, 0.93, 0.93),
    (0.93, 0.93, 0.93),
    (0.87, 0.86, 0.83),
    (0.09, 0.09, 0.1),
    (0.32, 0.33, 0.35),
)
_RETRO: tuple[Color, ...] = (
    (0.62, 0.82, 0.76),
    (0.78, 0.12, 0.12),
    (0.93, 0.87, 0.7),
    (0.5, 0.68, 0.82),
    (0.93, 0.66, 0.68),
    (0.1, 0.1, 0.11),
)


def draw(rng: np.random.Generator) -> Refrigerator:
    """The parameters of a random refrigerator."""
    style: Style = ("bottom_freezer", "top_freezer", "side_by_side", "french", "retro")[
        int(rng.choice(5, p=(0.3, 0.16, 0.18, 0.16, 0.2)))
    ]
    wide, retro = style in ("side_by_side", "french"), style == "retro"
    splits = {
        "bottom_freezer": (0.3, 0.42),
        "top_freezer": (0.26, 0.34),
        "retro": (0.24, 0.32),
        "side_by_side": (0.4, 0.48),
        "french": (0.32, 0.4),
    }
    steel = bool(rng.random() < (0.6 if wide else 0.0 if retro else 0.35))
    return Refrigerator(
        style=style,
        width=float(rng.uniform(0.85, 0.95) if wide else rng.uniform(0.54, 0.7)),
        depth=float(rng.uniform(0.68, 0.76) if wide else rng.uniform(0.58, 0.68)),
        height=float(rng.uniform(1.72, 1.85) if wide else rng.uniform(1.45, 2.0) if not retro else rng.uniform(1.4, 1.75)),
        split=float(rng.uniform(*splits[style])),
        rounding=float(rng.uniform(0.045, 0.06) if retro else rng.uniform(0.004, 0.02)),
        steel=steel,
        color=drawn_color(_RETRO if retro else _LACQUERS, rng, 0.008),
        handle="chrome" if retro else ("bar", "bar", "grip")[int(rng.integers(3))],
        ajar=float(rng.uniform(55, 110)) if rng.random() < 0.42 else 0.0,
        dispenser=wide and bool(rng.random() < 0.7),
        display=not retro and bool(rng.random() < 0.3),
        notes=int(rng.integers(0, 5)),
        seed=int(rng.integers(1 << 31)),
    )


FAMILY = ZooFamily(
    random=refrigerator_random,
    home="floor",
    classes={"": "furniture"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
    surfaces=surfaces,
)
