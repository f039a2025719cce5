"""Sequences in the report: which instants are played, their points and places, and the page's player."""

import json
import re

import numpy as np
import pytest

from moving import moving_recipe
from seen import differs, equals, looks, pixels
from viewsphere.labels.tracks import positions
from viewsphere.report import write_report
from viewsphere.report.frames import frame_data
from viewsphere.report.pictures import Scale, layers
from viewsphere.report.sequences import MOST_POINTS, extents_of, played, sequence_data
from viewsphere.run.generate import generate
from viewsphere.store import Dataset
from viewsphere.store.samples.films import Film, films_of


@pytest.fixture(scope="module")
def moving(tmp_path_factory):
    root = tmp_path_factory.mktemp("played") / "out"
    generate(moving_recipe(), root)
    return Dataset(root)


@pytest.fixture(scope="module")
def page_of_sequences(moving):
    file = moving.root / "report.html"
    write_report(moving, file)
    return file


@pytest.fixture(scope="module")
def moving_page(open_for_all, page_of_sequences):
    """Opened once: whoever clicks leaves it as it was."""
    return open_for_all(file=page_of_sequences)


def film(name, instants, sensors=1):
    times, places = np.arange(instants) / 10, np.arange(instants * sensors).reshape(instants, sensors)
    return Film(
        name, tuple("abcdef"[:sensors]), tuple(range(instants)), tuple(times.tolist()), tuple(map(tuple, places.tolist()))
    )


@pytest.mark.parametrize(
    ("films", "instants", "sensors", "frames"),
    [(1, 10, 2, 240), (1, 500, 2, 240), (50, 100, 1, 240), (9, 7, 6, 20), (3, 2, 1, 1)],
)
def test_what_is_played_fits_and_is_spread_over_all(films, instants, sensors, frames):
    made = [film(f"s{i}", instants, sensors) for i in range(films)]
    found = played(made, frames)
    shown = [len(one.instants) for one in found]
    assert sum(shown) * sensors <= max(frames, 2 * sensors)
    assert found[0].sequence == "s0"
    assert len(found) == 1 or found[-1].sequence == f"s{films - 1}"
    for one in found:
        assert len(one.instants) >= min(2, instants)
        assert (one.instants[0], one.instants[-1]) == (0, instants - 1)
        assert len(one.times) == len(one.places) == len(one.instants)
        assert sum(one.shown_for) == pytest.approx(instants / 10, abs=max(one.shown_for))


def test_nothing_is_played_of_still_pictures(small_dataset):
    assert films_of(small_dataset) == []
    assert played([], 240) == []
    assert "points" not in frame_data(small_dataset[0])


@pytest.mark.slow
def test_instants_name_the_frames_that_the_page_shows(moving):
    (first, second) = films_of(moving)
    shown = sorted(place for places in (*first.places, *second.places) for place in places)
    data = sequence_data(second, shown, 6)
    assert [[moving[shown[i]].instant for i in row] for row in data["frames"]] == [[i, i] for i in range(6)]
    assert [moving[shown[i]].sensor for i in data["frames"][0]] == data["sensors"] == ["left", "right"]
    assert data["seconds"] == [0.08] * 6


def test_points_boxes_and_the_camera_are_where_the_sample_says(moving):
    sample = moving[5]
    data = json.loads(json.dumps(frame_data(sample), allow_nan=False))
    assert (data["sequence"], data["sensor"], data["instant"], data["time"]) == ("post_box_000", "right", 2, 0.16)
    points = np.array(data["points"], float).reshape(-1, 3)
    known = np.isfinite(points[:, 0])
    assert len(points) == len(sample.tracks) <= MOST_POINTS
    assert np.abs(points[known, :2] / 10 - positions(sample)[known]).max() <= 0.0501
    assert np.array_equal(points[:, 2], sample.tracks["state"])
    pose = np.array(data["worldFromCamera"]).reshape(3, 4)
    assert np.allclose(pose[:, 3], sample.camera.center, atol=1e-5)
    assert np.allclose(pose[:, :3] @ sample.camera.R, np.eye(3), atol=1e-5)
    assert np.allclose(np.reshape(data["boxes"][0], (8, 3)), sample.objects[0].box3d, atol=6e-4)


