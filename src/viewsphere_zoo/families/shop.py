"""Town buildings with a shop on the ground floor and flats above, between party walls, for use side by side in terraces."""

from __future__ import annotations

import numpy as np

from viewsphere.assets.mesh import Mesh
from viewsphere.model.annotations.keypoints import At, sided
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.townscape import terrace
from viewsphere_zoo.townscape.shopfront import Roof, Shop, Wall
from viewsphere_zoo.townscape.surfaces import finished

KEYPOINTS = {
    **sided("wall_front", "wall", (1, -1, -1)),
    **sided("eaves_front", "wall", (1, -1, 1)),
    **sided("wall_rear", "wall_rear", (1, 1, -1)),
    "sign": At("sign", (0, -1, 0)),
    "door": At("shop_door", (0, -1, 0)),
}
SKELETON = (
    ("wall_front_left", "wall_front_right"),
    ("eaves_front_left", "eaves_front_right"),
    ("wall_front_left", "eaves_front_left"),
    ("wall_front_right", "eaves_front_right"),
    ("wall_front_left", "wall_rear_left"),
    ("wall_front_right", "wall_rear_right"),
)


def shop(parameters: Shop | None = None) -> Mesh:
    """The building in metres: front towards -Y, on z = 0, its walls centred in x and y, nothing beyond its party walls.

    Parts: wall, wall_rear, party_wall, floor, window, window_frame, sill, sign, sign_rear, shop_window, shop_frame, shop_door,
    goods, pilaster, shop_cornice, cornice, step, door, door_frame, door_handle, roof, downpipe, and where fitted curtain,
    painted_sign, surround, course, quoin, balcony, awning, hanging_sign, parapet, roof_hut, fascia, gutter, dormer, chimney,
    chimney_pot.
    """
    p = parameters or Shop()
    rng = np.random.default_rng(p.seed)
    return finished(terrace.pieces(p, rng), terrace.images(p, rng), crease_deg=35)


def shop_random(rng: np.random.Generator) -> Mesh:
    """A building with parameters drawn to resemble real town buildings."""
    return shop(draw(rng))


_WALLS: dict[Wall, tuple[Color, ...]] = {
    "brick": ((0.6, 0.33, 0.25), (0.66, 0.44, 0.33), (0.5, 0.27, 0.22), (0.74, 0.62, 0.46)),
    "stone": ((0.78, 0.74, 0.66), (0.7, 0.68, 0.64), (0.8, 0.7, 0.56)),
    "plaster": (
        (0.92, 0.9, 0.86),
        (0.9, 0.8, 0.6),
        (0.85, 0.6, 0.5),
        (0.7, 0.8, 0.82),
        (0.72, 0.8, 0.68),
        (0.9, 0.7, 0.7),
        (0.75, 0.55, 0.4),
    ),
}
_FRONTS: tuple[Color, ...] = (
    (0.1, 0.24, 0.18),
    (0.45, 0.07, 0.09),
    (0.1, 0.17, 0.33),
    (0.1, 0.1, 0.11),
    (0.42, 0.27, 0.16),
    (0.85, 0.65, 0.15),
    (0.25, 0.45, 0.5),
    (0.9, 0.89, 0.85),
    (0.5, 0.3, 0.45),
)
_CLOTHS: tuple[Color, ...] = (
    (0.7, 0.1, 0.1),
    (0.1, 0.3, 0.2),
    (0.12, 0.2, 0.45),
    (0.85, 0.6, 0.12),
    (0.35, 0.35, 0.36),
    (0.5, 0.15, 0.3),
)
_ROOFS: tuple[Color, ...] = ((0.33, 0.34, 0.37), (0.26, 0.27, 0.3), (0.47, 0.25, 0.19), (0.4, 0.3, 0.24))
_NAMES = (
    "BAKERY",
    "BOOKS",
    "CAFE",
    "FLOWERS",
    "PHARMACY",
    "SHOES",
    "BARBER",
    "TOYS",
    "GROCER",
    "OPTICIAN",
    "FASHION",
    "CYCLES",
)


