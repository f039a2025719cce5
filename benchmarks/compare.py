"""Compares the raster engine with Blender's Cycles: six scenes with equal lights, rendered by both, shown side by side with
FLIP and SSIM.

Cycles runs in the Python that viewsphere finds (VIEWSPHERE_BLENDER_PYTHON, or the extra `blender`). Both pictures go
through viewsphere's own view transform. FLIP: Andersson et al., *FLIP: A Difference Evaluator for Alternating Images* (2020),
0 is equal, from the package `flip-evaluator`; SSIM: Wang et al. 2004, 1 is equal, from `scikit-image`.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from bench_scaling import ball
from bench_scene import textured, write_sky
from PIL import Image

from viewsphere import plugins
from viewsphere.assets.exporting.export import export_glb
from viewsphere.assets.mesh import Material, Mesh
from viewsphere.blender.interpreter import find_blender
from viewsphere.composing.viewpoints.camera import looking
from viewsphere.engines.shared.blender.requests import laid_with_slabs
from viewsphere.errors import ViewsphereError
from viewsphere.geometry.box3d import Box3d
from viewsphere.model.instant import Viewpoint
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import AreaLight, Environment, Ground, PointLight, Scene, Sky, SpotLight, Sun, ViewTransform
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.rig import Rig
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Motion, Thing
from viewsphere.plugins.engine import EngineSpec
from viewsphere.rendering.ground.material import SLABS, ground_material
from viewsphere.rendering.view import develop
from viewsphere.truth.raster.visibility import rasterize
from viewsphere_zoo import build
from viewsphere_zoo.household.vessels import vessel
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.solids import join, lathe

WIDTH, HEIGHT = 480, 360
MEASURES = {"flip_evaluator": "flip-evaluator", "skimage": "scikit-image"}
"""Modules that measure how pictures differ, and their packages."""


@dataclass(frozen=True)
class Case:
    """A scene to compare: models where they stand, lights, and where the camera is."""

    name: str
    models: tuple[tuple[Mesh, tuple[float, float, float]], ...]
    scene: Scene
    azimuth_deg: float
    elevation_deg: float
    distance: float


def plain(color: tuple[float, float, float], **more: Any) -> Material:
    return Material("plain", (*color, 1.0), **more)


def pane() -> Mesh:
    """A plate of green glass, 0.9 m square and 2 cm thick."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    normals = np.repeat(np.concatenate([np.eye(3), -np.eye(3)]), 4, axis=0).astype(np.float32)
    corners, triangles = [], []
    for axis, side in [(k, s) for s in (1, -1) for k in range(3)]:
        face = signs[signs[:, axis] == side][[0, 1, 3, 2]]
        outward = np.cross(face[1] - face[0], face[2] - face[0])[axis] * side > 0
        first = len(corners) * 4
        triangles += [[first, first + 1, first + 2], [first, first + 2, first + 3]]
        corners.append(face if outward else face[::-1])
    return Mesh(
        vertices=(np.concatenate(corners) * [0.45, 0.01, 0.45]).astype(np.float32),
        triangles=np.array(triangles, np.int32),
        normals=normals,
        triangle_material=np.zeros(12, np.int32),
        triangle_part=np.zeros(12, np.int32),
        materials=(plain((0.7, 0.9, 0.75), roughness=0.02, transmission=1.0),),
    )


def turned_glass(*profiles: np.ndarray[Any, Any]) -> Mesh:
    """A body of clear glass, made of profiles (N, 2) of radius and height, in metres."""
    glass = Material("glass", (0.97, 0.985, 0.975, 1.0), roughness=0.0, transmission=1.0, thickness=0.003)
    return assemble([Piece("glass", glass, join(*(lathe(profile, 72) for profile in profiles)))], crease_deg=35)


def tumbler() -> Mesh:
    """A drinking glass, 11 cm high, with a wall of 2.5 mm and a floor of 1 cm."""
    z = np.linspace(0, 1, 12)
    made = vessel(np.stack([0.037 * (0.8 + 0.2 * z), 0.11 * z], axis=1), 0.0025, 0.01, 0.002)
    return turned_glass(made.foot, made.wall, made.lip, made.inside)


def glass_bowl() -> Mesh:
    """A bowl, 14 cm wide."""
    turn = np.linspace(0, np.pi / 2, 14)
    made = vessel(np.stack([0.03 + 0.04 * np.sin(turn), 0.06 * (1 - np.cos(turn))], axis=1), 0.003, 0.006, 0.002)
    return turned_glass(made.foot, made.wall, made.lip, made.inside)


def glass_ball() -> Mesh:
    """A solid ball, 8 cm wide."""
    turn = np.linspace(-np.pi / 2, np.pi / 2, 40)
    return turned_glass(0.04 * np.stack([np.cos(turn), 1 + np.sin(turn)], axis=1).clip(0))


