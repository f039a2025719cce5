"""The documentation: pages and pictures that are made from the code, and the site made of all pages.

scripts/docs                 # generate: write what is generated; with --check only report differences
scripts/docs build           # the site, into site/; a warning is an error, and so is a link that leads nowhere
scripts/docs serve           # the site at http://localhost:8000, built again whenever a page changes
"""

from __future__ import annotations

import argparse
import inspect
import json
import re
import subprocess
import sys
from collections.abc import Collection, Mapping
from enum import Enum
from functools import partial
from pathlib import Path
from typing import Any, cast, get_args

import numpy as np
import site_links
from figures import FIGURES, HISTORY
from lens_pages import lens_page
from typer.models import ArgumentInfo

from viewsphere import plugins
from viewsphere.assets import readers as model_readers
from viewsphere.cli.commands import app
from viewsphere.labels import (
    ChannelLabel,
    Field,
    LabelSpec,
    ObjectLabel,
    SampleLabel,
    channels,
    labels,
    object_labels,
    on_request,
)
from viewsphere.limits import table
from viewsphere.model.channel import FINISHED, PASSES
from viewsphere.plugins.effect import EffectSpec
from viewsphere.plugins.engine import EngineSpec
from viewsphere.plugins.format import FormatSpec
from viewsphere.plugins.material import MaterialSpec
from viewsphere.plugins.source import sources
from viewsphere.recipe.recipe import schema
from viewsphere.run.reports.format_list import Listed, listed
from viewsphere.run.reports.plugin_list import SPECS

DOCS = Path(__file__).parent.parent / "docs"
NOTE = "<!-- written by scripts/docs; do not edit -->\n\n"


def cli_page() -> str:
    text = NOTE + "# Command line\n\n"
    text += "Exit status: 0 success, 1 a data set failed its check, 2 an error that you can correct, "
    text += "3 an unfinished data set (`status`) or a dead worker, 130 stopped with Ctrl-C or SIGTERM.\n"
    for command in app.registered_commands:
        function = command.callback
        assert function is not None
        rows = [row(p) for p in inspect.signature(function, eval_str=True).parameters.values()]
        arguments = [name for name, _ in rows if not name.startswith("-")]
        usage = " ".join(["viewsphere", command.name or function.__name__, *arguments])
        options = " [OPTIONS]" if len(rows) > len(arguments) else ""
        text += f"\n## {function.__name__}\n\n{inspect.getdoc(function)}\n\n```\n{usage}{options}\n```\n"
        if rows:
            cells = "".join(f"| {', '.join(f'`{n}`' for n in name.split())} | {help_} |\n" for name, help_ in rows)
            text += f"\n| | |\n|---|---|\n{cells}"
    return text + "\n## Options of formats\n" + format_options()


def format_options() -> str:
    """All options of all formats, as `--format-option` sets them."""
    told = {name: spec.options for name, spec in plugins.loadable(FormatSpec).items()}
    fields = {f"{name}.{field}": spec for name, kind in told.items() if kind for field, spec in properties(kind).items()}
    return fields_table({"": {"properties": fields}}, ["="])


def properties(kind: Any) -> dict[str, Any]:
    return kind.model_json_schema()["properties"]


def row(parameter: inspect.Parameter) -> tuple[str, str]:
    """Names and meaning of one argument or option."""
    kind, info = get_args(parameter.annotation)[:2]
    plain = parameter.name.strip("_").replace("_", "-")
    if isinstance(info, ArgumentInfo):
        return plain.upper(), info.help or ""
    words = (info.default, *(info.param_decls or ()))  # in Annotated, typer keeps the first name as the default
    declared = [word for word in words if isinstance(word, str) and word.startswith("-")]
    names = " ".join(declared or ([f"--{plain}", f"--no-{plain}"] if kind is bool else [f"--{plain}"]))
    return names, f"{info.help}{choices(kind)}{default(parameter.default)}"


def choices(kind: Any) -> str:
    """The values of the enumeration in a type, such as an optional or a list; empty for a type without one."""
    if inspect.isclass(kind) and issubclass(kind, Enum):
        return f" One of {', '.join(member.value for member in kind)}."
    return "".join(choices(inner) for inner in get_args(kind))