def draw(rng: np.random.Generator) -> Shop:
    """The parameters of a random town building."""
    roof: Roof = ("flat", "pitched", "mansard")[int(rng.choice(3, p=(0.34, 0.4, 0.26)))]
    wall: Wall = ("brick", "stone", "plaster")[int(rng.choice(3, p=(0.38, 0.2, 0.42)))]
    storeys = int(rng.choice((3, 4, 5), p=(0.42, 0.38, 0.2) if roof != "mansard" else (0.55, 0.45, 0.0)))
    modern = roof == "flat" and bool(rng.random() < 0.4)
    front = _FRONTS[int(rng.integers(len(_FRONTS)))]
    board = front if rng.random() < 0.55 else _FRONTS[int(rng.integers(len(_FRONTS)))]
    dark = float(np.dot(board, (0.3, 0.6, 0.1))) < 0.45
    light: tuple[Color, ...] = ((0.94, 0.93, 0.9), (0.93, 0.82, 0.5))
    return Shop(
        width=float(rng.uniform(5.4, 8.4)),
        depth=float(rng.uniform(8.5, 11.5)),
        storeys=storeys,
        ground=float(rng.uniform(3.6, 4.2)),
        storey=float(rng.uniform(2.75, 3.2)),
        wall=wall,
        roof=roof,
        slope=float(rng.uniform(0.6, 0.85)),
        dormers=roof == "pitched" and bool(rng.random() < 0.4),
        gabled=bool(rng.random() < 0.6),
        hut=roof == "flat" and bool(rng.random() < 0.5),
        chimneys=(() if modern else ((1,), (-1,), (1, -1), ())[int(rng.integers(4))]),
        pitch=float(rng.uniform(2.1, 2.8)),
        window=float(rng.uniform(0.95, 1.2)),
        bars="double" if modern else ("plain", "sash", "cross", "georgian")[int(rng.choice(4, p=(0.15, 0.4, 0.3, 0.15)))],
        surrounds=not modern and bool(rng.random() < 0.6),
        courses=not modern and bool(rng.random() < 0.6),
        quoins=not modern and wall != "stone" and bool(rng.random() < 0.25),
        dentils=not modern and bool(rng.random() < 0.6),
        painted=bool(rng.random() < 0.95),
        balconies=float(rng.uniform(0.25, 0.7)) if rng.random() < 0.3 and storeys < 5 else 0.0,
        side_door=int(rng.choice((-1, 0, 1), p=(0.35, 0.3, 0.35))),
        door=("left", "middle", "right")[int(rng.integers(3))],
        pane=float(rng.uniform(0.9, 2.2)),
        riser=float(rng.uniform(0.15, 0.75)),
        transom=bool(rng.random() < 0.6),
        awning=float(rng.uniform(0.9, 1.5)) if rng.random() < 0.55 else 0.0,
        striped=bool(rng.random() < 0.65),
        hanging_sign=("", "round", "square")[int(rng.choice(3, p=(0.45, 0.25, 0.3)))],
        name=_NAMES[int(rng.integers(len(_NAMES)))],
        wall_color=_shaded(_WALLS[wall][int(rng.integers(len(_WALLS[wall])))], rng),
        trim_color=((0.88, 0.86, 0.81), (0.93, 0.92, 0.9), (0.7, 0.67, 0.6))[int(rng.integers(3))],
        roof_color=_shaded(_ROOFS[int(rng.integers(len(_ROOFS)))], rng),
        frame_color=(0.93, 0.93, 0.91) if rng.random() < 0.7 else (0.18, 0.19, 0.2),
        front_color=front,
        board_color=board,
        letter_color=light[int(rng.integers(2))] if dark else (0.1, 0.1, 0.12),
        awning_color=_CLOTHS[int(rng.integers(len(_CLOTHS)))],
        seed=int(rng.integers(1 << 31)),
    )


def _shaded(color: Color, rng: np.random.Generator) -> Color:
    r, g, b = (np.array(color) * rng.uniform(0.9, 1.05)).clip(0, 0.96).tolist()
    return r, g, b


FAMILY = ZooFamily(
    random=shop_random,
    home="place",
    classes={"": "building"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
