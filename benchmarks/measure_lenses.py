"""The figures of docs/lens-proofs.md: every label of every lens against an independent caster, into docs/lenses.json.

benchmarks/measure_lenses                  # all lenses of the registry; scripts/docs then writes the page
benchmarks/measure_lenses --lens fisheye   # these models anew, the others as before
benchmarks/measure_lenses --formats        # only the formats' answers

Needs embreex, and Blender for its column; without Blender, the column keeps its last figures. The status is 1 where a label is
wrong.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
from typing import Any

from gathered import ROOT

sys.path.insert(0, str(ROOT / "tests"))

from lens_formats import answers
from lens_table import SIZE, Kept, Row, lenses, row, scenes
from viewsphere.blender.interpreter import find_blender
from viewsphere.errors import UserError

FILE = ROOT / "docs" / "lenses.json"


def has_blender() -> bool:
    try:
        find_blender(None)
    except UserError:
        return False
    return True


def record(made: Row, known: dict[str, Any] | None) -> dict[str, Any]:
    """A row as plain data; the column of Blender as before, if it is not here."""
    plain = {**dataclasses.asdict(made), "scenes": scenes()}
    for cell in plain["cells"].values():
        cell["error"] = float(f"{cell['error']:.2g}")
    if not has_blender() and known is not None:
        plain["cycles"] = known["cycles"]
    return plain


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--lens", nargs="+", default=[], help="models")
    options.add_argument("--formats", action="store_true")
    chosen = options.parse_args()
    cameras, seen = list(lenses()), Kept()
    rows = {before["words"]: before for before in json.loads(FILE.read_text("utf-8"))["rows"]} if FILE.exists() else {}
    formats = dict(answers({words: camera for _, words, camera in cameras}))
    save(rows, cameras, formats)
    for name, words, camera in [] if chosen.formats else cameras:
        if not chosen.lens or name in chosen.lens:
            rows[words] = record(row(name, words, camera, scenes(), seen, cycles=has_blender()), rows.get(words))
            save(rows, cameras, formats)
            print(words, sum(cell["wrong"] for cell in rows[words]["cells"].values()), "wrong", flush=True)
    if any(cell["wrong"] for made in rows.values() for cell in made["cells"].values()):
        sys.exit("labels are wrong")


def save(rows: dict[str, Any], cameras: list[tuple[str, str, Any]], formats: dict[str, Any]) -> None:
    """Write the rows of lenses that exist, in the registry's order, and the formats' answers."""
    kept = [rows[words] for _, words, _ in cameras if words in rows]
    FILE.write_text(json.dumps({"size": list(SIZE), "rows": kept, "formats": formats}, indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main()
