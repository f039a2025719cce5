"""Hair driers: the pistol grip with a round barrel, and the open ring on a stick."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import At
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, Finish, coated, linear, metal
from viewsphere_zoo.shapes.solids import (
    Float,
    Solid,
    both_sides,
    curve,
    join,
    lathe,
    loft,
    moved,
    rounded_box,
    superellipse,
    tube,
    turned,
)

KEYPOINTS = {
    "nozzle": At("nozzle", (0, -1, 0)),
    "inlet": At("grille", (0, 1, 0)),
    "switch": At("switch"),
    "handle": At("handle", (0, 0, -1)),
}
SKELETON = (
    ("nozzle", "inlet"),
    ("inlet", "handle"),
)

Style = Literal["pistol", "ring"]
Nozzle = Literal["concentrator", "diffuser", "plain"]


@dataclass(frozen=True)
class HairDrier:
    """Parameters of a hair drier; lengths in metres, angles in degrees, colours sRGB 0..1.

    length: from the rear of the barrel to the nozzle's mouth; height: from the barrel's top to the end of the handle, cable
    left out; outlet: radius of the barrel's mouth as a fraction of its largest; bulge: where along the barrel it is
    widest, 0 rear to 1 mouth; handle_tilt: positive leads the handle's end to the rear; bands: chrome rings around the barrel.
    """

    style: Style = "pistol"
    nozzle: Nozzle = "concentrator"
    length: float = 0.25
    height: float = 0.24
    barrel_diameter: float = 0.09
    outlet: float = 0.62
    bulge: float = 0.3
    handle_tilt: float = 8.0
    handle_width: float = 0.036
    handle_depth: float = 0.044
    folding: bool = False
    two_tone: bool = False
    bands: int = 1
    cable: float = 0.05
    color: Color = (0.08, 0.08, 0.09)
    accent: Color = (0.75, 0.1, 0.3)
    trim: Color = (0.05, 0.05, 0.055)
    finish: Finish = "gloss"


@dataclass(frozen=True)
class _Coats:
    """The materials of one drier."""

    body: Material
    accent: Material
    trim: Material
    chrome: Material
    dark: Material
    glow: Material


def hair_drier(parameters: HairDrier | None = None) -> Mesh:
    """The drier in metres: mouth towards -Y, handle down, lowest point at z = 0, barrel centred in x and y.

    Parts: body, handle, nozzle, grille, outlet, switch, cable, strain_relief; hinge if folding, band if there are bands.
    """
    p = parameters or HairDrier()
    coats = _Coats(
        body=coated("shell", p.color, p.finish),
        accent=coated("accent", p.accent, p.finish),
        trim=coated("trim", p.trim, "matte"),
        chrome=metal("chrome", (0.78, 0.78, 0.8)),
        dark=Material("inside", linear((0.07, 0.07, 0.075)), roughness=0.9),
        glow=metal("coil", (0.72, 0.5, 0.36), 0.4),
    )
    pieces = [*(_pistol_head(p, coats) if p.style == "pistol" else _ring_head(p, coats)), *_handle(p, coats)]
    lowest = min(float(piece.solid.vertices[:, 2].min()) for piece in pieces)
    return assemble([Piece(q.part, q.material, moved(q.solid, (0, 0, -lowest))) for q in pieces], crease_deg=38)


def hair_drier_random(rng: np.random.Generator) -> Mesh:
    """A drier with parameters drawn to resemble driers in shops."""
    style: Style = "ring" if rng.random() < 0.22 else "pistol"
    ring = style == "ring"
    nozzle: Nozzle = ("concentrator", "diffuser", "plain")[int(rng.choice(3, p=(0.5, 0.22, 0.28)))]
    color, accent, trim = _PALETTE[int(rng.integers(len(_PALETTE)))]
    shade = float(rng.uniform(0.88, 1.0))
    return hair_drier(
        HairDrier(
            style=style,
            nozzle=nozzle,
            length=float(rng.uniform(0.12, 0.16) if ring else rng.uniform(0.2, 0.29)),
            height=float(rng.uniform(0.215, 0.26) if ring else rng.uniform(0.2, 0.265)),
            barrel_diameter=float(rng.uniform(0.078, 0.09) if ring else rng.uniform(0.076, 0.105)),
            outlet=float(rng.uniform(0.52, 0.78)),
            bulge=float(rng.uniform(0.12, 0.5)),
            handle_tilt=float(rng.uniform(-1, 1) if ring else rng.uniform(-4, 16)),
            handle_width=float(rng.uniform(0.036, 0.041) if ring else rng.uniform(0.034, 0.044)),
            handle_depth=float(rng.uniform(0.036, 0.041) if ring else rng.uniform(0.04, 0.054)),
            folding=bool(rng.random() < 0.35) and not ring,
            two_tone=bool(rng.random() < 0.4),
            bands=int(rng.integers(0, 3)),
            cable=float(rng.uniform(0.035, 0.06)),
            color=(color[0] * shade, color[1] * shade, color[2] * shade),
            accent=accent,
            trim=trim,
            finish=("gloss", "matte", "metal")[int(rng.choice(3, p=(0.5, 0.25, 0.25)))],
        )
    )


_BLACK: Color = (0.1, 0.1, 0.11)
_PALETTE: tuple[tuple[Color, Color, Color], ...] = (
    (_BLACK, (0.78, 0.62, 0.35), (0.04, 0.04, 0.045)),
    ((0.93, 0.92, 0.9), (0.8, 0.55, 0.45), (0.45, 0.45, 0.47)),
    ((0.82, 0.1, 0.14), (0.15, 0.15, 0.16), _BLACK),
    ((0.94, 0.5, 0.66), (0.97, 0.93, 0.93), (0.4, 0.3, 0.36)),
    ((0.42, 0.25, 0.62), (0.85, 0.83, 0.9), _BLACK),
    ((0.12, 0.35, 0.72), (0.85, 0.87, 0.9), _BLACK),
    ((0.2, 0.68, 0.66), (0.96, 0.95, 0.9), (0.25, 0.3, 0.3)),
    ((0.62, 0.63, 0.66), (0.85, 0.15, 0.5), _BLACK),
    ((0.32, 0.33, 0.36), (0.88, 0.12, 0.5), _BLACK),
    ((0.95, 0.72, 0.18), (0.2, 0.2, 0.22), _BLACK),
    ((0.85, 0.62, 0.54), (0.98, 0.95, 0.92), (0.35, 0.27, 0.25)),
    ((0.56, 0.76, 0.45), (0.95, 0.95, 0.92), (0.3, 0.33, 0.28)),
    ((0.5, 0.06, 0.2), (0.8, 0.68, 0.45), _BLACK),
    ((0.1, 0.16, 0.32), (0.82, 0.5, 0.32), _BLACK),
    ((0.95, 0.42, 0.16), (0.95, 0.95, 0.95), (0.2, 0.2, 0.22)),
)


def _forward(solid: Solid, p: HairDrier) -> Solid:
    """The solid moved from +z, rear at z = 0, to the barrel's place: axis along -Y at z = 0, rear at y = length / 2."""
    return moved(turned(solid, 0, np.pi / 2), (0, p.length / 2, 0))


