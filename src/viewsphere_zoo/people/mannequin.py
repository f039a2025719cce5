"""A person's surface in the bind pose, from fields: skin, eyes, hair and clothes, each a closed solid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Material, Mesh
from viewsphere_zoo.people import flesh
from viewsphere_zoo.people.build import Build
from viewsphere_zoo.people.fields import ball, joined, plane, steps, surface, within
from viewsphere_zoo.people.hair import Style, hair
from viewsphere_zoo.people.head import Face, Head, head_of, neck
from viewsphere_zoo.people.outfit import Outfit, Tailor
from viewsphere_zoo.people.skeleton import Skeleton
from viewsphere_zoo.people.weights import weights
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, linear
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides


@dataclass(frozen=True)
class Looks:
    """The look of a person apart from build and clothes; colours sRGB. `fold` holds the phases of hair and folds."""

    face: Face = field(default_factory=Face)
    skin: Color = (0.80, 0.60, 0.48)
    hair: Style = "short"
    hair_color: Color = (0.17, 0.11, 0.07)
    eyes: Color = (0.30, 0.20, 0.12)
    fold: tuple[float, float, float] = (0.0, 0.0, 0.0)


def mannequin(b: Build, s: Skeleton, looks: Looks, outfit: Outfit) -> tuple[Mesh, NDArray[np.int64], Float]:
    """The surface in the bind pose, metres, front -Y, up +Z, the joints (V, 4) of its vertices and their weights. Parts: head,
    hair, eyes, arms, legs, top, bottom, shoes.
    """
    head = head_of(b, s, looks.face)
    tailor = Tailor(b, s, head, outfit, np.array(looks.fold))
    paint = materials(looks, outfit)
    white, iris, pupil = head.eyes()
    upper, sole = tailor.shoes()
    pieces = [
        Piece("head", paint["skin"], _head(b, s, head)),
        *(Piece("eyes", paint[name], one) for name, one in (("white", white), ("iris", iris), ("pupil", pupil))),
        Piece("arms", paint["skin"], _arms(b, s, outfit)),
        Piece("top", paint["top"], tailor.top()),
        Piece("bottom", paint["bottom"], tailor.bottom()),
        Piece("shoes", paint["shoe"], upper),
        Piece("shoes", paint["sole"], sole),
    ]
    if outfit.leg < 1.9:
        pieces.append(Piece("legs", paint["skin"], _legs(b, s, outfit)))
    locks = hair(head, looks.hair, looks.fold[0])
    if locks is not None:
        pieces.append(Piece("hair", paint["hair"], locks))
    mesh, parts = dressed(pieces, head, looks)
    return mesh, *weights(b, s, mesh.vertices.astype(np.float64), parts, outfit.bottom == "skirt")


def materials(looks: Looks, outfit: Outfit) -> dict[str, Material]:
    """Return the materials of a person, by name."""
    found = (
        Material("skin", linear(looks.skin), roughness=0.55, specular=0.6),
        Material("white", linear((0.90, 0.88, 0.86)), roughness=0.25),
        Material("iris", linear(looks.eyes), roughness=0.2),
        Material("pupil", (0.004, 0.004, 0.004, 1.0), roughness=0.1),
        Material("hair", linear(looks.hair_color), roughness=0.6),
        Material("top", linear(outfit.top_color), roughness=0.85),
        Material("bottom", linear(outfit.bottom_color), roughness=0.85),
        Material("shoe", linear(outfit.shoe_color), roughness=0.6),
        Material("sole", linear(outfit.sole_color), roughness=0.8),
    )
    return {material.name: material for material in found}


def dressed(pieces: Sequence[Piece], head: Head, looks: Looks) -> tuple[Mesh, NDArray[np.str_]]:
    """The pieces as one mesh, with tints on the skin, and the name of each vertex's part."""
    mesh = assemble(pieces, crease_deg=50.0)
    parts = np.full(len(mesh.vertices), "", "U8")
    for i, name in enumerate(mesh.parts):
        parts[mesh.triangles[mesh.triangle_part == i].reshape(-1)] = name
    return replace(mesh, colors=_tints(mesh, head, looks)), parts


def _head(b: Build, s: Skeleton, head: Head) -> Solid:
    """Head, neck and the part of the chest visible in a collar."""
    h = b.height
    bust = within(flesh.torso(b, s), ball(s["Neck"] + (0, 0, -0.03 * h), np.array((0.085, 0.085, 0.060)) * h), 0.003)
    whole = joined(0.020 * h, head.field(), joined(0.02 * h, neck(b, s, head), bust))
    (_, y, z), k = head.center.tolist(), head.size
    x = steps(-0.105 * h, 0.105 * h, 0.016, (-0.058 * k, 0.058 * k, 0.0052))
    deep = steps(-0.115 * h, 0.115 * h, 0.016, (y - 0.118 * k, y - 0.060 * k, 0.0048))
    high = steps(0.74 * h, h + 0.012, 0.016, (z - 0.092 * k, z + 0.030 * k, 0.0045))
    return surface(whole, (x, deep, high))


