"""The picture files of a recipe's scene: found during planning, checked before rendering."""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Iterator, Mapping
from functools import lru_cache
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from viewsphere.composing.scene.entries_walked import named
from viewsphere.errors import RecipeError
from viewsphere.files import open_file, written_path
from viewsphere.limits import limits
from viewsphere.model.scene import Background, Ground
from viewsphere.recipe.draws import alternatives
from viewsphere.recipe.entries import pictures_of
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.world.light import SKY_SUFFIXES
from viewsphere.validation.errors import nearest

if TYPE_CHECKING:
    from PIL.Image import Image

IMAGE_SUFFIXES = (".bmp", ".jpeg", ".jpg", ".png", ".tif", ".tiff", ".webp")

Kind = Literal["image", "images", "textures", "hdri"]
"""A picture, a folder of pictures, a folder that directly contains all its pictures, or a picture or folder of the whole
sphere.
"""

Pictures = Mapping[tuple[Kind, str], tuple[str, ...]]
"""Absolute paths of the files that a path of the recipe stands for, sorted."""

FIELDS: tuple[tuple[str, str, Kind], ...] = (
    *(("background", name, "image") for name in pictures_of(Background)),
    ("background", "images", "images"),
    *(("ground", name, "image") for name in pictures_of(Ground)),
    ("sky", "hdri", "hdri"),
)
PICTURE_FORMATS = ("PNG", "JPEG", "WEBP", "BMP", "GIF", "TIFF", "TGA", "PPM")
"""Kinds of picture that all parts of a scene can show."""

_ENDS = {"PNG": b"IEND", "JPEG": b"\xff\xd9", "GIF": b"\x3b"}
_TAIL = 64  # bytes in which an end is searched: some programs write a little behind it


def scene_pictures(recipe: Recipe) -> Pictures:
    """The files of every path in the recipe's scene; raises RecipeError for missing ones."""
    found = chain.from_iterable(map(_paths, recipe.conditions.values()))
    return {(kind, path): _files(recipe, field, kind, path) for field, kind, path in found}


def check_pictures(recipe: Recipe, pictures: Pictures) -> None:
    """Check by their first and last bytes that the files of a scene are pictures; raises RecipeError for the first that is
    not.
    """
    for field, kind, path in chain.from_iterable(map(_paths, recipe.conditions.values())):
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
    for i, material in enumerate(recipe.scene.materials):
        named: tuple[tuple[str, Kind], ...] = (("image", "image"), ("images", "textures"))
        for name, kind in named:
            for path in alternatives(getattr(material, name)):
                if path is not None:
                    yield f"scene.materials[{i}].{name}", kind, path


def _files(recipe: Recipe, field: str, kind: Kind, written: str) -> tuple[str, ...]:
    path = recipe.folder / written_path(written)
    if kind in ("image", "hdri") and path.is_file():
        return (path.as_posix(),)
    if kind == "image":
        raise RecipeError(f"{field}: expected an image file; found none at {path}")
    suffixes = SKY_SUFFIXES if kind == "hdri" else IMAGE_SUFFIXES
    paths = tuple(named(Path(file), field).as_posix() for file in files_in(path, suffixes))
    if kind == "textures":
        _check_folder(path, paths, field)
    hint = nearest(written, ("daylight",)) if kind == "hdri" else ""
    if not paths:
        what = "a folder with images" if kind != "hdri" else "daylight, a file or a folder with files"
        raise RecipeError(f"{field}: expected {what} ({', '.join(suffixes)}); found {_none_in(path)}{hint}")
    return paths


def _check_folder(folder: Path, found: tuple[str, ...], field: str) -> None:
    """Raise RecipeError if a path is not a folder, or if a link in the folder leads to a file elsewhere."""
    if not folder.is_dir():
        problem = "is none" if folder.exists() else "does not exist"
        raise RecipeError(f"{field}: expected a folder with images; {folder} {problem}")
    for file in found:
        if not Path(file).resolve().is_relative_to(folder.resolve()):
            raise RecipeError(
                f"{field}: expected images inside of {folder}; found a link that leads out: {file}: copy it there"
            )


def _none_in(folder: Path) -> str:
    return f"none in {folder}" if folder.exists() else f"{folder}, which does not exist"


def files_in(folder: Path, suffixes: tuple[str, ...] = IMAGE_SUFFIXES) -> tuple[str, ...]:
    """Absolute paths of the files of a kind in a folder and below, sorted."""
    return tuple(sorted(f.as_posix() for f in folder.rglob("*") if f.suffix.lower() in suffixes and f.is_file()))


@lru_cache(maxsize=4096)
def proportions(path: str, field: str = "scene.planes") -> float:
    """Width over height of a picture as it is shown; raises RecipeError about the recipe's field when it cannot be read.

    A truncated file is detected by its last bytes, if its kind has an end marker; a file that cannot be decoded is refused.
    """
    from PIL import Image, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of large pictures, which a limit decides on
            with open_file(Path(path), "MAX_PICTURE_BYTES") as file, Image.open(file, formats=PICTURE_FORMATS) as image:
                width, height = image.size
                sideways = _is_sideways(image)
                if width * height <= limits.MAX_PICTURE_PIXELS and not _ends_well(path, image.format or ""):
                    image.load()
    except UnidentifiedImageError:
        raise _unreadable(field, f"none of {', '.join(PICTURE_FORMATS)}", path) from None
    except Image.DecompressionBombError as error:
        raise _too_large(field, f"{int(re.findall(r'[0-9]+', str(error))[0]):,}", path) from None
    except Exception as error:  # Pillow's decoders raise whatever their format's parser does
        problem = (error.strerror if isinstance(error, OSError) else None) or str(error)
        raise _unreadable(field, " ".join(problem.split())[:200], path) from None
    if width * height > limits.MAX_PICTURE_PIXELS:
        raise _too_large(field, f"{width * height:,} ({width} x {height})", path)
    return height / width if sideways else width / height


def _unreadable(field: str, problem: str, path: str) -> RecipeError:
    return RecipeError(f"{field}: expected a readable image; found {problem} in {path}: mend or remove it")


def _too_large(field: str, found: str, path: str) -> RecipeError:
    most = f"{limits.MAX_PICTURE_PIXELS:,} pixels (limit MAX_PICTURE_PIXELS)"
    return RecipeError(f"{field}: expected at most {most}; found {found} in {path}: make it smaller")


def _is_sideways(image: Image) -> bool:
    """Return whether EXIF data record a turned camera; False for unreadable data."""
    try:
        return image.getexif().get(0x0112, 1) >= 5
    except Exception:  # the parser of a damaged block raises whatever it meets
        return False


def _ends_well(path: str, kind: str) -> bool:
    """Return whether a file ends with its kind's end marker; True for kinds without one."""
    if kind not in _ENDS:
        return True
    with open_file(Path(path), "MAX_PICTURE_BYTES") as file:
        file.seek(0, os.SEEK_END)
        file.seek(-min(file.tell(), _TAIL), os.SEEK_END)
        return _ENDS[kind] in file.read()


def _check_sphere(path: str, field: str) -> None:
    from viewsphere.assets.paths.folder import UnreadableError  # which loads numpy's and Pillow's readers
    from viewsphere.rendering.sky.environment_head import read_head

    try:
        head = read_head(Path(path))
    except UnreadableError as error:
        raise RecipeError(f"{field}: {error}") from None
    if head is None:
        raise RecipeError(f"{field}: expected an OpenEXR or Radiance HDR file; found another kind in {path}: convert it")
