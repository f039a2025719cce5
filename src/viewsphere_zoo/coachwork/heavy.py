"""The common parts of buses and lorries: axles with heavy wheels, mirrors on arms, and panels on their flat sides."""

from __future__ import annotations

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.coachwork.coats import Coats
from viewsphere_zoo.coachwork.hull import Hull
from viewsphere_zoo.coachwork.wheels import Wheel, tyre
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.panels import Surface, normals, raised
from viewsphere_zoo.shapes.rods import ring_of
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, grid, join, lathe, mirrored, moved, rounded_box, tube, turned

GAP = 0.05
"""Gap between the two tyres of a twin wheel, metres."""


Span = tuple[float, float]
"""Start and end, in a surface's parameters."""


def sides(part: str, material: Material, solid: Solid) -> list[Piece]:
    """A piece on the left and its mirror image on the right."""
    return [Piece(f"{part}_left", material, solid), Piece(f"{part}_right", material, mirrored(solid))]


def axle(name: str, y: float, outside: float, wheel: Wheel, twin: bool, coats: Coats) -> list[Piece]:
    """The wheels of one axle, their outer faces at x = outside; twin: two tyres a side, and dished discs."""
    x = outside - wheel.width / 2
    rubber = moved(tyre(wheel), (x, y, wheel.radius))
    if twin:
        rubber = join(rubber, moved(tyre(wheel), (x - wheel.width - GAP, y, wheel.radius)))
    disc, holes = _disc(wheel, twin)
    beam = tube([(0, y, wheel.radius), (x, y, wheel.radius)], 0.09, 10)
    pieces = sides(f"wheel_{name}_tyre", coats.rubber, rubber)
    pieces += sides(f"wheel_{name}_rim", coats.rims, moved(disc, (x, y, wheel.radius)))
    pieces += sides(f"wheel_{name}_rim", coats.under, moved(holes, (x, y, wheel.radius)))
    pieces = [Piece(_end_side(q.part), q.material, q.solid) for q in pieces]
    return [*pieces, Piece("underbody", coats.under, join(beam, mirrored(beam)))]


def _end_side(part: str) -> str:
    """wheel_front_tyre_left becomes wheel_front_left_tyre, as a car's wheels are named."""
    head, kind, side = part.rsplit("_", 2)
    return f"{head}_{side}_{kind}"


def _disc(w: Wheel, twin: bool) -> tuple[Solid, Solid]:
    """A steel disc with its hub and nuts, dished if twin, and the dark holes in it, about the x axis."""
    q, half = w.rim * w.radius, w.width / 2
    flat, hub = (-0.45, 0.25) if twin else (0.62, 1.0)
    rise = -0.75 if twin else 0.3
    profile = [(q + 0.004, 0.86), (q + 0.005, 0.96), (q - 0.014, 0.98), (q - 0.022, 0.86), (q - 0.035, rise), (0.82 * q, rise)]
    profile += [
        (0.62 * q, flat),
        (0.34 * q, flat),
        (0.32 * q, flat + 0.06),
        (0.29 * q, hub - 0.06),
        (0.25 * q, hub),
        (0.0, hub),
    ]
    nut = lathe(np.array([(0.017, 0.0), (0.017, 0.02), (0.01, 0.035), (0.0, 0.035)]), 6)
    nuts = ring_of(moved(nut, (0.46 * q, 0, flat * half)), 10)
    hole = turned(lathe(np.array([(0.034, -0.01), (0.034, 0.006), (0.0, 0.006)]), 10), 1, _tilt(q, half, flat, rise))
    middle = (0.72 * q, 0.0, half * (flat + rise) / 2)
    disc = join(lathe(np.array(profile) * (1, half), 32), nuts)
    return turned(disc, 1, np.pi / 2), turned(ring_of(moved(hole, middle), 8, 2, 0.2), 1, np.pi / 2)


def _tilt(q: float, half: float, flat: float, rise: float) -> float:
    """Return the slope of the cone with the holes, radians."""
    return float(np.arctan2((flat - rise) * half, 0.2 * q))


