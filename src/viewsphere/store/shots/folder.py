"""The store's folder: finished shots and models, each written to a scratch folder and moved into place when complete."""

from __future__ import annotations

import hashlib
import json
from collections import defaultdict
from collections.abc import Generator, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from viewsphere.errors import StoreError
from viewsphere.files import read_bytes, read_text
from viewsphere.labels import channels
from viewsphere.model.fields.files import Files
from viewsphere.model.sample import Sample
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing
from viewsphere.scratch import lives
from viewsphere.store.index import Index, Row
from viewsphere.store.paths import file_inside
from viewsphere.store.places import place_of
from viewsphere.store.places.local import NEW, disk_errors
from viewsphere.store.samples.channel_files import encode
from viewsphere.store.shots.heartbeat import Heartbeat, HeartbeatWriter
from viewsphere.store.shots.manifest import MANIFEST, Manifest, refuse_another
from viewsphere.store.shots.moving import move
from viewsphere.store.shots.records import ModelInfo, OtherStoreError, PlanRecord
from viewsphere.store.shots.sample_records import short_sample, whole_sample
from viewsphere.store.shots.shot_files import ShotFiles
from viewsphere.store.texts import parsed
from viewsphere.validation.errors import different, first_of
from viewsphere.validation.quantity import first_few

RUN = "run.json"
"""File name of a run's heartbeat in its scratch folder; it is removed with that folder."""


