"""What moves is written in place, and equals what is built of the same things at that instant, to the bit."""

import dataclasses

import numpy as np
import pytest

from shots import AHEAD, still_shot
from truth_scenes import cube, lens, mesh_of, orbit_camera, random_soup, sphere
from viewsphere.geometry.rotation import matrix_from_quaternion
from viewsphere.labels import observe
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Floor, Ground, Scene
from viewsphere.model.thing import Motion, Thing
from viewsphere.truth.moving import ROOMS, Ring, shot_floor
from viewsphere.truth.raster.geometry import Geometry, build_geometry, present
from viewsphere.truth.raster.visibility import rasterize

UNLIKE = ("alpha_masks", "meshes", "labels", "facing", "spare")
HELD = [field.name for field in dataclasses.fields(Geometry) if field.name not in UNLIKE]
OF_LABELS = [f"triangle_{name}" for name in ("part", "category", "class", "material", "body_part")]
ARRAYS = [*HELD, *OF_LABELS, "vertices", "normals", "triangle_normals", "triangle_side", "triangle_tops"]


def pose(rng):
    """Any turn, and a place that is far away at times."""
    turned = np.eye(4)
    q = rng.normal(size=4)
    turned[:3, :3] = matrix_from_quaternion(q / np.linalg.norm(q))
    turned[:3, 3] = rng.normal(size=3) * 10 ** rng.uniform(-1, 4)
    return tuple(map(tuple, turned.tolist()))


def thing(number, where, scenery=False):
    spec = ModelSpec(key=f"m{number}", source=f"m{number}", category="thing", category_id=0 if scenery else number + 3)
    return Thing(id=0 if scenery else number + 1, model=spec, motion=Motion(poses=(where,)), scenery=scenery)


def deformed(mesh, rng):
    return dataclasses.replace(
        mesh,
        vertices=mesh.vertices + rng.normal(size=mesh.vertices.shape).astype(np.float32) / 10,
        normals=mesh.normals[::-1].copy(),
        triangles=mesh.triangles.copy(),
    )


def same(geometry, things, meshes, ground, floor):
    built = build_geometry(things, present(things, meshes), ground, 0.3, floor)
    for name in ARRAYS:
        own, other = getattr(geometry, name), getattr(built, name)
        if isinstance(own, np.ndarray):
            assert own.dtype == other.dtype and own.tobytes() == other.tobytes(), name
        else:
            assert own == other, name
    for own, other in zip(geometry.alpha_masks.arrays, built.alpha_masks.arrays, strict=True):
        assert np.array_equal(own, other)


@pytest.mark.parametrize("seed", range(12))
def test_what_moved_is_what_is_built_there(seed):
    """Random walks of five things: some stand, turn, deform, go and come back; one changes its triangles."""
    rng = np.random.default_rng(seed)
    ground = seed % 3 > 0
    floor = Floor(height=-2.0) if seed % 3 == 2 else None
    shapes = [random_soup(rng, 60), sphere(2, 0.8), cube(0.7), mesh_of(np.zeros((0, 3)), []), cube(0.2)]
    others = [cube(0.1), sphere(2, 0.4), cube(0.3), shapes[3], random_soup(rng, 5)]
    poses, meshes, ring = [pose(rng) for _ in shapes], list(shapes), Ring(ground, 0.3)
    for _ in range(14):
        for i in rng.permutation(5)[: rng.integers(0, 4)].tolist():
            what = rng.uniform()
            poses[i] = None if what < 0.12 else pose(rng) if what < 0.8 else poses[i]
            meshes[i] = others[i] if 0.8 < what < 0.84 else deformed(meshes[i], rng) if what > 0.85 else meshes[i]
        things = [thing(i, where, scenery=i == 4) for i, where in enumerate(poses)]
        same(ring.geometry_at(things, list(meshes), floor), things, meshes, ground, floor)


def walk(count, standing=pose(np.random.default_rng(5))):
    rng = np.random.default_rng(3)
    return [[thing(0, pose(rng)), thing(1, standing)] for _ in range(count)]


MESHES = [sphere(2, 0.8), cube(0.5)]
DEEP = Floor(height=-50000.0)


def test_as_many_instants_as_there_are_rooms_live_at_once_and_share_what_stays():
    ring, steps = Ring(True, 0.3), walk(ROOMS + 4)
    for first in range(len(steps) - ROOMS + 1):
        now = [ring.geometry_at(things, MESHES) for things in steps[first : first + ROOMS]]
        for geometry, things in zip(now, steps[first:], strict=False):
            same(geometry, things, MESHES, True, None)
        for name in HELD:
            own = [getattr(geometry, name) for geometry in now]
            if isinstance(own[0], np.ndarray) and own[0].size:
                shared = all(np.shares_memory(own[0], each) for each in own[1:])
                assert shared == (name not in ("poses", "bounds", "ground")), name


def test_what_deforms_leaves_the_instants_around_it_as_they_are():
    ring, rng, now = Ring(True, 0.3), np.random.default_rng(8), []
    for number, things in enumerate(walk(12)):
        meshes = [deformed(MESHES[0], rng), MESHES[1]] if number in (3, 6, 7, 9) else MESHES
        now = [*now, (ring.geometry_at(things, meshes), things, meshes)][-ROOMS:]
        for geometry, own, shown in now:
            same(geometry, own, shown, True, None)


