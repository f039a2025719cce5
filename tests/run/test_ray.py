"""The Ray executor makes what a local run makes, whatever happens to the nodes of the cluster."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import jsonschema
import pytest
import yaml

from command_line import viewsphere
from deadline import DEADLINE, until
from ray_nodes import SMALL, ray_cluster
from small import ROOT, small_recipe, tree_hash
from viewsphere import generate

RECIPE = {
    "viewpoints": {"azimuth": [60 * i for i in range(6)], "elevation": [15, 50], "distance": 1.0},
    "camera": {"size": [640, 480], "fov_deg": 35},
    "channels": ["rgb", "depth", "instances"],
    "formats": ["native"],
}
"""Changes to the small recipe: 12 shots of two frames, which take long enough to be disturbed."""

TESTS = Path(__file__).parent.parent


def test_without_ray_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.delitem(sys.modules, "viewsphere.run.executors.ray", raising=False)
    monkeypatch.setitem(sys.modules, "ray", None)
    answer = viewsphere("render", written(tmp_path), "-o", tmp_path / "out", "--ray", "auto")
    assert answer.returncode == 2
    assert answer.stderr.splitlines() == [
        "viewsphere: --ray: expected the package ray, found none: pip install 'viewsphere[ray]'"
    ]


@pytest.mark.parametrize(
    ("address", "found"),
    [
        ("local", "--ray: expected auto, HOST:PORT or ray://HOST:PORT; found 'local'"),
        ("", "--ray: expected auto, HOST:PORT or ray://HOST:PORT; found ''"),
        ("127.0.0.1:port", "--ray 127.0.0.1:port: expected a Ray cluster that answers; found: invalid literal"),
        ("ray://127.0.0.1:70000", "--ray ray://127.0.0.1:70000: expected a Ray cluster that answers; found: "),
        ("CLOSED", "Connection refused: start one with `ray start"),
    ],
)
@pytest.mark.slow
def test_where_no_cluster_answers_it_is_said_in_one_line(tmp_path, address, found):
    pytest.importorskip("ray")
    with socket.socket() as nobody:
        nobody.bind(("127.0.0.1", 0))
        asked = f"127.0.0.1:{nobody.getsockname()[1]}" if address == "CLOSED" else address
        answer = viewsphere("render", written(tmp_path), "-o", tmp_path / "out", "--ray", asked)
    assert answer.returncode == 2
    assert len(answer.stderr.splitlines()) == 1
    assert found in answer.stderr


def test_the_cluster_of_the_docs_is_as_ray_wants_it():
    ray = pytest.importorskip("ray")
    schema = json.loads((Path(ray.__file__).parent / "autoscaler" / "ray-schema.json").read_text("utf-8"))
    (cluster,) = re.findall(r"```yaml\n(cluster_name.*?)```", (ROOT / "docs" / "scale.md").read_text("utf-8"), re.DOTALL)
    jsonschema.validate(yaml.safe_load(cluster), schema)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(yaml.safe_load(cluster.replace("max_workers: 2", "max_workers: two")), schema)


@pytest.mark.slow
def test_nodes_may_die_and_join_in_the_middle(tmp_path, local, ray):
    with ray(num_cpus=0) as cluster, rendering(tmp_path, cluster.address) as run:  # nobody is there yet
        first = cluster.add_node(**SMALL)
        assert until(lambda: finished(tmp_path) > 1)
        lost = stopped_within_a_shot(tmp_path)
        cluster.add_node(**SMALL)
        before = finished(tmp_path)
        assert until(lambda: finished(tmp_path) > before + 2)
        slow = stopped_within_a_shot(tmp_path, lost)
        cluster.remove_node(first, allow_graceful=False)
        os.kill(lost, signal.SIGKILL)
        cluster.add_node(**SMALL)
        assert until(lambda: finished(tmp_path) == 11)  # all but what the second node has begun
        os.kill(slow, signal.SIGCONT)
        _, said = run.communicate(timeout=DEADLINE)
    assert (run.returncode, said) == (0, "")
    assert tree_hash(tmp_path / "out") == tree_hash(local)


@pytest.mark.slow
def test_a_cluster_is_reached_through_its_client_server_too(tmp_path, ray, small_run):
    pytest.importorskip("grpc")
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        port = found.getsockname()[1]
    with ray(ray_client_server_port=port):
        assert until(lambda: listens(port))
        with rendering(tmp_path, f"ray://127.0.0.1:{port}", changes={}) as run:
            _, said = run.communicate(timeout=DEADLINE)
    assert (run.returncode, said) == (0, "")
    assert tree_hash(tmp_path / "out") == tree_hash(small_run)


LOST = """
import os, sys
from pathlib import Path
import viewsphere as vs
from small import ROOT, small_recipe
from viewsphere.model.model_spec import ModelSpec
from viewsphere.run.executors import Job, Listed, worker_pool
from viewsphere.run.shots.tasks import ModelTask
from viewsphere.planning.extension import whole
from viewsphere.store import Store

class Deadly:
    def __reduce__(self):
        return os._exit, (3,)

portion, root = whole(vs.plan(small_recipe())), Path(sys.argv[2])
if sys.argv[3] == "shared":
    Store(root).open_for(portion.record)
