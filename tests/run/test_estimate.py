"""What a plan says a data set will cost: the arithmetic, and the bytes of a real one."""

import itertools
import json
import re
import subprocess
import sys

import pytest

from command_line import viewsphere
from small import ROOT, small_recipe
from viewsphere.cli.terminal import print_estimate
from viewsphere.errors import ModelError
from viewsphere.planning.plan import plan
from viewsphere.run.estimate import Estimate, Rates, disk_bytes, estimate, extrapolate, measure
from viewsphere.run.generate import generate

RATES = Rates(model=2.0, scene=3.0, frame=0.5, export=0.25, model_bytes=1e6, frame_bytes=1e5)


def test_seconds_and_bytes_follow_from_the_counts():
    planned = plan(small_recipe())  # 2 models x 6 poses = 12 frames
    one, four = (extrapolate(planned, RATES, workers) for workers in (0, 4))
    assert (one.seconds, one.bytes, one.workers) == (2 * 2 + 2 * 3 + 12 * 0.5 + 12 * 0.25, 2e6 + 12e5, 1)
    assert (four.seconds, four.bytes, four.workers) == ((2 * 2 + 4 * 3 + 12 * 0.5) / 4 + 12 * 0.25, one.bytes, 4)


def test_scenes_drawn_for_each_frame_are_built_for_each():
    scene = {"company": {"count": 1, "draw": "per_frame"}}
    planned = plan(small_recipe(scene=scene, splits={"by": "frame"}))
    assert extrapolate(planned, RATES, 1).seconds == 2 * 2 + 12 * 3 + 12 * 0.5 + 12 * 0.25


@pytest.mark.slow
def test_each_piece_of_work_is_timed_once():
    """By a clock that counts how often it is looked at, a model, a scene, two frames and all exports take one second each."""
    recipe = small_recipe(viewpoints={"azimuth": {"start": 0, "stop": 345, "step": 15}, "distance": 1.0})
    rates = measure(recipe, itertools.count().__next__)
    frames = 2 * 4 * 2  # models x shots x frames
    assert rates.model == 1
    assert rates.frame == 0.5
    assert rates.scene == pytest.approx((frames / 2 - frames / 2 * 0.5) / 2)  # eight first frames, less what they take warm
    assert rates.export == pytest.approx(1 / frames)


@pytest.mark.slow
def test_the_bytes_are_those_of_a_real_run(tmp_path):
    recipe = small_recipe(viewpoints={"azimuth": [0, 60, 120, 180, 240, 300], "elevation": [0, 45], "distance": [0.8, 1.2]})
    expected = estimate(recipe).bytes
    generate(recipe, tmp_path / "ds")
    folders = [tmp_path / "ds" / name for name in ("store", "native", "coco")]
    assert expected == pytest.approx(disk_bytes(folders), rel=0.25)


@pytest.mark.slow
def test_the_command_says_it_in_one_line(tmp_path):
    (tmp_path / "recipe.yaml").write_text(
        "models: [{source: zoo:post_box}]\nviewpoints: {azimuth: [0, 90], distance: 1}\n"
        "camera: {size: [64, 48], fov_deg: 35}\nsplits: {by: frame}\n"
    )
    arguments = ["plan", str(tmp_path / "recipe.yaml"), "--estimate", "--workers", "2"]
    lines = viewsphere(*arguments).stdout.splitlines()
    assert lines[0].startswith("dataset: 1 model x 2 poses = 2 frames")
    assert re.fullmatch(r"about \d+ s with 2 workers, \d+ MB on disk", lines[-1])
    printed = json.loads(viewsphere(*arguments, "--json").stdout)["estimate"]
    assert printed.keys() == {"seconds", "bytes", "workers", "unused"} and printed["workers"] == 2


@pytest.mark.slow
def test_a_plan_without_an_estimate_touches_no_model():
    recipe = ROOT / "recipes" / "car_poses.yaml"
    code = "import sys; from viewsphere.cli.commands import app; app(['plan', sys.argv[1]], standalone_mode=False)\n"
    code += "assert not {'numba', 'trimesh', 'viewsphere.run.shots.stages', 'viewsphere_zoo.families.car'} & sys.modules.keys()"
    run = subprocess.run([sys.executable, "-c", code, recipe], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert run.stdout.startswith("car_poses: 100 models x 2,736 poses = 273,600 frames")


@pytest.mark.parametrize(
    ("seconds", "said"),
    [(0.2, "1 s"), (89, "89 s"), (90, "2 min"), (3600, "1 h 0 min"), (22_800, "6 h 20 min"), (273_600, "3 d 4 h")],
)
def test_times_are_said_in_two_units_at_most(seconds, said, capsys):
    print_estimate(Estimate(seconds, 45e9, 1))
    assert capsys.readouterr().out == f"about {said} with 1 worker, 45 GB on disk\n"


def test_a_hard_link_takes_no_room_and_a_file_takes_whole_blocks(tmp_path):
    (tmp_path / "a").write_bytes(b"1")
    (tmp_path / "b").hardlink_to(tmp_path / "a")
    (tmp_path / "c").write_bytes(bytes(4097))
    assert disk_bytes([tmp_path]) == 3 * 4096


def test_a_model_that_cannot_be_used_is_named(tmp_path):
    (tmp_path / "bad.obj").write_text("nothing")
    with pytest.raises(ModelError, match=r"bad\.obj"):
        estimate(small_recipe(models=[{"source": str(tmp_path / "bad.obj"), "category": "block"}]))
