"""The store's folder: finished shots and models, each written aside and renamed when whole."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import socket
from collections import defaultdict
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from viewsphere.errors import StoreError
from viewsphere.labels import channels
from viewsphere.model.files import Files
from viewsphere.model.mistakes import different, first_of
from viewsphere.model.sample import Sample
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing
from viewsphere.store.channel_files import encode
from viewsphere.store.index import Index, Row
from viewsphere.store.manifest import MANIFEST, Manifest, Seal, digest, refuse_another, seal_of
from viewsphere.store.moving import move
from viewsphere.store.paths import file_inside
from viewsphere.store.records import ModelInfo, PlanRecord
from viewsphere.store.sample_records import short_sample, whole_sample
from viewsphere.store.texts import parsed

OLD_MODEL = "old model~"
"""Begins the name of a model's folder that another takes the place of."""


@dataclass(frozen=True)
class Gap:
    """What is missing of a part, or of the channels that it adds to other parts: its first missing row, how many shots and
    frames these are, and of how many frames.
    """

    part: int
    is_added: bool
    first: Row
    shots: int
    frames: int
    of: int


class Store:
    """The finished models and shots below OUT/store."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.folder = root / "store"

    @property
    def plan_file(self) -> Path:
        """Where the plan is kept."""
        return self.folder / "plan.json"

    def plan(self) -> PlanRecord:
        """The plan this store was made for; raises StoreError if there is none or it cannot be read."""
        if self.root.is_file():
            raise StoreError(
                f"{self.root}: expected a folder that `render` wrote; found a file: if it is a recipe, render it first "
                f"(viewsphere render {self.root} -o FOLDER)"
            )
        try:
            return PlanRecord.from_json(self.plan_file.read_text("utf-8"))
        except FileNotFoundError:
            if not self.root.exists():
                raise StoreError(
                    f"{self.root}: expected a folder that render wrote; found no such folder: check the path"
                ) from None
            raise StoreError(f"{self.root}: expected a data set (store/plan.json), found none: render one first") from None
        except (KeyError, TypeError, ValueError, OSError) as error:
            raise StoreError(f"{self.plan_file}: expected a readable plan, found {type(error).__name__}: {error}") from None

    def open_for(self, plan: PlanRecord) -> None:
        """Make the folder ready for this plan, or find it half done by the same one.

        Another recipe's plan gives way while none of its frames is finished and nobody works on them, so that a recipe
        can be mended and tried again. Raises StoreError if the folder cannot be written, holds another recipe's data, or
        files that viewsphere did not make.
        """
        writing = self.folder / "writing"
        known = self.plan_file.exists()
        if not known and self.root.is_dir() and any(self.root.iterdir()) and not writing.is_dir():
            raise StoreError(f"{self.root}: expected an empty or new folder, found other files: choose another output folder")
        self.make_ready()
        if known:
            if any(writing.iterdir()) or any((self.folder / "shots").glob("*/*")):
                self._refuse_other(plan)
                return
            if not self._is_of(plan):
                shutil.rmtree(self.folder / "models", ignore_errors=True)
        self._write_atomically(self.plan_file, plan.to_json())

    @contextmanager
    def occupied(self) -> Generator[None]:
        """Show other runs that this one is at work, as long as the block lasts."""
        sign = self.folder / "writing" / f"{_writer()}run"
        with _disk_errors(self.root):
            sign.touch()
        try:
            yield
        finally:
            with suppress(OSError):
                sign.unlink(missing_ok=True)

    def save(self, plan: PlanRecord) -> None:
        """Put a plan in the place of the one that it continues."""
        self._write_atomically(self.plan_file, plan.to_json())

    def gaps(self, plan: PlanRecord) -> Iterator[Gap]:
        """What is missing of each part and of the channels that it adds, but for what was left out at the user's wish.

        Takes as long as shots are finished, however many are planned.
        """
        skipped, finished = self.skipped().keys(), tuple(self.finished())
        alike: defaultdict[tuple[int, bool], list[Index]] = defaultdict(list)
        for number, index in enumerate(plan.all_indices):
            alike[index.part, number >= len(plan.indices)].append(index)
        for (part, is_added), indices in alike.items():
            left_out = [row for row in _found(indices, skipped) if row.subject not in skipped]
            there = [row for row in _found(indices, finished) if not {row.key, row.subject} & skipped]
            shots = sum(len(index) - sum(map(index.count_of, skipped)) for index in indices) - len(left_out)
            frames = sum(index.samples - sum(map(index.samples_of, skipped)) for index in indices)
            frames -= sum(row.count for row in left_out)
            if len(there) < shots:
                known = {row.key for row in chain(left_out, there)}
                rows = chain.from_iterable(index.without(skipped) for index in indices)
                first = next(row for row in rows if row.key not in known)
                lost = frames - sum(row.count for row in there)
                yield Gap(part, is_added, first, shots - len(there), lost, frames)

    def finished(self) -> Iterator[str]:
        """Keys of all shots that are there, in no order."""
        with suppress(FileNotFoundError):
            for group in os.scandir(self.folder / "shots"):
                shots = os.scandir(group.path)
                yield from (shot.name for shot in shots if os.path.exists(f"{shot.path}/{MANIFEST}"))  # noqa: PTH110

    def wanted(self, plan: PlanRecord) -> Iterator[Row]:
        """The shots of a plan, those with channels that were added later last, but for what was left out at the user's wish."""
        skipped = self.skipped().keys()
        rows = chain.from_iterable(index.without(skipped) for index in plan.all_indices)
        return (row for row in rows if row.key not in skipped)

    def drop_unnamed_models(self) -> None:
        """Remove the models that the plan does not name, unless another run is at work on them."""
        own = _writer()
        if any(not path.name.startswith(own) for path in (self.folder / "writing").iterdir()):
            return
        named = set(self.plan().models)
        for folder in (self.folder / "models").glob("*"):
            if folder.name not in named:
                shutil.rmtree(folder, ignore_errors=True)

    def make_ready(self) -> None:
        """See that the folder can be written, and clear what dead runs left; raises StoreError if it cannot."""
        self._make(self.folder / "writing")
        self._sweep()

    def _is_of(self, plan: PlanRecord) -> bool:
        try:
            found = self.plan()
        except StoreError:
            return False
        return (found.digest, found.version) == (plan.digest, plan.version)

    def _refuse_other(self, plan: PlanRecord) -> None:
        found = self.plan()
        if found.digest != plan.digest:
            differing = different(found.recipe, plan.recipe)
            what = f"another in {', '.join(differing)}" if differing else "one whose files have other names"
            raise StoreError(
                f"{self.root}: expected data of recipe {plan.name!r} (digest {plan.digest[:12]}), found that of "
                f"{found.name!r} ({found.digest[:12]}), {what}: choose another output folder, add to it with --append, or "
                "delete it"
            )
        if found.version != plan.version:
            raise StoreError(
                f"{self.root}: expected data made by viewsphere {plan.version}, found {found.version}: "
                "install that version to go on, or choose another output folder"
            )

    def _make(self, folder: Path) -> None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise StoreError(f"{self.root}: expected a writable output folder, found {error.strerror or error}") from None
        if not os.access(folder, os.W_OK):
            raise StoreError(f"{self.root}: expected a writable output folder, found one that cannot be written")

    def _write_atomically(self, file: Path, text: str) -> None:
        aside = self.folder / "writing" / f"{_writer()}{file.name}"
        with _disk_errors(self.root):
            aside.write_text(text, "utf-8", newline="\n")
            move(aside, file)

    def _sweep(self) -> None:
        """Remove what dead writers of this machine left unfinished; models that they were about to replace come back."""
        for left in (self.folder / "writing").glob(f"*~{OLD_MODEL}*"):
            target = self.model_folder(left.name.partition(f"~{OLD_MODEL}")[2])
            if not target.exists() and _is_of_dead(left):
                move(left, target)
        _remove_of_dead((self.folder / "writing").iterdir())

    def shot_folder(self, key: str) -> Path:
        """Where a finished shot lies."""
        return self.folder / "shots" / hashlib.sha256(key.encode()).hexdigest()[:2] / key

    def channel_file(self, key: str, channel: str, sample: int, kinds: Files | None = None) -> str:
        """Where a finished shot's channel of a sample, written as `kinds` say, lies; relative to the data set's root."""
        return f"{self.shot_folder(key).relative_to(self.root).as_posix()}/{channel_path(channel, sample, kinds)}"

    def channel_files(self, key: str, shot: Shot) -> tuple[tuple[str, str, str], ...]:
        """How the files of a finished shot's channels are called: the channel, what comes before a sample's number of eight
        digits, and what after it.
        """
        folder, table = self.shot_folder(key).relative_to(self.root).as_posix(), channels()
        return tuple((name, f"{folder}/{name}/", shot.files.suffix(table[name])) for name in shot.channels)

    def model_folder(self, key: str) -> Path:
        """Where a normalised model lies."""
        return self.folder / "models" / key

    def has_shot(self, key: str) -> bool:
        """Whether this shot is finished: its manifest, written last, is there."""
        return (self.shot_folder(key) / MANIFEST).is_file()

    @contextmanager
    def aside(self, target: Path, again: bool = False) -> Generator[Path]:
        """A folder to write into that becomes `target` when the block ends well, and is removed when it does not. The last file
        in it is the manifest.

        If another writer finished the same target first, that one stays: both hold the same bytes. With `again` it takes the
        place of a damaged one; raises StoreError where it is not equal to what that was before, as far as that is known.
        """
        folder = self.folder / "writing" / f"{_writer()}{target.name}"
        with _disk_errors(self.root):
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir(parents=True)
        try:
            with _disk_errors(self.root):
                yield folder
                if not (folder / MANIFEST).is_file():
                    Manifest.of(folder).write(folder)
                target.parent.mkdir(parents=True, exist_ok=True)
                if again and target.is_dir():
                    refuse_another(target, folder)
                    self._replace(folder, target)
                else:
                    _become(folder, target)
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def _replace(self, folder: Path, target: Path) -> None:
        """Put a folder in the place of another, which is removed."""
        is_model = target.parent == self.folder / "models"
        old = self.folder / "writing" / f"{_writer()}{OLD_MODEL if is_model else 'old~'}{target.name}"
        shutil.rmtree(old, ignore_errors=True)
        if target.exists():
            move(target, old)
        move(folder, target)
        shutil.rmtree(old, ignore_errors=True)

    @contextmanager
    def replacing(self, target: Path) -> Generator[Path]:
        """A folder to write into that takes the place of `target` when the block ends well. A model's gets a manifest, and is
        never lost: where a run dies between the two, the next one puts the old folder back.
        """
        if target == self.folder:
            raise StoreError(f"{target}: expected a format's name, found the store's")
        self._make(self.folder / "writing")
        folder = self.folder / "writing" / f"{_writer()}{target.name}"
        with _disk_errors(self.root):
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
        try:
            with _disk_errors(self.root):
                yield folder
                if target.parent == self.folder / "models":
                    Manifest.of(folder).write(folder)
                self._replace(folder, target)
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def write_file(self, name: str, text: str) -> None:
        """Write a small file of the store in one step."""
        self._write_atomically(self.folder / name, text)

    def write_beside(self, name: str, text: str) -> None:
        """Write a small file of the data set's root in one step."""
        self._write_atomically(self.root / name, text)

    def skipped(self) -> dict[str, str]:
        """Models and shots that were left out at the user's wish, and why; raises StoreError if that cannot be read."""
        file = file_inside(self.root, "store/skipped.json")
        try:
            found: dict[Any, Any] = parsed(file.read_bytes())
            if not isinstance(found, dict) or not all(isinstance(text, str) for text in found.values()):
                raise ValueError("no object of texts")
            return found
        except FileNotFoundError:
            return {}
        except (OSError, ValueError) as error:
            raise StoreError(
                f"{file}: expected what was left out and why, found {error}: delete it, and render again"
            ) from None

    def write_shot(
        self,
        key: str,
        samples: Iterable[Sample],
        scenery: str = "",
        kinds: Files | None = None,
        shot: Shot | None = None,
        again: bool = False,
    ) -> int:
        """Write all frames of a shot, with the channels their samples hold; gives their number. `again` as for `aside`.

        `scenery`, if any, is a text that says what stands there that is no object; `kinds` of files are the default ones.
        What is known of the `shot` besides is kept for those who make its scene anew.
        """
        target = self.shot_folder(key)
        prefix = target.relative_to(self.root).as_posix()
        records: list[dict[str, Any]] = []
        made: set[str] = set()
        told: dict[str, Seal] = {}
        kinds, table = kinds or Files(), channels()
        own = {} if shot is None else {sensor.name: sensor.kept(shot.channels) for sensor in shot.rig.sensors}
        with self.aside(target, again) as folder:
            for sample in samples:
                files: dict[str, str] = {}
                for name, array in sample.channels.items():
                    inside = channel_path(name, sample.index, kinds)
                    if name not in made:
                        (folder / name).mkdir()
                        made.add(name)
                    data = encode(table[name], array, kinds)
                    if inside in told:
                        raise ValueError(f"shot {key}: expected samples of different numbers, found {sample.index} twice")
                    told[inside] = len(data), digest(data)
                    _write(f"{folder}/{inside}", data)
                    files[name] = f"{prefix}/{inside}"
                short = own.get(sample.sensor) == tuple(files) and shot is not None and shot.files == kinds
                records.append(short_sample(sample) if short else whole_sample(replace(sample, files=files)))
            lines = (json.dumps(r, separators=(",", ":"), allow_nan=False) for r in records)
            text = "[\n" + ",\n".join(lines) + "\n]\n"
            (folder / "frames.json").write_text(text, "utf-8", newline="\n")
            if scenery:
                (folder / "scenery.json").write_text(scenery, "utf-8", newline="\n")
            if shot is not None:
                # The other things are in scenery.json, and labels are those of the instant, not of what moves around it.
                labelled = shot.model_copy(update={"things": shot.objects, "shutter": 0.0, "exposures": ()})
                (folder / "shot.json").write_text(labelled.model_dump_json(), "utf-8", newline="\n")
            texts = {path.name: seal_of(path) for path in sorted(folder.glob("*.json"))}
            Manifest(texts | told).write(folder)
        return len(records)

    def labelled(self, key: str) -> Shot | None:
        """A finished shot with what is labelled of its things; None where that is not known. Raises StoreError if it cannot be
        read.
        """
        file = self.shot_folder(key) / "shot.json"
        try:
            return Shot.model_validate_json(file.read_bytes())
        except FileNotFoundError:
            return None
        except (OSError, ValueError) as error:
            raise _no_scene(file, error) from None

    def shot(self, key: str) -> Shot | None:
        """A finished shot as it was rendered, otherwise as `labelled`."""
        shot, file = self.labelled(key), self.shot_folder(key) / "scenery.json"
        try:
            scenery = parsed(self.scenery(key) or '{"things": []}')["things"]
            around = tuple(Thing.model_validate(thing) for thing in scenery)
        except (OSError, LookupError, TypeError, ValueError) as error:
            raise _no_scene(file, error) from None
        return shot and shot.model_copy(update={"things": (*shot.things, *around)})

    def known_of(self, key: str) -> list[Path]:
        """The files that say what a finished shot's scene was."""
        folder = self.shot_folder(key).relative_to(self.root).as_posix()
        files = (file_inside(self.root, f"{folder}/{name}") for name in ("scenery.json", "shot.json"))
        return [file for file in files if file.is_file()]

    def scenery(self, key: str) -> str:
        """The text that `write_shot` was given of a shot's scenery; empty if none."""
        try:
            return (self.shot_folder(key) / "scenery.json").read_text("utf-8")
        except FileNotFoundError:
            return ""

    def write_model_info(self, folder: Path, info: ModelInfo) -> None:
        """Write model.json into a model's folder that is being made."""
        (folder / "model.json").write_text(json.dumps(info.to_plain(), indent=1), "utf-8", newline="\n")

    def model_info(self, key: str) -> ModelInfo | None:
        """What is known of a finished model; None if it is not there, StoreError if it cannot be read."""
        file = file_inside(self.root, (self.model_folder(key) / "model.json").relative_to(self.root).as_posix())
        try:
            info = ModelInfo.from_plain(parsed(file.read_bytes()))
            if info.key != key:
                raise ValueError(f"model {info.key!r:.100}")
            return info
        except FileNotFoundError:
            return None
        except (OSError, LookupError, TypeError, ValueError) as error:
            raise StoreError(
                f"{file}: expected what is known of a model, found {type(error).__name__}: {error}: "
                f"delete {file.parent} and render again"
            ) from None


