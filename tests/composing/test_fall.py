"""What is dropped lies on the floor, on a table or in a box, still, and nothing in anything; mistakes are told."""

import json
from functools import partial

import numpy as np
import pytest
import trimesh

from resting import deepest, one_more_second, placed, shape_of, solids, spec
from scratch import scratch_cache
from small import small_recipe, tree_hash
from viewsphere import plugins
from viewsphere.composing.physics import Board
from viewsphere.composing.placing import Room, Shape, footprint
from viewsphere.composing.seeds import generator
from viewsphere.errors import RecipeError, StoreError
from viewsphere.geometry.box3d import Box3d
from viewsphere.model.scene import IDENTITY
from viewsphere.planning.plan import plan
from viewsphere.plugins.placer import PlacerSpec
from viewsphere.run.generate import generate
from viewsphere.store import Simulated
from viewsphere.validation.errors import read_options
from viewsphere_zoo.families.open_box import boards


def options(name, **given):
    return read_options(plugins.load(PlacerSpec, name).options, given, "scenes.layout")


def fallen(shapes, name="fall", seed=0, given=None, **room):
    keys = [spec(f"m{i}") for i in range(len(shapes))]
    rng, room = partial(generator, seed, "layout"), Room(**{"field": "scenes", **room})
    return plugins.load(PlacerSpec, name).place(keys, room, shapes, (), rng, options(name, **(given or {})))


def rectangle(width, length):
    return footprint(Box3d.between((-width / 2, -length / 2, 0.0), (width / 2, length / 2, 0.0)).corners, IDENTITY)


def test_things_lie_still_on_the_floor():
    shapes = solids(6)
    poses = fallen(shapes)
    hulls = placed(shapes, poses)
    assert deepest(hulls) < 0.002
    assert (
        all(abs(hull[:, 2].min()) < 0.002 for hull in hulls if hull[:, 2].min() < 0.02)
        and min(h[:, 2].min() for h in hulls) > -0.002
    )
    way, turn, sunk = one_more_second(shapes, poses)
    assert way < 0.001 and turn < 0.5 and sunk < 0.002
    assert poses == fallen(shapes) and poses != fallen(shapes, seed=1)


def test_things_lie_on_a_table_and_none_beside_it():
    shapes = solids(6, seed=1)
    poses = fallen(shapes, free=rectangle(0.8, 0.6), below=0.7)
    for hull in placed(shapes, poses):
        x, y, z = hull.mean(axis=0)
        assert abs(x) < 0.45 and abs(y) < 0.35 and 0 < z < 0.7
    board = Board((0.0, 0.0, -0.015), (0.4, 0.3, 0.015))
    way, turn, sunk = one_more_second(shapes, poses, [board], -0.7)
    assert way < 0.001 and turn < 0.5 and sunk < 0.002 and deepest(placed(shapes, poses)) < 0.002


@pytest.mark.parametrize("seed", [0, 2, 3, 4])
def test_an_open_laptop_that_is_wider_than_a_shelf_lies_on_it(seed):
    """And is not caught above the shelf by what keeps things there while they fall."""
    base = [[x, y, z] for x in (-0.2, 0.2) for y in (-0.14, 0.14) for z in (0.0, 0.02)]
    laptop = shape_of(np.array([*base, [-0.2, 0.24, 0.1], [0.2, 0.24, 0.1]]))
    (pose,) = fallen([laptop], seed=seed, free=rectangle(0.7, 0.3), below=0.7)
    assert np.abs(np.sort(placed([laptop], [pose])[0][:, 2])[:4]).max() < 0.002


@pytest.mark.slow
def test_things_lie_in_a_box():
    shapes, size = solids(8, seed=2), (0.8, 0.4, 0.6)
    poses = fallen(shapes, "container", given={"size": [0.8, 0.6, 0.4]})
    walls = [Board(at, tuple(s / 2 for s in sides)) for at, sides in boards(*size)]
    hulls = placed(shapes, poses)
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    sides = [corners * s + at for at, s in boards(*size)]
    assert max(deepest([*hulls, side]) for side in sides) < 0.002
    for hull in hulls:
        assert (np.abs(hull.mean(axis=0)[:2]) < (0.4, 0.3)).all() and hull[:, 2].min() < 0.4
    way, turn, sunk = one_more_second(shapes, poses, walls)
    assert way < 0.001 and turn < 0.5 and sunk < 0.002


