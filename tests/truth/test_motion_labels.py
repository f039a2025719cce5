"""Labels that compare a picture with those of other instants and sensors."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from two_views import brute_points, expected_states, pose, view

from proven import close, equal
from quick import quick
from truth_scenes import FISHEYE, cube, lens, mesh_of, orbit_camera, sphere
from viewsphere.geometry.rotation import rigid
from viewsphere.labels import LabelContext, Partner, channel_labels
from viewsphere.labels.shared.drawing.flow_colors import picture, wheel
from viewsphere.model.fields.files import Files
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.sensors.rig import Rig, Sensor
from viewsphere.store.samples.channel_files import decode, encode
from viewsphere.truth.raster.visibility import rasterize
from viewsphere.truth.view import View

NAMES = (
    "flow", "flow_backward", "scene_flow", "scene_flow_backward", "disparity", "disparity_change", "flow_state",
    "flow_backward_state", "disparity_state", "motion_boundaries",
)  # fmt: skip
AHEAD = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # looks along +Y, Z up
FLOOR = -1.0


def from_own(own, camera):
    """The pose of a camera in the axes of another."""
    return rigid(own.R @ camera.R.T, own.R @ (camera.center - own.center)).tolist()


@dataclass(frozen=True)
class Beside:
    """Views by instant and sensor; None is the picture's own."""

    views: dict[tuple[int, str | None], View]

    @property
    def partner(self):
        own = self.views[0, None].camera
        others = {name: view.camera for (step, name), view in self.views.items() if name and not step}
        mounted = (Sensor(name=n, intrinsics=c.intrinsics, rig_from_sensor=from_own(own, c)) for n, c in others.items())
        return Rig(sensors=(Sensor(name="own", intrinsics=own.intrinsics), *mounted)).partner(0)

    def view(self, instants, sensor):
        return self.views.get((instants, sensor))


def context_of(own, around=None):
    around = around or {}
    views = {(0, None): own} | around
    return LabelContext(own.geometry, own.camera, own.visibility, (), Beside(views))


def observed(context, *names):
    return {name: channel_labels()[name].compute(context) for name in names or NAMES}


def sample_of(context, channels):
    return Sample(
        index=0, split="train", known_camera=context.camera, known_pose=None, objects=(), channels=channels, files={},
        sequence="a", sensor="camera", instant=0, time=0.0,
    )  # fmt: skip


def proofs(context, channels):
    sample = sample_of(context, channels)
    return [message for name in channels for message in channel_labels()[name].prove(sample, {})]


def at(intrinsics, x=0.0, y=0.0):
    return Camera(intrinsics, AHEAD, -AHEAD @ np.array([x, y, 0.0]))


MESHES = [cube(0.4), sphere(2, 0.5)]
LENS = lens(96, 72, 1.0)


def scene(camera, shift, sky=True):
    return view(MESHES, [pose(-0.6, 4, 0), pose(0.5 + shift, 3, 0.1)], camera, ground=True, sky=sky, floor=FLOOR)


def whole(sky=True, focal=LENS):
    """The left camera of a pair at the second of three instants: the ball moves to the right, the camera ahead."""
    around = {
        (step, name): scene(at(lens_, 0.1 if name else 0.0, 0.2 * step), 0.1 * step, sky)
        for step, lens_ in ((-1, LENS), (0, LENS), (1, focal))
        for name in (None, "right")
    }
    return context_of(around.pop((0, None)), around)


def test_all_have_the_shapes_and_types_of_the_contract():
    channels = observed(whole())
    for name, array in channels.items():
        label = channel_labels()[name]
        assert array.shape == label.channel.shape(72, 96) and array.dtype == label.dtype
        is_whole = name == "motion_boundaries" or "state" in name
        assert label.dtype == (np.uint8 if is_whole else np.float32)
        assert label.drawing is not None and label.needs


