"""Point tracks of a sequence, joined from its samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import StoreError
from viewsphere.labels.tracks import in_camera, positions
from viewsphere.model.sample import Sample

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PointTracks:
    """N points that one sensor followed through the T finished instants of a sequence.

    Attributes:
        ids: (N,) int64, numbers of the points, in the order of the queries.
        query: (N, 3) float64, the instant and the pixel (x, y) at which each point was picked.
        object: (N,) int32, id of the object at the point; 0 for none.
        xy: (T, N, 2) float64, pixels; NaN for points without a position.
        xyz: (T, N, 3) float64, metres in the camera's axes; (NaN, NaN, inf) for points of the sky, else NaN without a
            position.
        world: (T, N, 3) float64, metres in the world; NaN for points of the sky and without a position.
        state: (T, N) uint8, 0 visible, 1 occluded, 2 outside, 3 behind, 4 invalid.
        instants: (T,) int64, numbers of the instants.
    """

    ids: NDArray[np.int64]
    query: Float
    object: NDArray[np.int32]
    xy: Float
    xyz: Float
    world: Float
    state: NDArray[np.uint8]
    instants: NDArray[np.int64]


def joined(samples: Sequence[Sample]) -> PointTracks:
    """The tracks of one sensor's samples of one sequence, instant by instant; raises StoreError if samples have no tracks, or
    follow different points.
    """
    rows = [sample.channels.get("tracks") for sample in samples]
    known = [row for row in rows if row is not None]
    if not known or len(known) < len(rows):
        raise StoreError("tracks: expected samples with points that are followed; found none: set tracks in the recipe")
    first = known[0]
    for sample, row in zip(samples, known, strict=True):
        if not all(np.array_equal(row[name], first[name]) for name in ("instant", "query", "object")):
            raise StoreError(f"tracks: frame {sample.index} has other points than its sequence")
    parts = [_in_picture(sample) for sample in samples]
    xy, xyz, world = (np.stack([part[k] for part in parts]) for k in range(3))
    return PointTracks(
        ids=np.arange(len(first)),
        query=np.column_stack((first["instant"].astype(np.float64), first["query"])),
        object=first["object"].copy(),
        xy=xy,
        xyz=xyz,
        world=world,
        state=np.stack([row["state"] for row in known]),
        instants=np.array([sample.instant for sample in samples], np.int64),
    )


def _in_picture(sample: Sample) -> tuple[Float, Float, Float]:
    """Return the positions of a sample's points: in its picture (N, 2), in its camera's axes and in the world, (N, 3) each."""
    point, xyz = sample.channels["tracks"]["point"], in_camera(sample)
    is_sky = point[:, 3] == 0.0
    xyz[is_sky] = (np.nan, np.nan, np.inf)
    return positions(sample), xyz, np.where(is_sky[:, None], np.nan, point[:, :3])
