"""People of the zoo: a closed, skinned surface on 24 joints, feet that stand still, and all that holds for rigged files."""

import errno
import hashlib
import json
import struct
from functools import cache

import numpy as np
import pytest

import viewsphere_zoo as zoo
from quick import quick
from small import ROOT
from viewsphere import Recipe, generate, plan
from viewsphere.assets.cache import load, load_normalised
from viewsphere.assets.exporting.glb import rigged_glb_bytes
from viewsphere.assets.exporting.rigged import joints_at
from viewsphere.assets.inspect import describe
from viewsphere.check import check
from viewsphere.errors import RecipeError
from viewsphere.formats.surreal.body import SMPL
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.thing import TimeStep
from viewsphere.store import Dataset
from viewsphere_zoo.families.person import CLIPS, Person, draw, person
from viewsphere_zoo.people import makehuman
from viewsphere_zoo.people.actions import SEAT, SPEEDS, Manner, clips
from viewsphere_zoo.people.build import Build
from viewsphere_zoo.people.skeleton import JOINTS, PARENTS, skeleton
from zoo_mesh import assert_sound, outward_share

BUILDS = (Build(), Build(1.52, 0.0, 0.6, 0.513), Build(1.97, 1.0, -0.8, 0.533))


@pytest.fixture(scope="module", autouse=True)
def mannequins():
    """People are mannequins, whatever was set up on this machine."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(makehuman, "data", lambda: None)
        patched.setattr(makehuman, "digest", lambda: "")
        yield


@cache
def made(seed):
    return person(draw(np.random.default_rng(seed)))


def spec_of(seed=1, **fields):
    said = {"key": "a", "source": "zoo:person", "seed": seed, "category": "person", "category_id": 1, "centring": "as_is"}
    return ModelSpec(**said | fields)


def moving(clip):
    """Matrices (T, 24, 4, 4) of the joints."""
    return lambda s: np.array([joints_at(s.places, PARENTS, pose) for pose in clip.poses])


# The surface.


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 5, pytest.param(3, marks=pytest.mark.slow)])
def test_every_part_is_a_closed_surface_that_faces_outwards(seed):
    mesh = made(seed).mesh
    assert_sound(mesh, 60_000)
    places, index = np.unique(np.round(mesh.vertices.astype(np.float64), 4), axis=0, return_inverse=True)
    for number, name in enumerate(mesh.parts):
        corners = index.reshape(-1)[mesh.triangles[mesh.triangle_part == number]]
        a, b, c = corners.T
        corners = corners[(a != b) & (b != c) & (c != a)]
        edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
        count = len(places)
        there, back = edges[:, 0] * count + edges[:, 1], edges[:, 1] * count + edges[:, 0]
        assert np.isin(there, back).all() and np.isin(back, there).all(), name
        p = places[corners]
        assert (p[:, 0] * np.cross(p[:, 1], p[:, 2])).sum() > 0, name
    assert outward_share(mesh) > 0.99


@pytest.mark.slow
def test_someone_has_a_body_of_its_own_height_that_faces_minus_y():
    for build in BUILDS[:2]:
        one = person(Person(build=build))
        low, high = one.mesh.bounds
        assert abs(low[2]) < 2e-3 and build.height - 0.005 < high[2] < build.height + 0.035
        eyes = one.mesh.vertices[one.mesh.triangles[one.mesh.triangle_part == one.mesh.parts.index("eyes")]].reshape(-1, 3)
        assert eyes[:, 1].mean() < one.places[JOINTS.index("Head"), 1] - 0.04
        left = one.places[[JOINTS.index(name) for name in JOINTS if name.startswith("L_")]]
        right = one.places[[JOINTS.index(name) for name in JOINTS if name.startswith("R_")]]
        assert (left[:, 0] > 0).all()
        np.testing.assert_allclose(right, left * (-1, 1, 1))


@pytest.mark.slow
def test_draws_differ_and_one_seed_gives_the_same_bytes():
    files = [rigged_glb_bytes(one) for one in (made(1), person(draw(np.random.default_rng(1))), made(5))]
    first, again, other = (hashlib.sha256(file).hexdigest() for file in files)
    assert first == again != other
    people = [draw(np.random.default_rng(seed)) for seed in range(60)]
    assert {p.outfit.top for p in people} == {"t_shirt", "shirt", "jumper", "jacket"}
    assert {p.outfit.bottom for p in people} == {"trousers", "shorts", "skirt"}
    assert len({p.looks.hair for p in people}) == 9 and len({p.outfit.top_color for p in people}) == 60
    assert {p.walks for p in people} == {True, False}
    tones = [sum(p.looks.skin) for p in people]
    assert min(tones) < 0.9 and max(tones) > 2.1
    assert 1.5 <= min(p.build.height for p in people) < 1.6 and 1.8 < max(p.build.height for p in people) <= 1.98


# The rig.


@pytest.mark.slow
def test_joints_are_smpls_in_surreals_order():
    assert JOINTS == SMPL
    assert all(above < number for number, above in enumerate(PARENTS))
    data = rigged_glb_bytes(made(1))
    root = json.loads(data[20 : 20 + struct.unpack_from("<I", data, 12)[0]])
    assert tuple(root["nodes"][i]["name"] for i in root["skins"][0]["joints"]) == SMPL
    assert tuple(one["name"] for one in root["animations"]) == CLIPS
    assert {one["name"]: one["extras"]["speed"] for one in root["animations"]} == {**SPEEDS, "stand": 0.0, "sit": 0.0}


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 5, 3])
def test_weights_sum_to_one_and_every_joint_moves_something(seed):
    one = made(seed)
    np.testing.assert_allclose(one.vertex_weights.sum(axis=1), 1, atol=1e-12)
    assert (one.vertex_weights >= 0).all()
    strongest = set(one.vertex_joints[:, 0].tolist())
    assert strongest >= set(range(24)) - {JOINTS.index(name) for name in ("L_Collar", "R_Collar", "Neck")}
    head = one.vertex_joints[one.mesh.vertices[:, 2] > one.places[JOINTS.index("Head"), 2] + 0.06]
    assert (head[:, 0] == JOINTS.index("Head")).all()
    for sign, side in ((1, "R_"), (-1, "L_")):  # nobody's left hand or foot moves with the right
        far = one.vertex_joints[sign * one.mesh.vertices[:, 0] > 0.12]
        shares = one.vertex_weights[sign * one.mesh.vertices[:, 0] > 0.12]
        others = [i for i, name in enumerate(JOINTS) if name.startswith(side)]
        assert shares[np.isin(far, others)].max(initial=0) < 0.2


@pytest.mark.parametrize("build", quick(BUILDS, BUILDS[2]), ids=lambda b: f"{b.height}")
def test_bones_keep_their_lengths_and_feet_on_the_ground_stand_still(build):
    s = skeleton(build)
    for name, clip in clips(s, Manner(lively=1.3, swing=1.2, stance=1.4)).items():
        joints = moving(clip)(s)
        np.testing.assert_allclose(joints[-1], joints[0], atol=1e-9)  # its end is its beginning
        for i, above in enumerate(PARENTS):
            if above >= 0:
                length = np.linalg.norm(joints[:, i, :3, 3] - joints[:, above, :3, 3], axis=1)
                np.testing.assert_allclose(length, np.linalg.norm(s.places[i] - s.places[above]), atol=1e-9)
        away = np.array(clip.seconds)[:, None] * (0, -clip.extras["speed"], 0)
        held = 0
        for side in ("L_", "R_"):
            ankle = JOINTS.index(f"{side}Ankle")
            for spot in (s[f"{side}Foot"] * (1, 1, 0), s[f"{side}Ankle"] * (1, 1, 0) + (0, 0.045, 0)):
                turned = (joints[:, ankle, :3, :3] * (spot - s.places[ankle])).sum(axis=2) + joints[:, ankle, :3, 3] + away
                assert turned[:, 2].min() > -1e-3
                down = turned[:, 2] < 1e-3
                for run in np.split(np.flatnonzero(down), np.flatnonzero(np.diff(np.flatnonzero(down)) > 1) + 1):
                    assert len(run) == 0 or np.ptp(turned[run], axis=0).max() < 5e-3, (name, side)
                held += int(down.sum())
        share = held / 4 / len(clip.seconds)
        low, high = {"walk": (0.3, 0.6), "run": (0.15, 0.4)}.get(name, (0.99, 1.0))
        assert low <= share <= high, name


@pytest.mark.parametrize("build", quick(BUILDS, BUILDS[1]), ids=lambda b: f"{b.height}")
def test_who_sits_has_level_thighs_above_the_chair(build):
    s = skeleton(build)
    for pose in clips(s, Manner())["sit"].poses:
        places = joints_at(s.places, PARENTS, pose)[:, :3, 3]
        for side in ("L_", "R_"):
            hip, knee, ankle = (places[JOINTS.index(side + name)] for name in ("Hip", "Knee", "Ankle"))
            assert SEAT + 0.04 < hip[2] < SEAT + 0.15
            assert abs(knee[2] - hip[2]) < 0.35 * np.linalg.norm(knee - hip)
            assert knee[1] < hip[1] - 0.3 and ankle[2] < 0.1


# From here on it is a file as any other.


@pytest.mark.slow
def test_its_file_plays_without_blender_and_rests_in_a_pose_that_nobody_is_rigged_in(monkeypatch):
    monkeypatch.setattr("viewsphere.assets.readers.blender.reading.find_blender", None)
    one, spec = made(1), spec_of()
    mesh, facts = load(spec)
    assert mesh.body_parts == SMPL and [*facts.keypoints.points] == list(SMPL)
    wrists = [np.array(facts.keypoints.points[f"{side}_Wrist"])[0] for side in "LR"]
    assert abs(wrists[0] - wrists[1]) < 0.8 < abs(one.places[20, 0] - one.places[21, 0])
    pose = one.clips["walk"].poses[17]
    now, facts = load(spec.model_copy(update={"rest": 0, "clip": "walk"}), step=TimeStep(frame=17, seconds=17 / 60))
    found = np.array([*facts.keypoints.points.values()])
    found = np.stack([found[:, 0], -found[:, 2], found[:, 1]], axis=1)  # the file's up is +y
    np.testing.assert_allclose(found, one.posed(pose), atol=1e-5)
    assert now.vertices.shape == mesh.vertices.shape and abs(now.bounds[0, 2]) < 0.02
    np.testing.assert_array_equal(zoo.build("person", np.random.default_rng(1)).vertices, mesh.vertices)


@pytest.mark.slow
def test_a_cache_that_cannot_be_written_costs_time_only(monkeypatch, tmp_path):
    whole = zoo.file_of(spec_of()).read_bytes()
    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path / "full"))

    def full(file):
        raise OSError(errno.ENOSPC, "No space left on device", str(file))

    monkeypatch.setattr(zoo, "making", full)
    files = [zoo.file_of(spec_of()) for _ in range(2)]
    assert files[0] == files[1] and not (tmp_path / "full").exists()
    assert files[0].read_bytes() == whole


def test_inspect_lists_its_clips():
    line = describe(spec_of()).animation
    assert {clip.name for clip in line.clips} == set(CLIPS) and line.fps == 60
    walk = next(clip for clip in line.clips if clip.name == "walk")
    assert (line.first, line.last) == (walk.first, walk.last) and 0.9 < line.seconds(line.last) < 1.3


def test_a_family_that_does_not_move_and_a_clip_that_nobody_has_cost_one_line():
    said = {"viewpoints": {"distance": 4}, "formats": [], "time": {"frames": 2, "fps": 10}}
    with pytest.raises(RecipeError, match=r"models\[0\].motion: expected a file, or a model that moves; found zoo:car, which"):
        plan(Recipe(models=[{"source": "zoo:car", "motion": {"kind": "clip"}}], **said))
    with pytest.raises(RecipeError, match="expected an animation 'fly', found 'run', 'sit', 'stand', 'walk'"):
        plan(Recipe(models=[{"source": "zoo:person", "clip": "fly", "motion": {"kind": "clip"}}], **said))


@pytest.fixture(scope="module")
def walked(tmp_path_factory):
    """The recipe that ships, smaller."""
    recipe = Recipe.load(ROOT / "recipes" / "people.yaml")
    small = recipe.model_copy(
        update={
            "time": recipe.time.model_copy(update={"frames": 3}),
            "camera": recipe.camera.model_copy(update={"size": (64, 64)}),
        }
    )
    out = tmp_path_factory.mktemp("people")
    generate(small, out, workers=0)
    return Dataset(out)


@pytest.mark.slow
def test_the_recipe_makes_a_data_set_that_passes(walked):
    assert len(walked) == 3
    report = check(walked, sample=None)
    assert report.ok, report.findings
    for sample in walked:
        (one,) = sample.objects
        assert tuple(one.keypoint_names) == SMPL
        own = sample.channels["instances"] == one.id
        assert own.sum() > 150 and (sample.channels["body_parts"][own] > 0).all()
        assert len(np.unique(sample.channels["body_parts"][own])) > 10


@pytest.mark.slow
def test_a_foot_that_is_down_stays_where_it_is_in_the_world(walked):
    places = []
    for sample in walked:
        (one,) = sample.objects
        camera = sample.camera
        places.append((one.keypoints3d_camera - camera.t) @ camera.R)
    toes = np.array(places)[:, [JOINTS.index("L_Foot"), JOINTS.index("R_Foot")]]
    moved = np.linalg.norm(np.diff(toes, axis=0), axis=2).min(axis=1)
    hips = np.linalg.norm(np.diff(np.array(places)[:, 0], axis=0), axis=1)
    assert (moved < 0.02).all() and (hips > 0.1).all()


@pytest.mark.slow
def test_surreals_format_takes_its_joints_and_parts(walked, tmp_path):
    pytest.importorskip("scipy")
    from viewsphere.formats.surreal.body import joints, part_numbers

    one = next(iter(walked)).objects[0]
    naming, places = joints(one.keypoint_names)
    assert naming == SMPL and places.tolist() == list(range(24))
    info = walked.models[0]
    assert part_numbers(info.steps[0].body_parts, SMPL).tolist() == list(range(25))


@pytest.mark.slow
def test_a_store_holds_the_mesh_that_was_drawn(walked):
    info = walked.models[0]
    step = info.steps[0]
    spec = spec_of(0, source=str(walked.path(info.glb)))
    seen = load_normalised(spec)
    assert len(seen.triangles) > 20_000 and step.body_parts == SMPL


@pytest.mark.slow
def test_an_export_tells_the_same_joints(walked):
    (file,) = (walked.root / "coco" / "annotations").glob("*.json")
    told = {one["image_id"]: one for one in json.loads(file.read_text())["annotations"]}
    assert len(told) == len(walked)
    for sample, one in zip(walked, (told[i] for i in sorted(told)), strict=True):
        pixels = np.array(one["keypoints"]).reshape(-1, 3)
        seen = pixels[:, 2] > 0
        camera, places = sample.camera, np.asarray(sample.objects[0].keypoints3d_camera)
        found = places @ camera.K.T
        own = found[:, :2] / found[:, 2:] - 0.5  # in COCO a pixel's centre is at whole numbers
        np.testing.assert_allclose(pixels[seen, :2], own[seen], atol=0.02)
        assert seen.sum() >= 20
