"""What arrives of each light: shadows against Embree's rays, penumbrae and irradiance against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from light_stage import LightStage, ball, cuboid, distances, flat, points, quad

import viewsphere_zoo as zoo
from quick import quick
from viewsphere.assets.mesh import Image, Material, Texture
from viewsphere.engines.raster.shadows import kernels_shadow as shadow
from viewsphere.geometry.camera import orbit_center, orbit_rotation
from viewsphere.model.scene import AreaLight, HemisphereLight, PointLight, SpotLight, Sun
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.rendering.sky.sky import even_light
from viewsphere.rendering.sky.sun import Distant, distant_sun

SUN = Distant((0.48, 0.3, 0.82), (3.0, 2.0, 1.0), 0.53)
OVERHEAD = Distant((0.0, 0.0, 1.0), (1.0, 1.0, 1.0), 0.53)


def camera(azimuth, elevation, distance, target=(0, 0, 0), width=240, height=180, focal=260.0):
    a, e = math.radians(azimuth), math.radians(elevation)
    rotation = orbit_rotation(a, e)
    center = np.asarray(target) + orbit_center(a, e, distance)
    lens = Intrinsics(width=width, height=height, fx=focal, fy=focal, cx=width / 2, cy=height / 2)
    return Camera(lens, rotation, -rotation @ center)


@pytest.fixture(scope="module")
def car():
    return LightStage(zoo.build("car", np.random.default_rng(3)))


@pytest.fixture(scope="module")
def shapes():
    pieces = (
        flat(cuboid((-1.2, -0.4, 0), (-0.4, 0.4, 1.1))),
        ball(0.4, (0.6, 0.1, 0.9)),
        flat(cuboid((0.5, 0, 0), (0.7, 0.2, 0.6))),
    )
    return LightStage(*pieces)


def level(axis):
    right = np.array([axis[1], -axis[0], 0.0]) if np.hypot(axis[0], axis[1]) > 1e-6 else np.array([1.0, 0.0, 0.0])
    right /= np.linalg.norm(right)
    return right, np.cross(right, axis)


def visible_share(stage, light, samples, count=16):
    """Share of the light's surface that rays reach from each sample."""
    scene, place, total = stage.rays(), samples.place + samples.normal * 2e-4, np.zeros(len(samples.place))
    middle = stage.origin + (stage.casters.extent.low + stage.casters.extent.high) / 2 * stage.unit
    for s in range(count):
        r, phi = math.sqrt((s + 0.5) / count), s * 2.399963
        x, y = r * math.cos(phi), r * math.sin(phi)
        if isinstance(light, Distant):
            axis = np.array(light.direction) / np.linalg.norm(light.direction)
            right, up = level(axis)
            toward = np.tile(axis + math.tan(math.radians(light.angle_deg) / 2) * (right * x + up * y), (len(place), 1))
            total += np.isinf(distances(scene, place, toward))
            continue
        at = middle + np.array(light.position)
        if isinstance(light, AreaLight):
            right, up = level(
                (np.array(light.toward) - light.position) / np.linalg.norm(np.subtract(light.toward, light.position))
            )
            at = at + right * light.size[0] * ((s % 4 + 0.5) / 4 - 0.5) + up * light.size[1] * ((s // 4 + 0.5) / 4 - 0.5)
            toward = at - place
        else:
            toward = at - place
            axis = toward / np.linalg.norm(toward, axis=1, keepdims=True)
            right = np.cross(axis, [0.3, 0.5, 0.8])
            right /= np.linalg.norm(right, axis=1, keepdims=True)
            toward = toward + light.radius * (right * x + np.cross(axis, right) * y)
        far = np.linalg.norm(toward, axis=1)
        total += distances(scene, place, toward / far[:, None]) > far - 1e-3
    return total / count


@pytest.mark.slow
@pytest.mark.parametrize("which", ["car", "shapes"])
@pytest.mark.parametrize(
    "light",
    [
        SUN,
        Distant((0.5, 0.3, 0.5), (1.0, 1.0, 1.0), 12.0),
        PointLight(position=(2.5, -2.5, 2.2), strength=20),
        SpotLight(position=(3.0, -2.0, 3.0), strength=30, angle_deg=120, radius=0.1),
        AreaLight(position=(2.0, -3.0, 3.0), strength=30, size=(0.8, 0.5)),
    ],
    ids=["sun", "wide sun", "point", "spot", "area"],
)
def test_shadows_fall_where_rays_say(which, light, request):
    """Outside penumbrae, where a surface is not seen at a flat angle by the light, 99.5 % agree."""
    pytest.importorskip("embreex")
    stage = request.getfixturevalue(which)
    samples = stage.seen(camera(35, 28, 6.5 if which == "car" else 4.5, stage.origin))
    is_distant = isinstance(light, Distant)
    lights = stage.lights([light] if is_distant else [], [] if is_distant else [light])
    found = stage.arrives(lights, 0, samples)
    truth = visible_share(stage, light, samples)
    facing = (samples.normal * found["toward"]).sum(axis=1)
    sure = (facing > 0.1) & ((truth == 0) | (truth == 1))
    assert ((found["share"] > 0.5) == (truth > 0.5))[sure].mean() > 0.995
    assert (truth[sure] == 0).sum() > 100 < (truth[sure] == 1).sum()


@pytest.mark.parametrize("light", [SUN, PointLight(position=(2.5, -2.5, 2.2), strength=20)], ids=["sun", "point"])
@pytest.mark.parametrize("size", [208, 256])
def test_the_planes_of_a_map_s_cells_enclose_all_that_is_in_them(shapes, light, size):
    """Cells are two steps wide; level by level they are twice as large, to the one that holds the whole map."""
    is_distant = isinstance(light, Distant)
    views = shapes.lights([light] if is_distant else [], [] if is_distant else [light], size).views
    side, start = views.grid[0, shadow.CELLS], views.grid[0, shadow.DEPTH_AT]
    drawn = views.depth[start : start + size * (size + shadow.GAP)].reshape(size, -1)[:, :size]
    cells = views.bounds[views.grid[0, shadow.BOUNDS_AT] :][: 2 * side * side].reshape(side, 2 * side, 4).astype(float)
    assert np.isfinite(drawn).sum() > 1000
    n, left, step = side, 0, shadow.STEP
    while n > 0:
        for j, i in np.ndindex(n, n):
            z = drawn[j * step : (j + 2) * step, i * step : (i + 2) * step]
            low, high, across, down = cells[j, left + i]
            y, x = (np.arange(k) + 0.5 - step for k in z.shape)
            z = (z - (across * x + down * y[:, None])).ravel()
            if z.size:
                tolerance = 1e-5 * (1 + abs(across) + abs(down)) * step
                assert z.min() >= low - tolerance
                assert z.max() <= high + tolerance
        n, left, step = n // 2, left + n, step * 2
    assert left == 2 * side - 1


def edge_profile(stage, lights, x):
    """Share along x on the ground, across the edge of what hangs above."""
    samples = points(np.stack([x, np.zeros_like(x), np.zeros_like(x)], axis=1), (0, 0, 1), pixel=1e-4, is_ground=True)
    return stage.arrives(lights, 0, samples)["share"].astype(float)


def spread(x, share):
    """Standard deviation of the blur that made this edge."""
    density = np.abs(np.diff(share))
    middle = (x[1:] + x[:-1]) / 2
    mean = (density * middle).sum() / density.sum()
    return math.sqrt((density * (middle - mean) ** 2).sum() / density.sum())


def hanging(height, half=3.0):
    """A card above x < 0, and a crumb under its far corner that lays the ground at z = 0."""
    crumb = quad((-half, half, 0), (0.02, 0, 0), (0, -0.02, 0))
    return LightStage(flat(np.concatenate([quad((-half, -half, height), (half, 0, 0), (0, 2 * half, 0)), crumb])))


@pytest.mark.parametrize(("height", "angle"), [(1.0, 4.0), (0.5, 12.0), (1.5, 12.0), (1.0, 30.0)])
def test_the_sun_s_penumbra_is_as_wide_as_its_angle_and_the_height_say(height, angle):
    """A disc of radius r blurs an edge with a standard deviation of r / 2."""
    stage = hanging(height)
    x = np.linspace(-1.5, 1.5, 3001)
    share = edge_profile(stage, stage.lights([Distant((0, 0, 1), (1, 1, 1), angle)]), x)
    width = 2 * height * math.tan(math.radians(angle / 2))
    assert 4 * spread(x, share) == pytest.approx(width, rel=0.15)
    assert share[0] == 0 and share[-1] == 1 and np.abs(np.diff(share)).max() < 0.1
    assert abs(x[np.searchsorted(share, 0.5)]) < 0.05 * width + 0.01


def test_an_area_light_s_penumbra():
    """The edge of a strip of light of width w at d above an edge at h: a ramp of w h / (d - h)."""
    height, above, width = 0.5, 2.5, 0.8
    stage = hanging(height, 1.2)
    middle = (stage.casters.extent.low + stage.casters.extent.high) / 2 * stage.unit + stage.origin
    position = tuple(np.array([0.0, 0.0, above]) - middle)
    light = AreaLight(position=position, toward=(*position[:2], -9), strength=1, size=(width, width))
    x = np.linspace(-0.6, 0.6, 2401)
    share = edge_profile(stage, stage.lights([], [light]), x)
    assert math.sqrt(12) * spread(x, share) == pytest.approx(width * height / (above - height), rel=0.15)


@pytest.mark.parametrize("kind", ["point", "spot", "area"])
@pytest.mark.parametrize("away", quick([-1.3, 0.0, 1.3, 2.5], -1.3, 2.5))
@pytest.mark.parametrize("along", [0, 1])
def test_penumbrae_are_as_wide_off_the_lamp_s_axis(kind, away, along):
    """A lamp of width w at d, `away` from above an edge at h: w h / (d - h); a ball is wider across its rays."""
    height, above, width = 0.5, 2.5, 0.4
    stage = hanging(height)
    at = np.array([0.0, 0.0, above])
    at[along] = away
    x, y, z = (at - (stage.casters.extent.low + stage.casters.extent.high) / 2 * stage.unit - stage.origin).tolist()
    lamp = {
        "point": PointLight(position=(x, y, z), strength=1, radius=width / 2),
        "spot": SpotLight(position=(x, y, z), toward=(0, 0, height), strength=1, radius=width / 2, angle_deg=150),
        "area": AreaLight(position=(x, y, z), toward=(x, y, -9), strength=1, size=(width, width)),
    }[kind]
    past = height / (above - height)
    expected = width * past
    if kind != "area" and along == 0:
        expected *= math.hypot(1, away / (above - height))
    middle = -away * past if along == 0 else 0.0
    places = np.linspace(middle - 1.5 * expected, middle + 1.5 * expected, 3001)
    share = edge_profile(stage, stage.lights([], [lamp]), places)
    deviations = math.sqrt(12) if kind == "area" else 4
    assert deviations * spread(places, share) == pytest.approx(expected, rel=0.06)
    assert share[0] == 0 and share[-1] == 1
    assert abs(places[np.searchsorted(share, 0.5)] - middle) < 0.08 * expected


@pytest.mark.parametrize("height", [0.03, 0.06, 0.1])
@pytest.mark.parametrize(("top", "edge"), [(0.5, 0.1), (0.5, 0.2), (0.8, 0.1), (0.8, 0.2)])
def test_a_handle_has_a_shadow_beneath_what_hangs_over_it(height, top, edge):
    """A bar near the ground and a card above x > edge, under a wide light: the part of it that neither hides."""
    width, above, bar = 0.8, 2.0, 0.02
    pieces = quad((-bar / 2, -0.6, height), (bar, 0, 0), (0, 1.2, 0)), quad((edge, -0.6, top), (0.8, 0, 0), (0, 1.2, 0))
    stage = LightStage(flat(np.concatenate([*pieces, quad((-1.2, -0.6, 0), (0.02, 0, 0), (0, -0.02, 0))])))
    middle = (stage.casters.extent.low + stage.casters.extent.high) / 2 * stage.unit + stage.origin
    x, y, z = (np.array([0, 0, above]) - middle).tolist()
    light = AreaLight(position=(x, y, z), toward=(x, y, -9), strength=1, size=(width, width))
    x = np.linspace(-0.3, 0.3, 241)
    light_x = (np.arange(2000) + 0.5) / 2000 * width - width / 2

    def ray(height):
        return x[:, None] + (light_x - x[:, None]) * height / above

    hidden = (np.abs(ray(height)) < bar / 2) | ((ray(top) > edge) & (ray(top) < edge + 0.8))
    off = np.abs(edge_profile(stage, stage.lights([], [light]), x) - 1 + hidden.mean(axis=1))
    assert off.max() < 0.25
    assert off.mean() < 0.04


def chest(overhang):
    """A box with a ledge around it, and a lid that hangs over both; (the box, how far the ledge reaches)."""
    reach = 0.3 + 0.8 * min(overhang, 0.01)
    lid = 0.3 + overhang
    boxes = (
        cuboid((-0.3, -0.3, 0), (0.3, 0.3, 0.4)),
        cuboid((-reach, -reach, 0.25), (reach, reach, 0.3)),
        cuboid((-lid, -lid, 0.4), (lid, lid, 0.43)),
    )
    return LightStage(flat(np.concatenate(boxes))), reach


NEAR_A_LID = {
    "ball": lambda z: PointLight(position=(0.1, 0.05, z), strength=1, radius=0.05),
    "small ball": lambda z: PointLight(position=(0.1, 0.05, z), strength=1, radius=0.005),
    "area": lambda z: AreaLight(position=(0, 0, z), toward=(0, 0, 0), strength=1, size=(0.3, 0.2)),
    "small area": lambda z: AreaLight(position=(0.1, 0.05, z), toward=(0.1, 0.05, 0), strength=1, size=(0.05, 0.05)),
}


@pytest.mark.parametrize("kind", NEAR_A_LID)
@pytest.mark.parametrize("above", quick([0.02, 0.06, 0.1, 0.3], 0.02, 0.1, 0.3))
@pytest.mark.parametrize("overhang", quick([0.002, 0.005, 0.01, 0.02], 0.002, 0.01))
@pytest.mark.slow
def test_a_lamp_above_a_lid_leaves_no_light_on_the_ledge_beneath_it(kind, above, overhang):
    """Also where the lid cuts through the lamp; and hardly any on a bevel whose own plane cuts through the lamp."""
    stage, reach = chest(overhang)
    lights = stage.lights([], [NEAR_A_LID[kind](0.215 + above)], 1024)
    along, out = (a.ravel() for a in np.meshgrid(np.linspace(-0.29, 0.29, 59), np.linspace(0.3, reach, 6)))
    for turn in range(4):
        x, y = ((along, -out), (out, along), (along, out), (-out, along))[turn]
        side = ((0, -1), (1, 0), (0, 1), (-1, 0))[turn]
        ledge = np.stack([x, y, np.full_like(x, 0.3)], axis=1)
        assert stage.arrives(lights, 0, points(ledge, (0, 0, 1)))["irradiance"].max() == 0
        for slope in (0.5, 1) if above >= 0.06 or kind != "area" else ():
            normal = np.array([*np.multiply(side, slope), 1]) / math.hypot(slope, 1)
            assert stage.arrives(lights, 0, points(ledge, normal))["share"].max() < 0.05


@pytest.mark.parametrize("kind", quick(NEAR_A_LID, "small ball", "area"))
@pytest.mark.parametrize(
    ("overhang", "above"),
    [(0.002, 0.1), (0.02, 0.3), *(pytest.param(*both, marks=pytest.mark.slow) for both in ((0.002, 0.3), (0.02, 0.1)))],
)
def test_shadows_of_lamps_close_to_a_lid_fall_where_rays_say(kind, above, overhang):
    pytest.importorskip("embreex")
    stage, _ = chest(overhang)
    lamp = NEAR_A_LID[kind](0.215 + above)
    samples = stage.seen(camera(30, 25, 1.6, stage.origin, focal=240.0))
    found, truth = stage.arrives(stage.lights([], [lamp]), 0, samples), visible_share(stage, lamp, samples)
    sure = ((samples.normal * found["toward"]).sum(axis=1) > 0.1) & ((truth == 0) | (truth == 1))
    assert ((found["share"] > 0.5) == (truth > 0.5))[sure].mean() > 0.995
    assert (truth[sure] == 0).sum() > 100 < (truth[sure] == 1).sum()
    assert np.abs(found["share"] - truth)[samples.is_ground].mean() < 0.05


def test_a_bulb_does_not_hide_the_lamp_in_it_but_a_table_does():
    """A ball of light that reaches beyond a bulb shines; what a top cuts off it does not."""
    lamp = PointLight(position=(0, 0, 0), strength=1, radius=0.05)
    bulb = cuboid((-0.02, -0.02, 0.48), (0.02, 0.02, 0.52))
    below = points([[x, y, 0] for x in (-0.2, 0, 0.3) for y in (0.1, 0.4)], (0, 0, 1), is_ground=True)
    feet = [cuboid((x, x, z), (x + 0.01, x + 0.01, z + 0.01)) for x in (-0.01, 0) for z in (0, 0.99)]
    stage = LightStage(flat(np.concatenate([bulb, *feet])))
    assert stage.arrives(stage.lights([], [lamp]), 0, below)["share"].min() > 0.9
    top = cuboid((-0.6, -0.6, 0.44), (0.6, 0.6, 0.48))
    stage = LightStage(flat(np.concatenate([top, *feet])))
    assert stage.arrives(stage.lights([], [lamp]), 0, below)["share"].max() == 0


@pytest.fixture(scope="module")
def crumb():
    """Hardly anything, so that the stage's unit is not a metre and nothing is in the way."""
    return LightStage(flat(cuboid((-0.1, -0.1, -50.1), (0.1, 0.1, -49.9))), ground=False)


def irradiance(stage, light, place):
    middle = stage.origin + (stage.casters.extent.low + stage.casters.extent.high) / 2 * stage.unit
    lights = stage.lights([], [light])
    toward = np.asarray(light.position) - np.asarray(place)
    toward = toward / np.linalg.norm(toward, axis=-1, keepdims=True)
    return stage.arrives(lights, 0, points(np.asarray(place) + middle, toward))


def test_inverse_square_and_cone(crumb):
    place = np.array([[0.0, 0.0, 30 - d] for d in (0.5, 1.0, 3.0, 10.0)])
    light = PointLight(position=(0, 0, 30), strength=5.0, color=(1.0, 0.5, 0.25))
    found = irradiance(crumb, light, place)
    expected = 5.0 / np.array([0.25, 1.0, 9.0, 100.0])[:, None] * [1.0, 0.5, 0.25]
    np.testing.assert_allclose(found["irradiance"], expected, rtol=1e-3)
    np.testing.assert_allclose(found["width"], 0.05 / np.array([0.5, 1, 3, 10]), rtol=1e-3)
    tilt = np.radians([0.0, 10.0, 19.5, 25.0, 29.5, 30.5, 60.0])
    place = np.stack([3 * np.sin(tilt), 0 * tilt, 30 - 3 * np.cos(tilt)], axis=1)
    light = SpotLight(position=(0, 0, 30), toward=(0, 0, 20), strength=9.0, angle_deg=60, blend=1 / 3)
    cone = irradiance(crumb, light, place)["irradiance"][:, 0]
    np.testing.assert_allclose(cone[:3], 1.0, rtol=1e-3)
    assert 1 > cone[3] > cone[4] > 0
    assert (cone[5:] == 0).all()


def test_a_rectangle_s_irradiance_near_and_far(crumb):
    """Against the sum over its surface; one side only."""
    light = AreaLight(position=(0, 0, 30), toward=(0, 0, 0), strength=4.0, size=(1.0, 0.6))
    place = np.array([[0, 0, 29.8], [0.4, 0.3, 29.5], [1, 1, 29], [0, 2, 26], [5, 0, 20], [3, 0, -2], [0, 0, 31]], float)
    found = irradiance(crumb, light, place)
    u, v = np.meshgrid((np.arange(200) + 0.5) / 200 - 0.5, (np.arange(200) + 0.5) / 200 - 0.5)
    # Its width lies level: along x or y alike.
    best = []
    for across in ((1, 0, 0), (0, 1, 0)):
        along = (0, 1, 0) if across == (1, 0, 0) else (1, 0, 0)
        at = np.array([0, 0, 30.0]) + u[..., None] * np.multiply(across, 1.0) + v[..., None] * np.multiply(along, 0.6)
        away = at.reshape(1, -1, 3) - place[:-1, None]
        far = np.linalg.norm(away, axis=2, keepdims=True)
        vector = (4.0 * (away / far) * (away[..., 2:] / far) / far**2).mean(axis=1)
        best.append(np.abs(np.linalg.norm(vector, axis=1) / found["irradiance"][:-1, 0] - 1).max())
    assert min(best) < 0.02
    assert (found["irradiance"][-1] == 0).all()


def test_distant_lights_arrive_everywhere_alike(crumb):
    sun = Sun(azimuth=200, elevation=30, strength=2.0, color=(1.0, 0.5, 0.25), angle_deg=2)
    lights = crumb.lights([distant_sun(sun)])
    found = crumb.arrives(lights, 0, points([[0, 0, 0], [40, -7, 2]], (0, 0, 1)))
    toward = orbit_center(math.radians(200), math.radians(30), 1.0)
    np.testing.assert_allclose(found["toward"], np.tile(toward, (2, 1)), atol=1e-6)
    np.testing.assert_allclose(found["irradiance"], np.tile([2.0, 1.0, 0.5], (2, 1)), rtol=1e-5)
    np.testing.assert_allclose(found["width"], math.radians(1), rtol=1e-5)


@pytest.mark.parametrize("angle", [0.0, 0.53, 10.0])
@pytest.mark.parametrize("elevation", quick([4.0, 15.0, 50.0, 90.0], 4.0, 50.0))
def test_no_acne(elevation, angle):
    """A slab and a smooth ball are wholly lit on the side that looks at the light."""
    x, y, z = orbit_center(math.radians(77), math.radians(elevation), 1.0).tolist()
    light = Distant((x, y, z), (1, 1, 1), angle)
    for stage, target in (
        (LightStage(flat(cuboid((-2, -2, -0.1), (2, 2, 0)))), (0, 0, 0)),
        (LightStage(ball(1.0, (0, 0, 1), 64)), (0, 0, 1)),
    ):
        samples = stage.seen(camera(60, 40, 5.0, target, 120, 90, 130))
        found = stage.arrives(stage.lights([light]), 0, samples)
        facing = (samples.normal * found["toward"]).sum(axis=1)
        turned = (samples.smooth * found["toward"]).sum(axis=1)
        lit = ~samples.is_ground & (np.minimum(facing, turned) > (0.06 if elevation < 10 else 0.2))
        assert lit.sum() > 200
        assert found["share"][lit].min() > 0.98


@pytest.mark.parametrize(
    "light",
    [
        Distant((1, 0, 0.2), (1, 1, 1), 0.53),
        PointLight(position=(5, 0, 0.6), strength=20),
        AreaLight(position=(5, 0, 0.6), strength=20, size=(2, 1)),
    ],
    ids=["sun", "point", "area"],
)
def test_the_facets_of_a_coarse_smooth_ball_do_not_show(light):
    """Where its smooth normals turn away from the light there is no step from facet to facet, nor in any of them."""
    stage = LightStage(ball(1.0, (0, 0, 1), 8))
    samples = stage.seen(camera(90, 5, 6.0, (0, 0, 1), 120, 120, 300))
    is_distant = isinstance(light, Distant)
    lights = stage.lights([light] if is_distant else [], [] if is_distant else [light])
    found = stage.arrives(lights, 0, samples)
    turned = (samples.smooth * found["toward"]).sum(axis=1)
    lit = ~samples.is_ground & (turned > 0)
    missing = (turned * (1 - found["share"]))[lit]
    assert lit.sum() > 3000
    assert missing.max() < 0.03
    assert (found["share"][~samples.is_ground & (turned < 0)] == 0).all()


def test_a_plane_under_a_wide_light_is_lit_all_over():
    """The plane's slope is that seen from the light's middle, though most light comes from nearer parts of it."""
    stage = LightStage(flat(cuboid((-2, -2, -0.1), (2, 2, 0))))
    light = AreaLight(position=(1.5, 0, 0.6), toward=(0, 0, 0), strength=1, size=(1.5, 0.8))
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(-1.9, 1.6, 60), np.linspace(-1.9, 1.9, 60)))
    found = stage.arrives(stage.lights([], [light]), 0, points(np.stack([x, y, 0 * x], axis=1), (0, 0, 1)))
    assert found["share"].min() > 0.99


