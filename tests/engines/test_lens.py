"""Lenses that bend: labels and colour against Embree's rays along the same table, the main job's tolerances.

Also lenses that see behind themselves. Ties and grazed edges are set aside and counted, as `truth/test_embree.py` does.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from quick import quick
from shots import painted, still_shot
from viewsphere.assets.mesh import Material
from viewsphere.codecs.srgb import encoded, linear
from viewsphere.engines import raster
from viewsphere.geometry.camera import pixel_rays, project
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.labels import observe
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Background, Finish, Scene, ViewTransform
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.model.thing import Motion, Thing
from viewsphere.truth.raster.visibility import rasterize

pytest.importorskip("embreex")

WIDTH, HEIGHT = 240, 200
LENSES = {
    "barrel": (60, lens_parameters("brown_conrady", coefficients=(-0.21, 0.06, 0.001, -0.002, -0.004))),
    "pincushion": (60, lens_parameters("brown_conrady", coefficients=(0.3, 0.1, -0.002, 0.001))),
    "rational": (60, lens_parameters("brown_conrady", coefficients=(0.4, 0.05, -0.001, 0.0007, 0.01, 0.6, 0.12, 0.02))),
    "fisheye 170": (170, lens_parameters("fisheye", coefficients=(0.03, -0.004, 0.0007, -0.0001))),
    "fisheye 220": (220, lens_parameters("fisheye", coefficients=(0.01, -0.002, 0.0, 0.0))),
    "fisheye 300": (300, lens_parameters("fisheye", coefficients=(0.0, 0.0, 0.0, 0.0))),
}


def lens(name: str) -> Intrinsics:
    fov, distortion = LENSES[name]
    angle = math.radians(fov)
    focal = WIDTH / angle if distortion.model == "fisheye" else WIDTH / 2 / math.tan(angle / 2)
    return Intrinsics(width=WIDTH, height=HEIGHT, fx=focal, fy=focal, cx=WIDTH / 2, cy=HEIGHT / 2, distortion=distortion)


def painted_balls(rng):
    """Bumpy balls all around the origin, each triangle with a colour of its own that shows without light."""
    import trimesh

    from viewsphere.assets.mesh import Mesh

    meshes = []
    for _ in range(9):
        ball = trimesh.creation.icosphere(4)
        bumps = ball.vertices * (1 + 0.05 * rng.normal(size=(len(ball.vertices), 1)))
        corners = bumps[ball.faces].reshape(-1, 3).astype(np.float32)
        count = len(ball.faces)
        meshes.append(
            Mesh(
                vertices=corners,
                triangles=np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
                normals=np.repeat(ball.face_normals, 3, axis=0).astype(np.float32),
                triangle_material=np.zeros(count, np.int32),
                triangle_part=np.zeros(count, np.int32),
                materials=(Material(unlit=True),),
                colors=np.repeat(np.c_[linear(rng.uniform(0.1, 1, (count, 3))), np.ones(count)], 3, axis=0).astype(np.float32),
            )
        )
    return meshes


@pytest.fixture(scope="module")
def stage():
    rng = np.random.default_rng(5)
    meshes = painted_balls(rng)
    things = []
    for i in range(len(meshes)):
        z, turn = 1 - 2 * (i + 0.5) / len(meshes), 2.4 * i
        x, y = (3 * math.sqrt(1 - z * z) * f(turn) for f in (math.cos, math.sin))
        spec = ModelSpec(key=f"{i}", source="memory", category="ball", category_id=1)
        move = ((1, 0, 0, x), (0, 1, 0, y), (0, 0, 1, 3 * z), (0, 0, 0, 1))
        things.append(Thing(id=i + 1, model=spec, motion=Motion.still(move)))
    shot = still_shot(
        things,
        lens("barrel"),
        scene=Scene(sun=None, finish=Finish(background=Background(color=(0, 0, 0)), view=ViewTransform(transform="raw"))),
        engine_options={"antialias": 1, "ambient_occlusion": "off"},
    )
    return raster.stage(shot, lambda spec, step=None: meshes[int(spec.key)]), meshes


def camera(name: str, rng) -> Camera:
    """Near the origin, turned anyhow."""
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    rotation *= np.sign(np.linalg.det(rotation))
    return Camera(lens(name), rotation, rng.normal(size=3) * 0.3)


def traced(geometry, view: Camera):
    """Triangle, -1 for none, and s of Embree's first hit along each pixel's ray."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, geometry.vertices.astype(np.float32), geometry.triangles)
    rays = pixel_rays(view.intrinsics).reshape(-1, 3)
    has_ray = np.isfinite(rays).all(axis=1)
    hit = scene.run(
        np.broadcast_to(view.center.astype(np.float32), rays.shape).copy(),
        np.where(has_ray[:, None], rays @ view.R, 1).astype(np.float32),
        output=True,
    )
    return np.where(has_ray, hit["primID"].astype(np.int64), -1), np.asarray(hit["tfar"], float)


@pytest.mark.parametrize("name", quick(LENSES, "fisheye 220"))
def test_labels_and_colour_are_those_of_the_bent_rays(name, stage):
    stage, meshes = stage
    colors = np.concatenate([m.colors[::3, :3] for m in meshes])
    colors = np.round(255 * encoded(colors)).astype(int)
    rng = np.random.default_rng(11)
    behind = differs = 0
    errors = []
    for _ in range(3):
        view = camera(name, rng)
        visible = rasterize(stage.at(0), view)
        labels = observe(stage.at(0), view, visible, ("instances", "depth"))
        seen = painted(stage, view).reshape(-1, 3)
        other, s = traced(stage.at(0), view)
        own = visible.triangle.reshape(-1)
        same = own == other
        differs += int((~same).sum())
        hit = same & (other >= 0)
        z = s * pixel_rays(view.intrinsics).reshape(-1, 3)[:, 2]
        behind += int((z[hit] < 0).sum())
        errors.append((np.abs(labels["depth"].reshape(-1) - z) / np.maximum(1, np.abs(z) / 10))[hit])
        objects = np.where(other >= 0, stage.at(0).triangle_object[other], 0)
        assert np.array_equal(labels["instances"].reshape(-1)[same], objects[same])
        assert np.abs(seen[hit] - colors[other[hit]]).max() <= 1
        assert (seen[same & (other < 0)] == 0).all()
        assert hit.mean() > 0.05
    assert differs < 2e-4 * 3 * WIDTH * HEIGHT
    assert np.quantile(np.concatenate(errors), 0.999) <= 1e-4
    assert behind > 3000 or LENSES[name][0] <= 180


@pytest.mark.parametrize("name", LENSES)
def test_projected_points_fall_where_the_picture_shows_them(name, stage):
    """The corner of the label is the corner of the picture: points of visible triangles project into pixels that show them."""
    stage, _ = stage
    view = camera(name, np.random.default_rng(2))
    visible = rasterize(stage.at(0), view)
    rays = pixel_rays(view.intrinsics)
    shown = visible.triangle >= 0
    place = rays[shown] / visible.inverse_depth[shown][:, None]
    pixels, _ = project(view.intrinsics, place)
    rows, columns = np.nonzero(shown)
    apart = np.abs(pixels - np.stack([columns + 0.5, rows + 0.5], axis=1)).max(axis=1)
    assert np.quantile(apart, 0.999) < 2e-3
    assert shown.sum() > 1000
