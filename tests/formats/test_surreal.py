"""SURREAL's files of a rigged person that walks, read by scipy and ffmpeg, and projected as the authors' own script does."""

from __future__ import annotations

import shutil
import sys
import tracemalloc
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from changed_samples import with_channels

from proven import close, equal
from rigged import person, write_gltf
from scratch import scratch_cache
from small import tree_hash
from viewsphere import Dataset, Recipe, generate
from viewsphere.assets.animation.timeline import Blenders, Timeline
from viewsphere.assets.load import load_model
from viewsphere.assets.sandbox.client import READ_HERE
from viewsphere.check import check
from viewsphere.errors import MissingExtraError, UserError
from viewsphere.formats import Scope, surreal
from viewsphere.formats.surreal import body, writing
from viewsphere.run.exports.exporting import export
from viewsphere.run.exports.scope import scope_of

io = pytest.importorskip("scipy.io")
ffmpeg = pytest.importorskip("imageio_ffmpeg")

FRAMES, CLIP = 6, 4
SIZE = (320, 240)
CAMERA = np.array([[0, 0, -1], [0, 1, 0], [-1, 0, 0]])
ABOVE = (None, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21)
"""Of SMPL's joints, in SURREAL's order, the places of those above."""

MIDDLE = ((0.95, 0, 0), (1.05, 3, 0.0), (1.15, 6, 0.0), (1.27, 9, 0.0), (1.46, 12, 0.0), (1.56, 15, 0.02))
SIDE = (  # height, place of the left one, to the side, to the front
    (0.9, 1, 0.09, 0.0), (0.5, 4, 0.1, 0.02), (0.08, 7, 0.11, -0.03), (0.03, 10, 0.12, 0.09), (1.4, 13, 0.06, 0.0),
    (1.4, 16, 0.19, 0.0), (1.15, 18, 0.33, -0.02), (0.92, 20, 0.45, 0.02), (0.85, 22, 0.49, 0.04),
)  # fmt: skip
ENDS = {10: (0, 0, 0.08), 11: (0, 0, 0.08), 15: (0, 0.16, 0), 22: (0.04, -0.08, 0), 23: (-0.04, -0.08, 0)}


def figure(names):
    """A person's bones as `rigged.person` takes them, in glTF's axes, with these names of the 24 joints."""
    places = {n: np.array([0, y, z]) for y, n, z in MIDDLE} | {
        n + other: np.array([x * (1 - 2 * other), y, z]) for y, n, x, z in SIDE for other in (0, 1)
    }
    ends = {ABOVE[n]: places[n] for n in sorted(places, reverse=True) if n} | {n: places[n] + by for n, by in ENDS.items()}
    return {
        names[n]: (None if ABOVE[n] is None else names[ABOVE[n]], tuple(places[n]), tuple(ends[n]), 0.06 if n < 16 else 0.04)
        for n in range(24)
    }


def recipe(source, **changes):
    said = {
        "name": "people",
        "models": [{"source": str(source), "category": "person", "motion": [
            {"kind": "clip"}, {"kind": "constant", "velocity": [0.4, -0.8, 0]}]}],
        "viewpoints": {"azimuth": [20, 160], "elevation": [0, 14], "distance": 5},
        "time": {"frames": FRAMES, "fps": 10},
        "camera": {"size": SIZE, "focal_px": 600},
        "channels": ["rgb", "depth", "instances", "body_parts", "normals", "flow_backward"],
        "annotations": ["keypoints"],
        "splits": {"by": "sequence", "train": 0.5, "val": 0.5},
        "formats": [],
    }  # fmt: skip
    return Recipe.model_validate({**said, **changes})


def let_walk(monkeypatch, folder, names):
    """Let `walker.fbx` hold the figure, which swings its arms and legs: a file of glTF for each frame."""
    shape, swing = person(figure(names)), ((16, 1), (17, -1), (1, -1), (2, 1), (4, 0.5), (19, -1))

    def load_frames(path, frames, **_):
        for frame in (1, *frames):
            angles = {names[n]: share * np.sin(0.9 * frame) * 0.35 for n, share in swing}
            turned = {name: [float(np.sin(a)), 0.0, 0.0, float(np.cos(a))] for name, a in angles.items()}
            mesh, facts = load_model(write_gltf(shape, folder / f"walker{frame}.gltf", turned))
            yield mesh, replace(facts, path=path, files=(path,))

    (folder / "walker.fbx").write_bytes(b"walks")
    monkeypatch.setattr(Blenders, "timeline", lambda *_, **__: Timeline(1, 12, 10.0, True))
    monkeypatch.setattr("viewsphere.assets.load.load_frames", load_frames)
    monkeypatch.setenv(READ_HERE, "1")
    scratch_cache(monkeypatch, folder / "cache")


