"""MTL material libraries as glTF's metallic-roughness materials.

http://paulbourke.net/dataformats/mtl/ and the PBR extension of
https://benhouston3d.com/blog/extended-wavefront-obj-mtl-for-pbr
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Image, Material, Texture
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.readers.obj.text import Library
from viewsphere.assets.readers.shared.text import number_of, numeric_words, statements, uncommented

SCALAR_OPTIONS = ("-blendu", "-blendv", "-bm", "-boost", "-cc", "-clamp", "-imfchan", "-texres", "-type")
OPTION_ARGUMENTS = {"-mm": 2, **dict.fromkeys(SCALAR_OPTIONS, 1)}
VECTOR_OPTIONS = ("-o", "-s", "-t")

MAPS = ("map_", "bump", "norm", "disp", "decal", "refl")
"""Prefixes of statements that name pictures."""

READ = {
    "map_kd", "map_ks", "map_ns", "map_ke", "map_d", "map_opacity", "map_tr", "map_bump", "bump", "norm", "map_kn", "map_pr",
    "map_pm", "map_aat",
}  # fmt: skip
"""Picture statements that are read, and `map_aat`, a switch."""

MOST_SHINY = 1000.0
"""`Ns` of a white texel if only a map is given: the upper end of the specification's range."""

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

    @classmethod
    def from_options(cls, file: str, options: dict[str, list[str]]) -> _Map:
        """The map of a file with these options."""
        return cls(
            file,
            offset=_pair(options.get("-o", []), 0.0),
            scale=_pair(options.get("-s", []), 1.0),
            clamp=options.get("-clamp") == ["on"],
            strength=_pair(options.get("-bm", []), 1.0)[0],
        )

    def texture(self, image: int) -> Texture:
        """This map in glTF's texture axes (v downwards)."""
        wrap = "clamp" if self.clamp else "repeat"
        offset = (self.offset[0], 1.0 - self.scale[1] - self.offset[1])
        return Texture(image, wrap_s=wrap, wrap_t=wrap, offset=offset, scale=self.scale)


@dataclass(frozen=True)
class _LibraryMaterial:
    """A material of a library, and whether its statements (`d`, `Tr` below 1, `map_d`) make alpha its opacity."""

    material: Material
    states_opacity: bool


def read_materials(folder: ModelFolder, libraries: Sequence[Library], wanted: set[str]) -> dict[str, _LibraryMaterial]:
    """The wanted materials of these libraries by name; the first definition of a name counts.

    `Kd` multiplies `map_Kd`, except a black one, which many exporters write together with a texture. `Ns` (with `map_Ns`)
    becomes a roughness whose square is sqrt(2 / (Ns + 2)), the width of a lobe like Blinn and Phong's (Walter et al. 2007),
    unless `Pr` gives one. A `map_bump` that holds heights becomes a normal map: from black to white it rises by `-bm`
    hundredths of the picture's width. `d < 1` blends, other materials are opaque; `alpha.with_alpha_modes` decides whether a
    texture's alpha or `map_d` cuts out or blends. All materials are double-sided, as OBJ has no other kind.
    """
    blocks: dict[str, tuple[dict[str, str], Path]] = {}
    for library in libraries:
        block: dict[str, str] = {}
        for line in statements(library.text):
            keyword, _, rest = line.partition(" ")
            if keyword.lower() == "newmtl":
                block = {}
                for name in (rest.strip(), uncommented(rest.strip())):
                    blocks.setdefault(name, (block, library.folder))
            elif keyword and not keyword.startswith("#"):
                block[keyword.lower()] = rest.strip()
    return {name: _Builder(folder, name, *blocks[name]).entry() for name in blocks if name in wanted}


