"""The split of a frame, which depends only on the seed and the names of its group: frames of a group share a split."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Mapping
from itertools import accumulate

from viewsphere.composing.seeds import share
from viewsphere.recipe.recipe import Splits


def shared(splits: Splits) -> dict[str, float]:
    """The splits that have a share of the unlisted models or scenes, in the recipe's order."""
    return {name: part for name, part in splits.numbers.items() if part}


def drawn_split(shares: Mapping[str, float], seed: int, names: tuple[str, ...]) -> str:
    """The split for these names, given the splits' shares."""
    edges = tuple(accumulate(shares.values()))
    return tuple(shares)[min(bisect_right(edges, share(seed, "split", *names)), len(shares) - 1)]


def dealt(
    splits: Splits, seed: int, keys: Iterable[str], kept: Mapping[str, str], of_sets: Mapping[str, str]
) -> dict[str, str]:
    """The split of each model or scene: its split in `kept`, or the one that lists it, by its key or by its set (`of_sets`);
    the others are assigned by quotas.

    Quotas are each split's share of these others, rounded by largest remainders so that they add up. No quota is 0 if there are
    at least as many others as splits. They are assigned in the order of their hashes, so that the order of lists does not
    matter.
    """
    shares = shared(splits)
    listed = splits.listed(of_sets)
    split_of = {key: kept.get(key) or listed.get(key, "") for key in keys}
    rest = sorted((share(seed, "split", key), key) for key, name in split_of.items() if not name)
    names = (name for name, count in quotas(shares, len(rest)).items() for _ in range(count))
    return split_of | {key: name for (_, key), name in zip(rest, names, strict=True)}


def quotas(shares: Mapping[str, float], count: int) -> dict[str, int]:
    """Return the part of `count` for each share, by largest remainders; no share gets 0 if `count` is at least the number of
    shares.
    """
    exact = {name: share * count for name, share in shares.items()}
    quotas = {name: int(number + 1e-9) for name, number in exact.items()}
    by_remainder = sorted(exact, key=lambda name: quotas[name] - exact[name])
    for name in by_remainder[: count - sum(quotas.values())]:
        quotas[name] += 1
    for name in [name for name, number in quotas.items() if not number and count >= len(quotas)]:
        quotas[max(quotas, key=lambda other: quotas[other])] -= 1
        quotas[name] = 1
    return quotas


def expected(splits: Splits, count: int) -> dict[str, int]:
    """Return the expected number of names in each split. The numbers add up to `count`."""
    return quotas(shared(splits), count)
