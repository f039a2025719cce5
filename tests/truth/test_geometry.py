import math
import mmap
import sys
from pathlib import Path

import numpy as np
import pytest

from truth_scenes import EVERY, cube, lens, mesh_of, orbit_camera, placed
from viewsphere.assets.mesh import Image, Material, Texture
from viewsphere.labels import observe
from viewsphere.truth.raster.alpha_masks import NEVER, SURFACE
from viewsphere.truth.raster.geometry import moved
from viewsphere.truth.raster.sparse import zeros
from viewsphere.truth.raster.visibility import rasterize

QUAD = [[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]]
UV = np.float32([[0, 1], [1, 1], [1, 0], [0, 0]])  # v = 0 on top


def grid(rng, rows, columns):
    alpha = rng.integers(0, 256, (rows, columns)).astype(np.uint8)
    pixels = np.zeros((rows, columns, 4), np.uint8)
    pixels[..., 3] = alpha
    return Image("grid", pixels), alpha


def card(material, image=None, uv=UV, **fields):
    images = () if image is None else (image,)
    return mesh_of(QUAD, [[0, 1, 2], [0, 2, 3]], materials=(material,), images=images, uv0=uv, **fields)


def seen_head_on(mesh, size=64, distortion=None, label_alpha=0.5):
    """The card fills the picture exactly: 64 x 64 pixels on 2 x 2 m."""
    geometry = placed(mesh, label_alpha=label_alpha)
    intrinsics = lens(size, size, fx=size, fy=size, distortion=distortion)
    camera = orbit_camera(intrinsics, distance=2.0)
    return rasterize(geometry, camera).triangle >= 0


