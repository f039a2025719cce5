"""Amazon Berkeley Objects."""

from __future__ import annotations

import gzip
import json

from asset_trees import faces_front, planned, pointer, put
from viewsphere.assets.cache import load_normalised
from viewsphere.assets.exporting.glb import glb_bytes
from viewsphere.model.model_spec import ModelSpec


def test_models_have_the_product_type_of_their_listing(tmp_path):
    file = put(tmp_path / "pointer.obj", pointer("+y", "+z"))
    glb = glb_bytes(load_normalised(ModelSpec(key="a", source=str(file), category="a", category_id=1)))
    for name in ("B07X", "B08Y"):
        put(tmp_path / "abo" / "3dmodels" / "original" / name[-1] / f"{name}.glb", "").write_bytes(glb)
    listing = {"item_id": "1", "3dmodel_id": "B07X", "product_type": [{"value": "OFFICE_CHAIR"}]}
    lines = "\n".join([json.dumps(listing), '{"3dmodel_id": 3}', '"3dmodel_id"', json.dumps({"item_id": "2"})])
    put(tmp_path / "abo" / "listings" / "metadata" / "listings_0.json.gz", "").write_bytes(gzip.compress(lines.encode()))
    plan = planned(f"abo:{tmp_path}/abo")
    assert [(spec.key, spec.category) for spec in plan.model_specs] == [("B07X", "office chair"), ("B08Y", "object")]
    assert faces_front(plan.model_specs[0]) and plan.credits["B07X"].licence == "CC-BY-4.0"
    assert planned(f"abo:{tmp_path}/abo/3dmodels/original/Y").models == 1