def default(value: Any) -> str:
    if value is inspect.Parameter.empty:
        return " Required."
    return "" if value in (None, False) else f" Default: {value}."


def channels_page() -> str:
    text = NOTE + (
        "# Channels and annotations\n\nChoose the channels of each frame with your recipe's `channels`. Arrays have the "
        "image's height and width; components come last. The table has the default files, which are lossless. Set `files` in "
        "your recipe to change them ([formats.md](formats.md#files)). Engines render the channels up to `metallic` "
        "([pictures.md](pictures.md#light-in-parts)); each of the others is one file in `src/viewsphere/labels/`.\n\n"
        "| channel | type | components | unit | empty | file | meaning |\n|---|---|---|---|---|---|---|\n"
    )
    for c in channels().values():
        file = {"png": "PNG", "png16": "16-bit PNG", "tiff": "TIFF", "npz": "NPZ"}[c.encoding]
        of_what = "rows" if c.components == 0 else np.dtype(c.dtype)
        text += f"| `{c.name}` | {of_what} | {c.components or ''} | {c.unit} | {c.empty:g} | {file} | {c.meaning} |\n"
    text += (
        "\n## Annotations\n\nEvery object of a frame, visible or not, has these fields, in every data set. The store keeps "
        "only values that do not follow from the shot and its models.\n\n"
        "| field | type | unit | axes | meaning |\n|---|---|---|---|---|\n"
    )
    for label in object_labels():
        if not label.on_request:
            text += "".join(f"| {field_row(label, f)}" for f in label.fields)
    text += (
        "\n## Annotations on request\n\nRequest these with your recipe's `annotations`: `annotations: [amodal, occluders]`. "
        "Other labels cost nothing. Labels marked * follow from data that every data set has, so you can always read them as "
        "attributes of its objects. Each is one file in `src/viewsphere/labels/`.\n\n"
        "| label | of | field | type | unit | axes | meaning |\n|---|---|---|---|---|---|---|\n"
    )
    for name, label in on_request().items():
        follows = "*" if isinstance(label, ObjectLabel) and label.follows else ""
        of = "objects" if isinstance(label, ObjectLabel) else "pictures"
        text += "".join(f"| `{name}`{follows} | {of} | {field_row(label, f)}" for f in label.fields)
    return text


def field_row(label: ObjectLabel | SampleLabel, field: Field) -> str:
    """The end of a table's row on a field of a label."""
    axes = field.axes or label.axes
    return f"`{field.name}` | {field_type(field)} | {field.unit} | {axes} | {field.meaning} |\n"


def proofs_page() -> str:
    """Each label and pass with what proves it; stops where figures or pictures are not those of the labels that there are."""
    rows = {name: unit_of(label) for name, label in labels().items()}
    rows |= {name: channel.unit for name, channel in PASSES.items() if name not in FINISHED}
    proofs, costs = (json.loads((DOCS / "labels.json").read_text("utf-8"))[name] for name in ("proofs", "costs"))
    pictures = {path.stem for path in (DOCS / LABEL_PICTURES).glob("*.jpg")}
    tests = {proof["test"] for found in proofs.values() for proof in found}
    agree("labels.json: proofs", proofs.keys(), rows.keys())
    agree("labels.json: costs", costs.keys() - {"Embree", "truth: raster"}, labels().keys())
    agree(LABEL_PICTURES, pictures, rows.keys())
    agree("labels.json: tests", tests, {test for test in tests if (DOCS.parent / test).is_file()})
    text = NOTE + PROOFS.format(costs["Embree"], costs["truth: raster"])
    for name, unit in rows.items():
        engines = "all" if name in labels() else ", ".join(e for e in plugins.names("engines") if name in painted(e))
        found = "<br>".join(f"{error_of(proof)}: {proof['against']}" for proof in proofs[name])
        files = "<br>".join(dict.fromkeys(f"`{proof['test'].removeprefix('tests/')}`" for proof in proofs[name]))
        picture = f"![{name}]({LABEL_PICTURES}/{name}.jpg)"
        cost = f"{costs[name]:g}" if name in costs else ""
        text += f"| `{name}` | {picture} | {engines} | {unit} | {found} | {files} | {cost} |\n"
    return text


