"""The table of lenses: it has every lens, its caster agrees with labels, and it notices labels that are changed."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import numpy as np
import pytest

from lens_table import Row, allowed, compare, formula_of, lenses, recipe
from sealing import seal_again
from small import ROOT
from viewsphere import Dataset, generate, plugins
from viewsphere.labels import channels
from viewsphere.plugins.lens import LensSpec
from viewsphere.store import encode

FILE = ROOT / "docs" / "lenses.json"
CAMERAS = {words: (name, camera) for name, words, camera in lenses()}


def test_every_lens_of_the_registry_has_its_rows_and_none_is_wrong():
    rows = json.loads(FILE.read_text("utf-8"))["rows"]
    assert {row["words"]: row["lens"] for row in rows} == {words: name for words, (name, _) in CAMERAS.items()}
    specs = plugins.loadable(LensSpec)
    own = {name for name in specs if not specs[name].is_scan and not plugins.is_third_party("lenses", name)}
    assert {row["lens"] for row in rows} == own
    assert all(cell["wrong"] == 0 for row in rows for cell in row["cells"].values())
    assert all(row["cells"]["projection"]["error"] <= 1e-9 for row in rows)
    assert all(row["cells"].keys() - row["refused"].keys() >= {"instances", "depth_ray", "flow", "box2d"} for row in rows)


@pytest.fixture(scope="module")
def household():
    """Folders of a scene through lenses, by their words."""
    pytest.importorskip("embreex")
    with tempfile.TemporaryDirectory() as place:
        folders = {}

        def through(words):
            if words not in folders:
                folders[words] = Path(place) / str(len(folders))
                channels, _, rig = allowed(CAMERAS[words][1])
                generate(recipe("household", CAMERAS[words][1], channels, rig), folders[words], workers=0)
            return folders[words]

        yield through


def cells(folder, words):
    name, _ = CAMERAS[words]
    row = Row(words, name)
    compare(row, formula_of(name), Dataset(folder), "household", {})
    return row.cells


@pytest.mark.slow
@pytest.mark.parametrize("words", ["fisheye (Kannala and Brandt)", "equirectangular", "orthographic", "double sphere"])
def test_the_caster_agrees(household, words):
    found = cells(household(words), words)
    assert {name: cell.wrong for name, cell in found.items() if cell.wrong} == {}
    assert found["instances"].compared > 20_000 and found["instances"].ties < 20
    assert found["projection"].error <= 1e-9 and found["keypoints"].compared > 50


def turn(array):
    array[..., 0] = -array[..., 0]


def farther(array):
    array *= np.float32(1.0001)


TAMPERINGS = {
    "instances": lambda array: np.copyto(array[60:62], 1),
    "semantic": lambda array: np.copyto(array[60:62], 3),
    "depth_ray": farther,
    "depth": farther,
    "position": farther,
    "coordinates": farther,
    "nocs": turn,
    "barycentrics": turn,
    "normals": turn,
    "normals_geometric": turn,
    "flow": turn,
}


@pytest.mark.slow
@pytest.mark.parametrize("name", TAMPERINGS)
def test_a_changed_channel_is_noticed(household, name):
    dataset = Dataset(household("double sphere"))
    file = dataset.path(dataset[0].files[name])
    kept, array = file.read_bytes(), np.array(dataset[0].channels[name])
    try:
        TAMPERINGS[name](array)
        file.write_bytes(encode(channels()[name], array))
        seal_again(dataset.root)
        found = cells(dataset.root, "double sphere")
        of = "instances" if name in ("semantic", "depth_ray") else name
        assert found[of].wrong > 100, {label: cell.wrong for label, cell in found.items()}
    finally:
        file.write_bytes(kept)
        seal_again(dataset.root)


@pytest.mark.slow
def test_a_lens_off_by_a_millionth_of_its_coefficients_is_noticed(household, monkeypatch):
    """The projection's bar of 1e-9 px notices it, and so do keypoints."""
    import lens_table

    words = "fisheye (Kannala and Brandt)"
    optics = lens_table.optics

    def off(name, intrinsics):
        own = intrinsics.distortion
        changed = own.model_copy(update={"coefficients": tuple(1.000001 * k for k in own.coefficients)})
        return optics(name, intrinsics.model_copy(update={"distortion": changed}))

    monkeypatch.setattr(lens_table, "optics", off)
    found = cells(household(words), words)
    assert found["projection"].wrong > 100 and found["keypoints"].wrong > 10
