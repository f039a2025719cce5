"""Measures the language of the pages, messages and docstrings against the limits in scripts/language.json.

scripts/language.py              # fails where a figure is worse than its limit, and names pages and sentences
scripts/language.py PAGE ...     # the figures and the longest sentences of some pages
scripts/language.py --tighten    # lowers each limit to the figure of today, down to its target; never loosens one
"""

from __future__ import annotations

import argparse
import ast
import json
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import quantiles

ROOT = Path(__file__).parent.parent
LIMITS = Path(__file__).with_suffix(".json")
GENERATED = re.compile(r"<!-- [^>]*\b(?:scripts|benchmarks)/\w+ -->.*?<!-- end -->", re.DOTALL)
NO_PROSE = re.compile(
    r"^( *)```.*?^\1```|^    .*?$|<!--.*?-->|^#.*?$|^\|[-:| ]+\|$|!\[[^\]]*\]\([^)]*\)", re.DOTALL | re.MULTILINE
)
MARKUP = ((re.compile(r"`+[^`]+`+"), "Code"), (re.compile(r"\[([^\]]*)\]\([^)]*\)"), r"\1"), (re.compile(r"[*_]{1,2}"), ""))
PARAGRAPH = re.compile(r"\n\s*\n|\n(?=\s*(?:[-*|]|\d+\.)\s)")
SENTENCE = re.compile(r"(?<=[.!?])\)?\s+(?=[A-Z0-9(])|\s*\n\s*\n\s*")
WORD = re.compile(r"[A-Za-z][A-Za-z'-]*")
RATES = {
    "you": re.compile(r"\b(?:you|your|yours|yourself)\b", re.IGNORECASE),
    "noun clauses": re.compile(r"\b(?:what|which|whose|those)\b", re.IGNORECASE),
    "speech": re.compile(r"\b(?:tell|tells|told|says?|said|know|knows|known|ask|asks|asked)\b", re.IGNORECASE),
}
QUESTION = re.compile(r"(?:What|Whether|How|Where|When|Which|Who|Whose|Why|All that|Those)\b")
TARGETS = {
    "you": 8.0,
    "noun clauses": 7.0,
    "speech": 1.0,
    "median sentence": 14,
    "long sentence": 26,
    "question docstrings": 3.0,
}
"""Words in 1,000, words a sentence (median and 90th percentile), and docstrings in 100: those of well-read libraries."""
MORE_IS_BETTER = {"you"}


@dataclass(frozen=True)
class Text:
    """The prose of one page, module or list of descriptions."""

    name: str
    prose: tuple[str, ...]
    cells: tuple[str, ...] = ()  # of tables: their words count, but they are no sentences

    @property
    def sentences(self) -> list[str]:
        parts = (" ".join(part.split()) for paragraph in self.prose for part in SENTENCE.split(paragraph))
        return [part for part in parts if len(WORD.findall(part)) > 2]

    def figure(self, measure: str) -> float:
        if measure in RATES:
            everything = " ".join((*self.prose, *self.cells))
            return round(1000 * len(RATES[measure].findall(everything)) / max(len(WORD.findall(everything)), 1), 1)
        if measure == "question docstrings":
            return round(100 * sum(bool(QUESTION.match(first)) for first in self.prose) / max(len(self.prose), 1), 1)
        lengths = sorted(len(WORD.findall(sentence)) for sentence in self.sentences)
        return round(quantiles([*lengths, *lengths], n=10)[8 if measure == "long sentence" else 4]) if lengths else 0

    def worst(self, measure: str) -> str:
        """The sentence that costs most in a measure."""
        if measure == "question docstrings":
            return next((first for first in self.prose if QUESTION.match(first)), "")
        if measure in MORE_IS_BETTER:
            return max(self.sentences, key=len, default="") if self.figure(measure) < TARGETS[measure] else ""
        count = RATES.get(measure, WORD)
        return max(self.sentences, key=lambda sentence: len(count.findall(sentence)), default="")


def markdown(name: str, text: str) -> Text:
    """The prose of a page in Markdown, without code, headings and generated tables."""
    text = NO_PROSE.sub("", GENERATED.sub("", text))
    for pattern, instead in MARKUP:
        text = pattern.sub(instead, text)
    parts = [part.strip() for part in PARAGRAPH.split(text)]
    cells = (cell for part in parts if part.startswith("|") for cell in part.strip("|").split("|"))
    prose = (re.sub(r"^(?:[-*]|\d+\.)\s", "", part) for part in parts if part and not part.startswith("|"))
    return Text(name, tuple(prose), tuple(cells))


