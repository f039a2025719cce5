"""The pictures of docs/like.md: of each recipe in recipes/like one frame, and what is known of it beside.

python scripts/like.py [NAME ...]
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
from paper import ROOT, grid, save

from viewsphere import Recipe, render
from viewsphere.preview import draw_sample

RECIPES = sorted((ROOT / "recipes" / "like").glob("*.yaml"))


@dataclass(frozen=True)
class Shown:
    """The frame of a recipe to show, and the labels to draw: one picture each, after the plain one."""

    frame: int
    drawn: tuple[str, ...]


SHOWN: dict[str, Shown] = {
    "sintel": Shown(0, ("flow",)),
    "virtual_kitti": Shown(0, ("semantic",)),
    "synthia": Shown(0, ("semantic",)),
    "suncg": Shown(4, ("depth", "instances")),
    "minos": Shown(8, ("depth_sensor", "semantic", "normals")),
    "surreal": Shown(12, ("body_parts", "flow_backward", "keypoints")),
    "flyingthings3d": Shown(0, ("flow",)),
    "icl_nuim": Shown(2, ("depth",)),
    "driving_in_the_matrix": Shown(0, ("boxes",)),
    "viper": Shown(0, ("semantic",)),
    "airsim": Shown(0, ("depth",)),
    "carla": Shown(0, ("boxes3d",)),
    "render_for_cnn": Shown(58, ("instances",)),
    "nyc3dcars": Shown(1, ("boxes3d",)),
    "pascal3d": Shown(4, ("boxes", "boxes3d")),
    "objectnet3d": Shown(2, ("instances", "boxes3d")),
    "liebelt": Shown(110, ("nocs",)),
    "falling_things": Shown(0, ("instances", "boxes3d")),
    "sun_saenko": Shown(7, ("boxes",)),
}


def picture(file: Path) -> None:
    shown = SHOWN[file.stem]
    sample = next(islice(render(Recipe.load(file)), shown.frame, None))
    plain = np.asarray(sample.rgb)
    drawn = (draw_sample(sample, [name]) for name in shown.drawn)  # maps have the picture on their left
    tiles = [plain, *(one[:, -plain.shape[1] :] for one in drawn)]
    save(f"like/{file.stem}.jpg", grid(tiles, len(tiles), 1200), 80)


def main() -> None:
    wanted = sys.argv[1:] or [file.stem for file in RECIPES]
    for file in RECIPES:
        if file.stem in wanted:
            picture(file)


if __name__ == "__main__":
    main()
