"""The points of a LiDAR: against closed forms and Embree, and what recipes may say of it."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

import viewsphere as vs
from sealing import seal_again
from viewsphere.check import check
from viewsphere.codecs.npz import decode_npz, encode_npz
from viewsphere.codecs.srgb import linear
from viewsphere.errors import RecipeError
from viewsphere.formats.blend import is_camera_view
from viewsphere.labels import is_shown
from viewsphere.labels.lidar import LABEL
from viewsphere.labels.shared.drawing.colors import color_of
from viewsphere.preview.frame import draw_sample
from viewsphere.preview.tiles import contact_sheet
from viewsphere.store import Dataset
from viewsphere.store.samples.films import films_of

ROTATED = [5.0, 20.0, -3.0]
LUMINANCE = (0.2126, 0.7152, 0.0722)
GRAY = float(linear((0.62, 0.61, 0.59)) @ LUMINANCE)
"""Of the ground, where nobody says its colour."""


def recipe(lidar=None, **changes):
    sensor = {"rings": 12, "elevation": [-30, 6], "azimuth_step": 4, "range": [0.5, 50]} | (lidar or {})
    said = {
        "models": [{"source": "zoo:post_box", "category": "box"}],
        "viewpoints": {"azimuth": [30], "elevation": [10], "distance": 4},
        "rig": {"sensors": {"front": {}, "top": {"position": [0.1, -0.3, 0], "rotation": ROTATED, "lidar": sensor}}},
        "camera": {"size": [32, 24], "fov_deg": 50},
        "channels": ["instances"],
        "formats": [],
        "splits": {"by": "frame", "train": 1},
    }
    return vs.Recipe.model_validate({**said, **changes})


def points_of(said):
    """The sample of the first scan, and its points."""
    sample = next(s for s in vs.render(said) if s.sensor == "top")
    return sample, sample.channels["lidar"]


def in_world(sample, rows):
    """Points from LiDAR axes (ahead, left, up) to the world."""
    x, y, z = rows["xyz"].astype(np.float64).T
    return (np.stack([-y, -z, x], axis=1) - sample.camera.t) @ sample.camera.R


def test_a_lidar_keeps_its_points_and_a_camera_its_pictures():
    front, top = vs.render(recipe())
    assert tuple(front.channels) == ("instances",)
    assert tuple(top.channels) == ("lidar",)
    assert (top.height, top.width) == (12, 90)


def test_points_of_the_ground_lie_on_it():
    """A plane: range and incidence follow from the height above it and the ray."""
    sample, rows = points_of(recipe())
    ground = rows[rows["instance"] == 0]
    world, eye = in_world(sample, ground), sample.camera.center
    floor = world[:, 2].mean()
    assert len(ground) > 200
    np.testing.assert_allclose(world[:, 2], floor, atol=5e-6)
    directions = (world - eye) / ground["range"][:, None]
    np.testing.assert_allclose(np.cos(ground["incidence"]), -directions[:, 2], atol=1e-6)
    np.testing.assert_allclose(ground["range"], (eye[2] - floor) / -directions[:, 2], rtol=2e-5)
    np.testing.assert_allclose(ground["intensity"], GRAY * -directions[:, 2] * (10 / ground["range"]) ** 2, rtol=1e-4)


def test_points_of_an_object_are_its_own():
    sample, rows = points_of(recipe({"azimuth_step": 1}))
    (box,) = sample.objects
    own = rows[rows["instance"] == box.id]
    assert len(own) > 10
    assert (own["category"] == box.category_id).all()
    low, high = box.box3d_object.min(axis=0), box.box3d_object.max(axis=0)
    inside = (in_world(sample, own) - box.world_from_object[:3, 3]) @ box.world_from_object[:3, :3]
    assert ((inside >= low - 1e-4) & (inside <= high + 1e-4)).all()


def test_nearer_and_farther_points_do_not_return():
    _, everything = points_of(recipe())
    _, some = points_of(recipe({"range": [4, 9]}))
    expected = everything[(everything["range"] >= 4) & (everything["range"] <= 9)]
    assert 0 < len(some) < len(everything)
    np.testing.assert_array_equal(some, expected)


def test_a_sensor_may_make_up_for_the_distance():
    _, rows = points_of(recipe({"reference_range": None}))
    ground = rows[rows["instance"] == 0]
    np.testing.assert_allclose(ground["intensity"], GRAY * np.cos(ground["incidence"]), atol=1e-6)


def matched(rows, others):
    """Rows of both whose rays are the same."""
    keys, other_keys = (r["ring"].astype(int) * 10_000 + r["column"] for r in (rows, others))
    return rows[np.isin(keys, other_keys)], others[np.isin(other_keys, keys)]


def test_noise_moves_points_along_their_rays():
    """By a normal distribution of the asked width; everything else stays exact."""
    dense = {"rings": 40, "azimuth_step": 1, "range": [0, 1000]}
    _, exact = points_of(recipe(dense))
    _, noisy = points_of(recipe({**dense, "sigma": 0.05}))
    exact, noisy = matched(exact, noisy)
    error = (noisy["range"].astype(np.float64) - exact["range"]) / 0.05
    assert len(error) > 5000
    assert abs(error.mean()) < 5 / len(error) ** 0.5
    assert abs(error.std() - 1) < 5 / (2 * len(error)) ** 0.5
    assert abs((np.abs(error) < 1).mean() - 0.6827) < 0.03
    np.testing.assert_allclose(noisy["xyz"] / noisy["range"][:, None], exact["xyz"] / exact["range"][:, None], atol=1e-5)
    for same in ("incidence", "intensity", "instance", "category"):
        np.testing.assert_array_equal(noisy[same], exact[same])


def test_points_drop_out_as_often_as_was_asked():
    """By themselves, by range, and by intensity; each cause by itself."""
    dense = {"rings": 40, "azimuth_step": 1, "range": [0, 1000]}
    _, exact = points_of(recipe(dense))
    _, some = points_of(recipe({**dense, "dropout": 0.25}))
    assert abs(len(some) / len(exact) - 0.75) < 0.03
    assert len(matched(some, exact)[0]) == len(some)
    _, near = points_of(recipe({**dense, "dropout_by_range": [[4, 0], [8, 1]]}))
    assert near["range"].max() <= 8
    assert (near["range"] < 4).sum() == (exact["range"] < 4).sum()
    middle = (exact["range"] > 5) & (exact["range"] < 7)
    kept = (near["range"] > 5) & (near["range"] < 7)
    assert abs(kept.sum() / middle.sum() - 0.5) < 0.1
    level = float(np.median(exact["intensity"]))
    _, bright = points_of(recipe({**dense, "dropout_by_intensity": [[level, 1], [level * 1.0001, 0]]}))
    assert abs(len(bright) - (exact["intensity"] > level).sum()) <= 2


def test_noise_follows_from_the_seed_and_the_pose():
    """Not from which others are rendered; each instant has its own."""
    noisy = {"sigma": 0.02, "dropout": 0.1}
    one = {"azimuth": [30], "elevation": [10], "distance": 4}
    two = {**one, "azimuth": [60, 30]}
    _, first = points_of(recipe(noisy, viewpoints=one))
    _, again = points_of(recipe(noisy, viewpoints=one))
    _, other = points_of(recipe(noisy, viewpoints=one, seed=5))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)
    others = [s.channels["lidar"] for s in vs.render(recipe(noisy, viewpoints=two)) if s.sensor == "top"]
    np.testing.assert_array_equal(others[1], first)


def test_pictures_do_not_depend_on_a_lidar_beside_the_camera():
    """However many columns it has: shadows are as fine as the pictures need."""
    alone = next(iter(vs.render(recipe(rig=None, channels=["rgb"]))))
    beside = next(iter(vs.render(recipe({"rings": 1, "elevation": [-1, 1], "azimuth_step": 0.1}, channels=["rgb"]))))
    np.testing.assert_array_equal(beside.rgb, alone.rgb)


def test_a_lidar_is_no_camera_of_a_blend_file():
    front, top = vs.render(recipe())
    assert (is_camera_view(front), is_camera_view(top)) == (True, False)


def moving(sweep, **changes):
    """A post box that passes a sensor which goes around it."""
    motion = {"kind": "constant", "velocity": [0, -8, 0]}
    model = {"source": "zoo:post_box", "category": "box", "motion": motion}
    said = {
        "models": [model],
        "viewpoints": {"kind": "orbit", "azimuth": [20, 60], "elevation": [15, 20], "distance": [8, 7]},
        "time": {"frames": 3, "fps": 10},
        "splits": {"by": "sequence", "train": 1},
    }
    return recipe({"sweep": sweep, "azimuth_step": 1}, **{**said, **changes})


@pytest.mark.slow
def test_a_sweep_does_not_depend_on_how_sequences_are_cut():
    cut, whole = ([s.channels["lidar"] for s in vs.render(moving(0.1, shot_frames=n)) if s.sensor == "top"] for n in (1, 3))
    still = [s.channels["lidar"] for s in vs.render(moving(0)) if s.sensor == "top"]
    for one, other, at_once in zip(cut, whole, still, strict=True):
        np.testing.assert_array_equal(one, other)
        np.testing.assert_allclose(one["time"], (one["column"] + 0.5) / 360 * 0.1 - 0.05, atol=1e-8)
        assert not at_once["time"].any()
        then, now = matched(one, at_once)
        assert np.abs(then["range"] - now["range"]).max() > 0.01
        middle = np.abs(then["column"] - 180.0) < 1  # of the sweep: the instant itself
        np.testing.assert_allclose(then["range"][middle], now["range"][middle], rtol=2e-3)


TAMPERED = {
    "xyz": (lambda rows: rows["xyz"] + np.float32([0, 0, 0.01]), "expected points on the rays of their rings and columns"),
    "range": (lambda rows: rows["range"] * np.float32(1.001), "expected points on the rays of their rings and columns"),
    "ring": (lambda rows: rows["ring"][::-1], "expected at most one point of each ray, ring by ring"),
    "column": (lambda rows: rows["column"] + 5000, "expected rings below 12 and columns below 90"),
    "instance": (lambda rows: np.full(len(rows), 7), "expected points on objects of the sample; found"),
    "category": (lambda rows: np.full(len(rows), 9), "expected category 0 of object 0; found others"),
    "incidence": (lambda rows: rows["incidence"] + 2, "expected incidences of 0 to pi/2"),
    "intensity": (lambda rows: -rows["intensity"], "expected intensities of 0 or more"),
}


@pytest.fixture(scope="module")
def scanned():
    return points_of(recipe())[0]


@pytest.mark.parametrize("field", TAMPERED)
def test_what_was_changed_is_found(scanned, field):
    change, problem = TAMPERED[field]
    rows = scanned.channels["lidar"].copy()
    assert not list(LABEL.prove(scanned, {}))
    rows[field] = change(rows)
    found = list(LABEL.prove(replace(scanned, channels={"lidar": rows}), {}))
    assert any(one.startswith(problem) for one in found)


@pytest.mark.slow
def test_check_finds_times_that_are_not_those_of_the_sweep(tmp_path):
    """Of which nothing else in a sample says anything: labels are computed again."""
    out = tmp_path / "out"
    vs.generate(moving(0.1, formats=["native"]), out, workers=0)
    assert check(Dataset(out), rays=False).ok
    file = next(out.glob("store/shots/**/lidar/*.npz"))
    rows = decode_npz(file.read_bytes(), "lidar")
    rows["time"] += 0.01
    file.write_bytes(encode_npz(rows, "lidar"))
    seal_again(out)
    assert "lidar" in {finding.check for finding in check(Dataset(out), rays=False).findings}


@pytest.mark.slow
def test_points_are_drawn_from_above():
    """Ahead at the top; a preview shows them beside the camera's picture."""
    car = {"source": "zoo:car", "category": "car", "scale": {"length": 1.8}}
    said = recipe({"azimuth_step": 1, "elevation": [-40, -2]}, channels=["rgb"], models=[car])
    front, top = vs.render(said)
    picture = draw_sample(top, width=200)
    assert picture.shape == (200, 200, 3)
    rows, columns = np.nonzero((picture == color_of(1)).all(axis=2))
    own = top.channels["lidar"]["xyz"][top.channels["lidar"]["instance"] == 1]
    assert len(rows) > 10
    assert (rows < 100).mean() > 0.9
    assert ((columns < 100).mean() > 0.5) == ((own[:, 1] > 0).mean() > 0.5)
    assert contact_sheet([front, top], width=200).shape[0] > 200


