"""The report of a model file says what a user must know."""

import numpy as np
import pytest
import trimesh

from animated import leaf
from viewsphere.assets.animation.timeline import Blenders
from viewsphere.assets.inspect import describe
from viewsphere.errors import MissingExtraError, ModelError
from viewsphere.model.model_spec import ModelSpec
from viewsphere.run.reports.inspection import report_lines

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


@pytest.mark.parametrize("sides", [(3, 5, 9), (4, 4, 9), "can"])
def test_proposed_symmetries_are_those_of_the_file_when_they_are_pasted(tmp_path, sides):
    mesh = trimesh.creation.cylinder(3, 9, sections=48) if sides == "can" else trimesh.creation.box(sides)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(0.7, (1, 2, 3)))
    mesh.apply_translation((70, -20, 5))
    path = tmp_path / "a.obj"
    mesh.export(path)
    spec = ModelSpec(key="a", source=str(path), category="x", category_id=1, up="+x", forward="+z", unit=0.01)
    report = describe(spec)
    lines = [*report_lines(report)]
    assert not report.declares and report.sidecar == "a.obj.viewsphere.yaml"
    (tmp_path / report.sidecar).write_text("\n".join(lines[lines.index("symmetries:") :]))
    again = describe(spec)
    assert again.declares and "symmetries:" not in [*report_lines(again)]
    for field in ("discrete", "continuous"):
        assert len(again.symmetries[field]) == len(report.symmetries[field])
    assert len(report.symmetries["continuous"]) == (sides == "can")
    assert len(report.symmetries["discrete"]) == {(3, 5, 9): 3, (4, 4, 9): 7, "can": 1}[sides]
    np.testing.assert_allclose(again.symmetries["discrete"], report.symmetries["discrete"], atol=1e-6)


def test_named_points_are_shown_as_the_file_has_them(write):
    path = write("a.obj", WIDE + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    write("a.obj.viewsphere.yaml", "keypoints: {points: {tip: [0, 20, 0]}}")
    lines = [*report_lines(describe(path))]
    assert "  keypoints  1 (the file's axes and unit)" in lines and "    tip: [0, 20, 0]" in lines
    assert "  symmetric  no (by its shape)" in lines and "  diameter   316.2 m" in lines


def test_a_bad_file_is_one_error(write):
    with pytest.raises(ModelError, match="empty"):
        describe(write("a.obj", b""))


def test_of_what_cannot_move_nothing_is_said_and_blender_is_not_asked(write, monkeypatch, tmp_path):
    monkeypatch.delattr(Blenders, "timeline")
    leaf(tmp_path / "leaf.gltf", {})
    for file in (write("a.obj", WIDE + "f 1 3 2\n"), tmp_path / "leaf.gltf"):
        report = describe(file)
        assert report.animation is None
        assert not any("animation" in line or "clips" in line for line in report_lines(report))
        assert not any("may move" in line for line in report.suggestions)


def test_an_animated_gltf_file_needs_no_blender_and_a_damaged_animation_is_told(monkeypatch, tmp_path):
    def none():
        raise MissingExtraError("no Blender")

    monkeypatch.setattr("viewsphere.assets.readers.blender.reading.find_blender", none)
    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path / "cache"))
    leaf(tmp_path / "leaf.gltf", {"Walk": 1, "Wave": 0.5})
    report = describe(tmp_path / "leaf.gltf")
    assert (report.animation.first, report.animation.last, report.animation.fps) == (0, 24, 24)
    assert [clip.name for clip in report.animation.clips] == ["Walk", "Wave"]
    text = (tmp_path / "leaf.gltf").read_text()
    (tmp_path / "leaf.gltf").write_text(text.replace('"input": 2', '"input": 99'))
    report = describe(tmp_path / "leaf.gltf")
    assert report.animation is None
    (said,) = [line for line in report.suggestions if "may move" in line]
    assert "expected an index below 4, found 99" in said