@pytest.fixture
def short(monkeypatch):
    """Clips of four instants."""
    monkeypatch.setattr(writing, "MOST", CLIP)


@pytest.fixture(scope="module")
def people(tmp_path_factory):
    """Four sequences of a person who walks and swings arms and legs, each before a camera that stands still."""
    folder = tmp_path_factory.mktemp("people")
    with pytest.MonkeyPatch.context() as patched:
        let_walk(patched, folder, [f"m_avg_{name}" for name in body.SMPL])
        generate(recipe(folder / "walker.fbx"), folder / "out", workers=0)
    return Dataset(folder / "out")


@pytest.fixture(scope="module")
def written(people, tmp_path_factory):
    place = tmp_path_factory.mktemp("surreal")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(writing, "MOST", CLIP)
        export(people.root, ["surreal"], output=place)
    return place / "surreal"


@pytest.fixture(scope="module")
def clips(people, written):
    """The samples of each clip, by its path without an ending."""
    found = {}
    for sample in people:
        name = f"{sample.sequence}_c{sample.instant // CLIP + 1:04d}"
        found.setdefault(written / sample.split / "run0" / sample.sequence / name, []).append(sample)
    return found


def read(clip, kind):
    return io.loadmat(f"{clip}_{kind}.mat")


@pytest.mark.slow
def test_five_files_of_matlab_and_a_video_a_clip(people, written, clips):
    kinds = (".mp4", "_depth.mat", "_segm.mat", "_gtflow.mat", "_normal.mat", "_info.mat")
    assert len(people) == 4 * FRAMES and len(clips) == 8
    found = {path for path in written.rglob("*_c0*")}
    assert {str(path) for path in found} == {f"{clip}{kind}" for clip in clips for kind in kinds}
    for clip, samples in clips.items():
        for kind in ("depth", "segm", "gtflow", "normal"):
            names = {name for name in read(clip, kind) if not name.startswith("__")}
            assert names == {f"{kind}_{k}" for k in range(1, len(samples) + 1)}


@pytest.mark.slow
def test_maps_are_the_channels(clips):
    seen, moved = set(), 0
    for clip, samples in clips.items():
        depth, segm, flow, normal = (read(clip, kind) for kind in ("depth", "segm", "gtflow", "normal"))
        for k, sample in enumerate(samples, 1):
            one = depth[f"depth_{k}"]
            assert (one.dtype, one.shape) == (np.float32, SIZE[::-1])
            expected = np.where(np.isinf(sample.depth), np.float32(1e10), sample.depth)
            equal("surreal", "scipy: depth", one, expected)
            assert segm[f"segm_{k}"].dtype == np.uint8
            equal("surreal", "scipy: segm", segm[f"segm_{k}"], sample.body_parts)
            earlier = sample.flow_backward
            equal("surreal", "scipy: gtflow", flow[f"gtflow_{k}"], np.where(np.isnan(earlier), np.float32(0), -earlier))
            moved += sample.instant > 0 and np.abs(flow[f"gtflow_{k}"]).max() > 1
            in_camera = normal[f"normal_{k}"] @ CAMERA
            equal("surreal", "scipy: normals", in_camera.astype(np.float32), sample.normals)
            seen |= set(np.unique(segm[f"segm_{k}"]).tolist())
    assert moved == 4 * (FRAMES - 1) and seen == set(range(25))


@pytest.mark.slow
def test_what_flow_says_is_where_the_body_was(clips):
    """A joint's own motion between two pictures is that of the pixels around it."""
    seen = 0
    for clip, samples in clips.items():
        flow, places = read(clip, "gtflow"), [sample.objects[0].keypoints for sample in samples]
        for k, ((before, now), sample) in enumerate(zip(pairwise(places), samples[1:], strict=True), 2):
            (o,) = sample.objects
            for joint in np.flatnonzero(o.keypoint_states == 0):
                x, y = now[joint].astype(int)
                around = flow[f"gtflow_{k}"][y - 1 : y + 2, x - 1 : x + 2].reshape(-1, 2)
                seen += np.linalg.norm(np.median(around, axis=0) - (now - before)[joint]) < 3
    assert seen > 100


