"""The data from which the engine paints pictures of an instant, and the part of that data that is reused for other instants."""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import xxhash
from numpy.typing import NDArray

from viewsphere.assets.mesh import Mesh
from viewsphere.codecs.srgb import linear
from viewsphere.engines.raster.indirect.bounce_scene import BounceScenes
from viewsphere.engines.raster.indirect.bounces import bake_bounces, tree_of_scene
from viewsphere.engines.raster.materials.kernels_material import L_BLENDED, L_METAL, L_METAL_TEXEL, L_TRANSMISSION
from viewsphere.engines.raster.materials.surface import Lengths, Materials, Rows, made_of, pack_materials
from viewsphere.engines.raster.options import Options
from viewsphere.engines.raster.records import NO_BOUNCES, Float32, Int32, Surfaces
from viewsphere.engines.raster.reflections.glass import glass_of
from viewsphere.engines.raster.shading import kernels_paint
from viewsphere.engines.raster.shading.painting import Baked
from viewsphere.engines.raster.shadows.occlusion import bake_occlusion, of_ground_alone, with_ground_light
from viewsphere.engines.raster.shadows.shadow_maps import Casters, Extent, bake_lights
from viewsphere.engines.raster.shadows.still_maps import StillMaps
from viewsphere.engines.raster.shadows.thing_occlusion import TargetShades
from viewsphere.engines.raster.sky.environment import bake_surrounding, lamps_on_ground, sky_lights
from viewsphere.engines.shared.arranged import Arranged
from viewsphere.engines.shared.lamps import lamplight
from viewsphere.model.scene import Ground, Scene
from viewsphere.rendering.ground.material import SLABS, ground_albedo, ground_frame, ground_material, only_scatters
from viewsphere.rendering.sky.sky import even_light
from viewsphere.truth.raster.geometry import Geometry, with_blended_colors


@dataclass(frozen=True, eq=False)
class Packed:
    """The materials and surfaces of arranged things. kind, owner, see_through, blended: see `Baked`; maps: those of a
    sequence.
    """

    arranged: Arranged
    lengths: Lengths
    materials: Materials
    rows: Rows
    kind: NDArray[np.uint8]
    owner: Int32
    see_through: NDArray[np.bool_]
    blended: Geometry
    maps: StillMaps | None

    @property
    def surfaces(self) -> Surfaces:
        """The surfaces of all things; see `surface.Rows`."""
        return self.rows.surfaces

    def after_moving(self, arranged: Arranged, ground: Ground | None, lengths: Lengths) -> Packed:
        """The data after things have moved. Do not use this object afterwards: data of moved things is overwritten in place."""
        geometry, same_lengths = arranged.geometry, lengths == self.lengths
        materials = self.materials if same_lengths and self.materials.made_of == made_of(arranged.whole) else None
        is_alike = geometry.triangles is self.arranged.geometry.triangles and arranged.moving == self.arranged.moving
        if materials is None or not is_alike:
            return pack(arranged, ground, lengths, materials)
        self.rows.move(geometry, arranged.meshes, arranged.changed_since(self.arranged))
        is_blended = self.blended is not self.arranged.geometry
        blended = {"alpha_masks": self.blended.alpha_masks, "triangle_cutout": self.blended.triangle_cutout}
        return replace(
            self,
            arranged=arranged,
            blended=replace(geometry, **blended) if is_blended else geometry,
        )