LABEL_PICTURES = "images/labels"
PROOFS = """# Proofs of labels

Tests compare each label with an independent computation. The table has the largest difference (`benchmarks/measure_labels`); a
difference without a unit is a share or a count. `viewsphere check` also recomputes every label of a data set from the exported
models, and casts Embree's rays at them. Labels are the same, byte for byte, on all engines. Passes are outputs of engines;
their errors are raster's.

Costs are CPU milliseconds at 640x480 with 20 objects. One of Embree's rays through each pixel takes {:g}; finding each pixel's
surface, which all labels share, takes {:g}. Meanings and axes are in [channels and annotations](channels.md).

| label | picture | engines | unit | largest error | compared in | CPU ms |
|---|---|---|---|---|---|---|
"""


def lenses_page() -> str:
    """Every label of every lens; stops where figures are those of other lenses or formats."""
    return NOTE + lens_page(json.loads((DOCS / "lenses.json").read_text("utf-8")), agree)


def unit_of(label: LabelSpec) -> str:
    """The unit of a label, or those of its fields, each once."""
    units = [label.unit] if isinstance(label, ChannelLabel) else [field.unit for field in getattr(label, "fields", ())]
    return ", ".join(dict.fromkeys(filter(None, units)))


def painted(engine: str) -> tuple[str, ...]:
    return plugins.load(EngineSpec, engine).paints


def error_of(proof: dict[str, Any]) -> str:
    return f"{proof['error']:g} {proof['unit'].removeprefix('1')}".rstrip()


def agree(what: str, found: Collection[str], wanted: Collection[str]) -> None:
    """Stop where something is missing, or is there and should not be."""
    for problem, names in (("lacks", {*wanted} - {*found}), ("has no use for", {*found} - {*wanted})):
        if names:
            script = "measure_lenses" if what.startswith("lenses") else "measure_labels (and --pictures)"
            sys.exit(f"docs/{what} {problem} {', '.join(sorted(names))}: run benchmarks/{script}")


OPTIONS = re.compile(r"(<!-- options of (\w+), written by scripts/docs -->\n).*?(?=\n<!-- end -->)", re.DOTALL)


def options_page(plugin: plugins.Kind, page: str) -> str:
    """The hand-written page with a table of each kind's options."""
    return OPTIONS.sub(lambda found: found[1] + options_table(plugin, found[2]), (DOCS / page).read_text("utf-8"))


def options_table(plugin: plugins.Kind, kind: str) -> str:
    """The options of a plug-in, and of what it has lists of."""
    spec = {spec.KIND: spec for spec in SPECS}[plugin]
    made: Any = plugins.load(spec, kind)
    told = made.options.model_json_schema()
    parts = {name: part for name, part in told.get("$defs", {}).items() if name not in ("Distribution", "Gaussian")}
    text = fields_table({kind: told}, [kind])
    return text + "".join(f"\nEach {name.lower()}:\n{fields_table(parts, [name])}" for name in parts)


PLUGINS = """# Specs of plug-ins

[Extending viewsphere](extending.md) shows a plug-in of each kind. This page lists the fields of the specs.
A plug-in is one module, named by an entry point of its group, that holds its spec under the name below.
"""


def plugins_page() -> str:
    """The fields of all specs."""
    text = NOTE + PLUGINS
    of_labels = (ChannelLabel, ObjectLabel, SampleLabel)
    for spec in (one for kind in SPECS for one in (of_labels if kind is LabelSpec else (kind,))):
        text += f"\n## {spec.__name__}\n\n{inspect.getdoc(spec)}\n\n"
        several = f", or several in `{constant}`" if (constant := plugins.SEAMS[spec.KIND].several) else ""
        text += f"Entry points `viewsphere.{spec.KIND}`; the module holds `{plugins.SEAMS[spec.KIND].constant}`{several}.\n"
        text += "\n| field | default | meaning |\n|---|---|---|\n"
        for name, field in spec.model_fields.items():
            text += f"| `{name}` | {'needed' if field.is_required() else value(field.default)} | {field.description} |\n"
    return text


