# SPDX-License-Identifier: Apache-2.0
"""Schemas of experiments and routes."""

from collections.abc import Iterable
from typing import Any

from ..._core import (
    ClockJump,
    DockOptions,
    Drive,
    DriveNoise,
    Follower,
    LampFailure,
    LoopEstimation,
    LoopFaults,
    LoopOptions,
    OdometryFault,
    PaceOptions,
    PlanarFilterOptions,
    PlanarPose,
    PurePursuitOptions,
    RouteShape,
    StanleyOptions,
    Vehicle,
    WorldErrors,
)
from ...guide import experiment as files, planning, route_file as routes
from ...guide.sections import fields_of, key_of
from .structs import (
    FLAG,
    NUMBER,
    TEXT,
    WHOLE,
    Schema,
    described,
    document,
    listed,
    mapping,
    of_struct,
    vector,
    words,
)

PLACE = mapping(of_struct(PlanarPose()), may_be_empty=True)
COUNTS = ("min_lamps", "pans", "tilts")


def experiment() -> Schema:
    loop = of_struct(LoopOptions(), skip=files.ELSEWHERE)
    properties = {
        "scene": described(TEXT, "a file, relative to this file or the current folder, or an installed scene"),
        "focal_length_m": described(NUMBER, "focal length of another lens [m]"),
        "route": described({"anyOf": [{"type": "string"}, route()]}, "a file with a route, or its keys"),
        "plan": plan(),
        "runs": described(WHOLE, "number of runs"),
        "seed": described(WHOLE, "seed of the first run"),
        "vehicle": vehicle(),
        "controller": controller(),
        "docking": mapping(of_struct(DockOptions()), may_be_empty=True),
        "camera": mapping({"place_m": vector(3), "pan_deg": NUMBER, "tilt_deg": NUMBER}, may_be_empty=True),
        "tracker": tracker(),
        "estimation": words(*LoopEstimation.__members__),
        "faults": faults(),
        "world": world(),
        "docking_test": mapping(
            dict.fromkeys(("position_m", "heading_deg", "probability", "confidence"), NUMBER), may_be_empty=True
        ),
        "start": described(PLACE, "true pose at the start; default: start of the route"),
    }
    assert set(properties) == set(files.SECTIONS) - {"schema"}
    return document("libocc experiment", files.SCHEMA, {**properties, **loop}, ["scene"])


def route_file() -> Schema:
    return document("libocc route", routes.SCHEMA, route()["properties"], ["waypoints"])


def route() -> Schema:
    numbers = dict.fromkeys(("x_m", "y_m", "corner_radius_m", "speed_m_s"), NUMBER)
    properties = {
        "waypoints": listed(mapping(numbers, ["x_m", "y_m"])),
        "shape": words(*RouteShape.__members__),
        "closed": FLAG,
        "laps": WHOLE,
        "corner_radius_m": NUMBER,
        "speed_m_s": NUMBER,
        "dock": described(PLACE, "pose of the vehicle at the end"),
    }
    assert set(properties) == {"waypoints", *routes.OPTIONS}
    return mapping(properties, ["waypoints"])


def numbers_of(fields: Iterable[str]) -> dict[str, Schema]:
    return {key_of(field): WHOLE if field in COUNTS else NUMBER for field in fields}


def plan() -> Schema:
    """The keys depend on `kind`."""
    kind = {"kind": words("route", "pan_tilt")}
    goals = listed(PLACE, 1)
    return {
        "type": ["object", "null"],
        "if": {"properties": {"kind": {"const": "route"}}},
        "then": mapping(
            {**kind, "start": PLACE, "goals": goals, **numbers_of((*planning.OF_ROUTE, *planning.VIEW))},
            ["kind", "goals"],
            may_be_empty=True,
        ),
        "else": mapping({**kind, **numbers_of((*planning.OF_PAN_TILT, *planning.VIEW))}, ["kind"], may_be_empty=True),
    }


def vehicle() -> Schema:
    noise = mapping(of_struct(DriveNoise()), may_be_empty=True)
    own = {"drive": words(*Drive.__members__), "noise": noise}
    return mapping({**of_struct(Vehicle(), skip=own), **own}, may_be_empty=True)


def controller() -> Schema:
    kind = {
        "kind": {**words(*Follower.__members__), "default": Follower.pure_pursuit.name},
        "pace": mapping(of_struct(PaceOptions()), may_be_empty=True),
    }

    def of(options: Any) -> Schema:
        return mapping({**kind, **of_struct(options, skip=["pace"])}, may_be_empty=True)

    return {
        "type": ["object", "null"],
        "if": {"properties": {"kind": {"const": Follower.stanley.name}}, "required": ["kind"]},
        "then": of(StanleyOptions()),
        "else": of(PurePursuitOptions()),
    }


def tracker() -> Schema:
    loop = LoopOptions()
    own = ("floor", "mount_sigma_rad")  # not in degrees, as in Tracker
    skip = [field for field in fields_of(LoopOptions) if field not in files.OF_TRACKER or field in own]
    floor = mapping(of_struct(PlanarFilterOptions()), may_be_empty=True)
    return mapping({**of_struct(loop, skip=skip), "floor": floor, "mount_sigma_rad": NUMBER}, may_be_empty=True)


def world() -> Schema:
    lens = {"type": ["object", "null"], "additionalProperties": NUMBER}
    return mapping(
        {**of_struct(WorldErrors(), skip=["lens"]), "lens": described(lens, "errors of camera parameters by name")},
        may_be_empty=True,
    )


def faults() -> Schema:
    samples: dict[type, Any] = {
        LampFailure: LampFailure(lamp=0),
        OdometryFault: OdometryFault(from_s=0, to_s=1),
        ClockJump: ClockJump(at_s=0, by_s=0),
    }
    needed = {LampFailure: ["lamp"], OdometryFault: ["from_s", "to_s"], ClockJump: ["at_s", "by_s"]}
    lists = {
        key: listed(mapping(of_struct(samples[kind], defaults=False), needed[kind]))
        for key, kind in files.FAULTS.items()
    }
    lists["kidnappings"] = listed(mapping({"at_s": NUMBER, "to": PLACE}, ["at_s", "to"]))
    return mapping({**of_struct(LoopFaults(), skip=lists), **lists}, may_be_empty=True)
