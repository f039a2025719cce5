"""The naked body as fields, by the regions that garments cover: trunk, arms, legs, hands. Positions come from the skeleton."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from viewsphere_zoo.people.build import Build
from viewsphere_zoo.people.fields import Field, ball, joined, limb, mirror, trunk
from viewsphere_zoo.people.skeleton import Skeleton
from viewsphere_zoo.shapes.solids import Float

MAN = np.array([
    # height, half width, front, behind, middle (of the height 1)
    (0.455, 0.070, 0.046, 0.050, 0.012), (0.480, 0.089, 0.053, 0.064, 0.010), (0.510, 0.098, 0.056, 0.066, 0.008),
    (0.545, 0.095, 0.057, 0.058, 0.008), (0.590, 0.087, 0.056, 0.052, 0.008), (0.630, 0.084, 0.057, 0.051, 0.009),
    (0.680, 0.091, 0.062, 0.055, 0.010), (0.725, 0.098, 0.067, 0.062, 0.010), (0.765, 0.099, 0.062, 0.065, 0.012),
    (0.795, 0.086, 0.050, 0.058, 0.014), (0.820, 0.062, 0.038, 0.043, 0.016), (0.842, 0.040, 0.032, 0.034, 0.014),
    (0.870, 0.034, 0.032, 0.032, 0.008),
])  # fmt: skip
WOMAN = np.array([
    (0.455, 0.076, 0.044, 0.050, 0.012), (0.480, 0.097, 0.052, 0.068, 0.010), (0.510, 0.104, 0.054, 0.070, 0.008),
    (0.545, 0.097, 0.054, 0.059, 0.008), (0.590, 0.078, 0.051, 0.047, 0.008), (0.630, 0.072, 0.050, 0.045, 0.009),
    (0.680, 0.078, 0.053, 0.049, 0.010), (0.725, 0.085, 0.058, 0.054, 0.011), (0.765, 0.087, 0.054, 0.056, 0.012),
    (0.795, 0.076, 0.044, 0.050, 0.014), (0.820, 0.052, 0.034, 0.037, 0.015), (0.842, 0.034, 0.028, 0.029, 0.013),
    (0.870, 0.029, 0.027, 0.027, 0.008),
])  # fmt: skip


def sections(b: Build) -> Float:
    """Rows of `fields.trunk`, metres: the trunk's cross-sections from the crotch to the neck."""
    rows = WOMAN + b.male * (MAN - WOMAN)
    belly = np.clip(1 - np.abs(rows[:, 0] - 0.575) / 0.13, 0, 1)
    fat = b.weight * np.where(rows[:, 0] > 0.80, 0.06, 0.09 + 0.13 * belly)
    rows[:, 1:4] *= 1 + fat[:, None]
    rows[:, 2] *= 1 + 0.22 * belly * max(b.weight, 0)
    return rows * b.height


def torso(b: Build, s: Skeleton) -> Field:
    """The trunk with its shoulders, and with breasts depending on the build."""
    h = b.height
    body = joined(0.045 * h, trunk(sections(b)), mirror(_shoulder(b, s)))
    size = (1 - b.male) * (0.034 + 0.006 * b.weight) * h
    if size < 0.01 * h:
        chest = ball((0.046 * h, -0.040 * h, 0.742 * h), (0.042 * h, 0.022 * h, 0.030 * h))
        return joined(0.03 * h, body, mirror(chest))
    return joined(0.022 * h, body, mirror(ball((0.043 * h, -0.044 * h, 0.718 * h), (size, size, 1.05 * size))))


def _shoulder(b: Build, s: Skeleton) -> Field:
    """The shoulder from the neck to the joint, along the collar bone, and the muscle over it."""
    h, thick = b.height, 0.021 + 0.004 * b.male
    bone = limb(
        (0.010 * h, 0.014 * h, 0.818 * h), s["L_Shoulder"] - (0.014 * h, 0, 0.006 * h), ((0, 0.024 * h), (1, thick * h))
    )
    blade = ball((0.052 * h, 0.044 * h, 0.765 * h), (0.036 * h, 0.022 * h, 0.045 * h))
    return joined(0.03 * h, bone, blade)


