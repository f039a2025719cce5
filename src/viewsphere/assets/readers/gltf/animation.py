"""Animations of a glTF file: their frames, and the node poses at an instant.

https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html#animations
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import chain, pairwise
from typing import Any

import numpy as np

from viewsphere.assets.primitive import Float
from viewsphere.assets.readers.gltf.document import Document
from viewsphere.assets.readers.gltf.field import Field
from viewsphere.geometry.rotation import slerp

Posed = Mapping[int, Mapping[str, Float]]
"""The animated properties of each moving node: translation, rotation (x, y, z, w), scale and weights."""

WIDTHS = {"translation": 3, "rotation": 4, "scale": 3, "weights": 1}

DEFAULT = 24.0
"""Frame rate of a file whose keys fit no regular rate, Blender's default."""

USUAL = (24.0, 25.0, 30.0, 50.0, 60.0, 24000 / 1001, 30000 / 1001, 60000 / 1001, 48.0, 90.0, 100.0, 120.0)
"""Usual frame rates of animations, the likeliest first."""

NEAR = 2e-3
"""Greatest deviation of a key's time from a frame, in frames: files store times in single precision."""

LEAST, MOST = 1.0, 1000.0
"""Frames per second that an animation may have; other rates are ignored."""


def _rate_of(document: Document) -> float:
    """The likeliest rate with a frame at every key of the file. If none fits, the rate of the closest keys if it fits all keys,
    else 24.
    """
    times = sorted(set(chain.from_iterable(_times(document, one).tolist() for one in document.root.items("animations"))))
    steps = [after - before for before, after in pairwise(times) if after - before > 1 / MOST]
    rates = (*USUAL, 1 / min(steps)) if steps else ()
    return next((rate for rate in rates if LEAST <= rate <= MOST and _fits(times, rate)), DEFAULT)


def timeline(document: Document, clip: str | None, fps: float | None) -> dict[str, Any]:
    """First and last frame of `clip` (None: each node's first animation), frame rate, whether anything moves, and the `clips`
    with their first and last frames, as plain data. Without `fps`, the rate is that of the file.

    Raises ModelError for a clip that the file does not have.
    """
    rate = _rate_of(document) if fps is None else fps
    clips = {name: _span([_times(document, one)], rate) for name, one in sorted(_animations(document).items())}
    played = {id(one): _times(document, one) for one, _, _ in _channels(document, clip)}
    first, last = _span([*played.values()], rate)
    return {
        "first": first,
        "last": last,
        "fps": rate,
        "moves": last > first,
        "clips": [{"name": name, "first": start, "last": end} for name, (start, end) in clips.items()],
    }


def posed(document: Document, clip: str | None, seconds: float) -> Posed:
    """Return the poses of an animation's nodes this many seconds after its start. Before the first key and after the last, the
    pose of that key applies. Without `clip` each node plays the first animation that moves it. Raises ModelError as `timeline`
    does.
    """
    nodes: dict[int, dict[str, Float]] = {}
    for animation, channel, target in _channels(document, clip):
        path = target.text("path")
        if path in WIDTHS:
            sampler = animation.item("samplers", channel.integer("sampler"))
            nodes.setdefault(target.integer("node"), {})[path] = _sampled(document, sampler, path, seconds)
    return nodes


def _animations(document: Document) -> dict[str, Field]:
    """The animations by their names; unnamed ones are numbered."""
    return {one.text("name") or f"animation{i}": one for i, one in enumerate(document.root.items("animations"))}


def _channels(document: Document, clip: str | None) -> Iterator[tuple[Field, Field, Field]]:
    """The channels that are played, with their animations and targets."""
    found = _animations(document)
    if clip is not None and clip not in found:
        names = ", ".join(map(repr, sorted(found))) or "none at all"
        raise document.folder.error(f"expected an animation {clip!r}, found {names}")
    owner: dict[int, str] = {}
    for name, animation in found.items():
        for channel in animation.items("channels") if clip in (None, name) else ():
            target = channel.get("target")
            if "node" in target and owner.setdefault(target.integer("node"), name) == name:
                yield animation, channel, target


def _times(document: Document, animation: Field) -> Float:
    """The times of all keys of an animation, seconds."""
    inputs = {sampler.integer("input") for sampler in animation.items("samplers")}
    return np.concatenate([np.zeros(0), *(_column(document, number) for number in sorted(inputs))])


def _column(document: Document, number: int) -> Float:
    return document.accessor(number, (1,))[:, 0].astype(np.float64)


def _span(times: Sequence[Float], rate: float) -> tuple[int, int]:
    """The first and the last frame of keys at these times."""
    all_ = np.concatenate([np.zeros(0), *times])
    if not all_.size or not np.isfinite(all_).all() or abs(all_).max() * rate > 1e9:
        return 0, 0
    return round(float(all_.min()) * rate), round(float(all_.max()) * rate)


def _fits(times: Sequence[float], rate: float) -> bool:
    return all(abs(time * rate - round(time * rate)) < NEAR for time in times)


def _sampled(document: Document, sampler: Field, path: str, seconds: float) -> Float:
    """The value of one sampler: (4,) for a rotation, one number per weight for weights, else (3,)."""
    times = _column(document, sampler.integer("input"))
    values = document.accessor(sampler.integer("output"), (WIDTHS[path],)).astype(np.float64)
    kind = sampler.text("interpolation", "LINEAR")
    each = 3 if kind == "CUBICSPLINE" else 1
    if not len(times) or not len(values) or len(values) % (len(times) * each):
        raise sampler.fail(f"an output for each of {len(times)} keys, not {len(values)}")
    keys = values.reshape(len(times), each, -1)
    i = min(max(int(np.searchsorted(times, seconds, side="right")) - 1, 0), max(len(times) - 2, 0))
    j = min(i + 1, len(times) - 1)
    length = float(times[j] - times[i])
    t = min(max((seconds - float(times[i])) / length, 0.0), 1.0) if length > 0 else 0.0
    if kind == "STEP":
        return keys[j if t >= 1 else i, 0]
    if kind == "CUBICSPLINE":
        return _cubic(keys[i], keys[j], t, length)
    start, end = keys[i, 0], keys[j, 0]
    if path != "rotation":
        return start + (end - start) * t
    return np.roll(slerp(np.roll(_unit(start), 1), np.roll(_unit(end), 1), t), -1)


def _unit(quaternion: Float) -> Float:
    length = float(np.sqrt((quaternion * quaternion).sum()))
    return quaternion / length if length > 0 else np.array([0.0, 0.0, 0.0, 1.0])


def _cubic(start: Float, end: Float, t: float, length: float) -> Float:
    """Cubic spline interpolation between two keys, each (in-tangent, value, out-tangent); appendix C of the specification."""
    t2, t3 = t * t, t * t * t
    return (
        (2 * t3 - 3 * t2 + 1) * start[1]
        + length * (t3 - 2 * t2 + t) * start[2]
        + (3 * t2 - 2 * t3) * end[1]
        + length * (t3 - t2) * end[0]
    )
