"""Laptops: open, with keys, a pad and a screen that shows something."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import At, sided
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.household import charts, screens
from viewsphere_zoo.household.draws import chance, pick, seed, uniform
from viewsphere_zoo.household.slabs import keys, slab, upright
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, coated, linear, metal
from viewsphere_zoo.shapes.solids import Float, Solid, join, lathe, moved, tube, turned
from viewsphere_zoo.townscape.surfaces import cuboid

KEYPOINTS = {
    **sided("base_front", "base", (1, -1, 0)),
    **sided("base_rear", "base", (1, 1, 0)),
    **sided("lid_top", "lid", (1, 0, 1)),
    "keyboard": At("keys"),
    "screen": At("screen"),
}
SKELETON = (
    ("base_front_left", "base_front_right"),
    ("base_front_left", "base_rear_left"),
    ("base_front_right", "base_rear_right"),
    ("base_rear_left", "base_rear_right"),
    ("base_rear_left", "lid_top_left"),
    ("base_rear_right", "lid_top_right"),
    ("lid_top_left", "lid_top_right"),
)

UNITS: tuple[tuple[float, ...], ...] = (
    (1.25, 1.0, 1.0, 1.5, 5.5, 1.25, 1.25, 1.0, 1.25),
    (2.25, *(1.0,) * 10, 2.75),
    (1.75, *(1.0,) * 11, 2.25),
    (1.5, *(1.0,) * 12, 1.5),
    (*(1.0,) * 13, 2.0),
    (1.25, *(1.0,) * 12, 1.75),
)
"""Widths of keys, row by row from the front, in units; each row has 15."""


@dataclass(frozen=True)
class Laptop:
    """Parameters of a laptop; metres, degrees, colours sRGB 0..1.

    thickness: of the base at its rear; wedge: how much thinner it is in front, a share; angle: between base and lid;
    bezel: of the screen at its sides; numbers: with a block of number keys; emblem: disc or bar, on the lid, or none;
    bare: whether it is of bare metal; show: one of `SHOWS`.
    """

    width: float = 0.32
    depth: float = 0.22
    thickness: float = 0.016
    wedge: float = 0.25
    angle: float = 112.0
    bezel: float = 0.008
    color: Color = (0.74, 0.75, 0.77)
    keys: Color = (0.08, 0.08, 0.09)
    deck: Color | None = None
    bare: bool = True
    numbers: bool = False
    emblem: str = "disc"
    show: str = "desktop"
    seed: int = 0

    @property
    def extent(self) -> tuple[float, float, float]:
        """Greatest width, depth and height of the whole model, metres."""
        return self.width + 0.02, 2.0 * self.depth * (0.7 if self.angle < 118 else 0.82), self.depth + 0.03


def laptop(parameters: Laptop | None = None) -> Mesh:
    """The laptop in metres; its user sits at -Y.

    Parts: base, deck, keys, touchpad, port, feet, hinge, lid, bezel, screen, camera, and emblem if it has one.
    """
    p = parameters or Laptop()
    body = metal("aluminium", p.color, 0.42) if p.bare else coated("shell", p.color, "matte")
    rng = np.random.default_rng(p.seed)
    lid, picture, chart = _lid(p, body, rng)
    pieces = [Piece(q.part, q.material, _sloped(p, q.solid)) for q in _base(p, body)]
    mesh = assemble([*pieces, *lid], crease_deg=35)
    return charts.charted(mesh, {"screen": chart}, [picture])


def _sloped(p: Laptop, solid: Solid) -> Solid:
    """The base's solids, thinner towards the front."""
    v = solid.vertices.copy()
    v[:, 2] *= 1 - p.wedge * (0.5 - v[:, 1] / p.depth)
    return Solid(v, solid.triangles)


