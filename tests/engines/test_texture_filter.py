"""Texture filtering: footprints, mip levels, wrapping, against closed forms and supersampling."""

from __future__ import annotations

import numpy as np
import pytest
from called import called
from material_blocks import card, edges_of, made, packed, view_of

from viewsphere.assets.mesh import Image, Material, Texture
from viewsphere.codecs.srgb import linear
from viewsphere.engines.raster.materials import kernels_filter as kf
from viewsphere.engines.raster.materials import kernels_material as km
from viewsphere.engines.raster.materials.bundles import BundlePacker
from viewsphere.engines.raster.shading import kernels_block as block
from viewsphere.kernels.jit import njit

RNG = np.random.default_rng(4)
NOISE = Image("noise", RNG.integers(0, 256, (16, 16, 4)).astype(np.uint8))


def textured(image, **options):
    return card(Material(base_color_texture=Texture(0, **options)), [image])


opacity = called(kf.opacity)


@njit
def footprints(count, width, height, c):
    kf.footprints(count, width, height, c)


@njit
def gradients(rotation, transform, b, c):
    km._barycentric_motion(1, rotation, np.float32(0), b, c)
    km._coordinates(1, transform, np.uintp(0), b, c)


def footprint(ux, uy, vx, vy, width=1.0, height=1.0):
    """Level, number of probes, and the whole way along the longer axis in u and v."""
    c = np.zeros(kf.ROWS * kf.CHUNK, np.float32)
    c[kf.UX], c[kf.UY], c[kf.VX], c[kf.VY] = ux, uy, vx, vy
    footprints(1, np.float32(width), np.float32(height), c)
    count = c[kf.COUNT]
    return float(c[kf.LEVEL]), int(count), np.array([c[kf.STEP_U], c[kf.STEP_V]]) * count


@pytest.mark.parametrize("size", [0.3, 1.0, 1.7, 8.0, 1000.0])
@pytest.mark.parametrize("turn", [0.0, 0.6])
def test_a_round_footprint_is_one_probe_of_its_own_level(size, turn):
    c, s = size * np.cos(turn), size * np.sin(turn)
    level, count, _ = footprint(c / 256, -s / 256, s / 64, c / 64, 256, 64)
    assert count == 1
    assert level == pytest.approx(max(np.log2(size), 0), abs=2e-3)


@pytest.mark.parametrize(("ratio", "count"), [(1.2, 1), (2.0, 2), (3.5, 3), (6.0, 5), (9.9, 8), (40.0, 8)])
def test_probes_stand_along_the_longer_axis(ratio, count):
    turn, small = 0.4, 3.0
    axis, other = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    # Any pair of conjugate half-axes spans the same ellipse: mix them on the screen.
    mixed = np.stack([axis * ratio * small, other * small], axis=1) @ [[np.cos(1), -np.sin(1)], [np.sin(1), np.cos(1)]]
    level, found, way = footprint(*(mixed / 100).reshape(-1), 100, 100)
    assert found == count
    assert level == pytest.approx(np.log2(small * max(1, ratio / 10)), abs=3e-3)
    if count > 1:
        way *= 100 * np.sign(way @ axis)
        np.testing.assert_allclose(way, axis * ratio * small, rtol=1e-4)


@pytest.mark.slow
def test_footprints_that_are_no_numbers_read_something():
    surfaces, textures = packed(textured(NOISE))
    bad = np.array([np.nan, np.inf, 1e30, -1e30, 0.5])
    found = made(surfaces, textures, {"PIXEL": bad, "U0": 0.5})
    assert np.isfinite(found["RED"]).all()
    found = made(surfaces, textures, {"U0": np.array([1e30, -1e30, 3e9, -2147483648.0, 0.5]), "V0": 0.25})
    assert np.isfinite(found["RED"]).all()
    assert ((found["RED"] >= 0) & (found["RED"] <= 1.0001)).all()


