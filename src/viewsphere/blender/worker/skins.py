"""Skins: which bones bend the vertices of an object, and how much."""

import numpy as np


def skin_of(item, mesh):
    """Names of the bones that may bend an object, in their armatures' order, and of each vertex of its evaluated mesh numbers
    of bones and their weights, (V, K) each; None for what no armature bends.
    """
    rigs = [m.object for m in item.modifiers if m.type == "ARMATURE" and m.object is not None and m.use_vertex_groups]
    groups = {group.name: group.index for group in item.vertex_groups}
    names = list(dict.fromkeys(b.name for rig in rigs for b in rig.data.bones if b.use_deform and b.name in groups))
    if not names:
        return None
    number = {groups[name]: i for i, name in enumerate(names)}
    own = [[(number[g.group], g.weight) for g in vertex.groups if g.group in number] for vertex in mesh.vertices]
    width = max(map(len, own), default=0)
    bones, weights = np.zeros((len(own), width), np.int32), np.zeros((len(own), width), np.float32)
    for i, pairs in enumerate(own):
        for k, (bone, weight) in enumerate(pairs):
            bones[i, k], weights[i, k] = bone, weight
    return names, bones, weights
