"""The clothes of a person, random or given, as choices and as solids."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere_zoo.people import flesh
from viewsphere_zoo.people.build import Build
from viewsphere_zoo.people.fields import Field, ball, cells, grown, joined, limb, mirror, plane, steps, surface, trunk, within
from viewsphere_zoo.people.head import Head
from viewsphere_zoo.people.openings import opened
from viewsphere_zoo.people.skeleton import Skeleton
from viewsphere_zoo.shapes.cut import cut
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides

Top = Literal["t_shirt", "shirt", "jumper", "jacket"]
Bottom = Literal["trousers", "shorts", "skirt"]

CELL = 0.019
"""Size of a quad of cloth, metres."""


@dataclass(frozen=True)
class Outfit:
    """Garments and their colours (sRGB)."""

    top: Top = "t_shirt"
    bottom: Bottom = "trousers"
    top_color: Color = (0.2, 0.3, 0.5)
    bottom_color: Color = (0.15, 0.18, 0.26)
    shoe_color: Color = (0.12, 0.11, 0.1)
    sole_color: Color = (0.85, 0.84, 0.8)
    inner_color: Color = (0.8, 0.8, 0.78)

    @property
    def sleeve(self) -> float:
        """The end of the sleeves: 0 at the shoulder, 1 at the elbow, 2 at the wrist."""
        return {"t_shirt": 0.62, "shirt": 1.93, "jumper": 1.97, "jacket": 1.99}[self.top]

    @property
    def loose(self) -> float:
        """The distance of the top's cloth from the skin, metres."""
        return {"t_shirt": 0.010, "shirt": 0.011, "jumper": 0.015, "jacket": 0.021}[self.top]

    @property
    def leg(self) -> float:
        """The end of the legs of the bottom: 0 at the hip, 1 at the knee, 2 at the ankle."""
        return {"trousers": 2.0, "shorts": 0.86, "skirt": 0.95}[self.bottom]


