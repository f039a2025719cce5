"""Opens and imports files, and selects the wanted objects of a .blend file."""

from __future__ import annotations

from difflib import get_close_matches
from pathlib import Path

import bpy

from .addons import needed, remove_styles
from .playing import play, set_span
from .rates import DEFAULT, key_rate, own_rate, set_rate

IMPORTS = {
    "abc": lambda file, _: bpy.ops.wm.alembic_import(filepath=file, as_background_job=False),
    "fbx": lambda file, _: bpy.ops.wm.fbx_import(filepath=file),
    "glb": lambda file, _: bpy.ops.import_scene.gltf(filepath=file, disable_bone_shape=True),
    "usd": lambda file, cameras: bpy.ops.wm.usd_import(
        filepath=file, import_cameras=cameras, import_lights=False, create_world_material=False
    ),
}
SAME = {"gltf": "glb", "usda": "usd", "usdc": "usd", "usdz": "usd"}
NAMES_SAID = 8
"""Largest number of similar names in a message, which is one line."""


def open_file(file, kind, root, cameras=False, clip=None, fps=None):
    """Open the file as the scene, at the file's first frame. Returns the metres in one unit of the file, and warnings.

    A USD file's cameras are imported if `cameras` is true. `clip` names the animation to play. `fps` is the number of frames
    per second; None: the file's own.
    """
    try:
        if kind == "blend":
            bpy.ops.wm.open_mainfile(filepath=file, load_ui=False, use_scripts=False)
        else:
            _import(file, SAME.get(kind, kind), cameras, fps)
    except RuntimeError as error:
        raise ValueError(" ".join(str(error).removeprefix("Error: ").split())) from None
    warnings = remove_styles()
    scene = bpy.context.scene
    if fps is not None:
        set_rate(scene, fps)
    if clip is not None or kind != "blend":
        play(clip)
    set_span(scene, kind)
    scene.frame_set(scene.frame_start)
    units = scene.unit_settings
    metres = units.scale_length if kind == "blend" and units.system != "NONE" else 1.0
    return metres, [*warnings, *_newer(kind), *_libraries(root), *needed()]


def _import(file, kind, cameras, fps):
    """Import a file into an empty scene of `fps` frames per second; None: the file's own rate, which Blender's reader of FBX
    sets itself. A glTF file stores the times of its keys in seconds. It is imported again if these times are not frames of
    the first import.
    """
    rate = fps or own_rate(file, kind) or DEFAULT
    _import_at(file, kind, cameras, rate)
    if kind == "glb" and fps is None:
        own = key_rate()
        if own is not None and own != rate:
            _import_at(file, kind, cameras, own)


def _import_at(file, kind, cameras, rate):
    """Import a file into an empty scene of this frame rate; an FBX file brings its own."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    render = bpy.context.scene.render
    set_rate(bpy.context.scene, rate)
    if kind == "glb":  # Blender's reader of glTF multiplies by fps_base where it should divide
        render.fps_base = 1 / render.fps_base
    IMPORTS[kind](file, cameras)
    if kind != "fbx":
        set_rate(bpy.context.scene, rate)


def _newer(kind):
    """A warning if a file comes from a later Blender than this one."""
    version = bpy.data.version[:2]
    if kind != "blend" or tuple(version) <= tuple(bpy.app.version[:2]):
        return []
    here, there = (".".join(map(str, v)) for v in (bpy.app.version[:2], version))
    return [f"written by Blender {there}, read by {here}: what is new in it is lost"]


def _libraries(root):
    """Warnings about files that the open file links: files outside `root` are disabled, others may be missing."""
    said = []
    for library in list(bpy.data.libraries):
        path = Path(bpy.path.abspath(library.filepath, library=library.parent)).resolve()
        if root is not None and not is_within(path, root):
            bpy.data.libraries.remove(library)
            said.append(f"library {str(path)!r} is outside the model's folder, not read; set confined: false to allow")
        elif not path.is_file():
            said.append(f"library {str(path)!r} does not exist")
    return said


def is_within(path, root):
    """Return whether a file is in the folder or below, after following links."""
    return Path(path).resolve().is_relative_to(Path(root).resolve())


def choose(scene, inside):
    """Link the wanted objects into the scene; returns their addresses, None if all rendered objects are wanted."""
    if not inside:
        return None
    kind, name = inside
    there = {"Object": bpy.data.objects, "Collection": bpy.data.collections}[kind]
    found = there.get(name)
    if found is None:
        raise ValueError(f"expected {_article(kind)} of the name {name!r}, found {_named(there, name)}")
    objects = [found, *found.children_recursive] if kind == "Object" else list(_rendered(found))
    if kind == "Object":
        found.hide_render = False  # an object asked for by name counts even where it is hidden
    linked = set(scene.collection.objects)
    for one in objects:
        if one not in linked:
            scene.collection.objects.link(one)
    return {one.as_pointer() for one in objects}


def _rendered(collection):
    """Objects of a collection and of the collections in it, without collections that renders do not show."""
    yield from dict.fromkeys(collection.objects)
    for child in collection.children:
        if not child.hide_render:
            yield from _rendered(child)


def _article(kind):
    return "an object" if kind == "Object" else "a collection"


def _named(there, name):
    names = [one.name for one in there]
    near = get_close_matches(name, names, NAMES_SAID, 0.4) or names[:NAMES_SAID]
    more = f" and {len(names) - len(near)} more" if len(names) > len(near) else ""
    return ", ".join(map(repr, near)) + more if names else "none at all"
