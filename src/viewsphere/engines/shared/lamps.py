"""The lights of a night: lamps of a place as spotlights, brighter glowing surfaces, and some lit windows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.geometry.rotation import transform
from viewsphere.model.scene import Scene, SpotLight
from viewsphere.model.thing import Thing
from viewsphere.model.weather import Lamps

Float = NDArray[np.float64]

LENS, WINDOW = "lens", "window"
"""Names of parts of scenery: the part through which a lamp shines, and the part that may be lit from inside."""

GLOW = 9.0
"""Brightness by day of glowing surfaces except screens, as a factor."""

SCREEN = "screen"
"""Name of the material of screens, which are not brighter at night."""

ROOM = (0.62, 0.42, 0.2)
"""Radiance of a window that is lit from inside, linear."""

APART = 1.6
"""Metres between the middles of triangles above which they belong to different windows."""

BELOW = 0.06
"""Metres below its lens at which a lamp's light begins, so that the lens hides none."""

CONE = 150.0  # degrees: a street lamp lights its post and the road, not the sky


def lamplight(scene: Scene, things: Sequence[Thing], meshes: Sequence[Mesh], middle: Float) -> Scene:
    """The scene with lights for the lamps of its place that are nearest to the world's origin.

    `middle` (3,) is the middle of the targets, from which lights are measured. The selection of lamps does not depend on the
    places of targets and cameras.
    """
    lamps = scene.lamps
    if lamps is None or not lamps.most:
        return scene
    found = [place for thing, mesh in zip(things, meshes, strict=True) if thing.scenery for place in _lenses(thing, mesh)]
    nearest = sorted(found, key=lambda place: (round(float(np.hypot(place[0], place[1])), 3), *place.round(3)))[: lamps.most]
    return scene.model_copy(update={"lights": (*scene.lights, *(_spot(place - middle, lamps) for place in nearest))})


def _lenses(thing: Thing, mesh: Mesh) -> list[Float]:
    """Return the places, in world metres, where light begins below a thing's lens; empty if it has no lens or is absent."""
    if LENS not in mesh.parts or not thing.is_there:
        return []
    triangles = mesh.triangles[mesh.triangle_part == mesh.parts.index(LENS)]
    if not len(triangles):
        return []
    corners = transform(thing.world_from_object, mesh.vertices[np.unique(triangles)].astype(np.float64))
    x, y, _ = (corners.min(axis=0) + corners.max(axis=0)) / 2
    return [np.array([x, y, corners[:, 2].min() - BELOW])]


def _spot(place: Float, lamps: Lamps) -> SpotLight:
    x, y, z = (float(f"{value:.9g}") for value in place.tolist())
    down = (x, y, z - 1.0)
    return SpotLight(
        position=(x, y, z), toward=down, angle_deg=CONE, blend=0.7, radius=0.12, strength=lamps.strength, color=lamps.color
    )


def lit(things: Sequence[Thing], meshes: Sequence[Mesh], lamps: Lamps) -> tuple[Mesh, ...]:
    """The things' meshes with glowing materials as bright as at night; in scenery, a share of the windows is lit. Things with
    the same mesh share one, except things with windows.
    """
    found = {id(mesh): _glowing(mesh) for mesh in meshes}
    return tuple(_with_windows(found[id(mesh)], thing, lamps.windows) for thing, mesh in zip(things, meshes, strict=True))


def _glowing(mesh: Mesh) -> Mesh:
    if not any(map(_is_lamp, mesh.materials)):
        return mesh
    return replace(
        mesh, materials=tuple(_brighter(material) if _is_lamp(material) else material for material in mesh.materials)
    )


def _is_lamp(material: Material) -> bool:
    return max(material.emissive) > 0 and material.name != SCREEN


def _brighter(material: Material) -> Material:
    r, g, b = material.emissive
    return replace(material, emissive=(GLOW * r, GLOW * g, GLOW * b))


def _with_windows(mesh: Mesh, thing: Thing, share: float) -> Mesh:
    if not thing.scenery or WINDOW not in mesh.parts or not thing.motion.is_still:
        return mesh
    own = np.flatnonzero(mesh.triangle_part == mesh.parts.index(WINDOW))
    shining = own[_are_lit(mesh, own, thing, share)]
    if not len(shining):
        return mesh
    material = mesh.triangle_material.copy()
    material[shining] += len(mesh.materials)
    rooms = tuple(replace(m, emissive=ROOM) for m in mesh.materials)
    return replace(mesh, materials=(*mesh.materials, *rooms), triangle_material=material)


def _are_lit(mesh: Mesh, own: NDArray[np.intp], thing: Thing, share: float) -> NDArray[np.bool_]:
    """Return a mask of these triangles (n,), true on lit windows; the random draw for each window is keyed by the thing's
    place.
    """
    middles = mesh.vertices[mesh.triangles[own]].mean(axis=1)
    step = np.linalg.norm(np.diff(middles, axis=0, prepend=middles[:1]), axis=1)
    window = np.cumsum(step > APART)
    x, y = (round(1000 * row[3]) for row in thing.world_from_object[:2])
    rng = np.random.default_rng([abs(x), abs(y), int(x < 0), int(y < 0)])
    return (rng.random(int(window[-1]) + 1) < share)[window]
