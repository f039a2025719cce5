"""Files of other machines are told from local ones by the longest mount above them."""

import pytest

from viewsphere.caches import arrays

TABLE = r"""
/dev/sda1 / ext4 rw 0 0
server:/home /home nfs4 rw 0 0
tmpfs /home/me/fast tmpfs rw 0 0
//server/share /mnt/a\040b cifs rw 0 0
x /srv fuse.sshfs rw 0 0
server:/data /mnt/dätä nfs4 rw 0 0
server:/other /mnt/twice nfs4 rw 0 0
/dev/sdb1 /mnt/twice ext4 rw 0 0
/dev/sdb2 /mnt/hidden ext4 rw 0 0
server:/third /mnt/hidden nfs4 rw 0 0
broken
"""


@pytest.fixture(autouse=True)
def table(tmp_path, monkeypatch):
    (tmp_path / "mounts").write_text(TABLE, encoding="utf-8")
    monkeypatch.setattr(arrays, "MOUNTS", tmp_path / "mounts")
    arrays._mounts.cache_clear()
    yield tmp_path / "mounts"
    arrays._mounts.cache_clear()


@pytest.mark.parametrize(
    ("file", "is_local"),
    [
        ("/var/cache/a", True),
        ("/home/me/a", False),
        ("/home/me/fast/a", True),
        ("/home/me/faster/a", False),
        ("/homes/a", True),
        ("/mnt/a b/c", False),
        ("/srv/a", False),
        ("/mnt/dätä/a", False),
        ("/mnt/twice/a", True),
        ("/mnt/hidden/a", False),
    ],
)
def test_the_longest_mount_decides(file, is_local):
    assert arrays.is_local(file) == is_local


def test_without_a_table_nothing_is_known_to_be_local(table):
    table.unlink()
    assert not arrays.is_local("/var/cache/a")
