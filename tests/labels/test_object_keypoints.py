"""keypoints and canonical_pose: where named points are, whether rays reach them, and which pose stands for its like."""

import itertools
import math

import numpy as np
import pytest

import viewsphere as vs
from proven import close, told
from quick import quick
from viewsphere.check import check
from viewsphere.errors import RecipeError
from viewsphere.geometry.camera import project
from viewsphere.geometry.rotation import compose, random_rotation, rigid, rotation_about
from viewsphere.labels.canonical_pose import nearest
from viewsphere.labels.keypoints import LABEL
from viewsphere.model.annotations.symmetries import Symmetries
from viewsphere.store import Dataset

VISIBLE, OCCLUDED, OUTSIDE, BEHIND = range(4)


def recipe(**changes):
    said = {
        "models": [{"source": "zoo:car", "category": "car"}, {"source": "zoo:chair", "category": "chair"}],
        "scenes": {"count": 2, "objects": 2, "layout": "scatter"},
        "viewpoints": {"azimuth": [20, 150], "elevation": 20, "distance": 6},
        "camera": {"size": [160, 120], "fov_deg": 50},
        "channels": ["depth", "instances"],
        "annotations": ["keypoints", "canonical_pose"],
        "splits": {"by": "frame", "train": 1},
        "formats": [],
    }
    return vs.Recipe.model_validate({**said, **changes})


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    out = tmp_path_factory.mktemp("points")
    vs.generate(recipe(), out)
    return Dataset(out)


def test_named_points_are_those_of_the_models_in_every_frame_of_reference(made):
    models, seen = {info.key: info for info in made.models}, set()
    for sample in made:
        for o in sample.objects:
            known = models[o.key].keypoints
            assert o.keypoint_names == tuple(known.points)
            assert len(o.keypoint_names) == len(o.keypoints) == len(o.keypoint_states) > 3
            own = np.column_stack([np.array([*known.points.values()]), np.ones(len(o.keypoints))])
            close("keypoints", "poses", o.keypoints3d, (own @ o.world_from_object.T)[:, :3], "m", atol=1e-9)
            np.testing.assert_allclose(o.keypoints3d_camera, (own @ o.camera_from_object.T)[:, :3], atol=1e-9)
            np.testing.assert_allclose(o.keypoints, project(sample.camera.intrinsics, o.keypoints3d_camera)[0], atol=1e-9)
            seen.update(o.keypoint_states.tolist())
    assert {VISIBLE, OCCLUDED} <= seen


@pytest.mark.slow
def test_they_are_proved(made):
    report = check(made)
    assert report.ok, report.findings
    assert report.checked["keypoints"] == report.checked["canonical_pose"] == len(made)


@pytest.mark.slow
def test_rays_reach_what_is_visible_and_nothing_else(made):
    """Embree's ray towards a point meets nothing before it, but for the slack; near edges rounding may decide otherwise."""
    pytest.importorskip("embreex")
    from viewsphere.run.shots.stages import Stages

    wrong = total = 0
    stages = Stages()
    for sample in vs.render(recipe()):
        geometry = stages.stage(sample.origin.shot).at(sample.origin.instant)
        for o in sample.objects:
            away = o.keypoints3d - sample.camera.center
            distance = np.linalg.norm(away, axis=1)
            free = embree_distance(geometry, sample.camera.center, away / distance[:, None])
            slack = 0.05 * o.diameter
            hidden = free < distance - slack - 1e-4
            clear = free > distance - slack + 1e-4
            inside = np.isin(o.keypoint_states, (VISIBLE, OCCLUDED))
            wrong += int((inside & hidden & (o.keypoint_states == VISIBLE)).sum())
            wrong += int((inside & clear & (o.keypoint_states == OCCLUDED)).sum())
            total += int(inside.sum())
    assert total > 30
    assert wrong <= total / 50
    told("keypoints", "Embree's rays, a share of the states", wrong / total)


def embree_distance(geometry, center, directions):
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    world = EmbreeScene(robust=True)
    TriangleMesh(world, geometry.vertices.astype(np.float32), geometry.triangles)
    origins = np.broadcast_to(center.astype(np.float32), directions.shape).copy()
    hit = world.run(origins, directions.astype(np.float32), output=True)
    return np.where(np.asarray(hit["primID"]) < 0, np.inf, np.asarray(hit["tfar"], np.float64))


def test_points_outside_and_behind():
    near = recipe(viewpoints={"azimuth": [0], "elevation": 10, "distance": 2.6}, camera={"size": [64, 48], "fov_deg": 30})
    states = [state for sample in vs.render(near) for o in sample.objects for state in o.keypoint_states.tolist()]
    assert OUTSIDE in states


@pytest.mark.slow
def test_without_slack_what_lies_inside_is_hidden():
    """Wheel centres lie inside of wheels: fewer points are seen where nothing may lie before them."""

    def visible(**options):
        told = recipe(labels={"keypoints": options}) if options else recipe()
        return sum(int((o.keypoint_states == VISIBLE).sum()) for s in vs.render(told) for o in s.objects)

    assert visible(depth_slack=0.0) < visible() <= visible(depth_slack=0.3)


@pytest.mark.parametrize("value", [-0.1, 0.6, math.nan, "much"])
def test_slack_that_is_none(value):
    with pytest.raises(RecipeError, match=r"^labels\.keypoints\.depth_slack: expected"):
        vs.plan(recipe(labels={"keypoints": {"depth_slack": value}}))


