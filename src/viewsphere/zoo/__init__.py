"""Procedural models that ship with the tool, in metres, front -Y, up +Z, standing on z = 0.

A family is one module of this package, named as its file: `NAME(...)` builds a Mesh from parameters and `NAME_random(rng)`
draws the parameters; `NAME_sized(rng, (width, height, length))`, where a family has it, draws those that its size leaves open.
`KEYPOINTS` of a family are its named points by its parts, and `SKELETON` lines between them. Sub-packages
hold the parts that families are built from.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from viewsphere import plugins

if TYPE_CHECKING:
    import numpy as np

    from viewsphere.assets.mesh import Mesh
    from viewsphere.model.model_spec import ModelSpec


def families() -> tuple[str, ...]:
    """Names of all families, sorted; none is imported."""
    return plugins.families()


def build(family: str, rng: np.random.Generator) -> Mesh:
    """A random member of the family; the same generator state gives the same bytes.

    Raises UserError for an unknown family, with the nearest known one.
    """
    return getattr(plugins.family(family), f"{family}_random")(rng)


def build_zoo_model(spec: ModelSpec) -> Mesh:
    """The procedural model that a `zoo:family` source names, drawn from its seed, and built to the size that it asks for."""
    import numpy as np

    family, rng = spec.source.removeprefix("zoo:"), np.random.default_rng(spec.seed)
    return build(family, rng) if spec.size is None else getattr(plugins.family(family), f"{family}_sized")(rng, spec.size)


def real_size(mesh: Mesh) -> tuple[float, float, float]:
    """Width, height, length (extent along x, z, y) of a mesh in metres, since a zoo mesh is modelled at real size."""
    low, high = mesh.bounds
    x, y, z = (high - low).tolist()
    return x, z, y
