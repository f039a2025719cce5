"""The raster engine against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from shots import painted, still_shot
from viewsphere.assets.mesh import Image, Material, Mesh, Texture
from viewsphere.codecs.srgb import encoded
from viewsphere.codecs.srgb import linear as linear_light
from viewsphere.engines import raster
from viewsphere.errors import UserError
from viewsphere.geometry.camera import orbit_center, orbit_rotation
from viewsphere.geometry.lenses import LensParameters, lens_parameters
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Background, Finish, Ground, Scene, Sky, Sun, ViewTransform
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.model.thing import Thing
from viewsphere.rendering.view import EXPOSURE, KNEE
from viewsphere.truth.raster.visibility import rasterize

DARK = Sky(strength=0.0)
BLACK = Background(color=(0, 0, 0))
SPEC = ModelSpec(key="model", source="memory", category="thing", category_id=1)


def mesh_of(triangles: np.ndarray, material: Material | None = None, **fields) -> Mesh:
    """One material; triangles (T, 3, 3) with flat normals."""
    corners = np.asarray(triangles, np.float32).reshape(-1, 3)
    a, b, c = corners.reshape(-1, 3, 3).transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    count = len(a)
    return Mesh(
        vertices=corners,
        triangles=np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
        normals=np.repeat(normal, 3, axis=0).astype(np.float32),
        triangle_material=np.zeros(count, np.int32),
        triangle_part=np.zeros(count, np.int32),
        materials=(material or Material(),),
        **fields,
    )


def rectangle(corner, across, up) -> np.ndarray:
    """Two triangles; corners in the order origin, across, both, up."""
    o, a, b = (np.asarray(x, float) for x in (corner, across, up))
    return np.array([[o, o + a, o + a + b], [o, o + a + b, o + b]])


def card(width: float, height: float, y: float = 0.0) -> np.ndarray:
    """An upright rectangle that faces -Y, around the origin."""
    return rectangle((-width / 2, y, -height / 2), (width, 0, 0), (0, 0, height))


CARD_UV = np.array([(0, 1), (1, 1), (1, 0), (0, 1), (1, 0), (0, 0)], np.float32)


def box(low, high) -> np.ndarray:
    (x0, y0, z0), (x1, y1, z1) = low, high
    x, y, z = x1 - x0, y1 - y0, z1 - z0
    return np.concatenate(
        [
            rectangle(low, (0, y, 0), (x, 0, 0)),
            rectangle((x0, y0, z1), (x, 0, 0), (0, y, 0)),
            rectangle(low, (x, 0, 0), (0, 0, z)),
            rectangle((x0, y1, z0), (0, 0, z), (x, 0, 0)),
            rectangle(low, (0, 0, z), (0, y, 0)),
            rectangle((x1, y0, z0), (0, y, 0), (0, 0, z)),
        ]
    )


def camera(
    width: int,
    height: int,
    focal: float,
    azimuth: float = 0.0,
    elevation: float = 0.0,
    distance: float = 1.0,
    target=(0, 0, 0),
    distortion: LensParameters | None = None,
) -> Camera:
    intrinsics = Intrinsics(width=width, height=height, fx=focal, fy=focal, cx=width / 2, cy=height / 2, distortion=distortion)
    a, e = math.radians(azimuth), math.radians(elevation)
    rotation = orbit_rotation(a, e)
    return Camera(intrinsics, rotation, -rotation @ (np.asarray(target) + orbit_center(a, e, distance)))


def stage_of(mesh: Mesh, scene: Scene, **options):
    shot = still_shot([Thing(id=1, model=SPEC)], scene=scene, engine_options=options)
    return raster.stage(shot, lambda _: mesh)


AS_IT_IS = Finish(background=BLACK, view=ViewTransform(transform="raw"))
"""Unlit colours are shown as they are, also those above the shoulder of the standard view."""


def picture(mesh: Mesh, scene: Scene, view: Camera, finish: Finish | None = None, **options) -> np.ndarray:
    return painted(stage_of(mesh, scene, **options), view, finish)


def displayed(radiance: float) -> float:
    """Display-linear value of a radiance: exposure and roll-off, written out again."""
    x = EXPOSURE * radiance
    y = max(x - KNEE, 0) / (1 - KNEE)
    return min(x, KNEE) + (1 - KNEE) * y / (1 + y)


def as_bytes(linear) -> np.ndarray:
    return np.round(encoded(linear) * 255).astype(np.uint8)


def texture_image(height: int, width: int, seed: int = 0) -> Image:
    pixels = np.random.default_rng(seed).integers(0, 256, (height, width, 4), np.uint8, endpoint=False)
    pixels[..., 3] = 255
    return Image("noise", pixels)


def unlit(texture: Texture | None = None, color=(1.0, 1.0, 1.0, 1.0), **fields) -> Material:
    return Material(base_color=color, base_color_texture=texture, unlit=True, **fields)


@pytest.mark.parametrize("antialias", [1, 4])
@pytest.mark.parametrize("nearest", [False, True])
def test_unlit_texture_seen_head_on_is_the_texture(antialias, nearest):
    image = texture_image(12, 16)
    mesh = mesh_of(card(1.6, 1.2), unlit(Texture(0, nearest=nearest)), uv0=CARD_UV, images=(image,))
    view = camera(16, 12, 10.0)
    seen = picture(mesh, Scene(finish=AS_IT_IS), view, antialias=antialias)
    np.testing.assert_array_equal(seen, image.pixels[..., :3])


def test_second_uv_set_and_texture_transform():
    image = texture_image(12, 16)
    turned = Texture(0, texcoord=1, offset=(0.0, 1.0), rotation=math.pi / 2, scale=(1.0, 1.0))
    mesh = mesh_of(card(1.2, 1.6), unlit(turned), uv0=CARD_UV * 0, uv1=CARD_UV, images=(image,))
    seen = picture(mesh, Scene(finish=AS_IT_IS), camera(12, 16, 10.0))
    # u' = v and v' = 1 - u: the picture's column runs up the texture's rows, its row along the texture's columns.
    np.testing.assert_array_equal(seen, image.pixels[::-1, :, :3].transpose(1, 0, 2))


@pytest.mark.parametrize(
    ("wrap", "columns"),
    [
        ("repeat", [0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3]),
        ("clamp", [0, 0, 0, 0, 0, 1, 2, 3, 3, 3, 3, 3]),
        ("mirror", [3, 2, 1, 0, 0, 1, 2, 3, 3, 2, 1, 0]),
    ],
)
def test_wrap_modes(wrap, columns):
    image = texture_image(4, 4, seed=1)
    mesh = mesh_of(
        card(12, 12),
        unlit(Texture(0, wrap_s=wrap, wrap_t=wrap)),
        uv0=CARD_UV * np.float32(3) - np.float32(1),
        images=(image,),
    )
    seen = picture(mesh, Scene(finish=AS_IT_IS), camera(12, 12, 1.0))
    np.testing.assert_array_equal(seen, image.pixels[columns][:, columns, :3])


def test_minified_texture_is_averaged_in_linear_light():
    checks = np.indices((256, 256)).sum(axis=0) % 2 * 255
    pixels = np.repeat(checks[..., None], 4, axis=2).astype(np.uint8)
    pixels[..., 3] = 255
    mesh = mesh_of(card(1, 1), unlit(Texture(0)), uv0=CARD_UV, images=(Image("checks", pixels),))
    seen = picture(mesh, Scene(finish=AS_IT_IS), camera(16, 16, 16.0))
    assert np.abs(seen.astype(int) - int(as_bytes(0.5))).max() <= 1


def test_unlit_factor_and_vertex_colour_are_exact():
    color = (0.25, 0.5, 1.0, 1.0)
    mesh = mesh_of(card(4, 4), unlit(color=color), colors=np.tile(np.float32([1.0, 0.5, 0.1, 1.0]), (6, 1)))
    seen = picture(mesh, Scene(finish=AS_IT_IS), camera(8, 8, 8.0))
    assert np.unique(seen.reshape(-1, 3), axis=0).tolist() == [as_bytes([0.25, 0.25, 0.1]).tolist()]


@pytest.mark.parametrize("sun_elevation", [20.0, 45.0, 90.0])
def test_lambert_plane(sun_elevation):
    """A white rough plane from above: irradiance times cosine over pi."""
    mesh = mesh_of(rectangle((-1, -1, 0), (2, 0, 0), (0, 2, 0)), Material(roughness=1.0, ior=1.0))
    sun = Sun(azimuth=200, elevation=sun_elevation, strength=2.0, color=(1.0, 0.5, 0.25))
    seen = picture(mesh, Scene(sun=sun, sky=DARK, finish=Finish(background=BLACK)), camera(8, 8, 10.0, elevation=90))
    cosine = math.sin(math.radians(sun_elevation))
    expected = as_bytes([displayed(2.0 * c * cosine / math.pi) for c in sun.color])
    assert np.abs(seen.astype(int) - expected.astype(int)).max() <= 1


def test_uniform_sky_lights_a_white_plane_as_itself():
    """Under a sky of equal radiance, a white Lambert surface that looks up shows that radiance, one that stands sees half."""
    sky = Sky(zenith=(0.5, 0.5, 0.5), horizon=(0.5, 0.5, 0.5))
    scene = Scene(sun=None, sky=sky, finish=Finish(background=BLACK))
    white = Material(roughness=1.0, ior=1.0)
    up = picture(mesh_of(rectangle((-1, -1, 0), (2, 0, 0), (0, 2, 0)), white), scene, camera(8, 8, 10.0, elevation=90))
    assert np.abs(up.astype(int) - int(as_bytes(displayed(0.5)))).max() <= 1
    upright = picture(mesh_of(card(2, 2), white), scene, camera(8, 8, 10.0))
    assert np.abs(upright.astype(int) - int(as_bytes(displayed(0.25 + 0.25 * 0.3)))).max() <= 2


def test_white_plane_in_the_default_light_does_not_clip():
    sun = Sun()
    azimuth, elevation = math.radians(sun.azimuth), math.radians(sun.elevation)
    toward, right = orbit_center(azimuth, elevation, 1.0), orbit_rotation(azimuth, elevation)[0]
    up = np.cross(toward, right)
    plane = mesh_of(rectangle(-right - up, 2 * right, 2 * up), Material(roughness=1.0))
    seen = picture(plane, Scene(finish=Finish(background=BLACK)), camera(8, 8, 10.0, sun.azimuth, sun.elevation))
    assert 200 < seen.min() <= seen.max() < 250


def test_exposure_is_in_stops():
    mesh = mesh_of(rectangle((-1, -1, 0), (2, 0, 0), (0, 2, 0)), Material(roughness=1.0, ior=1.0))
    scene = Scene(sun=Sun(elevation=90, strength=0.5, color=(1, 1, 1)), sky=DARK, finish=Finish(background=BLACK))
    view = camera(8, 8, 10.0, elevation=90)
    finishes = (Finish(background=BLACK, view=ViewTransform(exposure=e)) for e in (0, 1))
    plain, brighter = (picture(mesh, scene.model_copy(update={"finish": f}), view) for f in finishes)
    ratio = linear_light(brighter[0, 0] / 255) / linear_light(plain[0, 0] / 255)
    np.testing.assert_allclose(ratio, 2.0, rtol=0.03)


@pytest.mark.parametrize("color", [(0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (0.2, 0.5, 0.8), (1 / 255, 2 / 255, 3 / 255)])
def test_plain_background_is_exact(color):
    seen = picture(mesh_of(card(0.1, 0.1)), Scene(finish=Finish(background=Background(color=color))), camera(16, 16, 8.0))
    assert (seen[0] == np.round(np.array(color) * 255)).all()


def test_image_background_covers_the_frame(tmp_path):
    from PIL import Image as PillowImage

    pixels = np.random.default_rng(3).integers(0, 256, (24, 40, 3), np.uint8)
    path = tmp_path / "photo.png"
    PillowImage.fromarray(pixels).save(path)
    scene = Scene(finish=Finish(background=Background(color=(1, 0, 0))))
    finish = Finish(background=Background(image=str(path)))
    far = mesh_of(card(0.001, 0.001, y=-100.0))
    seen = picture(far, scene, camera(24, 24, 8.0), finish)
    np.testing.assert_array_equal(seen, pixels[:, 8:32])
    with pytest.raises(UserError, match="background image"):
        path.write_bytes(b"no image")
        picture(far, scene, camera(24, 24, 8.0), finish)


def test_sky_is_brighter_low_and_near_the_sun():
    empty = mesh_of(card(0.001, 0.001, y=-100.0))
    scene = Scene(sun=Sun(azimuth=180, elevation=30))
    toward = picture(empty, scene, camera(32, 32, 16.0)).astype(int)
    away = picture(empty, scene, camera(32, 32, 16.0, azimuth=180)).astype(int)
    assert (toward[:15].sum() > away[:15].sum()) and (np.diff(away[:16, :, 0].mean(axis=1)) >= 0).all()


BOX = box((-0.5, -0.5, 0.0), (0.5, 0.5, 1.0))
GROUND_SCENE = Scene(
    sun=Sun(azimuth=90, elevation=45, strength=3.0),
    sky=DARK,
    ground=Ground(pattern="plain", color=(0.8, 0.8, 0.8)),
    finish=Finish(background=BLACK),
)


def test_shadow_of_a_box_falls_where_geometry_says():
    """The sun stands over +X at 45 degrees: the shadow covers x in [-1.5, -0.5], y in [-0.5, 0.5]."""
    at = np.array([0.011, 0.007])  # keeps edges off the borders of pixels
    view = camera(160, 160, 400.0, elevation=90, distance=10.0, target=(*at, 0.0))  # 40 px a metre on the ground
    seen = picture(mesh_of(BOX), GROUND_SCENE, view).astype(int).sum(axis=2)
    x = (np.arange(160) + 0.5 - 80) / 40
    ground_x, ground_y = np.meshgrid(x + at[0], at[1] - x)
    outside_box = (np.abs(ground_x) > 0.6) | (np.abs(ground_y) > 0.6)
    margin = 0.05  # two pixels
    deep = (ground_x > -1.5 + margin) & (ground_x < -0.6) & (np.abs(ground_y) < 0.5 - margin)
    near = (ground_x > -1.5 - margin) & (ground_x < 0.6) & (np.abs(ground_y) < 0.5 + margin)
    lit_level = np.median(seen[outside_box & ~near])
    assert seen[deep].max() == 0
    assert seen[outside_box & ~near].min() > 0.9 * lit_level
    assert len(np.unique(seen[outside_box & near & ~deep])) > 3  # a smooth edge


def test_no_acne_and_no_gap_at_the_foot():
    """A lit face is evenly lit; the shadow begins at the box's foot."""
    faces = picture(mesh_of(BOX), GROUND_SCENE, camera(64, 64, 200.0, 90, 0, 10.0, (0, 0, 0.5))).astype(int)
    front = faces[24:40, 24:40]
    assert front.min() > 150
    assert max(np.abs(np.diff(front, axis=axis)).max() for axis in (0, 1)) <= 1
    view = camera(160, 160, 1600.0, azimuth=180, elevation=60, distance=10.0, target=(-0.5, 0.5, 0.0))
    stage = stage_of(mesh_of(BOX), GROUND_SCENE, antialias=1)
    visible = rasterize(stage.at(0), view)
    seen = painted(stage, view).astype(int).sum(axis=2)
    ground = stage.at(0).triangle_object[visible.triangle] == 0
    i, j = np.nonzero(ground)
    rays = np.stack([(j + 0.5 - 80) / 1600, (i + 0.5 - 80) / 1600, np.ones(len(i))], axis=1)
    points = view.center + (rays / visible.inverse_depth[i, j, None]) @ view.R
    foot = (points[:, 0] < -0.505) & (points[:, 0] > -0.55) & (points[:, 1] < 0.45) & (points[:, 1] > 0.3)
    assert foot.sum() > 50
    assert seen[i[foot], j[foot]].max() == 0


