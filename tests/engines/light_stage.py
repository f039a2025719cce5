"""Meshes staged for the light kernels alone, blocks of samples, and Embree's rays through the same triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from called import called
from test_raster import box, mesh_of, rectangle

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.engines.raster.materials.kernels_material import L_CASTS_FROM
from viewsphere.engines.raster.materials.surface import Lengths, Rows, pack_materials
from viewsphere.engines.raster.shading import kernels_block as row
from viewsphere.engines.raster.shadows.kernels_direct_light import arrive
from viewsphere.engines.raster.shadows.kernels_occlusion import occlude
from viewsphere.engines.raster.shadows.occlusion import Occlusion
from viewsphere.engines.raster.shadows.shadow_maps import Casters, Extent, Lights, bake_lights
from viewsphere.geometry.camera import pixel_rays
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.thing import Thing
from viewsphere.truth.raster.geometry import build_geometry
from viewsphere.truth.raster.visibility import rasterize

occluded = called(occlude)
SPEC = ModelSpec(key="model", source="memory", category="thing", category_id=1)
IDENTITY = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))

flat, quad, cuboid = mesh_of, rectangle, box


def ball(radius: float, middle, rings: int = 24) -> Mesh:
    """A sphere of triangles with smooth normals."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, 2 * rings + 1), indexing="ij")
    normal = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1).reshape(-1, 3)
    i, j = (g.ravel() for g in np.meshgrid(np.arange(rings), np.arange(2 * rings), indexing="ij"))
    a = i * (2 * rings + 1) + j
    b = a + 2 * rings + 1
    triangles = np.concatenate([np.stack([a, b, b + 1], 1)[i < rings - 1], np.stack([a, b + 1, a + 1], 1)[i > 0]])
    count = len(triangles)
    return Mesh(
        vertices=(normal * radius + np.asarray(middle)).astype(np.float32),
        triangles=triangles.astype(np.int32),
        normals=normal.astype(np.float32),
        triangle_material=np.zeros(count, np.int32),
        triangle_part=np.zeros(count, np.int32),
        materials=(Material(),),
    )


@dataclass
class Samples:
    """Places on surfaces, world metres; both normals on the viewer's side; a pixel's size, metres; whether on the ground."""

    place: np.ndarray
    smooth: np.ndarray
    normal: np.ndarray
    pixel: np.ndarray
    is_ground: np.ndarray


