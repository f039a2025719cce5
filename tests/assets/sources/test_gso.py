"""Google Scanned Objects."""

from __future__ import annotations

import pytest
from PIL import Image

from asset_trees import faces_front, planned, pointer, put
from viewsphere.assets.cache import load

METADATA = 'name: "Red_Shoe"\nversion: 1\nannotations {{\n  key: "brand"\n  value: "a"\n}}\n{}'


@pytest.mark.parametrize(
    ("metadata", "category"),
    [
        ('categories {\n  first: "Shoe"\n}\n', "shoe"),
        ("", "Red Shoe"),
        ('categories {\n  first: "\x1b[2J"\n}\n', "Red Shoe"),
    ],
)
def test_a_scan_has_its_category_axes_and_licence(tmp_path, metadata, category):
    put(tmp_path / "Red_Shoe" / "meshes" / "model.obj", pointer("+z", "-y", 0.2))
    put(tmp_path / "Red_Shoe" / "metadata.pbtxt", METADATA.format(metadata))
    (tmp_path / "thumbnails").mkdir()
    plan = planned(f"gso:{tmp_path}")
    (spec,) = plan.model_specs
    assert (spec.key, spec.category, spec.real_size) == ("Red_Shoe", category, "file")
    assert faces_front(spec, 0.2)
    assert plan.credits["Red_Shoe"].licence == "CC-BY-4.0"


def test_a_scan_has_the_texture_that_lies_beside_its_mesh(tmp_path):
    text = pointer("+z", "-y").replace("f 9 10 11", "vt 0 0\nvt 1 0\nvt 0 1\nusemtl material_0\nf 9/1 10/2 11/3")
    put(tmp_path / "Red_Shoe" / "meshes" / "model.obj", f"mtllib model.mtl\n{text}")
    put(tmp_path / "Red_Shoe" / "meshes" / "model.mtl", "newmtl material_0\nmap_Kd texture.png\n")
    textures = tmp_path / "Red_Shoe" / "materials" / "textures"
    textures.mkdir(parents=True)
    Image.new("RGB", (2, 2), "red").save(textures / "texture.png")
    mesh, _ = load(planned(f"gso:{tmp_path}").model_specs[0])
    assert [image.pixels[0, 0].tolist() for image in mesh.images] == [[255, 0, 0, 255]]
