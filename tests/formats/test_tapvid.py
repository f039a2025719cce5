"""TAP-Vid and TAPVid-3D, read by pickle and NumPy alone, scored by their evaluation: the data set's own tracks."""

from __future__ import annotations

import ast
import hashlib
import io
import os
import pickle
import subprocess
import sys
import zipfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Optional

import numpy as np
import pytest
from PIL import Image
from tapvid_metrics import PIXELS, evaluated, queries_first, queries_strided, scores

from proven import close, equal
from viewsphere.errors import UserError
from viewsphere.formats import tapvid
from viewsphere.formats.tapvid import archive, pickled
from viewsphere.run.exports.exporting import export
from viewsphere.run.exports.scope import scope_of
from viewsphere.store import Choice, Dataset

TAPNET = "VIEWSPHERE_TAPNET"
"""Names a checkout of https://github.com/google-deepmind/tapnet, whose evaluation is in no package."""

SIDE = 256
"""Pixels of the pictures in which trackers are judged."""


@pytest.fixture(scope="module")
def written(videos, tmp_path_factory):
    place = {}
    for kind in ("tapvid", "tapvid3d"):
        folder = tmp_path_factory.mktemp(kind)
        export(videos.root, [{"tapvid": {"kind": kind}}], output=folder)
        place[kind] = folder / "tapvid"
    return place


@pytest.fixture(scope="module")
def followed(videos):
    """The tracks, and the samples, of each sensor of each sequence, by the names of their files."""
    return {
        f"{videos.sequence(name, sensor)[0].split}/{name}_{sensor}": (
            videos.tracks(name, sensor),
            videos.sequence(name, sensor),
        )
        for name in videos.sequences
        for sensor in ("left", "right")
    }


def read(folder, name):
    found = pickle.loads((folder / f"{name}.pkl").read_bytes())
    assert list(found) == [name.rpartition("/")[2]]
    return found[name.rpartition("/")[2]]


def test_a_file_for_each_video(written, followed):
    for kind, end in (("tapvid", "pkl"), ("tapvid3d", "npz")):
        found = {path.relative_to(written[kind]).as_posix() for path in written[kind].rglob("*.*") if path.suffix != ".json"}
        assert found >= {f"{name}.{end}" for name in followed}


def test_videos_and_points(written, followed):
    hidden = 0
    for name, (tracks, samples) in followed.items():
        found, size = read(written["tapvid"], name), (samples[0].width, samples[0].height)
        assert {key: value.dtype for key, value in found.items()} == {"video": "u1", "points": "f4", "occluded": "?"}
        equal("tapvid", "pickle: video", found["video"], np.stack([sample.rgb for sample in samples]))
        equal("tapvid", "pickle: occluded", found["occluded"], tracks.state.T != 0)
        has = np.isfinite(tracks.xy).all(axis=-1).T
        close("tapvid", "pickle: points", (found["points"] * size)[has], tracks.xy.transpose(1, 0, 2)[has], "px", atol=2e-5)
        assert not found["points"][~has].any()
        found["points"] *= np.array(size)  # as readers do, in place
        hidden += found["occluded"].sum()
    assert hidden > 100


def test_points_are_where_they_are_seen(written, followed):
    """A visible point's object is the one that its pixel shows."""
    checked = 0
    for name, (tracks, samples) in followed.items():
        found, size = read(written["tapvid"], name), (samples[0].width, samples[0].height)
        for t, sample in enumerate(samples):
            x, y = np.floor(found["points"][~found["occluded"][:, t], t] * size).astype(int).T
            inside = np.isin(sample.instances[y, x], [0, *(o.id for o in sample.objects)])
            same = sample.instances[y, x] == tracks.object[~found["occluded"][:, t]]
            assert inside.all() and same.mean() > 0.9  # a pixel's centre and a point in it may differ at edges
            checked += len(x)
    assert checked > 500


@pytest.mark.parametrize("mode", ["first", "strided"])
def test_tracks_score_one_and_others_less(written, followed, mode):
    for name in followed:
        found = read(written["tapvid"], name)
        asked = (queries_first if mode == "first" else queries_strided)(found["occluded"])
        points, seen = (value[[n for n, _ in asked]] for value in (found["points"] * SIDE, ~found["occluded"]))
        counts = evaluated(asked, seen.shape[1], mode)
        ours = scores(points, seen, points, seen, counts, PIXELS)
        assert ours == dict.fromkeys(ours, 1.0)
        others = scores(points, seen, points + 3, ~seen, counts, PIXELS)  # off by 3 pixels both ways: within 8 and 16
        assert others["occlusion_accuracy"] == others["average_jaccard"] == 0
        assert others["average_pts_within_thresh"] == 2 / 5


