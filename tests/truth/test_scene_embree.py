"""A whole scene, targets, labelled pieces, scenery and ground, against Embree: ids, depth, masks, boxes, visible shares."""

import math

import numpy as np
import pytest
from test_embree import turned

from quick import quick
from ray_proofs import compare, embree, trace
from shots import still_shot
from truth_scenes import LENSES, cube, lens, mesh_of, orbit_camera, placed, sphere
from viewsphere.geometry.box3d import Box3d
from viewsphere.labels import annotated, context_of, observe
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.thing import Motion, Thing
from viewsphere.truth.raster.geometry import build_geometry
from viewsphere.truth.raster.visibility import rasterize

pytest.importorskip("embreex")


def street():
    """A road of many squares, a kerb's step beside it."""
    x, y = np.meshgrid(np.linspace(-3, 3, 7), np.linspace(-40, 40, 41), indexing="ij")
    points = np.stack([x, y, np.where(np.abs(x) > 2.5, 0.12, 0.0)], axis=-1).reshape(-1, 3)
    i = np.arange(6 * 40)
    a = i // 40 * 41 + i % 40
    return mesh_of(points, np.concatenate([np.stack([a, a + 41, a + 42], 1), np.stack([a, a + 42, a + 1], 1)]))


def post():
    import trimesh

    rod = trimesh.creation.cylinder(0.06, 5, sections=12)
    return mesh_of(rod.vertices + np.array([0, 0, 2.5]), rod.faces)


def scene():
    """Two targets and a post of its own on a street, with two more posts and a house that are background."""
    parts = [
        (cube(0.5), turned(0.4, 0, 0, 0.5)),
        (sphere(4, 0.6), turned(0, 1.3, 0.5, 0.6)),
        (post(), turned(0, -0.9, -0.3)),
        (street(), np.eye(4)),
        (post(), turned(0, 0.4, -1.6)),
        (post(), turned(0, 2.4, 4.0)),
        (cube(3.0), turned(0.2, -8, 2, 2.95)),  # its foot in the ground, below the road
    ]
    things = tuple(
        Thing(
            id=i + 1 if i < 3 else 0,
            model=ModelSpec(key=f"m{i}", source="m", category="thing", category_id=i + 1 if i < 3 else 0),
            motion=Motion.still(tuple(map(tuple, np.asarray(m, float).tolist()))),
            scenery=i >= 2,
        )
        for i, (_, m) in enumerate(parts)
    )
    meshes = [m for m, _ in parts]
    return things, meshes, build_geometry(things, meshes, True, 0.01)


def cameras(lens_name, count, width=320, height=240):
    distortion = LENSES[lens_name]
    fov = math.radians(170 if lens_name == "fisheye" else 55)
    intrinsics = lens(width, height, fov, distortion)
    rng = np.random.default_rng(11)
    return [
        orbit_camera(
            intrinsics, rng.uniform(0, 2 * np.pi), rng.uniform(0.05, 0.9), rng.uniform(2.5, 7), (0.4, 0.1, 0.5),
            rng.uniform(-0.3, 0.3),
        )
        for _ in range(count)
    ]  # fmt: skip


@pytest.mark.parametrize("name", quick(LENSES, "pinhole", "fisheye"))
def test_ids_and_depth_of_a_whole_scene(name):
    *_, geometry = scene()
    views = cameras(name, 6 if name == "pinhole" else 2)
    toss_ups, overruled, errors = compare(geometry, views)
    pixels = len(views) * 320 * 240
    assert toss_ups < 3e-4 * pixels and overruled < 2e-5 * pixels
    assert np.quantile(errors, 0.999) <= 1e-4
    for camera in views:
        seen = rasterize(geometry, camera)
        observed = observe(geometry, camera, seen, ("instances", "categories", "parts", "triangles", "coordinates", "depth"))
        background = observed["instances"] == 0
        assert (observed["categories"][background] == 0).all() and (observed["parts"][background] == 0).all()
        assert (observed["triangles"][background] == -1).all() and np.isnan(observed["coordinates"][background]).all()
        assert np.isfinite(observed["depth"][seen.triangle >= 0]).all()


def alone(geometry, camera, object_id):
    """Pixels that Embree finds of one object without the others, on three times the image's width and height."""
    from dataclasses import replace

    i = camera.intrinsics
    wide = i.model_copy(update={"width": 3 * i.width, "height": 3 * i.height, "cx": i.cx + i.width, "cy": i.cy + i.height})
    first, last = geometry.triangle_start[object_id - 1 : object_id + 1]
    only = replace(geometry, triangles=geometry.triangles[first:last])
    hit = trace(embree(only), Camera(wide, camera.R, camera.t))[0] >= 0
    return hit, hit[i.height : 2 * i.height, i.width : 2 * i.width]


@pytest.mark.slow
def test_masks_boxes_and_visible_shares_of_a_whole_scene():
    things, meshes, geometry = scene()
    whole = embree(geometry)
    hidden, cut, clear = 0, 0, 0
    for camera in cameras("pinhole", 8, 200, 150):
        shot = still_shot(things, camera.intrinsics)
        boxes = [Box3d.between(*m.bounds).corners for m in meshes[:3]]
        found = annotated(context_of(shot, 0, camera, geometry, rasterize(geometry, camera), boxes, ["m"] * 3))
        assert [o.id for o in found] == [1, 2, 3]
        triangle, _ = trace(whole, camera)
        ids = np.where(triangle >= 0, geometry.triangle_object[triangle], 0)
        for o in found:
            mask = ids == o.id
            assert (o.mask != mask).sum() <= 2  # a ray along an edge
            total, inside = (int(h.sum()) for h in alone(geometry, camera, o.id))
            if not total:
                assert o.visibility == 0 and o.area == 0
                continue
            slack = 4 / total
            assert o.visibility == pytest.approx(mask.sum() / total, abs=slack)
            assert o.truncation == pytest.approx((total - inside) / total, abs=slack)
            hidden += o.visibility + o.truncation < 1 - slack
            cut += o.truncation > slack
            clear += o.visibility > 1 - slack
            if mask.any():
                rows, columns = np.nonzero(mask)
                tight = columns.min(), rows.min(), columns.max() + 1, rows.max() + 1
                assert o.box2d == pytest.approx(tight, abs=1)
    assert hidden > 3 and cut > 1 and clear > 1  # all of them were met


def test_scenery_hides_and_is_not_labelled():
    """A wall of scenery in front of half a cube: half of it is seen, and the wall is nobody's."""
    wall = mesh_of([[-9, 0, -9], [0, 0, -9], [0, 0, 9], [-9, 0, 9]], [[0, 1, 2], [0, 2, 3]])
    move = np.eye(4)
    move[1, 3] = -1
    geometry = placed(cube(), wall, moves=[np.eye(4), move], scenery=1)
    camera = orbit_camera(lens(64, 48), 0.0, 0.0, 5.0)
    spec = ModelSpec(key="m", source="m", category="thing", category_id=1)
    things = (Thing(id=1, model=spec), Thing(id=0, model=spec, scenery=True))
    shot = still_shot(things, camera.intrinsics)
    boxes = [Box3d.between(*cube().bounds).corners]
    (o,) = annotated(context_of(shot, 0, camera, geometry, rasterize(geometry, camera), boxes, ["m"]))
    assert (o.visibility, o.truncation) == (0.5, 0.0)
    assert o.box2d is not None and o.box2d[0] == 32
    assert o.box2d_projected[0] < 27
