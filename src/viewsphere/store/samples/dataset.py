"""The data set that a store's finished shots form."""

from __future__ import annotations

import os
from array import array
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial
from itertools import chain
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any, Self, overload

from numpy.typing import NDArray
from pydantic import TypeAdapter

from viewsphere.errors import StoreError, UserError
from viewsphere.files import read_bytes
from viewsphere.labels import channels
from viewsphere.model.annotations.classes import SemanticClass
from viewsphere.model.fields.files import Files
from viewsphere.model.fields.notebook import Shown
from viewsphere.model.model_spec import step_key
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.model.sensors.rig import CAMERA
from viewsphere.model.shot import Shot
from viewsphere.store.foreign import Loaded
from viewsphere.store.index import Row
from viewsphere.store.paths import file_inside, files_inside, names
from viewsphere.store.samples.channel_files import decode
from viewsphere.store.samples.choice import Choice
from viewsphere.store.samples.point_tracks import PointTracks, joined
from viewsphere.store.samples.seam_pieces import cut_at_seam
from viewsphere.store.samples.selection import Selection, check_fields
from viewsphere.store.shots.folder import Store
from viewsphere.store.shots.manifest import MANIFEST, Manifest
from viewsphere.store.shots.records import Category, ModelInfo, typed
from viewsphere.store.shots.sample_records import ShotRecords, from_whole_sample
from viewsphere.store.texts import parsed
from viewsphere.urls import here, link_file, located
from viewsphere.validation.errors import one_of
from viewsphere.validation.quantity import quantity

if TYPE_CHECKING:
    from viewsphere.assets.mesh import Mesh
    from viewsphere.model.annotations.voxels import Occupancy


Options = Mapping[str, Mapping[str, Any]]
"""Options of labels, by their names."""


