"""Whose the models are: an entry's fields, a table beside the files, the zoo's own licence; and what is wrong with a table."""

import tomllib

import pytest

from small import ROOT
from viewsphere.errors import RecipeError
from viewsphere.model.credit import LONGEST_CREDIT, Credit
from viewsphere.planning.plan import plan
from viewsphere.recipe.recipe import Recipe

HEAD = "file,licence,attribution,source_url\n"


@pytest.fixture
def planned(tmp_path):
    """The plan of model entries, in a folder with a, b and c.obj and a table of these rows."""

    def planned(*entries, table=None):
        for name in "abc":
            (tmp_path / f"{name}.obj").write_text("x")
        if table is not None:
            (tmp_path / "credits.csv").write_bytes(table if isinstance(table, bytes) else table.encode())
        data = {"models": list(entries), "viewpoints": {"distance": 5}}
        return plan(Recipe.model_validate(data, context={"folder": tmp_path}))

    return planned


def entry(source="*.obj", **fields):
    return {"source": source, "category": "thing", **fields}


def test_a_name_counts_more_than_a_pattern_and_the_first_pattern_counts(planned):
    table = HEAD + '*.obj,CC-BY-4.0,"Maker, A.",https://example.org/x?a=1#b\n[bc].obj,MIT,,\nc.obj,CC0-1.0,,\n'
    found = planned(entry(), table=table).credits
    both = Credit(licence="CC-BY-4.0", attribution="Maker, A.", source_url="https://example.org/x?a=1#b")
    assert found == {"a": both, "b": both, "c": Credit(licence="CC0-1.0")}


def test_an_entry_counts_more_than_a_table(planned):
    found = planned(entry("a.obj", attribution="Me"), entry("b.obj"), table=HEAD + "*,MIT,They,\n").credits
    assert found == {"a": Credit(attribution="Me"), "b": Credit(licence="MIT", attribution="They")}


def test_the_zoo_has_the_project_s_licence_unless_its_entry_says_another(planned):
    own = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["license"]
    found = planned({"source": "zoo:chair"}, {"source": "zoo:car", "licence": "CC0-1.0"}).credits
    assert (found["chair_000"].licence, found["car_000"].licence) == (own, "CC0-1.0")


def test_the_plan_names_models_without_a_licence_in_one_line(planned):
    (note,) = planned(entry(), table=HEAD + "a.obj,MIT,,\nb.obj,,They,\n").notes
    assert note.startswith("2 models have no licence (b, c). Set `licence:`") and "\n" not in note
    assert planned(entry(licence="MIT")).notes == ()


def test_many_models_without_a_licence_are_counted(planned, tmp_path):
    for i in range(20):
        (tmp_path / f"m{i:02d}.obj").write_text("x")
    (note,) = planned(entry("m*.obj")).notes
    assert note.startswith("20 models have no licence (m00, m01, m02, m03, m04 and 15 more). ")


def test_credits_are_no_part_of_a_digest(planned):
    bare, said = planned(entry()), planned(entry(licence="MIT", attribution="They", source_url="https://example.org"))
    assert (bare.digest, bare.recipe.digest) == (said.digest, said.recipe.digest)
    assert bare.model_specs == said.model_specs
    assert said.recipe.to_yaml().count("https://example.org") == 1


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("", ":1: expected columns file, licence, attribution, source_url; found nothing"),
        ("file,licence\n", ":1: expected columns file, licence, attribution, source_url; found file, licence"),
        (HEAD + "a.obj,MIT,,\n\na.obj,MIT,,\n", ":4: file: expected the name of a file in this folder, or a pattern, once"),
        (HEAD + ",MIT,,\n", ":2: file: expected the name of a file in this folder"),
        (HEAD + "../x/a.obj,MIT,,\n", ":2: file: expected the name of a file in this folder"),
        (HEAD + "a.obj,MIT,Maker, A.,https://example.org\n", ":2: expected 4 cells, as the first line has; found more"),
        (
            HEAD + f"a.obj,{'x' * (LONGEST_CREDIT + 1)},,\n",
            ":2: licence: expected text that should have at most 1000 ",
        ),
        (HEAD + 'a.obj,MIT,"two\nlines",\n', ":3: attribution: expected one line of printable text"),
        (HEAD + "a.obj,MIT,bell\a!,\n", ":2: attribution: expected one line of printable text"),
        (HEAD + "a.obj,MIT,right\u202eleft,\n", ":2: attribution: expected one line of printable text"),
        (HEAD + "a.obj,MIT,,javascript:alert(1)\n", ":2: source_url: expected a URL that begins with https://"),
        (HEAD + "a.obj,MIT,,https://example.org/>|x\n", ":2: source_url: expected a URL that begins with https://"),
        (HEAD.encode() + b"a.obj,MIT,\xff,\n", ":2: expected a readable CSV file"),
        (HEAD + "a.obj,MIT," + "x" * 200_000 + ",\n", ":2: expected a readable CSV file"),
    ],
)
def test_a_bad_table_is_one_line_with_file_and_line(planned, tmp_path, table, message):
    with pytest.raises(RecipeError) as caught:
        planned(entry("a.obj"), table=table)
    assert str(caught.value).startswith(f"{tmp_path / 'credits.csv'}{message}") and "\n" not in str(caught.value)


def test_a_table_that_is_a_link_out_of_the_folder_is_refused(planned, tmp_path):
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "credits.csv").write_text(HEAD + "*,MIT,,\n")
    (tmp_path / "credits.csv").symlink_to(tmp_path / "other" / "credits.csv")
    with pytest.raises(RecipeError, match="found a link to"):
        planned(entry())
    assert planned(entry(confined=False)).credits["a"] == Credit(licence="MIT")


@pytest.mark.parametrize(
    ("field", "value"),
    [("licence", ""), ("licence", "a\nb"), ("attribution", "x" * (LONGEST_CREDIT + 1)), ("source_url", "x.org")],
)
def test_a_field_of_an_entry_has_the_same_limits(planned, field, value):
    with pytest.raises(RecipeError, match=rf"models\[0\]\.{field}: expected "):
        planned(entry(**{field: value}))
