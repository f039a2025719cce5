"""What models say of themselves: in the axes and units of their files, and nothing that their surfaces do not have."""

import json
import math

import numpy as np
import pytest
import trimesh

from viewsphere.assets.cache import load
from viewsphere.assets.metadata import model_metadata as metadata
from viewsphere.assets.metadata.model_metadata import metadata_of, spread_points
from viewsphere.assets.metadata.sidecars import sidecar_of
from viewsphere.errors import ModelError
from viewsphere.model.annotations.keypoints import Keypoints
from viewsphere.model.annotations.symmetries import Continuous, Symmetries
from viewsphere.model.model_spec import ModelSpec

SIDES = (2.0, 4.0, 3.0)
HALF_TURN = [[-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]


@pytest.fixture(autouse=True)
def cache_of_its_own(monkeypatch, tmp_path):
    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path / "cache"))


@pytest.fixture
def model(tmp_path):
    """Writes a box, whose middle is at `middle`, with what it says of itself; gives its specification."""

    def make(said=None, middle=(0, 0, 0), ending="stl", **settings):
        mesh = trimesh.creation.box(SIDES)
        mesh.apply_translation(middle)
        file = tmp_path / f"box.{ending}"
        mesh.export(file)
        if said is not None:
            text = said if isinstance(said, str) else json.dumps(said)
            (tmp_path / f"box.{ending}.viewsphere.yaml").write_text(text)
        return ModelSpec(key="box", source=str(file), category="box", category_id=1, **settings)

    return make


def read(spec):
    return metadata_of(spec, *load(spec))


SETTINGS = [
    {},
    {"up": "+y", "forward": "+z"},
    {"up": "-x", "forward": "+y", "unit": 0.01},
    {"centring": "floor", "scale": 1.5},
    {"centring": "area", "unit": 2.0},
    {"centring": "as_is", "forward": "+x"},
    {"real_size": (1.0, 1.0, 1.2), "scale": "real_size"},
]


@pytest.mark.parametrize("middle", [(0, 0, 0), (5, -3, 2), (40_000, 0, 7)])
@pytest.mark.parametrize("settings", SETTINGS)
def test_points_and_symmetries_go_where_the_mesh_goes(model, settings, middle):
    corner, face = np.add(middle, np.array(SIDES) / 2).tolist(), np.add(middle, (0, 0, SIDES[2] / 2)).tolist()
    turn = [[*HALF_TURN[0][:3], 2 * middle[0]], [*HALF_TURN[1][:3], 2 * middle[1]], *HALF_TURN[2:]]
    said = {"keypoints": {"points": {"corner": corner, "face": face}}, "symmetries": {"discrete": [turn]}}
    spec = model(said, middle, **settings)
    mesh, facts = load(spec)
    found = metadata_of(spec, mesh, facts)
    assert found.diameter == pytest.approx(np.linalg.norm(np.ptp(mesh.bounds, axis=0)), rel=1e-6)
    points, size = found.keypoints.points, found.diameter
    assert np.abs(mesh.vertices - points["corner"]).sum(axis=1).min() < 1e-6 * size
    assert np.linalg.norm(np.subtract(points["face"], points["corner"])) == pytest.approx(
        size * math.hypot(1, 2) / math.hypot(*SIDES), rel=1e-5
    )
    (motion,) = np.array(found.symmetries.discrete)
    turned = mesh.corners @ motion[:3, :3].T + motion[:3, 3]
    assert max(np.abs(mesh.corners - corner).sum(axis=1).min() for corner in turned) < 1e-5 * size


