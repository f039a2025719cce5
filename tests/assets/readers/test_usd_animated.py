"""The timeline of a USD file is read by usd-core, in a process of its own, without Blender."""

import pytest

from scratch import scratch_cache
from viewsphere.assets.animation.timeline import Blenders, animation_of
from viewsphere.assets.sandbox.client import READ_HERE
from viewsphere.errors import ModelError

pytest.importorskip("pxr")

TEXT = """#usda 1.0
(
 startTimeCode = 1
 endTimeCode = {end}
 timeCodesPerSecond = 30
)
def Xform "root"
{{
 {form}
 def Mesh "m" {{
  int[] faceVertexCounts = [3]
  int[] faceVertexIndices = [0, 1, 2]
  point3f[] points{points}
  token visibility{visibility}
 }}
 {more}
}}
"""
STILL = {"end": 25, "form": "", "points": " = [(0, 0, 0), (1, 0, 0), (0, 2, 0)]", "visibility": ' = "inherited"', "more": ""}
ARROW = "[(0, 0, 0), (1, 0, 0), (0, 2, 0)]"
MOVED = """double3 xformOp:translate.timeSamples = {1: (0, 0, 0), 25: (2, 0, 0)}
uniform token[] xformOpOrder = ["xformOp:translate"]"""
PLAYED = """def SkelAnimation "play" {
 uniform token[] joints = ["a"]
 quatf[] rotations.timeSamples = {1: [(1, 0, 0, 0)], 25: [(0, 1, 0, 0)]}
}"""
MOVES = {
    "place": {"form": MOVED},
    "points": {"points": f".timeSamples = {{1: {ARROW}, 9: [(0, 0, 1), (1, 0, 0), (0, 2, 0)]}}"},
    "visibility": {"visibility": '.timeSamples = {1: "inherited", 9: "invisible"}'},
    "skeleton": {"more": PLAYED},
}


@pytest.fixture(autouse=True)
def _no_blender(monkeypatch, tmp_path):
    scratch_cache(monkeypatch, tmp_path / "cache")
    monkeypatch.setattr(Blenders, "answer", lambda *_: pytest.fail("Blender was asked"))


@pytest.mark.parametrize("named", MOVES.values(), ids=MOVES)
def test_what_moves_has_its_frames(tmp_path, named):
    (tmp_path / "a.usda").write_text(TEXT.format(**STILL | named))
    line = animation_of(tmp_path / "a.usda", True)
    assert (line.first, line.last, line.fps, line.moves, line.clips) == (1, 25, 30, True, ())


@pytest.mark.parametrize("named", [{}, {"form": MOVED, "end": 1}], ids=["still", "one frame"])
def test_what_stands_still_has_none(tmp_path, named):
    (tmp_path / "a.usda").write_text(TEXT.format(**STILL | named))
    assert animation_of(tmp_path / "a.usda", True) is None


@pytest.mark.slow
def test_it_is_read_in_a_process_of_its_own(tmp_path, monkeypatch):
    monkeypatch.delenv(READ_HERE)
    (tmp_path / "a.usda").write_text(TEXT.format(**STILL | MOVES["place"]))
    assert animation_of(tmp_path / "a.usda", True).last == 25
    (tmp_path / "b.usda").write_text("#usda 1.0\ndef")
    with pytest.raises(ModelError, match=r"b\.usda: cannot be read as USD"):
        animation_of(tmp_path / "b.usda", True)
