"""Compile every kernel a shot needs in this process, so that workers find them in the cache."""

from __future__ import annotations

import numpy as np

from viewsphere import plugins
from viewsphere.assets.mesh import Image, Material, Mesh, Texture
from viewsphere.geometry.box import box_vertices
from viewsphere.geometry.compiler import pause_collection
from viewsphere.model.camera import Intrinsics
from viewsphere.model.channel import CHANNELS
from viewsphere.model.shot import ModelSpec, Placement, Pose, Shot
from viewsphere.run.stages import render_frame
from viewsphere.store import encode

SIZE = 16


def compile_kernels(shot: Shot) -> None:
    """Render one tiny frame of two cards with the shot's engine, channels, scene and lens; the picture is thrown away.

    The first time on a machine this takes some 20 CPU-seconds, later one or two.
    """
    lens = shot.intrinsics
    tiny = Intrinsics(width=SIZE, height=SIZE, fx=SIZE, fy=SIZE, cx=SIZE / 2, cy=SIZE / 2, distortion=lens.distortion)
    spec = ModelSpec(key="card", source="card", category="card", category_id=1)
    placements = tuple(Placement(id=i, model=spec) for i in (1, 2))
    frame = shot.frames[0].model_copy(update={"pose": Pose(index=0, azimuth_deg=0, elevation_deg=20, distance=2)})
    small = shot.model_copy(update={"intrinsics": tiny, "placements": placements, "frames": (frame,)})
    with pause_collection():
        _render(small)


def _render(shot: Shot) -> None:
    card = _card()
    engine: plugins.Engine = plugins.load("engines", shot.engine)
    stage = engine.stage(shot, lambda spec: card)
    boxes = [box_vertices(*card.bounds)] * len(shot.placements)
    sample = render_frame(shot, shot.frames[0], stage, boxes, [None] * len(boxes))
    for name, array in sample.channels.items():
        encode(CHANNELS[name], array, shot.files)


def _card() -> Mesh:
    """A card with a hole: textured, cut out, coloured by vertex."""
    corners = np.array([[-0.5, 0, -0.5], [0.5, 0, -0.5], [0.5, 0, 0.5], [-0.5, 0, 0.5]], np.float32)
    uv = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
    pixels = np.full((4, 4, 4), 255, np.uint8)
    pixels[1:3, 1:3, 3] = 0
    return Mesh(
        vertices=corners,
        triangles=np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        normals=np.tile(np.array([0, -1, 0], np.float32), (4, 1)),
        triangle_material=np.zeros(2, np.int32),
        triangle_part=np.zeros(2, np.int32),
        materials=(Material(base_color_texture=Texture(0), alpha_mode="MASK"),),
        uv0=uv,
        colors=np.ones((4, 4), np.float32),
        images=(Image("card", pixels),),
    )
