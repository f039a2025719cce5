"""Flow of animated files against Cycles' own motion vectors, which Blender computes from the files."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

import viewsphere as vs
from deadline import DEADLINE

FRAMES = 5
WORKER = Path(__file__).with_name("render_vectors.py")


def ask(blender, *words):
    done = subprocess.run([blender, str(WORKER), *map(str, words)], capture_output=True, text=True, timeout=DEADLINE)
    assert done.returncode == 0, done.stderr[-4000:]


@pytest.fixture(scope="module")
def files(blender, tmp_path_factory):
    folder = tmp_path_factory.mktemp("animated")
    ask(blender, "make", folder)
    return folder


def sequence(folder, name):
    """The file's own frames, one an instant, on a thing that drives and turns, before a rig that flies around."""
    said = {
        "models": [{"source": f"{name}.blend", "category": "thing", "centring": "as_is", "motion": [
            {"kind": "constant", "velocity": [1.5, 0, 0.5], "spin_deg": [0, 40, 90]}, {"kind": "clip", "loop": "once"},
        ]}],
        "viewpoints": {"kind": "orbit", "azimuth": [20, 40], "elevation": [35, 30], "distance": [4.5, 4.2]},
        "time": {"frames": FRAMES, "fps": 24},
        "scene": {"background": {"color": [0, 0, 0]}},
        "camera": {"size": [240, 180], "fov_deg": 50},
        "channels": ["depth", "instances", "triangles", "flow", "flow_backward"],
        "splits": {"by": "sequence"},
        "formats": [],
    }  # fmt: skip
    return list(vs.render(vs.Recipe.model_validate(said, context={"folder": folder})))


def seen_from_the_file(sample):
    """The camera in the axes of the file, as Blender's worker takes it."""
    (thing,), camera = sample.objects, sample.camera
    own = np.asarray(thing.camera_from_object)
    center = -own[:3, :3].T @ own[:3, 3]
    return {
        "R": own[:3, :3].tolist(), "center": center.tolist(), "fx": camera.intrinsics.fx,
        "width": camera.intrinsics.width, "height": camera.intrinsics.height,
    }  # fmt: skip


def within_one_triangle(sample):
    """Pixels whose neighbours show the same triangle: a ray beside the centre meets the same one."""
    number = sample.triangles
    same = sample.instances > 0
    same[[0, -1]] = same[:, [0, -1]] = False
    for axis in (0, 1):
        for step in (-1, 1):
            same &= np.roll(number, step, axis) == number
    return same


@pytest.mark.parametrize("name", ["turn", "bend", "wave"])
def test_cycles_finds_the_same_vectors(name, files, blender, tmp_path):
    samples = sequence(files, name)
    (tmp_path / "cameras.json").write_text(json.dumps({i + 1: seen_from_the_file(s) for i, s in enumerate(samples)}))
    ask(blender, "render", files / f"{name}.blend", tmp_path / "cameras.json", tmp_path / "vectors.npz")
    found, worst, longest, compared = np.load(tmp_path / "vectors.npz"), 0.0, 0.0, 0
    for i, sample in enumerate(samples):
        vector, depth = found[f"vector{i + 1}"], found[f"depth{i + 1}"]
        inside = within_one_triangle(sample)
        assert (np.isfinite(sample.depth) & (sample.instances > 0) == (depth < 1e6)).mean() > 0.999
        np.testing.assert_allclose(depth[inside], sample.depth[inside], rtol=2e-4)  # rays up to 0.005 px beside the centre
        theirs = {"flow": vector[..., 2:] * (-1, 1), "flow_backward": vector[..., :2] * (1, -1)}
        for which, last in (("flow", FRAMES - 1), ("flow_backward", 0)):
            if i == last:
                continue
            ours = sample.channels[which][inside]
            assert np.isfinite(ours).all()
            worst = max(worst, np.abs(theirs[which][inside] - ours).max())
            longest, compared = max(longest, np.abs(ours).max()), compared + len(ours)
    print(f"{name}: {compared:,} vectors up to {longest:.1f} px differ from Cycles' by {worst:.1e} px at most")
    assert compared > 5_000 and longest > 5
    assert worst <= 0.01
