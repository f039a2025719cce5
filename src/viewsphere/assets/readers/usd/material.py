"""UsdPreviewSurface materials: constants, textures with their transforms, scale and bias.

https://openusd.org/release/spec_usdpreviewsurface.html
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from viewsphere.assets.mesh import HIGHEST_IOR, Material, Texture
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.readers.gltf.specular_glossiness import SpecularGlossiness, as_metallic_roughness
from viewsphere.assets.readers.usd.library import UsdShade
from viewsphere.assets.readers.usd.texture import Baker, Sampled, network_texture, producer

SURFACES = ("UsdPreviewSurface", "ND_UsdPreviewSurface_surfaceshader")
ROUGHNESS, IOR = 0.5, 1.5  # UsdPreviewSurface's own defaults
GREY = 0.18  # and that of diffuseColor


@dataclass(frozen=True)
class _Look:
    """A material, the primvars that its textures read in order of `texcoord`, and the primvar of its vertex colours."""

    material: Material
    uvs: tuple[str, ...] = ()
    color: str | None = None


UNBOUND = _Look(Material(name="default"), ("st",), "displayColor")
"""The material for prims without one: white, multiplied by their display colours."""


@dataclass(eq=False)
class UsdMaterials:
    """The looks of a stage's materials, each read once."""

    folder: ModelFolder
    time: Any
    _looks: dict[str, _Look] = field(default_factory=dict[str, _Look])

    def look(self, prim: Any) -> _Look:
        """The look of the material that is bound to a prim."""
        binding = UsdShade.MaterialBindingAPI(prim)
        for purpose in (UsdShade.Tokens.allPurpose, UsdShade.Tokens.preview, UsdShade.Tokens.full):
            material, _ = binding.ComputeBoundMaterial(purpose)
            if material:
                path = str(material.GetPath())
                if path not in self._looks:
                    self._looks[path] = self._read(material)
                return self._looks[path]
        return UNBOUND

    def _read(self, material: Any) -> _Look:
        name = str(material.GetPrim().GetName())
        for context in ("", "mtlx", "glslfx"):
            surface, _, _ = material.ComputeSurfaceSource(context)
            if surface and surface.GetIdAttr().Get() in SURFACES:
                return _Surface(self.folder, surface, self.time, name).look()
        self.folder.warn(f"material {name!r} has no UsdPreviewSurface; the prims' display colours take its place")
        return _Look(Material(name=name), (), "displayColor")


@dataclass(eq=False)
class _Surface:
    """One UsdPreviewSurface shader."""

    folder: ModelFolder
    shader: Any
    time: Any
    name: str

    def number(self, name: str, default: float) -> float:
        """A constant input."""
        found = self._constant(name)
        return default if found is None else float(found)

    def color(self, name: str, default: tuple[float, float, float]) -> tuple[float, float, float]:
        """A constant input of a colour."""
        found = self._constant(name)
        return default if found is None else (float(found[0]), float(found[1]), float(found[2]))

    def _constant(self, name: str) -> Any:
        source = producer(self.shader.GetInput(name))
        return None if source is None or source.is_output else source.value(self.time)

    def texture(self, name: str) -> Sampled | None:
        """The texture that an input reads, None for constants and for textures that cannot be used, with a warning."""
        return network_texture(self.folder, producer(self.shader.GetInput(name)), self.time, f"material {self.name!r}: {name}")

    def _vertex_color(self) -> str | None:
        """The primvar that gives the diffuse colour."""
        source = producer(self.shader.GetInput("diffuseColor"))
        return None if source is None else source.primvar(self.time, ("UsdPrimvarReader_float3", "UsdPrimvarReader_float4"))

    def look(self) -> _Look:
        names = "diffuseColor", "opacity", "metallic", "roughness", "normal", "occlusion", "emissiveColor"
        sampled = {name: self.texture(name) for name in names}
        uvs = _primvars(list(sampled.values()))
        for name, texture in sampled.items():
            if texture is not None and texture.primvar not in uvs:
                self.folder.warn(f"material {self.name!r}: {name} reads a third set of texture coordinates; it is left out")
                sampled[name] = None
        baker = Baker(self.folder, uvs)
        color = self._vertex_color()
        material = self._material(sampled, baker, is_painted=color is not None)
        return _Look(material, uvs, color)

    def _material(self, sampled: dict[str, Sampled | None], baker: Baker, *, is_painted: bool) -> Material:
        diffuse, opacity = sampled["diffuseColor"], sampled["opacity"]
        grey = (1.0, 1.0, 1.0) if is_painted or diffuse is not None else (GREY, GREY, GREY)
        base = self.color("diffuseColor", grey)
        base, base_texture = baker.base(diffuse, opacity, base)
        alpha, mode, cutoff = self._alpha(base_texture if opacity is not None else None)
        metallic, roughness = self.number("metallic", 0.0), self.number("roughness", ROUGHNESS)
        packed = baker.metallic_roughness(sampled["metallic"], sampled["roughness"], metallic, roughness)
        emissive, emissive_texture = baker.colors(sampled["emissiveColor"], self.color("emissiveColor", (0.0, 0.0, 0.0)))
        material = Material(
            name=self.name,
            base_color=(*base, alpha),
            base_color_texture=base_texture,
            metallic=metallic if packed is None else 1.0,
            roughness=roughness if packed is None else 1.0,
            metallic_roughness_texture=packed,
            normal_texture=baker.normals(sampled["normal"]),
            occlusion_texture=baker.red(sampled["occlusion"]),
            emissive=emissive,
            emissive_texture=emissive_texture,
            alpha_mode=mode,
            alpha_cutoff=cutoff,
            clearcoat=self.number("clearcoat", 0.0),
            clearcoat_roughness=self.number("clearcoatRoughness", 0.01),
            ior=min(max(self.number("ior", IOR), 1.0), HIGHEST_IOR),
        )
        return self._specular(material, packed)

    def _alpha(self, texture: Texture | None) -> tuple[float, Literal["OPAQUE", "MASK", "BLEND"], float]:
        """Opacity, alpha mode and cutoff."""
        threshold = self.number("opacityThreshold", 0.0)
        opacity = min(max(self.number("opacity", 1.0), 0.0), 1.0) if texture is None else 1.0
        if threshold > 0:
            return opacity, "MASK", threshold
        is_clear = opacity < 1 or (texture is not None and self.folder.images[texture.image].pixels[..., 3].min() < 255)
        return opacity, "BLEND" if is_clear else "OPAQUE", 0.5

    def _specular(self, material: Material, packed: Texture | None) -> Material:
        """The material; in the specular workflow, converted by its specular colour."""
        if not self.number("useSpecularWorkflow", 0):
            return material
        if packed is not None or self.texture("specularColor") is not None:
            self.folder.warn(f"material {self.name!r}: textures of the specular workflow are left out; it is no metal")
            return material
        look = SpecularGlossiness(
            diffuse=material.base_color[:3],
            alpha=material.base_color[3],
            diffuse_texture=material.base_color_texture,
            specular=self.color("specularColor", (0.0, 0.0, 0.0)),
            glossiness=1.0 - material.roughness,
            texture=None,
        )
        return as_metallic_roughness(self.folder, material, look)


def _primvars(sampled: Sequence[Sampled | None]) -> tuple[str, ...]:
    """The first two primvars that textures read, in order."""
    return tuple(dict.fromkeys(texture.primvar for texture in sampled if texture is not None))[:2]
