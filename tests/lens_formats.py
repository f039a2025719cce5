"""Every format's answer to every lens: it holds the lens, or refuses it in one line before rendering."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from small import small_recipe
from viewsphere import plan, plugins
from viewsphere.errors import UserError
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.opening import check_formats

CHANNELS = ("rgb", "instances", "normals", "depth")
SEQUENCE = {"time": {"frames": 2, "fps": 10}, "viewpoints": {"azimuth": [0], "distance": 1.0}}
KINDS: tuple[dict[str, Any], ...] = ({}, SEQUENCE, {**SEQUENCE, "rig": {"kind": "stereo", "baseline": 0.1}})
"""Pictures, sequences, and sequences of a stereo pair: a format is asked with the first kind that it takes of a pinhole."""
PINHOLE = {"size": [64, 48], "fov_deg": 50}


def planned(camera: Mapping[str, Any], kind: Mapping[str, Any]) -> tuple[Any, tuple[str, ...]]:
    """The plan of a small data set through a lens, with its channels."""
    models = [{"source": "zoo:post_box", "category": "box", "count": 2, "scale": {"length": 0.18}}]
    base = {"camera": dict(camera), "models": models, "formats": [], "viewpoints": {"azimuth": [0, 90], "distance": 1.0}}
    for channels in (CHANNELS, (*CHANNELS[:-1], "depth_ray")):
        try:
            return plan(small_recipe(**{**base, **kind}, channels=list(channels))), channels
        except UserError as error:
            last = error
    raise last


def answer(name: str, camera: Mapping[str, Any], kind: Mapping[str, Any]) -> str | None:
    """A format's refusal; None if it holds the lens."""
    try:
        made, channels = planned(camera, kind)
        check_formats(made, [FormatEntry(name=name)], channels)
    except UserError as error:
        return str(error)
    return None


def answers(cameras: Mapping[str, Mapping[str, Any]]) -> Iterator[tuple[str, dict[str, str | None]]]:
    """For each format that can be written here: its answer to each of these cameras, by their words."""
    for name in plugins.names("formats"):
        kind = next((kind for kind in KINDS if answer(name, PINHOLE, kind) is None), None)
        if kind is not None:
            yield name, {words: answer(name, camera, kind) for words, camera in cameras.items()}
