"""Grounds and models that are made of drawn materials."""

from dataclasses import replace

import numpy as np
import pytest

import viewsphere as vs
from animated import let_walk
from small import ROOT
from viewsphere.assets.appearance.description import appearance_of, words
from viewsphere.assets.appearance.pbr import pictures_of
from viewsphere.assets.appearance.repaint import box_mapped, textured
from viewsphere.assets.mesh import Material
from viewsphere.assets.primitive import face_normals
from viewsphere.check import check
from viewsphere.codecs.srgb import linear
from viewsphere.errors import RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.materials import brick as brick_module
from viewsphere.materials import metres, surface
from viewsphere.materials.brick import Brick
from viewsphere.model.annotations.procedural_material import ProceduralMaterial
from viewsphere.model.scene import Ground
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Repaint
from viewsphere.planning.plan import plan
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.world.scene import EngineEntry
from viewsphere.rendering.ground.material import ground_albedo, ground_material, only_scatters
from viewsphere_zoo import build

WOOD = ProceduralMaterial(name="wood", seed=4, size=128)
BRICK = ProceduralMaterial(name="brick", seed=4, size=128)


def recipe_of(ground="off", materials=(), **changes):
    values = {
        "models": [{"source": "zoo:chair", "count": 3}],
        "viewpoints": {"azimuth": 30, "elevation": 20, "distance": {"fill": 0.8}},
        "camera": {"size": [64, 48], "fov_deg": 35},
        "scene": {"ground": ground, "materials": list(materials)},
        "splits": {"train": 1.0},
        "channels": ["rgb", "instances", "depth", "normals", "materials", "triangles", "barycentrics"],
        "engine": {"name": "raster", "ambient_occlusion": "off"},
        "formats": [],
    }
    return Recipe(**{**values, **changes})


@pytest.fixture(scope="module")
def chair():
    return build("chair", np.random.default_rng(3))


def test_pictures_hold_what_the_surface_is():
    color, data, bumps = (image.pixels for image in pictures_of(WOOD))
    made = surface("wood", 4, 128)
    assert np.abs(linear(color[..., :3] / 255) - made.color).max() < 0.005
    np.testing.assert_allclose(data[..., 1] / 255, made.roughness, atol=0.003)
    assert (data[..., 2] == 0).all()
    np.testing.assert_allclose(bumps[..., :3] / 127.5 - 1, made.normals, atol=0.005)
    assert all((pixels[..., 3] == 255).all() for pixels in (color, data, bumps))
    assert (pictures_of(ProceduralMaterial(name="metal", seed=1, size=32))[1].pixels[..., 2] > 250).all()


def test_a_ground_is_made_of_a_material():
    ground = Ground(material=BRICK, color=(1, 1, 1), tile=0.9)
    material, images = ground_material(ground)
    assert not ground.has_slabs and not only_scatters(ground)
    assert [images[t.image].name for t in (material.base_color_texture, material.normal_texture)] == ["brick", "brick_normals"]
    np.testing.assert_allclose(ground_albedo(material, images), surface("brick", 4, 128).color.mean(axis=(0, 1)), atol=0.003)
    assert ground_material(ground)[1][0] is images[0]
    assert "material" not in Ground().model_dump()
    assert Ground.model_validate_json(ground.model_dump_json()) == ground


def test_mapped_coordinates_are_metres(chair):
    """On flat faces that look along an axis u and v are lengths, not mirrored; elsewhere they shrink as the box says."""
    every, none = np.ones(len(chair.triangles), bool), np.zeros(len(chair.triangles), bool)
    for grained in (none, every):
        mapped = box_mapped(chair, every, grained)
        np.testing.assert_array_equal(mapped.vertices[mapped.triangles], chair.vertices[chair.triangles])
        np.testing.assert_array_equal(mapped.normals[mapped.triangles], chair.normals[chair.triangles])
        double = face_normals(chair.vertices.astype(np.float64), chair.triangles)
        uv = mapped.uv0[mapped.triangles].astype(np.float64)
        (a, b), (c, d) = (uv[:, 1] - uv[:, 0]).T, (uv[:, 2] - uv[:, 0]).T
        np.testing.assert_allclose(-(a * d - b * c), np.abs(double).max(axis=1), atol=2e-6)


