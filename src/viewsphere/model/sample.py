"""A sample: one sensor's picture at one instant, and the labels of its objects."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import NotKeptError, StoreError
from viewsphere.model.channel import picture_of
from viewsphere.model.fields.notebook import Shown
from viewsphere.model.instant import Viewpoint
from viewsphere.model.model_spec import Size
from viewsphere.model.scene import Finish
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.sensors.rig import CAMERA
from viewsphere.model.shot import Shot
from viewsphere.validation.quantity import quantity

if TYPE_CHECKING:
    from viewsphere.model.annotations.point_cloud import Axes, PointCloud, Surface
    from viewsphere.model.annotations.voxels import VoxelGrid

MERGED = "-merged-"
"""Separator between a sequence's name and its number, where merged data sets have several of one name."""

Float = NDArray[np.float64]
Box = tuple[float, float, float, float]


@dataclass(frozen=True)
class ObjectView:
    """The camera as one object sees it: its orbit around the object's box centre, in the object's own axes.

    Attributes:
        azimuth_deg: Azimuth in degrees; 0 looks the object in the face.
        elevation_deg: Elevation in degrees.
        distance: Distance from the box centre in metres.
        tilt_deg: Roll in degrees after the shortest turn of the camera towards the box centre; positive is clockwise.
    """

    azimuth_deg: float
    elevation_deg: float
    distance: float
    tilt_deg: float


@dataclass(frozen=True)
class Rle:
    """COCO's compressed run-length code of a mask.

    Attributes:
        height: Height of the mask in pixels.
        width: Width of the mask in pixels.
        counts: The compressed run lengths, column by column, as pycocotools reads them.
    """

    height: int
    width: int
    counts: str


@dataclass(frozen=True, eq=False)
class ObjectAnnotation:
    """One placed object in one frame, seen or not.

    Its 6D pose in the camera is `camera_from_object`: `p_camera = R @ p_object + t`, metres, camera axes x right, y down, z
    forward (OpenCV). Boxes are half-open pixel corners (x0, y0, x1, y1). The 3D box is tight and object-aligned; the order
    of its vertices and faces is that of `viewsphere.geometry.box3d`.

    An imported object has a `source`; values that it lacks are NaN, and key and model may be empty. If it lacks a mask, the
    mask is empty, but `box2d` and `area` are the annotation's.

    Fields of requested labels, of labels from other packages, and of labels that can be derived from any data set are
    attributes, too.

    Attributes:
        id: Number of the object in the sequence, from 1; also its track id.
        category: Name of the category.
        supercategory: Name of the supercategory.
        category_id: Number of the category, from 1.
        key: The model's key in the data set; for an animated model, that of the frame's moment.
        model: Path of the normalised model, relative to the data set's root.
        rle: The visible pixels, as a run-length code; see `mask`.
        area: Number of visible pixels.
        box2d: The box of the visible pixels; None if there are none.
        box2d_projected: The box of the projected model, clipped to the image; None if they do not meet.
        box2d_unclipped: The same box unclipped. None if the model reaches behind the camera, or out of a distorted lens'
            field of view.
        box3d_object: (8, 3) float64, vertices of the 3D box in the object's axes, metres.
        box3d: (8, 3) float64, the vertices in the world, metres.
        box3d_camera: (8, 3) float64, the vertices in the camera's axes, metres.
        box3d_pixels: (8, 2) float64, the projected vertices in pixels; NaN where the lens does not show one, as behind the
            camera.
        box3d_in_front: (8,) bool, whether each vertex is in front of the camera.
        world_from_object: (4, 4) float64, the object's pose in the world, metres.
        camera_from_object: (4, 4) float64, the object's pose in the camera's axes, metres.
        quaternion: Rotation of `camera_from_object`, (w, x, y, z) with w >= 0.
        view: The camera as the object sees it.
        pose_category: Name of the side that the camera sees, such as front-left.
        size: Width, height and length of the 3D box (the object's x, z and y), metres.
        real_size: Width, height and length of the real object, metres; None if unknown.
        visibility: Visible pixels over all pixels that the object alone would cover, those outside the image included. This
            is BOP's `visib_fract`, on a canvas of three times the image's width and height.
        truncation: The share of all these pixels that is outside the image.
        source: The annotation in the imported data set; None if rendered.
        track: Key of the animated model, equal at all moments; empty for other models.
        extra: Fields of requested labels, and of labels from other packages.
    """

    id: int
    category: str
    supercategory: str
    category_id: int
    key: str  # the model's key in the data set
    model: str  # path of the normalised model, relative to the data set's root
    rle: Rle
    area: int
    box2d: Box | None
    box2d_projected: Box | None
    box2d_unclipped: Box | None
    box3d_object: Float
    box3d: Float
    box3d_camera: Float
    box3d_pixels: Float
    box3d_in_front: NDArray[np.bool_]
    world_from_object: Float
    camera_from_object: Float
    quaternion: tuple[float, float, float, float]  # camera_from_object's rotation, (w, x, y, z), w >= 0
    view: ObjectView
    pose_category: str
    size: Size
    real_size: Size | None
    visibility: float
    truncation: float
    source: Mapping[str, Any] | None = None
    # Default factories, unlike defaults, leave no attribute on the class, so that `__getattr__` of a subclass gets these, too.
    track: str = field(default_factory=str)
    extra: Mapping[str, Any] = field(default_factory=dict[str, Any])

    def __getattr__(self, name: str) -> Any:
        """Fields in `extra`; raises AttributeError for other names."""
        try:
            return self.__dict__["extra"][name]
        except KeyError:
            raise NotKeptError(
                f"an object has no {name!r}, or its data set does not keep it: add it to the recipe's annotations"
            ) from None

    def __dir__(self) -> list[str]:
        """Return the names of the attributes, with those of the fields in `extra`."""
        return sorted({*object.__dir__(self), *self.extra})

    @property
    def is_placed(self) -> bool:
        """Return whether the object's place in space is known."""
        return not math.isnan(self.world_from_object[0, 0])

    @property
    def is_boxed(self) -> bool:
        """Return whether its pose and its size are known; some imported objects have only a pose."""
        return self.is_placed and not math.isnan(self.size[0])

    @property
    def mask(self) -> NDArray[np.bool_]:
        """Visible pixels, (H, W) bool.

        Raises:
            StoreError: The run lengths are invalid, as an imported data set's may be.
        """
        from viewsphere.codecs.size import check_size
        from viewsphere.geometry.mask import decode_rle

        check_size(self.rle.width, self.rle.height)
        try:
            return decode_rle(self.rle.height, self.rle.width, self.rle.counts)
        except ValueError as error:
            raise StoreError(f"object {self.id}: expected a mask, found {error}") from None

    @property
    def polygons(self) -> list[list[float]]:
        """COCO polygons of the mask, traced along pixel corners: pycocotools rasterises them to the identical mask."""
        from viewsphere.geometry.mask import mask_polygons

        return mask_polygons(self.mask)


