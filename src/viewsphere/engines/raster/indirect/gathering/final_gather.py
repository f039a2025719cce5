"""The gathering of light on surfaces for which probes are too coarse.

Light is gathered at the nodes of lightmaps, at sites on surfaces that are not flat, and at patches outside the lightmaps.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster.indirect.emissive_triangles import EmissiveTriangles
from viewsphere.engines.raster.indirect.gathering.patch_rays import PatchRays
from viewsphere.engines.raster.indirect.kernels_probes import SKY, send_around
from viewsphere.engines.raster.indirect.radiosity_patches import Patches, Rays
from viewsphere.engines.raster.lightmaps import kernels_lightmap as kernels
from viewsphere.engines.raster.lightmaps.lightmaps import Charts, charts_of
from viewsphere.engines.raster.lightmaps.vertex_light import NEAR, Facets, Sites, numbered, openness, vertex_light_of
from viewsphere.engines.raster.records import NO_LIGHTMAP, Float32, Int32, Lightmap
from viewsphere.engines.raster.reflections.tracing import Tree, cast
from viewsphere.engines.raster.sky.environment import Surrounding, sky_along

NODE_RAYS, SITE_RAYS = 256, 128
"""Number of rays of a node of the lightmap, and of a site."""

FINER = 4
"""Factor by which fine light uses more rays: with fewer, walls are blotchy by 2 of 255."""


class Spots(NamedTuple):
    """Places that gather light: their rays, local (R, K, 3) in axes (W, 3, 3), see `kernels_lightmap`, and the weight of each
    place, (N,).
    """

    rays: Rays
    local: Float32
    axes: Float32
    counted: Float32

    @classmethod
    def from_rays(
        cls,
        tree: Tree,
        origins: Float32,
        ways: tuple[Float32, Int32],
        frame: tuple[Float32, Float32],
        normals: Float32,
        cell: float,
        is_inside_out: bool,
    ) -> Spots:
        """The result of casting rays from origins (N, 3) in these ways: directions and turns. normals (T, 3): those of the
        tree's triangles.
        """
        met, far = cast(tree, origins, *ways, np.inf)
        counted = np.empty(len(origins), np.float32)
        kernels.count_in(met, far, *ways, normals, np.float32(cell), is_inside_out, counted)
        return cls(Rays(origins, *ways, met, far), *frame, counted)

    def from_afar(
        self,
        ids: Int32,
        surrounding: Surrounding,
        tree: Tree,
        emissive: EmissiveTriangles,
        turns: int,
        emitted: Float32,
        off: float,
    ) -> Float32:
        """Return the light of the sky, the distant ground and emissive triangles, (N, COLUMNS). Emissive triangles send
        `emitted` (M, 3).

        ids (K, N): the patches that the rays hit.
        """
        rays, light = self.rays, np.zeros((len(self.counted), kernels.COLUMNS), np.float32)
        kernels.see(ids, rays.turn, self.local, _sky(surrounding, rays, ids), surrounding.below, light)
        if len(emissive.points):
            places = rays.origins, rays.turn, self.axes, turns, emissive.points
            near = ids, rays.far, self.local, emissive.froms, emitted
            kernels.shine_on(tree, *places, *near, np.float32(off), light)
        return light

    def receive(self, ids: Int32, sent: Float32, far: Float32, nodes: Float32) -> None:
        """Set nodes (N, COLUMNS) to the light that patches send, (M, 3), plus the light from far away."""
        nodes[:] = far
        kernels.receive(ids, self.rays.turn, self.local, sent, self.counted, nodes)


def _sky(surrounding: Surrounding, rays: Rays, ids: Int32) -> Float32:
    """The sky's light along directions (W, K, 3), computed only for directions in which some ray reaches it."""
    is_seen = np.zeros(rays.directions.shape[:2], np.bool_)
    k, i = np.nonzero(ids == SKY)
    is_seen[rays.turn[i], k] = True
    sky = np.zeros_like(rays.directions)
    sky[is_seen] = sky_along(surrounding, rays.directions[is_seen])
    return sky


class Round(NamedTuple):
    """Sites on the triangles without a chart, these triangles, and the sites' rays."""

    sites: Sites
    facets: Facets
    spots: Spots


