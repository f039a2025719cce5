"""A data set on a server that speaks S3, whose answers are wrong, slow, cut short or missing."""

import signal
import subprocess
import sys

import pytest

from deadline import until
from s3_server import BUCKET, KEYS, make_bucket, s3_server
from small import small_recipe
from viewsphere import Dataset, generate
from viewsphere.check import check
from viewsphere.check.repair import repair
from viewsphere.errors import RemoteError
from viewsphere.store import located
from viewsphere.urls import files_below, remote_path

pytestmark = pytest.mark.slow

FEW = {
    "channels": ["rgb", "depth", "instances"],
    "formats": ["coco"],
    "camera": {"size": [48, 36], "fov_deg": 35},
    "viewpoints": {"azimuth": [0, 120], "elevation": [15], "distance": 1.0},
}
URL = f"s3://{BUCKET}/cars/out"

RUN = """
import sys
sys.path[:0] = ["tests", "tests/store"]
from small import small_recipe
from test_s3 import FEW, URL
from viewsphere import generate
generate(small_recipe(**FEW), URL)
"""


@pytest.fixture(scope="module")
def server():
    with s3_server() as found:
        yield found


@pytest.fixture
def faults(server, monkeypatch):
    """What the server does; the bucket is empty."""
    url, faults = server
    monkeypatch.setattr(remote_path, "FIRST_WAIT_S", 0.01)
    for name, value in {**KEYS, "AWS_ENDPOINT_URL": url}.items():
        monkeypatch.setenv(name, value)
    make_bucket()
    faults.asked.clear()
    faults.hit.clear()
    yield faults
    faults.none()


@pytest.fixture(scope="module")
def few(tmp_path_factory):
    root = tmp_path_factory.mktemp("few") / "out"
    generate(small_recipe(**FEW), root)
    return root


def contents(root):
    """All files but the lock of those that take turns, which a URL has not."""
    return {path: (root / path).read_bytes() for path in files_below(root) if path != "store/lock"}


def test_two_workers_make_the_same_through_all_faults(few, faults):
    kinds, seen = ("500", "503", "drop", "cut", "slow"), {}

    def fault(method, path):
        """Every ninth request fails, of each kind in turn; the next one of the same does not."""
        seen[method, path] = seen.get((method, path), 0) + 1
        number = len(faults.asked)
        return kinds[number // 9 % len(kinds)] if number % 9 == 0 and seen[method, path] < 3 else ""

    faults.fault = fault
    generate(small_recipe(**FEW), URL, workers=2)
    assert len(faults.hit) > 20
    assert check(Dataset(URL), sample=2).ok
    faults.none()
    assert contents(located(URL)) == contents(few)
    samples = [sample.channels["depth"].tobytes() for sample in Dataset(URL)]
    assert samples == [sample.channels["depth"].tobytes() for sample in Dataset(few)]


def test_a_killed_run_goes_on(few, faults):
    run = subprocess.Popen([sys.executable, "-c", RUN])
    until(lambda: run.poll() is not None or any("PUT" in m and "manifest.json" in p and "shots" in p for m, p in faults.asked))
    run.send_signal(signal.SIGKILL)
    run.wait()
    for shot in Dataset(URL).rows:
        assert Dataset(URL).store.has_shot(shot.key)
    assert {finding.check for finding in check(Dataset(URL), fast=True).findings} <= {"counts", "credits"}
    assert generate(small_recipe(**FEW), URL).rendered < len(Dataset(few))
    assert contents(located(URL)) == contents(few)


def test_what_never_answers_is_one_line(few, faults):
    for path, data in contents(few).items():
        (located(URL) / path).write_bytes(data)
    for kind in ("500", "503", "drop", "cut"):
        faults.always(kind, "depth")
        with pytest.raises(
            RemoteError, match=rf"{URL}/store/shots/.*/depth/00000000.tiff: expected to read it, found, 5 times"
        ) as told:
            Dataset(URL)[0].channels["depth"]
        assert "\n" not in str(told.value) and KEYS["AWS_SECRET_ACCESS_KEY"] not in str(told.value), kind


def test_uploads_that_are_refused_leave_nothing_half_visible(few, faults):
    faults.always("500", "manifest.json", "PUT")
    with pytest.raises(RemoteError, match="expected to write it, found, 5 times"):
        generate(small_recipe(**FEW), URL)
    assert len(Dataset(URL)) == 0
    faults.none()
    generate(small_recipe(**FEW), URL)
    assert contents(located(URL)) == contents(few)


def test_a_missing_bucket_is_told(faults):
    with pytest.raises(RemoteError, match="make the bucket, or correct its name"):
        generate(small_recipe(**FEW), "s3://no-such-bucket/out")


@pytest.mark.parametrize("shots", ["files", "tar"])
def test_damage_is_found_and_mended(shots, few, faults, tmp_path):
    if shots == "tar":
        few = tmp_path / "packed"
        generate(small_recipe(**FEW, files={"shots": "tar"}), few)
    root = located(URL)
    for path, data in contents(few).items():
        (root / path).write_bytes(data)
    inside = [path for path in contents(few) if path.startswith("store/") and path.count("/") > 2]
    if shots == "files":  # of each folder its manifest or another file
        folders = sorted({path.rpartition("/")[0] for path in inside if path.endswith("/manifest.json")})
        files = [
            next(path for path in inside if path.startswith(folder) and path.endswith("/manifest.json") == number % 2)
            for number, folder in enumerate(folders)
        ]
    else:
        files = [path for path in inside if path.endswith(".tar")]
    for path in files:
        data = bytearray((root / path).read_bytes())
        data[len(data) // 2] ^= 4
        (root / path).write_bytes(bytes(data))
    findings = [str(finding) for finding in check(Dataset(root), fast=True).findings]
    assert len(files) > 1 and all(any(str(root / path) in text for text in findings) for path in files)
    assert repair(root, fast=True).report.ok
    assert contents(root) == contents(few)
