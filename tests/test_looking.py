"""Looking at sequences: filmstrips, drawings of labels of motion, videos."""

import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from moving import moving_recipe
from sequence_recipe import eventful_recipe
from small import small_recipe
from viewsphere.check import check
from viewsphere.errors import MissingExtraError, StoreError, UserError
from viewsphere.labels import TAIL, drawings
from viewsphere.labels.motion_boundaries import COLOR
from viewsphere.labels.shared.drawing.flow_colors import picture as wheel_picture
from viewsphere.labels.tracks import colors_of, positions
from viewsphere.preview import (
    Earlier,
    contact_sheet,
    dataset_samples,
    draw_sample,
    films_of,
    preview_samples,
    write_video,
)
from viewsphere.preview.frame import draw_instant, extents
from viewsphere.preview.tiles import film_caption
from viewsphere.run.generate import generate
from viewsphere.store import Choice, Dataset


@pytest.fixture(scope="module")
def moving(tmp_path_factory):
    root = tmp_path_factory.mktemp("looking") / "out"
    generate(moving_recipe(), root)
    return Dataset(root)


def test_films_are_the_sequences_whether_samples_are_read_or_not(moving):
    films = films_of(moving)
    assert films == films_of(list(moving))
    assert [(film.sequence, film.sensors) for film in films] == [(f"post_box_00{i}", ("left", "right")) for i in (0, 1)]
    for film in films:
        assert film.instants == tuple(range(6))
        assert np.allclose(film.times, np.arange(6) / 12.5)
        assert np.allclose(film.shown_for, 1 / 12.5)
        for number, places in zip(film.instants, film.places, strict=True):
            shown = [moving[place] for place in places]
            assert [(s.sequence, s.sensor, s.instant) for s in shown] == [(film.sequence, n, number) for n in film.sensors]


def test_films_of_chosen_frames_leave_out_what_lacks_a_sensor(moving):
    chosen = Dataset(moving.root, Choice(frames=((0, 3), (4, 8))))
    (film,) = films_of(chosen)
    assert film.instants == (0, 2, 3)
    assert np.allclose(film.shown_for, (2 / 12.5, 1 / 12.5, 1 / 12.5))
    assert [chosen[place].instant for places in film.places for place in places] == [0, 0, 2, 2, 3, 3]


@pytest.mark.slow
def test_spread_takes_both_ends():
    (film, _) = films_of(list(preview_samples(moving_recipe(), 12, 32, row=6)))
    assert film.spread(3) == (0, 2, 5)
    assert film.spread(1) == (0,)
    assert film.spread(99) == (0, 1, 2, 3, 4, 5)


@pytest.mark.slow
def test_a_preview_of_a_recipe_shows_evenly_spaced_instants_of_its_sequences():
    shown = [(s.sequence, s.instant, s.sensor) for s in preview_samples(moving_recipe(), 6, 48, row=3)]
    assert shown == [
        (f"post_box_00{i}", instant, sensor) for i in (0, 1) for instant in (0, 2, 5) for sensor in ("left", "right")
    ]
    first = next(iter(preview_samples(moving_recipe(), 6, 48, row=3)))
    assert (first.width, first.height) == (48, 36)
    assert "flow" not in first.channels  # nobody asked for it
    assert "flow" in next(iter(preview_samples(moving_recipe(), 1, 48, ["flow"]))).channels


def test_labels_of_a_preview_are_those_of_neighbouring_instants(moving):
    """Instants far apart are shown, but flow leads to the next one."""
    shown = {s.instant: s for s in preview_samples(moving_recipe(), 2, draw=["flow"], row=2) if s.sensor == "left"}
    assert set(shown) == {0, 5}
    assert np.array_equal(shown[0].flow, moving[0].flow, equal_nan=True)
    assert np.isnan(shown[5].flow).all()


