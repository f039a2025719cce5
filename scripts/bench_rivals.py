"""Frames a CPU second of other renderers beside ours: the reference car (bench_scene.py) at 640 x 480, seen from all around.

    scripts/bench --rivals [--frames 16] [--only vtk mitsuba]

Each rival is installed by pip in a virtual environment of its own, `.venv/rivals/NAME`, and draws in a process of its own
(bench_rivals_here.py, bench_blenderproc.py); one that cannot be installed, or does not draw here, is reported as such. Figures
are medians of CPU time over all threads, and none includes reading the model. What each gives
differs: see the table's column. VTK, pyrender and Open3D draw the
car alone; Mitsuba has the ground, and one texture.
"""

from __future__ import annotations

import json
import subprocess
import sys
import venv
from collections.abc import Container
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from bench_cycles import recipe_of, told
from PIL import Image

from viewsphere import plan
from viewsphere.assets.export import export_glb
from viewsphere.blender.interpreter import find_blender
from viewsphere.errors import UserError
from viewsphere.geometry.rotation import transform
from viewsphere.model.shot import Shot
from viewsphere.run.stages import Stages

HERE = Path(__file__).parent
FOLDER = HERE.parent / ".venv" / "rivals"
CYCLES_SAMPLES = 4
MINUTES = 20
"""After which an installation, or all frames of a rival, count as failed."""


@dataclass(frozen=True)
class Rival:
    """A renderer that pip installs: its name for the table and for `bench_rivals_here.py`, packages, and what it gives.

    newer: packages that are installed after it, against its own pins, which no longer work.
    """

    title: str
    name: str
    packages: tuple[str, ...]
    gives: str
    newer: tuple[str, ...] = ()


RIVALS = (
    Rival("Open3D, rays", "open3d", ("open3d",), "triangle ids, depth, normals; no colour, no files"),
    Rival("VTK, physically based", "vtk", ("vtk",), "colour without shadows or anti-aliasing; no labels, no files"),
    Rival(
        "Mitsuba, 1 sample",
        "mitsuba",
        ("mitsuba==3.5.2", "numpy<2"),
        "path-traced colour, noisy, of one texture; no labels, no files",
    ),
    Rival(
        "pyrender", "pyrender", ("pyrender", "trimesh", "numpy<2"), "colour without shadows, depth; no other labels, no files"
    ),
)
CYCLES = f"Cycles, {CYCLES_SAMPLES} samples, as BlenderProc sets it"


class Failed(Exception):
    """A rival has no figure here; says why."""


def ran(command: list[Any]) -> str:
    """What a command prints; raises Failed with the last line of its errors."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=60 * MINUTES)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise Failed(str(error)) from error
    if done.returncode:
        lines = (done.stderr.strip() or done.stdout.strip() or f"status {done.returncode}").splitlines()
        raise Failed(lines[-1][:200])
    return done.stdout


def installed(rival: Rival) -> Path:
    """The Python of a rival's environment, which is made where it is missing."""
    folder = FOLDER / rival.name
    python = folder / ("Scripts" if sys.platform == "win32" else "bin") / "python"
    if not (folder / "ready").exists():
        print(f"installing {' '.join(rival.packages)} in {folder} ...", flush=True)
        venv.create(folder, with_pip=True, clear=True)
        for packages in filter(None, (rival.packages, rival.newer)):
            ran([python, "-m", "pip", "install", "--quiet", *packages])
        (folder / "ready").touch()
    return python


def write_for_rivals(folder: Path, frames: int) -> None:
    """The scene's files: the model, its triangles in the world, the texture of its colours, cameras and sun."""
    stages = Stages()
    shot: Shot = next(iter(plan(recipe_of(folder, {"name": "raster"}, True, frames), shot_frames=frames).shots(stages.box)))
    mesh, pose = stages.model(shot.things[0].model), np.array(shot.things[0].world_from_object)
    export_glb(mesh, folder / "model.glb")
    normals = (mesh.normals @ pose[:3, :3].T).astype(np.float32)
    uv = np.zeros((len(mesh.vertices), 2), np.float32) if mesh.uv0 is None else mesh.uv0
    vertices = transform(pose, mesh.vertices).astype(np.float32)
    np.savez(folder / "mesh.npz", vertices=vertices, normals=normals, uv=uv, triangles=mesh.triangles)
    Image.fromarray(np.asarray(mesh.images[0].pixels)[..., :3]).save(folder / "color.png")
    told_of_scene = {**told(shot, stages, folder, 0), "samples": CYCLES_SAMPLES}
    (folder / "told.json").write_text(json.dumps(told_of_scene))


def drawn(rival: Rival, folder: Path) -> list[float]:
    """CPU seconds of each of a rival's frames; raises Failed."""
    python = installed(rival)
    return json.loads(ran([python, HERE / "bench_rivals_here.py", rival.name, folder]).splitlines()[-1])


def by_cycles(folder: Path) -> list[float]:
    """CPU seconds of each frame by the Blender that `viewsphere doctor --setup-blender` installs; raises Failed."""
    try:
        python = find_blender()
    except UserError as error:
        raise Failed(str(error)) from error
    ran([python, HERE / "bench_blenderproc.py", folder])
    return np.diff(json.loads((folder / "cpu.json").read_text())).tolist()[1:]


def row(title: str, times: list[float] | Failed, gives: str) -> str:
    """A line of the table."""
    if isinstance(times, Failed):
        return f"| {title} | - | not measured here: {times} |"
    rate = 1 / float(np.median(times))
    return f"| {title} | {f'{rate:.0f}' if rate >= 10 else f'{rate:.2g}'} | {gives} |"


def rivals(folder: Path, frames: int, ours: dict[str, float], only: Container[str] = ()) -> None:
    """Print the table; `ours`: milliseconds of whole frames of ours by the names of their rows."""
    write_for_rivals(folder, frames)
    print("| renderer | frames a CPU second | what a frame gives |\n|---|---:|---|")
    for title, took in ours.items():
        print(row(title, [took / 1e3], "colour with soft shadows, exact ids, depth, normals, boxes, masks; as files"))
    measured = [(rival.title, rival.name, lambda rival=rival: drawn(rival, folder), rival.gives) for rival in RIVALS]
    for title, name, work, gives in (
        *measured,
        (CYCLES, "cycles", lambda: by_cycles(folder), "denoised colour, object ids; as files"),
    ):
        if only and name not in only:
            continue
        try:
            print(row(title, work(), gives), flush=True)
        except Failed as error:
            print(row(title, error, gives), flush=True)
