"""URDF: where meshes are with every joint at zero, and files that do harm."""

from __future__ import annotations

import math

import numpy as np
import pytest

from asset_trees import pointer, put
from viewsphere import Recipe
from viewsphere.assets.load import load_model
from viewsphere.errors import ModelError
from viewsphere.planning.models import model_specs

CUBE = pointer("+z", "+x")


def robot(tmp_path, body):
    """A robot's file beside a mesh."""
    put(tmp_path / "meshes" / "cube.obj", CUBE)
    return put(tmp_path / "robot.urdf", f"<robot name='r'>{body}</robot>")


def visual(link, origin="", attributes="", file="meshes/cube.obj"):
    """A link with one mesh."""
    return f"<link name='{link}'><visual>{origin}<geometry><mesh filename='{file}' {attributes}/></geometry></visual></link>"


def test_joints_and_visuals_turn_about_fixed_axes_then_move(tmp_path):
    rpy, xyz, own = np.array([0.3, -0.5, 1.1]), np.array([1.0, 2.0, 3.0]), np.array([0.1, 0.2, 0.3])
    joint = (
        f"<joint name='j' type='fixed'><origin rpy='{' '.join(map(str, rpy))}' xyz='1 2 3'/>"
        "<parent link='a'/><child link='b'/></joint>"
    )
    moved = visual("b", "<origin xyz='.1 .2 .3'/>")
    mesh, facts = load_model(robot(tmp_path, f"<link name='a'/>{moved}{joint}"))
    (cx, cy, cz), (sx, sy, sz) = np.cos(rpy), np.sin(rpy)
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    alone, _ = load_model(tmp_path / "meshes" / "cube.obj")
    wanted = (alone.vertices + own) @ (about_z @ about_y @ about_x).T + xyz
    found = mesh.vertices + np.array(facts.origin)
    assert (facts.up, facts.forward, facts.unit, mesh.parts) == ("+z", "+x", 1.0, ("b",))
    assert np.allclose(np.sort(found, axis=0), np.sort(wanted, axis=0), atol=1e-6)


def test_a_mirroring_scale_keeps_the_surface_outside(tmp_path):
    plain, _ = load_model(robot(tmp_path, visual("a")))
    mirrored, _ = load_model(robot(tmp_path, visual("a", attributes="scale='-2 2 2'")))

    def volume(mesh):
        a, b, c = (mesh.vertices[mesh.triangles[:, i]].astype(float) for i in range(3))
        return (a * np.cross(b, c)).sum() / 6

    assert volume(plain) > 0.9 and math.isclose(volume(mirrored), 8 * volume(plain), rel_tol=1e-4)


def test_meshes_of_packages_are_found_below_the_robots_folder(tmp_path):
    mesh, _ = load_model(robot(tmp_path, visual("a", file="package://meshes/cube.obj")))
    assert len(mesh.triangles) == 13


def test_what_is_not_read_is_told(tmp_path):
    body = visual("a") + visual("b", file="../../outside.obj") + visual("c", file="robot.urdf")
    body += "<link name='d'><visual><geometry><sphere radius='1'/></geometry></visual></link>"
    put(tmp_path.parent / "outside.obj", CUBE)
    mesh, _ = load_model(robot(tmp_path, body))
    warnings = "\n".join(mesh.warnings)
    assert len(mesh.triangles) == 13 and "outside" in warnings and "'robot.urdf' is a file of a kind" in warnings
    assert "not read: 1 primitive sphere" in warnings


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (visual("a", "<origin xyz='0 0 nan'/>"), "xyz: expected three numbers; found '0 0 nan'"),
        (visual("a", "<origin rpy='0 0'/>"), "rpy: expected three numbers"),
        (
            visual("a") + "".join(
                f"<joint name='j'><parent link='{a}'/><child link='{b}'/></joint>" for a, b in (("a", "b"), ("b", "a"))
            ),
            "joints in a circle",
        ),
        ("<link name='a'/>", "no triangles found: the file holds no faces at all"),
        (visual("a", file="package://robot/none.stl"), r"no mesh of the robot can be read. The first: .*none.stl.* exist"),
        (visual("a", file="../a.obj") + visual("b", file="/b.obj"), r"first: mesh '\.\./a\.obj' is outside .* confined: false"),
        (visual("a", file="/b.obj"), r"The first: mesh '/b\.obj' is outside the model's folder.* set confined: false"),
    ],
)  # fmt: skip
def test_a_robot_that_cannot_be_assembled_is_an_error(tmp_path, body, message):
    with pytest.raises(ModelError, match=message):
        load_model(robot(tmp_path, body))


def test_other_xml_is_an_error(tmp_path):
    with pytest.raises(ModelError, match=r"expected a URDF, whose root is <robot>; found <mujoco>"):
        load_model(put(tmp_path / "a.urdf", "<mujoco/>"))


def test_a_chain_of_a_thousand_links_is_read(tmp_path):
    links = "".join(f"<link name='{i}'/>" for i in range(1000)) + visual("1000")
    joints = "".join(
        f"<joint name='j{i}'><origin xyz='0.001 0 0'/><parent link='{i}'/><child link='{i + 1}'/></joint>" for i in range(1000)
    )
    mesh, facts = load_model(robot(tmp_path, links + joints))
    alone, _ = load_model(tmp_path / "meshes" / "cube.obj")
    assert math.isclose((mesh.vertices[:, 0] + facts.origin[0]).min() - alone.vertices[:, 0].min(), 1.0, rel_tol=1e-5)


def test_folders_leave_robots_out_and_patterns_name_them(tmp_path):
    robot(tmp_path, visual("a"))

    def found(source):
        recipe = {"models": [{"source": source, "category": "a"}], "viewpoints": {"distance": 3}}
        return [spec.key for spec in model_specs(Recipe.model_validate(recipe, context={"folder": tmp_path}))]

    assert found(".") == ["cube"] and found("*.urdf") == found("robot.urdf") == ["robot"]
