"""Thingi10K: models with tables of their licences."""

from __future__ import annotations

from asset_trees import faces_front, planned, pointer, put

SUMMARY = "ID,Thing ID,License,Link\n32770,10955,Creative Commons - Attribution - Share Alike,https://example.org\n"
CONTEXT = 'Thing ID,Date,Category,Sub-category,Name,Author,License\n10955,2011,Household,Kitchen,"Spoon, big",maker,x\n'


def test_models_have_the_licence_and_the_author_of_the_tables(tmp_path):
    put(tmp_path / "raw_meshes" / "32770.obj", pointer("+z", "-y", 40))
    put(tmp_path / "raw_meshes" / "32771.obj", pointer("+z", "-y", 40))
    put(tmp_path / "metadata" / "input_summary.csv", SUMMARY)
    put(tmp_path / "metadata" / "contextual_data.csv", CONTEXT)
    plan = planned(f"thingi10k:{tmp_path}")
    assert [(spec.key, spec.category) for spec in plan.model_specs] == [("32770", "household"), ("32771", "object")]
    assert faces_front(plan.model_specs[0], 0.04)
    credit = plan.credits["32770"]
    assert (credit.licence, credit.attribution) == ("CC-BY-SA-4.0", '"Spoon, big" by maker')
    assert credit.source_url == "https://www.thingiverse.com/thing:10955"
