"""Readers of files of flow, disparity and depth, written from the formats' descriptions; they know nothing of the writers.

.flo: https://vision.middlebury.edu/flow/code/flow-code/README.txt; PFM: http://www.pauldebevec.com/Research/HDR/PFM/;
KITTI: the readme of its development kit; .dpt and .cam: the readme of Sintel's depth archive.
"""

from __future__ import annotations

import struct

import cv2
import numpy as np
from PIL import Image

TAG = 202021.25
"""The number that .flo, .dpt and .cam begin with."""


def read_tagged(path, components):
    """.flo (2 components) or .dpt (1): (H, W) or (H, W, 2) float32."""
    data = path.read_bytes()
    tag, width, height = struct.unpack_from("<fii", data)
    assert tag == TAG
    pixels = np.frombuffer(data, "<f4", offset=12)
    return pixels.reshape((height, width) if components == 1 else (height, width, components))


def read_cam(path):
    """The intrinsic matrix (3, 3), and the motion from world to camera (3, 4)."""
    data = path.read_bytes()
    assert struct.unpack_from("<f", data)[0] == TAG and len(data) == 4 + 8 * 21
    numbers = np.frombuffer(data, "<f8", offset=4)
    return numbers[:9].reshape(3, 3), numbers[9:].reshape(3, 4)


def read_pfm(path):
    """(H, W) or (H, W, 3) float32, as OpenCV reads it, which turns colours around."""
    found = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert found is not None and found.dtype == np.float32
    return found if found.ndim == 2 else found[..., ::-1]


def read_flow_png(path):
    """KITTI's flow (H, W, 2), pixels, and where it is valid, (H, W)."""
    blue, green, red = np.moveaxis(cv2.imread(str(path), cv2.IMREAD_UNCHANGED).astype(np.float64), -1, 0)
    return np.dstack((red, green)) / 64 - 512, blue > 0


def read_picture(path):
    """Pixels as Pillow reads them."""
    with Image.open(path) as opened:
        return np.asarray(opened)


def of(dataset, sequence, sensor="left"):
    """A sensor's samples of a sequence."""
    return dataset.sequence(sequence, sensor)