def bilinear(pixels, u, v, wrap_s, wrap_t):
    """Linear colours of the four nearest texels, in double precision."""
    height, width = pixels.shape[:2]
    light = linear(pixels[..., :3] / 255)

    def wrapped(index, size, wrap):
        if wrap == "repeat":
            return index % size
        if wrap == "clamp":
            return np.clip(index, 0, size - 1)
        return np.where(index % (2 * size) < size, index % (2 * size), 2 * size - 1 - index % (2 * size))

    x, y = u * width - 0.5, v * height - 0.5
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = (x - x0)[:, None], (y - y0)[:, None]
    a, b = wrapped(x0, width, wrap_s), wrapped(x0 + 1, width, wrap_s)
    c, d = wrapped(y0, height, wrap_t), wrapped(y0 + 1, height, wrap_t)
    return (light[c, a] * (1 - fx) + light[c, b] * fx) * (1 - fy) + (light[d, a] * (1 - fx) + light[d, b] * fx) * fy


@pytest.mark.parametrize("wraps", [("repeat", "clamp"), ("clamp", "mirror"), ("mirror", "repeat")])
def test_magnified_texels_are_mixed_in_linear_light(wraps):
    image = Image("odd", RNG.integers(0, 256, (5, 7, 4)).astype(np.uint8))
    surfaces, textures = packed(textured(image, wrap_s=wraps[0], wrap_t=wraps[1]))
    u, v = RNG.uniform(-2.5, 2.5, (2, 500)).astype(np.float32)
    found = made(surfaces, textures, {"U0": u, "V0": v})
    expected = bilinear(image.pixels, u.astype(float), v.astype(float), *wraps)
    np.testing.assert_allclose(np.stack([found[c] for c in ("RED", "GREEN", "BLUE")], 1), expected, atol=5e-5)


def test_nearest_shows_single_texels():
    surfaces, textures = packed(textured(NOISE, nearest=True))
    u, v = RNG.uniform(-1, 2, (2, 300)).astype(np.float32)
    found = made(surfaces, textures, {"U0": u, "V0": v})
    texel = NOISE.pixels[np.floor(v * 16).astype(int) % 16, np.floor(u * 16).astype(int) % 16]
    np.testing.assert_allclose(found["RED"], linear(texel[:, 0] / 255), atol=2e-5)


@pytest.mark.parametrize("size", [0.5, 1.0, 1.5, 2.0, 3.3, 8.0, 50.0])
def test_the_mip_level_is_the_logarithm_of_the_texels_in_a_pixel(size):
    """Each level's words are replaced by its number: what is read is the level."""
    image = Image("a", np.zeros((64, 64, 4), np.uint8))
    surfaces, textures = packed(textured(image))
    count = textures.modes[0, 0]
    assert count == 7
    for level in range(count):
        start, width, height = textures.levels[0, level]
        textures.texels[start : start + width * height * 4] = level * 1000
    found = made(surfaces, textures, {"PIXEL": np.array([size * 2 / 64])})
    whole, part = np.divmod(np.clip(np.log2(size), 0, 6), 1)
    mixed = whole + np.clip((part - kf.SNAP) / (1 - 2 * kf.SNAP), 0, 1)
    assert found["RED"][0] * 65.535 == pytest.approx(mixed, abs=5e-3)
    assert abs(mixed - (whole + part)) <= kf.SNAP


