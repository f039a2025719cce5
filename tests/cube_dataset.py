"""A small data set of boxes, made without recipe and engine: labels from truth, pictures from the ids."""

from functools import partial
from pathlib import Path

import numpy as np

from small import still_channels
from viewsphere.assets.appearance.description import appearance_of
from viewsphere.assets.exporting.export import export_glb, export_obj
from viewsphere.assets.mesh import Mesh
from viewsphere.composing.viewpoints.camera import looking
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.diameter import diameter
from viewsphere.geometry.pose_category import pose_category
from viewsphere.labels import annotated, context_of, observe, sample_values
from viewsphere.model.annotations.metadata import ModelMetadata
from viewsphere.model.channel import PASSES
from viewsphere.model.fields.files import Files
from viewsphere.model.instant import Viewpoint
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.sample import Sample
from viewsphere.model.scene import Ground, Scene
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.rig import Rig
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Motion, Thing
from viewsphere.store import Block, Category, Dataset, ModelInfo, Part, PlanRecord, Store
from viewsphere.store.shots.records import PRODUCT
from viewsphere.truth.raster.geometry import build_geometry
from viewsphere.truth.raster.visibility import rasterize
from viewsphere.truth.shot_views import views_of

HALVES = ((0, 1, 2), (0, 2, 3))
TRIANGLES = np.array([[face[i] for i in half] for face in Box3d.numbered_faces().values() for half in HALVES], np.int32)
CHANNELS = still_channels()
FEW = ("rgb", "depth", "instances")
"""For tests of what is in none of the others, which take half the time."""
PLAIN = Files()
LENS = Intrinsics(width=96, height=72, fx=80, fy=80, cx=48, cy=36)
CATEGORIES = (Category(1, "hair_drier", "appliance"), Category(2, "gizmo", ""), Category(3, "car", "vehicle"))


def block(width: float, length: float, height: float) -> Mesh:
    half = np.array([width, length, height]) / 2
    vertices = Box3d.between(-half, half).corners.astype(np.float32)
    normals = (vertices / np.linalg.norm(vertices, axis=1, keepdims=True)).astype(np.float32)
    zeros = np.zeros(len(TRIANGLES), np.int32)
    return Mesh(vertices, TRIANGLES, normals, zeros, zeros)


MESHES = (block(0.6, 1.0, 0.5), block(1.0, 0.3, 0.9), block(0.2, 1.4, 0.2))
POSES = tuple(
    Viewpoint(
        index=i, azimuth_deg=a, elevation_deg=e, distance=2.2, tilt_deg=t, target=(0, 0, 0), category=pose_category(a, e)
    )
    for i, (a, e, t) in enumerate([(0, 10, 0), (70, 35, 12), (200, 60, 0), (300, -20, 0)])
)  # fmt: skip


def spec(index: int) -> ModelSpec:
    category = CATEGORIES[index]
    return ModelSpec(
        key=f"block-{index}", source="x.obj", category=category.name, supercategory=category.supercategory,
        category_id=category.id, real_size=(0.1, 0.2, 0.3) if index == 1 else None,
    )  # fmt: skip


def placed(offsets: dict[int, tuple[float, float, float]]) -> tuple[Thing, ...]:
    return tuple(
        Thing(id=i, model=spec(m), motion=Motion.still(((1, 0, 0, x), (0, 1, 0, y), (0, 0, 1, z), (0, 0, 0, 1))))
        for i, (m, (x, y, z)) in enumerate(offsets.items(), 1)
    )


