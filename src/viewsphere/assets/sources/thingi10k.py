"""Thingi10K: `thingi10k:FOLDER`, 10,000 models for 3D printing (Zhou and Jacobson, 2016)."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from io import StringIO
from pathlib import PurePosixPath

from viewsphere.assets.sources.shared.asset_set import SetFolder, asset_source, first_file, model_at
from viewsphere.model.credit import Credit
from viewsphere.plugins.source import AssetSet, SourceModel

FOLDER = "raw_meshes"
SUFFIXES = (".stl", ".obj", ".ply", ".off")

LICENCES = {
    "Creative Commons - Attribution": "CC-BY-4.0",
    "Creative Commons - Attribution - Share Alike": "CC-BY-SA-4.0",
    "Creative Commons - Attribution - No Derivatives": "CC-BY-ND-4.0",
    "Creative Commons - Attribution - Non-Commercial": "CC-BY-NC-4.0",
    "Creative Commons - Attribution - Non-Commercial - Share Alike": "CC-BY-NC-SA-4.0",
    "Creative Commons - Attribution - Non-Commercial - No Derivatives": "CC-BY-NC-ND-4.0",
    "Creative Commons - Public Domain Dedication": "CC0-1.0",
    "Public Domain": "CC0-1.0",
    "GNU - GPL": "GPL-3.0-only",
    "GNU - LGPL": "LGPL-3.0-only",
    "BSD License": "BSD-3-Clause",
}
"""SPDX identifiers of the licences that the set's tables name, in Thingiverse's words."""

Row = Mapping[str, str]


def models(tree: SetFolder, chosen: Sequence[str]) -> Iterator[SourceModel]:
    """The meshes in `raw_meshes`, named by the number of their file."""
    root = tree.root
    if FOLDER not in tree.subfolders(root, chosen):
        return
    folder = f"{root}/{FOLDER}"
    for name in tree.entries(folder, chosen[1:], lambda entry: entry.name.lower().endswith(SUFFIXES)):
        category = _facts(root, name.partition(".")[0]).get("category", "").lower() or "object"
        facts = {"key": name.partition(".")[0], "category": category[:200], "up": "+z", "forward": "-y", "unit": 0.001}
        yield model_at(f"{folder}/{name}", first_file(folder, name), name, **facts)


def credit(model: str) -> Credit:
    """The licence and the author of a model in the set's tables."""
    path = PurePosixPath(model)
    facts = _facts(path.parents[1].as_posix(), path.stem)
    licence, name, author = (facts.get(key, "")[:400] or None for key in ("license", "name", "author"))
    by = " by ".join(filter(None, (f'"{name}"' if name else "", author or "")))
    thing = facts.get("thing id", "")
    url = f"https://www.thingiverse.com/thing:{thing}" if thing.isdecimal() and thing.isascii() else None
    return Credit(licence=LICENCES.get(licence or "", licence), attribution=by or None, source_url=url)


def _facts(root: str, number: str) -> Row:
    """The rows of a file in the set's two tables: of the file, and of its thing."""
    file = _table(root, "input_summary", "id").get(number, {})
    return {**_table(root, "contextual_data", "thing id").get(file.get("thing id", ""), {}), **file}


@lru_cache(maxsize=8)
def _table(root: str, name: str, column: str) -> Mapping[str, Row]:
    """The rows of a table by the value in a column; names of columns in lower case, and only cells of printable text."""
    with suppress(csv.Error):
        text = SetFolder(root).metadata(f"{root}/metadata/{name}.csv", "MAX_TABLE_BYTES").decode("utf-8-sig", errors="replace")
        rows = csv.DictReader(StringIO(text, newline=""), skipinitialspace=True)
        rows.fieldnames = [name.strip().lower() for name in rows.fieldnames or ()]
        cells = ({k: v.strip() for k, v in row.items() if k and isinstance(v, str) and v.isprintable()} for row in rows)
        return {row[column]: row for row in cells if column in row}
    return {}


SOURCE = asset_source(
    AssetSet(
        title="Thingi10K",
        layout=f"{FOLDER}/<number>.stl; metadata/input_summary.csv, metadata/contextual_data.csv",
        category="`contextual_data.csv`, else `object`",
        axes="+Z up, front -Y, taken as millimetres",
        licence="each model's, from the tables",
    ),
    models,
    file=lambda model: first_file(*model.rsplit("/", 1)),
    credit=credit,
    depth=2,
)
