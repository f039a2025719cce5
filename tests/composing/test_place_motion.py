"""What moves in a place: its lanes where it is put, and its pieces."""

import math
from functools import partial

import numpy as np
import pytest

from viewsphere.composing.composition import Numbering, compose
from viewsphere.composing.motion import Start, check_motions, mover
from viewsphere.composing.placing import standing
from viewsphere.composing.scene.scenery import place_lanes, place_pieces
from viewsphere.composing.seeds import generator
from viewsphere.composing.viewpoints.sequence_poses import poses_of
from viewsphere.errors import RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.model.model_spec import ModelSpec
from viewsphere.planning.plan import plan
from viewsphere.recipe.recipe import Recipe
from viewsphere_zoo.families.street import lanes

BOX = Box3d.between((-1.0, -2.0, 0.0), (1.0, 2.0, 1.5)).corners


def recipe(place="zoo:neighbourhood", **fields):
    defaults = {"models": [{"source": "zoo:car"}], "viewpoints": {"distance": 12}, "splits": {"by": "frame"}, "formats": []}
    return Recipe(**{**defaults, "scene": {"place": place}, **fields})


def pieces(made):
    return place_pieces(made, made.scene.place, (), lambda category, labels: 0)


def test_lanes_stand_where_their_place_is_put():
    made = recipe({"source": "zoo:neighbourhood", "turn": 30})
    c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
    for found, own in zip(place_lanes(made, made.scene.place, ()), lanes(), strict=True):
        assert (found.name, found.width, found.closed) == (own.name, own.width, own.closed)
        expected = [(c * x - s * y, s * x + c * y, z) for x, y, z in own.points]
        np.testing.assert_allclose(found.points, expected, atol=1e-12)
    assert place_lanes(recipe(None), None, ()) == ()


def test_a_car_follows_the_lane_of_a_turned_place():
    made = recipe({"source": "zoo:neighbourhood", "turn": 90})
    (piece, *_) = pieces(made)
    start = Start(
        placed=standing(BOX),
        spec=piece.model,
        seconds=2.0,
        rng=partial(generator, 0, "motion"),
        lanes=place_lanes(made, made.scene.place, ()),
    )
    entry = recipe(models=[{"source": "zoo:car", "motion": {"kind": "path", "lane": "right", "speed": 10}}]).models[0].motion
    first, last = (np.array(pose) for pose in mover(entry, start).motion_at([0.0, 2.0]).poses)
    np.testing.assert_allclose(last[:3, 3] - first[:3, 3], [-20, 0, 0], atol=1e-9)  # +Y, turned by 90 degrees
    np.testing.assert_allclose(-last[:3, 1], [-1, 0, 0], atol=1e-9)
    assert last[1, 3] == pytest.approx(lanes()[0].points[0][0]) and last[2, 3] == 0


def test_pieces_have_the_motion_of_the_first_pattern_that_fits():
    sway, spin = {"kind": "oscillate", "rotation_deg": [2, 0, 0]}, [{"kind": "constant", "spin_deg": [0, 0, 9]}]
    made = recipe({"source": "zoo:neighbourhood", "motion": {"tree_2": spin, "tree_*": sway}})
    moving = {piece.name: piece for piece in pieces(made) if piece.motion is not None}
    assert {name.split("_")[0] for name in moving} == {"tree"} and len(moving) > 3
    assert moving["tree_2"].motion[0].kind == "constant" and moving["tree_2"].field == "scene.place.motion.tree_2"
    assert moving["tree_1"].motion.kind == "oscillate" and moving["tree_1"].field == "scene.place.motion.tree_*"
    plain = pieces(recipe())
    assert [(p.model, p.world_from_piece) for p in plain] == [(p.model, p.world_from_piece) for p in pieces(made)]
    assert len({piece.name for piece in plain}) == len(plain)


