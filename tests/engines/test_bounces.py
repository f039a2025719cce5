"""Light that things throw at one another, against closed forms of radiosity and bounds of energy."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from light_stage import ball
from test_raster import BLACK, DARK, SPEC, box, camera, mesh_of, rectangle

from quick import quick
from shots import painted, still_shot
from viewsphere.assets.mesh import Material, Mesh
from viewsphere.engines import raster
from viewsphere.engines.raster.indirect import bounces as baking
from viewsphere.engines.raster.indirect import irradiance_volumes as volumes
from viewsphere.engines.raster.indirect.gathering import final_gather as gathering
from viewsphere.engines.raster.indirect.kernels_probes import look_up
from viewsphere.engines.raster.lightmaps import lightmaps
from viewsphere.engines.raster.options import parse_options
from viewsphere.engines.raster.records import Bounces
from viewsphere.engines.raster.shading.painting import paint
from viewsphere.errors import RecipeError
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Finish, Ground, PointLight, Scene, Sky, Sun
from viewsphere.model.thing import Thing
from viewsphere.run.shots import precompile as warm
from viewsphere.truth.raster.visibility import rasterize

EVEN = Sky(zenith=(1, 1, 1), horizon=(1, 1, 1))
OUT = Finish(background=BLACK)
AWAY = mesh_of(rectangle((0, 0, 40), (0.1, 0, 0), (0, 0.1, 0)))
"""A target that nothing sees."""


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    """Fewer rays of fewer probes and nodes: what is proved here does not depend on how many there are."""
    monkeypatch.setattr(volumes, "RAYS", 256)
    monkeypatch.setattr(volumes, "ALONG", 14)
    monkeypatch.setattr(volumes, "CELL", 0.3)
    monkeypatch.setattr(gathering, "NODE_RAYS", 64)
    monkeypatch.setattr(lightmaps, "CELL", 0.2)
    baking._bake.cache_clear()
    baking._look.cache_clear()


def matt(reflectance: float, emits: float = 0.0) -> Material:
    color, light = (reflectance,) * 3, (emits,) * 3
    return Material("matt", (*color, 1.0), roughness=1.0, specular=0.0, metallic=0.0, emissive=light)


def painted_mesh(*parts: tuple[np.ndarray, Material]) -> Mesh:
    """One mesh of triangles (T, 3, 3), each part of its own material."""
    mesh = mesh_of(np.concatenate([part for part, _ in parts]))
    which = np.repeat(np.arange(len(parts), dtype=np.int32), [len(part) for part, _ in parts])
    return replace(mesh, triangle_material=which, materials=tuple(material for _, material in parts))


def inside_out(triangles: np.ndarray) -> np.ndarray:
    return triangles[:, ::-1]


def stage_of(mesh: Mesh, scene: Scene, scenery: Mesh | None = None, **options):
    things, meshes = [Thing(id=1, model=SPEC)], {SPEC.key: mesh}
    if scenery is not None:
        place = ModelSpec(key="place", source="memory", category="", category_id=0)
        things.append(Thing(id=0, model=place, scenery=True))
        meshes["place"] = scenery
    shot = still_shot(things, scene=scene, engine_options={"bounces": "on"} | options)
    return raster.stage(shot, lambda spec, step=None: meshes[spec.key])


def probed(stage, places, normals) -> np.ndarray:
    """Radiance (N, 3) of white matt surfaces at world places (N, 3) that have these normals, by bounced light and sky alone, as
    probes know it.
    """
    baked = stage.baked(0)
    at = ((np.asarray(places, float) - baked.origin) / baked.unit).astype(np.float32)
    glow, inside = np.empty(at.shape, np.float32), np.empty(len(at), np.float32)
    alone = np.full(len(at), -1, np.int32)  # of no triangle that a lightmap may know
    look_up(baked.bounces, at, np.ascontiguousarray(normals, np.float32), alone, glow, inside)
    assert (inside == 1).all()
    return glow


def walls(low, high, count: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """Places all over the inner faces of a box, as many on every face, and normals inwards, (6, count * count, 3)."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    u, v = ((np.indices((count, count)) + 0.5) / count).reshape(2, -1)
    places, normals = [], []
    for axis in range(3):
        for side in (0, 1):
            place, normal = np.empty((count * count, 3)), np.zeros((count * count, 3))
            others = [k for k in range(3) if k != axis]
            place[:, axis], normal[:, axis] = (low, high)[side][axis], 1 - 2 * side
            for share, k in zip((u, v), others, strict=True):
                place[:, k] = low[k] + share * (high - low)[k]
            places.append(place)
            normals.append(normal)
    return np.array(places), np.array(normals)


