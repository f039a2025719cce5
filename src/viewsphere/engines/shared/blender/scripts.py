"""A user's own script, which changes the scene that Blender has staged before it is painted; it runs only if the user allows
it.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from viewsphere.blender.interpreter import SCRIPTS
from viewsphere.engines.shared.blender.options import AnyOptions
from viewsphere.errors import RecipeError
from viewsphere.files import read_text
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing


def check_script(script: str | None) -> None:
    """Raise RecipeError for a script that is missing, or that is not allowed to run."""
    if script is None:
        return
    if not Path(script).is_file():
        raise RecipeError(f"engine.script: expected a Python file; found none at {script}")
    if os.environ.get(SCRIPTS) != "1":
        raise RecipeError(
            f"engine.script: expected --allow-scripts (in Python {SCRIPTS}=1), as a script may do all that you may; found "
            f"neither: read {script}, then allow it"
        )


def script_request(options: AnyOptions, shot: Shot, things: Sequence[Thing]) -> dict[str, Any] | None:
    """Return the worker's request for the script, None without a script.

    The request has the script's text, the shot's key and frames, and an entry for each staged thing. The entries are in the
    order of the objects in the scene's request.
    """
    if options.script is None:
        return None
    check_script(options.script)
    known = [
        {"id": thing.id, "category": thing.model.category, "model": thing.model.key, "is_scenery": thing.scenery}
        for thing in things
    ]
    text = read_text(Path(options.script))
    return {"file": options.script, "text": text, "things": known, "shot": {"key": shot.key, "frames": shot.first}}