def test_what_is_not_chosen_keeps_its_coordinates(chair):
    whole = box_mapped(chair, np.ones(len(chair.triangles), bool), np.zeros(len(chair.triangles), bool))
    some = np.arange(len(chair.triangles)) % 2 == 0
    mapped = box_mapped(whole, some, np.ones(len(some), bool))
    np.testing.assert_array_equal(mapped.uv0[mapped.triangles[~some]], whole.uv0[whole.triangles[~some]])
    assert not np.array_equal(mapped.uv0[mapped.triangles[some]], whole.uv0[whole.triangles[some]])


def test_a_deforming_model_keeps_its_material_where_it_is(chair):
    bent = replace(chair, vertices=chair.vertices[:, [1, 2, 0]] * np.float32(1.1))
    rest, moved = (textured(mesh, (Repaint(texture=WOOD),), chair) for mesh in (chair, bent))
    np.testing.assert_array_equal(rest.uv0, moved.uv0)
    np.testing.assert_array_equal(rest.triangles, moved.triangles)


def test_glass_and_what_has_holes_stay(chair):
    kinds = (
        Material("a"),
        Material("b", transmission=0.9),
        Material("c", alpha_mode="BLEND"),
        Material("d", alpha_mode="MASK"),
    )
    mesh = replace(chair, materials=kinds, triangle_material=(np.arange(len(chair.triangles)) % 4).astype(np.int32))
    painted = textured(mesh, (Repaint(texture=WOOD),))
    assert painted.materials[1:] == kinds[1:]
    assert painted.materials[0].name == "a" and painted.materials[0].base_color_texture is not None
    assert textured(mesh, (Repaint(material="e", texture=WOOD),)) is mesh


@pytest.mark.slow
def test_every_label_is_the_same_and_every_picture_another():
    plain, made = (list(vs.render(recipe_of("on", m))) for m in ((), [{"texture": "any"}]))
    for one, other in zip(plain, made, strict=True):
        for name in ("instances", "depth", "normals", "materials", "triangles", "barycentrics"):
            assert one.channels[name].tobytes() == other.channels[name].tobytes(), name
        assert [o.box2d for o in one.objects] == [o.box2d for o in other.objects]
        assert not np.array_equal(one.rgb, other.rgb)


def test_models_without_coordinates_are_made_of_what_the_recipe_says(tmp_path):
    """Seen from the front, red bricks on a box that has no texture coordinates: red and grey, in more than one tone."""
    (tmp_path / "box.obj").write_text(
        "v 0 0 0\nv 0 0 1\nv 0 1 0\nv 0 1 1\nv 1 0 0\nv 1 0 1\nv 1 1 0\nv 1 1 1\n"
        "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"
    )
    models = [{"source": str(tmp_path / "box.obj"), "category": "box"}]
    plain, bricks = (next(iter(vs.render(recipe_of("off", m, models=models)))) for m in ((), [{"texture": "brick"}]))
    spread = [sample.rgb[sample.instances > 0].astype(float).std(axis=0).mean() for sample in (plain, bricks)]
    assert spread[1] > spread[0] + 5


def made_of(**fields):
    """Of each shot the substances of its ground and of its first model."""
    scene = {
        "ground": {"material": ["wood", "tile"]},
        "materials": [{"texture": fields.pop("texture", "any")}],
        "draw": fields.pop("draw", "per_model"),
    }
    views = {"azimuth": 30, "elevation": 20, "distance": 4}
    found = plan(recipe_of(scene=scene, **{"viewpoints": views, **fields})).shots(
        lambda spec, step=None: Box3d.between((-1, -1, 0), (1, 1, 1)).corners
    )
    shots = [Shot.model_validate_json(shot.model_dump_json()) for shot in found]
    return [(shot.scene.ground.material, shot.scene.ground.tile, shot.things[0].repaints[0].texture) for shot in shots]


