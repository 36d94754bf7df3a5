# SPDX-License-Identifier: Apache-2.0
"""Maps of lamps from pictures alone, from Python and from the command line."""

import json

import numpy as np
import pytest
from survey_support import rendered_pictures

import libocc as occ
from libocc import samples
from libocc.cli.poses import upward_pose
from libocc.network.files import network_files
from libocc.network.starts import similarity

PLACES = [(1.7, 2.1, 0.5, 10), (2.3, 1.8, 0.4, 90), (1.9, 2.4, 0.6, 200), (2.2, 2.2, 0.2, 300), (1.6, 1.8, 0.3, 140)]


@pytest.fixture(scope="module")
def room():
    return samples.load_scene("irregular_six")


@pytest.fixture(scope="module")
def pictures(room, tmp_path_factory):
    return rendered_pictures(room, PLACES, tmp_path_factory.mktemp("pictures"))


@pytest.fixture(scope="module")
def surveyed(room, pictures):
    seen = [(name.name, occ.detect(occ.read_image(name), sensor=room.sensor)) for name in pictures]
    return occ.surveying.survey(seen, room.camera, radius_m=room.lamps[0].radius_m, radius_sigma=1e-4)


def matching(scene, room):
    """Lamp of the room for each lamp of the map, and the room's positions in the order of the map."""
    import itertools

    made = np.array([lamp.centre_m for lamp in scene.lamps])
    true = np.array([lamp.centre_m for lamp in room.lamps])
    distances = np.linalg.norm(made[:, None] - made[None], axis=2)
    best = min(
        itertools.permutations(range(len(true)), len(made)),
        key=lambda order: np.abs(np.linalg.norm(true[list(order)][:, None] - true[list(order)][None], axis=2)
                                 - distances).max(),
    )
    return best, made, true[list(best)]


def matching_up_to_scale(scene, room):
    """matching() of a map with a free scale."""
    made, true = ([lamp.centre_m for lamp in one.lamps] for one in (scene, room))
    factor = np.ptp(np.linalg.norm(np.subtract(true, np.mean(true, axis=0)), axis=1)) / np.ptp(
        np.linalg.norm(np.subtract(made, np.mean(made, axis=0)), axis=1))
    lamps = [lamp.replace(centre_m=factor * np.array(lamp.centre_m)) for lamp in scene.lamps]
    return matching(scene.replace(lamps=lamps), room)


def test_a_survey_has_all_lamps_and_their_errors(surveyed, room):
    assert surveyed.ok, surveyed.message
    scene = occ.surveying.scene_of(surveyed, room.camera, room.sensor)
    assert len(scene.lamps) == 6
    _, made, true = matching(scene, room)
    d_made = np.linalg.norm(made[:, None] - made[None], axis=2)
    d_true = np.linalg.norm(true[:, None] - true[None], axis=2)
    assert np.abs(d_made - d_true).max() < 5e-3
    for lamp in scene.lamps:
        assert 0 < np.max(lamp.position_sigma_m) < 5e-3
    assert 1e-4 < scene.map_scale_sigma < 1e-2
    assert "  - \"the scale is that of the given radius" in scene.format()


def test_the_rims_are_observations_which_a_network_file_does_not_hold(surveyed):
    network = surveyed.network
    assert len(network.outlines) > 0.8 * len(network.observations)
    assert max(network.outlines) < len(network.observations)
    text = network_files(network)["network.yaml"].decode()
    assert f"# {len(network.outlines)} outlines about points are not in this file." in text


def test_the_map_locates_other_pictures(surveyed, room):
    scene = occ.surveying.scene_of(surveyed, room.camera, room.sensor)
    image, _ = occ.simulate(room, upward_pose([2.0, 2.0, 0.45], 33, 5, 20), seed=77)
    fix = occ.locate(image, scene)
    assert fix.ok, fix.message
    assert len(fix.lamps) >= 4


