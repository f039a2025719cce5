"""Writes the table of kernels that viewsphere calls, src/viewsphere/kernels/overloads.json.

    scripts/kernels [--add]

A process for each recipe and each variant of a plain one notes the kernels that a tiny frame calls, and one for each recipe
those of a few small frames with models, exports and checks. A kernel's needs are the features that all frames share that call
it, as few as tell them from the others. Then all are compiled, which gives their seconds. Takes half an hour of a core; with
`--add`, which tries the variants alone and keeps the table's other rows, a few minutes.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

from viewsphere import plugins
from viewsphere.kernels import overloads
from viewsphere.kernels.overloads import Overload
from viewsphere.plugins.effect import EffectSpec

ROOT = Path(__file__).resolve().parents[1]
PLAIN: dict[str, Any] = {
    "models": [{"source": "zoo:car"}],
    "viewpoints": {"azimuth": [0, 90], "elevation": [20], "distance": 4},
    "camera": {"size": [64, 48]},
}
VARIANTS: Mapping[str, dict[str, Any]] = {
    "plain": {},
    "still edges": {"engine": {"name": "raster", "antialias": 1}},
    "smooth edges": {"engine": {"name": "raster", "antialias": 4}},
    "all channels": {"channels": ["rgb", "depth", "normals", "semantic", "coordinates"]},
    "two models": {"models": [{"source": "zoo:car", "count": 2}]},
    "distortion": {
        "camera": {
            "fov_deg": 50,
            "size": [64, 48],
            "distortion": {"model": "brown_conrady", "coefficients": [-0.1, 0.02, 0, 0]},
        }
    },
    "fisheye": {
        "camera": {"fov_deg": 90, "size": [64, 48], "distortion": {"model": "fisheye", "coefficients": [0.01, 0.0, 0, 0]}}
    },
    "background": {"scene": {"background": {"color": "#808080"}, "ground": "off"}},
    "transparent": {"scene": {"background": {"transparent": True}}},
    "orthographic": {"camera": {"projection": "orthographic", "width_m": 4, "size": [64, 48]}},
    "rolling shutter": {
        "models": [{"source": "zoo:car", "motion": {"kind": "constant", "velocity": [1, 0, 0]}}],
        "viewpoints": {"kind": "orbit", "azimuth": [0, 40], "elevation": 20, "distance": 4},
        "time": {"frames": 2, "fps": 10},
        "camera": {"size": [64, 48], "rolling": {"readout": 0.05}},
        "scene": {"ground": True},
        "channels": ["rgb", "depth", "instances", "normals", "position", "flow", "flow_state", "tracks"],
        "tracks": {"count": 16, "at": [0]},
        "annotations": ["keypoints", "amodal"],
        "splits": {"by": "sequence"},
    },
}


def effects() -> Iterator[dict[str, Any]]:
    """Recipes with effects: those that one function computes are in one recipe."""
    specs = [plugins.load(EffectSpec, name) for name in plugins.shipped("effects")]
    for options in dict.fromkeys(spec.options for spec in specs):
        yield {"scene": {"effects": {spec.name: 0.2 for spec in specs if spec.options is options}}}


def used() -> set[str]:
    """The overloads that this process has called, by name."""
    from numba.extending import is_jitted

    found: dict[str, float] = {}
    for module in [each for each in list(sys.modules.values()) if isinstance(each, ModuleType)]:
        for name, value in list(vars(module).items()):
            if (
                is_jitted(value)
                and getattr(getattr(value, "_cache", None), "names", ())
                and value.__module__ == module.__name__
            ):
                for types in value.overloads:
                    try:
                        plain = json.dumps([overloads.encoded(each) for each in types])
                    except TypeError:
                        continue
                    found[Overload(module.__name__, name, plain).name] = 0.0
    return found


def tiny(recipe: Any) -> dict[str, Any]:
    """The features of a recipe's first shot, and the kernels that a tiny frame of it calls."""
    from viewsphere import plan
    from viewsphere.geometry.box3d import Box3d
    from viewsphere.run.shots import precompile as warm

    shot = next(iter(plan(recipe).shots(lambda *_: Box3d.between((-0.5,) * 3, (0.5,) * 3).corners)))
    warm.load_kernels(shot)
    return {"features": sorted(warm.features(shot)), "used": sorted(used())}


