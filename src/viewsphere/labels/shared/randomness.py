"""Random numbers of labels: the same in every process, and for every order of samples."""

from __future__ import annotations

from hashlib import blake2b

import numpy as np


def generator(seed: int, *names: str) -> np.random.Generator:
    """The generator of a seed and names: the names of a sample and of a purpose."""
    digest = blake2b("\0".join(names).encode(), digest_size=16).digest()
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=np.frombuffer(digest, "<u4").tolist()))