def test_no_sun_means_no_shadow():
    scene = GROUND_SCENE.model_copy(update={"sun": None, "sky": Sky()})
    view = camera(80, 80, 100.0, elevation=90, distance=10.0)
    seen = picture(mesh_of(box((-0.5, -0.5, 0.0), (0.5, 0.5, 1.0))), scene, view).astype(int)
    np.testing.assert_allclose(seen[:, :25], seen[:, :-26:-1], atol=3)  # both sides of the box are alike


def test_cutout_casts_its_shape():
    """A card with a hole lies in the air: the sun goes through the hole."""
    pixels = np.full((8, 8, 4), 255, np.uint8)
    pixels[2:6, 2:6, 3] = 0
    holed = Material(base_color_texture=Texture(0, nearest=True), alpha_mode="MASK")
    flat = rectangle((-1, -1, 1), (2, 0, 0), (0, 2, 0))
    foot = rectangle((5, 0, 0), (0.01, 0, 0), (0, 0.01, 0))
    uv = np.concatenate([CARD_UV, CARD_UV * 0])
    mesh = mesh_of(np.concatenate([flat, foot]), holed, uv0=uv, images=(Image("hole", pixels),))
    scene = GROUND_SCENE.model_copy(update={"sun": Sun(azimuth=90, elevation=45)})
    seen = picture(mesh, scene, camera(64, 64, 64.0, elevation=90, distance=10.0), antialias=1).astype(int).sum(axis=2)
    column = 32 + 64 * np.array([-1.6, -1.2, -0.65]) / 10  # shadow, hole's middle (x = -1), hole
    assert seen[32, int(column[0])] == 0
    assert seen[32, int(column[1])] > 100


