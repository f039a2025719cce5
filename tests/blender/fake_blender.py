"""Interpreters that have something else in Blender's place."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path

NOISY = """\
import os
from types import SimpleNamespace as Some
os.write(1, b'{"ok": "noise of a library"}\\n')
print('{"ok": "noise of Python"}', flush=True)
class Thing:
    def __getattr__(self, name): return Thing()
    def __call__(self, *given, **named): return Thing()
app = Some(version_string="9.8.7", version=(9, 8, 7))
context = Some(preferences=Some(filepaths=Some(), system=Some()), scene=Thing())
data = ops = Thing()
"""
DYING = NOISY + "ops = Some(wm=Thing(), render=Some(render=os.abort))"
GRAPHICS = "from types import SimpleNamespace as Some; platform = Some(renderer_get=lambda: 'A driver')"
DEVICES = """\
def available_devices(kind):
    if kind == "METAL":
        raise ValueError(kind)
    return [("A processor", "CPU"), *([("A card", "CUDA")] if kind == "CUDA" else [])]
"""
ENDLESS = "import time; time.sleep(100)"
LACKING = "raise ImportError('libXi.so.6: cannot open shared object file: No such file or directory')"
ABORTING = "import os; os.abort()"


def interpreter(folder: Path, line: str) -> Path:
    """A program in the shape of an interpreter: this one (`$python`) run by a line of shell."""
    file = folder / "python"
    file.write_text(f"#!/bin/sh\npython={shlex.quote(sys.executable)}\n{line}\n")
    file.chmod(0o755)
    return file


def with_modules(folder: Path, modules: dict[str, str]) -> Path:
    """An interpreter that has these modules and numpy, after it has said something."""
    place = folder / "modules"
    place.mkdir()
    for name, source in modules.items():
        (place / f"{name}.py").write_text(source)
    return interpreter(
        folder, f'trap "" PIPE\necho noise of a wrapper\nPYTHONPATH={shlex.quote(str(place))} exec "$python" "$@"'
    )


def fake_blender(folder: Path) -> Path:
    """An interpreter with what `hello` and `draw` need; its `stage` and `render` never end."""
    return with_modules(folder, {"bpy": NOISY, "_cycles": DEVICES, "gpu": GRAPHICS, "mathutils": ENDLESS})


def blind_blender(folder: Path) -> Path:
    """The same, but it dies when it is to draw."""
    return with_modules(folder, {"bpy": DYING, "_cycles": DEVICES})


def without_blender(folder: Path) -> Path:
    """An interpreter without any package."""
    return interpreter(folder, 'exec "$python" -I -S "$@"')
