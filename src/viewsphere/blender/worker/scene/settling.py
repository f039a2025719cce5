"""Prepares a user's scene to be saved elsewhere as it is at the staged moment: without libraries and animation, and with
each rendered object's number in instance maps.
"""

from __future__ import annotations

import bpy

from ..files.evaluated import SOLID
from ..files.reading import evaluate
from .staging import is_placed

KEPT = (
    "visible_camera",
    "visible_diffuse",
    "visible_glossy",
    "visible_transmission",
    "visible_volume_scatter",
    "visible_shadow",
    "is_shadow_catcher",
    "is_holdout",
    "color",
)
"""Properties of an object that affect pictures."""


def settle(scene, members):
    """Prepare the open scene; `members` are the numbers of labelled objects by name, and of their instances."""
    _take_over(scene)
    _hold_still()
    _number(scene, members)


def number(told):
    """Number the objects of a staged file by the object that they belong to, for the index pass.

    The pass leaves out surfaces with less than `alpha`.
    """
    bpy.context.view_layer.pass_alpha_threshold = told["alpha"]
    _number(bpy.context.scene, told["members"])
    return {}


def _number(scene, members):
    numbering = _Numbering(members)
    evaluate(scene, numbering)
    numbering.apply(scene)


def _take_over(scene):
    """Make all linked library data local. Otherwise a saved number or path would belong to the library and be lost."""
    if not bpy.data.libraries:
        return
    before = set(scene.objects)
    bpy.ops.object.make_local(type="ALL")
    for one in set(scene.collection.objects) - before:  # what nothing uses is put into the scene
        scene.collection.objects.unlink(one)
    for kind in _kinds():
        for one in kind:
            if one.override_library is not None:
                one.override_library.destroy(do_hierarchy=False)
    bpy.data.batch_remove([library for library in bpy.data.libraries if not library.users_id])


def _kinds():
    """Return every collection of data-blocks."""
    return [getattr(bpy.data, p.identifier) for p in bpy.data.bl_rna.properties if p.type == "COLLECTION"]


def _hold_still():
    """Switch off a user's animation, which keeps the values of the staged moment: frames of the timeline become poses."""
    for kind in _kinds():
        for one in kind:
            for animated in (one, getattr(one, "node_tree", None)):
                data = getattr(animated, "animation_data", None)
                if data is not None:
                    data.action = None
                    for track in data.nla_tracks:
                        track.mute = True


class _Numbering:
    """The objects that a render shows, with the numbers of their owners. An object can have only one number: if owners with
    different numbers instance it, their instances become objects. So do particles that depend on time.
    """

    def __init__(self, members):
        self._members = members
        self._numbers, self._copies, self._owners = {}, [], []

    def take(self, depsgraph):
        """Collect the numbers of all objects that a render of this depsgraph would show, and the shapes of instances."""
        found, owners = {}, {}
        for owner, item, _ in self._shown(depsgraph):
            found.setdefault(item, set()).add(self._number(owner))
            owners.setdefault(owner, set()).add(item)
        clashing = {item for item, numbers in found.items() if len(numbers) > 1}
        apart = {owner for owner, items in owners.items() if items - {owner} and (items & clashing or _is_born(owner))}
        meshes = {}
        for owner, item, instance in self._shown(depsgraph):
            if owner not in apart:
                self._numbers[item] = self._number(owner)
                continue
            shown, mesh = instance.object, None
            if item.type in SOLID:
                key = (item, shown.data and shown.data.as_pointer())
                if key not in meshes:
                    meshes[key] = bpy.data.meshes.new_from_object(shown, preserve_all_data_layers=True, depsgraph=depsgraph)
                mesh = meshes[key]
            self._copies.append((item, mesh, instance.matrix_world.copy(), self._number(owner)))
        self._owners = list(apart)

    def _shown(self, depsgraph):
        """Owner, object and instance of everything that is rendered, except viewsphere's own objects."""
        for instance in depsgraph.object_instances:
            owner = instance.parent if instance.is_instance else instance.object
            if instance.show_self and not is_placed(owner):
                yield owner.original, instance.object.original, instance

    def _number(self, owner):
        return self._members.get(owner.name, 0)

    def apply(self, scene):
        """Give the objects their numbers, and turn clashing instances into objects of the scene."""
        for one in bpy.data.objects:
            if not is_placed(one):
                one.pass_index = self._numbers.get(one, 0)
        for item, mesh, matrix, number in self._copies:
            made = item.copy() if mesh is None else _solid(item, mesh)
            made.matrix_world, made.pass_index = matrix, number
            scene.collection.objects.link(made)
        for owner in self._owners:
            owner.hide_render = True


def _is_born(owner):
    """Return whether the object has particles that depend on time."""
    return any(system.settings.type == "EMITTER" for system in owner.particle_systems)


def _solid(item, mesh):
    """A new object that shows this mesh as the item does."""
    made = bpy.data.objects.new(item.name, mesh)
    for name in KEPT:
        setattr(made, name, getattr(item, name))
    for name, value in item.items():
        made[name] = value
    return made