class Dataset(Shown, Sequence[Sample]):
    """The finished frames of a data set, in frame order; returned by `viewsphere.open`.

    `len`, indexing and iteration return samples, which read their channels on access. `link`, `put` and `path` are for
    exporters.

    Args:
        root: Folder or URL of the data set.
        choice: The models and frames that the data set has; None: all.

    Raises:
        StoreError: There is no data set, or its plan is broken.

    Attributes:
        root: Folder of the data set.
        choice: The chosen models and frames.
        store: The folder's store of finished shots.
        plan: The stored plan.
    """

    def __init__(self, root: str | os.PathLike[str], choice: Choice | None = None) -> None:
        self.root = located(root)
        self.choice = choice or Choice()
        self.store = Store(self.root)
        self.plan = self.store.plan()
        self.link_kinds: set[str] = set()
        self.made = _Made()
        self._records = lru_cache(maxsize=8)(self._read_records)
        self._manifests = lru_cache(maxsize=8)(partial(_manifest_of, self.root))
        self._info = lru_cache(maxsize=10_000)(self.store.model_info)
        self._options = lru_cache(maxsize=8)(self._options_of)
        self._facts = lru_cache(maxsize=10_000)(self._model_facts)

    def __repr__(self) -> str:
        return f"<Dataset {self.name} in {self.root}: {quantity(len(self), 'frame')}; {', '.join(self.plan.channels)}>"

    def __reduce__(self) -> tuple[type[Dataset], tuple[Path, Choice]]:
        """A data set travels to other processes (data loaders) as its folder."""
        return type(self), (self.root, self.choice)

    @property
    def name(self) -> str:
        """The recipe's name."""
        return self.plan.name

    @property
    def recipe(self) -> dict[str, Any]:
        """The recipe, normalised, as plain data."""
        return self.plan.recipe

    @property
    def categories(self) -> tuple[Category, ...]:
        """The categories of the plan."""
        return self.plan.categories

    @property
    def classes(self) -> tuple[SemanticClass, ...]:
        """The classes behind the numbers of `semantic` and `panoptic` maps, stuff first; `plan.json` lists them, too."""
        return self.plan.classes

    @property
    def splits(self) -> tuple[str, ...]:
        """Names of the splits, in the recipe's order."""
        return self.plan.splits

    @property
    def max_objects(self) -> int:
        """Most objects in one frame."""
        return self.plan.max_objects

    @cached_property
    def models(self) -> tuple[ModelInfo, ...]:
        """The finished models in the plan's order, time steps after their model; with a choice, only those of its frames."""
        stored = (self.store.model_info(key) for key in self.plan.models)
        infos = tuple(info for model in stored if model is not None for info in (model, *model.steps))
        if self.choice.is_some:
            seen = {o.key for sample in self for o in sample.objects}
            infos = tuple(info for info in infos if info.key in seen)
        return infos

    @cached_property
    def rows(self) -> tuple[Row, ...]:
        """The rows of all finished shots, chosen or not, in frame order, without shots that add channels to others."""
        keys = tuple(self.store.finished())
        rows = chain.from_iterable(index.rows_with_keys(keys) for index in self.plan.indices)
        return tuple(sorted(rows, key=lambda row: row.first))

    @cached_property
    def _shots(self) -> tuple[list[tuple[str, Sequence[int]]], list[int]]:
        """Key and chosen places of each finished shot, in frame order; and the number of frames before each shot."""
        shots: list[tuple[str, Sequence[int]]] = []
        starts, total = [0], 0
        for row in self.rows:
            places = self._places(row)
            if places:
                shots.append((row.key, places))
                total += len(places)
                starts.append(total)
        return shots, starts

    @cached_property
    def shots_of_parts(self) -> tuple[Shot | None, ...]:
        """A finished shot of each part. It is None for a part without stored shots, such as an imported one; a part without
        finished frames has another part's shot.
        """
        shots = {part: self.labelled(row.key) for part, row in self._first_rows.items()}
        some = next(iter(shots.values()), None)
        return tuple(shots.get(number, some) for number in range(len(self.plan.parts)))

    @property
    def samples_of_parts(self) -> Iterator[Iterator[Sample]]:
        """The finished pictures, chosen or not, of each part that has any."""
        for part in self._first_rows:
            rows = (row for row in self.rows if row.part == part)
            yield (self.sample_at(row.key, place) for row in rows for place in range(row.count))

    @cached_property
    def _first_rows(self) -> dict[int, Row]:
        """The first finished shot of each part."""
        first: dict[int, Row] = {}
        for row in self.rows:
            first.setdefault(row.part, row)
        return first

    def __len__(self) -> int:
        return self._shots[1][-1]

    @overload
    def __getitem__(self, index: int) -> Sample: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Sample]: ...
    def __getitem__(self, index: int | slice) -> Sample | Sequence[Sample]:
        """The i-th finished frame; raises IndexError past the end."""
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        i = index + len(self) if index < 0 else index
        if not 0 <= i < len(self):
            raise IndexError(f"{self.root}: expected a frame in 0..{len(self) - 1}, got {index}")
        shots, starts = self._shots
        number = bisect_right(starts, i) - 1
        key, places = shots[number]
        return self.sample_at(key, places[i - starts[number]])

    def __iter__(self) -> Iterator[Sample]:
        for key, places in self._shots[0]:
            yield from self.samples_of(key, places)

    def select(self, *fields: str, split: str | None = None, sensor: str | None = None) -> Selection:
        """Selected fields of frames: a map-style data set for PyTorch's DataLoader. Only the named fields are decoded.

        Fields of objects become arrays (N, ...), float64, int64 or bool, with NaN for missing values. Run-length codes
        become masks (N, H, W) bool. Values of several shapes, and other types, become lists. `objects.view` is (N, 4)
        float64: azimuth, elevation (degrees), distance (metres), tilt (degrees).

        Args:
            *fields: Names of channels (`rgb`), of values of samples (`index`, `split`, `sensor`, `time`, `camera.K`,
                `pose.azimuth_deg`, `camera_from_next`, ...), and of objects (`objects.box2d`, `objects.category_id`,
                `objects.mask`, `objects.keypoints`, ...).
            split: Name of a split; None: all.
            sensor: Name of a sensor; None: all.

        Returns:
            A sequence with a dict of these fields for each frame.

        Raises:
            UserError: A field, split or sensor is not in the data set.
        """
        try:
            check_fields(fields, self.plan.channels, self)
        except UserError as error:
            raise UserError(f"{self.root}: select: {error}") from None
        if split is not None and split not in self.splits:
            raise UserError(f"{self.root}: select: split: {one_of(split, self.splits)}")
        numbers = None if split is None and sensor is None else array("q", self.positions(split, sensor))
        if sensor is not None and not numbers:
            raise UserError(f"{self.root}: select: sensor: expected one that took pictures; found {sensor!r}")
        return Selection(self.name, self, fields, numbers)

    def positions(self, split: str | None = None, sensor: str | None = None) -> Iterator[int]:
        """Positions in the data set of the frames of a split and a sensor; reads all records.

        Args:
            split: Name of a split; None: all.
            sensor: Name of a sensor; None: all.

        Returns:
            An iterator over positions, counted from 0, in frame order.
        """
        for (key, places), first in zip(*self._shots, strict=False):
            records = self._read_records(key)
            splits, sensors = records.splits, records.sensors
            yield from (
                first + i
                for i, place in enumerate(places)
                if split in (None, splits[place]) and sensor in (None, sensors[place])
            )

    def shots(self) -> Iterator[tuple[str, Sequence[int]]]:
        """Yield every finished shot, in frame order.

        Returns:
            An iterator over pairs: the shot's key, and the places of its chosen frames, counted from 0.
        """
        yield from self._shots[0]

    def samples_of(self, key: str, places: Sequence[int]) -> Iterator[Sample]:
        """Yield some of a finished shot's samples.

        Args:
            key: The shot's key.
            places: Places of samples in the shot, counted from 0.

        Returns:
            An iterator over the samples, in the order of `places`.

        Raises:
            StoreError: The shot's files are damaged.
        """
        records = self._read_records(key)
        for place in places:
            yield self.shown(self._sample(records, place))

    def sample_at(self, key: str, place: int) -> Sample:
        """One of a finished shot's samples; the records of a few shots are cached.

        Args:
            key: The shot's key.
            place: Place of the sample in the shot, counted from 0.

        Returns:
            The sample, which reads its channels on access.

        Raises:
            StoreError: The shot's files are damaged.
        """
        return self.shown(self._sample(self._records(key), place))

    def shown(self, sample: Sample) -> Sample:
        """The sample as the data set returns it: unchanged.

        Args:
            sample: A sample from the store.

        Returns:
            The same sample; subclasses may leave out annotations.
        """
        return sample

    @property
    def sequences(self) -> tuple[str, ...]:
        """Names of the sequences of its frames, in order; empty if all are still pictures."""
        return tuple(self._sequences)

    @cached_property
    def _sequences(self) -> dict[str, list[tuple[str, list[int]]]]:
        """The chosen places of each sequence's shots, by the sequence's name."""
        sequences: dict[str, list[tuple[str, list[int]]]] = {}
        for key, places in self._shots[0]:
            names = self._records(key).sequences
            for name in dict.fromkeys(names[place] for place in places):
                if name:
                    sequences.setdefault(name, []).append((key, [place for place in places if names[place] == name]))
        return sequences

    def sequence(self, name: str, sensor: str = CAMERA) -> tuple[Sample, ...]:
        """The samples of one sensor in a sequence, in the order of its instants.

        Args:
            name: Name of the sequence, one of `sequences`.
            sensor: Name of the sensor.

        Returns:
            The finished samples.

        Raises:
            StoreError: The sequence or the sensor is unknown.
        """
        if name not in self._sequences:
            known = one_of(name, self.sequences) if self.sequences else "expected sequences, found still pictures only"
            raise StoreError(f"{self.root}: sequence: {known}")
        samples = [sample for key, places in self._sequences[name] for sample in self.samples_of(key, places)]
        samples_of_sensor = sorted((sample for sample in samples if sample.sensor == sensor), key=lambda sample: sample.instant)
        if not samples_of_sensor:
            sensors = tuple(dict.fromkeys(sample.sensor for sample in samples))
            raise StoreError(f"{self.root}: sensor: {one_of(sensor, sensors)}")
        return tuple(samples_of_sensor)

    def tracks(self, sequence: str, sensor: str = CAMERA) -> PointTracks:
        """The points that a sensor followed through a sequence.

        Args:
            sequence: Name of the sequence, one of `sequences`.
            sensor: Name of the sensor.

        Returns:
            Positions (T, N, 2) in pixels and (T, N, 3) in metres, and states (T, N), of N points at T instants.

        Raises:
            StoreError: The sequence or the sensor is unknown, or the sensor follows no points.
        """
        samples = self.sequence(sequence, sensor)
        if samples and "tracks" not in samples[0].channels and any(part.recipe.get("tracks") for part in self.plan.parts):
            raise StoreError(
                f"tracks: expected a sensor that follows points; found {sensor}, whose channels lack tracks: add tracks to "
                f"rig.sensors.{sensor}.channels"
            )
        return joined(samples)

    def _places(self, row: Row) -> Sequence[int]:
        """Return the chosen frames of a finished shot, by the model's key, or for an animated model by the key of its moment.
        If the plan has no model for a frame, as in imported data sets, the frame belongs to all models that it shows.
        """
        places = self.choice.places(row.first, row.count)
        if not self.choice.models or not places:
            return places
        part = self.plan.parts[row.part]
        model = part.world(row.subject) if part.is_product else None
        if model is not None and self.choice.has_model(model):
            return places
        if model is not None and not self._has_chosen_step(model):
            return ()
        shown = zip(places, self.samples_of(row.key, places), strict=True)
        return [place for place, sample in shown if any(self._is_chosen(o, model) for o in sample.objects)]

    def _is_chosen(self, shown: ObjectAnnotation, model: str | None) -> bool:
        """Return whether an object makes its frame a chosen one. If the frame's model is known, only objects of this model
        count.
        """
        if model is None:
            return self.choice.has_model(shown.key) or self.choice.has_model(shown.track)
        return shown.track == model and self.choice.has_model(shown.key)

    def _has_chosen_step(self, model: str) -> bool:
        """Return whether the choice names a time step of a model."""
        if not self.choice.may_have(step_key(model, 0).rstrip("0")):
            return False
        info = self._info(model)
        return info is not None and any(self.choice.has_model(step.key) for step in info.steps)

    def _read_records(self, key: str) -> _Records:
        file = self.store.shot_folder(key) / "frames.json"
        for name in ("frames.json", "shot.json"):
            file_inside(self.root, file.with_name(name).relative_to(self.root).as_posix())
        try:
            records: list[dict[str, Any]] = parsed(read_bytes(file, "MAX_RECORD_BYTES"))
            row = self.plan.find(key)
            if not isinstance(records, list) or not all(isinstance(record, dict) for record in records):
                raise ValueError("no list of records")
            if row is None or len(records) != row.count:
                raise ValueError(f"{quantity(len(records), 'frame')} instead of {row and row.count}")
            if any(record.get("index") != row.first + i for i, record in enumerate(records)):
                raise ValueError(f"other numbers of frames than {row.first} and on")
            if not all(isinstance(record.get(name, ""), str) for record in records for name in ("sequence", "split")):
                raise ValueError("a sequence or a split that is no text")
            is_short = any("camera" not in record for record in records)
        except (OSError, TypeError, ValueError) as error:
            raise _damaged(file, error) from None
        shot = self.labelled(key) if is_short or any(map(_rolls, records)) else None
        if shot is None:
            return _Records(file, records)
        known = ShotRecords(shot, self._facts, str(file), str(self.root))
        if not is_short:
            return _Records(file, records, rows=known)
        try:
            files = self.store.channel_files(key, shot)
        except LookupError as error:
            raise _damaged(file.with_name("shot.json"), error) from None
        return _Records(file, records, known, files, known)

    def labelled(self, key: str) -> Shot | None:
        """A finished shot as `Store.labelled` gives it.

        Args:
            key: The shot's key.

        Returns:
            The shot with its labelled objects; None if the store has no shot of this key.

        Raises:
            StoreError: The number of samples differs from the plan.
        """
        shot, row = self.store.labelled(key), self.plan.find(key)
        if shot is not None and row is not None and (count := sum(1 for _ in shot.samples)) != row.count:
            file = self.store.shot_folder(key) / "shot.json"
            raise _damaged(file, ValueError(f"{count} samples instead of {row.count}"))
        return shot

    def _model_facts(self, key: str, frame: int | None) -> ModelInfo:
        info = self._info(key)
        if info is None:
            raise ValueError(f"no model {key}")
        return info.at_frame(frame)

    def _sample(self, records: _Records, place: int) -> Sample:
        record = records.records[place]
        try:
            supplied, options = self._supplied(record)
            if "camera" in record or records.shot is None:
                files: dict[str, str] = record["files"] | supplied
                whole = from_whole_sample(record, _ChannelFiles(self.root, files, self._manifests), files)
                if records.rows is not None and _rolls(record):
                    whole = records.rows.with_rows(place, whole)
                return self._named(_with_options(whole, options))
            kept, number = records.shot.kept_channels(place), f"{record['index']:08d}"
            files = {name: head + number + tail for name, head, tail in records.files if name in kept}
            files |= {name: file for name, file in supplied.items() if records.shot.keeps(place, name)}
            short = records.shot.sample(place, record, _ChannelFiles(self.root, files, self._manifests), files)
            return self._named(_with_options(short, options))
        except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
            raise _damaged(records.file, error) from None

    def _named(self, sample: Sample) -> Sample:
        """The sample, if its names are valid in an export's paths; raises ValueError otherwise."""
        if sample.split not in self.splits:
            raise ValueError(f"split {sample.split!r:.100} where one of the plan's is expected")
        names([*sample.files], "channel")
        names([name for o in sample.objects for name in (o.key, o.track) if name], "the key")
        strange = next((o.category_id for o in sample.objects if o.category_id not in self._category_ids), None)
        if strange is not None:
            raise ValueError(f"category {strange} where one of the plan's is expected")
        return sample

    @cached_property
    def _category_ids(self) -> frozenset[int]:
        return frozenset(category.id for category in self.categories)

    def _supplied(self, record: dict[str, Any]) -> tuple[dict[str, str], Options]:
        """Files of channels that were added to a frame later, and the options of these labels."""
        files, options = dict[str, str](), dict[str, Mapping[str, Any]]()
        number = record["index"]
        for index, added in self.plan.supplements:
            if index.first <= number < index.first + index.samples:
                key = index.row_at(number).key
                if self.store.has_shot(key):
                    kinds = self.kinds[index.part]
                    files |= {name: self.store.channel_file(key, name, number, kinds) for name in added}
                    options |= {name: given for name, given in self._options(key).items() if name in added}
        return files, options

    def _options_of(self, key: str) -> Options:
        """The options of labels in a finished shot."""
        shot = self.store.labelled(key)
        return {} if shot is None else shot.labels

    @cached_property
    def kinds(self) -> tuple[Files, ...]:
        """The kinds of files that each part has written; raises StoreError if its recipe names other kinds."""
        try:
            return tuple(typed(_FILES, part.recipe.get("files", {})) for part in self.plan.parts)
        except ValueError as error:
            raise StoreError(
                f"{self.store.plan_file}: expected kinds of files, found {error}: render the recipe anew"
            ) from None

    def path(self, relative: str) -> Path:
        """A file of the data set.

        Args:
            relative: Path relative to the data set's root.

        Returns:
            The absolute path.

        Raises:
            StoreError: The path leads out of the data set.
        """
        return file_inside(self.root, relative)

    def read(self, relative: str) -> bytes:
        """The bytes of a channel's file, also from a tar.

        Args:
            relative: Path relative to the data set's root.

        Returns:
            The content, proved against its digest.

        Raises:
            StoreError: The file has changed since it was written, or the path leads out of the data set.
            OSError: The file cannot be read.
        """
        return _read(self.root, self._manifests, relative)

    def stored(self, relative: str) -> Path | Loaded:
        """A stored file, or its content if it is in its shot's tar.

        Args:
            relative: Path relative to the data set's root.

        Returns:
            The absolute path, or the suffix and the bytes of a file in a tar.

        Raises:
            StoreError: The path leads out of the data set.
        """
        file = self.path(relative)
        if relative.startswith("store/shots/"):
            folder, inside = _parted(relative)
            if inside in self._manifests(folder).spans:
                return Loaded(file.suffix, self.read(relative))
        return file

    def link(self, relative: str, destination: Path) -> None:
        """Put a stored file at `destination`: a hard link, else a reflink, else a copy; `link_kinds` records the kind. A
        file from a shot's tar is always copied.

        Args:
            relative: Path relative to the data set's root.
            destination: Path of the new file; missing folders are made.

        Raises:
            StoreError: The path leads out of the data set.
        """
        if not destination.parent.is_dir():
            destination.parent.mkdir(parents=True, exist_ok=True)
        file = self.stored(relative)
        if isinstance(file, Loaded):
            destination.write_bytes(file.data)
        else:
            self.link_kinds.add(link_file(file.resolve() if file.is_symlink() else file, destination))

    def put(self, frame: int, name: str, make: Callable[[], bytes], destination: Path) -> None:
        """Write the result of `make` to `destination`. If another export of this pass wrote the same encoding of the frame,
        by its name, that file is linked.

        Args:
            frame: Number of the frame.
            name: Name of the encoding.
            make: A function that returns the content.
            destination: Path of the new file.
        """
        kind = self.made.put(frame, name, make, destination)
        if kind:
            self.link_kinds.add(kind)

    def mesh(self, key: str) -> Mesh:
        """A finished model, or a time step of one, with its materials, as in its GLB.

        Args:
            key: The key of the model or time step, as in `ObjectAnnotation.key`.

        Returns:
            Vertices in metres and object axes, triangles and materials.

        Raises:
            StoreError: The data set has no such model.
        """
        from viewsphere.assets.exporting.exported import read_exported

        info = self._info(key)
        if info is None:
            moving = (self._info(model) for model in self.plan.models)
            info = next((step for model in moving if model for step in model.steps if step.key == key), None)
        if info is None:
            raise StoreError(f"{self.root}: expected a finished model, found no {key!r}")
        with here(self.path(info.glb).absolute()) as file:
            return read_exported(file, info.parts, info.node, whole=True)

    def occupancy(self, key: str, cells: int = 32) -> Occupancy:
        """Return the occupied cells of a model, in a cube around it. A cell is occupied where the model's surface is, and
        inside its closed pieces.

        Args:
            key: The key of the model or time step.
            cells: Number of cells along each side of the cube.

        Returns:
            The cells (`cells`, `cells`, `cells`) uint8 along the object's axes, their side in metres, and the corner of the
                first.

        Raises:
            StoreError: The data set has no such model.
            ValueError: There are too many cells.
        """
        from viewsphere.model.annotations.voxels import Occupancy

        mesh = self.mesh(key)
        return Occupancy.from_mesh(mesh.vertices, mesh.triangles, cells)

    def model_files(self) -> Iterator[tuple[str, str]]:
        """Yield every finished model's OBJ, GLB, materials and textures. A model that deforms comes with all its time steps.

        Returns:
            An iterator over pairs: `<key>/<name>`, and the path relative to the data set's root.
        """
        for key, folder in {info.track or info.key: self.path(info.obj).parent for info in self.models}.items():
            for file in files_inside(self.root, folder):
                if file.name not in {"model.json", MANIFEST}:
                    yield f"{key}/{file.name}", file.relative_to(self.root).as_posix()

    def link_models(self, folder: Path) -> None:
        """Link the files of every finished model into `folder`/<key>; see `link`.

        Args:
            folder: Folder for the models.
        """
        for inside, stored in self.model_files():
            self.link(stored, folder / inside)