def _base(p: Laptop, body: Material) -> list[Piece]:
    w, d, t = p.width, p.depth, p.thickness
    foot, dark = 0.0015, Material("black", linear((0.05, 0.05, 0.055)), roughness=0.6)
    field = (w - 0.03, d * 0.5)
    middle = d * 0.13
    deck = dark if p.deck is None else Material("deck", linear(p.deck), roughness=0.5)
    caps = Material("keys", linear(p.keys), roughness=0.65)
    board = moved(slab(field[0] + 0.006, field[1] + 0.006, t - 0.0008, t + 0.0003, 0.004, 1e-4), (0, middle, 0))
    pad = moved(slab(0.36 * w, 0.29 * d, t - 0.001, t + 0.0004, 0.004, 2e-4), (-0.02 * w * p.numbers, -0.31 * d, 0))
    rubber = [moved(slab(0.03, 0.008, 0, 0.003, 0.003), (x * 0.38 * w, y * 0.42 * d, 0)) for x in (-1, 1) for y in (-1, 1)]
    ports = [
        cuboid((s * w / 2 - 0.004, y, 0.4 * t), (s * w / 2 + 3e-4, y + 0.012, 0.4 * t + 0.004))
        for s in (-1, 1)
        for y in (0.18 * d, 0.3 * d)
    ]
    r, g, b = p.color
    shine = metal("pad", p.color, 0.35) if p.bare else Material("pad", linear((0.8 * r, 0.8 * g, 0.8 * b)), roughness=0.4)
    return [
        Piece("base", body, slab(w, d, foot, t, 0.012, 0.0022)),
        Piece("deck", deck, board),
        Piece("keys", caps, moved(keys(_keyboard(field, p.numbers), t, t + 0.0022), (0, middle, 0))),
        Piece("touchpad", shine, pad),
        Piece("feet", dark, join(*rubber)),
        Piece("port", dark, join(*ports)),
    ]


def _keyboard(field: tuple[float, float], numbers: bool) -> Float:
    """Rectangles (K, 4) of x, y, width, depth about the middle of the field."""
    wide, deep = field
    unit = wide / (15 + 4.4 * numbers)
    rows = np.array([1, 1, 1, 1, 1, 0.62])
    step = deep / rows.sum()
    places: list[tuple[float, float, float, float]] = []
    y = -deep / 2
    for units, row in zip(UNITS, rows * step, strict=True):
        x = -wide / 2
        columns = (*units, *((-0.4, 1.0, 1.0, 1.0, 1.0) if numbers else ()))
        for u in columns:
            if u > 0:
                places.append((x + u * unit / 2, y + row / 2, u * unit - 0.0028, row - 0.0028))
            x += abs(u) * unit
        y += row
    return np.array(places)


