"""The joints of SURREAL's people, and their names in other rigs."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Naming = tuple[str, ...]

SMPL: Naming = (
    "Pelvis", "L_Hip", "R_Hip", "Spine1", "L_Knee", "R_Knee", "Spine2", "L_Ankle", "R_Ankle", "Spine3", "L_Foot", "R_Foot",
    "Neck", "L_Collar", "R_Collar", "Head", "L_Shoulder", "R_Shoulder", "L_Elbow", "R_Elbow", "L_Wrist", "R_Wrist",
    "L_Hand", "R_Hand",
)  # fmt: skip
MIXAMO: Naming = (
    "Hips", "LeftUpLeg", "RightUpLeg", "Spine", "LeftLeg", "RightLeg", "Spine1", "LeftFoot", "RightFoot", "Spine2",
    "LeftToeBase", "RightToeBase", "Neck", "LeftShoulder", "RightShoulder", "Head", "LeftArm", "RightArm", "LeftForeArm",
    "RightForeArm", "LeftHand", "RightHand", "LeftHandIndex1", "RightHandIndex1",
)  # fmt: skip
GAME_ENGINE: Naming = (
    "pelvis", "thigh_l", "thigh_r", "spine_01", "calf_l", "calf_r", "spine_02", "foot_l", "foot_r", "spine_03", "ball_l",
    "ball_r", "neck_01", "clavicle_l", "clavicle_r", "head", "upperarm_l", "upperarm_r", "lowerarm_l", "lowerarm_r",
    "hand_l", "hand_r", "middle_01_l", "middle_01_r",
)  # fmt: skip
NAMINGS = (SMPL, MIXAMO, GAME_ENGINE)
"""The names of the 24 joints in each rig, in SURREAL's order, which its body parts also follow."""

UNKNOWN = -1
"""The number of a part with none of these names."""

MOST_TOLD = 4
"""Number of names to list in a message."""

_PREFIX = re.compile(r"^(.*:|[mf]_avg_|mixamorig\d*_?)", re.IGNORECASE)
_FINGER = re.compile(r"thumb|index|middle|ring|pinky")


def joints(names: Sequence[str]) -> tuple[Naming, NDArray[np.intp]]:
    """Return the naming of a person's joints, and the indices of the 24 joints in `names`; raises ValueError with the missing
    joints.
    """
    places = {_plain(name): i for i, name in reversed([*enumerate(names)])}
    lacking = {naming: [name for name in naming if _plain(name) not in places] for naming in NAMINGS}
    best = min(NAMINGS, key=lambda naming: len(lacking[naming]))
    if lacking[best]:
        raise ValueError(f"expected a person's 24 joints as named points; found none called {_listed(lacking[best])}")
    return best, np.array([places[_plain(name)] for name in best])


def part_numbers(parts: Sequence[str], own: Naming) -> NDArray[np.int64]:
    """SURREAL's number of each part of a body, 1 to 24, preceded by 0 for none; `UNKNOWN` for names without a number.

    The naming of the rig with most of these names applies; if several rigs tie, `own`.
    """
    plain = [_plain(name) for name in parts]
    tables = [{_plain(name): i for i, name in enumerate(naming, 1)} for naming in (own, *NAMINGS)]
    best = max(tables, key=lambda table: sum(name in table for name in plain))
    return np.array([0, *(best.get(name, _finger(name)) for name in plain)], np.int64)


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", _PREFIX.sub("", name).lower())


def _finger(name: str) -> int:
    """The number of the end of a finger's hand."""
    if not _FINGER.search(name):
        return UNKNOWN
    return SMPL.index("L_Hand" if name.startswith("l") or name.endswith("l") else "R_Hand") + 1


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:MOST_TOLD]) + (", ..." if len(names) > MOST_TOLD else "")