def _radius(p: HairDrier) -> float:
    return p.barrel_diameter / 2


def _nozzle_length(p: HairDrier) -> float:
    return p.length * {"concentrator": 0.24, "diffuser": 0.2, "plain": 0.07}[p.nozzle]


def _pistol_head(p: HairDrier, coats: _Coats) -> list[Piece]:
    """Barrel, rear grille, mouth and nozzle of the classic drier."""
    r, mouth = _radius(p), _radius(p) * p.outlet
    end = p.length - _nozzle_length(p)
    widest = end * p.bulge
    split = end * 0.36

    def outer(h: Float) -> Float:
        return curve(h, [(0, 0.8 * r), (0.25 * widest, 0.93 * r), (widest, r), (0.8 * end, 1.04 * mouth), (end, mouth)])

    def shell(start: float, stop: float) -> Float:
        h = np.linspace(start, stop, 14)
        return np.stack([outer(h), h], axis=1)

    lip = np.array([(mouth - 0.003, end + 0.0015), (mouth - 0.005, end), (mouth - 0.005, end - 0.045)])
    rim = np.array([(0.7 * r, 0.004), (0.72 * r, 0.0), (0.76 * r, 0.0)])
    rear = np.concatenate([rim, shell(0.003, split)])
    front = np.concatenate([shell(split, end), lip])
    place = [
        Piece("body", coats.accent if p.two_tone else coats.body, lathe(rear, 48)),
        Piece("body", coats.body, lathe(front, 48)),
        *_rear_grille(0.72 * r, coats),
        *_mouth(mouth - 0.005, end - 0.035, coats),
        *_nozzle(p, mouth, end, coats),
    ]
    for k in range(p.bands):
        h = split + (0.012 * k if p.two_tone else end * 0.35 + 0.012 * k)
        at = float(outer(np.array([h]))[0])
        bead = [(at - 0.002, h - 0.0035), (at + 0.0012, h - 0.002), (at + 0.0012, h + 0.002), (at - 0.002, h + 0.0035)]
        place.append(Piece("band", coats.chrome, lathe(bead, 48)))
    return [Piece(q.part, q.material, _forward(q.solid, p)) for q in place]


