"""Materials from expressions of Blender's nodes (`blender.worker.files.nodes`): constants become factors, an unchanged picture
stays the texture, and an expression over pictures is baked into a new picture.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import HIGHEST_IOR, Image, Material, Texture
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.codecs.srgb import linear, srgb_bytes

Float = NDArray[Any]
Told = Mapping[str, Any]

LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)

WALL = 0.003
"""Thickness in metres for glass, since glass in Blender's shaders refracts at any thickness."""


@dataclass(frozen=True)
class Picture:
    """A picture that nodes use: its index in the folder's images, None if it cannot be used, and whether it is sRGB or plain
    numbers.
    """

    index: int | None
    is_srgb: bool


@dataclass(eq=False)
class Painter:
    """Makes materials. Expressions refer to `pictures` by index; an unused picture is None. Warnings go to `folder`."""

    folder: ModelFolder
    pictures: Sequence[Picture | None]

    def material(self, told: Told, uvs: Sequence[str | None]) -> Material:
        """The material for triangles whose two layers of texture coordinates have these names."""
        inner = [factor for factor in _factors(told["color"]) if not _is_paint(factor)]
        others = (value for name, value in told.items() if name not in ("color", "normal"))
        mixed = any(map(_has_paint, (*inner, *others)))
        for lost in [*told["lost"], *(["vertex colours that are no factor of the base colour"] if mixed else [])]:
            self.folder.warn(f"material {told['name']!r}: {lost} cannot be carried over")
        return _Work(self, told, uvs).material()


