"""A small recipe of sequences: two instances of a post box that slide past one another, seen by a stereo pair."""

from __future__ import annotations


def moving_recipe(**changes):
    """Two sequences of six instants at 12.5 a second, two sensors, 96 x 72 pixels, tracks, flow, states and disparity."""
    from viewsphere import Recipe

    values = {
        "name": "moving",
        "models": [
            {
                "source": "zoo:post_box",
                "category": "post box",
                "count": 2,
                "scale": {"length": 0.18},
                "motion": {"kind": "constant", "velocity": [0.3, 0, 0]},
            }
        ],
        "viewpoints": {"azimuth": 0, "elevation": 15, "distance": 1.2},
        "time": {"frames": 6, "fps": 12.5},
        "rig": {"kind": "stereo", "baseline": 0.05},
        "tracks": {"grid": 12, "at": [0]},
        "camera": {"size": [96, 72], "fov_deg": 45},
        "scene": {"ground": True},
        "channels": ["rgb", "depth", "instances", "flow", "flow_state", "disparity", "motion_boundaries"],
        "splits": {"by": "sequence"},
        "formats": [],
        "shot_frames": 4,
    }
    return Recipe(**{**values, **changes})
