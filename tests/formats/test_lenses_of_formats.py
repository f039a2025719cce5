"""The answer of every format to every lens: it holds the lens, or refuses it in one line before rendering."""

from __future__ import annotations

import json
import struct

import pytest

from lens_formats import CHANNELS, answer, answers
from lens_table import lenses
from small import ROOT, small_recipe
from viewsphere import Dataset, generate, plugins
from viewsphere.errors import UserError
from viewsphere.plugins.format import FormatSpec
from viewsphere.run.exports.exporting import export

FOCAL = 41.73919
MARKED = {"model": "double_sphere", "xi": -0.1237123, "alpha": 0.5671239}
"""Parameters whose numbers occur nowhere else."""
CAMERA = {"size": [64, 48], "focal_px": FOCAL, "distortion": MARKED}


def test_every_format_holds_every_lens_or_says_why_not():
    """For all lenses of the registry, with the cameras of their tests; docs/lens-proofs.md has the same answers."""
    found = dict(answers({words: camera for _, words, camera in lenses()}))
    assert found.keys() == set(plugins.names("formats")) - {"tapvid"}  # which needs points to track
    for name, told in found.items():
        for reason in filter(None, told.values()):
            assert reason.startswith(f"formats: format {name}: expected ") and "; found" in reason and "\n" not in reason
        assert told["pinhole"] is None
    assert all(reason is None for name in ("native", "coco", "hdf5", "huggingface") for reason in found[name].values())
    assert all(found[name]["fisheye (Kannala and Brandt)"] for name in ("bop", "tum"))
    assert json.loads((ROOT / "docs" / "lenses.json").read_text("utf-8"))["formats"] == found


def encodings(value: float) -> tuple[bytes, ...]:
    return repr(value).encode(), struct.pack("<d", value), struct.pack("<f", value), struct.pack(">d", value)


def leaves_it_out(name: str) -> bool:
    """Return whether the format's page says that it does not store the distortion."""
    told = " ".join((plugins.load(FormatSpec, name).about or "").split())
    return "Not stored:" in told and "the lens' distortion" in told


@pytest.mark.slow
def test_a_format_that_writes_the_focal_length_writes_the_lens_too(tmp_path):
    """Of every format that takes the lens: a tree with the focal length has the lens's numbers too, or the page says not."""
    views = {"azimuth": [0, 90], "distance": 1.0}
    generate(small_recipe(camera=CAMERA, formats=[], channels=list(CHANNELS), viewpoints=views), tmp_path / "out", workers=0)
    written, lacking = set(), set()
    for name in (name for name in plugins.names("formats") if answer(name, CAMERA, {}) is None):
        try:
            export(tmp_path / "out", [name], output=tmp_path / "made" / name)
        except UserError:
            continue  # it needs a program or a package that is not here
        data = b"".join(file.read_bytes() for file in (tmp_path / "made" / name).rglob("*") if file.is_file())
        if any(code in data for code in encodings(FOCAL)):
            written.add(name)
            if not all(any(code in data for code in encodings(MARKED[key])) for key in ("xi", "alpha")):
                lacking.add(name)
    assert {"native", "coco"} <= written
    assert lacking == {name for name in lacking if leaves_it_out(name)}
    assert Dataset(tmp_path / "out")[0].camera.distortion.xi == MARKED["xi"]