def test_a_continuous_axis_goes_where_the_mesh_goes(tmp_path):
    mesh = trimesh.creation.cylinder(100, 300, sections=64)
    mesh.apply_translation((500, 0, 40))
    mesh.export(tmp_path / "can.stl")
    text = "symmetries:\n  continuous:\n  - {axis: [0, 0, -1], offset: [500, 0, 90]}\n"
    (tmp_path / "can.stl.viewsphere.yaml").write_text(text)
    settings = {"up": "+x", "forward": "+z", "unit": 0.001}
    spec = ModelSpec(key="can", source=str(tmp_path / "can.stl"), category="can", category_id=1, **settings)
    (axis,) = read(spec).symmetries.continuous
    np.testing.assert_allclose(axis.axis, (0, 1, 0), atol=1e-12)
    np.testing.assert_allclose(axis.offset, (0, -0.05, 0), atol=1e-6)


def test_object_axes_are_taken_as_they_are(model):
    said = {"axes": "object", "keypoints": {"points": {"top": [0, 0, 0.75]}}}
    assert read(model(said, (9, 9, 9), unit=0.5)).keypoints.points == {"top": (0, 0, 0.75)}


def test_all_fields_and_sixteen_numbers_in_a_row(model):
    text = """
    symmetries:
      discrete:
        - [-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
    keypoints:
      points: {left: [-1, 0, 0], right: [1, 0, 0], top: [0, 0, 1.5]}
      skeleton: [[left, top], [right, top]]
      flips: [[left, right]]
    """
    found = read(model(text))
    assert found.symmetries == Symmetries(discrete=tuple([tuple(map(tuple, HALF_TURN))]))
    assert [*found.keypoints.points] == ["left", "right", "top"]
    assert found.keypoints.skeleton == (("left", "top"), ("right", "top")) and found.keypoints.flips == (("left", "right"),)


MISTAKES = {
    "symmetries:\n  discrete: [turn]": ":2: symmetries.discrete[0]: expected a list; found 'turn'",
    "symmetry: {}": "'symmetry' is unknown; did you mean 'symmetries'?",
    "axes: world": ":1: axes: 'world' is unknown. Valid: file, object",
    "symmetries: {continuous: [{axis: [0, 0, 2]}]}": "axis: expected a vector of length 1",
    "symmetries: {continuous: [{axis: [0, 0, .nan]}]}": "axis[2]: expected",
    "symmetries: {discrete: [[1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]]}": "expected a motion; found the identity",
    "symmetries: {discrete: [[-1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]]}": "found a mirror image",
    "symmetries: {discrete: [[2,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]]}": "the rows are not those of a rotation",
    "symmetries: {discrete: [[1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,1,1]]}": "expected [0, 0, 0, 1] as the last row",
    "symmetries: {discrete: [[0,-1,0,0, 1,0,0,0, 0,0,1,0, 0,0,0,1]]}": "discrete[0] followed by discrete[0] is one, too",
    "keypoints: {points: {}}": "keypoints.points: expected at least 1",
    "keypoints: {points: {a: [0, 0]}}": "keypoints.points.a",
    "keypoints: {points: {a: [0, 0, .inf]}}": "keypoints.points.a[2]",
    "keypoints:\n  points:\n    a: [0, 0, 0]\n    a: [1, 0, 0]": ":4: keypoints.points.a: expected every field once",
    "keypoints: {points: {a: [0, 0, 0]}, skeleton: [[a, b]]}": "keypoints: expected skeleton of names in points; found 'b'",
    "keypoints: {points: {a: [0, 0, 0]}, flips: [[a, a]]}": "expected two points in each pair of flips; found 'a' twice",
    "keypoints: {points: {a: [0,0,0], b: [1,0,0]}, skeleton: [[a, b], [b, a]]}": "line of skeleton once; found a - b again",
    "keypoints: {points: {a: [0,0,0], b: [1,0,0], c: [1,0,0]}, flips: [[a, b], [c, a]]}": "point of flips once; found a again",
    "- keypoints": ":1: expected a mapping of axes, symmetries, keypoints",
    "keypoints: {points": "expected an end of the mapping",
    "": "found an empty file",
}


@pytest.mark.parametrize("text", MISTAKES)
def test_mistakes_are_told_in_one_line(model, text):
    with pytest.raises(ModelError) as caught:
        read(model(text))
    assert MISTAKES[text] in str(caught.value) and "\n" not in str(caught.value)
    assert str(caught.value).count("box.stl.viewsphere.yaml:1") or "yaml:" in str(caught.value)


