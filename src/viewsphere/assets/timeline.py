"""A file's timeline: that of a glTF file is read here, all others are asked from Blender. Answers are cached until the file, or
a file that it names, changes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from viewsphere.assets.cache import kept
from viewsphere.assets.clip import Clip, Timeline
from viewsphere.assets.load import ANIMATED_SUFFIXES, GLTF, USD, check_animated, needs_blender
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.paths.inside import split_source
from viewsphere.assets.readers.blender.reading import asked, read_named, remember_layers, started
from viewsphere.assets.readers.gltf.animation import timeline
from viewsphere.assets.readers.gltf.document import Document
from viewsphere.assets.sandbox.client import timeline_apart
from viewsphere.blender.process import BlenderProcess
from viewsphere.errors import ModelError


@dataclass(eq=False)
class Blenders:
    """Answers requests about files by running Blenders, one for all files of a folder. A context manager, which ends them."""

    _stack: ExitStack
    _running: dict[tuple[Path, bool], BlenderProcess]

    @staticmethod
    def none_yet() -> Blenders:
        """No Blender runs yet: each is started when it is first needed."""
        return Blenders(ExitStack(), {})

    def __enter__(self) -> Blenders:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def told(self, path: Path, confined: bool, do: str, about: Mapping[str, Any]) -> dict[str, Any]:
        """The answer to a request about a file, cached or from Blender; ModelError in one line when Blender has no answer."""
        file = split_source(path)[0]
        check_animated(file)

        def ask() -> tuple[dict[str, Any], list[Path]]:
            folder = ModelFolder(file, confined)
            read_named(folder)
            answer = self._asked(folder, do, about)
            return answer, [*folder.files, *map(Path, answer["files"])]

        return kept(file, f"{do} {confined} {sorted(about.items())}", ask)

    def timeline(self, path: Path, confined: bool, clip: str | None = None, fps: float | None = None) -> Timeline:
        """The file's timeline while the animation `clip` plays, by default the first one, in frames of which `fps` make a
        second, by default as many as the file says.
        """
        file = split_source(path)[0]
        if check_animated(file) in GLTF:
            told = kept(file, f"timeline here {clip} {fps}", lambda: self._of_gltf(file, confined, clip, fps))
        else:
            told = self.told(path, confined, "timeline", {"clip": clip, "fps": fps})
        return _timeline_of(told)

    def _of_gltf(
        self, file: Path, confined: bool, clip: str | None, fps: float | None
    ) -> tuple[dict[str, Any], Sequence[Path]]:
        """The timeline of a glTF file, and the files that hold it."""
        folder = ModelFolder(file, confined)
        return timeline(Document.read(folder), clip, fps), tuple(folder.files)

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


def animation_of(path: Path, confined: bool) -> Timeline | None:
    """The timeline of a file in which something moves, None for any other. Blender reads those of files that may move; of USD
    files, usd-core where it is installed.

    Raises ModelError where Blender has no answer, or there is none.
    """
    file = split_source(path)[0]
    if not _may_move(ModelFolder(file, confined)):
        return None
    suffix = file.suffix[1:].lower()
    if suffix in USD and not needs_blender(suffix):
        line = _timeline_of(kept(file, f"timeline by usd-core {confined}", lambda: timeline_apart(file, confined)))
        return line if line.moves else None
    with Blenders.none_yet() as blenders:
        line = blenders.timeline(path, confined)
    return line if line.moves else None


def _may_move(folder: ModelFolder) -> bool:
    """Return whether the format has animations and, of glTF, whose JSON is read here, the file has."""
    kind = folder.model.suffix[1:].lower()
    if kind not in GLTF:
        return kind in ANIMATED_SUFFIXES
    return bool(list(Document.read(folder).root.items("animations")))
