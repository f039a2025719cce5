"""viewsphere: 3D models in, exactly labelled image data sets out.

    import viewsphere as vs

    vs.plan("recipe.yaml").frames              # known before anything is rendered
    for sample in vs.render("recipe.yaml"):    # in memory, no disk; vs.Recipe.load and vs.Recipe make recipes to pass, too
        sample.rgb, sample.depth, sample.objects[0].box3d
    vs.generate("recipe.yaml", "out", workers=4)  # on disk, resumable
    dataset = vs.open("out")                   # the same samples from disk

Names are imported when first used, so that importing the package is quick.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from viewsphere.model.fields.notebook import Shown

if TYPE_CHECKING:
    from viewsphere.planning.plan import plan
    from viewsphere.recipe.recipe import Recipe
    from viewsphere.run.datasets.converting import convert
    from viewsphere.run.exports.exporting import export
    from viewsphere.run.generate import generate
    from viewsphere.run.memory import render
    from viewsphere.run.shots.matching import matches
    from viewsphere.run.status import status
    from viewsphere.store import Dataset
    from viewsphere.store import Dataset as open

    __version__: str

__all__ = ["Dataset", "Recipe", "__version__", "convert", "export", "generate", "matches", "open", "plan", "render", "status"]

_HOMES = {
    "Dataset": "store.Dataset",
    "Recipe": "recipe.recipe.Recipe",
    "convert": "run.datasets.converting.convert",
    "export": "run.exports.exporting.export",
    "generate": "run.generate.generate",
    "matches": "run.shots.matching.matches",
    "open": "store.Dataset",
    "plan": "planning.plan.plan",
    "render": "run.memory.render",
    "status": "run.status.status",
}


def _html_of(value: Any) -> str:
    """Return the HTML that notebooks show; the import of the drawing code waits until then."""
    from viewsphere.plugins import attribute

    return attribute("preview.notebook.html")(value)


Shown.html_of = _html_of


def __getattr__(name: str) -> Any:
    """Import a public name from its home."""
    from viewsphere.plugins import attribute

    if name == "__version__":
        from importlib.metadata import version

        return version("viewsphere")
    if name not in _HOMES:
        raise AttributeError(f"module 'viewsphere' has no attribute {name!r}")
    return attribute(_HOMES[name])


def __dir__() -> list[str]:
    return sorted(__all__)
