"""Every recipe of recipes/ and recipes/labels renders as it is shipped."""

import pytest

from built_once import built_once
from shipped import rendered
from small import ROOT

pytestmark = [pytest.mark.shipped, pytest.mark.slow]


@pytest.fixture(scope="module", autouse=True)
def _built_once():
    with built_once():
        yield


@pytest.mark.parametrize(
    "file",
    sorted(file for folder in ("", "labels") for file in (ROOT / "recipes" / folder).glob("*.yaml")),
    ids=lambda file: file.stem,
)
def test_a_recipe_renders_as_it_is_shipped(file, tmp_path):
    rendered(file, tmp_path)
