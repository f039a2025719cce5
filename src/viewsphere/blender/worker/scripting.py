"""Runs a user's own script on the staged scene; the user has allowed it."""

from __future__ import annotations

import traceback

import bpy

from .blurring import ORDER

ENTRY = "shade"
"""The function that a script defines: `shade(scene, objects, shot)`."""


def run(scene, told, order):
    """Call the script's `shade(scene, objects, shot)`: the scene, a dict of what is known of each of viewsphere's objects, and
    of the shot. `order` are the places among all things of what was staged.

    Raises ValueError with the script's line where it fails, and where it moves or hides an object, which no label would know.
    """
    placed = {one[ORDER]: one for one in scene.objects if ORDER in one}
    objects = {placed[place]: told["things"][number] for place, number in enumerate(order)}
    bpy.context.view_layer.update()
    before = {one: _standing(one) for one in objects}
    space = {"__name__": "viewsphere_script", "__file__": told["file"]}
    try:
        exec(compile(told["text"], told["file"], "exec"), space)
        if not callable(space.get(ENTRY)):
            raise ValueError(f"expected a function {ENTRY}(scene, objects, shot), found none")
        space[ENTRY](scene, objects, told["shot"])
    except Exception as error:
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == told["file"]]
        where = f", line {lines[-1]}" if lines else ""
        raise ValueError(f"engine.script: {told['file']}{where}: {type(error).__name__}: {error}") from None
    bpy.context.view_layer.update()
    for one, standing in before.items():
        if _standing(one) != standing:
            raise ValueError(
                f"engine.script: {told['file']}: expected objects that stand where they stood, with their meshes, as labels "
                f"know of nothing else; found {one.name!r} changed: change materials, lights and the world"
            )


def _standing(one):
    """What labels depend on: place, shape and whether it is shown."""
    modifiers = tuple(modifier.name for modifier in one.modifiers)
    return one.matrix_world.copy().freeze(), one.data.as_pointer(), len(one.data.vertices), one.hide_render, modifiers
