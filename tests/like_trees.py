"""What recipes in recipes/like write, opened by others' readers where there are some: each is given the recipe's data set."""

from __future__ import annotations

import h5py
import numpy as np
import pandas as pd
from PIL import Image

from torchvision_here import torchvision_here


def records(dataset, pattern):
    """`record` of MATLAB files, with its objects."""
    from scipy.io import loadmat

    for file in sorted(dataset.root.glob(pattern)):
        record = loadmat(file, squeeze_me=True, struct_as_record=False)["record"]
        yield record, np.atleast_1d(record.objects)


def aligned(dataset, folder, pictures):
    """That records name pictures that are there, and objects with a viewpoint and a box inside of the picture."""
    found = list(records(dataset, f"{folder}/Annotations/{pictures}/*.mat" if pictures else f"{folder}/Annotations/*.mat"))
    assert found
    for record, objects in found:
        width, height = record.imgsize[:2]
        for one in objects:
            assert one.viewpoint.distance > 0 and 0 <= one.viewpoint.azimuth < 360
            x0, y0, x1, y1 = one.bbox
            assert 1 <= x0 <= x1 <= width and 1 <= y0 <= y1 <= height


def sscnet(dataset):
    files = sorted(dataset.root.glob("sscnet/depthbin/*/*.bin"))
    assert len(files) == len(dataset)
    for file in files:
        runs = np.frombuffer(file.read_bytes(), "<u4", offset=76).reshape(-1, 2)
        assert runs[:, 1].sum() == 240 * 144 * 240 and {3, 6} <= set(runs[:, 0])  # walls and a chair
        assert np.array(Image.open(file.with_suffix(".png"))).any()


def hdf5(dataset, keys):
    files = sorted(dataset.root.glob("hdf5/*/*.hdf5"))
    assert len(files) == len(dataset)
    for file in files:
        with h5py.File(file) as read:
            assert keys <= set(read)


def surreal(dataset):
    from scipy.io import loadmat

    infos = sorted(dataset.root.glob("surreal/*/run0/*/*_info.mat"))
    assert len(infos) == len({sample.sequence for sample in dataset})
    for file in infos:
        info = loadmat(file)
        frames = info["joints2D"].shape[2]
        parts = loadmat(str(file).replace("_info", "_segm"))
        assert info["joints3D"].shape == (3, 24, frames)
        assert all(parts[f"segm_{number}"].max() <= 24 for number in range(1, frames + 1))
        assert any(parts[f"segm_{number}"].any() for number in range(1, frames + 1))


def icl_nuim(dataset):
    (file,) = dataset.root.glob("tum/**/*.gt.freiburg")
    poses = np.loadtxt(file, ndmin=2)  # number, place, quaternion
    assert poses.shape == (len(dataset), 8)
    assert np.allclose(np.linalg.norm(poses[:, 4:], axis=1), 1, atol=1e-6)


def render_for_cnn(dataset):
    lines = (dataset.root / "render_for_cnn" / "syn_lmdbs" / "all_train.txt").read_text().splitlines()
    assert lines
    for line in lines:
        path, _, azimuth, elevation, tilt = line.split()
        angles = [int(part[1:]) % 360 for part in path.rpartition("/")[2].split("_")[2:5]]  # as data_prep_helper.py does
        assert angles == [int(azimuth), int(elevation), int(tilt)]


def pascal3d(dataset):
    aligned(dataset, "pascal3d", "*_pascal")


def objectnet3d(dataset):
    aligned(dataset, "objectnet3d", "")


def liebelt(dataset):
    aligned(dataset, "pascal3d", "*_pascal")
    hdf5(dataset, {"colors", "nocs"})
    (table,) = dataset.root.glob("csv/**/objects.csv")
    assert len(pd.read_csv(table)) == sum(len(sample.objects) for sample in dataset)


def falling_things(dataset):
    torchvision_here()
    from torchvision.datasets import FallingThingsStereo

    pairs = FallingThingsStereo(dataset.root / "falling_things", variant="mixed")
    assert len(pairs) == len(dataset) / 2
    left, right, disparity = pairs[0][:3]
    assert left.size == right.size and np.isfinite(disparity).all()


def minos(dataset):
    hdf5(dataset, {"colors", "depth", "normals", "class_segmaps", "instance_segmaps", "camera_pose"})


READ = {
    "suncg": sscnet,
    "minos": minos,
    "surreal": surreal,
    "icl_nuim": icl_nuim,
    "render_for_cnn": render_for_cnn,
    "pascal3d": pascal3d,
    "objectnet3d": objectnet3d,
    "liebelt": liebelt,
    "falling_things": falling_things,
}
