"""A person with a MakeHuman body (CC0) and viewsphere's own clothes and hair, on the same joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Mesh
from viewsphere_zoo.people.build import Build
from viewsphere_zoo.people.fields import Field, cells, surface
from viewsphere_zoo.people.hair import CELL, falls, hairline, rise
from viewsphere_zoo.people.head import Head
from viewsphere_zoo.people.makehuman import Human
from viewsphere_zoo.people.mannequin import Looks, dressed, materials
from viewsphere_zoo.people.openings import opened, welded
from viewsphere_zoo.people.outfit import Outfit, Tailor
from viewsphere_zoo.people.skeleton import JOINTS, Skeleton
from viewsphere_zoo.people.weights import strongest_four, weights
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.cut import cut
from viewsphere_zoo.shapes.solids import Float, Solid

ARM = tuple(JOINTS.index(f"{side}_{name}") for side in "LR" for name in ("Shoulder", "Elbow", "Wrist", "Hand"))
SOLE = 0.012
"""Thickness of a shoe's sole below the foot, metres."""


@dataclass(frozen=True, eq=False)
class Dressed:
    """A surface in the bind pose with its rig: joints (V, 4) of its vertices, and their weights."""

    mesh: Mesh
    skeleton: Skeleton
    joints: NDArray[np.int64]
    weights: Float


@dataclass(frozen=True, eq=False)
class _Body:
    """A body's vertices (V, 3 + 24) of positions and weights, its joints, head and eyes."""

    data: Human
    vertices: Float
    skeleton: Skeleton
    head: Head
    eye: Float
    radius: float

    def solid(self, group: str) -> Solid:
        """One group of the faces."""
        return welded(Solid(self.vertices, self.data.faces[group]))


def human(data: Human, b: Build, looks: Looks, outfit: Outfit, age: float, heritage: Mapping[str, float]) -> Dressed:
    """The person in metres, front -Y, up +Z, soles on z = 0; parts as in `mannequin`."""
    body = _body(data, b, age, heritage, looks)
    guide = _guide(body, b)
    tailor = Tailor(b, guide, body.head, outfit, np.array(looks.fold))
    paint = materials(looks, outfit)
    white, iris, pupil = body.head.eyes(body.eye, body.radius)
    upper, sole = tailor.shoes()
    skin = body.solid("body")
    pieces = [
        Piece("head", paint["skin"], _head(skin, b)),
        *(Piece("eyes", paint[name], one) for name, one in (("white", white), ("iris", iris), ("pupil", pupil))),
        Piece("arms", paint["skin"], _arms(skin, tailor)),
        Piece("top", paint["top"], _top(body, tailor)),
        Piece("bottom", paint["bottom"], tailor.bottom() if outfit.bottom == "skirt" else _bottom(body, tailor)),
        Piece("shoes", paint["shoe"], upper),
        Piece("shoes", paint["sole"], sole),
    ]
    if outfit.leg < 1.9:
        pieces.append(Piece("legs", paint["skin"], _legs(skin, tailor)))
    pieces += [Piece("hair", paint["hair"], one) for one in _hair(body, skin, looks)]
    mesh, parts = dressed(
        [replace(p, solid=Solid(p.solid.vertices[:, :3], p.solid.triangles)) for p in pieces], body.head, looks
    )
    return Dressed(mesh, body.skeleton, *_weights(pieces, mesh, parts, b, guide, outfit))


def _body(data: Human, b: Build, age: float, heritage: Mapping[str, float], looks: Looks) -> _Body:
    whole = data.shaped(b.male, age, 0.5 + 0.15 * b.male, float(np.clip(0.5 + 0.32 * b.weight, 0, 1)), heritage)
    whole = np.stack([whole[:, 0], -whole[:, 2], whole[:, 1]], axis=1)
    flesh = np.unique(data.faces["body"])
    low, high = whole[flesh, 2].min(), whole[flesh, 2].max()
    whole = (whole - (0, 0, low)) * ((b.height - SOLE) / (high - low)) + (0, 0, SOLE)
    places: Float = np.array([whole[mark].mean(axis=0) for mark in data.marks], np.float64)
    left = np.array([name.startswith("L_") for name in JOINTS])
    right = np.array([name.startswith("R_") for name in JOINTS])
    places[right] = places[left] * (-1, 1, 1)
    places[~left & ~right, 0] = 0.0
    ball = whole[np.unique(data.faces["helper-l-eye"])]
    eye = ball.mean(axis=0)
    size = (b.height - eye[2]) / 0.1145
    head = Head(np.array([0.0, eye[1] + 0.0735 * size, eye[2] - 0.002 * size]), size, looks.face, b.male)
    radius = 0.5 * float(np.ptp(ball[:, 0]))
    return _Body(data, np.concatenate([whole, data.weights], axis=1), Skeleton(np.round(places, 6)), head, eye, radius)


