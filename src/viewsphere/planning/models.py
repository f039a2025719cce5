"""From a recipe's model entries to one specification a model: files found, keys made, sizes looked up."""

from __future__ import annotations

import hashlib
import math
import os
import re
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from functools import cache
from glob import has_magic
from itertools import chain
from pathlib import Path
from typing import Literal

from viewsphere.assets.load import check_source, needs_blender
from viewsphere.assets.paths.inside import split_source
from viewsphere.assets.readers import reader_of, suffixes
from viewsphere.composing.scene.entries_walked import below, matching, named
from viewsphere.composing.seeds import generator, share
from viewsphere.composing.tables import Cells, table_rows
from viewsphere.errors import ModelError, PluginError, RecipeError, UserError, each
from viewsphere.files import written_path
from viewsphere.limits import limits
from viewsphere.model.fields.file_names import is_reserved
from viewsphere.model.model_spec import ModelSpec, ScaledTo, Size
from viewsphere.plugins import checked
from viewsphere.plugins.source import (
    Named,
    SourceModel,
    SourceSpec,
    from_folder,
    from_set,
    model_for,
    source_of,
    suggested,
)
from viewsphere.printable import printable
from viewsphere.recipe.draws import drawn
from viewsphere.recipe.models import Dimensions, ModelEntry, ScaleEntry, SizeTable, unit_metres
from viewsphere.recipe.recipe import Recipe
from viewsphere.store import Category
from viewsphere.validation.errors import Nearest
from viewsphere.validation.quantity import quantity

LONGEST_KEY = 150
"""Longest key in bytes: names of files, and of folders during writing, add about a hundred bytes to it, and may have 255."""

COLUMNS = ("name", "width", "height", "length")
Sizes = Mapping[str, tuple[float, float, float]]


@dataclass(frozen=True)
class _Found:
    """A model that an entry means: the entry's index, the key it would like, a file's path or a name such as `zoo:car`.

    is_drawn: whether a seed decides which model it is. facts: what its source states about it; None for a file.
    """

    entry: int
    key: str
    source: str
    is_drawn: bool = False
    facts: SourceModel | None = None

    @property
    def is_file(self) -> bool:
        """True if no source supplies it."""
        return self.facts is None


Expanded = tuple[tuple[Named, tuple[SourceModel, ...]], ...]
"""The names of an entry that sources expand, each with its single models."""


class Listing:
    """The models that a recipe's names of sources stand for, each name listed once: for sets of 50,000 models, that takes most
    of the time of a plan.
    """

    def __init__(self, recipe: Recipe) -> None:
        self.recipe = recipe
        self._known: dict[int, Expanded] = {}

    def of(self, index: int) -> Expanded:
        """The names of an entry, each with all of its models; none for an entry of files. Raises RecipeError for an unknown
        name.
        """
        if index not in self._known:
            self._known[index] = tuple(_listed(self.recipe, index))
        return self._known[index]


def count_models(listing: Listing) -> int:
    """Return the number of models, without making their specifications.
    Raises RecipeError for missing files and unknown models of sources, of all entries together.
    """

    recipe = listing.recipe

    def count(index: int) -> int:
        names = _expanded(listing, index)
        if not names:
            return len(_files(recipe, index))
        single = len(_chosen(recipe, index, names))
        return single + sum(_count(recipe, index) for named, _ in names if named.spec.drawn)

    return sum(each(count, (i for i, entry in enumerate(recipe.models) if entry.is_labelled)))


def model_specs(recipe: Recipe) -> tuple[ModelSpec, ...]:
    """One specification a model: entries in the recipe's order, files sorted; keys follow from names only.

    Raises RecipeError as `numbered_specs` does.
    """
    return tuple(spec for spec, _ in numbered_specs(recipe))