def test_a_filmstrip_holds_every_instant_in_order_and_begins_a_row_for_each_sequence(moving):
    films = films_of(moving)
    samples = dataset_samples(moving, 6, 3, films)
    assert [(s.sequence[-1], s.instant) for s in samples[::2]] == [(q, i) for q in "01" for i in (0, 2, 5)]
    sheet = contact_sheet(samples, columns=3)
    height, width = 72, 2 * 96 + 4
    for row in range(2):
        for column, instant in enumerate((0, 2, 5)):
            left, right = (moving[place].rgb for place in films[row].places[instant])
            y, x = 8 + row * (height + 26), 8 + column * (width + 8)
            assert np.array_equal(sheet[y : y + height, x : x + 96], left)
            assert np.array_equal(sheet[y : y + height, x + 100 : x + 196], right)
    assert film_caption(films[0], 2) == "post_box_000  left | right  #2  0.160 s"


def test_a_point_is_drawn_in_its_colour_filled_where_it_is_seen_and_hollow_where_it_is_occluded(moving):
    sample = moving[2]
    rows = sample.tracks.copy()
    rows["state"][0::2], rows["state"][1::2] = 0, 1
    sample = replace(sample, channels={**sample.channels, "rgb": np.zeros_like(sample.rgb), "tracks": rows})
    where, colors = positions(sample), colors_of(rows, 96, 72)
    inside = [i for i, (x, y) in enumerate(where) if 4 < x < 92 and 4 < y < 68]
    apart = [i for i in inside if min(np.hypot(*(where[i] - where[j])) for j in range(len(where)) if j != i) > 6]
    pictures = draw_sample(sample, ["tracks"])
    assert {rows["state"][i] for i in apart} == {0, 1}
    for i in apart:
        x, y = np.floor(where[i]).astype(int)
        near = {tuple(c) for c in pictures[y - 3 : y + 4, x - 3 : x + 4].reshape(-1, 3).tolist()}
        assert near == {(0, 0, 0), colors[i]}
    hollow, filled = (
        [int((pictures[int(y) - 3 : int(y) + 4, int(x) - 3 : int(x) + 4] > 0).any(-1).sum()) for x, y in where[keep]]
        for keep in ([i for i in apart if rows["state"][i] == state] for state in (1, 0))
    )
    assert max(hollow) < min(filled)


def test_points_that_are_outside_behind_or_invalid_are_not_drawn(moving):
    sample = moving[2]
    rows = sample.tracks.copy()
    rows["state"] = 2 + np.arange(len(rows)) % 3
    sample = replace(sample, channels={**sample.channels, "tracks": rows})
    assert np.array_equal(draw_sample(sample, ["tracks"]), sample.rgb)


def test_positions_at_the_query_are_the_query(moving):
    sample = moving[0]
    assert np.abs(positions(sample) - sample.tracks["query"]).max() < 1e-9


def test_colours_of_points_tell_places_apart(moving):
    colors = colors_of(moving[0].tracks, 96, 72)
    assert len(set(colors)) == len(colors) == 8 * 6


def test_trails_lead_from_where_points_were(moving):
    films = films_of(moving)
    before = Earlier(moving, films)
    last = moving[films[0].places[5][0]]
    seen = before(last)
    assert [(s.instant, s.sensor) for s in seen] == [(i, "left") for i in range(5)]
    assert len(seen) <= TAIL
    assert before(moving[0]) == []
    drawn = np.abs(draw_sample(last, ["tracks"], None, before).astype(int) - draw_sample(last, ["tracks"])).max(axis=-1) > 40
    moved = [i for i in np.flatnonzero(last.tracks["object"]) if last.tracks["state"][i] == 0]
    assert moved
    for i in moved:
        x, y = ((positions(seen[2]) + positions(seen[3])) / 2)[i]  # on the way
        assert drawn[int(y) - 1 : int(y) + 2, int(x) - 1 : int(x) + 2].any()


def test_boundaries_are_lines_of_their_colour_and_nothing_else(moving):
    sample = moving[2]
    on = sample.motion_boundaries > 0
    assert 10 < on.sum() < 1000
    drawn = draw_sample(sample, ["motion_boundaries"])
    assert (drawn[on] == COLOR).all()
    assert np.array_equal(drawn[~on], sample.rgb[~on])


