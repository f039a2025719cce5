"""body_parts: which bone's part is seen; where bones are, there are their parts; its proof notices others."""

import json

import numpy as np
import pytest

import viewsphere as vs
from label_scenes import changed, proof
from proven import equal
from rigged import BODY, arm, person, write_gltf
from sealing import seal_again
from viewsphere.check import check
from viewsphere.labels import channel_labels
from viewsphere.store import Dataset

NAMES = ["depth", "instances", "triangles", "coordinates", "body_parts"]


def recipe(file, **changes):
    said = {
        "models": [{"source": str(file), "category": "person", "centring": "as_is"}],
        "viewpoints": {"azimuth": [10, 130], "elevation": 15, "distance": 4},
        "camera": {"size": [120, 120], "fov_deg": 40},
        "channels": NAMES,
        "annotations": ["keypoints"],
        "splits": {"by": "frame", "train": 1},
        "formats": [],
    }
    return vs.Recipe.model_validate({**said, **changes})


@pytest.fixture(scope="module")
def people(tmp_path_factory):
    folder = tmp_path_factory.mktemp("people")
    vs.generate(recipe(write_gltf(person(), folder / "person.gltf")), folder / "out")
    return Dataset(folder / "out")


def test_an_arm_has_its_parts_above_and_below_its_joint(tmp_path):
    models = [{"source": str(write_gltf(arm(), tmp_path / "arm.gltf")), "category": "arm", "centring": "as_is"}]
    for sample in vs.render(recipe("", models=models)):
        seen, height = sample.instances > 0, sample.coordinates[..., 2]
        clear = seen & (np.abs(height - 1) > 1e-5)
        assert (sample.body_parts[clear & (height > 1)] == 2).sum() > 200
        equal("body_parts", "an arm's closed form", sample.body_parts[clear], 1 + (height[clear] > 1))
        assert (sample.body_parts[~seen] == 0).all()


def test_each_part_is_seen_around_its_own_bone(people):
    """Of what is seen of a part, nothing is nearer to the bones that are not next to it than to its own."""
    (info,) = people.models
    assert info.body_parts == tuple(BODY) == tuple(info.keypoints.points)
    ends = {name: np.array([(x, -z, y) for x, y, z in (start, end)]) for name, (_, start, end, _) in BODY.items()}
    for sample in people:
        (o,) = sample.objects
        np.testing.assert_allclose([*info.keypoints.points.values()], [ends[name][0] for name in BODY], atol=1e-4)
        points = sample.coordinates[sample.body_parts > 0].astype(np.float64)
        away = np.stack([distance(points, *ends[name]) for name in BODY])
        part = sample.body_parts[sample.body_parts > 0] - 1
        assert len(np.unique(part)) > 12
        nearest = away.argmin(axis=0)
        near = [{name, BODY[name][0], *(other for other in BODY if BODY[other][0] == name)} for name in BODY]
        assert all([*BODY][n] in near[p] for p, n in zip(part.tolist(), nearest.tolist(), strict=True))
        assert (nearest == part).mean() > 0.85
        for name, pixel, state in zip(o.keypoint_names, o.keypoints, o.keypoint_states, strict=True):
            if state == 0 and name.startswith(("shin", "forearm")):
                x, y = pixel.astype(int)
                assert {[*BODY][p - 1] for p in np.unique(sample.body_parts[y - 1 : y + 2, x - 1 : x + 2]) if p} & near[
                    [*BODY].index(name)
                ]


def distance(points, start, end):
    """Of points (N, 3) from a line between two."""
    along = end - start
    share = np.clip((points - start) @ along / (along @ along), 0, 1)
    return np.linalg.norm(points - start - share[:, None] * along, axis=1)


def test_it_is_kept_and_proved(people):
    report = check(people)
    assert report.ok, report.findings
    assert report.checked["body_parts"] == len(people) == 2


def test_its_proof_notices_others(people):
    sample, models = people[0], {info.key: info for info in people.models}
    assert list(channel_labels()["body_parts"].prove(sample, models)) == []
    on, off = tuple(np.argwhere(sample.body_parts > 0)[40]), tuple(np.argwhere(sample.instances == 0)[0])
    for place, value, message in (
        (on, 99, "body parts 0 to 16 of"),
        (off, 1, "where an object is seen"),
        (on, -1, "others at"),
    ):
        other = changed(sample, "body_parts", lambda a, place=place, value=value: a.__setitem__(place, value))
        assert any(message in found for found in channel_labels()["body_parts"].prove(other, models))
    pairs = sample.triangles[sample.body_parts > 0]
    often = np.argwhere((sample.triangles == np.bincount(pairs).argmax()) & (sample.body_parts > 0))
    split = changed(sample, "body_parts", lambda a: a.__setitem__(tuple(often[0]), a[tuple(often[0])] % 16 + 1))
    assert any("one body part in each triangle" in found for found in proof(channel_labels()["body_parts"], split))


def test_other_names_are_noticed(people, tmp_path):
    import shutil

    shutil.copytree(people.root, tmp_path / "out")
    dataset = Dataset(tmp_path / "out")
    folder = dataset.store.model_folder(dataset.models[0].key)
    said = json.loads((folder / "model.json").read_text())
    said["body_parts"][0] = "tail"
    (folder / "model.json").write_text(json.dumps(said))
    seal_again(dataset.root)
    findings = [finding.message for finding in check(Dataset(dataset.root), rays=False).findings]
    assert any("expected the parts of a body hips, chest" in message for message in findings), findings
