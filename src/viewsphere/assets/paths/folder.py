"""The file access of readers: only files in the model's folder unless allowed, and each is recorded."""

from __future__ import annotations

import base64
import binascii
import io
import os
import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import Any
from urllib.parse import unquote, unquote_to_bytes

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Image
from viewsphere.assets.paths.finder import PICTURES as PICTURE_ENDINGS
from viewsphere.assets.paths.finder import Finder, NotFoundError
from viewsphere.assets.readers import readers
from viewsphere.errors import ModelError
from viewsphere.files import read_bytes
from viewsphere.limits import limits

_HEAD = 4096
"""Number of leading bytes examined, enough for a server's message or the start of a page."""

_PAGE = re.compile(rb"(?is)\s*(?:<!--.*?-->\s*)*<(?:!doctype html|html|head|body|script)\b")

_MESSAGE = re.compile(
    rb"(?is)\s*(?:(?:error:? )?[45]\d\d\b|not found\b|access denied\b|forbidden\b|(?:<\?xml[^>]*>\s*)?<error>"
    rb"|\{(?!.*\"asset\")[^{]*\"(?:message|error|detail)\"\s*:)"
)
"""Replies of servers instead of a file: an HTTP status, a store's XML, or JSON with a message."""

_ARCHIVES = {
    b"PK\x03\x04": "ZIP",
    b"\x1f\x8b\x08": "gzip",
    b"7z\xbc\xaf\x27\x1c": "7z",
    b"Rar!": "RAR",
    b"\xfd7zXZ": "xz",
    b"BZh": "bzip2",
}

_PICTURES = {b"\x89PNG": "PNG", b"\xff\xd8\xff": "JPEG", b"RIFF": "WebP", b"GIF8": "GIF"}

SHARPEST = 4096
"""Longest side, in texels, of textures after reduction: five of 8,192 would need more than a gigabyte per worker."""

IMAGE_FORMATS = ("PNG", "JPEG", "WEBP", "BMP", "GIF", "TIFF", "TGA", "DDS", "PPM")


KTX2 = b"\xabKTX 20\xbb\r\n\x1a\n"
"""The first bytes of a KTX 2 file."""


class UnreadableError(Exception):
    """Raised if a file named by the model cannot be used; the message gives the reason."""


