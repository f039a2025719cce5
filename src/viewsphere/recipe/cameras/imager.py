"""The imager of a recipe's camera: a preset's name, or fields, with or without a preset."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated, Any, cast

from pydantic import BeforeValidator, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from viewsphere.model.sensors.imager import Imager
from viewsphere.validation.errors import error_at, one_of, shown

REQUIRED = ("full_well", "read_noise")
"""Fields of an imager without a preset."""

PRESETS: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {
        "phone": {
            "full_well": 6000.0,
            "read_noise": 1.0,
            "bits": 10,
            "black_level": 64,
            "base_iso": 55.0,
            "response": (0.372, 1.0, 0.707),
            "matrix": ((1.586, -0.373, -0.213), (-0.323, 1.92, -0.597), (-0.085, -0.498, 1.583)),
            "f_number": 1.7,
        },
        "webcam": {
            "full_well": 8180.0,
            "read_noise": 1.49,
            "adc_noise": 2.6,
            "bits": 12,
            "black_level": 256,
            "response": (0.309, 1.0, 0.717),
            "matrix": ((2.228, -0.961, -0.267), (-0.347, 2.12, -0.773), (-0.161, -0.445, 1.606)),
            "most_iso": 1600.0,
        },
        "machine_vision": {
            "full_well": 10715.0,
            "read_noise": 2.4,
            "bits": 12,
            "black_level": 240,
            "response": (0.264, 1.0, 0.651),
            "matrix": ((2.21, -0.789, -0.421), (-0.423, 2.416, -0.993), (-0.153, -0.565, 1.718)),
        },
        "drone": {
            "full_well": 14837.0,
            "read_noise": 3.26,
            "bits": 12,
            "black_level": 200,
            "response": (0.494, 1.0, 0.66),
            "matrix": ((1.816, -0.335, -0.481), (-0.473, 2.351, -0.878), (-0.083, -0.604, 1.687)),
        },
    }
)
"""Sensors, by the kind of camera that has them. Everything else keeps its default: faults of lenses are off except cos^4, and
a base ISO that is not named here is nominal.

phone: Sony IMX363 of Google's Pixel 4a. Full well, read noise, black level, bits, f-number and ISO of unit gain are those of
ISETCam's model (https://github.com/ISET/isetcam, `sensorIMX363V2.m`); its read noise is the model's, not known to be measured.
Colours: Sony IMX378 of earlier Pixels.
webcam: Sony IMX477 of Raspberry Pi's High Quality Camera, measured in *Pi HQ Cam Sensor Performance*
(https://www.strollswithmydog.com): 8,180 electrons, 0.47 DN per electron, black 256, read noise
3 electrons at gain 1 and 1.5 at gain 16, the largest.
machine_vision: Sony IMX250, measured by MATRIX VISION by EMVA 1288 in the mvBlueFOX3-2051
(https://www.matrix-vision.com/manuals/mvBlueFOX3/mvBC_subsubsection_sensors_CMOS_models_2051.html): SNR 40.3 dB, whose
square is the full well, and dynamic range 71.2 dB, from which the read noise follows. Black level and colours: Sony IMX296,
which has the same pixels.
drone: Sony IMX183, of one inch, by FLIR's EMVA 1288 figures of the BFS-U3-200S6M, as quoted by others: 14,837
electrons, dynamic range 11.93 bits.
Black level and colours: Sony IMX283, of the same size, with the same pixels.

The read noise s of a dynamic range is that of EMVA 1288: the threshold, full well / range, is 1/2 + sqrt(1/4 + s^2) electrons.
Black levels, and colours at 6500 K, are Raspberry Pi's calibrations in libcamera (https://github.com/raspberrypi/libcamera,
`src/ipa/rpi/vc4/data`, CC0), interpolated to D65.
"""


def _read(value: Any) -> Any:
    """The fields of an imager: those of a preset, changed by those beside it."""
    if isinstance(value, Imager):
        return value
    if isinstance(value, str):
        return dict(_preset(value))
    if not isinstance(value, Mapping):
        raise ValueError(f"expected {', '.join(PRESETS)}, or a mapping of preset and other fields; found {shown(value)}")
    given = dict(cast("Mapping[str, Any]", value))
    if "preset" not in given:
        if missing := [name for name in REQUIRED if name not in given]:
            raise ValueError(f"expected preset, or {' and '.join(REQUIRED)}; found no {missing[0]}")
        return given
    name = given.pop("preset")
    with error_at("preset"):
        fields = dict(_preset(name))
    return fields | given


def _preset(name: Any) -> Mapping[str, Any]:
    if not isinstance(name, str) or name not in PRESETS:
        raise ValueError(one_of(name, tuple(PRESETS)))
    return PRESETS[name]


class _Schema:
    """The JSON schema: a preset's name, or the fields, of which those of a preset may be missing."""

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        written = handler(schema)
        names: dict[str, Any] = {"type": "string", "enum": list(PRESETS)}
        preset = {"preset": {**names, "description": "sensor whose fields hold where this mapping has none"}}
        fields = handler.resolve_ref_schema(written)
        fields.pop("required", None)
        fields["properties"] = preset | fields["properties"]
        return {"anyOf": [names, written]}


ImagerField = Annotated[Imager, BeforeValidator(_read), _Schema()]