@pytest.mark.parametrize(
    ("lidar", "problem"),
    [
        ({"rings": 10_000, "azimuth_step": 0.01}, "expected at most 10,000,000 rays and 65,535 columns; found 10,000 rings"),
        ({"azimuth_step": 0.001}, "found 12 rings of 360,000 columns"),
        ({"azimuth_step": 7}, "expected azimuth_step to divide azimuth; found 7 for 360 degrees"),
        ({"azimuth_step": 1e-300}, "found 12 rings of 3.6e\\+302 columns: take"),
        ({"azimuth_step": 0}, "azimuth_step"),
        ({"azimuth_step": float("nan")}, "azimuth_step"),
        ({"azimuth": [-300, 300]}, "expected at most a whole turn, 360 degrees; found 600"),
        ({"azimuth": [20, -20]}, "azimuth: expected \\[low, high\\]"),
        ({"elevations": [1, 2]}, "expected rings and elevation, or elevations; found both"),
        ({"rings": None, "elevation": None}, "or elevations; found neither"),
        ({"rings": None, "elevation": None, "elevations": [1, 1]}, "one of them is listed twice: remove it"),
        ({"elevation": [-100, 0]}, "elevation"),
        ({"range": [10, 5]}, "range: expected \\[low, high\\]"),
        ({"range": [-1, 5]}, "range"),
        ({"reference_range": 0}, "reference_range"),
        ({"sigma": -0.1}, "sigma"),
        ({"sweep": -1}, "sweep"),
        ({"sigma": float("nan")}, "sigma"),
        ({"dropout": 1.5}, "dropout"),
        ({"dropout_by_range": [[5, 0.1], [1, 0.2]]}, "expected pairs whose first numbers ascend"),
        ({"dropout_by_intensity": [[0, float("nan")]]}, "dropout_by_intensity"),
    ],
)
def test_what_is_no_lidar_is_said(lidar, problem):
    with pytest.raises(RecipeError, match=problem):
        recipe(lidar)


