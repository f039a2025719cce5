"""Named points of model families, located by the names of the models' parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import cast

import numpy as np

from viewsphere.assets.mesh import Mesh
from viewsphere.model.annotations.keypoints import At, Keypoints, Pair, Place, left_and_right


def part_points(mesh: Mesh, places: Mapping[str, At], skeleton: Sequence[Pair] = ()) -> Keypoints | None:
    """The points of a mesh, in its axes, for the parts that it has, and the lines between them; None without any."""
    found = {name: place for name, at in places.items() if (place := _place(mesh, at)) is not None}
    if not found:
        return None
    lines = tuple(pair for pair in skeleton if found.keys() >= {*pair})
    return Keypoints(points=found, skeleton=lines, flips=left_and_right(found))


def _place(mesh: Mesh, at: At) -> Place | None:
    part = next((mesh.parts.index(name) for name in at.parts.split("|") if name in mesh.parts), None)
    if part is None:
        return None
    corners = mesh.vertices[mesh.triangles[mesh.triangle_part == part]].astype(np.float64).reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    place = (low + high) / 2 + np.array(at.where) * (high - low) / 2
    if np.count_nonzero(at.where) > 1:
        place = corners[((corners - place) ** 2).sum(axis=1).argmin()]
    return cast("Place", tuple(place.tolist()))
