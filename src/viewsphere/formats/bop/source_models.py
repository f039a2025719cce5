"""BOP's models from other sources, with their data in models_info.json."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np
from pydantic import ValidationError

from viewsphere.assets.cache import load_normalised
from viewsphere.errors import StoreError, UserError
from viewsphere.files import read_bytes
from viewsphere.formats.bop.entries import MM
from viewsphere.formats.shared.reading.image_lists import one_line
from viewsphere.formats.shared.reading.source_models import foreign_model
from viewsphere.model.annotations.symmetries import RIGID, Symmetries
from viewsphere.model.model_spec import ModelSpec
from viewsphere.store import Category
from viewsphere.store.foreign import ForeignModel
from viewsphere.store.paths import file_inside
from viewsphere.store.texts import parsed
from viewsphere.validation.errors import first_of

FOLDERS = ("models", "models_cad", "models_reconst", "models_eval", "models_fine")
"""The possible folders of models; the first one that exists is used."""

METRES = np.diag([1 / MM, 1 / MM, 1 / MM, 1.0])


def model_folder(root: Path) -> str:
    """The name of the folder of models."""
    return next((name for name in FOLDERS if (root / name).is_dir()), FOLDERS[0])


def model_files(root: Path) -> dict[int, Path]:
    """The files of all models by their objects' numbers, ascending."""
    folder = model_folder(root)
    there = (re.fullmatch(r"obj_([0-9]{6})\.ply", file.name) for file in sorted((root / folder).glob("obj_*.ply")))
    return {int(match[1]): file_inside(root, f"{folder}/{match[0]}") for match in there if match}


def symmetries_of(root: Path) -> dict[int, Symmetries]:
    """Return the symmetries in models_info.json, in millimetres, by the numbers of their objects. Models without symmetries are
    left out. Raises StoreError for invalid symmetries.
    """
    file = file_inside(root, f"{model_folder(root)}/models_info.json")
    found = {int(number): _symmetries(one, f"{file}: {number}") for number, one in load(file).items() if number.isdecimal()}
    return {number: one for number, one in found.items() if one is not None}


def model_spec(file: Path) -> ModelSpec:
    """Return the spec that reads a model's file as it is, in its own axes, from millimetres."""
    axes: dict[str, Any] = {"up": "+z", "forward": "-y", "unit": 1 / MM, "centring": "as_is"}
    return ModelSpec(key="model", source=str(file), category="object", category_id=1, **axes)


def foreign_models(
    root: Path, files: Mapping[int, Path], named: Mapping[int, tuple[Category, str]], problems: list[str]
) -> dict[int, ForeignModel]:
    """The models in these files by their objects' numbers; the problems of invalid models are appended."""
    found: dict[int, ForeignModel] = {}
    try:
        symmetries = {number: one.moved(METRES) for number, one in symmetries_of(root).items()}
    except StoreError as error:
        problems.append(str(error))
        symmetries = {}
    for number, file in files.items():
        category, key = named[number]
        try:
            found[number] = foreign_model(load_normalised(model_spec(file)), key, category, symmetries=symmetries.get(number))
        except UserError as error:
            problems.append(f"{file}: expected a model; found: {one_line(error)}")
    return found


def _symmetries(said: Any, where: str) -> Symmetries | None:
    facts = cast(Mapping[str, Any], said if isinstance(said, dict) else {})
    names = ("discrete", "continuous")
    given = {name: facts[f"symmetries_{name}"] for name in names if facts.get(f"symmetries_{name}")}
    try:
        given["discrete"] = [*_moving(given.get("discrete", ()))]
        made = Symmetries.model_validate(given)
    except ValidationError as error:
        raise StoreError(f"{where}: symmetries: {first_of(error)}") from None
    except (TypeError, ValueError):
        found = facts["symmetries_discrete"]
        raise StoreError(f"{where}: symmetries_discrete: expected lists of 16 numbers; found {found!r:.60}") from None
    return None if made == Symmetries() else made


def _moving(listed: Any) -> Iterator[list[float]]:
    """Motions other than the identity, which some files also list."""
    for motion in listed:
        matrix = np.array(motion, np.float64).reshape(16)
        if np.abs(matrix - np.eye(4).ravel()).max() > RIGID:
            yield matrix.tolist()


def load(file: Path) -> dict[str, Any]:
    """The object in one of BOP's JSON files; empty if there is no such file. Raises StoreError for anything but an object."""
    if not file.is_file():
        return {}
    try:
        found = parsed(read_bytes(file, "MAX_RECORD_BYTES"))
    except (OSError, ValueError) as error:
        raise StoreError(f"{file}: expected BOP's JSON; found: {error}") from None
    if not isinstance(found, dict):
        raise StoreError(f"{file}: expected an object of images; found something else")
    return cast(dict[str, Any], found)
