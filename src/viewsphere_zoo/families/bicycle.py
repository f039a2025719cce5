"""Bicycles: road, mountain and step-through."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from viewsphere.assets.mesh import Mesh
from viewsphere.model.annotations.keypoints import At, sided
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.cycle import brakes, fittings
from viewsphere_zoo.cycle.coats import Coats, coats
from viewsphere_zoo.cycle.cockpit import clamp, cockpit_pieces
from viewsphere_zoo.cycle.cranks import crank_pieces
from viewsphere_zoo.cycle.design import STYLES, Bicycle, Style
from viewsphere_zoo.cycle.draws import draw
from viewsphere_zoo.cycle.forks import fork_pieces
from viewsphere_zoo.cycle.frames import Room, frame_pieces
from viewsphere_zoo.cycle.gears import STEP, gear_pieces
from viewsphere_zoo.cycle.layout import Layout
from viewsphere_zoo.cycle.saddle import saddle_pieces
from viewsphere_zoo.cycle.wheels import Hub, wheel_pieces
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.rods import between, shifted, unit
from viewsphere_zoo.shapes.solids import Float, moved, turned

KEYPOINTS = {
    "wheel_front": At("wheel_front_hub"),
    "wheel_rear": At("wheel_rear_hub"),
    "saddle": At("saddle", (0, 0, 1)),
    "headset": At("headset"),
    "bottom_bracket": At("bottom_bracket"),
    **sided("grip", "grip_{}", (1, 0, 0)),
    **sided("pedal", "pedal_{}"),
    "light_front": At("light_front", (0, -1, 0)),
    "light_rear": At("light_rear", (0, 1, 0)),
}
SKELETON = (
    ("wheel_front", "headset"),
    ("headset", "grip_left"),
    ("headset", "grip_right"),
    ("headset", "bottom_bracket"),
    ("bottom_bracket", "saddle"),
    ("bottom_bracket", "wheel_rear"),
    ("bottom_bracket", "pedal_left"),
    ("bottom_bracket", "pedal_right"),
    ("saddle", "wheel_rear"),
)

__all__ = ["STYLES", "Bicycle", "Style", "bicycle", "bicycle_random", "draw"]


def bicycle(parameters: Bicycle | None = None) -> Mesh:
    """The bicycle in metres: front towards -Y, upright, both wheels on z = 0, its box centred in x and y; chain on the right.

    Parts: frame, bottom_bracket, fork, headset, stem, handlebar, grip_*, seat_post, saddle, wheel_<end>_tyre, _rim, _spokes,
    _hub, chain, chainring, cassette, crank_*, pedal_*, and where fitted wheel_<end>_rotor and _reflector, brake_*,
    brake_lever_*, shifter_*, cable, derailleur_*, chain_guard, mudguard_*, carrier, basket, bag_*, bottle, bottle_cage,
    light_*, bell, kickstand, shock.
    """
    p = parameters or Bicycle()
    at, materials = Layout(p.geometry, p.wheel.radius), coats(p.colors, p.canvas)
    angle = float(np.radians(p.steering))
    front = [Piece(q.part, q.material, at.steered(q.solid, angle)) for q in _front(p, at, materials)]
    pieces = _grounded([*front, *_rear(p, at, materials)], at)
    low, high = (f([f(q.solid.vertices, axis=0) for q in pieces], axis=0) for f in (np.min, np.max))
    middle = (float(low[0] + high[0]) / 2, float(low[1] + high[1]) / 2, float(low[2]))
    return assemble([Piece(q.part, q.material, moved(q.solid, np.negative(middle))) for q in pieces], crease_deg=50)


def bicycle_random(rng: np.random.Generator) -> Mesh:
    """A bicycle with parameters drawn to resemble real bicycles."""
    return bicycle(draw(rng))


def _grounded(pieces: Sequence[Piece], at: Layout) -> list[Piece]:
    """The pieces pitched about the rear axle so that the steered front wheel and the rear wheel both touch the ground."""
    front, rear = (
        min(float(q.solid.vertices[:, 2].min()) for q in pieces if q.part == f"wheel_{end}_tyre") for end in ("front", "rear")
    )
    pitch = float(np.arctan2(front - rear, at.g.wheelbase))
    axle = at.rear_axle
    return [Piece(q.part, q.material, moved(turned(moved(q.solid, -axle), 0, pitch), axle)) for q in pieces]


def _room(p: Bicycle) -> Room:
    """The room that the wheels need between the stays."""
    outermost = p.gears.line + STEP * p.gears.on
    return Room(max(0.062, outermost + 0.0135), p.wheel.tyre / 2 + (0.0055 if p.guards == "none" else 0.0125))


def _hubs(p: Bicycle) -> tuple[Hub, Hub]:
    """Front and rear hub."""
    disc = p.brake == "disc"
    half = _room(p).half - 0.0055
    flange = 0.026 if disc else 0.0195
    front = Hub(0.05, 0.021 if disc else 0.033, -0.033, 0.036 if p.dynamo else flange, 0.033 if p.dynamo else 0.0105)
    if not p.gears.derailleur:
        fat = p.style == "step_through"
        return front, Hub(half, 0.032, -0.03, 0.043 if fat else 0.026, 0.037 if fat else 0.0115)
    right = -(p.gears.line - STEP * (len(p.gears.cogs) - 1 - p.gears.on) - 0.0095)
    return front, Hub(half, 0.03, right, flange + 0.002, 0.0125)


def _front(p: Bicycle, at: Layout, c: Coats) -> list[Piece]:
    """Return the pieces that turn with the handlebar, steering straight ahead."""
    w, axle = p.wheel, at.front_axle
    blades = unit(at.crown - axle)
    pieces = wheel_pieces(w, _hubs(p)[0], c, "wheel_front", 0.35)
    pieces += fork_pieces(at, p.fork, w, _room(p).clearance, c)
    pieces += cockpit_pieces(at, p.cockpit, c)
    pieces = [Piece(q.part, q.material, moved(q.solid, axle)) if q.part.startswith("wheel") else q for q in pieces]
    pieces += brakes.rim_brake(p.brake, w, axle, blades, -0.027, "brake_front", c)
    if p.brake == "disc":
        pieces += brakes.disc_caliper(w, axle, blades, -0.42, 0.039, "brake_front", c)
    if p.guards != "none":
        paint = c.frame if p.guards == "frame" else c.extra
        pieces += fittings.mudguard(w, axle, 62, 190, "mudguard_front", paint, c, 0.051)
    if p.basket != "none":
        pieces += fittings.basket_pieces(at, p.cockpit, p.basket, w, c)
    if p.lights:
        pieces += _lamp(p, at, c)
    return pieces


def _lamp(p: Bicycle, at: Layout, c: Coats) -> list[Piece]:
    """A front lamp, on the fork's crown, or in front of the bar of a sports bicycle."""
    if p.style == "step_through":
        place = at.crown + 0.02 * at.steering + (0, -0.085, 0)
        return fittings.front_light(place, at.crown - 0.004 * at.steering, 1.0, c)
    bar = shifted(clamp(at, p.cockpit), 0.055, 0, 0)
    return fittings.front_light(shifted(bar, 0, -0.05, 0.01), bar, 0.75, c)


