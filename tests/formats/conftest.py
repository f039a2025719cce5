"""Fixtures: data sets of stills, poses, videos and drives (tests/worlds.py), rendered once; do not change them."""

from __future__ import annotations

import pytest

from viewsphere import Dataset
from worlds import WORLDS, rendered, shared_place


def _world(name: str):
    @pytest.fixture(scope="session", name=name)
    def world(tmp_path_factory):
        return Dataset(rendered(name, shared_place(tmp_path_factory)))

    return world


stills, poses, videos, drives = map(_world, WORLDS)
