"""The documentation site: every page is in its contents, its links are checked, and its pictures say what the code says."""

import importlib
import re
import sys

import numpy as np
import pytest
import yaml

from small import ROOT
from viewsphere import errors

sys.path.insert(0, str(ROOT / "scripts"))
figures, site_links = importlib.import_module("figures"), importlib.import_module("site_links")

PLAN = yaml.safe_load((ROOT / "mkdocs.yml").read_text("utf-8"))


def pages(entries):
    for entry in entries:
        (found,) = entry.values()
        yield from [found] if isinstance(found, str) else pages(found)


def test_every_page_is_in_the_contents_once():
    listed = list(pages(PLAN["nav"]))
    assert len(listed) == len(set(listed))
    assert set(listed) == {page.relative_to(ROOT / "docs").as_posix() for page in (ROOT / "docs").rglob("*.md")}


def test_the_site_takes_nothing_from_the_network():
    assert PLAN["theme"]["font"] is False
    for page in (ROOT / "docs").rglob("*.md"):
        assert not re.search(r"!\[[^]]*\]\(https?:", page.read_text("utf-8")), page


def test_the_reference_tells_all_errors_and_nothing_else_of_their_module():
    told = yaml.safe_load((ROOT / "docs" / "reference.md").read_text("utf-8").split("::: viewsphere.errors\n")[1])["options"]
    raised = [name for name, kind in vars(errors).items() if isinstance(kind, type) and issubclass(kind, Exception)]
    assert told["members"] == raised


def test_6d_pose_in_camera_is_found_in_the_reference():
    text = (ROOT / "docs" / "reference.md").read_text("utf-8")
    assert "6D pose in camera: `camera_from_object`" in text


def test_the_reference_has_every_public_name():
    import viewsphere as vs

    told = re.findall(r"^::: ([\w.]+)$", (ROOT / "docs" / "reference.md").read_text("utf-8"), re.MULTILINE)
    homes = {module_and_name(name) for name in told}
    public = {name for name in vs.__all__ if callable(getattr(vs, name))}
    assert {id(getattr(vs, name)) for name in public} <= {id(found) for found in homes}


def module_and_name(path):
    try:
        return importlib.import_module(path)
    except ModuleNotFoundError:
        module, _, name = path.rpartition(".")
        return getattr(importlib.import_module(module), name)


@pytest.mark.parametrize(
    ("link", "found"),
    [
        ("b.html", None),
        ("b.html#here", None),
        ("#top", None),
        ("https://example.org/no", None),
        ("c.html", "expected a file"),
        ("b.html#there", "expected the anchor #there"),
        ("#bottom", "expected the anchor #bottom"),
    ],
)
def test_links_that_lead_nowhere_are_found(tmp_path, link, found):
    (tmp_path / "a.html").write_text(f'<h1 id="top">A</h1><a href="{link}">b</a>')
    (tmp_path / "b.html").write_text('<h1 id="here">B</h1>')
    told = list(site_links.broken(tmp_path))
    assert len(told) == (found is not None) and all(found in line for line in told)


def test_a_site_without_pages_is_no_success(tmp_path):
    assert list(site_links.broken(tmp_path))


def test_the_front_is_drawn_in_front():
    """The picture names the face whose vertices have the least y, and the camera that is drawn looks at the origin."""
    assert set(figures.FRONT) == {i for i, vertex in enumerate(figures.BOX) if vertex[1] < 0}
    a, e = np.radians((60, 32))
    centre = np.array([np.cos(e) * np.sin(a), -np.cos(e) * np.cos(a), np.sin(e)])
    assert np.allclose(figures.rotation(60, 32) @ -centre, [0, 0, 1])
