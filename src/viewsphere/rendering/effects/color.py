"""Brightness, contrast, saturation and hue."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.codecs.srgb import linear
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Signed
from viewsphere.plugins.effect import EffectSpec
from viewsphere.rendering.effects import EffectContext
from viewsphere.rendering.white import LUMINANCE

Float32 = NDArray[np.float32]


class _Color(Frozen):
    """The strengths, which one pass over the pixels applies."""

    brightness: Signed = Field(default=0.0, description="-1 to 1")
    contrast: Signed = Field(default=0.0, description="-1 to 1")
    saturation: Signed = Field(default=0.0, description="-1 (grey) to 1")
    hue: Signed = Field(default=0.0, description="-1 to 1: 1 turns colours half way round")


def _apply(picture: Float32, options: _Color, _context: EffectContext) -> Float32:
    """The picture with its colours changed, clipped to [0, 1]; alpha is unchanged, and grey stays grey.

    Light is multiplied by 2^brightness; then coded values move from 1/2 by 2^contrast; then the linear colour rotates by `hue`
    half turns about the grey axis, and its distance from grey is multiplied by 1 + saturation. Both keep the luminance.
    """
    from viewsphere.rendering.effects.shared import kernels_color as kernels

    out = np.empty_like(picture)
    channels = picture.shape[2]
    is_toned = options.brightness or options.contrast
    table = tone_table(options.brightness, options.contrast) if is_toned else np.zeros(0, np.float32)
    matrix = chroma_matrix(options.saturation, options.hue).astype(np.float32)
    kernels.recolor(picture.reshape(-1, channels), table, matrix, out.reshape(-1, channels))
    return out


def tone_table(brightness: float, contrast: float) -> Float32:
    """Display-linear values for 65,536 display-linear values from 0 to 1, float32."""
    codes, light = _curve()
    bright = np.minimum(np.arange(65536) / 65535 * 2.0**brightness, 1)
    code = np.interp(bright, light, codes)
    return np.interp(np.clip(0.5 + (code - 0.5) * 2.0**contrast, 0, 1), codes, light).astype(np.float32)


def chroma_matrix(saturation: float, hue: float) -> NDArray[np.float64]:
    """A matrix from linear sRGB to linear sRGB, (3, 3): rows sum to 1, luminance is kept.

    Around grey a colour has two components in the plane of equal luminance; they are turned in an orthonormal basis of that
    plane.
    """
    grey = np.outer(np.ones(3), LUMINANCE)
    first = np.cross(LUMINANCE, np.ones(3))
    first /= np.linalg.norm(first)
    second = np.cross(LUMINANCE, first)
    second /= np.linalg.norm(second)
    c, s = math.cos(math.pi * hue), math.sin(math.pi * hue)
    basis = np.stack([first, second])
    turn = basis.T @ np.array([[c, -s], [s, c]]) @ basis
    return grey + (1 + saturation) * (turn @ (np.eye(3) - grey))


@cache
def _curve() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Coded values and their light at the same nodes, which are denser in the dark range."""
    codes = np.arange(4097) / 4096
    return codes, linear(codes)


def _effect(name: str, order: int, record: int, strongest: str) -> EffectSpec:
    """One of the effects, which share their options and their function."""
    return EffectSpec(
        name=name, options=_Color, strongest=strongest, stage="computer", order=order, apply=_apply, record=record
    )


EFFECTS = (
    _effect("brightness", 10, 6, "at 1 twice the light, at -1 half of it"),
    _effect("contrast", 20, 7, "at 1 coded values twice as far from the middle, at -1 half as far"),
    _effect("saturation", 30, 8, "at 1 twice as far from grey, at -1 grey"),
    _effect("hue", 40, 9, "at 1 or -1 half a turn about grey, luminance kept"),
)
