"""A scene is reconstructed from rendered pictures alone: COLMAP finds the cameras that took them.

    pip install viewsphere pycolmap
    python examples/reconstruction.py OUT [--views 24]

1. Boxes with random textures are written as models, and rendered on two rings around them.
2. `pycolmap` finds features in the pictures, matches all pairs, and maps the scene, without being told any pose.
3. The camera centres that it finds are laid over the labelled ones by the best similarity: what is left is the error.
"""

from __future__ import annotations

import argparse
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pycolmap
import trimesh
from PIL import Image

import viewsphere as vs

SIZE, FOV_DEG, DISTANCE = (640, 480), 55.0, 2.6
BOXES = ((0.6, 0.5, 0.7), (0.4, 0.4, 0.9), (0.8, 0.3, 0.35))
"""Width, length and height, metres."""

TEXELS = 1024
"""Side of a box's picture, which has a part for each of the six sides."""


def write_boxes(folder: Path) -> None:
    """The boxes as GLB files, with noise of all sizes on them."""
    for number, extents in enumerate(BOXES):
        rng = np.random.default_rng(number)
        box = trimesh.creation.box(extents)
        corners, sides = box.triangles, box.face_normals  # unwelded: each triangle has corners of its own
        across = np.abs(sides).argmax(axis=1)
        axes = [[i for i in range(3) if i != axis] for axis in across]
        own = across + 3 * (sides.max(axis=1) > 0.5)  # each side has a part of its own of the picture
        places = np.stack([own % 3, own // 3], axis=1)
        inside = [(c[:, a] / np.array(extents)[a] + 0.5) for c, a in zip(corners, axes, strict=True)]
        uv = np.concatenate([(xy + place) / (3, 2) for xy, place in zip(inside, places, strict=True)])
        vertices = corners.reshape(-1, 3) @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # glTF's y is up
        material = trimesh.visual.material.PBRMaterial(
            baseColorTexture=Image.fromarray(texture(rng)), roughnessFactor=1.0, metallicFactor=0.0
        )
        faces = np.arange(len(vertices)).reshape(-1, 3)
        visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
        mesh = trimesh.Trimesh(vertices, faces, visual=visual, process=False)
        (folder / f"box{number}.glb").write_bytes(mesh.export(file_type="glb"))


def texture(rng: np.random.Generator) -> np.ndarray:
    """Noise of all sizes, (TEXELS, TEXELS, 3) uint8."""
    total = np.zeros((TEXELS, TEXELS, 3))
    for cells in (16, 64, 256):
        values = rng.random((cells, cells, 3))
        total += values.repeat(TEXELS // cells, axis=0).repeat(TEXELS // cells, axis=1)
    return np.rint(total * (255 / 3)).astype(np.uint8)


def recipe(folder: Path, views: int) -> vs.Recipe:
    """Two rings of pictures around the boxes."""
    step = 720 / views
    return vs.Recipe.model_validate(
        {
            "name": "boxes",
            "models": [{"source": str(folder / f"box{i}.glb"), "category": "box", "scale": "as_is"} for i in range(len(BOXES))],
            "scenes": {"count": 1, "objects": len(BOXES), "layout": "scatter"},
            "viewpoints": {
                "azimuth": {"start": 0, "stop": 360, "step": step},
                "elevation": [15, 40],
                "distance": DISTANCE,
            },
            "camera": {"size": list(SIZE), "fov_deg": FOV_DEG},
            "scene": {"ground": True},
            "channels": ["rgb", "depth", "instances"],
            "formats": [],
            "splits": {"by": "scene", "train": 1},
        }
    )


def reconstructed(dataset: vs.Dataset, folder: Path) -> Any:
    """The largest model that COLMAP maps of a data set's pictures."""
    pictures = folder / "pictures"
    pictures.mkdir(parents=True)
    for sample in dataset:
        shutil.copyfile(dataset.root / sample.picture_file, pictures / f"{sample.index:04d}.png")
    camera = dataset[0].camera
    reader = pycolmap.ImageReaderOptions(
        camera_model="PINHOLE", camera_params=f"{camera.K[0, 0]},{camera.K[1, 1]},{camera.K[0, 2]},{camera.K[1, 2]}"
    )
    base = folder / "base.db"
    pycolmap.extract_features(base, pictures, camera_mode=pycolmap.CameraMode.SINGLE, reader_options=reader)
    pycolmap.match_exhaustive(base)
    maps = pycolmap.incremental_mapping(base, pictures, folder / "sparse")
    return max(maps.values(), key=lambda found: found.num_reg_images())


def errors(dataset: vs.Dataset, found: Any) -> dict[str, float]:
    """How far the found camera centres are from the labelled ones, laid over them by the best similarity (Umeyama 1991)."""
    centers = {image.name: np.array(image.projection_center()) for image in found.images.values()}
    own = {f"{sample.index:04d}.png": sample.camera.center for sample in dataset}
    there = np.array([centers[name] for name in sorted(centers)])
    true = np.array([own[name] for name in sorted(centers)])
    a, b = there - there.mean(axis=0), true - true.mean(axis=0)
    left, scales, right = np.linalg.svd(b.T @ a / len(a))
    mirror = np.diag([1, 1, np.sign(np.linalg.det(left @ right))])
    scale = np.trace(np.diag(scales) @ mirror) / (a**2).sum(axis=1).mean()
    apart = np.linalg.norm(b - scale * a @ (left @ mirror @ right).T, axis=1)
    ate = float(np.sqrt((apart**2).mean()))
    return {
        "pictures": len(dataset),
        "registered": len(centers),
        "ate_m": ate,
        "ate_share": ate / DISTANCE,
        "points": found.num_points3D(),
        "reprojection_px": float(found.compute_mean_reprojection_error()),
    }


def main() -> None:
    """Write the boxes, render them, reconstruct them, and say how well."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("out", type=Path)
    options.add_argument("--views", type=int, default=24)
    asked = options.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    write_boxes(asked.out)
    vs.generate(recipe(asked.out, asked.views), asked.out / "boxes", workers=2)
    dataset = vs.open(asked.out / "boxes")
    print(json.dumps(errors(dataset, reconstructed(dataset, asked.out / "colmap")), indent=1))


if __name__ == "__main__":
    main()
