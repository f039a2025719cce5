"""PartNet-Mobility: `partnet:FOLDER`, articulated models of SAPIEN (Xiang et al., 2020), with their joints at zero."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from viewsphere.assets.cache import load as load_file
from viewsphere.assets.mesh import Mesh
from viewsphere.assets.sources.shared.asset_set import SetFolder, asset_source, first_file, model_at
from viewsphere.model.credit import Credit
from viewsphere.model.model_spec import ModelSpec
from viewsphere.plugins.source import AssetSet, SourceModel

FILE = "mobility.urdf"

NUMBER = re.compile("[0-9]+")

CREDIT = Credit(
    licence="LicenseRef-PartNet-Mobility",
    attribution="PartNet-Mobility (Xiang et al. 2020; Mo et al. 2019; Chang et al. 2015)",
    source_url="https://sapien.ucsd.edu/about",
)


def models(tree: SetFolder, chosen: Sequence[str]) -> Iterator[SourceModel]:
    """The models in a folder, whose folders are named by numbers."""
    root = tree.root
    for name in filter(NUMBER.fullmatch, tree.subfolders(root, chosen)):
        folder = f"{root}/{name}"
        category = _category(tree, folder) or "object"
        facts = {"key": name, "category": category, "up": "+z", "forward": "-x", "is_metric": False}
        yield model_at(folder, first_file(folder, FILE), FILE, **facts)


def load(model: ModelSpec, file: Path) -> Mesh:
    """The model in the axes of its file, with parts named by the meaning of their link: `rotation_door/handle-12`."""
    asked = {
        "source": str(file),
        "up": "+z",
        "forward": "-y",
        "unit": None,
        "centring": "as_is",
        "scale": "as_is",
        "parts": None,
    }
    mesh, _ = load_file(model.model_copy(update=asked))
    meanings = _meanings(SetFolder(file.parent.parent.as_posix()), file.parent.as_posix())
    parts = [part.partition("/") for part in mesh.parts]
    return replace(mesh, parts=tuple(f"{meanings.get(link, link)}{slash}{visual}" for link, slash, visual in parts))


def _meanings(tree: SetFolder, folder: str) -> Mapping[str, str]:
    """The meaning of each link in `semantics.txt`, whose lines are `link_0 hinge rotation_door`; one of several alike has its
    link behind it.
    """
    text = tree.metadata(f"{folder}/semantics.txt", "MAX_TABLE_BYTES").decode(errors="replace")
    rows = dict(re.findall(r"^(\S{1,100}) \S+ (\S{1,100})\s*$", text, re.MULTILINE))
    alike = [*rows.values()]
    return {link: name if alike.count(name) == 1 else f"{name} {link}" for link, name in rows.items() if name.isprintable()}


def _category(tree: SetFolder, folder: str) -> str:
    """The category in a model's `meta.json`, such as `storage furniture` of `StorageFurniture`; empty if there is none."""
    with suppress(TypeError, LookupError):
        name = str(SetFolder.parsed(tree.metadata(f"{folder}/meta.json", "MAX_TABLE_BYTES"))["model_cat"])[:200]
        return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower() if name.isprintable() else ""
    return ""


SOURCE = asset_source(
    AssetSet(
        title="PartNet-Mobility",
        layout=f"<number>/{FILE}; meta.json, semantics.txt",
        category="`meta.json`",
        axes="+Z up, front -X, no unit",
        licence="ShapeNet's terms: research only",
        tried="1 model",
    ),
    models,
    file=lambda model: first_file(model, FILE),
    credit=lambda model: CREDIT,
    load=load,
)
