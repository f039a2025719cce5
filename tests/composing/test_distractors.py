"""Models that are drawn among the others and are not labelled."""

import numpy as np
import pytest

import viewsphere as vs
from small import small_recipe
from viewsphere.assets.cache import load_normalised
from viewsphere.check import check
from viewsphere.errors import RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.planning.plan import plan
from viewsphere.run.generate import generate

OWN = {"source": "zoo:post_box", "count": 2, "scale": {"length": 0.18}}
OTHER = {"source": "zoo:open_box", "count": 2, "name": "clutter", "labels": "background"}


def recipe(*models, **changes):
    scenes = {"count": 3, "objects": 2, "distractors": [1, 3], **changes.pop("scenes", {})}
    values = {
        "models": list(models or (OWN, OTHER)),
        "scenes": scenes,
        "viewpoints": {"azimuth": [0, 120], "elevation": 30, "distance": 4},
        "channels": ["rgb", "instances", "depth"],
        "formats": ["coco"],
        "splits": {"by": "frame"},
    }
    return small_recipe(**{**values, **changes})


@pytest.mark.slow
def test_distractors_are_drawn_and_not_labelled(tmp_path):
    generate(recipe(), tmp_path)
    dataset = vs.Dataset(tmp_path)
    assert {o.category for sample in dataset for o in sample.objects} == {"post box"}
    assert [category.name for category in dataset.plan.categories] == ["post box"]
    assert all(len(sample.objects) == 2 for sample in dataset) and len(dataset) == 6
    assert not check(dataset).findings
    counts = set()
    for key, _ in dataset.shots():
        shown = [thing for thing in dataset.store.shot(key).things if thing.model.key.startswith("clutter")]
        assert all(thing.id == 0 for thing in shown)
        counts.add(len(shown))
    assert counts <= {1, 2, 3} and len(counts) > 1


def test_the_labelled_stand_where_they_stand_whoever_else_is_drawn():
    boxed = lambda spec, step=None: np.array([[x, y, z] for z in (0, 0.3) for x in (0.2, -0.2) for y in (0.2, -0.2)])  # noqa: E731
    with_them = plan(recipe()).shot(0, boxed)
    without = plan(recipe(OWN, scenes={"distractors": 0})).shot(0, boxed)
    for a, b in zip(with_them.objects, without.objects, strict=True):
        assert a.world_from_object == b.world_from_object and a.model.key == b.model.key


@pytest.mark.slow
def test_distractors_fall_with_the_others():
    models = [{**entry, "motion": {"kind": "fall"}} for entry in (OWN, OTHER)]
    scenes = {"count": 1, "layout": "fall", "distractors": 2}
    fields = {"scenes": scenes, "time": {"frames": 3, "fps": 5}, "viewpoints": {"distance": 4}, "shot_frames": 3}
    assert all(len(sample.objects) == 2 for sample in vs.render(recipe(*models, **fields)))
    planned = plan(recipe(*models, **fields))
    assert planned.max_objects == 2 and len(planned.distractors) == 2
    shot = planned.shot(0, lambda spec, step=None: Box3d.between(*load_normalised(spec).bounds).corners)
    assert [thing.id for thing in shot.things] == [1, 2, 0, 0]
    assert all(len(set(thing.motion.poses)) > 1 for thing in shot.things)


@pytest.mark.parametrize(
    ("models", "changes", "message"),
    [
        ((OWN, OTHER), {"scenes": {"distractors": 0}}, r"models\[1\]\.labels: expected scenes\.distractors beside background"),
        ((OWN,), {}, r"scenes\.distractors: expected models with labels: background; found none"),
        ((OTHER,), {}, r"models\[0\]\.labels: expected models that are labelled"),
        ((OWN, {**OTHER, "labels": "none"}), {}, r"models\[1\]\.labels"),
        ((OWN, OTHER), {"scenes": {"distractors": -1}}, r"scenes\.distractors"),
    ],
)
def test_mistakes(models, changes, message):
    with pytest.raises(RecipeError, match=message):
        plan(recipe(*models, **changes))
