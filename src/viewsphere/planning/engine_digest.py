"""The digest of an engine's program, which determines the pictures together with the recipe."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

from pydantic import JsonValue

from viewsphere import plugins
from viewsphere.files import read_bytes, written_path
from viewsphere.plugins.engine import EngineSpec
from viewsphere.recipe.recipe import Recipe

SHARED = tuple(Path(__file__).parents[1] / name for name in ("materials", "rendering", "model/scene.py"))
"""Sources that the pictures of every engine depend on: finish, surroundings, materials, and a scene's defaults."""


@cache
def engine_digest(name: str) -> str:
    """A digest of the sources of the engine of this name, of the programs it runs (its `programs`), and of what
    all engines share.

    Versions of a program may share a version number, but only equal sources guarantee equal pictures. Raises UserError for an
    unknown engine.
    """
    engine, file = plugins.load(EngineSpec, name), plugins.module_file("engines", name)
    own = [] if file is None else [file.parent if file.name == "__init__.py" else file]
    digest = hashlib.sha256()
    for root in (*own, *engine.programs, *SHARED):
        for source in sorted(root.rglob("*.py")) if root.is_dir() else [root]:
            digest.update(source.name.encode() + b"\0" + read_bytes(source))
    return digest.hexdigest()[:16]


def engine_options(recipe: Recipe) -> dict[str, JsonValue]:
    """The options of a recipe's engine; the path of a `script` is relative to the recipe's folder."""
    options = recipe.engine.options
    script = options.get("script")
    return options | {"script": str(recipe.folder / written_path(script))} if isinstance(script, str) else options


def script_digest(recipe: Recipe) -> str | None:
    """SHA-256 of the engine's script, which affects its pictures; None without a script, or if the file is missing."""
    script = engine_options(recipe).get("script")
    if not isinstance(script, str) or not Path(script).is_file():
        return None
    return hashlib.sha256(read_bytes(Path(script))).hexdigest()
