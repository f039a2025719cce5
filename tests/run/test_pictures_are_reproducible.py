"""One recipe that uses everything pictures are made of: the same bytes by any number of workers, the same labels whatever
is done to the pictures.
"""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from deadline import DEADLINE
from pictures import photograph, write
from small import small_recipe, tree_hash
from viewsphere.run.generate import generate

NUMBERS = {"uniform": [0.0, 0.4]}
LABELS = ["instances", "depth", "normals", "parts"]


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    """Two skies with a bright spot, two photographs, and a ground with its normals."""
    folder = tmp_path_factory.mktemp("pictures")
    rng = np.random.default_rng(3)
    (folder / "skies").mkdir()
    for name in ("a", "b"):
        rgbe = rng.integers(60, 200, (32, 64, 4), np.uint8)
        rgbe[..., 3] = 128
        rgbe[8, 20, 3] = 136
        (folder / "skies" / f"{name}.hdr").write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 32 +X 64\n" + rgbe.tobytes())
    (folder / "photos").mkdir()
    for name, size in (("a", (160, 120)), ("b", (90, 200))):
        write(folder / "photos" / f"{name}.png", photograph(*size))
    write(folder / "stone.png", photograph(64, 64))
    write(folder / "stone_normal.png", np.full((16, 16, 3), (140, 120, 250), np.uint8))
    return folder


def scene(folder, **changes):
    lamps = [
        {"kind": "point", "position": [[-1, 1], 1, 1], "strength": [0.2, 1], "radius": 0.1, "count": {"uniform": [1, 3]}},
        {"kind": "spot", "position": [1, -1, 1], "strength": 2, "angle_deg": [30, 60], "blend": 0.3},
        {"kind": "area", "position": [-1, -1, 1], "strength": 2, "size": [0.5, 0.3], "color": {"uniform": ["orange", "white"]}},
        {"kind": "hemisphere", "strength": 0.1, "below": "#403020"},
    ]
    values = {
        "sun": {"azimuth": [0, 360], "elevation": {"normal": {"mean": 40, "deviation": 10, "min": 10}}, "angle_deg": 2},
        "sky": {"hdri": str(folder / "skies"), "strength": {"log_uniform": [0.3, 1]}, "rotation_deg": [0, 360]},
        "lights": lamps,
        "ground": {
            "choice": [
                {"image": str(folder / "stone.png"), "normal_image": str(folder / "stone_normal.png"), "tile": [0.2, 1]},
                {"catcher": True, "labels": True},
            ]
        },
        "materials": [{"material": "*", "tint": {"uniform": ["#606060", "white"]}, "roughness": [0.1, 0.9]}],
        "background": {"images": str(folder / "photos"), "fit": "crop", "zoom": [1, 2], "flip": {"choice": [True, False]}},
        "smoother": {"kind": {"choice": ["none", "box", "gaussian", "poisson"]}, "size": [1, 2]},
        "view": {"exposure": {"normal": [0, 0.3]}, "temperature_k": [4500, 8000], "transform": {"choice": ["agx", "filmic"]}},
        "effects": {
            **{
                name: NUMBERS
                for name in (
                    "blur", "motion_blur", "depth_of_field", "vignetting", "chromatic_aberration", "brightness", "contrast",
                    "saturation", "hue", "edge_highlight", "shot_noise", "read_noise", "jpeg",
                )
            },
            "motion_angle_deg": [0, 360],
        },
        "jitter": {"azimuth": {"normal": [0, 3]}, "distance": [-0.1, 0.1]},
    }  # fmt: skip
    return {**values, **changes}


def recipe(folder, **changes):
    camera = {
        "size": [96, 72],
        "fov_deg": 60,
        "distortion": {"model": "brown_conrady", "coefficients": [-0.1, 0.02, 0.001, 0.0]},
    }
    values = {"camera": camera, "channels": ["rgb", *LABELS], "formats": ["native"], "shot_frames": 1}
    return small_recipe(**{**values, "scene": scene(folder), "engine": {"name": "raster"}, **changes})


@pytest.fixture(scope="module")
def whole(pictures, tmp_path_factory):
    """By this process alone."""
    out = tmp_path_factory.mktemp("whole") / "out"
    generate(recipe(pictures), out)
    return out


@pytest.mark.slow
def test_workers_make_the_same_pictures_as_one_process(pictures, whole, tmp_path):
    file = tmp_path / "recipe.yaml"
    file.write_text(recipe(pictures).to_yaml())
    command = [sys.executable, "-m", "viewsphere", "render", str(file), "-o", str(tmp_path / "out"), "--workers", "2"]
    subprocess.run(command, check=True, timeout=DEADLINE, capture_output=True)
    assert tree_hash(tmp_path / "out") == tree_hash(whole)


@pytest.mark.slow
def test_frames_come_out_alike_in_any_order(pictures):
    """Each frame, made after others and first of all in a fresh stage."""
    from viewsphere.planning.plan import plan
    from viewsphere.run.shots.stages import Stages

    forwards, backwards = Stages(), Stages()
    shots = list(plan(recipe(pictures)).shots(forwards.box))
    first = {shot.key: next(iter(forwards.render(shot))) for shot in shots}
    for shot in reversed(shots):
        again = next(iter(backwards.render(shot)))
        assert again.rgb.tobytes() == first[shot.key].rgb.tobytes()
    assert len({sample.rgb.tobytes() for sample in first.values()}) == len(shots)


@pytest.mark.slow
def test_labels_know_nothing_of_what_is_done_to_pictures(pictures):
    """Light, materials, background, view, smoother and effects change the pictures; no label changes by a bit."""
    from viewsphere.planning.plan import plan
    from viewsphere.run.shots.stages import Stages

    plain = {"jitter": scene(pictures)["jitter"], "ground": True}
    made = {}
    for name, values in (("plain", plain), ("all", scene(pictures))):
        stages = Stages()
        shots = list(plan(recipe(pictures, scene=values)).shots(stages.box))
        made[name] = [sample for shot in shots for sample in stages.render(shot)]
    assert len(made["plain"]) == len(made["all"]) == 12
    for a, b in zip(made["plain"], made["all"], strict=True):
        assert a.rgb.tobytes() != b.rgb.tobytes()
        assert a.camera.center.tobytes() == b.camera.center.tobytes()
        for label in LABELS:
            assert getattr(a, label).tobytes() == getattr(b, label).tobytes(), label