def _disc(radius: float, at: float, faces_front: bool) -> Solid:
    """A flat disc across the barrel's axis."""
    profile = [(radius, at), (radius / 2, at), (0.0, at)]
    return lathe(profile if faces_front else profile[::-1], 40)


def _rear_grille(radius: float, coats: _Coats) -> list[Piece]:
    """Rings and bars in front of a dark disc."""
    solids = [_bead(radius * f, 0.003, 0.0016, 40) for f in (0.3, 0.5, 0.7, 0.88)]
    bar = moved(rounded_box((radius * 0.76, 0.0026, 0.003), 0.001, 1), (radius * 0.6, 0, 0.004))
    solids += [turned(bar, 2, k * np.pi / 3) for k in range(6)]
    hub = lathe([(0, -0.002), (0.18 * radius, -0.0015), (0.23 * radius, 0.001), (0.24 * radius, 0.008)], 24)
    return [
        Piece("grille", coats.dark, _disc(radius * 1.05, 0.008, False)),
        Piece("grille", coats.trim, join(*solids)),
        Piece("grille", coats.chrome, hub),
    ]


def _bead(radius: float, at: float, thickness: float, segments: int) -> Solid:
    """A thin torus about the barrel's axis."""
    a = np.linspace(0, 2 * np.pi, 7)
    return lathe(np.stack([radius + thickness * np.cos(a), at + thickness * np.sin(a)], axis=1), segments)


def _mouth(radius: float, at: float, coats: _Coats) -> list[Piece]:
    """The heater behind its protecting bars."""
    bars = [rounded_box((2 * radius, 0.002, 0.003), 0.0008, 1), rounded_box((0.002, 2 * radius, 0.003), 0.0008, 1)]
    coils = [_bead(radius * f, at + 0.008, 0.0014, 32) for f in (0.35, 0.6, 0.85)]
    return [
        Piece("outlet", coats.dark, _disc(radius * 1.05, at, True)),
        Piece("outlet", coats.glow, join(*coils)),
        Piece("outlet", coats.trim, join(*(moved(b, (0, 0, at + 0.014)) for b in bars))),
    ]


