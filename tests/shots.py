"""Shots of what stands still, built by hand, and the pictures that any camera takes of them."""

import numpy as np

from viewsphere.composing.viewpoints.camera import looking
from viewsphere.geometry.box3d import Box3d
from viewsphere.model.instant import Instant, Viewpoint
from viewsphere.model.scene import IDENTITY, Finish, Scene
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.model.sensors.rig import Rig
from viewsphere.model.shot import Shot
from viewsphere.truth.raster.visibility import rasterize

SMALL = Intrinsics(width=8, height=8, fx=8, fy=8, cx=4, cy=4)
AHEAD = Viewpoint(index=0, azimuth_deg=0, elevation_deg=0, distance=1)


def unit_box(_, step=None):
    """The box of any model."""
    return Box3d.between((-0.5,) * 3, (0.5,) * 3).corners


def still_shot(things, lens=SMALL, viewpoints=(AHEAD,), focus=(0, 0, 0), split="train", finish=None, **more) -> Shot:
    """A shot from these viewpoints, which look at `focus` unless they have targets of their own."""
    more = {"key": "shot", "scene": Scene(), "channels": ("rgb",)} | more
    instants = (looking(v, tuple(focus), index=v.index, split=split, finish=finish) for v in viewpoints)
    return Shot(things=tuple(things), rig=Rig.single(lens), instants=tuple(instants), **more)


def camera_of(lens: Intrinsics, viewpoint: Viewpoint, focus=(0, 0, 0)) -> Camera:
    return still_shot((), lens, (viewpoint,), focus).camera(0)


def with_camera(shot: Shot, camera: Camera, finish: Finish | None = None) -> Shot:
    """The shot with this camera alone; its focus is that of the shot's first instant."""
    first = shot.instants[0]
    rows = np.column_stack([camera.R.T, camera.center]).tolist()
    now = Instant(index=0, world_from_rig=(*map(tuple, rows), IDENTITY[3]), focus=first.focus, finish=finish or first.finish)
    return shot.model_copy(update={"rig": Rig.single(camera.intrinsics), "instants": (now,)})


def painted(stage, camera: Camera, finish: Finish | None = None, transparent: bool = False) -> np.ndarray:
    """What a camera sees on a stage of any engine."""
    own = stage.for_shot(with_camera(stage.shot, camera, finish))
    name = "rgba" if transparent else "rgb"
    return own.paint(0, 0, rasterize(own.at(0), own.shot.camera(0)), (name,))[name]
