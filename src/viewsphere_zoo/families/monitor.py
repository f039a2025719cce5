"""Computer monitors: flat or curved, on round, square or forked feet, with a picture on the screen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import At, sided
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.household import charts, screens
from viewsphere_zoo.household.draws import chance, pick, seed, uniform
from viewsphere_zoo.household.slabs import rounded, slab, upright
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, coated, lamp, linear, metal
from viewsphere_zoo.shapes.rods import bezier, shifted
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, join, lathe, loft, moved, tube, turned
from viewsphere_zoo.townscape.surfaces import cuboid

KEYPOINTS = {
    **sided("screen_top", "screen", (1, 0, 1)),
    **sided("screen_bottom", "screen", (1, 0, -1)),
    "neck": At("neck"),
    "foot": At("foot", (0, 0, -1)),
}
SKELETON = (
    ("screen_top_left", "screen_top_right"),
    ("screen_bottom_left", "screen_bottom_right"),
    ("screen_top_left", "screen_bottom_left"),
    ("screen_top_right", "screen_bottom_right"),
    ("neck", "foot"),
)

Foot = Literal["disc", "plate", "fork", "hoop"]


@dataclass(frozen=True)
class Monitor:
    """Parameters of a monitor; metres, degrees, colours sRGB 0..1.

    width, height: of its front; lift: from the table to its lower edge; chin: the bezel below; curve: radius it is bent to,
    0 flat; tilt: how far it leans back; bulge: depth of the housing behind; show: one of `SHOWS`.
    """

    width: float = 0.61
    height: float = 0.36
    lift: float = 0.12
    bezel: float = 0.009
    chin: float = 0.02
    curve: float = 0.0
    tilt: float = 4.0
    bulge: float = 0.035
    foot: Foot = "plate"
    color: Color = (0.1, 0.1, 0.11)
    stand: Color = (0.1, 0.1, 0.11)
    bare: bool = False
    show: str = "desktop"
    seed: int = 0

    @property
    def extent(self) -> tuple[float, float, float]:
        """Greatest width, depth and height of the whole model, metres."""
        return self.width + 0.01, 0.31, self.height + self.lift + 0.07


def monitor(parameters: Monitor | None = None) -> Mesh:
    """The monitor in metres: its screen faces -Y. Parts: housing, bezel, screen, lamp, vents, mount, neck, foot, cable."""
    p = parameters or Monitor()
    rng = np.random.default_rng(p.seed)
    w, h = p.width, p.height
    housing, dark = coated("housing", p.color, "matte"), Material("black", linear((0.04, 0.04, 0.045)), roughness=0.7)
    x = np.linspace(-w / 2, w / 2, 17 if p.curve else 2)
    inside = np.linspace(-w / 2 + p.bezel, w / 2 - p.bezel, len(x))
    vents = [
        cuboid((k * 0.012 - 0.0035, p.bulge + 0.0135, 0.62 * h), (k * 0.012 + 0.0035, p.bulge + 0.0146, 0.62 * h + 0.045))
        for k in range(-9, 10)
    ]
    head = [
        Piece("housing", housing, _frame(x, h)),
        Piece("housing", housing, _back(p)),
        Piece("bezel", dark if sum(p.color) < 1.5 else housing, upright(x, 0.0012, h - 0.0012, -0.0006)),
        Piece("screen", screens.lit("screen", 0), upright(inside, p.chin, h - p.bezel, -0.0014)),
        Piece(
            "lamp",
            lamp("lamp", (0.4, 0.8, 1.0), 0.8),
            cuboid((0.42 * w, -0.0016, 0.35 * p.chin), (0.42 * w + 0.008, 0, 0.35 * p.chin + 0.002)),
        ),
        Piece("vents", dark, join(*vents)),
        Piece("mount", dark, moved(turned(slab(0.1, 0.1, 0, 0.012, 0.008), 0, -np.pi / 2), (0, p.bulge + 0.012, 0.42 * h))),
    ]
    placed = [Piece(q.part, q.material, _hung(p, q.solid)) for q in head]
    picture = screens.picture(p.show, w - 2 * p.bezel, h - p.chin - p.bezel, rng)
    mesh = assemble([*placed, *_stand(p), *_cable(p, dark)], crease_deg=35)
    corners = _hung(p, Solid(np.array([(0, 0, p.chin), (0, 0, h - p.bezel)]), np.zeros((0, 3), np.int64)), bend=False).vertices
    wide = w - 2 * p.bezel
    lower = corners[0] - (wide / 2, 0, 0)
    return charts.charted(mesh, {"screen": charts.plane(lower, (wide, 0, 0), corners[1] - corners[0])}, [picture])


def _bent(p: Monitor, solid: Solid) -> Solid:
    """Return a flat solid bent like a curved screen: its sides come forward."""
    if not p.curve:
        return solid
    v = solid.vertices.copy()
    v[:, 1] -= v[:, 0] ** 2 / (2 * p.curve)
    return Solid(v, solid.triangles)


def _hung(p: Monitor, solid: Solid, bend: bool = True) -> Solid:
    """A solid moved from the head's own axes (lower edge at z = 0) to its place: leant back about its middle."""
    bent = _bent(p, solid) if bend else solid
    middle = np.array((0, 0, p.height / 2))
    leant = turned(Solid(bent.vertices - middle, bent.triangles), 0, -np.radians(p.tilt))
    return moved(leant, shifted(middle, z=p.lift))


