"""Facts that a later version adds to records: this one reads the rest, and keeps them."""

import pytest

from small import small_recipe
from viewsphere import Dataset, generate
from viewsphere.errors import StoreError
from viewsphere.run.datasets.merging import merge
from viewsphere.store.shots import folder as shots
from viewsphere.store.shots.folder import Store
from viewsphere.store.shots.records import ModelInfo, PlanRecord

LATER = {"joints": [[0.5, {"hinge": 1}]], "note": "from a later version"}


@pytest.fixture
def later(tmp_path, monkeypatch):
    """A data set with optional facts in its shots, models and plan."""
    shot, model, plan = shots.kept_shot, ModelInfo.to_plain, PlanRecord.to_json
    with monkeypatch.context() as change:
        change.setattr(shots, "kept_shot", lambda old: shot(old).model_copy(update={"optional": LATER}))
        change.setattr(ModelInfo, "to_plain", lambda info: model(info) | {"optional": LATER})

        def with_facts(record):
            for part in record.parts:
                part.optional.update(LATER)
            return plan(record)

        change.setattr(PlanRecord, "to_json", with_facts)
        generate(small_recipe(channels=["rgb"]), tmp_path / "later")
    return tmp_path / "later"


def facts(root):
    """The optional facts of all shots, models and parts."""
    store = Store(root)
    plan = store.plan()
    infos = (store.model_info(key) for key in plan.models)
    yield from (store.labelled(row.key).optional for row in plan.rows)
    yield from (info.optional for info in infos if info is not None)
    yield from (part.optional for part in plan.parts)


def test_they_are_read_over_and_survive_a_merge(later, tmp_path):
    generate(small_recipe(channels=["rgb"]), tmp_path / "now")
    found = list(facts(later))
    assert len(found) >= 3
    assert all(one == LATER for one in found)
    for new, old in zip(Dataset(tmp_path / "now"), Dataset(later), strict=True):
        assert (new.rgb == old.rgb).all()
    merge([later, tmp_path / "now"], tmp_path / "merged")
    merged = list(facts(tmp_path / "merged"))
    assert merged.count(LATER) == len(found)
    assert merged.count({}) == len(merged) - len(found) > 0


def test_a_field_beside_them_is_refused(later):
    store = Store(later)
    key = next(iter(store.plan().rows)).key
    file = store.shot_folder(key) / "shot.json"
    text = file.read_text("utf-8")
    assert '"optional":{' in text
    file.write_text(text.replace('"optional":{', '"optionel":{'), "utf-8")
    with pytest.raises(StoreError, match="optionel"):
        store.labelled(key)


def test_they_do_not_part_shots_that_share_a_stage(later):
    store = Store(later)
    shot = store.labelled(next(iter(store.plan().rows)).key)
    assert shot.optional == LATER
    assert shot.stage_key == shot.model_copy(update={"optional": {}}).stage_key