def numbered_specs(recipe: Recipe, listing: Listing | None = None) -> tuple[tuple[ModelSpec, int], ...]:
    """The same, each with the number of its entry; `listing` is the recipe's.

    Raises RecipeError for files not found, models that a table of sizes lacks, and categories with two supercategories, each
    kind of all models together; and for two models of one key.
    """
    listing = listing or Listing(recipe)
    models_of_entries = each(lambda i: tuple(_found(listing, i)), range(len(recipe.models)))
    ids = {c.name: c.id for c in categories(recipe, listing)}
    table, hint = cache(_read_sizes), Nearest()

    def numbered(model: _Found) -> tuple[ModelSpec, int]:
        entry = recipe.models[model.entry]
        if model.is_file:
            _check_file(entry, model)
        category, facts = _category(entry, model.facts), model.facts or SourceModel("")
        spec = ModelSpec(
            key=model.key,
            source=model.source,
            seed=int(generator(recipe.lasting_seed, model.source, model.key).integers(2**63)) if model.is_drawn else None,
            category=category,
            supercategory=entry.supercategory,
            category_id=ids[category] if entry.is_labelled else 0,
            up=entry.up or facts.up,
            forward=entry.forward or facts.forward,
            unit=facts.unit if entry.unit is None else unit_metres(entry.unit),
            centring=entry.centring,
            scale=_scale(recipe, entry, model.key),
            real_size=_real_size(recipe, model, table, hint),
            confined=entry.confined,
            sidecar=_sidecar(recipe, model.entry),
            symmetries="found" if entry.symmetries == "found" else None,
            keypoints=entry.keypoints,
            faces="as_file" if entry.faces == "as_file" else None,
            split=facts.split or None,
            color=entry.color,
            material=entry.material,
        )
        return spec, model.entry

    return tuple(each(numbered, _with_unique_keys([*chain.from_iterable(models_of_entries)])))


def files_below(folder: Path) -> Iterator[tuple[str, int, str]]:
    """Of the model files in a folder and those below: a pattern of each folder and suffix, how many files it names, and their
    folder's name in words; those that only Blender reads are among them.
    """
    endings = {f".{suffix}" for suffix in suffixes()}
    files = (file for file in _shown(folder, "new") if file.suffix.lower() in endings and file.is_file())
    groups = Counter((file.parent, file.suffix) for file in files)
    for (parent, suffix), count in sorted(groups.items()):
        pattern = (parent.relative_to(folder) / f"*{suffix}").as_posix()
        yield pattern, count, re.sub(r"[_-]+", " ", parent.absolute().name).strip() or "model"


def _shown(folder: Path, where: str) -> list[Path]:
    """Return all files and folders below a folder that are not hidden."""
    return [file for file in below(folder, where) if not any(map(_is_hidden, file.relative_to(folder).parts))]


def _check_file(entry: ModelEntry, found: _Found) -> None:
    """Check, by its name alone, that a file can be read with the entry's settings.

    Raises RecipeError for a kind of file that is not read and a forward along the file's up axis, MissingExtraError if
    Blender reads such files and is not installed.
    """
    where, path = f"models[{found.entry}]", Path(found.source)
    try:
        suffix = check_source(path)
    except ModelError as error:
        raise RecipeError(f"{where}.source: {error}") from None
    if needs_blender(suffix):
        from viewsphere.blender.interpreter import find_blender

        find_blender()
    reader = reader_of(suffix)
    up = reader.axes[0][1] if reader is not None and reader.axes is not None else None
    if up and entry.up is None and entry.forward is not None and entry.forward[1] == up:
        raise RecipeError(
            f"{where}.forward: {entry.forward} lies along +{up}, which is up in {suffix} files. Set `up:`, too, or another "
            "`forward:`"
        )


