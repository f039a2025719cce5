"""What formats of sequences share: eyes, ends and names of sequences."""

from __future__ import annotations

from dataclasses import replace

import pytest

from viewsphere.errors import StoreError, UserError
from viewsphere.formats.shared.writing.sequences import Eyes, check_whole, instants, number, scene


def test_names_sort_as_numbers_do():
    assert number(7, 9999) == "0007" and number(7, 10_000) == "00007" and number(7, 1, 6) == "000007"


def test_sequences_that_splits_cut_are_refused(videos):
    class Cut:
        splits = ("train", "val")
        plan = type("Plan", (), {"parts": (type("Part", (), {"recipe": {"splits": {"by": "frame"}}}),)})

    check_whole(videos, "sintel")
    with pytest.raises(UserError, match=r"sintel: expected splits that keep sequences whole; found splits\.by: frame"):
        check_whole(Cut, "sintel")


def test_lengths_and_names(videos, stills):
    assert {instants(videos, sample) for sample in videos} == {6}
    assert scene(videos[0]) == videos.sequences[0]
    with pytest.raises(UserError, match="frame 0: expected a picture of a sequence; found a still one: export sequences apart"):
        instants(stills, stills[0])
    for name in ("../away", "", "a/b", ".."):
        with pytest.raises(StoreError, match="frame 0: expected a sequence's name without /; found"):
            scene(replace(videos[0], sequence=name))


def test_eyes(videos, stills):
    eyes = Eyes(videos)
    assert [eyes.side(sample) for sample in videos[:3]] == ["left", "right", "left"]
    assert [eyes.numbers(sample) for sample in videos[:4]] == [(0, -2), (0, -2), (2, 0), (2, 0)]
    assert eyes.pair(videos[0]).baseline == pytest.approx(0.1) and eyes.lens(videos[0]) == videos[0].camera.intrinsics
    lone = Eyes(stills)
    assert (lone.side(stills[3]), lone.pair(stills[3]).baseline, lone.numbers(stills[3])) == ("left", 0, (3, 2))
    with pytest.raises(UserError, match="frame 0: expected sensors left, right; found top"):
        eyes.side(replace(videos[0], sensor="top"))
    with pytest.raises(StoreError, match="frame 0: expected the rig that took it; found an imported picture"):
        eyes.side(replace(videos[0], origin=None))
