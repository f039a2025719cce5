"""Pictures for people show what they say."""

from dataclasses import replace

import numpy as np
import pytest

from small import small_recipe
from viewsphere.geometry.box3d import Box3d
from viewsphere.labels.shared.drawing.colors import PALETTE
from viewsphere.labels.shared.drawing.depth_colors import picture as depth_picture
from viewsphere.model.model_spec import ModelSpec
from viewsphere.preview import contact_sheet, draw_sample, four_sides, preview_samples


@pytest.fixture(scope="module")
def samples():
    return list(preview_samples(small_recipe(), count=4))


def test_a_preview_spreads_over_models_and_poses(samples):
    assert {s.objects[0].key for s in samples} == {"post_box_000", "post_box_001"}
    assert len({s.pose.index for s in samples}) == 4


def test_a_small_preview_sees_what_the_full_picture_sees():
    small = next(iter(preview_samples(small_recipe(), count=1, width=48)))
    full = next(iter(preview_samples(small_recipe(), count=1)))
    assert small.rgb.shape == (36, 48, 3)
    assert np.allclose(small.objects[0].box2d_unclipped, np.array(full.objects[0].box2d_unclipped) / 2, atol=1e-9)


def test_the_2d_box_is_drawn_where_it_is(samples):
    sample = samples[0]
    drawn = draw_sample(sample, ["boxes"])
    changed = (drawn != sample.rgb).any(axis=2)
    rows, columns = np.nonzero(changed)
    x0, y0, x1, y1 = sample.objects[0].box2d
    assert (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1) == (x0, y0, x1, y1)


def test_masks_tint_the_object_and_nothing_else(samples):
    sample = samples[0]
    drawn = draw_sample(sample, ["masks"])
    mask = sample.objects[0].mask
    assert np.array_equal(drawn[~mask], sample.rgb[~mask])
    expected = (0.5 * sample.rgb[mask] + 0.5 * np.array(PALETTE[0])).round()
    assert np.array_equal(drawn[mask], expected)


def test_3d_boxes_and_depth_are_drawn(samples):
    drawn = draw_sample(samples[0], ["boxes3d", "depth"])
    height, width = samples[0].rgb.shape[:2]
    assert drawn.shape == (height, 2 * width, 3)
    assert (drawn[:, :width] != samples[0].rgb).any()


def test_every_edge_of_a_3d_box_is_drawn_but_those_to_vertices_that_are_not_seen(samples):
    sample, black = samples[0], np.zeros((200, 200, 3), np.uint8)
    pixels = np.array([(150, 30), (130, 190), (10, 170), (40, 50), (170, 5), (190, 140), (60, 120), (20, 10)], float)
    hidden = pixels.copy()
    hidden[7] = np.nan
    drawn = {}
    for name, vertices in (("all", pixels), ("hidden", hidden)):
        o = replace(sample.objects[0], box3d_pixels=vertices)
        picture = draw_sample(replace(sample, objects=(o,), channels={"rgb": black}), ["boxes3d"]).max(axis=2)
        middles = [(pixels[a] + pixels[b]) / 2 for a, b in Box3d.layout()["edges"]]
        drawn[name] = [bool(picture[int(y) - 1 : int(y) + 2, int(x) - 1 : int(x) + 2].max() > 100) for x, y in middles]
    assert all(drawn["all"])
    assert drawn["hidden"] == [7 not in edge for edge in Box3d.layout()["edges"]]


def test_near_is_light_and_nothing_is_black():
    picture = depth_picture(np.array([[1.0, 2.0, 3.0, np.inf]], np.float32))[0, :, 0]
    assert picture[0] > picture[1] > picture[2] > picture[3] == 0
    assert not depth_picture(np.full((2, 2), np.inf, np.float32)).any()


def test_a_picture_of_depth_tells_near_things_apart_before_a_far_horizon():
    """Each doubling of the distance is as much darker."""
    picture = depth_picture(np.array([[2.0, 4.0, 8.0, 16.0, 32.0, 64.0]], np.float32), (2.0, 64.0))[0, :, 0].astype(int)
    assert np.ptp(np.diff(picture)) <= 1 and picture[0] == 255


