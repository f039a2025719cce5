import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from quick import quick
from truth_scenes import LENSES, cube, least_weight, lens, mesh_of, orbit_camera, placed, random_soup, sphere
from viewsphere.assets.mesh import Image, Material, Texture
from viewsphere.engines.raster.antialiasing.kernels_samples import TIE
from viewsphere.engines.raster.antialiasing.samples import NOWHERE, OFFSETS, edge_samples, layers
from viewsphere.engines.raster.shading.kernels_paint import BRIGHT, GLINT, average_samples, brighten_lines, shared_samples
from viewsphere.geometry.camera import pixel_rays
from viewsphere.model.sensors.camera import Camera
from viewsphere.truth.raster.visibility import rasterize
from viewsphere_zoo import build


def fine(geometry, camera):
    """Truth's triangle and inverse depth at the four samples of every pixel, (H, W, 4): they are centres of sixteenths."""
    seen = rasterize(geometry, camera, subdivision=4)
    at = [(int(4 * y), int(4 * x)) for x, y in OFFSETS]
    return tuple(np.stack([a[y::4, x::4] for y, x in at], axis=-1) for a in (seen.triangle, seen.inverse_depth))


def owner_of(geometry):
    return geometry.triangle_object.copy()


def owner_at(geometry, triangle):
    """The owners of seen triangles, -1 where none."""
    return np.append(owner_of(geometry), -1)[triangle]


def looks_different(geometry, visibility, triangle, inverse):
    """Pixels (H * W,) at some of whose samples (H, W, 4) another surface is seen than at the centre."""
    owner = np.append(owner_of(geometry), -1)
    normals = np.concatenate([geometry.triangle_normals, np.zeros((1, 3), np.float32)])
    t, depth = visibility.triangle[..., None], visibility.inverse_depth[..., None]
    bend = np.abs((normals[t] * normals[triangle]).sum(axis=-1))
    alike = (owner[t] == owner[triangle]) & (bend >= 0.94) & (np.maximum(depth, inverse) <= np.minimum(depth, inverse) * 1.01)
    return ((t != triangle) & ~alike).any(axis=-1).reshape(-1)


