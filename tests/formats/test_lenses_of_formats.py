"""The answer of every format to every lens: it holds the lens, or refuses it in one line before rendering."""

from __future__ import annotations

import importlib.util
import struct
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from lens_proofs import LensProofs
from small import small_recipe
from viewsphere import Dataset, generate, plan, plugins
from viewsphere.errors import UserError
from viewsphere.plugins.format import FormatSpec
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.exports.exporting import export
from viewsphere.run.opening import check_formats

FOCAL = 41.73919
CHANNELS = ["rgb", "depth", "instances", "normals"]
TESTS = sorted((Path(__file__).parents[1] / "geometry" / "lenses").glob("test_*.py"))
MARKED = {"model": "double_sphere", "xi": -0.1237123, "alpha": 0.5671239}
"""Parameters whose numbers occur nowhere else."""


def parameters(file: Path) -> dict | None:
    """Parameters of the lens that a test proves, None for a test of something else."""
    spec = importlib.util.spec_from_file_location(f"{file.stem}_lens", file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    proofs = [v for v in vars(module).values() if isinstance(v, type) and issubclass(v, LensProofs) and v is not LensProofs]
    return proofs[0].parameters(np.random.default_rng(1)).model_dump(mode="json") if proofs else None


def recipe(distortion):
    camera = {"size": [64, 48], "focal_px": FOCAL, "distortion": distortion}
    return small_recipe(camera=camera, formats=[], channels=CHANNELS, viewpoints={"azimuth": [0, 90], "distance": 1.0})


def answers(distortion) -> dict[str, str | None]:
    planned = plan(recipe(distortion))
    found: dict[str, str | None] = {}
    for name in plugins.names("formats"):
        try:
            check_formats(planned, [FormatEntry(name=name)], CHANNELS)
            found[name] = None
        except UserError as error:
            found[name] = str(error)
    return found


@cache
def of_a_pinhole() -> dict[str, str | None]:
    return answers(None)


@pytest.mark.parametrize("file", TESTS, ids=lambda file: file.stem.removeprefix("test_"))
def test_a_format_that_takes_a_pinhole_takes_the_lens_or_says_why_not(file):
    own = parameters(file)
    if own is None:
        pytest.skip("a test of something else")
    plain, bent = of_a_pinhole(), answers(own)
    refused = {name: bent[name] for name in bent if plain[name] is None and bent[name] is not None}
    for name, told in refused.items():
        assert told.startswith(f"formats: format {name}: expected ") and "lens" in told and "\n" not in told
    assert {"bop", "tum"} <= refused.keys() and not refused.keys() & {"native", "coco", "hdf5", "huggingface"}
    assert plain.keys() == bent.keys() and any(answer is None for answer in plain.values())


def encodings(value: float) -> tuple[bytes, ...]:
    return repr(value).encode(), struct.pack("<d", value), struct.pack("<f", value), struct.pack(">d", value)


def leaves_it_out(name: str) -> bool:
    """Return whether the format's page says that it does not store the distortion."""
    told = " ".join((plugins.load(FormatSpec, name).about or "").split())
    return "Not stored:" in told and "the lens' distortion" in told


@pytest.mark.slow
def test_a_format_that_writes_the_focal_length_writes_the_lens_too(tmp_path):
    """Of every format that takes the lens: a tree with the focal length has the lens's numbers too, or the page says not."""
    generate(recipe(MARKED), tmp_path / "out", workers=0)
    written, lacking = set(), set()
    for name in (name for name, answer in answers(MARKED).items() if answer is None):
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
