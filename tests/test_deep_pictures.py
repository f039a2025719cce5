"""Pictures of more than eight bits: their files, their values, every format's answer, and their proof."""

import io
import shutil
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from sealing import seal_again
from small import small_recipe
from viewsphere import Dataset, Recipe, generate, plugins, render
from viewsphere.check import check
from viewsphere.codecs.exr import decode_exr, encode_exr, half_floats
from viewsphere.codecs.hdr import decode_hdr, encode_hdr
from viewsphere.codecs.png_tiff import decode_png, encode_png
from viewsphere.codecs.srgb import encoded
from viewsphere.errors import StoreError, UserError
from viewsphere.labels import channels
from viewsphere.labels.shared.drawing.passes import shown_picture
from viewsphere.model.channel import ALL_PICTURES, PICTURES
from viewsphere.model.fields.files import Files
from viewsphere.model.scene import ViewTransform
from viewsphere.planning.plan import plan
from viewsphere.plugins.format import FormatSpec
from viewsphere.preview.frame import draw_sample
from viewsphere.recipe.formats import FormatEntry
from viewsphere.rendering.view import bytes_of_words, picture_of_light, to_words
from viewsphere.report.pictures import layer, layer_names
from viewsphere.run.exports.scope import refusals, scope_of_plan
from viewsphere.run.opening import check_formats, prepare
from viewsphere.store import decode, encode

DEEP = {"png16": "rgb16", "exr": "rgb_linear", "exr32": "rgb_linear", "hdr": "rgb_linear"}
SUFFIX = {"png16": ".png", "exr": ".exr", "exr32": ".exr", "hdr": ".hdr"}
VIEWS = ({}, {"transform": "filmic", "exposure": 1.5}, {"transform": "agx", "tint": 0.4}, {"transform": "raw", "exposure": -1})


def recipe_of(channels=("rgb",), **changes):
    return small_recipe(
        **{"channels": list(channels), "viewpoints": {"azimuth": [30], "elevation": 20, "distance": 1.0}, **changes}
    )


def made(recipe, root):
    generate(recipe, root)
    return Dataset(root)


def light(size=(37, 53)):
    """Light over twelve decades, with black, one bright channel beside dark ones, and a mantissa that rounds up."""
    array = (10 ** np.random.default_rng(2).uniform(-6, 6, (*size, 3))).astype(np.float32)
    array[0, :3] = [[0, 0, 0], [1e6, 1e-3, 0], [0.99999, 0.5, 0.1]]
    return array


@pytest.mark.parametrize("shape", [(1, 1, 3), (17, 5, 3), (33, 20)])
def test_half_floats_come_back_and_openexr_reads_them(shape, tmp_path):
    library = pytest.importorskip("OpenEXR")
    array = np.random.default_rng(1).random(shape).astype(np.float16)
    data = encode_exr(array)
    back = decode_exr(data)
    assert (back.dtype, back.tobytes()) == (np.float16, array.tobytes())
    (tmp_path / "x.exr").write_bytes(data)
    with library.File(str(tmp_path / "x.exr")) as file:
        read = file.channels()["RGB" if array.ndim == 3 else "Z"].pixels
    assert read.dtype == np.float16
    np.testing.assert_array_equal(read, array)


def test_light_beyond_half_floats_becomes_the_largest():
    assert half_floats(np.array([0, 65504, 65519, 65520, 1e9], np.float32)).tolist() == [0, 65504, 65504, 65504, 65504]


def test_radiance_pictures_are_within_their_step_and_opencv_reads_them(tmp_path):
    cv2 = pytest.importorskip("cv2")
    array = light()
    data = encode_hdr(array)
    back = decode_hdr(data)
    assert back.dtype == np.float32
    assert (np.abs(back - array) <= array.max(axis=2, keepdims=True) / 256).all()
    assert encode_hdr(back) == data  # what was stored is stored again without loss
    (tmp_path / "x.hdr").write_bytes(data)
    np.testing.assert_array_equal(cv2.imread(str(tmp_path / "x.hdr"), cv2.IMREAD_UNCHANGED)[..., ::-1], back)


@pytest.mark.parametrize(
    "change", [lambda d: d[:-1], lambda d: d + b"\0", lambda d: d.replace(b"+X 53", b"+X 54"), lambda d: d[9:]]
)
def test_broken_radiance_pictures(change):
    with pytest.raises(UserError, match="HDR: expected"):
        decode_hdr(change(encode_hdr(light())))


