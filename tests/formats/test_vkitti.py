"""Virtual KITTI, both versions, read by pandas and OpenCV as its documentation says: the same maps, boxes and cameras."""

from __future__ import annotations

import cv2
import numpy as np
import pandas as pd
import pytest
from PIL import Image

from proven import close, equal
from viewsphere.formats.vkitti import FORMAT
from viewsphere.formats.vkitti.names import COLORS, Names, object_colors
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.rig import Rig
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.exports.exporting import export
from viewsphere.run.exports.preparing import Views
from viewsphere.run.exports.scope import scope_of

WORLD = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # y down, of ours


@pytest.fixture(scope="module")
def two(videos, tmp_path_factory):
    place = tmp_path_factory.mktemp("two")
    export(videos.root, [{"vkitti": {"variation": "fog"}}], output=place)
    return place / "vkitti"


@pytest.fixture(scope="module")
def lone(tmp_path_factory):
    """A drive of one camera, past things that are hidden, cut off and out of sight."""
    from viewsphere import Dataset, generate
    from worlds import videos

    place = tmp_path_factory.mktemp("lone")
    changes = {
        "rig": None,
        "tracks": None,
        "annotations": [],
        "channels": ["rgb", "depth", "instances", "semantic", "flow", "flow_state"],
    }
    look = {"viewpoints": {"kind": "orbit", "azimuth": [20, 50], "elevation": [18, 24], "distance": [1.6, 1.2]}}
    generate(videos(name="lone", **changes, **look), place, workers=0)
    return Dataset(place)


@pytest.fixture(scope="module")
def one(lone, tmp_path_factory):
    place = tmp_path_factory.mktemp("one")
    export(lone.root, [{"vkitti": {"version": "1.3.1"}}], output=place)
    return place / "vkitti"


def rgb(file):
    return cv2.imread(str(file), cv2.IMREAD_UNCHANGED)[..., ::-1]


def flow_of(file):
    """As the data set's page decodes it."""
    bgr = cv2.imread(str(file), cv2.IMREAD_ANYCOLOR | cv2.IMREAD_ANYDEPTH)
    h, w = bgr.shape[:2]
    assert bgr.dtype == np.uint16
    out = 2.0 / (2**16 - 1.0) * bgr[..., 2:0:-1].astype("f4") - 1
    out *= [w - 1, h - 1]
    out[bgr[..., 0] == 0] = np.nan
    return out


def depth_is(name, file, sample):
    found = cv2.imread(str(file), cv2.IMREAD_ANYCOLOR | cv2.IMREAD_ANYDEPTH)
    seen = np.isfinite(sample.depth) & (sample.depth < 655.34)
    assert found.dtype == np.uint16
    equal(name, "OpenCV: where depth is", found != 65535, seen)
    close(name, "OpenCV: depth", found[seen] / 100, sample.depth[seen], "m", atol=0.00501)


def flow_is(name, file, expected):
    found = flow_of(file)
    equal(
        name,
        "OpenCV: where flow is",
        np.isfinite(found),
        np.isfinite(expected) & (np.abs(expected) <= [159, 119]).all(-1, keepdims=True),
    )
    valid = np.isfinite(found)
    close(name, "OpenCV: flow", found[valid], expected[valid], "px", atol=159 / 65535 * 1.01)


def turned(y, x, z):
    """The rotation of an object (x right, y down, z ahead), y + pi/2 last."""
    cy, sy, cx, sx, cz, sz = *cossin(y + np.pi / 2), *cossin(x), *cossin(z)
    ry = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    rx = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    return ry @ rx @ np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])


def cossin(angle):
    return np.cos(angle), np.sin(angle)


def corners(size, place, turns):
    """The corners of a box, in the order of ours: those of its bottom first."""
    w, h, length = size
    signs = np.array([[-1, 1, -1], [-1, 1, 1], [1, 1, 1], [1, 1, -1], [-1, -1, -1], [-1, -1, 1], [1, -1, 1], [1, -1, -1]])
    return (signs * [w / 2, h / 2, length / 2] - [0, h / 2, 0]) @ turned(*turns).T + place


