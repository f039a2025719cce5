"""The 6D pose of every object in a data set, as lines of numbers: python poses.py DATASET > poses.csv"""

import sys

import numpy as np

import viewsphere as vs

if len(sys.argv) != 2:
    print("expected a data set; found none: python poses.py DATASET > poses.csv", file=sys.stderr)
    sys.exit(2)

print("frame,object,category,qw,qx,qy,qz,tx,ty,tz,visibility")
for sample in vs.open(sys.argv[1]):
    for thing in sample.objects:
        camera_from_object = thing.camera_from_object  # (4, 4): object axes to camera axes, metres
        R, t = camera_from_object[:3, :3], camera_from_object[:3, 3]
        row = [*thing.quaternion, *t, thing.visibility]  # the quaternion is R's, w first
        print(f"{sample.index},{thing.id},{thing.category},{','.join(f'{value:.6f}' for value in row)}")

        # A check of the pose: R, t and K project the box's corners to their pixels.
        in_camera = thing.box3d_object @ R.T + t
        pixels = in_camera @ sample.camera.K.T
        pixels = pixels[:, :2] / pixels[:, 2:]
        assert np.allclose(pixels, thing.box3d_pixels, atol=1e-6)
