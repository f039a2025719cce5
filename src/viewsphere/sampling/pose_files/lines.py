"""Text files of numbers, line by line."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

from viewsphere.errors import RecipeError
from viewsphere.limits import limits


def read_text(path: Path, of: str = "poses", limit: str = "MAX_POSES_BYTES") -> str:
    """The text of a file in UTF-8; raises RecipeError if there is none, or one beyond the named limit."""
    try:
        size, most = path.stat().st_size, getattr(limits, limit)
        if size > most:
            raise RecipeError(
                f"{path}: expected a file of at most {most:,} bytes (limit {limit}); found {size:,}; set VIEWSPHERE_{limit} "
                "higher if it is meant so"
            )
        return path.read_text("utf-8-sig")
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
        raise RecipeError(f"{where}: expected a finite number; found {word!r}")
    return value


def counted(words: Sequence[str], count: int, where: str) -> list[float]:
    """Exactly `count` finite numbers."""
    if len(words) != count:
        raise RecipeError(f"{where}: expected {count} numbers; found {len(words)}")
    return numbers(words, where)