def _frame(x: Float, h: float) -> Solid:
    """The thin edge all around, 12 mm deep, a section of it at each x."""
    section = np.array([(0, 0), (0, h), (0.001, h), (0.012, h - 0.004), (0.012, 0.004), (0.001, 0)])
    return loft(np.array([[(a, y, z) for y, z in section[::-1]] for a in x]))


def _back(p: Monitor) -> Solid:
    """The bulging middle of the housing's rear."""
    w, h = p.width, p.height
    levels = ((0.98, 0.011), (0.94, 0.016), (0.72, 0.011 + 0.8 * p.bulge), (0.62, 0.012 + p.bulge))
    if p.curve:
        levels = ((0.7, 0.004), (0.68, 0.016), (0.56, 0.011 + 0.8 * p.bulge), (0.5, 0.012 + p.bulge))
    rings: list[Float] = []
    for share, y in levels:
        ring = rounded(w * share, h * (0.985 if share > 0.9 else 0.9) * (0.6 + 0.4 * share), 0.02)
        finer = (
            np.linspace(ring, np.roll(ring, -1, axis=0), 6 if p.curve else 1, endpoint=False).transpose(1, 0, 2).reshape(-1, 2)
        )
        rings.append(np.column_stack([-finer[:, 0], np.full(len(finer), y), finer[:, 1] + 0.48 * h]))
    return loft(np.array(rings), (False, True))


def _stand(p: Monitor) -> list[Piece]:
    """Neck and foot."""
    paint = metal("stand", p.stand, 0.4) if p.bare else coated("stand", p.stand, "matte")
    back = p.bulge + 0.02
    y, top = back + 0.016, p.lift + 0.5 * p.height
    deep = float(np.clip(0.55 * (p.lift + p.height) * 0.75, 0.16, 0.26))
    arm = moved(turned(slab(0.07, 0.09, -0.012, 0.02, 0.008), 0, -np.pi / 2), (0, back, p.lift + 0.42 * p.height))
    if p.foot == "disc":
        base = lathe(
            [(0, 0), (0.5 * deep, 0), (0.52 * deep, 0.004), (0.5 * deep, 0.009), (0.1, 0.012), (0.03, 0.016), (0, 0.016)], 48
        )
        neck = tube([(0, y, 0.008), (0, y, top)], 0.021, 20)
        return [Piece("foot", paint, moved(base, (0, 0.25 * y, 0))), Piece("neck", paint, join(neck, arm))]
    column = loft(
        np.array([np.column_stack([np.add(rounded(0.062, 0.024, 0.009), (0, y)), np.full(20, z)]) for z in (0.004, top)])
    )
    if p.foot == "plate":
        base = moved(slab(min(0.42 * p.width, 0.27), deep, 0, 0.011, 0.014, 0.002), (0, 0.1 * y, 0))
    elif p.foot == "hoop":
        ring, hole = rounded(0.26, deep, 0.03), rounded(0.236, deep - 0.024, 0.02)
        rings = [np.column_stack([r, np.full(20, z)]) for r, z in ((ring, 0), (ring, 0.01), (hole, 0.01), (hole, 0), (ring, 0))]
        base = join(
            moved(loft(np.array(rings), (False, False)), (0, y - deep / 2 + 0.016, 0)),
            cuboid((-0.12, y - 0.016, 0), (0.12, y + 0.016, 0.01)),
        )
    else:
        leg = _leg(np.array((0.02, y, 0)), np.array((0.4 * p.width, -0.55 * deep, 0)))
        base = join(both_sides(leg), moved(slab(0.09, 0.06, 0, 0.02, 0.012), (0, y, 0)))
    return [Piece("foot", paint, base), Piece("neck", paint, join(column, arm))]


