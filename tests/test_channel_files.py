"""A recipe's `files`: what is written comes back exactly where it is lossless, and other programs read it."""

import io
import json
import re
import sys

import numpy as np
import pytest
from PIL import Image

import viewsphere
from small import small_recipe
from viewsphere import Dataset, Recipe, generate
from viewsphere.check import check
from viewsphere.codecs.npz import encode_npz
from viewsphere.codecs.palette import palette
from viewsphere.errors import MissingExtraError, RecipeError, StoreError
from viewsphere.labels import channels
from viewsphere.model.fields.files import Files
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.datasets.merging import merge
from viewsphere.store import check_codecs, decode, depth_step, encode

MASKS, GEOMETRY = ("instances", "categories", "parts"), ("normals", "coordinates", "triangles", "barycentrics")
LOSSLESS = [
    *(("rgb", {"rgb": kind}) for kind in ("png", "webp", "qoi", "jxl")),
    *(("rgba", {"rgba": kind}) for kind in ("png", "webp", "qoi", "jxl")),
    *(("depth", {"depth": kind}) for kind in ("tiff", "exr", "npz")),
    *((name, {"masks": kind}) for name in MASKS for kind in ("png16", "png8")),
    *((name, {"geometry": kind}) for name in GEOMETRY for kind in ("tiff", "exr", "npz")),
]
ENDINGS = {"png8": "png", "png16": "png", "jpeg": "jpg"}


def picture(name, size=(48, 64)):
    """Flat areas, a ramp and noise; numbers have empty pixels."""
    channel, rng = channels()[name], np.random.default_rng(4)
    array = rng.integers(0, 200, channel.shape(*size)).astype(channel.dtype)
    array[:20] = array[0, 0]
    array[20:40] = np.arange(size[1]).reshape((-1,) + (1,) * (array.ndim - 2))
    if np.issubdtype(channel.dtype, np.floating):
        array = (array / 7).astype(channel.dtype)
        array[5:9] = channel.empty
    return array


def needs_codecs(kinds):
    if set(kinds.values()) & {"qoi", "jxl"}:
        pytest.importorskip("imagecodecs")


@pytest.mark.parametrize(("name", "kinds"), LOSSLESS, ids=str)
def test_lossless_files_come_back(name, kinds, tmp_path):
    needs_codecs(kinds)
    files, array = Files(**kinds), picture(name)
    file = tmp_path / f"x{files.suffix(channels()[name])}"
    file.write_bytes(encode(channels()[name], array, files))
    kind = next(iter(kinds.values()))
    assert file.suffix == f".{ENDINGS.get(kind, kind)}"
    back = decode(channels()[name], file)
    assert (back.dtype, back.shape) == (array.dtype, array.shape)
    assert back.tobytes() == array.tobytes()


@pytest.mark.parametrize("kind", ["png", "webp", "qoi"])
@pytest.mark.parametrize("name", ["rgb", "rgba"])
def test_pillow_reads_pictures(name, kind):
    needs_codecs({name: kind})
    array = picture(name)
    with Image.open(io.BytesIO(encode(channels()[name], array, Files(**{name: kind})))) as image:
        np.testing.assert_array_equal(np.asarray(image), array)


@pytest.mark.parametrize(("kind", "quality", "most"), [("jpeg", None, 8), ("jpeg", 60, 20), ("webp", 90, 12), ("jxl", 90, 12)])
def test_lossy_pictures_are_near_and_better_ones_nearer(kind, quality, most, tmp_path):
    needs_codecs({"rgb": kind})
    y, x = np.mgrid[:48, :64]
    array = np.stack([3 * x, 4 * y, 2 * x + 2 * y], -1).astype(np.uint8)

    def off(value):
        (tmp_path / "x").write_bytes(encode(channels()["rgb"], array, Files(rgb=kind, quality=value)))
        return np.abs(decode(channels()["rgb"], tmp_path / "x").astype(int) - array).mean()

    assert 0 < off(quality) < most
    assert off(quality) < off(10)


def test_jpeg_is_not_subsampled():
    with Image.open(io.BytesIO(encode(channels()["rgb"], picture("rgb"), Files(rgb="jpeg")))) as image:
        assert [part[1:3] for part in image.layer] == [(1, 1)] * 3


