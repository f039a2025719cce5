import itertools
import json
import pickle
import subprocess
import sys
from dataclasses import fields

import numpy as np
import pytest

from proven import close, equal
from shots import still_shot
from viewsphere.assets.mesh import Mesh
from viewsphere.geometry.box import clip_to_image
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.camera import orbit_center, orbit_rotation
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.geometry.rotation import matrix_from_quaternion, rigid
from viewsphere.labels import annotated, context_of, labels_of, object_labels, regular
from viewsphere.labels.shared.placement import view_of
from viewsphere.model.instant import Viewpoint
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.model.thing import Motion, Thing
from viewsphere.store.shots.sample_records import from_whole_sample, whole_sample
from viewsphere.truth.raster.geometry import build_geometry
from viewsphere.truth.raster.visibility import rasterize

HALVES = ((0, 1, 2), (0, 2, 3))
TRIANGLES = np.array([[face[i] for i in half] for face in Box3d.numbered_faces().values() for half in HALVES], np.int32)
LENS = Intrinsics(width=160, height=120, fx=125, fy=125, cx=80, cy=60)


def block(low, high):
    vertices = Box3d.between(low, high).corners.astype(np.float32)
    normals = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    zeros = np.zeros(len(TRIANGLES), np.int32)
    return Mesh(vertices, TRIANGLES, normals.astype(np.float32), zeros, zeros)


UNIT = block((-0.5,) * 3, (0.5,) * 3)


def at(x=0.0, y=0.0, z=0.0, turn=0.0):
    c, s = np.cos(turn), np.sin(turn)
    return ((c, -s, 0, x), (s, c, 0, y), (0, 0, 1, z), (0, 0, 0, 1))


def scene(meshes, motions, pose=None, intrinsics=LENS, ground=False, category_deg=45.0, asked=()):
    """Annotations of a frame, and all that they came from; the camera looks at the world's origin."""
    pose = pose or Viewpoint(index=0, azimuth_deg=0, elevation_deg=0, distance=4)
    angles = np.radians([pose.azimuth_deg, pose.elevation_deg, pose.tilt_deg])
    rotation = orbit_rotation(*angles)
    camera = Camera(intrinsics, rotation, -rotation @ orbit_center(*angles[:2], pose.distance))
    specs = [
        ModelSpec(key=f"m{i}", source="x.obj", category="cube", category_id=1, real_size=(1, 2, 3)) for i in range(len(meshes))
    ]
    things = tuple(
        Thing(id=i + 1, model=s, motion=Motion.still(m)) for i, (s, m) in enumerate(zip(specs, motions, strict=True))
    )
    shot = still_shot(things, intrinsics, [pose], category_deg=category_deg, annotations=asked)
    geometry = build_geometry(things, meshes, ground, 0.01)
    visibility = rasterize(geometry, camera)
    boxes = [Box3d.between(*m.bounds).corners for m in meshes]
    objects = annotated(context_of(shot, 0, camera, geometry, visibility, boxes, [f"MODELS/{s.key}.glb" for s in specs]))
    return objects, camera, geometry, visibility, pose


