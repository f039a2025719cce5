"""The report of a model file says what a user must know."""

import pytest

from viewsphere.assets.inspect import describe
from viewsphere.errors import ModelError
from viewsphere.model.model_spec import ModelSpec

WIDE = "v 0 0 0\nv 300 0 0\nv 0 20 0\nv 0 0 100\n"


def test_report(write):
    write("a.mtl", "newmtl red\nKd 1 0 0\nPr 0.5\n")
    faces = "g low\nf 1 3 2\ng high\nf 1 2 4\nf 2 3 4\nusemtl red\nf 3 1 4\n"
    report = describe(write("a.obj", "mtllib a.mtl\n" + WIDE + faces))
    assert (report.format, report.up, report.forward, report.unit) == ("obj", "+y", "+z", 1)
    assert report.size == (300, 20, 100)
    assert report.raw_size == (300, 20, 100)
    assert report.bounds == ((-150, -50, -10), (150, 50, 10))
    assert (report.triangles, report.parts) == (4, (("low", 1), ("high", 3)))
    assert report.materials[1] == ("red", {"base_color": (1.0, 0.0, 0.0, 1.0), "roughness": 0.5})
    assert (report.textures, report.warnings, report.has_uv) == ((), (), False)
    assert any("unit: 0.001" in line for line in report.suggestions)
    assert any("forward: +x" in line for line in report.suggestions)


def test_settings_are_obeyed(write):
    path = write("a.obj", WIDE + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    spec = ModelSpec(key="a", source=str(path), category="x", category_id=1, up="+z", forward="+x", unit=0.01)
    report = describe(spec)
    assert report.size == pytest.approx((0.2, 1, 3))
    assert report.suggestions == ()


def test_a_bad_file_is_one_error(write):
    with pytest.raises(ModelError, match="empty"):
        describe(write("a.obj", b""))
