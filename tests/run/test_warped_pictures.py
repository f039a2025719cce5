"""Pictures of a stereo rig before things that move, warped by their own flow and disparity, from recipe to opened data set.

All surfaces show a smooth picture without light, so that one point has one colour in all pictures.
"""

import numpy as np
import pytest

import viewsphere as vs
from unlit import write_unlit
from viewsphere.check import check
from viewsphere.engines.shared.arranged import Arrangements
from viewsphere.run.shots.stages import Stages
from viewsphere.truth.shot_views import ShotViews
from viewsphere.truth.surface_points.points import points_seen

CHANNELS = [
    "rgb", "depth", "flow", "flow_backward", "flow_state", "flow_backward_state", "disparity", "disparity_change",
    "disparity_state", "scene_flow", "scene_flow_backward",
]  # fmt: skip
BASELINE = 0.15
FRAMES = 5


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A box that turns and passes before a wall, on a floor; the rig goes around them with an unsteady hand."""
    folder = tmp_path_factory.mktemp("unlit")
    write_unlit(folder / "hall.glb", ((-8, -8, -0.2), (8, 8, 0)), ((-8, 3, 0), (8, 3.2, 5)), ((-3, 1.5, 0), (-2, 2, 3)), seed=1)
    write_unlit(folder / "box.glb", ((-0.5, -0.4, 0), (0.5, 0.4, 1.2)), seed=2)
    said = {
        "models": [{"source": "box.glb", "category": "box", "motion": [
            {"kind": "constant", "velocity": [0.5, 0.2, 0.1], "spin_deg": [0, 0, 25]},
            {"kind": "oscillate", "rotation_deg": [5, 0, 0], "period": 2},
        ]}],
        "viewpoints": {"kind": "orbit", "azimuth": [-10, 5], "elevation": [14, 20], "distance": [5, 4.5],
                       "shake": {"degrees": 0.3, "mm": 5}},
        "rig": {"kind": "stereo", "baseline": BASELINE},
        "time": {"frames": FRAMES, "fps": 8},
        "scene": {"place": {"source": "hall.glb"}, "background": {"color": [0.2, 0.2, 0.2]}},
        "camera": {"size": [320, 240], "fov_deg": 55},
        "channels": CHANNELS,
        "splits": {"by": "sequence"},
        "formats": [],
    }  # fmt: skip
    recipe = vs.Recipe.model_validate(said, context={"folder": folder})
    vs.generate(recipe, folder / "out", workers=0)
    return recipe, vs.open(folder / "out")


def by_name(dataset):
    return {(sample.sensor, sample.instant): sample for sample in dataset}


def centers(sample):
    x, y = np.meshgrid(np.arange(sample.width) + 0.5, np.arange(sample.height) + 0.5)
    return np.stack((x, y), axis=-1)


def bilinear(picture, xy):
    """A picture (H, W, n) at positions (N, 2), pixels whose centres are at halves, none beyond the outermost centres."""
    height, width = picture.shape[:2]
    x, y = np.clip(xy[:, 0] - 0.5, 0, width - 1), np.clip(xy[:, 1] - 0.5, 0, height - 1)
    i, j = np.minimum(x.astype(int), width - 2), np.minimum(y.astype(int), height - 2)
    u, v = (x - i)[:, None], (y - j)[:, None]
    upper = (1 - u) * picture[j, i] + u * picture[j, i + 1]
    return (1 - v) * upper + v * ((1 - u) * picture[j + 1, i] + u * picture[j + 1, i + 1])


def error(here, there, xy, state):
    """Mean difference of the visible pixels' colours from those of the other picture, as a share of the range."""
    seen = state == 0
    assert seen.mean() > 0.6
    found = bilinear(there.rgb.astype(float), xy[seen])
    return np.abs(found - here.rgb[seen]).mean() / 255


@pytest.mark.slow
def test_the_next_and_the_last_picture_warped_by_flow_are_this_one(made):
    samples, errors, still = by_name(made[1]), [], []
    for sensor in ("left", "right"):
        for i in range(FRAMES - 1):
            a, b = samples[sensor, i], samples[sensor, i + 1]
            errors.append(error(a, b, centers(a) + a.flow, a.flow_state))
            errors.append(error(b, a, centers(b) + b.flow_backward, b.flow_backward_state))
            still.append(error(a, b, centers(a), a.flow_state))
            assert np.nanmax(np.abs(a.flow)) > 10
    print(f"warped by flow: {100 * max(errors):.3f} % of the range at most, unwarped {100 * min(still):.1f} % at least")
    assert max(errors) < 0.01 and min(still) > 0.05


