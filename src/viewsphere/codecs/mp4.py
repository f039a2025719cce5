"""MP4, written by the program ffmpeg in a separate process.

Pictures go to ffmpeg's standard input as Matroska, the simplest container that stores a display duration for each of them.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import tempfile
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from fractions import Fraction
from itertools import chain
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import MissingExtraError, UserError

Shown = tuple[NDArray[np.uint8], float]
"""A picture, and the seconds for which it is shown."""

CODECS = {"libx264": ("-crf", "18"), "libopenh264": ("-b:v", "20M"), "libsvtav1": ("-crf", "24")}
"""Encoders and their quality settings; the first that ffmpeg has is used. H.264 plays everywhere."""

THREADS = 4
"""The encoder's threads, the same on every machine: x264 writes different bytes with another number of threads."""

TICKS = 90_000
"""Smallest number of ticks per second in an MP4."""

REPEATABLE = ("-map_metadata", "-1", "-fflags", "+bitexact", "-flags:v", "+bitexact", "-threads", str(THREADS))
"""Options that keep dates and versions out of the file, so that equal pictures give equal bytes."""

ANSWER_S = 60.0
"""Seconds for ffmpeg's list of encoders; a hanging program ends after this time."""

GRACE_S = 5.0
"""Seconds in which ffmpeg may exit by itself once it has stopped reading."""


@dataclass(frozen=True)
class Encoder:
    """The program ffmpeg, and the name of its encoder. Errors begin with `asked`, the feature that requested an MP4, and end
    with `instead`, an alternative.
    """

    program: str
    codec: str
    asked: str = "--video"
    instead: str = ", or write .webp"


def encoder(asked: str = Encoder.asked, instead: str = Encoder.instead) -> Encoder:
    """The ffmpeg of the package imageio-ffmpeg (or the one that IMAGEIO_FFMPEG_EXE names), with the first of `CODECS` that it
    supports.

    Raises MissingExtraError if the package, a working ffmpeg, or all of these encoders are missing.
    """
    try:
        from imageio_ffmpeg import get_ffmpeg_exe
    except ImportError:
        raise MissingExtraError(
            f"{asked}: expected the package imageio-ffmpeg for .mp4, found none: pip install 'viewsphere[video]'{instead}"
        ) from None
    try:
        program = get_ffmpeg_exe()
        listed = subprocess.run([program, "-hide_banner", "-encoders"], capture_output=True, check=True, timeout=ANSWER_S)
    except (OSError, RuntimeError, subprocess.SubprocessError) as error:
        raise MissingExtraError(
            f"{asked}: expected an ffmpeg that starts; found: {error}: let IMAGEIO_FFMPEG_EXE name another{instead}"
        ) from None
    names = set(listed.stdout.decode(errors="replace").split())
    codec = next((name for name in CODECS if name in names), None)
    if codec is None:
        known = ", ".join(CODECS)
        raise MissingExtraError(f"{asked}: expected an encoder of {known} in {program}; found none: take another{instead}")
    return Encoder(program, codec, asked, instead)


def write_mp4(file: Path, shown: Iterable[Shown], by: Encoder) -> None:
    """Write pictures of one even size (height, width, 3; uint8, sRGB) as MP4, each shown for exactly its time if all have one
    rate, else to 1/90000 s. The same ffmpeg turns equal pictures into equal bytes.

    Raises UserError if ffmpeg cannot write them. In any case, ffmpeg has ended on return.
    """
    pictures = iter(shown)
    first = next(pictures)
    with tempfile.TemporaryFile() as said, _started(_command(file, first[1], by), said) as (process, pipe):
        taken = _fed(pipe, _matroska(first, chain([first], pictures)))
        with suppress(subprocess.TimeoutExpired):
            process.wait(None if taken else GRACE_S)
        if process.returncode != 0 or not taken:
            found = _end(process.returncode, said)
            raise UserError(f"{by.asked}: expected ffmpeg to write the video; found {found}: mend that{by.instead}")


def rate(seconds: float) -> Fraction:
    """Pictures per second if each is shown for this many seconds; rates such as 29.97 stay exact."""
    return Fraction(1 / seconds).limit_denominator(1001)


