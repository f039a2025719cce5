"""Measures how the packages in src are divided, against the limits below.

scripts/structure.py           # fails where a figure is worse than its limit, and names places
scripts/structure.py --all     # names every place, also within the limits
"""

from __future__ import annotations

import argparse
import ast
import sys
import tomllib
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

ROOT = Path(__file__).parent.parent
CORE = "viewsphere"
LIMITS = {
    "folders with more than 15 files": (0, 0),
    "modules under 60 lines with one importer": (0, 0),
    "public functions and classes of the core": (2529, 2400),
    "modules in import cycles": (0, 0),
    "imports of a higher layer": (0, 0),
    "functions over 60 lines": (0, 0),
}
"""The figures of today, which no change may make worse, and their targets."""
FILES, SHORT, LONG = 15, 60, 60
PLUGINS = ("labels", "formats", "materials", "motion", "placing", "samplers", "trajectories", "lenses", "effects", "lights")
PLUGINS += ("plugins", "sources", "readers", "families", "places", "executors", "engines")
"""Folders whose modules are plug-ins, which the registry alone imports: any number of files."""
Imports = dict[str, set[str]]


@dataclass(frozen=True)
class Module:
    """One file of a package in src."""

    name: str
    path: Path

    @cached_property
    def source(self) -> bytes:
        return self.path.read_bytes()

    @cached_property
    def tree(self) -> ast.Module:
        return ast.parse(self.source)

    @property
    def lines(self) -> int:
        return self.source.count(b"\n")

    @property
    def is_package(self) -> bool:
        return self.path.name == "__init__.py"

    @property
    def is_plugin(self) -> bool:
        return self.path.parent.name in PLUGINS and not self.path.name.startswith("_")

    @property
    def has_kernels(self) -> bool:
        return self.path.name.startswith("kernels") or "kernels" in self.path.relative_to(ROOT / "src").parts

    def imported(self, modules: dict[str, Module]) -> set[str]:
        """Modules that this one imports: at load, in functions, and for types."""
        found = {name for node in ast.walk(self.tree) for name in _names(node, self, modules)}
        return found & modules.keys() - {self.name}

    def public(self) -> set[str]:
        """Public classes and functions at module level."""
        kinds = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
        return {node.name for node in self.tree.body if isinstance(node, kinds) and not node.name.startswith("_")}

    def functions(self) -> Iterator[tuple[str, int]]:
        """Names of functions, and their lines without the docstring."""
        for node in ast.walk(self.tree):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                first = node.body[0] if ast.get_docstring(node) else None
                described = (first.end_lineno or 0) - first.lineno + 1 if first else 0
                yield node.name, (node.end_lineno or node.lineno) - node.lineno + 1 - described


def _names(node: ast.AST, module: Module, modules: dict[str, Module]) -> Iterator[str]:
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    if isinstance(node, ast.ImportFrom):
        package = module.name if module.is_package else module.name.rpartition(".")[0]
        above = ".".join(package.split(".")[: len(package.split(".")) + 1 - node.level]) if node.level else ""
        base = ".".join(part for part in (above, node.module) if part)
        for alias in node.names:
            yield f"{base}.{alias.name}" if f"{base}.{alias.name}" in modules else base


def modules() -> dict[str, Module]:
    """All modules in src, by name."""
    paths = sorted((ROOT / "src").rglob("*.py"))
    names = (path.relative_to(ROOT / "src").with_suffix("").parts for path in paths)
    dotted = (".".join(parts[:-1] if parts[-1] == "__init__" else parts) for parts in names)
    return {name: Module(name, path) for name, path in zip(dotted, paths, strict=True)}


def full_folders() -> Iterator[str]:
    """Folders with more files than a reader takes in, other than folders of plug-ins."""
    counts = Counter(path.parent for path in (ROOT / "src").rglob("*") if path.is_file() and path.suffix != ".pyc")
    for folder, files in counts.items():
        if files > FILES and folder.name not in PLUGINS:
            yield f"{folder.relative_to(ROOT)}: {files} files"


def small_modules(found: dict[str, Module], imports: Imports) -> Iterator[str]:
    """Short modules that one other module imports, other than plug-ins and kernels."""
    importers: dict[str, set[str]] = defaultdict(set)
    for importer, names in imports.items():
        for name in names:
            importers[name].add(importer)
    for name, module in found.items():
        if module.is_package or module.is_plugin or module.has_kernels or module.lines >= SHORT:
            continue
        if len(importers[name]) == 1:
            yield f"{name}: {module.lines} lines, imported by {min(importers[name])}"


def public_names(found: dict[str, Module]) -> Iterator[str]:
    """The public names of the core's modules, other than plug-ins: one more of those is one more file, no new API."""
    for name, module in found.items():
        if name.split(".")[0] == CORE and not module.is_plugin:
            yield from (f"{name}.{public}" for public in sorted(module.public()))


def cycles(imports: Imports) -> Iterator[str]:
    """Groups of modules that import one another, by any number of steps."""
    order: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []

    def visit(name: str) -> Iterator[list[str]]:
        order[name] = low[name] = len(order)
        stack.append(name)
        for other in sorted(imports[name]):
            if other not in order:
                yield from visit(other)
            if other in stack:
                low[name] = min(low[name], low[other])
        if low[name] == order[name]:
            group = stack[stack.index(name) :]
            del stack[stack.index(name) :]
            if len(group) > 1:
                yield group

    sys.setrecursionlimit(10_000)
    for name in imports:
        if name not in order:
            for group in visit(name):
                yield from (f"{member}, in a cycle of {len(group)}" for member in group)


def upward(imports: Imports) -> Iterator[str]:
    """Imports from a layer above, by the layers in pyproject.toml."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]["contracts"]
    layers = next(contract["layers"] for contract in contracts if contract["type"] == "layers")
    height = {f"{CORE}.{package.strip()}": -row for row, layer in enumerate(layers) for package in layer.split("|")}
    for importer, names in imports.items():
        above = height.get(".".join(importer.split(".")[:2]), 1)
        for name in names:
            if height.get(".".join(name.split(".")[:2]), above) > above:
                yield f"{importer} imports {name}"


def long_functions(found: dict[str, Module]) -> Iterator[str]:
    """Functions over 60 lines, docstrings not counted, other than in kernels."""
    for name, module in found.items():
        if not module.has_kernels:
            yield from (f"{name}.{function}: {lines} lines" for function, lines in module.functions() if lines > LONG)


def figures() -> dict[str, list[str]]:
    """The places that count for each limit."""
    found = modules()
    imports = {name: module.imported(found) for name, module in found.items()}
    places = (
        full_folders(),
        small_modules(found, imports),
        public_names(found),
        cycles(imports),
        upward(imports),
        long_functions(found),
    )
    return {measure: sorted(each) for measure, each in zip(LIMITS, places, strict=True)}


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--all", action="store_true")
    chosen = options.parse_args()
    worse = False
    for measure, places in figures().items():
        limit, target = LIMITS[measure]
        print(f"{measure}: {len(places)} (limit {limit}, target {target})")
        is_worse = len(places) > limit
        worse |= is_worse
        if chosen.all or is_worse:
            print(*(f"  {place}" for place in places), sep="\n")
    if worse:
        sys.exit("scripts/structure.py: a figure is over its limit.")


if __name__ == "__main__":
    main()
