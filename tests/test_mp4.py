"""Films as MP4: what is in the file, and what becomes of a program that fails."""

import os
import re
import stat
import subprocess
import time
from fractions import Fraction
from itertools import accumulate
from pathlib import Path

import numpy as np
import pytest

from viewsphere.codecs.mp4 import CODECS, GRACE_S, Encoder, encoder, rate, write_mp4
from viewsphere.errors import MissingExtraError, UserError

ffmpeg = pytest.importorskip("imageio_ffmpeg")
posix = pytest.mark.skipif(os.name != "posix", reason="programs of this test are shell scripts")


def _pictures(count: int) -> list[np.ndarray]:
    """A red square that moves to the right over a slope of greens, 64 x 48."""
    found = []
    for i in range(count):
        picture = np.zeros((48, 64, 3), np.uint8)
        picture[..., 1] = np.linspace(0, 255, 64).astype(np.uint8)
        picture[16:32, 4 * i : 4 * i + 16] = (255, 0, 0)
        found.append(picture)
    return found


def _boxes(data: bytes, path: str) -> bytes:
    """The content of the box at a path such as moov/mvhd (ISO/IEC 14496-12, 4.2)."""
    for name in path.split("/"):
        at = 0
        while data[at + 4 : at + 8] != name.encode():
            at += int.from_bytes(data[at : at + 4], "big")
        data = data[at + 8 : at + int.from_bytes(data[at : at + 4], "big")]
    return data


def _table(data: bytes) -> list[int]:
    """A value a picture, in the order of the file: stts and ctts (ISO/IEC 14496-12, 8.6.1.2 and 8.6.1.3)."""
    return [value for count, value in np.frombuffer(data[8:], ">i4").reshape(-1, 2).tolist() for _ in range(count)]


def _shown_at(file: Path) -> list[Fraction]:
    """The seconds at which pictures are shown and, after them, at which the film ends, to the millisecond."""
    movie = _boxes(file.read_bytes(), "moov")
    media, edit = _boxes(movie, "trak/mdia"), np.frombuffer(_boxes(movie, "trak/edts/elst")[8:16], ">i4").tolist()
    clock, thousand = (int.from_bytes(header[12:16], "big") for header in (_boxes(media, "mdhd"), _boxes(movie, "mvhd")))
    stored = list(accumulate(_table(_boxes(media, "minf/stbl/stts")), initial=0))[:-1]
    later = _table(_boxes(media, "minf/stbl/ctts")) if b"ctts" in media else [0] * len(stored)
    shown = sorted(at + offset - edit[1] for at, offset in zip(stored, later, strict=True))
    return [*(Fraction(at, clock) for at in shown), Fraction(edit[0], thousand)]


def _read(file: Path) -> list[np.ndarray]:
    read = ffmpeg.read_frames(str(file))
    width, height = next(read)["size"]
    return [np.frombuffer(frame, np.uint8).reshape(height, width, 3).astype(int) for frame in read]


@pytest.mark.parametrize("exact", [Fraction(25), Fraction("29.97"), Fraction(30000, 1001), Fraction("12.5"), Fraction(1, 2)])
def test_every_picture_is_shown_for_exactly_its_time(tmp_path, exact):
    seconds = 1 / float(exact)
    assert rate(seconds) == exact
    write_mp4(tmp_path / "v.mp4", ((picture, seconds) for picture in _pictures(7)), encoder())
    *shown, end = _shown_at(tmp_path / "v.mp4")
    assert shown == [i / exact for i in range(7)]
    assert float(end) == pytest.approx(7 * seconds, abs=0.001)


def test_pictures_of_several_rates_and_gaps_keep_their_times(tmp_path):
    lengths = [0.04, 0.12, 0.04, 1 / 29.97, 1 / 29.97, 0.5, 0.04]
    write_mp4(tmp_path / "v.mp4", zip(_pictures(7), lengths, strict=True), encoder())
    *shown, end = map(float, _shown_at(tmp_path / "v.mp4"))
    assert np.abs(np.array(shown) - np.cumsum([0.0, *lengths[:-1]])).max() <= 0.51 / 90_000
    assert end == pytest.approx(sum(lengths), abs=0.001)


@pytest.mark.parametrize("codec", CODECS)
def test_every_encoder_shows_the_pictures_that_it_was_given(tmp_path, codec):
    program = encoder().program
    if codec not in subprocess.run([program, "-encoders"], capture_output=True, text=True).stdout.split():
        pytest.skip(f"this ffmpeg has no {codec}")
    pictures = _pictures(6)
    write_mp4(tmp_path / "v.mp4", ((picture, 0.04) for picture in pictures), Encoder(program, codec))
    for frame, picture in zip(_read(tmp_path / "v.mp4"), pictures, strict=True):
        errors = [np.abs(frame - other).mean() for other in pictures]
        assert np.abs(frame - picture).mean() == min(errors) < 6


