"""Recipes that reproduce foreign data sets: a folder with the recipe, its file of shots, and other files that it names."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from viewsphere import plugins
from viewsphere.errors import RecipeError, UserError
from viewsphere.planning.plan import plan
from viewsphere.plugins.format import FormatSpec
from viewsphere.run.reproduce_recipe import RECIPE, draft
from viewsphere.store import new_folder
from viewsphere.store.source_cameras import SourceCameras
from viewsphere.validation.errors import one_of


@dataclass(frozen=True)
class _Made:
    """A new recipe: its file, the numbers of its shots and models, and notes about it."""

    recipe: Path
    shots: int
    models: int
    notes: tuple[str, ...]


def make_again(kind: str, source: Path, folder: Path) -> _Made:
    """Make a folder with a recipe that renders a data set again.

    The folder appears when it is complete and its recipe has been planned. Raises UserError for a format that cannot be
    rendered again and for a folder that holds something, StoreError for a data set that is broken.
    """
    known = _again()
    if kind not in known:
        raise UserError(f"--from: {one_of(kind, tuple(known))}")
    _check_folder(folder)
    if not source.exists():
        raise UserError(f"--from {kind}: expected a data set; found no {source}")
    found = known[kind](source)
    try:
        _make(found, f"{kind} {source}", folder)
    except OSError as error:
        raise UserError(f"{folder}: expected a place to write, found: {error.strerror or error}") from None
    return _Made(folder / RECIPE, len(found.shots), len(found.models), found.notes)


def _again() -> dict[str, Callable[[Path], SourceCameras]]:
    return {name: spec.as_recipe for name, spec in plugins.loadable(FormatSpec).items() if spec.as_recipe is not None}


def _check_folder(folder: Path) -> None:
    if folder.suffix in {".yaml", ".yml"}:
        raise UserError(f"{folder}: expected a folder beside --from, which makes several files; found the name of a recipe")
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise UserError(f"{folder}: expected a new folder, found one that exists: choose another")


def _make(found: SourceCameras, of: str, folder: Path) -> None:
    with new_folder(folder) as made:
        try:
            for name, data in draft(found, of, made):
                (made / name).parent.mkdir(parents=True, exist_ok=True)
                (made / name).write_bytes(data)
            plan(str(made / RECIPE))
        except RecipeError as error:
            raise RecipeError(str(error).replace(str(made), str(folder))) from None
