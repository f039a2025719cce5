"""Cloth: stuffed bags, bands and zips of a backpack, and its materials."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import linear, metal
from viewsphere_zoo.shapes.sheets import sheet
from viewsphere_zoo.shapes.solids import Float, Solid, curve, loft, moved, rounded_box, tube

if TYPE_CHECKING:
    from viewsphere_zoo.sewing.design import Backpack


@dataclass(frozen=True)
class Bag:
    """A stuffed bag's surface: half width and half depth (metres) by the share of its height, its folds, its exponent."""

    height: float
    across: tuple[tuple[float, float], ...]
    deep: tuple[tuple[float, float], ...]
    folds: Float
    exponent: float = 3.2
    at: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def point(self, angle: Float, share: Float, off: float = 0.0) -> Float:
        """Points (..., 3) at angles about z (-90 degrees: the front) and shares of the height, `off` outside."""
        a, t = np.broadcast_arrays(np.asarray(angle, np.float64), np.asarray(share, np.float64))
        c, s = np.cos(a), np.sin(a)
        reach = (np.abs(c) ** self.exponent + np.abs(s) ** self.exponent) ** (-1 / self.exponent)
        k = np.arange(1, len(self.folds) + 1)
        wave = (self.folds * np.sin(k * a[..., None] + 5 * self.folds * 100 + (3 + 2 * k) * t[..., None])).sum(axis=-1)
        edge = np.clip(np.minimum(t, 1 - t) * 6, 0, 1)
        grow = 1 + wave * edge
        x = (curve(t, self.across) * grow + off) * c * reach
        y = (curve(t, self.deep) * grow + off) * s * reach
        return np.stack([x, y, t * self.height], axis=-1) + self.at

    def solid(self, rings: int = 15, sides: int = 28) -> Solid:
        """The closed bag."""
        t = (1 - np.cos(np.linspace(0, np.pi, rings))) / 2
        a = np.linspace(0, 2 * np.pi, sides, endpoint=False)
        return loft(self.point(a, t[:, None]))


def coats(p: Backpack) -> dict[str, Material]:
    """Cloth in its colours, webbing, buckles."""
    return {
        "main": Material("cloth", linear(p.color), roughness=0.85),
        "second": Material("second_cloth", linear(p.second), roughness=0.85),
        "trim": Material("webbing", linear(p.trim), roughness=0.75),
        "accent": Material("accent", linear(p.accent), roughness=0.6),
        "pad": Material("padding", linear((0.13, 0.13, 0.14)), roughness=0.95),
        "metal": metal("buckle", (0.6, 0.6, 0.61) if p.style != "flap" else (0.72, 0.58, 0.3), 0.35),
        "bottle": Material("bottle", linear((0.75, 0.8, 0.84)), metallic=0.4, roughness=0.25),
    }


def main_bag(p: Backpack) -> Bag:
    """The main compartment."""
    w, d = p.width / 2, p.depth / 2 * (0.75 + 0.35 * p.fill)
    folds = np.random.default_rng(p.seed).normal(0, 0.011, 5)
    top = {"school": 0.62, "hiking": 0.85, "roll_top": 0.92, "flap": 0.8}[p.style]
    shoulder = {"school": 0.8, "hiking": 0.95, "roll_top": 0.97, "flap": 0.94}[p.style]
    thin = {"school": 0.5, "hiking": 0.85, "roll_top": 0.3, "flap": 0.7}[p.style]
    across = ((0.0, 0.84 * w), (0.08, 0.97 * w), (0.4, w), (shoulder, 0.94 * w), (1.0, top * w))
    deep = ((0.0, 0.85 * d), (0.1, d), (0.35, (1.02 + 0.08 * p.fill) * d), (0.8, 0.86 * d), (1.0, thin * d))
    return Bag(p.height, across, deep, folds)


def pocket_bag(p: Backpack, at: tuple[float, float, float], size: tuple[float, float, float], seed: int) -> Bag:
    """A smaller bag: size is half its width, half its depth, its height."""
    w, d, h = size
    folds = np.random.default_rng(p.seed + seed).normal(0, 0.01, 4)
    across = ((0.0, 0.86 * w), (0.12, w), (0.85, 0.97 * w), (1.0, 0.8 * w))
    return Bag(h, across, ((0.0, 0.7 * d), (0.2, d), (0.75, 0.85 * d), (1.0, 0.45 * d)), folds, 3.6, at)


def zip_pieces(bag: Bag, angles: tuple[float, float], shares: tuple[float, float], c: dict[str, Material]) -> list[Piece]:
    """A zip that climbs a bag, crosses below its top and comes down again, with its slider."""
    a0, a1 = np.radians(angles)
    low, high = shares
    up = [(a0, s) for s in np.linspace(low, high - 0.05, 5)]
    over = [(a, high) for a in np.linspace(a0 + 0.12, a1 - 0.12, 11)]
    down = [(a1, s) for s in np.linspace(high - 0.05, low, 5)]
    uv = np.array([*up, *over, *down])
    line = bag.point(uv[:, 0], uv[:, 1], 0.003)
    tag = bag.point(np.array([a1 - 0.4]), np.array([high]), 0.012)[0]
    pull = moved(rounded_box((0.012, 0.006, 0.035), 0.003, 1), tag - (0, 0, 0.018))
    return [Piece("zip", c["trim"], tube(line, 0.0045, 4)), Piece("zip", c["metal"], pull)]


def band(points: Float, width: float, thickness: float, side: tuple[float, float, float] = (1, 0, 0)) -> Solid:
    """A strap of this width along a line (N, 3), its width along `side`."""
    across = np.array((-0.5, -0.2, 0.2, 0.5)) * width
    return sheet(points[:, None] + across[:, None] * np.array(side), thickness)
