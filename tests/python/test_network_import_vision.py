# SPDX-License-Identifier: Apache-2.0
"""Networks of BAL, COLMAP and Kalibr, and the command that converts networks."""

import bz2
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from network_formats import aicon_files, bal_text, write_aicon, write_colmap

import libocc as occ
from libocc.cli import main
from libocc.network.importing import format_of, import_network


def run(*arguments: object) -> tuple[int, str, str]:
    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr


def test_a_problem_of_bal_is_read_without_residuals(tmp_path: Path) -> None:
    (tmp_path / "problem.txt.bz2").write_bytes(bz2.compress(bal_text().encode()))
    found = import_network(tmp_path / "problem.txt.bz2")
    residuals = np.asarray(occ.network.image_residuals_px(found.network))
    assert residuals.shape == (150, 2) and np.abs(residuals).max() < 1e-8
    assert found.network.free_parameters[0] == ["f_px", "k1", "k2"] and len(found.network.cameras) == 6


@pytest.mark.parametrize(("old", "new", "complaint"), [
    ("6 25 150", "6 25 151", "must be a whole number"),
    ("0 1 ", "0 99 ", "problem.txt:3: field `point`: must be a whole number from 0 to 24, got 99"),
    ("0 1 ", "0 0 ", "problem.txt:3: point 0 occurs twice in image 0, first in line 2"),
    ("500.0", "-500.0", "field `f` of camera 0: must be positive, got -500"),
    ("500.0", "x", "field `f`: must be a finite number, got 'x'"),
])
def test_a_malformed_problem_of_bal_is_named(tmp_path: Path, old: str, new: str, complaint: str) -> None:
    (tmp_path / "problem.txt").write_text(bal_text().replace(old, new, 1))
    with pytest.raises(ValueError) as raised:
        import_network(tmp_path / "problem.txt")
    assert complaint in str(raised.value)
    (tmp_path / "problem.txt").write_text("\n".join(bal_text().splitlines()[:-2]))
    with pytest.raises(ValueError, match="the file ends after 24 of 25 groups of x, y, z"):
        import_network(tmp_path / "problem.txt")


@pytest.mark.parametrize("binary", [False, True])
def test_a_model_of_colmap_is_read_without_residuals(tmp_path: Path, binary: bool) -> None:
    write_colmap(tmp_path, binary)
    found = import_network(tmp_path)
    residuals = np.asarray(occ.network.image_residuals_px(found.network))
    assert residuals.shape == (150, 2) and np.abs(residuals).max() < 1e-8
    assert found.network.free_parameters == [
        ["f_px", "k1"], ["fx_px", "fy_px", "k1", "k2", "p1", "p2"], ["fx_px", "fy_px", "k1", "k2", "k3", "k4"],
    ]
    assert found.network.image_names[2] == "im 2.png" and found.network.point_names[0] == "10"


def test_a_malformed_model_of_colmap_is_named(tmp_path: Path) -> None:
    write_colmap(tmp_path, False)
    cameras = (tmp_path / "cameras.txt").read_text()
    for old, new, complaint in (
        ("OPENCV_FISHEYE", "FOV", "cameras.txt:4: field `model`: must be one of SIMPLE_PINHOLE"),
        (" -0.1\n", "\n", "cameras.txt:2: field `parameters`: must be 4 (f, cx, cy, k1), got 3"),
        ("640", "x", "cameras.txt:2: field `width`: must be a whole number, got 'x'"),
    ):
        (tmp_path / "cameras.txt").write_text(cameras.replace(old, new, 1))
        with pytest.raises(ValueError) as raised:
            import_network(tmp_path)
        assert complaint in str(raised.value)
    write_colmap(tmp_path, True)
    content = (tmp_path / "images.bin").read_bytes()
    for size in (4, 30, 70, len(content) - 3):
        (tmp_path / "images.bin").write_bytes(content[:size])
        with pytest.raises(ValueError, match=r"images\.bin: byte \d+: the (file|name)"):
            import_network(tmp_path)
    (tmp_path / "points3D.bin").unlink()
    with pytest.raises(ValueError, match=r"has no points3D\.bin"):
        import_network(tmp_path)


KALIBR = """cam0:
  camera_model: pinhole
  distortion_model: radtan
  distortion_coeffs: [-0.28, 0.07, 0.0002, 1.7e-05]
  intrinsics: [458.6, 457.3, 367.2, 248.4]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1:
  - [0.9999, -0.0023, 0.0003, -0.11007]
  - [0.0023, 0.9999, -0.0141, 0.0004]
  - [-0.0003, 0.0141, 0.9999, -0.0008]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_model: equidistant
  distortion_coeffs: [0.01, -0.02, 0.003, 0.0]
  intrinsics: [457.6, 456.1, 379.9, 255.2]
  resolution: [752, 480]
  timeshift_cam_imu: 0.01
cam2:
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, 0.2]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: ds
  distortion_coeffs: []
  distortion_model: none
  intrinsics: [-0.2, 0.6, 300.0, 301.0, 375.0, 239.0]
  resolution: [752, 480]
"""


