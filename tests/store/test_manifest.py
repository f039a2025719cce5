"""Manifests: what was written is known again, and what was changed is noticed."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewsphere.errors import StoreError
from viewsphere.store.shots.manifest import MANIFEST, Manifest, digest, seal_of, sealed, unsealed

PLAIN = st.dictionaries(
    st.text(max_size=8), st.recursive(st.none() | st.integers() | st.text(max_size=9), st.lists, max_leaves=4)
)


@pytest.mark.slow
@given(value=PLAIN.filter(lambda value: "digest" not in value))
def test_a_sealed_text_is_json_that_opens_to_what_was_sealed(value):
    text = sealed(value)
    assert json.loads(text).keys() == value.keys() | {"digest"}
    if value:
        assert unsealed(text) == value


@given(data=st.data())
def test_any_changed_character_breaks_the_seal(data):
    text = sealed({"files": {"rgb/1.png": [7, "ab"]}, "more": 1.5})
    at = data.draw(st.integers(0, len(text) - 1))
    other = data.draw(st.characters(codec="ascii").filter(lambda c: c != text[at]))
    with pytest.raises(ValueError, match="changed since"):
        unsealed(text[:at] + other + text[at + 1 :])


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "depth").mkdir()
    for name, data in {"frames.json": b"[]", "depth/1.tiff": bytes(range(256)) * 5000, "depth/2.tiff": b""}.items():
        (tmp_path / name).write_bytes(data)
    Manifest.from_folder(tmp_path).write(tmp_path)
    return tmp_path


def test_an_untouched_folder_has_no_damage(folder):
    manifest = Manifest.read(folder)
    assert set(manifest.files) == {"frames.json", "depth/1.tiff", "depth/2.tiff"}
    assert list(manifest.damage(folder)) == []
    data = (folder / "depth/1.tiff").read_bytes()
    assert seal_of(folder / "depth/1.tiff") == (len(data), digest(data)) == manifest.files["depth/1.tiff"]
    manifest.check("depth/1.tiff", data, folder)


@given(bit=st.integers(0, 8 * 5000 * 256 - 1))
def test_every_flipped_bit_is_noticed(bit, tmp_path_factory):
    data = bytearray(bytes(range(256)) * 5000)
    told = (len(data), digest(bytes(data)))
    data[bit // 8] ^= 1 << bit % 8
    with pytest.raises(
        StoreError, match=r"expected 1,280,000 bytes with digest .* found .*: mend it with viewsphere check --repair"
    ):
        Manifest({"a": told}).check("a", bytes(data), tmp_path_factory.getbasetemp() / "a")


def test_missing_longer_and_strange_files_are_noticed(folder):
    manifest = Manifest.read(folder)
    (folder / "frames.json").unlink()
    (folder / "depth/2.tiff").write_bytes(b"x")
    (folder / "depth/3.tiff").write_bytes(b"")
    found = list(manifest.damage(folder))
    names = ("depth/2.tiff", "frames.json", "depth/3.tiff")
    assert {line.partition(": expected ")[0] for line in found} == {str(folder / name) for name in names}


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"files": {}}', sealed({"files": {"a": 3}}), sealed({"other": {}})])
def test_a_damaged_manifest_is_refused_in_one_line(folder, text):
    (folder / MANIFEST).write_text(text)
    with pytest.raises(StoreError, match=r"expected the manifest of a finished folder, found .*--repair$"):
        Manifest.read(folder)