def test_a_cube_seen_head_on():
    (cube,), *_ = scene([UNIT], [at()])
    half = 0.5 / 3.5 * 125  # 17.857 px about (80, 60)
    around = (80 - half, 60 - half, 80 + half, 60 + half)
    close("box2d_projected", "closed form", cube.box2d_projected, around, "px", atol=1e-9)
    assert cube.box2d_unclipped == cube.box2d_projected
    assert cube.box2d == (62, 42, 98, 78)  # pixel centres within
    expected = np.zeros((120, 160), bool)
    expected[42:78, 62:98] = True
    equal("mask", "closed form", cube.mask, expected)
    assert cube.area == 36 * 36
    assert cube.polygons == [[62, 42, 98, 42, 98, 78, 62, 78]]
    assert (cube.visibility, cube.truncation) == (1.0, 0.0)
    close("size", "closed form", (*cube.size, *cube.real_size), (1, 1, 1, 1, 2, 3), "m")
    equal("pose_category", "closed form", cube.pose_category, "front")
    equal("category", "the recipe's entry", (cube.category, cube.supercategory, cube.category_id), ("cube", "", 1))
    equal("model", "the model's file", (cube.key, cube.model, cube.track), ("m0", "MODELS/m0.glb", ""))
    assert cube.id == 1
    np.testing.assert_allclose(cube.box3d_camera.mean(axis=0), (0, 0, 4), atol=1e-15)
    np.testing.assert_array_equal(cube.box3d, cube.box3d_object)
    np.testing.assert_allclose(cube.box3d_pixels[1], (80 + half, 60 + half))  # front, left of the object, bottom
    assert cube.box3d_in_front.all()
    assert cube.quaternion == pytest.approx((np.sqrt(0.5), np.sqrt(0.5), 0, 0))  # z up to y down


def test_labels_of_placements_are_computed_when_read():
    (cube,), *_ = scene([UNIT], [at(x=0.2, turn=0.3)], asked=("birds_eye", "occlusion_level"))
    waiting = ("box3d", "box3d_pixels", "view", "pose_category", "size", "quaternion", "category", "hull")
    held = vars(cube)
    assert not [name for name in waiting if name in held]
    assert {"rle", "box2d", "box2d_projected", "visibility", "birds_eye", "occlusion_level"} <= held.keys()
    assert cube.view.distance > 0 and "view" in held and "box3d" not in held
    there = pickle.loads(pickle.dumps(cube))  # other processes get all fields
    np.testing.assert_array_equal(there.box3d, cube.box3d)
    assert (there.view, there.quaternion, there.occlusion_level) == (cube.view, cube.quaternion, cube.occlusion_level)
    assert len(cube.hull) and not hasattr(cube, "amodal")


@pytest.mark.parametrize("seed", range(12))
def test_p_times_the_box_is_the_box_in_pixels(seed):
    rng = np.random.default_rng(seed)
    azimuth, elevation, tilt, distance = rng.uniform((0, -90, -180, 1.2), (360, 90, 180, 9))
    pose = Viewpoint(index=0, azimuth_deg=azimuth, elevation_deg=elevation, distance=distance, tilt_deg=tilt)
    turns = [matrix_from_quaternion(rng.normal(size=4)) for _ in range(3)]
    motions = [rigid(turn, rng.uniform(-2, 2, 3)).tolist() for turn in turns]
    meshes = [block(-rng.uniform(0.1, 1, 3), rng.uniform(0.1, 1, 3)) for _ in range(3)]
    intrinsics = LENS.model_copy(update={"skew": 3.0, "fy": 140.0, "cx": 70.5})
    objects, camera, geometry, visibility, _ = scene(meshes, motions, pose, intrinsics)
    for o in objects:
        homogeneous = np.column_stack([o.box3d, np.ones(8)]) @ camera.P.T
        np.testing.assert_array_equal(o.box3d_in_front, homogeneous[:, 2] > 0)
        front = o.box3d_in_front
        pixels = homogeneous[front, :2] / homogeneous[front, 2:]
        close("box3d", "P x vertex", o.box3d_pixels[front], pixels, "px", rtol=1e-9, atol=1e-6)
        assert np.isnan(o.box3d_pixels[~front]).all()
        close("pose", "camera x pose", o.camera_from_object, rigid(camera.R, camera.t) @ o.world_from_object, "m", atol=1e-12)
        np.testing.assert_allclose(matrix_from_quaternion(o.quaternion), o.camera_from_object[:3, :3], atol=1e-12)
        ids = np.where(visibility.triangle < 0, 0, geometry.triangle_object[visibility.triangle])
        np.testing.assert_array_equal(o.mask, ids == o.id)
        assert o.area == o.mask.sum()
        if o.area:
            rows, columns = np.nonzero(o.mask)
            equal("box2d", "all pixels", o.box2d, (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1))
        else:
            assert o.box2d is None
        large = rasterize(geometry, camera, object_id=o.id, window=(-160, -120, 320, 240)).triangle >= 0
        total, inside = large.sum(), large[120:240, 160:320].sum()
        if total:
            assert o.visibility == o.area / total
            assert o.truncation == (total - inside) / total
        else:
            assert o.visibility == 0
        if o.box2d_unclipped and o.box2d_projected:
            u = o.box2d_unclipped
            assert o.box2d_projected == (max(u[0], 0), max(u[1], 0), min(u[2], 160), min(u[3], 120))


