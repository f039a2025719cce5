"""Bones of skins in files that Blender reads: they move the same triangles as in the file."""

from __future__ import annotations

import numpy as np
import pytest

from rigged import BODY, arm, person, write_gltf
from viewsphere.assets.load import load_frames, load_model

pytestmark = pytest.mark.usefixtures("blender")


@pytest.mark.parametrize("rigged", [arm(), person()], ids=["arm", "person"])
def test_blender_s_bones_move_the_triangles_that_the_file_s_do(tmp_path, rigged):
    """Both readers have the same triangles, maybe in other orders: compared by their middles."""
    file = write_gltf(rigged, tmp_path / "model.gltf")
    own, _ = load_model(file)
    for mesh, _ in load_frames(file, [1]):
        assert set(mesh.body_parts) == set(own.body_parts) and len(mesh.triangles) == len(own.triangles)
        away = np.linalg.norm(middles(own)[:, None] - middles(mesh), axis=2)
        assert away.min(axis=1).max() < 1e-4
        np.testing.assert_array_equal(names(own), names(mesh)[away.argmin(axis=1)])


def middles(mesh):
    """Of its triangles, (T, 3)."""
    return mesh.vertices[mesh.triangles].astype(float).mean(axis=1)


def names(mesh):
    """The bone of each triangle."""
    return np.array(["", *mesh.body_parts])[mesh.triangle_body_part]


def test_a_person_s_limbs_are_among_them(tmp_path):
    *_, (mesh, _) = load_frames(write_gltf(person(), tmp_path / "person.gltf"), [1])
    assert set(names(mesh)) == set(BODY)