def test_equal_films_are_equal_bytes_without_dates_and_versions(tmp_path):
    for name in ("a.mp4", "b.mp4"):
        write_mp4(tmp_path / name, ((picture, 0.04) for picture in _pictures(5)), encoder())
    data = (tmp_path / "a.mp4").read_bytes()
    assert data == (tmp_path / "b.mp4").read_bytes()
    assert b"Lavf" not in data
    assert not re.search(rb"Lavc\d", data)
    assert _boxes(data, "moov/mvhd")[4:12] == bytes(8)
    assert data.index(b"moov") < data.index(b"mdat")  # plays before the whole file has come


def test_names_of_files_are_no_options_and_no_protocols(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("-y.mp4", "two words.mp4", *(["pipe:1.mp4", "100%d.mp4"] if os.name == "posix" else [])):
        write_mp4(Path(name), [(picture, 0.04) for picture in _pictures(2)], encoder())
        assert len(_shown_at(tmp_path / name)) == 2 + 1


def test_what_ffmpeg_cannot_do_is_one_line_of_its_own_words(tmp_path):
    with pytest.raises(UserError) as told:
        write_mp4(tmp_path / "none" / "v.mp4", [(picture, 0.04) for picture in _pictures(2)], encoder())
    assert str(told.value).startswith("--video: expected ffmpeg to write the video; found exit code ")
    assert "No such file or directory" in str(told.value)
    assert str(told.value).endswith("): mend that, or write .webp")
    assert "\n" not in str(told.value)
    assert " @ 0x" not in str(told.value)


def _program(folder: Path, script: str) -> Encoder:
    """A shell script in ffmpeg's place, which leaves its process's number."""
    file = folder / "ffmpeg"
    file.write_text(f"#!/bin/sh\necho $$ > '{folder}/begun' && mv '{folder}/begun' '{folder}/pid'\n{script}\n")
    file.chmod(file.stat().st_mode | stat.S_IXUSR)
    return Encoder(str(file), "libx264")


def _lives(folder: Path) -> bool:
    try:
        os.kill(int((folder / "pid").read_text()), 0)
    except ProcessLookupError:
        return False
    return True


@posix
@pytest.mark.parametrize(
    ("script", "found"),
    [
        ("head -c 99 > /dev/null; echo 'no room' >&2; echo 'Conversion failed!' >&2; exit 3", r"exit code 3 \(no room\)"),
        ("cat > /dev/null; exit 1", "exit code 1"),
        ("kill -9 $$", "SIGKILL"),
        ("head -c 99 > /dev/null; exit 0", "exit code 0"),
        ("exec sleep 100 < /dev/null", "that it reads no more"),
    ],
)
def test_a_program_that_fails_is_told_of_and_is_over(tmp_path, monkeypatch, script, found):
    monkeypatch.setattr("viewsphere.codecs.mp4.GRACE_S", GRACE_S / 10)
    with pytest.raises(UserError, match=rf"found {found}: mend that, or write .webp$"):
        write_mp4(tmp_path / "v.mp4", [(np.zeros((480, 640, 3), np.uint8), 0.04)] * 3, _program(tmp_path, script))
    assert not _lives(tmp_path)


@posix
def test_an_error_among_the_pictures_leaves_no_program_behind(tmp_path):
    def shown():
        yield np.zeros((48, 64, 3), np.uint8), 0.04
        while not (tmp_path / "pid").exists():
            time.sleep(0.01)
        assert _lives(tmp_path)
        raise OSError("a picture that cannot be read")

    with pytest.raises(OSError, match="a picture that cannot be read"):
        write_mp4(tmp_path / "v.mp4", shown(), _program(tmp_path, "exec cat > /dev/null"))
    assert not _lives(tmp_path)


def test_an_ffmpeg_that_is_not_there_or_has_no_encoder_is_named(tmp_path, monkeypatch):
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(tmp_path / "gone"))
    with pytest.raises(MissingExtraError, match=r"^--video: expected an ffmpeg that starts; found: .*gone.* or write .webp$"):
        encoder()
    if os.name == "posix":
        monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", _program(tmp_path, "echo ' V....D mpeg4  MPEG-4 part 2'").program)
        with pytest.raises(MissingExtraError, match=r"expected an encoder of libx264, libopenh264, libsvtav1 in .*ffmpeg"):
            encoder()
