"""Files of blocks with a smooth picture on every face, which show their colours without light."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from place_files import blocks
from viewsphere.assets.exporting.glb import glb_bytes
from viewsphere.assets.mesh import Image, Material, Texture

SQUARE = np.float32([[0, 0], [1, 0], [1, 1], [0, 1]])


def picture(rng: np.random.Generator, size=256, waves=24) -> np.ndarray:
    """Waves of random directions, none shorter than 16 texels: (size, size, 4) uint8, periodic."""
    y, x = np.mgrid[:size, :size] * (2 * np.pi / size)
    kx, ky = rng.integers(-size // 16, size // 16 + 1, (2, waves))
    phase, gain = rng.uniform(0, 2 * np.pi, (3, waves)), rng.normal(size=(3, waves))
    out = np.tensordot(gain[:, :, None, None] * np.sin(kx[:, None, None] * x + ky[:, None, None] * y + phase[..., None, None]),
                       np.ones(waves), ((1,), (0,)))  # fmt: skip
    out = np.clip(128 + 127 * out / (2.5 * out.std()), 0, 255)
    return np.concatenate([out.transpose(1, 2, 0), np.full((size, size, 1), 255)], axis=2).astype(np.uint8)


def write_unlit(path: Path, *corners, seed=0) -> Path:
    """A GLB of unlit blocks, given by their lowest and highest corners."""
    mesh = blocks(*corners)
    paint = Material("paint", base_color_texture=Texture(0), unlit=True)
    uv = np.tile(SQUARE, (len(mesh.vertices) // 4, 1))
    image = Image("waves", picture(np.random.default_rng(seed)))
    path.write_bytes(glb_bytes(replace(mesh, materials=(paint,), uv0=uv, images=(image,))))
    return path
