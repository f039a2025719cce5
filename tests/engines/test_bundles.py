"""Bundles of textures: built once, where they stay, and kept for the next stage within bounds."""

from __future__ import annotations

import gc
import tracemalloc
import weakref
from itertools import pairwise

import numpy as np
import pytest

from scratch import scratch_cache
from viewsphere.assets.mesh import Image, Material, Texture
from viewsphere.caches import cache_of
from viewsphere.engines.raster.materials import bundles
from viewsphere.engines.raster.materials.bundles import BundlePacker
from viewsphere.engines.raster.materials.kernels_filter import PLANES

SET = ("base_color_texture", "normal_texture", "metallic_roughness_texture")


@pytest.fixture(autouse=True)
def _nothing_kept():
    bundles._kept.cache_clear()
    yield
    bundles._kept.cache_clear()


def images(seed, *shapes):
    rng = np.random.default_rng(seed)
    return [Image(str(shape), rng.integers(0, 256, (*shape, 4)).astype(np.uint8)) for shape in shapes]


def material(first, fields=SET, **given):
    return Material(**{name: Texture(first + k) for k, name in enumerate(fields)}, **given)


def packed(given, *materials):
    packer = BundlePacker()
    found = [packer.add(m, given, (True, True)) for m in materials]
    return found, packer.pack()


def words_of(textures, bundle):
    """All levels of a bundle."""
    first, channels = textures.levels[bundle, 0, 0], 4 * textures.modes[bundle, 5]
    last, width, height = textures.levels[bundle, textures.modes[bundle, 0] - 1]
    return textures.texels[first : last + width * height * channels]


def test_each_bundle_holds_what_it_does_alone():
    shapes = [(8, 8)] * 3 + [(5, 31)] * 3 + [(64, 16)] * 2 + [(7, 7)]
    given = images(1, *shapes)
    materials = [
        material(0),
        material(3, alpha_mode="BLEND"),
        material(6),
        material(0, ("occlusion_texture",)),
        material(1, ("clearcoat_texture", "transmission_texture"), clearcoat=1.0, transmission=0.5),
    ]
    found, together = packed(given, *materials)
    used = 0
    for m, own in zip(materials, found, strict=True):
        bundles._kept.cache_clear()
        (alone,), textures = packed(given, m)
        for bundle, single in zip(own, alone, strict=True):
            if bundle >= 0:
                words = words_of(together, bundle)
                np.testing.assert_array_equal(words, words_of(textures, single))
                np.testing.assert_array_equal(together.modes[bundle], textures.modes[single])
                used += words.size
    assert together.texels.size == used + 4 * PLANES
    assert not together.texels[used:].any()