def test_pictures_of_a_sequence_share_their_colours(moving):
    samples = [moving[i] for i in range(4)]
    within = extents(samples, ["flow", "depth", "disparity", "flow_state"])
    assert set(within) == {"flow", "depth", "disparity"}
    known = {drawing.name: drawing for drawing in drawings()}
    for name, (low, high) in within.items():
        own = [known[name].extent(sample) for sample in samples]
        assert (low, high) == (min(a for a, _ in own), max(b for _, b in own))
    flow = known["flow"].picture(samples[0], within["flow"])
    assert np.array_equal(flow, wheel_picture(samples[0].flow, within["flow"][1]))


def test_sensors_are_side_by_side_with_labels_below_them(moving):
    samples = [moving[0], moving[1]]
    drawn = draw_instant(samples, ["flow", "flow_state"], None, lambda sample: (), {})
    assert drawn.shape == (3 * 72, 2 * 96 + 4, 3)
    assert np.array_equal(drawn[:72, :96], samples[0].rgb)
    assert np.array_equal(drawn[72:144, 100:], wheel_picture(samples[1].flow))


def test_colours_are_explained_below_a_sheet(moving):
    samples = [moving[0], moving[1]]
    plain, explained = (contact_sheet(samples, draw) for draw in ((), ("motion_boundaries",)))
    assert explained.shape[0] > plain.shape[0]
    assert (explained[plain.shape[0] :] == COLOR).all(axis=-1).sum() > 50


def test_what_nobody_can_draw_is_refused(moving):
    with pytest.raises(StoreError, match=r"^--draw: .*'flaw'.*flow"):
        contact_sheet([moving[0]], ["flaw"])
    with pytest.raises(StoreError, match=r"^--draw: expected the channel scene_flow, to draw scene_flow; found pictures that"):
        contact_sheet([moving[0]], ["scene_flow"])
    only_left = [moving[0], replace(moving[1], channels={"rgb": moving[1].rgb})]
    assert contact_sheet(only_left, ["flow"]).shape[1] == 2 * 96 + 4 + 16  # one sensor may have less


def pages(file: Path):
    picture = Image.open(file)
    for i in range(picture.n_frames):
        picture.seek(i)
        yield picture.info.get("duration"), np.asarray(picture.convert("RGB")).astype(int)


def test_a_webp_shows_every_instant_of_all_sequences_for_its_time(moving, tmp_path):
    made = write_video(moving, tmp_path / "all.webp")
    assert (made.sequences, made.pictures, made.seconds) == (2, 12, 0.96)
    films = films_of(moving)
    shown = list(pages(tmp_path / "all.webp"))
    assert len(shown) == 12
    assert sum(_durations(tmp_path / "all.webp")) == 960
    expected = [moving[places[0]].rgb.astype(int) for film in films for places in film.places]
    for (_, page), picture in zip(shown, expected, strict=True):
        assert page.shape[1] == 2 * 96 + 4
        errors = [np.abs(page[:72, :96] - other).mean() for other in expected]
        assert errors[next(i for i, other in enumerate(expected) if other is picture)] == min(errors) < 8


def _durations(file: Path) -> list[int]:
    """The milliseconds of an animated WebP's frames: bytes 12 to 14 of each ANMF chunk (the WebP container's specification)."""
    data, found, at = file.read_bytes(), [], 12
    while at < len(data):
        name, size = data[at : at + 4], int.from_bytes(data[at + 4 : at + 8], "little")
        if name == b"ANMF":
            found.append(int.from_bytes(data[at + 20 : at + 23], "little"))
        at += 8 + size + size % 2
    return found