@pytest.mark.parametrize("reflectance", [0.0, 0.5, 0.8])
@pytest.mark.slow
def test_a_closed_box_that_glows_evenly(reflectance):
    """Everywhere light is that of one wall over one less its reflectance: the furnace."""
    low, high = (-1.0, -0.8, -0.6), (1.0, 0.8, 0.6)
    stage = stage_of(painted_mesh((inside_out(box(low, high)), matt(reflectance, 1.0))), Scene(sun=None, sky=DARK))
    places, normals = walls(low, high)
    light = probed(stage, places.reshape(-1, 3), normals.reshape(-1, 3))
    np.testing.assert_allclose(light, 1 / (1 - reflectance), rtol=0.018 if reflectance else 0.03)


def test_a_closed_box_that_glows_faintly_beside_a_sunlit_wall():
    """All bounces in the box are followed, however little of all light they are."""
    low, high, apart = (-1.0, -0.8, -0.6), (1.0, 0.8, 0.6), np.array([2.5, 0, 0])
    dim, white = matt(0.8, 0.01), matt(0.8)
    mesh = painted_mesh((inside_out(box(low, high)), dim), (box(low + apart, high + apart), white))
    stage = stage_of(mesh, Scene(sun=Sun(azimuth=0, elevation=40), sky=DARK))
    places, normals = walls(low, high)
    light = probed(stage, places.reshape(-1, 3), normals.reshape(-1, 3))
    np.testing.assert_allclose(light, 0.05, rtol=0.02)


@pytest.mark.slow
def test_further_bounces_are_foretold_where_two_walls_take_turns(monkeypatch):
    """A sunlit wall and a shaded one: of each patch, light is what it is when all bounces are followed."""
    walls = (box((-1, -1, 0), (1, 1, 1)), matt(0.6)), (box((1.5, -1, 0), (2.5, 1, 2)), matt(0.9))
    stages = [stage_of(painted_mesh(*walls), Scene(sun=Sun(azimuth=20, elevation=40), sky=EVEN)) for _ in range(2)]
    foretold = stages[0].baked(0).bounces.sent.light
    baking._bake.cache_clear()
    monkeypatch.setattr(baking, "UNCHANGED", -1.0)
    followed = stages[1].baked(0).bounces.sent.light
    assert len(followed) > 100
    np.testing.assert_allclose(foretold, followed, rtol=0.02)