@pytest.mark.slow
def test_the_right_picture_warped_by_disparity_is_the_left_one(made):
    samples, errors = by_name(made[1]), []
    for i in range(FRAMES):
        left, right = samples["left", i], samples["right", i]
        shift = np.zeros((*left.depth.shape, 2))
        shift[..., 0] = left.disparity
        errors.append(error(left, right, centers(left) - shift, left.disparity_state))
        shift[..., 0] = right.disparity
        errors.append(error(right, left, centers(right) + shift, right.disparity_state))
    print(f"warped by disparity: {100 * max(errors):.3f} % of the range at most")
    assert max(errors) < 0.01


def test_disparity_times_depth_is_focal_length_times_baseline_to_float_precision(made):
    for sample in made[1]:
        product = sample.disparity.astype(float) * sample.depth.astype(float)
        seen = sample.depth > 0
        assert seen.mean() > 0.7
        np.testing.assert_allclose(product[seen], sample.camera.intrinsics.fx * BASELINE, rtol=2.5e-7)


@pytest.fixture(scope="module")
def views(made):
    stages = Stages()
    shot = vs.plan(made[0]).shot(0, stages.box)
    assert len(shot.instants) == FRAMES
    arranged = Arrangements.build(shot, stages.model)
    return ShotViews(shot, lambda i: arranged.at(i).geometry)


def returned(here, there, xy):
    """From where points at `xy` (N, 2) in the other view come in this one, by its geometry."""
    return points_seen(there, xy).in_view(here).xy


def test_forward_and_backward_flow_agree(made, views):
    """|f(p) + b(p + f(p))|, f as it is stored, b of exactly this position."""
    samples, worst, least = by_name(made[1]), [], []
    for number, sensor in enumerate(("left", "right")):
        for i in range(FRAMES - 1):
            a = samples[sensor, i]
            seen = a.flow_state == 0
            at = centers(a)[seen]
            back = returned(views.view(i, number), views.view(i + 1, number), at + a.flow[seen])
            off = np.abs(back - at).max(axis=1)
            least.append((off <= 0.01).mean())
            worst.append(np.quantile(off, 0.999))
    print(f"forward and backward: within 0.01 px of {100 * min(least):.3f} % of the visible pixels; 99.9 % {max(worst):.1e} px")
    assert min(least) > 0.9995 and max(worst) < 0.01


def test_left_and_right_agree(made, views):
    samples = by_name(made[1])
    for i in range(FRAMES):
        left, right = views.view(i, 0), views.view(i, 1)
        for a, here, there, sign in ((samples["left", i], left, right, -1), (samples["right", i], right, left, 1)):
            seen = a.disparity_state == 0
            at = centers(a)[seen]
            to = at + np.column_stack((sign * a.disparity[seen].astype(float), np.zeros(len(at))))
            off = np.abs(returned(here, there, to) - at).max(axis=1)
            assert (off <= 0.01).mean() > 0.9995 and np.median(off) < 1e-4


def test_scene_flow_and_change_of_disparity_are_those_of_the_flow(made):
    """Where flow ends, depth there is this depth and the scene flow's; disparity likewise."""
    for a in made[1]:
        if a.instant == FRAMES - 1:
            assert np.isnan(a.scene_flow).all() and np.isnan(a.disparity_change).all()
            continue
        k = a.camera.intrinsics
        seen = np.isfinite(a.flow).all(axis=-1) & np.isfinite(a.depth) & (a.depth > 0)
        to = (centers(a) + a.flow)[seen]
        z = a.depth[seen] + a.scene_flow[seen][:, 2].astype(float)
        x = (centers(a)[seen] - (k.cx, k.cy)) / (k.fx, k.fy) * a.depth[seen][:, None] + a.scene_flow[seen][:, :2]
        np.testing.assert_allclose(x / z[:, None] * (k.fx, k.fy) + (k.cx, k.cy), to, atol=2e-3)
        np.testing.assert_allclose((a.disparity + a.disparity_change)[seen], k.fx * BASELINE / z, atol=1e-4)


@pytest.mark.slow
def test_all_proofs_of_the_data_set_hold(made):
    report = check(made[1], sample=None)
    assert report.ok, report.findings
