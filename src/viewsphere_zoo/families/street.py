"""Streets: road, markings, kerbs, pavements, verges and the lawns under the houses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Mesh
from viewsphere.model.place import Lane
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.townscape import HALF_LENGTH, PLOT, STEP, paving, roadway
from viewsphere_zoo.townscape.paving import GUTTER
from viewsphere_zoo.townscape.surfaces import finished

WALK = (5.1, 0.7)
"""x of the middle of the walking lane on a pavement, and its width, metres."""

Paving = Literal["slabs", "bricks", "asphalt"]


@dataclass(frozen=True)
class Street:
    """Parameters of a street along Y, 200 m long, the road at z = 0; lengths in metres, colours sRGB 0..1.

    crossings: where driveways cross the kerb, as y on the right (+X) and on the left; zebra: y of the crossing; dash: length
    of a stroke of the centre line and of the gap, the first gap is centred at y = 0; covers: y of the manholes; wear: 0
    fresh to 1 patched and faded; seed draws the textures' grain.
    """

    crossings: tuple[tuple[float, ...], tuple[float, ...]] = ((-25.0, -6.0, 25.0), (-15.5, 3.5, 15.5))
    zebra: float = 28.5
    dash: tuple[float, float] = (3.0, 5.0)
    edge_lines: bool = True
    covers: tuple[float, ...] = (-11.5, 18.0)
    asphalt: Color = (0.4, 0.39, 0.38)
    paving: Paving = "slabs"
    paving_color: Color = (0.6, 0.58, 0.55)
    wear: float = 0.5
    seed: int = 0


def street(parameters: Street | None = None) -> Mesh:
    """The street in metres, exactly z = 0 on the road's middle.

    Parts: road, gutter, kerb, verge, crossing, pavement, edging, lawn, centre_line, edge_line, zebra, manhole, drain,
    patch, base.
    """
    p = parameters or Street()
    rng = np.random.default_rng(p.seed)
    images = paving.images(rng, p.asphalt, p.paving, p.paving_color, p.wear)
    pieces = [
        *paving.sections(p.crossings),
        *roadway.lines(p.dash, p.zebra, p.edge_lines),
        *roadway.fittings(p.covers, p.crossings),
        *roadway.patches(rng, p.wear, p.zebra, p.covers),
    ]
    return finished(pieces, images, paving.tints(rng, p.wear))


def street_random(rng: np.random.Generator) -> Mesh:
    """A street with parameters drawn to resemble real streets."""
    return street(draw(rng))


def draw(rng: np.random.Generator) -> Street:
    """The parameters of a random street."""
    grey = float(rng.uniform(0.35, 0.44))
    paving_of: tuple[tuple[Paving, Color], ...] = (
        ("slabs", (0.66, 0.62, 0.55)),
        ("slabs", (0.6, 0.58, 0.55)),
        ("bricks", (0.55, 0.36, 0.3)),
        ("bricks", (0.5, 0.49, 0.47)),
        ("asphalt", (0.46, 0.45, 0.44)),
    )
    style, color = paving_of[int(rng.choice(5, p=(0.3, 0.25, 0.2, 0.15, 0.1)))]
    side = float(rng.choice((-1.0, 1.0)))
    return Street(
        crossings=(_driveways(0, rng), _driveways(1, rng)),
        zebra=side * float(rng.uniform(27.7, 29.3)),
        dash=((3.0, 5.0), (2.0, 4.0), (3.0, 6.0))[int(rng.integers(3))],
        edge_lines=bool(rng.random() < 0.7),
        covers=(-side * float(rng.uniform(10, 14)), side * float(rng.uniform(15, 19))),
        asphalt=(grey, grey * 0.985, grey * float(rng.uniform(0.94, 0.98))),
        paving=style,
        paving_color=color,
        wear=float(rng.uniform(0.1, 1.0)),
        seed=int(rng.integers(1 << 31)),
    )


def lanes() -> tuple[Lane, ...]:
    """The two lanes of every street, with driving on the right: `right` (+X) leads to +Y, `left` to -Y."""
    middle, width = GUTTER / 2, GUTTER
    return tuple(
        Lane(name, ((side * middle, -side * HALF_LENGTH, 0.0), (side * middle, side * HALF_LENGTH, 0.0)), width)
        for name, side in (("right", 1.0), ("left", -1.0))
    )


def pavements() -> tuple[Lane, ...]:
    """The walking lanes on the two pavements of every street, between lamp posts and benches."""
    return tuple(
        Lane(f"pavement_{name}", ((side * WALK[0], -HALF_LENGTH, STEP), (side * WALK[0], HALF_LENGTH, STEP)), WALK[1])
        for name, side in (("right", 1.0), ("left", -1.0))
    )


def plots(side: int) -> tuple[float, ...]:
    """Middles of the plots along one side of every street, 0 right (+X) or 1 left."""
    steps = np.arange(-8, 9) * PLOT + (0.0, 2.5)[side]
    return tuple(steps[np.abs(steps) < HALF_LENGTH - 0.6 * PLOT].tolist())


def _driveways(side: int, rng: np.random.Generator) -> tuple[float, ...]:
    """One driveway for each plot, near one of its ends."""
    return tuple(y + float(rng.choice((-6.0, 6.0))) for y in plots(side))


FAMILY = ZooFamily(
    random=street_random,
    home="place",
    classes={
        "": "road",
        "edge_line": "road marking",
        "centre_line": "road marking",
        "zebra": "road marking",
        "kerb": "pavement",
        "pavement": "pavement",
        "lawn": "grass",
        "verge": "grass",
        "base": "grass",
        "gutter": "pavement",
        "edging": "pavement",
        "crossing": "pavement",
    },
    draw=draw,
)
