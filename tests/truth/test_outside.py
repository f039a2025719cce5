"""Things outside of the picture are left out, and nothing else is: what is seen is what is seen when all are drawn."""

import numpy as np
import pytest

from truth_scenes import cube, orbit_camera, sphere
from viewsphere.geometry.box import overlap
from viewsphere.labels import LabelContext
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.thing import Motion, Thing
from viewsphere.truth.raster.geometry import build_geometry
from viewsphere.truth.raster.visibility import OUTSIDE, homogeneous, in_picture, rasterize

LENS = Intrinsics(width=64, height=48, fx=50.0, fy=50.0, cx=32.0, cy=24.0)
MESHES = [sphere(1, 0.8), cube(0.5)]


def scattered(rng, count=60):
    """A crowd around the camera: things ahead, beside, behind, and around its centre."""
    things = []
    for i in range(count):
        pose = np.eye(4)
        pose[:3, 3] = rng.normal(size=3) * (4, 4, 2)
        spec = ModelSpec(key=f"m{i}", source=f"m{i}", category="thing", category_id=1)
        things.append(Thing(id=i + 1, model=spec, motion=Motion(poses=(tuple(map(tuple, pose.tolist())),))))
    return build_geometry(things, [MESHES[i % 2] for i in range(count)], True, 0.3)


@pytest.mark.parametrize("seed", range(8))
def test_what_is_seen_is_what_is_seen_when_all_are_drawn(seed):
    rng = np.random.default_rng(seed)
    geometry = scattered(rng)
    camera = orbit_camera(LENS, rng.uniform(0, 7), rng.uniform(-0.1, 0.7), rng.uniform(1, 7))
    own = rasterize(geometry, camera)
    whole = rasterize(geometry, camera, window=(0, 0, camera.width, camera.height))
    assert own.triangle.tobytes() == whole.triangle.tobytes() and own.inverse_depth.tobytes() == whole.inverse_depth.tobytes()
    corners, everywhere = homogeneous(geometry, camera), homogeneous(geometry, camera, 0, len(geometry.vertices))
    vertices, triangles = in_picture(geometry, corners)
    assert 0 < np.diff(vertices).sum() < len(corners)
    for first, stop in vertices:
        assert np.array_equal(corners[first:stop], everywhere[first:stop])
    drawn = np.concatenate([geometry.triangles[first:stop] for first, stop in triangles])
    assert np.isin(drawn, np.concatenate([np.arange(first, stop) for first, stop in vertices])).all()


@pytest.mark.parametrize("seed", range(4))
def test_a_thing_alone_is_the_same_from_its_own_vertices_and_from_those_of_all(seed):
    rng = np.random.default_rng(seed)
    geometry = scattered(rng)
    camera = orbit_camera(LENS, rng.uniform(0, 7), rng.uniform(-0.1, 0.7), rng.uniform(1, 7))
    corners, window = homogeneous(geometry, camera), (-64, -48, 128, 96)
    assert 0 < sum((corners[start] == OUTSIDE).all() for start in geometry.vertex_start[:-1]) < geometry.object_count
    for number in range(1, geometry.object_count + 1):
        one, two = (rasterize(geometry, camera, object_id=number, window=window, corners=known) for known in (None, corners))
        assert one.triangle.tobytes() == two.triangle.tobytes()
        assert one.inverse_depth.tobytes() == two.inverse_depth.tobytes()


@pytest.mark.parametrize("seed", range(4))
def test_what_hides_nothing_is_told_by_all_pairs_of_boxes(seed):
    rng = np.random.default_rng(seed)
    geometry = scattered(rng, 40)
    camera = orbit_camera(LENS, rng.uniform(0, 7), rng.uniform(0.5, 1.3), rng.uniform(3, 12))
    context = LabelContext(geometry, camera, rasterize(geometry, camera))
    boxes = context.projected
    said = [context.is_unobstructed(i) for i in range(40)]
    for i, (own, _) in enumerate(boxes):
        others = [(box, whole) for j, (box, whole) in enumerate(boxes) if j != i and box]
        meets = own is not None and any(not whole or overlap(own, box) for box, whole in others)
        assert said[i] == (not meets and camera.center[2] > geometry.ground_z)
    assert any(said)
