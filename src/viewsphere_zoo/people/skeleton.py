"""A person's 24 joints: in the order and with the names of SMPL (Loper et al. 2015) and SURREAL, at viewsphere's own
positions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere_zoo.people.build import Build
from viewsphere_zoo.shapes.solids import Float

JOINTS = (
    "Pelvis", "L_Hip", "R_Hip", "Spine1", "L_Knee", "R_Knee", "Spine2", "L_Ankle", "R_Ankle", "Spine3", "L_Foot", "R_Foot",
    "Neck", "L_Collar", "R_Collar", "Head", "L_Shoulder", "R_Shoulder", "L_Elbow", "R_Elbow", "L_Wrist", "R_Wrist",
    "L_Hand", "R_Hand",
)  # fmt: skip
PARENTS = (-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21)

SPLAY = 45.0
"""Degrees between the arms of the bind pose and the vertical: keeps the flesh of arm and chest apart, like that of the two
legs.
"""


@dataclass(frozen=True, eq=False)
class Skeleton:
    """`places` (24, 3) of the joints in the bind pose: metres, up +Z, front -Y, the person's left at +X, soles on z = 0."""

    places: Float

    def __getitem__(self, name: str) -> Float:
        """The place (3,) of a joint."""
        return self.places[JOINTS.index(name)]


def skeleton(b: Build) -> Skeleton:
    """The joints of a person of this build."""
    h, male = b.height, b.male
    hip, shoulder = (0.051 - 0.002 * male) * h, (0.092 + 0.012 * male) * h
    leg = b.leg * h
    arm = np.array([np.sin(np.radians(SPLAY)), 0.0, -np.cos(np.radians(SPLAY))])
    ankle = 0.045 * h
    knee = ankle + 0.505 * (leg - ankle)
    s = np.array([shoulder, 0.012 * h, 0.806 * h])
    elbow = s + 0.166 * h * arm + (0, 0.006 * h, 0)
    wrist = elbow + 0.146 * h * arm + (0, -0.010 * h, 0)
    left = {
        "Hip": (hip, 0.004 * h, leg),
        "Knee": (hip + 0.020 * h, -0.002 * h, knee),
        "Ankle": (hip + 0.040 * h, 0.014 * h, ankle),
        "Foot": (hip + 0.046 * h, -0.066 * h, 0.014 * h),
        "Collar": (0.038 * h, 0.005 * h, 0.795 * h),
        "Shoulder": s,
        "Elbow": elbow,
        "Wrist": wrist,
        "Hand": wrist + 0.050 * h * arm,
    }
    middle = {
        "Pelvis": (0, 0, leg + 0.025 * h),
        "Spine1": (0, 0.008 * h, 0.600 * h),
        "Spine2": (0, 0.012 * h, 0.665 * h),
        "Spine3": (0, 0.014 * h, 0.725 * h),
        "Neck": (0, 0.012 * h, 0.838 * h),
        "Head": (0, 0.002 * h, 0.890 * h),
    }
    places = [
        np.array(middle[name], np.float64)
        if name in middle
        else np.array(left[name[2:]], np.float64) * (1 if name.startswith("L") else -1, 1, 1)
        for name in JOINTS
    ]
    return Skeleton(np.round(np.array(places), 6))
