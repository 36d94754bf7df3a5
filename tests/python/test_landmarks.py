# SPDX-License-Identifier: Apache-2.0
"""Poses among wrong matches, AprilTags and headlights: robust_pose, detect_april_tags, headlight_distance."""

import json

import numpy as np
import pytest

import libocc as occ

CAMERA = occ.Camera.pinhole(width=640, height=480, fx_px=800, fy_px=800, cx_px=319.5, cy_px=239.5)
POSE = occ.look_at([0.4, -0.3, -5], [0, 0, 0], [0, -1, 0])


def matched(wrong, n=100):
    random = np.random.default_rng(4)
    points = random.uniform(-1, 1, (n, 3))
    in_cam = points @ POSE[:3, :3].T + POSE[:3, 3]
    pixels = 800 * in_cam[:, :2] / in_cam[:, 2:] + [319.5, 239.5] + 0.5 * random.normal(size=(n, 2))
    pixels[:wrong] = random.uniform([0, 0], [640, 480], (wrong, 2))
    return points, pixels


def test_robust_pose_among_wrong_matches():
    points, pixels = matched(60)
    found = occ.robust_pose(points, pixels, CAMERA, sigma_px=0.5, seed=3)
    assert found.ok and found.inliers.dtype == bool and found.inliers[60:].mean() > 0.97
    assert np.linalg.norm(found.position_m - [0.4, -0.3, -5]) < 0.05
    assert found.log10_false_alarms < -50 and "ok" in repr(found)
    again = occ.robust_pose(points, pixels, CAMERA, sigma_px=0.5, seed=3)
    np.testing.assert_array_equal(again.cam_from_world, found.cam_from_world)
    upright = occ.robust_pose(points, pixels, CAMERA, sigma_px=0.5, up_in_cam=POSE[:3, 2])
    assert upright.ok and upright.iterations < found.iterations


def test_robust_pose_rejects_bad_input():
    points, pixels = matched(100)
    assert occ.robust_pose(points, pixels, CAMERA, max_iterations=500).status is occ.Status.no_pose
    with pytest.raises(ValueError, match="confidence"):
        occ.robust_pose(points, pixels, CAMERA, confidence=2)


def test_a_scene_keeps_its_tags():
    tag = occ.Tag(id=5, size_m=0.2, centre_m=[1, 2, 3])
    scene = occ.Scene(camera=CAMERA, lamps=[], tags=[tag])
    assert occ.Scene.parse(scene.format()) == scene and scene.tags[0].id == 5
    assert not scene.replace(tags=[]).tags
    with pytest.raises(ValueError, match="size_m"):
        occ.Scene(camera=CAMERA, lamps=[], tags=[occ.Tag(id=5, size_m=-1, centre_m=[1, 2, 3])])


def test_an_empty_image_has_no_tags(libocc, tmp_path):
    grey = np.full((80, 120), 128, np.uint8)
    assert occ.targets.detect_april_tags(grey) == []
    assert "tag36h11" in occ.targets.april_tag_families()
    with pytest.raises(ValueError, match="tag36h11"):
        occ.targets.detect_april_tags(grey, family="none")
    occ.write_image("grey.png", grey)
    occ.Scene(camera=CAMERA, lamps=[], tags=[occ.Tag(id=5, size_m=0.2, centre_m=[1, 2, 3])]).save("room.yaml")
    code, out, _ = libocc("tags", "grey.png", "--map", "room.yaml", "--json", "--overlay", "found.png")
    assert code == 1 and json.loads(out)["fix"]["status"] == "too_few_lamps"
    assert (tmp_path / "found.png").stat().st_size > 1000
    assert libocc("tags", "missing.png")[0] == 2


def test_headlights_give_an_interval():
    seen_px = [[600.0, 250.0], [642.0, 250.0]]
    found = occ.objects.headlight_distance(seen_px, CAMERA, separation_m=1.4)
    assert found.ok and found.low_m < found.distance_m < found.high_m
    assert found.yaw_rad.shape == found.distance_of_yaw_m.shape == found.yaw_density.shape
    assert abs(found.distance_of_yaw_m.max() - 1.4 / found.separation_rad) < 0.1
    heights = occ.objects.RoadHeights(lamps_m=0.65, lamps_sigma_m=0.02, camera_m=1.0, up_sigma_rad=0.001)
    assert heights.lamps_sigma_m == 0.02
    same = occ.objects.headlight_distance([seen_px[0]] * 2, CAMERA)
    assert same.status is occ.Status.degenerate
    with pytest.raises(ValueError, match="yaw_max_rad"):
        occ.objects.headlight_distance(seen_px, CAMERA, yaw_max_rad=2)


def test_a_third_lamp_gives_the_yaw():
    lamps_m = np.array([[0, 0.7, 0], [0, -0.7, 0], [-1.2, 0.3, 0.7], [-1.5, -0.4, 0.8]])
    in_cam = lamps_m @ np.array([[0, 1, 0], [0, 0, -1], [-1, 0, 0]]).T + [0, 0.5, 8]
    pixels = 800 * in_cam[:, :2] / in_cam[:, 2:] + [319.5, 239.5]
    poses = occ.objects.vehicle_poses(lamps_m, pixels, CAMERA, 0.3)
    assert poses.ok and abs(poses.value[0].distance_m - np.hypot(8, 0.5)) < 1e-6
    assert abs(poses.value[0].yaw_rad) < 1e-6 and poses.value[0].sigma_m > 0
