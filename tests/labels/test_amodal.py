"""Labels of what is hidden: closed forms, random scenes against Embree's rays, and records that give back every bit."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_object_labels import LENS, UNIT, at, block, scene

import viewsphere as vs
from proven import close, equal, told
from viewsphere.errors import RecipeError
from viewsphere.geometry.camera import pixel_rays
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.geometry.mask import decode_rle
from viewsphere.labels import object_labels, on_request
from viewsphere.model.instant import Viewpoint
from viewsphere.model.sample import Sample
from viewsphere.store.shots.sample_records import from_whole_sample, whole_sample

ASKED = ("amodal", "occluders", "depth_order", "occlusion_level", "truncation_level", "obb", "contour", "birds_eye")
LENSES = {
    "pinhole": LENS,
    "fisheye": LENS.model_copy(update={"distortion": lens_parameters("fisheye", coefficients=(0.03, -0.004, 0.0007, -0.0001))}),
}


def amodal(o):
    return decode_rle(o.amodal.height, o.amodal.width, o.amodal.counts)


def sample_of(found):
    objects, camera, _, _, pose = found
    return Sample(0, "train", camera, pose, objects, {}, {}, requested=ASKED)


def proofs(sample):
    return [f"{name}: {message}" for name in ASKED for message in on_request()[name].prove(sample, {})]


def test_a_cube_behind_a_cube():
    found = scene([UNIT, block((-2,) * 3, (2,) * 3)], [at(), at(y=6.0)], asked=ASKED)
    near, far = found[0]
    np.testing.assert_array_equal(amodal(near), near.mask)
    np.testing.assert_array_equal(amodal(far) & ~far.mask, near.mask)
    assert (near.occluders, near.occlusion_level, near.truncation_level) == ((), 0, 0)
    told("occlusion_level", "two cubes", (near.occlusion_level, far.occlusion_level - 1))
    ((front),) = far.occluders
    assert (front.id, front.share) == (1, near.area / amodal(far).sum())
    assert far.occlusion_level == 1
    (over,), (under,) = near.overlaps, far.overlaps
    assert (over.id, over.pixels, over.nearer) == (2, near.area, 1.0)
    assert (under.id, under.pixels, under.nearer) == (1, near.area, 0.0)
    half = 2 / 8 * 125  # the farther cube's front is 8 m away
    assert far.box2d_amodal == (
        np.ceil(80 - half - 0.5),
        np.ceil(60 - half - 0.5),
        *np.ceil([80 + half - 0.5, 60 + half - 0.5]),
    )
    assert proofs(sample_of(found)) == []


def test_a_wholly_hidden_object_is_still_told():
    found = scene([block((-2, -0.1, -2), (2, 0.1, 2)), UNIT], [at(), at(y=2.0)], asked=ASKED)
    wall, cube = found[0]
    assert (cube.area, cube.box2d, cube.obb) == (0, None, None)
    assert amodal(cube).sum() > 100 and cube.box2d_amodal is not None
    assert [(one.id, one.share) for one in cube.occluders] == [(1, 1.0)]
    assert (cube.occlusion_level, wall.occlusion_level) == (2, 0)
    assert (len(cube.contour), len(cube.hull)) == (0, 0)
    assert proofs(sample_of(found)) == []


def test_the_grades_of_truncation():
    found = scene([UNIT] * 4, [at(x=x, y=6.0 * i) for i, x in enumerate((0.0, 6.2, 10.2, 30.0))], asked=ASKED)
    inside, cut, largely, outside = found[0]
    assert [o.truncation_level for o in (inside, cut, largely, outside)] == [0, *(_grade(o) for o in (cut, largely)), 2]
    assert {_grade(cut), _grade(largely)} <= {1, 2}
    told("truncation_level", "four cubes", [o.truncation_level - _grade(o) for o in (inside, cut, largely, outside)])
    assert outside.occlusion_level == 3 and outside.occluders == () and amodal(outside).sum() == 0
    assert proofs(sample_of(found)) == []


def _grade(o):
    return (o.truncation > 0.15) + (o.truncation > 0.5)


def test_a_leaning_bar_has_an_oriented_box():
    """A thin bar that lies askew in the picture's plane: its rectangle is far smaller than its upright box, and leans, too."""
    angle = np.radians(30)
    c, s = np.cos(angle), np.sin(angle)
    pose = ((c, 0, -s, 0), (0, 1, 0, 0), (s, 0, c, 0), (0, 0, 0, 1))
    found = scene([block((-1, -0.01, -0.1), (1, 0.01, 0.1))], [pose], asked=ASKED)
    (bar,) = found[0]
    for corners, slack in ((bar.obb, 1.5), (bar.obb_projected, 1e-9)):
        sides = np.roll(corners, -1, axis=0) - corners
        lengths = np.hypot(*sides.T)
        long = sides[lengths.argmax()]
        near = 125 / 3.99  # pixels a metre at the bar's front
        assert abs(lengths.max() - 2 * near) < slack + 0.4 and abs(lengths.min() - 0.2 * near) < slack + 0.4
        assert abs(long[1] / long[0] + np.tan(angle)) < 0.02  # y points down
        if corners is bar.obb_projected:
            told("obb", "a bar's closed form", (lengths.max() - 2 * near, lengths.min() - 0.2 * near), "px")
    assert proofs(sample_of(found)) == []


