"""Packages of extras, looked for before they are needed."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.util import find_spec

from viewsphere.errors import MissingExtraError


def check_packages(packages: Iterable[str], extra: str, what: str) -> None:
    """Check that an extra's packages are installed, without importing them; raises MissingExtraError that
    begins with `what`.
    """
    missing = [name for name in packages if find_spec(name) is None]
    if missing:
        names, are = " and ".join(missing), "is" if len(missing) == 1 else "are"
        raise MissingExtraError(f"{what} needs {names}, which {are} not installed: pip install 'viewsphere[{extra}]'")
