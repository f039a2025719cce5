"""Scenes whose pictures blur: shots with a shutter, and the same pictures averaged from many sharp ones."""

from __future__ import annotations

import math

import numpy as np
from test_raster import box, mesh_of

import viewsphere_zoo as zoo
from shots import still_shot
from viewsphere.assets.mesh import Material, Mesh
from viewsphere.codecs.srgb import encoded, linear
from viewsphere.engines import raster
from viewsphere.model.instant import Viewpoint
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Finish, Ground, Scene, Sun, ViewTransform
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.exposure import Exposure, Sweep
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Motion, Thing
from viewsphere.truth.raster.visibility import rasterize

LENS = Intrinsics(width=240, height=180, fx=210, fy=210, cx=120, cy=90)
FINISH = Finish(view=ViewTransform(exposure=-1.5))  # nothing is clipped, so that pictures can be averaged
NODES = np.linspace(-0.5, 0.5, 9)
SHUTTER = 0.5


def turned_y(angle, x=0.0, y=0.0, z=0.0):
    c, s = math.cos(angle), math.sin(angle)
    return ((c, 0.0, s, x), (0.0, 1.0, 0.0, y), (-s, 0.0, c, z), (0.0, 0.0, 0.0, 1.0))


def wheel() -> Mesh:
    """Spokes and a rim of blocks around y, 1 m in radius, in two colours."""
    parts = []
    for k in range(18):
        block = box((0.86, -0.12, -0.14), (1.0, 0.12, 0.14)) if k % 3 else box((0.1, -0.08, -0.05), (1.0, 0.08, 0.05))
        parts.append(block @ np.array(turned_y(2 * math.pi * k / 18))[:3, :3].T)
    mesh = mesh_of(np.concatenate(parts))
    colors = Material("a", (0.8, 0.15, 0.1, 1.0)), Material("b", (0.15, 0.3, 0.7, 1.0))
    material = ((np.arange(len(mesh.triangles)) // 12) % 2).astype(np.int32)
    return Mesh(**{**vars(mesh), "materials": colors, "triangle_material": material})


def meshes() -> dict[str, Mesh]:
    return {
        "wheel": wheel(),
        "car": zoo.build("car", np.random.default_rng(3)),
        "post": mesh_of(box((-0.12, -0.12, 0.0), (0.12, 0.12, 2.4)), Material("post", (0.7, 0.6, 0.1, 1.0))),
        "wall": mesh_of(box((-6.0, -0.1, 0.0), (6.0, 0.1, 0.6)), Material("wall", (0.5, 0.2, 0.15, 1.0))),
    }


def thing(number, key, poses):
    """A thing at NODES; the shot's pose is that of the middle."""
    spec = ModelSpec(key=key, source="memory", category="c", category_id=number)
    moves = len(poses) > 1
    own = Thing(id=number, model=spec, motion=Motion.still(poses[len(poses) // 2]))
    moments = tuple((NODES * SHUTTER).tolist())
    return own, Sweep(moments=moments, motion=Motion(poses=tuple(poses))) if moves else None


def spinning_wheel(pixels: float):
    radius = 59.0  # px, as seen
    spin = [thing(1, "wheel", [turned_y(pixels / radius * u, 0.0, 0.0, 1.1) for u in NODES])]
    still = [thing(2, "wall", [turned_y(0.0, 0.0, 1.6, 0.0)])]
    return shot_of([*spin, *still], Viewpoint(index=0, azimuth_deg=8, elevation_deg=8, distance=3.9), (0.0, 0.0, 1.0))


def passing_car(pixels: float):
    """Along x, before a wall and behind a post, with its shadow below."""
    per_metre = LENS.fx / 7.2
    c, s = 0.0, 1.0
    drive = [
        ((c, -s, 0.0, pixels / per_metre * u), (s, c, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0)) for u in NODES
    ]
    still = [thing(2, "post", [turned_y(0.0, 0.5, -1.6, 0.0)]), thing(3, "wall", [turned_y(0.0, 0.0, 1.8, 0.0)])]
    return shot_of(
        [thing(1, "car", drive), *still], Viewpoint(index=0, azimuth_deg=0, elevation_deg=9, distance=7.2), (0.0, 0.0, 0.8)
    )


def panning_camera(pixels: float):
    """A camera that turns on the spot, before a car, a post and a wall."""
    still = [
        thing(1, "car", [turned_y(0.0)]),
        thing(2, "post", [turned_y(0.0, 1.5, -1.8, 0.0)]),
        thing(3, "wall", [turned_y(0.0, 0.0, 3.0, 0.0)]),
    ]
    shot = shot_of(still, Viewpoint(index=0, azimuth_deg=15, elevation_deg=9, distance=7.2), (0.0, 0.0, 0.8), moves=False)
    pose = np.array(shot.instants[0].world_from_rig)
    turned = []
    for u in NODES:
        turn = np.array(turned_y(pixels / LENS.fx * u))
        turned.append(tuple(map(tuple, (pose @ turn).tolist())))
    sweep = Sweep(moments=tuple((NODES * SHUTTER).tolist()), motion=Motion(poses=tuple(turned)))
    exposure = Exposure(things=(None,) * 3, rig=sweep)
    return Shot.model_validate(shot.model_dump() | {"shutter": SHUTTER, "exposures": [exposure.model_dump()]})


def shot_of(both, view, focus, moves=True):
    things, sweeps = zip(*both, strict=True)
    scene = Scene(ground=Ground(), sun=Sun(azimuth=-40, elevation=42, angle_deg=0.6), floor=0.0)
    exposed = {"shutter": SHUTTER, "exposures": (Exposure(things=sweeps),)} if moves else {}
    return still_shot(things, LENS, [view], focus, scene=scene, finish=FINISH, sequence="s", **exposed)


SCENES = {"wheel": spinning_wheel, "car": passing_car, "pan": panning_camera}


def load(known):
    return lambda spec, step=None: known[spec.key]


def picture(shot: Shot, known) -> np.ndarray:
    stage = raster.stage(shot, load(known))
    return stage.paint(0, 0, rasterize(stage.at(0), shot.camera(0)), ("rgb",))["rgb"]


def sharp(shot: Shot, *moments: float) -> Shot:
    """What the shot shows at moments while its shutter is open, an instant each, without a shutter."""
    moments = moments or (0.0,)
    instants, poses = [], []
    for moment in moments:
        camera, pose = shot.camera_during(0, moment), np.eye(4)
        pose[:3, :3], pose[:3, 3] = camera.R.T, camera.center
        instants.append(shot.instants[0].model_copy(update={"world_from_rig": tuple(map(tuple, pose.tolist()))}))
        poses.append([thing.world_from_object for thing in shot.things_during(0, moment)])
    things = [
        each if len(set(own)) == 1 else each.model_copy(update={"motion": Motion(poses=own)})
        for each, own in zip(shot.things_during(0, moments[0]), zip(*poses, strict=True), strict=True)
    ]
    alone = {"shutter": 0.0, "exposures": (), "instants": tuple(instants), "things": tuple(things)}
    return shot.model_copy(update=alone)


def averaged(shot: Shot, known, count: int = 64) -> np.ndarray:
    """Sharp pictures at so many moments, averaged in linear light, (H, W, 3) float sRGB of 0 to 255."""
    total = np.zeros((LENS.height, LENS.width, 3))
    many = sharp(shot, *(((k + 0.5) / count - 0.5) * shot.shutter for k in range(count)))
    stage = raster.stage(many, load(known))
    for k in range(count):
        shown = stage.paint(k, 0, rasterize(stage.at(k), many.camera(k)), ("rgb",))["rgb"]
        total += linear(shown / 255.0)
    return encoded(total / count) * 255.0


def psnr(found, wanted, area) -> float:
    """Of pixels in an area (H, W) bool, dB."""
    return 10 * math.log10(255.0**2 / np.mean((found.astype(float) - wanted)[area] ** 2))
