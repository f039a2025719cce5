"""Document: the JSON of a glTF file, its buffers and its accessors."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from importlib.util import find_spec
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.paths.folder import ModelFolder, UnreadableError
from viewsphere.assets.readers.gltf.field import Field
from viewsphere.errors import ModelError

_DRACO = "KHR_draco_mesh_compression"

_MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")

BASISU = "KHR_texture_basisu"

_PACKAGES = {_DRACO: "DracoPy", **dict.fromkeys(_MESHOPT, "meshopt"), BASISU: "opengl_basisu"}

_MODES = ("ATTRIBUTES", "TRIANGLES", "INDICES")

_FILTERS = ("NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR")

COMPONENTS: dict[int, type[np.generic]] = {
    5120: np.int8,
    5121: np.uint8,
    5122: np.int16,
    5123: np.uint16,
    5125: np.uint32,
    5126: np.float32,
}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}

READ_EXTENSIONS = {
    BASISU,
    _DRACO,
    *_MESHOPT,
    "EXT_mesh_gpu_instancing",
    "EXT_texture_webp",
    "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_transform",
    "MSFT_texture_dds",
}
HARMLESS_EXTENSIONS = {
    "KHR_animation_pointer",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_dispersion",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_materials_variants",
    "KHR_xmp",
    "KHR_xmp_json_ld",
}
"""Extensions that change neither the geometry nor the material fields that this package reads."""


@dataclass(eq=False)
class Document:
    """A parsed file: `root` is its JSON, `binary` the GLB's own buffer."""

    folder: ModelFolder
    root: Field
    binary: bytes | None
    _buffers: dict[int, bytes] = field(default_factory=dict[int, bytes])
    _views: dict[int, bytes] = field(default_factory=dict[int, bytes])
    _elements: dict[int, NDArray[Any]] = field(default_factory=dict[int, "NDArray[Any]"])

    @classmethod
    def read(cls, folder: ModelFolder) -> Document:
        """Parse the model, GLB or JSON according to its first bytes, and check version and extensions."""
        data = folder.read_model()
        text, binary = _chunks(folder, data) if data[:4] == b"glTF" else (data, None)
        try:
            value: Any = json.loads(text.decode("utf-8-sig"))
        except (UnicodeDecodeError, json.JSONDecodeError) as error:
            raise folder.error(f"expected glTF 2.0's JSON: {error}") from None
        except RecursionError:
            raise folder.error("expected glTF 2.0's JSON, found one nested too deeply") from None
        document = cls(folder, Field(value, str(folder.model)), binary)
        document._check_header()
        return document

    def _check_header(self) -> None:
        asset = self.root.get("asset")
        told = asset.mapping()
        version = str(told.get("minVersion", told.get("version", "missing")))[:20]  # often a number in glTF 1.0
        if version != "2.0" and not (version.startswith("2.") and "minVersion" not in asset):
            raise self.folder.error(f"expected glTF version 2.0, found {version}; export the model as glTF 2.0")
        required = {str(extension.value) for extension in self.root.items("extensionsRequired")}
        unknown = sorted(required - READ_EXTENSIONS - HARMLESS_EXTENSIONS)
        if unknown:
            raise self.folder.error(f"requires the extension {', '.join(unknown)}, not read here; export without it")

    def buffer(self, index: int) -> bytes:
        """Bytes of a buffer; raises ModelError if it is missing or shorter than declared."""
        if index not in self._buffers:
            entry = self.root.item("buffers", index)
            length = entry.integer("byteLength")
            if "uri" in entry:
                data = self._external(entry)
            elif index == 0 and self.binary is not None:
                data = self.binary
            else:
                raise self.folder.error(f"buffers[{index}] has neither a uri nor a binary chunk")
            if len(data) < length:
                raise self.folder.error(f"buffers[{index}]: expected {length} bytes, found {len(data)}: truncated")
            self._buffers[index] = data
        return self._buffers[index]

    def _external(self, entry: Field) -> bytes:
        uri = entry.text("uri")
        try:
            return self.folder.read(uri if uri.startswith("data:") else unquote(uri), "buffer")
        except UnreadableError as error:
            raise self.folder.error(f"{entry.where.rpartition('.')[2]}: {error}") from None

    def view(self, index: int) -> tuple[memoryview, int | None]:
        """Plain bytes of a bufferView and its stride."""
        entry = self.root.item("bufferViews", index)
        stride = entry.integer("byteStride", 0) or None
        packed = _meshopt_of(entry)
        if packed is None or (not is_readable(packed[0]) and self._has_plain_copy(entry)):
            return self.slice(entry), stride
        if index not in self._views:
            self._views[index] = _unpacked_view(self.folder, *packed, self.slice)
        return memoryview(self._views[index]), stride

    def _has_plain_copy(self, entry: Field) -> bool:
        """Return whether the buffer of a compressed bufferView holds the plain data, too."""
        index = entry.integer("buffer")
        return "uri" in self.root.item("buffers", index) or (index == 0 and self.binary is not None)

    def slice(self, entry: Field) -> memoryview:
        """The bytes of a buffer that an entry names by `buffer`, `byteOffset` and `byteLength`."""
        offset, length = entry.integer("byteOffset", 0), entry.integer("byteLength")
        data = self.buffer(entry.integer("buffer"))
        if offset + length > len(data):
            place = entry.where.rpartition(": ")[2]
            raise self.folder.error(f"{place}: expected bytes up to {offset + length}, the buffer has {len(data)}")
        return memoryview(data)[offset : offset + length]

    def unpack(self, primitive: Field) -> bool:
        """Decode a primitive's Draco data, from which `accessor` then serves its elements; False for plain data."""
        packed = primitive.extension(_DRACO)
        if packed is None:
            return False
        if is_readable(_DRACO):
            position = primitive.get("attributes").integer("POSITION")
            if position not in self._elements:
                data, _ = self.view(packed.integer("bufferView"))
                self._elements |= _unpacked_primitive(self.folder, primitive, packed, data)
            return True
        if _DRACO in {entry.value for entry in self.root.items("extensionsRequired")}:
            raise lacking(self.folder, _DRACO)
        return False

    def accessor(self, index: int, widths: tuple[int, ...]) -> NDArray[Any]:
        """Elements (count, width): normalised integers as float64 in [-1, 1], others in their own dtype."""
        entry = self.root.item("accessors", index)
        kind, code = entry.text("type"), entry.integer("componentType")
        width = WIDTHS.get(kind)
        if width not in widths or code not in COMPONENTS:
            raise entry.fail(f"components {sorted(COMPONENTS)} and {' or '.join(map(str, widths))} of them")
        dtype = np.dtype(COMPONENTS[code]).newbyteorder("<")
        values = self._dense(entry, dtype, width, kind) if index not in self._elements else self._decoded(index, dtype, width)
        sparse = entry.get("sparse")
        if "count" in sparse:
            values = self._patched(sparse, values)
        if entry.boolean("normalized") and dtype.kind in "iu":
            greatest = 2 ** (8 * dtype.itemsize - (dtype.kind == "i")) - 1
            return np.maximum(values / greatest, -1.0)
        return values

    def _decoded(self, index: int, dtype: np.dtype[Any], width: int) -> NDArray[Any]:
        elements = self._elements[index]
        if elements.shape[1] != width:
            raise self.folder.error(f"accessors[{index}]: expected {width} components, Draco's data has {elements.shape[1]}")
        return elements.astype(dtype)

    def _dense(self, entry: Field, dtype: np.dtype[Any], width: int, kind: str) -> NDArray[Any]:
        count = entry.integer("count")
        place = entry.where.rpartition(".")[2]
        self.folder.check("MAX_VERTICES", count, f"elements in {place}")
        if "bufferView" not in entry:
            self.folder.check("MAX_ZEROS", count, f"elements without a bufferView in {place}")
            return np.zeros((count, width), dtype)
        data, stride = self.view(entry.integer("bufferView"))
        return self._strided(entry, data[entry.integer("byteOffset", 0) :], dtype, count, width, stride, kind)

    def _strided(
        self,
        entry: Field,
        data: memoryview,
        dtype: np.dtype[Any],
        count: int,
        width: int,
        stride: int | None = None,
        kind: str = "",
    ) -> NDArray[Any]:
        # Columns of small matrices start at multiples of four bytes.
        rows = {"MAT2": 2, "MAT3": 3}.get(kind, 0)
        pad = rows and -rows * dtype.itemsize % 4 // dtype.itemsize
        stored = width + pad * (width // rows) if pad else width
        element = stored * dtype.itemsize
        step = stride or element
        if count and (step < element or (count - 1) * step + element > len(data)):
            found = f"{len(data)} bytes in steps of {step}"
            raise self.folder.error(f"{entry.where}: expected {count} elements of {element} bytes, found {found}: truncated")
        values = np.ndarray((count, stored), dtype, data if count else b"", 0, (step, dtype.itemsize))
        return values.reshape(count, -1, rows + pad)[:, :, :rows].reshape(count, width) if pad else values.copy()

    def _patched(self, sparse: Field, values: NDArray[Any]) -> NDArray[Any]:
        count = sparse.integer("count")
        at, new = sparse.get("indices"), sparse.get("values")
        code = at.integer("componentType")
        if code not in {5121, 5123, 5125}:
            raise at.fail("an unsigned componentType")
        index_data, _ = self.view(at.integer("bufferView"))
        dtype = np.dtype(COMPONENTS[code]).newbyteorder("<")
        indices = self._strided(at, index_data[at.integer("byteOffset", 0) :], dtype, count, 1)[:, 0]
        value_data, _ = self.view(new.integer("bufferView"))
        replacement = self._strided(new, value_data[new.integer("byteOffset", 0) :], values.dtype, count, values.shape[1])
        if count and int(indices.max()) >= len(values):
            raise at.fail(f"sparse indices below {len(values)}")
        values[indices] = replacement
        return values


def _chunks(folder: ModelFolder, data: bytes) -> tuple[bytes, bytes | None]:
    """JSON and binary chunk of a GLB file."""
    if len(data) < 20:
        raise folder.error(f"expected a GLB header and a JSON chunk, found {len(data)} bytes: truncated")
    _, version, length = struct.unpack_from("<4sII", data)
    if version != 2:
        raise folder.error(f"expected GLB version 2, found {version}; export the model as glTF 2.0")
    if length > len(data):
        raise folder.error(f"expected {length} bytes as the GLB header says, found {len(data)}: truncated")
    chunks: dict[bytes, bytes] = {}
    offset = 12
    while offset + 8 <= length:
        size, kind = struct.unpack_from("<I4s", data, offset)
        if offset + 8 + size > length:
            raise folder.error(f"expected a chunk of {size} bytes at {offset}, found {length - offset - 8}: truncated")
        chunks.setdefault(kind, data[offset + 8 : offset + 8 + size])
        offset += 8 + size
    if b"JSON" not in chunks:
        raise folder.error("expected a GLB with a JSON chunk, found none")
    return chunks[b"JSON"], chunks.get(b"BIN\0")


def is_readable(extension: str) -> bool:
    """Return whether the package that decodes an extension's data is installed."""
    return find_spec(_PACKAGES[extension]) is not None


def lacking(folder: ModelFolder, extension: str) -> ModelError:
    """The error for a file whose data needs a package that is not installed."""
    return folder.error(
        f"{extension} needs the package {_PACKAGES[extension]}, which is not installed: pip install 'viewsphere[gltf]', or "
        "export the model without compression"
    )


def _meshopt_of(view: Field) -> tuple[str, Field] | None:
    """The extension that compresses a bufferView, and its fields; None for plain data."""
    for name in _MESHOPT:
        fields = view.extension(name)
        if fields is not None:
            return name, fields
    return None


def _unpacked_view(folder: ModelFolder, extension: str, fields: Field, slice_of: Callable[[Field], memoryview]) -> bytes:
    """The plain bytes of a bufferView compressed by meshoptimizer; `slice_of` returns the packed bytes that fields name.

    https://github.com/KhronosGroup/glTF/tree/main/extensions: EXT_meshopt_compression.
    """
    if not is_readable(extension):
        raise lacking(folder, extension)
    count, stride = fields.integer("count"), fields.integer("byteStride")
    mode, kind = fields.text("mode"), fields.text("filter", "NONE")
    if mode not in _MODES or kind not in _FILTERS:
        raise fields.fail(f"a mode of {', '.join(_MODES)} and a filter of {', '.join(_FILTERS)}")
    folder.check("MAX_VERTICES", count, f"elements in {fields.where.rpartition('.')[2]}")
    data = slice_of(fields)
    try:
        decoded: NDArray[Any] = import_module("meshopt").decode_gltf_buffer(bytes(data), count, stride, mode, kind)
    except MemoryError:
        raise
    except Exception as error:  # the package's own kinds of errors, too
        raise _damaged(folder, fields, extension, error) from None
    if mode == "ATTRIBUTES":
        return decoded.tobytes()
    return decoded.astype("<u2" if stride == 2 else "<u4").tobytes()


def _unpacked_primitive(folder: ModelFolder, primitive: Field, fields: Field, data: memoryview) -> dict[int, NDArray[Any]]:
    """The elements of each accessor of a primitive compressed by Draco, by the accessor's number.

    https://github.com/KhronosGroup/glTF/tree/main/extensions: KHR_draco_mesh_compression.
    """
    try:
        mesh = import_module("DracoPy").decode(bytes(data))
        by_id = {attribute["unique_id"]: np.asarray(attribute["data"]) for attribute in mesh.attributes}
        faces = np.asarray(mesh.faces)
    except MemoryError:
        raise
    except Exception as error:  # the package's own kinds of errors, too
        raise _damaged(folder, fields, _DRACO, error) from None
    attributes = primitive.get("attributes")
    elements: dict[int, NDArray[Any]] = {}
    for name in fields.get("attributes").mapping():
        values = by_id.get(fields.get("attributes").integer(name))
        if values is None:
            raise fields.fail(f"attribute {name} among the decoded ones")
        if name in attributes:
            elements[attributes.integer(name)] = values.reshape(len(values), -1)
    if "indices" in primitive:
        elements[primitive.integer("indices")] = faces.reshape(-1, 1).astype(np.uint32)
    return elements


def _damaged(folder: ModelFolder, fields: Field, extension: str, error: Exception) -> ModelError:
    """The error for compressed data that its package cannot decode."""
    reason = " ".join(str(error).split())[:100]
    return folder.error(f"{fields.where.rpartition('.')[0]}: {extension} cannot be decoded ({reason}): truncated or damaged")
