"""From a recipe's rig to the sensors of its shots."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from viewsphere.composing.viewpoints.pose_files.motions import nearest_rotation
from viewsphere.errors import RecipeError
from viewsphere.files import written_path
from viewsphere.geometry.rotation import compose, rigid, transform
from viewsphere.labels import Partner, label_named, requires
from viewsphere.model.channel import PASSES, picture_of
from viewsphere.model.scene import IDENTITY, Matrix4
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.lidar import LIDAR, Lidar
from viewsphere.model.sensors.rig import Rig, Sensor
from viewsphere.model.sensors.rolling import Rolling
from viewsphere.planning.checks.lenses import check_lenses
from viewsphere.planning.rig_files import Calibrated, read_rig
from viewsphere.recipe.cameras.rig import RigFile, SensorEntry, SensorList, StereoRig, SurroundRig
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.world.scene import CameraEntry
from viewsphere.validation.errors import one_of, told_of

Float = NDArray[np.float64]

SKEWED = 1e-3
"""Tolerance between a user's matrix and the nearest rotation."""


def rig_of(recipe: Recipe, lens: Intrinsics) -> Rig | None:
    """The rig of a recipe, None if it has none; `lens` is the lens of its camera.

    Raises RecipeError for calibrations that cannot be read, sensors with channels that the recipe lacks, matrices that are not
    rotations, and disparity of pictures that are not rectified.
    """
    match recipe.rig:
        case None:
            return None
        case StereoRig():
            rig = _mounted({"left": (lens, np.eye(4)), "right": (lens, _moved(recipe.rig.baseline, 0.0, 0.0))})
        case SurroundRig():
            rig = _mounted({name: (lens, pose) for name, pose in _around(recipe.rig)})
        case SensorList():
            rig = _listed(recipe, recipe.rig, lens)
        case RigFile():
            rig = _calibrated(recipe, recipe.rig, lens)
    rig = _with_shutter(rig, recipe.camera.rolling)
    recipe = with_distances(recipe, rig)
    rig = _by_lens(recipe, rig)
    check_lenses(recipe, rig)
    _check_disparity(recipe, rig)
    if rig.sensors[0].lidar and (recipe.camera.is_random or recipe.camera.of_viewpoints):
        raise RecipeError(
            f"rig.sensors: expected a camera as the first sensor, as the camera's lens is drawn or its file's; found the LiDAR "
            f"{rig.sensors[0].name}: list it after a camera"
        )
    return rig


def with_distances(recipe: Recipe, rig: Rig) -> Recipe:
    """The recipe whose default channels fit the lenses of a rig: `depth_ray` beside `depth` if some lenses have no z-depth, and
    in its place if none has.
    """
    has_depth = [sensor.intrinsics.lens.has_depth for sensor in rig.sensors if sensor.lidar is None]
    if all(has_depth) or "channels" in recipe.model_fields_set:
        return recipe
    distances = ("depth", "depth_ray") if any(has_depth) else ("depth_ray",)
    channels = dict.fromkeys(n for name in recipe.channels for n in (distances if name == "depth" else (name,)))
    return recipe.model_copy(update={"channels": tuple(channels)})


def _by_lens(recipe: Recipe, rig: Rig) -> Rig:
    """The rig whose sensors without a list of channels keep those that their lenses have, if other sensors keep the rest."""
    kept = [sensor.kept_channels(recipe.channels) for sensor in rig.sensors]
    held = [{n for n in names if not _refused(n, rig, i)} for i, names in enumerate(kept)]
    some = set[str]().union(*held)
    sensors = list[Sensor]()
    for sensor, names, mine in zip(rig.sensors, kept, held, strict=True):
        is_less = sensor.channels is None and sensor.lidar is None and mine < set(names) <= some
        left = tuple(name for name in names if name in mine)
        sensors.append(sensor.model_copy(update={"channels": left}) if is_less and left else sensor)
    return rig.model_copy(update={"sensors": tuple(sensors)})


def _refused(name: str, rig: Rig, number: int) -> bool:
    """Return whether a sensor's lens rules out a channel, or, beside panoramas, the lack of an equal lens that it needs."""
    label, sensor = label_named(name), rig.sensors[number]
    if label is None:
        return False
    if label.refuses is not None and label.refuses(sensor.intrinsics) is not None:
        return True
    has_panoramas = any(not other.intrinsics.lens.has_depth for other in rig.sensors if other.lidar is None)
    return has_panoramas and requires(label.needs, Partner) and rig.partner(number) is None


def _with_shutter(rig: Rig, rolling: Rolling | None) -> Rig:
    """The rig whose cameras have this rolling shutter, as the recipe's camera."""
    if rolling is None:
        return rig
    return Rig(
        sensors=tuple(
            sensor
            if sensor.lidar is not None
            else sensor.model_copy(update={"intrinsics": sensor.intrinsics.model_copy(update={"rolling": rolling})})
            for sensor in rig.sensors
        )
    )