def test_sixteen_bit_pictures_are_filtered_and_other_programs_read_them(tmp_path):
    cv2 = pytest.importorskip("cv2")
    ramp = np.linspace(0, 65535, 48 * 64 * 3).reshape(48, 64, 3).astype(np.uint16)
    data = encode_png(ramp, rendered=True)
    assert len(data) < len(encode_png(ramp)) / 2
    np.testing.assert_array_equal(decode_png(data), ramp)
    (tmp_path / "x.png").write_bytes(data)
    np.testing.assert_array_equal(cv2.imread(str(tmp_path / "x.png"), cv2.IMREAD_UNCHANGED)[..., ::-1], ramp)


def test_an_eight_bit_file_is_no_sixteen_bit_picture(tmp_path):
    (tmp_path / "x.png").write_bytes(encode_png(np.zeros((4, 4, 3), np.uint8)))
    with pytest.raises(StoreError, match="expected uint16, found uint8"):
        decode(channels()["rgb16"], tmp_path / "x.png")


def test_words_are_the_srgb_curve_within_half_a_level():
    values = np.linspace(-0.1, 1.1, 300_000).astype(np.float32).reshape(-1, 100, 3)
    exact = encoded(np.clip(values.astype(np.float64), 0, 1)) * 65535
    assert np.abs(to_words(values) - exact).max() < 0.52
    assert len(np.unique(to_words(values))) > 60_000  # far more than 256 levels


@pytest.mark.parametrize("view", VIEWS, ids=str)
def test_the_three_pictures_are_one(view):
    (sample, *_) = render(recipe_of(["rgb", "rgb16", "rgb_linear", "albedo", "shading", "residual"], scene={"view": view}))
    assert (sample.rgb.dtype, sample.rgb16.dtype, sample.rgb_linear.dtype) == (np.uint8, np.uint16, np.float32)
    assert sample.rgb.shape == sample.rgb16.shape == sample.rgb_linear.shape == (72, 96, 3)
    shown = ViewTransform(**view)
    assert sample.finish.view == shown
    assert np.abs(bytes_of_words(sample.rgb16).astype(int) - sample.rgb).max() <= 1
    assert np.abs(picture_of_light(sample.rgb_linear, shown).astype(int) - sample.rgb).max() <= 1
    assert (
        np.abs(picture_of_light(half_floats(sample.rgb_linear).astype(np.float32), shown).astype(int) - sample.rgb).max() <= 1
    )
    np.testing.assert_allclose(sample.albedo * sample.shading + sample.residual, sample.rgb_linear, atol=1e-6)
    assert len(np.unique(sample.rgb16)) > 256


def test_light_knows_no_finish_and_asking_for_more_pictures_changes_none():
    effects = {"shot_noise": 0.5, "depth_of_field": 0.4, "vignetting": 0.8, "jpeg": 0.6}
    plain, noisy, alone = (
        next(iter(render(recipe_of(names, scene={"effects": given}))))
        for names, given in ((ALL_PICTURES, {}), (ALL_PICTURES, effects), (("rgb",), effects))
    )
    np.testing.assert_array_equal(plain.rgb_linear, noisy.rgb_linear)
    np.testing.assert_array_equal(noisy.rgb, alone.rgb)
    assert np.abs(noisy.rgb16.astype(int) - plain.rgb16).max() > 257
    assert np.abs(bytes_of_words(noisy.rgb16).astype(int) - noisy.rgb).max() > 1  # jpeg is the last step, and of bytes


def test_effects_without_jpeg_are_in_sixteen_bits():
    (sample, *_) = render(recipe_of(["rgb", "rgb16"], scene={"effects": {"shot_noise": 0.5, "blur": 0.2, "saturation": 0.4}}))
    assert np.abs(bytes_of_words(sample.rgb16).astype(int) - sample.rgb).max() <= 1


@pytest.mark.parametrize("view", [{"transform": "raw"}, {"transform": "raw", "exposure": 1.0, "temperature_k": 5000}])
def test_a_background_has_the_light_that_raw_shows_as_its_colour(view):
    scene = {"background": "#c85a1e", "ground": False, "view": view}
    (sample, *_) = render(recipe_of(["rgb", "rgb_linear", "instances"], scene=scene))
    shown = picture_of_light(sample.rgb_linear, ViewTransform(**view)).astype(int)
    empty = np.all(sample.rgb == [200, 90, 30], axis=-1)
    assert empty.sum() > 1000
    assert np.abs(shown - sample.rgb)[empty].max() <= 1


