"""RiggedModel: a mesh bent by joints, with animations, as a GLB file that any glTF viewer plays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Mesh
from viewsphere.geometry.rotation import compose, rigid

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Pose:
    """The rotations of joints: `turns` (J, 3, 3) about each joint, in the axes of the joint above it. These are the axes of the
    mesh in the bind pose. `root` (3,) is the position of the first joint, metres.
    """

    turns: Float
    root: Float


@dataclass(frozen=True, eq=False)
class Clip:
    """An animation: a pose at each of some `seconds`, and further facts as plain data for a file's `extras`."""

    seconds: tuple[float, ...]
    poses: tuple[Pose, ...]
    extras: Mapping[str, Any] = field(default_factory=dict[str, Any])


@dataclass(frozen=True, eq=False)
class RiggedModel:
    """A mesh in its bind pose (object axes, metres) and its rig: names and `places` (J, 3) of joints, the joint above each (-1:
    none; parents first), the joints (V, 4) that move each vertex, and their weights (V, 4), which sum to 1. `rest` is the pose
    without an animation.
    """

    mesh: Mesh
    joints: tuple[str, ...]
    above: tuple[int, ...]
    places: Float
    vertex_joints: NDArray[np.int64]
    vertex_weights: Float
    rest: Pose
    clips: Mapping[str, Clip]

    def posed(self, pose: Pose) -> Float:
        """Return the positions (J, 3) of the joints in a pose."""
        return joints_at(self.places, self.above, pose)[:, :3, 3]


def joints_at(places: Float, above: tuple[int, ...], pose: Pose) -> Float:
    """Matrices (J, 4, 4) of joints in the mesh's axes: their rotations and positions."""
    found = list[Float]()
    for i, parent in enumerate(above):
        if parent < 0:
            found.append(rigid(pose.turns[i], pose.root))
        else:
            found.append(compose(found[parent], rigid(pose.turns[i], places[i] - places[parent])))
    return np.array(found)
