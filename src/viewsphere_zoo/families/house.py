"""Houses: one or two storeys under gabled, hipped or flat roofs, with wings, dormers, porches and garages."""

from __future__ import annotations

import numpy as np

from viewsphere.assets.mesh import Mesh
from viewsphere.model.annotations.keypoints import At, sided
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.townscape import building
from viewsphere_zoo.townscape.building import House, Roof, Wall
from viewsphere_zoo.townscape.surfaces import finished

KEYPOINTS = {
    **sided("wall_front", "wall", (1, -1, -1)),
    **sided("wall_rear", "wall", (1, 1, -1)),
    **sided("eaves_front", "roof", (1, -1, -1)),
    **sided("eaves_rear", "roof", (1, 1, -1)),
    "roof": At("roof", (0, 0, 1)),
    "door": At("door", (0, -1, 0)),
    "chimney": At("chimney", (0, 0, 1)),
}


def house(parameters: House | None = None) -> Mesh:
    """The house in metres: front towards -Y, standing on z = 0, its walls centred in x and y.

    Parts: wall, plinth, window, window_frame, sill, door, door_frame, door_handle, step, roof, fascia, gutter, and where fitted
    curtain, shutter, garage_door, porch, chimney, chimney_pot, downpipe.
    """
    p = parameters or House()
    rng = np.random.default_rng(p.seed)
    return finished(building.pieces(p, rng), building.images(p, rng), crease_deg=35)


def house_random(rng: np.random.Generator) -> Mesh:
    """A house with parameters drawn to resemble suburban houses."""
    return house(draw(rng))


def draw(rng: np.random.Generator) -> House:
    """The parameters of a random house."""
    roof: Roof = ("gable", "front_gable", "hip", "flat")[int(rng.choice(4, p=(0.38, 0.2, 0.27, 0.15)))]
    modern = roof == "flat"
    storeys = 2 if modern or roof == "front_gable" else int(rng.choice((1, 2), p=(0.35, 0.65)))
    wall: Wall = ("brick", "plaster", "boards")[int(rng.choice(3, p=(0.1, 0.6, 0.3) if modern else (0.45, 0.3, 0.25)))]
    mixed = wall == "brick" and storeys == 2 and rng.random() < 0.45
    wide = float(rng.uniform(8.0, 9.6) if storeys == 2 else rng.uniform(8.8, 10.2))
    white: Color = (0.93, 0.93, 0.91)
    return House(
        width=wide if roof != "front_gable" else float(rng.uniform(7.4, 8.6)),
        depth=float(rng.uniform(7.2, 9.0)),
        storeys=storeys,
        roof=roof,
        slope=float(rng.uniform(0.5, 0.62) if roof == "hip" else rng.uniform(0.62, 0.95)),
        eaves=float(rng.uniform(0.3, 0.55)) if not modern else float(rng.choice((0.05, 0.45))),
        wing=roof in ("gable", "hip") and bool(rng.random() < 0.5),
        garage=int(rng.choice((-1, 0, 1), p=(0.36, 0.28, 0.36))),
        dormers=int(rng.integers(1, 3)) if roof == "gable" and rng.random() < 0.45 else 0,
        porch=("none", "canopy", "posts")[int(rng.choice(3, p=(0.2, 0.45, 0.35)))],
        chimney=not modern and bool(rng.random() < 0.75),
        wall=wall,
        upper="plaster" if mixed and rng.random() < 0.6 else "boards" if mixed else None,
        wall_color=_shaded(_WALLS[wall][int(rng.integers(len(_WALLS[wall])))], rng),
        upper_color=_shaded(_WALLS["plaster"][int(rng.integers(3))], rng),
        roof_color=_shaded(_ROOFS[int(rng.integers(len(_ROOFS)))], rng),
        roof_wave=float(rng.choice((0.06, 0.3, 0.42))),
        trim_color=white if not modern and rng.random() < 0.8 else (0.2, 0.21, 0.23),
        door_color=_DOORS[int(rng.integers(len(_DOORS)))],
        bars="double" if modern else ("plain", "double", "cross", "sash", "georgian")[int(rng.integers(5))],
        shutters=not modern and bool(rng.random() < 0.3),
        seed=int(rng.integers(1 << 31)),
    )


def _shaded(color: Color, rng: np.random.Generator) -> Color:
    r, g, b = (np.array(color) * rng.uniform(0.9, 1.05)).clip(0, 0.96).tolist()
    return r, g, b


_WALLS: dict[Wall, tuple[Color, ...]] = {
    "brick": ((0.6, 0.33, 0.25), (0.66, 0.44, 0.33), (0.5, 0.29, 0.24), (0.72, 0.6, 0.45), (0.56, 0.4, 0.34)),
    "plaster": (
        (0.92, 0.9, 0.86),
        (0.93, 0.91, 0.9),
        (0.9, 0.83, 0.7),
        (0.86, 0.76, 0.62),
        (0.78, 0.82, 0.78),
        (0.86, 0.7, 0.6),
    ),
    "boards": (
        (0.9, 0.9, 0.88),
        (0.62, 0.7, 0.76),
        (0.72, 0.76, 0.66),
        (0.5, 0.25, 0.21),
        (0.8, 0.74, 0.6),
        (0.42, 0.48, 0.52),
    ),
}
_ROOFS: tuple[Color, ...] = (
    (0.55, 0.27, 0.19),
    (0.47, 0.24, 0.19),
    (0.36, 0.36, 0.38),
    (0.28, 0.29, 0.31),
    (0.4, 0.3, 0.24),
    (0.5, 0.34, 0.26),
)
_DOORS: tuple[Color, ...] = (
    (0.1, 0.24, 0.18),
    (0.45, 0.07, 0.09),
    (0.1, 0.17, 0.33),
    (0.12, 0.12, 0.13),
    (0.42, 0.27, 0.16),
    (0.85, 0.65, 0.15),
    (0.25, 0.4, 0.45),
)


FAMILY = ZooFamily(
    random=house_random,
    home="place",
    classes={"": "building"},
    keypoints=KEYPOINTS,
    draw=draw,
)
