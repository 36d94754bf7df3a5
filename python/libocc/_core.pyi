# SPDX-License-Identifier: Apache-2.0
"""
The compiled part of libocc; use `import libocc`.
"""
from __future__ import annotations
import collections.abc
import enum
import numpy
import numpy.typing
import os
import typing
__all__: list[str] = ['Adjustment', 'AmbientImage', 'AmbientLight', 'AprilTag', 'Blob', 'Box', 'CalibratedLight', 'Camera', 'CameraFormat', 'CameraKind', 'CameraParameter', 'Candidate', 'Channel', 'ChannelResponse', 'CheckResult', 'Checksum', 'ChessboardTarget', 'ChessboardTruth', 'CircleTruth', 'CircularTarget', 'ClockJump', 'Code', 'CodeBudget', 'CodeKind', 'CodeStatus', 'CommonFactor', 'Consistency', 'ConsistencyReport', 'ControlOutput', 'Datum', 'DatumKind', 'Decoded', 'DecodedCode', 'DecodedLamp', 'DetectablePoint', 'DockOptions', 'DockOutput', 'DockPhase', 'Drive', 'DriveCommand', 'DriveLimited', 'DriveNoise', 'DriveState', 'DriveStep', 'EffectPlan', 'Effects', 'Ellipse', 'ExplainedEffect', 'Explanation', 'FilterOutcome', 'FilterUpdate', 'Fix', 'FloorVisibility', 'FluxModel', 'FluxUse', 'Follower', 'Ghost', 'HeadlightDistance', 'Hypothesis', 'Identification', 'IdentifyMethod', 'ImuSample', 'Kidnapping', 'LadderBound', 'LadderFrame', 'LadderOutcome', 'LadderStep', 'Lamp', 'LampCode', 'LampFailure', 'LampFlux', 'LampIndex', 'LampLight', 'LampResidual', 'LampShape', 'LampTruth', 'Layout', 'Lens', 'LineCode', 'LocalisationValue', 'LoopEstimation', 'LoopFaults', 'LoopMetrics', 'LoopOptions', 'LoopOutcome', 'LoopResult', 'Match', 'MeasuredPoint', 'Measurement', 'Mosaic', 'Network', 'NetworkStart', 'NetworkStatistics', 'NoiseArea', 'Object', 'ObjectMatch', 'ObjectPoint', 'Odometry', 'OdometryLie', 'OdometryLink', 'PaceOptions', 'PanTiltPlan', 'PanTiltResult', 'ParameterStatistics', 'PlanStatus', 'PlanarEstimate', 'PlanarFilter', 'PlanarFilterOptions', 'PlanarOdometry', 'PlanarPose', 'PlanarPrior', 'PlanarSmoothing', 'PlanarWindowEstimate', 'PlanarWindowSmoother', 'PointValue', 'PoseBound', 'PoseCandidate', 'PoseCandidates', 'PoseEstimate', 'PoseFilter', 'PoseFilterOptions', 'PoseObservation', 'PosePrediction', 'PowerFit', 'Precision', 'Prior', 'PurePursuitOptions', 'Ray', 'Readout', 'ReceivedPower', 'RecognisedObject', 'Recognition', 'RecoveredResponse', 'Refined', 'RejectedObservation', 'Renderer', 'Resection', 'Response', 'ResponseMethod', 'RoadHeights', 'RobustPose', 'Room', 'Route', 'RouteConflict', 'RoutePlace', 'RoutePlan', 'RouteShape', 'RouteWaypoint', 'Rung', 'RungChoice', 'RungCost', 'RungCosts', 'RungForecast', 'ScalePrediction', 'ScaleSource', 'Scene', 'Selection', 'SelectionStep', 'Sensor', 'SmootherFrame', 'Smoothing', 'Solver', 'StanleyOptions', 'Status', 'Symmetry', 'SymmetryKind', 'Tag', 'TagTruth', 'Target', 'TargetRenderer', 'TestField', 'TestFieldDesign', 'Timing', 'TrackedFrame', 'Tracker', 'TrackerState', 'Trajectory', 'Truth', 'Use', 'VarianceComponent', 'VarianceComponents', 'Vehicle', 'VehiclePose', 'VehiclePoses', 'Waveform', 'WindowEstimate', 'WindowSmoother', 'adjust', 'aperture_power', 'april_tag_families', 'board_network', 'calibrate_ambient', 'calibrate_light', 'camera_on_vehicle', 'check_points', 'chi2_quantile', 'closed_loop', 'code_budget', 'compare_scale', 'dbm', 'decode', 'decode_samples', 'detect', 'detect_april_tags', 'detectable_points', 'dock', 'drive', 'encode_id', 'encode_image', 'explain', 'find_chessboard', 'format_camera', 'heading_rad', 'headlight_distance', 'identify', 'identify_object', 'image_residuals_px', 'ladder_frame', 'ladder_steps', 'lambertian_order', 'lamp_network', 'localisation_value', 'locate', 'locate_by_tags', 'look_at', 'measure_points', 'moved_pose', 'nees', 'network_statistics', 'nis', 'normalised_squared_error', 'p3p', 'paper_additional_parameters', 'paper_panorama_camera', 'parameter_statistics', 'plan_pan_tilt', 'plan_render', 'plan_route', 'planar_poses', 'pose_bound', 'pose_candidates', 'position_covariance', 'precision', 'project_lamp_centre', 'project_rim', 'projection_uncertainty', 'pure_pursuit', 'radiance', 'radiant_intensity', 'read_camera', 'read_image', 'received_power', 'recognise', 'recover_response', 'refine', 'resect', 'robust_pose', 'route_conflicts', 'select_parameters', 'simulate', 'simulate_test_field', 'smooth', 'smooth_planar', 'solve_pose', 'solvers', 'stanley', 'start_network', 'start_pinhole', 'tag_poses', 'time_refine', 'variance_components', 'vehicle_poses', 'view_gaps', 'views_around', 'visibility', 'write_camera', 'write_image']
class Status(enum.Enum):
    """
    How a search for a pose ended.
    """
    ambiguous = 1
    budget_not_met = 7
    degenerate = 5
    no_lamps = 2
    no_pose = 4
    not_converged = 6
    ok = 0
    too_few_lamps = 3
class CodeKind(enum.Enum):
    """
    How a lamp says its id by blinking.
    """
    c_ook = 0
    csk = 3
    s2psk = 2
    ufsook = 1
class LineCode(enum.Enum):
    """
    How bits become chips.
    """
    code_4b6b = 1
    manchester = 0
class Checksum(enum.Enum):
    """
    Of an id: 8 or 16 bits.
    """
    crc16 = 1
    crc8 = 0
class CodeStatus(enum.Enum):
    """
    How reading a code ended.
    """
    checksum_failed = 4
    incomplete = 2
    no_signal = 1
    ok = 0
    uncertain = 3
class Code:
    """
    How a lamp says its id by blinking.

    Keywords (and properties):
      kind: CodeKind
      id_bits: with the checksum's a multiple of 4, at most 16
      checksum: Checksum of the id
      clock_hz: c_ook: chips a second; csk: symbols
      line: LineCode of c_ook
      repeats: c_ook: of a sub-packet before the next one
      frame_rate_hz: of the camera; ufsook, s2psk are made for it
      min_hz: ufsook, s2psk: blinks faster than this
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, kind: CodeKind = ..., id_bits: typing.SupportsInt | typing.SupportsIndex = 8, checksum: Checksum = ..., clock_hz: typing.SupportsFloat | typing.SupportsIndex = 10000.0, line: LineCode = ..., repeats: typing.SupportsInt | typing.SupportsIndex = 4, frame_rate_hz: typing.SupportsFloat | typing.SupportsIndex = 30.0, min_hz: typing.SupportsFloat | typing.SupportsIndex = 100.0) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> Code:
        """
        A copy with the given fields changed.
        """
    @property
    def checksum(self) -> Checksum:
        """
        Checksum of the id
        """
    @property
    def clock_hz(self) -> float:
        """
        c_ook: chips a second; csk: symbols
        """
    @property
    def frame_rate_hz(self) -> float:
        """
        of the camera; ufsook, s2psk are made for it
        """
    @property
    def id_bits(self) -> int:
        """
        with the checksum's a multiple of 4, at most 16
        """
    @property
    def kind(self) -> CodeKind:
        """
        CodeKind
        """
    @property
    def min_hz(self) -> float:
        """
        ufsook, s2psk: blinks faster than this
        """
    @property
    def line(self) -> LineCode:
        """
        LineCode of c_ook
        """
    @property
    def repeats(self) -> int:
        """
        c_ook: of a sub-packet before the next one
        """
class LampCode:
    """
    What a lamp says by blinking.

    Keywords (and properties):
      code: Code
      id: what the lamp says
      channel: s2psk: 0 the lamp, 1 its reference; csk: 0 red, 1 green, 2 blue emitter
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, code: Code, id: typing.SupportsInt | typing.SupportsIndex, channel: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> LampCode:
        """
        A copy with the given fields changed.
        """
    @property
    def channel(self) -> int:
        """
        s2psk: 0 the lamp, 1 its reference; csk: 0 red, 1 green, 2 blue emitter
        """
    @property
    def code(self) -> Code:
        """
        Code
        """
    @property
    def id(self) -> int:
        """
        what the lamp says
        """
class Waveform:
    """
    The light of a lamp over one period, repeated without end.
    """
    def __repr__(self) -> str:
        ...
    @property
    def chip_rate_hz(self) -> float:
        """
        [Hz]
        """
    @property
    def chips(self) -> list[list[float]]:
        """
        By channel: light over its greatest, equal parts.
        """
    @property
    def frequency_hz(self) -> float:
        """
        Of the period [Hz].
        """
class DecodedCode:
    """
    An id that was read, or why none was.
    """
    def __repr__(self) -> str:
        ...
    @property
    def bits(self) -> list[int]:
        """
        As decided: id and checksum.
        """
    @property
    def clock_error(self) -> float:
        """
        Of the lamp, relative.
        """
    @property
    def expected_errors(self) -> float:
        """
        Wrong bits to be expected.
        """
    @property
    def explained(self) -> float:
        """
        Part of the light's variance, noise apart.
        """
    @property
    def frames(self) -> int:
        """
        Frames that had samples.
        """
    @property
    def id(self) -> int | None:
        """
        None unless ok.
        """
    @property
    def margins(self) -> list[float]:
        """
        Log likelihood of each bit over its opposite's.
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is CodeStatus.ok.
        """
    @property
    def status(self) -> CodeStatus:
        """
        How it ended, a CodeStatus.
        """
class CodeBudget:
    """
    Whether a camera can read a code.
    """
    def __repr__(self) -> str:
        ...
    @property
    def chips_in_view(self) -> float:
        """
        In one image of the lamp.
        """
    @property
    def chips_needed(self) -> float:
        """
        In one image of the lamp.
        """
    @property
    def exposure_chips(self) -> float:
        """
        Chips in an exposure; ufsook, s2psk: half periods.
        """
    @property
    def fits(self) -> bool:
        """
        Whether it can.
        """
    @property
    def frames_needed(self) -> float:
        """
        About, to see all of it.
        """
    @property
    def message(self) -> str:
        """
        Why not, with the numbers.
        """
    @property
    def period_s(self) -> float:
        """
        Of the whole packet [s].
        """
    @property
    def row_chips(self) -> float:
        """
        Chips from row to row.
        """
class CameraKind(enum.Enum):
    """
    Which model a camera is.
    """
    double_sphere = 2
    fisheye = 1
    pinhole = 0
    rotating_line = 3
    rotating_line_first_order = 4
class CameraFormat(enum.Enum):
    """
    Of a camera file.
    """
    libocc = 0
    opencv = 1
    ros = 2
class CameraParameter:
    """
    One number of a camera's model.
    """
    def __repr__(self) -> str:
        ...
    @property
    def is_length(self) -> bool:
        """
        changes with the scene's scale
        """
    @property
    def name(self) -> str:
        """
        as in the factories and camera files
        """
    @property
    def unit(self) -> str:
        """
        px, rad, m or 1
        """
    @property
    def value(self) -> float:
        """
        in that unit
        """
class Ray:
    """
    Where a pixel's ray starts and goes, camera frame.
    """
    @property
    def direction(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        unit
        """
    @property
    def origin(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        [m]; zero for a camera with one centre
        """
class Camera:
    """
    Where a point appears, along which ray a pixel looks.

    Made by pinhole (with OpenCV's lens distortion), fisheye, double_sphere or rotating_line.

    Pixel (0, 0) is the centre of the first pixel; camera axes: x right, y down, z forward
    (of a rotating line: z down along its axis).

    >>> import libocc as occ
    >>> camera = occ.Camera.pinhole(width=640, height=480, fx_px=400, fy_px=400, cx_px=319.5, cy_px=239.5)
    >>> camera.project([0.1, 0, 2]).tolist()
    [339.5, 239.5]
    """
    @staticmethod
    def double_sphere(*, width: typing.SupportsInt | typing.SupportsIndex, height: typing.SupportsInt | typing.SupportsIndex, fx_px: typing.SupportsFloat | typing.SupportsIndex, fy_px: typing.SupportsFloat | typing.SupportsIndex, cx_px: typing.SupportsFloat | typing.SupportsIndex, cy_px: typing.SupportsFloat | typing.SupportsIndex, xi: typing.SupportsFloat | typing.SupportsIndex, alpha: typing.SupportsFloat | typing.SupportsIndex) -> Camera:
        """
        The double sphere camera of Usenko, Demmel and Cremers (3DV 2018).

        Raises: ValueError naming the argument and its value.
        """
    @staticmethod
    def fisheye(*, width: typing.SupportsInt | typing.SupportsIndex, height: typing.SupportsInt | typing.SupportsIndex, fx_px: typing.SupportsFloat | typing.SupportsIndex, fy_px: typing.SupportsFloat | typing.SupportsIndex, cx_px: typing.SupportsFloat | typing.SupportsIndex, cy_px: typing.SupportsFloat | typing.SupportsIndex, distortion: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = [], skew_px: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> Camera:
        """
        Kannala and Brandt's fisheye as OpenCV has it, at most 4 coefficients.

        Raises: ValueError naming the argument and its value.

        >>> import libocc as occ
        >>> camera = occ.Camera.fisheye(width=800, height=800, fx_px=250, fy_px=250, cx_px=399.5, cy_px=399.5)
        >>> camera.project([1, 0, -0.2]) is None  # behind the image plane, and still seen
        False
        """
    @staticmethod
    def pinhole(*, width: typing.SupportsInt | typing.SupportsIndex, height: typing.SupportsInt | typing.SupportsIndex, fx_px: typing.SupportsFloat | typing.SupportsIndex, fy_px: typing.SupportsFloat | typing.SupportsIndex, cx_px: typing.SupportsFloat | typing.SupportsIndex, cy_px: typing.SupportsFloat | typing.SupportsIndex, distortion: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = [], skew_px: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> Camera:
        """
        Camera of a size, focal lengths and principal point in pixels.

        distortion: 0, 4, 5, 8, 12 or 14 coefficients in OpenCV's order k1 k2 p1 p2 k3 k4 k5 k6 s1 ...
        Raises: ValueError naming the argument and its value.
        """
    @staticmethod
    def rotating_line(*, width: typing.SupportsInt | typing.SupportsIndex, height: typing.SupportsInt | typing.SupportsIndex, c_px: typing.SupportsFloat | typing.SupportsIndex, cy_px: typing.SupportsFloat | typing.SupportsIndex | None = None, angle_per_px_rad: typing.SupportsFloat | typing.SupportsIndex | None = None, tilt_x_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0, tilt_y_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0, eccentricity_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = (0, 0, 0), k1: typing.SupportsFloat | typing.SupportsIndex = 0.0, k2: typing.SupportsFloat | typing.SupportsIndex = 0.0, tumbling_rad: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(6)"] = (0, 0, 0, 0, 0, 0)) -> Camera:
        """
        A linear array on a turntable: columns are angles, rows positions on the array.

        The frame's Z is the turntable's axis towards growing rows; columns grow from X to Y.
        width, height: [px]; c_px: camera constant over the array's pixel pitch; cy_px: row of the
        horizon (default: the middle); angle_per_px_rad: between columns (default: 2 pi / width);
        tilt_x_rad, tilt_y_rad: of the array; eccentricity_m (3,): of the projection centre;
        k1, k2: distortion along the array; tumbling_rad (6,): Fourier terms of the axis's wobble.
        Equations: libocc/camera/rotating_line.hpp. Raises: ValueError naming the argument.

        >>> import libocc as occ
        >>> camera = occ.Camera.rotating_line(width=3600, height=1000, c_px=573)
        >>> camera.project([0, 2, 0]).round(9).tolist()  # a quarter of the way round, on the horizon
        [900.0, 499.5]
        """
    @staticmethod
    def rotating_line_first_order(*, width: typing.SupportsInt | typing.SupportsIndex, height: typing.SupportsInt | typing.SupportsIndex, c_px: typing.SupportsFloat | typing.SupportsIndex, cy_px: typing.SupportsFloat | typing.SupportsIndex | None = None, angle_per_px_rad: typing.SupportsFloat | typing.SupportsIndex | None = None, tilt_x_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0, tilt_y_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0, eccentricity_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = (0, 0, 0), k1: typing.SupportsFloat | typing.SupportsIndex = 0.0, k2: typing.SupportsFloat | typing.SupportsIndex = 0.0, tumbling_rad: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(6)"] = (0, 0, 0, 0, 0, 0)) -> Camera:
        """
        The additive first-order form of rotating_line, for comparison; takes no tumbling_rad.
        """
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> tuple[typing.Any, ...]:
        ...
    def __hash__(self) -> int:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: tuple[typing.Any, ...]) -> None:
        ...
    def contains(self, pixel: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 1]"]) -> bool:
        """
        Whether a pixel is on the sensor.
        """
    def difference_px(self, to: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 1]"], from_: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 1]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 1]"]:
        """
        to - from_ (2,), the short way around the seam.
        """
    def project(self, point_in_cam_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 1]"] | None:
        """
        Pixel (2,) of a point (3,) in the camera's frame [m]; None outside the lens model.
        """
    def ray(self, pixel: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 1]"]) -> Ray | None:
        """
        Ray of a pixel (2,); None outside the model.
        """
    def unproject(self, pixel: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 1]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"] | None:
        """
        Unit bearing (3,) of a pixel (2,); None outside the lens model.
        """
    def with_parameters(self, values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> Camera:
        """
        This camera with other values of `parameters`.
        """
    @property
    def cx_px(self) -> float:
        """
        Principal point, column [px].
        """
    @property
    def cy_px(self) -> float:
        """
        Principal point, row [px].
        """
    @property
    def distortion(self) -> list[float]:
        """
        Coefficients, OpenCV's order.
        """
    @property
    def fx_px(self) -> float:
        """
        Focal length along a row [px].
        """
    @property
    def fy_px(self) -> float:
        """
        Focal length along a column [px].
        """
    @property
    def height(self) -> int:
        """
        Rows [px].
        """
    @property
    def is_central(self) -> bool:
        """
        Whether all rays meet in a point.
        """
    @property
    def kind(self) -> CameraKind:
        """
        CameraKind.
        """
    @property
    def matrix(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        K, 3x3.
        """
    @property
    def max_angle_rad(self) -> float:
        """
        Largest angle from the optical axis the lens model covers [rad].
        """
    @property
    def parameters(self) -> list[CameraParameter]:
        """
        All CameraParameters, in the order of with_parameters.
        """
    @property
    def period_px(self) -> float:
        """
        Columns after which the image repeats itself, or infinity.
        """
    @property
    def skew_px(self) -> float:
        """
        Skew [px].
        """
    @property
    def width(self) -> int:
        """
        Columns [px].
        """
class LampShape(enum.Enum):
    """
    Shape of a lamp's lit face.
    """
    disc = 0
    lame = 3
    point = 2
    rectangle = 1
class Response(enum.Enum):
    """
    How the linear signal becomes the stored grey level.
    """
    gamma = 1
    linear = 0
    srgb = 2
    table = 3
class Mosaic(enum.Enum):
    """
    Colour filters over the pixels.
    """
    bggr = 4
    gbrg = 3
    grbg = 2
    none = 0
    rggb = 1
class Readout(enum.Enum):
    """
    Which pixels a rolling shutter exposes together.
    """
    columns = 1
    rows = 0
    unknown = 2
class Channel:
    """
    What differs in the pixels of one colour.

    Keywords (and properties):
      efficiency: times the sensor's quantum_efficiency
      response: linear, gamma, srgb or table
      gamma: of Response.gamma
      response_table: of Response.table
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, efficiency: typing.SupportsFloat | typing.SupportsIndex = 1.0, response: Response = ..., gamma: typing.SupportsFloat | typing.SupportsIndex = 2.2, response_table: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = []) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> Channel:
        """
        A copy with the given fields changed.
        """
    @property
    def efficiency(self) -> float:
        """
        times the sensor's quantum_efficiency
        """
    @property
    def gamma(self) -> float:
        """
        of Response.gamma
        """
    @property
    def response(self) -> Response:
        """
        linear, gamma, srgb or table
        """
    @property
    def response_table(self) -> list[float]:
        """
        of Response.table
        """
class Sensor:
    """
    The camera as a light meter: exposure, noise, response.

    Keywords (and properties):
      pixel_pitch_m: pixel pitch [m]
      f_number: focal length over aperture
      exposure_s: exposure time [s]
      quantum_efficiency: electrons per photon
      wavelength_m: at which it holds [m]
      full_well_e: electrons a pixel can hold
      gain_dn_per_e: grey levels per electron
      read_noise_e: standard deviation of reading [electrons]
      dark_current_e_per_s: [electrons/s]
      black_level_dn: grey level without light
      bit_depth: 8 to 16; more than 8 makes uint16 images
      response: linear, gamma, srgb or table
      gamma: of Response.gamma: stored = linear^(1/gamma)
      response_table: of Response.table: stored values (0..1) at evenly spaced linear ones
      row_time_s: from one row to the next [s]; 0: global shutter
      readout: pixels a rolling shutter exposes together
      psf_sigma_px: Gaussian blur of the lens [px]
      gain_sigma: relative standard deviation of the pixels' gains
      gain_seed: sensors of one seed have the same pixels
      blooming: part of the charge beyond the full well that spills along the column
      mosaic: colour filters over the pixels
      channels: Channels for red, green, blue; empty: all alike
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, pixel_pitch_m: typing.SupportsFloat | typing.SupportsIndex = 7.1e-06, f_number: typing.SupportsFloat | typing.SupportsIndex = 2.0, exposure_s: typing.SupportsFloat | typing.SupportsIndex = 2e-05, quantum_efficiency: typing.SupportsFloat | typing.SupportsIndex = 0.5, wavelength_m: typing.SupportsFloat | typing.SupportsIndex = 5.5e-07, full_well_e: typing.SupportsFloat | typing.SupportsIndex = 10000.0, gain_dn_per_e: typing.SupportsFloat | typing.SupportsIndex = 0.025, read_noise_e: typing.SupportsFloat | typing.SupportsIndex = 10.0, dark_current_e_per_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, black_level_dn: typing.SupportsFloat | typing.SupportsIndex = 2.0, bit_depth: typing.SupportsInt | typing.SupportsIndex = 8, response: Response = ..., gamma: typing.SupportsFloat | typing.SupportsIndex = 2.2, response_table: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = [], row_time_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, readout: Readout = ..., psf_sigma_px: typing.SupportsFloat | typing.SupportsIndex = 0.8, gain_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.0, gain_seed: typing.SupportsInt | typing.SupportsIndex = 0, blooming: typing.SupportsFloat | typing.SupportsIndex = 0.0, mosaic: Mosaic = ..., channels: collections.abc.Sequence[Channel] = []) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> Sensor:
        """
        A copy with the given fields changed.
        """
    @property
    def bit_depth(self) -> int:
        """
        8 to 16; more than 8 makes uint16 images
        """
    @property
    def black_level_dn(self) -> float:
        """
        grey level without light
        """
    @property
    def blooming(self) -> float:
        """
        part of the charge beyond the full well that spills along the column
        """
    @property
    def channels(self) -> list[Channel]:
        """
        Channels for red, green, blue; empty: all alike
        """
    @property
    def dark_current_e_per_s(self) -> float:
        """
        [electrons/s]
        """
    @property
    def exposure_s(self) -> float:
        """
        exposure time [s]
        """
    @property
    def f_number(self) -> float:
        """
        focal length over aperture
        """
    @property
    def full_well_e(self) -> float:
        """
        electrons a pixel can hold
        """
    @property
    def gain_dn_per_e(self) -> float:
        """
        grey levels per electron
        """
    @property
    def gain_seed(self) -> int:
        """
        sensors of one seed have the same pixels
        """
    @property
    def gain_sigma(self) -> float:
        """
        relative standard deviation of the pixels' gains
        """
    @property
    def gamma(self) -> float:
        """
        of Response.gamma: stored = linear^(1/gamma)
        """
    @property
    def mosaic(self) -> Mosaic:
        """
        colour filters over the pixels
        """
    @property
    def pixel_pitch_m(self) -> float:
        """
        pixel pitch [m]
        """
    @property
    def psf_sigma_px(self) -> float:
        """
        Gaussian blur of the lens [px]
        """
    @property
    def quantum_efficiency(self) -> float:
        """
        electrons per photon
        """
    @property
    def read_noise_e(self) -> float:
        """
        standard deviation of reading [electrons]
        """
    @property
    def readout(self) -> Readout:
        """
        pixels a rolling shutter exposes together
        """
    @property
    def response(self) -> Response:
        """
        linear, gamma, srgb or table
        """
    @property
    def response_table(self) -> list[float]:
        """
        of Response.table: stored values (0..1) at evenly spaced linear ones
        """
    @property
    def row_time_s(self) -> float:
        """
        from one row to the next [s]; 0: global shutter
        """
    @property
    def wavelength_m(self) -> float:
        """
        at which it holds [m]
        """
class Lamp:
    """
    A lamp: where it is, its shape, how it shines and blinks.

    Keywords (and properties):
      id: unique in its scene
      centre_m: (3,) centre of the lit face [m, world]
      normal: (3,) towards the lit side; made unit
      radius_m: of a disc [m]
      power_w: radiant power while lit [W]
      half_power_rad: half-power semi-angle [rad]
      frequency_hz: blink code [Hz]; None: always lit
      shape: disc, rectangle, point or lame
      size_m: (2,) of a rectangle or Lame curve: along x_axis, across it [m]
      x_axis: (3,) of a rectangle or Lame curve: in its plane; made unit
      exponent: of a Lame curve, 1 to 100; 2: an ellipse
      name: for people
      duty: lit fraction of a blink period
      waveform: instead: light over power_w in equal parts of a period, such as a code's chips
      phase: periods that have passed at time 0
      code: what it says, a LampCode; sets frequency_hz and waveform
      colour: (3,) light that red, green, blue pixels get, over white's
      power_sigma: relative standard deviation of power_w
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, id: typing.SupportsInt | typing.SupportsIndex, centre_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], normal: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = [0.0, 0.0, -1.0], radius_m: typing.SupportsFloat | typing.SupportsIndex = 0.0, power_w: typing.SupportsFloat | typing.SupportsIndex = 1.0, half_power_rad: typing.SupportsFloat | typing.SupportsIndex = 1.0471975511965976, frequency_hz: typing.SupportsFloat | typing.SupportsIndex | None = None, shape: LampShape = ..., size_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 1]"] = [0.0, 0.0], x_axis: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = [1.0, 0.0, 0.0], exponent: typing.SupportsFloat | typing.SupportsIndex = 2.0, name: str = '', duty: typing.SupportsFloat | typing.SupportsIndex = 0.5, waveform: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = [], phase: typing.SupportsFloat | typing.SupportsIndex = 0.0, code: LampCode | None = None, colour: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = [1.0, 1.0, 1.0], power_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.1) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> Lamp:
        """
        A copy with the given fields changed.
        """
    @property
    def centre_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) centre of the lit face [m, world]
        """
    @property
    def code(self) -> LampCode | None:
        """
        what it says, a LampCode; sets frequency_hz and waveform
        """
    @property
    def colour(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) light that red, green, blue pixels get, over white's
        """
    @property
    def duty(self) -> float:
        """
        lit fraction of a blink period
        """
    @property
    def exponent(self) -> float:
        """
        of a Lame curve, 1 to 100; 2: an ellipse
        """
    @property
    def frequency_hz(self) -> float | None:
        """
        blink code [Hz]; None: always lit
        """
    @property
    def half_power_rad(self) -> float:
        """
        half-power semi-angle [rad]
        """
    @property
    def id(self) -> int:
        """
        unique in its scene
        """
    @property
    def name(self) -> str:
        """
        for people
        """
    @property
    def normal(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) towards the lit side; made unit
        """
    @property
    def phase(self) -> float:
        """
        periods that have passed at time 0
        """
    @property
    def power_sigma(self) -> float:
        """
        relative standard deviation of power_w
        """
    @property
    def power_w(self) -> float:
        """
        radiant power while lit [W]
        """
    @property
    def radius_m(self) -> float:
        """
        of a disc [m]
        """
    @property
    def shape(self) -> LampShape:
        """
        disc, rectangle, point or lame
        """
    @property
    def size_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 1]"]:
        """
        (2,) of a rectangle or Lame curve: along x_axis, across it [m]
        """
    @property
    def waveform(self) -> list[float]:
        """
        instead: light over power_w in equal parts of a period, such as a code's chips
        """
    @property
    def x_axis(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) of a rectangle or Lame curve: in its plane; made unit
        """
class Room:
    """
    A box room with one corner at the world's origin.

    Keywords (and properties):
      size_m: (3,) box with a corner at the origin [m]
      wall_reflectance: 0 to 1
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, size_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = [4.0, 4.0, 3.0], wall_reflectance: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> Room:
        """
        A copy with the given fields changed.
        """
    @property
    def size_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) box with a corner at the origin [m]
        """
    @property
    def wall_reflectance(self) -> float:
        """
        0 to 1
        """
class Ghost:
    """
    A faint second image of everything inside the lens.

    Keywords (and properties):
      strength: part of the light that goes there
      scale: about the principal point; negative: turned
      blur_px: of its own, beside the lens's [px]
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, strength: typing.SupportsFloat | typing.SupportsIndex = 0.0, scale: typing.SupportsFloat | typing.SupportsIndex = -1.0, blur_px: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> Ghost:
        """
        A copy with the given fields changed.
        """
    @property
    def blur_px(self) -> float:
        """
        of its own, beside the lens's [px]
        """
    @property
    def scale(self) -> float:
        """
        about the principal point; negative: turned
        """
    @property
    def strength(self) -> float:
        """
        part of the light that goes there
        """
class Lens:
    """
    What a lens does to the light beside projecting it.

    Keywords (and properties):
      diffraction: blur of 0.42 wavelength x f-number
      focus_distance_m: None: everything is in focus [m]
      vignetting: a1, a2, ... of the transmission 1 + a1 q^2 + a2 q^4 + ..., q = 1 in the farthest corner
      veiling_glare: part of the light that spreads evenly
      ghosts: second images inside the lens
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, diffraction: bool = False, focus_distance_m: typing.SupportsFloat | typing.SupportsIndex | None = None, vignetting: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = [], veiling_glare: typing.SupportsFloat | typing.SupportsIndex = 0.0, ghosts: collections.abc.Sequence[Ghost] = []) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> Lens:
        """
        A copy with the given fields changed.
        """
    @property
    def diffraction(self) -> bool:
        """
        blur of 0.42 wavelength x f-number
        """
    @property
    def focus_distance_m(self) -> float | None:
        """
        None: everything is in focus [m]
        """
    @property
    def ghosts(self) -> list[Ghost]:
        """
        second images inside the lens
        """
    @property
    def veiling_glare(self) -> float:
        """
        part of the light that spreads evenly
        """
    @property
    def vignetting(self) -> list[float]:
        """
        a1, a2, ... of the transmission 1 + a1 q^2 + a2 q^4 + ..., q = 1 in the farthest corner
        """