class LightStage:
    """Meshes on a ground; scenery as (mesh, key)."""

    def __init__(self, *meshes: Mesh, ground: bool = True, scenery: Mesh | None = None):
        everything = [*meshes, *([scenery] if scenery else [])]
        things = [Thing(id=(i + 1) * (i < len(meshes)), model=SPEC, scenery=i >= len(meshes)) for i in range(len(everything))]
        self.ground = ground
        self.geometry = build_geometry(things, everything, ground, 0.5)
        stop = self.geometry.triangle_start[len(meshes)]
        used = self.geometry.vertices[self.geometry.triangles[:stop]].reshape(-1, 3)
        low, high = used.min(axis=0), used.max(axis=0)
        self.origin, self.unit = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
        if scenery is not None:
            self.origin, self.unit = np.zeros(3), 2.0 ** np.ceil(np.log2(np.abs(scenery.vertices).max()))
        lengths = Lengths(tuple(self.origin.tolist()), float(self.unit))
        materials = pack_materials(everything, None, lengths, len(meshes))
        rows = Rows.from_geometry(self.geometry, everything, materials, lengths)
        rows.write(range(len(everything)))
        self.surfaces, self.textures = rows.surfaces, materials.textures
        low, high, floor = (low - self.origin) / self.unit, (high - self.origin) / self.unit, None
        if ground or scenery is not None:
            floor = float(low[2])
        reach = float(np.abs(self.surfaces.vertices[: self.geometry.vertex_start[-1], 11:14]).max())
        key = None if scenery is None else id(scenery)
        self.casters = Casters(self.surfaces, self.textures, Extent(low, high, floor, stop, reach), key)

    def lights(self, distant=(), lights=(), resolution: int = 2048) -> Lights:
        return bake_lights(distant, lights, self.casters, self.unit, self.ground, resolution)

    def seen(self, camera: Camera) -> Samples:
        """What a camera sees, a sample a pixel."""
        visible = rasterize(self.geometry, camera)
        i, j = np.nonzero(visible.triangle >= 0)
        triangle, inverse = visible.triangle[i, j], visible.inverse_depth[i, j]
        place = camera.center + (pixel_rays(camera.intrinsics)[i, j] / inverse[:, None]) @ camera.R
        g = self.geometry
        a, b, c = (g.vertices[g.triangles[triangle, k]] for k in range(3))
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        weights = np.stack(
            [
                np.linalg.norm(np.cross(p - place, q - place), axis=1) / np.maximum(area, 1e-30)
                for p, q in ((b, c), (c, a), (a, b))
            ]
        )
        smooth = sum(weights[k, :, None] * g.normals[g.triangles[triangle, k]] for k in range(3))
        toward = camera.center - place
        normal = g.triangle_normals[triangle].astype(float)
        normal *= np.where((normal * toward).sum(axis=1) < 0, -1, 1)[:, None]
        smooth *= np.where((normal * smooth).sum(axis=1) < 0, -1, 1)[:, None]
        smooth /= np.linalg.norm(smooth, axis=1, keepdims=True) + 1e-20
        pixel = 1 / inverse / camera.intrinsics.fx
        return Samples(place, smooth, normal, pixel, triangle >= self.geometry.triangle_start[-1])

    def arrives(self, lights: Lights, which: int, s: Samples) -> dict[str, np.ndarray]:
        """toward (n, 3), irradiance (n, 3) facing the light with its shadows, share and width (n,)."""
        found = self._in_blocks(lambda n, b: arrive(n, lights, which, b), s, "LX LY LZ IR IG IB SHARE WIDTH")
        return {"toward": found[:, :3], "irradiance": found[:, 3:6] * found[:, 6:7], "share": found[:, 6], "width": found[:, 7]}

    def occlusion(self, baked: Occlusion, s: Samples) -> np.ndarray:
        """OPEN and BOUNCE, (n, 2)."""
        result = np.zeros((len(s.place), 2))
        for ground in (False, True):
            part = s.is_ground == ground
            own = Samples(s.place[part], s.smooth[part], s.normal[part], s.pixel[part], s.is_ground[part])
            result[part] = self._in_blocks(lambda n, b: occluded(n, baked, b), own, "OPEN BOUNCE")
        return result

    def _in_blocks(self, kernel, s: Samples, rows: str) -> np.ndarray:
        names = rows.split()
        inputs = np.concatenate(
            [((s.place - self.origin) / self.unit).T, s.smooth.T, s.normal.T, s.pixel[None] / self.unit, s.is_ground[None]]
        )
        own = ["PX", "PY", "PZ", "NX", "NY", "NZ", "GX", "GY", "GZ", "PIXEL", "GROUND"]
        found = np.zeros((len(s.place), len(names)), np.float32)
        for start in range(0, len(s.place), row.BLOCK):
            count = min(row.BLOCK, len(s.place) - start)
            b = np.zeros(row.ROWS * row.BLOCK, np.float32)
            b[row.AO : row.AO + row.BLOCK] = 1
            for name, values in zip(own, inputs, strict=True):
                at = getattr(row, name)
                b[at : at + count] = values[start : start + count]
            kernel(count, b)
            for k, name in enumerate(names):
                at = getattr(row, name)
                found[start : start + count, k] = b[at : at + count]
        return found

    def rays(self):
        """Embree's scene of all that casts shadows."""
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        scene = EmbreeScene()
        stop = self.geometry.triangle_start[-1]
        casts = self.surfaces.looks[self.surfaces.material[:stop], L_CASTS_FROM] <= 1
        corners = self.geometry.vertices[self.geometry.triangles[:stop][casts]]
        TriangleMesh(scene, np.ascontiguousarray(corners.astype(np.float32)))
        return scene


def distances(scene, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """How far each ray gets, infinity where it meets nothing."""
    found = scene.run(origins.astype(np.float32), directions.astype(np.float32), query="DISTANCE").astype(float)
    return np.where(found > 1e30, np.inf, found)


def points(place, normal, pixel: float = 1e-3, is_ground: bool = False) -> Samples:
    """Samples at these places (n, 3) of a flat surface."""
    place = np.asarray(place, float).reshape(-1, 3)
    normal = np.broadcast_to(np.asarray(normal, float), place.shape)
    return Samples(place, normal, normal, np.full(len(place), pixel), np.full(len(place), is_ground))
