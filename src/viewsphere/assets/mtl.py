"""MTL material libraries as glTF's metallic-roughness materials.

http://paulbourke.net/dataformats/mtl/ and the PBR extension of
https://benhouston3d.com/blog/extended-wavefront-obj-mtl-for-pbr
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.folder import ModelFolder
from viewsphere.assets.mesh import Image, Material, Texture
from viewsphere.assets.text import statements

SCALAR_OPTIONS = ("-blendu", "-blendv", "-bm", "-boost", "-cc", "-clamp", "-imfchan", "-texres", "-type")
OPTION_ARGUMENTS = {"-mm": 2, **dict.fromkeys(SCALAR_OPTIONS, 1)}
VECTOR_OPTIONS = ("-o", "-s", "-t")

HEIGHT = 0.01
"""Rise of a height map from black to white for `-bm 1`, in widths of its picture."""

Pixels = NDArray[np.uint8]


@dataclass(frozen=True)
class _Map:
    """A map_ statement: its file and its options, in OBJ's texture axes (v upwards)."""

    file: str
    offset: tuple[float, float] = (0.0, 0.0)
    scale: tuple[float, float] = (1.0, 1.0)
    clamp: bool = False
    strength: float = 1.0

    def texture(self, image: int) -> Texture:
        """This map in glTF's texture axes (v downwards)."""
        wrap = "clamp" if self.clamp else "repeat"
        offset = (self.offset[0], 1.0 - self.scale[1] - self.offset[1])
        return Texture(image, wrap_s=wrap, wrap_t=wrap, offset=offset, scale=self.scale)


def read_materials(folder: ModelFolder, texts: Sequence[str], wanted: set[str]) -> dict[str, Material]:
    """The wanted materials of these libraries by name; the first definition of a name counts.

    `Kd` multiplies `map_Kd`, except a black one, which many exporters write beside a texture. `Ns` becomes a
    roughness whose square is sqrt(2 / (Ns + 2)), the width of a lobe like Blinn and Phong's (Walter et al. 2007), unless `Pr`
    gives one. A `map_bump` that holds heights becomes a normal map: from black to white it rises by `-bm` hundredths of the
    picture's width. `d < 1` blends, all others are opaque: whether a texture's alpha or `map_d` cuts out or
    blends, `alpha.with_alpha_modes` says. All are double-sided, as OBJ has no other.
    """
    blocks: dict[str, dict[str, str]] = {}
    block: dict[str, str] = {}
    for text in texts:
        for line in statements(text):
            keyword, _, rest = line.partition(" ")
            if keyword.lower() == "newmtl":
                block = {}
                blocks.setdefault(rest.strip(), block)
            elif keyword and not keyword.startswith("#"):
                block[keyword.lower()] = rest.strip()
    return {name: _Builder(folder, name, block).material() for name, block in blocks.items() if name in wanted}


