"""Reading of URDF, http://wiki.ros.org/urdf/XML: the visual meshes of all links, with every joint at zero.

Axes as in ROS, https://www.ros.org/reps/rep-0103.html: +X is ahead, +Z is up, metres.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.load import load_model, suffix_of
from viewsphere.assets.mesh import Material, Mesh
from viewsphere.assets.paths.folder import ModelFolder, UnreadableError
from viewsphere.assets.primitive import TEXTURE_FIELDS, FileFacts, Primitive, assemble
from viewsphere.assets.readers import reader_of
from viewsphere.assets.readers.shared.xml_tree import parse_xml
from viewsphere.errors import ModelError

Float = NDArray[np.float64]

PACKAGE = "package://"
SHAPES = {"box", "cylinder", "sphere", "capsule"}


def read_urdf(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """The meshes of a robot's visuals; each is a part `link/visual`.

    Raises ModelError for XML of another kind, joints in a circle, numbers that are none, and if no mesh can be read. A mesh
    that cannot be read is left out with a warning.
    """
    robot = parse_xml(folder, folder.read_model())
    if robot.tag != "robot":
        raise folder.error(f"expected a URDF, whose root is <robot>; found <{robot.tag:.40}>")
    places = _places(folder, robot)
    pieces, materials, unread = list[Primitive](), list[Material](), list[str]()
    for link in robot.findall("link"):
        name = link.get("name", "")
        for part, visual in _visuals(name, link.findall("visual")):
            for element in visual.findall("geometry/*"):
                place = places.get(name, np.eye(4)) @ _transform(folder, visual.find("origin"))
                pieces += _pieces(folder, part, element, place, materials, unread)
    if unread and not pieces:
        raise folder.error(f"no triangles found: no mesh of the robot can be read. The first: {unread[0]}")
    return assemble(folder, pieces, materials, FileFacts(folder.model, "urdf", "+z", "+x", 1.0))


def _visuals(link: str, visuals: Sequence[Element]) -> Iterator[tuple[str, Element]]:
    """The visuals of a link with the names of their parts."""
    for number, visual in enumerate(visuals):
        own = visual.get("name") or (str(number) if len(visuals) > 1 else "")
        yield f"{link}/{own}" if own else link, visual


def _places(folder: ModelFolder, robot: Element) -> Mapping[str, Float]:
    """The transform of each link that a joint moves, from its axes to those of the robot's root, with every joint at zero."""
    joints = dict[str, tuple[str, Float]]()
    for joint in robot.findall("joint"):
        parent, child = joint.find("parent"), joint.find("child")
        if parent is not None and child is not None:
            transform = _transform(folder, joint.find("origin"))
            joints[child.get("link", "")] = parent.get("link", ""), transform
    places = dict[str, Float]()
    for link in joints:
        chain: list[str] = []
        above = link
        while above in joints and above not in places:
            chain.append(above)
            above = joints[above][0]
            if above in chain:
                raise folder.error(f"joints in a circle: link {above!r:.60} is above itself")
        place = places.get(above, np.eye(4))
        for below in reversed(chain):
            place = places[below] = place @ joints[below][1]
    return places


def _transform(folder: ModelFolder, origin: Element | None) -> Float:
    """The transform of an <origin>: a rotation about the fixed axes x, y and z in turn, then a translation."""
    matrix = np.eye(4)
    if origin is None:
        return matrix
    roll, pitch, yaw = _numbers(folder, origin, "rpy", "0 0 0")
    (cr, cp, cy), (sr, sp, sy) = np.cos((roll, pitch, yaw)), np.sin((roll, pitch, yaw))
    matrix[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    matrix[:3, 3] = _numbers(folder, origin, "xyz", "0 0 0")
    return matrix


def _numbers(folder: ModelFolder, element: Element, name: str, default: str) -> tuple[float, float, float]:
    text = element.get(name, default)
    try:
        x, y, z = map(float, text.split())
    except ValueError:
        x = y = z = math.nan
    if not all(map(math.isfinite, (x, y, z))):
        raise folder.error(f"{name}: expected three numbers; found {text!r:.60}")
    return x, y, z


def _pieces(
    folder: ModelFolder, part: str, element: Element, place: Float, materials: list[Material], unread: list[str]
) -> Iterator[Primitive]:
    """The triangles of a visual's geometry in the robot's axes; its materials are added to `materials`, the reason why its
    mesh cannot be read to `unread`.
    """
    if element.tag in SHAPES:
        folder.leave_out(1, f"primitive {element.tag}")
    mesh = _mesh(folder, element.get("filename", ""), unread) if element.tag == "mesh" else None
    if mesh is None:
        return
    mesh, origin, unit = mesh
    scale = np.array(_numbers(folder, element, "scale", "1 1 1")) * unit
    turn, first, images = place[:3, :3] * scale, len(materials), len(folder.images)
    for image in mesh.images:
        folder.add_image(image)
    materials += [_renumbered(material, images) for material in mesh.materials]
    normals = mesh.normals.astype(np.float64) @ np.linalg.pinv(turn)
    for number in range(len(mesh.materials)):
        triangles = mesh.triangles[mesh.triangle_material == number].astype(np.int64)
        yield Primitive(
            part=part,
            material=first + number,
            positions=(mesh.vertices + np.array(origin)) @ turn.T + place[:3, 3],
            triangles=triangles if np.linalg.det(turn) > 0 else triangles[:, ::-1],
            normals=normals,
            uv0=None if mesh.uv0 is None else mesh.uv0.astype(np.float64),
            uv1=None if mesh.uv1 is None else mesh.uv1.astype(np.float64),
            colors=None if mesh.colors is None else mesh.colors.astype(np.float64),
        )


def _mesh(folder: ModelFolder, name: str, unread: list[str]) -> tuple[Mesh, tuple[float, float, float], float] | None:
    """The mesh in a file that a visual names, its origin and its unit; None, with a warning and its reason in `unread`,
    if it cannot be read.
    """
    try:
        path = folder.path_of(name.removeprefix(PACKAGE), "mesh")
        reader = reader_of(suffix_of(path))
        if reader is None or reader.by_blender or suffix_of(path) == "urdf":
            raise UnreadableError(f"mesh {name!r:.120} is a file of a kind that is not read in a URDF")
        mesh, facts = load_model(path, confined=folder.confined)
    except (UnreadableError, ModelError) as error:
        folder.warn(f"left out: {error}")
        unread.append(str(error))
        return None
    for file in facts.files:
        folder.remember(file)
    for warning in mesh.warnings:
        folder.warn(warning)
    return mesh, facts.origin, facts.unit


def _renumbered(material: Material, first: int) -> Material:
    """The material with the numbers of its images counted from `first`."""
    textures = {name: getattr(material, name) for name in TEXTURE_FIELDS}
    used = {name: replace(texture, image=texture.image + first) for name, texture in textures.items() if texture is not None}
    return replace(material, **used)
