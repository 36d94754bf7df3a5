# SPDX-License-Identifier: Apache-2.0
"""smooth, WindowSmoother, their planar kind, nees and nis."""

import numpy as np
import pytest

import libocc as occ

CAMERA = occ.Camera.pinhole(width=640, height=480, fx_px=420, fy_px=420, cx_px=319.5, cy_px=239.5)
LAMPS_M = np.array([[0.9, 1, 3], [3.1, 1.2, 3], [1.2, 3.2, 3], [2.8, 2.7, 3], [1.5, 2.3, 2.6]])
SIGMA_PX, PERIOD_S, HEIGHT_M = 0.3, 0.1, 0.2
SIGMAS = np.array([0.004, 0.002, 0.006])  # of planar odometry: x, y, heading
COVARIANCE = np.diag([0.004] * 3 + [0.005] * 3) ** 2


def planar_truth(n):
    poses = [occ.guide.PlanarPose(x_m=1.6, y_m=1.7, heading_rad=0.4)]
    while len(poses) < n:
        poses.append(poses[-1] * occ.guide.PlanarPose(x_m=0.05, y_m=0.002, heading_rad=0.08))
    return poses


def spatial_drive(n, seed=1, lamps=slice(None)):
    """Frames, odometry and true body_from_world of a camera that is the body."""
    random = np.random.default_rng(seed)
    truth = [pose.body_from_world(HEIGHT_M) for pose in planar_truth(n)]
    frames, odometry = [], []
    for k, pose in enumerate(truth):
        points = LAMPS_M[lamps]
        in_cam = points @ pose[:3, :3].T + pose[:3, 3]
        pixels = 420 * in_cam[:, :2] / in_cam[:, 2:] + [319.5, 239.5]
        pixels += SIGMA_PX * random.normal(size=pixels.shape)
        frames.append(occ.smoothing.SmootherFrame(time_s=PERIOD_S * k, camera=CAMERA, points_in_world_m=points,
                                        points_px=pixels, sigma_px=SIGMA_PX))
        if k > 0:
            step = pose @ np.linalg.inv(truth[k - 1])
            step[:3, 3] += 0.005 * random.normal(size=3)
            odometry.append(occ.Odometry(from_s=PERIOD_S * (k - 1), to_s=PERIOD_S * k, to_from_from=step,
                                         covariance=COVARIANCE))
    return frames, odometry, np.array(truth)


def planar_odometry(n, seed=2):
    random = np.random.default_rng(seed)
    truth = planar_truth(n)
    steps = [a.inverse() * b for a, b in zip(truth, truth[1:])]
    off = SIGMAS * random.normal(size=(n - 1, 3))
    return [
        occ.smoothing.PlanarOdometry(
            from_s=PERIOD_S * k, to_s=PERIOD_S * (k + 1), covariance=np.diag(SIGMAS**2),
            increment=occ.guide.PlanarPose(x_m=s.x_m + d[0], y_m=s.y_m + d[1], heading_rad=s.heading_rad + d[2]))
        for k, (s, d) in enumerate(zip(steps, off))
    ]


def positions(body_from_world):
    return -np.einsum("nji,nj->ni", body_from_world[:, :3, :3], body_from_world[:, :3, 3])


def test_batch():
    frames, odometry, truth = spatial_drive(12)
    found = occ.smoothing.smooth(frames, odometry)
    assert found.ok and found.status is occ.Status.ok and found.message == "" and len(found) == 12
    assert found.body_from_world.shape == (12, 4, 4) and found.covariances.shape == (12, 6, 6)
    np.testing.assert_allclose(found.times_s, PERIOD_S * np.arange(12))
    assert found.determined.dtype == bool and found.determined.all()
    errors = found.positions_m - positions(truth)
    sigmas = np.sqrt(np.einsum("nii->n", found.position_covariances_m2))
    assert np.linalg.norm(errors, axis=1).max() < 4 * sigmas.max() < 0.05
    assert found.sightings == 60 and found.outside == 0 and 0.2 < found.rms_px < 0.4
    assert found.dof == 12 * 10 + 11 * 6 - 12 * 6 and 0.5 * found.dof < found.chi2 < 1.6 * found.dof
    assert [len(frame) for frame in found.residual_sigmas] == [5] * 12
    assert len(found.links) == 11 and all(link.odometry and not link.contradicted for link in found.links)
    assert "poses 12" in repr(found)
    again = occ.smoothing.smooth(frames, odometry, start=list(truth))
    np.testing.assert_allclose(again.body_from_world, found.body_from_world, atol=1e-7)


def test_is_better_than_single_frames():
    alone, together = [], []
    for seed in range(8):
        frames, odometry, truth = spatial_drive(12, seed)
        single = occ.smoothing.smooth(frames)
        assert single.ok and not any(link.odometry for link in single.links)
        alone.append(np.linalg.norm(single.positions_m - positions(truth), axis=1).mean())
        found = occ.smoothing.smooth(frames, odometry)
        together.append(np.linalg.norm(found.positions_m - positions(truth), axis=1).mean())
    assert np.mean(together) < 0.9 * np.mean(alone)


