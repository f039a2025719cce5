"""The reference of the Python API documents every parameter, result and field of the names that it lists."""

import dataclasses
import importlib
import inspect
import re

import pytest
import yaml

from small import ROOT

ENTRY = re.compile(r"^::: ([\w.]+)\n((?:    .*\n)*)", re.MULTILINE)
SECTION = re.compile(r"^(\w+):\n((?:(?:    .*)?(?:\n|\Z))+)", re.MULTILINE)
ITEM = re.compile(r"^    [*]*(\w+): \S", re.MULTILINE)


def named(path):
    module, _, name = path.rpartition(".")
    return getattr(importlib.import_module(module), name)


def listed():
    """Each function and class of the page, and each public method that the page shows, by its path."""
    for path, block in ENTRY.findall((ROOT / "docs" / "reference.md").read_text("utf-8")):
        if path == "viewsphere.errors":
            continue
        thing, options = named(path), (yaml.safe_load(block) or {}).get("options", {})
        yield path, thing
        if inspect.isclass(thing):
            for name in options.get("members", [name for name in vars(thing) if not name.startswith("_")]):
                assert hasattr(thing, name), f"{path} has no {name}"
                method = getattr(thing, name)
                if inspect.isfunction(method) or inspect.ismethod(method):
                    yield f"{path}.{name}", method


LISTED = dict(listed())


def section(thing, title):
    """The text of a section of a docstring, empty without it."""
    return dict(SECTION.findall(inspect.getdoc(thing) or "")).get(title, "")


def items(thing, title):
    return ITEM.findall(section(thing, title))


def parameters(thing):
    """The parameters that a caller gives; a class whose fields are its parameters has none of its own."""
    if inspect.isclass(thing) and ("__init__" not in vars(thing) or dataclasses.is_dataclass(thing)):
        return []
    return [name for name in inspect.signature(thing).parameters if name != "self"]


def fields(thing):
    """The fields of a dataclass or a model."""
    if dataclasses.is_dataclass(thing):
        return [field.name for field in dataclasses.fields(thing)]
    return list(getattr(thing, "model_fields", {}))


@pytest.mark.parametrize("path", LISTED)
def test_each_parameter_is_documented_in_order(path):
    assert items(LISTED[path], "Args") == parameters(LISTED[path])


@pytest.mark.parametrize("path", [path for path, thing in LISTED.items() if not inspect.isclass(thing)])
def test_each_result_is_documented(path):
    returned = inspect.signature(LISTED[path]).return_annotation
    assert bool(section(LISTED[path], "Returns")) == (returned not in ("None", None))


@pytest.mark.parametrize(
    "path", [path for path, thing in LISTED.items() if inspect.isclass(thing) and not path.endswith("Recipe")]
)
def test_each_field_of_a_class_is_documented(path):
    """A recipe's fields have descriptions of their own, which docs/recipe.md lists."""
    kind = LISTED[path]
    own = [name for base in kind.__mro__[1:] for name in getattr(base, "__dataclass_fields__", {})]
    wanted = [name for name in fields(kind) if name not in own]
    assert [name for name in items(kind, "Attributes") if name in wanted] == wanted


def test_a_missing_parameter_is_found():
    def lacking(a: int, b: int) -> int:
        """The sum.

        Args:
            a: A number.
        """
        return a + b

    assert items(lacking, "Args") == ["a"] != parameters(lacking)
    assert not section(lacking, "Returns")