@dataclass(eq=False)
class ModelFolder:
    """The folder of one model file while it is read.

    `inside` is the part of the file to read (`inside.split_source`); for a glTF file, `node` is. `shown` are objects of the
    file that are read although renders do not show them. `clip` and `fps` are the animation to play and its frame rate, None
    for the file's defaults. `files` are all files read or searched, the model itself first. `warnings` report omissions, each
    with the model's file name. `images` are the textures decoded so far, in order of first use.
    """

    model: Path
    confined: bool = True
    inside: tuple[str, ...] = ()
    shown: tuple[str, ...] = ()
    clip: str | None = None
    fps: float | None = None
    node: str | None = None
    files: dict[Path, None] = field(default_factory=dict[Path, None])
    warnings: list[str] = field(default_factory=list[str])
    images: list[Image] = field(default_factory=list[Image])
    left_out: dict[str, int] = field(default_factory=dict[str, int])
    _said: set[str] = field(default_factory=set[str])
    _named: set[str] = field(default_factory=set[str])
    _indices: dict[str, int | None] = field(default_factory=dict[str, "int | None"])

    def copy(self) -> ModelFolder:
        """A copy with the files and warnings so far, but without images; both can be used independently."""
        return replace(
            self,
            files={**self.files},
            warnings=[*self.warnings],
            images=[],
            left_out={**self.left_out},
            _said={*self._said},
            _indices={},
        )

    @cached_property
    def finder(self) -> Finder:
        """The search for files that the model names."""
        return Finder(self.model, self.confined, self.files)

    def warn(self, message: str) -> None:
        """Add a warning that begins with the model's file name, unless the same one was added before."""
        line = f"{self.model.name}: {message}"
        if line not in self._said:
            self._said.add(line)
            self.warnings.append(line)

    def leave_out(self, count: int, what: str) -> None:
        """Count items of a kind (`what`, in the singular) that are not read: `assemble` warns of them, or refuses the model if
        it contains nothing else.
        """
        self.left_out[what] = self.left_out.get(what, 0) + count

    @property
    def left(self) -> str:
        """The kinds of items that are not read, with their counts; empty without any."""
        return ", ".join(f"{count:,} {_counted(count, what)}" for what, count in self.left_out.items())

    def nothing_left(self) -> ModelError:
        """A ModelError for a model without triangles, with the kinds of items that it contains instead."""
        held = f"the file holds {self.left}, but no faces" if self.left else "the file holds no faces at all"
        return self.error(f"no triangles found: {held}; export the model as a mesh of faces")

    def error(self, message: str, line: int | None = None) -> ModelError:
        """A ModelError with this message, which begins with the model's path, and with the line number if one is given."""
        return ModelError(f"{self.model}: {message}" if line is None else f"{self.model}:{line}: {message}")

    def check(self, limit: str, found: int, what: str) -> None:
        """Raise ModelError when `found`, the number of `what`, exceeds the value of the named `limit`."""
        most: int = getattr(limits, limit)
        if found > most:
            raise self.error(
                f"expected at most {most:,} {what} (limit {limit}), found {found:,}; simplify the model, or set "
                f"VIEWSPHERE_{limit} higher"
            )

    def read_model(self) -> bytes:
        """The model file's own bytes; ModelError when it is missing, empty, unreadable or too large."""
        self.files[self.model] = None
        try:
            data = read_bytes(self.model)
        except FileNotFoundError:
            raise self.error("no such file; check the path") from None
        except OSError as error:
            raise self.error(f"cannot be read: {error.strerror or error}") from None
        if not data:
            raise self.error("the file is empty; export the model again")
        instead = impostor(data) or _wrong_kind(data, self.model.suffix[1:].lower())
        if instead is not None:
            raise self.error(f"expected a model, found {instead}")
        return data

    def read(self, reference: str, what: str = "file", base: Path | None = None) -> bytes:
        """Bytes of a file that the model names, or of a data: URI; `base` is the folder of the file that holds the reference.

        Raises UnreadableError if there is no such file (see the search of `finder.Finder`), or only one outside the asset's
        root while the folder is confined. A file found at another path than the reference's own is read with a warning.
        """
        if reference.startswith("data:"):
            return _data_uri(reference)
        path = self.path_of(reference, what, base)
        try:
            data = read_bytes(path)
        except OSError as error:
            raise UnreadableError(f"{what} {reference!r} cannot be read: {error.strerror or error}") from None
        if (instead := impostor(data)) is not None:
            raise UnreadableError(f"{what} {_short(reference)} is {instead}")
        return data

    def path_of(self, reference: str, what: str = "file", base: Path | None = None) -> Path:
        """The path of a file that the model names; raises UnreadableError as `read` does."""
        self._count(reference)
        try:
            found = self.finder.find(reference, base)
        except NotFoundError as error:
            raise UnreadableError(f"{what} {_short(reference)} {error}") from None
        if found.elsewhere:
            place = os.path.relpath(found.path, os.path.realpath(self.model.parent)).replace(os.sep, "/")
            self.warn(f"{what} {_short(reference)} does not exist there; {place!r} was read instead")
        return found.path

    def remember(self, path: Path) -> None:
        """Record a file as a dependency of the model."""
        self._count(str(path))
        self.files[path] = None

    def _count(self, name: str) -> None:
        self._named.add(name)
        self.check("MAX_FILES", len(self._named), "files that it names")

    def image(self, key: str, name: str, data: bytes | None = None, base: Path | None = None) -> int | None:
        """Index in `images` of the texture `key` (a path or data: URI, found as by `read`, or any name when `data` holds its
        bytes).

        None, with a warning, if the picture cannot be used; the material then has its factors without the texture.
        """
        if key not in self._indices:
            index = None
            try:
                data = self.read(key, "texture", base) if data is None else data
                pixels = decode_image(data, f"texture {_short(name)}")
                index = self.add_image(Image(name, self._bounded(pixels, name)))
            except UnreadableError as error:
                self.warn(f"{error}; the material's plain factor is used")
            self._indices[key] = index
        return self._indices[key]

    def _bounded(self, pixels: NDArray[np.uint8], name: str) -> NDArray[np.uint8]:
        small = reduced(pixels, SHARPEST)
        if small is not pixels:
            height, width = pixels.shape[:2]
            kept = f"{small.shape[1]:,} x {small.shape[0]:,}"
            self.warn(
                f"texture {_short(name)}: {width:,} x {height:,} pixels are reduced to {kept} (at most {SHARPEST:,} a side)"
            )
        return small

    def derived(self, key: str, make: Callable[[], Image]) -> int:
        """Index in `images` of an image computed from others by `make`, which is called once for each key."""
        index = self._indices.get(key)
        if index is None:
            index = self._indices[key] = self.add_image(make())
        return index

    def add_image(self, image: Image) -> int:
        """Append an image to `images`; returns its index."""
        self.images.append(image)
        self.check("MAX_TEXTURES", len(self.images), "textures")
        pixels = sum(known.pixels[..., 0].size for known in self.images)
        self.check("MAX_ALL_TEXTURE_PIXELS", pixels, "pixels in all textures together")
        return len(self.images) - 1


