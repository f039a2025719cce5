"""A material as the row of numbers that the shading kernels read."""

from __future__ import annotations

from viewsphere.assets.mesh import Material
from viewsphere.engines.raster.materials import kernels_material as column
from viewsphere.model.thing import Repaint

ALWAYS, HALF, NEVER = 0.0, 0.5, 2.0
"""Alpha from which a surface casts a shadow."""

CLEAR = 0.5
"""Share of transmitted light above which a surface casts no shadow."""


def material_row(
    m: Material,
    repaint: Repaint | None = None,
    *,
    scenery: bool = False,
    ground: bool = False,
    catcher: bool = False,
    per_length: float = 0.0,
) -> list[float]:
    """The material's row of `Surfaces.looks`. Metallic and roughness of `repaint` replace the factor and its texture.

    per_length: texture coordinates per unit of length, for the ground. Reflectances at normal incidence are those of
    KHR_materials_ior and KHR_materials_specular, before the factor `specular` and the limit of 1 are applied.
    """
    rough, rough_texel = _replaced(m.roughness, repaint.roughness if repaint else None)
    metal, metal_texel = _replaced(m.metallic, repaint.metallic if repaint else None)
    reflectance = ((m.ior - 1) / (m.ior + 1)) ** 2 if m.ior > 0 else 1.0  # an ior of 0 means total reflection
    row = [0.0] * column.LOOKS
    row[column.L_RED : column.L_ALPHA + 1] = [max(c, 0.0) for c in m.base_color]
    row[column.L_ROUGH], row[column.L_ROUGH_TEXEL] = rough, rough_texel
    row[column.L_METAL], row[column.L_METAL_TEXEL] = metal, metal_texel
    row[column.L_ER : column.L_EB + 1] = [max(e, 0.0) for e in m.emissive]
    row[column.L_F0R : column.L_F0B + 1] = [reflectance * max(c, 0.0) for c in m.specular_color]
    row[column.L_SPECULAR] = m.specular
    row[column.L_COAT], row[column.L_COAT_ROUGH] = m.clearcoat, m.clearcoat_roughness
    row[column.L_TRANSMISSION] = m.transmission
    row[column.L_BENDS] = max(m.ior, 1.0) if m.thickness > 0 and m.transmission > 0 else 0.0
    row[column.L_NORMAL], row[column.L_OCCLUSION] = m.normal_scale, m.occlusion_strength
    row[column.L_UNLIT], row[column.L_GROUND], row[column.L_CATCHER] = float(m.unlit), float(ground), float(catcher)
    row[column.L_BLENDED] = float(m.alpha_mode == "BLEND")
    row[column.L_PER_LENGTH], row[column.L_SCENERY] = per_length, float(scenery)
    casts = {"OPAQUE": ALWAYS, "MASK": m.alpha_cutoff, "BLEND": HALF}[m.alpha_mode]
    row[column.L_CASTS_FROM] = NEVER if ground or m.transmission * (1 - m.metallic) > CLEAR else casts
    return row


def _replaced(factor: float, other: float | None) -> tuple[float, float]:
    """The value that replaces a factor and its texture, and the factor that multiplies the texture."""
    return (0.0, factor) if other is None else (other, 0.0)
