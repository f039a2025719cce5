"""The animations of a file and the times at which they play. This module reads no files."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Clip:
    """One of a file's animations: its name, and its first and last frame."""

    name: str
    first: int
    last: int


@dataclass(frozen=True)
class Timeline:
    """First and last frame of a file, its frames per second, whether anything in it moves, and its animations."""

    first: int
    last: int
    fps: float
    moves: bool
    clips: tuple[Clip, ...] = ()

    def seconds(self, frame: int) -> float:
        """Seconds from the first frame to this one."""
        return (frame - self.first) / self.fps


def no_animation(file: object) -> str:
    """Return the error for a recipe that requests an animation of a file without motion; the text follows the recipe's
    field.
    """
    return f"expected a file in which something moves; found no animation in {file}"
