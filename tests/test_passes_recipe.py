"""The recipe of passes: rendered, stored, proved and drawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import viewsphere as vs
from small import ROOT
from viewsphere.check import check
from viewsphere.check.frames.comparing import files
from viewsphere.model.channel import FINISHED, PASSES
from viewsphere.preview.frame import draw_sample
from viewsphere.report.pictures import SCALES, layers

NAMES = [name for name in PASSES if name not in FINISHED]


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    out = tmp_path_factory.mktemp("passes") / "out"
    vs.generate(vs.Recipe.load(ROOT / "recipes" / "labels" / "passes.yaml", {"camera.size": [96, 72]}), out)
    return vs.open(out)


@pytest.mark.slow
def test_passes_are_stored_and_proved(dataset):
    assert check(dataset, sample=1).ok
    assert {*NAMES} <= {*dataset[0].channels}


@pytest.mark.slow
def test_passes_are_drawn(dataset):
    assert draw_sample(dataset[0], NAMES).shape == (72, 96 * (1 + len(NAMES)), 3)
    assert {*NAMES} <= {*layers(dataset[0], SCALES[-1])}


@pytest.mark.slow
@pytest.mark.parametrize(("name", "wrong"), [("albedo", 1.5), ("shading", -0.1), ("roughness", np.nan), ("residual", np.inf)])
def test_what_is_no_light_or_share_is_found(dataset, name, wrong):
    array = np.array(dataset[0].channels[name])
    array[3, 4] = wrong
    changed = replace(dataset[0], channels={**dict(dataset[0].channels.items()), name: array})
    (message,) = files(changed)
    assert message.startswith(f"{name}: expected ")
