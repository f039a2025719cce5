"""The figures of docs/proofs.md: what tests find labels to differ by, and what labels cost, into docs/labels.json.

benchmarks/measure_labels               # both; scripts/docs then writes the page
benchmarks/measure_labels --errors      # only the tests that compare labels with what is independent of them
benchmarks/measure_labels --costs       # only CPU time
benchmarks/measure_labels --pictures    # only the pictures, anew (label_pictures.py)
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys

from gathered import ROOT, Proofs, gathered

from viewsphere import plugins

FILE = ROOT / "docs" / "labels.json"
OBJECTS = 20
ROUNDS = 5


def errors() -> Proofs:
    """The largest difference of each label from each thing it is compared with, and the test files that do."""
    formats = plugins.names("formats")
    return {name: found for name, found in gathered("tests").items() if name not in formats}


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
