"""Text files of numbers, line by line."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from viewsphere import files
from viewsphere.errors import RecipeError
from viewsphere.recipe.world.scene import LARGEST_IMAGE
from viewsphere.validation.errors import shown

_ALMOST = re.compile(r"[-+.,0-9eE]{0,24}|[A-Za-z]{1,3}")
"""Pattern of words that messages quote: those meant as numbers. Other words may come from a private file without poses."""

IDENTIFIER = re.compile(r"[0-9]{1,19}")
"""Pattern of COLMAP's numbers of cameras and images: the digits of 2^63, beyond which Python may refuse to read them."""


def read_text(path: Path, of: str = "poses", limit: str = "MAX_POSES_BYTES") -> str:
    """The text of a file in UTF-8; raises RecipeError if it is missing, not text, or beyond the named limit."""
    try:
        return files.read_text(path, limit, "utf-8-sig")
    except OSError as error:
        raise RecipeError(f"{path}: expected a readable file of {of}; found: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise RecipeError(f"{path}: expected text in UTF-8; found something else") from None


def read_lines(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Number, counted from 1, and words of every line that is neither empty nor a `#` comment."""
    for number, line in enumerate(read_text(path).splitlines(), 1):
        words = line.replace(",", " ").split()
        if words and not words[0].startswith("#"):
            yield number, words


def numbers(words: Sequence[str], where: str) -> list[float]:
    """The words as finite numbers; raises RecipeError, beginning with `where`, for any other."""
    return [number(word, where) for word in words]


def number(word: object, where: str) -> float:
    """One finite number of a text or of JSON; raises RecipeError, beginning with `where`, for anything else."""
    try:
        value = float(word) if isinstance(word, (str, int, float)) and not isinstance(word, bool) else math.nan
    except (ValueError, OverflowError):
        value = math.nan
    if not math.isfinite(value):
        hidden = "nothing" if word is None else "a text" if isinstance(word, str) and not _ALMOST.fullmatch(word) else None
        raise RecipeError(f"{where}: expected a finite number; found {hidden or shown(word)}")
    return value


def picture_size(width: object, height: object, where: str) -> tuple[int, int]:
    """Width and height in pixels, within the limits of a recipe's; raises RecipeError, beginning with `where`, for others."""
    sides = number(width, where), number(height, where)
    if any(side != int(side) or not 1 <= side <= LARGEST_IMAGE for side in sides):
        limits = f"whole numbers of pixels from 1 to {LARGEST_IMAGE}"
        raise RecipeError(f"{where}: expected {limits}; found {shown(width)} and {shown(height)}: set the pictures' size")
    return int(sides[0]), int(sides[1])


def counted(words: Sequence[str], count: int, where: str) -> list[float]:
    """Exactly `count` finite numbers."""
    if len(words) != count:
        raise RecipeError(f"{where}: expected {count} numbers; found {len(words)}")
    return numbers(words, where)
