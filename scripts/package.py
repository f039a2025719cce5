"""Builds the sdist and the wheel, checks them, and tries the wheel on every Python that viewsphere supports.

    scripts/package [--output dist]

uv looks for each Python on this machine (on the PATH and among pyenv's), and downloads it where it may; those that cannot be
had are named and skipped. What the archives must and must not hold, `tests/test_package.py` says.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
UV = str(Path(sys.executable).with_name("uv"))
SMALL = {"models[0].count": 1, "camera.size": [64, 48], "viewpoints": {"azimuth": [0, 90], "elevation": 20, "distance": 4}}
"""Changes to `viewsphere new`'s recipe: two small frames, since compiling the kernels is what takes time."""


def pythons() -> list[str]:
    """The versions of Python that the package names, oldest first."""
    named = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["classifiers"]
    return [found[1] for line in named if (found := re.fullmatch(r"Programming Language :: Python :: (3\.\d+)", line))]


def build(output: Path) -> Path:
    """Build both archives, the wheel from the sdist's files; returns the wheel."""
    shutil.rmtree(output, ignore_errors=True)
    subprocess.run([UV, "build", "--quiet", "--out-dir", output, ROOT], check=True)
    (output / ".gitignore").unlink(missing_ok=True)  # uv's
    subprocess.run([sys.executable, "-m", "twine", "--no-color", "check", "--strict", *output.iterdir()], check=True)
    return next(output.glob("*.whl"))


def environment(folder: Path) -> dict[str, str]:
    """Variables for uv and for what it installs: pyenv's Pythons can be found, kernels are compiled into a folder that goes."""
    versions = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    path = os.pathsep.join([*map(str, sorted(versions.glob("*/bin"))), os.environ["PATH"]])
    kept = {name: value for name, value in os.environ.items() if name not in {"PYTHONPATH", "VIRTUAL_ENV", "PYENV_VERSION"}}
    return {**kept, "PATH": path, "VIEWSPHERE_CACHE": str(folder / "cache"), "UV_LINK_MODE": "copy"}


def try_on(python: str, wheel: Path) -> bool:
    """Install the wheel into a new environment of this Python and make a data set with it; False where there is none."""
    with tempfile.TemporaryDirectory(prefix="viewsphere-package-") as name:
        folder = Path(name)
        own, made = environment(folder), folder / "venv"
        try:
            subprocess.run(
                [UV, "venv", "--quiet", "--python", python, made], env=own, check=True, timeout=120, capture_output=True
            )
        except (subprocess.CalledProcessError, subprocess.TimeoutExpired):
            return False
        scripts = made / ("Scripts" if os.name == "nt" else "bin")
        subprocess.run([UV, "pip", "install", "--quiet", "--python", made, wheel], env=own, check=True)
        for words in commands():
            command = [scripts / "viewsphere", *words]
            run = subprocess.run(command, env=own, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            if run.returncode:
                sys.exit(f"Python {python}: viewsphere {' '.join(words)}: exit status {run.returncode}\n{run.stdout}")
    return True


def commands() -> Iterator[list[str]]:
    """What a new user types first."""
    yield ["doctor"]
    yield ["new", "first"]
    changes = [word for name, value in SMALL.items() for word in ("--set", f"{name}={value}")]
    yield ["render", "first/recipe.yaml", "-o", "first-ds", "--workers", "0", *changes]
    yield ["check", "first-ds", "--workers", "0"]
    yield ["report", "first-ds"]


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--output", type=Path, default=ROOT / "dist")
    wheel = build(options.parse_args().output)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        tried = dict(zip(pythons(), pool.map(partial(try_on, wheel=wheel), pythons()), strict=True))
    for python, there in tried.items():
        print(
            f"Python {python}: {'installed, rendered and checked' if there else 'skipped: there is none, and none can be had'}"
        )
    if not any(tried.values()):
        sys.exit("expected one of these Pythons at least, found none")


if __name__ == "__main__":
    main()
