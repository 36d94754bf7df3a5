# SPDX-License-Identifier: Apache-2.0
"""All steps from Python: simulate, detect, identify, refine, locate."""

import json
import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import libocc as occ
from libocc.samples import load_scene
from libocc.smoothing import PoseFilterOptions


@pytest.fixture(scope="module")
def fix(image, scene):
    return occ.locate(image, scene)


@pytest.fixture(scope="module")
def square(root):
    return occ.Scene.load(root / "data" / "scenes" / "square_four.yaml")


def test_fix_finds_the_camera_within_its_own_sigma(fix, rendered):
    truth = rendered[1]
    assert fix.ok and fix.status is occ.Status.ok
    error_m = fix.position_m - truth.position_m
    assert np.linalg.norm(error_m) < 1e-3
    mahalanobis = error_m @ np.linalg.solve(fix.position_covariance_m2, error_m)
    assert mahalanobis < 21.1  # chi-square of 3 degrees of freedom: 1 in 10000


def test_fix_has_its_documented_fields(fix, scene):
    assert fix.cam_from_world.shape == (4, 4) and fix.covariance.shape == (6, 6)
    assert fix.position_m.shape == (3,) and fix.position_covariance_m2.shape == (3, 3)
    assert isinstance(fix.message, str) and fix.rms_px < 0.2
    assert 0 < fix.timing_s.detect_s <= fix.timing_s.total_s
    camera_in_world = np.linalg.inv(fix.cam_from_world)[:3, 3]
    assert fix.position_m == pytest.approx(camera_in_world, abs=1e-12)
    assert np.allclose(
        fix.position_covariance_m2, occ.smoothing.position_covariance(fix.cam_from_world, fix.covariance)
    )
    assert len(fix.candidates) == 1
    assert np.array_equal(fix.candidates[0].position_m, fix.position_m)


def test_lamps_are_named_right(fix, rendered):
    truth = {lamp.id: lamp for lamp in rendered[1].lamps}
    whole = {id for id, lamp in truth.items() if lamp.whole}
    assert whole <= set(fix.lamps)
    for id in whole:
        assert np.linalg.norm(fix.lamps[id].centroid_px - truth[id].image_centre_px) < 0.1


def test_an_image_of_another_size_is_rejected(image, scene):
    with pytest.raises(ValueError, match="600.*640|640.*600"):
        occ.locate(np.ascontiguousarray(image[:, :600]), scene)


def test_blobs_can_be_located_instead(fix, image, scene):
    again = occ.locate(occ.detect(image, sensor=scene.sensor), scene)
    assert again.position_m == pytest.approx(fix.position_m, abs=1e-9)
    with pytest.raises(TypeError, match="got list"):
        occ.locate([1, 2, 3], scene)


def test_the_steps_equal_locate(fix, image, scene):
    blobs = occ.detect(image, sensor=scene.sensor)
    named = occ.identify(blobs, scene)
    assert named.ok and named.tried > 0
    best = named.hypotheses[0]
    refined = occ.refine(best.cam_from_world, best.matches, blobs, scene)
    assert refined.ok
    assert refined.cam_from_world == pytest.approx(fix.cam_from_world, abs=1e-9)
    assert {scene.lamps[m.lamp].id for m in best.matches} == set(fix.lamps)
    with pytest.raises(ValueError, match="99"):
        occ.refine(best.cam_from_world, [occ.Match(lamp=99, blob=0)] * 4, blobs, scene)


def test_too_few_lamps_is_a_status(image, scene):
    two = scene.replace(lamps=scene.lamps[:2])
    for few, options in ((scene.replace(lamps=scene.lamps[:1]), {}), (two, dict(rims=False))):
        fix = occ.locate(image, few, **options)
        assert fix.status is occ.Status.too_few_lamps and fix.message


def test_two_discs_are_ambiguous(image, scene, pose):
    fix = occ.locate(image, scene.replace(lamps=scene.lamps[:2]))
    assert fix.status is occ.Status.ambiguous
    position_m = np.linalg.inv(pose)[:3, 3]
    assert min(np.linalg.norm(c.position_m - position_m) for c in fix.candidates) < 5e-3


def test_a_square_is_ambiguous_until_the_heading_is_known(square, pose):
    image, truth = occ.simulate(square, cam_from_world=pose, seed=3)
    fix = occ.locate(image, square)
    assert fix.status is occ.Status.ambiguous and not fix.ok
    assert len(fix.candidates) == 4
    nearest = min(np.linalg.norm(c.position_m - truth.position_m) for c in fix.candidates)
    assert nearest < 2e-3

    prior = occ.Prior(
        heading_rad=occ.guide.heading_rad(pose) + 0.1, heading_sigma_rad=math.radians(20)
    )
    with_prior = occ.locate(image, square, prior)
    assert with_prior.ok
    assert np.linalg.norm(with_prior.position_m - truth.position_m) < 2e-3


