# SPDX-License-Identifier: Apache-2.0
"""`libocc locate` with the picture of a camera that was never calibrated: focal length from EXIF, honest sigma."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from exif_pictures import FOCAL_35MM, ZOOM, save_with_exif

import libocc as occ

Run = Callable[..., tuple[int, str, str]]
SIZE = {"width": 800, "height": 600}
LAMPS = [[1, 1, 2.5], [2.5, 1, 2.5], [1.7, 1.4, 2.5], [1.1, 2, 2.5], [2.6, 2.1, 2.5], [1.9, 2.2, 2.5]]
PLACE = np.array([1.8, 1.5, 0.1])
FILM_MM = 27
STATED_PX = FILM_MM * 1000 / np.hypot(36, 24)
SCENE = "schema: libocc-scene/1\nsensor: {response: srgb}\nlamps:\n" + "".join(
    f"  - {{id: {i}, centre_m: {centre}, radius_m: 0.08}}\n" for i, centre in enumerate(LAMPS)
)


def lens(focal_error: float, ratio_error: float, principal_px: list[float], distortion: list[float]) -> occ.Camera:
    """A camera whose EXIF data say STATED_PX. focal_error, ratio_error: relative. distortion: k1 k2 p1 p2 k3."""
    focal_px = STATED_PX * (1 + focal_error)
    return occ.Camera.pinhole(
        **SIZE, fx_px=focal_px, fy_px=focal_px * (1 + ratio_error), cx_px=399.5 + principal_px[0],
        cy_px=299.5 + principal_px[1], distortion=distortion,
    )  # fmt: skip


TRUE_LENS = lens(0.03, 0.0008, [6, -5], [0.09, -0.2, 3e-4, -5e-4, 0.1])


def picture(camera: occ.Camera, seed: int = 0) -> np.ndarray:
    """JPEG-like grey picture of all lamps from PLACE, tilted."""
    room = occ.Scene(
        camera=camera,
        lamps=[occ.Lamp(id=i, centre_m=centre, radius_m=0.08, power_w=0.6) for i, centre in enumerate(LAMPS)],
        sensor=occ.Sensor(
            pixel_pitch_m=5e-6, f_number=1.8, exposure_s=1 / 16000, full_well_e=6000, gain_dn_per_e=255 / 6000,
            read_noise_e=3, response=occ.Response.srgb,
        ),
    )  # fmt: skip
    image, truth = occ.simulate(room, occ.look_at(PLACE, [1.9, 1.6, 2.5], up=[0.2, 1, 0]), seed=seed)
    assert all(lamp.whole for lamp in truth.lamps)
    return np.asarray(image)


def chi2(fix: occ.Fix) -> float:
    error = fix.position_m - PLACE
    return float(error @ np.linalg.solve(fix.position_covariance_m2, error))


def test_a_picture_with_exif_needs_no_calibration(libocc: Run, tmp_path: Path) -> None:
    save_with_exif(tmp_path / "photo.jpg", picture(TRUE_LENS), {FOCAL_35MM: FILM_MM})
    Path("room.yaml").write_text(SCENE)
    code, out, err = libocc("locate", "photo.jpg", "room.yaml")
    assert code == 0, out + err
    assert "not calibrated: 624 px +- 5 % by FocalLengthIn35mmFilm 27 mm; calibrated, the sigma would be about" in out
    assert "exact     map" in out  # of the camera nothing is taken as exact
    found = json.loads(libocc("locate", "photo.jpg", "room.yaml", "--json")[1])
    sigma_m = np.sqrt(np.trace(found["position_covariance_m2"]))
    error_m = np.linalg.norm(np.subtract(found["position_m"], PLACE))
    assert 0.01 < sigma_m < 0.2 and error_m < 3 * sigma_m
    assert found["camera"]["source"] == "EXIF: FocalLengthIn35mmFilm 27 mm"
    assert found["camera"]["sigma_over_calibrated"] > 5

    # The camera's own file replaces that of the scene, or of the EXIF data, and is far more accurate.
    occ.write_camera("camera.yaml", TRUE_LENS)
    code, out, err = libocc("locate", "photo.jpg", "room.yaml", "--camera", "camera.yaml", "--json")
    exact = json.loads(out)
    assert code == 0 and exact["camera"] is None, err
    assert np.linalg.norm(np.subtract(exact["position_m"], PLACE)) < 2e-3


def test_exif_replaces_the_scenes_camera_only_when_asked(libocc: Run, tmp_path: Path) -> None:
    save_with_exif(tmp_path / "photo.jpg", picture(TRUE_LENS), {FOCAL_35MM: FILM_MM})
    occ.write_camera("camera.yaml", TRUE_LENS)
    Path("room.yaml").write_text(SCENE.replace("lamps:", "camera: {file: camera.yaml}\nlamps:"))
    assert "not calibrated" not in libocc("locate", "photo.jpg", "room.yaml")[1]
    assert "not calibrated" in libocc("locate", "photo.jpg", "room.yaml", "--camera", "exif")[1]


@pytest.mark.parametrize("count", [pytest.param(12, id="few"), pytest.param(120, id="many", marks=pytest.mark.slow)])
def test_sigmas_hold_for_lenses_as_stated(libocc: Run, tmp_path: Path, count: int) -> None:
    from libocc.cli.picture_camera import DISTORTION_SIGMAS, PRINCIPAL_SIGMA, RATIO_SIGMA, exif_camera

    save_with_exif(tmp_path / "photo.jpg", np.zeros((600, 800), np.uint8), {FOCAL_35MM: FILM_MM})
    stated, focal = exif_camera(str(tmp_path / "photo.jpg"))
    (tmp_path / "room.yaml").write_text(SCENE)
    scene = occ.Scene.load(tmp_path / "room.yaml", camera=stated)
    random, squared = np.random.default_rng(7), []
    for i in range(count):
        principal = random.normal(0, PRINCIPAL_SIGMA * SIZE["width"], 2).tolist()
        distortion = [random.normal(0, DISTORTION_SIGMAS[name]) for name in ("k1", "k2", "p1", "p2", "k3")]
        true = lens(
            random.normal(0, focal.sigma_px / focal.px), random.normal(0, RATIO_SIGMA), principal, distortion
        )
        fix = occ.locate(picture(true, i), scene)
        assert fix.ok, (i, fix.message)
        squared.append(chi2(fix))
    assert max(squared) < 25  # chi-square with 3 degrees of freedom: 1 in 60 000
    # NEES over 3: within five standard deviations of a mean of `count` such values.
    assert abs(np.mean(squared) / 3 - 1) < 5 * np.sqrt(2 / (3 * count))


@pytest.mark.parametrize(
    "tags, options, text",
    [
        ({}, [], "photo.jpg: has no focal length in its EXIF data (FocalLengthIn35mmFilm"),
        ({FOCAL_35MM: 27, ZOOM: 2.0}, [], "photo.jpg: was taken with a digital zoom of 2"),
        ({FOCAL_35MM: 27}, ["--camera", "absent.yaml"], "absent.yaml: cannot be read"),
        ({FOCAL_35MM: 27}, ["--camera", "small.yaml"], "photo.jpg: image must be of the camera's size"),
    ],
)
def test_wrong_input(libocc: Run, tmp_path: Path, tags: dict[int, object], options: list[str], text: str) -> None:
    save_with_exif(tmp_path / "photo.jpg", np.zeros((600, 800), np.uint8), tags)
    Path("room.yaml").write_text(SCENE)
    occ.write_camera("small.yaml", occ.Camera.pinhole(width=9, height=9, fx_px=9, fy_px=9, cx_px=4, cy_px=4))
    code, out, err = libocc("locate", "photo.jpg", "room.yaml", *options)
    assert code == 2 and not out and text in err, err


def test_a_scene_without_camera_names_the_key_elsewhere(libocc: Run) -> None:
    Path("room.yaml").write_text(SCENE)
    code, _, err = libocc("simulate", "room.yaml", "--position", 1, 1, 0)
    assert code == 2 and "key `camera`: is missing" in err


def test_a_precise_map_gives_no_flat_valley() -> None:
    """Errors of the camera move the image by thousands of sigmas; chi2 at other poses needs other estimates of them."""
    from libocc.cli.picture_camera import lens_sigmas

    size = {"width": 1600, "height": 1200}
    phone = occ.Camera.pinhole(**size, fx_px=1234, fy_px=1235, cx_px=809, cy_px=595, distortion=[0.09, -0.2, 0, 0, 0.1])
    unknown = occ.Camera.pinhole(
        **size, fx_px=1248, fy_px=1248, cx_px=799.5, cy_px=599.5, parameter_sigmas=lens_sigmas(1600, 1248, 62.4)
    )
    places_m = [[0.75, 0.75, 2.485], [2.7, 0.8, 2.485], [1.65, 1.3, 2.485], [0.8, 2.2, 2.485], [2.85, 2.35, 2.485]]
    lamps = [occ.Lamp(id=i, centre_m=at, radius_m=0.0825, power_w=0.6) for i, at in enumerate(places_m)]
    sensor = occ.Sensor(
        pixel_pitch_m=3.5e-6, f_number=1.8, exposure_s=1 / 6000, full_well_e=6000, gain_dn_per_e=255 / 6000,
        read_noise_e=3,
    )  # fmt: skip
    scene = occ.Scene(camera=phone, lamps=lamps, sensor=sensor)
    for seed, (x, y) in enumerate([(1.3, 1.5), (2.3, 1.5), (1.5, 1.5)]):
        pose = occ.look_at([x, y, 0.01], [1.8, 1.55, 2.5], up=[np.sin(0.1), np.cos(0.1), 0])
        image, _ = occ.simulate(scene, pose, seed=seed)
        fix = occ.locate(image, scene.replace(camera=unknown))
        assert fix.ok, fix.message
        sigmas_m = np.sqrt(np.diag(fix.position_covariance_m2))
        assert sigmas_m.max() < 0.2
        assert (np.abs(fix.position_m - [x, y, 0.01]) < 3 * sigmas_m).all()
