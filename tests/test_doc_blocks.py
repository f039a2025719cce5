"""Each YAML block of README and docs is a recipe, or a part of one; those without the reader's files are planned."""

import re

import pytest

import viewsphere as vs
from small import ROOT
from viewsphere.errors import RecipeError
from viewsphere.recipe.reading.file import parse
from viewsphere.run.opening import check_formats, prepare

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")), ROOT / "recipes" / "README.md"]
MODELS = [{"source": "zoo:car", "count": 40}, {"source": "zoo:chair", "count": 3}, {"source": "zoo:hair_drier", "count": 9}]
BASE = {
    "models": MODELS,
    "viewpoints": {"distance": 5},
    "channels": ["rgb", "depth", "instances", "depth_ray", "normals"],
    "annotations": ["captions"],
    "formats": [],
    "splits": {"by": "frame"},
}
STREET = {"place": "zoo:neighbourhood"}
MOVING = BASE | {"time": {"frames": 20, "fps": 25}, "splits": {"by": "sequence"}, "scene": STREET}
"""What a block that is part of a recipe is a part of: still pictures or sequences, whichever its page is about."""

OTHERS = ("cluster_name", "apiVersion", "axes")
"""What files begin with that are no recipes: a cluster's, a job's, a model's sidecar."""

FILES = re.compile(
    r"[\w*/-]+\.(?:ya?ml|csv|jsonl?|blend|fbx|obj|glb|gltf|png|jpe?g|exr|hdr|txt)\b"
    r"|\b(?:images|textures|hdri|extends): |\w:\.\./"
)
"""Files and folders of the reader's."""


def blocks():
    """All blocks of recipes."""
    for page in PAGES:
        for number, text in enumerate(re.findall(r"```yaml\n(.*?)```", page.read_text("utf-8"), re.DOTALL)):
            if not text.startswith(OTHERS):
                yield pytest.param(text, id=f"{page.stem}-{number}")


def recipe_of(text, base=BASE):
    part, _ = parse(text, "block")
    part.pop("extends", None)
    return vs.Recipe(**(part if "viewpoints" in part and "models" in part and "name" in part else base | part))


BLOCKS = [*blocks()]
ALONE = [block for block in BLOCKS if not FILES.search(re.sub(r"(^|\s)#.*", "", block.values[0]))]


@pytest.mark.parametrize("text", BLOCKS)
def test_a_block_is_a_recipe_or_a_part_of_one(text):
    assert recipe_of(text).models


@pytest.mark.parametrize("text", ALONE)
def test_a_block_that_names_no_file_is_planned_as_it_is_shipped(text):
    try:
        recipe = recipe_of(text)
        check_formats(prepare(recipe), recipe.formats, recipe.channels)
    except RecipeError as error:
        if "time" not in str(error):
            raise
        recipe = recipe_of(text, MOVING)
        check_formats(prepare(recipe), recipe.formats, recipe.channels)


def test_most_blocks_are_planned():
    assert len(BLOCKS) > 70 and len(ALONE) > len(BLOCKS) / 2