@pytest.mark.parametrize("angle", [0.0, 17.0, 45.0, 80.0])
def test_edge_coverage_and_no_fringe(angle):
    """A white half-plane on black: linear values are the covered share, never outside the two colours."""
    a = math.radians(angle)
    u, v = np.array([math.cos(a), 0, math.sin(a)]), np.array([-math.sin(a), 0, math.cos(a)])
    mesh = mesh_of(rectangle(-20 * u + 0.013 * v, 40 * u, 20 * v), unlit(color=(0.5, 0.5, 0.5, 1.0)))
    size, fine = 32, 16
    seen = picture(mesh, Scene(finish=Finish(background=BLACK)), camera(size, size, 32.0))
    value = linear_light(seen[..., 0] / 255) / linear_light(as_bytes(0.5) / 255)
    p = (np.arange(size * fine) + 0.5) / fine - size / 2
    x, z = np.meshgrid(p / 32, -p / 32)
    covered = (x * v[0] + z * v[2] >= 0.013).reshape(size, fine, size, fine).mean(axis=(1, 3))
    assert value.max() <= 1.0
    assert np.abs(value - covered).max() <= 0.36
    assert np.abs(value - covered).mean() < 0.006
    assert set(np.unique(seen)) <= set(as_bytes(0.5 * np.arange(5) / 4).tolist())


