"""canonical_pose, symmetries and diameter against BOP's errors of poses, written down here from BOP's public definitions.

T. Hodan et al., BOP Challenge 2019 and 2020 (https://bop.felk.cvut.cz/challenges/bop-challenge-2019/, sections 2 and 4), and
the format of its data sets: `models_info.json` holds millimetres, `symmetries_discrete` 16 numbers row by row, and
`symmetries_continuous` an axis and an offset. Nothing here uses viewsphere's own symmetries or geometry.
"""

import itertools
import math

import numpy as np
import pytest
import trimesh
from trimesh.transformations import quaternion_matrix, rotation_matrix, translation_matrix

import viewsphere as vs
from viewsphere.labels.canonical_pose import nearest

SIZE = (32, 24)
STEP = 0.01
"""BOP's `max_sym_disc_step`: share of the diameter by which the farthest vertex moves between two turns, at most."""

X, Y, Z = np.eye(3)
ROUNDED = 1e-7
"""Metres: found symmetries are rounded, of models a metre or two across."""


# BOP's definitions


def turned_around(axis, offset, angle):
    return translation_matrix(offset) @ rotation_matrix(angle, axis) @ translation_matrix(-np.asarray(offset))


def turns_of(info, step=STEP):
    """How many turns stand for all around an axis: the half circumference is at most pi times half the diameter."""
    return math.ceil(math.pi / step) if info["symmetries_continuous"] else 1


def bop_symmetries(info, step=STEP):
    """S_M, (N, 4, 4) in metres: the identity and each discrete one, followed by none or each turn around each axis."""
    count = turns_of(info, step)
    discrete = [np.eye(4), *(np.reshape(one, (4, 4)) for one in info["symmetries_discrete"])]
    turns = [np.eye(4)] + [
        turned_around(one["axis"], one["offset"], 2 * math.pi * i / count)
        for one in info["symmetries_continuous"]
        for i in range(1, count)
    ]
    motions = np.array([turn @ one for one in discrete for turn in turns])
    motions[:, :3, 3] /= 1000
    return motions


def at(pose, points):
    return points @ pose[..., :3, :3].swapaxes(-1, -2) + pose[..., None, :3, 3]


def mssd(estimate, truth, symmetries, vertices):
    """Maximum Symmetry-Aware Surface Distance, metres: min over S of max over x of |P_est x - P_true S x|."""
    apart = at(estimate, vertices) - at(truth @ symmetries, vertices)
    return float(np.linalg.norm(apart, axis=2).max(axis=1).min())


def mspd(estimate, truth, symmetries, vertices, k):
    """Maximum Symmetry-Aware Projection Distance, pixels: the same of projected points."""
    apart = projected(k, at(estimate, vertices)) - projected(k, at(truth @ symmetries, vertices))
    return float(np.linalg.norm(apart, axis=2).max(axis=1).min())


def projected(k, points):
    homogeneous = points @ k.T
    return homogeneous[..., :2] / homogeneous[..., 2:]


def vsd(estimate, truth, mesh, rays, seen, delta, tau):
    """Visible Surface Discrepancy: the share of pixels of either visible surface at which the two differ by tau or more, or of
    which one alone has surface; `seen` are the distances in the picture, infinite ones not being known.
    """
    own, other = distances(mesh, estimate, rays), distances(mesh, truth, rays)
    true_mask = np.isfinite(other) & (other <= seen + delta)
    mask = np.isfinite(own) & ((own <= seen + delta) | true_mask)
    either, both = mask | true_mask, mask & true_mask
    fits = np.zeros_like(both)
    fits[both] = np.abs(own[both] - other[both]) < tau
    return float((either & ~fits).sum() / max(either.sum(), 1))


def distances(mesh, pose, rays):
    """From the camera to the first of a mesh's triangles along rays (N, 3) of length 1, by Moeller and Trumbore; inf: none."""
    a, b, c = at(pose, mesh.vertices)[mesh.faces].transpose(1, 0, 2)
    first, second = b - a, c - a
    across = np.cross(rays[:, None], second)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = 1 / (across * first).sum(axis=2)
        u = (across * -a).sum(axis=2) * scale
        beside = np.cross(-a, first)
        v = (rays[:, None] * beside).sum(axis=2) * scale
        far = (second * beside).sum(axis=1) * scale
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (far > 0)
    return np.where(hit, far, np.inf).min(axis=1)


