"""Proof that a sample's record says what its shot says: camera, viewpoint, split, time, and where its objects are.

Records beside their shots are made of these, but those that were merged stand for themselves, with numbers of their own.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np

from viewsphere.model.camera import Camera
from viewsphere.model.instant import Viewpoint
from viewsphere.model.sample import MERGED, Sample
from viewsphere.model.shot import Shot


def contradictions(sample: Sample, shot: Shot, place: int) -> Iterator[str]:
    """Yield the contradictions between a record and the sample at a place of its shot, counted from 0."""
    _, instant, sensor = next(islice(shot.samples, place, None))
    now, camera = shot.instants[instant], shot.camera(instant, sensor)
    if not _is_same_camera(sample.known_camera, camera):
        yield "expected the camera of the shot, found another"
    wanted, found = (pose and _unnumbered(pose) for pose in (shot.viewpoint(instant, sensor), sample.known_pose))
    if wanted != found:
        yield f"expected the pose {wanted} of the shot, found {found}"
    said = (sample.split, sample.sequence.partition(MERGED)[0], sample.sensor, sample.instant, sample.time)
    known = (now.split, shot.sequence, shot.rig.sensors[sensor].name, now.index, now.seconds)
    if said != known:
        yield f"expected split, sequence, sensor, instant and time {known} of the shot, found {said}"
    poses = {thing.id: pose for thing in shot.objects if (pose := thing.motion.at(instant)) is not None}
    if [o.id for o in sample.objects] != list(poses):
        yield f"expected the objects {list(poses)} of the shot, found {[o.id for o in sample.objects]}"
        return
    deforming = {thing.id for thing in shot.objects if thing.motion.step_at(instant)}
    for o in sample.objects:
        if not np.array_equal(o.world_from_object, poses[o.id]):
            yield f"object {o.id}: expected it where the shot has it, found it elsewhere"
        if bool(o.track) != (o.id in deforming):
            yield f"object {o.id}: expected {'a track' if o.id in deforming else 'no track'} by the shot, found {o.track!r}"


def _is_same_camera(one: Camera | None, other: Camera) -> bool:
    return (
        one is not None
        and one.intrinsics == other.intrinsics
        and np.array_equal(one.R, other.R)
        and np.array_equal(one.t, other.t)
    )


def _unnumbered(pose: Viewpoint) -> Viewpoint:
    """Merged data sets number poses anew."""
    return pose.model_copy(update={"index": 0})
