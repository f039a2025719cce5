"""Sequences give the same bytes however they are cut into shots, by any number of workers, killed and taken up again."""

import hashlib
import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from contextlib import suppress

import pytest

import viewsphere as vs
from deadline import DEADLINE, until
from sequence_recipe import CHANNELS, eventful_recipe
from small import tree_hash
from viewsphere.check import check

FRAMES = 20

RUNS = ((1, 3, 1), (7, 1, 2), (FRAMES, 2, 1))
"""Most instants of a shot, numbers of workers, and how often the run is killed."""


def contents(root) -> dict[tuple[str, int, str], str]:
    """A digest of each sample: what is recorded of it, and the bytes of all its files; one of all models and exports."""
    dataset, found = vs.open(root), {}
    for sample in dataset:
        digest = hashlib.sha256(repr((sample.index, sample.split, sample.time, sample.pose)).encode())
        camera = sample.camera
        digest.update(camera.K.tobytes() + camera.R.tobytes() + camera.t.tobytes())
        for o in sample.objects:
            digest.update(
                repr((o.id, o.key, o.box2d, o.rle, o.visibility, o.truncation, o.world_from_object.tolist())).encode()
            )
        for name in sorted(sample.files):
            digest.update(name.encode() + dataset.path(sample.files[name]).read_bytes())
        found[sample.sequence, sample.instant, sample.sensor] = digest.hexdigest()
    assert len(found) == len(dataset)
    return found | {("", -1, name): tree_hash(root / name) for name in ("native", "coco", "store/models")}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Two sequences of two sensors, each one shot, made in this process; what happens in them does happen."""
    root = tmp_path_factory.mktemp("whole") / "out"
    vs.generate(eventful_recipe(FRAMES, shot_frames=FRAMES), root, workers=0)
    seen, counts = Counter(), Counter()
    for sample in vs.open(root):
        counts[sample.sequence, len(sample.objects)] += 1
        for name in ("flow_state", "flow_backward_state", "disparity_state"):
            seen.update((name, int(state)) for state in set(sample.channels[name].ravel().tolist()))
        seen.update(("tracks", int(state)) for state in set(sample.channels["tracks"]["state"].tolist()))
    assert len(counts) >= 4  # things enter and leave
    assert all(seen[name, state] > 20 for name in ("flow_state", "disparity_state", "tracks") for state in (0, 1, 2))
    assert seen["flow_state", 4] and seen["tracks", 4]
    return contents(root)


def begun(out) -> set[str]:
    """Names of the folders that shots are written into, each of which is used once."""
    return {path.parts[-3] for path in out.glob("store/writing/*/new/rgb")}


def command(recipe_file, out, workers):
    return [sys.executable, "-m", "viewsphere", "render", str(recipe_file), "-o", str(out), "--workers", str(workers)]


@pytest.mark.slow
@pytest.mark.parametrize(("most", "workers", "kills"), RUNS)
def test_any_cut_by_any_number_of_workers_killed_on_its_way(most, workers, kills, whole, tmp_path):
    file, out, rng = tmp_path / "recipe.yaml", tmp_path / "out", random.Random(100 * most + workers)
    file.write_text(eventful_recipe(FRAMES, shot_frames=most).to_yaml())
    killed = 0
    for _ in range(kills):
        before = begun(out)
        run = subprocess.Popen(
            command(file, out, workers), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
        )
        assert until(lambda run=run, before=before: run.poll() is not None or begun(out) - before)
        time.sleep(rng.uniform(0, 0.5))
        killed += run.poll() is None
        with suppress(ProcessLookupError):
            os.killpg(run.pid, signal.SIGKILL)
        run.wait(timeout=DEADLINE)
    assert killed, "it was done before it was killed"
    subprocess.run(command(file, out, workers), check=True, timeout=DEADLINE, capture_output=True)
    shots = len(list((out / "store/shots").rglob("shot.json")))
    assert shots == 2 * -(-FRAMES // most)
    assert contents(out) == whole


@pytest.mark.slow
def test_a_short_sequence_is_the_same_in_pieces(tmp_path):
    """The same in little, and all its proofs."""
    found = []
    for most in (2, 5):
        vs.generate(eventful_recipe(5, shot_frames=most), tmp_path / str(most), workers=0)
        found.append(contents(tmp_path / str(most)))
    assert found[0] == found[1]
    dataset = vs.open(tmp_path / "2")
    assert {name for sample in dataset for name in sample.files} >= {*CHANNELS, "tracks"}
    report = check(dataset, sample=None)
    assert report.ok, report.findings
