"""Woven cloth: plain weave, twill, checks, stripes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from viewsphere.materials.shared.noise import noise, wave
from viewsphere.materials.shared.surface import Color, Map, Surface
from viewsphere.materials.shared.tones import mixed, shaded
from viewsphere.plugins.material import MaterialSpec


@dataclass(frozen=True)
class _Fabric:
    """`threads` over `metres`, a multiple of 16; linear colours of the threads and of those in stripes or checks, `stripes` of
    them; twill: threads cross over two at a time, shifted by one from row to row.
    """

    color: Color = (0.12, 0.17, 0.30)
    other: Color = (0.52, 0.50, 0.44)
    pattern: Literal["plain", "stripes", "checks"] = "plain"
    stripes: int = 4
    twill: bool = False
    threads: int = 96
    melange: float = 0.25
    metres: float = 0.15
    seed: int = 0


def _fabric(parameters: _Fabric | None = None, size: int = 512) -> Surface:
    """The cloth: every thread has its own tone and thickness, and goes over and under those across it."""
    p = parameters or _Fabric()
    rng = np.random.default_rng(p.seed)
    at = ((np.arange(size, dtype=np.float32) + 0.5) / size) * p.threads
    wander = [0.3 * noise(size, max(p.threads // 4, 2), p.seed + k, 4, 0.6) for k in (0, 1)]
    x, y = at[None] + wander[0], at[:, None] + wander[1]
    column, row = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    step = (column + row) % 4 if p.twill else 2 * ((column + row) % 2)
    over = step < 2  # the warp, which runs down, lies on top
    u, v = x - column, y - row
    across, along = np.where(over, u, v), np.where(over, v, u)
    run = along + np.where(step % 2 == 1, 1.0, 0.0) * p.twill
    swell = np.sqrt(np.maximum(4 * across * (1 - across), 0)) * (0.55 + 0.45 * wave(0.5 * run / (2 if p.twill else 1)))
    index = np.where(over, column, p.threads + row) % p.threads + np.where(over, 0, p.threads)
    tones = rng.random((2, 2 * p.threads))
    fibre = np.where(
        over,
        noise(size, (2 * p.threads, p.threads // 4), p.seed + 2, 2),
        noise(size, (p.threads // 4, 2 * p.threads), p.seed + 3, 2),
    )
    fuzz = noise(size, p.threads, p.seed + 4, 3, 0.8)
    shade = 1 + p.melange * (tones[0][index] - 0.5) + 0.25 * fibre + 0.2 * fuzz
    color = mixed(p.color, p.other, _second(p, index, over))
    color = shaded(color, ((0.35 + 0.75 * swell) * shade).astype(np.float32))
    height = (0.4 * p.metres / p.threads) * (swell * (0.85 + 0.3 * tones[1][index]) + 0.2 * fibre + 0.1 * fuzz)
    return Surface(color, np.clip(0.97 - 0.1 * swell, 0.5, 1).astype(np.float32), height.astype(np.float32), p.metres)


def _second(p: _Fabric, index: NDArray[np.int64], over: NDArray[np.bool_]) -> Map:
    """1 where the thread on top has the second colour."""
    width = p.threads // (2 * p.stripes)
    striped = (index % p.threads // width) % 2 == 1
    if p.pattern == "plain":
        return np.zeros(index.shape, np.float32)
    return (striped & (over | (p.pattern == "checks"))).astype(np.float32)


DYES: tuple[Color, ...] = (
    _Fabric.color, (0.46, 0.43, 0.37), (0.24, 0.23, 0.22), (0.055, 0.055, 0.06), (0.30, 0.05, 0.05), (0.10, 0.20, 0.13),
    (0.50, 0.32, 0.10), (0.35, 0.24, 0.16), (0.16, 0.30, 0.36), (0.64, 0.62, 0.57), (0.42, 0.20, 0.24),
)  # fmt: skip


def _draw(rng: np.random.Generator) -> _Fabric:
    """Of two dyes; plain more often than striped or checked."""
    color, other = (DYES[int(i)] for i in rng.choice(len(DYES), size=2, replace=False))
    pattern: tuple[Literal["plain", "stripes", "checks"], ...] = ("plain", "stripes", "checks")
    threads = int(rng.choice((64, 96, 128)))
    return _Fabric(
        color=color,
        other=other,
        pattern=pattern[int(rng.choice(3, p=(0.6, 0.2, 0.2)))],
        stripes=int(rng.choice((2, 4))),
        twill=bool(rng.random() < 0.4),
        threads=threads,
        melange=float(rng.uniform(0.1, 0.7)),
        metres=threads * float(rng.uniform(0.0012, 0.0022)),
        seed=int(rng.integers(2**31)),
    )


MATERIAL = MaterialSpec(word="fabric", surface=_fabric, draw=_draw)