KINDS = re.compile(r"(<!-- kinds of model files, written by scripts/docs -->\n).*?(?=\n<!-- end -->)", re.DOTALL)


def model_files_page() -> str:
    """The hand-written page with a table of what each reader reads."""
    rows = "".join(
        f"| {reader.about} | {', '.join(reader.axes) if reader.axes else 'from the file'} | {reader.unit} |\n"
        for name, reader in sorted(model_readers.readers().items(), key=lambda item: item[1].about.lower())
        if not plugins.is_third_party("readers", name)
    )
    table = "\n| Kind | Up, front | Unit |\n|---|---|---|\n" + rows
    return KINDS.sub(lambda found: found[1] + table, (DOCS / "formats-in.md").read_text("utf-8"))


SETS = re.compile(r"(<!-- sets of models, written by scripts/docs -->\n).*?(?=\n<!-- end -->)", re.DOTALL)


def asset_sets_page() -> str:
    """The hand-written page with a table of the sets that sources read."""
    text = "\n| Source | Set and layout | Category | Axes and unit | Licence | Tried on |\n|---|---|---|---|---|---|\n"
    for name, source in sorted(sources().items()):
        if (found := source.folder) is not None and not plugins.is_third_party("sources", name):
            what = f"{found.title}: `{found.layout}`"
            row = (f"`{name}:`", what, found.category, found.axes, found.licence, found.tried)
            text += f"| {' | '.join(row)} |\n"
    return SETS.sub(lambda found: found[1] + text, (DOCS / "asset-sets.md").read_text("utf-8"))


FIELDS = re.compile(r"(<!-- fields of (.+?), written by scripts/docs -->\n).*?(?=\n<!-- end -->)", re.DOTALL)


EFFECTS = re.compile(r"(<!-- effects, written by scripts/docs -->\n).*?(?=\n<!-- end -->)", re.DOTALL)


def recipe_page() -> str:
    """The hand-written page with its tables of fields as the schema has them, and the table of effects."""
    entries = schema()["$defs"]
    page = FIELDS.sub(
        lambda found: found[1] + fields_table(entries, found[2].split(", ")), (DOCS / "recipe.md").read_text("utf-8")
    )
    return EFFECTS.sub(lambda found: found[1] + effects_table(), page)


def effects_table() -> str:
    """The effects of viewsphere in the order of the light path."""
    found = sorted((plugins.load(EffectSpec, name) for name in plugins.shipped("effects")), key=lambda spec: spec.place)
    rows = (f"| `{spec.name}` | {spec.stage} | {spec.strongest} |\n" for spec in found)
    return "\n| effect | stage | at strength 1 |\n|---|---|---|\n" + "".join(rows)


def fields_table(entries: dict[str, Any], named: list[str]) -> str:
    """Fields of one entry, or of several: `point=PointEntry, spot=SpotEntry`; a field of only some entries names them."""
    kinds = {name: entries[entry or name] for name, _, entry in (one.partition("=") for one in named)}
    rows: dict[tuple[str, str, str], list[str]] = {}
    for kind, entry in kinds.items():
        for name, field in entry["properties"].items():
            first = "needed" if name in entry.get("required", ()) else value(field.get("default"))
            rows.setdefault((name, first, field["description"]), []).append(kind)
    text = "\n| field | default | meaning |\n|---|---|---|\n"
    for (name, first, meaning), of in rows.items():
        text += f"| `{name}` | {first} | {'' if len(of) == len(kinds) else ', '.join(of) + ': '}{meaning} |\n"
    return text


def value(default: Any) -> str:
    """A default as a recipe would write it; empty without a default, and for a function."""
    if isinstance(default, (list, tuple)):
        return f"[{', '.join(map(value, default))}]"
    if isinstance(default, str):
        return f"`{default}`" if default else ""
    if isinstance(default, Mapping):
        return ", ".join(map(str, cast(Mapping[object, object], default)))
    if default is None or callable(default):
        return ""
    return str(default).lower() if isinstance(default, bool) else f"{default:g}"


