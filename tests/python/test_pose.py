# SPDX-License-Identifier: Apache-2.0
"""Poses from known correspondences: solve_pose, pose_candidates, p3p, solvers."""

import math

import numpy as np
import pytest

import libocc as occ
from libocc import pose
from libocc.cli import report

CAMERA = occ.Camera.pinhole(width=1280, height=960, fx_px=800, fy_px=800, cx_px=639.5, cy_px=479.5)
CAM_FROM_WORLD = occ.look_at([0.4, -0.3, -5], [0, 0, 0], [0, -1, 0])
POINTS_M = np.random.default_rng(3).uniform(-1, 1, (20, 3))


def in_cam(points_m):
    return points_m @ CAM_FROM_WORLD[:3, :3].T + CAM_FROM_WORLD[:3, 3]


def bearings_of(points_m):
    points = in_cam(points_m)
    return points / np.linalg.norm(points, axis=1)[:, None]


def pixels_of(points_m):
    points = in_cam(points_m)
    return 800 * points[:, :2] / points[:, 2:] + [639.5, 479.5]


@pytest.mark.parametrize("n", [4, 6, 20])
def test_solve_pose_of_exact_points(n):
    fix = occ.solve_pose(POINTS_M[:n], pixels_of(POINTS_M[:n]), CAMERA, sigma_px=0.1)
    assert fix.ok and len(fix.candidates) == 1
    np.testing.assert_allclose(fix.cam_from_world, CAM_FROM_WORLD, atol=1e-8)
    np.testing.assert_allclose(fix.position_m, [0.4, -0.3, -5], atol=1e-8)
    assert np.linalg.eigvalsh(fix.covariance).min() > 0
    assert fix.candidates[0].dof == 2 * n - 6


def test_three_points_give_every_pose():
    fix = occ.solve_pose(POINTS_M[:3], pixels_of(POINTS_M[:3]), CAMERA)
    assert fix.status in (occ.Status.ok, occ.Status.ambiguous)
    nearest = min(np.abs(c.cam_from_world - CAM_FROM_WORLD).max() for c in fix.candidates)
    assert nearest < 1e-7
    poses = occ.p3p(bearings_of(POINTS_M[:3]), POINTS_M[:3])
    assert poses.shape[1:] == (4, 4) and len(poses) == len(fix.candidates)


def test_small_square_far_away_is_ambiguous():
    square_m = np.array([[-0.05, -0.05, 0], [0.05, -0.05, 0], [0.05, 0.05, 0], [-0.05, 0.05, 0]])
    turned = square_m @ occ.look_at([1.0, 0.6, -1], [0, 0, 0], [0, -1, 0])[:3, :3].T
    fix = occ.solve_pose(turned, pixels_of(turned), CAMERA, sigma_px=0.5)
    assert fix.status is occ.Status.ambiguous and len(fix.candidates) == 2
    assert not fix.ok and "2 poses" in fix.message


def skip_if_missing(solver):
    if solver in pose.missing_solvers():
        pytest.skip(f"this build lacks {solver} ({pose.missing_solvers()[solver]}=OFF)")


def test_a_missing_solver_names_its_cmake_option():
    for name, option in pose.missing_solvers().items():
        with pytest.raises(ValueError, match=f"{name}.*-D{option}=ON"):
            occ.solve_pose(POINTS_M, pixels_of(POINTS_M), CAMERA, solver=name)


def test_every_solver_reports_its_requirements():
    solvers = occ.solvers()
    names = [s.name for s in solvers]
    assert len(set(names)) == len(names) == 17 - len(pose.missing_solvers())
    assert {"p3p", "p3p_triples", "triangle", "posit", "posit_coplanar", "dlt"} <= set(names)
    for s in solvers:
        assert 2 <= s.min_points and (s.max_points == 0 or s.max_points >= s.min_points)
        assert s.failures and s.source and s.max_candidates > 0
        assert repr(s) == f"<Solver: {s.name}>"


@pytest.mark.parametrize("solver", ["p3p_triples", "sqpnp", "epnp", "posit", "dlt", "iterative"])
def test_named_solvers_lead_to_the_same_pose(solver):
    skip_if_missing(solver)
    fix = occ.solve_pose(POINTS_M, pixels_of(POINTS_M), CAMERA, solver=solver, sigma_px=0.1)
    assert fix.ok
    np.testing.assert_allclose(fix.cam_from_world, CAM_FROM_WORLD, atol=1e-8)


def test_candidates_of_a_rig_and_of_known_gravity():
    skip_if_missing("gpnp")
    origins = 0.2 * np.random.default_rng(5).standard_normal((6, 3))
    rays = in_cam(POINTS_M[:6]) - origins
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    rig = occ.pose_candidates(rays, POINTS_M[:6], "gpnp", origins_in_cam_m=origins)
    assert rig.ok and np.abs(rig.value[0].cam_from_world - CAM_FROM_WORLD).max() < 1e-9
    up = CAM_FROM_WORLD[:3, 2]
    two = occ.pose_candidates(bearings_of(POINTS_M[:2]), POINTS_M[:2], up_in_cam=up)
    assert min(np.abs(c.cam_from_world - CAM_FROM_WORLD).max() for c in two.value) < 1e-9


