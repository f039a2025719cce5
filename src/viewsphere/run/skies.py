"""The pictures of a recipe's skies, decoded once before any worker starts: what their heads promise, pixels may not keep."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from viewsphere.planning.plan import Plan

MOST_SKIES = 64
"""Files that are decoded before rendering, half a second each of 4,096 x 2,048 texels; the others are when their turn comes."""


def check_skies(planned: Plan, tell: Callable[[int, int], None]) -> tuple[str, ...]:
    """Decode the files; gives what had to be mended in them, and tells how many are done of how many.

    Raises RecipeError for the first that is damaged, cut off, black, or mostly no numbers.
    """
    files = dict.fromkeys(file for (kind, _), files in planned.pictures.items() if kind == "hdri" for file in files)
    chosen = list(files)[:: -(-len(files) // MOST_SKIES) or 1]
    notes: list[str] = []
    for done, file in enumerate(chosen):
        from viewsphere.rendering.sky.environment_file import read_environment  # which takes a third of a second to load

        tell(done, len(chosen))
        notes += read_environment(Path(file)).notes
        tell(done + 1, len(chosen))
    return tuple(notes)