def test_channels_without_a_picture_are_neutral():
    given = images(2, (4, 4), (4, 4))
    _, textures = packed(given, material(0, ("occlusion_texture", "clearcoat_texture"), clearcoat=1.0))
    first = words_of(textures, 0)[: 4 * 4 * 8].reshape(4, 4, 8)
    assert (first[..., :3] == 32768).all()  # a level normal
    assert (first[..., [4, 5, 7]] == 65535).all()
    np.testing.assert_array_equal(first[..., 3] // 257, given[0].pixels[..., 0])
    np.testing.assert_array_equal(first[..., 6] // 257, given[1].pixels[..., 0])


def shares(before, after):
    """What of each texel (columns) a texel of half as many (rows) covers, (after, before)."""
    edges = np.arange(after + 1) * before / after
    upper = np.minimum(edges[1:, None], np.arange(1, before + 1))
    return np.clip(upper - np.maximum(edges[:-1, None], np.arange(before)), 0, None) * after / before


@pytest.mark.parametrize("shape", [(16, 16), (15, 16), (31, 17), (9, 1)])
@pytest.mark.parametrize("mode", ["OPAQUE", "MASK"])
def test_a_level_is_the_mean_of_what_its_texels_cover(shape, mode):
    _, textures = packed(images(3, shape, shape, shape), material(0, alpha_mode=mode))
    levels = []
    for first, width, height in textures.levels[0, : textures.modes[0, 0]]:
        levels.append(textures.texels[first : first + width * height * 12].reshape(height, width, 12).astype(float))
    for before, after in pairwise(levels):
        down, across = (shares(before.shape[k], after.shape[k]) for k in (0, 1))
        expected = np.einsum("yj,jic,xi->yxc", down, before, across)
        if mode == "MASK":
            alpha = before[..., 3:4] + 1
            total = np.einsum("yj,jic,xi->yxc", down, alpha, across)
            expected[..., :3] = np.einsum("yj,jic,xi->yxc", down, before[..., :3] * alpha, across) / total
        np.testing.assert_allclose(after, expected, atol=0.6)  # a word is rounded, of float32


def test_packing_takes_little_more_memory_than_the_texels():
    given = images(4, *[(256, 256)] * 12)
    materials = [material(3 * k) for k in range(4)]
    packed(given, *materials)  # compiles
    bundles._kept.cache_clear()
    gc.collect()
    tracemalloc.start()
    _, textures = packed(given, *materials)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert textures.texels.nbytes > 8_000_000
    assert peak < 1.05 * textures.texels.nbytes


def test_the_same_textures_are_the_same_array_as_long_as_somebody_has_them(monkeypatch):
    monkeypatch.setattr(bundles, "KEPT_BYTES", 0)
    given = images(5, *[(16, 16)] * 3)
    _, first = packed(given, material(0))
    _, second = packed(given, material(0, alpha_cutoff=0.3))
    assert second.texels is first.texels
    held = weakref.ref(first.texels)
    del first, second
    gc.collect()
    assert held() is None


@pytest.mark.slow
def test_what_is_kept_is_bounded_and_the_last(monkeypatch):
    sets = [images(k, *[(32, 32)] * 3) for k in range(6)]
    one = packed(sets[0], material(0))[1].texels.nbytes
    monkeypatch.setattr(bundles, "KEPT_BYTES", 3 * one)
    seen = []
    for given in (*sets, sets[3]):
        seen.append(weakref.ref(packed(given, material(0))[1].texels))
        gc.collect()
        alive = {id(ref()): ref().nbytes for ref in seen if ref() is not None}
        assert sum(alive.values()) <= bundles.KEPT_BYTES
    assert seen[3]() is seen[6]()
    assert [ref() is not None for ref in seen[:6]] == [False] * 3 + [True] * 3
    large = images(9, *[(256, 256)] * 3)
    assert packed(large, material(0))[1].texels.nbytes > bundles.KEPT_BYTES
    assert all(ref() is not None for ref in seen[3:6])  # what cannot be kept drives nothing out


def test_a_bundle_of_another_stage_is_copied_instead_of_built(monkeypatch):
    given = images(6, *[(16, 16)] * 3, *[(8, 8)] * 3)
    (_, (small, *_)), together = packed(given, material(0), material(3))
    built = []
    build = bundles._build
    monkeypatch.setattr(bundles, "_build", lambda content, words: built.append(content.shape) or build(content, words))
    _, alone = packed(given, material(3))
    assert not built
    np.testing.assert_array_equal(words_of(alone, 0), words_of(together, small))
    other = images(7, (4, 4))
    mixed = BundlePacker()
    mixed.add(material(0, SET[:1]), other, (True, True))
    mixed.add(material(3), given, (True, True))
    textures = mixed.pack()
    assert built == [(4, 4)]
    np.testing.assert_array_equal(words_of(textures, 1), words_of(together, small))


@pytest.mark.parametrize("room", [5000, 20000, 45000])
def test_which_textures_are_reduced_depends_on_nothing_but_their_order(monkeypatch, room):
    monkeypatch.setattr(bundles, "MOST_WORDS", room)
    shapes = [(16, 16)] * 24 + [(32, 8)] * 3 + [(20, 20)] * 3
    results = []
    for _ in range(6):  # other images in other places of memory
        results.append(packed(images(8, *shapes), *(material(3 * k) for k in range(10)))[1])
    for other in results[1:]:
        for name in ("levels", "modes", "texels"):
            np.testing.assert_array_equal(getattr(other, name), getattr(results[0], name))
    assert results[0].texels.size - 4 * PLANES <= room
    whole = 12 * sum(h * w for h, w in shapes[::3]) * 4 // 3
    assert results[0].texels.size > min(room, whole) / 4  # no more than is needed


def test_no_texture_is_reduced_while_there_is_room(monkeypatch):
    shapes = [(16, 16)] * 12
    given, materials = images(10, *shapes), [material(3 * k) for k in range(4)]
    _, whole = packed(given, *materials)
    bundles._kept.cache_clear()
    monkeypatch.setattr(bundles, "MOST_WORDS", whole.texels.size - 4 * PLANES)
    _, same = packed(given, *materials)
    np.testing.assert_array_equal(same.texels, whole.texels)
    monkeypatch.setattr(bundles, "MOST_WORDS", whole.texels.size - 4 * PLANES - 1)
    _, less = packed(given, *materials)
    assert less.levels[:, 0, 1:].tolist() == [[8, 8]] + [[16, 16]] * 3


@pytest.fixture
def cache(tmp_path, monkeypatch):
    scratch_cache(monkeypatch, tmp_path / "cache")
    return lambda: sorted(cache_of("textures").glob("*.arrays"))


def of_place(given, *materials):
    """The textures of a place, in a new process."""
    bundles._kept.cache_clear()
    packer = BundlePacker()
    for m in materials:
        packer.add(m, given, (True, True), is_scenery=True)
    return packer.pack()


def test_textures_of_places_are_the_same_from_the_cache(cache, monkeypatch):
    given, materials = images(11, *[(256, 256)] * 6, (8, 8)), [material(0), material(3), material(6, SET[:1])]
    _, alone = packed(given, *materials)
    assert not cache()
    build, built = bundles._build, []
    monkeypatch.setattr(bundles, "_build", lambda content, words: built.append(content.shape) or build(content, words))
    for expected in ([(256, 256), (256, 256), (8, 8)], [(8, 8)]):  # small ones are not stored
        textures = of_place(given, *materials)
        assert built == expected
        del built[:]
        for bundle in range(3):
            np.testing.assert_array_equal(words_of(textures, bundle), words_of(alone, bundle))
        assert not textures.texels[-4 * PLANES :].any()
    assert len(cache()) == 2
    of_place(images(11, *[(256, 256)] * 6), *materials[:2])  # equal pictures, other objects
    assert not built and len(cache()) == 2


def test_other_pictures_and_uses_have_entries_of_their_own(cache):
    given = images(12, *[(256, 256)] * 3)
    of_place(given, material(0))
    changed = [Image(image.name, image.pixels.copy()) for image in given]
    changed[2].pixels[0, 0, 1] ^= 1
    of_place(changed, material(0))
    of_place(given, material(0, alpha_mode="MASK"))
    of_place(given, material(0, ("base_color_texture", "normal_texture", "clearcoat_texture"), clearcoat=1.0))
    assert len(cache()) == 4


@pytest.mark.parametrize("place", [0, 30, -1])
def test_damaged_textures_are_built_anew(cache, place):
    given = images(13, *[(256, 256)] * 3)
    whole = of_place(given, material(0))
    words = words_of(whole, 0).copy()
    del whole
    (file,) = cache()
    content = bytearray(file.read_bytes())
    content[place] ^= 1
    file.unlink()  # a mapped file must not change in place
    file.write_bytes(content)
    np.testing.assert_array_equal(words_of(of_place(given, material(0)), 0), words)


def test_without_room_textures_are_built_each_time(cache, monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_CACHE_LIMIT", "1000")
    given = images(14, *[(256, 256)] * 3)
    first, second = (words_of(of_place(given, material(0)), 0).copy() for _ in range(2))
    np.testing.assert_array_equal(first, second)
    assert not cache()
