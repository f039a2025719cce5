"""Parts of meshes as meshes of their own."""

from __future__ import annotations

import numpy as np
import pytest

from viewsphere.assets.mesh import Image, Material, Mesh, Texture
from viewsphere.assets.parts import is_taken, own_part, selected_parts
from viewsphere.errors import ModelError
from viewsphere.model.model_spec import ModelSpec, Parts

NAMES = ("Car", "Car/Wheel", "Cart", "Road")
TURNED = ((0, -1, 0, 5), (1, 0, 0, 0), (0, 0, 1, 2), (0, 0, 0, 1))
"""A quarter turn about z, and somewhere else."""


def whole():
    """A triangle a part, one above another; the last two share a picture."""
    low = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    picture = Image("paint", np.zeros((2, 2, 4), np.uint8))
    return Mesh(
        vertices=np.concatenate([low + np.float32([0, 0, k]) for k in range(4)]).astype(np.float32),
        triangles=np.arange(12, dtype=np.int32).reshape(4, 3),
        normals=np.tile(np.float32([1, 0, 0]), (12, 1)),
        triangle_material=np.array([0, 0, 1, 1], np.int32),
        triangle_part=np.arange(4, dtype=np.int32),
        parts=NAMES,
        materials=(Material("plain"), Material("painted", base_color_texture=Texture(0))),
        images=(picture,),
        uv0=np.arange(24, dtype=np.float32).reshape(12, 2),
    )


def spec(**parts):
    return ModelSpec(key="k", source="street.blend", category="c", category_id=1, parts=Parts(**parts))


@pytest.mark.parametrize(
    ("parts", "names"),
    [
        ({"only": ("Car",)}, ["Car", "Car/Wheel"]),
        ({"only": ("Road",)}, ["Road"]),
        ({"without": ("Car",)}, ["Cart", "Road"]),
        ({"only": ("Car", "Road"), "without": ("Car",)}, ["Road"]),
        ({}, list(NAMES)),
    ],
)
def test_an_objects_parts_are_its_own_and_what_it_instances(parts, names):
    mesh = whole()
    found = selected_parts(mesh, spec(**parts))
    assert list(found.parts) == names
    assert len(found.triangles) == len(names)
    for k, name in enumerate(names):
        corners = mesh.triangles[NAMES.index(name)]
        assert (found.vertices[found.triangles[k]] == mesh.vertices[corners]).all()
        assert (found.uv0[found.triangles[k]] == mesh.uv0[corners]).all()
        assert (
            found.materials[found.triangle_material[k]].name == mesh.materials[mesh.triangle_material[NAMES.index(name)]].name
        )
    assert len(found.images) == any(m.name == "painted" for m in found.materials)


def test_parts_stand_in_their_own_axes():
    mesh = whole()
    found = selected_parts(mesh, spec(only=("Road",), file_from_axes=TURNED))
    axes = np.array(TURNED)
    assert np.allclose(found.vertices @ axes[:3, :3].T + axes[:3, 3], mesh.vertices[9:])
    assert np.allclose(found.normals @ axes[:3, :3].T, mesh.normals[9:])


def test_a_slash_in_an_objects_name_is_not_that_of_an_instance():
    parts = ("Car", "Car/Wheel", own_part("Car/Wheel"))
    assert is_taken(parts, Parts(only=("Car",))).tolist() == [True, True, False]
    assert is_taken(parts, Parts(only=("Car/Wheel",))).tolist() == [False, False, True]
    assert is_taken(parts, Parts(without=("Car",))).tolist() == [False, False, True]


def test_nothing_taken_is_one_line():
    with pytest.raises(ModelError, match=r"street.blend: expected triangles of Bus, found none"):
        selected_parts(whole(), spec(only=("Bus",)))


def test_parts_of_one_model_share_it():
    one, other = spec(only=("Car",)), spec(only=("Road",)).model_copy(update={"key": "other", "category": "road"})
    assert one.whole == other.whole
    assert one.whole != one.model_copy(update={"confined": False}).whole