def test_these_errors_are_those_of_closed_forms():
    """Of a box: a shift moves all points by its length; a turn by what a chord is long."""
    box, k = trimesh.creation.box((0.4, 0.6, 1.0)), np.array([[40, 0, 16], [0, 40, 12], [0, 0, 1.0]])
    none = np.eye(4)[None]
    far = translation_matrix((0, 0, 5))
    assert math.isclose(mssd(translation_matrix((0.03, 0.04, 5)), far, none, box.vertices), 0.05, rel_tol=1e-9)
    chord = 2 * math.hypot(0.2, 0.3) * math.sin(0.35)
    assert math.isclose(mssd(far @ rotation_matrix(0.7, Z), far, none, box.vertices), chord, rel_tol=1e-9)
    assert math.isclose(mspd(translation_matrix((0.03, 0.04, 5)), far, none, box.vertices, k), 40 * 0.05 / 4.5, rel_tol=1e-9)
    rays = rays_of(k)
    seen = distances(box, far, rays)
    assert vsd(far, far, box, rays, seen, 0.015, 0.05) == 0
    assert vsd(translation_matrix((3, 0, 5)), far, box, rays, seen, 0.015, 0.05) == 1
    assert vsd(translation_matrix((0, 0, 5.04)), far, box, rays, seen, 0.015, 0.05) < 0.2
    assert vsd(translation_matrix((0, 0, 5.06)), far, box, rays, seen, 0.015, 0.05) == 1


def rays_of(k):
    """Unit rays through the centres of all pixels, row by row."""
    rows, columns = np.mgrid[: SIZE[1], : SIZE[0]]
    pixels = np.stack([columns + 0.5, rows + 0.5, np.ones(rows.shape)], axis=-1).reshape(-1, 3)
    rays = pixels @ np.linalg.inv(k).T
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)


# models, and a data set with them in random poses


def prism(outline, high):
    """An outline (N, 2) that is star-shaped around the origin, along z, with its ends."""
    n = len(outline)
    low, top = (np.column_stack([outline, np.full(n, z)]) for z in (-high / 2, high / 2))
    vertices = np.concatenate([low, top, [[0, 0, -high / 2], [0, 0, high / 2]]])
    faces = []
    for i, j in ((i, (i + 1) % n) for i in range(n)):
        faces += [[i, j, n + j], [i, n + j, n + i], [2 * n, j, i], [2 * n + 1, n + i, n + j]]
    return trimesh.Trimesh(vertices, faces, process=False)


def ring(radii):
    angles = 2 * math.pi * np.arange(len(radii)) / len(radii)
    return np.column_stack([np.cos(angles) * radii, np.sin(angles) * radii])


STAR_HIGH, CYLINDER_HIGH = 1.1, 1.6
MODELS = {
    "box": trimesh.creation.box((0.6, 0.9, 1.4)),
    "star": prism(ring([0.8, 0.35] * 5), STAR_HIGH),
    "cylinder": prism(ring([0.5] * 40), CYLINDER_HIGH),
    "cone": trimesh.creation.cone(0.6, 1.3, sections=36, transform=translation_matrix((0.3, -0.2, 0.4))),
    "ball": trimesh.creation.icosphere(2, 0.5).apply_translation((0.2, 0.1, -0.3)),
    "bracket": trimesh.util.concatenate(
        [trimesh.creation.box((1.5, 0.5, 0.4)), trimesh.creation.box((0.4, 0.3, 1), translation_matrix((0.5, 0.1, 0.6)))]
    ),
    "slab": trimesh.creation.box((700, 700, 250), translation_matrix((400, -200, 500))),
}
QUARTERS = [turned_around(Z, (400, -200, 500), math.pi / 2 * i).ravel().tolist() for i in (1, 2, 3)]
"""Of the slab, in the axes and millimetres of its file, as its sidecar and BOP write them."""


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("models")
    for name, mesh in MODELS.items():
        mesh.export(folder / f"{name}.ply")
    (folder / "slab.ply.viewsphere.yaml").write_text(f"symmetries: {{discrete: {QUARTERS}}}\n", encoding="utf-8")
    return folder


