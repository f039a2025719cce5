"""The animations of a file, and the times at which they play; nothing here reads a file."""

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
    """First and last frame of a file, its frames a second, whether anything in it moves, and its animations."""

    first: int
    last: int
    fps: float
    moves: bool
    clips: tuple[Clip, ...] = ()

    def seconds(self, frame: int) -> float:
        """Seconds from the first frame to this one."""
        return (frame - self.first) / self.fps


def no_animation(file: object) -> str:
    """Return the error for a file without motion that is to play an animation; the text follows the recipe's field."""
    return f"expected a file in which something moves; found no animation in {file}"
