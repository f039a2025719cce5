"""A rival for the benchmark: OpenGL draws truth's labels, read back to memory; without a GPU by Mesa's llvmpipe."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from viewsphere.model.sensors.camera import Camera
from viewsphere.truth.raster.geometry import Geometry

NEAR = 0.1
"""Distance of the near plane, metres; there is no far plane."""

VERTEX = """
#version 330
uniform mat4 clip_from_world;
uniform mat3 camera_from_world;
in vec3 vertex;
in vec3 normal;
in float object;
out vec3 turned;
flat out float instance;
void main() {
    gl_Position = clip_from_world * vec4(vertex, 1.0);
    turned = camera_from_world * normal;
    instance = object;
}
"""

FRAGMENT = """
#version 330
in vec3 turned;
flat in float instance;
layout(location = 0) out vec2 ids;
layout(location = 1) out vec4 surface;
void main() {
    vec3 normal = normalize(turned);
    ids = vec2(instance, float(gl_PrimitiveID + 1));
    surface = vec4(gl_FrontFacing ? normal : -normal, 1.0 / gl_FragCoord.w);
}
"""


class NoOpenGL(Exception):
    """This machine has no OpenGL 3.3 that draws without a window."""


def opengl(geometry: Geometry) -> tuple[str, Callable[[Camera], tuple[Any, Any]]]:
    """The driver's name, and the function that draws a frame: (H, W, 2) float32, instance and triangle + 1 (exact to 2 ** 24),
    and (H, W, 4) float32, normal and z-depth in metres; 0 where nothing is seen. The triangles stay in OpenGL's memory.
    """
    import moderngl

    context = _context(moderngl)
    program = context.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
    objects = np.zeros(len(geometry.vertices), np.float32)
    objects[geometry.triangles] = geometry.triangle_object[:, None]
    rows = np.column_stack((geometry.vertices, geometry.normals, objects)).astype(np.float32)
    corners = context.buffer(geometry.triangles.astype(np.uint32))
    layout = [(context.buffer(rows), "3f 3f 1f", "vertex", "normal", "object")]
    triangles = context.vertex_array(program, layout, corners)
    targets: dict[tuple[int, int], Any] = {}

    def draw(camera: Camera) -> tuple[Any, Any]:
        size = camera.width, camera.height
        if size not in targets:
            textures = [context.texture(size, components, dtype="f4") for components in (2, 4)]
            targets[size] = context.framebuffer(textures, context.depth_renderbuffer(size))
        target = targets[size]
        target.use()
        target.clear()
        program["clip_from_world"].write(clip_from_world(camera).T.astype(np.float32).tobytes())
        program["camera_from_world"].write(camera.R.T.astype(np.float32).tobytes())
        triangles.render()
        ids, surface = (np.empty((camera.height, camera.width, components), np.float32) for components in (2, 4))
        target.read_into(ids, components=2, attachment=0, dtype="f4")
        target.read_into(surface, components=4, attachment=1, dtype="f4")
        return ids, surface

    return f"OpenGL ({context.info['GL_RENDERER']}): ids, depth, normals", draw


def _context(moderngl: Any) -> Any:
    """An OpenGL context without a window, with depth testing."""
    options = {"backend": "egl"} if sys.platform.startswith("linux") else {}
    try:
        context = moderngl.create_context(standalone=True, require=330, **options)
    except Exception as error:  # the libraries that moderngl loads raise errors of many kinds
        raise NoOpenGL(str(error)) from error
    context.enable_only(moderngl.DEPTH_TEST)
    context.front_face = "cw"  # the picture is drawn upside down, which reverses windings
    return context


def clip_from_world(camera: Camera) -> Any:
    """Matrix (4, 4) to OpenGL's clip coordinates: w is the z-depth, and the picture's top row comes first in memory."""
    x, y, w = camera.P
    return np.stack((2 * x / camera.width - w, 2 * y / camera.height - w, w - [0, 0, 0, 2 * NEAR], w))
