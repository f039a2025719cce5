"""Files of public reports: what each must give, where the shared cases are at hand."""

from pathlib import Path

import numpy as np
import pytest

from polygons import triangle_areas
from viewsphere.assets.load import load_model
from viewsphere.codecs.srgb import linear

CASES = Path(__file__).parents[4] / "shared" / "cases" / "models"
BALL = (0.36, 0.2988, 0.013)
FACES = (4 * linear(np.array([220, 30, 30]) / 255) + linear(np.array([30, 200, 30]) / 255)) / 6.118
FACES = FACES + 1.25**0.5 * linear(np.array([30, 30, 220]) / 255) / 6.118
PLAIN = (1.0, 1.0, 1.0)
EXPECTED = [
    ("dae/concave_polylist.dae", 3, 3.0, (0.02, 0.6, 0.02), 0),
    ("ply/concave_mixed.ply", 16, 6.9211, PLAIN, 0),
    ("off/concave.off", 16, 6.9211, PLAIN, 0),
    ("ply/ball_colors_uv.ply", 168, 12.0453, BALL, 0),
    ("ply/ball_rgb_diffuse.ply", 168, 12.0453, BALL, 0),
    ("ply/mixed_tri_quad_face_rgb.ply", 4, 6.118, tuple(FACES), 0),
    ("ply/quad_wedge_uv.ply", 2, 4.0, None, 1),
    ("ply/two_textures_texnumber.ply", 4, 4.0, None, 2),
]
"""File, triangles, area, mean linear colour without pictures (None: not looked at), pictures."""


@pytest.mark.skipif(not CASES.is_dir(), reason="the shared cases are not here")
@pytest.mark.parametrize(("name", "triangles", "area", "color", "pictures"), EXPECTED)
def test_a_reported_file_gives_its_right_value(name, triangles, area, color, pictures):
    mesh, _ = load_model(CASES / name)
    areas = triangle_areas(mesh)
    assert len(areas) == triangles
    assert areas.sum() == pytest.approx(area, abs=1e-3)
    assert len(mesh.images) == pictures
    assert not mesh.warnings
    factors = np.array([material.base_color[:3] for material in mesh.materials])[mesh.triangle_material]
    colors = factors if mesh.colors is None else factors * mesh.colors[mesh.triangles].mean(axis=1)[:, :3]
    if color is not None:
        np.testing.assert_allclose((colors * areas[:, None]).sum(axis=0) / areas.sum(), color, atol=1e-3)