def _guide(body: _Body, b: Build) -> Skeleton:
    """The joints at the positions for the tailor: the neck at its root, in the middle of its flesh."""
    places = body.skeleton.places.copy()
    z = 0.838 * b.height
    near = (np.abs(body.vertices[:, 2] - z) < 0.02) & (np.abs(body.vertices[:, 0]) < 0.03)
    places[JOINTS.index("Neck")] = 0.0, float(body.vertices[near, 1].min() + body.vertices[near, 1].max()) / 2, z
    return Skeleton(places)


def _arm(v: Float) -> Float:
    """Return the arm's share of each vertex's weight, (V,)."""
    return v[:, 3:][:, ARM].sum(axis=1)


def _head(skin: Solid, b: Build) -> Solid:
    v = skin.vertices
    return opened(skin, np.maximum(0.782 * b.height - v[:, 2], np.abs(v[:, 0]) - 0.080 * b.height), 0.0, 0.002)


def _past_cuffs(v: Float, tailor: Tailor, more: float) -> Float:
    """A level, positive on arms beyond the ends of the sleeves, with the sleeves shortened by `more` metres."""
    point, down = tailor.cuff()
    left = np.where(v[:, :1] < 0, v[:, :3] * (-1, 1, 1), v[:, :3])
    return np.minimum(((left - point) * down).sum(axis=1) + more, 0.25 * (_arm(v) - 0.5))


def _arms(skin: Solid, tailor: Tailor) -> Solid:
    return opened(skin, -_past_cuffs(skin.vertices, tailor, 0.05), 0.0, 0.002)


def _legs(skin: Solid, tailor: Tailor) -> Solid:
    z, h = skin.vertices[:, 2], tailor.build.height
    out = np.maximum(0.25 * (_arm(skin.vertices) - 0.5), np.maximum(z - tailor.end_of_leg - 0.06, 0.040 * h - z))
    return opened(skin, out, 0.0, 0.002)


def _top(body: _Body, tailor: Tailor) -> Solid:
    h = tailor.build.height
    cloth = _cloth(
        body, 4, lambda p: tailor.outfit.loose + tailor.folds(p) + 0.012 * np.clip((0.60 - p[:, 2] / h) / 0.08, 0, 1)
    )
    cloth = opened(cloth, tailor.hem - cloth.vertices[:, 2], 0.03, 0.004)
    cloth = opened(cloth, _past_cuffs(cloth.vertices, tailor, 0.0), 0.05, 0.003)
    return opened(cloth, tailor.neckline()(cloth.vertices[:, :3]), 0.0, 0.003)


def _bottom(body: _Body, tailor: Tailor) -> Solid:
    h = tailor.build.height
    knee = float(tailor.skeleton["L_Knee"][2])
    cloth = _cloth(body, 2, lambda p: 0.004 + 0.7 * tailor.folds(p) + 0.012 * np.clip((knee + 0.1 - p[:, 2]) / 0.3, 0, 1))
    z = cloth.vertices[:, 2]
    cloth = opened(cloth, np.maximum(z - 0.575 * h, 0.25 * (_arm(cloth.vertices) - 0.3)), 0.0, 0.002)
    return opened(cloth, tailor.end_of_leg - cloth.vertices[:, 2], 0.03, 0.003)


def _cloth(body: _Body, rounds: int, grown: Field) -> Solid:
    """The shell of cloth around the body, in finer triangles, smoothed this many times, and moved outwards by `grown`."""
    shell = _finer(body.solid("helper-tights"))
    v = shell.vertices.copy()
    for _ in range(rounds):
        v[:, :3] += 0.5 * (_around(v[:, :3], shell.triangles) - v[:, :3])
    v[:, :3] += _normals(v, shell.triangles) * grown(v[:, :3])[:, None]
    return Solid(v, shell.triangles)