def render(shot: Shot):
    meshes = [MESHES[int(p.model.key[-1])] for p in shot.things]
    geometry = build_geometry(shot.things, meshes, shot.scene.ground is not None, shot.label_alpha)
    boxes = [Box3d.between(*m.bounds).corners for m in meshes]
    files = [f"store/models/{p.model.key}/{p.model.key}.obj" for p in shot.things]
    views = views_of(shot, lambda thing: MESHES[int(thing.model.key[-1])])
    for number, instant, sensor in shot.samples:
        now, camera = shot.instants[instant], shot.camera(instant)
        visibility = rasterize(geometry, camera)
        names = {"instances", *shot.channels} - set(PASSES)
        channels = dict(observe(geometry, camera, visibility, names, options=shot.labels))
        colors = (channels["instances"][..., None] * np.array([90, 60, 30])).astype(np.uint8)
        alpha = np.where(channels["instances"] > 0, 255, 0).astype(np.uint8)
        channels |= {"rgb": colors, "rgba": np.dstack([colors, alpha])}
        channels = {name: channels[name] for name in shot.channels}
        metadata = [partial(ModelMetadata, diameter(mesh.vertices), looks=partial(appearance_of, mesh)) for mesh in meshes]
        context = context_of(
            shot, instant, camera, geometry, visibility, boxes, files, None, views.neighbours(instant, sensor), metadata
        )
        objects = annotated(context)
        more = sample_values(context, objects)
        told = {"instant": now.index, "requested": shot.annotations, "extra": more, "options": shot.labels}
        yield Sample(number, now.split, camera, now.viewpoint, objects, channels, {}, **told)


def shots(several: bool, channels: tuple[str, ...], intrinsics: Intrinsics, ground: bool, files: Files, **more) -> list[Shot]:
    """Three models by four poses, or four frames of three boxes, one of them always out of sight."""
    scenes = [{0: (0, 0, 0), 1: (0.5, 0.8, 0), 2: (0, 50, 0)}] if several else [{m: (0, 0, 0)} for m in range(3)]
    names, made = subjects(several), []
    for s, offsets in enumerate(scenes):
        splits = ["val" if (p.index if several else s) == 2 else "train" for p in POSES]
        first = s * len(POSES)
        instants = (looking(p, (0, 0, 0), index=first + p.index, split=split) for p, split in zip(POSES, splits, strict=True))
        made.append(
            Shot(
                key=f"{names[s]}-000000", things=placed(offsets), rig=Rig.single(intrinsics), channels=channels, first=first,
                instants=tuple(instants),
                scene=Scene(ground=Ground() if ground else None), files=files, **more,
            )
        )  # fmt: skip
    return made


def subjects(several: bool) -> tuple[str, ...]:
    return ("several",) if several else tuple(f"block-{i}" for i in range(3))


def make(
    root: Path,
    several=False,
    channels=CHANNELS,
    intrinsics=LENS,
    ground=False,
    leave_out=(),
    short=True,
    files=PLAIN,
    annotations=(),
    labels=None,
) -> Dataset:
    """Write the data set; shots whose number is in `leave_out` stay unfinished. Records are `short`, or whole without shots."""
    planned = shots(several, channels, intrinsics, ground, files, annotations=annotations, labels=labels or {})
    recipe = {"annotations": annotations} if annotations else {}
    frames = sum(len(s.instants) for s in planned)
    store = Store(root)
    store.open_for(
        PlanRecord(
            version="1", digest="d", name="blocks", recipe=recipe, categories=CATEGORIES, splits=("train", "val"),
            channels=channels, models=tuple(f"block-{i}" for i in range(3)), poses=len(POSES),
            frames=frames, max_objects=3 if several else 1,
            parts=(
                Part(
                    "d", "1", "blocks", recipe, channels, 0, frames, 3 if several else 1,
                    blocks=(Block(subjects(several), ((0, len(POSES)),)),), sampler="scenes" if several else PRODUCT,
                    shot_frames=len(POSES), settings={"recipe": "d"},  # imported parts have none
                ),
            ),
        )
    )  # fmt: skip
    for i, mesh in enumerate(MESHES):
        s, (low, high) = spec(i), mesh.bounds
        width, length, height = (high - low).tolist()
        with store.scratch_folder(store.model_folder(s.key)) as folder:
            export_obj(mesh, folder, s.key)
            export_glb(mesh, folder / f"{s.key}.glb")
            info = ModelInfo(
                s.key, s.category, s.supercategory, s.category_id, f"store/models/{s.key}/{s.key}.obj",
                f"store/models/{s.key}/{s.key}.glb", Box3d.between(low, high).corners, (width, height, length), s.real_size,
                mesh.parts, len(mesh.triangles), "d", diameter=diameter(mesh.vertices),
                looks=appearance_of(mesh) if annotations else None,
            )  # fmt: skip
            store.write_model_info(folder, info)
    for i, shot in enumerate(planned):
        if i not in leave_out:
            store.write_shot(shot.key, render(shot), kinds=files, shot=shot if short else None)
    return Dataset(root)
