"""Collections that are paused, and no object that later ones leave out: processes that run many commands would keep it."""

import gc

import pytest

from viewsphere.kernels.garbage import pause_collection


@pytest.mark.parametrize("collects", [True, False])
def test_collections_are_paused_and_nothing_is_frozen(collects):
    was, frozen = gc.isenabled(), gc.get_freeze_count()
    try:
        (gc.enable if collects else gc.disable)()
        with pause_collection():
            assert not gc.isenabled()
        assert gc.isenabled() == collects
        assert gc.get_freeze_count() == frozen
    finally:
        (gc.enable if was else gc.disable)()
