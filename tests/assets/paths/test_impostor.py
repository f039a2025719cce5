"""Files that are no model, or another kind of one: each refused in one line with the true reason and the remedy."""

import pytest

from viewsphere.assets.load import load_model
from viewsphere.assets.paths.folder import impostor
from viewsphere.assets.readers import suffixes
from viewsphere.errors import ModelError

LFS = b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a2146\nsize 1234567\n"
IMPOSTORS = {
    "lfs": (LFS, "a git-lfs pointer to the file, whose 1,234,567 bytes are not downloaded; run `git lfs pull`"),
    "annex": (b"/annex/objects/SHA256E-s12--ab.glb\n", "a git-annex pointer to the file; run `git annex get`"),
    "page": (b"\xef\xbb\xbf\n<!DOCTYPE html>\n<html><head></head></html>", "a web page (HTML); download the file itself"),
    "bare page": (b"<!-- cached -->\n<HTML lang='en'>" + b"x" * 9000, "a web page (HTML)"),
    "status": (b"404: Not Found", "the message of a server ('404: Not Found')"),
    "store": (b"<?xml version='1.0'?>\n<Error><Code>AccessDenied</Code></Error>", "the message of a server"),
    "json": (b'{"message": "Bad credentials"}', "the message of a server"),
    "7z": (b"7z\xbc\xaf\x27\x1c\0\4", "a 7z archive; unpack it"),
    "gzip": (b"\x1f\x8b\x08\0", "a gzip archive; unpack it"),
    "fbx": (b"Kaydara FBX Binary  \0", "one of another kind; rename the file so that it ends in .fbx"),
    "picture": (b"\x89PNG\r\n\x1a\n", "a PNG picture; name the model's file"),
}


@pytest.mark.parametrize("suffix", suffixes())
@pytest.mark.parametrize("kind", IMPOSTORS)
def test_every_reader_names_what_a_file_is_instead(write, suffix, kind):
    data, reason = IMPOSTORS[kind]
    if (suffix, kind) in {("fbx", "fbx"), ("blend", "gzip")}:
        pytest.skip("it is what its name says")
    with pytest.raises(ModelError) as error:
        load_model(write(f"a.{suffix}", data))
    assert f"a.{suffix}: expected a model, found {reason}" in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "data",
    [
        b'{"asset": {"version": "2.0"}, "extras": {"message": "hello"}}',
        b"# not found\nv 0 0 0\n",
        b"4040 0 0\n",
        b"<?xml version='1.0'?><COLLADA/>",
        b"solid 404\n",
    ],
)
def test_a_model_is_no_impostor(data):
    assert impostor(data) is None


def test_a_texture_that_is_a_pointer_is_a_warning_that_says_so(write):
    write("t.png", LFS)
    write("m.mtl", "newmtl m\nmap_Kd t.png\n")
    text = "mtllib m.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n"
    mesh, _ = load_model(write("a.obj", text))
    assert "a.obj: texture 't.png' is a git-lfs pointer to the file" in mesh.warnings[0]
