"""Print the test files that a change can break, one a line, or `tests` for all of them; print the reason on standard error.

    scripts/chosen_tests.py              this branch and the working tree, since the branch left origin/main
    scripts/chosen_tests.py REVISION     since that revision

A test file is chosen if it changed, or if it reaches a module that changed. It reaches what it imports, what its helpers
and fixtures import, and what all of these import in turn, also inside functions (grimp reads the imports). Plug-ins, the
command line and files are no imports. So a test also reaches what its strings name: a plug-in, a dotted path, the program,
a file of `docs`, `recipes`, `examples`, `benchmarks` or `scripts` and what this file names in turn. A test that reads all
files of `src` is chosen for each of them.

All tests are chosen where this cannot tell: without a revision to compare with, for a module that no test reaches, and for
every other changed file. CI runs all tests on the default branch.
"""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, reduce
from operator import or_
from pathlib import Path

import grimp

from viewsphere import _HOMES
from viewsphere.model.channel import DEFAULT_CHANNELS, PICTURES
from viewsphere.model.shot import Shot
from viewsphere.plugins.registry import SEAMS, shipped

ROOT = Path(__file__).parent.parent
MAIN = "origin/main"
READ = ("docs", "recipes", "examples", "benchmarks", "scripts")
"""Folders of files that tests read or run."""
ROOTS = {"viewsphere", "viewsphere_zoo"}
NAMING = ("viewsphere.formats.", "viewsphere.labels.", "viewsphere_zoo.")
"""Packages whose plug-ins name others. All other modules are given the names by recipes and by tests."""
LISTS = {
    "channel_labels": "viewsphere.labels.",
    "labels": "viewsphere.labels.",
    "formats": "viewsphere.formats.",
    "family_names": "viewsphere_zoo.",
    "place_names": "viewsphere_zoo.",
    "things": "viewsphere_zoo.",
    "zoo": "viewsphere_zoo.",
    "loadable": "viewsphere.",
    "plugins": "viewsphere.",
    "names": "viewsphere.",
}
"""Functions and commands that list plug-ins without naming them, with the package that each lists."""
SCANS = {"rglob", "copytree"}
"""Functions that go through all files of a folder."""
BY_PATH = re.compile(r"attribute\(|[\"']viewsphere(?:_zoo)?\.")
PATH, PROGRAM = re.compile(r"viewsphere(?:_zoo)?(?:\.\w+)+"), re.compile(r"\bviewsphere\b(?!\.)")
WORD, FILE = re.compile(r"\w+"), re.compile(r"[\w./-]+")


class CannotTell(Exception):
    """The reason why no tests can be left out."""


@dataclass(frozen=True)
class Text:
    """The references of a source text: imports, identifiers, strings, and calls with their first argument."""

    imports: frozenset[str] = frozenset()
    names: frozenset[str] = frozenset()
    strings: frozenset[str] = frozenset()
    calls: frozenset[str] = frozenset()

    def __or__(self, other: Text) -> Text:
        return Text(*(getattr(self, name) | getattr(other, name) for name in self.__dataclass_fields__))

    @property
    def words(self) -> set[str]:
        """The words of all strings."""
        return {word for text in self.strings for word in WORD.findall(text)}

    @property
    def scans(self) -> bool:
        """Return whether it goes through the files of `src`, by that path or by the package's `__file__`."""
        package = "src" in self.strings or {"viewsphere", "__file__"} <= self.names
        return package and not SCANS.isdisjoint(self.names)

    @property
    def files(self) -> set[str]:
        """All strings, and the paths and names of files within them."""
        paths = {path for text in self.strings for path in FILE.findall(text) if "/" in path or "." in path}
        return self.strings | paths | {path.rpartition("/")[2] for path in paths}