@pytest.mark.slow
def test_maps_of_version_2(videos, two):
    for sample in Views(videos).for_format(FormatEntry(name="vkitti"), None):
        camera, root = int(sample.sensor == "right"), two / f"Scene{sample.sequence}/fog/frames"

        def file(kind, name, root=root, tail=f"{sample.instant:05d}", camera=camera):
            return root / kind / f"Camera_{camera}" / f"{name}_{tail}"

        picture = cv2.imread(str(file("rgb", "rgb").with_suffix(".jpg")))[..., ::-1]
        assert np.abs(picture.astype(int) - sample.rgb).mean() < 3
        depth_is("vkitti", file("depth", "depth").with_suffix(".png"), sample)
        with Image.open(file("instanceSegmentation", "instancegt").with_suffix(".png")) as image:
            assert image.mode == "P"
            ids = np.array(image)
        equal("vkitti", "Pillow: instances", ids, sample.instances)
        colors = pd.read_csv(two / f"Scene{sample.sequence}/fog/colors.txt", sep=" ", index_col="Category")
        classes = rgb(file("classSegmentation", "classgt").with_suffix(".png"))
        equal("vkitti", "OpenCV: sky", (classes == colors.loc["Sky"].to_numpy()).all(-1), sample.semantic == 1)
        equal("vkitti", "OpenCV: ground", (classes == colors.loc["Terrain"].to_numpy()).all(-1), sample.semantic == 2)
        for c in videos.categories:
            name = {"car": "Car"}.get(c.name, c.name)
            equal("vkitti", "OpenCV: classes", (classes == colors.loc[name].to_numpy()).all(-1), sample.categories == c.id)
        for way, name, tail, there in (
            ("forward", ("flow", "sceneFlow"), "", sample.instant < 5),
            ("backward", ("backwardFlow", "backwardSceneFlow"), "_backward", sample.instant > 0),
        ):
            kinds = zip(("Flow", "SceneFlow"), name, strict=True)
            flow, scene = (file(f"{way}{kind}", one).with_suffix(".png") for kind, one in kinds)
            assert flow.is_file() == scene.is_file() == there
            if there:
                flow_is("vkitti", flow, sample.channels[f"flow{tail}"])
                metres = (rgb(scene).astype(float) * 2 / 65535 - 1) * 10
                expected = np.clip(np.nan_to_num(sample.channels[f"scene_flow{tail}"]), -10, 10)
                close("vkitti", "OpenCV: scene flow", metres, expected, "m", atol=10 / 65535 * 1.01)


@pytest.mark.slow
def test_texts_of_version_2(videos, two):
    for sequence in videos.sequences:
        tables = {}
        for name in ("intrinsic", "extrinsic", "bbox", "pose", "info"):
            tables[name] = pd.read_csv(two / f"Scene{sequence}/fog/{name}.txt", sep=" ")
        info = tables["info"].set_index("trackID")
        for sample in (sample for sample in videos if sample.sequence == sequence):
            at = [sample.instant, int(sample.sensor == "right")]
            of_frame = {name: table for name, table in tables.items() if name != "info"}
            rows = {name: table[(table[["frame", "cameraID"]] == at).all(axis=1)] for name, table in of_frame.items()}
            (fx, fy, cx, cy), k = rows["intrinsic"].to_numpy()[0, 2:], sample.camera.intrinsics
            assert (fx, fy, cx + 0.5, cy + 0.5) == (k.fx, k.fy, k.cx, k.cy)
            motion = rows["extrinsic"].to_numpy()[0, 2:].reshape(4, 4)
            close("vkitti", "pandas: extrinsics", motion[:3, :3] @ WORLD, sample.camera.R, "1", atol=1e-12)
            close("vkitti", "pandas: extrinsics", motion[:3, 3], sample.camera.t, "m", atol=1e-12)
            seen = [o for o in sample.objects if o.box2d]
            assert list(rows["bbox"].trackID) == list(rows["pose"].trackID) == [o.id - 1 for o in seen]
            for o, (_, box), (_, pose) in zip(seen, rows["bbox"].iterrows(), rows["pose"].iterrows(), strict=True):
                found = (box.left, box.top, box.right + 1, box.bottom + 1)
                equal("vkitti", "pandas: boxes", found, o.box2d)
                assert (box.number_pixels, box.truncation_ratio) == (o.area, o.truncation)
                share = o.mask[round(o.box2d[1]) : round(o.box2d[3]), round(o.box2d[0]) : round(o.box2d[2])].mean()
                close("vkitti", "pandas: occupancy", box.occupancy_ratio, share, atol=1e-12)
                moved = np.abs(np.array([s for s in (o.velocity, o.angular_velocity) if s is not None])).max(initial=0) > 1e-9
                assert box.isMoving == moved
                for space, expected in (("camera", o.box3d_camera), ("world", o.box3d @ WORLD.T)):
                    place = [pose[f"{space}_space_{axis}"] for axis in "XYZ"]
                    turns = [pose[f"rotation_{space}_space_{axis}"] for axis in "yxz"]
                    found = corners((pose.width, pose.height, pose.length), place, turns)
                    close("vkitti", f"pandas: 3D boxes, {space}", found, expected, "m", atol=1e-6)
                around = pose.alpha - pose.rotation_camera_space_y + np.arctan2(pose.camera_space_X, pose.camera_space_Z)
                assert abs(np.sin(around)) < 1e-9 and np.cos(around) > 0
            assert {o.id - 1: o.category.replace("car", "Car") for o in sample.objects} == info.label.to_dict()
            assert {o.id - 1: o.key for o in sample.objects} == info.model.to_dict()
        assert set(info.color) == {"Unknown"}
        assert any(tables["bbox"].isMoving) == (sequence == "car_000")
        assert tables["info"].columns.tolist() == ["trackID", "label", "model", "color"]


