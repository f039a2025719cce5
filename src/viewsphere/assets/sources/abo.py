"""Amazon Berkeley Objects: `abo:FOLDER`, 7,953 GLB files of furniture and household items (Collins et al., CVPR 2022)."""

from __future__ import annotations

import gzip
import json
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path

from viewsphere.assets.sources.shared.asset_set import asset_source, entries, first_file, model_at, subfolders
from viewsphere.files import open_file
from viewsphere.limits import limits
from viewsphere.model.credit import Credit
from viewsphere.plugins.source import AssetSet, SourceModel

FOLDER = "3dmodels/original"

CREDIT = Credit(
    licence="CC-BY-4.0",
    attribution="Amazon.com, Amazon Berkeley Objects (Collins et al. 2022)",
    source_url="https://amazon-berkeley-objects.s3.amazonaws.com/index.html",
)


def models(root: str, chosen: Sequence[str]) -> Iterator[SourceModel]:
    """The GLB files in `3dmodels/original/<last letter>`."""
    if tuple(chosen[:2]) != tuple(FOLDER.split("/"))[: len(chosen)]:
        return
    shards = subfolders(f"{root}/{FOLDER}", chosen[2:])
    categories = dict(_product_types(f"{root}/listings/metadata")) if shards else {}
    for shard in shards:
        folder = f"{root}/{FOLDER}/{shard}"
        for name in entries(folder, chosen[3:], lambda entry: entry.name.lower().endswith(".glb")):
            category = categories.get(name[:-4], "object")
            yield model_at(f"{folder}/{name}", first_file(folder, name), name, key=name[:-4], category=category, unit=1.0)


def _product_types(folder: str) -> Iterator[tuple[str, str]]:
    """The product type of each 3D model, such as `office chair` of `OFFICE_CHAIR`, in `listings_<digit>.json.gz`: a product a
    line.
    """
    for name in entries(folder, (), lambda entry: entry.name.endswith((".json", ".json.gz"))):
        with suppress(OSError, EOFError, ValueError), open_file(Path(folder, name), "MAX_RECORD_BYTES") as stream:
            most = limits.MAX_RECORD_BYTES
            data = gzip.GzipFile(fileobj=stream).read(most) if name.endswith(".gz") else stream.read()
            for line in data.splitlines():
                if b'"3dmodel_id"' in line:
                    with suppress(ValueError, LookupError, TypeError):
                        product = json.loads(line)
                        kind = str(product["product_type"][0]["value"])[:200]
                        if kind.isprintable():
                            yield str(product["3dmodel_id"]), kind.replace("_", " ").lower()


SOURCE = asset_source(
    AssetSet(
        title="Amazon Berkeley Objects",
        layout=f"{FOLDER}/<letter>/<model>.glb; listings/metadata/listings_<digit>.json.gz",
        category="the product type in the listings, else `object`",
        axes="+Y up, front +Z, metres",
        licence="CC-BY-4.0",
    ),
    models,
    file=lambda model: first_file(*model.rsplit("/", 1)),
    credit=lambda model: CREDIT,
    depth=4,
)