def test_what_stands_there_before_is_fallen_on_and_does_not_move():
    own, *others = solids(4, seed=3, scale=0.7)
    pose = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, -float(own.box[:, 2].min())), (0, 0, 0, 1))
    poses = fallen(others, taken=((own, pose),), given={"spread": [0.3, 0.3]})
    assert deepest(placed([own, *others], [pose, *poses])) < 0.002


def test_mass_friction_and_restitution_may_be_drawn_for_each():
    shapes = solids(3)
    given = {"mass": {"uniform": [0.2, 2]}, "friction": [0.3, 0.9], "restitution": {"choice": [0.0, 0.4]}}
    poses = fallen(shapes, given=given)
    assert deepest(placed(shapes, poses)) < 0.002 and poses != fallen(shapes)


@pytest.mark.parametrize(
    ("layout", "message"),
    [
        ({"kind": "fall", "mass": -1}, r"scenes\.layout\.mass: expected a number greater than 0; found -1"),
        ({"kind": "fall", "mass": float("nan")}, r"scenes\.layout.*mass"),
        ({"kind": "fall", "restitution": 2}, r"scenes\.layout\.restitution"),
        ({"kind": "fall", "fricton": 0.5}, r"scenes\.layout.*fricton.*did you mean 'friction'"),
        ({"kind": "row", "friction": 0.5}, r"scenes\.layout: expected no options, row has none; found friction"),
        ({"kind": "fal"}, r"scenes\.layout.*'fal' is unknown; did you mean 'fall'"),
        ({"kind": "container", "size": [0.3, 0, 0.3]}, r"scenes\.layout\.size"),
    ],
)
def test_bad_options_are_told_before_anything_is_rendered(layout, message):
    with pytest.raises(RecipeError, match=message):
        plan(small_recipe(scenes={"count": 1, "objects": 2, "layout": layout}))


def test_a_surface_that_is_not_there_is_told_before_anything_is_rendered():
    scenes = {"count": 1, "objects": 2, "layout": "fall", "surface": "table"}
    with pytest.raises(RecipeError, match=r"scenes\.surface: expected a scene\.place that has surfaces, or .*found 'table'"):
        plan(small_recipe(scenes=scenes))
    with pytest.raises(RecipeError, match=r"scenes\.surface: expected a scene\.place that has surfaces"):
        plan(small_recipe(scenes=scenes, scene={"place": "zoo:neighbourhood"}))


def test_a_box_that_is_too_small_says_so():
    with pytest.raises(RecipeError, match=r"scenes\.layout: expected a box with room for m\d, which is 0\.\d+ m long"):
        fallen(solids(3), "container", given={"size": [0.1, 0.1, 0.1]})
    with pytest.raises(RecipeError, match=r"expected a box of at least 0\.\d+ cubic metres for 12 models"):
        fallen(solids(12), "container", given={"size": [0.3, 0.3, 0.3]})
    with pytest.raises(RecipeError, match=r"expected a box that fits on the 0.5 m that are free; found one of 0.8 m"):
        fallen(solids(3), "container", given={"size": [0.8, 0.4, 0.3]}, free=rectangle(0.5, 0.5), below=0.5)


def test_what_does_not_fit_on_a_table_is_told_with_the_best_that_was_found(monkeypatch):
    from viewsphere.composing.placing.shared import dropping as _dropping

    monkeypatch.setattr(_dropping, "TRIES", 1)
    monkeypatch.setattr(_dropping, "ROUNDS", 1)
    with pytest.raises(RecipeError, match=r"scenes\.layout: expected room for 5 models; found \d inside, m\d not"):
        fallen(solids(15)[2::3], free=rectangle(0.01, 0.01), below=0.7)  # not boxes and cylinders: these stand in a tower


