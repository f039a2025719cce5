"""Office chairs: five-star base on castors, gas lift, padded or mesh back."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.joinery.coats import CHROME, PLASTICS, RUBBER, STEEL, Cover, drawn_color, drawn_cover, plastic, shaded
from viewsphere_zoo.joinery.members import bar, bend, hoop, line, pipe, spindle
from viewsphere_zoo.joinery.slabs import box_outline, crowned, leaning, level, on, polygon, seam, slab
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color, linear
from viewsphere_zoo.shapes.panels import Surface, raised
from viewsphere_zoo.shapes.rods import ring_of
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, join, lathe, moved, rounded_box, tube, turned

Back = Literal["mesh", "padded", "executive"]
Arms = Literal["none", "t", "loop"]


@dataclass(frozen=True)
class Office:
    """Parameters of an office chair; lengths in metres.

    height: top of the back, without a headrest; base: radius of the five-star base at its castors; lean: run of the back
    to the rear per metre; bolsters: cushions one above the other in an executive's back; turn: of the base, radians;
    frame: colour of the plastics; bright: polished base and arms.
    """

    seat_width: float = 0.5
    seat_depth: float = 0.47
    seat_height: float = 0.47
    height: float = 1.0
    back: Back = "mesh"
    arms: Arms = "t"
    headrest: bool = False
    base: float = 0.3
    lean: float = 0.16
    bolsters: int = 3
    turn: float = 0.2
    frame: Color = (0.1, 0.1, 0.105)
    bright: bool = False
    cover: Cover = field(default_factory=Cover)

    @property
    def span(self) -> float:
        """Distance from the lower edge of the back to its upper edge, metres."""
        return self.height - self.seat_height - 0.03

    @property
    def surface(self) -> Surface:
        """The front of the back: v = 0 a little above the seat."""
        hollow = 0.55 if self.back == "mesh" else 0.3
        return leaning(self.seat_depth / 2 - 0.005, self.seat_height + 0.03, self.lean, hollow, 0.022, self.span + 0.03)

    @property
    def extent(self) -> tuple[float, float, float]:
        """Greatest width, depth and height of the whole model, metres."""
        return self.seat_width + 0.2, self.seat_depth + 0.23, self.height + 0.15


def pieces(p: Office) -> list[Piece]:
    """Return the pieces of an office chair; castors on z = 0."""
    frame = plastic("frame", p.frame)
    metal = CHROME if p.bright else frame
    back = {"mesh": _mesh_back, "padded": _padded_back, "executive": _executive_back}[p.back]
    return [
        *_base(p, metal),
        *_lift(p, frame),
        *_seat(p, frame),
        *back(p, frame),
        *_arms(p, frame, metal),
        *_headrest(p, frame),
    ]


def _base(p: Office, metal: Material) -> list[Piece]:
    """Hub, five arms, five castors."""
    share = np.linspace(0, 1, 9)
    path = np.column_stack([0.02 + share * (p.base - 0.012), np.zeros(9), 0.118 - 0.03 * share - 0.012 * share**2])
    size = np.stack([0.056 - 0.024 * share, 0.042 - 0.02 * share], axis=1)
    arm = bar(path, size, 0.01, (0, 1, 0))
    hub = lathe([(0, 0.085), (0.04, 0.086), (0.046, 0.092), (0.046, 0.135), (0.038, 0.145), (0, 0.146)], 36)
    star = join(ring_of(arm, 5, start=p.turn), hub)
    stem = spindle((p.base, 0, 0.03), (p.base, 0, 0.075), [(0, 0.006), (1, 0.006)], 12)
    castors = [_castor(p.base, p.turn + 1.7 * k + 0.4) for k in range(5)]
    spread = [turned(c, 2, p.turn + k * 2 * np.pi / 5) for k, (c, _) in enumerate(castors)]
    hoods = [turned(h, 2, p.turn + k * 2 * np.pi / 5) for k, (_, h) in enumerate(castors)]
    return [
        Piece("base", metal, star),
        Piece("castor", STEEL, ring_of(stem, 5, start=p.turn)),
        Piece("castor", RUBBER, join(*spread)),
        Piece("castor", plastic("castor_hood", (0.14, 0.14, 0.145)), join(*hoods)),
    ]


def _castor(at: float, swivel: float) -> tuple[Solid, Solid]:
    """Twin wheels and their hood, below (at, 0), trailing the stem."""
    r = 0.027
    edge = [(0, -0.0085), (r - 0.004, -0.0085), (r, -0.005), (r, 0.005), (r - 0.004, 0.0085), (0.4 * r, 0.0085), (0, 0.007)]
    wheel = moved(turned(lathe(edge, 24), 1, np.pi / 2), (0.0145, 0.012, r))
    a = np.linspace(-0.5, np.pi + 0.2, 12)
    arch = np.column_stack([np.zeros(12), 0.012 + (r + 0.003) * np.cos(a), r + (r + 0.003) * np.sin(a)])
    core = moved(rounded_box((0.012, 0.038, 0.038), 0.004, 2), (0, 0.012, 0.029))
    hood = join(bar(arch, (0.03, 0.004), 0.0018, (1, 0, 0), 2), core)
    return tuple(moved(turned(s, 2, swivel), (at, 0, 0)) for s in (both_sides(wheel), hood))  # pyright: ignore[reportReturnType]


def _lift(p: Office, frame: Material) -> list[Piece]:
    """Telescopic cover, piston and the mechanism under the seat."""
    top = p.seat_height - 0.11
    cover = [(0, 0.13), (0.034, 0.13), (0.034, 0.2), (0.031, 0.203), (0.031, 0.255), (0.028, 0.258), (0.028, 0.29), (0, 0.291)]
    piston = lathe([(0, 0.28), (0.0145, 0.28), (0.0145, top + 0.03), (0, top + 0.03)], 24)
    box = moved(rounded_box((0.16, 0.24, 0.05), 0.014, 3), (0, 0.02, top + 0.03))
    lever = pipe([(0.06, -0.02, top + 0.03), (0.2, -0.03, top + 0.028), (0.27, -0.03, top + 0.014)], 0.005, 0.04, 10)
    knob = spindle(
        (0.235, -0.03, top + 0.0225), (0.292, -0.03, top + 0.0085), [(0, 0.006), (0.2, 0.009), (0.8, 0.0105), (1, 0.007)], 14
    )
    return [
        Piece("gas_lift", frame, lathe(cover, 32)),
        Piece("gas_lift", CHROME, piston),
        Piece("mechanism", frame, box),
        Piece("lever", STEEL, lever),
        Piece("lever", frame, knob),
    ]


def _seat(p: Office, frame: Material) -> list[Piece]:
    """A cushion with a waterfall front edge in a plastic tray."""
    x, y = p.seat_width / 2, p.seat_depth / 2
    outline = polygon(
        [(-0.94 * x, -y), (0.94 * x, -y), (x, 0.1 * y), (0.88 * x, y), (-0.88 * x, y), (-x, 0.1 * y)], 0.085, 0.025
    )
    base = p.seat_height - 0.075

    def surface(u: Float, v: Float) -> Float:
        fall = 2.2 * np.clip(-v - 0.35 * y, 0, None) ** 2
        return np.stack([u, v, base - fall + 0.25 * u**2], axis=-1)

    top = crowned(outline, 0.062, 0.012)
    tray = slab(outline * 0.97, level(-0.012), level(0.01), 0.01, 6)
    return [
        Piece("seat", p.cover.material, on(surface, slab(outline, level(0.004), top, 0.028, 9, 5))),
        Piece("seat", p.cover.piping, on(surface, seam(outline, top, 0.028, 0.0035))),
        Piece("seat_tray", frame, on(surface, tray)),
    ]


def _outline(p: Office, width: float, taper: float) -> Float:
    """The back's outline in (u, v)."""
    span, x = p.span, width / 2
    return polygon(
        [(-0.9 * x, 0), (0.9 * x, 0), (x, 0.45 * span), (taper * x, span), (-taper * x, span), (-x, 0.45 * span)], 0.09, 0.02
    )


