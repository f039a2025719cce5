"""The search for a Python that has Blender, and the test that it works."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from viewsphere.blender import environment
from viewsphere.blender.process import BlenderProcess
from viewsphere.errors import BlenderDied, BlenderError, MissingExtraError, UserError
from viewsphere.files import written_path
from viewsphere.scratch import temporary

VARIABLE = "VIEWSPHERE_BLENDER_PYTHON"
SCRIPTS = "VIEWSPHERE_ALLOW_SCRIPTS"
"""The environment variable that allows scripts of recipes if it is 1; child processes inherit it."""

INSTALL = "pip install 'viewsphere[blender]' in Python 3.11, or run viewsphere doctor --setup-blender"
GRAPHICS = (
    "it needs OpenGL 4.3 through EGL; on Debian and Ubuntu: apt-get install libegl1 libgl1-mesa-dri, which draw without a "
    "graphics card, or the card's driver"
)
PROBE_S = 60.0
"""Seconds for Blender's start and its answer; a hanging start ends after this time."""
DRAW_S = 60.0
"""Seconds for a tiny picture of OpenGL; a hanging driver ends after this time."""
ASK_S = 20.0
"""Seconds for a program that only prints facts."""

PACKAGES = {
    "libEGL.so.1": "libegl1",
    "libGL.so.1": "libgl1",
    "libGLX.so.0": "libglx0",
    "libICE.so.6": "libice6",
    "libSM.so.6": "libsm6",
    "libX11.so.6": "libx11-6",
    "libXau.so.6": "libxau6",
    "libXdmcp.so.6": "libxdmcp6",
    "libXext.so.6": "libxext6",
    "libXfixes.so.3": "libxfixes3",
    "libXi.so.6": "libxi6",
    "libXrender.so.1": "libxrender1",
    "libXxf86vm.so.1": "libxxf86vm1",
    "libbsd.so.0": "libbsd0",
    "libgcc_s.so.1": "libgcc-s1",
    "libgomp.so.1": "libgomp1",
    "libstdc++.so.6": "libstdc++6",
    "libuuid.so.1": "libuuid1",
    "libwayland-client.so.0": "libwayland-client0",
    "libxcb.so.1": "libxcb1",
    "libxkbcommon.so.0": "libxkbcommon0",
}
"""Debian's and Ubuntu's packages for the system libraries that Blender needs."""


@dataclass(frozen=True)
class Device:
    """A device that Cycles can compute on: its kind (CPU, CUDA, OPTIX, HIP, METAL or ONEAPI) and its name."""

    kind: str
    name: str


@dataclass(frozen=True)
class Library:
    """A missing system library, and the Debian or Ubuntu package that contains it, if known."""

    name: str
    package: str | None


@dataclass(frozen=True)
class _Graphics:
    """The OpenGL driver of EEVEE and Workbench, if known; or the reason why they cannot draw."""

    driver: str | None = None
    problem: str | None = None


@dataclass(frozen=True)
class Blender:
    """The Blender of one Python interpreter: version, devices and graphics, or the problem that keeps it from working."""

    python: Path
    version: str | None = None
    devices: tuple[Device, ...] = ()
    problem: str | None = None
    missing: tuple[Library, ...] = ()
    graphics: _Graphics | None = None

    @property
    def cure(self) -> str | None:
        """The command that installs the missing libraries on Debian and Ubuntu; None if unknown."""
        packages = sorted({library.package for library in self.missing if library.package})
        return f"apt-get install {' '.join(packages)}" if packages else None


def find_blender(python: str | None = None) -> Path:
    """The Python interpreter whose Blender (the module bpy) is used.

    The first of: `python` (a file, an environment's folder or a name on the PATH), $VIEWSPHERE_BLENDER_PYTHON, this
    interpreter if it has bpy, the environment that `viewsphere doctor --setup-blender` makes. Whether its Blender
    works is not tried. Raises UserError for a named interpreter that is missing, MissingExtraError when none is found.
    """
    for given, place in ((python, "engine.python"), (os.environ.get(VARIABLE), f"${VARIABLE}")):
        if given:
            return _program(given, place)
    if importlib.util.find_spec("bpy"):
        return Path(sys.executable)
    own = environment.interpreter_of(environment.home())
    if own.is_file():
        return own
    raise MissingExtraError(f"Blender: expected a Python that has bpy, found none: {INSTALL}")


def probe(python: Path) -> Blender:
    """Start this interpreter's Blender, read its version and devices, and try to draw; takes two minutes at most."""
    with temporary("probe") as folder:
        try:
            with BlenderProcess(python, folder / "log") as process:
                told = process.ask("hello", PROBE_S)
                graphics = _graphics(process)
        except (BlenderError, BlenderDied) as error:
            return _broken(python, str(error))
    devices = tuple(Device(**device) for device in told["devices"])
    return Blender(python, told["version"], devices, graphics=graphics)


def _graphics(process: BlenderProcess) -> _Graphics:
    """Return whether OpenGL drawing works, tried with Workbench: EEVEE draws the same way, but compiles its shaders first."""
    try:
        return _Graphics(process.ask("draw", DRAW_S, renderer="workbench")["driver"])
    except (BlenderError, BlenderDied) as error:
        return _Graphics(problem=f"{error.how}: {GRAPHICS}")


def missing_libraries(said: str) -> tuple[Library, ...]:
    """The missing libraries in the output of `ldd` or in the error of an import."""
    patterns = r"^\s*(\S+) => not found", r"(\S+\.so[\d.]*): cannot open shared object file"
    names = {name for pattern in patterns for name in re.findall(pattern, said, re.MULTILINE)}
    return tuple(Library(name, PACKAGES.get(name)) for name in sorted(names))


def _program(given: str, place: str) -> Path:
    """The interpreter that a user names."""
    path = written_path(given)
    if path.is_dir():
        path = environment.interpreter_of(path)
    found = path.absolute() if path.is_file() else shutil.which(given)
    if found is None:
        raise UserError(f"{place}: expected a Python that has bpy, found no {given}: {INSTALL}")
    if Path(found).stem.lower() == "blender":
        raise UserError(f"{place}: expected a Python that has bpy, found Blender's own program {found}: {INSTALL}")
    return Path(found)


def _broken(python: Path, error: str) -> Blender:
    """A Blender that did not start, with the reason: no bpy, missing system libraries, or another error."""
    if "No module named 'bpy'" in error:
        return Blender(python, problem=f"it has no bpy: {INSTALL}")
    missing = missing_libraries(error + "\n" + _ldd(_module(python)))
    if missing:
        return Blender(python, problem=f"the system lacks {', '.join(m.name for m in missing)}", missing=missing)
    return Blender(python, problem=error)


def _module(python: Path) -> str | None:
    """Path of the interpreter's bpy, found without importing bpy."""
    code = "import importlib.util as u; s = u.find_spec('bpy'); print(s.origin if s else '')"
    with suppress(OSError, subprocess.SubprocessError):
        run = subprocess.run([python, "-P", "-c", code], capture_output=True, text=True, timeout=ASK_S)
        return run.stdout.strip() or None
    return None


def _ldd(module: str | None) -> str:
    """Return the output of Linux's `ldd` about a shared object's libraries."""
    ldd = shutil.which("ldd")
    if module is None or ldd is None or not sys.platform.startswith("linux"):
        return ""
    with suppress(OSError, subprocess.SubprocessError):
        run = subprocess.run([ldd, module], capture_output=True, text=True, errors="replace", timeout=ASK_S)
        return run.stdout
    return ""
