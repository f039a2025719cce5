"""The notes of tests by tests/proven.py, gathered: the largest difference of each thing from each that it is compared with."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
USE = "from proven import"

Proofs = dict[str, list[dict[str, Any]]]


def gathered(folder: str, pythons: Iterable[str] = (sys.executable,), *, slow: bool = False) -> Proofs:
    """The largest differences that the tests below a folder of tests/ find, slow ones if wanted, by each of these Pythons; and
    their files.
    """
    files = sorted(str(path) for path in (ROOT / folder).rglob("test_*.py") if USE in path.read_text("utf-8"))
    with tempfile.TemporaryDirectory() as place:
        noted = Path(place) / "proven"
        for python in pythons:
            environment = {**os.environ, "VIEWSPHERE_PROVEN": str(noted)}
            command = [python, "-m", "pytest", "-q", *([] if slow else ["-m", "not slow"]), *files]
            is_own = python == sys.executable  # another one may lack what some tests need
            subprocess.run(command, cwd=ROOT, env=environment, check=is_own)
        return largest(noted)


def largest(noted: Path) -> Proofs:
    """The largest differences in a file that tests wrote."""
    errors: dict[tuple[str, str, str, str], float] = {}
    versions: dict[str, str] = {}
    for line in map(json.loads, noted.read_text("utf-8").splitlines()):
        key = line["label"], line["against"], line["unit"], line["test"]
        errors[key] = max(errors.get(key, 0.0), line["error"])
        versions.setdefault(line["against"], line["version"])
    found: Proofs = {}
    for (label, against, unit, test), error in sorted(errors.items()):
        by = {"version": versions[against]} if versions[against] else {}
        told = {"against": against, **by, "error": float(f"{error:.2g}"), "unit": unit, "test": test}
        found.setdefault(label, []).append(told)
    return found
