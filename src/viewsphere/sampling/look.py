"""How an engine's pictures look beside what a recipe says: what its program makes of it."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

from viewsphere import plugins

IMAGING = Path(__file__).parents[1] / "imaging"
"""What finishes the pictures of every engine."""


@cache
def engine_look(name: str) -> str:
    """A digest of the sources of the engine of this name and of what finishes its pictures.

    Two states of a program may carry one version, but only equal sources surely paint alike. Raises UserError for an engine
    that is not there.
    """
    file = getattr(plugins.load("engines", name), "__file__", None)
    own = [] if file is None else [Path(file).parent if Path(file).name == "__init__.py" else Path(file)]
    digest = hashlib.sha256()
    for root in (*own, IMAGING):
        for source in sorted(root.rglob("*.py")) if root.is_dir() else [root]:
            digest.update(source.name.encode() + b"\0" + source.read_bytes())
    return digest.hexdigest()[:16]