@pytest.mark.parametrize("size", [1e-6, 1e6])
def test_size_does_not_change_the_picture(size):
    """A small or huge scene looks like the one of a metre: shadows, textures and all."""
    image = texture_image(16, 16, seed=2)
    uv = np.tile(CARD_UV, (6, 1))
    material = Material(base_color_texture=Texture(0))
    plain, scaled = (
        picture(
            mesh_of(BOX * s, material, uv0=uv, images=(image,)),
            Scene(ground=Ground(pattern="plain")),
            camera(48, 48, 40.0, 30, 25, 4 * s),
            antialias=1,
        )
        for s in (1.0, size)
    )
    difference = np.abs(plain.astype(int) - scaled.astype(int)).max(axis=2)
    assert plain.std() > 20
    assert (difference > 3).mean() < 0.01


def test_ground_without_objects_and_nothing_at_all():
    shot = still_shot((), scene=Scene(ground=Ground(pattern="plain"), finish=Finish(background=Background(color=(0, 0, 1)))))
    view = camera(16, 16, 16.0, elevation=45, distance=3.0)
    for scene, expected in ((shot.scene, False), (shot.scene.model_copy(update={"ground": None}), True)):
        stage = raster.stage(shot.model_copy(update={"scene": scene}), lambda _: pytest.fail("nothing to load"))
        seen = painted(stage, view)
        assert bool((seen == [0, 0, 255]).all()) is expected
        assert np.ptp(seen[-4:].reshape(-1, 3), axis=0).max() <= 1


