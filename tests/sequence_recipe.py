"""A small recipe of sequences in which everything happens that may depend on how they are cut."""

from __future__ import annotations

from viewsphere import Recipe

CHANNELS = (
    "rgb", "depth", "instances", "normals", "flow", "flow_backward", "flow_state", "flow_backward_state", "scene_flow",
    "scene_flow_backward", "disparity", "disparity_change", "disparity_state", "motion_boundaries",
)  # fmt: skip


def eventful_recipe(frames: int = 100, **changes) -> Recipe:
    """A stereo rig that shakes goes around a post box that enters, rests, tips over and leaves, with a chair that drifts
    about; then around a chair that swings, with such a box.

    Lights, company, speeds and points are drawn at random.
    """
    third = frames / 30
    keys = [
        {"time": 0, "position": [-0.4, 0, 0]},
        {"time": third, "position": [0, 0, 0]},
        {"time": 2 * third, "position": [0, 0, 0]},  # it rests in between
        {"time": 3 * third, "position": [0.3, 0.1, 0], "rotation_deg": [40, 0, 20]},
    ]
    said = {
        "name": "eventful",
        "seed": 5,
        "models": [
            {"source": "zoo:post_box", "category": "post box", "scale": {"length": 0.4}, "motion": [
                {"kind": "keyframes", "keys": keys, "enter": 0.31, "leave": 2.8 * third},
                {"kind": "constant", "velocity": [{"uniform": [-0.02, 0.02]}, 0, 0]},
            ]},
            {"source": "zoo:chair", "category": "chair", "scale": {"length": 0.4}, "motion":
                {"kind": "oscillate", "position": [0.3, 0, 0], "period": {"uniform": [1, 3]}, "leave": 2.8 * third}},
        ],
        "viewpoints": {"kind": "orbit", "azimuth": [0, 60], "elevation": [18, 30], "distance": [3, 2.6],
                       "shake": {"degrees": 0.4, "mm": 6}},
        "rig": {"kind": "stereo", "baseline": 0.1},
        "time": {"frames": frames, "fps": 10},
        "tracks": {"count": 12, "on": "all", "at": [0, frames // 4, frames // 2, frames - 1]},
        "scene": {
            "ground": True,
            "sun": {"azimuth": {"uniform": [0, 360]}, "elevation": {"uniform": [30, 60]}},
            "company": {"count": 1, "draw": "per_sequence",
                        "motion": {"kind": "random", "position": [0.2, 0.2, 0], "rotation_deg": [0, 0, 30], "highest_hz": 1}},
        },
        "camera": {"size": [64, 48], "fov_deg": 50},
        "channels": CHANNELS,
        "splits": {"by": "sequence", "train": 1.0, "val": 0.0},
        "formats": ["native", "coco"],
    }  # fmt: skip
    return Recipe.model_validate({**said, **changes})
