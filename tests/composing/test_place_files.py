"""What a place's file says of itself: floor, lanes, surfaces, and whether it is a room."""

import json
import re

import numpy as np
import pytest

from place_files import RAMP, YARD, write_marked, write_place
from scratch import scratch_cache
from viewsphere.assets.cache import load
from viewsphere.assets.normalise import rotation
from viewsphere.composing.scene.scenery import free_floor, is_indoors, place_lanes, place_pieces, place_surfaces
from viewsphere.errors import RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.rotation import random_rotation, rigid, transform
from viewsphere.planning.plan import plan
from viewsphere.recipe.recipe import Recipe

UPS = [a + b for a in "+-" for b in "xyz"]


@pytest.fixture(autouse=True)
def read_here(monkeypatch, tmp_path):
    monkeypatch.setenv("VIEWSPHERE_READ_HERE", "1")
    scratch_cache(monkeypatch, tmp_path / "cache")


def box_of(spec, step=None):
    return Box3d.between((-0.2, -0.3, 0.0), (0.2, 0.3, 0.4)).corners


def recipe(source, place=None, **fields):
    defaults = {"models": [{"source": "zoo:car"}], "viewpoints": {"distance": 12}, "splits": {"by": "frame"}, "formats": []}
    return Recipe(**{**defaults, "scene": {"place": {"source": str(source), **(place or {})}}, **fields})


def offered(made):
    place = made.scene.place
    return free_floor(made, place, ()), place_lanes(made, place, ()), place_surfaces(made, place, ())


def mistake(made, of=offered):
    with pytest.raises(RecipeError) as caught:
        of(made)
    text = str(caught.value)
    assert "\n" not in text
    return text


def test_a_file_says_where_its_floor_its_lanes_and_its_surfaces_are(tmp_path):
    made = recipe(write_marked(tmp_path / "yard.gltf"))
    floor, lanes, surfaces = offered(made)
    np.testing.assert_allclose(np.sort(np.abs(floor.corners).ravel()), [3] * 8, atol=1e-5)
    assert [(lane.name, lane.width, lane.closed) for lane in lanes] == [("loop", 2.5, True), ("north", 3.0, False)]
    np.testing.assert_allclose(lanes[0].points, [(-9, -9, 0), (9, -9, 0), (9, 9, 0)], atol=1e-5)
    np.testing.assert_allclose(lanes[1].points, RAMP, atol=1e-5)
    (table,) = surfaces
    assert table.name == "table" and table.clearance is None
    np.testing.assert_allclose(table.size, (1.2, 0.8), atol=1e-5)
    frame = np.array(table.world_from_surface)
    np.testing.assert_allclose(frame[:3, 3], (1.5, 1.2, 0.75), atol=1e-5)
    assert np.degrees(np.arctan2(frame[1, 0], frame[0, 0])) == pytest.approx(20, abs=1e-3)
    assert not is_indoors(made, made.scene.place)


@pytest.mark.parametrize("seed", range(6))
def test_they_lie_on_the_mesh_however_the_file_is_put(tmp_path, seed):
    rng = np.random.default_rng(seed)
    up = UPS[rng.integers(6)]
    forward = [axis for axis in UPS if axis[1] != up[1]][rng.integers(4)]
    unit, turn, origin = 10 ** rng.uniform(-3, 1), rng.uniform(-180, 180), [*rng.uniform(-2.5, 2.5, 2), -0.03]
    file_from_place = rigid(rotation(up, forward, "").T / unit, (0, 0, 0))

    def node_pose(name):
        return rigid(random_rotation(rng) * rng.uniform(0.5, 2), rng.uniform(-1, 1, 3) / unit)

    file = write_marked(tmp_path / "yard.gltf", YARD, file_from_place, node_pose)
    made = recipe(file, {"up": up, "forward": forward, "unit": unit, "turn": turn, "origin": origin})
    (piece,) = place_pieces(made, made.scene.place, (), lambda category, labels: 0)
    mesh = load(piece.model)[0]

    def part(name):
        used = np.unique(mesh.triangles[mesh.triangle_part == mesh.parts.index(name)])
        return transform(piece.world_from_piece, mesh.vertices[used].astype(float))

    floor, lanes, (table,) = offered(made)
    assert mesh.parts == ("Floor", "Surface.Table", "road")
    road = part("road")
    for point in lanes[1].points:
        assert np.linalg.norm(road - point, axis=1).min() < 1e-4
    ahead = lanes[1].points[-1] - np.array(lanes[1].points[0])
    assert ahead[2] == pytest.approx(1.0, abs=1e-4)
    x, y = table.size
    corners = transform(table.world_from_surface, [(sx * x / 2, sy * y / 2, 0) for sx in (-1, 1) for sy in (-1, 1)])
    own = part("Surface.Table")
    for corner in corners:
        assert np.linalg.norm(own - corner, axis=1).min() < 1e-4
    assert corners[:, 2].max() == pytest.approx(own[:, 2].max(), abs=1e-5)
    for corner in floor.corners:
        assert np.linalg.norm(part("Floor")[:, :2] - corner, axis=1).min() < 1e-4


