"""faces: as_file from the file to the picture, the labels and their proofs."""

import numpy as np
import pytest

import viewsphere as vs
from single_sided_gltf import TURNED, gltf
from viewsphere.check import check
from viewsphere.store import Dataset


def recipe(folder, faces, **changes):
    return vs.Recipe.model_validate(
        {
            "models": [{"source": str(folder / "m.gltf"), "category": "plate", "faces": faces}],
            "viewpoints": {"azimuth": [0, 50, 180], "elevation": 15, "distance": 8},
            "camera": {"size": [60, 48], "fov_deg": 40},
            "channels": ["rgb", "depth", "instances", "normals"],
            "annotations": ["amodal"],
            "splits": {"by": "frame", "train": 1},
            "formats": [],
            **changes,
        }
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A red square before a green one, of which each turns its back to the other."""
    made = tmp_path_factory.mktemp("faces")
    (made / "m.gltf").write_text(gltf([(0, {"translation": [0, 0, 1]} | TURNED), (1, {})]))
    return made


@pytest.fixture(scope="module")
def rendered(folder):
    for faces in ("as_file", "both"):
        vs.generate(recipe(folder, faces), folder / faces)
    return {faces: Dataset(folder / faces) for faces in ("as_file", "both")}


def hue(sample):
    """The channel of the largest mean over the object."""
    return int(sample.rgb[sample.objects[0].mask].mean(axis=0).argmax())


def test_the_first_front_along_the_ray_is_painted(rendered):
    single, both = rendered["as_file"], rendered["both"]
    assert [hue(sample) for sample in single] == [1, 1, 0]
    assert [hue(sample) for sample in both] == [0, 0, 1]


@pytest.mark.slow
def test_proofs_hold(rendered):
    for dataset in rendered.values():
        report = check(dataset)
        assert report.ok, report.findings
        assert report.checked["surface"] == 3


@pytest.mark.slow
def test_a_record_that_denies_the_option_is_found(folder):
    out = folder / "denied"
    vs.generate(recipe(folder, "as_file"), out)
    for file in out.rglob("model.json"):
        text = file.read_text()
        file.write_text(text.replace('"as_file"', "null"))
        assert file.read_text() != text
    findings = {finding.check for finding in check(Dataset(out)).findings}
    assert findings >= {"mask", "surface"}


def test_backs_cast_shadows(folder):
    """Only pixels of the object differ: the ground has the same shadows."""
    said = {"scene": {"ground": {"color": [0.5, 0.5, 0.5]}}, "viewpoints": {"azimuth": 0, "elevation": 30, "distance": 8}}
    single, both = (next(iter(vs.render(recipe(folder, faces, **said)))) for faces in ("as_file", "both"))
    shadow = ~both.objects[0].mask & ~single.objects[0].mask
    rim = np.zeros_like(shadow)
    rim[1:-1, 1:-1] = shadow[1:-1, 1:-1] & shadow[:-2, 1:-1] & shadow[2:, 1:-1] & shadow[1:-1, :-2] & shadow[1:-1, 2:]
    np.testing.assert_array_equal(single.rgb[rim], both.rgb[rim])
    light = both.rgb[rim].astype(int).sum(axis=1)
    assert light.min() < 0.7 * np.median(light), "expected a shadow in the picture"


@pytest.mark.parametrize(("scale", "seen"), [([-1, 1, 1], True), ([1, -1, 1], True), ([1, 1, -1], False), ([-1, -1, 1], True)])
def test_a_mirrored_node_keeps_its_front(tmp_path, scale, seen):
    """A front that faces +z still does after a mirroring in x or y; after one in z it faces -z."""
    (tmp_path / "m.gltf").write_text(gltf([(1, {"scale": scale}), (2, {"translation": [0, 0, -3], "scale": [2, 2, 1]})]))
    sample = next(iter(vs.render(recipe(tmp_path, "as_file", viewpoints={"azimuth": 0, "elevation": 0, "distance": 12}))))
    assert hue(sample) == 2
    green = sample.rgb[..., 1].astype(int) > sample.rgb[..., 2].astype(int) + 40
    assert (green & sample.objects[0].mask).any() == seen


def test_the_default_leaves_digests_as_they_were(folder):
    assert recipe(folder, None).digest != recipe(folder, "as_file").digest
    assert "faces" not in vs.plan(recipe(folder, None)).model_specs[0].model_dump(mode="json")