def _lid(p: Laptop, body: Material, rng: np.random.Generator) -> tuple[list[Piece], screens.Image, charts.Chart]:
    """The lid, made upright and then leant back about the hinge; its picture, and the position of that picture."""
    w, tall, thick = p.width, p.depth - 0.012, 0.0055
    black = Material("glass", linear((0.03, 0.03, 0.033)), roughness=0.15, clearcoat=0.6)
    lean, at = -np.radians(p.angle - 90), (0, p.depth / 2 - 0.011, p.thickness + 0.001)

    def placed(solid: Solid) -> Solid:
        return moved(turned(solid, 0, lean), at)

    def standing(solid: Solid) -> Solid:
        """A slab set upright (z becomes -y), because it was built lying on its back."""
        return moved(turned(solid, 0, np.pi / 2), (0, 0, tall / 2 + 0.004))

    low, high = 0.004 + 0.018, 0.004 + tall - p.bezel - 0.002
    half = w / 2 - p.bezel
    panel = upright((-half, half), low, high, -0.0007)
    shell = standing(slab(w, tall, -thick, 0, 0.012, 0.0016))
    front = standing(slab(w - 0.004, tall - 0.004, -0.001, 4e-4, 0.01, 2e-4))
    eye = moved(
        turned(lathe([(0.0022, 0), (0.0016, 4e-4), (0, 4e-4)], 12), 0, np.pi / 2),
        (0, -4e-4, high + 0.45 * (0.004 + tall - high)),
    )
    hinge = tube([(-0.36 * w, 0, -0.001), (0.36 * w, 0, -0.001)], 0.0042, 12)
    pieces = [
        Piece("hinge", Material("black", linear((0.05, 0.05, 0.055)), roughness=0.6), placed(moved(hinge, (0, 0.002, 0.002)))),
        Piece("lid", body, placed(shell)),
        Piece("bezel", black, placed(front)),
        Piece("screen", screens.lit("screen", 0), placed(panel)),
        Piece("camera", Material("lens", linear((0.12, 0.13, 0.2)), roughness=0.1), placed(eye)),
    ]
    if p.emblem:
        mark = metal("emblem", (0.85, 0.86, 0.88) if sum(p.color) < 1.8 else (0.35, 0.36, 0.38), 0.2)
        size = 0.017
        shape = (
            lathe([(size, 0), (size, 6e-4), (0.55 * size, 6e-4), (0.55 * size, 0)], 28)
            if p.emblem == "disc"
            else slab(2.2 * size, size, 0, 6e-4, 0.3 * size, 1e-4)
        )
        back = moved(turned(shape, 0, -np.pi / 2), (0, thick - 1e-4, tall / 2 + 0.004))
        pieces.append(Piece("emblem", mark, placed(back)))
    corners = placed(
        Solid(np.array([(-half, -0.0007, low), (half, -0.0007, low), (-half, -0.0007, high)]), np.zeros((0, 3), np.int64))
    ).vertices
    picture = screens.picture(p.show, 2 * half, high - low, rng)
    return pieces, picture, charts.plane(corners[0], corners[1] - corners[0], corners[2] - corners[0])


def laptop_random(rng: np.random.Generator) -> Mesh:
    """A laptop with all parameters drawn."""
    return laptop(draw(rng))


def draw(rng: np.random.Generator) -> Laptop:
    """The parameters of a random laptop."""
    width = uniform(rng, 0.285, 0.39)
    color, caps, bare = pick(rng, _SHELLS)
    return Laptop(
        width=width,
        depth=width * uniform(rng, 0.64, 0.72),
        thickness=uniform(rng, 0.013, 0.024),
        wedge=uniform(rng, 0.0, 0.45),
        angle=uniform(rng, 92, 132),
        bezel=uniform(rng, 0.005, 0.016),
        color=color,
        keys=caps,
        deck=None if chance(rng, 0.45) else color,
        bare=bare,
        numbers=width > 0.345 and chance(rng, 0.6),
        emblem=pick(rng, ("disc", "bar")),
        show=pick(rng, (*screens.SHOWS,)),
        seed=seed(rng),
    )


_BLACK: Color = (0.09, 0.09, 0.1)
_SHELLS: tuple[tuple[Color, Color, bool], ...] = (
    ((0.76, 0.77, 0.78), _BLACK, True),
    ((0.76, 0.77, 0.78), (0.8, 0.8, 0.8), True),
    ((0.36, 0.37, 0.39), _BLACK, True),
    ((0.11, 0.11, 0.12), (0.07, 0.07, 0.075), False),
    ((0.15, 0.16, 0.18), (0.1, 0.1, 0.11), False),
    ((0.92, 0.92, 0.91), (0.86, 0.86, 0.86), False),
    ((0.85, 0.72, 0.62), (0.9, 0.86, 0.82), True),
    ((0.22, 0.3, 0.42), (0.13, 0.15, 0.2), True),
    ((0.5, 0.14, 0.16), _BLACK, False),
    ((0.5, 0.62, 0.6), (0.88, 0.9, 0.88), False),
)


FAMILY = ZooFamily(
    random=laptop_random,
    home="table",
    classes={"": "household item"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