def field_type(field: Field) -> str:
    """A field's type in words."""
    names = {str: "text", int: "number", float: "float64" if field.is_array else "number", bool: "bool"}
    kind = names.get(field.type, f"`{field.type.__name__}`")
    sizes = ", ".join("N" if size < 0 else str(size) for size in field.shape)
    shape = f" {sizes if len(field.shape) == 1 else f'({sizes})'}" if field.shape else ""
    return ("tuple of " if field.many else "") + f"{kind}{shape}" + (" or None" if field.optional else "")


def limits_page() -> str:
    """All limits and their defaults."""
    text = NOTE + (
        "# Limits\n\nFiles are limited in memory, time and number, which protects you from bad files. An error gives the "
        "limit's name, its value and the file's value. Set the environment variable `VIEWSPHERE_<name>` to change a limit, "
        "such as `VIEWSPHERE_MAX_TRIANGLES=50000000`. Your recipe itself limits its frames (`max_frames`).\n\n"
        "| Limit | Default | Meaning |\n|---|---|---|\n"
    )
    return text + "".join(f"| `{name}` | {limit.default:,} | {limit.meaning} |\n" for name, limit in table().items())


FORMAT_LIST = """# All formats

This page helps you choose a format and shows how exactly programs read it back. `viewsphere formats` prints the same list.

- `viewsphere export` computes labels that a format needs and your data set lacks. Passes, such as `rgb`, have to be in the data
  set.
- *Reader* is a program that reads the written files in the tests, with its version. *Own reader* is a small one that follows
  the format's documentation; the author of a *second reader* had not seen the writer.
- *Worst error* is the largest difference from the data set's own labels, for each unit. A number without a unit is a share or a
  count. *Rounding* is below 1e-9 in every unit. A larger error comes from the digits or the contents that a format has.
- *Evidence* below each format has all comparisons. Empty cells: the tests of this format record no figures.

| format | description | holds | reader | worst error |
|---|---|---|---|---|
"""
NAMED = {"PIL": "Pillow", "cv2.FileStorage": "OpenCV", "NumPy": "numpy"}
"""Programs that tests call by several names."""
UNITS = ("m", "cm", "mm", "px", "deg", "rad", "m/s", "s", "cells", "diagonals", "")
"""In the order of a cell; others have no unit."""
ROUNDING = 1e-9
"""Differences of float64 arithmetic are below it, those of text with few digits above: see docs/formats.json."""


def formats_page() -> str:
    """A table of all formats, then a section for each: its description, its options, and what tests compared."""
    proofs = json.loads((DOCS / "formats.json").read_text("utf-8"))
    described = set(re.findall(r"^## (\w+)$", (DOCS / "formats.md").read_text("utf-8"), re.MULTILINE))
    versioned = {reader_of(proof)[0] for found in proofs.values() for proof in found if "version" in proof} - {"tests"}
    packages = {program(reader) for reader in versioned if ", " not in reader}
    text = NOTE + FORMAT_LIST
    for one in listed():
        found = proofs.get(one.name, [])
        read = ", ".join(readers(found, packages, one.read_by)) or "own reader" * bool(found)
        text += (
            f"| [`{one.name}`](#{one.name}) | {sentence(one.summary)} | {', '.join(one.holds)} | {read} | {worst(found)} |\n"
        )
    return text + "".join(format_section(one, proofs.get(one.name, []), one.name in described) for one in listed())


def format_section(one: Listed, found: list[dict[str, Any]], is_described: bool) -> str:
    """The description of a format, or a link to it, and its folded evidence."""
    text = f"\n## {one.name}\n\n"
    if one.needs:
        text += f"Needs {', '.join(f'`{name}`' for name in one.needs)}. "
    if one.read_by:
        text += f"Written for {', '.join(one.read_by)}."
    text = f"{text.rstrip()}\n\n"
    if is_described:
        text += f"{sentence(one.summary)} [Files and options](formats.md#{one.name}).\n"
    else:
        text += f"{as_page(inspect.cleandoc(plugins.load(FormatSpec, one.name).about or ''))}\n"
        text += options_table("formats", one.name) if one.options else ""
    return text + (evidence(found) if found else "")