def _nozzle(p: HairDrier, mouth: float, end: float, coats: _Coats) -> list[Piece]:
    """The nozzle on the barrel's mouth, up to z = length."""
    if p.nozzle == "plain":
        ring = [(mouth + 0.002, end - 0.02), (mouth + 0.0035, end - 0.018), (mouth + 0.0025, p.length)]
        ring += [(mouth - 0.002, p.length), (mouth - 0.003, end - 0.02), (mouth + 0.002, end - 0.02)]
        return [Piece("nozzle", coats.accent, lathe(ring, 48))]
    if p.nozzle == "diffuser":
        return _diffuser(p, mouth, end, coats)
    outer = _slot_rings(mouth, end, p.length, 0.0)
    inner = _slot_rings(mouth, end, p.length, 0.002)
    skin = loft(np.concatenate([inner[:1], outer, inner[::-1]]), (False, False))
    return [Piece("nozzle", coats.trim, skin)]


def _slot_rings(mouth: float, end: float, tip: float, wall: float) -> Float:
    """Rings from the round mouth to a wide flat slot, (13, 48, 3), each smaller by `wall` all around."""
    rings: list[Float] = []
    for f in np.linspace(0, 1, 13):
        width = float(curve(f, [(0, mouth + 0.003), (0.25, mouth + 0.003), (1, max(mouth * 1.3, 0.036))])) - wall
        thick = float(curve(f, [(0, mouth + 0.003), (0.25, mouth + 0.001), (0.85, 0.0085), (1, 0.0075)])) - wall
        ring = superellipse(width, thick, 2 + 3 * f * f, 48)
        rings.append(np.column_stack([ring, np.full(48, end - 0.015 + f * (tip - end + 0.015))]))
    return np.array(rings)


def _diffuser(p: HairDrier, mouth: float, end: float, coats: _Coats) -> list[Piece]:
    """A wide bowl with blunt fingers on its floor."""
    wide, tip = max(1.25 * _radius(p), 0.058), p.length
    floor = end + 0.45 * (tip - end)
    bowl = [
        (mouth - 0.003, end - 0.02),
        (mouth + 0.002, end - 0.02),
        (mouth + 0.003, end),
        (0.7 * wide, end + 0.3 * (tip - end)),
        (0.94 * wide, floor),
    ]
    bowl += [(wide, tip - 0.003), (wide - 0.001, tip), (wide - 0.003, tip - 0.001), (0.9 * wide, floor + 0.004), (0, floor)]
    finger = lathe([(0.0052, 0), (0.0042, 0.6), (0.0036, 0.9), (0.002, 1.0), (0, 1.02)], 10)
    scale = (1, 1, 0.9 * (tip - floor))
    finger = Solid(finger.vertices * scale, finger.triangles)
    rings = ((0.3, 5), (0.62, 10))
    spots = [(f * wide, 2 * np.pi * k / n) for f, n in rings for k in range(n)]
    fingers = [moved(finger, (r * np.cos(a), r * np.sin(a), floor)) for r, a in spots]
    holes = [(f * wide, 2 * np.pi * (k + 0.5) / n) for f, n in rings for k in range(n)]
    hole = lathe([(0.0045, 0), (0.0045, 0.0006), (0, 0.0006)], 12)
    vents = [moved(hole, (r * np.cos(a), r * np.sin(a), floor + 0.0045 * max(0, r / wide - 0.05))) for r, a in holes]
    return [
        Piece("nozzle", coats.trim, lathe(bowl, 56)),
        Piece("nozzle", coats.accent, join(*fingers)),
        Piece("nozzle", coats.dark, join(*vents)),
    ]


