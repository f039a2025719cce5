"""Small EXR, TIFF, HDR and PNG files that claim much: each reader of pictures reads or refuses them with little memory."""

import struct
import sys
import zlib

import pytest

from viewsphere.assets.paths.folder import UnreadableError, decode_image
from viewsphere.codecs.exr import decode_exr
from viewsphere.codecs.pictures import decode_picture
from viewsphere.errors import ViewsphereError
from viewsphere.model.scene import Background
from viewsphere.rendering.background import display_background
from viewsphere.rendering.sky.environment_file import read_environment

MOST = 300 << 20
"""Bytes that a reader may take for one of these files: a tenth of what the smallest honest reading of their claims needs."""


def _attribute(name, kind, value):
    return name + b"\0" + kind + b"\0" + struct.pack("<I", len(value)) + value


def exr(width, height, *more, flags=0):
    """The head of an EXR file of this size with further attributes, and bytes that are no pixels."""
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    channels = b"".join(struct.pack("<2siIii", name, 2, 0, 1, 1) for name in (b"B", b"G", b"R")) + b"\0"
    attributes = (
        _attribute(b"channels", b"chlist", channels), _attribute(b"compression", b"compression", b"\3"),
        _attribute(b"dataWindow", b"box2i", window), _attribute(b"displayWindow", b"box2i", window),
        _attribute(b"lineOrder", b"lineOrder", b"\0"), _attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1)),
        _attribute(b"screenWindowCenter", b"v2f", bytes(8)), _attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)),
    )  # fmt: skip
    return struct.pack("<II", 20000630, 2 | flags) + b"".join((*attributes, *more)) + bytes(5000)


def tiff(width, height, *more, body=bytes(400), following=0):
    """A TIFF file of one channel, deflated, with further tags (number, kind, count, value); the body begins at byte 200."""
    tags = [(256, 4, 1, width), (257, 4, 1, height), (258, 3, 1, 8), (259, 3, 1, 8), (262, 3, 1, 1), (277, 3, 1, 1), *more]
    head = b"II*\0" + struct.pack("<IH", 8, len(tags)) + b"".join(struct.pack("<HHII", *tag) for tag in sorted(tags))
    return (head + struct.pack("<I", following)).ljust(200, b"\0") + body


def strip(rows, size):
    return (273, 4, 1, 200), (278, 4, 1, rows), (279, 4, 1, size)


def tiles(side, size):
    return (322, 4, 1, side), (323, 4, 1, side), (324, 4, 1, 200), (325, 4, 1, size)


def png(width, height, *chunks):
    parts = [(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)), *chunks, (b"IDAT", ZEROS), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in parts
    )


ZEROS = zlib.compress(bytes(1 << 25), 9)
DEEP = (
    _attribute(b"type", b"string", b"deepscanline"), _attribute(b"chunkCount", b"int", struct.pack("<i", 2**30)),
    _attribute(b"version", b"int", struct.pack("<i", 1)),
    _attribute(b"maxSamplesPerPixel", b"int", struct.pack("<i", 2**31 - 1)),
)  # fmt: skip
PART = (
    _attribute(b"name", b"string", b"a"),
    _attribute(b"type", b"string", b"scanlineimage"),
    _attribute(b"chunkCount", b"int", struct.pack("<i", 2**31 - 1)),
)
BOMBS = {
    "size.exr": exr(1 << 20, 1 << 19),
    "most.exr": exr(2**31 - 1, 2**30 - 1),
    "within.exr": exr(14_000, 7_000),
    "deep.exr": exr(4096, 2048, *DEEP, flags=0x800),
    "parts.exr": exr(4096, 2048, *PART, flags=0x1000),
    "tiles.exr": exr(4096, 2048, _attribute(b"tiles", b"tiledesc", struct.pack("<IIB", 2**31 - 1, 2**31 - 1, 0)), flags=0x200),
    "levels.exr": exr(4096, 2048, _attribute(b"tiles", b"tiledesc", struct.pack("<IIB", 1, 1, 0x12)), flags=0x200),
    "preview.exr": exr(16, 8, _attribute(b"preview", b"preview", struct.pack("<II", 0xFFFF, 0xFFFF))),
    "tiles.tif": tiff(10**6, 10**6, *tiles(16, 100)),
    "tile.tif": tiff(64, 32, *tiles(10**6, len(ZEROS)), body=ZEROS),
    "strip.tif": tiff(10**6, 10**6, *strip(10**6, 100)),
    "ratio.tif": tiff(64, 32, *strip(32, len(ZEROS)), body=ZEROS),
    "loop.tif": tiff(64, 32, *strip(32, 100), following=8),
    "loops.tif": tiff(64, 32, *strip(32, 100), (330, 4, 1, 8), (34665, 4, 1, 8), (34853, 4, 1, 8)),
    "counts.tif": tiff(64, 32, (273, 4, 2**31 - 1, 200), (278, 4, 1, 32), (279, 4, 2**32 - 1, 200)),
    "size.hdr": b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 9999999 +X 9999999\n",
    "within.hdr": b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 7000 +X 14000\n" + b"\x10\x20\x30\x80" * 14_000,
    "size.png": png(10**6, 10**6),
    "text.png": png(16, 8, *[(b"iTXt", b"a\0\1\0\0\0" + ZEROS)] * 20),
}
READERS = {
    "sky": read_environment,
    "background": lambda file: display_background(Background(image=str(file)), 64, 48),
    "texture": lambda file: decode_image(file.read_bytes(), str(file)),
    "imported": lambda file: decode_picture(file.read_bytes(), 3),
    "stored": lambda file: decode_exr(file.read_bytes()),
}
FOREIGN = {"imported": (OSError, ValueError, SyntaxError), "texture": (UnreadableError,)}
"""Further errors that a reader may raise, which its callers report in one line."""


def held_at_most(forget=False):
    import resource
    from pathlib import Path

    if forget:
        Path("/proc/self/clear_refs").write_text("5")
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


@pytest.mark.skipif(sys.platform != "linux", reason="measures memory by /proc")
@pytest.mark.parametrize("reader", READERS)
def test_files_that_claim_much_cost_little(reader, tmp_path):
    for name, data in BOMBS.items():
        (tmp_path / name).write_bytes(data)
        try:
            before = held_at_most(forget=True)
        except OSError:
            pytest.skip("the system does not reset the most memory held")
        try:
            READERS[reader](tmp_path / name)
        except (ViewsphereError, *FOREIGN.get(reader, ())) as error:
            assert str(error) and "\n" not in str(error), name
        assert held_at_most() - before < MOST, name


@pytest.mark.parametrize(
    "name", ["size.exr", "most.exr", "within.exr", "deep.exr", "parts.exr", "tiles.exr", "size.hdr", "size.png", "tiles.tif"]
)
def test_a_sky_that_claims_much_is_a_mistake_in_one_line(name, tmp_path):
    (tmp_path / name).write_bytes(BOMBS[name])
    with pytest.raises(ViewsphereError, match=rf"^scene\.sky\.hdri: environment .*{name}") as caught:
        read_environment(tmp_path / name)
    assert "\n" not in str(caught.value)