@pytest.mark.slow
def test_the_pose_in_the_made_map_is_nearly_as_good_as_in_the_true_one(room):
    random = np.random.default_rng(3)

    def picture(seed):
        pose = upward_pose([*random.uniform([1.4, 1.4], [2.6, 2.6]), random.uniform(0.2, 0.7)],
                           *random.uniform([0, 0, 0], [360, 8, 360]))
        return pose, occ.simulate(room, pose, seed=seed)[0]

    seen = [(f"p{i}", occ.detect(picture(i)[1], sensor=room.sensor)) for i in range(150)]
    found = occ.surveying.survey(seen, room.camera, radius_m=room.lamps[0].radius_m, radius_sigma=1e-4)
    scene = occ.surveying.scene_of(found, room.camera, room.sensor)
    _, made, true = matching(scene, room)
    _, true_from_made, _ = similarity(made, true)
    errors_m, nees = {"true": [], "made": []}, []
    for i in range(60):
        pose, image = picture(1000 + i)
        at = -pose[:3, :3].T @ pose[:3, 3]
        in_true, in_made = occ.locate(image, room), occ.locate(image, scene)
        assert in_true.ok and in_made.ok
        errors_m["true"].append(in_true.position_m - at)
        errors_m["made"].append(true_from_made @ (in_made.position_m - made.mean(axis=0)) + true.mean(axis=0) - at)
        covariance = true_from_made @ in_made.position_covariance_m2 @ true_from_made.T
        nees.append(errors_m["made"][-1] @ np.linalg.solve(covariance, errors_m["made"][-1]))
    rms_m = {name: np.sqrt(np.mean(np.sum(np.square(each), axis=1))) for name, each in errors_m.items()}
    assert rms_m["made"] < 1.3 * rms_m["true"]
    # The alignment to the true lamps removes the error of the scale, one of three dimensions.
    assert 1.3 < np.mean(nees) < 3.8


def test_the_scale_of_a_map_is_an_error_of_its_own():
    random = np.random.default_rng(5)
    at_m = random.uniform(-2, 2, (7, 3))
    by_scale = (at_m - at_m.mean(axis=0)).ravel()
    own = np.diag(random.uniform(1e-6, 2e-6, 21))
    joint = own + 0.005**2 * np.outer(by_scale, by_scale)
    rest, sigma = occ.surveying.without_scale(joint.reshape(7, 3, 7, 3).transpose(0, 2, 1, 3), at_m)
    rest = rest.transpose(0, 2, 1, 3).reshape(21, 21)
    assert sigma == pytest.approx(0.005, rel=0.02)
    assert rest + sigma**2 * np.outer(by_scale, by_scale) == pytest.approx(joint, abs=1e-15)
    assert np.linalg.eigvalsh(rest).min() > -1e-15
    errors_m = occ.surveying.shared_errors(rest.reshape(7, 3, 7, 3).transpose(0, 2, 1, 3))[1]
    assert len(errors_m) == 0
    # A map whose scale is exact, such as one with its size set to 1, keeps its covariance.
    away = np.eye(21) - np.outer(by_scale, by_scale) / (by_scale @ by_scale)
    exact = (away @ own @ away).reshape(7, 3, 7, 3).transpose(0, 2, 1, 3)
    rest, sigma = occ.surveying.without_scale(exact, at_m)
    assert sigma == 0 and rest is exact


def test_the_command_writes_the_whole_folder(libocc, pictures, tmp_path):
    out = tmp_path / "room"
    code, text, errors = libocc("survey", *pictures, "--camera", "irregular_six", "--radius", 0.085, "--out", out)
    assert code == 0, errors
    for name in ("scene.yaml", "plan.png", "report.html", "result.json", "trajectory.tum"):
        assert (out / name).stat().st_size > 0, name
    data = json.loads((out / "result.json").read_text())
    assert data["scale"] == "radius" and len(data["lamps"]) == 6 and len(data["pictures"]) == 5
    assert len(occ.Scene.load(out / "scene.yaml").lamps) == 6
    assert len(occ.Trajectory.load(out / "trajectory.tum").times_s) == 5


def test_a_wrong_distance_is_named_once(libocc, room, pictures, tmp_path):
    def survey(out, *options):
        return libocc("survey", *pictures, "--camera", "irregular_six", *options, "--out", tmp_path / out)

    assert survey("free")[0] == 0
    scene = occ.Scene.load(tmp_path / "free" / "scene.yaml")
    _, _, true = matching_up_to_scale(scene, room)
    distances = [("--distance", f"lamp {a}", f"lamp {b}", float(np.linalg.norm(true[a] - true[b])), 0.001)
                 for a, b in ((0, 1), (0, 2), (1, 3), (2, 4))]
    wrong = (*distances[0][:3], distances[0][3] + 0.05, 0.001)
    code, text, errors = survey("three", *wrong, *(value for one in distances[1:] for value in one))
    assert code == 0, errors
    warnings = json.loads((tmp_path / "three" / "result.json").read_text())["warnings"]
    assert len(warnings) == 1 and warnings[0].startswith("distance 0 (lamp 0 to lamp 1, ")
    assert f"{wrong[3]:.6g} m) is rejected" in warnings[0]
    code, text, errors = survey("two", *wrong, *distances[1])
    assert code == 1 and errors.startswith("ambiguous: distance ") and errors.strip().endswith("check both")


