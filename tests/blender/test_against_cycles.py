"""Instance maps against Cycles' own pass of object indices: of models, and of a scene of the user's own."""

from __future__ import annotations

import numpy as np
import pytest
from test_saved_blend import instanced, recipe_of  # noqa: F401 (a fixture)

from viewsphere import Dataset, generate
from viewsphere.blender.interpreter import find_blender
from viewsphere.blender.process import BlenderProcess
from viewsphere.check import check
from viewsphere.check.cycles import near
from viewsphere.engines._blender import staging
from viewsphere.errors import ModelError

pytestmark = [pytest.mark.timeout(300)]


def test_an_edge_is_a_pixel_whose_neighbour_is_seen():
    kept = np.zeros((5, 6), np.int32)
    kept[1:4, 1:3] = 7
    seen = np.full((5, 6), 7, np.int32)
    assert near(kept, seen)[:, :4].all() and not near(kept, seen)[:, 4:].any()
    assert near(kept, kept).all()


@pytest.mark.usefixtures("blender")
def test_labels_are_what_cycles_sees(tmp_path):
    generate(recipe_of(engine="raster"), tmp_path / "out")
    report = check(Dataset(tmp_path / "out"), sample=0, against_cycles=2)
    assert report.ok, report.findings
    assert report.checked["cycles"] == 2
    (note,) = (note for note in report.notes if note.startswith("Cycles'"))
    assert int(note.split(" frames, ")[1].split()[0]) <= 10


@pytest.fixture
def dying(monkeypatch):
    """Lets Blender die so many times when it is asked for numbers; gives the list of Blenders that are started from then on."""
    started, ask, start = list[BlenderProcess](), BlenderProcess.ask, staging._started

    def made(times):
        deaths = iter(range(times))

        def asked(self, do, *given, **told):
            if do == "number" and next(deaths, None) is not None:
                self.close()
            return ask(self, do, *given, **told)

        monkeypatch.setattr(BlenderProcess, "ask", asked)
        monkeypatch.setattr(staging, "_started", lambda *given: started.append(start(*given)) or started[-1])
        return started

    return made


@pytest.mark.usefixtures("blender")
@pytest.mark.parametrize("times", [0, 1])
def test_a_blender_serves_all_frames_and_another_one_follows_if_it_dies(tmp_path, dying, times):
    generate(recipe_of(engine="raster"), tmp_path / "out")
    staging.keeper_of(find_blender()).drop()
    started = dying(times)
    report = check(Dataset(tmp_path / "out"), sample=0, rays=False, against_cycles=2)
    assert report.ok and report.checked["cycles"] == 2
    assert len(started) == 1 + times


@pytest.mark.usefixtures("blender")
def test_a_blender_that_dies_twice_is_one_line(tmp_path, dying):
    generate(recipe_of(engine="raster"), tmp_path / "out")
    dying(2)
    with pytest.raises(ModelError, match=r"^hair_drier_000, hair_drier_001: Blender was ended before `number` was asked$"):
        check(Dataset(tmp_path / "out"), sample=0, rays=False, against_cycles=1)


@pytest.mark.usefixtures("blender")
def test_what_cycles_sees_otherwise_is_found(tmp_path, monkeypatch):
    """Here a frame's map is that of another."""
    generate(recipe_of(engine="raster"), tmp_path / "out")
    dataset = Dataset(tmp_path / "out")
    other = dataset[2].channels["instances"]
    monkeypatch.setattr("viewsphere.check.cycles.kept_map", lambda sample: other)
    findings = [f for f in check(dataset, sample=0, rays=False, against_cycles=1).findings if f.check == "cycles"]
    assert len(findings) == 1 and findings[0].frame == 0
    assert "are not what Cycles sees, and on no edge" in findings[0].message


def test_instances_of_a_users_scene_are_what_cycles_sees(instanced):  # noqa: F811
    report = check(instanced[0], sample=0, against_cycles=2)
    assert not [finding for finding in report.findings if finding.check == "cycles"]
    assert report.checked["cycles"] == 2