@pytest.mark.parametrize("kind", ["tiff", "exr", "npz"])
def test_all_come_back_from_their_files(kind, tmp_path):
    files = Files(geometry=kind)
    for name, array in observed(whole()).items():
        channel = channel_labels()[name].channel
        file = tmp_path / f"{name}{files.suffix(channel)}"
        file.write_bytes(encode(channel, array, files))
        assert file.suffix == (".png" if array.dtype == np.uint8 else f".{kind}")
        again = decode(channel, file)
        assert again.dtype == array.dtype and np.array_equal(again, array, equal_nan=array.dtype != np.uint8)


def test_a_whole_picture_contradicts_nothing():
    for sky in (True, False):
        context = whole(sky)
        channels = observed(context, *NAMES, "depth")
        assert proofs(context, channels) == []
        for drawing in (channel_labels()[name].drawing for name in NAMES):
            sample = sample_of(context, channels)
            drawn = drawing.pixels(np.zeros((72, 96, 3), np.uint8), sample) if drawing.pixels else drawing.picture(sample)
            assert drawn.shape == (72, 96, 3) and drawn.dtype == np.uint8 and drawn.std() > 0


def test_flow_is_that_of_depth_and_motion():
    """The camera moves 0.2 m ahead: what stands still at depth z moves away from the middle by 0.2 / (z - 0.2) of its place."""
    context = whole()
    channels = observed(context, "flow", "depth", "scene_flow", "flow_backward", "scene_flow_backward")
    centers = np.stack(np.meshgrid(np.arange(96) + 0.5, np.arange(72) + 0.5), axis=-1)
    owners = np.append(context.own_view.owners, -1)[context.visibility.triangle]
    z, still = channels["depth"][..., None], (owners != 1) & (owners >= 0)
    expected = (centers - (48, 36)) * 0.2 / (z - 0.2)
    near = still & (z[..., 0] < 100)
    close("flow", "closed form", channels["flow"][near], expected[near], "px", atol=1e-4)
    close(
        "scene_flow",
        "closed form",
        channels["scene_flow"][still],
        np.broadcast_to((0, 0, -0.2), (still.sum(), 3)),
        "m",
        atol=1e-6,
    )
    ball = owners == 1
    ahead, back = (np.broadcast_to(way, (ball.sum(), 3)) for way in ((0.1, 0, -0.2), (-0.1, 0, 0.2)))
    close("scene_flow", "closed form", channels["scene_flow"][ball], ahead, "m", atol=1e-6)
    close("scene_flow_backward", "closed form", channels["scene_flow_backward"][ball], back, "m", atol=1e-6)
    expected = (centers - (48, 36)) * -0.2 / (z + 0.2)
    close("flow_backward", "closed form", channels["flow_backward"][near], expected[near], "px", atol=1e-4)
    sky = owners == -1
    assert sky.any() and (channels["flow"][sky] == 0).all() and np.isnan(channels["scene_flow"][sky]).all()


def test_disparity_times_depth_is_focal_length_times_baseline():
    context = whole()
    channels = observed(context, "disparity", "depth", "disparity_state")
    seen = np.isfinite(channels["depth"])
    expected = 0.1 * LENS.fx / channels["depth"][seen].astype(np.float64)
    close("disparity", "focal length x baseline / depth", channels["disparity"][seen], expected, "px", rtol=2e-7)
    assert (channels["disparity"][~seen] == 0).all() and (channels["disparity_state"][~seen] != 4).all()
    assert {0, 1, 2} <= set(np.unique(channels["disparity_state"]))


@pytest.mark.parametrize(
    ("name", "where"),
    quick(
        [("flow_state", (1, None)), ("flow_backward_state", (-1, None)), ("disparity_state", (0, "right"))],
        ("flow_state", (1, None)),
        ("disparity_state", (0, "right")),
    ),
)
@pytest.mark.slow
def test_states_are_those_of_brute_force(name, where):
    context = whole(sky=False)
    own, there = context.neighbours.views[0, None], context.neighbours.views[where]
    triangle, world, sure = brute_points(own, there)
    seen = (triangle >= 0) & sure
    first = np.minimum(triangle[seen], own.geometry.triangle_start[-1])
    expected, known = expected_states(there, world[seen], first)
    assert known.sum() > 3000 and len(set(expected[known].tolist())) >= 2
    equal(name, "brute force in float64", observed(context, name)[name][seen][known], expected[known])


