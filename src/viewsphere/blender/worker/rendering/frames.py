"""Renders the staged scene with an exact camera, and writes the pixels as arrays.

In a Blender without windows the image 'Render Result' has no pixels. Cycles' result has pixels while its engine runs, and is
read then. Pictures of the other renderers are read from a file.
"""

from __future__ import annotations

import time
from pathlib import Path

import bpy
import cycles
import numpy as np

from ..scene import ground
from . import compositing, passes, renderers
from .blurring import exposed
from .posing import camera_matrix

SENSOR = 36.0
"""Width of the camera's sensor in millimetres. Any value works, because the focal length is proportional to it."""

DRAWN_OFF = {
    "5": (0.009, -0.127),
    "8": (-0.121, -0.107),
    "11": (0.043, 0.043),
    "16": (0.040, -0.035),
    "32": (0.031, -0.094),
}
"""Displacement of Workbench's pictures, in pixels to the right and down, by number of samples, as measured: Workbench
shifts its sample pattern until one sample is in the middle.
"""

OTHERS_HIGHER = 0.1
"""Pixels by which all samples but one are higher in Blender 4.5, measured with square pixels; hardly any with other pixels."""

PASSES = {"index": ("use_pass_object_index", ("Object Index", "IndexOB")), "depth": ("use_pass_z", ("Depth",))}
"""The passes besides the colours: the view layer's property, and the pass's names in Blender 5 and before."""


def render(told):
    """Write (H, W, 4) float32 to `out`: scene-linear, premultiplied, the first row on top, empty outside the border.

    `blur` blurs moving things, see `blurring.exposed`. Each of the `passes` is written beside the colours, such as
    `picture.index.npy` beside `picture.npy`: index and depth (H, W, 1), light (H, W, 12) as in `passes.light`, objects (H,
    W, 3), their albedo without the ground's, and materials (H, W, 2). `passes.sampled` describes how the last two change the
    sampling.
    """
    scene = bpy.context.scene
    view = told["camera"]
    place_camera(scene, _straightened(scene, view))
    is_changed = _switch(scene.render, "film_transparent", told["transparent"])
    ground.show_sky(not told["transparent"])
    _set_border(scene, told["border"], view)
    wanted, has_more = _switched(bpy.context.view_layer, told)
    if is_changed or has_more or renderers.is_drawn(scene):
        scene.update_tag()  # else persistent data hides the change; updates meshes' tangents, too
    begun, cpu = time.monotonic(), time.process_time()
    file = Path(told["out"]).with_suffix(".exr")
    composed = file if compositing.is_used(scene) else None
    with exposed(scene, told.get("blur")), passes.sampled(scene, told["passes"], told.get("least")):
        found = _drawn(scene, file) if renderers.is_drawn(scene) else _rendered(_needed(told), composed)
    for name, pixels in _chosen(found, told).items():
        np.save(wanted[name], _whole(pixels, told["border"], view))
    return {"seconds": time.monotonic() - begun, "cpu_seconds": time.process_time() - cpu}


def _switched(layer, told):
    """Switch on the requested passes; returns the output file of each, and whether any was off."""
    wanted, has_more = {"picture": told["out"]}, False
    for name in told["passes"]:
        wanted[name] = told["out"].replace(".npy", f".{name}.npy")
        if name in ("light", "objects"):
            has_more |= passes.ask_for_light(layer)
        elif name == "materials":
            has_more |= passes.ask_for_materials(layer)
        else:
            has_more |= _switch(layer, PASSES[name][0], True)
    return wanted, has_more


def _needed(told):
    """Names, in any version of Blender, of the passes for the requested pictures."""
    parts = {"light": passes.NAMES, "objects": passes.NAMES, "materials": passes.MATERIALS}
    return {"Combined"}.union(*(parts[name] if name in parts else PASSES[name][1] for name in told["passes"]))


def _chosen(found, told):
    """The requested pictures by the names of requests, out of the renderer's pictures."""
    chosen = {"picture": found["Combined"]}
    for name in told["passes"]:
        if name == "light":
            chosen[name] = passes.light(found, told["transparent"])
        elif name == "objects":
            chosen[name] = passes.light(found, True)[..., :3]
        elif name == "materials":
            chosen[name] = passes.materials(found)
        else:
            chosen[name] = next(found[one] for one in PASSES[name][1] if one in found)
    return chosen


def _switch(owner, name, value):
    """Set a property; returns whether its value has changed."""
    is_changed = getattr(owner, name) != value
    if is_changed:
        setattr(owner, name, value)
    return is_changed


