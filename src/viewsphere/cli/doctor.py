"""The command `doctor`, which reports the features that work on this machine."""

from __future__ import annotations

import os
import platform
import re
import sys
from collections import ChainMap
from collections.abc import Iterator, Mapping
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from viewsphere.cli.arguments import AsJson
from viewsphere.cli.terminal import print_json, say
from viewsphere.errors import UserError
from viewsphere.plugins import gap
from viewsphere.run.workers.worker_count import cores

if TYPE_CHECKING:
    from viewsphere.plugins.source import Download

LEFT = 12
"""Width of the column of names, in characters."""


def doctor(
    setup_blender: Annotated[
        bool,
        typer.Option(
            "--setup-blender", help="First create a Python environment with Blender in your data folder (about 1 GB)."
        ),
    ] = False,
    setup: Annotated[
        list[str] | None,
        typer.Option(
            "--setup",
            metavar="NAME",
            help="First download the optional data that this report lists under this name.",
        ),
    ] = None,
    json_: AsJson = False,
) -> None:
    """Report features that work on this machine: processor, kernels, optional packages, Blender.
    Missing features are not errors.
    """
    if setup_blender:
        _set_up_blender()
    downloads: Mapping[str, Download] = _downloads() if setup else {}
    for name in setup or ():
        if name not in downloads:
            from viewsphere.validation.errors import one_of

            raise UserError(f"--setup: {one_of(name, tuple(downloads))}{'; ' if gap() else ''}{gap()}")
        downloads[name].fetch(lambda line: say(line, err=True))
    facts = _examine()
    if json_:
        print_json(facts)
        return
    for name, value in _lines(facts):
        say(f"{name:{LEFT}} {value}")


def _examine() -> dict[str, Any]:
    """The findings about this machine, as plain data."""
    return {
        "viewsphere": version("viewsphere"),
        "python": {"version": platform.python_version(), "executable": sys.executable},
        "system": platform.platform(),
        "processor": _processor(),
        "kernels": _kernels(),
        "speed": _speed(),
        "extras": [_extra(name, packages) for name, packages in sorted(_extras().items())],
        "plug-ins": {"problem": gap() or None},
        "blender": _blender(),
        "downloads": {name: download.file() for name, download in _downloads().items()},
    }


def _downloads() -> Mapping[str, Download]:
    from viewsphere.plugins.source import sources

    return dict(ChainMap(*(dict(spec.downloads) for spec in sources().values())))  # the first of a name counts


def _set_up_blender() -> None:
    """Make the Python environment with Blender, unless a working Blender exists."""
    from viewsphere.blender.environment import home, interpreter_of, make_environment
    from viewsphere.blender.interpreter import probe

    interpreter = interpreter_of(home())
    if interpreter.is_file() and probe(interpreter).problem is None:
        say(f"{home()} has a Blender that works", err=True)
        return
    make_environment(lambda line: say(line, err=True))


def _processor() -> dict[str, Any]:
    import llvmlite.binding

    return {"name": llvmlite.binding.get_host_cpu_name(), "cores": cores()}


def _kernels() -> dict[str, Any]:
    """The folder of compiled kernels, whether it is writable, whether there are any and from where, and what they are for."""
    from viewsphere.kernels.build import LLVMLITE, NUMBA, TARGET
    from viewsphere.kernels.entries import SUFFIX, kernel_folder
    from viewsphere.run.shots.precompile import has_all

    folder = kernel_folder()
    there = next(place for place in (folder, *folder.parents) if place.exists())
    return {
        "folder": str(folder),
        "writable": there.is_dir() and os.access(there, os.W_OK),
        "compiled": has_all() or any(folder.glob(f"*/*{SUFFIX}")),
        "complete": has_all(),
        "target": TARGET.cpu,
        "note": TARGET.note or None,
        "numba": NUMBA,
        "llvmlite": LLVMLITE,
    }


def _speed() -> dict[str, Any] | None:
    """CPU milliseconds of a frame, beside the machine of docs/performance.md; None if kernels are not compiled yet, or if
    the model is lacking.
    """
    from viewsphere.run.estimate import REFERENCE_MS, measure_speed

    speed = None if gap() else measure_speed()
    return speed and {"frame_ms": speed.frame_ms, "relative": speed.relative, "reference_ms": REFERENCE_MS}


