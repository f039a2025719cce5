"""What a .blend file carries is not run, and Blender reaches no network."""

from __future__ import annotations

import os
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


CONTAINED = """
import os, sys
sys.path.append(sys.argv[2])
from worker.confine import confine
folder = sys.argv[1]
if not confine([folder + "/given"], [folder + "/own"]):
    print("no Landlock")
    sys.stdout.flush()
    os._exit(0)
from worker.__main__ import start_blender
start_blender()
import bpy
bpy.ops.wm.open_mainfile(filepath=folder + "/given/file.blend", use_scripts=True)
print("went on")
"""

TRIES = """
import os, socket, urllib.request
from pathlib import Path
log = Path({folder!r}) / "own" / "log"
def tried(name, act):
    try:
        act()
    except OSError as error:
        log.open("a").write(name + ": " + type(error).__name__ + "\\n")
    else:
        log.open("a").write(name + ": done\\n")
tried("write", lambda: (Path({folder!r}) / "written").write_text("x"))
tried("key", lambda: (Path({folder!r}) / ".ssh" / "id").read_text())
tried("home", lambda: os.listdir(Path.home()))
tried("remove", lambda: os.remove({folder!r} + "/given/file.blend"))
tried("socket", lambda: socket.create_connection(("127.0.0.1", 9), timeout=1))
tried("name", lambda: socket.getaddrinfo("localhost", 80))
tried("own", lambda: (Path({folder!r}) / "own" / "fine").write_text("x"))
"""

MAKE_TRYING = """
import os, sys
import bpy
text = bpy.data.texts.new("run_me.py")
text.write(os.environ["TRIES"])
text.use_module = True
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1] + "/given/file.blend")
"""


def test_scripts_that_would_run_are_contained(blender, tmp_path):
    """The second wall: the file's script is run on purpose, and reaches only the process's own folder."""
    for name in ("given", "own", ".ssh"):
        (tmp_path / name).mkdir()
    (tmp_path / ".ssh" / "id").write_text("secret")
    worker, tries = Path(package.__file__).parent, TRIES.format(folder=str(tmp_path))

    def run(code):
        words = [blender, "-c", code + LEAVE, tmp_path, worker]
        return subprocess.run(words, capture_output=True, text=True, timeout=DEADLINE, env=os.environ | {"TRIES": tries})

    assert run(MAKE_TRYING).returncode == 0
    opened = run(CONTAINED)
    if "no Landlock" in opened.stdout:
        pytest.skip("needs Landlock, of Linux 5.13 and later")
    assert "went on" in opened.stdout, opened.stderr
    told = dict(line.split(": ") for line in (tmp_path / "own" / "log").read_text().splitlines())
    assert told.pop("own") == "done"
    assert told.keys() == {"write", "key", "home", "remove", "socket", "name"}
    assert set(told.values()) == {"PermissionError"}
    assert not (tmp_path / "written").exists()


MAKE_STYLED = """
import os, sys
import bpy
style = bpy.data.texts.new("style.py")
style.write(f"open({sys.argv[1] + '/style ran'!r}, 'w')")
scene = bpy.context.scene
scene.render.use_freestyle = scene.view_layers[0].use_freestyle = True
scene.view_layers[0].freestyle_settings.mode = "SCRIPT"
scene.view_layers[0].freestyle_settings.modules.new().script = style
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1] + "/file.blend")
"""
RENDER_STYLED = """
import os, sys
sys.path.append(sys.argv[2])
from worker.__main__ import start_blender
start_blender()
import bpy
from worker.files.opening import open_file
def ran():
    render = bpy.context.scene.render
    render.engine, render.resolution_x, render.resolution_y = "CYCLES", 8, 8
    bpy.context.scene.cycles.samples = 1
    bpy.ops.render.render()
    return [name for name in os.listdir(sys.argv[1]) if name.endswith(" ran")]
file = sys.argv[1] + "/file.blend"
print(open_file(file, "blend", None)[1])
assert bpy.context.scene.render.use_freestyle
assert not ran()
# That the file would have run is part of the proof.
bpy.ops.wm.open_mainfile(filepath=file)
print(ran())
"""


def test_style_modules_do_not_run(blender, tmp_path):
    """Blender runs them at rendering, whatever is set about scripts."""
    worker = Path(package.__file__).parent
    for code in (MAKE_STYLED, RENDER_STYLED):
        words = [blender, "-c", code + LEAVE, tmp_path, worker]
        run = subprocess.run(words, capture_output=True, text=True, timeout=DEADLINE)
        assert run.returncode == 0, run.stderr
    assert "style modules of Freestyle do not run: 'style.py'" in run.stdout
    assert "['style ran']" in run.stdout


def test_a_model_that_is_read_does_not_run(blender, tmp_path):
    run = subprocess.run([blender, "-c", MAKE + LEAVE, tmp_path], capture_output=True, text=True, timeout=DEADLINE)
    assert run.returncode == 0, run.stderr
    with BlenderProcess(blender) as process:  # not confined, so that what ran could be seen
        told = {"kind": "blend", "inside": [], "root": None, "most": 1000, "folder": str(process.folder)}
        assert process.ask("read", file=str(tmp_path / "file.blend"), **told)["placed"]
    assert [file.name for file in tmp_path.iterdir()] == ["file.blend"]
