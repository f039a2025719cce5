"""Normalised meshes as OBJ and GLB files, triangles in the mesh's own order."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.animation.deforming import DeformingMesh
from viewsphere.assets.exporting.glb import deforming_glb_bytes, glb_bytes
from viewsphere.assets.exporting.runs import runs
from viewsphere.assets.mesh import Material, Mesh, Texture
from viewsphere.codecs.png_tiff import encode_png
from viewsphere.codecs.srgb import encoded
from viewsphere.model.model_spec import step_key


def export_glb(mesh: Mesh, path: Path) -> Path:
    """Write the mesh as GLB with all its material fields; returns the path.

    In glTF's axes, an exact permutation of the object's: (x, y, z) becomes (x, z, -y). The concatenated triangles of all
    primitives are `mesh.triangles`. There is one node per part. Equal meshes give equal bytes.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(glb_bytes(mesh))
    return path


def export_deforming(model: DeformingMesh, folder: Path, name: str, seconds: Mapping[int, float]) -> None:
    """Write `<name>.glb` with all time steps of a model, and an OBJ of each, `<name>-f0013.obj`, which share `<name>.mtl` and
    its textures while materials stay the same. `seconds` gives the time, by frame, at which the GLB's animation shows each
    step; without playback, the first is shown.

    In the GLB, a time step is a node with the OBJ's name. Each has its own vertices, exact to the last bit; other equal data is
    shared. Otherwise as `export_glb` and `export_obj`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    names = {frame: step_key(name, frame) for frame in model.meshes}
    (folder / f"{name}.glb").write_bytes(deforming_glb_bytes(model, names, seconds))
    library, last = name, None
    for frame, mesh in model.meshes.items():
        if last is not None and (mesh.materials is not last.materials or mesh.images is not last.images):
            library = names[frame]
        export_obj(mesh, folder, names[frame], library)
        last = mesh


def export_obj(mesh: Mesh, folder: Path, name: str, library: str = "") -> Path:
    """Write `<name>.obj`, `<name>.mtl` and its textures to the folder; returns the OBJ's path. If the name of a material
    `library` is given, meshes of equal materials and images share it: it replaces `<name>.mtl` and is written once.

    In object axes (Z up, front -Y, metres), with digits that read back as the same float32. The faces are `mesh.triangles` in
    order, with a group (`g`) per part. MTL keeps base colour, opacity, metallic, roughness, normal, emission and clearcoat; the
    base colour's texture transform is applied to the coordinates. Equal meshes give equal bytes.
    """
    folder.mkdir(parents=True, exist_ok=True)
    names = _plain_names(material.name or "material" for material in mesh.materials)
    is_written = bool(library) and (folder / f"{library}.mtl").exists()
    library = library or name
    if not is_written:
        (folder / f"{library}.mtl").write_text(_mtl(mesh, folder, library, names), encoding="utf-8", newline="\n")
    path = folder / f"{name}.obj"
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(f"# Z up, front -Y, metres\nmtllib {library}.mtl\n")
        file.writelines(_obj_runs(mesh, names))
    return path


def _obj_runs(mesh: Mesh, names: list[str]) -> Iterable[str]:
    parts = _plain_names(mesh.parts)
    colors = None if mesh.colors is None else encoded(mesh.colors[:, :3].astype(np.float64)).astype(np.float32)
    positions = _spelt(mesh.vertices if colors is None else np.column_stack([mesh.vertices, colors]))
    normals = _spelt(mesh.normals)
    spelt: dict[Texture | None, NDArray[np.object_]] = {}
    vertex, part = 1, -1
    for run in runs(mesh):
        if run.part != part:
            part = run.part
            yield f"g {parts[part]}\n"
        yield f"usemtl {names[run.material]}\n"
        yield _lines("v", positions[run.vertices])
        texture = mesh.materials[run.material].base_color_texture
        if texture not in spelt:
            spelt[texture] = _spelt(_coordinates(mesh, texture))
        yield _lines("vt", spelt[texture][run.vertices])
        yield _lines("vn", normals[run.vertices])
        corners = np.repeat(run.triangles + vertex, 3, axis=1)
        yield "f %d/%d/%d %d/%d/%d %d/%d/%d\n" * len(corners) % tuple(corners.ravel().tolist())
        vertex += len(run.vertices)


def _spelt(rows: NDArray[np.float32]) -> NDArray[np.object_]:
    """The shortest digits that give the same float32. A repeated number is formatted once."""
    bits, which = np.unique(np.ascontiguousarray(rows).view(np.uint32), return_inverse=True)
    return np.array(bits.view(np.float32).astype("U24").tolist(), object)[which.reshape(rows.shape)]


def _lines(keyword: str, rows: NDArray[np.object_]) -> str:
    """Text with one line per row."""
    return f"{keyword}{' %s' * rows.shape[1]}\n" * len(rows) % tuple(rows.ravel().tolist())


def _coordinates(mesh: Mesh, texture: Texture | None) -> NDArray[np.float32]:
    """OBJ's texture coordinates (v upwards) for a base colour's texture; zeros when the mesh has none."""
    texture = texture or Texture(0)
    uv = mesh.uv1 if texture.texcoord == 1 else mesh.uv0
    if uv is None:
        return np.zeros((len(mesh.vertices), 2), np.float32)
    u, v = (uv.astype(np.float64) * texture.scale).T
    sine, cosine = math.sin(texture.rotation), math.cos(texture.rotation)
    x = cosine * u + sine * v + texture.offset[0]
    y = cosine * v - sine * u + texture.offset[1]
    return np.column_stack([x, 1.0 - y]).astype(np.float32)


def _plain_names(names: Iterable[str]) -> list[str]:
    """Names without blanks and control characters, all different."""
    taken: dict[str, int] = {}
    plain: list[str] = []
    for name in names:
        base = re.sub(r"[\s\x00-\x1f\\#]+", "_", name).strip("_") or "part"
        unique = base
        while unique in taken:
            taken[base] += 1
            unique = f"{base}_{taken[base]}"
        taken[unique] = 1
        plain.append(unique)
    return plain


def _mtl(mesh: Mesh, folder: Path, name: str, names: list[str]) -> str:
    blocks: list[str] = []
    written: set[str] = set()
    for material, plain in zip(mesh.materials, names, strict=True):
        lines = [
            f"newmtl {plain}",
            f"Kd {_numbers(material.base_color[:3])}",
            f"d {_numbers(material.base_color[3:] if material.alpha_mode == 'BLEND' else (1.0,))}",
            f"Pr {_numbers((material.roughness,))}",
            f"Pm {_numbers((material.metallic,))}",
            f"Ke {_numbers(material.emissive)}",
            f"Pc {_numbers((material.clearcoat,))}",
            f"Pcr {_numbers((material.clearcoat_roughness,))}",
        ]
        lines += _maps(mesh, material, folder, name, written)
        blocks.append("\n".join(lines) + "\n")
    return "\n".join(blocks)


def _maps(mesh: Mesh, material: Material, folder: Path, name: str, written: set[str]) -> list[str]:
    """The material's map_ statements; their images are written beside the file."""
    rgba, rgb = ([0, 1, 2, 3], "rgba"), ([0, 1, 2], "rgb")
    color = rgb if material.alpha_mode == "OPAQUE" else rgba
    wanted = (
        ("map_Kd", material.base_color_texture, *color),
        ("map_Pr", material.metallic_roughness_texture, 1, "roughness"),
        ("map_Pm", material.metallic_roughness_texture, 2, "metallic"),
        ("map_Ke", material.emissive_texture, *rgb),
        ("norm", material.normal_texture, *rgb),
    )
    lines: list[str] = []
    for keyword, texture, channels, kind in wanted:
        if texture is None:
            continue
        file = f"{name}_{texture.image}_{kind}.png"
        image = mesh.images[texture.image]
        if file not in written:
            (folder / file).write_bytes(encode_png(image.pixels[..., channels]))
            written.add(file)
        clamp = "-clamp on " if texture.wrap_s == "clamp" else ""
        strength = f"-bm {_numbers((material.normal_scale,))} " if keyword == "norm" else ""
        lines.append(f"{keyword} {clamp}{strength}{file}")
    return lines


def _numbers(values: Iterable[float]) -> str:
    return " ".join(repr(float(value)) for value in values)
