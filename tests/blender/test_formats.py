"""What only Blender reads becomes a model like any other; what it cannot read is one line."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from deadline import until
from viewsphere import Recipe
from viewsphere.assets.cache import load
from viewsphere.assets.inspect import describe
from viewsphere.assets.load import load_model
from viewsphere.assets.sandbox.client import READ_HERE
from viewsphere.blender.interpreter import VARIABLE
from viewsphere.codecs.srgb import linear
from viewsphere.errors import ModelError
from viewsphere.model.model_spec import ModelSpec
from viewsphere.planning.models import model_specs

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("blenders")]

EXCHANGE = "corner.fbx", "corner.usda", "corner.usdc", "corner.usdz", "corner.abc", "corner.blend", "draco.glb"
MODELS = Path(__file__).parents[3] / "shared" / "models"


@pytest.fixture(scope="module")
def made(blender, tmp_path_factory):
    """The folder of files that `make_files` makes; do not change it."""
    folder = tmp_path_factory.mktemp("made") / "files"
    folder.mkdir()
    run = subprocess.run([blender, Path(__file__).with_name("make_files.py"), folder], capture_output=True, text=True)
    assert json.loads(run.stdout.splitlines()[-1]), run.stderr
    return folder


@pytest.fixture(scope="module")
def evaluated(made):
    return load_model(made / "evaluated.blend")[0]


@pytest.fixture(scope="module")
def painted(made):
    return load_model(made / "painted.blend")[0]


def spec_of(path):
    return ModelSpec(key="a", source=str(path), category="thing", category_id=1)


def box(mesh, part):
    """Lowest and highest corner of a part's triangles."""
    corners = mesh.vertices[mesh.triangles[mesh.triangle_part == mesh.parts.index(part)]].reshape(-1, 3)
    return corners.min(axis=0), corners.max(axis=0)


