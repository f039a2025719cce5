"""The choice of the models that share a frame."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from heapq import nsmallest

from viewsphere.composing.seeds import Names, share
from viewsphere.model.model_spec import ModelSpec


def companions(seed: int, spec: ModelSpec, others: Iterable[ModelSpec], count: int, names: Names) -> tuple[ModelSpec, ...]:
    """`count` models of `others` as company of a model, which is not among them.

    Each place goes to the model with the lowest hash for it (rendezvous hashing): another model in the recipe changes only the
    places that it gets.
    """
    left = {other.key: other for other in others if other.key != spec.key}
    chosen: list[ModelSpec] = []
    for slot in range(count):
        key = min(left, key=lambda k: (share(seed, "company", *names, str(slot), k), k))
        chosen.append(left.pop(key))
    return tuple(chosen)


def mixed(seed: int, models: Sequence[ModelSpec], count: int, names: Names, repeat: bool) -> tuple[ModelSpec, ...]:
    """`count` of the models for one scene, each at most once unless they may `repeat`.

    The models with the lowest hashes are chosen: another model in the recipe changes only the places that it gets, at most one
    without repeats.
    """
    if not repeat:
        return tuple(nsmallest(count, models, key=lambda spec: (share(seed, "cast", *names, spec.key), spec.key)))
    return tuple(
        min(models, key=lambda spec: (share(seed, "cast", *names, str(slot), spec.key), spec.key)) for slot in range(count)
    )


def balanced(
    seed: int, sizes: Mapping[str, int], models: Mapping[str, int], repeat: bool
) -> dict[str, tuple[tuple[str, int], ...]]:
    """Return the number of objects of each category in each scene.

    Over the scenes up to any one, the categories have equal numbers, within one object, while they have enough models.
    `sizes`: the number of objects of each scene, in scene order. `models`: the number of models of each category.
    A model appears at most once in a scene unless `repeat` is set. A scene's result depends on earlier scenes, never on later
    ones.
    """
    had = dict.fromkeys(models, 0)
    members: dict[str, tuple[tuple[str, int], ...]] = {}
    for scene, size in sizes.items():
        counts, order = Counter[str](), sorted(models, key=lambda name: share(seed, "category", scene, name))
        for _ in range(size):
            free = [name for name in order if repeat or counts[name] < models[name]]
            least = min(free, key=lambda name: (had[name], counts[name]))
            had[least] += 1
            counts[least] += 1
        members[scene] = tuple(counts.items())
    return members