def test_two_runs_are_equal_byte_for_byte():
    mesh = mesh_of(BOX, Material(metallic=0.5, roughness=0.3, clearcoat=1.0))
    scene = Scene(ground=Ground(pattern="plain"))
    view = camera(64, 48, 60.0, 30, 20, 4.0)
    assert picture(mesh, scene, view).tobytes() == picture(mesh, scene, view).tobytes()


@pytest.mark.parametrize(
    "lens",
    [
        lens_parameters("brown_conrady", coefficients=(-0.2, 0.05, 0.001, -0.002)),
        lens_parameters("fisheye", coefficients=(0.02, -0.01, 0.0, 0.0)),
    ],
)
def test_distorted_colour_follows_the_labels(lens):
    mesh = mesh_of(card(1.0, 0.6), unlit(color=(1.0, 0.0, 0.0, 1.0)))
    view = camera(64, 64, 50.0, 25, 30, 1.2, distortion=lens)
    stage = stage_of(
        mesh, Scene(finish=Finish(background=Background(color=(0, 0, 1)), view=ViewTransform(transform="raw"))), antialias=1
    )
    visible = rasterize(stage.at(0), view)
    seen = painted(stage, view)
    expected = np.where((visible.triangle >= 0)[..., None], np.uint8([255, 0, 0]), np.uint8([0, 0, 255]))
    assert 0 < (visible.triangle >= 0).sum() < 64 * 64
    np.testing.assert_array_equal(seen, expected)


