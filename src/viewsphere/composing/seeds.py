"""The source of randomness: a generator, or a number, from a seed and the stable names of the drawn value."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable

import numpy as np

Names = tuple[str, ...]
"""Subject of a draw: none, a model's key, or a model's key and a pose's name."""


def _digest(names: tuple[str, ...], size: int) -> bytes:
    hasher = hashlib.blake2b(digest_size=size)
    for name in names:
        hasher.update(_told(name))
    return hasher.digest()


def _told(name: str) -> bytes:
    text = name.encode()
    return len(text).to_bytes(8, "little") + text


def generator(seed: int, *names: str) -> np.random.Generator:
    """A generator for these names (a purpose, a model's key, a pose's values), never for a position in a list.

    Its stream is `SeedSequence(seed, spawn_key=<128-bit digest of the names>)`: the same whatever else is drawn.
    """
    words = np.frombuffer(_digest(names, 16), "<u4")
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=tuple(int(w) for w in words)))


def scene_generators(seed: int, names: tuple[str, ...]) -> Callable[[tuple[str, ...]], np.random.Generator]:
    """A generator for every field of a recipe's scene, by its path, where the scene is drawn for `names`."""
    return lambda path: generator(seed, "scene", ".".join(path), *names)


def share(seed: int, *names: str) -> float:
    """A number of [0, 1) for a seed and names, uniform over names: for choices too many to make a generator for each."""
    return _share(_digest((str(seed), *names), 8))


def shares(seed: int, *names: str, each: Iterable[str]) -> list[float]:
    """`share(seed, *names, name)` for each name; the common names are hashed once."""
    begun, numbers = hashlib.blake2b(digest_size=8), list[float]()
    for name in (str(seed), *names):
        begun.update(_told(name))
    for name in each:
        hasher = begun.copy()
        hasher.update(_told(name))
        numbers.append(_share(hasher.digest()))
    return numbers


def _share(digest: bytes) -> float:
    return int.from_bytes(digest, "little") / 2**64
