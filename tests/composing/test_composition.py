"""Places, company and planes in a plan: what is drawn, what it depends on, and what is refused."""

import numpy as np
import pytest

from place_files import write_picture, write_place
from viewsphere.composing.scene import scenery
from viewsphere.errors import RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.model.place import Place, PlacePiece, standing
from viewsphere.model.shot import Shot
from viewsphere.planning.distances import Distances
from viewsphere.planning.plan import check_images, plan
from viewsphere.plugins.place import PlaceSpec
from viewsphere.recipe.recipe import Recipe


def box_of(spec, step=None):
    """A box by the key alone: no mesh is needed."""
    size = 1 + sum(spec.key.encode()) % 7 / 10
    return Box3d.between((-size / 2, -size, -size / 3), (size / 2, size, size / 3)).corners


def recipe(models=6, **fields):
    defaults = {
        "models": [{"source": "zoo:car", "count": models}],
        "viewpoints": {"azimuth": [0, 90, 180], "distance": 12},
        "splits": {"by": "frame"},
        "formats": [],
    }
    return Recipe(**{**defaults, **fields})


def error(**fields):
    with pytest.raises(RecipeError) as caught:
        plan(recipe(**fields))
    return str(caught.value)


@pytest.fixture
def tiny(monkeypatch):
    """A place of three kinds of thing; how many trees, and which house, is drawn."""

    def tiny_random(rng):
        trees = [PlacePiece(f"tree{i}", "tree", i, "tree", standing(8, 3.0 * i)) for i in range(rng.integers(1, 5))]
        house = PlacePiece("house", "house", int(rng.integers(1 << 20)), "house", standing(-9, 0, 90))
        return Place((PlacePiece("street", "street", 1, "street", standing(0, 0)), house, *trees), free=(-3, -40, 3, 40))

    real = scenery.place_of
    monkeypatch.setattr(scenery, "place_of", lambda name: PlaceSpec(random=tiny_random) if name == "zoo:tiny" else real(name))
    scenery._drawn_place.cache_clear()
    yield "zoo:tiny"
    scenery._drawn_place.cache_clear()


def test_a_recipe_without_any_of_it_has_its_model_alone():
    planned = plan(recipe())
    shot = planned.shot(0, box_of)
    assert planned.composition is None and len(shot.things) == 1 and shot.instants[0].viewpoint.target is None
    assert shot.things[0].world_from_object[2][3] == 0


def test_the_target_stands_on_the_floor_and_the_place_is_background(tiny):
    planned = plan(recipe(scene={"place": tiny}))
    shot = planned.shot(0, box_of)
    own, *rest = shot.things
    np.testing.assert_allclose(np.array(own.world_from_object)[:3, 3], [0, 0, -box_of(own.model)[2, 2]])
    assert [p.id for p in rest] == [0] * len(rest) and all(p.scenery for p in rest) and not own.scenery
    assert all(p.model.category_id == 0 and p.model.centring == "as_is" for p in rest)
    assert rest[0].model.source == "zoo:street" and rest[0].model.seed == 1
    assert planned.max_objects == 1 and [c.name for c in planned.categories] == ["car"]
    assert shot.instants[0].viewpoint.target is None
    assert Shot.model_validate_json(shot.model_dump_json()) == shot
    assert len({s.things[1:] for s in planned.shots(box_of)}) == 1
    assert planned.kept_specs == planned.model_specs


def test_instances_of_one_mesh_share_a_model(tiny):
    place = {"source": tiny, "draw": "per_model"}
    trees = [
        p.model
        for shot in plan(recipe(scene={"place": place})).shots(box_of)
        for p in shot.things
        if p.model.category == "tree"
    ]
    assert len({t.key for t in trees}) == len({t.seed for t in trees}) < len(trees)


@pytest.mark.parametrize(("draw", "different"), [("fixed", 1), ("per_model", 6), ("per_frame", 18)])
def test_places_are_drawn_as_often_as_is_said(tiny, draw, different):
    planned = plan(recipe(scene={"place": {"source": tiny, "draw": draw}}))
    houses = [p.model.seed for s in planned.shots(box_of) for p in s.things if p.model.category == "house"]
    assert len(set(houses)) == different
    assert all(len(s.instants) == (1 if draw == "per_frame" else 3) for s in planned.shots(box_of))


