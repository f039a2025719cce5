"""Builds the sdist and the wheels, checks them, and tries them on every Python that viewsphere supports.

    scripts/package [--output dist] [--kernels all | newest | none]

One wheel is for any machine, and compiles kernels when they are called. On Linux with an x86-64 processor there is one more for
each Python: it holds the kernels that were compiled beside each numba of `scripts/kernel_builds.txt`, which is brought up to
date at each release. `--kernels newest`, as CI has it, takes the last of these alone: each takes a minute of processor time.

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
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from viewsphere.kernels.build import COMMON, TARGET

ROOT = Path(__file__).resolve().parents[1]
PLATFORM = "manylinux_2_17_x86_64"
"""Kernels call nothing of the system: the oldest that numba's wheels are for."""

COMPILE = """
import sys
from viewsphere.kernels.build import COMMON, TARGET
from viewsphere.run.shots.precompile import compile_table
assert TARGET.cpu == COMMON, TARGET
sys.exit(compile_table(lambda done, total: None))
"""
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


def builds() -> list[list[str]]:
    """The exact packages that kernels are compiled beside."""
    lines = (ROOT / "scripts" / "kernel_builds.txt").read_text("utf-8").splitlines()
    return [line.split() for line in lines if line.strip() and not line.startswith("#")]


def with_kernels(pure: Path, python: str, work: Path, beside: list[list[str]]) -> Path | None:
    """The wheel of a Python: the pure one and kernels beside each of these builds; None where there is no such Python here."""
    kernels = work / "kernels"
    for number, exact in enumerate(beside):
        own, made = environment(work), work / f"venv-{number}"
        if not make_venv(python, made, own):
            return None
        subprocess.run([UV, "pip", "install", "--quiet", "--python", made, pure, *exact], env=own, check=True)
        own |= {"VIEWSPHERE_CACHE": str(work / f"cache-{number}")}
        subprocess.run([binaries(made) / "python", "-I", "-c", COMPILE], env=own, check=True)
        shutil.copytree(work / f"cache-{number}" / "kernels", kernels, dirs_exist_ok=True)
        shutil.rmtree(made)
    return packed(pure, kernels, f"cp{python.replace('.', '')}-none-{PLATFORM}")


def packed(pure: Path, kernels: Path, tag: str) -> Path:
    """A wheel of this tag: the pure one with kernels in it, beside it."""
    with tempfile.TemporaryDirectory(prefix="viewsphere-wheel-") as name:
        subprocess.run([sys.executable, "-m", "wheel", "unpack", "--dest", name, pure], check=True, stdout=subprocess.DEVNULL)
        (folder,) = Path(name).iterdir()
        shutil.copytree(kernels, folder / "viewsphere" / "kernels" / "shipped")
        (about,) = folder.glob("*.dist-info/WHEEL")
        text = about.read_text("utf-8").replace("Tag: py3-none-any", f"Tag: {tag}")
        about.write_text(text.replace("Root-Is-Purelib: true", "Root-Is-Purelib: false"), "utf-8")
        command = [sys.executable, "-m", "wheel", "pack", "--dest", pure.parent, folder]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    (made,) = pure.parent.glob(f"*-{tag}.whl")
    return made


def make_venv(python: str, folder: Path, own: dict[str, str]) -> bool:
    """Make an environment of a Python; False where there is none."""
    try:
        command = [UV, "venv", "--quiet", "--python", python, folder]
        subprocess.run(command, env=own, check=True, timeout=120, capture_output=True)
    except (subprocess.CalledProcessError, subprocess.TimeoutExpired):
        return False
    return True


def binaries(venv: Path) -> Path:
    return venv / ("Scripts" if os.name == "nt" else "bin")


def environment(folder: Path) -> dict[str, str]:
    """Variables for uv and for what it installs: pyenv's Pythons can be found, kernels are compiled into a folder that goes."""
    versions = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    path = os.pathsep.join([*map(str, sorted(versions.glob("*/bin"))), os.environ["PATH"]])
    kept = {name: value for name, value in os.environ.items() if name not in {"PYTHONPATH", "VIRTUAL_ENV", "PYENV_VERSION"}}
    return {**kept, "PATH": path, "VIEWSPHERE_CACHE": str(folder / "cache"), "UV_LINK_MODE": "copy"}


def try_on(python: str, wheels: Mapping[str, Path], pure: Path) -> bool:
    """Install the wheel into a new environment of this Python and make a data set with it; False where there is none."""
    with tempfile.TemporaryDirectory(prefix="viewsphere-package-") as name:
        folder = Path(name)
        own, made = environment(folder), folder / "venv"
        if not make_venv(python, made, own):
            return False
        exact = builds()[-1] if python in wheels else []
        wheel = wheels.get(python, pure)
        subprocess.run([UV, "pip", "install", "--quiet", "--python", made, wheel, *exact], env=own, check=True)
        for words in commands():
            command = [binaries(made) / "viewsphere", *words]
            run = subprocess.run(command, env=own, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            if run.returncode:
                sys.exit(f"Python {python}: viewsphere {' '.join(words)}: exit status {run.returncode}\n{run.stdout}")
        compiled = [file.name for file in (folder / "cache").rglob("*.kernel") if file.parent.name != "marks"]
        if python in wheels and compiled:
            sys.exit(f"Python {python}: expected a wheel with all kernels; these were compiled: {', '.join(compiled)}")
    return True


def commands() -> Iterator[list[str]]:
    """The first commands of a new user."""
    yield ["doctor"]
    yield ["new", "first"]
    changes = [word for name, value in SMALL.items() for word in ("--set", f"{name}={value}")]
    yield ["render", "first/recipe.yaml", "-o", "first-ds", "--workers", "0", *changes]
    yield ["check", "first-ds", "--workers", "0"]
    yield ["report", "first-ds"]


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--output", type=Path, default=ROOT / "dist")
    options.add_argument("--kernels", choices=["all", "newest", "none"], default="all", help="builds of numba that wheels hold")
    args = options.parse_args()
    pure = build(args.output)
    wheels: dict[str, Path] = {}
    if args.kernels != "none" and sys.platform == "linux" and TARGET.cpu == COMMON:
        for python in pythons():
            with tempfile.TemporaryDirectory(prefix="viewsphere-kernels-") as work:
                made = with_kernels(pure, python, Path(work), builds()[-1:] if args.kernels == "newest" else builds())
            if made is not None:
                wheels[python] = made
                print(f"{made.name}: {made.stat().st_size / 1e6:.1f} MB")
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        tried = dict(zip(pythons(), pool.map(partial(try_on, wheels=wheels, pure=pure), pythons()), strict=True))
    for python, there in tried.items():
        print(
            f"Python {python}: {'installed, rendered and checked' if there else 'skipped: there is none, and none can be had'}"
        )
    if not any(tried.values()):
        sys.exit("expected one of these Pythons at least, found none")


if __name__ == "__main__":
    main()
