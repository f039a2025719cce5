"""Who stands beside whom: the models that share a frame."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from heapq import nsmallest

from viewsphere.model.model_spec import ModelSpec
from viewsphere.sampling.seeds import Names, share


def companions(seed: int, spec: ModelSpec, others: Iterable[ModelSpec], count: int, names: Names) -> tuple[ModelSpec, ...]:
    """`count` of `others` to stand beside a model, which is none of them.

    Each place goes to the one whose number for it is lowest (rendezvous hashing): one model more in the recipe changes
    only the places that it takes.
    """
    left = {other.key: other for other in others if other.key != spec.key}
    chosen: list[ModelSpec] = []
    for slot in range(count):
        key = min(left, key=lambda k: (share(seed, "company", *names, str(slot), k), k))
        chosen.append(left.pop(key))
    return tuple(chosen)


def mixed(seed: int, models: Sequence[ModelSpec], count: int, names: Names, repeat: bool) -> tuple[ModelSpec, ...]:
    """`count` of the models to stand together, each once at most unless they may `repeat`.

    They are those whose numbers are lowest: one model more in the recipe takes only places of its own, one at most
    where none repeats.
    """
    if not repeat:
        return tuple(nsmallest(count, models, key=lambda spec: (share(seed, "cast", *names, spec.key), spec.key)))
    return tuple(
        min(models, key=lambda spec: (share(seed, "cast", *names, str(slot), spec.key), spec.key)) for slot in range(count)
    )
