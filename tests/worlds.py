"""Data sets that formats are written of in tests: rendered once for all processes of a test run, with all that formats need."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from filelock import FileLock

CHANNELS = [
    "rgb", "depth", "depth_ray", "instances", "normals", "categories", "semantic", "panoptic", "nocs", "coordinates", "parts",
]  # fmt: skip
ANNOTATIONS = ["amodal", "occluders", "occlusion_level", "truncation_level", "obb", "keypoints", "canonical_pose", "captions"]
MOVING = ["flow", "flow_backward", "flow_state", "flow_backward_state", "scene_flow", "motion_boundaries"]
STEREO = ["disparity", "disparity_state", "disparity_change"]
MODELS = [
    {"source": "zoo:car", "count": 2, "category": "car", "supercategory": "vehicle", "scale": {"length": 1.8}},
    {"source": "zoo:chair", "count": 1, "category": "chair", "supercategory": "furniture"},
    {"source": "zoo:post_box", "count": 1, "category": "post_box", "supercategory": "street", "scale": {"length": 0.5}},
]


def stills(**changes):
    """Eight pictures of four scenes of two to four objects that hide one another, in three splits."""
    from viewsphere import Recipe

    said = {
        "name": "stills",
        "seed": 3,
        "models": MODELS,
        "scenes": {"count": 4, "objects": [2, 4], "layout": "scatter"},
        "viewpoints": {"azimuth": [30, 200], "elevation": [15], "distance": 3.5},
        "camera": {"size": [160, 120], "fov_deg": 50},
        "scene": {"ground": True},
        "engine": {"name": "raster", "ambient_occlusion": "off"},
        "channels": CHANNELS,
        "annotations": ANNOTATIONS,
        "splits": {"by": "scene", "train": 0.5, "val": 0.3, "test": 0.2},
        "formats": [],
    }
    return Recipe.model_validate({**said, **changes})


def poses(**changes):
    """Nine pictures, three sides of three models one at a time: the paper's grid."""
    said = {"name": "poses", "viewpoints": {"azimuth": [0, 100, 200], "elevation": [20], "distance": 2.5},
            "splits": {"by": "model", "train": 0.7, "val": 0.3}}  # fmt: skip
    return stills(**{**said, "scenes": None, "models": [{**model, "count": 1} for model in MODELS], **changes})


def videos(**changes):
    """Two sequences of six instants, a stereo rig, `left` and `right`, on an orbit around models of which one moves."""
    said = {
        "name": "videos",
        "models": [{**MODELS[0], "count": 1, "motion": {"kind": "constant", "velocity": [0.3, 0.1, 0]}}, MODELS[1]],
        "scenes": None,
        "viewpoints": {"kind": "orbit", "azimuth": [20, 50], "elevation": [18, 24], "distance": [3.5, 3.2]},
        "rig": {"kind": "stereo", "baseline": 0.1},
        "time": {"frames": 6, "fps": 10},
        "scene": {"ground": True, "company": {"count": 1, "draw": "per_sequence"}},
        "channels": [*CHANNELS, *MOVING, *STEREO, "tracks"],
        "tracks": {"count": 24, "on": "all", "at": [0, 3]},
        "annotations": [*ANNOTATIONS, "velocity", "ego_motion", "sensor_poses"],
        "splits": {"by": "sequence", "train": 0.5, "val": 0.5},
    }
    return stills(**{**said, **changes})


def drives(**changes):
    """Two sequences of five instants of a rig on a car's roof: cameras `left` and `right`, and a LiDAR `top`."""
    sensors = {
        "left": {},
        "right": {"position": [0.1, 0, 0]},
        "top": {"position": [0, -0.2, 0], "channels": ["lidar", "instances"], "lidar": {
            "rings": 16, "elevation": [-25, 5], "azimuth": [-60, 60], "azimuth_step": 1, "range": [0.5, 20]}},
    }  # fmt: skip
    said = {"name": "drives", "time": {"frames": 5, "fps": 10}, "rig": {"sensors": sensors},
            "channels": [*CHANNELS, *MOVING, *STEREO, "lidar"], "tracks": None}  # fmt: skip
    return videos(**{**said, **changes})


WORLDS = {world.__name__: world for world in (stills, poses, videos, drives)}


def rendered(name: str, place: Path) -> Path:
    """The folder of a world's data set, below a place that all processes of a test run share; do not change it."""
    from viewsphere import generate

    out = place / name
    with FileLock(f"{out}.lock"):
        if not (out / "store" / "plan.json").is_file() or not (out / ".whole").is_file():
            generate(WORLDS[name](), out, workers=0)
            (out / ".whole").touch()
    return out


def shared_place(tmp_path_factory) -> Path:
    """A folder that all processes of a test run have."""
    own = tmp_path_factory.getbasetemp()
    return own.parent if os.environ.get("PYTEST_XDIST_WORKER") else own


if __name__ == "__main__":
    for name in WORLDS:
        print(rendered(name, Path(tempfile.gettempdir())))
