"""Amazon Berkeley Objects: `abo:FOLDER`, 7,953 GLB files of furniture and household items (Collins et al., CVPR 2022)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress

from viewsphere.assets.sources.shared.asset_set import SetFolder, asset_source, first_file, model_at
from viewsphere.model.credit import Credit
from viewsphere.plugins.source import AssetSet, SourceModel

FOLDER = "3dmodels/original"

CREDIT = Credit(
    licence="CC-BY-4.0",
    attribution="Amazon.com, Amazon Berkeley Objects (Collins et al. 2022)",
    source_url="https://amazon-berkeley-objects.s3.amazonaws.com/index.html",
)


def models(tree: SetFolder, chosen: Sequence[str]) -> Iterator[SourceModel]:
    """The GLB files in `3dmodels/original/<last letter>`."""
    if tuple(chosen[:2]) != tuple(FOLDER.split("/"))[: len(chosen)]:
        return
    root = tree.root
    shards = tree.subfolders(f"{root}/{FOLDER}", chosen[2:])
    categories = dict(_product_types(tree)) if shards else {}
    for shard in shards:
        folder = f"{root}/{FOLDER}/{shard}"
        for name in tree.entries(folder, chosen[3:], lambda entry: entry.name.lower().endswith(".glb")):
            category = categories.get(name[:-4], "object")
            yield model_at(f"{folder}/{name}", first_file(folder, name), name, key=name[:-4], category=category, unit=1.0)


def _product_types(tree: SetFolder) -> Iterator[tuple[str, str]]:
    """The product type of each 3D model, such as `office chair` of `OFFICE_CHAIR`, in `listings_<digit>.json.gz`: a product a
    line.
    """
    folder = f"{tree.root}/listings/metadata"
    for name in tree.entries(folder, (), lambda entry: entry.name.endswith((".json", ".json.gz"))):
        for line in tree.metadata(f"{folder}/{name}").splitlines():
            if b'"3dmodel_id"' in line:
                with suppress(LookupError, TypeError):
                    product = SetFolder.parsed(line)
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