def test_what_is_simulated_is_kept_and_the_first_counts(tmp_path):
    keep, made = Simulated(tmp_path), []
    (tmp_path / "store").mkdir()

    def make():
        made.append(1)
        return {"poses": [len(made)]}

    first = keep(("scene", "scene-000000"), make)
    assert keep(("scene", "scene-000000"), make) == first == {"poses": [1]} and len(made) == 1
    assert keep(("scene", "scene-000001"), make) == {"poses": [2]}
    (entry, *_) = sorted((tmp_path / "store" / "simulated").rglob("made.json"))
    entry.write_text("{")
    with pytest.raises(StoreError, match=r"made\.json: expected what was simulated, found .*: remove this file"):
        for name in ("scene-000000", "scene-000001"):
            keep(("scene", name), make)


@pytest.mark.slow
def test_things_fall_into_what_is_concave_where_parts_collide(tmp_path, monkeypatch):
    """Into a trough that stands there: its hull would close it."""
    scratch_cache(monkeypatch, tmp_path)
    whole = trimesh.util.concatenate(
        [trimesh.creation.box((w, n, h), trimesh.transformations.translation_matrix(at)) for at, (w, n, h) in SIDES]
    )
    points, triangles = np.array(whole.vertices), np.array(whole.faces, np.int32)
    trough = Shape(Box3d.around(points).corners, lambda: points, lambda: (points, triangles))
    small, found = solids(2, scale=0.5), []
    for collide in ("hulls", "parts"):
        poses = fallen(small, taken=((trough, IDENTITY),), given={"collide": collide, "spread": [0.3, 0.3]})
        found.append(min(hull[:, 2].min() for hull in placed(small, poses)))
    assert found[0] > 0.45 or abs(found[0]) < 0.002  # on it, or beside
    assert 0.02 < found[1] < 0.1  # in it
    assert len(list((tmp_path / "parts").glob("*.arrays"))) == 1


SIDES = [
    ((0, 0, 0.025), (0.9, 0.9, 0.05)),
    ((0.425, 0, 0.25), (0.05, 0.9, 0.5)),
    ((-0.425, 0, 0.25), (0.05, 0.9, 0.5)),
    ((0, 0.425, 0.25), (0.9, 0.05, 0.5)),
    ((0, -0.425, 0.25), (0.9, 0.05, 0.5)),
]


def falling(**changes):
    scenes = {
        "count": 2,
        "objects": 3,
        "repeat": True,
        "layout": "fall",
        "orientation": "any",
        "surface": {"size": [0.8, 0.6], "height": 0.4},
    }
    values = {"scenes": scenes, "channels": ["depth", "instances"], "formats": [], "splits": {"by": "frame"}, "shot_frames": 1}
    return small_recipe(**values, **changes)


@pytest.mark.slow
def test_all_shots_of_a_scene_take_what_was_simulated_once(tmp_path):
    """A run on another machine, whose physics ends elsewhere, goes on with what is kept."""
    recipe = falling()
    generate(recipe, tmp_path / "a")
    entries = sorted((tmp_path / "a" / "store" / "simulated").rglob("made.json"))
    assert len(entries) == 2
    whole = tree_hash(tmp_path / "a" / "store" / "shots")
    for shot in sorted((tmp_path / "a" / "store" / "shots").rglob("manifest.json"))[::2]:
        shot.unlink()
    generate(recipe, tmp_path / "a")
    assert tree_hash(tmp_path / "a" / "store" / "shots") == whole
    kept = json.loads(entries[0].read_text())
    kept["poses"][0][2][3] += 0.25
    entries[0].write_text(json.dumps(kept))
    for shot in (tmp_path / "a" / "store" / "shots").rglob("manifest.json"):
        shot.unlink()
    generate(recipe, tmp_path / "a")
    assert tree_hash(tmp_path / "a" / "store" / "shots") != whole


@pytest.mark.slow
def test_any_number_of_workers_makes_the_same_bytes(tmp_path):
    hashes = set()
    for workers in (0, 2):
        generate(falling(), tmp_path / str(workers), workers=workers)
        hashes.add(tree_hash(tmp_path / str(workers) / "store" / "shots"))
    assert len(hashes) == 1
