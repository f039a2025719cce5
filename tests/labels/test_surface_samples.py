"""surface_samples: points on surfaces, where they are and whether they are seen, against closed forms and Embree's rays."""

import dataclasses

import numpy as np
import pytest

from label_scenes import changed, proof, random_camera, random_things
from proven import close, told
from sealing import seal_again
from shots import still_shot, with_camera
from small import small_recipe
from truth_scenes import EVERY, begins, mesh_of
from viewsphere import generate, plan
from viewsphere.check import check
from viewsphere.errors import RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.camera import project
from viewsphere.geometry.rotation import transform
from viewsphere.labels import annotated, channels, context_of, observe
from viewsphere.labels.surface_samples import LABEL, SURFACE_SAMPLE
from viewsphere.model.sample import Sample
from viewsphere.model.thing import Motion
from viewsphere.store import Dataset, encode
from viewsphere.store.samples.channel_files import decode
from viewsphere.truth.shot_views import views_of
from viewsphere.truth.surface_points.draws import points_on_model


def sampled(seed, lens_name, count=200, move=None, ground=False):
    """A sample of a random scene, and its view."""
    rng = np.random.default_rng(seed)
    things, meshes = random_things(rng)
    camera = random_camera(rng, lens_name)
    if move is not None:
        things = tuple(move(thing) for thing in things)
    own = {thing.model.key: mesh for thing, mesh in zip(things, meshes, strict=True)}
    shot = with_camera(still_shot(things, labels={"surface_samples": {"count": count}}), camera)
    views = views_of(shot, lambda thing: own[thing.model.key])
    view, neighbours = views.view(0, 0), views.neighbours(0, 0)
    rows = observe(view.geometry, camera, view.visibility, ["instances", "depth", "surface_samples"], neighbours, shot.labels)
    objects = [thing for thing in things if thing.id]
    boxes = [Box3d.between(*own[thing.model.key].bounds).corners for thing in objects]
    told = annotated(context_of(shot, 0, camera, view.geometry, view.visibility, boxes, ["m.obj"] * len(objects)))
    return Sample(0, "train", camera, None, told, rows, {}), view


@pytest.mark.parametrize("name", EVERY)
def test_points_are_on_their_triangles_and_where_poses_and_camera_put_them(name):
    sample, view = sampled(0, name)
    rows = sample.surface_samples
    assert rows.dtype == SURFACE_SAMPLE and rows["object"].tolist() == [i for i in (1, 2, 3, 4) for _ in range(200)]
    start = np.array(view.geometry.triangle_start)[rows["object"] - 1]
    a, b, c = view.geometry.vertices[view.geometry.triangles[start + rows["triangle"]]].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    np.testing.assert_allclose(rows["normal"], normal, atol=2e-5)
    assert np.abs(((rows["point"] - a) * normal).sum(axis=1)).max() < 1e-6
    for o in sample.objects:
        own = rows[rows["object"] == o.id]
        close("surface_samples", "poses", own["point"], transform(o.world_from_object, own["point_object"]), "m", atol=1e-12)
    in_camera = transform(sample.camera.R, rows["point"]) + sample.camera.t
    np.testing.assert_allclose(rows["pixel"], project(sample.camera.intrinsics, in_camera)[0], atol=1e-9)
    assert len(set(rows["state"].tolist())) >= 2


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("seed", range(2))
def test_embree_sees_the_same_points(name, seed):
    """A ray towards a point that is seen meets nothing before it."""
    pytest.importorskip("embreex")
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    sample, view = sampled(seed, name)
    rows, camera, scene = sample.surface_samples, sample.camera, EmbreeScene(robust=True)
    TriangleMesh(scene, view.geometry.vertices.astype(np.float32), view.geometry.triangles)
    origins = begins(camera, rows["point"])
    away = rows["point"] - origins
    far = np.linalg.norm(away, axis=1)
    directions = (away / far[:, None]).astype(np.float32)
    hit = np.asarray(scene.run(origins.astype(np.float32), directions, output=True)["tfar"], np.float64)
    inside = rows["state"] <= 1
    assert inside.sum() > 200 and {0, 1} <= set(rows["state"].tolist())
    right = ((hit < far * (1 - 1e-5)) == (rows["state"] == 1))[inside]
    assert right.mean() > 0.995
    told("surface_samples", "Embree's rays, a share of the states", 1 - right.mean())
    x, y = rows["pixel"][inside].T
    assert (x >= 0).all() and (x < camera.width).all() and (y >= 0).all() and (y < camera.height).all()


def test_points_are_evenly_spread_by_area():
    """A large triangle and one of a ninth of its area; on each the mean point is its middle."""
    corners = [[0, 0, 0], [3, 0, 0], [0, 3, 0], [0, 0, 5], [1, 0, 5], [0, 1, 5]]
    rng = np.random.default_rng(0)
    things, _ = random_things(rng)
    shot = still_shot(things[:1], labels={"surface_samples": {"count": 20_000}})
    mesh = mesh_of(corners, [[0, 1, 2], [3, 4, 5]])
    view = views_of(shot, lambda thing: mesh).view(0, 0)
    triangle, weights = points_on_model(view, 0, 20_000)
    assert np.mean(triangle == 1) == pytest.approx(0.1, abs=0.01)
    np.testing.assert_allclose(weights.mean(axis=0), 1 / 3, atol=0.01)
    np.testing.assert_allclose((weights**2).mean(axis=0), 1 / 6, atol=0.01)  # evenly: E[w^2] = 1/6


