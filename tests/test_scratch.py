"""Folders that are not whole yet go with their process, however it ends, and not before."""

import os
import signal
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from deadline import DEADLINE, until
from viewsphere.errors import UserError
from viewsphere.scratch import (
    LOCK,
    STALE_S,
    ScratchDir,
    left_by_dead,
    of_this_process,
    scratch_folder,
    sweep,
    temporary,
    write_whole,
)

MAKER = """
import sys, time
from pathlib import Path
from viewsphere.scratch import ScratchDir
made = ScratchDir.make(Path(sys.argv[1]), "x-")
(made.folder / "half").write_text("half")
print(made.folder, flush=True)
time.sleep(600)
"""


@pytest.fixture
def maker(tmp_path):
    """A process that has made a folder in the test's, and the folder."""
    process = subprocess.Popen([sys.executable, "-c", MAKER, tmp_path], stdout=subprocess.PIPE, text=True)
    try:
        yield process, Path(process.stdout.readline().strip())
    finally:
        process.kill()
        process.communicate(timeout=DEADLINE)


def anothers(folder: Path, host: str = "otherhost") -> Path:
    """The folder as one of another machine."""
    _, _, rest = folder.name.partition("~")
    return folder.rename(folder.with_name(f"x-{host}~{rest}"))


def age(folder: Path) -> None:
    """Let nothing have changed in a folder for long."""
    moment = folder.stat().st_mtime - STALE_S - 60
    for path in (*folder.rglob("*"), folder):
        os.utime(path, (moment, moment))


@pytest.mark.parametrize("how", ["SIGKILL", "SIGTERM", "SIGINT"])
def test_what_a_process_left_goes_when_it_is_dead(maker, tmp_path, how):
    process, folder = maker
    sweep(tmp_path, "x-")
    assert (folder / "half").is_file()
    process.send_signal(getattr(signal, how, signal.SIGTERM))
    process.wait(DEADLINE)
    sweep(tmp_path, "y-")
    assert (folder / "half").is_file()
    sweep(tmp_path, "x-")
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(os.name == "nt", reason="signals")
def test_one_that_is_stopped_is_not_dead(maker, tmp_path):
    process, folder = maker
    process.send_signal(signal.SIGSTOP)
    age(folder)
    sweep(tmp_path, "x-")
    assert (folder / "half").is_file()


def test_the_number_of_a_dead_process_may_be_ours(tmp_path):
    left = tmp_path / f"{of_this_process()}left"
    left.mkdir()
    with scratch_folder(tmp_path) as own:
        assert list(left_by_dead(tmp_path)) == [left]
        assert list(tmp_path.iterdir()) == [own]


def test_another_machine_s_is_left_until_it_is_old(maker, tmp_path):
    process, folder = maker
    process.kill()
    process.wait(DEADLINE)
    folder = anothers(folder)
    sweep(tmp_path, "x-")
    assert (folder / "half").is_file()
    age(folder)
    (folder / "half").write_text("still at it")
    sweep(tmp_path, "x-")
    assert (folder / "half").is_file()
    age(folder)
    sweep(tmp_path, "x-")
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(os.name == "nt", reason="renames no folder of an open file")
def test_another_machine_s_that_is_seen_to_be_held_is_left(maker, tmp_path):
    folder = anothers(maker[1])
    age(folder)
    sweep(tmp_path, "x-")
    assert (folder / "half").is_file()


def test_where_there_are_no_locks_age_decides(maker, tmp_path, monkeypatch):
    process, folder = maker
    process.kill()
    process.wait(DEADLINE)
    monkeypatch.setattr("viewsphere.scratch._take", lambda lock: False)
    with scratch_folder(tmp_path, "x-") as own:
        sweep(tmp_path, "x-")
        assert {path for path in tmp_path.iterdir()} == {own, folder}
        age(folder)
        sweep(tmp_path, "x-")
        assert list(tmp_path.iterdir()) == [own]


@pytest.mark.skipif(os.name == "nt", reason="renames no folder of an open file")
def test_what_is_being_removed_has_another_name(tmp_path, monkeypatch):
    seen = []
    monkeypatch.setattr("shutil.rmtree", lambda folder, **_: seen.append(folder.name))
    with scratch_folder(tmp_path) as own:
        pass
    assert seen == [f"{own.name}~"]
    assert not list(left_by_dead(tmp_path))


def refused(error):
    def refuse(*_, **__):
        raise error(13, "refused")

    return refuse


@pytest.mark.skipif(os.name == "nt", reason="what flock says")
def test_a_system_that_forbids_locks_has_none(tmp_path, monkeypatch):
    monkeypatch.setattr("fcntl.flock", refused(PermissionError))
    with scratch_folder(tmp_path) as own:
        sweep(tmp_path)
        assert list(tmp_path.iterdir()) == [own]
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(os.name == "nt", reason="what flock says")
def test_where_somebody_takes_every_folder_it_is_said_and_none_is_left(tmp_path, monkeypatch):
    monkeypatch.setattr("fcntl.flock", refused(BlockingIOError))
    with pytest.raises(OSError, match="no folder stays"), scratch_folder(tmp_path):
        pass
    assert not list(tmp_path.iterdir())


