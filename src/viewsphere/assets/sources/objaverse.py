"""Objaverse: `objaverse:FOLDER`, a folder of GLB files with the annotations of the set (Deitke et al., 2022)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import PurePosixPath
from typing import Any, NamedTuple, cast

from viewsphere.assets.sources.shared.asset_set import SetFolder, asset_source, first_file, model_at
from viewsphere.model.credit import Credit
from viewsphere.plugins.source import AssetSet, SourceModel

LICENCES = {"cc0": "CC0-1.0", "by": "CC-BY-4.0", "by-sa": "CC-BY-SA-4.0", "by-nd": "CC-BY-ND-4.0"} | {
    f"by-nc{more}": f"CC-BY-NC{more.upper()}-4.0" for more in ("", "-sa", "-nd")
}
"""SPDX identifiers of the licences in annotations, which are those of Sketchfab: https://sketchfab.com/licenses."""

LVIS = "lvis-annotations.json"
ANNOTATIONS = "annotations.json"
SHARDS_KEPT = 256
"""Metadata files whose facts stay in memory, 1 MB each: all 160 of the set."""


class _Facts(NamedTuple):
    """The facts that an annotation states: a category (empty: none) and the credit."""

    category: str = ""
    credit: Credit = Credit()


def models(tree: SetFolder, chosen: Sequence[str]) -> Iterator[SourceModel]:
    """The GLB files in `glbs/<shard>`, where Objaverse's package keeps them, and in the root itself."""
    root = tree.root
    lvis = dict(_lvis(root))
    for shard in tree.subfolders(f"{root}/glbs", chosen[1:]) if chosen[:1] in ((), ("glbs",)) else ():
        yield from _in_folder(tree, f"{root}/glbs/{shard}", chosen[2:], lvis)
    yield from _in_folder(tree, root, chosen, lvis)


def _in_folder(tree: SetFolder, folder: str, chosen: Sequence[str], lvis: Mapping[str, str]) -> Iterator[SourceModel]:
    for name in tree.entries(folder, chosen, lambda entry: entry.name.lower().endswith(".glb")):
        uid = name[:-4]
        category = lvis.get(uid) or _facts(tree.root, folder, uid).category or "object"
        yield model_at(f"{folder}/{name}", first_file(folder, name), name, key=uid, category=category, is_metric=False)


def _lvis(root: str) -> Iterator[tuple[str, str]]:
    """The LVIS category of each model that has one."""
    for category, uids in _json(root, LVIS).items():
        if isinstance(uids, list) and category.isprintable():
            yield from ((uid, category.replace("_", " ")[:200]) for uid in cast("list[Any]", uids) if isinstance(uid, str))


def _facts(root: str, folder: str, uid: str) -> _Facts:
    """The facts about a model, in the annotations of its root, else in the metadata of its shard."""
    shard = PurePosixPath(folder).name
    return _annotated(root, ANNOTATIONS).get(uid) or _annotated(root, f"metadata/{shard}.json").get(uid) or _Facts()


@lru_cache(maxsize=SHARDS_KEPT)
def _annotated(root: str, file: str) -> Mapping[str, _Facts]:
    """The facts of each model that a file of annotations describes, by its identifier."""
    return {uid: _fact(entry) for uid, entry in _json(root, file).items() if isinstance(entry, dict)}


def _fact(entry: dict[str, Any]) -> _Facts:
    user = entry.get("user")
    maker = _line(user.get("displayName") or user.get("username")) if isinstance(user, dict) else ""
    name, category, url = _line(entry.get("name")), "", _line(entry.get("viewerUrl"))
    with suppress(LookupError, TypeError):
        category = _line(entry["categories"][0]["name"])[:200].lower()
    by = " by ".join(filter(None, (f'"{name}"' if name else "", maker)))
    with suppress(ValueError):
        licence = LICENCES.get(str(entry.get("license")), _line(entry.get("license")) or None)
        return _Facts(category, Credit(licence=licence, attribution=by or None, source_url=url or None))
    return _Facts(category)


def _line(text: Any) -> str:
    return text.strip()[:400] if isinstance(text, str) and text.isprintable() else ""


def _json(root: str, file: str) -> dict[str, Any]:
    """The mapping in a JSON file, else in the same file compressed by gzip; empty if there is none, or if it cannot be read."""
    path = first_file(root, file, f"{file}.gz")
    found = None if path is None else SetFolder.parsed(SetFolder(root).metadata(path))
    return cast("dict[str, Any]", found) if isinstance(found, dict) else {}


def _root(model: str) -> tuple[str, int]:
    """The root of a model's set, and the number of names from there to the model."""
    parts = PurePosixPath(model).parts
    depth = 3 if len(parts) > 3 and parts[-3] == "glbs" else 1
    return PurePosixPath(model).parents[depth - 1].as_posix(), depth


def credit(model: str) -> Credit:
    """The licence and the maker in a model's annotation."""
    path = PurePosixPath(model)
    return _facts(_root(model)[0], path.parent.as_posix(), path.stem).credit


SOURCE = asset_source(
    AssetSet(
        title="Objaverse",
        layout="<id>.glb or glbs/<shard>/<id>.glb; lvis-annotations, annotations and metadata/<shard> as .json or .json.gz",
        category="LVIS, else Sketchfab's first category, else `object`",
        axes="+Y up, front +Z, no unit",
        licence="each model's, from its annotation",
    ),
    models,
    file=lambda model: first_file(*model.rsplit("/", 1)),
    credit=credit,
    depth=3,
    depth_of=lambda model: _root(model)[1],
)
