"""Warnings of objects that have too few pixels."""

import viewsphere as vs
from command_line import viewsphere
from small import small_recipe
from viewsphere.planning.checks.warnings import SMALLEST
from viewsphere.planning.plan import plan
from viewsphere.preview import preview_samples, small_objects
from viewsphere.recipe.recipe import Recipe


def warnings_of(distance, **changes):
    return [
        w
        for w in plan(small_recipe(viewpoints={"azimuth": [0, 90], "distance": distance}, **changes)).warnings
        if "too small" in w
    ]


def test_plan_warns_of_models_whose_length_it_knows():
    assert not warnings_of(1.0)
    lens = small_recipe().camera.intrinsics
    limit = 0.18 * lens.fx / SMALLEST  # metres
    assert not warnings_of([1.0, limit * 0.99])
    (warning,) = warnings_of([1.0, limit * 1.01])
    assert warning.startswith("models[0]: 0.18 m seen from ")
    assert "12 pixels, which for most detectors is too small (under 12)" in warning


def test_plan_knows_true_sizes_and_shares():
    sized = {"source": "zoo:post_box", "real_size": {"width": 0.1, "height": 0.5, "length": 0.1}, "scale": "real_size"}
    assert warnings_of(6.0)
    assert not warnings_of(6.0, models=[sized])
    assert warnings_of(16.0, models=[sized])
    assert not warnings_of(16.0, models=[{"source": "zoo:post_box"}])  # nobody has read it
    assert not warnings_of({"fill": 0.126})
    (warning,) = warnings_of({"fill": [0.5, 0.1]})
    assert warning.startswith("viewpoints.distance: a share of 0.1 is 9.6 pixels")


def test_previews_count_small_objects_in_the_recipes_own_pixels():
    views = {"azimuth": [0, 90], "distance": {"fill": [0.5, 0.1]}}
    large = small_recipe(viewpoints=views, camera={"size": [640, 480], "fov_deg": 35})
    assert not list(small_objects(preview_samples(large, width=64), large))  # 48 pixels or more, of which the preview shows 5
    assert len(list(small_objects(preview_samples(large, width=64)))) == 1
    small = small_recipe(viewpoints=views)
    (warning,) = small_objects(preview_samples(small), small)
    assert warning.startswith("4 of 8 objects shown are at most ")


def test_preview_says_so_and_stays_quiet_where_all_is_large(tmp_path):
    def said(distance):
        recipe = tmp_path / "recipe.yaml"
        values = small_recipe(viewpoints={"azimuth": 0, "elevation": 15, "distance": distance})
        recipe.write_text(Recipe.to_yaml(values), encoding="utf-8")
        answer = viewsphere("preview", recipe, "-o", tmp_path / "sheet.png")
        assert answer.returncode == 0
        return answer.stderr

    assert "too small" not in said(1.0)
    assert "warning: 2 of 2 objects shown are at most" in said(9.0)


def test_a_finished_set_is_measured_as_it_is(tmp_path):
    vs.generate(
        small_recipe(viewpoints={"azimuth": 0, "elevation": 0, "distance": {"fill": 0.05}}, formats=[]), tmp_path / "out"
    )
    (warning,) = small_objects(vs.open(tmp_path / "out"))
    assert warning.startswith("2 of 2 objects shown are at most 3.6 pixels")  # of 72, the height