def public(name, wanted, **more):
    """Functions of tapnet's own evaluation, without the packages that its modules ask for."""
    folder = os.environ.get(TAPNET, "")
    files = sorted(Path(folder).rglob(name)) if folder else []
    if not files:
        pytest.skip(f"needs a checkout of tapnet, named by ${TAPNET}")
    tree = ast.parse(files[0].read_text("utf-8"))
    tree.body = [node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name in wanted]
    found = {"np": np, "Mapping": Mapping, "Optional": Optional, **more}
    exec(compile(tree, str(files[0]), "exec"), found)
    return found


@pytest.mark.parametrize("mode", ["first", "strided"])
def test_tracks_score_one_in_tapnet(written, followed, mode):
    names = {"compute_tapvid_metrics", "sample_queries_first", "sample_queries_strided"}
    own = public("tapvid/evaluation_datasets.py", names)
    for name, (tracks, samples) in followed.items():
        found = read(written["tapvid"], name)
        frames, scaled = found["video"] / 255.0 * 2 - 1, found["points"] * np.float32(SIDE)
        asked = own[f"sample_queries_{mode}"](found["occluded"], scaled, frames)
        targets, hidden = asked["target_points"], asked["occluded"]
        result = own["compute_tapvid_metrics"](asked["query_points"], hidden, targets, hidden, targets, mode)
        close("tapvid", f"tapnet: metrics, {mode}", [float(value[0]) for value in result.values()], 1.0)
        if mode == "first":
            kept = ~found["occluded"].all(axis=1)
            mine = tracks.xy.transpose(1, 0, 2)[kept] * (SIDE / np.array([samples[0].width, samples[0].height]))
            seen = ~found["occluded"][kept]
            close("tapvid", "tapnet: points", targets[0][seen], mine[seen], "px", atol=1e-4)


def test_points_in_space(written, followed):
    for name, (tracks, samples) in followed.items():
        with np.load(written["tapvid3d"] / f"{name}.npz") as arrays:
            found = dict(arrays)
        kept = ~np.isinf(tracks.xyz[..., 2]).any(axis=0)
        assert found["images_jpeg_bytes"].shape == (len(samples),) and (kept.sum() < len(kept)) == ("chair" in name)
        close("tapvid", "NumPy: tracks_XYZ", found["tracks_XYZ"], tracks.xyz[:, kept], "m", rtol=1e-7)
        equal("tapvid", "NumPy: visibility", found["visibility"], tracks.state[:, kept] == 0)
        fx, fy, cx, cy = found["fx_fy_cx_cy"]
        x, y, z = np.moveaxis(found["tracks_XYZ"], -1, 0)
        there = np.stack((fx * x / z + cx, fy * y / z + cy), axis=-1)
        close(
            "tapvid", "intrinsics: places", there[found["visibility"]], tracks.xy[:, kept][found["visibility"]], "px", atol=1e-4
        )
        at = found["queries_xyt"][:, 2].astype(int)
        asked = there[at, np.arange(len(at))]
        close("tapvid", "intrinsics: queries", found["queries_xyt"][:, :2], asked, "px", atol=1e-4)
        homogeneous = np.concatenate((tracks.world[:, kept], np.ones((*z.shape, 1))), axis=-1)
        moved = np.einsum("tij,tnj->tni", found["extrinsics_w2c"], homogeneous)[..., :3]
        close("tapvid", "NumPy: extrinsics_w2c", moved, tracks.xyz[:, kept], "m", atol=1e-9)
        for data, sample in zip(found["images_jpeg_bytes"], samples, strict=True):
            with Image.open(io.BytesIO(data)) as picture:
                assert np.abs(np.asarray(picture).astype(int) - sample.rgb).mean() < 2


def thresholds(found, size):
    """The largest distances of points, by their depth and the lens of a picture whose shorter side is 256 pixels."""
    fx, fy = found["fx_fy_cx_cy"][:2] * SIDE / min(size)
    return [pixels * found["tracks_XYZ"][..., 2].T / np.sqrt(fx * fy) for pixels in PIXELS]


def test_points_in_space_score_one_and_others_less(written, followed):
    for name, (_, samples) in followed.items():
        with np.load(written["tapvid3d"] / f"{name}.npz") as arrays:
            found = dict(arrays)
        points, seen = found["tracks_XYZ"].transpose(1, 0, 2), found["visibility"].T
        most = thresholds(found, (samples[0].width, samples[0].height))
        ours = scores(points, seen, points, seen, np.ones_like(seen), most)
        assert ours == dict.fromkeys(ours, 1.0)
        away = points.copy()
        away[..., 2] += most[2] * 0.9
        assert scores(points, seen, away, seen, np.ones_like(seen), most)["average_pts_within_thresh"] == 3 / 5


