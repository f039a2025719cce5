"""Compares the labels of another revision with this one's, value by value, as read by `viewsphere.open`.

    benchmarks/labels REVISION [--but FIELD ...] [--share 0.001]    # status 1 where anything else differs

Both revisions render the five paper recipes (two models and a part of the poses each), a street with company and, where Blender
is set up, an animated file, with all channels. For each field that differs, a line gives the number of differing values (of
channels: pixels) and the largest difference.
"""

from __future__ import annotations

import argparse
import base64
import dataclasses
import json
import os
import pickle
import shutil
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from itertools import chain, zip_longest
from pathlib import Path
from typing import Any

import numpy as np

import viewsphere as vs
from viewsphere.blender.interpreter import find_blender
from viewsphere.errors import UserError

ROOT = Path(__file__).resolve().parents[1]

CHANNELS = (
    "rgb",
    "depth",
    "instances",
    "categories",
    "parts",
    "normals",
    "normals_geometric",
    "coordinates",
    "triangles",
    "barycentrics",
)

PAPER = {
    "models[0].count": 2,
    "viewpoints.azimuth": {"start": 0, "stop": 360, "step": 45},
    "viewpoints.elevation": {"start": 0, "stop": 90, "step": 30},
    "channels": CHANNELS,
    "formats": [],
}

STREET = {
    "models": [{"source": "zoo:car", "count": 4}],
    "scene": {"place": "zoo:neighbourhood", "company": {"count": 2, "layout": "random"}},
    "viewpoints": {"kind": "sphere", "count": 6, "elevation": [5, 60], "distance": 14},
    "camera": {"size": [320, 240], "fov_deg": 50},
    "channels": CHANNELS,
    "splits": {"train": 1},
}

ANIMATED = {
    "models": [{"source": "slider.gltf", "category": "slider", "frames": "all"}, {"source": "zoo:chair", "count": 1}],
    "viewpoints": {"azimuth": {"start": 0, "stop": 360, "step": 90}, "elevation": [20], "distance": [4]},
    "camera": {"size": [160, 120], "fov_deg": 40},
    "channels": CHANNELS,
    "splits": {"train": 1},
}


