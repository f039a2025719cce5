"""Folders and patterns of `source`: a limit on what they walk, and names that are no text."""

import os

import pytest

from viewsphere import plan
from viewsphere.composing.scene.entries_walked import below, matching
from viewsphere.errors import RecipeError, UserError
from viewsphere.recipe.recipe import Recipe
from viewsphere.urls import located


@pytest.fixture
def tree(tmp_path):
    """Three folders of three files each."""
    for folder in "abc":
        for name in "123":
            file = tmp_path / folder / f"{name}.obj"
            file.parent.mkdir(exist_ok=True)
            file.write_text("")
    return tmp_path


@pytest.mark.parametrize(
    ("pattern", "count", "walked"), [("**/*.obj", 9, 12), ("a/*.obj", 3, 3), ("*", 3, 3), ("*/1.obj", 3, 12)]
)
def test_a_pattern_walks_up_to_its_limit(tree, monkeypatch, pattern, count, walked):
    monkeypatch.setenv("VIEWSPHERE_MAX_ENTRIES", str(walked))
    assert len(matching(tree, pattern, "models[0]")) == count
    assert len(matching(tree.parent, f"{tree}/{pattern}", "models[0]")) == count
    if walked > 1:
        monkeypatch.setenv("VIEWSPHERE_MAX_ENTRIES", str(walked - 1))
        with pytest.raises(RecipeError, match=r"models\[0\]\.source: .* hold more than .*MAX_ENTRIES.*nearer"):
            matching(tree, pattern, "models[0]")


def test_a_folder_walks_up_to_its_limit(tree, monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_MAX_ENTRIES", "12")
    assert len(below(tree, "models[0]")) == 12
    monkeypatch.setenv("VIEWSPHERE_MAX_ENTRIES", "11")
    with pytest.raises(RecipeError, match="MAX_ENTRIES"):
        below(tree, "models[0]")


def test_links_in_a_circle_end(tree, monkeypatch):
    (tree / "a" / "up").symlink_to(tree)
    (tree / "b" / "up").symlink_to(tree)
    monkeypatch.setenv("VIEWSPHERE_MAX_ENTRIES", "1000")
    with pytest.raises(RecipeError, match="MAX_ENTRIES"):
        matching(tree, "**/*.obj", "models[0]")


@pytest.mark.skipif(os.name == "nt", reason="names are text there")
@pytest.mark.parametrize("source", [".", "*.obj"])
def test_a_name_that_is_no_text_is_refused_in_one_line(tmp_path, source):
    (tmp_path / os.fsdecode(b"notes\xff.txt")).write_text("")
    (tmp_path / os.fsdecode(b"a\xff\n.obj")).write_text("v 0 0 0\n")
    (tmp_path / "recipe.yaml").write_text(
        f"models: [{{source: '{source}', category: x}}]\nviewpoints: {{azimuth: [0], elevation: [10], distance: 5}}\n"
    )
    with pytest.raises(RecipeError, match=r"models\[0\]\.source: the name .*a\\udcff\\n\.obj is not UTF-8\. Rename") as caught:
        plan(Recipe.load(tmp_path / "recipe.yaml"))
    assert str(caught.value).isprintable()


@pytest.mark.skipif(os.name == "nt", reason="names are text there")
def test_an_output_folder_whose_name_is_no_text_is_refused(tmp_path):
    with pytest.raises(UserError, match=r"a\\udcff is not UTF-8\. Choose another name"):
        located(tmp_path / os.fsdecode(b"a\xff"))