def arm(b: Build, s: Skeleton, loose: float = 0.0) -> Field:
    """The left arm, from its shoulder to its wrist, thickened by this many metres."""
    h = b.height
    k = h * (0.92 + 0.10 * b.male) * (1 + 0.13 * b.weight)
    upper = ((0, 0.0245 * k), (0.2, 0.0285 * k), (0.5, 0.0270 * k), (1, 0.0228 * k))
    lower = ((0, 0.0232 * k), (0.22, 0.0250 * k), (0.6, 0.0200 * k), (1, 0.0152 * k))
    return joined(
        0.012 * h,
        limb(s["L_Shoulder"], s["L_Elbow"], _thicker(upper, loose)),
        limb(s["L_Elbow"], s["L_Wrist"], _thicker(lower, loose)),
    )


def leg(b: Build, s: Skeleton, loose: float = 0.0, hem: float = 0.0) -> Field:
    """The left leg, from its hip to its ankle, thickened by this many metres, and at the ankle by at least `hem`."""
    h = b.height
    k = h * (1 + 0.11 * b.weight)
    thigh = ((0, (0.0585 - 0.002 * b.male) * k), (0.3, (0.0545 - 0.003 * b.male) * k), (0.65, 0.0435 * k), (1, 0.0338 * k))
    shank = ((0, 0.0335 * k), (0.25, 0.0350 * k), (0.5, 0.0310 * k), (0.8, 0.0225 * k), (1, 0.0205 * k))
    wide = tuple((t, max(r + loose, hem)) for t, r in shank)
    return joined(
        0.015 * h,
        limb(
            s["L_Hip"] + (0, 0.004 * h, 0.01 * h),
            s["L_Knee"],
            _thicker(thigh, loose),
            ((0, 0.004 * h), (0.5, -0.002 * h), (1, 0)),
        ),
        limb(s["L_Knee"], s["L_Ankle"], wide, ((0, 0), (0.3, 0.010 * h), (0.7, 0.006 * h), (1, 0))),
    )


def _thicker(knots: ArrayLike, by: float) -> Float:
    return np.asarray(knots, np.float64) + np.array((0, by))


def hand(b: Build, s: Skeleton) -> Field:
    """The left hand, at rest: fingers a little bent."""
    k = b.height * (0.95 + 0.07 * b.male)
    along = s["L_Hand"] - s["L_Wrist"]
    along = along / np.sqrt((along * along).sum())
    inward = np.array([along[2], 0.0, -along[0]])  # towards the thigh when the arm hangs
    front = np.array([0.0, -1.0, 0.0])

    def at(a: float, f: float, n: float) -> Float:
        return s["L_Wrist"] + k * (a * along + f * front + n * inward)

    turn = np.stack([along, front, inward])
    palm = joined(
        0.014 * k,
        limb(at(-0.01, 0, 0), at(0.02, 0, 0), ((0, 0.0148 * k), (1, 0.0150 * k))),
        ball(at(0.030, 0.001, 0.002), np.array((0.032, 0.0225, 0.0105)) * k, turn),
        ball(at(0.042, 0.0, 0.001), np.array((0.018, 0.0245, 0.0090)) * k, turn),
    )
    fingers = []
    for place, reach, size in (
        (0.0165, 0.041, 0.0050),
        (0.0055, 0.046, 0.0052),
        (-0.0058, 0.042, 0.0050),
        (-0.0165, 0.033, 0.0045),
    ):
        knuckle, middle = at(0.050, place, 0.0), at(0.050 + 0.52 * reach, 1.10 * place, 0.004)
        tip = at(0.050 + 0.92 * reach, 1.12 * place, 0.4 * reach)
        first = limb(knuckle, middle, ((0, 1.06 * size * k), (1, size * k)))
        fingers.append(joined(0.004 * k, first, limb(middle, tip, ((0, size * k), (1, 0.8 * size * k)))))
    thumb = joined(
        0.006 * k,
        limb(at(0.012, 0.012, 0.004), at(0.036, 0.029, 0.010), ((0, 0.0095 * k), (1, 0.0068 * k))),
        limb(at(0.036, 0.029, 0.010), at(0.057, 0.031, 0.016), ((0, 0.0064 * k), (1, 0.0052 * k))),
    )
    return joined(0.009 * k, joined(0.0025 * k, palm, *fingers), thumb)


def bare_foot_place(s: Skeleton) -> Float:
    """Return the place of the left foot's shoe: the point on the ground under its ankle (3,)."""
    return s["L_Ankle"] * (1, 1, 0)
