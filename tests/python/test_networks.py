# SPDX-License-Identifier: Apache-2.0
"""Networks in Python and as files, `libocc calibrate network` and `libocc measure`."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import libocc as occ
from libocc.cli import main
from libocc.cli.calibration.run import ladder
from libocc.network.files import network_files, read_network

PANORAMA = Path(__file__).parents[2] / "data/calibration/panorama"
TRUTH = {"c_px": 4371.0, "cy_px": 5105.5, "tilt_x_rad": 2e-3, "tilt_y_rad": -1.5e-3, "ex_m": 0.011, "ey_m": -0.007,
         "k1": 0.004, "k2": -0.0015}


def run(*arguments: object) -> tuple[int, str, str]:
    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture
def network(tmp_path: Path) -> Path:
    shutil.copytree(PANORAMA, tmp_path / "network")
    return tmp_path / "network" / "network.yaml"


def small_field() -> occ.network.TestField:
    return occ.network.simulate_test_field(occ.network.TestFieldDesign(
        camera=occ.network.paper_panorama_camera(), free_parameters=["c_px", "cy_px"], stations=4, targets=40, seed=3,
    ))


def test_an_adjustment_recovers_the_camera_and_finds_the_gross_errors() -> None:
    network, datum = read_network(PANORAMA / "network.yaml")
    adjusted = occ.network.adjust(network, datum=datum)
    assert adjusted.ok and adjusted.defect == 6
    assert {rejected.observation for rejected in adjusted.rejected} == {40, 100, 222, 301, 402, 490}
    assert 0.9 < adjusted.sigma0 < 1.1
    known = occ.network.precision(adjusted.network, datum)
    sigmas = np.sqrt(np.diag(known.parameters(0)))
    values = {p.name: p.value for p in adjusted.network.cameras[0].parameters}
    for name, sigma in zip(adjusted.network.free_parameters[0], sigmas):
        if name in TRUTH:
            assert abs(values[name] - TRUTH[name]) < 4 * sigma, name


def test_statistics_agree_with_one_another() -> None:
    network, datum = read_network(PANORAMA / "network.yaml")
    adjusted = occ.network.adjust(network, datum=datum)
    statistics = occ.network.network_statistics(adjusted.network)
    assert statistics.sigma0 == pytest.approx(adjusted.sigma0, rel=1e-6)
    used = np.asarray(adjusted.network.observations)[:, 8] > 0
    assert statistics.redundancy[used].min() >= 0 and statistics.redundancy.max() <= 1
    assert statistics.redundancy.sum() < adjusted.redundancy + 1
    assert np.allclose(statistics.residual_px[used], occ.network.image_residuals_px(adjusted.network)[used])
    assert (statistics.detectable_px[used] >= 4.1 * 0.19).all()


def test_datums_differ_in_points_and_not_in_distances() -> None:
    field = small_field()
    adjusted = occ.network.adjust(field.network)
    inner = occ.network.precision(adjusted.network)
    minimal = inner.in_datum(occ.network.Datum(kind=occ.network.DatumKind.minimal))
    assert inner.defect == minimal.defect == 7
    trace = [np.trace(known.points().sum(axis=0)) for known in (inner, minimal)]
    assert trace[0] < trace[1]  # inner constraints minimise the trace
    bar = occ.network.Target.point(0), occ.network.Target.point(1)
    network = field.network.copy()
    network.add_distance(*bar, 5.0, 1e-3)
    with_bar = occ.network.precision(occ.network.adjust(network).network)
    assert with_bar.defect == 6
    assert with_bar.distance_sigma_m(*bar) == pytest.approx(1e-3, rel=0.02)


def test_progress_can_stop_an_adjustment() -> None:
    calls = []

    def stop(stage: str, iteration: int, cost: float, rejected: int) -> bool:
        calls.append((stage, iteration, cost, rejected))
        return len(calls) < 2

    adjusted = occ.network.adjust(small_field().network, progress=stop)
    assert adjusted.status is occ.Status.not_converged and len(calls) == 2
    assert len(adjusted.network.points_m) == 40


def test_a_network_goes_to_files_and_back(tmp_path: Path) -> None:
    field = small_field()
    network = field.network.copy()
    corners = 0.1 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    body = network.add_body("tag 7", corners, np.eye(4))
    network.observe(0, [occ.network.Target.corner(body, 2)], [[10, 20]], [0.3, 0.2])
    for name, content in network_files(network).items():
        (tmp_path / name).write_bytes(content)
    again, _ = read_network(tmp_path / "network.yaml")
    assert np.array_equal(again.observations, network.observations)
    assert np.array_equal(again.points_m, network.points_m)
    assert again.cameras == network.cameras and again.free_parameters == network.free_parameters
    assert np.allclose(again.cam_from_world(2), network.cam_from_world(2), atol=1e-14)
    assert np.allclose(again.body_corners_m[0], corners)


def test_the_command_writes_a_complete_folder(network: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    code, text, _ = run("calibrate", "network", network, "--ladder", "--out", out)
    assert code == 0 and "6 rejected" in text and "correlated" in text
    data = json.loads((out / "result.json").read_text())
    assert data["status"] == "ok" and len(data["rejected"]) == 6 and data["rejected"][0]["target"].startswith("target")
    assert {"report.html", "camera.yaml", "points.csv", "points.ply", "images.csv"} <= {p.name for p in out.iterdir()}
    html = (out / "report.html").read_text()
    assert html.count("data:image/png") == 5 and "Influence of the parameter groups" in html
    camera = occ.read_camera(out / "camera.yaml")
    assert camera.kind is occ.CameraKind.rotating_line
    assert abs(camera.parameters[1].value - TRUTH["c_px"]) < 8
    assert (out / "points.ply").read_text().startswith("ply\nformat ascii 1.0\n")


def test_the_ladder_frees_each_parameter_once() -> None:
    network, datum = read_network(PANORAMA / "network.yaml")
    names, sigma0 = ladder(network, datum, occ.network.adjust(network, datum=datum).network)
    assert names == ["none", "c cy", "ex ey", "tilt_x tilt_y", "angle_per_px", "k1 k2"]
    assert sorted(sigma0, reverse=True) == sigma0 and sigma0[0] > 5 and 0.9 < sigma0[-1] < 1.1


def test_select_drops_undetermined_parameters(tmp_path: Path) -> None:
    field = occ.network.simulate_test_field(occ.network.TestFieldDesign(
        camera=occ.network.paper_panorama_camera(), free_parameters=["c_px", "cy_px", "k1", "tumbling1_rad"],
        targets=60, seed=5,
    ))
    chosen = occ.network.select_parameters(field.network, keep=["c_px", "cy_px"])
    assert chosen.ok
    assert chosen.adjustment.network.free_parameters[0] == ["c_px", "cy_px"]  # the others are truly zero
    assert len(chosen.steps) == 3 and chosen.steps[0].dropped == ""


def test_points_include_the_uncertainty_of_cameras_and_stations(network: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    arguments = ["measure", network, network.parent / "corners.csv", "--out", out]
    code, text, _ = run(*arguments, "--distance", "corner 0", "corner 4", "--json")
    assert code == 0
    data = json.loads(text)
    (distance,) = data["distances"]
    assert abs(distance["length_m"] - 1) < 4 * distance["sigma_m"] and distance["sigma_m"] < 1e-3
    assert all(point["images"] == 5 for point in data["points"])
    assert "data:image/png" in (out / "report.html").read_text()
    assert len((out / "points.csv").read_text().splitlines()) == 9


def test_a_point_in_one_picture_is_said_not_to_be_measured(network: Path, tmp_path: Path) -> None:
    table = tmp_path / "one.csv"
    table.write_text("point,image,x_px,y_px\na,S0,100,5000\n")
    code, text, _ = run("measure", network, table, "--out", tmp_path / "out")
    assert code == 1 and text == "a: too_few_lamps\n"


def test_a_point_twice_in_a_picture_names_both_lines(network: Path, tmp_path: Path) -> None:
    table = tmp_path / "twice.csv"
    table.write_text("point;image;x_px;y_px\na;S0;100,5;5000\nb;S0;1;1\na;S0;101,5;5000\n")
    code, _, err = run("measure", network, table, "--out", tmp_path / "out")
    assert code == 2 and f"{table}:4: point 'a' occurs twice in image 'S0', first in line 2" in err


WRONG = [
    ("network.yaml", "schema: libocc-network/1", "schema: libocc-network/9", "key `schema`: must be libocc-network/1"),
    ("network.yaml", "k2]", "k9]", "'k9' is not a parameter of a rotating_line"),
    ("network.yaml", "sigma_m: 2.0e-5", "sigma_m: -1", "distances[0].sigma_m`: must be positive, got -1"),
    ("network.yaml", "from: target", "from: targt", "no point is named 'targt 10'"),
    ("network.yaml", "points: points.csv", "point: points.csv", "key `point`: is unknown"),
    ("network.yaml", "images: images.csv", "images: absent.csv", "absent.csv"),
    ("points.csv", "name,x_m", "name,x_mm", "points.csv:1: column `x_mm` is unknown"),
    ("observations.csv", "S0,", "S9,", "observations.csv:2: no image is named 'S9'"),
    ("observations.csv", ",0.5,0.19\n", ",0.5,-2\n", "column `sigma_y_px`: must be positive, got '-2'"),
    ("images.csv", "S0,camera,", "S0,camra,", "images.csv:2: no camera is named 'camra'"),
    ("camera.yaml", "c_px: 4375", "c_px: -4375", "c_px"),
]


@pytest.mark.parametrize(("name", "old", "new", "complaint"), WRONG, ids=[wrong[3][:30] for wrong in WRONG])
def test_wrong_input_is_one_line_and_exit_code_2(
    network: Path, tmp_path: Path, name: str, old: str, new: str, complaint: str
) -> None:
    path = network.parent / name
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    code, _, err = run("calibrate", "network", network, "--out", tmp_path / "out")
    assert code == 2 and err.startswith("error: ") and err.count("\n") == 1
    assert complaint in err
    assert not (tmp_path / "out").exists()


def test_an_undetermined_network_keeps_its_last_state(network: Path, tmp_path: Path) -> None:
    images = network.parent / "images.csv"
    images.write_text("\n".join(images.read_text().splitlines()[:2]) + "\n")
    seen = network.parent / "observations.csv"
    lines = seen.read_text().splitlines()
    seen.write_text("\n".join([lines[0], *(line for line in lines if line.startswith("S0,"))]) + "\n")
    out = tmp_path / "out"
    code, _, err = run("calibrate", "network", network, "--out", out)
    assert code == 1 and err.count("\n") >= 1
    data = json.loads((out / "result.json").read_text())
    assert data["status"] != "ok" and data["message"] in err
    assert "The report shows the last state" in (out / "report.html").read_text()
