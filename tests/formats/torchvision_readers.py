"""torchvision's readers of data sets, others' code, against which ours is tried."""

from __future__ import annotations

import importlib
import warnings

from torchvision_here import torchvision_here


def torchvision_datasets():
    """The module `torchvision.datasets`; skips the test where it cannot be had."""
    torchvision_here()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return importlib.import_module("torchvision.datasets")
