"""The entry of camera effects: its fields are the strengths and options of plug-ins."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache
from types import new_class
from typing import Any, ClassVar, Self, cast

from pydantic import (
    GetJsonSchemaHandler,
    ValidationInfo,
    create_model,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from viewsphere import plugins
from viewsphere.errors import PluginError
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.scene import SEED, Effects
from viewsphere.plugins.effect import EffectSpec
from viewsphere.recipe.draws import span
from viewsphere.recipe.entries import entry_of
from viewsphere.recipe.world.finish import PerFrame

ABOUT = "Camera effects; strengths are 0 (none) to 1 (the strongest useful effect)."


class EffectsEntry(PerFrame):
    """The fields that all entries have, and a reader of them all.

    This class reads a mapping as a subclass with the fields of the recorded effects (`EffectSpec.record`) and of others that
    the mapping names. So a plug-in of effects is loaded only if it is used.
    """

    specs: ClassVar[tuple[EffectSpec, ...]] = ()

    @property
    def strengths(self) -> Iterator[tuple[EffectSpec, float]]:
        """The effects that can be on, with the strength farthest from 0 that they may have."""
        strongest = ((spec, max(span(getattr(self, spec.name)), key=abs)) for spec in self.specs)
        return ((spec, strength) for spec, strength in strongest if strength)

    @property
    def is_noisy(self) -> bool:
        """True if the effects can include noise, which differs in every frame."""
        return any(spec.is_noisy and getattr(self, spec.name) for spec in self.specs)

    @property
    def effects(self) -> Effects:
        """The effects of an entry without distributions, without noise, in the order in which they are stored."""
        recorded = [field for spec in self.specs if spec.record is not None for field in spec.options.model_fields]
        fields = self.model_dump(mode="json", exclude=set(PerFrame.model_fields))
        first = {name: fields.pop(name) for name in dict.fromkeys(recorded)}
        return Effects.model_validate(first | {SEED: 0} | fields)

    @classmethod
    def of_defaults(cls) -> Self:
        """The entry without effects."""
        return cast(Self, _entry(_recorded()).model_construct())

    @classmethod
    def _validated(cls, value: Any, info: ValidationInfo) -> Self:
        if isinstance(value, EffectsEntry):
            return cast(Self, value)
        named = cast("Mapping[Any, Any]", value) if isinstance(value, Mapping) else {}
        return cast(Self, _entry_with(named).model_validate(value, context=info.context))

    @classmethod
    def _known_names(cls) -> tuple[str, ...]:
        """The nearest name of a misspelt effect may be one of a plug-in that is not loaded."""
        return tuple(dict.fromkeys((*super()._known_names(), *plugins.names("effects"))))

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """The schema with all effects of viewsphere itself."""
        if cls is not EffectsEntry:
            return super().__get_pydantic_json_schema__(schema, handler)
        shipped = _entry_with(plugins.shipped("effects"))
        shipped.model_rebuild()
        return handler.resolve_ref_schema(handler(shipped.__pydantic_core_schema__))

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (tuple(spec.name for spec in self.specs), self.__getstate__())


def _restored(names: tuple[str, ...], state: dict[Any, Any]) -> EffectsEntry:
    """The entry that another process has pickled."""
    kind = _entry_with(dict.fromkeys(names))
    entry = kind.__new__(kind)
    entry.__setstate__(state)
    return entry


def _entry_with(named: Mapping[Any, Any]) -> type[EffectsEntry]:
    """The class whose fields are those of the recorded effects, and of others among these names."""
    recorded = _recorded()
    others = {name for name in plugins.names("effects") if name in named} - {spec.name for spec in recorded}
    return _entry((*recorded, *(plugins.load(EffectSpec, name) for name in sorted(others))))


def _recorded() -> tuple[EffectSpec, ...]:
    """The effects that recipes and shots always have, in their order."""
    return _recorded_of(tuple(plugins.shipped("effects")))


@lru_cache(maxsize=4)
def _recorded_of(shipped: tuple[str, ...]) -> tuple[EffectSpec, ...]:
    specs = [plugins.load(EffectSpec, name) for name in shipped]
    return tuple(sorted((spec for spec in specs if spec.record is not None), key=lambda spec: (spec.record, spec.name)))


@lru_cache(maxsize=16)
def _entry(specs: tuple[EffectSpec, ...]) -> type[EffectsEntry]:
    """The class of entries with the fields of these effects; raises PluginError for two fields of one name."""
    fields: dict[str, Any] = {}
    homes: dict[str, EffectSpec] = {}
    for spec in specs:
        for name, field in spec.options.model_fields.items():
            home = homes.setdefault(name, spec)
            if home.options is not spec.options:
                where = plugins.module_file("effects", spec.name) or spec.name
                raise PluginError(
                    f"{where}: EffectSpec.options: {name}: expected a name that no other effect has; found a field of "
                    f"{home.name}: begin it with the effect's name"
                )
            fields[name] = (field.annotation, field)
    part = create_model("Effects", __base__=Frozen, **fields)
    body = {"specs": specs, "__doc__": ABOUT, "__module__": __name__}
    return new_class("EffectsEntry", (entry_of(part), EffectsEntry), exec_body=lambda names: names.update(body))