def text_of(tree: ast.AST) -> Text:
    """Return the references of a syntax tree, without its docstrings."""
    imports, names, strings, calls = set[str](), set[str](), set[str](), set[str]()
    docs = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        match node:
            case ast.Import():
                imports |= {alias.name for alias in node.names}
            case ast.ImportFrom(module=str() as module, level=0):
                imports |= {module, *(f"{module}.{alias.name}" for alias in node.names)}
            case ast.Name(id=name) | ast.Attribute(attr=name) | ast.arg(arg=name):
                names.add(name)
            case ast.Constant(value=str() as value) if id(node) not in docs:
                strings.add(value)
            case _:
                pass
        if isinstance(node, ast.Call):
            calls.add(getattr(node.func, "id", getattr(node.func, "attr", "")))
            calls |= {str(word.value) for word in node.args[:1] if isinstance(word, ast.Constant)}
    return Text(*map(frozenset, (imports, names, strings, calls)))


def parsed(path: Path) -> ast.Module:
    """The syntax tree of a Python file."""
    return ast.parse(path.read_text(encoding="utf-8"))


UNNAMED = {"effects", "lights", "readers"}
"""Kinds of plug-ins whose names are common words (blur, point, off): tests reach them through the module that loads them."""


class Modules:
    """The modules of viewsphere, and which others each imports or names."""

    def __init__(self) -> None:
        graph = grimp.build_graph("viewsphere", "viewsphere_zoo", exclude_type_checking_imports=True)
        self.all = frozenset(graph.modules)
        self.plugins = defaultdict[str, set[str]](set)
        for kind in SEAMS.keys() - UNNAMED:
            for name, module in shipped(kind).items():
                self.plugins[name].add(module)
        self.plugins["zoo"] = {"viewsphere_zoo.source"}
        self.needs = {module: graph.find_modules_directly_imported_by(module) | self._named(module) for module in self.all}
        for loader, meant in self._implied().items():
            self.needs[loader] |= meant
        self.needs["viewsphere"] = {"viewsphere.model.fields.notebook"}  # all else is imported for a name that is used
        for module in self.all - ROOTS:
            self.needs[module].add(module.rpartition(".")[0])  # whose own file runs first

    def _implied(self) -> dict[str, set[str]]:
        """By the module that loads them: the plug-ins that a recipe means without naming them, and the program for Blender."""
        samplers, readers, sources, lights, lenses, effects, worker = (
            {module for module in self.all if module.startswith(f"{package}.")}
            for package in (
                SEAMS["samplers"].package,
                SEAMS["readers"].package,
                SEAMS["sources"].package,
                SEAMS["lights"].package,
                SEAMS["lenses"].package,
                SEAMS["effects"].package,
                "viewsphere.blender.worker",
            )
        )
        defaults = self.plugins[Shot.model_fields["engine"].default].union(
            *(self.plugins[name] for name in DEFAULT_CHANNELS if name not in PICTURES)
        )
        return {
            "viewsphere.planning.plan": samplers,
            "viewsphere.assets.readers": readers,
            "viewsphere.recipe.lights": lights,
            "viewsphere.geometry.lenses": lenses,
            "viewsphere.recipe.world.effects": effects,
            "viewsphere.planning.checks.models": defaults,
            "viewsphere.run.shots.stages": defaults,
            "viewsphere.blender.process": worker,
            "viewsphere.plugins.source": self.plugins["zoo"] | sources,
        }

    def _named(self, module: str) -> set[str]:
        """Return the modules that a module's strings name: dotted paths, and in a plug-in the plug-ins it works with."""
        if not module.startswith(NAMING) and not BY_PATH.search(self.file(module).read_text(encoding="utf-8")):
            return set()
        strings = text_of(parsed(self.file(module))).strings
        full = {
            text if text.startswith(("viewsphere.", "viewsphere_zoo.")) else f"viewsphere.{text}"
            for text in strings
            if "." in text
        }
        named = {self.at(path) for path in full} if module != "viewsphere" else set[str]()  # whose names users import
        if module.startswith(NAMING):
            named = named.union(*(self.plugins.get(text, ()) for text in strings))
        return named - {module, "viewsphere"}

    @staticmethod
    def file(module: str) -> Path:
        """A module's file."""
        path = ROOT / "src" / module.replace(".", "/")
        return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")

    def at(self, path: str) -> str:
        """The longest beginning of a dotted path that is a module."""
        while path not in self.all and "." in path:
            path = path.rpartition(".")[0]
        return path if path in self.all else "viewsphere"

    def used_by(self, text: Text) -> set[str]:
        """The modules that a test's text imports or names itself."""
        paths = {path for string in text.strings for path in PATH.findall(string)}
        used = {self.at(name) for name in (*text.imports, *paths) if name.partition(".")[0] in ROOTS}
        programs = {string for string in text.strings if PROGRAM.search(string)}
        if programs or "viewsphere" in text.imports:
            words = {word for string in programs for word in WORD.findall(string)} | text.names
            words |= {name.rpartition(".")[2] for name in text.imports}
            used |= {self.at(f"viewsphere.{home}") for name, home in _HOMES.items() if name in words}
        if programs:
            used |= {"viewsphere.__main__", "viewsphere.cli"}
        if "_repr_html_" in text.calls:
            used.add("viewsphere.preview.notebook")  # which the package's own file names
        for name in self.plugins.keys() & text.words:
            used |= self.plugins[name]
        listed = text.calls & LISTS.keys()
        for kind in listed - {"names"} or listed:  # `names("labels")` lists labels alone
            used |= {module for modules in self.plugins.values() for module in modules if module.startswith(LISTS[kind])}
        return used

    def affected(self, changed: Iterable[str]) -> set[str]:
        """These modules and all that need them."""
        users = defaultdict[str, set[str]](set)
        for module, needs in self.needs.items():
            for needed in needs:
                users[needed].add(module)
        return closure(changed, lambda module: users.get(module, ()))