def test_custom_properties_say_it_too_and_numbers_of_blender_are_no_names(tmp_path):
    table = {"block": ((-0.5, -0.4, 0.6), (0.5, 0.4, 0.7))}
    objects = [
        {"name": "Ground", "block": ((-5, -5, -0.1), (5, 5, 0)), "extras": {"viewsphere": "floor"}},
        {"name": "Floor_lamp", "block": ((2, 2, 0), (2.3, 2.3, 1.8))},
        {"name": "surface.002", **table},
        {"name": "Surface_Table.001", **table, "at": (2, 2)},
        {"name": "surface_table", **table, "at": (-2, 2)},
        {"name": "Desk", **table, "at": (-2, -2), "extras": {"viewsphere": "Surface"}},
        {"name": "surfaces", **table, "at": (2, -2)},
        {"name": "Way", "line": RAMP, "edges": [(2, 3), (1, 2), (0, 1)], "extras": {"viewsphere": "lane", "width": 4}},
        {"name": "lane_paint", "faces": RAMP},
        {"name": "Walls", "extras": {"viewsphere": "indoors"}},
    ]
    made = recipe(write_marked(tmp_path / "yard.gltf", objects))
    floor, lanes, surfaces = offered(made)
    assert floor.half == pytest.approx([5, 5], abs=1e-5)
    assert [one.name for one in surfaces] == ["desk", "surface", "table", "table_2"]
    assert [one.name for one in lanes] == ["way"] and lanes[0].width == 4
    np.testing.assert_allclose(lanes[0].points, RAMP, atol=1e-5)
    assert is_indoors(made, made.scene.place)


def test_the_square_within_a_round_table_is_what_things_stand_on(tmp_path):
    around = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    objects = [
        {"name": "surface_round", "faces": [(0.5 * np.cos(a), 0.5 * np.sin(a), 0.7) for a in around]},
        {"name": "surface_trapeze", "faces": [(-1, -0.5, 0.7), (1, -0.5, 0.7), (0.5, 0.5, 0.7), (-0.5, 0.5, 0.7)]},
    ]
    _, _, (square, trapeze) = offered(recipe(write_marked(tmp_path / "yard.gltf", objects)))
    np.testing.assert_allclose(square.size, [np.sqrt(0.5)] * 2, rtol=0.005)
    assert np.hypot(*square.size) <= 1 + 1e-6
    np.testing.assert_allclose(trapeze.size, (1.2, 0.6), atol=1e-5)  # its corners meet the slanting sides


def test_names_of_an_obj_s_objects_count(tmp_path):
    corners = [
        (-2, 0, 2),
        (2, 0, 2),
        (2, 0, -2),
        (-2, 0, -2),
        (-0.5, 0.7, 0.3),
        (0.5, 0.7, 0.3),
        (0.5, 0.7, -0.3),
        (-0.5, 0.7, -0.3),
    ]
    lines = [f"v {x} {y} {z}" for x, y, z in corners]
    (tmp_path / "yard.obj").write_text("\n".join([*lines, "o floor", "f 1 2 3 4", "o surface_bench", "f 5 6 7 8"]))
    floor, lanes, (bench,) = offered(recipe(tmp_path / "yard.obj"))
    assert floor.half == pytest.approx([2, 2]) and lanes == ()
    assert (bench.name, bench.size) == ("bench", pytest.approx((1, 0.6))) and bench.world_from_surface[2][3] == pytest.approx(
        0.7
    )


def test_a_file_that_says_nothing_has_endless_floor(tmp_path):
    made = recipe(write_place(tmp_path / "yard.glb"))
    assert offered(made) == (None, (), ()) and not is_indoors(made, made.scene.place)