def test_labelled_scenery_has_ids_and_categories_behind_the_recipe_s(tiny):
    planned = plan(recipe(scene={"place": {"source": tiny, "labels": "own", "draw": "per_model"}, "company": 1}))
    names = {c.name: c.id for c in planned.categories}
    assert names["car"] == 1 and sorted(names) == ["car", "house", "street", "tree"] and sorted(names.values()) == [1, 2, 3, 4]
    shots = list(planned.shots(box_of))
    for shot in shots:
        assert [p.id for p in shot.things] == list(range(1, len(shot.things) + 1))
        assert [p.scenery for p in shot.things] == [False] * 2 + [True] * (len(shot.things) - 2)
        assert all(p.model.category_id == names[p.model.category] for p in shot.things)
    assert planned.max_objects == max(len(s.things) for s in shots)
    kept = {spec.key for spec in planned.kept_specs}
    assert kept == {p.model.key for s in shots for p in s.things}
    assert len(planned.kept_specs) == len(kept)


def test_a_place_turned_turns_all_of_it_and_its_free_floor(tiny):
    straight = plan(recipe(scene={"place": tiny})).shot(0, box_of)
    turned = plan(recipe(scene={"place": {"source": tiny, "turn": 90}, "company": 2})).shot(0, box_of)
    for a, b in zip(straight.things[1:], turned.things[3:], strict=True):
        x, y = np.array(a.world_from_object)[:2, 3]
        np.testing.assert_allclose(np.array(b.world_from_object)[:2, 3], [-y, x], atol=1e-12)
    for target in turned.things[1:3]:
        assert abs(target.world_from_object[1][3]) < 3  # the road runs along X now


def test_on_a_road_that_runs_aslant_there_is_as_much_room(tiny):
    along = np.array([np.sin(np.radians(33)), -np.cos(np.radians(33))])  # where -Y, along the road, is turned to
    place = {"source": tiny, "turn": 33}
    spots = [[*(far * along), 33 if far > 0 else 213] for far in (20.0, -20.0)]
    shot = plan(recipe(scene={"place": place, "company": {"layout": [[float(v) for v in s] for s in spots]}})).shot(0, box_of)
    for thing, spot in zip(shot.things[1:3], spots, strict=True):
        np.testing.assert_allclose(np.array(thing.world_from_object)[:2, 3], spot[:2])
    across = [[4 * float(along[1]), -4 * float(along[0]), 0.0]]
    with pytest.raises(RecipeError, match="free part of the place"):
        plan(recipe(scene={"place": place, "company": {"layout": across}})).shot(0, box_of)


def test_the_orbit_s_centre_is_that_of_all_targets():
    planned = plan(recipe(scene={"company": {"layout": [[4, 0, 0]], "gap": 0}}))
    shot = planned.shot(0, box_of)
    corners = np.concatenate(
        [box_of(p.model) @ np.array(p.world_from_object)[:3, :3].T + np.array(p.world_from_object)[:3, 3] for p in shot.things]
    )
    np.testing.assert_allclose(shot.instants[0].viewpoint.target, (corners.min(axis=0) + corners.max(axis=0)) / 2)
    own = plan(recipe(scene={"company": 1}, viewpoints={"distance": 9, "target": [1, 2, 3]})).shot(0, box_of)
    assert own.instants[0].viewpoint.target == (1, 2, 3)


