"""Contact sheets: every zoo family, or the model files named, under several lights; one row a model, one column a light.

    .venv/bin/python scripts/sheets.py OUT.png [MODEL_FILE ...] [--families NAME ...] [--hdri FILE] [--photo FILE]

Lights: noon sun; daylight with the sun at 8 degrees; an overcast sky; a dark room with an area light and two lamps.
`--hdri` adds a column in that light, `--photo` one over that photograph, on a shadow catcher.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

import viewsphere_zoo as zoo
from viewsphere import plugins
from viewsphere.assets.cache import load_normalised
from viewsphere.assets.mesh import Mesh
from viewsphere.composing.viewpoints.camera import looking
from viewsphere.errors import ViewsphereError
from viewsphere.model.instant import Viewpoint
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import (
    AreaLight,
    Background,
    Daylight,
    Environment,
    Finish,
    Ground,
    PointLight,
    Scene,
    Sky,
    SpotLight,
    Sun,
)
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.rig import Rig
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing
from viewsphere.plugins.engine import EngineSpec
from viewsphere.truth.raster.visibility import rasterize
from viewsphere_zoo import build

TILE = (320, 240)
LENS = Intrinsics(width=TILE[0], height=TILE[1], fx=480, fy=480, cx=TILE[0] / 2, cy=TILE[1] / 2)
SPEC = ModelSpec(key="model", source="model", category="model", category_id=1)
CONCRETE = Ground(color=(0.62, 0.61, 0.59))


def scenes(size: float) -> tuple[Scene, ...]:
    """The four lights for a model of this size in metres."""
    s = size
    dark = Sky(zenith=(0.05, 0.05, 0.07), horizon=(0.05, 0.05, 0.06))
    lamps = (
        AreaLight(position=(-1.2 * s, -0.8 * s, 1.4 * s), strength=12 * s * s, size=(0.8 * s, 0.8 * s)),
        PointLight(position=(1.1 * s, 0.2 * s, 0.5 * s), strength=2 * s * s, color=(1.0, 0.6, 0.3), radius=0.03 * s),
        SpotLight(
            position=(0.2 * s, -1.6 * s, 1.5 * s), strength=5 * s * s, color=(0.5, 0.7, 1.0), angle_deg=50, radius=0.05 * s
        ),
    )
    return (
        Scene(sun=Sun(azimuth=-20), ground=CONCRETE),
        Scene(sun=Sun(azimuth=-50, elevation=8), sky=Daylight(turbidity=2.5), ground=CONCRETE),
        Scene(sun=Sun(), sky=Daylight(clouds=1.0), ground=CONCRETE),
        Scene(sun=None, sky=dark, lights=lamps, ground=CONCRETE),
    )


def extra_scenes(hdri: Path | None, photo: Path | None) -> Iterator[Scene]:
    """Scenes in the light of an environment picture, and over a photograph, if given."""
    if hdri:
        yield Scene(sun=None, sky=Environment(file=str(hdri.resolve())), ground=CONCRETE)
    if photo:
        finish = Finish(background=Background(image=str(photo.resolve())))
        yield Scene(sun=Sun(azimuth=-20), ground=Ground(catcher=True), finish=finish)


def models(files: Sequence[Path], families: Sequence[str]) -> Iterator[tuple[str, Mesh]]:
    """Name and mesh of each model; models that cannot be loaded are reported and left out."""
    for family in families:
        yield family, build(family, np.random.default_rng(5))
    for file in files:
        spec = SPEC.model_copy(update={"source": str(file.resolve())})
        try:
            yield file.name, load_normalised(spec)
        except ViewsphereError as error:
            print(error)


def tile(mesh: Mesh, scene: Scene, azimuth_deg: float = 35, elevation_deg: float = 20) -> Image.Image:
    """A picture of the whole model in this light."""
    size = float(np.linalg.norm(np.ptp(mesh.bounds, axis=0)))
    pose = Viewpoint(index=0, azimuth_deg=azimuth_deg, elevation_deg=elevation_deg, distance=2.2 * size)
    x, y, z = mesh.bounds.mean(axis=0).tolist()
    instants = (looking(pose, (x, y, z), index=0),)
    thing = Thing(id=1, model=SPEC)
    shot = Shot(key="sheet", things=(thing,), rig=Rig.single(LENS), instants=instants, scene=scene, channels=("rgb",))
    engine = plugins.load(EngineSpec, "raster")
    stage = engine.stage(shot, lambda spec: mesh)
    return Image.fromarray(stage.paint(0, 0, rasterize(stage.at(0), shot.camera(0)), ("rgb",))["rgb"])


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("output", type=Path)
    options.add_argument("models", type=Path, nargs="*")
    options.add_argument("--hdri", type=Path, help="an EXR or HDR file")
    options.add_argument("--photo", type=Path, help="a photograph")
    options.add_argument("--families", nargs="+", help="zoo families; default: all where no files are named")
    options.add_argument("--azimuth", type=float, default=35, help="where the camera stands, degrees")
    options.add_argument("--elevation", type=float, default=20, help="degrees above the horizon")
    args = options.parse_intermixed_args()
    rows: list[Image.Image] = []
    families = args.families or (() if args.models else zoo.family_names())
    for name, mesh in models(args.models, families):
        size = float(np.linalg.norm(np.ptp(mesh.bounds, axis=0)))
        lights = (*scenes(size), *extra_scenes(args.hdri, args.photo))
        row = Image.new("RGB", (len(lights) * TILE[0], TILE[1]))
        for i, scene in enumerate(lights):
            row.paste(tile(mesh, scene, args.azimuth, args.elevation), (i * TILE[0], 0))
        ImageDraw.Draw(row).text((6, 4), name, fill="white", stroke_width=2, stroke_fill="black")
        rows.append(row)
        print(name)
    if not rows:
        raise SystemExit("no model could be loaded")
    sheet = Image.new("RGB", (rows[0].width, TILE[1] * len(rows)))
    for i, row in enumerate(rows):
        sheet.paste(row, (0, i * TILE[1]))
    sheet.save(args.output, quality=84)


if __name__ == "__main__":
    main()
