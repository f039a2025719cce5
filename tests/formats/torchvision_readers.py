"""torchvision, where it is installed: its readers of data sets are others' code, against which ours is tried."""

from __future__ import annotations

import sys
import warnings

import pytest

OPERATORS = ("nms", "qnms")
"""Operators of torchvision that its Python part asks for; without its compiled part they have to be declared."""


def torchvision_datasets():
    """The module `torchvision.datasets`; skips the test where it cannot be had."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        torch = pytest.importorskip("torch")
        try:
            import torchvision.datasets
        except ImportError:
            pytest.skip("needs torchvision")
        except RuntimeError:  # torchvision is built for another torch
            for name in [name for name in sys.modules if name.split(".")[0] == "torchvision"]:
                del sys.modules[name]
            _declare(torch)
            import torchvision.datasets
    return torchvision.datasets


def _declare(torch) -> None:
    library = torch.library.Library("torchvision", "DEF")
    for name in OPERATORS:
        library.define(f"{name}(Tensor dets, Tensor scores, float iou_threshold) -> Tensor")
    torchvision_datasets.__dict__["library"] = library  # it lasts as long as this object