class Box:
    """
    Something opaque, its sides along the world's axes.

    Keywords (and properties):
      min_m: (3,) lowest corner [m, world]
      max_m: (3,) highest corner [m, world]
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, min_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], max_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> Box:
        """
        A copy with the given fields changed.
        """
    @property
    def max_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) highest corner [m, world]
        """
    @property
    def min_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) lowest corner [m, world]
        """
class Use(enum.Enum):
    """
    Of an effect that the scene calls for: rendered always, never, or when its bounds exceed the tolerances.
    """
    automatic = 2
    off = 1
    on = 0
class Effects:
    """
    Which effects simulate() renders, of those the scene calls for.

    default: Use of the effects that are not named. Further keywords: effects by name, see `use`.
    tolerance_dn, tolerance_px: with Use.automatic an effect is left out that changes no pixel's grey
    level and moves no lamp's centroid by more.
    Raises: ValueError for an unknown effect, naming the nearest known one.

    >>> import libocc as occ
    >>> occ.Effects(default=occ.Use.automatic, walls=occ.Use.off).use["walls"].name
    'off'
    """
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, default: Use = ..., *, tolerance_dn: typing.SupportsFloat | typing.SupportsIndex = 0.5, tolerance_px: typing.SupportsFloat | typing.SupportsIndex = 0.02, **kwargs: Use) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    @property
    def tolerance_dn(self) -> float:
        """
        Grey levels.
        """
    @property
    def tolerance_px(self) -> float:
        """
        Pixels.
        """
    @property
    def use(self) -> dict[str, Use]:
        """
        Use by effect's name.
        """
class Tag:
    """
    An AprilTag as a landmark: its number, size and place.

    Keywords (and properties):
      id: number, unique in its family
      size_m: side of the square whose corners are detected [m]
      centre_m: (3,) [m, world]
      family: a name in april_tag_families()
      normal: (3,) towards the printed side
      x_axis: (3,) to the right on the print, seen upright
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, id: typing.SupportsInt | typing.SupportsIndex, size_m: typing.SupportsFloat | typing.SupportsIndex, centre_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], family: str = 'tag36h11', normal: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = [0.0, 0.0, -1.0], x_axis: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = [1.0, 0.0, 0.0]) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> Tag:
        """
        A copy with the given fields changed.
        """
    @property
    def centre_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) [m, world]
        """
    @property
    def family(self) -> str:
        """
        a name in april_tag_families()
        """
    @property
    def id(self) -> int:
        """
        number, unique in its family
        """
    @property
    def normal(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) towards the printed side
        """
    @property
    def size_m(self) -> float:
        """
        side of the square whose corners are detected [m]
        """
    @property
    def x_axis(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) to the right on the print, seen upright
        """
class Prior:
    """
    What is known of a pose beforehand; each part is optional.

    Keywords (and properties):
      position_m: (3,) of the camera [m, world]
      position_sigma_m: standard deviation per axis [m]
      position_sigmas_m: (3,) instead, along x, y, z; infinite where nothing is known [m]
      height_m: of the camera: its z [m]
      height_sigma_m: its standard deviation [m]
      heading_rad: as heading_rad() defines it [rad]
      heading_sigma_rad: its standard deviation [rad]
      gravity_in_cam: (3,) unit, down, in the camera's frame
      gravity_sigma_rad: its standard deviation [rad]
      last_pose: (cam_from_world, 6x6 covariance): where a tracker expects the camera
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, position_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] | None = None, position_sigma_m: typing.SupportsFloat | typing.SupportsIndex = 0.5, position_sigmas_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] | None = None, height_m: typing.SupportsFloat | typing.SupportsIndex | None = None, height_sigma_m: typing.SupportsFloat | typing.SupportsIndex = 0.05, heading_rad: typing.SupportsFloat | typing.SupportsIndex | None = None, heading_sigma_rad: typing.SupportsFloat | typing.SupportsIndex = 0.35, gravity_in_cam: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] | None = None, gravity_sigma_rad: typing.SupportsFloat | typing.SupportsIndex = 0.02, last_pose: tuple[typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 6]"]] | None = None) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> Prior:
        """
        A copy with the given fields changed.
        """
    @property
    def gravity_in_cam(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"] | None:
        """
        (3,) unit, down, in the camera's frame
        """
    @property
    def gravity_sigma_rad(self) -> float:
        """
        its standard deviation [rad]
        """
    @property
    def heading_rad(self) -> float | None:
        """
        as heading_rad() defines it [rad]
        """
    @property
    def heading_sigma_rad(self) -> float:
        """
        its standard deviation [rad]
        """
    @property
    def height_m(self) -> float | None:
        """
        of the camera: its z [m]
        """
    @property
    def height_sigma_m(self) -> float:
        """
        its standard deviation [m]
        """
    @property
    def last_pose(self) -> tuple[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]] | None:
        """
        (cam_from_world, 6x6 covariance): where a tracker expects the camera
        """
    @property
    def position_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"] | None:
        """
        (3,) of the camera [m, world]
        """
    @property
    def position_sigma_m(self) -> float:
        """
        standard deviation per axis [m]
        """
    @property
    def position_sigmas_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"] | None:
        """
        (3,) instead, along x, y, z; infinite where nothing is known [m]
        """
class Scene:
    """
    What is known before a picture is taken: camera, sensor, lamps.

    camera: Camera. lamps: Lamps with different ids. sensor: Sensor, default one when None.
    room: Room or None. lens: Lens. boxes: what hides lamps. ambient_w_m2: light on the sensor that
    comes from no lamp. effects: which of all this simulate() renders. tags: AprilTags as landmarks.
    Raises: ValueError naming the part, the field and its value.

    >>> import libocc as occ
    >>> camera = occ.Camera.pinhole(width=640, height=480, fx_px=400, fy_px=400, cx_px=319.5, cy_px=239.5)
    >>> occ.Scene(camera=camera, lamps=[occ.Lamp(id=7, centre_m=[0, 0, 3], radius_m=0.1)])
    <Scene: camera 640x480, 1 lamps [7]>
    """
    @staticmethod
    def load(path: os.PathLike[str] | str) -> Scene:
        """
        Scene from a YAML file (the schema is in data/scenes/README.md).

        Raises: FileNotFoundError or OSError when it cannot be opened; ValueError naming file, line, key
          and value.
        """
    @staticmethod
    def parse(text: str) -> Scene:
        """
        Scene from YAML text. Raises: ValueError naming line, key and value.
        """
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __getstate__(self) -> str:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, camera: Camera, lamps: collections.abc.Sequence[Lamp], sensor: Sensor | None = None, room: Room | None = None, lens: Lens | None = None, boxes: collections.abc.Sequence[Box] = [], ambient_w_m2: typing.SupportsFloat | typing.SupportsIndex = 0.0, effects: Effects | None = None, tags: collections.abc.Sequence[Tag] = []) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: str) -> None:
        ...
    def as_rendered(self) -> Scene:
        """
        The scene without what its effects switch off, such as vignetting or the response curve:
        for whoever measures images that were rendered so.
        """
    def format(self) -> str:
        """
        The YAML text that save() writes.
        """
    def replace(self, *, camera: Camera | None = None, lamps: collections.abc.Sequence[Lamp] | None = None, sensor: Sensor | None = None, room: Room | None = None, lens: Lens | None = None, boxes: collections.abc.Sequence[Box] | None = None, ambient_w_m2: typing.SupportsFloat | typing.SupportsIndex | None = None, effects: Effects | None = None, tags: collections.abc.Sequence[Tag] | None = None) -> Scene:
        """
        A copy with the parts that are given changed.
        """
    def save(self, path: os.PathLike[str] | str) -> None:
        """
        Writes a YAML file that load() reads back to an equal scene.
        """
    @property
    def ambient_w_m2(self) -> float:
        """
        On the sensor [W/m^2].
        """
    @property
    def boxes(self) -> tuple[Box, ...]:
        """
        Boxes, a tuple.
        """
    @property
    def camera(self) -> Camera:
        """
        Camera.
        """
    @property
    def effects(self) -> Effects:
        """
        Effects.
        """
    @property
    def lamps(self) -> tuple[Lamp, ...]:
        """
        Lamps, a tuple: a scene does not change.
        """
    @property
    def lens(self) -> Lens:
        """
        Lens.
        """
    @property
    def room(self) -> Room | None:
        """
        Room or None.
        """
    @property
    def sensor(self) -> Sensor:
        """
        Sensor.
        """
    @property
    def tags(self) -> tuple[Tag, ...]:
        """
        Tags, a tuple.
        """
class ReceivedPower:
    """
    Power of the lamps' light that the lens takes in and the sensor gets. Many poses are the arrays' first axis.
    """
    def __repr__(self) -> str:
        ...
    @property
    def lamp_power_w(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (lamps,) or (n, lamps) [W], in the scene's order.
        """
    @property
    def power_w(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        () or (n,) of all lamps [W].
        """
    @property
    def visible(self) -> numpy.typing.NDArray[numpy.int32]:
        """
        () or (n,) lamps of which some light arrives.
        """
    @property
    def whole(self) -> numpy.typing.NDArray[numpy.bool]:
        """
        (lamps,) or (n, lamps): all of the lamp's face is seen.
        """
class Trajectory:
    """
    Where a camera is over time.

    times_s: of the waypoints, rising. cam_from_world: 4x4 at each. Between waypoints the camera moves
    on a screw at constant velocity (the geodesic of SE(3)); a turn is the shorter way round.
    Raises: ValueError naming the waypoint.

    >>> import libocc as occ
    >>> poses = [occ.look_at(position_m=[x, 0, 1], target_m=[x, 0, 3], up=[0, 1, 0]) for x in (1, 2)]
    >>> walk = occ.Trajectory(times_s=[0, 2], cam_from_world=poses)
    >>> walk.velocity(0.5).round(3).tolist()
    [0.0, 0.0, 0.0, 0.5, 0.0, 0.0]
    """
    @staticmethod
    def load(path: os.PathLike[str] | str) -> Trajectory:
        """
        From a file in TUM's format: lines `t tx ty tz qx qy qz qw`, the camera's pose in the world.

        Raises: FileNotFoundError or OSError when it cannot be opened; ValueError naming file and line.
        """
    @staticmethod
    def parse(text: str) -> Trajectory:
        """
        From text in TUM's format. Raises: ValueError naming the line.
        """
    def __getstate__(self) -> tuple[list[float], list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]]]:
        ...
    def __init__(self, times_s: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], cam_from_world: collections.abc.Sequence[typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]]) -> None:
        ...
    def __len__(self) -> int:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: tuple[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], collections.abc.Sequence[typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]]]) -> None:
        ...
    def cam_from_world(self, time_s: typing.SupportsFloat | typing.SupportsIndex) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Pose at a time, 4x4. Raises: ValueError before the first waypoint or after the last.
        """
    def format(self) -> str:
        """
        The text that save() writes.
        """
    def save(self, path: os.PathLike[str] | str) -> None:
        """
        Writes a file in TUM's format, whole or not at all.
        """
    def velocity(self, time_s: typing.SupportsFloat | typing.SupportsIndex, to_s: typing.SupportsFloat | typing.SupportsIndex | None = None) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        (6,) as simulate() takes it [rad/s, m/s]: at a time, or the constant one that takes the pose at one time to the pose at another.
        """
    @property
    def begin_s(self) -> float:
        """
        Time of the first waypoint [s].
        """
    @property
    def end_s(self) -> float:
        """
        Time of the last waypoint [s].
        """
    @property
    def poses(self) -> list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]]:
        """
        cam_from_world of the waypoints, 4x4 each.
        """
    @property
    def times_s(self) -> list[float]:
        """
        Of the waypoints [s].
        """
class NoiseArea(enum.Enum):
    """
    Which pixels have noise.
    """
    around_lamps = 1
    everywhere = 0
class EffectPlan:
    """
    What plan_render() makes of one effect.
    """
    def __repr__(self) -> str:
        ...
    @property
    def applied(self) -> bool:
        """
        simulate() renders it.
        """
    @property
    def bound_dn(self) -> float:
        """
        Grey levels that any pixel changes without it, at most.
        """
    @property
    def bound_px(self) -> float:
        """
        How far any lamp's centroid moves without it, at most [px].
        """
    @property
    def called_for(self) -> bool:
        """
        The scene says what it follows from.
        """
    @property
    def effect(self) -> str:
        """
        Its name.
        """
    @property
    def reason(self) -> str:
        """
        For people.
        """
    @property
    def use(self) -> Use:
        """
        What the scene says of it.
        """
class ExplainedEffect(EffectPlan):
    """
    What explain() says of one effect.
    """
    @property
    def cost_s(self) -> float:
        """
        Of rendering one image of many, the difference of two measured times [s].
        """
    @property
    def position_bound_m(self) -> float:
        """
        How far a position from the lamps' centroids moves without it, at most [m]; infinite where the lamps in view determine no pose.
        """
class Explanation:
    """
    What every effect does to an image and costs.
    """
    def __repr__(self) -> str:
        ...
    @property
    def effects(self) -> list[ExplainedEffect]:
        """
        An ExplainedEffect each, in the order in which light meets them.
        """
    @property
    def render_s(self) -> float:
        """
        One image as planned [s].
        """
class LampTruth:
    """
    What is true of one lamp in a rendered image.
    """
    def __repr__(self) -> str:
        ...
    @property
    def centre_px(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 1]"]:
        """
        (2,) projection of the lamp's centre.
        """
    @property
    def electrons(self) -> float:
        """
        Signal electrons of its image.
        """
    @property
    def hidden(self) -> float:
        """
        Share of its face that boxes hide.
        """
    @property
    def id(self) -> int:
        """
        Of the lamp.
        """
    @property
    def image_centre_px(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 1]"]:
        """
        (2,) centre of the lamp's image: of the ellipse of a disc.
        """
    @property
    def in_view(self) -> bool:
        """
        Some of its image lies on the sensor.
        """
    @property
    def rim_px(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]:
        """
        (n, 2) its rim; empty out of view.
        """
    @property
    def whole(self) -> bool:
        """
        All of its rim does.
        """
class Truth:
    """
    What is true of a rendered image: the pose and every lamp.
    """
    def __repr__(self) -> str:
        ...
    @property
    def cam_from_world(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Pose, 4x4.
        """
    @property
    def effects(self) -> list[EffectPlan]:
        """
        An EffectPlan for each effect, as plan_render() returns them; worked out when asked for.
        """
    @property
    def lamps(self) -> tuple[LampTruth, ...]:
        """
        A LampTruth for each lamp of the scene, in its order.
        """
    @property
    def position_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) of the camera [m, world].
        """
class Renderer:
    """
    Renders many images of one scene; the same bits as simulate().

    What images have in common is made once: thousands a second where noise is not wanted everywhere.
    Threads that share one wait for each other; give each its own.

    >>> import libocc as occ
    >>> camera = occ.Camera.pinhole(width=64, height=48, fx_px=40, fy_px=40, cx_px=31.5, cy_px=23.5)
    >>> renderer = occ.Renderer(occ.Scene(camera=camera, lamps=[occ.Lamp(id=7, centre_m=[0, 0, 3], radius_m=0.1)]))
    >>> poses = [occ.look_at(position_m=[0, 0, z], target_m=[0, 0, 3], up=[0, 1, 0]) for z in (1, 2)]
    >>> [int(renderer.render(pose, noise=False)[0].max()) for pose in poses]
    [62, 71]
    """
    def __init__(self, scene: Scene) -> None:
        ...
    def render(self, cam_from_world: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], *, seed: typing.SupportsInt | typing.SupportsIndex = 0, frame: typing.SupportsInt | typing.SupportsIndex = 0, noise: bool = True, noise_area: NoiseArea = ..., start_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, spacing_sigma: typing.SupportsFloat | typing.SupportsIndex = 1.0, velocity: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 1]"] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]) -> tuple[numpy.typing.NDArray[numpy.uint8 | numpy.uint16], Truth]:
        """
        (image, truth) as simulate() returns them.

        Options:
          seed: of the noise; the same seed gives the same image
          frame: noise differs from frame to frame under one seed
          noise: shot and read noise
          noise_area: around lamps alone it is much faster
          start_s: time at which the first row's exposure begins [s]
          spacing_sigma: rim samples are this many PSF sigmas apart
          velocity: (6,) of the camera: d [rotation, translation] / dt of cam_from_world's left perturbation [rad/s, m/s]
        """
    def time(self, cam_from_world: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], min_time_s: typing.SupportsFloat | typing.SupportsIndex, *, seed: typing.SupportsInt | typing.SupportsIndex = 0, frame: typing.SupportsInt | typing.SupportsIndex = 0, noise: bool = True, noise_area: NoiseArea = ..., start_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, spacing_sigma: typing.SupportsFloat | typing.SupportsIndex = 1.0, velocity: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 1]"] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]) -> float:
        """
        Seconds that an image takes, without its way to Python: the mean over min_time_s at least, frames counting up.

        Options:
          seed: of the noise; the same seed gives the same image
          frame: noise differs from frame to frame under one seed
          noise: shot and read noise
          noise_area: around lamps alone it is much faster
          start_s: time at which the first row's exposure begins [s]
          spacing_sigma: rim samples are this many PSF sigmas apart
          velocity: (6,) of the camera: d [rotation, translation] / dt of cam_from_world's left perturbation [rad/s, m/s]
        """
    @property
    def scene(self) -> Scene:
        """
        Scene.
        """
class Ellipse:
    """
    Ellipse of a disc's image.
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, centre_px: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 1]"] = [0.0, 0.0], semi_major_px: typing.SupportsFloat | typing.SupportsIndex = 0.0, semi_minor_px: typing.SupportsFloat | typing.SupportsIndex = 0.0, angle_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> Ellipse:
        """
        A copy with the given fields changed.
        """
    @property
    def angle_rad(self) -> float:
        """
        of the major axis from +x towards +y [rad]
        """
    @property
    def centre_px(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 1]"]:
        """
        (2,) [px]
        """
    @property
    def semi_major_px(self) -> float:
        """
        [px]
        """
    @property
    def semi_minor_px(self) -> float:
        """
        [px]
        """
class Blob:
    """
    One bright region of an image, measured.

    Keywords (and properties):
      centroid_px: (2,) best centre: rim fit, PSF or moments
      covariance_px2: (2, 2) of the centroid [px^2]
      flux_dn: sum of grey levels above the background
      flux_sigma_dn: its standard deviation
      peak_dn: brightest pixel, background included
      background_dn: local background [grey levels]
      noise_dn: standard deviation of a background pixel
      area_px: pixels above the threshold
      x0: bounding box, both ends included
      y0: bounding box, both ends included
      x1: bounding box, both ends included
      y1: bounding box, both ends included
      saturated: pixels at full scale: rim has grown, flux is too low
      merged: shape of more than one lamp
      cut_by_border: touches the image's border
      striped: rolling-shutter stripes joined into one blob
      frequency_hz: blink frequency read from the stripes, or None
      frequency_sigma_hz: its standard deviation
      lamp_id: of the lamp that its code told, or None
      ellipse: of the rim, else of the second moments
      rim: (n, 5) sub-pixel rim: x, y, outward unit normal x, y, sigma along it [px]
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, centroid_px: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 1]"], covariance_px2: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 2]"] = [[0.0, 0.0], [0.0, 0.0]], flux_dn: typing.SupportsFloat | typing.SupportsIndex = 0.0, flux_sigma_dn: typing.SupportsFloat | typing.SupportsIndex = 0.0, peak_dn: typing.SupportsFloat | typing.SupportsIndex = 0.0, background_dn: typing.SupportsFloat | typing.SupportsIndex = 0.0, noise_dn: typing.SupportsFloat | typing.SupportsIndex = 0.0, area_px: typing.SupportsInt | typing.SupportsIndex = 0, x0: typing.SupportsInt | typing.SupportsIndex = 0, y0: typing.SupportsInt | typing.SupportsIndex = 0, x1: typing.SupportsInt | typing.SupportsIndex = 0, y1: typing.SupportsInt | typing.SupportsIndex = 0, saturated: bool = False, merged: bool = False, cut_by_border: bool = False, striped: bool = False, frequency_hz: typing.SupportsFloat | typing.SupportsIndex | None = None, frequency_sigma_hz: typing.SupportsFloat | typing.SupportsIndex = ..., lamp_id: typing.SupportsInt | typing.SupportsIndex | None = None, ellipse: Ellipse = ..., rim: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 5]"] = []) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> Blob:
        """
        A copy with the given fields changed.
        """
    @property
    def area_px(self) -> int:
        """
        pixels above the threshold
        """
    @property
    def background_dn(self) -> float:
        """
        local background [grey levels]
        """
    @property
    def centroid_px(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 1]"]:
        """
        (2,) best centre: rim fit, PSF or moments
        """
    @property
    def covariance_px2(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 2]"]:
        """
        (2, 2) of the centroid [px^2]
        """
    @property
    def cut_by_border(self) -> bool:
        """
        touches the image's border
        """
    @property
    def ellipse(self) -> Ellipse:
        """
        of the rim, else of the second moments
        """
    @property
    def flux_dn(self) -> float:
        """
        sum of grey levels above the background
        """
    @property
    def flux_sigma_dn(self) -> float:
        """
        its standard deviation
        """
    @property
    def frequency_hz(self) -> float | None:
        """
        blink frequency read from the stripes, or None
        """
    @property
    def frequency_sigma_hz(self) -> float:
        """
        its standard deviation
        """
    @property
    def lamp_id(self) -> int | None:
        """
        of the lamp that its code told, or None
        """
    @property
    def merged(self) -> bool:
        """
        shape of more than one lamp
        """
    @property
    def noise_dn(self) -> float:
        """
        standard deviation of a background pixel
        """
    @property
    def peak_dn(self) -> float:
        """
        brightest pixel, background included
        """
    @property
    def rim(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 5]"]:
        """
        (n, 5) sub-pixel rim: x, y, outward unit normal x, y, sigma along it [px]
        """
    @property
    def saturated(self) -> bool:
        """
        pixels at full scale: rim has grown, flux is too low
        """
    @property
    def striped(self) -> bool:
        """
        rolling-shutter stripes joined into one blob
        """
    @property
    def x0(self) -> int:
        """
        bounding box, both ends included
        """
    @property
    def x1(self) -> int:
        """
        bounding box, both ends included
        """
    @property
    def y0(self) -> int:
        """
        bounding box, both ends included
        """
    @property
    def y1(self) -> int:
        """
        bounding box, both ends included
        """
class IdentifyMethod(enum.Enum):
    """
    How poses that explain an image are searched for.
    """
    alignment = 1
    automatic = 0
    clustering = 4
    hashing = 5
    ransac = 3
    voting = 2
class LampIndex:
    """
    Shapes of all triangles of near lamps, made once for a map: what identification by hashing looks up.
    """
    def __init__(self, scene: Scene) -> None:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def applies(self) -> bool:
        """
        Whether four fifths of the lamps hang at one height.
        """
    @property
    def triangles(self) -> int:
        """
        Their number.
        """
class Match:
    """
    Which lamp of the scene is which blob: two indices.
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, lamp: typing.SupportsInt | typing.SupportsIndex, blob: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> Match:
        """
        A copy with the given fields changed.
        """
    @property
    def blob(self) -> int:
        """
        index in the blobs
        """
    @property
    def lamp(self) -> int:
        """
        index in scene.lamps
        """
class SymmetryKind(enum.Enum):
    """
    What takes one explanation of an image to another.
    """
    none = 4
    planar_flip = 3
    screw = 2
    shift = 1
    turn = 0
class Symmetry:
    """
    How the map repeats from one explanation to another.
    """
    def __repr__(self) -> str:
        ...
    @property
    def kind(self) -> SymmetryKind:
        """
        Turn, shift, screw, planar_flip or none.
        """
    @property
    def misfit_m(self) -> float:
        """
        Root mean square of what is left between the lamps [m].
        """
    @property
    def text(self) -> str:
        """
        For people.
        """
    @property
    def world_from_world(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        4x4: takes the best explanation's lamps and camera to the rival's.
        """