@pytest.mark.slow
def test_a_closed_box_of_which_one_wall_glows(monkeypatch):
    """What is sent out is all absorbed: the mean irradiance is the power over area times absorption. A wall opposite has what
    the form factor of two equal rectangles says (here integrated) before any bounce, and a little more: it is read from probes
    in front of it.
    """
    monkeypatch.setattr(volumes, "ALONG", 24)
    low, high, reflectance = np.array((-1.0, -0.8, -0.6)), np.array((1.0, 0.8, 0.6)), 0.6
    faces = inside_out(box(low, high)).reshape(6, 2, 3, 3)
    glowing = [k for k in range(6) if (faces[k][..., 2] == high[2]).all()]
    others = np.concatenate([faces[k] for k in range(6) if k not in glowing])
    places, normals = walls(low, high, 16)
    size = high - low
    areas = np.repeat([size[1] * size[2], size[0] * size[2], size[0] * size[1]], 2)
    means = {}
    for r in (0.0, reflectance):
        mesh = painted_mesh((others, matt(r)), (faces[glowing[0]], matt(r, 1.0)))
        light = probed(stage_of(mesh, Scene(sun=None, sky=DARK)), places.reshape(-1, 3), normals.reshape(-1, 3))
        means[r] = light.reshape(6, -1, 3).mean(axis=(1, 2))
    # A sum of radiance over all walls: of a power of pi L A, irradiance / pi.
    total = (areas * means[reflectance]).sum()
    assert total == pytest.approx(areas[5] / (1 - reflectance), rel=0.02)
    assert means[0.0][5] == pytest.approx(0, abs=0.002)
    u, v = ((np.indices((40, 40)) + 0.5) / 40).reshape(2, -1, 1)
    dx, dy = (u - u.T) * size[0], (v - v.T) * size[1]
    factor = (size[2] ** 2 / (math.pi * (dx**2 + dy**2 + size[2] ** 2) ** 2)).mean() * areas[5]
    assert means[0.0][4] == pytest.approx(factor, rel=0.1)


def test_the_ground_below_a_glowing_ball():
    """Irradiance of the ball's disc: pi L r^2 h / d^3 (Lambert)."""
    radius, height = 0.4, 0.7
    mesh = replace(ball(radius, (0, 0, height), 32), materials=(matt(0.0, 2.0),))
    foot = mesh_of(rectangle((3, 3, 0), (1e-3, 0, 0), (0, 1e-3, 0)))  # what the ground lies at
    stage = stage_of(both(mesh, foot), Scene(sun=None, sky=DARK, ground=Ground()))
    baked = stage.baked(0)
    cells, left, front, there = (float(v) for v in baked.bounces.floor_frame)
    assert there == 1
    x, y = (np.arange(baking.MAP) + 0.5) / cells + left, (np.arange(baking.MAP) + 0.5) / cells + front
    x, y = x * baked.unit + baked.origin[0], y * baked.unit + baked.origin[1]
    squared = x**2 + y[:, None] ** 2
    expected = 2.0 * radius**2 * height / (squared + height**2) ** 1.5
    is_near = squared < 0.8**2
    assert is_near.sum() > 50
    off = baked.bounces.floor[is_near][:, :3] - expected[is_near][:, None]
    assert np.abs(off).max() < 5 * 2.0 / baking.MAP_RAYS
    assert np.sqrt((off**2).mean()) < 0.03


@pytest.mark.slow
def test_a_bulb_that_few_rays_hit_lights_all_walls_evenly(monkeypatch):
    """A bulb of 4 cm in a black box: pi L r^2 cos / d^2, though most probes have no ray that meets it."""
    monkeypatch.setattr(volumes, "ALONG", 36)
    monkeypatch.setattr(volumes, "RAYS", 64)
    radius, radiance = 0.02, 3000.0
    bulb = replace(ball(radius, (0, 0, 0), 16), materials=(matt(0.0, radiance),))
    bounce_scene = painted_mesh((inside_out(box((-1.5, -1.2, -1), (1.5, 1.2, 1))), matt(0.0)))
    stage = stage_of(bulb, Scene(sun=None, sky=DARK), both(bounce_scene, bulb))
    places, normals = walls((-1.5, -1.2, -1), (1.5, 1.2, 1), 8)
    places, normals = places.reshape(-1, 3), normals.reshape(-1, 3)
    distance = np.linalg.norm(places, axis=1)
    expected = radiance * radius**2 * (-places * normals).sum(axis=1) / distance**3
    light = probed(stage, places, normals)[:, 0]
    assert light.mean() == pytest.approx(expected.mean(), rel=0.06)
    # Spherical harmonics of degree 2 are off by up to a tenth of the brightest; a ray more or less would be half of it.
    assert np.abs(light - expected).max() < 0.21 * expected.max()