@pytest.mark.parametrize(("turn", "yaw"), [(0.0, -90.0), (90.0, 0.0), (30.0, -60.0), (-135.0, 135.0)])
def test_a_box_from_above(turn, yaw):
    """A model faces -Y: turned by an angle about Z its heading is that angle less 90 degrees."""
    found = scene([block((-1, -2, 0), (1, 2, 1))], [at(x=3.0, y=4.0, turn=np.radians(turn))], asked=ASKED)
    (o,) = found[0]
    box = o.birds_eye
    close("birds_eye", "closed form", (box.x, box.y, box.length, box.width), (3, 4, 4, 2), "m", atol=1e-9)
    assert box.yaw_deg == pytest.approx(yaw)
    front = o.birds_eye_corners[:2].mean(axis=0) - (box.x, box.y)
    assert np.degrees(np.arctan2(*front[::-1])) == pytest.approx(yaw)
    assert proofs(sample_of(found)) == []


def test_labels_that_nobody_asked_for_follow_or_are_missing():
    objects, *_ = scene([UNIT], [at()])
    (cube,) = objects
    assert not cube.extra
    assert cube.occlusion_level == 0 and len(cube.hull) == 4 and cube.birds_eye.length == 1.0
    assert not cube.extra
    with pytest.raises(AttributeError, match=r"no 'amodal'.*add it to the recipe's annotations"):
        _ = cube.amodal


def random_scene(seed, lens):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 6))
    meshes = [block(-size, size) for size in rng.uniform(0.1, 0.8, (count, 3))]
    motions = [at(*rng.uniform(-1.2, 1.2, 3), turn=rng.uniform(0, 6)) for _ in range(count)]
    pose = Viewpoint(index=0, azimuth_deg=rng.uniform(0, 360), elevation_deg=rng.uniform(-20, 60), distance=rng.uniform(3.5, 6))
    return scene(meshes, motions, pose, LENSES[lens], ground=bool(rng.integers(2)), asked=ASKED)


@pytest.mark.parametrize("lens", LENSES)
@settings(max_examples=12, derandomize=True, deadline=None, database=None)
@given(seed=st.integers(0, 10**6))
@pytest.mark.slow
def test_random_scenes_prove_themselves_and_come_back(lens, seed):
    sample = sample_of(random_scene(seed, lens))
    assert proofs(sample) == []
    back = from_whole_sample(json.loads(json.dumps(whole_sample(sample), allow_nan=False)), {}, {})
    assert back.requested == ASKED
    fields = [field for label in object_labels() if label.on_request and label.name in ASKED for field in label.fields]
    for o, again in zip(sample.objects, back.objects, strict=True):
        for field in fields:
            assert field.equals(getattr(o, field.name), getattr(again, field.name)), field.name


