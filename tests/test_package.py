"""What users get: the version, the wheel, the sdist, and the pages that a host reads."""

import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import PurePosixPath

import pytest
import yaml
from packaging.version import Version

from small import ROOT

VERSION = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
NOT_SHIPPED = (".venv", "__pycache__", "dist", "demo-out", "site", ".git")


def git(*words, folder):
    own = ("-c", "user.name=a", "-c", "user.email=a@example.org", "-c", "protocol.file.allow=always")
    return subprocess.run(["git", *own, *words], cwd=folder, check=True, capture_output=True, text=True).stdout.strip()


def hatch(*words, folder=ROOT):
    run = subprocess.run(
        [sys.executable, "-W", "ignore", "-m", "hatchling", *words], cwd=folder, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    return run.stdout.strip()


@pytest.fixture(scope="module")
def archives(tmp_path_factory):
    """The names of files in the wheel and in the sdist, below its one folder."""
    folder = tmp_path_factory.mktemp("dist")
    hatch("build", "-d", folder)
    with zipfile.ZipFile(next(folder.glob("*.whl"))) as wheel:
        metadata = next(name for name in wheel.namelist() if name.endswith("/METADATA"))
        packed, told = set(wheel.namelist()), wheel.read(metadata).decode()
    with tarfile.open(next(folder.glob("*.tar.gz"))) as sdist:
        source = {name.partition("/")[2] for name in sdist.getnames()}
    return packed, source, told


def tracked(*folders):
    """Files that the repository holds, or is about to."""
    return set(git("ls-files", "--cached", "--others", "--exclude-standard", *folders, folder=ROOT).splitlines())


needs_git = pytest.mark.skipif(shutil.which("git") is None or not (ROOT / ".git").exists(), reason="no clone")


@pytest.mark.slow
@needs_git
def test_the_wheel_holds_the_package_and_nothing_else(archives):
    packed, _, _ = archives
    code = {name for name in packed if ".dist-info/" not in name}
    assert code == {name.removeprefix("src/") for name in tracked("src") if (ROOT / name).exists()}
    told = {re.sub(r"^[^/]*\.dist-info/", "", name) for name in packed - code}
    licences = {"licenses/LICENSE", "licenses/src/viewsphere/report/web/vendor/LICENSES.txt"}
    assert told == {"METADATA", "WHEEL", "RECORD", "entry_points.txt", *licences}


@pytest.mark.slow
def test_the_wheel_holds_what_is_no_code(archives):
    packed, _, _ = archives
    assert {"viewsphere/py.typed", "viewsphere/recipe/starts/poses/recipe.yaml"} <= packed
    assert any(name.startswith("viewsphere/report/web/") and name.endswith(".js") for name in packed)


@pytest.mark.slow
@needs_git
def test_the_sdist_holds_what_tests_and_docs_need(archives):
    _, source, _ = archives
    assert {"PKG-INFO", "pyproject.toml", "README.md", "CITATION.cff", "SECURITY.md", "CHANGELOG.md"} <= source
    kept = tracked("src", "tests", "docs", "recipes", "scripts", "benchmarks")
    assert {name for name in kept if (ROOT / name).exists()} <= source


@pytest.mark.slow
def test_no_archive_holds_what_is_made(archives):
    for names in archives[:2]:
        assert not [name for name in names if set(PurePosixPath(name).parts) & set(NOT_SHIPPED)]


@pytest.mark.slow
def test_the_metadata_names_the_version_and_the_pythons_that_are_tried(archives):
    told = archives[2]
    assert f"\nVersion: {VERSION}\n" in told
    assert "Requires-Python: >=3.11" in told
    versions = re.findall(r"Programming Language :: Python :: (3\.\d+)", told)
    assert versions == ["3.11", "3.12", "3.13"]
    assert "License-Expression: Apache-2.0" in told and "Description-Content-Type: text/markdown" in told


def test_the_version_is_written_in_one_file(tmp_path):
    """A copy without git, as a host packs it, has the same version; no other file names one that could differ."""
    (tmp_path / "src" / "viewsphere" / "report" / "web" / "vendor").mkdir(parents=True)
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, tmp_path)
    assert hatch("version", folder=tmp_path) == VERSION == str(Version(VERSION))
    assert "version" not in yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))


def test_the_citation_names_the_paper():
    told = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    assert {"cff-version", "message", "title", "authors"} <= told.keys()  # what the format needs
    assert told["cff-version"] == "1.2.0" and told["license"] == "Apache-2.0"
    (paper,) = told["references"]
    assert paper["year"] == 2019 and paper["authors"][0]["family-names"] == "Ruiz"


@pytest.mark.parametrize("file", sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml")), ids=lambda file: file.stem)
def test_issue_templates_are_forms(file):
    told = yaml.safe_load(file.read_text("utf-8"))
    if file.stem == "config":
        assert told == {"blank_issues_enabled": True}
        return
    assert {"name", "description", "body"} <= told.keys()
    assert {item["type"] for item in told["body"]} <= {"markdown", "textarea", "input", "dropdown", "checkboxes"}
    asked = [item for item in told["body"] if item["type"] != "markdown"]
    assert all(item["attributes"]["label"] for item in asked)
    assert len({item["id"] for item in asked}) == len(asked)
    assert any(item.get("validations", {}).get("required") for item in asked)


def test_scripts_are_called_by_their_names():
    assert os.access(ROOT / "scripts" / "package", os.X_OK)
    assert "scripts/package " in (ROOT / ".ci" / "run").read_text("utf-8")
