"""Draw the benchmark's frames with another renderer: PYTHON bench_rivals_here.py NAME FOLDER, by a Python that has it.

FOLDER holds what `bench_rivals.py` wrote: `model.glb`, `mesh.npz` (the same triangles in the world), `color.png` and
`told.json` (poses, camera, sun, ground). Prints the CPU seconds of each frame but the first, all threads of this process, as
JSON.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

Draw = Callable[[Any, Any], Any]
"""Draws a frame: rotation (3, 3) from world to camera, OpenCV's axes, and the camera's place (3,)."""

UP = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]], float)
"""From glTF's axes to ours."""


def open3d(folder: Path, told: Any) -> Draw:
    """Ids, depth and normals by one ray a pixel."""
    import open3d as o3d

    mesh, scene, camera = np.load(folder / "mesh.npz"), o3d.t.geometry.RaycastingScene(), told["camera"]
    scene.add_triangles(mesh["vertices"], mesh["triangles"].astype(np.uint32))
    k = [[camera["fx"], 0, camera["width"] / 2], [0, camera["fx"], camera["height"] / 2], [0, 0, 1]]

    def draw(rotation: Any, center: Any) -> Any:
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = rotation, -rotation @ center
        size = {"width_px": camera["width"], "height_px": camera["height"]}
        rays = scene.create_rays_pinhole(intrinsic_matrix=o3d.core.Tensor(k), extrinsic_matrix=o3d.core.Tensor(pose), **size)
        return {name: tensor.numpy() for name, tensor in scene.cast_rays(rays).items()}

    return draw


def pyrender(folder: Path, told: Any) -> Draw:
    """Colour and depth by OpenGL, with the textures, a sun and even light; no shadows."""
    import os

    os.environ.setdefault("PYOPENGL_PLATFORM", "egl")
    import pyrender as gl
    import trimesh

    camera = told["camera"]
    scene = gl.Scene.from_trimesh_scene(trimesh.load(folder / "model.glb"), ambient_light=[0.3, 0.3, 0.3])
    to_world = np.array(told["matrix"]) @ UP
    for node in list(scene.mesh_nodes):
        scene.set_pose(node, to_world @ scene.get_pose(node))
    middle = camera["width"] / 2, camera["height"] / 2
    eye = scene.add(gl.IntrinsicsCamera(camera["fx"], camera["fx"], *middle, znear=0.05, zfar=1000))
    scene.add(gl.DirectionalLight(intensity=3.0), pose=turned_to(told["sun"]["direction"]))
    renderer = gl.OffscreenRenderer(camera["width"], camera["height"])

    def draw(rotation: Any, center: Any) -> Any:
        scene.set_pose(eye, opengl_pose(rotation, center))
        return renderer.render(scene)

    return draw


def vtk(folder: Path, told: Any) -> Draw:
    """Colour by OpenGL: physically based, with the textures and a sun; no shadows, no anti-aliasing."""
    import vtk as v
    from vtk.util.numpy_support import vtk_to_numpy

    camera, window, renderer, importer = told["camera"], v.vtkRenderWindow(), v.vtkRenderer(), v.vtkGLTFImporter()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(camera["width"], camera["height"])
    window.AddRenderer(renderer)
    importer.SetFileName(str(folder / "model.glb"))
    importer.SetRenderWindow(window)
    importer.Update()
    to_world = v.vtkTransform()
    to_world.SetMatrix((np.array(told["matrix"]) @ UP).reshape(-1))
    for actor in renderer.GetActors():
        actor.SetUserTransform(to_world)
    sun = v.vtkLight()
    sun.SetLightTypeToSceneLight()
    sun.SetPosition(*told["sun"]["direction"])
    sun.SetIntensity(3.0)
    renderer.RemoveAllLights()
    renderer.AddLight(sun)
    eye, grab = renderer.GetActiveCamera(), v.vtkWindowToImageFilter()
    eye.SetViewAngle(float(np.degrees(2 * np.arctan(camera["height"] / 2 / camera["fx"]))))
    grab.SetInput(window)

    def draw(rotation: Any, center: Any) -> Any:
        eye.SetPosition(*center)
        eye.SetFocalPoint(*(center + rotation[2]))
        eye.SetViewUp(*-rotation[1])
        renderer.ResetCameraClippingRange()
        window.Render()
        grab.Modified()
        grab.Update()
        return vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars()).copy()

    return draw