@pytest.mark.parametrize("seed", range(4))
def test_normals_of_some_things_leave_those_of_others_for_later(seed):
    """Asked for in any order at any instant, of some things or of all: whoever is asked for is as it is then."""
    rng, ring = np.random.default_rng(seed), Ring(True, 0.3)
    late = 0
    for things in [[thing(i, pose(rng)) for i in range(3)] for _ in range(12)]:
        meshes = [*MESHES, cube(0.3)]
        geometry, built = ring.geometry_at(things, meshes), build_geometry(things, meshes, True, 0.3)
        asked = rng.permutation(3)[: rng.integers(0, 3)].tolist()
        for some in ([], asked):
            found, start = geometry.triangle_normals_of(some), geometry.triangle_start
            assert len(found) == len(built.triangle_normals)
            for i in some:
                assert np.array_equal(found[start[i] : start[i + 1]], built.triangle_normals[start[i] : start[i + 1]])
            assert np.array_equal(found[start[-1] :], built.triangle_normals[start[-1] :])
        late += not np.array_equal(geometry.triangle_normals_of(asked), built.triangle_normals)
        if rng.uniform() < 0.5:
            same(geometry, things, meshes, True, None)
    assert late > 3


def test_what_is_asked_for_again_is_the_same_object_and_what_moved_is_not():
    ring, (a, b, *_) = Ring(True, 0.3), walk(3)
    first, second = ring.geometry_at(a, MESHES), ring.geometry_at(b, MESHES)
    assert ring.geometry_at(list(a), list(MESHES)) is first and ring.geometry_at(b, MESHES) is second and first is not second
    assert ring.geometry_at(a, MESHES, DEEP) is not first
    assert ring.geometry_at(a, MESHES, DEEP).ground_z == -50000.0 and first.ground_z > -50000.0


def test_labels_of_what_moved_are_those_of_what_is_built_there():
    """A visibility that was counted for one instant says nothing of another's, though rooms are used again."""
    names = ["instances", "depth", "normals", "normals_geometric", "coordinates", "triangles"]
    rng, ring = np.random.default_rng(0), Ring(True, 0.3)
    for _ in range(3 * ROOMS):
        near = np.array(pose(rng))
        near[:3, 3] = rng.uniform(-0.8, 0.8, 3)
        things = [
            thing(0, tuple(map(tuple, near.tolist()))),
            thing(1, ((1, 0, 0, 0.3), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))),
        ]
        camera = orbit_camera(lens(48, 36), rng.uniform(-1, 1), rng.uniform(0.4, 1), 4.0)
        geometry, built = ring.geometry_at(things, MESHES), build_geometry(things, MESHES, True, 0.3)
        own, other = (observe(g, camera, rasterize(g, camera), names) for g in (geometry, built))
        assert len(np.unique(own["instances"])) > 1
        assert all(np.array_equal(own[name], other[name], equal_nan=True) for name in names)


def lifted(*heights, turn=0.0):
    c, s = np.cos(turn), np.sin(turn)
    return tuple(h if h is None else ((1, 0, 0, h), (0, c, -s, 0), (0, s, c, h), (0, 0, 0, 1)) for h in heights)


def moving(*poses, floor=None, ground=True):
    things = [
        Thing(id=i + 1, model=ModelSpec(key=str(i), source="m", category="c", category_id=1), motion=Motion(poses=own))
        for i, own in enumerate(poses)
    ]
    return still_shot(things, viewpoints=[AHEAD] * 3, scene=Scene(ground=Ground() if ground else None, floor=floor))


def laid(shot, meshes):
    return shot_floor(shot, lambda _: meshes)


def floor_of(shot, meshes):
    floor = laid(shot, meshes)
    return floor and floor.height


def test_the_ground_is_as_high_as_at_the_lowest_instant():
    shot = moving(lifted(2, -1, 3, turn=0.3), lifted(0))
    assert floor_of(shot, [cube(0.5), cube(9.0)]) == -1 - (np.float64(0.5) * np.sin(0.3) + 0.5 * np.cos(0.3))
    grounds = {
        Ring(True, 0.3).geometry_at(shot.things_at(i), [cube(0.5), cube(0.5)], laid(shot, [cube(0.5), cube(0.5)])).ground_z
        for i in range(3)
    }
    assert grounds == {floor_of(shot, [cube(0.5)] * 2)}


def test_a_scene_says_that_its_ground_is_lower():
    assert floor_of(moving(lifted(2, -1, 3), floor=-4.0), [cube()]) == -4.0
    assert floor_of(moving(lifted(2, -1, 3), floor=4.0), [cube()]) == -1.5


def test_a_fixed_ground_stays_where_it_is():
    fixed = Floor(height=0.25, is_fixed=True)
    shot = moving(lifted(2, -1, 3), floor=fixed)
    assert laid(shot, [cube()]) == fixed
    ring = Ring(True, 0.3)
    assert [ring.geometry_at(shot.things_at(i), [cube()], fixed).ground_z for i in range(3)] == [0.25] * 3


def test_what_is_not_there_or_stands_still_lays_no_ground():
    assert floor_of(moving(lifted(2, None, 3)), [cube()]) == 1.5
    assert floor_of(moving(lifted(2)), [cube()]) is None
    assert floor_of(moving(lifted(2), floor=1.0), [cube()]) == 1.0
    assert floor_of(moving(lifted(2, 0, 3), ground=False), [cube()]) is None
    assert floor_of(moving((None, None, None)), [cube()]) is None


def test_no_point_of_what_turns_is_below():
    rng = np.random.default_rng(2)
    for _ in range(20):
        poses = tuple(pose(rng) for _ in range(3))
        meshes = [random_soup(rng, 30)]
        world = [Ring(False, 0.3).geometry_at(moving(poses).things_at(i), meshes).extent()[0][2] for i in range(3)]
        assert floor_of(moving(poses), meshes) == min(world)
