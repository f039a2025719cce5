"""How often DAE and 3MF files repeat their objects: a few lines of nested references can ask for billions."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import Any

from viewsphere.assets.folder import ModelFolder
from viewsphere.limits import limits

ENOUGH = 10**12
"""Counting stops here: more digits would be a message of pages."""


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


def dae_references(data: bytes) -> dict[str, list[str]]:
    """For each node of a COLLADA file its child nodes and the nodes it instantiates; the root is `""`.

    Nothing for a file that has too few nodes to break a limit.
    """
    is_wide = b"\0" in data[:64]  # UTF-16
    if not is_wide and b"instance_node" not in data and data.count(b"node") <= limits.MAX_NESTING:
        return {}
    from lxml import etree  # pyright: ignore[reportAttributeAccessIssue]

    # Nodes are told apart by their numbers: files in which two have the same id are common.
    root, library = "", "library"
    references: dict[str, list[str]] = {root: [], library: []}
    by_url: dict[str, str] = {}
    open_nodes = [library]
    parser: Any = etree.iterparse(
        io.BytesIO(data), events=("start", "end"), recover=True, resolve_entities=False, no_network=True, load_dtd=False
    )
    for event, element in parser:
        tag = str(element.tag).rpartition("}")[2]
        if tag == "instance_node" and event == "start":
            references[open_nodes[-1]].append(str(element.get("url", "")))
        elif tag == "node" and event == "start":
            name = f"node {len(references)}"
            by_url.setdefault(f"#{element.get('id')}", name)
            references[name] = []
            references[open_nodes[-1]].append(name)
            open_nodes.append(name)
        elif tag == "visual_scene" and event == "start":
            open_nodes.append(root)
        elif tag in {"node", "visual_scene"}:
            open_nodes.pop()
    return {name: [by_url.get(other, other) for other in inner] for name, inner in references.items()}