def _straightened(scene, view):
    """The view (camera) with its principal point moved so that the renderer's displaced picture lands in the right place."""
    samples = scene.display.render_aa if scene.render.engine == "BLENDER_WORKBENCH" else ""
    across, down = DRAWN_OFF.get(samples, (0.0, 0.0))
    is_square = abs(view["fx"] / view["fy"] - 1) < 1e-3
    if samples in DRAWN_OFF and bpy.app.version < (5, 0) and is_square:
        down -= OTHERS_HIGHER * (1 - 1 / int(samples))
    return {**view, "cx": view["cx"] - across, "cy": view["cy"] - down}


def place_camera(scene, view):
    """Make the camera one of these intrinsics: the principal point by the sensor's shift, fx / fy by the pixel aspect."""
    width, height, fx, fy = view["width"], view["height"], view["fx"], view["fy"]
    render = scene.render
    render.resolution_x, render.resolution_y = width, height
    if view["panorama"] is not None:  # whose properties hold all of K
        view, fx, fy = {**view, "cx": width / 2, "cy": height / 2}, width, width
    render.pixel_aspect_x, render.pixel_aspect_y = max(fy / fx, 1), max(fx / fy, 1)
    camera = scene.camera
    data = camera.data
    _choose_lens(data, view)
    data.sensor_fit, data.sensor_width = "HORIZONTAL", SENSOR
    data.lens = SENSOR * fx / width
    data.shift_x = 0.5 - view["cx"] / width
    data.shift_y = (view["cy"] - height / 2) / width * fx / fy
    data.clip_start, data.clip_end = view["near"], view["far"]
    camera.matrix_world = camera_matrix(view["R"], view["center"])


def _choose_lens(data, view):
    """Set the type of the camera, and the properties that the type has besides a pinhole's."""
    data.type = view["type"]
    owner = data
    if view["panorama"] is not None:
        owner = data if hasattr(data, "panorama_type") else data.cycles  # before Blender 5
        owner.panorama_type = view["panorama"]
    for name, value in {**view["values"], **view["lengths"]}.items():
        setattr(owner, name, value)


def _set_border(scene, border, view):
    scene.render.use_border = scene.render.use_crop_to_border = border is not None
    if border is not None:
        # Blender truncates the border to pixels: a thousandth of a pixel more keeps rounding from dropping a row.
        left, top, right, bottom = (v + 1e-3 for v in border)
        scene.render.border_min_x, scene.render.border_max_x = left / view["width"], right / view["width"]
        low, high = view["height"] - bottom + 2e-3, view["height"] - top + 2e-3
        scene.render.border_min_y, scene.render.border_max_y = low / view["height"], high / view["height"]


def _rendered(names, composed):
    """The named passes of one render of Cycles, (H, W, C) float32 each, the first row on top. If a compositor is used, the
    colours come from the file `composed`, which it writes.
    """
    found = {}
    original = cycles.CyclesRender.render

    def watched(self, depsgraph):
        original(self, depsgraph)
        result = self.get_result()
        if result.layers[0].name != bpy.context.view_layer.name:
            return
        for name, one in result.layers[0].passes.items():
            if name in names:
                values = np.empty(result.resolution_x * result.resolution_y * one.channels, np.float32)
                one.rect.foreach_get(values)
                shape = result.resolution_y, result.resolution_x, one.channels
                found[name] = np.ascontiguousarray(values.reshape(shape)[::-1])

    cycles.CyclesRender.render = watched
    try:
        if composed is not None:
            bpy.context.scene.render.filepath = str(composed)
        bpy.ops.render.render(write_still=composed is not None)
    finally:
        cycles.CyclesRender.render = original
    if "Combined" not in found:
        raise RuntimeError(
            f"Cycles gave no picture of the view layer {bpy.context.view_layer.name!r}: see that it is rendered, and that the "
            "compositor's Render Layers show it"
        )
    if composed is not None:
        found["Combined"] = compositing.with_alpha(compositing.read_picture(composed), found["Combined"])
        composed.unlink()
    return found


def _drawn(scene, file):
    """The colours of one picture, (H, W, 4) float32, the first row on top.

    If the compositor drops the alpha, the picture is drawn again without the compositor.
    """
    drawn = _written(scene, file)
    if scene.render.film_transparent and compositing.is_used(scene) and (drawn[..., 3] == 1).all():
        scene.render.use_compositing = False
        try:
            drawn = compositing.with_alpha(drawn, _written(scene, file))
        finally:
            scene.render.use_compositing = True
    return {"Combined": drawn}


def _written(scene, file):
    """A rendered picture, read back from the file that Blender writes."""
    scene.render.filepath = str(file)
    bpy.ops.render.render(write_still=True)
    pixels = compositing.read_picture(file)
    file.unlink()
    return pixels


def _whole(pixels, border, view):
    """A whole picture that contains the rendered part within the border and is empty elsewhere."""
    if border is None:
        return pixels
    left, top, right, bottom = border
    whole = np.zeros((view["height"], view["width"], pixels.shape[2]), np.float32)
    whole[top:bottom, left:right] = pixels
    return whole
