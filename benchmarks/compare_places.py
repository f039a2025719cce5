"""Compares the raster engine with Blender's Cycles in five places: three rooms, a town by day and a wet street.

    .venv/bin/python benchmarks/compare_places.py [--samples 1024] [--keep FOLDER] [--output docs/images/cycles_places.jpg]

Both engines render the same shot; Cycles weighs all of a pixel's samples alike, as viewsphere does, and follows light around 24
corners. Prints the mean difference in display values (of 255) and SSIM (Wang et al. 2004, 1 is equal; from the package
`scikit-image`), without light between surfaces, with it, and with fine light, and writes a sheet of the last: viewsphere,
Cycles, four times their difference.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from skimage.metrics import structural_similarity

from viewsphere import Recipe, plan, plugins
from viewsphere.model.instant import Instant
from viewsphere.model.scene import IDENTITY
from viewsphere.model.shot import Shot
from viewsphere.plugins.engine import EngineSpec
from viewsphere.run.shots.stages import Stages
from viewsphere.truth.raster.visibility import rasterize

SIZE = 320, 240
BOUNCES = 24
SETTINGS = {"pixel_filter_type": "BOX", "filter_width": 1.0, "blur_glossy": 0.0}
"""Cycles' own filter reaches into neighbouring pixels, and its blur of glossy surfaces loses 1 of 255 in rooms."""
HOW = {"off": {"bounces": "off"}, "on": {"bounces": "on"}, "fine": {"bounces": "fine", "antialias": 64}}
"""Options of viewsphere's pictures."""


@dataclass(frozen=True)
class Case:
    """A place, seen from `eye` towards `target`, or from the recipe's viewpoint; part: the share of samples to compare."""

    name: str
    place: str
    seed: int
    model: str = "zoo:mug"
    eye: tuple[float, float, float] | None = None
    target: tuple[float, float, float] = (0.0, 0.0, 0.0)
    fov_deg: float = 75.0
    exposure: float = 0.0
    part: float = 1.0
    scene: dict[str, Any] = field(default_factory=dict[str, Any])
    viewpoints: dict[str, Any] = field(default_factory=lambda: {"azimuth": [-6], "elevation": [9], "distance": [16.5]})


CASES = (
    Case("room", "zoo:room", 3, eye=(-0.1, 0.2, 1.45), target=(0.7, -1.9, 0.75), exposure=3.4, part=0.25),
    Case("flat", "zoo:flat", 2, eye=(-0.25, -0.1, 1.45), target=(1.9, 0.7, 0.75), exposure=4.2),
    Case("table top", "zoo:table_top", 1, eye=(-0.6, -0.2, 1.1), target=(1.9, 0.7, 0.1), exposure=3.4),
    Case("town by day", "zoo:town", 2, "zoo:car", fov_deg=46, part=0.25),
    Case("wet street", "zoo:neighbourhood", 5, "zoo:car", fov_deg=46, part=0.5, scene={"wet": {"amount": 1.0, "puddles": 0.0}}),
)


def recipe(case: Case) -> Recipe:
    return Recipe(
        name="places",
        seed=case.seed,
        models=[{"source": case.model}],
        viewpoints=case.viewpoints,
        camera={"size": list(SIZE), "fov_deg": case.fov_deg},
        scene={
            "place": {"source": case.place, "draw": "per_model"},
            "sky": {"daylight": {"turbidity": 3}},
            "sun": {"azimuth": 40, "elevation": 40},
            "view": {"exposure": case.exposure, "transform": "standard"},
            **case.scene,
        },
        channels=["rgb"],
        formats=["native"],
    )


def seen_from(shot: Shot, case: Case) -> Shot:
    """The shot with the case's camera, if it has one."""
    if case.eye is None:
        return shot
    ahead = np.subtract(case.target, case.eye)
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, [0, 0, 1])
    right /= np.linalg.norm(right)
    rows = np.column_stack([right, np.cross(ahead, right), ahead, case.eye]).tolist()
    a, b, c = (tuple(row) for row in rows)
    first = shot.instants[0]
    now = Instant(index=0, world_from_rig=(a, b, c, IDENTITY[3]), focus=first.focus, finish=first.finish)
    return shot.model_copy(update={"instants": (now,)})


def picture(shot: Shot, stages: Stages, engine: str, **options: Any) -> np.ndarray[Any, Any]:
    """The first picture of a shot by this engine, (H, W, 3)."""
    shot = shot.model_copy(update={"engine": engine, "engine_options": options})
    stage = plugins.load(EngineSpec, engine).stage(shot, stages.model)
    return stage.paint(0, 0, rasterize(stage.at(0), shot.camera(0)), ("rgb",))["rgb"]


def differences(own: np.ndarray[Any, Any], other: np.ndarray[Any, Any]) -> tuple[float, float]:
    """Mean difference of display values, and SSIM."""
    mean = float(np.abs(own.astype(float) - other).mean())
    return mean, float(structural_similarity(own, other, channel_axis=2))


def row_of(case: Case, samples: int, keep: Path) -> tuple[str, np.ndarray[Any, Any]]:
    """A line of the table, and a row of the sheet."""
    stages, samples = Stages(), round(samples * case.part)
    shot = seen_from(next(plan(recipe(case)).shots(stages.box)), case)
    file = keep / f"{case.name.replace(' ', '_')}_{samples}.png"
    if not file.exists():
        more = {"samples": samples, "denoise": "best", "bounces": BOUNCES, "settings": SETTINGS, "threads": 1}
        Image.fromarray(picture(shot, stages, "cycles", **more)).save(file)
    cycles = np.array(Image.open(file))
    own = {how: picture(shot, stages, "raster", **given) for how, given in HOW.items()}
    found = [f"{mean:.1f} | {ssim:.3f}" for mean, ssim in (differences(own[how], cycles) for how in HOW)]
    apart = np.minimum(4 * np.abs(own["fine"].astype(int) - cycles), 255).astype(np.uint8)
    return f"| {case.name} | {' | '.join(found)} |", np.concatenate([own["fine"], cycles, apart], axis=1)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--samples", type=int, default=1024)
    options.add_argument("--keep", type=Path, default=Path("places"), help="folder for Cycles' pictures, which are used again")
    options.add_argument("--output", type=Path, default=Path(__file__).parent.parent / "docs" / "images" / "cycles_places.jpg")
    options.add_argument("--only", nargs="+", help="names of places")
    args = options.parse_args()
    args.keep.mkdir(parents=True, exist_ok=True)
    print("| place | bounces off: mean | SSIM | on: mean | SSIM | fine: mean | SSIM |\n|---|---:|---:|---:|---:|---:|---:|")
    rows: list[np.ndarray[Any, Any]] = []
    for case in CASES:
        if not args.only or case.name in args.only:
            line, row = row_of(case, args.samples, args.keep)
            rows.append(row)
            print(line, flush=True)
    Image.fromarray(np.concatenate(rows)).save(args.output, quality=72)


if __name__ == "__main__":
    main()