@pytest.mark.parametrize("draw", ["fixed", "per_model", pytest.param("per_frame", marks=pytest.mark.slow)])
def test_company_comes_from_the_same_split_and_follows_from_names_alone(draw):
    scene = {"company": {"count": 1, "draw": draw}}
    splits = {"by": "model", "train": 0.5, "val": 0.5}
    planned = plan(recipe(12, splits=splits, scene=scene))
    by_model: dict[str, set[tuple[str, ...]]] = {}
    for shot in planned.shots(box_of):
        keys = tuple(p.model.key for p in shot.things)
        by_model.setdefault(keys[0], set()).add(keys[1:])
        assert keys[0] not in keys[1:]
        splits_there = {planned.split(p.model.key, 0) for p in shot.things}
        assert len(splits_there) == 1 == len({f.split for f in shot.instants} | splits_there)
    counts = {len(found) for found in by_model.values()}
    assert counts == {1} if draw != "per_frame" else max(counts) > 1
    more = plan(recipe(13, splits=splits, scene=scene)).keeping(planned.dealt_splits)
    new = more.model_specs[12].key
    same = 0
    for shot in planned.shots(box_of):
        other = next(s for s in more.shots(box_of) if s.key == shot.key)
        if new not in {p.model.key for p in other.things} and draw != "fixed":
            assert other == shot.model_copy(update={"instants": other.instants, "first": other.first})
            same += 1
    assert same > planned.shot_count // 3 or draw == "fixed"


def test_shots_do_not_depend_on_the_order_they_are_asked_for():
    planned = plan(recipe(scene={"company": {"count": 3, "draw": "per_frame"}}))
    shots = [planned.shot(i, box_of) for i in range(planned.shot_count)]
    again = plan(recipe(scene={"company": {"count": 3, "draw": "per_frame"}}))
    assert [again.shot(i, box_of) for i in reversed(range(again.shot_count))] == shots[::-1]
    for shot in shots:
        beside = planned.cast(shot.things[0].model.key, shot.instants[0].viewpoint.index)
        assert [m.key for m in beside] == [p.model.key for p in shot.things]


def test_planes_stand_upright_face_the_origin_and_keep_clear(tmp_path):
    for i in range(3):
        write_picture(tmp_path / "pictures" / f"{i}.png", size=(40 + 20 * i, 20))
    planes = {
        "images": str(tmp_path / "pictures"),
        "height": 2,
        "around": {"distance": [4, 9]},
        "count": 3,
        "draw": "per_model",
    }
    planned = plan(recipe(scene={"planes": planes, "company": 1}))
    seen = set()
    for shot in planned.shots(box_of):
        *targets, _, _, _ = shot.things
        assert len(targets) == 2
        for plane in shot.things[2:]:
            m = np.array(plane.world_from_object)
            front, spot = m[:3, :3] @ [0, -1, 0], m[:3, 3]
            np.testing.assert_allclose(front, -spot / np.linalg.norm(spot), atol=1e-12)
            assert 4 <= np.linalg.norm(spot) <= 9 and plane.id == 0 and plane.model.unit == 2
            seen.add((plane.model.source, tuple(spot)))
    assert len({s for s, _ in seen}) == 3 and len(seen) == 18


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_a_share_of_the_planes_is_shown(tmp_path, share):
    picture = write_picture(tmp_path / "a.png")
    planes = {
        "image": str(picture),
        "height": 1,
        "around": {"distance": [5, 60]},
        "count": 20,
        "share": share,
        "draw": "per_model",
    }
    shown = [len(s.things) - 1 for s in plan(recipe(scene={"planes": planes})).shots(box_of)]
    assert abs(np.mean(shown) - 20 * share) < 3 and (share in (0, 1)) == (len(set(shown)) == 1)