class Tests:
    """The test files, their helpers and fixtures, and the files that they read."""

    def __init__(self, files: Sequence[str]) -> None:
        self.texts: dict[str, Text] = {}
        self._fixtures, self._helpers, self._read = (defaultdict[str, set[str]](set) for _ in range(3))
        self._always = dict[str, str]()
        for file in map(Path, files):
            if file.parts[0] not in ("tests", *READ):
                continue
            if file.name == "conftest.py":
                self._add_conftest(file)
                continue
            self.texts[str(file)] = self._text(ROOT / file)
            if file.parts[0] in READ:
                folder = file.parts[0]
                for name in {file.name if file.suffix else str(file), folder, f"{folder}/"}:
                    self._read[name].add(str(file))
            if file.suffix == ".py":
                self._helpers[file.stem].add(str(file))
        self.files = [file for file in self.texts if is_test(file)]
        self.follow = cache(self._follow)

    @staticmethod
    def _text(path: Path) -> Text:
        if path.suffix == ".py":
            return text_of(parsed(path))
        with suppress(UnicodeDecodeError):
            return Text(strings=frozenset([path.read_text(encoding="utf-8")]))
        return Text()

    def _add_conftest(self, file: Path) -> None:
        """Each name at the top of a conftest is a text of its own: a test reaches the fixtures that it names."""
        tree = parsed(ROOT / file)
        imports = {
            alias.asname or alias.name.partition(".")[0]: text_of(ast.Module([line], []))
            for line in tree.body
            if isinstance(line, ast.Import | ast.ImportFrom)
            for alias in line.names
        }
        for number, line in enumerate(tree.body):
            text, node = text_of(line), f"{file}::{number}"
            self.texts[node] = reduce(or_, (imports[name] for name in text.names & imports.keys()), text)
            for name in bound_by(line):
                self._fixtures[name].add(node)
            if "autouse" in ast.unparse(line):
                self._always[node] = str(file.parent)

    def _follow(self, node: str) -> set[str]:
        """The helpers, fixtures and read files that a text names; of a read file the files that it extends or imports."""
        text = self.texts[node]
        found = {always for always, folder in self._always.items() if node.startswith(f"{folder}/")}
        for name in text.imports:
            found |= self._helpers.get(name.partition(".")[0], set())
        if node.startswith("tests/"):
            for name in self._fixtures.keys() & (text.names | text.strings):
                found |= {there for there in self._fixtures[name] if node.startswith(f"{Path(there).parent}/")}
        if not node.startswith("docs/"):
            for name in self._read.keys() & text.files:
                found |= self._read[name]
        return found

    def reached(self, file: str) -> set[str]:
        """The texts that a test file reaches, itself among them."""
        return closure([file], self.follow)