@dataclass(frozen=True, eq=False)
class Origin:
    """The shot, the instant and the sensor of a sample, the latter two counted from 0 in the shot. The shot is given as itself,
    or as the root of a data set and the shot's key.
    """

    instant: int
    sensor: int
    shot: Shot | None = None
    root: str = ""
    key: str = ""


@dataclass(frozen=True, eq=False)
class Sample(Shown):
    """One sensor's picture at one instant: camera, pose, objects and channels.

    Channels and fields of labels are attributes: `sample.rgb`, `sample.depth`, `sample.captions`. Imported pictures may have
    no known camera and pose; these have an `image_size`.

    Attributes:
        index: Number of the frame in the data set, from 0.
        split: Name of the split.
        known_camera: The camera; None if unknown. `camera` raises an error instead.
        known_pose: The camera's viewpoint; None if unknown. `pose` raises an error instead.
        objects: The annotations of the objects, in the order of their ids.
        channels: Arrays by names of channels, loaded on access.
        files: Paths of the channels' files, relative to the data set's root; empty in memory.
        image_size: Width and height in pixels, if the camera is not known.
        source: The imported data set's entry of the picture; None if rendered.
        sequence: Name of the sequence; empty for still pictures.
        variation: Name of the variation, if the recipe has variations.
        sensor: Name of the sensor.
        instant: Number of the instant, from 0 in the sequence or, for still pictures, in the data set.
        time: Seconds from the sequence's first instant.
        origin: The shot that the picture belongs to; None if unknown.
        requested: Names of the labels of objects and of pictures that the recipe requests.
        extra: Fields of the labels of pictures.
        options: Options of labels, by their names.
        finish: The steps from light to the picture; None if unknown, as for imported pictures.
    """

    index: int
    split: str
    known_camera: Camera | None
    known_pose: Viewpoint | None
    objects: tuple[ObjectAnnotation, ...]
    channels: Mapping[str, NDArray[Any]]
    files: Mapping[str, str]  # channel -> path relative to the data set's root; empty in memory
    image_size: tuple[int, int] | None = None  # (width, height) in pixels, if the camera is not known
    source: Mapping[str, Any] | None = None  # the imported data set's entry of the picture
    sequence: str = ""  # empty for still pictures
    variation: str = ""  # the variation, if the recipe has variations
    sensor: str = CAMERA
    instant: int = 0  # counted from 0 in the sequence, or, for still pictures, in the data set
    time: float = 0.0  # seconds from the sequence's first instant
    origin: Origin | None = None  # None: unknown
    requested: tuple[str, ...] = ()  # labels of objects and of pictures that were asked for
    extra: Mapping[str, Any] = field(default_factory=dict[str, Any])  # fields of labels of pictures
    options: Mapping[str, Mapping[str, Any]] = field(default_factory=dict[str, Mapping[str, Any]])  # those of labels
    finish: Finish | None = None

    def __repr__(self) -> str:
        size = f"{self.width} x {self.height} pixels"
        taken = f"{self.sequence}, {self.sensor}, {self.time:g} s, " if self.sequence else ""
        objects = quantity(len(self.objects), "object")
        return f"<Sample {self.index} ({self.split}): {taken}{size}, {objects}; {', '.join(self.channels)}>"

    @property
    def camera(self) -> Camera:
        """The camera.

        Raises:
            StoreError: The picture is imported and its camera is not known.
        """
        if self.known_camera is None:
            raise StoreError(f"frame {self.index}: an imported picture has no camera")
        return self.known_camera

    @property
    def pose(self) -> Viewpoint:
        """The camera's viewpoint.

        Raises:
            StoreError: The picture is imported and its pose is not known.
        """
        if self.known_pose is None:
            raise StoreError(f"frame {self.index}: an imported picture has no pose")
        return self.known_pose

    @property
    def width(self) -> int:
        """Width of the picture in pixels."""
        return self.image_size[0] if self.known_camera is None and self.image_size else self.camera.width

    @property
    def height(self) -> int:
        """Height of the picture in pixels."""
        return self.image_size[1] if self.known_camera is None and self.image_size else self.camera.height

    @property
    def picture(self) -> NDArray[Any]:
        """The colours, (H, W, 3) uint8 sRGB, or (H, W, 4) if only the picture without its background is stored.

        Data sets that store only a deeper picture return it as it is: uint16 sRGB, or float32 scene-linear.

        Raises:
            AttributeError: No picture is stored.
        """
        return getattr(self, picture_of(self.channels) or "rgb")

    @property
    def picture_file(self) -> str | None:
        """Path of the file of `picture`, relative to the data set's root; None without a picture."""
        return self.files.get(picture_of(self.files) or "")

    def point_cloud(self, axes: Axes = "camera", surface: Surface = "visible") -> PointCloud:
        """Return the picture's visible points, or the points of `surface_samples`. Any lens is supported.

        Args:
            axes: `camera` or `world`, the axes of points and normals.
            surface: `visible`: a point for each pixel that shows a surface, row by row, by `depth_ray`, else by `depth`.
                `complete`: the points of `surface_samples` on all objects, visible or not, without colours.

        Returns:
            Points (N, 3) float64 in metres; colours, normals, objects and categories if their channels are stored.

        Raises:
            StoreError: The channels are not stored, or the camera is not known.
            UserError: `axes` or `surface` has another value.
        """
        from viewsphere.model.annotations.point_cloud import PointCloud

        categories = {o.id: o.category_id for o in self.objects}
        try:
            return PointCloud.from_channels(self.channels, self.camera, categories, axes, surface)
        except ValueError as error:
            raise StoreError(f"frame {self.index}: {error}") from None

    @property
    def voxel_grid(self) -> VoxelGrid:
        """The cells of the channel `voxels` as arrays.

        Raises:
            StoreError: The channel is not stored, or has another grid than the recipe's.
        """
        from viewsphere.model.annotations.voxels import Grid, VoxelGrid, Voxels

        if "voxels" not in self.channels:
            raise StoreError(f"frame {self.index}: expected the channel voxels, found none: add it to the recipe's channels")
        try:
            return VoxelGrid.from_runs(
                self.channels["voxels"], Grid.for_camera(Voxels.model_validate(self.options.get("voxels", {})), self.camera)
            )
        except ValueError as error:
            raise StoreError(f"frame {self.index}: {error}") from None

    def __dir__(self) -> list[str]:
        """Return the names of the attributes, with those of channels and of the fields of labels."""
        return sorted({*object.__dir__(self), *self.channels, *self.extra})

    def __getattr__(self, name: str) -> Any:
        """Any channel by name, and any field of a label of pictures: `sample.rgb`, `sample.depth`, `sample.captions`, ..."""
        if name.startswith("_") or "channels" not in self.__dict__:
            raise AttributeError(f"Sample has no attribute {name!r}")
        if name in self.extra:
            return self.extra[name]
        try:
            return self.channels[name]
        except KeyError:
            raise AttributeError(
                f"this sample has no channel {name!r}; it has {', '.join((*self.channels, *self.extra))}: add it to the "
                f"recipe's channels, or annotations"
            ) from None
