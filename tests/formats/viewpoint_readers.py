"""What MATLAB code of PASCAL3D+ and ObjectNet3D does with annotations, after their toolboxes; nothing of ours is in it."""

from __future__ import annotations

import numpy as np
from scipy.io import loadmat


def project_3d(x3d, view):
    """As the toolbox's project_3d.m does it: the camera's centre, two turns, a rolled picture with y up, its place."""
    a, e, theta = np.radians([view.azimuth, view.elevation, view.theta])
    d, size = view.distance, view.viewport * view.focal
    center = np.array([d * np.cos(e) * np.sin(a), -d * np.cos(e) * np.cos(a), d * np.sin(e)])
    a, e = -a, -(np.pi / 2 - e)
    about_z = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, np.cos(e), -np.sin(e)], [0, np.sin(e), np.cos(e)]])
    x = np.diag([size, size, -1]) @ about_x @ about_z @ (x3d - center).T
    x = np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]]) @ (x[:2] / x[2])
    return (x * [[1], [-1]]).T + np.array([view.px, view.py])


def rotation_matrix(a, e, theta):
    """As ObjectNet3D's rotation_matrix.m does it, radians."""
    a, e, theta = -a, np.pi / 2 + e, -theta
    about_z = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, np.cos(e), -np.sin(e)], [0, np.sin(e), np.cos(e)]])
    rolled = np.array([[np.cos(theta), -np.sin(theta), 0], [np.sin(theta), np.cos(theta), 0], [0, 0, 1]])
    return rolled @ about_x @ about_z


def project_3d_msid(x3d, view):
    """As ObjectNet3D's project_3d_msid.m does it, by which it draws its annotations."""
    a, e, theta = np.radians([view.azimuth, view.elevation, view.theta])
    d, size = view.distance, view.viewport * view.focal
    center = np.array([d * np.cos(e) * np.sin(a), -d * np.cos(e) * np.cos(a), d * np.sin(e)])
    x = np.diag([size, size, 1]) @ rotation_matrix(a, e, theta) @ (x3d - center).T
    return (x[:2] / x[2]).T + np.array([view.px, view.py])


def read(file):
    """A record and its objects."""
    record = loadmat(file, squeeze_me=True, struct_as_record=False)["record"]
    return record, np.atleast_1d(record.objects)


def true_pixels(dataset, o, sample, vertices):
    """Where the camera shows points of an object's CAD model, whose origin is the centre of its box; MATLAB's pixels."""
    center = next(info for info in dataset.models if info.key == o.key).box3d_object.mean(axis=0)
    points = (vertices + center) @ o.camera_from_object[:3, :3].T + o.camera_from_object[:3, 3]
    pixels = points @ sample.camera.K.T
    return pixels[:, :2] / pixels[:, 2:] + 0.5
