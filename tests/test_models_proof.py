"""Whatever is changed in a model's files, another of them says so, although manifests are made to fit."""

import json
import shutil

import numpy as np
import pytest

from quick import quick
from sealing import seal_again
from small import small_recipe
from viewsphere import Dataset, generate
from viewsphere.check import check
from viewsphere.check.models import differing


@pytest.fixture(scope="module")
def textured(tmp_path_factory):
    """One frame of a model with textures."""
    out = tmp_path_factory.mktemp("models") / "out"
    models = [{"source": "zoo:hedge", "category": "hedge", "scale": {"length": 1.0}}]
    views = {"azimuth": [30], "elevation": [20], "distance": 9.0}
    generate(small_recipe(models=models, viewpoints=views, channels=["instances"], formats=[]), out)
    assert not list(differing(Dataset(out), []))
    return out


def changes(word):
    try:
        return [repr(float(word) * (1 + 1e-6) + 1e-6)]
    except ValueError:
        return [f"{word}x"]


def tampered_lines(text):
    """A text for each keyword and each of its words, in which this word of one line is another."""
    lines = text.split("\n")
    places = {line.split(" ")[0]: i for i, line in enumerate(lines) if line}
    for i in places.values():
        words = lines[i].split(" ")
        for k in range(len(words)):
            for other in changes(words[k]):
                yield "\n".join([*lines[:i], " ".join([*words[:k], other, *words[k + 1 :]]), *lines[i + 1 :]])


@pytest.mark.parametrize("suffix", quick([".obj", ".mtl"], ".mtl"))
@pytest.mark.slow
def test_every_word_of_a_text_is_compared_with_the_glb(textured, suffix):
    dataset = Dataset(textured)
    file = next((textured / "store" / "models").glob(f"*/*{suffix}"))
    whole, count = file.read_text(), 0
    for text in tampered_lines(whole):
        file.write_text(text)
        assert any(differing(dataset, [])), text
        count += 1
    file.write_text(whole)
    assert count > 10


def test_textures_and_geometry_are_compared(textured, tmp_path):
    root = shutil.copytree(textured, tmp_path / "out")
    picture = next((root / "store" / "models").glob("*/*.png"))
    whole = picture.read_bytes()
    picture.write_bytes(whole[:-30])
    seal_again(root)
    assert [finding.check for finding in check(Dataset(root), rays=False).findings] == ["models"]
    picture.write_bytes(whole)
    obj = next((root / "store" / "models").glob("*/*.obj"))
    rows = [line.split() for line in obj.read_text().splitlines()]
    stretched = [
        [word, x, y, repr(float(z) * 2), *rest] if word == "v" else [word, x, y, z, *rest]
        for word, x, y, z, *rest in (row if len(row) > 3 else [*row, *[""] * (4 - len(row))] for row in rows)
    ]
    obj.write_text("\n".join(" ".join(row).strip() for row in stretched) + "\n")
    seal_again(root)
    found = [finding.message for finding in check(Dataset(root), rays=False).findings]
    assert len(found) == 1 and "expected 'v " in found[0] and "of the GLB" in found[0]


def test_what_is_known_of_a_model_is_compared_with_its_glb(textured, tmp_path):
    file = next((textured / "store" / "models").glob("*/model.json"))
    whole = file.read_text()
    known = json.loads(whole)
    others = {
        "category": "tree", "supercategory": "plants", "category_id": 2, "obj": known["glb"], "parts": ["other"],
        "triangles": known["triangles"] + 1, "diameter": known["diameter"] * 1.01, "size": [1.0, 1.0, 1.0],
        "box3d_object": (np.array(known["box3d_object"]) * 1.01).tolist(),
    }  # fmt: skip
    for name, other in others.items():
        file.write_text(json.dumps({**known, name: other}))
        assert any(differing(Dataset(textured), [])), name
    file.write_text(whole)
    assert not list(differing(Dataset(textured), []))
