"""Compressed data of glTF files, decoded by the packages of the extra `gltf`.

https://github.com/KhronosGroup/glTF/tree/main/extensions: EXT_meshopt_compression, KHR_draco_mesh_compression.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.readers.gltf.field import Field
from viewsphere.errors import ModelError

DRACO = "KHR_draco_mesh_compression"
MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")
BASISU = "KHR_texture_basisu"
PACKAGES = {DRACO: "DracoPy", **dict.fromkeys(MESHOPT, "meshopt"), BASISU: "opengl_basisu"}
MODES = ("ATTRIBUTES", "TRIANGLES", "INDICES")
FILTERS = ("NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR")


def is_readable(extension: str) -> bool:
    """Return whether the package that decodes an extension's data is installed."""
    return find_spec(PACKAGES[extension]) is not None


def lacking(folder: ModelFolder, extension: str) -> ModelError:
    """The error for a file whose data needs a package that is not installed."""
    return folder.error(
        f"{extension} needs the package {PACKAGES[extension]}, which is not installed: pip install 'viewsphere[gltf]', or "
        "export the model without compression"
    )


def meshopt_of(view: Field) -> tuple[str, Field] | None:
    """The extension that compresses a bufferView, and its fields; None for plain data."""
    for name in MESHOPT:
        fields = view.extension(name)
        if fields is not None:
            return name, fields
    return None


def unpacked_view(folder: ModelFolder, extension: str, fields: Field, slice_of: Callable[[Field], memoryview]) -> bytes:
    """The plain bytes of a bufferView compressed by meshoptimizer; `slice_of` returns the packed bytes that fields name."""
    if not is_readable(extension):
        raise lacking(folder, extension)
    count, stride = fields.integer("count"), fields.integer("byteStride")
    mode, kind = fields.text("mode"), fields.text("filter", "NONE")
    if mode not in MODES or kind not in FILTERS:
        raise fields.fail(f"a mode of {', '.join(MODES)} and a filter of {', '.join(FILTERS)}")
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


def unpacked_primitive(folder: ModelFolder, primitive: Field, fields: Field, data: memoryview) -> dict[int, NDArray[Any]]:
    """The elements of each accessor of a primitive compressed by Draco, by the accessor's number."""
    try:
        mesh = import_module("DracoPy").decode(bytes(data))
        by_id = {attribute["unique_id"]: np.asarray(attribute["data"]) for attribute in mesh.attributes}
        faces = np.asarray(mesh.faces)
    except MemoryError:
        raise
    except Exception as error:  # the package's own kinds of errors, too
        raise _damaged(folder, fields, DRACO, error) from None
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
