# SPDX-License-Identifier: Apache-2.0
"""Vehicles guided by their position fixes: routes, visibility planning, controllers, docking and closed loop.

Files of experiments and routes are read by `load_experiment` and `load_route`.
"""

from .._core import (
    ClockJump,
    ControlOutput,
    DockOptions,
    DockOutput,
    DockPhase,
    Drive,
    DriveCommand,
    DriveLimited,
    DriveNoise,
    DriveState,
    DriveStep,
    FloorVisibility,
    Follower,
    Kidnapping,
    LampFailure,
    LoopEstimation,
    LoopFaults,
    LoopMetrics,
    LoopOptions,
    LoopOutcome,
    LoopResult,
    OdometryFault,
    PaceOptions,
    PanTiltPlan,
    PanTiltResult,
    PlanarPose,
    PlanStatus,
    PurePursuitOptions,
    Route,
    RouteConflict,
    RoutePlace,
    RoutePlan,
    RouteShape,
    RouteWaypoint,
    StanleyOptions,
    Vehicle,
    WorldErrors,
    camera_on_vehicle,
    closed_loop,
    dock,
    drive,
    heading_rad,
    plan_pan_tilt,
    plan_route,
    pure_pursuit,
    route_conflicts,
    stanley,
    view_gaps,
    visibility,
)
from .experiment import load_experiment
from .route_file import load_route

__all__ = [
    "ClockJump", "ControlOutput", "DockOptions", "DockOutput", "DockPhase", "Drive", "DriveCommand", "DriveLimited",
    "DriveNoise", "DriveState", "DriveStep", "FloorVisibility", "Follower", "Kidnapping", "LampFailure",
    "LoopEstimation", "LoopFaults", "LoopMetrics", "LoopOptions", "LoopOutcome", "LoopResult", "OdometryFault",
    "PaceOptions", "PanTiltPlan", "PanTiltResult", "PlanStatus", "PlanarPose", "PurePursuitOptions", "Route",
    "RouteConflict", "RoutePlace", "RoutePlan", "RouteShape", "RouteWaypoint", "StanleyOptions", "Vehicle",
    "WorldErrors", "camera_on_vehicle", "closed_loop", "dock", "drive", "heading_rad", "load_experiment", "load_route",
    "plan_pan_tilt", "plan_route", "pure_pursuit", "route_conflicts", "stanley", "view_gaps", "visibility",
]
