"""A camera is calibrated from rendered chessboards: OpenCV finds the lens that took the pictures.

    pip install viewsphere opencv-python-headless
    python examples/calibration.py OUT [--views 160]

1. A chessboard is written as a model, with its inner corners as keypoints.
2. It is rendered from random sides by a camera with a distorted lens, and by a rectified stereo rig.
3. `cv2.findChessboardCornersSB` finds the corners in the pictures, `cv2.calibrateCamera` the lens, `cv2.stereoCalibrate` the
   rig, and `cv2.solvePnP`, from the labelled keypoints, the board's pose.

OpenCV counts pixels from the first one's centre, viewsphere from its corner: half a pixel is added to what OpenCV finds.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import trimesh
import yaml
from PIL import Image

import viewsphere as vs

COLUMNS, ROWS, SIDE, TEXELS = 10, 7, 0.03, 16
"""Squares of the board, their sides in metres, and their texels: fewer than pixels, so that edges are ramps without steps, as
through a real lens, whose places OpenCV finds twice as well.
"""

SIZE, FOV_DEG = (1280, 960), 50.0
LENS = (-0.12, 0.06, 0.001, -0.0008)
"""k1, k2, p1, p2 of the distorted camera."""

BASELINE = 0.08
BLUR, WINDOW = 1.5, (19, 19)
"""Pixels by which pictures are smoothed before corners are refined, which takes a third of their error; and half of the
window that a corner is refined in: less than a square that stands aslant.
"""

HALF = 0.5
"""Pixels from a pixel's corner to its centre."""


def corners() -> np.ndarray:
    """The inner corners in the model's axes, (N, 3) metres: row by row from the top left as seen from the front (-Y)."""
    x = (np.arange(1, COLUMNS) - COLUMNS / 2) * SIDE
    z = (ROWS / 2 - np.arange(1, ROWS)) * SIDE
    grid = np.stack(np.meshgrid(x, z), axis=-1).reshape(-1, 2)
    return np.column_stack([grid[:, 0], np.zeros(len(grid)), grid[:, 1]])


def planar() -> np.ndarray:
    """The inner corners as OpenCV wants those of a flat board, (N, 3) float32 with z = 0: x right, y down."""
    x, y, z = corners().T
    return np.column_stack([x, -z, y]).astype(np.float32)


def write_board(folder: Path) -> None:
    """The board as a GLB file, a picture on a card with a white rim of one square, and its corners in a sidecar."""
    rows, columns = np.mgrid[-1 : ROWS + 1, -1 : COLUMNS + 1]
    is_dark = (rows >= 0) & (rows < ROWS) & (columns >= 0) & (columns < COLUMNS) & ((rows + columns) % 2 == 0)
    pixels = np.where(is_dark, 20, 235).astype(np.uint8).repeat(TEXELS, axis=0).repeat(TEXELS, axis=1)
    x, z = (COLUMNS / 2 + 1) * SIDE, (ROWS / 2 + 1) * SIDE
    y_up = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])  # glTF's axes from ours
    vertices = np.array([(-x, 0, z), (x, 0, z), (x, 0, -z), (-x, 0, -z)]) @ y_up.T
    material = trimesh.visual.material.PBRMaterial(
        baseColorTexture=Image.fromarray(pixels), roughnessFactor=1.0, metallicFactor=0.0
    )
    visual = trimesh.visual.TextureVisuals(uv=[(0, 1), (1, 1), (1, 0), (0, 0)], material=material)
    board = trimesh.Trimesh(vertices, [(0, 2, 1), (0, 3, 2)], visual=visual, process=False)
    (folder / "board.glb").write_bytes(board.export(file_type="glb"))
    points = {f"corner_{i}": [round(float(v), 6) for v in place] for i, place in enumerate(corners() @ y_up.T)}
    sidecar = {"axes": "file", "keypoints": {"points": points}}
    (folder / "board.glb.viewsphere.yaml").write_text(yaml.safe_dump(sidecar, sort_keys=False))


def recipe(folder: Path, views: int, stereo: bool) -> vs.Recipe:
    """Random views of the board."""
    lens = {} if stereo else {"distortion": {"model": "brown_conrady", "coefficients": list(LENS)}}
    said = {
        "name": "stereo" if stereo else "camera",
        "seed": 1,
        "models": [{"source": str(folder / "board.glb"), "category": "board", "scale": "as_is", "forward": "+z"}],
        "viewpoints": {
            "kind": "sphere",
            "count": views,
            "azimuth": [-50, 50],
            "elevation": [-45, 45],
            "distance": [0.5, 0.65],
            "tilt": [-25, 25],
        },
        "scene": {"jitter": {"target": {"uniform": [[-0.04, 0, -0.03], [0.04, 0, 0.03]]}}, "sun": "off"},
        "camera": {"size": list(SIZE), "fov_deg": FOV_DEG, **lens},
        "channels": ["rgb", "instances"],
        "annotations": ["keypoints"],
        "formats": [],
        "splits": {"by": "frame", "train": 1},
    }
    if stereo:
        said["rig"] = {"kind": "stereo", "baseline": BASELINE}
    return vs.Recipe.model_validate(said)


def found_corners(sample) -> np.ndarray | None:
    """The corners in a picture in viewsphere's pixels, (N, 2), in the order of `corners`; None where OpenCV finds no board."""
    grey = cv2.cvtColor(sample.rgb, cv2.COLOR_RGB2GRAY)
    flags = cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_NORMALIZE_IMAGE
    is_found, pixels = cv2.findChessboardCornersSB(grey, (COLUMNS - 1, ROWS - 1), flags=flags)
    if not is_found:
        return None
    smooth = cv2.GaussianBlur(grey, (0, 0), BLUR)
    refined = cv2.cornerSubPix(smooth, pixels.reshape(-1, 1, 2), WINDOW, (-1, -1), (3, 100, 1e-4))
    found = refined.reshape(-1, 2).astype(np.float64) + HALF
    near = sample.objects[0].keypoints
    return found if np.linalg.norm(found[0] - near[0]) < np.linalg.norm(found[0] - near[-1]) else found[::-1]