def cases(folder: Path) -> Iterator[Case]:
    sky = Environment(file=str(folder / "sky.exr"))
    even = Sky(zenith=(0.5, 0.55, 0.6), horizon=(0.5, 0.55, 0.6))
    dim = Sky(zenith=(0.06, 0.06, 0.07), horizon=(0.06, 0.06, 0.07))
    ground = Ground(color=(0.6, 0.58, 0.55))
    sphere = ball(20_000, 0)
    balls = [
        (replace(sphere, materials=(plain((0.9, 0.6, 0.25), metallic=float(y), roughness=r),)), (1.1 * (x - 2), 1.2 * y, 0.5))
        for y in (0, 1)
        for x, r in enumerate((0.08, 0.25, 0.45, 0.7, 1.0))
    ]
    yield Case("balls", tuple(balls), Scene(sun=None, sky=sky, ground=ground), 0, 22, 7.5)
    car = build("car", np.random.default_rng(4))
    yield Case("car", ((car, (0, 0, 0)),), Scene(sun=Sun(angle_deg=2.0), sky=even, ground=ground), 35, 16, 8.5)
    chair = build("chair", np.random.default_rng(2))
    area = AreaLight(position=(1.2, -1.0, 1.4), strength=20.0, size=(0.9, 0.6))
    yield Case("chair", ((chair, (0, 0, 0)),), Scene(sun=None, sky=dim, lights=(area,), ground=ground), 30, 20, 2.6)
    drier = build("hair_drier", np.random.default_rng(3))
    spot = SpotLight(position=(-0.5, -0.5, 0.8), strength=7.0, radius=0.06, angle_deg=40, color=(1.0, 0.9, 0.7))
    point = PointLight(position=(0.6, -0.3, 0.4), strength=1.2, radius=0.02, color=(0.6, 0.7, 1.0))
    lit = Scene(sun=None, sky=dim, lights=(spot, point), ground=ground)
    yield Case("hair drier", ((drier, (0, 0, 0)),), lit, -30, 25, 0.75)
    box = textured(replace(build("wheelie_bin", np.random.default_rng(1)), colors=None), 512)
    pair = ((box, (0, 0.4, 0)), (pane(), (0.35, -0.5, 0.45)))
    still_life = ((tumbler(), (-0.12, -0.05, 0)), (glass_ball(), (-0.03, -0.1, 0)), (glass_bowl(), (0.09, -0.07, 0)))
    around = (
        (build("mug", np.random.default_rng(3)), (-0.19, 0.14, 0)),
        (build("book", np.random.default_rng(5)), (0.03, 0.2, 0)),
    )
    lit = Scene(sun=Sun(angle_deg=3.0, strength=1.5), sky=sky, ground=Ground(color=(0.5, 0.42, 0.33)))
    yield Case("clear glass", still_life + around, lit, 5, 18, 0.85)
    yield Case("glass and textures", pair, Scene(sun=None, sky=sky, ground=ground), 20, 18, 4.0)


def shot_of(case: Case) -> tuple[Shot, dict[str, Mesh]]:
    meshes = {f"model{i}": mesh for i, (mesh, _) in enumerate(case.models)}
    things = tuple(
        Thing(
            id=i,
            model=ModelSpec(key=key, source=key, category="model", category_id=1),
            motion=Motion.still(((1, 0, 0, x), (0, 1, 0, y), (0, 0, 1, z), (0, 0, 0, 1))),
        )
        for i, (key, (_, (x, y, z))) in enumerate(zip(meshes, case.models, strict=True), 1)
    )
    corners = np.concatenate([Box3d.between(*mesh.bounds).corners + np.array(at) for mesh, at in case.models])
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    x, y, z = middle.tolist()
    pose = Viewpoint(index=0, azimuth_deg=case.azimuth_deg, elevation_deg=case.elevation_deg, distance=case.distance)
    lens = Intrinsics(width=WIDTH, height=HEIGHT, fx=WIDTH * 1.25, fy=WIDTH * 1.25, cx=WIDTH / 2, cy=HEIGHT / 2)
    instant = looking(pose, (x, y, z), index=0)
    shot = Shot(key=case.name, things=things, rig=Rig.single(lens), instants=(instant,), scene=case.scene, channels=("rgb",))
    return shot, meshes


def floor(ground: Ground, folder: Path) -> dict[str, Any]:
    """The slabs as a picture that repeats, which Cycles needs: the file, the linear colour that multiplies it, metres, and by
    how many repeats it is moved from the world's origin.
    """
    material, (picture,) = laid_with_slabs(ground_material(ground)[0])
    assert material.base_color_texture is not None
    file = folder / "slabs.png"
    Image.fromarray(picture.pixels).save(file)
    scale = material.base_color_texture.scale[0]
    middle = 0.5 / SLABS * scale  # as `ground_frame` has it
    return {"image": str(file), "color": material.base_color[:3], "repeat": ground.tile / scale, "shift": middle}