def test_proofs_notice_what_was_changed(made):
    sample, models = made[0], {info.key: info for info in made.models}
    assert list(LABEL.prove(sample, models)) == []
    for name, change in (
        ("keypoints", lambda v: v + 1),
        ("keypoints3d", lambda v: v + 0.01),
        ("keypoints3d_camera", lambda v: v + 0.01),
        ("keypoint_states", lambda v: np.full_like(v, BEHIND)),
        ("keypoint_names", lambda v: v[::-1]),
    ):
        again = made[0]
        o = again.objects[0]
        o.__dict__[name] = change(getattr(o, name))
        assert list(LABEL.prove(again, models)), name


# canonical poses


def quarter(axis, turns=1):
    vector = np.zeros(3)
    vector["xyz".index(axis)] = math.pi / 2 * turns
    return rotation_about(vector)


def plain(rotation, offset=(0.0, 0.0, 0.0)):
    place = np.array(offset) - rotation @ np.array(offset)
    return rigid(np.round(rotation, 12), place).tolist()


SQUARE = {"discrete": [plain(quarter("z", k), (0.1, 0.2, 0.0)) for k in (1, 2, 3)]}
BOX = {"discrete": [plain(quarter(axis, 2)) for axis in "xyz"]}
CONE = {"continuous": [{"axis": [0, 0, 1], "offset": [0.1, -0.2, 0.3]}]}
CYLINDER = {"discrete": [plain(quarter("x", 2))], "continuous": [{"axis": [0, 0, 1]}]}
BALL = {"continuous": [{"axis": axis, "offset": [0.1, 0.2, 0.3]} for axis in ([1, 0, 0], [0, 1, 0], [0, 0, 1])]}
CUBE = [
    rigid(turn, (0, 0, 0)).tolist()
    for order in itertools.permutations(range(3))
    for signs in itertools.product((1, -1), repeat=3)
    if np.linalg.det(turn := np.eye(3)[list(order)] * signs) > 0 and np.trace(turn) < 3
]
HEXAGON = [
    plain(rotation_about((0, 0, math.pi * k / 3)) @ flip)
    for flip in (np.eye(3), np.diag([1.0, -1, -1]))
    for k in range(6)
    if k or flip[1, 1] < 0
]
KINDS = {"square": SQUARE, "box": BOX, "cone": CONE, "cylinder": CYLINDER, "ball": BALL}


@pytest.mark.parametrize("kind", KINDS)
def test_all_poses_that_look_the_same_have_one_canonical_pose(kind):
    symmetries, rng = Symmetries.model_validate(KINDS[kind]), np.random.default_rng(3)
    for _ in range(20):
        pose = rigid(random_rotation(rng), rng.normal(size=3))
        wanted = nearest(pose, symmetries)
        for motion in symmetries.motions(7):
            again = nearest(compose(pose, motion), symmetries)
            close("canonical_pose", "that of every pose that looks the same", again, wanted, "m", atol=2e-6)


def grid():
    """Rotations of the default grid of azimuths, at elevations where many poses are equally near to the identity."""
    for azimuth, elevation in itertools.product(range(0, 360, 45), (0, 20, 45, 90, -90)):
        a, e = math.radians(azimuth), math.radians(elevation)
        (s, c), (f, g) = (math.sin(a), math.cos(a)), (math.sin(e), math.cos(e))
        yield np.array([[c, s, 0], [f * s, -f * c, -g], [-g * s, g * c, -f]])


TIED = {**KINDS, "cube": {"discrete": CUBE}, "hexagonal prism": {"discrete": HEXAGON}}


@pytest.mark.parametrize("kind", TIED)
@pytest.mark.parametrize("noise", [0, 1e-12])
@pytest.mark.slow
def test_equally_near_poses_have_one_canonical_pose(kind, noise):
    symmetries, rng = Symmetries.model_validate(TIED[kind]), np.random.default_rng(6)
    for rotation in grid():
        pose = rigid(rotation, (0.1, -0.2, 5.0))
        wanted = nearest(pose, symmetries)
        for motion in symmetries.motions(8):
            other = compose(pose, motion) + noise * rng.normal(size=(4, 4))
            np.testing.assert_allclose(nearest(other, symmetries), wanted, atol=1e-6)


@pytest.mark.parametrize("kind", quick(KINDS, "square", "box", "cone"))
def test_the_canonical_pose_is_a_symmetry_away_and_the_nearest_to_the_identity(kind):
    """By a search over all symmetries in fine steps."""
    symmetries, rng = Symmetries.model_validate(KINDS[kind]), np.random.default_rng(4)
    for _ in range(5):
        pose = rigid(random_rotation(rng), rng.normal(size=3))
        found = nearest(pose, symmetries)
        traces = [np.trace(compose(pose, motion)[:3, :3]) for motion in symmetries.motions(720)]
        assert np.trace(found[:3, :3]) >= max(traces) - 1e-9
        if kind != "ball":
            assert np.trace(found[:3, :3]) <= max(traces) + 1e-3
            gaps = [np.abs(compose(pose, motion) - found).max() for motion in symmetries.motions(720)]
            assert min(gaps) < 0.02


def test_dir_lists_all_attributes(made):
    o = made[0].objects[0]
    names = {"box2d", "camera_from_object", "quaternion", "area", "canonical_pose", "diameter", "keypoints"}
    assert names <= {*dir(o)} and "velocity" not in dir(o)
    assert all(hasattr(o, name) for name in dir(o))


def test_a_model_without_symmetries_keeps_its_pose(made):
    for sample in made:
        for o in sample.objects:
            np.testing.assert_array_equal(o.canonical_pose, o.camera_from_object)
            assert 0.5 < o.diameter < 8