def both(first: Mesh, second: Mesh) -> Mesh:
    """Two meshes as one."""
    return replace(
        first,
        vertices=np.concatenate([first.vertices, second.vertices]),
        triangles=np.concatenate([first.triangles, second.triangles + len(first.vertices)]),
        normals=np.concatenate([first.normals, second.normals]),
        triangle_material=np.concatenate([first.triangle_material, second.triangle_material + len(first.materials)]),
        triangle_part=np.zeros(len(first.triangles) + len(second.triangles), np.int32),
        materials=first.materials + second.materials,
    )


def room(reflectance: float, window: bool = True, partition: bool = False) -> Mesh:
    """4 x 3 x 2.4 m inside, walls 0.2 m thick, a window to -Y on the left."""
    x, y, z, t = 4.0, 3.0, 2.4, 0.2
    solids = [
        ((-t, -t, -t), (x + t, y + t, 0)),
        ((-t, -t, z), (x + t, y + t, z + t)),
        ((-t, -t, 0), (0, y + t, z)),
        ((x, -t, 0), (x + t, y + t, z)),
        ((0, y, 0), (x, y + t, z)),
    ]
    front = [((0, -t, 0), (x, 0, z))]
    if window:
        front = [
            ((0, -t, 0), (0.5, 0, z)),
            ((1.7, -t, 0), (x, 0, z)),
            ((0.5, -t, 0), (1.7, 0, 0.8)),
            ((0.5, -t, 2.0), (1.7, 0, z)),
        ]
    if partition:
        front.append(((2.4, 0, 0), (2.5, y, z)))
    return mesh_of(np.concatenate([box(*solid) for solid in solids + front]), matt(reflectance))


@pytest.mark.slow
def test_light_through_a_window_is_less_than_the_sky():
    """No place of a room under a sky of radiance 1 is brighter than that sky, and where more is reflected more bounces."""
    places, normals = walls((0, 0, 0), (4, 3, 2.4))
    small = mesh_of(box((3.0, 1.0, 0.5), (3.2, 1.2, 0.7)), matt(0.5))
    means = []
    for reflectance in (0.2, 0.9):
        stage = stage_of(small, Scene(sun=None, sky=EVEN), room(reflectance))
        light = probed(stage, places.reshape(-1, 3), normals.reshape(-1, 3))
        assert light.max() < 1.0 and light.min() >= 0
        means.append(light.mean())
    assert means[1] > 2 * means[0] > 0


def test_a_mirror_in_a_closed_box_that_glows_evenly_is_as_bright_as_its_walls():
    """What probes see in all directions, blurred or not, is the same."""
    low, high = (-1.0, -0.8, -0.6), (1.0, 0.8, 0.6)
    chrome = replace(ball(0.25, (0, 0, 0)), materials=(Material("chrome", (1, 1, 1, 1), roughness=0.4, metallic=1.0),))
    stage = stage_of(chrome, Scene(sun=None, sky=DARK), painted_mesh((inside_out(box(low, high)), matt(0.0, 1.0))))
    picture = painted(stage, camera(40, 30, 26, 20, 15, 0.8), OUT).astype(int)
    assert np.abs(picture - picture[0, 0]).max() <= 3


def test_the_sky_is_not_mirrored_where_it_is_not_seen():
    """The glossy underside of a board, whose normal says that half of what it faces is far away, in a room without a window."""
    board = mesh_of(box((1.2, 1.0, 1.6), (2.6, 1.6, 1.65)), Material("lacquer", (0.02, 0.02, 0.02, 1.0), roughness=0.3))
    view = camera(48, 36, 40, 0, -25, 1.4, (1.9, 1.3, 1.6))
    stage = stage_of(board, Scene(sun=None, sky=EVEN, finish=OUT), room(0.5, window=False))
    assert painted(stage, view).max() <= 1


