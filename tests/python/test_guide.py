# SPDX-License-Identifier: Apache-2.0
"""Vehicles, routes, plans and the closed loop from Python, and routes from files."""

import math
import pickle
from pathlib import Path

import numpy as np
import pytest

import libocc as occ
from libocc.guide.route_file import load_route, route_of

RING = [[1.6, 1.2], [2.8, 1.2], [2.8, 2.0], [1.2, 2.0], [1.2, 1.2]]


@pytest.fixture(scope="module")
def scene(root: Path):
    return occ.Scene.load(root / "data" / "scenes" / "kookmin_four_lamps.yaml")


@pytest.fixture(scope="module")
def narrow(scene):
    camera = occ.Camera.pinhole(width=640, height=480, fx_px=422.5, fy_px=422.5, cx_px=319.5, cy_px=239.5)
    return scene.replace(camera=camera)


def ring(laps=1, **options):
    return occ.guide.Route(RING, closed=True, laps=laps, corner_radius_m=0.4, **options)


def test_a_vehicle_reports_limited_commands():
    step = occ.guide.drive(occ.guide.Vehicle(), occ.guide.DriveState(), occ.guide.DriveCommand(speed_m_s=9), 0.1)
    assert step.limited.speed and step.limited.acceleration and not step.limited.turn
    assert step.odometry.increment.x_m == pytest.approx(0.5 * 0.5 * 0.1**2)
    with pytest.raises(ValueError, match="command.speed_m_s"):
        occ.guide.drive(occ.guide.Vehicle(), occ.guide.DriveState(), occ.guide.DriveCommand(speed_m_s=math.nan), 0.1)
    with pytest.raises(ValueError, match="slip_share"):
        occ.guide.DriveNoise(slip_share=2)


def test_noise_follows_the_seed():
    vehicle = occ.guide.Vehicle(noise=occ.guide.DriveNoise(slip=0.01))
    moving, ahead = occ.guide.DriveState(speed_m_s=0.5), occ.guide.DriveCommand(speed_m_s=0.5)
    ends = [occ.guide.drive(vehicle, moving, ahead, 0.1, seed=seed).state.pose.x_m for seed in (1, 1, 2)]
    assert ends[0] == ends[1] != ends[2]


def test_a_route_returns_its_points():
    route = ring(laps=2)
    assert route.length_m == pytest.approx(2 * (4.8 - 3.2 + 0.8 * math.pi))
    place = route.nearest([2.0, 1.25])
    assert place.along_m == pytest.approx(0.4) and place.deviation_m == pytest.approx(0.05)
    later = route.nearest([2.0, 1.25], near_m=route.lap_m)
    assert later.along_m == pytest.approx(route.lap_m + 0.4)
    rows = route.sampled(0.05)
    assert rows.shape[1] == 5 and np.diff(rows[:, 0]).max() <= 0.05 + 1e-12


def test_a_route_is_pickled():
    waypoints = [occ.guide.RouteWaypoint(position_m=p, speed_m_s=0.2) for p in RING]
    dock = occ.guide.PlanarPose(x_m=1, heading_rad=2)
    route = occ.guide.Route(waypoints, shape=occ.guide.RouteShape.spline, dock=dock)
    again = pickle.loads(pickle.dumps(route))
    np.testing.assert_array_equal(again.sampled(0.1), route.sampled(0.1))
    assert again.dock.heading_rad == 2 and again.at(0).speed_m_s == 0.2


def test_a_route_through_a_wall_is_rejected(scene):
    route = occ.guide.Route([[2, 2], [3.9, 2]])
    (conflict,) = occ.guide.route_conflicts(route, scene, radius_m=0.3, height_m=0.5)
    assert conflict.what == "a wall" and conflict.position_m == pytest.approx([3.9, 2])
    with pytest.raises(ValueError, match="a wall"):
        occ.guide.closed_loop(scene, route)


def test_controllers_steer_towards_the_route():
    for control in (occ.guide.pure_pursuit, occ.guide.stanley):
        right = occ.guide.PlanarPose(x_m=2.0, y_m=1.1)
        output = control(ring(), occ.guide.Vehicle(), right, 0.4, along_m=0.4)
        assert output.command.turn_rate_rad_s > 0 and not output.at_end
        fast = control(ring(speed_m_s=3), occ.guide.Vehicle(), right, 0.4, along_m=0.4)
        assert fast.speed_limited and fast.command.speed_m_s <= 1


