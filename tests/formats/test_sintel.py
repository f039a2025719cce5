"""Sintel's tree, read by readers written from its documentation, by torchvision and by ptlflow: the data set's own labels."""

from __future__ import annotations

import numpy as np
import pytest
from changed_samples import empty, files, with_channels
from flow_readers import of, read_cam, read_picture, read_tagged
from torchvision_readers import torchvision_datasets

from proven import close, equal
from viewsphere.errors import UserError
from viewsphere.formats import Scope, sintel
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.run.exports.exporting import export
from viewsphere.run.exports.scope import scope_of

FRAMES = 6
BENT = Intrinsics(
    width=160, height=120, fx=170, fy=170, cx=80, cy=60, distortion=lens_parameters("fisheye", coefficients=(0.1, 0, 0, 0))
)


@pytest.fixture(scope="module")
def written(videos, tmp_path_factory):
    """An export with stereo pairs, and both folders under the name that torchvision asks for."""
    place = tmp_path_factory.mktemp("sintel")
    export(videos.root, [{"sintel": {"stereo": True}}], output=place)
    for name in ("flow", "stereo"):
        (place / name).mkdir()
    (place / "flow" / "Sintel").symlink_to(place / "sintel")
    (place / "stereo" / "Sintel").symlink_to(place / "sintel" / "stereo")
    return place


def known_flow(sample):
    return np.where(np.isnan(sample.flow), np.float32(1e10), sample.flow)


def test_what_there_is(videos, written):
    folder = written / "sintel" / "training"
    kinds = {"clean": FRAMES, "depth": FRAMES, "camdata_left": FRAMES, "segmentation": FRAMES, "flow": FRAMES - 1}
    kinds |= {"occlusions": FRAMES - 1, "invalid": FRAMES - 1}
    assert {path.name for path in folder.iterdir()} == kinds.keys()
    for kind, count in kinds.items():
        for sequence in videos.sequences:
            assert len(list((folder / kind / sequence).iterdir())) == count
    assert {path.name for path in (written / "sintel").iterdir() if path.is_dir()} == {"stereo", "training"}


def test_pictures_depth_cameras_and_ids(videos, written):
    folder = written / "sintel" / "training"
    for sequence in videos.sequences:
        for sample in of(videos, sequence):
            name = f"{sequence}/frame_{sample.instant + 1:04d}"
            equal("sintel", "own reader: pictures", read_picture(folder / f"clean/{name}.png"), sample.rgb)
            equal("sintel", "own reader: depth", read_tagged(folder / f"depth/{name}.dpt", 1), sample.depth)
            red, green, blue = np.moveaxis(read_picture(folder / f"segmentation/{name}.png").astype(int), -1, 0)
            equal("sintel", "own reader: segmentation", red * 65536 + green * 256 + blue, sample.instances)
            lens, motion = read_cam(folder / f"camdata_left/{name}.cam")
            corner = np.eye(3)
            corner[:2, 2] = 0.5
            close("sintel", "own reader: cameras", corner @ lens @ motion, sample.camera.P, "px", atol=1e-9)


def test_depth_back_projects_to_the_flow(videos, written):
    """The pixels' points, by .dpt and .cam, seen from the next camera, are where the flow of what stands still leads."""
    folder, sequence = written / "sintel" / "training", videos.sequences[1]
    name, after = f"{sequence}/frame_0001", f"{sequence}/frame_0002"
    depth, (lens, motion) = read_tagged(folder / f"depth/{name}.dpt", 1), read_cam(folder / f"camdata_left/{name}.cam")
    flow, (later, moved) = read_tagged(folder / f"flow/{name}.flo", 2), read_cam(folder / f"camdata_left/{after}.cam")
    still = np.isfinite(depth) & (of(videos, sequence)[0].instances == 0)
    y, x = np.nonzero(still)
    seen = np.linalg.inv(lens) @ (np.stack([x, y, np.ones(len(x))]) * depth[still])
    world = motion[:, :3].T @ (seen - motion[:, 3:])
    there = later @ (moved[:, :3] @ world + moved[:, 3:])
    expected = (there[:2] / there[2] - np.stack([x, y])).T
    close("sintel", "flow by .dpt and .cam", flow[still], expected, "px", atol=2e-4)


