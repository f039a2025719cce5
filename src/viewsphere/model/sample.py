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

    The tilt is that of the camera after the shortest turn towards that point.
    """

    azimuth_deg: float
    elevation_deg: float
    distance: float
    tilt_deg: float


@dataclass(frozen=True)
class Rle:
    """COCO's compressed run-length code of a mask."""

    height: int
    width: int
    counts: str


@dataclass(frozen=True, eq=False)
class ObjectAnnotation:
    """One placed object in one frame, seen or not.

    Its 6D pose in the camera is `camera_from_object`, (4, 4): `p_camera = R @ p_object + t`, metres, camera axes x right,
    y down, z forward (OpenCV).

    Boxes are half-open pixel corners (x0, y0, x1, y1). `box2d` is tight around the visible pixels, None if
    there are none; `box2d_projected` is the box of the projected model clipped to the image, None where
    they do not meet; `box2d_unclipped` is the same box unclipped, None where the model reaches behind the
    camera (or out of a distorted lens' field of view). The 3D box is tight and object-aligned: (8, 3) in the object's, the
    world's and the camera's axes (metres) and (8, 2) in pixels, NaN where the lens does not show the
    vertex, as behind the camera; vertex order and faces as in `viewsphere.geometry.box3d`. `visibility` is
    visible pixels over all the pixels the object alone would cover, those outside the image included (BOP's
    visib_fract, on a canvas of three times the image's width and height); `truncation` is the share of all
    these pixels that lies outside the image.

    For an animated model, `key` and all facts about the model are those of the frame's moment, and `track` is the key of the
    animated model, which is equal at all moments; otherwise `track` is empty.

    An imported object has `source`, its annotation in the imported data set; values that the annotation lacks are NaN, and
    key and model may be empty. If it lacks a mask, the mask is empty, but `box2d` and `area` are the annotation's.

    `extra` holds the fields of requested labels, and of labels from other packages; these fields are attributes, too. So are
    the fields of labels that can be derived from any data set, requested or not.
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
        """Visible pixels, (H, W) bool. Raises UserError for invalid run lengths, which an imported data set may contain."""
        from viewsphere.codecs.size import check_size
        from viewsphere.geometry.mask import decode_rle

        check_size(self.rle.width, self.rle.height)
        try:
            return decode_rle(self.rle.height, self.rle.width, self.rle.counts)
        except ValueError as error:
            raise StoreError(f"object {self.id}: expected a mask, found {error}") from None

    @property
    def polygons(self) -> list[list[float]]:
        """COCO polygons of the mask, traced along pixel corners: pycocotools rasterises them to the
        identical mask.
        """
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
    """One sensor's picture at one instant: camera, pose, objects and channels. `channels` maps names to arrays, loaded on
    access. Imported pictures may have no known camera and pose; these have an `image_size`.
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

    def __repr__(self) -> str:
        size = f"{self.width} x {self.height} pixels"
        taken = f"{self.sequence}, {self.sensor}, {self.time:g} s, " if self.sequence else ""
        objects = quantity(len(self.objects), "object")
        return f"<Sample {self.index} ({self.split}): {taken}{size}, {objects}; {', '.join(self.channels)}>"

    @property
    def camera(self) -> Camera:
        """The camera; raises StoreError for an imported picture without a known camera."""
        if self.known_camera is None:
            raise StoreError(f"frame {self.index}: an imported picture has no camera")
        return self.known_camera

    @property
    def pose(self) -> Viewpoint:
        """The camera's viewpoint; raises StoreError for an imported picture without a known pose."""
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
    def picture(self) -> NDArray[np.uint8]:
        """The colours, (H, W, 3), or (H, W, 4) if only the picture without its background is stored.

        Raises AttributeError if neither picture is stored.
        """
        return getattr(self, picture_of(self.channels) or "rgb")

    @property
    def picture_file(self) -> str | None:
        """Path of the file of `picture`, relative to the data set's root; None without a picture."""
        return self.files.get(picture_of(self.files) or "")

    def point_cloud(self, axes: Axes = "camera", surface: Surface = "visible") -> PointCloud:
        """Return the picture's visible points, or the points of `surface_samples`, in the axes of the camera or the world.

        The cloud has colours, objects, categories and normals if their channels are stored. Any lens is supported.

        surface `visible`: a point for each pixel that shows a surface, row by row, by `depth_ray`, else by `depth`. surface
        `complete`: the points of `surface_samples` on all objects, visible or not, without colours. Raises StoreError where
        these are not kept, or the camera is not known; UserError for other axes or surfaces.
        """
        from viewsphere.model.annotations.point_cloud import PointCloud

        return PointCloud.of(self, axes, surface)

    @property
    def voxel_grid(self) -> VoxelGrid:
        """The cells of the channel `voxels` as arrays. Raises StoreError if it is not stored, or has another grid than the
        recipe's.
        """
        from viewsphere.model.annotations.voxels import Grid, VoxelGrid, Voxels

        if "voxels" not in self.channels:
            raise StoreError(f"frame {self.index}: expected the channel voxels, found none: add it to the recipe's channels")
        try:
            return VoxelGrid.of(
                self.channels["voxels"], Grid.of(Voxels.model_validate(self.options.get("voxels", {})), self.camera)
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