def test_texture_transform_moves_coordinates_and_footprint():
    """KHR_texture_transform gives what coordinates transformed beforehand give."""
    options = {"offset": (0.3, -0.2), "rotation": 0.7, "scale": (3.0, 1.5)}
    texture = Texture(0, **options)
    corners = np.array([(0, 1), (1, 1), (1, 0), (0, 0)], float)
    moved = corners @ texture.matrix[:, :2].T + texture.matrix[:, 2]
    first = card(Material(base_color_texture=texture), [NOISE])
    second = card(Material(base_color_texture=Texture(0)), [NOISE], uv=moved)
    u, v = RNG.uniform(0, 1, (2, 200))
    at = np.stack([u, v], 1) @ texture.matrix[:, :2].T + texture.matrix[:, 2]
    tilted = np.tile([0.8, -0.6, 0], (200, 1))
    a = made(*packed(first), {"U0": u, "V0": v, "PIXEL": 0.1, "V": tilted})
    b = made(*packed(second), {"U0": at[:, 0], "V0": at[:, 1], "PIXEL": 0.1, "V": tilted})
    np.testing.assert_allclose(a["RED"], b["RED"], atol=2e-4)
    assert a["RED"].std() > 0.01


def levels_of(image, **material):
    """All mip levels (H, W, C) of a material's first bundle, 0 to 1."""
    packer = BundlePacker()
    packer.add(Material(**material), [image], (True, True))
    texels, levels, modes, _ = packer.pack()
    channels = 4 * modes[0, 5]
    return [
        texels[start : start + width * height * channels].reshape(height, width, channels) / 65535
        for start, width, height in levels[0, : modes[0, 0]]
    ]


@pytest.mark.parametrize("shape", [(8, 8), (5, 7), (1, 13), (31, 2)])
def test_every_level_keeps_the_mean_light(shape):
    image = Image("a", RNG.integers(0, 256, (*shape, 4)).astype(np.uint8))
    levels = levels_of(image, base_color_texture=Texture(0))
    mean = linear(image.pixels[..., :3] / 255).mean(axis=(0, 1))
    assert levels[-1].shape[:2] == (1, 1)
    for k, level in enumerate(levels):
        assert level.shape[:2] == (max(shape[0] >> k, 1), max(shape[1] >> k, 1))
        np.testing.assert_allclose(level[..., :3].mean(axis=(0, 1)), mean, atol=3e-5)


def test_every_srgb_byte_is_decoded_exactly():
    image = Image("ramp", np.repeat(np.arange(256, dtype=np.uint8).reshape(16, 16, 1), 4, axis=2))
    first = levels_of(image, base_color_texture=Texture(0))[0]
    np.testing.assert_allclose(first[..., 0].reshape(-1), linear(np.arange(256) / 255), atol=0.51 / 65535)
    np.testing.assert_allclose(first[..., 3].reshape(-1), np.arange(256) / 255, atol=1e-9)


def test_colours_of_clear_texels_do_not_bleed():
    pixels = np.zeros((4, 4, 4), np.uint8)
    pixels[:, ::2] = (255, 0, 0, 255)
    pixels[:, 1::2] = (0, 255, 0, 0)
    image = Image("a", pixels)
    last = levels_of(image, base_color_texture=Texture(0), alpha_mode="MASK")[-1][0, 0]
    np.testing.assert_allclose(last, [1, 0, 0, 0.5], atol=1e-4)
    last = levels_of(image, base_color_texture=Texture(0))[-1][0, 0]
    np.testing.assert_allclose(last[:3], [0.5, 0.5, 0], atol=1e-4)


def test_textures_of_one_size_share_a_bundle():
    images = [NOISE, NOISE, Image("small", NOISE.pixels[:8]), Image("other", NOISE.pixels)]
    packer = BundlePacker()
    material = Material(
        base_color_texture=Texture(0),
        normal_texture=Texture(1),
        occlusion_texture=Texture(2),
        metallic_roughness_texture=Texture(3),
    )
    found = packer.add(material, images, (True, True))
    assert found[:3] == [0, 1, -1]
    assert packer.add(material, images, (True, True)) == found
    modes = packer.pack()[2]
    assert modes[0, 5:9].tolist() == [3, km.BASE, km.BUMP, km.ROUGHNESS]
    assert modes[1, 5:7].tolist() == [1, km.BUMP]
    assert modes[:, 12].tolist() == [1, 0]