def centred(K: np.ndarray) -> np.ndarray:
    """A camera matrix as OpenCV has it, of one with its origin in the picture's corner."""
    return K - np.array([[0, 0, HALF], [0, 0, HALF], [0, 0, 0]])


def calibrate(dataset: vs.Dataset) -> dict[str, Any]:
    """How far the lenses that OpenCV finds are from the recipe's: from corners that it finds in the pictures, and from the
    labelled keypoints; and its poses of the board from the labels.
    """
    views = [(sample, pixels) for sample in dataset if (pixels := found_corners(sample)) is not None]
    labelled = [sample.objects[0].keypoints for sample in dataset]
    K = centred(dataset[0].camera.K)
    return {
        "corners_px": float(np.mean([np.linalg.norm(p - s.objects[0].keypoints, axis=1).mean() for s, p in views])),
        "from_pictures": lens_errors([pixels for _, pixels in views], K),
        "from_keypoints": lens_errors(labelled, K),
        "pnp_deg": max(map(pnp_error, dataset)),
    }


def lens_errors(views: list[np.ndarray], true: np.ndarray) -> dict[str, float]:
    """What `cv2.calibrateCamera` finds of these views of the corners, beside the true lens."""
    pixels = [(view - HALF).astype(np.float32) for view in views]
    error, K, lens, _, _ = cv2.calibrateCamera([planar()] * len(views), pixels, SIZE, None, None, flags=cv2.CALIB_FIX_K3)
    return {
        "views": len(views),
        "reprojection_px": float(error),
        "focal_share": float(max(abs(K[0, 0] / true[0, 0] - 1), abs(K[1, 1] / true[1, 1] - 1))),
        "principal_point_px": float(np.abs(K[:2, 2] - true[:2, 2]).max()),
        "distortion_share": distortion_error(true, lens.ravel()[:4]),
    }


def distortion_error(K: np.ndarray, lens: np.ndarray) -> float:
    """The largest distance between what both lenses make of a point, in shares of the largest displacement by the true one."""
    x, y = np.meshgrid(np.linspace(0, SIZE[0], 33), np.linspace(0, SIZE[1], 25))
    rays = np.column_stack([(x.ravel() - K[0, 2]) / K[0, 0], (y.ravel() - K[1, 2]) / K[1, 1], np.ones(x.size)])
    none = np.zeros(3)
    seen = [
        cv2.projectPoints(rays, none, none, K, np.array(one, np.float64))[0].reshape(-1, 2) for one in (LENS, lens, (0,) * 4)
    ]
    displaced = np.linalg.norm(seen[0] - seen[2], axis=1).max()
    return float(np.linalg.norm(seen[0] - seen[1], axis=1).max() / displaced)


def pnp_error(sample) -> float:
    """Degrees between the labelled rotation of the board and the one that `cv2.solvePnP` finds from its keypoints."""
    o = sample.objects[0]
    lens = np.array(sample.camera.distortion.coefficients if sample.camera.distortion else (0, 0, 0, 0), np.float64)
    in_world = np.column_stack([o.keypoints3d, np.ones(len(o.keypoints3d))])
    in_object = (in_world @ np.linalg.inv(o.world_from_object).T)[:, :3]
    _, turned, _ = cv2.solvePnP(
        np.ascontiguousarray(in_object), np.ascontiguousarray(o.keypoints - HALF), centred(sample.camera.K), lens
    )
    between = cv2.Rodrigues(turned)[0].T @ o.camera_from_object[:3, :3]
    return float(np.degrees(np.arccos(np.clip((np.trace(between) - 1) / 2, -1, 1))))


def calibrate_rig(dataset: vs.Dataset) -> dict[str, float]:
    """How far the stereo rig that OpenCV finds in the pictures is from the recipe's."""
    pairs = zip(*(list(sample for sample in dataset if sample.sensor == name) for name in ("left", "right")), strict=True)
    seen = [(found_corners(left), found_corners(right)) for left, right in pairs]
    both = [(left, right) for left, right in seen if left is not None and right is not None]
    left, right = ([(pixels - HALF).astype(np.float32) for pixels in side] for side in zip(*both, strict=True))
    K, none = centred(dataset[0].camera.K), np.zeros(5)
    _, *_, R, T, _, _ = cv2.stereoCalibrate(
        [planar()] * len(both), left, right, K, none, K, none, SIZE, flags=cv2.CALIB_FIX_INTRINSIC
    )
    return {
        "pairs": len(both),
        "baseline_m": float(abs(np.linalg.norm(T) - BASELINE)),
        "rotation_deg": float(np.degrees(np.linalg.norm(cv2.Rodrigues(R)[0]))),
    }


def main() -> None:
    """Write the board, render it, and say what is found."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("out", type=Path)
    options.add_argument("--views", type=int, default=160)
    asked = options.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    write_board(asked.out)
    found = {}
    pairs = max(6, asked.views // 4)
    for name, judge, views in (("camera", calibrate, asked.views), ("stereo", calibrate_rig, pairs)):
        vs.generate(recipe(asked.out, views, name == "stereo"), asked.out / name, workers=2)
        found[name] = judge(vs.open(asked.out / name))
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