class Hypothesis:
    """
    One way to explain an image.
    """
    def __repr__(self) -> str:
        ...
    @property
    def brightness_chi2(self) -> float:
        """
        Of fluxes and sizes about one common gain.
        """
    @property
    def cam_from_world(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Coarse pose, 4x4.
        """
    @property
    def chi2(self) -> float:
        """
        Of centroids, prior and missed lamps.
        """
    @property
    def matches(self) -> list[Match]:
        """
        Matches, sorted by lamp.
        """
    @property
    def missed(self) -> int:
        """
        Lamps that should be in view but are not.
        """
    @property
    def symmetry(self) -> Symmetry | None:
        """
        What takes the best hypothesis to this one; None for the best.
        """
class Identification:
    """
    Which blob is which lamp, all answers.
    """
    def __repr__(self) -> str:
        ...
    @property
    def chance(self) -> float:
        """
        Expected number of wrong poses that explain as many blobs by accident.
        """
    @property
    def hypotheses(self) -> list[Hypothesis]:
        """
        Hypotheses, best first.
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
    @property
    def tried(self) -> int:
        """
        Poses tried.
        """
class ObjectPoint:
    """
    A point of an object that can be found in an image, such as a lamp.

    Keywords (and properties):
      id: unique in its object
      position_m: (3,) [m, object's frame]
      normal: (3,) axis of its cone; made unit
      cone_rad: half angle of the cone from within which it is seen [rad]; pi: from everywhere
      radius_m: of a disc [m]; 0: a point
      label: for people
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, id: typing.SupportsInt | typing.SupportsIndex, position_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], normal: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = [0.0, 0.0, 1.0], cone_rad: typing.SupportsFloat | typing.SupportsIndex = 1.5707963267948966, radius_m: typing.SupportsFloat | typing.SupportsIndex = 0.0, label: str = '') -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> ObjectPoint:
        """
        A copy with the given fields changed.
        """
    @property
    def cone_rad(self) -> float:
        """
        half angle of the cone from within which it is seen [rad]; pi: from everywhere
        """
    @property
    def id(self) -> int:
        """
        unique in its object
        """
    @property
    def label(self) -> str:
        """
        for people
        """
    @property
    def normal(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) axis of its cone; made unit
        """
    @property
    def position_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) [m, object's frame]
        """
    @property
    def radius_m(self) -> float:
        """
        of a disc [m]; 0: a point
        """
class Object:
    """
    An object by the points of it that can be found in an image.

    name: a word. points: ObjectPoints with different ids at different places.
    Raises: ValueError naming the point, the field and its value.
    """
    @staticmethod
    def load(path: os.PathLike[str] | str) -> Object:
        """
        From a YAML file (the schema is in data/objects/README.md).

        Raises: FileNotFoundError or OSError when it cannot be opened; ValueError naming file, line, key
          and value.
        """
    @staticmethod
    def parse(text: str) -> Object:
        """
        From YAML text. Raises: ValueError naming line, key and value.
        """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, name: str, points: collections.abc.Sequence[ObjectPoint]) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def format(self) -> str:
        """
        The YAML text that save() writes.
        """
    def replace(self, **kwargs: typing.Any) -> Object:
        """
        A copy with the given fields changed.
        """
    def save(self, path: os.PathLike[str] | str) -> None:
        """
        Writes a YAML file that load() reads back to an equal object.
        """
    @property
    def name(self) -> str:
        """
        for people
        """
    @property
    def points(self) -> list[ObjectPoint]:
        """
        ObjectPoints
        """
class ObjectMatch:
    """
    An object that explains blobs, and how well.
    """
    def __repr__(self) -> str:
        ...
    @property
    def log10_false_alarms(self) -> float:
        """
        Of how often chance would bring as much in such an image, by any object.
        """
    @property
    def object(self) -> int:
        """
        Index in the objects given.
        """
    @property
    def plausible(self) -> int:
        """
        Of them: no less likely than 1/1000 of the first.
        """
    @property
    def poses(self) -> list[Hypothesis]:
        """
        Hypotheses, best first; the world is the object's frame.
        """
class RecognisedObject:
    """
    An object that is in an image.
    """
    def __repr__(self) -> str:
        ...
    @property
    def match(self) -> ObjectMatch:
        """
        ObjectMatch.
        """
    @property
    def rivals(self) -> list[ObjectMatch]:
        """
        ObjectMatches that explain the same blobs as well.
        """
    @property
    def status(self) -> Status:
        """
        Status.ambiguous: several poses, or rivals.
        """
class Recognition:
    """
    Which objects are in an image, and where.
    """
    def __repr__(self) -> str:
        ...
    @property
    def found(self) -> list[RecognisedObject]:
        """
        RecognisedObjects, surest first.
        """
    @property
    def log10_false_alarms(self) -> list[float]:
        """
        Of each object given, at its best, found or not; inf: not worth a look.
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
class DetectablePoint:
    """
    A vertex where long sharp edges of a body meet.
    """
    def __repr__(self) -> str:
        ...
    @property
    def edges(self) -> int:
        """
        How many meet there.
        """
    @property
    def edges_m(self) -> float:
        """
        Their length [m].
        """
    @property
    def point(self) -> ObjectPoint:
        """
        ObjectPoint; its id is its rank.
        """
class PointValue:
    """
    What a point of an object is worth for its pose.
    """
    def __repr__(self) -> str:
        ...
    @property
    def growth(self) -> float:
        """
        Of the pose's sigmas without it, elsewhere; a mean.
        """
    @property
    def needed(self) -> float:
        """
        Share of the views with a pose that have none without.
        """
    @property
    def seen(self) -> float:
        """
        Share of the views that show it.
        """
class LocalisationValue:
    """
    How well an object's points determine its pose.
    """
    @property
    def determined(self) -> float:
        """
        Share of the views that determine a pose.
        """
    @property
    def points(self) -> list[PointValue]:
        """
        PointValues, in the object's order.
        """
    @property
    def sigma_m(self) -> float:
        """
        Median bound of the camera's position there [m].
        """
    @property
    def sigma_rad(self) -> float:
        """
        Median bound of its rotation there [rad].
        """
class Rung(enum.Enum):
    """
    What of the image the pose has to explain.
    """
    centres = 1
    direct = 3
    points = 0
    rims = 2
class FluxModel(enum.Enum):
    """
    What the lamps' brightness tells.
    """
    common_factor = 2
    ignore = 0
    known_power = 1
class LampResidual:
    """
    How well one lamp fits.
    """
    def __repr__(self) -> str:
        ...
    @property
    def centre_px(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 1]"]:
        """
        (2,) predicted centre of its image.
        """
    @property
    def contradicts(self) -> bool:
        """
        Left out: the other lamps agree without it.
        """
    @property
    def match(self) -> Match:
        """
        Which lamp and blob.
        """
    @property
    def rms_px(self) -> float:
        """
        Over its rim, or of its centroid [px].
        """
class Refined:
    """
    The most likely pose for one naming of the blobs.
    """
    def __repr__(self) -> str:
        ...
    @property
    def cam_from_world(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Pose, 4x4.
        """
    @property
    def chi2(self) -> float:
        """
        Whitened, robust.
        """
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]:
        """
        (6, 6) [rotation, translation], left perturbation.
        """
    @property
    def dof(self) -> int:
        """
        Observations minus parameters.
        """
    @property
    def flux_factor(self) -> float | None:
        """
        Seen over predicted, with FluxModel.common_factor; or None.
        """
    @property
    def iterations(self) -> int:
        """
        Steps taken.
        """
    @property
    def lamps(self) -> list[LampResidual]:
        """
        LampResidual of each match.
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def rim_growth_px(self) -> float | None:
        """
        Of saturated lamps, or None [px].
        """
    @property
    def rms_px(self) -> float:
        """
        Of centres over lamps [px].
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
    @property
    def variance_factor(self) -> float:
        """
        Contained in the covariance; 1 unless chi2 is too large for chance.
        """
class PoseBound:
    """
    The least covariance that an unbiased pose can have.
    """
    def __repr__(self) -> str:
        ...
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]:
        """
        (6, 6) [rotation, translation], left perturbation; 0: no bound.
        """
    @property
    def lamps(self) -> int:
        """
        Lamps or points that contribute.
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def position_covariance_m2(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        (3, 3) of the position [m^2, world].
        """
    @property
    def rank(self) -> int:
        """
        Directions of the pose that are determined, of 6.
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
class RungCost:
    """
    What refining one pose takes by one rung.
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, fixed_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, per_lamp_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, per_rim_point_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, per_pixel_s: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> RungCost:
        """
        A copy with the given fields changed.
        """
    @property
    def fixed_s(self) -> float:
        """
        whatever there is to refine by [s]
        """
    @property
    def per_lamp_s(self) -> float:
        """
        for each lamp [s]
        """
    @property
    def per_pixel_s(self) -> float:
        """
        for each pixel around it [s]
        """
    @property
    def per_rim_point_s(self) -> float:
        """
        for each point of its rim [s]
        """
class RungCosts:
    """
    What each rung takes on a machine: for locate(costs=...).

    `libocc ladder --costs FILE.yaml` measures them; the defaults are those of an ordinary server.
    """
    @staticmethod
    def load(path: os.PathLike[str] | str) -> RungCosts:
        """
        Reads a file of costs. Raises: FileNotFoundError or OSError when it cannot be opened,
        ValueError naming file, line and key when its content is wrong.
        """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, points: RungCost = ..., centres: RungCost = ..., rims: RungCost = ..., direct: RungCost = ...) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> RungCosts:
        """
        A copy with the given fields changed.
        """
    def save(self, path: os.PathLike[str] | str) -> None:
        """
        Writes a file, whole or not at all. Raises: OSError.
        """
    @property
    def centres(self) -> RungCost:
        """
        of Rung.centres
        """
    @property
    def direct(self) -> RungCost:
        """
        of Rung.direct
        """
    @property
    def points(self) -> RungCost:
        """
        of Rung.points
        """
    @property
    def rims(self) -> RungCost:
        """
        of Rung.rims
        """
class RungForecast:
    """
    What a rung was predicted to take and to reach.
    """
    def __repr__(self) -> str:
        ...
    @property
    def predicted_s(self) -> float:
        """
        Time of the refinement [s].
        """
    @property
    def predicted_sigma_m(self) -> float | None:
        """
        Of the position [m], or None when nothing depended on it.
        """
    @property
    def rung(self) -> Rung:
        """
        Rung.
        """
class RungChoice:
    """
    By which rung a pose was refined, and why.
    """
    def __repr__(self) -> str:
        ...
    @property
    def alternatives(self) -> list[RungForecast]:
        """
        A RungForecast for each rung that was considered, cheapest first.
        """
    @property
    def met(self) -> bool:
        """
        Whether budget and target are, as predicted.
        """
    @property
    def predicted_s(self) -> float:
        """
        Time of the refinement [s].
        """
    @property
    def predicted_sigma_m(self) -> float | None:
        """
        Of the position [m]: root of the trace of its covariance's bound.
        """
    @property
    def reason(self) -> str:
        """
        A sentence; unless met, what it would take.
        """
    @property
    def rung(self) -> Rung:
        """
        Rung.
        """
class LadderStep:
    """
    A way from blobs with names to a pose.
    """
    def __repr__(self) -> str:
        ...
    @property
    def family(self) -> str:
        """
        Who wrote what it times.
        """
    @property
    def name(self) -> str:
        """
        For ladder_frame().
        """
    @property
    def observations(self) -> Rung:
        """
        What it sees, a Rung.
        """
    @property
    def what(self) -> str:
        """
        A phrase for people.
        """
class LadderBound:
    """
    Least errors, root mean squares; 0 where there is no bound.
    """
    def __repr__(self) -> str:
        ...
    @property
    def position_expected_m(self) -> float:
        """
        Bound and bias [m].
        """
    @property
    def position_m(self) -> float:
        """
        Cramer-Rao bound [m].
        """
    @property
    def rotation_expected_rad(self) -> float:
        """
        Bound and bias [rad].
        """
    @property
    def rotation_rad(self) -> float:
        """
        Cramer-Rao bound [rad].
        """
class LadderOutcome:
    """
    What one step took and erred on one image.
    """
    def __repr__(self) -> str:
        ...
    @property
    def answered(self) -> bool:
        """
        Whether it returned a pose.
        """
    @property
    def bound(self) -> LadderBound:
        """
        LadderBound of what the step sees.
        """
    @property
    def cam_from_world(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Pose, 4x4.
        """
    @property
    def name(self) -> str:
        """
        Of the step.
        """
    @property
    def position_error_m(self) -> float:
        """
        [m]
        """
    @property
    def rotation_error_rad(self) -> float:
        """
        [rad]
        """
    @property
    def time_s(self) -> float:
        """
        Of one call [s].
        """
class LadderFrame:
    """
    What every step took and erred on one image.
    """
    def __repr__(self) -> str:
        ...
    @property
    def detect_s(self) -> float:
        """
        Finding the blobs [s].
        """
    @property
    def outcomes(self) -> list[LadderOutcome]:
        """
        LadderOutcome of each step that suits.
        """
    @property
    def pixels(self) -> LadderBound:
        """
        LadderBound of all pixels.
        """
    @property
    def points(self) -> LadderBound:
        """
        LadderBound of the centroids.
        """
    @property
    def points_in_world_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        """
        (n, 3) lamps' centres.
        """
    @property
    def points_px(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]:
        """
        (n, 2) their centroids.
        """
class Candidate:
    """
    One pose that explains the image.
    """
    def __repr__(self) -> str:
        ...
    @property
    def cam_from_world(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Pose, 4x4.
        """
    @property
    def chi2(self) -> float:
        """
        Whitened, robust.
        """
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]:
        """
        (6, 6) of cam_from_world [rotation, translation], left perturbation.
        """
    @property
    def dof(self) -> int:
        """
        Observations minus parameters.
        """
    @property
    def lamps(self) -> dict[int, Blob]:
        """
        Lamp id -> Blob.
        """
    @property
    def position_covariance_m2(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        (3, 3) of the position [m^2, world].
        """
    @property
    def position_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) of the camera [m, world].
        """
    @property
    def rms_px(self) -> float:
        """
        Of centres over lamps [px].
        """
class Timing:
    """
    Where the time went [s].
    """
    def __repr__(self) -> str:
        ...
    @property
    def detect_s(self) -> float:
        """
        Finding blobs [s].
        """
    @property
    def identify_s(self) -> float:
        """
        Naming them [s].
        """
    @property
    def refine_s(self) -> float:
        """
        Refining poses [s].
        """
    @property
    def total_s(self) -> float:
        """
        All [s].
        """
class Fix:
    """
    Where the camera was: the answer of locate().

    What was found so far is there even when the fix is not ok: look at status and message. Without
    candidates there is no pose: its covariance is infinite.
    """
    def __repr__(self) -> str:
        ...
    @property
    def blobs(self) -> list[Blob]:
        """
        Everything detected.
        """
    @property
    def cam_from_world(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Pose, 4x4.
        """
    @property
    def candidates(self) -> list[Candidate]:
        """
        Every plausible pose, best first; the first is the fix.
        """
    @property
    def choice(self) -> RungChoice | None:
        """
        RungChoice: by which rung locate() refined, and why; or None.
        """
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]:
        """
        (6, 6) of cam_from_world [rotation rad, translation m], left perturbation.
        """
    @property
    def lamps(self) -> dict[int, Blob]:
        """
        Lamp id -> Blob.
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def position_covariance_m2(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        (3, 3) of the position [m^2, world].
        """
    @property
    def position_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) of the camera [m, world].
        """
    @property
    def rms_px(self) -> float:
        """
        Of centres over lamps [px].
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
    @property
    def timing_s(self) -> Timing:
        """
        Where the time went [s].
        """
class DecodedLamp:
    """
    One light of a sequence and what it says.
    """
    def __repr__(self) -> str:
        ...
    @property
    def blob(self) -> Blob:
        """
        In the brightest of the frames about `frame`; no rim under a moving camera.
        """
    @property
    def budget(self) -> CodeBudget:
        """
        CodeBudget of its image.
        """
    @property
    def code(self) -> DecodedCode:
        """
        DecodedCode.
        """
    @property
    def frame(self) -> int:
        """
        Index of the frame that `blob` is of.
        """
    @property
    def id(self) -> int | None:
        """
        What it says, or None.
        """
    @property
    def reference(self) -> int | None:
        """
        s2psk: index of the light that is its reference.
        """
    @property
    def seen(self) -> int:
        """
        Frames with a blob of it.
        """
    @property
    def track_px(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]:
        """
        (n, 2) where it is in each frame, dark or lit [px].
        """
class Decoded:
    """
    The lights of a sequence and what they say.
    """
    @property
    def blobs(self) -> list[Blob]:
        """
        Their Blobs, with the lamp_id that the map has for what they say.
        """
    @property
    def lamps(self) -> list[DecodedLamp]:
        """
        A DecodedLamp for each light.
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
class PlanarPose:
    """
    Where a vehicle is on a floor: world_from_body; x forward, y left.

    a * b is the pose that is b in a's frame. Covariances are (3, 3), of [x_m, y_m, heading_rad].

    >>> import libocc as occ
    >>> occ.PlanarPose(x_m=1, heading_rad=0.5) * occ.PlanarPose(heading_rad=0.25)
    PlanarPose(x_m=1.0, heading_rad=0.75)

    Keywords (and properties):
      x_m: of the body's origin [m, world]
      y_m: alike
      heading_rad: azimuth of the body's x axis, forward
    """
    @staticmethod
    def of_body(body_from_world: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]) -> PlanarPose:
        """
        The planar part of a body's pose (4x4).
        """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, x_m: typing.SupportsFloat | typing.SupportsIndex = 0.0, y_m: typing.SupportsFloat | typing.SupportsIndex = 0.0, heading_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
    def __mul__(self, arg0: PlanarPose) -> PlanarPose:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def body_from_world(self, height_m: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        4x4 of an upright body whose origin is at this height [m].
        """
    def inverse(self) -> PlanarPose:
        """
        The world in the body's frame.
        """
    def replace(self, **kwargs: typing.Any) -> PlanarPose:
        """
        A copy with the given fields changed.
        """
    @property
    def heading_rad(self) -> float:
        """
        azimuth of the body's x axis, forward
        """
    @property
    def x_m(self) -> float:
        """
        of the body's origin [m, world]
        """
    @property
    def y_m(self) -> float:
        """
        alike
        """
class Odometry:
    """
    How a body has moved between two times.

    Keywords (and properties):
      from_s: begin [s]
      to_s: end [s]
      to_from_from: 4x4, from the body's frame at from_s to that at to_s
      covariance: (6, 6) [rotation, translation], left perturbation
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, from_s: typing.SupportsFloat | typing.SupportsIndex, to_s: typing.SupportsFloat | typing.SupportsIndex, to_from_from: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], covariance: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 6]"]) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> Odometry:
        """
        A copy with the given fields changed.
        """
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]:
        """
        (6, 6) [rotation, translation], left perturbation
        """
    @property
    def from_s(self) -> float:
        """
        begin [s]
        """
    @property
    def to_from_from(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        4x4, from the body's frame at from_s to that at to_s
        """
    @property
    def to_s(self) -> float:
        """
        end [s]
        """
class PlanarOdometry:
    """
    How a vehicle on a floor has moved between two times.

    Keywords (and properties):
      from_s: begin [s]
      to_s: end [s]
      increment: PlanarPose at to_s in the frame of from_s
      covariance: (3, 3) in the frame of from_s
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, from_s: typing.SupportsFloat | typing.SupportsIndex, to_s: typing.SupportsFloat | typing.SupportsIndex, increment: PlanarPose, covariance: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"]) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> PlanarOdometry:
        """
        A copy with the given fields changed.
        """
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        (3, 3) in the frame of from_s
        """
    @property
    def from_s(self) -> float:
        """
        begin [s]
        """
    @property
    def increment(self) -> PlanarPose:
        """
        PlanarPose at to_s in the frame of from_s
        """
    @property
    def to_s(self) -> float:
        """
        end [s]
        """
class ImuSample:
    """
    What a gyroscope and an accelerometer read, along the body's axes.

    Keywords (and properties):
      time_s: of the sample [s]
      turn_rate_rad_s: (3,) [rad/s]
      acceleration_m_s2: (3,) specific force: +9.81 upwards at rest [m/s^2]
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, time_s: typing.SupportsFloat | typing.SupportsIndex, turn_rate_rad_s: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = [0.0, 0.0, 0.0], acceleration_m_s2: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = [0.0, 0.0, 0.0]) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> ImuSample:
        """
        A copy with the given fields changed.
        """
    @property
    def acceleration_m_s2(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) specific force: +9.81 upwards at rest [m/s^2]
        """
    @property
    def time_s(self) -> float:
        """
        of the sample [s]
        """
    @property
    def turn_rate_rad_s(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) [rad/s]
        """
class PoseObservation:
    """
    What one image says of a camera's pose, to second order about it.
    """
    @staticmethod
    def of_pose(time_s: typing.SupportsFloat | typing.SupportsIndex, cam_from_world: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], covariance: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 6]"], cam_from_body: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"] = ...) -> PoseObservation:
        """
        From a pose (4x4) with covariance (6, 6), as a Fix has them; cam_from_body: how the camera is mounted. Raises: ValueError unless that is positive definite.
        """
    @property
    def cam_from_body(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        4x4.
        """
    @property
    def cam_from_world(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Pose, 4x4.
        """
    @property
    def gradient(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        (6,) of half of chi2.
        """
    @property
    def information(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]:
        """
        (6, 6), may be singular.
        """
    @property
    def time_s(self) -> float:
        """
        When it was seen [s].
        """
class FilterOutcome(enum.Enum):
    """
    What a filter made of a measurement.
    """
    accepted = 0
    gated = 1
    not_started = 4
    overlapping = 3
    too_old = 2
class FilterUpdate:
    """
    What a filter made of a measurement.
    """
    def __repr__(self) -> str:
        ...
    @property
    def accepted(self) -> bool:
        """
        Whether it was taken.
        """
    @property
    def nis(self) -> float:
        """
        Normalised innovation squared.
        """
    @property
    def nis_dof(self) -> int:
        """
        Its degrees of freedom.
        """
    @property
    def outcome(self) -> FilterOutcome:
        """
        A FilterOutcome.
        """
class PosePrediction:
    """
    Where a body is expected to be.
    """
    @property
    def body_from_world(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Pose, 4x4.
        """
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]:
        """
        (6, 6) [rotation, translation], left perturbation.
        """
    @property
    def time_s(self) -> float:
        """
        [s].
        """
    @property
    def velocity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        (6,) of body_from_world's left perturbation [rad/s, m/s].
        """
    @property
    def velocity_covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]:
        """
        (6, 6) of it.
        """
class PoseEstimate(PosePrediction):
    """
    Where a body is, and the biases of its inertial sensors.
    """
    @property
    def accelerometer_bias_m_s2(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) [m/s^2].
        """
    @property
    def gyro_bias_rad_s(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) [rad/s].
        """
class PlanarEstimate:
    """
    Where a vehicle is on its floor.
    """
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        (3, 3) of [x_m, y_m, heading_rad].
        """
    @property
    def gyro_bias_rad_s(self) -> float:
        """
        [rad/s].
        """
    @property
    def pose(self) -> PlanarPose:
        """
        PlanarPose.
        """
    @property
    def time_s(self) -> float:
        """
        [s].
        """
    @property
    def velocity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) forward, left, turn [m/s, m/s, rad/s].
        """
    @property
    def velocity_covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        (3, 3) of it.
        """
class PlanarFilterOptions:
    """
    How a vehicle moves on a floor.

    Keywords (and properties):
      height_m: of the body's origin above the world's z = 0 [m]
      height_sigma_m: of the floor, from image to image [m]
      tilt_sigma_rad: of roll and of pitch, alike [rad]
      acceleration_noise: forward, without odometry [m/s^2/sqrt(Hz)]
      lateral_noise: to the left, alike
      turn_acceleration_noise: alike [rad/s^2/sqrt(Hz)]
      gyro_noise: [rad/s/sqrt(Hz)]
      gyro_bias_sigma: at the start [rad/s]
      gyro_bias_walk: [rad/s^2/sqrt(Hz)]
      imu_hold_s: a sample is held so long [s]
      start_speed_sigma_m_s: at the start [m/s]
      start_turn_sigma_rad_s: at the start [rad/s]
      gate_sigma: an image beyond this contradicts the prediction
      history_s: measurements may be so late [s]
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, height_m: typing.SupportsFloat | typing.SupportsIndex = 0.0, height_sigma_m: typing.SupportsFloat | typing.SupportsIndex = 0.001, tilt_sigma_rad: typing.SupportsFloat | typing.SupportsIndex = 0.001, acceleration_noise: typing.SupportsFloat | typing.SupportsIndex = 0.5, lateral_noise: typing.SupportsFloat | typing.SupportsIndex = 0.1, turn_acceleration_noise: typing.SupportsFloat | typing.SupportsIndex = 1.0, gyro_noise: typing.SupportsFloat | typing.SupportsIndex = 0.002, gyro_bias_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.02, gyro_bias_walk: typing.SupportsFloat | typing.SupportsIndex = 0.0001, imu_hold_s: typing.SupportsFloat | typing.SupportsIndex = 0.05, start_speed_sigma_m_s: typing.SupportsFloat | typing.SupportsIndex = 1.0, start_turn_sigma_rad_s: typing.SupportsFloat | typing.SupportsIndex = 1.0, gate_sigma: typing.SupportsFloat | typing.SupportsIndex = 5.0, history_s: typing.SupportsFloat | typing.SupportsIndex = 2.0) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> PlanarFilterOptions:
        """
        A copy with the given fields changed.
        """
    @property
    def acceleration_noise(self) -> float:
        """
        forward, without odometry [m/s^2/sqrt(Hz)]
        """
    @property
    def gate_sigma(self) -> float:
        """
        an image beyond this contradicts the prediction
        """
    @property
    def gyro_bias_sigma(self) -> float:
        """
        at the start [rad/s]
        """
    @property
    def gyro_bias_walk(self) -> float:
        """
        [rad/s^2/sqrt(Hz)]
        """
    @property
    def gyro_noise(self) -> float:
        """
        [rad/s/sqrt(Hz)]
        """
    @property
    def height_m(self) -> float:
        """
        of the body's origin above the world's z = 0 [m]
        """
    @property
    def height_sigma_m(self) -> float:
        """
        of the floor, from image to image [m]
        """
    @property
    def history_s(self) -> float:
        """
        measurements may be so late [s]
        """
    @property
    def imu_hold_s(self) -> float:
        """
        a sample is held so long [s]
        """
    @property
    def lateral_noise(self) -> float:
        """
        to the left, alike
        """
    @property
    def start_speed_sigma_m_s(self) -> float:
        """
        at the start [m/s]
        """
    @property
    def start_turn_sigma_rad_s(self) -> float:
        """
        at the start [rad/s]
        """
    @property
    def tilt_sigma_rad(self) -> float:
        """
        of roll and of pitch, alike [rad]
        """
    @property
    def turn_acceleration_noise(self) -> float:
        """
        alike [rad/s^2/sqrt(Hz)]
        """
class PlanarFilter:
    """
    Where a vehicle on a floor is.

    An extended Kalman filter over SE(2) of wheel odometry, a gyroscope and what images say; late
    measurements count as if they had not been late.

    >>> import numpy as np
    >>> import libocc as occ
    >>> filter = occ.PlanarFilter()
    >>> filter.start(0, occ.PlanarPose(), 1e-6 * np.eye(3))
    >>> wheels = occ.PlanarOdometry(from_s=0, to_s=1, increment=occ.PlanarPose(x_m=0.5), covariance=1e-6 * np.eye(3))
    >>> filter.add(wheels).accepted, filter.at(0.5).pose
    (True, PlanarPose(x_m=0.25))
    """
    def __init__(self, options: PlanarFilterOptions = ...) -> None:
        ...
    @typing.overload
    def add(self, measurement: PlanarOdometry) -> FilterUpdate:
        """
        Takes odometry, an inertial sample or what an image says; may be late. Returns: FilterUpdate. Raises: ValueError for what is not finite, or times that do not rise.
        """
    @typing.overload
    def add(self, measurement: ImuSample) -> FilterUpdate:
        ...
    @typing.overload
    def add(self, measurement: PoseObservation) -> FilterUpdate:
        ...
    def at(self, time_s: typing.SupportsFloat | typing.SupportsIndex) -> PlanarEstimate | None:
        """
        Predicted to a time [s]; None before the start, or of a time that is forgotten.
        """
    def start(self, time_s: typing.SupportsFloat | typing.SupportsIndex, pose: PlanarPose, covariance: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"]) -> None:
        """
        Begins, or begins anew, at a PlanarPose with its covariance (3, 3).
        """
    @property
    def started(self) -> bool:
        """
        Whether it has a pose.
        """
class PoseFilterOptions:
    """
    How a body moves in space.

    Keywords (and properties):
      acceleration_noise: where no sensor tells [m/s^2/sqrt(Hz)]
      turn_acceleration_noise: alike [rad/s^2/sqrt(Hz)]
      gyro_noise: [rad/s/sqrt(Hz)]
      gyro_bias_sigma: at the start [rad/s]
      gyro_bias_walk: [rad/s^2/sqrt(Hz)]
      accelerometer_noise: [m/s^2/sqrt(Hz)]
      accelerometer_bias_sigma: at the start [m/s^2]
      accelerometer_bias_walk: [m/s^3/sqrt(Hz)]
      use_accelerometer: False: samples tell turns only
      gravity_m_s2: (3,) in the world [m/s^2]
      imu_hold_s: a sample is held so long [s]
      start_speed_sigma_m_s: at the start [m/s]
      start_turn_sigma_rad_s: at the start [rad/s]
      gate_sigma: an image beyond this contradicts the prediction
      history_s: measurements may be so late [s]
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, acceleration_noise: typing.SupportsFloat | typing.SupportsIndex = 0.6, turn_acceleration_noise: typing.SupportsFloat | typing.SupportsIndex = 1.0, gyro_noise: typing.SupportsFloat | typing.SupportsIndex = 0.002, gyro_bias_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.02, gyro_bias_walk: typing.SupportsFloat | typing.SupportsIndex = 0.0001, accelerometer_noise: typing.SupportsFloat | typing.SupportsIndex = 0.02, accelerometer_bias_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.1, accelerometer_bias_walk: typing.SupportsFloat | typing.SupportsIndex = 0.001, use_accelerometer: bool = True, gravity_m_s2: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = [0.0, 0.0, -9.80665], imu_hold_s: typing.SupportsFloat | typing.SupportsIndex = 0.05, start_speed_sigma_m_s: typing.SupportsFloat | typing.SupportsIndex = 1.0, start_turn_sigma_rad_s: typing.SupportsFloat | typing.SupportsIndex = 1.0, gate_sigma: typing.SupportsFloat | typing.SupportsIndex = 5.0, history_s: typing.SupportsFloat | typing.SupportsIndex = 2.0) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> PoseFilterOptions:
        """
        A copy with the given fields changed.
        """
    @property
    def acceleration_noise(self) -> float:
        """
        where no sensor tells [m/s^2/sqrt(Hz)]
        """
    @property
    def accelerometer_bias_sigma(self) -> float:
        """
        at the start [m/s^2]
        """
    @property
    def accelerometer_bias_walk(self) -> float:
        """
        [m/s^3/sqrt(Hz)]
        """
    @property
    def accelerometer_noise(self) -> float:
        """
        [m/s^2/sqrt(Hz)]
        """
    @property
    def gate_sigma(self) -> float:
        """
        an image beyond this contradicts the prediction
        """
    @property
    def gravity_m_s2(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) in the world [m/s^2]
        """
    @property
    def gyro_bias_sigma(self) -> float:
        """
        at the start [rad/s]
        """
    @property
    def gyro_bias_walk(self) -> float:
        """
        [rad/s^2/sqrt(Hz)]
        """
    @property
    def gyro_noise(self) -> float:
        """
        [rad/s/sqrt(Hz)]
        """
    @property
    def history_s(self) -> float:
        """
        measurements may be so late [s]
        """
    @property
    def imu_hold_s(self) -> float:
        """
        a sample is held so long [s]
        """
    @property
    def start_speed_sigma_m_s(self) -> float:
        """
        at the start [m/s]
        """
    @property
    def start_turn_sigma_rad_s(self) -> float:
        """
        at the start [rad/s]
        """
    @property
    def turn_acceleration_noise(self) -> float:
        """
        alike [rad/s^2/sqrt(Hz)]
        """
    @property
    def use_accelerometer(self) -> bool:
        """
        False: samples tell turns only
        """
class PoseFilter:
    """
    Where a body in space is.

    An error-state extended Kalman filter over SE(3) of odometry, gyroscope, accelerometer and what
    images of any number of cameras say; late measurements count as if they had not been late.
    """
    def __init__(self, options: PoseFilterOptions = ...) -> None:
        ...
    @typing.overload
    def add(self, measurement: Odometry) -> FilterUpdate:
        """
        Takes odometry, an inertial sample or what an image says; may be late. Returns: FilterUpdate. Raises: ValueError for what is not finite, or times that do not rise.
        """
    @typing.overload
    def add(self, measurement: ImuSample) -> FilterUpdate:
        ...
    @typing.overload
    def add(self, measurement: PoseObservation) -> FilterUpdate:
        ...
    def at(self, time_s: typing.SupportsFloat | typing.SupportsIndex) -> PoseEstimate | None:
        """
        Predicted to a time [s]; None before the start, or of a time that is forgotten.
        """
    def start(self, time_s: typing.SupportsFloat | typing.SupportsIndex, body_from_world: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], covariance: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 6]"]) -> None:
        """
        Begins, or begins anew, at a 4x4 pose, covariance (6, 6).
        """
    @property
    def started(self) -> bool:
        """
        Whether it has a pose.
        """
class TrackerState(enum.Enum):
    """
    Whether a tracker has a pose.
    """
    coasting = 2
    lost = 3
    searching = 0
    tracking = 1
class TrackedFrame:
    """
    Where the camera was when it took an image.

    While searching or lost there is no pose: its covariance is infinite.
    """
    def __repr__(self) -> str:
        ...
    @property
    def cam_from_world(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Pose, 4x4.
        """
    @property
    def camera(self) -> int:
        """
        Number of the camera.
        """
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]:
        """
        (6, 6) [rotation, translation], left perturbation.
        """
    @property
    def full_search(self) -> bool:
        """
        Whether the whole image was searched.
        """
    @property
    def lamps(self) -> dict[int, Blob]:
        """
        Lamp id -> Blob, of those the pose was made of.
        """
    @property
    def missing(self) -> list[int]:
        """
        Ids that should be in view and were not found.
        """
    @property
    def nis(self) -> float:
        """
        Normalised innovation squared of the lamps.
        """
    @property
    def nis_dof(self) -> int:
        """
        Its degrees of freedom.
        """
    @property
    def position_covariance_m2(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        (3, 3) of it.
        """
    @property
    def position_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) of the camera [m, world].
        """
    @property
    def reason(self) -> str:
        """
        A sentence; empty while all is as expected.
        """
    @property
    def relocated(self) -> bool:
        """
        The pose has jumped to where none expected it.
        """
    @property
    def state(self) -> TrackerState:
        """
        A TrackerState.
        """
    @property
    def time_s(self) -> float:
        """
        Of the image [s].
        """
    @property
    def timing_s(self) -> Timing:
        """
        Where the time went [s].
        """
class Tracker:
    """
    A camera's way through the lamps, image by image.

    scene: Scene. prior: what is known of the camera before the first image; its height and gravity
    hold for ever. cam_from_body: 4x4, how the camera is mounted.

    The filter predicts, lamps are looked for where that puts them, and what they say corrects it. A
    camera that has been carried off is found again, and the jump is said (`relocated`).

    >>> import libocc as occ
    >>> scene = occ.Scene.load("data/scenes/irregular_six.yaml")
    >>> pose = occ.look_at(position_m=[1.9, 2.1, 0.3], target_m=[1.9, 2.1, 3], up=[0, 1, 0])
    >>> tracker = occ.Tracker(scene)
    >>> image, truth = occ.simulate(scene, pose, seed=1)
    >>> frame = tracker.add_image(image, 0.0)
    >>> frame.state.name, frame.position_m.round(2).tolist()
    ('tracking', [1.9, 2.1, 0.3])
    """
    def __init__(self, scene: Scene, prior: Prior | None = None, *, cam_from_body: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"] = ..., filter: PoseFilterOptions = ..., floor: PlanarFilterOptions | None = None, windows: bool = True, gate_sigma: typing.SupportsFloat | typing.SupportsIndex = 4.0, gate_model_sigma_px: typing.SupportsFloat | typing.SupportsIndex = 0.5, coast_s: typing.SupportsFloat | typing.SupportsIndex = 1.0, coast_sigma_m: typing.SupportsFloat | typing.SupportsIndex = 0.5, drift_sigma_m: typing.SupportsFloat | typing.SupportsIndex = 0.3, drift_sigma_rad: typing.SupportsFloat | typing.SupportsIndex = 0.2, confirmations: typing.SupportsInt | typing.SupportsIndex = 3, sensor: Sensor | None = None, threshold_sigma: typing.SupportsFloat | typing.SupportsIndex = 5.0, threshold_dn: typing.SupportsFloat | typing.SupportsIndex | None = None, min_area_px: typing.SupportsInt | typing.SupportsIndex = 4, max_blobs: typing.SupportsInt | typing.SupportsIndex = 4096, rims: bool = True, stripes: bool | None = None, max_frequency_hz: typing.SupportsFloat | typing.SupportsIndex = 20000.0, rung: Rung = ..., flux: FluxModel = ..., model_sigma_px: typing.SupportsFloat | typing.SupportsIndex = 0.0, huber_sigma: typing.SupportsFloat | typing.SupportsIndex = 3.0, max_iterations: typing.SupportsInt | typing.SupportsIndex = 20, tolerance_px: typing.SupportsFloat | typing.SupportsIndex = 1e-05) -> None:
        """
        Options:
          filter: PoseFilterOptions of a body that moves in space
          floor: instead: PlanarFilterOptions of a vehicle on a floor
          windows: look for lamps where they are expected, not everywhere
          gate_sigma: a lamp and a blob agree within [sigma]
          gate_model_sigma_px: camera and map error in that gate [px]
          coast_s: without lamps the prediction is believed so long [s]
          coast_sigma_m: and while its sigma is smaller [m]
          drift_sigma_m: how far off it may be when odometry errs [m]
          drift_sigma_rad: alike [rad]
          confirmations: images that must agree on a pose that was not predicted
          sensor: Sensor for noise, full scale, stripes; None: estimate
          threshold_sigma: threshold above the background [its sigma]
          threshold_dn: absolute threshold [grey levels] instead
          min_area_px: smaller blobs are dropped [px]
          max_blobs: the brightest are kept
          rims: measure sub-pixel rims of discs
          stripes: join stripes, read frequencies; None: when rows have a time
          max_frequency_hz: stripes are read up to this [Hz]
          rung: what of the image the pose has to explain
          flux: whether lamps' brightness counts, and what is known of it
          model_sigma_px: camera and map error per lamp [px]
          huber_sigma: residuals beyond this weigh linearly [sigma]
          max_iterations: steps of the refinement
          tolerance_px: converged when no lamp moves further [px]
        """
    @typing.overload
    def add(self, measurement: Odometry) -> FilterUpdate:
        """
        Takes Odometry of a body in space, PlanarOdometry of a vehicle on a floor, or an ImuSample. Returns: FilterUpdate. Raises: RuntimeError for odometry of the other kind.
        """
    @typing.overload
    def add(self, measurement: PlanarOdometry) -> FilterUpdate:
        ...
    @typing.overload
    def add(self, measurement: ImuSample) -> FilterUpdate:
        ...
    def add_camera(self, scene: Scene, cam_from_body: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]) -> int:
        """
        A second camera on the same body. Returns: its number.
        """
    def add_image(self, image: numpy.typing.NDArray[numpy.uint8 | numpy.uint16], time_s: typing.SupportsFloat | typing.SupportsIndex, camera: typing.SupportsInt | typing.SupportsIndex = 0, cam_from_body: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"] | None = None) -> TrackedFrame:
        """
        Where the camera was at time_s, when the image's first line began its exposure.

        image: as locate() takes it. cam_from_body: of a camera that pans or tilts, how it stood.
        Returns: TrackedFrame. An image whose time is not after the last one's is left out, and said.
        Raises: ValueError for another size, a time that is not finite, a camera that there is not.
        """
    def planar(self, time_s: typing.SupportsFloat | typing.SupportsIndex) -> PlanarEstimate | None:
        """
        PlanarEstimate at a time [s], or None; of a vehicle on a floor.
        """
    def predict(self, time_s: typing.SupportsFloat | typing.SupportsIndex) -> PosePrediction | None:
        """
        PosePrediction of the body at a time [s], or None while there is no pose.
        """
    def start(self, time_s: typing.SupportsFloat | typing.SupportsIndex, body_from_world: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], covariance: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 6]"]) -> None:
        """
        Begins at a known pose (4x4; (6, 6)) instead of by a search.
        """
    @property
    def state(self) -> TrackerState:
        """
        A TrackerState.
        """
class Drive(enum.Enum):
    """
    How a vehicle drives and turns.
    """
    ackermann = 1
    differential = 0
class DriveNoise:
    """
    What disturbs wheels and their odometry; by default nothing. After a length d a wheel's error has the standard deviation k sqrt(d).

    Keywords (and properties):
      drive: wheels turn otherwise than asked, and report it [sqrt(m)]
      slip: the vehicle does not follow its wheels [sqrt(m)]
      slip_share: share of each wheel's travel that is lost, always
      sideways_slip: across the heading [sqrt(m)]
      odometry: of what a wheel reports [sqrt(m)]
      left_scale: what the left wheel reports over what it has turned
      right_scale: alike
      scale_sigma: of both scales, as the covariance knows it
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, drive: typing.SupportsFloat | typing.SupportsIndex = 0.0, slip: typing.SupportsFloat | typing.SupportsIndex = 0.0, slip_share: typing.SupportsFloat | typing.SupportsIndex = 0.0, sideways_slip: typing.SupportsFloat | typing.SupportsIndex = 0.0, odometry: typing.SupportsFloat | typing.SupportsIndex = 0.0, left_scale: typing.SupportsFloat | typing.SupportsIndex = 1.0, right_scale: typing.SupportsFloat | typing.SupportsIndex = 1.0, scale_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> DriveNoise:
        """
        A copy with the given fields changed.
        """
    @property
    def drive(self) -> float:
        """
        wheels turn otherwise than asked, and report it [sqrt(m)]
        """
    @property
    def left_scale(self) -> float:
        """
        what the left wheel reports over what it has turned
        """
    @property
    def odometry(self) -> float:
        """
        of what a wheel reports [sqrt(m)]
        """
    @property
    def right_scale(self) -> float:
        """
        alike
        """
    @property
    def scale_sigma(self) -> float:
        """
        of both scales, as the covariance knows it
        """
    @property
    def sideways_slip(self) -> float:
        """
        across the heading [sqrt(m)]
        """
    @property
    def slip(self) -> float:
        """
        the vehicle does not follow its wheels [sqrt(m)]
        """
    @property
    def slip_share(self) -> float:
        """
        share of each wheel's travel that is lost, always
        """
class Vehicle:
    """
    A vehicle's size, limits and noise.

    Keywords (and properties):
      drive: Drive
      track_m: between the two wheels that roll without steering [m]
      wheelbase_m: Ackermann: from the origin to the front axle [m]
      radius_m: of a disc about the origin that holds all of it [m]
      max_speed_m_s: backwards alike [m/s]
      max_acceleration_m_s2: braking alike [m/s^2]
      max_turn_rate_rad_s: differential drive [rad/s]
      max_turn_acceleration_rad_s2: [rad/s^2]
      max_steering_rad: Ackermann [rad]
      max_steering_rate_rad_s: Ackermann [rad/s]
      noise: DriveNoise
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, drive: Drive = ..., track_m: typing.SupportsFloat | typing.SupportsIndex = 0.4, wheelbase_m: typing.SupportsFloat | typing.SupportsIndex = 0.5, radius_m: typing.SupportsFloat | typing.SupportsIndex = 0.3, max_speed_m_s: typing.SupportsFloat | typing.SupportsIndex = 1.0, max_acceleration_m_s2: typing.SupportsFloat | typing.SupportsIndex = 0.5, max_turn_rate_rad_s: typing.SupportsFloat | typing.SupportsIndex = 1.5, max_turn_acceleration_rad_s2: typing.SupportsFloat | typing.SupportsIndex = 5.0, max_steering_rad: typing.SupportsFloat | typing.SupportsIndex = 0.6, max_steering_rate_rad_s: typing.SupportsFloat | typing.SupportsIndex = 1.5, noise: DriveNoise = ...) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> Vehicle:
        """
        A copy with the given fields changed.
        """
    @property
    def drive(self) -> Drive:
        """
        Drive
        """
    @property
    def max_acceleration_m_s2(self) -> float:
        """
        braking alike [m/s^2]
        """
    @property
    def max_speed_m_s(self) -> float:
        """
        backwards alike [m/s]
        """
    @property
    def max_steering_rad(self) -> float:
        """
        Ackermann [rad]
        """
    @property
    def max_steering_rate_rad_s(self) -> float:
        """
        Ackermann [rad/s]
        """
    @property
    def max_turn_acceleration_rad_s2(self) -> float:
        """
        [rad/s^2]
        """
    @property
    def max_turn_rate_rad_s(self) -> float:
        """
        differential drive [rad/s]
        """
    @property
    def noise(self) -> DriveNoise:
        """
        DriveNoise
        """
    @property
    def radius_m(self) -> float:
        """
        of a disc about the origin that holds all of it [m]
        """
    @property
    def track_m(self) -> float:
        """
        between the two wheels that roll without steering [m]
        """
    @property
    def wheelbase_m(self) -> float:
        """
        Ackermann: from the origin to the front axle [m]
        """
class DriveCommand:
    """
    What is asked of a vehicle.

    Keywords (and properties):
      speed_m_s: of the origin; negative: backwards [m/s]
      turn_rate_rad_s: differential drive [rad/s]
      steering_rad: Ackermann, left positive [rad]
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, speed_m_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, turn_rate_rad_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, steering_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> DriveCommand:
        """
        A copy with the given fields changed.
        """
    @property
    def speed_m_s(self) -> float:
        """
        of the origin; negative: backwards [m/s]
        """
    @property
    def steering_rad(self) -> float:
        """
        Ackermann, left positive [rad]
        """
    @property
    def turn_rate_rad_s(self) -> float:
        """
        differential drive [rad/s]
        """
class DriveState:
    """
    Where a vehicle is and how it moves.

    Keywords (and properties):
      time_s: [s]
      pose: PlanarPose
      speed_m_s: [m/s]
      turn_rate_rad_s: of the heading [rad/s]
      steering_rad: Ackermann [rad]
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, time_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, pose: PlanarPose = ..., speed_m_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, turn_rate_rad_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, steering_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> DriveState:
        """
        A copy with the given fields changed.
        """
    @property
    def pose(self) -> PlanarPose:
        """
        PlanarPose
        """
    @property
    def speed_m_s(self) -> float:
        """
        [m/s]
        """
    @property
    def steering_rad(self) -> float:
        """
        Ackermann [rad]
        """
    @property
    def time_s(self) -> float:
        """
        [s]
        """
    @property
    def turn_rate_rad_s(self) -> float:
        """
        of the heading [rad/s]
        """
class DriveLimited:
    """
    What was asked of a vehicle and is not to be had.

    Keywords (and properties):
      speed: beyond max_speed_m_s
      turn: beyond the turn rate or the steering angle
      acceleration: not at the step's end
      turn_change: not at the step's end
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, speed: bool = False, turn: bool = False, acceleration: bool = False, turn_change: bool = False) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> DriveLimited:
        """
        A copy with the given fields changed.
        """
    @property
    def acceleration(self) -> bool:
        """
        not at the step's end
        """
    @property
    def speed(self) -> bool:
        """
        beyond max_speed_m_s
        """
    @property
    def turn(self) -> bool:
        """
        beyond the turn rate or the steering angle
        """
    @property
    def turn_change(self) -> bool:
        """
        not at the step's end
        """