def test_lying_odometry_is_said():
    frames, odometry, truth = spatial_drive(12)
    lie = odometry[4].to_from_from.copy()
    lie[0, 3] += 0.5
    odometry[4] = odometry[4].replace(to_from_from=lie)
    found = occ.smoothing.smooth(frames, odometry)
    assert found.ok and "odometry from 0.4 s to 0.5 s is contradicted" in found.message
    assert [link.contradicted for link in found.links] == [k == 4 for k in range(11)]
    assert found.links[4].factor > 100 and "contradicted" in repr(found.links[4])
    assert np.linalg.norm(found.positions_m - positions(truth), axis=1).max() < 0.05
    followed = occ.smoothing.smooth(frames, odometry, link_gate=0)
    assert followed.chi2 > 30 * found.chi2


def test_reports_undetermined_states():
    frames, odometry, _ = spatial_drive(6, lamps=slice(0, 2))
    found = occ.smoothing.smooth(frames, odometry)
    assert found.status is occ.Status.too_few_lamps and not found.determined.any()
    assert np.isinf(np.diagonal(found.covariances, axis1=1, axis2=2)).all()
    assert np.isfinite(found.body_from_world).all()
    pose = occ.smoothing.PoseObservation.of_pose(0, planar_truth(1)[0].body_from_world(HEIGHT_M), COVARIANCE)
    assert occ.smoothing.smooth(frames, odometry, [pose]).ok


def test_on_a_floor():
    frames, _, _ = spatial_drive(12, lamps=slice(0, 2))
    odometry, truth = planar_odometry(12), planar_truth(12)
    found = occ.smoothing.smooth_planar(frames, odometry, height_m=HEIGHT_M)
    assert found.ok and found.covariances.shape == (12, 3, 3) and len(found.poses) == 12
    for pose, true in zip(found.poses, truth):
        assert np.hypot(pose.x_m - true.x_m, pose.y_m - true.y_m) < 0.02
    prior = occ.pose.PlanarPrior(time_s=0, pose=truth[0], covariance=1e-12 * np.eye(3))
    held = occ.smoothing.smooth_planar([], odometry, priors=[prior], height_m=HEIGHT_M)
    assert held.ok and len(held) == 1  # odometry alone asks for no pose
    asked = [occ.smoothing.SmootherFrame(time_s=time_s) for time_s in found.times_s]
    led = occ.smoothing.smooth_planar(asked, odometry, priors=[prior])
    assert led.ok and np.all(np.diff(np.einsum("nii->n", led.covariances)) > 0)


@pytest.mark.parametrize("planar", [False, True])
def test_window(planar):
    frames, odometry, truth = spatial_drive(15)
    if planar:
        smoother, odometry = occ.smoothing.PlanarWindowSmoother(poses=4, height_m=HEIGHT_M), planar_odometry(15)
    else:
        smoother = occ.smoothing.WindowSmoother(poses=4)
    for k, frame in enumerate(frames):
        if k > 0:
            assert smoother.add_odometry(odometry[k - 1])
        now = smoother.add_frame(frame)
        assert now.ok and now.used and now.determined and now.time_s == frame.time_s
        assert len(now.window) == min(k + 1, 4)
        position = [now.pose.x_m, now.pose.y_m] if planar else now.position_m[:2]
        assert np.linalg.norm(position - positions(truth[k : k + 1])[0, :2]) < 0.04
    late = smoother.add_frame(frames[2])
    assert not late.used and "before the window's oldest pose" in late.message
    assert not smoother.add_odometry(odometry[3])
    smoother.restart()
    assert smoother.add_frame(frames[2]).used


def test_window_sees_all_frames_as_the_batch_does():
    frames, odometry, _ = spatial_drive(8)
    smoother = occ.smoothing.WindowSmoother(poses=8)
    for k, frame in enumerate(frames):
        if k > 0:
            smoother.add_odometry(odometry[k - 1])
        now = smoother.add_frame(frame)
    batch = occ.smoothing.smooth(frames, odometry)
    np.testing.assert_allclose(now.window.body_from_world, batch.body_from_world, atol=1e-8)
    np.testing.assert_allclose(now.covariance, batch.covariances[-1], rtol=1e-5, atol=1e-12)


@pytest.mark.parametrize("sigma_m", [0.01, np.full((5, 3), 0.01)])
def test_errors_of_points_do_not_average_away(sigma_m):
    pose = planar_truth(1)[0].body_from_world(HEIGHT_M)
    in_cam = LAMPS_M @ pose[:3, :3].T + pose[:3, 3]

    def position_sigma_m(images, **stated):
        frame = occ.smoothing.SmootherFrame(time_s=0, camera=CAMERA, points_in_world_m=LAMPS_M,
                                  points_px=420 * in_cam[:, :2] / in_cam[:, 2:] + [319.5, 239.5], **stated)
        return np.sqrt(np.trace(occ.smoothing.smooth([frame] * images).position_covariances_m2[0]))

    assert position_sigma_m(100) == pytest.approx(position_sigma_m(1) / 10, rel=1e-3)
    assert position_sigma_m(1, points_sigma_m=sigma_m) > 3 * position_sigma_m(1)
    assert position_sigma_m(100, points_sigma_m=sigma_m) == pytest.approx(
        position_sigma_m(1, points_sigma_m=sigma_m), rel=0.05)