def test_objects_lie_in_order_and_the_ground_last():
    move = np.array([[0, -1, 0, 4], [1, 0, 0, 5], [0, 0, 1, 6], [0, 0, 0, 1.0]])
    geometry = placed(cube(0.5), cube(2.0), moves=[np.eye(4), move], ground=True)
    assert geometry.object_count == 2
    assert geometry.vertex_start == (0, 24, 48)
    assert geometry.triangle_start == (0, 12, 24)
    assert len(geometry.vertices) == 52 and len(geometry.triangles) == 26
    for name in ("normals", "coordinates"):
        assert len(getattr(geometry, name)) == 52
    np.testing.assert_allclose(geometry.vertices[24:48], geometry.coordinates[24:48] @ move[:3, :3].T + move[:3, 3], atol=1e-12)
    np.testing.assert_allclose(geometry.normals[24:48], cube().normals @ move[:3, :3].T, atol=1e-7)
    assert geometry.triangle_object.tolist() == [1] * 12 + [2] * 12 + [0] * 2
    assert geometry.triangle_category.tolist() == [10] * 12 + [11] * 12
    assert geometry.triangle_part.tolist() == [i // 2 + 1 for i in range(12)] * 2
    assert geometry.ground_z == -0.5
    assert (geometry.vertices[48:, 2] == -0.5).all()
    assert np.array_equal(geometry.triangle_normals[24:], [[0, 0, 1]] * 2)
    assert np.abs(geometry.vertices[48:, :2]).min() > 1000


def test_ground_lies_at_the_lowest_used_vertex():
    mesh = mesh_of([*QUAD, [0, 0, -9]], [[0, 1, 2], [0, 2, 3]])
    assert placed(mesh, ground=True).ground_z == -1
    assert placed(ground=True).ground_z == 0
    assert placed(mesh).ground_z is None


def test_ids_must_be_in_order():
    from viewsphere.model.model_spec import ModelSpec
    from viewsphere.model.thing import Thing
    from viewsphere.truth.raster.geometry import build_geometry

    spec = ModelSpec(key="m", source="m", category="thing", category_id=1)
    with pytest.raises(ValueError, match=r"expected ids 1\.\.N in order, then 0, got \[2\]"):
        build_geometry([Thing(id=2, model=spec)], [cube()], False, 0.01)
    with pytest.raises(ValueError, match=r"got \[0, 1\]"):
        build_geometry([Thing(id=0, model=spec), Thing(id=1, model=spec)], [cube()] * 2, False, 0.01)


def test_scenery_comes_after_the_objects_and_is_background():
    move = np.eye(4)
    move[:3, 3] = 5, 0, -1
    geometry = placed(cube(), cube(), cube(), moves=[np.eye(4), np.eye(4), move], ground=True, scenery=1)
    assert geometry.object_count == 2 and geometry.has_scenery
    assert geometry.vertex_start == (0, 24, 48, 72) and geometry.triangle_start == (0, 12, 24, 36)
    for name in ("object", "part", "category"):
        assert (getattr(geometry, f"triangle_{name}")[24:] == 0).all()
        assert (getattr(geometry, f"triangle_{name}")[:24] > 0).all()
    assert geometry.ground_z == -1.5
    assert not placed(cube(), ground=True).has_scenery
    alone = placed(cube(), cube(), moves=[np.eye(4), move])
    assert np.array_equal(geometry.triangle_normals[24:36], alone.triangle_normals[12:24])
    assert np.array_equal(geometry.vertices[48:72], alone.vertices[24:48])


def test_scenery_that_is_kept_is_told_from_another():
    move = np.eye(4)
    move[0, 3] = 5
    a, b = cube(), cube(0.25)
    first = placed(a, b, moves=[np.eye(4), move], scenery=1)
    again = placed(a, b, moves=[move, move], scenery=1)
    move[0, 3] = 7
    moved = placed(a, b, moves=[np.eye(4), move], scenery=1)
    other = placed(a, cube(0.3), moves=[np.eye(4), move], scenery=1)
    assert first.vertices[24:, 0].max() == again.vertices[24:, 0].max() == 5.25
    assert moved.vertices[24:, 0].max() == 7.25
    assert other.vertices[24:, 0].max() == pytest.approx(7.3)


def test_an_empty_stage_can_be_seen():
    geometry = placed()
    camera = orbit_camera(lens(16, 16))
    visibility = rasterize(geometry, camera)
    assert (visibility.triangle == -1).all()
    observed = observe(geometry, camera, visibility, ["depth", "instances", "normals", "triangles"])
    assert np.isinf(observed["depth"]).all()
    assert (observed["instances"] == 0).all()


@pytest.mark.parametrize("mode, cutoff", [("MASK", 0.4), ("BLEND", 0.7)])
@pytest.mark.parametrize("shape", [(8, 8), (4, 16), (1, 2)])
def test_texels_are_surface_by_their_alpha(mode, cutoff, shape):
    image, alpha = grid(np.random.default_rng(1), *shape)
    material = Material(alpha_mode=mode, alpha_cutoff=0.4, base_color=(1, 1, 1, 0.9), base_color_texture=Texture(0))
    expected = alpha / 255 * 0.9 >= cutoff
    expected = np.kron(expected, np.ones((64 // shape[0], 64 // shape[1]), bool))
    assert np.array_equal(seen_head_on(card(material, image), label_alpha=0.7), expected)


@pytest.mark.parametrize("wrap, order", [("repeat", [0, 1, 2, 3]), ("mirror", [3, 2, 1, 0]), ("clamp", [3, 3, 3, 3])])
def test_wrapping(wrap, order):
    """The card shows u from 1 to 2."""
    pixels = np.zeros((1, 4, 4), np.uint8)
    pixels[0, :, 3] = 0, 255, 0, 255
    material = Material(alpha_mode="MASK", base_color_texture=Texture(0, wrap_s=wrap, wrap_t="clamp"))
    mesh = card(material, Image("strip", pixels), uv=UV + np.float32([1, 0]))
    expected = np.repeat(pixels[0, order, 3] > 0, 16)
    assert np.array_equal(seen_head_on(mesh), np.tile(expected, (64, 1)))


def test_texture_transform():
    """A quarter turn, half size and an offset, as KHR_texture_transform's own test model expects (see its README)."""
    image, alpha = grid(np.random.default_rng(2), 8, 8)
    texture = Texture(0, offset=(0.25, 1.0), rotation=math.pi / 2, scale=(0.5, 1.0))
    material = Material(alpha_mode="MASK", base_color_texture=texture)
    j, i = np.mgrid[:64, :64]
    u, v = (i + 0.5) / 64 * 0.5, (j + 0.5) / 64
    u, v = v + 0.25, -u + 1.0  # counter-clockwise on the picture
    expected = alpha[(v * 8).astype(int) % 8, (u * 8).astype(int) % 8] / 255 >= 0.5
    assert np.mean(seen_head_on(card(material, image)) != expected) < 0.01


def test_texture_matrix():
    """The product of the specification's three matrices: translation, rotation, scale."""
    texture = Texture(0, offset=(0.1, -0.2), rotation=0.7, scale=(2.0, 3.0))
    c, s = math.cos(0.7), math.sin(0.7)
    product = np.array([[1, 0, 0.1], [0, 1, -0.2], [0, 0, 1]]) @ [[c, s, 0], [-s, c, 0], [0, 0, 1]] @ np.diag([2, 3, 1])
    assert texture.matrix.dtype == np.float64
    assert np.allclose(texture.matrix, product[:2], rtol=0, atol=1e-15)


def test_vertex_alpha_is_interpolated():
    colors = np.ones((4, 4), np.float32)
    colors[:, 3] = UV[:, 0]
    seen = seen_head_on(card(Material(alpha_mode="MASK", alpha_cutoff=0.25), colors=colors))
    assert np.array_equal(seen, np.tile(np.arange(64) >= 16, (64, 1)))


def test_second_texture_coordinates():
    image, alpha = grid(np.random.default_rng(4), 8, 8)
    material = Material(alpha_mode="MASK", base_color_texture=Texture(0, texcoord=1))
    mesh = card(material, image, uv=np.zeros_like(UV), uv1=UV)
    assert np.array_equal(seen_head_on(mesh), np.kron(alpha / 255 >= 0.5, np.ones((8, 8), bool)))


def test_which_triangles_need_the_test_at_all():
    image, _ = grid(np.random.default_rng(3), 8, 8)
    faint = (1.0, 1.0, 1.0, 0.1)
    cases = [
        (Material(base_color_texture=Texture(0), base_color=faint), SURFACE),
        (Material(alpha_mode="BLEND", base_color=faint), NEVER),
        (Material(alpha_mode="BLEND", base_color=(1, 1, 1, 0.5)), SURFACE),
        (Material(alpha_mode="BLEND", base_color=faint, transmission=0.2), SURFACE),
        (Material(alpha_mode="MASK", base_color_texture=Texture(0), base_color=faint), NEVER),
        (Material(alpha_mode="MASK", base_color_texture=Texture(0), alpha_cutoff=0.0), SURFACE),
    ]
    for material, expected in cases:
        geometry = placed(card(material, image), label_alpha=0.5)
        assert geometry.triangle_cutout.tolist() == [expected] * 2, material
        assert len(geometry.alpha_masks.texels) == 0
        assert seen_head_on(card(material, image)).all() == (expected == SURFACE)


@pytest.mark.parametrize("name", EVERY)
def test_behind_a_hole_is_the_next_surface(name):
    image, _ = grid(np.random.default_rng(6), 16, 16)
    front = card(Material(alpha_mode="MASK", base_color_texture=Texture(0)), image)
    back = np.eye(4)
    back[1, 3] = 1.0
    geometry = placed(front, cube(0.8), front, moves=[np.eye(4), back, back], label_alpha=0.5)
    camera = orbit_camera(lens(64, 64, 1.0, EVERY[name]), 0.1, 0.05, 3.0)
    both = rasterize(geometry, camera)
    alone = {i: rasterize(geometry, camera, object_id=i) for i in (1, 2, 3)}
    nearest = np.max([a.inverse_depth for a in alone.values()], axis=0)
    assert np.array_equal(both.inverse_depth, nearest)
    owner = np.where(both.triangle >= 0, geometry.triangle_object[both.triangle], 0)
    assert {0, 1, 2} <= set(np.unique(owner))
    for i, one in alone.items():
        assert np.array_equal(both.triangle[owner == i], one.triangle[owner == i])


def test_cutouts_of_several_meshes_stay_their_own():
    rng = np.random.default_rng(8)
    material = Material(alpha_mode="MASK", base_color_texture=Texture(0))
    cards, alphas = zip(*(((card(material, image)), alpha) for image, alpha in (grid(rng, 8, 8), grid(rng, 4, 4))), strict=True)
    geometry = placed(*cards, cube(0.1), cards[0])
    camera = orbit_camera(lens(64, 64, fx=64, fy=64), distance=2.0)
    for object_id, alpha in ((1, alphas[0]), (2, alphas[1]), (4, alphas[0])):
        size = 64 // len(alpha)
        expected = np.kron(alpha / 255 >= 0.5, np.ones((size, size), bool))
        assert np.array_equal(rasterize(geometry, camera, object_id=object_id).triangle >= 0, expected)


def test_cutouts_of_a_mesh_that_many_things_show_are_held_once():
    material = Material(alpha_mode="MASK", base_color_texture=Texture(0))
    image, _ = grid(np.random.default_rng(3), 8, 8)
    one = card(material, image)
    alike, copies = placed(*[one] * 5, cube(0.1)), placed(*[card(material, image) for _ in range(5)], cube(0.1))
    assert len(copies.alpha_masks.texels) == 5 * len(alike.alpha_masks.texels) == 5 * 64
    assert len(copies.alpha_masks.corners) == 5 * len(alike.alpha_masks.corners)
    assert len(alike.alpha_masks.layout) == len(alike.alpha_masks.levels) == 1
    camera = orbit_camera(lens(64, 64, fx=64, fy=64), distance=2.0)
    for object_id in (None, 1, 3, 5):
        seen = [rasterize(geometry, camera, object_id=object_id) for geometry in (alike, copies)]
        assert seen[0].triangle.tobytes() == seen[1].triangle.tobytes()
        assert seen[0].inverse_depth.tobytes() == seen[1].inverse_depth.tobytes()


def test_instances_hold_no_labels_that_nothing_reads():
    """A thousand chairs have six million triangles, and each kind of label takes 24 MB of them."""
    mesh = cube()
    geometry = placed(mesh, mesh, mesh, ground=True)
    held = {"things", "meshes", "classes_behind"}
    rasterize(geometry, orbit_camera(lens(64, 64)))
    assert set(vars(geometry.labels)) == held
    assert np.array_equal(geometry.triangle_part, np.tile(mesh.triangle_part + 1, 3))
    assert set(vars(geometry.labels)) == {*held, "part"}
    assert moved(geometry, {}).triangle_part is geometry.triangle_part


@pytest.mark.skipif(sys.platform != "linux", reason="/proc")
def test_large_arrays_of_zeros_take_memory_only_where_they_are_written():
    def resident():
        return int(Path("/proc/self/statm").read_text().split()[1]) * mmap.PAGESIZE

    before = resident()
    ids = zeros(1 << 24, np.int32)
    assert not ids.any()
    ids[: 1 << 10] = 5
    assert resident() - before < ids.nbytes / 2  # with room for the mask of `any`
    assert ids[: 1 << 10].sum() == ids.sum(dtype=np.int64) == 5 << 10
