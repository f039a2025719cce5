"""The drive train on the bicycle's right: chainrings, cassette, derailleurs, chain and its guard."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere_zoo.cycle.chain import Pulley, chain, disc, phase_on, pitch_radius, rollers, sprocket
from viewsphere_zoo.cycle.coats import Coats
from viewsphere_zoo.cycle.layout import Layout
from viewsphere_zoo.cycle.wheels import Hub
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import across, aimed, between, plate, ring_of, rod, shifted, washer
from viewsphere_zoo.shapes.solids import Float, Solid, join, loft, moved, rounded_box

Guard = Literal["none", "ring", "half", "case"]


@dataclass(frozen=True)
class Gears:
    """rings: teeth of the chainrings, the one in use first; cogs: teeth of the cassette from the smallest; on: index of the
    cog in use; one cog means no derailleur. line: the chain's distance from the middle, metres; cage: distance between the
    derailleur's pulleys, metres; guard: the guard that keeps trousers off the chain.
    """

    rings: tuple[int, ...] = (50, 34)
    cogs: tuple[int, ...] = (11, 13, 15, 17, 19, 21, 23, 25, 28)
    on: int = 4
    line: float = 0.0445
    cage: float = 0.056
    guard: Guard = "none"

    @property
    def derailleur(self) -> bool:
        """Return whether the chain can change cogs."""
        return len(self.cogs) > 1


STEP = 0.0039
"""Distance between neighbouring cogs, metres."""
JOCKEY = 11
"""Teeth of a derailleur's pulleys."""


def _jockeys(at: Layout, g: Gears) -> tuple[Pulley, Pulley]:
    """The derailleur's upper (guide) and lower (tension) pulley."""
    axle, r = at.rear_axle, pitch_radius(JOCKEY)
    reach = 0.028 + r + 0.55 * pitch_radius(max(g.cogs)) + 0.45 * pitch_radius(g.cogs[g.on])
    y, z = axle[1] + 0.012 - 0.05 * reach, axle[2] - reach
    tilt = np.radians(22)
    return Pulley(y, z, r, -1), Pulley(y - g.cage * np.sin(tilt), z - g.cage * np.cos(tilt), r, 1)


def _pulleys(at: Layout, g: Gears) -> list[Pulley]:
    """The pulleys in the order in which the chain runs over them: chainring, lower pulley, upper pulley, cog."""
    front = Pulley(at.bracket[1], at.bracket[2], pitch_radius(g.rings[0]))
    cog = Pulley(at.rear_axle[1], at.rear_axle[2], pitch_radius(g.cogs[g.on]))
    if not g.derailleur:
        return [front, cog]
    upper, lower = _jockeys(at, g)
    return [front, lower, upper, cog]


def gear_pieces(at: Layout, g: Gears, hub: Hub, coats: Coats) -> list[Piece]:
    """Chain, chainrings, cassette, derailleurs, guard."""
    pulleys = _pulleys(at, g)
    centres = rollers(pulleys)
    links, barrels = chain(centres, -g.line)
    pieces = [
        Piece("chain", coats.chain, links),
        Piece("chain", coats.steel, barrels),
        *_chainrings(at, g, phase_on(centres, pulleys[0]), coats),
        *_cassette(at, g, hub, phase_on(centres, pulleys[-1]), coats),
    ]
    if g.derailleur:
        phases = (phase_on(centres, pulleys[2]), phase_on(centres, pulleys[1]))
        pieces += _rear_derailleur(at, g, hub, phases, coats)
    if len(g.rings) > 1:
        pieces += _front_derailleur(at, g, coats)
    return pieces + _guard(at, g, coats)


def _chainrings(at: Layout, g: Gears, phase: float, coats: Coats) -> list[Piece]:
    """Rings from the outermost inwards; the spider that carries them belongs to the cranks."""
    solids = [moved(sprocket(teeth, phase, 0.002), (-g.line + 0.0075 * k, *at.bracket[1:])) for k, teeth in enumerate(g.rings)]
    outer = coats.black if g.guard == "none" and len(g.rings) == 1 else coats.alloy
    return [Piece("chainring", outer, solids[0]), *(Piece("chainring", coats.alloy, s) for s in solids[1:])]