def pack(arranged: Arranged, ground: Ground | None, lengths: Lengths, materials: Materials | None = None) -> Packed:
    """Pack everything anew; materials are reused if you give them."""
    geometry, meshes = arranged.geometry, arranged.meshes
    if materials is None:
        materials = pack_materials(arranged.whole, ground, lengths, arranged.targets, arranged.things)
    rows = Rows.from_geometry(geometry, meshes, materials, lengths)
    surfaces, is_drive = rows.surfaces, arranged.is_sequence and arranged.has_scenery
    rows.write({*range(arranged.targets), *arranged.moving} if is_drive else range(len(meshes)))
    see_through = np.append(_is_see_through(surfaces.looks)[surfaces.material], False)
    kind = np.where(see_through[:-1], kernels_paint.SEE_THROUGH, kernels_paint.SOLID).astype(np.uint8)
    kind[geometry.triangle_start[-1] :] = kernels_paint.FLOOR
    return Packed(
        arranged=arranged,
        lengths=lengths,
        materials=materials,
        rows=rows,
        kind=np.append(kind, np.uint8(kernels_paint.NOTHING)),
        owner=(geometry.triangle_object * len(surfaces.looks) + surfaces.material).astype(np.int32),
        see_through=see_through,
        blended=with_blended_colors(geometry, meshes),
        maps=StillMaps.for_things(rows.part, len(meshes), arranged.moving, arranged.targets) if arranged.is_sequence else None,
    )


def still_lengths(arranged: Arranged) -> Lengths:
    """The lengths for a still picture: half the diagonal of everything, from its middle. With scenery, the unit is the next
    power of two, and the origin is the world's, so that both stay the same when the targets change.
    """
    low, high = arranged.geometry.extent()
    unit = float(np.linalg.norm(high - low)) / 2 or 1.0
    if arranged.has_scenery:
        return Lengths((0.0, 0.0, 0.0), 2.0 ** math.ceil(math.log2(unit)))
    x, y, z = ((low + high) / 2).tolist()
    return Lengths((x, y, z), unit)


def sequence_lengths(meshes: Sequence[Mesh]) -> Lengths:
    """The lengths for all pictures of a sequence, wherever its things are and however it is cut into shots: about half the size
    of the largest thing, from the world's origin.
    """
    sizes = [np.linalg.norm(np.subtract(*mesh.bounds)) for mesh in {id(m): m for m in meshes}.values() if len(mesh.triangles)]
    unit = float(max(sizes, default=0.0)) / 2 or 1.0
    return Lengths((0.0, 0.0, 0.0), 2.0 ** math.ceil(math.log2(unit)))


def bake(packed: Packed, scene: Scene, options: Options, shades: TargetShades, bounce_scenes: BounceScenes) -> Baked:
    """Return the data from which the engine paints pictures of arranged things.

    `shades` caches the occlusion by targets of a sequence, `bounce_scenes` the surfaces that reflect light.
    """
    geometry, surfaces, lengths = packed.arranged.geometry, packed.surfaces, packed.lengths
    has_ground = scene.ground is not None
    casters = _casters(packed, has_ground)
    distant = sky_lights(scene.sky, scene.sun, has_ground)
    arranged = packed.arranged
    middle = np.array(lengths.origin) + lengths.unit * (casters.extent.low + casters.extent.high) / 2
    scene = lamplight(scene, arranged.things, arranged.whole, middle)
    lights = bake_lights(distant, scene.lights, casters, lengths.unit, has_ground, options.shadow_resolution)
    floor, albedo, ground = _floor(scene.ground, lengths, still_lengths(packed.arranged), len(surfaces.looks) - 1)
    lamps = lamps_on_ground(lights, casters.extent)
    surrounding = bake_surrounding(scene.sky, scene.sun, albedo, distant, even_light(scene.lights), lamps)
    if packed.arranged.is_sequence:
        occlusion = shades.bake(packed.arranged, casters, lengths.unit, has_ground, options.ambient_occlusion)
    else:
        occlusion = bake_occlusion(casters, has_ground, options.ambient_occlusion, arranged.targets == 1)
    bounce_scene = bounce_scenes.find(
        packed.arranged, packed.rows, casters, floor, ground, lengths, has_ground, options.bounces
    )
    bounces = NO_BOUNCES if bounce_scene is None else bake_bounces(bounce_scene, surrounding, lights)
    if bounce_scene is not None and bounce_scene.has_map:
        occlusion = of_ground_alone(occlusion)
    return Baked(
        geometry=geometry,
        origin=np.array(lengths.origin),
        unit=lengths.unit,
        surfaces=surfaces,
        rows=packed.rows,
        textures=packed.materials.textures,
        floor=floor,
        surrounding=surrounding,
        lights=lights,
        occlusion=with_ground_light(occlusion, lights, math.pi * float(surrounding.up.sum())),
        kind=packed.kind,
        owner=packed.owner,
        see_through=packed.see_through,
        bounces=bounces,
        blended=packed.blended,
        glass=glass_of(packed.rows),
        bounce_scene=bounce_scene if bounces.grid[0] else None,
        is_fine=options.bounces == "fine",
        tree=tree_of_scene(bounce_scene) if bounce_scene is not None and bounces.grid[0] else None,
    )