class DriveStep:
    """
    What came of a command.
    """
    @property
    def limited(self) -> DriveLimited:
        """
        DriveLimited.
        """
    @property
    def odometry(self) -> PlanarOdometry:
        """
        PlanarOdometry: what the wheels say.
        """
    @property
    def state(self) -> DriveState:
        """
        DriveState: the truth.
        """
class RouteShape(enum.Enum):
    """
    How way-points are joined.
    """
    lines = 0
    spline = 1
class RouteWaypoint:
    """
    Where a route leads.

    Keywords (and properties):
      position_m: (2,) [m]
      corner_radius_m: instead of the route's; 0: sharp [m]
      speed_m_s: from here on, instead of the one before [m/s]
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, position_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 1]"], corner_radius_m: typing.SupportsFloat | typing.SupportsIndex | None = None, speed_m_s: typing.SupportsFloat | typing.SupportsIndex | None = None) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> RouteWaypoint:
        """
        A copy with the given fields changed.
        """
    @property
    def corner_radius_m(self) -> float | None:
        """
        instead of the route's; 0: sharp [m]
        """
    @property
    def position_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 1]"]:
        """
        (2,) [m]
        """
    @property
    def speed_m_s(self) -> float | None:
        """
        from here on, instead of the one before [m/s]
        """
class RoutePlace:
    """
    A place on a route.
    """
    @property
    def along_m(self) -> float:
        """
        From the route's begin [m].
        """
    @property
    def curvature_1_m(self) -> float:
        """
        Left positive [1/m].
        """
    @property
    def deviation_m(self) -> float:
        """
        Of what was asked about, to the left of the route [m].
        """
    @property
    def pose(self) -> PlanarPose:
        """
        PlanarPose, heading along the route.
        """
    @property
    def speed_m_s(self) -> float:
        """
        [m/s].
        """
class Route:
    """
    Where a vehicle shall drive: lines and arcs, known by arc length.

    waypoints: (n, 2), or RouteWaypoints with their own corners and speeds. Raises: ValueError naming the
    way-point.

    >>> import libocc as occ
    >>> route = occ.Route([[1, 1], [3, 1], [3, 3]], corner_radius_m=0.5)
    >>> round(route.length_m, 3), route.at(0.5).pose
    (3.785, PlanarPose(x_m=1.5, y_m=1.0))

    Options:
      shape: RouteShape
      closed: the last way-point is followed by the first
      laps: of a closed route
      corner_radius_m: smaller where a line is too short for it [m]
      speed_m_s: at the first way-point [m/s]
      dock: PlanarPose where the vehicle shall stand at the end, or None
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    @typing.overload
    def __init__(self, waypoints: collections.abc.Sequence[RouteWaypoint], *, shape: RouteShape = ..., closed: bool = False, laps: typing.SupportsInt | typing.SupportsIndex = 1, corner_radius_m: typing.SupportsFloat | typing.SupportsIndex = 0.3, speed_m_s: typing.SupportsFloat | typing.SupportsIndex = 0.5, dock: PlanarPose | None = None) -> None:
        ...
    @typing.overload
    def __init__(self, waypoints: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]", "flags.c_contiguous"], *, shape: RouteShape = ..., closed: bool = False, laps: typing.SupportsInt | typing.SupportsIndex = 1, corner_radius_m: typing.SupportsFloat | typing.SupportsIndex = 0.3, speed_m_s: typing.SupportsFloat | typing.SupportsIndex = 0.5, dock: PlanarPose | None = None) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def at(self, along_m: typing.SupportsFloat | typing.SupportsIndex) -> RoutePlace:
        """
        RoutePlace; clipped to the route.
        """
    def nearest(self, position_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 1]"], near_m: typing.SupportsFloat | typing.SupportsIndex | None = None, window_m: typing.SupportsFloat | typing.SupportsIndex = 0.5) -> RoutePlace:
        """
        The nearest RoutePlace to position_m (2,); near_m: within window_m of that along it.
        """
    def sampled(self, step_m: typing.SupportsFloat | typing.SupportsIndex) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 5]"]:
        """
        (n, 5): along_m, x_m, y_m, heading_rad, curvature_1_m, at most step_m apart.
        """
    @property
    def dock(self) -> PlanarPose | None:
        """
        PlanarPose, or None.
        """
    @property
    def lap_m(self) -> float:
        """
        Of one lap [m].
        """
    @property
    def length_m(self) -> float:
        """
        Of all laps [m].
        """
    @property
    def waypoints(self) -> list[RouteWaypoint]:
        """
        RouteWaypoint each.
        """
class RouteConflict:
    """
    Where a vehicle would touch something.
    """
    @property
    def clearance_m(self) -> float:
        """
        There; negative: inside [m].
        """
    @property
    def from_m(self) -> float:
        """
        Along the route [m].
        """
    @property
    def position_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 1]"]:
        """
        (2,) where it comes nearest.
        """
    @property
    def to_m(self) -> float:
        """
        Along the route [m].
        """
    @property
    def what(self) -> str:
        """
        A wall or which box.
        """
class PaceOptions:
    """
    How fast a route is driven.

    Keywords (and properties):
      braking: share of the vehicle's acceleration to brake with
      slow_radius_m: curves sharper than this are driven slower [m]
      min_speed_m_s: at the very end and in the sharpest curve
      end_speed_m_s: at the route's end [m/s]
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, braking: typing.SupportsFloat | typing.SupportsIndex = 0.7, slow_radius_m: typing.SupportsFloat | typing.SupportsIndex = 0.0, min_speed_m_s: typing.SupportsFloat | typing.SupportsIndex = 0.02, end_speed_m_s: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> PaceOptions:
        """
        A copy with the given fields changed.
        """
    @property
    def braking(self) -> float:
        """
        share of the vehicle's acceleration to brake with
        """
    @property
    def end_speed_m_s(self) -> float:
        """
        at the route's end [m/s]
        """
    @property
    def min_speed_m_s(self) -> float:
        """
        at the very end and in the sharpest curve
        """
    @property
    def slow_radius_m(self) -> float:
        """
        curves sharper than this are driven slower [m]
        """
class PurePursuitOptions:
    """
    Regulated pure pursuit.

    Keywords (and properties):
      lookahead_s: times the speed: how far ahead [s]
      min_lookahead_m: [m]
      max_lookahead_m: [m]
      turn_on_spot_rad: differential drive: turns first when the route leads further aside
      pace: PaceOptions
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, lookahead_s: typing.SupportsFloat | typing.SupportsIndex = 0.2, min_lookahead_m: typing.SupportsFloat | typing.SupportsIndex = 0.1, max_lookahead_m: typing.SupportsFloat | typing.SupportsIndex = 0.6, turn_on_spot_rad: typing.SupportsFloat | typing.SupportsIndex = 0.8, pace: PaceOptions = ...) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> PurePursuitOptions:
        """
        A copy with the given fields changed.
        """
    @property
    def min_lookahead_m(self) -> float:
        """
        [m]
        """
    @property
    def lookahead_s(self) -> float:
        """
        times the speed: how far ahead [s]
        """
    @property
    def max_lookahead_m(self) -> float:
        """
        [m]
        """
    @property
    def pace(self) -> PaceOptions:
        """
        PaceOptions
        """
    @property
    def turn_on_spot_rad(self) -> float:
        """
        differential drive: turns first when the route leads further aside
        """
class StanleyOptions:
    """
    Stanley's controller.

    Keywords (and properties):
      gain_1_s: of the deviation [1/s]
      soft_m_s: added to the speed [m/s]
      yaw_damping_s: of the turn rate's error [s]
      preview_s: curvature is taken so far ahead; None: as it needs
      guide_point_m: ahead of the origin; wheelbase: as published
      virtual_wheelbase_m: of a differential drive [m]
      turn_on_spot_rad: of the heading error [rad]
      pace: PaceOptions
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, gain_1_s: typing.SupportsFloat | typing.SupportsIndex = 1.0, soft_m_s: typing.SupportsFloat | typing.SupportsIndex = 0.05, yaw_damping_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, preview_s: typing.SupportsFloat | typing.SupportsIndex | None = None, guide_point_m: typing.SupportsFloat | typing.SupportsIndex = 0.0, virtual_wheelbase_m: typing.SupportsFloat | typing.SupportsIndex = 0.15, turn_on_spot_rad: typing.SupportsFloat | typing.SupportsIndex = 0.8, pace: PaceOptions = ...) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> StanleyOptions:
        """
        A copy with the given fields changed.
        """
    @property
    def gain_1_s(self) -> float:
        """
        of the deviation [1/s]
        """
    @property
    def guide_point_m(self) -> float:
        """
        ahead of the origin; wheelbase: as published
        """
    @property
    def pace(self) -> PaceOptions:
        """
        PaceOptions
        """
    @property
    def preview_s(self) -> float | None:
        """
        curvature is taken so far ahead; None: as it needs
        """
    @property
    def soft_m_s(self) -> float:
        """
        added to the speed [m/s]
        """
    @property
    def turn_on_spot_rad(self) -> float:
        """
        of the heading error [rad]
        """
    @property
    def virtual_wheelbase_m(self) -> float:
        """
        of a differential drive [m]
        """
    @property
    def yaw_damping_s(self) -> float:
        """
        of the turn rate's error [s]
        """
class ControlOutput:
    """
    What a controller asks of a vehicle.
    """
    @property
    def at_end(self) -> bool:
        """
        The route's end is beside it or behind.
        """
    @property
    def command(self) -> DriveCommand:
        """
        DriveCommand.
        """
    @property
    def curve_limited(self) -> bool:
        """
        A sharper curve was needed.
        """
    @property
    def heading_error_rad(self) -> float:
        """
        Route less vehicle [rad].
        """
    @property
    def place(self) -> RoutePlace:
        """
        The route's nearest RoutePlace.
        """
    @property
    def speed_limited(self) -> bool:
        """
        The route asks for more.
        """
class DockPhase(enum.Enum):
    """
    How far docking has come.
    """
    align = 2
    approach = 0
    creep = 1
    docked = 4
    retreat = 3
class DockOptions:
    """
    Docking: Park and Kuipers' law, then creeping along the dock's axis.

    Keywords (and properties):
      k1: of the dock's heading
      k2: of the vehicle's
      beta: slows curves
      lambda_: slows curves
      approach_speed_m_s: [m/s]
      creep_distance_m: before the dock [m]
      creep_speed_m_s: [m/s]
      slowing_1_s: no faster than this times what is left [1/s]
      min_speed_m_s: [m/s]
      track_length_m: in which it comes to the axis [m]
      max_aside_m: when creeping begins; else it backs out [m]
      tolerance_m: along the axis [m]
      tolerance_rad: [rad]
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, k1: typing.SupportsFloat | typing.SupportsIndex = 1.0, k2: typing.SupportsFloat | typing.SupportsIndex = 3.0, beta: typing.SupportsFloat | typing.SupportsIndex = 0.4, lambda_: typing.SupportsFloat | typing.SupportsIndex = 2.0, approach_speed_m_s: typing.SupportsFloat | typing.SupportsIndex = 0.3, creep_distance_m: typing.SupportsFloat | typing.SupportsIndex = 0.3, creep_speed_m_s: typing.SupportsFloat | typing.SupportsIndex = 0.08, slowing_1_s: typing.SupportsFloat | typing.SupportsIndex = 1.0, min_speed_m_s: typing.SupportsFloat | typing.SupportsIndex = 0.01, track_length_m: typing.SupportsFloat | typing.SupportsIndex = 0.06, max_aside_m: typing.SupportsFloat | typing.SupportsIndex = 0.05, tolerance_m: typing.SupportsFloat | typing.SupportsIndex = 0.0002, tolerance_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0002) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> DockOptions:
        """
        A copy with the given fields changed.
        """
    @property
    def approach_speed_m_s(self) -> float:
        """
        [m/s]
        """
    @property
    def beta(self) -> float:
        """
        slows curves
        """
    @property
    def creep_distance_m(self) -> float:
        """
        before the dock [m]
        """
    @property
    def creep_speed_m_s(self) -> float:
        """
        [m/s]
        """
    @property
    def k1(self) -> float:
        """
        of the dock's heading
        """
    @property
    def k2(self) -> float:
        """
        of the vehicle's
        """
    @property
    def lambda_(self) -> float:
        """
        slows curves
        """
    @property
    def min_speed_m_s(self) -> float:
        """
        [m/s]
        """
    @property
    def max_aside_m(self) -> float:
        """
        when creeping begins; else it backs out [m]
        """
    @property
    def slowing_1_s(self) -> float:
        """
        no faster than this times what is left [1/s]
        """
    @property
    def tolerance_m(self) -> float:
        """
        along the axis [m]
        """
    @property
    def tolerance_rad(self) -> float:
        """
        [rad]
        """
    @property
    def track_length_m(self) -> float:
        """
        in which it comes to the axis [m]
        """
class DockOutput:
    """
    What docking asks of a vehicle.
    """
    @property
    def command(self) -> DriveCommand:
        """
        DriveCommand.
        """
    @property
    def curve_limited(self) -> bool:
        """
        A sharper curve was needed.
        """
    @property
    def in_dock(self) -> PlanarPose:
        """
        PlanarPose of the vehicle in the dock's frame.
        """
    @property
    def phase(self) -> DockPhase:
        """
        DockPhase, for the next call.
        """
    @property
    def speed_limited(self) -> bool:
        """
        More was asked than it can do.
        """
class FloorVisibility:
    """
    What is seen from n poses on a floor.
    """
    @property
    def heading_sigma_rad(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (n,) [rad].
        """
    @property
    def lamps(self) -> list[list[int]]:
        """
        Ids of the lamps wholly in view, a list for each pose.
        """
    @property
    def lamps_in_view(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (n,) how many.
        """
    @property
    def position_sigma_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (n,) root of the trace of the place's bound [m]; infinite where there is none.
        """
    @property
    def power_w(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (n,) of all lamps through the lens [W].
        """
class PlanStatus(enum.Enum):
    """
    Whether there is a plan.
    """
    blind = 1
    blocked = 2
    goal_blocked = 4
    ok = 0
    start_blocked = 3
class RoutePlan:
    """
    A route on which lamps stay in view, or where there is none.
    """
    @property
    def gaps(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 6]"]:
        """
        (n, 6) places without view: from and to along the route, from (x, y), to (x, y) [m].
        """
    @property
    def message(self) -> str:
        """
        Where and why there is none.
        """
    @property
    def ok(self) -> bool:
        """
        Whether there is one.
        """
    @property
    def route(self) -> Route | None:
        """
        Route; the least blind one when status is blind.
        """
    @property
    def seen_share(self) -> float:
        """
        Of the route's length.
        """
    @property
    def status(self) -> PlanStatus:
        """
        PlanStatus.
        """
class PanTiltPlan:
    """
    How a camera pans and tilts on the way along a route.

    knots: (n, 3), along_m, pan_rad, tilt_rad; straight between them.
    """
    def __getstate__(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        ...
    def __init__(self, knots: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]", "flags.c_contiguous"]) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"]) -> None:
        ...
    def at(self, along_m: typing.SupportsFloat | typing.SupportsIndex) -> tuple[float, float]:
        """
        (pan_rad, tilt_rad).
        """
    @property
    def knots(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        """
        (n, 3).
        """
class PanTiltResult:
    """
    A plan of pan and tilt, and where there is none.
    """
    @property
    def gaps(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 6]"]:
        """
        (n, 6) as RoutePlan.gaps.
        """
    @property
    def message(self) -> str:
        """
        Where there is none.
        """
    @property
    def ok(self) -> bool:
        """
        Whether there is one.
        """
    @property
    def plan(self) -> PanTiltPlan:
        """
        PanTiltPlan, the least blind one.
        """
    @property
    def seen_share(self) -> float:
        """
        Of the route's length.
        """
    @property
    def status(self) -> PlanStatus:
        """
        PlanStatus: ok or blind.
        """
class Follower(enum.Enum):
    """
    Which controller follows the route.
    """
    pure_pursuit = 0
    stanley = 1
class LoopEstimation(enum.Enum):
    """
    Who estimates the pose.
    """
    locate = 1
    tracker = 0
class LoopOutcome(enum.Enum):
    """
    How a run ended.
    """
    arrived = 0
    collision = 1
    lost = 2
    out_of_time = 3
class LampFailure:
    """
    A lamp that is dark for a while.

    Keywords (and properties):
      lamp: its id
      from_s: [s]
      to_s: [s]
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, lamp: typing.SupportsInt | typing.SupportsIndex, from_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, to_s: typing.SupportsFloat | typing.SupportsIndex = ...) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> LampFailure:
        """
        A copy with the given fields changed.
        """
    @property
    def from_s(self) -> float:
        """
        [s]
        """
    @property
    def lamp(self) -> int:
        """
        its id
        """
    @property
    def to_s(self) -> float:
        """
        [s]
        """
class OdometryLie:
    """
    Odometry that says something else than the wheels did.

    Keywords (and properties):
      from_s: [s]
      to_s: [s]
      scale: of the length
      turn_rate_rad_s: added [rad/s]
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, from_s: typing.SupportsFloat | typing.SupportsIndex, to_s: typing.SupportsFloat | typing.SupportsIndex, scale: typing.SupportsFloat | typing.SupportsIndex = 1.0, turn_rate_rad_s: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> OdometryLie:
        """
        A copy with the given fields changed.
        """
    @property
    def from_s(self) -> float:
        """
        [s]
        """
    @property
    def scale(self) -> float:
        """
        of the length
        """
    @property
    def to_s(self) -> float:
        """
        [s]
        """
    @property
    def turn_rate_rad_s(self) -> float:
        """
        added [rad/s]
        """
class Kidnapping:
    """
    The vehicle is lifted to another pose; nobody says so.

    Keywords (and properties):
      at_s: [s]
      to: PlanarPose
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, at_s: typing.SupportsFloat | typing.SupportsIndex, to: PlanarPose) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> Kidnapping:
        """
        A copy with the given fields changed.
        """
    @property
    def at_s(self) -> float:
        """
        [s]
        """
    @property
    def to(self) -> PlanarPose:
        """
        PlanarPose
        """
class ClockJump:
    """
    From then on the camera's clock is ahead.

    Keywords (and properties):
      at_s: [s]
      by_s: [s]
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, at_s: typing.SupportsFloat | typing.SupportsIndex, by_s: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> ClockJump:
        """
        A copy with the given fields changed.
        """
    @property
    def at_s(self) -> float:
        """
        [s]
        """
    @property
    def by_s(self) -> float:
        """
        [s]
        """
class LoopFaults:
    """
    What goes wrong in a closed loop; by default nothing.

    Keywords (and properties):
      latency_s: from an image's capture to its arrival [s]
      frame_loss: probability of each image
      frame_repeat: probability that an image comes twice
      lamp_failures: LampFailure each
      odometry_lies: OdometryLie each
      kidnappings: Kidnapping each
      clock_jumps: ClockJump each
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, latency_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, frame_loss: typing.SupportsFloat | typing.SupportsIndex = 0.0, frame_repeat: typing.SupportsFloat | typing.SupportsIndex = 0.0, lamp_failures: collections.abc.Sequence[LampFailure] = [], odometry_lies: collections.abc.Sequence[OdometryLie] = [], kidnappings: collections.abc.Sequence[Kidnapping] = [], clock_jumps: collections.abc.Sequence[ClockJump] = []) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> LoopFaults:
        """
        A copy with the given fields changed.
        """
    @property
    def clock_jumps(self) -> list[ClockJump]:
        """
        ClockJump each
        """
    @property
    def frame_loss(self) -> float:
        """
        probability of each image
        """
    @property
    def frame_repeat(self) -> float:
        """
        probability that an image comes twice
        """
    @property
    def kidnappings(self) -> list[Kidnapping]:
        """
        Kidnapping each
        """
    @property
    def lamp_failures(self) -> list[LampFailure]:
        """
        LampFailure each
        """
    @property
    def latency_s(self) -> float:
        """
        from an image's capture to its arrival [s]
        """
    @property
    def odometry_lies(self) -> list[OdometryLie]:
        """
        OdometryLie each
        """
class LoopOptions:
    """
    Of the closed loop.

    Keywords (and properties):
      vehicle: Vehicle
      vehicle_height_m: boxes above are driven under [m]
      follower: Follower
      pure_pursuit: PurePursuitOptions
      stanley: StanleyOptions
      docking: DockOptions
      estimation: LoopEstimation
      camera_place_m: (3,) on the vehicle, above the floor [m]
      camera_pan_rad: as camera_on_vehicle() has it
      camera_tilt_rad: alike
      pan_tilt: PanTiltPlan instead, by the way along the route
      pan_tilt_rate_rad_s: of each axis [rad/s]
      frame_rate_hz: [Hz]
      control_rate_hz: [Hz]
      clock_guard_s: images that come so much earlier or later tell that their clock jumped [s]
      image_noise: shot and read noise
      start: PlanarPose, the true one; None: the route's begin
      start_sigma_m: of the estimate's first error [m]
      start_sigma_rad: alike [rad]
      max_s: the run ends [s]
      max_lost_s: without a pose so long: the run ends [s]
      faults: LoopFaults
      seed: of everything random
      floor: PlanarFilterOptions of the tracker's floor
      gate_sigma: a lamp and a blob agree within [sigma]
      gate_model_sigma_px: camera and map error in that gate [px]
      coast_s: without lamps the prediction is believed so long [s]
      coast_sigma_m: and while its sigma is smaller [m]
      confirmations: images that must agree on an unforeseen pose
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, vehicle: Vehicle = ..., vehicle_height_m: typing.SupportsFloat | typing.SupportsIndex = 0.5, follower: Follower = ..., pure_pursuit: PurePursuitOptions = ..., stanley: StanleyOptions = ..., docking: DockOptions = ..., estimation: LoopEstimation = ..., camera_place_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = [0.0, 0.0, 1.5], camera_pan_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0, camera_tilt_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0, pan_tilt: PanTiltPlan | None = None, pan_tilt_rate_rad_s: typing.SupportsFloat | typing.SupportsIndex = 2.0, frame_rate_hz: typing.SupportsFloat | typing.SupportsIndex = 30.0, control_rate_hz: typing.SupportsFloat | typing.SupportsIndex = 100.0, clock_guard_s: typing.SupportsFloat | typing.SupportsIndex = 0.1, image_noise: bool = True, start: PlanarPose | None = None, start_sigma_m: typing.SupportsFloat | typing.SupportsIndex = 0.02, start_sigma_rad: typing.SupportsFloat | typing.SupportsIndex = 0.02, max_s: typing.SupportsFloat | typing.SupportsIndex = 600.0, max_lost_s: typing.SupportsFloat | typing.SupportsIndex = 10.0, faults: LoopFaults = ..., seed: typing.SupportsInt | typing.SupportsIndex = 0, floor: PlanarFilterOptions | None = ..., gate_sigma: typing.SupportsFloat | typing.SupportsIndex = 4.0, gate_model_sigma_px: typing.SupportsFloat | typing.SupportsIndex = 0.5, coast_s: typing.SupportsFloat | typing.SupportsIndex = 1.0, coast_sigma_m: typing.SupportsFloat | typing.SupportsIndex = 0.5, confirmations: typing.SupportsInt | typing.SupportsIndex = 3) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> LoopOptions:
        """
        A copy with the given fields changed.
        """
    @property
    def camera_pan_rad(self) -> float:
        """
        as camera_on_vehicle() has it
        """
    @property
    def camera_place_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) on the vehicle, above the floor [m]
        """
    @property
    def camera_tilt_rad(self) -> float:
        """
        alike
        """
    @property
    def clock_guard_s(self) -> float:
        """
        images that come so much earlier or later tell that their clock jumped [s]
        """
    @property
    def coast_s(self) -> float:
        """
        without lamps the prediction is believed so long [s]
        """
    @property
    def coast_sigma_m(self) -> float:
        """
        and while its sigma is smaller [m]
        """
    @property
    def confirmations(self) -> int:
        """
        images that must agree on an unforeseen pose
        """
    @property
    def control_rate_hz(self) -> float:
        """
        [Hz]
        """
    @property
    def docking(self) -> DockOptions:
        """
        DockOptions
        """
    @property
    def estimation(self) -> LoopEstimation:
        """
        LoopEstimation
        """
    @property
    def faults(self) -> LoopFaults:
        """
        LoopFaults
        """
    @property
    def floor(self) -> PlanarFilterOptions | None:
        """
        PlanarFilterOptions of the tracker's floor
        """
    @property
    def follower(self) -> Follower:
        """
        Follower
        """
    @property
    def frame_rate_hz(self) -> float:
        """
        [Hz]
        """
    @property
    def gate_model_sigma_px(self) -> float:
        """
        camera and map error in that gate [px]
        """
    @property
    def gate_sigma(self) -> float:
        """
        a lamp and a blob agree within [sigma]
        """
    @property
    def image_noise(self) -> bool:
        """
        shot and read noise
        """
    @property
    def max_lost_s(self) -> float:
        """
        without a pose so long: the run ends [s]
        """
    @property
    def max_s(self) -> float:
        """
        the run ends [s]
        """
    @property
    def pan_tilt(self) -> PanTiltPlan | None:
        """
        PanTiltPlan instead, by the way along the route
        """
    @property
    def pan_tilt_rate_rad_s(self) -> float:
        """
        of each axis [rad/s]
        """
    @property
    def pure_pursuit(self) -> PurePursuitOptions:
        """
        PurePursuitOptions
        """
    @property
    def seed(self) -> int:
        """
        of everything random
        """
    @property
    def stanley(self) -> StanleyOptions:
        """
        StanleyOptions
        """
    @property
    def start(self) -> PlanarPose | None:
        """
        PlanarPose, the true one; None: the route's begin
        """
    @property
    def start_sigma_m(self) -> float:
        """
        of the estimate's first error [m]
        """
    @property
    def start_sigma_rad(self) -> float:
        """
        alike [rad]
        """
    @property
    def vehicle(self) -> Vehicle:
        """
        Vehicle
        """
    @property
    def vehicle_height_m(self) -> float:
        """
        boxes above are driven under [m]
        """
class LoopMetrics:
    """
    What a run of the closed loop comes to.

    Keywords (and properties):
      duration_s: [s]
      driven_m: [m]
      cross_track_mean_m: of its magnitude, on the route [m]
      cross_track_rmse_m: [m]
      cross_track_max_m: [m]
      position_rmse_m: of the estimate [m]
      position_max_m: [m]
      heading_rmse_rad: [rad]
      heading_max_rad: [rad]
      final_error: PlanarPose in the frame of the dock or the end
      final_position_error_m: magnitude [m]
      final_heading_error_rad: magnitude [rad]
      frames: images captured
      availability: share of them that were tracked
      three_lamps: share whose pose was made of three lamps or more
      longest_outage_s: between tracked images [s]
      lost_s: without a pose [s]
      relocations: jumps of the pose that were confirmed
      clock_jumps: that were noticed
      nees: mean over the steps; 3 is expected
      nis_per_dof: over all images; 1 is expected
      frame_mean_s: time per image on this machine [s]
      frame_median_s: [s]
      frame_p99_s: [s]
      limited_steps: more was asked than the vehicle can do
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, duration_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, driven_m: typing.SupportsFloat | typing.SupportsIndex = 0.0, cross_track_mean_m: typing.SupportsFloat | typing.SupportsIndex = 0.0, cross_track_rmse_m: typing.SupportsFloat | typing.SupportsIndex = 0.0, cross_track_max_m: typing.SupportsFloat | typing.SupportsIndex = 0.0, position_rmse_m: typing.SupportsFloat | typing.SupportsIndex = 0.0, position_max_m: typing.SupportsFloat | typing.SupportsIndex = 0.0, heading_rmse_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0, heading_max_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0, final_error: PlanarPose = ..., final_position_error_m: typing.SupportsFloat | typing.SupportsIndex = 0.0, final_heading_error_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0, frames: typing.SupportsInt | typing.SupportsIndex = 0, availability: typing.SupportsFloat | typing.SupportsIndex = 0.0, three_lamps: typing.SupportsFloat | typing.SupportsIndex = 0.0, longest_outage_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, lost_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, relocations: typing.SupportsInt | typing.SupportsIndex = 0, clock_jumps: typing.SupportsInt | typing.SupportsIndex = 0, nees: typing.SupportsFloat | typing.SupportsIndex = 0.0, nis_per_dof: typing.SupportsFloat | typing.SupportsIndex = 0.0, frame_mean_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, frame_median_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, frame_p99_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, limited_steps: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> LoopMetrics:
        """
        A copy with the given fields changed.
        """
    @property
    def availability(self) -> float:
        """
        share of them that were tracked
        """
    @property
    def clock_jumps(self) -> int:
        """
        that were noticed
        """
    @property
    def cross_track_max_m(self) -> float:
        """
        [m]
        """
    @property
    def cross_track_mean_m(self) -> float:
        """
        of its magnitude, on the route [m]
        """
    @property
    def cross_track_rmse_m(self) -> float:
        """
        [m]
        """
    @property
    def driven_m(self) -> float:
        """
        [m]
        """
    @property
    def duration_s(self) -> float:
        """
        [s]
        """
    @property
    def final_error(self) -> PlanarPose:
        """
        PlanarPose in the frame of the dock or the end
        """
    @property
    def final_heading_error_rad(self) -> float:
        """
        magnitude [rad]
        """
    @property
    def final_position_error_m(self) -> float:
        """
        magnitude [m]
        """
    @property
    def frame_mean_s(self) -> float:
        """
        time per image on this machine [s]
        """
    @property
    def frame_median_s(self) -> float:
        """
        [s]
        """
    @property
    def frame_p99_s(self) -> float:
        """
        [s]
        """
    @property
    def frames(self) -> int:
        """
        images captured
        """
    @property
    def heading_max_rad(self) -> float:
        """
        [rad]
        """
    @property
    def heading_rmse_rad(self) -> float:
        """
        [rad]
        """
    @property
    def limited_steps(self) -> int:
        """
        more was asked than the vehicle can do
        """
    @property
    def longest_outage_s(self) -> float:
        """
        between tracked images [s]
        """
    @property
    def lost_s(self) -> float:
        """
        without a pose [s]
        """
    @property
    def nees(self) -> float:
        """
        mean over the steps; 3 is expected
        """
    @property
    def nis_per_dof(self) -> float:
        """
        over all images; 1 is expected
        """
    @property
    def position_max_m(self) -> float:
        """
        [m]
        """
    @property
    def position_rmse_m(self) -> float:
        """
        of the estimate [m]
        """
    @property
    def relocations(self) -> int:
        """
        jumps of the pose that were confirmed
        """
    @property
    def three_lamps(self) -> float:
        """
        share whose pose was made of three lamps or more
        """