def categories(recipe: Recipe, listing: Listing | None = None) -> tuple[Category, ...]:
    """The categories in order of appearance, ids from 1; raises RecipeError for all with two supercategories. `listing` is the
    recipe's.
    """
    listing = listing or Listing(recipe)
    result: dict[str, Category] = {}

    def add(i: int) -> None:
        entry = recipe.models[i]
        for model in _single(listing, i):
            name = _category(entry, model)
            category = result.setdefault(name, Category(len(result) + 1, name, entry.supercategory))
            if category.supercategory != entry.supercategory:
                raise RecipeError(
                    f"models[{i}].supercategory: expected {category.supercategory!r}, as category {name!r} has before; "
                    f"found {entry.supercategory!r}"
                )

    each(add, (i for i, entry in enumerate(recipe.models) if entry.is_labelled))
    return tuple(result.values())


def _expanded(listing: Listing, index: int) -> Expanded:
    """The names of an entry that sources expand, without models that cannot be used; none for an entry of files.
    Raises RecipeError for an unknown name, and for one without any usable model.
    """
    expanded: list[tuple[Named, tuple[SourceModel, ...]]] = []
    for origin, models in listing.of(index):
        usable = tuple(model for model in models if not model.fault)
        if models and not usable:
            raise RecipeError(
                f"models[{index}].source: {origin.prefix}: none of {quantity(len(models), 'model')} can be used. The first, "
                f"{printable(models[0].name)}: {models[0].fault}"
            )
        expanded.append((origin, usable))
    return tuple(expanded)


def _listed(recipe: Recipe, index: int) -> Iterator[tuple[Named, tuple[SourceModel, ...]]]:
    """The names of an entry that sources expand, each with all of its models."""
    for source in recipe.models[index].names:
        named = source_of(from_folder(source, recipe.folder))
        assert named is not None
        try:
            yield named, checked(SourceSpec, named.prefix, "expand", named.spec.expand(named.name), tuple)
        except PluginError:
            raise
        except UserError as error:
            raise RecipeError(f"models[{index}].source: {named.prefix}: {error}") from None


def _chosen(recipe: Recipe, index: int, names: Expanded) -> list[tuple[Named, SourceModel]]:
    """The single models of an entry whose names stand for one model each: all, or as many as its count draws among them."""
    models = [(origin, model) for origin, models in names if not origin.spec.drawn for model in models]
    if recipe.models[index].count is None or not models:
        return models
    count = _count(recipe, index)
    if count > len(models):
        raise RecipeError(f"models[{index}].count: expected at most {len(models):,}, the number of models; found {count:,}")
    order = [share(recipe.lasting_seed, "models", "chosen", model.key or model.name) for _, model in models]
    drawn = sorted(range(len(models)), key=order.__getitem__)[:count]
    return [models[i] for i in sorted(drawn)]


def _single(listing: Listing, index: int) -> Iterator[SourceModel | None]:
    """All single models that an entry may have, as far as its category depends on them; None for those of files."""
    if listing.recipe.models[index].category:
        return iter((None,))
    return (model for _, models in _expanded(listing, index) for model in models)


def _count(recipe: Recipe, index: int) -> int:
    """Return an entry's number of models for each name that they are drawn from; raises RecipeError above the limit."""
    entry, most = recipe.models[index], limits.MAX_MODELS
    names = ("models", "count", entry.name or "", *entry.source)
    count = 1 if entry.count is None else drawn(entry.count, lambda path: generator(recipe.lasting_seed, *names, *path))
    if count > most:
        raise RecipeError(
            f"models[{index}].count: expected at most {most:,} (limit MAX_MODELS); found {count:,}; set VIEWSPHERE_MAX_MODELS "
            "higher if it is meant so"
        )
    return count


def _scale(recipe: Recipe, entry: ModelEntry, key: str) -> Literal["as_is", "real_size"] | float | ScaledTo:
    """Return the scale setting of a model; a length is drawn separately for each model."""
    if not isinstance(entry.scale, ScaleEntry):
        return entry.scale
    measure, metres = entry.scale.goal
    metres = drawn(metres, lambda path: generator(recipe.lasting_seed, "models", "scale", key, *path))
    return metres if measure == "length" else ScaledTo(measure=measure, metres=metres)