@dataclass(frozen=True)
class _Builder:
    folder: ModelFolder
    name: str
    block: dict[str, str]
    library: Path

    def entry(self) -> _LibraryMaterial:
        """The material; a warning names maps that are not read."""
        material = self.material()
        color = self.block.get("map_kd")
        unread = [key for key in self.block if key.startswith(MAPS) and key not in READ and self.block[key] != color]
        if unread:
            self.folder.warn(f"material {self.name!r} has maps that are not read: {', '.join(unread)}")
        return _LibraryMaterial(material, material.base_color[3] < 1.0 or self.opacity_map() is not None)

    def material(self) -> Material:
        color_map = self.map("map_kd")
        color = self.color("kd", (0.8, 0.8, 0.8) if color_map is None else (1.0, 1.0, 1.0))
        if color_map is not None and max(color) == 0:
            color = (1.0, 1.0, 1.0)
        opacity = self.opacity()
        rough_map, metal_map = self.map("map_pr"), self.map("map_pm")
        emissive_map, normal_map = self.map("map_ke"), self.map("norm") or self.map("map_kn")
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
            metallic_roughness_texture=self.metallic_roughness(rough_map, metal_map) or self.shininess_texture(),
            normal_texture=self.plain(normal_map) if normal_map is not None else self.bump(bump),
            normal_scale=normal_map.strength if normal_map is not None else bump.strength if bump is not None else 1.0,
            emissive=emissive,
            emissive_texture=emissive_texture,
            alpha_mode="BLEND" if opacity < 1.0 else "OPAQUE",
            clearcoat=min(max(self.number("pc", 0.0), 0.0), 1.0),
            clearcoat_roughness=min(max(self.number("pcr", 0.0), 0.0), 1.0),
            specular=self.specular(),
            specular_texture=self.specular_texture(),
        )

    def opacity(self) -> float:
        """`d`, else 1 - `Tr`. `Tr 1` without `d` is opaque: some exporters write opacity there, but none writes invisible
        materials.
        """
        transparency = self.number("tr", 0.0)
        return min(max(self.number("d", 1.0 if transparency >= 1.0 else 1.0 - transparency), 0.0), 1.0)

    def words(self, key: str) -> list[str]:
        """Words of a statement before a comment."""
        return numeric_words(self.block.get(key, ""))

    def number(self, key: str, default: float) -> float:
        """A statement's number; the default, with a warning, if it has none."""
        words = [word for word in self.words(key) if word != "-halo"]
        return self.numbers(key, words[:1], default)[0]

    def color(self, key: str, default: tuple[float, float, float]) -> tuple[float, float, float]:
        """A statement's colour; the default, with a warning, if it has none."""
        values = self.numbers(key, self.words(key)[:3], -1.0)
        if min(values) < 0:
            return default
        red, green, blue = values if len(values) == 3 else values[:1] * 3
        return (red, green, blue)

    def numbers(self, key: str, words: list[str], default: float) -> list[float]:
        """The words as numbers; one default if there are no words, or, with a warning, if a word is not a number."""
        values = [value for word in words if (value := number_of(word)) is not None]
        if len(values) < len(words):
            self.folder.warn(f"material {self.name!r}: {key} {' '.join(words)[:40]!r} is no number, not read")
        return values if values and len(values) == len(words) and np.isfinite(values).all() else [default]

    def roughness(self, rough_map: _Map | None) -> float:
        if "pr" in self.block or rough_map is not None:
            return min(max(self.number("pr", 1.0), 0.0), 1.0)
        if self.shininess_texture() is not None:
            return 1.0
        if "ns" not in self.block:
            return Material().roughness
        return float((2.0 / (max(self.number("ns", 0.0), 0.0) + 2.0)) ** 0.25)

    def shininess_texture(self) -> Texture | None:
        """A new texture with the roughness of `Ns` times `map_Ns` in its green channel; None if `Pr` gives the roughness."""
        source = None if "pr" in self.block else self.map("map_ns")
        image = self.image(source)
        if source is None or image is None:
            return None
        most = self.number("ns", MOST_SHINY)

        def made() -> Image:
            shininess = _grey(self.folder.images[image].pixels) / 255.0 * max(most, 0.0)
            return Image(f"{source.file} as roughness", _in_channel(1, (2.0 / (shininess + 2.0)) ** 0.25))

        return source.texture(self.folder.derived(f"#shininess {image} of {most}", made))

    def specular(self) -> float:
        """A Ks of 0.5 counts as a dielectric's 4 %, because exporters of PBR materials write 0.5; with a `map_Ks`, it is 1."""
        if "ks" not in self.block or "pr" in self.block or "pm" in self.block or self.image(self.map("map_ks")) is not None:
            return 1.0
        return min(1.0, 2.0 * max(self.color("ks", (0.5, 0.5, 0.5))))

    def specular_texture(self) -> Texture | None:
        """A new texture with `Ks` times `map_Ks` as glTF's specular factor, in its alpha channel."""
        source = self.map("map_ks")
        image = self.image(source)
        if source is None or image is None:
            return None
        most = 2.0 * max(self.color("ks", (0.5, 0.5, 0.5)))

        def made() -> Image:
            share = self.folder.images[image].pixels[..., :3].max(axis=2) / 255.0
            return Image(f"{source.file} as specular", _in_channel(3, np.minimum(most * share, 1.0)))

        return source.texture(self.folder.derived(f"#specular {image} of {most}", made))

    def map(self, key: str) -> _Map | None:
        """The statement `key`: options before and after its file's name, which may contain blanks and text that looks like
        options.
        """
        if key not in self.block:
            return None
        words, options = _options(self.block[key].split(" "))
        file = " ".join(words).strip()
        if not self.folder.finder.holds(file, self.library):
            file, behind = _without_options(file)
            options |= behind
        return _Map.from_options(file.strip('"'), options) if file.strip('"') else None

    def image(self, source: _Map | None) -> int | None:
        return None if source is None else self.folder.image(source.file, source.file, base=self.library)

    def plain(self, source: _Map | None) -> Texture | None:
        """A texture with the map's image unchanged."""
        image = self.image(source)
        return None if source is None or image is None else source.texture(image)

    def base(self, color_map: _Map | None) -> Texture | None:
        """Base colour texture with `map_d` as its alpha."""
        opacity_map = self.opacity_map()
        color, opacity = self.image(color_map), self.image(opacity_map)
        if opacity is not None and opacity != color:
            inverse = not {"map_d", "map_opacity"} & self.block.keys()
            key = f"#{color} with {'transparency' if inverse else 'opacity'} {opacity}"
            color = self.folder.derived(key, lambda: self.with_opacity(color, opacity, inverse=inverse))
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

    def opacity_map(self) -> _Map | None:
        """The map of opacity, or the map of transparency, since `Tr` is 1 - `d`."""
        return self.map("map_d") or self.map("map_opacity") or self.map("map_tr")

    def with_opacity(self, color: int | None, opacity: int, *, inverse: bool) -> Image:
        """An image whose alpha is the alpha or grey of the image `opacity`. `inverse`: grey is transparency. White without a
        colour image.
        """
        images = self.folder.images
        pixels = images[opacity].pixels
        alpha = _grey(pixels)
        if inverse and pixels[..., 3].min() == 255:
            alpha = 255 - alpha
        pixels = np.full((*alpha.shape, 4), 255, np.uint8) if color is None else images[color].pixels.copy()
        pixels[..., 3] = _resized(alpha, pixels.shape[:2])
        return Image(f"{self.name} colour and opacity", pixels)

    def merged(self, rough: int | None, metal: int | None) -> Image:
        """An image with the grey of `rough` in green and the grey of `metal` in blue."""
        channels = [(index, channel) for index, channel in ((rough, 1), (metal, 2)) if index is not None]
        images = self.folder.images
        shape = images[channels[0][0]].pixels.shape[:2]
        pixels = np.full((*shape, 4), 255, np.uint8)
        for index, channel in channels:
            pixels[..., channel] = _resized(_grey(images[index].pixels), shape)
        return Image(f"{self.name} roughness and metallic", pixels)

    def bump(self, source: _Map | None) -> Texture | None:
        """The normal map of a bump statement, heights turned into normals; None for a height map with a single height."""
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