def _spine(p: Office, metal: Material, reach: float, depth: float = 0.028) -> Piece:
    """A bracket from the mechanism up behind the back, as far as this share of its height, `depth` behind its face."""
    low = p.seat_height - 0.085
    up = raised(p.surface, np.column_stack([np.zeros(3), np.linspace(0.08, reach * p.span, 3)]), np.full(3, -depth))
    knee = (0, float(up[0, 1]) + 0.012, low)
    path = np.vstack([[(0, 0.08, low), knee], up])
    return Piece("spine", metal, bar(bend(path, 0.06), (0.075, 0.016), 0.007, (1, 0, 0)))


def _mesh_back(p: Office, frame: Material) -> list[Piece]:
    """A frame strung with a net of cords, a lumbar rest behind it."""
    outline = _outline(p, p.seat_width * 0.94, 0.82)
    rim = hoop(raised(p.surface, outline, np.zeros(len(outline))), 0.0115, (0, -1, 0.1), 12)
    net = Material("mesh", linear(p.cover.color), roughness=0.8)
    cords = [cord for axis in (0, 1) for cord in _cords(p.surface, outline, axis)]
    u = np.linspace(-0.17, 0.17, 13)
    rest = raised(p.surface, np.column_stack([u, np.full(13, 0.16)]), np.full(13, -0.014))
    lumbar = bar(rest, (0.07, 0.012), 0.005, (0, 0, 1))
    reach = [_reach(p, outline, s) for s in (-1, 1)]
    return [
        Piece("back_frame", frame, rim),
        Piece("back_mesh", net, join(*cords)),
        Piece("lumbar", frame, lumbar),
        Piece("back_frame", frame, join(*reach)),
        _spine(p, frame, 0.66),
    ]