@dataclass(frozen=True)
class _Gap:
    """The missing rows of a part, or of the channels that it adds to other parts.
    `first`: the first missing row.
    `shots` and `frames`: the numbers of missing shots and frames.
    `of`: the number of all frames.
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
        self.place = place_of(root)
        self.folder = root / "store"

    @property
    def plan_file(self) -> Path:
        """The path of the plan."""
        return self.folder / "plan.json"

    def plan(self) -> PlanRecord:
        """The plan of this store; raises StoreError if it is missing or unreadable."""
        if self.root.is_file():
            raise StoreError(
                f"{self.root}: expected a folder that `render` wrote; found a file: if it is a recipe, render it first "
                f"(viewsphere render {self.root} -o FOLDER)"
            )
        try:
            return PlanRecord.from_json(read_text(self.plan_file, "MAX_RECORD_BYTES"))
        except FileNotFoundError:
            if not self.root.exists():
                raise StoreError(
                    f"{self.root}: expected a folder that render wrote; found no such folder: check the path"
                ) from None
            raise StoreError(f"{self.root}: expected a data set (store/plan.json), found none: render one first") from None
        except OtherStoreError as error:
            raise StoreError(f"{self.root}: {error}") from None
        except (KeyError, TypeError, ValueError, OSError) as error:
            raise StoreError(f"{self.plan_file}: expected a readable plan, found {type(error).__name__}: {error}") from None

    def open_for(self, plan: PlanRecord) -> None:
        """Prepare the folder for this plan, or continue a folder of the same plan.

        Another recipe's plan is replaced while none of its frames is finished and no run is active, so that you can correct a
        recipe and try again. Raises StoreError if the folder cannot be written, holds another recipe's data, or files that
        viewsphere did not make.
        """
        self._refuse_strangers()
        self.make_ready()
        with self.locked():
            if self.plan_file.exists():
                if self.place.is_begun():
                    self._refuse_other(plan)
                    return
                if not self._is_of(plan):
                    self.place.remove(self.folder / "models")
                    self.forget_failures()
            self._write_atomically(self.plan_file, plan.to_json())

    @contextmanager
    def opened_for(self, plan: PlanRecord) -> Generator[Path]:
        """`open_for`, then `occupied`, without another run in between."""
        self._refuse_strangers()
        self.make_ready()
        with ExitStack() as stack:
            with self.locked():
                self.open_for(plan)
                occupied_folder = stack.enter_context(self.occupied())
            yield occupied_folder

    def occupied(self) -> AbstractContextManager[Path]:
        """Show other runs that this one is active, by a scratch folder of this machine during the block. Its end also removes
        the remains of dead workers.
        """
        return self.place.occupied()

    def locked(self) -> AbstractContextManager[None]:
        """Keep other runs from changing shared files (plan, left-out models and shots, credits) during the block, where the
        place supports that. Blocks may be nested; a lock ends with its process.
        """
        return self.place.locked()

    @contextmanager
    def telling(self, own: Path, shard: tuple[int, int]) -> Generator[HeartbeatWriter]:
        """Announce a run of this shard during the block, in the folder from `occupied`.

        If one of several shards fails, a note with the reason stays until this shard is rendered again, or all is finished.
        """
        note = self._failed / f"{shard[0]}-of-{shard[1]}.json"
        with HeartbeatWriter(lambda text: self._tell(own, text), shard) as pulse:
            note.unlink(missing_ok=True)
            try:
                yield pulse
            except Exception as error:
                if shard[1] > 1:
                    self._note_failure(note, pulse.note(str(error) or type(error).__name__))
                raise

    def _note_failure(self, note: Path, text: str) -> None:
        with suppress(OSError, StoreError):  # the error itself is reported
            self._write_atomically(note, text)

    def _tell(self, own: Path, text: str) -> None:
        with disk_errors(self.root):
            (own / NEW).write_text(text, "utf-8", newline="\n")
            move(own / NEW, own / RUN)

    def heartbeats(self) -> tuple[tuple[Heartbeat, bool | None], ...]:
        """Return the last report of each active run, and whether the run is alive, None if unknown. Dead runs are included
        while their remains are not removed.
        """
        files = sorted((self.folder / "writing").glob(f"*/{RUN}"))
        return tuple((heartbeat_, lives(file.parent)) for file in files if (heartbeat_ := Heartbeat.read(file)))

    def failures(self) -> tuple[Heartbeat, ...]:
        """Return the last reports of failed runs that have not been tried again since."""
        return tuple(filter(None, map(Heartbeat.read, sorted(self._failed.glob("*.json")))))

    def forget_failures(self) -> None:
        """Remove the notes of runs that failed."""
        self.place.remove(self._failed)

    @property
    def _failed(self) -> Path:
        return self.folder / "failed"

    def save(self, plan: PlanRecord) -> None:
        """Replace the stored plan by one that continues it."""
        self._write_atomically(self.plan_file, plan.to_json())

    def gaps(self, plan: PlanRecord, finished: Sequence[str] | None = None) -> Iterator[_Gap]:
        """Yield the gaps of each part and of the channels that it adds, except for rows left out at the user's request.

        `finished`: the shots that count as finished, by default all finished ones.
        The time depends on the number of finished shots, not of planned ones.
        """
        skipped, finished = self.skipped().keys(), tuple(self.finished()) if finished is None else finished
        alike: defaultdict[tuple[int, bool], list[Index]] = defaultdict(list)
        for number, index in enumerate(plan.all_indices):
            alike[index.part, number >= len(plan.indices)].append(index)
        for (part, is_added), indices in alike.items():
            left_out = {key: count for key, subject, count in _held(indices, skipped) if subject not in skipped}
            there = {key: count for key, subject, count in _held(indices, finished) if not {key, subject} & skipped}
            shots = sum(len(index) - sum(map(index.count_of, skipped)) for index in indices) - len(left_out)
            frames = sum(index.samples - sum(map(index.samples_of, skipped)) for index in indices) - sum(left_out.values())
            if len(there) < shots:
                rows = chain.from_iterable(index.without(skipped) for index in indices)
                first = next((row for row in rows if row.key not in there and row.key not in left_out), None)
                if first is None:
                    raise StoreError(f"{self.plan_file}: expected a plan that names each shot once, found one with some twice")
                lost = frames - sum(there.values())
                yield _Gap(part, is_added, first, shots - len(there), lost, frames)

    def finished(self) -> Iterator[str]:
        """Keys of all finished shots, in no order."""
        return self.place.finished()

    def wanted(self, plan: PlanRecord) -> Iterator[Row]:
        """The shots of a plan, without those left out at the user's request; shots that add channels come last."""
        skipped = self.skipped().keys()
        rows = chain.from_iterable(index.without(skipped) for index in plan.all_indices)
        return (row for row in rows if row.key not in skipped)

    def drop_unnamed_models(self) -> None:
        """Remove the models that the plan does not name, unless another run is using them."""
        with self.locked():
            if self.place.others_at_work():
                return
            named = set(self.plan().models)
            for folder in (self.folder / "models").glob("*"):
                if folder.name not in named:
                    self.place.remove(folder)

    def make_ready(self) -> None:
        """Check that the folder can be written, and remove the remains of dead runs; raises StoreError if it cannot."""
        self.place.make()

    def _refuse_strangers(self) -> None:
        """Raise StoreError for a folder with files that viewsphere did not make."""
        if not self.plan_file.exists() and self.place.is_foreign():
            raise StoreError(f"{self.root}: expected an empty or new folder, found other files: choose another output folder")

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
            if not differing:
                raise StoreError(f"{self.root}: {_other_files(found.models, plan.models)}")
            what = f"another in {', '.join(differing)}"
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

    def _write_atomically(self, file: Path, text: str) -> None:
        with self.place.scratch_folder() as scratch:
            (scratch / NEW).write_text(text, "utf-8", newline="\n")
            self.place.put(scratch / NEW, file)

    def shot_folder(self, key: str) -> Path:
        """Return the folder of a finished shot."""
        return self.folder / "shots" / hashlib.sha256(key.encode()).hexdigest()[:2] / key

    def channel_file(self, key: str, channel: str, sample: int, kinds: Files | None = None) -> str:
        """Return the path of a sample's channel in a finished shot, with the file type from `kinds`, relative to the data set's
        root.
        """
        return f"{self.shot_folder(key).relative_to(self.root).as_posix()}/{_channel_path(channel, sample, kinds)}"

    def channel_files(self, key: str, shot: Shot) -> tuple[tuple[str, str, str], ...]:
        """Return the file names of a finished shot's channels.
        Each entry is the channel, the text before a sample's number of eight digits, and the text after it.
        """
        folder, table = self.shot_folder(key).relative_to(self.root).as_posix(), channels()
        return tuple((name, f"{folder}/{name}/", shot.files.suffix(table[name])) for name in shot.channels)

    def model_folder(self, key: str) -> Path:
        """Return the folder of a normalised model."""
        return self.folder / "models" / key

    def has_shot(self, key: str) -> bool:
        """Return whether this shot is finished: its manifest, written last, is there."""
        return (self.shot_folder(key) / MANIFEST).is_file()

    @contextmanager
    def scratch_folder(self, target: Path, again: bool = False) -> Generator[Path]:
        """A folder to write into that becomes `target` if the block succeeds, and is removed otherwise. Its manifest is written
        last.

        If another writer finished the same target first, that folder stays: both hold the same bytes. With `again`, the new
        folder replaces a damaged one; raises StoreError if it differs from the known original content.
        """
        with self.place.scratch_folder() as scratch:
            folder = scratch / NEW
            folder.mkdir()
            yield folder
            if not (folder / MANIFEST).is_file():
                Manifest.from_folder(folder).write(folder)
            if again and target.is_dir():
                refuse_another(target, folder)
                self.place.replace(folder, target)
            else:
                self.place.put(folder, target)

    @contextmanager
    def replacing(self, target: Path) -> Generator[Path]:
        """A folder to write into that replaces `target` if the block succeeds; a model's folder gets a manifest. The old folder
        is never lost: if a run dies between the two moves, the next run puts it back.
        """
        if target == self.folder:
            raise StoreError(f"{target}: expected a format's name, found the store's")
        with self.place.scratch_folder() as scratch:
            folder = scratch / NEW
            folder.mkdir()
            yield folder
            if target.parent == self.folder / "models":
                Manifest.from_folder(folder).write(folder)
            self.place.replace(folder, target)

    def write_file(self, name: str, text: str) -> None:
        """Write a small file of the store in one step."""
        self._write_atomically(self.folder / name, text)

    def write_beside(self, name: str, text: str) -> None:
        """Write a small file of the data set's root in one step."""
        self._write_atomically(self.root / name, text)

    def skipped(self) -> dict[str, str]:
        """Models and shots left out at the user's request, and the reasons; raises StoreError if the list is unreadable."""
        file = file_inside(self.root, "store/skipped.json")
        try:
            found: dict[Any, Any] = parsed(read_bytes(file, "MAX_RECORD_BYTES"))
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
        painter: str = "",
    ) -> int:
        """Write all frames of a shot, with the channels their samples hold; return their number.

        `scenery`, if any, is a text that describes the scenery that is not an object; `kinds` are the default kinds of files.
        Other facts of the `shot` are stored, so that its scene can be made again; `painter` as for `Manifest`.
        """
        target = self.shot_folder(key)
        prefix = target.relative_to(self.root).as_posix()
        records: list[dict[str, Any]] = []
        kinds, table = kinds or Files(), channels()
        channels_of_sensor = (
            {} if shot is None else {sensor.name: sensor.kept_channels(shot.channels) for sensor in shot.rig.sensors}
        )
        with self.scratch_folder(target, again) as folder, ShotFiles(folder, kinds, painter) as put:
            for sample in samples:
                files: dict[str, str] = {}
                for name, array in sample.channels.items():
                    inside = _channel_path(name, sample.index, kinds)
                    put.add(inside, encode(table[name], array, kinds))
                    files[name] = f"{prefix}/{inside}"
                short = channels_of_sensor.get(sample.sensor) == tuple(files) and shot is not None and shot.files == kinds
                records.append(short_sample(sample) if short else whole_sample(replace(sample, files=files)))
            lines = (json.dumps(r, separators=(",", ":"), allow_nan=False) for r in records)
            text = "[\n" + ",\n".join(lines) + "\n]\n"
            (folder / "frames.json").write_text(text, "utf-8", newline="\n")
            if scenery:
                (folder / "scenery.json").write_text(scenery, "utf-8", newline="\n")
            if shot is not None:
                (folder / "shot.json").write_text(kept_shot(shot).model_dump_json(), "utf-8", newline="\n")
        return len(records)

    def labelled(self, key: str) -> Shot | None:
        """A finished shot with its labelled things; None if they are unknown. Raises StoreError if it is unreadable."""
        file = self.shot_folder(key) / "shot.json"
        try:
            return Shot.model_validate_json(read_bytes(file, "MAX_RECORD_BYTES"))
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
        """The files that describe a finished shot's scene."""
        folder = self.shot_folder(key).relative_to(self.root).as_posix()
        files = (file_inside(self.root, f"{folder}/{name}") for name in ("scenery.json", "shot.json"))
        return [file for file in files if file.is_file()]

    def scenery(self, key: str) -> str:
        """The scenery text of a shot, as given to `write_shot`; empty if none."""
        try:
            return read_text(self.shot_folder(key) / "scenery.json", "MAX_RECORD_BYTES")
        except FileNotFoundError:
            return ""

    def write_model_info(self, folder: Path, info: ModelInfo) -> None:
        """Write model.json into the unfinished folder of a model."""
        (folder / "model.json").write_text(json.dumps(info.to_plain(), indent=1), "utf-8", newline="\n")

    def model_info(self, key: str) -> ModelInfo | None:
        """Return the metadata of a finished model; None if it is absent, StoreError if it is unreadable."""
        file = file_inside(self.root, (self.model_folder(key) / "model.json").relative_to(self.root).as_posix())
        try:
            info = ModelInfo.from_plain(parsed(read_bytes(file, "MAX_RECORD_BYTES")))
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