class LoopResult:
    """
    A run of the closed loop.
    """
    def __repr__(self) -> str:
        ...
    @property
    def frames(self) -> dict[str, numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]]:
        """
        Columns by name, an entry for each image: captured_s, arrived_s, lost, state,
        lamps_in_view, lamps_used, nis, nis_dof, relocated, clock_jumped_s, taken_s.
        """
    @property
    def message(self) -> str:
        """
        What ended it.
        """
    @property
    def metrics(self) -> LoopMetrics:
        """
        LoopMetrics.
        """
    @property
    def ok(self) -> bool:
        """
        Whether it arrived.
        """
    @property
    def outcome(self) -> LoopOutcome:
        """
        LoopOutcome.
        """
    @property
    def records(self) -> dict[str, numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]]:
        """
        Columns by name, an entry for each control step: time_s; true_x_m, true_y_m,
        true_heading_rad; x_m, y_m, heading_rad of the estimate with covariance (n, 3, 3); state (0 searching,
        1 tracking, 2 coasting, 3 lost), lamps; along_m and deviation_m of the truth; speed_m_s,
        turn_rate_rad_s, steering_rad asked, limited; pan_rad, tilt_rad; docking; frames that arrived.
        """
class Layout(enum.Enum):
    """
    Where the points that a solver takes may lie.
    """
    any = 0
    coplanar = 1
    not_coplanar = 2
class Solver:
    """
    A pose solver: what it takes and where it fails.
    """
    def __repr__(self) -> str:
        ...
    @property
    def failures(self) -> str:
        """
        Where it is known to fail or to be slow.
        """
    @property
    def layout(self) -> Layout:
        """
        Of the points.
        """
    @property
    def max_candidates(self) -> int:
        """
        Returns so many poses at most.
        """
    @property
    def max_points(self) -> int:
        """
        Uses so many at most; 0: all.
        """
    @property
    def min_points(self) -> int:
        """
        Fewer are refused.
        """
    @property
    def name(self) -> str:
        """
        For solve_pose() and pose_candidates().
        """
    @property
    def needs_up(self) -> bool:
        """
        Takes the direction of gravity.
        """
    @property
    def source(self) -> str:
        """
        Paper, and package it comes from.
        """
    @property
    def takes_origins(self) -> bool:
        """
        Takes several cameras on a rig.
        """
class PoseCandidate:
    """
    A pose from which known points are seen as they are.
    """
    def __repr__(self) -> str:
        ...
    @property
    def cam_from_world(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Pose, 4x4.
        """
    @property
    def condition(self) -> float:
        """
        Errors of rotation [rad] and position / distance over those of the bearings [rad]; infinite at a double root.
        """
    @property
    def misfit_rad(self) -> float:
        """
        Largest angle between a bearing and the direction to its point.
        """
class PoseCandidates:
    """
    What a solver found, guarded.
    """
    def __repr__(self) -> str:
        ...
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
    @property
    def value(self) -> list[PoseCandidate]:
        """
        PoseCandidates, best first.
        """
class RobustPose:
    """
    A pose among wrong matches: the answer of robust_pose().

    What was found so far is there even when it is not ok: look at status and message.
    """
    def __repr__(self) -> str:
        ...
    @property
    def cam_from_world(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Pose, 4x4.
        """
    @property
    def candidates(self) -> list[Candidate]:
        """
        Every pose that fits the inliers, best first.
        """
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]:
        """
        (6, 6) of cam_from_world [rotation rad, translation m], left perturbation.
        """
    @property
    def inlier_ratio(self) -> float:
        """
        Of all points.
        """
    @property
    def inliers(self) -> numpy.typing.NDArray[numpy.bool]:
        """
        (n,) bool: the points that agree.
        """
    @property
    def iterations(self) -> int:
        """
        Samples drawn.
        """
    @property
    def log10_false_alarms(self) -> float:
        """
        How many poses as good as this chance alone would bring.
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def position_covariance_m2(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        (3, 3) of the position [m^2, world].
        """
    @property
    def position_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) of the camera [m, world].
        """
    @property
    def rms_px(self) -> float:
        """
        Of the inliers [px].
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
class AprilTag:
    """
    A tag found in an image.
    """
    def __repr__(self) -> str:
        ...
    @property
    def centre_px(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 1]"]:
        """
        (2,) where the diagonals meet.
        """
    @property
    def corners_px(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (4, 2) lower left, lower right, upper right, upper left, seen upright.
        """
    @property
    def covariance_px2(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (4, 2, 2) of the corners.
        """
    @property
    def decision_margin(self) -> float:
        """
        Mean grey levels (of 255) between a bit and its threshold.
        """
    @property
    def family(self) -> str:
        """
        That the number is of.
        """
    @property
    def hamming(self) -> int:
        """
        Bits that were corrected.
        """
    @property
    def homography(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        (3, 3) from the tag, corners at (-1, -1) to (1, 1), y up, to the image.
        """
    @property
    def id(self) -> int:
        """
        Its number.
        """
    @property
    def refined(self) -> bool:
        """
        False: too small; corners to 0.1 px.
        """
class RoadHeights:
    """
    Heights over the road, and where up is.

    Keywords (and properties):
      lamps_m: of the lamps [m]
      lamps_sigma_m: its standard deviation [m]
      camera_m: of the camera [m]
      camera_sigma_m: its standard deviation [m]
      up_in_cam: (3,) unit, camera frame
      up_sigma_rad: of its pitch [rad]
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, lamps_m: typing.SupportsFloat | typing.SupportsIndex = 0.65, lamps_sigma_m: typing.SupportsFloat | typing.SupportsIndex = 0.1, camera_m: typing.SupportsFloat | typing.SupportsIndex = 1.2, camera_sigma_m: typing.SupportsFloat | typing.SupportsIndex = 0.02, up_in_cam: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = [0.0, -1.0, 0.0], up_sigma_rad: typing.SupportsFloat | typing.SupportsIndex = 0.005) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> RoadHeights:
        """
        A copy with the given fields changed.
        """
    @property
    def camera_m(self) -> float:
        """
        of the camera [m]
        """
    @property
    def camera_sigma_m(self) -> float:
        """
        its standard deviation [m]
        """
    @property
    def lamps_m(self) -> float:
        """
        of the lamps [m]
        """
    @property
    def lamps_sigma_m(self) -> float:
        """
        its standard deviation [m]
        """
    @property
    def up_in_cam(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) unit, camera frame
        """
    @property
    def up_sigma_rad(self) -> float:
        """
        of its pitch [rad]
        """
class HeadlightDistance:
    """
    How far a car is: the answer of headlight_distance().

    A degenerate one tells the bearing alone: look at status and message.
    """
    def __repr__(self) -> str:
        ...
    @property
    def bearing_rad(self) -> float:
        """
        From the camera's z towards x [rad].
        """
    @property
    def direction_in_cam(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) unit.
        """
    @property
    def distance_m(self) -> float:
        """
        Mean [m].
        """
    @property
    def distance_of_yaw_m(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n,) distance if the yaw were that, from the images alone [m].
        """
    @property
    def high_m(self) -> float:
        """
        Upper end of it [m].
        """
    @property
    def low_m(self) -> float:
        """
        Lower end of the 95 % interval [m].
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def separation_rad(self) -> float:
        """
        Angle between the lamps [rad].
        """
    @property
    def separation_sigma_rad(self) -> float:
        """
        Of it.
        """
    @property
    def sigma_m(self) -> float:
        """
        Standard deviation [m].
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
    @property
    def yaw_density(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n,) of the yaw, given all that is known [1/rad].
        """
    @property
    def yaw_rad(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n,) nodes [rad].
        """
class VehiclePose:
    """
    Where a vehicle is and which way it faces.
    """
    def __repr__(self) -> str:
        ...
    @property
    def distance_m(self) -> float:
        """
        Of the vehicle's origin [m].
        """
    @property
    def pose(self) -> Candidate:
        """
        Candidate; its world is the vehicle's frame.
        """
    @property
    def sigma_m(self) -> float:
        """
        Its standard deviation [m].
        """
    @property
    def yaw_rad(self) -> float:
        """
        Of its x axis from the line to the camera [rad].
        """
    @property
    def yaw_sigma_rad(self) -> float:
        """
        Its standard deviation [rad].
        """
class VehiclePoses:
    """
    Every upright pose of a vehicle that fits.
    """
    def __repr__(self) -> str:
        ...
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
    @property
    def value(self) -> list[VehiclePose]:
        """
        VehiclePoses, best first.
        """
class SmootherFrame:
    """
    What one camera saw at one time.

    Keywords: time_s; camera; points_in_world_m: (n, 3), points whose names are known; points_px: (n, 2),
      where they were seen; sigma_px: of each pixel coordinate, a number; covariances_px2: (n, 2, 2)
      instead; cam_from_body: 4x4, how the camera is mounted. Without points it asks for the pose at that
      time. Several frames of one time are several cameras.
    Raises: ValueError for counts that differ, numbers that are not finite, no positive sigma.
    """
    def __init__(self, *, time_s: typing.SupportsFloat | typing.SupportsIndex, camera: Camera = ..., points_in_world_m: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]", "flags.c_contiguous"] | None = None, points_px: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]", "flags.c_contiguous"] | None = None, sigma_px: typing.SupportsFloat | typing.SupportsIndex = 0.3, covariances_px2: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None, cam_from_body: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"] = ...) -> None:
        ...
    def __len__(self) -> int:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def cam_from_body(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        4x4.
        """
    @property
    def camera(self) -> Camera:
        """
        A Camera.
        """
    @property
    def time_s(self) -> float:
        """
        [s].
        """
class PlanarPrior:
    """
    What is known of a pose on a floor.
    """
    def __init__(self, *, time_s: typing.SupportsFloat | typing.SupportsIndex, pose: PlanarPose, covariance: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"]) -> None:
        ...
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        (3, 3) of [x_m, y_m, heading_rad].
        """
    @property
    def pose(self) -> PlanarPose:
        """
        PlanarPose.
        """
    @property
    def time_s(self) -> float:
        """
        [s].
        """
class OdometryLink:
    """
    Between one smoothed pose and the next.
    """
    def __repr__(self) -> str:
        ...
    @property
    def chi2(self) -> float:
        """
        Of the step against all the rest; 0: that cannot tell.
        """
    @property
    def contradicted(self) -> bool:
        """
        Whether the rest contradicts it.
        """
    @property
    def dof(self) -> int:
        """
        Components of the step that the rest can tell.
        """
    @property
    def factor(self) -> float:
        """
        By which its covariance was multiplied.
        """
    @property
    def from_s(self) -> float:
        """
        [s].
        """
    @property
    def odometry(self) -> bool:
        """
        False: there was none.
        """
    @property
    def to_s(self) -> float:
        """
        [s].
        """
class Smoothing:
    """
    Poses over time: the answer of smooth().

    What was found is there even when it is not ok: look at status, message and determined.
    """
    def __len__(self) -> int:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def beyond(self) -> int:
        """
        How many of them count less, or are outside the camera's domain.
        """
    @property
    def body_from_world(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n, 4, 4).
        """
    @property
    def chi2(self) -> float:
        """
        The minimum.
        """
    @property
    def covariances(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n, 6, 6) of body_from_world [rotation rad, translation m], left perturbation; infinite on the diagonal of what is not determined.
        """
    @property
    def determined(self) -> numpy.typing.NDArray[numpy.bool]:
        """
        (n,) bool: whether a pose is determined; the others have no meaning.
        """
    @property
    def dof(self) -> int:
        """
        Its degrees of freedom.
        """
    @property
    def iterations(self) -> int:
        """
        Of the minimisation.
        """
    @property
    def links(self) -> list[OdometryLink]:
        """
        OdometryLink between the poses.
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def outside(self) -> int:
        """
        How many are outside the camera's domain.
        """
    @property
    def position_covariances_m2(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n, 3, 3) [m^2, world].
        """
    @property
    def positions_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        (n, 3) of the body [m, world].
        """
    @property
    def residual_sigmas(self) -> list[list[float]]:
        """
        For each frame a list: each sighting's residual in its sigmas; infinite outside the domain.
        """
    @property
    def rms_px(self) -> float:
        """
        Of the coordinates of all others [px].
        """
    @property
    def sightings(self) -> int:
        """
        How many.
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
    @property
    def times_s(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (n,) of the poses [s].
        """
class PlanarSmoothing:
    """
    Poses on a floor over time: the answer of smooth_planar().
    """
    def __len__(self) -> int:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def beyond(self) -> int:
        """
        How many of them count less, or are outside the camera's domain.
        """
    @property
    def chi2(self) -> float:
        """
        The minimum.
        """
    @property
    def covariances(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n, 3, 3) of [x_m, y_m, heading_rad]; infinite on the diagonal of what is not determined.
        """
    @property
    def determined(self) -> numpy.typing.NDArray[numpy.bool]:
        """
        (n,) bool: whether a pose is determined; the others have no meaning.
        """
    @property
    def dof(self) -> int:
        """
        Its degrees of freedom.
        """
    @property
    def iterations(self) -> int:
        """
        Of the minimisation.
        """
    @property
    def links(self) -> list[OdometryLink]:
        """
        OdometryLink between the poses.
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def outside(self) -> int:
        """
        How many are outside the camera's domain.
        """
    @property
    def poses(self) -> list[PlanarPose]:
        """
        PlanarPose each.
        """
    @property
    def residual_sigmas(self) -> list[list[float]]:
        """
        For each frame a list: each sighting's residual in its sigmas; infinite outside the domain.
        """
    @property
    def rms_px(self) -> float:
        """
        Of the coordinates of all others [px].
        """
    @property
    def sightings(self) -> int:
        """
        How many.
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
    @property
    def times_s(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (n,) of the poses [s].
        """
class WindowEstimate:
    """
    The newest pose, and the window behind it.
    """
    @property
    def body_from_world(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Of the newest pose, 4x4.
        """
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]:
        """
        (6, 6) of it [rotation rad, translation m], left perturbation.
        """
    @property
    def determined(self) -> bool:
        """
        Whether the newest pose is determined.
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def position_covariance_m2(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        (3, 3) [m^2, world].
        """
    @property
    def position_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) [m, world].
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
    @property
    def time_s(self) -> float:
        """
        Of the newest pose [s].
        """
    @property
    def used(self) -> bool:
        """
        False: what came was before the window.
        """
    @property
    def window(self) -> Smoothing:
        """
        All poses of the window, oldest first.
        """
class PlanarWindowEstimate:
    """
    The newest pose, and the window behind it.
    """
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        (3, 3) of [x_m, y_m, heading_rad].
        """
    @property
    def determined(self) -> bool:
        """
        Whether the newest pose is determined.
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def pose(self) -> PlanarPose:
        """
        The newest PlanarPose.
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
    @property
    def time_s(self) -> float:
        """
        Of the newest pose [s].
        """
    @property
    def used(self) -> bool:
        """
        False: what came was before the window.
        """
    @property
    def window(self) -> PlanarSmoothing:
        """
        All poses of the window, oldest first.
        """
class WindowSmoother:
    """
    The newest poses of a body as frames arrive (fixed lag).

    Keeps the last few poses and what all before them say of the oldest; memory and time per frame do not
    grow. Frames inside the window may come late; one at a time that is there already is a second camera.
    add_frame() and add_observation() return the newest pose and the window; add_odometry() whether it is
    used (odometry that starts before the end of the last is not).

    Keywords:
      poses: in the window
      huber_sigmas: a sighting further off counts less; 0: least squares
      link_gate: probability that a right odometry step is called a lie; 0: never
      min_odometry_sigma_m: added to each odometry step's sigmas [m]
      min_odometry_sigma_rad: alike [rad]
      walk_m: how far the body may go in a second without odometry; grows as sqrt(time) [m]
      walk_rad: alike, how far it may turn [rad]
      max_iterations: in each round of gating
    """
    def __init__(self, poses: typing.SupportsInt | typing.SupportsIndex = 10, *, huber_sigmas: typing.SupportsFloat | typing.SupportsIndex = 3.0, link_gate: typing.SupportsFloat | typing.SupportsIndex = 1e-05, min_odometry_sigma_m: typing.SupportsFloat | typing.SupportsIndex = 1e-05, min_odometry_sigma_rad: typing.SupportsFloat | typing.SupportsIndex = 1e-06, walk_m: typing.SupportsFloat | typing.SupportsIndex = ..., walk_rad: typing.SupportsFloat | typing.SupportsIndex = ..., max_iterations: typing.SupportsInt | typing.SupportsIndex = 60) -> None:
        ...
    def add_frame(self, frame: SmootherFrame) -> WindowEstimate:
        """
        Takes a SmootherFrame. Returns: the newest pose and the window.
        """
    def add_observation(self, observation: PoseObservation) -> WindowEstimate:
        """
        Takes a PoseObservation, or what is known of a pose beforehand.
        """
    def add_odometry(self, odometry: Odometry) -> bool:
        """
        Takes odometry, in the order of time. Returns: whether it is used.
        """
    def restart(self) -> None:
        """
        Forgets everything, e.g. after the clock was set back.
        """
class PlanarWindowSmoother:
    """
    The newest poses of a body as frames arrive (fixed lag).

    Keeps the last few poses and what all before them say of the oldest; memory and time per frame do not
    grow. Frames inside the window may come late; one at a time that is there already is a second camera.
    add_frame() and add_observation() return the newest pose and the window; add_odometry() whether it is
    used (odometry that starts before the end of the last is not).

    Keywords:
      poses: in the window
      huber_sigmas: a sighting further off counts less; 0: least squares
      link_gate: probability that a right odometry step is called a lie; 0: never
      min_odometry_sigma_m: added to each odometry step's sigmas [m]
      min_odometry_sigma_rad: alike [rad]
      walk_m: how far the body may go in a second without odometry; grows as sqrt(time) [m]
      walk_rad: alike, how far it may turn [rad]
      max_iterations: in each round of gating
      height_m: of the body's origin; it stands upright
    """
    def __init__(self, poses: typing.SupportsInt | typing.SupportsIndex = 10, height_m: typing.SupportsFloat | typing.SupportsIndex = 0.0, *, huber_sigmas: typing.SupportsFloat | typing.SupportsIndex = 3.0, link_gate: typing.SupportsFloat | typing.SupportsIndex = 1e-05, min_odometry_sigma_m: typing.SupportsFloat | typing.SupportsIndex = 1e-05, min_odometry_sigma_rad: typing.SupportsFloat | typing.SupportsIndex = 1e-06, walk_m: typing.SupportsFloat | typing.SupportsIndex = ..., walk_rad: typing.SupportsFloat | typing.SupportsIndex = ..., max_iterations: typing.SupportsInt | typing.SupportsIndex = 60) -> None:
        ...
    def add_frame(self, frame: SmootherFrame) -> PlanarWindowEstimate:
        """
        Takes a SmootherFrame. Returns: the newest pose and the window.
        """
    def add_observation(self, observation: PoseObservation) -> PlanarWindowEstimate:
        """
        Takes a PoseObservation, or what is known of a pose beforehand.
        """
    def add_odometry(self, odometry: PlanarOdometry) -> bool:
        """
        Takes odometry, in the order of time. Returns: whether it is used.
        """
    def add_prior(self, prior: PlanarPrior) -> PlanarWindowEstimate:
        """
        Takes a PlanarPrior.
        """
    def restart(self) -> None:
        """
        Forgets everything, e.g. after the clock was set back.
        """
class Consistency(enum.Enum):
    """
    Whether covariances are those of the errors.
    """
    consistent = 0
    optimistic = 1
    pessimistic = 2
class ConsistencyReport:
    """
    Means of NEES or NIS in units of their expectation, 1 of a consistent estimator.
    """
    def __repr__(self) -> str:
        ...
    @property
    def count(self) -> int:
        """
        Values.
        """
    @property
    def effective_dof(self) -> float:
        """
        Of the mean's interval.
        """
    @property
    def high(self) -> float:
        """
        Alike.
        """
    @property
    def high_at(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (times,) alike.
        """
    @property
    def low(self) -> float:
        """
        End of the mean's interval.
        """
    @property
    def low_at(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (times,) interval of mean_at.
        """
    @property
    def mean(self) -> float:
        """
        Over all values.
        """
    @property
    def mean_at(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (times,) over the runs.
        """
    @property
    def share_inside(self) -> float:
        """
        Of the times, inside their intervals.
        """
    @property
    def verdict(self) -> Consistency:
        """
        A Consistency.
        """
class ResponseMethod(enum.Enum):
    """
    How a response is described.
    """
    basis = 1
    levels = 0
class ChannelResponse:
    """
    The response curve of one channel.

    log_exposure is g(level) = ln(light x time), 0 at the middle level: light has no scale here.
    """
    def __repr__(self) -> str:
        ...
    def table(self, samples: typing.SupportsInt | typing.SupportsIndex = 1024) -> list[float]:
        """
        Stored values 0..1 at evenly spaced linear ones, for Sensor(response_table=).
        """
    @property
    def black_level_dn(self) -> float:
        """
        Stored level without light.
        """
    @property
    def chi2(self) -> float:
        """
        Of the residuals.
        """
    @property
    def coefficient_covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Theirs.
        """
    @property
    def coefficients(self) -> list[float]:
        """
        Of the basis; empty for `levels`.
        """
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        (n, n) of log_exposure.
        """
    @property
    def dof(self) -> int:
        """
        Observations minus parameters.
        """
    @property
    def full_scale_dn(self) -> float:
        """
        Highest stored level.
        """
    @property
    def highest_dn(self) -> float:
        """
        Highest level seen; above it extrapolated.
        """
    @property
    def level_dn(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (n,) levels, rising.
        """
    @property
    def log_exposure(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (n,) g at the levels, not falling.
        """
    @property
    def lowest_dn(self) -> float:
        """
        Lowest level seen; below it extrapolated.
        """
    @property
    def projected(self) -> int:
        """
        Levels moved to make the curve rise.
        """
    @property
    def residuals(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 7]"]:
        """
        (m, 7) image, x, y [px], level [dn], log exposure, residual, sigma.
        """
    @property
    def sigma(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (n,) standard deviation of log_exposure.
        """
    @property
    def variance_factor(self) -> float:
        """
        Contained in covariance; 1 unless chi2 is too large for chance.
        """
class RecoveredResponse:
    """
    A camera's response curves, by channel.
    """
    def __repr__(self) -> str:
        ...
    def sensor(self, sensor: Sensor, samples: typing.SupportsInt | typing.SupportsIndex = 1024) -> Sensor:
        """
        The sensor with this response as tables. Three channels (blue, green, red) take one with a mosaic.
        """
    @property
    def channels(self) -> list[ChannelResponse]:
        """
        ChannelResponse of each channel, in the images' order.
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
class PowerFit(enum.Enum):
    """
    Which of the lamps' powers are unknown.
    """
    common_factor = 1
    each = 0
class FluxUse(enum.Enum):
    """
    What became of a lamp's flux in an image.
    """
    blinks = 8
    cut = 6
    hidden = 2
    merged = 7
    no_blob = 3
    not_alone = 4
    out_of_view = 1
    saturated = 5
    used = 0
class LampFlux:
    """
    A lamp's flux in one image.
    """
    def __repr__(self) -> str:
        ...
    @property
    def cos_emission(self) -> float:
        """
        Of the angle from its normal.
        """
    @property
    def flux_dn(self) -> float:
        """
        Sum of linear grey levels.
        """
    @property
    def image(self) -> int:
        """
        Index of the image.
        """
    @property
    def residual(self) -> float:
        """
        ln of seen over predicted.
        """
    @property
    def sigma(self) -> float:
        """
        Of the residual.
        """
    @property
    def use(self) -> FluxUse:
        """
        Used, or why not.
        """
class LampLight:
    """
    Power and Lambertian order of one lamp.
    """
    def __repr__(self) -> str:
        ...
    @property
    def chi2(self) -> float:
        """
        Of the fluxes, robust.
        """
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 2]"]:
        """
        (2, 2) of (ln power, order).
        """
    @property
    def dof(self) -> int:
        """
        Fluxes minus parameters.
        """
    @property
    def fluxes(self) -> list[LampFlux]:
        """
        LampFlux of each image.
        """
    @property
    def id(self) -> int:
        """
        The lamp's.
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def order(self) -> float:
        """
        Lambertian; the scene's when not determined.
        """
    @property
    def power_w(self) -> float:
        """
        [W]; the scene's when not found.
        """
    @property
    def status(self) -> Status:
        """
        ok; no_lamps: used in no image; degenerate: order not determined.
        """
    @property
    def variance_factor(self) -> float:
        """
        Contained in covariance; 1 unless chi2 is too large for chance.
        """
class CommonFactor:
    """
    Of all the scene's powers.
    """
    def __repr__(self) -> str:
        ...
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        (1 + lamps, 1 + lamps) of (ln value, orders); inf: order not determined.
        """
    @property
    def value(self) -> float:
        """
        The powers are the scene's times this.
        """
class CalibratedLight:
    """
    The light of a scene's lamps.
    """
    def __repr__(self) -> str:
        ...
    @property
    def factor(self) -> CommonFactor | None:
        """
        CommonFactor with powers=PowerFit.common_factor, else None.
        """
    @property
    def lamps(self) -> list[LampLight]:
        """
        LampLight of each lamp, in the scene's order.
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def scene(self) -> Scene:
        """
        The scene with the lamps' light where it is ok.
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
class AmbientImage:
    """
    What one image says of the ambient light.
    """
    def __repr__(self) -> str:
        ...
    @property
    def irradiance_w_m2(self) -> float:
        """
        [W/m^2] on the sensor.
        """
    @property
    def left_out(self) -> str:
        """
        Why it does not count; empty: it does.
        """
    @property
    def pixels(self) -> int:
        """
        That no lamp reaches.
        """
    @property
    def sigma_w_m2(self) -> float:
        """
        Of its pixels' noise.
        """
class AmbientLight:
    """
    Light on the sensor that comes from no lamp.
    """
    def __repr__(self) -> str:
        ...
    @property
    def chi2(self) -> float:
        """
        Of the images' irradiances.
        """
    @property
    def dof(self) -> int:
        """
        Images that count, minus one.
        """
    @property
    def images(self) -> list[AmbientImage]:
        """
        AmbientImages.
        """
    @property
    def irradiance_w_m2(self) -> float:
        """
        [W/m^2] on the sensor.
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
    @property
    def variance_factor(self) -> float:
        """
        Contained in the variance; 1 unless chi2 is too large for chance.
        """
    @property
    def variance_w2_m4(self) -> float:
        """
        Of it; inf when it is not determined.
        """
class Target:
    """
    A point of a network, or a corner of a body.

    >>> import libocc as occ
    >>> occ.Target.point(3) == occ.Target.point(3)
    True
    """
    @staticmethod
    def corner(body: typing.SupportsInt | typing.SupportsIndex, corner: typing.SupportsInt | typing.SupportsIndex) -> Target:
        """
        Of a body, by their indices.
        """
    @staticmethod
    def point(point: typing.SupportsInt | typing.SupportsIndex) -> Target:
        """
        By its index.
        """
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __hash__(self) -> int:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def body_index(self) -> int:
        """
        -1: a point.
        """
    @property
    def corner_index(self) -> int:
        """
        Of the body.
        """
    @property
    def point_index(self) -> int:
        """
        -1: a corner.
        """
class Network:
    """
    Cameras, where they stood and what they saw.

    Built piece by piece; every add_ method returns an index. Lengths in metres, starts need not be good.

    >>> import libocc as occ, numpy as np
    >>> camera = occ.Camera.pinhole(width=640, height=480, fx_px=500, fy_px=500, cx_px=320, cy_px=240)
    >>> network = occ.Network()
    >>> main = network.add_camera("main", camera, ["fx_px", "fy_px"])
    >>> image = network.add_image("a.png", main, np.eye(4))
    >>> lamp = network.add_point("lamp", [0.1, 0, 2])
    >>> network.observe(image, [occ.Target.point(lamp)], [[345, 240]], 0.1)
    >>> network
    <Network: 1 images, 1 points, 0 bodies, 1 observations>
    """
    def __init__(self) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def add_body(self, name: str, corners_m: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]", "flags.c_contiguous"], world_from_body: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], *, scale_free: bool = False, fixed: bool = False) -> int:
        """
        Points (n, 3) of known shape; scale_free: of unknown size. Returns its index.
        """
    def add_camera(self, name: str, camera: Camera, free_parameters: collections.abc.Sequence[str] = []) -> int:
        """
        Returns its index. free_parameters: names in camera.parameters that are unknown.
        """
    def add_control(self, target: Target, position_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], covariance_m2: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"]) -> None:
        """
        A target whose position is known.
        """
    def add_distance(self, from_: Target, to: Target, length_m: typing.SupportsFloat | typing.SupportsIndex, sigma_m: typing.SupportsFloat | typing.SupportsIndex) -> None:
        """
        A measured distance, a scale bar.
        """
    def add_image(self, name: str, camera: typing.SupportsInt | typing.SupportsIndex, cam_from_world: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"] | None = None, *, station: typing.SupportsInt | typing.SupportsIndex | None = None, mount: typing.SupportsInt | typing.SupportsIndex = -1) -> int:
        """
        By a start of its pose (4x4), or from a station through a mount; returns its index.
        """
    def add_mount(self, name: str, cam_from_station: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], fixed: bool = False) -> int:
        """
        Of a camera on a rig; returns its index.
        """
    def add_parameter_prior(self, camera: typing.SupportsInt | typing.SupportsIndex, parameter: str, value: typing.SupportsFloat | typing.SupportsIndex, sigma: typing.SupportsFloat | typing.SupportsIndex) -> None:
        """
        What is known of a camera's parameter.
        """
    def add_point(self, name: str, position_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], fixed: bool = False) -> int:
        """
        With a start of its position; returns its index.
        """
    def add_pose_prior(self, station: typing.SupportsInt | typing.SupportsIndex, station_from_world: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], covariance: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 6]"]) -> None:
        """
        What is known of a station's pose (left perturbation).
        """
    def add_station(self, name: str, station_from_world: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], fixed: bool = False) -> int:
        """
        Where a rig stood; returns its index.
        """
    def cam_from_world(self, image: typing.SupportsInt | typing.SupportsIndex) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Pose of an image, 4x4.
        """
    def check(self) -> None:
        """
        Raises: ValueError naming what is wrong.
        """
    def copy(self) -> Network:
        """
        A network of its own.
        """
    def drop(self, observations: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]) -> None:
        """
        Does not use these any more; they stay in the list.
        """
    def name_of(self, target: Target) -> str:
        """
        A point's name, or a corner's with its number.
        """
    def observe(self, image: typing.SupportsInt | typing.SupportsIndex, targets: collections.abc.Sequence[Target], pixels: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]", "flags.c_contiguous"], sigma_px: typing.Any = 0.5) -> None:
        """
        Where Targets were seen in an image: (n, 2); sigma_px of both axes, or (2,).
        """
    def position_m(self, target: Target) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Where a target is (3,) [m].
        """
    def set_camera(self, camera: typing.SupportsInt | typing.SupportsIndex, model: Camera, free_parameters: collections.abc.Sequence[str]) -> None:
        """
        Replaces a camera's start and the names of its unknown parameters.
        """
    def shift_observation(self, observation: typing.SupportsInt | typing.SupportsIndex, shift_px: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 1]"]) -> None:
        """
        Moves it, to make a gross error.
        """
    @property
    def body_corners_m(self) -> list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]]:
        """
        Corners (n, 3) of each body, in its frame.
        """
    @property
    def body_names(self) -> list[str]:
        """
        Of the bodies.
        """
    @property
    def body_poses(self) -> list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]]:
        """
        world_from_body of each, 4x4.
        """
    @property
    def body_scales(self) -> list[float]:
        """
        Scale of each body.
        """
    @property
    def camera_names(self) -> list[str]:
        """
        Their names.
        """
    @property
    def cameras(self) -> list[Camera]:
        """
        Cameras, in their order.
        """
    @property
    def free_parameters(self) -> list[list[str]]:
        """
        Of each camera.
        """
    @property
    def image_cameras(self) -> list[int]:
        """
        Index of each image's camera.
        """
    @property
    def image_names(self) -> list[str]:
        """
        Of the images.
        """
    @property
    def observations(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        (n, 9) image, point, body, corner, x, y [px], their sigmas, used.
        """
    @property
    def point_names(self) -> list[str]:
        """
        Of the points.
        """
    @property
    def points_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        (n, 3) positions [m].
        """
    @property
    def station_names(self) -> list[str]:
        """
        Of the stations.
        """
class DatumKind(enum.Enum):
    """
    What holds a network's datum.
    """
    control = 2
    inner = 0
    minimal = 1
    scale_only = 3
class Datum:
    """
    What holds what a network's observations leave open.

    inner: inner constraints over targets; minimal: as few coordinates of three targets as are open;
    control: the observations alone; scale_only: shift and turn inner, scale by two targets' distance.
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, kind: DatumKind = ..., targets: collections.abc.Sequence[Target] = []) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> Datum:
        """
        A copy with the given fields changed.
        """
    @property
    def kind(self) -> DatumKind:
        """
        a DatumKind
        """
    @property
    def targets(self) -> list[Target]:
        """
        over which; none: all
        """
class RejectedObservation:
    """
    Taken for a gross error.
    """
    @property
    def normalised(self) -> float:
        """
        Residual over its sigma.
        """
    @property
    def observation(self) -> int:
        """
        Its index.
        """
    @property
    def reason(self) -> str:
        """
        robust, snooping, not in view, alone.
        """
class Adjustment:
    """
    An adjusted network; the state so far if not ok.
    """
    def __repr__(self) -> str:
        ...
    @property
    def cost(self) -> float:
        """
        Half the weighted sum of squares.
        """
    @property
    def defect(self) -> int:
        """
        Of the datum, 0 to 7.
        """
    @property
    def iterations(self) -> int:
        """
        Of all stages.
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def network(self) -> Network:
        """
        With the estimates.
        """
    @property
    def observations(self) -> int:
        """
        Numbers that were used.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def redundancy(self) -> int:
        """
        observations - unknowns + defect.
        """
    @property
    def rejected(self) -> list[RejectedObservation]:
        """
        RejectedObservations.
        """
    @property
    def sigma0(self) -> float:
        """
        Of unit weight, a posteriori.
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
    @property
    def unknowns(self) -> int:
        """
        How many.
        """
    @property
    def warnings(self) -> list[str]:
        """
        What was left out, for example.
        """
class Precision:
    """
    Covariance of a network's unknowns, in a datum.
    """
    def __repr__(self) -> str:
        ...
    def body(self, body: typing.SupportsInt | typing.SupportsIndex) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]:
        """
        (6, 6) of a pose.
        """
    def body_scale_sigma(self, body: typing.SupportsInt | typing.SupportsIndex) -> float:
        """
        Relative.
        """
    def distance_sigma_m(self, a: Target, b: Target) -> float:
        """
        Of two targets' distance.
        """
    def in_datum(self, datum: Datum) -> Precision:
        """
        The same in another datum, without solving again.
        """
    def mount(self, mount: typing.SupportsInt | typing.SupportsIndex) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]:
        """
        (6, 6) of a pose.
        """
    def parameter_correlation(self, camera: typing.SupportsInt | typing.SupportsIndex) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        (k, k).
        """
    def parameters(self, camera: typing.SupportsInt | typing.SupportsIndex) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        (k, k) of a camera's free parameters, in their order.
        """
    def points(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n, 3, 3) of all points [m^2].
        """
    def position(self, target: Target) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        (3, 3) of a target [m^2].
        """
    def scaled(self, variance_factor: typing.SupportsFloat | typing.SupportsIndex) -> Precision:
        """
        All of it times a factor, sigma0 squared for example.
        """
    def station(self, station: typing.SupportsInt | typing.SupportsIndex) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]:
        """
        (6, 6) of a pose.
        """
    def station_position(self, station: typing.SupportsInt | typing.SupportsIndex) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        (3, 3) of where it is [m^2].
        """
    @property
    def defect(self) -> int:
        """
        Of the datum, 0 to 7.
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
    @property
    def unknowns(self) -> int:
        """
        How many.
        """
