"""The models of a data set in BOP's format: `bop:FOLDER/lm`, or other models of it by `bop:FOLDER/tless/models_cad`."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import PurePosixPath

from viewsphere.assets.sources.shared.asset_set import SetFolder, asset_source, first_file, model_at
from viewsphere.model.credit import Credit
from viewsphere.plugins.source import AssetSet, SourceModel

FOLDERS = ("models", "models_cad", "models_reconst", "models_eval", "models_fine")
"""Folders of models, in the order of preference."""

FILE = re.compile(r"obj_([0-9]{6})\.ply")

LINEMOD = "ape benchvise bowl camera can cat cup driller duck eggbox glue holepuncher iron lamp phone"
YCB_VIDEO = (
    "master_chef_can cracker_box sugar_box tomato_soup_can mustard_bottle tuna_fish_can pudding_box gelatin_box "
    "potted_meat_can banana pitcher_base bleach_cleanser bowl mug power_drill wood_block scissors large_marker large_clamp "
    "extra_large_clamp foam_brick"
)
NAMES = {
    "lm": LINEMOD,
    "lmo": LINEMOD,
    "ycbv": YCB_VIDEO,
    "tudl": "dragon frog watering_can",
    "icbin": "coffee_cup juice_carton",
}
"""The names of objects 1, 2, ... in data sets whose objects have names: https://bop.felk.cvut.cz/datasets/."""


def models(tree: SetFolder, chosen: Sequence[str]) -> Iterator[SourceModel]:
    """The models in the chosen folder, else in the first folder of models."""
    root = tree.root
    folder = next((name for name in FOLDERS if name in tree.subfolders(root, chosen[:1])), None)
    if folder is None:
        return
    dataset = PurePosixPath(root).name
    names = {number: name.replace("_", " ") for number, name in enumerate(NAMES.get(dataset, "").split(), 1)}
    for file in tree.entries(f"{root}/{folder}", chosen[1:], lambda entry: FILE.fullmatch(entry.name) is not None):
        path, number = f"{root}/{folder}/{file}", int(file[4:10])
        category = names.get(number, file[:10])
        here = first_file(f"{root}/{folder}", file)
        yield model_at(path, here, file, key=f"{dataset}_{file[:10]}", category=category, up="+z", forward="-y", unit=0.001)


SOURCE = asset_source(
    AssetSet(
        title="a data set in BOP's format",
        layout="models/obj_<number>.ply; also models_cad, models_reconst, models_eval, models_fine",
        category="the object's name in lm, lmo, ycbv, tudl and icbin, else `obj_<number>`",
        axes="+Z up, front -Y, millimetres",
        licence="differs, none is stored",
        tried="4 models in the format",
    ),
    models,
    file=lambda model: first_file(*model.rsplit("/", 1)),
    credit=lambda model: Credit(source_url="https://bop.felk.cvut.cz/datasets/"),
    depth=2,
)