def describe(case: Case, folder: Path) -> None:
    """Write the scene for compare_cycles.py."""
    shot, meshes = shot_of(case)
    camera = shot.camera(0)
    models: list[dict[str, Any]] = []
    for thing in shot.things:
        file = export_glb(meshes[thing.model.key], folder / f"{case.name}_{thing.model.key}.glb")
        models.append({"file": str(file), "matrix": thing.world_from_object})
    scene = case.scene
    sun = [{"kind": "sun", **scene.sun.model_dump()}] if scene.sun else []
    low = min(mesh.bounds[0, 2] + at[2] for mesh, at in case.models)
    lens = {"width": WIDTH, "height": HEIGHT, "fx": camera.intrinsics.fx}
    told = {
        "camera": {**lens, "R": camera.R.tolist(), "center": camera.center.tolist()},
        "models": models,
        "ground": scene.ground and {"z": float(low), **floor(scene.ground, folder)},
        "lights": sun + [light.model_dump() for light in scene.lights],
        "centre": shot.instants[0].focus,
        "sky": scene.sky.model_dump(),
    }
    (folder / f"{case.name}.json").write_text(json.dumps(told))


def picture(case: Case) -> np.ndarray[Any, Any]:
    """viewsphere's picture of a case, (H, W, 3)."""
    shot, meshes = shot_of(case)
    engine = plugins.load(EngineSpec, "raster")
    stage = engine.stage(shot, lambda spec: meshes[spec.key])
    return stage.paint(0, 0, rasterize(stage.at(0), shot.camera(0)), ("rgb",))["rgb"]


def developed(file: Path) -> np.ndarray[Any, Any]:
    """A scene-linear EXR file through viewsphere's standard view."""
    import OpenEXR

    with OpenEXR.File(str(file)) as exr:
        channels = exr.channels()
        name = next(n for n in channels if n.startswith("RGB"))
        pixels = channels[name].pixels[..., :3].astype(np.float32)
    radiance = np.concatenate([pixels, np.ones_like(pixels[..., :1])], axis=-1)
    return develop(np.ascontiguousarray(radiance), None, ViewTransform())


def compare(case: Case, folder: Path, output: Path) -> tuple[float, float]:
    """FLIP and SSIM; writes the three pictures side by side: viewsphere, Cycles, FLIP."""
    import flip_evaluator
    from skimage.metrics import structural_similarity

    own = picture(case)
    cycles = developed(folder / f"{case.name}_cycles.exr")
    a, b = (x.astype(np.float32) / 255 for x in (cycles, own))
    heat, mean, _ = flip_evaluator.evaluate(a, b, "LDR")
    ssim = float(structural_similarity(a, b, channel_axis=2, data_range=1.0))
    sheet = np.concatenate([own, cycles, np.round(255 * np.asarray(heat)).astype(np.uint8)], axis=1)
    Image.fromarray(sheet).save(output / f"cycles_{case.name.replace(' ', '_')}.jpg", quality=90, subsampling=0)
    return float(mean), ssim


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--samples", type=int, default=96)
    options.add_argument("--output", type=Path, default=Path(__file__).parent.parent / "docs" / "images")
    options.add_argument("--keep", type=Path, help="folder for what both engines wrote; Cycles' files there are used again")
    args = options.parse_args()
    try:
        python = find_blender()
    except ViewsphereError as error:
        sys.exit(f"compare: {error}")
    lacking = [name for module, name in MEASURES.items() if find_spec(module) is None]
    if lacking:
        sys.exit(f"compare: expected {' and '.join(lacking)}, found none: .venv/bin/python -m pip install {' '.join(lacking)}")
    with tempfile.TemporaryDirectory() as name:
        folder = args.keep or Path(name)
        folder.mkdir(parents=True, exist_ok=True)
        args.output.mkdir(parents=True, exist_ok=True)
        write_sky(folder)
        found = list(cases(folder))
        for case in found:
            describe(case, folder)
        if not all((folder / f"{case.name}_cycles.exr").exists() for case in found):
            program = Path(__file__).with_name("compare_cycles.py")
            subprocess.run([python, str(program), str(folder), str(args.samples)], check=True, stdout=subprocess.DEVNULL)
        print("| scene | mean FLIP | SSIM |\n|---|---:|---:|")
        for case in found:
            flip, ssim = compare(case, folder, args.output)
            print(f"| {case.name} | {flip:.3f} | {ssim:.3f} |")


if __name__ == "__main__":
    main()