def entries(folder, **more):
    plain = {"up": "+z", "forward": "-y", "symmetries": "found", "centring": "as_is", **more}
    of_files = [{"source": str(folder / f"{name}.ply"), "category": name, **plain} for name in MODELS if name != "slab"]
    slab = {"source": str(folder / "slab.ply"), "category": "slab", **plain, "unit": "mm", "forward": "+x"}
    return [*of_files, slab]


@pytest.fixture(scope="module")
def made(files, tmp_path_factory):
    """Scenes of all models, each turned in any way; all labels follow from `store`, and from the models' OBJ files."""
    out = tmp_path_factory.mktemp("made")
    recipe = vs.Recipe.model_validate(
        {
            "models": [*entries(files), {"source": "zoo:chair", "symmetries": "found"}],
            "scenes": {"count": 5, "objects": 8, "orientation": "any"},
            "viewpoints": {"kind": "sphere", "count": 2, "distance": [9, 14], "elevation": [-40, 80], "tilt": [-180, 180]},
            "camera": {"size": list(SIZE), "fov_deg": 50},
            "channels": ["depth_ray"],
            "annotations": ["canonical_pose"],
            "splits": {"by": "frame", "train": 1},
            "formats": [],
        }
    )
    vs.generate(recipe, out, workers=0)
    return vs.open(out)


@pytest.fixture(scope="module")
def known(made):
    """Of each model, by its category: what `models_info.json` would say (millimetres), S_M, and its mesh in metres."""
    return {info.category: facts_of(made, info) for info in made.models}


def facts_of(dataset, info):
    said = info.symmetries
    told = {"diameter": info.diameter * 1000, "symmetries_discrete": [], "symmetries_continuous": []}
    for motion in said.discrete if said else ():
        in_mm = np.array(motion)
        in_mm[:3, 3] *= 1000
        told["symmetries_discrete"].append(in_mm.ravel().tolist())
    for one in said.continuous if said else ():
        told["symmetries_continuous"].append({"axis": list(one.axis), "offset": (1000 * np.array(one.offset)).tolist()})
    return told, bop_symmetries(told), trimesh.load(dataset.path(info.obj), process=False, force="mesh")


def allowed(info, vertices):
    """How far the best of the turns that stand for all is off the best one, metres: the farthest vertex from the axis moves
    along a chord of half a step at most.
    """

    def farthest(one):
        return np.linalg.norm(np.cross(vertices - np.array(one["offset"]) / 1000, one["axis"]), axis=1).max()

    reach = max((farthest(one) for one in info["symmetries_continuous"]), default=0.0)
    return ROUNDED + 2 * reach * math.sin(math.pi / turns_of(info) / 2)


def objects_of(dataset):
    return [(sample, o) for sample in dataset for o in sample.objects]


@pytest.mark.slow
def test_the_models_have_the_symmetries_that_they_were_made_with(known):
    counted = {
        name: (len(info["symmetries_discrete"]), len(info["symmetries_continuous"])) for name, (info, _, _) in known.items()
    }
    assert counted == {
        **{"box": (3, 0), "star": (9, 0), "cylinder": (1, 1), "cone": (0, 1), "ball": (0, 3), "bracket": (0, 0)},
        **{"slab": (3, 0), "chair": (0, 0)},
    }


