"""The store: finished shots, each written to a scratch folder and moved into place when complete, and the data set that they
form. It is on a disk or at a URL (`places`).

    OUT/store/plan.json                        the plan made from the recipe
    OUT/store/models/<key>/                    the normalised model (OBJ, GLB) and model.json
    OUT/store/shots/<hh>/<shot>/frames.json    records of the shot's frames
    OUT/store/shots/<hh>/<shot>/shot.json      the scene that they show (scenery.json: its things that are not objects)
    OUT/store/shots/<hh>/<shot>/<channel>/<sample>.png|.tiff|...
    OUT/store/writing/                         incomplete folders; heartbeats of active runs
    OUT/store/failed/<k>-of-<n>.json           the last report of a shard's run, if it failed
    OUT/store/lock                             held briefly by a run that changes shared files

`hh` are the first two hexadecimal digits of the shot key's SHA-256, so that no folder grows large. Workers never share
a file.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from viewsphere.homes import names_of

if TYPE_CHECKING:
    from viewsphere.store.index import Block, Row
    from viewsphere.store.samples.channel_files import check_codecs, decode, depth_step, encode
    from viewsphere.store.samples.choice import Choice, frame_ranges
    from viewsphere.store.samples.dataset import Dataset, Exported
    from viewsphere.store.samples.simulated import Simulated
    from viewsphere.store.samples.watching import Finished, Watch
    from viewsphere.store.shots.folder import Store, kept_shot, new_folder
    from viewsphere.store.shots.records import Category, ModelInfo, Part, PlanRecord
    from viewsphere.urls import located

__all__ = [
    "Block",
    "Category",
    "Choice",
    "Dataset",
    "Exported",
    "Finished",
    "ModelInfo",
    "Part",
    "PlanRecord",
    "Row",
    "Simulated",
    "Store",
    "Watch",
    "check_codecs",
    "decode",
    "depth_step",
    "encode",
    "frame_ranges",
    "kept_shot",
    "located",
    "new_folder",
]

__getattr__ = names_of(
    __name__,
    {
        "Block": "viewsphere.store.index",
        "Category": "viewsphere.store.shots.records",
        "Choice": "viewsphere.store.samples.choice",
        "Dataset": "viewsphere.store.samples.dataset",
        "Exported": "viewsphere.store.samples.dataset",
        "Finished": "viewsphere.store.samples.watching",
        "ModelInfo": "viewsphere.store.shots.records",
        "Part": "viewsphere.store.shots.records",
        "PlanRecord": "viewsphere.store.shots.records",
        "Row": "viewsphere.store.index",
        "Simulated": "viewsphere.store.samples.simulated",
        "Store": "viewsphere.store.shots.folder",
        "Watch": "viewsphere.store.samples.watching",
        "check_codecs": "viewsphere.store.samples.channel_files",
        "decode": "viewsphere.store.samples.channel_files",
        "depth_step": "viewsphere.store.samples.channel_files",
        "encode": "viewsphere.store.samples.channel_files",
        "frame_ranges": "viewsphere.store.samples.choice",
        "kept_shot": "viewsphere.store.shots.folder",
        "located": "viewsphere.urls",
        "new_folder": "viewsphere.store.shots.folder",
    },
)