def _options(words: list[str]) -> tuple[list[str], dict[str, list[str]]]:
    """The words after the leading options, and the options with their values."""
    words, options = list(words), dict[str, list[str]]()
    while words and (words[0] in OPTION_ARGUMENTS or words[0] in VECTOR_OPTIONS or not words[0]):
        option = words.pop(0)
        limit = OPTION_ARGUMENTS.get(option, 3 if option else 0)
        taken: list[str] = []
        while len(words) > 1 and len(taken) < limit and (option not in VECTOR_OPTIONS or number_of(words[0]) is not None):
            taken.append(words.pop(0))
        options[option] = taken
    return words, options


def _without_options(text: str) -> tuple[str, dict[str, list[str]]]:
    """A file's name without a comment and trailing options, and these options."""
    words = uncommented(text).split(" ")
    places = [i for i, word in enumerate(words) if i and (word in OPTION_ARGUMENTS or word in VECTOR_OPTIONS)]
    if not places:
        return " ".join(words), {}
    _, options = _options([*words[places[0] :], ""])
    return " ".join(words[: places[0]]).strip(), options


def _pair(words: Sequence[str], default: float) -> tuple[float, float]:
    values = [number_of(word) for word in words]
    padded = [*(default if value is None else value for value in values), default, default]
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


def _in_channel(channel: int, values: NDArray[np.float64]) -> Pixels:
    """A picture (H, W, 4) with values (H, W) in [0, 1] in this channel and full values in the others."""
    pixels = np.full((*values.shape, 4), 255, np.uint8)
    pixels[..., channel] = np.rint(values * 255)
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
