"""What a .blend file carries is not run, and Blender reaches no network."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from deadline import DEADLINE
from viewsphere import blender as package
from viewsphere.blender.process import BlenderProcess

pytestmark = [pytest.mark.slow]

MAKE = """
import os, sys
import bpy
text = bpy.data.texts.new("run_me.py")
text.write(f"open({sys.argv[1] + '/text ran'!r}, 'w')")
text.use_module = True
driver = bpy.data.objects[0].driver_add("location", 0).driver
driver.type = "SCRIPTED"
driver.expression = f"__import__('os').mkdir({sys.argv[1] + '/driver ran'!r}) or 1.0"
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1] + "/file.blend")
"""
OPEN = """
import os, socket, sys
sys.path.append(sys.argv[2])
from worker.__main__ import start_blender
start_blender()
import bpy
file = sys.argv[1] + "/file.blend"
def evaluate():
    bpy.context.scene.frame_set(5)
    bpy.context.evaluated_depsgraph_get().update()
bpy.ops.wm.open_mainfile(filepath=file)
evaluate()
bpy.ops.wm.read_factory_settings(use_empty=True)
with bpy.data.libraries.load(file) as (there, here):
    here.objects, here.texts = there.objects, there.texts
for one in here.objects:
    bpy.context.scene.collection.objects.link(one)
evaluate()
assert not [name for name in os.listdir(sys.argv[1]) if name.endswith(" ran")]
assert not bpy.context.preferences.filepaths.use_scripts_auto_execute
assert not bpy.app.online_access
try:
    socket.create_connection(("127.0.0.1", 9), timeout=1)
except PermissionError:
    print("kept off")
# That the file would have run is part of the proof.
bpy.ops.wm.open_mainfile(filepath=file, use_scripts=True)
evaluate()
print(sorted(name for name in os.listdir(sys.argv[1]) if name.endswith(" ran")))
"""


LEAVE = """
sys.stdout.flush()
os._exit(0)  # Blender 4.5 hangs in its own way out
"""


def test_files_do_not_run_and_sockets_do_not_open(blender, tmp_path):
    def run(code):
        worker = Path(package.__file__).parent
        return subprocess.run([blender, "-c", code + LEAVE, tmp_path, worker], capture_output=True, text=True, timeout=DEADLINE)

    made, opened = run(MAKE), run(OPEN)
    assert made.returncode == 0, made.stderr
    assert opened.returncode == 0, opened.stderr
    assert "kept off" in opened.stdout
    assert "['driver ran', 'text ran']" in opened.stdout


def test_a_model_that_is_read_does_not_run(blender, tmp_path):
    run = subprocess.run([blender, "-c", MAKE + LEAVE, tmp_path], capture_output=True, text=True, timeout=DEADLINE)
    assert run.returncode == 0, run.stderr
    with BlenderProcess(blender) as process:  # not confined, so that what ran could be seen
        told = {"kind": "blend", "inside": [], "root": None, "most": 1000, "folder": str(process.folder)}
        assert process.ask("read", file=str(tmp_path / "file.blend"), **told)["placed"]
    assert [file.name for file in tmp_path.iterdir()] == ["file.blend"]