def _with_options(sample: Sample, options: Options) -> Sample:
    """The sample, with these options for some of its labels."""
    return replace(sample, options={**sample.options, **options}) if options else sample


def _rolls(record: Mapping[str, Any]) -> bool:
    """Return whether a whole record has a camera with a rolling shutter."""
    camera: Any = record.get("camera")
    lens: Any = camera.get("intrinsics") if isinstance(camera, dict) else None
    return isinstance(lens, dict) and lens.get("rolling") is not None


@dataclass(frozen=True, eq=False)
class _Records:
    """A shot's frames.json. For short records, it comes with the shot and the names of its channels' files (channel, and the
    path before and after a sample's number). `rows` gives the row poses of rolling shutters, None without a stored shot.
    """

    file: Path
    records: list[dict[str, Any]]
    shot: ShotRecords | None = None
    files: tuple[tuple[str, str, str], ...] = ()
    rows: ShotRecords | None = None

    @property
    def sequences(self) -> list[str]:
        """The sequence of each sample, empty for still pictures."""
        if self.shot is None:
            return [record.get("sequence", "") for record in self.records]
        return [self.shot.shot.sequence] * len(self.records)

    @property
    def splits(self) -> list[str]:
        """The split of each sample."""
        if self.shot is None:
            return [record.get("split", "") for record in self.records]
        shot = self.shot.shot
        return [shot.instants[instant].split for _, instant, _ in shot.samples]

    @property
    def sensors(self) -> list[str]:
        """The name of each sample's sensor."""
        if self.shot is None:
            return [record.get("sensor", CAMERA) for record in self.records]
        shot = self.shot.shot
        return [shot.rig.sensors[sensor].name for _, _, sensor in shot.samples]


