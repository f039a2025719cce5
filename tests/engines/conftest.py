"""Tests of engines bake all light themselves: what others have baked, with other constants, says nothing."""

import pytest


@pytest.fixture(autouse=True)
def light_is_baked(monkeypatch):
    monkeypatch.setattr("viewsphere.engines.raster.indirect.bounces.kept_light", lambda content, make, types: make())
