"""The data set's numbers of poses: existing poses keep their numbers, new ones get the next numbers.

A pose is identified by a 64-bit digest of its name and its camera's position. Digests that follow from a part's recipe are not
stored, but computed when frames are appended: they would be larger than the rest of the plan.
"""

from __future__ import annotations

import hashlib
from base64 import b64decode, b64encode
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from viewsphere.composing.time_steps import TimedPoses
from viewsphere.composing.viewpoints.poses import ListedPoses, Poses
from viewsphere.composing.viewpoints.sequence_poses import SequencePoses, TrajectoryPoses, poses_of
from viewsphere.errors import StoreError
from viewsphere.model.fields.numbers import Natural
from viewsphere.recipe.cameras.sequence import TimeEntry
from viewsphere.recipe.cameras.viewpoints import Viewpoints
from viewsphere.store import Part, PlanRecord
from viewsphere.store.index import Ranges
from viewsphere.store.shots.records import typed

Indices = NDArray[np.int64]
Names = NDArray[np.uint64]

_VIEWPOINTS: TypeAdapter[Viewpoints] = TypeAdapter(Viewpoints)
_TIME, _SEED = TypeAdapter(TimeEntry), TypeAdapter(Natural)


def pose_names(views: Poses) -> Names:
    """The digest of every pose; the pose of a moving camera is identified by its whole motion."""
    moving = isinstance(views, SequencePoses) and isinstance(views.base, TrajectoryPoses)
    motion = (views.viewpoints.model_dump_json(), views.digest) if moving else ()
    shared = ("shared",) if views.are_shared else ()
    filled = () if views.are_known or moving else (views.fill,)
    known = (
        (views.name(i), tuple(views.view(i)), views.target(i), *motion, *shared, *(fill(i) for fill in filled))
        for i in range(len(views))
    )
    digests = (hashlib.blake2b(repr(one).encode(), digest_size=8).digest() for one in known)
    return np.frombuffer(b"".join(digests), np.dtype("<u8"))


def follows_from_recipe(views: Poses) -> bool:
    """Return whether the recipe alone determines these poses, without any file."""
    plain = views.base if isinstance(views, SequencePoses) else views
    return not isinstance(plain, ListedPoses | TimedPoses) and not plain.digest


def joined_digests(names: Names) -> str:
    """Digests as stored in a part's `pose_names`."""
    return b64encode(names.tobytes()).decode()


def names_of(there: PlanRecord) -> Names:
    """The digest of every pose of a data set by its number; 0 for unknown ones."""
    known = np.zeros(0, np.dtype("<u8"))
    for part in there.parts:
        if part.pose_names is not None:
            new = np.frombuffer(b64decode(part.pose_names), np.dtype("<u8"))
        else:
            new = _unknown(pose_names(_views(part)), known) if part.new_poses else known[:0]
        known = np.concatenate([known, new])
    return known


def numbered(there: PlanRecord, views: Poses) -> tuple[Sequence[int], Names]:
    """The data set's number of every pose, with the next numbers for new ones; and the digests of the new ones."""
    if not there.poses:
        return range(len(views)), np.zeros(0, np.dtype("<u8")) if follows_from_recipe(views) else pose_names(views)
    wanted, known = pose_names(views), names_of(there)
    new = _unknown(wanted, known)
    number_of: dict[int, int] = {}
    for number, name in enumerate((*known.tolist(), *new.tolist())):
        number_of.setdefault(name, number)
    return [number_of[name] for name in wanted.tolist()], new


def has_poses_of(there: PlanRecord, views: Poses) -> bool:
    """Return whether the data set has these poses in this order, judging by its recipe alone."""
    brought = [part for part in there.parts if part.new_poses]
    if len(brought) != 1 or brought[0].pose_names is not None or not follows_from_recipe(views):
        return False
    return there.poses == len(views) and _views(brought[0]) == views


def as_ranges(numbers: Indices) -> Ranges:
    """Ascending numbers as ranges [first, stop)."""
    if not len(numbers):
        return ()
    gaps = np.flatnonzero(numbers[1:] - numbers[:-1] > 1)
    firsts, lasts = np.append(numbers[:1], numbers[gaps + 1]), np.append(numbers[gaps], numbers[-1:])
    return tuple(zip(firsts.tolist(), (lasts + 1).tolist(), strict=True))


def _views(part: Part) -> Poses:
    """The poses of a part, from its recipe; raises StoreError if the recipe was changed to an invalid one."""
    recipe: dict[str, Any] = part.recipe
    time = recipe.get("time")
    try:
        viewpoints = typed(_VIEWPOINTS, recipe["viewpoints"])
        return poses_of(viewpoints, time and typed(_TIME, time), typed(_SEED, recipe["seed"]))
    except (LookupError, ValueError) as error:
        raise StoreError(
            f"plan.json: recipe {part.name!r:.100}: expected the viewpoints from which poses follow, found "
            f"{type(error).__name__}: {error}: render the recipe anew"
        ) from None


def _unknown(wanted: Names, known: Names) -> Names:
    """Return the wanted names that are not known, each once, in their order."""
    seen = set[int](known.tolist())
    new = [name for name in dict.fromkeys(wanted.tolist()) if name not in seen]
    return np.array(new, np.dtype("<u8"))