def test_depth_in_steps(tmp_path):
    depth = np.array([[np.inf, 0.0004, 0.0006, 1.2344, 1.2346, 65.535, 70.0, -2.0, 2e9]], np.float32)
    data = encode(channels()["depth"], depth, Files(depth="png16"))
    with Image.open(io.BytesIO(data)) as image:
        assert image.mode == "I;16"
        assert np.asarray(image).tolist() == [[0, 1, 1, 1234, 1235, 65535, 65535, 0, 65535]]
    (tmp_path / "x.png").write_bytes(data)
    back = decode(channels()["depth"], tmp_path / "x.png")
    expected = [np.inf, 0.001, 0.001, 1.234, 1.235, 65.535, 65.535, np.inf, 65.535]
    np.testing.assert_allclose(back, [expected], rtol=1e-6)
    assert depth_step(data) == pytest.approx(0.001)


@pytest.mark.parametrize("unit", [1e-4, 0.002, 0.25, 1 / 3])
def test_a_depth_file_knows_its_unit(unit, tmp_path):
    depth = picture("depth")
    data = encode(channels()["depth"], depth, Files(depth="png16", depth_unit=unit))
    (tmp_path / "x.png").write_bytes(data)
    back, seen = decode(channels()["depth"], tmp_path / "x.png"), np.isfinite(depth) & (depth > unit) & (depth < 60000 * unit)
    assert seen.any()
    np.testing.assert_array_equal(np.isinf(back), np.isinf(depth) | (depth == 0))
    assert np.abs(back[seen] - depth[seen]).max() <= unit / 2 * (1 + 1e-5) + 2e-6
    assert depth_step(data) == pytest.approx(unit, rel=1e-12)


def test_a_16_bit_png_that_names_no_unit_is_no_depth(tmp_path):
    Image.fromarray(np.full((4, 4), 700, np.uint16)).save(tmp_path / "x.png")
    with pytest.raises(StoreError, match=r"x\.png: .*pCAL"):
        decode(channels()["depth"], tmp_path / "x.png")


def test_exact_depth_has_no_step():
    assert depth_step(encode(channels()["depth"], picture("depth"))) == 0


def test_indexed_masks_are_ids_and_distinct_colours(tmp_path):
    ids = np.arange(256, dtype=np.int32).reshape(16, 16)
    data = encode(channels()["instances"], ids, Files(masks="png8"))
    with Image.open(io.BytesIO(data)) as image:
        assert image.mode == "P"
        np.testing.assert_array_equal(np.asarray(image), ids)
        colors = np.asarray(image.convert("RGB")).reshape(-1, 3)
    np.testing.assert_array_equal(colors, palette())
    assert len(np.unique(colors, axis=0)) == 256
    assert colors[:4].tolist() == [[0, 0, 0], [128, 0, 0], [0, 128, 0], [128, 128, 0]]
    ids[0, 0] = 256
    (tmp_path / "x.png").write_bytes(encode(channels()["instances"], ids, Files(masks="png8")))
    with Image.open(tmp_path / "x.png") as image:
        assert image.mode == "I;16"
    np.testing.assert_array_equal(decode(channels()["instances"], tmp_path / "x.png"), ids)


@pytest.mark.parametrize("number", [-1, 65536])
@pytest.mark.parametrize("masks", ["png8", "png16"])
def test_ids_that_no_mask_can_hold_are_refused(number, masks):
    with pytest.raises(StoreError, match=rf"parts.*65535.*{number}"):
        encode(channels()["parts"], np.full((3, 3), number, np.int32), Files(masks=masks))