@pytest.mark.slow
def test_joints_are_projected_as_the_authors_script_does(clips):
    """Exactly, after rounding, from the file alone; and near to the keypoints before."""
    K = np.array([[600, 0, 160], [0, 600, 120], [0, 0, 1]])
    for clip, samples in clips.items():
        found = read(clip, "info")
        joints, pixels, place = (found[name].astype(np.float64) for name in ("joints3D", "joints2D", "camLoc"))
        assert joints.shape == (3, 24, len(samples)) and pixels.shape == (2, 24, len(samples)) and place.shape == (3, 1)
        close("surreal", "scipy: K", found["K"], K, "px", atol=1e-9)
        seen = np.einsum("ij,jkt->ikt", found["K"] @ CAMERA, joints - place[:, :, None])
        seen = seen[:2] / seen[2]
        equal("surreal", "scipy: joints2D", np.rint(seen), pixels)
        assert {found[name].dtype for name in ("joints2D", "joints3D", "camLoc", "zrot")} == {np.dtype(np.float32)}
        for t, sample in enumerate(samples):
            (o,) = sample.objects
            order = [o.keypoint_names.index(f"m_avg_{name}") for name in body.SMPL]
            close("surreal", "scipy: joints before rounding", seen[:, :, t].T, o.keypoints[order], "px", atol=1e-3)
            away = np.linalg.norm(joints[:, :, None, t] - joints[:, None, :, t], axis=0)
            real = np.linalg.norm(o.keypoints3d[order][:, None] - o.keypoints3d[order], axis=2)
            close("surreal", "scipy: joints3D", away, real, "m", atol=2e-6)


@pytest.mark.slow
def test_the_world_is_upright_where_the_camera_is_level(clips):
    """-y is up and the ground y = 0, as in the authors' file; else the axis of the camera is still the world's x."""
    level = 0
    for clip, samples in clips.items():
        found, (o, *_) = read(clip, "info"), samples[0].objects
        pelvis = o.keypoints3d_camera[o.keypoint_names.index("m_avg_Pelvis")]
        assert found["camDist"].item() == found["camLoc"][0, 0] == np.float32(pelvis[2])
        assert abs(found["joints3D"][0, 0, 0]) < 1e-6
        if abs(samples[0].camera.R[1, 2] + 1) < 1e-9:
            level += 1
            for t, sample in enumerate(samples):
                (o,) = sample.objects
                heights = [o.keypoints3d[o.keypoint_names.index(f"m_avg_{name}"), 2] for name in body.SMPL]
                close("surreal", "scipy: heights", -found["joints3D"][1, :, t], heights, "m", atol=2e-6)
    assert level == 4


@pytest.mark.slow
def test_zrot_is_how_far_the_person_turns_from_the_camera(clips):
    """The camera is azimuth degrees counter-clockwise of the front, so that the front is as much clockwise of the camera."""
    for clip, samples in clips.items():
        found = read(clip, "info")["zrot"]
        assert found.shape == (len(samples), 1)
        azimuth = np.radians(20 if abs(samples[0].pose.azimuth_deg - 20) < 1 else 160)
        close("surreal", "scipy: zrot", found, -azimuth, "rad", atol=1e-6)


@pytest.mark.slow
def test_the_rest_of_info(people, clips):
    for clip in clips:
        found = {name: value for name, value in read(clip, "info").items() if not name.startswith("__")}
        assert not {"pose", "shape", "gender", "light", "cloth", "bg"} & set(found)
        assert found["sequence"].tolist() == [clip.name] and found["source"].tolist() == ["viewsphere"]
        assert found["clipNo"].tolist() == [[int(clip.name[-4:])]] and found["stride"].tolist() == [[0]]
    assert {clip.parts[-4] for clip in clips} == {"train", "val"}


@pytest.mark.slow
def test_videos_show_the_pictures(clips):
    for clip, samples in clips.items():
        frames = ffmpeg.read_frames(f"{clip}.mp4")
        told = next(frames)
        found = [np.frombuffer(frame, np.uint8).reshape(*SIZE[::-1], 3).astype(int) for frame in frames]
        assert told["size"] == SIZE and told["fps"] == 10 and len(found) == len(samples)
        for k, frame in enumerate(found):
            off = [np.abs(frame - other.rgb.astype(int)).mean() for other in samples]
            assert off.index(min(off)) == k and off[k] < 3


@pytest.mark.slow
@pytest.mark.usefixtures("short")
def test_it_is_proved_and_the_same_by_several_processes(people, written, tmp_path, monkeypatch):
    from viewsphere.run.exports import preparing

    monkeypatch.setattr(preparing, "PATIENCE_S", 0.0)
    assert list(surreal.verify(people, written, ())) == []
    export(people.root, ["surreal"], output=tmp_path)
    assert tree_hash(tmp_path / "surreal") == tree_hash(written)
    names = [file.relative_to(written) for file in {path.name[-8:]: path for path in sorted(written.rglob("*_c0*"))}.values()]
    for name in names:
        copy = tmp_path / "surreal" / name
        data = copy.read_bytes()
        copy.write_bytes(data[:-9] + bytes([data[-9] ^ 1]) + data[-8:])
    told = [message for _, message in surreal.verify(people, tmp_path / "surreal", ()) if message.endswith("export again")]
    assert sorted(message.split(":")[0].split("/")[-1] for message in told) == sorted(name.name for name in names)


