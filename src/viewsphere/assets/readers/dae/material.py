"""Materials of a COLLADA file: the common profile's colours, textures and opacity."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from viewsphere.assets.mesh import Material, Texture
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.primitive import Primitive
from viewsphere.assets.readers.dae.mesh import DaeFaces, numbers_of

SHADERS = ("phong", "blinn", "lambert", "constant")
LUMINANCE = (0.212671, 0.715160, 0.072169)
"""Weights of red, green and blue in the opacity of the modes RGB_ZERO and RGB_ONE (COLLADA 1.4.1, chapter 7)."""


@dataclass(eq=False)
class DaeMaterials:
    """The materials that pieces use so far, `kept`; `stated` are the indices of the materials whose `<transparent>` holds a
    texture, so that alpha is opacity. `root` is the file's tree, its tags without namespace.
    """

    folder: ModelFolder
    root: Any
    kept: list[Material] = field(default_factory=list[Material])
    stated: set[int] = field(default_factory=set[int])
    _elements: dict[tuple[str, str], Any] = field(default_factory=dict[tuple[str, str], Any])

    def __post_init__(self) -> None:
        for element in self.root.iter():
            if element.tag in ("image", "effect", "material"):
                self._elements.setdefault((element.tag, str(element.get("id"))), element)

    def dressed(self, faces: DaeFaces, part: str, instance: Any, sides: bool | None = None) -> Primitive:
        """The faces with the material of an `<instance_material>`; if that is None, the material whose id is the faces' symbol.
        sides: whether the geometry is double-sided, None if only the material may state it.
        """
        target = faces.symbol if instance is None else str(instance.get("target", "")).removeprefix("#")
        element = self._elements.get(("material", target))
        if element is None and target:
            self.folder.warn(f"material {target[:80]!r} does not exist; it is plain white")
        sets: list[int] = []
        material = Material(name="default") if element is None else self._material(element, _Coordinates(faces, instance, sets))
        if sides is not None:
            material = replace(material, double_sided=sides)
        if material not in self.kept:
            self.kept.append(material)
        index = self.kept.index(material)
        if element is not None and self._states_opacity(element):
            self.stated.add(index)
        uvs = [faces.uvs[number] for number in (sets or list(faces.uvs))[:2]]
        return Primitive(
            part=part,
            material=index,
            positions=faces.positions,
            triangles=faces.triangles,
            normals=faces.normals,
            uv0=uvs[0] if uvs else None,
            uv1=uvs[1] if len(uvs) > 1 else None,
            colors=faces.colors,
        )

    def _effect(self, element: Any) -> Any:
        """The effect of a material, None if it has none."""
        link = element.find("instance_effect")
        return self._elements.get(("effect", "" if link is None else str(link.get("url", "")).removeprefix("#")))

    def _states_opacity(self, element: Any) -> bool:
        effect = self._effect(element)
        return effect is not None and effect.find(".//transparent/texture") is not None

    def _material(self, element: Any, texcoord: Callable[[Any], int]) -> Material:
        effect = self._effect(element)
        name = str(element.get("name") or element.get("id") or "default")
        if effect is None:
            self.folder.warn(f"material {name[:80]!r} has no effect; it is plain white")
            return Material(name=name)
        profile = _Profile(self.folder, effect, self._elements, texcoord)
        color, emissive = profile.color("diffuse"), profile.color("emission")
        opacity, shininess = profile.opacity(), profile.number("shininess")
        rgb = (1.0, 1.0, 1.0) if color is None else (color[0], color[1], color[2])
        glow = (0.0, 0.0, 0.0) if emissive is None else (emissive[0], emissive[1], emissive[2])
        emission_texture = profile.texture("emission")
        return Material(
            name=name,
            base_color=(*rgb, opacity),
            base_color_texture=profile.texture("diffuse"),
            roughness=1.0 if shininess is None else float(np.sqrt(2.0 / (2.0 + max(shininess, 0.0)))),
            normal_texture=profile.bump(),
            emissive=glow if emission_texture is None else (1.0, 1.0, 1.0),
            emissive_texture=emission_texture,
            alpha_mode="BLEND" if opacity < 1.0 else "OPAQUE",
            double_sided=is_double_sided(element, effect) is not False,
        )


def is_double_sided(*elements: Any) -> bool | None:
    """The `<double_sided>` that programs write into an `<extra>` of elements; None if there is none."""
    found = (text for element in elements for text in element.iterfind(".//extra//double_sided"))
    words = [str(one.text or "").strip().lower() for one in found]
    return None if not words else words[0] not in ("0", "false", "0.0")


@dataclass(frozen=True, eq=False)
class _Coordinates:
    """Gives each `<texture>` its set of coordinates: 0 or 1, in order of first use; `sets` receives the file's numbers."""

    faces: DaeFaces
    instance: Any
    sets: list[int]

    def __call__(self, texture: Any) -> int:
        uvs, wanted = self.faces.uvs, str(texture.get("texcoord"))
        number = min(uvs, default=0)
        for bind in [] if self.instance is None else self.instance.iterfind("bind_vertex_input"):
            if bind.get("semantic") == wanted and bind.get("input_semantic") == "TEXCOORD":
                number = int(text) if (text := str(bind.get("input_set"))).isdecimal() else 0
        number = number if number in uvs else min(uvs, default=0)
        if uvs and number not in self.sets and len(self.sets) < 2:
            self.sets.append(number)
        return self.sets.index(number) if number in self.sets else 0