def decode_image(data: bytes, where: str, *, upright: bool = False) -> NDArray[np.uint8]:
    """Decode a texture to (H, W, 4) uint8; 16-bit channels keep their upper byte. For a KTX 2 file, the largest level is used.

    With `upright` a photograph is rotated by its EXIF orientation, which does not apply to textures. Raises UnreadableError,
    beginning with `where`, if the data is not an image, is damaged, or exceeds `limits`.
    """
    from PIL import Image as Pillow
    from PIL import ImageOps, UnidentifiedImageError

    if data.startswith(KTX2):
        return _ktx2_pixels(data, where)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            picture = Pillow.open(io.BytesIO(data), formats=IMAGE_FORMATS)
            width, height = picture.size
            if width * height <= limits.MAX_PICTURE_PIXELS:
                return _image_pixels(ImageOps.exif_transpose(picture) if upright else picture)
            found = f"{width} x {height}"
    except UnidentifiedImageError:
        raise UnreadableError(f"{where} is not an image in one of {', '.join(IMAGE_FORMATS)}, or has no pixels") from None
    except Pillow.DecompressionBombError:
        found = "many more"
    except MemoryError:
        raise
    except Exception as error:  # Pillow's decoders raise any error of their format's parser
        raise UnreadableError(f"{where} cannot be decoded ({str(error)[:80]})") from None
    raise _too_large(where, found)


def _ktx2_pixels(data: bytes, where: str) -> NDArray[np.uint8]:
    """Pixels of a KTX 2 file compressed by Basis Universal, decoded by the package opengl_basisu."""
    from importlib import import_module

    try:
        basisu = import_module("opengl_basisu")
    except ImportError:
        raise UnreadableError(f"{where}: KTX 2 pictures need a package: pip install 'viewsphere[gltf]'") from None
    try:
        texture = basisu.open(data)
        if texture.width * texture.height <= limits.MAX_PICTURE_PIXELS:
            return np.array(texture.transcode("rgba8").data, np.uint8)
    except ValueError as error:  # the package's errors are of this kind
        raise UnreadableError(f"{where} cannot be decoded ({str(error)[:80]})") from None
    raise _too_large(where, f"{texture.width} x {texture.height}")


def _too_large(where: str, found: str) -> UnreadableError:
    return UnreadableError(
        f"{where}: expected at most {limits.MAX_PICTURE_PIXELS:,} pixels (limit MAX_PICTURE_PIXELS), found {found}"
    )