def test_very_large_textures_are_reduced(monkeypatch):
    from viewsphere.engines.raster.materials import bundles

    monkeypatch.setattr(bundles, "SHARPEST", 16)
    image = Image("a", RNG.integers(0, 256, (20, 50, 4)).astype(np.uint8))
    levels = levels_of(image, base_color_texture=Texture(0))
    assert levels[0].shape[:2] == (5, 13)
    light = linear(image.pixels[..., :3] / 255)
    np.testing.assert_allclose(levels[0][1, 2, :3], light[4:8, 8:12].mean(axis=(0, 1)), atol=1e-4)
    np.testing.assert_allclose(levels[0][1, 12, :3], light[4:8, 48:].mean(axis=(0, 1)), atol=1e-4)
    monkeypatch.setattr(bundles, "MOST_WORDS", 99)  # one less than 3 x 7, 1 x 3 and 1 x 1 texels of four words
    assert levels_of(image, base_color_texture=Texture(0))[0].shape[:2] == (2, 4)


def plane_camera(elevation_deg, height, size, fov_deg=40.0):
    """Rotation (world to camera), focal length and place of a camera above the plane z = 0 that looks along +Y."""
    e = np.radians(elevation_deg)
    forward = np.array([0, np.cos(e), -np.sin(e)])
    right = np.array([1.0, 0, 0])
    rotation = np.stack([right, np.cross(forward, right), forward])
    focal = size / 2 / np.tan(np.radians(fov_deg) / 2)
    return rotation, focal, np.array([0.0, 0.0, height])


def plane_hits(rotation, focal, eye, x, y, size):
    ray = np.stack([(x - size / 2) / focal, (y - size / 2) / focal, np.ones_like(x)], -1) @ rotation
    along = -eye[2] / ray[..., 2]
    return ray, along, eye + along[..., None] * ray


def test_gradients_are_the_finite_differences_of_the_seen_place():
    corners = RNG.uniform(-1, 1, (3, 3)) + np.array([0, 4, 0])
    uv = RNG.uniform(-2, 2, (3, 2))
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    normal /= np.linalg.norm(normal)
    focal, size = 900.0, 640
    rotation = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], float)

    def seen(x, y):
        ray = np.array([(x - size / 2) / focal, (y - size / 2) / focal, 1]) @ rotation
        point = ray * (corners[0] @ normal) / (ray @ normal)
        edges = np.stack([corners[1] - corners[0], corners[2] - corners[0]], 1)
        g, h = np.linalg.lstsq(edges, point - corners[0], rcond=None)[0]
        return uv[0] + g * (uv[1] - uv[0]) + h * (uv[2] - uv[0]), point

    mesh = card(Material(base_color_texture=Texture(0)), [NOISE])
    surfaces, textures = packed(mesh)
    vertices = surfaces.vertices.copy()
    vertices[:3, 11:14], vertices[:3, 3:5] = corners, uv
    surfaces = surfaces._replace(vertices=vertices)
    for x, y in [(320, 240), (20, 600), (630, 10)]:
        place, point = seen(x, y)
        ray = -point / np.linalg.norm(point)
        b = np.zeros(km.BLOCK * 99, np.float32)
        facing = normal * np.sign(normal @ ray)
        for row, value in ((block.VX, ray), (block.NX, facing)):
            b[[row, row + km.BLOCK, row + 2 * km.BLOCK]] = value
        b[km.PIXEL], b[km.U0], b[block.V0] = point[1] / focal, *place
        for name, values in edges_of(surfaces, np.array([0]), facing[None]).items():
            b[getattr(block, name)] = values[0]
        c = np.zeros(km.CHUNK_ROWS * kf.CHUNK, np.float32)
        gradients(rotation.astype(np.float32), textures.transforms[0], b, c)
        across = (seen(x + 0.5, y)[0] - seen(x - 0.5, y)[0], seen(x, y + 0.5)[0] - seen(x, y - 0.5)[0])
        found = np.array([[c[kf.UX], c[kf.VX]], [c[kf.UY], c[kf.VY]]])
        np.testing.assert_allclose(found, across, rtol=5e-3, atol=1e-6)