def test_the_camera_is_calibrated_along(libocc, room, pictures, tmp_path):
    # The given focal length is 1.5 % too large, and known to 2 %.
    true, wrong = room.camera.fx_px, 1.015 * room.camera.fx_px
    scene = room.format().replace(f"fx_px: {true}", f"fx_px: {wrong}\n  parameter_sigmas: {{f_px: {0.02 * true}}}")
    scene = scene.replace(f"fy_px: {true}", f"fy_px: {wrong}")
    assert scene.count(f"{wrong}") == 2
    (tmp_path / "wrong.yaml").write_text(scene)
    code, text, errors = libocc(
        "survey", *pictures, "--camera", tmp_path / "wrong.yaml", "--calibrate-camera", "--radius", "0.085",
        "--out", tmp_path / "out")
    assert code == 0, errors
    made = occ.Scene.load(tmp_path / "out" / "scene.yaml")
    sigma_px = made.camera.parameter_covariance[0, 0] ** 0.5
    assert sigma_px < 2
    assert abs(made.camera.fx_px - true) < 3 * sigma_px
    assert "f_px" in (tmp_path / "out" / "report.html").read_text()


def test_parts_of_a_tag_are_no_lamps():
    from libocc.cli.survey.sources import Detector, Pictures

    pattern = np.where(occ.targets.tag_pattern("tag36h11", 3).black, 20, 120).astype(np.uint8)
    pixels = np.full((480, 640), 60, np.uint8)
    pixels[100:300, 200:400] = pattern.repeat(20, axis=0).repeat(20, axis=1)
    pixels[350:380, 500:530] = 200
    camera = occ.Camera.pinhole(width=640, height=480, fx_px=400, fy_px=400, cx_px=319.5, cy_px=239.5)
    for family, lamps in ((None, 0), ("tag36h11", 1)):
        found = Pictures()
        Detector(camera, None, None, family).add(found, "a", np.dstack([pixels] * 3))
        ((_, blobs),) = found.blobs
        outside = [blob for blob in blobs if blob.centroid_px[1] > 340]
        assert len(outside) == 1 and (len(blobs) == 1) == bool(lamps)
    assert found.parts_of_tags > 0


def test_a_symmetric_room_is_not_guessed(libocc, tmp_path):
    square = samples.load_scene("square_four")
    names = []
    for i, (x, y, z, heading) in enumerate(PLACES):
        image, _ = occ.simulate(square, upward_pose([x, y, z], heading, 0, 0), seed=i)
        names.append(tmp_path / f"p{i}.png")
        occ.write_image(names[-1], image)
    code, text, errors = libocc("survey", *names, "--camera", "square_four", "--out", tmp_path / "out")
    assert code == 1
    assert "ambiguous" in errors
    assert json.loads((tmp_path / "out" / "result.json").read_text())["status"] == "ambiguous"


def test_a_recording_takes_its_scale_from_odometry(libocc, tmp_path):
    assert libocc("sequence", "irregular_six", "walk", "--out", "walk", "--fps", 4)[0] == 0
    path = samples.find_trajectory("walk")
    occ.Trajectory.load(path).save(tmp_path / "path.tum")
    code, text, errors = libocc(
        "survey", "walk", "--camera", "irregular_six", "--odometry", "path.tum", "--out", "room"
    )
    assert code == 0, errors
    assert "8 of 8 pictures" in text and "scale of the odometry" in text
    data = json.loads((tmp_path / "room" / "result.json").read_text())
    assert 0.01 <= data["scale_sigma"] < 0.02
    assert np.mean([lamp["radius_m"] for lamp in data["lamps"]]) == pytest.approx(0.085, rel=0.01)


def test_frames_with_a_wrong_time_or_content_are_named(libocc, tmp_path):
    assert libocc("sequence", "irregular_six", "walk", "--out", "walk", "--fps", 4)[0] == 0
    truth = tmp_path / "walk" / "truth" / "000005.json"
    truth.write_text(json.dumps({**json.loads(truth.read_text()), "time_s": 0.1}))
    (tmp_path / "walk" / "images" / "000003.png").write_bytes(b"no image")
    code, text, errors = libocc("survey", "walk", "--camera", "irregular_six", "--radius", 0.085, "--out", "room")
    assert code == 0, errors
    assert "6 of 6 pictures" in text
    assert "000005.png: its time 0.1 s is not after 1 s; the frame is not used" in text
    assert "000003.png: " in text and text.count("the frame is not used") == 2


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--radius", "0.1", "--tag-size", "0.1"], "give one of them"),
        (["--distance", "window", "lamp 1", "1", "0.001"], "must name lamps by their ids"),
        (["--distance", "lamp 0", "lamp 17", "1", "0.001"], "lamp of the map"),
        (["--calibrate-camera"], "states no errors of the camera; add `parameter_sigmas`"),
        (["--calibrate-camera", "--update", "irregular_six"], "not used with --update"),
    ],
)
def test_bad_input_is_named(libocc, pictures, tmp_path, options, message):
    code, text, errors = libocc("survey", *pictures, "--camera", "irregular_six", *options, "--out", tmp_path / "out")
    assert code == 2
    assert message in errors