@pytest.mark.slow
def test_an_mp4_shows_every_instant_in_order(moving, tmp_path):
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    made = write_video(moving, tmp_path / "one.mp4", ["flow", "tracks"], "post_box_001")
    assert (made.sequences, made.pictures, made.seconds) == (1, 6, 0.48)
    read = ffmpeg.read_frames(str(tmp_path / "one.mp4"))
    meta = next(read)
    assert (meta["codec"], meta["fps"], meta["duration"]) == ("h264", 12.5, 0.48)
    width, height = meta["size"]
    frames = [np.frombuffer(frame, np.uint8).reshape(height, width, 3).astype(int) for frame in read]
    film = films_of(moving)[1]
    within = extents([moving[place] for places in film.places for place in places], ["flow"])
    before = Earlier(moving, [film])
    for frame, places in zip(frames, film.places, strict=True):
        expected = draw_instant([moving[p] for p in places], ["flow", "tracks"], None, before, within)
        assert np.abs(frame[: expected.shape[0], : expected.shape[1]] - expected).mean() < 10


def test_a_video_of_still_pictures_is_refused(tmp_path):
    samples = list(preview_samples(small_recipe(), 2, 32))
    with pytest.raises(StoreError, match=r"^--video: expected sequences, found still pictures"):
        write_video(samples, tmp_path / "v.webp")
    assert not list(tmp_path.iterdir())


def test_mistakes_in_videos_are_named(moving, tmp_path, monkeypatch):
    with pytest.raises(UserError, match=r"ends in .mp4 or .webp; found .*v.avi"):
        write_video(moving, tmp_path / "v.avi")
    with pytest.raises(StoreError, match=r"^--sequence: 'car' is unknown\. Valid: post_box_000, post_box_001"):
        write_video(moving, tmp_path / "v.webp", sequence="car")
    with pytest.raises(StoreError, match="--draw: expected the channel scene_flow"):
        write_video(moving, tmp_path / "v.webp", ["scene_flow"])
    monkeypatch.setattr("viewsphere.preview.video.MOST_BYTES", 1000)
    with pytest.raises(UserError, match=r"expected pictures of at most .* write .mp4"):
        write_video(moving, tmp_path / "v.webp")
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'viewsphere\[video\]', or write .webp"):
        write_video(moving, tmp_path / "v.mp4")
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="place to write"):
        write_video(moving, tmp_path / "file" / "v.webp")
    assert [p.name for p in tmp_path.iterdir()] == ["file"]  # nothing half done


def test_a_video_goes_on_when_told_of_its_progress(moving):
    told = []
    write_video(moving, Path(moving.root.parent / "told.webp"), listener=lambda done, total: told.append((done, total)))
    assert told == [(i, 12) for i in range(1, 13)]


def test_keys_of_drawings_are_the_colours_that_are_drawn():
    known = {drawing.name: drawing for drawing in drawings()}
    ways = np.array([[[5.0, 0.0], [0.0, 5.0], [-5.0, 0.0], [0.0, -5.0]]])
    assert [list(color) for _, color in known["flow"].key] == wheel_picture(ways, 5.0)[0].tolist()
    assert len({color for _, color in known["flow_state"].key}) == 5


@pytest.mark.slow
def test_what_an_unfinished_data_set_lacks_is_said(tmp_path):
    sensors = {"left": {}, "right": {"position": [0.1, 0, 0], "channels": ["rgb"]}}
    made = eventful_recipe(
        4, rig={"sensors": sensors}, channels=["rgb"], tracks={"grid": 40}, scenes=None, shot_frames=2, formats=[], scene={}
    )
    generate(made, tmp_path, workers=0)
    dataset = Dataset(tmp_path)
    (name, *_) = dataset.sequences
    assert dataset.tracks(name, "left").xy.shape[0] == 4
    with pytest.raises(
        StoreError, match=r"found right, whose channels lack tracks: add tracks to rig\.sensors\.right\.channels"
    ):
        dataset.tracks(name, "right")
    for row in dataset.plan.rows:
        shutil.rmtree(dataset.store.shot_folder(row.key))
    dataset = Dataset(tmp_path)
    (finding, *_) = check(dataset).findings
    assert f"{len(made.models)} sequences x 4 instants" in str(finding)
    with pytest.raises(StoreError, match="--video: expected finished frames, found none: render first"):
        write_video(dataset, tmp_path / "none.webp")