def test_docking_ends_at_the_dock():
    state, phase = occ.guide.DriveState(pose=occ.guide.PlanarPose(x_m=-0.8, y_m=0.1)), occ.guide.DockPhase.approach
    for _ in range(6000):
        output = occ.guide.dock(state.pose, state.speed_m_s, occ.guide.PlanarPose(), occ.guide.Vehicle(), phase)
        phase = output.phase
        if phase is occ.guide.DockPhase.docked and state.speed_m_s == 0:
            break
        state = occ.guide.drive(occ.guide.Vehicle(), state, output.command, 0.01).state
    assert math.hypot(state.pose.x_m, state.pose.y_m) < 1e-3 and abs(state.pose.heading_rad) < 1e-3


def test_visibility_of_a_floor(scene, narrow):
    poses = [[2, 2, 0], [1, 1, 0], [-1, 0, 0]]
    wide = occ.guide.visibility(scene, poses)
    assert wide.lamps_in_view.tolist() == [4, 3, 0] or wide.lamps_in_view[0] == 4
    assert wide.lamps[2] == [] and math.isinf(wide.position_sigma_m[2])
    assert occ.guide.visibility(narrow, poses).lamps[:2] == [[], [0]]
    with pytest.raises(ValueError, match="sigma_px"):
        occ.guide.visibility(scene, poses, sigma_px=-1)


def test_plans_keep_lamps_in_view_or_report_gaps(narrow):
    start = occ.guide.PlanarPose(x_m=1, y_m=1)
    plan = occ.guide.plan_route(narrow, start, [(3, 3)])
    assert plan.ok and plan.seen_share == 1 and len(occ.guide.view_gaps(narrow, plan.route)) == 0
    blind = occ.guide.plan_route(narrow, start, [(3, 3)], min_lamps=3)
    assert blind.status is occ.guide.PlanStatus.blind and blind.gaps.shape[1] == 6 and "without view" in blind.message
    assert occ.guide.plan_route(narrow, start, [(3.9, 3)]).status is occ.guide.PlanStatus.goal_blocked
    with pytest.raises(ValueError, match=r"goals\[0\]"):
        occ.guide.plan_route(narrow, start, [(3,)])


def test_pan_and_tilt_are_planned(narrow):
    assert len(occ.guide.view_gaps(narrow, ring())) > 0
    result = occ.guide.plan_pan_tilt(narrow, ring())
    assert result.ok and len(result.gaps) == 0
    pan, tilt = result.plan.at(1.0)
    assert -math.pi <= pan <= math.pi and 0 <= tilt <= 0.8
    again = pickle.loads(pickle.dumps(result.plan))
    np.testing.assert_array_equal(again.knots, result.plan.knots)


def test_the_loop_closes(scene):
    noise = occ.guide.DriveNoise(slip=0.002, odometry=0.001)
    options = occ.guide.LoopOptions(vehicle=occ.guide.Vehicle(noise=noise), seed=3)
    called = []
    run = occ.guide.closed_loop(
        scene, ring(dock=occ.guide.PlanarPose(x_m=2.4, y_m=1.2)), options, lambda t, m: called.append((t, m)) or True
    )
    assert run.ok and run.outcome is occ.guide.LoopOutcome.arrived, run.message
    assert run.metrics.cross_track_rmse_m < 5e-3 and run.metrics.final_position_error_m < 2e-3
    records, frames = run.records, run.frames
    assert len({len(column) for column in records.values()}) == 1
    assert records["covariance"].shape == (len(records["time_s"]), 3, 3)
    off = np.hypot(records["x_m"] - records["true_x_m"], records["y_m"] - records["true_y_m"])
    assert off[10:].max() < 5e-3
    assert len(frames["captured_s"]) == run.metrics.frames and frames["lamps_used"].max() == 4
    assert called[-1][0] == pytest.approx(run.metrics.duration_s, abs=0.11)