def test_a_rectangle_lights_nothing_in_its_own_plane(crumb):
    light = AreaLight(position=(0, 0, 30), toward=(0, 0, 0), strength=4.0, size=(1.0, 0.6))
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(-2, 2, 40), np.linspace(-2, 2, 40)))
    places = np.stack([x, y, 30 + np.random.default_rng(0).normal(0, 1e-5, x.size)], axis=1)
    assert irradiance(crumb, light, places)["irradiance"].max() < 1e-4


def test_a_shadow_begins_at_the_foot():
    """No gap between a box and its shadow."""
    stage = LightStage(flat(cuboid((-0.5, -0.5, 0), (0.5, 0.5, 1))))
    x = -0.5 - np.array([0.004, 0.01, 0.03, 0.2])
    lights = stage.lights([Distant((1, 0, 1), (1, 1, 1), 0.53)])
    np.testing.assert_array_equal(edge_profile(stage, lights, x), 0)


@pytest.mark.parametrize(
    "light",
    [
        PointLight(position=(0.0, 0.0, 0.2), strength=3.0),
        SpotLight(position=(0.0, 0.0, 0.2), toward=(5, 1, 0), strength=3.0, angle_deg=150),
        AreaLight(position=(0.0, 0.0, 0.2), toward=(5, 1, 0), strength=3.0),
    ],
    ids=["point", "spot", "area"],
)
def test_a_light_in_a_box_lights_its_walls_and_nothing_else(light):
    stage = LightStage(flat(cuboid((-1, -1, 0), (1, 1, 2))))
    lights = stage.lights([], [light])
    inside = points([[0.999, y, z] for y in (-0.3, 0.1, 0.4) for z in (0.9, 1.2, 1.5)], (-1, 0, 0))
    assert stage.arrives(lights, 0, inside)["share"].min() > 0.9
    outside = points([[x, y, 0] for x in (1.2, 2.0, 5.0) for y in (-3.0, 0.1, 2.0)], (0, 0, 1), is_ground=True)
    assert stage.arrives(lights, 0, outside)["irradiance"].max() == 0


