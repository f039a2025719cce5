"""Blender's renderers: how each of them works, and whether those that draw through OpenGL can do so here."""

from __future__ import annotations

import time
from contextlib import suppress

import bpy

from . import compositing

ENOUGH = 8
"""Samples from which on normals help the denoiser."""

FAINT = 1e-3
"""Light of a lamp below which EEVEE leaves it out; without a limit it would leave out all of it."""

TRIED = 8
"""Pixels a side of the picture by which drawing is tried."""


def set_up(scene, settings):
    """How a renderer works: what is unchanged stays in memory, and there are no more threads than it may have."""
    render = scene.render
    render.use_persistent_data = True
    render.threads_mode = "FIXED" if settings["threads"] else "AUTO"
    render.threads = max(settings["threads"], 1)
    render.resolution_percentage = 100
    _choose(render, settings["renderer"])
    owners = _SET_UP[settings["renderer"]](scene, settings)
    for name, value in settings["own"].items():
        _set(settings["renderer"], owners, name, value)


def is_drawn(scene):
    """Whether its renderer draws through OpenGL, and gives its pictures by files alone."""
    return scene.render.engine != "CYCLES"


def try_drawing(told):
    """Draw next to nothing; how long that took, and with which driver. Where it cannot be done Blender may not survive it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    _choose(scene.render, told["renderer"])
    scene.render.resolution_x = scene.render.resolution_y = TRIED
    scene.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(scene.camera)
    begun = time.monotonic()
    bpy.ops.render.render()
    return {"seconds": time.monotonic() - begun, "driver": _driver()}


def _driver():
    with suppress(Exception):  # before the first picture, and in some versions always, it is a secret
        import gpu

        return gpu.platform.renderer_get()
    return None


def _choose(render, name):
    """Make this the renderer; Blender 4.5 has another name for one."""
    render.engine = {
        "cycles": "CYCLES",
        "eevee": "BLENDER_EEVEE" if bpy.app.version >= (5, 0, 0) else "BLENDER_EEVEE_NEXT",
        "workbench": "BLENDER_WORKBENCH",
    }[name]


def _set_up_cycles(scene, settings):
    """One process a core, no adaptive sampling unless asked for."""
    cycles = scene.cycles
    cycles.samples = settings["samples"]
    cycles.use_adaptive_sampling = False
    cycles.use_light_tree = False
    cycles.max_bounces = settings["bounces"]
    cycles.transparent_max_bounces = 16
    cycles.seed = 0
    _denoise(cycles, settings["denoise"], settings["samples"])
    _choose_device(cycles, settings["device"].upper())
    return (cycles,)


def _denoise(cycles, how, samples):
    """Open Image Denoise; normals that are themselves noise, of a few samples, would tell it to keep the noise."""
    cycles.use_denoising = how != "off"
    if how != "off":
        cycles.denoiser = "OPENIMAGEDENOISE"
        cycles.denoising_input_passes = "RGB_ALBEDO_NORMAL" if samples >= ENOUGH else "RGB_ALBEDO"
        cycles.denoising_prefilter = "ACCURATE" if how == "best" else "NONE"
        if hasattr(cycles, "denoising_quality"):  # Blender 4.2 and later
            cycles.denoising_quality = "HIGH" if how == "best" else "FAST"


def _choose_device(cycles, name):
    """The processor, or all graphics cards that Cycles reaches this way; raises ValueError if there is none."""
    cycles.device = "CPU" if name == "CPU" else "GPU"
    if name == "CPU":
        return
    preferences = bpy.context.preferences.addons["cycles"].preferences
    chosen = []
    with suppress(TypeError):  # a kind that this build does not know
        preferences.compute_device_type = name
        preferences.refresh_devices()
        chosen = [device for device in preferences.devices if device.type == name]
    if not chosen:
        raise ValueError(f"engine.device: expected cpu or a device that Cycles can reach, found no {name.lower()} device")
    for device in preferences.devices:
        device.use = device in chosen


def _set_up_eevee(scene, settings):
    """Light of lamps without end, as it is elsewhere; mirrors and near shade as far as the picture shows what makes them."""
    compositing.set_up(scene)
    eevee = scene.eevee
    eevee.taa_render_samples = settings["samples"]
    eevee.use_raytracing = settings["raytracing"]
    eevee.use_shadows = True
    eevee.light_threshold = FAINT
    return (eevee,)


def _set_up_workbench(scene, settings):
    """Colours and textures in the light of a studio."""
    compositing.set_up(scene)
    display = scene.display
    display.render_aa = "OFF" if settings["samples"] == 1 else str(settings["samples"])
    shading = display.shading
    shading.light, shading.color_type = "STUDIO", "TEXTURE"
    shading.show_specular_highlight = False
    return shading, display


_SET_UP = {"cycles": _set_up_cycles, "eevee": _set_up_eevee, "workbench": _set_up_workbench}
_TITLES = {"cycles": "Cycles", "eevee": "EEVEE", "workbench": "Workbench"}


def _set(renderer, owners, name, value):
    """A setting by its name in Python; raises ValueError for one that the renderer does not have, or does not take."""
    expected = f"engine.settings.{name}: expected a setting of {_TITLES[renderer]} and a value it takes, found {value!r}"
    owner = next((one for one in owners if name in one.bl_rna.properties), None)
    if owner is None:  # Blender 4.5 would take it
        raise ValueError(expected)
    try:
        setattr(owner, name, value)
    except (AttributeError, TypeError) as error:
        raise ValueError(f"{expected}: {error}") from None