@pytest.fixture(scope="module")
def long(tmp_path_factory):
    """102 instants of a stiff person with Mixamo's names, before a picture."""
    from PIL import Image

    folder = tmp_path_factory.mktemp("long")
    Image.new("RGB", (64, 48), (90, 120, 150)).save(folder / "hall.png")
    source = write_gltf(person(figure([f"mixamorig:{name}" for name in body.MIXAMO])), folder / "person.gltf")
    models = [{"source": str(source), "category": "person", "motion": {"kind": "constant", "velocity": [0.02, 0, 0]}}]
    generate(
        recipe(
            source, models=models, time={"frames": 102, "fps": 30}, camera={"size": [64, 48], "focal_px": 88},
            viewpoints={"azimuth": [30], "elevation": [5], "distance": 4}, splits={"train": 1},
            scene={"background": {"images": str(folder)}},
        ),
        folder / "out",
        workers=0,
    )  # fmt: skip
    return Dataset(folder / "out")


@pytest.mark.slow
def test_clips_have_at_most_a_hundred_pictures(long, tmp_path):
    export(long.root, ["surreal"], output=tmp_path)
    first, second = sorted((tmp_path / "surreal").rglob("*_info.mat"))
    assert (first.name[-14:], second.name[-14:]) == ("c0001_info.mat", "c0002_info.mat")
    one, other = io.loadmat(first), io.loadmat(second)
    assert one["joints2D"].shape == (2, 24, 100) and other["joints2D"].shape == (2, 24, 2)
    assert [name.item() for name in other["bg"][0]] == ["hall.png"] * 2 and other["clipNo"].item() == 2
    last = io.loadmat(str(second).replace("info", "segm"))
    equal("surreal", "scipy: segm, Mixamo's names", last["segm_2"], long[-1].body_parts)


@pytest.mark.slow
def test_a_clip_s_pictures_are_not_in_memory_together(long):
    tree = surreal.Surreal(long)
    clip = tree._clip_of(long[0])
    tracemalloc.start()
    try:
        writing._film(clip)
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert most < 50 * long[0].rgb.nbytes  # of 100; manifests, too, are in memory


@pytest.mark.slow
def test_a_check_of_the_whole_data_set(long, tmp_path):
    root = shutil.copytree(long.root, tmp_path / "out")
    export(root, ["surreal"])
    assert check(Dataset(root), rays=False).ok


# names


@pytest.mark.parametrize("naming", body.NAMINGS)
@pytest.mark.parametrize("prefix", ["", "m_avg_", "mixamorig:", "mixamorig7:", "Armature|rig:"])
def test_joints_by_any_names_in_any_order(naming, prefix):
    order = np.random.default_rng(4).permutation(24)
    names = ["tail", *(prefix + naming[i] for i in order)]
    found, places = body.joints(names)
    assert found == naming and [names[i] for i in places] == [prefix + name for name in naming]
    assert body.part_numbers(names, naming).tolist() == [0, -1, *(order + 1)]


def test_fingers_are_the_ends_of_hands():
    names = [*body.MIXAMO, "RightHandThumb2", "LeftHandPinky3", "LeftEye"]
    assert body.part_numbers(names, body.MIXAMO)[-3:].tolist() == [24, 23, -1]
    assert body.part_numbers([*body.GAME_ENGINE, "thumb_01_l", "index_02_r"], body.SMPL)[-2:].tolist() == [23, 24]


def test_names_that_several_rigs_have_are_the_joints_own():
    assert body.part_numbers(["Spine1", "Head"], body.SMPL).tolist() == [0, 4, 16]
    assert body.part_numbers(["Spine1", "Head"], body.MIXAMO).tolist() == [0, 7, 16]


def test_joints_that_lack_are_told():
    with pytest.raises(ValueError, match=r"24 joints as named points; found none called L_Hip, Spine2$"):
        body.joints([name for name in body.SMPL if name not in ("L_Hip", "Spine2")])
    with pytest.raises(ValueError, match=r"found none called Pelvis, L_Hip, R_Hip, Spine1, \.\.\.$"):
        body.joints(["nose"])