def _sidecar(recipe: Recipe, index: int) -> str | None:
    """The path of the sidecar that an entry names; raises RecipeError if there is no such file."""
    name = recipe.models[index].sidecar
    if name is None:
        return None
    path = _path(recipe.folder, name)
    if not path.is_file():
        raise RecipeError(
            f"models[{index}].sidecar: expected a file of symmetries and keypoints; found no {name!r} in {recipe.folder}"
        )
    return Path(os.path.normpath(path)).as_posix()


def _category(entry: ModelEntry, model: SourceModel | None) -> str:
    if entry.category or model is None:
        return entry.category
    return model.category or model.name.replace("_", " ")


def _found(listing: Listing, index: int) -> Iterator[_Found]:
    recipe = listing.recipe
    entry = recipe.models[index]
    prefix = f"{entry.name}_" if entry.name else ""
    names = _expanded(listing, index)
    for origin, model in _chosen(recipe, index, names):
        key = _short(_free(prefix + _as_key(model.key or model.name)))
        yield _Found(index, key, f"{origin.prefix}:{model.name}", facts=model)
    for origin, models in ((origin, models) for origin, models in names if origin.spec.drawn):
        for number in range(_count(recipe, index)):
            key, model = f"{entry.name or _as_key(origin.name)}_{number:03d}", _drawn_model(recipe, models, number)
            yield _Found(index, key, f"{origin.prefix}:{model.name}", is_drawn=True, facts=model)
    if not entry.names:
        for file in _files(recipe, index):
            yield _Found(index, _short(_free(prefix + _as_key(file.stem))), file.as_posix())


def _drawn_model(recipe: Recipe, models: Sequence[SourceModel], number: int) -> SourceModel:
    """A drawn model: each name in turn before one comes again, every round in an order of its own."""
    turn, place = divmod(number, len(models))
    return sorted(models, key=lambda model: share(recipe.lasting_seed, "family", str(turn), model.name))[place]


def _as_key(text: str) -> str:
    """The text as a part of a folder's name: letters, digits, `_`, `-` and inner dots."""
    return re.sub(r"[^\w.-]", "_", text).strip(".") or "model"


def _free(key: str) -> str:
    """The key, with `_` behind it where Windows would take it for a device's name."""
    return f"{key}_" if is_reserved(key) else key


def _short(key: str) -> str:
    """The key, or its beginning and a digest of the whole key if it is too long for file systems (255 bytes)."""
    data = key.encode()
    if len(data) <= LONGEST_KEY:
        return key
    return f"{data[: LONGEST_KEY - 13].decode(errors='ignore')}-{hashlib.sha256(data).hexdigest()[:12]}"


def _files(recipe: Recipe, index: int) -> tuple[Path, ...]:
    """Return the files of an entry, sorted, each once; raises RecipeError for a source without any, or not `count` of them."""
    entry, where = recipe.models[index], f"models[{index}]"
    files = {file for source in entry.source for file in _matching(recipe.folder, source, where)}
    if entry.count is not None and entry.count != len(files):
        raise RecipeError(f"{where}.count: expected {entry.count} model files; found {len(files)}")
    return tuple(sorted(files, key=lambda f: f.as_posix()))


def unusable(listing: Listing) -> Iterator[str]:
    """A warning for each name of a source with models that cannot be used."""
    for i in range(len(listing.recipe.models)):
        for origin, models in listing.of(i):
            if faulty := [model for model in models if model.fault]:
                first = printable(faulty[0].key or faulty[0].name)
                yield (
                    f"models[{i}].source: {origin.prefix}: {quantity(len(faulty), 'model')} of {len(models):,} left out, e.g. "
                    f"{first}: {faulty[0].fault}"
                )


