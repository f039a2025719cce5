"""Skins of a USD file: meshes bent by their skeletons, and each point's joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from viewsphere.assets.primitive import Float
from viewsphere.assets.readers.shared.named_points import NamedPoint
from viewsphere.assets.readers.usd.library import Gf, Usd, UsdGeom, UsdSkel
from viewsphere.assets.readers.usd.mesh import Influences


def skins_of(stage: Any, time: Any) -> tuple[dict[str, Influences], list[NamedPoint]]:
    """The skins of meshes, by the meshes' paths, and the skeletons' joints in the world; afterwards, the stage's meshes are
    skinned.

    The stage's session layer receives the skinned points.
    """
    influences, joints = dict[str, Influences](), list[NamedPoint]()
    roots = [prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Root)]
    if not roots:
        return influences, joints
    cache, places = UsdSkel.Cache(), UsdGeom.XformCache(time)
    for root in map(UsdSkel.Root, roots):
        cache.Populate(root, Usd.PrimDefaultPredicate)
        for binding in cache.ComputeSkelBindings(root, Usd.PrimDefaultPredicate):
            query = cache.GetSkelQuery(binding.GetSkeleton())
            if binding.GetSkinningTargets() and query:
                joints.extend(_joints(query, places, time, len(joints)))
            for target in binding.GetSkinningTargets():
                said = _influences(target, query, time)
                if said is not None:
                    influences[str(target.GetPrim().GetPath())] = said
    stage.SetEditTarget(stage.GetSessionLayer())
    instant = Gf.Interval() if time.IsDefault() else Gf.Interval(time.GetValue(), time.GetValue())
    for root in map(UsdSkel.Root, roots):
        UsdSkel.BakeSkinning(root, instant)
    return influences, joints


def _influences(target: Any, query: Any, time: Any) -> Influences | None:
    points = UsdGeom.PointBased(target.GetPrim()).GetPointsAttr().Get(time)
    if not target.HasJointInfluences() or points is None:
        return None
    found = target.ComputeVaryingJointInfluences(len(points), time)
    order = target.GetJointOrder() or (query.GetJointOrder() if query else None)
    if not found or not order:
        return None
    joints, weights = (np.asarray(array) for array in found)
    width = target.GetNumInfluencesPerComponent()
    return Influences(_names(order), joints.reshape(-1, width).astype(np.int64), weights.reshape(-1, width).astype(np.float64))


def _names(order: Sequence[Any]) -> tuple[str, ...]:
    """Unique names of joints: the last part of their paths, or the whole path if two share the last part."""
    paths = [str(path) for path in order]
    lasts = [path.rpartition("/")[2] for path in paths]
    return tuple(last if lasts.count(last) == 1 else path for last, path in zip(lasts, paths, strict=True))


def _joints(query: Any, places: Any, time: Any, first: int) -> list[NamedPoint]:
    """The joints of a skeleton, each below its parent."""
    world = np.array(places.GetLocalToWorldTransform(query.GetPrim())).T
    matrices = query.ComputeJointSkelTransforms(time) or ()
    topology, names = query.GetTopology(), _names(query.GetJointOrder())
    found = list[NamedPoint]()
    for i, (name, matrix) in enumerate(zip(names, matrices, strict=False)):
        place: Float = (world @ np.array(matrix).T)[:3, 3]
        parent = topology.GetParent(i)
        found.append(NamedPoint(name, place, None if parent < 0 else first + parent))
    return found