def test_left_and_right_agree():
    """The right picture's disparity is positive too, and equals the left one's at the same point."""
    left, right = scene(at(LENS), 0), scene(at(LENS, 0.1), 0)
    other = observed(context_of(right, {(0, "left"): left}), "disparity", "depth")
    context = context_of(left, {(0, "right"): right})
    own = observed(context, "disparity", "disparity_state")
    seen = np.isfinite(other["depth"])
    product = other["disparity"][seen].astype(np.float64) * other["depth"][seen]
    np.testing.assert_allclose(product, 0.1 * LENS.fx, rtol=2e-7)
    expected = -(context.match(Partner()).xy[..., 0] - (np.arange(96) + 0.5))
    np.testing.assert_allclose(own["disparity"], expected, atol=1e-5)


@pytest.mark.parametrize("zoom", [1.0, 0.8])
def test_the_change_of_disparity_is_the_difference_of_the_points_disparities(zoom):
    context = whole(focal=lens(96, 72, zoom))
    channels = observed(context, "disparity", "disparity_change", "depth", "flow_state")
    z = channels["depth"].astype(np.float64)
    then = lens(96, 72, zoom).fx * 0.1 / (z - 0.2) - LENS.fx * 0.1 / z
    close("disparity_change", "closed form", channels["disparity_change"], then, "px", atol=2e-6)
    assert (channels["disparity_change"][np.isinf(z)] == 0).all()


def test_without_a_neighbour_all_is_invalid():
    for around in ({}, {(0, "back"): scene(at(LENS, 0.1).__class__(LENS, -AHEAD, np.zeros(3)), 0)}):
        context = context_of(scene(at(LENS), 0), around)
        channels = observed(context)
        for name, array in channels.items():
            expected = 4 if "state" in name else 0 if name == "motion_boundaries" else np.nan
            assert np.array_equal(array, np.full_like(array, expected), equal_nan=True), name
        assert proofs(context, channels) == []
    assert np.isnan(observed(LabelContext(context.geometry, context.camera, context.visibility), "flow")["flow"]).all()


@pytest.mark.parametrize(
    "camera",
    [
        at(lens(96, 72, 0.9), 0.1),
        at(LENS, 0.1, 0.01),
        Camera(LENS, AHEAD, np.array([-0.1, 0.02, 0.0])),
        at(LENS),
        orbit_camera(LENS, 0.1, 0.0, 3.0),
    ],
)
def test_sensors_that_are_not_rectified_give_no_disparity(camera):
    own = scene(at(LENS), 0)
    there = context_of(own, {(0, "odd"): replace(own, camera=camera)})
    assert np.isnan(observed(there, "disparity")["disparity"]).all()
    assert (observed(there, "disparity_state")["disparity_state"] == 4).all()
    both = context_of(own, {(0, "odd"): replace(own, camera=camera), (0, "even"): replace(own, camera=at(LENS, -0.2))})
    assert np.nanmax(observed(both, "disparity")["disparity"]) > 0


def test_a_calibration_s_rounding_is_no_turn():
    own = scene(at(LENS), 0)
    turned = Camera(LENS, AHEAD + 1e-12, at(LENS, 0.1).t)
    found = observed(context_of(own, {(0, "right"): replace(own, camera=turned)}), "disparity", "disparity_state")
    assert np.nanmax(found["disparity"]) > 0 and (found["disparity_state"] == 0).any()


def test_a_bent_lens_has_no_rectified_sensor():
    bent = lens(96, 72, 2.0, FISHEYE)
    own = scene(at(bent), 0)
    assert np.isnan(
        observed(context_of(own, {(0, "right"): replace(own, camera=at(bent, 0.1))}), "disparity")["disparity"]
    ).all()


def test_a_flat_picture_has_neither_flow_nor_disparity():
    context = whole(sky=False)
    flat = context.visibility.triangle < 0
    channels = observed(context)
    assert flat.any()
    for name, array in channels.items():
        if "state" in name:
            assert (array[flat] == 4).all(), name
        elif name != "motion_boundaries":
            assert np.isnan(array[flat]).all(), name