def _cassette(at: Layout, g: Gears, hub: Hub, phase: float, coats: Coats) -> list[Piece]:
    """Cogs on their body, the largest innermost."""
    place = [-g.line - STEP * (g.on - k) for k in range(len(g.cogs))]
    solids: list[Solid] = []
    for teeth, x in zip(g.cogs, place, strict=True):
        r = pitch_radius(teeth)
        inner = 0.016 if teeth < 22 else max(0.016, r - 0.018)
        solids.append(moved(sprocket(teeth, phase, 0.0018, inner), (x, *at.rear_axle[1:])))
        if teeth >= 22:
            wide = 0.32
            tip, foot = r - 0.014, 0.013
            web = [(foot, -0.006), (tip, -0.004 + wide * 0.02), (tip, 0.004 + wide * 0.02), (foot, 0.006)]
            arms = ring_of(across(plate(web, 0.0015)), 6, 0, 0.2 * teeth)
            solids.append(moved(arms, (x, *at.rear_axle[1:])))
    body = rod((min(place[0], -0.5 * hub.half) - 0.0035, 0, 0), (hub.right + 0.001, 0, 0), 0.0172, 20)
    return [
        Piece("cassette", coats.steel, join(*solids)),
        Piece("cassette", coats.black, moved(body, at.rear_axle)),
    ]


def _rear_derailleur(at: Layout, g: Gears, hub: Hub, phases: tuple[float, float], coats: Coats) -> list[Piece]:
    """Hanger, knuckle, parallelogram, and the cage with two toothed pulleys."""
    upper, lower = _jockeys(at, g)
    x = -g.line
    wheels = [
        moved(join(sprocket(JOCKEY, a, 0.003, 0.006), disc(0.012, 0.006, 0.004, 16)), (x, p.y, p.z))
        for p, a in zip((upper, lower), phases, strict=True)
    ]
    ends = np.array([(upper.y, upper.z), (lower.y, lower.z)])
    cage = across(plate(_stadium(ends, 0.0125, 0.014), 0.0018))
    plates = join(moved(cage, (x - 0.0055, 0, 0)), moved(cage, (x + 0.0055, 0, 0)))
    bolts = [rod((x - 0.0075, *p), (x + 0.0075, *p), 0.0035, 8) for p in ends]
    outside = -hub.half - 0.004
    hanger = shifted(at.rear_axle, 0, 0.006, -0.028)
    top = (outside, *hanger[1:])
    mid = (outside - 0.016, hanger[1] + 0.022, hanger[2] - 0.012)
    knuckle = (x - 0.014, upper.y + 0.004, upper.z + 0.008)
    arm = rounded_box((0.01, 0.026, 1.0), 0.004, 2)
    span = np.linalg.norm(np.array(knuckle) - mid)
    body = _bar(arm, np.array(mid), np.array(knuckle), float(span))
    tab = across(plate([(-0.004, -0.007), (0.012, -0.007), (0.011, 0.008), (0.003, 0.028), (-0.009, 0.026)], 0.006))
    return [
        Piece("derailleur_rear", coats.black, join(*wheels)),
        Piece("derailleur_rear", coats.parts, join(plates, body, rod(np.array(top) - (0.003, 0, 0), np.array(mid), 0.011, 14))),
        Piece(
            "derailleur_rear", coats.steel, join(*bolts, rod((x - 0.002, *knuckle[1:]), (x - 0.026, *knuckle[1:]), 0.011, 14))
        ),
        Piece("derailleur_rear", coats.alloy, moved(tab, (-hub.half + 0.001, *hanger[1:]))),
    ]


def _bar(template: Solid, a: Float, b: Float, span: float) -> Solid:
    """A bar template of length 1 along z, stretched from a to b."""
    return aimed(Solid(template.vertices * (1, 1, span + 0.012), template.triangles), between(a, b, 0.5), b - a)


def _stadium(ends: Float, first: float, second: float) -> Float:
    """A counter-clockwise outline (N, 2) around two points (2, 2) at these distances from them."""
    axis = np.arctan2(*(ends[1] - ends[0])[::-1])
    turn = np.linspace(-np.pi / 2, np.pi / 2, 7)
    far = ends[1] + second * np.stack([np.cos(axis + turn), np.sin(axis + turn)], axis=1)
    near = ends[0] - first * np.stack([np.cos(axis + turn), np.sin(axis + turn)], axis=1)
    return np.concatenate([far, near])