chairs = [ModelSpec(key=f"chair{i}", source="zoo:chair", category="chair", category_id=1, seed=i) for i in range(3)]
tasks = [Job(spec.key, spec.key, ModelTask("model", spec)) for spec in chairs]
with worker_pool(root, portion, 0, sys.argv[1]) as pool:
    for outcome in pool.run(Listed((Job("x", "x", Deadly()), *tasks))):
        print(outcome.key, "|", type(outcome.error).__name__, "|", outcome.error, flush=True)
    print(pool.nodes, pool.under_way)
"""


@pytest.mark.slow
def test_what_kills_its_workers_is_told_and_the_rest_goes_on(tmp_path, cluster):
    done = script(LOST, cluster, tmp_path / "out", "shared")
    *outcomes, last = (line for line in done.stdout.splitlines() if "(raylet)" not in line)  # which tells of deaths, too
    assert {line.split(" | ")[0] for line in outcomes} == {"x", "chair0", "chair1", "chair2"}
    *others, lost = outcomes
    assert lost.startswith("x | WorkerDied | x: its worker died 2 times (last on node ")
    assert all(line.endswith(" | NoneType | None") for line in others)
    assert last == "0 0"


@pytest.mark.slow
@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_ends_all_workers_and_the_run_goes_on_elsewhere(sent, tmp_path, local, cluster):
    with rendering(tmp_path, cluster) as run:
        assert until(lambda: finished(tmp_path) > 1)
        run.send_signal(sent)
        _, said = run.communicate(timeout=DEADLINE)
    assert run.returncode == 130
    assert said.startswith("stopped; ")
    assert said.endswith("frames are kept. Run the same command to go on\n")
    # One that was killed in the middle of a shot leaves its folder, which the next run clears away.
    assert until(lambda: not any(Path("/proc", str(process)).exists() for process in begun(tmp_path)))
    kept = finished(tmp_path)
    assert 1 < kept < 12
    summary = generate(small_recipe(**RECIPE), tmp_path / "out")
    assert summary.rendered == 24 - 2 * kept
    assert tree_hash(tmp_path / "out") == tree_hash(local)


@pytest.mark.slow
def test_machines_that_do_not_see_the_data_set_render_nothing(tmp_path, cluster):
    done = script(LOST, cluster, tmp_path / "out", "hidden")
    (line,) = (line for line in done.stderr.splitlines() if line.startswith("viewsphere.errors.ViewsphereError: node "))
    assert line.endswith(f"{tmp_path / 'out'}: expected a folder that all machines of the cluster share; found none here")
    assert not (tmp_path / "out").exists()


@pytest.fixture(scope="module")
def local(tmp_path_factory):
    """What a local run makes; do not change it."""
    root = tmp_path_factory.mktemp("local") / "local"
    generate(small_recipe(**RECIPE), root)
    return root


@pytest.fixture
def ray():
    """Starts clusters, of which no process is left; not beside `cluster`."""
    pytest.importorskip("ray")
    yield ray_cluster
    assert until(lambda: not list(ray_processes()))


@pytest.fixture(scope="module")
def cluster():
    """The address of a cluster of one node that lives on, of which no process is left in the end."""
    pytest.importorskip("ray")
    with ray_cluster() as made:
        yield made.address
    assert until(lambda: not list(ray_processes()))


def ray_processes():
    for process in Path("/proc").glob("[0-9]*"):
        try:
            words = (process / "cmdline").read_bytes().split(b"\0")
            own = b"PYTEST_RAY=" + str(os.getpid()).encode() in (process / "environ").read_bytes().split(b"\0")
        except OSError:
            continue
        if own:
            yield b" ".join(words).decode()


def written(folder, changes=None):
    recipe = folder / "recipe.yaml"
    recipe.write_text(small_recipe(**(changes or {})).model_dump_json(exclude_unset=True))
    return recipe


@contextmanager
def rendering(folder, address, changes=RECIPE):
    """`viewsphere render` with this cluster, in a process of its own."""
    words = ("render", written(folder, changes), "-o", folder / "out", "--ray", address)
    command = [sys.executable, "-m", "viewsphere", *map(str, words)]
    run = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        yield run
    finally:
        run.kill()
        run.communicate()


def script(text, *words):
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(TESTS), os.environ.get("PYTHONPATH", "")])}
    command = [sys.executable, "-c", text, *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE, env=environment)


def listens(port):
    with socket.socket() as tried:
        return tried.connect_ex(("127.0.0.1", port)) == 0


def finished(folder):
    return len(list((folder / "out" / "store" / "shots").glob("*/*")))


def begun(folder):
    """The processes that are about to write a shot, and the folders they write into."""
    writing = (folder / "out" / "store" / "writing").glob("*~*~*/new")
    return {int(path.parent.name.split("~")[1]): path for path in writing if path.is_dir()}


def stopped_within_a_shot(folder, *others):
    """Stop a worker, but none of these others, in the middle of a shot; gives its number."""
    found = []

    def stop():
        for process, path in begun(folder).items():
            if process not in others:
                os.kill(process, signal.SIGSTOP)
                if path.is_dir():
                    found.append(process)
                    return True
                os.kill(process, signal.SIGCONT)
        return False

    assert until(stop)
    return found[0]