def _ticks(seconds: float) -> int:
    """Ticks per second, at least `TICKS`, that make this duration a whole number of ticks."""
    whole = rate(seconds).numerator
    return whole * -(-TICKS // whole)


def _command(file: Path, seconds: float, by: Encoder) -> list[str]:
    clock = _ticks(seconds)
    taken = ("-v", "error", "-nostdin", "-y", "-f", "matroska", "-i", "pipe:0")
    coded = ("-c:v", by.codec, *CODECS[by.codec], "-pix_fmt", "yuv420p", "-sws_flags", "bicubic+accurate_rnd+bitexact")
    timed = ("-fps_mode", "passthrough", "-enc_time_base", f"1:{clock}", "-video_track_timescale", str(clock))
    return [by.program, *taken, *coded, *timed, *REPEATABLE, "-movflags", "+faststart", "-f", "mp4", f"file:{file}"]


@contextmanager
def _started(command: list[str], said: IO[bytes]) -> Generator[tuple[subprocess.Popen[bytes], IO[bytes]]]:
    """The process of a command and its standard input; the process has ended when the block ends.

    The process has its own group: an interrupt from the terminal reaches only viewsphere, which then ends the process.
    """
    process = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=said,
        process_group=0 if os.name == "posix" else None,
        creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
    )
    pipe = process.stdin
    assert pipe is not None  # for type checkers
    try:
        yield process, pipe
    finally:
        process.kill()
        process.wait()
        with suppress(OSError):
            pipe.close()


def _fed(pipe: IO[bytes], parts: Iterator[bytes]) -> bool:
    """Return whether a program accepted all parts. Errors raised while making the parts propagate."""
    for part in parts:
        try:
            pipe.write(part)
        except OSError:
            return False
    try:
        pipe.close()
    except OSError:
        return False
    return True


def _end(code: int | None, said: IO[bytes]) -> str:
    """Return how ffmpeg ended, and its first message, which names the cause.

    code: the exit code, None if ffmpeg has not ended.
    """
    how = "that it reads no more" if code is None else f"exit code {code}"
    if code is not None and -code in set(signal.Signals):
        how = signal.Signals(-code).name
    said.seek(0)
    lines = (re.sub(r" @ 0x[0-9a-f]+", "", line).strip() for line in said.read().decode(errors="replace").split("\n"))
    why = next((line[:200] for line in lines if line), "")
    return f"{how} ({why})" if why else how


def _matroska(first: Shown, shown: Iterable[Shown]) -> Iterator[bytes]:
    """The minimal Matroska that ffmpeg accepts, with times in nanoseconds (RFC 9559; RFC 8794 for the elements)."""
    height, width = first[0].shape[:2]
    size = _element("B0", _number(width)) + _element("BA", _number(height)) + _element("2EB524", b"RGB\x18")
    kind = _element("D7", _number(1)) + _element("73C5", _number(1)) + _element("83", _number(1))
    coded = _element("86", b"V_UNCOMPRESSED") + _element("23E383", _number(_nanoseconds(first[1])))
    yield _element("1A45DFA3", _element("4282", b"matroska"))
    yield bytes.fromhex("18538067 01FFFFFFFFFFFFFF")  # the segment, of unknown length
    yield _element("1549A966", _element("2AD7B1", _number(1)))
    yield _element("1654AE6B", _element("AE", kind + coded + _element("E0", size)))
    start = 0.0
    for picture, seconds in shown:
        block = _element("A1", b"\x81\0\0\0" + picture.tobytes())
        lasts = _element("9B", _number(_nanoseconds(seconds)))
        yield _element("1F43B675", _element("E7", _number(_nanoseconds(start))) + _element("A0", block + lasts))
        start += seconds


def _element(name: str, content: bytes) -> bytes:
    return bytes.fromhex(name) + (1 << 56 | len(content)).to_bytes(8, "big") + content


def _number(value: int) -> bytes:
    return value.to_bytes(8, "big")


def _nanoseconds(seconds: float) -> int:
    return round(seconds * 1e9)
