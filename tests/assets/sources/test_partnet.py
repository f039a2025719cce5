"""PartNet-Mobility: the meshes of a model's links, with every joint at zero."""

from __future__ import annotations

import json

import numpy as np
import pytest

from asset_trees import faces_front, planned, pointer, put
from viewsphere.assets.cache import load_normalised

URDF = """<?xml version="1.0" ?>
<robot name="a">
  <link name="base"/>
  <link name="link_0">
    <visual name="door-3"><origin xyz="1 0 0"/><geometry><mesh filename="textured_objs/original-1.obj"/></geometry></visual>
  </link>
  <link name="link_1">
    <visual name="body-5"><geometry><mesh filename="textured_objs/original-2.obj"/></geometry></visual>
  </link>
  <joint name="joint_0" type="revolute">
    <origin xyz="-1 0 0"/><axis xyz="0 1 0"/><child link="link_0"/><parent link="link_1"/><limit lower="0" upper="1.5"/>
  </joint>
  <joint name="joint_1" type="fixed">
    <origin rpy="1.570796326794897 0 -1.570796326794897" xyz="0 0 0"/><child link="link_1"/><parent link="base"/>
  </joint>
</robot>
"""


@pytest.fixture
def cabinet(tmp_path):
    """A cabinet of a body and a door, which overlap where every joint is at zero."""
    folder = tmp_path / "partnet" / "45001"
    for number in (1, 2):
        put(folder / "textured_objs" / f"original-{number}.obj", pointer("+y", "+z"))
    put(folder / "mobility.urdf", URDF)
    put(folder / "semantics.txt", "link_0 hinge rotation_door\nlink_1 heavy cabinet_body\n")
    put(folder / "meta.json", json.dumps({"model_cat": "StorageFurniture", "anno_id": "45001"}))
    return folder


def test_links_are_joined_at_zero_and_parts_have_the_meaning_of_their_link(cabinet):
    plan = planned(f"partnet:{cabinet.parent}")
    (spec,) = plan.model_specs
    assert (spec.key, spec.category, spec.real_size) == ("45001", "storage furniture", None)
    assert faces_front(spec)
    mesh = load_normalised(spec)
    assert mesh.parts == ("rotation_door/door-3", "cabinet_body/body-5")
    door, body = (mesh.vertices[np.unique(mesh.triangles[mesh.triangle_part == i])] for i in (0, 1))
    assert np.allclose(door.min(axis=0), body.min(axis=0), atol=1e-6) and np.allclose(door.max(axis=0), body.max(axis=0))
    assert plan.credits["45001"].licence == "LicenseRef-PartNet-Mobility"


def test_links_of_one_meaning_stay_apart_and_a_model_without_facts_is_an_object(cabinet):
    put(cabinet / "semantics.txt", "link_0 hinge part\nlink_1 heavy part\n")
    (cabinet / "meta.json").unlink()
    (spec,) = planned(f"partnet:{cabinet}").model_specs
    assert spec.category == "object" and load_normalised(spec).parts == ("part link_0/door-3", "part link_1/body-5")


def test_a_folder_without_a_urdf_is_a_broken_model(cabinet):
    (cabinet.parent / "45002").mkdir()
    plan = planned(f"partnet:{cabinet.parent}")
    assert plan.models == 1 and any("45002: no mobility.urdf" in line for line in plan.warnings)