@pytest.mark.parametrize(
    ("one", "said"),
    [
        (
            {"name": "lane_a", "line": RAMP[:1]},
            "'lane_a': expected two points at least, of a line or of empties below it; found 1",
        ),
        ({"name": "lane_a", "children": {"p": (0, 0, 0)}}, "'lane_a': expected two points at least.*; found 1"),
        ({"name": "lane_a", "extras": {"viewsphere": "lane"}}, "'lane_a': expected two points at least.*; found 0"),
        (
            {"name": "lane_a", "line": RAMP, "edges": [(0, 1), (1, 2), (1, 3)]},
            "'lane_a': expected one line; found one that branches",
        ),
        ({"name": "lane_a", "line": RAMP, "edges": [(0, 1), (2, 3)]}, "'lane_a': expected one line; found several"),
        ({"name": "lane_a", "line": RAMP, "extras": {"width": -1}}, "'lane_a': expected its width as metres above 0; found -1"),
        (
            {"name": "r", "strip": RAMP, "extras": {"viewsphere": "lane"}},
            "'r': expected a line, or empties below it; found faces",
        ),
        (
            {"name": "r", "extras": {"viewsphere": "lanes"}},
            "'r': expected one of floor, lane, surface, indoors as .*; found 'lanes'",
        ),
        ({"name": "r", "extras": {"viewsphere": "surface"}}, "'r': expected a mesh of faces; found none"),
        (
            {"name": "surface_a", "faces": [(0, 0, 0), (1, 0, 0), (1, 1, 0.1), (0, 1, 0.1)]},
            r"'surface_a': expected a level mesh; found heights of 0 to 0\.1 m: make it level, or call it another name",
        ),
    ],
)
def test_mistakes_are_one_line(tmp_path, one, said):
    made = recipe(write_marked(tmp_path / "yard.gltf", [YARD[2], one]))
    text = mistake(made)
    assert text.startswith("scene.place: yard.gltf: ")
    assert re.search(said, text), text


def test_models_stand_on_the_floor(tmp_path):
    file = write_marked(tmp_path / "yard.gltf", [{"name": "floor", "block": ((4, 4, 0.2), (8, 6, 0.4))}])
    said = "scene.place.origin: expected a point on 'floor', the floor of yard.gltf, such as [6.0, 5.0, 0.4]; found "
    assert mistake(recipe(file)).startswith(said + "[0.0, 0.0, 0.0]: set origin")
    assert mistake(recipe(file, {"origin": [6, 5, 0]})).startswith(said)
    (floor, _, _) = offered(recipe(file, {"origin": [6, 5, 0.4], "turn": 90}))
    assert np.abs(floor.corners).max(axis=0) == pytest.approx([1, 2], abs=1e-5)


def test_a_changed_file_is_read_anew(tmp_path):
    file = tmp_path / "yard.gltf"
    assert [one.name for one in offered(recipe(write_marked(file)))[1]] == ["loop", "north"]
    document = json.loads(file.read_text())
    document["nodes"][3]["name"] = "lane_northwest"
    file.write_text(json.dumps(document))
    assert [one.name for one in offered(recipe(file))[1]] == ["loop", "northwest"]


def test_things_stand_on_a_surface_of_a_file(tmp_path):
    made = recipe(
        write_marked(tmp_path / "yard.gltf"),
        {"turn": 40, "origin": [-1, 1, 0]},
        models=[{"source": "zoo:car", "count": 2}],
        scenes={"count": 3, "objects": 1, "surface": "table"},
    )
    ((table,), shots) = place_surfaces(made, made.scene.place, ()), list(plan(made).shots(box_of))
    for shot in shots:
        own = np.array(shot.things[0].world_from_object)
        at = np.linalg.inv(np.array(table.world_from_surface)) @ own[:, 3]
        assert abs(at[0]) <= table.size[0] / 2 and abs(at[1]) <= table.size[1] / 2 and at[2] == pytest.approx(0, abs=1e-6)


def test_names_that_there_are_not(tmp_path):
    file = write_marked(tmp_path / "yard.gltf")
    scenes = {"count": 1, "objects": 1, "surface": "tabel"}
    assert mistake(recipe(file, scenes=scenes), plan) == (
        "scenes.surface: 'tabel' is unknown; did you mean 'table'? Valid: table"
    )
    time, drive = {"frames": 3}, {"kind": "drive", "lane": "nort"}
    assert mistake(recipe(file, time=time, viewpoints=drive), plan) == (
        "viewpoints.lane: 'nort' is unknown; did you mean 'north'? Valid: loop, north"
    )


def test_a_camera_and_a_car_go_along_a_lane_of_a_file(tmp_path):
    car = {"source": "zoo:car", "motion": {"kind": "path", "lane": "north", "speed": 10, "offset": 10}}
    drive = {"kind": "drive", "lane": "north", "speed": 10, "height": 1.5}
    made = recipe(
        write_marked(tmp_path / "yard.gltf"), {"turn": 90}, models=[car], time={"frames": 2, "fps": 1}, viewpoints=drive
    )
    shot = plan(made).shot(0, box_of)
    first, last = (np.array(instant.world_from_rig)[:3, 3] for instant in shot.instants)
    np.testing.assert_allclose(first, (30, -8, 1.5), atol=1e-4)
    assert last == pytest.approx((20, -8, 1.5), abs=0.2)
    np.testing.assert_allclose(np.array(shot.things[0].motion.poses[0])[:3, 3], (20, -8, 0), atol=0.2)