def bound_by(line: ast.stmt) -> set[str]:
    """The names that a statement at the top of a file binds."""
    if isinstance(line, ast.Assign):
        return {part.id for target in line.targets for part in ast.walk(target) if isinstance(part, ast.Name)}
    return {name} if isinstance(name := getattr(line, "name", None), str) else set()


def closure(starts: Iterable[str], follow: Callable[[str], Iterable[str]]) -> set[str]:
    """These and all that follows from them."""
    seen, waiting = set[str](), [*starts]
    while waiting:
        if (one := waiting.pop()) not in seen:
            seen.add(one)
            waiting += follow(one)
    return seen


def is_test(file: str) -> bool:
    """Return whether pytest collects this file."""
    return file.startswith("tests/") and Path(file).name.startswith("test_") and file.endswith(".py")


def git(*words: str) -> list[str]:
    """The lines that git prints; CannotTell where it fails."""
    done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        raise CannotTell(f"git {' '.join(words)}: {done.stderr.strip()}")
    return done.stdout.splitlines()


def changed_since(revision: str | None) -> list[str]:
    """Files that changed, including untracked ones; by default since this branch left `MAIN`."""
    if revision is None:
        (revision,) = git("merge-base", MAIN, "HEAD")
        if [revision] == git("rev-parse", "HEAD") and not git("status", "--porcelain"):
            raise CannotTell(f"this is {MAIN}, and nothing is changed")
    # A file that is renamed is one that goes and one that comes.
    return [*git("diff", "--name-only", "--no-renames", revision), *git("ls-files", "--others", "--exclude-standard")]


def module_of(file: str, modules: Modules) -> str:
    """The module that a changed file of the package is."""
    path = Path(file).relative_to("src")
    module = ".".join(path.with_suffix("").parts).removesuffix(".__init__")
    if path.suffix != ".py" or module not in modules.all:
        raise CannotTell(f"{file} is gone, or no module")
    return module


def choose(changed: Iterable[str]) -> list[str]:
    """The test files that these changed files can break. Raises CannotTell."""
    modules, tests = (
        Modules(),
        Tests([file for file in git("ls-files", "-co", "--exclude-standard") if (ROOT / file).is_file()]),
    )
    used = {node: modules.used_by(text) for node, text in tests.texts.items()}
    reached = {file: tests.reached(file) for file in tests.files}
    known = closure(set().union(*(used[node] for nodes in reached.values() for node in nodes)), modules.needs.__getitem__)
    chosen, read, code = set[str](), set[str](), set[str]()
    for file in changed:
        if is_test(file):
            chosen |= {file} & set(tests.files)  # one that is gone breaks none
        elif file.startswith("src/"):
            code.add(module_of(file, modules))
        elif file.split("/")[0] in READ[:-1] or ("/" not in file and file.endswith(".md")):
            read.add(file if "/" in file else "docs/index.md")  # the tests of docs read those at the top as well
        else:
            raise CannotTell(f"any test may need {file}")
    if unknown := code - known:
        raise CannotTell(f"no test reaches {', '.join(sorted(unknown))}")
    affected = modules.affected(code)
    touched = read | {node for node in tests.texts if used[node] & affected}
    if code:
        touched |= {node for node, text in tests.texts.items() if node.startswith("tests/") and text.scans}
    chosen |= {file for file, nodes in reached.items() if nodes & touched}
    return sorted(chosen)


def main(arguments: Sequence[str]) -> None:
    try:
        changed = changed_since(arguments[0] if arguments else None)
        chosen = choose(changed)
    except CannotTell as reason:
        print(f"all tests: {reason}", file=sys.stderr)
        print("tests")
        return
    print(f"{len(changed)} changed files choose {len(chosen)} test files", file=sys.stderr)
    print("\n".join(chosen))


if __name__ == "__main__":
    main(sys.argv[1:])