def evidence(found: list[dict[str, Any]]) -> str:
    """A folded list of all comparisons, those of one reader in one item."""
    read: dict[str, dict[str, list[str]]] = {}
    for proof in found:
        reader, what = reader_of(proof)
        by = f"{reader} {proof.get('version', '')}".rstrip()
        error = error_of(proof) if proof["error"] else "equal"
        read.setdefault(by, {}).setdefault(error, []).append(what)
    text = '\n<details markdown="1"><summary>Evidence</summary>\n\n'
    for by, errors in read.items():
        parts = (f"{', '.join(dict.fromkeys(what))} {error}" for error, what in errors.items())
        text += f"- *{by}*: {'; '.join(parts)}\n"
    tests = dict.fromkeys(proof["test"].removeprefix("tests/") for proof in found)
    return f"{text}\nTests: {', '.join(f'`{test}`' for test in tests)}.\n\n</details>\n"


def reader_of(proof: dict[str, Any]) -> tuple[str, str]:
    """The reader of an export in a test, and the values that the test compares."""
    reader, is_named, what = proof["against"].partition(": ")
    return (reader, what) if is_named else ("tests", reader)


def readers(found: list[dict[str, Any]], packages: Collection[str], read_by: Collection[str]) -> list[str]:
    """The programs among the readers, each once, with the version where it is installed as a package."""
    read: dict[str, str] = {}
    for proof in found:
        parts = reader_of(proof)[0].split(", ")
        for name in map(program, parts):
            if name in packages and "version" in proof:
                read[name] = proof["version"]
            elif len(parts) == 1 and name in read_by:  # elsewhere a layout's name, beside the program that reads it
                read.setdefault(name, "")
    return [f"{name} {version}".rstrip() for name, version in sorted(read.items(), key=lambda one: one[0].lower())]


def program(reader: str) -> str:
    """The name of a program without the part of it that reads."""
    name = reader.partition(" ")[0]
    return NAMED.get(name, name)


def worst(found: list[dict[str, Any]]) -> str:
    """The largest difference in each unit; empty where nothing was compared."""
    largest: dict[str, float] = {}
    for proof in found:
        unit = {"degrees": "deg"}.get(proof["unit"], proof["unit"])
        unit = unit if unit in UNITS else ""
        largest[unit] = max(largest.get(unit, 0.0), proof["error"])
    visible = [f"{largest[unit]:.2g} {unit}".rstrip() for unit in UNITS if largest.get(unit, 0.0) >= ROUNDING]
    return ", ".join(visible) or ("rounding" if any(largest.values()) else "equal") * bool(found)


def sentence(summary: str) -> str:
    """A summary without addresses in brackets, and without what follows a semicolon, or a colon behind more than a name."""
    first = re.sub(r" \(https?:[^)]*\)", "", summary).partition("; ")[0]
    short, _, _ = first.partition(": ")
    return (short if len(short.split()) > 2 else first).rstrip(".") + "."


def as_page(told: str) -> str:
    """A docstring as Markdown: angle brackets outside of code are text."""
    lines = (line if line.startswith("    ") else escaped(line) for line in told.splitlines())
    return "\n".join(lines)


def escaped(line: str) -> str:
    parts = line.split("`")
    return "`".join(part if i % 2 else part.replace("<", "&lt;") for i, part in enumerate(parts))


MATERIALS = re.compile(r"(<!-- materials, written by scripts/docs -->\n).*?(?=\n<!-- end -->)", re.DOTALL)