def test_the_roughest_floor_mirrors_as_much_as_falls_on_it():
    """Between black walls, under an even sky: a lobe that is as wide as a matt surface's receives as much."""
    view = camera(32, 24, 30, 0, 35, 2.0)
    rough = Material("rough", (0, 0, 0, 1.0), roughness=1.0)
    walls = np.concatenate([box((x, -4, 0), (x + 0.1, 4, 1.5)) for x in (-1.1, 1.0)])

    def brightness(floor: Material, *parts) -> float:
        level = np.array(rectangle((-0.9, -4, 0.01), (1.8, 0, 0), (0, 8, 0)))
        stage = stage_of(AWAY, Scene(sun=None, sky=EVEN), painted_mesh((level, floor), *parts))
        seen, radiance = rasterize(stage.at(0), view), np.zeros((view.width * view.height, 4), np.float32)
        paint(stage.baked(0), view, seen, False, False, radiance)
        return float(radiance.reshape(24, 32, 4)[9:15, 12:20, 0].mean())

    shares = [brightness(floor, (walls, matt(0.0))) / brightness(floor) for floor in (matt(0.5), rough)]
    assert 0.3 < shares[0] < 0.7
    np.testing.assert_allclose(shares[1], shares[0], rtol=0.05)


def test_no_ring_shows_where_probes_end():
    """The roughest floor under an even sky, across the border of the probes around a slab below it."""
    floor = mesh_of(rectangle((-8, -8, 0), (16, 0, 0), (0, 16, 0)), Material("rough", (0, 0, 0, 1.0), roughness=1.0))
    view = camera(48, 36, 40, 0, 50, 1.5, (1.75, 0, 0))
    stage = stage_of(floor, Scene(sun=None, sky=EVEN), painted_mesh((box((-1.5, -1.5, -0.2), (1.5, 1.5, -0.05)), matt(0.0))))
    seen, radiance = rasterize(stage.at(0), view), np.zeros((view.width * view.height, 4), np.float32)
    paint(stage.baked(0), view, seen, False, False, radiance)
    row = radiance.reshape(36, 48, 4)[18, :, 0]
    assert np.abs(np.diff(row) / row[1:]).max() < 0.015


@pytest.mark.slow
def test_a_lamp_at_the_ceiling_leaves_no_flecks_around_it():
    """A probe within it, a little below the ceiling that closes it, knows nothing of the ceiling beside it."""
    small = mesh_of(box((3.0, 1.0, 0.5), (3.2, 1.2, 0.7)), matt(0.5))
    scene, place = Scene(sun=None, sky=DARK), room(0.6, window=False)
    empty = stage_of(small, scene, place).baked(0)
    first, cell = empty.bounces.frame[0, :3] * empty.unit + empty.origin, empty.unit / float(empty.bounces.frame[0, 3])
    x, y, z = first + cell * np.floor((np.array([1.5, 1.4, 2.4]) - first) / cell)
    shade = box((x - 0.06, y - 0.06, z - 0.02), (x + 0.06, y + 0.06, 2.4))
    lamp = painted_mesh((shade[(shade[..., 2] < z).any(axis=1)], matt(0.5, 30.0)))
    stage, u = stage_of(small, scene, both(place, lamp)), np.linspace(-1, 1, 40)
    square = np.concatenate([np.stack(side, axis=1) for s in (-1, 1) for side in ((u, 0 * u + s), (0 * u + s, u))])
    near, far = (
        np.median(probed(stage, np.column_stack([square * reach + (x, y), np.full(160, 2.4)]), [(0, 0, -1)] * 160))
        for reach in (0.09, 0.16)
    )
    assert near < 1.15 * far


