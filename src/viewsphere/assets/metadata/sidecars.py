"""The sidecar file of a model, which declares its symmetries, points and parts."""

from __future__ import annotations

from pathlib import Path

from viewsphere.assets.paths.inside import split_source
from viewsphere.errors import ModelError, RecipeError
from viewsphere.model.model_spec import ModelSpec
from viewsphere.plugins import prefix_of
from viewsphere.recipe.reading.sidecar import ENDING, Sidecar, read_sidecar


def said_of(spec: ModelSpec) -> tuple[Path | None, Sidecar]:
    """The path and the content of a model's sidecar. The content is empty if there is none, or for a part of a file.

    Raises ModelError for an unreadable sidecar.
    """
    path = None if spec.parts is not None else sidecar_of(spec)
    try:
        return path, Sidecar.of_defaults() if path is None else read_sidecar(path)
    except RecipeError as error:
        raise ModelError(str(error)) from None


def sidecar_of(spec: ModelSpec) -> Path | None:
    """The sidecar file of a model: the one named in the recipe, else the one beside the model; None without one.

    Raises ModelError if the sidecar beside a confined model is a link out of the model's folder.
    """
    if spec.sidecar is not None:
        return Path(spec.sidecar)
    file, inside = split_source(Path(spec.source))
    path = file.with_name(file.name + ENDING)
    if prefix_of(spec.source) or inside or not path.exists():
        return None
    if spec.confined and path.resolve().parent != path.parent.resolve():
        raise ModelError(
            f"{path}: expected a file in this folder; found a link to {path.resolve()}: copy it, or say confined: false"
        )
    return path