class NetworkStatistics:
    """
    Reliability of an adjusted network.

    Arrays (n, 2) have a row for each image observation, columns along x and y; zero when not used.
    """
    @property
    def detectable_px(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]:
        """
        Least blunder found with 80 % power.
        """
    @property
    def external(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]:
        """
        What that does to the unknowns, in sigmas.
        """
    @property
    def image_rms_px(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]:
        """
        (images, 2).
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def redundancy(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]:
        """
        Redundancy numbers, 0 to 1.
        """
    @property
    def redundancy_sum(self) -> float:
        """
        observations - unknowns + defect
        """
    @property
    def residual_px(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]:
        """
        Seen minus projected.
        """
    @property
    def sigma0(self) -> float:
        """
        A posteriori.
        """
    @property
    def sigma0_high(self) -> float:
        """
        The same.
        """
    @property
    def sigma0_low(self) -> float:
        """
        95 %, if sigmas are right.
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
    @property
    def tau(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]:
        """
        Pope's.
        """
    @property
    def tau_critical(self) -> float:
        """
        The same.
        """
    @property
    def w(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]:
        """
        Baarda's test.
        """
    @property
    def w_critical(self) -> float:
        """
        1 % false alarms among all.
        """
class ParameterStatistics:
    """
    What an estimated parameter is worth.
    """
    def __repr__(self) -> str:
        ...
    @property
    def camera(self) -> int:
        """
        its index
        """
    @property
    def correlated_with(self) -> str:
        """
        which
        """
    @property
    def correlation(self) -> float:
        """
        the largest with another of its camera
        """
    @property
    def entangled(self) -> bool:
        """
        that correlation is beyond 0.9
        """
    @property
    def name(self) -> str:
        """
        of the parameter
        """
    @property
    def nominal(self) -> float:
        """
        without estimation
        """
    @property
    def sigma(self) -> float:
        """
        of the value
        """
    @property
    def significant(self) -> bool:
        """
        at 1 %
        """
    @property
    def t(self) -> float:
        """
        |value - nominal| / sigma
        """
    @property
    def unit(self) -> str:
        """
        of value and sigma
        """
    @property
    def value(self) -> float:
        """
        estimated
        """
class SelectionStep:
    """
    One adjustment of select_parameters().
    """
    @property
    def bic(self) -> float:
        """
        Bayes' information criterion after it.
        """
    @property
    def dropped(self) -> str:
        """
        The parameter; empty: the first, with all.
        """
    @property
    def reason(self) -> str:
        """
        Why.
        """
    @property
    def sigma0(self) -> float:
        """
        After it.
        """
class Selection:
    """
    Parameters that the observations ask for.
    """
    @property
    def adjustment(self) -> Adjustment:
        """
        With what was kept.
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
    @property
    def steps(self) -> list[SelectionStep]:
        """
        SelectionSteps.
        """
class VarianceComponent:
    """
    How much larger sigmas are than stated.
    """
    @property
    def axis(self) -> int:
        """
        0: columns, 1: rows.
        """
    @property
    def camera(self) -> int:
        """
        Its index.
        """
    @property
    def factor(self) -> float:
        """
        Of the stated sigmas.
        """
    @property
    def observations(self) -> int:
        """
        In it.
        """
    @property
    def redundancy(self) -> float:
        """
        Of the group.
        """
class VarianceComponents:
    """
    By variance_components().
    """
    @property
    def adjustment(self) -> Adjustment:
        """
        With the new sigmas.
        """
    @property
    def components(self) -> list[VarianceComponent]:
        """
        Of each.
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def rounds(self) -> int:
        """
        Taken.
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
class CheckResult:
    """
    Errors at points that are known better.
    """
    @property
    def errors_m(self) -> list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]]:
        """
        Of each point.
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def predicted_3d_m(self) -> float:
        """
        Predicted.
        """
    @property
    def predicted_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,).
        """
    @property
    def rmse_3d_m(self) -> float:
        """
        Of the distance.
        """
    @property
    def rmse_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,).
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
class MeasuredPoint:
    """
    By intersection of rays.
    """
    @property
    def angle_rad(self) -> float:
        """
        Largest between two rays.
        """
    @property
    def covariance_m2(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        (3, 3); infinite when not ok.
        """
    @property
    def images(self) -> int:
        """
        That show it.
        """
    @property
    def position_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) [m].
        """
    @property
    def sigma0(self) -> float:
        """
        Of its 2n - 3 redundant observations.
        """
    @property
    def status(self) -> Status:
        """
        ok, too_few_lamps, degenerate or not_converged.
        """
    @property
    def worst_residual_px(self) -> float:
        """
        [px].
        """
class Measurement:
    """
    Points by measure_points().
    """
    def distance(self, from_: typing.SupportsInt | typing.SupportsIndex, to: typing.SupportsInt | typing.SupportsIndex) -> tuple[float, float]:
        """
        Length and sigma [m] between two.
        """
    @property
    def covariance_m2(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        (3n, 3n) of all together.
        """
    @property
    def points(self) -> list[MeasuredPoint]:
        """
        MeasuredPoints.
        """
class TestFieldDesign:
    """
    A room with targets, stations and a camera, on paper.
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, camera: Camera = ..., free_parameters: collections.abc.Sequence[str] = [], room_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = [16.0, 12.0, 4.0], stations: typing.SupportsInt | typing.SupportsIndex = 5, station_height_m: typing.SupportsFloat | typing.SupportsIndex = 1.7, station_height_step_m: typing.SupportsFloat | typing.SupportsIndex = 1.0, station_ring: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 1]"] = [0.7, 0.7], station_tilt_rad: typing.SupportsFloat | typing.SupportsIndex = 0.075, targets: typing.SupportsInt | typing.SupportsIndex = 500, lowest_target_m: typing.SupportsFloat | typing.SupportsIndex = 0.2, ceiling: bool = True, tags: typing.SupportsInt | typing.SupportsIndex = 0, tag_side_m: typing.SupportsFloat | typing.SupportsIndex = 0.15, sigma_px: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 1]"] = [0.5, 0.5], start_error_m: typing.SupportsFloat | typing.SupportsIndex = 0.05, seed: typing.SupportsInt | typing.SupportsIndex = 1) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> TestFieldDesign:
        """
        A copy with the given fields changed.
        """
    @property
    def camera(self) -> Camera:
        """
        that takes the pictures
        """
    @property
    def ceiling(self) -> bool:
        """
        has targets, too
        """
    @property
    def free_parameters(self) -> list[str]:
        """
        of it, that are unknown
        """
    @property
    def lowest_target_m(self) -> float:
        """
        [m]
        """
    @property
    def room_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        its size [m]
        """
    @property
    def seed(self) -> int:
        """
        of everything random
        """
    @property
    def sigma_px(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 1]"]:
        """
        of a seen place, column and row [px]
        """
    @property
    def start_error_m(self) -> float:
        """
        of the network's starts [m]
        """
    @property
    def station_height_m(self) -> float:
        """
        [m]
        """
    @property
    def station_height_step_m(self) -> float:
        """
        they alternate by it [m]
        """
    @property
    def station_ring(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 1]"]:
        """
        of the room's half sides
        """
    @property
    def station_tilt_rad(self) -> float:
        """
        how much they are tilted
        """
    @property
    def stations(self) -> int:
        """
        how many
        """
    @property
    def tag_side_m(self) -> float:
        """
        of the black border's outside [m]
        """
    @property
    def tags(self) -> int:
        """
        AprilTags besides, on the walls
        """
    @property
    def targets(self) -> int:
        """
        points on walls and ceiling
        """
class TestField:
    """
    A simulated network and its truth.
    """
    @property
    def network(self) -> Network:
        """
        Noisy pixels, starts that are off.
        """
    @property
    def truth(self) -> Network:
        """
        The same without any error.
        """
class ScaleSource:
    """
    What could give a network its scale.
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, name: str, bars: typing.SupportsInt | typing.SupportsIndex = 0, bar_m: typing.SupportsFloat | typing.SupportsIndex = 2.0, bar_sigma_m: typing.SupportsFloat | typing.SupportsIndex = 2e-05, distances: typing.SupportsInt | typing.SupportsIndex = 0, distance_m: typing.SupportsFloat | typing.SupportsIndex = 10.0, distance_sigma_m: typing.SupportsFloat | typing.SupportsIndex = 0.0002, tags: typing.SupportsInt | typing.SupportsIndex = 0, tag_side_m: typing.SupportsFloat | typing.SupportsIndex = 0.15) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> ScaleSource:
        """
        A copy with the given fields changed.
        """
    @property
    def bar_m(self) -> float:
        """
        length of each [m]
        """
    @property
    def bar_sigma_m(self) -> float:
        """
        [m]
        """
    @property
    def bars(self) -> int:
        """
        how many
        """
    @property
    def distance_m(self) -> float:
        """
        so far apart [m]
        """
    @property
    def distance_sigma_m(self) -> float:
        """
        [m]
        """
    @property
    def distances(self) -> int:
        """
        between targets, how many
        """
    @property
    def name(self) -> str:
        """
        for the table
        """
    @property
    def tag_side_m(self) -> float:
        """
        [m]
        """
    @property
    def tags(self) -> int:
        """
        of known size, how many
        """
class ScalePrediction:
    """
    What a ScaleSource is worth.
    """
    @property
    def at_10_m_sigma_m(self) -> float:
        """
        Of the distance nearest 10 m.
        """
    @property
    def name(self) -> str:
        """
        Of the source.
        """
    @property
    def point_sigma_m(self) -> float:
        """
        3D, r.m.s. of the points.
        """
    @property
    def scale_sigma(self) -> float:
        """
        Relative.
        """
class CircularTarget:
    """
    A disc on a square sheet of the other tone.

    Keywords (and properties):
      id: its number
      radius_m: [m]
      centre_m: (3,) [m, world]
      sheet_m: side of the sheet [m]; 0: four radii
      dark: a black disc on white
      normal: (3,) towards the printed side
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, id: typing.SupportsInt | typing.SupportsIndex, radius_m: typing.SupportsFloat | typing.SupportsIndex, centre_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], sheet_m: typing.SupportsFloat | typing.SupportsIndex = 0.0, dark: bool = False, normal: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = [0.0, 0.0, -1.0]) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> CircularTarget:
        """
        A copy with the given fields changed.
        """
    @property
    def centre_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) [m, world]
        """
    @property
    def dark(self) -> bool:
        """
        a black disc on white
        """
    @property
    def id(self) -> int:
        """
        its number
        """
    @property
    def normal(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,) towards the printed side
        """
    @property
    def radius_m(self) -> float:
        """
        [m]
        """
    @property
    def sheet_m(self) -> float:
        """
        side of the sheet [m]; 0: four radii
        """
class ChessboardTarget:
    """
    A chessboard of (columns + 1) x (rows + 1) squares, the first corner's black.

    Keywords (and properties):
      square_m: side of a square [m]
      columns: of inner corners
      rows: of inner corners
      world_from_board: 4x4; its z axis points away from the viewer, y down
    """
    def __getstate__(self) -> dict[str, typing.Any]:
        ...
    def __init__(self, *, square_m: typing.SupportsFloat | typing.SupportsIndex, columns: typing.SupportsInt | typing.SupportsIndex = 9, rows: typing.SupportsInt | typing.SupportsIndex = 6, world_from_board: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: dict[str, typing.Any]) -> None:
        ...
    def replace(self, **kwargs: typing.Any) -> ChessboardTarget:
        """
        A copy with the given fields changed.
        """
    @property
    def columns(self) -> int:
        """
        of inner corners
        """
    @property
    def rows(self) -> int:
        """
        of inner corners
        """
    @property
    def square_m(self) -> float:
        """
        side of a square [m]
        """
    @property
    def world_from_board(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        4x4; its z axis points away from the viewer, y down
        """
class TagTruth:
    """
    Where a tag is in a rendered image.
    """
    @property
    def corners_px(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 2]"]:
        """
        (4, 2) as detect_april_tags() has them.
        """
    @property
    def id(self) -> int:
        """
        Of the tag.
        """
    @property
    def in_view(self) -> bool:
        """
        Drawn, and some of it lies on the image.
        """
    @property
    def whole(self) -> bool:
        """
        All of its sheet lies on the image.
        """
class CircleTruth:
    """
    Where a circular target is in a rendered image.
    """
    @property
    def centre_px(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 1]"]:
        """
        The centre's projection.
        """
    @property
    def id(self) -> int:
        """
        Of the target.
        """
    @property
    def image_centre_px(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 1]"]:
        """
        The image's centroid.
        """
    @property
    def in_view(self) -> bool:
        """
        Drawn, and some of it on the image.
        """
    @property
    def whole(self) -> bool:
        """
        All of its sheet lies on the image.
        """
class ChessboardTruth:
    """
    Where a board is in a rendered image.
    """
    @property
    def corners_px(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n, 2) inner corners, row by row.
        """
    @property
    def in_view(self) -> bool:
        """
        Drawn, and some of it on the image.
        """
    @property
    def whole(self) -> bool:
        """
        All of it lies on the image.
        """
class TargetRenderer:
    """
    Pictures of calibration targets.

    Windows of one renderer are parts of one image, to the bit: a panorama that memory does not hold can
    be made piece by piece.
    """
    def __init__(self, camera: Camera, cam_from_world: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], *, tags: collections.abc.Sequence[Tag] = [], circles: collections.abc.Sequence[CircularTarget] = [], boards: collections.abc.Sequence[ChessboardTarget] = [], psf_sigma_px: typing.SupportsFloat | typing.SupportsIndex = 0.6, black_dn: typing.SupportsFloat | typing.SupportsIndex = 30.0, white_dn: typing.SupportsFloat | typing.SupportsIndex = 200.0, ground_dn: typing.SupportsFloat | typing.SupportsIndex = 110.0, margin_cells: typing.SupportsFloat | typing.SupportsIndex = 0.5, noise_dn: typing.SupportsFloat | typing.SupportsIndex = 0.0, seed: typing.SupportsInt | typing.SupportsIndex = 0, frame: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        """
        Raises: ValueError naming what does not validate.

        Options:
          psf_sigma_px: of the Gaussian lens blur
          black_dn: grey level of black print
          white_dn: of paper
          ground_dn: of the wall
          margin_cells: of white paper around a print, in its cells
          noise_dn: standard deviation of a pixel
          seed: of the noise
          frame: noise differs from frame to frame under one seed
        """
    def window(self, x0: typing.SupportsInt | typing.SupportsIndex, y0: typing.SupportsInt | typing.SupportsIndex, width: typing.SupportsInt | typing.SupportsIndex, height: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.uint8 | numpy.uint16]:
        """
        (height, width) uint8. Raises: ValueError for a window that leaves the image.
        """
    @property
    def boards(self) -> list[ChessboardTruth]:
        """
        ChessboardTruths.
        """
    @property
    def circles(self) -> list[CircleTruth]:
        """
        CircleTruths.
        """
    @property
    def tags(self) -> list[TagTruth]:
        """
        TagTruths.
        """
class Resection:
    """
    The pose of an image from known points.
    """
    @property
    def agree(self) -> list[bool]:
        """
        Whether each point does.
        """
    @property
    def cam_from_world(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        4x4.
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def others(self) -> list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]]:
        """
        Poses that fit up to three times as badly.
        """
    @property
    def sigma_px(self) -> float:
        """
        Robust, per axis.
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
class NetworkStart:
    """
    Start values from pictures of tags.
    """
    @property
    def blocks(self) -> list[list[str]]:
        """
        Names of images that are bound together, largest block first.
        """
    @property
    def message(self) -> str:
        """
        A sentence, may be empty.
        """
    @property
    def network(self) -> Network:
        """
        Images and targets of the largest block.
        """
    @property
    def ok(self) -> bool:
        """
        Whether status is Status.ok.
        """
    @property
    def status(self) -> Status:
        """
        How it ended, a Status.
        """
    @property
    def warnings(self) -> list[str]:
        """
        What was left out.
        """
    @property
    def wrong_sizes(self) -> dict[int, float]:
        """
        Tag id -> size [m] as the others' sizes have it.
        """
def adjust(network: Network, *, progress: typing.Any = None, robust: bool = True, snooping: bool = True, false_alarm: typing.SupportsFloat | typing.SupportsIndex = 0.01, max_iterations: typing.SupportsInt | typing.SupportsIndex = 100, tolerance_sigma: typing.SupportsFloat | typing.SupportsIndex = 1e-06, threads: typing.SupportsInt | typing.SupportsIndex = 2, datum: Datum = ...) -> Adjustment:
    """
    Bundle adjustment of a Network, gauge-free, its datum set afterwards.

    progress(stage, iteration, cost, rejected): called now and then; False stops it.
    Returns: Adjustment; status too_few_lamps, degenerate (the message names what is not determined) or not_converged, with the state so far.
    Raises: ValueError naming what is wrong with the network or the options.

    Options:
      robust: gross errors are expected
      snooping: Baarda's, after it
      false_alarm: chance that any good observation is taken away
      max_iterations: of each stage
      tolerance_sigma: of the last step
      threads: 1 or 2; the bits are the same
      datum: in which the result is given
    """
def aperture_power(power_w: typing.SupportsFloat | typing.SupportsIndex, order: typing.SupportsFloat | typing.SupportsIndex, cos_emission: typing.SupportsFloat | typing.SupportsIndex, cos_incidence: typing.SupportsFloat | typing.SupportsIndex, distance_m: typing.SupportsFloat | typing.SupportsIndex, area_m2: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    Power through an aperture [W]; with an area_m2 of 1 the irradiance there [W/m^2].
    """
def april_tag_families() -> list[str]:
    """
    Names of the families that can be read.
    """
def board_network(cameras: collections.abc.Sequence[tuple[str, Camera, collections.abc.Sequence[str]]], board_m: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]", "flags.c_contiguous"], images: collections.abc.Sequence[tuple[str, typing.SupportsInt | typing.SupportsIndex, typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 2]"], collections.abc.Sequence[typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 2]"]]]]) -> NetworkStart:
    """
    A network from images of one board of known points, which are the world.

    cameras: (name, Camera, free parameters); board_m: (n, 3); images: (name, camera's index, (n, 2)
    [px], covariances (2, 2)). Returns: NetworkStart; images without a pose are left out and named.
    """
def calibrate_ambient(scene: Scene, images: collections.abc.Sequence[numpy.typing.NDArray[numpy.uint8 | numpy.uint16]], poses: collections.abc.Sequence[typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]]) -> AmbientLight:
    """
    Ambient irradiance of the sensor from images of known poses.

    The mean of the pixels that no lamp reaches, over black level and dark current. The lamps' fluxes are
    over the local background, so that this and calibrate_light() do not depend on each other.
    poses: cam_from_world of each image, (4, 4).
    Returns: AmbientLight; status degenerate when no image tells it: the background is cut off at level 0
      or saturated, or has light of the lamps by walls, glare or ghosts, or is darker than the black level.
    Raises: ValueError for another number of poses than of images, images not of the camera's size, a
      colour mosaic, or a scene that switches ambient light off.
    """
