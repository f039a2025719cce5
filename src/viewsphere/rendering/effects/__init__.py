"""The effects of a camera on its picture; labels never change.

Effects apply in the order of the light path: lines on the objects, lens, sensor, the camera's computer. Pictures are
display-linear in [0, 1], (H, W, 3), or (H, W, 4) premultiplied, where blurs spread alpha too, while noise and colours leave
alpha alone. Strength 0 changes no byte; with W the picture's width, strength 1 means:

| effect | at strength 1 |
| --- | --- |
| `edge_highlight` | white lines, W / 300 wide, along the targets' borders and creases |
| `depth_of_field` | points infinitely far away blur to discs of diameter W / 20, near ones at most to twice that |
| `motion_blur` | a straight streak of length W / 12 |
| `blur` | a Gaussian of sigma W / 50 |
| `chromatic_aberration` | red 1 % larger and blue 1 % smaller than green, about the principal point |
| `vignetting` | the farthest corner has a tenth of its light: cos^4 of an angle whose tangent grows with the radius |
| `shot_noise` | white is 50 photo-electrons: Poisson noise of 14 % of white, elsewhere in proportion to the square root |
| `read_noise` | Gaussian noise of 3 % of white everywhere |
| `brightness` | at 1 twice the light, at -1 half of it |
| `contrast` | at 1 coded values twice as far from the middle, at -1 half as far |
| `saturation` | at 1 twice as far from grey, at -1 grey |
| `hue` | at 1 or -1 half a turn about grey, luminance kept |
| `jpeg` | quality 5 (95 just above strength 0), colours at half the resolution; applied last, to bytes |

Between 0 and 1, effects scale in proportion to strength. Shot noise scales its electrons with 1 / strength^2, so that its noise
is proportional, too.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.scene import Effects
from viewsphere.rendering.effects.blurs import blur, motion_blur
from viewsphere.rendering.effects.color import jitter
from viewsphere.rendering.effects.edges import edge_highlight
from viewsphere.rendering.effects.focus import depth_of_field
from viewsphere.rendering.effects.lens import chromatic_aberration, vignetting
from viewsphere.rendering.effects.noise import noise
from viewsphere.rendering.seen import Seen

_SETTINGS = ("jpeg", "seed", "motion_angle_deg", "focus")
"""Fields of `Effects` that change no display-linear picture by themselves."""


def has_effects(effects: Effects) -> bool:
    """Return whether `apply_effects` would change anything."""
    return any(getattr(effects, name) for name in Effects.model_fields if name not in _SETTINGS)


def apply_effects(picture: NDArray[np.float32], effects: Effects, seen: Seen) -> NDArray[np.float32]:
    """The picture with all effects but JPEG, which works on bytes; the same array if there are no effects."""
    e = effects
    picture = edge_highlight(picture, e.edge_highlight, seen)
    picture = depth_of_field(picture, e.depth_of_field, e.focus or seen.distance, seen.inverse_depth)
    picture = motion_blur(picture, e.motion_blur, e.motion_angle_deg)
    picture = blur(picture, e.blur)
    picture = chromatic_aberration(picture, e.chromatic_aberration, seen.intrinsics)
    picture = vignetting(picture, e.vignetting, seen.intrinsics)
    picture = noise(picture, e.shot_noise, e.read_noise, e.seed)
    return jitter(picture, e.brightness, e.contrast, e.saturation, e.hue)