@pytest.mark.slow
@pytest.mark.parametrize("has_bottom", [True, False])
def test_a_lamp_in_a_box_does_not_light_the_ground_beside_its_foot(has_bottom):
    """However large a pixel is: a part of it would lie under the box."""
    box = cuboid((-0.6, -0.6, 0), (0.6, 0.6, 1.2)).reshape(-1, 3, 3)
    box = box if has_bottom else box[box[:, :, 2].max(axis=1) > 0]
    stage = LightStage(flat(box.reshape(-1, 3)))
    along, off = (a.ravel() for a in np.meshgrid(np.linspace(-0.6, 0.6, 41), [5e-4, 0.003, 0.01, 0.05]))
    beside = np.concatenate([np.stack(xy, axis=1) for xy in ((along, 0.6 + off), (0.6 + off, along), (-0.6 - off, along))])
    beside = np.column_stack([beside, 0 * beside[:, 0]])
    for place in ((0.1, 0, 0), (-0.15, 0.1, -0.4), (0.2, 0.1, 0.4)):
        spot = SpotLight(position=place, toward=(0, 0, -9), strength=5, angle_deg=140)
        for lamp in (PointLight(position=place, strength=5), spot):
            lights = stage.lights([], [lamp])
            for pixel in (5e-4, 0.01, 0.05):
                foot = points(beside, (0, 0, 1), pixel, True)
                under = points([[0, 0, 0], [0.05, 0.1, 0]], (0, 0, 1), pixel, not has_bottom)
                assert stage.arrives(lights, 0, under)["share"].min() == 1
                assert stage.arrives(lights, 0, foot)["irradiance"].max() == 0


