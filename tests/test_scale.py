"""What docs/scale.md says is true: the Slurm script runs by a stand-in for Slurm, Kubernetes' own schema fits its manifest."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import jsonschema
import pytest
import yaml

from deadline import DEADLINE
from small import ROOT, small_recipe, tree_hash

PAGE = (ROOT / "docs" / "scale.md").read_text("utf-8")
SCHEMA = Path(__file__).parent / "kubernetes_job.schema.json"


def block(kind, holding):
    (text,) = (text for text in re.findall(rf"```{kind}\n(.*?)```", PAGE, re.DOTALL) if holding in text)
    return text


def viewsphere_for(folder):
    """A PATH on which `viewsphere` is the one that is tested."""
    tool = folder / "bin" / "viewsphere"
    tool.parent.mkdir()
    tool.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m viewsphere "$@"\n')
    tool.chmod(0o755)
    return f"{tool.parent}:{os.environ['PATH']}"


def submit(script, folder, tasks, path):
    """What `sbatch` does with an array: the script once a task, with Slurm's variables; all at once, in the folder."""
    runs = []
    for k in range(tasks):
        told = {"SLURM_ARRAY_TASK_ID": f"{k}", "SLURM_ARRAY_TASK_COUNT": f"{tasks}", "SLURM_CPUS_PER_TASK": "0"}
        env = {**os.environ, **told, "PATH": path, "OUT": "out"}
        runs.append(subprocess.Popen(["bash", script], cwd=folder, env=env, stderr=subprocess.PIPE))
    for run in runs:
        _, problem = run.communicate(timeout=DEADLINE)
        assert run.returncode == 0, problem


@pytest.mark.slow
def test_the_slurm_script_renders_the_whole_data_set(small_run, tmp_path):
    script = block("bash", "#SBATCH --array=0-")
    (tmp_path / "shards.sh").write_text(script)
    (tmp_path / "recipe.yaml").write_text(small_recipe().to_yaml())
    submit("shards.sh", tmp_path, 2, viewsphere_for(tmp_path))
    assert tree_hash(tmp_path / "out") == tree_hash(small_run)


def manifest():
    return yaml.safe_load(block("yaml", "kind: Job"))


def test_the_kubernetes_manifest_is_valid():
    validator = jsonschema.Draft7Validator(json.loads(SCHEMA.read_text("utf-8")))
    assert [error.message for error in validator.iter_errors(manifest())] == []
    wrong = manifest()
    wrong["spec"]["completions"] = "many"
    wrong["spec"]["template"]["spec"]["containers"][0]["image_"] = "x"
    assert len(list(validator.iter_errors(wrong))) == 2


def test_the_kubernetes_manifest_shards_as_it_counts():
    """What its own schema does not say: https://kubernetes.io/docs/concepts/workloads/controllers/job/."""
    spec = manifest()["spec"]
    (container,) = spec["template"]["spec"]["containers"]
    assert spec["completionMode"] == "Indexed" and spec["template"]["spec"]["restartPolicy"] == "Never"
    assert f'--shard "$JOB_COMPLETION_INDEX/{spec["completions"]}"' in container["args"][0]
    mounted = {mount["name"] for mount in container["volumeMounts"]}
    assert mounted == {volume["name"] for volume in spec["template"]["spec"]["volumes"]}


@pytest.mark.slow
def test_a_pod_s_command_runs(tmp_path):
    spec = manifest()["spec"]
    (container,) = spec["template"]["spec"]["containers"]
    recipe = small_recipe(formats=[], channels=["rgb"]).to_yaml()
    (tmp_path / "recipe.yaml").write_text(recipe)
    text = (
        container["args"][0]
        .replace("/data", str(tmp_path))
        .replace(f"/{spec['completions']}", "/2")
        .replace("--workers 4", "--workers 0")
    )
    env = {**os.environ, "PATH": viewsphere_for(tmp_path), "JOB_COMPLETION_INDEX": "1"}
    run = subprocess.run([*container["command"], text], env=env, capture_output=True, text=True, timeout=DEADLINE)
    assert run.returncode == 0, run.stderr
    assert "6 frames (6 new" in run.stdout
