"""Mitsuba: one path a pixel, compiled by LLVM where it is there."""

import mitsuba as mi
import numpy as np
from view_loop import opened

scene = opened(on_one_core=False)  # its loading waits for ever on one core
try:
    mi.set_variant("llvm_ad_rgb")
    mi.Float(1) + mi.Float(2)
except Exception:  # no LLVM that Dr.Jit can load
    mi.set_variant("scalar_rgb")
mi.set_log_level(mi.LogLevel.Error)


def bitmap(name, raw=False):
    return {"type": "bitmap", "filename": scene.path(name), "raw": raw}


def material(number):
    principled = {
        "type": "principled",
        "base_color": bitmap(f"base{number}.png"),
        "roughness": bitmap("roughness.png", raw=True),
        "metallic": bitmap("metallic.png", raw=True),
    }
    bumped = {"type": "normalmap", "normalmap": bitmap("normal.png", raw=True), "bsdf": principled}
    return {"type": "twosided", "bsdf": bumped}


width, height = scene.size
world = {
    "type": "scene",
    "integrator": {"type": "path", "max_depth": 3},
    "sky": {"type": "envmap", "filename": scene.path("sky.exr")},
    "ground": {"type": "ply", "filename": scene.path("ground.ply"), "bsdf": {"type": "diffuse"}},
}
for number in scene.told["materials"]:
    world[f"part{number}"] = {"type": "ply", "filename": scene.path(f"car{number}.ply"), "bsdf": material(number)}
world = mi.load_dict(world)
film = {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}}
turned = np.diag([-1.0, 1, -1, 1])  # Mitsuba's cameras look along +Z
sensor = mi.load_dict(
    {
        "type": "perspective",
        "fov": float(np.rad2deg(scene.told["fov_y"])),
        "fov_axis": "y",
        "film": film,
        "sampler": {"type": "independent", "sample_count": 1},
    }
)
parameters = mi.traverse(sensor)
scene.ready(f"Mitsuba {mi.__version__} ({mi.variant()})", "colour by 1 path a pixel, with noise; no labels")
for view in scene.views():
    parameters["to_world"] = mi.ScalarTransform4f(np.array(scene.told["views"][view]) @ turned)
    parameters.update()
    picture = mi.render(world, sensor=sensor, spp=1, seed=view)
    scene.keep(view, np.array(mi.util.convert_to_bitmap(picture))[..., :3].copy())