POSES = list(itertools.product((0, 30, 135, 359), (-90, -35, 0, 60, 90), (0, 25, -170)))


@pytest.mark.parametrize(("azimuth", "elevation", "tilt"), POSES)
def test_the_view_of_an_object_at_the_target_is_the_pose(azimuth, elevation, tilt):
    pose = Viewpoint(index=0, azimuth_deg=azimuth, elevation_deg=elevation, distance=4, tilt_deg=tilt)
    (cube,), *_ = scene([UNIT], [at()], pose)
    view = cube.view
    assert view.distance == pytest.approx(4)
    close("view", "the camera's pose", view.elevation_deg, elevation, "deg", atol=1e-9)
    if abs(elevation) < 90:
        assert (view.azimuth_deg, view.tilt_deg) == pytest.approx((azimuth, tilt), abs=1e-9)
    else:  # azimuth and tilt are one and the same turn there
        assert view.tilt_deg == 0
        again = orbit_rotation(*np.radians([view.azimuth_deg, elevation]))
        np.testing.assert_allclose(again, orbit_rotation(*np.radians([azimuth, elevation, tilt])), atol=1e-12)


def test_the_view_is_in_the_objects_own_axes():
    # turned a quarter to the left (towards +X), an object shows a camera on -Y its right side
    (cube,), *_ = scene([UNIT], [at(turn=np.pi / 2)])
    assert cube.view.azimuth_deg == pytest.approx(270)
    assert cube.pose_category == "right"
    (fine,), *_ = scene([UNIT], [at(turn=np.pi / 2)], category_deg=30.0)
    assert fine.pose_category == "az270"


def test_the_view_of_an_object_off_the_axis_needs_no_tilt():
    for x, z in ((1.5, 0.0), (0.0, 1.0), (-1.2, 0.0)):
        (cube,), *_ = scene([UNIT], [at(x=x, z=z)])
        assert cube.view.tilt_deg == pytest.approx(0, abs=1e-9)
        assert cube.view.azimuth_deg == pytest.approx(np.degrees(np.arctan2(-x, 4)) % 360)
        assert cube.view.elevation_deg == pytest.approx(np.degrees(np.arctan2(-z, np.hypot(x, 4))))
        assert cube.view.distance == pytest.approx(np.sqrt(16 + x * x + z * z))


def test_the_view_from_inside_and_of_what_is_behind():
    assert view_of(rigid(np.eye(3), (0, 0, 0)), np.zeros(3)).distance == 0
    behind = view_of(rigid(orbit_rotation(0, 0), (0, 0, -4)), np.zeros(3))
    assert (behind.azimuth_deg, behind.distance) == pytest.approx((180, 4))


def test_one_cube_hides_another():
    front, back = scene([UNIT, UNIT], [at(y=-1), at(x=0.5, y=1)])[0]
    assert (front.visibility, front.truncation) == (1, 0)
    assert 0 < back.visibility < 0.5
    assert back.truncation == 0
    hidden = scene([UNIT, UNIT], [at(y=-1), at(y=1)])[0][1]
    assert (hidden.area, hidden.box2d, hidden.visibility, hidden.truncation) == (0, None, 0, 0)
    assert hidden.polygons == []
    assert not hidden.mask.any()
    assert hidden.box2d_projected is not None


