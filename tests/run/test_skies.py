"""Skies whose pixels are bad: told before anything is rendered, with the recipe's line, and by nobody else on the terminal."""

import numpy as np
import OpenEXR
import pytest

from small import small_recipe
from viewsphere.errors import RecipeError
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.generate import generate

PIXELS = np.random.default_rng(0).random((64, 128, 3)).astype(np.float32)


def exr(path, pixels):
    with OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}, {"RGB": pixels}) as file:
        file.write(str(path))
    return path


def half_broken():
    pixels = PIXELS.copy()
    pixels[:32] = np.nan
    return pixels


def recipe(folder, **scene):
    file = folder / "recipe.yaml"
    file.write_text(small_recipe(scene={"sky": "skies", **scene}).to_yaml())
    line = next(i for i, text in enumerate(file.read_text().splitlines(), 1) if "skies" in text)
    return Recipe.load(file), f"{file}:{line}: "


@pytest.mark.parametrize("workers", [0, 1])
@pytest.mark.parametrize(
    ("name", "problem"), [("cut", "cut off"), ("nan", "4,096 of 8,192 texels"), ("black", "no light in it")]
)
def test_a_bad_one_in_a_folder_stops_the_run_before_it_begins(name, problem, workers, tmp_path, capfd):
    (tmp_path / "skies").mkdir()
    exr(tmp_path / "skies" / "a.exr", PIXELS)
    bad = exr(tmp_path / "skies" / "b.exr", {"nan": half_broken(), "black": 0 * PIXELS}.get(name, PIXELS))
    if name == "cut":
        bad.write_bytes(bad.read_bytes()[: bad.stat().st_size // 2])
    made, line = recipe(tmp_path)
    with pytest.raises(RecipeError) as caught:
        generate(made, tmp_path / "out", workers=workers)
    said = str(caught.value)
    assert said.startswith(f"{line}scene.sky.hdri: environment {bad}: ") and problem in said and "\n" not in said
    assert not list((tmp_path / "out" / "store").glob("models/*/*"))
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_what_is_mended_is_said(tmp_path):
    (tmp_path / "skies").mkdir()
    pixels = PIXELS.copy()
    pixels[0, 0], pixels[1, 1] = np.nan, np.inf
    file = exr(tmp_path / "skies" / "a.exr", pixels)
    made, _ = recipe(tmp_path)
    summary = generate(made, tmp_path / "out", formats=[])
    assert summary.notes == (f"{file}: mended 2 texels that are no numbers, or above 1e+06",)
