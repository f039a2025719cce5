"""The limits within which the shipped lens models are one-to-one."""

from viewsphere.geometry.lenses import LensParameters, brown_conrady, fisheye


def lens_limit(lens: LensParameters) -> float:
    """The largest angle of a fisheye, the largest r/z of Brown and Conrady's model."""
    return {"fisheye": fisheye, "brown_conrady": brown_conrady}[lens.model].limit(lens.coefficients)
