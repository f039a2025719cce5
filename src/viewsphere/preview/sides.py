"""A model from four sides."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import cast

import numpy as np

from viewsphere.assets.normalise import rotation
from viewsphere.composing.viewpoints.camera import looking
from viewsphere.errors import ModelError
from viewsphere.model.instant import Viewpoint
from viewsphere.model.model_spec import Axis, ModelSpec
from viewsphere.model.scene import Ground, Scene
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.rig import Rig
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing
from viewsphere.preview.frame import Picture
from viewsphere.preview.tiles import Tile, tiled
from viewsphere.run.shots.stages import Stages

SIDES = (("front", 0.0), ("left side", 90.0), ("back", 180.0), ("right side", 270.0))


def four_sides(spec: ModelSpec, axes: tuple[Axis, Axis] | None = None, size: int = 320) -> Picture:
    """A model from azimuth 0, 90, 180 and 270 at elevation 15, each view with its name; (H, W, 3) uint8 sRGB.

    With the file's axes that are up and forward now, each view also names the `forward` that would make it the front.

    The first view shows the front if the model faces -Y, as all labels assume.
    """
    shown = _views(Stages(), spec, tuple(SIDES), 15, size)
    tiles = [(rgb, _words(name, azimuth, axes)) for rgb, (name, azimuth) in zip(shown, SIDES, strict=True)]
    return tiled(tiles, columns=4)


def one_view_each(specs: Sequence[ModelSpec], size: int = 200) -> tuple[Picture | None, dict[str, str]]:
    """A sheet with one view of each model, from the front's left above, (H, W, 3) uint8 sRGB, and the reasons why models cannot
    be shown, by their keys; None if none can.
    """
    stages, tiles, faults = Stages(), list[Tile](), dict[str, str]()
    for spec in specs:
        try:
            (rgb,) = _views(stages, spec, (("", 30.0),), 25, size)
            tiles.append((rgb, f"{spec.category}: {spec.key}"))
        except ModelError as error:
            faults[spec.key] = str(error)
    return (tiled(tiles, columns=6) if tiles else None), faults


def _views(
    stages: Stages, spec: ModelSpec, sides: Sequence[tuple[str, float]], elevation_deg: float, size: int
) -> list[Picture]:
    """The pictures of a model that fills them, from these azimuths; raises ModelError if its file cannot be used."""
    low, high = stages.model(spec).bounds
    radius = float(np.linalg.norm(high - low)) / 2
    focal = 1.6 * size
    distance = radius / math.sin(math.atan(0.5 * size / focal)) * 1.02
    x, y, z = ((low + high) / 2).tolist()
    views = (
        Viewpoint(index=i, azimuth_deg=azimuth, elevation_deg=elevation_deg, distance=distance, category=name)
        for i, (name, azimuth) in enumerate(sides)
    )
    shot = Shot(
        key=spec.key,
        things=(Thing(id=1, model=spec),),
        rig=Rig.single(Intrinsics(width=size, height=size, fx=focal, fy=focal, cx=size / 2, cy=size / 2)),
        scene=Scene(ground=Ground()),
        instants=tuple(looking(view, (x, y, z), index=view.index) for view in views),
        channels=("rgb", "instances"),
    )
    return [sample.rgb for sample in stages.render(shot)]


def _words(side: str, azimuth_deg: float, axes: tuple[Axis, Axis] | None) -> str:
    """Return the name of the visible side, and the setting to write if this side is the front."""
    if axes is None:
        return f"{side} (azimuth {azimuth_deg:g})"
    return f"{side} (azimuth {azimuth_deg:g}); the front? forward: {facing(*axes, azimuth_deg)}"


def facing(up: Axis, forward: Axis, azimuth_deg: float) -> Axis:
    """The file's axis that looks at a camera at an azimuth which is a multiple of 90 degrees."""
    a = math.radians(azimuth_deg)
    direction = np.array([math.sin(a), -math.cos(a), 0.0]) @ rotation(up, forward, "axes")
    place = int(np.argmax(np.abs(direction)))
    return cast("Axis", ("+" if direction[place] > 0 else "-") + "xyz"[place])