def test_an_observer_ends_the_run(scene):
    run = occ.guide.closed_loop(scene, ring(), observer=lambda time_s, along_m: time_s < 1)
    assert run.outcome is occ.guide.LoopOutcome.out_of_time and run.metrics.duration_s < 1.2

    def fails(time_s, along_m):
        raise RuntimeError("no more")

    with pytest.raises(RuntimeError, match="no more"):
        occ.guide.closed_loop(scene, ring(), observer=fails)


def test_options_are_values():
    faults = occ.guide.LoopFaults(lamp_failures=[occ.guide.LampFailure(lamp=1, from_s=20)], latency_s=0.05)
    options = occ.guide.LoopOptions(faults=faults, seed=4, coast_s=0.5)
    again = pickle.loads(pickle.dumps(options))
    assert again.faults.lamp_failures[0].lamp == 1 and again.coast_s == 0.5 and again.replace(seed=5).seed == 5
    with pytest.raises(ValueError, match="frame_loss"):
        occ.guide.LoopFaults(frame_loss=2)


ROUTE = """schema: libocc-route/1
waypoints: [{x_m: 0, y_m: 0}, {x_m: 1, y_m: 0}]
"""


def test_routes_come_from_files(tmp_path):
    path = tmp_path / "route.yaml"
    path.write_text(ROUTE + "dock: {x_m: 1.2, y_m: 0, heading_deg: 90}\nspeed_m_s: 0.3\n")
    route = load_route(str(path))
    assert route.length_m == pytest.approx(1) and route.dock.heading_rad == pytest.approx(math.pi / 2)
    assert route.at(0.5).speed_m_s == 0.3
    own = route_of({"shape": "spline", "waypoints": [{"x_m": x, "y_m": x * x} for x in (0, 1, 2)]})
    assert own.nearest([1, 1]).deviation_m == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    "text, message",
    [
        ("schema: libocc-scene/1\nwaypoints: []", "schema must be libocc-route/1, got 'libocc-scene/1'"),
        ("schema: libocc-route/1\nwaypoint: []", "did you mean waypoints"),
        ("schema: libocc-route/1\nwaypoints: [{x_m: 0, y_m: 0}, {x_m: 1}]", r"waypoints\[1\].y_m"),
        ("schema: libocc-route/1\nwaypoints: [{x_m: .nan, y_m: 0}]", r"waypoints\[0\].x_m must be a finite number"),
        ("schema: libocc-route/1\nwaypoints: [{x_m: 0, y_m: 0}, {x_m: 0, y_m: 0}]", r"waypoints\[1\]"),
        (ROUTE + "laps: 2", "laps"),
        (ROUTE + "shape: splines", "did you mean spline"),
        (ROUTE + "speed_m_s: fast", "speed_m_s must be a finite"),
        (ROUTE + "dock: [1, 2]", "dock must be a mapping"),
    ],
)
def test_bad_route_files_are_rejected(tmp_path, text, message):
    path = tmp_path / "route.yaml"
    path.write_text(text)
    with pytest.raises(ValueError, match=message) as caught:
        load_route(str(path))
    assert str(path) in str(caught.value)


class DeadReckoning:
    """An estimator of odometry alone, and of what it was given."""

    def __init__(self, scene):
        self.lamps = len(scene.lamps)
        self.images = []

    def start(self, time_s, pose, covariance):
        self.time_s, self.pose, self.covariance = time_s, pose, covariance

    def add_odometry(self, step):
        turn = self.pose.heading_rad
        forward, left = step.increment.x_m, step.increment.y_m
        self.pose = occ.guide.PlanarPose(
            x_m=self.pose.x_m + math.cos(turn) * forward - math.sin(turn) * left,
            y_m=self.pose.y_m + math.sin(turn) * forward + math.cos(turn) * left,
            heading_rad=turn + step.increment.heading_rad,
        )
        self.time_s = step.to_s

    def add_image(self, image, captured_s, now_s, cam_from_body):
        self.images.append((image.shape, now_s - captured_s, cam_from_body.shape))
        return self.at(now_s)

    def at(self, time_s):
        return occ.guide.EstimatedPose(
            time_s=time_s, pose=self.pose, covariance=self.covariance, state=occ.TrackerState.tracking
        )


