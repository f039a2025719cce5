"""Textures of a USD shading network, and pictures with their scale, bias and channels applied."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Image, Texture, Wrap
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.primitive import Float
from viewsphere.assets.readers.usd.layers import asset_bytes
from viewsphere.assets.readers.usd.library import UsdShade
from viewsphere.codecs.srgb import linear, srgb_bytes

WRAPS: dict[str, Wrap] = {"repeat": "repeat", "mirror": "mirror", "clamp": "clamp", "black": "clamp"}
"""Wrap modes; the mode in the file (`useMetadata`) counts as repeat, since texture files rarely store one."""

CHANNELS = {"r": (0,), "g": (1,), "b": (2,), "a": (3,), "rgb": (0, 1, 2), "rgba": (0, 1, 2)}
NO_SCALE, NO_BIAS = (1.0, 1.0, 1.0, 1.0), (0.0, 0.0, 0.0, 0.0)
NORMAL_SCALE, NORMAL_BIAS = (2.0, 2.0, 2.0), (-1.0, -1.0, -1.0)
"""Scale and bias that turn a normal map's colours into a direction."""

Color = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class _Producer:
    """The attribute that gives an input its value: a constant, or a shader's output."""

    attribute: Any

    @property
    def is_output(self) -> bool:
        """Return whether a shader computes the value."""
        return str(self.attribute.GetName()).startswith("outputs:")

    def value(self, time: Any) -> Any:
        """A constant's value."""
        return self.attribute.Get(time)

    @property
    def shader(self) -> Any:
        """The shader that has this output."""
        return UsdShade.Shader(self.attribute.GetPrim())

    def primvar(self, time: Any, kinds: tuple[str, ...]) -> str | None:
        """The primvar that a reader of one of these kinds names, None for other nodes."""
        if not self.is_output or self.shader.GetIdAttr().Get() not in kinds:
            return None
        name = _constant(self.shader, "varname", time)
        return None if not name else str(name)


def producer(entry: Any) -> _Producer | None:
    """The source of an input's value, or None."""
    attributes = UsdShade.Utils.GetValueProducingAttributes(entry) if entry else ()
    return _Producer(attributes[0]) if attributes else None


def _constant(shader: Any, name: str, time: Any) -> Any:
    """The constant value of a shader's input, or None."""
    source = producer(shader.GetInput(name))
    return None if source is None or source.is_output else source.value(time)


@dataclass(frozen=True)
class Sampled:
    """One use of a picture: the primvar of its coordinates, its placement, and value = texel * scale + bias of `channels`."""

    texture: Texture
    primvar: str
    channels: tuple[int, ...]
    is_srgb: bool
    scale: tuple[float, ...]
    bias: tuple[float, ...]

    def as_is(self, channels: tuple[int, ...]) -> bool:
        """Return whether the picture's own texels are the values."""
        rows = [*channels]
        return self.channels == channels and all(self.scale[i] == 1 and self.bias[i] == 0 for i in rows)


def network_texture(folder: ModelFolder, source: _Producer | None, time: Any, what: str) -> Sampled | None:
    """The texture connected to an input; None for constants and, with a warning, for unusable textures."""
    if source is None or not source.is_output:
        return None
    shader, kind = source.shader, str(source.shader.GetIdAttr().Get())
    if kind != "UsdUVTexture":
        if not kind.startswith("UsdPrimvarReader"):
            folder.warn(f"{what} comes from a node {kind}, which is not read")
        return None
    index = _image(folder, shader, time)
    channels = CHANNELS.get(str(source.attribute.GetName()).removeprefix("outputs:"), (0, 1, 2))
    if index is None:
        return None
    primvar, placement = _placement(shader, time)
    wraps = (WRAPS.get(str(_constant(shader, name, time)), "repeat") for name in ("wrapS", "wrapT"))
    wrap_s, wrap_t = wraps
    scale, bias = (_constant(shader, name, time) for name in ("scale", "bias"))
    return Sampled(
        replace(placement, image=index, wrap_s=wrap_s, wrap_t=wrap_t),
        primvar,
        channels,
        _is_srgb(str(_constant(shader, "sourceColorSpace", time) or "auto"), channels, folder, index),
        NO_SCALE if scale is None else tuple(float(v) for v in scale),
        NO_BIAS if bias is None else tuple(float(v) for v in bias),
    )


def _is_srgb(space: str, channels: tuple[int, ...], folder: ModelFolder, index: int) -> bool:
    """Return whether colours are encoded; `auto` means sRGB, as all pictures have 8 bits and three or four channels."""
    if space != "auto":
        return space.lower().startswith("srgb")
    pixels = folder.images[index].pixels
    is_grey = bool((pixels[..., 0] == pixels[..., 1]).all() and (pixels[..., 1] == pixels[..., 2]).all())
    return len(channels) == 3 or not is_grey


