"""The motion of a USD file and its frames, read by usd-core."""

from __future__ import annotations

from typing import Any

from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.readers.usd.layers import opened
from viewsphere.assets.readers.usd.library import Usd, UsdGeom, UsdSkel


def timeline(folder: ModelFolder) -> dict[str, Any]:
    """First and last frame of a file, its frame rate, whether anything moves, and an empty list of animations, since USD has no
    named ones.
    """
    stage = opened(folder)
    first, last = int(stage.GetStartTimeCode()), int(stage.GetEndTimeCode())
    moves = last > first and any(_moves(prim) for prim in stage.Traverse(Usd.TraverseInstanceProxies()))
    return {"first": first, "last": last, "fps": float(stage.GetTimeCodesPerSecond()), "moves": moves, "clips": []}


def _moves(prim: Any) -> bool:
    """Return whether a prim's place, shape or visibility, or a skeleton's pose, changes with time."""
    if prim.IsA(UsdSkel.Animation):
        return any(attribute.ValueMightBeTimeVarying() for attribute in prim.GetAttributes())
    if prim.IsA(UsdGeom.Xformable) and UsdGeom.Xformable(prim).TransformMightBeTimeVarying():
        return True
    is_drawn = prim.IsA(UsdGeom.Gprim) or prim.IsA(UsdGeom.PointInstancer)
    attributes = prim.GetAttributes() if is_drawn else [prim.GetAttribute("visibility")]
    return any(attribute and attribute.ValueMightBeTimeVarying() for attribute in attributes)
