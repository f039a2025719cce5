"""The scene of a USD file as one mesh."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.primitive import FileFacts, Float, Primitive, assemble
from viewsphere.assets.readers.shared.named_points import NamedPoint, named_points
from viewsphere.assets.readers.shared.smoothing import creased
from viewsphere.assets.readers.shared.transform import moved
from viewsphere.assets.readers.usd.layers import opened
from viewsphere.assets.readers.usd.library import Gf, Usd, UsdGeom, UsdSkel
from viewsphere.assets.readers.usd.material import UsdMaterials
from viewsphere.assets.readers.usd.mesh import Influences, by_material, pieces_of, read_shape

KEYPOINT = "keypoint:"
"""The prefix of the display name of a prim that is a named point. In prim names, which cannot contain colons, it is
`keypoint_`.
"""

LEFT_OUT = ("BasisCurves", "NurbsCurves", "HermiteCurves", "NurbsPatch", "Points", "TetMesh", "Volume")


def read_usd(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """The file as rendered at its first frame, in its own axes and unit; each mesh is a part.

    Skins have the pose of that frame, instances are repeated, and guides and proxies are left out. For subdivision surfaces,
    the control cages are read. Raises ModelError.
    """
    stage = opened(folder)
    time = Usd.TimeCode(stage.GetStartTimeCode()) if stage.HasAuthoredTimeCodeRange() else Usd.TimeCode.EarliestTime()
    influences, joints = _skins_of(stage, time)
    scene = _Scene(folder, time, influences, UsdMaterials(folder, time))
    pieces = list(scene.below(stage.GetPseudoRoot(), np.eye(4), 1))
    if not pieces:
        why = f" ({folder.warnings[0].partition(': ')[2]})" if folder.warnings else ""
        raise folder.error(f"no triangles found that a render would show{why}; export the model as a mesh of faces")
    is_y = UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y
    points = dict(enumerate(scene.points or joints))
    facts = FileFacts(
        folder.model,
        folder.model.suffix[1:].lower(),
        "+y" if is_y else "+z",
        "+z" if is_y else "-y",
        float(UsdGeom.GetStageMetersPerUnit(stage)),
        keypoints=named_points(folder, points),
    )
    return assemble(folder, pieces, scene.materials, facts)


@dataclass(eq=False)
class _Scene:
    folder: ModelFolder
    time: Any
    influences: dict[str, Influences]
    looks: UsdMaterials
    materials: list[Material] = field(default_factory=list[Material])
    points: list[NamedPoint] = field(default_factory=list[NamedPoint])
    total: int = 0
    instances: int = 0
    _local: dict[str, list[Primitive]] = field(default_factory=dict[str, "list[Primitive]"])
    _names: dict[str, int] = field(default_factory=dict[str, int])

    def below(self, prim: Any, world: Float, depth: int, above: int | None = None) -> Iterator[Primitive]:
        """Yield all visible triangles below a prim with this world matrix."""
        self.folder.check("MAX_NESTING", depth, "prims within one another")
        for child in prim.GetFilteredChildren(Usd.TraverseInstanceProxies()):
            yield from self._prim(child, self._matrix(child, world), depth, above)

    def _prim(self, prim: Any, world: Float, depth: int, above: int | None) -> Iterator[Primitive]:
        if prim.IsA(UsdGeom.Imageable) and not self._is_shown(UsdGeom.Imageable(prim)):
            return
        point = _point_name(prim)
        if point:
            self.points.append(NamedPoint(point, world[:3, 3].copy(), above))
            above = len(self.points) - 1
        if prim.IsA(UsdGeom.PointInstancer):
            yield from self._instanced(UsdGeom.PointInstancer(prim), world, depth)
            return
        if prim.IsA(UsdGeom.Gprim):
            yield from self._drawn(prim, world)
        yield from self.below(prim, world, depth + 1, above)

    def _is_shown(self, prim: Any) -> bool:
        """Return whether a prim is not hidden itself; its ancestors are already known to be shown."""
        hidden = prim.GetVisibilityAttr().Get(self.time) == UsdGeom.Tokens.invisible
        return not hidden and prim.GetPurposeAttr().Get() not in (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy)

    def _matrix(self, prim: Any, parent: Float) -> Float:
        """The prim's matrix in the world."""
        if not prim.IsA(UsdGeom.Xformable):
            return parent
        form = UsdGeom.Xformable(prim)
        local = np.array(form.GetLocalTransformation(self.time)).T
        return local if form.GetResetXformStack() else parent @ local

    def _instanced(self, instancer: Any, world: Float, depth: int) -> Iterator[Primitive]:
        """The prototypes of a point instancer at its instances' poses."""
        matrices = instancer.ComputeInstanceTransformsAtTime(self.time, self.time)
        numbers = instancer.GetProtoIndicesAttr().Get(self.time) or ()
        targets = instancer.GetPrototypesRel().GetForwardedTargets()
        mask = instancer.ComputeMaskAtTime(self.time)
        numbers = [n for i, n in enumerate(numbers) if not mask or mask[i]]
        self.instances += len(matrices)
        self.folder.check("MAX_INSTANCES", self.instances, "instances")
        stage = instancer.GetPrim().GetStage()
        for number, matrix in zip(numbers, matrices, strict=False):
            prim = stage.GetPrimAtPath(targets[number]) if 0 <= number < len(targets) else None
            if prim:
                yield from self._prim(prim, world @ np.array(matrix).T, depth + 1, None)

    def _drawn(self, prim: Any, world: Float) -> Iterator[Primitive]:
        kind = str(prim.GetTypeName())
        if kind in LEFT_OUT:
            self.folder.warn(f"prims of type {kind} are left out")
            return
        own = prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim
        key = str(own.GetPath())
        if key not in self._local:
            self._local[key] = list(self._pieces(prim))
        part = self._unique(_part_name(prim)) if self._local[key] else ""
        self.total += sum(len(piece.triangles) for piece in self._local[key])
        self.folder.check("MAX_TRIANGLES", self.total, "triangles, all instances counted,")
        yield from (replace(moved(piece, world), part=part) for piece in self._local[key])

    def _pieces(self, prim: Any) -> Iterator[Primitive]:
        """A prim's triangles in its own axes, a piece for each material."""
        shape = read_shape(self.folder, prim, self.time)
        if shape is None:
            return
        for subset, triangles in by_material(shape):
            look = self.looks.look(prim if subset is None else subset)
            is_double = bool(UsdGeom.Gprim(prim).GetDoubleSidedAttr().Get(self.time))
            material, influences = (
                self._number(replace(look.material, double_sided=is_double)),
                self.influences.get(str(prim.GetPath())),
            )
            piece = pieces_of(shape, material, look.uvs, look.color, influences, triangles)
            yield piece if piece.normals is not None else creased(piece)

    def _number(self, material: Material) -> int:
        if material not in self.materials:
            self.materials.append(material)
        return self.materials.index(material)

    def _unique(self, name: str) -> str:
        number = self._names[name] = self._names.get(name, 0) + 1
        return name if number == 1 else f"{name}_{number}"


