"""The figures of docs/format-list.md: what tests find that programs read of exports, into docs/formats.json.

benchmarks/measure_formats                   # with the tests' environment; scripts/docs then writes the page
benchmarks/measure_formats --python PATH     # also with another Python, whose packages (such as torch) .venv lacks
"""

from __future__ import annotations

import argparse
import json
import sys

from gathered import ROOT, gathered

from viewsphere import plugins


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--python", action="append", default=[], help="another Python that has viewsphere")
    found = gathered("tests/formats", [sys.executable, *options.parse_args().python], slow=True)
    known = {name: found[name] for name in plugins.names("formats") if name in found}
    (ROOT / "docs" / "formats.json").write_text(json.dumps(known, indent=1, sort_keys=True) + "\n", "utf-8")


if __name__ == "__main__":
    main()
