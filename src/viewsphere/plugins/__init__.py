"""Plug-ins: a registry that finds and loads them, and one frozen, typed spec a kind, each in a file of its own."""

from viewsphere.plugins.registry import (
    SEAMS,
    Kind,
    attribute,
    checked,
    entry_points,
    gap,
    is_third_party,
    load,
    loadable,
    module_file,
    names,
    origin,
    prefix_of,
    shipped,
)

__all__ = [
    "SEAMS",
    "Kind",
    "attribute",
    "checked",
    "entry_points",
    "gap",
    "is_third_party",
    "load",
    "loadable",
    "module_file",
    "names",
    "origin",
    "prefix_of",
    "shipped",
]
