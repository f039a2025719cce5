"""The effects of a camera on its picture: one file an effect, or several that one function computes; labels never change.

A file holds `EFFECT = EffectSpec(...)`, or several in `EFFECTS`. Effects apply in the order of the light path: lines on the
objects, lens, sensor, the camera's computer, and the file's compression. Pictures are display-linear in [0, 1], (H, W, 3), or
(H, W, 4) premultiplied, where blurs spread alpha too, while noise and colours leave alpha alone. Strength 0 changes no byte.
Between 0 and 1, effects scale in proportion to strength.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere import plugins
from viewsphere.errors import PluginError
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.scene import SEED, Effects
from viewsphere.plugin_modules import Changes, changes
from viewsphere.plugins.effect import BEFORE_SENSOR, EffectSpec
from viewsphere.rendering.seen import Seen
from viewsphere.validation.errors import read_options

Picture = NDArray[Any]
Step = Callable[[Picture, Callable[[], Seen]], Picture]
"""One effect, or several in one: the changed picture, from a picture and a function that returns the surfaces in it."""


class EffectContext:
    """The frame that an effect changes.

    Args:
        name: The effect's name.
        seen: Returns the surfaces in the picture. It is called only if the effect reads them.
        seed: The seed of noise; None for an effect without.
    """

    def __init__(self, name: str, seen: Callable[[], Seen], seed: int | None) -> None:
        self._name, self._seen, self._seed = name, seen, seed

    @property
    def seen(self) -> Seen:
        """The inverse depth and the targets of each pixel, the lens, and the distance of the camera's target."""
        return self._seen()

    @property
    def shows_full_turn(self) -> bool:
        """Return whether the last column of the picture lies beside its first one."""
        return self.seen.intrinsics.lens.period is not None

    @property
    def seed(self) -> int:
        """The seed of the noise of one sensor's frame, which all noisy effects share: make a generator of it and of the
        effect's name.
        """
        if self._seed is None:
            raise PluginError(
                f"effect {self._name}: its `apply` reads `context.seed`, which is for noisy effects: set `is_noisy` to True"
            )
        return self._seed


class Steps(NamedTuple):
    """The effects that are on, in the order of the light path: before the sensor, after it, and of coded bytes."""

    before: list[Step]
    after: list[Step]
    coded: list[Step]


def steps_of(effects: Effects) -> Steps:
    """The effects that are on.

    Raises UserError for effects of unknown names, and for strengths and options that are not valid.
    """
    values = effects.values
    asked = [name for name, value in values.items() if value and name != SEED]
    installed = changes(sys.path) if asked else ()
    named = {name: _spec(name, installed) for name in asked}
    found = sorted((spec for spec in named.values() if spec is not None), key=lambda spec: spec.place)
    fields = {field for spec in found for field in spec.options.model_fields}
    _check_options(name for name, spec in named.items() if spec is None and name not in fields)
    first = dict[Any, EffectSpec]()
    for spec in found:
        first.setdefault((spec.apply, spec.options), spec)
    steps = Steps([], [], [])
    for spec in first.values():
        options = read_options(spec.options, {k: values[k] for k in spec.options.model_fields if k in values}, "scene.effects")
        step = partial(_apply, spec, options, effects.seed if spec.is_noisy else None)
        (steps.before if spec.stage in BEFORE_SENSOR else steps.coded if spec.stage == "file" else steps.after).append(step)
    return steps


@lru_cache(maxsize=64)
def _spec(name: str, _installed: Changes) -> EffectSpec | None:
    """The effect of a name, None for an option. Frames ask for the same few: loading one takes a tenth of a millisecond."""
    return plugins.load(EffectSpec, name) if name in plugins.names("effects") else None


def _check_options(names: Iterable[str]) -> None:
    """Raise UserError for a name that is no option of an effect: its plug-in may not be installed any more."""
    for name in names:
        if not any(name in spec.options.model_fields for spec in plugins.loadable(EffectSpec).values()):
            plugins.load(EffectSpec, name)


def _apply(spec: EffectSpec, options: Frozen, seed: int | None, picture: Picture, seen: Callable[[], Seen]) -> Picture:
    """The picture with an effect; raises PluginError if that is not a finite picture of the same kind."""
    changed = spec.apply(picture, options, EffectContext(spec.name, seen, seed))
    changed = plugins.checked(EffectSpec, spec.name, "apply", changed, np.ndarray)
    if changed.shape != picture.shape or changed.dtype != picture.dtype:
        raise PluginError(
            f"effect {spec.name}: expected its `apply` to return {_kind(picture)}, as it was given; found {_kind(changed)}"
        )
    if plugins.is_third_party(EffectSpec.KIND, spec.name) and not np.isfinite(changed).all():
        wrong = int(np.count_nonzero(~np.isfinite(changed)))
        raise PluginError(
            f"effect {spec.name}: expected its `apply` to return finite numbers; found NaN or infinity in {wrong} of "
            f"{changed.size} values: guard its divisions and roots"
        )
    return changed


def _kind(picture: Picture) -> str:
    return f"{picture.dtype} of shape {picture.shape}"