def test_distorted_texture_is_sampled_along_the_same_rays():
    """Red is u and green 1 - v: colour tells where on the card the ray fell."""
    ramp = np.zeros((256, 256, 4), np.uint8)
    ramp[..., 0], ramp[..., 1], ramp[..., 3] = np.arange(256), np.arange(256)[:, None], 255
    material = unlit(Texture(0, wrap_s="clamp", wrap_t="clamp"))
    mesh = mesh_of(card(2, 2), material, uv0=CARD_UV, images=(Image("ramp", ramp),))
    lens = lens_parameters("brown_conrady", coefficients=(-0.2, 0.05, 0.001, -0.002))
    view = camera(64, 64, 64.0, distance=1.0, distortion=lens)
    from viewsphere.geometry.camera import pixel_rays

    rays = pixel_rays(view.intrinsics)
    u, v = (rays[..., 0] + 1) / 2, (rays[..., 1] + 1) / 2
    seen = picture(mesh, Scene(finish=AS_IT_IS), view)
    assert np.abs(seen[..., 0] - (u * 256 - 0.5)).max() < 1.0
    assert np.abs(seen[..., 1] - (v * 256 - 0.5)).max() < 1.0


def test_blended_surface_shows_what_is_behind():
    glass = unlit(color=(1.0, 0.0, 0.0, 0.25), alpha_mode="BLEND")
    solid = unlit(color=(0.0, 1.0, 0.0, 1.0))
    front, back = mesh_of(card(4, 4, y=0.0), glass), mesh_of(rectangle((-2, 1, -2), (2, 0, 0), (0, 0, 4)), solid)
    both = replace(
        front,
        vertices=np.concatenate([front.vertices, back.vertices]),
        triangles=np.concatenate([front.triangles, back.triangles + 6]),
        normals=np.concatenate([front.normals, back.normals]),
        triangle_material=np.int32([0, 0, 1, 1]),
        triangle_part=np.zeros(4, np.int32),
        materials=(glass, solid),
    )
    seen = picture(
        both,
        Scene(finish=Finish(background=Background(color=(0, 0, 1)), view=ViewTransform(transform="raw"))),
        camera(16, 16, 16.0, distance=2.0),
    )
    assert seen[8, 3].tolist() == as_bytes([0.25, 0.75, 0.0]).tolist()
    assert seen[8, 12].tolist() == as_bytes([0.25, 0.0, 0.75]).tolist()