@pytest.mark.parametrize("kind", DEEP)
@pytest.mark.slow
def test_the_file_decides_the_picture_in_memory_and_on_disk(kind, tmp_path):
    recipe = recipe_of(files={"rgb": kind}, formats=[])
    name = DEEP[kind]
    assert recipe.channels == (name,)
    (memory, *_) = render(recipe)
    dataset = made(recipe, tmp_path / "out")
    sample = dataset[0]
    assert sample.files[name] == sample.picture_file
    assert sample.files[name].endswith(SUFFIX[kind])
    wanted = decode(channels()[name], tmp_path, lambda: encode(channels()[name], memory.picture, recipe.files))
    assert sample.picture.dtype == memory.picture.dtype == channels()[name].dtype
    np.testing.assert_array_equal(sample.picture, wanted)
    if kind in ("png16", "exr32"):
        np.testing.assert_array_equal(sample.picture, memory.picture)
    assert np.isfinite(sample.picture).all()
    assert Recipe(**recipe.model_dump(exclude_defaults=True)).channels == recipe.channels


def test_a_picture_that_is_listed_stays_beside_rgb(tmp_path):
    recipe = recipe_of(["rgb", "rgb_linear", "rgb16"], files={"rgb": "exr"}, formats=[])
    assert recipe.channels == ("rgb", "rgb_linear", "rgb16")
    sample = made(recipe, tmp_path / "out")[0]
    assert [sample.files[name][-4:] for name in recipe.channels] == [".png", ".exr", ".png"]
    assert sample.picture.dtype == np.uint8


def test_without_a_kind_of_file_light_is_stored_as_geometry():
    assert recipe_of(["rgb_linear"]).files.suffix(channels()["rgb_linear"]) == ".tiff"
    assert recipe_of(["rgb_linear"], files={"geometry": "npz"}).files.suffix(channels()["rgb_linear"]) == ".npz"


def test_pictures_with_alpha_have_eight_bits():
    with pytest.raises(UserError, match=r"files\.rgb: expected png, jpeg, webp, qoi or jxl .* found exr: name rgb_linear"):
        prepare(recipe_of(files={"rgb": "exr"}, scene={"background": "transparent"}))


def test_a_sensor_keeps_the_deep_picture_when_asked_for_rgb():
    rig = {"sensors": {"a": {"channels": ["rgb"]}, "b": {"position": [0.1, 0, 0], "channels": ["depth"]}}}
    first, second, *_ = render(recipe_of(["rgb", "depth"], files={"rgb": "png16"}, rig=rig, formats=[]))
    assert (tuple(first.channels), tuple(second.channels)) == (("rgb16",), ("depth",))


# --- formats ------------------------------------------------------------------------------------------------------------------

HOLDS = {
    "csv": ALL_PICTURES,
    "native": ALL_PICTURES,
    "webdataset": ALL_PICTURES,
    "hdf5": ALL_PICTURES,
    "nerfstudio": (*PICTURES, "rgb_linear"),
}
"""The formats that hold pictures of more than eight bits; all others that need a picture refuse them."""

NAMES = tuple(name for name in plugins.names("formats") if plugins.load(FormatSpec, name).writer is not None)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("kind", ["png16", "exr"])
def test_every_format_s_answer(name, kind):
    spec, entry = plugins.load(FormatSpec, name), FormatEntry(name=name)
    assert spec.pictures == HOLDS.get(name, PICTURES)
    planned = plan(recipe_of(["rgb", "depth", "instances"], files={"rgb": kind}, formats=[]))
    problems = list(refusals(spec, entry, scope_of_plan(planned, planned.recipe.channels)))
    deep = [problem for problem in problems if problem.startswith("expected pictures of eight bits")]
    needs = spec.channels is None or "rgb" in spec.channels or name == "hdf5"
    assert len(deep) == (needs and DEEP[kind] not in HOLDS.get(name, PICTURES))
    for problem in deep:
        assert problem == (
            f"expected pictures of eight bits, as its readers read no others; found {DEEP[kind]}: add rgb to channels, beside "
            f"{DEEP[kind]}, or leave {name} out of formats"
        )
    beside = plan(recipe_of(["rgb", DEEP[kind], "depth", "instances"], files={"rgb": kind}, formats=[]))
    again = refusals(spec, entry, scope_of_plan(beside, beside.recipe.channels))
    assert not [problem for problem in again if problem.startswith("expected pictures of eight bits")]