class Look(NamedTuple):
    """The parts of the gathering that do not depend on light: for flat surfaces, and for all others, None if there are no
    others.
    """

    charts: Charts
    nodes: Spots
    round: Round | None

    @property
    def rays(self) -> list[Rays]:
        """The rays of the nodes, then those of the sites."""
        return [self.nodes.rays, *([self.round.spots.rays] if self.round else [])]

    def alone(self, patches: Patches) -> Int32:
        """The patches that no chart lights."""
        chart = np.where(patches.triangles >= 0, self.charts.chart[patches.triangles], -1)
        normals = self.charts.charts[chart, kernels.NORMAL : kernels.NORMAL + 3]
        is_mapped = (chart >= 0) & ((normals * patches.normals).sum(axis=1) >= kernels.FACING)
        return np.flatnonzero(~is_mapped).astype(np.int32)


def look(
    tree: Tree,
    vertices: Float32,
    triangles: NDArray[np.uint32],
    normals: Float32,
    unit: float,
    is_inside_out: bool,
    is_fine: bool,
) -> Look | None:
    """Return the view from nodes and sites of triangles (T, 3), None if no triangle is wide and flat.

    vertices: see `Surfaces`.
    """
    more = FINER if is_fine else 1
    charts = charts_of(vertices[triangles, 11:14], unit, NODE_RAYS * more)
    if charts is None:
        return None
    ways, frame = (charts.directions, charts.turn), (charts.local, charts.axes)
    nodes = Spots.from_rays(tree, charts.origins, ways, frame, normals, charts.cell, is_inside_out)
    nodes.counted[~charts.reached] = 0
    vertex_light = vertex_light_of(
        tree, vertices, triangles, np.flatnonzero(charts.chart < 0), normals, unit, SITE_RAYS * more, is_inside_out
    )
    if vertex_light is None:
        return Look(charts, nodes, None)
    sites, facets = vertex_light
    ways, frame = (sites.directions, np.arange(len(sites.origins), dtype=np.int32)), (sites.local, sites.axes)
    return Look(
        charts,
        nodes,
        Round(sites, facets, Spots.from_rays(tree, sites.origins, ways, frame, normals, sites.cell, is_inside_out)),
    )


class FinalGather(NamedTuple):
    """ids: for the rays of nodes, of sites, and of patches, the patches that they hit. afar: the light that reaches them from
    the sky, the distant ground, and emissive triangles.
    """

    look: Look
    around: PatchRays
    ids: tuple[Int32, ...]
    lightmap: Lightmap
    afar: tuple[Float32, ...]

    @classmethod
    def from_patches(
        cls,
        look: Look,
        around: PatchRays,
        patches: Patches,
        surrounding: Surrounding,
        tree: Tree,
        emissive: EmissiveTriangles,
        turns: int,
        emitted: Float32,
        off: float,
    ) -> FinalGather:
        """The gathering for patches that emit `emitted` (M, 3); the last bundles of their rays are those of look and around."""
        spots = [look.nodes, *([look.round.spots] if look.round else [])]
        ids, given = patches.ids[-len(spots) - 1 :], (surrounding, tree, emissive, turns, emitted, off)
        afar = [own.from_afar(which, *given) for own, which in zip(spots, ids[:-1], strict=True)]
        nodes, chart = np.zeros_like(afar[0]), look.charts.chart
        lightmap = NO_LIGHTMAP._replace(nodes=nodes, charts=look.charts.charts, chart=chart)
        if look.round:
            facets = look.round.facets
            points = np.zeros((len(facets.places), kernels.COLUMNS), np.float32)
            chart = numbered(chart, facets)
            lightmap = lightmap._replace(chart=chart, facets=facets.facets, knots=facets.knots, points=points)
        return cls(look, around, ids, lightmap, (*afar, around.from_afar(ids[-1], *given)))

    def receive(self, sent: Float32) -> None:
        """Gather the light that patches send, (M, 3), at the nodes of the lightmaps."""
        self.look.nodes.receive(self.ids[0], sent, self.afar[0], self.lightmap.nodes)

    def look_around(self, sent: Float32, glow: Float32, inside: Float32) -> None:
        """Set glow (M, 3) and inside (M,) of the patches outside the lightmaps: see `kernels_probes.look_up`."""
        send_around(self.ids[-1], self.around.which, self.around.share, self.afar[-1], sent, glow, inside)

    def finish(self, sent: Float32) -> None:
        """Mix the values of neighbouring nodes, which have received the light of patches, (M, 3), and gather this light at all
        sites.
        """
        kernels.smooth(self.lightmap.charts, self.lightmap.nodes.copy(), self.lightmap.nodes)
        if self.look.round:
            sites, facets, spots = self.look.round
            nodes = np.empty_like(self.afar[1])
            spots.receive(self.ids[1], sent, self.afar[1], nodes)
            self.lightmap.points[:] = sites.light_at(facets, nodes, openness(spots.rays.far, NEAR * sites.cell))
