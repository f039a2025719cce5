"""The modules of usd-core, which has no type annotations. Import it only where `pxr` is installed."""

from __future__ import annotations

from importlib import import_module
from typing import Any

Ar: Any = import_module("pxr.Ar")
Gf: Any = import_module("pxr.Gf")
Sdf: Any = import_module("pxr.Sdf")
Tf: Any = import_module("pxr.Tf")
Usd: Any = import_module("pxr.Usd")
UsdGeom: Any = import_module("pxr.UsdGeom")
UsdShade: Any = import_module("pxr.UsdShade")
UsdSkel: Any = import_module("pxr.UsdSkel")