def guides() -> Iterator[Text]:
    """README and the pages written by hand."""
    for page in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))):
        text = page.read_text("utf-8")
        if not text.startswith("<!-- written by scripts/docs"):
            yield markdown(str(page.relative_to(ROOT)), text)


def reference() -> Iterator[Text]:
    """CHANGELOG, the help of the command line, and the descriptions of a recipe's fields."""
    from viewsphere.recipe.recipe import schema

    yield markdown("CHANGELOG.md", (ROOT / "CHANGELOG.md").read_text("utf-8"))
    yield markdown("docs/cli.md", re.sub(r"\| (`[^|]*?) \| (.*) \|", r"\n\n\2\n\n", (ROOT / "docs/cli.md").read_text("utf-8")))
    for name, entry in schema()["$defs"].items():
        fields = entry.get("properties", {}).values()
        yield markdown(f"recipe: {name}", "\n\n".join(field["description"] for field in fields if "description" in field))


def docstrings() -> Iterator[Text]:
    """The first lines of the docstrings of each module."""
    for path in sorted(path for folder in ("src", "scripts", "benchmarks") for path in (ROOT / folder).rglob("*.py")):
        nodes = [node for node in ast.walk(ast.parse(path.read_bytes())) if isinstance(node, DOCUMENTED)]
        first = tuple(text.splitlines()[0] for node in nodes if (text := ast.get_docstring(node)))
        yield Text(str(path.relative_to(ROOT)), first)


DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
GROUPS = {
    "guides": (guides, ("you", "noun clauses", "speech", "median sentence", "long sentence")),
    "reference": (reference, ("noun clauses", "speech", "median sentence", "long sentence")),
    "docstrings": (docstrings, ("question docstrings",)),
}


def joined(texts: list[Text]) -> Text:
    return Text("all", tuple(p for text in texts for p in text.prose), tuple(c for text in texts for c in text.cells))


def is_worse(measure: str, figure: float, limit: float) -> bool:
    return figure < limit if measure in MORE_IS_BETTER else figure > limit


def tightened(measure: str, figure: float, limit: float) -> float:
    """The better of limit and figure, but no better than the target: there, pages may vary."""
    if measure in MORE_IS_BETTER:
        return max(limit, min(figure, TARGETS[measure]))
    return min(limit, max(figure, TARGETS[measure]))


def complaint(group: str, measure: str, texts: list[Text], limit: float) -> str:
    """The problem, and the three pages that are worst in it, each with a sentence."""
    figure = joined(texts).figure(measure)
    order = sorted(filter(lambda text: text.prose, texts), key=lambda text: text.figure(measure))
    worst = order[:3] if measure in MORE_IS_BETTER else order[:-4:-1]
    pages = "".join(f"\n  {text.name} ({text.figure(measure):g}): {text.worst(measure)}" for text in worst)
    return f"{group}: {measure} is {figure:g}; its limit is {limit:g}. Rewrite some sentences:{pages}"


def show(texts: list[Text]) -> None:
    for text in texts:
        print(text.name, *(f"{measure} {text.figure(measure):g}" for measure in GROUPS["guides"][1]), sep="; ")
        for sentence in sorted(text.sentences, key=lambda sentence: -len(WORD.findall(sentence)))[:3]:
            print(f"  {len(WORD.findall(sentence))}: {sentence}")


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("pages", nargs="*")
    options.add_argument("--tighten", action="store_true")
    chosen = options.parse_args()
    if chosen.pages:
        return show([markdown(page, Path(page).read_text("utf-8")) for page in chosen.pages])
    limits: dict[str, dict[str, float]] = json.loads(LIMITS.read_text("utf-8"))
    complaints: list[str] = []
    for group, (read, measures) in GROUPS.items():
        texts = [*read()]
        for measure in measures:
            figure, limit = joined(texts).figure(measure), limits[group][measure]
            if is_worse(measure, figure, limit):
                complaints.append(complaint(group, measure, texts, limit))
            limits[group][measure] = tightened(measure, figure, limit)
            print(f"{group}: {measure} {figure:g} (limit {limit:g}, target {TARGETS[measure]:g})")
    if chosen.tighten:
        LIMITS.write_text(json.dumps(limits, indent=1) + "\n", "utf-8")
    if complaints:
        sys.exit("\n".join(complaints))


if __name__ == "__main__":
    main()