def calibrate_light(scene: Scene, images: collections.abc.Sequence[numpy.typing.NDArray[numpy.uint8 | numpy.uint16] | collections.abc.Sequence[Blob]], poses: collections.abc.Sequence[typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]], matches: collections.abc.Sequence[collections.abc.Sequence[Match]] | None = None, *, powers: PowerFit = ..., gate_px: typing.SupportsFloat | typing.SupportsIndex = 3.0, model_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.002, huber_sigma: typing.SupportsFloat | typing.SupportsIndex = 3.0, max_order_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.3) -> CalibratedLight:
    """
    Power and Lambertian order of the scene's lamps, from images at known poses.

    Weighted least squares of each lamp's fluxes: ln F = ln P + ln(m + 1) + m ln cos(phi) + geometry.
    With powers=PowerFit.common_factor the scene's powers are right but for one factor of all of them, of
    the exposure or of the gain; fluxes cannot tell it from every lamp's power, so one of both is known.
    What the scene's effects switch off, such as vignetting, is not counted.
    images: arrays, or lists of Blobs that detect() found with the scene's sensor. poses: cam_from_world
    of each, (4, 4). matches: for each image the Matches of lamps and blobs, instead of a gate about
    where the poses put the lamps.
    Returns: CalibratedLight; status degenerate when no lamp's power and order are determined.
    Raises: ValueError for another number of poses than of images, naming it.

    Options:
      powers: each: every lamp's; common_factor: one factor of all of them
      gate_px: a lamp's blob is no farther from its image's centre [px]
      model_sigma: relative, of every flux beside the blob's own
      huber_sigma: fluxes further off than this weigh less [sigma]
      max_order_sigma: an order less certain is not determined
    """
def camera_on_vehicle(place_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], pan_rad: typing.SupportsFloat | typing.SupportsIndex = 0, tilt_rad: typing.SupportsFloat | typing.SupportsIndex = 0) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
    """
    cam_from_body (4x4) of a camera on a vehicle at place_m (3,), above the floor. At pan and tilt 0 it looks up, its image's x forward; pan turns it to the left, tilt bends its view towards where pan points.
    """
def check_points(network: Network, precision: Precision, targets: collections.abc.Sequence[Target], positions_m: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]", "flags.c_contiguous"]) -> CheckResult:
    """
    Errors at Targets whose places (n, 3) are known better, against prediction.
    """
def chi2_quantile(probability: typing.SupportsFloat | typing.SupportsIndex, dof: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    The value that a chi-square variable does not exceed with this probability.
    """
def closed_loop(scene: Scene, route: Route, options: LoopOptions = ..., observer: collections.abc.Callable[[float, float], bool] | None = None) -> LoopResult:
    """
    A vehicle drives a route by its lamps: world, rendered image, estimate, controller, world.

    scene.camera is the vehicle's. observer(time_s, along_m) is called ten times a second of the run;
    False ends it. Returns: LoopResult; the same seed gives the same run.
    Raises: ValueError naming what is wrong: a route that is not free of walls and boxes, an option.

    >>> import libocc as occ
    >>> scene = occ.Scene.load("data/scenes/kookmin_four_lamps.yaml")
    >>> run = occ.closed_loop(scene, occ.Route([[1.5, 2], [2.5, 2]]))
    >>> run.outcome.name, run.metrics.cross_track_rmse_m < 0.002
    ('arrived', True)
    """
def code_budget(code: Code, *, rows: typing.SupportsFloat | typing.SupportsIndex, row_time_s: typing.SupportsFloat | typing.SupportsIndex, exposure_s: typing.SupportsFloat | typing.SupportsIndex, exact_times: bool = False) -> CodeBudget:
    """
    Whether a camera can read a code from a lamp's image `rows` high, before anyone tries.

    Chips in view = rows x row time x clock; an exposure longer than a chip mixes it with the next.
    """
def compare_scale(design: TestFieldDesign, sources: collections.abc.Sequence[ScaleSource]) -> list[ScalePrediction]:
    """
    Which scale bar is enough? The same field with each ScaleSource; before any picture is taken.

    Returns: a ScalePrediction for each. Raises: ValueError; also when a field is not determined.
    """
def dbm(power_w: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> typing.Any:
    """
    Power in decibels over a milliwatt; minus infinity for none. Takes arrays.
    """
def decode(images: collections.abc.Sequence[numpy.typing.NDArray[numpy.uint8 | numpy.uint16]], times_s: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], sensor: Sensor, code: Code, *, map: Scene | None = None, join_frames: typing.SupportsInt | typing.SupportsIndex = 15, exact_times: bool = False) -> Decoded:
    """
    Reads the ids that lamps say in the images of a sequence.

    images: (height, width) arrays of one size and type. times_s: when each began, rising. sensor: its
    row time and exposure say when each line was exposed. code: what the lamps speak. map: a Scene
    whose lamps' codes tell who says what. join_frames: lamps are looked for in the brightest of so
    many frames; 0: of all, for a camera that stands still. exact_times: c_ook: times are good to a
    quarter of a chip.
    Returns: Decoded; status no_lamps when no frame shows a light.
    Raises: ValueError naming the frame that is out of order, repeated or of another size, or a code
      that two lamps of the map say.
    """
def decode_samples(code: Code, start_s: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], exposure_s: typing.SupportsFloat | typing.SupportsIndex, values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], sigma: typing.SupportsFloat | typing.SupportsIndex, channels: typing.Annotated[numpy.typing.ArrayLike, numpy.int32] | None = None, frames: typing.Annotated[numpy.typing.ArrayLike, numpy.int32] | None = None, *, max_clock_error: typing.SupportsFloat | typing.SupportsIndex = 0.00015, max_expected_errors: typing.SupportsFloat | typing.SupportsIndex = 0.05, exact_times: bool = False, period_start_s: typing.SupportsFloat | typing.SupportsIndex | None = None) -> DecodedCode:
    """
    Reads an id from samples of a lamp's light, a DecodedCode.

    start_s: (n,) when each exposure began. values: (n,) mean light, about 0 dark to 1 lit. sigma: of
    each. channels: see Waveform. frames: which image each is of.

    Options:
      max_clock_error: of lamp against camera, relative
      max_expected_errors: wrong bits; more is `uncertain`
      exact_times: c_ook: times are good to a quarter of a chip, so frames may be joined first
      period_start_s: known, for measuring error rates
    """
def detect(image: numpy.typing.NDArray[numpy.uint8 | numpy.uint16], *, sensor: Sensor | None = None, threshold_sigma: typing.SupportsFloat | typing.SupportsIndex = 5.0, threshold_dn: typing.SupportsFloat | typing.SupportsIndex | None = None, min_area_px: typing.SupportsInt | typing.SupportsIndex = 4, max_blobs: typing.SupportsInt | typing.SupportsIndex = 4096, rims: bool = True, stripes: bool | None = None, max_frequency_hz: typing.SupportsFloat | typing.SupportsIndex = 20000.0) -> list[Blob]:
    """
    Finds the lamps of an image: a list of Blobs, brightest first; empty when there is none.

    image: (height, width) or (height, width, 3 or 4) array of uint8 or uint16; not copied when the
    pixels of a row are adjacent.
    Raises: TypeError or ValueError for another array or a bad option, naming it.

    >>> import libocc as occ, numpy as np
    >>> image = np.full((40, 60), 10, np.uint8)
    >>> image[10:13, 20:23] = 200
    >>> [blob.centroid_px.round(2).tolist() for blob in occ.detect(image)]
    [[21.0, 11.0]]

    Options:
      sensor: Sensor for noise, full scale, stripes; None: estimate
      threshold_sigma: threshold above the background [its sigma]
      threshold_dn: absolute threshold [grey levels] instead
      min_area_px: smaller blobs are dropped [px]
      max_blobs: the brightest are kept
      rims: measure sub-pixel rims of discs
      stripes: join stripes, read frequencies; None: when rows have a time
      max_frequency_hz: stripes are read up to this [Hz]
    """
def detect_april_tags(image: numpy.typing.NDArray[numpy.uint8 | numpy.uint16], *, camera: Camera | None = None, progress: typing.Any = None, family: str = 'tag36h11', decimate: typing.SupportsFloat | typing.SupportsIndex = 1.0, threads: typing.SupportsInt | typing.SupportsIndex = 1, max_hamming: typing.SupportsInt | typing.SupportsIndex = 1, min_decision_margin: typing.SupportsFloat | typing.SupportsIndex = 20.0, refine: bool = True, tile_px: typing.SupportsInt | typing.SupportsIndex = 0, overlap_px: typing.SupportsInt | typing.SupportsIndex = 400) -> list[AprilTag]:
    """
    The AprilTags in an image, by rising id, corners to hundredths of a pixel.

    image: (height, width) or (height, width, 3 or 4) array of uint8 or uint16.
    camera: that took the image, when it is known: its lens bends the tags' sides, which need
    not be guessed then.
    progress(tiles_done, tiles): called after each tile; False stops the search.
    Returns: list of AprilTag. Raises: ValueError for a bad image or option.

    Options:
      family: a name in april_tag_families()
      decimate: squares are looked for in an image so many times smaller
      threads: to use
      max_hamming: wrong bits that are corrected, 0 to 2
      min_decision_margin: grey levels (of 255)
      refine: measure the corners again, to hundredths of a pixel
      tile_px: sides of tiles in a very large image; 0: it is one
      overlap_px: of neighbouring tiles, larger than any tag
    """
def detectable_points(vertices: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]", "flags.c_contiguous"], faces: typing.Annotated[numpy.typing.NDArray[numpy.int32], "[m, 3]", "flags.c_contiguous"], *, sharp_rad: typing.SupportsFloat | typing.SupportsIndex = 0.35, straight_rad: typing.SupportsFloat | typing.SupportsIndex = 0.35, min_edge: typing.SupportsFloat | typing.SupportsIndex = 0.05, max_points: typing.SupportsInt | typing.SupportsIndex = 30, directions: typing.SupportsInt | typing.SupportsIndex = 400) -> list[DetectablePoint]:
    """
    Points of a body that can be found in images: where long sharp edges meet.

    vertices: (n, 3) [m]. faces: (k, 3) indices, counterclockwise seen from outside;
    read_mesh() gives both. Returns: DetectablePoints, longest edges first.
    Raises: ValueError naming what is wrong.

    Options:
      sharp_rad: least angle between the faces of a sharp edge [rad]
      straight_rad: edges that turn by less are one [rad]
      min_edge: shorter edges do not count [its box's diagonal]
      max_points: those with the longest edges
      directions: from which each point is looked at
    """
def dock(pose: PlanarPose, speed_m_s: typing.SupportsFloat | typing.SupportsIndex, target: PlanarPose, vehicle: Vehicle, phase: DockPhase = ..., options: DockOptions = ...) -> DockOutput:
    """
    DockOutput: one step towards standing at target, a PlanarPose. phase: the last output's.
    """
def drive(vehicle: Vehicle, state: DriveState, command: DriveCommand, dt_s: typing.SupportsFloat | typing.SupportsIndex, seed: typing.SupportsInt | typing.SupportsIndex = 0) -> DriveStep:
    """
    Moves a vehicle on by dt_s seconds: the exact arc of its mean speed and turn.

    Commands beyond its limits are clipped, and `limited` says so. seed: of this step's noise; give each
    step its own. Raises: ValueError for what is not finite.

    >>> import libocc as occ
    >>> step = occ.drive(occ.Vehicle(), occ.DriveState(speed_m_s=0.5), occ.DriveCommand(speed_m_s=0.5), 0.1)
    >>> round(step.state.pose.x_m, 3), step.limited
    (0.05, DriveLimited())
    """
def encode_id(id: typing.SupportsInt | typing.SupportsIndex, code: Code) -> Waveform:
    """
    The light of a lamp that says an id, a Waveform.

    Raises: ValueError when the code cannot say it, naming what is wrong.

    >>> import libocc as occ
    >>> occ.encode_id(17, occ.Code(kind=occ.CodeKind.c_ook))
    <Waveform: 1 x 288 chips, 10000.0 Hz>
    """
def encode_image(image: numpy.typing.NDArray[numpy.uint8 | numpy.uint16], extension: str = '.png') -> bytes:
    """
    What write_image() would write to a file of that extension. Raises: ValueError when the format cannot hold the image.
    """
def explain(scene: Scene, cam_from_world: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], *, repetitions: typing.SupportsInt | typing.SupportsIndex = 9, seed: typing.SupportsInt | typing.SupportsIndex = 0, frame: typing.SupportsInt | typing.SupportsIndex = 0, noise: bool = True, noise_area: NoiseArea = ..., start_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, spacing_sigma: typing.SupportsFloat | typing.SupportsIndex = 1.0, velocity: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 1]"] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]) -> Explanation:
    """
    What every effect does to an image of the scene, and what it costs.

    repetitions: images per measured time, whose median counts; 0: times are not measured.
    Further keywords as for simulate(). Raises: ValueError as simulate() does.

    >>> import libocc as occ
    >>> camera = occ.Camera.pinhole(width=64, height=48, fx_px=40, fy_px=40, cx_px=31.5, cy_px=23.5)
    >>> scene = occ.Scene(camera=camera, lamps=[occ.Lamp(id=7, centre_m=[0, 0, 3], radius_m=0.1)])
    >>> pose = occ.look_at(position_m=[0, 0, 1], target_m=[0, 0, 3], up=[0, 1, 0])
    >>> [e.effect for e in occ.explain(scene, pose, repetitions=0).effects if e.applied]
    ['extent', 'light_gradient', 'psf', 'noise', 'saturation']
    """
def find_chessboard(image: numpy.typing.NDArray[numpy.uint8 | numpy.uint16], columns: typing.SupportsInt | typing.SupportsIndex, rows: typing.SupportsInt | typing.SupportsIndex) -> tuple[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"], list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 2]"]]] | None:
    """
    Inner corners of a chessboard (n, 2) [px], row by row, and their covariances (2, 2).

    Returns: None when the whole board is not seen. Raises: ValueError for a bad image or option.
    """
def format_camera(camera: Camera, format: CameraFormat = ..., name: str = 'camera') -> str:
    """
    Text of a camera file; `name` is ROS's camera_name.

    Raises: ValueError when the format has no such model.
    """
def heading_rad(cam_from_world: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]) -> float:
    """
    Azimuth [rad] about the world's Z of the camera's +x axis (image right), in (-pi, pi].
    """
def headlight_distance(lamps_px: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]", "flags.c_contiguous"], camera: Camera, *, separation_m: typing.SupportsFloat | typing.SupportsIndex = 1.4, separation_sigma_m: typing.SupportsFloat | typing.SupportsIndex = 0.1, sigma_px: typing.SupportsFloat | typing.SupportsIndex = 0.5, yaw_max_rad: typing.SupportsFloat | typing.SupportsIndex = 0.5, yaw_concentration: typing.SupportsFloat | typing.SupportsIndex = 0.0, heights: RoadHeights | None = None) -> HeadlightDistance:
    """
    How far away a car is whose two lamps are seen, its yaw being unknown.

    lamps_px: (2, 2), a lamp in each row. Without the yaw there is an interval, not a distance; heights
    over the road make it shorter. Returns: HeadlightDistance; status degenerate when the lamps cannot
    be told apart, no_pose when no yaw explains the heights.
    Raises: ValueError for numbers that are not finite or a bad option.

    Options:
      separation_m: between the lamps' centres [m]
      separation_sigma_m: its standard deviation [m]
      sigma_px: of a lamp's pixel coordinate
      yaw_max_rad: the yaw is within +- this, below pi/2 [rad]
      yaw_concentration: of von Mises' distribution within; 0: uniform
      heights: RoadHeights, when known
    """
def identify(blobs: collections.abc.Sequence[Blob], scene: Scene, prior: Prior | None = None, *, method: IdentifyMethod = ..., seed: typing.SupportsInt | typing.SupportsIndex = 0, index: LampIndex | None = None, use_frequency: bool = True, frequency_gate_sigma: typing.SupportsFloat | typing.SupportsIndex = 4.0, frequency_tolerance: typing.SupportsFloat | typing.SupportsIndex = 0.02, gate_sigma: typing.SupportsFloat | typing.SupportsIndex = 4.0, gate_model_sigma_px: typing.SupportsFloat | typing.SupportsIndex = 0.5, miss_penalty: typing.SupportsFloat | typing.SupportsIndex = 6.0, use_brightness: bool = True, light_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.2, max_hypotheses: typing.SupportsInt | typing.SupportsIndex = 1000000) -> Identification:
    """
    Which blob is which lamp: by blink code, by geometry, with or without a prior.

    Returns: Identification with every pose that is consistent with the map, ranked.

    Options:
      method: how poses are searched for
      seed: of random namings
      index: LampIndex of the scene, for hashing
      use_frequency: name lamps by their blink code where there is one
      frequency_gate_sigma: code and blob agree within [sigma]
      frequency_tolerance: relative error of lamp and row clocks
      gate_sigma: projected lamp and blob agree within [sigma]
      gate_model_sigma_px: camera and map error in every gate [px]
      miss_penalty: chi-square for a lamp that should be seen but is not
      use_brightness: tell poses apart, and reflections from lamps, by brightness and size
      light_sigma: relative error of a predicted flux beyond the lamp's power_sigma
      max_hypotheses: poses tried at most
    """
def identify_object(blobs: collections.abc.Sequence[Blob], object: Object, camera: Camera, prior: Prior | None = None, *, method: IdentifyMethod = ..., seed: typing.SupportsInt | typing.SupportsIndex = 0, index: LampIndex | None = None, use_frequency: bool = True, frequency_gate_sigma: typing.SupportsFloat | typing.SupportsIndex = 4.0, frequency_tolerance: typing.SupportsFloat | typing.SupportsIndex = 0.02, gate_sigma: typing.SupportsFloat | typing.SupportsIndex = 4.0, gate_model_sigma_px: typing.SupportsFloat | typing.SupportsIndex = 0.5, miss_penalty: typing.SupportsFloat | typing.SupportsIndex = 6.0, use_brightness: bool = True, light_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.2, max_hypotheses: typing.SupportsInt | typing.SupportsIndex = 1000000) -> Identification:
    """
    Which blob is which point of an object, and every pose that explains them.

    prior: of cam_from_world, the world being the object's frame.
    Returns: Identification; cam_from_world is of the object's frame, Match.lamp an index in object.points.

    Options:
      method: how poses are searched for
      seed: of random namings
      index: LampIndex of the scene, for hashing
      use_frequency: name lamps by their blink code where there is one
      frequency_gate_sigma: code and blob agree within [sigma]
      frequency_tolerance: relative error of lamp and row clocks
      gate_sigma: projected lamp and blob agree within [sigma]
      gate_model_sigma_px: camera and map error in every gate [px]
      miss_penalty: chi-square for a lamp that should be seen but is not
      use_brightness: tell poses apart, and reflections from lamps, by brightness and size
      light_sigma: relative error of a predicted flux beyond the lamp's power_sigma
      max_hypotheses: poses tried at most
    """
def image_residuals_px(network: Network) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]:
    """
    (n, 2) seen minus projected [px] of every image observation.
    """
def ladder_frame(image: numpy.typing.NDArray[numpy.uint8 | numpy.uint16], scene: Scene, cam_from_world: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], steps: collections.abc.Sequence[str], min_time_s: typing.SupportsFloat | typing.SupportsIndex = 5e-05) -> LadderFrame:
    """
    Runs steps of the ladder on an image whose truth is known.

    steps: names of ladder_steps(); those that do not suit the lamps are left out. min_time_s: each is
    called until so much time has gone by. Returns: LadderFrame, without outcomes below three lamps.
    Raises: ValueError for an unknown step or an image of another size than the camera's.
    """
def ladder_steps() -> list[LadderStep]:
    """
    Every step of the ladder.
    """
def lambertian_order(half_power_rad: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    Order m of a half-power semi-angle, -ln 2 / ln cos: 1 for 60 degrees.
    """
def lamp_network(cameras: collections.abc.Sequence[tuple[str, Camera, collections.abc.Sequence[str]]], scene: Scene, images: collections.abc.Sequence[tuple[str, typing.SupportsInt | typing.SupportsIndex, collections.abc.Sequence[tuple[typing.SupportsInt | typing.SupportsIndex, typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 1]"], typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 2]"]]]]]) -> NetworkStart:
    """
    A network from images of lamps whose names are known, to survey where they hang.

    scene: says about where; images: (name, camera's index, [(lamp id, centroid (2,) [px], covariance
    (2, 2))]). Returns: NetworkStart; points are named "lamp 7".
    """
def localisation_value(object: Object, camera: Camera, cam_from_object: collections.abc.Sequence[typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]], sigma_px: typing.SupportsFloat | typing.SupportsIndex) -> LocalisationValue:
    """
    Which points of an object localise it well: how often each is seen, and by how much the
    Cramer-Rao bound of the pose grows without it.

    cam_from_object: views, such as views_around(). sigma_px: of each point's pixel coordinates.
    Returns: LocalisationValue. Raises: ValueError for no views and a sigma that is not positive.
    """
def locate(image: numpy.typing.NDArray[numpy.uint8 | numpy.uint16] | collections.abc.Sequence[Blob], scene: Scene, prior: Prior | None = None, *, max_candidates: typing.SupportsInt | typing.SupportsIndex = 16, budget_s: typing.SupportsFloat | typing.SupportsIndex | None = None, target_sigma_m: typing.SupportsFloat | typing.SupportsIndex | None = None, costs: RungCosts = ..., sensor: Sensor | None = None, threshold_sigma: typing.SupportsFloat | typing.SupportsIndex = 5.0, threshold_dn: typing.SupportsFloat | typing.SupportsIndex | None = None, min_area_px: typing.SupportsInt | typing.SupportsIndex = 4, max_blobs: typing.SupportsInt | typing.SupportsIndex = 4096, rims: bool = True, stripes: bool | None = None, max_frequency_hz: typing.SupportsFloat | typing.SupportsIndex = 20000.0, method: IdentifyMethod = ..., seed: typing.SupportsInt | typing.SupportsIndex = 0, index: LampIndex | None = None, use_frequency: bool = True, frequency_gate_sigma: typing.SupportsFloat | typing.SupportsIndex = 4.0, frequency_tolerance: typing.SupportsFloat | typing.SupportsIndex = 0.02, gate_sigma: typing.SupportsFloat | typing.SupportsIndex = 4.0, gate_model_sigma_px: typing.SupportsFloat | typing.SupportsIndex = 0.5, miss_penalty: typing.SupportsFloat | typing.SupportsIndex = 6.0, use_brightness: bool = True, light_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.2, max_hypotheses: typing.SupportsInt | typing.SupportsIndex = 1000000, rung: Rung = ..., flux: FluxModel = ..., model_sigma_px: typing.SupportsFloat | typing.SupportsIndex = 0.0, huber_sigma: typing.SupportsFloat | typing.SupportsIndex = 3.0, max_iterations: typing.SupportsInt | typing.SupportsIndex = 20, tolerance_px: typing.SupportsFloat | typing.SupportsIndex = 1e-05) -> Fix:
    """
    Where was the camera when it took this image of these lamps?

    image: (height, width) or (height, width, 3 or 4) array of uint8 or uint16, of the camera's size;
    not copied when the pixels of a row are adjacent. Or a list of Blobs that detect() found in it.
    scene: Scene. prior: Prior or None.
    With a budget_s the most accurate rung is taken that is predicted to fit into what detection and
    identification have left of it; with a target_sigma_m (root of the trace of the position's
    covariance) the cheapest that is predicted to meet it, within the budget when there is one. `rung`
    then does not count, and status budget_not_met says that none does; the fix is the best there is.
    Returns: Fix; look at `ok` or `status` before using it. All plausible poses are in `candidates`.
    `choice` says which rung was taken, and why.
    Raises: TypeError or ValueError for another array, an image of another size than the camera's, or
    a bad option.

    Options:
      max_candidates: fitting poses returned at most
      budget_s: time for the whole call [s]: chooses the rung
      target_sigma_m: error of the position [m]: chooses the rung
      costs: RungCosts of this machine
      sensor: Sensor for noise, full scale, stripes; None: estimate
      threshold_sigma: threshold above the background [its sigma]
      threshold_dn: absolute threshold [grey levels] instead
      min_area_px: smaller blobs are dropped [px]
      max_blobs: the brightest are kept
      rims: measure sub-pixel rims of discs
      stripes: join stripes, read frequencies; None: when rows have a time
      max_frequency_hz: stripes are read up to this [Hz]
      method: how poses are searched for
      seed: of random namings
      index: LampIndex of the scene, for hashing
      use_frequency: name lamps by their blink code where there is one
      frequency_gate_sigma: code and blob agree within [sigma]
      frequency_tolerance: relative error of lamp and row clocks
      gate_sigma: projected lamp and blob agree within [sigma]
      gate_model_sigma_px: camera and map error in every gate [px]
      miss_penalty: chi-square for a lamp that should be seen but is not
      use_brightness: tell poses apart, and reflections from lamps, by brightness and size
      light_sigma: relative error of a predicted flux beyond the lamp's power_sigma
      max_hypotheses: poses tried at most
      rung: what of the image the pose has to explain
      flux: whether lamps' brightness counts, and what is known of it
      model_sigma_px: camera and map error per lamp [px]
      huber_sigma: residuals beyond this weigh linearly [sigma]
      max_iterations: steps of the refinement
      tolerance_px: converged when no lamp moves further [px]
    """
def locate_by_tags(tags: collections.abc.Sequence[AprilTag], scene: Scene, lamps: collections.abc.Mapping[typing.SupportsInt | typing.SupportsIndex, Blob] = {}) -> Fix:
    """
    The camera's pose from the tags that the scene has, with its lamps when they are named.

    tags: AprilTags. lamps: lamp id -> Blob, as in a Fix. Returns: Fix; status too_few_lamps when no tag
    of the scene is seen. Raises: ValueError for a lamp that the scene does not have.
    """
def look_at(position_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], target_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], up: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = (0, 0, 1)) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
    """
    cam_from_world (4x4) of a camera at position_m [m, world] that looks at target_m.

    The image's up direction is as near to `up` as it can be.
    Raises: ValueError when target and position coincide or the view is along `up`.

    >>> import libocc as occ
    >>> pose = occ.look_at(position_m=[0, 0, 1], target_m=[0, 0, 3], up=[0, 1, 0])
    >>> (pose @ [0.5, 0.25, 3, 1]).round(9).tolist()
    [-0.5, -0.25, 2.0, 1.0]
    """
def measure_points(network: Network, points: collections.abc.Sequence[collections.abc.Sequence[tuple[typing.SupportsInt | typing.SupportsIndex, typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 1]"], typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 1]"]]]], precision: Precision | None = None) -> Measurement:
    """
    Points from where they were seen in calibrated images, with covariance.

    points: for each a list of (image, pixel (2,), sigma_px (2,)). precision: of the same network, whose
    uncertainty then counts. Returns: Measurement.
    """
def moved_pose(cam_from_world: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], velocity: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 1]"], time_s: typing.SupportsFloat | typing.SupportsIndex) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
    """
    Pose (4x4) after a time of constant velocity (6,), as simulate() takes it.
    """
def nees(squared: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]", "flags.c_contiguous"], dof: typing.SupportsInt | typing.SupportsIndex | typing.Annotated[numpy.typing.ArrayLike, numpy.int32, "[m, n]"], confidence: typing.SupportsFloat | typing.SupportsIndex = 0.95) -> ConsistencyReport:
    """
    Whether normalised estimation errors squared are as large as they should be.

    squared: (runs, times). dof: a number, or of each value, 0 where there is none. The values of a run may
    depend on each other: how much is told by the spread of ten runs or more.
    Returns: ConsistencyReport, with intervals of this confidence.
    Raises: ValueError for shapes that differ, values that are negative or not finite, no value.
    """
def network_statistics(network: Network, threads: typing.SupportsInt | typing.SupportsIndex = 2) -> NetworkStatistics:
    """
    NetworkStatistics of an adjusted Network.
    """
def nis(squared: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]", "flags.c_contiguous"], dof: typing.SupportsInt | typing.SupportsIndex | typing.Annotated[numpy.typing.ArrayLike, numpy.int32, "[m, n]"], confidence: typing.SupportsFloat | typing.SupportsIndex = 0.95) -> ConsistencyReport:
    """
    The same of normalised innovations squared, which are independent in time: one run is enough.
    """
def normalised_squared_error(error: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], covariance: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]) -> float:
    """
    error . covariance^-1 error, (n,) and (n, n): NEES, or NIS of an innovation. Raises: ValueError unless the covariance is positive definite.
    """
def p3p(bearings: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]", "flags.c_contiguous"], points_in_world: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]", "flags.c_contiguous"]) -> numpy.typing.NDArray[numpy.float64]:
    """
    All poses from which three known points are seen along three bearings.

    bearings: (3, 3), a unit vector (camera frame) in each row. points_in_world: (3, 3), a point [m] in
    each row. Returns: (k, 4, 4) candidates for cam_from_world, k from 0 to 4, in no order: all fit.
    Raises: ValueError for another number of points, numbers that are not finite or bearings that are
    not unit.
    """
def paper_additional_parameters() -> list[str]:
    """
    Its nine: all but ez and the tumbling.
    """
def paper_panorama_camera() -> Camera:
    """
    A rotating line: 35 mm lens, 10 200 pixels of 8 um, 40 000 columns.
    """
def parameter_statistics(network: Network, nominal: Network, precision: Precision) -> list[ParameterStatistics]:
    """
    ParameterStatistics of all free parameters; nominal: the network with their other values.
    """
def plan_pan_tilt(scene: Scene, route: Route, *, min_lamps: typing.SupportsInt | typing.SupportsIndex = 1, min_pan_rad: typing.SupportsFloat | typing.SupportsIndex = -3.141592653589793, max_pan_rad: typing.SupportsFloat | typing.SupportsIndex = 3.141592653589793, min_tilt_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0, max_tilt_rad: typing.SupportsFloat | typing.SupportsIndex = 0.8, pans: typing.SupportsInt | typing.SupportsIndex = 25, tilts: typing.SupportsInt | typing.SupportsIndex = 9, pan_rate_rad_s: typing.SupportsFloat | typing.SupportsIndex = 1.0, tilt_rate_rad_s: typing.SupportsFloat | typing.SupportsIndex = 1.0, step_m: typing.SupportsFloat | typing.SupportsIndex = 0.2, sigma_cost_1_m: typing.SupportsFloat | typing.SupportsIndex = 100.0, camera_place_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = [0.0, 0.0, 1.5], camera_pan_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0, camera_tilt_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0, margin_px: typing.SupportsFloat | typing.SupportsIndex = 4.0, sigma_px: typing.SupportsFloat | typing.SupportsIndex = 0.1, heading_sigma_rad: typing.SupportsFloat | typing.SupportsIndex = 0.01) -> PanTiltResult:
    """
    How a camera that pans and tilts keeps lamps in view along a route, within its rates: PanTiltResult.

    Options:
      min_lamps: in view everywhere
      min_pan_rad: [rad]
      max_pan_rad: [rad]
      min_tilt_rad: [rad]
      max_tilt_rad: [rad]
      pans: of the grid, both ends included
      tilts: alike
      pan_rate_rad_s: [rad/s]
      tilt_rate_rad_s: [rad/s]
      step_m: between the plan's knots, at most [m]
      sigma_cost_1_m: what a bound costs beside a turn by 1 rad
      camera_place_m: (3,) on the vehicle, above the floor [m]
      camera_pan_rad: as camera_on_vehicle() has it
      camera_tilt_rad: alike
      margin_px: a lamp's rim is so far within the image [px]
      sigma_px: of a lamp's centre in the image [px]
      heading_sigma_rad: known beside the image; infinity: nothing [rad]
    """
