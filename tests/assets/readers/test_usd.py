"""USD: transforms, instances, primvars, skins and UsdPreviewSurface materials arrive in the mesh."""

import io
import math

import numpy as np
import pytest
from PIL import Image

from viewsphere.assets.load import load_model
from viewsphere.errors import ModelError

pytest.importorskip("pxr")

HEAD = '#usda 1.0\n(\n upAxis = "{up}"\n metersPerUnit = {unit}\n)\n'
SQUARE = """
int[] faceVertexCounts = [4]
int[] faceVertexIndices = [0, 1, 2, 3]
point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
"""
ST = 'texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "vertex")\n'
BOUND = "rel material:binding = </look>\n"


def mesh(name, more="", inside="", shape=SQUARE, about=""):
    return f'def Mesh "{name}" {about} {{\n{shape}\n{more}\n{inside}\n}}\n'


def look(inputs, nodes="", outputs=""):
    return f"""def Material "look" {{
        token outputs:surface.connect = </look/surface.outputs:surface>
        def Shader "surface" {{ uniform token info:id = "UsdPreviewSurface"\n{inputs}\ntoken outputs:surface }}
        def Shader "st" {{ uniform token info:id = "UsdPrimvarReader_float2"
            string inputs:varname = "st"\nfloat2 outputs:result }}
        {nodes} }}\n"""


def picture(more="", file="t.png", name="picture", st="</look/st.outputs:result>"):
    return f"""def Shader "{name}" {{ uniform token info:id = "UsdUVTexture"\nasset inputs:file = @{file}@
        float2 inputs:st.connect = {st}\n{more}\nfloat3 outputs:rgb\nfloat outputs:r\nfloat outputs:g\nfloat outputs:a }}\n"""


def from_picture(name, kind="color3f", output="rgb", node="picture"):
    return f"{kind} inputs:{name}.connect = </look/{node}.outputs:{output}>\n"


def png(write, pixels, name="t.png"):
    file = io.BytesIO()
    Image.fromarray(np.asarray(pixels, np.uint8)).save(file, "PNG")
    return write(name, file.getvalue())


def usda(text, up="Z", unit=1):
    """A file's text; each brace has a line of its own, as the format demands."""
    return HEAD.format(up=up, unit=unit) + text.replace("{", "{\n").replace("}", "\n}\n")


def load(write, text):
    return load_model(write("a.usda", usda(text)))[0]