@pytest.mark.parametrize("window", quick([True, False], True))
@pytest.mark.slow
def test_a_dark_room_beside_a_lit_one_stays_dark(window, monkeypatch):
    """A partition of 10 cm, less than half of what lies between probes; without a window a lamp stands in the first room."""
    monkeypatch.setattr(lightmaps, "CELL", 0.1)
    lamp = PointLight(position=(-2.6, 0.4, 0.6), strength=1.0)  # from the small thing's middle
    sun = Sun(azimuth=-10, elevation=40, strength=5.0) if window else None
    small = mesh_of(box((3.1, 1.0, 0.5), (3.3, 1.2, 0.7)), matt(0.5))
    scene = Scene(sun=sun, sky=EVEN if window else DARK, lights=() if window else (lamp,))
    stage = stage_of(small, scene, room(0.7, window, partition=True))
    lit, dark = (
        probed(stage, *(values.reshape(-1, 3) for values in walls(low, high)))
        for low, high in (((0, 0, 0), (2.4, 3, 2.4)), ((2.5, 0, 0), (4, 3, 2.4)))
    )
    assert lit.mean() > 0.02
    assert dark.mean() < 0.007 * lit.mean()
    assert dark.max() < 0.15 * lit.mean()  # in a corner of the partition, where a probe sees past it


@pytest.mark.slow
def test_the_same_bytes_whatever_was_baked_before():
    """Also with another target, which is not part of a place's light."""
    view = camera(60, 45, 40, 20, 20, 1.6, (1.5, 1.5, 1.0))
    scene = Scene(sun=Sun(azimuth=-10, elevation=40), sky=EVEN, finish=OUT)
    place = room(0.6)
    first, second = (mesh_of(box((1, 1, 0), (1.5, 1.5, h)), matt(0.5)) for h in (0.4, 0.8))
    once = painted(stage_of(first, scene, place), view)
    stage_of(second, scene, place).baked(0)
    assert baking._bake.cache_info().hits >= 1
    np.testing.assert_array_equal(painted(stage_of(first, scene, place), view), once)
    baking._bake.cache_clear()
    baking._look.cache_clear()
    np.testing.assert_array_equal(painted(stage_of(first, scene, place), view), once)


def is_bounced(stage) -> bool:
    bounces: Bounces = stage.baked(0).bounces
    return bool(bounces.grid[0] > 0)


@pytest.mark.slow
def test_auto_is_on_indoors_only():
    small = mesh_of(box((1, 1, 0), (1.5, 1.5, 0.4)), matt(0.5))
    street = mesh_of(np.concatenate([rectangle((-9, -9, 0), (18, 0, 0), (0, 18, 0)), box((4, 4, 0), (7, 7, 5))]), matt(0.5))
    scene = Scene(sun=None, sky=EVEN)
    assert is_bounced(stage_of(small, scene, room(0.5), bounces="auto"))
    assert not is_bounced(stage_of(small, scene, room(0.5), bounces="off"))
    assert not is_bounced(stage_of(small, scene, street, bounces="auto"))
    assert not is_bounced(stage_of(small, scene, mesh_of(box((-4, -4, -1), (4, 4, 0)), matt(0.5)), bounces="auto"))
    assert not is_bounced(stage_of(small, scene, bounces="auto"))
    assert is_bounced(stage_of(small, scene, street))


@pytest.mark.slow
def test_a_wide_place_has_close_probes_around_its_origin_only(monkeypatch):
    """As far apart as is allowed at most, or little more; at their border nothing is seen of it on a wall in the open."""
    monkeypatch.setattr(volumes, "MOST", 14_000)
    wide = mesh_of(
        np.concatenate([rectangle((-200, -200, 0), (400, 0, 0), (0, 400, 0)), box((-40, 6, 0), (40, 7, 9))]), matt(0.3)
    )
    small = mesh_of(box((-0.2, -0.2, 0), (0.2, 0.2, 0.4)), matt(0.5))
    scene = Scene(sun=None, sky=EVEN, finish=OUT)
    stage = stage_of(small, scene, wide)
    baked = stage.baked(0)
    assert np.prod(baked.bounces.grid) <= 14_000
    assert baked.unit / float(baked.bounces.frame[0, 3]) < 1.3 * volumes.WIDEST
    view = camera(120, 40, 60, 0, 10, 16, (0, 0, 2.0))
    row = painted(stage, view)[18].astype(int)
    assert np.abs(np.diff(row, axis=0)).max() <= 6


