"""The figures of docs/proofs.md: what tests find labels to differ by, and what labels cost, into docs/labels.json.

scripts/measure_labels               # both; scripts/docs then writes the page
scripts/measure_labels --errors      # only the tests that compare labels with what is independent of them
scripts/measure_labels --costs       # only CPU time
scripts/measure_labels --pictures    # only the pictures, anew (label_pictures.py)
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
FILE = ROOT / "docs" / "labels.json"
USE = "from proven import"
OBJECTS = 20
ROUNDS = 5

Proofs = dict[str, list[dict[str, Any]]]


def errors() -> Proofs:
    """The largest difference of each label from each thing it is compared with, and the test files that do."""
    files = sorted(str(path) for path in (ROOT / "tests").rglob("test_*.py") if USE in path.read_text("utf-8"))
    with tempfile.TemporaryDirectory() as folder:
        noted = Path(folder) / "proven"
        command = [sys.executable, "-m", "pytest", "-q", "-m", "not slow", *files]
        subprocess.run(command, cwd=ROOT, env={**os.environ, "VIEWSPHERE_PROVEN": str(noted)}, check=True)
        lines = [json.loads(line) for line in noted.read_text("utf-8").splitlines()]
    largest: dict[tuple[str, str, str, str], float] = {}
    for line in lines:
        key = line["label"], line["against"], line["unit"], line["test"]
        largest[key] = max(largest.get(key, 0.0), line["error"])
    found: Proofs = {}
    for (label, against, unit, test), error in sorted(largest.items()):
        found.setdefault(label, []).append({"against": against, "error": float(f"{error:.2g}"), "unit": unit, "test": test})
    return found


def costs() -> dict[str, float]:
    """CPU milliseconds of each label at 640x480 with twenty objects."""
    from bench import embree
    from bench_labels import measure, measure_moving

    found = measure(OBJECTS, ROUNDS, embree)[0] | measure_moving(OBJECTS, ROUNDS)
    return {name: float(f"{ms:.2g}") for name, ms in found.items()}


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("errors", "costs", "pictures"):
        options.add_argument(f"--{name}", action="store_true")
    asked = options.parse_args()
    if asked.pictures:
        subprocess.run([sys.executable, str(ROOT / "scripts" / "label_pictures.py")], check=True)
        return
    known = json.loads(FILE.read_text("utf-8")) if FILE.exists() else {"proofs": {}, "costs": {}}
    if asked.errors or not asked.costs:
        known["proofs"] = errors()
    if asked.costs or not asked.errors:
        known["costs"] = costs()
    FILE.write_text(json.dumps(known, indent=1, sort_keys=True) + "\n", "utf-8")


if __name__ == "__main__":
    main()