def test_flow_and_its_masks(videos, written):
    folder, seen = written / "sintel" / "training", np.zeros(5, int)
    for sequence in videos.sequences:
        for sample in of(videos, sequence)[:-1]:
            name = f"{sequence}/frame_{sample.instant + 1:04d}"
            equal("sintel", "own reader: flow", read_tagged(folder / f"flow/{name}.flo", 2), known_flow(sample))
            occluded, invalid = (read_picture(folder / f"{kind}/{name}.png") for kind in ("occlusions", "invalid"))
            assert occluded.ndim == 2 and occluded.dtype == np.uint8 and set(np.unique(occluded)) <= {0, 255}
            equal("sintel", "own reader: occlusions", occluded > 0, np.isin(sample.flow_state, (1, 2, 3)))
            equal("sintel", "own reader: invalid", invalid > 0, np.isnan(sample.flow[..., 0]))
            seen += np.bincount(sample.flow_state.ravel(), minlength=5)
    assert (seen[:3] > 100).all()


def test_disparity_and_its_masks(videos, written):
    folder = written / "sintel" / "stereo" / "training"
    for sequence in videos.sequences:
        for left, right in zip(of(videos, sequence), of(videos, sequence, "right"), strict=True):
            name = f"{sequence}/frame_{left.instant + 1:04d}.png"
            equal("sintel", "own reader: pairs", read_picture(folder / "clean_left" / name), left.rgb)
            equal("sintel", "own reader: pairs", read_picture(folder / "clean_right" / name), right.rgb)
            red, green, blue = np.moveaxis(read_picture(folder / "disparities" / name).astype(float), -1, 0)
            found = 4 * red + green / 64 + blue / 16384
            close("sintel", "own reader: disparity", found, np.nan_to_num(left.disparity), "px", atol=2**-15)
            hidden, outside = (read_picture(folder / kind / name) > 0 for kind in ("occlusions", "outofframe"))
            equal("sintel", "own reader: occlusions of disparity", hidden, left.disparity_state == 1)
            equal("sintel", "own reader: out of frame", outside, left.disparity_state == 2)
    assert not list((folder / "clean_right").rglob("*.flo"))


def test_torchvision_reads_flow(videos, written):
    found = torchvision_datasets().Sintel(written / "flow", split="train", pass_name="clean")
    assert len(found) == len(videos.sequences) * (FRAMES - 1)
    for first, second, flow in (found[i] for i in range(len(found))):
        a = next(s for s in videos if s.sensor == "left" and np.array_equal(s.rgb, np.asarray(first)))
        b = of(videos, a.sequence)[a.instant + 1]
        equal("sintel", "torchvision: pictures", np.asarray(second), b.rgb)
        equal("sintel", "torchvision: flow", flow.transpose(1, 2, 0), known_flow(a))


def test_torchvision_reads_stereo(videos, written):
    found = torchvision_datasets().SintelStereo(written / "stereo", pass_name="clean")
    pairs = [pair for s in videos.sequences for pair in zip(of(videos, s), of(videos, s, "right"), strict=True)]
    assert len(found) == len(pairs)
    for (left, right), i in zip(pairs, range(len(found)), strict=True):
        seen_left, seen_right, disparity, valid = found[i]
        equal("sintel", "torchvision: pairs", [np.asarray(seen_left), np.asarray(seen_right)], [left.rgb, right.rgb])
        close("sintel", "torchvision: disparity", disparity[0], np.nan_to_num(left.disparity), "px", atol=2**-15)
        equal("sintel", "torchvision: validity of disparity", valid, left.disparity_state == 0)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_ptlflow_reads_flow_and_occlusions(videos, written):
    torchvision_datasets()
    datasets = pytest.importorskip("ptlflow.data.datasets")
    found = datasets.SintelDataset(written / "sintel", split="trainval", pass_names="clean", get_occlusion_mask=True)
    samples = [sample for sequence in sorted(videos.sequences) for sample in of(videos, sequence)[:-1]]
    for sample, item in zip(samples, (found[i] for i in range(len(found))), strict=True):
        flow, known = np.asarray(item["flows"][0]), np.isfinite(sample.flow[..., 0])
        equal("sintel", "ptlflow: flow", flow[known], sample.flow[known])
        equal("sintel", "ptlflow: valid", np.asarray(item["valids"][0])[..., 0] > 0, known)
        equal("sintel", "ptlflow: occlusions", np.asarray(item["occs"][0])[..., 0] > 0, np.isin(sample.flow_state, (1, 2, 3)))


