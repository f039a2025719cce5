"""The benchmark's scene as files that other renderers read, in glTF's axes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from bench_scene import reference_recipe, write_reference
from PIL import Image

from viewsphere import plan
from viewsphere.assets.exporting.export import export_glb
from viewsphere.assets.mesh import Mesh
from viewsphere.codecs.srgb import encoded, linear
from viewsphere.model.sensors.camera import Camera
from viewsphere.run.shots.stages import Stages

TO_GLTF = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
SUN = [0.5, 0.7, 0.5]
"""Direction towards the one light of renderers that have no sky."""
GROUND = 100.0
"""Half a side of the ground, metres."""


def write_scene(folder: Path, views: int) -> None:
    """Write the reference scene, and for other renderers `model.glb`, PLY files, textures and `scene.json` with the cameras."""
    write_reference(folder)
    stages = Stages()
    shot = next(plan(reference_recipe(views, 4, folder), shot_frames=views).shots(stages.box))
    thing = shot.things[0]
    mesh = stages.model(thing.model)
    export_glb(mesh, folder / "model.glb")
    used = [k for k in range(len(mesh.materials)) if (mesh.triangle_material == k).any()]
    write_ply(folder / "car.ply", mesh, mesh.triangles)
    for material in used:
        write_ply(folder / f"car{material}.ply", mesh, mesh.triangles[mesh.triangle_material == material])
    write_textures(folder, mesh, used)
    ground = float(mesh.vertices[:, 2].min())
    write_ground(folder / "ground.ply", ground)
    cameras = [shot.camera(instant) for instant in range(len(shot.instants))]
    to_model = np.linalg.inv(np.array(thing.world_from_object))
    told = {
        "width": cameras[0].width,
        "height": cameras[0].height,
        "fov_y": float(2 * np.arctan(0.5 * cameras[0].height / cameras[0].K[1, 1])),
        "ground_y": ground,
        "sun": SUN,
        "materials": used,
        "views": [pose(camera, to_model).tolist() for camera in cameras],
    }
    (folder / "scene.json").write_text(json.dumps(told))


def pose(camera: Camera, to_model: Any) -> Any:
    """The matrix (4, 4) from an OpenGL camera's axes to the model's, both Y up."""
    to_world = np.eye(4)
    to_world[:3, :3], to_world[:3, 3] = camera.R.T @ np.diag([1, -1, -1]), camera.center
    turn = np.eye(4)
    turn[:3, :3] = TO_GLTF
    return turn @ to_model @ to_world


def write_textures(folder: Path, mesh: Mesh, used: list[int]) -> None:
    """Each material's base colour times its factor, and the roughness, metallic and normal maps that all share."""
    base, surface, normal = (image.pixels for image in mesh.images)
    light = linear(base[..., :3] / 255)
    for number in used:
        color = encoded(light * np.array(mesh.materials[number].base_color[:3]))
        Image.fromarray(np.round(255 * color).astype(np.uint8)).save(folder / f"base{number}.png")
    for name, pixels in (("roughness", surface[..., 1]), ("metallic", surface[..., 2]), ("normal", normal[..., :3])):
        Image.fromarray(np.ascontiguousarray(pixels)).save(folder / f"{name}.png")


def write_ply(path: Path, mesh: Mesh, triangles: Any) -> None:
    """These triangles with normals and texture coordinates, as a binary PLY."""
    used, corners = np.unique(triangles, return_inverse=True)
    columns = (mesh.vertices[used] @ TO_GLTF.T, mesh.normals[used] @ TO_GLTF.T, mesh.uv0[used])
    _write(path, np.column_stack(columns), corners.reshape(-1, 3))


def write_ground(path: Path, y: float) -> None:
    """A square at this height."""
    sides = [(-GROUND, -GROUND), (-GROUND, GROUND), (GROUND, GROUND), (GROUND, -GROUND)]
    rows = np.array([[x, y, z, 0, 1, 0, 0, 0] for x, z in sides])
    _write(path, rows, np.array([[0, 1, 2], [0, 2, 3]]))


def _write(path: Path, rows: Any, triangles: Any) -> None:
    fields = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz", "u", "v"))
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(rows)}\n{fields}element face {len(triangles)}\n"
    faces = np.zeros(len(triangles), [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, triangles
    head += "property list uchar int vertex_indices\nend_header\n"
    path.write_bytes(head.encode() + rows.astype("<f4").tobytes() + faces.tobytes())
