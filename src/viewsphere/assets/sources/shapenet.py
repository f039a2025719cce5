"""ShapeNetCore: `shapenet:FOLDER`, or one synset by `shapenet:FOLDER/02958343` (Chang et al., 2015)."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, cast

from viewsphere.assets.sources.shared.asset_set import SetFolder, asset_source, first_file, model_at
from viewsphere.model.credit import Credit
from viewsphere.plugins.source import AssetSet, SourceModel

FILES = ("models/model_normalized.obj", "model.obj")
"""A model's file in version 2, and in version 1."""

SYNSET = re.compile("[0-9]{8}")

NAMES = (
    "02691156 airplane, 02747177 trash bin, 02773838 bag, 02801938 basket, 02808440 bathtub, 02818832 bed, 02828884 bench, "
    "02834778 bicycle, 02843684 birdhouse, 02858304 boat, 02871439 bookshelf, 02876657 bottle, 02880940 bowl, 02924116 bus, "
    "02933112 cabinet, 02942699 camera, 02946921 can, 02954340 cap, 02958343 car, 02992529 cellular telephone, "
    "03001627 chair, 03046257 clock, 03085013 computer keyboard, 03207941 dishwasher, 03211117 display, 03261776 earphone, "
    "03325088 faucet, 03337140 file, 03467517 guitar, 03513137 helmet, 03593526 jar, 03624134 knife, 03636649 lamp, "
    "03642806 laptop, 03691459 loudspeaker, 03710193 mailbox, 03759954 microphone, 03761084 microwave, 03790512 motorcycle, "
    "03797390 mug, 03928116 piano, 03938244 pillow, 03948459 pistol, 03991062 pot, 04004475 printer, "
    "04074963 remote control, 04090263 rifle, 04099429 rocket, 04225987 skateboard, 04256520 sofa, 04330267 stove, "
    "04379243 table, 04401088 telephone, 04460130 tower, 04468005 train, 04530566 vessel, 04554684 washing machine"
)
"""The names of the synsets, by their offsets in WordNet 3.0: https://shapenet.org/taxonomy-viewer."""

CREDIT = Credit(
    licence="LicenseRef-ShapeNet",
    attribution="ShapeNet (Chang et al. 2015)",
    source_url="https://shapenet.org/terms",
)


def models(tree: SetFolder, chosen: Sequence[str]) -> Iterator[SourceModel]:
    """The models of a folder of synsets; without a model's file, the model is reported as broken.

    Files of version 2 have +Y up and their front at -Z, says the set's page. Version 1 has its front at +X.
    """
    root, names, splits = tree.root, dict(_synsets(tree)), _splits(tree)
    for synset in filter(SYNSET.fullmatch, tree.subfolders(root, chosen)):
        for name in tree.subfolders(f"{root}/{synset}", chosen[1:]):
            path = f"{root}/{synset}/{name}"
            file = first_file(path, *FILES)
            forward = "-z" if file is None or not file.endswith(f"/{FILES[1]}") else "+x"
            facts = {"key": f"{synset}_{name}", "category": names.get(synset, synset), "split": splits.get(name, "")}
            yield model_at(path, file, FILES[0], **facts, up="+y", forward=forward, is_metric=False)


def _synsets(tree: SetFolder) -> Iterator[tuple[str, str]]:
    """The names of synsets: those above, then those of the folder's `taxonomy.json`, whose first synonym counts."""
    yield from (cast("tuple[str, str]", tuple(entry.split(" ", 1))) for entry in NAMES.split(", "))
    with suppress(TypeError, LookupError, AttributeError):
        for entry in cast("list[dict[str, Any]]", SetFolder.parsed(tree.metadata(f"{tree.root}/taxonomy.json"))):
            synset, name = entry["synsetId"], entry["name"].split(",")[0].strip()
            if name and name.isprintable() and f"{synset} " not in NAMES:
                yield synset, name[:200]


def _splits(tree: SetFolder) -> Mapping[str, str]:
    """The split of each model in the folder's `all.csv` (columns id, synsetId, subSynsetId, modelId, split)."""
    lines = tree.metadata(f"{tree.root}/all.csv", "MAX_TABLE_BYTES").decode(errors="replace").splitlines()
    cells = (line.split(",") for line in lines[1:])
    return {row[3]: row[4].strip() for row in cells if len(row) == 5}


SOURCE = asset_source(
    AssetSet(
        title="ShapeNetCore",
        layout="<synset>/<model>/models/model_normalized.obj; version 1: <synset>/<model>/model.obj",
        category="the synset's name",
        axes="+Y up, front -Z (version 1: +X), no unit: the diagonal is 1",
        licence="ShapeNet's terms: research only",
        tried="1 model of version 2",
    ),
    models,
    file=lambda model: first_file(model, *FILES),
    credit=lambda model: CREDIT,
    depth=2,
)