def test_a_cube_half_outside():
    plate = block((-0.5, -0.001, -0.5), (0.5, 0.001, 0.5))
    (cut,), *_ = scene([plate], [at(x=80 / 125 * 3.999)])  # its middle projects to the image's right edge
    close("visibility", "a plate half outside", (cut.truncation, cut.visibility), (0.5, 0.5))
    assert cut.box2d_projected[2] == 160 < cut.box2d_unclipped[2]


def test_an_object_far_outside_and_one_behind():
    outside, behind = scene([UNIT, UNIT], [at(x=100), at(y=-9)])[0]
    for o in (outside, behind):
        assert (o.area, o.box2d, o.box2d_projected, o.visibility, o.truncation) == (0, None, None, 0, 1)
    assert outside.box2d_unclipped is not None
    assert behind.box2d_unclipped is None
    assert not behind.box3d_in_front.any()


def test_a_model_that_crosses_the_camera_plane():
    (corridor,), camera, geometry, *_ = scene([block((0.5, -9, -0.5), (1, 3, 0.5))], [at()])
    assert corridor.box2d_unclipped is None
    assert corridor.box2d_projected == pytest.approx((80 + 0.5 / 7 * 125, 0, 160, 120))
    assert corridor.box3d_in_front.sum() == 4
    assert corridor.area > 1000
    large = rasterize(geometry, camera, object_id=1, window=(-160, -120, 320, 240)).triangle >= 0
    assert corridor.visibility == corridor.area / large.sum()
    assert corridor.truncation == 1 - large[120:240, 160:320].sum() / large.sum()


def cut_hull(vertices, faces, camera, near=1e-6):
    """The bounds of faces cut at the plane z = near, clipped to the image, by Sutherland and Hodgman's method."""
    found = []
    for face in faces:
        corners = vertices[list(face)] @ camera.R.T + camera.t
        for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            if a[2] >= near:
                found.append(a)
            if (a[2] < near) != (b[2] < near):
                found.append(a + (near - a[2]) / (b[2] - a[2]) * (b - a))
    if not found:
        return None
    u, v = (np.array(found) @ camera.K.T / np.array(found)[:, 2:]).T[:2]
    return clip_to_image((u.min(), v.min(), u.max(), v.max()), camera.width, camera.height)


@pytest.mark.parametrize("seed", range(12))
def test_boxes_of_what_crosses_the_camera_plane_are_exact(seed):
    rng = np.random.default_rng(seed)
    low = np.array([rng.uniform(-2, 1), -rng.uniform(4.1, 9), rng.uniform(-2, 1)])
    model = block(low, (low[0] + rng.uniform(0.2, 1), rng.uniform(-3, 3), low[2] + rng.uniform(0.2, 1)))
    pose = Viewpoint(index=0, azimuth_deg=rng.uniform(-25, 25), elevation_deg=rng.uniform(-25, 25), distance=4)
    (found,), camera, geometry, *_ = scene([model], [at()], pose)
    expected = cut_hull(geometry.vertices, list(Box3d.numbered_faces().values()), camera)
    assert found.box2d_unclipped is None or expected == pytest.approx(found.box2d_projected)
    assert (expected is None) == (found.box2d_projected is None)
    if expected:
        close("box2d_projected", "cut at the camera's plane by hand", found.box2d_projected, expected, "px", atol=1e-6)


@pytest.mark.parametrize("elevation", [30, 5, -5])
def test_the_ground_hides_only_from_below(elevation):
    pose = Viewpoint(index=0, azimuth_deg=20, elevation_deg=elevation, distance=4)
    (cube,), camera, geometry, *_ = scene([UNIT], [at()], pose, ground=True)
    alone = (rasterize(geometry, camera, object_id=1, window=(0, 0, 160, 120)).triangle >= 0).sum()
    assert cube.visibility == cube.area / alone
    assert (cube.visibility == 1) == (camera.center[2] > -0.5)