def prism(sides, turn, radius=0.6, height=1.2):
    """Triangles of a closed prism on the ground, (n, 3)."""
    angle = turn + 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle], axis=1)
    up, found = np.array([0, 0, height]), []
    for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        found += [a, b, b + up, a, b + up, a + up, up, a + up, b + up, 0 * up, b, a]
    return np.array(found)


@pytest.mark.parametrize("kind", ["ball", "level area", "upright area"])
@pytest.mark.parametrize("sides", quick([3, 4, 6, 24], 3, 24))
@pytest.mark.slow
def test_lamps_in_closed_prisms_light_nothing_outside(kind, sides):
    """However many walls there are and however they are turned; places from half a millimetre beside the foot to 3 m away."""
    rng = np.random.default_rng(sides)
    inner = 0.6 * math.cos(math.pi / sides)
    for _ in range(2):
        turn, way = rng.uniform(0, 2 * np.pi, 2)
        x, y, z = (rng.uniform(-0.3, 0.3, 3) * [inner, inner, 1]).tolist()
        aim = (x, y, -9) if kind == "level area" else (x + math.cos(way), y + math.sin(way), z)
        lamp = AreaLight(position=(x, y, z), toward=aim, strength=5, size=(0.5 * inner, 0.3 * inner))
        if kind == "ball":
            lamp = PointLight(position=(x, y, z), strength=5, radius=0.4 * inner)
        stage = LightStage(flat(prism(sides, turn)))
        angle = rng.uniform(0, 2 * np.pi, 4000)
        across = np.cos((angle - turn) % (2 * np.pi / sides) - np.pi / sides)
        r = (inner + 10 ** rng.uniform(-3.3, 0.5, 4000)) / across
        beside = points(np.stack([r * np.cos(angle), r * np.sin(angle), 0 * r], axis=1), (0, 0, 1), 0.01, True)
        assert stage.arrives(stage.lights([], [lamp]), 0, beside)["irradiance"].max() == 0