@pytest.mark.parametrize("texture", [["any", "wood"], {"choice": ["any", "plastic"]}, {"choice": "any"}])
def test_any_among_others_stands_for_each(texture):
    many = made_of(models=[{"source": "zoo:chair", "count": 60}], texture=texture)
    assert len({made.name for _, _, made in many}) > 12


def test_names_and_seeds_are_drawn_once_a_model():
    first = made_of()
    assert made_of() == first
    assert made_of(models=[{"source": "zoo:chair", "count": 2}]) == first[:2]
    assert made_of(seed=5) != first
    many = made_of(models=[{"source": "zoo:chair", "count": 60}])
    assert {ground.name for ground, _, _ in many} == {"wood", "tile"}
    assert len({made.name for _, _, made in many}) > 12
    assert len({ground.seed for ground, _, _ in many} | {made.seed for _, _, made in many}) == 120
    assert all(tile == metres(ground.name, ground.seed) for ground, tile, _ in many)
    assert len(made_of(draw="fixed")) == len({*map(str, made_of(draw="fixed"))}) + 2


def test_a_grain_is_drawn_for_each_frame():
    views = {"azimuth": [30, 31, 32], "elevation": 20, "distance": 4}
    one = [{"source": "zoo:chair"}]
    found = made_of(models=one, viewpoints=views, draw="per_frame")
    assert len({ground.seed for ground, _, _ in found}) == 3


def test_a_grain_alone_is_new_in_each_frame():
    scene = {"ground": {"material": "wood"}, "draw": "per_frame"}
    assert recipe_of(scene=scene).scene.is_new_each_frame
    assert not recipe_of(scene={**scene, "ground": "on"}).scene.is_new_each_frame


@pytest.mark.parametrize(
    ("scene", "told"),
    [
        (
            {"ground": {"material": "wod"}},
            r"scene\.ground\.material: 'wod' is unknown; did you mean 'wood'\? Valid: asphalt",
        ),
        (
            {"ground": {"material": ["wood", "carpets"]}},
            r"scene\.ground\.material.*'carpets' is unknown; did you mean 'carpet'\?",
        ),
        ({"ground": {"material": "wood", "image": "a.png"}}, r"scene\.ground: expected material or image; found both"),
        ({"ground": {"material": "wood", "tile": 1}}, r"scene\.ground: expected no tile beside material.*leave it out"),
        ({"materials": [{"texture": "iron"}]}, r"scene\.materials\[0\]\.texture: 'iron' is unknown.*asphalt"),
        (
            {"materials": [{"texture": {"choice": ["any", "wood"], "weights": [1, 2]}}]},
            r"expected names of materials beside weights; found \['any', 'wood'\]",
        ),
        ({"materials": [{"texture": "any", "images": "x"}]}, r"scene\.materials\[0\]: expected images or texture; found both"),
    ],
)
def test_mistakes_are_told_in_a_line(scene, told):
    with pytest.raises(RecipeError, match=told) as caught:
        recipe_of(scene=scene)
    assert "\n" not in str(caught.value)