def _leg(start: Float, stop: Float) -> Solid:
    """A flat bar on the table that grows lower and narrower towards its end."""
    along = (stop - start) / np.linalg.norm(stop - start)
    across = np.array((-along[1], along[0], 0.0))
    rings: list[list[Float]] = []
    for share, half, high in ((0, 0.014, 0.018), (0.5, 0.012, 0.013), (0.97, 0.011, 0.009), (1, 0.007, 0.006)):
        middle = start + share * (stop - start)
        section = [(-half, 0), (half, 0), (half, 0.8 * high), (0.7 * half, high), (-0.7 * half, high), (-half, 0.8 * high)]
        rings.append([middle - a * across + (0, 0, b) for a, b in section])
    return loft(np.array(rings)[:, ::-1])


def _cable(p: Monitor, dark: Material) -> list[Piece]:
    """The cable from the housing down to the table."""
    y = p.bulge + 0.012
    start = np.array((0.09, y - 0.004, p.lift + 0.22 * p.height))
    path = bezier(start, shifted(start, y=0.05, z=-0.02), (0.08, y + 0.07, 0.05), (0.1, y + 0.11, 0.0042), 14)
    return [Piece("cable", dark, tube(path, 0.004, 8))]


def monitor_random(rng: np.random.Generator) -> Mesh:
    """A monitor with all parameters drawn."""
    return monitor(draw(rng))


def draw(rng: np.random.Generator) -> Monitor:
    """The parameters of a random monitor."""
    ratio = (16 / 9, 16 / 10, 21 / 9, 5 / 4)[int(rng.choice(4, p=(0.5, 0.2, 0.2, 0.1)))]
    height = uniform(rng, 0.29, 0.4) if ratio > 1.3 else uniform(rng, 0.29, 0.34)
    color, stand, bare = pick(rng, _HOUSINGS)
    bezel = uniform(rng, 0.005, 0.012) if ratio > 1.3 else uniform(rng, 0.014, 0.02)
    return Monitor(
        width=height * ratio,
        height=height,
        lift=uniform(rng, 0.07, 0.15),
        bezel=bezel,
        chin=bezel + (uniform(rng, 0.01, 0.022) if chance(rng, 0.75) else uniform(rng, 0.03, 0.06)),
        curve=uniform(rng, 1.0, 1.8) if ratio > 2 and chance(rng, 0.7) else 0.0,
        tilt=uniform(rng, -2, 12),
        bulge=uniform(rng, 0.02, 0.05),
        foot=pick(rng, ("disc", "plate", "fork", "hoop")),
        color=color,
        stand=stand,
        bare=bare,
        show=pick(rng, (*screens.SHOWS,)),
        seed=seed(rng),
    )


_DARK: Color = (0.1, 0.1, 0.11)
_SILVER: Color = (0.74, 0.75, 0.77)
_HOUSINGS: tuple[tuple[Color, Color, bool], ...] = (
    (_DARK, _DARK, False),
    (_DARK, _SILVER, True),
    ((0.2, 0.21, 0.22), (0.2, 0.21, 0.22), False),
    (_SILVER, _SILVER, True),
    ((0.92, 0.92, 0.91), (0.92, 0.92, 0.91), False),
    ((0.92, 0.92, 0.91), _SILVER, True),
    ((0.75, 0.72, 0.64), (0.7, 0.67, 0.6), False),
    (_DARK, (0.5, 0.12, 0.13), False),
)


FAMILY = ZooFamily(
    random=monitor_random,
    home="table",
    classes={"": "household item"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
