"""Hints of mistakes that are reported together take time for those that are shown alone."""

import pytest

from viewsphere.errors import MOST_TOLD
from viewsphere.validation import errors as mistakes
from viewsphere.validation.errors import Nearest, nearest
from viewsphere.validation.suggestions import suggestion


@pytest.mark.slow
def test_as_many_names_are_compared_as_are_shown(monkeypatch: pytest.MonkeyPatch):
    compared = list[object]()
    monkeypatch.setattr(mistakes, "suggestion", lambda name, known: compared.append(name) or suggestion(name, known))  # pyright: ignore
    known = [f"model_{i:04}" for i in range(500)]
    hint = Nearest()

    told = [hint(f"modle_{i:04}", known) for i in (*range(300), 0)]

    assert len(compared) == MOST_TOLD
    assert told[:MOST_TOLD] == [nearest(f"modle_{i:04}", known) for i in range(MOST_TOLD)]
    assert told[3] == "; did you mean 'model_0003'?"
    assert told[-1] == told[0]


@pytest.mark.parametrize(
    ("name", "meant"), [("elevatoin", "elevation"), ("azimut", "azimuth"), ("elephant", None), ("elevati", "elevation")]
)
def test_names_of_other_lengths_are_still_near(name: str, meant: str | None):
    assert suggestion(name, ("azimuth", "elevation", "plant", "distance")) == meant