def test_instances_have_the_same_points_wherever_they_stand():
    sample, _ = sampled(0, "pinhole")
    rows = sample.surface_samples
    one, four = rows[rows["object"] == 1], rows[rows["object"] == 4]  # of one model
    for field in ("triangle", "point_object", "normal_object"):
        np.testing.assert_array_equal(one[field], four[field])
    other, _ = sampled(7, "fisheye")
    np.testing.assert_array_equal(other.surface_samples["point_object"][:200], one["point_object"])
    assert (one["point"] != four["point"]).any()


def test_what_is_not_there_or_has_no_surface_has_no_points():
    def gone(thing):
        return thing.model_copy(update={"motion": Motion(poses=(None,))}) if thing.id == 2 else thing

    sample, _ = sampled(0, "pinhole", move=gone)
    assert set(sample.surface_samples["object"].tolist()) == {1, 3, 4}
    rng = np.random.default_rng(0)
    things, _ = random_things(rng)
    flat = mesh_of([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    views = views_of(still_shot(things[:1]), lambda thing: flat)
    view = views.view(0, 0)
    rows = observe(view.geometry, view.camera, view.visibility, ["surface_samples"], views.neighbours(0, 0))["surface_samples"]
    assert rows.shape == (0,) and rows.dtype == SURFACE_SAMPLE
    back = decode(channels()["surface_samples"], "x.npz", lambda: encode(channels()["surface_samples"], rows))
    assert back.shape == (0,)


def test_its_proof_notices_other_rows():
    sample, _ = sampled(1, "barrel")
    assert proof(LABEL, sample) == []
    seen = int(np.flatnonzero(sample.surface_samples["state"] == 0)[0])

    def edit(field, value):
        return lambda a: a[field].__setitem__(seen, value(a[field][seen]))

    for change in (
        edit("object", lambda v: 9),
        edit("state", lambda v: 2),
        edit("state", lambda v: 3),
        edit("state", lambda v: 7),
        edit("pixel", lambda v: v + 0.01),
        edit("pixel", lambda v: v * np.nan),
        edit("point", lambda v: v + 1e-6),
        edit("point_object", lambda v: v + 1e-6),
        edit("point_object", lambda v: v + 9),
        edit("normal", lambda v: -v),
        edit("normal_object", lambda v: v * np.float32(1.01)),
    ):
        assert proof(LABEL, changed(sample, "surface_samples", change))
    turned = tuple(dataclasses.replace(o, world_from_object=o.world_from_object[[1, 0, 2, 3]]) for o in sample.objects)
    assert proof(LABEL, dataclasses.replace(sample, objects=turned))


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    out = tmp_path_factory.mktemp("samples")
    generate(
        small_recipe(
            channels=["rgb", "depth", "instances", "surface_samples"], formats=[], labels={"surface_samples": {"count": 50}}
        ),
        out,
    )
    return Dataset(out)


def test_a_recipe_says_how_many_and_check_computes_them_again(made):
    for sample in made:
        assert np.bincount(sample.surface_samples["object"]).tolist() == [0, 50]
    assert made.plan.channels[-1] == "surface_samples"
    report = check(made)
    assert report.ok and report.checked["surface_samples"] == len(made)


def test_check_holds_of_frames_without_objects(tmp_path):
    generate(
        small_recipe(channels=["rgb", "depth", "instances", "surface_samples"], formats=[], empty=0.99999),
        tmp_path / "out",
        workers=0,
    )
    made = Dataset(tmp_path / "out")
    assert all(len(sample.surface_samples) == 0 for sample in made)
    assert check(made, rays=False).findings == ()


@pytest.mark.parametrize("change", ["state", "fewer"])
def test_check_notices_other_states_and_fewer_rows(made, change):
    sample = made[2]
    file, rows = made.path(sample.files["surface_samples"]), sample.surface_samples.copy()
    before = file.read_bytes()
    hidden = np.flatnonzero(rows["state"] == 1)[0]
    rows["state"][hidden] = 0
    file.write_bytes(encode(channels()["surface_samples"], rows if change == "state" else sample.surface_samples[:-1]))
    seal_again(made.root)
    assert {(f.check, f.frame) for f in check(Dataset(made.root), rays=False).findings} == {("surface_samples", 2)}
    file.write_bytes(before)
    seal_again(made.root)


@pytest.mark.parametrize("value", [0, -1, 2.5, 1_000_000, "many"])
def test_numbers_that_are_none(value):
    with pytest.raises(RecipeError, match=r"^labels\.surface_samples\.count: expected"):
        plan(small_recipe(channels=["rgb", "surface_samples"], labels={"surface_samples": {"count": value}}))
