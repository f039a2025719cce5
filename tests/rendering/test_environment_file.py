"""Pictures of the whole sphere: what is read, mended and refused."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from viewsphere.errors import UserError
from viewsphere.rendering.sky import environment_file
from viewsphere.rendering.sky.environment_file import read_environment

HDRI = Path(__file__).parents[3] / "shared" / "models" / "hdri"


def exr(path: Path, channels, compression=OpenEXR.ZIP_COMPRESSION) -> Path:
    with OpenEXR.File({"compression": compression, "type": OpenEXR.scanlineimage}, channels) as file:
        file.write(str(path))
    return path


def rgbe(pixels: np.ndarray) -> np.ndarray:
    """Ward's four bytes a texel."""
    mantissa, exponent = np.frexp(pixels.max(axis=-1))
    scale = np.where(pixels.max(axis=-1) > 0, mantissa * 256 / np.maximum(pixels.max(axis=-1), 1e-30), 0)
    out = np.zeros((*pixels.shape[:2], 4), np.uint8)
    out[..., :3] = (pixels * scale[..., None]).astype(np.uint8)
    out[..., 3] = np.where(pixels.max(axis=-1) > 0, exponent + 128, 0)
    return out


def hdr(path: Path, texels: np.ndarray, encoding="flat", size="-Y {0} +X {1}", header=b"FORMAT=32-bit_rle_rgbe\n") -> Path:
    """A Radiance file; runs: each channel of a row as runs; old: repeats of whole texels."""
    rows, columns = texels.shape[:2]
    body = b""
    for row in texels:
        if encoding == "flat":
            body += row.tobytes()
        elif encoding == "runs":
            body += struct.pack(">BBH", 2, 2, columns)
            for c in range(4):
                j = 0
                while j < columns:
                    same = 1
                    while j + same < columns and same < 127 and row[j + same, c] == row[j, c]:
                        same += 1
                    body += bytes([128 + same, row[j, c]]) if same > 2 else b"\x01" + bytes([row[j, c]])
                    j += same if same > 2 else 1
        else:
            j = 0
            while j < columns:
                same = 1
                while j + same < columns and same < 200 and (row[j + same] == row[j]).all():
                    same += 1
                body += row[j].tobytes() + (bytes([1, 1, 1, same - 1]) if same > 1 else b"")
                j += same
    path.write_bytes(b"#?RADIANCE\n" + header + b"\n" + size.format(rows, columns).encode() + b"\n" + body)
    return path


def random_pixels(rng, rows=16, columns=32):
    pixels = np.exp(rng.normal(size=(rows, columns, 3)) * 3).astype(np.float32)
    pixels[:, 5:15] = pixels[:, 5:6]
    return pixels


@pytest.mark.parametrize("encoding", ["flat", "runs", "old"])
def test_radiance(tmp_path, encoding):
    pixels = random_pixels(np.random.default_rng(0))
    pixels[3, 3] = 0
    found = read_environment(hdr(tmp_path / "a.hdr", rgbe(pixels), encoding))
    assert found.notes == ()
    error = abs(found.pixels - pixels).max(axis=-1) / np.maximum(pixels.max(axis=-1), 1e-9)
    assert error.max() < 1 / 256
    assert (found.pixels[3, 3] == 0).all()


def test_radiance_orientations_and_exposure(tmp_path):
    pixels = random_pixels(np.random.default_rng(1))
    upright = read_environment(hdr(tmp_path / "a.hdr", rgbe(pixels))).pixels
    flipped = read_environment(hdr(tmp_path / "b.hdr", rgbe(pixels[::-1, ::-1]), size="+Y {0} -X {1}")).pixels
    assert (flipped == upright).all()
    header = b"FORMAT=32-bit_rle_rgbe\nEXPOSURE=2\nEXPOSURE= 4.0\n"
    exposed = read_environment(hdr(tmp_path / "c.hdr", rgbe(pixels), header=header)).pixels
    assert exposed == pytest.approx(upright / 8)
    across = read_environment(hdr(tmp_path / "d.hdr", rgbe(pixels.transpose(1, 0, 2)), size="+X {0} -Y {1}")).pixels
    assert (across == upright).all()


@pytest.mark.parametrize("kind", [np.float16, np.float32])
def test_exr(tmp_path, kind):
    pixels = random_pixels(np.random.default_rng(2)).astype(kind)
    found = read_environment(exr(tmp_path / "a.exr", {"RGB": pixels}))
    assert (found.pixels == pixels.astype(np.float32)).all()
    assert found.pixels.dtype == np.float32


def test_exr_layers_alpha_and_grey(tmp_path):
    pixels = random_pixels(np.random.default_rng(3))
    planes = {f"ViewLayer.Combined.{c}": np.ascontiguousarray(pixels[..., k]) for k, c in enumerate("RGB")}
    planes["ViewLayer.Combined.A"] = np.ones((16, 32), np.float32)
    assert (read_environment(exr(tmp_path / "l.exr", planes)).pixels == pixels).all()
    grey = read_environment(exr(tmp_path / "y.exr", {"Y": np.ascontiguousarray(pixels[..., 0])})).pixels
    assert (grey == pixels[..., :1]).all()
    with pytest.raises(UserError, match="found channels Z; it needs R, G and B"):
        read_environment(exr(tmp_path / "z.exr", {"Z": np.ascontiguousarray(pixels[..., 0])}))


def test_content_decides_not_the_name(tmp_path):
    pixels = random_pixels(np.random.default_rng(4))
    path = exr(tmp_path / "a.exr", {"RGB": pixels}).rename(tmp_path / "b.hdr")
    assert (read_environment(path).pixels == pixels).all()


