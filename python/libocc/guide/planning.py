# SPDX-License-Identifier: Apache-2.0
"""Planning before the runs of an experiment: a route, or the camera's pan and tilt along a route."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import PlanarPose, PlanStatus, Route, Scene, Vehicle, plan_pan_tilt, plan_route
from .sections import made, mapping, values_by_name, values_of

VIEW = ("margin_px", "sigma_px", "heading_sigma_rad")
OF_ROUTE = ("min_lamps", "max_sigma_m", "cell_m", "corner_radius_m", "vehicle_height_m", "speed_m_s", "turn_cost_m")
OF_PAN_TILT = (
    "min_lamps", "min_pan_rad", "max_pan_rad", "min_tilt_rad", "max_tilt_rad", "pans", "tilts", "pan_rate_rad_s",
    "tilt_rate_rad_s", "step_m", "sigma_cost_1_m",
)


@dataclass(frozen=True)
class Planned:
    kind: str  # route or pan_tilt
    status: str
    message: str
    seen_share: float  # fraction of the route's length with enough lamps in view
    pan_tilt: NDArray[np.float64] | None  # (n, 3): along_m, pan_rad, tilt_rad

    @property
    def ok(self) -> bool:
        return self.status == PlanStatus.ok.name


def called(plan: Callable[..., Any], *given: Any, **options: Any) -> Any:
    """Calls a planner; its errors name the section `plan`."""
    try:
        return plan(*given, **options)
    except (TypeError, ValueError) as error:
        raise ValueError(f"plan: {str(error).splitlines()[0]}") from error


def goals_of(section: Any) -> Sequence[tuple[float, ...]]:
    if not isinstance(section, list) or not section:
        raise ValueError(f"plan.goals must be a list of positions, got {section!r}")
    goals = []
    for i, goal in enumerate(section):
        where = f"plan.goals[{i}]"
        place = made(PlanarPose, values_of(goal, PlanarPose, where), where)
        heading = (place.heading_rad,) if "heading_deg" in mapping(goal, where) else ()
        goals.append((place.x_m, place.y_m, *heading))
    return goals


def planned_route(
    scene: Scene, section: dict[str, Any], view: dict[str, Any], vehicle: Vehicle
) -> tuple[Route, Planned]:
    """Plans a route. Raises: ValueError with the planner's message when there is none."""
    rest = {key: value for key, value in section.items() if key not in ("start", "goals")}
    start = made(PlanarPose, values_of(section.get("start"), PlanarPose, "plan.start"), "plan.start")
    options = values_by_name(rest, (*OF_ROUTE, *VIEW), "plan") | view
    goals = goals_of(section.get("goals"))
    plan = called(plan_route, scene, start, goals, vehicle_radius_m=vehicle.radius_m, **options)
    if plan.route is None:
        raise ValueError(f"plan: {plan.status.name}: {plan.message}")
    return plan.route, Planned("route", plan.status.name, plan.message, plan.seen_share, None)


def planned_pan_tilt(scene: Scene, route: Route, section: dict[str, Any], view: dict[str, Any]) -> Planned:
    options = values_by_name(section, (*OF_PAN_TILT, *VIEW), "plan")
    place = {key: value for key, value in view.items() if key == "camera_place_m"}
    plan = called(plan_pan_tilt, scene, route, **options, **place)
    return Planned("pan_tilt", plan.status.name, plan.message, plan.seen_share, np.asarray(plan.plan.knots))