def roof(hull: Hull) -> Solid:
    """The deck of a hull closed over its whole length, both sides."""
    y = hull.top(hull.stations)[0][:, 1]
    spine = np.clip(np.maximum.accumulate(y), y[0], y[-1])
    return both_sides(hull.deck_to(np.stack([np.zeros_like(spine), spine], axis=1), 3))


def arm_mirror(root: Float, out: float, size: tuple[float, float], drop: float, coats: Coats, shell: Material) -> list[Piece]:
    """A mirror of this width and height on a bent arm, `out` beside its root and `drop` below it, on both sides."""
    x, y, z = root
    w, h = size
    middle = (x + out, y - 0.12, z - drop)
    case = moved(rounded_box((w, 0.1, h), 0.04, 2), middle)
    glass = moved(rounded_box((w - 0.04, 0.01, h - 0.05), 0.004, 1), np.add(middle, (0, 0.05, 0)))
    arm = tube([(x - 0.05, y + 0.03, z), (x + 0.5 * out, y - 0.1, z + 0.03), (x + out, y - 0.12, z - 0.02), middle], 0.022, 8)
    return [
        *sides("mirror", shell, case),
        *sides("mirror", coats.chrome, glass),
        *sides("mirror", coats.black, arm),
    ]


def written(text: Solid, hull: Hull, z: float, height: float, rear: bool = False) -> Solid:
    """Lettering laid on a hull's front or rear, with its middle at this z."""
    x, y, up = text.vertices.T
    u = hull.outline.u_at_x(-x if rear else x, rear)
    u = np.where(u < 0, u + 8, u) if rear else u
    at = hull.surface(u, z + up) + normals(hull.surface, u, z + up) * (height - y)[:, None]
    return Solid(at, text.triangles)


def rectangle(surface: Surface, u: Span, z: Span, height: float, rounding: float = 0.06) -> Solid:
    """A flat pane on a flank, between two u and two z, `height` above the flank."""
    return _pane(surface, u, z, height, rounding, 2)


def bent(surface: Surface, u: Span, z: Span, height: float, rounding: float = 0.08) -> Solid:
    """A pane that follows a curved front or rear and its corners."""
    line = np.linspace(*u, 9)
    wide = np.linalg.norm(np.diff(surface(line, np.full(9, sum(z) / 2)), axis=0), axis=1).sum()
    return _pane(surface, u, z, height, rounding, max(3, int(np.ceil(wide / 0.09))))


def _pane(surface: Surface, u: Span, z: Span, height: float, rounding: float, columns: int) -> Solid:
    """A closed plate over a lattice; rounding: radius of its corners, as a share of its shorter side."""
    ends = surface(np.array(u), np.full(2, sum(z) / 2))
    tall, wide = z[1] - z[0], max(float(np.linalg.norm(ends[1] - ends[0])), 1e-6)
    r = rounding * min(tall, wide)
    foot = r * np.array([0.0, 0.12, 0.4, 1.0])
    rise = np.concatenate([foot, np.linspace(foot[-1], tall - foot[-1], 5)[1:-1], tall - foot[::-1]])
    off = np.maximum(r - np.minimum(rise, tall - rise), 0.0)
    narrow = (r - np.sqrt(np.maximum(r**2 - off**2, 0.0))) / wide
    share = np.linspace(0, 1, columns + 1)[:, None]
    share = narrow + share * (1 - 2 * narrow)
    uv = np.stack([u[0] + share * (u[1] - u[0]), np.broadcast_to(z[0] + rise, share.shape)], axis=-1)
    top = raised(surface, uv, height)
    edge = np.concatenate([uv[:-1, 0], uv[-1, :-1], uv[:0:-1, -1], uv[0, :0:-1]])
    skirt = np.stack([raised(surface, edge, height), raised(surface, edge, -0.008)])
    return join(grid(top), grid(skirt, wrap=True))