def _reach(p: Office, outline: Float, side: int) -> Solid:
    """A strut from the spine to the frame's side."""
    v = np.linspace(0.56, 0.88, 9) * p.span
    edge = float(np.interp(v[-1], *_right_edge(outline)))
    share = np.linspace(0, 1, 9)
    uv = np.column_stack([side * share * edge, v])
    return bar(raised(p.surface, uv, -0.03 + 0.03 * share**2), (0.034, 0.013), 0.005, (0, 0, 1))


def _right_edge(outline: Float) -> tuple[Float, Float]:
    """v and u of the outline's half at u > 0, v growing."""
    half = outline[outline[:, 0] > 0]
    half = half[np.argsort(half[:, 1], kind="stable")]
    return half[:, 1], half[:, 0]


def _cords(surface: Surface, outline: Float, axis: int, spacing: float = 0.0125) -> list[Solid]:
    """Cords of a net inside a convex outline that is symmetric in u: axis 0 runs upwards, 1 across."""
    v, u = _right_edge(outline)
    if axis == 1:
        rows = np.arange(v[0] + spacing, v[-1] - spacing / 2, spacing)
        ends = [((-float(np.interp(r, v, u)), r), (float(np.interp(r, v, u)), r)) for r in rows]
    else:
        columns = np.arange(-u.max() + spacing / 2, u.max(), spacing)
        inside = np.linspace(v[0], v[-1], 400)
        half = np.interp(inside, v, u)
        ends = [((c, inside[half > abs(c)][0]), (c, inside[half > abs(c)][-1])) for c in columns if (half > abs(c)).any()]
    cords = []
    for a, b in ends:
        uv = np.linspace(a, b, 13)
        if np.linalg.norm(uv[-1] - uv[0]) > spacing:
            cords.append(tube(raised(surface, uv, np.full(13, 0.001 * (2 * axis - 1))), 0.0017, 4))
    return cords


def _padded_back(p: Office, frame: Material) -> list[Piece]:
    """A cushion on a moulded shell."""
    outline = _outline(p, p.seat_width * 0.92, 0.8)
    top = crowned(outline, 0.03, 0.016)
    return [
        Piece("back_pad", p.cover.material, on(p.surface, slab(outline, level(-0.014), top, 0.022, 9, 5))),
        Piece("back_pad", p.cover.piping, on(p.surface, seam(outline, top, 0.022, 0.0035))),
        Piece(
            "back_shell",
            frame,
            on(p.surface, slab(outline * (0.96, 0.98) + (0, 0.006), level(-0.024), level(-0.008), 0.009, 7)),
        ),
        _spine(p, frame, 0.6),
    ]


def _executive_back(p: Office, frame: Material) -> list[Piece]:
    """Bolsters one above the other on a padded board."""
    x, span = 0.47 * p.seat_width, p.span
    whole = polygon(
        [(-0.92 * x, 0), (0.92 * x, 0), (x, 0.5 * span), (0.8 * x, span), (-0.8 * x, span), (-x, 0.5 * span)], 0.08, 0.025
    )
    found = [
        Piece("back_shell", p.cover.material, on(p.surface, slab(whole, crowned(whole, -0.03, -0.012), level(0.024), 0.026, 8)))
    ]
    v, u = _right_edge(whole)
    edges = np.linspace(0.012, span - 0.014, p.bolsters + 1)
    for low, high in pairwise(edges.tolist()):
        at = np.array([low + 0.003, (low + high) / 2, high - 0.003])
        half = np.interp(np.clip(at, 0.03, span - 0.03), v, u) - 0.016
        pad = polygon(
            [(-half[0], at[0]), (half[0], at[0]), (half[1], at[1]), (half[2], at[2]), (-half[2], at[2]), (-half[1], at[1])],
            0.035,
            0.02,
        )
        found.append(
            Piece("back_pad", p.cover.material, on(p.surface, slab(pad, level(0.0), crowned(pad, 0.05, 0.018), 0.03, 6, 5)))
        )
    return [*found, _spine(p, frame, 0.4, 0.042)]


