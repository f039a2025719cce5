"""Points that glTF files name: nodes that say so, else the joints of skins."""

import numpy as np
import pytest

from viewsphere.assets.cache import load
from viewsphere.assets.load import load_model
from viewsphere.assets.metadata.model_metadata import metadata_of
from viewsphere.model.annotations.keypoints import left_and_right
from viewsphere.model.model_spec import ModelSpec

QUARTER = [0, 0, np.sqrt(0.5), np.sqrt(0.5)]
"""About z."""


def points_of(gltf, cube, *roots):
    gltf.root["scenes"] = [{"nodes": [gltf.node(mesh=gltf.mesh(*cube)), *roots]}]
    return load_model(gltf.write())[1].keypoints


def test_nodes_that_are_named_so_or_say_so(gltf, cube):
    eye = gltf.node(name="keypoint:eye_left", translation=[0.25, 0, 0])
    other = gltf.node(name="Empty.001", extras={"keypoint": "eye_right"}, translation=[-0.25, 0, 0])
    between = gltf.node(name="bend", rotation=QUARTER, children=[eye, other])
    head = gltf.node(name="head", extras={"keypoint": True}, translation=[0, 0.5, 0], children=[between])
    found = points_of(gltf, cube, head, gltf.node(name="no point", extras={"keypoint": False}), gltf.node(extras=[1]))
    assert [*found.points] == ["head", "eye_left", "eye_right"]
    np.testing.assert_allclose(found.points["eye_left"], (0, 0.75, 0), atol=1e-15)
    np.testing.assert_allclose(found.points["eye_right"], (0, 0.25, 0), atol=1e-15)
    assert found.skeleton == (("head", "eye_left"), ("head", "eye_right")) and found.flips == (("eye_left", "eye_right"),)


def test_joints_of_skins(gltf, cube):
    hand = gltf.node(name="hand.L", translation=[0, 0.25, 0])
    wrist = gltf.node(name="wrist", children=[hand])
    arm = gltf.node(name="arm", translation=[0.5, 0, 0], children=[wrist])
    positions, indices = cube
    joints = np.zeros((len(positions), 4), np.uint8)
    weights = np.tile(np.array([1, 0, 0, 0], np.float32), (len(positions), 1))
    mesh = gltf.mesh(positions, indices, JOINTS_0=joints, WEIGHTS_0=weights)
    gltf.root["skins"] = [{"joints": [hand, arm]}]
    found = points_of(gltf, cube, arm, gltf.node(mesh=mesh, skin=0))
    assert found.points == {"hand.L": (0.5, 0.25, 0), "arm": (0.5, 0, 0)}
    assert found.skeleton == (("arm", "hand.L"),) and found.flips == ()


def test_names_that_no_point_may_have_and_those_that_are_there_twice(gltf, cube):
    names = ["keypoint:tip", "keypoint: tip ", "keypoint:a\tb", f"keypoint:{'x' * 200}", "keypoint:", "plain"]
    nodes = [gltf.node(name=name, translation=[0, 0, i / 10]) for i, name in enumerate(names)]
    far = gltf.node(name="keypoint:far", translation=[1e20, 0, 0])
    found = points_of(gltf, cube, *nodes, far)
    assert [*found.points] == ["tip", "tip_2", f"node{nodes[2]}", "x" * 90]


def test_more_points_than_a_model_may_have(gltf, cube):
    nodes = [gltf.node(name=f"keypoint:{i}") for i in range(1001)]
    gltf.root["scenes"] = [{"nodes": [gltf.node(mesh=gltf.mesh(*cube)), *nodes]}]
    mesh, facts = load_model(gltf.write())
    assert facts.keypoints is None
    assert mesh.warnings == ("hand.glb: 1,001 named points: expected at most 1,000, none is kept",)


def test_they_go_where_the_mesh_goes_and_stay_in_the_cache(gltf, cube, tmp_path):
    places = {"corner": [1, 1, 1], "lost": [0, 9, 0]}
    nodes = [gltf.node(name=f"keypoint:{name}", translation=place) for name, place in places.items()]
    gltf.root["scenes"] = [{"nodes": [gltf.node(mesh=gltf.mesh(*cube)), *nodes]}]
    spec = ModelSpec(key="a", source=str(gltf.write()), category="a", category_id=1, unit=0.5, centring="floor")
    for _ in range(2):
        mesh, facts = load(spec, folder=tmp_path / "cache")
        found = metadata_of(spec, mesh, facts).keypoints
        assert [*found.points] == ["corner"]  # what is far outside of the model is none of its points
        assert np.abs(mesh.vertices - found.points["corner"]).sum(axis=1).min() < 1e-6


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("hand_left", "hand_right"),
        ("LeftHand", "RightHand"),
        ("mixamorig:LeftUpLeg", "mixamorig:RightUpLeg"),
        ("hand.L", "hand.R"),
        ("l_knee_2", "r_knee_2"),
        ("LEFT EYE", "RIGHT EYE"),
    ],
)
def test_left_and_right_by_name(one, other):
    assert left_and_right(["wheel", other, one, "lamp", "tail.L"]) == ((one, other),)
