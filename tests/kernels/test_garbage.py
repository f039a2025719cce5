"""Collections that are paused, and objects that later ones leave out."""

import subprocess
import sys

import pytest

IMPORTING = """
import gc
from viewsphere.kernels.garbage import pause_collection
before, was = gc.get_freeze_count(), gc.isenabled()
with pause_collection():
    assert not gc.isenabled()
    import decimal
assert gc.isenabled() == was
print(gc.get_freeze_count() > before)
"""


@pytest.mark.parametrize("begin", ["", "import gc; gc.disable()\n"])
def test_modules_are_left_out_of_later_collections(begin):
    run = subprocess.run([sys.executable, "-c", begin + IMPORTING], capture_output=True, text=True, check=True)
    assert run.stdout == "True\n"