def left_out(recipe: Recipe) -> Iterator[str]:
    """A warning for each entry whose folders and patterns hold files that only Blender reads, and that no entry names."""
    taken = cache(lambda: {file for i, entry in enumerate(recipe.models) if not entry.names for file in _files(recipe, i)})
    for i, entry in enumerate(recipe.models):
        sources = () if entry.names else entry.source
        unread = {f for source in sources for f in _unread(recipe.folder, source, f"models[{i}]")}
        if unread and (unread := unread - taken()):
            yield f"models[{i}].source: {_naming(recipe.folder, unread)}"


def _matching(folder: Path, source: str, where: str) -> list[Path]:
    path = _path(folder, source)
    candidates = _candidates(folder, source, where)
    if candidates == [path]:
        matches = candidates
    else:
        wanted = _wanted(path)
        matches = [f for f in candidates if f.suffix.lower() in wanted and f.is_file()]
    if not matches:
        endings, unread = ", ".join(sorted(_read_here())), _unread(folder, source, where)
        hint = f"; {_naming(folder, unread)}" if unread else ""
        raise RecipeError(f"{where}.source: expected model files ({endings}); {source!r} gives none in {folder}{hint}")
    return [named(_normal(f), f"{where}.source") for f in matches]


def _normal(path: Path) -> Path:
    """Return the path without `..`; the same object if it has none, as most of many thousands."""
    return Path(os.path.normpath(path)) if ".." in path.parts else path


def _unread(folder: Path, source: str, where: str) -> set[Path]:
    """Files that only Blender reads, which a folder or a pattern means but leaves out."""
    path = _path(folder, source)
    if has_magic(source) and path.suffix.lower() in _read_here():
        return set()  # every file that such a pattern means ends as it does
    candidates = _candidates(folder, source, where)
    if candidates == [path]:
        return set()
    others = {f".{suffix}" for suffix in suffixes(by_blender=True)} - _wanted(path)
    return {_normal(f) for f in candidates if f.suffix.lower() in others and f.is_file()}


def _naming(folder: Path, unread: Collection[Path]) -> str:
    """Return the number of omitted files in words, with a pattern that a recipe in this folder can use for some of them."""
    first = min(unread, key=lambda f: f.as_posix())
    parent = first.parent.relative_to(folder) if first.is_relative_to(folder) else first.parent
    many = "1 file that Blender reads" if len(unread) == 1 else f"{len(unread):,} files that Blender reads"
    it = "it" if len(unread) == 1 else "them"
    return f"{many} left out: name {it}, e.g. {(parent / f'*{first.suffix}').as_posix()}"


def _path(folder: Path, source: str) -> Path:
    return folder / written_path(source)


def _candidates(folder: Path, source: str, where: str) -> list[Path]:
    """The file, or all files and folders that a folder or a pattern means; raises RecipeError for a path without anything."""
    path = _path(folder, source)
    if split_source(path)[0].is_file():
        return [path]
    if path.is_dir():
        return _shown(path, where)
    if has_magic(source):
        return matching(folder, source, where)
    example = model_for("example", otherwise="")
    kinds = "a file, folder, pattern or a source's model" + (f", such as {example}" if example else "")
    raise RecipeError(f"{where}.source: expected {kinds}; found no {source!r} in {folder}{suggested(source)}")


def _wanted(path: Path) -> Set[str]:
    """Endings of the files that a folder or a pattern means."""
    ending = path.suffix.lower()
    reader = reader_of(ending[1:])
    return {ending} if reader is not None and (reader.by_blender or reader.joins_files) else _read_here()


def _read_here() -> Set[str]:
    """Endings of the files of single models that are read without Blender: USD too where its package is installed."""
    return {f".{suffix}" for suffix in suffixes(by_blender=False)}


def _is_hidden(name: str) -> bool:
    return name.startswith((".", "__MACOSX"))