def volume(mesh, part):
    """Enclosed by a part, more than 0 where its fronts are outside."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles[mesh.triangle_part == mesh.parts.index(part)]].astype(float), 1, 0)
    return float((a * np.cross(b, c)).sum() / 6)


def assert_fronts_have_their_normals(mesh):
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    faces = np.cross(b - a, c - a)
    assert ((faces * mesh.normals[mesh.triangles].sum(axis=1)).sum(axis=1) > 0).all()


def material_of(mesh, part):
    (index,) = set(mesh.triangle_material[mesh.triangle_part == mesh.parts.index(part)].tolist())
    return mesh.materials[index]


def image_of(mesh, texture):
    return mesh.images[texture.image].pixels


# Geometry.


def upright(vectors):
    """Vectors with y up as they are with z up."""
    return np.ascontiguousarray(vectors[:, [0, 2, 1]] * np.array([1, -1, 1], np.float32))


@pytest.mark.parametrize("name", EXCHANGE)
def test_each_format_stands_as_it_was_made(made, name):
    mesh, facts = load_model(made / name)
    assert (facts.unit, facts.format) == (1.0, name.split(".")[1])
    assert (facts.up, facts.forward) == (("+y", "+z") if name.endswith("glb") else ("+z", "-y"))
    if name.endswith("glb"):
        mesh = replace(mesh, vertices=upright(mesh.vertices), normals=upright(mesh.normals))
    parts = sorted(mesh.parts, key=lambda part: box(mesh, part)[0][0])
    for part, low, high in zip(parts, [(-3, 0, 0), (0, 0, 0)], [(-2, 2, 3), (1, 2, 3)], strict=True):
        np.testing.assert_allclose(box(mesh, part), [low, high], atol=1e-5)
        assert volume(mesh, part) == pytest.approx(1.0, abs=1e-5)
    assert_fronts_have_their_normals(mesh)
    if not name.endswith("abc"):  # Alembic has no materials
        red = material_of(mesh, "corner")
        np.testing.assert_allclose([*red.base_color, red.metallic, red.roughness], [0.8, 0.1, 0.1, 1, 1, 0.25], atol=2e-3)


def test_backface_culling_is_the_single_side_of_a_material(made):
    mesh, _ = load_model(made / "sides.blend")
    assert {part: material_of(mesh, part).double_sided for part in mesh.parts} == {"single": False, "double": True}


def test_what_is_rendered_is_there_and_nothing_else(evaluated):
    expected = {
        "smooth", "not in the window", "text", "tube", "ball", "keyed", "moving", "one/part", "two/part", "parent", "child",
        "on the shelf", "flat", "scattered",
    }  # fmt: skip
    assert set(evaluated.parts) == expected
    assert list(evaluated.parts) == sorted(expected)
    assert "6 triangles without area dropped" in evaluated.warnings[0]
    assert_fronts_have_their_normals(evaluated)


def test_it_is_evaluated_as_renders_are(evaluated):
    # Two levels at render, none in the window: 6 x 16 quadrilaterals.
    assert np.count_nonzero(evaluated.triangle_part == evaluated.parts.index("smooth")) == 2 * 6 * 16
    np.testing.assert_allclose(box(evaluated, "keyed"), [(30, 0, 0), (31, 2, 6)])
    np.testing.assert_allclose(box(evaluated, "moving"), [(40, 0, 0), (41, 2, 3)])  # the first frame is the third
    np.testing.assert_allclose(box(evaluated, "child"), [(63, 0, 0), (64, 2, 3)])
    np.testing.assert_allclose(box(evaluated, "two/part"), [(55, 0, 0), (56, 2, 3)])
    assert volume(evaluated, "tube") == pytest.approx(0.04, rel=0.1)
    assert box(evaluated, "ball")[1][0] > 25.5
    assert volume(evaluated, "scattered") == pytest.approx(4 * 0.1**3, rel=1e-3)
    assert material_of(evaluated, "scattered").name == "blue"


def test_a_name_means_a_part_of_a_file(made):
    def found(inside):
        mesh, facts = load_model(made / "evaluated.blend" / inside)
        assert facts.path == made / "evaluated.blend"
        return mesh.parts

    assert found("Object/parent") == ("child", "parent")
    assert found("Object/child") == ("child",)
    assert found("Object/hidden") == ("hidden",)
    assert found("Object/spare") == ("spare",)  # in no scene
    assert found("Object/two") == ("two/part",)
    assert found("Collection/shelf") == ("on the shelf",)
    assert found("Collection/inner") == ("part",)
    with pytest.raises(ModelError, match=r"an object of the name 'parentt', found 'parent', "):
        load_model(made / "evaluated.blend" / "Object" / "parentt")


def test_recipes_and_inspect_know_such_names(made):
    source = [f"{made}/evaluated.blend/Object/parent", f"{made}/*.fbx"]
    recipe = Recipe(models=[{"source": source, "category": "x"}], viewpoints={"distance": 9})
    assert [spec.key for spec in model_specs(recipe)] == ["acting", "corner", "parent", "resting"]
    report = describe(made / "evaluated.blend" / "Object" / "parent")
    np.testing.assert_allclose(report.size, (4, 3, 2))
    assert dict(report.parts) == {"child": 4, "parent": 4}


@pytest.mark.parametrize("suffix", ["blend", "fbx"])
def test_armatures_stand_as_at_the_first_frame(made, suffix):
    np.testing.assert_allclose(box(load_model(made / f"acting.{suffix}")[0], "body")[0], (0, 0, 5), atol=1e-5)
    np.testing.assert_allclose(box(load_model(made / f"resting.{suffix}")[0], "body")[0], (0, 0, 0), atol=1e-5)


@pytest.mark.parametrize("name", ["acting.blend", "acting.fbx", "resting.blend"])
def test_bones_are_named_points(made, name):
    mesh, facts = load_model(made / name)
    assert next(iter(facts.keypoints.points)) == "bone"  # FBX also has where it ends
    foot = facts.keypoints.points["bone"]
    np.testing.assert_allclose(foot, box(mesh, "body")[0], atol=1e-5)


@pytest.mark.parametrize("name", ["pointed.blend", "pointed.glb"])
def test_empties_are_named_points(made, name):
    found = load_model(made / name)[1].keypoints
    y_up = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]) if name.endswith("glb") else np.eye(3)
    expected = {"nose": (0, 1, 0), "eye.L": (0, 1, 2), "eye.R": (1, 1, 2)}
    assert found.points.keys() == expected.keys()
    for point, place in expected.items():
        np.testing.assert_allclose(found.points[point], y_up @ place, atol=1e-6)
    assert {*found.skeleton} == {("nose", "eye.L"), ("nose", "eye.R")} and found.flips == (("eye.L", "eye.R"),)


def test_the_same_file_gives_the_same_bytes(made, tmp_path, blenders):
    """From one Blender to another."""
    specs = [spec_of(made / name) for name in ("evaluated.blend", "painted.blend")]
    for folder in ("one", "two"):
        blenders.end()
        for spec in specs:
            load(spec, folder=tmp_path / folder)
    one, two = (sorted((tmp_path / folder).glob("*.npz")) for folder in ("one", "two"))
    assert [file.name for file in one] == [file.name for file in two]
    assert all(a.read_bytes() == b.read_bytes() for a, b in zip(one, two, strict=True))


# Materials.


def test_values_of_the_principled_shader(painted):
    found = material_of(painted, "plastic")
    assert found.alpha_mode == "BLEND"
    assert found.base_color[3] == pytest.approx(0.5)
    np.testing.assert_allclose(found.emissive, (4, 2, 0), rtol=1e-6)
    np.testing.assert_allclose([found.clearcoat, found.ior, found.specular], (0.5, 1.4, 1.0), rtol=1e-6)


def test_glass_is_solid(painted):
    glass, plastic = (material_of(painted, name) for name in ("glass", "plastic"))
    assert (glass.transmission, plastic.transmission) == (1, 0)
    assert glass.thickness > 0 == plastic.thickness


def test_pictures_stay_as_they_are(painted):
    texture = material_of(painted, "picture").base_color_texture
    assert image_of(painted, texture)[..., :3].tolist() == [[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [128, 128, 128]]]
    np.testing.assert_allclose(material_of(painted, "tinted").base_color, (0.5, 0.25, 1, 1))
    assert material_of(painted, "tinted").base_color_texture == texture
    packed = material_of(painted, "packed").base_color_texture
    assert np.array_equal(image_of(painted, packed), image_of(painted, texture))


def test_coordinates_stand_on_their_feet(painted):
    """The grid's lower left corner shows the picture's."""
    corners = painted.triangles[painted.triangle_part == painted.parts.index("picture")].reshape(-1)
    at = corners[painted.vertices[corners].sum(axis=1).argmin()]
    assert painted.uv0 is not None
    np.testing.assert_allclose(painted.uv0[at], (0, 1), atol=1e-6)  # v points down


def test_a_mapping_moves_a_texture_as_blender_does(painted):
    moved = material_of(painted, "moved").base_color_texture
    uv = np.array([0.3, 0.8])  # v upwards
    turn = np.radians(30)
    scaled = uv * (2, 3)
    rotated = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ scaled
    expected = rotated + np.array([0.1, 0.2])
    found = moved.matrix @ (uv[0], 1 - uv[1], 1)
    np.testing.assert_allclose((found[0], 1 - found[1]), expected, atol=1e-6)


def test_a_second_set_of_coordinates_is_kept(painted):
    assert material_of(painted, "second").base_color_texture.texcoord == 1
    corners = painted.triangles[painted.triangle_part == painted.parts.index("second")].reshape(-1)
    np.testing.assert_allclose(painted.uv1[corners], np.tile((0.25, 0.75), (6, 1)), atol=1e-6)


def test_roughness_and_metal_share_a_picture(painted):
    found = material_of(painted, "roughness")
    pixels = image_of(painted, found.metallic_roughness_texture)
    assert (found.roughness, found.metallic) == (1, 1)
    np.testing.assert_allclose(pixels[..., 1:3], np.rint(np.array([[[64, 128], [255, 255]], [[0, 0], [191, 64]]])), atol=1)


def test_normal_maps_and_holes(painted):
    bumpy = material_of(painted, "normals")
    assert bumpy.normal_scale == pytest.approx(0.7)
    assert image_of(painted, bumpy.normal_texture).shape == (1, 2, 4)
    holes = material_of(painted, "holes")
    assert holes.alpha_mode == "MASK"
    assert image_of(painted, holes.base_color_texture)[..., 3].tolist() == [[255, 0], [0, 255]]
    assert material_of(painted, "picture").alpha_mode == "OPAQUE"


def test_the_older_plastic_is_plastic(painted):
    old = material_of(painted, "old")
    np.testing.assert_allclose([*old.base_color[:3], old.roughness, old.metallic], (0.1, 0.4, 0.2, 0.3, 0), atol=1e-6)


def test_vertex_colours_are_kept_where_they_are_used(painted):
    for part, color in (("painted", (0.2, 0.4, 0.6)), ("bare", (0.9, 0.1, 0.1)), ("picture", (1, 1, 1))):
        corners = painted.triangles[painted.triangle_part == painted.parts.index(part)]
        np.testing.assert_allclose(painted.colors[corners][..., :3], np.broadcast_to(color, (2, 3, 3)), atol=1e-6)
        assert material_of(painted, part).base_color == (1, 1, 1, 1)


@pytest.mark.parametrize("name", ["occluded.blend", "occluded.glb"])
def test_occlusion_is_carried(made, name):
    mesh, _ = load_model(made / name)
    assert mesh.warnings == ()
    strengths = {"crevices": 1.0, "faint crevices": 0.4}
    for part, strength in strengths.items():
        found = material_of(mesh, part)
        assert found.occlusion_strength == pytest.approx(strength)
        np.testing.assert_allclose(image_of(mesh, found.occlusion_texture)[..., 0], [[0, 64], [128, 255]], atol=1)
    if name.endswith("blend"):
        turned = material_of(mesh, "turned crevices")
        np.testing.assert_allclose(image_of(mesh, turned.occlusion_texture)[..., 0], [[255, 191], [127, 0]], atol=1)
        assert material_of(mesh, "no crevices").occlusion_texture is None
        assert len({material_of(mesh, part).occlusion_texture for part in strengths}) == 1  # the picture as it stands


def test_what_is_lost_is_named(painted):
    said = "\n".join(painted.warnings)
    assert "material 'procedural': the node Noise Texture cannot be carried over" in said
    assert "texture 'lost.png' does not exist" in said
    assert "away.png' is outside the model's folder, not read; set confined: false to allow" in said
    assert len(painted.warnings) == 3


def test_inverted_channels_are_worked_out(made, blender, tmp_path):
    code = f"""
