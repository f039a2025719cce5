"""ModelNet10 and ModelNet40: `modelnet:FOLDER`, CAD models by category and split (Wu et al., CVPR 2015)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from viewsphere.assets.sources.shared.asset_set import SetFolder, asset_source, first_file, model_at
from viewsphere.model.credit import Credit
from viewsphere.plugins.source import AssetSet, SourceModel

SPLITS = ("train", "test")

CREDIT = Credit(
    licence="LicenseRef-ModelNet",
    attribution="Princeton ModelNet (Wu et al. 2015)",
    source_url="https://modelnet.cs.princeton.edu",
)


def models(tree: SetFolder, chosen: Sequence[str]) -> Iterator[SourceModel]:
    """The OFF files in `<category>/train` and `<category>/test`."""
    root = tree.root
    for category in tree.subfolders(root, chosen):
        for split in SPLITS:
            folder = f"{root}/{category}/{split}"
            wanted = chosen[2:] if chosen[1:2] in ((), (split,)) else None
            names = () if wanted is None else tree.entries(folder, wanted, lambda entry: entry.name.endswith(".off"))
            for name in names:
                facts = {"key": name[:-4], "category": category.replace("_", " "), "split": split, "is_metric": False}
                yield model_at(f"{folder}/{name}", first_file(folder, name), name, up="+z", forward="-y", **facts)


SOURCE = asset_source(
    AssetSet(
        title="ModelNet",
        layout="<category>/train/<model>.off, <category>/test/<model>.off",
        category="the folder's name",
        axes="+Z up, front -Y, no unit",
        licence="research only",
    ),
    models,
    file=lambda model: first_file(*model.rsplit("/", 1)),
    credit=lambda model: CREDIT,
    depth=3,
)