class _ChannelFiles(Mapping[str, NDArray[Any]]):
    """A frame's channels, each read from its file on first access."""

    def __init__(self, root: Path, files: Mapping[str, str], manifest_of: ManifestOf) -> None:
        self._root, self._files, self._manifest_of = root, files, manifest_of
        self._arrays: dict[str, NDArray[Any]] = {}

    def __copy__(self) -> Self:
        """A copy with the same files, none of them read yet."""
        return type(self)(self._root, self._files, self._manifest_of)

    def __getstate__(self) -> dict[str, Any]:
        """The state sent to other processes, which read the manifests again."""
        return {**self.__dict__, "_manifest_of": partial(_manifest_of, self._root)}

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self._arrays:
            file = file_inside(self._root, self._files[name])
            if name not in channels():
                raise StoreError(f"{file}: expected a label that is installed, found {name!r}: install the package that has it")
            self._arrays[name] = decode(
                channels()[name], file, partial(_read, self._root, self._manifest_of, self._files[name])
            )
        return self._arrays[name]

    def __contains__(self, name: object) -> bool:
        """Return whether the frame has the channel, without reading the file."""
        return name in self._files

    def __iter__(self) -> Iterator[str]:
        return iter(self._files)

    def __len__(self) -> int:
        return len(self._files)


