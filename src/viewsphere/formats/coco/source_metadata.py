"""Metadata of an imported COCO data set: info, licences, and its categories' fields besides their names, such as
`keypoints` and `skeleton`. The plan keeps them, and an export writes them again.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    from viewsphere.store import Dataset


OWN = {"id", "name", "supercategory"}
"""Keys of categories that the plan has in other places."""

Said = Mapping[str, Any]
"""`info`: by split; `licenses`: a list; `categories`: the other keys by name."""


def metadata_of_splits(splits: Iterable[tuple[str, Mapping[str, Any]]]) -> dict[str, Any]:
    """Return the metadata of COCO's files, each given with its split's name, for the plan. If two files define the same name,
    the first wins. Raises ValueError for numbers that JSON does not have.
    """
    info: dict[str, Any] = {}
    licences: dict[str, Any] = {}
    categories: dict[str, Any] = {}
    for split, data in splits:
        if isinstance(data.get("info"), dict):
            info[split] = data["info"]
        licences |= {_key(one): one for one in _mappings(data.get("licenses"))}
        for one in _mappings(data.get("categories")):
            more = {key: value for key, value in one.items() if key not in OWN and _is_sound(key, value)}
            if more:
                categories.setdefault(str(one.get("name")), more)
    found = {"info": info, "licenses": list(licences.values()), "categories": categories}
    json.dumps(found, allow_nan=False)
    return {key: value for key, value in found.items() if value}


def licensed(image: dict[str, Any], licences: Mapping[int, Mapping[str, Any]]) -> dict[str, Any]:
    """An image's entry with the licence itself in place of its id, which other data sets may use for another licence."""
    known = licences.get(image["license"]) if isinstance(image.get("license"), int) else None
    return image if known is None else {**image, "license": known}


def licences_by_id(data: Mapping[str, Any]) -> dict[int, Mapping[str, Any]]:
    """The licences of a COCO file."""
    return {one["id"]: one for one in _mappings(data.get("licenses")) if isinstance(one.get("id"), int)}


class Licences:
    """The licences of an export, starting with the licences of imported data sets. They keep their ids if these are free."""

    def __init__(self, dataset: Dataset) -> None:
        self._ids: dict[str, int] = {}
        self.listed: list[dict[str, Any]] = []
        for told in _told(dataset):
            for one in told.get("licenses", ()):
                self.add(one)

    def add(self, licence: Mapping[str, Any]) -> int:
        """The id of a licence: its own, or the next free one if another licence has it. Lists the licence if it is new."""
        key = _key(licence)
        if key not in self._ids:
            own, taken = licence.get("id"), {one["id"] for one in self.listed}
            number = own if isinstance(own, int) and own not in taken else max(taken, default=0) + 1
            self._ids[key] = number
            self.listed.append({**licence, "id": number})
        return self._ids[key]

    def numbered(self, image: dict[str, Any]) -> dict[str, Any]:
        """An image's entry with its licence's id in place of the licence itself."""
        return {**image, "license": self.add(image["license"])} if isinstance(image.get("license"), dict) else image


def imported_info(dataset: Dataset, split: str) -> dict[str, Any] | None:
    """Return the `info` of a split's imported file if the whole data set was imported from it; else None."""
    told = [one["info"][split] for one in _told(dataset) if split in one.get("info", {})]
    return told[0] if len(told) == 1 and sum(part.frames > 0 for part in dataset.plan.parts) == 1 else None


def imported_info_of_parts(dataset: Dataset) -> list[dict[str, Any]]:
    """Return the `info` of every imported file, each once."""
    told = (info for one in _told(dataset) for info in one.get("info", {}).values())
    return list({_key(info): info for info in told}.values())


def imported_categories(dataset: Dataset) -> dict[str, dict[str, Any]]:
    """Return the fields of imported categories besides their names, by the names in lower case, as `merge` joins them."""
    found: dict[str, dict[str, Any]] = {}
    for one in _told(dataset):
        for name, more in one.get("categories", {}).items():
            key = name.casefold()
            found[key] = _joined(found[key], more) if key in found else more
    return found


def _joined(first: Mapping[str, Any], more: Mapping[str, Any]) -> dict[str, Any]:
    """A category of two data sets: the points of the first, then those of the second, with the lines of both."""
    names = list(dict.fromkeys((*first.get("keypoints", ()), *more.get("keypoints", ()))))
    numbers = {at: names.index(name) + 1 for at, name in enumerate(more.get("keypoints", ()), 1)}
    lines = [[numbers[one] for one in line] for line in more.get("skeleton", ()) if all(one in numbers for one in line)]
    skeleton = [*first.get("skeleton", ()), *(line for line in lines if line not in first.get("skeleton", ()))]
    return {**more, **first, **({"keypoints": names, "skeleton": skeleton} if names else {})}


def _told(dataset: Dataset) -> Iterator[Said]:
    for part in dataset.plan.parts:
        found = part.recipe.get("said")
        if isinstance(found, dict):
            yield found


def _is_sound(key: str, value: Any) -> bool:
    """Return whether a category's point names (unique) and lines are valid. Other keys are not checked."""
    if key not in ("keypoints", "skeleton"):
        return True
    values = cast(list[Any], value if isinstance(value, list) else [None])
    if key == "skeleton":
        return all(map(_is_line, values))
    return all(isinstance(one, str) for one in values) and len(set(values)) == len(values)


def _is_line(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(isinstance(one, int) for one in value)  # pyright: ignore[reportUnknownArgumentType, reportUnknownVariableType]


def _mappings(values: Any) -> list[dict[str, Any]]:
    return [one for one in values if isinstance(one, dict)] if isinstance(values, list) else []


def _key(value: Any) -> str:
    return json.dumps(value, sort_keys=True, default=str)
