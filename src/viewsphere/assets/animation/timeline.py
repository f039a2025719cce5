"""A file's timeline, from its reader or else from Blender, cached until the file, or a file that it names, changes."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from viewsphere.assets.animation.clip import Clip, Timeline
from viewsphere.assets.cache import cached_facts
from viewsphere.assets.load import animated_reader, suffix_of
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.paths.inside import split_source
from viewsphere.assets.readers import reader_of
from viewsphere.assets.readers.blender.reading import asked, read_named, remember_layers, started
from viewsphere.assets.sandbox.client import timeline_apart
from viewsphere.blender.process import BlenderProcess
from viewsphere.errors import ModelError


@dataclass(eq=False)
class Blenders:
    """Blender processes that answer requests about files, one for all files of a folder. A context manager, which ends them."""

    _stack: ExitStack
    _running: dict[tuple[Path, bool], BlenderProcess]

    @staticmethod
    def none_yet() -> Blenders:
        """The object without running processes: each Blender starts when it is first needed."""
        return Blenders(ExitStack(), {})

    def __enter__(self) -> Blenders:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def answer(self, path: Path, confined: bool, do: str, about: Mapping[str, Any]) -> dict[str, Any]:
        """The answer to a request about a file, cached or from Blender; raises a one-line ModelError if Blender has no
        answer.
        """
        file = split_source(path)[0]
        animated_reader(file)

        def ask() -> tuple[dict[str, Any], list[Path]]:
            folder = ModelFolder(file, confined)
            read_named(folder)
            answer = self._asked(folder, do, about)
            return answer, [*folder.files, *map(Path, answer["files"])]

        return cached_facts(file, f"{do} {confined} {sorted(about.items())}", ask)

    def timeline(self, path: Path, confined: bool, clip: str | None = None, fps: float | None = None) -> Timeline:
        """The file's timeline while the animation `clip` plays, by default the first one, at `fps` frames per second, by
        default the file's own rate.
        """
        file = split_source(path)[0]
        if animated_reader(file).timeline is not None:
            return _timeline_apart(file, confined, clip, fps)
        return _timeline_of(self.answer(path, confined, "timeline", {"clip": clip, "fps": fps}))

    def _asked(self, folder: ModelFolder, do: str, about: Mapping[str, Any]) -> dict[str, Any]:
        place = folder.model.parent.resolve(), folder.confined
        if place not in self._running:
            self._running[place] = self._stack.enter_context(started(folder))
        process = self._running[place]
        begun = process.log.stat().st_size
        try:
            answer = asked(folder, process, do, **about)
        except ModelError:
            self._running.pop(place).close()  # a Blender that failed to answer may have died
            raise
        remember_layers(folder, process.log, begun)
        return answer


def _timeline_of(told: Mapping[str, Any]) -> Timeline:
    return Timeline(told["first"], told["last"], told["fps"], told["moves"], tuple(Clip(**clip) for clip in told["clips"]))


def _timeline_apart(file: Path, confined: bool, clip: str | None = None, fps: float | None = None) -> Timeline:
    """The timeline that a file's own reader reads."""
    about = f"timeline apart {confined} {clip} {fps}"
    return _timeline_of(cached_facts(file, about, lambda: timeline_apart(file, confined, clip, fps)))


def animation_of(path: Path, confined: bool) -> Timeline | None:
    """The timeline of a file in which something moves, None for any other. If no reader supplies the timeline, Blender reads
    it.

    Raises ModelError if Blender has no answer or is not installed.
    """
    file = split_source(path)[0]
    suffix = suffix_of(file)
    reader = reader_of(suffix)
    if reader is not None and reader.timeline is not None:
        line = _timeline_apart(file, confined)
    elif reader_of(suffix, moving=True) is None:
        return None
    else:
        with Blenders.none_yet() as blenders:
            line = blenders.timeline(path, confined)
    return line if line.moves else None
