"""Draws that do not fit are drawn again, by one rule for the command line and for Python."""

import numpy as np
import pytest

import viewsphere as vs
from small import tree_hash
from viewsphere.composing.redraws import scene_draws
from viewsphere.errors import RecipeError
from viewsphere.planning.plan import plan
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.shots.framing import Framing
from viewsphere.run.shots.stages import Stages

CAMERA = {"size": [32, 32], "fov_deg": 70}
LOW = {"kind": "sphere", "count": 1, "elevation": [10, 25], "distance": [1, 2]}
BOXES = [{"source": "zoo:post_box", "category": "post box", "count": 4, "scale": {"length": 0.5}}]


def recipe_of(**changes):
    values = {
        "name": "again",
        "models": BOXES,
        "viewpoints": LOW,
        "camera": CAMERA,
        "engine": {"bounces": "off"},
        "channels": ["instances"],
        "formats": [],
        "splits": {"by": "frame", "train": 1},
    }
    return Recipe(**{**values, **changes})


def composed(recipe):
    planned, stages = plan(recipe), Stages()
    framing = Framing(planned, planned, stages, stages.box)
    return [framing.shot(row) for row in planned.rows]


def scenes_on(side, objects, count=4, **more):
    return {"count": count, "objects": objects, "gap": 0.02, "surface": {"size": [side, side], "height": 0.5}, **more}


