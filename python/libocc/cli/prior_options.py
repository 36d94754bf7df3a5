# SPDX-License-Identifier: Apache-2.0
"""Options of a command that give a prior of the pose."""

import functools
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click
import numpy as np
from numpy.typing import NDArray

from .._core import Prior
from . import error_context

Array = NDArray[np.float64]
Function = TypeVar("Function", bound=Callable[..., Any])

OPTIONS = (
    click.option("--prior-position", type=float, nargs=3, metavar="X Y Z", help="Approximate position [m]."),
    click.option("--prior-position-sigma", type=float, default=0.5, show_default=True, help="[m]"),
    click.option("--prior-height", type=float, metavar="Z", help="Approximate height [m]."),
    click.option("--prior-height-sigma", type=float, default=0.05, show_default=True, help="[m]"),
    click.option("--prior-heading-deg", type=float, help="Approximate azimuth of the image's +x axis."),
    click.option("--prior-heading-sigma-deg", type=float, default=20, show_default=True),
    click.option("--prior-gravity", type=float, nargs=3, metavar="X Y Z",
                 help="Direction of gravity in the camera frame."),
    click.option("--prior-gravity-sigma-deg", type=float, default=1, show_default=True),
    click.option("--prior-last-pose", metavar="FIX", help="Last fix: output of libocc locate --json."),
    click.option("--prior-moved", type=float, default=0.3, show_default=True,
                 help="Translation since the last fix, sigma [m]."),
    click.option("--prior-turned-deg", type=float, default=10, show_default=True,
                 help="Rotation since the last fix, sigma."),
)


def moved_fix(path: str, moved_m: float, turned_rad: float) -> tuple[Array, Array]:
    """Pose of a fix in a file, and its covariance enlarged by an unknown motion since then."""
    fix = json.loads(Path(path).read_text(encoding="utf-8"))
    for key in ("cam_from_world", "covariance"):
        if not isinstance(fix, dict) or fix.get(key) is None:
            raise ValueError(f"has no {key}; write the file with libocc locate --json")
    grown = np.diag([turned_rad**2] * 3 + [moved_m**2] * 3)
    return np.array(fix["cam_from_world"], float), np.array(fix["covariance"], float) + grown


def given(prior: Prior) -> Prior | None:
    """The prior, or None if it is empty. With any prior, blobs that are merged or cut are used for the pose."""
    values = (prior.position_m, prior.height_m, prior.heading_rad, prior.gravity_in_cam, prior.last_pose)
    return None if all(value is None for value in values) else prior


def prior_options(function: Function) -> Function:
    """Adds the options to a command, which receives them as `prior`."""

    @functools.wraps(function)
    def command(
        *arguments: Any,
        prior_position: tuple[float, float, float] | None,
        prior_position_sigma: float,
        prior_height: float | None,
        prior_height_sigma: float,
        prior_heading_deg: float | None,
        prior_heading_sigma_deg: float,
        prior_gravity: tuple[float, float, float] | None,
        prior_gravity_sigma_deg: float,
        prior_last_pose: str | None,
        prior_moved: float,
        prior_turned_deg: float,
        **others: Any,
    ) -> Any:
        last = None
        if prior_last_pose is not None:
            with error_context(prior_last_pose):
                last = moved_fix(prior_last_pose, prior_moved, math.radians(prior_turned_deg))
        with error_context("prior"):
            prior = Prior(
                position_m=prior_position,
                position_sigma_m=prior_position_sigma,
                height_m=prior_height,
                height_sigma_m=prior_height_sigma,
                heading_rad=None if prior_heading_deg is None else math.radians(prior_heading_deg),
                heading_sigma_rad=math.radians(prior_heading_sigma_deg),
                gravity_in_cam=prior_gravity,
                gravity_sigma_rad=math.radians(prior_gravity_sigma_deg),
                last_pose=last,
            )
        return function(*arguments, prior=prior, **others)

    for option in reversed(OPTIONS):
        command = option(command)
    return command  # type: ignore[return-value]