@pytest.mark.slow
def test_a_board_at_elevation_five_neither_shimmers_nor_blurs():
    """Against 32 x 32 samples a pixel of a checkerboard."""
    size, texels, period = 192, 64, 1.0
    squares = (np.add.outer(np.arange(texels) // 32, np.arange(texels) // 32) % 2).astype(np.uint8) * 255
    board = Image("board", np.repeat(squares[..., None], 4, axis=2) | np.array([0, 0, 0, 255], np.uint8))
    surfaces, textures = packed(card(Material(base_color_texture=Texture(0)), [board]))
    vertices = surfaces.vertices.copy()
    far = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    vertices[:4, 11:14], vertices[:4, 3:5], vertices[:4, :3] = far, far[:, :2] / period, (0, 0, 1)
    surfaces = surfaces._replace(vertices=vertices)
    rotation, focal, eye = plane_camera(5, 1.0, size)
    row, column = np.mgrid[:size, :size]
    below = row > size // 2 - int(np.tan(np.radians(5)) * focal) + 2  # short of the horizon
    x, y = column[below] + 0.5, row[below] + 0.5
    ray, along, point = plane_hits(rotation, focal, eye, x, y, size)
    found = made(
        surfaces,
        textures,
        {
            "V": -ray / np.linalg.norm(ray, axis=1, keepdims=True),
            "G": np.tile([0, 0, 1], (len(x), 1)),
            "N": np.tile([0, 0, 1], (len(x), 1)),
            "PIXEL": along / focal,
            "U0": point[:, 0] / period,
            "V0": point[:, 1] / period,
        },
        view=view_of(rotation),
    )["RED"]
    truth = np.zeros(len(x))
    for dx, dy in np.ndindex(32, 32):
        place = plane_hits(rotation, focal, eye, x + (dx + 0.5) / 32 - 0.5, y + (dy + 0.5) / 32 - 0.5, size)[2] / period
        truth += (np.floor(place[:, 0] * 2) + np.floor(place[:, 1] * 2)) % 2
    truth /= 1024
    error = np.abs(found - truth)
    near, far = along < 12, along > 40
    assert error[near].mean() < 0.008
    assert error.mean() < 0.012
    # Far away there is no pattern that is not in truth; near by all contrast is kept.
    assert found[far].std() < truth[far].std()
    assert np.corrcoef(found[near], truth[near])[0, 1] > 0.998
    assert found[near].std() == pytest.approx(truth[near].std(), rel=0.01)


@pytest.mark.parametrize("wrap", ["repeat", "clamp", "mirror"])
def test_opacity_is_that_of_the_nearest_texel(wrap):
    texture = Texture(0, wrap_s=wrap, wrap_t=wrap, scale=(1.5, 1), texcoord=1)
    mesh = card(Material(base_color_texture=texture, alpha_mode="MASK"), [NOISE], uv1=np.zeros((4, 2), np.float32))
    surfaces, textures = packed(mesh)
    for u, v in RNG.uniform(-2, 3, (200, 2)).astype(np.float32):
        place = np.floor(np.array([v, u * np.float32(1.5)], float) * 16).astype(int)
        if wrap == "repeat":
            place %= 16
        elif wrap == "clamp":
            place = place.clip(0, 15)
        else:
            place = np.where(place % 32 < 16, place % 32, 31 - place % 32)
        zero = np.float32(0)
        found = opacity(surfaces, textures, np.uintp(0), zero, zero, u, v)
        assert found == pytest.approx(NOISE.pixels[tuple(place)][3] / 255, abs=1e-4)