@pytest.mark.slow
def test_models_without_room_are_placed_again_and_one_is_left_out_at_last(monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_MAX_REDRAWS", "16")
    shots = composed(recipe_of(scenes=scenes_on(0.55, [1, 4])))
    sizes = [sum(thing.is_target for thing in shot.things) for shot in shots]
    asked = [len(plan(recipe_of(scenes=scenes_on(0.55, [1, 4]))).cast(f"scene-{i:06d}")) for i in range(len(shots))]
    assert len(shots) == 4
    assert all(1 <= size <= most for size, most in zip(sizes, asked, strict=True))
    assert any(size < most for size, most in zip(sizes, asked, strict=True))
    assert [shot.redraw for shot in shots] == [shot.redraw for shot in composed(recipe_of(scenes=scenes_on(0.55, [1, 4])))]


def test_what_fits_at_once_is_the_original_draw():
    shots = composed(recipe_of(scenes=scenes_on(3, 2)))
    assert [shot.redraw for shot in shots] == [0] * 4


@pytest.mark.parametrize("more", [{"balance": "category"}, {}])
def test_the_lower_bound_of_objects_and_balanced_scenes_are_kept(more, monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_MAX_REDRAWS", "8")
    objects = [2, 4] if more else 4
    with pytest.raises(RecipeError, match=r"covers .* and the free floor has 0\.2 x 0\.2 m"):
        composed(recipe_of(scenes=scenes_on(0.2, objects, count=1, **more)))
    drops = scene_draws(recipe_of(scenes=scenes_on(0.2, objects, **more))) // scene_draws(recipe_of(scenes=scenes_on(1, 2)))
    assert drops == 1


def test_a_camera_in_a_model_is_drawn_again_in_python_and_on_the_command_line(tmp_path):
    views = {"kind": "sphere", "count": 8, "elevation": [0, 60], "distance": [0.05, 1.5]}
    recipe = recipe_of(viewpoints=views, models=[{"source": "zoo:post_box", "scale": {"length": 0.8}}])
    inside = plan(recipe).shot(0, Stages().box)
    boxes = [np.linalg.norm(now.viewpoint.distance) for now in inside.instants]
    assert min(boxes) < 0.13  # else nothing is tried
    in_memory = [sample.camera.center for sample in vs.render(recipe)]
    vs.generate(recipe, tmp_path / "out")
    assert np.allclose(in_memory, [sample.camera.center for sample in vs.open(tmp_path / "out")], atol=1e-9)


@pytest.mark.slow
def test_any_number_of_workers_draws_the_same_again(tmp_path):
    recipe = recipe_of(scenes=scenes_on(0.55, [1, 4]), viewpoints={**LOW, "count": 3}, shot_frames=2)
    for workers in (0, 2):
        vs.generate(recipe, tmp_path / str(workers), workers=workers)
    assert tree_hash(tmp_path / "0") == tree_hash(tmp_path / "2")


def test_a_listed_camera_in_a_model_is_refused_by_both(tmp_path):
    recipe = recipe_of(viewpoints={"azimuth": 0, "elevation": 0, "distance": 0.05})
    with pytest.raises(RecipeError, match=r"camera outside|is inside the model"):
        list(vs.render(recipe))
    with pytest.raises(RecipeError, match=r"camera outside|is inside the model"):
        vs.generate(recipe, tmp_path / "out")


def test_a_picture_without_an_object_is_drawn_again_and_else_counted(tmp_path):
    away = {"kind": "sphere", "count": 4, "elevation": [0, 80], "distance": 2, "target": [1.2, 0, 0]}
    narrow = {"size": [32, 32], "fov_deg": 40}
    recipe = recipe_of(viewpoints=away, camera=narrow)
    planned, stages = plan(recipe), Stages()
    first = [s for row in planned.rows for s in stages.render(planned.shot(row, stages.box))]
    shown = [sum(bool(sample.objects[0].area) for sample in samples) for samples in (first, list(vs.render(recipe)))]
    assert shown[0] < 10
    assert 13 <= shown[1] <= 16
    row = {"azimuth": [0, 180], "elevation": 0, "distance": 2, "target": [0, 0, 3]}
    (note,) = vs.generate(recipe_of(viewpoints=row, camera=narrow), tmp_path / "out").notes
    assert note.startswith("warning: viewpoints: 8 of 8 pictures show no object: ")


@pytest.mark.slow
def test_a_surface_that_one_draw_of_the_place_lacks_is_drawn_again():
    place = {"source": "zoo:room", "draw": "per_model"}
    scenes = {"count": 6, "objects": 1, "gap": 0.01, "surface": "shelf_2_board_3"}
    mugs = [{"source": "zoo:mug", "count": 2}]
    shots = composed(recipe_of(models=mugs, scenes=scenes, scene={"place": place}))
    assert len(shots) == 6
    with pytest.raises(RecipeError, match=r"scenes\.surface"):
        plan(recipe_of(models=mugs, scenes={**scenes, "surface": "ceiling"}, scene={"place": place}))
    with pytest.raises(RecipeError, match="shelf_9_board_9"):
        plan(recipe_of(models=mugs, scenes={**scenes, "surface": "shelf_9_board_9"}, scene={"place": "zoo:room"}))


@pytest.mark.slow
def test_the_summary_counts_scenes_that_lost_objects(tmp_path):
    notes = vs.generate(recipe_of(scenes=scenes_on(0.55, [1, 4], count=6)), tmp_path / "out").notes
    assert any(note.startswith("note: scenes.objects: ") and "fewer objects than drawn" in note for note in notes)


@pytest.mark.slow
def test_appended_viewpoints_keep_the_draw_of_their_scene(tmp_path):
    recipe = recipe_of(scenes=scenes_on(0.55, [1, 4], count=6))
    vs.generate(recipe, tmp_path / "out")
    vs.generate(
        recipe.model_copy(
            update={"viewpoints": Recipe(**{**recipe.model_dump(), "viewpoints": {**LOW, "count": 3}}).viewpoints}
        ),
        tmp_path / "out",
        append=True,
    )
    placed = {}
    for sample in vs.open(tmp_path / "out"):
        scene = vs.open(tmp_path / "out").plan.row_at(sample.index).subject
        placed.setdefault(scene, set()).add(tuple(o.world_from_object.tobytes() for o in sample.objects))
    assert len(placed) == 6
    assert all(len(ways) == 1 for ways in placed.values())