@pytest.mark.parametrize("antialias", [1, 4])
def test_a_decal_lies_on_the_surface_it_shares_a_plane_with(antialias):
    """Of equal depths truth sees the first triangle, the surface; the decal is seen all the same."""
    board, decal = unlit(color=(0.0, 1.0, 0.0, 1.0)), unlit(color=(1.0, 0.0, 0.0, 0.25), alpha_mode="BLEND")
    mesh = replace(
        mesh_of(np.concatenate([card(4, 4), card(4, 4)])),
        triangle_material=np.int32([0, 0, 1, 1]),
        materials=(board, decal),
    )
    seen = picture(mesh, Scene(finish=AS_IT_IS), camera(16, 16, 16.0, distance=2.0), antialias=antialias)
    assert seen[8, 8].tolist() == as_bytes([0.25, 0.75, 0.0]).tolist()


def test_metal_mirrors_the_sky_and_is_not_dead():
    """Chrome looked at from the side shows the bright horizon above and the darker earth below."""
    chrome = Material(metallic=1.0, roughness=0.1)
    tilted = [mesh_of(rectangle((-2, -s * 2, -2), (4, 0, 0), (0, s * 4, 4)), chrome) for s in (0.6, -0.6)]
    scene = Scene(sun=None, finish=Finish(background=BLACK))
    up, down = (picture(m, scene, camera(8, 8, 20.0, distance=5.0))[4, 4].astype(int).sum() for m in tilted)
    assert up > down + 60
    assert up > 300


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"antialais": 4}, "did you mean 'antialias'"),
        ({"antialias": 3}, "expected 1, 4, 16 or 64, found 3"),
        ({"antialias": True}, "expected 1, 4, 16 or 64"),
        ({"exposure": 1.0}, "expected it as scene.view.exposure"),
        ({"ambient_occlusion": "soft"}, "ambient_occlusion: expected off, fast or fine"),
        ({"shadow_resolution": 10}, "shadow_resolution: expected an integer"),
        ({"shadow_resolution": 512.5}, "shadow_resolution: expected an integer"),
    ],
)
def test_wrong_options(options, message):
    with pytest.raises(UserError, match=message):
        stage_of(mesh_of(card(1, 1)), Scene(), **options)


def test_listing_the_engine_imports_nothing_heavy():
    import subprocess
    import sys

    code = "import sys, viewsphere.engines.raster as r; r.ENGINE.check({}); print('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"