def test_sentences_say_what_a_model_is_made_of(chair, monkeypatch):
    looks = appearance_of(replace(chair, materials=tuple(Material(m.name, roughness=0.9) for m in chair.materials)))
    assert words(looks)[1] == "matte"
    assert words(looks, (Repaint(texture=BRICK),))[1] == "brick"
    assert words(looks, (Repaint(texture=WOOD),))[1] == "wooden"
    assert words(looks, (Repaint(texture=ProceduralMaterial(name="grass", size=128)),))[0] == "green"
    assert words(looks, (Repaint(texture=ProceduralMaterial(name="plaster", size=128), tint=(0.0, 0.0, 0.9)),)) == (
        "blue",
        "plaster",
    )
    leaves = appearance_of(replace(chair, materials=tuple(Material(m.name, alpha_mode="MASK") for m in chair.materials)))
    assert words(leaves, (Repaint(texture=WOOD),))[1] != "wooden"  # they stay what they are
    brick = Brick(colors=((0.3, 0.03, 0.02),) * 3, rows=16)  # whose joints come back every 8 texels
    monkeypatch.setattr(brick_module, "MATERIAL", brick_module.MATERIAL.model_copy(update={"draw": lambda rng: brick}))
    assert words(looks, (Repaint(texture=ProceduralMaterial(name="brick", seed=77, size=128)),)) == ("red", "brick")


@pytest.mark.slow
def test_the_recipe_of_materials_makes_a_data_set_that_passes(tmp_path):
    views = {"azimuth": 35, "elevation": 18, "distance": {"fill": 0.7}}
    small = {"camera": {"size": [48, 36], "fov_deg": 35}, "viewpoints": views, "formats": []}
    recipe = Recipe.load(ROOT / "recipes" / "materials.yaml", small)
    vs.generate(recipe, tmp_path, workers=0)
    dataset = vs.open(tmp_path)
    report = check(dataset, sample=None)
    assert report.ok, report.findings
    shots = [dataset.store.shot(key) for key, _ in dataset.shots()]
    assert len({shot.scene.ground.material.name for shot in shots}) > 3
    assert len({thing.repaints[0].texture.name for shot in shots for thing in shot.objects}) > 5
    said = [caption.text for sample in dataset for caption in sample.captions]
    assert any("metal" in text or "wooden" in text for text in said)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["cycles", "eevee"])
def test_blenders_engines_show_the_materials_where_raster_does(request, engine):
    """Bricks below and planks on a chair: as bright within what the engines' light differs by, and in the same places."""
    request.getfixturevalue("blender" if engine == "cycles" else "drawing")
    options = {"name": engine, "samples": 16, "denoise": "off"} if engine == "cycles" else {"name": engine, "quality": "draft"}
    recipe = recipe_of({"material": "brick"}, [{"texture": "planks"}], camera={"size": [160, 120], "fov_deg": 35})
    recipe = recipe.model_copy(update={"models": recipe.models[:1]})
    engines = (recipe.engine, EngineEntry(**options))
    by_raster, by_blender = (next(iter(vs.render(recipe.model_copy(update={"engine": e})))).rgb.astype(float) for e in engines)
    assert np.abs(by_raster - by_blender).mean() < 10
    assert np.abs(by_raster.mean(axis=(0, 1)) - by_blender.mean(axis=(0, 1))).max() < 8
    floor = slice(90, 120)
    assert np.corrcoef(by_raster[floor].reshape(-1), by_blender[floor].reshape(-1))[0, 1] > 0.8


@pytest.mark.slow
def test_labels_of_a_deforming_model_do_not_change(monkeypatch, tmp_path):
    """The box leans, and loses its lid half-way: what it is made of follows, flow and all else stay."""
    let_walk(monkeypatch, tmp_path)
    model = {"source": str(tmp_path / "walker.fbx"), "category": "walker", "motion": {"kind": "clip"}}
    fields = {
        "models": [model],
        "viewpoints": {"azimuth": 30, "elevation": 20, "distance": 4},
        "time": {"frames": 5, "fps": 2.4},
        "channels": ["rgb", "instances", "depth", "normals", "flow", "scene_flow", "materials", "triangles"],
    }
    plain, made = (list(vs.render(recipe_of("on", own, **fields))) for own in ((), [{"texture": "wood"}]))
    assert len(plain) == 5
    for one, other in zip(plain, made, strict=True):
        for name in fields["channels"][1:]:
            assert one.channels[name].tobytes() == other.channels[name].tobytes(), name
        assert not np.array_equal(one.rgb, other.rgb)