def test_formats_refuse_before_anything_is_rendered(tmp_path):
    with pytest.raises(UserError, match=r"formats: format coco: expected pictures of eight bits, .* found rgb_linear"):
        generate(recipe_of(files={"rgb": "exr"}, formats=["coco"]), tmp_path / "out")
    assert not (tmp_path / "out").exists()
    planned = plan(recipe_of(["rgb", "depth"], files={"rgb": "exr"}))
    with pytest.raises(UserError, match="format nerfstudio: expected kind: instant-ngp"):
        check_formats(planned, [FormatEntry(name="nerfstudio")], planned.recipe.channels)


@pytest.mark.parametrize("kind", ["png16", "exr", "hdr"])
@pytest.mark.slow
def test_formats_that_hold_deep_pictures_give_them_back(kind, tmp_path):
    h5py = pytest.importorskip("h5py")
    formats = ["native", "webdataset", "hdf5"] + [{"nerfstudio": {"kind": "instant-ngp"}}] * (kind != "png16")
    dataset = made(
        recipe_of(["rgb", "depth", "instances", "categories"], files={"rgb": kind}, formats=formats), tmp_path / "out"
    )
    sample, name = dataset[0], DEEP[kind]
    stored = dataset.read(sample.files[name])
    assert stored in [file.read_bytes() for file in (tmp_path / "out/native").rglob(f"RGB/*{SUFFIX[kind]}")]
    (container,) = (tmp_path / "out/hdf5").rglob("0.hdf5")
    with h5py.File(container) as file:
        assert file["colors"].dtype == sample.picture.dtype
        np.testing.assert_array_equal(file["colors"][()], sample.picture)
    array = io.BytesIO()
    np.save(array, sample.picture)
    assert array.getvalue() in next((tmp_path / "out/webdataset").glob("*.tar")).read_bytes()
    if kind != "png16":
        frames = sorted((tmp_path / "out/nerfstudio").rglob("images/*.exr"))
        assert len(frames) == 2
        np.testing.assert_array_equal(decode_exr(frames[0].read_bytes()).astype(np.float32), half_floats(sample.picture))
    assert check(Dataset(dataset.root)).ok


# --- proofs and pages ---------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def proved(tmp_path_factory):
    """The three pictures of two frames, with light as half floats."""
    recipe = recipe_of(["rgb", "rgb16", "rgb_linear", "depth", "instances"], files={"rgb": "exr"}, formats=[])
    return made(recipe, tmp_path_factory.mktemp("deep") / "out").root


def failures(root):
    seal_again(root)
    report = check(Dataset(root), repaint=None)
    return {finding.check for finding in report.findings}, " ".join(finding.message for finding in report.findings)


@pytest.mark.parametrize("kind", ["exr", "exr32", "hdr"])
@pytest.mark.slow
def test_check_proves_that_they_are_one_picture(kind, tmp_path):
    recipe = recipe_of(["rgb", "rgb16", "rgb_linear", "depth", "instances"], files={"rgb": kind}, formats=[])
    assert check(made(recipe, tmp_path / "out")).ok


def test_pictures_with_effects_over_a_background_are_proved_as_far_as_they_agree(tmp_path):
    scene = {"background": "#0ac85a", "effects": {"jpeg": 0.5, "blur": 0.1}}
    recipe = recipe_of(["rgb", "rgb16", "rgb_linear"], files={"rgb": "hdr"}, formats=[], scene=scene)
    assert check(made(recipe, tmp_path / "out")).ok


@pytest.mark.parametrize(("name", "change"), [("rgb16", 700), ("rgb_linear", 0.05), ("rgb", 3)])
def test_a_changed_pixel_of_one_depth_is_found_by_the_others(proved, tmp_path, name, change):
    root = shutil.copytree(proved, tmp_path / "out")
    dataset = Dataset(root)
    sample = dataset[0]
    array = np.array(sample.channels[name])
    dark = int(np.argmin(array[..., 0].max(axis=1)))
    array[dark, 3] = array[dark, 3] + np.array(change).astype(array.dtype)
    dataset.path(sample.files[name]).write_bytes(encode(channels()[name], array, Files(rgb="exr")))
    checks, message = failures(root)
    assert {"files", "repaint"} <= checks
    assert "1 other pixels: at pixel (3, " in message


