# SPDX-License-Identifier: Apache-2.0
"""Calibration of cameras and survey of lamps from images, by the commands."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from calibration_support import errors_in_sigmas
from click.testing import CliRunner
from exif_pictures import FOCAL_35MM, ZOOM, save_with_exif

import libocc as occ
from libocc.cli import main
from libocc.cli.commands.calibrate_camera import focal_of_pictures, start_camera
from libocc.cli.commands.calibrate_lamps import shared_errors
from libocc.cli.exif import FocalLength

CAMERA = occ.Camera.pinhole(
    width=800, height=600, fx_px=640, fy_px=642, cx_px=405, cy_px=296, distortion=[-0.2, 0.07, 1e-3, -5e-4, 0]
)
PANORAMA = occ.Camera.rotating_line(
    width=4000, height=1100, c_px=620, cy_px=545, tilt_x_rad=0.003, tilt_y_rad=-0.004, eccentricity_m=[0.02, -0.01, 0],
    k1=0.01,
)


def run(*arguments: object) -> tuple[int, str, str]:
    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr


def save(path: Path, pixels: Any) -> Path:
    occ.write_image(path, pixels)
    return path


def picture(pose: Any, seed: int, **targets: Any) -> Any:
    return occ.targets.TargetRenderer(CAMERA, pose, **targets, noise_dn=1, seed=seed).window(0, 0, 800, 600)


def wall_of_tags() -> list[occ.Tag]:
    """Tags on two walls of a corner."""
    tags = []
    for i in range(16):
        column, row = i % 4, i // 4
        if column < 2:
            place, normal, x_axis = [0.25 + 0.4 * column, 0, 0.3 + 0.35 * row], [0, 1, 0], [-1, 0, 0]
        else:
            place, normal, x_axis = [0, 0.25 + 0.4 * (column - 2), 0.3 + 0.35 * row], [1, 0, 0], [0, 1, 0]
        tags.append(occ.Tag(id=i, size_m=0.16, centre_m=place, normal=normal, x_axis=x_axis))
    return tags


def views() -> list[Any]:
    """Poses around the corner, some rotated about the optical axis."""
    poses = []
    for i in range(9):
        angle = math.radians(20 + 50 * (i % 3) / 2)
        distance = 1.5 + 0.25 * (i // 3)
        at = [distance * math.cos(angle), distance * math.sin(angle), 0.5 + 0.3 * (i // 3)]
        up = [[0, 0, 1], [0.7, 0.7, 1], [0, 0, -1]][i % 3]
        poses.append(occ.look_at(position_m=at, target_m=[0.2, 0.2, 0.8], up=up))
    return poses


@pytest.fixture(scope="module")
def tag_pictures(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("tags")
    return [
        save(folder / f"view{i}.png", picture(pose, i, tags=wall_of_tags()))
        for i, pose in enumerate(views())
    ]


def test_images_of_tags_at_unknown_positions_calibrate_the_camera(tag_pictures: list[Path], tmp_path: Path) -> None:
    out = tmp_path / "out"
    code, text, err = run("calibrate", "camera", *tag_pictures, "--tag-size", 0.16, "--out", out)
    assert code == 0, err
    off = errors_in_sigmas(out, CAMERA)
    assert len(off) == 9 and max(map(abs, off.values())) < 4.5
    for name in ("camera.yaml", "camera_opencv.yaml", "camera_ros.yaml"):
        found = occ.read_camera(out / name)
        assert found.fx_px == pytest.approx(CAMERA.fx_px, rel=0.01)
        (tmp_path / "room.yaml").write_text(f"schema: libocc-scene/1\ncamera: {{file: out/{name}}}\nlamps: []\n")
        of_scene = occ.Scene.load(tmp_path / "room.yaml").camera
        assert [(p.name, p.value) for p in of_scene.parameters] == [(p.name, p.value) for p in found.parameters]
    assert "uncertainty of camera" in (out / "report.html").read_text()


@pytest.fixture(scope="module")
def phone_pictures(tag_pictures: list[Path], tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """The pictures of tags as JPEG files with EXIF data; every second one is displayed rotated."""
    folder = tmp_path_factory.mktemp("phone")
    film_mm = round(CAMERA.fx_px / math.hypot(CAMERA.width, CAMERA.height) * math.hypot(36, 24))
    return [
        save_with_exif(folder / f"{i}.jpg", occ.read_image(path), {FOCAL_35MM: film_mm}, orientation=6 if i % 2 else 1)
        for i, path in enumerate(tag_pictures)
    ]


@pytest.mark.parametrize("model", ["pinhole", "fisheye", "brown_backward"])
def test_rotated_pictures_of_a_phone_calibrate_it(phone_pictures: list[Path], tmp_path: Path, model: str) -> None:
    code, text, err = run(
        "calibrate", "camera", *phone_pictures, "--tag-size", 0.16, "--model", model, "--out", tmp_path / "out"
    )
    assert code == 0, err
    camera = occ.read_camera(tmp_path / "out" / "camera.yaml")
    assert camera.fx_px == pytest.approx(CAMERA.fx_px, rel=0.01)
    assert camera.parameter_covariance[0, 0] > 0
    # The targets give the focal length of a pinhole camera.
    assert ("warning: the initial focal length is that of the EXIF data (Focal" in text) == (model == "fisheye")


def test_pictures_of_two_lenses_are_a_warning(phone_pictures: list[Path], tmp_path: Path) -> None:
    other = save_with_exif(tmp_path / "tele.jpg", occ.read_image(phone_pictures[0]), {FOCAL_35MM: 52, ZOOM: 2.0})
    found, notes = focal_of_pictures([str(phone_pictures[0]), str(other), "absent.npy"], (800, 600))
    assert found is not None and found.px == pytest.approx(CAMERA.fx_px, rel=0.03)
    assert len(notes) == 2 and "digital zoom of 2" in notes[0] and "another lens is another camera" in notes[1]
    assert focal_of_pictures(["absent.npy"], (800, 600)) == (None, [])


def test_the_focal_length_starts_from_exif_data_where_the_views_do_not_give_it() -> None:
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    exif = FocalLength(640, 30, "FocalLengthIn35mmFilm 28 mm")
    frontal: list[Any] = [(square, 300 + 100 * square)]  # determines no focal length
    camera, notes = start_camera("pinhole", (800, 600), frontal, None, 5, exif)
    assert camera.fx_px == 640 and "EXIF data (FocalLengthIn35mmFilm 28 mm): 640 px" in notes[0]
    camera, notes = start_camera("pinhole", (800, 600), frontal, None, 5)
    assert "is a guess" in notes[0]
    assert start_camera("pinhole", (800, 600), frontal, 700, 5, exif)[0].fx_px == 700


def test_a_picture_that_was_rotated_later_is_an_error(phone_pictures: list[Path], tmp_path: Path) -> None:
    turned = save(tmp_path / "turned.png", np.ascontiguousarray(np.rot90(occ.read_image(phone_pictures[1]))))
    code, _, err = run(
        "calibrate", "camera", phone_pictures[0], turned, "--tag-size", 0.16, "--out", tmp_path / "out"
    )
    assert code == 2 and "its size is 600 x 800 px" in err and "was rotated after it was taken" in err


def test_a_wrong_size_or_too_few_pictures_are_said(tag_pictures: list[Path], tmp_path: Path) -> None:
    code, _, err = run("calibrate", "camera", tag_pictures[0], "--tag-size", 0.16, "--out", tmp_path / "out")
    assert code == 2 and "too_few_lamps" in err
    code, _, err = run("calibrate", "camera", *tag_pictures, "--out", tmp_path / "out")
    assert code == 2 and "--tag-size" in err
    other = save(tmp_path / "other.png", np.zeros((10, 20), np.uint8))
    code, _, err = run("calibrate", "camera", *tag_pictures, other, "--tag-size", 0.16, "--out", tmp_path / "out")
    assert code == 2 and "20 x 10 px" in err and str(other) in err
    code, _, err = run("calibrate", "camera", other, "--tag-size", 0.16, "--out", tmp_path / "out")
    assert code == 2 and "no tag36h11 tag was detected in any of 1 images" in err


def test_a_model_that_does_not_fit_is_said(tag_pictures: list[Path], tmp_path: Path) -> None:
    out = tmp_path / "out"
    _, text, err = run("calibrate", "panorama", *tag_pictures, "--tag-size", 0.16, "--c-px", 600, "--out", out)
    assert "times as large as their sigmas" in text + err
    assert "times as large as their sigmas" in (out / "report.html").read_text()


def test_pictures_of_a_chessboard_calibrate_the_camera(tmp_path: Path) -> None:
    pictures = []
    for i in range(8):
        at = [0.12 * math.cos(i), 0.12 * math.sin(1.7 * i), -0.42 - 0.03 * (i % 3)]
        up = [0.3 * (i % 3), -1, 0]
        pose = occ.look_at(position_m=[0.12 + at[0], 0.075 + at[1], at[2]], target_m=[0.12, 0.075, 0], up=up)
        pixels = picture(pose, i, boards=[occ.targets.ChessboardTarget(square_m=0.03)])
        pictures.append(save(tmp_path / f"board{i}.png", pixels))
    out = tmp_path / "out"
    code, _, err = run("calibrate", "camera", *pictures, "--chessboard", "9x6", "--square", 0.03, "--out", out)
    assert code == 0, err
    off = errors_in_sigmas(out, CAMERA)
    assert max(map(abs, off.values())) < 4.5


def test_panoramas_of_tags_calibrate_a_rotating_line(tmp_path: Path) -> None:
    tags = []
    for i in range(40):
        wall, along, high = i % 4, (i // 4) % 5, i // 20
        at, up = 0.6 + 1.2 * along, 0.7 + 1.2 * high + 0.2 * (along % 2)
        place = [[at, 0, up], [6.6, at, up], [at, 6.6, up], [0, at, up]][wall]
        normal = [[0, 1, 0], [-1, 0, 0], [0, -1, 0], [1, 0, 0]][wall]
        x_axis = [[-1, 0, 0], [0, -1, 0], [1, 0, 0], [0, 1, 0]][wall]
        tags.append(occ.Tag(id=i, size_m=0.4, centre_m=place, normal=normal, x_axis=x_axis))
    pictures = []
    for i, at in enumerate([[3.3, 3.1, 1.3], [1.8, 2.0, 1.0], [4.9, 2.2, 1.7], [2.2, 4.8, 1.5]]):
        tilt, turn = 0.06 * (i - 1.5), 1.3 * i
        down = np.diag([1.0, -1.0, -1.0])
        about_z = np.array([[math.cos(turn), -math.sin(turn), 0], [math.sin(turn), math.cos(turn), 0], [0, 0, 1]])
        about_x = np.array([[1, 0, 0], [0, math.cos(tilt), -math.sin(tilt)], [0, math.sin(tilt), math.cos(tilt)]])
        pose = np.eye(4)
        pose[:3, :3] = about_x @ about_z @ down
        pose[:3, 3] = -pose[:3, :3] @ at
        pixels = occ.targets.TargetRenderer(PANORAMA, pose, tags=tags, noise_dn=1, seed=i).window(0, 0, 4000, 1100)
        pictures.append(save(tmp_path / f"station{i}.png", pixels))
    out = tmp_path / "out"
    code, _, err = run("calibrate", "panorama", *pictures, "--tag-size", 0.4, "--c-px", 600, "--out", out)
    assert code == 0, err
    off = errors_in_sigmas(out, PANORAMA)
    assert len(off) == 9 and max(map(abs, off.values())) < 4.5


def test_lamps_are_surveyed_better_than_the_map(tmp_path: Path) -> None:
    scene = occ.Scene.load(Path(__file__).parents[2] / "data/scenes/irregular_six.yaml")
    random = np.random.default_rng(1)
    shifts = 0.01 * random.standard_normal((len(scene.lamps), 3))
    lamps = [lamp.replace(centre_m=lamp.centre_m + shift) for lamp, shift in zip(scene.lamps, shifts)]
    rough = scene.replace(lamps=lamps)
    (tmp_path / "rough.yaml").write_text(rough.format())
    pictures = []
    places = [[1.7, 2.1, 0.5], [2.3, 1.8, 0.4], [1.9, 2.4, 0.9], [2.2, 2.2, 0.2], [1.8, 1.8, 0.8], [2.4, 2.3, 0.6]]
    for i, at in enumerate(places):
        pose = occ.look_at(position_m=at, target_m=[2, 2, 3], up=[math.cos(i), math.sin(i), 0])
        image, _ = occ.simulate(scene, pose, seed=i)
        pictures.append(save(tmp_path / f"{i}.png", image))
    first, second = scene.lamps[0].centre_m, scene.lamps[3].centre_m
    bar = float(np.linalg.norm(first - second))
    out = tmp_path / "out"
    code, text, err = run("calibrate", "lamps", *pictures, "--map", tmp_path / "rough.yaml",
                           "--distance", "lamp 0", "lamp 3", bar, 1e-4, "--out", out)
    assert code == 0, err
    surveyed = occ.Scene.load(out / "scene.yaml")
    printed = [line for line in text.splitlines() if line.startswith("lamp ")]
    assert len(printed) == 6 and all("m, sigma " in line and line.endswith(" mm from the map") for line in printed)
    moved_mm = float(printed[0].split(", ")[2].split()[0])
    assert moved_mm == pytest.approx(1e3 * np.linalg.norm(surveyed.lamps[0].centre_m - lamps[0].centre_m), abs=0.06)

    def spread(lamps: list[occ.Lamp]) -> float:
        """Error of the distances between lamps, which are independent of the datum."""
        at, true = (np.array([lamp.centre_m for lamp in each]) for each in (lamps, scene.lamps))
        apart = [np.linalg.norm(p[:, None] - p[None], axis=2) for p in (at, true)]
        return float(np.abs(apart[0] - apart[1]).max())

    assert spread(surveyed.lamps) < 1e-3 < 5e-3 < spread(rough.lamps)
    shared_m = np.array([lamp.shared_errors_m for lamp in surveyed.lamps])
    sigmas_m = np.sqrt([np.square(lamp.position_sigma_m) for lamp in surveyed.lamps] + (shared_m**2).sum(axis=1))
    printed_mm = np.array([line.split("sigma ")[1].split()[:3] for line in printed], dtype=float)
    assert 1e3 * sigmas_m == pytest.approx(printed_mm, rel=0.06)


def test_a_joint_covariance_is_split_into_own_and_shared_errors() -> None:
    random = np.random.default_rng(5)
    places = random.uniform(-2, 2, (7, 3))
    own = np.array([[0.001, 0.002, 0.003]] * 7)
    independent = np.zeros((7, 7, 3, 3))
    independent[range(7), range(7)] = np.eye(3) * own[:, None] ** 2
    sigmas_m, errors_m = shared_errors(independent)
    assert len(errors_m) == 0 and sigmas_m == pytest.approx(own)

    scale, height = 0.005 * places, np.array([[0, 0, 0.02]] * 7)
    joint = independent + sum(np.einsum("ia,jb->ijab", error, error) for error in (scale, height))
    sigmas_m, errors_m = shared_errors(joint)
    assert len(errors_m) == 2
    stated = np.zeros_like(joint)
    stated[range(7), range(7)] = np.eye(3) * sigmas_m[:, None] ** 2
    stated += sum(np.einsum("ia,jb->ijab", error, error) for error in errors_m)
    for motion in (scale, height):
        true, now = (np.einsum("ia,ijab,jb", motion, covariance, motion) for covariance in (joint, stated))
        assert true < now < 1.1 * true
    assert np.einsum("iiaa->ia", stated) == pytest.approx(np.einsum("iiaa->ia", joint))


def test_the_scale_of_a_survey_is_a_shared_error(tmp_path: Path, rough_survey: list[Path]) -> None:
    scene = occ.Scene.load(Path(__file__).parents[2] / "data/scenes/irregular_six.yaml")
    bar_m, sigma_m = float(np.linalg.norm(scene.lamps[0].centre_m - scene.lamps[2].centre_m)), 0.02
    code, _, err = run("calibrate", "lamps", *rough_survey, "--map", "irregular_six",
                       "--distance", "lamp 0", "lamp 2", bar_m, sigma_m, "--out", tmp_path / "out")
    assert code == 0, err
    surveyed = occ.Scene.load(tmp_path / "out" / "scene.yaml")
    errors_m = np.array([lamp.shared_errors_m for lamp in surveyed.lamps])  # (lamp, error, axis)
    between_m = np.array(surveyed.lamps[2].centre_m) - surveyed.lamps[0].centre_m
    stretch_m = (errors_m[2] - errors_m[0]) @ between_m / np.linalg.norm(between_m)
    assert np.linalg.norm(stretch_m) == pytest.approx(sigma_m, rel=0.1)
    # A camera 2.7 m below the lamps is as far off as the scale, if the sizes of the lamps do not determine that.
    pose = occ.look_at(position_m=[1.9, 2.1, 0.3], target_m=[2, 2, 3], up=[0, 1, 0])
    sized = surveyed.replace(lamps=[lamp.replace(size_sigma=0.1) for lamp in surveyed.lamps])
    fix = occ.locate(occ.simulate(scene, pose, seed=9)[0], sized)
    assert fix.ok and fix.position_covariance_m2[2, 2] ** 0.5 == pytest.approx(2.7 * sigma_m / bar_m, rel=0.15)


@pytest.fixture
def rough_survey(tmp_path: Path) -> list[Path]:
    """Five pictures of irregular_six, written to a folder."""
    scene = occ.Scene.load(Path(__file__).parents[2] / "data/scenes/irregular_six.yaml")
    pictures = []
    for i, at in enumerate([[1.7, 2.1, 0.5], [2.3, 1.8, 0.4], [1.9, 2.4, 0.9], [2.2, 2.2, 0.2], [1.8, 1.8, 0.8]]):
        pose = occ.look_at(position_m=at, target_m=[2, 2, 3], up=[math.cos(i), math.sin(i), 0])
        pictures.append(save(tmp_path / f"{i}.png", occ.simulate(scene, pose, seed=i)[0]))
    return pictures


def test_a_wrong_distance_and_low_redundancy_are_warnings(tmp_path: Path, rough_survey: list[Path]) -> None:
    survey = ["calibrate", "lamps", "--map", "irregular_six"]
    distance = ["--distance", "lamp 0", "lamp 2", 2.35, 0.001]
    code, text, err = run(*survey, *rough_survey, *distance, "--out", tmp_path / "a")
    assert code == 0 and "warning: the lamps are +5.8 % farther apart than in the map" in text, err
    code, text, err = run(*survey, *rough_survey, "--out", tmp_path / "b")
    assert code == 0 and "warning" not in text, err


def test_two_pictures_are_a_survey_without_redundancy(tmp_path: Path, rough_survey: list[Path]) -> None:
    survey = ["calibrate", "lamps", "--map", "irregular_six"]
    code, text, err = run(*survey, *rough_survey[:2], "--out", tmp_path / "two")
    assert code == 0 and "warning: redundancy 0: gross errors are not detected" in text, err
    assert "lamp 0 was not surveyed; the position in the map is kept" in text
    assert None in json.loads((tmp_path / "two" / "result.json").read_text())["reliability"].values()
    code, text, err = run("calibrate", "lamps", rough_survey[0], "--map", "irregular_six", "--out", tmp_path / "one")
    assert code == 2 and "identified in 1 of 1 images; at least 2 are needed" in err


def test_a_rotated_picture_of_lamps_is_an_error(tmp_path: Path, rough_survey: list[Path]) -> None:
    turned = save(tmp_path / "turned.png", np.ascontiguousarray(np.rot90(occ.read_image(str(rough_survey[0])))))
    code, _, err = run("calibrate", "lamps", *rough_survey, turned, "--map", "irregular_six", "--out", tmp_path / "out")
    assert code == 2 and "turned.png: its size is 480 x 640 px" in err and "it was rotated after it was taken" in err
