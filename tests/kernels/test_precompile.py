"""The table of kernels, and their compilation on all cores."""

from __future__ import annotations

import inspect
import io
import json
from collections import namedtuple
from importlib import import_module

import numpy as np
import pytest
from numba import typeof, types

from viewsphere import Recipe, plan
from viewsphere.kernels import overloads, precompile
from viewsphere.kernels.overloads import Overload
from viewsphere.kernels.precompile import compile_all
from viewsphere.run.shots.precompile import features

Pair = namedtuple("Pair", "first second")
READ_ONLY = np.zeros((2, 3), np.float32)
READ_ONLY.flags.writeable = False


@pytest.mark.parametrize(
    "value",
    [
        1,
        2.5,
        True,
        np.float32(1),
        np.uint64(1),
        np.zeros(3, np.bool_),
        np.zeros((2, 3, 4), np.uint16),
        np.zeros((4, 4))[::2],
        np.asfortranarray(np.zeros((4, 4))),
        READ_ONLY,
        (1, 2, 3),
        (1, 2.0, np.zeros(3)),
        (np.zeros(3), (1, 2)),
        Pair(np.zeros(3), np.zeros(3)),
        Pair(np.zeros(3, np.int32), READ_ONLY),
        (Pair(1, 2.0), 3),
    ],
)
def test_types_are_what_they_were(value):
    kind = typeof(value)
    (again,) = overloads.decoded(json.loads(json.dumps([overloads.encoded(kind)])))
    assert again == kind and str(again) == str(kind) and hash(again) == hash(kind)


@pytest.mark.parametrize("kind", [types.literal(3), types.unicode_type, types.Omitted(None), types.List(types.int64)])
def test_other_types_are_refused(kind):
    with pytest.raises(TypeError, match="expected numbers"):
        overloads.encoded(kind)


def test_the_table_is_in_order_and_its_kernels_are_there():
    table = overloads.table()
    assert len({each.name for each in table}) == len(table) > 100
    assert [each.seconds for each in table] == sorted((each.seconds for each in table), reverse=True)
    for each in table:
        kernel = getattr(import_module(each.module), each.kernel)
        kinds = overloads.decoded(json.loads(each.types))
        assert len(kinds) == len(inspect.signature(kernel.py_func).parameters), f"{each.name}: run scripts/kernels --add"
        for kind in kinds:
            if isinstance(kind, types.BaseNamedTuple):
                assert len(kind.types) == len(kind.fields), f"{each.name}: run scripts/kernels --add"


def test_what_a_shot_needs_is_decided_by_its_features():
    some = overloads.needed(frozenset())
    assert all(each.needs == () for each in some)
    everything = frozenset(feature for each in overloads.table() for feature in each.needs or ())
    more = overloads.needed(everything)
    assert set(some) < set(more) and all(each.needs is not None for each in more)


PLAIN = {
    "models": [{"source": "zoo:post_box"}],
    "viewpoints": {"kind": "orbit", "azimuth": [0, 40], "elevation": 20, "distance": 4},
    "time": {"frames": 2, "fps": 10},
    "splits": {"by": "sequence"},
}
CAMERAS = {
    "pinhole": ({}, {"kernels_draw.draw"}),
    "orthographic": (
        {"projection": "orthographic", "width_m": 4},
        {"kernels_parallel.draw", "kernels_samples.draw_parallel"},
    ),
    "rolling": (
        {"rolling": {"readout": 0.05}},
        {"kernels_rolling.draw", "kernels_rolling.list_active", "kernels_rolling.find_pixels", "kernels_samples.draw_rolling"},
    ),
}


@pytest.mark.parametrize("name", CAMERAS)
def test_the_kernels_of_a_camera_are_compiled_for_its_shots_alone(name):
    camera, kernels = CAMERAS[name]
    shot = next(iter(plan(Recipe.model_validate({**PLAIN, "camera": camera})).shots(lambda *_: np.zeros((8, 3)))))
    called = {f"{each.module.rpartition('.')[2]}.{each.kernel}" for each in overloads.needed(features(shot))}
    assert kernels <= called
    others = set().union(*(theirs for other, (_, theirs) in CAMERAS.items() if other not in (name, "pinhole")))
    assert called.isdisjoint(others)


def test_a_written_table_is_read_again(tmp_path, monkeypatch):
    made = [Overload("a", "b", "[]", None, 0.1), Overload("a", "c", '["int64"]', ("sky",), 2.5), Overload("a", "d", "[]", ())]
    overloads.write(made, tmp_path / "table.json")
    monkeypatch.setattr(overloads, "TABLE", tmp_path / "table.json")
    overloads.table.cache_clear()
    assert overloads.table() == (made[1], made[0], made[2])
    overloads.table.cache_clear()


LENS_KERNELS = "viewsphere.geometry.lenses.shared.kernels_lens"
LENS = Overload(LENS_KERNELS, "radial_fisheye", '[["float64", 1, "C"], "float64"]')


def test_one_that_cannot_be_compiled_is_left_to_its_callers():
    bad = [
        Overload("viewsphere.nowhere", "a", "[]"),
        Overload(LENS.module, "nothing", "[]"),
        Overload(LENS.module, LENS.kernel, "["),
    ]
    tasks = [json.dumps(vars(each)) for each in (*bad, LENS)]
    answers = io.StringIO()
    precompile.serve(io.StringIO("\n".join(tasks)), answers)
    assert answers.getvalue().split() == ["ModuleNotFoundError", "AttributeError", "JSONDecodeError", "compiled"]


@pytest.mark.slow
def test_kernels_are_compiled_by_processes_of_their_own(tmp_path, monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path))
    some = [
        LENS,
        Overload(LENS_KERNELS, "radial_fisheye", '[["float64", 1, "C"], "int64"]'),
    ]
    told = []
    assert set(compile_all(some, lambda done, total: told.append((done, total)), 2)) == set(some)
    assert told[0] == (0, 2) and told[-1] == (2, 2) and told == sorted(told)
    assert len(list(tmp_path.rglob("*.kernel"))) == 2


def test_where_no_process_can_be_started_nothing_is_compiled(monkeypatch):
    monkeypatch.setattr(precompile.sys, "executable", "/nowhere/python")
    told = []
    assert compile_all([LENS], lambda done, total: told.append((done, total))) == ()
    assert set(told) == {(0, 1)}
