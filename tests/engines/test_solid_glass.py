"""Solid glass against closed forms: Snell's law in a ball, Fresnel's at a wall, and that light neither comes nor goes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from light_stage import ball, cuboid, flat, quad
from test_physics import camera, even, furnace, light_of, picture, sky_file, stage_of  # noqa: F401 (a fixture)

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.engines.raster.shading.painting import paint
from viewsphere.geometry.camera import pixel_rays
from viewsphere.model.scene import Ground, Scene, Sky
from viewsphere.rendering.view import EXPOSURE
from viewsphere.truth.raster.visibility import rasterize

GLASS = Material(base_color=(1.0, 1.0, 1.0, 1.0), roughness=0.0, transmission=1.0, thickness=0.01)
THIN = replace(GLASS, thickness=0.0)
DARK = Sky(strength=0.0)


def inverted(mesh: Mesh) -> Mesh:
    """The mesh seen from within: a cavity."""
    return replace(mesh, triangles=mesh.triangles[:, ::-1].copy(), normals=-mesh.normals)


def joined(*meshes: Mesh) -> Mesh:
    starts = np.cumsum([0] + [len(m.vertices) for m in meshes])
    return replace(
        meshes[0],
        vertices=np.concatenate([m.vertices for m in meshes]),
        normals=np.concatenate([m.normals for m in meshes]),
        triangles=np.concatenate([m.triangles + start for m, start in zip(meshes, starts, strict=False)]).astype(np.int32),
        triangle_material=np.concatenate([m.triangle_material for m in meshes]),
        triangle_part=np.concatenate([m.triangle_part for m in meshes]),
    )


def shell(inner: float) -> Mesh:
    """A hollow ball of radius 0.5."""
    return joined(ball(0.5, (0, 0, 0), 64), inverted(ball(inner, (0, 0, 0), 64)))


def light_of_all(meshes, scene, view) -> np.ndarray:
    """Radiance (H, W, 3), a sample a pixel."""
    stage = stage_of(meshes, scene, ambient_occlusion="off")
    light = np.empty((view.width * view.height, 4), np.float32)
    paint(stage.baked(0), view, rasterize(stage.at(0), view), False, True, light)
    return light.reshape(view.height, view.width, 4)[..., :3].astype(float)


def directions(tmp_path):
    """A sky whose colour is its direction: 0.4 times it plus 0.5."""
    rows, columns = np.meshgrid((np.arange(256) + 0.5) / 256, (np.arange(512) + 0.5) / 512, indexing="ij")
    elevation, angle = (0.5 - rows) * math.pi, (0.5 - columns) * 2 * math.pi
    sky = np.stack([np.cos(elevation) * np.cos(angle), np.cos(elevation) * np.sin(angle), np.sin(elevation)], axis=-1)
    return sky_file(tmp_path / "directions.hdr", sky * 0.4 + 0.5)


@pytest.mark.parametrize("ior", [1.33, 1.5])
def test_a_ball_shows_the_sky_where_both_refractions_send_the_ray(tmp_path, ior):
    """Away from the axis by sin(i) radii a ray turns by 2 (i - t) towards the axis, sin(i) = ior sin(t)."""
    glass = replace(GLASS, ior=ior, specular=0.0)
    view = camera(120, 120, 200, 25, 15, 2.2)
    scene = Scene(sun=None, sky=directions(tmp_path))
    light, seen = light_of(replace(ball(0.5, (0, 0, 0), 96), materials=(glass,)), scene, view, ambient_occlusion="off")
    rays = pixel_rays(view.intrinsics) @ view.R
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    along = -(rays @ view.center)
    nearest = view.center + along[..., None] * rays
    sine = np.minimum(np.linalg.norm(nearest, axis=-1) / 0.5, 1)
    turn = 2 * (np.arcsin(sine) - np.arcsin(sine / ior))
    inward = -nearest / np.linalg.norm(nearest, axis=-1, keepdims=True)
    out = np.cos(turn)[..., None] * rays + np.sin(turn)[..., None] * inward
    inside = (seen >= 0) & (np.cos(turn) < 0.89) & (sine < 0.85)
    assert inside.sum() > 400
    shown = (light - 0.5) / 0.4
    cosine = (shown * out).sum(-1) / np.linalg.norm(shown, axis=-1)
    assert np.quantile(np.degrees(np.arccos(np.clip(cosine, -1, 1)))[inside], 0.99) < 2.5


def test_a_wall_lets_through_what_its_two_faces_leave():
    """Straight on, each face mirrors R = ((n - 1) / (n + 1))^2: of the light behind a wall (1 - R)^2 arrives, within 1 %."""
    wall, behind = flat(cuboid((-1, 0, -1), (1, 0.02, 1)), GLASS), flat(quad((-2, 1, -2), (4, 0, 0), (0, 0, 4)))
    for ior in (1.33, 1.5, 1.8):
        card = replace(behind, materials=(Material(unlit=True),))
        meshes = [replace(wall, materials=(replace(GLASS, ior=ior),)), card]
        found = light_of_all(meshes, Scene(sun=None, sky=DARK), camera(9, 9, 60, 0, 0, 4))
        left = 1 - ((ior - 1) / (ior + 1)) ** 2
        assert found == pytest.approx(np.full_like(found, left**2 / EXPOSURE), rel=0.01)


@pytest.mark.parametrize("inner", [0.0, 0.45, 0.49])
def test_light_neither_comes_nor_goes(even, inner):  # noqa: F811
    """In a white surrounding a ball vanishes; of a hollow one the rim, within whose wall rays are caught, may be dark."""
    mesh = shell(inner) if inner else ball(0.5, (0, 0, 0), 64)
    light = furnace(even, mesh, GLASS, 1.6, ambient_occlusion="off")
    assert light.max() < 1.01
    assert np.mean(np.abs(light - 1) < 0.01) > (0.97 if inner else 0.999)


@pytest.mark.parametrize("side", [1, -1])
def test_panes_stay_clear(side):
    """Between parallel faces nothing bends, nor in a sheet that is not closed: pictures are those of thin glass."""
    scene = Scene(ground=Ground(), sky=Sky())
    for triangles in (cuboid((-0.5, -0.01, 0), (0.5, 0.01, 1)), quad((-0.5, 0, 0.1), (1, 0, 0.3), (0, 0.5, 0.8 * side))):
        view = camera(60, 45, 60, 12, 8, 1.2, (0, 0, 0.5))
        solid, thin = (picture(flat(triangles, glass), scene, view, antialias=1) for glass in (GLASS, THIN))
        inner = np.s_[12:-12, 15:-15]
        assert np.array_equal(solid[inner], thin[inner])


def test_labels_know_nothing_of_it():
    view = camera(80, 60, 90, 20, 30, 2.0)
    seen = [rasterize(stage_of([replace(shell(0.45), materials=(glass,))], Scene()).at(0), view) for glass in (GLASS, THIN)]
    assert np.array_equal(seen[0].triangle, seen[1].triangle)
    assert np.array_equal(seen[0].inverse_depth, seen[1].inverse_depth)


def test_a_hollow_ball_is_clear_but_for_its_rim():
    """Before an even card: in the middle it is seen straight, where the line of sight stays within the wall it is not."""
    card = flat(quad((-3, 1, -3), (6, 0, 0), (0, 0, 6)), Material(unlit=True))
    view = camera(120, 120, 400, 0, 0, 4)
    light = {}
    for name, glass in (("solid", GLASS), ("thin", THIN)):
        meshes = [replace(shell(0.46), materials=(glass,)), card]
        light[name] = light_of_all(meshes, Scene(sun=None, sky=DARK), view)[60, :, 0]
    radius = np.abs(np.arange(120) + 0.5 - 60) / 400 * 4
    middle, rim = radius < 0.2, (radius > 0.468) & (radius < 0.485)
    np.testing.assert_allclose(light["solid"][middle], light["thin"][middle], rtol=1e-5)
    assert light["thin"][rim].min() > 0.2
    assert light["solid"][rim].max() < 0.02