# what is refused


@pytest.mark.slow
def test_what_a_scope_tells(people, videos, stills):
    scope = scope_of(people)

    def found(**changes):
        return list(surreal.FORMAT.refuses(Scope(**{**vars(scope), **changes})))

    assert found() == []
    assert found(is_moving=False) == ["expected sequences (a recipe's time); found still pictures"]
    assert found(most_objects=3) == ["expected one person in a picture; found up to 3 objects"]
    assert any("expected one sensor" in told for told in surreal.FORMAT.refuses(scope_of(videos)))
    assert any("found still pictures" in told for told in surreal.FORMAT.refuses(scope_of(stills)))
    (sensor,) = scope.rig.sensors
    odd = sensor.model_copy(update={"intrinsics": sensor.intrinsics.model_copy(update={"width": 321})})
    (told,) = found(rig=scope.rig.model_copy(update={"sensors": (odd,)}))
    assert told == "expected an even width and height, as MP4 has; found 321 x 240 of camera"


def first_of(dataset, change):
    """What a tree says of the first sample, once a sequence's samples are what `change` makes of them."""
    tree = surreal.Surreal(dataset)
    samples = [change(sample) for sample in dataset.sequence(dataset.sequences[0])]
    tree._sequence = lambda name, sensor: tuple(samples)
    return list(tree.sample_files(samples[0]))


def moved_on(sample):
    return replace(sample, known_camera=replace(sample.camera, t=sample.camera.t + 0.01 * (sample.instant == 3)))


def with_object(sample, **changes):
    (o,) = sample.objects
    return replace(sample, objects=(replace(o, extra={**o.extra, **changes}),))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (moved_on, r"frame 3: expected a camera that stays .* a clip; found that it moves or zooms after frame 0$"),
        (lambda s: replace(s, objects=s.objects * 2), r"frame 0: expected one person; found 2 objects$"),
        (lambda s: replace(s, objects=s.objects[: s.instant != 2]), r"frame 2: expected one person; found 0 objects$"),
        (lambda s: replace(s, instant=s.instant + (s.instant > 1)), r"instants of a clip from 0 on; found 3 in place of 2$"),
        (lambda s: with_object(s, keypoint_names=("nose",) * 24), r"frame 0: model walker-f\d+: expected a person's 24 joints"),
        (lambda s: with_object(s, keypoints3d_camera=-s.objects[0].keypoints3d_camera), r"camera; found 24 behind it$"),
    ],
)  # fmt: skip
@pytest.mark.usefixtures("short")
def test_clips_that_it_cannot_hold(people, change, message):
    with pytest.raises(UserError, match=rf"^surreal: .*{message}"):
        first_of(people, change)


@pytest.mark.slow
def test_a_moving_camera_leaves_nothing_written(people, tmp_path):
    source = write_gltf(person(figure(body.SMPL)), tmp_path / "person.gltf")
    orbit = {"kind": "orbit", "azimuth": [20, 50], "elevation": [5, 5], "distance": [4, 4]}
    models = [{"source": str(source), "category": "person"}]
    small = {"camera": {"size": [64, 48], "focal_px": 88}, "time": {"frames": 3, "fps": 10}, "splits": {"train": 1}}
    generate(recipe(source, models=models, viewpoints=orbit, **small), tmp_path / "out", workers=0)
    with pytest.raises(UserError, match=r"surreal: frame 1: expected a camera that stays as it is"):
        export(tmp_path / "out", ["surreal"], output=tmp_path / "there")
    assert not (tmp_path / "there" / "surreal").exists()


@pytest.mark.slow
def test_parts_that_have_no_number_are_told_where_they_are_seen(people):
    tree = surreal.Surreal(people)
    tree._models = {key: replace(info, body_parts=("tail", *info.body_parts[1:])) for key, info in tree._models.items()}
    with pytest.raises(UserError, match=r"frame 0: model walker-f\d+: expected bones of SURREAL's 24 parts .* found tail: let"):
        list(tree.sample_files(people[0]))
    hidden = with_channels(people[0], body_parts=np.zeros_like(people[0].body_parts))
    assert list(tree.sample_files(hidden))


def test_without_the_extras(monkeypatch):
    surreal.FORMAT.check()
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(MissingExtraError, match=r"^format surreal: expected the package imageio-ffmpeg .*\[video\]'$"):
        surreal.FORMAT.check()
    monkeypatch.setitem(sys.modules, "scipy", None)
    with pytest.raises(
        MissingExtraError, match=r"^format surreal: expected scipy, found none: pip install 'viewsphere\[mat\]'"
    ):
        surreal.FORMAT.check()