def test_without_stereo_one_eye_is_enough(videos, tmp_path):
    export(videos.root, "sintel", output=tmp_path)
    assert not (tmp_path / "sintel" / "stereo").exists()


def test_albedo_where_it_is_kept(videos, tmp_path):
    tree, light = sintel.Sintel(videos, sintel.FORMAT.options()), np.random.default_rng(0).random((120, 160, 3), np.float32)
    made = files(tree, with_channels(videos[0], albedo=light))
    (tmp_path / "a.png").write_bytes(made[f"training/albedo/{videos[0].sequence}/frame_0001.png"])
    curve = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    close("sintel", "IEC 61966-2-1: albedo", read_picture(tmp_path / "a.png") / 255, curve, atol=0.51 / 255)


def test_a_picture_of_nothing(videos, tmp_path):
    made = files(sintel.Sintel(videos, sintel.FORMAT.options(stereo=True)), empty(videos[0]))
    name = f"{videos[0].sequence}/frame_0001"
    (tmp_path / "a").write_bytes(made[f"training/flow/{name}.flo"])
    assert (read_tagged(tmp_path / "a", 2) == np.float32(1e10)).all()
    (tmp_path / "a").write_bytes(made[f"training/depth/{name}.dpt"])
    assert np.isposinf(read_tagged(tmp_path / "a", 1)).all()
    for kind, value in {"training/segmentation": 0, "training/occlusions": 0, "training/invalid": 255,
                        "stereo/training/disparities": 0, "stereo/training/occlusions": 255,
                        "stereo/training/outofframe": 0}.items():  # fmt: skip
        (tmp_path / "a.png").write_bytes(made[f"{kind}/{name}.png"])
        assert (read_picture(tmp_path / "a.png") == value).all(), kind


def test_disparity_has_a_limit(videos, tmp_path):
    tree = sintel.Sintel(videos, sintel.FORMAT.options(stereo=True))
    near = with_channels(videos[0], disparity=np.full((120, 160), 1023.9, np.float32))
    (tmp_path / "a.png").write_bytes(files(tree, near)[f"stereo/training/disparities/{videos[0].sequence}/frame_0001.png"])
    red, green, blue = np.moveaxis(read_picture(tmp_path / "a.png").astype(float), -1, 0)
    assert np.abs(4 * red + green / 64 + blue / 16384 - np.float32(1023.9)).max() < 2**-14
    with pytest.raises(UserError, match=r"frame 0: sintel: expected disparity below 1024 pixels; found 1024\.0"):
        files(tree, with_channels(videos[0], disparity=np.full((120, 160), 1024, np.float32)))


def scope(videos, **changes):
    return Scope(**{**vars(scope_of(videos)), **changes})


def test_what_is_refused(videos, stills):
    plain, pairs = sintel.FORMAT.options(), sintel.FORMAT.options(stereo=True)
    rig = scope_of(videos).rig
    lone = rig.model_copy(update={"sensors": rig.sensors[:1]})
    away = rig.sensors[1].model_copy(update={"rig_from_sensor": ((1, 0, 0, 0), (0, 1, 0, 0.1), (0, 0, 1, 0), (0, 0, 0, 1))})
    apart = rig.model_copy(update={"sensors": (rig.sensors[0], away)})
    assert list(sintel.FORMAT.refuses(scope(videos), plain)) == list(sintel.FORMAT.refuses(scope(videos), pairs)) == []
    assert list(sintel.FORMAT.refuses(scope(videos, rig=lone), plain)) == []
    assert "expected sequences" in next(sintel.FORMAT.refuses(scope_of(stills), plain))
    assert "expected two rectified cameras" in next(sintel.FORMAT.refuses(scope(videos, rig=lone), pairs))
    found = list(sintel.FORMAT.refuses(scope(videos, rig=apart), plain))
    assert found == ["expected one camera, or two that are rectified; found left, right"]
    bent = rig.sensors[0].model_copy(update={"intrinsics": BENT})
    assert list(sintel.FORMAT.refuses(scope(videos, rig=rig.model_copy(update={"sensors": (bent,)})), plain)) == [
        "expected pinhole cameras; found the lens of left"
    ]