def test_a_place_file_stands_with_its_origin_under_the_target(tmp_path):
    path = write_place(tmp_path / "yard.glb")
    place = {"source": "yard.glb", "origin": [1, 2, 0.5], "turn": 90, "labels": "own", "category": "yard", "unit": "cm"}
    made = Recipe.model_validate(recipe(scene={"place": place}).model_dump(mode="json"), context={"folder": tmp_path})
    planned = plan(made)
    piece = planned.shot(0, box_of).things[1]
    np.testing.assert_allclose(np.array(piece.world_from_object) @ [1, 2, 0.5, 1], [0, 0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(np.array(piece.world_from_object) @ [2, 2, 0.5, 1], [0, 1, 0, 1], atol=1e-12)
    assert (piece.model.source, piece.model.unit, piece.model.category, piece.id) == (str(path), 0.01, "yard", 2)


def test_mistakes_are_said_before_anything_is_read(tmp_path, tiny):
    assert "scene.place: 'zoo:neighborhood' is unknown; did" in error(scene={"place": "zoo:neighborhood"})
    assert "did you mean 'zoo:neighbourhood'" in error(scene={"place": "zoo:neighborhood"})
    assert f"scene.place: expected a place, such as zoo:flat, or a model file; found none at {tmp_path}" in error(
        scene={"place": str(tmp_path / "none.glb")}
    )
    assert "company.count: expected at most 5, as there are 6 models; found 6" in error(scene={"company": 6})
    few = {"by": "model", "train": 1, "val": ["car_000", "car_001"]}
    assert "expected at most 1, as there are 2 models of split 'val'; found 2" in error(scene={"company": 2}, splits=few)
    plane = {"height": 1, "at": [0, 5, 0]}
    assert "scene.planes[0].image: expected an image file; found none" in error(
        scene={"planes": [{**plane, "image": "no.png"}]}
    )
    assert "scene.planes[0].images: expected a folder with images" in error(
        scene={"planes": [{**plane, "images": str(tmp_path)}]}
    )
    (tmp_path / "broken.png").write_text("no picture")
    with pytest.raises(
        RecipeError, match=r"scene.planes\[0\].image: expected a readable image; found none of PNG, .* in .*broken.png"
    ):
        check_images(plan(recipe(scene={"planes": [{**plane, "image": str(tmp_path / "broken.png")}]})))


def test_where_there_is_no_room_is_said(tmp_path, tiny, monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_MAX_REDRAWS", "2")  # each fails as the first
    picture = str(write_picture(tmp_path / "a.png"))

    def problem(scene):
        with pytest.raises(RecipeError) as caught:
            plan(recipe(scene=scene)).shot(0, box_of)
        return str(caught.value)

    at = {"planes": {"image": picture, "height": 2, "at": [0, 0.2, 0]}}
    assert problem(at).startswith("scene.planes[0].at: expected the plane clear of the models")
    around = {"planes": {"image": picture, "height": 4, "around": {"distance": [0.1, 0.2]}}}
    assert problem(around).startswith("scene.planes[0].around: expected room")
    assert " and the model that it joins nearer" in problem({"company": {"layout": [[0.5, 0, 0]]}})
    assert "expected room for 6 models" in problem({"place": tiny, "company": {"count": 5, "gap": 20}})
    assert "free part of the place" in problem({"place": tiny, "company": {"layout": [[9, 0, 0]]}})


def test_a_camera_in_company_is_found_whoever_it_is():
    """The camera looks at the middle between two models 4 m apart along X: at 90 degrees and 2 m it is in the other one."""
    viewpoints = {"azimuth": [0, 90], "elevation": 0, "distance": 2.0}
    planned = plan(recipe(viewpoints=viewpoints, scene={"company": {"layout": [[4, 0, 0]]}}))
    spec = planned.model_specs[0]
    problem = str(Distances(planned, box_of).problem(spec.key))
    assert "`distance` 2 m is inside the model" in problem and "(pose 1)" in problem
    assert problem.endswith(f"(model {planned.cast(spec.key)[1].key})")
    far = plan(recipe(viewpoints={**viewpoints, "distance": 20}, scene={"company": {"layout": [[4, 0, 0]]}}))
    assert Distances(far, box_of).problem(spec.key) is None


def test_the_digest_follows_the_pictures_on_the_planes(tmp_path):
    def digest(name):
        write_picture(tmp_path / "pictures" / name)
        planes = {"images": str(tmp_path / "pictures"), "height": 1, "at": [0, 9, 0]}
        return plan(recipe(scene={"planes": planes})).digest

    assert digest("a.png") == digest("a.png") != digest("b.png")


@pytest.mark.parametrize(("draw", "turns"), [("fixed", 1), ("per_model", 6), ("per_frame", 18)])
def test_a_place_may_be_turned_at_random(tiny, draw, turns):
    shots = list(plan(recipe(scene={"place": {"source": tiny, "turn": [0, 360], "draw": draw}})).shots(box_of))
    streets = {p.world_from_object for s in shots for p in s.things if p.model.category == "street"}
    assert len(streets) == turns