def canyon(width: float, height: float, reach: float) -> np.ndarray:
    """Two walls of a street that faces along y, and black ground."""
    walls = [box((s, -reach, 0), (s + 0.4, reach, height)) for s in (-width / 2 - 0.4, width / 2)]
    return np.concatenate([rectangle((-reach, -reach, 0), (2 * reach, 0, 0), (0, 2 * reach, 0)), *walls])


@pytest.mark.slow
def test_shade_far_from_the_origin_is_known_from_a_wider_volume(monkeypatch):
    """In a long street of black walls a wall sees (1 - sin e) / 2 of an even sky, e how high the other wall reaches above it;
    65 m away, where probes are 6 m apart, and 5 m away. No seam shows where one volume ends.
    """
    monkeypatch.setattr(volumes, "MOST", 14_000)
    black, width, height = matt(0.0), 14.0, 12.0
    small = mesh_of(box((-0.2, -0.2, 0), (0.2, 0.2, 0.4)), matt(0.5))
    stage = stage_of(small, Scene(sun=None, sky=EVEN, finish=OUT), painted_mesh((canyon(width, height, 300.0), black)))
    baked = stage.baked(0)
    frame, shape = baked.bounces.frame, baked.bounces.grid
    assert frame[1, 6] > 0
    up = np.linspace(1.5, 9, 6)
    rises = height - up
    expected = (1 - rises / np.hypot(rises, width)) / 2

    def found(away):
        return probed(stage, np.column_stack([np.full(6, width / 2), np.full(6, away), up]), [(-1, 0, 0)] * 6)[:, 0]

    np.testing.assert_allclose(found(65.0), expected, atol=0.12)
    np.testing.assert_allclose(found(5.0), expected, atol=0.06)
    border = float(frame[0, 1] + (shape[1] - 1) / frame[0, 3]) * baked.unit + baked.origin[1]
    assert 10 < border < 20
    np.testing.assert_allclose(found(border - 0.05), found(border + 0.05), atol=0.015)


def test_workers_of_a_place_find_these_kernels_compiled():
    """Also when it is the place that decides: what is rendered beforehand has a roof."""
    small = mesh_of(box((1, 1, 0), (1.5, 1.5, 0.4)), matt(0.5))
    shot = stage_of(small, Scene(sun=None, sky=EVEN), room(0.5), bounces="auto").shot
    tiny = warm._small(shot)
    assert is_bounced(raster.stage(tiny, lambda spec, step=None: warm._card()))


@pytest.mark.slow
def test_a_green_ball_colours_the_ground_and_its_neighbour():
    green = replace(ball(0.4, (0, 0, 0.4)), materials=(replace(matt(0.5), base_color=(0.05, 0.6, 0.05, 1.0)),))
    scene = Scene(sun=Sun(azimuth=0, elevation=50), sky=EVEN, ground=Ground(), finish=OUT)
    view = camera(80, 60, 90, 0, 35, 2.0, (0, 0, 0.2))
    plain, bounced = (painted(stage_of(green, scene, bounces=b), view).astype(float) for b in ("off", "on"))
    floor = plain[..., 1] < 1.2 * plain[..., 0]
    gained = (bounced - plain)[floor]
    assert gained[:, 1].max() > gained[:, 0].max() + 3
    assert np.abs(gained).max() < 60


@pytest.mark.parametrize(("given", "known"), [(True, "on"), (False, "off"), ("auto", "auto")])
def test_yaml_reads_on_and_off_as_truth_values(given, known):
    assert parse_options({"bounces": given}).bounces == known


def test_an_unknown_value_is_told():
    with pytest.raises(RecipeError, match=r"engine.bounces: expected auto, on, fine or off, found 'much'"):
        parse_options({"bounces": "much"})
