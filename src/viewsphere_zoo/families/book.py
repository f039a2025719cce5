"""Books: bound in boards or in paper, lying, standing or open."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import At
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.household import charts, covers
from viewsphere_zoo.household.draws import chance, pick, seed, uniform
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, linear
from viewsphere_zoo.shapes.rods import shifted
from viewsphere_zoo.shapes.solids import Float, Solid, curve, grid, join, loft
from viewsphere_zoo.townscape.surfaces import cuboid

KEYPOINTS = {
    "cover": At("cover"),
    "spine": At("spine|cover"),
    "pages": At("pages"),
}
SKELETON = (("spine", "pages"),)

Pose = Literal["lying", "standing", "open"]
Binding = Literal["boards", "paper"]


@dataclass(frozen=True)
class Book:
    """Parameters of a book; metres, colours sRGB 0..1: ground, picture, letters. width, height: size of the closed cover."""

    pose: Pose = "lying"
    binding: Binding = "boards"
    width: float = 0.15
    height: float = 0.22
    thickness: float = 0.028
    title: str = "NIGHT TRAIN"
    author: str = "M. ORTEGA"
    art: str = "scene"
    colors: tuple[Color, Color, Color] = ((0.12, 0.2, 0.36), (0.75, 0.5, 0.3), (0.95, 0.9, 0.78))
    ribbon: bool = False
    seed: int = 0

    @property
    def extent(self) -> tuple[float, float, float]:
        """Greatest width, depth and height of the whole model, metres."""
        match self.pose:
            case "standing":
                return self.thickness + 0.01, self.width + 0.01, self.height + 0.01
            case "lying":
                return self.width + 0.02, self.height + 0.07, self.thickness + 0.01
            case "open":
                return 2.2 * self.width, self.height + 0.03, self.thickness


def book(parameters: Book | None = None) -> Mesh:
    """The book in metres. Lying: cover up, its text read from the front (-Y), spine at -X; standing: spine towards -Y.

    Parts: cover, pages; spine unless open; ribbon. An open book lies on its cover, its lower edge towards -Y.
    """
    p = parameters or Book()
    if p.pose == "open":
        return _open(p)
    mesh = _closed(p)
    if p.pose == "lying":
        return mesh
    upright = [2, 0, 1]
    vertices = mesh.vertices[:, upright] + np.array((-p.thickness / 2, 0, p.height / 2), np.float32)
    return replace(mesh, vertices=vertices, normals=mesh.normals[:, upright].copy())


def _board(p: Book) -> tuple[float, float]:
    """Return the thickness of the cover, and its overhang beyond the pages, metres."""
    return (0.0026, 0.0032) if p.binding == "boards" else (0.0005, 0.0)


def _closed(p: Book) -> Mesh:
    w, h, t = p.width / 2, p.height / 2, p.thickness
    board, out = _board(p)
    coat = charts.printed("jacket", 0, 0.4, 0.35) if p.binding == "paper" else charts.printed("jacket", 0, 0.6)
    hinge = -w + (0.5 * t * 0.5 if p.binding == "boards" else 0.0)
    pieces = [
        Piece("cover", coat, cuboid((hinge, -h, t - board), (w, h, t))),
        Piece("cover", coat, cuboid((hinge, -h, 0), (w, h, board))),
        Piece("spine", coat, _spine(p, hinge, board)),
        Piece("pages", charts.printed("pages", 1, 0.9), _block(p, hinge, board, out)),
    ]
    if p.ribbon:
        silk = Material("ribbon", linear(p.colors[1]), roughness=0.5)
        pieces.append(
            Piece("ribbon", silk, cuboid((-0.2 * w, -h - 0.03, t / 2), (-0.2 * w + 0.005, -h + 0.02, t / 2 + 0.0005)))
        )
    wide = 4 * w + t
    outside = charts.sides(
        {
            (2, 1): charts.flat((-3 * w - t, -h), (w, h)),
            (2, -1): charts.flat((w, -h), (w - wide, h)),
            (0, -1): charts.flat((-2 * w, -h), (2 * w + t, h), axes=(2, 1)),
        }
    )
    edges = charts.sides(
        {
            (1, -1): charts.flat((-w, 0), (w, t), axes=(0, 2)),
            (1, 1): charts.flat((-w, 0), (w, t), axes=(0, 2)),
            (0, 1): charts.flat((-h, 0), (h, t), axes=(1, 2)),
        }
    )
    rng = np.random.default_rng(p.seed)
    jacket = covers.jacket((p.width, p.height, t), p.title, p.author, p.art, p.colors, rng)
    mesh = assemble(pieces, crease_deg=35)
    return charts.charted(mesh, {"jacket": outside, "pages": edges}, [jacket, covers.leaves_of_paper(rng)])


def _spine(p: Book, hinge: float, board: float) -> Solid:
    """The back, round on boards: a bent slab from the lower cover's edge to the upper's."""
    h, t = p.height / 2, p.thickness
    a = np.linspace(-np.pi / 2, np.pi / 2, 9 if p.binding == "boards" else 2)
    if p.binding == "boards":
        deep = hinge + p.width / 2
        outer = np.stack([hinge - deep * np.cos(a), t / 2 + t / 2 * np.sin(a)], axis=1)
        inner = np.stack([hinge - (deep - board) * np.cos(a), t / 2 + (t / 2 - board) * np.sin(a)], axis=1)
    else:
        outer = np.array([(hinge - board, 0), (hinge - board, t)])
        inner = np.array([(hinge, 0), (hinge, t)])
    rows = np.stack([outer, inner], axis=1)
    ring = np.array([[(x, y, z) for (x, z), y in ((o, -h), (o, h), (i, h), (i, -h))] for o, i in rows])
    return loft(ring[:, ::-1])


def _block(p: Book, hinge: float, board: float, out: float) -> Solid:
    """The pages; the fore edge of a book with a round back is hollow."""
    h, t = p.height / 2 - out, p.thickness
    z = np.linspace(board, t - board, 7)
    bow = (1 - ((z - t / 2) / (t / 2 - board)) ** 2) * (0.006 if p.binding == "boards" else 0.0)
    fore = np.stack([p.width / 2 - out - bow * min(1.0, t / 0.03), z], axis=1)
    back = np.stack([hinge - 0.8 * bow, z], axis=1)[::-1]
    profile = np.concatenate([fore, back])
    return loft(np.array([[(x, y, z) for x, z in profile] for y in (h, -h)]))


def _open(p: Book) -> Mesh:
    """Two halves of the pages on the flat cover; the gutter at x = 0."""
    w, h = p.width, p.height / 2
    board, out = _board(p)
    share = 0.3 + 0.4 * np.random.default_rng(p.seed).random()
    cover = Material("cover", linear(p.colors[0]), roughness=0.6)
    tops = [_page(p, side, a) for side, a in ((-1, share), (1, 1 - share))]
    solids: list[Solid] = []
    for top in tops:
        rim = top[:: 1 if top[0, 0] < top[-1, 0] else -1]
        ring = np.concatenate([rim - (0, 3e-4), [(rim[-1, 0], board), (rim[0, 0], board)]])
        solids.append(loft(np.array([[(x, y, z) for x, z in ring] for y in (-h + out, h - out)])))
    faces = [_face(top, h - out) for top in tops]
    wide = w + p.thickness / 2
    rng = np.random.default_rng(p.seed)
    images = [covers.spread(w, p.height, rng), covers.leaves_of_paper(rng)]
    edges = charts.sides(
        {(axis, sign): charts.flat((-w, 0), (w, p.thickness), axes=(1 - axis, 2)) for axis in (0, 1) for sign in (-1, 1)}
    )
    pieces = [
        Piece("cover", cover, cuboid((-wide, -h, 0), (wide, h, board))),
        Piece("pages", charts.printed("pages", 1, 0.9), join(*solids)),
        Piece("pages", charts.printed("spread", 0, 0.85), join(*faces)),
    ]
    if p.ribbon:
        silk = Material("ribbon", linear(p.colors[1]), roughness=0.5)
        path = np.array([(0.002, y, 0.62 * p.thickness * min(share, 1 - share) + 0.004) for y in np.linspace(h, -h, 5)])
        path = np.concatenate([path, [(0.008, -h - 0.012, 0.003), (0.012, -h - 0.035, 0.0012)]])
        strip = np.stack([shifted(path, -0.003), shifted(path, 0.003)], axis=1)
        pieces.append(Piece("ribbon", silk, grid(strip[::-1])))
    charted = {"spread": charts.flat((-w, -h), (w, h)), "pages": edges}
    return charts.charted(assemble(pieces, crease_deg=35), charted, images)


def _page(p: Book, side: int, share: float) -> Float:
    """The upper page of a half, from the gutter outwards: points (N, 2) of x and z."""
    board, out = _board(p)
    thick = max(share * p.thickness, 0.003)
    s = np.concatenate([np.linspace(0, 0.2, 8)[:-1], np.linspace(0.2, 1, 9)])
    rise = curve(s, [(0, 0.4), (0.05, 0.8), (0.16, 1.0), (0.5, 0.93), (1, 0.72)])
    return np.stack([side * s * (p.width + p.thickness / 2 - out - 0.25 * thick), board + thick * rise], axis=1)


def _face(top: Float, half: float) -> Solid:
    rows = np.array([[(x, y, z) for y in (-half, half)] for x, z in top])
    return grid(rows if top[0, 0] < top[-1, 0] else rows[::-1])


def book_random(rng: np.random.Generator) -> Mesh:
    """A book with all parameters drawn."""
    return book(draw(rng))


def draw(rng: np.random.Generator) -> Book:
    """The parameters of a random book."""
    pose: Pose = ("lying", "standing", "open")[int(rng.choice(3, p=(0.5, 0.25, 0.25)))]
    binding: Binding = "boards" if pose != "lying" or chance(rng, 0.5) else "paper"
    height = uniform(rng, 0.17, 0.3) if binding == "boards" else uniform(rng, 0.17, 0.235)
    return Book(
        pose=pose,
        binding=binding,
        width=height * uniform(rng, 0.62, 0.78),
        height=height,
        thickness=uniform(rng, *_THICK[pose]) if binding == "boards" else uniform(rng, 0.014, 0.036),
        title=pick(rng, covers.TITLES),
        author=pick(rng, covers.AUTHORS),
        art=pick(rng, (*covers.ARTS,)),
        colors=pick(rng, _COLORS),
        ribbon=binding == "boards" and pose != "standing" and chance(rng, 0.4),
        seed=seed(rng),
    )


_THICK: dict[Pose, tuple[float, float]] = {"lying": (0.018, 0.05), "standing": (0.028, 0.055), "open": (0.018, 0.045)}
"""Range of thicknesses of a book, metres; a thin book would not stand by itself."""

_COLORS: tuple[tuple[Color, Color, Color], ...] = (
    ((0.12, 0.2, 0.36), (0.75, 0.5, 0.3), (0.95, 0.9, 0.78)),
    ((0.93, 0.9, 0.82), (0.25, 0.42, 0.4), (0.75, 0.25, 0.16)),
    ((0.62, 0.12, 0.12), (0.2, 0.08, 0.1), (0.96, 0.86, 0.6)),
    ((0.13, 0.3, 0.22), (0.55, 0.65, 0.35), (0.95, 0.9, 0.7)),
    ((0.95, 0.72, 0.2), (0.8, 0.35, 0.15), (0.16, 0.14, 0.2)),
    ((0.14, 0.13, 0.14), (0.45, 0.42, 0.45), (0.9, 0.2, 0.18)),
    ((0.36, 0.6, 0.72), (0.15, 0.32, 0.45), (0.98, 0.95, 0.85)),
    ((0.9, 0.86, 0.88), (0.6, 0.3, 0.42), (0.3, 0.14, 0.25)),
    ((0.4, 0.26, 0.17), (0.65, 0.48, 0.28), (0.92, 0.8, 0.5)),
    ((0.96, 0.95, 0.92), (0.2, 0.35, 0.65), (0.12, 0.14, 0.22)),
    ((0.55, 0.42, 0.62), (0.28, 0.2, 0.42), (0.97, 0.9, 0.6)),
    ((0.9, 0.45, 0.28), (0.96, 0.8, 0.5), (0.2, 0.12, 0.18)),
)


FAMILY = ZooFamily(
    random=book_random,
    home="table",
    classes={"": "household item"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
