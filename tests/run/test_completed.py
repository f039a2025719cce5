"""Labels that a data set does not keep are computed for exports: they are those that it would have kept."""

import shutil

import numpy as np
import pytest

from viewsphere import Dataset, generate
from viewsphere.errors import StoreError, UserError
from viewsphere.formats import yolo
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.datasets.merging import merge
from viewsphere.run.exports.completed import Completed, lacking
from viewsphere.run.exports.exporting import export
from viewsphere.run.shots import reconstruct as sights
from viewsphere.store import Choice
from viewsphere.truth.raster.visibility import rasterize
from worlds import MODELS, rendered, shared_place, stills, videos

FEW = {"channels": ["rgb", "tracks"], "annotations": []}
LIGHT = [{**MODELS[1], "count": 2}, {**MODELS[2], "count": 2}]
SHORT = {"models": LIGHT, "scenes": {"count": 2, "objects": [2, 4], "layout": "scatter"}, "annotations": []}
"""Four pictures instead of twelve, of models that are drawn fast."""


@pytest.fixture(scope="module")
def few(tmp_path_factory):
    """The world of stills of which pictures alone are kept; do not change it."""
    out = tmp_path_factory.mktemp("stills") / "few"
    generate(stills(channels=["rgb"], annotations=[]), out)
    return out


@pytest.fixture(scope="module")
def few_moving(tmp_path_factory):
    """The world of videos in shots of two instants, of which pictures and tracks alone are kept; do not change it."""
    out = tmp_path_factory.mktemp("videos") / "few"
    generate(videos(**FEW, shot_frames=2), out)
    return out


@pytest.mark.slow
@pytest.mark.parametrize("world", ["stills", "videos"])
def test_what_is_computed_is_what_would_have_been_kept(world, request, tmp_path_factory):
    whole = Dataset(rendered(world, shared_place(tmp_path_factory)))
    kept = request.getfixturevalue("few" if world == "stills" else "few_moving")
    wanted = [name for name in whole.plan.channels if name not in ("rgb", "tracks")]
    asked = [name for name in whole.recipe["annotations"] if name not in ("captions",)]
    completed = Completed(kept, None, None, (*wanted, *asked), False)
    assert len(list(completed.shots())) > len(list(whole.shots())) or world == "stills"
    for ours, theirs in zip(completed, whole, strict=True):
        for name in wanted:
            np.testing.assert_array_equal(ours.channels[name], theirs.channels[name], err_msg=name)
        for one, other in zip(ours.objects, theirs.objects, strict=True):
            assert one.id == other.id and one.rle == other.rle
            for name in ("amodal", "occluders", "obb", "keypoints", "keypoint_states"):
                np.testing.assert_equal(getattr(one, name), getattr(other, name))
        if world == "videos":
            np.testing.assert_equal(ours.extra["camera_from_next"], theirs.extra["camera_from_next"])


def test_what_cannot_be_computed_is_told(tmp_path):
    generate(stills(channels=["depth"], **SHORT), tmp_path / "out")
    with pytest.raises(UserError, match="format yolo: expected channel rgb, found none: an engine has to paint it"):
        export(tmp_path / "out", "yolo")
    assert not (tmp_path / "out" / "yolo").exists()
    dataset = Dataset(tmp_path / "out")
    needing = yolo.FORMAT.model_copy(update={"channels": ("tracks",), "needs": None})
    with pytest.raises(UserError, match="expected label tracks, found none: add it to the recipe, and render"):
        lacking(dataset, needing, FormatEntry(name="yolo"))


@pytest.mark.slow
def test_exports_of_few_channels_are_those_of_many(few, tmp_path, tmp_path_factory):
    whole = Dataset(rendered("stills", shared_place(tmp_path_factory)))
    for root, place in ((whole.root, "whole"), (few, "computed")):
        export(root, [{"yolo": {"task": "pose"}}, "pointcloud"], output=tmp_path / place)
    pairs = [(file, tmp_path / "computed" / file.relative_to(tmp_path / "whole"))
             for file in (tmp_path / "whole").rglob("*.txt")]  # fmt: skip
    assert len(pairs) == len(whole)
    assert all(one.read_bytes() == other.read_bytes() for one, other in pairs)


@pytest.mark.slow
def test_a_choice_of_frames_is_computed_as_all_are(few, tmp_path):
    for choice, place in ((Choice(), "all"), (Choice(frames=((0, 2),)), "some"), (Choice(models=("car*",)), "cars")):
        export(few, [{"yolo": {"task": "obb"}}], output=tmp_path / place, choice=choice)
    labels = {place: {file.name: file.read_text() for file in (tmp_path / place).rglob("labels/**/*.txt")}
              for place in ("all", "some", "cars")}  # fmt: skip
    assert 0 < len(labels["some"]) < len(labels["all"]) == 8 and labels["cars"]
    assert all(text == labels["all"][name] for place in ("some", "cars") for name, text in labels[place].items())


@pytest.mark.slow
def test_parts_of_which_only_some_keep_a_label_are_completed(tmp_path):
    generate(stills(channels=["rgb"], **SHORT), tmp_path / "few")
    generate(stills(channels=["rgb", "depth"], **{**SHORT, "annotations": ["keypoints"]}, seed=4), tmp_path / "more")
    merge([tmp_path / "few", tmp_path / "more"], tmp_path / "both", mixed=True)
    merge([tmp_path / "more", tmp_path / "few"], tmp_path / "turned", mixed=True)
    for name in ("both", "turned"):
        export(tmp_path / name, [{"yolo": {"task": "pose"}}, "tum"], output=tmp_path / f"{name} out")
        shown = [file.read_text() for file in (tmp_path / f"{name} out" / "yolo" / "labels").rglob("*.txt")]
        assert len(shown) == 8
        assert all(" 2 " in text or " 1 " in text or text.rstrip().endswith((" 1", " 2")) for text in shown if text)
        assert len(list((tmp_path / f"{name} out" / "tum").rglob("depth/*.png"))) == 8


@pytest.mark.slow
def test_what_an_unfinished_neighbour_would_tell_is_asked_for(few_moving, tmp_path):
    dataset = Dataset(shutil.copytree(few_moving, tmp_path / "few"))
    second = [key for key, _ in dataset.shots()][1]
    shutil.rmtree(dataset.store.shot_folder(second))
    completed = Completed(tmp_path / "few", None, None, ("flow",), False)
    with pytest.raises(StoreError, match="beside it, with which labels compare it, found it unfinished: render the rest first"):
        _ = [sample.flow for sample in completed]
    export(tmp_path / "few", "pointcloud", output=tmp_path / "out")  # depth needs no other instant


@pytest.mark.slow
def test_formats_that_lack_the_same_see_each_frame_once(few, tmp_path, monkeypatch):
    seen = []
    monkeypatch.setattr(sights, "rasterize", lambda *arguments, **more: seen.append(1) or rasterize(*arguments, **more))
    export(few, ["pointcloud", "tum", "coco_panoptic"], output=tmp_path / "out")
    assert len(seen) == len(Dataset(few))
