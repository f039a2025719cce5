"""The YCB object and model set: `ycb:FOLDER` (Calli et al., 2015), and the models of YCB-Video."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from viewsphere.assets.sources.shared.asset_set import SetFolder, asset_source, first_file, model_at
from viewsphere.model.credit import Credit
from viewsphere.plugins.source import AssetSet, SourceModel

FILES = (
    "google_16k/textured.obj",
    "google_64k/textured.obj",
    "google_512k/textured.obj",
    "poisson/textured.obj",
    "tsdf/textured.obj",
    "textured.obj",
    "textured_simple.obj",
    "google_16k/nontextured.ply",
    "poisson/nontextured.ply",
    "tsdf/nontextured.ply",
)
"""A model's files, the best first: Google's scans, then reconstructions by Berkeley, then YCB-Video's copies."""

NAMED = re.compile(r"[0-9]{3}(?:-[a-z])?_(.+)")
"""A model's folder: its number in the set, a letter for one of several alike, and its name."""

CREDIT = Credit(
    licence="CC-BY-4.0",
    attribution="YCB object and model set (Calli et al. 2015)",
    source_url="https://www.ycbbenchmarks.com",
)


def models(tree: SetFolder, chosen: Sequence[str]) -> Iterator[SourceModel]:
    """The models in a folder, whose folders are named such as `002_master_chef_can`."""
    root = tree.root
    for name in tree.subfolders(root, chosen):
        if (named := NAMED.fullmatch(name)) is not None:
            category, file = named[1].replace("_", " "), first_file(f"{root}/{name}", *FILES)
            yield model_at(f"{root}/{name}", file, FILES[0], key=name, category=category, up="+z", forward="-y", unit=1.0)


SOURCE = asset_source(
    AssetSet(
        title="the YCB object set",
        layout="<number_name>/google_16k/textured.obj; also google_64k, google_512k, poisson, tsdf; YCB-Video: textured.obj",
        category="the folder's name, such as `mug` of `025_mug`",
        axes="+Z up, front -Y, metres",
        licence="CC-BY-4.0",
    ),
    models,
    file=lambda model: first_file(model, *FILES),
    credit=lambda model: CREDIT,
)