def _no_scene(file: Path, error: Exception) -> StoreError:
    problem = first_of(error) if isinstance(error, ValidationError) else error
    return StoreError(
        f"{file}: expected the scene of a shot, found {type(error).__name__}: {problem}: delete {file.parent} and render again"
    )


def _remove_of_dead(paths: Iterable[Path]) -> None:
    """Remove those that were written by processes of this machine that are no more."""
    for path in filter(_is_of_dead, paths):
        shutil.rmtree(path, ignore_errors=True)
        path.unlink(missing_ok=True)


def _is_of_dead(path: Path) -> bool:
    """Whether its name says that a process of this machine wrote it that is no more."""
    host, _, rest = path.name.partition("~")
    pid = rest.partition("~")[0]
    return host == socket.gethostname() and pid.isdigit() and not _alive(int(pid))


@contextmanager
def new_folder(target: Path) -> Generator[Path]:
    """A folder to write into that becomes `target` when the block ends well; raises StoreError where files lie there."""
    aside = target.with_name(f"{_writer()}{target.name}")
    missing = [parent for parent in aside.parents if not parent.exists()]
    with _disk_errors(target):
        if target.exists() and (not target.is_dir() or any(target.iterdir())):
            raise StoreError(f"{target}: expected an empty or new folder, found other files: choose another, or delete it")
        shutil.rmtree(aside, ignore_errors=True)
        aside.mkdir(parents=True)
        _remove_of_dead(path for path in aside.parent.iterdir() if path.name.endswith(f"~{target.name}"))
    try:
        with _disk_errors(target):
            yield aside
            if target.exists():
                target.rmdir()
            move(aside, target)
    finally:
        shutil.rmtree(aside, ignore_errors=True)
        for parent in missing:
            with suppress(OSError):  # something is in it
                parent.rmdir()