def test_a_loop_with_an_estimator_in_python(scene):
    made = []

    def make(of):
        made.append(DeadReckoning(of))
        return made[-1]

    route = occ.guide.Route([[1.6, 1.6], [2.4, 1.6]])
    options = occ.guide.LoopOptions(start_sigma_m=1e-4, start_sigma_rad=1e-4)
    run = occ.guide.closed_loop(scene, route, options, make_estimator=make)
    assert run.ok, run.message
    assert run.metrics.cross_track_max_m < 1e-3  # without noise, odometry is exact
    (estimator,) = made
    assert estimator.lamps == len(scene.lamps)
    assert {(shape, mount) for shape, _, mount in estimator.images} == {((480, 640), (4, 4))}
    assert len(estimator.images) > 10

    class Broken(DeadReckoning):
        def at(self, time_s):
            raise RuntimeError("no pose today")

    with pytest.raises(RuntimeError, match="no pose today"):
        occ.guide.closed_loop(scene, route, options, make_estimator=Broken)


def test_the_world_of_an_experiment(tmp_path, scene):
    way = "route: {waypoints: [{x_m: 1.6, y_m: 1.6}, {x_m: 2.4, y_m: 1.6}]}"
    head = f"schema: libocc-experiment/1\nscene: kookmin_four_lamps\n{way}\n"

    def read(text):
        path = tmp_path / "e.yaml"
        path.write_text(head + text)
        return occ.guide.load_experiment(str(path)).options

    world = read(
        "world: {map_sigma_m: 0.003, lens: {k1: -0.005}, mount_rotation_deg: [0.5, 0, 0], "
        "floor_tilt_deg: 0.1, clock_s: 0.02}\n"
    ).world
    assert (world.map_sigma_m, world.lens, world.clock_s) == (0.003, {"k1": -0.005}, 0.02)
    assert world.mount_rotation_rad == pytest.approx([math.radians(0.5), 0, 0])
    assert world.floor_tilt_rad == pytest.approx(math.radians(0.1))
    options = read("tracker: {mount_sigma_rad: 0.003, mount_sigma_m: 0.002, clock_sigma_s: 0.005}\n")
    assert (options.mount_sigma_rad, options.mount_sigma_m, options.clock_sigma_s) == (0.003, 0.002, 0.005)
    options = read("tracker: {alert_limit_m: 0.08, integrity_risk: 1.0e-6}\n")
    assert (options.alert_limit_m, options.integrity_risk) == (0.08, 1e-6)
    assert repr(read("").world) == repr(occ.guide.WorldErrors())
    for text, complaint in [
        ("world: {lens: {k1: much}}\n", r"world\.lens\.k1"),
        ("world: {lens: [1]}\n", r"world\.lens"),
        ("world: {map_sigma: 1}\n", "map_sigma_m"),
        ("world: {exposure: 0}\n", r"world\.exposure"),
        ("tracker: {mount_sigma_rad: -1}\n", "mount_sigma_rad"),
        ("tracker: {alert_limit_m: 0}\n", "alert_limit_m"),
        ("tracker: {integrity_risk: 2}\n", "integrity_risk"),
    ]:
        with pytest.raises(ValueError, match=complaint):
            read(text)


def test_the_vehicle_stops_while_its_estimator_states_no_level(scene):
    class Unprotected:
        """Reports the start pose, without a protection level."""

        def __init__(self, _):
            self.estimate = occ.guide.EstimatedPose(state=occ.TrackerState.tracking)

        def start(self, time_s, pose, covariance):
            self.estimate = self.estimate.replace(time_s=time_s, pose=pose, covariance=covariance)

        def add_odometry(self, step):
            pass

        def add_image(self, image, captured_s, now_s, cam_from_body):
            return self.estimate

        def at(self, time_s):
            return self.estimate

    route = occ.guide.Route([[1.6, 1.6], [2.4, 1.6]])
    options = occ.guide.LoopOptions(alert_limit_m=0.05, max_lost_s=0.5)
    run = occ.guide.closed_loop(scene, route, options, make_estimator=Unprotected)
    assert run.outcome is occ.guide.LoopOutcome.lost and "no protection level below the alert limit" in run.message
    assert run.records["alert"].all() and np.isinf(run.records["protection_level_m"]).all()
    assert run.metrics.driven_m == 0 and run.metrics.alert_s == pytest.approx(0.5)
