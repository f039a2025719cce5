"""OBJ and STL files that once went wrong, and layouts of public data sets, when they are there: their right values."""

from pathlib import Path

import numpy as np
import pytest

from viewsphere.assets.appearance.shown import shown_texels
from viewsphere.assets.load import load_model
from viewsphere.errors import ModelError

CASES = Path(__file__).parents[4] / "shared" / "cases"
HALVES = (127.5, 120.0, 77.5)
"""Mean colour of the cases' picture."""

# Triangles, area, mean base colour in sRGB steps (None: not textured), warnings by a part of each.
EXPECTED = {
    "models/obj/alpha_is_gloss/model.obj": (2, 4.0, HALVES, ["it is no cut-out, so it is ignored"]),
    "models/obj/comment_after/model.obj": (2, 4.0, HALVES, []),
    "models/obj/map_Tr/model.obj": (2, 4.0, HALVES, []),
    "models/obj/mtl_gbk/model.obj": (2, 4.0, HALVES, []),
    "models/obj/mtllib_in_folder/model.obj": (2, 4.0, HALVES, []),
    "models/obj/pbr_map_ks_ns/model.obj": (2, 4.0, HALVES, []),
    "models/stl/binary_says_solid.stl": (2, 4.0, None, []),
    "models/layouts/gso/Brand_Shoe_Red/meshes/model.obj": (2, 4.0, HALVES, []),
    "models/layouts/gso/Brand_Toy_Blue/meshes/model.obj": (2, 4.0, HALVES, []),
    "models/layouts/shapenet/02691156/1a2b3c/models/model_normalized.obj": (2, 4.0, HALVES, []),
    "models/layouts/shapenet/02691156/4d5e6f/models/model_normalized.obj": (2, 4.0, HALVES, []),
    "models/layouts/ycb/002_master_chef_can/google_16k/textured.obj": (2, 4.0, HALVES, []),
    "models/layouts/ycb/003_cracker_box/google_16k/textured.obj": (2, 4.0, HALVES, []),
    "models/layouts/partnet/35059/textured_objs/original-1.obj": (2, 4.0, HALVES, []),
}

pytestmark = pytest.mark.skipif(not CASES.is_dir(), reason="the folder of cases is not there")


def mean_colour(mesh):
    (material,) = mesh.materials
    if material.base_color_texture is None:
        return None
    pixels = mesh.images[material.base_color_texture.image].pixels
    uv = mesh.uv0[mesh.triangles].astype(np.float64)
    return pixels[shown_texels(material.base_color_texture, uv, pixels.shape[:2])][:, :3].mean(axis=0)


@pytest.mark.parametrize("name", EXPECTED)
def test_a_case_has_its_right_values(name):
    mesh, _ = load_model(CASES / name)
    triangles, area, colour, warnings = EXPECTED[name]
    a, b, c = (mesh.vertices[mesh.triangles[:, i]].astype(np.float64) for i in range(3))
    assert len(mesh.triangles) == triangles
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(area)
    assert len(mesh.warnings) == len(warnings)
    assert all(part in warning for part, warning in zip(warnings, mesh.warnings, strict=True))
    if colour is None:
        assert mean_colour(mesh) is None
    else:
        np.testing.assert_allclose(mean_colour(mesh), colour, atol=2)


def test_decimal_commas_are_refused_with_their_line():
    with pytest.raises(ModelError, match=r"decimal_commas.obj:1: '-12,75' has a decimal comma"):
        load_model(CASES / "models/obj/decimal_commas.obj")


def test_maps_of_gloss_and_transparency_are_read():
    glossy = load_model(CASES / "models/obj/pbr_map_ks_ns/model.obj")[0]
    (material,) = glossy.materials
    assert glossy.images[material.specular_texture.image].pixels[0, 0, 3] == 0
    assert glossy.images[material.metallic_roughness_texture.image].pixels[0, 0, 1] == 255
    assert load_model(CASES / "models/obj/map_Tr/model.obj")[0].materials[0].alpha_mode == "MASK"


@pytest.mark.parametrize("path", sorted((CASES / "workflows/gso").glob("*/meshes/model.obj")))
def test_scans_of_the_workflow_are_textured(path):
    mesh, _ = load_model(path)
    assert mesh.materials[0].base_color_texture is not None
    assert mesh.warnings == ()