def mitsuba(folder: Path, told: Any) -> Draw:
    """Colour by path tracing, one sample a pixel, with one texture, the sun and even light; shadows and bounces are in it."""
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    mesh, camera = np.load(folder / "mesh.npz"), told["camera"]
    car = mi.Mesh("car", len(mesh["vertices"]), len(mesh["triangles"]), has_vertex_normals=True, has_vertex_texcoords=True)
    kept = mi.traverse(car)
    for name, values in (
        ("vertex_positions", mesh["vertices"]),
        ("vertex_normals", mesh["normals"]),
        ("vertex_texcoords", mesh["uv"]),
        ("faces", mesh["triangles"].astype(np.uint32)),
    ):
        kept[name] = values.ravel()
    kept.update()
    car.write_ply(str(folder / "car.ply"))
    look = {"type": "principled", "base_color": {"type": "bitmap", "filename": str(folder / "color.png")}, "roughness": 0.4}
    way = [-value for value in told["sun"]["direction"]]
    sun = {"type": "directional", "direction": way, "irradiance": told["sun"]["energy"]}
    flat = np.diag([told["ground"]["size"] / 2, told["ground"]["size"] / 2, 1, 1])
    flat[2, 3] = told["ground"]["z"]
    world = {
        "type": "scene",
        "ground": {"type": "rectangle", "to_world": mi.ScalarTransform4f(flat)},
        "integrator": {"type": "path", "max_depth": 3},
        "car": {"type": "ply", "filename": str(folder / "car.ply"), "bsdf": {"type": "twosided", "look": look}},
        "sun": sun,
        "sky": {"type": "constant", "radiance": 0.3},
    }
    scene, to_world = mi.load_dict(world), mi.ScalarTransform4f
    fov = float(np.degrees(2 * np.arctan(camera["width"] / 2 / camera["fx"])))
    film = {"type": "hdrfilm", "width": camera["width"], "height": camera["height"], "rfilter": {"type": "box"}}

    def draw(rotation: Any, center: Any) -> Any:
        pose = to_world().look_at(origin=center.tolist(), target=(center + rotation[2]).tolist(), up=(-rotation[1]).tolist())
        eye = {"type": "perspective", "fov": fov, "to_world": pose, "film": film}
        return np.array(mi.render(scene, sensor=mi.load_dict(eye), spp=1))

    return draw


def opengl_pose(rotation: Any, center: Any) -> Any:
    """World from camera (4, 4) in OpenGL's axes."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation.T @ np.diag([1.0, -1.0, -1.0]), center
    return pose


def turned_to(direction: Any) -> Any:
    """World from light (4, 4) of one that stands in a direction."""
    z = np.array(direction) / np.linalg.norm(direction)
    x = np.cross([0.0, 0.0, 1.0] if abs(z[2]) < 0.9 else [1.0, 0.0, 0.0], z)
    pose = np.eye(4)
    pose[:3, 2], pose[:3, 0] = z, x / np.linalg.norm(x)
    pose[:3, 1] = np.cross(pose[:3, 2], pose[:3, 0])
    return pose


RIVALS: dict[str, Callable[[Path, Any], Draw]] = {"open3d": open3d, "pyrender": pyrender, "vtk": vtk, "mitsuba": mitsuba}


def main(name: str, folder: Path) -> None:
    told = json.loads((folder / "told.json").read_text())
    draw, times = RIVALS[name](folder, told), list[float]()
    for pose in told["poses"]:
        rotation, center = np.array(pose["R"]), np.array(pose["center"])
        begun = time.process_time()
        found = draw(rotation, center)
        times.append(time.process_time() - begun)
    pictures = found if isinstance(found, (tuple, list)) else list(found.values()) if isinstance(found, dict) else [found]
    if not any(np.ptp(np.nan_to_num(np.asarray(p, float), posinf=0)) > 0 for p in pictures):
        raise SystemExit("the last picture is empty")
    print(json.dumps(times[1:]))


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