def _mounted(sensors: Mapping[str, tuple[Intrinsics, Float]]) -> Rig:
    """A rig of named sensors, with poses relative to the first one."""
    (_, first), *_ = sensors.values()
    back = None if np.array_equal(first, np.eye(4)) else _inverse(first)
    poses = (pose if back is None else compose(back, pose) for _, pose in sensors.values())
    mounted = zip(sensors.items(), poses, strict=True)
    return Rig(
        sensors=tuple(
            Sensor(name=name, intrinsics=lens, rig_from_sensor=_matrix(pose) if i else IDENTITY)
            for i, ((name, (lens, _)), pose) in enumerate(mounted)
        )
    )


def _listed(recipe: Recipe, entry: SensorList, lens: Intrinsics) -> Rig:
    rig = _mounted({name: (_lens(name, one, recipe.camera, lens), _pose(name, one)) for name, one in entry.sensors.items()})
    kept = zip(rig.sensors, entry.sensors.items(), strict=True)
    more = (
        (sensor, _measuring(recipe, name, one) | {"channels": _channels(recipe, name, one)}) for sensor, (name, one) in kept
    )
    return Rig(sensors=tuple(sensor.model_copy(update=update) for sensor, update in more))


def _check_sweep(recipe: Recipe, name: str, entry: SensorEntry) -> None:
    sweep = 0.0 if entry.lidar is None else entry.lidar.sweep
    if not sweep:
        return
    if recipe.time is None:
        raise RecipeError(
            f"rig.sensors.{name}.lidar.sweep: expected time beside it, as all moves meanwhile; found none: set time"
        )
    if recipe.time.count > 1 and sweep > recipe.time.seconds_at(1) * (1 + 1e-9):
        most = recipe.time.seconds_at(1)
        raise RecipeError(
            f"rig.sensors.{name}.lidar.sweep: expected at most the {most:g} seconds between two instants; found {sweep:g}"
        )


def _measuring(recipe: Recipe, name: str, entry: SensorEntry) -> dict[str, Lidar]:
    _check_sweep(recipe, name, entry)
    return {} if entry.lidar is None else {"lidar": entry.lidar.measuring(recipe.seed)}


def _lens(name: str, entry: SensorEntry, camera: CameraEntry, lens: Intrinsics) -> Intrinsics:
    if entry.lidar is not None:
        return entry.lidar.intrinsics
    if not entry.has_lens:
        return lens
    try:
        return entry.lens(camera).intrinsics
    except ValueError as error:
        raise RecipeError(f"rig.sensors.{name}: {error}") from None


def _channels(recipe: Recipe, name: str, entry: SensorEntry) -> tuple[str, ...] | None:
    for i, channel in enumerate(entry.channels or ()):
        kept = _kept(recipe, channel)
        if kept not in recipe.channels:
            raise RecipeError(
                f"rig.sensors.{name}.channels[{i}]: {one_of(channel, recipe.channels)}, or add it to the recipe's "
                "channels: a sensor keeps all or some of them"
            )
        if (wrong := _not_measured(channel, entry)) is not None:
            raise RecipeError(f"rig.sensors.{name}.channels[{i}]: {wrong}: leave it out")
    if entry.channels is None:
        return None
    channels_of_sensor = {_kept(recipe, channel) for channel in entry.channels}
    return tuple(channel for channel in recipe.channels if channel in channels_of_sensor)


def _kept(recipe: Recipe, channel: str) -> str:
    """The name under which a recipe keeps a channel: its background or its files may replace `rgb` by another picture."""
    if channel != "rgb" or ("rgb" in recipe.channels and "rgba" not in recipe.channels):
        return channel
    return "rgba" if "rgba" in recipe.channels else picture_of(recipe.channels) or channel


def _not_measured(channel: str, entry: SensorEntry) -> str | None:
    """Return the error for a channel that a sensor cannot have; None for a valid channel."""
    if entry.lidar is not None and channel in PASSES:
        return f"expected labels, as a LiDAR takes no pictures; found {channel}"
    if entry.lidar is None and channel == LIDAR:
        return f"expected what a camera sees; found {channel}, the points of a LiDAR"
    return None