def plan_render(scene: Scene, cam_from_world: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], *, seed: typing.SupportsInt | typing.SupportsIndex = 0, frame: typing.SupportsInt | typing.SupportsIndex = 0, noise: bool = True, noise_area: NoiseArea = ..., start_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, spacing_sigma: typing.SupportsFloat | typing.SupportsIndex = 1.0, velocity: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 1]"] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]) -> list[EffectPlan]:
    """
    Which effects simulate() renders with the same arguments, and what the others would change.

    Returns: an EffectPlan for each effect, in the order in which light meets them.
    Raises: ValueError as simulate() does.
    """
def plan_route(scene: Scene, start: PlanarPose, goals: collections.abc.Sequence[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]], *, min_lamps: typing.SupportsInt | typing.SupportsIndex = 1, max_sigma_m: typing.SupportsFloat | typing.SupportsIndex = ..., cell_m: typing.SupportsFloat | typing.SupportsIndex = 0.1, corner_radius_m: typing.SupportsFloat | typing.SupportsIndex = 0.3, vehicle_radius_m: typing.SupportsFloat | typing.SupportsIndex = 0.3, vehicle_height_m: typing.SupportsFloat | typing.SupportsIndex = 0.5, speed_m_s: typing.SupportsFloat | typing.SupportsIndex = 0.5, turn_cost_m: typing.SupportsFloat | typing.SupportsIndex = 0.02, camera_place_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = [0.0, 0.0, 1.5], camera_pan_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0, camera_tilt_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0, margin_px: typing.SupportsFloat | typing.SupportsIndex = 4.0, sigma_px: typing.SupportsFloat | typing.SupportsIndex = 0.1, heading_sigma_rad: typing.SupportsFloat | typing.SupportsIndex = 0.01) -> RoutePlan:
    """
    The shortest route over goals on which the lamps stay in view.

    start: PlanarPose. goals: (x_m, y_m) or (x_m, y_m, heading_rad) each, met to 0.71 of a cell. Where
    every way leads through places without view the status is blind, and `gaps` says which they are.

    >>> import libocc as occ
    >>> scene = occ.Scene.load("data/scenes/kookmin_four_lamps.yaml")
    >>> plan = occ.plan_route(scene, occ.PlanarPose(x_m=1, y_m=2), [(3, 2)])
    >>> plan.status.name, round(plan.route.length_m, 2)
    ('ok', 2.0)

    Options:
      min_lamps: in view everywhere
      max_sigma_m: of the place, everywhere [m]
      cell_m: of the lattice [m]
      corner_radius_m: [m]
      vehicle_radius_m: [m]
      vehicle_height_m: boxes above are driven under [m]
      speed_m_s: of the route [m/s]
      turn_cost_m: a corner counts as so much more way [m]
      camera_place_m: (3,) on the vehicle, above the floor [m]
      camera_pan_rad: as camera_on_vehicle() has it
      camera_tilt_rad: alike
      margin_px: a lamp's rim is so far within the image [px]
      sigma_px: of a lamp's centre in the image [px]
      heading_sigma_rad: known beside the image; infinity: nothing [rad]
    """
def planar_poses(bearings: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]", "flags.c_contiguous"], points_in_world_m: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]", "flags.c_contiguous"], *, up_in_cam: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], height_m: typing.SupportsFloat | typing.SupportsIndex, heading_rad: typing.SupportsFloat | typing.SupportsIndex | None = None) -> list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]]:
    """
    Poses of a camera whose tilt and height are known, by two points or one and a heading.

    bearings: (2, 3) or, with heading_rad, (1, 3), unit, camera frame. points_in_world_m: likewise.
    up_in_cam: (3,), the world's Z in the camera's frame. height_m: the camera's z.
    Returns: up to two poses, 4x4, that of the smaller misfit first; none where these tell no heading.
    Raises: ValueError for numbers that are not finite, bearings that are not unit and other counts.
    """
@typing.overload
def pose_bound(scene: Scene, cam_from_world: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], rung: Rung = Rung.direct, flux: FluxModel = FluxModel.ignore) -> PoseBound:
    """
    The Cramer-Rao bound of the pose from an image that the scene's camera would take.

    rung: from what of the image; direct: from every pixel. flux: what is known of the lamps' light.
    Returns: PoseBound; status too_few_lamps or degenerate where there is none.
    Raises: ValueError for a pose that is no rigid transform.
    """
@typing.overload
def pose_bound(points_in_world_m: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]", "flags.c_contiguous"], camera: Camera, cam_from_world: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], sigma_px: typing.SupportsFloat | typing.SupportsIndex | collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]) -> PoseBound:
    """
    The Cramer-Rao bound of the pose from image points.

    points_in_world_m: (n, 3). sigma_px: of a pixel coordinate, along each axis, one or for each point.
    Returns: PoseBound. Raises: ValueError for counts that differ or numbers that are not finite.
    """
def pose_candidates(bearings: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]", "flags.c_contiguous"], points_in_world_m: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]", "flags.c_contiguous"], solver: str = 'auto', *, origins_in_cam_m: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]", "flags.c_contiguous"] | None = None, up_in_cam: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] | None = None, tolerance_rad: typing.SupportsFloat | typing.SupportsIndex = 1e-06, polish: bool = True) -> PoseCandidates:
    """
    Every pose from which known points are seen along bearings, by any solver, guarded.

    bearings: (n, 3), a unit vector (camera frame) in each row. points_in_world_m: (n, 3).
    solver: a name in solvers(), or "auto". origins_in_cam_m: (n, 3), where each bearing starts, for
    several cameras on a rig. up_in_cam: (3,), the world's Z in the camera's frame, when known.
    tolerance_rad: of the misfit; noisy bearings need about 5 of their sigmas. polish: False for poses as
    the solver returns them.
    Returns: PoseCandidates. Their status is ok; too_few_lamps for fewer points than the solver takes;
    degenerate for points that coincide, lie on a line or not as the solver needs them; no_pose when
    none fits (the nearest may be in the value).
    Raises: ValueError for an unknown solver, numbers that are not finite or counts that differ.
    """
def position_covariance(cam_from_world: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], covariance: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 6]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
    """
    3x3 covariance [m^2, world] of the camera's position, from the 6x6 one of cam_from_world.
    """
def precision(network: Network, datum: Datum = ..., threads: typing.SupportsInt | typing.SupportsIndex = 2) -> Precision:
    """
    How well a network determines its unknowns, at its present state.

    It is the Cramer-Rao bound, also of a design that was never photographed. Returns: Precision; status
    degenerate: something is not determined, the message names it.
    """
def project_lamp_centre(lamp: Lamp, cam_from_world: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], camera: Camera) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 1]"] | None:
    """
    (2,) pixel of the centre of a lamp's image: of the ellipse of a disc, which is not where the
    disc's own centre projects. None as in project_rim().
    """
def project_rim(lamp: Lamp, cam_from_world: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], camera: Camera, count: typing.SupportsInt | typing.SupportsIndex = 64) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"] | None:
    """
    (n, 2) pixels of a lamp's rim, counter-clockwise seen from its lit side; one for a point lamp.

    None when the lamp shows its dark side or part of the rim is outside the lens model.
    """
def projection_uncertainty(camera: Camera, free_parameters: collections.abc.Sequence[str], covariance: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], *, columns: typing.SupportsInt | typing.SupportsIndex = 24, rows: typing.SupportsInt | typing.SupportsIndex = 18, range_m: typing.SupportsFloat | typing.SupportsIndex = ...) -> tuple[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"], float, float]:
    """
    How far a pixel of a calibrated camera may be off, over the image, as mrcal has it.

    What a small turn of the camera (at a finite range: and shift) would do alike does not count.
    Returns: sigma_px (rows, columns), its mean, its largest.
    """
def pure_pursuit(route: Route, vehicle: Vehicle, pose: PlanarPose, speed_m_s: typing.SupportsFloat | typing.SupportsIndex, turn_rate_rad_s: typing.SupportsFloat | typing.SupportsIndex = 0, along_m: typing.SupportsFloat | typing.SupportsIndex | None = None, options: PurePursuitOptions = ...) -> ControlOutput:
    """
    Regulated pure pursuit: an arc to the place of the route a look-ahead away.

    along_m: where the vehicle was on the route (the last output's place.along_m). Returns: ControlOutput.
    Source: Macenski, Singh, Martin, Gines, Autonomous Robots 47, 2023.
    """
def radiance(power_w: typing.SupportsFloat | typing.SupportsIndex, order: typing.SupportsFloat | typing.SupportsIndex, area_m2: typing.SupportsFloat | typing.SupportsIndex, cos_emission: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    Of a flat Lambertian lamp [W/(m^2 sr)].
    """
def radiant_intensity(power_w: typing.SupportsFloat | typing.SupportsIndex, order: typing.SupportsFloat | typing.SupportsIndex, cos_emission: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    Of a Lambertian lamp [W/sr]; 0 behind it.
    """
def read_camera(path: os.PathLike[str] | str) -> Camera:
    """
    Camera from a camera file of libocc, OpenCV or ROS (YAML), or from a scene file.

    Raises: FileNotFoundError or OSError when it cannot be opened; ValueError naming file, line, key.
    """
def read_image(path: os.PathLike[str] | str) -> numpy.typing.NDArray[numpy.uint8 | numpy.uint16]:
    """
    Reads an 8- or 16-bit image (PNG, JPEG, PGM, TIFF) as it is stored.

    Returns: (height, width) array, or (height, width, 3 or 4) in the order blue, green, red;
      uint8 or uint16.
    Raises: FileNotFoundError or OSError when the file cannot be opened; ValueError when it is not a
      whole image of a supported type.
    """
def received_power(scene: Scene, cam_from_world: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> ReceivedPower:
    """
    Power of the lamps' light that the scene's camera takes in, and how many it sees.

    cam_from_world: one pose (4, 4) or many (n, 4, 4). A lamp counts with the part of its face that is
    in the field of view, shines this way and is not hidden by boxes; blinking ones as while lit.
    Returns: ReceivedPower. Raises: ValueError for what is no rigid transform.

    >>> import libocc as occ
    >>> camera = occ.Camera.pinhole(width=64, height=48, fx_px=40, fy_px=40, cx_px=31.5, cy_px=23.5)
    >>> scene = occ.Scene(camera=camera, lamps=[occ.Lamp(id=7, centre_m=[0, 0, 3], radius_m=0.1)])
    >>> pose = occ.look_at(position_m=[0, 0, 1], target_m=[0, 0, 3], up=[0, 1, 0])
    >>> round(occ.dbm(float(occ.received_power(scene, pose).power_w)), 2)
    -59.01
    """
def recognise(blobs: collections.abc.Sequence[Blob], objects: collections.abc.Sequence[Object], camera: Camera, prior: Prior | None = None, *, max_false_alarms: typing.SupportsFloat | typing.SupportsIndex = 0.001, method: IdentifyMethod = ..., seed: typing.SupportsInt | typing.SupportsIndex = 0, index: LampIndex | None = None, use_frequency: bool = True, frequency_gate_sigma: typing.SupportsFloat | typing.SupportsIndex = 4.0, frequency_tolerance: typing.SupportsFloat | typing.SupportsIndex = 0.02, gate_sigma: typing.SupportsFloat | typing.SupportsIndex = 4.0, gate_model_sigma_px: typing.SupportsFloat | typing.SupportsIndex = 0.5, miss_penalty: typing.SupportsFloat | typing.SupportsIndex = 6.0, use_brightness: bool = True, light_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.2, max_hypotheses: typing.SupportsInt | typing.SupportsIndex = 1000000) -> Recognition:
    """
    Which of several objects are in an image, where, and how likely that is chance.

    max_false_alarms: an object is there when chance brings fewer, in such an image.
    Returns: Recognition. A blob is of one object; an object may be there twice.

    Options:
      method: how poses are searched for
      seed: of random namings
      index: LampIndex of the scene, for hashing
      use_frequency: name lamps by their blink code where there is one
      frequency_gate_sigma: code and blob agree within [sigma]
      frequency_tolerance: relative error of lamp and row clocks
      gate_sigma: projected lamp and blob agree within [sigma]
      gate_model_sigma_px: camera and map error in every gate [px]
      miss_penalty: chi-square for a lamp that should be seen but is not
      use_brightness: tell poses apart, and reflections from lamps, by brightness and size
      light_sigma: relative error of a predicted flux beyond the lamp's power_sigma
      max_hypotheses: poses tried at most
    """
def recover_response(images: collections.abc.Sequence[numpy.typing.NDArray[numpy.uint8 | numpy.uint16]], exposures_s: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], *, method: ResponseMethod = ..., black_level_dn: typing.SupportsFloat | typing.SupportsIndex = 0.0, bit_depth: typing.SupportsInt | typing.SupportsIndex = 0, smoothness: typing.SupportsFloat | typing.SupportsIndex = 1.0, basis_functions: typing.SupportsInt | typing.SupportsIndex = 3, max_places: typing.SupportsInt | typing.SupportsIndex = 1000) -> RecoveredResponse:
    """
    The camera's response from images of one still scene with several exposure times.

    Debevec and Malik, SIGGRAPH 1997, eq (3), by the noise that the pixels show, per channel; or a
    curve of a basis (Grossberg and Nayar, CVPR 2003) for two or three exposures.
    images: arrays of one shape, (height, width) or (height, width, 3), uint8 or uint16.
    exposures_s: exposure time of each [s]; only their ratios count.
    Returns: RecoveredResponse; its status is degenerate when the images do not determine the curve.
    Raises: ValueError for counts, shapes or times that do not fit, naming them.

    Options:
      method: levels: any curve; basis: of few coefficients
      black_level_dn: stored level without light
      bit_depth: 8 to 16; 0: 8, which 16-bit images must say otherwise
      smoothness: of `levels`, at least 1: Debevec and Malik's lambda
      basis_functions: of `basis`, 1 to 8
      max_places: flat places used per channel, at least 16
    """
def refine(start: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], matches: collections.abc.Sequence[Match], blobs: collections.abc.Sequence[Blob], scene: Scene, prior: Prior | None = None, *, rung: Rung = ..., flux: FluxModel = ..., model_sigma_px: typing.SupportsFloat | typing.SupportsIndex = 0.0, huber_sigma: typing.SupportsFloat | typing.SupportsIndex = 3.0, max_iterations: typing.SupportsInt | typing.SupportsIndex = 20, tolerance_px: typing.SupportsFloat | typing.SupportsIndex = 1e-05) -> Refined:
    """
    The most likely pose for a given naming of the blobs, with its covariance.

    start: 4x4 cam_from_world, for example a Hypothesis'. Returns: Refined.
    Raises: ValueError for a match outside its list.

    Options:
      rung: what of the image the pose has to explain
      flux: whether lamps' brightness counts, and what is known of it
      model_sigma_px: camera and map error per lamp [px]
      huber_sigma: residuals beyond this weigh linearly [sigma]
      max_iterations: steps of the refinement
      tolerance_px: converged when no lamp moves further [px]
    """
def resect(points_m: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]", "flags.c_contiguous"], points_px: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]", "flags.c_contiguous"], camera: Camera) -> Resection:
    """
    Where a camera of any model stood that saw known points; a third of them may be wrong.

    points_m: (n, 3), points_px: (n, 2). Returns: Resection. Raises: ValueError for counts that differ.
    """
def robust_pose(points_in_world_m: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]", "flags.c_contiguous"], points_px: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]", "flags.c_contiguous"], camera: Camera, sigma_px: typing.SupportsFloat | typing.SupportsIndex = 1.0, *, gate_sigmas: typing.SupportsFloat | typing.SupportsIndex = 4.0, confidence: typing.SupportsFloat | typing.SupportsIndex = 0.9999, max_iterations: typing.SupportsInt | typing.SupportsIndex = 100000, max_false_alarms: typing.SupportsFloat | typing.SupportsIndex = 0.0001, seed: typing.SupportsInt | typing.SupportsIndex = 0, up_in_cam: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] | None = None, up_sigma_rad: typing.SupportsFloat | typing.SupportsIndex = 0.01) -> RobustPose:
    """
    The pose that most points agree with, when many were matched wrongly.

    RANSAC with local optimisation, then least squares over the points that agree. points_in_world_m:
    (n, 3). points_px: (n, 2), where they were seen. sigma_px: of a right match's pixel coordinate.
    Returns: RobustPose. Its status is no_pose when no more points agree than chance explains or they
    contradict up_in_cam; ambiguous when several poses fit; too_few_lamps; degenerate for points that
    coincide or lie on a line.
    Raises: ValueError for counts that differ, numbers that are not finite, a bad option.

    Options:
      gate_sigmas: further off in the image a match is wrong
      confidence: that a sample without a wrong match was drawn
      max_iterations: samples
      max_false_alarms: poses as good as the best that chance alone would bring
      seed: the same answer for the same seed
      up_in_cam: (3,) the world's Z in the camera's frame, unit, when known: samples of two points
      up_sigma_rad: of up_in_cam, about each axis [rad]
    """
def route_conflicts(route: Route, scene: Scene, radius_m: typing.SupportsFloat | typing.SupportsIndex, height_m: typing.SupportsFloat | typing.SupportsIndex) -> list[RouteConflict]:
    """
    RouteConflicts of a disc of radius_m and height_m along the route, and at its dock; in their order.
    """
def select_parameters(network: Network, *, datum: Datum = ..., robust: bool = True, false_alarm: typing.SupportsFloat | typing.SupportsIndex = 0.01, max_correlation: typing.SupportsFloat | typing.SupportsIndex = 0.98, keep: collections.abc.Sequence[str] = []) -> Selection:
    """
    Drops free parameters backwards until all that are left are significant and told apart.

    false_alarm: level of significance. max_correlation: of two more alike, the less significant goes.
    keep: names that are never dropped. Returns: Selection.
    """
def simulate(scene: Scene, cam_from_world: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], *, seed: typing.SupportsInt | typing.SupportsIndex = 0, frame: typing.SupportsInt | typing.SupportsIndex = 0, noise: bool = True, noise_area: NoiseArea = ..., start_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, spacing_sigma: typing.SupportsFloat | typing.SupportsIndex = 1.0, velocity: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 1]"] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]) -> tuple[numpy.typing.NDArray[numpy.uint8 | numpy.uint16], Truth]:
    """
    Renders what the scene's camera sees of its lamps.

    cam_from_world: 4x4, see look_at(). Returns (image, truth): a (height, width) array, uint8 or
    uint16 by the sensor's bit depth, and a Truth.
    Raises: ValueError when the pose is not a rigid transform.

    >>> import libocc as occ
    >>> camera = occ.Camera.pinhole(width=64, height=48, fx_px=40, fy_px=40, cx_px=31.5, cy_px=23.5)
    >>> scene = occ.Scene(camera=camera, lamps=[occ.Lamp(id=7, centre_m=[0, 0, 3], radius_m=0.1)])
    >>> pose = occ.look_at(position_m=[0, 0, 1], target_m=[0, 0, 3], up=[0, 1, 0])
    >>> image, truth = occ.simulate(scene, cam_from_world=pose, seed=1)
    >>> image.shape, image.dtype.name, truth.lamps[0].centre_px.tolist()
    ((48, 64), 'uint8', [31.5, 23.5])

    Options:
      seed: of the noise; the same seed gives the same image
      frame: noise differs from frame to frame under one seed
      noise: shot and read noise
      noise_area: around lamps alone it is much faster
      start_s: time at which the first row's exposure begins [s]
      spacing_sigma: rim samples are this many PSF sigmas apart
      velocity: (6,) of the camera: d [rotation, translation] / dt of cam_from_world's left perturbation [rad/s, m/s]
    """
def simulate_test_field(design: TestFieldDesign) -> TestField:
    """
    A network with noise and its truth. Raises: ValueError naming what makes no sense.
    """
def smooth(frames: collections.abc.Sequence[SmootherFrame], odometry: collections.abc.Sequence[Odometry] = [], observations: collections.abc.Sequence[PoseObservation] = [], start: collections.abc.Sequence[typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]] | None = None, *, huber_sigmas: typing.SupportsFloat | typing.SupportsIndex = 3.0, link_gate: typing.SupportsFloat | typing.SupportsIndex = 1e-05, min_odometry_sigma_m: typing.SupportsFloat | typing.SupportsIndex = 1e-05, min_odometry_sigma_rad: typing.SupportsFloat | typing.SupportsIndex = 1e-06, walk_m: typing.SupportsFloat | typing.SupportsIndex = ..., walk_rad: typing.SupportsFloat | typing.SupportsIndex = ..., max_iterations: typing.SupportsInt | typing.SupportsIndex = 60) -> Smoothing:
    """
    The most likely poses of a body over time, all at once.

    frames: SmootherFrame, in the order of time. odometry: Odometry between them (chained, and cut where
    frames are), not overlapping. observations: PoseObservation, what images said of poses, or what is
    known of a pose beforehand. start: (4, 4) body_from_world for each time; None: found from the frames.
    Odometry that the rest contradicts is weighed down, and said in message and links. Time grows in
    proportion to the number of poses.
    Returns: Smoothing. Its status is degenerate when some poses are not determined (message and
    determined say which), too_few_lamps when none is; not_converged.
    Raises: ValueError for times that decrease, odometry that overlaps, numbers that are not finite.

    Options:
      huber_sigmas: a sighting further off counts less; 0: least squares
      link_gate: probability that a right odometry step is called a lie; 0: never
      min_odometry_sigma_m: added to each odometry step's sigmas [m]
      min_odometry_sigma_rad: alike [rad]
      walk_m: how far the body may go in a second without odometry; grows as sqrt(time) [m]
      walk_rad: alike, how far it may turn [rad]
      max_iterations: in each round of gating
    """
def smooth_planar(frames: collections.abc.Sequence[SmootherFrame], odometry: collections.abc.Sequence[PlanarOdometry] = [], observations: collections.abc.Sequence[PoseObservation] = [], priors: collections.abc.Sequence[PlanarPrior] = [], start: collections.abc.Sequence[PlanarPose] | None = None, height_m: typing.SupportsFloat | typing.SupportsIndex = 0.0, *, huber_sigmas: typing.SupportsFloat | typing.SupportsIndex = 3.0, link_gate: typing.SupportsFloat | typing.SupportsIndex = 1e-05, min_odometry_sigma_m: typing.SupportsFloat | typing.SupportsIndex = 1e-05, min_odometry_sigma_rad: typing.SupportsFloat | typing.SupportsIndex = 1e-06, walk_m: typing.SupportsFloat | typing.SupportsIndex = ..., walk_rad: typing.SupportsFloat | typing.SupportsIndex = ..., max_iterations: typing.SupportsInt | typing.SupportsIndex = 60) -> PlanarSmoothing:
    """
    The most likely poses of a vehicle on a floor over time, all at once: as smooth().

    odometry: PlanarOdometry. priors: PlanarPrior, what is known of poses beforehand. start: PlanarPose
    for each time. height_m: of the body's origin; it stands upright. Returns: PlanarSmoothing.

    Options:
      huber_sigmas: a sighting further off counts less; 0: least squares
      link_gate: probability that a right odometry step is called a lie; 0: never
      min_odometry_sigma_m: added to each odometry step's sigmas [m]
      min_odometry_sigma_rad: alike [rad]
      walk_m: how far the body may go in a second without odometry; grows as sqrt(time) [m]
      walk_rad: alike, how far it may turn [rad]
      max_iterations: in each round of gating
    """
def solve_pose(points_in_world_m: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]", "flags.c_contiguous"], points_px: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]", "flags.c_contiguous"], camera: Camera, solver: str = 'auto', sigma_px: typing.SupportsFloat | typing.SupportsIndex = 1.0, *, start: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"] | None = None, largest_misfit: typing.SupportsFloat | typing.SupportsIndex = 10.0, max_iterations: typing.SupportsInt | typing.SupportsIndex = 1000, sigmas_px: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = []) -> Fix:
    """
    The most likely pose from points whose names are known, with its covariance.

    points_in_world_m: (n, 3), n >= 3. points_px: (n, 2), where they were seen. solver: a name in
    solvers(), or "auto". sigma_px: of a pixel coordinate, along each axis. start: 4x4 cam_from_world
    close by, e.g. the last frame's, instead of a solver; other poses that fit are then not looked for.
    largest_misfit: chi2 / dof beyond which nothing is said to fit. sigmas_px: of each point, instead of
    sigma_px.
    Returns: Fix; status ambiguous when another pose fits nearly as well (all are in `candidates`),
    no_pose when none fits, too_few_lamps, degenerate, not_converged.
    Raises: ValueError for counts that differ, numbers that are not finite, an unknown solver.
    """
def solvers() -> list[Solver]:
    """
    Every pose solver, those for the fewest points first.
    """
def stanley(route: Route, vehicle: Vehicle, pose: PlanarPose, speed_m_s: typing.SupportsFloat | typing.SupportsIndex, turn_rate_rad_s: typing.SupportsFloat | typing.SupportsIndex = 0, along_m: typing.SupportsFloat | typing.SupportsIndex | None = None, options: StanleyOptions = ...) -> ControlOutput:
    """
    Stanley's controller: steers along the route and towards it. As pure_pursuit() otherwise.

    Source: Hoffmann, Tomlin, Montemerlo, Thrun, ACC 2007, eq. (5).
    """
def start_network(cameras: collections.abc.Sequence[tuple[str, Camera, collections.abc.Sequence[str]]], images: collections.abc.Sequence[tuple[str, typing.SupportsInt | typing.SupportsIndex, collections.abc.Sequence[AprilTag]]], *, tag_size_m: typing.SupportsFloat | typing.SupportsIndex, other_sizes_m: collections.abc.Mapping[typing.SupportsInt | typing.SupportsIndex, typing.SupportsFloat | typing.SupportsIndex] = {}, free_sizes: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex] = []) -> NetworkStart:
    """
    From AprilTags in images alone to a network that can be adjusted.

    cameras: (name, Camera, free parameters); images: (name, camera's index, AprilTags).
    other_sizes_m: of tags that have another. free_sizes: ids of tags whose size is only about known.
    Returns: NetworkStart; status too_few_lamps or degenerate (blocks that share nothing, by name).
    """
def start_pinhole(views: collections.abc.Sequence[tuple[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]", "flags.c_contiguous"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]", "flags.c_contiguous"]]], width: typing.SupportsInt | typing.SupportsIndex, height: typing.SupportsInt | typing.SupportsIndex) -> tuple[Camera, Status, str]:
    """
    (Camera, Status, message): a pinhole's focal length from planes, each ((n, 2) in the plane, (n, 2) [px]).
    """
def tag_poses(tag: AprilTag, size_m: typing.SupportsFloat | typing.SupportsIndex, camera: Camera) -> list[Candidate]:
    """
    Every pose from which a tag is seen as it is, best first: both minima of a plane.

    tag: AprilTag. size_m: side of the square whose corners are detected [m].
    Returns: Candidates whose world is the tag's frame: x right, y up, z towards the viewer.
    Raises: ValueError for a size that is not positive.
    """
def time_refine(image: numpy.typing.NDArray[numpy.uint8 | numpy.uint16], scene: Scene, cam_from_world: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], rung: Rung, min_time_s: typing.SupportsFloat | typing.SupportsIndex = 0.001) -> tuple[int, int, int, float]:
    """
    Lamps, rim points, pixels, and the time [s] of refining a pose by them; 0: none found.
    """
def variance_components(network: Network, datum: Datum = ...) -> VarianceComponents:
    """
    Sigmas of each camera's columns and rows from the residuals (Foerstner 1979).
    """
def vehicle_poses(lamps_m: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]", "flags.c_contiguous"], lamps_px: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]", "flags.c_contiguous"], camera: Camera, sigma_px: typing.SupportsFloat | typing.SupportsIndex, *, up_in_cam: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = ..., max_tilt_rad: typing.SupportsFloat | typing.SupportsIndex = 0.3) -> VehiclePoses:
    """
    Where a vehicle is, from three or more of its lamps whose places on it are known.

    lamps_m: (n, 3), vehicle's frame: x forward, y left, z up. lamps_px: (n, 2). max_tilt_rad: between
    the vehicle's z and up_in_cam. Returns: VehiclePoses; status as of solve_pose, and no_pose when none
    is upright. Raises: ValueError for counts that differ and numbers that are not finite.
    """
def view_gaps(scene: Scene, route: Route, *, min_lamps: typing.SupportsInt | typing.SupportsIndex = 1, max_sigma_m: typing.SupportsFloat | typing.SupportsIndex = ..., cell_m: typing.SupportsFloat | typing.SupportsIndex = 0.1, corner_radius_m: typing.SupportsFloat | typing.SupportsIndex = 0.3, vehicle_radius_m: typing.SupportsFloat | typing.SupportsIndex = 0.3, vehicle_height_m: typing.SupportsFloat | typing.SupportsIndex = 0.5, speed_m_s: typing.SupportsFloat | typing.SupportsIndex = 0.5, turn_cost_m: typing.SupportsFloat | typing.SupportsIndex = 0.02, camera_place_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = [0.0, 0.0, 1.5], camera_pan_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0, camera_tilt_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0, margin_px: typing.SupportsFloat | typing.SupportsIndex = 4.0, sigma_px: typing.SupportsFloat | typing.SupportsIndex = 0.1, heading_sigma_rad: typing.SupportsFloat | typing.SupportsIndex = 0.01) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 6]"]:
    """
    Where along a route too little is seen: (n, 6) as RoutePlan.gaps; options as of plan_route().
    """
def views_around(object: Object, distances_m: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], directions: typing.SupportsInt | typing.SupportsIndex = 100) -> list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]]:
    """
    cam_from_object (4x4 each) of cameras that look at an object's middle from all sides.
    """
def visibility(scene: Scene, poses: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]", "flags.c_contiguous"], *, camera_place_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = [0.0, 0.0, 1.5], camera_pan_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0, camera_tilt_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0, margin_px: typing.SupportsFloat | typing.SupportsIndex = 4.0, sigma_px: typing.SupportsFloat | typing.SupportsIndex = 0.1, heading_sigma_rad: typing.SupportsFloat | typing.SupportsIndex = 0.01) -> FloorVisibility:
    """
    What a vehicle would see from places of a floor, before it has been there.

    poses: (n, 3), x_m, y_m, heading_rad. Returns: FloorVisibility.

    >>> import libocc as occ
    >>> scene = occ.Scene.load("data/scenes/kookmin_four_lamps.yaml")
    >>> occ.visibility(scene, [[2, 2, 0], [0.5, 0.5, 0]]).lamps
    [[0, 1, 2, 3], [0]]

    Options:
      camera_place_m: (3,) on the vehicle, above the floor [m]
      camera_pan_rad: as camera_on_vehicle() has it
      camera_tilt_rad: alike
      margin_px: a lamp's rim is so far within the image [px]
      sigma_px: of a lamp's centre in the image [px]
      heading_sigma_rad: known beside the image; infinity: nothing [rad]
    """
def write_camera(path: os.PathLike[str] | str, camera: Camera, format: CameraFormat = ...) -> None:
    """
    Writes a camera file, whole or not at all; read_camera reads it back to the last bit.

    Raises: OSError when it cannot be written; ValueError when the format has no such model.
    """
def write_image(path: os.PathLike[str] | str, image: numpy.typing.NDArray[numpy.uint8 | numpy.uint16]) -> None:
    """
    Writes an image, whole or not at all; the format follows the name's extension.

    Raises: OSError when it cannot be written.
    """
__version__: str