def test_where_files_change_their_numbers_a_folder_is_made_all_the_same(tmp_path, monkeypatch):
    monkeypatch.setattr("os.path.samestat", lambda *_: False)
    with scratch_folder(tmp_path) as own:
        assert list(tmp_path.iterdir()) == [own]
        assert list(own.iterdir()) == [own / LOCK]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks")
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_forked_process_removes_and_holds_nothing_of_its_parent_s(tmp_path):
    made = ScratchDir.make(tmp_path)
    done, go = os.pipe(), os.pipe()
    child = os.fork()
    if not child:
        try:
            inside = ScratchDir.make(tmp_path)  # whose lock may have the number of the parent's
            made.remove()
            inside.remove()
            os.write(done[1], b"x")
            os.read(go[0], 1)
        finally:
            os._exit(0)
    os.read(done[0], 1)
    try:
        assert list(tmp_path.iterdir()) == [made.folder]
        sweep(tmp_path)
        assert list(tmp_path.iterdir()) == [made.folder]
        made.leave()  # as if it had died
        sweep(tmp_path)
        assert not list(tmp_path.iterdir())
    finally:
        os.write(go[1], b"x")
        os.waitpid(child, 0)
        for end in (*done, *go):
            os.close(end)


def test_a_folder_whose_lock_cannot_be_removed_stays_whole(tmp_path, monkeypatch):
    """As on Windows, where another process has it open."""
    left = tmp_path / f"{of_this_process()}left"
    left.mkdir()
    (left / "half").write_text("half")
    with monkeypatch.context() as patched:
        patched.setattr(Path, "unlink", refused(PermissionError))
        sweep(tmp_path)
    assert len(list(tmp_path.rglob("half"))) == 1
    sweep(tmp_path)
    assert not list(tmp_path.iterdir())


def test_what_is_named_alike_is_nobody_s_to_remove(tmp_path):
    stranger = tmp_path / "x-my~own~folder"
    stranger.mkdir()
    age(stranger)
    sweep(tmp_path, "x-")
    assert stranger.is_dir()


@pytest.mark.skipif(os.name == "nt", reason="links need a right there")
def test_links_are_not_followed(tmp_path):
    home = tmp_path / "home"
    home.mkdir()
    (home / "thesis").write_text("x")
    place = tmp_path / "place"
    place.mkdir()
    (place / f"{of_this_process()}folder").symlink_to(home)
    left = place / f"{of_this_process()}lock"
    left.mkdir()
    (left / LOCK).symlink_to(home / "new")
    sweep(place)
    assert [path.name for path in home.iterdir()] == ["thesis"]


def test_temporary_folders_are_empty_and_go(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    (tmp_path / f"viewsphere-proof-{of_this_process()}left").mkdir()
    with temporary("proof") as folder:
        assert not list(folder.iterdir())
        assert [path.name for path in tmp_path.iterdir()] == [folder.parent.name]
    assert not list(tmp_path.iterdir())


def test_nobody_loses_a_folder_to_those_who_sweep(tmp_path):
    """Makers are met by sweepers between any two of their steps."""

    def make(_: int) -> bool:
        made = ScratchDir.make(tmp_path)
        (made.folder / "a").write_text("a")
        whole = {path.name for path in made.folder.iterdir()} == {LOCK, "a"}
        made.remove()
        return whole

    with ThreadPoolExecutor(4) as pool:
        sweeps = [pool.submit(lambda: [sweep(tmp_path) for _ in range(300)]) for _ in range(2)]
        assert all(pool.map(make, range(300)))
        for done in sweeps:
            done.result(DEADLINE)
    assert until(lambda: sweep(tmp_path) or not list(tmp_path.iterdir()))


def test_an_old_file_stays_until_the_new_one_is_whole(tmp_path, monkeypatch):
    file, good = tmp_path / "a" / "r.html", b"good" * 1000
    write_whole(file, good)
    file.chmod(0o640)
    write_bytes = Path.write_bytes

    def full(path, data):
        write_bytes(path, data[:10])
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched, pytest.raises(UserError, match=r"r\.html: .*No space left"):
        patched.setattr(Path, "write_bytes", full)
        write_whole(file, b"new")
    assert file.read_bytes() == good
    assert [path.name for path in file.parent.iterdir()] == ["r.html"]
    write_whole(file, b"new")
    assert (file.read_bytes(), file.stat().st_mode & 0o777) == (b"new", 0o640)


@pytest.mark.skipif(os.name == "nt", reason="POSIX files")
def test_a_link_and_a_device_stay_what_they_are(tmp_path):
    file, link = tmp_path / "file", tmp_path / "link"
    file.write_bytes(b"old")
    link.symlink_to(file)
    write_whole(link, b"new")
    assert link.is_symlink()
    assert file.read_bytes() == b"new"
    write_whole(Path(os.devnull), b"new")
    assert not Path(os.devnull).is_file()