def small(recipe: Any) -> dict[str, Any]:
    """The kernels that a few small frames call, with models, exports and checks."""
    from viewsphere.run.estimate import measure

    measure(recipe)
    return {"features": None, "used": sorted(used())}


def run(task: tuple[str, str]) -> dict[str, Any] | None:
    """The findings of a process of its own."""
    command = [sys.executable, __file__, "--run", *task]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    if done.returncode:
        print(f"{task[0]} {task[1][:60]}: {done.stderr.strip().splitlines()[-1:]}", file=sys.stderr)
        return None
    return json.loads(done.stdout.splitlines()[-1])


def needs(name: str, runs: Iterable[Mapping[str, Any]]) -> tuple[str, ...] | None:
    """The features that separate the shots that call a kernel from the others: none, one, or all that its callers share."""
    shots = [(frozenset(each["features"]), name in each["used"]) for each in runs if each["features"] is not None]
    calling = [features for features, calls in shots if calls]
    if not calling:
        return None
    shared = frozenset.intersection(*calling)
    others = [features for features, calls in shots if not calls]
    for few in [(), *((each,) for each in sorted(shared, key=lambda each: (len(each), each)))]:
        if not any(features.issuperset(few) for features in others):
            return few
    return tuple(sorted(shared.difference(frozenset.intersection(*(features for features, _ in shots)))))


def timed(made: Iterable[Overload]) -> list[Overload]:
    """The overloads with the CPU seconds of their compilation, less those that cannot be compiled any more."""
    import viewsphere.run.shots.precompile  # noqa: F401, which imports what kernels need

    rows = list[Overload]()
    with tempfile.TemporaryDirectory() as folder:
        os.environ["VIEWSPHERE_CACHE"] = folder
        for each in made:
            begun = time.process_time()
            try:
                each.compile()
            except Exception as error:  # as numba has many
                print(f"left out: {each.module}.{each.kernel}: {type(error).__name__}", file=sys.stderr)
            else:
                rows.append(replace(each, seconds=round(time.process_time() - begun, 1)))
    return rows


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--run", nargs=2, help=argparse.SUPPRESS)
    options.add_argument("--add", action="store_true", help="try no recipes, and keep what the table has")
    options.add_argument("--jobs", type=int, default=os.cpu_count())
    args = options.parse_args()
    if args.run:
        from viewsphere import Recipe

        kind, text = args.run
        recipe = Recipe.ensure(text) if text.endswith(".yaml") else Recipe.model_validate({**PLAIN, **json.loads(text)})
        with recipe.located():
            print(json.dumps({"tiny": tiny, "small": small}[kind](recipe)))
        return
    recipes = [] if args.add else [str(file) for file in sorted((ROOT / "recipes").rglob("*.yaml"))]
    texts = [*map(json.dumps, (*VARIANTS.values(), *effects())), *recipes]
    with ThreadPoolExecutor(args.jobs) as pool:
        runs = [each for each in pool.map(run, [(kind, text) for kind in ("tiny", "small") for text in texts]) if each]
    kept = {each.name: each for each in overloads.table()} if args.add else {}
    names = sorted({name for each in runs for name in each["used"]})
    found = {name: Overload(*name.split(":", 2), needs(name, runs)) for name in names}
    made = timed((found | kept).values())
    overloads.write(made)
    seconds, of_frames = sum(each.seconds for each in made), sum(each.needs is not None for each in made)
    print(f"{len(made)} overloads, {of_frames} of frames, {seconds:.0f} CPU-seconds")


if __name__ == "__main__":
    main()
