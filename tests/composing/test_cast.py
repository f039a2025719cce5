"""Who stands beside whom."""

from viewsphere.composing.composition import companions
from viewsphere.model.model_spec import ModelSpec


def spec(key):
    return ModelSpec(key=key, source="x.obj", category="thing", category_id=1)


def test_a_model_more_takes_only_the_places_it_wins():
    specs = [spec(f"m{i:03d}") for i in range(30)]
    before = {s.key: companions(5, s, specs[:29], 1, (s.key,)) for s in specs[:29]}
    after = {s.key: companions(5, s, specs, 1, (s.key,)) for s in specs[:29]}
    changed = [k for k in before if before[k] != after[k]]
    assert 0 < len(changed) < 8
    assert all(after[k][0] is specs[29] for k in changed)


def test_companions_are_others_each_once_and_all_get_their_turn():
    specs = [spec(f"m{i}") for i in range(6)]
    chosen = {s.key: companions(0, s, specs, 4, (s.key,)) for s in specs}
    for key, others in chosen.items():
        assert len({o.key for o in others}) == 4 and key not in {o.key for o in others}
    assert {o.key for others in chosen.values() for o in others} == {s.key for s in specs}
    fixed = [companions(0, s, specs, 1, ())[0].key for s in specs]
    assert len(set(fixed)) == 2  # one for all but itself
    assert chosen == {s.key: companions(0, s, specs[::-1], 4, (s.key,)) for s in specs}