import bpy
bpy.ops.wm.open_mainfile(filepath={str(made / "painted.blend")!r})
one = bpy.data.materials["picture"]
tree = one.node_tree
image = next(n for n in tree.nodes if n.type == "TEX_IMAGE")
principled = tree.nodes["Principled BSDF"]
invert = tree.nodes.new("ShaderNodeInvert")
tree.links.new(image.outputs[0], invert.inputs[1])
tree.links.new(invert.outputs[0], principled.inputs["Base Color"])
ramp = tree.nodes.new("ShaderNodeValToRGB")
split = tree.nodes.new("ShaderNodeSeparateColor")
tree.links.new(image.outputs[0], split.inputs[0])
tree.links.new(split.outputs[0], ramp.inputs[0])
tree.links.new(ramp.outputs[0], principled.inputs["Roughness"])
bpy.ops.wm.save_as_mainfile(filepath={str(tmp_path / "worked.blend")!r})
"""
    shutil.copy(made / "rgb.png", tmp_path)
    subprocess.run([blender, "-c", code + "import os; os._exit(0)"], check=True, capture_output=True)
    mesh, _ = load_model(tmp_path / "worked.blend" / "Object" / "picture")
    found = mesh.materials[0]
    shown = linear(image_of(mesh, found.base_color_texture)[..., :3] / 255)
    grey = float(linear(np.array(128 / 255)))
    expected = [[(0, 1, 1), (1, 0, 1)], [(1, 1, 0), (1 - grey,) * 3]]
    np.testing.assert_allclose(shown, expected, atol=0.01)
    assert image_of(mesh, found.metallic_roughness_texture)[..., 1].tolist() == [[255, 0], [0, round(255 * grey)]]
    assert not any("cannot be carried over" in warning for warning in mesh.warnings)


# Safety and bad input.


def test_libraries_outside_are_read_only_with_consent(made):
    links = made / "in" / "links.blend"
    mesh, _ = load_model(links)
    assert mesh.parts == ("linked", "own")
    assert "outside.blend' is outside the model's folder, not read; set confined: false to allow" in mesh.warnings[0]
    mesh, facts = load_model(links, confined=False)
    assert (mesh.parts, mesh.warnings) == (("foreign", "linked", "own"), ())
    assert {file.name for file in facts.files} == {"links.blend", "library.blend", "outside.blend"}


def usd_of(folder, asset):
    file = folder / "top.usda"
    file.write_text(
        '#usda 1.0\n(\n upAxis = "Z"\n metersPerUnit = 1\n)\n'
        f'def Xform "here" (prepend references = @{asset}@</root>)\n{{\n}}\n'
    )
    return file


def test_layers_are_known_missing_or_refused(made, tmp_path):
    (tmp_path / "in").mkdir()
    shutil.copy(made / "corner.usda", tmp_path / "in" / "beside.usda")
    shutil.copy(made / "corner.usda", tmp_path / "outside.usda")
    mesh, facts = load_model(usd_of(tmp_path / "in", "./beside.usda"))
    assert len(mesh.triangles) == 8
    assert {file.name for file in facts.files} >= {"top.usda", "beside.usda"}
    with pytest.raises(ModelError, match=r"no triangles found.*gone.usda' does not exist"):
        load_model(usd_of(tmp_path / "in", "./gone.usda"))
    outside = usd_of(tmp_path / "in", "../outside.usda")
    with pytest.raises(ModelError, match=r"outside.usda' is outside the model's folder.*confined: false"):
        load_model(outside)
    assert len(load_model(outside, confined=False)[0].triangles) == 8


def test_a_changed_layer_is_read_anew(made, tmp_path):
    shutil.copy(made / "corner.usda", tmp_path / "beside.usda")
    spec = spec_of(usd_of(tmp_path, "./beside.usda"))
    assert len(load(spec, folder=tmp_path / "cache")[0].triangles) == 8
    text = (tmp_path / "beside.usda").read_text().replace('def Xform "mirrored"', 'over "mirrored"')
    (tmp_path / "beside.usda").write_text(text)
    assert len(load(spec, folder=tmp_path / "cache")[0].triangles) == 4


def test_nothing_outside_is_read_or_written_by_blender(made, blender, tmp_path):
    """Where the kernel can see to that."""
    from viewsphere.blender.process import BlenderProcess
    from viewsphere.errors import BlenderError

    if not sys.platform.startswith("linux") or confines(blender) is False:
        pytest.skip("needs Landlock, of Linux 5.13 and later")
    secret = tmp_path / "secret.blend"
    shutil.copy(made / "corner.blend", secret)
    with BlenderProcess(blender, readable=[made]) as process:
        told = {"kind": "blend", "inside": [], "root": None, "most": 1000, "folder": str(process.folder)}
        with pytest.raises(BlenderError):
            process.ask("read", file=str(secret), **told)
        assert process.ask("read", file=str(made / "corner.blend"), **told)["placed"]
        with pytest.raises(BlenderError):
            process.ask("read", file=str(made / "corner.blend"), **told | {"folder": str(tmp_path)})
    assert {p.name for p in tmp_path.iterdir()} == {"secret.blend"}


def confines(blender):
    worker = Path(__file__).parents[2] / "src" / "viewsphere" / "blender"
    code = "from worker.confine import confine; print(confine([], []))"
    run = subprocess.run([blender, "-c", code], cwd=worker, capture_output=True, text=True)
    return run.stdout.strip() == "True"


BAD = {
    "empty.blend": "no triangles found that a render would show",
    "heavy.blend": "at most 10,000,000 triangles, found about 50,331,648 by its modifier 'Too Much'",
    "many.blend": "at most 10,000,000 triangles, found about 54,000,000 by its modifier 'Array",
    "flood.blend": "at most 10,000,000 triangles, found more as evaluated",
    "gone.blend": "no such file",
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files_are_one_line(made, name):
    assert_refused(made / name, BAD[name])


def assert_refused(path, words):
    with pytest.raises(ModelError) as error:
        load_model(path)
    assert words in str(error.value)
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", EXCHANGE[:-1])
def test_parts_of_files_and_other_files_are_refused(made, tmp_path, name):
    data = (made / name).read_bytes()
    for k, other in enumerate((data[: len(data) // 2], b"\x93no model" * 300, b"")):
        path = tmp_path / f"{k}{name}"
        path.write_bytes(other)
        assert_refused(path, "")


def test_later_blenders_files_cost_a_warning(made, tmp_path):
    data = (made / "later.blend").read_bytes()
    head = data[:17]
    later = tmp_path / "later.blend"
    later.write_bytes(head.replace(b"v05", b"v09").replace(b"v04", b"v09").replace(b"-v4", b"-v9") + data[17:])
    try:
        mesh, _ = load_model(later)
    except ModelError as error:
        assert "Blender cannot read it" in str(error)  # Blender 4.5
    else:
        assert re.search(r"written by Blender 9\.\d, read by \d\.\d: what is new in it is lost", mesh.warnings[0])


def test_time_and_memory_are_bounded(made, monkeypatch, tmp_path):
    monkeypatch.delenv(READ_HERE, raising=False)
    spec = spec_of(made / "flood.blend")
    if sys.platform.startswith("linux"):
        monkeypatch.setenv("VIEWSPHERE_MAX_READ_BYTES", "800000000")
        with pytest.raises(ModelError, match=r"800,000,000 bytes of memory \(limit MAX_READ_BYTES\)"):
            load(spec, folder=tmp_path)
        monkeypatch.delenv("VIEWSPHERE_MAX_READ_BYTES")
    monkeypatch.setenv("VIEWSPHERE_MAX_READ_SECONDS", str(0.2))  # Blender takes longer to start, on any machine
    with pytest.raises(ModelError, match=r"within 0.2 s \(limit MAX_READ_SECONDS\)"):
        load(spec, folder=tmp_path)
    assert until(lambda: not readers())
    assert list(tmp_path.iterdir()) == []


def readers():
    """Processes of Blender that this one's children started."""
    found = []
    for place in Path("/proc").glob("[0-9]*/cmdline") if sys.platform.startswith("linux") else ():
        try:
            words = place.read_bytes()
        except OSError:
            continue
        if b"run_module" in words and b"made" in words:
            found.append(place)
    return found