@pytest.mark.parametrize(("name", "kinds"), [*LOSSLESS, ("rgb", {"rgb": "jpeg"}), ("depth", {"depth": "png16"})], ids=str)
def test_truncated_files_are_named_with_a_way_out(name, kinds, tmp_path):
    needs_codecs(kinds)
    data = encode(channels()[name], picture(name), Files(**kinds))
    file = tmp_path / "shot" / name / f"x{Files(**kinds).suffix(channels()[name])}"
    file.parent.mkdir(parents=True)
    for cut in (0, 5, len(data) // 2, len(data) - 30):
        file.write_bytes(data[:cut])
        with pytest.raises(StoreError, match=f"{re.escape(str(file))}: expected a readable .*delete .*shot and render again"):
            decode(channels()[name], file)


def test_a_file_of_another_channel_is_refused(tmp_path):
    (tmp_path / "x.tiff").write_bytes(encode(channels()["triangles"], picture("triangles")))
    with pytest.raises(StoreError, match="expected float32, found int32"):
        decode(channels()["depth"], tmp_path / "x.tiff")


def test_a_missing_codec_names_the_extra(tmp_path, monkeypatch):
    (tmp_path / "x.qoi").write_bytes(b"qoif" + bytes(17) + b"\1")
    monkeypatch.setitem(sys.modules, "imagecodecs", None)
    for kind in ("qoi", "jxl"):
        with pytest.raises(MissingExtraError, match=r"viewsphere\[codecs\]"):
            encode(channels()["rgb"], picture("rgb"), Files(rgb=kind))
        with pytest.raises(MissingExtraError, match=rf"files.rgb: {kind}.*viewsphere\[codecs\]"):
            generate(small_recipe(files={"rgb": kind}), tmp_path / "out")
    with pytest.raises(MissingExtraError, match=r"x\.qoi: QOI.*viewsphere\[codecs\]"):
        decode(channels()["rgb"], tmp_path / "x.qoi")
    check_codecs(["depth"], Files(rgb="jxl"))
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{rgb: jpg}", r"files.rgb: 'jpg' is unknown; did you mean 'jpeg'.*png, jpeg,"),
        ("{rgba: jpeg}", r"files.rgba: 'jpeg' is unknown. Valid: png, webp"),
        ("{rgb: jpeg, quality: 0}", r"files.quality: expected a number .*1; found 0"),
        ("{rgb: jpeg, quality: 101}", r"files.quality: expected a number .*100; found 101"),
        ("{rgb: jpeg, quality: 80.5}", r"files.quality: expected a whole number; found 80.5"),
        ("{quality: 80}", r"files: expected quality only beside jpeg, webp, jxl; found rgb: png"),
        ("{depth: png}", r"files.depth: 'png' is unknown; did you mean 'png16'. Valid: tiff, exr, npz, png16"),
        ("{depth: png16, depth_unit: 0}", r"files.depth_unit: expected a number greater than 0; found 0"),
        ("{depth_unit: 0.001}", r"files: expected depth_unit only beside depth: png16"),
        ("{masks: png4}", r"files.masks: 'png4' is unknown; did you mean 'png8'. Valid: png16, png8"),
        ("{geometry: hdf5}", r"files.geometry: 'hdf5' is unknown. Valid: tiff, exr, npz"),
        ("{mask: png8}", r"files.mask: 'mask' is unknown; did you mean 'masks'"),
        ("jpeg", r"files: expected a mapping; found 'jpeg'"),
    ],
)
def test_mistakes_are_said_with_their_line(text, message, tmp_path):
    file = tmp_path / "recipe.yaml"
    file.write_text(f"models: [{{source: zoo:car}}]\nviewpoints: {{distance: 5}}\nfiles: {text}\n")
    with pytest.raises(RecipeError, match=rf"recipe\.yaml:3: {message}"):
        Recipe.load(file)


OTHERS = {"rgb": "jpeg", "quality": 90, "depth": "png16", "depth_unit": 0.0005, "masks": "png8", "geometry": "npz"}
FEW = ["rgb", "depth", "instances", "normals", "triangles"]


@pytest.fixture(scope="module")
def other_run(tmp_path_factory):
    out = tmp_path_factory.mktemp("files") / "out"
    generate(small_recipe(files=OTHERS, channels=FEW), out)
    return out


def test_another_choice_of_files_is_the_same_data_set(small_run, other_run):
    plain, other = viewsphere.open(small_run), viewsphere.open(other_run)
    assert len(plain) == len(other) == 12
    assert other.recipe["files"]["rgb"] == "jpeg"
    for a, b in zip(plain, other, strict=True):
        assert [b.files[name].rpartition(".")[2] for name in FEW] == ["jpg", "png", "png", "npz", "npz"]
        for name in ("instances", "normals", "triangles"):
            np.testing.assert_array_equal(a.channels[name], b.channels[name])
        assert (a.objects[0].rle, a.objects[0].box2d) == (b.objects[0].rle, b.objects[0].box2d)
        np.testing.assert_array_equal(np.isinf(a.depth), np.isinf(b.depth))
        near = a.depth < 32
        assert 0 < np.abs(a.depth[near] - b.depth[near]).max() < 0.000251
        assert 0 < np.abs(a.rgb.astype(int) - b.rgb).mean() < 3


