"""Chairs: sizes, parts, soundness, one connected thing, real openings, and the variety of draws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

import viewsphere_zoo as zoo
from quick import quick
from viewsphere.assets.mesh import Mesh
from viewsphere_zoo.families.chair import Armchair, Chair, Dining, Folding, Office, Shell, Stool, Windsor, chair, draw
from zoo_mesh import assert_sound, drawn, faces, outward_share, part_vertices

MOST = 46_000
CHAIRS: dict[str, Chair] = {
    "slats": Dining(),
    "ladder": Dining(back="ladder", seat="rush", legs="turned", stretchers="box", arms=True),
    "cross": Dining(back="cross", seat="padded", legs="square", stretchers="h", height=0.86),
    "splat": Dining(back="splat", stretchers="none", height=0.98),
    "padded": Dining(back="padded", seat="padded", rungs=7, arms=True),
    "comb": Windsor(),
    "bow": Windsor(back="bow", stretchers=False),
    "shell": Shell(),
    "mesh": Office(headrest=True),
    "task": Office(back="padded", arms="loop", bright=True),
    "executive": Office(back="executive", arms="none", height=1.15),
    "track": Armchair(),
    "rolled": Armchair(body="rolled", buttons=4, feet="bun", foot=0.08),
    "sloped": Armchair(body="sloped", feet="metal", piping=False),
    "wing": Armchair(body="wing", height=1.05, buttons=3, arm=0.11),
    "tub": Armchair(body="tub", height=0.76, arm=0.1, width=0.76, depth=0.74, feet="block", foot=0.08),
    "lounge": Armchair(body="wood", width=0.7, arm=0.055, lean=0.4, height=0.82),
    "bar": Stool(back=0.25),
    "low": Stool(height=0.45, seat="square", base="steel", padded=True),
    "milking": Stool(height=0.45, base="three"),
    "saddle": Stool(seat="saddle", height=0.68),
    "column": Stool(base="column", padded=True, back=0.25),
    "steel": Folding(),
    "slatted": Folding(kind="slatted"),
    "director": Folding(kind="director", width=0.58, height=0.86),
}


class Chairs(dict[str, Mesh]):
    """The chairs of these names, each built when it is first asked for."""

    def __missing__(self, name: str) -> Mesh:
        return self.setdefault(name, chair(CHAIRS[name]))


@pytest.fixture(scope="module")
def built() -> dict[str, Mesh]:
    return Chairs()


@pytest.mark.parametrize("name", quick(CHAIRS, *list(CHAIRS)[::2]))
def test_a_chair_is_sound_and_stands_centred_on_the_floor(built: dict[str, Mesh], name: str) -> None:
    mesh = built[name]
    assert_sound(mesh, MOST)
    np.testing.assert_allclose(mesh.bounds.sum(axis=0)[:2] / 2, 0, atol=1e-5)
    assert float(mesh.bounds[0, 2]) == pytest.approx(0, abs=1e-6)
    assert outward_share(mesh) > 0.999


def _solids(mesh: Mesh) -> tuple[int, np.ndarray]:
    """How many solids there are, and the number of each triangle's."""
    _, place = np.unique(np.round(mesh.vertices, 5), axis=0, return_inverse=True)
    corners = place.ravel()[mesh.triangles]
    count = int(place.max()) + 1
    links = coo_array((np.ones(2 * len(corners)), corners[:, [0, 1, 1, 2]].reshape(-1, 2).T), (count, count))
    solids, of_place = connected_components(links)
    return solids, of_place[corners[:, 0]]


@pytest.mark.parametrize("name", quick(CHAIRS, *list(CHAIRS)[::2]))
def test_a_chair_is_one_thing(built: dict[str, Mesh], name: str) -> None:
    """Every solid touches another: by points on the surfaces at most 10 mm apart, all are one graph."""
    mesh = built[name]
    solids, of_triangle = _solids(mesh)
    corners, area = faces(mesh)
    size = np.linalg.norm(area, axis=1) / 2
    rng = np.random.default_rng(1)
    picks = rng.choice(len(size), 40_000, p=size / size.sum())
    a, b = np.sort(rng.uniform(size=(2, len(picks), 1)), axis=0)
    points = corners[picks, 0] * a + corners[picks, 1] * (b - a) + corners[picks, 2] * (1 - b)
    solid = of_triangle[picks]
    near = KDTree(points).query_pairs(0.01, output_type="ndarray")
    touching = solid[near]
    parts = connected_components(coo_array((np.ones(len(near)), touching.T), (solids, solids)))[1]
    lone = np.unique(parts[solid], return_counts=True)
    named = {mesh.parts[mesh.triangle_part[picks[k]]] for k in np.flatnonzero(parts[solid] != lone[0][lone[1].argmax()])}
    assert len(lone[0]) == 1, named