@pytest.mark.parametrize("lens", LENSES)
@settings(max_examples=8, derandomize=True, deadline=None, database=None)
@given(seed=st.integers(0, 10**6))
@pytest.mark.slow
def test_embree_sees_the_same_hidden_parts(lens, seed):
    """Rays at each object alone are its amodal mask; the first of all hits is what hides it. Rays within rounding of an edge
    may meet one or the other: fewer than 1 pixel in 2,000.
    """
    pytest.importorskip("embreex")
    objects, camera, geometry, *_ = random_scene(seed, lens)
    alone = {o.id: embree(camera, geometry, geometry.triangle_object == o.id) for o in objects}
    first, _ = embree(camera, geometry, np.ones(len(geometry.triangles), bool))
    seen = np.where(first >= 0, geometry.triangle_object[first], 0)
    for o in objects:
        hit, distance = alone[o.id][0] >= 0, alone[o.id][1]
        assert (hit != amodal(o)).sum() <= hit.size / 2000
        told("amodal", "Embree's rays, a share of all pixels", (hit != amodal(o)).mean())
        for one in o.occluders:
            hidden = (hit & (seen == one.id)).sum()
            assert abs(one.share - hidden / hit.sum()) <= 20 / hit.sum()
            told("occluders", "Embree's rays, a share of all pixels", (one.share * hit.sum() - hidden) / hit.size)
        for one in o.overlaps:
            both = hit & (alone[one.id][0] >= 0)
            assert abs(one.pixels - both.sum()) <= hit.size / 1000
            told("depth_order", "Embree's rays, a share of all pixels", (one.pixels - both.sum()) / hit.size)
            assert abs(one.nearer * one.pixels - (both & (distance < alone[one.id][1])).sum()) <= hit.size / 1000


@pytest.mark.parametrize("seed", range(4))
def test_contours_enclose_the_visible_pixels_and_no_others(seed):
    """By the parity of edges to the right of each pixel's centre; every corner of them lies within the hull."""
    objects, camera, *_ = random_scene(seed, "pinhole")
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    for o in objects:
        crossed = np.zeros(x.shape, int)
        for ring in o.contour:
            for (x0, y0), (x1, y1) in zip(ring, np.roll(ring, -1, axis=0), strict=True):
                crossed += ((y0 > y) != (y1 > y)) & (x0 + (y - y0) * (x1 - x0) / (y1 - y0 if y1 != y0 else 1) > x)
        equal("contour", "parity of edges", crossed % 2 == 1, o.mask)
        for corners in o.contour:
            side = np.roll(o.hull, -1, axis=0) - o.hull
            away = corners[:, None] - o.hull
            assert (side[:, 0] * away[..., 1] - side[:, 1] * away[..., 0] >= -1e-9).all()


