"""The conversion of radiance to the finished picture."""

from __future__ import annotations

from collections.abc import Callable

from viewsphere.model.scene import Finish
from viewsphere.rendering.effects import apply_effects, has_effects
from viewsphere.rendering.effects.jpeg import jpeg
from viewsphere.rendering.seen import Seen
from viewsphere.rendering.smoother import smooth_border
from viewsphere.rendering.view import Bytes, Float32, develop, to_bytes, to_display_linear


def finished(radiance: Float32, background: Float32 | None, finish: Finish, seen: Callable[[], Seen]) -> Bytes:
    """The picture, (H, W, 3) uint8 sRGB, or (H, W, 4) with straight alpha if the background is transparent.

    `radiance` (H, W, 4) float32 scene-linear, premultiplied; `background` (H * W, 3) or (1, 3) float32 display-linear, None if
    the radiance covers every pixel. View, smoother, effects, sRGB curve, JPEG, in this order; `seen` is called only if an
    effect or the smoother needs it.
    """
    alpha, effects = finish.background.transparent, finish.effects
    if finish.smoother.kind == "none" and not has_effects(effects):
        pixels = develop(radiance, background, finish.view, alpha)
    else:
        picture = to_display_linear(radiance, background, finish.view, alpha)
        surfaces = seen()
        picture = smooth_border(picture, surfaces.targets, finish.smoother)
        pixels = to_bytes(apply_effects(picture, effects, surfaces))
    return jpeg(pixels, effects.jpeg)