@dataclass(frozen=True)
class _Builder:
    folder: ModelFolder
    name: str
    block: dict[str, str]

    def material(self) -> Material:
        color_map = self.map("map_kd")
        color = self.color("kd", (0.8, 0.8, 0.8) if color_map is None else (1.0, 1.0, 1.0))
        if color_map is not None and max(color) == 0:
            color = (1.0, 1.0, 1.0)
        opacity = self.opacity()
        rough_map, metal_map = self.map("map_pr"), self.map("map_pm")
        emissive_map, normal_map = self.map("map_ke"), self.map("norm")
        emissive = self.color("ke", (0.0, 0.0, 0.0))
        emissive_texture = self.plain(emissive_map)
        if emissive_texture is not None and max(emissive) == 0:
            emissive = (1.0, 1.0, 1.0)
        bump = self.map("map_bump") or self.map("bump")
        return Material(
            name=self.name,
            base_color=(*color, opacity),
            base_color_texture=self.base(color_map),
            metallic=self.number("pm", 1.0 if metal_map is not None else 0.0),
            roughness=self.roughness(rough_map),
            metallic_roughness_texture=self.metallic_roughness(rough_map, metal_map),
            normal_texture=self.plain(normal_map) if normal_map is not None else self.bump(bump),
            normal_scale=normal_map.strength if normal_map is not None else bump.strength if bump is not None else 1.0,
            emissive=emissive,
            emissive_texture=emissive_texture,
            alpha_mode="BLEND" if opacity < 1.0 else "OPAQUE",
            clearcoat=min(max(self.number("pc", 0.0), 0.0), 1.0),
            clearcoat_roughness=min(max(self.number("pcr", 0.0), 0.0), 1.0),
            specular=self.specular(),
        )

    def opacity(self) -> float:
        """`d`, else 1 - `Tr`. A lone `Tr 1` is opaque: some exporters write opacity there, none an invisible material."""
        transparency = self.number("tr", 0.0)
        return min(max(self.number("d", 1.0 if transparency >= 1.0 else 1.0 - transparency), 0.0), 1.0)

    def number(self, key: str, default: float) -> float:
        words = self.block.get(key, "").replace("-halo", "").split()
        try:
            value = float(words[0]) if words else default
        except ValueError:
            return default
        return value if np.isfinite(value) else default

    def color(self, key: str, default: tuple[float, float, float]) -> tuple[float, float, float]:
        try:
            values = [float(word) for word in self.block.get(key, "").split()[:3]]
        except ValueError:
            return default
        if not values or not np.isfinite(values).all() or min(values) < 0:
            return default
        red, green, blue = values if len(values) == 3 else values[:1] * 3
        return (red, green, blue)

    def roughness(self, rough_map: _Map | None) -> float:
        if "pr" in self.block or rough_map is not None:
            return min(max(self.number("pr", 1.0), 0.0), 1.0)
        if "ns" not in self.block:
            return Material().roughness
        return float((2.0 / (max(self.number("ns", 0.0), 0.0) + 2.0)) ** 0.25)

    def specular(self) -> float:
        """A Ks of 0.5 counts as a dielectric's 4 %, because exporters of PBR materials write 0.5."""
        if "ks" not in self.block or "pr" in self.block or "pm" in self.block:
            return 1.0
        return min(1.0, 2.0 * max(self.color("ks", (0.5, 0.5, 0.5))))

    def map(self, key: str) -> _Map | None:
        """The statement `key`, options before its file name, which may hold blanks."""
        words = self.block.get(key, "").split(" ")
        values: dict[str, list[str]] = {}
        while words and (words[0] in OPTION_ARGUMENTS or words[0] in VECTOR_OPTIONS or not words[0]):
            option = words.pop(0)
            limit = OPTION_ARGUMENTS.get(option, 3 if option else 0)
            taken: list[str] = []
            while len(words) > 1 and len(taken) < limit and (option not in VECTOR_OPTIONS or _is_number(words[0])):
                taken.append(words.pop(0))
            values[option] = taken
        file = " ".join(words).strip().strip('"')
        if not file:
            return None
        return _Map(
            file,
            offset=_pair(values.get("-o", []), 0.0),
            scale=_pair(values.get("-s", []), 1.0),
            clamp=values.get("-clamp") == ["on"],
            strength=_pair(values.get("-bm", []), 1.0)[0],
        )

    def image(self, source: _Map | None) -> int | None:
        return None if source is None else self.folder.image(source.file, source.file)

    def plain(self, source: _Map | None) -> Texture | None:
        """The map's image as it is."""
        image = self.image(source)
        return None if source is None or image is None else source.texture(image)

    def base(self, color_map: _Map | None) -> Texture | None:
        """Base colour texture with `map_d` as its alpha."""
        opacity_map = self.map("map_d") or self.map("map_opacity")
        color, opacity = self.image(color_map), self.image(opacity_map)
        if opacity is not None and opacity != color:
            color = self.folder.derived(f"#{color} with opacity {opacity}", lambda: self.with_opacity(color, opacity))
        source = color_map or opacity_map
        if color is None or source is None:
            return None
        return source.texture(color)

    def metallic_roughness(self, rough_map: _Map | None, metal_map: _Map | None) -> Texture | None:
        """A new texture with roughness in its green and metallic in its blue channel."""
        rough, metal = self.image(rough_map), self.image(metal_map)
        source = rough_map if rough is not None else metal_map
        if source is None or (rough is None and metal is None):
            return None
        key = f"#roughness {rough} and metallic {metal}"
        return source.texture(self.folder.derived(key, lambda: self.merged(rough, metal)))

    def with_opacity(self, color: int | None, opacity: int) -> Image:
        """An image whose alpha is another's grey; white without a colour."""
        images = self.folder.images
        alpha = _grey(images[opacity].pixels)
        pixels = np.full((*alpha.shape, 4), 255, np.uint8) if color is None else images[color].pixels.copy()
        pixels[..., 3] = _resized(alpha, pixels.shape[:2])
        return Image(f"{self.name} colour and opacity", pixels)

    def merged(self, rough: int | None, metal: int | None) -> Image:
        """An image with one's grey in green and the other's in blue."""
        channels = [(index, channel) for index, channel in ((rough, 1), (metal, 2)) if index is not None]
        images = self.folder.images
        shape = images[channels[0][0]].pixels.shape[:2]
        pixels = np.full((*shape, 4), 255, np.uint8)
        for index, channel in channels:
            pixels[..., channel] = _resized(_grey(images[index].pixels), shape)
        return Image(f"{self.name} roughness and metallic", pixels)

    def bump(self, source: _Map | None) -> Texture | None:
        """The normal map of a bump statement, heights turned into normals; None for a height map of a single height."""
        image = self.image(source)
        if source is None or image is None:
            return None
        pixels = self.folder.images[image].pixels
        mean = pixels[..., :3].reshape(-1, 3).mean(axis=0)
        if mean[2] < 1.3 * max(mean[0], mean[1]):
            if np.ptp(pixels[..., :3]) == 0:
                return None
            name = f"{source.file} as normals"
            image = self.folder.derived(f"#{name}", lambda: Image(name, _normals(_grey(pixels), source.clamp)))
        return source.texture(image)


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _pair(words: Sequence[str], default: float) -> tuple[float, float]:
    values = [float(word) if _is_number(word) else default for word in words]
    padded = [*values, default, default]
    return padded[0], padded[1]


