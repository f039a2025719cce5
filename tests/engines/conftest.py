"""Tests of engines bake all light themselves: what others have baked, with other constants, says nothing."""

import pytest


@pytest.fixture(autouse=True)
def light_is_baked(monkeypatch):
    for module in ("indirect.bounces", "shadows.occlusion", "sky.environment"):
        monkeypatch.setattr(f"viewsphere.engines.raster.{module}.kept_light", lambda content, make, types: make())
