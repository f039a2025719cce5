"""A lens model of a third party, the page's example: it renders, labels, checks, and is refused where a format lacks it."""

from __future__ import annotations

import numpy as np
import pytest

from installed import example, installed, write_package
from small import small_recipe
from viewsphere import Dataset, Recipe, generate, plan, plugins
from viewsphere.check import check
from viewsphere.errors import PluginError, RecipeError, UserError
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.run.exports.exporting import export

CAMERA = {"size": [96, 72], "fov_deg": 60, "distortion": {"model": "division", "k": -0.4}}
CHANNELS = ["rgb", "depth", "instances", "flow"]


@pytest.fixture
def division(tmp_path):
    with installed(tmp_path / "site", "lenses", "division", example("division")):
        yield


@pytest.mark.usefixtures("division")
def test_it_renders_labels_and_checks(tmp_path):
    time = {"frames": 2, "fps": 10}
    generate(small_recipe(camera=CAMERA, channels=CHANNELS, formats=[], time=time), tmp_path / "out")
    dataset = Dataset(tmp_path / "out")
    report = check(dataset)
    assert report.ok, report.findings
    assert report.checked["depth"] == len(dataset) > 0
    sample = dataset[0]
    assert sample.camera.lens.name == "division" and sample.camera.distortion.k == -0.4
    shown = np.argwhere(sample.instances == sample.objects[0].id) + 0.5
    x0, y0, x1, y1 = sample.objects[0].box2d_projected
    assert len(shown) > 50
    assert (shown[:, ::-1] >= (x0 - 0.5, y0 - 0.5)).all() and (shown[:, ::-1] <= (x1 + 0.5, y1 + 0.5)).all()
    straight = small_recipe(camera=CAMERA | {"distortion": None}, channels=CHANNELS, formats=[], time=time)
    generate(straight, tmp_path / "straight")
    assert not np.array_equal(Dataset(tmp_path / "straight")[0].instances, sample.instances)
    with pytest.raises(UserError, match="expected lenses of COLMAP's models; found division of"):
        export(tmp_path / "out", ["colmap"])


@pytest.mark.usefixtures("division")
def test_its_parameters_are_checked_with_the_recipe():
    assert "division" in plugins.names("lenses")
    for given, told in (
        ({"model": "division"}, r"camera.distortion.k: expected a value"),
        ({"model": "division", "k": 1}, r"camera.distortion.k: .*less than or equal to 0"),
        ({"model": "division", "k": -1, "kk": 2}, r"camera.distortion.kk: .*Valid: model, k"),
        ({"model": "divison", "k": -1}, r"camera.distortion.model: .*division"),
        ({"model": "scan", "elevations_deg": [0]}, r"camera.distortion.model: 'scan' is unknown. Valid: "),
    ):
        with pytest.raises(RecipeError, match=told):
            plan(small_recipe(camera={"size": [8, 8], "fov_deg": 60, "distortion": given}))


def test_it_is_found_in_a_package_of_plug_ins_beside_a_broken_one(tmp_path, monkeypatch):
    for package, begins in (("broken_lenses", "1 / 0"), ("good_lenses", "")):
        folder = write_package(tmp_path, package, {("packages", "division"): example("division")})
        (folder / "__init__.py").write_text(begins)
        points = tmp_path / f"{package}-1.0.dist-info" / "entry_points.txt"
        points.write_text(f"[viewsphere.packages]\nlenses = {package}\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert Recipe.model_validate(small_recipe(camera=CAMERA)).camera.distortion.k == -0.4
    assert lens_parameters("fisheye", coefficients=(0, 0, 0, 0)).model == "fisheye"


def test_a_data_set_of_a_lens_that_is_not_installed_is_an_error_that_names_it():
    with pytest.raises(PluginError, match="lens division: expected a lens model of viewsphere or of an installed package"):
        lens_parameters("division", k=-0.1)


@pytest.mark.parametrize(
    "wrong, told",
    [
        ("rays=rays, project=project", "LensSpec.parameters: expected a value; found nothing"),
        (
            "parameters=Division, rays=rays, project=project, is_liner=True",
            r"LensSpec.is_liner: 'is_liner' is unknown; did you mean 'is_linear'\?",
        ),
        ("parameters=Division, rays=3, project=project", "LensSpec.rays: expected a function; found 3"),
        (
            "parameters=Division, ray=rays",
            "LensSpec.ray: 'ray' is unknown; did you mean 'rays'.*\n.*LensSpec.project: expected a value; found nothing$",
        ),
        ("parameters=Division, rays=lambda a: a, project=project", "LensSpec.rays: expected a function of 2 values; found"),
        (
            "parameters=Division, rays=rays, project=project, bounds=rays",
            "LensSpec.bounds: expected a function of 6 values; found rays",
        ),
    ],
)
def test_a_spec_that_is_not_valid_is_an_error_that_names_file_and_field(tmp_path, wrong, told):
    code = example("division").replace("parameters=Division, rays=rays, project=project, has_unit_rays=False", wrong)
    from viewsphere.plugins.lens import LensSpec

    with (
        installed(tmp_path / "site", "lenses", "division", code) as file,
        pytest.raises(PluginError, match=rf"{file}.*{told}"),
    ):
        plugins.load(LensSpec, "division")


def test_rays_that_do_not_begin_at_the_centre_are_refused(tmp_path):
    code = example("division").replace(
        "return central(np.stack([x / scale, y / scale, scale / scale], axis=-1))",
        "return Rays(np.ones((len(x), 3)), np.ones((len(x), 3)))",
    ).replace("import LensParameters", "import Rays, LensParameters")  # fmt: skip
    with (
        installed(tmp_path / "site", "lenses", "division", code),
        pytest.raises(PluginError, match="its rays do not all begin at the camera's centre"),
    ):
        lens = lens_parameters("division", k=-0.1)
        Intrinsics(width=4, height=3, fx=4, fy=4, cx=2, cy=1.5, distortion=lens).lens.directions()
