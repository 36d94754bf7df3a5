# SPDX-License-Identifier: Apache-2.0
"""Public names of the package: those of everyday use, the submodules, and the former places of names that moved."""

import importlib
import subprocess
import sys

import pytest

import libocc as occ
from libocc import _moved

# Names of libocc 0.1 that are in a submodule since 0.2, apart from those that were renamed.
MOVED = """
    Adjustment AmbientImage AmbientLight AprilTag CalibratedLight CameraParameter Channel ChannelResponse CheckResult
    Checksum ChessboardTarget ChessboardTruth CircleTruth CircularTarget ClockJump Code CodeBudget CodeKind CodeStatus
    CommonFactor Consistency ConsistencyReport ControlOutput Datum DatumKind Decoded DecodedCode DecodedLamp
    DetectablePoint DockOptions DockOutput DockPhase Drive DriveCommand DriveLimited DriveNoise DriveState DriveStep
    EffectPlan Ellipse ExplainedEffect FilterOutcome FilterUpdate FloorVisibility Follower Ghost HeadlightDistance
    Kidnapping LampCode LampFailure LampFlux LampLight Layout LineCode LocalisationValue LoopEstimation LoopFaults
    LoopMetrics LoopOptions LoopOutcome LoopResult MeasuredPoint Measurement Mosaic Network NetworkStart
    NetworkStatistics NoiseArea Object ObjectMatch ObjectPoint OdometryLink PaceOptions PanTiltPlan
    PanTiltResult ParameterStatistics PlanStatus PlanarEstimate PlanarFilter PlanarFilterOptions PlanarOdometry
    PlanarPose PlanarPrior PlanarSmoothing PlanarWindowEstimate PlanarWindowSmoother PointValue PoseBound
    PoseCandidate PoseFilter PoseFilterOptions PoseObservation PosePrediction PowerFit Precision PurePursuitOptions
    Ray ReceivedPower RecognisedObject Recognition RecoveredResponse RejectedObservation Resection ResponseMethod
    RoadHeights Route RouteConflict RoutePlace RoutePlan RouteShape RouteWaypoint RungChoice RungCost RungCosts
    RungForecast ScalePrediction ScaleSource Selection SelectionStep SmootherFrame Smoothing StanleyOptions TagTruth
    Target TargetRenderer TestField TestFieldDesign Use VarianceComponent VarianceComponents Vehicle VehiclePose
    VehiclePoses Waveform WindowEstimate WindowSmoother adjust aperture_power april_tag_families board_network
    calibrate_ambient calibrate_light camera_on_vehicle check_points chi2_quantile closed_loop code_budget
    compare_scale dbm decode decode_samples detect_april_tags detectable_points dock drive encode_id find_chessboard
    format_camera heading_rad headlight_distance identify_object image_residuals_px lambertian_order lamp_network
    localisation_value locate_by_tags measure_points moved_pose nees network_statistics nis normalised_squared_error
    paper_additional_parameters paper_panorama_camera parameter_statistics plan_pan_tilt plan_render plan_route
    planar_poses pose_bound position_covariance precision project_lamp_centre project_rim projection_uncertainty
    pure_pursuit radiance radiant_intensity read_mesh recognise recover_response resect route_conflicts
    select_parameters simulate_test_field smooth smooth_planar stanley start_network start_pinhole tag_poses
    variance_components vehicle_poses view_gaps views_around visibility
""".split()


def test_everyday_names_are_few():
    assert 50 <= len(occ.__all__) <= 70
    assert set(occ.__all__) < set(dir(occ))


def test_each_name_has_one_place():
    places = [name for place in _moved.NEW_HOMES for name in importlib.import_module(f"libocc.{place}").__all__]
    assert len(places) == len(set(places))
    assert not set(places) & set(occ.__all__)


def test_submodules_are_loaded_at_first_use():
    program = (
        "import sys, libocc\n"
        "print([m for m in ('yaml', 'click', 'pydantic', 'libocc.network', 'libocc.cli') if m in sys.modules])\n"
        "print(libocc.network.Network.__name__, 'libocc.network' in sys.modules)"
    )
    ran = subprocess.run([sys.executable, "-W", "error", "-c", program], capture_output=True, text=True)
    assert ran.stdout.split("\n")[:2] == ["[]", "Network True"], ran.stderr


@pytest.mark.parametrize("name", MOVED)
def test_moved_names_stay_importable(name):
    with pytest.warns(DeprecationWarning, match=rf"libocc\.{name} has moved to libocc\.\w+\.{name}"):
        value = getattr(occ, name)
    assert value is getattr(occ._core, name, value)


@pytest.mark.parametrize("name", list(_moved.RENAMED))
def test_renamed_names_stay_importable(name):
    place, present = _moved.RENAMED[name]
    with pytest.warns(DeprecationWarning, match=rf"libocc\.{name} is now libocc\.{place}\.{present}"):
        assert getattr(occ, name) is getattr(getattr(occ, place), present)


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="module 'libocc' has no attribute 'nosuch'"):
        occ.nosuch


@pytest.mark.parametrize(
    "former, present",
    [
        ("libocc.calibration.network_file", "libocc.network.files"),
        ("libocc.commands.locate", "libocc.cli.commands.locate"),
        ("libocc.guide.runs", "libocc.cli.guide.runs"),
        ("libocc.streams.outputs", "libocc.cli.position.outputs"),
        ("libocc.suggest", "libocc.yaml_files"),
        ("libocc.sweep.plan", "libocc.cli.sweep.plan"),
    ],
)
def test_moved_modules_stay_importable(former, present):
    for loaded in [name for name in sys.modules if name == former or former.startswith(f"{name}.")]:
        if _moved.present_path(loaded.removeprefix("libocc.")) is not None:
            del sys.modules[loaded]
    with pytest.warns(DeprecationWarning, match=rf"{former} has moved to {present}"):
        module = importlib.import_module(former)
    name = next(name for name in vars(importlib.import_module(present)) if not name.startswith("_"))
    assert getattr(module, name) is getattr(importlib.import_module(present), name)


def test_an_unknown_module_is_not_found():
    with pytest.raises(ModuleNotFoundError, match="libocc.nosuch"):
        importlib.import_module("libocc.nosuch")