def _placement(shader: Any, time: Any) -> tuple[str, Texture]:
    """The primvar of a texture's coordinates, and its transform in coordinates whose v runs downwards."""
    source = producer(shader.GetInput("st"))
    turn, scale, shift = 0.0, (1.0, 1.0), (0.0, 0.0)
    if source is not None and source.is_output and source.shader.GetIdAttr().Get() == "UsdTransform2d":
        node = source.shader
        turn = math.radians(float(_constant(node, "rotation", time) or 0.0))
        scale = _pair(_constant(node, "scale", time), scale)
        shift = _pair(_constant(node, "translation", time), shift)
        source = producer(node.GetInput("in"))
    primvar = None if source is None else source.primvar(time, ("UsdPrimvarReader_float2",))
    sine, cosine = scale[1] * math.sin(turn), scale[1] * math.cos(turn)
    offset = shift[0] - sine, 1.0 - cosine - shift[1]
    return primvar or "st", Texture(0, offset=offset, rotation=turn, scale=scale)


def _pair(value: Any, default: tuple[float, float]) -> tuple[float, float]:
    return default if value is None else (float(value[0]), float(value[1]))


def _image(folder: ModelFolder, shader: Any, time: Any) -> int | None:
    """Index of a texture's picture, from a file or from an archive."""
    source = producer(shader.GetInput("file"))
    asset = None if source is None or source.is_output else source.value(time)
    if asset is None or not asset.path:
        folder.warn(f"texture {shader.GetPrim().GetName()!r} names no file; the material's plain factor is used")
        return None
    name, path = str(asset.path), str(asset.resolvedPath)
    if "<UDIM>" in name:
        folder.warn(f"texture {name[:120]!r}: of its tiles only the first is used")
        layer = source.attribute.GetPropertyStack(time)[0].layer if source is not None else None
        path = "" if layer is None else str(layer.ComputeAbsolutePath(name.replace("<UDIM>", "1001")))
    if "[" in path:
        return folder.image(path, name, asset_bytes(folder, path) or b"")
    if not path:
        return folder.image(name, name)
    root = Path(os.path.realpath(folder.model.parent))
    real = Path(os.path.realpath(path))
    reference = real.relative_to(root).as_posix() if real.is_relative_to(root) else str(path)
    return folder.image(reference, name)


