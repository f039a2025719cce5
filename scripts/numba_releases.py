"""Truth on every release of numba that viewsphere allows, with its quicker compiler and without.

    scripts/numba_releases [RELEASE ...]    # default: 0.66 0.67 0.68, or whatever `build.QUICKER` names

Digests of truth over random scenes (`tests/truth/truth_digest.py`) have to be equal everywhere, and the tests of truth and of
kernels to pass on the oldest release without the quicker compiler. Releases that are not installed come into `.venv/numba`.
The table gives the CPU seconds of compiling, and those of drawing the scenes; what this Python uses anyway may be compiled
already.
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
from pathlib import Path
from typing import Any

from viewsphere.kernels.build import NUMBA, QUICKER

ROOT = Path(__file__).resolve().parents[1]
TESTS = ROOT / "tests"
DIGESTS = TESTS / "truth" / "truth_digest.py"
OF_THE_QUICKER = "tests/kernels/test_fence.py", "tests/kernels/test_compiler.py"
"""Tests of the quicker compiler and of when it is loaded, which do not apply to an older numba without it."""


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
    """Environment variables for a process with this numba, which keeps compiled kernels in a separate folder; what this Python
    uses anyway finds those that the tests have compiled.
    """
    folder = installed(release)
    path = os.pathsep.join(map(str, [TESTS] if folder is None else [folder, TESTS]))
    place = cache / f"{release} {'stock' if stock else 'quicker'}"
    own = {} if folder is None and not stock else {"VIEWSPHERE_CACHE": str(place)}
    return {**os.environ, "PYTHONPATH": path, "VIEWSPHERE_STOCK_NUMBA": str(int(stock)), **own}


def measured(cache: Path, build: tuple[str, bool]) -> dict[str, Any]:
    """The output of `truth_digest.py` for a build: a release, and whether it runs without the quicker compiler."""
    command = [sys.executable, str(DIGESTS)]
    said = json.loads(subprocess.run(command, env=environment(cache, *build), check=True, capture_output=True).stdout)
    if not said["numba"].startswith(f"{build[0]}.") or said["stock"] != build[1]:
        raise SystemExit(f"expected numba {build[0]}, stock: {build[1]}; found {said}")
    return said


def tested(cache: Path, release: str) -> subprocess.CompletedProcess[str]:
    """Run the tests of truth and kernels with this release, without the quicker compiler."""
    tests = [sys.executable, "-m", "pytest", "-m", "not slow", "tests/truth", "tests/kernels"]
    tests += [f"--ignore={file}" for file in OF_THE_QUICKER]
    return subprocess.run(tests, cwd=ROOT, env=environment(cache, release, True), capture_output=True, text=True)


def table(found: Iterable[dict[str, Any]]) -> list[str]:
    """Lines of a table, one for each build."""
    lines = ["| numba | compiler | compiling, CPU s | drawing, CPU s | visibility | samples |", "|---|---|---:|---:|---|---|"]
    for said in found:
        seconds = f"{said['compiling']:.1f} | {said['drawing']:.1f}"
        digests = f"{said['visibility'][:12]} | {said['samples'][:12]}"
        lines.append(f"| {said['numba']} | {'stock' if said['stock'] else 'quicker'} | {seconds} | {digests} |")
    return lines


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("releases", nargs="*", default=QUICKER, metavar="RELEASE", help="minor versions, the oldest first")
    options.add_argument("--digests-only", action="store_true", help="run no tests on the oldest")
    args = options.parse_args()
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(2) as pool:
        run = partial(measured, Path(folder))
        list(pool.map(installed, args.releases))
        # What takes longest comes first, and the tests when the oldest release's kernels are compiled.
        slow = [pool.submit(run, (release, True)) for release in args.releases]
        tests = None if args.digests_only else pool.submit(tested, Path(folder), args.releases[0])
        quick = [pool.submit(run, (release, False)) for release in args.releases]
        found = [each.result() for pair in zip(quick, slow, strict=True) for each in pair]
        print("\n".join(table(found)))
        if len({(said["visibility"], said["samples"]) for said in found}) > 1:
            raise SystemExit("truth differs: expected equal digests on every release, with the quicker compiler and without")
        if tests is not None:
            said = tests.result()
            print(said.stdout + said.stderr)
            raise SystemExit(said.returncode)


if __name__ == "__main__":
    main()
