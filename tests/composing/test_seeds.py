"""Generators by name."""

import numpy as np

from viewsphere.composing.seeds import generator, share, shares


def test_the_same_names_give_the_same_stream():
    a, b = generator(3, "model", "car_000"), generator(3, "model", "car_000")
    assert np.array_equal(a.random(5), b.random(5))


def test_seed_names_and_their_borders_all_count():
    streams = [
        generator(*names).random(3).tolist()
        for names in ((0,), (0, ""), (1,), (0, "ab"), (0, "a", "b"), (0, "", "ab"), (0, "ab", ""), (0, "b", "a"))
    ]
    assert len({tuple(s) for s in streams}) == len(streams)


def test_the_stream_is_that_of_the_documented_seed_sequence():
    import hashlib

    digest = hashlib.blake2b((3).to_bytes(8, "little") + b"car", digest_size=16).digest()
    key = tuple(int.from_bytes(digest[i : i + 4], "little") for i in (0, 4, 8, 12))
    expected = np.random.default_rng(np.random.SeedSequence(7, spawn_key=key)).random(4)
    assert np.array_equal(generator(7, "car").random(4), expected)


def test_shares_are_uniform_and_follow_from_seed_and_names():
    values = np.sort([share(1, "split", f"car_{i}") for i in range(4000)])
    steps = np.arange(1, 4001) / 4000
    assert np.abs(values - steps).max() < 1.63 / np.sqrt(4000)  # Kolmogorov-Smirnov, 1 %
    assert share(1, "a") != share(2, "a") != share(2, "b")


def test_shares_of_many_names_are_those_of_each():
    names = ["", "a", "ab", "b", "ä"]
    assert shares(5, "car", "x", each=names) == [share(5, "car", "x", name) for name in names]