def test_kalibrs_cameras_are_mounts_of_a_rig(tmp_path: Path) -> None:
    path = tmp_path / "camchain.yaml"
    path.write_text(KALIBR)
    found = import_network(path)
    n = found.network
    assert [camera.kind.name for camera in n.cameras] == ["pinhole", "fisheye", "double_sphere"]
    assert n.cameras[0].fx_px == 458.6 and n.cameras[2].parameters[4].value == -0.2
    assert n.mounts_fixed == [True, False, False] and n.mount_names == ["cam0", "cam1", "cam2"]
    assert np.allclose(n.mount_poses[2][:3, 3], [-0.11007 + 0.2, 0.0004, -0.0008])
    assert any("timeshift_cam_imu" in note for note in found.notes)
    for old, new, complaint in (
        ("resolution: [752, 480]", "resolution: [752]", "`cam0.resolution`: must be a list of 2 numbers"),
        ("radtan", "fov", "`cam0.distortion_model`: must be radtan, equidistant or none, got 'fov'"),
        ("[0.0, 0.0, 0.0, 1.0]", "[0.0, 0.0, 0.1, 1.0]", "`cam1.T_cn_cnm1`: must be 4 rows of 4 numbers"),
        ("458.6,", "-458.6,", "cam0`: fx_px must be positive"),
    ):
        path.write_text(KALIBR.replace(old, new, 1))
        with pytest.raises(ValueError) as raised:
            import_network(path)
        assert complaint in str(raised.value)


def test_a_target_of_kalibr_is_a_fixed_body(tmp_path: Path) -> None:
    path, target = tmp_path / "camchain.yaml", tmp_path / "target.yaml"
    path.write_text(KALIBR)
    grid = "target_type: 'aprilgrid'\ntagCols: 6\ntagRows: 5\ntagSize: 0.088\ntagSpacing: 0.3\n"
    target.write_text(grid)
    n = import_network(path, target=target).network
    assert n.body_names == ["target"] and n.bodies_fixed == [True]
    corners = np.asarray(n.body_corners_m[0])
    assert corners.shape == (120, 3)
    tag = corners[4 * 7:4 * 8]  # second row, second column
    assert np.allclose(tag[0], [0.088 * 1.3, 0.088 * 1.3, 0]) and np.allclose(tag[2] - tag[0], [0.088, 0.088, 0])
    target.write_text(
        "target_type: checkerboard\ntargetCols: 6\ntargetRows: 7\nrowSpacingMeters: 0.06\ncolSpacingMeters: 0.05\n")
    corners = np.asarray(import_network(path, target=target).network.body_corners_m[0])
    assert corners.shape == (42, 3) and np.allclose(corners[7], [0.05, 0.06, 0])
    for old, new, complaint in (
        ("'aprilgrid'", "circlegrid", "`target_type`: must be aprilgrid or checkerboard, got 'circlegrid'"),
        ("tagCols: 6", "tagCols: 0", "`tagCols`: must be a whole number, 1 or more, got 0"),
        ("tagSize: 0.088", "tagSize: -1", "`tagSize`: must be positive, got -1"),
    ):
        target.write_text(grid.replace(old, new))
        with pytest.raises(ValueError) as raised:
            import_network(path, target=target)
        assert complaint in str(raised.value)
    with pytest.raises(ValueError, match="target: must be omitted for the format aicon"):
        import_network(write_aicon(tmp_path, aicon_files()), target=target)


def test_the_command_writes_a_network_that_can_be_adjusted(tmp_path: Path) -> None:
    source = write_aicon(tmp_path, aicon_files())
    code, text, _ = run("import-network", source, "--out", tmp_path / "converted")
    assert code == 0 and text.startswith("aicon: 1 cameras, 6 images, 25 points, 150 observations, 1 distances")
    assert "note: AICON's files do not state" in text
    adjust = ("--no-robust", "--json", "--out")
    code, converted, _ = run("calibrate", "network", tmp_path / "converted/network.yaml", *adjust, tmp_path / "a")
    assert code == 0
    code, direct, _ = run("calibrate", "network", source, *adjust, tmp_path / "b")
    assert code == 0
    first, second = json.loads(converted), json.loads(direct)
    assert first["datum_defect"] == 6 and first["redundancy"] == second["redundancy"] == 301 - 7 - 36 - 75 + 6
    assert any("AICON's files" in warning for warning in second["warnings"])
    camera = occ.read_camera(tmp_path / "b/camera 1.yaml")
    sigmas = np.sqrt(np.diag(camera.parameter_covariance))
    assert camera.kind is occ.CameraKind.brown_forward and sigmas[0] > 0 and sigmas[1] == pytest.approx(sigmas[0])


def test_other_sources_are_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("nothing\n")
    code, _, err = run("import-network", tmp_path / "notes.txt", "--out", tmp_path / "out")
    assert code == 2 and "is in none of the formats aicon, colmap, kalibr, dbat, photomodeler, bal" in err
    assert format_of(Path(__file__).parents[2] / "data/calibration/panorama/network.yaml") is None
    path = write_aicon(tmp_path, aicon_files())
    with pytest.raises(ValueError, match="control: must be omitted for the format aicon"):
        import_network(path, control="x")