def _image_pixels(picture: Any) -> NDArray[np.uint8]:
    """Pixels (H, W, 4) uint8 RGBA of a Pillow image; 16-bit channels keep their upper byte, floats run from 0 to 1."""
    from PIL import Image as Pillow

    if picture.mode == "F":
        grey = np.nan_to_num(np.asarray(picture), posinf=1.0).clip(0.0, 1.0)
        picture = Pillow.fromarray(np.rint(grey * 255).astype(np.uint8))
    elif picture.mode.startswith("I"):
        grey = (np.asarray(picture).astype(np.int64) >> 8).clip(0, 255).astype(np.uint8)
        picture = Pillow.fromarray(grey)
    return np.array(picture.convert("RGBA"), dtype=np.uint8)


def reduced(pixels: NDArray[np.uint8], sharpest: int) -> NDArray[np.uint8]:
    """The picture (H, W, 4) reduced by the whole factor that leaves neither side longer than `sharpest`.

    Colours are averaged with their alpha as weight.
    """
    from PIL import Image as Pillow

    factor = -(-max(pixels.shape[:2]) // sharpest)
    return pixels if factor == 1 else np.array(Pillow.fromarray(pixels).reduce(factor))


def _counted(count: int, what: str) -> str:
    """The count with its noun; except for 1, the first word gets an s: `faces of fewer than three corners`."""
    noun, of, rest = what.partition(" of ")
    return what if count == 1 else f"{'vertice' if noun == 'vertex' else noun}s{of}{rest}"


def _data_uri(uri: str) -> bytes:
    head, comma, body = uri.partition(",")
    if not comma:
        raise UnreadableError("the data URI has no comma before its data")
    if not head.endswith(";base64"):
        return unquote_to_bytes(body)
    try:
        return base64.b64decode(unquote(body), validate=True)
    except (binascii.Error, ValueError):
        raise UnreadableError("the data URI is not valid base64") from None


def _short(text: str) -> str:
    return repr(text if len(text) <= 120 else text[:117] + "...")


def impostor(data: bytes) -> str | None:
    """A description of a stand-in for a file (a pointer, or a server's page or message), and the fix; None for other data."""
    head = data[:_HEAD].removeprefix(b"\xef\xbb\xbf")
    return _pointer(head) or _from_server(head, len(data))


def _wrong_kind(data: bytes, suffix: str) -> str | None:
    """A description of a file whose first bytes show that it is not a model with this suffix, and the fix; None if unknown."""
    kind = next((name for magic, name in _ARCHIVES.items() if data.startswith(magic)), None)
    if kind is not None and all(reader.archives.get(suffix) != kind for reader in readers().values()):
        return f"a {kind} archive; unpack it and name the file in it"
    for magic, endings in chain.from_iterable(reader.first_bytes.items() for reader in readers().values()):
        if data.startswith(magic) and suffix not in endings:
            return f"one of another kind; rename the file so that it ends in .{endings[0]}"
    picture = next((name for magic, name in _PICTURES.items() if data.startswith(magic)), None)
    return None if picture is None or f".{suffix}" in PICTURE_ENDINGS else f"a {picture} picture; name the model's file"


def _pointer(head: bytes) -> str | None:
    if head.startswith(b"version https://git-lfs.github.com/spec/"):
        size = re.search(rb"(?m)^size (\d+)", head)
        left = f", whose {int(size[1]):,} bytes are not downloaded" if size else ""
        return f"a git-lfs pointer to the file{left}; run `git lfs pull` in its repository"
    if head.lstrip(b"./").startswith((b"annex/objects/", b"git/annex/objects/")):
        return "a git-annex pointer to the file; run `git annex get` in its repository"
    return None


def _from_server(head: bytes, size: int) -> str | None:
    if _PAGE.match(head):
        return "a web page (HTML); download the file itself (on GitHub: the button Download raw file)"
    if size <= _HEAD and _MESSAGE.match(head):
        text = " ".join(head.decode(errors="replace").split())[:80]
        return f"the message of a server ({text!r}); download the file again"
    return None