@pytest.mark.parametrize("name", quick(CHAIRS, *list(CHAIRS)[1::2]))
def test_a_chair_has_the_size_that_was_asked_for(name: str) -> None:
    p = CHAIRS[name]
    if isinstance(p, Stool):
        p = replace(p, height=p.height * 1.06, back=p.back * 1.06)
        top, seat = p.height + p.back, p.height
    else:
        p = replace(p, height=p.height * 1.06, seat_height=p.seat_height * 1.06)
        top, seat = p.height + (0.13 if isinstance(p, Office) and p.headrest else 0), p.seat_height
    mesh = chair(p)
    assert zoo.real_size(mesh)[1] == pytest.approx(top, abs=0.04)
    middle = part_vertices(mesh, "seat", "shell")
    middle = middle[np.abs(middle[:, :2]).max(axis=1) < 0.11] if name == "shell" else middle
    assert middle[middle[:, 2] < seat + 0.06, 2].max() == pytest.approx(seat, abs=0.035)


@pytest.mark.parametrize("name", quick(CHAIRS, *list(CHAIRS)[::2]))
def test_a_chair_faces_minus_y_and_is_symmetric(built: dict[str, Mesh], name: str) -> None:
    mesh = built[name]
    backs = ("back", "crest", "headrest", "wing")
    if any(part.startswith(backs) for part in mesh.parts):
        high = part_vertices(mesh, *backs)
        assert high[high[:, 2] > 0.9 * high[:, 2].max(), 1].mean() > 0.1
    if name == "shell":
        high = part_vertices(mesh, "shell")
        assert high[high[:, 2] > 0.7, 1].min() > 0
    turned = ("leg", "hinge", "castor", "base", "lever", "footrest")  # what is crossed, or turned about the column
    even = part_vertices(mesh, *(part for part in mesh.parts if not part.startswith(turned) or part == "backrest"))
    even[:, 0] -= (even[:, 0].min() + even[:, 0].max()) / 2
    away, _ = KDTree(even).query(even * (-1, 1, 1))
    assert np.quantile(away, 0.99) < 0.005


def _open_share(mesh: Mesh, low: tuple[float, float], high: tuple[float, float]) -> float:
    """Share of rays along y through a rectangle (x, z) that pass the chair."""
    pytest.importorskip("embreex")
    from trimesh import Trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    x, z = (g.ravel() for g in np.meshgrid(*(np.linspace(a, b, 60) for a, b in zip(low, high, strict=True))))
    origins, d = np.column_stack([x, np.full(len(x), -3.0), z]), (0.0, 1.0, 0.0)
    caster = RayMeshIntersector(Trimesh(mesh.vertices, mesh.triangles, process=False))
    return float((caster.intersects_first(origins, np.broadcast_to(d, origins.shape)) < 0).mean())


@pytest.mark.parametrize(
    ("name", "low", "high", "least", "most"),
    [
        ("slats", (-0.13, 0.6), (0.13, 0.78), 0.25, 0.75),
        ("ladder", (-0.13, 0.55), (0.13, 0.82), 0.25, 0.75),
        ("cross", (-0.13, 0.62), (0.13, 0.76), 0.4, 0.9),
        ("comb", (-0.13, 0.55), (0.13, 0.82), 0.5, 0.95),
        ("mesh", (-0.1, 0.85), (0.1, 0.98), 0.4, 0.9),
        ("slatted", (-0.13, 0.55), (0.13, 0.78), 0.25, 0.9),
        ("bar", (-0.1, 0.1), (0.1, 0.6), 0.5, 0.97),
        ("director", (-0.2, 0.05), (0.2, 0.4), 0.4, 0.9),
        ("padded", (-0.1, 0.6), (0.1, 0.8), 0.0, 0.0),
    ],
)
def test_one_can_look_through_what_is_open(
    built: dict[str, Mesh], name: str, low: tuple, high: tuple, least: float, most: float
) -> None:
    assert least <= _open_share(built[name], low, high) <= most