def test_ordinary_pictures_are_srgb_with_a_note(tmp_path):
    Image.new("RGB", (32, 16), (255, 128, 0)).save(tmp_path / "a.png")
    found = read_environment(tmp_path / "a.png")
    assert found.pixels[5, 5] == pytest.approx([1.0, 0.2158605, 0.0], abs=1e-5)
    assert len(found.notes) == 1 and "8 bits" in found.notes[0]
    Image.new("L", (32, 16), 128).save(tmp_path / "g.png")
    assert read_environment(tmp_path / "g.png").pixels[0, 0] == pytest.approx(0.2158605, abs=1e-5)


def test_a_few_broken_texels_are_mended_and_said(tmp_path):
    pixels = np.full((64, 128, 3), 2.0, np.float32)
    pixels[1, 1], pixels[2, 2, 0], pixels[3, 3, 1], pixels[4, 4] = np.nan, np.inf, -np.inf, -3
    found = read_environment(exr(tmp_path / "a.exr", {"RGB": pixels}))
    assert (found.pixels[1, 1] == 0).all()
    assert found.pixels[2, 2, 0] == 2
    assert found.pixels[3, 3, 1] == 0 and (found.pixels[4, 4] == 0).all()
    assert any("3 texels" in note for note in found.notes) and any("negative" in note for note in found.notes)
    assert np.isfinite(found.pixels).all() and (found.pixels >= 0).all()


def test_many_broken_texels_are_refused(tmp_path):
    pixels = np.ones((64, 128, 3), np.float32)
    pixels[:4] = np.nan
    with pytest.raises(UserError, match="512 of 8,192 texels that are no numbers"):
        read_environment(exr(tmp_path / "a.exr", {"RGB": pixels}))


@pytest.mark.parametrize("shape", [(16, 16), (16, 48), (1, 2)])
def test_other_proportions_are_refused(tmp_path, shape):
    with pytest.raises(UserError, match="twice as wide as high"):
        read_environment(exr(tmp_path / "a.exr", {"RGB": np.ones((*shape, 3), np.float32)}))
    with pytest.raises(UserError, match="twice as wide as high"):
        read_environment(hdr(tmp_path / "a.hdr", rgbe(np.ones((*shape, 3), np.float32))))


@pytest.mark.parametrize("size", [(70_000, 35_000), (9_999_999, 9_999_999)])
def test_more_than_100_megapixels_are_refused_before_they_are_read(tmp_path, size):
    (tmp_path / "a.hdr").write_bytes(b"#?RADIANCE\n\n-Y %d +X %d\n" % size[::-1])
    with pytest.raises(UserError, match="at most 100 megapixels") as error:
        read_environment(tmp_path / "a.hdr")
    assert "\n" not in str(error.value)


def test_large_pictures_are_reduced(tmp_path, monkeypatch):
    monkeypatch.setattr(environment_file, "SHARPEST", 64)
    pixels = random_pixels(np.random.default_rng(5), 96, 192)
    found = read_environment(exr(tmp_path / "a.exr", {"RGB": pixels})).pixels
    assert found.shape == (32, 64, 3)
    assert found == pytest.approx(pixels.reshape(32, 3, 64, 3, 3).mean(axis=(1, 3)), rel=1e-4)


def test_truncated_files_are_refused_in_one_line(tmp_path):
    pixels = random_pixels(np.random.default_rng(6))
    files = [
        exr(tmp_path / "a.exr", {"RGB": pixels}),
        *(hdr(tmp_path / f"{e}.hdr", rgbe(pixels), e) for e in ("flat", "runs", "old")),
    ]
    for path in files:
        data = path.read_bytes()
        for keep in (len(data) - 5, len(data) // 2, 60, 12, 4):
            path.write_bytes(data[:keep])
            with pytest.raises(UserError) as error:
                read_environment(path)
            assert str(path) in str(error.value) and "\n" not in str(error.value)


def test_damaged_bytes_never_crash(tmp_path):
    rng = np.random.default_rng(7)
    data = bytearray(hdr(tmp_path / "a.hdr", rgbe(random_pixels(rng)), "runs").read_bytes())
    for _ in range(200):
        damaged = bytearray(data)
        for at in rng.integers(60, len(data), 4):
            damaged[at] = rng.integers(256)
        (tmp_path / "b.hdr").write_bytes(damaged)
        try:
            found = read_environment(tmp_path / "b.hdr")
        except UserError:
            continue
        assert np.isfinite(found.pixels).all()


@pytest.mark.parametrize(
    "content", [b"", b"hello", b"#?RADIANCE\n", b"v/1\x01", b"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 2 +X 4\n"]
)
def test_anything_else_is_refused(tmp_path, content):
    (tmp_path / "a.hdr").write_bytes(content)
    with pytest.raises(UserError, match="expected an equirectangular EXR or HDR picture"):
        read_environment(tmp_path / "a.hdr")


@pytest.mark.skipif(not HDRI.is_dir(), reason="no models")
def test_real_files():
    for path in sorted(HDRI.iterdir()):
        found = read_environment(path)
        assert found.pixels.shape == (512, 1024, 3) and found.notes == ()
        assert found.pixels.mean() > 0.05


def test_a_picture_without_light_is_refused(tmp_path):
    file = tmp_path / "black.exr"
    exr(file, {"RGB": np.zeros((32, 64, 3), np.float32)})
    with pytest.raises(UserError, match="no light in it"):
        read_environment(file)
