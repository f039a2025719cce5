"""Collections that are paused; only in processes of our own do later ones leave out what imports left."""

import gc
import subprocess
import sys

import pytest

from viewsphere.kernels.garbage import importing, pause_collection


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


def test_imports_freeze_nothing_in_a_process_of_the_users():
    frozen = gc.get_freeze_count()
    with importing():
        assert not gc.isenabled()
    assert gc.isenabled()
    assert gc.get_freeze_count() == frozen


def test_later_collections_skip_what_our_own_processes_import():
    code = """
import gc
from viewsphere.kernels.garbage import importing, spare_imports
spare_imports()
with importing():
    import decimal
print(gc.isenabled(), gc.get_freeze_count() > 1000, decimal.__dict__ in gc.get_objects())
"""
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert ran.stdout.split() == ["True", "True", "False"], ran.stderr
