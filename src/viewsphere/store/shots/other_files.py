"""The error for a recipe with the fields of a data set but other files."""

from __future__ import annotations

from collections.abc import Sequence

from viewsphere.model.quantity import first_few


def other_files(then: Sequence[str], now: Sequence[str]) -> str:
    """The problem and its fix; `then` and `now` are the keys of a data set's models and of the recipe's."""
    gone, new = _without(then, now), _without(now, then)
    if gone:
        are, them = ("is", "it") if len(gone) == 1 else ("are", "them")
        what = f"with other model files: {first_few(gone)} {are} not in the recipe any more. Restore {them}"
    elif new:
        what = f"without {first_few(new)}. Add {'it' if len(new) == 1 else 'them'} with --append"
    else:
        what = "with other files: pictures, poses or scripts that the recipe names. Restore them, add with --append"
    return f"this folder was rendered {what}, or choose another output folder"


def _without(some: Sequence[str], others: Sequence[str]) -> list[str]:
    left = set(others)
    return [f"`{key}`" for key in some if key not in left]
