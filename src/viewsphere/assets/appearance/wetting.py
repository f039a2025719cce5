"""Wet materials: water in the pores darkens a surface, and a water film reflects (Lekner and Dorf 1988; Lagarde 2013)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.assets.metadata.stuff import stuff_of
from viewsphere.model.annotations.classes import STUFF_IDS

UPRIGHT = 0.35
"""The wetness of walls as a share of the wetness of surfaces that face up."""

UP = 0.5
"""z of a normal from which a surface faces up."""

DARKEST = 0.42
"""Share of its colour that a soaked porous surface keeps."""

SMOOTH = 0.12
"""Roughness of a film of water."""

FILM = 0.5
"""Share of a soaked rough surface that a film covers."""

LEAVES = 0.6
"""The wetness of plants as a share of the wetness of surfaces that face up."""

GREEN = {STUFF_IDS["grass"], STUFF_IDS["vegetation"]}
"""Classes of plants."""


def wetted(mesh: Mesh, amount: float, category: str = "", evenly: bool = False) -> Mesh:
    """The mesh with wet materials: surfaces that face up in its own axes by `amount`, the others less, plants without a film.
    `evenly` treats all surfaces like the others, for meshes that deform. `category` gives the classes of scenery, see
    `model.annotations.classes`.
    """
    if evenly:
        return replace(mesh, materials=tuple(wet(material, amount * UPRIGHT) for material in mesh.materials))
    corners = mesh.vertices[mesh.triangles].astype(np.float64)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    smooth = mesh.normals[mesh.triangles].sum(axis=1)
    side = np.where((normal * smooth).sum(axis=1) < 0, -1.0, 1.0)  # the mean z of the shading normals
    kind = (side * normal[:, 2] > UP * np.linalg.norm(normal, axis=1)).astype(np.int64)
    green = np.array([stuff in GREEN for stuff in stuff_of(category, mesh.parts)])
    kind[green[mesh.triangle_part]] = 2
    made = (
        wet(m, share * amount, film) for share, film in ((UPRIGHT, FILM), (1.0, FILM), (LEAVES, 0.0)) for m in mesh.materials
    )
    material = mesh.triangle_material + kind * len(mesh.materials)
    return replace(mesh, materials=tuple(made), triangle_material=material.astype(mesh.triangle_material.dtype))


def wet(material: Material, amount: float, film: float = FILM) -> Material:
    """A material with this wetness, 0 to 1, and this share of a water film on it."""
    pores = darkened(material.roughness, material.metallic, amount)
    red, green, blue, alpha = material.base_color
    rough = material.clearcoat_roughness if material.clearcoat > 0 else 1.0
    return replace(
        material,
        base_color=(red * pores, green * pores, blue * pores, alpha),
        roughness=material.roughness * (1 - 0.3 * amount),
        clearcoat=max(material.clearcoat, film * amount),
        clearcoat_roughness=min(rough, SMOOTH) if film * amount > 0 else rough,
    )


def darkened(roughness: float, metallic: float, amount: float) -> float:
    """Share of its colour that a wet surface keeps: rough surfaces are porous, metals and lacquers are not."""
    porosity = min(max((roughness - 0.5) / 0.4, 0.0), 1.0) * (1 - metallic)
    return 1 + (DARKEST - 1) * porosity * amount
