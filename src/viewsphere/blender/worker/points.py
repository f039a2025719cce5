"""Points that a file names: objects that say so, else the bones that bend meshes."""

PREFIX = "keypoint:"
"""Begins the name of an object that is a point; the rest is the point's name."""

PROPERTY = "keypoint"
"""The custom property that makes an object a point: its name, or true for that of the object."""


class Points:
    """Collects the points of what a render would show: `found` are names, places and the numbers of those above."""

    def __init__(self, wanted):
        self.found, self._wanted = [], wanted

    def take(self, depsgraph):
        """Collect all points of a depsgraph: objects that are asked for, in the order of their names, else bones."""
        there = sorted(depsgraph.objects, key=lambda one: one.name)
        said = {one.name: name for one in there if self._is_wanted(one) and (name := _said(one))}
        self._tell([(one, said[one.name], one.matrix_world.translation) for one in there if one.name in said])
        if not said:
            for rig in self._rigs(there):
                bones = [bone for bone in rig.pose.bones if bone.bone.use_deform]
                self._tell([(bone, bone.name, rig.matrix_world @ bone.head) for bone in bones])

    def _is_wanted(self, one):
        return self._wanted is None or one.original.as_pointer() in self._wanted

    def _rigs(self, there):
        """Armatures that bend objects which are asked for."""
        bent = [one for one in there if self._is_wanted(one) and one.type != "ARMATURE"]
        used = {m.object.name for one in bent for m in one.modifiers if m.type == "ARMATURE" and m.object is not None}
        return [one for one in there if one.type == "ARMATURE" and one.name in used]

    def _tell(self, owners):
        numbers = {one.name: len(self.found) + i for i, (one, _, _) in enumerate(owners)}
        for one, name, place in owners:
            above = one.parent
            while above is not None and above.name not in numbers:
                above = above.parent
            number = None if above is None else numbers[above.name]
            self.found.append({"name": name, "place": list(place), "above": number})


def _said(one):
    """The point that an object is said to be; empty for any other."""
    said = one.get(PROPERTY)
    if said and not isinstance(said, str):
        return one.name.removeprefix(PREFIX)
    return said or (one.name.removeprefix(PREFIX) if one.name.startswith(PREFIX) else "")