def test_lights_at_awkward_places_give_finite_light():
    stage = LightStage(flat(cuboid((-1, -1, 0), (1, 1, 2))))
    middle = np.array([0, 0, 1.0])
    odd = [
        PointLight(position=(1, 0, 0), strength=2, radius=0),
        SpotLight(position=(0, 0, 1), toward=(0, 0, 1), strength=2, radius=0, blend=0),
        SpotLight(position=(0, 0, 3), strength=2, angle_deg=160),
        AreaLight(position=(0, 1, 0), toward=(0, 1, 0), strength=2),
        AreaLight(position=(0, 3, 0), strength=2, size=(1e-9, 1e-9)),
        AreaLight(position=(0, 3, 2), strength=2, size=(1, 1e-9)),
        PointLight(position=(0, 0, 0), strength=0),
        PointLight(position=(0, 0, -3), strength=2),
        PointLight(position=(0, 0, 900), strength=2),
    ]
    lights = stage.lights([Distant((0, 0, 1), (0, 0, 0), 1), Distant((0, 0, -1), (1, 1, 1), 1), OVERHEAD], odd)
    assert len(lights.kind) == len(odd) - 2 + 1  # the dark ones and those under the ground are left out
    places = np.concatenate([[middle + light.position for light in odd], np.random.default_rng(0).uniform(-2, 2, (200, 3))])
    for normal in ((0, 0, 1), (1, 0, 0)):
        for k in range(len(lights.kind)):
            found = stage.arrives(lights, k, points(places, normal))
            assert all(np.isfinite(v).all() for v in found.values())
            assert found["irradiance"].min() >= 0


