"""The picture without its background, over any background, is the picture with it."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
import pytest

from pictures import photograph, write
from quick import quick
from shots import still_shot
from viewsphere.codecs.srgb import encoded, linear
from viewsphere.model.instant import Viewpoint
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Background, Finish, Ground, Scene
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.thing import Thing
from viewsphere.rendering.background import display_background
from viewsphere.run.shots.stages import Stages

WIDTH, HEIGHT = 128, 96
CAR = ModelSpec(key="car", source="zoo:car", seed=1, category="car", category_id=1)
POSES = [
    Viewpoint(index=0, azimuth_deg=35, elevation_deg=12, distance=9),
    Viewpoint(index=1, azimuth_deg=200, elevation_deg=50, distance=11),
]


@pytest.fixture(scope="module")
def stages():
    return Stages()


def samples_of(stages: Stages, scene: Scene, channels=("rgb", "rgba", "instances"), finish=None, poses=POSES, **options):
    lens = Intrinsics(width=WIDTH, height=HEIGHT, fx=150, fy=150, cx=WIDTH / 2, cy=HEIGHT / 2)
    more = {"scene": scene, "engine_options": options, "channels": channels}
    middle = stages.box(CAR).mean(axis=0)
    shot = still_shot([Thing(id=1, model=CAR)], lens, poses, middle, finish=finish, **more)
    return list(stages.render(shot))


def over(rgba: np.ndarray, background: Background) -> np.ndarray:
    """Display-linear colours of a straight-alpha picture over a background."""
    alpha = rgba[..., 3:] / 255
    behind = display_background(background, WIDTH, HEIGHT).reshape(HEIGHT, WIDTH, 3)
    return linear(rgba[..., :3] / 255) * alpha + behind * (1 - alpha)


@pytest.fixture(scope="module")
def photo(tmp_path_factory):
    return str(write(tmp_path_factory.mktemp("photo") / "photo.png", photograph(200, 150)))


@pytest.mark.parametrize("ground", [None, Ground(), Ground(catcher=True)], ids=["no ground", "ground", "catcher"])
@pytest.mark.parametrize("antialias", [1, 4])
@pytest.mark.parametrize("kind", quick(["black", "white", "photo"], "black", "photo"))
def test_over_a_background_it_is_the_picture_with_it(stages, photo, ground, antialias, kind):
    """Within one byte, or within 1/255 in light: alpha has 8 bits, and where nearly nothing is left a byte is little light."""
    background = {
        "black": Background(color=(0, 0, 0)),
        "white": Background(color=(1, 1, 1)),
        "photo": Background(image=photo, fit="crop", zoom=1.3, place=(0.2, 0.9), flip=True, blur=0.01),
    }[kind]
    scene = Scene(ground=ground, finish=Finish(background=background))
    for sample in samples_of(stages, scene, antialias=antialias):
        made = over(sample.rgba, background)
        bytes_off = np.abs(np.round(encoded(np.clip(made, 0, 1)) * 255) - sample.rgb)
        light_off = np.abs(made - linear(sample.rgb / 255))
        assert ((bytes_off <= 1) | (light_off <= 1 / 255)).all()


def test_nothing_is_clear_and_black_and_the_object_is_not(stages):
    for sample in samples_of(stages, Scene()):
        alpha, seen = sample.rgba[..., 3], sample.instances > 0
        clear = alpha == 0
        assert clear.mean() > 0.2
        assert (sample.rgba[clear] == 0).all()
        assert not (clear & seen).any()
        inside = seen.copy()
        for axis in (0, 1):
            inside &= np.roll(seen, 1, axis) & np.roll(seen, -1, axis)
        assert (alpha[inside] > 0).all()
        assert np.mean(alpha[inside] == 255) > 0.7  # the rest is glass
        outside = ~seen
        for axis in (0, 1):
            outside &= ~np.roll(seen, 1, axis) & ~np.roll(seen, -1, axis)
        assert (alpha[outside] == 0).all()


def test_the_background_does_not_matter(stages, photo):
    one, other = (
        samples_of(stages, Scene(ground=Ground()), finish=Finish(background=background))
        for background in (Background(), Background(image=photo))
    )
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a.rgba, b.rgba)
    assert (one[0].rgb != other[0].rgb).any()


def test_ground_hides_the_background(stages):
    from_above = samples_of(stages, Scene(ground=Ground()))[1]
    assert (from_above.rgba[..., 3] == 255).all()


def test_a_catcher_shows_its_shadow_and_nothing_else(stages):
    """Seen from above, all around the car is ground: black, opaque under the car, clear away from its shadow."""
    sample = samples_of(stages, Scene(ground=Ground(catcher=True)))[1]
    ground = sample.instances == 0
    for axis in (0, 1):
        ground &= (np.roll(sample.instances, 1, axis) == 0) & (np.roll(sample.instances, -1, axis) == 0)
    alpha = sample.rgba[..., 3][ground]
    assert (sample.rgba[ground][:, :3] == 0).all()
    assert np.mean(alpha < 10) > 0.3
    assert alpha.max() > 100


@pytest.mark.parametrize("elevation", quick([12, -20], -20))
def test_a_catcher_is_there_for_labels_only_if_they_ask_for_it(stages, elevation):
    """Its picture is the same either way; from below it hides the car in the picture alone."""
    channels = ("rgba", "depth", "normals", "normals_geometric", "instances")
    grounds = None, Ground(catcher=True), Ground(catcher=True, labels=True), Ground(), Ground(labels=True)
    poses = [Viewpoint(index=0, azimuth_deg=35, elevation_deg=elevation, distance=9)]
    bare, caught, labelled, solid, same = (samples_of(stages, Scene(ground=g), channels, poses=poses)[0] for g in grounds)
    for one, other in ((bare, caught), (solid, labelled), (solid, same)):
        for name in channels[1:]:
            np.testing.assert_array_equal(one.channels[name], other.channels[name])
        np.testing.assert_equal(asdict(one.objects[0]), asdict(other.objects[0]))
    np.testing.assert_array_equal(caught.rgba, labelled.rgba)
    assert (bare.objects[0].visibility, solid.objects[0].visibility) == (1, 1 if elevation > 0 else 0)
    assert np.isinf(caught.depth[caught.instances == 0]).all()
    assert np.isfinite(labelled.depth[-1 if elevation > 0 else 0]).all()


def test_a_transparent_scene_asks_for_rgba_alone(stages):
    """The recipe's `transparent` is the channel `rgba`; `rgb` still has the sky, whatever the finish says."""
    clear = Scene(finish=Finish(background=Background(transparent=True)))
    for sample, plain in zip(samples_of(stages, clear), samples_of(stages, Scene()), strict=True):
        np.testing.assert_array_equal(sample.rgba, plain.rgba)
        np.testing.assert_array_equal(sample.rgb, plain.rgb)
    alone = samples_of(stages, clear, channels=("rgba",))
    assert all(sample.picture is sample.rgba and set(sample.channels) == {"rgba"} for sample in alone)