@pytest.mark.parametrize("name", ["a.fbx", "a.blend", "a.abc"])
def test_without_blender_the_error_says_how_to_set_it_up(tmp_path, monkeypatch, name):
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    monkeypatch.setattr("viewsphere.blender.environment.home", lambda: tmp_path / "none")
    begins = {"a.fbx": b"Kaydara FBX Binary  \0", "a.blend": b"BLENDER-v500", "a.abc": b"Ogawa\xff\0\1"}
    (tmp_path / name).write_bytes(begins[name] + bytes(100))
    with pytest.raises(ModelError, match=r"files are read by Blender, found none.*viewsphere doctor --setup-blender"):
        load_model(tmp_path / name)


@pytest.mark.skipif(not MODELS.is_dir(), reason="the folder of real models is not there")
@pytest.mark.usefixtures("blender")
@pytest.mark.parametrize(
    ("name", "size", "textures"),
    [
        ("awkward/CesiumMan.usdz", (0.505, 0.896, 1.458), 1),
        ("car/Taxi.fbx", (1.807, 4.221, 1.310), 0),
        ("car/BasicTaxi.blend", (1.836, 3.969, 1.689), 1),
        ("misc/Teapot/Teapot.usd", (0.305, 0.491, 0.230), 0),
    ],
)
def test_real_files(name, size, textures):
    mesh, facts = load_model(MODELS / name)
    x, y, z = facts.size
    np.testing.assert_allclose((x, z, y) if facts.up == "+y" else (x, y, z), size, atol=2e-3)
    assert len(mesh.images) == textures
    root = MODELS.resolve()
    assert os.path.commonpath([root, *(Path(file).resolve() for file in facts.files)]) == str(root)
