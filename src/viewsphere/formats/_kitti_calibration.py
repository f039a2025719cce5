"""KITTI's projection matrices, as its files of calibration have them."""

from __future__ import annotations

from viewsphere.model.sample import Sample


def projection(sample: Sample, baseline: float = 0.0) -> str:
    """The (3, 4) matrix, row by row, from the axes of the left camera, which took the sample, to the pixels (0, 0 a centre) of
    one so many metres to its right.
    """
    lens = sample.camera.intrinsics
    rows = (
        (lens.fx, lens.skew, lens.cx - 0.5, -lens.fx * baseline),
        (0.0, lens.fy, lens.cy - 0.5, 0.0),
        (0.0, 0.0, 1.0, 0.0),
    )
    return " ".join(repr(float(value)) for row in rows for value in row)


def rectified(sample: Sample, baseline: float) -> bytes:
    """The lines of calib_cam_to_cam.txt of the colour cameras, 02 and, where the baseline is not 0, 03."""
    eyes = {"02": 0.0, "03": baseline} if baseline else {"02": 0.0}
    size = f"{sample.width} {sample.height}"
    return "".join(f"S_rect_{i}: {size}\nP_rect_{i}: {projection(sample, x)}\n" for i, x in eyes.items()).encode()