@pytest.mark.parametrize("value", [np.nan, np.inf, -1])
def test_light_that_is_no_light_is_found(proved, tmp_path, value):
    dataset = Dataset(shutil.copytree(proved, tmp_path / "out"))
    array = np.array(dataset[0].rgb_linear)
    array[5, 5] = value
    dataset.path(dataset[0].files["rgb_linear"]).write_bytes(encode_exr(array.astype(np.float16)))
    checks, message = failures(dataset.root)
    assert "files" in checks
    assert "rgb_linear: expected light, 0 or more" in message


def test_a_sixteen_bit_picture_alone_is_proved_by_painting_again(tmp_path):
    dataset = made(recipe_of(files={"rgb": "png16"}, formats=[]), tmp_path / "out")
    assert check(dataset).ok
    array = np.array(dataset[0].rgb16)
    array[2, 2, 1] ^= 1
    dataset.path(dataset[0].files["rgb16"]).write_bytes(encode_png(array, rendered=True))
    assert failures(dataset.root)[0] == {"repaint"}


def test_previews_and_reports_show_them_as_the_recipe_views_them(tmp_path):
    scene = {"view": {"transform": "agx", "exposure": 1.0}}
    (seen, *_) = render(recipe_of(scene=scene))
    for kind in ("png16", "exr"):
        sample = made(recipe_of(files={"rgb": kind}, formats=[], scene=scene), tmp_path / kind)[0]
        assert np.abs(shown_picture(sample).astype(int) - seen.rgb).max() <= 1
        assert np.abs(draw_sample(sample).astype(int) - seen.rgb).max() <= 1
        assert layer_names(sample) == ["rgb"]
        scale = SimpleNamespace(width=96, layer_width=96, quality=95, quick=False)
        with Image.open(io.BytesIO(layer(sample, "rgb", scale).webp)) as image:
            assert np.abs(np.asarray(image).astype(int) - seen.rgb).mean() < 4


def test_point_clouds_have_colours_of_eight_bits_only():
    with_bytes, with_light = (next(iter(render(recipe_of(["rgb", "depth"], files={"rgb": kind})))) for kind in ("png", "exr"))
    assert with_bytes.point_cloud().colors.dtype == np.uint8
    assert with_light.point_cloud().colors is None


@pytest.mark.slow
@pytest.mark.usefixtures("blender")
@pytest.mark.parametrize("engine", [{"name": "cycles", "quality": "draft"}, "eevee", "workbench"], ids=str)
def test_blender_s_engines_paint_them_too(engine):
    names, scene = ["rgb", "rgb16", "rgb_linear"], {"ground": False, "view": {"transform": "agx"}}
    (sample, *_) = render(recipe_of(names, engine=engine, scene=scene, formats=[]))
    assert np.abs(bytes_of_words(sample.rgb16).astype(int) - sample.rgb).max() <= 1
    assert np.abs(picture_of_light(sample.rgb_linear, sample.finish.view).astype(int) - sample.rgb).max() <= 1
    assert len(np.unique(sample.rgb16)) > 256


@pytest.mark.parametrize(("kind", "deep", "suffix"), [("exr", "rgb_linear", ".exr"), ("png16", "rgb16", ".png")])
@pytest.mark.slow
def test_a_deep_picture_that_channels_name_stays_beside_a_transparent_background(tmp_path, kind, deep, suffix):
    """The refusal of the recipe without it advises this."""
    given = {"scene": {"background": "transparent"}, "files": {"rgb": kind}, "viewpoints": {"distance": 1.0}, "formats": []}
    with pytest.raises(UserError, match=f"name {deep} in channels"):
        plan(small_recipe(channels=["rgb"], **given))
    generate(small_recipe(channels=["rgb", deep], **given), tmp_path / "out", workers=0)
    dataset = Dataset(tmp_path / "out")
    sample = dataset[0]
    assert set(sample.files) == {"rgba", deep} and sample.files[deep].endswith(suffix)
    assert sample.channels["rgba"].shape[2] == 4 and sample.channels[deep].shape[2] == 3
    assert check(dataset, rays=False, repaint=None).ok