def test_normals_are_drawn_as_in_normal_maps(samples):
    normals = np.zeros((36, 48, 3), np.float32)
    normals[:12], normals[12:24], normals[24:30] = (1, 0, 0), (0, -1, 0), (0, 0, -1)
    channels = {"rgb": np.zeros((36, 48, 3), np.uint8), "normals": normals}
    right, up, near, nothing = draw_sample(replace(samples[0], channels=channels), ["normals"])[[0, 12, 24, 35], -1].tolist()
    assert (right, up, near, nothing) == ([255, 128, 128], [128, 255, 128], [128, 128, 255], [0, 0, 0])


def test_parts_have_colours_of_their_own_and_the_rest_is_grey(samples):
    parts = np.repeat(np.arange(12, dtype=np.int32)[None], 4, axis=0)
    channels = {"rgb": np.full((4, 12, 3), (200, 120, 100), np.uint8), "parts": parts}
    drawn = draw_sample(replace(samples[0], channels=channels), ["parts"])[0].astype(int)
    assert np.ptp(drawn[0]) == 0 and (np.ptp(drawn[1:], axis=1) > 100).all()
    apart = np.abs(drawn[:, None] - drawn[None]).max(axis=2) + 255 * np.eye(12, dtype=int)
    assert apart.min() > 25


def test_contact_sheet_holds_every_tile(samples):
    sheet = contact_sheet(samples, columns=2)
    tile = samples[0].rgb
    found = sum(
        np.array_equal(sheet[y : y + tile.shape[0], x : x + tile.shape[1]], s.rgb)
        for i, s in enumerate(samples)
        for y, x in [(8 + i // 2 * (tile.shape[0] + 26), 8 + i % 2 * (tile.shape[1] + 8))]
    )
    assert found == 4


def test_the_first_of_four_sides_shows_the_front(tmp_path):
    """A white box with a red face at -Y: the first view is red, the others are not."""
    corners = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    lines = ["mtllib box.mtl", *(f"v {x} {y} {z}" for x, y, z in corners)]
    faces = {"red": ["1 2 6 5"], "white": ["2 4 8 6", "4 3 7 8", "3 1 5 7", "5 6 8 7", "3 4 2 1"]}
    for name, rings in faces.items():
        lines += [f"usemtl {name}", *(f"f {ring}" for ring in rings)]
    (tmp_path / "box.obj").write_text("\n".join(lines) + "\n")
    (tmp_path / "box.mtl").write_text("newmtl red\nKd 1 0 0\nnewmtl white\nKd 1 1 1\n")
    spec = ModelSpec(key="b", source=str(tmp_path / "box.obj"), category="c", category_id=1, up="+z", forward="-y")
    picture = four_sides(spec, size=120).astype(int)
    width = picture.shape[1] // 4
    redness = [
        int(((p[..., 0] - p[..., 1:].max(axis=2)) > 60).sum())
        for p in (picture[:, i * width : (i + 1) * width] for i in range(4))
    ]
    assert redness[0] > 500
    assert max(redness[1:]) < redness[0] / 20


def test_a_preview_of_few_frames_shows_each_of_them_once():
    shown = [(s.objects[0].key, s.pose.index) for s in preview_samples(small_recipe(), 50, 48)]
    assert len(shown) == len(set(shown)) == 12


def test_a_sequence_is_shown_whatever_channels_its_sensors_keep():
    lidar = {"rings": 4, "elevation": [-20, 0], "azimuth_step": 6}
    sensors = {
        "front": {},
        "top": {"lidar": lidar, "channels": ["lidar", "instances"]},
        "labels": {"channels": ["depth"]},
    }
    recipe = small_recipe(
        channels=["rgb", "depth", "instances", "lidar"],
        viewpoints={"azimuth": [0], "elevation": [15], "distance": 1.0},
        rig={"sensors": sensors},
        time={"frames": 2, "fps": 5},
        formats=[],
    )
    samples = list(preview_samples(recipe, count=2, width=48))
    assert {sample.sensor for sample in samples} == set(sensors)
    drawn = list(preview_samples(recipe, count=2, width=48, draw=["lidar"]))
    assert any("lidar" in sample.channels for sample in drawn if sample.sensor == "top")