def _casters(packed: Packed, has_ground: bool) -> Casters:
    arranged, (corner, unit) = packed.arranged, packed.lengths
    geometry, origin, targets = arranged.geometry, np.array(corner), arranged.targets
    low, high = geometry.extent()
    # A distant light may have any direction: its widest map covers a ball around all corners.
    reach = float(np.linalg.norm(np.abs(np.stack([low, high]) - origin).max(axis=0))) / unit
    ground_z = geometry.ground_z
    if arranged.has_scenery:
        low, high = geometry.extent(targets)
        ground_z = float(low[2])
    floor_z = None if ground_z is None else (ground_z - float(origin[2])) / unit
    extent = Extent((low - origin) / unit, (high - origin) / unit, floor_z, geometry.triangle_start[targets], reach)
    return Casters(
        packed.surfaces,
        packed.materials.textures,
        extent,
        (arranged.things[targets:], arranged.whole[targets:], unit) if arranged.has_scenery else None,
        (arranged.things[:targets], arranged.whole[:targets], has_ground, floor_z, packed.lengths),
        packed.maps,
        None if packed.maps is None else (_corners(geometry.bounds[:targets]) - origin) / unit,
    )


def _corners(bounds: NDArray[np.float64]) -> NDArray[np.float64]:
    """The corners (8 n, 3) of the boxes (N, 2, 3) of present things."""
    there = bounds[np.isfinite(bounds).all(axis=(1, 2))]
    which = np.indices((2, 2, 2)).reshape(3, 8).T
    return there[:, which, np.arange(3)].reshape(-1, 3)


def _is_see_through(looks: Float32) -> NDArray[np.bool_]:
    """A mask of the materials through which anything behind is visible."""
    metal = looks[:, L_METAL] + looks[:, L_METAL_TEXEL]
    return (looks[:, L_BLENDED] > 0) | (looks[:, L_TRANSMISSION] * (1 - metal) > 0)


def _floor(
    ground: Ground | None, lengths: Lengths, around: Lengths, material: int
) -> tuple[Float32, NDArray[np.float64] | None, Hashable]:
    """`Baked.floor`, the ground's mean colour, and a value that is equal for equal grounds; zeros and None without a ground.

    `around` is the extent of everything.
    """
    if ground is None:
        return np.zeros(13, np.float32), None, None
    made, images = ground_material(ground)
    how = 2.0 if ground.catcher else float(only_scatters(ground))
    color = linear(ground.color).tolist()
    frame = ground_frame(ground, made, lengths.origin, lengths.unit)
    middle = (np.array(around.origin) - lengths.origin) / lengths.unit
    slabs = SLABS * ground.has_slabs
    floor = np.array([*frame, material, how, *color, *middle, lengths.unit / around.unit, slabs], np.float32)
    pictures = (xxhash.xxh3_128_hexdigest(np.ascontiguousarray(image.pixels).data) for image in images)
    return floor, ground_albedo(made, images), (made, *pictures)
