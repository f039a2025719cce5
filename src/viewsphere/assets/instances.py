"""How often DAE and 3MF files repeat their objects: a few lines of nested references can ask for billions."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Mapping, Sequence
from typing import Any

from viewsphere.assets import limits

_OBJECT = re.compile(rb"<(?:\w+:)?(object|component|item)\b([^>]*)>")
_ID = re.compile(rb"\b(?:object)?id\s*=\s*[\"']([^\"']+)[\"']")


def count_instances(references: Mapping[str, Sequence[str]], root: str) -> int:
    """Number of objects that `root` stands for, itself included, when every reference is followed.

    Counting stops at `limits.MAX_INSTANCES`. Cycles count as that many.
    """
    counts: dict[str, int] = {}
    stack = [(root, False)]
    while stack:
        name, is_done = stack.pop()
        inner = references.get(name, ())
        if is_done:
            counts[name] = min(1 + sum(counts[other] for other in inner), limits.MAX_INSTANCES)
        elif name not in counts:
            # Whoever meets this name again before it is done has met a cycle.
            counts[name] = limits.MAX_INSTANCES
            stack.append((name, True))
            stack.extend((other, False) for other in inner)
    return counts[root]


def dae_references(data: bytes) -> dict[str, list[str]]:
    """For each node of a COLLADA file its child nodes and the nodes it instantiates; the root is `""`."""
    if b"instance_node" not in data:
        return {}
    from lxml import etree  # pyright: ignore[reportAttributeAccessIssue]

    references: dict[str, list[str]] = {"": []}
    open_nodes = [""]
    unnamed = 0
    parser: Any = etree.iterparse(io.BytesIO(data), events=("start", "end"), recover=True)
    for event, element in parser:
        tag = str(element.tag).rpartition("}")[2]
        if tag == "instance_node" and event == "start":
            references[open_nodes[-1]].append(str(element.get("url", "")).lstrip("#"))
        elif tag == "node" and event == "start":
            unnamed += 1
            name = str(element.get("id") or f"#{unnamed}")
            references.setdefault(name, [])
            references[open_nodes[-1]].append(name)
            open_nodes.append(name)
        elif tag == "node":
            open_nodes.pop()
    return references


def threemf_references(archive: zipfile.ZipFile) -> dict[str, list[str]]:
    """For each object of a 3MF file the objects it is made of; what is built is `""`."""
    references: dict[str, list[str]] = {"": []}
    for entry in archive.namelist():
        if not entry.lower().endswith(".model"):
            continue
        current = ""
        for kind, attributes in _OBJECT.findall(archive.read(entry)):
            found = _ID.search(attributes)
            name = found[1].decode(errors="replace") if found else ""
            if kind == b"object":
                current = name
                references.setdefault(name, [])
            elif kind == b"component":
                references.setdefault(current, []).append(name)
            else:
                references[""].append(name)
    return references
