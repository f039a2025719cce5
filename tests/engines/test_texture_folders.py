"""Pictures from a folder as the colour of chosen materials."""

import os

import numpy as np
import pytest
from PIL import Image

import viewsphere as vs
from viewsphere.assets.appearance.repaint import textured
from viewsphere.assets.mesh import Material, Mesh, Texture
from viewsphere.check import check
from viewsphere.errors import RecipeError
from viewsphere.model.thing import Repaint
from viewsphere.planning.plan import plan
from viewsphere.recipe.recipe import Recipe

COLORS = {"blue": (20, 20, 230), "green": (20, 230, 20), "red": (230, 20, 20)}


@pytest.fixture
def folder(tmp_path):
    """Three plain pictures, one of them in a folder of its own."""
    place = tmp_path / "paints"
    (place / "warm").mkdir(parents=True)
    for name, color in COLORS.items():
        Image.new("RGB", (8, 4), color).save(place / ("warm" if name == "red" else "") / f"{name}.png")
    return place


def recipe_of(folder, material=None, **changes):
    values = {
        "models": [{"source": "zoo:chair", "count": 4}],
        "viewpoints": {"azimuth": 30, "elevation": 20, "distance": {"fill": 0.8}},
        "camera": {"size": [64, 48], "fov_deg": 35},
        "scene": {"ground": "off", "materials": [{"images": str(folder), **(material or {})}]},
        "splits": {"train": 1.0},
        "channels": ["rgb", "instances", "depth"],
        "engine": {"name": "raster", "ambient_occlusion": "off"},
        "formats": [],
    }
    return Recipe(**{**values, **changes})


def hue(sample):
    """The name of the colour that a picture's model has."""
    mean = sample.rgb[sample.instances > 0].mean(axis=0)
    return ("red", "green", "blue")[int(mean.argmax())]


def painted(recipe):
    return [hue(sample) for sample in vs.render(recipe)]


@pytest.mark.slow
def test_each_model_takes_a_picture_of_the_folder_which_its_name_decides(folder):
    found = painted(recipe_of(folder))
    assert len(set(found)) > 1
    assert painted(recipe_of(folder)) == found
    fewer = recipe_of(folder, models=[{"source": "zoo:chair", "count": 3}])
    assert painted(fewer) == found[:3]
    assert len({tuple(painted(recipe_of(folder, seed=seed))) for seed in range(3)}) > 1


@pytest.mark.slow
def test_pictures_are_drawn_for_each_frame_where_materials_are(folder):
    views = {"azimuth": list(range(0, 360, 30)), "elevation": 20, "distance": {"fill": 0.8}}
    scene = {"ground": "off", "draw": "per_frame", "materials": [{"images": str(folder)}]}
    recipe = recipe_of(folder, models=[{"source": "zoo:chair"}], scene=scene, viewpoints=views)
    found = painted(recipe)
    assert set(found) == {"red", "green", "blue"}
    assert painted(recipe.model_copy(update={"shot_frames": 5})) == found


@pytest.mark.slow
def test_labels_do_not_know_of_pictures_and_check_proves_the_set(folder, tmp_path):
    plain = recipe_of(folder, scene={"ground": "off"}, formats=["coco"])
    painted_, bare = (list(vs.render(recipe)) for recipe in (recipe_of(folder), plain))
    for one, other in zip(painted_, bare, strict=True):
        assert np.array_equal(one.depth, other.depth)
        assert np.array_equal(one.instances, other.instances)
        assert not np.array_equal(one.rgb, other.rgb)
    vs.generate(recipe_of(folder, formats=["coco"]), tmp_path / "out", workers=0)
    dataset = vs.open(tmp_path / "out")
    assert [hue(sample) for sample in dataset] == [hue(sample) for sample in painted_]
    assert not check(dataset, sample=None).findings


