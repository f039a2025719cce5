"""Bicycles: measures, parts, soundness, the drive, the spokes and the holes between them, variety."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import viewsphere as vs
import viewsphere_zoo as zoo
from quick import quick
from viewsphere.assets.exporting.glb import glb_bytes
from viewsphere_zoo.cycle.chain import PITCH, Pulley, pitch_radius, rollers, sprocket
from viewsphere_zoo.cycle.layout import Layout
from viewsphere_zoo.cycle.wheels import Hub, Wheel, spoke_ends
from viewsphere_zoo.families.bicycle import STYLES, Bicycle, bicycle, draw
from zoo_mesh import assert_sound, drawn, outward_share, part_vertices

MOST = 60_000
built = cache(bicycle)


def middle(points: np.ndarray) -> np.ndarray:
    return (points.min(axis=0) + points.max(axis=0)) / 2


def straight(style: str) -> Bicycle:
    return replace(STYLES[style], steering=0.0)


@pytest.mark.parametrize(
    ("style", "factor"),
    quick([("road", 1.0), ("road", 1.04), ("mountain", 1.03), ("step_through", 0.98)], ("road", 1.04), ("step_through", 0.98)),
)
def test_a_bicycle_has_the_measures_that_were_asked_for(style: str, factor: float) -> None:
    p = straight(style)
    g = replace(p.geometry, wheelbase=p.geometry.wheelbase * factor, saddle=p.geometry.saddle * factor)
    p = replace(p, geometry=g, cockpit=replace(p.cockpit, width=p.cockpit.width * factor))
    mesh = built(p)
    front, rear = (part_vertices(mesh, f"wheel_{end}_tyre") for end in ("front", "rear"))
    np.testing.assert_allclose(middle(rear) - middle(front), (0, g.wheelbase, 0), atol=1e-4)
    knob = 0.004 * p.wheel.knobs
    for tyre in (front, rear):
        assert np.ptp(tyre[:, 2]) == pytest.approx(2 * (p.wheel.radius + knob), abs=0.002)
        assert tyre[:, 2].min() == pytest.approx(0, abs=1e-3)
    bracket = middle(part_vertices(mesh, "bottom_bracket"))
    assert bracket[2] == pytest.approx(p.wheel.radius + knob - g.drop, abs=1e-3)
    top = part_vertices(mesh, "saddle")[:, 2].max() - bracket[2]
    assert top == pytest.approx(g.saddle * np.sin(np.radians(g.seat_angle)), abs=0.02)
    assert np.ptp(part_vertices(mesh, "handlebar")[:, 0]) == pytest.approx(p.cockpit.width, abs=0.045)
    np.testing.assert_allclose(mesh.bounds.sum(axis=0)[:2] / 2, 0, atol=1e-6)
    assert mesh.bounds[0, 2] == pytest.approx(0, abs=1e-6)
    width, height, length = zoo.real_size(mesh)
    assert 0.4 < width < 0.85 and 0.9 < height < 1.25 and 1.6 < length < 2.0


@pytest.mark.parametrize("style", STYLES)
def test_a_bicycle_faces_minus_y_and_has_its_parts(style: str) -> None:
    p = straight(style)
    mesh = built(p)
    shift = middle(part_vertices(mesh, "bottom_bracket"))[0]
    order = ("wheel_front_hub", "handlebar", "saddle", "wheel_rear_hub")
    assert (np.diff([middle(part_vertices(mesh, name))[1] for name in order]) > 0).all()
    for name in ("chain", "chainring", "cassette", "crank_right", "pedal_right", "grip_right"):
        assert (part_vertices(mesh, name)[:, 0] < shift + 0.001).all(), name
    for name in ("crank_left", "pedal_left", "grip_left"):
        assert (part_vertices(mesh, name)[:, 0] > shift).all(), name
    common = "frame fork headset stem seat_post cable wheel_front_spokes wheel_rear_spokes wheel_front_rim"
    for name in common.split():
        part_vertices(mesh, name)
    fitted = {
        "derailleur_rear": p.gears.derailleur,
        "derailleur_front": len(p.gears.rings) > 1,
        "chain_guard": p.gears.guard != "none",
        "wheel_front_rotor": p.brake == "disc",
        "mudguard_rear": p.guards != "none",
        "carrier": p.carrier,
        "basket": p.basket != "none",
        "bottle": p.bottles > 0,
        "light_front": p.lights,
        "bell": p.cockpit.bell,
        "kickstand": p.kickstand,
        "bag_left": p.panniers > 0,
    }
    for name, there in fitted.items():
        assert (name in mesh.parts) == there, name
    assert len(set(mesh.parts)) == len(mesh.parts)


FULL = replace(
    STYLES["step_through"],
    gears=replace(STYLES["road"].gears, guard="ring"),
    panniers=2,
    basket="wire",
    saddle_bag=True,
)
OTHERS = {
    "road": STYLES["road"],
    "mountain": STYLES["mountain"],
    "step_through": STYLES["step_through"],
    "shock": replace(STYLES["mountain"], frame=replace(STYLES["mountain"].frame, shock=True), bottles=0),
    "wave": replace(STYLES["step_through"], frame=replace(STYLES["step_through"].frame, shape="wave"), steering=10.0),
    "mixte": replace(FULL, frame=replace(FULL.frame, shape="mixte"), carrier=True),
    "bagged": replace(STYLES["mountain"], frame_bag=True, bottles=0, lights=True, steering=-8.0),
    "case": replace(STYLES["step_through"], gears=replace(STYLES["step_through"].gears, guard="case")),
}


@pytest.mark.parametrize("name", quick(OTHERS, "road", "shock", "case"))
@pytest.mark.slow
def test_a_bicycle_is_sound_and_shows_its_outside(name: str) -> None:
    mesh = built(OTHERS[name])
    assert_sound(mesh, MOST)
    assert outward_share(mesh) > 0.998


def test_steering_turns_the_front_and_keeps_both_wheels_on_the_ground() -> None:
    p = STYLES["road"]
    still, left = built(p), built(replace(p, steering=12.0))
    for mesh in (still, left):
        for end in ("front", "rear"):
            assert part_vertices(mesh, f"wheel_{end}_tyre")[:, 2].min() == pytest.approx(0, abs=2e-4)
    tyre = part_vertices(left, "wheel_front_tyre") - middle(part_vertices(left, "bottom_bracket"))
    ahead = tyre[tyre[:, 1].argmin()]
    reach = p.wheel.radius * np.sin(np.radians(12.0)) * np.sin(np.radians(p.geometry.head_angle))
    assert ahead[0] == pytest.approx(reach, abs=0.04) and ahead[0] > 0.03

    def frame_of(mesh) -> np.ndarray:
        points = part_vertices(mesh, "frame")
        return points - middle(points)

    np.testing.assert_allclose(np.ptp(frame_of(still), axis=0), np.ptp(frame_of(left), axis=0), atol=2e-3)


def test_the_layout_follows_the_frame_geometry() -> None:
    for p in STYLES.values():
        at = Layout(p.geometry, p.wheel.radius)
        g = p.geometry
        assert np.linalg.norm(at.rear_axle - at.bracket) == pytest.approx(g.chainstay)
        assert np.linalg.norm(at.crown - at.front_axle) == pytest.approx(g.fork_length)
        offset = at.front_axle - at.crown
        assert np.linalg.norm(offset - offset @ at.steering * at.steering) == pytest.approx(g.rake)
        ground = at.crown - at.steering * at.crown[2] / at.steering[2]
        a = np.radians(g.head_angle)
        trail = (p.wheel.radius * np.cos(a) - g.rake) / np.sin(a)
        assert at.front_axle[1] - ground[1] == pytest.approx(trail)
        assert 0.03 < trail < 0.12


@pytest.mark.parametrize(("spokes", "crosses"), [(20, 2), (24, 2), (28, 3), (32, 3), (36, 3), (32, 0)])
def test_spokes_are_laced_evenly_and_cross_as_often_as_asked(spokes: int, crosses: int) -> None:
    w = Wheel(spokes=spokes, crosses=crosses)
    hub, rim = spoke_ends(w, Hub())
    angles = np.sort(np.arctan2(rim[:, 2], rim[:, 1]))
    np.testing.assert_allclose(np.diff(angles), 2 * np.pi / spokes, atol=1e-9)
    assert np.linalg.norm(rim[:, 1:], axis=1) == pytest.approx(w.inner + 0.003)
    half = spokes // 2
    for side in (slice(0, half), slice(half, None)):
        a, b = hub[side, 1:], rim[side, 1:]
        count = [sum(crossing(a[i], b[i], a[j], b[j]) for j in range(half) if j != i) for i in range(half)]
        assert set(count) == {crosses}


def crossing(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> bool:
    """Return whether the segments a b and c d meet."""

    def side(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> float:
        return float((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))

    return side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0


def test_a_chain_lies_on_its_pulleys_with_links_of_half_an_inch() -> None:
    r, apart = pitch_radius(20), 40 * PITCH
    equal = rollers([Pulley(0, 0, r), Pulley(apart, 0, r)])
    assert len(equal) == 2 * round((2 * np.pi * r + 2 * apart) / PITCH / 2)
    front, rear = Pulley(0, 0, pitch_radius(50)), Pulley(0.41, 0.07, pitch_radius(18))
    lower, upper = Pulley(0.4, -0.1, 0.022), Pulley(0.42, -0.04, 0.022, -1)
    centres = rollers([front, lower, upper, rear])
    assert len(centres) % 2 == 0
    step = np.linalg.norm(centres - np.roll(centres, 1, axis=0), axis=1)
    assert np.abs(step / PITCH - 1).max() < 0.025
    for p in (front, lower, upper, rear):
        away = np.linalg.norm(centres - (p.y, p.z), axis=1)
        assert away.min() == pytest.approx(p.radius, abs=2e-4)
    assert (np.linalg.norm(centres - (front.y, front.z), axis=1) < front.radius + 1e-4).sum() >= 20


@pytest.mark.parametrize("teeth", [11, 32, 50])
def test_a_sprocket_has_its_teeth(teeth: int) -> None:
    solid = sprocket(teeth, 0.3)
    radius = np.linalg.norm(solid.vertices[:, 1:], axis=1)
    tips = solid.vertices[radius > pitch_radius(teeth) + 0.003]
    assert len({round(float(a), 6) for a in np.arctan2(tips[:, 2], tips[:, 1])}) == teeth
    edges = Counter(tuple(sorted(e)) for t in solid.triangles.tolist() for e in zip(t, (*t[1:], t[0]), strict=True))
    merged = Counter[tuple[tuple[float, ...], ...]]()
    for (i, j), n in edges.items():
        ends = sorted(tuple(solid.vertices[k].round(9).tolist()) for k in (i, j))
        merged[tuple(ends)] += n
    assert set(merged.values()) == {2}


def side_view(tmp_path: Path, mesh, target: np.ndarray, height: float) -> np.ndarray:
    """The mask (480, 640) seen from the right, nearly without perspective; height is the picture's, metres."""
    file = tmp_path / "bicycle.glb"
    file.write_bytes(glb_bytes(mesh))
    recipe = vs.Recipe(
        models=[{"source": str(file), "category": "bicycle", "centring": "floor", "up": "+y", "forward": "+z"}],
        viewpoints={"azimuth": 270, "elevation": 0, "distance": 30, "target": target.tolist()},
        camera={"size": [640, 480], "fov_deg": float(np.degrees(2 * np.arctan(height / 60))), "fov_axis": "vertical"},
        scene={"ground": "off"},
        channels=["instances"],
    )
    (sample,) = vs.render(recipe)
    return sample.objects[0].mask