@dataclass(eq=False)
class _Work:
    """Makes one material from its expressions `told`."""

    painter: Painter
    told: Told
    uvs: Sequence[str | None]

    def material(self) -> Material:
        told = self.told
        normal, normal_scale = self._normal()
        base = self._base()
        rough = self._roughness()
        return replace(
            base,
            name=told["name"],
            double_sided=told.get("double_sided", True),
            **rough,
            **self._emissive(),
            **self._occlusion(),
            normal_texture=normal,
            normal_scale=normal_scale,
            **self._scalar("clearcoat", told["coat"]),
            **(self._scalar("clearcoat_roughness", told["coat_roughness"]) if told["coat"] != 0 else {}),
            **self._scalar("transmission", told["transmission"]),
            thickness=WALL if told["transmission"] != 0 else 0.0,
            **self._scalar("specular", told["specular"]),
            specular_color=self._mean_color(told["specular_color"]),
            ior=min(max(self._mean(told["ior"]), 1.0), HIGHEST_IOR),
        )

    def _base(self) -> Material:
        constant, rest = _product(_without_paint(self.told["color"]))
        color, alpha = self._usable(rest), self._usable(self.told["alpha"])
        is_textured = isinstance(color, dict), isinstance(alpha, dict)
        if not any(is_textured):
            red, green, blue = _unit(constant * self.value(color))
            opacity = float(np.clip(self.value(alpha), 0, 1))
            mode = "BLEND" if opacity < 1 else "OPAQUE"
            return Material(base_color=(red, green, blue, opacity), alpha_mode=mode)
        plain = self._plain_base(color, alpha)
        if plain is not None and float(constant.max()) <= 1:
            red, green, blue = _unit(constant)
            return Material(base_color=(red, green, blue, 1.0), base_color_texture=plain)
        if is_textured == (False, True):
            factor, color = _unit(constant * self.value(color)), [1.0, 1.0, 1.0]
        else:
            factor, color = (1.0, 1.0, 1.0), {"do": "multiply", "of": [constant.tolist(), color]}
        red, green, blue = factor
        return Material(base_color=(red, green, blue, 1.0), base_color_texture=self._baked("colour", color, alpha))

    def _plain_base(self, color: Any, alpha: Any) -> Texture | None:
        """The texture of the colour's picture, if colour and alpha are that picture unchanged, so that nothing is baked."""
        if not self._is_picture(color, srgb=True):
            return None
        clear = self._pixels(color)[..., 3].min() < 255
        if isinstance(alpha, dict):
            same = self._is_picture(alpha, srgb=None) and alpha.get("alpha") and _place(alpha) == _place(color)
            return self._texture(color) if same and not color["black"] else None
        return self._texture(color) if alpha == 1 and not clear else None

    def _roughness(self) -> dict[str, Any]:
        rough, metal = self._usable(self.told["roughness"]), self._usable(self.told["metallic"])
        if not isinstance(rough, dict) and not isinstance(metal, dict):
            return {"roughness": _clipped(rough), "metallic": _clipped(metal)}
        (g, rough_of), (b, metal_of) = _channel(rough), _channel(metal)
        is_plain = (rough_of is None or (g == 1 and self._is_picture(rough_of, srgb=False))) and (
            metal_of is None or (b == 2 and self._is_picture(metal_of, srgb=False))
        )
        if is_plain and rough_of is not None and (metal == 0 or metal_of == rough_of):
            return {
                "roughness": 1.0,
                "metallic": 0.0 if metal_of is None else 1.0,
                "metallic_roughness_texture": self._texture(rough_of),
            }
        shares = {"do": "combine", "of": [0.0, rough, metal]}
        texture = self._baked("roughness", shares, 1.0, is_color=False)
        return {"roughness": 1.0, "metallic": 1.0, "metallic_roughness_texture": texture}

    def _emissive(self) -> dict[str, Any]:
        constant, rest = _product(self.told["emission"])
        rest = self._usable(_without_paint(rest))
        if not constant.any():
            return {}
        if not isinstance(rest, dict):
            return {"emissive": _floats(np.maximum(constant * self.value(rest), 0))}
        if self._is_picture(rest, srgb=True) and not rest["black"]:
            return {"emissive": _floats(np.maximum(constant, 0)), "emissive_texture": self._texture(rest)}
        greatest = float(np.max(self.value(rest), initial=0.0))
        if greatest <= 0:
            return {}
        bright = {"do": "multiply", "of": [1 / greatest, rest]}
        return {
            "emissive": _floats(np.maximum(constant * greatest, 0)),
            "emissive_texture": self._baked("emission", bright, 1.0),
        }

    def _occlusion(self) -> dict[str, Any]:
        """The occlusion texture and its strength, if a picture gives the arriving share of ambient light."""
        shade, strength = _faded(self.told["occlusion"])
        if not isinstance(self._usable(shade), dict):
            return {}
        channel, of = _channel(shade)
        if channel == 0 and self._is_picture(of, srgb=False):
            texture = self._texture(of)
        else:
            texture = self._baked("occlusion", {"do": "color", "of": [shade]}, 1.0, is_color=False)
        return {"occlusion_texture": texture, "occlusion_strength": strength}

    def _scalar(self, field: str, told: Any) -> dict[str, Any]:
        told = self._usable(told)
        if not isinstance(told, dict):
            return {field: _clipped(told)}
        texture = self._baked(field, {"do": "color", "of": [told]}, told, is_color=False)
        return {field: 1.0, f"{field}_texture": texture}

    def _normal(self) -> tuple[Texture | None, float]:
        told = self.told["normal"]
        if told is None:
            return None, 1.0
        color = self._usable(told["map"])
        if not isinstance(color, dict):
            return None, 1.0
        if self._is_picture(color, srgb=False):
            return self._texture(color), float(told["strength"])
        return self._baked("normals", color, 1.0, is_color=False), float(told["strength"])

    def _mean(self, told: Any) -> float:
        return float(np.mean(self.value(self._usable(told))))

    def _mean_color(self, told: Any) -> tuple[float, float, float]:
        color = np.atleast_1d(self.value(self._usable(told)))
        return _unit(color.reshape(-1, color.shape[-1]).mean(axis=0) * np.ones(3, np.float32))

    # Textures.

    def _usable(self, told: Any) -> Any:
        """The expression, or its constant value if it contains no usable picture."""
        leaves = [leaf for leaf in images_of(told) if self._index(leaf) is not None]
        return told if leaves else _plain(self.value(told))

    def _index(self, leaf: Told) -> int | None:
        """Index of a leaf's picture in the folder's images; None if the picture or its texture coordinates are missing."""
        has_uv = self.uvs[0] is not None and self._texcoord(leaf) is not None
        return self.painter.pictures[leaf["image"]].index if has_uv else None

    def _texcoord(self, leaf: Told) -> int | None:
        if leaf["uv"] == "":
            return 0
        return list(self.uvs).index(leaf["uv"]) if leaf["uv"] in self.uvs and leaf["uv"] is not None else None

    def _is_picture(self, told: Any, srgb: bool | None) -> bool:
        return (
            isinstance(told, dict)
            and cast("Told", told)["do"] == "image"
            and (srgb is None or (self.painter.pictures[cast("Told", told)["image"]].is_srgb == srgb and "alpha" not in told))
        )

    def _pixels(self, leaf: Told) -> NDArray[np.uint8]:
        index = self._index(leaf)
        assert index is not None
        return self.painter.folder.images[index].pixels

    def _texture(self, leaf: Told, image: int | None = None) -> Texture:
        """A texture with the leaf's coordinates and transform, of the image with index `image`, by default the leaf's own."""
        index, texcoord = self._index(leaf), self._texcoord(leaf)
        assert index is not None and texcoord is not None
        turn, (u, v), (x, y) = leaf["rotation"], leaf["scale"], leaf["offset"]
        # Blender's v points up, glTF's down: in 1 - v the rotation has the opposite direction and another centre.
        offset = float(x - v * np.sin(turn)), float(1 - y - v * np.cos(turn))
        return Texture(
            index if image is None else image,
            texcoord,
            leaf["wrap"],
            leaf["wrap"],
            nearest=leaf["nearest"],
            offset=offset if (turn, u, v, x, y) != (0, 1, 1, 0, 0) else (0.0, 0.0),
            rotation=float(turn),
            scale=(float(u), float(v)),
        )

    def _baked(self, what: str, color: Any, alpha: Any, *, is_color: bool = True) -> Texture:
        """A texture with the values of two expressions, colour and alpha; with `is_color` encoded as sRGB."""
        leaves = [leaf for told in (color, alpha) for leaf in images_of(told) if self._index(leaf) is not None]
        if any(_place(leaf) != _place(leaves[0]) for leaf in leaves):
            self.painter.folder.warn(
                f"material {self.told['name']!r}: its pictures lie on one another differently; all are laid as the first is"
            )
        key = json.dumps(["baked", color, alpha, is_color, [self._index(leaf) for leaf in leaves]])
        name = f"{self.told['name']} {what}"

        def make() -> Image:
            size = max(self._pixels(leaf).shape[0] for leaf in leaves), max(self._pixels(leaf).shape[1] for leaf in leaves)
            pixels = np.empty((*size, 4), np.uint8)
            light = np.clip(self.value(color, size), 0, 1)
            pixels[..., :3] = srgb_bytes(light) if is_color else np.rint(light * 255)
            pixels[..., 3] = np.rint(np.clip(self.value(alpha, size), 0, 1) * 255)
            return Image(name, pixels)

        return self._texture(leaves[0], self.painter.folder.derived(key, make))

    # Values.

    def value(self, told: Any, size: tuple[int, int] | None = None) -> Float:
        """The linear value of an expression: () or (3,); (H, W) or (H, W, 3) where it contains pictures."""
        if not isinstance(told, dict):
            return np.asarray(told, np.float32)
        told = cast("Told", told)
        if told["do"] == "image":
            return self._looked_up(told, size)
        if told["do"] == "attribute":
            return np.ones(3, np.float32)
        with np.errstate(all="ignore"):
            worked = WORK[told["do"]](told, *(self.value(of, size) for of in told["of"]))
        return np.nan_to_num(worked.astype(np.float32), nan=0.0, posinf=1e6, neginf=-1e6)

    def _looked_up(self, leaf: Told, size: tuple[int, int] | None) -> Float:
        index = self._index(leaf)
        if index is None:
            return np.float32(1.0) if leaf.get("alpha") else np.full(3, 0.5, np.float32)  # type: ignore[return-value]
        pixels = self._pixels(leaf)
        if size is not None and pixels.shape[:2] != size:
            rows, columns = (np.arange(n) * pixels.shape[k] // n for k, n in enumerate(size))
            pixels = pixels[rows[:, None], columns]
        alpha = pixels[..., 3].astype(np.float32) / 255
        if leaf.get("alpha"):
            return alpha
        table = np.arange(256) / 255
        table = linear(table) if self.painter.pictures[leaf["image"]].is_srgb else table
        color = table.astype(np.float32)[pixels[..., :3]]
        return color * alpha[..., None] if leaf["black"] else color


def images_of(told: Any) -> list[Told]:
    """The pictures in an expression, in order."""
    if not isinstance(told, dict):
        return []
    told = cast("Told", told)
    if told.get("do") == "image":
        return [told]
    return [leaf for of in told.get("of", [told.get("map")]) for leaf in images_of(of)]


def _place(leaf: Told) -> Any:
    return [leaf[name] for name in ("uv", "scale", "rotation", "offset", "wrap")]


def _product(told: Any) -> tuple[Float, Any]:
    """The product of the constant factors, (3,), and the expression of the other factors."""
    constant, rest = np.ones(3, np.float32), cast("list[Any]", [])
    for factor in _factors(told):
        if isinstance(factor, dict):
            rest.append(factor)
        else:
            constant = constant * np.asarray(factor, np.float32)
    if len(rest) > 1:
        return constant, {"do": "multiply", "of": rest}
    return constant, rest[0] if rest else [1.0, 1.0, 1.0]


def _factors(told: Any) -> list[Any]:
    """The factors of a product, including those of nested products."""
    if isinstance(told, dict) and cast("Told", told)["do"] == "multiply":
        return [factor for of in cast("Told", told)["of"] for factor in _factors(of)]
    return [told]


def _has_paint(told: Any) -> bool:
    if not isinstance(told, dict):
        return False
    told = cast("Told", told)
    return told["do"] == "attribute" or any(_has_paint(of) for of in told.get("of", ()))


def _is_paint(told: Any) -> bool:
    return isinstance(told, dict) and cast("Told", told)["do"] == "attribute"


def _without_paint(told: Any) -> Any:
    """The expression with 1 instead of vertex colours, which the mesh supplies."""
    if not isinstance(told, dict):
        return told
    told = cast("Told", told)
    if told["do"] == "attribute":
        return [1.0, 1.0, 1.0]
    return {**told, "of": [_without_paint(of) for of in told["of"]]} if "of" in told else told


def _channel(told: Any) -> tuple[int | None, Any]:
    """The number of the channel that an expression selects, and its operand."""
    if isinstance(told, dict) and cast("Told", told)["do"] == "channel":
        return cast("Told", told)["which"], cast("Told", told)["of"][0]
    return None, told if isinstance(told, dict) else None


def _faded(told: Any) -> tuple[Any, float]:
    """An expression without the mix with white that Blender's glTF importer adds, and the mix's share; any other expression and
    1.
    """
    mixed = _inside(told, "grey")
    if isinstance(mixed, dict) and cast("Told", mixed)["do"] == "mix" and cast("Told", mixed)["how"] == "MIX":
        share, white, shade = cast("Told", mixed)["of"]
        share = _inside(share, "clamp")
        if not isinstance(share, dict) and white == [1.0, 1.0, 1.0]:
            return _inside(shade, "color"), min(max(float(share), 0.0), 1.0)
    return told, 1.0


def _inside(told: Any, do: str) -> Any:
    """The operand of an expression of the kind `do`; any other expression itself."""
    return cast("Told", told)["of"][0] if isinstance(told, dict) and cast("Told", told)["do"] == do else told


def _plain(value: Float) -> Any:
    return value.tolist()


def _clipped(value: Any) -> float:
    return float(np.clip(np.mean(value), 0, 1))


def _floats(color: Float) -> tuple[float, float, float]:
    red, green, blue = (float(v) for v in color * np.ones(3))
    return red, green, blue


def _unit(color: Float) -> tuple[float, float, float]:
    return _floats(np.clip(color, 0, 1))


# One function for each kind of expression, on arrays whose last axis is the colour's if any operand is a colour.


def _aligned(*values: Float) -> list[Float]:
    """Values that broadcast against each other: if one is a colour, plain numbers get a colour axis."""
    is_color = [_is_color(v) for v in values]
    return [v[..., None] if any(is_color) and not c and v.ndim else v for v, c in zip(values, is_color, strict=True)]


def _is_color(value: Float) -> bool:
    return value.ndim in (1, 3)


def _grey(_: Told, value: Float) -> Float:
    return (value * LUMINANCE).sum(axis=-1) if _is_color(value) else value


def _as_color(_: Told, value: Float) -> Float:
    return value if _is_color(value) else np.repeat(value[..., None], 3, axis=-1)


def _multiply(_: Told, *values: Float) -> Float:
    product = values[0]
    for value in values[1:]:
        first, second = _aligned(product, value)
        product = first * second
    return product


def _soft(a: Float, b: Float) -> Float:
    return np.where(a < 0.5, 2 * a * b, 1 - 2 * (1 - a) * (1 - b))


BLENDS: dict[str, Callable[[Float, Float], Float]] = {
    "MIX": lambda _, b: b,
    "MULTIPLY": lambda a, b: a * b,
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: a - b,
    "SCREEN": lambda a, b: 1 - (1 - a) * (1 - b),
    "DARKEN": np.minimum,
    "LIGHTEN": np.maximum,
    "DIFFERENCE": lambda a, b: np.abs(a - b),
    "DIVIDE": lambda a, b: np.where(b != 0, a / b, a),
    "OVERLAY": _soft,
}


def _mix(told: Told, share: Float, first: Float, second: Float) -> Float:
    share, first, second = _aligned(share, first, second)
    return first + share * (BLENDS[told["how"]](first, second) - first)


MATHS: dict[str, Callable[[Float, Float, Float], Float]] = {
    "ADD": lambda a, b, _: a + b,
    "SUBTRACT": lambda a, b, _: a - b,
    "MULTIPLY": lambda a, b, _: a * b,
    "DIVIDE": lambda a, b, _: np.where(b != 0, a / b, 0),
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": lambda a, b, _: np.maximum(a, 0) ** b,
    "MINIMUM": lambda a, b, _: np.minimum(a, b),
    "MAXIMUM": lambda a, b, _: np.maximum(a, b),
    "LESS_THAN": lambda a, b, _: np.asarray(a < b, np.float32),
    "GREATER_THAN": lambda a, b, _: np.asarray(a > b, np.float32),
    "ROUND": lambda a, _, __: np.floor(a + np.float32(0.5)),
    "ABSOLUTE": lambda a, _, __: np.abs(a),
    "SQRT": lambda a, _, __: np.sqrt(np.maximum(a, 0)),
}


def _math(told: Told, *values: Float) -> Float:
    missing = [np.zeros((), np.float32)] * (3 - len(values))
    return MATHS[told["how"]](*_aligned(*values, *missing))


def _clamp(told: Told, value: Float) -> Float:
    return np.clip(value, told.get("low", 0.0), told.get("high", 1.0))


def _invert(_: Told, share: Float, color: Float) -> Float:
    share, color = _aligned(share, color)
    return color + share * (1 - 2 * color)


def _contrast(_: Told, color: Float, bright: Float, contrast: Float) -> Float:
    color, bright, contrast = _aligned(color, bright, contrast)
    return np.maximum((1 + contrast) * color + bright - contrast / 2, 0)


def _hue(_: Told, color: Float, hue: Float, saturation: Float, value: Float, share: Float) -> Float:
    """Blender's Hue/Saturation/Value: a hue of 0.5 changes nothing; settings given by pictures are replaced by their mean."""
    turned = _from_hsv(_to_hsv(color) + np.array([float(hue.mean()) - 0.5, 0, 0], np.float32), saturation, value)
    return _mix({"how": "MIX"}, share, color, turned)


def _to_hsv(color: Float) -> Float:
    top, low = color.max(axis=-1), color.min(axis=-1)
    span = np.where(top > low, top - low, 1)
    red, green, blue = (color[..., k] for k in range(3))
    hue = np.where(top == red, (green - blue) / span, np.where(top == green, 2 + (blue - red) / span, 4 + (red - green) / span))
    return np.stack([hue / 6 % 1, np.where(top > 0, (top - low) / np.where(top > 0, top, 1), 0), top], axis=-1)


def _from_hsv(hsv: Float, saturation: Float, value: Float) -> Float:
    hue, strength, top = hsv[..., 0] % 1, np.clip(hsv[..., 1] * saturation, 0, 1), hsv[..., 2] * value
    waves = np.stack([np.abs(hue * 6 - 3) - 1, 2 - np.abs(hue * 6 - 2), 2 - np.abs(hue * 6 - 4)], axis=-1)
    return (1 + (np.clip(waves, 0, 1) - 1) * strength[..., None]) * top[..., None]


def _of_channel(told: Told, color: Float) -> Float:
    return color[..., told["which"]] if _is_color(color) else color


def _combine(_: Told, *values: Float) -> Float:
    shape = np.broadcast_shapes(*(v.shape for v in values))
    return np.stack([np.broadcast_to(v, shape) for v in values], axis=-1)


def _table(told: Told, value: Float) -> Float:
    """A table's entry for each value in [0, 1]."""
    table = np.asarray(told["table"], np.float32)
    place = np.clip(value, 0, 1) * (len(table) - 1)
    low = np.minimum(place.astype(np.int64), len(table) - 2)
    share = (place - low)[..., None] if table.ndim == 2 else place - low
    return table[low] * (1 - share) + table[low + 1] * share


def _curves(told: Told, share: Float, color: Float) -> Float:
    table = told["table"]
    bent = np.stack([_table({"table": [row[k] for row in table]}, color[..., k]) for k in range(3)], axis=-1)
    return _mix({"how": "MIX"}, share, color, bent)


def _range(told: Told, value: Float, low: Float, high: Float, to_low: Float, to_high: Float) -> Float:
    span = np.where(high != low, high - low, 1)
    share = np.where(high != low, (value - low) / span, 0)
    return to_low + (np.clip(share, 0, 1) if told["clamp"] else share) * (to_high - to_low)


WORK: dict[str, Callable[..., Float]] = {
    "channel": _of_channel,
    "clamp": _clamp,
    "color": _as_color,
    "combine": _combine,
    "contrast": _contrast,
    "curves": _curves,
    "grey": _grey,
    "hue": _hue,
    "invert": _invert,
    "math": _math,
    "mix": _mix,
    "multiply": _multiply,
    "ramp": _table,
    "range": _range,
}
