"""Distributions in place of a scene's numbers, vectors, colours and words: what is accepted, refused and drawn."""

import math
from typing import Literal

import numpy as np
import pytest
from pydantic import Field, ValidationError

from viewsphere.errors import RecipeError
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Amount, Portion
from viewsphere.model.scene import Color, Position, Srgb
from viewsphere.recipe.draws import Drawn, alternatives, drawn, is_random
from viewsphere.recipe.entries import entry_of
from viewsphere.recipe.reading.extends import assemble
from viewsphere.recipe.recipe import Recipe


class Part(Frozen):
    number: float = Field(default=45.0, gt=0, le=90)
    share: Portion | None = None
    free: float = 0.0
    whole: int = Field(default=1, ge=0)
    point: Position = (0.0, 0.0, 0.0)
    color: Srgb = (0.0, 0.0, 0.0)
    light: Color = (1.0, 1.0, 1.0)
    word: Literal["a", "b", "c"] = "a"
    flag: bool = False


class Entry(entry_of(Part)):
    """All that may be drawn."""


class Outer(Frozen):
    entry: Drawn[Entry] = Entry()
    items: tuple[Entry, ...] = ()


def draws(field, value, count=4000):
    """The field's value for many generators: another one for every draw and every path."""
    entry = Entry(**{field: value})
    assert is_random(entry)

    def rng_of(draw):
        return lambda path: np.random.default_rng([draw, *".".join(path).encode()])

    return [getattr(drawn(entry, rng_of(i)), field) for i in range(count)]


def test_uniform_has_its_mean_and_fills_its_range():
    found = np.array(draws("number", {"uniform": [10, 30]}))
    assert 10 <= found.min() < 10.1
    assert 29.9 < found.max() <= 30
    assert abs(found.mean() - 20) < 4 * (20 / math.sqrt(12)) / math.sqrt(len(found))
    assert draws("number", [10, 30], 50) == draws("number", {"uniform": [10, 30]}, 50)


def test_normal_has_its_mean_and_deviation():
    found = np.array(draws("free", {"normal": [3, 0.5]}))
    assert abs(found.mean() - 3) < 4 * 0.5 / math.sqrt(len(found))
    assert abs(found.std() - 0.5) < 0.03


@pytest.mark.slow
def test_normal_keeps_within_its_limits_and_the_field_s_without_piling_up_there():
    found = np.array(draws("share", {"normal": [0.1, 0.2]}))
    assert 0 <= found.min() < 0.001
    assert (found == 0).sum() == 0
    assert (found < 0.05).mean() < 0.25
    found = np.array(draws("free", {"normal": {"mean": 0, "deviation": 1, "min": -0.5, "max": 2}}))
    assert found.min() >= -0.5
    assert found.max() <= 2
    cdf = [math.erf(x / math.sqrt(2)) / 2 for x in (-0.5, 0, 2)]
    assert abs((found < 0).mean() - (cdf[1] - cdf[0]) / (cdf[2] - cdf[0])) < 0.03
    assert set(draws("free", {"normal": [7, 0]}, 5)) == {7.0}


def test_log_uniform_is_uniform_in_the_logarithm():
    found = np.log2(draws("number", {"log_uniform": [1, 16]}))
    assert 0 <= found.min() < 0.01
    assert 3.99 < found.max() <= 4
    assert abs(found.mean() - 2) < 0.08


def test_choices_come_as_often_as_they_weigh():
    found = draws("word", {"choice": ["a", "b", "c"], "weights": [1, 3, 0]})
    assert abs(found.count("b") / len(found) - 0.75) < 0.03
    assert "c" not in found
    assert set(draws("flag", {"choice": [True, False]}, 50)) == {True, False}


def test_whole_numbers_stay_whole_and_both_ends_are_drawn():
    found = draws("whole", {"uniform": [1, 3]}, 300)
    assert set(found) == {1, 2, 3}
    assert {type(n) for n in found} == {int}


@pytest.mark.slow
def test_vectors_are_drawn_element_by_element_or_as_a_whole():
    found = np.array(draws("point", [{"uniform": [0, 1]}, 0, [2, 3]], 300))
    assert (found[:, 1] == 0).all()
    assert abs(np.corrcoef(found[:, 0], found[:, 2])[0, 1]) < 0.25
    found = np.array(draws("point", {"uniform": [[0, 0, 5], [1, 1, 5]]}, 300))
    assert (found[:, 2] == 5).all()
    assert abs(np.corrcoef(found[:, 0], found[:, 1])[0, 1]) < 0.25
    assert set(draws("point", {"choice": [[1, 2, 3], [4, 5, 6]]}, 50)) == {(1, 2, 3), (4, 5, 6)}
    found = np.array(draws("point", {"normal": [[0, 0, 5], [1, 2, 0]]}))
    assert np.allclose(found.std(axis=0), [1, 2, 0], atol=0.1)