TOP = {"lidar": {"rings": 4, "elevation": [-10, 0]}}


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"rig": {"sensors": {"top": TOP | {"fov_deg": 40}}}}, "expected none of size, fov_deg"),
        (
            {"rig": {"sensors": {"top": TOP | {"channels": ["rgb"]}}}, "channels": ["rgb"]},
            "a LiDAR takes no pictures; found rgb",
        ),
        ({"rig": {"sensors": {"front": {"channels": ["lidar"]}, "top": TOP}}}, "expected what a camera sees; found lidar"),
        ({"rig": {"sensors": {"top": {"lidar": TOP["lidar"] | {"sweep": 0.1}}}}}, "sweep: expected time beside it"),
        (
            {
                "rig": {"sensors": {"top": {"lidar": TOP["lidar"] | {"sweep": 0.2}}}},
                "time": {"frames": 2, "fps": 10},
                "splits": {"by": "sequence", "train": 1},
            },
            "sweep: expected at most the 0.1 seconds between two instants; found 0.2",
        ),
        ({"rig": None, "channels": ["lidar"]}, "expected rig beside lidar, with a LiDAR among its sensors; found none"),
        ({"rig": {"kind": "stereo", "baseline": 0.1}, "channels": ["lidar"]}, "with a LiDAR among its sensors; found none"),
        (
            {"rig": {"sensors": {"top": TOP, "front": {}}}, "camera": {"fov_deg": [30, 50]}},
            "expected a camera as the first sensor, as the camera's lens is drawn or its file's; found the LiDAR top",
        ),
        (
            {"formats": ["coco"], "channels": ["rgb", "instances"]},
            "rig.sensors.top.channels: expected .*, which format coco needs; found lidar: leave coco out",
        ),
    ],
)
def test_what_a_rig_cannot_have_is_said(changes, problem, tmp_path):
    with pytest.raises(RecipeError, match=problem):
        vs.generate(recipe(**changes), tmp_path / "out", workers=0)


