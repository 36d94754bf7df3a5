# SPDX-License-Identifier: Apache-2.0
"""Options of a command that give the pose of the camera."""

import functools
from collections.abc import Callable
from typing import Any, TypeVar

import click

from .._core import look_at as looking_at
from . import Failure, error_context
from .poses import pose_from_file, upward_pose

Function = TypeVar("Function", bound=Callable[..., Any])

OPTIONS = (
    click.option("--position", type=float, nargs=3, metavar="X Y Z", help="Position of the camera [m]."),
    click.option("--heading-deg", type=float, default=0, help="Azimuth of the image's +x axis."),
    click.option("--tilt-deg", type=float, default=0, help="Angle of the optical axis from the vertical."),
    click.option("--tilt-towards-deg", type=float, default=0, help="Azimuth of the tilt."),
    click.option("--look-at", type=float, nargs=3, metavar="X Y Z",
                 help="Point that the camera faces instead of facing up."),
    click.option("--pose", metavar="FILE", help="JSON with cam_from_world (4x4) instead of --position."),
)


def pose_options(function: Function) -> Function:
    """Adds the options to a command, which receives the pose (or None) as `cam_from_world`."""

    @functools.wraps(function)
    def command(
        *arguments: Any,
        position: tuple[float, float, float] | None,
        heading_deg: float,
        tilt_deg: float,
        tilt_towards_deg: float,
        look_at: tuple[float, float, float] | None,
        pose: str | None,
        **others: Any,
    ) -> Any:
        if position is not None and pose is not None:
            raise Failure("give either --position X Y Z or --pose FILE")
        cam_from_world = None
        if pose is not None:
            with error_context(pose):
                cam_from_world = pose_from_file(pose)
        elif position is None:
            if look_at is not None or heading_deg or tilt_deg or tilt_towards_deg:
                raise Failure("give --position X Y Z as well")
        elif look_at is not None:
            with error_context("--look-at"):
                cam_from_world = looking_at(position, look_at)
        else:
            cam_from_world = upward_pose(position, heading_deg, tilt_deg, tilt_towards_deg)
        return function(*arguments, cam_from_world=cam_from_world, **others)

    for option in reversed(OPTIONS):
        command = option(command)
    return command  # type: ignore[return-value]
