"""The raster engine's stage: everything baked, ready to be seen from any camera."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Mesh
from viewsphere.engines.raster import kernels_edge, kernels_shade
from viewsphere.engines.raster.background import plain_background
from viewsphere.engines.raster.light import Extent, bake_light
from viewsphere.engines.raster.options import Options, parse_options
from viewsphere.engines.raster.records import Float32, Int32, Light, Surfaces, Textures, View
from viewsphere.engines.raster.surface import BLENDED, TRANSMISSION, pack_surfaces
from viewsphere.engines.raster.tone import EXPOSURE, KNEE, srgb_bytes
from viewsphere.geometry.camera import inverse_camera_matrix, pixel_rays
from viewsphere.model.camera import Camera, Intrinsics
from viewsphere.model.scene import Background, Scene
from viewsphere.model.shot import Frame, ModelSpec, Placement, Shot
from viewsphere.truth.geometry import Geometry, build_geometry
from viewsphere.truth.visibility import Visibility, rasterize

_KNEE = np.float32(KNEE)
_NO_INDEX = np.zeros(0, np.int32)


@dataclass(frozen=True, eq=False)
class RasterStage:
    """A scene baked for shading; `color` paints it."""

    geometry: Geometry
    scene: Scene
    options: Options
    origin: NDArray[np.float64]
    unit: float
    surfaces: Surfaces
    textures: Textures
    light: Light
    owner: Int32
    seen: NDArray[np.bool_]
    see_through: NDArray[np.bool_]
    _backgrounds: dict[tuple[Background, int, int], Float32 | None] = field(default_factory=dict)
    _rays: dict[tuple[Intrinsics, int], Float32] = field(default_factory=dict)

    def color(self, camera: Camera, frame: Frame, visibility: Visibility) -> NDArray[np.uint8]:
        """The picture, (H, W, 3) uint8 sRGB; `visibility` is truth's buffer for this camera.

        Edge pixels are the mean of their four quarters in linear light. Raises UserError for an unreadable
        background image.
        """
        background = self._background(camera, (frame.finish or self.scene.finish).background)
        color = background.copy()
        triangle, depth = visibility.triangle.reshape(-1), visibility.inverse_depth.reshape(-1)
        self._paint(camera, 1, _NO_INDEX, triangle, depth, color)
        if self.options.antialias == 4:
            self._smooth_edges(camera, visibility, background, color)
        shape = camera.height, camera.width, 3
        return kernels_edge.encode(color, srgb_bytes()).reshape(shape)

    def _background(self, camera: Camera, background: Background) -> Float32:
        """Display-linear colours behind everything, (H * W, 3)."""
        key = (background, camera.width, camera.height)
        if key not in self._backgrounds:
            self._backgrounds.clear()
            self._backgrounds[key] = plain_background(*key)
        plain = self._backgrounds[key]
        if plain is not None:
            return plain
        view = self._view(camera, 1)
        return kernels_edge.sky_picture(view, self.light, _KNEE, camera.width * camera.height)

    def _smooth_edges(self, camera: Camera, visibility: Visibility, background: Float32, color: Float32) -> None:
        fine = rasterize(self.geometry, camera, subdivision=2)
        pixels = kernels_edge.edge_pixels(
            visibility.triangle, visibility.inverse_depth, fine.triangle, fine.inverse_depth,
            self.owner, self.geometry.triangle_normals,
        )  # fmt: skip
        where, triangle, depth, samples = kernels_edge.quarters(
            pixels, camera.width, fine.triangle, fine.inverse_depth, background
        )
        self._paint(camera, 2, where, triangle, depth, samples)
        kernels_edge.average_quarters(pixels, samples, color)

    def _paint(self, camera: Camera, subdivision: int, where: Int32, triangle: Int32, depth: Float32, color: Float32) -> None:
        """Shade samples over `color`; see-through surfaces over the nearest solid one behind them."""
        view = self._view(camera, subdivision)
        front = kernels_edge.seen_samples(triangle, self.see_through)
        if len(front):
            solid = rasterize(self._solid(), camera, subdivision)
            indices = where[front] if len(where) else front
            behind, behind_depth = np.full_like(triangle, -1), np.zeros_like(depth)
            behind[front] = solid.triangle.reshape(-1)[indices]
            behind_depth[front] = solid.inverse_depth.reshape(-1)[indices]
            self._shade(view, where, behind, behind_depth, color)
        self._shade(view, where, triangle, depth, color)

    def _shade(self, view: View, where: Int32, triangle: Int32, depth: Float32, color: Float32) -> None:
        slots = kernels_edge.seen_samples(triangle, self.seen)
        kernels_shade.shade(view, self.surfaces, self.textures, self.light, _KNEE, slots, where, triangle, depth, color)

    def _solid(self) -> Geometry:
        """The geometry without its see-through surfaces."""
        hidden = np.where(self.see_through[:-1], np.int32(-2), self.geometry.triangle_cutout)
        return replace(self.geometry, triangle_cutout=hidden.astype(np.int32))

    def _view(self, camera: Camera, subdivision: int) -> View:
        lens = inverse_camera_matrix(camera.intrinsics)[:2] / [subdivision, subdivision, 1.0]
        rays = np.zeros((0, 3), np.float32)
        if camera.distortion is not None:
            key = camera.intrinsics, subdivision
            if key not in self._rays:
                table = pixel_rays(camera.intrinsics, subdivision)
                self._rays[key] = table.astype(np.float32).reshape(-1, 3)
            rays = self._rays[key]
        return View(
            ((camera.center - self.origin) / self.unit).astype(np.float32),
            camera.R.astype(np.float32),
            lens.astype(np.float32),
            rays,
            np.uint32(camera.width * subdivision),
            np.float32(1 / np.sqrt(camera.intrinsics.fx * camera.intrinsics.fy)),
            np.float32(1 / self.unit),
        )


def build_stage(shot: Shot, load: Callable[[ModelSpec], Mesh]) -> RasterStage:
    """Build everything that the shot's frames share."""
    options = parse_options(shot.engine_options)
    loaded: dict[ModelSpec, Mesh] = {}
    meshes: list[Mesh] = []
    for placement in shot.placements:
        if placement.model not in loaded:
            loaded[placement.model] = load(placement.model)
        meshes.append(loaded[placement.model])
    scene = shot.scene
    geometry = build_geometry(shot.placements, meshes, scene.ground is not None, shot.label_alpha)
    targets = sum(not p.scenery for p in shot.placements)
    return _baked(geometry, meshes, shot.placements[targets:], scene, options)


