"""Who stands beside whom: the models that share a frame."""

from __future__ import annotations

from collections.abc import Iterable

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
