"""Cycles' passes that separate a picture's light, and the passes of surfaces' materials."""

from __future__ import annotations

from contextlib import contextmanager

import bpy
import numpy as np

KINDS = ("Diffuse", "Glossy", "Transmission")
SHORT = {
    "Diffuse": "Diff", "Glossy": "Gloss", "Transmission": "Trans", "Direct": "Dir", "Indirect": "Ind", "Color": "Col",
    "Emission": "Emit", "Environment": "Env",
}  # fmt: skip
"""Words in the passes' names before Blender 5."""

LIGHT = (
    *(f"{kind} {what}" for kind in KINDS for what in ("Direct", "Indirect", "Color")),
    "Volume Direct",
    "Volume Indirect",
    "Emission",
    "Environment",
)
NAMES = (*LIGHT, *("".join(SHORT.get(word, word) for word in name.split()) for name in LIGHT))
"""The names of these passes: first in Blender 5, then, in the same order, in earlier versions."""

MATERIALS = ("viewsphere roughness", "viewsphere metallic")
"""Names of the passes (AOVs) of materials, and of the nodes that fill them."""

LEAST = "viewsphere least alpha"
"""Name of the node with the minimum opacity for a surface to count as seen."""


def ask_for_light(layer):
    """Switch on the passes of light; returns whether any was off."""
    words = [name.lower().replace("emission", "emit").replace(" ", "_") for name in LIGHT]
    owners = [(layer.cycles if word.startswith("volume") else layer, f"use_pass_{word}") for word in words]
    is_off = [not getattr(owner, name) for owner, name in owners]
    for owner, name in owners:
        setattr(owner, name, True)
    return any(is_off)


def ask_for_materials(layer):
    """Switch on the passes of materials; returns whether they were off."""
    missing = [name for name in MATERIALS if name not in layer.aovs]
    for name in missing:
        aov = layer.aovs.add()
        aov.name, aov.type = name, "VALUE"
    for material in bpy.data.materials if missing else ():
        material.update_tag()  # else persistent data keeps materials that fill no such pass
    return bool(missing)


def light(found, is_open):
    """Albedo, diffuse light, all other light and emission, (H, W, 12), from the rendered passes of light. With `is_open`,
    the light of the background is left out.
    """
    pairs = zip(NAMES[: len(LIGHT)], NAMES[len(LIGHT) :], strict=True)
    given = {name: found[name] if name in found else found[before] for name, before in pairs}
    sent = {kind: given[f"{kind} Color"] * (given[f"{kind} Direct"] + given[f"{kind} Indirect"]) for kind in KINDS}
    rest = sent["Glossy"] + sent["Transmission"] + given["Volume Direct"] + given["Volume Indirect"] + given["Emission"]
    rest = rest if is_open else rest + given["Environment"]
    return np.concatenate([given["Diffuse Color"], sent["Diffuse"], rest, given["Emission"]], axis=-1)


def materials(found):
    """Roughness and metallic, (H, W, 2)."""
    return np.concatenate([found[name] for name in MATERIALS], axis=-1)


@contextmanager
def sampled(scene, names, least):
    """Change how Cycles samples in the context, for some passes. For `objects` the ground is hidden and nothing is lit. For
    `materials` each pixel has one sample at its centre, which ignores surfaces less opaque than `least`.
    """
    wanted = []
    if "objects" in names:
        wanted += _unlit(scene) + [(one, "visible_camera", False) for one in scene.objects if one.is_shadow_catcher]
    if "materials" in names:
        wanted += _unlit(scene) + _centred(scene, least)
    before = [(owner, name, getattr(owner, name)) for owner, name, _ in wanted]
    try:
        for owner, name, value in wanted:
            setattr(owner, name, value)
        yield
    finally:
        for owner, name, value in reversed(before):
            setattr(owner, name, value)


def _unlit(scene):
    return [(scene.cycles, "use_denoising", False), (scene.cycles, "max_bounces", 0)]


def _centred(scene, least):
    """Return the settings to apply, as owner, name and value; sets the least opacity of surfaces in nodes at once."""
    for material in bpy.data.materials:
        node = material.node_tree.nodes.get(LEAST) if material.node_tree is not None else None
        if node is not None and node.outputs[0].default_value != least:
            node.outputs[0].default_value = least
    cycles = {"samples": 1, "use_adaptive_sampling": False, "pixel_filter_type": "GAUSSIAN", "filter_width": 0.01}
    return [(bpy.context.view_layer, "pass_alpha_threshold", least), *((scene.cycles, *each) for each in cycles.items())]
