"""Settings of Blender's renderers, and a test whether OpenGL, which EEVEE and Workbench need, works here."""

from __future__ import annotations

import time
from contextlib import suppress

import bpy

from . import compositing

ENOUGH = 8
"""Samples per pixel from which the normals pass helps the denoiser."""

FAINT = 1e-3
"""Light below which EEVEE ignores a lamp; a threshold of 0 would make EEVEE ignore all lamps."""

TRIED = 8
"""Width and height, in pixels, of the test picture."""


def set_up(scene, settings):
    """Configure the renderer: unchanged data stay in memory between renders, and the number of threads is limited."""
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
    """Return whether the scene's renderer draws through OpenGL, so that its pictures have to be read from files."""
    return scene.render.engine != "CYCLES"


def try_drawing(told):
    """Draw a tiny picture; returns the seconds it took and the driver's name. Blender may crash if OpenGL does not work."""
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
    with suppress(Exception):  # not known before the first picture, in some versions never
        import gpu

        return gpu.platform.renderer_get()
    return None


def _choose(render, name):
    """Select the renderer; one of them has another name in Blender 4.5."""
    render.engine = {
        "cycles": "CYCLES",
        "eevee": "BLENDER_EEVEE" if bpy.app.version >= (5, 0, 0) else "BLENDER_EEVEE_NEXT",
        "workbench": "BLENDER_WORKBENCH",
    }[name]


def _set_up_cycles(scene, settings):
    """Cycles' settings; adaptive sampling is off unless requested."""
    cycles = scene.cycles
    cycles.samples = settings["samples"]
    cycles.use_adaptive_sampling = False
    cycles.use_light_tree = False
    cycles.max_bounces = settings["bounces"]
    # Cycles also limits each kind of bounce, by default to four: too few for light between walls.
    cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = settings["bounces"]
    cycles.transparent_max_bounces = 16
    cycles.seed = 0
    _denoise(cycles, settings["denoise"], settings["samples"])
    _choose_device(cycles, settings["device"].upper())
    return (cycles,)


def _denoise(cycles, how, samples):
    """Switch on Open Image Denoise. With few samples it gets no normals pass, because the denoiser would preserve that
    pass's noise.
    """
    cycles.use_denoising = how != "off"
    if how != "off":
        cycles.denoiser = "OPENIMAGEDENOISE"
        cycles.denoising_input_passes = "RGB_ALBEDO_NORMAL" if samples >= ENOUGH else "RGB_ALBEDO"
        cycles.denoising_prefilter = "ACCURATE" if how == "best" else "NONE"
        if hasattr(cycles, "denoising_quality"):  # Blender 4.2 and later
            cycles.denoising_quality = "HIGH" if how == "best" else "FAST"


def _choose_device(cycles, name):
    """Compute on the processor, or on all devices of the kind `name` (CUDA, HIP, ...); raises ValueError if there is none."""
    cycles.device = "CPU" if name == "CPU" else "GPU"
    if name == "CPU":
        return
    preferences = bpy.context.preferences.addons["cycles"].preferences
    chosen = []
    with suppress(TypeError):  # a kind of device that this build does not know
        preferences.compute_device_type = name
        preferences.refresh_devices()
        chosen = [device for device in preferences.devices if device.type == name]
    if not chosen:
        raise ValueError(f"engine.device: expected cpu or a device that Cycles can reach, found no {name.lower()} device")
    for device in preferences.devices:
        device.use = device in chosen


def _set_up_eevee(scene, settings):
    """EEVEE's settings: lamps light at any distance, as in the other renderers; reflections use screen space."""
    compositing.set_up(scene)
    _filter_evenly()
    eevee = scene.eevee
    eevee.taa_render_samples = settings["samples"]
    eevee.use_raytracing = settings["raytracing"]
    eevee.use_shadows = True
    eevee.light_threshold = FAINT
    return (eevee,)


def _set_up_workbench(scene, settings):
    """Workbench's settings: textures, lit by the studio (`studio`)."""
    compositing.set_up(scene)
    _filter_evenly()
    display = scene.display
    display.render_aa = "OFF" if settings["samples"] == 1 else str(settings["samples"])
    shading = display.shading
    shading.light, shading.color_type = "STUDIO", "TEXTURE"
    shading.show_specular_highlight = False
    return shading, display


def _filter_evenly():
    """Filter textures equally in all directions: with anisotropic filters, Mesa's software OpenGL hangs on a texture that
    repeats up to a horizon.
    """
    bpy.context.preferences.system.anisotropic_filter = "FILTER_0"


_SET_UP = {"cycles": _set_up_cycles, "eevee": _set_up_eevee, "workbench": _set_up_workbench}
_TITLES = {"cycles": "Cycles", "eevee": "EEVEE", "workbench": "Workbench"}


def _set(renderer, owners, name, value):
    """Set a renderer's property by its Python name; raises ValueError for an unknown name or a refused value."""
    expected = f"engine.settings.{name}: expected a setting of {_TITLES[renderer]} and a value it takes, found {value!r}"
    owner = next((one for one in owners if name in one.bl_rna.properties), None)
    if owner is None:  # Blender 4.5 would accept any name
        raise ValueError(expected)
    try:
        setattr(owner, name, value)
    except (AttributeError, TypeError) as error:
        raise ValueError(f"{expected}: {error}") from None