def test_lens_distortion_is_followed():
    lens = lens_parameters("brown_conrady", coefficients=(-0.3, 0.1, 0.0, 0.0))
    (cube,), *_ = scene([UNIT], [at(x=1.0)], intrinsics=LENS.model_copy(update={"distortion": lens}))
    corners = cube.box3d_camera[[0, 1, 4, 5]]
    r2 = ((corners[:, :2] / corners[:, 2:]) ** 2).sum(axis=1)
    u = corners[:, 0] / corners[:, 2] * (1 - 0.3 * r2 + 0.1 * r2**2) * 125 + 80
    np.testing.assert_allclose(cube.box3d_pixels[[0, 1, 4, 5], 0], u)
    assert np.abs(np.array(cube.box2d) - cube.box2d_projected).max() <= 1
    assert (cube.visibility, cube.truncation) == (1, 0)


def test_wrong_numbers_of_models_are_refused():
    objects, camera, geometry, visibility, _ = scene([UNIT], [at()])
    with pytest.raises(ValueError, match="shot s: expected 1 objects"):
        annotated(context_of(still_shot((), key="s"), 0, camera, geometry, visibility, [objects[0].box3d_object], ["m"]))


def test_a_record_gives_back_every_bit():
    tilted = Viewpoint(index=3, azimuth_deg=0.1, elevation_deg=1 / 3, distance=4, tilt_deg=7, target=(0, 0, 0.1))
    lens = LENS.model_copy(update={"distortion": lens_parameters("fisheye", coefficients=(0.1, 0, 0, 0))})
    motions = [at(turn=0.3), at(y=-9), at(x=3)]
    objects, camera, _, visibility, pose = scene([UNIT] * 3, motions, tilted, lens)
    channels = {"instances": visibility.triangle}
    sample = Sample(5, "train", camera, pose, objects, channels, {"instances": "a/b.png"})
    text = json.dumps(whole_sample(sample), allow_nan=False)
    back = from_whole_sample(json.loads(text), channels=channels, files=sample.files)
    assert (back.index, back.split, back.pose, back.files) == (5, "train", pose, sample.files)
    assert back.camera.intrinsics == lens
    np.testing.assert_array_equal(back.camera.P, camera.P)
    np.testing.assert_array_equal(back.instances, visibility.triangle)
    assert len(back.objects) == 3
    for a, b in zip(objects, back.objects, strict=True):
        for name in (field.name for field in fields(ObjectAnnotation)):
            value, other = getattr(a, name), getattr(b, name)
            assert isinstance(value, type(other)), name
            if isinstance(value, np.ndarray):
                assert other.dtype == value.dtype
                np.testing.assert_array_equal(other, value, err_msg=name)
            else:
                assert other == value, name
    assert json.dumps(whole_sample(back)) == json.dumps(json.loads(text))


def test_an_object_that_fills_the_whole_field_of_a_lens():
    narrow = LENS.model_copy(update={"distortion": lens_parameters("brown_conrady", coefficients=(-50, 0, 0, 0))})
    pose = Viewpoint(index=0, azimuth_deg=0, elevation_deg=0, distance=1.5)
    (cube,), *_ = scene([UNIT], [at()], pose, narrow)  # no edge of it is where the lens sees
    assert cube.area > 100
    assert (cube.visibility, cube.truncation) == (1, 0)


def test_the_regular_labels_are_those_that_are_not_on_request():
    """Frames import these by name; a label that this list lacked would be missing in all data sets."""
    assert {label.name for label in object_labels() if not label.on_request} == regular()
    assert labels_of(("amodal",)) == tuple(label for label in object_labels() if not label.on_request or label.name == "amodal")


def test_a_label_is_imported_when_it_is_read():
    code = """
import sys
from viewsphere import labels
labels.labels_of(("amodal",)), labels.channels()["depth"], labels.makers()["visibility"]
print(*(name for name in ("amodal", "depth", "visibility", "flow", "captions") if f"viewsphere.labels.{name}" in sys.modules))
"""
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert ran.stdout.split() == ["amodal", "depth", "visibility"], ran.stderr