def _baked(
    geometry: Geometry, meshes: Sequence[Mesh], scenery: tuple[Placement, ...], scene: Scene, options: Options
) -> RasterStage:
    """Lengths are in units of all there is; where there is scenery, from the world's origin, so that they stay the same when
    the targets change.
    """
    targets = len(meshes) - len(scenery)
    low, high = _bounds(geometry, geometry.triangle_start[-1])
    origin, unit = (low + high) / 2, float(np.linalg.norm(high - low)) / 2 or 1.0
    exposure = EXPOSURE * 2.0**options.exposure
    ground_z = geometry.ground_z
    if scenery:
        origin, unit = np.zeros(3), 2.0 ** math.ceil(math.log2(unit))
    surfaces, textures = pack_surfaces(geometry, meshes, scene.ground, origin, unit, exposure, targets)
    reach = float(np.abs(np.stack([low, high]) - origin).max()) / unit
    if scenery:
        low, high = _bounds(geometry, geometry.triangle_start[targets])
        ground_z = float(low[2])
    floor = None if ground_z is None else (ground_z - float(origin[2])) / unit
    extent = Extent((low - origin) / unit, (high - origin) / unit, floor, geometry.triangle_start[targets], reach)
    known = (scenery, tuple(meshes[targets:]), unit) if scenery else None
    light = bake_light(scene, extent, surfaces, textures, exposure, options.shadow_resolution, known)
    own = surfaces.materials[surfaces.material]
    see_through = np.append((own[:, BLENDED] > 0) | (own[:, TRANSMISSION] > 0), False)
    seen = np.append(np.ones(len(own), np.bool_), False)
    owner = (geometry.triangle_object * len(surfaces.materials) + surfaces.material).astype(np.int32)
    return RasterStage(geometry, scene, options, origin, unit, surfaces, textures, light, owner, seen, see_through)


def _bounds(geometry: Geometry, triangles: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lowest and highest corner of the first so many triangles."""
    is_used = np.zeros(len(geometry.vertices), np.bool_)
    is_used[geometry.triangles[:triangles]] = True
    used = geometry.vertices[is_used]
    return (used.min(axis=0), used.max(axis=0)) if len(used) else (np.zeros(3), np.zeros(3))
