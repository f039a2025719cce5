"""Meshes and their pictures from arrays; triangles keep the arrays' order.

glTF's v points down, Blender's up: v is flipped here and nowhere else, and Blender stores a picture's last row first. Layer
names: `uv0`, `uv1`, `colors`.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

UV_LAYERS = "uv0", "uv1"
COLORS = "colors"


@dataclass(frozen=True)
class Images:
    """A mesh's pictures as Blender images, made at the first request. Each file becomes at most one colour and one data
    image.
    """

    told: list
    made: dict

    def get(self, index, is_color):
        """The picture as sRGB colours or as plain numbers; colours with an alpha of 0 are kept."""
        told = self.told[index]
        key = told["pixels"], is_color
        if key not in self.made:
            self.made[key] = _image(told, is_color)
        return self.made[key]


def build_images(told, made=None):
    """The pictures that `told` lists, for `materials.build_material`; meshes built with the same dict `made` share images."""
    return Images(told, {} if made is None else made)


def _image(told, is_color):
    pixels = np.load(told["pixels"])
    height, width = pixels.shape[:2]
    image = bpy.data.images.new(told["name"] or "picture", width, height, alpha=True, is_data=not is_color)
    image.alpha_mode = "CHANNEL_PACKED"
    image.colorspace_settings.name = "sRGB" if is_color else "Non-Color"
    image.pixels.foreach_set(np.multiply(pixels[::-1], np.float32(1 / 255), dtype=np.float32).reshape(-1))
    image.update()
    return image


def build_mesh(name, told, materials):
    """A Blender mesh of the arrays in `told`, with these materials; triangle i is polygon i, and normals are kept exactly."""
    vertices = np.nan_to_num(np.load(told["vertices"]))
    triangles, normals = _wound(vertices, np.load(told["triangles"]), np.load(told["normals"]))
    mesh = bpy.data.meshes.new(name)
    for material in materials:
        mesh.materials.append(material)
    count = len(triangles)
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", _flat(vertices))
    mesh.loops.add(3 * count)
    mesh.loops.foreach_set("vertex_index", triangles.reshape(-1))
    mesh.polygons.add(count)
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * count, 3, dtype=np.int32))
    mesh.polygons.foreach_set("material_index", np.load(told["triangle_material"]))
    _add_layers(mesh, told, triangles)
    mesh.update(calc_edges=True)
    # This attribute (Blender 4.5 and later) keeps normals exactly: Blender neither rounds them nor changes them at edges.
    mesh.attributes.new("custom_normal", "FLOAT_VECTOR", "POINT").data.foreach_set("vector", _flat(normals))
    return mesh


def _add_layers(mesh, told, triangles):
    """Texture coordinates per corner, colours per vertex."""
    for name in UV_LAYERS:
        if told[name] is not None:
            uv = np.nan_to_num(np.load(told[name]))
            uv[:, 1] = 1 - uv[:, 1]
            mesh.uv_layers.new(name=name, do_init=False).uv.foreach_set("vector", _flat(uv[triangles]))
    if told[COLORS] is not None:
        colors = np.nan_to_num(np.load(told[COLORS]))
        mesh.color_attributes.new(COLORS, "FLOAT_COLOR", "POINT").data.foreach_set("color", _flat(colors))


def _wound(vertices, triangles, normals):
    """The triangles, wound so that each front faces the side of its normals, and unit normals.

    Cycles would shade a front whose normals point to its back as if light came through the surface. A vertex without a normal
    gets the mean normal of its triangles.
    """
    normals = np.nan_to_num(normals, posinf=0.0, neginf=0.0)
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    faces = np.cross(b - a, c - a)
    is_turned = np.einsum("ij,ij->i", faces, normals[triangles].sum(axis=1)) < 0
    triangles = np.where(is_turned[:, None], triangles[:, [0, 2, 1]], triangles)
    length = np.linalg.norm(normals, axis=1)
    is_missing = length < 1e-6
    if is_missing.any():
        faces[is_turned] *= -1
        corners = triangles.reshape(-1)
        sums = [np.bincount(corners, np.repeat(faces[:, k], 3), len(vertices)) for k in range(3)]
        normals[is_missing] = np.stack(sums, axis=1)[is_missing]
        normals[~normals.any(axis=1)] = (0, 0, 1)
        length = np.linalg.norm(normals, axis=1)
    return triangles, normals / length[:, None]


def _flat(array):
    return np.ascontiguousarray(array, np.float32).reshape(-1)
