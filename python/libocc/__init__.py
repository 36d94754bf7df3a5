# SPDX-License-Identifier: Apache-2.0
"""Camera pose from an image of lamps: detection, identification, pose, refinement and tracking.

    import libocc as occ
    scene = occ.Scene.load("room.yaml")
    fix = occ.locate(occ.read_image("photo.png"), scene)
    print(fix.status, fix.position_m)

Units are metres, radians and pixels; pixel (0, 0) is the centre of the first pixel. World frame: z up. Camera frame:
x right, y down, z forward. `cam_from_world` is a 4x4 matrix that transforms points from the world to the camera frame.

This module has the names of everyday use:

- the model of a room and its files: Scene, Lamp, Room, Box, Tag, Sensor, Camera, Lens, Effects, read_camera,
  read_photometry, ...;
- images: read_image, write_image, look_at, simulate, Renderer, Trajectory, Truth, explain;
- one call for one image: locate, with Prior, Fix, Status, Candidate;
- the steps of locate: detect, identify, solve_pose, robust_pose, pose_candidates, refine, and their results;
- a stream of images: Tracker with Odometry and ImuSample;
- light over a plane: power_map, received_power.

Everything else has a submodule of its own, which is loaded at its first use: network, guide, codes, smoothing,
targets, photometry, objects, pose, rendering, bench; streams (sources of frames), maps (planes of cameras),
surveying (maps of lamps from pictures).
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from . import _moved
from ._core import (
    Blob,
    Box,
    Camera,
    CameraFormat,
    CameraKind,
    Candidate,
    Effects,
    Explanation,
    Fix,
    FluxModel,
    FluxUse,
    Hypothesis,
    Identification,
    IdentifyMethod,
    ImuSample,
    Lamp,
    LampIndex,
    LampResidual,
    LampShape,
    LampTruth,
    Lens,
    Match,
    Odometry,
    PoseCandidates,
    PoseCircle,
    PoseEstimate,
    Prior,
    ProtectionLevel,
    Readout,
    Refined,
    Renderer,
    Response,
    RobustPose,
    Room,
    Rung,
    Scene,
    Sensor,
    Solver,
    Status,
    Symmetry,
    SymmetryKind,
    Tag,
    Timing,
    TrackedFrame,
    Tracker,
    TrackerState,
    Trajectory,
    Truth,
    __version__,
    detect,
    encode_image,
    explain,
    identify,
    locate,
    look_at,
    p3p,
    pose_candidates,
    read_camera,
    read_image,
    read_photometry,
    received_power,
    refine,
    robust_pose,
    simulate,
    solve_pose,
    solvers,
    write_camera,
    write_image,
)
from .maps import PowerMap, power_map

if TYPE_CHECKING:
    from . import (
        bench as bench,
        codes as codes,
        guide as guide,
        maps as maps,
        network as network,
        objects as objects,
        photometry as photometry,
        pose as pose,
        rendering as rendering,
        smoothing as smoothing,
        streams as streams,
        surveying as surveying,
        targets as targets,
    )

__all__ = [
    "Blob", "Box", "Camera", "CameraFormat", "CameraKind", "Candidate", "Effects", "Explanation", "Fix", "FluxModel",
    "FluxUse", "Hypothesis", "Identification", "IdentifyMethod", "ImuSample", "Lamp", "LampIndex", "LampResidual",
    "LampShape", "LampTruth", "Lens", "Match", "Odometry", "PoseCandidates", "PoseCircle", "PoseEstimate", "PowerMap",
    "Prior", "ProtectionLevel", "Readout", "Refined", "Renderer", "Response", "RobustPose", "Room", "Rung", "Scene",
    "Sensor", "Solver", "Status", "Symmetry", "SymmetryKind", "Tag", "Timing", "TrackedFrame", "Tracker",
    "TrackerState", "Trajectory", "Truth", "__version__", "detect", "encode_image", "explain", "identify", "locate",
    "look_at", "p3p", "pose_candidates", "power_map", "read_camera", "read_image", "read_photometry",
    "received_power", "refine", "robust_pose", "simulate", "solve_pose", "solvers", "write_camera", "write_image",
]

_SUBMODULES = (*_moved.NEW_HOMES, "maps", "streams", "surveying")

_moved.install()


def __getattr__(name: str) -> Any:
    if name in _SUBMODULES:
        return import_module(f"{__name__}.{name}")
    return _moved.find_name(name)


def __dir__() -> list[str]:
    return sorted({*__all__, *_SUBMODULES})
