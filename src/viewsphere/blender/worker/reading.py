"""A model file that Blender opens or imports, as plain arrays and expressions: what `viewsphere.assets.via_blender` asks for.

The file is evaluated once, as its first frame would be rendered: by a render engine that paints nothing and takes what it is
given. So modifiers, particles and visibility are those of renders, not of the window.
"""

from __future__ import annotations

from pathlib import Path

import bpy

from .evaluated import Gathering
from .opening import choose, open_file
from .pictures import Pictures
from .weight import check_weight


def read(told):
    """Open `told["file"]`, of a `told["kind"]`, and write its arrays to `told["folder"]`.

    `inside` names what of a .blend file is wanted, as Blender writes it: `["Object", name]`, `["Collection", name]` or
    nothing. `root` is the folder that what the file names has to lie in, None for anywhere; `most` the number of triangles.
    Raises ValueError in one line for what cannot be read.
    """
    unit, warnings = open_file(told["file"], told["kind"], told["root"])
    scene = bpy.context.scene
    wanted = choose(scene, told["inside"])
    check_weight(scene, wanted, told["most"])
    pictures = Pictures(told["folder"], told["root"])
    gathering = Gathering(told["folder"], pictures, wanted, told["most"])
    _evaluate(scene, gathering)
    return {
        "unit": unit,
        "pieces": gathering.pieces,
        "placed": gathering.placed,
        "materials": gathering.materials,
        "images": pictures.told,
        "warnings": warnings + gathering.warnings,
        "files": [str(Path(file).resolve()) for file in bpy.utils.blend_paths(absolute=True)],
    }


def _evaluate(scene, gathering):
    """Give the scene as it is rendered to `gathering`."""
    failed = []

    class Taker(bpy.types.RenderEngine):
        bl_idname = "VIEWSPHERE_TAKER"
        bl_label = "viewsphere"

        def render(self, depsgraph):
            try:
                gathering.take(depsgraph)
            except Exception as error:
                failed.append(error)

    bpy.utils.register_class(Taker)
    _prepare(scene)
    scene.render.engine = Taker.bl_idname
    bpy.ops.render.render(layer=bpy.context.view_layer.name)
    if failed:
        raise failed[0]


def _prepare(scene):
    """A picture of a few pixels by a camera of our own, and nothing that happens after rendering."""
    render = scene.render
    render.resolution_x = render.resolution_y = 8
    render.resolution_percentage = 100
    render.use_border = render.use_multiview = render.use_freestyle = render.use_motion_blur = False
    render.use_compositing = render.use_sequencer = False
    scene.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(scene.camera)