def components(background: np.ndarray) -> Iterator[int]:
    """Pixels of each 4-connected component."""
    left = set(map(tuple, np.argwhere(background).tolist()))
    while left:
        stack, size = [left.pop()], 0
        while stack:
            i, j = stack.pop()
            size += 1
            for n in ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)):
                if n in left:
                    left.remove(n)
                    stack.append(n)
        yield size


@pytest.mark.parametrize(
    ("style", "spokes", "crosses"), [pytest.param("road", 28, 3, marks=pytest.mark.slow), ("mountain", 32, 3)]
)
def test_the_mask_has_a_hole_between_any_two_spokes(tmp_path: Path, style: str, spokes: int, crosses: int) -> None:
    p = straight(style)
    p = replace(p, wheel=replace(p.wheel, spokes=spokes, crosses=crosses))
    mesh = built(p)
    height = 0.78
    mask = side_view(tmp_path, mesh, middle(part_vertices(mesh, "wheel_front_tyre")), height)
    scale = 480 / height
    angle = np.linspace(0, 2 * np.pi, 2000, endpoint=False)
    r = (p.wheel.inner - 0.022) * scale
    ring = mask[(240 + r * np.sin(angle)).astype(int), (320 + r * np.cos(angle)).astype(int)]
    around = np.roll(ring, -int(ring.argmax()))
    edges = np.flatnonzero(np.diff(np.append(around, True).astype(int)))
    gaps = int((np.diff(edges)[::2] * 2 * np.pi * r / 2000 > 3).sum())
    assert spokes - 1 <= gaps <= spokes + 2  # the valve parts one, the fork parts one or hides a spoke or two
    y, x = np.mgrid[:480, :640] + 0.5
    inside = np.hypot(x - 320, y - 240) < (p.wheel.inner - 0.016) * scale
    holes = [n for n in components(~mask & inside) if n >= 4]
    assert len(holes) >= 2 * spokes
    assert 0.55 < sum(holes) / inside.sum() < 0.93
    assert max(holes) < 0.08 * inside.sum()