def test_boundaries_are_where_things_move_apart():
    """A card 2 m away moves 0.2 m to the right before a wall that stands still: boundaries are its outline, on both sides."""
    card = mesh_of([[-0.5, 2, -0.5], [0.5, 2, -0.5], [0.5, 2, 0.5], [-0.5, 2, 0.5]], [[0, 1, 2], [0, 2, 3]])
    wall = mesh_of([[-9, 4, -9], [9, 4, -9], [9, 4, 9], [-9, 4, 9]], [[0, 1, 2], [0, 2, 3]])
    now, then, hardly = (view([card, wall], [pose(x, 0, 0), pose(0, 0, 0)], at(LENS)) for x in (0, 0.2, 0.01))
    found = observed(context_of(now, {(1, None): then}), "motion_boundaries")["motion_boundaries"]
    thing = now.owners[rasterize(now.geometry, now.camera).triangle]
    outline = np.zeros(thing.shape, bool)
    for axis in (0, 1):
        step = np.diff(thing, axis=axis) != 0
        outline |= np.pad(step, [(0, a == axis) for a in (0, 1)]) | np.pad(step, [(a == axis, 0) for a in (0, 1)])
    assert outline.any()
    equal("motion_boundaries", "outline of a card", found > 0, outline)
    assert not observed(context_of(now, {(1, None): hardly}), "motion_boundaries")["motion_boundaries"].any()


def test_one_thing_that_hides_itself_has_boundaries_within():
    """Two cards of one thing, one behind the other, before a camera that moves aside."""
    front = [[-0.5, 2, -0.5], [0.5, 2, -0.5], [0.5, 2, 0.5], [-0.5, 2, 0.5]]
    back = [[-9, 8, -9], [9, 8, -9], [9, 8, 9], [-9, 8, 9]]
    both = mesh_of(front + back, [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    now, then = (view([both], [pose(0, 0, 0)], at(LENS, x)) for x in (0, 0.2))
    context = context_of(now, {(1, None): then})
    found = observed(context, "motion_boundaries")["motion_boundaries"]
    near = context.visibility.triangle < 2
    assert found.any() and not found[:, :1].any()
    assert (found[near].sum() > 0) and (found[~near].sum() > 0) and found.mean() < 0.2


BROKEN = {
    "flow": lambda a: np.where(np.isnan(a), 0, a),
    "flow_backward": lambda a: a + np.float32(300),
    "scene_flow": lambda a: np.where(np.arange(3) == 0, np.nan, a),
    "scene_flow_backward": lambda a: np.full_like(a, np.nan),
    "disparity": lambda a: -a,
    "disparity_change": lambda a: a - 100,
    "flow_state": lambda a: a + 5,
    "flow_backward_state": lambda a: np.full_like(a, 3),
    "disparity_state": lambda a: a + 5,
    "motion_boundaries": np.ones_like,
}


@pytest.mark.parametrize("name", NAMES)
def test_what_is_broken_is_told(name):
    context = whole(sky=False)
    channels = observed(context, *NAMES, "depth")
    assert proofs(context, channels | {name: BROKEN[name](channels[name])})


def test_the_wheel_is_that_of_the_paper():
    """Right is red, down yellow to green, left cyan, up blue to violet; longer is stronger, unknown black, none white."""
    assert len(wheel()) == 55 and wheel()[0].tolist() == [255, 0, 0]
    vectors = np.array([[[1.0, 0], [-1, 0], [0, 1], [0, -1], [0, 0], [0.5, 0], [2, 0], [np.nan, 0]]])
    right, left, down, up, none, half, longer, unknown = picture(vectors, 1.0)[0].astype(int)
    assert right[0] == 255 and right[1:].max() < 20
    assert left[0] < 30 and left[1] > 200 and left[2] == 255
    assert down[0] > 150 and down[1] > 220 and down[2] < 60
    assert up[2] == 255 and up[0] > 30 and up[1] < 60
    assert none.tolist() == [255, 255, 255] and unknown.tolist() == [0, 0, 0]
    assert half[0] == 255 and 110 < half[1] < 145
    assert longer[0] == 191
