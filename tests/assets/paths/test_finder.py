"""Files that a model means: spellings, folders of public data sets, and what stays out of reach."""

import unicodedata
from pathlib import Path

import pytest

from viewsphere.assets.paths.finder import Finder, NotFoundError


@pytest.fixture
def find(write):
    """Find a reference from `asset/meshes/model.obj`, whose library may lie in another folder."""
    model = write("asset/meshes/model.obj", "v 0 0 0\n")
    return lambda reference, base=None: Finder(model).find(reference, base).path


@pytest.mark.parametrize(
    ("file", "reference"),
    [
        ("meshes/t.png", "t.png"),
        ("meshes/t.png", '"t.png"'),
        ("meshes/a b.png", "a b.png"),
        ("meshes/a b.png", "a%20b.png"),
        ("meshes/100%.png", "100%.png"),
        ("meshes/a%20b.png", "a%20b.png"),
        ("meshes/Maps/Skin.PNG", "maps\\skin.png"),
        ("meshes/Größe.png", unicodedata.normalize("NFD", "größe.png")),
        ("meshes/t.png", "./sub/../t.png"),
        ("meshes/t.png", "file://t.png"),
        ("meshes/t.png", "file:///C:/Users/somebody/t.png"),
        ("meshes/t.png", "/home/somebody/t.png"),
        ("meshes/Textures/t.png", "D:\\work\\t.png"),
        ("materials/textures/t.png", "t.png"),
        ("materials/textures/t.png", "../materials/textures/t.png"),
        ("images/t.png", "../images/t.png"),
        ("Images/t.png", "../images/T.png"),
        ("texture/t.png", "t.png"),
        ("textures/sub/t.png", "..\\Textures\\sub\\t.png"),
    ],
)
def test_a_file_is_found_however_it_is_written(find, write, file, reference):
    path = write(f"asset/{file}", b"")
    assert find(reference).samefile(path)


def test_the_folder_of_the_library_counts_after_that_of_the_model(find, write):
    near, far = write("asset/meshes/t.png", b""), write("asset/meshes/mats/t.png", b"")
    assert find("t.png", far.parent).samefile(near)
    near.unlink()
    assert find("t.png", far.parent).samefile(far)


def test_a_path_that_exists_wins_over_a_known_folder(find, write):
    write("asset/images/t.png", b"")
    path = write("asset/meshes/sub/t.png", b"")
    assert find("sub/t.png").samefile(path)


@pytest.mark.parametrize("reference", ["../secret.png", "../other/secret.png", "../images/../secret.png", "../images/link.png"])
def test_only_known_folders_beside_the_model_are_open(find, write, reference):
    for name in ("secret.png", "other/secret.png", "images/plain.png"):
        write(f"asset/{name}", b"")
    Path(find("../images/plain.png")).with_name("link.png").symlink_to("../secret.png")
    with pytest.raises(NotFoundError, match="outside the model's folder"):
        find(reference)


def test_a_known_folder_that_is_a_link_leads_nowhere(find, write, tmp_path):
    write("secrets/t.png", b"")
    (tmp_path / "asset/images").symlink_to(tmp_path / "secrets")
    with pytest.raises(NotFoundError, match="outside the model's folder"):
        find("../images/t.png")


@pytest.mark.parametrize(
    ("files", "reference", "nearest"),
    [
        (["wood_01.png", "stone.png"], "wood_1.png", "wood_01.png"),
        (["wood.jpg", "wool.png", "wood.mtl"], "wood.png", "wood.jpg"),
        (["capsule.png"], "surface.png", None),
        (["maps/deep.png"], "old/Deep.tga", "maps/deep.png"),
        (["../images/texture0.png"], "../images/texture_0.png", "../images/texture0.png"),
        (["../private/wood.png"], "wood.png", None),
        (["stone.png", "wood.txt"], "wood.png", None),
    ],
)
def test_a_missing_file_names_the_nearest_one(find, write, files, reference, nearest):
    for name in files:
        write(f"asset/meshes/{name}", b"")
    with pytest.raises(NotFoundError) as error:
        find(reference)
    assert str(error.value) == "does not exist" + (f" (nearest file: {nearest!r})" if nearest else "")


def test_a_file_that_appears_later_is_among_those_looked_for(write):
    finder = Finder(write("asset/meshes/model.obj", "v 0 0 0\n"))
    with pytest.raises(NotFoundError):
        finder.find("t.png")
    for name in ("asset/meshes/t.png", "asset/meshes/textures/t.png", "asset/materials/textures/t.png"):
        assert write(name, b"").resolve() in finder.looked_for
