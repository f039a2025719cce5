"""Google Scanned Objects: `gso:FOLDER`, 1,030 scanned household items (Downs et al., ICRA 2022)."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from viewsphere.assets.sources.shared.asset_set import SetFolder, asset_source, first_file, model_at
from viewsphere.model.credit import Credit
from viewsphere.plugins.source import AssetSet, SourceModel

FILE = "meshes/model.obj"
LONGEST = 1 << 16
"""Bytes of metadata.pbtxt in which a category is searched; real files have 1 to 3 KB."""

CREDIT = Credit(
    licence="CC-BY-4.0",
    attribution="Google Scanned Objects (Downs et al. 2022)",
    source_url="https://app.gazebosim.org/GoogleResearch/fuel/collections/Scanned%20Objects%20by%20Google%20Research",
)


def models(tree: SetFolder, chosen: Sequence[str]) -> Iterator[SourceModel]:
    """The scans in a folder. A folder without mesh and metadata is no scan."""
    root = tree.root
    for name in tree.subfolders(root, chosen):
        folder = f"{root}/{name}"
        file = first_file(folder, FILE)
        if file is not None or first_file(folder, "metadata.pbtxt", "model.sdf", "model.config"):
            category = _category(tree, folder) or name.replace("_", " ")
            yield model_at(folder, file, FILE, key=name, category=category, up="+z", forward="-y", unit=1.0)


def _category(tree: SetFolder, folder: str) -> str:
    """The category in a scan's metadata, `categories { first: "Shoe" }`; empty if there is none, as in 1 scan of 3."""
    text = tree.metadata(f"{folder}/metadata.pbtxt")[:LONGEST].decode(errors="replace")
    found = re.search(r'categories\s*\{\s*first:\s*"([^"\\]{1,100})"', text)
    return found[1].lower() if found and found[1].isprintable() else ""


SOURCE = asset_source(
    AssetSet(
        title="Google Scanned Objects",
        layout=f"<model>/{FILE}",
        category="`metadata.pbtxt`, else the folder's name",
        axes="+Z up, front -Y, metres",
        licence="CC-BY-4.0",
        tried="1 scan",
    ),
    models,
    file=lambda model: first_file(model, FILE),
    credit=lambda model: CREDIT,
)
