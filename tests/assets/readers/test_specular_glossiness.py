"""Specular-glossiness textures: each texel becomes what the extension's own mathematics makes of it, redone here in Python."""

import io
import math

import numpy as np
import pytest
from PIL import Image

from viewsphere.assets.load import load_model

EXTENSION = "KHR_materials_pbrSpecularGlossiness"


def png(pixels):
    file = io.BytesIO()
    Image.fromarray(np.asarray(pixels, np.uint8)).save(file, "PNG")
    return file.getvalue()


def light(byte):
    value = byte / 255
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


def srgb(value):
    return 255 * (value * 12.92 if value <= 0.0031308 else 1.055 * value ** (1 / 2.4) - 0.055)


def reference(diffuse, specular):
    """Base colour and metallic factor of one texel, as the extension's example code has them."""

    def brightness(color):
        return math.sqrt(0.299 * color[0] ** 2 + 0.587 * color[1] ** 2 + 0.114 * color[2] ** 2)

    d, s, strength = brightness(diffuse), brightness(specular), 1 - max(specular)
    metallic = 0.0
    if s >= 0.04:
        b = d * strength / 0.96 + s - 0.08
        metallic = min(max((-b + math.sqrt(max(b * b - 4 * 0.04 * (0.04 - s), 0))) / 0.08, 0), 1)
    base = []
    for one, other in zip(diffuse, specular, strict=True):
        from_diffuse = one * strength / 0.96 / max(1 - metallic, 1e-6)
        from_specular = (other - 0.04 * (1 - metallic)) / max(metallic, 1e-6)
        base.append(min(max(from_diffuse + (from_specular - from_diffuse) * metallic**2, 0), 1))
    return base, metallic


def read(gltf, cube, fields, pictures):
    gltf.root["images"] = [{"bufferView": gltf.view(png(p)), "mimeType": "image/png"} for p in pictures]
    gltf.root["textures"] = [{"source": i} for i in range(len(pictures))]
    gltf.root["materials"] = [{"name": "gold", "extensions": {EXTENSION: fields}}]
    uv = cube[0][:, :2].copy()
    gltf.node(mesh=gltf.mesh(*cube, material=0, TEXCOORD_0=uv, TEXCOORD_1=uv))
    mesh = load_model(gltf.write())[0]
    return mesh, mesh.materials[0]


def pictures_of(mesh, material):
    return [mesh.images[texture.image].pixels for texture in (material.base_color_texture, material.metallic_roughness_texture)]


def test_every_texel_is_converted(gltf, cube):
    rng = np.random.default_rng(4)
    diffuse, specular = rng.integers(0, 256, (2, 6, 5, 4))
    specular[:3] //= 8  # as dark as what is no metal
    fields = {
        "diffuseFactor": [0.9, 0.8, 1, 0.5], "specularFactor": [1, 0.7, 0.6], "glossinessFactor": 0.75,
        "diffuseTexture": {"index": 0}, "specularGlossinessTexture": {"index": 1},
    }  # fmt: skip
    mesh, material = read(gltf, cube, fields, [diffuse, specular])
    base, rough_metal = pictures_of(mesh, material)
    assert (material.base_color, material.metallic, material.roughness) == ((1, 1, 1, 0.5), 1, 1)
    for at in np.ndindex(6, 5):
        of_diffuse = [light(byte) * factor for byte, factor in zip(diffuse[at][:3], (0.9, 0.8, 1), strict=True)]
        of_specular = [light(byte) * factor for byte, factor in zip(specular[at][:3], (1, 0.7, 0.6), strict=True)]
        color, metallic = reference(of_diffuse, of_specular)
        np.testing.assert_allclose(base[at][:3], [srgb(value) for value in color], atol=0.6)
        assert base[at][3] == diffuse[at][3]
        np.testing.assert_allclose(rough_metal[at][1:3], [255 * (1 - 0.75 * specular[at][3] / 255), 255 * metallic], atol=0.51)


def test_a_specular_texture_alone_makes_both(gltf, cube):
    specular = np.zeros((2, 2, 4), np.uint8)
    specular[:] = (255, 231, 149, 64)
    mesh, material = read(gltf, cube, {"diffuseFactor": [0, 0, 0, 1], "specularGlossinessTexture": {"index": 0}}, [specular])
    base, rough_metal = pictures_of(mesh, material)
    np.testing.assert_allclose(base[0, 0], [255, 231, 149, 255], atol=2)
    np.testing.assert_array_equal(rough_metal[0, 0][1:3], [191, 255])


def test_a_small_texture_is_spread_over_the_large_one(gltf, cube):
    diffuse = np.full((4, 4, 4), 255)
    specular = np.zeros((2, 2, 4))
    specular[0, 0] = (255, 255, 255, 255)
    fields = {"diffuseTexture": {"index": 0}, "specularGlossinessTexture": {"index": 1}}
    mesh, material = read(gltf, cube, fields, [diffuse, specular])
    _, rough_metal = pictures_of(mesh, material)
    metallic = np.zeros((4, 4))
    metallic[:2, :2] = 255
    np.testing.assert_array_equal(rough_metal[..., 2], metallic)


def test_a_plain_dielectric_keeps_its_diffuse_texture(gltf, cube):
    diffuse = np.random.default_rng(2).integers(0, 256, (4, 4, 4))
    fields = {"diffuseTexture": {"index": 0}, "specularFactor": [0.02, 0.02, 0.02], "glossinessFactor": 0.25}
    mesh, material = read(gltf, cube, fields, [diffuse])
    np.testing.assert_array_equal(mesh.images[material.base_color_texture.image].pixels, diffuse)
    np.testing.assert_allclose(material.base_color, (0.98 / 0.96 * np.ones(4)).clip(0, 1))
    assert (material.metallic, material.roughness, material.metallic_roughness_texture) == (0, 0.75, None)


def test_textures_on_other_coordinates_count_by_their_mean(gltf, cube):
    specular = np.full((2, 2, 4), 255)
    diffuse = np.zeros((2, 2, 4))
    fields = {"diffuseTexture": {"index": 0}, "specularGlossinessTexture": {"index": 1, "texCoord": 1}}
    mesh, material = read(gltf, cube, fields, [diffuse, specular])
    assert "gold" in mesh.warnings[0]
    assert "different coordinates" in mesh.warnings[0]
    base, rough_metal = pictures_of(mesh, material)
    assert base[0, 0, :3] == pytest.approx(255)
    assert tuple(rough_metal[0, 0, 1:3]) == (0, 255)
