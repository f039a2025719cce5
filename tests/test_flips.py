"""Bits flipped at random, in every kind of file that a finished data set has."""

import re
from collections import defaultdict
from contextlib import suppress

import numpy as np
import pytest

from cube_dataset import make
from viewsphere.check import check
from viewsphere.errors import StoreError, UserError
from viewsphere.labels import channels
from viewsphere.model.fields.files import Files
from viewsphere.run.exports.exporting import export
from viewsphere.store import Dataset, decode
from viewsphere.store.shots.checksums import damaged_files
from viewsphere.store.shots.manifest import Manifest

KINDS = {
    "default": Files(),
    "lossy": Files(rgb="jpeg", rgba="webp", quality=80, depth="png16", depth_unit=0.001, masks="png8", geometry="npz"),
    "exact": Files(rgb="webp", depth="exr", geometry="exr"),
}
CHECKED = {"tiff", "png"}
"""Files whose readers see damage without a manifest: they carry checksums."""

SEALED = {"plan.json", "manifest.json", "checksums.xxh#"}
"""Files that prove themselves: where a bit lies in them makes a difference, where digests of whole files prove others."""


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    made = []
    for name, files in KINDS.items():
        made.append(make(tmp_path_factory.mktemp(name) / "out", files=files, ground=True))
        export(made[-1].root, ["coco", "native"])
    return made


def kinds(root):
    """The files by what they are: their paths without numbers, and without the digits that shots are spread by."""
    found = defaultdict(list)
    for file in sorted(root.rglob("*")):
        if file.is_file() and file.name != "lock":  # which is empty
            path = re.sub(r"shots/../", "shots/", file.relative_to(root).as_posix())
            found[re.sub(r"\d+", "#", path)].append(file)
    return found


def flips(file, count):
    """A file, damaged by one bit after another: the first, the last, and some between. It is whole again after them."""
    data = file.read_bytes()
    last = 8 * len(data) - 1
    for bit in (0, last, *np.random.default_rng(7).integers(1, last, count - 2).tolist()):
        other = bytearray(data)
        other[bit // 8] ^= 1 << bit % 8
        file.write_bytes(other)
        yield bit
    file.write_bytes(data)


def is_noticed(dataset, file):
    """Return whether the proofs of digests, which `check` begins with, see that a file was changed."""
    inside = file.relative_to(dataset.root).parts
    if inside[0] != "store":
        return any(damaged_files(dataset.root / inside[0]))
    if len(inside) == 2:
        try:
            return bool(Dataset(dataset.root) and dataset.store.skipped() is None)
        except UserError:
            return True
    folder = dataset.root.joinpath(*inside[: 4 if inside[1] == "shots" else 3])
    try:
        return any(Manifest.read(folder).damage(folder))
    except UserError:
        return True


@pytest.mark.slow
@pytest.mark.parametrize(("count", "names"), [(8, None), (100, SEALED)])
def test_every_flipped_bit_is_found(finished, count, names):
    missed, tried = [], set()
    for dataset in finished:
        groups = kinds(dataset.root)
        assert len(groups) > 30
        for kind, files in groups.items():
            if kind not in tried and (names is None or kind.rpartition("/")[2] in names):
                tried.add(kind)
                file = files[len(files) // 2]
                missed += [(kind, bit) for bit in flips(file, count) if not is_noticed(dataset, file)]
        assert missed == []
        assert check(dataset, sample=0, rays=False).ok
    assert len(tried) >= (70 if names is None else len(SEALED) + 2)


@pytest.mark.slow
@pytest.mark.parametrize(("count", "suffixes"), [(8, None), (100, CHECKED)])
def test_readers_see_every_flip(finished, count, suffixes):
    """No array comes out of a damaged file; where files carry checksums, codecs see that without the manifest's digest."""
    tried = set()
    for dataset in finished:
        sample = dataset[5]
        for name, inside in sample.files.items():
            file, whole = dataset.path(inside), sample.channels[name]
            suffix = file.suffix[1:]
            if (name, suffix) in tried or (suffixes and suffix not in suffixes):
                continue
            tried.add((name, suffix))
            for bit in flips(file, count):
                with pytest.raises(StoreError):
                    Dataset(dataset.root)[5].channels[name]
                if suffix in CHECKED:
                    with suppress(StoreError):  # or else it is a bit that nothing depends on, as those that fill the last byte
                        assert np.array_equal(decode(channels()[name], file), whole, equal_nan=True), (name, bit)
            assert np.array_equal(Dataset(dataset.root)[5].channels[name], whole, equal_nan=True)
    assert {suffix for _, suffix in tried} == (suffixes or {"tiff", "png", "npz", "exr", "jpg", "webp"})