def channel_path(channel: str, sample: int, kinds: Files | None = None) -> str:
    """Where a channel of a sample (its number in the data set), written as `kinds` say, lies in its shot's folder."""
    return f"{channel}/{sample:08d}{(kinds or Files()).suffix(channels()[channel])}"


def _write(file: str, data: bytes) -> None:
    """Write a new file; Python's own file objects take as long again as the disk does for a small one."""
    descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | getattr(os, "O_BINARY", 0), 0o666)
    try:
        left = memoryview(data)
        while left:
            left = left[os.write(descriptor, left) :]
    finally:
        os.close(descriptor)


def _writer() -> str:
    return f"{socket.gethostname()}~{os.getpid()}~"


def _become(folder: Path, target: Path) -> None:
    try:
        if target.is_dir() and not (target / MANIFEST).is_file():
            shutil.rmtree(target)
        move(folder, target)
    except OSError:
        if not target.is_dir():
            raise


def _alive(pid: int) -> bool:
    if pid == os.getpid():
        return True
    if os.name == "nt":  # where os.kill would end the process
        return _alive_on_windows(pid)
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def _alive_on_windows(pid: int) -> bool:
    """Whether a process runs: it can be opened, and has no exit code yet (OpenProcess, GetExitCodeProcess of kernel32)."""
    import ctypes

    kernel: Any = getattr(ctypes, "windll").kernel32  # noqa: B009, not in the stubs of other systems
    query, denied, running = 0x1000, 5, 259
    handle = kernel.OpenProcess(query, False, pid)
    if not handle:
        return kernel.GetLastError() == denied
    try:
        code = ctypes.c_ulong()
        return not kernel.GetExitCodeProcess(handle, ctypes.byref(code)) or code.value == running
    finally:
        kernel.CloseHandle(handle)


@contextmanager
def _disk_errors(root: Path) -> Generator[None]:
    """Say in one line what the disk refused; what is finished stays."""
    try:
        yield
    except OSError as error:
        raise StoreError(f"{root}: expected to write, found: {error.strerror or error}; what is finished is kept") from error


def _found(indices: Iterable[Index], keys: Iterable[str]) -> list[Row]:
    """The rows of these keys in some indices."""
    return [row for index in indices for row in map(index.find, keys) if row is not None]