def test_points_in_space_score_one_in_tapnet(written, followed):
    einops = pytest.importorskip("einops")
    names = {"compute_tapvid3d_metrics", "get_pointwise_threshold_multiplier"}
    own = public("evaluation/metrics.py", names, einops=einops)
    for name in followed:
        with np.load(written["tapvid3d"] / f"{name}.npz") as arrays:
            found = dict(arrays)
        points, hidden = found["tracks_XYZ"], ~found["visibility"]
        result = own["compute_tapvid3d_metrics"](hidden, points, hidden, points, found["fx_fy_cx_cy"], order="t n")
        close("tapvid", "tapnet: metrics in space", [float(np.squeeze(value)) for value in result.values()], 1.0)


def test_equal_arrays_make_equal_files_that_any_numpy_reads(tmp_path):
    arrays = {"a": np.arange(6.0).reshape(2, 3), "b": np.array([True, False]), "c": np.array([b"\xff\xd8\xff\xd9", b"x"])}
    value = {"post box é": {**arrays, "d": np.zeros((0, 2), "<f4"), "e": np.arange(6).reshape(2, 3).T}}
    assert pickled(value) == pickled({"post box é": {k: np.array(v, order="C") for k, v in value["post box é"].items()}})
    assert b"numpy" in pickled(value) and b"_reconstruct" not in pickled(value) and b"_core" not in pickled(value)
    for key, array in pickle.loads(pickled(value))["post box é"].items():
        equal("tapvid", "pickle: arrays", array, value["post box é"][key])
        assert array.flags.writeable or not array.size
    assert archive(**arrays) == archive(**arrays)
    with zipfile.ZipFile(io.BytesIO(archive(**arrays))) as members:
        assert {(member.date_time, member.create_system) for member in members.infolist()} == {((1980, 1, 1, 0, 0, 0), 3)}
    with np.load(io.BytesIO(archive(**arrays))) as found:
        for key, array in arrays.items():
            equal("tapvid", "NumPy: arrays", found[key], array)


@pytest.mark.slow
def test_another_process_makes_the_same_pickle():
    """Hashes of texts differ between processes."""
    program = (
        "import numpy as np, sys; from viewsphere.formats.tapvid import pickled;"
        "sys.stdout.buffer.write(pickled({'v': {'video': np.ones((2, 3), 'u1'), 'occluded': np.ones(3, bool)}}))"
    )
    found = {
        hashlib.sha256(
            subprocess.run(
                [sys.executable, "-c", program], check=True, capture_output=True, env={**os.environ, "PYTHONHASHSEED": seed}
            ).stdout
        ).hexdigest()
        for seed in ("1", "2")
    }
    assert len(found) == 1


def test_a_choice_of_frames(videos, tmp_path):
    """Of the left camera's first picture, and both of the third instant: points picked at the others have no query."""
    export(videos.root, [{"tapvid": {"kind": "tapvid3d"}}], output=tmp_path, choice=Choice(frames=((0, 1), (4, 6))))
    name = f"{videos[0].split}/{videos[0].sequence}"
    with np.load(tmp_path / "tapvid" / f"{name}_left.npz") as found:
        assert found["images_jpeg_bytes"].shape == (2,) and set(found["queries_xyt"][:, 2]) == {0}
        assert found["tracks_XYZ"].shape[1] == (videos.tracks(videos[0].sequence, "left").query[:, 0] == 0).sum()


def test_a_lens_that_zooms_is_refused(videos, monkeypatch):
    sequence = videos.sequences[0]
    dataset, samples = Dataset(videos.root), list(videos.sequence(sequence, "left"))
    camera = samples[2].camera
    zoomed = replace(camera, intrinsics=camera.intrinsics.model_copy(update={"fx": 200.0}))
    samples[2] = replace(samples[2], known_camera=zoomed)
    monkeypatch.setattr(dataset, "sequence", lambda *_: tuple(samples))
    with pytest.raises(
        UserError, match=f"kind tapvid3d: expected one lens all through a sequence; found that {sequence} zooms"
    ):
        tapvid.Tapvid(dataset, tapvid.FORMAT.options(kind="tapvid3d"))._archived("a", sequence, "left")


def test_what_is_refused(videos, stills, drives, tmp_path):
    flat, deep = tapvid.FORMAT.options(), tapvid.FORMAT.options(kind="tapvid3d")
    assert list(tapvid.FORMAT.refuses(scope_of(videos), flat)) == list(tapvid.FORMAT.refuses(scope_of(videos), deep)) == []
    assert "expected sequences" in next(tapvid.FORMAT.refuses(scope_of(stills), flat))
    with pytest.raises(UserError, match="LiDAR"):
        export(drives.root, "tapvid", output=tmp_path)