def test_colours_are_drawn_from_names_and_codes():
    assert set(draws("color", {"choice": ["red", "#336699"]}, 50)) == {(1, 0, 0), (0.2, 0.4, 0.6)}
    found = np.array(draws("color", {"uniform": ["#000000", "#808080"]}, 300))
    assert found.min() >= 0
    assert 0.45 < found.max() <= 128 / 255
    assert np.array(draws("color", {"normal": ["red", 0.3]}, 300)).max() <= 1
    assert np.isclose(Entry(light="#808080").light, 0.2158605, atol=1e-6).all()
    assert Entry(light=[2, 0, 0]).light == (2, 0, 0)


@pytest.mark.slow
def test_arguments_may_be_distributions():
    found = np.array(draws("number", {"uniform": [{"choice": [10, 20]}, {"uniform": [20, 30]}]}))
    assert 10 <= found.min() < 10.5
    assert 29 < found.max() <= 30
    assert abs(found.mean() - 20) < 0.4
    found = np.array(draws("free", {"normal": [{"choice": [-100, 100]}, [0, 0.1]]}, 300))
    assert set(np.sign(found)) == {-1, 1}
    assert set(draws("share", {"choice": [0, [0.5, 1]]}, 100)) > {0.0}


def test_every_value_has_a_generator_of_its_own():
    paths = []

    def rng_of(path):
        paths.append(path)
        return np.random.default_rng(0)

    items = (Entry(number=[1, 2]), Entry(number={"uniform": [[1, 2], 3]}, point=[[0, 1], 0, 0]))
    drawn(Outer(items=items, entry={"choice": [Entry(word={"choice": ["a", "b"]})]}), rng_of, ("scene",))
    assert len(set(paths)) == len(paths) == 6
    assert ("scene", "items", "1", "point", "0") in paths


def test_what_is_not_random_is_left_as_it_is():
    entry = Outer(entry=Entry(number=3), items=(Entry(),))
    assert not is_random(entry)
    assert drawn(entry, lambda path: pytest.fail("drawn")) == entry


def test_all_that_a_choice_may_be():
    outer = Outer(entry={"choice": [{"word": {"choice": ["a", "b"]}}, {"choice": [{}, {"number": 3}]}]})
    assert [list(alternatives(entry.word)) for entry in alternatives(outer.entry)] == [["a", "b"], ["a"], ["a"]]


def test_a_distribution_reads_back_as_it_was_written():
    fields = {
        "number": {"normal": {"mean": 3.0, "deviation": 1.0, "max": 5.0}},
        "word": {"choice": ["a", "b"], "weights": [1.0, 2.0]},
        "point": [{"uniform": [0.0, 1.0]}, 0.0, 0.0],
    }
    entry = Entry(**fields)
    assert entry.model_dump(mode="json", exclude_defaults=True) == fields
    assert Entry(**entry.model_dump(mode="json")) == entry
    assert Entry(number=entry.number) == Entry(number=fields["number"])


REFUSED = [
    ({"number": {"uniform": [0, 30]}}, ("number", "uniform", 0), "a number greater than 0; found 0"),
    ({"number": {"uniform": [1, 91]}}, ("number", "uniform", 1), "a number less than or equal to 90; found 91"),
    ({"number": {"choice": [1, 2, 99]}}, ("number", "choice", 2), "less than or equal to 90; found 99"),
    ({"number": {"choice": [1, {"uniform": [1, 99]}]}}, ("number", "choice", 1, "uniform", 1), "equal to 90; found 99"),
    ({"number": {"normal": [99, 1]}}, ("number", "normal", "mean"), "equal to 90; found 99"),
    ({"number": {"normal": [3, -1]}}, ("number", "normal", "deviation"), "greater than or equal to 0; found -1"),
    ({"number": {"normal": {"mean": 3, "deviation": 1, "min": 4}}}, ("number",), "a mean from min to max"),
    (
        {"number": {"normal": {"mean": 3, "deviation": 1, "sd": 1}}},
        ("number", "normal", "sd"),
        "'sd' is unknown. Valid: mean, deviation, min, max",
    ),
    ({"number": {"normal": [3]}}, ("number", "normal"), "[mean, deviation] or a mapping of them; found [3]"),
    ({"number": {"uniform": [3, 2]}}, ("number",), "[low, high]; found [3.0, 2.0]"),
    ({"color": {"uniform": ["#303030", "red"]}}, ("color",), "low first in every component (red, green and blue of a colour)"),
    ({"number": {"uniform": [3]}}, ("number", "uniform", 1), "a value; found nothing"),
    ({"number": {"unifrom": [1, 2]}}, ("number", "unifrom"), "did you mean 'uniform'?"),
    ({"number": {"uniform": [1, 2], "choice": [1]}}, ("number",), "found uniform and choice"),
    ({"number": {}}, ("number",), "one of uniform, log_uniform, normal, choice; found none"),
    ({"number": [1]}, ("number",), "a number, [low, high] or a distribution; found [1]"),
    ({"number": {"uniform": [1, True]}}, ("number", "uniform", 1), "a number; found true"),
    ({"number": {"uniform": [1, math.inf]}}, ("number", "uniform", 1), "a finite number; found inf"),
    ({"number": {"choice": []}}, ("number", "choice"), "at least 1 of them; found 0"),
    ({"number": {"choice": [1, 2], "weights": [1]}}, ("number",), "as many weights as choices"),
    ({"number": {"choice": [1, 2], "weights": [0, 0]}}, ("number",), "a weight above 0"),
    ({"number": {"uniform": [1, 2], "weights": [0, 1]}}, ("number",), "as many weights as choices"),
    ({"free": {"log_uniform": [0, 1]}}, ("free",), "ends above 0; found one that may be 0"),
    ({"free": {"log_uniform": [{"normal": [3, 1]}, 9]}}, ("free",), "ends above 0; found one that may be -inf"),
    ({"share": {"uniform": [0, 2]}}, ("share", "uniform", 1), "less than or equal to 1; found 2"),
    ({"whole": {"normal": [1, 1]}}, ("whole",), "uniform or choice; found normal, which is not for whole numbers"),
    ({"whole": {"uniform": [1, 2.5]}}, ("whole", "uniform", 1), "a whole number; found 2.5"),
    ({"word": {"uniform": ["a", "b"]}}, ("word",), "choice; found uniform, which is for numbers"),
    ({"word": {"choice": ["a", "d"]}}, ("word", "choice", 1), "'d' is unknown. Valid: a, b, c"),
    ({"color": {"choice": ["red", "grene"]}}, ("color", "choice", 1), "did you mean 'green'?"),
    ({"color": [[0, 2], 0, 0]}, ("color", 0, "uniform", 1), "less than or equal to 1; found 2"),
    ({"point": {"uniform": [[0, 0], [1, 1, 1]]}}, ("point", "uniform", 0, 2), "a value; found nothing"),
    ({"point": {"uniform": [0, 1]}}, ("point", "uniform", 0), "a list; found 0"),
    ({"point": {"normal": [[0, 0, 0], [1, 1]]}}, ("point",), "one for each of 3 components of the mean"),
]