def kept_shot(shot: Shot) -> Shot:
    """The shot as stored in shot.json: without the things of scenery.json, and with the motions that labels depend on."""
    exposures = shot.exposures if shot.rig.rolls else ()
    return shot.model_copy(update={"things": shot.objects, "shutter": 0.0, "exposures": exposures})


def _no_scene(file: Path, error: Exception) -> StoreError:
    problem = first_of(error) if isinstance(error, ValidationError) else error
    return StoreError(
        f"{file}: expected the scene of a shot, found {type(error).__name__}: {problem}: delete {file.parent} and render again"
    )


def new_folder(target: Path) -> AbstractContextManager[Path]:
    """A folder to write into that becomes `target` if the block succeeds; raises StoreError if `target` has files."""
    return place_of(target).new()


def _channel_path(channel: str, sample: int, kinds: Files | None = None) -> str:
    """Return the path in its shot's folder of a sample's channel (by its number in the data set), with the file type from
    `kinds`.
    """
    return f"{channel}/{sample:08d}{(kinds or Files()).suffix(channels()[channel])}"


def _held(indices: Iterable[Index], keys: Iterable[str]) -> Iterator[tuple[str, str, int]]:
    """Key, subject and number of samples of the shots with these keys in some indices."""
    return chain.from_iterable(index.held(keys) for index in indices)


def _other_files(then: Sequence[str], now: Sequence[str]) -> str:
    """The problem and its fix; `then` and `now` are the keys of a data set's models and of the recipe's."""
    gone, new = _without(then, now), _without(now, then)
    if gone:
        are, them = ("is", "it") if len(gone) == 1 else ("are", "them")
        what = f"with other model files: {first_few(gone)} {are} not in the recipe any more. Restore {them}"
    elif new:
        what = f"without {first_few(new)}. Add {'it' if len(new) == 1 else 'them'} with --append"
    else:
        what = "with other files: pictures, poses or scripts that the recipe names. Restore them, add with --append"
    return f"this folder was rendered {what}, or choose another output folder"


def _without(some: Sequence[str], others: Sequence[str]) -> list[str]:
    left = set(others)
    return [f"`{key}`" for key in some if key not in left]