def test_mount_and_clock_are_stated_in_the_options():
    frames, odometry, _ = spatial_drive(20)
    sigma = {}
    for name, options in {"exact": {}, "mount": {"mount_sigma_m": 0.02}, "clock": {"clock_sigma_s": 0.05}}.items():
        found = occ.smoothing.smooth(frames, odometry, **options)
        assert found.ok, found.message
        sigma[name] = np.sqrt(np.trace(found.position_covariances_m2[10]))
    assert sigma["mount"] == pytest.approx(0.02 * np.sqrt(3), rel=0.05)
    assert sigma["clock"] == pytest.approx(0.05 * 0.5, rel=0.4)  # at half a metre per second


def test_bad_input():
    frames, odometry, _ = spatial_drive(3)
    with pytest.raises(ValueError, match=r"frames\[1\].time_s must be no earlier"):
        occ.smoothing.smooth(frames[::-1], odometry)
    with pytest.raises(ValueError, match="points_px must be as many as points_in_world_m, 5, got 4"):
        occ.smoothing.SmootherFrame(time_s=0, camera=CAMERA, points_in_world_m=LAMPS_M, points_px=np.zeros((4, 2)))
    with pytest.raises(ValueError, match=r"sightings\[0\].px must be finite"):
        occ.smoothing.SmootherFrame(time_s=0, points_in_world_m=LAMPS_M, points_px=np.full((5, 2), np.nan))
    with pytest.raises(ValueError, match="sigma_px must be positive"):
        occ.smoothing.SmootherFrame(time_s=0, sigma_px=0)
    with pytest.raises(ValueError, match="points_sigma_m must be at least 0, got -1"):
        occ.smoothing.SmootherFrame(time_s=0, points_in_world_m=LAMPS_M, points_px=np.zeros((5, 2)), points_sigma_m=-1)
    with pytest.raises(ValueError, match="points_sigma_m must be one number or as many rows as points_in_world_m, 5"):
        occ.smoothing.SmootherFrame(time_s=0, points_in_world_m=LAMPS_M, points_px=np.zeros((5, 2)),
                          points_sigma_m=np.ones((2, 3)))
    with pytest.raises(ValueError, match="clock_sigma_s must be at least 0"):
        occ.smoothing.smooth(frames, odometry, clock_sigma_s=-1)
    with pytest.raises(ValueError, match=r"covariances_px2 must be of shape \(5, 2, 2\)"):
        occ.smoothing.SmootherFrame(time_s=0, points_in_world_m=LAMPS_M, points_px=np.zeros((5, 2)),
                          covariances_px2=np.zeros((5, 2)))
    with pytest.raises(ValueError, match="frames must be at least one"):
        occ.smoothing.smooth([])
    with pytest.raises(ValueError, match="huber_sigmas"):
        occ.smoothing.smooth(frames, odometry, huber_sigmas=-1)
    with pytest.raises(ValueError, match="start must be as long as there are poses, 3, got 1"):
        occ.smoothing.smooth(frames, odometry, start=[np.eye(4)])
    with pytest.raises(ValueError, match="poses must be at least 2"):
        occ.smoothing.WindowSmoother(poses=1)


def test_consistency():
    random = np.random.default_rng(1)
    errors = random.normal(size=(40, 30, 3))
    squared = (errors**2).sum(axis=2)
    report = occ.smoothing.nees(squared, 3, confidence=0.99)
    assert report.verdict is occ.smoothing.Consistency.consistent and report.low < report.mean < report.high
    assert report.mean_at.shape == (30,) and report.share_inside > 0.9 and report.count == 1200
    assert occ.smoothing.nees(1.5 * squared, 3).verdict is occ.smoothing.Consistency.optimistic
    assert occ.smoothing.nis(squared / 2, np.full(squared.shape, 3)).verdict is occ.smoothing.Consistency.pessimistic
    assert "optimistic" in repr(occ.smoothing.nees(1.5 * squared, 3))
    assert abs(occ.smoothing.chi2_quantile(0.95, 2) + 2 * np.log(0.05)) < 1e-9
    covariance = np.array([[2, 0.5], [0.5, 1]])
    error = np.array([1.0, -1])
    expected = error @ np.linalg.solve(covariance, error)
    assert abs(occ.smoothing.normalised_squared_error(error, covariance) - expected) < 1e-12
    with pytest.raises(ValueError, match="positive definite"):
        occ.smoothing.normalised_squared_error(error, -covariance)
    with pytest.raises(ValueError, match="dof must be of squared's shape"):
        occ.smoothing.nees(squared, np.ones((2, 2), dtype=int))
