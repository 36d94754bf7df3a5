# SPDX-License-Identifier: Apache-2.0
"""Routes from files with the schema `libocc-route/1`; the keys are listed in `data/experiments/README.md`."""

from typing import Any

from .._core import PlanarPose, Route, RouteShape, RouteWaypoint
from ..yaml_files import read_yaml, refuse_unknown
from .sections import chosen, made, mapping, number, values_of

SCHEMA = "libocc-route/1"
OPTIONS = ("shape", "closed", "laps", "corner_radius_m", "speed_m_s", "dock")


def load_route(path: str) -> Route:
    """Reads a route. Raises: OSError; ValueError naming the file, the key and its value."""
    data = read_yaml(path)
    try:
        if mapping(data, "route").get("schema") != SCHEMA:
            raise ValueError(f"schema must be {SCHEMA}, got {data.get('schema')!r}")
        return route_of({key: value for key, value in data.items() if key != "schema"})
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def route_of(data: Any) -> Route:
    """Route from the content of a file, or from the section `route` of an experiment."""
    section = mapping(data, "route")
    refuse_unknown(section, ("waypoints", *OPTIONS), "route")
    given = section.get("waypoints")
    if not isinstance(given, list):
        raise ValueError(f"route.waypoints must be a list, got {given!r}")
    waypoints = [waypoint_of(one, f"route.waypoints[{i}]") for i, one in enumerate(given)]
    options = {key: value for key, value in section.items() if key != "waypoints"}
    if "shape" in options:
        options["shape"] = chosen(options["shape"], RouteShape, "route.shape")
    if "dock" in options:
        options["dock"] = made(PlanarPose, values_of(options["dock"], PlanarPose, "route.dock"), "route.dock")
    for key in ("corner_radius_m", "speed_m_s"):
        if key in options:
            options[key] = number(options[key], f"route.{key}")
    for key, kind in (("closed", bool), ("laps", int)):
        if key in options and type(options[key]) is not kind:
            allowed = "true or false" if kind is bool else "a whole number"
            raise ValueError(f"route.{key} must be {allowed}, got {options[key]!r}")
    try:
        return Route(waypoints, **options)
    except ValueError as error:
        raise ValueError(f"route.{error}") from error


def waypoint_of(data: Any, where: str) -> RouteWaypoint:
    section = mapping(data, where)
    refuse_unknown(section, ("x_m", "y_m", "corner_radius_m", "speed_m_s"), where)
    values = {key: number(value, f"{where}.{key}") for key, value in section.items()}
    for key in ("x_m", "y_m"):
        if key not in values:
            raise ValueError(f"{where}.{key} is missing")
    return RouteWaypoint(position_m=[values.pop("x_m"), values.pop("y_m")], **values)