@dataclass(frozen=True, eq=False)
class Baker:
    """Makes the textures of a material: the unchanged picture if that is enough, else a new one; `uvs` are primvars in
    order.
    """

    folder: ModelFolder
    uvs: tuple[str, ...]

    def colors(self, sampled: Sampled | None, plain: Color) -> tuple[Color, Texture | None]:
        """Factor and texture of a linear colour."""
        if sampled is None:
            return plain, None
        texture = self._placed(sampled)
        if sampled.as_is((0, 1, 2)) and sampled.is_srgb:
            return (1.0, 1.0, 1.0), texture
        greatest = max(1.0, *(s + b for s, b in zip(sampled.scale[:3], sampled.bias[:3], strict=True)))
        baked = self._baked(texture, ("colors", sampled), lambda: _with_rgb(srgb_bytes(self._rgb(sampled, 1 / greatest))))
        return (greatest, greatest, greatest), baked

    def base(self, diffuse: Sampled | None, opacity: Sampled | None, plain: Color) -> tuple[Color, Texture | None]:
        """Factor and texture of the base colour, with opacity in the texture's alpha."""
        if opacity is None or diffuse is None:
            if opacity is None:
                factor, texture = self.colors(diffuse, plain)
                return (min(factor[0], 1.0), min(factor[1], 1.0), min(factor[2], 1.0)), texture
            made = self._baked(self._placed(opacity), ("opacity", opacity), lambda: _with_alpha(None, self._one(opacity)))
            return plain, made
        if diffuse.as_is((0, 1, 2)) and diffuse.is_srgb and opacity.as_is((3,)) and diffuse.texture == opacity.texture:
            return (1.0, 1.0, 1.0), self._placed(diffuse)
        if self._placed(diffuse) != replace(self._placed(opacity), image=diffuse.texture.image):
            self.folder.warn("opacity and colour of a material lie differently on its surface: its opacity may be shifted")
        make = lambda: _with_alpha(srgb_bytes(self._rgb(diffuse, 1.0)), self._one(opacity))  # noqa: E731
        return (1.0, 1.0, 1.0), self._baked(self._placed(diffuse), ("base", diffuse, opacity), make)

    def metallic_roughness(
        self, metallic: Sampled | None, roughness: Sampled | None, plain_metallic: float, plain_roughness: float
    ) -> Texture | None:
        """The texture of both, roughness in green and metallic in blue; None if both are constants."""
        first = roughness or metallic
        if first is None:
            return None
        if metallic is not None and roughness is not None and not self._lie_alike(metallic, roughness):
            self.folder.warn("metallic and roughness of a material lie differently on its surface: metallic may be shifted")

        def make() -> NDArray[np.uint8]:
            green = np.full((1, 1), plain_roughness) if roughness is None else self._one(roughness)
            blue = np.full((1, 1), plain_metallic) if metallic is None else self._one(metallic)
            green, blue = _alike(green, blue)
            return _with_rgb(_bytes(np.stack([np.ones_like(green), green, blue], axis=-1)))

        return self._baked(self._placed(first), ("metal", metallic, roughness, plain_metallic, plain_roughness), make)

    def normals(self, sampled: Sampled | None) -> Texture | None:
        """The texture of a normal map, whose scale and bias turn colours into directions."""
        if sampled is None:
            return None
        texture = self._placed(sampled)
        usual = sampled.scale[:3], sampled.bias[:3]
        if usual in ((NORMAL_SCALE, NORMAL_BIAS), (NO_SCALE[:3], NO_BIAS[:3])) and not sampled.is_srgb:
            return texture
        return self._baked(texture, ("normals", sampled), lambda: _with_rgb(_bytes(self._rgb(sampled, 1.0, signed=True))))

    def red(self, sampled: Sampled | None) -> Texture | None:
        """The texture whose red channel has the values."""
        if sampled is None or (sampled.as_is((0,)) and not sampled.is_srgb):
            return None if sampled is None else self._placed(sampled)
        make = lambda: _with_rgb(_bytes(np.repeat(self._one(sampled)[..., None], 3, axis=-1)))  # noqa: E731
        return self._baked(self._placed(sampled), ("red", sampled), make)

    def _lie_alike(self, first: Sampled, second: Sampled) -> bool:
        return replace(self._placed(first), image=0) == replace(self._placed(second), image=0)

    def _placed(self, sampled: Sampled) -> Texture:
        return replace(sampled.texture, texcoord=self.uvs.index(sampled.primvar))

    def _baked(self, texture: Texture, key: tuple[Any, ...], make: Callable[[], NDArray[np.uint8]]) -> Texture:
        name = self.folder.images[texture.image].name
        return replace(texture, image=self.folder.derived(f"usd {key}", lambda: Image(f"{name}, {key[0]}", make())))

    def _texels(self, sampled: Sampled) -> Float:
        """Texels (H, W, 4), colours linear, before scale and bias."""
        pixels = self.folder.images[sampled.texture.image].pixels
        table = np.arange(256) / 255
        texels = table[pixels]
        if sampled.is_srgb:
            texels[..., :3] = linear(table)[pixels[..., :3]]
        return texels

    def _rgb(self, sampled: Sampled, factor: float, *, signed: bool = False) -> Float:
        values = self._texels(sampled) * sampled.scale + sampled.bias
        rows = [*sampled.channels] if len(sampled.channels) == 3 else [*sampled.channels] * 3
        return np.clip((values[..., rows] + 1) / 2 if signed else values[..., rows] * factor, 0.0, 1.0)

    def _one(self, sampled: Sampled) -> Float:
        """Values (H, W) of an input that is one number."""
        channel = sampled.channels[0]
        texels = self._texels(sampled)[..., channel]
        return np.clip(texels * sampled.scale[channel] + sampled.bias[channel], 0.0, 1.0)


def _bytes(values: Float) -> NDArray[np.uint8]:
    return np.rint(values * 255).astype(np.uint8)


def _with_rgb(rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return np.concatenate([rgb, np.full((*rgb.shape[:2], 1), 255, np.uint8)], axis=-1)


def _with_alpha(rgb: NDArray[np.uint8] | None, alpha: Float) -> NDArray[np.uint8]:
    """A picture (H, W, 4) of a colour, white for None, and an opacity, of the larger one's size."""
    if rgb is None:
        rgb = np.full((*alpha.shape, 3), 255, np.uint8)
    height, width = max(rgb.shape[0], alpha.shape[0]), max(rgb.shape[1], alpha.shape[1])
    return np.concatenate([_spread(rgb, height, width), _bytes(_spread(alpha, height, width))[..., None]], axis=-1)


def _alike(first: Float, second: Float) -> tuple[Float, Float]:
    height, width = max(first.shape[0], second.shape[0]), max(first.shape[1], second.shape[1])
    return _spread(first, height, width), _spread(second, height, width)


def _spread(picture: Any, height: int, width: int) -> Any:
    """The picture at another size, by nearest-neighbour sampling."""
    rows, columns = (np.arange(n) * have // n for n, have in zip((height, width), picture.shape[:2], strict=True))
    return picture[rows[:, None], columns]
