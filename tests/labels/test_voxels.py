"""voxels: cells against Embree's insides and lifted depth, how they are seen, runs and their proof."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from label_scenes import changed, pictured, proof, random_camera, random_things, rows_of
from proven import equal, told
from quick import quick
from small import small_recipe, tree_hash
from truth_scenes import EVERY, cube, lens, mesh_of, orbit_camera, sphere
from viewsphere import generate, plan
from viewsphere.assets.mesh import Material
from viewsphere.check import check
from viewsphere.errors import RecipeError, StoreError
from viewsphere.geometry.camera import pixel_rays, project
from viewsphere.geometry.rotation import transform
from viewsphere.labels import LabelContext, channels
from viewsphere.labels.voxels import LABEL
from viewsphere.model.annotations.voxels import FREE, INSIDE, OCCLUDED, OUTSIDE, RUN, SURFACE, TOUCHED, Grid, Voxels
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.thing import Motion, Thing
from viewsphere.store import Dataset, encode
from viewsphere.store.samples.channel_files import decode

SMALL = {"size": [40, 30, 50], "cell": 0.11, "distance": 4.0, "bottom": -1.7}
NAMES = ("depth", "instances", "semantic")


def with_voxels(sample, geometry, visibility, options=SMALL):
    context = LabelContext(geometry, sample.camera, visibility, options={"voxels": options})
    return replace(sample, channels={**sample.channels, "voxels": LABEL.compute(context)}, options={"voxels": options})


def voxelled(seed, lens_name="pinhole", options=SMALL, ground=True):
    rng = np.random.default_rng(seed)
    things, meshes = random_things(rng)
    camera = random_camera(rng, lens_name)
    sample, geometry, visibility = pictured(things, meshes, camera, NAMES, ground=ground)
    return with_voxels(sample, geometry, visibility, options), geometry


def seen_cells(sample, grid):
    """The cells in which lifted depth lies, and of each pixel whether rounding may decide in which."""
    rays = pixel_rays(sample.camera.intrinsics)
    hit = np.isfinite(sample.depth)
    local = rays[hit] / rays[hit][:, 2:] * sample.depth[hit].astype(float)[:, None] + sample.camera.lens.origins()[hit]
    at = (np.linalg.inv(grid.world_from_grid) @ np.c_[(local - sample.camera.t) @ sample.camera.R, np.ones(hit.sum())].T).T
    at = at[:, :3] / grid.cell
    return np.floor(at).astype(int), (np.abs(at - np.rint(at)) < 1e-4).any(axis=1), hit


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("seed", range(2))
def test_seen_surface_is_where_lifted_depth_is(name, seed):
    sample, _ = voxelled(seed, name)
    grid = sample.voxel_grid
    cells, unsure, hit = seen_cells(sample, grid.grid)
    inside = ((cells >= 0) & (cells < grid.grid.size)).all(axis=1)
    expected, possible = np.zeros((2, *grid.grid.size), bool)
    expected[tuple(cells[inside & ~unsure].T)] = True
    for shift in itertools.product((-1, 0, 1), repeat=3):
        near = (cells + shift)[unsure]
        possible[tuple(near[((near >= 0) & (near < grid.grid.size)).all(axis=1)].T)] = True
    found = grid.state == SURFACE
    assert expected.sum() > 300 and found[expected].all() and not (found & ~expected & ~possible).any()
    told("voxels", "lifted depth", 0)
    assert (grid.classes[found] > 0).all()
    alone = inside & ~unsure
    seen = {tuple(cell): set() for cell in cells[alone]}
    for cell, of in zip(cells[alone], sample.semantic[hit][alone], strict=True):
        seen[tuple(cell)].add(of)
    same = [grid.classes[cell] in of for cell, of in seen.items()]
    assert np.mean(same) > 0.95  # elsewhere another thing is in the cell, too, but no pixel shows that


@pytest.mark.parametrize("name", EVERY)
def test_free_cells_are_before_what_is_seen_and_occluded_ones_behind(name):
    sample, _ = voxelled(3, name)
    grid, camera = sample.voxel_grid, sample.camera
    centers = transform(camera.R, grid.centers(np.ones(grid.grid.size, bool))) + camera.t
    pixels, _ = project(camera.intrinsics, centers)
    shown = ~np.isnan(pixels).any(axis=1) & (np.nan_to_num(pixels, nan=-1) >= 0).all(axis=1)
    shown &= (np.nan_to_num(pixels) < (camera.width, camera.height)).all(axis=1)
    column, row = np.nan_to_num(pixels[shown]).astype(int).T
    depth = sample.depth[row, column]
    state = np.full(len(centers), OUTSIDE)
    nearer = (
        centers[shown, 2] / pixel_rays(camera.intrinsics)[row, column, 2]
        < depth / pixel_rays(camera.intrinsics)[row, column, 2]
    )
    state[shown] = np.where(nearer, FREE, OCCLUDED)
    known = grid.state.reshape(-1) != SURFACE
    sure = known.copy()
    sure[np.flatnonzero(shown)[np.abs(centers[shown, 2] - depth) < 1e-5]] = False
    np.testing.assert_array_equal(grid.state.reshape(-1)[sure], state[sure])
    assert {OUTSIDE, FREE, OCCLUDED, SURFACE} == set(np.unique(grid.state).tolist())


@pytest.mark.parametrize("slab", quick([1, 700, 4000], 700, 4000))
def test_cells_are_seen_alike_however_many_are_looked_at_together(slab, monkeypatch):
    """Less than a step ahead has, more, and a number that no steps have; long and flat grids are as cheap as others."""
    options = {**SMALL, "size": [9, 30, 50]}
    whole, _ = voxelled(3, options=options)
    monkeypatch.setattr("viewsphere.labels.voxels.SLAB", slab)
    parted, _ = voxelled(3, options=options)
    np.testing.assert_array_equal(parted.channels["voxels"], whole.channels["voxels"])
    assert {OUTSIDE, FREE, OCCLUDED} <= set(np.unique(whole.voxel_grid.state).tolist())


@pytest.mark.parametrize("seed", range(2))
def test_objects_are_full_where_embree_is_inside_of_closed_meshes(seed):
    pytest.importorskip("embreex")
    sample, geometry = voxelled(seed)
    grid = sample.voxel_grid
    centers = grid.centers(np.ones(grid.grid.size, bool))
    wanted = np.zeros(grid.grid.size, int)
    for i in (3, 2, 1, 0):  # the first of several has a cell
        own = slice(geometry.triangle_start[i], geometry.triangle_start[i + 1])
        mesh = trimesh.Trimesh(geometry.vertices, geometry.triangles[own], process=False)
        mesh.remove_unreferenced_vertices()
        mesh.merge_vertices()
        if mesh.is_watertight:
            wanted[mesh.contains(centers).reshape(grid.grid.size)] = i + 1
    own = grid.filled == INSIDE
    assert own.sum() > 200
    equal("voxels", "Embree's insides", grid.instances[own], wanted[own])
    empty = grid.filled == 0
    assert not wanted[empty].any()
    assert (grid.classes[own] == 31 + np.array([0, 3, 4, 5, 3])[grid.instances[own]]).all()


def scene(objects, scenery=(), camera=None, ground=False, options=None):
    """Things at the origin, as voxels of a small grid."""
    meshes = [*objects, *scenery]
    things = [
        Thing(
            id=i + 1 if i < len(objects) else 0,
            model=ModelSpec(key=f"m{i}", source="", category=f"c{i}", category_id=i + 1),
            motion=Motion.still(rows_of(np.eye(4))),
        )
        for i in range(len(meshes))
    ]
    camera = camera or orbit_camera(lens(64, 48, 0.9), 0.0, 0.0, 4.0)
    options = options or {"size": [40, 40, 40], "cell": 0.1, "distance": 4.0, "bottom": -2.0}
    sample, geometry, visibility = pictured(things, meshes, camera, NAMES, ground=ground)
    return with_voxels(sample, geometry, visibility, options).voxel_grid


def test_an_open_mesh_is_surface_alone():
    closed = cube(0.83)
    lid = mesh_of(closed.vertices, closed.triangles[:-1])
    full, hollow = scene([closed]), scene([lid])
    assert (full.filled == INSIDE).sum() == 16**3  # the cells whose centres are within 0.83 but not those of its sides
    assert (hollow.filled == TOUCHED).sum() > 1000 and not (hollow.filled == INSIDE).any()
    assert (full.filled[hollow.filled == TOUCHED] == TOUCHED).all()


def test_what_is_never_seen_is_neither_surface_nor_closes_a_piece():
    closed = cube(0.83)
    clear = Material(alpha_mode="BLEND", base_color=(1.0, 1.0, 1.0, 0.0))
    assert not scene([replace(closed, materials=(clear,))]).filled.any()
    materials = np.zeros(len(closed.triangles), np.int32)
    materials[-1] = 1
    window = scene([replace(closed, materials=(Material(), clear), triangle_material=materials)])
    lid = scene([mesh_of(closed.vertices, closed.triangles[:-1])])
    np.testing.assert_array_equal(window.filled, lid.filled)


def test_scenery_is_surface_and_what_it_covers_is_indoors():
    room = scene([sphere(2, 0.3)], [cube(1.23)])
    assert not ((room.filled == INSIDE) & (room.instances == 0)).any()
    within = np.zeros(room.grid.size, bool)
    within[9:31, 9:31, 9:31] = True
    assert room.indoors[within].all() and room.indoors.sum() < 26**3
    floor = scene([sphere(2, 0.3)], [mesh_of([[-1, -1, 1], [1, -1, 1], [0, 1.5, 1]], [[0, 1, 2]])], ground=True)
    assert floor.indoors[20, :, 20].tolist() == [False] * 17 + [True] * 13 + [False] * 10


def test_the_grid_lies_before_the_camera():
    camera = orbit_camera(lens(64, 48, 0.9), 0.7, 0.5, 3.0, 0.2)
    grid = Grid.for_camera(Voxels(size=(10, 8, 6), cell=0.5, distance=2.0, bottom=-0.3), camera)
    m = grid.world_from_grid
    np.testing.assert_allclose(m[:3, :3].T @ m[:3, :3], np.eye(3), atol=1e-15)
    assert np.linalg.det(m[:3, :3]) == pytest.approx(1)
    middle = m @ (2.5, 2, 1.5, 1)
    np.testing.assert_allclose(middle[:2], (camera.center + 2 * camera.R[2])[:2], atol=1e-12)
    assert m[2, 3] == -0.3 and m[:3, 1].tolist() == [0, 0, 1]
    ahead = camera.R[2][:2] / np.linalg.norm(camera.R[2][:2])
    np.testing.assert_allclose(m[:2, 0], ahead)
    turned = Grid.for_camera(Voxels(axes="world"), camera).world_from_grid
    np.testing.assert_array_equal(turned[:3, :3], [[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    points = np.random.default_rng(0).normal(size=(20, 3))
    np.testing.assert_allclose(grid.points(grid.cells(points)), points, atol=1e-12)


@pytest.mark.parametrize("sign", [1, -1])
def test_of_a_camera_that_looks_straight_down_or_up_the_picture_s_top_or_bottom_is_ahead(sign):
    turn = np.array([[0.6, 0.8, 0], [0.8 * sign, -0.6 * sign, 0], [0, 0, -sign]], float)
    assert np.linalg.det(turn) == pytest.approx(1)
    grid = Grid.for_camera(Voxels(), Camera(lens(8, 8), turn, np.zeros(3)))
    np.testing.assert_allclose(grid.world_from_grid[:3, 2], (0.6, 0.8, 0), atol=1e-12)  # right is the picture's right


@pytest.mark.parametrize("name", EVERY)
def test_its_proof_notices_other_runs(name):
    sample, _ = voxelled(1, name)
    assert proof(LABEL, sample) == []
    runs = sample.voxels
    of = {i: int(np.flatnonzero(runs["instance"] == i)[0]) for i in (1, 2, 3)}
    seen = int(np.flatnonzero(runs["state"] == SURFACE)[0])
    stuff = int(np.flatnonzero((runs["class"] > 0) & (runs["instance"] == 0))[0])
    empty = int(np.flatnonzero((runs["class"] == 0) & (runs["state"] == OCCLUDED))[0])
    changes = [
        lambda a: a[:-1],
        lambda a: np.concatenate((a[:1], a)),
        lambda a: a["length"].__setitem__(of[1], a["length"][of[1]] + 1),
        lambda a: a["class"].__setitem__(of[1], 34 if runs["class"][of[1]] != 34 else 35),
        lambda a: a["class"].__setitem__(stuff, 1),
        lambda a: a["class"].__setitem__(stuff, 50),
        lambda a: a["class"].__setitem__(empty, 3),
        lambda a: a["instance"].__setitem__(of[2], 77),
        lambda a: a["state"].__setitem__(seen, OCCLUDED),
        lambda a: a["state"].__setitem__(empty, SURFACE),
        lambda a: a["state"].__setitem__(empty, 9),
        lambda a: a["filled"].__setitem__(stuff, INSIDE),
        lambda a: a["filled"].__setitem__(empty, 1),
        lambda a: a["indoors"].__setitem__(empty, 2),
    ]
    for number, change in enumerate(changes):
        assert proof(LABEL, changed(sample, "voxels", change)), number
    moved = replace(sample, objects=tuple(replace(o, box3d=o.box3d + 9) for o in sample.objects))
    assert any("in its box" in problem for problem in proof(LABEL, moved))


def test_runs_are_kept_and_have_other_ids_elsewhere():
    sample, _ = voxelled(0)
    back = decode(channels()["voxels"], "x.npz", lambda: encode(channels()["voxels"], sample.voxels))
    assert back.dtype == RUN and back.tobytes() == sample.voxels.tobytes()
    other = LABEL.ids["category"](sample.voxels, {3: 8, 4: 3})
    assert set(np.unique(other["class"])) & {39, 34} and (other["length"] == sample.voxels["length"]).all()
    assert (other["class"] == 39).sum() == (sample.voxels["class"] == 34).sum()
    with pytest.raises(StoreError, match=r"^frame 0: voxels: expected runs of 8,294,400 cells, found 60,000"):
        _ = replace(sample, options={}).voxel_grid
    with pytest.raises(StoreError, match="expected the channel voxels, found none"):
        _ = replace(sample, channels={}).voxel_grid


def grids():
    options = {"size": [30, 20, 30], "cell": 0.03, "distance": 1.0, "bottom": -0.2}
    views = {"azimuth": [0, 120], "elevation": 15, "distance": 1.0}
    kept = ["rgb", "depth", "instances", "voxels"]
    return small_recipe(channels=kept, formats=[], labels={"voxels": options}, viewpoints=views)


@pytest.mark.slow
def test_grids_are_equal_with_any_number_of_workers(tmp_path):
    for workers in (0, 2):
        generate(grids(), tmp_path / str(workers), workers=workers)
    assert tree_hash(tmp_path / "0" / "store" / "shots") == tree_hash(tmp_path / "2" / "store" / "shots")


def test_check_computes_grids_again(tmp_path):
    generate(grids(), tmp_path)
    made = Dataset(tmp_path)
    report = check(made)
    assert report.ok and report.checked["voxels"] == len(made)
    grid = made[3].voxel_grid
    assert grid.grid.size == (30, 20, 30) and {0, 1} <= set(np.unique(grid.instances).tolist())


@pytest.mark.slow
def test_channels_that_are_added_later_have_their_options(tmp_path):
    views = {"azimuth": [0, 120], "elevation": 15, "distance": 1.0}
    first = small_recipe(channels=["rgb", "depth", "instances"], formats=[], viewpoints=views)
    generate(first, tmp_path, workers=0)
    labels = {"voxels": {"size": [12, 10, 14], "cell": 0.1, "distance": 1.0}, "surface_samples": {"count": 30}}
    kept = ["rgb", "depth", "instances", "voxels", "surface_samples"]
    generate(small_recipe(channels=kept, formats=[], viewpoints=views, labels=labels), tmp_path, workers=0, append=True)
    made = Dataset(tmp_path)
    assert made[0].voxel_grid.grid.size == (12, 10, 14) and len(made[0].surface_samples) == 30
    report = check(made)
    assert report.ok, report.findings
    assert report.checked["voxels"] == report.checked["surface_samples"] == len(made)


def test_ten_thousand_million_cells_are_refused_before_anything_is_rendered():
    expected = r"^labels\.voxels\.size: expected at most 100,000,000 cells, found 10,000,000,000: take fewer, larger cells"
    with pytest.raises(RecipeError, match=expected):
        plan(small_recipe(channels=["rgb", "voxels"], labels={"voxels": {"size": [2500, 2000, 2000]}}))


@pytest.mark.parametrize("options", [{"cell": 0}, {"size": [1, 2]}, {"axes": "camera"}, {"bottom": float("inf")}, {"sizes": 3}])
def test_options_that_are_none(options):
    with pytest.raises(RecipeError, match=r"^labels\.voxels\."):
        plan(small_recipe(channels=["rgb", "voxels"], labels={"voxels": options}))