@pytest.mark.slow
def test_a_whole_bicycle_has_holes_in_its_frame_and_wheels(tmp_path: Path) -> None:
    mesh = built(straight("road"))
    target = middle(mesh.vertices.astype(np.float64))
    mask = side_view(tmp_path, mesh, target, 1.3)
    padded = np.pad(~mask, 1, constant_values=True)
    sizes = sorted(components(padded))[::-1]
    assert len([n for n in sizes if n >= 4]) > 40
    triangle = 0.5 * 0.45 * 0.5 * (480 / 1.3) ** 2
    assert 0.5 * triangle < sizes[1] < 1.5 * triangle


@pytest.mark.slow
def test_one_seed_gives_one_mesh() -> None:
    a, b, other = drawn("bicycle", 4), zoo.build("bicycle", np.random.default_rng(4)), drawn("bicycle", 3)
    for name in ("vertices", "triangles", "normals", "triangle_material", "triangle_part"):
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes()
    assert a.materials == b.materials and a.parts == b.parts
    assert a.vertices.tobytes() != other.vertices.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("count", [5, pytest.param(14, marks=pytest.mark.slow)])
def test_draws_differ_in_shape_and_colour(count: int) -> None:
    meshes = [drawn("bicycle", seed) for seed in range(count)]
    for mesh in meshes:
        assert_sound(mesh, MOST)
    sizes = np.array([zoo.real_size(m) for m in meshes])
    for k, (low, high) in enumerate(((0.4, 0.85), (0.85, 1.3), (1.55, 2.05))):
        assert low < sizes[:, k].min() and sizes[:, k].max() < high
    assert (np.ptp(sizes, axis=0) > 0.1 * sizes.mean(axis=0)).all()
    colors = np.array([next(m for m in mesh.materials if m.name == "frame_paint").base_color[:3] for mesh in meshes])
    looks = np.concatenate([colors ** (1 / 2.2), sizes / sizes.std(axis=0) / 10], axis=1)
    distance = np.linalg.norm(looks[:, None] - looks[None], axis=2) + np.eye(count) * 9
    assert distance.min() > 0.02
    assert np.median(np.linalg.norm(colors[:, None] - colors[None], axis=2)) > 0.2
    assert len({mesh.parts for mesh in meshes}) > count // 2 + 1