def test_an_office_chair_rolls_on_five_castors(built: dict[str, Mesh]) -> None:
    x, y, z = part_vertices(built["task"], "castor").T
    wheels = z < 0.002
    angle = np.degrees(np.arctan2(y[wheels], x[wheels]))
    groups = np.unique(np.round((angle - angle[0]) / 72).astype(int) % 5)
    assert len(groups) == 5 and z.min() == pytest.approx(0, abs=1e-6)


def test_the_legs_of_a_folding_chair_cross(built: dict[str, Mesh]) -> None:
    front, rear = (part_vertices(built["slatted"], f"leg_{end}") for end in ("front", "rear"))
    for level, sign in ((0.05, -1), (0.4, 1)):
        near = [v[np.abs(v[:, 2] - level) < 0.06, 1].mean() for v in (front, rear)]
        assert np.sign(near[0] - near[1]) == sign


def test_parts_come_with_their_options() -> None:
    assert "stretcher" not in chair(Dining(stretchers="none")).parts
    assert {"armrest", "back_rung"} <= set(chair(Dining(arms=True, back="ladder")).parts)
    assert [_slats(chair(Dining(rungs=count))) for count in (3, 8)] == [3, 8]
    assert "armrest" not in chair(Office(arms="none")).parts and "button" not in chair(Armchair()).parts
    assert {"footrest", "backrest"} <= set(chair(Stool(back=0.2)).parts)


def _slats(mesh: Mesh) -> int:
    """Boards in the back."""
    return len(np.unique(_solids(mesh)[1][mesh.triangle_part == mesh.parts.index("back_slat")]))


def test_one_seed_gives_one_chair() -> None:
    a, b, other = drawn("chair", 4), zoo.build("chair", np.random.default_rng(4)), drawn("chair", 3)
    for name in ("vertices", "triangles", "normals", "triangle_material", "triangle_part"):
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes()
    assert a.materials == b.materials and a.parts == b.parts
    assert a.vertices.tobytes() != other.vertices.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("count", [10, 40])
def test_draws_are_sound_and_differ(count: int) -> None:
    meshes = [drawn("chair", seed) for seed in range(count)]
    for mesh in meshes:
        assert_sound(mesh, MOST)
    sizes = np.array([zoo.real_size(m) for m in meshes])
    for k, (low, high) in enumerate(((0.27, 1.0), (0.4, 1.35), (0.27, 1.0))):
        assert low < sizes[:, k].min() and sizes[:, k].max() < high
    assert (np.ptp(sizes, axis=0) > 0.3 * sizes.mean(axis=0)).all()
    colors = np.array([_main_color(mesh) for mesh in meshes]) ** (1 / 2.2)
    looks = np.concatenate([colors, sizes / sizes.std(axis=0) / 10], axis=1)
    assert (np.linalg.norm(looks[:, None] - looks[None], axis=2) + np.eye(count) * 9).min() > 0.01
    assert np.median(np.linalg.norm(colors[:, None] - colors[None], axis=2)) > 0.2


def _main_color(mesh: Mesh) -> np.ndarray:
    """Base colour of the material with the largest surface."""
    area = np.linalg.norm(faces(mesh)[1], axis=1)
    return np.array(mesh.materials[int(np.bincount(mesh.triangle_material, area).argmax())].base_color[:3])


def test_two_hundred_draws_cover_all_styles() -> None:
    chairs = [draw(np.random.default_rng(seed)) for seed in range(200)]
    kinds = [type(c) for c in chairs]
    for kind, least in ((Dining, 20), (Windsor, 6), (Shell, 4), (Office, 20), (Armchair, 20), (Stool, 18), (Folding, 18)):
        assert kinds.count(kind) >= least, kind
    assert len({c.back for c in chairs if isinstance(c, Dining)}) == 5
    assert len({c.back for c in chairs if isinstance(c, Office)}) == 3
    assert len({c.body for c in chairs if isinstance(c, Armchair)}) == 6
    assert len({c.base for c in chairs if isinstance(c, Stool)}) == 4
    assert len({c.kind for c in chairs if isinstance(c, Folding)}) == 3
