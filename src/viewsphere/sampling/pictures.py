"""The picture files that a recipe's scene names: found when it is planned, looked at before it is rendered."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Literal

from viewsphere.errors import RecipeError
from viewsphere.model.recipe import Recipe
from viewsphere.model.recipe_draws import alternatives
from viewsphere.model.recipe_light import SKY_SUFFIXES

IMAGE_SUFFIXES = (".bmp", ".jpeg", ".jpg", ".png", ".tif", ".tiff", ".webp")

Kind = Literal["image", "images", "hdri"]
"""A picture, a folder of pictures, or either of a whole sphere."""

Pictures = Mapping[tuple[Kind, str], tuple[str, ...]]
"""Absolute paths of the files that a path of the recipe stands for, sorted."""

FIELDS: tuple[tuple[str, str, Kind], ...] = (
    ("background", "image", "image"),
    ("background", "images", "images"),
    ("ground", "image", "image"),
    ("ground", "roughness_image", "image"),
    ("ground", "normal_image", "image"),
    ("sky", "hdri", "hdri"),
)
_RADIANCE = (b"#?RADIANCE", b"#?RGBE")
_OPENEXR = b"\x76\x2f\x31\x01"


def scene_pictures(recipe: Recipe) -> Pictures:
    """The files of every path in the recipe's scene; raises RecipeError for those that are not there."""
    return {(kind, path): _files(recipe, field, kind, path) for field, kind, path in _paths(recipe)}


def check_pictures(recipe: Recipe, pictures: Pictures) -> None:
    """See that the files of a scene begin as pictures do; raises RecipeError for the first that does not."""
    for field, kind, path in _paths(recipe):
        for file in pictures[kind, path]:
            if kind == "hdri":
                _check_sphere(file, field)
            else:
                proportions(file, field)


def _paths(recipe: Recipe) -> Iterator[tuple[str, Kind, str]]:
    """Field, kind and path of every picture there may be."""
    for entry, name, kind in FIELDS:
        for option in alternatives(getattr(recipe.scene, entry)):
            for path in alternatives(getattr(option, name, None)):
                if path is not None:
                    yield f"scene.{entry}.{name}", kind, path


def _files(recipe: Recipe, field: str, kind: Kind, written: str) -> tuple[str, ...]:
    path = recipe.folder / Path(written).expanduser()
    if kind != "images" and path.is_file():
        return (str(path),)
    if kind == "image":
        raise RecipeError(f"{field}: expected an image file; found none at {path}")
    suffixes = IMAGE_SUFFIXES if kind == "images" else SKY_SUFFIXES
    found = files_in(path, suffixes)
    if not found:
        what = "a folder with images" if kind == "images" else "daylight, a file or a folder with files"
        raise RecipeError(f"{field}: expected {what} ({', '.join(suffixes)}); found none in {path}")
    return found


def files_in(folder: Path, suffixes: tuple[str, ...] = IMAGE_SUFFIXES) -> tuple[str, ...]:
    """Absolute paths of the files of a kind in a folder and below, sorted."""
    return tuple(sorted(str(f) for f in folder.rglob("*") if f.suffix.lower() in suffixes and f.is_file()))


@lru_cache(maxsize=4096)
def proportions(path: str, field: str = "scene.planes") -> float:
    """Width over height of a picture as it is shown; raises RecipeError about the recipe's field when it cannot be read."""
    from PIL import Image, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of large pictures, whose readers have limits of their own
            image = Image.open(path)
        with image:
            width, height = image.size
            sideways = image.getexif().get(0x0112, 1) >= 5
    except (OSError, ValueError, UnidentifiedImageError, Image.DecompressionBombError) as error:
        problem = "no image" if isinstance(error, UnidentifiedImageError) else error
        raise RecipeError(f"{field}: expected a readable image; found {problem} in {path}: mend or remove it") from None
    return height / width if sideways else width / height


def _check_sphere(path: str, field: str) -> None:
    try:
        with Path(path).open("rb") as file:
            start = file.read(16)
    except OSError as error:
        raise RecipeError(f"{field}: expected a readable file; found {error.strerror or error} in {path}") from None
    if not start.startswith((_OPENEXR, *_RADIANCE)):
        raise RecipeError(f"{field}: expected an OpenEXR or Radiance HDR file; found another kind in {path}: convert it")