def _rear(p: Bicycle, at: Layout, c: Coats) -> list[Piece]:
    """Return the pieces that stay with the frame when the bar turns."""
    w, axle, room, hub = p.wheel, at.rear_axle, _room(p), _hubs(p)[1]
    stays = unit(at.on_seat(p.geometry.seat_tube - (0.03 if p.frame.shape == "diamond" else 0.11)) - axle)
    wheel = wheel_pieces(w, hub, c, "wheel_rear", 1.2)
    pieces = [Piece(q.part, q.material, moved(q.solid, axle)) for q in wheel]
    pieces += frame_pieces(at, p.frame, w, room, c)
    pieces += gear_pieces(at, p.gears, hub, c)
    pieces += crank_pieces(at, p.gears, p.crank, float(np.radians(p.crank_angle)), p.crank_arms, p.pedal, c)
    pieces += saddle_pieces(at, p.saddle, c)
    pieces += brakes.rim_brake(p.brake, w, axle, stays, 0.022, "brake_rear", c)
    if p.brake == "disc":
        pieces += brakes.disc_caliper(w, axle, unit(at.bracket - axle), -0.5, hub.half - 0.011, "brake_rear", c)
    blades = unit(at.crown - at.front_axle)
    end = None if p.brake == "hub" else brakes.cable_end(p.brake, w, at.front_axle, blades, -0.027)
    if p.cockpit.levers:
        pieces += brakes.cables(at, p.cockpit, _cable_entry(p, at), end, float(np.radians(p.steering)), c)
    return pieces + _fitted(p, at, room, c)


def _cable_entry(p: Bicycle, at: Layout) -> tuple[Float, Float]:
    """Return the point where cables enter the frame, and their direction there.
    The point is in the down tube, or in the head tube above a bowed tube.
    """
    low, high = at.head
    if p.frame.shape in ("diamond", "mixte"):
        return shifted(between(low, at.bracket, 0.2), z=0.004), unit(at.bracket - low)
    return shifted(between(low, high, 0.4), y=0.004), unit((0.0, 1.0, -0.6))


def _fitted(p: Bicycle, at: Layout, room: Room, c: Coats) -> list[Piece]:
    """The rear's mudguard, luggage, lights and stand."""
    w, axle = p.wheel, at.rear_axle
    pieces: list[Piece] = []
    if p.guards != "none":
        paint = c.frame if p.guards == "frame" else c.extra
        pieces += fittings.mudguard(w, axle, 22, 202, "mudguard_rear", paint, c, room.half + 0.004)
    if p.carrier:
        pieces += fittings.carrier_pieces(at, w, room.half, c)
    if p.carrier and p.panniers:
        pieces += fittings.pannier_pieces(at, w, p.panniers > 1, c)
    if p.lights and not p.carrier:
        pieces += fittings.rear_light(at.on_seat(p.geometry.seat_tube + 0.045), at.seat, c)
    for k in range(p.bottles):
        pieces += fittings.bottle_pieces(at, k > 0, c)
    if p.saddle_bag:
        pieces += fittings.saddle_bag(at, c)
    if p.frame_bag:
        pieces += fittings.frame_bag(at, c)
    if p.kickstand:
        pieces += fittings.kickstand(at, c)
    return pieces


FAMILY = ZooFamily(
    random=bicycle_random,
    home="street",
    classes={"": "vehicle"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