def _extras() -> dict[str, list[str]]:
    """Packages of each extra of this installation, except Blender's, which may lie in another interpreter."""
    extras: dict[str, list[str]] = {}
    for requirement in requires("viewsphere") or ():
        extra = re.search(r"""extra == ['"]([\w-]+)['"]""", requirement)
        package = re.match(r"[\w.-]+", requirement)
        if extra and package and extra[1] != "blender":
            extras.setdefault(extra[1], []).append(package[0])
    return extras


def _extra(name: str, packages: list[str]) -> dict[str, Any]:
    versions = {package: _version(package) for package in packages}
    missing = None in versions.values()
    return {"name": name, "packages": versions, "install": f"pip install 'viewsphere[{name}]'" if missing else None}


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _blender() -> dict[str, Any]:
    """The interpreter that has Blender, and that Blender's version, devices and graphics; `problem` is None if all works."""
    from viewsphere.blender.interpreter import find_blender, probe

    try:
        python: Path = find_blender()
    except UserError as error:
        nothing = {"python": None, "version": None, "devices": [], "graphics": None}
        return {**nothing, "problem": str(error), "missing": [], "install": None}
    blender = probe(python)
    return {
        "python": str(python),
        "version": blender.version,
        "devices": [{"kind": device.kind, "name": device.name} for device in blender.devices],
        "graphics": blender.graphics and {"driver": blender.graphics.driver, "problem": blender.graphics.problem},
        "problem": blender.problem,
        "missing": [{"library": library.name, "package": library.package} for library in blender.missing],
        "install": blender.cure,
    }


def _lines(found: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """The findings in words: pairs of a name and a text."""
    python, processor, kernels, blender = (found[name] for name in ("python", "processor", "kernels", "blender"))
    yield "viewsphere", found["viewsphere"]
    yield "Python", f"{python['version']}, {python['executable']}"
    yield "system", found["system"]
    yield "processor", f"{processor['name']}, {processor['cores']} {'core' if processor['cores'] == 1 else 'cores'}"
    if found["plug-ins"]["problem"]:
        yield "plug-ins", found["plug-ins"]["problem"]
    yield from _kernel_lines(kernels, found["speed"])
    for extra in found["extras"]:
        packages = ", ".join(f"{name} {is_ or 'missing'}" for name, is_ in extra["packages"].items())
        yield f"[{extra['name']}]", packages + (f": {extra['install']}" if extra["install"] else "")
    for name, download in _downloads().items():
        yield name, found["downloads"][name] or download.without
    yield "Blender", _blender_line(blender)
    for device in blender["devices"]:
        yield "", f"{device['kind']}: {device['name']}"
    if blender["graphics"]:
        yield "", f"EEVEE, Workbench: {_graphics_line(blender['graphics'])}"
    if blender["install"]:
        yield "", f"on Debian and Ubuntu: {blender['install']}"


def _kernel_lines(kernels: dict[str, Any], speed: dict[str, Any] | None) -> Iterator[tuple[str, str]]:
    """The kernels in use, and the time of a frame on this machine."""
    few = "compiled" if kernels["compiled"] else "not compiled yet: the first picture takes about 20 seconds longer"
    compiled = "all there, nothing is compiled" if kernels["complete"] else few
    unwritable = "" if kernels["writable"] else "cannot be written: set VIEWSPHERE_CACHE; "
    yield "kernels", f"{kernels['folder']}: {unwritable}{compiled}"
    yield "", f"for {kernels['target']}, by numba {kernels['numba']} and llvmlite {kernels['llvmlite']}"
    if kernels["note"]:
        yield "", kernels["note"]
    if speed is None:
        reason = "it needs a model that comes with viewsphere" if gap() else "run a preview first, which compiles kernels"
        yield "speed", f"not measured: {reason}"
        return
    yield "speed", f"{speed['frame_ms']:.0f} ms of one core for a frame of a car with labels, 640 x 480;"
    yield "", f"{speed['relative']:.2f} times as fast as the machine of docs/performance.md ({speed['reference_ms']:.0f} ms)"


def _blender_line(blender: dict[str, Any]) -> str:
    if blender["python"] is None:
        return blender["problem"].removeprefix("Blender: ")
    state = f"{blender['version'] or 'does not work'}, {blender['python']}"
    return f"{state}: {blender['problem']}" if blender["problem"] else state


def _graphics_line(graphics: dict[str, Any]) -> str:
    if graphics["problem"]:
        return f"cannot draw here, {graphics['problem']}"
    return f"drawn by {graphics['driver'] or 'a driver that does not tell its name'}"
