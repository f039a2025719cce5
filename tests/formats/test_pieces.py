"""Files that are put together of pieces: each section keeps its own, in whichever order files and sections begin."""

from __future__ import annotations

from viewsphere.formats.shared.writing.tree import Piece, Tree, functions


class Mixed(Tree):
    """Two files of two sections each, whose second ones begin when both files are there."""

    def sample_files(self, sample):
        for section in "xy":
            for path in ("a.txt", "b.txt"):
                yield Piece(path, f"{path} {section} {sample}\n".encode(), section)

    def layout(self, path, counts):
        assert counts == {"x": 2, "y": 2}
        return "x", b"--\n", "y"


def test_sections_do_not_mix(tmp_path):
    made = functions(Mixed)
    prepare = made.preparer(None, tmp_path)
    with made.writer(None, tmp_path, print) as add:
        add(prepare(1))
        add(prepare(2))
    for name in ("a.txt", "b.txt"):
        assert (tmp_path / name).read_text() == f"{name} x 1\n{name} x 2\n--\n{name} y 1\n{name} y 2\n"