def _ring_head(p: HairDrier, coats: _Coats) -> list[Piece]:
    """A thick tube, open from end to end, with a bright rim; the nozzle sits on its front."""
    r, hole = _radius(p), 0.5 * _radius(p)
    end = p.length - _nozzle_length(p)
    turn = np.linspace(0, np.pi / 2, 5)
    round_ = 0.012
    rear = np.stack([r - round_ + round_ * np.sin(turn), round_ - round_ * np.cos(turn)], axis=1)
    front = np.stack([r - round_ + round_ * np.cos(turn), end - round_ + round_ * np.sin(turn)], axis=1)
    outside = np.concatenate([[(hole + 0.008, 0.0)], rear, front, [(hole + 0.011, end)]])
    inside = [(hole + 0.011, end), (hole + 0.006, end - 0.006), (hole, end * 0.6), (hole, end * 0.3), (hole + 0.008, 0.0)]
    slot = _bead(hole + 0.0115, end, 0.0022, 48)
    place = [
        Piece("body", coats.body, lathe(outside, 56)),
        Piece("outlet", coats.accent, lathe(inside, 56)),
        Piece("band", coats.chrome, slot),
        *_nozzle(p, hole + 0.011, end, coats),
        Piece("grille", coats.trim, _bead(hole + 0.008, 0.0, 0.0018, 48)),
    ]
    return [Piece(q.part, q.material, _forward(q.solid, p)) for q in place]


def _handle(p: HairDrier, coats: _Coats) -> list[Piece]:
    """Grip, switches, hinge, strain relief and cable."""
    r, ring = _radius(p), p.style == "ring"
    top, bottom = -0.55 * r, r - p.height
    head = p.length - _nozzle_length(p)
    start = p.length / 2 - head * (0.5 if ring else 0.36)
    slant = np.tan(np.radians(p.handle_tilt))

    def center(z: Float) -> Float:
        return start + slant * (-z) * (1 if not ring else 0.3)

    flare = [(0, 0.62), (0.015, 0.86), (0.05, 0.97), (0.3, 0.94), (0.55, 1.0), (0.8, 1.0), (0.92, 1.2), (1, 1.5)]
    if ring:
        flare = [(0, 0.9), (0.01, 0.97), (0.03, 1), (0.5, 1), (0.97, 1), (1, 1)]
    f = np.concatenate([np.linspace(0, 0.05, 6)[:-1], np.linspace(0.05, 1, 26)])
    z = bottom + f * (top - bottom)
    size = curve(f, flare)
    swell = np.ones_like(f) if ring else 1 + 0.22 * np.clip((f - 0.85) / 0.15, 0, 1) ** 2
    section = superellipse(1.0, 1.0, 2.0 if ring else 2.5, 36)
    half = np.stack([p.handle_width / 2 * size / swell, p.handle_depth / 2 * size * swell], axis=1)
    rings = np.empty((len(f), 36, 3))
    rings[..., :2] = section * half[:, None] + np.stack([np.zeros_like(z), center(z)], axis=1)[:, None]
    rings[..., 2] = z[:, None]
    pieces = [Piece("handle", coats.body, loft(rings, (True, False)))]
    pieces += _switches(p, coats, bottom, top, center)
    if ring:
        pieces += _foot_filter(p, coats, bottom, float(center(np.array(bottom))))
    if p.folding:
        pieces += _hinge(p, coats, float(center(np.array(top))), -1.02 * r)
    return pieces + _cable(p, coats, bottom, float(center(np.array(bottom))))


def _switches(p: HairDrier, coats: _Coats, bottom: float, top: float, center: Callable[[Float], Float]) -> list[Piece]:
    """Two sliders on the front of the grip and a button above them (on the ring: round buttons and a slider behind)."""
    span = top - bottom
    rear = p.style == "ring"

    def on_grip(height: float, solid: Solid, back: bool = rear) -> Solid:
        z = bottom + height * span
        y = float(center(np.array(z))) + p.handle_depth / 2 * (0.99 if back else -0.97)
        return moved(turned(solid, 0, np.radians(p.handle_tilt)), (0, y, z))

    wide = 0.42 * p.handle_width
    plate = rounded_box((0.6 * p.handle_width, 0.004, 0.36 * span), 0.0019, 2)
    slider = rounded_box((wide, 0.008, 0.022), 0.0025, 2)
    ribs = [moved(rounded_box((wide * 0.9, 0.002, 0.0014), 0.0006, 1), (0, -0.0042, k * 0.0035)) for k in (-1, 0, 1)]
    knob = join(moved(slider, (0, -0.001, 0)), *(moved(s, (0, -0.001, 0)) for s in ribs))
    button = turned(lathe([(0, -0.005), (0.0045, -0.0048), (0.0056, -0.003), (0.0056, 0.004)], 20), 0, -np.pi / 2)
    turn = turned(knob, 2, np.pi) if rear else knob
    push = turned(button, 2, np.pi) if rear else button
    return [
        Piece("switch", coats.trim, on_grip(0.64, plate)),
        Piece("switch", coats.accent, join(on_grip(0.73, turn), on_grip(0.57, turn))),
        Piece("switch", coats.chrome, on_grip(0.88 if rear else 0.4, push)),
    ]