def materials_page() -> str:
    """The hand-written page with a table of all materials, as they are unless drawn."""
    heads = ("material", "meaning", "in captions", "repeats after, m", "mean linear colour", "roughness", "draws")
    text = f"\n| {' | '.join(heads)} |\n{'|---' * len(heads)}|\n"
    for name in plugins.names("materials"):
        spec = plugins.load(MaterialSpec, name)
        made, (told, *_) = spec.surface(None, 256), (inspect.getdoc(inspect.getmodule(spec.surface)) or "").splitlines()
        color = " ".join(f"{share:.2f}" for share in made.color.mean(axis=(0, 1)).tolist())
        draws, _, _ = (inspect.getdoc(spec.draw) or "").partition("\n")
        row = (
            f"`{name}`",
            told.rstrip("."),
            spec.word,
            f"{made.metres:g}",
            color,
            f"{made.roughness.mean():.2f}",
            draws.rstrip("."),
        )
        text += f"| {' | '.join(row)} |\n"
    return MATERIALS.sub(lambda found: found[1] + text, (DOCS / "materials.md").read_text("utf-8"))


RELEASES = re.compile(r"(<!-- releases, written by scripts/docs -->\n).*?(?=\n<!-- end -->)", re.DOTALL)
FIGURES_OF_RELEASES = {
    "frame": ("frame, of Embree", ".2f"),
    "smooth_frame": ("frame with 4x edges, of Embree", ".2f"),
    "plan_s": ("`plan`, CPU-s", ".2f"),
    "picture_s": ("`render` of one picture, CPU-s", ".2f"),
}


def performance_page() -> str:
    """The hand-written page with a table of all releases."""
    heads = ("version", "date", *(head for head, _ in FIGURES_OF_RELEASES.values()))
    text = f"\n| {' | '.join(heads)} |\n|---|---|{'---:|' * len(FIGURES_OF_RELEASES)}\n"
    for release in json.loads(HISTORY.read_text("utf-8")):
        cells = (format(release[n], form) if n in release else "not measured" for n, (_, form) in FIGURES_OF_RELEASES.items())
        text += f"| {release['version']} | {release['date']} | {' | '.join(cells)} |\n"
    return RELEASES.sub(lambda found: found[1] + text, (DOCS / "performance.md").read_text("utf-8"))


PAGES = {
    "performance.md": performance_page,
    "materials.md": materials_page,
    "limits.md": limits_page,
    "format-list.md": formats_page,
    "cli.md": cli_page,
    "channels.md": channels_page,
    "plugins.md": plugins_page,
    "proofs.md": proofs_page,
    "lens-proofs.md": lenses_page,
    "formats.md": partial(options_page, "formats", "formats.md"),
    "formats-in.md": model_files_page,
    "asset-sets.md": asset_sets_page,
    "motion.md": partial(options_page, "motions", "motion.md"),
    "layouts.md": partial(options_page, "placers", "layouts.md"),
    "recipe.md": recipe_page,
    "recipe.schema.json": lambda: (
        json.dumps(schema(channels=tuple(channels()), annotations=tuple(on_request())), indent=1) + "\n"
    ),
    **FIGURES,
}


def generate(check: bool) -> None:
    stale = [name for name, make in PAGES.items() if not (DOCS / name).exists() or (DOCS / name).read_text("utf-8") != make()]
    if check:
        if stale:
            sys.exit(f"docs/{', docs/'.join(stale)}: expected what the code says, found something else: run scripts/docs")
        return
    for name in stale:
        (DOCS / name).write_text(PAGES[name](), "utf-8")
        print(f"wrote docs/{name}")


def zensical(*words: str) -> None:
    """Run the generator of the site; its own errors are enough."""
    program = Path(sys.executable).with_name("zensical")
    status = subprocess.run([program, *words, "--config-file", DOCS.parent / "mkdocs.yml"]).returncode
    if status:
        sys.exit(status)


def build() -> None:
    zensical("build", "--clean", "--strict")
    broken = list(site_links.broken(DOCS.parent / "site"))
    if broken:
        sys.exit("\n".join(broken))


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("do", nargs="?", choices=["generate", "build", "serve"], default="generate")
    options.add_argument("--check", action="store_true", help="write nothing")
    told = options.parse_args()
    if told.do == "generate":
        generate(told.check)
    elif told.do == "build":
        build()
    else:
        zensical("serve")


if __name__ == "__main__":
    main()