def _arms(p: Office, frame: Material, metal: Material) -> list[Piece]:
    """T-shaped rests with soft pads, or bent loops."""
    if p.arms == "none":
        return []
    x, seat = p.seat_width / 2 + 0.035, p.seat_height
    under, top = seat - 0.084, seat + 0.2
    pad = moved(
        slab(box_outline(0.085, 0.25, 0.035), level(0), crowned(box_outline(0.085, 0.25, 0.035), 0.024, 0.004), 0.011, 5),
        (x, -0.02, top),
    )
    soft = plastic("arm_pad", shaded(p.frame, 0.8), 0.7)
    if p.arms == "t":
        stem = bar(bend([(0.1, 0.02, under), (x, 0.02, under), (x, 0.01, top - 0.05)], 0.06), (0.07, 0.016), 0.007, (0, 1, 0))
        sleeve = bar(line((x, 0.015, seat + 0.02), (x, 0.008, top + 0.004)), (0.052, 0.024), 0.009, (0, 1, 0))
        return [
            Piece("armrest", metal, both_sides(stem)),
            Piece("armrest", frame, both_sides(sleeve)),
            Piece("armrest_pad", soft, both_sides(pad)),
        ]
    loop = [
        (0.1, -0.1, under),
        (x, -0.12, under),
        (x, -0.16, top - 0.004),
        (x, 0.14, top - 0.004),
        (x, 0.1, under),
        (0.1, 0.08, under),
    ]
    ring = pipe(loop, 0.0125, 0.06, 14)
    return [Piece("armrest", metal, both_sides(ring)), Piece("armrest_pad", soft, both_sides(moved(pad, (0, 0, 0.002))))]


def _headrest(p: Office, frame: Material) -> list[Piece]:
    """A small pad above the back on two struts."""
    if not p.headrest:
        return []
    span = p.span + 0.03
    outline = box_outline(0.27, 0.13, 0.05, 0.02, (0, span + 0.06))
    path = raised(p.surface, np.array([(0.05, span - x) for x in (0.05, -0.02, -0.06)]), np.array([-0.014, -0.012, 0.0]))
    strut = bar(path, (0.022, 0.01), 0.004, (1, 0, 0))
    pad = slab(outline, level(-0.012), crowned(outline, 0.03, 0.012), 0.02, 7, 5)
    return [
        Piece("headrest", p.cover.material, on(p.surface, pad)),
        Piece("headrest", frame, both_sides(strut)),
    ]


def draw(rng: np.random.Generator) -> Office:
    """A random office chair."""
    back: Back = ("mesh", "padded", "executive")[int(rng.choice(3, p=(0.4, 0.35, 0.25)))]
    cover = drawn_cover(rng, {"mesh": 0.0, "padded": 0.15, "executive": 0.85}[back])
    light = back != "executive" and rng.random() < 0.25
    seat = float(rng.uniform(0.44, 0.52))
    tall = {"mesh": (0.46, 0.58), "padded": (0.4, 0.55), "executive": (0.6, 0.72)}[back]
    return Office(
        seat_width=float(rng.uniform(0.46, 0.53)),
        seat_depth=float(rng.uniform(0.44, 0.5)),
        seat_height=seat,
        height=seat + float(rng.uniform(*tall)),
        back=back,
        arms=("t", "loop", "none")[int(rng.choice(3, p=(0.5, 0.3, 0.2)))],
        headrest=back == "mesh" and bool(rng.random() < 0.4),
        base=float(rng.uniform(0.27, 0.33)),
        lean=float(rng.uniform(0.1, 0.22)),
        bolsters=int(rng.integers(2, 5)),
        turn=float(rng.uniform(0, 2 * np.pi / 5)),
        frame=PLASTICS[0] if light else drawn_color(((0.1, 0.1, 0.105), (0.27, 0.28, 0.3)), rng),
        bright=bool(rng.random() < 0.4),
        cover=cover,
    )