def _with_unique_keys(found: list[_Found]) -> list[_Found]:
    """Files of one name get their ending or their folders' names behind it; raises RecipeError if that is no help."""
    groups: defaultdict[str, list[_Found]] = defaultdict(list)
    for item in found:
        groups[item.key.casefold()].append(item)
    keys = {item: key for group in groups.values() for item, key in zip(group, _longer_keys(group), strict=True)}
    renamed = [replace(item, key=keys[item]) for item in found]
    first: dict[str, _Found] = {}
    for item in renamed:
        other = first.setdefault(item.key.casefold(), item)
        if other is not item:
            raise RecipeError(
                f"models[{item.entry}]: expected every model once; found key {item.key!r} again ({item.source}), after "
                f"models[{other.entry}] ({other.source}): give one of the entries another name"
            )
    return renamed


def _longer_keys(group: Sequence[_Found]) -> list[str]:
    """Return the keys of all models that would like the same one, in their order: files, and models in folders of sets."""
    keys = [item.key for item in group]
    if len(group) == 1 or not all(item.is_file or from_set(item.source) for item in group):
        return keys
    paths = [Path(item.source if item.is_file else item.source.partition(":")[2]) for item in group]
    for folders in range(max(len(path.parts) for path in paths)):
        for ending in (False, True):
            variants = [_variant(key, path, folders, ending=ending) for key, path in zip(keys, paths, strict=True)]
            if len({v.casefold() for v in variants}) == len(group):
                return variants
    if len(set(paths)) < len(group):
        return keys
    return [_numbered(key, sorted(paths).index(path)) for key, path in zip(keys, paths, strict=True)]


def _numbered(key: str, place: int) -> str:
    """The key of one of several files whose names differ in capitals only: as it is for the first, then with `-2`, `-3`, ..."""
    return key if place == 0 else _short(f"{key}-{place + 1}")


def _variant(key: str, path: Path, folders: int, *, ending: bool) -> str:
    names = path.parts[-1 - folders : -1]
    return _short("-".join([key, *map(_as_key, names), *([path.suffix[1:]] if ending and path.suffix[1:] else [])]))


def _real_size(recipe: Recipe, found: _Found, table: Callable[[Path], Sizes], hint: Nearest) -> Size | Literal["file"] | None:
    size = recipe.models[found.entry].real_size
    if isinstance(size, Dimensions):
        return size.width, size.height, size.length
    if size == "file" or (size is None and found.facts is not None and found.facts.is_metric):
        return "file"
    if size is None:
        return None
    path, unit = (size.csv, unit_metres(size.unit)) if isinstance(size, SizeTable) else (size, 1.0)
    sizes = table(recipe.folder / path)
    name = Path(found.source).stem if found.is_file else found.key
    row = sizes.get(name) or sizes.get(found.key)
    if row is None:
        raise RecipeError(
            f"models[{found.entry}].real_size: expected a row for {name!r} in {recipe.folder / path}; found none"
            f"{hint(name, sizes)}"
        )
    width, height, length = (value * unit for value in row)
    return width, height, length


def _read_sizes(path: Path) -> Sizes:
    """Rows of a table of sizes by name; raises RecipeError naming file and line."""
    sizes: dict[str, tuple[float, float, float]] = {}
    for where, row in table_rows(path, COLUMNS):
        name = (row["name"] or "").strip()
        if not name or name in sizes:
            raise RecipeError(f"{where}: expected every name once; found {name!r}")
        sizes[name] = _row_size(row, where)
    return sizes


def _row_size(row: Cells, where: str) -> tuple[float, float, float]:
    values: list[float] = []
    for column in COLUMNS[1:]:
        try:
            value = float(row[column] or "")
        except ValueError:
            value = math.nan
        if not (0 < value < math.inf):
            raise RecipeError(f"{where}: {column}: expected a number above 0; found {row[column]!r}")
        values.append(value)
    width, height, length = values
    return width, height, length
