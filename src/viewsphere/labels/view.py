"""view: the position of the camera relative to an object."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from viewsphere.geometry.camera import orbit_center
from viewsphere.labels.shared.drawing.lines import notes
from viewsphere.labels.shared.spec import Drawing, Field, Models, ObjectLabel, rendered
from viewsphere.model.sample import ObjectView, Sample

TOLERANCE = 1e-6
"""Tolerance of the camera's position, in metres at the object and as a share of the distance."""


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Azimuth, elevation and distance lead from the object to the camera."""
    for o in rendered(sample):
        middle = o.box3d_object.mean(axis=0)
        center = o.camera_from_object[:3, :3].T @ -o.camera_from_object[:3, 3] - middle
        if sample.known_camera is not None and sample.camera.lens.is_parallel:
            center = o.camera_from_object[2, :3] * (o.camera_from_object[2, :3] @ center)
        view = o.view
        seen = orbit_center(math.radians(view.azimuth_deg), math.radians(view.elevation_deg), view.distance)
        if not np.allclose(center, seen, rtol=0, atol=TOLERANCE * (1 + view.distance)):
            yield f"object {o.id}: its view (azimuth {view.azimuth_deg}, ...) is not where the camera stands"


LABEL = ObjectLabel.from_placement(
    lambda placement: {"view": placement.view},
    name="view",
    meaning="the camera's orbit around the centre of its box",
    axes="object",
    fields=(Field("view", "azimuth, elevation and tilt (degrees) and distance (m)", ObjectView),),
    prove=_prove,
    drawing=Drawing(
        "view",
        lines=notes(lambda o: f"{o.view.azimuth_deg:.0f} {o.view.elevation_deg:.0f} {o.view.tilt_deg:.0f}"),
        key=(("view: azimuth, elevation and tilt of the camera, degrees", None),),
    ),
)