def _part_name(prim: Any) -> str:
    """The name of a prim, or of its parent transform if that holds only this prim, since programs write one for each object."""
    parent = prim.GetParent()
    is_alone = parent.GetTypeName() == "Xform" and len(parent.GetAllChildren()) == 1 and not parent.GetParent().IsPseudoRoot()
    named = parent if is_alone and not parent.IsA(UsdGeom.Gprim) else prim
    return str(named.GetDisplayName() or named.GetName())


def _point_name(prim: Any) -> str:
    """The name of the point that a prim represents, from `userProperties:keypoint`, its display name or its name; else
    empty.
    """
    attribute = prim.GetAttribute("userProperties:keypoint")
    said = attribute.Get() if attribute else None
    name = str(prim.GetDisplayName() or prim.GetName())
    plain = name.removeprefix(KEYPOINT).removeprefix("keypoint_")
    if isinstance(said, str) and said:
        return said
    return plain if said or plain != name else ""


def _skins_of(stage: Any, time: Any) -> tuple[dict[str, Influences], list[NamedPoint]]:
    """The skins of meshes, by the meshes' paths, and the skeletons' joints in the world; afterwards, the stage's meshes are
    skinned.

    The stage's session layer receives the skinned points.
    """
    influences, joints = dict[str, Influences](), list[NamedPoint]()
    roots = [prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Root)]
    if not roots:
        return influences, joints
    cache, places = UsdSkel.Cache(), UsdGeom.XformCache(time)
    for root in map(UsdSkel.Root, roots):
        cache.Populate(root, Usd.PrimDefaultPredicate)
        for binding in cache.ComputeSkelBindings(root, Usd.PrimDefaultPredicate):
            query = cache.GetSkelQuery(binding.GetSkeleton())
            if binding.GetSkinningTargets() and query:
                joints.extend(_joints(query, places, time, len(joints)))
            for target in binding.GetSkinningTargets():
                said = _influences(target, query, time)
                if said is not None:
                    influences[str(target.GetPrim().GetPath())] = said
    stage.SetEditTarget(stage.GetSessionLayer())
    instant = Gf.Interval() if time.IsDefault() else Gf.Interval(time.GetValue(), time.GetValue())
    for root in map(UsdSkel.Root, roots):
        UsdSkel.BakeSkinning(root, instant)
    return influences, joints


def _influences(target: Any, query: Any, time: Any) -> Influences | None:
    points = UsdGeom.PointBased(target.GetPrim()).GetPointsAttr().Get(time)
    if not target.HasJointInfluences() or points is None:
        return None
    found = target.ComputeVaryingJointInfluences(len(points), time)
    order = target.GetJointOrder() or (query.GetJointOrder() if query else None)
    if not found or not order:
        return None
    joints, weights = (np.asarray(array) for array in found)
    width = target.GetNumInfluencesPerComponent()
    return Influences(_names(order), joints.reshape(-1, width).astype(np.int64), weights.reshape(-1, width).astype(np.float64))


def _names(order: Sequence[Any]) -> tuple[str, ...]:
    """Unique names of joints: the last part of their paths, or the whole path if two share the last part."""
    paths = [str(path) for path in order]
    lasts = [path.rpartition("/")[2] for path in paths]
    return tuple(last if lasts.count(last) == 1 else path for last, path in zip(lasts, paths, strict=True))


def _joints(query: Any, places: Any, time: Any, first: int) -> list[NamedPoint]:
    """The joints of a skeleton, each below its parent."""
    world = np.array(places.GetLocalToWorldTransform(query.GetPrim())).T
    matrices = query.ComputeJointSkelTransforms(time) or ()
    topology, names = query.GetTopology(), _names(query.GetJointOrder())
    found = list[NamedPoint]()
    for i, (name, matrix) in enumerate(zip(names, matrices, strict=False)):
        place: Float = (world @ np.array(matrix).T)[:3, 3]
        parent = topology.GetParent(i)
        found.append(NamedPoint(name, place, None if parent < 0 else first + parent))
    return found
