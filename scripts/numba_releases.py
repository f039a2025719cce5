"""Truth on every release of numba that viewsphere allows, with its quicker compiler and without.

    scripts/numba_releases [RELEASE ...]    # default: 0.66 0.67 0.68, or whatever `kernel_cache.QUICKER` names

Digests of truth over random scenes (`tests/truth/truth_digest.py`) have to be equal everywhere; then the tests of truth and of
kernels run on the oldest release without the quicker compiler. Releases that are not installed come into `.venv/numba`. The
table gives the CPU seconds of compiling, and those of drawing the scenes.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from importlib.metadata import version
from itertools import product
from pathlib import Path
from typing import Any

from viewsphere.kernels.kernel_cache import NUMBA, QUICKER

ROOT = Path(__file__).resolve().parents[1]
TESTS = ROOT / "tests"
DIGESTS = TESTS / "truth" / "truth_digest.py"


def installed(release: str) -> Path | None:
    """The folder with this release's newest numba, None for what this Python has anyway."""
    if NUMBA.startswith(f"{release}."):
        return None
    folder = ROOT / ".venv" / "numba" / release
    if not (folder / "numba").is_dir():
        wanted = f"numba=={release}.*", f"numpy=={version('numpy')}"
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--target", str(folder)]
        subprocess.run([*pip, *wanted], check=True)
    return folder


def environment(cache: Path, release: str, stock: bool) -> dict[str, str]:
    """Environment variables for a process with this numba, which keeps compiled kernels in a separate folder."""
    folder = installed(release)
    path = os.pathsep.join(map(str, [TESTS] if folder is None else [folder, TESTS]))
    place = cache / f"{release} {'stock' if stock else 'quicker'}"
    return {**os.environ, "PYTHONPATH": path, "VIEWSPHERE_STOCK_NUMBA": str(int(stock)), "VIEWSPHERE_CACHE": str(place)}


def measured(cache: Path, build: tuple[str, bool]) -> dict[str, Any]:
    """The output of `truth_digest.py` for a build: a release, and whether it runs without the quicker compiler."""
    command = [sys.executable, str(DIGESTS)]
    said = json.loads(subprocess.run(command, env=environment(cache, *build), check=True, capture_output=True).stdout)
    if not said["numba"].startswith(f"{build[0]}.") or said["stock"] != build[1]:
        raise SystemExit(f"expected numba {build[0]}, stock: {build[1]}; found {said}")
    return said


def table(found: Iterable[dict[str, Any]]) -> list[str]:
    """Lines of a table, one for each build."""
    lines = ["| numba | compiler | compiling, CPU s | drawing, CPU s | visibility | samples |", "|---|---|---:|---:|---|---|"]
    for said in found:
        name, compiling = "stock" if said["stock"] else "quicker", said["first"] - said["again"]
        digests = f"{said['visibility'][:12]} | {said['samples'][:12]}"
        lines.append(f"| {said['numba']} | {name} | {compiling:.1f} | {said['again']:.1f} | {digests} |")
    return lines


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("releases", nargs="*", default=QUICKER, metavar="RELEASE", help="minor versions, the oldest first")
    options.add_argument("--digests-only", action="store_true", help="run no tests on the oldest")
    args = options.parse_args()
    for release in args.releases:
        installed(release)
    with tempfile.TemporaryDirectory() as folder:
        cache = Path(folder)
        with ThreadPoolExecutor(2) as pool:
            found = list(pool.map(partial(measured, cache), product(args.releases, (False, True))))
        print("\n".join(table(found)))
        if len({(said["visibility"], said["samples"]) for said in found}) > 1:
            raise SystemExit("truth differs: expected equal digests on every release, with the quicker compiler and without")
        if not args.digests_only:
            tests = [sys.executable, "-m", "pytest", "-m", "not slow", "--numprocesses", "auto", "tests/truth", "tests/kernels"]
            raise SystemExit(subprocess.run(tests, cwd=ROOT, env=environment(cache, args.releases[0], True)).returncode)


if __name__ == "__main__":
    main()