@pytest.mark.slow
def test_only_chosen_materials_and_models_change_and_one_picture_may_be_named(folder):
    one = {"images": None, "image": str(folder / "green.png"), "models": "chair_00[0-2]"}
    found = painted(recipe_of(folder, one))
    assert found[:3] == ["green"] * 3
    assert "green" not in found[3:]
    nothing = recipe_of(folder, {"material": "no such material"})
    plain = recipe_of(folder, scene={"ground": "off"})
    assert all(np.array_equal(a.rgb, b.rgb) for a, b in zip(vs.render(nothing), vs.render(plain), strict=True))


BOX = """\
v 0 0 0\nv 0 0 1\nv 0 1 0\nv 0 1 1\nv 1 0 0\nv 1 0 1\nv 1 1 0\nv 1 1 1
f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4
"""


def seen_in_blocks(sample):
    """Mean colours (N, 3) of the blocks of 4 x 4 pixels that lie on the object."""
    height, width = sample.instances.shape
    colors = sample.rgb.reshape(height // 4, 4, width // 4, 4, 3).mean(axis=(1, 3))
    return colors[(sample.instances > 0).reshape(height // 4, 4, width // 4, 4).all(axis=(1, 3))]


@pytest.mark.parametrize(
    ("engine", "ready"),
    [
        ({"name": "cycles", "samples": 8, "denoise": "off"}, "blender"),
        # A box alone casts no shadow on itself, and on a processor shadows take EEVEE seconds a sample.
        pytest.param(
            {"name": "eevee", "quality": "draft", "settings": {"use_shadows": False}}, "drawing", marks=pytest.mark.slow
        ),
    ],
    ids=["cycles", "eevee"],
)
def test_blenders_engines_show_the_picture_where_raster_does(folder, tmp_path, request, engine, ready):
    """A picture of four colours, on a box: as bright within what EEVEE's sky differs by; another picture is off by 100."""
    request.getfixturevalue(ready)
    colors = np.array([[COLORS["red"], (230, 160, 20)], [COLORS["blue"], (20, 160, 230)]], np.uint8)
    Image.fromarray(colors.repeat(32, axis=0).repeat(32, axis=1)).save(folder / "four.png")
    (tmp_path / "box.obj").write_text(BOX)
    only = {"images": None, "image": str(folder / "four.png")}
    models = [{"source": str(tmp_path / "box.obj"), "category": "box"}]
    by_blender, by_raster = (
        seen_in_blocks(next(iter(vs.render(recipe_of(folder, only, models=models, engine=name)))))
        for name in (engine, {"name": "raster"})
    )
    assert len(by_raster) > 40
    assert by_raster.std(axis=0).min() > 20  # more than one colour is seen
    assert np.abs(by_blender - by_raster).mean() < 8
    assert np.abs(by_blender.mean(axis=0) - by_raster.mean(axis=0)).max() < 8


def test_a_picture_that_changes_on_disk_is_read_again(folder):
    """Between runs, and within one between two shots that share a stage."""
    named = {"images": None, "image": str(folder / "green.png")}
    views = {"azimuth": [30, 60, 90], "elevation": 20, "distance": {"fill": 0.8}}
    recipe = recipe_of(folder, named, models=[{"source": "zoo:chair"}], viewpoints=views, shot_frames=1)
    frames = vs.render(recipe)
    found = [hue(next(iter(vs.render(recipe)))), hue(next(iter(frames)))]
    Image.new("RGB", (8, 4), COLORS["red"]).save(folder / "green.png")
    found += [hue(next(iter(vs.render(recipe)))), hue(next(iter(frames)))]
    assert found == ["green", "green", "red", "red"]


def test_a_picture_of_another_size_or_time_is_another(folder):
    file, repaint = folder / "green.png", (Repaint(image=str(folder / "green.png")),)

    def shown():
        return textured(mesh_of(materials=(Material("a"), Material("b"))), repaint).images[0]

    first, changed = shown(), file.stat().st_mtime_ns
    assert shown() is first
    Image.new("RGB", (80, 40), COLORS["red"]).save(file)
    os.utime(file, ns=(changed, changed))
    assert tuple(shown().pixels[0, 0, :3]) == COLORS["red"]
    os.utime(file, ns=(1, 1))
    assert shown() is not first


def mesh_of(**more):
    card = np.array([[0, 0, 0], [2, 0, 0], [2, 0, 1], [0, 0, 1]], np.float32)
    return Mesh(
        vertices=card,
        triangles=np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        normals=np.tile(np.array([0, -1, 0], np.float32), (4, 1)),
        triangle_material=np.array([0, 1], np.int32),
        triangle_part=np.zeros(2, np.int32),
        **more,
    )


def test_a_mesh_without_texture_coordinates_gets_those_of_a_box(folder):
    made = textured(mesh_of(materials=(Material("a"), Material("b"))), (Repaint(image=str(folder / "green.png")),))
    assert made.uv0.tolist() == [[0, 1], [1, 1], [1, 0.5], [0, 0.5]]  # the longest side is the picture once
    assert [m.base_color_texture for m in made.materials] == [Texture(0), Texture(1)]
    assert (made.images[0].pixels == (*COLORS["green"], 255)).all()


def test_coordinates_stay_and_what_has_clear_texels_keeps_its_picture(folder):
    uv = np.linspace(0, 1, 8, dtype=np.float32).reshape(4, 2)
    mesh = mesh_of(materials=(Material("a", base_color=(0.5, 0, 0, 1)), Material("b", alpha_mode="MASK")), uv0=uv)
    made = textured(mesh, (Repaint(image=str(folder / "green.png")),))
    assert made.uv0 is mesh.uv0
    assert made.materials[0].base_color == (1, 1, 1, 1)
    assert made.materials[1] is mesh.materials[1]
    assert textured(mesh, (Repaint(tint=(1, 0, 0)),)) is mesh
    last = textured(mesh, (Repaint(image=str(folder / "green.png")), Repaint(roughness=0.5)))  # the last that matches counts
    assert last is mesh


def test_mistakes_name_their_field(folder, tmp_path):
    with pytest.raises(RecipeError, match=r"scene.materials\[0\].images: expected a folder .*nowhere does not exist"):
        plan(recipe_of(tmp_path / "nowhere"))
    with pytest.raises(RecipeError, match=r"scene.materials\[0\].images: expected a folder with images; .*green.png is none"):
        plan(recipe_of(folder / "green.png"))
    (tmp_path / "bare").mkdir()
    with pytest.raises(RecipeError, match=r"scene.materials\[0\].images: expected a folder with images .* found none in"):
        plan(recipe_of(tmp_path / "bare"))
    with pytest.raises(RecipeError, match=r"scene.materials\[0\].*expected image or images; found both"):
        recipe_of(folder, {"image": "a.png"})
    (folder / "broken.png").write_bytes(b"no picture")
    with pytest.raises(RecipeError, match=r"scene.materials\[0\].images: expected a readable image"):
        list(vs.render(recipe_of(folder)))
    bare = mesh_of(materials=(Material("a"), Material("b")))
    with pytest.raises(RecipeError, match=r"^scene.materials: expected a readable image; \S*broken.png is not an image"):
        textured(bare, (Repaint(image=str(folder / "broken.png")),))
    with pytest.raises(RecipeError, match=r"^scene.materials: expected an image file, found No such file.*: \S*gone.png$"):
        textured(bare, (Repaint(image=str(folder / "gone.png")),))


@pytest.mark.skipif(not hasattr(os, "symlink"), reason="links")
def test_links_that_lead_out_of_the_folder_are_refused(folder, tmp_path):
    Image.new("RGB", (2, 2)).save(tmp_path / "else.png")
    (folder / "linked.png").symlink_to(tmp_path / "else.png")
    with pytest.raises(RecipeError, match=r"scene.materials\[0\].images: expected images inside .* leads out: .*linked.png"):
        plan(recipe_of(folder))
