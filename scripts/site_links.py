"""Finds links within a site that lead nowhere: to files that are not there, or to anchors that their page lacks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


@dataclass
class Page(HTMLParser):
    """The links of a page and its anchors."""

    links: list[str] = field(default_factory=list)
    anchors: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        super().__init__()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        told = {name: value or "" for name, value in attrs}
        self.anchors |= {told[name] for name in ("id", "name") if name in told}
        if tag in {"a", "img"}:
            self.links += [told[name] for name in ("href", "src") if told.get(name)]


def read(file: Path) -> Page:
    page = Page()
    page.feed(file.read_text("utf-8"))
    return page


def broken(site: Path) -> Iterator[str]:
    """A line for each link that leads nowhere; links to other sites are not tried."""
    pages = {file.resolve(): read(file) for file in sorted(site.rglob("*.html")) if file.name != "404.html"}
    if not pages:
        yield f"{site}: expected pages, found none"
    for file, page in pages.items():
        for link in page.links:
            to = urlsplit(link)
            if to.scheme or to.netloc:
                continue
            target = (file.parent / unquote(to.path)).resolve() if to.path else file
            target = target / "index.html" if target.is_dir() else target
            where = f"{file.relative_to(site.resolve())}: {link}"
            if not target.is_file():
                yield f"{where}: expected a file, found none"
            elif to.fragment and target in pages and unquote(to.fragment) not in pages[target].anchors:
                yield f"{where}: expected the anchor #{to.fragment}, found none"