def test_the_canonical_pose_looks_as_the_pose_does(made, known):
    """MSSD and MSPD between them are 0, but for the step of BOP's turns."""
    seen, worst = set(), 0.0
    for sample, o in objects_of(made):
        info, symmetries, mesh = known[o.category]
        if o.category == "ball":
            continue
        limit, vertices = allowed(info, mesh.vertices), mesh.vertices
        for one, other in itertools.permutations((o.camera_from_object, o.canonical_pose)):
            assert mssd(one, other, symmetries, vertices) <= limit, o.category
            points = at(one, vertices)
            if points[:, 2].min() > 0.5:
                k, steepest = sample.camera.K, np.abs(points[:, :2] / points[:, 2:]).max()
                most = k[0, 0] * limit * (1 + 2 * steepest) / (points[:, 2].min() - limit)
                assert mspd(one, other, symmetries, vertices, k) <= most, o.category
                worst = max(worst, most)
        seen.add((o.category, np.abs(o.camera_from_object - o.canonical_pose).max() > 0.01))
    assert worst < 1
    assert {name for name, is_other in seen if is_other} == {"box", "star", "cylinder", "cone", "slab"}


def test_a_ball_keeps_its_centre_alone(made, known):
    """All rotations are symmetries of a ball, so that MSSD is how far the centres are apart; BOP's set has only turns around
    three axes, one at a time.
    """
    _, _, mesh = known["ball"]
    for _, o in objects_of(made):
        if o.category == "ball":
            turn = np.eye(4)
            turn[:3, :3] = o.canonical_pose[:3, :3].T @ o.camera_from_object[:3, :3]
            middle = mesh.bounds.mean(axis=0)
            back = translation_matrix(middle) @ turn @ translation_matrix(-middle)
            assert mssd(o.camera_from_object, o.canonical_pose, back[None], mesh.vertices) <= ROUNDED
            np.testing.assert_allclose(o.canonical_pose[:3, :3], np.eye(3), atol=1e-12)


def test_the_visible_surface_is_the_same(made, known):
    """VSD of the canonical pose is 0 in every picture, and that of a pose by which the model looks otherwise is not."""
    others = []
    for sample, o in objects_of(made):
        _, _, mesh = known[o.category]
        if o.category not in {"box", "star", "slab", "bracket"}:
            continue
        seen, rays = sample.depth_ray.reshape(-1).astype(float), rays_of(sample.camera.K)
        arguments = (o.camera_from_object, mesh, rays, seen, 0.015, 0.02 * o.diameter)
        assert vsd(o.canonical_pose, *arguments) == 0
        others.append(vsd(o.canonical_pose @ rotation_matrix(0.6, (1, 1, 1)), *arguments))
    assert np.median(others) > 0.3


@pytest.mark.slow
def test_diameters_are_the_largest_distances_of_any_two_vertices(made, known):
    for info in made.models:
        vertices = known[info.category][2].vertices.astype(np.float32).astype(float)  # which the OBJ file writes shortly
        largest = max(np.linalg.norm(vertices - one, axis=1).max() for one in vertices)
        assert math.isclose(info.diameter, largest, rel_tol=1e-12), info.key
    for _, o in objects_of(made):
        assert math.isclose(1000 * o.diameter, known[o.category][0]["diameter"], rel_tol=1e-12)


def random_poses(seed, count):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        turn = quaternion_matrix(rng.normal(size=4))
        yield rng, translation_matrix((*rng.uniform(-2, 2, 2), rng.uniform(5, 15))) @ turn


@pytest.mark.parametrize("name", ["box", "star", "cylinder", "cone", "slab"])
def test_poses_that_look_the_same_have_one_canonical_pose(made, known, name):
    """All vertices are where they were, without any symmetry: of any random pose after any symmetry of BOP's set."""
    info, symmetries, mesh = known[name]
    said = next(one.symmetries for one in made.models if one.category == name)
    for rng, pose in random_poses(5, 40):
        one = nearest(pose, said)
        assert mssd(pose, one, symmetries, mesh.vertices) <= allowed(info, mesh.vertices)
        for motion in rng.permutation(symmetries)[:9]:
            assert mssd(nearest(pose @ motion, said), one, np.eye(4)[None], mesh.vertices) < 1e-5


# what closed forms say of turns that are no symmetries


