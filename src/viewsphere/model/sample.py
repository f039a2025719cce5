"""A sample: one frame's pictures and everything that is known of its objects."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import StoreError
from viewsphere.model.camera import Camera
from viewsphere.model.channel import picture_of
from viewsphere.model.instant import Viewpoint
from viewsphere.model.model_spec import Size
from viewsphere.model.rig import CAMERA

Float = NDArray[np.float64]
Box = tuple[float, float, float, float]


@dataclass(frozen=True)
class View:
    """The camera as one object sees it: its orbit around the object's box centre, in the object's own axes.

    A camera that does not look at that point counts, for the tilt, as turned to it by the shortest way.
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

    Boxes are half-open pixel corners (x0, y0, x1, y1). `box2d` is tight around the visible pixels, None if
    there are none; `box2d_projected` is the box of the projected model clipped to the image, None where
    they do not meet; `box2d_unclipped` the same unclipped, None where the model reaches behind the camera
    (or out of a distorted lens' field). The 3D box is tight and object-aligned: (8, 3) in the object's, the
    world's and the camera's axes (metres) and (8, 2) in pixels, NaN where the lens does not show the
    vertex, as behind the camera; vertex order and faces as in `viewsphere.geometry.box`. `visibility` is
    visible pixels over all the pixels the object alone would cover, those outside the image included (BOP's
    visib_fract, on a canvas of three times the image's width and height); `truncation` is the share of the
    latter outside the image.

    Of an animated model, `key` and all that is said of the model are those of the frame's moment; `track` is the key of the
    model that stays itself, else empty.

    An object of an imported data set has `source`, its annotation there; what that does not say is NaN, and its
    key and model may be empty. Where it says no mask, the mask is empty, but `box2d` and `area` are the source's.

    `more` are fields of labels that others than viewsphere bring; they are attributes, too.
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
    view: View
    pose_category: str
    size: Size
    real_size: Size | None
    visibility: float
    truncation: float
    source: Mapping[str, Any] | None = None
    # Factories leave no attribute on the class, so that `__getattr__` of a subclass is asked for these, too.
    track: str = field(default_factory=str)
    more: Mapping[str, Any] = field(default_factory=dict[str, Any])

    def __getattr__(self, name: str) -> Any:
        """Fields in `more`; raises AttributeError for other names."""
        try:
            return self.__dict__["more"][name]
        except KeyError:
            raise AttributeError(f"an object has no {name!r}, or its data set does not keep it") from None

    @property
    def is_placed(self) -> bool:
        """Whether the object's place in space is known."""
        return not math.isnan(self.world_from_object[0, 0])

    @property
    def mask(self) -> NDArray[np.bool_]:
        """Visible pixels, (H, W) bool."""
        from viewsphere.geometry.mask import decode_rle

        return decode_rle(self.rle.height, self.rle.width, self.rle.counts)

    @property
    def polygons(self) -> list[list[float]]:
        """COCO polygons of the mask, traced along pixel corners: pycocotools rasterises them to the
        identical mask.
        """
        from viewsphere.geometry.mask import mask_polygons

        return mask_polygons(self.mask)


@dataclass(frozen=True, eq=False)
class Sample:
    """One sensor's picture at one instant: camera, pose, objects and channels. `channels` maps names to arrays (loaded
    when asked). Pictures that were imported may have no known camera and pose; `image_size` is theirs.
    """

    index: int
    split: str
    known_camera: Camera | None
    known_pose: Viewpoint | None
    objects: tuple[ObjectAnnotation, ...]
    channels: Mapping[str, NDArray[Any]]
    files: Mapping[str, str]  # channel -> path relative to the data set's root; empty in memory
    image_size: tuple[int, int] | None = None  # (width, height) where there is no camera to say it
    source: Mapping[str, Any] | None = None  # what the imported data set says of the picture
    sequence: str = ""  # of still pictures none
    sensor: str = CAMERA
    instant: int = 0  # counted from 0 in the sequence; of still pictures in the data set
    time: float = 0.0  # seconds from the sequence's first instant

    @property
    def camera(self) -> Camera:
        """Raises StoreError for an imported picture of which nobody knows the camera."""
        if self.known_camera is None:
            raise StoreError(
                f"frame {self.index}: expected a camera, found an imported picture: nobody knows where it was taken"
            )
        return self.known_camera

    @property
    def pose(self) -> Viewpoint:
        """Raises StoreError for an imported picture of which nobody knows the pose."""
        if self.known_pose is None:
            raise StoreError(f"frame {self.index}: expected a pose, found an imported picture: nobody knows where it was taken")
        return self.known_pose

    @property
    def width(self) -> int:
        """Pixels."""
        return self.image_size[0] if self.known_camera is None and self.image_size else self.camera.width

    @property
    def height(self) -> int:
        """Pixels."""
        return self.image_size[1] if self.known_camera is None and self.image_size else self.camera.height

    @property
    def picture(self) -> NDArray[np.uint8]:
        """The colours, (H, W, 3), or (H, W, 4) where only the picture without its background is kept.

        Raises AttributeError where neither is.
        """
        return getattr(self, picture_of(self.channels) or "rgb")

    @property
    def picture_file(self) -> str | None:
        """The file of `picture`, None if there is none."""
        return self.files.get(picture_of(self.files) or "")

    def __getattr__(self, name: str) -> NDArray[Any]:
        """Any channel by name: `sample.rgb`, `sample.depth`, `sample.instances`, ..."""
        if name.startswith("_") or "channels" not in self.__dict__:
            raise AttributeError(f"Sample has no attribute {name!r}")
        try:
            return self.channels[name]
        except KeyError:
            raise AttributeError(
                f"this sample has no channel {name!r}; it has {', '.join(self.channels)}: add it to the recipe's channels"
            ) from None
