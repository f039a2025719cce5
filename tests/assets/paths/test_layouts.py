"""Public data sets as they are downloaded: their folders load with their textures, and no warning."""

import io

import numpy as np
import pytest
from PIL import Image

from viewsphere.assets.load import load_model

CARD = "mtllib {library}\nv -1 0 0\nv 1 0 0\nv 1 2 0\nv -1 2 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3 4/4\n"
PLY = (
    "ply\nformat ascii 1.0\ncomment TextureFile {picture}\n"
    "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "property float texture_u\nproperty float texture_v\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "-1 0 0 0 0\n1 0 0 1 0\n1 2 0 1 1\n-1 2 0 0 1\n4 0 1 2 3\n"
)
# The model's file, the picture's, and the name by which the library means it.
SHAPENET = "02691156/1a2b/models/model_normalized.obj"
LAYOUTS = {
    "ShapeNetCore v2": (
        "02691156/1a2b/models/model_normalized.obj",
        "02691156/1a2b/images/texture0.jpg",
        "../images/texture0.jpg",
    ),
    "ShapeNet's slips": (SHAPENET, "02691156/1a2b/images/texture0.JPG", "./texture0.jpg"),
    "PartNet-Mobility": ("35059/textured_objs/original-1.obj", "35059/images/texture_0.jpg", "../images/texture_0.jpg"),
    "Google Scanned Objects": ("Shoe/meshes/model.obj", "Shoe/materials/textures/texture.png", "texture.png"),
    "YCB": ("002_can/google_16k/textured.obj", "002_can/google_16k/texture_map.png", "texture_map.png"),
    "YCB, Berkeley": ("002_can/tsdf/textured.obj", "002_can/tsdf/textured.png", "textured.png"),
    "BOP": ("models/obj_000001.ply", "models/obj_000001.png", "obj_000001.png"),
    "ABO, Objaverse": ("b/model.obj", "b/textures/base color.png", "textures/base%20color.png"),
}


@pytest.fixture
def picture():
    pixels = np.zeros((8, 8, 3), np.uint8)
    pixels[:, :4], pixels[:, 4:] = (220, 30, 30), (30, 200, 90)
    return Image.fromarray(pixels)


def built(write, model, place, reference, picture):
    file = io.BytesIO()
    picture.save(file, "PNG")  # readers look at the bytes, not at the suffix
    write(place, file.getvalue())
    library = model.rsplit("/", 1)[1].rsplit(".", 1)[0] + ".mtl"
    write(model.rsplit("/", 1)[0] + "/" + library, f"newmtl m\nKd 1 1 1\nmap_Kd {reference}\n")
    return write(model, PLY.format(picture=reference) if model.endswith(".ply") else CARD.format(library=library))


@pytest.mark.parametrize("name", LAYOUTS)
def test_a_layout_loads_with_its_texture(write, picture, name):
    mesh, facts = load_model(built(write, *LAYOUTS[name], picture))
    texture = mesh.materials[0].base_color_texture
    np.testing.assert_array_equal(mesh.images[texture.image].pixels[..., :3], np.asarray(picture))
    assert (len(mesh.triangles), mesh.warnings) == (2, ())
    assert any(file.name.lower() == LAYOUTS[name][1].rsplit("/", 1)[1].lower() for file in facts.files)


@pytest.mark.parametrize("place", ["02691156/1a2b/private/texture0.jpg", "02691156/images/texture0.jpg", "images/texture0.jpg"])
def test_a_picture_elsewhere_is_not_read(write, picture, place):
    """Neither of a folder that no layout has, nor of one above the asset."""
    model, _, reference = LAYOUTS["ShapeNetCore v2"]
    mesh, _ = load_model(built(write, model, place, reference, picture))
    assert mesh.materials[0].base_color_texture is None
    assert "texture '../images/texture0.jpg' does not exist" in mesh.warnings[0]
    assert "nearest" not in mesh.warnings[0]