def test_options_reach_the_library(image, scene):
    coarse = occ.locate(image, scene, rung=occ.Rung.centres, model_sigma_px=1.0)
    fine = occ.locate(image, scene)
    assert np.trace(coarse.covariance) > 10 * np.trace(fine.covariance)
    blind = occ.locate(image, scene, threshold_dn=254)
    assert not blind.ok
    with pytest.raises(ValueError, match="huber_sigma.*-1"):
        occ.locate(image, scene, huber_sigma=-1)
    with pytest.raises(ValueError, match="threshold_sigma"):
        occ.detect(image, threshold_sigma=math.nan)
    with pytest.raises(TypeError, match="no_such_option"):
        occ.locate(image, scene, no_such_option=1)


def test_simulate_is_reproducible_and_returns_the_truth(scene, pose, rendered):
    image, truth = rendered
    again, _ = occ.simulate(scene, cam_from_world=pose, seed=1)
    other, _ = occ.simulate(scene, cam_from_world=pose, seed=2)
    assert np.array_equal(image, again) and not np.array_equal(image, other)
    assert np.array_equal(truth.cam_from_world, pose)
    assert truth.position_m == pytest.approx([1.7, 2.1, 0.5], abs=1e-12)
    deep = scene.replace(sensor=scene.sensor.replace(bit_depth=12, gain_dn_per_e=0.4))
    assert occ.simulate(deep, cam_from_world=pose, seed=1)[0].dtype == np.uint16


@pytest.mark.parametrize(
    "bad, error, text",
    [
        (np.eye(3), TypeError, "4x4"),
        (2 * np.eye(4), ValueError, "cam_from_world"),
        (np.full((4, 4), math.nan), ValueError, "cam_from_world"),
        ("up", TypeError, "4x4"),
    ],
)
def test_bad_poses_are_rejected(scene, bad, error, text):
    with pytest.raises(error, match=text):
        occ.simulate(scene, cam_from_world=bad)


def test_p3p_holds_the_true_pose(pose):
    points = np.array([[0.9, 1.0, 3], [3.1, 1.2, 3], [1.2, 3.2, 2.6]])
    in_cam = points @ pose[:3, :3].T + pose[:3, 3]
    bearings = in_cam / np.linalg.norm(in_cam, axis=1, keepdims=True)
    found = occ.p3p(bearings, points)
    assert found.shape[1:] == (4, 4) and 1 <= len(found) <= 4
    assert min(np.abs(candidate - pose).max() for candidate in found) < 1e-9
    assert occ.p3p(bearings, np.outer([0, 1, 2], [1.0, 0, 0])).shape == (0, 4, 4)
    with pytest.raises(ValueError, match="unit"):
        occ.p3p(2 * bearings, points)


