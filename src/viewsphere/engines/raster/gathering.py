"""How light is gathered where probes are too coarse: at the nodes of a lightmap, and at the patches that have no part in it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from viewsphere.engines.raster import kernels_lightmap as kernels
from viewsphere.engines.raster.environment import Surrounding, sky_along
from viewsphere.engines.raster.kernels_probes import send_around
from viewsphere.engines.raster.lanterns import Lanterns
from viewsphere.engines.raster.lightmaps import Charts, charts_of
from viewsphere.engines.raster.patch_rays import PatchRays
from viewsphere.engines.raster.patches import Patches, Rays
from viewsphere.engines.raster.records import Float32, Int32, Lightmap
from viewsphere.engines.raster.tracing import Tree, cast

NODE_RAYS = 256
"""Of a node of the lightmap."""


class Look(NamedTuple):
    """What depends on no light. nodes: rays of the nodes; counted (N,): how much each node counts."""

    charts: Charts
    nodes: Rays
    counted: Float32

    def alone(self, patches: Patches) -> Int32:
        """The patches whose light no chart knows."""
        chart = np.where(patches.triangles >= 0, self.charts.chart[patches.triangles], -1)
        normals = self.charts.charts[chart, kernels.NORMAL : kernels.NORMAL + 3]
        is_mapped = (chart >= 0) & ((normals * patches.normals).sum(axis=1) >= kernels.FACING)
        return np.flatnonzero(~is_mapped).astype(np.int32)


def look(tree: Tree, corners: Float32, normals: Float32, unit: float, is_inside_out: bool) -> Look | None:
    """What the nodes of triangles (T, 3, 3) see, None if none of them is wide and flat."""
    charts = charts_of(corners, unit, NODE_RAYS)
    if charts is None:
        return None
    ways = charts.directions, charts.turn
    met, far = cast(tree, charts.origins, *ways, np.inf)
    counted = np.empty(len(charts.origins), np.float32)
    kernels.count_in(met, far, *ways, normals, np.float32(charts.cell), is_inside_out, counted)
    counted[~charts.reached] = 0
    return Look(charts, Rays(charts.origins, *ways, met, far), counted)


class Gathering(NamedTuple):
    """far, around_far: what comes to nodes and to patches from the sky, the ground far away, and lanterns; ids: the patches
    that both kinds of rays hit.
    """

    look: Look
    around: PatchRays
    ids: tuple[Int32, Int32]
    lightmap: Lightmap
    far: Float32
    around_far: Float32

    @classmethod
    def of(
        cls,
        look: Look,
        around: PatchRays,
        patches: Patches,
        surrounding: Surrounding,
        tree: Tree,
        lanterns: Lanterns,
        turns: int,
        emitted: Float32,
        off: float,
    ) -> Gathering:
        """Of patches that send `emitted` (M, 3) by themselves; the last two bundles of their rays are of look and around."""
        charts, ids = look.charts, patches.ids[-2:]
        nodes = np.zeros((len(charts.origins), kernels.COLUMNS), np.float32)
        sky = sky_along(surrounding, charts.directions)
        kernels.see(ids[0], charts.turn, charts.local, sky, surrounding.below, nodes)
        if len(lanterns.points):
            places = charts.origins, charts.turn, charts.axes, turns, lanterns.points
            near = ids[0], look.nodes.far, charts.local, lanterns.froms, emitted
            kernels.shine_on(tree, *places, *near, np.float32(off), nodes)
        lightmap = Lightmap(nodes.copy(), charts.charts, charts.chart)
        afar = around.from_afar(ids[1], surrounding, tree, lanterns, turns, emitted, off)
        return cls(look, around, (ids[0], ids[1]), lightmap, nodes, afar)

    def receive(self, sent: Float32) -> None:
        """Gather what patches send, (M, 3), at the nodes."""
        charts, nodes = self.look.charts, self.lightmap.nodes
        nodes[:] = self.far
        kernels.receive(self.ids[0], charts.turn, charts.local, sent, self.look.counted, nodes)

    def look_around(self, sent: Float32, glow: Float32, inside: Float32) -> None:
        """Set glow (M, 3) and inside (M,) of the patches that have no part in the lightmap: see `kernels_probes.look_up`."""
        send_around(self.ids[1], self.around.which, self.around.share, self.around_far, sent, glow, inside)

    def smooth(self) -> None:
        """Mix what neighbours know."""
        kernels.smooth(self.lightmap.charts, self.lightmap.nodes.copy(), self.lightmap.nodes)