@dataclass(frozen=True, eq=False)
class _Profile:
    """The `profile_COMMON` of an effect."""

    folder: ModelFolder
    effect: Any
    elements: dict[tuple[str, str], Any]
    texcoord: Callable[[Any], int]

    def _channel(self, name: str) -> Any:
        found = (self.effect.find(f"profile_COMMON/technique/{shader}/{name}") for shader in SHADERS)
        return next((element for element in found if element is not None), None)

    def _numbers(self, name: str, kind: str) -> Sequence[float]:
        """Numbers of a channel's `kind` (color or float), possibly from a parameter that it refers to."""
        channel = self._channel(name)
        if channel is None:
            return ()
        value, link = channel.find(kind), channel.find("param")
        if value is None and link is not None:
            param = self._param(str(link.get("ref")))
            kinds = ("float4", "float3", "color") if kind == "color" else ("float",)
            value = None if param is None else next((e for k in kinds if (e := param.find(k)) is not None), None)
        return np.nan_to_num(numbers_of(self.folder, value, np.float64)).tolist()

    def color(self, name: str) -> tuple[float, float, float, float] | None:
        """A channel's colour in [0, 1], None if it has none."""
        values = [min(max(float(x), 0.0), 1.0) for x in self._numbers(name, "color")]
        return (values[0], values[1], values[2], values[3] if len(values) > 3 else 1.0) if len(values) >= 3 else None

    def number(self, name: str) -> float | None:
        """A channel's number, None if it has none."""
        values = self._numbers(name, "float")
        return float(values[0]) if values else None

    def opacity(self) -> float:
        """Share of light that the surface keeps, by the mode of `<transparent>`."""
        channel, color, factor = self._channel("transparent"), self.color("transparent"), self.number("transparency")
        factor = 1.0 if factor is None else factor
        if channel is None or color is None:
            return 1.0
        mode = str(channel.get("opaque") or "A_ONE")
        share = color[3] if mode.startswith("A_") else sum(w * c for w, c in zip(LUMINANCE, color, strict=False))
        opacity = share * factor if mode.endswith("_ONE") else 1.0 - share * factor
        return min(max(opacity, 0.0), 1.0)

    def texture(self, name: str) -> Texture | None:
        """A channel's texture; None, with a warning, if its picture cannot be used."""
        channel = self._channel(name)
        return None if channel is None else self._texture(channel.find("texture"))

    def bump(self) -> Texture | None:
        """The normal map that several programs add outside of the common profile."""
        return self._texture(next(self.effect.iterfind(".//bump/texture"), None))

    def _texture(self, texture: Any) -> Texture | None:
        if texture is None:
            return None
        path = self._path(str(texture.get("texture")))
        index = None if path is None else self.folder.image(path, path)
        return None if index is None else Texture(index, self.texcoord(texture))

    def _param(self, sid: str) -> Any:
        return next((p for p in self.effect.iter("newparam") if p.get("sid") == sid), None)

    def _path(self, name: str) -> str | None:
        """The file of the picture that a texture names: through a sampler and a surface, or by the picture's own id."""
        sampler = self._param(name)
        if sampler is not None:
            link, source = sampler.find("sampler2D/instance_image"), sampler.findtext("sampler2D/source")
            name = source or name if link is None else str(link.get("url")).removeprefix("#")
            surface = self._param(name.strip())
            name = name if surface is None else (surface.findtext("surface/init_from") or name)
        image = self.elements.get(("image", name.strip()))
        path = None if image is None else image.findtext("init_from/ref") or image.findtext("init_from")
        if not path or not path.strip():
            self.folder.warn(f"texture {name.strip()[:80]!r} has no picture; the material's plain factor is used")
            return None
        return path.strip()
