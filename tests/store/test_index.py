"""The index of shots: every sample is in one row, and every way to a row leads to the same one."""

import tracemalloc
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewsphere.model.shard import Shard
from viewsphere.store.index import Block, Index, length, numbers

SUBJECTS = st.text("ab-0+", min_size=1, max_size=4)


@st.composite
def indices(draw):
    """Blocks in which no subject is twice at a position, as in a part of a data set."""
    names, blocks, begin = draw(st.lists(SUBJECTS, unique=True, min_size=1, max_size=4)), [], 0
    for _ in range(draw(st.integers(1, 4))):
        ranges = []
        for gap, size in draw(st.lists(st.tuples(st.integers(0, 5), st.integers(1, 40)), max_size=3)):
            ranges.append((begin + gap, begin + gap + size))
            begin += gap + size
        some = draw(st.lists(st.sampled_from(names), unique=True, max_size=4))
        blocks.append(Block(tuple(some), tuple(ranges), draw(st.integers(1, 3))))
    first, most, part = draw(st.integers(0, 99)), draw(st.integers(1, 20)), draw(st.integers(0, 3))
    return Index(tuple(blocks), first, most, part, draw(st.sampled_from(["", "+1", "+12"])))


@given(indices())
def test_rows_cover_all_samples_once_in_order(index):
    rows = list(index)
    covered = [sample for row in rows for sample in range(row.first, row.first + row.count)]
    assert covered == list(range(index.first, index.first + index.samples))
    wanted = [(s, n) for b in index.blocks for s in b.subjects for n in numbers(b.positions) for _ in range(b.each)]
    each = {id(b): b.each for b in index.blocks}
    assert sum(each[id(b)] * b.size * len(b.subjects) for b in index.blocks) == index.samples == len(wanted)
    shown = [(row.subject, n) for row in rows for n in numbers(row.positions)]
    assert shown == list(dict.fromkeys(wanted))
    assert all(row.part == index.part and row.count for row in rows)


@given(indices())
def test_every_way_leads_to_the_same_row(index):
    rows = list(index)
    assert len(index) == len(rows)
    assert [index[i] for i in range(len(index))] == rows == list(index[:])
    assert [index[i - len(index)] for i in range(len(index))] == rows
    assert all(index.row_at(row.first) == index.row_at(row.first + row.count - 1) == row for row in rows)
    assert len({row.key for row in rows}) == len(rows)
    assert all(index.find(row.key) == row for row in rows)
    keys = ["", "no-such", *(row.key for row in rows), "a-999999"]
    assert list(index.rows_with_keys(keys)) == rows
    assert list(index.held(keys)) == [(row.key, row.subject, row.count) for row in rows]
    own = replace(index, shard=Shard(1, 3))
    assert list(own.held(keys)) == [(row.key, row.subject, row.count) for row in own]
    for subject in index.subjects:
        own = [row for row in rows if row.subject == subject]
        assert list(index.rows_of(subject)) == own
        assert index.count_of(subject) == len(own)
    for wrong in (len(index), -len(index) - 1):
        with pytest.raises(IndexError, match="expected a shot"):
            index[wrong]
    for wrong in (index.first - 1, index.first + index.samples):
        with pytest.raises(IndexError, match="expected a sample"):
            index.row_at(wrong)


@given(indices(), st.data())
def test_no_other_key_is_found(index, data):
    keys = {row.key for row in index}
    numbered = st.builds(lambda s, n, e: f"{s}-{n:06d}{e}", SUBJECTS, st.integers(0, 300), st.sampled_from(["", "+1", "+12"]))
    bent = st.sampled_from(sorted(keys) or ["a"]).flatmap(
        lambda k: st.sampled_from([k[1:], k[:-1], f"0{k}", f"{k}0", f"{k}+1"])
    )
    key = data.draw(numbered | bent | st.text(max_size=12))
    assert (index.find(key) is not None) == (key in keys)


@given(indices())
def test_shots_of_a_block_differ_by_one_position_at_most(index):
    for block in index.blocks:
        alone = Index((block,), 0, index.most, 0)
        sizes = {length(row.positions) for row in alone}
        assert not sizes or (max(sizes) <= index.most and max(sizes) - min(sizes) <= 1)


def test_memory_and_time_do_not_grow_with_the_samples():
    def peak(count):
        index = Index((Block(("car", "boat"), ((0, count),)),), 0, 16, 0)
        tracemalloc.start()
        assert index.find(index[len(index) - 1].key) == index.row_at(index.samples - 1)
        assert next(index.rows_of("boat")).first == count
        found = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return found

    assert peak(10**8) < peak(10**3) + 2_000