def test_it_is_checked_and_its_exports_name_its_files(other_run):
    report = check(Dataset(other_run))
    assert not report.findings
    assert report.checked["coco"] and report.checked["native"]
    images = json.loads((other_run / "coco/annotations/instances_train.json").read_text())["images"]
    assert images
    for image in images:
        assert image["file_name"].endswith(".jpg")
        with Image.open(other_run / "coco/images/train" / image["file_name"]) as picture_:
            assert (picture_.format, picture_.size) == ("JPEG", (image["width"], image["height"]))
    poses = json.loads((other_run / "native/dataset1.json").read_text())["poses"]
    entry = next(iter(poses["0"]["vehicles_rendered"].values()))
    assert (entry["path_rgb"][-4:], entry["path_depth"][-4:]) == (".jpg", ".png")


def test_it_is_imported_and_merged(small_run, other_run, tmp_path):
    import_dataset("native", other_run / "native", tmp_path / "in")
    assert "depth" in Dataset(tmp_path / "in").plan.channels
    found, made = Dataset(tmp_path / "in"), Dataset(other_run)
    for sample in found:
        twin = next(s for s in made if s.pose.index == sample.pose.index and s.objects[0].key == sample.objects[0].key)
        np.testing.assert_array_equal(sample.depth, twin.depth)
        np.testing.assert_array_equal(sample.rgb, twin.rgb)
    both = merge([small_run, other_run], tmp_path / "both", mixed=True)
    assert {s.files["rgb"].rpartition(".")[2] for s in both} == {"png", "jpg"}
    np.testing.assert_array_equal(both[0].depth, Dataset(small_run)[0].depth)
    np.testing.assert_array_equal(both[12].depth, made[0].depth)


@pytest.mark.slow
def test_appended_frames_and_channels_may_have_other_files(tmp_path):
    out, poses = tmp_path / "out", {"azimuth": [0, 120], "elevation": 15, "distance": 1.0}
    generate(small_recipe(channels=["rgb", "depth"], viewpoints=poses), out, formats=["coco"])
    more = {**poses, "azimuth": [0, 120, 240]}
    kinds = {"rgb": "jpeg", "depth": "exr", "geometry": "exr"}
    recipe = small_recipe(channels=["rgb", "depth", "normals"], viewpoints=more, files=kinds)
    generate(recipe, out, append=True, formats=["coco"])
    samples = list(Dataset(out))
    assert [s.files["rgb"][-4:] for s in samples] == [".png"] * 4 + [".jpg"] * 2
    assert [s.files["depth"][-4:] for s in samples] == ["tiff"] * 4 + [".exr"] * 2
    assert {s.files["normals"][-4:] for s in samples} == {".exr"}
    for sample in samples:
        np.testing.assert_array_equal(np.isfinite(sample.depth), np.linalg.norm(sample.normals, axis=-1) > 0.5)
    assert not check(Dataset(out)).findings


@pytest.mark.parametrize(("name", "kinds"), [*LOSSLESS, ("rgb", {"rgb": "jpeg"}), ("depth", {"depth": "png16"})], ids=str)
def test_spoilt_files_are_arrays_or_store_errors(name, kinds, tmp_path):
    needs_codecs(kinds)
    data, rng = encode(channels()[name], picture(name), Files(**kinds)), np.random.default_rng(1)
    refused = 0
    for i in range(30):
        spoilt = bytearray(data)
        for place in rng.integers(0, len(data) if i % 2 else min(len(data), 400), 2):
            spoilt[place] ^= int(rng.integers(1, 256))
        (tmp_path / "x").write_bytes(spoilt)
        try:
            decode(channels()[name], tmp_path / "x")
        except StoreError:
            refused += 1
    assert refused or "qoi" in kinds.values()  # which has no checksum


@pytest.mark.parametrize("name", ["tracks", "lidar"])
def test_rows_of_other_fields_are_told(name, tmp_path):
    """As another version may have written them."""
    fields = np.dtype(channels()[name].dtype).descr[:-1]
    (tmp_path / "x.npz").write_bytes(encode_npz(np.zeros(3, fields), name))
    with pytest.raises(StoreError, match=r"expected \[.*, found \["):
        decode(channels()[name], tmp_path / "x.npz")
