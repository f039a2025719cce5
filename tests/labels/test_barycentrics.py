"""Barycentrics of a ground that reaches to the horizon, whose weights are large, are proved as others are."""

from dataclasses import replace

import numpy as np

import viewsphere as vs
from small import small_recipe
from viewsphere.labels.barycentrics import prove


def test_weights_of_a_ground_to_the_horizon_are_proved():
    recipe = small_recipe(
        viewpoints={"azimuth": [0, 120, 240], "elevation": [10], "distance": 4},
        camera={"size": [320, 240], "fov_deg": 50},
        channels=["barycentrics"],
        formats=[],
    )
    largest, shown = 0.0, None
    for shown in vs.render(recipe):
        assert list(prove(shown, {})) == []
        largest = max(largest, float(np.abs(shown.barycentrics).max()))
    assert largest > 100
    wrong = shown.barycentrics.copy()
    wrong[-1, 0, 0] += 0.001
    spoilt = replace(shown, channels={"barycentrics": wrong})
    assert list(prove(spoilt, {})) == ["expected weights that add up to 1, found others at 1 pixels"]