@pytest.mark.parametrize(
    ("said", "problem"),
    [
        ({"symmetries": {"continuous": [{"axis": [0, 0, 1]}]}}, "symmetries.continuous[0]: expected what takes the surface"),
        ({"keypoints": {"points": {"far": [0, 9, 0]}}}, "keypoints.points.far: expected a point of the model"),
    ],
)
def test_what_the_surface_does_not_have(model, said, problem):
    with pytest.raises(ModelError, match=r"box\.stl\.viewsphere\.yaml: ") as caught:
        read(model(said))
    assert problem in str(caught.value) and "\n" not in str(caught.value)


def test_found_ones_are_kept(model, monkeypatch):
    assert read(model()).symmetries is None
    spec = model(symmetries="found")
    found = read(spec).symmetries
    assert len(found.discrete) == 3
    monkeypatch.setattr(metadata, "find", lambda surface: pytest.fail("looked for again"))
    assert read(spec).symmetries == found
    assert read(model({"symmetries": {}}, symmetries="found")).symmetries == Symmetries()


def test_the_files_that_say_something(model, tmp_path):
    assert sidecar_of(model()) is None
    spec = model({"axes": "file"})
    assert sidecar_of(spec) == tmp_path / "box.stl.viewsphere.yaml"
    other = tmp_path / "deep" / "other.yaml"
    other.parent.mkdir()
    other.write_text('keypoints: {points: {"the middle": [0, 0, 0]}}')
    assert sidecar_of(spec.model_copy(update={"sidecar": str(other)})) == other
    assert [*read(spec.model_copy(update={"sidecar": str(other)})).keypoints.points] == ["the middle"]
    sidecar_of(spec).unlink()
    (tmp_path / "box.stl.viewsphere.yaml").symlink_to(other)
    with pytest.raises(ModelError, match=r"found a link to .*other\.yaml: copy it, or say confined: false"):
        read(spec)
    assert read(spec.model_copy(update={"confined": False})).keypoints


def test_points_that_lie_far_apart(model):
    points = read(model(keypoints=8)).keypoints.points
    assert [*points] == [f"point_{i}" for i in range(8)]
    corners = np.array([*points.values()])
    np.testing.assert_allclose(np.abs(corners), np.tile(np.array(SIDES) / 2, (8, 1)))
    assert len(np.unique(corners, axis=0)) == 8
    assert len(read(model(keypoints=20)).keypoints.points) == 8
    named = {"keypoints": {"points": {"own": [0, 0, 0]}}}
    assert [*read(model(named, keypoints=8)).keypoints.points] == ["own"]


def test_each_point_is_the_farthest_from_those_before():
    vertices = np.random.default_rng(0).normal(size=(300, 3))
    before = [(vertices.min(axis=0) + vertices.max(axis=0)) / 2]
    for point in spread_points(vertices, 20):
        away = [min(math.dist(vertex, other) for other in before) for vertex in vertices]
        assert min(math.dist(point, other) for other in before) == pytest.approx(max(away))
        before.append(point)
    shuffled = np.random.default_rng(1).permutation(vertices)
    np.testing.assert_array_equal(spread_points(shuffled, 20), np.array(before[1:]))


def test_records_of_traits_are_plain():
    said = Symmetries(discrete=(tuple(map(tuple, HALF_TURN)),), continuous=(Continuous(axis=(0, 1, 0)),))
    assert Symmetries.model_validate(json.loads(said.model_dump_json())) == said
    points = Keypoints(points={"a": (1, 2, 3), "b": (0, 0, 0)}, skeleton=(("a", "b"),))
    assert Keypoints.model_validate(json.loads(points.model_dump_json())) == points
    assert points.only(["a"]) == Keypoints(points={"a": (1, 2, 3)}) and points.only([]) is None