@dataclass(frozen=True, eq=False)
class Tailor:
    """The maker of clothes for one body. `fold` (3,) holds the phases of the folds."""

    build: Build
    skeleton: Skeleton
    head: Head
    outfit: Outfit
    fold: Float

    @property
    def hem(self) -> float:
        """Height at which the top ends, metres."""
        share = {"t_shirt": 0.505, "shirt": 0.500, "jumper": 0.512, "jacket": 0.490}[self.outfit.top]
        return share * self.build.height

    @property
    def _ease(self) -> float:
        """The distance of the legs of the bottom from the skin, metres."""
        return {"trousers": 0.009, "shorts": 0.014, "skirt": 0.0}[self.outfit.bottom]

    @property
    def arm(self) -> Float:
        """Unit vector along the left upper arm."""
        return _unit(self.skeleton["L_Elbow"] - self.skeleton["L_Shoulder"])

    def cuff(self) -> tuple[Float, Float]:
        """Return the end of the left sleeve: a point and the direction down the arm."""
        s, t = self.skeleton, self.outfit.sleeve
        if t <= 1:
            return s["L_Shoulder"] + max(t, 0.10) * (s["L_Elbow"] - s["L_Shoulder"]), self.arm
        lower = s["L_Wrist"] - s["L_Elbow"]
        return s["L_Elbow"] + (t - 1) * lower, _unit(lower)

    def top(self) -> Solid:
        """Shirt, jumper or the like, with its openings."""
        b, s, h, o = self.build, self.skeleton, self.build.height, self.outfit
        rows = flesh.sections(b)
        rows = rows[rows[:, 0] > 0.44 * h]
        below = rows[:, 0] < 0.70 * h
        chest = rows[~below][0]
        hang = {"jacket": 0.75}.get(o.top, 0.5)
        for k in (1, 2, 3):  # cloth hangs from the chest rather than following the waist
            rows[below, k] += hang * np.maximum(0.97 * chest[k] - rows[below, k], 0)
        body = joined(0.04 * h, flesh.torso(b, s), trunk(rows))
        sleeve = flesh.arm(b, s, 0.004 if o.sleeve < 1.5 else 0.003)
        thighs = mirror(flesh.leg(b, s, self._ease + 0.004))
        body = joined(0.028 * h, joined(0.02 * h, body, thighs), mirror(sleeve))
        cloth = grown(body, lambda p: o.loose + self.folds(p) + 0.012 * np.clip((0.58 * h - p[:, 2]) / (0.07 * h), 0, 1))
        if o.top == "jacket":
            collar = limb(
                s["Neck"] + (0, 0.006 * h, -0.02 * h), s["Neck"] + (0, -0.004 * h, 0.024 * h), ((0, 0.052 * h), (1, 0.042 * h))
            )
            cloth = joined(0.02 * h, cloth, collar)
        if o.top == "jumper":
            hood = ball(s["Neck"] + (0, 0.034 * h, -0.014 * h), np.array((0.052, 0.026, 0.028)) * h)
            cloth = joined(0.018 * h, cloth, hood)
        reach = float(s["L_Hand"][0]) + 0.02
        solid = surface(cloth, cells((-reach, -0.22 * h, self.hem - 0.03), (reach, 0.2 * h, 0.90 * h), CELL))
        solid = opened(solid, self.hem - solid.vertices[:, 2], 0.03, 0.004)
        point, down = self.cuff()
        for side in (1, -1):
            q = solid.vertices * (side, 1, 1) - point
            along = (q * down).sum(axis=1)
            away = q - along[:, None] * down
            arm = 0.047 * h * (1 + 0.13 * b.weight) - np.sqrt((away * away).sum(axis=1))
            solid = opened(solid, np.minimum(along, arm), 0.05, 0.003)
        return opened(solid, self.neckline()(solid.vertices), 0.0, 0.003)

    def neckline(self) -> Field:
        """A field that is positive where the neck emerges from the top."""
        s, h, o = self.skeleton, self.build.height, self.outfit
        deep = {"t_shirt": 0.016, "shirt": 0.010, "jumper": 0.010, "jacket": -0.014}[o.top]
        wide = {"jacket": 0.058}.get(o.top, 0.043)
        front = s["Neck"] + (0, -0.040 * h, -(deep + 0.012) * h)
        back = s["Neck"] + (0, 0.034 * h, 0.004 * h if o.top != "jacket" else 0.022 * h)
        rise = (back[2] - front[2]) / (back[1] - front[1])

        def value(p: Float) -> Float:
            x, y = p[:, 0] / (wide * h), (p[:, 1] - s["Neck"][1]) / (0.050 * h)
            edge = front[2] + rise * (p[:, 1] - front[1]) + 0.02 * h * np.clip(np.abs(x), 0, 1) ** 2
            hole = 1 - np.sqrt(x * x + y * y)
            return np.minimum(p[:, 2] - edge, 0.045 * h * (hole + 0.35))

        return value

    def bottom(self) -> Solid:
        """Trousers, shorts or a skirt; they end under the top."""
        b, s, h, o = self.build, self.skeleton, self.build.height, self.outfit
        rows = flesh.sections(b)
        waist = rows[rows[:, 0] < 0.64 * h]
        if o.bottom == "skirt":
            return self._skirt(waist)
        hips = grown(trunk(waist), 0.003)
        hem = 0.035 * h if o.bottom == "trousers" else 0.0
        legs = mirror(flesh.leg(b, s, self._ease, hem))
        cloth = grown(joined(0.020 * h, hips, legs), lambda p: 0.003 + 0.8 * self.folds(p))
        wide = float(s["L_Hip"][0]) + 0.10 * h
        solid = surface(cloth, (steps(-wide, wide, CELL), steps(-0.16 * h, 0.16 * h, CELL), steps(-0.03, 0.66 * h, 0.021)))
        end = self.end_of_leg
        solid = opened(solid, solid.vertices[:, 2] - 0.575 * h, 0.0, 0.002)
        return opened(solid, end - solid.vertices[:, 2], 0.03, 0.003)

    @property
    def end_of_leg(self) -> float:
        """Height at which the legs of the bottom, or its skirt, end, metres."""
        s, t = self.skeleton, self.outfit.leg
        hip, knee, ankle = (float(s[name][2]) for name in ("L_Hip", "L_Knee", "L_Ankle"))
        return hip + t * (knee - hip) if t <= 1 else knee + (t - 1) * (ankle - knee) - 0.012

    def _skirt(self, waist: Float) -> Solid:
        h = self.build.height
        widest = waist[np.argmax(waist[:, 1])]
        end = self.end_of_leg
        hip = waist[waist[:, 0] >= widest[0]].copy()
        low = widest.copy()
        low[0], low[1:4] = end - 0.03, widest[1:4] * (1.16, 1.55, 1.32)
        cloth = grown(trunk(np.concatenate([low[None], hip]), 2.1), lambda p: 0.008 + self._pleats(p))
        solid = surface(cloth, cells((-0.2 * h, -0.18 * h, end - 0.12), (0.2 * h, 0.2 * h, 0.66 * h), CELL))
        solid = opened(solid, solid.vertices[:, 2] - 0.575 * h, 0.0, 0.002)
        return opened(solid, end - solid.vertices[:, 2], 0.06, 0.003)

    def _pleats(self, p: Float) -> Float:
        low = np.clip((0.53 * self.build.height - p[:, 2]) / 0.2, 0, 1)
        return 0.006 * low * np.sin(9 * np.arctan2(p[:, 0], p[:, 1]) + self.fold[0])

    def shoes(self) -> tuple[Solid, Solid]:
        """Uppers and soles of both shoes."""
        s, k = self.skeleton, self.build.height * (0.94 + 0.06 * self.build.male)
        x, y, _ = s["L_Ankle"].tolist()

        def at(dx: float, dy: float, z: float) -> Float:
            return np.array((x + (dx - 0.10 * dy) * k, y + dy * k, z * k))

        upper = joined(
            0.022 * k,
            ball(at(0, 0.006, 0.018), np.array((0.0225, 0.030, 0.026)) * k),
            ball(at(0.001, -0.045, 0.016), np.array((0.0245, 0.055, 0.022)) * k),
            ball(at(0.002, -0.086, 0.010), np.array((0.0275, 0.034, 0.0175)) * k),
            limb(at(0, 0.000, 0.030), at(0, -0.002, 0.052), ((0, 0.0235 * k), (1, 0.0235 * k))),
        )
        rim = 0.0125 * k
        shoe = grown(upper, lambda p: np.where(p[:, 2] < rim, 0.0022, 0.0) + 0.001)
        shoe = within(shoe, plane((0, 0, 0.0), (0, 0, -1)), 0.004)
        solid = surface(shoe, cells(at(-0.06, -0.16, -0.02), at(0.06, 0.07, 0.09), 0.0115))
        solid = opened(solid, solid.vertices[:, 2] - 0.052 * k, 0.012, 0.003)
        low, high = cut(solid, solid.vertices[:, 2] - rim)
        return both_sides(high), both_sides(low)

    def folds(self, p: Float) -> Float:
        """Folds of cloth, metres: across the belly, and where elbows and knees bend."""
        s, h = self.skeleton, self.build.height
        a, b, c = self.fold.tolist()
        belly = np.clip(1 - np.abs(p[:, 2] - 0.58 * h) / (0.13 * h), 0, 1)
        wave = np.sin(2 * np.pi * (p[:, 2] / 0.085 + 0.30 * np.sin(p[:, 0] * 11 + a) + 0.12 * np.sin(p[:, 1] * 17 + b)) + c)
        total = 0.0032 * belly * wave
        side = p * np.where(p[:, :1] < 0, (-1, 1, 1), (1, 1, 1))
        for joint, reach, size in (("L_Elbow", 0.085, 0.0030), ("L_Knee", 0.13, 0.0030), ("L_Ankle", 0.12, 0.0042)):
            q = side - s[joint]
            near = np.clip(1 - np.sqrt((q * q).sum(axis=1)) / (reach * h / 1.75 * 1.6), 0, 1)
            along = q[:, 2] * 0.85 - q[:, 0] * (0.5 if joint == "L_Elbow" else 0.1)
            total = total + size * near * np.sin(2 * np.pi * along / 0.048 + 1.3 * np.sin(q[:, 1] * 30 + b) + a)
        return total


def _unit(v: Float) -> Float:
    return v / np.sqrt((v * v).sum())