@pytest.mark.slow
def test_version_1(lone, one):
    truncated = 0
    for sample in lone:
        name, frame = f"{sample.sequence}/clone", f"{sample.instant:05d}.png"
        equal("vkitti", "OpenCV: pictures of 1.3.1", rgb(one / f"vkitti_1.3.1_rgb/{name}/{frame}"), sample.rgb)
        depth_is("vkitti", one / f"vkitti_1.3.1_depthgt/{name}/{frame}", sample)
        flow = one / f"vkitti_1.3.1_flowgt/{name}/{frame}"
        assert flow.is_file() == (sample.instant < 5)
        if flow.is_file():
            flow_is("vkitti", flow, sample.flow)
        text = name.replace("/", "_")
        encoding = (one / f"vkitti_1.3.1_scenegt/{text}_scenegt_rgb_encoding.txt").read_text().splitlines()[1:]
        colors = {line.split(" ")[0]: tuple(map(int, line.split(" ")[1:])) for line in encoding}
        assert len(set(colors.values())) == len(colors)
        scene = rgb(one / f"vkitti_1.3.1_scenegt/{name}/{frame}")
        for o in sample.objects:
            color = colors[f"{o.category.replace('car', 'Car')}:{o.id - 1}"]
            equal("vkitti", "OpenCV: objects of 1.3.1", (scene == color).all(-1), sample.instances == o.id)
        equal("vkitti", "OpenCV: sky of 1.3.1", (scene == colors["Sky"]).all(-1), sample.semantic == 1)
        lines = np.loadtxt(one / f"vkitti_1.3.1_extrinsicsgt/{text}.txt", skiprows=1)
        motion = lines[sample.instant, 1:].reshape(4, 4)
        assert lines[sample.instant, 0] == sample.instant
        close("vkitti", "numpy: extrinsics of 1.3.1", motion[:3, :3] @ WORLD, sample.camera.R, "1", atol=1e-12)
        tracks = pd.read_csv(one / f"vkitti_1.3.1_motgt/{text}.txt", sep=" ", index_col=False)
        assert len(tracks.columns) == 25
        rows, seen = tracks[tracks.frame == sample.instant], [o for o in sample.objects if o.box2d]
        for o, (_, row) in zip(seen, rows.iterrows(), strict=True):
            equal("vkitti", "pandas: boxes of 1.3.1", (row.l, row.t, row.r + 1, row.b + 1), o.box2d)
            found = corners((row.w3d, row.h3d, row.l3d), [row.x3d, row.y3d, row.z3d], [row.ry, row.rx, row.rz])
            close("vkitti", "pandas: 3D boxes of 1.3.1", found, o.box3d_camera, "m", atol=1e-6)
            assert (row.tid, row.occluded) == (o.id - 1, o.occlusion_level)
            assert row.truncr == pytest.approx(o.truncation, abs=1e-12)  # pandas 2 reads the last digit otherwise
            assert row.label == row.orig_label and row.truncated == (o.truncation > 0) + (o.truncation > 0.5)
            truncated += row.truncated > 0
    assert truncated


def test_published_lines_turn_as_ours_do():
    """A car ahead and one that comes towards a camera that is rolled: both stand as the world does, by its first lines."""
    down = np.array([0.0721791, 0.9973904, 0.001565997])
    for turns in ([-1.571205, 0.001540535, -0.07224254], [1.585904, -0.002663161, 0.07220995]):
        np.testing.assert_allclose(turned(*turns)[:, 1], down, atol=2e-3)


def test_frames_without_objects_have_texts_all_the_same(videos):
    from dataclasses import replace

    from viewsphere.formats.vkitti.rows import texts

    found = texts(replace(videos[0], objects=()), 0)
    assert found["bbox"] == found["pose"] == found["info"] == b"" and found["intrinsic"].endswith(b"\n")


def test_colors_tell_all_apart(videos):
    names = Names.from_classes(videos.classes)
    colors = {tuple(color) for color in object_colors()[1:].tolist()}
    assert len(colors) == 255 and not colors & set(names.colors.values())
    assert len(set(COLORS.values())) == len(COLORS)


def test_what_it_refuses(stills, videos):
    from dataclasses import replace

    from viewsphere.store import Category

    scope, new, old = scope_of(videos), FORMAT.options(), FORMAT.options(version="1.3.1")
    assert list(FORMAT.refuses(scope, new)) == []
    assert list(FORMAT.refuses(scope, old)) == ["expected one sensor; found left, right"]
    assert list(FORMAT.refuses(scope_of(stills), new)) == ["expected sequences (a recipe's time); found still pictures"]
    odd = replace(scope, categories=(Category(1, "tall tree", ""), Category(2, "car:é", ""), Category(3, "Bäume'\"", "")))
    assert [problem[-12:] for problem in FORMAT.refuses(odd, new)] == ["'tall tree'"[-12:].rjust(12), " found 'car:é'"[-12:]]
    many = replace(scope, most_objects=256)
    assert list(FORMAT.refuses(many, new)) == ["expected at most 255 objects in a picture; found 256"]
    lens = Intrinsics(width=4, height=4, fx=1, fy=1, cx=2, cy=2, skew=0.5)
    assert list(FORMAT.refuses(replace(scope, rig=Rig.single(lens)), new)) == [
        "expected cameras without skew; found 0.5 of camera"
    ]
