"""Lenses that a recipe names by `projection`, each with options of its own beside it: a camera's, or a sensor's of a rig."""

from __future__ import annotations

from collections.abc import Container, Mapping
from typing import Annotated, Any, ClassVar, cast

from pydantic import (
    BeforeValidator,
    Field,
    GetJsonSchemaHandler,
    SerializeAsAny,
    SerializerFunctionWrapHandler,
    ValidationError,
    WithJsonSchema,
    model_serializer,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from viewsphere import plugins
from viewsphere.geometry.lenses import LensOptions
from viewsphere.model.fields.frozen import Frozen
from viewsphere.plugins.lens import LensSpec
from viewsphere.validation.errors import error_at, explained, one_of, shown


def _projections() -> dict[str, type[LensOptions]]:
    """The classes of options of all lenses that `projection` may name, by the lenses' names."""
    return {name: spec.options for name, spec in plugins.loadable(LensSpec).items() if spec.options is not None}


def _options_of(name: Any) -> type[LensOptions]:
    """The class of options of a lens; raises ValueError for other names, and PluginError for a lens that cannot be loaded."""
    is_lens = isinstance(name, str) and name in plugins.names("lenses")
    options = plugins.load(LensSpec, name).options if is_lens else None
    if options is None:
        with error_at("projection"):
            raise ValueError(one_of(name, tuple(_projections())))
    return options


def _named(value: Any) -> Any:
    if isinstance(value, LensOptions):
        return value
    raise ValueError(f"expected the name of a lens; found {shown(value)}")


ProjectionField = Annotated[SerializeAsAny[LensOptions], BeforeValidator(_named), WithJsonSchema({"type": "string"})]
"""The options of a lens. A recipe has its name, and the other options beside it."""


def _check_given(name: str, kind: type[LensOptions], given: Mapping[str, Any]) -> None:
    """Say of an option that is missing what it sets, unless another name is unknown, as then that one may be misspelt."""
    missing = [option for option, field in kind.model_fields.items() if field.is_required() and option not in given]
    if missing and given.keys() <= kind.model_fields.keys():
        meaning = kind.model_fields[missing[0]].description or "it"
        raise ValueError(f"expected {missing[0]} beside projection: {name}; found nothing: set {meaning}")


def _check_unowned(given: Mapping[str, Any], fields: Container[str]) -> None:
    """Say of an option of lenses that is set without `projection` which ones have it."""
    unknown = [name for name in given if name not in fields]
    lenses = _projections() if unknown else {}
    for option in unknown:
        if owners := [name for name, kind in lenses.items() if option in kind.model_fields]:
            with error_at(option):
                raise ValueError(f"expected projection: {' or '.join(owners)} beside it; found none: set projection")


class WithProjection(Frozen):
    """A mapping that may name a lens as `projection`, and then has the lens's options as fields of its own. `LENS` lists the
    fields that describe a lens in another way, which it may not have beside it.
    """

    LENS: ClassVar[tuple[str, ...]] = ()
    OMIT_IF_NONE: ClassVar[tuple[str, ...]] = ()
    """Fields that are written only if they are set, so that they change no digest of recipes without them."""

    projection: ProjectionField | None = Field(
        default=None,
        description="a lens with options of its own, which are written beside it, instead of an angle or a focal length",
    )

    @model_validator(mode="before")
    @classmethod
    def _with_options(cls, data: Any) -> Any:
        """Collect the options of the named lens."""
        if not isinstance(data, Mapping):
            return data
        given = cast("Mapping[str, Any]", data)
        if given.get("projection") is None:
            _check_unowned(given, cls.model_fields)
            return given
        if isinstance(given["projection"], LensOptions):
            cls._check_alone(given["projection"].projection, given)
            return given
        kind = _options_of(given["projection"])
        options = {name: value for name, value in given.items() if name in kind.model_fields or name not in cls.model_fields}
        rest = {name: value for name, value in given.items() if name not in options}
        cls._check_alone(given["projection"], rest)
        _check_given(given["projection"], kind, options)
        shared = [name for name in cls.model_fields if name not in (*cls.LENS, "projection")]
        try:
            return {**rest, "projection": kind.model_validate(options)}
        except ValidationError as error:
            raise explained(error, (*kind.model_fields, *shared)) from None

    @classmethod
    def _check_alone(cls, name: str, given: Mapping[str, Any]) -> None:
        beside = [field for field in cls.LENS if given.get(field) not in (None, cls.model_fields[field].default)]
        if beside:
            with error_at(beside[0]):
                raise ValueError(
                    f"expected none beside projection: {name}, whose own options describe the lens; found "
                    f"{shown(given[beside[0]])}: leave {beside[0]} or projection out"
                )

    @model_serializer(mode="wrap")
    def _beside_the_name(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        plain: dict[str, Any] = handler(self)
        options = plain.pop("projection", None)
        for name in self.OMIT_IF_NONE:
            if plain.get(name) is None:
                plain.pop(name, None)
        return plain | options if options else plain

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        written = super().__get_pydantic_json_schema__(schema, handler)
        fields = handler.resolve_ref_schema(written).get("properties", {})
        for name, kind in _projections().items():
            if plugins.is_third_party("lenses", name):
                continue
            own = kind.model_json_schema()
            assert "$defs" not in own, f"options of {name}: expected plain types"
            for option, value in own["properties"].items():
                if option != "projection":
                    fields.setdefault(option, {**value, "description": f"projection {name}: {value.get('description', '')}"})
        return written
