"""Files with flipped, cut and repeated bytes, and files that ask for too much: ModelError or a mesh, nothing else."""

import zipfile

import numpy as np
import pytest
import trimesh

from viewsphere.assets.load import load_model
from viewsphere.assets.readers.shared.instances import ENOUGH, count_instances
from viewsphere.errors import ModelError

DEPTH = 40
DAE_BOMB = (
    '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset/><library_nodes>'
    '<node id="n0"/>{nodes}</library_nodes><library_visual_scenes><visual_scene id="s"><node>'
    '<instance_node url="#n{depth}"/></node></visual_scene></library_visual_scenes>'
    '<scene><instance_visual_scene url="#s"/></scene></COLLADA>'
)


def damaged(data, rng):
    """A copy with a few bytes changed, cut or doubled, mostly near its head."""
    copy = bytearray(data)
    for _ in range(rng.integers(1, 6)):
        span = len(copy) if rng.random() < 0.3 else min(len(copy), 2000)
        at, length = int(rng.integers(max(span, 1))), int(rng.integers(1, 30))
        kind = rng.integers(4)
        if kind == 0:
            copy[at : at + 1] = bytes([rng.integers(256)])
        elif kind == 1:
            copy[at : at + 1] = str(rng.integers(10)).encode()
        elif kind == 2:
            del copy[at : at + length]
        else:
            copy[at:at] = copy[at : at + length]
    return bytes(copy)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["glb", "obj", "ply", "stl", "off", "dae", "3mf"])
def test_damage_costs_one_clear_error(kind, write, tmp_path):
    rng = np.random.default_rng(3)
    box = trimesh.creation.box()
    box.visual.vertex_colors = np.arange(32, dtype=np.uint8).reshape(8, 4)
    box.export(tmp_path / f"whole.{kind}")
    whole = (tmp_path / f"whole.{kind}").read_bytes()
    assert len(load_model(tmp_path / f"whole.{kind}")[0].triangles) == 12
    refused = 0
    for _ in range(250):
        path = write(f"damaged.{kind}", damaged(whole, rng))
        try:
            load_model(path)
        except ModelError as error:
            refused += 1
            assert f"damaged.{kind}" in str(error)
            assert "\n" not in str(error)
    assert refused > 20


def test_counting_follows_every_reference():
    assert count_instances({"": ["a", "a", "b"], "a": ["b", "b"]}, "") == (1 + 3 + 3 + 1, 3)
    assert count_instances({f"{i}": [f"{i + 1}"] * 2 for i in range(30)}, "0") == (2**31 - 1, 31)
    assert count_instances({f"{i}": [f"{i + 1}"] * 2 for i in range(9000)}, "0") == (ENOUGH, 9001)
    assert count_instances({"": ["a"], "a": ["b"], "b": ["a"]}, "")[0] is None
    assert count_instances({"": ["a", "b"], "a": ["b"], "b": []}, "") == (4, 3)
    assert count_instances({}, "") == (1, 1)


def test_nested_instances_may_not_explode(write, tmp_path):
    nodes = "".join(
        f'<node id="n{i}"><instance_node url="#n{i - 1}"/><instance_node url="#n{i - 1}"/></node>' for i in range(1, DEPTH + 1)
    )
    with pytest.raises(ModelError, match="instances"):
        load_model(write("bomb.dae", DAE_BOMB.format(nodes=nodes, depth=DEPTH)))
    objects = "".join(
        f'<object id="{i}"><components><component objectid="{i - 1}"/><component objectid="{i - 1}"/></components></object>'
        for i in range(1, DEPTH + 1)
    )
    model = f'<model><resources><object id="0"/>{objects}</resources><build><item objectid="{DEPTH}"/></build></model>'
    with zipfile.ZipFile(tmp_path / "bomb.3mf", "w") as archive:
        archive.writestr("3D/3dmodel.model", model)
    with pytest.raises(ModelError, match="instances"):
        load_model(tmp_path / "bomb.3mf")
