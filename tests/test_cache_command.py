"""`viewsphere cache`: what it shows and deletes."""

import json
import os

import numpy as np
import pytest

from command_line import viewsphere
from viewsphere.caches import cache_of
from viewsphere.caches.entries import write_entry


@pytest.fixture
def filled(tmp_path, monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path))
    for age, (kind, name) in enumerate([("light", "new"), ("zoo", "older"), ("models", "oldest")]):
        file = cache_of(kind) / f"{name}.arrays"
        write_entry(file, {}, {"values": np.zeros(1_000, np.float32)})
        os.utime(file, (1e9 - age, 1e9 - age))
    (tmp_path / "recipes").mkdir()
    (tmp_path / "recipes" / "download").write_text("stays")
    return tmp_path


def files(folder):
    return {path.stem for path in folder.rglob("*.*")}


def test_info_counts_files_and_bytes_of_each_kind(filled):
    told = json.loads(viewsphere("cache", "--json").stdout)
    sizes = {kind: held["bytes"] for kind, held in told["kinds"].items()}
    assert told["folder"] == str(filled)
    assert {kind for kind, size in sizes.items() if size} == {"light", "models", "zoo"}
    assert sizes["light"] == sizes["models"] == sizes["zoo"]
    assert sizes["zoo"] == (filled / "zoo" / "older.arrays").stat().st_size > 4_000
    assert "light" in viewsphere("cache").stdout


def test_prune_deletes_what_was_used_longest_ago(filled):
    assert "1 file deleted" in viewsphere("cache", "prune", "--to", "9kB").stdout
    assert files(filled) == {"new", "older"}
    assert "0 files deleted" in viewsphere("cache", "prune").stdout


def test_clear_deletes_all_of_a_kind_and_no_download(filled):
    viewsphere("cache", "clear", "--kind", "light")
    assert files(filled) == {"older", "oldest"}
    assert json.loads(viewsphere("cache", "clear", "--json").stdout)["deleted"] == 2
    assert (filled / "recipes" / "download").read_text() == "stays"


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (["prune", "--to", "12x"], "cache: --to: expected a size, such as 500MB; found '12x'"),
        (["prune", "--to", "-1"], "cache: --to: expected a size, such as 500MB; found '-1'"),
        (["--to", "3"], "cache: --to is for `cache prune`"),
        (["prune", "--kind", "light"], "cache: --kind is for `cache clear`"),
        (["clear", "--kind", "lite"], "cache: --kind 'lite' is unknown"),
        (["cleer"], "cache: action: 'cleer' is not one of"),
    ],
)
def test_mistakes_are_one_line(filled, words, problem):
    ended = viewsphere("cache", *words)
    assert ended.returncode == 2
    assert ended.stderr.startswith(f"viewsphere: {problem}")
    assert files(filled) == {"new", "older", "oldest"}


def test_limits_take_units(monkeypatch):
    from viewsphere.errors import UserError
    from viewsphere.limits import limits

    for text, size in {"20 GB": 20 * 10**9, "1.5GiB": 3 << 29, "12": 12, "500mb": 5 * 10**8}.items():
        monkeypatch.setenv("VIEWSPHERE_CACHE_LIMIT", text)
        assert size == limits.CACHE_LIMIT
    for text in ("GB", "3 parsecs", "1e400GB", "-2MB", "nanGB"):
        monkeypatch.setenv("VIEWSPHERE_CACHE_LIMIT", text)
        with pytest.raises(UserError, match="CACHE_LIMIT"):
            limits.CACHE_LIMIT  # noqa: B018
