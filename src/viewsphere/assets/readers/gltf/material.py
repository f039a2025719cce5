"""Materials of a glTF file, with the extensions that Material supports."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any, Literal
from urllib.parse import unquote

from viewsphere.assets.mesh import HIGHEST_IOR, Material, Texture, Wrap
from viewsphere.assets.readers.gltf.document import BASISU, Document, is_readable, lacking
from viewsphere.assets.readers.gltf.field import Field
from viewsphere.assets.readers.gltf.specular_glossiness import SpecularGlossiness, as_metallic_roughness

WRAPS: dict[int, Wrap] = {33071: "clamp", 33648: "mirror", 10497: "repeat"}
NEAREST = 9728
IMAGE_EXTENSIONS = ("EXT_texture_webp", "MSFT_texture_dds")
"""Extensions of textures that name an image of a kind that Pillow decodes."""


def read_materials(document: Document, used: Collection[int]) -> list[Material]:
    """Return the materials in file order (unused ones plain except for their sidedness), then the default for primitives
    without one.

    Primitives without material are plain white plastic rather than the specification's mirror-like metal, and single-sided as
    in the specification.
    """
    reader = _Reader(document)
    entries = document.root.items("materials")
    read = [
        reader.material(entry) if i in used else Material(double_sided=entry.boolean("doubleSided"))
        for i, entry in enumerate(entries)
    ]
    return [*read, Material(name="default", double_sided=False)]


@dataclass(frozen=True)
class _Reader:
    document: Document

    def material(self, entry: Field) -> Material:
        pbr = entry.get("pbrMetallicRoughness")
        modes: dict[str, Literal["OPAQUE", "MASK", "BLEND"]] = {
            "OPAQUE": "OPAQUE",
            "MASK": "MASK",
            "BLEND": "BLEND",
        }
        mode = entry.text("alphaMode", "OPAQUE")
        if mode not in modes:
            raise entry.fail("alphaMode OPAQUE, MASK or BLEND")
        color = pbr.numbers("baseColorFactor", 4, (1.0, 1.0, 1.0, 1.0))
        emissive = entry.numbers("emissiveFactor", 3, (0.0, 0.0, 0.0))
        strength = entry.extension("KHR_materials_emissive_strength")
        glow = 1.0 if strength is None else strength.number("emissiveStrength", 1.0)
        normal, occlusion = entry.get("normalTexture"), entry.get("occlusionTexture")
        material = Material(
            name=entry.text("name"),
            base_color=(color[0], color[1], color[2], color[3]),
            base_color_texture=self.texture(pbr, "baseColorTexture"),
            metallic=pbr.number("metallicFactor", 1.0),
            roughness=pbr.number("roughnessFactor", 1.0),
            metallic_roughness_texture=self.texture(pbr, "metallicRoughnessTexture"),
            normal_texture=self.texture(entry, "normalTexture"),
            normal_scale=normal.number("scale", 1.0),
            occlusion_texture=self.texture(entry, "occlusionTexture"),
            occlusion_strength=occlusion.number("strength", 1.0),
            emissive=(emissive[0] * glow, emissive[1] * glow, emissive[2] * glow),
            emissive_texture=self.texture(entry, "emissiveTexture"),
            alpha_mode=modes[mode],
            alpha_cutoff=entry.number("alphaCutoff", 0.5),
            double_sided=entry.boolean("doubleSided"),
            unlit=entry.extension("KHR_materials_unlit") is not None,
        )
        return self._specular_glossiness(entry, replace(material, **self._extensions(entry)))

    def _extensions(self, entry: Field) -> dict[str, Any]:
        found: dict[str, Any] = {}
        coat = entry.extension("KHR_materials_clearcoat")
        if coat is not None:
            found["clearcoat"] = coat.number("clearcoatFactor", 0.0)
            found["clearcoat_texture"] = self.texture(coat, "clearcoatTexture")
            found["clearcoat_roughness"] = coat.number("clearcoatRoughnessFactor", 0.0)
            found["clearcoat_roughness_texture"] = self.texture(coat, "clearcoatRoughnessTexture")
            found["clearcoat_normal_texture"] = self.texture(coat, "clearcoatNormalTexture")
        glass = entry.extension("KHR_materials_transmission")
        if glass is not None:
            found["transmission"] = glass.number("transmissionFactor", 0.0)
            found["transmission_texture"] = self.texture(glass, "transmissionTexture")
        volume = entry.extension("KHR_materials_volume")
        if volume is not None:
            found["thickness"] = volume.number("thicknessFactor", 0.0)
        refraction = entry.extension("KHR_materials_ior")
        if refraction is not None:
            found["ior"] = min(refraction.number("ior", 1.5), HIGHEST_IOR)
        specular = entry.extension("KHR_materials_specular")
        if specular is not None:
            found["specular"] = specular.number("specularFactor", 1.0)
            found["specular_texture"] = self.texture(specular, "specularTexture")
            found["specular_color"] = specular.numbers("specularColorFactor", 3, (1.0, 1.0, 1.0))
            found["specular_color_texture"] = self.texture(specular, "specularColorTexture")
        return found

    def _specular_glossiness(self, entry: Field, material: Material) -> Material:
        """The material, or its replacement by KHR_materials_pbrSpecularGlossiness."""
        old = entry.extension("KHR_materials_pbrSpecularGlossiness")
        if old is None:
            return material
        red, green, blue, alpha = old.numbers("diffuseFactor", 4, (1.0, 1.0, 1.0, 1.0))
        look = SpecularGlossiness(
            diffuse=(red, green, blue),
            alpha=alpha,
            diffuse_texture=self.texture(old, "diffuseTexture"),
            specular=old.numbers("specularFactor", 3, (1.0, 1.0, 1.0)),
            glossiness=old.number("glossinessFactor", 1.0),
            texture=self.texture(old, "specularGlossinessTexture"),
        )
        return as_metallic_roughness(self.document.folder, material, look)

    def texture(self, parent: Field, key: str) -> Texture | None:
        """The textureInfo under `key`; None if there is none or its image cannot be used."""
        if key not in parent:
            return None
        info = parent.get(key)
        entry = self.document.root.item("textures", info.integer("index"))
        image = self._image(entry)
        transform = info.extension("KHR_texture_transform") or Field({}, info.where)
        texcoord = transform.integer("texCoord", info.integer("texCoord", 0))
        if image is None or texcoord > 1:
            if image is not None:
                self.document.folder.warn(f"{key} uses TEXCOORD_{texcoord}, only 0 and 1 are read; its factor is used")
            return None
        sampler = self.document.root.item("samplers", entry.integer("sampler")) if "sampler" in entry else Field({}, "")
        offset = transform.numbers("offset", 2, (0.0, 0.0))
        scale = transform.numbers("scale", 2, (1.0, 1.0))
        return Texture(
            image=image,
            texcoord=texcoord,
            wrap_s=WRAPS.get(sampler.integer("wrapS", 10497), "repeat"),
            wrap_t=WRAPS.get(sampler.integer("wrapT", 10497), "repeat"),
            nearest=sampler.integer("magFilter", 0) == NEAREST,
            offset=(offset[0], offset[1]),
            rotation=transform.number("rotation", 0.0),
            scale=(scale[0], scale[1]),
        )

    def _image(self, texture: Field) -> int | None:
        folder = self.document.folder
        index = self._source(texture)
        if index is None:
            other = ", ".join(texture.get("extensions").mapping()) or "no source"
            folder.warn(f"a texture with {other} is not read; the material's plain factor is used")
            return None
        entry = self.document.root.item("images", index)
        name = entry.text("name") or f"image{index}"
        if "bufferView" in entry:
            data, _ = self.document.view(entry.integer("bufferView"))
            return folder.image(f"#{index}", name, bytes(data))
        uri = entry.text("uri", "data:")
        if uri.startswith("data:"):
            return folder.image(uri, name)
        return folder.image(unquote(uri), entry.text("name") or unquote(uri))

    def _source(self, texture: Field) -> int | None:
        """Index of the texture's image; if there are several, the first that can be decoded here."""
        basisu = texture.extension(BASISU)
        if basisu is not None and is_readable(BASISU):
            return basisu.integer("source")
        for name in IMAGE_EXTENSIONS:
            extension = texture.extension(name)
            if extension is not None:
                return extension.integer("source")
        if "source" in texture:
            return texture.integer("source")
        if basisu is not None:
            raise lacking(self.document.folder, BASISU)
        return None
