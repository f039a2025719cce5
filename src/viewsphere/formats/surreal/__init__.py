"""SURREAL: videos of one person with depth, body parts, flow, normals and 24 joints, for scipy and MATLAB.

    <split>/run0/<sequence>/<sequence>_c0001.mp4           the pictures of a clip, at most 100, at their own rate
    <split>/run0/<sequence>/<sequence>_c0001_depth.mat     depth_1, depth_2, ...: H x W single
    <split>/run0/<sequence>/<sequence>_c0001_segm.mat      segm_1, ...: H x W uint8
    <split>/run0/<sequence>/<sequence>_c0001_gtflow.mat    gtflow_1, ...: H x W x 2 single
    <split>/run0/<sequence>/<sequence>_c0001_normal.mat    normal_1, ...: H x W x 3 single
    <split>/run0/<sequence>/<sequence>_c0001_info.mat      joints and the camera, of all T pictures

Clips follow one another and share no pictures. Depth: metres along the camera's axis, 1e10 for the background. segm: 0, or the
body part, 1 to 24 in the order of the joints. gtflow: the pixels right and down that a point moved since the previous picture,
at its present position. It is `flow_backward` with the opposite sign; unknown flow is 0, as in a sequence's first picture.
normal: in the world's axes, 0 for the background.

info: joints3D, 3 x 24 x T single, metres in the world; joints2D, 2 x 24 x T single, pixels from the picture's corner, rounded;
camLoc, 3 x 1 single, metres; camDist, single, the depth of the pelvis in the clip's first picture; zrot, T x 1 single, the
model's rotation around the vertical in radians, counter-clockwise seen from above, 0 facing the camera; sequence
(`<sequence>_c0001`), clipNo, source (`viewsphere`), stride (0: percent that clips share); and, for background pictures, bg,
their file names without folders. An addition is K, 3 x 3 double, pixels from the corner. SURREAL's readers assume 600, 0, 160;
0, 600, 120; 0, 0, 1: a picture of 320 x 240 with `focal_px: 600`.

As in SURREAL, the rotation from world to camera (x right, y down, z ahead) is [0 0 -1; 0 1 0; -1 0 0] for every camera; it
defines the axes of a clip's world. Its determinant is -1, so this world is a mirror image. camLoc is (camDist, -h, 0), where h
is the height of the camera: with a level camera, -y is up and the ground y = 0. joints2D are K [R | -R camLoc] joints3D,
rounded, exactly.

Joints are the model's named points; joints of glTF files become named points by themselves. Parts are the bones of its skin, or
the `body_parts` of its sidecar. All 24 joints are required, named as in SMPL (Pelvis, L_Hip, ..., with or without m_avg_ or
f_avg_), Mixamo (mixamorig:Hips, ...) or the game engine rig of Unreal and MakeHuman (pelvis, thigh_l, ...). All fingers are the
hand's end. Joints have the model's positions, not those of SMPL's regressor.

Not stored: pose, shape, gender and light, because there is no SMPL body (its licence is not free) and no spherical harmonics
light; and cloth, a texture of that body. Videos lose some colour. Their bytes depend on the version of ffmpeg, and `check`
reports a difference with another version. Refused: several people, moving cameras, lenses with distortion, still pictures.

Verified with the file that the authors ship with their script: types and shapes of info, the projection, and -y up. Not
verified: the sign of gtflow's x in the released files (the authors negate x of new data), the axes of normals, the depth of the
background, and the zero of zrot (in SURREAL it is a random rotation). Writing needs the extras `mat` and `video`. Source: Varol
et al. 2017, "Learning from Synthetic Humans", https://github.com/gulvarol/surreal.
"""

from __future__ import annotations

from collections.abc import Iterator

from viewsphere.formats import Scope
from viewsphere.formats.shared.viewpoint_mat import scipy_io
from viewsphere.formats.shared.writing import refusals
from viewsphere.formats.shared.writing.timeline import unknown_shots
from viewsphere.formats.shared.writing.tree import functions
from viewsphere.formats.surreal.writing import Surreal, film_encoder
from viewsphere.plugins.format import FormatSpec


def _check() -> None:
    """Raise MissingExtraError if scipy or ffmpeg is missing."""
    scipy_io("surreal")
    film_encoder()


def _needs() -> tuple[str, ...]:
    """The required labels: the joints."""
    return ("keypoints",)


def _refuses(scope: Scope) -> Iterator[str]:
    """Yield the reasons why a data set is not one person in front of one pinhole camera, and the sizes that videos cannot
    have.
    """
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
    needs=_needs,
    refuses=_refuses,
    check=_check,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
