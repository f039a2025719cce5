"""A writer of PLY files in all encodings, for tests of the reader."""

import struct

CODES = {
    "char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d",
    "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "float32": "f", "float64": "d",
}  # fmt: skip
FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


def ply(elements, encoding="ascii", comments=(), newline="\n"):
    """A PLY file of elements `(name, properties, rows)`.

    Properties are like "float x" or "list uchar int vertex_indices"; a row has a value for each, for lists a sequence.
    """
    lines = ["ply", f"format {encoding} 1.0", *(f"comment {comment}" for comment in comments)]
    for name, properties, rows in elements:
        lines += [f"element {name} {len(rows)}", *(f"property {p}" for p in properties)]
    head = newline.join([*lines, "end_header", ""]).encode()
    row_of = _text_row if encoding == "ascii" else _binary_row
    body = (row_of(properties, row, FORMATS[encoding]) for _, properties, rows in elements for row in rows)
    return head + b"".join(body)


def _text_row(properties, row, _):
    words = []
    for kind, value in zip(properties, row, strict=True):
        words += [len(value), *value] if kind.startswith("list") else [value]
    return (" ".join(map(repr, words)) + "\n").encode()


def _binary_row(properties, row, order):
    parts = []
    for kind, value in zip(properties, row, strict=True):
        words = kind.split()
        if words[0] == "list":
            parts.append(struct.pack(f"{order}{CODES[words[1]]}{len(value)}{CODES[words[2]]}", len(value), *value))
        else:
            parts.append(struct.pack(order + CODES[words[0]], value))
    return b"".join(parts)
