"""SURREAL: videos of one person with depth, parts of the body, flow, normals and 24 joints, read by scipy and MATLAB.

    <split>/run0/<sequence>/<sequence>_c0001.mp4           the pictures of a clip, at most 100, at their own rate
    <split>/run0/<sequence>/<sequence>_c0001_depth.mat     depth_1, depth_2, ...: H x W single
    <split>/run0/<sequence>/<sequence>_c0001_segm.mat      segm_1, ...: H x W uint8
    <split>/run0/<sequence>/<sequence>_c0001_gtflow.mat    gtflow_1, ...: H x W x 2 single
    <split>/run0/<sequence>/<sequence>_c0001_normal.mat    normal_1, ...: H x W x 3 single
    <split>/run0/<sequence>/<sequence>_c0001_info.mat      joints and the camera, of all T pictures

Clips follow one another, without common pictures. Depth: metres along the camera's axis, 1e10 where nothing is. segm: 0, or the
part of the body, 1 to 24 in the order of the joints. gtflow: pixels right and down that a point has come since the picture
before, at where it is now, so `flow_backward` with the other sign; 0 where that is unknown, as all through a sequence's first
picture. normal: in the world's axes, 0 where nothing is.

info: joints3D, 3 x 24 x T single, metres in the world; joints2D, 2 x 24 x T single, pixels from the picture's corner, rounded;
camLoc, 3 x 1 single, metres; camDist, single, the depth of the pelvis in the clip's first picture; zrot, T x 1 single, radians
by which the model is turned about the vertical, counter-clockwise seen from above, 0 where it faces the camera; sequence
(`<sequence>_c0001`), clipNo, source (`viewsphere`), stride (0: percent that clips have in common); and, where backgrounds are
pictures, bg, their files' names without folders. An addition is K, 3 x 3 double, pixels from the corner: SURREAL's readers take
600, 0, 160; 0, 600, 120; 0, 0, 1 for granted, which is a picture of 320 x 240 with `focal_px: 600`.

As in SURREAL, the rotation from world to camera (x right, y down, z ahead) is [0 0 -1; 0 1 0; -1 0 0], whatever the camera: the
axes of a clip's world follow from it. Its determinant is -1, so that this world is a mirror image. camLoc is
(camDist, -h, 0), where h is how high the camera is: with a level camera, -y is up and the ground y = 0. joints2D are
K [R | -R camLoc] joints3D, rounded, exactly.

Joints are the model's named points, which joints of glTF files are by themselves, and parts the bones of its skin, or the
`body_parts` of its sidecar. They have SMPL's names (Pelvis, L_Hip, ..., with m_avg_ or f_avg_ before them or not), Mixamo's
(mixamorig:Hips, ...) or those of the game engine rig of Unreal and MakeHuman (pelvis, thigh_l, ...); all 24 joints have to be
there. All fingers are the hand's end. Joints are where the model has them, which is not where SMPL's regressor would put them.

Lost: pose, shape, gender and light, as there is no SMPL body (its licence is not free) and no light of spherical harmonics; and
cloth, a texture of that body. Videos lose some colour; their bytes are those of one version of ffmpeg, and `check` by another
tells that they differ. Refused: several people, moving cameras, lenses that distort, still pictures.

Verified with the file that the authors give with their script: types and shapes of info, the projection, and that -y is up. Not
verified: the sign of gtflow's x in the released files (the authors say that x of newly made data has to be negated), the axes
of normals, the depth where nothing is, and where zrot is 0 (in SURREAL it is a random turn). Writing needs the extras `mat` and
`video`. Source: Varol et al. 2017, "Learning from Synthetic Humans", https://github.com/gulvarol/surreal.
"""

from __future__ import annotations

from collections.abc import Iterator

from viewsphere.formats import Scope
from viewsphere.formats.shared import refusals
from viewsphere.formats.shared.timeline import unknown_shots
from viewsphere.formats.shared.tree import functions
from viewsphere.formats.shared.viewpoint_mat import scipy_io
from viewsphere.formats.surreal.writing import Surreal, film_encoder
from viewsphere.plugins.format import FormatSpec


def check() -> None:
    """Raise MissingExtraError where there is no scipy, or no ffmpeg."""
    scipy_io("surreal")
    film_encoder()


def needs() -> tuple[str, ...]:
    """The joints."""
    return ("keypoints",)


def refuses(scope: Scope) -> Iterator[str]:
    """Yield the reasons why a data set is not one person before one pinhole camera, and the sizes that videos cannot have."""
    yield from refusals.sequences(scope)
    yield from unknown_shots(scope)
    yield from refusals.one_sensor(scope)
    yield from refusals.pinhole(scope)
    if scope.most_objects > 1:
        yield f"expected one person in a picture; found up to {scope.most_objects:,} objects"
    for name, lens in refusals.lenses(scope):
        if lens.width % 2 or lens.height % 2:
            yield f"expected an even width and height, as MP4 has; found {lens.width} x {lens.height} of {name}"


preparer, writer, verify = functions(Surreal)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("videos", "depth", "body parts", "flow", "normals", "joints", "cameras"),
    read_by=("scipy", "MATLAB"),
    channels=("rgb", "depth", "instances", "body_parts", "flow_backward", "normals"),
    names_credits=False,
    needs=needs,
    refuses=refuses,
    check=check,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
