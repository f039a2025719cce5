"""scripts/structure: the places that count for each of its figures, in a small package."""

import sys

import pytest

from small import ROOT

sys.path.insert(0, str(ROOT / "scripts"))
import structure

PYPROJECT = """[[tool.importlinter.contracts]]
type = "layers"
layers = ["upper", "lower"]
"""
FILES = {
    "upper.py": "def shown():\n    from viewsphere import lower\n    return lower\n",
    "lower.py": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from .upper import shown\nclass Public:\n    pass\n",
    "short.py": "from viewsphere.upper import shown\n_PRIVATE = 1\ndef _private():\n    pass\n",
    "labels/plugin.py": "from viewsphere.short import _PRIVATE\n",
    "long.py": "import viewsphere.labels.plugin\ndef long():\n" + 60 * "    pass\n",
    "kernels_long.py": "def long():\n" + 60 * "    pass\n",
}


@pytest.fixture
def places(tmp_path, monkeypatch):
    (tmp_path / "pyproject.toml").write_text(PYPROJECT)
    for name, text in FILES.items():
        path = tmp_path / "src/viewsphere" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    for folder, count in {"full": 16, "formats": 16, "fits": 15}.items():
        (tmp_path / "src/viewsphere" / folder).mkdir()
        for number in range(count):
            (tmp_path / "src/viewsphere" / folder / f"{number}.txt").touch()
    monkeypatch.setattr(structure, "ROOT", tmp_path)
    return [*structure.figures().values()]


def test_each_figure_names_its_places(places):
    full, small, public, cycles, upward, long = places
    assert full == ["src/viewsphere/full: 16 files"]
    assert small == [
        "viewsphere.lower: 5 lines, imported by viewsphere.upper",
        "viewsphere.short: 4 lines, imported by viewsphere.labels.plugin",
    ]
    assert public == [
        "viewsphere.kernels_long.long",
        "viewsphere.long.long",
        "viewsphere.lower.Public",
        "viewsphere.upper.shown",
    ]
    assert cycles == ["viewsphere.lower, in a cycle of 2", "viewsphere.upper, in a cycle of 2"]
    assert upward == ["viewsphere.lower imports viewsphere.upper"]
    assert long == ["viewsphere.long.long: 61 lines"]
