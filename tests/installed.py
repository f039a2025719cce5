"""Third-party plug-ins, installed as pip installs them: modules in a folder on the path, and metadata with entry points."""

from __future__ import annotations

import re
import sys
from collections.abc import Generator
from contextlib import contextmanager
from itertools import count
from pathlib import Path

from small import ROOT

_NUMBERS = count()
"""Each package has a name of its own, as modules of one name are imported once."""


def example(begins: str) -> str:
    """The code block of docs/extending.md whose docstring begins so."""
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "extending.md").read_text("utf-8"), re.DOTALL)
    (code,) = (block for block in blocks if block.startswith(f'"""{begins}'))
    return code


def write_package(site: Path, package: str, modules: dict[tuple[str, str], str]) -> Path:
    """Write a distribution whose modules, by group and name, are plug-ins; returns the folder of the modules. Several names,
    with spaces between, are entry points of one module, which has the first name.
    """
    folder, about = site / package, site / f"{package}-1.0.dist-info"
    folder.mkdir(parents=True)
    about.mkdir()
    (folder / "__init__.py").touch()
    points: dict[str, list[str]] = {}
    for (group, names), code in modules.items():
        module = names.split()[0]
        (folder / f"{module}.py").write_text(code, encoding="utf-8")
        points.setdefault(group, []).extend(f"{name} = {package}.{module}" for name in names.split())
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    text = "\n".join(f"[viewsphere.{group}]\n" + "\n".join(lines) + "\n" for group, lines in points.items())
    (about / "entry_points.txt").write_text(text)
    return folder


@contextmanager
def installed(site: Path, group: str, name: str, code: str) -> Generator[Path]:
    """A distribution of one plug-in on this process's path; yields the plug-in's file."""
    package, module = f"my_package_{next(_NUMBERS)}", name.split(maxsplit=1)[0]
    here = site / package
    file = write_package(here, package, {(group, name): code}) / f"{module}.py"
    sys.path.insert(0, str(here))
    try:
        yield file
    finally:
        sys.path.remove(str(here))
        for loaded in (package, f"{package}.{module}"):
            sys.modules.pop(loaded, None)