def test_layers_of_a_sequence_share_their_ranges(moving):
    one = films_of(moving)[0]
    within = extents_of(moving, one)
    found = [layers(moving[places[0]], Scale(64, 60, 48), within) for places in one.places]
    assert {"flow", "flow_state", "disparity", "motion_boundaries"} <= set(found[0])
    assert len({(tuple(f["flowRange"]), tuple(f["disparityRange"])) for f in found}) == 1
    near, far = found[0]["disparityRange"]
    assert far < near
    assert len({tuple(layers(moving[places[0]], Scale(64, 60, 48))["flowRange"]) for places in one.places}) > 1


def test_the_page_holds_the_sequences(page_of_sequences):
    text = page_of_sequences.read_text("utf-8")
    data = json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)[1])
    assert [s["name"] for s in data["sequences"]] == ["post_box_000", "post_box_001"]
    assert data["summary"]["sequences"] == 2
    assert len(data["shown"]) == 24
    for sequence in data["sequences"]:
        for instant, row in zip(sequence["instants"], sequence["frames"], strict=True):
            frames = [data["shown"][i] for i in row]
            assert [(f["sequence"], f["instant"], f["sensor"]) for f in frames] == [
                (sequence["name"], instant, sensor) for sensor in ("left", "right")
            ]


@pytest.mark.slow
def test_the_player_steps_and_draws(moving_page, settle):
    page = moving_page
    player = page.locator("#player canvas").first
    assert page.locator("#player canvas").count() == 2
    assert page.locator("#filmstrip button").count() == 6
    first = pixels(player)
    page.locator("#filmstrip button").nth(4).click()
    assert page.inner_text("#player output").startswith("instant 4, 0.32 s")
    assert page.locator("#filmstrip button").nth(4).get_attribute("aria-current") == "true"
    settle(page)
    assert differs(player, first, 0.01)
    later = pixels(player)
    for name in ("tracks", "flow", "flow_state", "disparity", "motion_boundaries"):
        page.click(f"#sequence-layers [data-layer={name}]")
        assert differs(player, later, 0.005), name
        page.click(f"#sequence-layers [data-layer={name}]")
        assert equals(player, later, 0.002), name
    page.focus("#player button.card")
    page.keyboard.press("ArrowLeft")
    assert page.inner_text("#player output").startswith("instant 3,")
    page.select_option("select[name=sequence]", "post_box_001")
    assert page.inner_text("#player output").startswith("instant 0,")
    page.select_option("select[name=sequence]", "post_box_000")


@pytest.mark.slow
def test_the_player_plays_in_the_time_of_the_sequence_until_it_is_stopped(open_page, page_of_sequences):
    """The page's clock goes only where the test moves it; an instant takes 80 ms."""
    page = open_page(file=page_of_sequences)
    page.clock.install(time=0)
    page.clock.pause_at(1000)

    def instant():
        return int(re.match(r"instant (\d),", page.inner_text("#player output"))[1])

    page.click("#player .controls button")
    seen = []
    page.clock.run_for(40)
    for _ in range(8):
        seen.append(instant())
        page.clock.run_for(80)
    assert seen == [0, 1, 2, 3, 4, 5, 0, 1]
    page.click("#player .controls button")
    stopped = instant()
    page.clock.run_for(60_000)
    assert instant() == stopped


@pytest.mark.slow
def test_the_rig_is_drawn_in_3d_and_moves_with_the_instant(moving_page, settle):
    page = moving_page
    stage = page.locator("#rig-stage").first
    stage.scroll_into_view_if_needed()
    settle(page)
    assert looks(stage, lambda seen: (np.abs(seen - seen[2, 2]).max(axis=-1) > 40).mean() > 0.001)
    first = pixels(stage)
    page.locator("#filmstrip button").nth(5).click()
    stage.scroll_into_view_if_needed()
    assert differs(stage, first, 0.0005)
    assert page.inner_text("#rig-caption").startswith("The rig's 2 sensors")
    page.locator("#filmstrip button").first.click()