def area(found):
    a, b, c = (found.vertices[found.triangles[:, i]].astype(np.float64) for i in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def places(found):
    return {
        name: found.vertices[found.triangles[found.triangle_part == i]].reshape(-1, 3).min(axis=0).tolist()
        for i, name in enumerate(found.parts)
    }


def shift(x, y=0, z=0):
    return f'double3 xformOp:translate = ({x}, {y}, {z})\nuniform token[] xformOpOrder = ["xformOp:translate"]\n'


@pytest.mark.parametrize(("up", "axes"), [("Y", ("+y", "+z")), ("Z", ("+z", "-y"))])
def test_axes_and_unit(write, up, axes):
    _, facts = load_model(write("a.usda", usda(mesh("m"), up, 0.0254)))
    assert (facts.up, facts.forward, facts.unit) == (*axes, 0.0254)


def test_a_mesh_below_a_mesh_keeps_its_parents_transform(write):
    text = mesh("outer", shift(10), mesh("inner", shift(0, 5), mesh("innermost", shift(0, 0, 2))))
    assert places(load(write, text)) == {"outer": [10, 0, 0], "inner": [10, 5, 0], "innermost": [10, 5, 2]}


def test_transforms_may_start_anew(write):
    again = 'double3 xformOp:translate = (0, 7, 0)\nuniform token[] xformOpOrder = ["!resetXformStack!", "xformOp:translate"]\n'
    text = f'def Xform "x" {{\n{shift(3)}\n{mesh("kept")}{mesh("reset", again)}\n}}'
    assert places(load(write, text)) == {"kept": [3, 0, 0], "reset": [0, 7, 0]}


def test_what_renders_do_not_show_is_left_out(write):
    text = mesh("shown") + "".join(
        mesh(name, more)
        for name, more in [("hidden", 'token visibility = "invisible"'), ("guide", 'uniform token purpose = "guide"')]
    )
    text += f'def Xform "x" {{ token visibility = "invisible"\n{mesh("below")} }}'
    assert load(write, text).parts == ("shown",)


def test_instances_and_point_instancers(write):
    text = f'class Xform "proto" {{ {mesh("leg", shift(0, 0, 1))} }}\n'
    text += "".join(f'def Xform "i{x}" (instanceable = true\nprepend inherits = </proto>) {{ {shift(x)} }}\n' for x in (2, 4))
    text += f"""def PointInstancer "many" {{
        rel prototypes = [</many/p>]\nint[] protoIndices = [0, 0]\npoint3f[] positions = [(20, 0, 0), (30, 0, 0)]
        float3[] scales = [(1, 1, 1), (2, 2, 2)]\ndef Xform "p" {{ {mesh("arm", shift(1))} }} }}"""
    assert places(load(write, text)) == {"leg": [2, 0, 1], "leg_2": [4, 0, 1], "p": [21, 0, 0], "p_2": [32, 0, 0]}


def test_polygons_are_filled_and_holes_are_not(write):
    shape = """int[] faceVertexCounts = [5, 4, 3]\nint[] faceVertexIndices = [0, 1, 2, 3, 4, 5, 6, 7, 8, 5, 6, 7]
        int[] holeIndices = [1]
        point3f[] points = [(0, 0, 0), (4, 0, 0), (4, 4, 0), (2, 1, 0), (0, 4, 0),
                            (9, 0, 0), (10, 0, 0), (10, 1, 0), (9, 1, 0)]"""
    assert area(load(write, mesh("m", shape=shape))) == pytest.approx(16 - 6 + 0.5)


def test_left_handed_faces_are_turned(write):
    right = load(write, mesh("m"))
    left = load(write, mesh("m", 'uniform token orientation = "leftHanded"'))
    assert right.normals[0].tolist() == [0, 0, 1]
    assert left.normals[0].tolist() == [0, 0, -1]


@pytest.mark.parametrize(
    ("shape", "exact"),
    [
        ('Cube "s" { double size = 2 }', 24),
        ('Sphere "s" { double radius = 2 }', 16 * math.pi),
        ('Cylinder "s" { double radius = 1\ndouble height = 3 }', 8 * math.pi),
        ('Cone "s" { double radius = 3\ndouble height = 4 }', 24 * math.pi),
        ('Capsule "s" { double radius = 1\ndouble height = 3 }', 10 * math.pi),
        ('Plane "s" { double width = 2\ndouble length = 3 }', 6),
    ],
)
def test_implicit_shapes_have_their_area_and_face_outward(write, volume, shape, exact):
    found = load(write, f"def {shape}")
    assert area(found) == pytest.approx(exact, rel=0.01)
    assert volume(found) > 0 or "Plane" in shape


def test_axes_of_implicit_shapes(write):
    for axis, tall in (("X", 0), ("Y", 1), ("Z", 2)):
        found = load(write, f'def Cylinder "s" {{ double height = 6\nuniform token axis = "{axis}" }}')
        assert int(np.argmax(np.ptp(found.vertices, axis=0))) == tall


@pytest.mark.parametrize(
    ("kind", "colors"),
    [
        ("constant", "(1, 0, 0)"),
        ("uniform", "(1, 0, 0)"),
        ("vertex", "(1, 0, 0), (1, 0, 0), (1, 0, 0), (1, 0, 0)"),
        ("faceVarying", "(1, 0, 0), (1, 0, 0), (1, 0, 0), (1, 0, 0)"),
    ],
)
def test_display_colours_of_every_interpolation(write, kind, colors):
    found = load(write, mesh("m", f'color3f[] primvars:displayColor = [{colors}] (interpolation = "{kind}")'))
    np.testing.assert_array_equal(found.colors, [[1, 0, 0, 1]] * len(found.colors))


def test_indexed_coordinates_run_downwards(write):
    more = """texCoord2f[] primvars:st = [(0, 0), (1, 0.25)] (interpolation = "faceVarying")
        int[] primvars:st:indices = [0, 1, 1, 0]\n"""
    found = load(write, mesh("m", more))
    by_corner = {tuple(p): uv for p, uv in zip(found.vertices.tolist(), found.uv0.tolist(), strict=True)}
    assert by_corner == {(0, 0, 0): [0, 1], (1, 0, 0): [1, 0.75], (1, 1, 0): [1, 0.75], (0, 1, 0): [0, 1]}


def test_material_subsets(write):
    shape = """int[] faceVertexCounts = [3, 3]\nint[] faceVertexIndices = [0, 1, 2, 0, 2, 3]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]"""
    subset = """def GeomSubset "half" { uniform token elementType = "face"\nuniform token familyName = "materialBind"
        int[] indices = [1]\nrel material:binding = </look> }"""
    found = load(write, mesh("m", "", subset, shape) + look("color3f inputs:diffuseColor = (0, 1, 0)"))
    names = [found.materials[i].name for i in found.triangle_material]
    assert sorted(names) == ["default", "look"]
    green = found.vertices[found.triangles[names.index("look")]]
    assert green.mean(axis=0).tolist() == pytest.approx([1 / 3, 2 / 3, 0])


def test_constants_of_a_surface(write):
    inputs = """color3f inputs:diffuseColor = (0.1, 0.2, 0.3)\nfloat inputs:metallic = 0.4\nfloat inputs:roughness = 0.6
        float inputs:opacity = 0.7\nfloat inputs:ior = 1.4\nfloat inputs:clearcoat = 0.8
        color3f inputs:emissiveColor = (2, 1, 0)"""
    (material,) = load(write, mesh("m", BOUND) + look(inputs)).materials
    assert material.base_color == pytest.approx((0.1, 0.2, 0.3, 0.7))
    assert (material.metallic, material.roughness, material.ior) == pytest.approx((0.4, 0.6, 1.4))
    assert (material.clearcoat, material.alpha_mode, material.emissive) == (pytest.approx(0.8), "BLEND", (2, 1, 0))


def test_a_plain_texture_is_the_file_itself(write):
    pixels = np.random.default_rng(1).integers(0, 256, (4, 4, 3))
    png(write, pixels)
    wraps = 'token inputs:wrapS = "clamp"\ntoken inputs:wrapT = "mirror"'
    found = load(write, mesh("m", BOUND + ST) + look(from_picture("diffuseColor"), picture(wraps)))
    texture = found.materials[0].base_color_texture
    assert (texture.wrap_s, texture.wrap_t) == ("clamp", "mirror")
    np.testing.assert_array_equal(found.images[texture.image].pixels[..., :3], pixels)


def test_scale_and_bias_of_colours(write):
    png(write, np.full((2, 2, 3), 255))
    more = "float4 inputs:scale = (0.5, 0.25, 0, 1)\nfloat4 inputs:bias = (0, 0.25, 0.1, 0)"
    found = load(write, mesh("m", BOUND + ST) + look(from_picture("diffuseColor"), picture(more)))
    texel = found.images[found.materials[0].base_color_texture.image].pixels[0, 0, :3]
    light = ((texel / 255 + 0.055) / 1.055) ** 2.4
    np.testing.assert_allclose(light, [0.5, 0.5, 0.1], atol=0.005)


def test_scale_and_bias_of_normals(write):
    png(write, np.full((2, 2, 3), (200, 100, 255)))
    usual = 'float4 inputs:scale = (2, 2, 2, 1)\nfloat4 inputs:bias = (-1, -1, -1, 0)\ntoken inputs:sourceColorSpace = "raw"'
    flipped = usual.replace("(2, 2, 2, 1)", "(2, -2, 2, 1)").replace("(-1, -1, -1, 0)", "(-1, 1, -1, 0)")
    for more, expected in ((usual, [200, 100, 255]), (flipped, [200, 155, 255])):
        found = load(write, mesh("m", BOUND + ST) + look(from_picture("normal", "normal3f"), picture(more)))
        assert found.images[found.materials[0].normal_texture.image].pixels[0, 0, :3].tolist() == expected


def test_channels_of_numbers_are_packed(write):
    png(write, np.full((2, 2, 3), (51, 102, 204)))
    inputs = from_picture("roughness", "float", "g") + from_picture("metallic", "float", "r")
    found = load(write, mesh("m", BOUND + ST) + look(inputs, picture('token inputs:sourceColorSpace = "raw"')))
    material = found.materials[0]
    assert found.images[material.metallic_roughness_texture.image].pixels[0, 0, 1:3].tolist() == [102, 51]
    assert (material.roughness, material.metallic) == (1, 1)


def test_opacity_of_another_picture(write):
    png(write, np.full((2, 2, 3), (255, 0, 0)))
    png(write, [[[0] * 3, [255] * 3]], "o.png")
    nodes = picture() + picture('token inputs:sourceColorSpace = "raw"', "o.png", "clear")
    inputs = (
        from_picture("diffuseColor") + from_picture("opacity", "float", "r", "clear") + "float inputs:opacityThreshold = 0.5"
    )
    found = load(write, mesh("m", BOUND + ST) + look(inputs, nodes))
    (material,) = found.materials
    pixels = found.images[material.base_color_texture.image].pixels
    assert (material.alpha_mode, material.alpha_cutoff) == ("MASK", 0.5)
    assert pixels.shape == (2, 2, 4)
    np.testing.assert_array_equal(pixels, [[[255, 0, 0, 0], [255, 0, 0, 255]]] * 2)


def test_texture_transforms(write):
    """Each corner's texel, by USD's own mathematics: scale, then rotate counter-clockwise, then translate, v upwards."""
    png(write, np.full((2, 2, 3), 9))
    turn = """def Shader "turn" { uniform token info:id = "UsdTransform2d"
        float2 inputs:in.connect = </look/st.outputs:result>
        float inputs:rotation = 30\nfloat2 inputs:scale = (2, 3)\nfloat2 inputs:translation = (0.1, 0.2)
        float2 outputs:result }"""
    nodes = turn + picture(st="</look/turn.outputs:result>")
    found = load(write, mesh("m", BOUND + ST) + look(from_picture("diffuseColor"), nodes))
    matrix = found.materials[0].base_color_texture.matrix
    for (x, y, _), (u, v) in zip(found.vertices.tolist(), found.uv0.tolist(), strict=True):
        c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
        expected = (2 * x * c - 3 * y * s + 0.1, 2 * x * s + 3 * y * c + 0.2)
        got = matrix @ [u, v, 1]
        assert (got[0], 1 - got[1]) == pytest.approx(expected)


def test_a_skin_stands_where_its_joints_are(write):
    text = f"""def SkelRoot "root" {{
        def Skeleton "bones" {{ uniform token[] joints = ["a", "a/b"]
            uniform matrix4d[] bindTransforms = [((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1)),
                                                 ((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1))]
            uniform matrix4d[] restTransforms = [((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1)),
                                                 ((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,5,1))] }}
        {
        mesh(
            "skin",
            '''rel skel:skeleton = </root/bones>
            int[] primvars:skel:jointIndices = [0, 0, 1, 1] (elementSize = 1
            interpolation = "vertex")
            float[] primvars:skel:jointWeights = [1, 1, 1, 1] (elementSize = 1
            interpolation = "vertex")''',
            about='(prepend apiSchemas = ["SkelBindingAPI"])',
        )
    } }}"""
    found, facts = load_model(write("a.usda", usda(text)))
    assert sorted(found.vertices.tolist()) == [[0, 0, 0], [0, 1, 5], [1, 0, 0], [1, 1, 5]]
    assert set(found.body_parts) == {"a", "b"}
    assert facts.keypoints.points == {"a": (0, 0, 0), "b": (0, 0, 5)}
    assert facts.keypoints.skeleton == (("a", "b"),)


def test_layers_below_the_folder_are_read_and_others_refused(write):
    write("in/deep/part.usda", usda('def Xform "p" {' + mesh("leg") + "}"))
    write("out.usda", usda('def Xform "p" {' + mesh("leg") + "}"))

    def top(asset):
        text = usda(f'def Xform "a" (prepend references = @{asset}@</p>) {{}}')
        return write("in/top.usda", text)

    found, facts = load_model(top("./deep/part.usda"))
    assert len(found.triangles) == 2
    assert {"top.usda", "part.usda"} <= {file.name for file in facts.files}
    with pytest.raises(ModelError, match=r"out\.usda' is outside the model's folder; set confined: false"):
        load_model(top("../out.usda"))
    assert len(load_model(top("../out.usda"), confined=False)[0].triangles) == 2
    with pytest.raises(ModelError, match=r"no triangles found.*gone.usda' does not exist"):
        load_model(top("./gone.usda"))


@pytest.mark.parametrize("data", ["", "#usda 1.0\ndef Mesh {", b"PXR-USDC" + b"\0" * 90, b"PK\x03\x04", "text"])
@pytest.mark.parametrize("suffix", ["usd", "usda", "usdc", "usdz"])
def test_damaged_files_are_one_clear_error(write, data, suffix):
    with pytest.raises(ModelError, match=rf"hurt\.{suffix}: ") as error:
        load_model(write(f"hurt.{suffix}", data))
    assert "\n" not in str(error.value)


def test_without_the_package_a_warning_names_what_blender_may_lose(write, monkeypatch):
    monkeypatch.setattr("viewsphere.assets.readers.find_spec", lambda _: None)
    warned = list[str]()
    monkeypatch.setattr(
        "viewsphere.assets.readers.blender.reading.read_via_blender", lambda folder: warned.extend(folder.warnings)
    )
    load_model(write("a.usda", usda(mesh("m"))))
    assert "pip install 'viewsphere[usd]'" in warned[0]
