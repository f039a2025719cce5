"""Traffic lights: on a post, on an arm over the road, with heads for people on foot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import At
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, coated, linear, metal
from viewsphere_zoo.shapes.rods import rod
from viewsphere_zoo.shapes.sheets import sheet
from viewsphere_zoo.shapes.solids import Solid, join, lathe, moved, rounded_box, tube, turned
from viewsphere_zoo.townscape.surfaces import cuboid

KEYPOINTS = {
    "red": At("lamp_red", (0, -1, 0)),
    "amber": At("lamp_amber", (0, -1, 0)),
    "green": At("lamp_green", (0, -1, 0)),
    "foot": At("base", (0, 0, -1)),
    "pedestrian": At("pedestrian_stop"),
}
SKELETON = (("red", "amber"), ("amber", "green"), ("green", "foot"))

Style = Literal["post", "cantilever", "pedestrian"]
Lit = Literal["red", "amber", "green"]

_ORDER: tuple[Lit, ...] = ("red", "amber", "green")
_BRIGHT: dict[Lit, Color] = {"red": (1.0, 0.1, 0.07), "amber": (1.0, 0.62, 0.05), "green": (0.1, 0.95, 0.5)}
_DARK: dict[Lit, Color] = {"red": (0.3, 0.06, 0.06), "amber": (0.32, 0.2, 0.05), "green": (0.05, 0.24, 0.16)}


@dataclass(frozen=True)
class TrafficLight:
    """Parameters of a traffic light; metres, colours sRGB 0..1.

    height: of the post; lens: diameter of a lamp; lit: the lamp that shines; sides: number of heads on the post, the first
    towards -Y, two back to back, more a quarter turn apart; arm: how far a cantilever reaches (towards +X if positive); heads:
    on that arm; border: width of a backplate around the heads, 0 for none; hood: length of the lamps' roofs; striped: bands
    around the post; button: whether it has a button for people who want to cross.
    """

    style: Style = "post"
    height: float = 3.4
    lens: float = 0.21
    lit: Lit = "red"
    sides: int = 1
    arm: float = 4.5
    heads: int = 1
    border: float = 0.0
    hood: float = 0.2
    radius: float = 0.06
    button: bool = True
    striped: bool = False
    color: Color = (0.07, 0.08, 0.08)
    post_color: Color = (0.5, 0.51, 0.52)


def traffic_light(parameters: TrafficLight | None = None) -> Mesh:
    """The traffic light in metres, its post on the z axis, its first head facing -Y.

    Parts: base, post, housing, visor, lamp_red, lamp_amber, lamp_green (of the first head; other heads' end in _2, _3 ...), and
    by style arm, backplate, pedestrian_housing, pedestrian_stop, pedestrian_go, button, stripe.
    """
    p = parameters or TrafficLight()
    paint = coated("housing", p.color, "matte")
    post = metal("post", p.post_color, 0.5) if sum(p.post_color) > 1.2 else coated("post", p.post_color, "matte")
    head = _head(p, paint)
    pieces = _post(p, post)
    z = min(p.height - 0.62 * _tall(p), 3.3 if p.style == "cantilever" else 9.0)
    out = p.radius + 0.13 + 0.3 * p.lens
    places = [(angle, (0.0, -out, z)) for angle in _facing(p.sides)]
    found = 0
    if p.style == "cantilever":
        span = np.linspace(0.55, 0.96, p.heads) if p.heads > 1 else [0.96]
        for share in span[::-1]:
            found += 1
            pieces += _numbered([_at(q, 0.0, (share * p.arm, -0.16, p.height - 0.32)) for q in head], found)
    for angle, at in places:
        found += 1
        pieces += _numbered([_turn(_at(q, 0.0, at), angle) for q in head], found)
        pieces.append(Piece("post", post, _turned(_brackets(p, at), angle)))
    if p.style == "pedestrian":
        for angle in (np.pi / 2, -np.pi / 2):
            pieces += [_turn(q, angle) for q in _walker(p, paint)]
    if p.button:
        pieces += _button(p)
    return assemble(pieces, crease_deg=38)


def _facing(sides: int) -> list[float]:
    """Turns of the heads on the post, radians: two stand back to back, more a quarter turn apart."""
    return [k * (np.pi if sides == 2 else np.pi / 2) for k in range(sides)]


def _tall(p: TrafficLight) -> float:
    """Height of a head."""
    return 3 * 1.32 * p.lens + 0.05


def _at(q: Piece, angle: float, place: tuple[float, float, float]) -> Piece:
    return Piece(q.part, q.material, moved(_turned(q.solid, angle), place))


def _turn(q: Piece, angle: float) -> Piece:
    return Piece(q.part, q.material, _turned(q.solid, angle))


def _turned(solid: Solid, angle: float) -> Solid:
    return turned(solid, 2, angle)


def _numbered(pieces: list[Piece], number: int) -> list[Piece]:
    """The lamps of heads after the first have their number in their names."""
    return [
        Piece(f"{q.part}_{number}" if number > 1 and q.part.startswith("lamp") else q.part, q.material, q.solid) for q in pieces
    ]


def _head(p: TrafficLight, paint: Material) -> list[Piece]:
    """Three lamps in a housing, about its middle, facing -Y."""
    d, tall = p.lens, _tall(p)
    wide, deep, pitch = 1.32 * d + 0.03, 0.75 * d, 1.32 * d
    pieces = [Piece("housing", paint, rounded_box((wide, deep, tall), 0.035, 3))]
    visors: list[Solid] = []
    face = -deep / 2
    for k, name in enumerate(_ORDER):
        z = (1 - k) * pitch
        dome = lathe([(d / 2, -0.01), (d / 2, 0.004), (0.36 * d, 0.03), (0.2 * d, 0.042), (0, 0.046)], 18)
        pieces.append(Piece(f"lamp_{name}", _lens(name, name == p.lit), moved(turned(dome, 0, np.pi / 2), (0, face, z))))
        ring = lathe([(0.6 * d, -0.01), (0.6 * d, 0.02), (0.5 * d, 0.022), (0.49 * d, -0.005)], 18)
        visors += [moved(turned(ring, 0, np.pi / 2), (0, face, z)), moved(_hood(0.565 * d, p.hood), (0, face, z))]
    pieces.append(Piece("visor", paint, join(*visors)))
    if p.border:
        x, z, y = wide / 2 + p.border, tall / 2 + p.border, deep / 2 - 0.04
        plate = moved(rounded_box((2 * x, 0.02, 2 * z), 0.008, 1), (0, y, 0))
        bars = [cuboid((-x, y - 0.014, s * z - 0.018), (x, y - 0.006, s * z + 0.018)) for s in (-1, 1)]
        bars += [cuboid((s * x - 0.018, y - 0.014, -z), (s * x + 0.018, y - 0.006, z)) for s in (-1, 1)]
        white = Material("border", linear((0.93, 0.93, 0.91)), roughness=0.5)
        pieces += [Piece("backplate", paint, plate), Piece("backplate", white, join(*bars))]
    return pieces


def _lens(name: Lit, on: bool) -> Material:
    """A lens, shining or dark."""
    if not on:
        return Material(f"lens_{name}", linear(_DARK[name]), roughness=0.15, clearcoat=1.0)
    r, g, b, _ = linear(_BRIGHT[name])
    return Material(f"lens_{name}_lit", linear(_BRIGHT[name]), roughness=0.2, emissive=(1.6 * r, 1.6 * g, 1.6 * b))


def _hood(radius: float, length: float) -> Solid:
    """A roof over a lamp, open below."""
    a = np.radians(np.linspace(-35, 215, 15))
    reach = length * np.array([0.0, 0.5, 1.0])
    share = 0.35 + 0.65 * np.clip((np.sin(a) + 0.6) / 1.6, 0, 1)
    points = np.empty((15, 3, 3))
    points[..., 0] = radius * np.cos(a)[:, None]
    points[..., 1] = -reach * share[:, None]
    points[..., 2] = radius * np.sin(a)[:, None] - 0.12 * reach
    return sheet(points, 0.008)


def _post(p: TrafficLight, post: Material) -> list[Piece]:
    """Foot, post, and a cantilever's arm."""
    r = p.radius
    foot = [(0, 0), (2.4 * r, 0), (2.4 * r, 0.025), (1.5 * r, 0.035), (1.5 * r, 0.5), (1.02 * r, 0.56), (r, 0.56)]
    shaft = [(r, 0.5), (0.8 * r if p.style == "cantilever" else r, p.height), (0.5 * r, p.height + 0.02), (0, p.height + 0.02)]
    door = moved(rounded_box((0.12, 0.02, 0.26), 0.006, 1), (0, -1.45 * r, 0.28))
    pieces = [Piece("base", post, join(lathe(foot, 18), door)), Piece("post", post, lathe(shaft, 18))]
    if p.striped:
        for k, z in enumerate((0.75, 1.0, 1.25, 1.5)):
            tone: Color = (0.93, 0.93, 0.91) if k % 2 == 0 else (0.08, 0.08, 0.08)
            band = lathe([(1.01 * r, z), (1.05 * r, z), (1.05 * r, z + 0.25), (1.01 * r, z + 0.25)], 18)
            pieces.append(Piece("stripe", Material(f"stripe_{k % 2}", linear(tone), roughness=0.5), band))
    if p.style == "cantilever":
        z = p.height - 0.3
        path = [(0, 0, z - 0.25), (0.12 * p.arm, 0, z + 0.05), (0.3 * p.arm, 0, z + 0.16), (p.arm, 0, z + 0.22)]
        pieces.append(Piece("arm", post, tube(path, (0.8 * r, 0.75 * r, 0.65 * r, 0.4 * r), 12)))
        stay = tube([(0, 0, p.height + 0.01), (0.3 * p.arm, 0, z + 0.18)], 0.014, 6)
        pieces.append(Piece("arm", post, stay))
    return pieces


def _brackets(p: TrafficLight, at: tuple[float, float, float]) -> Solid:
    """Two arms between post and head."""
    zs = [at[2] + s * 0.42 * _tall(p) for s in (-1, 1)]
    return join(*(rod((0, 0, z), (0, at[1], z), 0.02, 8) for z in zs))


def _walker(p: TrafficLight, paint: Material) -> list[Piece]:
    """A head with two fields for people on foot, facing -Y, lower on the post."""
    d, z = 0.9 * p.lens, min(p.height - 0.75 * _tall(p), 2.45)
    y = -p.radius - 0.16
    pieces = [Piece("pedestrian_housing", paint, moved(rounded_box((1.35 * d, 0.16, 2.6 * d), 0.03, 2), (0, y, z)))]
    pieces.append(
        Piece("post", paint, join(*(rod((0, 0, z + s * 0.8 * d), (0, y, z + s * 0.8 * d), 0.018, 6) for s in (-1, 1))))
    )
    hoods: list[Solid] = []
    fields: tuple[tuple[Lit, int, str], ...] = (("red", 1, "pedestrian_stop"), ("green", -1, "pedestrian_go"))
    for name, s, part in fields:
        lit = (p.lit == "red") == (name == "green")
        at = (0, y - 0.082, z + s * 0.6 * d)
        field = moved(rounded_box((1.05 * d, 0.014, 1.05 * d), 0.005, 1), at)
        pieces.append(Piece(part, Material("field", linear((0.04, 0.04, 0.045)), roughness=0.3), field))
        figure = join(
            cuboid((-0.13 * d, -0.012, -0.08 * d), (0.13 * d, 0, 0.2 * d)),
            cuboid((-0.07 * d, -0.012, 0.24 * d), (0.07 * d, 0, 0.38 * d)),
            *(
                cuboid((x - 0.05 * d, -0.012, -0.4 * d), (x + 0.05 * d, 0, -0.06 * d))
                for x in ((-0.08 * d, 0.08 * d) if s > 0 else (-0.16 * d, 0.16 * d))
            ),
        )
        pieces.append(Piece(part, _lens(name, lit), moved(figure, at)))
        hoods.append(moved(cuboid((-0.6 * d, -0.13, 0.54 * d), (0.6 * d, 0, 0.57 * d)), at))
        hoods += [moved(cuboid((x - 0.012, -0.1, -0.2 * d), (x + 0.012, 0, 0.57 * d)), at) for x in (-0.59 * d, 0.59 * d)]
    return [*pieces, Piece("visor", paint, join(*hoods))]


def _button(p: TrafficLight) -> list[Piece]:
    """A box at the post with a button on it."""
    box = moved(rounded_box((0.13, 0.1, 0.24), 0.02, 2), (p.radius + 0.04, 0, 1.08))
    knob = moved(
        turned(lathe([(0.034, -0.01), (0.034, 0.012), (0.02, 0.02), (0, 0.02)], 14), 1, np.pi / 2), (p.radius + 0.1, 0, 1.05)
    )
    yellow = coated("button_box", (0.93, 0.74, 0.08), "matte")
    return [Piece("button", yellow, box), Piece("button", metal("steel", (0.7, 0.71, 0.72), 0.3), knob)]


def traffic_light_random(rng: np.random.Generator) -> Mesh:
    """A traffic light with all parameters drawn."""
    return traffic_light(draw(rng))


_HOUSINGS: tuple[Color, ...] = ((0.06, 0.065, 0.065), (0.93, 0.68, 0.06), (0.08, 0.2, 0.15), (0.3, 0.31, 0.32))
_POSTS: tuple[Color, ...] = ((0.55, 0.56, 0.57), (0.12, 0.13, 0.13), (0.1, 0.2, 0.16), (0.8, 0.65, 0.1))


def draw(rng: np.random.Generator) -> TrafficLight:
    """The parameters of a random traffic light."""
    style: Style = ("post", "cantilever", "pedestrian")[int(rng.choice(3, p=(0.42, 0.22, 0.36)))]
    over = style == "cantilever"
    housing = int(rng.choice(4, p=(0.5, 0.25, 0.15, 0.1)))
    r, g, b = (np.array(_HOUSINGS[housing]) * rng.uniform(0.85, 1.05)).clip(0.02, 0.96).tolist()
    sides = int(rng.choice((1, 2), p=(0.3, 0.7)) if style != "post" else rng.choice((1, 2, 3, 4), p=(0.08, 0.42, 0.25, 0.25)))
    return TrafficLight(
        style=style,
        height=float(rng.uniform(5.6, 6.3) if over else rng.uniform(2.9, 3.7)),
        lens=float(rng.choice((0.21, 0.3), p=(0.55, 0.45)) if not over else 0.3),
        lit=_ORDER[int(rng.integers(3))],
        sides=sides,
        arm=float(rng.uniform(3.2, 4.8)) * (1 if rng.random() < 0.5 else -1),
        heads=int(rng.choice((1, 2))),
        border=float(rng.choice((0.0, 0.1, 0.13), p=(0.5, 0.3, 0.2))) if sides < 3 else 0.0,
        hood=float(rng.uniform(0.14, 0.24)),
        radius=float(rng.uniform(0.09, 0.11) if over else rng.uniform(0.05, 0.065)),
        button=style == "pedestrian" or bool(rng.random() < 0.3),
        striped=not over and bool(rng.random() < 0.2),
        color=(r, g, b),
        post_color=_POSTS[int(rng.choice(4, p=(0.45, 0.25, 0.15, 0.15)))],
    )


FAMILY = ZooFamily(
    random=traffic_light_random,
    home="street",
    classes={"": "traffic sign", "base": "pole", "post": "pole"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
