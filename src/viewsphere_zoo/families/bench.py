"""Benches: wooden slats on iron or concrete ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import sided
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, coated, linear
from viewsphere_zoo.shapes.solids import Solid, join, moved, rounded_box, tube, turned

KEYPOINTS = {
    **sided("seat_front", "seat", (1, -1, 1)),
    **sided("seat_rear", "seat", (1, 1, 1)),
    **sided("back_top", "back", (1, 0, 1)),
}
SKELETON = (
    ("seat_front_left", "seat_front_right"),
    ("seat_rear_left", "seat_rear_right"),
    ("seat_front_left", "seat_rear_left"),
    ("seat_front_right", "seat_rear_right"),
    ("seat_rear_left", "back_top_left"),
    ("seat_rear_right", "back_top_right"),
)


@dataclass(frozen=True)
class Bench:
    """Parameters of a bench; metres, degrees, colours sRGB 0..1. slats: on the seat; recline: lean of the back."""

    width: float = 1.7
    slats: int = 5
    backrest: bool = True
    recline: float = 14.0
    wood: Color = (0.52, 0.34, 0.2)
    iron: Color = (0.1, 0.11, 0.11)


def bench(parameters: Bench | None = None) -> Mesh:
    """The bench in metres: the sitter faces -Y, feet on z = 0. Parts: seat, leg, and back if it has one."""
    p = parameters or Bench()
    wood, iron = Material("wood", linear(p.wood), roughness=0.65), coated("iron", p.iron, "matte")
    deep, high = 0.44, 0.44
    pitch = deep / p.slats
    slat = rounded_box((p.width, 0.82 * pitch, 0.032), 0.008, 1)
    seat = [moved(slat, (0, -deep / 2 + (k + 0.5) * pitch, high)) for k in range(p.slats)]
    pieces = [Piece("seat", wood, join(*seat))]
    lean = np.radians(p.recline)
    if p.backrest:
        board = rounded_box((p.width, 0.028, 0.095), 0.008, 1)
        rows = [moved(board, (0, 0, 0.1 + 0.125 * k)) for k in range(3)]
        pieces.append(Piece("back", wood, moved(turned(join(*rows), 0, -lean), (0, deep / 2 - 0.02, high + 0.03))))
    ends = [_end(p, x, deep, high, lean) for x in (-p.width / 2 + 0.16, p.width / 2 - 0.16)]
    return assemble([*pieces, Piece("leg", iron, join(*ends))], crease_deg=35)


def _end(p: Bench, x: float, deep: float, high: float, lean: float) -> Solid:
    """A bent iron frame: front leg, seat rail, rear leg, upright of the back, armrest."""
    top = high - 0.03
    front = tube([(x, -deep / 2 - 0.03, 0), (x, -deep / 2 + 0.05, 0.2), (x, -deep / 2 + 0.03, top)], 0.02, 8)
    rail = tube([(x, -deep / 2, top), (x, 0, top - 0.01), (x, deep / 2 + 0.02, top)], 0.02, 8)
    rear = tube([(x, deep / 2 + 0.1, 0), (x, deep / 2 - 0.02, 0.22), (x, deep / 2, top)], 0.02, 8)
    solids = [front, rail, rear]
    if p.backrest:
        reach = 0.43
        foot, tip = (
            np.array((x, deep / 2 + 0.015, top)),
            np.array((x, deep / 2 + 0.02 + reach * np.sin(lean), top + reach * np.cos(lean))),
        )
        solids.append(tube([foot, tip], 0.018, 8))
        half = tuple(((foot + tip) / 2).tolist())
        solids.append(
            tube([half, (x, 0, high + 0.23), (x, -deep / 2 + 0.02, high + 0.22), (x, -deep / 2 + 0.03, top)], 0.016, 8)
        )
    return join(*solids)


def bench_random(rng: np.random.Generator) -> Mesh:
    """A bench with all parameters drawn."""
    return bench(draw(rng))


def draw(rng: np.random.Generator) -> Bench:
    """The parameters of a random bench."""
    woods: tuple[Color, ...] = ((0.55, 0.36, 0.2), (0.43, 0.29, 0.2), (0.6, 0.5, 0.4), (0.15, 0.32, 0.22))
    return Bench(
        width=float(rng.uniform(1.4, 1.9)),
        slats=int(rng.integers(4, 8)),
        backrest=bool(rng.random() < 0.8),
        recline=float(rng.uniform(8, 18)),
        wood=woods[int(rng.integers(4))],
        iron=((0.1, 0.11, 0.11), (0.3, 0.31, 0.32), (0.1, 0.2, 0.15))[int(rng.integers(3))],
    )


FAMILY = ZooFamily(
    random=bench_random,
    home="street",
    classes={"": "street furniture"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