def test_no_lights_and_no_casters():
    stage = LightStage(flat(cuboid((-1, -1, 0), (1, 1, 2)), Material(transmission=1.0)))
    assert len(stage.lights().kind) == 0
    share = edge_profile(stage, stage.lights([SUN]), np.linspace(-3, 3, 50))
    np.testing.assert_array_equal(share, 1)


@pytest.mark.parametrize("light", [OVERHEAD, PointLight(position=(0, 0, 3), strength=2, radius=0.01)])
def test_cutouts_cast_their_shape(light):
    """A card with a hole lies in the air: light goes through the hole."""
    pixels = np.full((8, 8, 4), 255, np.uint8)
    pixels[2:6, 2:6, 3] = 0
    holed = Material(base_color_texture=Texture(0, nearest=True), alpha_mode="MASK")
    uv = np.array([(0, 1), (1, 1), (1, 0), (0, 1), (1, 0), (0, 0)], np.float32)
    card = flat(quad((-1, -1, 1), (2, 0, 0), (0, 2, 0)), holed, uv0=uv, images=(Image("hole", pixels),))
    foot = flat(quad((-0.01, -0.01, 0), (0.02, 0, 0), (0, 0.02, 0)))
    stage = LightStage(card, foot)
    lights = stage.lights([light] if isinstance(light, Distant) else [], [] if isinstance(light, Distant) else [light])
    share = edge_profile(stage, lights, np.array([-0.8, -0.3, 0.3, 0.8, 4.0]))
    np.testing.assert_array_equal(share, [0, 1, 1, 0, 1])