@pytest.mark.parametrize(("fields", "where", "what"), REFUSED)
def test_what_could_be_drawn_beyond_the_limits_is_refused_where_it_stands(fields, where, what):
    with pytest.raises(ValidationError) as caught:
        Entry(**fields)
    (error,) = caught.value.errors()
    assert error["loc"] == where
    assert error["msg"].startswith("expected ") or " is unknown" in error["msg"]
    assert what in error["msg"]


def test_a_mistake_in_a_distribution_has_its_line(tmp_path):
    file = tmp_path / "recipe.yaml"
    file.write_text(
        "models: [{source: zoo:car}]\nviewpoints: {distance: 5}\nscene:\n  sun:\n    elevation:\n      uniform:\n"
        "        - 10\n        - 95\n  effects: {jpeg: {uniform: [0, 2]}}\n"
    )
    with pytest.raises(RecipeError) as caught:
        Recipe.load(file)
    assert str(caught.value).splitlines() == [
        f"{file}:8: scene.sun.elevation.uniform[1]: expected a number less than or equal to 90; found 95",
        f"{file}:9: scene.effects.jpeg.uniform[1]: expected a number less than or equal to 1; found 2",
    ]


def test_extended_recipes_replace_distributions_whole_and_keep_their_paths(tmp_path):
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "base.yaml").write_text(
        "models: [{source: zoo:car}]\nviewpoints: {distance: 5}\n"
        "scene:\n  sun: {strength: {uniform: [1, 2]}, elevation: [10, 20]}\n"
        "  sky: {choice: [a.exr, {hdri: {choice: [b.hdr, skies]}}, daylight]}\n  ground: {image: stone.png}\n"
    )
    own = tmp_path / "own.yaml"
    own.write_text("extends: lib/base.yaml\nscene: {sun: {strength: {choice: [3, 4]}}}\n")
    scene = assemble(own, {"scene.sun.angle_deg": [1, 2]})[0]["scene"]
    assert scene["sun"] == {"strength": {"choice": [3, 4]}, "elevation": [10, 20], "angle_deg": [1, 2]}
    assert scene["sky"] == {"choice": ["lib/a.exr", {"hdri": {"choice": ["lib/b.hdr", "lib/skies"]}}, "daylight"]}
    assert scene["ground"] == {"image": "lib/stone.png"}
    loaded = Recipe.load(own)
    assert Recipe.model_validate(loaded.model_dump(mode="json")).digest == loaded.digest
    assert Recipe.load(own, {"scene.sun.strength": 3}).digest != loaded.digest


def test_amounts_have_no_upper_limit():
    class Lamp(Frozen):
        strength: Drawn[Amount]

    assert drawn(Lamp(strength=[5e5, 1e6]), lambda path: np.random.default_rng(0)).strength > 5e5


def test_distributions_in_one_another_have_a_limit():
    value = 1.0
    for _ in range(16):
        value = {"choice": [value, 2.0]}
    assert drawn(Entry(free=value), lambda path: np.random.default_rng(len(path))).free in (1, 2)
    for _ in range(300):
        value = {"choice": [value, 2.0]}
    with pytest.raises(ValidationError, match="expected distributions nested at most 16 deep; found more"):
        Entry(free=value)
