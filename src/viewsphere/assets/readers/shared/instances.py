"""The number of object instances in DAE and 3MF files, where a few lines of nested references can request billions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from viewsphere.assets.paths.folder import ModelFolder

ENOUGH = 10**12
"""Counting stops here, since more digits would make messages endlessly long."""


def count_instances(references: Mapping[str, Sequence[str]], root: str) -> tuple[int | None, int]:
    """Number of objects that `root` expands to, itself included, when every reference is followed, and the depth of the
    deepest nesting.

    The number is None when an object is part of itself, and at most `ENOUGH`.
    """
    counts: dict[str, int | None] = {}
    depths: dict[str, int] = {}
    stack = [(root, False)]
    while stack:
        name, is_done = stack.pop()
        inner = references.get(name, ())
        if is_done:
            counts[name] = min(1 + sum(counts[other] or 0 for other in inner), ENOUGH)
            depths[name] = 1 + max((depths[other] for other in inner), default=0)
        elif name not in counts:
            counts[name] = None
            stack.append((name, True))
            for other in inner:
                if other in counts and counts[other] is None:
                    return None, 0
                stack.append((other, False))
    return counts[root], depths[root]


def check_instances(folder: ModelFolder, references: Mapping[str, Sequence[str]]) -> None:
    """Raise ModelError for objects that are part of themselves, nested too deeply, or too many."""
    count, depth = count_instances(references, "")
    if count is None:
        raise folder.error("an object is part of itself: expected a tree, found a cycle")
    folder.check("MAX_NESTING", depth, "objects within one another")
    folder.check("MAX_INSTANCES", count, "instances")