def _foot_filter(p: HairDrier, coats: _Coats, bottom: float, y: float) -> list[Piece]:
    """The air intake around the lower end of the ring drier's handle: a sleeve of small slots."""
    a, b = p.handle_width / 2 + 0.0012, p.handle_depth / 2 + 0.0012
    heights = bottom + np.array([0.006, 0.008, 0.046, 0.048])
    grow = np.array([-0.0015, 0, 0, -0.0015])
    rings = np.array(
        [np.column_stack([superellipse(a + g, b + g, 2, 36), np.full(36, h)]) for g, h in zip(grow, heights, strict=True)]
    )
    slot = rounded_box((0.0016, 0.002, 0.005), 0.0007, 1)
    angles = np.arange(24) * 2 * np.pi / 24
    slots = [
        moved(turned(slot, 2, t + np.pi / 2), (a * np.cos(t), b * np.sin(t), bottom + h))
        for h in (0.014, 0.0225, 0.031, 0.0395)
        for t in angles
    ]
    return [
        Piece("grille", coats.accent, moved(loft(rings), (0, y, 0))),
        Piece("grille", coats.dark, moved(join(*slots), (0, y, 0))),
    ]


def _hinge(p: HairDrier, coats: _Coats, y: float, z: float) -> list[Piece]:
    """The knuckle that a folding handle turns on."""
    r, half = 0.55 * p.handle_depth, 0.56 * p.handle_width
    edge = [(0, -half), (r - 0.002, -half), (r, -half + 0.002), (r, half - 0.002), (r - 0.002, half), (0, half)]
    cap = [(0.62 * r, half - 0.001), (0.62 * r, half + 0.001), (0.55 * r, half + 0.002), (0, half + 0.0022)]
    knuckle, screw = turned(lathe(edge, 32), 1, np.pi / 2), turned(lathe(cap, 24), 1, np.pi / 2)
    at = (0, y, z)
    return [
        Piece("hinge", coats.trim, moved(knuckle, at)),
        Piece("hinge", coats.accent, moved(both_sides(screw), at)),
    ]


def _cable(p: HairDrier, coats: _Coats, bottom: float, y: float) -> list[Piece]:
    """A ribbed sleeve and the beginning of the cable, which hangs in a bow towards the rear."""
    h = np.linspace(0, 1, 19)
    r = 0.0065 - 0.0025 * h + 0.0007 * (np.arange(19) % 3 == 1)
    sleeve = lathe(np.column_stack([np.append(r[::-1], 0.0055), np.append(bottom - 0.03 * h[::-1], bottom + 0.004)]), 16)
    t = np.linspace(0, 1, 16)
    drop = 0.026 + p.cable * np.sin(t * np.pi * 0.5)
    path = np.stack([0.012 * np.sin(3 * t), y + 0.55 * p.cable * t**2, bottom - drop], axis=1)
    return [
        Piece("strain_relief", coats.trim, moved(sleeve, (0, y, 0))),
        Piece("cable", coats.trim, tube(path, 0.0033, 10)),
    ]


FAMILY = ZooFamily(
    random=hair_drier_random,
    home="table",
    classes={"": "household item"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
)
