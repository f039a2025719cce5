"""The features that work without packages of extras, and the messages where extras are needed."""

import subprocess
import sys
import textwrap

import pytest

from dae_files import document, faces, geometry, p
from deadline import DEADLINE
from small import ROOT

BLOCKED = """
import sys
for name in ("trimesh", "networkx", "lxml", "collada", "OpenEXR", "embreex", "scipy"):
    sys.modules[name] = None
from pathlib import Path
import viewsphere as vs
from viewsphere.errors import MissingExtraError
def refused(call, *words):
    try:
        call(*words)
    except MissingExtraError as error:
        return str(error)
"""


def said_without(body, folder):
    """The output of a script in a process without the packages of extras."""
    script = BLOCKED + textwrap.dedent(body)
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=folder, timeout=DEADLINE)
    assert run.returncode == 0, run.stderr
    return run.stdout.splitlines()


def test_models_in_xml_are_read(tmp_path):
    (tmp_path / "a.dae").write_text(document(geometry([(0, 0, 0), (1, 0, 0), (0, 1, 0)], faces("triangles", p([0, 1, 2])))))
    assert said_without(
        """
        from viewsphere.assets.load import load_model
        print(len(load_model(Path("a.dae"))[0].triangles))
        """,
        tmp_path,
    ) == ["1"]


def test_an_exr_environment_names_its_extra(tmp_path):
    (tmp_path / "sky.exr").write_bytes(b"\x76\x2f\x31\x01" + b"\0" * 100)
    (said,) = said_without(
        """
        from viewsphere.rendering.sky.environment_head import read_head
        from viewsphere.rendering.sky.environment_file import read_environment
        messages = {refused(read_head, Path("sky.exr")), refused(read_environment, Path("sky.exr"))}
        print(*messages, sep="|")
        """,
        tmp_path,
    )
    expected = "environment sky.exr: expected the package OpenEXR, found none"
    assert said == f"{expected}: pip install 'viewsphere[exr]', or take an HDR"


@pytest.mark.slow
def test_stable_poses_and_rays_name_their_extras(tmp_path):
    stable, rays = said_without(
        """
        import numpy as np
        from viewsphere.check.frames.rays import RayCaster
        from viewsphere.composing.layouts import stable_ways
        print(refused(stable_ways, np.eye(3)))
        print(refused(RayCaster, None, None))
        """,
        tmp_path,
    )
    assert stable.startswith("orientation: stable needs trimesh and networkx and scipy, which are not installed")
    assert stable.endswith("pip install 'viewsphere[physics]'")
    assert rays == "expected embreex and trimesh, found none: pip install 'viewsphere[check]'"


@pytest.mark.slow
def test_a_data_set_is_rendered_and_checked(tmp_path):
    frames, verdict = said_without(
        f"""
        sys.path.insert(0, {str(ROOT / "tests")!r})
        from small import small_recipe
        from viewsphere.check import check
        print(vs.generate(small_recipe(), "out").frames)
        print(check(vs.open("out")).verdict)
        """,
        tmp_path,
    )
    assert frames == "12"
    assert "surface" in verdict