def test_heading_is_the_azimuth_of_image_right():
    up = np.eye(4)
    assert occ.guide.heading_rad(up) == pytest.approx(0)
    turned = np.array([[0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    assert occ.guide.heading_rad(turned) == pytest.approx(math.pi / 2)


def test_predicted_rims_agree_with_measured_rims(fix, scene):
    lamps = {lamp.id: lamp for lamp in scene.lamps}
    for id, blob in fix.lamps.items():
        if blob.cut_by_border:
            continue
        rim = occ.rendering.project_rim(lamps[id], fix.cam_from_world, scene.camera)
        assert rim.shape == (64, 2)
        centre = occ.rendering.project_lamp_centre(lamps[id], fix.cam_from_world, scene.camera)
        assert np.linalg.norm(centre - blob.centroid_px) < 0.2
        radius = np.linalg.norm(rim - centre, axis=1)
        assert radius.min() > 0.9 * blob.ellipse.semi_minor_px
        assert radius.max() < 1.1 * blob.ellipse.semi_major_px
    from_behind = lamps[0].replace(normal=[0, 0, 1])
    assert occ.rendering.project_rim(from_behind, fix.cam_from_world, scene.camera) is None


def test_threads_agree(image, scene, fix):
    with ThreadPoolExecutor(4) as pool:
        fixes = list(pool.map(lambda _: occ.locate(image, scene), range(8)))
    assert all(np.array_equal(other.cam_from_world, fix.cam_from_world) for other in fixes)


def test_a_lamp_index_serves_hashing(image, scene, pose):
    index = occ.LampIndex(scene)
    assert index.applies and index.triangles == 10  # of five lamps: one hangs lower
    blobs = occ.detect(image, sensor=scene.sensor)
    prior = occ.Prior(gravity_in_cam=-pose[:3, 2])
    found = occ.identify(blobs, scene, prior, method=occ.IdentifyMethod.hashing, index=index)
    assert found.ok and len(found.hypotheses[0].matches) == 6
    with pytest.raises(ValueError, match="index must be of the scene's lamps"):
        occ.identify(blobs, scene.replace(lamps=scene.lamps[:5]), prior, index=index)


def test_a_wrong_focal_length_is_named(libocc, tmp_path):
    scene = load_scene("irregular_six")
    wrong = occ.Camera.pinhole(width=640, height=480, fx_px=430, fy_px=430, cx_px=319.5, cy_px=239.5)
    scene.replace(camera=wrong).save(tmp_path / "wrong.yaml")
    image, truth = occ.simulate(scene, occ.look_at([1.9, 2.1, 0.3], [1.95, 2.15, 3], up=[0, 1, 0]), seed=1)
    occ.write_image(tmp_path / "a.png", image)
    code, text, _ = libocc("locate", tmp_path / "a.png", tmp_path / "wrong.yaml")
    assert code == 0 and "as if the focal length were 1.7 % shorter" in text
    assert "the sigma allows for the errors above" in text
    candidate = json.loads(libocc("locate", tmp_path / "a.png", tmp_path / "wrong.yaml", "--json")[1])["candidates"][0]
    assert candidate["estimated_camera"]["fx_px"] == pytest.approx(scene.camera.matrix[0, 0], abs=0.2)
    assert candidate["position_m"] == pytest.approx(truth.position_m, abs=2e-3)


def test_a_fix_names_what_it_takes_as_exact():
    scene = load_scene("irregular_six")
    pose = occ.look_at(position_m=[1.9, 2.1, 0.3], target_m=[2, 2, 3], up=[0, 1, 0])
    image, _ = occ.simulate(scene, cam_from_world=pose, seed=1)
    assert occ.locate(image, scene).taken_as_exact == ["camera", "map"]
    assert occ.locate(image, scene.replace(map_sigma_m=0.001)).taken_as_exact == ["camera"]
    stated = scene.replace(camera=scene.camera.with_parameter_sigmas({"fx_px": 1}))
    assert occ.locate(image, stated).taken_as_exact == ["map"]
    assert occ.locate(image, scene, model_sigma_px=0.5).taken_as_exact == []


def test_an_error_of_the_whole_map_does_not_average_away():
    scene, height_sigma_m = load_scene("irregular_six"), 0.01
    pose = occ.look_at(position_m=[1.9, 2.1, 0.3], target_m=[1.95, 2.15, 3], up=[0, 1, 0])
    lamps = [lamp.replace(shared_errors_m=[[0, 0, height_sigma_m]]) for lamp in scene.lamps]
    shared = scene.replace(lamps=lamps)
    image, _ = occ.simulate(scene, cam_from_world=pose, seed=1)
    fix, exact = occ.locate(image, shared), occ.locate(image, scene)
    assert fix.ok and fix.taken_as_exact == ["camera"]
    assert fix.position_m == pytest.approx(exact.position_m, abs=1e-4)
    sigmas_m = fix.position_covariance_m2.diagonal() ** 0.5
    assert sigmas_m[2] == pytest.approx(height_sigma_m, rel=0.01) and sigmas_m[:2].max() < 0.001

    # The filter averages forty images; one of them fits badly by chance.
    noise = PoseFilterOptions(acceleration_noise=0.01, turn_acceleration_noise=0.01)
    tracker = occ.Tracker(shared, filter=noise)
    for number in range(40):
        tracker.add_image(occ.simulate(scene, cam_from_world=pose, seed=number)[0], 0.05 * number)
    covariance_m2 = tracker.predict(1.95).covariance[3:, 3:]
    upwards = pose[:3, 2]  # the world's z axis in the frame of the camera
    assert (upwards @ covariance_m2 @ upwards) ** 0.5 == pytest.approx(height_sigma_m, rel=0.01)


def test_one_disc_has_a_circle_of_poses() -> None:
    lamp = occ.Lamp(id=3, centre_m=(1.0, 2.0, 3.0), radius_m=0.25, power_w=6)
    camera = occ.Camera.pinhole(width=640, height=480, fx_px=420, fy_px=420, cx_px=319.5, cy_px=239.5)
    scene = occ.Scene(camera=camera, lamps=[lamp])
    place = np.array([1.6, 2.3, 0.4])
    pose = occ.look_at(place, lamp.centre_m, up=[0, 1, 0])
    image, _ = occ.simulate(scene, pose, seed=1)
    fix = occ.locate(image, scene)
    assert fix.status == occ.Status.too_few_lamps and not fix.candidates
    assert "0.669 m from its axis" in fix.message and "if it is lamp 3" in fix.message
    circle = fix.circles[0]
    off_m = np.linalg.norm(place[:2] - lamp.centre_m[:2])
    assert abs(circle.radius_m - off_m) < 4 * circle.radius_sigma_m
    assert abs(circle.height_m - 2.6) < 4 * circle.height_sigma_m
    places = [-pose[:3, :3].T @ pose[:3, 3] for pose in map(np.asarray, map(circle.at, np.linspace(0, 6.2, 100)))]
    assert min(np.linalg.norm(at - place) for at in places) < 0.05
    assert np.linalg.matrix_rank(circle.information, tol=1e-6 * np.abs(circle.information).max()) == 5
    heading = occ.Prior(heading_rad=occ.guide.heading_rad(pose), heading_sigma_rad=0.05)
    selected = occ.locate(image, scene, heading)
    assert selected.candidates and not selected.circles
