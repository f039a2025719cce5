"""Virtual KITTI, in the tree of version 1.3.1 or of 2: videos with depth, segmentation, flow, tracked boxes in 2D and 3D and
cameras.

    Scene<sequence>/<variation>/frames/rgb/Camera_0/rgb_00000.jpg     version 2; Camera_1 is the right one of a rectified pair
    .../frames/depth/Camera_0/depth_00000.png                         16 bits, cm along z; 65535: none, or farther
    .../frames/classSegmentation/Camera_0/classgt_00000.png           colours of colors.txt
    .../frames/instanceSegmentation/Camera_0/instancegt_00000.png     8 bits, track id + 1, 0 for none
    .../frames/forwardFlow/Camera_0/flow_00000.png                    all but the last frame
    .../frames/backwardFlow/Camera_0/backwardFlow_00001.png           all but the first
    .../frames/forwardSceneFlow/Camera_0/sceneFlow_00000.png
    .../frames/backwardSceneFlow/Camera_0/backwardSceneFlow_00001.png
    Scene<sequence>/<variation>/{intrinsic,extrinsic,bbox,pose,info,colors}.txt

    vkitti_1.3.1_rgb/<sequence>/<variation>/00000.png                 version 1.3.1, of one camera
    vkitti_1.3.1_{depthgt,flowgt}/<sequence>/<variation>/00000.png    as above
    vkitti_1.3.1_scenegt/<sequence>/<variation>/00000.png             a colour for each object and each background class
    vkitti_1.3.1_scenegt/<sequence>_<variation>_scenegt_rgb_encoding.txt
    vkitti_1.3.1_extrinsicsgt/<sequence>_<variation>.txt
    vkitti_1.3.1_motgt/<sequence>_<variation>.txt

Frames count from 0, a track id is the object's id less 1, and every text starts with a line of column names. Flow: 16 bits; red
is (flow / (width - 1) + 1) / 2 * 65535, green the same with the height; blue is 65535, or 0 for unknown flow and flow longer
than the picture's width or height. Scene flow: 16 bits, red, green and blue are x, y and z, (metres / 10 + 1) / 2 * 65535, in
the axes of each instant's own camera. Longer motion is clipped; unknown motion looks like none.

Extrinsics transform the world to the camera (x right, y down, z ahead), in metres; the world's y points down: viewsphere's (x,
-z, y). The origin of intrinsics is the first pixel's centre. 2D boxes are the first and last column and row of the visible
pixels; occupancy is their share of that box. Object positions are the centre of the box's bottom. Rotations turn the object (x
right, y down, z ahead) by z (roll), x (pitch) and y + pi/2: y is 0 for an object that looks along x, as in KITTI. Metres,
radians. Invisible objects have no line. Object colours come from the label `looks` if the data set keeps it; otherwise they are
Unknown.

Classes are Virtual KITTI's where they exist: ground is Terrain, road markings are Road, fences and furniture Misc. Categories
keep their names (car: Car, van: Van, truck: Truck). In version 1.3.1 `truncated` is 0 (not), 1 or 2 (more than half),
`occluded` is the data set's occlusion level, and no object is DontCare.

Not stored: splits, keypoints and parts, names of sensors. Not verified with the original files: the threshold of version
1.3.1's `truncated`, and the header of its encoding. The position at the bottom and the order of rotations follow from a few
published lines. Sources: Gaidon et al. 2016, "Virtual Worlds as Proxy for Multi-Object Tracking Analysis", and Cabon et al.
2020, "Virtual KITTI 2", https://europe.naverlabs.com/research/computer-vision/proxy-virtual-worlds-vkitti-2/.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal

from pydantic import Field

from viewsphere.formats import Scope
from viewsphere.formats.shared.writing import refusals
from viewsphere.formats.shared.writing.pictures import depth_png, picture
from viewsphere.formats.shared.writing.sequences import Eyes, instants, scene, two_eyes
from viewsphere.formats.shared.writing.tree import File, Layout, Piece, Tree, functions
from viewsphere.formats.vkitti import maps, rows
from viewsphere.formats.vkitti.names import Names
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import Sample
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset

MOST = 255
FAR = 65535
BACKWARD = ("backwardFlow", "backwardSceneFlow")


class _Options(Frozen):
    """The version of Virtual KITTI, and its weather."""

    version: Literal["1.3.1", "2"] = Field(default="2", description="of the tree: one camera, or two and more maps")
    variation: str | None = Field(
        default=None,
        pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$",
        max_length=64,
        description="name of the folder that tells renderings of one world apart: clone, fog, morning, ...; by default that of "
        "the recipe's variation, else clone",
    )


def _needs(options: _Options) -> tuple[str, ...]:
    """Return the motion of objects, and the additional channels of version 2."""
    return ("velocity", *(("flow_backward", "scene_flow", "scene_flow_backward") if options.version == "2" else ()))


def _refuses(scope: Scope, options: _Options) -> Iterator[str]:
    """Reasons to refuse: still pictures, unsupported rigs and lenses, more objects or categories than colours, and names with
    spaces or colons.
    """
    yield from refusals.sequences(scope)
    yield from two_eyes(scope) if options.version == "2" else refusals.one_sensor(scope)
    yield from refusals.pinhole(scope)
    yield from refusals.no_skew(scope)
    yield from refusals.most_objects(scope, MOST)
    yield from refusals.most_categories(scope, MOST)
    yield from refusals.plain_names(scope, r"[^\s:]+", "without spaces and :")


class _VKitti(Tree):
    """The tree of a version."""

    def __init__(self, dataset: Dataset, options: _Options) -> None:
        super().__init__(dataset)
        self._old, self._variation = options.version == "1.3.1", options.variation
        self._eyes, self._names = Eyes(dataset), Names.from_classes(dataset.classes)

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """A picture, its maps, and its lines of each text."""
        yield from self._one(sample) if self._old else self._two(sample)

    def layout(self, path: str, counts: Mapping[str, int]) -> Layout:
        """A line of column names, then the lines of all frames. Text common to all frames is the name of a section, and is
        written once.
        """
        name = path.rpartition("/")[2]
        told = [f"{line[1:]}\n".encode() for line in sorted(counts, key=rows.track) if line]
        if name.endswith("_encoding.txt"):
            return (self._names.table("Category(:id) r g b"), *told)
        if name == "colors.txt":
            return (self._names.table("Category r g b", things=True),)
        key = name.removesuffix(".txt") if path.startswith("Scene") else path.partition("/")[0].removeprefix("vkitti_1.3.1_")
        return (f"{rows.HEADS[key]}\n".encode(), "", *told)

    def _one(self, sample: Sample) -> Iterator[File | Piece]:
        (world, variation), frame = self._place(sample), f"{sample.instant:05d}.png"
        for kind, content in (
            ("rgb", picture(sample, ".png")),
            ("depthgt", depth_png(sample, 0.01, FAR, FAR)),
            ("scenegt", maps.scene_png(sample, self._names)),
            ("flowgt", maps.flow_png(sample, "flow") if self._has_next(sample) else None),
        ):
            if content is not None:
                yield File(f"vkitti_1.3.1_{kind}/{world}/{variation}/{frame}", content)
        text = f"{world}_{variation}"
        yield Piece(f"vkitti_1.3.1_extrinsicsgt/{text}.txt", rows.line(sample.instant, *rows.extrinsics(sample.camera)))
        yield Piece(f"vkitti_1.3.1_motgt/{text}.txt", rows.tracked(sample, self._names))
        for encoded in rows.encodings(sample, self._names):
            yield Piece(f"vkitti_1.3.1_scenegt/{text}_scenegt_rgb_encoding.txt", b"", encoded)

    def _two(self, sample: Sample) -> Iterator[File | Piece]:
        camera = int(self._eyes.side(sample) == "right")
        world, variation = self._place(sample)
        root, frame = f"Scene{world}/{variation}", f"{sample.instant:05d}"
        for kind, name, content in (
            ("rgb", f"rgb_{frame}.jpg", picture(sample, ".jpg")),
            ("depth", f"depth_{frame}.png", depth_png(sample, 0.01, FAR, FAR)),
            ("classSegmentation", f"classgt_{frame}.png", maps.class_png(sample, self._names)),
            ("instanceSegmentation", f"instancegt_{frame}.png", maps.instance_png(sample)),
        ):
            yield File(f"{root}/frames/{kind}/Camera_{camera}/{name}", content)
        for way, tail, names in (("forward", "", ("flow", "sceneFlow")), ("backward", "_backward", BACKWARD)):
            if sample.instant if tail else self._has_next(sample):
                flow, scene_flow = (f"Camera_{camera}/{name}_{frame}.png" for name in names)
                yield File(f"{root}/frames/{way}Flow/{flow}", maps.flow_png(sample, f"flow{tail}"))
                yield File(f"{root}/frames/{way}SceneFlow/{scene_flow}", maps.scene_flow_png(sample, f"scene_flow{tail}"))
        for kind, data in rows.texts(sample, camera).items():
            yield Piece(f"{root}/{kind}.txt", data)
        yield Piece(f"{root}/colors.txt", b"")
        for told in rows.infos(sample, self._names):
            yield Piece(f"{root}/info.txt", b"", told)

    def _place(self, sample: Sample) -> tuple[str, str]:
        """The names of a sample's world and of its variation; renderings of one world differ in the variation."""
        name = scene(sample)
        if self._variation is None and sample.variation:
            return name.removesuffix(f"-{sample.variation}"), sample.variation
        return name, self._variation or "clone"

    def _has_next(self, sample: Sample) -> bool:
        return sample.instant < instants(self.dataset, sample) - 1


preparer, writer, verify = functions(_VKitti)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("depth", "segmentation", "flow", "scene flow", "boxes", "3D boxes", "tracks", "cameras", "stereo"),
    read_by=("pandas", "numpy"),
    options=_Options,
    channels=("rgb", "depth", "instances", "semantic", "flow"),
    names_credits=False,
    needs=_needs,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
