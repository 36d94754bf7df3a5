# SPDX-License-Identifier: Apache-2.0
"""Experiments with a guided vehicle, read from files; the keys are listed in `data/experiments/README.md`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .. import samples
from .._core import (
    ClockJump,
    DockOptions,
    Drive,
    DriveNoise,
    Follower,
    Kidnapping,
    LampFailure,
    LoopEstimation,
    LoopFaults,
    LoopOptions,
    OdometryFault,
    PaceOptions,
    PanTiltPlan,
    PlanarFilterOptions,
    PlanarPose,
    PurePursuitOptions,
    Route,
    Scene,
    StanleyOptions,
    Vehicle,
    WorldErrors,
)
from ..maps import with_focal_length
from ..yaml_files import read_yaml, refuse_unknown
from .docking_test import DockingLimits
from .planning import Planned, planned_pan_tilt, planned_route
from .route_file import load_route, route_of
from .sections import chosen, fields_of, key_of, made, mapping, number, values_by_name, values_of

SCHEMA = "libocc-experiment/1"
FAULTS = {"lamp_failures": LampFailure, "odometry_faults": OdometryFault, "clock_jumps": ClockJump}
SECTIONS = (
    "schema", "scene", "focal_length_m", "route", "plan", "runs", "seed", "vehicle", "controller", "docking", "camera",
    "tracker", "estimation", "faults", "world", "docking_test", "start",
)
# Fields of LoopOptions that belong to other sections.
ELSEWHERE = {
    "vehicle", "follower", "pure_pursuit", "stanley", "docking", "estimation", "camera_place_m", "camera_pan_rad",
    "camera_tilt_rad", "pan_tilt", "start", "faults", "world", "seed", "floor", "gate_sigma", "gate_model_sigma_px",
    "coast_s", "coast_sigma_m", "confirmations", "mount_sigma_rad", "mount_sigma_m", "clock_sigma_s",
    "alert_limit_m", "integrity_risk",
}
# The section `tracker`: its keys are those of Tracker, so mount_sigma_rad is in radians.
OF_TRACKER = (
    "floor", "gate_sigma", "gate_model_sigma_px", "coast_s", "coast_sigma_m", "confirmations", "mount_sigma_rad",
    "mount_sigma_m", "clock_sigma_s", "alert_limit_m", "integrity_risk",
)


@dataclass(frozen=True)
class Experiment:
    scene: Scene
    scene_name: str
    route: Route
    options: LoopOptions  # with the seed of the first run
    runs: int
    limits: DockingLimits
    planned: Planned | None  # plan computed before the runs

    def of_run(self, index: int) -> LoopOptions:
        """Options of a run, with a seed of its own."""
        return self.options.replace(seed=self.options.seed + index)


def load_experiment(path: str) -> Experiment:
    """Reads an experiment. Raises: OSError; ValueError naming the file and the key."""
    data = read_yaml(path)
    try:
        return experiment_of(data, Path(path).parent)
    except ValueError as error:
        raise ValueError(str(error) if str(error).startswith(path) else f"{path}: {error}") from error


def experiment_of(data: Any, folder: Path) -> Experiment:
    """Experiment from the content of a file; file names are relative to `folder`, else to the current folder."""
    top = mapping(data, "experiment")
    options = [key_of(name) for name in fields_of(LoopOptions) if name not in ELSEWHERE]
    refuse_unknown(top, (*SECTIONS, *options), "experiment")
    if top.get("schema") != SCHEMA:
        raise ValueError(f"schema must be {SCHEMA}, got {top.get('schema')!r}")
    if not isinstance(top.get("scene"), str):
        raise ValueError(f"scene must be a file or the name of a scene, got {top.get('scene')!r}")
    scene = samples.load_scene(found(top["scene"], folder))
    if "focal_length_m" in top:
        scene = with_focal_length(scene, 1000 * number(top["focal_length_m"], "focal_length_m"))
    loop = loop_of(top, options)
    route, planned = planned_way(top, folder, scene, loop)
    if planned is not None and planned.pan_tilt is not None:
        loop["pan_tilt"] = PanTiltPlan(planned.pan_tilt)
    runs = top.get("runs", 1)
    if isinstance(runs, bool) or not isinstance(runs, int) or runs < 1:
        raise ValueError(f"runs must be a whole number above 0, got {runs!r}")
    limits = made(
        DockingLimits, limits_of(mapping(top.get("docking_test"), "docking_test")), "docking_test"
    )
    return Experiment(scene, top["scene"], route, made(LoopOptions, loop, "experiment"), runs, limits, planned)


def found(name: str, folder: Path) -> str:
    beside = folder / name
    return str(beside) if beside.is_file() else name


def limits_of(section: dict[str, Any]) -> dict[str, Any]:
    known = ("position_m", "heading_rad", "probability", "confidence")
    where = "docking_test"
    values = values_by_name(section, known, where)
    return {key: number(value, f"{where}.{key_of(key)}") for key, value in values.items()}


def planned_way(
    top: dict[str, Any], folder: Path, scene: Scene, loop: dict[str, Any]
) -> tuple[Route, Planned | None]:
    plan = mapping(top.get("plan"), "plan")
    kind = plan.get("kind")
    if plan and kind not in ("route", "pan_tilt"):
        raise ValueError(f"plan.kind must be route or pan_tilt, got {kind!r}")
    rest = {key: value for key, value in plan.items() if key != "kind"}
    view: dict[str, Any] = {
        name: loop[name] for name in ("camera_place_m", "camera_pan_rad", "camera_tilt_rad") if name in loop
    }
    if kind == "route":
        if "route" in top:
            raise ValueError("plan: kind must be pan_tilt because a route is given")
        return planned_route(scene, rest, view, loop["vehicle"])
    given = top.get("route")
    if isinstance(given, str):
        route = load_route(found(given, folder))
    elif given is not None:
        route = route_of(given)
    else:
        raise ValueError("route is missing: a file, a route's keys, or plan: {kind: route, ...}")
    return (route, planned_pan_tilt(scene, route, rest, view)) if kind else (route, None)


def loop_of(top: dict[str, Any], options: list[str]) -> dict[str, Any]:
    """Keyword arguments of LoopOptions."""
    loop = values_of({k: v for k, v in top.items() if k in options}, LoopOptions, "experiment")
    loop["vehicle"] = vehicle_of(mapping(top.get("vehicle"), "vehicle"))
    loop |= controller_of(mapping(top.get("controller"), "controller"))
    loop["docking"] = made(DockOptions, values_of(top.get("docking"), DockOptions, "docking"), "docking")
    loop |= camera_of(mapping(top.get("camera"), "camera"))
    loop |= tracker_of(mapping(top.get("tracker"), "tracker"))
    if "estimation" in top:
        loop["estimation"] = chosen(top["estimation"], LoopEstimation, "estimation")
    loop["faults"] = faults_of(mapping(top.get("faults"), "faults"))
    loop["world"] = world_of(mapping(top.get("world"), "world"))
    if "start" in top:
        loop["start"] = pose_of(top["start"], "start")
    seed = top.get("seed", 0)
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise ValueError(f"seed must be a whole number and not negative, got {seed!r}")
    loop["seed"] = seed
    return loop


def pose_of(section: Any, where: str) -> PlanarPose:
    return made(PlanarPose, values_of(section, PlanarPose, where), where)


def vehicle_of(section: dict[str, Any]) -> Vehicle:
    given: dict[str, Any] = {
        "noise": made(DriveNoise, values_of(section.get("noise"), DriveNoise, "vehicle.noise"), "vehicle.noise"),
        "drive": chosen(section.get("drive", "differential"), Drive, "vehicle.drive"),
    }
    rest = {k: v for k, v in section.items() if k not in given}
    return made(Vehicle, values_of(rest, Vehicle, "vehicle", given), "vehicle")


def controller_of(section: dict[str, Any]) -> dict[str, Any]:
    follower = chosen(section.get("kind", "pure_pursuit"), Follower, "controller.kind")
    kind = {Follower.pure_pursuit: PurePursuitOptions, Follower.stanley: StanleyOptions}[follower]
    where = "controller.pace"
    pace = made(PaceOptions, values_of(section.get("pace"), PaceOptions, where), where)
    rest = {k: v for k, v in section.items() if k not in ("kind", "pace")}
    values = values_of(rest, kind, "controller", {"pace": pace})
    return {"follower": follower, follower.name: made(kind, values, "controller")}


def camera_of(section: dict[str, Any]) -> dict[str, Any]:
    values = values_by_name(section, ("place_m", "pan_rad", "tilt_rad"), "camera")
    return {f"camera_{name}": value for name, value in values.items()}


def tracker_of(section: dict[str, Any]) -> dict[str, Any]:
    refuse_unknown(section, OF_TRACKER, "tracker")
    values = {k: v for k, v in section.items() if k != "floor"}
    if "floor" in section:
        where = "tracker.floor"
        values["floor"] = made(
            PlanarFilterOptions, values_of(section["floor"], PlanarFilterOptions, where), where
        )
    return values


def faults_of(section: dict[str, Any]) -> LoopFaults:
    given: dict[str, Any] = {}
    for key in (*FAULTS, "kidnappings"):
        items = section.get(key, [])
        if not isinstance(items, list):
            raise ValueError(f"faults.{key} must be a list, got {items!r}")
        given[key] = [fault_of(key, item, f"faults.{key}[{i}]") for i, item in enumerate(items)]
    rest = {k: v for k, v in section.items() if k not in given}
    return made(LoopFaults, values_of(rest, LoopFaults, "faults", given), "faults")


def world_of(section: dict[str, Any]) -> WorldErrors:
    given: dict[str, Any] = {}
    if "lens" in section:
        lens = mapping(section["lens"], "world.lens")
        given["lens"] = {str(name): number(error, f"world.lens.{name}") for name, error in lens.items()}
    rest = {key: value for key, value in section.items() if key not in given}
    return made(WorldErrors, values_of(rest, WorldErrors, "world", given), "world")


def fault_of(key: str, item: Any, where: str) -> Any:
    item = mapping(item, where)
    if key in FAULTS:
        return made(FAULTS[key], values_of(item, FAULTS[key], where), where)
    refuse_unknown(item, ("at_s", "to"), where)
    if item.get("to") is None:
        raise ValueError(f"{where}.to is missing: new pose of the vehicle with x_m, y_m, heading_deg")
    to = pose_of(item["to"], f"{where}.to")
    return made(Kidnapping, {"at_s": number(item.get("at_s"), f"{where}.at_s"), "to": to}, where)
