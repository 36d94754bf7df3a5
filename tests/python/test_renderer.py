# SPDX-License-Identifier: Apache-2.0
"""Renderer, Trajectory and Truth in Python."""

import copy
import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from small_room import small_scene

import libocc as occ


@pytest.fixture(scope="module")
def walk() -> occ.Trajectory:
    poses = [occ.look_at([x, 0.1 * x, 0.5], [2, 2, 3]) for x in (1.0, 1.5, 1.2)]
    return occ.Trajectory(times_s=[0, 0.5, 2], cam_from_world=poses)


def test_a_renderer_gives_the_bits_of_simulate(scene, pose):
    renderer = occ.Renderer(scene)
    kept = []
    for options in ({}, {"seed": 3, "frame": 7}, {"noise": False}, {"velocity": [0, 0.1, 0, 0.2, 0, 0]}):
        image, truth = renderer.render(pose, **options)
        expected, expected_truth = occ.simulate(scene, pose, **options)
        assert np.array_equal(image, expected)
        assert truth.lamps[0].electrons == expected_truth.lamps[0].electrons
        kept.append((image, expected))
    assert all(np.array_equal(image, expected) for image, expected in kept), "an image of its own each time"
    assert renderer.scene == scene


def test_threads_may_share_a_renderer(scene, pose):
    renderer = occ.Renderer(scene)
    with ThreadPoolExecutor(3) as pool:
        images = list(pool.map(lambda i: renderer.render(pose, frame=i)[0], range(8)))
    assert all(np.array_equal(image, occ.simulate(scene, pose, frame=i)[0]) for i, image in enumerate(images))


def test_noise_around_lamps_is_that_of_everywhere(scene, pose):
    everywhere, _ = occ.simulate(scene, pose, seed=2)
    around, _ = occ.simulate(scene, pose, seed=2, noise_area=occ.rendering.NoiseArea.around_lamps)
    quiet, _ = occ.simulate(scene, pose, noise=False)
    same = around == everywhere
    assert same[quiet > quiet.min() + 2].all() and not same.all()
    assert (around[~same] == quiet.min()).all()


def test_truth_has_hidden_lamps_and_rendered_effects():
    scene = small_scene()
    _, truth = occ.simulate(scene, np.eye(4))
    assert [lamp.hidden > 0 for lamp in truth.lamps] == [True, False, False, False]
    assert 0.2 < truth.lamps[0].hidden < 0.8
    plans = {plan.effect: plan for plan in truth.effects}
    assert plans["occlusion"].applied and plans["psf"].applied and not plans["walls"].applied
    assert plans["psf"].bound_dn > 0
    moving = occ.simulate(scene, np.eye(4), velocity=[0, 0, 0, 1, 0, 0])[1]
    assert {p.effect: p.applied for p in moving.effects}["rolling_shutter"]
    assert not plans["rolling_shutter"].applied


def test_a_trajectory_is_a_value(walk, tmp_path):
    for again in (pickle.loads(pickle.dumps(walk)), copy.deepcopy(walk), occ.Trajectory.parse(walk.format())):
        assert again.times_s == walk.times_s and len(again) == 3
        assert np.allclose(again.poses, walk.poses, atol=4e-15)
    walk.save(tmp_path / "walk.txt")
    rows = np.loadtxt(tmp_path / "walk.txt")
    assert rows[:, 0].tolist() == [0, 0.5, 2] and rows[1, 1:4] == pytest.approx([1.5, 0.15, 0.5])
    assert occ.Trajectory.load(tmp_path / "walk.txt").times_s == walk.times_s


def test_a_trajectory_moves_with_its_velocity(walk):
    pose = walk.cam_from_world(0.1)
    assert np.allclose(occ.smoothing.moved_pose(pose, walk.velocity(0.1), 0.25), walk.cam_from_world(0.35), atol=1e-13)
    mean = walk.velocity(0.1, 1.7)
    assert np.allclose(occ.smoothing.moved_pose(pose, mean, 1.6), walk.cam_from_world(1.7), atol=1e-13)
    with pytest.raises(ValueError, match="time_s must be from 0.0.* to 2.0.* s, got 2.1"):
        walk.cam_from_world(2.1)


@pytest.mark.parametrize(
    "times, poses, text",
    [
        ([], [], "waypoints must be at least one"),
        ([1, 1], [np.eye(4)] * 2, r"waypoints\[1\].time_s must be later than the previous one, got 1"),
        ([0, np.nan], [np.eye(4)] * 2, r"waypoints\[1\].time_s must be finite, got nan"),
        ([0, 1], [np.eye(4), np.full((4, 4), np.nan)], "finite"),
        ([0, 1], [np.eye(4)], "as many as times_s: 2, got 1"),
    ],
)
def test_invalid_trajectories_are_rejected(times, poses, text):
    with pytest.raises(ValueError, match=text):
        occ.Trajectory(times, poses)


def test_files_that_hold_no_trajectory(tmp_path):
    with pytest.raises(FileNotFoundError, match="absent.txt"):
        occ.Trajectory.load(tmp_path / "absent.txt")
    bad = tmp_path / "bad.txt"
    bad.write_text("0 0 0 0 0 0 0 1\n1 0 0 nan 0 0 0 1\n")
    with pytest.raises(ValueError, match="bad.txt:2: must be finite numbers, got nan"):
        occ.Trajectory.load(bad)


def test_images_are_encoded_as_they_are_written(image, tmp_path):
    occ.write_image(tmp_path / "a.png", image)
    assert occ.encode_image(image) == (tmp_path / "a.png").read_bytes()
    assert occ.encode_image(image, ".pgm").startswith(b"P5")
    with pytest.raises(ValueError, match="16-bit pixels need"):
        occ.encode_image(image.astype(np.uint16), ".jpg")