def test_a_hundred_draws_cover_what_is_ridden() -> None:
    drawn = [draw(np.random.default_rng(seed)) for seed in range(100)]
    styles = Counter(p.style for p in drawn)
    assert set(styles) == set(STYLES) and min(styles.values()) >= 20
    assert {p.frame.shape for p in drawn} == {"diamond", "swan", "wave", "mixte"}
    assert {p.fork for p in drawn} == {"straight", "raked", "telescopic"}
    assert {p.cockpit.bar for p in drawn} == {"drop", "flat", "riser", "swept"}
    assert {p.gears.guard for p in drawn} == {"none", "ring", "half", "case"}
    assert {p.brake for p in drawn} == {"caliper", "v", "disc", "hub"}
    assert {p.basket for p in drawn} == {"none", "wire", "wicker"}
    assert {p.wheel.bead for p in drawn} == {0.311, 0.292, 0.2795}
    assert len({p.wheel.spokes for p in drawn}) >= 5
    for p in drawn:
        assert p.wheel.knobs == (p.style == "mountain")
        assert (p.cockpit.bar == "drop") <= (p.style == "road")
        assert (p.frame.shape != "diamond") == (p.style == "step_through")
    assert 5 <= sum(p.frame.shock for p in drawn) <= 25
    assert 10 <= sum(p.carrier for p in drawn) <= 50
    assert len({p.colors.frame for p in drawn}) > 90
    assert len({round(p.steering, 6) for p in drawn}) > 90 and max(abs(p.steering) for p in drawn) <= 13
