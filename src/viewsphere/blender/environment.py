"""A Python environment for Blender only, made in the user's data folder."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import platformdirs

from viewsphere.errors import UserError
from viewsphere.scratch import ScratchDir, sweep

REQUIREMENTS = Path(__file__).with_name("requirements.txt")
"""The packages and the digests of their files. Pip refuses other files, so a changed index does no harm."""

PINNED = ("--disable-pip-version-check", "--require-hashes", "--only-binary", ":all:")
"""Options of pip: only files with known digests, and only wheels, which run no code at installation."""

PREFIX = "blender-making-"

Listener = Callable[[str], None]


def home() -> Path:
    """The environment's folder, inside the user's data folder; the environment itself may not be made yet."""
    return Path(platformdirs.user_data_dir("viewsphere")) / "blender"


def interpreter_of(environment: Path) -> Path:
    """The interpreter of a virtual environment."""
    return environment / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def make_environment(listener: Listener) -> Path:
    """Make the environment, or make it anew, and return its interpreter.

    The environment is built under another name and renamed when complete. `listener` gets a line for each step, and pip's
    lines. Raises UserError if there is no Python 3.11, or if pip cannot install the packages.
    """
    place = home()
    base = _python311()
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        sweep(place.parent, PREFIX)
        scratch_folder = ScratchDir.make(place.parent, PREFIX)
    except OSError as error:
        raise UserError(f"{place}: expected a place to write, found: {error.strerror or error}") from None
    try:
        listener(f"making {place} with {base}: about 1 GB")
        _run([base, "-m", "venv", scratch_folder.folder / "new"], listener)
        made = interpreter_of(scratch_folder.folder / "new")
        _run([made, "-m", "pip", "install", *PINNED, "-r", REQUIREMENTS], listener)
        with suppress(FileNotFoundError):
            place.rename(scratch_folder.folder / "old")
        (scratch_folder.folder / "new").rename(place)
    finally:
        scratch_folder.remove()
    return interpreter_of(place)


def _python311() -> str:
    """A Python 3.11: this one, or one on the PATH."""
    if sys.version_info[:2] == (3, 11):
        return sys.executable
    for name in ("python3.11", "python3", "python"):
        found = shutil.which(name)
        if found and _version(found) == "3.11":
            return found
    here = "{}.{}".format(*sys.version_info)
    raise UserError(f"--setup-blender: expected a Python 3.11, as Blender needs it; found {here} and no python3.11: install it")


def _version(python: str) -> str:
    code = "import sys; print('%d.%d' % sys.version_info[:2])"
    with suppress(OSError, subprocess.TimeoutExpired):
        return subprocess.run([python, "-c", code], capture_output=True, text=True, timeout=20).stdout.strip()
    return ""


def _run(command: list[str | Path], listener: Listener) -> None:
    """Run a command and pass its output on, line by line; if the command fails, UserError with the last line."""
    said = ""
    own = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace", env=own
    ) as process:
        assert process.stdout is not None
        try:
            for line in process.stdout:
                listener(line.rstrip())
                said = line.strip() if "error" in line.lower() or not said else said
        except BaseException:
            process.kill()
            raise
    if process.returncode:
        raise UserError(f"--setup-blender: expected `python -m {command[2]}` to succeed, found: {said or 'no word'}")
