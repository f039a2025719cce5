"""Splits: quotas of models, none without a model, and what is there stays where it is."""

from collections import Counter, defaultdict

import pytest
from hypothesis import given
from hypothesis import strategies as st

import viewsphere as vs
from small import small_recipe
from viewsphere.errors import RecipeError
from viewsphere.planning.extension import extend, whole
from viewsphere.planning.splits import dealt, quotas
from viewsphere.recipe.recipe import Splits

SHARES = st.lists(st.integers(1, 50), min_size=1, max_size=6).map(
    lambda parts: {f"split_{i}": part / sum(parts) for i, part in enumerate(parts)}
)
KEYS = st.lists(st.text("abc", min_size=1, max_size=6), unique=True, max_size=30)


def splits_of(shares):
    return Splits.model_validate({"by": "model", **shares})


def recipe(models, **fields):
    return small_recipe(models=models, splits={"by": "model", "train": 0.5, "val": 0.5}, **fields)


def test_70_to_30_of_ten_is_seven_and_three():
    assert quotas({"train": 0.7, "val": 0.3}, 10) == {"train": 7, "val": 3}
    found = dealt(splits_of({"train": 0.7, "val": 0.3}), 1, [f"car_{i}" for i in range(10)], {}, {})
    assert Counter(found.values()) == {"train": 7, "val": 3}


@given(SHARES, st.integers(0, 1000))
def test_quotas_are_all_of_them_near_their_shares_and_none_is_empty(shares, count):
    found = quotas(shares, count)
    assert list(found) == list(shares)
    assert sum(found.values()) == count
    assert min(found.values()) >= (1 if count >= len(shares) else 0)
    if all(share * count >= 1 for share in shares.values()):
        assert all(abs(found[name] - share * count) < 1 for name, share in shares.items())


@given(SHARES, KEYS, st.integers(0, 9), st.randoms())
def test_the_order_of_models_does_not_matter(shares, keys, seed, random):
    shuffled = random.sample(keys, len(keys))
    assert dealt(splits_of(shares), seed, shuffled, {}, {}) == dealt(splits_of(shares), seed, keys, {}, {})


@given(SHARES, KEYS, st.integers(0, 30), st.integers(0, 9))
def test_models_that_come_later_move_none(shares, keys, cut, seed):
    before = dealt(splits_of(shares), seed, keys[:cut], {}, {})
    after = dealt(splits_of(shares), seed, keys[::-1], before, {})
    assert {key: after[key] for key in before} == before
    new = Counter(after[key] for key in keys[cut:])
    assert new == Counter({name: n for name, n in quotas(shares, len(keys[cut:])).items() if n})


def test_company_is_of_one_split_after_appending_too():
    fields = {"scene": {"company": 1}}
    first = whole(vs.plan(recipe([{"source": "zoo:post_box", "count": 6}], **fields)))
    more = extend(vs.plan(recipe([{"source": "zoo:post_box", "count": 11}], **fields)), first.record)
    assert {key: more.plan.dealt_splits[key] for key in first.plan.dealt_splits} == first.plan.dealt_splits
    assert Counter(more.part.dealt_splits.values()) in ({"train": 3, "val": 2}, {"train": 2, "val": 3})
    for spec in more.plan.model_specs:
        assert len({more.plan.dealt_splits[member.key] for member in more.plan.cast(spec.key)}) == 1


@pytest.mark.parametrize(("draw", "units"), [("fixed", 1), ("per_model", 12), ("per_frame", 12 * 6)])
def test_a_place_is_in_one_split(draw, units):
    scene = {"place": {"source": "zoo:neighbourhood", "draw": draw}}
    models = [{"source": "zoo:post_box", "count": 12}]
    views = {"azimuth": list(range(0, 360, 60)), "distance": 5}
    planned = vs.plan(small_recipe(models=models, viewpoints=views, scene=scene, splits={"by": "place", "a": 0.5, "b": 0.5}))
    found = defaultdict(set)
    for spec in planned.model_specs:
        for pose in planned.schedule(spec).poses:
            place = {"fixed": None, "per_model": spec.key, "per_frame": (spec.key, pose)}[draw]
            found[place].add(planned.split(spec.key, pose))
    assert len(found) == units
    assert {len(names) for names in found.values()} == {1}
    assert len(set.union(*found.values())) == (1 if draw == "fixed" else 2)


def test_by_place_needs_a_place():
    with pytest.raises(RecipeError, match=r"splits\.by: expected scene\.place, .*; found none") as caught:
        vs.plan(small_recipe(splits={"by": "place", "train": 0.5, "val": 0.5}))
    assert "\n" not in str(caught.value)