def _arms(b: Build, s: Skeleton, outfit: Outfit) -> Solid:
    """Both hands, and the parts of the arms visible below the sleeves."""
    start = max(outfit.sleeve - 0.35, 0.12)
    shoulder, elbow, wrist = (s[name] for name in ("L_Shoulder", "L_Elbow", "L_Wrist"))
    at = shoulder + start * (elbow - shoulder) if start < 1 else elbow + (start - 1) * (wrist - elbow)
    down = elbow - shoulder if start < 1 else wrist - elbow
    whole = joined(0.010 * b.height, flesh.arm(b, s), flesh.hand(b, s))
    whole = within(whole, plane(at, -down), 0.002)
    # A grid along the arm: fine across fingers, coarse along bones.
    along = (s["L_Hand"] - s["L_Wrist"]) / np.sqrt(((s["L_Hand"] - s["L_Wrist"]) ** 2).sum())
    turn = np.stack([along, np.array([0.0, 1.0, 0.0]), np.cross(along, (0.0, 1.0, 0.0))])
    begin, r = float(((at - wrist) * along).sum()), 0.062 * b.height / 1.75
    axes = (
        steps(begin - 0.07, 0.135 * b.height, 0.022, (-0.01, 0.13 * b.height, 0.0070)),
        steps(-1.25 * r, 1.25 * r, 0.0068),
        steps(-r, r, 0.0066),
    )
    solid = surface(lambda q: whole(wrist + _combined(turn, q)), axes)
    return both_sides(Solid(wrist + _combined(turn, solid.vertices), solid.triangles))


def _combined(rows: Float, q: Float) -> Float:
    """Points (N, 3) of coordinates along three vectors."""
    return q[:, :1] * rows[0] + q[:, 1:2] * rows[1] + q[:, 2:] * rows[2]


def _legs(b: Build, s: Skeleton, outfit: Outfit) -> Solid:
    """The parts of both legs visible below shorts or a skirt."""
    hip, knee, ankle = (s[name] for name in ("L_Hip", "L_Knee", "L_Ankle"))
    top = float(hip[2] + max(outfit.leg - 0.35, 0.25) * (knee[2] - hip[2]))
    whole = within(flesh.leg(b, s), plane((0, 0, top), (0, 0, 1)), 0.002)
    r = 0.09 * b.height
    across = steps(float(hip[0]) - r, float(hip[0]) + r, 0.011), steps(-r, r, 0.011)
    return both_sides(surface(whole, (*across, steps(float(ankle[2]) - 0.06, top + 0.03, 0.022))))


def _tints(mesh: Mesh, head: Head, looks: Looks) -> np.ndarray:
    """Vertex colours (V, 4): lips, cheeks, brows and shaved areas on the skin; 1 elsewhere."""
    colors = np.ones((len(mesh.vertices), 4))
    skin = next(i for i, material in enumerate(mesh.materials) if material.name == "skin")
    own = np.unique(mesh.triangles[mesh.triangle_material == skin])
    q = (mesh.vertices[own].astype(np.float64) - head.center) / head.size
    base = np.array(linear(looks.skin)[:3])
    colors[own, :3] = _painted(q, base, np.array(linear(looks.hair_color)[:3]), head) / base
    return np.clip(colors, 0, 1).astype(np.float32)


def _painted(q: Float, skin: Float, locks: Float, head: Head) -> Float:
    """Linear colours (N, 3) of skin at points of the head."""
    x, y, z = np.abs(q[:, 0]), q[:, 1], q[:, 2]
    color = np.broadcast_to(skin, (len(q), 3)).copy()

    def spread(center: tuple[float, float, float], radii: tuple[float, float, float]) -> Float:
        d = np.sqrt(((np.stack([x, y, z], axis=1) - center) ** 2 / np.square(radii)).sum(axis=1))
        return np.clip(1.5 - 1.5 * d, 0, 1)[:, None]

    for center, radii, tone, share in (
        ((0.040, -0.075, -0.030), (0.026, 0.03, 0.024), (1.0, 0.80, 0.76), 0.45),
        ((0.0, -0.105, -0.035), (0.016, 0.02, 0.016), (1.0, 0.82, 0.78), 0.35),
        ((0.078, 0.012, -0.010), (0.015, 0.02, 0.035), (1.0, 0.84, 0.80), 0.4),
        ((0.033, -0.085, 0.002), (0.022, 0.02, 0.011), (0.86, 0.80, 0.78), 0.3),
    ):
        color *= 1 + share * spread(center, radii) * (np.array(tone) - 1)
    lips = spread((0.0, -0.092, -0.0655), (0.0255, 0.012, 0.0115))
    color += np.minimum(1.6 * lips, 0.85) * (skin * (0.84, 0.62, 0.60) - color)
    brow_z = 0.0215 - 0.40 * np.maximum(x - 0.042, 0) + 0.03 * (x - 0.02)
    brow = np.clip(1.6 - np.abs(z - brow_z) / (0.0036 + 0.0012 * head.male), 0, 1) * ((x > 0.011) & (x < 0.056) & (y < -0.04))
    color += 0.85 * brow[:, None] * (0.7 * locks + 0.1 * skin - color)
    return color