def embree(camera, geometry, chosen):
    """The triangle that each pixel's ray meets first among the chosen ones, -1 for none, and how far away."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    numbers = np.flatnonzero(chosen)
    world = EmbreeScene(robust=True)
    TriangleMesh(world, geometry.vertices.astype(np.float32), geometry.triangles[numbers])
    rays = pixel_rays(camera.intrinsics)
    directions = (rays.reshape(-1, 3) @ camera.R).astype(np.float32)
    hit = world.run(np.broadcast_to(camera.center.astype(np.float32), directions.shape).copy(), directions, output=True)
    found = np.asarray(hit["primID"], np.int64)
    triangle = np.where(found < 0, -1, numbers[found]).reshape(rays.shape[:2])
    return triangle, np.asarray(hit["tfar"]).reshape(rays.shape[:2])


TAMPERED = {
    "amodal": lambda o: {"box2d_amodal": (0.0, 0.0, 1.0, 1.0)},
    "occluders": lambda o: {"occluders": tuple(replace(one, share=one.share * 0.9) for one in o.occluders)},
    "depth_order": lambda o: {"overlaps": tuple(replace(one, pixels=one.pixels + 1) for one in o.overlaps)},
    "occlusion_level": lambda o: {"occlusion_level": 3},
    "truncation_level": lambda o: {"truncation_level": 1},
    "obb": lambda o: {"obb": o.obb + np.array([[1.0, 0], [0, 0], [0, 0], [0, 0]])},
    "contour": lambda o: {"hull": o.hull[1:]},
    "birds_eye": lambda o: {"birds_eye": replace(o.birds_eye, yaw_deg=o.birds_eye.yaw_deg + 1)},
}


@pytest.mark.parametrize("name", ASKED)
def test_proofs_notice_what_was_changed(name):
    found = scene([UNIT, block((-2,) * 3, (2,) * 3)], [at(), at(y=6.0)], asked=ASKED)
    sample = sample_of(found)
    far = sample.objects[1]
    changed = replace(far, extra={**far.extra, **TAMPERED[name](far)})
    assert list(on_request()[name].prove(replace(sample, objects=(sample.objects[0], changed)), {}))


def recipe(*annotations):
    return {
        "models": [{"source": "zoo:chair", "category": "chair"}],
        "viewpoints": {"azimuth": [0], "elevation": [20], "distance": 3},
        "annotations": list(annotations),
    }


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("amodl", r"annotations\[0\]: 'amodl' is unknown; did you mean 'amodal'\? Valid: .*"),
        ("depth", r"annotations\[0\]: expected a label of objects.*found depth, which is one of channels"),
        ("pose", r"annotations\[0\]: expected a label on request; found pose, which every data set has"),
        ("hull", r"annotations\[0\]: expected a label; found hull, a field of contour: name that"),
    ],
)
def test_a_label_that_cannot_be_asked_for_is_told_before_rendering(entry, message):
    with pytest.raises(RecipeError, match=message):
        vs.plan(vs.Recipe(**recipe(entry)))


def test_a_label_of_objects_is_no_channel():
    with pytest.raises(RecipeError, match=r"channels\[1\]: expected a channel; found amodal, which is one of annotations"):
        vs.plan(vs.Recipe(**recipe(), channels=["rgb", "amodal"]))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"amodal": {"size": 3}}, r"labels\.amodal: expected no options, amodal has none; found size"),
        ({"obb": {}}, r"labels\.obb: expected no options, obb has none; found a mapping"),
        (
            {"keypoints": {}},
            r"labels: expected .* recipe names; found 'keypoints': name it in channels or annotations",
        ),
        ({"keypoint": {}}, r"labels: 'keypoint' is unknown; did you mean 'keypoints'\? Valid: .*"),
        ({"amodal": 3}, r"labels\.amodal: expected a mapping"),
    ],
)
def test_options_that_no_label_has_are_told_before_rendering(options, message):
    with pytest.raises(RecipeError, match=message):
        vs.plan(vs.Recipe(**recipe("amodal"), channels=["rgb"], labels=options))


def test_a_label_is_asked_for_once():
    with pytest.raises(RecipeError, match="expected distinct names; found 'amodal' twice"):
        vs.Recipe(**recipe("amodal", "amodal"))


def test_what_nobody_asks_for_changes_no_digest():
    assert vs.Recipe(**recipe()).digest == vs.Recipe(**{k: v for k, v in recipe().items() if k != "annotations"}).digest
    assert vs.Recipe(**recipe("amodal")).digest != vs.Recipe(**recipe()).digest


def test_annotations_are_not_added_to_frames_that_are_there(tmp_path):
    small = recipe() | {"camera": {"size": [32, 24]}, "channels": ["instances"], "formats": []}
    vs.generate(vs.Recipe(**small), tmp_path, workers=0)
    more = small | {"annotations": ["obb", "amodal"], "viewpoints": {"azimuth": [0, 90], "elevation": [20], "distance": 3}}
    with pytest.raises(RecipeError, match=r"annotations: expected those of the frames that are there \(none\).*found obb"):
        vs.generate(vs.Recipe(**more), tmp_path, workers=0, append=True)
    assert len(vs.open(tmp_path)) == 1
