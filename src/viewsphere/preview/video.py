"""Sequences as videos: MP4 or animated WebP."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from viewsphere.codecs.mp4 import Shown, encoder, write_mp4
from viewsphere.errors import StoreError, UserError
from viewsphere.labels import is_shown
from viewsphere.model.sample import Sample
from viewsphere.preview.frame import INK, PAPER, Picture, check_drawn, draw_instant, extents
from viewsphere.preview.tiles import CAPTION, MARGIN, film_caption, fitting, with_key
from viewsphere.store.samples.films import Earlier, Film, film_named, films_of
from viewsphere.store.shots.moving import move

PROBES = 12
"""Number of a sequence's instants that determine the value range of all its pictures."""

WIDEST = 3840
"""Pixels; wider instants are shrunk."""

MOST_BYTES = 2_000_000_000
"""Maximum bytes of all pictures of an animated WebP, which are in memory together."""

Listener = Callable[[int, int], None]


@dataclass(frozen=True)
class Video:
    """The numbers of a written video: its sequences, its pictures and its seconds."""

    sequences: int
    pictures: int
    seconds: float


def write_video(
    samples: Sequence[Sample],
    file: Path,
    draw: Sequence[str] = (),
    sequence: str | None = None,
    listener: Listener = lambda done, total: None,
) -> Video:
    """Write all sequences of samples (or the one named) one after another, their sensors side by side, at their own frame
    rates, with the labels named in `draw`, as MP4 or animated WebP, by the file's suffix.

    Raises StoreError for samples without sequences, unknown names and labels that are not there, UserError for other
    endings, for more pictures than a WebP may hold and where ffmpeg fails, MissingExtraError if ffmpeg is not installed.
    """
    write = _writer(file)
    films = films_of(samples, is_shown)
    if not samples:
        raise StoreError("--video: expected finished frames, found none: render first")
    if not films:
        raise StoreError("--video: expected sequences, found still pictures: give the recipe a time, or leave out --video")
    films = films if sequence is None else [film_named(films, sequence)]
    check_drawn([samples[place] for film in films for place in film.places[0]], draw)
    size = _size([_first(samples, film, draw) for film in films])
    total = sum(len(film.instants) for film in films)
    with _Atomic(file) as aside:
        write(aside, _told(_pictures(samples, films, draw, size), total, listener), size, total)
    return Video(len(films), total, round(sum(sum(film.shown_for) for film in films), 6))


@dataclass(frozen=True)
class _Atomic:
    """A file that appears only when it is complete."""

    file: Path

    def __enter__(self) -> Path:
        try:
            self.file.parent.mkdir(parents=True, exist_ok=True)
            self._aside.touch()
        except OSError as error:
            raise UserError(f"{self.file}: expected a place to write, found: {error.strerror or error}") from None
        return self._aside

    def __exit__(self, kind: object, *_: object) -> None:
        if kind is None:
            move(self._aside, self.file)
        else:
            self._aside.unlink(missing_ok=True)

    @property
    def _aside(self) -> Path:
        return self.file.with_name(f".unfinished-{self.file.name}")


def _told(shown: Iterator[Shown], total: int, listener: Listener) -> Iterator[Shown]:
    for done, each in enumerate(shown, 1):
        yield each
        listener(done, total)


def _first(samples: Sequence[Sample], film: Film, draw: Sequence[str]) -> tuple[int, int]:
    """Width and height of a film's instants, before they are put on pages of one size."""
    picture = draw_instant([samples[place] for place in film.places[0]], draw, None, lambda sample: (), {})
    shrink = min(1.0, WIDEST / picture.shape[1])
    return round(picture.shape[1] * shrink), round(picture.shape[0] * shrink)


def _size(sizes: Sequence[tuple[int, int]]) -> tuple[int, int]:
    """Even width and height, as encoders need, with room for all sizes."""
    width, height = (max(size[i] for size in sizes) for i in (0, 1))
    return width + width % 2, height + height % 2


def _pictures(samples: Sequence[Sample], films: Sequence[Film], draw: Sequence[str], size: tuple[int, int]) -> Iterator[Shown]:
    before = Earlier(samples, films)
    for film in films:
        probed = [samples[place] for i in film.spread(PROBES) for place in film.places[i]]
        within = extents(probed, draw)
        for i, (places, seconds) in enumerate(zip(film.places, film.shown_for, strict=True)):
            picture = draw_instant([samples[place] for place in places], draw, None, before, within)
            yield _page(picture, size, film_caption(film, i), draw), seconds


def _page(picture: Picture, size: tuple[int, int], caption: str, draw: Sequence[str]) -> Picture:
    """The picture at the top of a page, with its caption and the key of colours below."""
    page = Image.new("RGB", (size[0], size[1] + CAPTION), PAPER)
    shown = Image.fromarray(picture)
    if shown.width > size[0]:
        shown = shown.resize((size[0], round(shown.height * size[0] / shown.width)), Image.Resampling.LANCZOS)
    page.paste(shown, ((size[0] - shown.width) // 2, 0))
    font = ImageFont.load_default(size=12)
    words = fitting(caption, font, size[0] - MARGIN)
    ImageDraw.Draw(page).text((MARGIN // 2, size[1] + 2), words, fill=INK, font=font)
    whole = with_key(np.asarray(page), draw)
    return np.pad(whole, ((0, whole.shape[0] % 2), (0, 0), (0, 0)), mode="edge")


Write = Callable[[Path, Iterator[Shown], tuple[int, int], int], None]


def _writer(file: Path) -> Write:
    """Return the writer of files with this ending; raises as `write_video`."""
    if file.suffix.lower() == ".webp":
        return _write_webp
    if file.suffix.lower() != ".mp4":
        raise UserError(f"--video: expected a file that ends in .mp4 or .webp; found {file}")
    by = encoder()
    return lambda file, shown, size, total: write_mp4(file, shown, by)


def _write_webp(file: Path, shown: Iterator[Shown], size: tuple[int, int], total: int) -> None:
    if total * size[0] * size[1] * 3 > MOST_BYTES:
        raise UserError(
            f"--video: expected pictures of at most {MOST_BYTES / 1e9:.0f} GB in a .webp; found {total:,} of "
            f"{size[0]} x {size[1]}: write .mp4, or one --sequence"
        )
    pages, lengths = zip(*((Image.fromarray(page), seconds) for page, seconds in shown), strict=True)
    ends = [round(1000 * end) for end in accumulate(lengths, initial=0.0)]
    milliseconds = [stop - start for start, stop in pairwise(ends)]
    pages[0].save(file, "WEBP", save_all=True, append_images=pages[1:], duration=milliseconds, loop=0, quality=85, method=2)
