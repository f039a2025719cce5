"""Runs a user's own script on the staged scene; the user has allowed it."""

from __future__ import annotations

import hashlib
import traceback

import numpy as np
from mathutils import Matrix

from ..files.contents import displaces
from ..files.evaluated import SOLID
from ..files.reading import evaluate
from ..rendering.blurring import ORDER

ENTRY = "shade"
"""The function that a script defines: `shade(scene, objects, shot)`."""

ELSEWHERE = Matrix.Translation((1.0, 2.0, 3.0))
"""The position of the camera during the comparison of scenes. The script never runs with this position, so the comparison also
finds objects that follow the camera.
"""


def run(scene, told):
    """Call the script's `shade(scene, objects, shot)` with the scene, and dicts of facts about viewsphere's objects and
    about the shot.

    Raises ValueError with the script's line if the script fails or exits, or changes the meshes that a camera sees or their
    visibility: labels would miss such changes.
    """
    placed = {one[ORDER]: one for one in scene.objects if ORDER in one}
    objects = {placed[order]: known for order, known in enumerate(told["things"])}
    before = _Standing.from_scene(scene)
    space = {"__name__": "viewsphere_script", "__file__": told["file"]}
    try:
        exec(compile(told["text"], told["file"], "exec"), space)
        if not callable(space.get(ENTRY)):
            raise ValueError(f"expected a function {ENTRY}(scene, objects, shot), found none")
        space[ENTRY](scene, objects, told["shot"])
        after = _Standing.from_scene(scene)
    except BaseException as error:  # every exception is the script's error, including sys.exit
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == told["file"]]
        where = f", line {lines[-1]}" if lines else ""
        said = f"{type(error).__name__}: {error}".removesuffix(": ")
        raise ValueError(f"engine.script: {told['file']}{where}: {said}") from None
    difference = before.difference(after)
    if difference is not None:
        raise ValueError(
            f"engine.script: {told['file']}: expected objects that stand where they stood, with their meshes, as labels "
            f"know of nothing else; found {difference}: change materials, lights and the world"
        )


class _Standing:
    """The facts on which labels depend: for every rendered instance of a mesh its place, its shape and its visibility to a
    camera, and the camera's own settings.
    """

    @classmethod
    def from_scene(cls, scene):
        """Return the current state of the scene, as a render with a camera at `ELSEWHERE` would show it."""
        made, resting = cls(scene), scene.camera.matrix_world.copy()
        scene.camera.matrix_world = ELSEWHERE
        evaluate(scene, made)
        scene.camera.matrix_world = resting
        return made

    def __init__(self, scene):
        camera = scene.camera
        known = camera.data.as_pointer(), camera.data.type, camera.parent, len(camera.constraints)
        self._known, self._names = {camera.session_uid: known}, {camera.session_uid: camera.name}

    def take(self, depsgraph):
        """Note all meshes that have vertices."""
        shapes = {}
        for instance in depsgraph.object_instances:
            item = instance.object
            owner = instance.parent if instance.is_instance else item
            if not instance.show_self or item.type not in SOLID:
                continue
            shape = _shape(item, shapes)
            if shape is None:
                continue
            key = owner.original.session_uid, item.original.session_uid, tuple(instance.persistent_id)
            self._names[key] = item.name
            self._known[key] = shape, tuple(map(tuple, instance.matrix_world)), *_seen(item.original, depsgraph.view_layer)

    def difference(self, after):
        """The first difference in words; None if there is none."""
        for key in {**self._known, **after._known}:
            if key not in after._known:
                return f"{self._names[key]!r} gone"
            if key not in self._known:
                return f"{after._names[key]!r} added"
            if self._known[key] != after._known[key]:
                return f"{self._names[key]!r} changed"
        return None


def _seen(one, layer):
    """Return an object's visibility to a camera and to the pass of indices, and viewsphere's identifier of it."""
    is_displaced = any(displaces(slot.material) for slot in one.material_slots)
    hidden = one.is_shadow_catcher, one.is_holdout, one.holdout_get(view_layer=layer), one.indirect_only_get(view_layer=layer)
    return one.visible_camera, *hidden, one.pass_index, one.get(ORDER), is_displaced


def _shape(item, known):
    """A digest of an evaluated object's triangles, None without vertices. `known` caches the digests of shared meshes."""
    if item.type == "META":
        try:
            return _digest(item.to_mesh())
        finally:
            item.to_mesh_clear()
    pointer = item.data.as_pointer()
    if pointer not in known:
        known[pointer] = _digest(item.data)
    return known[pointer]


def _digest(mesh):
    if mesh is None or not len(mesh.vertices):
        return None
    vertices = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", vertices)
    triangles = np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("vertices", triangles)
    return hashlib.blake2b(vertices.tobytes() + triangles.tobytes()).digest()