@pytest.mark.slow
def test_scenery_casts_shadows_near_and_far_and_targets_on_it():
    """A box of 1 m and houses on a floor of 400 m; the wide maps do not change with the target."""
    floor, house = quad((-200, -200, 0), (400, 0, 0), (0, 400, 0)), cuboid((-4, -5, 0), (4, 5, 6))
    place = flat(np.concatenate([floor, np.add(house, (20, 0, 0)), np.add(house, (-80, 40, 0))]))
    sun = Distant((1, 0, 1), (1, 1, 1), 0.53)

    def share(target, x, y):
        stage = LightStage(target, ground=False, scenery=place)
        lights = stage.lights([sun])
        xs = np.asarray(x, float)
        where = points(np.stack([xs, np.full_like(xs, y), np.zeros_like(xs)], axis=1), (0, 0, 1))
        return stage.arrives(lights, 0, where)["share"], lights

    small = flat(cuboid((-0.5, -0.5, 0), (0.5, 0.5, 1)))
    near, first = share(small, [-1.6, -1.45, -0.6, 0.6], 0.1)
    np.testing.assert_array_equal(near, [1, 0, 0, 1])
    far, _ = share(small, [9, 11, 15, 25, -91, -89, -85, -75], 2)
    np.testing.assert_array_equal(far[:4], [1, 0, 0, 1])
    assert share(small, [-92, -88.5, -85, -75], 41)[0].tolist() == [1, 0, 0, 1]
    _, second = share(flat(cuboid((-0.4, -0.6, 0), (0.4, 0.6, 0.9))), [0], 0)
    assert first.first[1] == second.first[1] > 2
    np.testing.assert_array_equal(first.views.form[1:], second.views.form[1:])


def test_hemisphere_lights_are_ambient():
    two = (HemisphereLight(strength=2, color=(1, 0.5, 0)), HemisphereLight(strength=1, below=(0.1, 0.2, 0.3)))
    np.testing.assert_allclose(even_light([*two, PointLight(position=(0, 0, 1), strength=1)]), [[3, 2, 1], [0.1, 0.2, 0.3]])
