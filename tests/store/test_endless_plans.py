"""Plans of more frames than anybody renders: what is finished is read, and nobody counts out the rest."""

import pytest

from command_line import viewsphere
from cube_dataset import FEW, POSES, make
from viewsphere.check import check
from viewsphere.check.repair import repair
from viewsphere.errors import StoreError
from viewsphere.report import write_report
from viewsphere.run.datasets.merging import merge
from viewsphere.run.exports.exporting import export
from viewsphere.store import Dataset
from viewsphere.store.index import Index
from viewsphere.store.shots.manifest import sealed, unsealed

ENDLESS = 10**15


@pytest.fixture
def rows_made(monkeypatch):
    """Counts the rows that are made; more than some thousands are refused."""
    made, own = [], Index._row

    def counted(self, *place):
        made.append(place)
        assert len(made) < 5000
        return own(self, *place)

    monkeypatch.setattr(Index, "_row", counted)
    return made


def change(root, **fields):
    """Let the plan say something else."""
    file = root / "store" / "plan.json"
    value = unsealed(file.read_text("utf-8"))
    for name, field in fields.items():
        value[name] = field
    file.write_text(sealed(value), "utf-8")


def endless(root, frames=ENDLESS):
    """A data set whose plan has so many poses of each of its three models, of which four are there of one."""
    dataset = make(root, leave_out=(1, 2), channels=FEW)
    part = dataset.plan.parts[0]
    plain = unsealed((root / "store" / "plan.json").read_text("utf-8"))["parts"][0]
    plain |= {"blocks": [{"subjects": list(part.subjects), "positions": [[0, frames]], "each": 1}], "frames": 3 * frames}
    change(root, parts=[plain], frames=3 * frames, poses=frames)
    return root


def test_what_is_there_of_an_endless_plan_is_read_proved_shown_and_exported(tmp_path, rows_made):
    dataset = Dataset(endless(tmp_path / "out"))
    assert [sample.index for sample in dataset] == list(range(len(POSES)))
    report = check(dataset, rays=False)
    told = [finding.message for finding in report.findings if finding.check == "counts"]
    assert len(told) == 1
    assert f"expected {3 * ENDLESS} frames" in told[0]
    assert f"found 4: shot block-0-000004 is the first of {3 * ENDLESS // 4 - 1} missing" in told[0]
    assert {finding.check for finding in report.findings} == {"counts"}
    assert report.checked["files"] == 4
    write_report(dataset, tmp_path / "page.html")
    export(dataset.root, ["coco", "native"])
    assert rows_made


def test_an_endless_plan_is_not_finished_and_neither_appended_to_nor_merged(tmp_path, rows_made):
    root = endless(tmp_path / "out")
    make(tmp_path / "other", channels=FEW)
    with pytest.raises(StoreError, match="found 4: render it to the end"):
        merge([tmp_path / "other", root], tmp_path / "merged")
    gap = next(Dataset(root).store.gaps(Dataset(root).plan))
    assert (gap.first.key, gap.frames, gap.of) == ("block-0-000004", 3 * ENDLESS - 4, 3 * ENDLESS)


def test_models_that_were_left_out_are_not_missed_however_many_frames_they_have(tmp_path, rows_made):
    root = endless(tmp_path / "out")
    (root / "store" / "skipped.json").write_text('{"block-0": "broken", "block-1": "broken", "block-2-000000": "no room"}')
    (gap,) = Dataset(root).store.gaps(Dataset(root).plan)
    assert (gap.first.key, gap.of, gap.frames) == ("block-2-000004", ENDLESS - 4, ENDLESS - 4)


def test_repair_renders_no_endless_plan(tmp_path, rows_made):
    repaired = repair(endless(tmp_path / "out"), rays=False)
    assert not repaired.done
    assert any("MAX_REPAIRED_SHOTS" in str(finding) for finding in repaired.report.findings)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("blocks", [{"subjects": ["a"], "positions": [[0, 10**30]], "each": 1}]),
        ("blocks", [{"subjects": ["a"], "positions": [[4, 0]], "each": 1}]),
        ("blocks", [{"subjects": ["a"], "positions": [[-4, 8]], "each": 1}]),
        ("blocks", [{"subjects": ["a"], "positions": [[0, 4]], "each": 0}]),
        ("frames", 10**30),
        ("shot_frames", 0),
    ],
)
def test_numbers_that_no_plan_has_are_refused_in_one_line(field, value, tmp_path):
    root = make(tmp_path / "out", leave_out=(1, 2), channels=FEW).root
    plain = unsealed((root / "store" / "plan.json").read_text("utf-8"))["parts"][0]
    change(root, parts=[plain | {field: value}])
    answer = viewsphere("check", root)
    assert answer.returncode == 2
    assert answer.stderr.count("\n") == 1
    assert "expected a readable plan" in answer.stderr
