"""zoo:interior: closed rooms but for their windows, doors that match, sizes, determinism."""

from __future__ import annotations

import numpy as np
import pytest

from viewsphere_zoo.families.interior import Interior, draw, interior, rooms
from viewsphere_zoo.indoors.plan import SIDES, Room
from zoo_mesh import assert_sound, drawn, part_vertices, seeds

SEEDS = seeds(12, few=4)


def parameters(seed: int) -> Interior:
    return draw(np.random.default_rng(seed))


@pytest.mark.parametrize("seed", seeds(6))
def test_draws_are_sound_and_differ(seed: int) -> None:
    mesh, p = drawn("interior", seed), parameters(seed)
    assert_sound(mesh, 25_000, least=500)
    assert mesh.vertices.tobytes() == interior(p).vertices.tobytes()
    assert {"floor", "wall", "ceiling", "skirting", "door", "window_frame", "ceiling_lamp", "outer_wall"} <= {*mesh.parts}
    assert np.abs(part_vertices(mesh, "floor")[:, 2]).max() == 0
    assert part_vertices(mesh, "ceiling")[:, 2].min() == pytest.approx(p.height - 0.1, abs=0.02)  # the lamp's bowl hangs lower
    assert mesh.vertices.tobytes() != drawn("interior", seed + 1).vertices.tobytes()


def test_draws_hold_rooms_of_all_kinds_and_flats() -> None:
    found = [parameters(seed) for seed in range(60)]
    assert {room.kind for p in found for room in p.rooms} == {"living_room", "bedroom", "kitchen", "office", "hall"}
    assert 5 <= sum(len(p.rooms) > 1 for p in found) <= 25
    assert {room.floor.kind for p in found for room in p.rooms} == {"planks", "parquet", "tiles", "carpet"}


def beyond(room: Room, directions: np.ndarray, origin: np.ndarray, height: float) -> tuple[np.ndarray, np.ndarray]:
    """Where rays leave the room's box: the side's number (4 below, 5 above), and the point."""
    with np.errstate(divide="ignore"):
        low, high = np.array([*room.low, 0.0]), np.array([*room.high, height])
        t = np.where(directions > 0, high - origin, low - origin) / directions
    axis = t.argmin(axis=1)
    point = origin + directions * t.min(axis=1)[:, None]
    up = np.take_along_axis(directions, axis[:, None], 1)[:, 0] > 0
    return np.select([axis == 0, axis == 1], [np.where(up, 1, 3), np.where(up, 0, 2)], np.where(up, 5, 4)), point


@pytest.mark.parametrize("seed", SEEDS)
def test_a_room_is_open_where_its_windows_are_and_nowhere_else(seed: int) -> None:
    pytest.importorskip("embreex")
    from trimesh import Trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    p, mesh = parameters(seed), drawn("interior", seed)
    caster = RayMeshIntersector(Trimesh(mesh.vertices, mesh.triangles, process=False))
    rng = np.random.default_rng(seed)
    for room in p.rooms:
        directions = rng.standard_normal((4000, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        origin = np.array([*(np.array(room.low) + room.high) / 2, 1.3])
        open_ = ~caster.intersects_any(np.broadcast_to(origin, directions.shape), directions)
        side, point = beyond(room, directions, origin, p.height)
        windows = [(SIDES.index(o.side), o) for o in room.openings if o.opens == "window"]
        through = np.zeros(len(point), bool)
        for k, o in windows:
            x, y = room.middle(o.side)
            right = np.array({"rear": (1, 0), "right": (0, -1), "front": (-1, 0), "left": (0, 1)}[o.side])
            across, z = (point[:, :2] - (x, y)) @ right, point[:, 2]
            through |= (side == k) & (np.abs(across - o.x) < o.width / 2) & (np.abs(z - o.foot - o.height / 2) < o.height / 2)
        ways = any(o.opens in ("door", "doorway") for o in room.openings)  # light of other rooms comes through these
        assert not (open_ & ~through).any() or ways
        assert not windows or open_[through].mean() > 0.3  # frames and curtains hide the rest


@pytest.mark.parametrize("seed", [s for s in range(40) if len(parameters(s).rooms) > 1][:4])
def test_the_rooms_of_a_flat_lie_apart_and_doors_match(seed: int) -> None:
    p = parameters(seed)
    boxes = [np.array([*room.low, *room.high]) for room in p.rooms]
    for i, a in enumerate(boxes):
        for b in boxes[:i]:
            assert max(b[0] - a[2], a[0] - b[2], b[1] - a[3], a[1] - b[3]) >= 0.12 - 1e-9
    hall = next(room for room in p.rooms if room.kind == "hall")
    assert sum(o.opens == "doorway" for o in hall.openings) == len(p.rooms) - 1
    for room in p.rooms:
        door = next((o for o in room.openings if o.opens == "door"), None)
        if room is not hall:
            assert door is not None
            facing = [o for o in hall.openings if o.side != door.side and o.opens == "doorway"]
            assert any(abs(hall.along(door.side, room, door.x) + o.x) < 1e-9 for o in facing)


def test_rooms_are_the_air_between_floor_and_ceiling() -> None:
    p = parameters(3)
    (box,) = rooms(p)
    np.testing.assert_allclose(box.min(axis=0), (*p.rooms[0].low, 0))
    np.testing.assert_allclose(box.max(axis=0), (*p.rooms[0].high, p.height))
