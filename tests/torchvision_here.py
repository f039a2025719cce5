"""torchvision, where it is installed, also beside a torch that its compiled part was not built for."""

from __future__ import annotations

import sys
import warnings

import numpy as np
import pytest

OPERATORS = ("nms", "qnms")
"""Operators that torchvision's Python part asks for; without its compiled part they have to be declared."""


def torchvision_here():
    """The module `torchvision`; skips the test where it cannot be had. Its detectors work without its compiled part."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        torch = pytest.importorskip("torch")
        try:
            import torchvision
        except ImportError:
            pytest.skip("needs torchvision")
        except RuntimeError:  # torchvision is built for another torch
            for name in [name for name in sys.modules if name.split(".")[0] == "torchvision"]:
                del sys.modules[name]
            _declare(torch)
            import torchvision
            from torchvision.ops import boxes

            boxes._assert_has_ops = lambda: None
    return torchvision


def _declare(torch) -> None:
    library = torch.library.Library("torchvision", "DEF")
    for name in OPERATORS:
        library.define(f"{name}(Tensor dets, Tensor scores, float iou_threshold) -> Tensor")
    library.impl("nms", _best, "CPU")
    torchvision_here.__dict__["library"] = library  # it lasts as long as this object


def _best(boxes, scores, threshold):
    """Numbers of the boxes, best first, that overlap no better one by more than the threshold."""
    from torchvision.ops import box_iou

    order = scores.argsort(descending=True, stable=True)
    overlaps = box_iou(boxes[order], boxes[order]).numpy() > threshold
    is_kept = np.ones(len(order), bool)
    for i in range(len(order)):
        if is_kept[i]:
            is_kept[i + 1 :] &= ~overlaps[i, i + 1 :]
    return order[is_kept]
