# SPDX-License-Identifier: Apache-2.0
"""Options of a command that say what is known of the pose before the image is looked at."""

import functools
import math
from collections.abc import Callable
from typing import Any, TypeVar

import click

from ._core import Prior
from .cli import blamed_on

Function = TypeVar("Function", bound=Callable[..., Any])

OPTIONS = (
    click.option("--prior-position", type=float, nargs=3, metavar="X Y Z", help="About where [m]."),
    click.option("--prior-position-sigma", type=float, default=0.5, show_default=True, help="[m]"),
    click.option("--prior-heading-deg", type=float, help="About which azimuth of the image's right."),
    click.option("--prior-heading-sigma-deg", type=float, default=20, show_default=True),
    click.option("--prior-gravity", type=float, nargs=3, metavar="X Y Z", help="Down, camera frame."),
    click.option("--prior-gravity-sigma-deg", type=float, default=1, show_default=True),
)


def prior_options(function: Function) -> Function:
    """Adds the options to a command, which gets them as `prior`."""

    @functools.wraps(function)
    def command(
        *arguments: Any,
        prior_position: tuple[float, float, float] | None,
        prior_position_sigma: float,
        prior_heading_deg: float | None,
        prior_heading_sigma_deg: float,
        prior_gravity: tuple[float, float, float] | None,
        prior_gravity_sigma_deg: float,
        **others: Any,
    ) -> Any:
        with blamed_on("prior"):
            prior = Prior(
                position_m=prior_position,
                position_sigma_m=prior_position_sigma,
                heading_rad=None if prior_heading_deg is None else math.radians(prior_heading_deg),
                heading_sigma_rad=math.radians(prior_heading_sigma_deg),
                gravity_in_cam=prior_gravity,
                gravity_sigma_rad=math.radians(prior_gravity_sigma_deg),
            )
        return function(*arguments, prior=prior, **others)

    for option in reversed(OPTIONS):
        command = option(command)
    return command  # type: ignore[return-value]