_FILES = TypeAdapter(Files)

ManifestOf = Callable[[str], Manifest]
"""Returns the manifest of a folder, given by its path from the data set's root."""


def _manifest_of(root: Path, folder: str) -> Manifest:
    return Manifest.read(file_inside(root, f"{folder}/{MANIFEST}").parent)


def _read(root: Path, manifest_of: ManifestOf, relative: str) -> bytes:
    """The verified bytes of a channel's file."""
    folder, inside = _parted(relative)
    manifest = manifest_of(folder)
    return manifest.content(inside, file_inside(root, f"{folder}/{manifest.holder(inside)}"))


def _parted(file: str) -> tuple[str, str]:
    """A channel's file as its shot's folder and its path in that folder."""
    path = PurePosixPath(file)
    return path.parent.parent.as_posix(), f"{path.parent.name}/{path.name}"


def _damaged(file: Path, error: Exception) -> StoreError:
    return StoreError(
        f"{file}: expected the frames of a finished shot, found {type(error).__name__}: {error}: "
        f"delete {file.parent} and render again"
    )


class _Made:
    """The files made for the currently exported frame, by the names of their encodings."""

    def __init__(self) -> None:
        self._frame = -1
        self._files: dict[str, Path] = {}

    def put(self, frame: int, name: str, make: Callable[[], bytes], file: Path) -> str | None:
        """Write the result of `make` to a file, or link it to an equal file written before; returns the kind of link."""
        if frame != self._frame:
            self._frame, self._files = frame, {}
        first = self._files.setdefault(name, file)
        if first is not file:
            return link_file(first, file)
        file.write_bytes(make())
        return None


class Exported(Dataset):
    """A data set whose samples lack the annotations that exports leave out: those with a visibility of at most `least`, if
    given. With `cuts`, an object across the seam of a full turn is two objects.
    """

    def __init__(self, root: str | os.PathLike[str], choice: Choice | None, least: float | None, cuts: bool = False) -> None:
        super().__init__(root, choice)
        self.least, self.cuts = least, cuts

    def __reduce__(self) -> tuple[type[Dataset], tuple[Path, Choice, float | None, bool]]:  # pyright: ignore[reportIncompatibleMethodOverride]
        return type(self), (self.root, self.choice, self.least, self.cuts)

    def shown(self, sample: Sample) -> Sample:
        """A sample of the data set with the kept annotations; imported objects have no known visibility."""
        if self.least is not None:
            kept = tuple(o for o in sample.objects if o.source is not None or o.visibility > self.least)
            sample = replace(sample, objects=kept)
        return cut_at_seam(sample) if self.cuts else sample