def test_a_lidar_of_a_sequence_is_shown_beside_its_camera(tmp_path):
    moving = {"channels": ["rgb", "instances"], "time": {"frames": 2, "fps": 5}, "splits": {"by": "sequence", "train": 1}}
    vs.generate(recipe(**moving), tmp_path, workers=0)
    dataset = Dataset(tmp_path)
    assert [film.sensors for film in films_of(dataset)] == [("front",)]
    assert [film.sensors for film in films_of(dataset, is_shown)] == [("front", "top")]
    sheet = contact_sheet(list(dataset), ["lidar"])
    assert any((sheet == draw).all(axis=2).any() for draw in np.array([color_of(o.id) for o in dataset[0].objects]))


TILES = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [128, 128, 128]]], np.uint8)
WALL = """\
mtllib wall.mtl
usemtl tiles
v -1 0 0
v 1 0 0
v 1 2 0
v -1 2 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
f 1/1 2/2 3/3 4/4
"""


@pytest.fixture
def wall(tmp_path):
    """What a recipe says of a wall of four tiles, 2 m wide and high."""
    (tmp_path / "wall.obj").write_text(WALL)
    (tmp_path / "wall.mtl").write_text("newmtl tiles\nKd 1 1 1\nmap_Kd tiles.png\n")
    Image.fromarray(TILES).save(tmp_path / "tiles.png")
    sensor = {"rings": 40, "elevation": [-20, 20], "azimuth": [-30, 30], "azimuth_step": 0.5, "range": [0.5, 50]}

    def said(lidar=None, **changes):
        rig = {"sensors": {"front": {}, "top": {"rotation": [0, 10, 0], "lidar": sensor | (lidar or {})}}}
        models = [{"source": str(tmp_path / "wall.obj"), "category": "wall"}]
        return recipe(models=models, rig=rig, **{"viewpoints": {"azimuth": [15], "elevation": [5], "distance": 4}} | changes)

    return said


