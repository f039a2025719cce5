"""Frames that show as much of their models, and cut as much of them off, as is wanted; and where in the picture they are."""

import numpy as np
import pytest

import viewsphere as vs
from small import small_recipe
from viewsphere.check import check
from viewsphere.errors import RecipeError
from viewsphere.planning.plan import plan
from viewsphere.run.generate import generate

BOX = [{"source": "zoo:post_box", "count": 3, "scale": {"length": 0.18}}]


def wanted(**changes):
    values = {
        "models": BOX,
        "viewpoints": {"kind": "sphere", "count": 3, "elevation": [5, 25], "distance": {"fill": 0.4}, "shared": True},
        "channels": ["rgb", "instances", "depth"],
        "formats": [],
        "splits": {"by": "frame"},
    }
    return small_recipe(**{**values, **changes})


def targets(folder):
    return [sample.objects[0] for sample in vs.Dataset(folder)]


@pytest.mark.slow
def test_company_between_hides_as_much_as_is_wanted(tmp_path):
    company = {"count": 1, "layout": "between", "draw": "per_frame", "gap": 0.05}
    recipe = wanted(scene={"company": company}, wanted={"visibility": [0.4, 0.7]})
    summary = generate(recipe, tmp_path / "a")
    seen = [o.visibility for o in targets(tmp_path / "a")]
    assert len(seen) == 9 and sum(0.4 <= v <= 0.7 for v in seen) >= 8
    assert any("wanted" in note for note in summary.notes) == any(not 0.4 <= v <= 0.7 for v in seen)
    assert not check(vs.Dataset(tmp_path / "a")).findings


@pytest.mark.slow
def test_models_are_cut_off_as_much_as_is_wanted(tmp_path):
    jitter = {"off_center": {"uniform": [[-0.6, -0.5], [0.6, 0.5]]}}
    generate(wanted(scene={"jitter": jitter}, wanted={"truncation": [0.2, 0.5]}), tmp_path / "a")
    assert all(0.2 <= o.truncation <= 0.5 for o in targets(tmp_path / "a"))
    assert not check(vs.Dataset(tmp_path / "a")).findings


@pytest.mark.parametrize("distance", [1.5, {"fill": 0.3}])
@pytest.mark.slow
def test_what_is_looked_at_is_where_the_recipe_says(distance):
    view = {"azimuth": [10, 130], "elevation": 20, "tilt": 15, "distance": distance}
    center = {"off_center": [0.2, -0.25]}
    recipe = wanted(viewpoints=view, scene={"jitter": center})
    moved, straight = (list(vs.render(one)) for one in (recipe, wanted(viewpoints=view)))
    for a, b in zip(moved, straight, strict=True):
        middle = a.objects[0].box3d.mean(axis=0)
        x, y, z = a.camera.R @ (middle - a.camera.center)
        lens = a.camera.intrinsics
        place = np.array([lens.fx * x / z + lens.cx, lens.fy * y / z + lens.cy])
        np.testing.assert_allclose(place, [lens.cx + 0.2 * lens.width, lens.cy - 0.25 * lens.height], atol=1e-6)
        assert z == pytest.approx(b.camera.R[2] @ (middle - b.camera.center), abs=1e-9)
        np.testing.assert_allclose(a.camera.R, b.camera.R, atol=1e-12)


@pytest.mark.slow
def test_what_cannot_be_had_is_told_with_how_near_it_came(tmp_path):
    summary = generate(wanted(models=[{**BOX[0], "count": 1}], wanted={"visibility": [0.1, 0.2]}), tmp_path)
    (note,) = (note for note in summary.notes if "wanted" in note)
    assert note.startswith("warning: wanted: 3 of 3 frames are not as wanted") and "the farthest is 0.8 beside" in note


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"wanted": {}}, "wanted: expected visibility or truncation; found neither"),
        ({"wanted": {"visibility": [0.2, 1.2]}}, r"wanted\.visibility: expected shares of 0 to 1; found \[0.2, 1.2\]"),
        ({"wanted": {"visibility": [0.5, 0.2]}}, r"wanted\.visibility: expected \[low, high\]"),
        ({"wanted": {"visibility": 0.5}, "min_visibility": 0.2}, "expected wanted or min_visibility; found both"),
        (
            {"wanted": {"visibility": [0.2, 0.5]}, "viewpoints": {"distance": 2}},
            "wanted: expected something to draw again, .*scene.jitter",
        ),
    ],
)
def test_mistakes(changes, message):
    with pytest.raises(RecipeError, match=message):
        plan(wanted(**changes))


def test_between_needs_a_camera_that_is_known():
    with pytest.raises(RecipeError, match=r"scene\.company\.layout: expected scene.company with draw: per_frame"):
        next(iter(vs.render(wanted(scene={"company": {"count": 1, "layout": "between"}}))))