def test_under_a_lamp_the_double_root_is_said_to_be_badly_conditioned():
    lamps_m = np.array([[1.0, 1, 3], [3, 1, 3], [1, 3, 3]])
    rays = lamps_m - [1, 1, 0.5]
    found = occ.pose_candidates(rays / np.linalg.norm(rays, axis=1)[:, None], lamps_m)
    upright = [c for c in found.value if np.abs(c.cam_from_world[:3, :3] - np.eye(3)).max() < 1e-6]
    assert len(upright) == 1 and upright[0].condition > 1e6


def test_data_that_give_no_pose_are_a_status():
    pixels = pixels_of(POINTS_M)
    line = np.outer(np.arange(5.0), [1, 2, 3])
    assert occ.solve_pose(POINTS_M[:2], pixels[:2], CAMERA).status is occ.Status.too_few_lamps
    assert occ.solve_pose(line, pixels[:5], CAMERA).status is occ.Status.degenerate
    assert occ.solve_pose(0 * POINTS_M, pixels, CAMERA).status is occ.Status.degenerate
    shuffled = occ.solve_pose(POINTS_M, pixels[::-1], CAMERA)
    assert shuffled.status is occ.Status.no_pose and "sigma_px = 1" in shuffled.message
    flat = np.c_[POINTS_M[:6, :2], np.zeros(6)]
    on_plane = occ.pose_candidates(bearings_of(flat), flat, "dlt")
    assert on_plane.status is occ.Status.degenerate and "one plane" in on_plane.message
    assert not on_plane.value


@pytest.mark.parametrize(
    ("points", "pixels", "options", "complaint"),
    [
        (POINTS_M, pixels_of(POINTS_M)[:5], {}, "points_px must be one for each point"),
        (np.where(np.arange(20)[:, None] == 7, math.nan, POINTS_M), pixels_of(POINTS_M), {},
         r"points_in_world\[7\] must be finite"),
        (POINTS_M, np.full((20, 2), math.inf), {}, r"points_px\[0\] must be finite"),
        (POINTS_M, pixels_of(POINTS_M), {"sigma_px": 0}, "sigma_px must be positive, got 0"),
        (POINTS_M, pixels_of(POINTS_M), {"solver": "p4p"}, 'solver = "p4p" must be one of upright'),
        (POINTS_M, pixels_of(POINTS_M), {"solver": "upright_p2p"}, "given up_in_cam"),
    ],
)  # fmt: skip
def test_errors_name_the_argument(points, pixels, options, complaint):
    with pytest.raises(ValueError, match=complaint):
        occ.solve_pose(points, pixels, CAMERA, **options)


def test_errors_of_candidates_name_the_argument():
    with pytest.raises(ValueError, match=r"bearings\[0\] must be of unit length"):
        occ.pose_candidates(np.ones((3, 3)), POINTS_M[:3])
    with pytest.raises(ValueError, match="bearings must be one column for each point, got 3"):
        occ.pose_candidates(bearings_of(POINTS_M[:3]), POINTS_M[:4])
    with pytest.raises(ValueError, match="one that takes origins"):
        occ.pose_candidates(bearings_of(POINTS_M[:4]), POINTS_M[:4], "homography",
                            origins_in_cam_m=np.zeros((4, 3)))  # fmt: skip
    with pytest.raises(ValueError, match="fx_px must be positive"):
        occ.Camera.pinhole(width=9, height=9, fx_px=0, fy_px=1, cx_px=4, cy_px=4)
    with pytest.raises(ValueError, match="tolerance_rad must be positive"):
        occ.pose_candidates(bearings_of(POINTS_M[:4]), POINTS_M[:4], tolerance_rad=-1)


@pytest.mark.parametrize(("bearings", "points", "name"), [(2, 3, "bearings"), (3, 4, "points_in_world")])
def test_p3p_requires_three_points(bearings, points, name):
    with pytest.raises(ValueError, match=f"{name} must be three rows, got "):
        occ.p3p(np.eye(4)[:bearings, :3], np.eye(4)[:points, :3])


def test_no_pose_is_not_a_certain_one():
    """A fix without candidates has an infinite covariance and a message."""
    fix = occ.solve_pose(POINTS_M[:2], np.zeros((2, 2)), CAMERA)
    assert not fix.ok and not fix.candidates
    assert np.isinf(np.diag(fix.covariance)).all()
    assert np.isinf(np.diag(fix.position_covariance_m2)).all()
    assert repr(fix) == "<Fix: too_few_lamps, 2 points; a pose takes three>"
    assert report.fix_dict(fix)["position_m"] is None


def test_planar_poses_need_two_points_or_a_heading():
    up = [0.0, 0.0, 1.0]
    pose = np.eye(4)
    pose[:3, 3] = [-1, -2, -0.5]
    points = np.array([[1.5, 2.2, 3], [0.2, 2.9, 2.6]])
    rays = points + pose[:3, 3]
    bearings = rays / np.linalg.norm(rays, axis=1)[:, None]
    known = dict(up_in_cam=up, height_m=0.5)
    assert occ.pose.planar_poses(bearings, points, **known)[0] == pytest.approx(pose, abs=1e-9)
    (one,) = occ.pose.planar_poses(bearings[:1], points[:1], **known, heading_rad=0.0)
    assert one == pytest.approx(pose, abs=1e-9)
    with pytest.raises(ValueError, match="two rows, or one with a heading_rad, got 1"):
        occ.pose.planar_poses(bearings[:1], points[:1], **known)