def albedo_of(rows):
    """What is left of the intensity without incidence and range, for a reference of 10 m."""
    return rows["intensity"] / np.cos(rows["incidence"]) * (rows["range"] / 10.0) ** 2


def test_a_picture_s_texels_send_back_their_luminance(wall):
    sample, rows = points_of(wall())
    (o,) = sample.objects
    own = rows[rows["instance"] == o.id]
    x, y, z = ((in_world(sample, own) - o.world_from_object[:3, 3]) @ o.world_from_object[:3, :3]).T
    clear = (np.abs(x) > 1e-4) & (np.abs(z - o.box3d_object[:, 2].mean()) > 1e-4)
    np.testing.assert_allclose(y, o.box3d_object[:, 1].mean(), atol=1e-4)
    texels = TILES[(z < o.box3d_object[:, 2].mean()).astype(int), (x > 0).astype(int)]
    expected = linear(texels / 255.0) @ LUMINANCE
    assert len(np.unique(expected[clear])) == 4 and clear.sum() > 500
    np.testing.assert_allclose(albedo_of(own)[clear], expected[clear], rtol=1e-4)


def test_a_sweep_in_which_nothing_moves_has_the_same(wall):
    """As far as points do not lie next to where tiles meet."""
    still = {"viewpoints": {"kind": "orbit", "azimuth": [15, 15], "elevation": [5, 5], "distance": [4, 4]}}
    still |= {"time": {"frames": 2, "fps": 5}, "splits": {"by": "sequence", "train": 1}}
    _, rows = points_of(wall(**still))
    _, swept = points_of(wall({"sweep": 0.1}, **still))
    one, other = matched(rows, swept)
    assert len(one) > 0.99 * len(rows)
    assert (np.abs(one["intensity"] - other["intensity"]) > 1e-4 * one["intensity"]).mean() < 0.002


@pytest.mark.slow
def test_changes_to_materials_change_it_and_are_checked(wall, tmp_path):
    """Tints, and pictures; labels computed again from exported models have the same, and so the same points drop out."""
    _, rows = points_of(wall())
    tinted = {"scene": {"materials": [{"tint": [0.5, 0.5, 0.5]}], "ground": {"color": [1, 1, 1]}}}
    _, dark = points_of(wall(**tinted))
    own = rows["instance"] > 0
    np.testing.assert_allclose(dark["intensity"][own], rows["intensity"][own] / 2, rtol=1e-6)
    np.testing.assert_allclose(albedo_of(dark)[~own], 1, rtol=1e-4)
    Image.new("RGB", (2, 2), (128, 128, 128)).save(tmp_path / "gray.png")
    painted = {"scene": {"materials": [{"image": str(tmp_path / "gray.png")}]}}
    _, gray = points_of(wall(**painted))
    np.testing.assert_allclose(albedo_of(gray)[own], linear(128 / 255), rtol=1e-4)
    level = float(np.median(rows["intensity"]))
    for said in ({}, tinted, painted):
        out = tmp_path / f"out{len(str(said))}"
        vs.generate(wall({"dropout_by_intensity": [[0, 1], [level, 0.5], [2 * level, 0]]}, **said), out, workers=0)
        kept = next(s for s in Dataset(out) if s.sensor == "top").channels["lidar"]
        assert 0 < len(kept) < len(rows)
        assert check(Dataset(out), rays=False).ok
    (tmp_path / "gray.png").unlink()  # it is no part of the data set, which may have come from elsewhere
    report = check(Dataset(out), rays=False)
    assert report.ok and "lidar" in report.not_run, report