def test_the_composition_moves_pieces_of_a_place():
    made = recipe({"source": "zoo:neighbourhood", "motion": {"wheelie_bin_1": {"kind": "constant"}}}, time={"frames": 2})
    car = ModelSpec(key="car_000", source="zoo:car", seed=1, category="car", category_id=1)
    numbering = Numbering(("car_000",), poses_of(made.viewpoints, made.time, made.seed))
    composition = compose(made, ("car_000",), (car,), (), ("",), numbering)
    asked = []

    def moved(thing, piece):
        asked.append(piece.name if piece.motion else None)
        return thing

    targets = composition.targets(car, None, lambda spec, step=None: BOX)
    things = composition.things("car_000", targets, None, lambda spec, step=None: BOX, moved)
    assert len(asked) == len(things) - 1 and [name for name in asked if name] == ["wheelie_bin_1"]
    assert len(composition.lanes("car_000", None)) == 2


def test_a_pattern_that_fits_nothing_is_refused():
    made = recipe({"source": "zoo:neighbourhood", "motion": {"tre_*": {"kind": "random"}}})
    with pytest.raises(RecipeError) as caught:
        pieces(made)
    text = str(caught.value)
    assert text.startswith("scene.place.motion: expected patterns of its pieces' names, such as bench_*, driveway_*")
    assert text.endswith("found 'tre_*'; did you mean 'tree_*'?") and "\n" not in text


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        (
            {"models": [{"source": "zoo:car", "motion": {"kind": "random", "hz": 3}}]},
            r"^models\[0\]\.motion\.hz: 'hz' is unknown",
        ),
        (
            {"scene": {"company": {"count": 1, "motion": [{"kind": "randm"}]}}},
            r"^scene\.company\.motion\[0\]\.kind: 'randm' is unknown; did you mean 'random'\? Valid: .*$",
        ),
        (
            {"scene": {"place": {"source": "zoo:neighbourhood", "motion": {"tree_1": {"kind": "oscillate", "period": 0}}}}},
            r"^scene\.place\.motion\.tree_1\.period: expected a number greater than 0; found 0$",
        ),
    ],
)
def test_a_recipe_s_motions_are_checked_together(fields, message):
    with pytest.raises(RecipeError, match=message):
        check_motions(recipe(**fields, time={"frames": 5}))


def test_motions_take_time():
    moving = {"source": "zoo:car", "motion": {"kind": "random", "position": [1, 0, 0]}}
    check_motions(recipe())
    check_motions(recipe(models=[moving], time={"seconds": 2}))
    with pytest.raises(RecipeError, match=r"^models\[1\]\.motion: expected time beside motions; found none: set time"):
        check_motions(recipe(models=[{"source": "zoo:boat"}, moving]))


def test_mistakes_of_a_place_s_motions():
    with pytest.raises(RecipeError, match=r"scene\.place\.motion\.tree_1\.kind: expected a value; found nothing"):
        recipe({"source": "zoo:neighbourhood", "motion": {"tree_1": {}}})


def test_a_sequence_in_a_place_moves_its_cars_and_its_pieces():
    place = {
        "source": "zoo:neighbourhood",
        "turn": 90,
        "motion": {"wheelie_bin_*": {"kind": "constant", "velocity": [0, 0, 1]}},
    }
    car = {"source": "zoo:car", "motion": {"kind": "path", "lane": "left", "speed": 10}}
    shot = plan(recipe(place, models=[car], time={"frames": 3, "fps": 2})).shot(0, lambda spec, step=None: BOX)
    moving = {thing.model.source: thing.motion for thing in shot.things if not thing.motion.is_still}
    assert set(moving) == {"zoo:car", "zoo:wheelie_bin"}
    for source, way in (("zoo:car", [5, 0, 0]), ("zoo:wheelie_bin", [0, 0, 0.5])):
        spots = np.array(moving[source].poses)[:, :3, 3]
        np.testing.assert_allclose(np.diff(spots, axis=0), [way, way], atol=1e-9)