def slider(folder: Path) -> None:
    """Write a glTF of two boxes, of which one slides along x and grows over three frames at 24 a second."""
    corners = np.array([(x, y, z) for x in (-0.2, 0.2) for y in (0.0, 0.5) for z in (-0.4, 0.4)], np.float32)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))], np.uint16)
    times = np.array([0, 1, 2], np.float32) / np.float32(24)
    places = np.array([(0.5, 0, 0), (0.7, 0.1, 0), (0.9, 0.3, 0)], np.float32)
    scales = np.array([(1, 1, 1), (1, 1.3, 1), (1, 1.7, 1)], np.float32)
    parts = [corners, triangles, times, places, scales]
    data, views = b"", []
    for part in parts:
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": part.nbytes})
        data += part.tobytes() + bytes(-part.nbytes % 4)
    kinds = ((5126, "VEC3"), (5123, "SCALAR"), (5126, "SCALAR"), (5126, "VEC3"), (5126, "VEC3"))
    accessors: list[dict[str, Any]] = [
        {"bufferView": i, "componentType": number, "type": kind, "count": part.size if kind == "SCALAR" else len(part)}
        for i, (part, (number, kind)) in enumerate(zip(parts, kinds, strict=True))
    ]
    for i in (0, 2):
        low, high = parts[i].min(axis=0, keepdims=i == 2), parts[i].max(axis=0, keepdims=i == 2)
        accessors[i] |= {"min": low.tolist(), "max": high.tolist()}
    moves = [{"sampler": i, "target": {"node": 1, "path": path}} for i, path in enumerate(("translation", "scale"))]
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"name": "post", "mesh": 0}, {"name": "slide", "mesh": 0, "translation": [0.5, 0, 0]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "animations": [{"channels": moves, "samplers": [{"input": 2, "output": 3}, {"input": 2, "output": 4}]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [
            {"byteLength": len(data), "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}
        ],
    }
    (folder / "slider.gltf").write_text(json.dumps(tree))


def has_blender() -> bool:
    try:
        find_blender(None)
    except UserError:
        return False
    return True


def recipes(folder: Path) -> Iterator[tuple[str, Path, dict[str, Any]]]:
    """Name, file and changes of each recipe that is compared."""
    for path in sorted((ROOT / "recipes").glob("*_poses.yaml")):
        yield path.stem, path, PAPER
    slider(folder)
    for name, recipe in (("street", STREET), ("animated", ANIMATED)):
        path = folder / f"{name}.json"  # JSON is YAML, too
        path.write_text(json.dumps(recipe))
        yield name, path, {}


def environment(out: Path) -> dict[str, str]:
    """Environment variables for a revision's process: each revision has its own cache."""
    return {**os.environ, "VIEWSPHERE_CACHE": str(out.parent / f"cache-{out.name.partition('-')[0]}")}


def render(python: Path, source: Path, changes: dict[str, Any], out: Path) -> None:
    """Have this Python's viewsphere render a recipe."""
    sets = [word for name, value in changes.items() for word in ("--set", f"{name}={json.dumps(value)}")]
    command = [python, "-m", "viewsphere", "render", source, "-o", out, *sets]
    subprocess.run(command, check=True, env=environment(out), stdout=subprocess.DEVNULL)


@contextmanager
def read(python: Path, out: Path) -> Iterator[Iterator[dict[str, Any]]]:
    """Iterates the result of `values`, run by this Python's viewsphere, while the context lasts."""
    with subprocess.Popen([python, __file__, "--read", out], env=environment(out), stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        yield iter(partial(pickle.load, process.stdout), None)


def values(out: Path) -> Iterator[dict[str, Any]]:
    """For each sample of a data set all its values by name: plain ones and arrays."""
    for sample in vs.open(out):
        camera, pose = sample.camera, sample.pose.model_dump(mode="json")
        said: dict[str, Any] = {
            "split": sample.split,
            "camera.intrinsics": camera.intrinsics.model_dump(mode="json"),
            "camera.R": camera.R,
            "camera.t": camera.t,
            **{f"pose.{name}": value for name, value in pose.items()},
            **{f"channel {name}": array for name, array in sample.channels.items()},
            "object ids": [o.id for o in sample.objects],
        }
        for o in sample.objects:
            for field in dataclasses.fields(o):
                if field.name not in ("id", "source", "extra"):
                    said[f"object {o.id} {field.name}"] = plain(getattr(o, field.name))
        yield said


def plain(value: Any) -> Any:
    """The value as plain data, without classes: these differ between revisions."""
    return dataclasses.asdict(value) if dataclasses.is_dataclass(value) else value  # type: ignore[arg-type]


@dataclasses.dataclass
class Tally:
    """The number of a field's values, the number that differ, and the largest difference of those that are finite numbers."""

    count: int = 0
    differing: int = 0
    largest: float = 0.0

    def add(self, old: Any, new: Any) -> None:
        """Count one value, or all pixels of a picture."""
        if not (isinstance(old, np.ndarray) and isinstance(new, np.ndarray) and old.shape == new.shape):
            self.count += 1
            self.differing += type(old) is not type(new) or old != new
            return
        unlike = ~np.isclose(old, new, rtol=0, atol=0, equal_nan=True)
        pixels = unlike.reshape(*old.shape[:2], -1).any(axis=-1) if old.ndim >= 2 else unlike
        self.count += pixels.size
        self.differing += int(pixels.sum()) if old.dtype == new.dtype else pixels.size
        if unlike.any():
            apart = np.abs(old[unlike].astype(np.float64) - new[unlike].astype(np.float64))
            self.largest = max(self.largest, float(apart[np.isfinite(apart)].max(initial=0.0)))


def field_of(name: str) -> str:
    """The field that a value is counted for: `object box2d` for `object 3 box2d`."""
    words = name.split(" ", 2)
    return f"object {words[2]}" if words[0] == "object" and len(words) == 3 else name


def tallies(old: Iterator[dict[str, Any]], new: Iterator[dict[str, Any]]) -> dict[str, Tally]:
    """The tally of every field over all samples."""
    found: defaultdict[str, Tally] = defaultdict(Tally)
    for before, after in zip_longest(old, new, fillvalue={}):
        for name in before.keys() | after.keys():
            found[field_of(name)].add(before.get(name), after.get(name))
    return dict(sorted(found.items()))


def compare(folder: Path, old: Path, share: float) -> set[str]:
    """The fields that differ in any recipe, channels in more than this share of their pixels; every difference is printed."""
    found: set[str] = set()
    for name, path, changes in recipes(folder):
        if name == "animated" and not has_blender():
            print("animated: left out, since there is no Blender", flush=True)
            continue
        outs = folder / f"old-{name}", folder / f"new-{name}"
        new = Path(sys.executable)
        render(old, path, changes, outs[0])
        render(new, path, changes, outs[1])
        with read(old, outs[0]) as before, read(new, outs[1]) as after:
            counted = tallies(before, after)
        for out in outs:
            shutil.rmtree(out)
        samples, every = counted["split"].count, sum(tally.count for tally in counted.values())
        print(f"{name}: {samples:,} samples, {every:,} values and pixels", flush=True)
        for field, tally in counted.items():
            if tally.differing:
                largest = f", by {tally.largest:.2g} at most" if tally.largest else ""
                print(f"  {field}: {tally.differing:,} of {tally.count:,} differ{largest}", flush=True)
            if tally.differing > (share * tally.count if field.startswith("channel ") else 0):
                found.add(field)
    return found


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("revision", nargs="?", help="what git calls it")
    options.add_argument("--but", nargs="+", default=[], metavar="FIELD", help="fields that may differ")
    options.add_argument("--share", type=float, default=0.0, help="share of a channel's pixels that may differ")
    options.add_argument("--read", type=Path, metavar="OUT", help=argparse.SUPPRESS)
    args = options.parse_args()
    if args.read:
        for said in chain(values(args.read), (None,)):
            pickle.dump(said, sys.stdout.buffer)
        return
    if not args.revision:
        options.error("expected a revision")
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        tree = folder / "old"
        subprocess.run(["git", "worktree", "add", "--quiet", "--detach", tree, args.revision], cwd=ROOT, check=True)
        try:
            subprocess.run([tree / "scripts" / "setup"], check=True)
            unlike = compare(folder, tree / ".venv" / "bin" / "python", args.share) - set(args.but)
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", tree], cwd=ROOT, check=True)
    if unlike:
        raise SystemExit(f"these differ: {', '.join(sorted(unlike))}")


if __name__ == "__main__":
    main()