def _normals(heights: Pixels, clamp: bool) -> Pixels:
    """A normal map (H, W, 4) of heights (H, W), green up, by Sobel's operator."""
    depth = heights.shape[1] * HEIGHT / 255
    padded = np.pad(heights.astype(np.float32) * np.float32(depth), 1, mode="edge" if clamp else "wrap")
    smooth_rows = (padded[:-2] + 2 * padded[1:-1] + padded[2:]) / 8
    smooth_columns = (padded[:, :-2] + 2 * padded[:, 1:-1] + padded[:, 2:]) / 8
    across = smooth_rows[:, 2:] - smooth_rows[:, :-2]
    down = smooth_columns[2:] - smooth_columns[:-2]
    normal = np.stack([-across, down, np.ones_like(across)], axis=-1)
    normal /= np.sqrt((normal * normal).sum(axis=-1, keepdims=True))
    pixels = np.full((*heights.shape, 4), 255, np.uint8)
    pixels[..., :3] = np.rint(normal * 127.5 + 127.5)
    return pixels


def _grey(pixels: Pixels) -> Pixels:
    """One channel: the alpha of an image that is transparent anywhere, else its mean colour."""
    alpha = pixels[..., 3]
    return alpha if (alpha < 255).any() else np.rint(pixels[..., :3].mean(axis=2)).astype(np.uint8)


def _resized(channel: Pixels, shape: tuple[int, ...]) -> Pixels:
    from PIL import Image as Pillow

    if channel.shape == shape:
        return channel
    return np.asarray(Pillow.fromarray(channel).resize((shape[1], shape[0]), Pillow.Resampling.BILINEAR))