def _finer(solid: Solid) -> Solid:
    """The mesh with each triangle split into four."""
    t, n = solid.triangles, len(solid.vertices)
    edges = np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1)
    pairs, at = np.unique(edges, axis=0, return_inverse=True)
    ab, bc, ca = (n + at.reshape(3, -1)).reshape(3, -1)
    a, b, c = t.T
    parts = [np.stack(x, axis=1) for x in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    return Solid(np.concatenate([solid.vertices, solid.vertices[pairs].mean(axis=1)]), np.concatenate(parts))


def _around(places: Float, triangles: NDArray[np.int64]) -> Float:
    """The mean of each vertex's neighbours; open edges stay."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    edges = np.concatenate([edges, edges[:, ::-1]])
    count = np.maximum(np.bincount(edges[:, 0], minlength=len(places)), 1)
    return np.stack([np.bincount(edges[:, 0], places[edges[:, 1], k], len(places)) / count for k in range(3)], axis=1)


def _normals(v: Float, triangles: NDArray[np.int64]) -> Float:
    a, b, c = v[triangles, :3].transpose(1, 0, 2)
    area = np.cross(b - a, c - a)
    total = np.stack([np.bincount(triangles.reshape(-1), np.repeat(area[:, k], 3), len(v)) for k in range(3)], axis=1)
    return total / np.maximum(np.sqrt((total * total).sum(axis=1, keepdims=True)), 1e-12)


def _hair(body: _Body, skin: Solid, looks: Looks) -> list[Solid]:
    """Hair: lifted scalps, and the locks that hang from them."""
    if looks.hair == "bald":
        return []
    head, style, phase = body.head, looks.hair, looks.fold[0]
    scalp, _ = cut(skin, (body.skeleton["Neck"][2] - 0.01) - skin.vertices[:, 2])
    scalp = _finer(scalp)
    line = hairline(head, style)
    v = scalp.vertices.copy()
    v[:, :3] += _normals(v, scalp.triangles) * (0.0015 + rise(head, style, phase)(v[:, :3]))[:, None]
    x, y, z = ((v[:, :3] - head.center) / head.size).T
    ear = 0.036 - np.sqrt((np.abs(x) - 0.085) ** 2 + (y - 0.018) ** 2 + np.clip(np.abs(z + 0.014) - 0.024, 0, 1) ** 2)
    found = [opened(Solid(v, scalp.triangles), np.maximum(line(v[:, :3]), ear * head.size), 0.0, 0.003)]
    hanging = falls(head, style, phase)
    if hanging is not None:
        solid = surface(hanging, cells(head.at(-0.14, -0.1, -0.3), head.at(0.14, 0.22, 0.17), CELL))
        level = line(solid.vertices) if style in ("bob", "long") else np.full(len(solid.vertices), -1.0)
        found.append(opened(solid, level, 0.0, 0.003))
    return found


def _weights(
    pieces: list[Piece], mesh: Mesh, parts: NDArray[np.str_], b: Build, guide: Skeleton, outfit: Outfit
) -> tuple[NDArray[np.int64], Float]:
    """Joints and weights of a mesh's vertices: MakeHuman's if the piece has them, else by position."""
    joints, shares = weights(b, guide, mesh.vertices.astype(np.float64), parts, outfit.bottom == "skirt")
    known = [p.solid.vertices for p in pieces if p.solid.vertices.shape[1] > 3 and p.part != "hair"]
    rows = np.concatenate(known)
    keys = _keys(rows[:, :3].astype(np.float32))
    order = np.argsort(keys, kind="stable")
    own = _keys(mesh.vertices)
    at = np.minimum(np.searchsorted(keys[order], own), len(order) - 1)
    found = keys[order][at] == own
    firm = np.isin(parts, ("hair", "eyes"))
    theirs = strongest_four(rows[order[at[found & ~firm]], 3:])
    joints[found & ~firm], shares[found & ~firm] = theirs
    joints[firm], shares[firm] = (JOINTS.index("Head"), 0, 0, 0), (1.0, 0.0, 0.0, 0.0)
    return joints, shares


def _keys(places: NDArray[np.float32]) -> NDArray[np.void]:
    return np.ascontiguousarray(places + np.float32(0)).view("V12").reshape(-1)
