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
from viewsphere.model.files import Files
from viewsphere.run.exporting import export
from viewsphere.store import Dataset, decode
from viewsphere.store.checksums import damaged_files
from viewsphere.store.manifest import Manifest

FLIPS = [pytest.param(100, marks=pytest.mark.slow, id="100"), pytest.param(12, id="12")]
"""Bits of each kind of file."""

KINDS = {
    "default": Files(),
    "lossy": Files(rgb="jpeg", rgba="webp", quality=80, depth="png16", depth_unit=0.001, masks="png8", geometry="npz"),
    "exact": Files(rgb="webp", depth="exr", geometry="exr"),
}
CHECKED = {"tiff", "png"}
"""Files whose readers see damage without a manifest: they carry checksums."""


@pytest.fixture(scope="module", params=KINDS)
def finished(request, tmp_path_factory):
    dataset = make(tmp_path_factory.mktemp("flips") / "out", files=KINDS[request.param], ground=True)
    export(dataset.root, ["coco", "native"])
    return dataset


def kinds(root):
    """The files by what they are: their paths without numbers, and without the digits that shots are spread by."""
    found = defaultdict(list)
    for file in sorted(root.rglob("*")):
        if file.is_file() and file.name != "lock":  # which is empty
            path = re.sub(r"shots/../", "shots/", file.relative_to(root).as_posix())
            found[re.sub(r"\d+", "#", path)].append(file)
    return found


def flipped(data, bit):
    other = bytearray(data)
    other[bit // 8] ^= 1 << bit % 8
    return bytes(other)


def is_noticed(dataset, file):
    """Whether the proofs of digests, which `check` begins with, see that a file was changed."""
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


@pytest.mark.parametrize("flips", FLIPS)
def test_every_flipped_bit_is_found(finished, flips):
    rng, missed = np.random.default_rng(7), []
    groups = kinds(finished.root)
    assert len(groups) > 30
    for kind, files in groups.items():
        file = files[len(files) // 2]
        data = file.read_bytes()
        for bit in rng.integers(0, 8 * len(data), flips).tolist():
            file.write_bytes(flipped(data, bit))
            if not is_noticed(finished, file):
                missed.append((kind, bit))
        file.write_bytes(data)
    assert missed == []
    assert check(finished, sample=0, rays=False).ok


@pytest.mark.parametrize("flips", FLIPS)
def test_readers_see_every_flip(finished, flips):
    """No array comes out of a damaged file; where files carry checksums, codecs see that without the manifest's digest."""
    rng, sample = np.random.default_rng(7), finished[5]
    for name, inside in sample.files.items():
        file = finished.path(inside)
        data, whole = file.read_bytes(), sample.channels[name]
        for bit in rng.integers(0, 8 * len(data), flips).tolist():
            file.write_bytes(flipped(data, bit))
            with pytest.raises(StoreError):
                Dataset(finished.root)[5].channels[name]
            if file.suffix[1:] in CHECKED:
                with suppress(StoreError):  # or else it is a bit that nothing depends on, such as those that fill the last byte
                    assert np.array_equal(decode(channels()[name], file), whole, equal_nan=True), (name, bit)
        file.write_bytes(data)
        assert np.array_equal(Dataset(finished.root)[5].channels[name], whole, equal_nan=True)