def check_edges(geometry, camera, least=0, equal=0.99):
    """A share of the samples equals truth's; returns them and which pixels have a sample that looks different."""
    visibility = rasterize(geometry, camera)
    samples = edge_samples(geometry, camera, visibility, owner_of(geometry))
    triangle, inverse = fine(geometry, camera)
    look = looks_different(geometry, visibility, triangle, inverse)
    if samples is None:
        assert least == 0
        return None, look
    assert len(samples.pixels) >= least
    assert len(set(samples.pixels)) == len(samples.pixels)
    seen, depth = samples.triangle.reshape(-1, 4), samples.inverse_depth.reshape(-1, 4)
    expected = triangle.reshape(-1, 4)[samples.pixels], inverse.reshape(-1, 4)[samples.pixels]
    in_one_place = np.isclose(depth, expected[1], rtol=1e-6, atol=0)
    assert ((seen == expected[0]) | in_one_place & (seen >= 0)).mean() >= equal
    assert in_one_place.mean() >= min(equal, 0.95)
    corner = np.stack([samples.pixels % camera.width, samples.pixels // camera.width], axis=1)[:, None]
    assert np.array_equal(samples.position.reshape(-1, 4, 2), (corner + np.array(OFFSETS)).astype(np.float32))
    return samples, look


@pytest.mark.parametrize("seed", range(8))
def test_samples_are_truths(seed):
    rng = np.random.default_rng(seed)
    geometry = placed(random_soup(rng, 60), random_soup(rng, 200, size=0.1), ground=bool(seed % 2))
    intrinsics = lens(60, 44, rng.uniform(0.4, 1.6), cx=rng.uniform(20, 40), cy=rng.uniform(10, 30), skew=rng.uniform(-2, 2))
    camera = orbit_camera(intrinsics, *rng.uniform(-3, 3, 2), 10 ** rng.uniform(-0.5, 1), tilt=rng.uniform(-1, 1))
    samples, look = check_edges(geometry, camera, least=20)
    assert len(samples.pixels) >= 0.9 * look.sum()  # the rest are holes that no centre sees


def test_inside_a_box_across_the_camera_plane():
    geometry = placed(cube(2.0), cube(0.3))
    camera = orbit_camera(lens(64, 48, 1.8), 0.3, 0.2, 1.2, tilt=0.2)
    samples, look = check_edges(geometry, camera, least=40)
    assert len(set(samples.pixels) & set(np.flatnonzero(look))) >= 0.95 * look.sum()


def test_nothing_to_smooth():
    geometry = placed(mesh_of([[-50, 3, -50], [50, 9, -50], [50, 9, 50], [-50, 3, 50]], [[0, 1, 2], [0, 2, 3]]))
    camera = Camera(lens(64, 48, 0.9), orbit_camera(lens(), 0, 0).R, np.zeros(3))
    assert check_edges(geometry, camera)[0] is None


@pytest.mark.parametrize("name", quick(["car", "bicycle"], "car"))
def test_dense_models(name):
    """Silhouettes of many small triangles and of thin spokes: nearly all samples are truth's, and they are not biased."""
    mesh = build(name, np.random.default_rng(1))
    geometry = placed(mesh, ground=True)
    size = np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    for azimuth, elevation in ((0.3, 0.2), (1.5, 0.02)):
        middle = (geometry.vertices[: len(mesh.vertices)].min(axis=0) + geometry.vertices[: len(mesh.vertices)].max(axis=0)) / 2
        camera = orbit_camera(lens(320, 240, 0.6), azimuth, elevation, 1.8 * size, target=tuple(middle))
        samples, look = check_edges(geometry, camera, least=400, equal=0.985)
        visibility, (triangle, _) = rasterize(geometry, camera), fine(geometry, camera)
        covered = np.repeat(owner_at(geometry, visibility.triangle).reshape(-1, 1) == 1, 4, axis=1)
        covered[samples.pixels] = owner_at(geometry, samples.triangle).reshape(-1, 4) == 1
        expected = owner_at(geometry, triangle).reshape(-1, 4) == 1
        here = covered[samples.pixels].sum() - expected[samples.pixels].sum(dtype=int)
        assert abs(here) < 0.005 * samples.triangle.size
        assert abs(covered.sum() - expected.sum(dtype=int)) < 0.01 * samples.triangle.size  # with gaps that no centre sees
        assert len(set(samples.pixels) & set(np.flatnonzero(look))) >= 0.9 * look.sum()


@pytest.mark.parametrize("angle", [0.0, 0.02, 0.3, math.pi / 4, 1.5, math.pi / 2])
@pytest.mark.parametrize("pieces", [1, 40])
def test_thin_wires_are_unbroken(angle, pieces):
    """A wire of a third of a pixel: whatever the centres miss, every pixel that has a sample on it is found."""
    across, along = 0.004 * np.array([-math.sin(angle), 0, math.cos(angle)]), np.array([math.cos(angle), 0, math.sin(angle)])
    ends = np.linspace(-1, 1, pieces + 1)
    vertices = np.concatenate([[e * along - across, e * along + across] for e in ends])
    quads = np.arange(pieces)[:, None] * 2
    triangles = np.concatenate([quads + np.array([0, 2, 1]), quads + np.array([1, 2, 3])])
    wire = mesh_of(vertices, triangles)
    wall = mesh_of([[-9, 4, -9], [9, 4, -9], [9, 4, 9], [-9, 4, 9]], [[0, 1, 2], [0, 2, 3]])
    for geometry in (placed(wire), placed(wire, wall), placed(wall, wire)):
        camera = orbit_camera(lens(120, 120, 2 * math.atan(1 / 4)), 0.0, 0.0, 5.0, target=(0.003, 0, 0.005))
        samples, look = check_edges(geometry, camera, least=60)
        assert set(np.flatnonzero(look)) == set(samples.pixels)


def line_in_wall(angle, width, pieces, proud):
    """A wall across the view with a line of 96 pixels' length, cut into it, or 0.1 mm proud of it: the wall first."""
    turn = np.array([[math.cos(angle), 0, math.sin(angle)], [0, 1, 0], [-math.sin(angle), 0, math.cos(angle)]])
    half, ends = width / 96, np.linspace(-1, 1, pieces + 1)

    def plates(boxes, y):
        corners = [[[a, y, b], [c, y, b], [c, y, d], [a, y, d]] for a, b, c, d in boxes]
        quads = 4 * np.arange(len(boxes))[:, None]
        return mesh_of(
            np.concatenate(corners) @ turn, np.concatenate([quads + np.array([0, 1, 2]), quads + np.array([0, 2, 3])])
        )

    line = plates([(a, -half, b, half) for a, b in pairwise(ends)], -1e-4 * proud)
    around = [(-1, half, 1, 9), (-1, -9, 1, -half), (-9, -9, -1, 9), (1, -9, 9, 9)]
    return placed(plates([(-9, -9, 9, 9)] if proud else around, 0.0), line)


@pytest.mark.parametrize("angle", [0.05, 0.3, 0.6, 0.9, 1.2, 1.53])
@pytest.mark.parametrize("width", [0.2, 0.3, 0.4])
def test_thin_lines_in_a_surface_are_unbroken(angle, width):
    """A seam narrower than a pixel: as much of it is covered as it is large, all along it, wherever the centres are."""
    camera = orbit_camera(lens(120, 120, 2 * math.atan(1 / 4)), 0.0, 0.0, 5.0, target=(0.003, 0, 0.005))
    window = 4 if width < 0.25 else 2  # four samples may miss the line in one row, and the thinnest in three
    for pieces, proud in ((1, False), (1, True), (40, False), (40, True)):
        geometry = line_in_wall(angle, width, pieces, proud)
        samples, look = check_edges(geometry, camera, least=20)
        assert set(samples.pixels) <= set(np.flatnonzero(look))
        assert len(samples.pixels) >= (0.97 if pieces > 1 else 1) * look.sum()
        covered = (owner_at(geometry, rasterize(geometry, camera).triangle) == 2).astype(float).reshape(-1)
        assert set(np.flatnonzero(covered)) <= set(samples.pixels)
        covered[samples.pixels] = (owner_at(geometry, samples.triangle) == 2).reshape(-1, 4).mean(axis=1)
        assert covered.sum() == pytest.approx(96 * width, rel=0.15)
        steep = angle > math.pi / 4
        along = covered.reshape(120, 120).sum(axis=1 if steep else 0)
        reach = 48 * max(abs(math.cos(angle)), math.sin(angle)) - 3
        inner = along[int(60 - reach) : int(60 + reach)]
        share = np.convolve(inner, np.ones(window) / window, "valid") / inner.mean()
        assert share.min() > 0.25


def test_cut_outs():
    checks = np.zeros((8, 8, 4), np.uint8)
    checks[..., 3] = 255 * (np.indices((8, 8)).sum(0) % 2)
    leaf = mesh_of(
        [[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], [[0, 1, 2], [0, 2, 3]],
        uv0=np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32), images=(Image("checks", checks),),
        materials=(Material(alpha_mode="MASK", base_color_texture=Texture(0)),),
    )  # fmt: skip
    camera = orbit_camera(lens(64, 48, 0.8), 0.4, 0.3, 4.0)
    samples, look = check_edges(placed(leaf, cube(0.2), ground=True), camera, least=200)
    assert len(samples.pixels) >= 0.95 * look.sum()  # the rest are holes that no centre sees


def meets(geometry, camera, rays):
    """All surfaces along rays (N, 3), brute force: lists of (1/s, triangle), and how sure each ray's list is."""
    q = geometry.vertices[geometry.triangles] @ camera.R.T + camera.t
    e = np.stack([np.cross(q[:, 1], q[:, 2]), np.cross(q[:, 2], q[:, 0]), np.cross(q[:, 0], q[:, 1])], axis=1)
    det = np.einsum("ti,ti->t", e[:, 0], q[:, 0])
    values = np.einsum("tki,ni->ntk", e / np.where(det == 0, 1, det)[:, None, None], rays)
    inverse = values.sum(axis=-1)
    within = least_weight(geometry, values[..., 1] / inverse, values[..., 2] / inverse)
    hit = (within >= 0) & (inverse > 0) & (det != 0)
    margin = np.abs(values / np.abs(values).max(axis=-1, keepdims=True)).min(axis=(1, 2))
    return hit, inverse, margin


def sample_rays(camera):
    """(H * W * 4, 3)"""
    w, h = camera.width, camera.height
    pixels = pixel_rays(camera.intrinsics, 4).reshape(h, 4, w, 4, 3)
    return np.stack([pixels[:, int(4 * y), :, int(4 * x)] for x, y in OFFSETS], axis=2).reshape(-1, 3)


@pytest.mark.parametrize("name", quick(LENSES, "pinhole"))
def test_layers_equal_brute_force(name):
    deep = 0
    for seed in range(4):
        rng = np.random.default_rng(seed)
        geometry = placed(random_soup(rng, 50), random_soup(rng, 50), ground=bool(seed % 2))
        fov = rng.uniform(0.5, 1.3) if name != "fisheye" else rng.uniform(2, 4)
        camera = orbit_camera(lens(32, 24, fov, LENSES[name]), *rng.uniform(-3, 3, 2), rng.uniform(0.5, 5))
        see_through = np.append(rng.uniform(size=len(geometry.triangles)) < 0.6, False)
        see_through[geometry.triangle_start[-1] :] = False
        visibility = rasterize(geometry, camera)
        rays = pixel_rays(camera.intrinsics).reshape(-1, 3)
        shown = visibility.triangle.reshape(-1), visibility.inverse_depth.reshape(-1)
        deep += check_layers(geometry, camera, shown, see_through, rays, None)
        samples = edge_samples(geometry, camera, visibility, owner_of(geometry))
        if samples is None:
            continue
        pixels = rng.permutation(samples.pixels)
        rays = sample_rays(camera).reshape(-1, 4, 3)[pixels].reshape(-1, 3)
        shown = samples_of(geometry, camera, pixels, rays)
        deep += check_layers(geometry, camera, shown, see_through, rays, pixels)
    assert deep > 1000


def samples_of(geometry, camera, pixels, rays):
    """What truth sees at the samples of these pixels: triangle and inverse depth, (4 * len(pixels),)."""
    if camera.distortion is None:
        return tuple(a.reshape(-1, 4)[pixels].reshape(-1) for a in fine(geometry, camera))
    hit, inverse, _ = meets(geometry, camera, rays)
    inverse = np.where(hit, inverse, 0)
    return np.where(hit.any(axis=1), inverse.argmax(axis=1), -1).astype(np.int32), inverse.max(axis=1).astype(np.float32)


def check_layers(geometry, camera, shown, see_through, rays, pixels):
    """Compare with all surfaces along each ray; returns how many rays meet more than one that counts."""
    found = layers(geometry, camera, *shown, see_through, pixels)
    stacks = [[] for _ in rays]
    for i, layer in enumerate(found):
        assert layer.slot.dtype == layer.triangle.dtype == np.int32
        assert layer.inverse_depth.dtype == np.float32
        assert len(set(layer.slot)) == len(layer.slot)
        assert (see_through[layer.triangle] == (i > 0)).all()
        for slot, t, inverse in zip(layer.slot, layer.triangle, layer.inverse_depth, strict=True):
            stacks[slot].append((t, inverse))
    hit, inverse, margin = meets(geometry, camera, rays)
    checked = 0
    for i in np.flatnonzero(margin > 1e-9):
        order = np.argsort(inverse[i])
        order = [t for t in order if hit[i, t]]
        solid = [k for k, t in enumerate(order) if not see_through[t]]
        expected = order[solid[-1] :] if solid else order
        if not expected or not see_through[expected[-1]]:
            expected = []
        assert [t for t, _ in stacks[i]] == expected[:1] * bool(solid and expected) + expected[bool(solid) :][-8:]
        np.testing.assert_allclose([d for _, d in stacks[i]], [inverse[i, t] for t, _ in stacks[i]], rtol=2e-7)
        checked += len(expected) > 1
    return checked


def test_decals_lie_on_what_they_stick_to():
    """A decal in the very plane of a wall, cut into other triangles: it is on top, whichever comes first."""
    wall = mesh_of([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], [[0, 1, 2], [0, 2, 3]])
    inner = [[-0.5, 0, -0.4], [0.6, 0, -0.5], [0.5, 0, 0.6], [-0.4, 0, 0.5]]
    decal = mesh_of(inner, [[0, 1, 3], [1, 2, 3]])
    camera = orbit_camera(lens(64, 64, 0.7), 0.5, 0.3, 4.0)
    counts = []
    for first in (0, 1):
        geometry = placed(*(wall, decal)[:: 1 - 2 * first])
        see_through = np.array([first == 0, first == 0, False, False, False])
        see_through[:4] = [first == 1] * 2 + [first == 0] * 2
        visibility = rasterize(geometry, camera)
        stack = layers(geometry, camera, visibility.triangle.reshape(-1), visibility.inverse_depth.reshape(-1), see_through)
        assert len(stack) == 2
        alone = rasterize(placed(decal), camera).triangle.reshape(-1) >= 0
        assert set(stack[1].slot) == set(np.flatnonzero(alone))
        assert set(stack[0].slot) == set(stack[1].slot)
        counts.append(len(stack[1].slot))
    assert counts[0] == counts[1] > 200


def test_two_decals_and_backs():
    """The later of two decals is on top; a surface and its back, or two triangles on a common edge, are one."""
    corners = [[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]]
    one = mesh_of(corners, [[0, 1, 2], [0, 2, 3]])
    both = mesh_of(corners, [[0, 1, 2], [0, 2, 3], [2, 1, 0], [3, 2, 0]])
    camera = orbit_camera(lens(64, 64, 0.7, cx=32.5, cy=32.5), 0.0, 0.0, 4.0)  # centres on the diagonal
    for geometry, depth in ((placed(one), 1), (placed(both), 1), (placed(one, one), 1), (placed(one, replace(one)), 1)):
        see_through = np.append(np.ones(len(geometry.triangles), bool), False)
        visibility = rasterize(geometry, camera)
        shown = visibility.triangle.reshape(-1), visibility.inverse_depth.reshape(-1)
        stack = layers(geometry, camera, *shown, see_through)
        assert len(stack) == depth + 1
        assert len(stack[0].slot) == 0
        assert set(stack[1].slot) == set(np.flatnonzero(shown[0] >= 0))
    small = mesh_of([[-0.5, 0, -0.4], [0.6, 0, -0.5], [0.5, 0, 0.6], [-0.4, 0, 0.5]], [[0, 1, 3], [1, 2, 3]])
    for pair, top in (((one, small), (2, 3)), ((small, one), (2, 3))):
        geometry = placed(*pair)
        visibility = rasterize(geometry, camera)
        shown = visibility.triangle.reshape(-1), visibility.inverse_depth.reshape(-1)
        stack = layers(geometry, camera, *shown, np.array([True] * 4 + [False]))
        assert len(stack) == 3
        assert set(stack[2].triangle) == set(top)
        assert TIE < 1e-4


def test_no_more_than_eight_layers():
    panes = [mesh_of([[-1, y, -1], [1, y, -1], [0, y, 1]], [[0, 1, 2]]) for y in np.linspace(0, 1, 12)]
    geometry = placed(*panes, ground=True)
    camera = orbit_camera(lens(32, 32, 0.5), 0.0, 0.3, 5.0)
    visibility = rasterize(geometry, camera)
    shown = visibility.triangle.reshape(-1), visibility.inverse_depth.reshape(-1)
    stack = layers(geometry, camera, *shown, np.array([True] * 12 + [False] * 3))
    assert len(stack) == 9
    middle = 16 * 32 + 16
    assert [int(layer.triangle[layer.slot == middle][0]) for layer in stack[1:]] == list(range(7, -1, -1))
    assert len(stack[0].slot[stack[0].slot == middle]) == 1
    assert layers(geometry, camera, *shown, np.zeros(15, bool)) == []


@pytest.mark.parametrize("name", [name for name in LENSES if name != "pinhole"])
def test_distorted_lenses(name):
    rng = np.random.default_rng(3)
    geometry = placed(random_soup(rng, 80), random_soup(rng, 300, size=0.1), ground=True)
    fov = 1.2 if name != "fisheye" else 3.6
    camera = orbit_camera(lens(60, 44, fov, LENSES[name]), 0.3, 0.4, 4.0)
    visibility = rasterize(geometry, camera)
    samples = edge_samples(geometry, camera, visibility, owner_of(geometry))
    rays = sample_rays(camera).reshape(-1, 4, 3)[samples.pixels].reshape(-1, 3)
    np.testing.assert_allclose(samples.rays, rays, atol=2e-7)
    hit, inverse, margin = meets(geometry, camera, rays)
    inverse = np.where(hit, inverse, 0)
    expected = np.where(hit.any(axis=1), inverse.argmax(axis=1), -1)
    sure = margin > 1e-9
    assert sure.mean() > 0.95
    assert len(samples.pixels) > 200
    assert np.array_equal(samples.triangle[sure], expected[sure])
    np.testing.assert_allclose(samples.inverse_depth[sure], inverse.max(axis=1)[sure], rtol=1e-6)


def test_one_glint_among_four_samples_is_no_white_dot():
    """What one sample of a thin thing mirrors of a lamp is limited; light that all four show is not, nor is coverage."""
    samples = np.full((12, 4), 0.1, np.float32)
    samples[1] = 500, 250, 0, 1
    samples[4:8] = 30, 20, 10, 1
    samples[8:12, :3] = np.arange(12).reshape(4, 3) / 12
    like = ~np.arange(12, dtype=np.int32)
    found = np.zeros((5, 4), np.float32)
    glints, means = average_samples(np.array([3, 0, 4], np.int32), like, samples, found)
    np.testing.assert_allclose(found[3], [0.3 / 4 + GLINT / 4, 0.3 / 4 + GLINT / 8, 0.3 / 4, 1.3 / 4], rtol=1e-5)
    np.testing.assert_allclose(found[0], [30, 20, 10, 1], rtol=1e-5)
    np.testing.assert_allclose(found[4], samples[8:12].mean(axis=0), rtol=1e-5)
    assert not found[1:3].any()
    assert glints.tolist() == [0]
    np.testing.assert_allclose(means, [[500.3 / 4, 250.3 / 4, 0.3 / 4]], rtol=1e-5)


@pytest.mark.parametrize(
    ("x", "y"), [((0, 1), (0, 0)), ((8, 0), (2, 1)), ((0, 1), (0, 1)), ((5, 1), (5, -1)), ((3, 1), (2, 0))]
)
def test_a_bright_line_is_as_bright_as_it_is(x, y):
    """Each of its pixels has one bright sample of four: those between two others have all their light, the ends do not.

    x, y: of its first pixel, and a step.
    """
    along = np.arange(4, dtype=np.int32)
    pixels = 9 * (y[0] + y[1] * along) + x[0] + x[1] * along
    samples, found = np.full((16, 4), 0.1, np.float32), np.zeros((54, 4), np.float32)
    samples[2::4, :3] = 30, 15, 0
    glints, means = average_samples(pixels, ~np.arange(16, dtype=np.int32), samples, found)
    brighten_lines(pixels[glints], means, 9, found)
    true = np.array([30.3, 15.3, 0.3, 0.4]) / 4
    np.testing.assert_allclose(found[pixels[1:-1]], np.tile(true, (2, 1)), rtol=1e-5)
    np.testing.assert_allclose(found[pixels[[0, -1]], 0], (GLINT + 0.3) / 4, rtol=1e-5)
    assert not np.delete(found, pixels, axis=0).any()


def test_a_pixels_mean_is_of_the_centres_as_they_were():
    """Neighbours that take each other's colour do not take each other's mean."""
    found = np.zeros((2, 4), np.float32)
    found[1] = 1
    average_samples(np.array([0, 1], np.int32), np.array([0, 0, 0, 1, 0, 1, 1, 1], np.int32), found[:0], found)
    np.testing.assert_allclose(found[:, 0], [0.25, 0.75])


@pytest.mark.parametrize("name", ["car", "bicycle"])
def test_samples_take_the_colour_of_what_they_show(name):
    """Of a centre less than a pixel away that shows the same thing, or their own; never of a centre that is too bright."""
    geometry = placed(build(name, np.random.default_rng(1)), ground=True)
    camera = orbit_camera(lens(160, 120, 0.6), 0.3, 0.2, 7.0)
    visibility, owner, normals = rasterize(geometry, camera), owner_of(geometry), geometry.triangle_normals
    samples = edge_samples(geometry, camera, visibility, owner)
    radiance = np.full((160 * 120, 4), 0.5, np.float32)
    radiance[::7] = 2 * BRIGHT
    shown, centres = (samples.triangle, samples.inverse_depth), (visibility.triangle, visibility.inverse_depth)
    like, rows = shared_samples(samples.pixels, *shown, *centres, owner, normals, NOWHERE, radiance)
    taken = np.flatnonzero(like >= 0)
    source = like[taken]
    assert len(taken) > 0.5 * len(like)
    assert np.array_equal(
        owner_at(geometry, samples.triangle[taken]), owner_at(geometry, visibility.triangle.reshape(-1)[source])
    )
    y, x = np.divmod(source, 160)
    assert np.hypot(*(samples.position[taken] - np.stack([x, y], axis=1) - 0.5).T).max() < 1
    assert (radiance[source, 0][samples.triangle[taken] >= 0] <= BRIGHT).all()
    own = np.flatnonzero(like < 0)
    k = ~like[own]  # each has its own colour, or that of another of its pixel
    assert np.array_equal(rows[k // 4], own // 4)
    assert np.array_equal(
        owner_at(geometry, samples.triangle[own]), owner_at(geometry, samples.triangle[4 * rows[k // 4] + k % 4])
    )
    assert (like[4 * rows[k // 4] + k % 4] == ~k).all()


@pytest.mark.parametrize(("subdivisions", "distance"), [(5, 7.0), (6, 4.0)])
def test_no_sample_shows_the_inside_of_a_closed_ball(subdivisions, distance):
    """Its triangles are about a pixel in size: many lie between the centres, and what is behind them is the ball's inside."""
    geometry = placed(sphere(subdivisions))
    camera = orbit_camera(lens(320, 240, 0.8), 0.4, 0.3, distance)
    samples = edge_samples(geometry, camera, rasterize(geometry, camera), owner_of(geometry))
    on_ball = samples.triangle >= 0
    corners = geometry.vertices[geometry.triangles[samples.triangle[on_ball]]]
    outward = (geometry.triangle_normals[samples.triangle[on_ball]] * (camera.center - corners.mean(axis=1))).sum(axis=1)
    assert on_ball.sum() > 400
    assert (outward > 0).all()
