"""Hair as solids around a skull."""

from __future__ import annotations

from typing import Literal

import numpy as np

from viewsphere_zoo.people.fields import Field, ball, cells, grown, joined, limb, mirror, surface
from viewsphere_zoo.people.head import Head
from viewsphere_zoo.people.openings import opened
from viewsphere_zoo.shapes.solids import Float, Solid

Style = Literal["short", "crop", "side", "bob", "long", "ponytail", "bun", "curls", "bald"]

THICK = {
    "short": 0.013,
    "crop": 0.005,
    "side": 0.016,
    "bob": 0.014,
    "long": 0.013,
    "ponytail": 0.007,
    "bun": 0.008,
    "curls": 0.024,
}


CELL = 0.0092
"""Size of a quad of hair, metres."""


def hair(head: Head, style: Style, phase: float) -> Solid | None:
    """A head's hair; None for a bald head."""
    if style == "bald":
        return None
    s, line = head.size, hairline(head, style)
    field, low = grown(head.skull(), rise(head, style, phase)), -0.16
    hanging = falls(head, style, phase)
    if hanging is not None:
        field, low = joined(0.024 * s, field, hanging), {"bob": -0.13, "long": -0.25}.get(style, -0.17)
    solid = surface(field, cells(head.at(-0.14, -0.15, low - 0.04), head.at(0.14, 0.2, 0.17), CELL))
    return opened(solid, line(solid.vertices), 0.0, 0.003)


def rise(head: Head, style: Style, phase: float) -> Field:
    """Return the height of the hair above the skull, metres."""
    s, line = head.size, hairline(head, style)

    def height(p: Float) -> Float:
        near = np.clip(0.25 - line(p) / (0.026 * s), 0.12, 1)  # hair is thin where it begins to grow
        return near * s * (THICK[style] * _lift(head, p, style) + _strands(head, p, style, phase))

    return height


def falls(head: Head, style: Style, phase: float) -> Field | None:
    """Return the hanging or tied part of the hair; None without one."""
    s = head.size

    def with_locks(field: Field) -> Field:
        return grown(field, lambda p: _strands(head, p, style, phase) * s)

    if style in ("bob", "long"):
        low, wide = (-0.13, 0.068) if style == "bob" else (-0.25, 0.062)
        sides = limb(head.at(0.050, 0.040, 0.02), head.at(wide, 0.045, low + 0.035), ((0, 0.035 * s), (1, 0.030 * s)))
        back = limb(head.at(0, 0.070, 0.02), head.at(0, 0.075, low + 0.035), ((0, 0.042 * s), (1, 0.040 * s)))
        return with_locks(joined(0.03 * s, mirror(sides), back))
    if style == "ponytail":
        radii = ((0, 0.017 * s), (0.4, 0.026 * s), (1, 0.012 * s))
        bent = ((0, 0), (0.4, 0.02 * s), (1, 0))
        return with_locks(limb(head.at(0, 0.105, 0.050), head.at(0, 0.150, -0.110), radii, bent))
    if style == "bun":
        return with_locks(ball(head.at(0, 0.098, 0.085), 0.034 * s))
    return None


def hairline(head: Head, style: Style) -> Field:
    """The hairline as a field, positive where hair does not grow: face, ears and neck."""
    s = head.size

    def value(p: Float) -> Float:
        x, y, z = ((p - head.center) / s).T
        x = np.abs(x)
        # From the forehead over the temple, down in front of the ear, then behind it to the nape.
        forehead = 0.066 - 0.10 * np.clip(x - 0.030, 0, 1) + (0.010 if style == "crop" else 0.0)
        if style == "side":
            forehead = forehead - 0.012
        burn = -0.005 if style in ("short", "crop", "side", "curls") else 0.0
        front = forehead - z
        temple = np.clip((x - 0.038) / 0.022, 0, 1)
        beside = front + temple * (burn - z - front)
        edge = -0.048 + 0.0 * x
        share = np.clip((edge - y) / 0.018 + 0.5, 0, 1)
        face = np.minimum(np.where(share > 0, front * share + beside * (1 - share), beside), 0.05)
        nape = {"bob": -0.13, "long": -0.25, "ponytail": -0.085, "bun": -0.080}.get(style, -0.075)
        behind = nape - z
        ear = 0.026 - np.sqrt((y - 0.014) ** 2 + np.clip(np.abs(z + 0.014) - 0.016, 0, 1) ** 2)
        around = np.where((x > 0.045) & (style not in ("bob", "long")), ear, -1.0)
        back = np.clip((y + 0.020) / 0.02, 0, 1)
        if style in ("bob", "long"):
            back = np.clip((y + 0.012) / 0.012, 0, 1)
        value = face * (1 - back) + behind * back
        return np.maximum(around, value) * s

    return value


def _lift(head: Head, p: Float, style: Style) -> Float:
    """The hair's thickness as a share of the full one: less towards the neck, the temples and the forehead."""
    x, y, z = ((p - head.center) / head.size).T
    if style in ("bob", "long"):
        return np.clip(0.75 + 3 * z, 0.6, 1.15)
    full = np.clip((z + 0.075) / 0.10, 0.15, 1.0)
    if style in ("short", "side"):
        full = full * np.clip(0.80 + 4.5 * (z - 0.05), 0.45, 1.35) * np.clip(1.0 - 1.2 * (y - 0.02), 0.8, 1.15)
    if style == "side":
        full = full * (1 + 2.2 * np.clip(x, -0.12, 0.12))
    return full


def _strands(head: Head, p: Float, style: Style, phase: float) -> Float:
    """Locks, as heights: along the fall of the hair, or curls."""
    x, y, z = ((p - head.center) / head.size).T
    if style == "curls":
        return 0.0045 * np.sin(110 * x + phase) * np.sin(115 * y) * np.sin(105 * z + phase)
    if style == "crop":
        return np.zeros(len(p))
    turn = np.arctan2(x, y + 0.01)
    size = 0.0016 if style in ("short", "side") else 0.0012
    return size * np.sin(26 * turn + 2.0 * np.sin(40 * z + phase) + phase) + 0.0006 * np.sin(61 * turn + 31 * z + phase)