def prism_error(name, angle):
    """MSSD of these models after a turn around their axis, where no half turn across is nearer: of a prism of order n, of the
    farthest vertices from the axis the chord of the angle to the next multiple of a full turn over n.
    """
    order, reach = {"box": (2, math.hypot(0.3, 0.45)), "star": (5, 0.8), "slab": (4, math.hypot(0.35, 0.35))}[name]
    step = 2 * math.pi / order
    return 2 * reach * math.sin(abs(angle - step * round(angle / step)) / 2)


HIGH = {"box": 1.4, "star": STAR_HIGH, "slab": 0.25}


@pytest.mark.parametrize("name", HIGH)
def test_turns_that_are_no_symmetries_are_as_far_off_as_their_chord(made, known, name):
    """Between canonical poses as between poses: no error is lost and none is made."""
    info, symmetries, mesh = known[name]
    said = next(one.symmetries for one in made.models if one.category == name)
    middle = mesh.bounds.mean(axis=0) if name == "slab" else np.zeros(3)
    angles = []
    for rng, pose in random_poses(7, 60):
        angle = rng.uniform(-math.pi, math.pi)
        expected = prism_error(name, angle)
        assert expected < HIGH[name] or name == "slab"  # whose ends do not change places in its sidecar
        other = pose @ turned_around(Z, middle, angle)
        assert abs(mssd(other, pose, symmetries, mesh.vertices) - expected) < 2e-6
        assert abs(mssd(nearest(other, said), nearest(pose, said), symmetries, mesh.vertices) - expected) < 2e-6
        angles.append(expected)
    assert max(angles) > 0.3 and len(info["symmetries_discrete"]) in {3, 9}


def test_tilts_of_a_cylinder_are_as_far_off_as_its_ends(made, known):
    """The middle of an end moves along a chord; of the points around it, one moves at least as far."""
    info, symmetries, mesh = known["cylinder"]
    said = next(one.symmetries for one in made.models if one.category == "cylinder")
    for rng, pose in random_poses(8, 30):
        angle, way = rng.uniform(0, math.pi), rng.uniform(0, 2 * math.pi)
        other = pose @ rotation_matrix(angle, (math.cos(way), math.sin(way), 0))
        least = CYLINDER_HIGH * min(math.sin(angle / 2), math.cos(angle / 2))
        for one, two in ((other, pose), (nearest(other, said), nearest(pose, said))):
            assert mssd(one, two, symmetries, mesh.vertices) >= least - ROUNDED
        turned = pose @ rotation_matrix(way, Z)
        assert mssd(turned, pose, symmetries, mesh.vertices) <= allowed(info, mesh.vertices)


@pytest.fixture(scope="module")
def spun(files, tmp_path_factory):
    """The star, by 72 degrees an instant, and the cylinder by 11, around their axes, before a camera that stands still."""
    models = [one for one in entries(files) if one["category"] in {"star", "cylinder"}]
    for one, speed in zip(models, (72, 11), strict=True):
        one["motion"] = {"kind": "constant", "velocity": [0, 0, 0], "spin_deg": [0, 0, speed]}
    recipe = {
        "models": models,
        "viewpoints": {"azimuth": [33], "elevation": [25], "tilt": 14, "distance": 4},
        "time": {"frames": 5, "fps": 1},
        "camera": {"size": list(SIZE), "fov_deg": 50},
        "channels": ["instances"],
        "annotations": ["canonical_pose"],
        "formats": [],
    }
    return list(vs.render(vs.Recipe.model_validate(recipe)))


@pytest.mark.parametrize("name", ["star", "cylinder"])
@pytest.mark.slow
def test_spinning_symmetric_things_stand_still(spun, name):
    """The poses differ from instant to instant, the canonical ones do not."""
    poses, canonical = (
        np.array([getattr(o, field) for sample in spun for o in sample.objects if o.category == name])
        for field in ("camera_from_object", "canonical_pose")
    )
    assert len(poses) == 5 and np.abs(np.diff(poses, axis=0)).max(axis=(1, 2)).min() > 0.1
    np.testing.assert_allclose(canonical, np.broadcast_to(canonical[0], canonical.shape), atol=1e-6)