def _front_derailleur(at: Layout, g: Gears, coats: Coats) -> list[Piece]:
    """A curved cage over the chain and the clamp that holds it to the seat tube."""
    r = pitch_radius(g.rings[0])
    angle = np.radians(np.linspace(62, 112, 9))
    plates: list[Solid] = []
    for side, (low, high) in ((-0.0075, (0.001, 0.024)), (0.012, (-0.006, 0.024))):
        inner, outer = ((r + h) * np.stack([np.cos(angle), np.sin(angle)], axis=1) for h in (low, high))
        sheet = across(_strip(inner, outer, 0.002))
        plates.append(moved(sheet, (-g.line + side, *at.bracket[1:])))
    height = r + 0.036
    post = at.on_seat(height)
    ring = rod(at.on_seat(height - 0.009), at.on_seat(height + 0.009), 0.0195 + 0.006 * (at.g.tube - 1), 16)
    arm = rod(post - (0.016, 0, 0), (-g.line - 0.002, post[1] - 0.004, post[2] - 0.016), 0.0075, 10)
    return [Piece("derailleur_front", coats.alloy, join(*plates)), Piece("derailleur_front", coats.black, join(ring, arm))]


def _strip(inner: Float, outer: Float, thickness: float) -> Solid:
    """A flat band between two open (N, 2) lines about z = 0, closed all around."""
    corners = ((inner, -0.5), (outer, -0.5), (outer, 0.5), (inner, 0.5))
    rings = np.stack([np.column_stack([line, np.full(len(line), z * thickness)]) for line, z in corners], axis=1)
    return loft(rings[::-1])


def _guard(at: Layout, g: Gears, coats: Coats) -> list[Piece]:
    """A ring outside the chainring, a shield over the upper run, or a case around the whole chain."""
    x = -g.line
    r = pitch_radius(g.rings[0])
    if g.guard == "none":
        return []
    if g.guard == "ring":
        shield = disc(r + 0.01, 0.003, r - 0.02, 64)
        return [Piece("chain_guard", coats.black, moved(shield, (x - 0.0085, *at.bracket[1:])))]
    (_, y, z), (_, end_y, end_z) = at.bracket, at.rear_axle
    front, rear = Pulley(y, z, r + 0.017), Pulley(end_y, end_z, pitch_radius(g.cogs[0]) + 0.021)
    outline = _belt(front, rear, full=g.guard == "case")
    shell = 0.0016
    if g.guard == "case":
        walls = [moved(across(plate(outline, shell)), (x + s, 0, 0)) for s in (-0.0195, 0.0115)]
        inner = between(at.bracket, at.rear_axle, 0.5)[1:]
        rim = across(moved(washer(inner + (outline - inner) * 0.985, outline, 0.032), (0, 0, x - 0.004)))
        return [Piece("chain_guard", coats.extra, join(*walls, rim))]
    inward = _belt(Pulley(front.y, front.z, front.radius - 0.036), Pulley(rear.y, rear.z, rear.radius - 0.026), full=False)
    lip = _belt(Pulley(front.y, front.z, front.radius - 0.0018), Pulley(rear.y, rear.z, rear.radius - 0.0018), full=False)
    face = moved(across(_strip(inward, outline, shell)), (x - 0.0135, 0, 0))
    roof = moved(across(_strip(lip, outline, 0.022)), (x - 0.0035, 0, 0))
    return [Piece("chain_guard", coats.extra, join(face, roof))]


def _belt(front: Pulley, rear: Pulley, full: bool) -> Float:
    """The outline (N, 2) of a belt around both pulleys: the whole belt, or most of the upper run with the front pulley's
    arc.
    """
    y, z = rear.y - front.y, rear.z - front.z
    tilt, bend = np.arctan2(z, y), np.arcsin((front.radius - rear.radius) / np.hypot(y, z))
    start = tilt + np.pi / 2 - bend
    arc = np.linspace(start, 2 * np.pi + tilt - np.pi / 2 + bend if full else np.radians(222), 26)
    around = _on(front, arc)
    if full:
        return np.concatenate([around, _on(rear, np.linspace(tilt - np.pi / 2 + bend, start, 14))])
    return np.concatenate([between(_on(rear, np.array([start])), around[:1], 0.32), around])


def _on(p: Pulley, angle: Float) -> Float:
    """Points (N, 2) of the pulley's rim."""
    return np.array((p.y, p.z)) + p.radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