def _pose(name: str, entry: SensorEntry) -> Float:
    """Return the pose of a sensor, (4, 4)."""
    if entry.look is not None:
        forward = np.subtract(entry.look, entry.position)
        if math.hypot(forward[0], forward[2]) < 1e-9 * math.hypot(*forward.tolist()):
            raise RecipeError(
                f"rig.sensors.{name}.look: expected a point not straight above or below the sensor; found "
                f"{list(entry.look)}: turn it by rotation: [90, 0, 0] looks up, [-90, 0, 0] down"
            )
        return rigid(_facing(forward), entry.position)
    if entry.rotation is None:
        return rigid(np.eye(3), entry.position)
    first = entry.rotation[0]
    if isinstance(first, tuple):
        written = np.array(entry.rotation, np.float64)
        rotation = nearest_rotation(written)
        if rotation is None or np.abs(rotation - written).max() > SKEWED:
            raise RecipeError(f"rig.sensors.{name}.rotation: expected a rotation; found a matrix that is none")
        return rigid(rotation, entry.position)
    x, y, z = entry.rotation
    return rigid(_turned(float(x), float(y), float(z)), entry.position)  # pyright: ignore[reportArgumentType]


def _facing(forward: Float) -> Float:
    """The axes, in columns, of a level sensor of the rig that looks along a direction."""
    x, y, z = (forward / math.sqrt(float((forward * forward).sum()))).tolist()
    level = math.sqrt(x * x + z * z)
    right = np.array([z / level, 0.0, -x / level])
    down = np.array([-x * y / level, level, -y * z / level])
    return np.column_stack([right, down, (x, y, z)])


def _turned(x: float, y: float, z: float) -> Float:
    """The rotation to the right by y, then up by x, then clockwise by z, degrees: Ry Rx Rz, to twelve digits.

    The last digits of sines differ between processors.
    """
    (ca, sa), (cb, sb), (cc, sc) = (_cosine_sine(angle) for angle in (x, y, z))
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, ca, -sa], [0.0, sa, ca]])
    about_y = np.array([[cb, 0.0, sb], [0.0, 1.0, 0.0], [-sb, 0.0, cb]])
    about_z = np.array([[cc, -sc, 0.0], [sc, cc, 0.0], [0.0, 0.0, 1.0]])
    return transform(about_y, transform(about_x, about_z.T)).T


def _cosine_sine(degrees: float) -> tuple[float, float]:
    angle = math.radians(degrees)
    return round(math.cos(angle), 12) + 0.0, round(math.sin(angle), 12) + 0.0


def _around(entry: SurroundRig) -> Iterator[tuple[str, Float]]:
    """Names and poses of sensors that are evenly rotated to the right over a full turn, each `radius` ahead of the middle."""
    for i in range(entry.count):
        axes = _turned(0.0, 360.0 * i / entry.count, 0.0)
        yield f"camera{i}", rigid(axes, entry.radius * axes[:, 2])


def _calibrated(recipe: Recipe, entry: RigFile, lens: Intrinsics) -> Rig:
    paths = [recipe.folder / written_path(path) for path in entry.path]
    calibrated = read_rig(paths, entry.format, entry.rectified)
    return _mounted({sensor.name: (_sized(sensor, lens), sensor.rig_from_sensor) for sensor in calibrated})


def _sized(found: Calibrated, lens: Intrinsics) -> Intrinsics:
    """The calibrated lens; with the recipe's size if the calibration has none."""
    width, height = found.size or (lens.width, lens.height)
    with told_of(f"rig: sensor {found.name}"):
        return Intrinsics(width=width, height=height, **found.lens, distortion=found.distortion, rolling=None)


def _check_disparity(recipe: Recipe, rig: Rig) -> None:
    asked = next((name for name in recipe.channels if (label := label_named(name)) and requires(label.needs, Partner)), None)
    if asked and not (rig.rectified or rig.stacked):
        lenses = [sensor.intrinsics.lens for sensor in rig.sensors if sensor.lidar is None]
        if not any(lens.has_depth for lens in lenses):
            raise RecipeError(
                f"channels: expected a rig of two equal panoramas with equal axes, one above the other, for {asked}; found "
                "none: in panoramas beside each other, points move across columns and rows, and not at all on the line through "
                "both cameras: set position: [0, 0.2, 0] of the lower one"
            )
        raise RecipeError(
            f"channels: expected a rig with two rectified sensors (equal pinhole lenses and axes, one to the "
            f"right of the other) for {asked}; found none: set rig: {{kind: stereo, baseline: 0.1}}, rectified: true beside a "
            f"calibration, or leave {asked} out"
        )


def _moved(x: float, y: float, z: float) -> Float:
    return rigid(np.eye(3), (x, y, z))


def _inverse(pose: Float) -> Float:
    turned = np.ascontiguousarray(pose[:3, :3].T)
    return rigid(turned, -transform(turned, pose[:3, 3]))


def _matrix(pose: Float) -> Matrix4:
    a, b, c = ((x, y, z, w) for x, y, z, w in (pose[:3] + 0.0).tolist())
    return a, b, c, IDENTITY[3]
